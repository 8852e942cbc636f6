//! The grid of arc length: fine where the path bends, graded towards both ends.

use super::limits::{AxisLimited, PathShape, Scale};
use crate::feedrate::FeedrateError;
use crate::parameters::OutOfRange;

/// Most points of the grid of arc length.
pub const MAX_GRID_POINTS: usize = 4_000_000;

/// Step over distance to the end: speed, that grows with the power 2/3 of the distance, then changes by 3 % a step.
const GRADING: f64 = 0.05;

/// Largest turn of the tangent between two points \[rad\].
const TURN: f64 = 0.1;

/// Most joints that are looked for beyond one an interval.
const MAX_JOINTS: usize = 100_000;

/// What to do about too many points.
const TOO_LONG: &str = "the path is too long for the way on which these limits are reached: raise velocity_mm_s or jerk_mm_s3, or lower acceleration_mm_s2";

/// The points from 0 to `length`.
pub(super) fn grid<const D: usize>(
    planner: &AxisLimited<D>,
    length: f64,
    shape: &mut impl FnMut(f64) -> PathShape<D>,
) -> Result<Vec<f64>, FeedrateError> {
    let scale = planner.scale();
    // Some ten points while the acceleration builds up at full speed, but no more than fifty in the square of speed over acceleration.
    let natural = (0.1 * scale.speed * scale.accel / scale.jerk).max(0.02 * scale.speed * scale.speed / scale.accel);
    let step = planner.step_mm.unwrap_or(natural).min(0.0025 * length);
    if !(length / step < 0.5 * MAX_GRID_POINTS as f64) {
        let value = length / step;
        return Err(OutOfRange::new("grid points", value, "at most 2 million").with_help(TOO_LONG).into());
    }
    // The jerk is constant from rest until the acceleration or the speed is reached: the first interval lies well within that.
    let jerk_mm = (scale.accel.powi(3) / (6.0 * scale.jerk * scale.jerk))
        .min(scale.speed * (scale.speed / (4.5 * scale.jerk)).sqrt());
    let first = (0.05 * jerk_mm).clamp(1e-5 * step, step);

    let mut half = vec![0.0, first];
    let mut s = first;
    while s < 0.5 * length {
        s += step.min(GRADING * s);
        half.push(s);
    }
    // Both halves meet in the middle, in an interval that may be a little longer or shorter than its neighbours.
    half.retain(|s| *s < 0.5 * length);
    let last = half.last().copied().unwrap_or(0.0);
    if half.len() > 2 && 1.0 - 2.0 * last / length < 0.5 * step / length {
        half.pop();
    }
    let coarse: Vec<f64> = half.iter().copied().chain(half.iter().rev().map(|s| length - s)).collect();
    refine(planner, &coarse, shape)
}

/// Halves intervals until tangent and curvature change from point to point as their derivatives say.
fn refine<const D: usize>(
    planner: &AxisLimited<D>,
    coarse: &[f64],
    shape: &mut impl FnMut(f64) -> PathShape<D>,
) -> Result<Vec<f64>, FeedrateError> {
    let scale = planner.scale();
    // A jump of the curvature that makes the acceleration jump by less than this share of its limit is none.
    let floor = 0.002 * scale.accel / (scale.speed * scale.speed);
    let length = coarse.last().copied().unwrap_or(0.0);
    let shortest = 1e-9 * length + 1e-9;
    let mut ask = |s_mm: f64| -> Result<PathShape<D>, FeedrateError> {
        let found = shape(s_mm);
        let all = found.tangent.iter().chain(&found.curvature_1_mm).chain(&found.curvature_rate_1_mm2);
        // Squares and cubes of speeds are multiplied with these.
        if all.clone().all(|value| value.abs() <= 1e30) && found.tangent.iter().any(|value| value.abs() > 1e-3) {
            Ok(found)
        } else {
            Err(FeedrateError::BadShape { s_mm })
        }
    };
    let mut fine: Vec<f64> = vec![0.0];
    let mut from = (0.0, ask(0.0)?);
    let mut waiting = Vec::new();
    for &end in coarse.iter().skip(1) {
        waiting.push((end, ask(end)?));
        while let Some(to) = waiting.last().copied() {
            let h: f64 = to.0 - from.0;
            let middle = from.0 + 0.5 * h;
            match bend(&from.1, &to.1, h, floor) {
                Bend::Gentle => {
                    if jumps(planner, &scale, [&from.1, &ask(middle)?, &to.1])
                        && let Some(joint) = joint(planner, &scale, from, to, &mut ask)?
                    {
                        // A point of the grid: in the place of one that is near.
                        let (before, after) = (joint.0 - from.0, to.0 - joint.0);
                        if before < 0.1 * h && fine.len() > 1 {
                            fine.pop();
                        } else if after < 0.1 * h && to.0 < length {
                            waiting.pop();
                        }
                        if before > 1e-3 * h || fine.len() > 1 {
                            fine.push(joint.0);
                        }
                        from = joint;
                        // No path has joints without end: of one that seems to the rest stays as it is.
                        if after > 1e-3 * h && fine.len() < coarse.len() + MAX_JOINTS {
                            continue;
                        }
                    }
                    fine.push(to.0);
                    from = to;
                    waiting.pop();
                    if fine.len() > MAX_GRID_POINTS {
                        let value = fine.len() as f64;
                        let needed = "at most 4 million: is the path as smooth as its curvature says?";
                        return Err(OutOfRange::new("grid points", value, needed).with_help(TOO_LONG).into());
                    }
                }
                Bend::Sharp { turn_rad, curvature_1_mm } if h <= shortest => {
                    return Err(FeedrateError::Corner { s_mm: from.0, turn_rad, curvature_1_mm });
                }
                Bend::Sharp { .. } => {
                    waiting.push((middle, ask(middle)?));
                }
            }
        }
    }
    Ok(fine)
}

