//! Jerk-limited motion along a stretch that is entered and left at given speeds.

use super::jerk_limited::JerkLimitedPhase;
use super::motion_sample::{MotionPeaks, MotionSample};

/// What a jerk-limited motion keeps, both between 1e-9 and 1e9.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) accel: f64,
    pub(super) jerk: f64,
}

impl Bounds {
    /// The speed change from which on the acceleration limit is reached: `a²/j`.
    fn threshold(self) -> f64 {
        self.accel * self.accel / self.jerk
    }

    /// Shortest time to change the speed by `change`, the acceleration 0 at both ends: `Δ/a + a/j` or, below `a²/j`, `2 √(Δ/j)`.
    fn time(self, change: f64) -> f64 {
        if change >= self.threshold() {
            change / self.accel + self.accel / self.jerk
        } else {
            2.0 * (change / self.jerk).sqrt()
        }
    }

    /// Distance of that: the mean of both speeds holds for the time, because one half mirrors the other.
    pub(super) fn distance(self, from: f64, to: f64) -> f64 {
        0.5 * (from + to) * self.time((to - from).abs())
    }

    /// The highest speed that can be reached from `from` within `length`.
    ///
    /// With `Δ` the speed gained: `(2v + Δ) √(Δ/j) = L`, a cubic in `√Δ`, or `(2v + Δ)(Δ/a + a/j)/2 = L`.
    pub(super) fn reach(self, from: f64, length: f64) -> f64 {
        let threshold = self.threshold();
        if self.distance(from, from + threshold) >= length {
            // x³ + 2 v x = q; convex, so that Newton's iteration from above comes down to the root.
            let q = length * self.jerk.sqrt();
            let mut x = libm::cbrt(q);
            if from > 0.0 {
                x = x.min(q / (2.0 * from));
            }
            for _ in 0..40 {
                let next = x - (x * (x * x + 2.0 * from) - q) / (3.0 * x * x + 2.0 * from);
                if !(next < x) {
                    break;
                }
                x = next;
            }
            return from + x * x;
        }
        // Δ²/(2a) + Δ b + c = 0, in the form that does not cancel.
        let half = 0.5 / self.accel;
        let b = from / self.accel + 0.5 * self.accel / self.jerk;
        let c = from * self.accel / self.jerk - length;
        let root = (b * b - 4.0 * half * c).max(0.0).sqrt();
        from + (-2.0 * c / (b + root)).max(0.0)
    }

    /// As [`Bounds::reach`], but never lower for a higher `from`.
    ///
    /// A stretch that is entered very slowly takes long, so that a little more speed can be gained on it than from a slightly
    /// higher start: the exact answer falls before it rises, by at most 5.5 %. A look-ahead that is to depend on nothing behind a
    /// settled joint takes the lowest answer of all higher starts.
    pub(super) fn steady_reach(self, from: f64, length: f64) -> f64 {
        let threshold = self.threshold();
        // The lowest answer is at v = Δ/2, where 2 Δ √(Δ/j) = L, or at v = a²/(2j).
        let gain = libm::cbrt(0.25 * length * length * self.jerk);
        let turning = 0.5 * gain.min(threshold);
        self.reach(from.max(turning), length).max(from)
    }

    /// The highest speed between `from` and `to`, at most `limit`, on a stretch of `length`.
    fn peak(self, from: f64, to: f64, length: f64, limit: f64) -> f64 {
        if from == 0.0 && to == 0.0 {
            return JerkLimitedPhase::highest_feed_mm_s(length, limit, self.accel, self.jerk);
        }
        let rest = |v: f64| self.distance(from, v) + self.distance(v, to) - length;
        let (mut low, mut high) = (from.max(to), limit);
        let (mut at_low, mut at_high) = (rest(low), rest(high));
        if !(at_high > 0.0) {
            return limit;
        }
        if !(at_low < 0.0) {
            return low;
        }
        // Regula falsi with the Illinois weight; the lower end is kept as the answer, so that the phases fit.
        let mut side = 0;
        for _ in 0..100 {
            let mut middle = (low * at_high - high * at_low) / (at_high - at_low);
            if !(middle > low && middle < high) {
                middle = 0.5 * (low + high);
            }
            let value = rest(middle);
            if value > 0.0 {
                (high, at_high) = (middle, value);
                at_low *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (low, at_low) = (middle, value);
                at_high *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
            if high - low <= 1e-14 * high || value.abs() <= 1e-15 * length {
                break;
            }
        }
        low
    }
}

/// Motion along a stretch: from one speed to the next, as fast as a feed, an acceleration and a jerk limit allow. The
/// acceleration is 0 at both ends and in the middle part, which has the stretch's highest speed.
///
/// It is what [`LookAhead`](super::LookAhead) makes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    length_mm: f64,
    from_mm_s: f64,
    peak_mm_s: f64,
    to_mm_s: f64,
    accelerate: JerkLimitedPhase,
    decelerate: JerkLimitedPhase,
    up_s: f64,
    cruise_s: f64,
    total_s: f64,
    up_mm: f64,
    pub(super) pause_s: f64,
}

