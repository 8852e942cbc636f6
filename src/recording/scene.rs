//! The picture for a viewer: the desired path on `/path`, the actual path and the error drawn large on `/trace` (all of it so far) and
//! `/scene` (what came since).
//!
//! A viewer that opens a recording anywhere takes the last message of each topic before that time: `/path` has one, at the beginning;
//! each of `/trace` replaces the one before and holds everything from the beginning, each of `/scene` everything since the last of `/trace`.

use nalgebra::{SVector, Vector3};

use super::foxglove::{
    Color, KeyValuePair, LinePrimitive, LineType, Point3, Pose, SceneEntity, SceneUpdate, TextPrimitive, Timestamp,
};
use crate::path::{Cursor, Path};
use crate::simulation::{Desired, Period, RunPlan};

/// Coordinate frame of every entity.
const FRAME: &str = "servosim";

/// Name of the entity that holds the desired path.
pub(crate) const DESIRED: &str = "desired path";

/// Most points that the desired path is drawn with.
const MAX_DESIRED_POINTS: usize = 4000;

/// Most points of the whole trace: it bounds the memory of a recorder, and what `/trace` adds to a long recording. When it is full every other
/// point is left out.
const MAX_TRACE_POINTS: usize = 16_000;

/// Most points since the last whole trace.
const MAX_NEWEST_POINTS: usize = 2000;

/// Messages of `/scene` in a run, and between two of `/trace`: about ten of these in a run.
const UPDATES: u64 = 50;
const UPDATES_A_TRACE: u64 = 5;

/// The entities of the actual path.
const TRACE: &str = "actual path and error";
const NEWEST: &str = "actual path and error, newest";

/// A limit that stands for the missing one when the magnification is chosen \[µm\].
const USUAL_LIMIT_UM: f64 = 30.0;

/// Share of the picture that the limit is drawn as.
const LIMIT_SHARE: f64 = 0.04;

const GREY: Color = Color { r: 0.55, g: 0.6, b: 0.65, a: 1.0 };
const BLUE: Color = Color { r: 0.15, g: 0.5, b: 0.95, a: 1.0 };
const RED: Color = Color { r: 0.9, g: 0.25, b: 0.15, a: 1.0 };

/// The picture of one run in the making. Its memory does not grow with the run.
#[derive(Debug)]
pub(crate) struct Scene {
    /// By how much the error is magnified.
    pub(crate) magnification: f64,
    /// Lowest and highest coordinates of the desired path \[mm\].
    pub(crate) extent_mm: (Vector3<f64>, Vector3<f64>),
    /// A point is kept once the tool or the drawn error has moved this far \[mm\] …
    thinning_mm: f64,
    /// … and this many periods have passed since the last one.
    stride: u64,
    since_kept: u64,
    /// `/scene` is written after this many periods.
    interval: u64,
    periods: u64,
    updates: u64,
    now: (Vector3<f64>, Vector3<f64>),
    kept: Option<(Vector3<f64>, Vector3<f64>)>,
    /// Every how many points of the newest ones go to the trace.
    trace_stride: usize,
    newest: SceneUpdate,
    trace: SceneUpdate,
}

/// What of the picture is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    Nothing,
    /// A message on `/scene`.
    Newest,
    /// One on `/trace`.
    Trace,
}

