//! Many runs along one path: what they share, computed once.

use nalgebra::{SVector, Vector2};
use rayon::prelude::*;

use super::{MAX_PERIODS, SimulationError};
use crate::contour::Neighbourhood;
use crate::feedrate::Motion;
use crate::interpolator::{Interpolator, periods};
use crate::path::{Cursor, Path};
use crate::servo::{Derivative, LoopSettings};

/// Most control periods of a [`ReferenceTrajectory`], which keeps them all (up to 600 bytes each).
pub const MAX_TRAJECTORY_PERIODS: u64 = 1_000_000;

/// One sample of a trajectory: what every run is commanded, and what its contouring error is measured against.
#[derive(Debug, Clone)]
pub(super) struct Sample<const A: usize> {
    /// Position command, counted from the start of the path \[mm\].
    pub(super) command: [f64; A],
    /// What the feedforward takes as its velocity \[mm/s\].
    pub(super) velocity: [f64; A],
    /// The pieces of path around it.
    pub(super) around: Neighbourhood,
    /// Arc length \[mm\].
    pub(super) s_mm: f64,
    /// Where it was found.
    pub(super) cursor: Cursor,
}

/// Setpoints and path geometry of a run, for any number of gain sets and plants.
///
/// [`ReferenceTrajectory::run`] takes parameters side by side through the very loop of a single run ([`AxisLoop`](crate::servo::AxisLoop)), on
/// every core. A result does not depend on its neighbours, on how many there are, on the number of cores or on the kind of vector
/// instructions. The loop is that of a [`Simulation`](super::Simulation) bit for bit, tracking errors agree to 1e-12 mm. The
/// contouring error is within 1 nm of the exact one: it is measured from tangent and curvature where a bound proves that this is
/// good to half a nanometre, and exactly elsewhere (a run that locks up far off the path takes some hundred times as long).
///
/// ```
/// use servosim::scenario::Scenario;
///
/// let alpha = Scenario::builtin("alpha")?;
/// let gains = [90.0, 97.38, 105.0].map(|kpp| {
///     let mut axes = alpha.axes;
///     axes.iter_mut().for_each(|axis| axis.pdff.kpp_rad_s_mm = kpp);
///     axes
/// });
/// let metrics = alpha.reference_trajectory()?.run(&gains)?;
/// assert!((metrics[1].max_contour_error_um - 27.027).abs() < 0.001);
/// assert!(metrics[2].max_contour_error_um < metrics[0].max_contour_error_um);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ReferenceTrajectory<'a, const A: usize> {
    pub(super) path: &'a dyn Path<A>,
    pub(super) settings: LoopSettings,
    pub(super) start_mm: SVector<f64, A>,
    pub(super) samples: Vec<Sample<A>>,
}

/// Metrics of one run of a batch, as in [`Summary`](crate::summary::Summary).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunMetrics<const A: usize> {
    /// Largest contouring error, either side \[µm\].
    pub max_contour_error_um: f64,
    /// Root mean square of the contouring error over all samples \[µm\].
    pub rms_contour_error_um: f64,
    /// Largest distance to the setpoint \[µm\].
    pub max_tracking_error_um: f64,
    /// Its root mean square \[µm\].
    pub rms_tracking_error_um: f64,
    /// Largest voltage of each axis, either sign \[V\].
    pub peak_voltage_v: [f64; A],
    /// Share of samples in which an axis is saturated.
    pub saturated_share: f64,
    /// Whether an axis locked up.
    pub locked_up: bool,
}

impl<'a, const A: usize> ReferenceTrajectory<'a, A> {
    /// The trajectory along `path` with `motion`.
    ///
    /// # Errors
    /// Settings out of range, or more than [`MAX_TRAJECTORY_PERIODS`] periods.
    pub fn new(path: &'a dyn Path<A>, motion: &Motion, settings: LoopSettings) -> Result<Self, SimulationError> {
        settings.check()?;
        let mut interpolator = Interpolator::new(path, motion, settings.period_s).solving_the_end_again();
        let last = interpolator.last_sample().saturating_add(periods(settings.settling_s, settings.period_s));
        if last >= MAX_TRAJECTORY_PERIODS.min(MAX_PERIODS) {
            return Err(SimulationError::TooLongForBatch { periods: last.saturating_add(1) });
        }
        let start_mm = interpolator.setpoint(0).position_mm;
        let mut before = start_mm;
        let rate = 1.0 / settings.period_s;
        let setpoints: Vec<_> = (0..=last)
            .map(|k| {
                let setpoint = interpolator.setpoint(k);
                (setpoint.s_mm, setpoint.position_mm, setpoint.velocity_mm_s, interpolator.cursor())
            })
            .collect();
        let mut samples: Vec<Sample<A>> = setpoints
            .par_iter()
            .map(|(s_mm, position_mm, velocity_mm_s, cursor)| Sample {
                command: (position_mm - start_mm).into(),
                velocity: (*velocity_mm_s).into(),
                around: neighbourhood(path, position_mm, *s_mm, cursor),
                s_mm: *s_mm,
                cursor: *cursor,
            })
            .collect();
        if settings.derivative == Derivative::Backward {
            // As the loop takes it: the difference of the commands themselves.
            for (sample, (_, position_mm, ..)) in samples.iter_mut().zip(&setpoints) {
                sample.velocity = std::array::from_fn(|axis| (position_mm[axis] - before[axis]) * rate);
                before = *position_mm;
            }
        }
        Ok(Self { path, settings, start_mm, samples })
    }

    /// How many periods a run has.
    pub fn samples(&self) -> u64 {
        self.samples.len() as u64
    }
}

impl<const A: usize> RunMetrics<A> {
    pub(super) fn none() -> Self {
        Self {
            max_contour_error_um: 0.0,
            rms_contour_error_um: 0.0,
            max_tracking_error_um: 0.0,
            rms_tracking_error_um: 0.0,
            peak_voltage_v: [0.0; A],
            saturated_share: 0.0,
            locked_up: false,
        }
    }
}

fn neighbourhood<const A: usize>(
    path: &dyn Path<A>,
    position_mm: &SVector<f64, A>,
    s_mm: f64,
    cursor: &Cursor,
) -> Neighbourhood {
    match position_mm.as_slice() {
        &[x, y] => Neighbourhood::around(path, &Vector2::new(x, y), s_mm, cursor),
        _ => Neighbourhood::default(),
    }
}