impl Span {
    /// The fastest motion along `length` between two speeds that can follow on each other on it.
    pub(super) fn new(length: f64, from: f64, to: f64, limit: f64, bounds: Bounds) -> Self {
        let peak = bounds.peak(from, to, length, limit).max(from).max(to);
        let phase = |change: f64| JerkLimitedPhase::checked(change, bounds.accel, bounds.jerk);
        let (accelerate, decelerate) = (phase(peak - from), phase(peak - to));
        let (up_s, down_s) = (accelerate.duration_s(), decelerate.duration_s());
        let (up_mm, down_mm) = (0.5 * (from + peak) * up_s, 0.5 * (peak + to) * down_s);
        let cruise_s = if peak > 0.0 { ((length - up_mm - down_mm) / peak).max(0.0) } else { 0.0 };
        Self {
            length_mm: length,
            from_mm_s: from,
            peak_mm_s: peak,
            to_mm_s: to,
            accelerate,
            decelerate,
            up_s,
            cruise_s,
            total_s: up_s + cruise_s + down_s,
            up_mm,
            pause_s: 0.0,
        }
    }

    /// Length of the stretch \[mm\].
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// How long to stand still before it \[s\].
    pub fn pause_s(&self) -> f64 {
        self.pause_s
    }

    /// Time of the motion \[s\], the pause not counted.
    pub fn total_s(&self) -> f64 {
        self.total_s
    }

    /// Speed at the start \[mm/s\].
    pub fn start_mm_s(&self) -> f64 {
        self.from_mm_s
    }

    /// Speed at the end \[mm/s\].
    pub fn end_mm_s(&self) -> f64 {
        self.to_mm_s
    }

    /// Largest feed, acceleration and jerk.
    pub fn peaks(&self) -> MotionPeaks {
        let moves = |phase: &JerkLimitedPhase| phase.duration_s() > 0.0;
        let accel =
            |phase: &JerkLimitedPhase| if moves(phase) { phase.at(0.5 * phase.duration_s()).accel_mm_s2 } else { 0.0 };
        let jerk = |phase: &JerkLimitedPhase| if moves(phase) { phase.at(0.0).jerk_mm_s3 } else { 0.0 };
        MotionPeaks {
            feed_mm_s: self.peak_mm_s,
            accel_mm_s2: accel(&self.accelerate).max(accel(&self.decelerate)),
            jerk_mm_s3: jerk(&self.accelerate).max(jerk(&self.decelerate)),
        }
    }

    /// Motion `t_s` after the start of the motion (clamped to it).
    #[inline]
    pub fn at(&self, t_s: f64) -> MotionSample {
        if !(t_s > 0.0) {
            return MotionSample { feed_mm_s: self.from_mm_s, ..MotionSample::default() };
        }
        if t_s >= self.total_s {
            return MotionSample { s_mm: self.length_mm, feed_mm_s: self.to_mm_s, ..MotionSample::default() };
        }
        if t_s < self.up_s {
            let gained = self.accelerate.at(t_s);
            let (s_mm, feed_mm_s) = (self.from_mm_s * t_s + gained.s_mm, self.from_mm_s + gained.feed_mm_s);
            return MotionSample { s_mm, feed_mm_s, ..gained };
        }
        let after = t_s - self.up_s;
        if after <= self.cruise_s {
            let s_mm = self.up_mm + self.peak_mm_s * after;
            return MotionSample { s_mm, feed_mm_s: self.peak_mm_s, ..MotionSample::default() };
        }
        // Counted from the end, which is met exactly.
        let left = self.total_s - t_s;
        let gained = self.decelerate.at(left);
        MotionSample {
            s_mm: self.length_mm - (self.to_mm_s * left + gained.s_mm),
            feed_mm_s: self.to_mm_s + gained.feed_mm_s,
            accel_mm_s2: -gained.accel_mm_s2,
            jerk_mm_s3: gained.jerk_mm_s3,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn validates_reach_against_the_distance() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(80);
        for _ in 0..20_000 {
            let mut power = |low: f64, high: f64| 10.0_f64.powf(rng.random_range(low..high));
            let bounds = Bounds { accel: power(2.0, 4.0), jerk: power(3.0, 6.0) };
            let (length, from) = (power(-6.0, 4.0), power(-5.0, 3.0) - 1e-5);
            let reached = bounds.reach(from, length);
            // The inverse of the distance, as well as rounding lets the difference of speeds be known.
            let distance = bounds.distance(from, reached);
            let blur = 1e-9 * length + 4e-16 * reached * bounds.distance(from, reached * (1.0 + 1e-9)).max(length);
            let gain = reached - from;
            assert!(
                (distance - length).abs() <= blur || gain < 1e-6 * from,
                "{bounds:?} {from} {length}: {reached} {distance}"
            );
            // Never above the exact one, hardly below it, rising with the start.
            let steady = bounds.steady_reach(from, length);
            assert!(steady <= reached * (1.0 + 1e-12) && steady >= 0.944 * reached, "{bounds:?} {from} {length}");
            let higher = bounds.steady_reach(from * 1.01 + 1e-6, length);
            assert!(higher >= steady * (1.0 - 1e-12), "{bounds:?} {from} {length}");
        }
    }
}
