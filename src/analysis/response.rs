//! How the closed loop follows its command.

use nalgebra::Complex;

use super::sampled_loop::SampledLoop;
use crate::servo::{AxisLoop, AxisParameters, Derivative, LoopSettings, Pdff};

/// Whether the velocity feedforward takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feedforward {
    /// Feedback alone, as if `kpf = 0`.
    Without,
    /// As the axis is.
    With,
}

impl SampledLoop {
    /// The closed loop from command to actual position, `x_act/x_com` at `omega_rad_s`, samples to samples. With
    /// [`Derivative::Exact`] the feedforward sees `jω`, else the backward difference.
    pub fn command_response(&self, omega_rad_s: f64, feedforward: Feedforward) -> Complex<f64> {
        let delta = self.delta(omega_rad_s);
        let velocity = match self.derivative {
            Derivative::Backward => delta / (delta + 1.0) / self.period_s,
            Derivative::Exact => Complex::new(0.0, omega_rad_s),
        };
        let kpf = if feedforward == Feedforward::With { self.kpf } else { 0.0 };
        let reference = velocity * kpf + self.kpp;
        let direct = delta * self.command_gain + self.integral;
        let angle = delta * self.angle[1] + self.angle[0];
        reference * direct * angle * self.r_g / (self.denominator(delta) + self.numerator(delta))
    }
}

/// Where the response from command to position falls below -3 dB (`|x_act/x_com| = 1/√2`).
///
/// A response may rise again behind its first crossing. Where it does, the two frequencies differ, and a command between them is followed
/// again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bandwidth {
    /// The lowest frequency at which the response falls through -3 dB \[rad/s\]: what is called bandwidth.
    pub first_rad_s: f64,
    /// The frequency from which on it stays below, up to `π/Δt` \[rad/s\]; `None` where it ends above.
    pub last_rad_s: Option<f64>,
}

impl Bandwidth {
    /// Over increasing frequencies, with crossings refined to rounding; `None` where the response is never below.
    pub(super) fn over(omegas: &[f64], below: impl Fn(f64) -> bool) -> Option<Self> {
        let is_below: Vec<bool> = omegas.iter().map(|omega| below(*omega)).collect();
        let crossing = |at: usize| match at.checked_sub(1) {
            Some(before) => bisect(omegas[before], omegas[at], |omega| !below(omega)),
            None => omegas[at],
        };
        let first = is_below.iter().position(|below| *below)?;
        // The end itself is below, or nothing stays below.
        let last = is_below.iter().rposition(|below| !below).map_or(0, |above| above + 1);
        Some(Self { first_rad_s: crossing(first), last_rad_s: (last < omegas.len()).then(|| crossing(last)) })
    }

    /// Whether the response rises again behind the first crossing.
    pub fn rises_again(&self) -> bool {
        self.last_rad_s != Some(self.first_rad_s)
    }
}

/// The last place from `low` to `high` where something still holds that holds at `low` and not at `high`, to rounding.
pub(super) fn bisect(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    while high - low > 4e-16 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    high
}

/// The [`Bandwidth`]. `None` when the loop is unstable, or when the response stays above -3 dB up to `π/Δt`.
///
/// Searched in steps of 1.4 % over ten decades below `π/Δt`, then refined to rounding: a notch narrower than a step is not seen.
pub fn bandwidth(axis: &AxisParameters, settings: &LoopSettings, feedforward: Feedforward) -> Option<Bandwidth> {
    const STEPS: i32 = 1600;
    let sampled = SampledLoop::new(axis, settings);
    if !sampled.is_stable_at(1.0) {
        return None;
    }
    let nyquist = sampled.nyquist_rad_s();
    let omegas: Vec<f64> = (0..=STEPS).map(|step| nyquist * libm::pow(10.0, f64::from(step - STEPS) / 160.0)).collect();
    Bandwidth::over(&omegas, |omega| sampled.command_response(omega, feedforward).norm_sqr() < 0.5)
}

/// Metrics of a step response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepMetrics {
    /// From 10 % to 90 % of the step \[s\].
    pub rise_s: f64,
    /// How far it goes beyond the step, in percent of it.
    pub overshoot_percent: f64,
    /// From then on it stays within 2 % of the step \[s\].
    pub settling_s: f64,
}

/// The response to a unit step of the position command, without saturation.
#[derive(Debug, Clone, PartialEq)]
pub struct StepResponse {
    /// Control period: sample `k` is at `k` of them \[s\].
    pub period_s: f64,
    /// Actual position at each sample, as a share of the step.
    pub actual: Vec<f64>,
    /// `None` when the loop is unstable or has not settled in [`StepResponse::actual`].
    pub metrics: Option<StepMetrics>,
}

/// Share of a step that it settles to.
const SETTLED: f64 = 0.02;

/// Most samples of a step response.
const MOST_SAMPLES: usize = 2_000_000;

/// Samples of an unstable step response: enough to see it grow.
pub(super) const UNSTABLE_SAMPLES: usize = 200;

