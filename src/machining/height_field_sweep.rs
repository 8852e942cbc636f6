//! What one piece of a path cuts: a cutter standing, or swept along a straight piece.
//!
//! With `s` the way in plan along a piece that rises by `m` a millimetre, a cell at `(u, v)` (along the piece, across it) is
//! lowered to
//!
//! ```text
//! min over s of z_A + m s + g(√((u - s)² + v²)),   s in [0, L] and within the cutter's radius of the cell
//! ```
//!
//! with the cutter's profile `g`. `g` is convex and rises, so this is convex in `s`: its least value is where the derivative
//! vanishes, at `s = u + x*`, or at the end of the interval nearest to that.
//!
//! | cutter | `x*`, with `w² = R² - v²` |
//! |---|---|
//! | ball | `-w m/√(1+m²)` (the cylinder and the spheres at its ends in one formula) |
//! | flat | `-w` where the piece rises, `+w` where it falls |
//! | bull-nose | `∓√(ρ² - v²)` with the root `ρ` of `ρ = R - c + m c/√(1 + m² - v²/ρ²)`, by safeguarded Newton steps |
//!
//! Along a chain of pieces the inner vertices need not be cut whole: where the best place of a cell lies beyond the end of one
//! piece and not before the start of the next, the next piece cuts it deeper. So a piece is drawn only in the band where its own
//! `x*` can lie, and a vertex only in the wedge between two bands: for short pieces a hundredth of the cutter's disc.

use nalgebra::{Vector2, Vector3};

use crate::toolpath::Cutter;

/// A piece steeper than this, or shorter in plan than [`SHORTEST_MM`], is a plunge: its lower end cuts what it cuts, but for an
/// edge of a ten-millionth of its height.
const STEEPEST: f64 = 1e7;
/// See [`STEEPEST`].
const SHORTEST_MM: f64 = 1e-12;
/// Bands and wedges reach this much farther than they must, against rounding.
const SLACK_MM: f64 = 1e-6;

const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Half of the plane: `normal · q + offset ≥ 0`.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfPlane {
    normal: Vector2<f64>,
    offset: f64,
}

impl HalfPlane {
    /// The points at least `least` beyond `at` along the unit vector `direction`.
    fn beyond(at: Vector2<f64>, direction: Vector2<f64>, least: f64) -> Self {
        Self { normal: direction, offset: SLACK_MM - direction.dot(&at) - least }
    }

    /// Narrows an interval of x on the row at `y`.
    fn narrow(&self, y: f64, interval: &mut [f64; 2]) {
        let level = self.normal.y * y + self.offset;
        if self.normal.x.abs() < 1e-12 {
            // Along the row nothing changes.
            if level < -SLACK_MM {
                *interval = NOTHING;
            }
        } else if self.normal.x > 0.0 {
            interval[0] = interval[0].max(-level / self.normal.x);
        } else {
            interval[1] = interval[1].min(-level / self.normal.x);
        }
    }
}

/// Numbers of a cutter that its cuts need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    /// Radius.
    radius: f64,
    square: f64,
    /// Radius of the flat disc.
    flat: f64,
    /// Corner radius.
    corner: f64,
}

impl Profile {
    pub(super) fn of(cutter: &Cutter) -> Self {
        let (radius, corner) = (cutter.radius_mm(), cutter.corner_radius_mm());
        Self { radius, square: radius * radius, flat: radius - corner, corner }
    }

    /// Height above the tip at the square of a distance from the axis within the radius.
    #[inline(always)]
    fn rise(&self, square: f64) -> f64 {
        let (c, out_square) = if self.flat == 0.0 {
            (self.corner, square)
        } else {
            let out = (square.sqrt() - self.flat).max(0.0);
            (self.corner, out * out)
        };
        // (c - √(c² - x²)) without losing digits where x is small.
        let root = (c * c - out_square).max(0.0).sqrt();
        if out_square > 0.0 { out_square / (c + root) } else { 0.0 }
    }

    /// How far from a cell, along a piece that rises by `m`, its best place can lie.
    fn reach(&self, m: f64) -> f64 {
        if m == 0.0 { 0.0 } else { self.flat + self.corner * sine(m) }
    }
}

/// `|m|/√(1+m²)`.
fn sine(m: f64) -> f64 {
    m.abs() / (1.0 + m * m).sqrt()
}

/// A straight piece that is no plunge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sweep {
    profile: Profile,
    /// Tip at the start: in plan, and its height.
    start: Vector2<f64>,
    start_z: f64,
    direction: Vector2<f64>,
    length: f64,
    /// Rise a millimetre of way in plan.
    slope: f64,
    /// `x*` of a ball is this many times `w`.
    lean: f64,
    /// How far from a cell its best place lies at most, onwards (largest `x*`) and back (largest `-x*`).
    onwards: f64,
    back: f64,
}

impl Sweep {
    /// The piece between two places of the tip; none where it is a plunge.
    pub(super) fn new(profile: Profile, from: Vector3<f64>, to: Vector3<f64>) -> Option<Self> {
        let (way, rise) = (to.xy() - from.xy(), to.z - from.z);
        let length = way.norm();
        if !(length > SHORTEST_MM) || rise.abs() > STEEPEST * length {
            return None;
        }
        let slope = rise / length;
        let reach = profile.reach(slope);
        let lean = if slope > 0.0 { -sine(slope) } else { sine(slope) };
        let (onwards, back) = if slope > 0.0 { (0.0, reach) } else { (reach, 0.0) };
        let direction = way / length;
        Some(Self { profile, start: from.xy(), start_z: from.z, direction, length, slope, lean, onwards, back })
    }

