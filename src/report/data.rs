//! What plots are drawn from: the metadata of a run and its signals, thinned to a bounded number of samples on the way.

use crate::feedrate::{AxisLimits, Motion};
use crate::interpolator::Setpoint;
use crate::limits::LimitCheck;
use crate::optimize::Step;
use crate::path::{Cursor, Path};
use crate::simulation::{Event, Observer, ObserverError, Period, Place, RunPlan};

/// Most buckets that a run is kept in. Up to this many samples every one is kept.
pub const MAX_BUCKETS: usize = 8192;

/// Beyond this magnitude a value counts as not finite: sums and differences of such values must not overflow.
const LARGEST: f64 = 1e100;

/// What is known of a run beside its samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunMetadata {
    /// Name in titles and legends.
    pub name: String,
    /// Control period \[s\].
    pub period_s: f64,
    /// Whether the machine has a third axis: its voltage is drawn too, and the path in three dimensions.
    pub three_axes: bool,
    /// Voltage limit of each axis \[V\]; not drawn unless positive and finite.
    pub voltage_limit_v: [f64; 3],
    /// Limits that the run was held to.
    pub limits: Vec<LimitCheck>,
    /// Points of the desired path \[mm\], dense enough to look smooth.
    pub desired_path_mm: Vec<[f64; 2]>,
    /// Nodal points to mark \[mm\]; may be empty.
    pub nodal_points_mm: Vec<[f64; 2]>,
    /// Whether the desired path ends where it starts.
    pub closed: bool,
    /// Largest jerk of the motion \[mm/s³\], infinite where the acceleration steps. Without it the limit check of
    /// `jerk_mm_s3` tells, and without that the samples, which miss what lies between them.
    pub peak_jerk_mm_s3: Option<f64>,
    /// Exponent of the exponential profile.
    pub n_c: Option<f64>,
    /// How it was found.
    pub n_c_search: Option<Vec<Step>>,
    /// Another motion to compare the feed with, and its name ("plain quintic").
    pub comparison: Option<(String, Motion)>,
    /// What the motion asks of the axes, where it is planned under limits of theirs.
    pub axis_loads: Option<AxisLoads>,
    /// Whether an axis locked up: beside runs that hold, such a run does not set the scale.
    pub locked_up: bool,
    /// What the reader must be told under every title: that an axis locked up, that the run was cut short.
    pub warning: Option<String>,
}

/// What a motion along a path asks of X and Y, and what they can do.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisLoads {
    /// The limits.
    pub limits: AxisLimits<2>,
    /// The motion, at evenly spaced times.
    pub samples: Vec<AxisLoad>,
}

/// Motion of the axes at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLoad {
    /// Time \[s\].
    pub time_s: f64,
    /// Velocities \[mm/s\].
    pub velocity_mm_s: [f64; 2],
    /// Accelerations \[mm/s²\].
    pub acceleration_mm_s2: [f64; 2],
    /// Jerks \[mm/s³\].
    pub jerk_mm_s3: [f64; 2],
}

impl AxisLoads {
    /// Times that a motion is looked at.
    const TIMES: u32 = 4000;

    /// Those of a motion along a path.
    pub fn of(path: &dyn Path<2>, motion: &Motion, limits: AxisLimits<2>) -> Self {
        let mut cursor = Cursor::default();
        let load = |i: u32| {
            let time_s = motion.total_s() * f64::from(i) / f64::from(Self::TIMES);
            let m = motion.at(time_s);
            let setpoint = Setpoint::of(time_s, &m, &path.frame(m.s_mm, &mut cursor));
            AxisLoad {
                time_s,
                velocity_mm_s: setpoint.velocity_mm_s.into(),
                acceleration_mm_s2: setpoint.acceleration_mm_s2.into(),
                jerk_mm_s3: setpoint.jerk_vector_mm_s3.into(),
            }
        };
        Self { limits, samples: (0..=Self::TIMES).map(load).filter(AxisLoad::is_drawable).collect() }
    }
}

impl AxisLoad {
    fn is_drawable(&self) -> bool {
        let all = [self.velocity_mm_s, self.acceleration_mm_s2, self.jerk_mm_s3];
        self.time_s.abs() <= LARGEST && all.iter().flatten().all(|value| value.abs() <= LARGEST)
    }
}

/// The plotted signals of one control period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlotSample {
    /// Time \[s\].
    pub time_s: f64,
    /// Commanded arc length \[mm\].
    pub s_mm: f64,
    /// Commanded feed \[mm/s\].
    pub feed_mm_s: f64,
    /// Commanded acceleration along the path \[mm/s²\].
    pub accel_mm_s2: f64,
    /// Commanded jerk along the path \[mm/s³\].
    pub jerk_mm_s3: f64,
    /// Setpoint \[mm\]; Z is 0 where there is no such axis.
    pub command_mm: [f64; 3],
    /// Where the tool is \[mm\].
    pub actual_mm: [f64; 3],
    /// The nearest point of the desired path \[mm\].
    pub nearest_mm: [f64; 3],
    /// Voltage of each axis \[V\]; 0 of one that there is not.
    pub voltage_v: [f64; 3],
    /// Signed contouring error \[µm\].
    pub contour_error_um: f64,
    /// Tracking error \[µm\].
    pub tracking_error_um: f64,
    /// Whether the motion is rapid.
    pub rapid: bool,
}