impl Scene {
    /// The scene of a run and its first message: the desired path.
    pub(crate) fn begin<const A: usize>(plan: &RunPlan<'_, A>) -> (Self, SceneUpdate) {
        let points = match plan.desired {
            Desired::Path(path) => sample(path),
            Desired::Points(points) => thinned(points),
        };
        let (low, high) = extent(&points);
        let extent_mm = (high - low).max();
        let limit_um = plan.limits.contour_error_um.filter(|limit| *limit > 0.0).unwrap_or(USUAL_LIMIT_UM);
        let magnification = round_125(LIMIT_SHARE * extent_mm / (1e-3 * limit_um));
        let drawn_mm = 1e-3 * limit_um * magnification;

        let mut desired =
            entity(DESIRED.to_owned(), 0, &[("unit", "mm"), ("error_magnification", &magnification.to_string())]);
        desired.lines.push(line(points, GREY));
        desired.texts.push(TextPrimitive {
            pose: Pose::at(low.x, high.y + 2.0 * LIMIT_SHARE * extent_mm),
            billboard: true,
            font_size: 14.0,
            scale_invariant: true,
            color: RED,
            text: format!("error × {magnification}: {limit_um} µm is drawn as {drawn_mm:.3} mm (1 unit = 1 mm)"),
        });

        let update = |id: &str| SceneUpdate {
            deletions: Vec::new(),
            entities: vec![SceneEntity {
                lines: vec![line(Vec::new(), BLUE), line(Vec::new(), RED)],
                ..entity(id.to_owned(), 0, &[("unit", "mm")])
            }],
        };
        let scene = Self {
            magnification,
            extent_mm: (low, high),
            thinning_mm: extent_mm / 2000.0,
            stride: plan.samples.div_ceil(4 * MAX_TRACE_POINTS as u64),
            since_kept: 0,
            interval: (plan.samples / UPDATES).max(50),
            periods: 0,
            updates: 0,
            now: (Vector3::zeros(), Vector3::zeros()),
            kept: None,
            trace_stride: 1,
            newest: update(NEWEST),
            trace: update(TRACE),
        };
        (scene, SceneUpdate { deletions: Vec::new(), entities: vec![desired] })
    }

    /// Takes a period; says what is due.
    #[inline]
    pub(crate) fn add<const A: usize>(&mut self, period: &Period<A>) -> Due {
        let (actual, nearest) = (space(&period.actual_mm), space(&period.nearest_mm));
        let error = nearest + self.magnification * (actual - nearest);
        self.now = (actual, error);
        let far = |a: Vector3<f64>, b: Vector3<f64>| (a - b).amax() >= self.thinning_mm;
        self.since_kept += 1;
        let moved = |(kept_actual, kept_error)| far(actual, kept_actual) || far(error, kept_error);
        if self.kept.is_none_or(|kept| self.since_kept >= self.stride && moved(kept)) {
            self.keep();
        }
        self.periods += 1;
        let is_full = points(&self.newest) >= MAX_NEWEST_POINTS;
        match (self.periods >= self.interval, self.updates + 1 >= UPDATES_A_TRACE) {
            _ if is_full => Due::Trace,
            (false, _) => Due::Nothing,
            (true, false) => Due::Newest,
            (true, true) => Due::Trace,
        }
    }

    /// What came since the last whole trace, up to the last period; none while the tool stands still.
    pub(crate) fn newest(&mut self, time_ns: u64) -> Option<&SceneUpdate> {
        (self.periods, self.updates) = (0, self.updates + 1);
        self.keep_up();
        stamp(&mut self.newest, time_ns);
        (points(&self.newest) >= 2).then_some(&self.newest)
    }

    /// The whole trace up to the last period; none while the tool stands still.
    pub(crate) fn trace(&mut self, time_ns: u64) -> Option<&SceneUpdate> {
        (self.periods, self.updates) = (0, 0);
        self.keep_up();
        if points(&self.newest) < 2 {
            return None;
        }
        stamp(&mut self.trace, time_ns);
        let (newest, trace) = (lines(&mut self.newest), lines(&mut self.trace));
        for (from, to) in newest.iter_mut().zip(trace.iter_mut()) {
            // The first point is the last one of the trace, which is always there.
            let new = from.points.get(usize::from(!to.points.is_empty())..).unwrap_or(&[]);
            let last = new.last().copied();
            to.points.extend(new.iter().step_by(self.trace_stride));
            if (new.len().max(1) - 1) % self.trace_stride != 0 {
                to.points.extend(last);
            }
            from.points.clear();
            from.points.extend(last);
        }
        if trace.iter().any(|line| line.points.len() > MAX_TRACE_POINTS) {
            self.trace_stride *= 2;
            for line in trace {
                let last = line.points.len().max(1) - 1;
                let mut index = 0;
                line.points.retain(|_| {
                    index += 1;
                    (index - 1) % 2 == 0 || index - 1 == last
                });
            }
        }
        Some(&self.trace)
    }

