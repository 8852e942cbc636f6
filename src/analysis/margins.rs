//! How far a loop is from instability.

use nalgebra::Complex;

use super::polynomial::{Poly, Roots, positive_roots, product, wronskian};
use super::sampled_loop::{SampledLoop, bilinear};
use crate::servo::{AxisParameters, LoopSettings};

/// How far the loop of one axis is from instability. No figure is ever NaN; of an unstable loop they say that there is no
/// margin, see each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Whether every closed-loop pole lies inside the unit circle.
    pub stable: bool,
    /// Largest magnitude of a closed-loop pole.
    pub pole_radius: f64,
    /// The loop stays stable while its gain is multiplied by a factor in `(gain_down, gain_up)`: the lower end, 0 where any
    /// gain will do, above 0 where the loop is conditionally stable (too little gain destabilises it). 1 when unstable.
    pub gain_down: f64,
    /// The upper end, infinite where there is none. 1 when unstable.
    pub gain_up: f64,
    /// Smallest angle \[deg\] between `L` and -1, either way, over all crossovers `|L| = 1`. Infinite when there is no
    /// crossover, 0 when unstable.
    pub phase_margin_deg: f64,
    /// The crossover of that phase margin \[rad/s\]; of an unstable loop the highest one, 0 when there is none.
    pub crossover_rad_s: f64,
    /// Additional dead time in the loop that destabilises it \[s\]: smallest (phase above -180°)/ω over all crossovers.
    /// Infinite when there is no crossover, 0 when unstable.
    pub delay_margin_s: f64,
    /// Peak sensitivity `Ms`, the largest `|1/(1 + L)|`; infinite when unstable.
    pub peak_sensitivity: f64,
    /// Its frequency \[rad/s\]; 0 when unstable.
    pub peak_sensitivity_at_rad_s: f64,
}

impl Margins {
    /// Modulus margin `1/Ms`: the smallest distance of `L` to -1, 0 when unstable.
    pub fn modulus_margin(&self) -> f64 {
        1.0 / self.peak_sensitivity
    }

    /// Those of an unstable loop.
    pub(super) fn unstable(pole_radius: f64, crossover_rad_s: f64) -> Self {
        Self {
            stable: false,
            pole_radius,
            gain_down: 1.0,
            gain_up: 1.0,
            phase_margin_deg: 0.0,
            crossover_rad_s,
            delay_margin_s: 0.0,
            peak_sensitivity: f64::INFINITY,
            peak_sensitivity_at_rad_s: 0.0,
        }
    }

    /// Phase and delay margin of a stable loop from its crossovers, frequency and `L`; the gain may be anything yet.
    pub(super) fn at(crossovers: impl Iterator<Item = (f64, Complex<f64>)>, pole_radius: f64) -> Self {
        let (mut phase, mut crossover_rad_s, mut delay_margin_s) = (f64::INFINITY, 0.0, f64::INFINITY);
        for (omega, l) in crossovers {
            // The angle from -1 to L, counterclockwise: what a lag may still take away.
            let lead = libm::atan2(-l.im, -l.re);
            let lag = if lead > 0.0 { lead } else { lead + std::f64::consts::TAU };
            delay_margin_s = delay_margin_s.min(lag / omega);
            if lead.abs() < phase {
                (phase, crossover_rad_s) = (lead.abs(), omega);
            }
        }
        Self {
            stable: true,
            pole_radius,
            gain_down: 0.0,
            gain_up: f64::INFINITY,
            phase_margin_deg: phase.to_degrees(),
            crossover_rad_s,
            delay_margin_s,
            peak_sensitivity: 1.0,
            peak_sensitivity_at_rad_s: 0.0,
        }
    }

    /// Whether too little gain destabilises the loop (saturation is too little gain).
    pub fn is_conditionally_stable(&self) -> bool {
        self.stable && self.gain_down > 0.0
    }
}

/// The largest `|1/(1 + L)|` of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSensitivity {
    /// `Ms`.
    pub peak: f64,
    /// Its frequency \[rad/s\].
    pub at_rad_s: f64,
}

