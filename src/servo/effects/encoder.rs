//! Feedback of the controller: encoder, velocity estimate, noise.

use crate::parameters::{Entry, OutOfRange, Parameter, Parameters, Range, parameters};
use std::f64::consts::PI;

use super::normal::Normal;
use crate::servo::parameters::at_most_nyquist;

/// Where the encoder sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EncoderPlace {
    /// On the motor shaft: it does not see the ballscrew.
    #[default]
    Motor,
    /// A scale along the table.
    Table,
}

/// How the velocity is estimated from the positions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum VelocityEstimate {
    /// An ideal tachometer on the motor.
    #[default]
    Tachometer,
    /// Backward difference of the measured position over one period.
    Difference,
    /// The same through a first-order low pass, `v̂ += (1 - exp(-2π f Δt)) (v - v̂)`.
    LowPass {
        /// Corner `f` \[Hz\], positive, at most the Nyquist frequency.
        corner_hz: f64,
    },
    /// Tracking observer: `e = x - x̂ - Δt v̂`, `x̂ += Δt v̂ + α e`, `v̂ += β e/Δt`, with `α = 2 ζ ω_o Δt` and `β = (ω_o Δt)²`. Stable while
    /// `β > 0` and `2 α + β < 4`. The velocity is that after the correction.
    ///
    /// Source: G. Ellis, "Observers in Control Systems", chapter 10; the condition is Jury's for the α-β tracker.
    Observer {
        /// `ω_o/2π` \[Hz\], positive.
        bandwidth_hz: f64,
        /// `ζ`, positive.
        damping: f64,
    },
}

/// The encoder of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Encoder {
    /// Where it sits.
    pub place: EncoderPlace,
    /// Resolution \[µm at the table\]; 0: none. The position is rounded to the nearest multiple.
    pub resolution_um: f64,
    /// How the velocity is estimated from it.
    pub velocity: VelocityEstimate,
}

impl Parameters for Encoder {
    const ABOUT: &'static str = "Encoder: where it is, its resolution, how the velocity is estimated";
    const ENTRIES: &'static [Entry<Self>] = &[
        Entry {
            parameter: Parameter::new(
                "effects.encoder.resolution_um",
                "µm",
                Range::NOT_NEGATIVE,
                "Resolution at the table; 0: no quantisation",
            )
            .or(0.0)
            .linear(0.0, 10.0),
            get: |encoder| Some(encoder.resolution_um),
            set: |encoder, value| {
                encoder.resolution_um = value;
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "effects.encoder.velocity_hz",
                "Hz",
                Range::POSITIVE,
                "Corner of the low pass (at most the Nyquist frequency), or bandwidth of the observer",
            )
            .otherwise(
                "200, but at most a fifth of the sampling rate, and half the bandwidth below which an observer is stable",
            )
            .logarithmic(10.0, 1000.0),
            get: |encoder| match encoder.velocity {
                VelocityEstimate::LowPass { corner_hz: hz } | VelocityEstimate::Observer { bandwidth_hz: hz, .. } => {
                    Some(hz)
                }
                VelocityEstimate::Tachometer | VelocityEstimate::Difference => None,
            },
            set: |encoder, value| match &mut encoder.velocity {
                VelocityEstimate::LowPass { corner_hz: hz } | VelocityEstimate::Observer { bandwidth_hz: hz, .. } => {
                    *hz = value;
                    true
                }
                VelocityEstimate::Tachometer | VelocityEstimate::Difference => false,
            },
        },
        Entry {
            parameter: Parameter::new(
                "effects.encoder.velocity_damping",
                "",
                Range::POSITIVE,
                "Damping of the observer",
            )
            .or(1.0)
            .linear(0.2, 2.0),
            get: |encoder| match encoder.velocity {
                VelocityEstimate::Observer { damping, .. } => Some(damping),
                _ => None,
            },
            set: |encoder, value| match &mut encoder.velocity {
                VelocityEstimate::Observer { damping, .. } => {
                    *damping = value;
                    true
                }
                _ => false,
            },
        },
    ];
}

impl Encoder {
    /// Every parameter in its range, and a stable observer.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, period_s: f64) -> Result<(), OutOfRange> {
        self.check_ranges()?;
        if self.resolution_um > 0.0 && self.resolution_um < 1e-6 {
            let needed = "0 (no rounding) or at least 1e-6";
            return Err(Self::refuse("resolution_um", self.resolution_um, needed));
        }
        match self.velocity {
            VelocityEstimate::Tachometer | VelocityEstimate::Difference => Ok(()),
            VelocityEstimate::LowPass { corner_hz } => at_most_nyquist::<Self>("velocity_hz", corner_hz, period_s),
            VelocityEstimate::Observer { bandwidth_hz, damping } => {
                let (alpha, beta) = observer(bandwidth_hz, damping, period_s);
                if 2.0 * alpha + beta < 4.0 {
                    return Ok(());
                }
                let needed = "lower: the observer is unstable unless 4 ζ w + w² < 4 with w = 2π · bandwidth · period_s";
                Err(Self::refuse("velocity_hz", bandwidth_hz, needed))
            }
        }
    }
}

impl VelocityEstimate {
    /// Bandwidth below which an observer is stable \[Hz\]: `w < 2 (√(ζ² + 1) - ζ)` with `w = ω_o Δt`.
    pub fn observer_below_hz(damping: f64, period_s: f64) -> f64 {
        // As it stands the difference would lose its digits where ζ is large.
        2.0 / ((damping * damping + 1.0).sqrt() + damping) / (2.0 * PI * period_s)
    }
}

