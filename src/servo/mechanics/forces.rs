//! The nonlinear torques: friction, ripple, cutting force, at the motor shaft.

use std::f64::consts::{FRAC_1_PI, PI};

use crate::servo::Drive;
use crate::servo::effects::{CuttingForce, Effects, Friction, LookupTable, bell};

/// Which friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrictionModel {
    None,
    Coulomb,
    LuGre,
}

/// Harmonics that are computed side by side.
const SIDE: usize = 4;

/// Harmonics.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
struct Waves {
    /// Turns a radian of the motor, and those at the start.
    rate: Side,
    turns: Side,
    /// Amplitude \[N m\], and those of slope \[N m/rad\] and curvature \[N m/rad²\].
    amplitude: Side,
    slope: Side,
    curvature: Side,
}

/// What the nonlinear torques are computed from.
#[derive(Debug, Clone)]
pub(super) struct Forces {
    pub(super) friction_model: FrictionModel,
    pub(super) static_nm: f64,
    coulomb: f64,
    /// Static less Coulomb friction.
    fall: f64,
    /// Inverse of the Stribeck speed \[s/rad\].
    stribeck: f64,
    /// Half the largest curvature of the friction's curve \[N m s²/rad²\].
    pub(super) sharpest: f64,
    sigma_0: f64,
    sigma_1: f64,
    waves: Vec<Waves>,
    /// Angle up to which a double tells one turn of a harmonic from the next \[rad\].
    farthest: f64,
    /// Largest change of the ripple with the angle \[N m/rad\], and what Hermite's rule of two derivatives misses of it, by the
    /// sixth power of the angle: a 100800th of its sixth derivative \[N m/rad⁶\].
    pub(super) steep: f64,
    pub(super) sixth: f64,
    force: Option<CuttingForce>,
    start_mm: f64,
    mm_rad: f64,
    /// Torque at the motor per force \[N m/N\].
    leverage: f64,
}

impl Forces {
    pub(super) fn new(effects: &Effects, drive: &Drive, start_mm: f64) -> Self {
        let mm_rad = drive.transmission_mm_rad;
        let start_rad = start_mm / mm_rad;
        let harmonics = || effects.ripple.iter().flat_map(|ripple| &ripple.harmonics).filter(|h| h.amplitude_nm > 0.0);
        let mut waves = vec![Waves::default(); harmonics().count().div_ceil(SIDE)];
        for (i, harmonic) in harmonics().enumerate() {
            let times = f64::from(harmonic.per_revolution);
            let turns = 0.5 * FRAC_1_PI * (times * start_rad + harmonic.phase_rad);
            let waves = &mut waves[i / SIDE];
            waves.rate[i % SIDE] = 0.5 * FRAC_1_PI * times;
            waves.turns[i % SIDE] = turns - turns.floor();
            waves.amplitude[i % SIDE] = harmonic.amplitude_nm;
            waves.slope[i % SIDE] = harmonic.amplitude_nm * times;
            waves.curvature[i % SIDE] = -harmonic.amplitude_nm * times * times;
        }
        let most = harmonics().map(|h| f64::from(h.per_revolution)).fold(1.0, f64::max);
        let derivative = |n| harmonics().map(|h| h.amplitude_nm * f64::from(h.per_revolution).powi(n)).sum::<f64>();
        let curve = effects.friction.map(|friction| *friction.curve());
        let (sigma_0, sigma_1) = match effects.friction {
            Some(Friction::LuGre(lugre)) => (lugre.stiffness_nm_rad, lugre.damping_nm_s_rad),
            _ => (0.0, 0.0),
        };
        Self {
            friction_model: match effects.friction {
                None => FrictionModel::None,
                Some(Friction::Coulomb(_)) => FrictionModel::Coulomb,
                Some(Friction::LuGre(_)) => FrictionModel::LuGre,
            },
            static_nm: curve.map_or(0.0, |curve| curve.static_nm),
            coulomb: curve.map_or(0.0, |curve| curve.coulomb_nm),
            fall: curve.map_or(0.0, |curve| curve.static_nm - curve.coulomb_nm),
            stribeck: curve.map_or(0.0, |curve| mm_rad / curve.stribeck_mm_s),
            sharpest: curve.map_or(0.0, |c| (c.static_nm - c.coulomb_nm) * (mm_rad / c.stribeck_mm_s).powi(2)),
            sigma_0,
            sigma_1,
            steep: derivative(1),
            sixth: derivative(6) / 100_800.0,
            waves,
            farthest: 2.0 * PI * MOST_TURNS / most,
            force: effects.force.clone(),
            start_mm,
            mm_rad,
            leverage: 1e-3 * mm_rad,
        }
    }

    #[inline(always)]
    pub(super) fn ripples(&self) -> bool {
        !self.waves.is_empty()
    }

    pub(super) fn act_on_table(&self) -> bool {
        self.friction_model != FrictionModel::None || self.force.is_some()
    }

