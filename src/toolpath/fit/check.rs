//! The points to be fitted, and whether a curve keeps its distance to them and to their polygon.

use std::borrow::Cow;

use nalgebra::SVector;

use super::Candidate;
use super::parameters::{Parametrization, parameters};
use super::spline::{Spline, clamped};

/// Newton steps of a projection that begins near its end.
const STEPS: usize = 20;

/// Samples of the curve between two points.
const BETWEEN: usize = 8;

/// Up to this many points every number of control points is tried.
const EXHAUSTIVE_POINTS: usize = 1000;

/// What is fitted.
pub(super) struct Data<'a, const D: usize> {
    /// The points; where they are fewer than `degree + 1` their legs are divided.
    pub(super) points: Cow<'a, [SVector<f64, D>]>,
    /// Parts that each leg was divided into.
    parts: usize,
    given: &'a [SVector<f64, D>],
    pub(super) degree: usize,
    pub(super) tolerance: f64,
    /// First parameters.
    pub(super) start: Vec<f64>,
    /// Bulge of the points themselves on each leg.
    bulges: Vec<f64>,
}

impl<'a, const D: usize> Data<'a, D> {
    pub(super) fn new(given: &'a [SVector<f64, D>], degree: usize, tolerance: f64, kind: Parametrization) -> Self {
        let legs = given.len() - 1;
        let parts = if given.len() > degree { 1 } else { degree.div_ceil(legs) };
        let points = if parts == 1 {
            Cow::Borrowed(given)
        } else {
            let mut points = vec![given[0]];
            for pair in given.windows(2) {
                points.extend((1..parts).map(|k| pair[0] + (pair[1] - pair[0]) * (k as f64 / parts as f64)));
                points.push(pair[1]);
            }
            Cow::Owned(points)
        };
        let start = parameters(&points, kind);
        let bulges = bulges(&points);
        Self { points, parts, given, degree, tolerance, start, bulges }
    }

    /// The points as given.
    pub(super) fn given(&self) -> &'a [SVector<f64, D>] {
        self.given
    }

    /// Those of `parameters` that belong to given points.
    pub(super) fn given_only(&self, parameters: &[f64]) -> Vec<f64> {
        parameters.iter().step_by(self.parts).copied().collect()
    }

    pub(super) fn exhaustive(&self) -> bool {
        self.points.len() <= EXHAUSTIVE_POINTS
    }

    /// Least squares on these knots, the parameters corrected up to `rounds` times where that may lead to the tolerance.
    pub(super) fn attempt(&self, start: &[f64], interior: &[f64], rounds: usize) -> Option<Candidate<D>> {
        // Hopeless from here on.
        const FAR: f64 = 4.0;
        let mut parameters = Cow::Borrowed(start);
        for round in 0..=rounds {
            let knots = clamped(self.degree, interior);
            let spline = Spline::least_squares(self.degree, knots, &self.points, &parameters)?;
            let limit = if round == rounds { self.tolerance } else { FAR * self.tolerance };
            let mut nearest = parameters.to_vec();
            let worst = worst(&spline, &self.points, &mut nearest, limit);
            if worst <= self.tolerance {
                let candidate = Candidate { spline, parameters: nearest };
                return self.holds_between(&candidate).then_some(candidate);
            }
            if !(worst <= limit) {
                return None;
            }
            for ((t, known), q) in nearest.iter_mut().zip(parameters.iter()).zip(self.points.iter()) {
                if *t == *known {
                    *t = spline.project(q, *t, 3).0;
                }
            }
            parameters = Cow::Owned(nearest);
        }
        None
    }

    /// Whether the curve stays near the polygon between the points.
    pub(super) fn holds_between(&self, candidate: &Candidate<D>) -> bool {
        let mut off = 0.0_f64;
        between(&candidate.spline, &self.points, &candidate.parameters, |leg, distance| {
            off = off.max(distance - self.bulges[leg]);
            off <= self.tolerance
        });
        off <= self.tolerance
    }
}