fn observer(bandwidth_hz: f64, damping: f64, period_s: f64) -> (f64, f64) {
    let w = 2.0 * PI * bandwidth_hz * period_s;
    (2.0 * damping * w, w * w)
}

/// White noise on the measured position, before it is rounded to counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation \[µm\], not negative.
    pub rms_um: f64,
    /// Seed; give each axis its own: see [`Noise::seed_of_axis`].
    pub seed: u64,
}

/// Axes that share a seed of a scenario.
const AXES_A_SEED: u64 = 8;

parameters!(
    "White noise on the measured position",
    Noise {
        rms_um: Parameter::new("effects.noise.rms_um", "µm", Range::NOT_NEGATIVE, "Standard deviation")
            .linear(0.0, 5.0),
    }
);

impl Noise {
    /// The seed of an axis (0, 1, …) where one seed is given for the machine.
    pub fn seed_of_axis(seed: u32, axis: u64) -> u64 {
        AXES_A_SEED * u64::from(seed) + axis % AXES_A_SEED
    }

    /// The seed that was given for the machine, see [`Noise::seed_of_axis`].
    pub fn given_seed(&self) -> u64 {
        self.seed / AXES_A_SEED
    }

    /// The deviation in its range.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

/// The encoder at work. Positions are in mm from the start of the axis but for the counts, which are absolute.
#[derive(Debug, Clone)]
pub(in crate::servo) struct Sensor {
    pub(in crate::servo) place: EncoderPlace,
    start_mm: f64,
    count_mm: f64,
    counts_per_mm: f64,
    velocity: VelocityEstimate,
    rate: f64,
    period_s: f64,
    low_pass: f64,
    alpha: f64,
    beta: f64,
    to_rad: f64,
    last_mm: f64,
    estimate_mm: f64,
    estimate_mm_s: f64,
    noise_mm: f64,
    random: Normal,
}

impl Sensor {
    pub(in crate::servo) fn new(
        encoder: &Encoder,
        noise: Option<&Noise>,
        transmission_mm_rad: f64,
        period_s: f64,
        start_mm: f64,
    ) -> Self {
        let (mut low_pass, mut alpha, mut beta) = (1.0, 0.0, 0.0);
        match encoder.velocity {
            VelocityEstimate::LowPass { corner_hz } => low_pass = -libm::expm1(-2.0 * PI * corner_hz * period_s),
            VelocityEstimate::Observer { bandwidth_hz, damping } => {
                (alpha, beta) = observer(bandwidth_hz, damping, period_s);
            }
            VelocityEstimate::Tachometer | VelocityEstimate::Difference => {}
        }
        let count_mm = 1e-3 * encoder.resolution_um;
        let mut sensor = Self {
            place: encoder.place,
            start_mm,
            count_mm,
            counts_per_mm: if count_mm > 0.0 { 1.0 / count_mm } else { 0.0 },
            velocity: encoder.velocity,
            rate: 1.0 / period_s,
            period_s,
            low_pass,
            alpha,
            beta,
            to_rad: 1.0 / transmission_mm_rad,
            last_mm: 0.0,
            estimate_mm: 0.0,
            estimate_mm_s: 0.0,
            noise_mm: 1e-3 * noise.map_or(0.0, |noise| noise.rms_um),
            random: Normal::new(noise.map_or(0, |noise| noise.seed)),
        };
        sensor.last_mm = sensor.rounded(0.0);
        sensor.estimate_mm = sensor.last_mm;
        sensor
    }

    #[inline(always)]
    fn rounded(&self, position_mm: f64) -> f64 {
        if self.count_mm > 0.0 {
            // To the nearest, halves to even: one instruction.
            let counts = position_mm.mul_add(self.counts_per_mm, self.start_mm * self.counts_per_mm).round_ties_even();
            counts.mul_add(self.count_mm, -self.start_mm)
        } else {
            position_mm
        }
    }

    /// Feedback position \[mm from the start\] and velocity \[rad/s\].
    #[inline(always)]
    pub(in crate::servo) fn measure(&mut self, position_mm: f64, motor_rad_s: f64) -> (f64, f64) {
        let noisy = if self.noise_mm > 0.0 { position_mm + self.noise_mm * self.random.next() } else { position_mm };
        let measured = self.rounded(noisy);
        let velocity_mm_s = match self.velocity {
            VelocityEstimate::Tachometer => return (measured, motor_rad_s),
            VelocityEstimate::Difference => (measured - self.last_mm) * self.rate,
            VelocityEstimate::LowPass { .. } => {
                let raw = (measured - self.last_mm) * self.rate;
                self.estimate_mm_s += self.low_pass * (raw - self.estimate_mm_s);
                self.estimate_mm_s
            }
            VelocityEstimate::Observer { .. } => {
                let foreseen = self.estimate_mm + self.period_s * self.estimate_mm_s;
                let error = measured - foreseen;
                self.estimate_mm = foreseen + self.alpha * error;
                self.estimate_mm_s += self.beta * self.rate * error;
                self.estimate_mm_s
            }
        };
        self.last_mm = measured;
        (measured, velocity_mm_s * self.to_rad)
    }
}
