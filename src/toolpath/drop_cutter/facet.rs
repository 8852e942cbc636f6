//! A cutter let down on one triangle, exactly.
//!
//! Over a facet's plane `h(Q) = Q_z - g(|Q_xy|)` (axis at the origin) is concave, so that the plane has one highest `h`; where it
//! lies beside the triangle, the triangle's highest lies on an edge that it is beyond of. Along an edge `h` is concave again.
//! With the flat radius `a = R - c` and the slope angle `θ`:
//!
//! - facet: contact at `a + c sin θ` uphill of the axis, tip `c (1 - cos θ)` below the contact;
//! - edge at distance `d` with slope `k` along its plan: contact at the place `s` from the axis' foot where `k = g'(ρ) s / ρ`,
//!   `ρ² = d² + s²`: ball `s = k √(R² - d²) / √(1 + k²)`, flat the end of the chord, bull-nose by a root in one unknown;
//! - a vertex, or an edge that stands upright, where it is.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Vector2, Vector3};

use crate::toolpath::{ContactLocation, Cutter};

/// The highest tip so far; places relative to the cutter's axis in plan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pub(super) tip: f64,
    contact: Vector3<f64>,
    /// Where a facet is touched its normal, upwards, not of unit length.
    facet: Option<Vector3<f64>>,
}

/// What the contact needs of a cutter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Profile {
    cutter: Cutter,
    pub(super) radius: f64,
    pub(super) flat: f64,
    pub(super) corner: f64,
}

impl Profile {
    pub(super) fn new(cutter: &Cutter) -> Self {
        let (radius, corner) = (cutter.radius_mm(), cutter.corner_radius_mm());
        Self { cutter: *cutter, radius, flat: radius - corner, corner }
    }

    /// `g(ρ)`, the rim's beyond it (rounding).
    #[inline]
    pub(super) fn height(&self, rho: f64) -> f64 {
        self.cutter.profile_mm(rho.min(self.radius)).unwrap_or(self.corner)
    }

    /// Sine and cosine of the profile's slope angle at `ρ`; on the rim of a flat end the disc's.
    #[inline]
    pub(super) fn slope(&self, rho: f64) -> (f64, f64) {
        let out = (rho - self.flat).max(0.0).min(self.corner);
        if out > 0.0 {
            (out / self.corner, ((self.corner - out) * (self.corner + out)).max(0.0).sqrt() / self.corner)
        } else {
            (0.0, 1.0)
        }
    }

    /// The highest that the cutter above `at` could rest on anything in a box; minus infinity where the box is beside it.
    #[inline]
    pub(super) fn box_bound(&self, low: [f64; 2], high: [f64; 2], top: f64, at: Vector2<f64>) -> f64 {
        let dx = (low[0] - at.x).max(at.x - high[0]).max(0.0);
        let dy = (low[1] - at.y).max(at.y - high[1]).max(0.0);
        let square = dx * dx + dy * dy;
        if square > self.radius * self.radius * (1.0 + 1e-14) {
            return f64::NEG_INFINITY;
        }
        if square <= self.flat * self.flat { top } else { top - self.height(square.sqrt()) }
    }

    /// Unit direction from the cutter's bottom at `at` (from its axis) towards the centre of its round.
    pub(super) fn inwards(&self, at: Vector2<f64>) -> Vector3<f64> {
        let rho = at.norm();
        let (sin, cos) = self.slope(rho);
        if sin > 0.0 && rho > 0.0 { Vector3::new(-sin * at.x / rho, -sin * at.y / rho, cos) } else { Vector3::z() }
    }
}

impl Touch {
    pub(super) fn none() -> Self {
        Self { tip: f64::NEG_INFINITY, contact: Vector3::zeros(), facet: None }
    }

    #[inline]
    fn offer(&mut self, tip: f64, contact: Vector3<f64>, facet: Option<Vector3<f64>>) {
        if tip > self.tip {
            *self = Self { tip, contact, facet };
        }
    }

    pub(super) fn rest(&self, profile: &Profile, x: f64, y: f64) -> Option<ContactLocation> {
        (self.tip > f64::NEG_INFINITY).then(|| ContactLocation {
            tip_z_mm: self.tip,
            contact_mm: self.contact + Vector3::new(x, y, 0.0),
            normal: self.facet.and_then(|n| n.try_normalize(0.0)).unwrap_or_else(|| profile.inwards(self.contact.xy())),
        })
    }

    /// Lets the cutter, its axis at the origin, down on a triangle.
    #[inline]
    pub(super) fn triangle(&mut self, profile: &Profile, [a, b, c]: &[Vector3<f64>; 3]) {
        let mut n = (b - a).cross(&(c - a));
        // In plan, seen from above, the corners run counter-clockwise where this is positive.
        let turn = if n.z < 0.0 { -1.0 } else { 1.0 };
        n *= turn;
        if !(n.z > 0.0) {
            self.edge(profile, a, b);
            self.edge(profile, b, c);
            self.edge(profile, c, a);
            return;
        }
        let steep = n.x.hypot2(n.y);
        let length = (steep + n.z * n.z).sqrt();
        let steep = steep.sqrt();
        let out = if steep > 0.0 { -(profile.flat + profile.corner * steep / length) / steep } else { 0.0 };
        let at = Vector2::new(out * n.x, out * n.y);
        let z = a.z - (n.x * (at.x - a.x) + n.y * (at.y - a.y)) / n.z;
        // c (1 - cos θ) without losing digits.
        let tip = z - profile.corner * (steep / length) * (steep / (length + n.z));
        // Nothing of the plane lets the cutter rest higher. (Rounding: an edge may seem higher by a little.)
        if !(tip > self.tip) {
            return;
        }
        let beyond = [(a, b), (b, c), (c, a)].map(|(from, to)| side(from, to, at) * turn < 0.0);
        if beyond == [false; 3] {
            self.offer(tip, Vector3::new(at.x, at.y, z), Some(n));
            return;
        }
        if beyond[0] {
            self.edge(profile, a, b)
        }
        if beyond[1] {
            self.edge(profile, b, c)
        }
        if beyond[2] {
            self.edge(profile, c, a)
        }
    }

