//! Bernstein feedrate `V(τ) = Σ V_k b_k^n(τ)` of degree 1, 3 and 5 with general end conditions.

use super::motion_sample::MotionSample;
use super::parameters::{PHASE, within};
use super::{FeedrateError, bounded};

/// Feed, acceleration and jerk at one end of a phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FeedState {
    /// Feed \[mm/s\].
    pub feed_mm_s: f64,
    /// Acceleration \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Jerk \[mm/s³\].
    pub jerk_mm_s3: f64,
}

impl FeedState {
    /// Steady motion at this feed.
    pub fn steady(feed_mm_s: f64) -> Self {
        Self { feed_mm_s, ..Self::default() }
    }

    fn check(&self) -> Result<(), FeedrateError> {
        bounded("feed_mm_s", self.feed_mm_s)?;
        bounded("accel_mm_s2", self.accel_mm_s2)?;
        bounded("jerk_mm_s3", self.jerk_mm_s3)?;
        Ok(())
    }
}

/// A phase whose feed is a polynomial in Bernstein form.
///
/// Degrees 1 and 3 are raised to degree 5 (which changes no value), so that there is one formula for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BernsteinPhase {
    duration_s: f64,
    /// Feed coefficients `V_0 … V_5` \[mm/s\].
    feed: [f64; 6],
    /// Whether the acceleration jumps at an end that is meant to be steady.
    jumps: bool,
}

impl BernsteinPhase {
    /// Degree 5 from velocity, acceleration and jerk at both ends:
    ///
    /// ```text
    /// V_0 = V_i   V_1 = V_i + T a_i/5   V_2 = V_i + 2T a_i/5 + T² j_i/20
    /// V_5 = V_f   V_4 = V_f - T a_f/5   V_3 = V_f - 2T a_f/5 + T² j_f/20
    /// ```
    ///
    /// With all end accelerations and jerks zero this is the S-curve `V_f (10τ³ - 15τ⁴ + 6τ⁵)`, whose peaks are
    /// `a = 1.875 V_f/T` and `j = (10/√3) V_f/T²`.
    ///
    /// # Errors
    /// `duration_s` not between 1e-9 and 1e9, a state that is not finite.
    pub fn quintic(start: FeedState, end: FeedState, duration_s: f64) -> Result<Self, FeedrateError> {
        let t = within(&PHASE, duration_s)?;
        start.check()?;
        end.check()?;
        let feed = [
            start.feed_mm_s,
            start.feed_mm_s + t * start.accel_mm_s2 / 5.0,
            start.feed_mm_s + 2.0 * t * start.accel_mm_s2 / 5.0 + t * t * start.jerk_mm_s3 / 20.0,
            end.feed_mm_s - 2.0 * t * end.accel_mm_s2 / 5.0 + t * t * end.jerk_mm_s3 / 20.0,
            end.feed_mm_s - t * end.accel_mm_s2 / 5.0,
            end.feed_mm_s,
        ];
        Ok(Self { duration_s: t, feed, jumps: false })
    }

    /// Degree 3 from velocity and acceleration at both ends (the jerks in the states are not used).
    ///
    /// # Errors
    /// `duration_s` not between 1e-9 and 1e9, a state that is not finite.
    pub fn cubic(start: FeedState, end: FeedState, duration_s: f64) -> Result<Self, FeedrateError> {
        let t = within(&PHASE, duration_s)?;
        start.check()?;
        end.check()?;
        let c = [
            start.feed_mm_s,
            start.feed_mm_s + t * start.accel_mm_s2 / 3.0,
            end.feed_mm_s - t * end.accel_mm_s2 / 3.0,
            end.feed_mm_s,
        ];
        let feed = [
            c[0],
            (2.0 * c[0] + 3.0 * c[1]) / 5.0,
            (c[0] + 6.0 * c[1] + 3.0 * c[2]) / 10.0,
            (3.0 * c[1] + 6.0 * c[2] + c[3]) / 10.0,
            (3.0 * c[2] + 2.0 * c[3]) / 5.0,
            c[3],
        ];
        Ok(Self { duration_s: t, feed, jumps: false })
    }

    /// Degree 1 from the velocity at both ends: constant acceleration, which jumps at both ends.
    ///
    /// # Errors
    /// `duration_s` not between 1e-9 and 1e9, a feed that is not finite.
    pub fn linear(start_mm_s: f64, end_mm_s: f64, duration_s: f64) -> Result<Self, FeedrateError> {
        let t = within(&PHASE, duration_s)?;
        bounded("feed_mm_s", start_mm_s)?;
        bounded("feed_mm_s", end_mm_s)?;
        let feed = std::array::from_fn(|k| start_mm_s + (end_mm_s - start_mm_s) * (k as f64 / 5.0));
        Ok(Self { duration_s: t, feed, jumps: start_mm_s != end_mm_s })
    }

    /// Length of the phase \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Distance covered in the whole phase: `T/6 ΣV_k` \[mm\].
    pub fn distance_mm(&self) -> f64 {
        self.duration_s * self.feed.iter().sum::<f64>() / 6.0
    }

    /// Whether the acceleration jumps at the ends.
    pub(super) fn jumps(&self) -> bool {
        self.jumps
    }

    /// Motion `t_s` after the phase began (clamped to the phase).
    pub fn at(&self, t_s: f64) -> MotionSample {
        let duration = self.duration_s;
        let tau = (t_s / duration).clamp(0.0, 1.0);
        let lerp = |a: f64, b: f64| a + tau * (b - a);

        // The distance is the integral: degree 6 with the cumulative sums of the feed as coefficients.
        let mut distance = [0.0; 7];
        for k in 0..6 {
            distance[k + 1] = distance[k] + self.feed[k] * duration / 6.0;
        }
        for round in (1..=6).rev() {
            for k in 0..round {
                distance[k] = lerp(distance[k], distance[k + 1]);
            }
        }
        // De Casteljau on the feed; the triangle's later rows give the derivatives.
        let mut v = self.feed;
        for round in (3..=5).rev() {
            for k in 0..round {
                v[k] = lerp(v[k], v[k + 1]);
            }
        }
        let jerk = 20.0 * (v[2] - 2.0 * v[1] + v[0]) / (duration * duration);
        let (v0, v1) = (lerp(v[0], v[1]), lerp(v[1], v[2]));
        MotionSample {
            s_mm: distance[0],
            feed_mm_s: lerp(v0, v1),
            accel_mm_s2: 5.0 * (v1 - v0) / duration,
            jerk_mm_s3: jerk,
        }
    }
}
