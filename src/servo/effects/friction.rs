//! Friction of guideway and bearings.

use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::Drive;

/// Friction with true sticking: Coulomb, Stribeck and viscous.
///
/// At rest it holds any torque up to `T_s`; in motion (`ω` the table's speed referred to the motor, `ω_s` the Stribeck speed)
///
/// ```text
/// T_f = sign(ω) (T_c + (T_s - T_c) exp(-(ω/ω_s)²)) + B_f ω
/// ```
///
/// Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and compensation methods for
/// the control of machines with friction", Automatica 30, 1994, section 2.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coulomb {
    /// Coulomb friction `T_c` at the motor \[N m\], positive.
    pub coulomb_nm: f64,
    /// Static friction `T_s` \[N m\], at least `T_c`; equal for no Stribeck effect.
    pub static_nm: f64,
    /// Stribeck speed of the table `r_g ω_s` \[mm/s\], positive.
    pub stribeck_mm_s: f64,
    /// Viscous friction `B_f`, beside the plant's own \[N m s/rad\], not negative.
    pub viscous_nm_s_rad: f64,
}

/// What every curve has.
const COULOMB: Parameter =
    Parameter::new("effects.friction.coulomb.coulomb_nm", "N m", Range::POSITIVE, "Friction in motion, at the motor")
        .logarithmic(0.001, 1.0);
const STATIC: Parameter = Parameter::new(
    "effects.friction.coulomb.static_nm",
    "N m",
    Range::POSITIVE,
    "Friction at rest, at least `coulomb_nm`",
)
.otherwise("`coulomb_nm`")
.logarithmic(0.001, 1.0);
const STRIBECK: Parameter = Parameter::new(
    "effects.friction.coulomb.stribeck_mm_s",
    "mm/s",
    Range::POSITIVE,
    "Stribeck speed of the table, over which friction falls from static to Coulomb",
)
.or(1.0)
.logarithmic(0.01, 100.0);
const VISCOUS: Parameter = Parameter::new(
    "effects.friction.coulomb.viscous_nm_s_rad",
    "N m s/rad",
    Range::NOT_NEGATIVE,
    "Viscous friction beside the plant's",
)
.or(0.0)
.linear(0.0, 0.01);

parameters!(
    "Coulomb, Stribeck and viscous friction, with true sticking",
    Coulomb { coulomb_nm: COULOMB, static_nm: STATIC, stribeck_mm_s: STRIBECK, viscous_nm_s_rad: VISCOUS }
);

/// Friction as bending bristles (`LuGre`).
///
/// ```text
/// z' = ω - σ0 |ω| z / g(ω)            g(ω) = T_c + (T_s - T_c) exp(-(ω/ω_s)²)
/// T_f = σ0 z + σ1 z' + B_f ω
/// ```
///
/// Source: C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, "A new model for control of systems with friction", IEEE
/// Transactions on Automatic Control 40, 1995, equations 2 to 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LuGre {
    /// `T_c`, `T_s`, `ω_s` and `B_f`.
    pub curve: Coulomb,
    /// Stiffness of the bristles `σ0` \[N m/rad\], positive: `T_s/σ0` is how far the table gives before it slides.
    pub stiffness_nm_rad: f64,
    /// Damping of the bristles `σ1` \[N m s/rad\], not negative, at most `4 √(σ0 J)` with the inertia `J` that rubs.
    pub damping_nm_s_rad: f64,
}

parameters!("Friction as bending bristles (`LuGre`)", LuGre {
    curve.coulomb_nm: COULOMB.at("effects.friction.lu_gre.coulomb_nm"),
    curve.static_nm: STATIC.at("effects.friction.lu_gre.static_nm"),
    curve.stribeck_mm_s: STRIBECK.at("effects.friction.lu_gre.stribeck_mm_s"),
    curve.viscous_nm_s_rad: VISCOUS.at("effects.friction.lu_gre.viscous_nm_s_rad"),
    stiffness_nm_rad: Parameter::new(
        "effects.friction.lu_gre.stiffness_nm_rad",
        "N m/rad",
        Range::POSITIVE,
        "Stiffness of the bristles",
    )
    .logarithmic(1.0, 1e4),
    damping_nm_s_rad: Parameter::new(
        "effects.friction.lu_gre.damping_nm_s_rad",
        "N m s/rad",
        Range::NOT_NEGATIVE,
        "Damping of the bristles",
    )
    .or(0.0)
    .linear(0.0, 1.0),
});

