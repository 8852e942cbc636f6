//! The machine: motor, screw and table under a voltage that switches at known times.
//!
//! Everything is referred to the motor shaft (rad, N m). Between events the machine is linear but for the friction's dependence on
//! speed, the ripple's on angle and the force's on time or place: its linear part is advanced exactly ([`ladder`]), with the
//! motor's extra torque as a cubic (values and slopes at both ends) and the table's as a straight line over the step. Both are
//! evaluated at a predicted end and corrected once (an exponential predictor-corrector; M. Hochbruck, A. Ostermann,
//! "Exponential integrators", Acta Numerica 19, 2010, section 2).
//!
//! Events end a step: the table comes to rest, breaks away, meets or leaves a side of the gap. A step in which one happens is halved
//! until it is 2⁻¹⁶ of the whole; then the machine changes its mode there. Linear modes: table free to move or stuck, screw in contact or
//! in the gap.

mod forces;
mod ladder;

use self::forces::{Bristle, Forces, Rub};
use self::ladder::{Column, LANES, LEVELS, Linear, MOTOR, PLACE, Step, TABLE, TORQUE, TWIST, add, halvings};
use super::AxisParameters;
use super::effects::Effects;

/// Steps are not made shorter than this level for accuracy alone.
const FINEST_FOR_ERROR: usize = 10;
/// Most attempted steps in one period: a machine that chatters gets its events where the steps happen to end.
const MOST_ATTEMPTS: u32 = 4000;

/// One stretch of the period under one voltage.
#[derive(Debug, Clone)]
struct Part {
    /// Steps in it, at the coarsest.
    pieces: u64,
    /// Where it begins in the period \[s\].
    begin_s: f64,
    /// The shortest step \[s\].
    tick_s: f64,
    /// Exact steps by mode: free in the gap or not (2), stuck or not (1).
    ladders: [Vec<Step>; 4],
}

/// The machine of one axis.
#[allow(clippy::struct_excessive_bools)] // what it has and what it is doing, independent of each other
#[derive(Debug, Clone)]
pub(super) struct Machine {
    linear: Linear,
    parts: [Part; 2],
    forces: Forces,
    /// What changes the speed of the table by more is a miss \[rad/s\].
    tolerance: f64,
    /// Half the gap \[rad\]; the gap is between two masses, or kinematic.
    half_gap: f64,
    flexible: bool,
    /// Whether the table's turning points are events.
    turns: bool,
    // State.
    z: Column,
    /// Where the screw rests on the gap: the twist is counted from there \[rad\].
    offset: f64,
    side: f64,
    free: bool,
    stuck: bool,
    /// Direction of motion, ±1.
    direction: f64,
    /// Bristles of the friction.
    bristle: Bristle,
    /// Table behind a kinematic gap \[rad\].
    follower: f64,
    /// Ripple \[N m\] and its rate \[N m/s\]; friction and force at the table \[N m\] and the rate of their sum.
    ripple: [f64; 2],
    friction: f64,
    force: f64,
    table_rate: f64,
    /// Where in its table the force was found.
    near: usize,
    /// Level at which the last part ended.
    level: usize,
}

/// Pieces of a part: few, and a whole number already.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(pieces: f64) -> u64 {
    pieces as u64
}

/// A step that was tried.
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

