//! Disturbances: torque ripple and cutting force.

use super::lookup_table::LookupTable;
use crate::servo::ServoError;
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
    pub fn check(&self) -> Result<(), ServoError> {
        if self.harmonics.len() > 16 {
            let value = self.harmonics.len() as f64;
            return Err(ServoError { name: "harmonics of the ripple", value, needed: "at most 16" });
        }
        for harmonic in &self.harmonics {
            let n = harmonic.per_revolution;
            if !(1..=1000).contains(&n) {
                return Err(ServoError { name: "per_revolution", value: f64::from(n), needed: "from 1 to 1000" });
            }
            super::super::parameters::not_negative("amplitude_nm", harmonic.amplitude_nm)?;
            if !(harmonic.phase_rad.abs() <= 1e3) {
                let needed = "a finite angle, at most 1000 rad";
                return Err(ServoError { name: "phase_rad", value: harmonic.phase_rad, needed });
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
    pub fn check(&self) -> Result<(), ServoError> {
        let (Self::OverTime(table) | Self::OverPosition(table)) = self;
        let value = table.largest();
        if value <= LARGEST { Ok(()) } else { Err(ServoError { name: "force_n", value, needed: "at most 1e9" }) }
    }
}
