//! The loop of one axis, model or detailed drive.

use crate::parameters::OutOfRange;
use nalgebra::Complex;

use super::grid::OnGrid;
use super::linear_drive::LinearDrive;
use super::linearized::Linearized;
use super::margins::{Margins, margins, stable_between, stable_gain_factors};
use super::response::{
    Bandwidth, ErrorConstants, Feedforward, StepResponse, UNSTABLE_SAMPLES, bandwidth, error_constants, metrics,
    samples_to_settle, step_response,
};
use super::sampled_loop::SampledLoop;
use crate::servo::{AxisParameters, DriveModel, LoopSettings, Pdff};

/// The linear loop of one axis: that of its model in closed form ([`SampledLoop`]), or, where the drive is more than its model, that of the
/// detailed drive, with every effect, controller and compensation that is linear. [`DriveLoop::linearized`] tells which those are.
///
/// Of a detailed drive, frequency responses are exact at every frequency (the machine's matrix exponential, the sampled control law), poles
/// are eigenvalues of the closed loop, and margins, peak sensitivity and bandwidth are found on a grid of 250 frequencies a decade, finer
/// around every pole, zero and filter, and refined to rounding.
///
/// ```
/// use servosim::{analysis::DriveLoop, scenario::Scenario, servo::effects::Delay};
///
/// let mut alpha = Scenario::builtin("alpha")?;
/// alpha.drives[0].effects.delay = Some(Delay { samples: 0.5 });
/// let x = DriveLoop::new(&alpha.axes[0], &alpha.drives[0], &alpha.settings)?;
/// // It takes half of the 0.98 ms that the model has to spare.
/// assert!(x.is_stable() && (x.margins().delay_margin_s - 0.493e-3).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DriveLoop {
    axis: AxisParameters,
    settings: LoopSettings,
    delay_samples: f64,
    linearized: Linearized,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone)]
pub(super) enum Kind {
    Model(SampledLoop),
    Drive(Box<LinearDrive>),
}

