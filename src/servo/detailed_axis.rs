//! One axis of the detailed drive model: the loop with every effect and compensation between reference and table.

use super::compensation::{Biquad, Compensation, Compensator, ZeroPhase};
use super::controller::{AnyController, Controller, Feedback, PdffController};
use super::effects::{Effects, EncoderPlace, PitchError, Sensor};
use super::mechanics::Machine;
use super::reference::{Axis, AxisReference};
use super::{AxisParameters, AxisSignals, Derivative, LoopSettings};
use crate::parameters::OutOfRange;

/// Voltages that wait for their time: the longest delay, the loop's own sample and the present one.
const WAITING: usize = 32;

/// Signals of a detailed drive beside its [`AxisSignals`], at the same sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveSignals {
    /// Measured position, as the controller gets it \[mm\].
    pub measured_mm: f64,
    /// Measured velocity, as the controller gets it \[rad/s\].
    pub measured_rad_s: f64,
    /// Motor position, as travel of the table without backlash, twist and pitch error \[mm\].
    pub motor_mm: f64,
    /// Velocity of the table (of the screw, where it is rigid) \[mm/s\].
    pub table_mm_s: f64,
    /// Torque of the motor without ripple \[N m\].
    pub motor_torque_nm: f64,
    /// Torque ripple \[N m\].
    pub ripple_nm: f64,
    /// Friction at the motor shaft, positive where it pushes forward \[N m\]; without the plant's own viscous one.
    pub friction_nm: f64,
    /// Cutting force as a torque at the motor shaft \[N m\].
    pub force_nm: f64,
    /// Whether the table sticks.
    pub stuck: bool,
    /// Whether the table floats in the backlash, between two masses.
    pub in_gap: bool,
}

/// An axis of the detailed drive model: reference → prefilter and compensation → controller → filters → voltage limit, DAC → delay → current loop →
/// motor, screw and table with friction, backlash, ripple and force → encoder.
///
/// With every effect off it equals [`AxisLoop`](super::AxisLoop) to rounding. It starts at rest, the table in the middle
/// of its gap; a step allocates nothing.
#[derive(Debug, Clone)]
pub struct DetailedAxis<C = AnyController> {
    controller: C,
    start_mm: f64,
    period_s: f64,
    rate: f64,
    derivative: Derivative,
    mm_rad: f64,
    volt_nm: f64,
    nm_volt: f64,
    limit_v: f64,
    step_v: f64,
    steps_v: f64,
    filters: Vec<Biquad>,
    compensator: Compensator,
    prefilter: Option<ZeroPhase>,
    sensor: Sensor,
    pitch: Option<PitchError>,
    near: usize,
    pitch_start_mm: f64,
    machine: Machine,
    /// Voltages to come, in a ring from `at` on: a new one waits behind `late` others for the second part of its period.
    waiting: [f64; WAITING],
    late: usize,
    at: usize,
    /// Voltage on the machine when the last sample was taken.
    applied_v: f64,
    last_command_mm: f64,
    k: u64,
    /// Feedback of the controller at the last sample.
    measured: Feedback,
}

/// Whole samples of a delay: at most 17, a whole number already.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(samples: f64) -> usize {
    samples as usize
}

impl DetailedAxis {
    /// The axis under its PDFF controller.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn pdff(
        axis: &AxisParameters,
        effects: &Effects,
        compensation: &Compensation,
        settings: &LoopSettings,
        start_mm: f64,
    ) -> Result<Self, OutOfRange> {
        let controller = AnyController::Pdff(PdffController::new(&axis.pdff, settings.period_s));
        Self::new(axis, controller, effects, compensation, settings, start_mm)
    }
}

