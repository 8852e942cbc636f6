//! Effects of the detailed drive model: one parameter struct per effect, each off unless given.
//!
//! The plant `ω(s)/u(s) = K/(1 + τ s)` is the motion of a body, `J ω' + B ω = u/k_T` with `B = 1/(k_T K)` and `J = τ B`: every
//! torque and force here refers to it. Torques are at the motor shaft, positive where they push forward.

mod disturbance;
mod electronics;
mod encoder;
mod friction;
mod kind;
mod lookup_table;
mod normal;
mod screw;

use super::{AxisParameters, Drive, LoopSettings, Plant};
use crate::parameters::{Entry, OutOfRange, Parameter, Parameters, Range};
pub use disturbance::{CuttingForce, Harmonic, TorqueRipple};
pub use electronics::{CurrentLoop, Dac, Delay, Mismatch};
pub(in crate::servo) use encoder::Sensor;
pub use encoder::{Encoder, EncoderPlace, Noise, VelocityEstimate};
pub(in crate::servo) use friction::bell;
pub use friction::{Coulomb, Friction, LuGre};
pub use kind::EffectKind;
pub use lookup_table::LookupTable;
pub use screw::{Backlash, PitchError, TwoMass};

/// The effects of one axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Effects {
    /// Mismatch between the true plant and the one that the controller was tuned for.
    pub mismatch: Option<Mismatch>,
    /// How position and velocity are measured; none: exactly, at the motor.
    pub encoder: Option<Encoder>,
    /// Noise of the measurement.
    pub noise: Option<Noise>,
    /// Computation delay, in addition to the loop's own sample if it has one.
    pub delay: Option<Delay>,
    /// Resolution of the voltage.
    pub dac: Option<Dac>,
    /// Bandwidth of the current loop; none: the torque follows at once.
    pub current_loop: Option<CurrentLoop>,
    /// Flexible ballscrew; none: rigid.
    pub two_mass: Option<TwoMass>,
    /// Friction.
    pub friction: Option<Friction>,
    /// Backlash.
    pub backlash: Option<Backlash>,
    /// Pitch error.
    pub pitch: Option<PitchError>,
    /// Torque ripple.
    pub ripple: Option<TorqueRipple>,
    /// Cutting force.
    pub force: Option<CuttingForce>,
    /// How finely the motion is integrated.
    pub integration: Integration,
}

/// How finely the nonlinear parts of the machine are integrated; its linear parts are exact whatever it says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integration {
    /// Steps a control period, at least (events and errors make them shorter).
    pub substeps: u32,
    /// A step is halved while its error in friction, ripple and force may change the table's speed by more than this \[mm/s\].
    pub tolerance_mm_s: f64,
}

/// What to do about a value out of its range.
const INTEGRATION: &str = "leave the key out for its default: substeps = 1, tolerance_mm_s = 1e-5";

impl Parameters for Integration {
    const ABOUT: &'static str = "Step size of the integration of nonlinear effects; not an effect itself";
    const ENTRIES: &'static [Entry<Self>] = &[
        Entry {
            parameter: Parameter::new(
                "effects.integration.substeps",
                "",
                Range::whole(1, Integration::MOST_SUBSTEPS),
                "Least number of steps in a control period; a fast resonance, events and errors add more",
            )
            .or(1.0)
            .logarithmic(1.0, 64.0)
            .hint(INTEGRATION),
            get: |integration| Some(f64::from(integration.substeps)),
            set: |integration, value| {
                integration.substeps = electronics::whole(value);
                true
            },
        },
        Entry {
            parameter: Parameter::new(
                "effects.integration.tolerance_mm_s",
                "mm/s",
                Range::POSITIVE,
                "A step is halved while its error in friction, ripple and force may change the table's speed by more than this",
            )
            .or(1e-5)
            .logarithmic(1e-7, 1e-2)
            .hint(INTEGRATION),
            get: |integration| Some(integration.tolerance_mm_s),
            set: |integration, value| {
                integration.tolerance_mm_s = value;
                true
            },
        },
    ];
}

impl Default for Integration {
    /// One step, 1e-5 mm/s: twice as fine moves no position by 1 nm (`tests/servo/drive.rs`).
    fn default() -> Self {
        Self { substeps: 1, tolerance_mm_s: 1e-5 }
    }
}

impl Integration {
    /// Most steps a control period.
    pub const MOST_SUBSTEPS: u32 = 1024;

    /// Every parameter in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.check_ranges()
    }
}

impl Effects {
    /// The true plant, with the mismatch.
    pub fn plant(&self, plant: &Plant) -> Plant {
        self.mismatch.map_or(*plant, |mismatch| mismatch.plant(plant))
    }

    /// Inertia at the motor of what the guideway rubs: the table's, where it is a mass of its own, else the whole \[kg m²\].
    pub fn rubbing_kg_m2(&self, plant: &Plant, drive: &Drive) -> f64 {
        let table = self.two_mass.map(|two_mass| two_mass.table_inertia_kg_m2(drive));
        table.unwrap_or_else(|| self.plant(plant).inertia_kg_m2(drive))
    }

    /// Every parameter in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, axis: &AxisParameters, settings: &LoopSettings) -> Result<(), OutOfRange> {
        let (drive, period_s) = (&axis.drive, settings.period_s);
        self.mismatch.iter().try_for_each(Mismatch::check)?;
        let plant = self.plant(&axis.plant);
        self.encoder.iter().try_for_each(|encoder| encoder.check(period_s))?;
        self.noise.iter().try_for_each(Noise::check)?;
        self.delay.iter().try_for_each(Delay::check)?;
        self.dac.iter().try_for_each(Dac::check)?;
        self.current_loop.iter().try_for_each(CurrentLoop::check)?;
        self.two_mass.iter().try_for_each(|two_mass| two_mass.check(&plant, drive, period_s))?;
        self.friction.iter().try_for_each(|friction| friction.check(self.rubbing_kg_m2(&axis.plant, drive), drive))?;
        self.backlash.iter().try_for_each(Backlash::check)?;
        self.pitch.iter().try_for_each(PitchError::check)?;
        self.ripple.iter().try_for_each(TorqueRipple::check)?;
        self.force.iter().try_for_each(CuttingForce::check)?;
        self.integration.check()
    }

    /// Whether none is on: how finely nothing is integrated does not matter.
    pub fn are_off(&self) -> bool {
        !EffectKind::ALL.iter().any(|kind| self.has(*kind))
    }
}
