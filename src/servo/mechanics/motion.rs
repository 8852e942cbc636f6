//! The machine in motion: whole periods where nothing happens, and the search for what does.

use super::forces::{Bristle, Force, FrictionModel};
use super::grid::{ANGLE, Column, MOTOR, PLACE, SPRING, Step, TABLE, TICKS, TORQUE, TWIST, add};
use super::{Machine, State};
use crate::lane::{Kernel, narrow};

/// Most attempted steps in one period: a machine that chatters gets its events where the steps happen to end.
const MOST_ATTEMPTS: u32 = 4000;
/// What a step over a whole period may miss by, in tolerances: it comes period after period, and is seen to add up
/// (`tests/servo/drive.rs`).
const MISS_OF_A_PERIOD: f64 = 0.3;

/// Most passes over stiff bristles in one step, and what speed, in tolerances, asks for another one.
const MOST_PASSES: usize = 6;
const PASS_AGAIN: f64 = 0.1;

/// A step that was tried.
#[derive(Clone, Copy)]
struct Trial {
    z: Column,
    ripple: [f64; 3],
    friction: f64,
    steep: f64,
    force: Force,
    bristle: Bristle,
    /// What accelerates the table at both ends \[N m\].
    pushes: [f64; 2],
    /// What is left out, in tolerances.
    miss: f64,
    event: bool,
    /// At what share of the step.
    when: f64,
}

impl Trial {
    #[inline(always)]
    fn found(&mut self, when: f64) {
        self.event = true;
        self.when = if when < self.when { when } else { self.when };
    }

    /// Something has fallen below zero, or may have.
    #[inline(always)]
    fn falls(&mut self, ends: [f64; 2], change: [f64; 2]) {
        if ends[1] < 0.0 {
            self.found(crossing(ends, change));
        } else if dips(ends, change) {
            self.found(0.5);
        }
    }
}

/// What the friction at the end of a step hangs on.
struct Foreseen {
    /// Speed of the table, before the motor's torque at the end is known \[rad/s\].
    speed: f64,
    /// What that torque adds to it.
    faster: f64,
    /// Torque of the screw, with that \[N m\].
    spring: f64,
}

/// How many ticks end just behind an event.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // few, and a whole number already
fn behind(event_ticks: f64) -> usize {
    let ticks = (event_ticks + 0.1).ceil() as usize;
    ticks.clamp(1, TICKS)
}

/// A period that is taken apart, compiled once for the machine that this runs on.
struct Apart<'m> {
    machine: &'m mut Machine,
    volts: [f64; 2],
    time_s: f64,
    /// When in it something seems to happen.
    event_s: f64,
}

impl Kernel for Apart<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { machine, volts, time_s, event_s } = self;
        let mut attempts = 0;
        for (index, voltage) in volts.into_iter().enumerate() {
            if machine.parts[index].ticks > 0 {
                machine.run(index, voltage, time_s, event_s, &mut attempts);
            }
        }
    }
}

#[cold]
#[inline(never)]
fn take_apart(machine: &mut Machine, volts: [f64; 2], time_s: f64, event_s: f64) {
    narrow(Apart { machine, volts, time_s, event_s });
}

impl Machine {
    /// One period under the voltage until the switch, and the one from there on.
    ///
    /// - `time_s`: when it begins
    #[inline(always)]
    pub(in crate::servo) fn advance(&mut self, volts: [f64; 2], time_s: f64) {
        if let Err(event_s) = self.at_once(volts, time_s) {
            take_apart(self, volts, time_s, event_s);
        }
    }

    /// One period in one step. Leaves everything as it is where that is too rough, or where something happens, and tells when (or
    /// that it does not know).
    #[inline(always)]
    fn at_once(&mut self, volts: [f64; 2], time_s: f64) -> Result<(), f64> {
        if !self.whole || self.longest < TICKS {
            return Err(f64::INFINITY);
        }
        if self.state.stuck {
            // Whether a rigid table breaks away hangs on the voltages themselves.
            let begins = if self.switches && !self.flexible { f64::INFINITY } else { self.hold(volts[1]).abs() };
            if !(begins <= self.forces.static_nm) {
                return Err(f64::INFINITY);
            }
        }
        let step = &self.wholes[self.mode()];
        let mut near = self.near;
        // The earlier voltage has gone where the period begins with a new one.
        let volts = if self.switches { volts } else { [volts[1]; 2] };
        let trial = self.attempt(step, volts, time_s + self.period_s, TICKS, &mut near);
        if trial.event {
            return Err(trial.when * self.period_s);
        }
        if !(trial.miss <= MISS_OF_A_PERIOD) {
            return Err(f64::INFINITY);
        }
        let h_s = step.h_s;
        self.take(&trial, h_s);
        self.near = near;
        Ok(())
    }