    /// The last period is part of the picture.
    fn keep_up(&mut self) {
        if self.kept.is_some_and(|kept| kept != self.now) {
            self.keep();
        }
    }

    fn keep(&mut self) {
        self.kept = Some(self.now);
        self.since_kept = 0;
        if let [actual, error] = lines(&mut self.newest) {
            actual.points.push(point3(self.now.0));
            error.points.push(point3(self.now.1));
        }
    }
}

/// The lines of the one entity of an update.
fn lines(update: &mut SceneUpdate) -> &mut [LinePrimitive] {
    update.entities.first_mut().map_or(&mut [], |entity| &mut entity.lines)
}

fn points(update: &SceneUpdate) -> usize {
    update.entities.first().and_then(|entity| entity.lines.first()).map_or(0, |line| line.points.len())
}

fn stamp(update: &mut SceneUpdate, time_ns: u64) {
    if let Some(entity) = update.entities.first_mut() {
        entity.timestamp = Timestamp::from_nanos(time_ns);
    }
}

/// The desired path as a polyline whose chords miss it by a hundred-thousandth of its length, or by more where that takes
/// more than [`MAX_DESIRED_POINTS`] points.
fn sample<const A: usize>(path: &dyn Path<A>) -> Vec<Point3> {
    let length = path.length_mm();
    let mut cursor = Cursor::default();
    let mut chord_mm = 1e-5 * length;
    // Four times the chord error makes half the points: ten rounds are a factor of a thousand.
    for _ in 0..10 {
        if let Some(points) = sample_within(path, length, chord_mm, &mut cursor) {
            return points;
        }
        chord_mm *= 4.0;
    }
    let last = MAX_DESIRED_POINTS - 1;
    (0..=last).map(|i| point(path.point_mm(length * i as f64 / last as f64, &mut cursor))).collect()
}

/// A chord over the arc length `h` misses a curve of curvature `κ` by at most `κ h²/8`.
fn sample_within<const A: usize>(
    path: &dyn Path<A>,
    length: f64,
    chord_mm: f64,
    cursor: &mut Cursor,
) -> Option<Vec<Point3>> {
    let longest = length / 16.0;
    let shortest = length / (16 * MAX_DESIRED_POINTS) as f64;
    let mut points = vec![point(path.point_mm(0.0, cursor))];
    let (mut s, mut step) = (0.0, longest);
    while s < length {
        if points.len() >= MAX_DESIRED_POINTS {
            return None;
        }
        step = (2.0 * step).clamp(shortest, longest);
        while step > shortest && path.curvature_bound_1_mm(s, (s + step).min(length)) * step * step > 8.0 * chord_mm {
            step *= 0.5;
        }
        // The last step is not a sliver.
        s = if s + 1.01 * step >= length { length } else { s + step };
        points.push(point(path.point_mm(s, cursor)));
    }
    Some(points)
}

/// Lowest and highest coordinates.
fn extent(points: &[Point3]) -> (Vector3<f64>, Vector3<f64>) {
    let none = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.iter().fold(none, |(low, high), p| {
        let p = Vector3::new(p.x, p.y, p.z);
        (low.inf(&p), high.sup(&p))
    })
}