/// The step response, run through the very [`AxisLoop`] with a voltage limit that is never reached. The step comes with
/// sample 0; with [`Feedforward::With`] and [`Derivative::Backward`] the feedforward sees its difference there, a pulse
/// of one period ([`Derivative::Exact`] sees nothing: a step has no velocity at the samples).
///
/// Times between samples are interpolated linearly. At most two million samples.
pub fn step_response(axis: &AxisParameters, settings: &LoopSettings, feedforward: Feedforward) -> StepResponse {
    let sampled = SampledLoop::new(axis, settings);
    let stable = sampled.is_stable_at(1.0);
    let kpf_rad_mm = if feedforward == Feedforward::With { axis.pdff.kpf_rad_mm } else { 0.0 };
    let mut linear = AxisParameters { pdff: Pdff { kpf_rad_mm, ..axis.pdff }, ..*axis };
    linear.drive.voltage_limit_v = f64::INFINITY;
    let mut axis_loop = AxisLoop::new(&linear, settings, 0.0);
    let samples = if stable { samples_to_settle(sampled.pole_radius()) } else { UNSTABLE_SAMPLES };
    let run = (0..samples).map(|_| axis_loop.step(1.0, 0.0).actual_mm);
    let actual: Vec<f64> = run.take_while(|x| x.is_finite()).collect();
    let metrics = if stable { metrics(&actual, settings.period_s) } else { None };
    StepResponse { period_s: settings.period_s, actual, metrics }
}

/// Until the slowest pole has fallen to a ten-thousandth.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded from both sides
pub(super) fn samples_to_settle(pole_radius: f64) -> usize {
    let samples = libm::log(1e-4) / libm::log(pole_radius.clamp(1e-3, 1.0));
    if samples.is_finite() { samples.clamp(20.0, MOST_SAMPLES as f64) as usize } else { MOST_SAMPLES }
}

pub(super) fn metrics(actual: &[f64], period_s: f64) -> Option<StepMetrics> {
    // Where the line between samples k - 1 and k is at `level`.
    let time = |k: usize, level: f64| {
        let (before, after) = (actual[k - 1], actual[k]);
        ((k - 1) as f64 + (level - before) / (after - before)) * period_s
    };
    let reach = |level: f64| {
        let k = actual.iter().position(|x| *x >= level)?;
        Some(if k == 0 { 0.0 } else { time(k, level) })
    };
    let peak = actual.iter().copied().fold(0.0, f64::max);
    let outside = actual.iter().rposition(|x| !((x - 1.0).abs() <= SETTLED))?;
    if outside + 1 == actual.len() {
        return None;
    }
    let edge = if actual[outside] > 1.0 { 1.0 + SETTLED } else { 1.0 - SETTLED };
    Some(StepMetrics {
        rise_s: reach(0.9)? - reach(0.1)?,
        overshoot_percent: 100.0 * (peak - 1.0).max(0.0),
        settling_s: time(outside + 1, edge),
    })
}

/// Steady tracking error `x_com - x_act` at the samples behind a slowly changing command:
/// `e = velocity · ẋ + acceleration · ẍ + …`, the first terms of the series of the error transfer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorConstants {
    /// Steady error per speed of a ramp \[mm per mm/s = s\]. With an integral it is `(1/r_g - kpf)/kpp`, whatever the sampling,
    /// delay and derivative.
    pub velocity_s: f64,
    /// Additional error per acceleration \[mm per mm/s² = s²\].
    pub acceleration_s2: f64,
}

/// The error constants of an axis. `None` when the loop is unstable.
///
/// The error transfer is
/// `E = (δ² (δ + c) zᵈ + δ K c (G δ + Δt G kiv) - r_g kpf D P (G kvf δ + Δt G kiv)) / (δ² (δ + c) zᵈ + N)`, `d = 1` with a sample
/// of delay else 0, `D` the derivative: `(1 - 1/z)/Δt`, or `s` when exact. It is expanded in `s` with `z = exp(sΔt)`.
pub fn error_constants(axis: &AxisParameters, settings: &LoopSettings) -> Option<ErrorConstants> {
    let sampled = SampledLoop::new(axis, settings);
    if !sampled.is_stable_at(1.0) {
        return None;
    }
    let dt = settings.period_s;
    // In powers of p = s Δt, and divided by δ/p once where there is no integral.
    let delta = Series([0.0, 1.0, 1.0 / 2.0, 1.0 / 6.0]);
    let z = delta.plus(Series([1.0, 0.0, 0.0, 0.0]));
    let velocity = match settings.derivative {
        Derivative::Backward => Series([0.0, 1.0, -1.0 / 2.0, 1.0 / 6.0]),
        Derivative::Exact => Series([0.0, 1.0, 0.0, 0.0]),
    };
    let plus = |series: Series, constant: f64| series.plus(Series([constant, 0.0, 0.0, 0.0]));
    let mut plant = delta.times(delta).times(plus(delta, sampled.gap));
    if sampled.delay {
        plant = plant.times(z);
    }
    let angle = plus(delta.scaled(sampled.angle[1]), sampled.angle[0]);
    let direct = plus(delta.scaled(sampled.command_gain), sampled.integral);
    let damping = delta.times(plus(delta.scaled(sampled.gain), sampled.integral)).scaled(sampled.speed);
    let forward = velocity.times(angle).times(direct).scaled(sampled.r_g * sampled.kpf / dt);
    let back = angle.times(direct).scaled(sampled.r_g * sampled.kpp);
    let error = plant.plus(damping).plus(forward.scaled(-1.0));
    let all = plant.plus(damping).plus(back);
    let (Series(mut numerator), Series(mut denominator)) = (error, all);
    if sampled.integral == 0.0 {
        // Both have the factor δ of the integral that is not there.
        numerator.rotate_left(1);
        denominator.rotate_left(1);
    }
    let first = numerator[1] / denominator[0];
    let second = (numerator[2] - first * denominator[1]) / denominator[0];
    Some(ErrorConstants { velocity_s: first * dt, acceleration_s2: second * dt * dt })
}

/// A power series up to the third power.
#[derive(Debug, Clone, Copy)]
struct Series([f64; 4]);

impl Series {
    fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    fn scaled(self, by: f64) -> Self {
        Self(self.0.map(|c| c * by))
    }

    fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| (0..=k).map(|i| self.0[i] * other.0[k - i]).sum()))
    }
}