/// Number of signals in a sample, the time aside.
const SIGNALS: usize = 18;

impl PlotSample {
    /// Every signal but the time.
    fn signals(&self) -> [f64; SIGNALS] {
        let ([cx, cy, cz], [ax, ay, az], [nx, ny, nz]) = (self.command_mm, self.actual_mm, self.nearest_mm);
        let [vx, vy, vz] = self.voltage_v;
        let (a, j) = (self.accel_mm_s2, self.jerk_mm_s3);
        let errors = (self.contour_error_um, self.tracking_error_um);
        [self.s_mm, self.feed_mm_s, a, j, cx, cy, cz, ax, ay, az, nx, ny, nz, vx, vy, vz, errors.0, errors.1]
    }

    fn is_finite(&self) -> bool {
        self.time_s.abs() <= LARGEST && self.signals().iter().all(|value| value.abs() <= LARGEST)
    }
}

impl<const A: usize> From<&Period<A>> for PlotSample {
    /// Up to three axes.
    fn from(period: &Period<A>) -> Self {
        let each = |of: &dyn Fn(usize) -> f64| [0, 1, 2].map(|axis| if axis < A { of(axis) } else { 0.0 });
        Self {
            time_s: period.time_s,
            s_mm: period.setpoint.s_mm,
            feed_mm_s: period.setpoint.feed_mm_s,
            accel_mm_s2: period.setpoint.accel_mm_s2,
            jerk_mm_s3: period.setpoint.jerk_mm_s3,
            command_mm: each(&|axis| period.setpoint.position_mm[axis]),
            actual_mm: each(&|axis| period.actual_mm[axis]),
            nearest_mm: each(&|axis| period.nearest_mm[axis]),
            voltage_v: each(&|axis| period.axes[axis].voltage_v),
            contour_error_um: period.contour_error_um,
            tracking_error_um: period.tracking_error_um,
            rapid: false,
        }
    }
}

/// The samples of a bucket that hold something: the first, the last, and the lowest and highest of every signal.
#[derive(Debug, Clone, PartialEq)]
struct Bucket {
    first: PlotSample,
    last: PlotSample,
    lowest: [(f64, PlotSample); SIGNALS],
    highest: [(f64, PlotSample); SIGNALS],
}

impl Bucket {
    fn new(sample: PlotSample) -> Self {
        let each = sample.signals().map(|value| (value, sample));
        Self { first: sample, last: sample, lowest: each, highest: each }
    }

    fn add(&mut self, sample: PlotSample) {
        let extremes = self.lowest.iter_mut().zip(&mut self.highest);
        for (value, (lowest, highest)) in sample.signals().into_iter().zip(extremes) {
            if value < lowest.0 {
                *lowest = (value, sample);
            }
            if value > highest.0 {
                *highest = (value, sample);
            }
        }
        self.last = sample;
    }

    /// Appends the samples in the order of time, each once.
    fn write(&self, out: &mut Vec<PlotSample>) {
        let from = out.len();
        out.extend([self.first, self.last]);
        out.extend(self.lowest.iter().chain(&self.highest).map(|(_, sample)| *sample));
        if let Some(bucket) = out.get_mut(from..) {
            bucket.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        }
        let mut kept = from;
        for i in from..out.len() {
            if i == from || out[i] != out[kept - 1] {
                out[kept] = out[i];
                kept += 1;
            }
        }
        out.truncate(kept);
    }
}

/// Metrics over all samples, whatever is thinned.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Metrics {
    pub(super) samples: u64,
    pub(super) skipped: u64,
    pub(super) end_s: f64,
    /// The sample with the largest contouring error.
    pub(super) worst: PlotSample,
    pub(super) max_tracking_um: f64,
    pub(super) peak_feed_mm_s: f64,
    pub(super) peak_accel_mm_s2: f64,
    pub(super) peak_jerk_mm_s3: f64,
    pub(super) peak_voltage_v: [f64; 3],
    contour_squares: f64,
}

impl Metrics {
    fn add(&mut self, sample: &PlotSample) {
        if self.samples == 0 || sample.contour_error_um.abs() > self.worst.contour_error_um.abs() {
            self.worst = *sample;
        }
        self.samples += 1;
        self.end_s = if self.samples == 1 { sample.time_s } else { self.end_s.max(sample.time_s) };
        self.max_tracking_um = self.max_tracking_um.max(sample.tracking_error_um);
        self.peak_feed_mm_s = self.peak_feed_mm_s.max(sample.feed_mm_s.abs());
        self.peak_accel_mm_s2 = self.peak_accel_mm_s2.max(sample.accel_mm_s2.abs());
        self.peak_jerk_mm_s3 = self.peak_jerk_mm_s3.max(sample.jerk_mm_s3.abs());
        for (peak, voltage) in self.peak_voltage_v.iter_mut().zip(sample.voltage_v) {
            *peak = peak.max(voltage.abs());
        }
        self.contour_squares += sample.contour_error_um * sample.contour_error_um;
    }

