//! Lines in plan laid on the cutter-location surface, and curves and polylines through them.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::ridge::{Point, Site};
use super::{Options, PlanError};
use crate::path::NurbsCurve;
use crate::toolpath::fit::{FitOptions, Parametrization, fit};

pub(super) type Place = Vector3<f64>;

/// Halvings of a leg in plan.
const DEEPEST: usize = 12;

/// Change of direction in plan from which on a point is a corner \[rad\].
const CORNER_RAD: f64 = 0.3;

/// Corners nearer to each other than this along the path are one, in tolerances.
const LEAST_PIECE: f64 = 4.0;

/// Points nearer to each other than this are one, in tolerances.
const LEAST_LEG: f64 = 1e-2;

/// What a path is allowed, in shares of the path tolerance.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_field_names)] // the unit
pub(super) struct Budget {
    /// Chords of the points that are laid on the surface.
    pub(super) chord_mm: f64,
    /// Fitted curves.
    pub(super) fit_mm: f64,
    /// Polylines.
    pub(super) straight_mm: f64,
}

impl Budget {
    /// The curve may be further from the chords than from the points by their bulge; rounding of a program takes its part too.
    pub(super) fn new(tolerance: f64, rounding: f64) -> Self {
        let chord_mm = 0.04 * tolerance;
        let rest = tolerance - rounding;
        Self { chord_mm, fit_mm: rest - 2.0 * chord_mm, straight_mm: rest - chord_mm }
    }
}

/// Corners of a line in plan: indices of points, without the ends.
pub(super) fn corners(line: &[Point]) -> Vec<usize> {
    let turned = |i: &usize| {
        let (u, v) = (line[*i] - line[i - 1], line[i + 1] - line[*i]);
        libm::atan2(u.perp(&v), u.dot(&v)).abs() > CORNER_RAD
    };
    (1..line.len().saturating_sub(1)).filter(turned).collect()
}

/// Lays a line in plan on the cutter-location surface: points whose chords are within `chord` of it where sampled, with the
/// line's own points; and where each of those is.
pub(super) fn lay(site: &Site<'_>, line: &[Point], chord: f64) -> Result<(Vec<Place>, Vec<usize>), PlanError> {
    let rest = |at: Point| {
        let pass = site.pass(at).ok_or(PlanError::NoRest { x_mm: at.x, y_mm: at.y })?;
        Ok::<_, PlanError>(Place::new(at.x, at.y, pass.tip_mm))
    };
    let given: Vec<Result<Place, PlanError>> = line.par_iter().map(|&at| rest(at)).collect();
    let given: Vec<Place> = given.into_iter().collect::<Result<_, _>>()?;
    let pitch = 0.4 * site.flat_step_mm();
    let legs: Vec<Result<Vec<Place>, PlanError>> = given
        .par_windows(2)
        .map(|pair| {
            let (a, b) = (pair[0], pair[1]);
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let parts = ((b - a).xy().norm() / pitch).ceil().max(1.0).min(1e6) as usize;
            let mut out = Vec::new();
            let mut from = a;
            for part in 1..=parts {
                let to = if part == parts { b } else { rest(a.xy() + (b - a).xy() * (part as f64 / parts as f64))? };
                divide(&rest, from, to, chord, DEEPEST, &mut out)?;
                from = to;
            }
            Ok(out)
        })
        .collect();
    let mut points = vec![given[0]];
    let mut places = vec![0];
    for leg in legs {
        points.extend(leg?);
        places.push(points.len() - 1);
    }
    Ok((points, places))
}

fn divide(
    rest: &impl Fn(Point) -> Result<Place, PlanError>,
    a: Place,
    b: Place,
    chord: f64,
    deeper: usize,
    out: &mut Vec<Place>,
) -> Result<(), PlanError> {
    let short = (b - a).xy().norm() < 4.0 * chord;
    if deeper > 0 && !short {
        let middle = rest((a.xy() + b.xy()) * 0.5)?;
        let off = |at: &Place| (at - on_line(&a, &b, at)).norm();
        // A quarter too: a wave may cross the chord in its middle.
        if off(&middle) > chord || off(&rest(a.xy() * 0.75 + b.xy() * 0.25)?) > chord {
            divide(rest, a, middle, chord, deeper - 1, out)?;
            return divide(rest, middle, b, chord, deeper - 1, out);
        }
    }
    out.push(b);
    Ok(())
}

