//! From a region and a surface to a linked tool path.
//!
//! 1. Rings: the boundary, then one step-over inside the other, each at the smallest step-over met on the one before; a tree.
//! 2. Projection: each ring is laid on the cutter-location surface ([`DesignSurface::rest`]).
//! 3. Fit: each ring becomes one NURBS curve, and for comparison a polyline.
//! 4. Links: rings follow each other on the surface along the branches of the tree; branches are joined by rapid moves.
//!
//! # What is promised
//! With the scallop height `h` and the tolerance `ε` the path tolerance is `ε' = min(ε, h/4)`. Every point of the path is within `ε'` of
//! the cutter at rest, so that no gouge is deeper than `ε'`. A cutter displaced by at most `ε'` contains the body that is smaller by `ε'`
//! on all sides; the rings are as far apart as that smaller body leaves ridges of at most `h`. On a plane this is the step-over of the
//! ridge `h'` with `h'(2r - h') = (r - ε')² - (r - h)²`, a little less than `h - ε'`. `ε'` is divided: rounding of the program
//! ([`Options::rounding_mm`], at most a quarter), twice the chords of the points that are fitted (4 % each), the fit.
//!
//! Rings are checked at sampled places; the machining check shows what lies between them. The sharp edge of a flat end
//! cuts steps into a slope: where a single pass leaves more than `h` under its axis, `r tan θ cos θ`, there is no tool path.
//!
//! Ridges are promised for every point that the cutter touches with its axis inside the first ring. Where the surface rises
//! inwards the first ring, whose axis is on the boundary, touches it further in than the boundary.
//!
//! # The step inwards
//! First guess: the smallest step-over on the rings of an area, by formula or measured ([`StepForm`]). Then the rings at that distance
//! are tried: the ridge between each place of an inner ring and the nearest of the outer ones, and what is left at corners, in
//! necks and where a lobe vanishes. On the bisector of a corner with the interior angle `α` there is a point `d/(1 + sin(α/2))` from
//! either ring, so that the distance must be less than the step-over there: up to a factor of 2, at which every point between is within half a
//! step-over of the outer ring already. The largest distance that leaves no ridge above `h` is taken, to 1 %. So the middle gets a ring
//! where it needs one.

mod cover;
mod error;
mod helix;
mod link;
mod moves;
mod nearest;
mod ridge;
mod rings;
mod shape;

use nalgebra::Vector3;
use rayon::prelude::*;

pub use error::PlanError;
pub use moves::{Move, Statistics, Stretch, ToolPath};
pub use rings::PlanRing;

use super::fit::{FitOptions, Method};
use super::guide::Region;
use super::{Cutter, DesignSurface, stepover};
use crate::path::MAX_COORDINATE_MM;
use link::Chain;
use ridge::{Point, Site};
use shape::Budget;

/// How the step-over is first estimated; whatever it is, rings are held to the measured ridge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum StepForm {
    /// The ridge between the cutter at two places, measured: every cutter, every surface.
    #[default]
    Measured,
    /// [`stepover::exact_mm`] with the surface's curvature across the path: ball-end cutters.
    Exact,
    /// [`stepover::fast_mm`], alike.
    Fast,
}

/// How rings follow each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// Closed rings, joined by links.
    #[default]
    Discrete,
    /// Along each branch one path that slides from each ring to the next, with a whole ring at either end.
    Continuous,
}

/// Where machining begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Order {
    /// With the outermost ring.
    #[default]
    OutsideIn,
    /// With the innermost rings.
    InsideOut,
}

/// What a tool path is to be like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Largest ridge `h` that may stay \[mm\].
    pub scallop_mm: f64,
    /// Largest distance `ε` of the path from the cutter-location surface \[mm\].
    pub tolerance_mm: f64,
    /// What of it may be used up by the rounding of a program \[mm\]; at most a quarter is.
    pub rounding_mm: f64,
    /// Degree of the curves.
    pub degree: usize,
    /// How they are fitted.
    pub fit: Method,
    /// How the step-over is estimated.
    pub step: StepForm,
    /// Distance of the first ring from the boundary \[mm\]; 0: the tool axis runs on the boundary.
    pub first_inset_mm: f64,
    /// How rings follow each other.
    pub form: Form,
    /// Where machining begins.
    pub order: Order,
    /// Height of rapid motions above the highest point of the surface \[mm\].
    pub clearance_mm: f64,
}

