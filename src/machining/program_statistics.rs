//! Statistics of a program, without simulating it.

use nalgebra::SVector;

use super::stream::{Next, Stream, Sum};
use super::{Machine, Motion, ProgramError, Shape};
use crate::feedrate::MotionPeaks;
use crate::interpolator::periods;
use crate::nc::{Action, Block, NcError};
use crate::path::{Cursor, Path};
use crate::simulation::{MAX_PERIODS, SimulationError};

/// Most points that the path of a program is drawn with.
pub const MAX_DRAWN_POINTS: usize = 20_000;

/// Points that a curve is looked at in, for its extent and its picture: at least, at most.
const POINTS_A_CURVE: [u32; 2] = [32, 512];

/// By how much the picture of a curve may miss it \[mm\].
const DRAWN_CHORD_MM: f64 = 0.01;

/// How many blocks of each kind a program has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BlockCounts {
    /// Rapid motions.
    pub rapid: u64,
    /// Straight motions at the feed.
    pub linear: u64,
    /// Arcs and helices.
    pub arc: u64,
    /// NURBS curves.
    pub nurbs: u64,
    /// Their control points.
    pub control_points: u64,
    /// Dwells.
    pub dwell: u64,
    /// Blocks that move nothing: words and comments.
    pub other: u64,
}

impl BlockCounts {
    fn count(&mut self, block: &Block) {
        match &block.action {
            Action::Rapid => self.rapid += 1,
            Action::Linear => self.linear += 1,
            Action::Arc(_) => self.arc += 1,
            Action::Nurbs(curve) => {
                self.nurbs += 1;
                self.control_points += curve.control_points_mm.len() as u64;
            }
            Action::Dwell { .. } => self.dwell += 1,
            Action::Auxiliary(_) | Action::Comment(_) => self.other += 1,
        }
    }

    /// Blocks that move the tool.
    pub fn motions(&self) -> u64 {
        self.rapid + self.linear + self.arc + self.nurbs
    }
}

/// Totals of a program on a machine: one pass over its blocks, with the motion planned and nothing simulated. Its memory does not
/// grow with the program.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramStatistics {
    /// How many blocks there are.
    pub blocks: BlockCounts,
    /// Length of the whole path \[mm\].
    pub length_mm: f64,
    /// Length of the motions at the feed \[mm\].
    pub feed_length_mm: f64,
    /// Length of the rapid motions \[mm\].
    pub rapid_length_mm: f64,
    /// Time from the first motion to the last rest, dwells included \[s\].
    pub time_s: f64,
    /// Time of the dwells \[s\].
    pub dwell_s: f64,
    /// Control periods that a run takes, settling included.
    pub samples: u64,
    /// Largest feed, acceleration and jerk along the path.
    pub peaks: MotionPeaks,
    /// Largest curvature of the curves \[1/mm\]; corners do not count.
    pub max_curvature_1_mm: f64,
    /// Lowest coordinates of the path \[mm\]; of curves those of 33 points each.
    pub lowest_mm: [f64; 3],
    /// Highest coordinates of the path \[mm\].
    pub highest_mm: [f64; 3],
    /// The path in at most [`MAX_DRAWN_POINTS`] points \[mm\]: all ends of blocks of a short program, fewer of a long one.
    pub points_mm: Vec<SVector<f64, 3>>,
}

impl ProgramStatistics {
    /// Reads and plans the program of these blocks.
    ///
    /// # Errors
    /// A machine out of range, what is wrong with the program, or a run of more than [`MAX_PERIODS`] periods.
    pub fn of(blocks: impl Iterator<Item = Result<Block, NcError>>, machine: &Machine) -> Result<Self, ProgramError> {
        let mut stream = Stream::new(blocks, machine)?;
        let mut counts = BlockCounts::default();
        let (mut feed_length, mut rapid_length, mut time, mut dwell) =
            (Sum::default(), Sum::default(), Sum::default(), Sum::default());
        let mut peaks = MotionPeaks { feed_mm_s: 0.0, accel_mm_s2: 0.0, jerk_mm_s3: 0.0 };
        let mut max_curvature = 0.0_f64;
        let mut picture = Picture::default();
        loop {
            match stream.next(&mut |block| counts.count(block))? {
                Next::Motion(motion) => {
                    let length = if motion.place.rapid { &mut rapid_length } else { &mut feed_length };
                    length.add(motion.shape.length_mm());
                    let curvature = curvature(&motion.shape);
                    max_curvature = max_curvature.max(curvature);
                    picture.add(&motion, curvature);
                }
                Next::Span(span) => {
                    time.add(span.pause_s());
                    time.add(span.total_s());
                    dwell.add(span.pause_s());
                    let own = span.peaks();
                    peaks.feed_mm_s = peaks.feed_mm_s.max(own.feed_mm_s);
                    peaks.accel_mm_s2 = peaks.accel_mm_s2.max(own.accel_mm_s2);
                    peaks.jerk_mm_s3 = peaks.jerk_mm_s3.max(own.jerk_mm_s3);
                }
                Next::End(pause_s) => {
                    time.add(pause_s);
                    dwell.add(pause_s);
                    break;
                }
            }
        }
        let settings = &machine.settings;
        let last =
            periods(time.value(), settings.period_s).saturating_add(periods(settings.settling_s, settings.period_s));
        if last >= MAX_PERIODS {
            let too_long = SimulationError::TooLong { periods: last.saturating_add(1), period_s: settings.period_s };
            return Err(too_long.into());
        }
        if picture.points.is_empty() {
            picture.take(stream.shapes.position_mm().unwrap_or_default(), 0.0);
        }
        Ok(Self {
            blocks: counts,
            length_mm: feed_length.value() + rapid_length.value(),
            feed_length_mm: feed_length.value(),
            rapid_length_mm: rapid_length.value(),
            time_s: time.value(),
            dwell_s: dwell.value(),
            samples: last + 1,
            peaks,
            max_curvature_1_mm: max_curvature,
            lowest_mm: picture.lowest.into(),
            highest_mm: picture.highest.into(),
            points_mm: picture.points.into_iter().map(|(_, point)| point).collect(),
        })
    }
}

