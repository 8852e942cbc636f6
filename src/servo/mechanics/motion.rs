//! The machine in motion: whole periods where nothing happens, and the search for what does.

use super::forces::{Bristle, Rub};
use super::ladder::{Column, LEVELS, MOTOR, PLACE, Step, TABLE, TORQUE, TWIST, add};
use super::{Machine, State};
use crate::lane::{Kernel, vectorized};

/// Most attempted steps in one period: a machine that chatters gets its events where the steps happen to end.
const MOST_ATTEMPTS: u32 = 4000;
/// What a step over a whole period may miss by, in tolerances: it comes period after period, and is seen to add up (`tests/drive.rs`).
const MISS_OF_A_PERIOD: f64 = 0.3;

/// A step that was tried.
#[derive(Clone, Copy)]
struct Trial {
    z: Column,
    ripple: [f64; 2],
    friction: f64,
    force: f64,
    bristle: Bristle,
    /// How far the prediction missed, in tolerances.
    miss: f64,
    event: bool,
    /// At what share of the step, roughly.
    when: f64,
}

impl Trial {
    #[inline(always)]
    fn found(&mut self, when: f64) {
        self.event = true;
        self.when = if when < self.when { when } else { self.when };
    }

    /// By how many levels a step should be shorter to end before the event.
    #[inline(always)]
    fn shorter(&self) -> usize {
        let (mut levels, mut share) = (1, 0.5);
        while share > self.when && levels < LEVELS {
            share *= 0.5;
            levels += 1;
        }
        levels
    }
}

/// A period that is taken apart, compiled once for the machine that this runs on.
struct Apart<'m> {
    machine: &'m mut Machine,
    volts: [f64; 2],
    time_s: f64,
}

impl Kernel for Apart<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { machine, volts, time_s } = self;
        let mut attempts = 0;
        for (index, voltage) in volts.into_iter().enumerate() {
            let pieces = machine.parts[index].pieces;
            if pieces > 0 {
                machine.run(index, pieces, voltage, time_s, &mut attempts);
            }
        }
    }
}

#[cold]
#[inline(never)]
fn take_apart(machine: &mut Machine, volts: [f64; 2], time_s: f64) {
    vectorized(Apart { machine, volts, time_s });
}

impl Machine {
    /// One period: the voltage of before, and from the switch on the other one.
    ///
    /// - `time_s`: when it begins
    #[inline(always)]
    pub(in crate::servo) fn advance(&mut self, before_v: f64, after_v: f64, time_s: f64) {
        let volts = [before_v, after_v];
        if !self.at_once(volts, time_s) {
            take_apart(self, volts, time_s);
        }
    }

    /// One period in one step. Leaves everything as it is where that is too rough, or where something happens.
    #[inline(always)]
    fn at_once(&mut self, volts: [f64; 2], time_s: f64) -> bool {
        if !self.whole || self.level > 0 {
            return false;
        }
        if self.state.stuck {
            // Whether a rigid table breaks away hangs on the voltages themselves.
            let begins = if self.switches && !self.flexible { f64::INFINITY } else { self.hold(volts[1]).abs() };
            if !(begins <= self.forces.static_nm) {
                return false;
            }
        }
        let step = &self.wholes[self.mode()];
        let mut near = self.near;
        let trial = self.attempt(step, volts, time_s + self.period_s, 0, &mut near);
        if trial.event || !(trial.miss <= MISS_OF_A_PERIOD) {
            return false;
        }
        let h_s = step.h_s;
        self.take(&trial, h_s);
        self.near = near;
        true
    }

    #[inline(always)]
    fn mode(&self) -> usize {
        (usize::from(self.state.free) << 1) | usize::from(self.state.stuck)
    }

    #[inline(always)]
    fn hold(&self, voltage: f64) -> f64 {
        let state = &self.state;
        self.drives(state, &state.z, voltage, state.ripple[0], state.force)
    }

    /// Rate of the table's speed times its inertia \[N m\], in motion.
    #[inline(always)]
    fn push(&self, z: &Column, voltage: f64, ripple: f64, table: f64) -> f64 {
        let viscous = if self.flexible {
            self.linear.table_viscous
        } else {
            self.linear.table_viscous + self.linear.motor_viscous
        };
        self.drives(&self.state, z, voltage, ripple, table) - viscous * z[TABLE]
    }

    /// The side of the gap that a free screw has met, 0 for none.
    #[inline(always)]
    fn met(&self, z: &Column) -> f64 {
        let side = if z[TWIST] > 0.0 { 1.0 } else { -1.0 };
        let deep = side * z[TWIST] - self.half_gap;
        let closing = self.linear.damping * side * (z[MOTOR] - z[TABLE]);
        if deep >= 0.0 && self.linear.stiffness * deep + closing > 0.0 { side } else { 0.0 }
    }

