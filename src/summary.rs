//! The metrics of a run: what the table on standard output, `--format json` and the recording's attachment hold.

use crate::parameters::axis_name;
use serde::{Deserialize, Serialize};

use crate::feedrate::OverrideChange;
use crate::limits::{LimitCheck, Limits, Peaks, finite_or_null, null_is_infinite};
use crate::optimize::Step;
use crate::simulation::{Event, Observer, ObserverError, Period, RunPlan};

/// Metrics of a run. Keys carry their units; full double precision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Whether the run reached its end (false: interrupted).
    pub complete: bool,
    /// Length of the desired path.
    pub path_length_mm: f64,
    /// Motion from rest to rest.
    pub motion_time_s: f64,
    /// Control periods simulated.
    pub samples: u64,
    /// Control period.
    pub period_s: f64,
    /// Largest curvature of the desired path.
    pub max_curvature_1_mm: f64,
    /// Feed reached (lower than commanded on a short path).
    pub feed_mm_s: f64,
    /// Largest acceleration along the path, `dv/dt` of the plan; [`vector_accel_mm_s2`](Self::vector_accel_mm_s2) counts the curvature.
    pub peak_accel_mm_s2: f64,
    /// Largest jerk along the path; null where it is infinite (a trapezoidal feed).
    #[serde(serialize_with = "finite_or_null", deserialize_with = "null_is_infinite")]
    pub peak_jerk_mm_s3: f64,
    /// Largest acceleration vector of the setpoints, `|a t + v² k|`, and where.
    #[serde(default)]
    pub vector_accel_mm_s2: VectorPeak,
    /// Largest jerk vector of the setpoints, `|j t + 3 v a k + v³ k'|`, and where.
    #[serde(default)]
    pub vector_jerk_mm_s3: VectorPeak,
    /// Changes of the feed override; the key is missing where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<OverrideSummary>,
    /// Exponent of the exponential profile, null for the others.
    pub n_c: Option<f64>,
    /// Largest contouring error, either side.
    pub max_contour_error_um: f64,
    /// When.
    pub max_contour_error_at_s: f64,
    /// Where along the path.
    pub max_contour_error_at_mm: f64,
    /// Root mean square of the contouring error over all samples.
    pub rms_contour_error_um: f64,
    /// Largest tracking error (distance to the setpoint).
    pub max_tracking_error_um: f64,
    /// Its root mean square.
    pub rms_tracking_error_um: f64,
    /// Largest voltage of any axis.
    pub peak_voltage_v: f64,
    /// Root mean square of the voltage over all axes and samples.
    pub rms_voltage_v: f64,
    /// Share of samples in which an axis is saturated.
    pub saturated_share: f64,
    /// Whether an axis locked up.
    pub locked_up: bool,
    /// In words: which axis, when, how. Null when none did.
    pub lockup: Option<String>,
    /// The same metrics axis by axis.
    pub axes: Vec<AxisSummary>,
    /// Limits of the scenario, held against the run.
    pub limits: Vec<LimitCheck>,
    /// Name of the recording, null when there is none.
    pub recording: Option<String>,
    /// Pattern search for `n_c`, iteration by iteration; null when there was none.
    pub n_c_search: Option<Vec<Step>>,
}

/// Largest magnitude of a vector over the setpoints of a run, and where it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct VectorPeak {
    /// The magnitude, in the unit of the key; null where it is infinite (the jerk of a trapezoidal feed).
    #[serde(serialize_with = "finite_or_null", deserialize_with = "null_is_infinite")]
    pub peak: f64,
    /// When.
    pub at_s: f64,
    /// Where along the path.
    pub at_mm: f64,
    /// The setpoint there.
    pub point_mm: Vec<f64>,
}

/// A change of the feed override.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OverrideSummary {
    /// When it begins.
    pub at_s: f64,
    /// The share of the planned feed that it changes to: 0 is a feed hold.
    pub percent: f64,
    /// How long the change takes, to its share or to where the next change or the end of the motion cuts it off.
    pub transition_s: f64,
    /// The length that was asked for, where there is one: the limits may need longer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asked_transition_s: Option<f64>,
    /// The share that it comes to, where it is another than `percent`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reached_percent: Option<f64>,
    /// Whether it comes after the end of the motion and has no effect; the key is missing where it does not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub after_the_end: bool,
}

