//! A motion in the numbers that will be written, and what that costs.

use super::error::WriteError;
use super::fixed::{Fixed, MAX_DECIMALS};
use super::rounding::{self, Parts};
use super::writing::{Decimals, Writing};
use crate::nc::arc::distance;
use crate::nc::intervals::uniform_knots;
use crate::nc::{Action, Arc, Block, Dialect, JOIN_TOLERANCE_MM, MAX_COORDINATE_MM, MAX_FEED_MM_MIN, Nurbs};

/// Decimals of a feed and of a dwell: 0.001 mm/min and 1 ms.
const TIME_DECIMALS: u8 = 3;

/// How far knots may be from even \[of their range\], to be written where the control makes them itself.
const UNIFORM: f64 = 1e-9;

impl Decimals {
    /// The fewest decimals, from the default on, with which rounding moves no block by more than the tolerance of `writing`
    /// (whose own decimals do not matter).
    ///
    /// # Errors
    /// [`WriteError::Rounding`] where [`MAX_DECIMALS`] are not enough; else as [`Writer::write`](super::Writer::write).
    pub fn choose(blocks: &[Block], writing: &Writing) -> Result<Self, WriteError> {
        let mut decimals = Self::default();
        'again: loop {
            let trial = Writing { decimals, ..*writing };
            let mut position = None;
            for (index, block) in blocks.iter().enumerate() {
                let Some(plan) = Plan::of(block, index, position, &trial)? else { continue };
                if !(plan.parts.total_mm() <= writing.tolerance_mm) {
                    decimals = decimals.raised(plan.parts).ok_or_else(|| plan.too_coarse(index, &trial))?;
                    continue 'again;
                }
                position = Some(plan.end);
            }
            return Ok(decimals);
        }
    }

    /// One decimal more for what costs most.
    fn raised(self, parts: Parts) -> Option<Self> {
        let Self { coordinate, weight, knot } = self;
        let most = parts.coordinates_mm.max(parts.weights_mm).max(parts.knots_mm);
        let raised = if parts.knots_mm == most {
            Self { knot: knot + 1, ..self }
        } else if parts.weights_mm == most {
            Self { weight: weight + 1, ..self }
        } else {
            Self { coordinate: coordinate + 1, ..self }
        };
        (raised.coordinate.max(raised.weight).max(raised.knot) <= MAX_DECIMALS).then_some(raised)
    }
}

/// A motion in the numbers that will be written.
pub(super) struct Plan {
    pub(super) start: [Fixed; 3],
    pub(super) end: [Fixed; 3],
    pub(super) feed: Option<Fixed>,
    pub(super) parts: Parts,
    pub(super) shape: Shape,
}

pub(super) enum Shape {
    Rapid,
    Linear,
    /// The centre as seen from the start.
    Arc(Arc, [Fixed; 3]),
    Nurbs {
        degree: usize,
        points: Vec<[Fixed; 3]>,
        weights: Vec<Fixed>,
        knots: Vec<Fixed>,
    },
}

impl Plan {
    /// None where nothing moves. `position` is where the blocks before have left the tool.
    pub(super) fn of(
        block: &Block,
        index: usize,
        position: Option<[Fixed; 3]>,
        writing: &Writing,
    ) -> Result<Option<Self>, WriteError> {
        if !block.is_feed_motion() && block.action != Action::Rapid {
            return Ok(None);
        }
        let point = |point_mm: [f64; 3]| fixed_point(point_mm, index, writing.decimals.coordinate);
        let start = position.map_or_else(|| point(block.start_mm), Ok)?;
        let gap_mm = distance(block.start_mm, value(start));
        // A rapid motion to the beginning comes from anywhere.
        let first = position.is_none() && block.action == Action::Rapid;
        if !(gap_mm <= JOIN_TOLERANCE_MM.max(writing.decimals.step_mm())) {
            return Err(WriteError::NotConnected { index, gap_mm });
        }
        let feed = match (block.is_feed_motion(), block.feed_mm_min) {
            (false, _) => None,
            (true, Some(feed)) if (1e-3..=MAX_FEED_MM_MIN).contains(&feed) => Some(Fixed::nearest(feed, TIME_DECIMALS)),
            (true, feed) => return Err(WriteError::Feed { index, feed_mm_min: feed }),
        };
        let mut plan = Self { start, end: point(block.end_mm)?, feed, parts: Parts::default(), shape: Shape::Linear };
        let ends_mm = if first { 0.0 } else { gap_mm }.max(distance(block.end_mm, value(plan.end)));
        plan.parts.coordinates_mm = ends_mm;
        match &block.action {
            Action::Arc(arc) => plan.arc(arc, block, index, writing)?,
            Action::Nurbs(curve) => plan.curve(curve, index, writing)?,
            Action::Rapid => plan.shape = Shape::Rapid,
            _ => {}
        }
        Ok(Some(plan))
    }

