//! All metrics of one axis' loop, with warnings in words.

use nalgebra::Complex;
use serde::Serialize;

use super::drive_loop::DriveLoop;
use super::response::Feedforward;
use super::{Linearized, StepMetrics};
use crate::limits::finite_or_null;
use crate::servo::{AxisParameters, LoopSettings};

/// From here on a peak sensitivity is called high. Åström and Murray, "Feedback Systems", section 12.1 (second edition): 1.2 to 2
/// is usual.
const HIGH_SENSITIVITY: f64 = 2.0;

/// All metrics of the loop of one axis. Keys carry their units; null in JSON is infinite, or without sense in an unstable
/// loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoopMetrics {
    /// Name of the axis.
    pub axis: String,
    /// Its controller, what else is in the loop, and what of the drive is left out.
    #[serde(flatten)]
    pub linearized: Linearized,
    /// Delay from measuring to the voltage, all together.
    pub delay_samples: f64,
    /// Whether every closed-loop pole lies inside the unit circle.
    pub stable: bool,
    /// Largest magnitude of a pole.
    pub pole_radius: f64,
    /// Closed-loop poles.
    pub poles: Vec<Pole>,
    /// See [`Margins::gain_down`](super::Margins::gain_down).
    pub gain_factor_down: f64,
    /// See [`Margins::gain_up`](super::Margins::gain_up).
    #[serde(serialize_with = "finite_or_null")]
    pub gain_factor_up: f64,
    /// Every interval of factors on the loop gain for which the loop is stable.
    pub stable_gain_factors: Vec<[Option<f64>; 2]>,
    /// See [`Margins::phase_margin_deg`](super::Margins::phase_margin_deg).
    #[serde(serialize_with = "finite_or_null")]
    pub phase_margin_deg: f64,
    /// Its crossover.
    pub crossover_rad_s: f64,
    /// See [`Margins::delay_margin_s`](super::Margins::delay_margin_s).
    #[serde(serialize_with = "finite_or_null")]
    pub delay_margin_s: f64,
    /// Largest `|1/(1 + L)|`.
    #[serde(serialize_with = "finite_or_null")]
    pub peak_sensitivity: f64,
    /// Where.
    pub peak_sensitivity_at_rad_s: f64,
    /// Smallest distance of `L` to -1.
    pub modulus_margin: f64,
    /// Velocity gain (`K_v` factor) \[1/s\]: speed of a ramp over the steady following error of feedback alone. None where that error
    /// vanishes or the loop is unstable.
    pub kv_1_s: Option<f64>,
    /// The same in the unit of machine tools \[m/min/mm\]: `0.06 K_v`.
    pub kv_m_min_mm: Option<f64>,
    /// -3 dB of command to actual position, feedback alone: the first crossing, see [`Bandwidth`](super::Bandwidth).
    pub bandwidth_feedback_rad_s: Option<f64>,
    /// From here on the response stays below.
    pub bandwidth_feedback_last_rad_s: Option<f64>,
    /// The first crossing with the feedforward.
    pub bandwidth_rad_s: Option<f64>,
    /// The last one.
    pub bandwidth_last_rad_s: Option<f64>,
    /// [`LoopMetrics::bandwidth_feedback_rad_s`] over 2π.
    pub bandwidth_feedback_hz: Option<f64>,
    /// [`LoopMetrics::bandwidth_rad_s`] over 2π.
    pub bandwidth_hz: Option<f64>,
    /// [`LoopMetrics::bandwidth_last_rad_s`] over 2π.
    pub bandwidth_last_hz: Option<f64>,
    /// Response to a step of the command, feedback alone.
    pub step_feedback: Option<StepTimes>,
    /// The same with the feedforward.
    pub step: Option<StepTimes>,
    /// Steady tracking error of a ramp, for each mm/s of its speed (negative: ahead of the command).
    pub tracking_error_um_per_mm_s: Option<f64>,
    /// Additional steady tracking error for each mm/s² of acceleration.
    pub tracking_error_um_per_mm_s2: Option<f64>,
    /// In words, for a person.
    pub warnings: Vec<String>,
}

