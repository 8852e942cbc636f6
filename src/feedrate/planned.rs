//! Motion `s(t)` through grid points.

use super::{MotionPeaks, MotionSample};

/// A limit is looked at this share of an interval within its ends: on the inner side of a jump of the path's third derivative.
pub(super) const INSET: f64 = 1e-6;

/// A spline of degree 5 in time through time, position, speed and acceleration at the points of a grid, from rest to rest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Planned {
    nodes: Vec<Node>,
    /// The interval that holds the time `i T/n`, for every `i` up to `n`: where the search for a time starts.
    lookup: Vec<u32>,
    peaks: MotionPeaks,
}

/// A grid point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Node {
    pub(super) t: f64,
    /// Time to the next point, as it was computed: the difference of late times would have lost digits that the jerk needs.
    pub(super) dt: f64,
    pub(super) s: f64,
    pub(super) v: f64,
    pub(super) a: f64,
}

impl Planned {
    /// The motion through at least two nodes whose times and positions rise.
    pub(super) fn new(nodes: Vec<Node>) -> Self {
        let mut planned = Self {
            nodes,
            lookup: Vec::new(),
            peaks: MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 },
        };
        planned.index();
        planned
    }

    fn index(&mut self) {
        let intervals = self.nodes.len().saturating_sub(1);
        let total = self.total_s();
        self.lookup.clear();
        let mut interval = 0_usize;
        for i in 0..=intervals {
            let t = total * (i as f64 / intervals as f64);
            while interval + 1 < intervals && self.nodes[interval + 1].t <= t {
                interval += 1;
            }
            self.lookup.push(u32::try_from(interval).unwrap_or(u32::MAX));
        }
        let mut peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        self.each_sample(10, |_, m| {
            peaks.feed_mm_s = peaks.feed_mm_s.max(m.feed_mm_s.abs());
            peaks.accel_mm_s2 = peaks.accel_mm_s2.max(m.accel_mm_s2.abs());
            peaks.jerk_mm_s3 = peaks.jerk_mm_s3.max(m.jerk_mm_s3.abs());
        });
        self.peaks = peaks;
    }

    /// The motion at two or more places of every interval, from just behind its start to just before its end.
    pub(super) fn each_sample(&self, places: u32, mut see: impl FnMut(usize, &MotionSample)) {
        for (interval, pair) in self.nodes.windows(2).enumerate() {
            for place in 0..places {
                // On the inner side of both ends, where the third derivative of the path may jump.
                let x = f64::from(place) / f64::from(places - 1);
                see(interval, &between(&pair[0], &pair[1], x.clamp(INSET, 1.0 - INSET)));
            }
        }
    }

    /// The same at `feed scale` times the time.
    pub(super) fn paced(mut self, feed_scale: f64) -> Self {
        for node in &mut self.nodes {
            node.t *= feed_scale;
            node.dt *= feed_scale;
            node.v /= feed_scale;
            node.a /= feed_scale * feed_scale;
        }
        self.index();
        self
    }

    pub(super) fn nodes(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn total_s(&self) -> f64 {
        self.nodes.last().map_or(0.0, |node| node.t)
    }

    pub(super) fn length_mm(&self) -> f64 {
        self.nodes.last().map_or(0.0, |node| node.s)
    }

    pub(super) fn peaks(&self) -> MotionPeaks {
        self.peaks
    }

    /// The first node's time after this one.
    pub(super) fn next_knot(&self, t_s: f64) -> f64 {
        let next = self.nodes.partition_point(|node| node.t <= t_s);
        self.nodes.get(next).map_or(f64::INFINITY, |node| node.t)
    }

    /// The motion at a time between 0 and the end.
    pub(super) fn at(&self, t_s: f64) -> MotionSample {
        let intervals = self.nodes.len().saturating_sub(1);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a float cast saturates
        let slot = (t_s / self.total_s() * intervals as f64) as usize;
        let place = |slot: usize| self.lookup.get(slot).map_or(intervals.saturating_sub(1), |&i| i as usize);
        // Rounding may put the time into the slot beside its own.
        let (low, high) = (place(slot.saturating_sub(1)), place(slot + 2) + 1);
        let Some(within) = self.nodes.get(low + 1..high.min(intervals)) else { return MotionSample::default() };
        let interval = low + within.partition_point(|node| node.t <= t_s);
        match self.nodes.get(interval..interval + 2) {
            Some([from, to]) => between(from, to, ((t_s - from.t) / from.dt).clamp(0.0, 1.0)),
            _ => MotionSample::default(),
        }
    }
}

/// The polynomial of degree 5 between two nodes, at the share `x` of their time.
fn between(from: &Node, to: &Node, x: f64) -> MotionSample {
    let dt = from.dt;
    let (v0, v1) = (from.v * dt, to.v * dt);
    let (a0, a1) = (from.a * dt * dt, to.a * dt * dt);
    // What the state at the start leaves over: position, speed and acceleration to be gained by cubic and higher terms.
    let p = (to.s - from.s) - v0 - 0.5 * a0;
    let v = v1 - v0 - a0;
    let a = a1 - a0;
    let c3 = 10.0 * p - 4.0 * v + 0.5 * a;
    let c4 = -15.0 * p + 7.0 * v - a;
    let c5 = 6.0 * p - 3.0 * v + 0.5 * a;
    MotionSample {
        s_mm: from.s + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5)))),
        feed_mm_s: (v0 + x * (a0 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))) / dt,
        accel_mm_s2: (a0 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))) / (dt * dt),
        jerk_mm_s3: (6.0 * c3 + x * (24.0 * c4 + x * 60.0 * c5)) / (dt * dt * dt),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regression_late_times_keep_the_digits_that_the_jerk_needs() {
        // A day into a motion times have eleven digits behind the point. An interval of 1 ms that is their difference is off by up to
        // 1e-8 of itself, which at 150 mm/s looks like a jerk of 100 mm/s³.
        let (jerk, late, dt) = (50.0, 86_400.0 + 0.1 / 3.0, 1e-3 / 1.7);
        let nodes: Vec<Node> = (0..100)
            .map(|i| {
                let t = f64::from(i) * dt;
                Node {
                    t: late + t,
                    dt,
                    s: 150.0 * t + jerk * t * t * t / 6.0,
                    v: 150.0 + 0.5 * jerk * t * t,
                    a: jerk * t,
                }
            })
            .collect();
        let planned = Planned::new(nodes);
        let mut worst = 0.0_f64;
        planned.each_sample(10, |_, m| worst = worst.max((m.jerk_mm_s3 - jerk).abs()));
        // Of the position 1e-15 is left over: 60 · 1e-15/dt³ = 3e-4.
        assert!(worst < 0.02, "{worst}");
        for i in 0..1000 {
            let t = late + 98.9 * dt * f64::from(i) / 1000.0;
            assert!((planned.at(t).jerk_mm_s3 - jerk).abs() < 0.02, "{:?}", planned.at(t));
        }
    }
}