/// The nearest of … 1, 2, 5, 10, 20 … , at least 1; "nearest" by ratio.
fn round_125(value: f64) -> f64 {
    let mut decade = 1.0;
    while decade < 1e12 && value >= 10.0 * decade {
        decade *= 10.0;
    }
    // Geometric means: √(1·2), √(2·5), √(5·10).
    let step = match value / decade {
        mantissa if mantissa < std::f64::consts::SQRT_2 => 1.0,
        mantissa if mantissa < 3.162_277_660_168_379_5 => 2.0,
        mantissa if mantissa < 7.071_067_811_865_475 => 5.0,
        _ => 10.0,
    };
    step * decade
}

/// The first three coordinates; a plane lies at z = 0.
fn space<const A: usize>(p: &SVector<f64, A>) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| p.get(axis).copied().unwrap_or(0.0))
}

fn point<const A: usize>(p: SVector<f64, A>) -> Point3 {
    point3(space(&p))
}

fn point3(p: Vector3<f64>) -> Point3 {
    Point3 { x: p.x, y: p.y, z: p.z }
}

/// At most [`MAX_DESIRED_POINTS`] of the points, the last one among them.
fn thinned<const A: usize>(points: &[SVector<f64, A>]) -> Vec<Point3> {
    let stride = points.len().div_ceil(MAX_DESIRED_POINTS - 1).max(1);
    let mut thin: Vec<Point3> = points.iter().step_by(stride).map(|p| point(*p)).collect();
    if let Some(last) = points.last()
        && !(points.len() - 1).is_multiple_of(stride)
    {
        thin.push(point(*last));
    }
    thin
}

fn entity(id: String, time_ns: u64, metadata: &[(&str, &str)]) -> SceneEntity {
    let pair = |&(key, value): &(&str, &str)| KeyValuePair { key: key.to_owned(), value: value.to_owned() };
    SceneEntity {
        timestamp: Timestamp::from_nanos(time_ns),
        frame_id: FRAME.to_owned(),
        id,
        metadata: metadata.iter().map(pair).collect(),
        ..SceneEntity::default()
    }
}

/// A line two pixels wide.
fn line(points: Vec<Point3>, color: Color) -> LinePrimitive {
    LinePrimitive {
        r#type: LineType::Strip.into(),
        pose: Pose::at(0.0, 0.0),
        thickness: 2.0,
        scale_invariant: true,
        points,
        color,
        ..LinePrimitive::default()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::path::{Circle, Line};

    #[test]
    fn validates_magnification_against_the_series() {
        for (value, rounded) in [
            (0.0, 1.0),
            (1.3, 1.0),
            (1.5, 2.0),
            (3.1, 2.0),
            (3.2, 5.0),
            (7.0, 5.0),
            (7.2, 10.0),
            (42.7, 50.0),
            (133.0, 100.0),
        ] {
            assert_eq!(round_125(value), rounded, "{value}");
        }
        assert_eq!(round_125(f64::NAN), 10.0);
        assert_eq!(round_125(f64::INFINITY), 1e13);
    }

    #[test]
    fn validates_desired_polyline_against_the_circle() {
        let radius = 25.0;
        let circle = Circle::new(Vector2::new(3.0, -4.0), radius, 0.3, true).unwrap();
        let points = sample(&circle);
        let chord_mm = 1e-5 * circle.length_mm();
        for pair in points.windows(2) {
            let middle = Vector2::new(0.5 * (pair[0].x + pair[1].x) - 3.0, 0.5 * (pair[0].y + pair[1].y) + 4.0);
            let miss = radius - middle.norm();
            assert!((0.0..=chord_mm).contains(&miss), "the chord misses the circle by {miss} mm");
        }
        // 281 equal chords would do; halving steps takes at most twice as many.
        assert!(points.len() <= 562, "{} points", points.len());
        let line = Line::new(Vector2::new(0.0, 0.0), Vector2::new(1e6, 0.0)).unwrap();
        let points = sample(&line);
        assert_eq!(points.last().map(|p| p.x), Some(1e6));
        assert!(points.len() <= 17, "{} points", points.len());
    }
}
