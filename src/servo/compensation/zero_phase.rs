//! Zero-phase-error tracking: a prefilter that undoes the closed loop.

use crate::parameters::OutOfRange;
use nalgebra::{Complex, DMatrix, SMatrix, SVector};

use crate::servo::{AxisParameters, LoopSettings, coasting_s};

/// A sampled closed loop from position command to position, `H(z) = N(z)/D(z)`, coefficients from the highest power down.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// `N`, the first coefficient not zero.
    pub numerator: Vec<f64>,
    /// `D`, of a higher degree, the first coefficient not zero.
    pub denominator: Vec<f64>,
}

impl ClosedLoop {
    /// The loop of [`AxisLoop`](crate::servo::AxisLoop) away from its voltage limit, with the backward difference of the command (and
    /// the delay of one sample, where the settings have it).
    pub fn pdff(axis: &AxisParameters, settings: &LoopSettings) -> Self {
        const N: usize = 5;
        let AxisParameters { plant, drive, pdff } = axis;
        let (r_g, tau, dt) = (drive.transmission_mm_rad, plant.time_constant_s, settings.period_s);
        let gap = -libm::expm1(-dt / tau);
        let gain = drive.torque_to_voltage_v_nm * pdff.kpv_nm_s_rad;
        // States: x, ω, integral as voltage, last command, voltage of the last sample.
        let command_rate = pdff.kpp_rad_s_mm + pdff.kpf_rad_mm / dt;
        let velocity = SVector::<f64, N>::from([-pdff.kpp_rad_s_mm, 0.0, 0.0, -pdff.kpf_rad_mm / dt, 0.0]);
        let omega = SVector::<f64, N>::from([0.0, 1.0, 0.0, 0.0, 0.0]);
        let integral = SVector::<f64, N>::from([0.0, 0.0, 1.0, 0.0, 0.0]);
        let voltage = velocity * (gain * pdff.kvf) - omega * gain + integral;
        let voltage_c = gain * pdff.kvf * command_rate;
        let (applied, applied_c) = if settings.one_sample_delay {
            (SVector::<f64, N>::from([0.0, 0.0, 0.0, 0.0, 1.0]), 0.0)
        } else {
            (voltage, voltage_c)
        };
        let (x_u, omega_u) = (r_g * plant.gain_rad_s_v * coasting_s(dt, tau, gap), plant.gain_rad_s_v * gap);
        let ki = gain * pdff.kiv_1_s * dt;
        let x = SVector::<f64, N>::from([1.0, r_g * tau * gap, 0.0, 0.0, 0.0]) + applied * x_u;
        let mut a = SMatrix::<f64, N, N>::zeros();
        a.row_mut(0).copy_from(&x.transpose());
        a.row_mut(1).copy_from(&(omega * (1.0 - gap) + applied * omega_u).transpose());
        a.row_mut(2).copy_from(&(integral + (velocity - omega) * ki).transpose());
        a.row_mut(4).copy_from(&voltage.transpose());
        let b = SVector::<f64, N>::from([x_u * applied_c, omega_u * applied_c, ki * command_rate, 1.0, voltage_c]);
        // Faddeev and LeVerrier: characteristic polynomial and adjugate together.
        let mut m = SMatrix::<f64, N, N>::identity();
        let (mut numerator, mut denominator) = (vec![(m * b)[0]], vec![1.0]);
        for k in 1..=N {
            let am = a * m;
            let c = -am.trace() / k as f64;
            denominator.push(c);
            m = am + SMatrix::<f64, N, N>::identity() * c;
            if k < N {
                numerator.push((m * b)[0]);
            }
        }
        // A state that nothing uses is a pole and a zero at the origin.
        let largest = numerator.iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
        while numerator.len() > 1 && denominator.len() > 2 && numerator[0].abs() <= 1e-12 * largest {
            numerator.remove(0);
        }
        let small = |poly: &[f64]| poly.last().is_some_and(|c| c.abs() <= 1e-13 * largest.min(1.0));
        while numerator.len() > 1 && small(&numerator) && small(&denominator) {
            numerator.pop();
            denominator.pop();
        }
        Self { numerator, denominator }
    }

    /// `H(z)`.
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        value(&self.numerator, z) / value(&self.denominator, z)
    }
}

fn value(polynomial: &[f64], z: Complex<f64>) -> Complex<f64> {
    polynomial.iter().fold(Complex::new(0.0, 0.0), |sum, &c| sum * z + c)
}

/// Zeros farther out than this are not cancelled: the command would ring.
const CANCELLED: f64 = 0.9;