/// All margins of an axis. Takes microseconds and allocates nothing.
///
/// - `axis`, `settings`: sound ones ([`AxisParameters::check`], [`LoopSettings::check`])
pub fn margins(axis: &AxisParameters, settings: &LoopSettings) -> Margins {
    let sampled = SampledLoop::new(axis, settings);
    let circle = Circle::new(&sampled);
    let crossovers = circle.crossovers();
    let highest = crossovers.as_slice().last().map_or(0.0, |x| circle.omega(*x));
    let pole_radius = sampled.pole_radius();
    if !sampled.is_stable_at(1.0) {
        return Margins::unstable(pole_radius, highest);
    }
    let (mut gain_down, mut gain_up) = (0.0_f64, f64::INFINITY);
    circle.critical_factors(|_, factor| {
        if factor < 1.0 { gain_down = gain_down.max(factor) } else { gain_up = gain_up.min(factor) }
    });
    let loops = crossovers.as_slice().iter().map(|&x| (circle.omega(x), circle.transfer(x)));
    let PeakSensitivity { peak, at_rad_s } = circle.peak_sensitivity();
    Margins {
        gain_down,
        gain_up,
        peak_sensitivity: peak,
        peak_sensitivity_at_rad_s: at_rad_s,
        ..Margins::at(loops, pole_radius)
    }
}

/// Peak sensitivity alone, `None` when the loop is unstable: the cheaper question of a search.
pub fn peak_sensitivity(axis: &AxisParameters, settings: &LoopSettings) -> Option<PeakSensitivity> {
    let sampled = SampledLoop::new(axis, settings);
    sampled.is_stable_at(1.0).then(|| Circle::new(&sampled).peak_sensitivity())
}

impl SampledLoop {
    /// The crossovers, frequencies where `|L| = 1` \[rad/s\], rising.
    pub fn crossovers_rad_s(&self) -> Vec<f64> {
        let circle = Circle::new(self);
        circle.crossovers().as_slice().iter().map(|x| circle.omega(*x)).collect()
    }

    /// The phase crossovers, where `L` is real and negative, up to `π/Δt`: frequency \[rad/s\], rising, and the factor on the
    /// loop gain that puts a pole there on the unit circle.
    pub fn phase_crossovers_rad_s(&self) -> Vec<(f64, f64)> {
        let circle = Circle::new(self);
        let mut found = Vec::new();
        circle.critical_factors(|x, factor| found.push((circle.omega(x), factor)));
        found
    }
}

/// Every interval of factors on the loop gain for which the loop is stable, rising; empty when no factor will do. Tells what
/// becomes of an unstable loop with less or more gain.
pub fn stable_gain_factors(sampled: &SampledLoop) -> Vec<(f64, f64)> {
    let mut critical = Vec::new();
    Circle::new(sampled).critical_factors(|_, factor| critical.push(factor));
    stable_between(critical, |factor| sampled.is_stable_at(factor))
}

/// The intervals between critical factors in which a loop is stable.
pub(super) fn stable_between(critical: Vec<f64>, stable_at: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let mut ends = critical;
    ends.push(0.0);
    ends.sort_by(f64::total_cmp);
    ends.push(f64::INFINITY);
    let mut intervals: Vec<(f64, f64)> = Vec::new();
    for pair in ends.windows(2) {
        let &[low, high] = pair else { continue };
        let inside = match (low > 0.0, high.is_finite()) {
            (true, true) => (low * high).sqrt(),
            (false, true) => 0.5 * high,
            (true, false) => 2.0 * low,
            (false, false) => 1.0,
        };
        if low < high && stable_at(inside) {
            intervals.push((low, high));
        }
    }
    intervals
}

/// The loop on the unit circle as functions of `x = v² = tan²(ωΔt/2)`.
struct Circle<'a> {
    sampled: &'a SampledLoop,
    /// `L = n(s)/d(s)` with `z = (1 + s)/(1 - s)`, `s = jv`, each as `even(x) + j v odd(x)`.
    n: (Poly, Poly),
    d: (Poly, Poly),
}

