//! Tool paths: what they leave and what they cut is measured here by other means than the planner's.

// Small whole numbers of cells and places.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]

use nalgebra::{Vector2, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use servosim::machining::{Blocks, Feeds, program};
use servosim::nc::{Action, Decimals, Dialect, Writing};
use servosim::toolpath::fit::Method;
use servosim::toolpath::guide::{Contour, Region};
use servosim::toolpath::plan::{Form, Move, Options, Order, PlanError, StepForm, ToolPath, plan};
use servosim::toolpath::{ContactLocation, Cutter, DesignSurface, SurfaceTop, stepover};

type P2 = Vector2<f64>;
type P3 = Vector3<f64>;

/// A smooth graph `z = f(x, y)` whose curvature radii are larger than the cutter's: a ball rests on it where its centre is on the normal.
struct Graph {
    /// `z`, `z_x`, `z_y`.
    f: Box<dyn Fn(f64, f64) -> [f64; 3] + Send + Sync>,
    bounds: [P3; 2],
}

impl Graph {
    fn new(f: impl Fn(f64, f64) -> [f64; 3] + Send + Sync + 'static) -> Self {
        Self { f: Box::new(f), bounds: [P3::new(-200.0, -200.0, -50.0), P3::new(200.0, 200.0, 20.0)] }
    }

    fn normal(&self, x: f64, y: f64) -> P3 {
        let [_, zx, zy] = (self.f)(x, y);
        P3::new(-zx, -zy, 1.0).normalize()
    }
}

impl DesignSurface for Graph {
    fn bounds_mm(&self) -> [P3; 2] {
        self.bounds
    }

    fn top(&self, x: f64, y: f64) -> Option<SurfaceTop> {
        let inside = x.abs() <= self.bounds[1].x && y.abs() <= self.bounds[1].y;
        inside.then(|| SurfaceTop { z_mm: (self.f)(x, y)[0], normal: self.normal(x, y) })
    }

    fn rest(&self, cutter: &Cutter, x: f64, y: f64) -> Option<ContactLocation> {
        assert!(cutter.is_ball());
        if !(x.abs() <= self.bounds[1].x && y.abs() <= self.bounds[1].y) {
            return None;
        }
        let r = cutter.radius_mm();
        let mut q = P2::new(x, y);
        for _ in 0..60 {
            let next = P2::new(x, y) - self.normal(q.x, q.y).xy() * r;
            // Damped: it converges where the curvature radius is not much larger than the cutter's too.
            let step = (next - q) * 0.7;
            q += step;
            if step.norm() < 1e-12 {
                break;
            }
        }
        let (z, normal) = ((self.f)(q.x, q.y)[0], self.normal(q.x, q.y));
        Some(ContactLocation { tip_z_mm: z + r * normal.z - r, contact_mm: P3::new(q.x, q.y, z), normal })
    }
}

fn plane(slope_x: f64, slope_y: f64) -> Graph {
    Graph::new(move |x, y| [slope_x * x + slope_y * y, slope_x, slope_y])
}

/// Radius > 0: the top of a ball; < 0: a hollow.
fn cap(radius: f64) -> Graph {
    Graph::new(move |x, y| {
        let z = (radius * radius - x * x - y * y).max(0.01 * radius * radius).sqrt();
        let sign = radius.signum();
        [sign * (z - radius.abs()), -sign * x / z, -sign * y / z]
    })
}

fn uniform(random: &mut Xoshiro256PlusPlus) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Waves whose curvature stays below 1/8 mm.
fn bumpy(seed: u64) -> Graph {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let waves: Vec<[f64; 4]> = (0..4)
        .map(|_| {
            let angle = std::f64::consts::TAU * uniform(&mut random);
            let k = 0.05 + 0.15 * uniform(&mut random);
            [k * angle.cos(), k * angle.sin(), std::f64::consts::TAU * uniform(&mut random), 0.03 / (k * k)]
        })
        .collect();
    Graph::new(move |x, y| {
        let mut out = [0.0; 3];
        for [a, b, phase, height] in &waves {
            let (sin, cos) = (a * x + b * y + phase).sin_cos();
            out[0] += height * sin;
            out[1] += height * a * cos;
            out[2] += height * b * cos;
        }
        out
    })
}

fn square(half: f64) -> Region {
    rectangle(half, half)
}

fn rectangle(a: f64, b: f64) -> Region {
    Region::new(Contour::polygon(&corners(0.0, 0.0, a, b)).unwrap(), Vec::new()).unwrap()
}

fn corners(x: f64, y: f64, a: f64, b: f64) -> [P2; 4] {
    [[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]].map(P2::from)
}

fn disc(radius: f64) -> Region {
    Region::new(Contour::circle(P2::zeros(), radius).unwrap(), Vec::new()).unwrap()
}

fn dumbbell() -> Region {
    let outline = [
        [-20., -8.],
        [-6., -8.],
        [-6., -1.2],
        [6., -1.2],
        [6., -8.],
        [20., -8.],
        [20., 8.],
        [6., 8.],
        [6., 1.2],
        [-6., 1.2],
        [-6., 8.],
        [-20., 8.],
    ];
    Region::new(Contour::polygon(&outline.map(P2::from)).unwrap(), Vec::new()).unwrap()
}

fn islands() -> Region {
    let contour = |x, y, a, b| Contour::polygon(&corners(x, y, a, b)).unwrap();
    Region::new(contour(0., 0., 18., 14.), vec![contour(-8., 2., 2., 3.), contour(7., -3., 3., 2.)]).unwrap()
}

fn ball(radius: f64) -> Cutter {
    Cutter::ball(radius).unwrap()
}

fn chain_ends(path: &ToolPath) {
    // Joined bit for bit, and closed.
    let mut at: Option<P3> = None;
    let mut cuts = 0;
    for motion in &path.moves {
        if let Move::Cut { stretch, .. } | Move::Link(stretch) = motion {
            let (points, straight) = (stretch.curve.control_points_mm(), &stretch.straight_mm);
            assert_eq!(Some(points[0]), at);
            assert_eq!((points[0], points[points.len() - 1]), (straight[0], straight[straight.len() - 1]));
            cuts += 1;
        }
        at = Some(motion.end_mm());
    }
    assert!(matches!(path.moves[0], Move::Rapid { .. }));
    assert!(matches!(path.moves[path.moves.len() - 1], Move::Retract { .. }));
    assert!(cuts > 0);
}

/// Tips along every motion on the surface, `pitch` apart; curves or polylines.
fn tips(path: &ToolPath, straight: bool, pitch: f64) -> Vec<P3> {
    let mut out = Vec::new();
    for motion in &path.moves {
        let (Move::Cut { stretch, .. } | Move::Link(stretch)) = motion else { continue };
        if straight {
            for leg in stretch.straight_mm.windows(2) {
                let parts = ((leg[1] - leg[0]).norm() / pitch).ceil().max(1.0) as usize;
                out.extend((0..=parts).map(|k| leg[0] + (leg[1] - leg[0]) * (k as f64 / parts as f64)));
            }
        } else {
            let (low, high) = stretch.curve.domain();
            let length: f64 = stretch.straight_mm.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
            let parts = (1.5 * length / pitch).ceil().max(2.0) as usize;
            out.extend((0..=parts).map(|k| stretch.curve.point_mm(low + (high - low) * (k as f64 / parts as f64))));
        }
    }
    out
}

/// Deepest gouge and highest ridge inside of the points touched from the first ring, both along the normal.
fn machined(surface: &Graph, cutter: Cutter, path: &ToolPath, straight: bool, grid: f64) -> (f64, f64, P2) {
    let r = cutter.radius_mm();
    let tips = tips(path, straight, 0.15);
    // Cells of tips.
    let cell = 1.0;
    let mut cells = std::collections::HashMap::<(i64, i64), Vec<P3>>::new();
    for tip in &tips {
        cells.entry(((tip.x / cell).floor() as i64, (tip.y / cell).floor() as i64)).or_default().push(*tip);
    }
    // A centre below the surface offset by r gouges: the distance of centres to the surface is checked at the places below.
    let first = &path.rings.iter().filter(|ring| ring.level == 0).collect::<Vec<_>>();
    let winds = |at: P2| {
        let mut odd = false;
        for ring in first {
            for (i, a) in ring.points_mm.iter().enumerate() {
                let b = ring.points_mm[(i + 1) % ring.points_mm.len()];
                odd ^= (a.y <= at.y) != (b.y <= at.y) && a.x + (b.x - a.x) * ((at.y - a.y) / (b.y - a.y)) > at.x;
            }
        }
        odd
    };
    let (mut gouge, mut ridge, mut place) = (0.0_f64, 0.0_f64, P2::zeros());
    let bounds = first.iter().flat_map(|ring| &ring.points_mm).fold(0.0_f64, |most, p| most.max(p.amax())) + r;
    let steps = (bounds / grid).ceil() as i64;
    for i in -steps..=steps {
        for j in -steps..=steps {
            let x = P2::new(i as f64 * grid, j as f64 * grid) + P2::new(0.011, 0.007);
            let normal = surface.normal(x.x, x.y);
            let z = (surface.f)(x.x, x.y)[0];
            // The tool axis when the cutter touches this point.
            let axis = x + normal.xy() * r;
            let mut lowest = f64::INFINITY;
            let reach = 3;
            let (cx, cy) = ((axis.x / cell).floor() as i64, (axis.y / cell).floor() as i64);
            for u in cx - reach..=cx + reach {
                for v in cy - reach..=cy + reach {
                    for tip in cells.get(&(u, v)).into_iter().flatten() {
                        let away = (tip.xy() - x).norm_squared();
                        if away < r * r {
                            lowest = lowest.min(tip.z + r - (r * r - away).sqrt());
                        }
                    }
                }
            }
            let left = (lowest - z) * normal.z;
            gouge = gouge.max(-left);
            if winds(axis) && left > ridge {
                (ridge, place) = (left, axis);
            }
        }
    }
    (gouge, ridge, place)
}

fn check(surface: &Graph, region: &Region, options: &Options) -> ToolPath {
    let cutter = ball(5.0);
    let path = plan(surface, cutter, region, options).unwrap();
    chain_ends(&path);
    for straight in [false, true] {
        let (gouge, ridge, at) = machined(surface, cutter, &path, straight, 0.3);
        let f = path.statistics;
        assert!(gouge <= f.path_tolerance_mm + 1e-9, "gouge {gouge} of {f:?} {options:?}");
        assert!(ridge <= options.scallop_mm * 1.003, "ridge {ridge} at {at} of {f:?} {options:?}");
        // And not for nothing.
        assert!(ridge > 0.6 * f.planned_scallop_mm, "ridge {ridge} of {f:?}");
    }
    path
}

/// Quick to fit.
fn options(scallop_mm: f64, tolerance_mm: f64) -> Options {
    Options { fit: Method::Density, ..Options::new(scallop_mm, tolerance_mm) }
}

#[test]
fn validates_step_overs_in_closed_form() {
    let cutter = ball(5.0);
    for (step, slope) in
        [(StepForm::Measured, 0.0), (StepForm::Measured, 1.0), (StepForm::Exact, 0.5), (StepForm::Fast, 0.0)]
    {
        // A plane of any slope: the passes are closest where they run along its contour lines, and that is where rings are held to it.
        // (The innermost step may be less.)
        let path = plan(&plane(slope, 0.0), cutter, &disc(8.0), &Options { step, ..options(0.3, 0.01) }).unwrap();
        let h = path.statistics.planned_scallop_mm;
        let w = stepover::flat_mm(5.0, h).unwrap() / (1.0_f64 + slope * slope).sqrt();
        let got = path.statistics.largest_step_mm;
        assert!((got - w).abs() < 0.02 * w, "{step:?} {slope}: {got} {w}");
    }
    // A cap: contacts are w apart on the sphere, the axes (R + r)/R times that along the arc's chord; in plan least where
    // it is steepest, so that on a small cap it is nearly that.
    for (step, radius) in [(StepForm::Measured, 60.0), (StepForm::Exact, -60.0)] {
        let path = plan(&cap(radius), cutter, &disc(6.0), &Options { step, ..options(0.1, 0.005) }).unwrap();
        let h = path.statistics.planned_scallop_mm;
        let w = stepover::exact_mm(5.0, h, radius).unwrap() * (radius + 5.0) / radius;
        // Slope of the axis' chord from ring to ring at the edge.
        let least = w * (1.0 - (6.0 / (radius + 5.0)).powi(2)).sqrt();
        // As on planes the innermost step may be less.
        let got = path.statistics.largest_step_mm;
        assert!(got < w * 1.003 && got > least * 0.985, "{step:?} {radius}: {least} {got} {w}");
    }
}

#[test]
fn validates_ridges_and_gouges_on_planes() {
    for (slope, region) in [(0.4, square(7.0)), (0.2, dumbbell())] {
        check(&plane(slope, 0.1), &region, &options(0.4, 0.05));
    }
}

#[test]
fn validates_ridges_and_gouges_on_bumpy_surfaces() {
    for (seed, form, order, tolerance) in
        [(0, Form::Discrete, Order::OutsideIn, 0.25), (1, Form::Continuous, Order::InsideOut, 0.05)]
    {
        check(&bumpy(seed), &square(8.0), &Options { form, order, ..options(0.4, tolerance) });
    }
}

#[test]
fn validates_every_ring_is_cut_once_and_links_rest_on_the_surface() {
    let surface = bumpy(7);
    for (region, order) in [(dumbbell(), Order::OutsideIn), (islands(), Order::InsideOut)] {
        {
            let path = plan(&surface, ball(5.0), &region, &Options { order, ..options(0.4, 0.05) }).unwrap();
            let cuts: Vec<_> = path
                .moves
                .iter()
                .filter_map(|m| if let Move::Cut { stretch, .. } = m { Some(stretch) } else { None })
                .collect();
            assert_eq!(cuts.len(), path.statistics.rings);
            for cut in &cuts {
                assert_eq!(cut.straight_mm[0], cut.straight_mm[cut.straight_mm.len() - 1]);
            }
            for motion in &path.moves {
                if let Move::Link(link) = motion {
                    for k in 0..=50 {
                        let (low, high) = link.curve.domain();
                        let at = link.curve.point_mm(low + (high - low) * f64::from(k) / 50.0);
                        let rest = surface.rest(&ball(5.0), at.x, at.y).unwrap();
                        assert!((at.z - rest.tip_z_mm).abs() < 2.0 * path.statistics.path_tolerance_mm);
                    }
                }
            }
            // Fewest rapid moves: one less than there are rings without children.
            let leaves = (0..path.rings.len()).filter(|&i| path.rings.iter().all(|r| r.parent != Some(i))).count();
            let plunges = path.moves.iter().filter(|m| matches!(m, Move::Plunge { .. })).count();
            assert_eq!((path.statistics.air_moves, plunges), (leaves - 1, leaves));
        }
    }
}

/// About the paper's part: 80 x 80 mm.
fn patch() -> Graph {
    Graph::new(|x, y| {
        let (u, v) = (x / 40.0, y / 40.0);
        let z = 6.0 * u * (1.0 - 0.6 * v * v) - 5.0 * v * v + 3.0 * u * u * u - 4.0 * u * u * v;
        let zu = 6.0 * (1.0 - 0.6 * v * v) + 9.0 * u * u - 8.0 * u * v;
        let zv = -7.2 * u * v - 10.0 * v - 4.0 * u * u;
        [z, zu / 40.0, zv / 40.0]
    })
}

fn lines(path: &ToolPath, shape: Blocks) -> servosim::nc::Written {
    let program = program(path, &Feeds { cut_mm_min: 3000.0, plunge_mm_min: 500.0 }, shape);
    let mut writing = Writing { tolerance_mm: path.statistics.rounding_mm, ..Writing::new(Dialect::Siemens) };
    writing.decimals = Decimals::choose(&program.blocks, &writing).unwrap();
    let mut text = Vec::new();
    let written = program.write(&mut text, writing).unwrap();
    let read = servosim::nc::Program::read(std::str::from_utf8(&text).unwrap(), "patch").unwrap();
    let curves = read.blocks.iter().filter(|b| matches!(b.action, Action::Nurbs(_))).count();
    assert_eq!(curves, written.curves);
    written
}

#[test]
fn validates_the_programs_of_a_tool_path() {
    let path = plan(&patch(), ball(5.0), &disc(15.0), &options(0.4, 0.01)).unwrap();
    let (nurbs, straight) = (lines(&path, Blocks::Nurbs), lines(&path, Blocks::Straight));
    // One curve a ring; links are straight or curves.
    assert!(nurbs.curves >= path.statistics.rings && nurbs.curves < 2 * path.statistics.rings);
    assert_eq!((straight.curves, straight.rapid), (0, nurbs.rapid));
    assert!(nurbs.lines < straight.lines, "{nurbs:?} {straight:?}");
    assert!(nurbs.rounding_mm <= path.statistics.rounding_mm);
}

#[test]
fn bad_input_is_named() {
    let (flat, cutter) = (plane(0.0, 0.0), ball(5.0));
    let of = |options: &Options, region: &Region| plan(&flat, cutter, region, options);
    for h in [0.0, -1.0, 5.0, f64::NAN] {
        assert!(matches!(of(&Options::new(h, 0.01), &square(5.0)), Err(PlanError::BadScallop(_))));
    }
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = of(&Options::new(0.1, tolerance), &square(5.0)).unwrap_err();
        assert!(matches!(error, PlanError::BadTolerance { .. }));
    }
    let error = of(&Options { degree: 0, ..Options::new(0.1, 0.1) }, &square(5.0)).unwrap_err();
    assert!(matches!(error, PlanError::Fit(_)));
    let error = of(&Options { first_inset_mm: 6.0, ..Options::new(0.1, 0.1) }, &square(5.0)).unwrap_err();
    assert!(matches!(error, PlanError::NothingLeft { .. }), "{error}");
    let error = of(&Options { clearance_mm: f64::NAN, ..Options::new(0.1, 0.1) }, &square(5.0)).unwrap_err();
    assert!(matches!(error, PlanError::BadLength { .. }));
    // Beside the surface.
    let error = of(&Options::new(0.1, 0.1), &square(300.0)).unwrap_err();
    assert!(matches!(error, PlanError::NoRest { .. }), "{error}");
}

#[test]
fn a_region_narrower_than_the_step_over_gets_one_ring() {
    let path = plan(&plane(0.0, 0.0), ball(5.0), &rectangle(15.0, 0.5), &Options::new(0.25, 0.01)).unwrap();
    assert_eq!(path.statistics.rings, 1);
    assert_eq!(path.statistics.air_moves, 0);
}
