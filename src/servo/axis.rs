//! One axis under control, sample by sample: the hot loop.

use super::lane::Lane;
use super::parameters::{AxisParameters, Derivative, LoopSettings};

/// All signals of one axis at one sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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

/// The sampled loop of one axis (or of a batch of them, one a lane).
///
/// The plant is advanced by its exact zero-order-hold solution:
/// `a = exp(-Δt/τ)`, `θ += K u Δt + (ω - K u) τ (1 - a)`, `ω = K u + (ω - K u) a`.
///
/// What limits the speed of such a loop is the chain of operations from one sample's state to the next. The control
/// law is therefore collected by what it acts on (command, angle, velocity, integral), so that only three operations lie between the
/// state and the clamp; the order of the samples is that of the specification.
#[derive(Debug, Clone, Copy)]
pub struct AxisLoop<L: Lane = f64> {
    // Velocity command: ω_com = kpp x + kpf ẋ - ω_com_theta θ, with x counted from the start.
    kpp: L,
    kpf: L,
    omega_com_theta: L,
    // Voltage before the clamp: u_omega_com (kpp x + kpf ẋ) + u_integral I - (u_theta θ + u_omega ω).
    u_omega_com: L,
    u_integral: L,
    u_theta: L,
    u_omega: L,
    u_max: L,
    torque: L,
    // Plant, exact over one period: θ += θ_ω ω + θ_u u, ω = ω_ω ω + ω_u u.
    r_g: L,
    theta_omega: L,
    theta_u: L,
    omega_omega: L,
    omega_u: L,
    // Sampling.
    period: L,
    rate: L,
    derivative: Derivative,
    delay: bool,
    // State. The command is counted from the start, so that an offset of the whole path changes no rounding in the loop.
    start: L,
    theta: L,
    omega: L,
    integral: L,
    last_command: L,
    last_voltage: L,
}

impl<L: Lane> AxisLoop<L> {
    /// The loop of one axis, or of several side by side: `lanes(i)` gives the parameters of lane `i`, and `pack` packs one
    /// number a lane.
    fn assemble(pack: impl Fn(&dyn Fn(&AxisParameters) -> f64) -> L, settings: &LoopSettings, start_mm: f64) -> Self {
        let dt = settings.period_s;
        // 1 - a, without cancellation when Δt is far below τ.
        let gap = |p: &AxisParameters| -libm::expm1(-dt / p.plant.time_constant_s);
        // From velocity error to voltage.
        let gain = |p: &AxisParameters| p.drive.torque_to_voltage_v_nm * p.pdff.kpv_nm_s_rad;
        Self {
            kpp: pack(&|p| p.pdff.kpp_rad_s_mm),
            kpf: pack(&|p| p.pdff.kpf_rad_mm),
            omega_com_theta: pack(&|p| p.pdff.kpp_rad_s_mm * p.drive.transmission_mm_rad),
            u_omega_com: pack(&|p| gain(p) * p.pdff.kvf),
            u_integral: pack(&|p| gain(p) * p.pdff.kiv_1_s),
            u_theta: pack(&|p| gain(p) * p.pdff.kvf * p.pdff.kpp_rad_s_mm * p.drive.transmission_mm_rad),
            u_omega: pack(&gain),
            u_max: pack(&|p| p.drive.voltage_limit_v),
            torque: pack(&|p| 1.0 / p.drive.torque_to_voltage_v_nm),
            r_g: pack(&|p| p.drive.transmission_mm_rad),
            theta_omega: pack(&|p| p.plant.time_constant_s * gap(p)),
            theta_u: pack(&|p| p.plant.gain_rad_s_v * coasting_s(dt, p.plant.time_constant_s)),
            omega_omega: pack(&|p| 1.0 - gap(p)),
            omega_u: pack(&|p| p.plant.gain_rad_s_v * gap(p)),
            period: L::splat(dt),
            rate: L::splat(1.0 / dt),
            derivative: settings.derivative,
            delay: settings.one_sample_delay,
            start: L::splat(start_mm),
            theta: L::default(),
            omega: L::default(),
            integral: L::default(),
            last_command: L::splat(start_mm),
            last_voltage: L::default(),
        }
    }

    /// One control period: reads the position, computes the voltage, advances the plant.
    ///
    /// - `command_mm`: position command; `velocity_mm_s`: its velocity, used with [`Derivative::Exact`] only
    #[inline(always)]
    pub fn step(&mut self, command_mm: L, velocity_mm_s: L) -> AxisSignals<L> {
        let velocity = match self.derivative {
            Derivative::Backward => (command_mm - self.last_command) * self.rate,
            Derivative::Exact => velocity_mm_s,
        };
        self.last_command = command_mm;

        let demand = self.kpp * (command_mm - self.start) + self.kpf * velocity;
        let omega_com = demand - self.omega_com_theta * self.theta;
        let wanted = (self.u_omega_com * demand + self.u_integral * self.integral)
            - (self.u_theta * self.theta + self.u_omega * self.omega);
        let voltage = wanted.clamp_abs(self.u_max);

        // Conditional integration: the integral waits while it would drive a clamped voltage further out.
        let error = omega_com - self.omega;
        let saturated = wanted.ne(voltage);
        let outwards = L::and(saturated, (error * wanted).gt(L::default()));
        self.integral = self.integral + L::select(outwards, L::default(), self.period * error);

        let signals = AxisSignals {
            command_mm,
            actual_mm: self.start + self.r_g * self.theta,
            velocity_command_rad_s: omega_com,
            velocity_rad_s: self.omega,
            torque_nm: self.torque * wanted,
            voltage_v: voltage,
            saturated,
        };

        let applied = if self.delay { std::mem::replace(&mut self.last_voltage, voltage) } else { voltage };
        self.theta = (self.theta + self.theta_omega * self.omega) + self.theta_u * applied;
        self.omega = self.omega_omega * self.omega + self.omega_u * applied;
        signals
    }
}

/// `Δt - τ (1 - exp(-Δt/τ))` \[s\].
pub(crate) fn coasting_s(dt: f64, tau: f64) -> f64 {
    let x = dt / tau;
    if x < 1e-4 {
        // The difference would cancel; the next term of the series is below 1e-18.
        0.5 * dt * x * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
    } else {
        dt + tau * libm::expm1(-x)
    }
}

impl AxisLoop<f64> {
    /// An axis at rest on `start_mm`. Parameters are taken as they are; [`AxisParameters::check`] tells what is sensible.
    pub fn new(parameters: &AxisParameters, settings: &LoopSettings, start_mm: f64) -> Self {
        Self::assemble(|pick| pick(parameters), settings, start_mm)
    }
}

impl<const N: usize> AxisLoop<super::Lanes<N>> {
    /// `N` axes side by side, all at rest on `start_mm`: a batch of gain sets that follows one command.
    pub fn batch(parameters: &[AxisParameters; N], settings: &LoopSettings, start_mm: f64) -> Self {
        Self::assemble(|pick| super::Lanes(std::array::from_fn(|lane| pick(&parameters[lane]))), settings, start_mm)
    }
}