    #[inline(always)]
    fn mode(&self) -> usize {
        (usize::from(self.state.free) << 1) | usize::from(self.state.stuck)
    }

    #[inline(always)]
    fn hold(&self, voltage: f64) -> f64 {
        let state = &self.state;
        self.drives(&state.z, voltage, state.ripple[0], state.force.torque)
    }

    /// Rate of the table's speed times its inertia \[N m\], in motion.
    #[inline(always)]
    fn push(&self, z: &Column, voltage: f64, ripple: f64, table: f64) -> f64 {
        self.drives(z, voltage, ripple, table) - self.viscous * z[TABLE]
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
        if self.loaded {
            if self.bristles {
                state.rub_rate = (trial.friction - state.friction) / h_s;
                state.bristle = trial.bristle;
            }
            state.friction = trial.friction;
            state.steep = trial.steep;
            state.force = trial.force;
        }
        state.z = trial.z;
        if self.forces.ripples() {
            state.ripple = trial.ripple;
        }
        if self.follows {
            state.follow(state.z[PLACE], self.half_gap);
        }
    }

    #[inline(always)]
    fn run(&mut self, index: usize, voltage: f64, time_s: f64, event_s: f64, attempts: &mut u32) {
        if self.state.stuck && self.hold(voltage).abs() > self.forces.static_nm {
            self.change(voltage, 0.0);
        }
        let (begin_s, tick_s) = (time_s + self.parts[index].begin_s, self.parts[index].tick_s);
        let event_s = event_s - self.parts[index].begin_s;
        let mut to_event =
            if event_s > 0.0 && event_s < TICKS as f64 * tick_s { behind(event_s / tick_s) } else { TICKS };
        let mut near = self.near;
        let mut left = self.parts[index].ticks;
        while left > 0 {
            let ticks = left.min(self.longest).min(to_event);
            let step = &self.parts[index].grids[self.mode()][ticks - 1];
            let end_s = begin_s + (self.parts[index].ticks - left + ticks) as f64 * tick_s;
            let trial = self.attempt(step, [voltage; 2], end_s, ticks, &mut near);
            *attempts += 1;
            if ticks > 1 && *attempts <= MOST_ATTEMPTS {
                if trial.miss > 1.0 {
                    self.longest = ticks / 2;
                }
                to_event = if trial.event { behind(trial.when * ticks as f64).min(ticks) } else { ticks };
                if self.longest.min(to_event) < ticks {
                    continue;
                }
            }
            let h_s = step.h_s;
            self.take(&trial, h_s);
            left -= ticks;
            if trial.event {
                self.change(voltage, ((1.0 - trial.when) * h_s).min(tick_s));
            }
            to_event = TICKS;
            // Longer again, where the error is well below the tolerance.
            if trial.miss < 0.1 {
                self.longest = if trial.miss < 0.01 { TICKS } else { TICKS.min(self.longest.max(ticks) * 2) };
            }
        }
        self.near = near;
    }