/// Parameters of the points' nearest places and the largest distance.
pub(super) fn distances<const D: usize>(
    spline: &Spline<D>,
    points: &[SVector<f64, D>],
    start: &[f64],
) -> (Vec<f64>, f64) {
    let mut most = 0.0_f64;
    let parameters = points
        .iter()
        .zip(start)
        .map(|(q, &t)| {
            let (t, distance) = spline.project(q, t, STEPS);
            most = most.max(distance);
            t
        })
        .collect();
    (parameters, most)
}

/// Largest distance of a point, or a distance above `limit` as soon as one is met. Points that are near enough at their parameter
/// are not projected.
fn worst<const D: usize>(spline: &Spline<D>, points: &[SVector<f64, D>], parameters: &mut [f64], limit: f64) -> f64 {
    let mut most = 0.0_f64;
    for (q, t) in points.iter().zip(parameters) {
        let r = spline.point(*t);
        let here = (r - q).norm();
        if here > most {
            let (nearest, distance) = spline.project(q, *t, STEPS);
            *t = nearest;
            most = most.max(distance);
            if !(most <= limit) {
                return most;
            }
        }
    }
    most
}

/// Largest distance of the curve to the polygon.
pub(super) fn polygon_error<const D: usize>(spline: &Spline<D>, points: &[SVector<f64, D>], parameters: &[f64]) -> f64 {
    let mut most = 0.0_f64;
    between(spline, points, parameters, |_, distance| {
        most = most.max(distance);
        true
    });
    most
}

/// Tells `visit` the distance of the curve between neighbouring points to their leg or to the legs beside it, sample by sample, until
/// it returns false.
fn between<const D: usize>(
    spline: &Spline<D>,
    points: &[SVector<f64, D>],
    parameters: &[f64],
    mut visit: impl FnMut(usize, f64) -> bool,
) {
    let last = points.len() - 2;
    for (leg, pair) in parameters.windows(2).enumerate() {
        for k in 0..BETWEEN {
            let t = pair[0] + (pair[1] - pair[0]) * (k as f64 + 0.5) / BETWEEN as f64;
            let r = spline.point(t);
            let near = leg.saturating_sub(1)..=(leg + 1).min(last);
            let square = near.map(|i| leg_square(&points[i], &points[i + 1], &r)).fold(f64::INFINITY, f64::min);
            if !visit(leg, square.sqrt()) {
                return;
            }
        }
    }
}

/// Squared distance of `r` to the straight line from `a` to `b`.
fn leg_square<const D: usize>(a: &SVector<f64, D>, b: &SVector<f64, D>, r: &SVector<f64, D>) -> f64 {
    let along = b - a;
    let share = ((r - a).dot(&along) / along.norm_squared()).max(0.0).min(1.0);
    (r - a - along * share).norm_squared()
}

/// The sagitta of each leg at the larger one of the curvatures at its ends: that of the circle through a point and its neighbours.
fn bulges<const D: usize>(points: &[SVector<f64, D>]) -> Vec<f64> {
    let curvature = |i: usize| {
        if i == 0 || i + 1 >= points.len() {
            return 0.0;
        }
        let (a, b) = (points[i] - points[i - 1], points[i + 1] - points[i]);
        let (la, lb, lc) = (a.norm(), b.norm(), (a + b).norm());
        // 2 sin(angle)/chord.
        let cos = (a.dot(&b) / (la * lb)).max(-1.0).min(1.0);
        2.0 * ((1.0 - cos) * (1.0 + cos)).sqrt() / lc.max(1e-300)
    };
    points
        .windows(2)
        .enumerate()
        .map(|(i, pair)| {
            let leg = (pair[1] - pair[0]).norm();
            // Where the legs turn back there is no circle: never more than the half circle over the leg.
            (curvature(i).max(curvature(i + 1)) * leg * leg / 8.0).min(0.5 * leg)
        })
        .collect()
}