    /// Where the best place of a cell lies from it along the piece, `v` beside it; `w` is half the chord there.
    #[inline(always)]
    fn best(&self, v: f64, w: f64) -> f64 {
        let Profile { radius, flat, corner, .. } = self.profile;
        if flat == 0.0 {
            return self.lean * w;
        }
        if self.slope == 0.0 {
            return 0.0;
        }
        if corner == 0.0 {
            return if self.slope > 0.0 { -w } else { w };
        }
        let (m, v_square) = (self.slope.abs(), v * v);
        let (mut low, mut high) = (flat.max(v.abs()), radius);
        let mut rho = (flat + corner * sine(m)).max(low);
        for _ in 0..60 {
            let under = (1.0 + m * m - v_square / (rho * rho)).max(1e-300);
            let pull = corner * m / under.sqrt();
            let value = rho - flat - pull;
            if value > 0.0 {
                high = rho
            } else {
                low = rho
            }
            let mut next = rho - value / (1.0 + pull / under * v_square / (rho * rho * rho));
            // Outside of what is known, or no number: halve.
            if !(next > low && next < high) {
                next = 0.5 * (low + high);
            }
            let step = (next - rho).abs();
            rho = next;
            if step <= 1e-14 * radius {
                break;
            }
        }
        let y = ((rho - v.abs()) * (rho + v.abs())).max(0.0).sqrt();
        if self.slope > 0.0 { -y } else { y }
    }

    /// The height that the piece leaves at a cell. Infinite where it does not come.
    #[inline(always)]
    fn height(&self, cell: Vector2<f64>) -> f64 {
        let from = cell - self.start;
        let u = from.dot(&self.direction);
        let v = self.direction.x * from.y - self.direction.y * from.x;
        let w_square = self.profile.square - v * v;
        if !(w_square >= 0.0) {
            return f64::INFINITY;
        }
        let w = w_square.sqrt();
        let (low, high) = ((u - w).max(0.0), (u + w).min(self.length));
        if !(low <= high) {
            return f64::INFINITY;
        }
        let s = (u + self.best(v, w)).max(low).min(high);
        let x = s - u;
        self.start_z + self.slope * s + self.profile.rise((x * x + v * v).min(self.profile.square))
    }
}

/// Something that lowers cells.
#[derive(Debug, Clone, Copy)]
pub(super) enum Cut {
    /// The cutter standing; only cells in both half planes are wanted, where there are any.
    Stamp { profile: Profile, tip: Vector3<f64>, within: Option<[HalfPlane; 2]> },
    /// The cutter moving.
    Sweep(Sweep),
}

impl Cut {
    /// The cutter standing at `tip`.
    pub(super) fn stamp(profile: Profile, tip: Vector3<f64>) -> Self {
        Self::Stamp { profile, tip, within: None }
    }

    /// The vertex between two pieces: what neither of them cuts.
    pub(super) fn vertex(tip: Vector3<f64>, before: &Sweep, after: &Sweep) -> Self {
        let at = tip.xy();
        let within = [
            HalfPlane::beyond(at, before.direction, -before.onwards),
            HalfPlane::beyond(at, -after.direction, -after.back),
        ];
        Self::Stamp { profile: before.profile, tip, within: Some(within) }
    }

    /// The rows that it can touch: least and largest y.
    pub(super) fn rows(&self) -> [f64; 2] {
        match self {
            Self::Stamp { profile, tip, .. } => [tip.y - profile.radius, tip.y + profile.radius],
            Self::Sweep(sweep) => {
                let end = sweep.start.y + sweep.length * sweep.direction.y;
                let reach = sweep.profile.radius;
                [sweep.start.y.min(end) - reach, sweep.start.y.max(end) + reach]
            }
        }
    }

    /// The part of the row at `y` that it can touch: least and largest x.
    pub(super) fn interval(&self, y: f64) -> [f64; 2] {
        match self {
            Self::Stamp { profile, tip, within } => {
                let w_square = profile.square - (y - tip.y) * (y - tip.y);
                if !(w_square >= 0.0) {
                    return NOTHING;
                }
                let w = w_square.sqrt();
                let mut interval = [tip.x - w, tip.x + w];
                for half in within.iter().flatten() {
                    half.narrow(y, &mut interval);
                }
                interval
            }
            Self::Sweep(sweep) => {
                let Sweep { start, direction, length, onwards, back, profile, .. } = *sweep;
                let end = start + length * direction;
                let reach = profile.radius + SLACK_MM;
                let mut interval = [start.x.min(end.x) - reach, start.x.max(end.x) + reach];
                let across = Vector2::new(-direction.y, direction.x);
                for half in [
                    HalfPlane::beyond(start, direction, -onwards),
                    HalfPlane::beyond(end, -direction, -back),
                    HalfPlane::beyond(start, across, -reach),
                    HalfPlane::beyond(start, -across, -reach),
                ] {
                    half.narrow(y, &mut interval);
                }
                interval
            }
        }
    }

    /// The height that it leaves at a cell. Infinite where it does not come.
    #[inline(always)]
    pub(super) fn height(&self, cell: Vector2<f64>) -> f64 {
        match self {
            Self::Stamp { profile, tip, .. } => {
                let square = (cell - tip.xy()).norm_squared();
                if square <= profile.square { tip.z + profile.rise(square) } else { f64::INFINITY }
            }
            Self::Sweep(sweep) => sweep.height(cell),
        }
    }
}