    /// Goes where a step has led.
    #[inline(always)]
    fn take(&mut self, trial: &Trial, h_s: f64) {
        let state = &mut self.state;
        if self.forces.acts_on_table() {
            state.table_rate = (trial.friction + trial.force - (state.friction + state.force)) / h_s;
            state.friction = trial.friction;
            state.force = trial.force;
            state.bristle = trial.bristle;
        }
        state.z = trial.z;
        if self.forces.ripples() {
            state.ripple = trial.ripple;
        }
        if self.follows {
            let place = state.z[PLACE];
            state.follower = state.follower.max(place - self.half_gap).min(place + self.half_gap);
        }
    }

    #[inline(always)]
    fn run(&mut self, index: usize, pieces: u64, voltage: f64, time_s: f64, attempts: &mut u32) {
        if self.state.stuck && self.hold(voltage).abs() > self.forces.static_nm {
            self.change(voltage, 0.0);
        }
        let begin_s = time_s + self.parts[index].begin_s;
        let end = pieces << LEVELS;
        let tick_s = self.parts[index].tick_s;
        let mut near = self.near;
        let mut at = 0_u64;
        let mut level = self.level;
        while at < end {
            let size = 1_u64 << (LEVELS - level);
            let step = &self.parts[index].ladders[self.mode()][level];
            let (h_s, end_s) = (step.h_s, begin_s + (at + size) as f64 * tick_s);
            let trial = self.attempt(step, [voltage; 2], end_s, level, &mut near);
            *attempts += 1;
            let rough = *attempts > MOST_ATTEMPTS;
            if (trial.event || trial.miss > 1.0) && level < LEVELS && !rough {
                level = (level + if trial.event { trial.shorter() } else { 1 }).min(LEVELS);
                continue;
            }
            let from = self.state.z[TABLE];
            self.take(&trial, h_s);
            at += size;
            if trial.event {
                // How long ago the table came to rest, if it did.
                let to = trial.z[TABLE];
                let late_s = if from * to < 0.0 { h_s * to / (to - from) } else { 0.0 };
                self.change(voltage, late_s);
            }
            // Longer again, where the clock allows and the error is well below the tolerance.
            if level > 0 && trial.miss < 0.1 && at & ((1 << (LEVELS - level + 1)) - 1) == 0 {
                level -= 1;
            }
        }
        self.near = near;
        self.level = level;
    }

    /// Tries one step to `end_s`, under the voltages at its beginning and end.
    #[inline(always)]
    fn attempt(&self, step: &Step, volts: [f64; 2], end_s: f64, level: usize, near: &mut usize) -> Trial {
        let (state, h) = (&self.state, step.h_s);
        let start = state.friction + state.force;
        let foreseen = start + state.table_rate * h;
        let (rippled, tabled) = (self.forces.ripples(), self.forces.acts_on_table());
        let mut z = state.z;
        add(&mut z, &step.state[TABLE], state.z[TABLE]);
        if self.flexible {
            add(&mut z, &step.state[MOTOR], state.z[MOTOR]);
            add(&mut z, &step.state[TWIST], state.z[TWIST]);
        }
        if self.linear.current_rate.is_some() {
            add(&mut z, &step.state[TORQUE], state.z[TORQUE]);
        }
        if rippled {
            add(&mut z, &step.motor[0], state.ripple[0]);
            add(&mut z, &step.motor[1], state.ripple[1] * h);
        }
        if tabled {
            add(&mut z, &step.table[0], start);
            add(&mut z, &step.table[1], foreseen - start);
        }
        // The voltages are known last.
        if self.switches {
            add(&mut z, &step.voltage[0], volts[0]);
        }
        add(&mut z, &step.voltage[1], volts[1]);
        let mut trial = Trial {
            z,
            ripple: [0.0; 2],
            friction: 0.0,
            force: 0.0,
            bristle: state.bristle,
            miss: 0.0,
            event: false,
            when: 1.0,
        };
        if rippled {
            let angle = trial.z[PLACE] + (trial.z[TWIST] + state.offset);
            trial.ripple = self.forces.ripple(angle, trial.z[MOTOR]);
            let value = trial.ripple[0] - state.ripple[0] - state.ripple[1] * h;
            let slope = (trial.ripple[1] - state.ripple[1]) * h;
            // A cubic through both ends is right to a hundredth of what a straight line misses.
            trial.miss = 0.01 * (step.motor_end[0][MOTOR] * value).abs() / self.tolerance;
            add(&mut trial.z, &step.motor_end[0], value);
            add(&mut trial.z, &step.motor_end[1], slope);
        }
        if tabled {
            let from = state.z[TABLE];
            trial.force = self.forces.force(end_s, trial.z[PLACE], near);
            let gain = step.table[1][TABLE];
            (trial.friction, trial.bristle) = match self.forces.rub {
                Rub::None => (0.0, state.bristle),
                Rub::Coulomb if state.stuck => (0.0, state.bristle),
                Rub::Coulomb => (self.forces.slipping(state.direction, trial.z[TABLE]), state.bristle),
                Rub::LuGre => {
                    let known = foreseen - trial.force;
                    self.forces.bristles(&state.bristle, from, trial.z[TABLE], gain, known, h)
                }
            };
            let missed = trial.friction + trial.force - foreseen;
            let miss = (gain * missed).abs() / self.tolerance;
            trial.miss = if miss > trial.miss { miss } else { trial.miss };
            add(&mut trial.z, &step.table[1], missed);
        }
        self.look(state, &mut trial, volts, h, level);
        trial
    }