    pub(super) fn rms_contour_um(&self) -> f64 {
        if self.samples == 0 { 0.0 } else { (self.contour_squares / self.samples as f64).sqrt() }
    }
}

/// A run as plots see it. It is filled sample by sample and does not grow beyond [`MAX_BUCKETS`] buckets.
///
/// Up to [`MAX_BUCKETS`] samples every one is kept. From there on neighbouring buckets are merged two by two, as often as
/// it takes; a bucket keeps its first and its last sample and, whole and in their order, those with the lowest and the
/// highest value of every signal, so that no peak is lost. (Usually some ten samples a bucket, 10 MB; 32 at the most.)
#[derive(Debug, Clone, PartialEq)]
pub struct RunData {
    metadata: RunMetadata,
    /// Samples of the closed buckets.
    samples: Vec<PlotSample>,
    /// Where in `samples` each closed bucket ends.
    ends: Vec<usize>,
    /// How many samples go into a bucket.
    per_bucket: u64,
    /// The bucket being filled, and how many samples went into it.
    open: Option<(Box<Bucket>, u64)>,
    metrics: Metrics,
    /// Whether the block that an observed run is in is rapid motion.
    rapid: bool,
}

impl RunData {
    /// A run without samples yet.
    pub fn new(metadata: RunMetadata) -> Self {
        let metrics = Metrics::default();
        Self { metadata, samples: Vec::new(), ends: Vec::new(), per_bucket: 1, open: None, metrics, rapid: false }
    }

    /// The metadata given.
    pub fn metadata(&self) -> &RunMetadata {
        &self.metadata
    }

    /// The metadata, to add what is known only when the run is over (limit checks, a warning).
    pub fn metadata_mut(&mut self) -> &mut RunMetadata {
        &mut self.metadata
    }

    /// Takes the next sample. One with a value that is not a finite number of at most 1e100 is skipped (and counted).
    pub fn push(&mut self, sample: &PlotSample) {
        if !sample.is_finite() {
            self.metrics.skipped += 1;
            return;
        }
        self.metrics.add(sample);
        if self.per_bucket == 1 {
            self.samples.push(*sample);
            self.ends.push(self.samples.len());
        } else {
            match &mut self.open {
                Some((bucket, count)) => {
                    bucket.add(*sample);
                    *count += 1;
                }
                None => self.open = Some((Box::new(Bucket::new(*sample)), 1)),
            }
            if self.open.as_ref().is_some_and(|(_, count)| *count >= self.per_bucket)
                && let Some((bucket, _)) = self.open.take()
            {
                bucket.write(&mut self.samples);
                self.ends.push(self.samples.len());
            }
        }
        if self.ends.len() > MAX_BUCKETS {
            self.merge();
        }
    }

    /// Merges closed buckets two by two; an odd one at the end becomes the open one.
    fn merge(&mut self) {
        let old = std::mem::take(&mut self.samples);
        let ends = std::mem::take(&mut self.ends);
        let mut start = 0;
        for pair in ends.chunks(2) {
            let end = pair.last().copied().unwrap_or(start);
            let mut samples = old.get(start..end).unwrap_or_default().iter();
            start = end;
            let Some(first) = samples.next() else { continue };
            let mut bucket = Bucket::new(*first);
            samples.for_each(|sample| bucket.add(*sample));
            if pair.len() == 2 {
                bucket.write(&mut self.samples);
                self.ends.push(self.samples.len());
            } else {
                self.open = Some((Box::new(bucket), self.per_bucket));
            }
        }
        self.per_bucket = self.per_bucket.saturating_mul(2);
    }

    /// The samples kept, in the order of time.
    pub fn samples(&self) -> Vec<PlotSample> {
        let mut samples = self.samples.clone();
        if let Some((bucket, _)) = &self.open {
            bucket.write(&mut samples);
        }
        samples
    }

    /// How many samples were skipped because a value was not finite.
    pub fn skipped(&self) -> u64 {
        self.metrics.skipped
    }

    pub(super) fn metrics(&self) -> &Metrics {
        &self.metrics
    }

    /// The check of the limit with this key.
    pub(super) fn limit(&self, name: &str) -> Option<&LimitCheck> {
        self.metadata.limits.iter().find(|check| check.name == name && check.limit > 0.0 && check.limit <= LARGEST)
    }
}

impl<const A: usize> Observer<A> for RunData {
    fn begin(&mut self, _plan: &RunPlan<'_, A>) -> Result<(), ObserverError> {
        self.metadata.three_axes = A > 2;
        Ok(())
    }

    fn period(&mut self, period: &Period<A>) -> Result<(), ObserverError> {
        self.push(&PlotSample { rapid: self.rapid, ..PlotSample::from(period) });
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        self.metadata.locked_up |= matches!(event, Event::LockedUp { .. });
        Ok(())
    }

    fn place(&mut self, place: &Place) -> Result<(), ObserverError> {
        self.rapid = place.rapid;
        Ok(())
    }
}