    /// Tries one step to `end_s`, under the voltages at its beginning and end.
    #[inline(always)]
    fn attempt(&self, step: &Step, volts: [f64; 2], end_s: f64, ticks: usize, near: &mut usize) -> Trial {
        let (state, h) = (&self.state, step.h_s);
        let (rippled, loaded) = (self.forces.ripples(), self.loaded);
        // Ripple over the step's time: its acceleration's share of the curvature is left out, and counted as a miss.
        let turn = state.z[MOTOR] * h;
        let waves = [state.ripple[0], state.ripple[1] * turn, state.ripple[2] * (turn * turn)];
        let start = state.friction + state.force.torque;
        let turning = self.turns && !state.stuck;
        let pushed = if turning { self.push(&state.z, volts[0], state.ripple[0], start) } else { 0.0 };
        // Over time the force is known; over the place it is foreseen from the speed.
        let mut force = state.force;
        let mut rise = 0.0;
        if self.by_place {
            rise = state.force.slope * state.z[TABLE] * h;
        } else if loaded {
            force = self.forces.force(end_s, 0.0, near);
            rise = force.torque - state.force.torque;
        }
        let rate = state.steep.mul_add(pushed * self.lightness, state.rub_rate).mul_add(h, rise);
        let mut z = state.z;
        add(&mut z, &step.state[TABLE], state.z[TABLE]);
        if self.flexible {
            add(&mut z, &step.state[MOTOR], state.z[MOTOR]);
            add(&mut z, &step.state[TWIST], state.z[TWIST]);
        }
        if self.lags {
            add(&mut z, &step.state[TORQUE], state.z[TORQUE]);
        }
        if rippled {
            add(&mut z, &step.motor[0], waves[0]);
            add(&mut z, &step.motor[1], waves[1]);
            add(&mut z, &step.motor[2], waves[2]);
        }
        if loaded {
            add(&mut z, &step.table[0], start);
            add(&mut z, &step.table[1], rate);
        }
        // The voltages are known last.
        if self.switches {
            add(&mut z, &step.voltage[0], volts[0]);
        }
        add(&mut z, &step.voltage[1], volts[1]);
        let mut trial = Trial {
            z,
            ripple: [0.0; 3],
            friction: 0.0,
            steep: 0.0,
            force,
            bristle: Bristle::NONE,
            pushes: [pushed, 0.0],
            miss: 0.0,
            event: false,
            when: 1.0,
        };
        // What the friction hangs on is foreseen here, and corrected beside the state: the shortest way to it.
        let mut foreseen = Foreseen { speed: z[TABLE], faster: 0.0, spring: z[SPRING] };
        if rippled {
            trial.ripple = self.forces.ripple(trial.z[ANGLE]);
            let last = trial.z[MOTOR] * h;
            // The acceleration's share of the curvature, at both ends: known now.
            let gained = last - turn;
            let bent = state.ripple[1] * gained;
            let along = waves[2] + bent;
            let [value, slope] = [trial.ripple[0], trial.ripple[1] * last];
            let curvature = trial.ripple[1].mul_add(gained, trial.ripple[2] * (last * last));
            let ends = [value - (waves[0] + (waves[1] + 0.5 * along)), slope - (waves[1] + along), curvature - along];
            // What the quintic misses of a wave, what the acceleration and the foreseen angle do.
            let square = last * last;
            let further = step.motor_end[0][ANGLE] * ends[0];
            let astray = further.abs() + gained.abs() * (1.0 / 1200.0);
            let missed = self.forces.sixth.mul_add(square * square * square, self.forces.steep * astray);
            trial.miss = step.motor[0][MOTOR] * missed * self.per_tolerance;
            let [value, slope, curvature] = &step.motor_end;
            for (column, factor) in [(&step.motor[2], bent), (value, ends[0]), (slope, ends[1]), (curvature, ends[2])] {
                add(&mut trial.z, column, factor);
                foreseen.faster = column[TABLE].mul_add(factor, foreseen.faster);
                foreseen.spring = column[SPRING].mul_add(factor, foreseen.spring);
            }
        }
        if loaded {
            self.load(state, &mut trial, step, volts[1], [start, rate, rise], &foreseen, near);
        }
        if turning {
            let table = trial.friction + trial.force.torque;
            trial.pushes[1] = self.push(&trial.z, volts[1], trial.ripple[0], table);
        }
        self.look(state, &mut trial, volts, h, ticks);
        trial
    }

