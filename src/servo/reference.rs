//! What is asked of one axis at one sample, and what every axis can do with it.

use super::axis::{AxisLoop, AxisSignals};

/// The reference of one axis at one sample.
///
/// Where the position comes from a path, its derivatives are the path's own; an axis decides which of them it uses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxisReference {
    /// Position command \[mm\].
    pub position_mm: f64,
    /// Its velocity \[mm/s\].
    pub velocity_mm_s: f64,
    /// Its acceleration \[mm/s²\].
    pub acceleration_mm_s2: f64,
    /// Its jerk \[mm/s³\].
    pub jerk_mm_s3: f64,
    /// Torque at the motor that is added to the controller's \[N m\]. [`AxisLoop`] has no place for it.
    pub torque_nm: f64,
    /// Offset of the position command that the feedforward ignores: cross-coupled control \[mm\]. [`AxisLoop`] has no place
    /// for it.
    pub command_offset_mm: f64,
}

impl AxisReference {
    /// At rest at `position_mm`.
    pub fn at_rest(position_mm: f64) -> Self {
        Self { position_mm, ..Self::default() }
    }
}

/// An axis under control: takes one reference a control period.
pub trait Axis {
    /// One control period: measures, computes the voltage, advances the machine. The signals are those at the sample, before
    /// the machine moves on.
    fn step(&mut self, reference: &AxisReference) -> AxisSignals;
}

impl Axis for AxisLoop {
    #[inline(always)]
    fn step(&mut self, reference: &AxisReference) -> AxisSignals {
        AxisLoop::step(self, reference.position_mm, reference.velocity_mm_s)
    }
}
