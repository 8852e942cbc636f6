//! The loop of a detailed drive, where it is linear.

use crate::parameters::OutOfRange;
use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::eigen;
use super::response::Feedforward;
use crate::servo::compensation::{AccelerationFeedforward, Biquad, ClosedLoop, Filter, LowPass, Notch, ZeroPhase};
use crate::servo::effects::{EncoderPlace, VelocityEstimate};
use crate::servo::{AxisParameters, ControllerGains, Derivative, DriveModel, LinearMachine, LoopSettings};

/// The loop of a detailed drive, linear: what [`DetailedAxis`](crate::servo::DetailedAxis) does while nothing rubs, rattles, rounds or clamps.
///
/// Taken in are the plant as it is (mismatch), the delay, the current loop, both masses, viscous friction, place and velocity estimate of
/// the encoder, any controller, filters of the torque, feedforward of velocity and acceleration, and the zero-phase prefilter. The rest is
/// not linear, and left out: see [`Linearized`](super::Linearized).
///
/// With `z = 1 + δ`, the machine over one period `z' = z + D z + b₁ u[k-n-1] + b₂ u[k-n]` (exact; a delay of `n` samples and a part of
/// one), and the control law `u = k_T F (g_e (x_com - x̂) - g_ω ω̂ + …)`, the loop is broken at the voltage that the law computes:
///
/// ```text
/// L(z) = k_T F(z) (g_e x̂/u + g_ω ω̂/u)        x_act/x_com = x/u k_T F (g_e + g_v V + g_a s²)/(1 + L)
/// ```
///
/// Source: K. J. Åström, B. Wittenmark, "Computer-Controlled Systems", 3rd edition, sections 2.3 (sampling with a delay) and 3.3.
#[derive(Debug, Clone)]
pub(super) struct LinearDrive {
    period_s: f64,
    machine: LinearMachine,
    /// Whole samples of the delay, and whether there is a part of one beside them.
    late: usize,
    broken: bool,
    mm_rad: f64,
    volt_nm: f64,
    place: EncoderPlace,
    estimate: Estimate,
    law: Law,
    filters: Vec<([f64; 3], [f64; 2])>,
    /// Torque of the feedforwards per reference velocity \[N m s/mm\] and acceleration \[N m s²/mm\].
    torque: [f64; 2],
    derivative: Derivative,
    prefilter: Option<ZeroPhase>,
    /// Where something narrow may be on the frequency axis: `σ + jω` \[rad/s\], widths first.
    features: Vec<[f64; 2]>,
}

/// How the velocity is told.
#[derive(Debug, Clone, Copy)]
enum Estimate {
    Tachometer,
    /// Backward difference through a first-order low pass; 1: no low pass.
    Difference(f64),
    Observer {
        alpha: f64,
        beta: f64,
    },
}

/// The control law, in N m.
#[derive(Debug, Clone, Copy)]
enum Law {
    /// `T = kv (kvf ω_com - ω + ki Σ(ω_com - ω)) `, `ω_com = kp e + kf v`: `ki` per sample.
    Loops { kp: f64, kv: f64, ki: f64, kvf: f64, kf: f64 },
    /// `ki` per sample, `kd` per difference, share of the derivative's filter.
    Pid { kp: f64, ki: f64, kd: f64, share: f64 },
}