/// Metrics of one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisSummary {
    /// Name.
    pub axis: String,
    /// Largest tracking error of the axis.
    pub max_tracking_error_um: f64,
    /// Its root mean square.
    pub rms_tracking_error_um: f64,
    /// Largest voltage.
    pub peak_voltage_v: f64,
    /// Root mean square of the voltage.
    pub rms_voltage_v: f64,
    /// Share of samples in which the axis is saturated.
    pub saturated_share: f64,
    /// Largest velocity of its setpoints, either sign.
    #[serde(default)]
    pub peak_velocity_mm_s: f64,
    /// Largest acceleration of its setpoints.
    #[serde(default)]
    pub peak_accel_mm_s2: f64,
    /// Largest jerk of its setpoints (between the jumps of a trapezoidal feed).
    #[serde(default)]
    pub peak_jerk_mm_s3: f64,
}

impl Summary {
    /// Whether every limit is kept and no axis locked up.
    pub fn passed(&self) -> bool {
        !self.locked_up && self.limits.iter().all(|check| check.kept)
    }

    /// What the limits along the path do not show: a line for each of acceleration and jerk whose vector is beyond the limit along the
    /// path by more than 5 %, or, where there is none, beyond ten times the peak along the path. None where the vector or the axes are limited.
    pub fn warnings(&self) -> Vec<String> {
        let limit = |name: &str| self.limits.iter().find(|check| check.name == name).map(|check| check.limit);
        let quantities = [
            ("acceleration", "accel_mm_s2", "mm/s²", self.peak_accel_mm_s2, &self.vector_accel_mm_s2),
            ("jerk", "jerk_mm_s3", "mm/s³", self.peak_jerk_mm_s3, &self.vector_jerk_mm_s3),
        ];
        let mut lines = Vec::new();
        for (what, key, unit, planned, vector) in quantities {
            let checked = ["vector_", "axis_", "x.", "y."].iter().any(|of| limit(&format!("{of}{key}")).is_some());
            let (against, factor) = match limit(key) {
                Some(limit) => (format!("limits.{key} = {limit}"), vector.peak / limit),
                None => ("the peak along the path".to_owned(), 0.1 * vector.peak / planned),
            };
            if checked || !(factor > 1.0 + WARNED && vector.peak.is_finite()) {
                continue;
            }
            let times = if limit(key).is_some() { factor } else { 10.0 * factor };
            let point: Vec<String> = vector.point_mm.iter().map(|mm| format!("{mm:.3}")).collect();
            lines.push(format!(
                "the path's curvature takes the {what} of the setpoints to {:.0} {unit}, {times:.2} times {against}, {:.3} mm along the \
                 path at ({}) mm; limits.vector_{key} checks it",
                vector.peak,
                vector.at_mm,
                point.join(", "),
            ));
        }
        lines
    }
}

/// Share of a limit along the path that a vector may be above it unwarned: limits along the path leave no more margin than that.
const WARNED: f64 = 0.05;

/// Sum of squares without loss on long runs (Neumaier).
#[derive(Debug, Clone, Copy, Default)]
struct SquareSum {
    sum: f64,
    rest: f64,
}

impl SquareSum {
    fn add(&mut self, value: f64) {
        let square = value * value;
        let sum = self.sum + square;
        self.rest += if self.sum >= square { (self.sum - sum) + square } else { (square - sum) + self.sum };
        self.sum = sum;
    }