/// Zero-phase-error tracking control: the prefilter `F(z) = z⁻ᴸ D(z) N_u(z⁻¹) / (N_c(z) N_u(1)²)`, with `N = N_c N_u` and the zeros of `N_u`
/// outside of what can be cancelled. Filter and loop together have the phase of `z⁻ᴸ`, [`look_ahead`](Self::look_ahead) samples, and
/// nothing else at every frequency: give the axis the reference of `L` samples ahead, and it is on time.
///
/// Source: M. Tomizuka, "Zero phase error tracking algorithm for digital control", Journal of Dynamic Systems, Measurement, and Control
/// 109, 1987.
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroPhase {
    forward: Vec<f64>,
    back: Vec<f64>,
    look_ahead: usize,
    inputs: Vec<f64>,
    outputs: Vec<f64>,
}

impl ZeroPhase {
    /// The prefilter for a loop, at rest.
    ///
    /// # Errors
    /// A loop that is not one, or has a zero at `z = 1`.
    pub fn new(closed: &ClosedLoop) -> Result<Self, OutOfRange> {
        let (numerator, denominator) = (&closed.numerator, &closed.denominator);
        let error = |value, needed| OutOfRange::new("closed loop for zero-phase tracking", value, needed);
        if let Some(&wrong) = numerator.iter().chain(denominator).find(|c| !(c.abs() <= 1e15)) {
            return Err(error(wrong, "made of finite coefficients, at most 1e15"));
        }
        let (Some(&lead), Some(&first)) = (numerator.first(), denominator.first()) else {
            return Err(error(0.0, "two polynomials with coefficients"));
        };
        if lead == 0.0 || first == 0.0 || numerator.len() >= denominator.len() || denominator.len() > 16 {
            let needed =
                "of a higher degree (at most 15) in its denominator, with first coefficients that are not zero";
            return Err(error(lead.min(first), needed));
        }
        let (mut cancelled, mut kept) = (vec![Complex::new(lead, 0.0)], vec![Complex::new(1.0, 0.0)]);
        for zero in zeros(numerator) {
            multiply(if zero.norm() < CANCELLED { &mut cancelled } else { &mut kept }, zero);
        }
        let at_one: f64 = kept.iter().map(|c| c.re).sum();
        if !(at_one.abs() > 1e-9) {
            return Err(error(at_one, "without a zero at z = 1: it could not follow a position at all"));
        }
        // D(z) times the reversed N_u.
        let scale = 1.0 / (at_one * at_one * cancelled[0].re);
        let mut forward = vec![0.0; denominator.len() + kept.len() - 1];
        for (i, d) in denominator.iter().enumerate() {
            for (j, c) in kept.iter().rev().enumerate() {
                forward[i + j] += scale * d * c.re;
            }
        }
        let back: Vec<f64> = cancelled[1..].iter().map(|c| c.re / cancelled[0].re).collect();
        let look_ahead = denominator.len() - numerator.len() + kept.len() - 1;
        let (inputs, outputs) = (vec![0.0; forward.len()], vec![0.0; back.len()]);
        Ok(Self { forward, back, look_ahead, inputs, outputs })
    }

    /// By how many samples filter and loop are late together.
    pub fn look_ahead(&self) -> usize {
        self.look_ahead
    }

    /// The prefilter as `Σ f_i z⁻ⁱ / (1 + Σ b_i z⁻ⁱ⁻¹)`: `f` and `b`, both from 0.
    pub fn coefficients(&self) -> (&[f64], &[f64]) {
        (&self.forward, &self.back)
    }

    /// One sample of a command that began at zero.
    #[inline]
    pub fn step(&mut self, command: f64) -> f64 {
        self.inputs.rotate_right(1);
        if let Some(newest) = self.inputs.first_mut() {
            *newest = command;
        }
        let mut sum = 0.0;
        for (c, x) in self.forward.iter().zip(&self.inputs) {
            sum += c * x;
        }
        for (c, y) in self.back.iter().zip(&self.outputs) {
            sum -= c * y;
        }
        if !self.outputs.is_empty() {
            self.outputs.rotate_right(1);
            self.outputs[0] = sum;
        }
        sum
    }
}

/// Zeros of a polynomial, as the eigenvalues of its companion matrix.
fn zeros(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let n = polynomial.len() - 1;
    if n == 0 {
        return Vec::new();
    }
    let companion = DMatrix::from_fn(n, n, |row, column| {
        if row == 0 {
            -polynomial[column + 1] / polynomial[0]
        } else if row == column + 1 {
            1.0
        } else {
            0.0
        }
    });
    companion.complex_eigenvalues().iter().copied().collect()
}

/// `polynomial *= z - zero`.
fn multiply(polynomial: &mut Vec<Complex<f64>>, zero: Complex<f64>) {
    polynomial.push(Complex::new(0.0, 0.0));
    for i in (1..polynomial.len()).rev() {
        let before = polynomial[i - 1];
        polynomial[i] -= before * zero;
    }
}
