//! The override planner: the feed scale from one override ratio to the next within the limits.

mod ahead;

use super::feed_scale::{Piece, State};
use super::planned_motion::{AxisDerivatives, Bounds, PlannedMotion};
use super::steps::{OverrideChange, OverrideStep};
use crate::feedrate::time_law::TimeLaw;
use crate::feedrate::{FeedrateError, MotionSample};

/// Into how many steps the shortest change is cut.
const PARTS: f64 = 100.0;

/// The largest `f''` in a step, as its share of the size of the change over the step's square: what lies within the step then stays as small
/// as the tolerance. The shortest change needs `4/PARTS²`.
const FREE: f64 = 2e-3;

/// Steps of one change after which they grow: it waits for the plan to leave it something.
const QUICK_STEPS: u32 = 800;

/// The shortest step, as a share of the time in which the acceleration builds up.
const FINEST: f64 = 2.5e-4;

/// Steps without much progress after which it is a long wait.
const LONG_WAIT: u32 = 60;

/// Steps after which a change is given up where it is.
const MOST_STEPS: u32 = 8000;

/// Halvings between a step that is too large and one that is not.
const HALVINGS: u32 = 7;

/// A change that was asked for this many times as slow as it could be is tried as a whole.
const SLOW: f64 = 100.0;

/// Steps, each with its `f''` and its length, after which the feed scale is steady at a ratio.
#[derive(Debug, Clone, Default)]
struct RecoveryRamp {
    /// The last step first.
    steps: Vec<(f64, f64)>,
    ratio: f64,
}

/// What a step would lead to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trial {
    Fine,
    /// A limit would be passed.
    TooMuch,
    /// The feed scale could not become steady before it is beyond the goal.
    TooFar,
    /// No room would be left to come back to the plan's own feed scale before it slows down.
    NoRoom,
}

/// A change that is going on.
#[derive(Debug, Clone, Copy)]
struct Change {
    ratio: f64,
    /// How far it goes, to tell its scale.
    size: f64,
    /// The shortest time that was asked for.
    asked_s: f64,
    steps: u32,
    /// Which of the changes that are told of.
    index: Option<usize>,
    /// Whether the recovery ramp has been renewed since it began.
    renewed: bool,
    /// Whether the recovery ramp is all of it.
    whole: bool,
    done: bool,
}

pub(super) struct OverridePlanner<'a, const D: usize> {
    planned_motion: PlannedMotion<'a, D>,
    bounds: Bounds<D>,
    end: f64,
    /// The plan's steady feed: from, to.
    cruise: Option<(f64, f64)>,
    state: State,
    pieces: Vec<Piece>,
    recovery_ramp: RecoveryRamp,
    change: Change,
    /// Whether ratios above 1 are over.
    back: bool,
    changes: Vec<OverrideChange>,
    /// Which step the last change is.
    step: usize,
    total_s: Option<f64>,
    spare: Vec<(f64, f64)>,
    bold: Vec<(f64, State)>,
}

/// The shortest time of a change by `size` from steady to steady with this largest slope and bend.
fn shortest_s(size: f64, slope: f64, bend: f64) -> f64 {
    if size * bend <= slope * slope { 2.0 * (size / bend).sqrt() } else { size / slope + slope / bend }
}

impl<'a, const D: usize> OverridePlanner<'a, D> {
    pub(super) fn new(
        plan: &'a dyn TimeLaw,
        bounds: Bounds<D>,
        row: &'a mut dyn FnMut(&MotionSample) -> AxisDerivatives<D>,
    ) -> Self {
        let change = Change {
            ratio: 1.0,
            size: 0.0,
            asked_s: 0.0,
            steps: 0,
            index: None,
            renewed: false,
            whole: false,
            done: true,
        };
        Self {
            planned_motion: PlannedMotion::new(plan, row),
            bounds,
            end: plan.total_s(),
            cruise: plan.steady_s(),
            state: State::PLAN,
            pieces: Vec::new(),
            recovery_ramp: RecoveryRamp::default(),
            change,
            back: false,
            changes: Vec::new(),
            step: 0,
            total_s: None,
            spare: Vec::new(),
            bold: Vec::new(),
        }
    }