impl Machine {
    /// The machine at rest in the middle of its gap.
    ///
    /// - `switch_share`: the voltage switches at this share of the period (0: at its beginning)
    pub(super) fn new(
        axis: &AxisParameters,
        effects: &Effects,
        period_s: f64,
        switch_share: f64,
        start_mm: f64,
    ) -> Self {
        let drive = &axis.drive;
        let plant = effects.plant(&axis.plant);
        let r_g = drive.transmission_mm_rad;
        let forces = Forces::new(effects, drive, start_mm);
        let inertia = plant.inertia_kg_m2(drive);
        let table_inertia = effects.two_mass.map(|two_mass| two_mass.table_inertia_kg_m2(drive));
        let linear = Linear {
            torque_per_volt: 1.0 / drive.torque_to_voltage_v_nm,
            current_rate: effects.current_loop.map(|c| 2.0 * std::f64::consts::PI * c.bandwidth_hz),
            motor_inertia: inertia - table_inertia.unwrap_or(0.0),
            table_inertia,
            motor_viscous: plant.viscous_nm_s_rad(drive),
            table_viscous: effects.friction.map_or(0.0, |friction| friction.curve().viscous_nm_s_rad),
            stiffness: effects.two_mass.map_or(0.0, |two_mass| two_mass.stiffness_nm_rad(drive)),
            damping: effects.two_mass.map_or(0.0, |two_mass| two_mass.damping_nm_s_rad(drive)),
        };
        let resonance = effects.two_mass.map_or(0.0, |two_mass| two_mass.resonance_rad_s(&plant, drive));
        let half_gap = effects.backlash.map_or(0.0, |backlash| 0.5e-3 * backlash.gap_um / r_g);
        let flexible = table_inertia.is_some();
        let gapped = flexible && half_gap > 0.0;
        let sticks = matches!(forces.rub, Rub::Coulomb);
        let part = |begin_s: f64, length_s: f64| {
            // A step is at most a radian of the resonance, lest contact is lost and found again inside it.
            let swings = if gapped || sticks { (resonance * length_s).ceil() } else { 1.0 };
            let share = (f64::from(effects.integration.substeps) * length_s / period_s).ceil();
            let pieces = swings.max(share).max(1.0);
            let ladders = std::array::from_fn(|mode| {
                let (free, stuck) = (mode & 2 != 0, mode & 1 != 0);
                let needed = length_s > 0.0 && (!free || gapped) && (!stuck || sticks);
                if needed { linear.ladder(length_s / pieces, free, stuck) } else { Vec::new() }
            });
            Part {
                pieces: if length_s > 0.0 { whole(pieces) } else { 0 },
                begin_s,
                tick_s: length_s / pieces * halvings(LEVELS),
                ladders,
            }
        };
        let switch_s = switch_share * period_s;
        let mut machine = Self {
            linear,
            parts: [part(0.0, switch_s), part(switch_s, period_s - switch_s)],
            tolerance: effects.integration.tolerance_mm_s / r_g,
            half_gap,
            flexible,
            turns: sticks || (half_gap > 0.0 && !flexible),
            z: [0.0; LANES],
            offset: 0.0,
            side: 1.0,
            free: gapped,
            stuck: sticks,
            direction: 1.0,
            bristle: forces.at_rest(),
            follower: 0.0,
            ripple: [0.0; 2],
            friction: 0.0,
            force: 0.0,
            table_rate: 0.0,
            near: 0,
            level: 0,
            forces,
        };
        machine.ripple = machine.forces.ripple(0.0, 0.0);
        machine.force = machine.forces.force(0.0, 0.0, &mut 0);
        machine
    }

    /// Angle of the motor from the start \[rad\].
    #[inline(always)]
    pub(super) fn motor_rad(&self) -> f64 {
        self.z[PLACE] + (self.z[TWIST] + self.offset)
    }

    /// Speed of the motor \[rad/s\].
    #[inline(always)]
    pub(super) fn motor_rad_s(&self) -> f64 {
        self.z[MOTOR]
    }

    /// Place of the table from the start \[rad\].
    #[inline(always)]
    pub(super) fn table_rad(&self) -> f64 {
        if self.half_gap > 0.0 && !self.flexible { self.follower } else { self.z[PLACE] }
    }

    /// Speed of the table \[rad/s\] (of the screw, behind a kinematic gap).
    pub(super) fn table_rad_s(&self) -> f64 {
        self.z[TABLE]
    }

    /// Whether the table sticks.
    pub(super) fn stuck(&self) -> bool {
        self.stuck
    }

    /// Whether the table floats in the gap.
    pub(super) fn in_gap(&self) -> bool {
        self.free
    }

    /// Torque of the motor under a voltage \[N m\], without ripple.
    #[inline(always)]
    pub(super) fn torque(&self, voltage: f64) -> f64 {
        if self.linear.current_rate.is_some() { self.z[TORQUE] } else { self.linear.torque_per_volt * voltage }
    }

    /// Ripple of the motor's torque \[N m\].
    pub(super) fn ripple_nm(&self) -> f64 {
        self.ripple[0]
    }

    /// Cutting force as a torque at the motor \[N m\].
    pub(super) fn force_nm(&self) -> f64 {
        self.force
    }

    /// Friction on the table, positive where it pushes forward \[N m\].
    pub(super) fn friction_nm(&self, voltage: f64) -> f64 {
        if self.stuck { -self.hold(voltage) } else { self.friction - self.linear.table_viscous * self.z[TABLE] }
    }

    /// Torque from the screw onto the table \[N m\].
    #[inline(always)]
    fn spring(&self, z: &Column) -> f64 {
        self.linear.stiffness * z[TWIST] + self.linear.damping * (z[MOTOR] - z[TABLE])
    }

    /// Torque that acts on the table beside friction, were it at rest \[N m\].
    #[inline(always)]
    fn drives(&self, z: &Column, voltage: f64, ripple: f64, force: f64) -> f64 {
        let driven = if self.free {
            0.0
        } else if self.flexible {
            self.spring(z)
        } else if self.linear.current_rate.is_some() {
            z[TORQUE] + ripple
        } else {
            self.linear.torque_per_volt * voltage + ripple
        };
        driven + force
    }

