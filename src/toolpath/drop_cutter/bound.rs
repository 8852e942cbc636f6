//! Proofs that a cutter cannot rest higher on a Bezier patch.
//!
//! The cutter's bottom lies above a paraboloid that touches it at a place `x` of the plan,
//! `g(q) ≥ g(x) + ∇g·(q - x) + μ/2 |q - x|²`, so that `f = Q_z - g(Q_xy)` stays below a target `T` on a patch where
//!
//! ```text
//! φ = w (L·Q - T) ≤ w μ/2 |Q_xy - x|²          L·Q = Q_z - g(x) - ∇g·(Q_xy - x)
//! ```
//!
//! `φ` is a polynomial: its Bernstein coefficients bound it, their second differences its Hessian. Two proofs:
//!
//! - no coefficient of `φ` is above `μ/2` times the square of the distance from `x` to the patch's box;
//! - around the parameters of the point above `x`, with `D = w (Q_xy - x)`, `|D| ≥ |J δ| (1 - η)`: the Hessian of `φ` stays below
//!   `μ (1 - η)² JᵀJ / max w` all over the patch. That is where the surface is less curved than the cutter: one contact.

use nalgebra::{Matrix2, Vector2, Vector3, Vector4};

use super::facet::Profile;
use super::net::{Net, bernstein};

/// A paraboloid under the cutter's bottom; coordinates are the surface's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Support {
    pub(super) at: Vector2<f64>,
    gradient: Vector2<f64>,
    height: f64,
    mu: f64,
}

impl Support {
    /// Where the surface with (upward) `normal` touches the cutter at `contact`.
    pub(super) fn new(profile: &Profile, axis: Vector2<f64>, contact: Vector2<f64>, normal: Vector3<f64>) -> Self {
        let d = contact - axis;
        let rho = d.norm();
        let out = if rho > 0.0 { d / rho } else { Vector2::x() };
        if profile.corner == 0.0 {
            // The rim bears any push outwards: as much as the surface's slope.
            let slope = -normal.xy().dot(&out) / normal.z.max(1e-6);
            if rho < profile.radius * (1.0 - 1e-9) || !(slope > 0.0) {
                return Self { at: contact, gradient: Vector2::zeros(), height: 0.0, mu: 0.0 };
            }
            let at = axis + out * profile.radius;
            return Self { at, gradient: out * slope, height: 0.0, mu: slope / profile.radius };
        }
        // Not where the round stands upright.
        let rho = rho.min(profile.flat + profile.corner * (1.0 - 1e-12));
        let (sin, cos) = profile.slope(rho);
        let (slope, height) = (sin / cos, profile.height(rho));
        let radial = 1.0 / (profile.corner * cos);
        let mu = if profile.flat == 0.0 {
            radial
        } else if slope > 0.0 {
            // Around the axis; along the radius on the round, and as far as the axis across the disc.
            (slope / rho).min(radial).min(2.0 * (slope * rho - height) / (rho * rho)).max(0.0)
        } else {
            0.0
        };
        Self { at: axis + out * rho, gradient: out * slope, height, mu }
    }

    /// `φ` of a homogeneous control point.
    #[inline]
    fn phi(&self, a: &Vector4<f64>, target: f64) -> f64 {
        let offset = self.gradient.dot(&self.at) - self.height - target;
        a.z - self.gradient.x * a.x - self.gradient.y * a.y + offset * a.w
    }

    /// Whether the cutter surely stays below `target` on the whole patch, by its coefficients.
    pub(super) fn excludes(&self, net: &Net, [low, high]: &[Vector3<f64>; 2], target: f64) -> bool {
        let dx = (low.x - self.at.x).max(self.at.x - high.x).max(0.0);
        let dy = (low.y - self.at.y).max(self.at.y - high.y).max(0.0);
        let target = target + 0.5 * self.mu * (dx * dx + dy * dy);
        net.points.iter().all(|a| self.phi(a, target) <= 0.0)
    }