impl Options {
    /// Cubic curves, discrete rings from the outside in, the first one on the boundary, clearance 5 mm, rounding to 0.001 mm.
    pub fn new(scallop_mm: f64, tolerance_mm: f64) -> Self {
        Self {
            scallop_mm,
            tolerance_mm,
            rounding_mm: 1e-3,
            degree: 3,
            fit: Method::Density,
            step: StepForm::default(),
            first_inset_mm: 0.0,
            form: Form::default(),
            order: Order::default(),
            clearance_mm: 5.0,
        }
    }

    fn check(&self, cutter: &Cutter) -> Result<(), PlanError> {
        let &Self { scallop_mm, tolerance_mm, rounding_mm, first_inset_mm, clearance_mm, .. } = self;
        stepover::flat_mm(cutter.radius_mm(), scallop_mm).map_err(PlanError::BadScallop)?;
        if !(tolerance_mm > 0.0 && tolerance_mm <= MAX_COORDINATE_MM) {
            return Err(PlanError::BadTolerance { tolerance_mm });
        }
        let lengths = [("a rounding", rounding_mm), ("a first inset", first_inset_mm), ("a clearance", clearance_mm)];
        for (what, value_mm) in lengths {
            if !(0.0..=MAX_COORDINATE_MM).contains(&value_mm) {
                return Err(PlanError::BadLength { what, value_mm });
            }
        }
        // Before anything long begins.
        let fitting = FitOptions { degree: self.degree, method: self.fit, ..FitOptions::cubic(1.0) };
        super::fit::fit(&[Vector3::zeros(), Vector3::x()], &fitting)?;
        Ok(())
    }
}

/// Plans the tool path of `cutter` over `surface` inside of `region`. The same on any number of cores.
///
/// # Errors
/// Options out of range; a region with nothing left after the first inset; places where the cutter has nothing to rest on, where no
/// step-over keeps the ridge, or (by formula) where it does not fit into a hollow: the message says where.
pub fn plan(
    surface: &dyn DesignSurface,
    cutter: Cutter,
    region: &Region,
    options: &Options,
) -> Result<ToolPath, PlanError> {
    options.check(&cutter)?;
    let tolerance = options.tolerance_mm.min(0.25 * options.scallop_mm);
    let rounding_mm = options.rounding_mm.min(0.25 * tolerance);
    let budget = Budget::new(tolerance, rounding_mm);
    let site = Site::new(surface, cutter, options.scallop_mm, tolerance)?;
    let found = rings::rings(&site, region, options, budget.chord_mm)?;
    let [least_step_mm, largest_step_mm] = found.steps_mm.unwrap_or([0.0; 2]);
    let mut statistics = Statistics {
        rings: found.rings.len(),
        path_tolerance_mm: tolerance,
        rounding_mm,
        planned_scallop_mm: site.planned_mm,
        ridge_mm: found.ridge_mm,
        least_step_mm,
        largest_step_mm,
        ..Statistics::default()
    };
    let mut chains = link::chains(&found.rings, region);
    if options.order == Order::InsideOut {
        chains.reverse();
        for chain in &mut chains {
            chain.rings.reverse();
        }
    }
    statistics.chains = chains.len();
    statistics.air_moves = chains.len().saturating_sub(1);
    let lines: Vec<(usize, Line)> = chains
        .iter()
        .enumerate()
        .flat_map(|(index, chain)| {
            let lines = lines(chain, &found.rings, options, &site, largest_step_mm);
            lines.into_iter().map(move |line| (index, line))
        })
        .collect();
    let laid: Vec<Result<Laid, PlanError>> =
        lines.par_iter().map(|(_, line)| Laid::new(&site, line, options, budget)).collect();
    let mut moves = Vec::new();
    let height = surface.bounds_mm()[1].z + options.clearance_mm;
    let mut current = None;
    let mut before: Option<(usize, Vector3<f64>)> = None;
    for ((chain, line), laid) in lines.iter().zip(laid) {
        let laid = laid?;
        let start = laid.stretch.straight_mm[0];
        if current != Some(*chain) {
            rise(&mut moves, height);
            moves.push(Move::Rapid { to_mm: Vector3::new(start.x, start.y, height) });
            moves.push(Move::Plunge { to_mm: start });
            before = None;
            current = Some(*chain);
        }
        statistics.add(&laid);
        if line.smooth_before
            && let Some((_, direction)) = before
        {
            statistics.tangent_jump_rad = statistics.tangent_jump_rad.max(direction.angle(&laid.directions[0]));
        }
        before = Some((*chain, laid.directions[1]));
        moves.push(match line.level {
            Some(level) => Move::Cut { stretch: laid.stretch, level },
            None => Move::Link(laid.stretch),
        });
    }
    rise(&mut moves, height);
    let mut at: Option<Vector3<f64>> = None;
    for motion in &moves {
        let end = motion.end_mm();
        if let (Some(at), Move::Rapid { .. } | Move::Plunge { .. } | Move::Retract { .. }) = (at, motion) {
            statistics.air_length_mm += (end - at).norm();
        }
        at = Some(end);
    }
    Ok(ToolPath { moves, rings: found.rings, statistics })
}