    /// Runs up to a change and goes to its ratio.
    pub(super) fn turn(&mut self, index: usize, step: &OverrideStep) {
        let &OverrideStep { at_s, ratio, transition_s: asked_s } = step;
        self.advance(at_s);
        if ratio == self.change.ratio {
            return;
        }
        self.close_change();
        let after_the_end = self.total_s.is_some();
        let reached = self.state.ratio;
        let change = Some(self.changes.len());
        self.changes.push(OverrideChange { at_s, ratio, asked_s, transition_s: 0.0, reached, after_the_end });
        let mut size = (ratio - reached).abs().max(1e-9);
        if self.state.slope != 0.0 {
            // What goes on has to be stopped in steps of its own size.
            size = size.max(0.2 * self.change.size);
        }
        self.step = index;
        self.change =
            Change { ratio, size, asked_s, steps: 0, index: change, renewed: false, whole: false, done: after_the_end };
        if after_the_end {
            return;
        }
        if self.state.tau == 0.0 {
            // The tool stands: the feed scale may jump.
            if self.pieces.last().is_some_and(|piece| piece.from.t == self.state.t) {
                self.pieces.pop();
            }
            (self.state.ratio, self.state.slope) = (ratio.min(1.0), 0.0);
            self.push(0.0);
        } else if self.state.slope == 0.0 {
            self.restart();
            self.try_as_a_whole();
        }
    }

    /// The whole motion.
    #[allow(clippy::type_complexity)]
    pub(super) fn finish(mut self) -> Result<(Vec<Piece>, Vec<OverrideChange>, f64), FeedrateError> {
        if self.changes.is_empty() {
            return Ok((self.pieces, self.changes, self.end));
        }
        self.advance(f64::INFINITY);
        self.close_change();
        if let Some(total_s) = self.total_s {
            return Ok((self.pieces, self.changes, total_s));
        }
        let at_s = self.changes.last().map_or(0.0, |change| change.at_s);
        Err(FeedrateError::HeldForEver { step: self.step, at_s })
    }

    /// Notes how the change that goes on ended.
    fn close_change(&mut self) {
        if self.change.done {
            return;
        }
        self.change.done = true;
        let now = self.total_s.unwrap_or(self.state.t);
        if let Some(change) = self.change.index.and_then(|i| self.changes.get_mut(i)) {
            change.transition_s = (now - change.at_s).max(0.0);
            change.reached = self.state.ratio;
        }
    }

    /// The ratio to go to now.
    fn goal(&self) -> f64 {
        let ratio = self.change.ratio;
        if ratio <= 1.0 {
            return ratio;
        }
        match self.cruise {
            Some((from, to)) if !self.back && self.state.tau >= from && self.state.tau < to => ratio,
            _ => 1.0,
        }
    }

    fn advance(&mut self, until: f64) {
        while self.state.t < until && self.total_s.is_none() {
            let goal = self.goal();
            if self.state.slope == 0.0 && self.state.ratio == goal {
                if goal == self.change.ratio || self.back || self.cruise.is_none() {
                    self.close_change();
                }
                let far = self.steady_until(goal);
                if !self.rest(until.min(far)) {
                    return;
                }
                if far <= until && self.total_s.is_none() {
                    if goal > 1.0 {
                        self.come_back();
                    } else if let Some((from, _)) = self.cruise {
                        self.state.tau = self.state.tau.max(from);
                    }
                }
                self.restart();
            } else {
                self.step(goal, until);
            }
        }
    }

    /// Until when a steady ratio applies.
    fn steady_until(&mut self, goal: f64) -> f64 {
        let State { t, tau, .. } = self.state;
        let Some((from, to)) = self.cruise else { return f64::INFINITY };
        if self.change.ratio <= 1.0 || self.back {
            return f64::INFINITY;
        }
        if goal > 1.0 {
            // As late as it may begin to come back.
            return t + (to - self.way_back(goal) - tau).max(0.0) / goal;
        }
        if tau < from { t + (from - tau) / goal } else { f64::INFINITY }
    }

    /// How much of the plan's cruise it takes to come back from a ratio to 1.
    fn way_back(&mut self, ratio: f64) -> f64 {
        let Some((from, to)) = self.cruise else { return f64::INFINITY };
        let Some(row) = self.planned_motion.at(self.state.tau.clamp(from, to)) else { return f64::INFINITY };
        let (slope, bend) = self.most(&row);
        // A little more than that: steps are not cut to the end of the cruise.
        let size = (ratio - 1.0).max(0.0);
        0.5 * (1.0 + ratio) * shortest_s(size, slope, bend) * (1.0 + 4.0 / PARTS)
    }

    /// The largest slope and bend of a feed scale at a place of the plan if it did nothing else.
    fn most(&self, row: &AxisDerivatives<D>) -> (f64, f64) {
        let least = |limits: &[f64; D]| {
            limits.iter().zip(row.velocity).map(|(limit, v)| limit / v.abs().max(1e-12)).fold(f64::INFINITY, f64::min)
        };
        (least(&self.bounds.accel), least(&self.bounds.jerk))
    }

