//! What a program is run on.

use super::ProgramError;
use crate::parameters::OutOfRange;
use crate::servo::{AxisParameters, LoopSettings};
use crate::simulation::SimulationError;

/// A machine with three axes: X, Y and Z, each with its own plant and gains, and how fast a program may be run on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine {
    /// X, Y and Z.
    pub axes: [AxisParameters; 3],
    /// Sampling of the loop.
    pub settings: LoopSettings,
    /// Feed of rapid motion along its line \[mm/s\].
    pub rapid_mm_s: f64,
    /// Largest acceleration along the path \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Largest jerk along the path, and of the vector at constant feed, `v³ |dκ/ds|` \[mm/s³\]: curves are slowed down to it. While the feed
    /// changes in a curve, `3 v a κ` comes on top across the path.
    pub jerk_mm_s3: f64,
    /// Largest acceleration across the path, `v² κ` \[mm/s²\]: curves are slowed down to it.
    pub lateral_accel_mm_s2: f64,
    /// Largest jump of the velocity vector at a corner \[mm/s\]: with the angle `θ` between the tangents it is passed at
    /// `v ≤ step/(2 sin(θ/2))`. With 0 the tool stops at every corner.
    pub corner_velocity_step_mm_s: f64,
    /// Largest jump of the acceleration vector where the curvature jumps, such as from a line into its tangent arc \[mm/s²\]: with the
    /// difference `Δκ` of the curvature vectors it is passed at `v ≤ √(step/|Δκ|)`. `jerk_mm_s3 · period_s` keeps the jerk limit over
    /// one control period.
    pub junction_accel_step_mm_s2: f64,
}

impl Machine {
    /// Whether every parameter is in range.
    ///
    /// # Errors
    /// The first one that is not: limits between 1e-6 and 1e9 (the velocity step from 0).
    pub fn check(&self) -> Result<(), ProgramError> {
        self.settings.check().map_err(SimulationError::from)?;
        for axis in &self.axes {
            axis.check().map_err(SimulationError::from)?;
        }
        for (name, value) in [
            ("rapid_mm_s", self.rapid_mm_s),
            ("accel_mm_s2", self.accel_mm_s2),
            ("jerk_mm_s3", self.jerk_mm_s3),
            ("lateral_accel_mm_s2", self.lateral_accel_mm_s2),
            ("junction_accel_step_mm_s2", self.junction_accel_step_mm_s2),
        ] {
            if !(1e-6..=1e9).contains(&value) {
                return Err(ProgramError::Machine(OutOfRange::new(name, value, "between 1e-6 and 1e9")));
            }
        }
        let value = self.corner_velocity_step_mm_s;
        if !(0.0..=1e9).contains(&value) {
            return Err(ProgramError::Machine(OutOfRange::new(
                "corner_velocity_step_mm_s",
                value,
                "between 0 and 1e9",
            )));
        }
        Ok(())
    }
}