/// A closed-loop pole `z = re + j im`, and the continuous one `s = ln(z)/Δt` with the same samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pole {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
    /// `|s|`.
    #[serde(serialize_with = "finite_or_null")]
    pub natural_rad_s: f64,
    /// `-Re s/|s|`.
    pub damping: f64,
}

impl Pole {
    fn new(z: Complex<f64>, period_s: f64) -> Self {
        let decay = 0.5 * libm::log(z.norm_sqr());
        let turn = libm::atan2(z.im, z.re);
        let size = libm::hypot(decay, turn);
        // A pole at 0 is gone after one sample; one at 1 stays.
        let damping = if decay == f64::NEG_INFINITY {
            1.0
        } else if size == 0.0 {
            0.0
        } else {
            -decay / size
        };
        Self { re: z.re, im: z.im, natural_rad_s: size / period_s, damping }
    }
}

/// Metrics of a step response, see [`StepMetrics`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepTimes {
    /// From 10 % to 90 %.
    pub rise_s: f64,
    /// Beyond the step.
    pub overshoot_percent: f64,
    /// To stay within 2 %.
    pub settling_s: f64,
}

impl From<StepMetrics> for StepTimes {
    fn from(metrics: StepMetrics) -> Self {
        let StepMetrics { rise_s, overshoot_percent, settling_s } = metrics;
        Self { rise_s, overshoot_percent, settling_s }
    }
}

impl LoopMetrics {
    /// Everything there is to say about the loop of the model of the axis called `name`.
    pub fn new(name: &str, axis: &AxisParameters, settings: &LoopSettings) -> Self {
        Self::of(name, &DriveLoop::model(axis, settings))
    }

    /// Everything there is to say about the loop of the axis called `name`.
    pub fn of(name: &str, drive: &DriveLoop) -> Self {
        let m = drive.margins();
        let errors = drive.error_constants();
        let step = |feedforward| drive.step_response(feedforward).metrics.map(StepTimes::from);
        let finite = |value: f64| value.is_finite().then_some(value);
        let factors = drive.stable_gain_factors();
        let period_s = drive.settings().period_s;
        let mut poles: Vec<Pole> = drive.poles().into_iter().map(|z| Pole::new(z, period_s)).collect();
        // The slowest first; of a pair the one above the real axis.
        poles.sort_by(|a, b| a.natural_rad_s.total_cmp(&b.natural_rad_s).then(b.im.total_cmp(&a.im)));
        let alone = drive.bandwidth(Feedforward::Without);
        let with = drive.bandwidth(Feedforward::With);
        let kv_1_s = drive.velocity_gain_1_s();
        let hz = |omega: f64| omega / std::f64::consts::TAU;
        let mut metrics = Self {
            axis: name.to_owned(),
            linearized: drive.linearized().clone(),
            delay_samples: drive.delay_samples(),
            stable: m.stable,
            pole_radius: m.pole_radius,
            poles,
            gain_factor_down: m.gain_down,
            gain_factor_up: m.gain_up,
            stable_gain_factors: factors.into_iter().map(|(low, high)| [finite(low), finite(high)]).collect(),
            phase_margin_deg: m.phase_margin_deg,
            crossover_rad_s: m.crossover_rad_s,
            delay_margin_s: m.delay_margin_s,
            peak_sensitivity: m.peak_sensitivity,
            peak_sensitivity_at_rad_s: m.peak_sensitivity_at_rad_s,
            modulus_margin: m.modulus_margin(),
            kv_1_s,
            kv_m_min_mm: kv_1_s.map(|kv| 0.06 * kv),
            bandwidth_feedback_rad_s: alone.map(|b| b.first_rad_s),
            bandwidth_feedback_last_rad_s: alone.and_then(|b| b.last_rad_s),
            bandwidth_rad_s: with.map(|b| b.first_rad_s),
            bandwidth_last_rad_s: with.and_then(|b| b.last_rad_s),
            bandwidth_feedback_hz: alone.map(|b| hz(b.first_rad_s)),
            bandwidth_hz: with.map(|b| hz(b.first_rad_s)),
            bandwidth_last_hz: with.and_then(|b| b.last_rad_s).map(hz),
            step_feedback: step(Feedforward::Without),
            step: step(Feedforward::With),
            tracking_error_um_per_mm_s: errors.map(|e| 1e3 * e.velocity_s),
            tracking_error_um_per_mm_s2: errors.map(|e| 1e3 * e.acceleration_s2),
            warnings: Vec::new(),
        };
        metrics.warnings = metrics.tell(drive);
        metrics
    }