    /// Keeps the ratio up to a time; false where that never comes.
    fn rest(&mut self, until: f64) -> bool {
        let State { t, tau, ratio, .. } = self.state;
        if !self.pieces.is_empty() {
            self.push(0.0);
        }
        let end_s = if ratio >= 1e-6 { t + (self.end - tau) / ratio } else { f64::INFINITY };
        if end_s <= until {
            self.total_s = end_s.is_finite().then_some(end_s);
            self.state.t = end_s;
            self.state.tau = self.end;
            return end_s.is_finite();
        }
        self.state.t = until;
        self.state.tau = tau + ratio * (until - t);
        true
    }

    fn push(&mut self, bend: f64) {
        if let Some(last) = self.pieces.last()
            && last.bend == bend
            && (bend != 0.0 || (last.from.slope == self.state.slope && last.from.ratio == self.state.ratio))
        {
            return;
        }
        self.pieces.push(Piece { from: self.state, bend });
    }

    /// Length of a step here.
    fn step_s(&mut self) -> f64 {
        let State { t, tau, ratio, .. } = self.state;
        let natural = match self.planned_motion.at(tau) {
            Some(row) => {
                let (slope, bend) = self.most(&row);
                let natural = shortest_s(self.change.size, slope, bend);
                // Fine enough for the time in which the acceleration builds up, too.
                natural.min(0.1 * PARTS * slope / bend).max(0.1 * natural).max(FINEST * PARTS * slope / bend)
            }
            None => 0.0,
        };
        let over = self.change.steps.saturating_sub(QUICK_STEPS);
        let grown = 1.01_f64.powi(i32::try_from(over).unwrap_or(i32::MAX).min(2000));
        let asked = self.change.asked_s.min(SLOW * natural);
        let step = natural.max(asked) / PARTS * grown;
        // Some thousands of the digits that a time has; nor ever all of the plan at once.
        step.max(1e-12 * (1.0 + t)).min(0.05 * self.end / ratio.max(1e-3))
    }

    /// The planned motion from here on.
    fn restart(&mut self) {
        let row = self.planned_motion.fresh(self.state.tau);
        let (slope, bend) = self.most(&row);
        let natural = shortest_s(self.change.size.max(0.01), slope, bend);
        let width = (2.0 / PARTS * natural).clamp(1e-12 * (1.0 + self.end), 0.01 * self.end);
        self.planned_motion.restart(self.state.tau, width);
    }

    /// The largest bend that is worth a thought.
    fn most_bend(&self, step_s: f64) -> f64 {
        let free = FREE / (step_s * step_s) * self.change.size;
        let asked = self.change.asked_s;
        if asked > 0.0 { free.min(4.0 * self.change.size / (asked * asked)) } else { free }
    }

