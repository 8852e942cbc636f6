//! Blocks to curves in space.

use nalgebra::SVector;

use super::{MotionFault, ProgramError};
use crate::nc::{self, Action, Block, JOIN_TOLERANCE_MM, MAX_COORDINATE_MM, MAX_DWELL_S, MAX_FEED_MM_MIN, NcError};
use crate::path::{Cursor, Foot, Frame, Helix, Line, NurbsCurve, NurbsPath, Path};
use crate::simulation::Place;

/// Motions shorter than this have no direction and are left out \[mm\].
const SHORTEST_MM: f64 = 1e-6;

/// The curve of one block, by arc length. It has two ends, even where they coincide.
#[derive(Debug, Clone)]
pub enum Shape {
    /// A straight line.
    Line(Line<3>),
    /// An arc or a helix.
    Helix(Helix),
    /// A NURBS curve.
    Nurbs(Box<NurbsPath<3>>),
}

impl Shape {
    /// As any path.
    pub fn path(&self) -> &dyn Path<3> {
        match self {
            Self::Line(line) => line,
            Self::Helix(helix) => helix,
            Self::Nurbs(nurbs) => nurbs.as_ref(),
        }
    }

    /// Arc lengths of its corners \[mm\], those at its ends left out.
    pub fn corners_mm(&self) -> &[f64] {
        match self {
            Self::Line(_) | Self::Helix(_) => &[],
            Self::Nurbs(nurbs) => {
                let corners = nurbs.corners_mm();
                let inner = corners.partition_point(|&corner| corner < nurbs.length_mm());
                corners.get(..inner).unwrap_or_default()
            }
        }
    }

    /// Arc lengths where its tangent or its curvature jumps \[mm\], those at its ends left out.
    pub fn curvature_jumps_mm(&self) -> &[f64] {
        match self {
            Self::Line(_) | Self::Helix(_) => &[],
            Self::Nurbs(nurbs) => nurbs.curvature_jumps_mm(),
        }
    }

    /// Upper bound of the third derivative with respect to arc length between two arc lengths \[1/mm²\].
    pub fn curvature_rate_bound_1_mm2(&self, from_mm: f64, to_mm: f64) -> f64 {
        match self {
            Self::Line(_) => 0.0,
            Self::Helix(helix) => helix.curvature_rate_bound_1_mm2(from_mm, to_mm),
            Self::Nurbs(nurbs) => nurbs.curvature_rate_bound_1_mm2(from_mm, to_mm),
        }
    }
}

impl Path<3> for Shape {
    #[inline]
    fn length_mm(&self) -> f64 {
        self.path().length_mm()
    }

    fn is_closed(&self) -> bool {
        false
    }

    #[inline]
    fn frame(&self, s_mm: f64, cursor: &mut Cursor) -> Frame<3> {
        match self {
            Self::Line(line) => line.frame(s_mm, cursor),
            Self::Helix(helix) => helix.frame(s_mm, cursor),
            Self::Nurbs(nurbs) => nurbs.frame(s_mm, cursor),
        }
    }

    fn curvature_bound_1_mm(&self, from_mm: f64, to_mm: f64) -> f64 {
        self.path().curvature_bound_1_mm(from_mm, to_mm)
    }

    fn max_curvature_1_mm(&self) -> f64 {
        self.path().max_curvature_1_mm()
    }

    fn nearest_local(&self, point_mm: &SVector<f64, 3>, cursor: &mut Cursor) -> Foot<3> {
        match self {
            // Not around the seam.
            Self::Nurbs(nurbs) if nurbs.is_closed() => nurbs.nearest_local_open(point_mm, cursor),
            _ => self.path().nearest_local(point_mm, cursor),
        }
    }
}

/// One motion of a program.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Where in the program.
    pub place: Place,
    /// Its curve.
    pub shape: Shape,
    /// The feed that was asked for \[mm/s\]; none: the rapid one.
    pub feed_mm_s: Option<f64>,
    /// How long the tool stands still before it \[s\].
    pub pause_s: f64,
}

/// The motions of a program: blocks in, curves out.
///
/// # Errors
/// Those of the blocks; a block that is no motion ([`MotionFault`]). After an error it ends.
#[derive(Debug, Clone)]
pub struct MotionReader<I> {
    blocks: I,
    /// Where the tool is \[mm\]; none before the first block.
    position: Option<SVector<f64, 3>>,
    blocks_read: u64,
    pause_s: f64,
    /// A block that has to wait for the gap before it.
    waiting: Option<Motion>,
    over: bool,
}

impl<I: Iterator<Item = Result<Block, NcError>>> MotionReader<I> {
    /// The motions of these blocks, such as a [`Reader`](crate::nc::Reader)'s.
    pub fn new(blocks: I) -> Self {
        Self { blocks, position: None, blocks_read: 0, pause_s: 0.0, waiting: None, over: false }
    }

    /// Where the tool is after the last motion, before the first one where that begins. None before the first block.
    pub fn position_mm(&self) -> Option<SVector<f64, 3>> {
        self.position
    }