    fn tell(&self, drive: &DriveLoop) -> Vec<String> {
        let (axis, settings, pdff) = (drive.axis(), drive.settings(), &drive.axis().pdff);
        let own = self.linearized.controller == "pdff";
        let mut out = Vec::new();
        if !drive.holds_position() {
            let why = if !own {
                "a gain of its controller is 0"
            } else if pdff.kpv_nm_s_rad == 0.0 {
                "kpv is 0"
            } else if pdff.kpp_rad_s_mm == 0.0 {
                "kpp is 0"
            } else {
                "kvf and kiv are both 0"
            };
            out.push(format!("does not hold its position: {why}"));
            return out;
        }
        if !self.stable {
            let ends = |[low, high]: &[Option<f64>; 2]| match (low.unwrap_or(0.0), high) {
                (0.0, Some(high)) => format!("below {high:.4}"),
                (low, Some(high)) => format!("from {low:.4} to {high:.4}"),
                (low, None) => format!("above {low:.4}"),
            };
            let factors = self.stable_gain_factors.iter().map(ends).collect::<Vec<_>>().join(" or ");
            // What the whole loop gain is called, and what is in the way beside it.
            let (gain, others) = match self.linearized.controller {
                "pdff" => ("kpv", "kpp or kiv"),
                "pid" => ("all three gains of the PID", "integral_v_mm_s"),
                _ => ("velocity_nm_s_rad", "position_rad_s_mm or integral_1_s"),
            };
            out.push(if factors.is_empty() {
                format!("unstable, and no loop gain would change that: lower {others}")
            } else {
                format!("unstable; {gain} times a factor {factors} would make it stable")
            });
            return out;
        }
        if self.gain_factor_down > 0.0 {
            out.push(format!(
                "conditionally stable: too little gain destabilises it, and saturation (±{} V) is too little gain: a command that \
                 saturates the drive can lock the loop into a limit cycle",
                axis.drive.voltage_limit_v
            ));
        }
        if self.peak_sensitivity > HIGH_SENSITIVITY {
            out.push(format!(
                "peak sensitivity {:.2} is high: disturbances at {:.0} rad/s are amplified that much, and small changes of the plant \
                 matter (1.2 to {HIGH_SENSITIVITY} is usual)",
                self.peak_sensitivity, self.peak_sensitivity_at_rad_s
            ));
        }
        if self.linearized.modelled.is_empty() && own && !settings.one_sample_delay {
            let delayed = LoopSettings { one_sample_delay: true, ..*settings };
            if !DriveLoop::model(axis, &delayed).is_stable() {
                out.push(
                    "with one sample of delay (control.delay_samples = 1), as most drives have, it would be unstable"
                        .to_owned(),
                );
            }
        }
        let full = 1.0 / axis.drive.transmission_mm_rad;
        if own && pdff.kpf_rad_mm > full * (1.0 + 1e-9) {
            out.push(format!(
                "kpf = {} is more than full feedforward (1/r_g = {full:.4} rad/mm): at speed the axis runs ahead of its command",
                pdff.kpf_rad_mm
            ));
        }
        out
    }
}