    /// One step of the feed scale towards the goal, at most up to a time.
    #[allow(clippy::too_many_lines)] // one decision after the other
    fn step(&mut self, goal: f64, until: f64) {
        if self.change.asked_s > 0.0
            && self.state.ratio > 1.0
            && let Some((_, to)) = self.cruise
            && self.state.tau + self.way_back(self.state.ratio) + 3.0 * self.state.ratio * self.step_s() >= to
        {
            // No longer as slowly as was asked for.
            (self.change.asked_s, self.change.whole) = (0.0, false);
        }
        if self.change.whole && !self.recovery_ramp.steps.is_empty() {
            return self.follow(0.0, until);
        }
        self.change.steps += 1;
        let direction = if goal < self.state.ratio { -1.0 } else { 1.0 };
        let left = (goal - self.state.ratio).abs();
        if self.state.slope == 0.0 && left < 0.05 * self.change.size {
            // What is left is a change of its own, in steps of its own size; of rounding size it is none.
            (self.change.size, self.change.asked_s) = (left, 0.0);
            if left < 1e-12 {
                self.state.ratio = goal;
                return;
            }
        }
        let length = self.step_s();
        let width = (2.0 * length * self.state.ratio.clamp(0.02, 2.0)).max(1e-12 * (1.0 + self.end));
        self.planned_motion.set_width(width);
        let most = self.most_bend(length);
        if self.state.slope * direction < 0.0 || self.change.steps > MOST_STEPS {
            self.renew(length);
            if self.state.slope == 0.0 && self.change.steps > MOST_STEPS {
                // It stays where it is.
                self.change.ratio = self.state.ratio;
                return;
            }
            return self.follow(length, until);
        }
        let (first, first_s) = self.recovery_ramp.steps.last().copied().unwrap_or((0.0, length));
        let from = self.state;
        let boldest = self.within_jerk(&from, direction * most, most, length);
        let mut bend = boldest;
        let mut trial = self.trial(boldest, length, goal, direction, most);
        if trial == Trial::TooMuch {
            // Along a limit of the acceleration.
            let along = self.within_acceleration(&from, boldest, length);
            if self.trial(along, length, goal, direction, most) == Trial::Fine {
                (bend, trial) = (along, Trial::Fine);
            }
        }
        let mut too_far = trial == Trial::TooFar;
        if matches!(trial, Trial::TooMuch | Trial::TooFar) {
            // Between what surely can be done and what is too much.
            let (mut low, mut high) = (if first_s < length { 0.0 } else { first }, boldest);
            let mut found = None;
            if low == 0.0 && self.state.slope != 0.0 {
                // On as it goes, or else so that the feed scale is steady after this step.
                if self.trial(0.0, length, goal, direction, most) == Trial::Fine {
                    found = Some(0.0);
                } else {
                    (low, high) = (-self.state.slope / length, 0.0);
                }
            }
            // A long wait is looked at less closely.
            let creeping = self.state.slope.abs() * PARTS * length < 0.05 * self.change.size;
            let waiting = self.change.steps > LONG_WAIT && creeping;
            for _ in 0..if waiting { 2 } else { HALVINGS } {
                let middle = 0.5 * (low + high);
                let tried = self.trial(middle, length, goal, direction, most);
                too_far |= tried == Trial::TooFar;
                match tried {
                    Trial::Fine => (low, found) = (middle, Some(middle)),
                    Trial::TooMuch | Trial::TooFar => high = middle,
                    Trial::NoRoom => {
                        trial = tried;
                        break;
                    }
                }
            }
            if trial == Trial::NoRoom {
                self.close_change();
                return self.come_back();
            }
            let lands = too_far || found.is_none();
            if lands && self.land(goal, most, length) {
                return self.follow(length, until);
            }
            let every = if waiting { 24 } else { 3 };
            let deep = !too_far && goal <= 1.0 && self.change.steps % every == 1;
            if deep && self.fall(goal, direction, most, length) {
                return self.follow(length, until);
            }
            // What has begun as some bold steps goes on as such.
            let planned = self.recovery_ramp.steps.last().map_or(0.0, |&(bend, _)| bend * direction);
            if let Some(found) = found.filter(|found| found * direction > planned) {
                bend = found;
                // The recovery ramp is that of the last trial that was fine.
                trial = self.trial(bend, length, goal, direction, most);
            }
        }
        match trial {
            Trial::Fine => {
                std::mem::swap(&mut self.recovery_ramp.steps, &mut self.spare);
                self.recovery_ramp.ratio = f64::NAN;
                self.recovery_ramp.steps.push((bend, length));
                self.follow(length, until);
            }
            Trial::NoRoom => {
                // As far as it gets.
                self.close_change();
                self.come_back();
            }
            Trial::TooMuch | Trial::TooFar => self.follow(length, until),
        }
    }

    /// Shares above 1 are over: back to 1 as quickly as the limits allow.
    fn come_back(&mut self) {
        self.back = true;
        self.change.size = (self.state.ratio - 1.0).abs().max(0.2 * self.change.size);
        (self.change.asked_s, self.change.steps) = (0.0, 0);
    }

    /// Makes the recovery ramp the quickest there is, once a change: that of the change before may be a slow one.
    fn renew(&mut self, length: f64) {
        if std::mem::replace(&mut self.change.renewed, true) {
            return;
        }
        let free = FREE / (length * length) * self.change.size.max(self.state.ratio);
        let mut steps = std::mem::take(&mut self.spare);
        if let Some(end) = self.brake(self.state, free, length, &mut steps)
            && end.ratio >= 0.0
            && (end.ratio <= 1.0 || self.state.slope < 0.0)
        {
            self.recovery_ramp.ratio = end.ratio;
            std::mem::swap(&mut self.recovery_ramp.steps, &mut steps);
        }
        self.spare = steps;
    }

    /// Does the first step of the recovery ramp, or none at a steady ratio.
    fn follow(&mut self, length: f64, until: f64) {
        let (bend, whole) = self.recovery_ramp.steps.pop().unwrap_or((0.0, length));
        let left = until - self.state.t;
        let x = whole.min(left);
        self.push(bend);
        let mut next = self.state.after(bend, x);
        if next.tau >= self.end {
            let from = self.state;
            let (mut low, mut high) = (0.0, x);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if from.after(bend, middle).tau < self.end { low = middle } else { high = middle }
            }
            self.state = from.after(bend, high);
            self.total_s = Some(self.state.t);
            return;
        }
        if x < whole {
            self.recovery_ramp.steps.push((bend, whole - x));
            next.t = until;
        } else if self.recovery_ramp.steps.is_empty() {
            next.slope = 0.0;
            if (self.recovery_ramp.ratio - next.ratio).abs() < 1e-9 {
                next.ratio = self.recovery_ramp.ratio;
            }
        }
        next.tau = next.tau.max(self.state.tau);
        self.state = next;
    }
}
