//! The machine: motor, screw and table under a voltage that switches at known times.
//!
//! Everything is referred to the motor shaft (rad, N m). Between events the machine is linear but for the friction's dependence on
//! speed, the ripple's on angle and the force's on time or place: its linear part is advanced exactly ([`grid`]), with the
//! motor's extra torque as a quintic over the step (values, slopes and curvatures at both ends) and the table's as a cubic. Both are
//! evaluated at a predicted end and corrected once (an exponential predictor-corrector; M. Hochbruck, A. Ostermann,
//! "Exponential integrators", Acta Numerica 19, 2010, section 2); bristles go along a straight line, solved with the speed.
//!
//! Events end a step: the table comes to rest, breaks away, meets or leaves a side of the gap. A step in which one happens is cut
//! where a cubic says that it did, to a 32nd of the whole; then the machine changes its mode, and what the other mode's torque would
//! have done since then is made up for. Linear modes: table free to move or stuck, screw in contact or in the backlash.
//!
//! Nearly every period is one step, its voltages with it; one in which something happens, or that was foreseen badly, is taken
//! apart ([`motion`]).

mod forces;
mod grid;
mod linear;
mod motion;

use self::forces::{Bristle, Force, Forces, FrictionModel};
use self::grid::{ANGLE, Column, LANES, Linear, MOTOR, PLACE, SPRING, Step, TABLE, TICKS, TORQUE, TWIST};
pub(crate) use self::linear::LinearMachine;
use super::AxisParameters;
use super::effects::Effects;

/// Most radians of the resonance in a step of a machine with events, lest one comes and goes inside it.
const SWING: f64 = 1.1;

/// One stretch of the period under one voltage.
#[derive(Debug, Clone)]
struct Part {
    /// Ticks in it: [`TICKS`] for every step at the coarsest.
    ticks: usize,
    /// Where it begins in the period \[s\].
    begin_s: f64,
    tick_s: f64,
    /// Exact steps by mode, over 1, 2, … ticks: free in the backlash or not (2), stuck or not (1).
    grids: [Vec<Step>; 4],
}

/// What the machine is doing.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct State {
    z: Column,
    /// Where the screw rests on the gap: the twist is counted from there \[rad\].
    offset: f64,
    side: f64,
    /// Direction of motion, ±1.
    direction: f64,
    /// Bristles of the friction.
    bristle: Bristle,
    /// Table behind a kinematic gap \[rad\].
    follower: f64,
    /// Ripple \[N m\], its slope \[N m/rad\] and curvature \[N m/rad²\]; friction \[N m\], its derivative by the
    /// speed \[N m s/rad\], and the rate of bristles \[N m/s\]; force.
    ripple: [f64; 3],
    friction: f64,
    steep: f64,
    rub_rate: f64,
    force: Force,
    free: bool,
    stuck: bool,
}

impl State {
    /// Angle of the motor from the start \[rad\].
    #[inline(always)]
    pub(super) fn motor_rad(&self) -> f64 {
        // Not that which comes with the states: it has roundings of its own, and over days they would add up.
        self.z[PLACE] + (self.z[TWIST] + self.offset)
    }

    /// Speed of the motor \[rad/s\].
    #[inline(always)]
    pub(super) fn motor_rad_s(&self) -> f64 {
        self.z[MOTOR]
    }

    /// The table behind a kinematic gap, when the screw has been at `place`.
    #[inline(always)]
    fn follow(&mut self, place: f64, half_gap: f64) {
        self.follower = self.follower.max(place - half_gap).min(place + half_gap);
    }
}

/// The machine of one axis.
#[allow(clippy::struct_excessive_bools)] // what it has, independent of each other
#[derive(Debug, Clone)]
pub(super) struct Machine {
    pub(super) state: State,
    /// Ticks of the longest step that the tolerance allows.
    longest: usize,
    /// Where in its table the force was found.
    near: usize,
    forces: Forces,
    linear: Linear,
    /// What changes the speed of the table by more than the inverse is a miss \[s/rad\].
    per_tolerance: f64,
    /// Inverse of the table's inertia, or of all \[1/(kg m²)\].
    lightness: f64,
    /// Viscous friction of what rubs: the table, or all \[N m s/rad\].
    viscous: f64,
    /// Half the gap \[rad\]; the gap is between two masses, or kinematic.
    half_gap: f64,
    flexible: bool,
    gapped: bool,
    follows: bool,
    /// Whether friction or force act on the table, and whether the force does by its place.
    loaded: bool,
    by_place: bool,
    bristles: bool,
    /// Whether the motor's torque comes through a current loop.
    lags: bool,
    /// Whether the voltage switches inside the period.
    switches: bool,
    /// Whether the table's turning points are events.
    turns: bool,
    /// Whether a period may be one step, and the steps over it by mode.
    whole: bool,
    period_s: f64,
    wholes: [Step; 4],
    parts: [Part; 2],
}