    fn rms(&self, count: f64) -> f64 {
        if count > 0.0 { ((self.sum + self.rest) / count).sqrt() } else { 0.0 }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct AxisMetrics {
    max_tracking_mm: f64,
    tracking: SquareSum,
    peak_voltage: f64,
    voltage: SquareSum,
    saturated: u64,
    /// Velocity, acceleration and jerk of the setpoints.
    commanded: [f64; 3],
}

/// A vector's largest square so far, when, where along the path, and the setpoint.
#[derive(Debug, Clone, Copy)]
struct Largest<const A: usize> {
    square: f64,
    at_s: f64,
    at_mm: f64,
    point_mm: [f64; A],
}

impl<const A: usize> Largest<A> {
    const NONE: Self = Self { square: 0.0, at_s: 0.0, at_mm: 0.0, point_mm: [0.0; A] };

    fn see(&mut self, square: f64, period: &Period<A>) {
        if square > self.square {
            let at = &period.setpoint;
            *self = Self { square, at_s: at.time_s, at_mm: at.s_mm, point_mm: at.position_mm.into() };
        }
    }

    fn peak(&self) -> VectorPeak {
        VectorPeak { peak: self.square.sqrt(), at_s: self.at_s, at_mm: self.at_mm, point_mm: self.point_mm.to_vec() }
    }
}

/// The observer that gathers a [`Summary`]. Its memory does not grow with the run.
#[derive(Debug, Clone)]
pub struct SummaryObserver<const A: usize> {
    name: String,
    n_c: Option<f64>,
    n_c_search: Option<Vec<Step>>,
    recording: Option<String>,
    limits: Limits,
    planned: u64,
    path_length_mm: f64,
    max_curvature_1_mm: f64,
    motion_time_s: f64,
    feed_mm_s: f64,
    peak_accel_mm_s2: f64,
    peak_jerk_mm_s3: f64,
    overrides: Vec<OverrideSummary>,
    period_s: f64,
    samples: u64,
    max_contour: (f64, f64, f64),
    contour: SquareSum,
    max_tracking_um: f64,
    tracking: SquareSum,
    saturated: u64,
    axes: [AxisMetrics; A],
    vector_accel: Largest<A>,
    vector_jerk: Largest<A>,
    lockup: Option<String>,
}

impl<const A: usize> SummaryObserver<A> {
    /// A summary of the run of the scenario with this name.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            n_c: None,
            n_c_search: None,
            recording: None,
            limits: Limits::default(),
            planned: 0,
            path_length_mm: 0.0,
            max_curvature_1_mm: 0.0,
            motion_time_s: 0.0,
            feed_mm_s: 0.0,
            peak_accel_mm_s2: 0.0,
            peak_jerk_mm_s3: 0.0,
            overrides: Vec::new(),
            period_s: 0.0,
            samples: 0,
            max_contour: (0.0, 0.0, 0.0),
            contour: SquareSum::default(),
            max_tracking_um: 0.0,
            tracking: SquareSum::default(),
            saturated: 0,
            axes: [AxisMetrics::default(); A],
            vector_accel: Largest::NONE,
            vector_jerk: Largest::NONE,
            lockup: None,
        }
    }

    /// Notes the exponent of the profile and how it was found.
    #[must_use]
    pub fn with_n_c(mut self, n_c: Option<f64>, search: Option<Vec<Step>>) -> Self {
        (self.n_c, self.n_c_search) = (n_c, search);
        self
    }

    /// Notes the name of the recording.
    #[must_use]
    pub fn with_recording(mut self, name: Option<String>) -> Self {
        self.recording = name;
        self
    }

    /// The metrics so far.
    pub fn summary(&self) -> Summary {
        let count = self.samples as f64;
        let share = |n: u64| if self.samples == 0 { 0.0 } else { n as f64 / count };
        let peak_voltage_v = self.axes.iter().map(|a| a.peak_voltage).fold(0.0, f64::max);
        let rms_voltage_v =
            (self.axes.iter().map(|a| a.voltage.rms(count).powi(2)).sum::<f64>() / A.max(1) as f64).sqrt();
        let vector_accel_mm_s2 = self.vector_accel.peak();
        let mut vector_jerk_mm_s3 = self.vector_jerk.peak();
        if self.peak_jerk_mm_s3 == f64::INFINITY {
            vector_jerk_mm_s3.peak = f64::INFINITY;
        }
        let mut commanded = [[0.0; 3]; 3];
        commanded.iter_mut().zip(&self.axes).for_each(|(peaks, axis)| *peaks = axis.commanded);
        let vectors = (vector_accel_mm_s2.peak, vector_jerk_mm_s3.peak);
        let (max_contour_error_um, max_contour_error_at_s, max_contour_error_at_mm) = self.max_contour;
        Summary {
            scenario: self.name.clone(),
            complete: self.samples == self.planned,
            path_length_mm: self.path_length_mm,
            motion_time_s: self.motion_time_s,
            samples: self.samples,
            period_s: self.period_s,
            max_curvature_1_mm: self.max_curvature_1_mm,
            feed_mm_s: self.feed_mm_s,
            peak_accel_mm_s2: self.peak_accel_mm_s2,
            peak_jerk_mm_s3: self.peak_jerk_mm_s3,
            vector_accel_mm_s2,
            vector_jerk_mm_s3,
            overrides: self.overrides.clone(),
            n_c: self.n_c,
            max_contour_error_um,
            max_contour_error_at_s,
            max_contour_error_at_mm,
            rms_contour_error_um: self.contour.rms(count),
            max_tracking_error_um: self.max_tracking_um,
            rms_tracking_error_um: self.tracking.rms(count),
            peak_voltage_v,
            rms_voltage_v,
            saturated_share: share(self.saturated),
            locked_up: self.lockup.is_some(),
            lockup: self.lockup.clone(),
            axes: self
                .axes
                .iter()
                .enumerate()
                .map(|(i, axis)| AxisSummary {
                    axis: axis_name(i).to_owned(),
                    max_tracking_error_um: 1e3 * axis.max_tracking_mm,
                    rms_tracking_error_um: 1e3 * axis.tracking.rms(count),
                    peak_voltage_v: axis.peak_voltage,
                    rms_voltage_v: axis.voltage.rms(count),
                    saturated_share: share(axis.saturated),
                    peak_velocity_mm_s: axis.commanded[0],
                    peak_accel_mm_s2: axis.commanded[1],
                    peak_jerk_mm_s3: axis.commanded[2],
                })
                .collect(),
            limits: self.limits.check(&Peaks {
                contour_error_um: max_contour_error_um,
                tracking_error_um: self.max_tracking_um,
                voltage_v: peak_voltage_v,
                accel_mm_s2: self.peak_accel_mm_s2,
                jerk_mm_s3: self.peak_jerk_mm_s3,
                vector_accel_mm_s2: vectors.0,
                vector_jerk_mm_s3: vectors.1,
                axes: commanded,
                overridden: !self.overrides.is_empty(),
            }),
            recording: self.recording.clone(),
            n_c_search: self.n_c_search.clone(),
        }
    }
}

