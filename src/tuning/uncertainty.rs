//! Uncertain plants: gain and time constant within a box around their nominal values.

use nalgebra::Vector2;

use crate::analysis::margins;
use crate::interpolator::Interpolator;
use crate::optimize::Random;
use crate::scenario::Scenario;
use crate::servo::{AxisParameters, LoopSettings};

/// A box of plants: gain and time constant of every axis within a share of their nominal values, all independently.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Share by which the plant's gain `K` may be higher or lower, from 0 to below 1.
    pub gain: f64,
    /// The same of the time constant `τ`.
    pub time_constant: f64,
}

impl Default for Uncertainty {
    /// ±20 % of both.
    fn default() -> Self {
        Self { gain: 0.2, time_constant: 0.2 }
    }
}

/// Where in the box a plant lies: gain and time constant of X, then of Y, from -1 to 1.
pub(super) type Shares = [f64; 4];

/// Time constants that are looked at first.
const GRID: usize = 5;

impl Uncertainty {
    /// Whether there is any.
    pub fn is_none(&self) -> bool {
        self.gain == 0.0 && self.time_constant == 0.0
    }

    /// How far the plants of the box are from instability: the smallest factor by which the loop gain of any of them can
    /// rise or fall before the loop is unstable. Above 1 every plant is stable, at most 1 some plant is not (0 where a time constant
    /// makes the loop unstable by itself).
    ///
    /// The loop gain is linear in `K`: the interval of stable gains of one time constant covers all `K` at once. Over the time constant
    /// the ends of that interval vary smoothly; they are taken on a grid, and the least is refined by golden section while it
    /// could matter.
    pub fn reserve(&self, axis: &AxisParameters, settings: &LoopSettings) -> f64 {
        let reserve_at = |share: f64| {
            let mut axis = *axis;
            axis.plant.time_constant_s *= 1.0 + share * self.time_constant;
            let margins = margins(&axis, settings);
            if !margins.stable {
                return 0.0;
            }
            // (0, ∞) is the interval without any edge.
            ((1.0 - self.gain) / margins.gain_down).min(margins.gain_up / (1.0 + self.gain))
        };
        if self.is_none() {
            return reserve_at(0.0);
        }
        let step = 2.0 / (GRID - 1) as f64;
        let grid = (0..GRID).map(|i| -1.0 + i as f64 * step).map(|share| (reserve_at(share), share));
        let (mut least, at) = grid.fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        // A smooth function on a fine grid: between its points it is never much lower.
        if !(0.5..2.0).contains(&least) {
            return least;
        }
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = ((at - step).max(-1.0), (at + step).min(1.0));
        for _ in 0..12 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            let (at_a, at_b) = (reserve_at(a), reserve_at(b));
            least = least.min(at_a).min(at_b);
            if at_a < at_b { high = b } else { low = a }
        }
        least
    }

    /// The corners of the box of two axes, but for those of the 16 where both axes' plants are off in the same way (the errors
    /// of the axes then still match: they are never the worst), and for those whose plants would need more than the drive's
    /// voltage to follow the path of the scenario at all, whatever the gains: `u = (ω + τ dω/dt)/K`.
    pub(super) fn corners_in_reach(&self, scenario: &Scenario) -> Vec<Shares> {
        let period_s = scenario.settings.period_s;
        let mut interpolator = Interpolator::new(&*scenario.path, &scenario.motion, period_s);
        // Plants of X and Y: low and high gain, each with low and high time constant.
        let sign = |corner: usize, bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let mut demand_v = [[0.0_f64; 4]; 2];
        let mut last = Vector2::<f64>::zeros();
        for k in 0..=interpolator.last_sample() {
            let velocity = interpolator.setpoint(k).velocity_mm_s;
            for (i, axis) in scenario.axes.iter().enumerate() {
                let r_g = axis.drive.transmission_mm_rad;
                let (speed, acceleration) = (velocity[i] / r_g, (velocity[i] - last[i]) / period_s / r_g);
                for (plant, demand_v) in demand_v[i].iter_mut().enumerate() {
                    let gain = axis.plant.gain_rad_s_v * (1.0 + self.gain * sign(plant, 0));
                    let time_constant = axis.plant.time_constant_s * (1.0 + self.time_constant * sign(plant, 1));
                    let voltage: f64 = (speed + time_constant * acceleration) / gain;
                    *demand_v = demand_v.max(voltage.abs());
                }
            }
            last = velocity;
        }
        let is_in_reach = |i: usize, plant: usize| demand_v[i][plant] <= scenario.axes[i].drive.voltage_limit_v;
        (0..16)
            .filter(|corner| corner & 3 != corner >> 2)
            .filter(|corner| is_in_reach(0, corner & 3) && is_in_reach(1, corner >> 2))
            .map(|corner| [0, 1, 2, 3].map(|bit| sign(corner, bit)))
            .collect()
    }

    /// The axes with `count` plants sampled from the box, uniformly; the same for the same seed, whatever the gains.
    pub fn sampled(&self, axes: &[AxisParameters; 2], count: usize, seed: u64) -> Vec<[AxisParameters; 2]> {
        let mut random = Random::new(seed);
        (0..count).map(|_| self.moved(axes, &[(); 4].map(|()| random.between(-1.0, 1.0)))).collect()
    }

    /// Gain and time constant of X, then of Y, moved by shares of the uncertainty.
    pub(super) fn moved(&self, axes: &[AxisParameters; 2], shares: &Shares) -> [AxisParameters; 2] {
        let mut axes = *axes;
        for (axis, shares) in axes.iter_mut().zip(shares.chunks(2)) {
            axis.plant.gain_rad_s_v *= 1.0 + self.gain * shares[0];
            axis.plant.time_constant_s *= 1.0 + self.time_constant * shares[1];
        }
        axes
    }
}
