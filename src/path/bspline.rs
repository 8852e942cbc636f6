//! Cubic B-spline control points and the nodal points that the PH spline passes through.

use nalgebra::Vector2;

use super::{MAX_POINTS, PathError, check_coordinates};

/// The points that a spline passes through, with what closes its equations.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NodalPoints {
    /// `q_0 … q_M`; of a closed path `q_M = q_0` is included.
    pub(super) points: Vec<Vector2<f64>>,
    /// How the path ends.
    pub(super) ends: Ends,
}

/// What closes the equations of a spline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// The end is the start.
    Closed,
    /// Derivatives with respect to the parameter of the first and of the last segment at the ends \[mm\].
    Clamped(Vector2<f64>, Vector2<f64>),
}

fn check(points: &[Vector2<f64>], what: &'static str, needed: usize) -> Result<(), PathError> {
    let given = points.len();
    if given < needed {
        return Err(PathError::TooFewPoints { what, given, needed });
    }
    if given > MAX_POINTS {
        return Err(PathError::TooManyPoints { what, given });
    }
    check_coordinates(points)
}

impl NodalPoints {
    /// From the control points of a cubic B-spline with uniform knots.
    ///
    /// Open (at least 4 points): clamped knots, the curve at the distinct knots, end tangents `3 (P_1 - P_0)` and
    /// `3 (P_n - P_{n-1})`. Closed (at least 3, each given once): `q_j = (P_j + 4 P_{j+1} + P_{j+2})/6`.
    pub(super) fn from_control_points(control: &[Vector2<f64>], closed: bool) -> Result<Self, PathError> {
        let what = "control points";
        if closed {
            check(control, what, 3)?;
            let m = control.len();
            let at = |j: usize| control[j % m];
            let points = (0..=m).map(|j| j % m).map(|j| (at(j) + at(j + 1) * 4.0 + at(j + 2)) / 6.0).collect();
            return Ok(Self { points, ends: Ends::Closed });
        }
        check(control, what, 4)?;
        let n = control.len() - 1;
        let points = (0..=n - 2).map(|j| open_nodal_point(control, j)).collect();
        let ends = Ends::Clamped((control[1] - control[0]) * 3.0, (control[n] - control[n - 1]) * 3.0);
        Ok(Self { points, ends })
    }

    /// Given points: open (at least 2) with end tangents, or closed (at least 3, each given once).
    ///
    /// Without end tangents those of the parabola through the first (last) three points are taken (Bessel), with two
    /// points the chord.
    pub(super) fn from_points(
        given: &[Vector2<f64>],
        closed: bool,
        end_tangents: Option<(Vector2<f64>, Vector2<f64>)>,
    ) -> Result<Self, PathError> {
        let what = "nodal points";
        if closed {
            check(given, what, 3)?;
            let mut points = given.to_vec();
            points.push(given[0]);
            return Ok(Self { points, ends: Ends::Closed });
        }
        check(given, what, 2)?;
        let (start, end) = match end_tangents {
            Some((start, end)) => {
                check_coordinates(&[start, end])?;
                (start, end)
            }
            None if given.len() == 2 => (given[1] - given[0], given[1] - given[0]),
            None => {
                let n = given.len();
                (bessel(given[0], given[1], given[2]), -bessel(given[n - 1], given[n - 2], given[n - 3]))
            }
        };
        Ok(Self { points: given.to_vec(), ends: Ends::Clamped(start, end) })
    }
}

/// Derivative at `a` of the parabola through `a`, `b`, `c`, parametrised by chord length and scaled to one segment `a`-`b`.
fn bessel(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>) -> Vector2<f64> {
    let (first, second) = (b - a, c - b);
    let (h, k) = (first.norm(), second.norm());
    if k == 0.0 {
        return first;
    }
    first + (first - second * (h / k)) * (h / (h + k))
}

/// The open curve at knot `j`, by de Boor's recursion.
fn open_nodal_point(control: &[Vector2<f64>], j: usize) -> Vector2<f64> {
    let n = control.len() - 1;
    let knot = |i: usize| i.saturating_sub(3).min(n - 2) as f64;
    let span = (j + 3).min(n);
    let u = j as f64;
    let mut d = [control[span - 3], control[span - 2], control[span - 1], control[span]];
    for r in 1..=3 {
        for i in (r..=3).rev() {
            let (low, high) = (knot(span + i - 3), knot(span + i + 1 - r));
            let share = (u - low) / (high - low);
            d[i] = d[i - 1] + (d[i] - d[i - 1]) * share;
        }
    }
    d[3]
}