    #[inline(always)]
    fn hold(&self, voltage: f64) -> f64 {
        self.drives(&self.z, voltage, self.ripple[0], self.force)
    }

    /// Rate of the table's speed times its inertia \[N m\], in motion.
    #[inline(always)]
    fn push(&self, z: &Column, voltage: f64, ripple: f64, table: f64) -> f64 {
        let viscous = if self.flexible {
            self.linear.table_viscous
        } else {
            self.linear.table_viscous + self.linear.motor_viscous
        };
        self.drives(z, voltage, ripple, table) - viscous * z[TABLE]
    }

    /// The side of the gap that a free screw has met, 0 for none.
    #[inline(always)]
    fn met(&self, z: &Column) -> f64 {
        let side = if z[TWIST] > 0.0 { 1.0 } else { -1.0 };
        let deep = side * z[TWIST] - self.half_gap;
        let closing = self.linear.damping * side * (z[MOTOR] - z[TABLE]);
        if deep >= 0.0 && self.linear.stiffness * deep + closing > 0.0 { side } else { 0.0 }
    }

    /// One period: the voltage of before, and from the switch on the other one.
    ///
    /// - `time_s`: when it begins
    #[inline(always)]
    pub(super) fn advance(&mut self, before_v: f64, after_v: f64, time_s: f64) {
        let mut attempts = 0;
        // Both parts through the same code, which is long.
        for (index, voltage) in [before_v, after_v].into_iter().enumerate() {
            let pieces = self.parts[index].pieces;
            if pieces > 0 {
                self.run(index, pieces, voltage, time_s, &mut attempts);
            }
        }
    }

    #[inline(always)]
    fn run(&mut self, index: usize, pieces: u64, voltage: f64, time_s: f64, attempts: &mut u32) {
        if self.stuck && self.hold(voltage).abs() > self.forces.static_nm {
            self.change(voltage);
        }
        let begin_s = time_s + self.parts[index].begin_s;
        let end = pieces << LEVELS;
        let tick_s = self.parts[index].tick_s;
        let mut near = self.near;
        let mut at = 0_u64;
        let mut level = self.level;
        while at < end {
            let mode = (usize::from(self.free) << 1) | usize::from(self.stuck);
            let size = 1_u64 << (LEVELS - level);
            let step = &self.parts[index].ladders[mode][level];
            let (h_s, end_s) = (step.h_s, begin_s + (at + size) as f64 * tick_s);
            let trial = self.attempt(step, voltage, end_s, level, &mut near);
            *attempts += 1;
            let rough = *attempts > MOST_ATTEMPTS;
            if (trial.event && level < LEVELS || trial.miss > 1.0 && level < FINEST_FOR_ERROR) && !rough {
                level = (level + if trial.event { trial.shorter() } else { 1 }).min(LEVELS);
                continue;
            }
            let before = self.friction + self.force;
            self.table_rate = (trial.friction + trial.force - before) / h_s;
            self.z = trial.z;
            self.ripple = trial.ripple;
            self.friction = trial.friction;
            self.force = trial.force;
            self.bristle = trial.bristle;
            if self.half_gap > 0.0 && !self.flexible {
                let place = self.z[PLACE];
                self.follower = self.follower.max(place - self.half_gap).min(place + self.half_gap);
            }
            at += size;
            if trial.event {
                self.change(voltage);
            }
            // Longer again, where the clock allows and the error is well below the tolerance.
            while level > 0 && trial.miss < 0.1 && at & ((1 << (LEVELS - level + 1)) - 1) == 0 {
                level -= 1;
                if level <= FINEST_FOR_ERROR {
                    break;
                }
            }
        }
        self.near = near;
        self.level = level.min(FINEST_FOR_ERROR);
    }