    fn edge(&mut self, profile: &Profile, from: &Vector3<f64>, to: &Vector3<f64>) {
        // The same order for both triangles of an edge: the same result.
        let (from, to) = if before(from, to) { (from, to) } else { (to, from) };
        let (dx, dy, dz) = (to.x - from.x, to.y - from.y, to.z - from.z);
        let length = dx.hypot2(dy).sqrt();
        if !(length > 0.0) {
            self.vertex(profile, if dz > 0.0 { to } else { from });
            return;
        }
        let (ex, ey) = (dx / length, dy / length);
        let d = (from.x * ey - from.y * ex).abs();
        if !(d <= profile.radius) {
            return;
        }
        let start = from.x * ex + from.y * ey;
        let chord = ((profile.radius - d) * (profile.radius + d)).sqrt();
        let (low, high) = (start.max(-chord), (start + length).min(chord));
        if !(low <= high) {
            return;
        }
        let s = best_place(profile, d, chord, length, dz, (low, high));
        if s <= start {
            self.vertex(profile, from);
        } else if s >= start + length {
            self.vertex(profile, to);
        } else {
            let t = (s - start) / length;
            let at = Vector3::new(from.x + t * dx, from.y + t * dy, from.z + t * dz);
            let g = if profile.flat == 0.0 {
                // From the chord's ends: near the rim the root of R² - ρ² keeps its digits.
                profile.radius - ((chord - s) * (chord + s)).max(0.0).sqrt()
            } else {
                profile.height(d.hypot2(s).sqrt())
            };
            self.offer(at.z - g, at, None);
        }
    }

    fn vertex(&mut self, profile: &Profile, v: &Vector3<f64>) {
        let rho = v.x.hypot2(v.y).sqrt();
        // An end of an edge that was clipped at the rim is up to rounding on it.
        if rho <= profile.radius * (1.0 + 1e-15) {
            self.offer(v.z - profile.height(rho), *v, None);
        }
    }
}

/// Where an edge's highest `h` is, from the foot of the axis along its plan, within `low … high` on the chord.
#[inline]
fn best_place(profile: &Profile, d: f64, chord: f64, length: f64, dz: f64, (low, high): (f64, f64)) -> f64 {
    if profile.flat == 0.0 {
        return (chord * dz / length.hypot2(dz).sqrt()).max(low).min(high);
    }
    if dz == 0.0 {
        return 0.0_f64.max(low).min(high);
    }
    if profile.corner == 0.0 {
        return if dz > 0.0 { high } else { low };
    }
    // h rises with s as long as this is positive; it falls all the way.
    let rise = |s: f64| {
        let rho = d.hypot2(s).sqrt();
        let (sin, cos) = profile.slope(rho);
        dz * rho * cos - length * sin * s
    };
    if rise(high) >= 0.0 {
        return high;
    }
    if rise(low) <= 0.0 {
        return low;
    }
    // With the angle φ on the round, ρ = a + c sin φ: s sin φ = |k| ρ cos φ.
    let (run, climb) = (length / length.hypot2(dz).sqrt(), dz.abs() / length.hypot2(dz).sqrt());
    let place = |sin: f64| {
        let rho = profile.flat + profile.corner * sin;
        (rho, ((rho - d) * (rho + d)).max(0.0).sqrt())
    };
    let mut lower = libm::asin(((d - profile.flat) / profile.corner).max(0.0).min(1.0));
    let mut upper = FRAC_PI_2;
    let mut phi = libm::atan2(climb, run).max(lower).min(upper);
    for _ in 0..80 {
        let (sin, cos) = libm::sincos(phi);
        let (rho, s) = place(sin);
        let f = run * sin * s - climb * rho * cos;
        if f > 0.0 {
            upper = phi
        } else {
            lower = phi
        }
        let rho1 = profile.corner * cos;
        let f1 = run * (cos * s + sin * rho * rho1 / s) - climb * (rho1 * cos - rho * sin);
        let mut next = phi - f / f1;
        // Where Newton's step is no number or leaves the bracket: halve it.
        if !(next > lower && next < upper) {
            next = 0.5 * (lower + upper);
        }
        let done = (next - phi).abs() <= 1e-15 || upper - lower <= 1e-15;
        phi = next;
        if done {
            break;
        }
    }
    (place(libm::sin(phi)).1 * dz.signum()).max(low).min(high)
}

/// `x² + y²`.
trait Hypot2 {
    fn hypot2(self, other: f64) -> f64;
}

impl Hypot2 for f64 {
    #[inline]
    fn hypot2(self, other: f64) -> f64 {
        self * self + other * other
    }
}

#[inline]
fn before(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    (a.x, a.y, a.z) < (b.x, b.y, b.z)
}

/// Twice the area of `from`, `to`, `at` in plan: positive where `at` is on the left. Exactly opposite for `to`, `from`, so that
/// no point lies between two triangles of an edge.
#[inline]
pub(super) fn side(from: &Vector3<f64>, to: &Vector3<f64>, at: Vector2<f64>) -> f64 {
    let area = |p: &Vector3<f64>, q: &Vector3<f64>| (q.x - p.x) * (at.y - p.y) - (q.y - p.y) * (at.x - p.x);
    if before(from, to) { area(from, to) } else { -area(to, from) }
}