/// One of the models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// With true sticking.
    Coulomb(Coulomb),
    /// Bristles that bend before the table slides.
    LuGre(LuGre),
}

impl Coulomb {
    /// Every parameter in its range: a curve that sticks, and slips under the torque that the drive has.
    ///
    /// # Errors
    /// Names the first parameter that is not.
    pub fn check(&self, drive: &Drive) -> Result<(), OutOfRange> {
        self.check_ranges()?;
        if !(self.static_nm >= self.coulomb_nm) {
            let needed = "at least coulomb_nm: an axis that is easier to move at rest than in motion never sticks";
            return Err(Self::refuse("static_nm", self.static_nm, needed));
        }
        if !(self.static_nm < drive.voltage_limit_v / drive.torque_to_voltage_v_nm) {
            let needed = "below the torque at the voltage limit: the axis would never slip";
            return Err(Self::refuse("static_nm", self.static_nm, needed));
        }
        Ok(())
    }

    /// Magnitude of the friction at a speed of the table \[mm/s\] without its viscous part \[N m\].
    pub fn curve_nm(&self, velocity_mm_s: f64) -> f64 {
        let y = velocity_mm_s / self.stribeck_mm_s;
        self.coulomb_nm + (self.static_nm - self.coulomb_nm) * bell(y * y)
    }
}

/// `1/n!`.
const FACTORIALS: [f64; 13] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40320.0,
    1.0 / 362880.0,
    1.0 / 3628800.0,
    1.0 / 39916800.0,
    1.0 / 479001600.0,
];

/// `exp(-y)` for `y ≥ 0` to 1e-15, and zero where it no longer counts: the friction needs it every period, and it is the same on every
/// machine.
#[inline(always)]
pub(in crate::servo) fn bell(y: f64) -> f64 {
    // Above the rounding to whole numbers, which are then the lowest bits.
    const ROUND: f64 = 6755399441055744.0;
    if !(y < 40.0) {
        return 0.0;
    }
    let shifted = y.mul_add(std::f64::consts::LOG2_E, ROUND);
    let halvings = shifted - ROUND;
    // ln 2 in two parts, the first of few digits.
    let x = halvings.mul_add(1.908_214_929_270_587_7e-10, halvings.mul_add(0.693_147_180_369_123_8, -y));
    let (x2, x4) = (x * x, (x * x) * (x * x));
    let pair = |i: usize| FACTORIALS[i + 1].mul_add(x, FACTORIALS[i]);
    let four = |i: usize| pair(i + 2).mul_add(x2, pair(i));
    let series = FACTORIALS[12].mul_add(x4, four(8)).mul_add(x4 * x4, four(4).mul_add(x4, four(0)));
    // 2⁻ⁿ by its exponent.
    series * f64::from_bits((1023_u64 << 52).wrapping_sub(shifted.to_bits() << 52))
}

impl Friction {
    /// The curve of either model.
    pub fn curve(&self) -> &Coulomb {
        match self {
            Self::Coulomb(curve) => curve,
            Self::LuGre(lugre) => &lugre.curve,
        }
    }

    /// Every parameter in its range.
    ///
    /// - `inertia_kg_m2`: what rubs, at the motor: [`Effects::rubbing_kg_m2`](super::Effects::rubbing_kg_m2)
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, inertia_kg_m2: f64, drive: &Drive) -> Result<(), OutOfRange> {
        if let Self::Coulomb(curve) = self {
            curve.check(drive)?;
        }
        if let Self::LuGre(lugre) = self {
            lugre.check_ranges()?;
            lugre.curve.check(drive).map_err(LuGre::own)?;
            // A mass on bristles is damped critically by 2 √(σ0 J).
            let critical = 2.0 * (lugre.stiffness_nm_rad * inertia_kg_m2).sqrt();
            if lugre.damping_nm_s_rad > 2.0 * critical {
                let needed = "at most 4 √(stiffness_nm_rad J), J the inertia that rubs (the table's, of two masses): twice \
                              what damps it critically on its bristles";
                return Err(LuGre::refuse("damping_nm_s_rad", lugre.damping_nm_s_rad, needed));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validates_bell() {
        for i in 0..40_000 {
            let y = f64::from(i) * 1.0003e-3;
            let exact = libm::exp(-y);
            assert!((bell(y) - exact).abs() < 1e-15 * exact || y >= 40.0, "{y}: {} {exact}", bell(y));
        }
        assert_eq!((bell(0.0), bell(f64::INFINITY), bell(f64::NAN)), (1.0, 0.0, 0.0));
    }
}
