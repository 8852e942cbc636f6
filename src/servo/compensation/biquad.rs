//! Notch and low-pass filters.

use crate::parameters::OutOfRange;
use std::f64::consts::PI;

use crate::servo::parameters::positive;

/// A filter of the torque command, second order, made discrete by the bilinear transform prewarped at its frequency: there, the
/// discrete filter does exactly what the continuous one does.
///
/// Source: G. Ellis, "Control System Design Guide", 4th edition, section 9.2; A. V. Oppenheim, R. W. Schafer, "Discrete-Time
/// Signal Processing", section 7.1.2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    /// `(s² + 2 d ζ ω_0 s + ω_0²)/(s² + 2 ζ ω_0 s + ω_0²)`.
    Notch {
        /// Centre `ω_0/2π` \[Hz\], below [`Self::HIGHEST`] of the sampling rate.
        frequency_hz: f64,
        /// What is left at the centre, `d`: from 0 (nothing) to 1 (all).
        depth: f64,
        /// `ζ`, positive: the width between the -3 dB points of a deep notch is `2 ζ` of the frequency.
        damping: f64,
    },
    /// `ω_0²/(s² + 2 ζ ω_0 s + ω_0²)`.
    LowPass {
        /// Corner `ω_0/2π` \[Hz\], below [`Self::HIGHEST`] of the sampling rate.
        frequency_hz: f64,
        /// `ζ`, positive; 0.7071 for a Butterworth filter.
        damping: f64,
    },
}

impl Filter {
    /// Share of the sampling rate that the frequency stays below: at half of it, the Nyquist frequency, there is no such filter.
    pub const HIGHEST: f64 = 0.499;

    /// Every parameter in its range, the frequency below Nyquist's.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        let (name, frequency_hz, damping) = match *self {
            Self::Notch { frequency_hz, depth, damping } => {
                if !(0.0..=1.0).contains(&depth) {
                    return Err(OutOfRange::new("depth of the notch", depth, "from 0 to 1"));
                }
                ("frequency_hz of the notch", frequency_hz, damping)
            }
            Self::LowPass { frequency_hz, damping } => ("frequency_hz of the low pass", frequency_hz, damping),
        };
        positive(name, frequency_hz)?;
        positive("damping of the filter", damping)?;
        if !(frequency_hz * period_s < Self::HIGHEST) {
            let needed = "below 0.499/period_s, which is just below the Nyquist frequency";
            return Err(OutOfRange::new(name, frequency_hz, needed));
        }
        Ok(())
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
        let (Filter::Notch { frequency_hz, damping, .. } | Filter::LowPass { frequency_hz, damping }) = *filter;
        // s/ω_0 = (1 - z⁻¹)/(1 + z⁻¹)/w
        let w = libm::tan(PI * frequency_hz * period_s);
        let scale = 1.0 / (1.0 + 2.0 * damping * w + w * w);
        let a = [2.0 * (w * w - 1.0) * scale, (1.0 - 2.0 * damping * w + w * w) * scale];
        let b = match *filter {
            Filter::Notch { depth, .. } => {
                let middle = 2.0 * depth * damping * w;
                [(1.0 + middle + w * w) * scale, a[0], (1.0 - middle + w * w) * scale]
            }
            Filter::LowPass { .. } => [w * w * scale, 2.0 * w * w * scale, w * w * scale],
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
