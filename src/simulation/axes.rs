//! The axes of a run: ideal or detailed drive model.

use crate::parameters::OutOfRange;
use nalgebra::SVector;

use super::Period;
use crate::contour::ContourError;
use crate::interpolator::Setpoint;
use crate::lane::{Kernel, narrow, vectorized};
use crate::servo::compensation::{CrossCoupling, CrossCouplingGains};
use crate::servo::{
    Axis, AxisLoop, AxisParameters, AxisReference, AxisSignals, DetailedAxis, DriveModel, DriveSignals, LoopSettings,
};

/// All axes of a machine.
#[derive(Debug, Clone)]
pub(crate) enum Axes<const A: usize> {
    /// Plants of first order under PDFF controllers.
    Model([AxisLoop; A]),
    /// With what their drives do.
    Real(Box<DetailedAxes<A>>),
}

/// Axes of the detailed drive model.
#[derive(Debug, Clone)]
pub(crate) struct DetailedAxes<const A: usize> {
    pub(super) axes: [DetailedAxis; A],
    coupling: Option<CrossCoupling<A>>,
    /// By how much the cross-coupled controller shifts the commands at this sample.
    shifts_mm: [f64; A],
    /// By how many samples each axis wants to know its references in advance.
    pub(super) ahead: [usize; A],
}

impl<const A: usize> DetailedAxes<A> {
    /// Whether what one axis does at a sample has a part in what another one does at the next.
    pub(super) fn are_coupled(&self) -> bool {
        self.coupling.is_some()
    }

    /// What is asked of an axis where the path wants it on a setpoint.
    #[inline(always)]
    pub(super) fn reference(&self, axis: usize, setpoint: &Setpoint<A>) -> AxisReference {
        AxisReference {
            position_mm: setpoint.position_mm[axis],
            velocity_mm_s: setpoint.velocity_mm_s[axis],
            acceleration_mm_s2: setpoint.acceleration_mm_s2[axis],
            jerk_mm_s3: setpoint.jerk_vector_mm_s3[axis],
            torque_nm: 0.0,
            command_offset_mm: self.shifts_mm[axis],
        }
    }
}

impl<const A: usize> Axes<A> {
    /// All at rest on `start_mm`. The model's own loop runs where that is all that is asked for.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub(crate) fn new(
        parameters: &[AxisParameters; A],
        drives: Option<&[DriveModel; A]>,
        coupling: Option<&CrossCouplingGains>,
        settings: &LoopSettings,
        start_mm: &SVector<f64, A>,
    ) -> Result<Self, OutOfRange> {
        settings.check()?;
        for axis in parameters {
            axis.check()?;
        }
        let real = drives.filter(|drives| coupling.is_some() || drives.iter().any(|drive| !drive.is_model()));
        let Some(drives) = real else {
            let axis = |axis| AxisLoop::new(&parameters[axis], settings, start_mm[axis]);
            return Ok(Self::Model(std::array::from_fn(axis)));
        };
        let mut ahead = [0; A];
        let mut axes = Vec::with_capacity(A);
        for axis in 0..A {
            let (real, own) = drives[axis].axis(&parameters[axis], settings, start_mm[axis])?;
            ahead[axis] = own;
            axes.push(real);
        }
        let coupling = coupling.map(|gains| CrossCoupling::new(gains, settings.period_s)).transpose()?;
        match <[DetailedAxis; A]>::try_from(axes) {
            Ok(axes) => Ok(Self::Real(Box::new(DetailedAxes { axes, coupling, shifts_mm: [0.0; A], ahead }))),
            // There are as many as were pushed.
            Err(_) => Err(OutOfRange::new("axes", A as f64, "one drive an axis")),
        }
    }

    /// One control period, of a program or of the model: they have no axes that look ahead.
    #[inline]
    pub(super) fn step(&mut self, setpoint: &Setpoint<A>) -> [AxisSignals; A] {
        match self {
            Self::Model(axes) => vectorized(StepModel { axes, setpoint }),
            Self::Real(axes) => narrow(StepReal { axes, setpoint }),
        }
    }

    /// [`step`](Self::step) and the drive signals beside.
    #[inline]
    pub(crate) fn step_with_drives(&mut self, setpoint: &Setpoint<A>) -> ([AxisSignals; A], Option<[DriveSignals; A]>) {
        let signals = self.step(setpoint);
        (signals, self.drive_signals())
    }

    /// What every run does with a step of its axes: the tool's position, its contouring error by `measure`, the error told to the axes, and
    /// all signals of the period.
    ///
    /// # Errors
    /// Those of `measure`.
    #[inline]
    pub(crate) fn finish_period<E>(
        &mut self,
        k: u64,
        setpoint: Setpoint<A>,
        (axes, drives): ([AxisSignals; A], Option<[DriveSignals; A]>),
        measure: impl FnOnce(&SVector<f64, A>) -> Result<ContourError<A>, E>,
    ) -> Result<Period<A>, E> {
        let actual_mm = SVector::from_fn(|axis, _| axes[axis].actual_mm);
        let error = measure(&actual_mm)?;
        self.tell_error(|| error.nearest_mm - actual_mm);
        Ok(Period::of(k, setpoint, axes, &error, drives))
    }

    /// Tells the contouring error after a step: nearest point of the path less actual position \[mm\].
    #[inline]
    fn tell_error(&mut self, error_mm: impl FnOnce() -> SVector<f64, A>) {
        if let Self::Real(real) = self
            && let Some(coupling) = &mut real.coupling
        {
            real.shifts_mm = coupling.step(error_mm().into());
        }
    }

    /// The drive signals of the last sample, where they are more than their model.
    #[inline]
    fn drive_signals(&self) -> Option<[DriveSignals; A]> {
        match self {
            Self::Model(_) => None,
            Self::Real(real) => Some(std::array::from_fn(|axis| real.axes[axis].drive_signals())),
        }
    }
}

/// One control period of every axis of the model.
struct StepModel<'s, const A: usize> {
    axes: &'s mut [AxisLoop; A],
    setpoint: &'s Setpoint<A>,
}

impl<const A: usize> Kernel for StepModel<'_, A> {
    type Output = [AxisSignals; A];

    #[inline(always)]
    fn run(self) -> [AxisSignals; A] {
        let Setpoint { position_mm, velocity_mm_s, .. } = self.setpoint;
        // A plain loop: a closure would not be compiled with this function.
        let mut signals = [AxisSignals::default(); A];
        for (axis, signals) in signals.iter_mut().enumerate() {
            *signals = self.axes[axis].step(position_mm[axis], velocity_mm_s[axis]);
        }
        signals
    }
}

/// One control period of every detailed axis.
struct StepReal<'s, const A: usize> {
    axes: &'s mut DetailedAxes<A>,
    setpoint: &'s Setpoint<A>,
}

impl<const A: usize> Kernel for StepReal<'_, A> {
    type Output = [AxisSignals; A];

    #[inline(always)]
    fn run(self) -> [AxisSignals; A] {
        let Self { axes, setpoint } = self;
        let mut signals = [AxisSignals::default(); A];
        for (axis, signals) in signals.iter_mut().enumerate() {
            let reference = axes.reference(axis, setpoint);
            *signals = axes.axes[axis].step(&reference);
        }
        signals
    }
}