    /// Friction and force at the end of a step, and what they are more than carried on.
    ///
    /// - `carried`: their sum at the beginning, its increase and the force's
    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // one piece of `attempt`
    fn load(
        &self,
        state: &State,
        trial: &mut Trial,
        step: &Step,
        voltage: f64,
        carried: [f64; 3],
        foreseen: &Foreseen,
        near: &mut usize,
    ) {
        let ([start, rate, rise], h) = (carried, step.h_s);
        let (mut last_rise, mut along) = (rise, h);
        if self.by_place {
            trial.force = self.forces.force(0.0, trial.z[PLACE], near);
            last_rise = trial.force.slope * trial.z[TABLE] * h;
            along = trial.z[PLACE] - state.z[PLACE];
        }
        // By how much the force has left its line: what a corner inside of the step does is at most half of it.
        let corner = state.force.slope.mul_add(-along, trial.force.torque - state.force.torque).abs();
        let known = start + rate - trial.force.torque;
        let missed = if self.bristles {
            // Bristles are stiff: a straight line, solved with the speed.
            let gain = step.table[1][TABLE];
            let free_speed = gain.mul_add(-known, trial.z[TABLE]);
            let mut about = trial.z[TABLE];
            for _ in 0..MOST_PASSES {
                let (friction, bristle, speed) =
                    self.forces.bristles(&state.bristle, state.z[TABLE], about, free_speed, gain, h);
                (trial.friction, trial.bristle) = (friction, bristle);
                let apart = (speed - about).abs() * self.per_tolerance;
                about = speed;
                if !(apart > PASS_AGAIN) {
                    break;
                }
            }
            let value = trial.friction - known;
            add(&mut trial.z, &step.table[1], value);
            (gain * value).abs().max(step.table[0][TABLE] * (0.5 * corner))
        } else {
            // At the foreseen speed, and from there along the tangent.
            let column = &step.table_end[0];
            let gain = column[TABLE];
            let [friction, steep] = if self.forces.friction_model == FrictionModel::None || state.stuck {
                [0.0; 2]
            } else {
                self.forces.slipping(state.direction, foreseen.speed)
            };
            let share = if steep == 0.0 { 1.0 } else { 1.0 / (1.0 - gain * steep) };
            let value = (steep.mul_add(foreseen.faster, friction) - known) * share;
            let moved = gain.mul_add(value, foreseen.faster);
            (trial.friction, trial.steep) = (steep.mul_add(moved, friction), steep);
            add(&mut trial.z, column, value);
            let mut slope = last_rise - rate;
            if steep != 0.0 {
                // What pushes the table at the end; `value` comes late, and has a part in the friction, the screw and the speed.
                let mut with = gain * (steep - self.viscous);
                let mut driven = self.torque(&trial.z, voltage) + trial.ripple[0];
                if self.flexible {
                    (with, driven) = (with + column[SPRING], foreseen.spring);
                }
                let beside = steep.mul_add(foreseen.faster, friction) + trial.force.torque;
                let acting = self.viscous.mul_add(-(foreseen.speed + foreseen.faster), driven + beside);
                let bends = steep * self.lightness * h;
                slope = bends.mul_add(with.mul_add(value, acting), slope);
            }
            add(&mut trial.z, &step.table_end[1], slope);
            // What a cubic misses (a 720th of the fourth derivative; the third shows, and the fourth is taken to be a quarter of it,
            // `tests/servo/drive_slides.rs`), and what bends of the curve and corners do.
            let shape = (slope - 2.0 * value).abs() * (1.0 / 480.0);
            let bend = self.forces.sharpest * (moved * moved);
            step.table[0][TABLE] * (shape + bend + 0.5 * corner)
        };
        let miss = missed * self.per_tolerance;
        trial.miss = if miss > trial.miss { miss } else { trial.miss };
    }

    /// Whether something happens within a step, and when.
    #[inline(always)]
    fn look(&self, state: &State, trial: &mut Trial, volts: [f64; 2], h: f64, ticks: usize) {
        if state.stuck {
            let drives = self.drives(&trial.z, volts[1], trial.ripple[0], trial.force.torque);
            if drives.abs() > self.forces.static_nm {
                let side = drives.signum();
                let ends = [self.forces.static_nm - side * self.hold(volts[0]), self.forces.static_nm - side * drives];
                let rates = if self.flexible {
                    [&state.z, &trial.z].map(|z| -side * self.linear.stiffness * z[MOTOR] * h)
                } else {
                    [ends[1] - ends[0]; 2]
                };
                trial.found(crossing(ends, rates));
            }
        } else if self.turns {
            let ends = [state.direction * state.z[TABLE], state.direction * trial.z[TABLE]];
            let rates = trial.pushes.map(|push| state.direction * push);
            if ends[1] < 0.0 || ticks > 1 && bends_upwards(rates) {
                trial.falls(ends, rates.map(|rate| rate * (self.lightness * h)));
            }
        }
        if self.gapped {
            if state.free {
                let side = self.met(&trial.z);
                if side != 0.0 {
                    let ends = [&state.z, &trial.z].map(|z| self.half_gap - side * z[TWIST]);
                    let rates = [&state.z, &trial.z].map(|z| -side * (z[MOTOR] - z[TABLE]) * h);
                    trial.found(crossing(ends, rates));
                }
            } else {
                let ends = [&state.z, &trial.z].map(|z| state.side * z[SPRING]);
                let rates = [&state.z, &trial.z].map(|z| state.side * (z[MOTOR] - z[TABLE]));
                if ends[1] < 0.0 || ticks > 1 && bends_upwards(rates) {
                    trial.falls(ends, rates.map(|rate| rate * (self.linear.stiffness * h)));
                }
            }
        }
    }

