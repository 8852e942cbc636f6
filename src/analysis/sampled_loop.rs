//! The linear loop of one axis in closed form.

use nalgebra::{Complex, DMatrix};

use super::polynomial::{MOST_ROOTS, all_roots};
use crate::servo::{AxisParameters, Derivative, LoopSettings, coasting_s};

/// The sampled loop of one axis, linear, by its coefficients; see [the module](super) for the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledLoop {
    pub(super) period_s: f64,
    pub(super) delay: bool,
    pub(super) derivative: Derivative,
    /// `c = 1 - exp(-Δt/τ)`.
    pub(super) gap: f64,
    /// `P(δ)` by rising power.
    pub(super) angle: [f64; 2],
    /// `K c`.
    pub(super) speed: f64,
    /// Voltage per velocity error that acts directly, `G`, and the part of it that the command gets, `G kvf`.
    pub(super) gain: f64,
    pub(super) command_gain: f64,
    /// `Δt G kiv`.
    pub(super) integral: f64,
    pub(super) kpp: f64,
    pub(super) kpf: f64,
    pub(super) r_g: f64,
    /// `τ c`.
    theta_omega: f64,
    /// `N(δ)` by rising power; none is negative.
    pub(super) n: [f64; 3],
}

impl SampledLoop {
    /// The loop of an axis. Parameters are taken as they are; [`AxisParameters::check`] tells what is sensible.
    pub fn new(parameters: &AxisParameters, settings: &LoopSettings) -> Self {
        let (dt, plant, pdff) = (settings.period_s, &parameters.plant, &parameters.pdff);
        let gap = -libm::expm1(-dt / plant.time_constant_s);
        let speed = plant.gain_rad_s_v * gap;
        let gain = parameters.drive.torque_to_voltage_v_nm * pdff.kpv_nm_s_rad;
        let command_gain = gain * pdff.kvf;
        let integral = dt * (gain * pdff.kiv_1_s);
        let w = pdff.kpp_rad_s_mm * parameters.drive.transmission_mm_rad;
        // θ_ω ω_u + θ_u c = K c Δt: no difference is left.
        let angle = [speed * dt, plant.gain_rad_s_v * coasting_s(dt, plant.time_constant_s, gap)];
        let n = [
            integral * w * angle[0],
            command_gain * w * angle[0] + integral * (w * angle[1] + speed),
            command_gain * w * angle[1] + gain * speed,
        ];
        Self {
            period_s: dt,
            delay: settings.one_sample_delay,
            derivative: settings.derivative,
            gap,
            angle,
            speed,
            gain,
            command_gain,
            integral,
            kpp: pdff.kpp_rad_s_mm,
            kpf: pdff.kpf_rad_mm,
            r_g: parameters.drive.transmission_mm_rad,
            theta_omega: plant.time_constant_s * gap,
            n,
        }
    }

    /// Control period \[s\].
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The highest frequency that the samples know, `π/Δt` \[rad/s\].
    pub fn nyquist_rad_s(&self) -> f64 {
        std::f64::consts::PI / self.period_s
    }

    /// `δ = exp(jωΔt) - 1` at `omega_rad_s`, without cancellation.
    pub(super) fn delta(&self, omega_rad_s: f64) -> Complex<f64> {
        let half = 0.5 * omega_rad_s * self.period_s;
        let (sin, cos) = (libm::sin(half), libm::cos(half));
        Complex::new(-2.0 * sin * sin, 2.0 * sin * cos)
    }

    /// `N(δ)`.
    pub(super) fn numerator(&self, delta: Complex<f64>) -> Complex<f64> {
        (delta * self.n[2] + self.n[1]) * delta + self.n[0]
    }

    /// `δ² (δ + c)`, times `z` with one sample of delay.
    pub(super) fn denominator(&self, delta: Complex<f64>) -> Complex<f64> {
        let without = delta * delta * (delta + self.gap);
        if self.delay { without * (delta + 1.0) } else { without }
    }

    /// The loop transfer `L(exp(jωΔt))`, broken at the plant input, so that `-1` is the critical point.
    ///
    /// - `omega_rad_s`: in `(0, π/Δt]`; at 0 the loop gain is infinite (the result is not a finite number)
    pub fn transfer(&self, omega_rad_s: f64) -> Complex<f64> {
        let delta = self.delta(omega_rad_s);
        self.numerator(delta) / self.denominator(delta)
    }

    /// Whether the feedback takes part in the position at all: `kpp` and `kpv` not zero, and `kvf` or `kiv` neither.
    pub(super) fn holds_position(&self) -> bool {
        self.n[0] > 0.0 || (self.integral == 0.0 && self.n[1] > 0.0)
    }

