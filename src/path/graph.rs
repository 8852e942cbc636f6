//! A planar curve near one of its points as the graph of a polynomial over its tangent, with a proven remainder.

use nalgebra::{Complex, Vector2};

/// How far the polynomial of a [`Graph`] may be from the curve \[mm\].
pub const GRAPH_ERROR_MM: f64 = 1e-7;

/// The curve `point + x t + y(x) n` with `y = c_2 x² + c_3 x³ + c_4 x⁴ + c_5 x⁵` for `from ≤ x ≤ to`, `n` the tangent `t` turned to
/// the left. Between these ends the polynomial is within [`GRAPH_ERROR_MM`] of the curve, measured along `n`, and the curve runs on
/// in the direction of rising `x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Graph {
    /// Where `x = y = 0` \[mm\].
    pub point_mm: Vector2<f64>,
    /// Unit tangent there.
    pub tangent: Vector2<f64>,
    /// `c_2 … c_5` \[1/mm, 1/mm², 1/mm³, 1/mm⁴\].
    pub coefficients: [f64; 4],
    /// Lowest `x`, not positive \[mm\].
    pub from_mm: f64,
    /// Highest `x`, not negative \[mm\].
    pub to_mm: f64,
}

/// Degree of the polynomial.
const DEGREE: usize = 5;
/// Degree of a quintic put into it.
const COMPOSED: usize = DEGREE * DEGREE;
/// Coefficients of a polynomial in the segment's parameter, from the constant one on.
type Series = [f64; COMPOSED + 1];

impl Graph {
    /// The graph of the quintic `point + Σ z_j η^j` (`z_1 … z_5`, `z_1` not zero) on `low ≤ η ≤ high` around `η = 0`, or on the
    /// part of it where the remainder is small enough.
    ///
    /// With `x(η)` along and `y(η)` across the tangent the coefficients are those of `y` as a series in `x`; what is left,
    /// `R(η) = y(η) - Σ c_j x(η)^j`, is a polynomial that begins with `η⁶`, and `|R| ≤ Σ |R_i| h^i` for `|η| ≤ h`.
    pub(super) fn of_quintic(point_mm: Vector2<f64>, z: [Complex<f64>; 5], low: f64, high: f64) -> Self {
        let speed = z[0].norm();
        let tangent = z[0] / speed;
        let local = z.map(|z| z * tangent.conj());
        let (mut x, mut y) = ([0.0; COMPOSED + 1], [0.0; COMPOSED + 1]);
        for (j, z) in local.iter().enumerate() {
            (x[j + 1], y[j + 1]) = (z.re, z.im);
        }
        // By the choice of the tangent.
        y[1] = 0.0;

        let mut coefficients = [0.0; DEGREE - 1];
        let mut rest = y;
        let mut power = x;
        let mut leading = speed;
        for (j, coefficient) in coefficients.iter_mut().enumerate() {
            power = product(&power, &x, DEGREE * (j + 2));
            leading *= speed;
            *coefficient = rest[j + 2] / leading;
            for (rest, power) in rest.iter_mut().zip(&power) {
                *rest -= *coefficient * power;
            }
        }

        let widest = low.abs().max(high.abs());
        let mut reach = widest.min(1.0);
        for _ in 0..200 {
            let remainder = rest.iter().skip(DEGREE + 1).rev().fold(0.0, |sum, c| sum * reach + c.abs());
            let bend = x
                .iter()
                .enumerate()
                .take(DEGREE + 1)
                .skip(2)
                .rev()
                .fold(0.0, |sum, (j, c)| sum * reach + j as f64 * c.abs());
            // x' stays above 3/4 of what it is at η = 0.
            if remainder * reach.powi(6) <= GRAPH_ERROR_MM && bend * reach <= 0.25 * speed {
                break;
            }
            reach *= 0.9;
        }
        let along = |eta: f64| local.iter().rev().fold(0.0, |sum, z| sum * eta + z.re) * eta;
        Self {
            point_mm,
            tangent: Vector2::new(tangent.re, tangent.im),
            coefficients,
            from_mm: along(low.max(-reach)).min(0.0),
            to_mm: along(high.min(reach)).max(0.0),
        }
    }
}

/// The product of two polynomials up to the power `degree`.
fn product(a: &Series, b: &Series, degree: usize) -> Series {
    let mut c = [0.0; COMPOSED + 1];
    for (i, &x) in a.iter().enumerate().take(degree + 1) {
        for (j, &y) in b.iter().enumerate().take(DEGREE + 1) {
            if i + j <= degree {
                c[i + j] += x * y;
            }
        }
    }
    c
}