impl<C: Controller> DetailedAxis<C> {
    /// The axis under a controller, at rest on `start_mm`.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(
        axis: &AxisParameters,
        controller: C,
        effects: &Effects,
        compensation: &Compensation,
        settings: &LoopSettings,
        start_mm: f64,
    ) -> Result<Self, OutOfRange> {
        axis.check()?;
        settings.check()?;
        effects.check(axis, settings)?;
        compensation.check(settings)?;
        if !(start_mm.abs() <= 1e9) {
            return Err(OutOfRange::new("start_mm", start_mm, "a finite number, at most 1e9"));
        }
        let (drive, period_s) = (&axis.drive, settings.period_s);
        let delay = effects.delay.map_or(0.0, |delay| delay.samples) + f64::from(u8::from(settings.one_sample_delay));
        let late = delay.floor();
        let step_v = effects.dac.map_or(0.0, |dac| dac.step_v(drive.voltage_limit_v));
        let encoder = effects.encoder.unwrap_or_default();
        let filters: Result<Vec<_>, _> = compensation.filters.iter().map(|f| Biquad::new(f, period_s)).collect();
        let machine = Machine::new(axis, effects, period_s, delay - late, start_mm);
        Ok(Self {
            controller,
            start_mm,
            period_s,
            rate: 1.0 / period_s,
            derivative: settings.derivative,
            mm_rad: drive.transmission_mm_rad,
            volt_nm: drive.torque_to_voltage_v_nm,
            nm_volt: 1.0 / drive.torque_to_voltage_v_nm,
            limit_v: drive.voltage_limit_v,
            step_v,
            steps_v: if step_v > 0.0 { 1.0 / step_v } else { 0.0 },
            filters: filters?,
            compensator: Compensator::new(compensation, axis, period_s, start_mm),
            prefilter: compensation.zero_phase.clone(),
            sensor: Sensor::new(&encoder, effects.noise.as_ref(), drive.transmission_mm_rad, period_s, start_mm),
            pitch_start_mm: effects.pitch.as_ref().map_or(0.0, |pitch| pitch.at_start_mm(start_mm)),
            pitch: effects.pitch.clone(),
            near: 0,
            measured: Feedback::default(),
            machine,
            waiting: [0.0; WAITING],
            late: whole(late),
            at: 0,
            applied_v: 0.0,
            last_command_mm: 0.0,
            k: 0,
        })
    }

    /// The drive signals of the sample of the last [`step`](Axis::step) (before the first: at rest).
    pub fn drive_signals(&self) -> DriveSignals {
        let machine = &self.machine;
        let signals = machine.signals(self.applied_v);
        DriveSignals {
            measured_mm: self.start_mm + self.measured.position_mm,
            measured_rad_s: self.measured.velocity_rad_s,
            motor_mm: self.start_mm + self.mm_rad * machine.state.motor_rad(),
            table_mm_s: self.mm_rad * signals.table_rad_s,
            motor_torque_nm: signals.torque_nm,
            ripple_nm: signals.ripple_nm,
            friction_nm: signals.friction_nm,
            force_nm: signals.force_nm,
            stuck: signals.stuck,
            in_gap: signals.in_gap,
        }
    }

    /// The pitch error \[mm\] where the screw has taken the table to, from the start, where it is zero.
    #[inline(always)]
    fn pitch_mm(&mut self, from_start_mm: f64) -> f64 {
        match &self.pitch {
            None => 0.0,
            Some(pitch) => {
                1e-3 * pitch.error_um.near(self.start_mm + from_start_mm, &mut self.near) - self.pitch_start_mm
            }
        }
    }

    /// The reference as the controller takes it.
    #[inline(always)]
    fn reference(&mut self, reference: &AxisReference) -> AxisReference {
        let mut reference = AxisReference { position_mm: reference.position_mm - self.start_mm, ..*reference };
        let mut backward = self.derivative == Derivative::Backward;
        if let Some(prefilter) = &mut self.prefilter {
            reference.position_mm = prefilter.step(reference.position_mm);
            backward = true;
        }
        if backward {
            reference.velocity_mm_s = (reference.position_mm - self.last_command_mm) * self.rate;
            self.last_command_mm = reference.position_mm;
        }
        if self.compensator.active {
            self.compensator.compensate(&mut reference, self.start_mm);
        }
        reference.position_mm += reference.command_offset_mm;
        reference
    }
}

impl<C: Controller> Axis for DetailedAxis<C> {
    #[inline(always)]
    fn step(&mut self, reference: &AxisReference) -> AxisSignals {
        // Move: the machine goes on when the next sample is taken, so that until then it can be looked at.
        if self.k > 0 {
            let before = self.applied_v;
            self.applied_v = self.waiting[self.at];
            self.at = (self.at + 1) % WAITING;
            self.machine.advance([before, self.applied_v], (self.k - 1) as f64 * self.period_s);
        }
        self.k += 1;

        // Measure.
        let motor_rad_s = self.machine.state.motor_rad_s();
        let motor_mm = self.mm_rad * self.machine.state.motor_rad();
        let nominal_mm = self.mm_rad * self.machine.table_rad();
        let table_mm = nominal_mm + self.pitch_mm(nominal_mm);
        let seen_mm = if self.sensor.place == EncoderPlace::Motor { motor_mm } else { table_mm };
        let (position_mm, velocity_rad_s) = self.sensor.measure(seen_mm, motor_rad_s);
        self.measured = Feedback { position_mm, velocity_rad_s };

        // Control.
        let command = self.reference(reference);
        let output = self.controller.control(&command, &self.measured);
        let mut torque_nm = output.torque_nm + command.torque_nm;
        for filter in &mut self.filters {
            torque_nm = filter.step(torque_nm);
        }
        let wanted_v = self.volt_nm * torque_nm;
        let mut voltage_v = wanted_v;
        if voltage_v < -self.limit_v {
            voltage_v = -self.limit_v;
        }
        if voltage_v > self.limit_v {
            voltage_v = self.limit_v;
        }
        let saturated = wanted_v != voltage_v;
        self.controller.anti_windup(self.nm_volt * (wanted_v - voltage_v));
        if self.step_v > 0.0 {
            voltage_v = (voltage_v * self.steps_v).round_ties_even() * self.step_v;
        }

        // To the amplifier, late.
        self.waiting[(self.at + self.late) % WAITING] = voltage_v;

        AxisSignals {
            command_mm: reference.position_mm,
            actual_mm: self.start_mm + table_mm,
            velocity_command_rad_s: output.velocity_command_rad_s,
            velocity_rad_s: motor_rad_s,
            torque_nm,
            voltage_v,
            saturated,
        }
    }
}