    /// The closed loop's characteristic polynomial in `δ = z - 1` by rising power with the loop gain multiplied by `factor`,
    /// and its degree: 3, one more with a sample of delay, one less without an integral (`kpv kiv = 0`, the integral then
    /// reaches nothing).
    pub(super) fn characteristic(&self, factor: f64) -> ([f64; 5], usize) {
        let [n0, n1, n2] = self.n.map(|n| factor * n);
        let mut p =
            if self.delay { [n0, n1, self.gap + n2, 1.0 + self.gap, 1.0] } else { [n0, n1, self.gap + n2, 1.0, 0.0] };
        let mut degree = 3 + usize::from(self.delay);
        if self.integral == 0.0 {
            p.rotate_left(1);
            p[4] = 0.0;
            degree -= 1;
        }
        (p, degree)
    }

    /// The closed-loop poles less one, `z - 1`: small for slow poles, which `z` itself would round.
    pub(super) fn poles_delta(&self) -> ([Complex<f64>; MOST_ROOTS], usize) {
        let (p, degree) = self.characteristic(1.0);
        (all_roots(&p[..=degree]), degree)
    }

    /// The closed-loop poles in the z-plane: 3, one more with a sample of delay, one less without an integral
    /// (`kpv kiv = 0`).
    pub fn poles(&self) -> Vec<Complex<f64>> {
        let (poles, count) = self.poles_delta();
        poles[..count].iter().map(|delta| delta + 1.0).collect()
    }

    /// The largest magnitude of a closed-loop pole: below 1 the loop is stable.
    pub fn pole_radius(&self) -> f64 {
        let (poles, count) = self.poles_delta();
        // |1 + δ|² = 1 + (2 Re δ + |δ|²)
        let excess = poles[..count].iter().map(|d| 2.0 * d.re + d.norm_sqr()).fold(f64::NEG_INFINITY, f64::max);
        (1.0 + excess).max(0.0).sqrt()
    }

    /// The closed-loop matrix `A` of `x[k+1] = A x[k]` for a command at rest, `x = (θ, ω, I, u[k-1])`; without `I` where
    /// `kpv kiv = 0`, without `u[k-1]` where there is no delay.
    pub fn closed_loop_matrix(&self) -> DMatrix<f64> {
        let w = self.kpp * self.r_g;
        // One period of plant, integral and controller, written out state by state.
        let voltage = [-self.command_gain * w, -self.gain, self.integral / self.period_s, 0.0];
        let theta = [1.0, self.theta_omega, 0.0, 0.0];
        let omega = [0.0, 1.0 - self.gap, 0.0, 0.0];
        let integral = [-w * self.period_s, -self.period_s, 1.0, 0.0];
        let held = [0.0, 0.0, 0.0, 1.0];
        let applied = if self.delay { held } else { voltage };
        let driven = |row: [f64; 4], by: f64| -> [f64; 4] { std::array::from_fn(|i| row[i] + by * applied[i]) };
        let rows = [driven(theta, self.angle[1]), driven(omega, self.speed), integral, voltage];
        let mut kept = vec![0, 1];
        if self.integral != 0.0 {
            kept.push(2);
        }
        if self.delay {
            kept.push(3);
        }
        DMatrix::from_fn(kept.len(), kept.len(), |i, j| rows[kept[i]][kept[j]])
    }

    /// Whether all poles lie inside the unit circle with the loop gain multiplied by `factor`: Routh and Hurwitz after
    /// `δ = 2s/(1 - s)`.
    pub(super) fn is_stable_at(&self, factor: f64) -> bool {
        if !self.holds_position() {
            return false;
        }
        let (p, degree) = self.characteristic(factor);
        let [c0, c1, c2, c3, c4] = bilinear(&p, degree);
        match degree {
            2 => c0 > 0.0 && c1 > 0.0 && c2 > 0.0,
            3 => c0 > 0.0 && c1 > 0.0 && c2 > 0.0 && c3 > 0.0 && c2 * c1 > c3 * c0,
            _ => {
                let positive = c0 > 0.0 && c1 > 0.0 && c2 > 0.0 && c3 > 0.0 && c4 > 0.0;
                // c3 c2 c1 > c4 c1² + c3² c0, in terms of quotients that do not overflow.
                positive && c2 > c4 * (c1 / c3) + c3 * (c0 / c1)
            }
        }
    }
}

/// `(1 - s)ⁿ p(2s/(1 - s))` of a polynomial of degree `n ≤ 4`, by rising power.
pub(super) fn bilinear(p: &[f64; 5], degree: usize) -> [f64; 5] {
    let mut out = [0.0; 5];
    for i in (0..=degree).rev() {
        // p_i (2s)^i (1 - s)^(n - i)
        let mut term = [0.0; 5];
        term[i] = p[i] * [1.0, 2.0, 4.0, 8.0, 16.0][i];
        for _ in i..degree {
            for k in (1..=degree).rev() {
                term[k] -= term[k - 1];
            }
        }
        for (sum, t) in out.iter_mut().zip(term) {
            *sum += t;
        }
    }
    out
}
