//! Compensation of effects: filters of the torque, feedforward, command corrections, prefilter, cross-coupled control.

mod biquad;
mod command_compensation;
mod cross_coupling;
mod zero_phase;

use crate::parameters::OutOfRange;
pub use biquad::{Biquad, Filter, LowPass, Notch};
pub(in crate::servo) use command_compensation::Compensator;
pub use command_compensation::{AccelerationFeedforward, BacklashCompensation, FrictionFeedforward, STANDSTILL_MM_S};
pub use cross_coupling::{CrossCoupling, CrossCouplingGains};
pub use zero_phase::{ClosedLoop, ZeroPhase};

use super::LoopSettings;
use super::effects::PitchError;

/// What can be added to an axis, for one axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Compensation {
    /// Filters of the torque, in this order; at most 8.
    pub filters: Vec<Filter>,
    /// Torque for the reference acceleration.
    pub acceleration: Option<AccelerationFeedforward>,
    /// Torque for the friction in the reference direction.
    pub friction: Option<FrictionFeedforward>,
    /// Offset of the command against backlash.
    pub backlash: Option<BacklashCompensation>,
    /// Offset of the command against the known pitch error; zero at the start of the axis.
    pub pitch: Option<PitchError>,
    /// Prefilter of the command.
    pub zero_phase: Option<ZeroPhase>,
}

impl Compensation {
    /// Every parameter in its range.
    ///
    /// # Errors
    /// Names the first one that is not.
    pub fn check(&self, settings: &LoopSettings) -> Result<(), OutOfRange> {
        if self.filters.len() > 8 {
            return Err(OutOfRange::new("number of filters", self.filters.len() as f64, "at most 8"));
        }
        self.filters.iter().try_for_each(|filter| filter.check(settings.period_s))?;
        self.acceleration.iter().try_for_each(AccelerationFeedforward::check)?;
        self.friction.iter().try_for_each(FrictionFeedforward::check)?;
        self.backlash.iter().try_for_each(BacklashCompensation::check)?;
        self.pitch.iter().try_for_each(PitchError::check)
    }
}
