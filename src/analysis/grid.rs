//! Metrics of a loop that is known frequency by frequency: a fine grid, and what is found on it refined.

use nalgebra::Complex;

use super::linear_drive::LinearDrive;
use super::margins::Margins;
use super::response::{Bandwidth, Feedforward, bisect};
use crate::optimize::golden_section;

/// Points a decade of the logarithmic grid, and of the even one beside it.
const A_DECADE: f64 = 250.0;
const EVEN: u32 = 800;
/// Decades below the Nyquist frequency, at least.
const DECADES: f64 = 7.0;
/// Distances from a resonance in its widths.
const AROUND: [f64; 10] = [0.0, 0.15, 0.3, 0.5, 0.75, 1.0, 1.5, 2.5, 5.0, 12.0];

/// The loop on a grid of frequencies.
pub(super) struct OnGrid<'a> {
    drive: &'a LinearDrive,
    /// Rising, the last one the Nyquist frequency.
    points: Vec<(f64, Complex<f64>)>,
}

impl<'a> OnGrid<'a> {
    pub(super) fn new(drive: &'a LinearDrive) -> Self {
        let points = frequencies(drive).into_iter().map(|omega| (omega, drive.transfer(omega)));
        Self { drive, points: points.filter(|(_, l)| l.re.is_finite() && l.im.is_finite()).collect() }
    }

    /// Where a function of frequency and loop changes its sign.
    fn crossings(&self, value: impl Fn(f64, Complex<f64>) -> f64) -> Vec<f64> {
        let positive = |omega: f64, l: Complex<f64>| value(omega, l) > 0.0;
        let mut found = Vec::new();
        for pair in self.points.windows(2) {
            let &[(a, la), (b, lb)] = pair else { continue };
            let first = positive(a, la);
            if first == positive(b, lb) {
                continue;
            }
            found.push(bisect(a, b, |omega| positive(omega, self.drive.transfer(omega)) == first));
        }
        found
    }

    /// Where `|L| = 1`.
    pub(super) fn crossovers(&self) -> Vec<f64> {
        self.crossings(|_, l| l.norm_sqr() - 1.0)
    }

    /// Where `L` is real and negative, with the factor on the loop gain that puts a pole there.
    pub(super) fn critical(&self) -> Vec<(f64, f64)> {
        let mut places = self.crossings(|_, l| l.im);
        // At the Nyquist frequency every loop is real.
        if let Some((nyquist, l)) = self.points.last()
            && l.im.abs() <= 1e-6 * l.re.abs()
        {
            places.retain(|omega| (omega / nyquist - 1.0).abs() > 1e-9);
            places.push(*nyquist);
        }
        let factor = |omega: f64| {
            let l = self.drive.transfer(omega);
            // Where it jumps from side to side, at an undamped resonance, it is not real.
            let factor = -1.0 / l.re;
            (l.im.abs() <= 1e-4 * l.re.abs() && factor > 1e-12 && factor < 1e12).then_some((omega, factor))
        };
        places.into_iter().filter_map(factor).collect()
    }

    fn sensitivity(&self, omega: f64) -> f64 {
        1.0 / (self.drive.transfer(omega) + 1.0).norm_sqr()
    }

    /// The largest `|1/(1 + L)|`, and where.
    fn peak_sensitivity(&self) -> (f64, f64) {
        let values: Vec<f64> = self.points.iter().map(|(_, l)| 1.0 / (l + 1.0).norm_sqr()).collect();
        let mut best = (0.0, 0.0);
        for (i, &value) in values.iter().enumerate() {
            let before = i.checked_sub(1).and_then(|i| values.get(i)).copied().unwrap_or(0.0);
            let after = values.get(i + 1).copied().unwrap_or(0.0);
            if value < before || value < after || value < 0.5 * best.0 {
                continue;
            }
            let omega = |i: usize| self.points.get(i).map(|(omega, _)| *omega);
            let here = omega(i).unwrap_or(0.0);
            let (low, high) = (i.checked_sub(1).and_then(omega).unwrap_or(here), omega(i + 1).unwrap_or(here));
            let (at, least) = golden_section(low, high, 60, |omega| -self.sensitivity(omega));
            let (at, peak) = if -least > value { (at, -least) } else { (here, value) };
            if peak > best.0 {
                best = (peak, at);
            }
        }
        (best.0.sqrt(), best.1)
    }

    /// All margins; see [`Margins`].
    pub(super) fn margins(&self, stable: bool, pole_radius: f64) -> Margins {
        let crossovers = self.crossovers();
        if !stable {
            return Margins::unstable(pole_radius, crossovers.last().copied().unwrap_or(0.0));
        }
        let (mut gain_down, mut gain_up) = (0.0_f64, f64::INFINITY);
        for (_, factor) in self.critical() {
            if factor < 1.0 { gain_down = gain_down.max(factor) } else { gain_up = gain_up.min(factor) }
        }
        let (peak_sensitivity, peak_sensitivity_at_rad_s) = self.peak_sensitivity();
        let loops = crossovers.into_iter().map(|omega| (omega, self.drive.transfer(omega)));
        Margins { gain_down, gain_up, peak_sensitivity, peak_sensitivity_at_rad_s, ..Margins::at(loops, pole_radius) }
    }

    /// See [`Bandwidth`].
    pub(super) fn bandwidth(&self, feedforward: Feedforward) -> Option<Bandwidth> {
        let omegas: Vec<f64> = self.points.iter().map(|(omega, _)| *omega).collect();
        Bandwidth::over(&omegas, |omega| self.drive.command_response(omega, feedforward).norm_sqr() < 0.5)
    }
}

/// The frequencies \[rad/s\].
fn frequencies(drive: &LinearDrive) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / drive.period_s();
    let mut low = nyquist * libm::pow(10.0, -DECADES);
    for [width, omega] in drive.features() {
        let size = libm::hypot(*width, *omega);
        if size > 1e-12 * nyquist {
            low = low.min(0.01 * size);
        }
    }
    let steps = whole(A_DECADE * libm::log10(nyquist / low));
    let share = |step: u32| f64::from(step) / f64::from(steps);
    let mut all: Vec<f64> = (0..steps).map(|step| low * libm::pow(nyquist / low, share(step))).collect();
    all.extend((1..EVEN).map(|k| nyquist * f64::from(k) / f64::from(EVEN)));
    for [width, omega] in drive.features() {
        // One without damping has a width of rounding.
        let width = width.max(1e-9 * omega);
        all.extend(AROUND.iter().flat_map(|times| [omega - times * width, omega + times * width]));
    }
    all.retain(|omega| *omega >= low && *omega < nyquist * (1.0 - 1e-12));
    all.push(nyquist);
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

/// At least one step, and not too many.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded from both sides
fn whole(steps: f64) -> u32 {
    steps.ceil().clamp(1.0, 10_000.0) as u32
}