    /// Ripple \[N m\], its slope \[N m/rad\] and curvature \[N m/rad²\] at a motor angle from the start.
    #[inline(always)]
    pub(super) fn ripple(&self, angle: f64) -> [f64; 3] {
        let mut ripple = [0.0; 3];
        if !(angle.abs() < self.farthest) {
            return ripple;
        }
        for waves in &self.waves {
            let (sine, cosine) = sine_cosine(times_plus(waves.rate, [angle; SIDE], waves.turns));
            let parts = [times(waves.amplitude, sine), times(waves.slope, cosine), times(waves.curvature, sine)];
            // Through memory: what is stored side by side is computed side by side.
            let parts = std::hint::black_box(parts);
            for i in 0..3 {
                ripple[i] += (parts[i][0] + parts[i][1]) + (parts[i][2] + parts[i][3]);
            }
        }
        ripple
    }

    /// Cutting force as a torque, at a time or a place.
    #[inline(always)]
    pub(super) fn force(&self, time_s: f64, place: f64, near: &mut usize) -> Force {
        let (table, x, scale): (&LookupTable, f64, f64) = match &self.force {
            None => return Force::default(),
            Some(CuttingForce::OverTime(table)) => (table, time_s, 1.0),
            Some(CuttingForce::OverPosition(table)) => (table, place.mul_add(self.mm_rad, self.start_mm), self.mm_rad),
        };
        let [value, slope] = table.with_slope(x, near);
        Force { torque: self.leverage * value, slope: self.leverage * slope * scale }
    }

    /// Whether the force depends on the place.
    #[inline(always)]
    pub(super) fn by_place(&self) -> bool {
        matches!(self.force, Some(CuttingForce::OverPosition(_)))
    }

    /// `g(ω)` \[N m\] and its derivative \[N m s/rad\].
    #[inline(always)]
    fn curve(&self, speed: f64) -> [f64; 2] {
        if self.fall > 0.0 {
            let y = speed * self.stribeck;
            let bell = self.fall * bell(y * y);
            [bell + self.coulomb, -2.0 * self.stribeck * y * bell]
        } else {
            [self.coulomb, 0.0]
        }
    }

    /// Straight bristles at rest.
    pub(super) fn at_rest(&self) -> Bristle {
        Bristle { z: 0.0, rate: 0.0, curve: self.curve(0.0)[0] }
    }

    /// Friction of a table that slips in a direction, without its viscous part \[N m\], and its derivative by the speed \[N m s/rad\].
    #[inline(always)]
    pub(super) fn slipping(&self, direction: f64, speed: f64) -> [f64; 2] {
        self.curve(speed).map(|x| -direction * x)
    }

    /// Friction and bristle of the `LuGre` model at the end of a step.
    ///
    /// The bristle's equation is `z' = a (z_r - z)` with `a = σ0 |ω|/g(ω)` and `z_r = sign(ω) g(ω)/σ0`. Over the step `a` is taken as the mean of
    /// both ends, `a z_r` as a straight line (where the speed changes its sign: `ω` itself), and the exponential as the rational one
    /// (Padé 1/3, fourth order) that damps any stiffness. The speed at the end is `free_speed` plus `gain` times the friction: solved
    /// with it, so that stiff bristles stay stable; `a` and `g` are those at the speed `about`. Gives the speed, too.
    #[inline(always)]
    pub(super) fn bristles(
        &self,
        bristle: &Bristle,
        from: f64,
        about: f64,
        free_speed: f64,
        gain: f64,
        h: f64,
    ) -> (f64, Bristle, f64) {
        let [curve, _] = self.curve(about);
        let end = self.sigma_0 * about.abs() / curve;
        let rate = 0.5 * (bristle.rate + end);
        let x = rate * h;
        let inverse = 1.0 / (1.0 + x * (0.75 + x * (0.25 + x * (1.0 / 24.0))));
        let stays = (1.0 - 0.25 * x) * inverse;
        let all = h * (1.0 + x * (0.25 + x * (1.0 / 24.0))) * inverse;
        let late = h * (0.5 + x * (5.0 / 24.0 + x * (1.0 / 24.0))) * inverse;
        let (mut first, mut last) = (from, about);
        if from * about > 0.0 {
            let towards = rate.copysign(from) / self.sigma_0;
            (first, last) = (towards * bristle.curve, towards * curve);
        }
        // z1 = old + late ω1, z1' = ω1 - end z1.
        let old = stays * bristle.z + first * (all - late) + (last - about) * late;
        let stiff = self.sigma_0 - self.sigma_1 * end;
        let (constant, slope) = (-stiff * old, -(stiff * late + self.sigma_1));
        let speed = gain.mul_add(constant, free_speed) / (1.0 - gain * slope);
        let z = late.mul_add(speed, old);
        if z.abs() * self.sigma_0 <= self.static_nm && gain * slope < 0.5 {
            return (slope.mul_add(speed, constant), Bristle { z, rate: end, curve }, speed);
        }
        // The step is far too long for these bristles: bent no further than they hold, they must not put energy in.
        let limit = self.static_nm / self.sigma_0;
        let z = z.max(-limit).min(limit);
        let held = self.sigma_0 * z;
        let damping = self.sigma_1 * (1.0 - held.copysign(held * speed) / curve).max(0.0);
        let speed = gain.mul_add(-held, free_speed) / gain.mul_add(damping, 1.0);
        (-damping.mul_add(speed, held), Bristle { z, rate: end, curve }, speed)
    }
}