    /// How long the tool has stood still since the last motion \[s\].
    pub fn pause_s(&self) -> f64 {
        self.pause_s
    }

    /// The next motion; `see` is shown every block on the way.
    pub(super) fn next_seeing(&mut self, see: &mut dyn FnMut(&Block)) -> Option<Result<Motion, ProgramError>> {
        if let Some(motion) = self.waiting.take() {
            return Some(Ok(motion));
        }
        while !self.over {
            let block = match self.blocks.next() {
                None => {
                    self.over = true;
                    return None;
                }
                Some(Err(error)) => {
                    self.over = true;
                    return Some(Err(error.into()));
                }
                Some(Ok(block)) => block,
            };
            see(&block);
            match self.motion(&block) {
                Ok(None) => {}
                Ok(Some(motion)) => return Some(Ok(motion)),
                Err(fault) => {
                    self.over = true;
                    return Some(Err(ProgramError::Motion { line: block.line, fault }));
                }
            }
        }
        None
    }

    fn motion(&mut self, block: &Block) -> Result<Option<Motion>, MotionFault> {
        let place = Place { line: block.line, block: self.blocks_read, rapid: block.action == Action::Rapid };
        self.blocks_read += 1;
        let feed_mm_s = match &block.action {
            Action::Auxiliary(_) | Action::Comment(_) => return Ok(None),
            Action::Dwell { time_s } => {
                if !(0.0..=MAX_DWELL_S).contains(time_s) {
                    return Err(MotionFault::Dwell { time_s: *time_s });
                }
                self.pause_s += time_s;
                return Ok(None);
            }
            Action::Rapid => None,
            Action::Linear | Action::Arc(_) | Action::Nurbs(_) => match block.feed_mm_min {
                Some(feed) if feed > 0.0 && feed <= MAX_FEED_MM_MIN => Some((feed / 60.0).max(1e-6)),
                feed_mm_min => return Err(MotionFault::Feed { feed_mm_min }),
            },
        };
        if let Some(&value) = block.start_mm.iter().chain(&block.end_mm).find(|c| !(c.abs() <= MAX_COORDINATE_MM)) {
            return Err(MotionFault::Coordinate { value });
        }
        let (start, end) = (SVector::from(block.start_mm), SVector::from(block.end_mm));
        let here = *self.position.get_or_insert(start);
        let gap_mm = (start - here).norm();
        if !(gap_mm <= JOIN_TOLERANCE_MM) {
            return Err(MotionFault::NotConnected { gap_mm });
        }
        let motion = |shape| Motion { place, shape, feed_mm_s, pause_s: 0.0 };
        let line = |from: SVector<f64, 3>, to: SVector<f64, 3>| -> Result<Option<Motion>, MotionFault> {
            Ok(if (to - from).norm() > SHORTEST_MM { Some(motion(Shape::Line(Line::new(from, to)?))) } else { None })
        };
        let found = match &block.action {
            Action::Arc(arc) => {
                let centre = SVector::from(arc.centre_mm);
                let sweep = arc.sweep_rad(block.start_mm, block.end_mm);
                let length = sweep * arc.radius_mm(block.start_mm) + (end - start).norm();
                // What is not a number is refused by the helix.
                if length <= 2.0 * SHORTEST_MM {
                    None
                } else {
                    let helix = Helix::new(start, end, centre, arc.plane.axes(), sweep, arc.clockwise)?;
                    let arc = motion(Shape::Helix(helix));
                    match line(here, start)? {
                        Some(bridge) => {
                            self.waiting = Some(arc);
                            Some(bridge)
                        }
                        None => Some(arc),
                    }
                }
            }
            Action::Nurbs(curve) => {
                if curve.polygon_length_mm() <= SHORTEST_MM {
                    None
                } else {
                    Some(motion(Shape::Nurbs(Box::new(nurbs(curve, here)?))))
                }
            }
            _ => line(here, end)?,
        };
        Ok(found.map(|mut motion| {
            self.position = Some(end);
            motion.pause_s = std::mem::take(&mut self.pause_s);
            motion
        }))
    }
}

impl<I: Iterator<Item = Result<Block, NcError>>> Iterator for MotionReader<I> {
    type Item = Result<Motion, ProgramError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_seeing(&mut |_| {})
    }
}

/// The curve from where the tool is: its first control point, which may be off by rounding, is put there.
fn nurbs(curve: &nc::Nurbs, here: SVector<f64, 3>) -> Result<NurbsPath<3>, MotionFault> {
    curve.check()?;
    let mut points: Vec<SVector<f64, 3>> = curve.control_points_mm.iter().map(|&point| point.into()).collect();
    if let Some(first) = points.first_mut() {
        let gap_mm = (*first - here).norm();
        if !(gap_mm <= JOIN_TOLERANCE_MM) {
            return Err(MotionFault::NotConnected { gap_mm });
        }
        *first = here;
    }
    let knots = curve.rescaled();
    let curve = NurbsCurve::new(curve.degree, knots, points, Some(curve.weights.clone()))?;
    Ok(NurbsPath::new(curve)?)
}