    /// Changes the mode where an event has been located.
    ///
    /// - `late_s`: how long ago it was
    #[inline(never)]
    fn change(&mut self, voltage: f64, late_s: f64) {
        if self.gapped {
            let side = self.met(&self.state.z);
            let spring = self.state.z[SPRING];
            if self.state.free {
                if side != 0.0 {
                    let state = &mut self.state;
                    state.free = false;
                    state.side = side;
                    state.offset = side * self.half_gap;
                    state.z[TWIST] -= state.offset;
                    // The screw has pushed since then.
                    let first = self.linear.damping * (state.z[MOTOR] - state.z[TABLE]);
                    self.transfer(first, self.linear.spring(&self.state.z), late_s);
                }
            } else if self.state.side * spring < 0.0 {
                // It has not pulled since then.
                self.transfer(0.0, -spring, late_s);
                let state = &mut self.state;
                state.free = true;
                state.z[TWIST] += state.offset;
                state.offset = 0.0;
                self.derive();
            }
        }
        if matches!(self.forces.friction_model, FrictionModel::Coulomb) {
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
                // It went at once, and has had some time for it; a table that was at rest under a growing torque, half as much.
                let more = (hold - self.state.direction * self.forces.static_nm) * self.lightness;
                let (speed, further) = if stops { (more, 0.5 * more) } else { (0.5 * more, more / 6.0) };
                self.set_speed(speed * late_s, further * (late_s * late_s));
            }
            [self.state.friction, self.state.steep] = if self.state.stuck {
                [0.0; 2]
            } else {
                self.forces.slipping(self.state.direction, self.state.z[TABLE])
            };
        } else if self.turns && self.state.direction * self.state.z[TABLE] < 0.0 {
            // Further than here it has been when it turned.
            let furthest = self.state.z[PLACE] - 0.5 * self.state.z[TABLE] * late_s;
            self.state.follow(furthest, self.half_gap);
            self.state.direction = -self.state.direction;
        }
    }

    /// Lets the screw push the table for `late_s` with a torque that runs straight from `first` to `last`.
    fn transfer(&mut self, first: f64, last: f64, late_s: f64) {
        let lightness = if self.state.stuck { 0.0 } else { self.lightness };
        let (motor_lightness, z) = (1.0 / self.linear.motor_inertia, &mut self.state.z);
        let impulse = 0.5 * (first + last) * late_s;
        let further = (first * (1.0 / 3.0) + last * (1.0 / 6.0)) * (late_s * late_s);
        z[MOTOR] -= impulse * motor_lightness;
        z[TABLE] += impulse * lightness;
        z[PLACE] += further * lightness;
        z[TWIST] -= further * (lightness + motor_lightness);
        self.derive();
    }

    /// Gives the table another speed, a little further on; the motor stays where it is, if it can.
    fn set_speed(&mut self, speed: f64, further: f64) {
        let z = &mut self.state.z;
        z[TABLE] = speed;
        z[PLACE] += further;
        if self.flexible {
            z[TWIST] -= further
        } else {
            z[MOTOR] = speed
        }
        self.derive();
    }
}

/// At what share of a step the cubic through what is not negative at its beginning and negative at its end falls below zero.
///
/// - `change`: its rates at the ends, times the length of the step
#[cold]
fn crossing(ends: [f64; 2], change: [f64; 2]) -> f64 {
    let ([from, to], [first, last]) = (ends, change);
    let square = 3.0 * (to - from) - 2.0 * first - last;
    let cube = first + last - 2.0 * (to - from);
    let (mut low, mut high) = (0.0, 1.0);
    let mut x = from / (from - to);
    for _ in 0..3 {
        let value = from + x * (first + x * (square + x * cube));
        let slope = first + x * (2.0 * square + x * (3.0 * cube));
        if value > 0.0 {
            low = x
        } else {
            high = x
        }
        let newton = x - value / slope;
        x = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    x
}

/// Whether what changes at these rates has a lowest point between.
#[inline(always)]
fn bends_upwards([falls, rises]: [f64; 2]) -> bool {
    falls < 0.0 && rises > 0.0
}

/// Whether what is not negative at both ends of a step and has a lowest point between may be negative there: it stays above its
/// tangents, and they meet below zero.
///
/// - `change`: its rates at the ends, times the length of the step
#[inline(always)]
fn dips(ends: [f64; 2], change: [f64; 2]) -> bool {
    let ([from, to], [falls, rises]) = (ends, change);
    // from + falls x = to - rises (1 - x), times the positive rises - falls.
    from * (rises - falls) + falls * (from - to + rises) < 0.0
}