fn rise(moves: &mut Vec<Move>, height: f64) {
    if let Some(last) = moves.last() {
        let at = last.end_mm();
        moves.push(Move::Retract { to_mm: Vector3::new(at.x, at.y, height) });
    }
}

/// A line in plan that becomes one motion.
struct Line {
    points: Vec<Point>,
    /// Level of its ring; none for a link.
    level: Option<usize>,
    /// Whether it goes on from the one before without a corner.
    smooth_before: bool,
}

/// The lines of a chain: each begins where the one before ends.
fn lines(chain: &Chain, rings: &[PlanRing], options: &Options, site: &Site<'_>, step: f64) -> Vec<Line> {
    let mut out = Vec::new();
    let ring = |index: usize| chain.rings[index].line.clone();
    let level = |index: usize| Some(rings[chain.rings[index].ring].level);
    let plain = |points: Vec<Point>, level: Option<usize>| Line { points, level, smooth_before: false };
    out.push(plain(ring(0), level(0)));
    let mut sliding = false;
    for k in 1..chain.rings.len() {
        let (from, to) = (&chain.rings[k - 1], &chain.rings[k]);
        let turn = (options.form == Form::Continuous && link::alike(&rings[from.ring], &rings[to.ring]))
            .then(|| helix::slide(from, to, 0.2 * site.flat_step_mm(), 2.2 * step))
            .flatten();
        if let Some(points) = turn {
            out.push(Line { points, level: level(k), smooth_before: true });
            sliding = true;
        } else {
            // The last turn of a helix is a whole ring.
            if sliding {
                out.push(Line { points: ring(k - 1), level: level(k - 1), smooth_before: true });
                sliding = false;
            }
            out.push(plain(vec![from.start(), to.start()], None));
            out.push(plain(ring(k), level(k)));
        }
    }
    if sliding {
        let last = chain.rings.len() - 1;
        out.push(Line { points: ring(last), level: level(last), smooth_before: true });
    }
    out
}

/// A line laid on the surface.
struct Laid {
    stretch: Stretch,
    error_mm: f64,
    corners: usize,
    /// At its start and at its end.
    directions: [Vector3<f64>; 2],
}

impl Laid {
    fn new(site: &Site<'_>, line: &Line, options: &Options, budget: Budget) -> Result<Self, PlanError> {
        let (points, places) = shape::lay(site, &line.points, budget.chord_mm)?;
        let corners: Vec<usize> = shape::corners(&line.points).into_iter().map(|i| places[i]).collect();
        let fitted = shape::curve(&points, &corners, options, budget.fit_mm)?;
        let straight_mm = shape::straight(&points, budget.straight_mm);
        let (low, high) = fitted.curve.domain();
        let directions = [low, high].map(|u| fitted.curve.derivatives::<2>(u)[1]);
        Ok(Self {
            stretch: Stretch { curve: fitted.curve, straight_mm },
            error_mm: fitted.error_mm,
            corners: fitted.corners,
            directions,
        })
    }
}

impl Statistics {
    fn add(&mut self, laid: &Laid) {
        let Stretch { curve, straight_mm } = &laid.stretch;
        self.control_points += curve.control_points_mm().len();
        self.straight_points += straight_mm.len();
        self.corners += laid.corners;
        self.length_mm += straight_mm.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum::<f64>();
        self.fit_error_mm = self.fit_error_mm.max(laid.error_mm);
    }
}