impl DriveLoop {
    /// The loop of an axis.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(axis: &AxisParameters, drive: &DriveModel, settings: &LoopSettings) -> Result<Self, OutOfRange> {
        let kind = if drive.is_model() {
            axis.check()?;
            settings.check()?;
            Kind::Model(SampledLoop::new(axis, settings))
        } else {
            Kind::Drive(Box::new(LinearDrive::new(axis, drive, settings)?))
        };
        let own = f64::from(u8::from(settings.one_sample_delay));
        Ok(Self {
            axis: *axis,
            settings: *settings,
            delay_samples: own + drive.effects.delay.map_or(0.0, |delay| delay.samples),
            linearized: Linearized::of(drive),
            kind,
        })
    }

    /// The loop of an axis' model; parameters are taken as they are.
    pub fn model(axis: &AxisParameters, settings: &LoopSettings) -> Self {
        Self {
            axis: *axis,
            settings: *settings,
            delay_samples: f64::from(u8::from(settings.one_sample_delay)),
            linearized: Linearized::of(&DriveModel::default()),
            kind: Kind::Model(SampledLoop::new(axis, settings)),
        }
    }

    /// The axis' model: its plant, its drive, and the gains of its PDFF controller, whichever it has.
    pub fn axis(&self) -> &AxisParameters {
        &self.axis
    }

    /// How it is sampled.
    pub fn settings(&self) -> &LoopSettings {
        &self.settings
    }

    /// Whole and broken samples from measuring to the voltage, all together.
    pub fn delay_samples(&self) -> f64 {
        self.delay_samples
    }

    /// What is taken in, and what is left out.
    pub fn linearized(&self) -> &Linearized {
        &self.linearized
    }

    /// The highest frequency that the samples know, `π/Δt` \[rad/s\].
    pub fn nyquist_rad_s(&self) -> f64 {
        std::f64::consts::PI / self.settings.period_s
    }

    /// The loop transfer `L(exp(jωΔt))`, broken at the voltage, so that `-1` is the critical point; infinite at 0.
    pub fn transfer(&self, omega_rad_s: f64) -> Complex<f64> {
        match &self.kind {
            Kind::Model(sampled) => sampled.transfer(omega_rad_s),
            Kind::Drive(drive) => drive.transfer(omega_rad_s),
        }
    }

    /// The closed loop from command to table, samples to samples.
    pub fn command_response(&self, omega_rad_s: f64, feedforward: Feedforward) -> Complex<f64> {
        match &self.kind {
            Kind::Model(sampled) => sampled.command_response(omega_rad_s, feedforward),
            Kind::Drive(drive) => drive.command_response(omega_rad_s, feedforward),
        }
    }

    /// The closed-loop poles in the z-plane. Every waiting voltage, state of an estimate and of a filter is one more. Empty where they
    /// cannot be computed.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        match &self.kind {
            Kind::Model(sampled) => sampled.poles(),
            Kind::Drive(drive) => drive.poles_delta().into_iter().map(|delta| delta + 1.0).collect(),
        }
    }

    /// The largest magnitude of a closed-loop pole: below 1 the loop is stable.
    pub fn pole_radius(&self) -> f64 {
        match &self.kind {
            Kind::Model(sampled) => sampled.pole_radius(),
            Kind::Drive(drive) => drive.pole_radius(1.0),
        }
    }

    /// Whether the feedback takes part in the position at all.
    pub fn holds_position(&self) -> bool {
        match &self.kind {
            Kind::Model(sampled) => sampled.holds_position(),
            Kind::Drive(drive) => drive.holds_position(),
        }
    }

    /// Whether every closed-loop pole lies inside the unit circle.
    pub fn is_stable(&self) -> bool {
        match &self.kind {
            Kind::Model(sampled) => sampled.is_stable_at(1.0),
            Kind::Drive(drive) => drive.is_stable_at(1.0),
        }
    }

    /// All margins.
    pub fn margins(&self) -> Margins {
        match &self.kind {
            Kind::Model(_) => margins(&self.axis, &self.settings),
            Kind::Drive(drive) => {
                let radius = drive.pole_radius(1.0);
                OnGrid::new(drive).margins(drive.holds_position() && radius < 1.0, radius)
            }
        }
    }

    /// The crossovers, where `|L| = 1` \[rad/s\], rising.
    pub fn crossovers_rad_s(&self) -> Vec<f64> {
        match &self.kind {
            Kind::Model(sampled) => sampled.crossovers_rad_s(),
            Kind::Drive(drive) => OnGrid::new(drive).crossovers(),
        }
    }

    /// The phase crossovers, as [`SampledLoop::phase_crossovers_rad_s`].
    pub fn phase_crossovers_rad_s(&self) -> Vec<(f64, f64)> {
        match &self.kind {
            Kind::Model(sampled) => sampled.phase_crossovers_rad_s(),
            Kind::Drive(drive) => OnGrid::new(drive).critical(),
        }
    }

    /// Every interval of factors on the loop gain for which the loop is stable, rising.
    pub fn stable_gain_factors(&self) -> Vec<(f64, f64)> {
        match &self.kind {
            Kind::Model(sampled) => stable_gain_factors(sampled),
            Kind::Drive(drive) => {
                let critical = OnGrid::new(drive).critical().into_iter().map(|(_, factor)| factor).collect();
                stable_between(critical, |factor| drive.is_stable_at(factor))
            }
        }
    }

    /// The bandwidth, as [`bandwidth`].
    pub fn bandwidth(&self, feedforward: Feedforward) -> Option<Bandwidth> {
        match &self.kind {
            Kind::Model(_) => bandwidth(&self.axis, &self.settings, feedforward),
            Kind::Drive(drive) => drive.is_stable_at(1.0).then(|| OnGrid::new(drive).bandwidth(feedforward)).flatten(),
        }
    }

    /// The step response, as [`step_response`].
    pub fn step_response(&self, feedforward: Feedforward) -> StepResponse {
        match &self.kind {
            Kind::Model(_) => step_response(&self.axis, &self.settings, feedforward),
            Kind::Drive(drive) => {
                let alone = (feedforward == Feedforward::Without).then(|| drive.feedback_alone());
                let drive = alone.as_ref().unwrap_or(drive);
                let stable = drive.is_stable_at(1.0);
                // However fast the poles: the step has to get through every state.
                let settle = || samples_to_settle(drive.pole_radius(1.0)).max(4 * drive.order());
                let actual = drive.step(if stable { settle() } else { UNSTABLE_SAMPLES });
                let period_s = self.settings.period_s;
                let metrics = if stable { metrics(&actual, period_s) } else { None };
                StepResponse { period_s, actual, metrics }
            }
        }
    }

    /// The steady errors behind a slowly changing command, as [`error_constants`].
    pub fn error_constants(&self) -> Option<ErrorConstants> {
        match &self.kind {
            Kind::Model(_) => error_constants(&self.axis, &self.settings),
            Kind::Drive(drive) => drive_errors(drive),
        }
    }

    /// Velocity gain `K_v` \[1/s\]: the speed of a ramp over its steady following error, of feedback alone. `None` where the loop is
    /// unstable, or where the error vanishes or grows.
    ///
    /// Source: Y. Altintas, "Manufacturing Automation", 2nd edition, section 5.6.
    pub fn velocity_gain_1_s(&self) -> Option<f64> {
        let errors = match &self.kind {
            Kind::Model(_) => {
                let pdff = Pdff { kpf_rad_mm: 0.0, ..self.axis.pdff };
                error_constants(&AxisParameters { pdff, ..self.axis }, &self.settings)
            }
            Kind::Drive(drive) => drive_errors(&drive.feedback_alone()),
        };
        errors.map(|errors| 1.0 / errors.velocity_s).filter(|gain| gain.is_finite() && *gain > 0.0)
    }
}