/// The largest curvature between the corners.
fn curvature(shape: &Shape) -> f64 {
    let corners = shape.corners_mm();
    if corners.is_empty() {
        return shape.max_curvature_1_mm();
    }
    let length = shape.length_mm();
    let mut from = 0.0;
    let mut largest = 0.0_f64;
    for &corner in corners.iter().chain([&length]) {
        if corner > from {
            largest = largest.max(shape.curvature_bound_1_mm(from, corner.next_down().max(from)));
        }
        from = corner;
    }
    largest
}

/// Pieces of a curve, so that their chords miss it by at most [`DRAWN_CHORD_MM`]; of a tight bend in a long curve by more.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // between the bounds
fn steps(length_mm: f64, curvature_1_mm: f64) -> u32 {
    let wanted = length_mm * (curvature_1_mm / (8.0 * DRAWN_CHORD_MM)).sqrt();
    wanted.max(f64::from(POINTS_A_CURVE[0])).min(f64::from(POINTS_A_CURVE[1])) as u32
}

/// The path in a bounded number of points.
struct Picture {
    points: Vec<(f64, SVector<f64, 3>)>,
    /// Points nearer than this along the path are left out \[mm\].
    spacing: f64,
    s: f64,
    newest: Option<(f64, SVector<f64, 3>)>,
    lowest: SVector<f64, 3>,
    highest: SVector<f64, 3>,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            spacing: 0.0,
            s: 0.0,
            newest: None,
            lowest: SVector::repeat(f64::INFINITY),
            highest: SVector::repeat(f64::NEG_INFINITY),
        }
    }
}

impl Picture {
    fn add(&mut self, motion: &Motion, curvature_1_mm: f64) {
        let shape = &motion.shape;
        let length = shape.length_mm();
        let mut cursor = Cursor::default();
        if self.points.is_empty() {
            self.take(shape.point_mm(0.0, &mut cursor), 0.0);
        }
        let steps = if matches!(shape, Shape::Line(_)) { 1 } else { steps(length, curvature_1_mm) };
        for i in 1..=steps {
            let s = length * f64::from(i) / f64::from(steps);
            self.take(shape.point_mm(s, &mut cursor), self.s + s);
        }
        self.s += length;
        // The last point of all belongs to the picture: it is put back by the next one if that is too near.
        if let Some(newest) = self.newest
            && self.points.last() != Some(&newest)
        {
            self.points.push(newest);
        }
    }

    fn take(&mut self, point: SVector<f64, 3>, s: f64) {
        self.lowest = self.lowest.inf(&point);
        self.highest = self.highest.sup(&point);
        self.newest = Some((s, point));
        // The last one kept only because it was the newest gives way.
        if let [.., before, last] = &self.points[..]
            && last.0 - before.0 < self.spacing
        {
            self.points.pop();
        }
        if self.points.last().is_none_or(|(kept, _)| s - kept >= self.spacing) {
            self.points.push((s, point));
        }
        if self.points.len() > MAX_DRAWN_POINTS - 1 {
            let first = self.points.first().map_or(0.0, |(s, _)| *s);
            self.spacing = (2.0 * self.spacing).max(2.0 * (s - first) / MAX_DRAWN_POINTS as f64);
            let mut kept = f64::NEG_INFINITY;
            self.points.retain(|(s, _)| {
                let keep = s - kept >= self.spacing;
                if keep {
                    kept = *s;
                }
                keep
            });
        }
    }
}
