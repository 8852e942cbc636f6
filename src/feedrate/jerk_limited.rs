//! The acceleration half of a seven-phase jerk-limited motion.

use super::FeedrateError;
use super::motion_sample::MotionSample;
use super::parameters::{ACCEL, FEED, JERK, within};

/// From rest to a feed with bounded acceleration and jerk, in the shortest time: jerk `+j`, then constant acceleration,
/// then jerk `-j`. Where the feed is too low for the acceleration limit to be reached the middle part has no length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JerkLimitedPhase {
    feed_mm_s: f64,
    jerk_mm_s3: f64,
    /// Length of each jerk part \[s\].
    jerk_s: f64,
    /// Length of the part with constant acceleration \[s\].
    steady_s: f64,
}

impl JerkLimitedPhase {
    /// From rest to `feed_mm_s` within `accel_mm_s2` and `jerk_mm_s3`.
    ///
    /// # Errors
    /// Any of the three not between 1e-9 and 1e9.
    pub fn new(feed_mm_s: f64, accel_mm_s2: f64, jerk_mm_s3: f64) -> Result<Self, FeedrateError> {
        let feed = within(&FEED, feed_mm_s)?;
        let accel = within(&ACCEL, accel_mm_s2)?;
        let jerk = within(&JERK, jerk_mm_s3)?;
        Ok(Self::checked(feed, accel, jerk))
    }

    /// [`JerkLimitedPhase::new`] of values that are known to be in range.
    pub(super) fn checked(feed: f64, accel: f64, jerk: f64) -> Self {
        let jerk_s = (accel / jerk).min((feed / jerk).sqrt());
        let steady_s = (feed / (jerk * jerk_s) - jerk_s).max(0.0);
        Self { feed_mm_s: feed, jerk_mm_s3: jerk, jerk_s, steady_s }
    }

    /// The highest feed from which a motion of `length_mm` can still stop (reached in its middle), at most `feed_mm_s`.
    pub(super) fn highest_feed_mm_s(length_mm: f64, feed_mm_s: f64, accel: f64, jerk: f64) -> f64 {
        // Acceleration and deceleration cover V T(V) together, T = V/a + a/j or, below V = a²/j, 2 √(V/j).
        let threshold = accel * accel / jerk;
        let without_steady = libm::cbrt(0.25 * length_mm * length_mm * jerk);
        let highest = if without_steady <= threshold {
            without_steady
        } else {
            // V²/a + V a/j = L, in the form that does not cancel.
            let b = accel / jerk;
            2.0 * length_mm / (b + (b * b + 4.0 * length_mm / accel).sqrt())
        };
        highest.min(feed_mm_s)
    }

    /// Length of the phase \[s\].
    pub fn duration_s(&self) -> f64 {
        2.0 * self.jerk_s + self.steady_s
    }

    /// Where the jerk jumps within the phase \[s\].
    pub(super) fn knots_s(&self) -> [f64; 2] {
        [self.jerk_s, self.jerk_s + self.steady_s]
    }

    /// Distance covered in the whole phase: `V_f T/2` \[mm\].
    pub fn distance_mm(&self) -> f64 {
        0.5 * self.feed_mm_s * self.duration_s()
    }

    /// Motion `t_s` after the phase began (clamped to the phase).
    pub fn at(&self, t_s: f64) -> MotionSample {
        let (j, tj) = (self.jerk_mm_s3, self.jerk_s);
        let duration = self.duration_s();
        let t = t_s.clamp(0.0, duration);
        if t < tj {
            return MotionSample {
                s_mm: j * t * t * t / 6.0,
                feed_mm_s: 0.5 * j * t * t,
                accel_mm_s2: j * t,
                jerk_mm_s3: j,
            };
        }
        let accel = j * tj;
        if t <= tj + self.steady_s {
            let u = t - tj;
            let v = 0.5 * accel * tj;
            return MotionSample {
                s_mm: v * tj / 3.0 + u * (v + 0.5 * accel * u),
                feed_mm_s: v + accel * u,
                accel_mm_s2: accel,
                jerk_mm_s3: 0.0,
            };
        }
        // The last part mirrors the first one: V(T-t) = V_f - V(t).
        let u = duration - t;
        MotionSample {
            s_mm: self.distance_mm() - (self.feed_mm_s * u - j * u * u * u / 6.0),
            feed_mm_s: self.feed_mm_s - 0.5 * j * u * u,
            accel_mm_s2: j * u,
            jerk_mm_s3: -j,
        }
    }
}