/// The steady errors of a detailed drive.
fn drive_errors(drive: &LinearDrive) -> Option<ErrorConstants> {
    let [velocity_s, acceleration_s2] = drive.is_stable_at(1.0).then(|| drive.errors()).flatten()?;
    let known = velocity_s.is_finite() && acceleration_s2.is_finite();
    known.then_some(ErrorConstants { velocity_s, acceleration_s2 })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Complex, DMatrix};
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::servo::compensation::{AccelerationFeedforward, Filter, LowPass, Notch};
    use crate::servo::controller::{CascadeGains, PPiGains};
    use crate::servo::effects::{
        Coulomb, CurrentLoop, Delay, Encoder, EncoderPlace, Friction, Mismatch, TwoMass, VelocityEstimate,
    };
    use crate::servo::{ControllerGains, ControllerKind, Derivative, Drive, Plant};

    /// A drive with any of the linear effects.
    fn random(rng: &mut Xoshiro256PlusPlus) -> (AxisParameters, DriveModel, LoopSettings) {
        let plant = Plant { gain_rad_s_v: rng.random_range(40.0..90.0), time_constant_s: rng.random_range(0.1..0.25) };
        let pdff = Pdff {
            kpp_rad_s_mm: rng.random_range(10.0..110.0),
            kpv_nm_s_rad: rng.random_range(0.1..1.5),
            kiv_1_s: rng.random_range(0.0..300.0),
            kpf_rad_mm: rng.random_range(0.0..0.8),
            kvf: rng.random_range(0.3..1.0),
        };
        let axis = AxisParameters { plant, drive: Drive::default(), pdff };
        let derivative = if rng.random_bool(0.5) { Derivative::Exact } else { Derivative::Backward };
        let settings = LoopSettings { derivative, one_sample_delay: rng.random_bool(0.3), ..LoopSettings::default() };
        let loops = PPiGains {
            position_rad_s_mm: pdff.kpp_rad_s_mm,
            velocity_nm_s_rad: pdff.kpv_nm_s_rad,
            integral_1_s: pdff.kiv_1_s,
        };
        let controller = match rng.random_range(0..4) {
            0 => ControllerGains::Pdff,
            1 => ControllerGains::PPi(loops),
            2 => ControllerGains::like(ControllerKind::Pid, &axis, &settings),
            _ => ControllerGains::Cascade(CascadeGains::with_feedforward(loops, &axis)),
        };
        let mut drive = DriveModel { controller, ..DriveModel::default() };
        let (effects, compensation) = (&mut drive.effects, &mut drive.compensation);
        effects.mismatch = Some(Mismatch { gain_factor: rng.random_range(0.8..1.2), time_constant_factor: 1.1 });
        if rng.random_bool(0.5) {
            effects.delay = Some(Delay { samples: [0.25, 0.5, 1.0, 1.75, 3.0][rng.random_range(0..5_usize)] });
        }
        if rng.random_bool(0.5) {
            effects.current_loop = Some(CurrentLoop { bandwidth_hz: rng.random_range(100.0..2000.0) });
        }
        if rng.random_bool(0.5) {
            let stiffness_n_um = rng.random_range(20.0..300.0);
            effects.two_mass = Some(TwoMass { table_mass_kg: 80.0, stiffness_n_um, damping_n_s_mm: 10.0 });
        }
        if rng.random_bool(0.3) {
            let curve = Coulomb { coulomb_nm: 0.1, static_nm: 0.1, stribeck_mm_s: 1.0, viscous_nm_s_rad: 0.01 };
            effects.friction = Some(Friction::Coulomb(curve));
        }
        let velocity = [
            VelocityEstimate::Tachometer,
            VelocityEstimate::Difference,
            VelocityEstimate::LowPass { corner_hz: 300.0 },
            VelocityEstimate::Observer { bandwidth_hz: 100.0, damping: 0.7 },
        ][rng.random_range(0..4_usize)];
        let place = if rng.random_bool(0.5) { EncoderPlace::Motor } else { EncoderPlace::Table };
        effects.encoder = Some(Encoder { place, resolution_um: 0.0, velocity });
        if rng.random_bool(0.4) {
            compensation.filters.push(Filter::Notch(Notch { frequency_hz: 120.0, depth: 0.1, damping: 0.3 }));
        }
        if rng.random_bool(0.4) {
            compensation.filters.push(Filter::LowPass(LowPass { frequency_hz: 350.0, damping: 0.7 }));
        }
        if rng.random_bool(0.3) {
            compensation.acceleration = Some(AccelerationFeedforward { share: 0.9 });
        }
        drive.zero_phase = rng.random_bool(0.2) && !matches!(drive.controller, ControllerGains::Cascade(_));
        (axis, drive, settings)
    }

    fn linear(of: &DriveLoop) -> &LinearDrive {
        match &of.kind {
            Kind::Drive(drive) => drive,
            Kind::Model(_) => panic!("a model"),
        }
    }

    #[test]
    fn validates_the_transfer_by_determinants() {
        // 1 + L = det(δI - M)/det(δI - M₀), M₀ the same with the loop cut: states against transfer functions.
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for case in 0..80 {
            let (axis, drive, settings) = random(&mut rng);
            let found = DriveLoop::new(&axis, &drive, &settings).unwrap();
            let drive = linear(&found);
            let [closed, open] = [drive.closed_loop(1.0), drive.closed_loop(0.0)];
            for _ in 0..4 {
                let omega = found.nyquist_rad_s() * libm::pow(10.0, rng.random_range(-2.0..0.0));
                let angle = omega * settings.period_s;
                let delta = Complex::new(libm::cos(angle) - 1.0, libm::sin(angle));
                let at = |m: &DMatrix<f64>| {
                    let n = m.nrows();
                    let on = |i, j| if i == j { delta } else { Complex::new(0.0, 0.0) };
                    DMatrix::from_fn(n, n, |i, j| on(i, j) - m[(i, j)]).determinant()
                };
                let (l, expected) = (found.transfer(omega) + 1.0, at(&closed) / at(&open));
                assert!((l - expected).norm() < 1e-8 * expected.norm(), "{case} {omega}: {l} {expected} {drive:?}");
            }
        }
    }

    #[test]
    fn validates_that_margins_are_where_stability_ends() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let mut stable = 0;
        for case in 0..24 {
            let (axis, drive, settings) = random(&mut rng);
            let found = DriveLoop::new(&axis, &drive, &settings).unwrap();
            let m = found.margins();
            assert_eq!(m.stable, found.is_stable(), "{case}");
            if !m.stable {
                continue;
            }
            stable += 1;
            let of = linear(&found);
            for (factor, inside) in [(m.gain_up, 1.0 - 1e-6), (m.gain_down, 1.0 + 1e-6)] {
                if factor > 0.0 && factor.is_finite() {
                    assert!(of.is_stable_at(factor * inside), "{case} {factor}");
                    assert!(!of.is_stable_at(factor * (2.0 - inside)), "{case} {factor}");
                }
            }
            // No factor in between is unstable.
            let (low, high) = (m.gain_down.max(1e-3), m.gain_up.min(1e3));
            for k in 1..30 {
                let factor = low * libm::pow(high / low, f64::from(k) / 30.0);
                assert!(of.is_stable_at(factor), "{case} {factor} of {low} to {high}");
            }
            // The same loop with that much more dead time, in whole and broken samples, is at its edge.
            let total = found.delay_samples() + m.delay_margin_s / settings.period_s;
            if total < 15.0 {
                let delayed = |samples: f64| {
                    let mut drive = drive.clone();
                    drive.effects.delay = Some(Delay { samples });
                    let settings = LoopSettings { one_sample_delay: false, ..settings };
                    DriveLoop::new(&axis, &drive, &settings).unwrap().is_stable()
                };
                // A delay of a part of a sample is no dead time to a hold: the two agree where there is little above crossover.
                let slack = if drive.effects.two_mass.is_some() { f64::INFINITY } else { 0.1 };
                assert!(slack.is_infinite() || delayed((total - slack).max(0.0)), "{case} {total} {m:?}");
                assert!(slack.is_infinite() || !delayed(total + slack), "{case} {total} {m:?}");
            }
            // Nowhere on a much finer grid is the sensitivity higher.
            for k in 0..1000 {
                let omega = found.nyquist_rad_s() * libm::pow(10.0, -4.0 * f64::from(k) / 1000.0);
                let s = 1.0 / (found.transfer(omega) + 1.0).norm();
                assert!(s <= m.peak_sensitivity * (1.0 + 1e-9), "{case} {omega}: {s} {m:?}");
            }
        }
        assert!(stable > 5, "{stable}");
    }

    #[test]
    fn validates_the_response_against_the_axis_itself() {
        use crate::servo::{Axis, AxisReference};
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut count = 0;
        while count < 12 {
            let (mut axis, mut drive, settings) = random(&mut rng);
            // The axis itself would stick, and clamp.
            drive.effects.friction = None;
            axis.drive.voltage_limit_v = 1e9;
            let found = DriveLoop::new(&axis, &drive, &settings).unwrap();
            let radius = found.pole_radius();
            if !(radius < 0.98) {
                continue;
            }
            count += 1;
            // A step, sample by sample.
            let (mut real, ahead) = drive.axis(&axis, &settings, 0.0).unwrap();
            let step = found.step_response(Feedforward::With);
            for expected in step.actual.iter().take(300) {
                let actual = real.step(&AxisReference::at_rest(1.0)).actual_mm;
                assert!((actual - expected).abs() < 1e-9, "{actual} {expected} {drive:?}");
            }
            // A ramp and a parabola.
            let errors = found.error_constants().unwrap();
            for (speed, acceleration) in [(30.0, 0.0), (0.0, 100.0)] {
                let (mut real, _) = drive.axis(&axis, &settings, 0.0).unwrap();
                let position = |t: f64| speed * t + 0.5 * acceleration * t * t;
                let mut last = 0.0;
                let (from, to) = (3000, 3001);
                for k in 0..to {
                    let t = f64::from(k) * settings.period_s;
                    let seen = t + ahead as f64 * settings.period_s;
                    let reference = AxisReference {
                        position_mm: position(seen),
                        velocity_mm_s: speed + acceleration * seen,
                        acceleration_mm_s2: acceleration,
                        ..AxisReference::default()
                    };
                    last = position(t) - real.step(&reference).actual_mm;
                }
                let t = f64::from(from) * settings.period_s;
                let expected = errors.velocity_s * (speed + acceleration * t) + errors.acceleration_s2 * acceleration;
                assert!((last - expected).abs() < 1e-7, "{last} {expected} {speed} {drive:?} {settings:?}");
            }
        }
    }
}
