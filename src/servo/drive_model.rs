//! The detailed drive model of an axis: controller, effects, compensation.

use super::compensation::{ClosedLoop, Compensation, ZeroPhase};
use super::controller::{AnyController, Cascade, CascadeGains, PPi, PPiGains, PdffController, Pid, PidGains};
use super::effects::Effects;
use super::{AxisParameters, DetailedAxis, LoopSettings, Pdff};
use crate::parameters::OutOfRange;

/// The controller of an axis, with its gains.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ControllerGains {
    /// Pseudo-derivative feedback with feedforward: the gains are those of [`AxisParameters`].
    #[default]
    Pdff,
    /// Position P, velocity PI.
    PPi(PPiGains),
    /// Position PID.
    Pid(PidGains),
    /// Position P, velocity PI, feedforward of velocity and acceleration.
    Cascade(CascadeGains),
}

/// A kind of controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ControllerKind {
    /// Pseudo-derivative feedback with feedforward.
    Pdff,
    /// Position P, velocity PI.
    PPi,
    /// Position PID.
    Pid,
    /// Position P, velocity PI, feedforward of velocity and acceleration.
    Cascade,
}

impl ControllerKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Pdff, Self::PPi, Self::Pid, Self::Cascade];

    /// The name on the command line: `pdff`, `p-pi`, `pid`, `cascade`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pdff => "pdff",
            Self::PPi => "p-pi",
            Self::Pid => "pid",
            Self::Cascade => "cascade",
        }
    }
}

impl ControllerGains {
    /// Its kind.
    pub fn kind(&self) -> ControllerKind {
        match self {
            Self::Pdff => ControllerKind::Pdff,
            Self::PPi(_) => ControllerKind::PPi,
            Self::Pid(_) => ControllerKind::Pid,
            Self::Cascade(_) => ControllerKind::Cascade,
        }
    }

    /// Gains of another controller with the same loops as the axis' PDFF controller: `kp = kpp`, `kv = kpv`, `ki = kiv`.
    ///
    /// A cascade gets all the feedforward that the plant's model asks for. A PID controller equals these two loops for
    /// a constant command, its derivative filtered at a quarter of the sampling rate:
    ///
    /// ```text
    /// T = kv (kp e - ω) + kv ki ∫(kp e - ω)   with ω = -e'/r_g:
    /// Kp = k_T kv (kp + ki/r_g)    Ki = k_T kv ki kp    Kd = k_T kv/r_g
    /// ```
    pub fn like(kind: ControllerKind, axis: &AxisParameters, settings: &LoopSettings) -> Self {
        let AxisParameters { drive, pdff, .. } = axis;
        let loops = PPiGains {
            position_rad_s_mm: pdff.kpp_rad_s_mm,
            velocity_nm_s_rad: pdff.kpv_nm_s_rad,
            integral_1_s: pdff.kiv_1_s,
        };
        match kind {
            ControllerKind::Pdff => Self::Pdff,
            ControllerKind::PPi => Self::PPi(loops),
            ControllerKind::Cascade => Self::Cascade(CascadeGains::with_feedforward(loops, axis)),
            ControllerKind::Pid => {
                let (volt, r_g) = (drive.torque_to_voltage_v_nm * pdff.kpv_nm_s_rad, drive.transmission_mm_rad);
                Self::Pid(PidGains {
                    proportional_v_mm: volt * (pdff.kpp_rad_s_mm + pdff.kiv_1_s / r_g),
                    integral_v_mm_s: volt * pdff.kiv_1_s * pdff.kpp_rad_s_mm,
                    derivative_v_s_mm: volt / r_g,
                    filter_hz: 0.25 / settings.period_s,
                })
            }
        }
    }
}