impl<const A: usize> Observer<A> for SummaryObserver<A> {
    fn begin(&mut self, plan: &RunPlan<'_, A>) -> Result<(), ObserverError> {
        let totals = &plan.totals;
        // A second run starts anew.
        *self = Self::new(std::mem::take(&mut self.name))
            .with_n_c(self.n_c, self.n_c_search.take())
            .with_recording(self.recording.take());
        self.limits = *plan.limits;
        self.planned = plan.samples;
        self.path_length_mm = totals.length_mm;
        self.max_curvature_1_mm = totals.max_curvature_1_mm;
        self.motion_time_s = totals.time_s;
        self.feed_mm_s = totals.feed_mm_s;
        self.peak_accel_mm_s2 = totals.peaks.accel_mm_s2;
        self.peak_jerk_mm_s3 = totals.peaks.jerk_mm_s3;
        let metrics = |change: &OverrideChange| OverrideSummary {
            at_s: change.at_s,
            percent: 100.0 * change.ratio,
            transition_s: change.transition_s,
            asked_transition_s: (change.asked_s > 0.0).then_some(change.asked_s),
            reached_percent: (!change.after_the_end && change.reached != change.ratio)
                .then_some(100.0 * change.reached),
            after_the_end: change.after_the_end,
        };
        self.overrides = plan.overrides.iter().map(metrics).collect();
        self.period_s = plan.settings.period_s;
        Ok(())
    }

    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError> {
        self.samples += 1;
        let contour = period.contour_error_um.abs();
        if contour > self.max_contour.0 {
            self.max_contour = (contour, period.time_s, period.nearest_s_mm);
        }
        self.contour.add(contour);
        self.max_tracking_um = self.max_tracking_um.max(period.tracking_error_um);
        self.tracking.add(period.tracking_error_um);
        let mut any = false;
        for (metrics, signals) in self.axes.iter_mut().zip(&period.axes) {
            let error = signals.command_mm - signals.actual_mm;
            metrics.max_tracking_mm = metrics.max_tracking_mm.max(error.abs());
            metrics.tracking.add(error);
            metrics.peak_voltage = metrics.peak_voltage.max(signals.voltage_v.abs());
            metrics.voltage.add(signals.voltage_v);
            metrics.saturated += u64::from(signals.saturated);
            any |= signals.saturated;
        }
        self.saturated += u64::from(any);
        let at = &period.setpoint;
        for (axis, metrics) in self.axes.iter_mut().enumerate() {
            let now = [at.velocity_mm_s[axis], at.acceleration_mm_s2[axis], at.jerk_vector_mm_s3[axis]];
            metrics.commanded.iter_mut().zip(now).for_each(|(peak, now)| *peak = peak.max(now.abs()));
        }
        self.vector_accel.see(at.acceleration_mm_s2.norm_squared(), period);
        self.vector_jerk.see(at.jerk_vector_mm_s3.norm_squared(), period);
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        if matches!(event, Event::LockedUp { .. }) && self.lockup.is_none() {
            self.lockup = Some(event.to_string());
        }
        Ok(())
    }
}
