//! Disturbances: torque ripple and cutting force.

use super::lookup_table::LookupTable;
use crate::parameters::{OutOfRange, Range};
use crate::servo::parameters::LARGEST;

/// One harmonic of the torque ripple.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Times per revolution of the motor, from 1.
    pub per_revolution: u32,
    /// Amplitude \[N m\], not negative.
    pub amplitude_nm: f64,
    /// Phase \[rad\].
    pub phase_rad: f64,
}

/// Torque ripple (cogging): `T_r = Σ a_n sin(n θ + φ_n)` added to the motor's torque, `θ` the motor's angle, zero where the axis
/// stands at 0 mm.
///
/// Source: P. Pillay, R. Krishnan, "Modeling, simulation, and analysis of permanent-magnet motor drives", IEEE Transactions on
/// Industry Applications 25, 1989.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorqueRipple {
    /// The harmonics, at most 16.
    pub harmonics: Vec<Harmonic>,
}

impl TorqueRipple {
    /// Every harmonic in its range.
    ///
    /// # Errors
    /// Names the first value that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        if self.harmonics.len() > 16 {
            let value = self.harmonics.len() as f64;
            return Err(OutOfRange::new("harmonics", value, "at most 16"));
        }
        for harmonic in &self.harmonics {
            let n = harmonic.per_revolution;
            if !(1..=1000).contains(&n) {
                return Err(OutOfRange::new("per_revolution", f64::from(n), "from 1 to 1000"));
            }
            if !Range::NOT_NEGATIVE.contains(harmonic.amplitude_nm) {
                let needed = Range::NOT_NEGATIVE.to_string();
                return Err(OutOfRange::new("amplitude_nm", harmonic.amplitude_nm, needed));
            }
            if !(harmonic.phase_rad.abs() <= 1e3) {
                let needed = "a finite angle, at most 1000 rad";
                return Err(OutOfRange::new("phase_rad", harmonic.phase_rad, needed));
            }
        }
        Ok(())
    }
}

/// Cutting force on the table, in the direction of the axis \[N\].
#[derive(Debug, Clone, PartialEq)]
pub enum CuttingForce {
    /// Over time \[s\].
    OverTime(LookupTable),
    /// Over the table's position \[mm\].
    OverPosition(LookupTable),
}

impl CuttingForce {
    /// Forces that are numbers.
    ///
    /// # Errors
    /// They are not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let (Self::OverTime(table) | Self::OverPosition(table)) = self;
        let value = table.largest();
        if value <= LARGEST { Ok(()) } else { Err(OutOfRange::new("force_n", value, "at most 1e9")) }
    }
}