impl ControllerGains {
    /// Gains of the PDFF controller with the same loops, the other way round of [`like`](Self::like): those of a P-PI cascade are
    /// `kpp = kp`, `kpv = kv`, `kiv = ki`, `kpf = kf` (0 without feedforward) and `kvf = 1`.
    ///
    /// The loops of a PID controller are those of the larger `kp` that solves its equations, `kp² - (Kp/K_v) kp + Ki/(K_v r_g) = 0` with
    /// `K_v = k_T kv = Kd r_g`; without a real one, of its real part. Without a derivative there is no velocity loop, and all gains are 0.
    pub fn like_pdff(&self, axis: &AxisParameters) -> Pdff {
        let of_loops = |loops: &PPiGains, kpf_rad_mm| Pdff {
            kpp_rad_s_mm: loops.position_rad_s_mm,
            kpv_nm_s_rad: loops.velocity_nm_s_rad,
            kiv_1_s: loops.integral_1_s,
            kpf_rad_mm,
            kvf: 1.0,
        };
        match self {
            Self::Pdff => axis.pdff,
            Self::PPi(gains) => of_loops(gains, 0.0),
            Self::Cascade(gains) => of_loops(&gains.loops, gains.velocity_rad_mm),
            Self::Pid(gains) => {
                let r_g = axis.drive.transmission_mm_rad;
                let volt = gains.derivative_v_s_mm * r_g;
                if !(volt > 0.0) {
                    return Pdff { kpp_rad_s_mm: 0.0, kpv_nm_s_rad: 0.0, kiv_1_s: 0.0, kpf_rad_mm: 0.0, kvf: 1.0 };
                }
                let (sum, product) = (gains.proportional_v_mm / volt, gains.integral_v_mm_s / volt);
                let kp = 0.5 * (sum + (sum * sum - 4.0 * product / r_g).max(0.0).sqrt());
                let ki = if kp > 0.0 { product / kp } else { 0.0 };
                let kv = volt / axis.drive.torque_to_voltage_v_nm;
                of_loops(&PPiGains { position_rad_s_mm: kp, velocity_nm_s_rad: kv, integral_1_s: ki }, 0.0)
            }
        }
    }
}

/// The detailed drive model of an axis: its controller, the effects of its drive, and compensation.
///
/// [`AxisParameters`] stay what the controller's designer knows; with everything off the axis is [`AxisLoop`](super::AxisLoop), and is run
/// as such.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DriveModel {
    /// The controller.
    pub controller: ControllerGains,
    /// Effects of the drive.
    pub effects: Effects,
    /// Filters, feedforward and command corrections.
    pub compensation: Compensation,
    /// Zero-phase-error tracking: a prefilter made of the PDFF loop of the model.
    pub zero_phase: bool,
}

impl DriveModel {
    /// Whether the axis is what its model says. (How finely it is integrated does not count: the model is exact.)
    pub fn is_model(&self) -> bool {
        let Self { controller, effects, compensation, zero_phase } = self;
        effects.are_off()
            && !zero_phase
            && *controller == ControllerGains::Pdff
            && *compensation == Compensation::default()
    }

    /// The axis at rest on `start_mm`, and by how many samples it wants to know its references in advance.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn axis(
        &self,
        axis: &AxisParameters,
        settings: &LoopSettings,
        start_mm: f64,
    ) -> Result<(DetailedAxis, usize), OutOfRange> {
        let period_s = settings.period_s;
        let mut compensation = self.compensation.clone();
        let mut ahead = 0;
        if self.zero_phase {
            let prefilter = ZeroPhase::new(&ClosedLoop::pdff(axis, settings))?;
            ahead = prefilter.look_ahead();
            compensation.zero_phase = Some(prefilter);
        }
        axis.check()?;
        settings.check()?;
        let controller = match &self.controller {
            ControllerGains::Pdff => AnyController::Pdff(PdffController::new(&axis.pdff, period_s)),
            ControllerGains::PPi(gains) => AnyController::PPi(PPi::new(gains, period_s)?),
            ControllerGains::Pid(gains) => AnyController::Pid(Pid::new(gains, &axis.drive, period_s)?),
            ControllerGains::Cascade(gains) => AnyController::Cascade(Cascade::new(gains, period_s)?),
        };
        Ok((DetailedAxis::new(axis, controller, &self.effects, &compensation, settings, start_mm)?, ahead))
    }
}
