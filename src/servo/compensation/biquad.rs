//! Notch and low-pass filters.

use crate::parameters::{OutOfRange, Parameter, Parameters, Range, parameters};
use std::f64::consts::PI;

/// A filter of the torque command, second order, made discrete by the bilinear transform prewarped at its frequency: there, the
/// discrete filter does exactly what the continuous one does.
///
/// Source: G. Ellis, "Control System Design Guide", 4th edition, section 9.2; A. V. Oppenheim, R. W. Schafer, "Discrete-Time
/// Signal Processing", section 7.1.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// `(s² + 2 d ζ ω_0 s + ω_0²)/(s² + 2 ζ ω_0 s + ω_0²)`.
    Notch(Notch),
    /// `ω_0²/(s² + 2 ζ ω_0 s + ω_0²)`.
    LowPass(LowPass),
}

/// A notch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Notch {
    /// Centre `ω_0/2π` \[Hz\], below [`Filter::HIGHEST`] of the sampling rate.
    pub frequency_hz: f64,
    /// What is left at the centre, `d`: from 0 (nothing) to 1 (all).
    pub depth: f64,
    /// `ζ`, positive: the width between the -3 dB points of a deep notch is `2 ζ` of the frequency.
    pub damping: f64,
}

parameters!(
    "Notch filter of the torque",
    Notch {
        frequency_hz: Parameter::new(
            "compensation.notch.frequency_hz",
            "Hz",
            Range::POSITIVE,
            "Centre, below 0.499 of the sampling rate",
        )
        .logarithmic(10.0, 2000.0),
        depth: Parameter::new("compensation.notch.depth", "", Range::closed(0.0, 1.0), "Gain at the centre")
            .or(0.0)
            .linear(0.0, 1.0),
        damping: Parameter::new("compensation.notch.damping", "", Range::POSITIVE, "Half the width over the frequency")
            .or(0.5)
            .linear(0.05, 1.0),
    }
);

/// A low pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Corner `ω_0/2π` \[Hz\], below [`Filter::HIGHEST`] of the sampling rate.
    pub frequency_hz: f64,
    /// `ζ`, positive; 0.7071 for a Butterworth filter.
    pub damping: f64,
}

parameters!(
    "Low pass of the torque, second order",
    LowPass {
        frequency_hz: Parameter::new(
            "compensation.low_pass.frequency_hz",
            "Hz",
            Range::POSITIVE,
            "Corner, below 0.499 of the sampling rate",
        )
        .logarithmic(10.0, 2000.0),
        damping: Parameter::new("compensation.low_pass.damping", "", Range::POSITIVE, "Damping; 0.7071: Butterworth")
            .or(std::f64::consts::FRAC_1_SQRT_2)
            .linear(0.2, 1.5),
    }
);

impl Filter {
    /// Share of the sampling rate that the frequency stays below: at half of it, the Nyquist frequency, there is no such filter.
    pub const HIGHEST: f64 = 0.499;

    /// Every parameter in its range, the frequency below Nyquist's.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        let needed = "below 0.499/period_s, which is just below the Nyquist frequency";
        let is_below = |frequency_hz: f64| frequency_hz * period_s < Self::HIGHEST;
        match self {
            Self::Notch(notch) => {
                notch.check_ranges()?;
                let frequency_hz = notch.frequency_hz;
                if is_below(frequency_hz) { Ok(()) } else { Err(Notch::refuse("frequency_hz", frequency_hz, needed)) }
            }
            Self::LowPass(low_pass) => {
                low_pass.check_ranges()?;
                let frequency_hz = low_pass.frequency_hz;
                if is_below(frequency_hz) { Ok(()) } else { Err(LowPass::refuse("frequency_hz", frequency_hz, needed)) }
            }
        }
    }
}

/// A filter at work: `y = (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²) x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    state: [f64; 2],
}

impl Biquad {
    /// The filter at rest.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(filter: &Filter, period_s: f64) -> Result<Self, OutOfRange> {
        filter.check(period_s)?;
        let (Filter::Notch(Notch { frequency_hz, damping, .. }) | Filter::LowPass(LowPass { frequency_hz, damping })) =
            *filter;
        // s/ω_0 = (1 - z⁻¹)/(1 + z⁻¹)/w
        let w = libm::tan(PI * frequency_hz * period_s);
        let scale = 1.0 / (1.0 + 2.0 * damping * w + w * w);
        let a = [2.0 * (w * w - 1.0) * scale, (1.0 - 2.0 * damping * w + w * w) * scale];
        let b = match *filter {
            Filter::Notch(Notch { depth, .. }) => {
                let middle = 2.0 * depth * damping * w;
                [(1.0 + middle + w * w) * scale, a[0], (1.0 - middle + w * w) * scale]
            }
            Filter::LowPass(_) => [w * w * scale, 2.0 * w * w * scale, w * w * scale],
        };
        Ok(Self { b, a, state: [0.0; 2] })
    }

    /// `b0, b1, b2` and `a1, a2`.
    pub fn coefficients(&self) -> ([f64; 3], [f64; 2]) {
        (self.b, self.a)
    }

    /// One sample.
    #[inline(always)]
    pub fn step(&mut self, x: f64) -> f64 {
        // Transposed direct form II.
        let y = self.b[0] * x + self.state[0];
        self.state = [self.b[1] * x - self.a[0] * y + self.state[1], self.b[2] * x - self.a[1] * y];
        y
    }
}
