//! Frequency response by stepped sines.

use crate::parameters::{AXIS_NAMES, OutOfRange, axis_title};
use std::f64::consts::TAU;

use nalgebra::Complex;
use rayon::prelude::*;
use serde::Serialize;

use super::single_axis::{Bench, Sample};
use super::{MeasureError, idle, neglected, um, within};
use crate::analysis::{DriveLoop, Feedforward, Linearized};
use crate::scenario::Scenario;
use crate::servo::AxisReference;

/// What frequencies are measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ResponseRequest {
    /// Lowest frequency \[Hz\]; by default 1 Hz, or a hundredth of the highest one where that is more than a hundred.
    pub low_hz: Option<f64>,
    /// Highest frequency \[Hz\]; by default half the Nyquist frequency, at most 0.95 of it: nearer to it the samples hardly tell a sine from
    /// its mirror image above it.
    pub high_hz: Option<f64>,
    /// How many, evenly spaced in their logarithm, 2 to 1000; by default 60.
    pub points: Option<u32>,
    /// Amplitude of the command \[µm\]. By default what takes half the voltage limit at that frequency, at most the scenario's feed and 1 mm.
    pub amplitude_um: Option<f64>,
}

/// The response at one frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResponsePoint {
    /// Frequency.
    pub frequency_hz: f64,
    /// `|x_act/x_com|`.
    pub magnitude_db: f64,
    /// Its phase, continuous over frequency.
    pub phase_deg: f64,
    /// The same of the linear analysis.
    pub model_db: Option<f64>,
    /// See `model_db`.
    pub model_deg: Option<f64>,
    /// Amplitude of the command.
    pub amplitude_um: f64,
    /// Whether the voltage was clamped.
    pub saturated: bool,
}

impl ResponsePoint {
    /// Whether the table moves at all: a motion lost in backlash or friction has no phase.
    pub fn moves(&self) -> bool {
        self.magnitude_db > STILL_DB
    }
}

/// The response of one axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisResponse {
    /// Name of the axis.
    pub axis: String,
    /// The lowest frequency at which the magnitude falls through -3 dB (`1/√2`), if it is reached: measured again and again between the
    /// two points around it, until they are 0.2 % apart. None where the table does not move on one side of it.
    pub bandwidth_hz: Option<f64>,
    /// The frequency from which on it stays below, up to the last one measured: another one where the response rises again.
    pub bandwidth_last_hz: Option<f64>,
    /// The first crossing of the linear analysis, from its formula, whatever was measured.
    pub model_bandwidth_hz: Option<f64>,
    /// Its last crossing, see [`Bandwidth`](crate::analysis::Bandwidth).
    pub model_bandwidth_last_hz: Option<f64>,
    /// What the linear analysis takes in, and what it leaves out.
    #[serde(flatten)]
    pub linearized: Linearized,
    /// Largest magnitude.
    pub peak_db: f64,
    /// Where.
    pub peak_hz: f64,
    /// Largest distance from the model's magnitude, where the table moves.
    pub model_deviation_db: Option<f64>,
    /// Largest distance from the model's phase.
    pub model_deviation_deg: Option<f64>,
    /// In words, for a person.
    pub warnings: Vec<String>,
    /// By rising frequency.
    pub points: Vec<ResponsePoint>,
    /// The linear analysis between them, to be drawn: frequency, magnitude \[dB\], phase \[deg\].
    #[serde(skip)]
    pub model_curve: Vec<[f64; 3]>,
}

/// The responses of all axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Name of the scenario.
    pub scenario: String,
    /// Control period.
    pub period_s: f64,
    /// One an axis.
    pub axes: Vec<AxisResponse>,
    /// In words, for a person: what of the scenario takes no part.
    pub warnings: Vec<String>,
}

/// Largest amplitude that is chosen \[mm\].
const LARGEST_MM: f64 = 1.0;
/// Share of the voltage limit that the amplitude is chosen for, and that it may come to.
const WANTED_SHARE: f64 = 0.4;
const MOST_SHARE: f64 = 0.5;
/// Samples that the loop gets to settle, at least \[s\].
const SETTLING_S: f64 = 0.4;
/// Highest frequency, over the Nyquist frequency `f_N`. The samples of `f_N - δ` are those of `f_N + δ` in the mirror: a swing from sample to
/// sample whose size beats with `δ`. At `f_N` itself they meet the sine at the same place again and again, and it has neither magnitude nor
/// phase. Down here a block has ten beats at least. [`Tone::near`] may go up a little from what is asked for.
const HIGHEST: f64 = 0.95;
/// A block of whole periods has at least so many samples.
const BLOCK: f64 = 400.0;
/// Two blocks that agree to this are the answer.
const AGREEMENT: f64 = 1e-6;
/// Else it is the mean of all of so many but the first.
const MOST_BLOCKS: usize = 6;
/// Amplitudes that are tried.
const MOST_TRIALS: usize = 8;
/// Most samples of one block.
const MOST_BLOCK: f64 = 2e6;