    fn arc(&mut self, arc: &Arc, block: &Block, index: usize, writing: &Writing) -> Result<(), WriteError> {
        let (start_mm, end_mm) = (value(self.start), value(self.end));
        arc.check(block.start_mm, block.end_mm).map_err(|_| WriteError::Arc { index })?;
        let mut offset_mm = [0.0; 3];
        for &axis in &arc.plane.axes()[..2] {
            offset_mm[axis] = arc.centre_mm[axis] - start_mm[axis];
        }
        let offset = fixed_point(offset_mm, index, writing.decimals.coordinate)?;
        let rounded = Arc::around(arc.plane, arc.clockwise, start_mm, end_mm, value(offset));
        self.parts.coordinates_mm = rounded.map_or(f64::INFINITY, |rounded| {
            let moved_mm = rounding::arc((arc, block.start_mm, block.end_mm), (&rounded, start_mm, end_mm));
            moved_mm.max(self.parts.coordinates_mm)
        });
        self.shape = Shape::Arc(*arc, offset);
        Ok(())
    }

    fn curve(&mut self, curve: &Nurbs, index: usize, writing: &Writing) -> Result<(), WriteError> {
        curve.check().map_err(|fault| WriteError::Curve { index, fault })?;
        let (dialect, decimals) = (writing.dialect, writing.decimals);
        let (degree, count) = (curve.degree, curve.control_points_mm.len());
        if !dialect.degrees().contains(&degree) {
            return Err(WriteError::Degree { index, degree, dialect });
        }
        if let Some(&weight) = curve.weights.iter().find(|w| **w > dialect.max_weight()) {
            return Err(WriteError::Weight { index, weight, dialect });
        }
        let from = Nurbs { knots: curve.rescaled(), ..curve.clone() };
        let mut points: Vec<[Fixed; 3]> = from
            .control_points_mm
            .iter()
            .map(|&point_mm| fixed_point(point_mm, index, decimals.coordinate))
            .collect::<Result<_, _>>()?;
        let weights: Vec<Fixed> = from.weights.iter().map(|&w| Fixed::nearest(w, decimals.weight)).collect();
        let knots: Vec<Fixed> = from.knots.iter().map(|&u| Fixed::nearest(u, decimals.knot)).collect();
        let mut written_knots: Vec<f64> = knots.iter().map(|u| u.value()).collect();
        let first_gap_mm = distance(value(points[0]), value(self.start));
        if !(first_gap_mm <= JOIN_TOLERANCE_MM) {
            return Err(WriteError::NotConnected { index, gap_mm: first_gap_mm });
        }
        if dialect == Dialect::LinuxCnc {
            if let Some(at) = points.iter().position(|p| p[2] != self.start[2]) {
                return Err(WriteError::NotPlanar { index, point: at });
            }
            written_knots = even_knots(&from).ok_or(WriteError::NotUniform { index })?;
            // Its first control point is the tool's place.
            points[0] = self.start;
        }
        let to = Nurbs {
            degree,
            knots: written_knots,
            weights: weights.iter().map(|w| w.value()).collect(),
            control_points_mm: points.iter().map(|&p| value(p)).collect(),
        };
        let parts = rounding::curve(&from, &to);
        // What rounding has made of it may be no curve any more.
        let weights_mm = if to.weights.contains(&0.0) { f64::INFINITY } else { parts.weights_mm };
        let whole = to.weights.contains(&0.0) || to.check().is_ok();
        let knots_mm = if whole { parts.knots_mm } else { f64::INFINITY };
        self.parts =
            Parts { coordinates_mm: parts.coordinates_mm.max(self.parts.coordinates_mm), weights_mm, knots_mm };
        self.end = points[count - 1];
        self.shape = Shape::Nurbs { degree, points, weights, knots };
        Ok(())
    }

    /// The refusal of a motion that rounding moves too far.
    pub(super) fn too_coarse(&self, index: usize, writing: &Writing) -> WriteError {
        let (error_mm, tolerance_mm) = (self.parts.total_mm(), writing.tolerance_mm);
        WriteError::Rounding { index, error_mm, tolerance_mm, decimals: writing.decimals }
    }
}

impl Decimals {
    /// The diagonal of half a step of the coordinates \[mm\].
    fn step_mm(self) -> f64 {
        0.9 * Fixed::step(self.coordinate)
    }
}

/// Even knots over the range of the curve's, where those are even.
fn even_knots(curve: &Nurbs) -> Option<Vec<f64>> {
    let even = uniform_knots(curve.degree, curve.control_points_mm.len());
    let (range, last) = (*curve.knots.last()?, *even.last()?);
    let knots: Vec<f64> = even.iter().map(|u| u * range / last).collect();
    let near = curve.knots.iter().zip(&knots).all(|(u, v)| (u - v).abs() <= UNIFORM * range);
    near.then_some(knots)
}

/// Time or feed as it is written.
pub(super) fn fixed_time(value: f64) -> Fixed {
    Fixed::nearest(value, TIME_DECIMALS)
}

pub(super) fn value(point: [Fixed; 3]) -> [f64; 3] {
    point.map(Fixed::value)
}

fn fixed_point(point_mm: [f64; 3], index: usize, decimals: u8) -> Result<[Fixed; 3], WriteError> {
    match point_mm.iter().find(|c| !(c.abs() <= 2.0 * MAX_COORDINATE_MM)) {
        Some(&value) => Err(WriteError::Coordinate { index, value }),
        None => Ok(point_mm.map(|c| Fixed::nearest(c, decimals))),
    }
}