enum Bend {
    Gentle,
    Sharp { turn_rad: f64, curvature_1_mm: f64 },
}

/// Where the third derivative jumps between two points, and how the path runs just behind it; none where it only changes quickly.
fn joint<const D: usize>(
    planner: &AxisLimited<D>,
    scale: &Scale,
    mut from: (f64, PathShape<D>),
    mut to: (f64, PathShape<D>),
    ask: &mut impl FnMut(f64) -> Result<PathShape<D>, FeedrateError>,
) -> Result<Option<(f64, PathShape<D>)>, FeedrateError> {
    // How far the middle is off the mean of both ends: a jump keeps its share of that in every half, all else falls to a quarter.
    let off = |a: &PathShape<D>, middle: &PathShape<D>, b: &PathShape<D>| {
        let of = |i: usize| {
            let mean = 0.5 * (a.curvature_rate_1_mm2[i] + b.curvature_rate_1_mm2[i]);
            (middle.curvature_rate_1_mm2[i] - mean).abs() / planner.limits.jerk_mm_s3[i]
        };
        (0..D).map(of).fold(0.0, f64::max)
    };
    // 1e-9 of the interval: far less than the limits' inset.
    for _ in 0..30 {
        let h = to.0 - from.0;
        let middle = (from.0 + 0.5 * h, ask(from.0 + 0.5 * h)?);
        let (left, right) = (ask(from.0 + 0.25 * h)?, ask(from.0 + 0.75 * h)?);
        if off(&from.1, &left, &middle.1) > off(&middle.1, &right, &to.1) {
            to = middle;
        } else {
            from = middle;
        }
    }
    Ok(jumps(planner, scale, [&from.1, &from.1, &to.1]).then_some(to))
}

/// Whether the third derivative jumps, at the joint of two segments perhaps, so that it matters for the jerk. However the axes share it, the acceleration towards the centre is at most that of all of them.
fn jumps<const D: usize>(planner: &AxisLimited<D>, scale: &Scale, [from, middle, to]: [&PathShape<D>; 3]) -> bool {
    let size = middle.curvature_1_mm.iter().map(|k| k * k).sum::<f64>().sqrt();
    // Nor is the tool faster than the third derivative itself lets it be, by far: otherwise every change of it were a jump.
    let rate = |i: usize| {
        let of = |shape: &PathShape<D>| shape.curvature_rate_1_mm2[i].abs() / planner.limits.jerk_mm_s3[i];
        of(from).max(of(middle)).max(of(to))
    };
    let slowed = libm::cbrt(2.0 / (0..D).map(rate).fold(0.0, f64::max));
    let speed = scale.speed.min((scale.accel_norm / size).sqrt()).min(slowed);
    (0..D).any(|i| {
        let mean = 0.5 * (from.curvature_rate_1_mm2[i] + to.curvature_rate_1_mm2[i]);
        let off = (middle.curvature_rate_1_mm2[i] - mean).abs();
        off * speed * speed * speed > 1e-3 * planner.limits.jerk_mm_s3[i]
    })
}

fn bend<const D: usize>(from: &PathShape<D>, to: &PathShape<D>, h: f64, floor: f64) -> Bend {
    let (mut turn, mut unexplained, mut jump, mut size): (f64, f64, f64, f64) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..D {
        let (k0, k1) = (from.curvature_1_mm[i], to.curvature_1_mm[i]);
        let change = to.tangent[i] - from.tangent[i];
        turn = turn.max(change.abs()).max(h * k0.abs()).max(h * k1.abs());
        unexplained = unexplained.max((change - 0.5 * h * (k0 + k1)).abs());
        let rate = 0.5 * h * (from.curvature_rate_1_mm2[i] + to.curvature_rate_1_mm2[i]);
        jump = jump.max((k1 - k0 - rate).abs());
        size = size.max(k0.abs()).max(k1.abs());
    }
    if turn <= TURN && unexplained <= 0.02 && jump <= (0.02 * size).max(floor) {
        Bend::Gentle
    } else {
        Bend::Sharp { turn_rad: unexplained, curvature_1_mm: jump }
    }
}
