//! The ballscrew: compliance, backlash, pitch error.

use super::lookup_table::LookupTable;
use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::{Drive, Plant};

/// A compliant ballscrew: the motor and the table are two masses with a spring between them.
///
/// With `J = τ B` and `B = 1/(k_T K)` of the plant, and the transmission `r_g`, the table takes `J_t = m r_g²` of the inertia and the
/// motor keeps `J_m = J - J_t`, so that the two together are the plant. The plant's viscous friction stays at the motor.
///
/// ```text
/// J_m ω' = T + ripple - B ω - G      J_t ω_t' = G - T_f + T_F      G = k r_g² (θ - φ) + c r_g² (ω - ω_t)      T_F = r_g F
/// ```
///
/// with the motor's torque `T`, the friction `T_f` ([`Friction`](super::Friction)) and the cutting force `F`, which is positive in the
/// direction of the axis ([`CuttingForce`](super::CuttingForce)).
///
/// Free, it swings at `ω_n = √(k r_g² (1/J_m + 1/J_t))` with the damping ratio `c r_g² (1/J_m + 1/J_t) / (2 ω_n)`.
///
/// Source: Y. Altintas, "Manufacturing Automation", 2nd edition, section 5.5 (ball screw drives); R. Schmidt, H. Schulz, or any
/// text on two-mass drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoMass {
    /// Table mass `m` \[kg\], positive.
    pub table_mass_kg: f64,
    /// Stiffness `k` of screw, nut and bearings along the axis \[N/µm\], positive.
    pub stiffness_n_um: f64,
    /// Their damping `c` \[N s/mm\], not negative.
    pub damping_n_s_mm: f64,
}

parameters!(
    "Compliant ballscrew: motor and table are two masses with a spring between them",
    TwoMass {
        table_mass_kg: Parameter::new(
            "effects.two_mass.table_mass_kg",
            "kg",
            Range::POSITIVE,
            "Mass of the table: its part of the plant's inertia",
        )
        .logarithmic(1.0, 1000.0),
        stiffness_n_um: Parameter::new(
            "effects.two_mass.stiffness_n_um",
            "N/µm",
            Range::POSITIVE,
            "Stiffness along the axis",
        )
        .logarithmic(1.0, 1000.0),
        damping_n_s_mm: Parameter::new(
            "effects.two_mass.damping_n_s_mm",
            "N s/mm",
            Range::NOT_NEGATIVE,
            "Damping along the axis",
        )
        .or(0.0)
        .linear(0.0, 50.0),
    }
);

impl TwoMass {
    /// Inertia of the table at the motor \[kg m²\].
    pub fn table_inertia_kg_m2(&self, drive: &Drive) -> f64 {
        let r_m = 1e-3 * drive.transmission_mm_rad;
        self.table_mass_kg * r_m * r_m
    }

    /// Stiffness at the motor \[N m/rad\].
    pub fn stiffness_nm_rad(&self, drive: &Drive) -> f64 {
        let r_m = 1e-3 * drive.transmission_mm_rad;
        1e6 * self.stiffness_n_um * r_m * r_m
    }

    /// Damping at the motor \[N m s/rad\].
    pub fn damping_nm_s_rad(&self, drive: &Drive) -> f64 {
        let r_m = 1e-3 * drive.transmission_mm_rad;
        1e3 * self.damping_n_s_mm * r_m * r_m
    }

    /// Resonance `ω_n` of motor against table \[rad/s\], without damping.
    pub fn resonance_rad_s(&self, plant: &Plant, drive: &Drive) -> f64 {
        let table = self.table_inertia_kg_m2(drive);
        let motor = plant.inertia_kg_m2(drive) - table;
        (self.stiffness_nm_rad(drive) * (1.0 / motor + 1.0 / table)).sqrt()
    }

    /// Every parameter in its range, for this plant and control period.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, plant: &Plant, drive: &Drive, period_s: f64) -> Result<(), OutOfRange> {
        self.check_ranges()?;
        if !(self.table_inertia_kg_m2(drive) < 0.999 * plant.inertia_kg_m2(drive)) {
            let needed = "lighter: at the motor it is more than the inertia time_constant_s / (torque_to_voltage_v_nm \
                          gain_rad_s_v) of the whole axis, which includes the motor's";
            return Err(Self::refuse("table_mass_kg", self.table_mass_kg, needed));
        }
        if !(self.resonance_rad_s(plant, drive) * period_s <= MOST_RADIANS) {
            let needed =
                "softer: the resonance would swing more than 16 times in a control period, which is a rigid axis";
            return Err(Self::refuse("stiffness_n_um", self.stiffness_n_um, needed));
        }
        Ok(())
    }
}

/// Most radians of the resonance in one control period.
const MOST_RADIANS: f64 = 100.0;

/// Play between screw and table.
///
/// With [`TwoMass`] the spring only pushes once the gap is closed: in contact `G = max(0, k r_g² (θ - φ ∓ b/2) + c r_g² (ω - ω_t))`
/// towards that side, none in between; the table flies free, slowed by its friction. Where the axis is rigid, the table has no
/// motion of its own: it stands still while the screw crosses the gap, and friction and inertia stay at the motor.
///
/// Source: M. Nordin, P.-O. Gutman, "Controlling mechanical systems with backlash: a survey", Automatica 38, 2002, section 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    /// Width of the gap `b` at the table \[µm\], positive: what a reversal loses.
    pub gap_um: f64,
}

parameters!(
    "Backlash between screw and table",
    Backlash {
        gap_um: Parameter::new("effects.backlash.gap_um", "µm", Range::POSITIVE, "Width at the table")
            .logarithmic(0.1, 100.0),
    }
);

impl Backlash {
    /// The gap in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// Pitch error of the screw: the table stands at `x + e(x) - e(x_0)` where the screw should have taken it to `x`.
///
/// `x_0` is where the axis starts: it has been homed there, scale and screw agree. As a compensation the command is shifted by
/// `-(e(x_com) - e(x_0))`, from the same `x_0`: the exact table leaves what the slope of `e` times `e` is.
///
/// An encoder at the motor does not see it; a scale at the table does.
///
/// Source: ISO 230-2 (positioning deviations); ISO 230-3 for the growth with temperature, not modelled.
#[derive(Debug, Clone, PartialEq)]
pub struct PitchError {
    /// `e` \[µm\] over the position `x` \[mm\], straight lines between the points; repeating every lead where it has a period.
    pub error_um: LookupTable,
}

impl PitchError {
    /// `e(x_0)` \[mm\].
    pub(in crate::servo) fn at_start_mm(&self, start_mm: f64) -> f64 {
        1e-3 * self.error_um.value(start_mm)
    }

    /// Errors of a size that a screw can have.
    ///
    /// # Errors
    /// One of more than 10 mm.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let value = self.error_um.largest();
        if value <= 1e4 {
            return Ok(());
        }
        Err(OutOfRange::new("error_um", value, "at most 10 000 µm; is the table in mm?"))
    }
}
