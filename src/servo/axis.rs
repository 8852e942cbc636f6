//! One axis under control, sample by sample: the hot loop.

use pulp::Simd;

use super::parameters::{AxisParameters, Derivative, LoopSettings};
use super::pdff_law::PdffLaw;
use crate::lane::{Lane, Wide};

/// All signals of one axis at one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisSignals<L: Lane = f64> {
    /// Position command `x_com` \[mm\].
    pub command_mm: L,
    /// Actual position `x_act` \[mm\].
    pub actual_mm: L,
    /// Velocity command `ω_com` \[rad/s\].
    pub velocity_command_rad_s: L,
    /// Actual velocity `ω` \[rad/s\].
    pub velocity_rad_s: L,
    /// Torque command `T` \[N m\].
    pub torque_nm: L,
    /// Voltage `u` that this sample computed, clamped \[V\].
    pub voltage_v: L,
    /// Whether the clamp acted.
    pub saturated: L::Mask,
}

impl Default for AxisSignals {
    /// An axis at rest on 0 mm.
    fn default() -> Self {
        Self {
            command_mm: 0.0,
            actual_mm: 0.0,
            velocity_command_rad_s: 0.0,
            velocity_rad_s: 0.0,
            torque_nm: 0.0,
            voltage_v: 0.0,
            saturated: false,
        }
    }
}

/// The sampled loop of one axis (or of a batch of them, one a lane).
///
/// The plant is advanced by its exact zero-order-hold solution:
/// `a = exp(-Δt/τ)`, `θ += K u Δt + (ω - K u) τ (1 - a)`, `ω = K u + (ω - K u) a`.
///
/// The state is kept in the units that cost the fewest operations: the position in mm, the integral as the voltage that it
/// adds. Products that are added are fused ([`Lane::mul_add`]), on every machine alike.
#[derive(Debug, Clone, Copy)]
pub struct AxisLoop<L: Lane = f64> {
    // Its output is the voltage before the clamp.
    law: PdffLaw<L>,
    u_max: L,
    torque: L,
    // Plant, exact over one period: x += x_ω ω + x_u u, ω = ω_ω ω + ω_u u.
    x_omega: L,
    x_u: L,
    omega_omega: L,
    omega_u: L,
    // Sampling.
    rate: f64,
    derivative: Derivative,
    delay: bool,
    // State. Positions are counted from the start, so that an offset of the whole path changes no rounding in the loop.
    start: L,
    x: L,
    omega: L,
    last_command: L,
    last_voltage: L,
}

impl<L: Lane> AxisLoop<L> {
    /// The loop at rest on `start_mm`: `pack` packs one coefficient of every lane.
    fn assemble(pack: impl Fn(fn(&Coefficients) -> f64) -> L, settings: &LoopSettings, start_mm: f64) -> Self {
        let rest = pack(|_| 0.0);
        let start = rest.all(start_mm);
        Self {
            law: PdffLaw {
                kpp: pack(|c| c.kpp),
                kpf: pack(|c| c.kpf),
                forward: pack(|c| c.u_omega_com),
                feedback: pack(|c| c.u_omega),
                rate: pack(|c| c.u_integral),
                integral: rest,
            },
            u_max: pack(|c| c.u_max),
            torque: pack(|c| c.torque),
            x_omega: pack(|c| c.x_omega),
            x_u: pack(|c| c.x_u),
            omega_omega: pack(|c| c.omega_omega),
            omega_u: pack(|c| c.omega_u),
            rate: 1.0 / settings.period_s,
            derivative: settings.derivative,
            delay: settings.one_sample_delay,
            start,
            x: rest,
            omega: rest,
            last_command: start,
            last_voltage: rest,
        }
    }

    /// One control period: reads the position, computes the voltage, advances the plant.
    ///
    /// - `command_mm`: position command; `velocity_mm_s`: its velocity, used with [`Derivative::Exact`] only
    #[inline(always)]
    pub fn step(&mut self, command_mm: L, velocity_mm_s: L) -> AxisSignals<L> {
        let signals = self.control(command_mm, velocity_mm_s);
        self.advance(signals.voltage_v);
        signals
    }

    /// The first half of [`step`](Self::step): reads the position and computes the voltage.
    #[inline(always)]
    pub fn control(&mut self, command_mm: L, velocity_mm_s: L) -> AxisSignals<L> {
        let velocity = match self.derivative {
            Derivative::Backward => (command_mm - self.last_command) * command_mm.all(self.rate),
            Derivative::Exact => velocity_mm_s,
        };
        self.last_command = command_mm;
        let control = self.control_step(command_mm - self.start, velocity);
        AxisSignals {
            command_mm,
            actual_mm: self.start + self.x,
            velocity_command_rad_s: control.velocity_command,
            velocity_rad_s: self.omega,
            torque_nm: self.torque * control.unclamped,
            voltage_v: control.voltage,
            saturated: control.saturated,
        }
    }