    /// Whether something happens within a step, and about when: where a straight line between its ends would cross zero.
    #[inline(always)]
    fn look(&self, state: &State, trial: &mut Trial, volts: [f64; 2], h: f64, level: usize) {
        if state.stuck {
            let drives = self.drives(state, &trial.z, volts[1], trial.ripple[0], trial.force).abs();
            if drives > self.forces.static_nm {
                let before = self.hold(volts[0]).abs();
                trial.found((self.forces.static_nm - before) / (drives - before));
            }
        } else if self.turns {
            let (from, to) = (state.direction * state.z[TABLE], state.direction * trial.z[TABLE]);
            if to < 0.0 {
                trial.found(from / (from - to));
            } else if level < LEVELS {
                let inertia = self.linear.table_inertia.unwrap_or(self.linear.motor_inertia);
                let falls =
                    state.direction * self.push(&state.z, volts[0], state.ripple[0], state.friction + state.force);
                let rises =
                    state.direction * self.push(&trial.z, volts[1], trial.ripple[0], trial.friction + trial.force);
                if dips([from * inertia, to * inertia], [falls * h, rises * h]) {
                    trial.found(1.0);
                }
            }
        }
        if self.gapped {
            if state.free {
                let side = self.met(&trial.z);
                if side != 0.0 {
                    let (before, after) = (side * state.z[TWIST], side * trial.z[TWIST]);
                    trial.found((self.half_gap - before) / (after - before));
                }
            } else {
                let (before, after) = (state.side * self.spring(&state.z), state.side * self.spring(&trial.z));
                if after < 0.0 {
                    trial.found(before / (before - after));
                } else if level < LEVELS {
                    let opening = |z: &Column| state.side * self.linear.stiffness * (z[MOTOR] - z[TABLE]) * h;
                    if dips([before, after], [opening(&state.z), opening(&trial.z)]) {
                        trial.found(1.0);
                    }
                }
            }
        }
    }

    /// Changes the mode where an event has been located.
    ///
    /// - `late_s`: how long ago the table came to rest
    #[inline(never)]
    fn change(&mut self, voltage: f64, late_s: f64) {
        if self.gapped {
            let side = self.met(&self.state.z);
            let spring = self.spring(&self.state.z);
            let state = &mut self.state;
            if state.free {
                if side != 0.0 {
                    state.free = false;
                    state.side = side;
                    state.offset = side * self.half_gap;
                    state.z[TWIST] -= state.offset;
                }
            } else if state.side * spring < 0.0 {
                state.free = true;
                state.z[TWIST] += state.offset;
                state.offset = 0.0;
            }
        }
        if matches!(self.forces.rub, Rub::Coulomb) {
            let stops = !self.state.stuck && self.state.direction * self.state.z[TABLE] < 0.0;
            if stops {
                // What it has gone since then, it has not.
                self.set_speed(0.0, -0.5 * self.state.z[TABLE] * late_s);
                self.state.stuck = true;
            }
            let hold = self.hold(voltage);
            if self.state.stuck && hold.abs() > self.forces.static_nm {
                self.state.stuck = false;
                self.state.direction = hold.signum();
                if stops {
                    // It went back at once, and has had some time for it.
                    let inertia = self.linear.table_inertia.unwrap_or(self.linear.motor_inertia);
                    let speed = (hold - self.state.direction * self.forces.static_nm) / inertia * late_s;
                    self.set_speed(speed, 0.5 * speed * late_s);
                }
            }
            self.state.friction =
                if self.state.stuck { 0.0 } else { self.forces.slipping(self.state.direction, self.state.z[TABLE]) };
        } else if self.turns && self.state.direction * self.state.z[TABLE] < 0.0 {
            self.state.direction = -self.state.direction;
        }
        self.state.table_rate = 0.0;
    }

    /// Gives the table another speed, a little further on; the motor stays where it is, if it can.
    fn set_speed(&mut self, speed: f64, further: f64) {
        let z = &mut self.state.z;
        z[TABLE] = speed;
        z[PLACE] += further;
        if self.flexible { z[TWIST] -= further } else { z[MOTOR] = speed }
    }
}

/// Whether what is not negative at both ends of a step may be so inside: where it bends upwards it stays above its tangents, and they
/// meet below zero.
///
/// - `change`: its rates at the ends, times the length of the step
#[inline(always)]
fn dips(ends: [f64; 2], change: [f64; 2]) -> bool {
    let ([from, to], [falls, rises]) = (ends, change);
    if !(falls < 0.0 && rises > 0.0) {
        return false;
    }
    // from + falls x = to - rises (1 - x), times the positive rises - falls.
    from * (rises - falls) + falls * (from - to + rises) < 0.0
}