/// Pieces of a part: few, and a whole number already.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(pieces: f64) -> usize {
    pieces as usize
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
        let linear = Linear::new(axis, effects);
        let resonance = effects.two_mass.map_or(0.0, |two_mass| two_mass.resonance_rad_s(&plant, drive));
        let half_gap = effects.backlash.map_or(0.0, |backlash| 0.5e-3 * backlash.gap_um / r_g);
        let flexible = linear.table_inertia.is_some();
        let gapped = flexible && half_gap > 0.0;
        let sticks = matches!(forces.friction_model, FrictionModel::Coulomb);
        let part = |begin_s: f64, length_s: f64| {
            let swings = if gapped || sticks { (resonance * length_s / SWING).ceil() } else { 1.0 };
            let share = (f64::from(effects.integration.substeps) * length_s / period_s).ceil();
            let pieces = swings.max(share).max(1.0);
            let tick_s = length_s / (pieces * TICKS as f64);
            let grids = std::array::from_fn(|mode| {
                let (free, stuck) = (mode & 2 != 0, mode & 1 != 0);
                let needed = length_s > 0.0 && (!free || gapped) && (!stuck || sticks);
                if needed { linear.grid(tick_s, free, stuck) } else { Vec::new() }
            });
            Part { ticks: if length_s > 0.0 { whole(pieces) * TICKS } else { 0 }, begin_s, tick_s, grids }
        };
        let switch_s = switch_share * period_s;
        let parts = [part(0.0, switch_s), part(switch_s, period_s - switch_s)];
        let switches = parts[0].ticks > 0;
        let whole = effects.integration.substeps == 1 && (!(gapped || sticks) || resonance * period_s <= SWING);
        let wholes = std::array::from_fn(|mode| match (whole, parts[0].grids[mode].last()) {
            (true, None) => parts[1].grids[mode].last().copied().unwrap_or(Step::NONE),
            (true, Some(before)) => {
                let all = linear.step(period_s, mode & 2 != 0, mode & 1 != 0);
                Step::joined(&all, before, parts[1].grids[mode].last().unwrap_or(&Step::NONE))
            }
            (false, _) => Step::NONE,
        });
        let state = State {
            z: [0.0; LANES],
            offset: 0.0,
            side: 1.0,
            direction: 1.0,
            bristle: forces.at_rest(),
            follower: 0.0,
            ripple: forces.ripple(0.0),
            friction: 0.0,
            steep: 0.0,
            rub_rate: 0.0,
            force: forces.force(0.0, 0.0, &mut 0),
            free: gapped,
            stuck: sticks,
        };
        Self {
            state,
            longest: TICKS,
            near: 0,
            viscous: linear.table_viscous + if flexible { 0.0 } else { linear.motor_viscous },
            linear,
            per_tolerance: r_g / effects.integration.tolerance_mm_s,
            lightness: 1.0 / effects.rubbing_kg_m2(&axis.plant, drive),
            half_gap,
            flexible,
            gapped,
            follows: half_gap > 0.0 && !flexible,
            loaded: forces.act_on_table(),
            by_place: forces.by_place(),
            bristles: forces.friction_model == FrictionModel::LuGre,
            lags: linear.current_rate.is_some(),
            switches,
            turns: sticks || (half_gap > 0.0 && !flexible),
            whole,
            period_s,
            wholes,
            parts,
            forces,
        }
    }

    /// Place of the table from the start \[rad\].
    #[inline(always)]
    pub(super) fn table_rad(&self) -> f64 {
        if self.follows { self.state.follower } else { self.state.z[PLACE] }
    }

    /// What can be told of the machine beside its positions, under a voltage; torques at the motor shaft.
    pub(super) fn signals(&self, voltage: f64) -> MachineSignals {
        let state = &self.state;
        let friction_nm = if state.stuck {
            -self.drives(&state.z, voltage, state.ripple[0], state.force.torque)
        } else {
            state.friction - self.linear.table_viscous * state.z[TABLE]
        };
        MachineSignals {
            table_rad_s: state.z[TABLE],
            torque_nm: self.torque(&state.z, voltage),
            ripple_nm: state.ripple[0],
            friction_nm,
            force_nm: state.force.torque,
            stuck: state.stuck,
            in_gap: state.free,
        }
    }

    /// Torque of the motor under a voltage \[N m\], without ripple.
    #[inline(always)]
    fn torque(&self, z: &Column, voltage: f64) -> f64 {
        if self.lags { z[TORQUE] } else { self.linear.torque_per_volt * voltage }
    }

    /// Makes what follows from the states follow from them again: after every change of the states, the offset or `free` that is no step.
    fn derive(&mut self) {
        let State { z, offset, free, .. } = &mut self.state;
        z[ANGLE] = z[PLACE] + (z[TWIST] + *offset);
        z[SPRING] = if *free { 0.0 } else { self.linear.spring(z) };
    }

    /// Torque that acts on the table beside friction, were it at rest \[N m\].
    #[inline(always)]
    fn drives(&self, z: &Column, voltage: f64, ripple: f64, force: f64) -> f64 {
        let driven = if self.flexible { z[SPRING] } else { self.torque(z, voltage) + ripple };
        driven + force
    }
}

/// What a machine tells of a state.
pub(super) struct MachineSignals {
    /// Speed of the table \[rad/s\] (of the screw, behind a kinematic gap).
    pub(super) table_rad_s: f64,
    /// Torque of the motor without ripple \[N m\].
    pub(super) torque_nm: f64,
    /// Ripple of the motor's torque \[N m\].
    pub(super) ripple_nm: f64,
    /// Friction on the table, positive where it pushes forward \[N m\].
    pub(super) friction_nm: f64,
    /// Cutting force \[N m\].
    pub(super) force_nm: f64,
    /// Whether the table sticks.
    pub(super) stuck: bool,
    /// Whether the table floats in the backlash.
    pub(super) in_gap: bool,
}
