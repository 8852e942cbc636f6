//! Looking ahead: whether a step of the feed scale leaves a way to become steady within the limits.

use super::{Change, OverridePlanner, PARTS, SLOW, State, Trial};

/// By what share of a limit a change may pass it: what lies between the places that are looked at is less than the rest of 0.1 %.
const TOLERANCE: f64 = 2.5e-4;

/// Steps to a steady ratio that are looked ahead.
const MOST_AHEAD: usize = 250;

/// The most bold steps in a row that are tried where one alone has no recovery ramp: a deep fall of the feed scale may keep limits that a shallow one
/// does not.
const MOST_BOLD: usize = 128;

/// Most numbers of bold steps that are tried one by one.
const MOST_LOOKS: usize = 16;
impl<const D: usize> OverridePlanner<'_, D> {
    /// Makes the recovery ramp some bold steps and what makes the feed scale steady behind them.
    pub(super) fn fall(&mut self, goal: f64, direction: f64, most: f64, length: f64) -> bool {
        let mut bold = std::mem::take(&mut self.bold);
        bold.clear();
        let mut at = self.state;
        let (mut look, mut looked, mut found) = (2, 0, false);
        while bold.len() < MOST_BOLD && !found {
            let mut bend = self.within_jerk(&at, direction * most, most, length);
            bend = self.within_acceleration(&at, bend, length);
            if bend * direction < 0.0 && at.slope * direction <= 0.0 || !self.fits(&at, bend, length) {
                break;
            }
            at = at.after(bend, length);
            bold.push((bend, at));
            let beyond = at.tau >= self.end || (goal - at.ratio) * direction <= 0.0;
            if bold.len() < look && !beyond {
                continue;
            }
            match self.falls(&bold, bold.len(), goal, direction, most, length) {
                Trial::Fine => found = true,
                // Somewhere between the last look and this one, perhaps.
                Trial::TooFar => {
                    found = (looked + 1..bold.len())
                        .rev()
                        .take(MOST_LOOKS)
                        .any(|count| self.falls(&bold, count, goal, direction, most, length) == Trial::Fine);
                    break;
                }
                Trial::TooMuch | Trial::NoRoom if beyond => break,
                Trial::TooMuch | Trial::NoRoom => (looked, look) = (look, look + (look / 3).max(1)),
            }
        }
        self.bold = bold;
        found
    }

    /// Whether the feed scale can become steady after so many bold steps: they are the recovery ramp then.
    pub(super) fn falls(
        &mut self,
        bold: &[(f64, State)],
        count: usize,
        goal: f64,
        direction: f64,
        most: f64,
        length: f64,
    ) -> Trial {
        let Some(bold) = bold.get(..count) else { return Trial::TooMuch };
        let Some(&(_, from)) = bold.last() else { return Trial::TooMuch };
        let mut steps = std::mem::take(&mut self.spare);
        let end = self.brake(from, most, length, &mut steps);
        let trial = match end {
            None => Trial::TooMuch,
            Some(end) if end.tau < self.end && (goal - end.ratio) * direction < 0.0 => Trial::TooFar,
            Some(_) => {
                steps.extend(bold.iter().rev().map(|&(bend, _)| (bend, length)));
                std::mem::swap(&mut self.recovery_ramp.steps, &mut steps);
                self.recovery_ramp.ratio = f64::NAN;
                Trial::Fine
            }
        };
        self.spare = steps;
        trial
    }

    /// The bend nearest to the wanted one that keeps the acceleration at the end of a step.
    pub(super) fn within_acceleration(&mut self, from: &State, wanted: f64, length: f64) -> f64 {
        let bounds = self.bounds;
        let mut bend = wanted;
        for _ in 0..2 {
            let to = from.after(bend, length);
            let Some(row) = self.planned_motion.at(to.tau) else { return bend };
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for i in 0..D {
                let (v, a) = (row.velocity[i], row.acceleration[i]);
                if v == 0.0 {
                    continue;
                }
                let (base, limit) = (to.ratio * to.ratio * a, (1.0 + 0.5 * TOLERANCE) * bounds.accel[i]);
                let (one, other) = ((-limit - base) / v, (limit - base) / v);
                low = low.max((one.min(other) - from.slope) / length);
                high = high.min((one.max(other) - from.slope) / length);
            }
            bend = if low <= high { wanted.clamp(low, high) } else { 0.5 * (low + high) };
        }
        bend
    }

    /// Whether a step of constant `f''` keeps the limits.
    pub(super) fn fits(&mut self, from: &State, bend: f64, length: f64) -> bool {
        let bounds = self.bounds;
        self.planned_motion.walk(from, (bend, length), |row, f, g| {
            (0..D).all(|i| {
                let (v, a, j) = (row.velocity[i], row.acceleration[i], row.jerk[i]);
                (f * f * a + g * v).abs() <= (1.0 + TOLERANCE) * bounds.accel[i]
                    && (f * f * f * j + 3.0 * f * g * a + bend * v).abs() <= (1.0 + TOLERANCE) * bounds.jerk[i]
            })
        })
    }

    /// The bend nearest to the wanted one that the jerk allows over a step.
    pub(super) fn within_jerk(&mut self, from: &State, wanted: f64, most: f64, length: f64) -> f64 {
        let bounds = self.bounds;
        // At the start alone, then over the step that follows from it.
        let mut bend = 0.0;
        for round in 0..8 {
            let (mut low, mut high) = (-most, most);
            let mut seen = 0;
            self.planned_motion.walk(from, (bend, length), |row, f, g| {
                for i in 0..D {
                    let (v, a, j) = (row.velocity[i], row.acceleration[i], row.jerk[i]);
                    if v == 0.0 {
                        continue;
                    }
                    let (base, limit) = (f * f * f * j + 3.0 * f * g * a, (1.0 + 0.5 * TOLERANCE) * bounds.jerk[i]);
                    let (one, other) = ((-limit - base) / v, (limit - base) / v);
                    low = low.max(one.min(other));
                    high = high.min(one.max(other));
                }
                seen += 1;
                round > 0 || seen < 1
            });
            let before = bend;
            bend = if low <= high { wanted.clamp(low, high) } else { 0.5 * (low + high) };
            if round > 0 && (bend - before).abs() <= 0.1 * TOLERANCE * bend.abs() {
                break;
            }
        }
        bend
    }

    /// Steps that make the feed scale steady as soon as may be; where that ends.
    pub(super) fn brake(&mut self, from: State, most: f64, length: f64, steps: &mut Vec<(f64, f64)>) -> Option<State> {
        steps.clear();
        let mut at = from;
        while at.slope != 0.0 && at.tau < self.end {
            if steps.len() > MOST_AHEAD {
                return None;
            }
            let sign = -at.slope.signum();
            let bend = self.within_jerk(&at, sign * most, most, length);
            let steady_s = -at.slope / bend;
            let last = steady_s > 0.0 && steady_s <= length;
            let x = if last { steady_s } else { length };
            if !self.fits(&at, bend, x) {
                return None;
            }
            steps.push((bend, x));
            at = at.after(bend, x);
            if last {
                at.slope = 0.0;
            }
            if at.ratio < 0.0 {
                // Beyond every goal.
                break;
            }
        }
        steps.reverse();
        Some(at)
    }

    /// What comes of a step; its recovery ramp is then in `spare`.
    pub(super) fn trial(&mut self, bend: f64, length: f64, goal: f64, direction: f64, most: f64) -> Trial {
        let from = self.state;
        let next = from.after(bend, length);
        if next.slope * direction < 0.0 || !self.fits(&from, bend, length) {
            return Trial::TooMuch;
        }
        let mut steps = std::mem::take(&mut self.spare);
        let end = self.brake(next, most, length, &mut steps);
        self.spare = steps;
        let Some(end) = end else { return Trial::TooMuch };
        if end.tau < self.end && (goal - end.ratio) * direction < 0.0 {
            return Trial::TooFar;
        }
        if goal > 1.0
            && end.ratio > 1.0
            && let Some((_, to)) = self.cruise
            && end.tau + self.way_back(end.ratio) > to
        {
            return Trial::NoRoom;
        }
        Trial::Fine
    }

    /// Makes the recovery ramp the one with constant `f''` that ends at the goal, where that keeps the limits.
    pub(super) fn land(&mut self, goal: f64, most: f64, length: f64) -> bool {
        let State { ratio, slope, .. } = self.state;
        let whole = 2.0 * (goal - ratio) / slope;
        if !(whole > 0.0 && whole <= PARTS * length) {
            return false;
        }
        let bend = -slope / whole;
        if bend.abs() > most * (1.0 + 1e-6) {
            return false;
        }
        // Not before it needs most of what there is.
        let from = self.state;
        let able = self.within_jerk(&from, most * bend.signum(), most, length);
        if whole > 4.0 * length && bend.abs() < 0.97 * able.abs() {
            return false;
        }
        if goal > 1.0
            && let Some((_, to)) = self.cruise
            && self.state.after(bend, whole).tau + self.way_back(goal) > to
        {
            return false;
        }
        if !self.fits_in_parts(self.state, bend, whole, length) {
            return false;
        }
        self.recovery_ramp.steps.clear();
        self.recovery_ramp.steps.push((bend, whole));
        self.recovery_ramp.ratio = goal;
        true
    }

    pub(super) fn fits_in_parts(&mut self, mut at: State, bend: f64, whole: f64, length: f64) -> bool {
        let parts = (whole / length).ceil().clamp(1.0, 1e4);
        let mut i = 0.0;
        while i < parts {
            if !self.fits(&at, bend, whole / parts) {
                return false;
            }
            at = at.after(bend, whole / parts);
            if at.tau >= self.end {
                return true;
            }
            i += 1.0;
        }
        true
    }

    /// A change of the length that was asked for, as two parabolas, where that keeps the limits. One that was asked for very slowly is
    /// made slower still until it does.
    pub(super) fn try_as_a_whole(&mut self) {
        let Change { ratio: goal, size, mut asked_s, .. } = self.change;
        if !(asked_s > 0.0) || goal > 1.0 || self.state.ratio > 1.0 {
            return;
        }
        let natural = PARTS * {
            self.change.asked_s = 0.0;
            let step = self.step_s();
            self.change.asked_s = asked_s;
            step
        };
        let tries = if asked_s > SLOW * natural { 30 } else { 1 };
        // All of it is looked at: not in intervals as narrow as for the shortest change.
        let width = (0.02 * asked_s.min(SLOW * natural)).clamp(1e-4 * self.end, 0.01 * self.end);
        self.planned_motion.restart(self.state.tau, width);
        let direction = (goal - self.state.ratio).signum();
        let parts = (asked_s / natural * 20.0).clamp(PARTS, 5e3);
        for _ in 0..tries {
            let (half, bend) = (0.5 * asked_s, direction * 4.0 * size / (asked_s * asked_s));
            let middle = self.state.after(bend, half);
            if self.fits_in_parts(self.state, bend, half, asked_s / parts)
                && (middle.tau >= self.end || self.fits_in_parts(middle, -bend, half, asked_s / parts))
            {
                self.recovery_ramp.steps.clear();
                self.recovery_ramp.steps.extend([(-bend, half), (bend, half)]);
                self.recovery_ramp.ratio = goal;
                self.change.whole = true;
                return;
            }
            asked_s *= 1.5;
        }
        self.restart();
    }
}
