//! Effects between controller and torque: delay, DAC resolution, current loop; and plant mismatch.

use crate::parameters::OutOfRange;
use crate::servo::Plant;
use crate::servo::parameters::positive;

/// Computation delay: the voltage of sample `k` reaches the amplifier at `(k + d) Δt`.
///
/// Inside a period the voltage switches once, and the machine is advanced in two parts.
///
/// Source: K. J. Åström, B. Wittenmark, "Computer-Controlled Systems", 3rd edition, section 2.3 (fractional delay).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// `d`, fractions included, from 0 to 16.
    pub samples: f64,
}

impl Delay {
    /// Longest delay \[samples\].
    pub const LONGEST: f64 = 16.0;

    /// The delay in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        if (0.0..=Self::LONGEST).contains(&self.samples) {
            return Ok(());
        }
        let needed = "from 0 to 16 samples; no drive computes for longer, and no loop would be stable";
        Err(OutOfRange::new("delay (samples)", self.samples, needed))
    }
}

/// Resolution of the digital-to-analogue DAC: the voltage is one of `2ⁿ - 1` steps from limit to limit, zero among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dac {
    /// `n`, from 2 to 32.
    pub bits: u32,
}

impl Dac {
    /// The bits in their range.
    ///
    /// # Errors
    /// They are not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        if (2..=32).contains(&self.bits) {
            return Ok(());
        }
        Err(OutOfRange::new("bits of the DAC", f64::from(self.bits), "from 2 to 32"))
    }

    /// One step \[V\]: `u_max / (2ⁿ⁻¹ - 1)`.
    pub fn step_v(&self, voltage_limit_v: f64) -> f64 {
        let positive = (1_u64 << self.bits.clamp(2, 32)) / 2 - 1;
        voltage_limit_v / positive as f64
    }
}

/// Current loop of the amplifier, of first order: the torque follows `T(s) = u(s)/k_T / (1 + s/ω_c)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentLoop {
    /// Bandwidth `ω_c/2π` \[Hz\], positive.
    pub bandwidth_hz: f64,
}

impl CurrentLoop {
    /// The bandwidth in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        positive("bandwidth_hz of the current loop", self.bandwidth_hz)
    }
}

/// Plant mismatch: the true plant is the model times these factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mismatch {
    /// Of the gain `K`, positive.
    pub gain_factor: f64,
    /// Of the time constant `τ`, positive.
    pub time_constant_factor: f64,
}

impl Mismatch {
    /// The factors in their range.
    ///
    /// # Errors
    /// They are not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for (name, value) in [("gain_factor", self.gain_factor), ("time_constant_factor", self.time_constant_factor)] {
            if !(0.01..=100.0).contains(&value) {
                return Err(OutOfRange::new(name, value, "from 0.01 to 100"));
            }
        }
        Ok(())
    }

    /// The plant that `model` stands for.
    pub fn plant(&self, model: &Plant) -> Plant {
        Plant {
            gain_rad_s_v: model.gain_rad_s_v * self.gain_factor,
            time_constant_s: model.time_constant_s * self.time_constant_factor,
        }
    }
}