impl LinearDrive {
    /// The loop of an axis.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub(super) fn new(axis: &AxisParameters, drive: &DriveModel, settings: &LoopSettings) -> Result<Self, OutOfRange> {
        // It refuses what the axis itself refuses.
        drive.axis(axis, settings, 0.0)?;
        let (effects, compensation, period_s) = (&drive.effects, &drive.compensation, settings.period_s);
        let delay = effects.delay.map_or(0.0, |delay| delay.samples) + f64::from(u8::from(settings.one_sample_delay));
        let late = (0..=17_u8).rev().find(|&late| f64::from(late) <= delay).unwrap_or(0);
        let broken = delay - f64::from(late);
        let encoder = effects.encoder.unwrap_or_default();
        let observer = |bandwidth_hz: f64, damping: f64| {
            let w = TAU * bandwidth_hz * period_s;
            Estimate::Observer { alpha: 2.0 * damping * w, beta: w * w }
        };
        let pdff = &axis.pdff;
        let nm_volt = 1.0 / axis.drive.torque_to_voltage_v_nm;
        let mut torque = [0.0; 2];
        let law = match drive.controller {
            ControllerGains::Pdff => Law::Loops {
                kp: pdff.kpp_rad_s_mm,
                kv: pdff.kpv_nm_s_rad,
                ki: pdff.kiv_1_s * period_s,
                kvf: pdff.kvf,
                kf: pdff.kpf_rad_mm,
            },
            ControllerGains::PPi(gains) => Law::Loops {
                kp: gains.position_rad_s_mm,
                kv: gains.velocity_nm_s_rad,
                ki: gains.integral_1_s * period_s,
                kvf: 1.0,
                kf: 0.0,
            },
            ControllerGains::Cascade(gains) => {
                torque = [gains.viscous_nm_s_mm, gains.acceleration_nm_s2_mm];
                Law::Loops {
                    kp: gains.loops.position_rad_s_mm,
                    kv: gains.loops.velocity_nm_s_rad,
                    ki: gains.loops.integral_1_s * period_s,
                    kvf: 1.0,
                    kf: gains.velocity_rad_mm,
                }
            }
            ControllerGains::Pid(gains) => Law::Pid {
                kp: nm_volt * gains.proportional_v_mm,
                ki: nm_volt * gains.integral_v_mm_s * period_s,
                kd: nm_volt * gains.derivative_v_s_mm / period_s,
                share: -libm::expm1(-TAU * gains.filter_hz * period_s),
            },
        };
        if let Some(AccelerationFeedforward { share }) = compensation.acceleration {
            let share = share / axis.drive.transmission_mm_rad;
            torque[0] += share * axis.plant.viscous_nm_s_rad(&axis.drive);
            torque[1] += share * axis.plant.inertia_kg_m2(&axis.drive);
        }
        let filters: Result<Vec<_>, _> =
            compensation.filters.iter().map(|filter| Ok(Biquad::new(filter, period_s)?.coefficients())).collect();
        let mut linear = Self {
            period_s,
            machine: LinearMachine::new(axis, effects, period_s, broken),
            late: usize::from(late),
            broken: broken > 0.0,
            mm_rad: axis.drive.transmission_mm_rad,
            volt_nm: axis.drive.torque_to_voltage_v_nm,
            place: encoder.place,
            estimate: match encoder.velocity {
                VelocityEstimate::Tachometer => Estimate::Tachometer,
                VelocityEstimate::Difference => Estimate::Difference(1.0),
                VelocityEstimate::LowPass { corner_hz } => {
                    Estimate::Difference(-libm::expm1(-TAU * corner_hz * period_s))
                }
                VelocityEstimate::Observer { bandwidth_hz, damping } => observer(bandwidth_hz, damping),
            },
            law,
            filters: filters?,
            torque,
            derivative: settings.derivative,
            prefilter: drive.zero_phase.then(|| ZeroPhase::new(&ClosedLoop::pdff(axis, settings))).transpose()?,
            features: Vec::new(),
        };
        linear.features = linear.narrow(axis, drive);
        Ok(linear)
    }

    /// Places of resonances and their opposites, which a grid of frequencies must not step over.
    fn narrow(&self, axis: &AxisParameters, drive: &DriveModel) -> Vec<[f64; 2]> {
        let closed = eigen::eigenvalues(&self.closed_loop(1.0)).unwrap_or_default();
        let machine = eigen::eigenvalues(&self.machine.step).unwrap_or_default();
        let mut features: Vec<[f64; 2]> = closed
            .iter()
            .chain(&machine)
            .map(|delta| {
                let z = delta + 1.0;
                [0.5 * libm::log(z.norm_sqr()).abs() / self.period_s, libm::atan2(z.im, z.re).abs() / self.period_s]
            })
            .collect();
        for filter in &drive.compensation.filters {
            let (frequency_hz, damping, depth) = match *filter {
                Filter::Notch(Notch { frequency_hz, damping, depth }) => (frequency_hz, damping, depth),
                Filter::LowPass(LowPass { frequency_hz, damping }) => (frequency_hz, damping, 1.0),
            };
            let omega = TAU * frequency_hz;
            features.extend([[damping * omega, omega], [depth * damping * omega, omega]]);
        }
        if let Some(two_mass) = drive.effects.two_mass {
            // The table swings against a motor that stands still.
            let inertia = two_mass.table_inertia_kg_m2(&axis.drive);
            let rate = 0.5 * two_mass.damping_nm_s_rad(&axis.drive) / inertia;
            let square = two_mass.stiffness_nm_rad(&axis.drive) / inertia - rate * rate;
            features.push([rate, square.max(0.0).sqrt()]);
        }
        features.retain(|[width, omega]| width.is_finite() && omega.is_finite());
        features
    }

    pub(super) fn period_s(&self) -> f64 {
        self.period_s
    }

    pub(super) fn features(&self) -> &[[f64; 2]] {
        &self.features
    }

    /// The same without feedforward.
    pub(super) fn feedback_alone(&self) -> Self {
        let mut alone = Self { torque: [0.0; 2], prefilter: None, ..self.clone() };
        if let Law::Loops { kf, .. } = &mut alone.law {
            *kf = 0.0;
        }
        alone
    }

    /// Whether the feedback takes part in the position at all.
    pub(super) fn holds_position(&self) -> bool {
        match self.law {
            Law::Loops { kp, kv, ki, kvf, .. } => kp * kv > 0.0 && (kvf > 0.0 || ki > 0.0),
            Law::Pid { kp, ki, .. } => kp > 0.0 || ki > 0.0,
        }
    }

    /// What an integral adds at a frequency, per error and per rate of one.
    fn integral(rate: f64, delta: Complex<f64>) -> Complex<f64> {
        if rate == 0.0 { Complex::new(0.0, 0.0) } else { Complex::new(rate, 0.0) / delta }
    }

    /// `δ = exp(jωΔt) - 1` without cancellation.
    fn delta(&self, omega_rad_s: f64) -> Complex<f64> {
        let half = 0.5 * omega_rad_s * self.period_s;
        let (sin, cos) = (libm::sin(half), libm::cos(half));
        Complex::new(-2.0 * sin * sin, 2.0 * sin * cos)
    }

    /// What the encoder sees \[mm\], speed of the motor \[rad/s\] and place of the table \[mm\] per volt that the law computes.
    fn machine(&self, delta: Complex<f64>) -> Option<[Complex<f64>; 3]> {
        let back = (delta + 1.0).inv();
        let late = (0..self.late).fold(Complex::new(1.0, 0.0), |late, _| late * back);
        let n = self.machine.place + 1;
        let matrix = DMatrix::from_fn(n, n, |row, column| {
            let on = if row == column { delta } else { Complex::new(0.0, 0.0) };
            on - self.machine.step[(row, column)]
        });
        let mut state = DVector::from_fn(n, |row, _| {
            let before = if self.broken { back * self.machine.before[row] } else { Complex::new(0.0, 0.0) };
            late * (before + self.machine.after[row])
        });
        if !matrix.lu().solve_mut(&mut state) {
            return None;
        }
        let table = state[self.machine.place];
        let twist = self.machine.twist.map_or(Complex::new(0.0, 0.0), |twist| state[twist]);
        let motor = table + twist;
        let seen = if self.place == EncoderPlace::Motor { motor } else { table };
        Some([seen * self.mm_rad, state[self.machine.motor], table * self.mm_rad])
    }

    /// The velocity \[rad/s\] that the control is told.
    fn told(&self, delta: Complex<f64>, seen_mm: Complex<f64>, motor_rad_s: Complex<f64>) -> Complex<f64> {
        let z = delta + 1.0;
        let rate = seen_mm / (self.period_s * self.mm_rad);
        match self.estimate {
            Estimate::Tachometer => motor_rad_s,
            Estimate::Difference(share) => {
                // (1 - 1/z) share z/(δ + share)
                rate * delta * share / (delta + share)
            }
            Estimate::Observer { alpha, beta } => rate * delta * z * beta / (delta * delta + delta * alpha + z * beta),
        }
    }

    /// Filters of the torque and the factor to the voltage.
    fn filtered(&self, delta: Complex<f64>) -> Complex<f64> {
        let back = (delta + 1.0).inv();
        let all = Complex::new(self.volt_nm, 0.0);
        self.filters.iter().fold(all, |all, ([b0, b1, b2], [a1, a2])| {
            all * ((back * *b2 + *b1) * back + *b0) / ((back * *a2 + *a1) * back + 1.0)
        })
    }

    /// Torque per lag \[N m/mm\], velocity \[N m s/rad\] and reference velocity \[N m s/mm\].
    fn gains(&self, delta: Complex<f64>) -> [Complex<f64>; 3] {
        match self.law {
            Law::Loops { kp, kv, ki, kvf, kf } => {
                let integral = Self::integral(ki, delta);
                let command = (integral + kvf) * kv;
                [command * kp, (integral + 1.0) * kv, command * kf]
            }
            Law::Pid { kp, ki, kd, share } => {
                let derivative = delta * (kd * share) / (delta + share);
                [Self::integral(ki, delta) + derivative + kp, Complex::new(0.0, 0.0), Complex::new(0.0, 0.0)]
            }
        }
    }

    /// `L(exp(jωΔt))`; infinite at 0.
    pub(super) fn transfer(&self, omega_rad_s: f64) -> Complex<f64> {
        let delta = self.delta(omega_rad_s);
        let Some([seen, motor, _]) = self.machine(delta) else { return Complex::new(f64::INFINITY, 0.0) };
        let [lag, velocity, _] = self.gains(delta);
        self.filtered(delta) * (lag * seen + velocity * self.told(delta, seen, motor))
    }

    /// Command to table.
    pub(super) fn command_response(&self, omega_rad_s: f64, feedforward: Feedforward) -> Complex<f64> {
        let delta = self.delta(omega_rad_s);
        let nothing = Complex::new(0.0, 0.0);
        let Some([seen, motor, table]) = self.machine(delta) else { return Complex::new(1.0, 0.0) };
        let [lag, velocity, forward] = self.gains(delta);
        let filtered = self.filtered(delta);
        let open = filtered * (lag * seen + velocity * self.told(delta, seen, motor));
        let with = feedforward == Feedforward::With;
        let back = (delta + 1.0).inv();
        let (position, ahead) = self.prefilter.as_ref().filter(|_| with).map_or(
            (Complex::new(1.0, 0.0), Complex::new(1.0, 0.0)),
            |prefilter| {
                let ahead = (0..prefilter.look_ahead()).fold(Complex::new(1.0, 0.0), |ahead, _| ahead * (delta + 1.0));
                let (forward, feedback) = prefilter.coefficients();
                let at = |c: &[f64]| c.iter().rev().fold(nothing, |sum, &c| sum * back + c);
                (ahead * at(forward) / (at(feedback) * back + 1.0), ahead)
            },
        );
        let reference = if with {
            let exact = self.derivative == Derivative::Exact && self.prefilter.is_none();
            let rate = if exact { Complex::new(0.0, omega_rad_s) } else { position * (delta * back) / self.period_s };
            let acceleration = ahead * -(omega_rad_s * omega_rad_s);
            lag * position + (forward + self.torque[0]) * rate + acceleration * self.torque[1]
        } else {
            lag
        };
        table * filtered * reference / (open + 1.0)
    }

    /// How many states the loop has: machine, waiting voltages, encoder, controller, filters.
    fn sizes(&self) -> [usize; 5] {
        let encoder = match self.estimate {
            Estimate::Tachometer => 0,
            Estimate::Difference(1.0) => 1,
            Estimate::Difference(_) | Estimate::Observer { .. } => 2,
        };
        let controller = match self.law {
            Law::Loops { kv, ki, .. } => usize::from(kv * ki > 0.0),
            Law::Pid { ki, kd, .. } => usize::from(ki > 0.0) + 2 * usize::from(kd > 0.0),
        };
        let waiting = self.late + usize::from(self.broken);
        [self.machine.place + 1, waiting, encoder, controller, 2 * self.filters.len()]
    }

    /// How many states the loop has.
    pub(super) fn order(&self) -> usize {
        self.sizes().iter().sum()
    }

    /// One control period: what is added to the state.
    ///
    /// - `reference`: position \[mm\], velocity, acceleration; `factor`: on the loop gain
    fn advance(&self, state: &[f64], reference: [f64; 3], factor: f64, change: &mut [f64]) {
        let [machine, waiting, encoder, controller, _] = self.sizes();
        let (z, rest) = state.split_at(machine);
        let (voltages, rest) = rest.split_at(waiting);
        let (sensed, rest) = rest.split_at(encoder);
        let (law, filters) = rest.split_at(controller);
        let (to_machine, to) = change.split_at_mut(machine);
        let (to_voltages, to) = to.split_at_mut(waiting);
        let (to_sensed, to) = to.split_at_mut(encoder);
        let (to_law, to_filters) = to.split_at_mut(controller);

        // Measure.
        let table = z[self.machine.place];
        let motor = table + self.machine.twist.map_or(0.0, |twist| z[twist]);
        let seen = self.mm_rad * if self.place == EncoderPlace::Motor { motor } else { table };
        let to_rad_s = 1.0 / (self.period_s * self.mm_rad);
        let speed = match (self.estimate, sensed) {
            (Estimate::Difference(_), &[last]) => {
                to_sensed[0] = seen - last;
                to_rad_s * (seen - last)
            }
            (Estimate::Difference(share), &[last, estimate]) => {
                to_sensed[0] = seen - last;
                to_sensed[1] = share * (to_rad_s * (seen - last) - estimate);
                estimate + to_sensed[1]
            }
            // The second state is the way in one period.
            (Estimate::Observer { alpha, beta }, &[place, way]) => {
                let error = seen - (place + way);
                to_sensed[0] = way + alpha * error;
                to_sensed[1] = beta * error;
                to_rad_s * (way + to_sensed[1])
            }
            _ => z[self.machine.motor],
        };

        // Control.
        let lag = reference[0] - seen;
        let mut torque = self.torque[0] * reference[1] + self.torque[1] * reference[2];
        match self.law {
            Law::Loops { kp, kv, ki, kvf, kf } => {
                let command = kp * lag + kf * reference[1];
                torque += kv * (kvf * command - speed) + law.first().copied().unwrap_or(0.0);
                if let Some(integral) = to_law.first_mut() {
                    *integral = kv * ki * (command - speed);
                }
            }
            Law::Pid { kp, ki, kd, share } => {
                torque += kp * lag;
                let (integral, derivative) = to_law.split_at_mut(usize::from(ki > 0.0));
                if let (Some(to), Some(sum)) = (integral.first_mut(), law.first()) {
                    *to = ki * lag;
                    torque += sum;
                }
                if let ([to_last, to_rate], Some([last, rate])) = (derivative, law.last_chunk::<2>()) {
                    *to_last = lag - last;
                    *to_rate = share * (lag - last - rate);
                    torque += kd * (rate + *to_rate);
                }
            }
        }
        for (([b, a], state), to) in self
            .filters
            .iter()
            .map(|(b, a)| [&b[..], &a[..]])
            .zip(filters.chunks_exact(2))
            .zip(to_filters.chunks_exact_mut(2))
        {
            let out = b[0] * torque + state[0];
            to[0] = b[1] * torque - a[0] * out + state[1] - state[0];
            to[1] = b[2] * torque - a[1] * out - state[1];
            torque = out;
        }
        let voltage = factor * self.volt_nm * torque;

        // Move.
        let of = |late: usize| if late == 0 { voltage } else { voltages.get(late - 1).copied().unwrap_or(0.0) };
        let (before, after) = (if self.broken { of(self.late + 1) } else { 0.0 }, of(self.late));
        for (row, to) in to_machine.iter_mut().enumerate() {
            let moved: f64 = z.iter().enumerate().map(|(column, z)| self.machine.step[(row, column)] * z).sum();
            *to = moved + self.machine.before[row] * before + self.machine.after[row] * after;
        }
        for (late, to) in to_voltages.iter_mut().enumerate() {
            *to = of(late) - of(late + 1);
        }
    }

    /// `A - I` of the closed loop `x[k+1] = A x[k]`, the loop gain multiplied by a factor.
    pub(super) fn closed_loop(&self, factor: f64) -> DMatrix<f64> {
        let n = self.order();
        let mut matrix = DMatrix::zeros(n, n);
        let (mut unit, mut change) = (vec![0.0; n], vec![0.0; n]);
        for column in 0..n {
            unit.fill(0.0);
            unit[column] = 1.0;
            self.advance(&unit, [0.0; 3], factor, &mut change);
            matrix.column_mut(column).copy_from_slice(&change);
        }
        matrix
    }

    /// Poles less one, with the loop gain multiplied by a factor.
    pub(super) fn poles_delta(&self) -> Vec<Complex<f64>> {
        eigen::eigenvalues(&self.closed_loop(1.0)).unwrap_or_default()
    }

    /// The largest magnitude of a closed-loop pole.
    pub(super) fn pole_radius(&self, factor: f64) -> f64 {
        eigen::radius(&self.closed_loop(factor))
    }

    /// Whether all poles lie inside the unit circle with the loop gain multiplied by a factor.
    pub(super) fn is_stable_at(&self, factor: f64) -> bool {
        self.holds_position() && self.pole_radius(factor) < 1.0
    }

    /// The positions \[mm\] of a table whose command steps to 1 mm and stays there, until they are no numbers.
    pub(super) fn step(&self, samples: usize) -> Vec<f64> {
        let mut state = vec![0.0; self.order()];
        let mut change = state.clone();
        let mut actual = Vec::with_capacity(samples.min(1 << 16));
        let mut last = 0.0;
        let mut prefilter = self.prefilter.clone();
        for _ in 0..samples {
            let table = self.mm_rad * state[self.machine.place];
            if !table.is_finite() {
                break;
            }
            actual.push(table);
            let position = prefilter.as_mut().map_or(1.0, |prefilter| prefilter.step(1.0));
            let backward = self.derivative == Derivative::Backward || prefilter.is_some();
            let velocity = if backward { (position - last) / self.period_s } else { 0.0 };
            last = position;
            self.advance(&state, [position, velocity, 0.0], 1.0, &mut change);
            for (state, change) in state.iter_mut().zip(&change) {
                *state += change;
            }
        }
        actual
    }

    /// Steady errors of a ramp and a parabola \[s, s²\], of a stable loop: with `x[k] = p k² + q k + s` in
    /// `x[k+1] - x[k] = M x[k] + B r[k]`, power by power.
    pub(super) fn errors(&self) -> Option<[f64; 2]> {
        let (n, dt) = (self.order(), self.period_s);
        let still = vec![0.0; n];
        let input = |reference: [f64; 3]| {
            let mut change = vec![0.0; n];
            self.advance(&still, reference, 1.0, &mut change);
            DVector::from_vec(change)
        };
        let (position, velocity, acceleration) =
            (input([1.0, 0.0, 0.0]), input([0.0, 1.0, 0.0]), input([0.0, 0.0, 1.0]));
        let matrix = self.closed_loop(1.0).lu();
        let solve = |right: DVector<f64>| matrix.solve(&right);
        let place = |state: &DVector<f64>| self.mm_rad * state[self.machine.place];
        // A ramp, x_com = kΔt.
        let p = solve(&position * -dt)?;
        let q = solve(&p - &velocity)?;
        let first = -place(&q);
        // A parabola, x_com = (kΔt)²/2; its backward difference is half a sample late.
        let half = if self.derivative == Derivative::Backward || self.prefilter.is_some() { -0.5 * dt } else { 0.0 };
        let p = solve(&position * (-0.5 * dt * dt))?;
        let q = solve(&p * 2.0 - &velocity * dt)?;
        let s = solve(p + q - &velocity * half - &acceleration)?;
        let second = -place(&s);
        let Some(prefilter) = &self.prefilter else { return Some([first, second]) };
        // The prefilter as 1 + m₁ s + m₂ s² of the same series.
        let (forward, back) = prefilter.coefficients();
        let moments = |coefficients: &mut dyn Iterator<Item = (f64, f64)>| {
            coefficients.fold([0.0; 3], |[a, b, c], (late, f)| {
                [a + f, b - f * late * dt, c + 0.5 * f * (late * dt) * (late * dt)]
            })
        };
        let ahead = prefilter.look_ahead() as f64;
        let above = moments(&mut forward.iter().enumerate().map(|(i, f)| (i as f64 - ahead, *f)));
        let below =
            moments(&mut [(0.0, 1.0)].into_iter().chain(back.iter().enumerate().map(|(i, b)| (i as f64 + 1.0, *b))));
        let gain = above[0] / below[0];
        let m1 = (above[1] - gain * below[1]) / below[0];
        let m2 = (above[2] - gain * below[2] - m1 * below[1]) / below[0];
        Some([first - m1, second + first * m1 - m2])
    }
}