/// A cutting force.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Force {
    /// At the motor shaft \[N m\].
    pub(super) torque: f64,
    /// Slope of the line that begins there \[N m/s\] or \[N m/rad\].
    pub(super) slope: f64,
}

/// State of the bristles, with what is known of the curve there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bristle {
    /// Bend \[rad\].
    z: f64,
    /// `a` \[1/s\] and `g` \[N m\].
    rate: f64,
    curve: f64,
}

impl Bristle {
    /// None at all.
    pub(super) const NONE: Self = Self { z: 0.0, rate: 0.0, curve: 0.0 };
}

/// Series of `sin(2π t)/t` in `t²`, from the lowest power up, and of `cos(2π t)`.
const SINE: [f64; 9] = series(2.0 * PI, 1);
const COSINE: [f64; 10] = series(1.0, 0);

/// What begins with `first`, and goes on as the series whose power `n` has the coefficient `(2π)ⁿ/n!`, sign by sign.
const fn series<const N: usize>(first: f64, power: u32) -> [f64; N] {
    let mut series = [first; N];
    let (mut i, mut n) = (1, power as f64);
    while i < N {
        series[i] = series[i - 1] * (-4.0 * PI * PI) / ((n + 1.0) * (n + 2.0));
        n += 2.0;
        i += 1;
    }
    series
}

/// Turns of which [`sine_cosine`] knows a half.
const MOST_TURNS: f64 = 1125899906842624.0;

/// Numbers side by side.
type Side = [f64; SIDE];

/// `a b`.
#[inline(always)]
fn times(a: Side, b: Side) -> Side {
    let mut product = a;
    for i in 0..SIDE {
        product[i] *= b[i];
    }
    product
}

/// `a b + c`.
#[inline(always)]
fn times_plus(a: Side, b: Side, c: Side) -> Side {
    let mut sum = c;
    for i in 0..SIDE {
        sum[i] = a[i].mul_add(b[i], c[i]);
    }
    sum
}

/// `sin(2π t)` and `cos(2π t)`, to 1e-13, up to [`MOST_TURNS`]: the ripple needs them every period, and they are the same on every
/// machine.
#[inline(always)]
fn sine_cosine(turns: Side) -> (Side, Side) {
    // Above the rounding to whole numbers, which are then the lowest bits.
    const ROUND: f64 = 6755399441055744.0;
    // To a quarter turn on either side of zero; half a turn more changes both signs.
    let (mut x, mut odd) = (turns, [0; SIDE]);
    for i in 0..SIDE {
        let shifted = turns[i].mul_add(2.0, ROUND);
        x[i] = (shifted - ROUND).mul_add(-0.5, turns[i]);
        odd[i] = shifted.to_bits() << 63;
    }
    let signed = |mut a: Side| {
        for i in 0..SIDE {
            a[i] = f64::from_bits(a[i].to_bits() ^ odd[i]);
        }
        a
    };
    // Estrin's scheme: half the wait of Horner's.
    let y = times(x, x);
    let y2 = times(y, y);
    let y4 = times(y2, y2);
    let pair = |c: &[f64], i: usize| times_plus([c[i + 1]; SIDE], y, [c[i]; SIDE]);
    let four = |c: &[f64], i: usize| times_plus(pair(c, i + 2), y2, pair(c, i));
    let y8 = times(y4, y4);
    let sine = times_plus([SINE[8]; SIDE], y8, times_plus(four(&SINE, 4), y4, four(&SINE, 0)));
    let cosine = times_plus(pair(&COSINE, 8), y8, times_plus(four(&COSINE, 4), y4, four(&COSINE, 0)));
    (times(signed(x), sine), signed(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_sine_and_cosine() {
        for i in -5000..5000 {
            let turns = f64::from(i) * 1.234567e-3;
            let ([sine, ..], [cosine, ..]) = sine_cosine([turns; SIDE]);
            assert!((sine - libm::sin(2.0 * PI * turns)).abs() < 2e-13, "{turns}");
            assert!((cosine - libm::cos(2.0 * PI * turns)).abs() < 2e-13, "{turns}");
        }
        // Far away, where only eighths and then quarters of a turn are left: as without the whole turns.
        for far in [MOST_TURNS / 8.0, -MOST_TURNS / 8.0, MOST_TURNS / 2.0, 1.0 - MOST_TURNS] {
            for eighths in 0..8 {
                let turns = far + 0.125 * f64::from(eighths);
                let ([sine, ..], [cosine, ..]) = sine_cosine([turns; SIDE]);
                let turns = turns - turns.floor();
                assert!((sine - libm::sin(2.0 * PI * turns)).abs() < 2e-13, "{far} {eighths}");
                assert!((cosine - libm::cos(2.0 * PI * turns)).abs() < 2e-13, "{far} {eighths}");
            }
        }
    }
}