    /// Whether the cutter surely stays below `target` on the whole patch, by curvature around the patch's own `(s, t)`, the point
    /// above the support.
    #[allow(clippy::needless_range_loop)] // i and j are those of the net
    pub(super) fn excludes_around(&self, net: &Net, own: Vector2<f64>, target: f64) -> bool {
        let [p, q] = net.degree;
        let (n, m) = (p as f64, q as f64);
        let width = q + 1;
        let phi = |i: usize, j: usize| self.phi(&net.points[i * width + j], target);
        let (bu, bv) = (bernstein(p, own.x), bernstein(q, own.y));
        let (mut value, mut gradient) = (0.0, Vector2::zeros());
        let (mut uu, mut vv) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let (mut uv_low, mut uv_high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..=p {
            for j in 0..=q {
                let here = phi(i, j);
                value += here * bu[0][i] * bv[0][j];
                gradient += Vector2::new(bu[1][i] * bv[0][j], bu[0][i] * bv[1][j]) * here;
                if i >= 2 {
                    uu = uu.max(n * (n - 1.0) * (phi(i - 2, j) - 2.0 * phi(i - 1, j) + here));
                }
                if j >= 2 {
                    vv = vv.max(m * (m - 1.0) * (phi(i, j - 2) - 2.0 * phi(i, j - 1) + here));
                }
                if i >= 1 && j >= 1 {
                    let mixed = n * m * (phi(i - 1, j - 1) - phi(i - 1, j) - phi(i, j - 1) + here);
                    (uv_low, uv_high) = (uv_low.min(mixed), uv_high.max(mixed));
                }
            }
        }
        // Linear that way: no second derivative.
        let (uu, vv) = (if p < 2 { 0.0 } else { uu }, if q < 2 { 0.0 } else { vv });
        let plan = Plan::new(net, self.at);
        let heaviest = net.points.iter().map(|a| a.w).fold(0.0, f64::max);
        let keep = (1.0 - plan.spread).max(0.0);
        let curved = plan.jacobian.tr_mul(&plan.jacobian) * (self.mu * keep * keep / heaviest);
        let (a, c) = (curved.m11 - uu, curved.m22 - vv);
        let b = (curved.m12 - uv_low).abs().max((curved.m12 - uv_high).abs());
        let least = 0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt();
        let far = own.sup(&(Vector2::repeat(1.0) - own));
        let excess = 0.5 * (-least).max(0.0) * far.norm_squared();
        let rise = |slope: f64, s: f64| (slope * (1.0 - s)).max(-slope * s);
        let whole = value + rise(gradient.x, own.x) + rise(gradient.y, own.y) + excess;
        whole <= 0.0
    }
}

/// How a patch lies in plan, seen from `x`: `D = w (Q_xy - x)` has the Jacobian `J` in the mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    pub(super) jacobian: Matrix2<f64>,
    /// `η`: how far the Jacobian strays from its mean, as a share of what it does at least; `D` is one to one where `η < 1`.
    pub(super) spread: f64,
    /// Smallest singular value of the Jacobian.
    pub(super) least: f64,
}

impl Plan {
    pub(super) fn new(net: &Net, x: Vector2<f64>) -> Self {
        let [p, q] = net.degree;
        let width = q + 1;
        let d = |i: usize, j: usize| {
            let a = &net.points[i * width + j];
            Vector2::new(a.x - x.x * a.w, a.y - x.y * a.w)
        };
        let along = |i: usize, j: usize| (d(i + 1, j) - d(i, j)) * p as f64;
        let across = |i: usize, j: usize| (d(i, j + 1) - d(i, j)) * q as f64;
        let (mut u, mut v) = (Vector2::zeros(), Vector2::zeros());
        for i in 0..=p {
            for j in 0..=q {
                if i < p {
                    u += along(i, j)
                }
                if j < q {
                    v += across(i, j)
                }
            }
        }
        u /= (p * (q + 1)) as f64;
        v /= ((p + 1) * q) as f64;
        let (mut du, mut dv) = (0.0_f64, 0.0_f64);
        for i in 0..=p {
            for j in 0..=q {
                if i < p {
                    du = du.max((along(i, j) - u).norm_squared())
                }
                if j < q {
                    dv = dv.max((across(i, j) - v).norm_squared())
                }
            }
        }
        let jacobian = Matrix2::from_columns(&[u, v]);
        // Smallest singular value.
        let (square, det) = (u.norm_squared() + v.norm_squared(), jacobian.determinant());
        let root = (square * square - 4.0 * det * det).max(0.0).sqrt();
        let least = det.abs() / (0.5 * (square + root)).sqrt();
        let spread = (du + dv).sqrt() / least;
        Self { jacobian, least, spread: if spread.is_nan() { f64::INFINITY } else { spread } }
    }
}