    /// One control period without the signals, as batches run it: `command` counted from the start, `velocity` as the feedforward takes
    /// it. `DELAY` is that of the settings, known to the compiler.
    #[inline(always)]
    pub(crate) fn period<const DELAY: bool>(&mut self, command: L, velocity: L) -> ControlStep<L> {
        let control = self.control_step(command, velocity);
        self.advance_by::<DELAY>(control.voltage);
        control
    }

    /// The control law and the clamp.
    #[inline(always)]
    fn control_step(&mut self, command: L, velocity: L) -> ControlStep<L> {
        let following_error = command - self.x;
        let (velocity_command, unclamped) = self.law.output(following_error, velocity, self.omega);
        let voltage = unclamped.clamp_abs(self.u_max);
        self.law.integrate(velocity_command - self.omega, unclamped - voltage);
        let saturated = unclamped.ne(voltage);
        ControlStep { following_error, velocity_command, unclamped, voltage, saturated }
    }

    /// The second half of [`step`](Self::step): the plant over one period under `voltage_v` (one period later where the loop
    /// has a delay).
    #[inline(always)]
    pub fn advance(&mut self, voltage_v: L) {
        if self.delay {
            self.advance_by::<true>(voltage_v);
        } else {
            self.advance_by::<false>(voltage_v);
        }
    }

    #[inline(always)]
    fn advance_by<const DELAY: bool>(&mut self, voltage_v: L) {
        if DELAY {
            let before = self.last_voltage;
            self.last_voltage = voltage_v;
            self.plant(before);
        } else {
            self.plant(voltage_v);
        }
    }

    /// The plant over one period under the voltage that reaches it.
    #[inline(always)]
    fn plant(&mut self, applied: L) {
        self.x = self.x_u.mul_add(applied, self.x_omega.mul_add(self.omega, self.x));
        self.omega = self.omega_u.mul_add(applied, self.omega_omega * self.omega);
    }
}

/// The coefficients of one axis, as [`AxisLoop`] names them.
#[derive(Debug, Clone, Copy)]
struct Coefficients {
    kpp: f64,
    kpf: f64,
    u_omega_com: f64,
    u_integral: f64,
    u_omega: f64,
    u_max: f64,
    torque: f64,
    x_omega: f64,
    x_u: f64,
    omega_omega: f64,
    omega_u: f64,
}

impl Coefficients {
    fn new(parameters: &AxisParameters, period_s: f64) -> Self {
        let AxisParameters { plant, drive, pdff } = parameters;
        let (r_g, tau) = (drive.transmission_mm_rad, plant.time_constant_s);
        // 1 - a, without cancellation when Δt is far below τ.
        let gap = -libm::expm1(-period_s / tau);
        // From velocity error to voltage.
        let gain = drive.torque_to_voltage_v_nm * pdff.kpv_nm_s_rad;
        Self {
            kpp: pdff.kpp_rad_s_mm,
            kpf: pdff.kpf_rad_mm,
            u_omega_com: gain * pdff.kvf,
            u_integral: gain * pdff.kiv_1_s * period_s,
            u_omega: gain,
            u_max: drive.voltage_limit_v,
            torque: 1.0 / drive.torque_to_voltage_v_nm,
            x_omega: r_g * tau * gap,
            x_u: r_g * plant.gain_rad_s_v * coasting_s(period_s, tau, gap),
            omega_omega: 1.0 - gap,
            omega_u: plant.gain_rad_s_v * gap,
        }
    }
}

/// What the control law computes at one sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ControlStep<L: Lane> {
    /// Command minus actual position \[mm\].
    pub(crate) following_error: L,
    velocity_command: L,
    /// Voltage before the clamp \[V\].
    unclamped: L,
    pub(crate) voltage: L,
    pub(crate) saturated: L::Mask,
}

/// `Δt - τ (1 - exp(-Δt/τ))` \[s\], with `gap = 1 - exp(-Δt/τ)`.
pub(crate) fn coasting_s(dt: f64, tau: f64, gap: f64) -> f64 {
    let x = dt / tau;
    if x < 1e-4 {
        // The difference would cancel; the next term of the series is below 1e-18.
        0.5 * dt * x * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
    } else {
        dt - tau * gap
    }
}

impl AxisLoop<f64> {
    /// An axis at rest on `start_mm`. Parameters are taken as they are; [`AxisParameters::check`] tells what is sensible.
    pub fn new(parameters: &AxisParameters, settings: &LoopSettings, start_mm: f64) -> Self {
        let coefficients = Coefficients::new(parameters, settings.period_s);
        Self::assemble(|pick| pick(&coefficients), settings, start_mm)
    }
}

impl<S: Simd, const B: usize> AxisLoop<Wide<S, B>> {
    /// Axes side by side, all at rest on `start_mm`: a batch of parameters that follows one command. Where there are fewer
    /// parameters than lanes the last lanes stand still.
    pub(crate) fn batch<'p>(
        simd: S,
        parameters: impl Iterator<Item = &'p AxisParameters>,
        settings: &LoopSettings,
        start_mm: f64,
    ) -> Self {
        let lanes: Vec<_> = parameters.map(|axis| Coefficients::new(axis, settings.period_s)).collect();
        Self::assemble(|pick| Wide::pack(simd, lanes.iter().map(pick)), settings, start_mm)
    }
}
