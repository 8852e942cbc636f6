//! Effects between controller and torque: delay, DAC resolution, current loop; and plant mismatch.

use crate::parameters::{Entry, OutOfRange, Parameter, Parameters, Range, parameters};
use crate::servo::Plant;

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

parameters!(
    "Computation delay",
    Delay {
        samples: Parameter::new(
            "effects.delay.samples",
            "control periods",
            Range::closed(0.0, Delay::LONGEST),
            "From the sample to the voltage, fractions included; adds to `delay_samples`",
        )
        .linear(0.0, 4.0)
        .hint("no drive computes for longer than 16 control periods, and no loop would be stable"),
    }
);

impl Delay {
    /// Longest delay \[samples\].
    pub const LONGEST: f64 = 16.0;

    /// The delay in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// Resolution of the digital-to-analogue DAC: the voltage is one of `2ⁿ - 1` steps from limit to limit, zero among them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dac {
    /// `n`, from 2 to 32.
    pub bits: u32,
}

impl Parameters for Dac {
    const ABOUT: &'static str = "Resolution of the digital-to-analogue converter";
    const ENTRIES: &'static [Entry<Self>] = &[Entry {
        parameter: Parameter::new("effects.dac.bits", "bits", Range::whole(2, 32), "Bits over the voltage range")
            .linear(6.0, 20.0),
        get: |dac| Some(f64::from(dac.bits)),
        set: |dac, value| {
            dac.bits = whole(value);
            true
        },
    }];
}

/// A whole number of a checked range; what is none saturates.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturating
pub(super) fn whole(value: f64) -> u32 {
    value as u32
}

impl Dac {
    /// The bits in their range.
    ///
    /// # Errors
    /// They are not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
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

parameters!(
    "Bandwidth of the amplifier's current loop, of first order",
    CurrentLoop {
        bandwidth_hz: Parameter::new("effects.current_loop.bandwidth_hz", "Hz", Range::POSITIVE, "Bandwidth")
            .logarithmic(50.0, 5000.0),
    }
);

impl CurrentLoop {
    /// The bandwidth in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
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

parameters!(
    "The true plant is the identified one times factors",
    Mismatch {
        gain_factor: Parameter::new(
            "effects.mismatch.gain_factor",
            "",
            Range::closed(0.01, 100.0),
            "Factor of the plant's gain",
        )
        .or(1.0)
        .logarithmic(0.5, 2.0),
        time_constant_factor: Parameter::new(
            "effects.mismatch.time_constant_factor",
            "",
            Range::closed(0.01, 100.0),
            "Factor of the plant's time constant",
        )
        .or(1.0)
        .logarithmic(0.5, 2.0),
    }
);

impl Mismatch {
    /// The factors in their range.
    ///
    /// # Errors
    /// They are not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }

    /// The plant that `model` stands for.
    pub fn plant(&self, model: &Plant) -> Plant {
        Plant {
            gain_rad_s_v: model.gain_rad_s_v * self.gain_factor,
            time_constant_s: model.time_constant_s * self.time_constant_factor,
        }
    }
}