/// The response from position command to table, measured sine by sine through the loop: at rest, settle, then whole periods over a whole
/// number of samples `N`, whose discrete Fourier transforms divide without leakage,
///
/// ```text
/// H(jω) = Σ x_act[k] exp(-2πi m k/N) / Σ x_com[k] exp(-2πi m k/N)      ω = 2π m/(N Δt), m and N without common divisor
/// ```
///
/// until two blocks agree to 1e-6, or as the mean of five where noise, counts or friction keep them apart. The feedforward takes part; the
/// cross-coupling and the cutting force do not. Beside it stands the linear analysis of the same drive, [`DriveLoop::command_response`].
///
/// Source: L. Ljung, "System Identification", 2nd edition, section 6.2 (frequency analysis by the correlation method); R. Pintelon,
/// J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd edition, section 2.2.
///
/// # Errors
/// A request out of its range, a loop that is unstable (it swings by itself, whatever its command) or diverges.
pub fn response(scenario: &Scenario, request: &ResponseRequest) -> Result<Response, MeasureError> {
    let idle = idle(scenario);
    let period_s = scenario.settings.period_s;
    scenario.settings.check()?;
    let nyquist = 0.5 / period_s;
    let high = within("high_hz", request.high_hz.unwrap_or(0.5 * nyquist), 1e-6 * nyquist, HIGHEST * nyquist);
    let high = high.map_err(|error| match error {
        MeasureError::Request(error) => {
            let needed = format!(
                "{}, {HIGHEST} of the Nyquist frequency 0.5/period_s: nearer to it the samples hardly tell a sine from its mirror \
                 image above it",
                error.needed
            );
            MeasureError::Request(OutOfRange { needed: needed.into(), ..error })
        }
        error => error,
    })?;
    let low = within("low_hz", request.low_hz.unwrap_or((0.01 * high).min(1.0)), 1e-7 * nyquist, 0.999 * high)?;
    let points = request.points.unwrap_or(60);
    within("points", f64::from(points), 2.0, 1000.0)?;
    if let Some(amplitude) = request.amplitude_um {
        within("amplitude_um", amplitude, 1e-6, 1e6)?;
    }
    let last = f64::from(points - 1);
    let tones: Vec<Tone> =
        (0..points).map(|k| Tone::near(low * libm::pow(high / low, f64::from(k) / last), period_s, nyquist)).collect();
    let axes = 0..idle.axes.len();
    let loops = axes.clone().map(|axis| stable(&idle, axis)).collect::<Result<Vec<_>, _>>()?;
    // One an axis and frequency: on all cores, and the same on any number of them.
    let jobs: Vec<(usize, Tone)> = axes.clone().flat_map(|axis| tones.iter().map(move |tone| (axis, *tone))).collect();
    let measured: Vec<Measured> = jobs
        .par_iter()
        .map(|&(axis, tone)| measure(&idle, axis, tone, request.amplitude_um))
        .collect::<Result<_, MeasureError>>()?;
    let found = loops.iter().zip(measured.chunks(tones.len().max(1))).enumerate();
    let axes = found.map(|(axis, (model, found))| {
        let mut metrics = metrics(&idle, axis, model, &tones, found);
        metrics.find_bandwidth(|hz| {
            let tone = Tone::near(hz, period_s, nyquist);
            Ok((tone.hz, decibel(measure(&idle, axis, tone, request.amplitude_um)?.response)))
        })?;
        Ok(metrics)
    });
    Ok(Response {
        scenario: scenario.name.clone(),
        period_s,
        axes: axes.collect::<Result<_, MeasureError>>()?,
        warnings: neglected(scenario, true),
    })
}

/// The linear loop of an axis. Only a stable one has a response.
fn stable(scenario: &Scenario, axis: usize) -> Result<DriveLoop, MeasureError> {
    let found = DriveLoop::new(&scenario.axes[axis], &scenario.drives[axis], &scenario.settings)?;
    if found.is_stable() {
        return Ok(found);
    }
    Err(MeasureError::Unstable { axis: axis_title(axis) })
}

