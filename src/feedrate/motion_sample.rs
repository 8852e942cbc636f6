//! What a motion does at one time, and at most.

/// Motion along the path at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionSample {
    /// Distance covered `s` \[mm\].
    pub s_mm: f64,
    /// Feedrate `V = ds/dt` \[mm/s\].
    pub feed_mm_s: f64,
    /// Acceleration `a = dV/dt` \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Jerk `j = da/dt` \[mm/s³\].
    pub jerk_mm_s3: f64,
}

/// Largest magnitudes during a phase or a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionPeaks {
    /// Feedrate \[mm/s\].
    pub feed_mm_s: f64,
    /// Acceleration \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Jerk \[mm/s³\]; infinite where the acceleration jumps.
    pub jerk_mm_s3: f64,
}