    /// Tries one step to `end_s`.
    #[inline(always)]
    fn attempt(&self, step: &Step, voltage: f64, end_s: f64, level: usize, near: &mut usize) -> Trial {
        let h = step.h_s;
        let start = self.friction + self.force;
        let foreseen = start + self.table_rate * h;
        let mut z = self.z;
        for (column, state) in step.state.iter().zip(self.z) {
            add(&mut z, column, state);
        }
        add(&mut z, &step.voltage, voltage);
        let rippled = self.forces.ripples();
        if rippled {
            add(&mut z, &step.motor[0], self.ripple[0]);
            add(&mut z, &step.motor[1], self.ripple[1] * h);
        }
        let mut trial = Trial {
            z,
            ripple: [0.0; 2],
            friction: 0.0,
            force: 0.0,
            bristle: self.bristle,
            miss: 0.0,
            event: false,
            when: 1.0,
        };
        let tabled = self.forces.acts_on_table();
        if tabled {
            add(&mut trial.z, &step.table[0], start);
            add(&mut trial.z, &step.table[1], foreseen - start);
        }
        if rippled {
            let angle = trial.z[PLACE] + (trial.z[TWIST] + self.offset);
            trial.ripple = self.forces.ripple(angle, trial.z[MOTOR]);
            let value = trial.ripple[0] - self.ripple[0] - self.ripple[1] * h;
            let slope = (trial.ripple[1] - self.ripple[1]) * h;
            // A cubic through both ends is right to a hundredth of what a straight line misses.
            trial.miss = 0.01 * (step.motor_end[0][MOTOR] * value).abs() / self.tolerance;
            add(&mut trial.z, &step.motor_end[0], value);
            add(&mut trial.z, &step.motor_end[1], slope);
        }
        if tabled {
            let from = self.z[TABLE];
            trial.force = self.forces.force(end_s, trial.z[PLACE], near);
            let gain = step.table[1][TABLE];
            (trial.friction, trial.bristle) = match self.forces.rub {
                Rub::None => (0.0, self.bristle),
                Rub::Coulomb if self.stuck => (0.0, self.bristle),
                Rub::Coulomb => (self.forces.slipping(self.direction, trial.z[TABLE]), self.bristle),
                Rub::LuGre => {
                    let known = foreseen - trial.force;
                    self.forces.bristles(&self.bristle, from, trial.z[TABLE], gain, known, h)
                }
            };
            let missed = trial.friction + trial.force - foreseen;
            let miss = (gain * missed).abs() / self.tolerance;
            trial.miss = if miss > trial.miss { miss } else { trial.miss };
            add(&mut trial.z, &step.table[1], missed);
        }
        self.look(&mut trial, voltage, h, level);
        trial
    }

    /// Whether something happens within a step, and about when: where a straight line between its ends would cross zero.
    #[inline(always)]
    fn look(&self, trial: &mut Trial, voltage: f64, h: f64, level: usize) {
        if self.stuck {
            let drives = self.drives(&trial.z, voltage, trial.ripple[0], trial.force).abs();
            if drives > self.forces.static_nm {
                let before = self.hold(voltage).abs();
                trial.found((self.forces.static_nm - before) / (drives - before));
            }
        } else if self.turns {
            let (from, to) = (self.direction * self.z[TABLE], self.direction * trial.z[TABLE]);
            if to < 0.0 {
                trial.found(from / (from - to));
            } else if level < FINEST_FOR_ERROR {
                // There and back within the step: a speed that bends upwards stays above its tangents at both ends.
                let falls = self.direction * self.push(&self.z, voltage, self.ripple[0], self.friction + self.force);
                let rises =
                    self.direction * self.push(&trial.z, voltage, trial.ripple[0], trial.friction + trial.force);
                if falls < 0.0 && rises > 0.0 {
                    let inertia = self.linear.table_inertia.unwrap_or(self.linear.motor_inertia);
                    let (falls, rises) = (falls / inertia, rises / inertia);
                    let at = (to - rises * h - from) / (falls - rises);
                    if from + falls * at < 0.0 {
                        trial.found(1.0);
                    }
                }
            }
        }
        if self.flexible && self.half_gap > 0.0 {
            if self.free {
                let side = self.met(&trial.z);
                if side != 0.0 {
                    let (before, after) = (side * self.z[TWIST], side * trial.z[TWIST]);
                    trial.found((self.half_gap - before) / (after - before));
                }
            } else {
                let after = self.side * self.spring(&trial.z);
                if after < 0.0 {
                    let before = self.side * self.spring(&self.z);
                    trial.found(before / (before - after));
                }
            }
        }
    }

    /// Changes the mode where an event has been located.
    #[inline(never)]
    fn change(&mut self, voltage: f64) {
        if self.flexible && self.half_gap > 0.0 {
            if self.free {
                let side = self.met(&self.z);
                if side != 0.0 {
                    self.free = false;
                    self.side = side;
                    self.offset = side * self.half_gap;
                    self.z[TWIST] -= self.offset;
                }
            } else if self.side * self.spring(&self.z) < 0.0 {
                self.free = true;
                self.z[TWIST] += self.offset;
                self.offset = 0.0;
            }
        }
        if matches!(self.forces.rub, Rub::Coulomb) {
            if !self.stuck && self.direction * self.z[TABLE] < 0.0 {
                self.z[TABLE] = 0.0;
                if !self.flexible {
                    self.z[MOTOR] = 0.0;
                }
                self.stuck = true;
            }
            let hold = self.hold(voltage);
            if self.stuck && hold.abs() > self.forces.static_nm {
                self.stuck = false;
                self.direction = hold.signum();
            }
            self.friction = if self.stuck { 0.0 } else { self.forces.slipping(self.direction, self.z[TABLE]) };
        } else if self.turns && self.direction * self.z[TABLE] < 0.0 {
            self.direction = -self.direction;
        }
        self.table_rate = 0.0;
    }
}