/// `m` periods in `n` samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tone {
    m: u64,
    n: u64,
    hz: f64,
}

impl Tone {
    /// The tone next to a frequency that fits its block.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded from both sides
    fn near(hz: f64, period_s: f64, nyquist_hz: f64) -> Self {
        let periods = (BLOCK * period_s * hz).ceil().clamp(1.0, BLOCK);
        let samples = (periods / (period_s * hz)).round().clamp(3.0, MOST_BLOCK);
        let (m, mut n) = (periods as u64, samples as u64);
        // One that every sample meets in another phase, and that stays below the Nyquist frequency.
        while divisor(m, n) > 1 || (m as f64) / (n as f64 * period_s) > 0.96 * nyquist_hz {
            n += 1;
        }
        Self { m, n, hz: m as f64 / (n as f64 * period_s) }
    }

    /// `exp(2πi m k/n)`.
    fn turn(&self, k: u64) -> Complex<f64> {
        let share = (self.m * (k % self.n)) % self.n;
        let (sin, cos) = libm::sincos(TAU * share as f64 / self.n as f64);
        Complex::new(cos, sin)
    }
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// What came of one tone.
#[derive(Debug, Clone, Copy)]
struct Measured {
    response: Complex<f64>,
    amplitude_mm: f64,
    saturated: bool,
}

fn measure(scenario: &Scenario, axis: usize, tone: Tone, wanted_um: Option<f64>) -> Result<Measured, MeasureError> {
    let omega = TAU * tone.hz;
    let limit_v = scenario.axes[axis].drive.voltage_limit_v;
    if let Some(wanted) = wanted_um {
        return Sine::new(scenario, axis, tone, 1e-3 * wanted)?.measure();
    }
    let mut amplitude_mm = LARGEST_MM.min(scenario.feed_mm_s / omega);
    let mut sine = Sine::new(scenario, axis, tone, amplitude_mm)?;
    for _ in 0..MOST_TRIALS {
        if !sine.saturated && sine.peak_v <= MOST_SHARE * limit_v {
            break;
        }
        // Of a clamped voltage nobody knows how large it would have been.
        amplitude_mm *= if sine.saturated { 0.1 } else { WANTED_SHARE * limit_v / sine.peak_v };
        sine = Sine::new(scenario, axis, tone, amplitude_mm)?;
    }
    sine.measure()
}

/// A sine through an axis that has settled.
struct Sine {
    bench: Bench,
    tone: Tone,
    amplitude_mm: f64,
    peak_v: f64,
    saturated: bool,
    k: u64,
}

impl Sine {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded
    fn new(scenario: &Scenario, axis: usize, tone: Tone, amplitude_mm: f64) -> Result<Self, MeasureError> {
        let bench = Bench::new(scenario, axis)?;
        let mut sine = Self { bench, tone, amplitude_mm, peak_v: 0.0, saturated: false, k: 0 };
        let settling = (SETTLING_S / scenario.settings.period_s).clamp(400.0, 20_000.0) as u64;
        for _ in 0..settling {
            sine.step()?;
        }
        Ok(sine)
    }

    fn step(&mut self) -> Result<Sample, MeasureError> {
        let Self { tone, amplitude_mm, .. } = *self;
        let omega = TAU * tone.hz;
        let sample = self.bench.step(&|k| {
            let turn = tone.turn(k);
            AxisReference {
                position_mm: amplitude_mm * turn.im,
                velocity_mm_s: amplitude_mm * omega * turn.re,
                acceleration_mm_s2: -amplitude_mm * omega * omega * turn.im,
                jerk_mm_s3: -amplitude_mm * omega * omega * omega * turn.re,
                torque_nm: 0.0,
                command_offset_mm: 0.0,
            }
        })?;
        self.peak_v = self.peak_v.max(sample.voltage_v.abs());
        self.saturated |= sample.saturated;
        self.k += 1;
        Ok(sample)
    }