impl<'a> Circle<'a> {
    fn new(sampled: &'a SampledLoop) -> Self {
        let degree = 3 + usize::from(sampled.delay);
        let [n0, n1, n2] = sampled.n;
        let c = sampled.gap;
        let n = bilinear(&[n0, n1, n2, 0.0, 0.0], degree);
        // δ² (δ + c), and times z = 1 + δ: by hand, since every coefficient but these cancels.
        let (d2, d3) = (4.0 * c, 4.0 * (2.0 - c));
        let d = if sampled.delay { [0.0, 0.0, d2, d2 + d3, d3] } else { [0.0, 0.0, d2, d3, 0.0] };
        Self { sampled, n: split(&n), d: split(&d) }
    }

    fn omega(&self, x: f64) -> f64 {
        2.0 * libm::atan(x.sqrt()) / self.sampled.period_s
    }

    /// `δ` at `x`; at infinity `z = -1`.
    fn delta(x: f64) -> Complex<f64> {
        if x.is_infinite() {
            return Complex::new(-2.0, 0.0);
        }
        let scale = 2.0 / (1.0 + x);
        Complex::new(-x * scale, x.sqrt() * scale)
    }

    fn transfer(&self, x: f64) -> Complex<f64> {
        let delta = Self::delta(x);
        self.sampled.numerator(delta) / self.sampled.denominator(delta)
    }

    /// Where `|L| = 1`. A delay of whole samples turns `L` and moves no crossover.
    fn crossovers(&self) -> Roots {
        let (n, d) = (magnitude(&self.n), magnitude(&self.d));
        let mut difference = n;
        for (place, d) in difference.iter_mut().zip(d) {
            *place -= d;
        }
        positive_roots(&difference)
    }

    /// Every factor on the loop gain that puts a pole on the unit circle, `-1/L` wherever `L` is real and negative, with its
    /// place `x`.
    fn critical_factors(&self, mut found: impl FnMut(f64, f64)) {
        // Im(n conj(d))/v = n_odd d_even - n_even d_odd
        let mut imaginary = product(&self.n.1, &self.d.0);
        for (place, p) in imaginary.iter_mut().zip(product(&self.n.0, &self.d.1)) {
            *place -= p;
        }
        for x in positive_roots(&imaginary).as_slice().iter().copied().chain([f64::INFINITY]) {
            let real = self.transfer(x).re;
            let factor = -1.0 / real;
            if real < 0.0 && factor.is_finite() {
                found(x, factor);
            }
        }
    }

    /// The largest `|1/(1 + L)|` of a stable loop.
    fn peak_sensitivity(&self) -> PeakSensitivity {
        let mut sum = self.d;
        for (to, from) in [(&mut sum.0, &self.n.0), (&mut sum.1, &self.n.1)] {
            for (to, from) in to.iter_mut().zip(from) {
                *to += from;
            }
        }
        let stationary = positive_roots(&wronskian(&magnitude(&self.d), &magnitude(&sum)));
        let ends = [f64::INFINITY, 0.0];
        let places = stationary.as_slice().iter().copied().chain(ends);
        let best = places.fold((0.0, 0.0), |best, x| {
            let square = self.sensitivity_square(x);
            if square > best.0 { (square, x) } else { best }
        });
        PeakSensitivity { peak: best.0.sqrt(), at_rad_s: self.omega(best.1) }
    }

    /// `|1/(1 + L)|²`.
    fn sensitivity_square(&self, x: f64) -> f64 {
        let delta = Self::delta(x);
        let d = self.sampled.denominator(delta);
        d.norm_sqr() / (d + self.sampled.numerator(delta)).norm_sqr()
    }
}

/// `p(jv) = even(v²) + j v odd(v²)`.
fn split(p: &[f64; 5]) -> (Poly, Poly) {
    let (mut even, mut odd) = ([0.0; 10], [0.0; 10]);
    even[..3].copy_from_slice(&[p[0], -p[2], p[4]]);
    odd[..2].copy_from_slice(&[p[1], -p[3]]);
    (even, odd)
}

/// `even² + x odd²`.
fn magnitude((even, odd): &(Poly, Poly)) -> Poly {
    let mut out = product(even, even);
    let square = product(odd, odd);
    for (place, s) in out[1..].iter_mut().zip(square) {
        *place += s;
    }
    out
}
