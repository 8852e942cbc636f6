//! What a program is run on.

use super::ProgramError;
use crate::parameters::{Parameter, Parameters, Range, parameters};
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

/// Range of the machine's limits.
const LIMIT: Range = Range::closed(1e-6, 1e9);

/// Limit of the acceleration along the path.
const ACCEL: Parameter =
    Parameter::new("machine.accel_mm_s2", "mm/s²", LIMIT, "Largest acceleration along the path and across it")
        .logarithmic(100.0, 50_000.0)
        .hint("give the acceleration in mm/s², such as 2000");

parameters!(
    "Limits of the machine's motion",
    Machine {
        rapid_mm_s: Parameter::new("machine.rapid_mm_s", "mm/s", LIMIT, "Rapid feed")
            .logarithmic(10.0, 2000.0)
            .hint("give the rapid feed in mm/s, such as 200"),
        accel_mm_s2: ACCEL,
        jerk_mm_s3: Parameter::new(
            "machine.jerk_mm_s3",
            "mm/s³",
            LIMIT,
            "Largest jerk along the path, and across it at constant feed",
        )
        .logarithmic(1000.0, 5e6)
        .hint("give the jerk in mm/s³, such as 50000"),
        corner_velocity_step_mm_s: Parameter::new(
            "machine.corner_velocity_step_mm_s",
            "mm/s",
            Range::NOT_NEGATIVE,
            "Largest step of the velocity where two blocks meet at an angle; 0: the tool stops there",
        )
        .or(1.0)
        .linear(0.0, 20.0)
        .hint("give the step of the velocity in mm/s, such as 1"),
        junction_accel_step_mm_s2: Parameter::new(
            "machine.junction_accel_step_mm_s2",
            "mm/s²",
            LIMIT,
            "Largest step of the acceleration where the curvature jumps, such as from a line into its tangent arc",
        )
        .otherwise("the jerk limit times the control period")
        .logarithmic(1.0, 5000.0)
        .hint("give the step of the acceleration in mm/s², such as 50"),
    }
);

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
        self.check_ranges().map_err(ProgramError::Machine)?;
        let lateral = ACCEL.at("machine.lateral_accel_mm_s2");
        lateral.check(self.lateral_accel_mm_s2).map_err(ProgramError::Machine)?;
        Ok(())
    }
}