    fn measure(mut self) -> Result<Measured, MeasureError> {
        let mut blocks: Vec<Complex<f64>> = Vec::with_capacity(MOST_BLOCKS);
        while blocks.len() < MOST_BLOCKS {
            let (mut command, mut actual) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
            for _ in 0..self.tone.n {
                let back = self.tone.turn(self.k).conj();
                let sample = self.step()?;
                command += back * sample.command_mm;
                actual += back * sample.actual_mm;
            }
            let found = actual / command;
            let agree = blocks.last().is_some_and(|before| (found - before).norm() <= AGREEMENT * found.norm());
            blocks.push(found);
            if agree {
                break;
            }
        }
        let kept = if blocks.len() < MOST_BLOCKS { 1 } else { MOST_BLOCKS - 1 };
        let sum: Complex<f64> = blocks.iter().rev().take(kept).sum();
        let Self { amplitude_mm, saturated, .. } = self;
        Ok(Measured { response: sum / kept as f64, amplitude_mm, saturated })
    }
}

/// A table that moves by less than this share of its command does not move, but for rounding and noise.
const STILL_DB: f64 = -100.0;

/// Finite even where nothing moves at all.
fn decibel(value: Complex<f64>) -> f64 {
    20.0 * libm::log10(libm::hypot(value.re, value.im).max(1e-10))
}

/// The angle \[deg\] next to the one before.
fn continued(value: Complex<f64>, before: f64) -> f64 {
    let principal = libm::atan2(value.im, value.re).to_degrees();
    principal + 360.0 * ((before - principal) / 360.0).round()
}

/// Points of the curve of the linear analysis.
const CURVE_POINTS: u32 = 600;

fn metrics(scenario: &Scenario, axis: usize, model: &DriveLoop, tones: &[Tone], measured: &[Measured]) -> AxisResponse {
    let known = |hz: f64| model.command_response(TAU * hz, Feedforward::With);
    let (mut phase, mut model_phase) = (0.0, 0.0);
    let mut points = Vec::with_capacity(tones.len());
    for (tone, found) in tones.iter().zip(measured) {
        phase = continued(found.response, phase);
        let known = known(tone.hz);
        model_phase = continued(known, model_phase);
        points.push(ResponsePoint {
            frequency_hz: tone.hz,
            magnitude_db: decibel(found.response),
            phase_deg: phase,
            model_db: Some(decibel(known)),
            model_deg: Some(model_phase),
            amplitude_um: um(found.amplitude_mm),
            saturated: found.saturated,
        });
    }
    let ends = points.first().zip(points.last()).map(|(first, last)| [first.frequency_hz, last.frequency_hz]);
    let mut curve_phase = points.first().and_then(|point| point.model_deg).unwrap_or(0.0);
    let model_curve = ends.map_or(Vec::new(), |[low, high]| {
        let at = |k: u32| low * libm::pow(high / low, f64::from(k) / f64::from(CURVE_POINTS));
        let mut point = |hz: f64| {
            let known = known(hz);
            curve_phase = continued(known, curve_phase);
            [hz, decibel(known), curve_phase]
        };
        (0..=CURVE_POINTS).map(|k| point(at(k))).collect()
    });
    let moving = || points.iter().filter(|point| point.moves());
    let peak = moving().copied().reduce(|a, b| if b.magnitude_db > a.magnitude_db { b } else { a });
    let largest = |distance: &dyn Fn(&ResponsePoint) -> Option<f64>| {
        moving().map(distance).collect::<Option<Vec<f64>>>().map(|d| d.into_iter().fold(0.0, f64::max))
    };
    let mut warnings = Vec::new();
    let still = points.iter().filter(|point| !point.moves()).count();
    if still > 0 {
        warnings.push(format!(
            "the table does not move at {still} of {} frequencies: so small a motion is lost in backlash or friction",
            points.len()
        ));
    }
    let saturated = points.iter().filter(|point| point.saturated).count();
    if saturated > 0 {
        warnings.push(format!(
            "saturated at {saturated} of {} frequencies: there the loop is not linear, a smaller amplitude would show it",
            points.len()
        ));
    }
    let count_um = scenario.drives[axis].effects.encoder.map_or(0.0, |encoder| encoder.resolution_um);
    let fine = points.iter().filter(|point| point.amplitude_um < count_um).count();
    if fine > 0 {
        warnings.push(format!(
            "at {fine} of {} frequencies the amplitude of the command is below one count of the encoder ({count_um} µm): what is \
             measured there is rounding, not the loop",
            points.len()
        ));
    }
    let model_bandwidth = model.bandwidth(Feedforward::With);
    AxisResponse {
        axis: AXIS_NAMES[axis].to_owned(),
        bandwidth_hz: None,
        bandwidth_last_hz: None,
        model_bandwidth_hz: model_bandwidth.map(|b| b.first_rad_s / TAU),
        model_bandwidth_last_hz: model_bandwidth.and_then(|b| b.last_rad_s).map(|omega| omega / TAU),
        linearized: model.linearized().clone(),
        peak_db: peak.map_or(0.0, |peak| peak.magnitude_db),
        peak_hz: peak.map_or(0.0, |peak| peak.frequency_hz),
        model_deviation_db: largest(&|point| Some((point.magnitude_db - point.model_db?).abs())),
        model_deviation_deg: largest(&|point| {
            let distance = point.phase_deg - point.model_deg?;
            Some((distance - 360.0 * (distance / 360.0).round()).abs())
        }),
        warnings,
        points,
        model_curve,
    }
}

/// -3 dB.
const HALF_POWER_DB: f64 = -3.010_299_956_639_812;
/// The two frequencies around the bandwidth are brought this near to each other, and how often that is tried.
const NEAR: f64 = 1.002;
const MOST_HALVINGS: usize = 16;

/// Behind the point, for four digits in all.
fn decimals(value: f64) -> usize {
    (0..9).find(|&decimals| value * libm::pow(10.0, decimals as f64) >= 1e3).unwrap_or(9)
}

impl AxisResponse {
    /// Where the magnitude falls below -3 dB, for the first and for the last time: between the points around it more are measured, then
    /// interpolated in decibel over the logarithm of the frequency.
    ///
    /// - `measure`: the frequency next to one that can be measured, and the magnitude there
    fn find_bandwidth(
        &mut self,
        measure: impl Fn(f64) -> Result<(f64, f64), MeasureError>,
    ) -> Result<(), MeasureError> {
        let is_below = |point: &ResponsePoint| point.magnitude_db < HALF_POWER_DB;
        let Some(first) = self.points.iter().position(is_below) else { return Ok(()) };
        let last = self.points.iter().rposition(|point| !is_below(point)).map_or(first, |above| above + 1);
        match self.crossing(first, &measure)? {
            Some(Crossing::At(hz)) => self.bandwidth_hz = Some(hz),
            Some(Crossing::Stops(a, b)) => self.warnings.push(format!(
                "no bandwidth: the magnitude does not fall through -3 dB, the table stops moving between {:.*} and {:.*} Hz",
                decimals(a),
                a,
                decimals(b),
                b
            )),
            None => {}
        }
        self.bandwidth_last_hz = if last == first {
            self.bandwidth_hz
        } else {
            self.crossing(last, &measure)?.and_then(|crossing| match crossing {
                Crossing::At(hz) => Some(hz),
                Crossing::Stops(..) => None,
            })
        };
        Ok(())
    }