fn on_line(a: &Place, b: &Place, at: &Place) -> Place {
    let along = b - a;
    let square = along.norm_squared();
    let share = if square > 0.0 { ((at - a).dot(&along) / square).max(0.0).min(1.0) } else { 0.0 };
    a + along * share
}

/// A curve and how well it fits.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) curve: NurbsCurve<3>,
    pub(super) error_mm: f64,
    /// Corners inside.
    pub(super) corners: usize,
}

/// One curve from the first to the last point. Between the corners it is fitted on its own, and the pieces become one curve with knots
/// as often repeated as the degree there: a corner costs one control point, where a smooth curve would need a cluster of knots to
/// go around it within a small tolerance.
pub(super) fn curve(
    points: &[Place],
    corners: &[usize],
    options: &Options,
    tolerance: f64,
) -> Result<Fitted, PlanError> {
    let fitting = FitOptions {
        degree: options.degree,
        tolerance_mm: tolerance,
        parametrization: Parametrization::Chord,
        method: options.fit,
    };
    // A piece no longer than the tolerance is no piece: the curve goes around such corners.
    let last = points.len() - 1;
    let mut ends = vec![0];
    for &corner in corners.iter().filter(|&&i| i > 0 && i < last) {
        let apart = |end: usize| longer(&points[end.min(corner)..=end.max(corner)], LEAST_PIECE * tolerance);
        if ends.last().is_none_or(|&before| apart(before)) && apart(last) {
            ends.push(corner);
        }
    }
    ends.push(last);
    let pieces: Vec<_> = ends
        .par_windows(2)
        .map(|pair| {
            let points = without_repeats(&points[pair[0]..=pair[1]], LEAST_LEG * tolerance);
            fit(&points, &fitting).map(|fitted| (fitted, length(&points)))
        })
        .collect();
    let degree = options.degree;
    let mut knots = vec![0.0; degree + 1];
    let mut control: Vec<Place> = Vec::new();
    let (mut from, mut error_mm) = (0.0, 0.0_f64);
    for piece in pieces {
        let (piece, length) = piece?;
        error_mm = error_mm.max(piece.error_mm);
        let own = piece.curve.knots();
        if !control.is_empty() {
            knots.extend(std::iter::repeat_n(from, degree));
        }
        knots.extend(own[degree + 1..own.len() - degree - 1].iter().map(|u| from + u * length));
        control.extend(piece.curve.control_points_mm().iter().skip(usize::from(!control.is_empty())));
        from += length;
    }
    knots.extend(std::iter::repeat_n(from, degree + 1));
    let curve = NurbsCurve::new(degree, knots, control, None)?;
    Ok(Fitted { curve, error_mm, corners: ends.len() - 2 })
}

fn length(points: &[Place]) -> f64 {
    points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum()
}

/// Whether a polyline is longer than this; looks no further than that.
fn longer(points: &[Place], than: f64) -> bool {
    let mut sum = 0.0;
    points.windows(2).any(|leg| {
        sum += (leg[1] - leg[0]).norm();
        sum > than
    })
}

/// Neighbours nearer than `least` joined, both ends kept.
fn without_repeats(points: &[Place], least: f64) -> Vec<Place> {
    let mut out: Vec<Place> = Vec::with_capacity(points.len());
    for point in points {
        if out.last().is_none_or(|last| (point - last).norm() > least) {
            out.push(*point);
        }
    }
    match (out.len(), points.last()) {
        // All in one place: the two ends.
        (1, Some(end)) => out.push(*end),
        (_, Some(end)) => {
            if let Some(last) = out.last_mut() {
                *last = *end;
            }
        }
        (_, None) => {}
    }
    out
}

/// The polyline through as few of the points as the tolerance allows, each leg as long as it can be.
pub(super) fn straight(points: &[Place], tolerance: f64) -> Vec<Place> {
    let holds = |from: usize, to: usize| {
        points[from + 1..to].iter().all(|at| (at - on_line(&points[from], &points[to], at)).norm() <= tolerance)
    };
    let mut out = vec![points[0]];
    let mut from = 0;
    while from + 1 < points.len() {
        // Doubling, then halving; a leg that fails now and holds further on is not sought.
        let (mut good, mut reach) = (from + 1, 2);
        while from + reach < points.len() && holds(from, from + reach) {
            good = from + reach;
            reach *= 2;
        }
        let mut bad = (from + reach).min(points.len());
        while bad - good > 1 {
            let middle = good.midpoint(bad);
            if holds(from, middle) { good = middle } else { bad = middle }
        }
        out.push(points[good]);
        from = good;
    }
    out
}