    /// The crossing between the point `below` and the one before; none where there is no such pair.
    fn crossing(
        &self,
        below: usize,
        measure: impl Fn(f64) -> Result<(f64, f64), MeasureError>,
    ) -> Result<Option<Crossing>, MeasureError> {
        let before = below.checked_sub(1).and_then(|before| self.points.get(before));
        let (Some(a), Some(b)) = (before, self.points.get(below)) else { return Ok(None) };
        let (mut a, mut b) = ((a.frequency_hz, a.magnitude_db), (b.frequency_hz, b.magnitude_db));
        for _ in 0..MOST_HALVINGS {
            if b.1 <= STILL_DB || b.0 <= NEAR * a.0 {
                break;
            }
            let middle = measure((a.0 * b.0).sqrt())?;
            if !(middle.0 > a.0 && middle.0 < b.0) {
                break;
            }
            if middle.1 < HALF_POWER_DB { b = middle } else { a = middle }
        }
        if b.1 <= STILL_DB {
            return Ok(Some(Crossing::Stops(a.0, b.0)));
        }
        let share = (a.1 - HALF_POWER_DB) / (a.1 - b.1);
        Ok(Some(Crossing::At(a.0 * libm::pow(b.0 / a.0, share))))
    }
}

/// What is found between a point above -3 dB and one below.
enum Crossing {
    /// The frequency \[Hz\].
    At(f64),
    /// The table stops moving between two frequencies \[Hz\].
    Stops(f64, f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_fit_their_blocks() {
        for period_s in [1e-3, 1e-5, 0.05] {
            let nyquist = 0.5 / period_s;
            for k in 0..200 {
                let hz = nyquist * libm::pow(10.0, -6.0 + 6.0 * f64::from(k) / 200.0).min(0.95);
                let tone = Tone::near(hz, period_s, nyquist);
                assert!(divisor(tone.m, tone.n) == 1 && tone.hz < 0.97 * nyquist, "{hz} {tone:?}");
                assert!((tone.hz / hz - 1.0).abs() < 0.02 || tone.n >= 2_000_000, "{hz} {tone:?}");
            }
        }
    }
}
