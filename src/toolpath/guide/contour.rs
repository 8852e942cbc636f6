//! Closed curves in plan, as the user gives them.

use nalgebra::Vector2;

use super::crossing::{self, Meeting};
use super::element::{Bounds, Element, MAX_ELEMENTS, Point, Shape, parts, rounding, turn};
use super::error::GuideError;
use super::freeform;
use super::piece::Piece;
use super::ring::winding;
use super::tree::Tree;
use crate::path::MAX_COORDINATE_MM;

/// How near the chords of a free-form curve stay to it, unless another tolerance is asked for \[mm\].
pub const CURVE_TOLERANCE_MM: f64 = 1e-4;

/// Widest gap between two pieces that is closed without a word \[mm\].
const GAP_MM: f64 = 1e-6;

/// Points nearer than this are one point \[mm\].
const SAME_MM: f64 = 1e-9;

/// A closed curve in plan that does not cross itself. Which way it was given makes no difference.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// Counterclockwise.
    elements: Vec<Element>,
}

impl Contour {
    /// The polygon with these corners \[mm\]; the first one may be repeated at the end. Points that coincide with the one before are
    /// left out.
    ///
    /// # Errors
    /// As [`Contour::new`]; fewer than three points.
    pub fn polygon(points_mm: &[Vector2<f64>]) -> Result<Self, GuideError> {
        check_count(points_mm.len())?;
        for (index, point) in points_mm.iter().enumerate() {
            check_point(index, *point)?;
        }
        let mut points: Vec<Point> = Vec::with_capacity(points_mm.len());
        for point in points_mm {
            if points.last().is_none_or(|last| (point - last).norm() > SAME_MM) {
                points.push(*point);
            }
        }
        while points.len() > 1 && (points[0] - points[points.len() - 1]).norm() <= SAME_MM {
            points.pop();
        }
        if points.len() < 3 {
            return Err(GuideError::TooFewPoints { points: points.len() });
        }
        let elements =
            (0..points.len()).filter_map(|i| Element::line(points[i], points[(i + 1) % points.len()], 0)).collect();
        Self::checked(elements)
    }

    /// A circle.
    ///
    /// # Errors
    /// A radius that is not positive, numbers that are not finite or too large.
    pub fn circle(centre_mm: Vector2<f64>, radius_mm: f64) -> Result<Self, GuideError> {
        let start_mm = centre_mm + Vector2::new(radius_mm, 0.0);
        Self::new(&[Piece::Arc { start_mm, end_mm: start_mm, centre_mm, counterclockwise: true }])
    }

    /// A closed curve of pieces, each starting where the one before it ends (gaps of up to 1e-6 mm are closed). Free-form curves are
    /// taken by chords within [`CURVE_TOLERANCE_MM`].
    ///
    /// # Errors
    /// Numbers that are not finite or too large, an arc whose ends are not equally far from its centre, a gap, a curve that crosses or
    /// touches itself, an area of zero; the message says where.
    pub fn new(pieces: &[Piece]) -> Result<Self, GuideError> {
        Self::with_tolerance(pieces, CURVE_TOLERANCE_MM)
    }

    /// [`Contour::new`] with free-form curves within `tolerance_mm`.
    ///
    /// # Errors
    /// As [`Contour::new`]; a tolerance that is not positive and finite.
    pub fn with_tolerance(pieces: &[Piece], tolerance_mm: f64) -> Result<Self, GuideError> {
        if !(tolerance_mm > 0.0 && tolerance_mm.is_finite()) {
            return Err(GuideError::BadTolerance { tolerance_mm });
        }
        if pieces.is_empty() {
            return Err(GuideError::TooFewPoints { points: 0 });
        }
        let mut elements: Vec<Element> = Vec::new();
        // First and last point of each piece, and the piece's elements.
        let mut ends: Vec<(usize, Point, Point, usize)> = Vec::new();
        for (index, piece) in pieces.iter().enumerate() {
            let first = elements.len();
            let (start, end) = match piece {
                Piece::Line { start_mm, end_mm } => {
                    check_point(index, *start_mm)?;
                    check_point(index, *end_mm)?;
                    if (end_mm - start_mm).norm() > SAME_MM {
                        elements.extend(Element::line(*start_mm, *end_mm, 0));
                    }
                    (*start_mm, *end_mm)
                }
                Piece::Arc { start_mm, end_mm, centre_mm, counterclockwise } => {
                    for point in [start_mm, end_mm, centre_mm] {
                        check_point(index, *point)?;
                    }
                    arc(index, *start_mm, *end_mm, *centre_mm, *counterclockwise, &mut elements)?;
                    (*start_mm, *end_mm)
                }
                Piece::Curve(curve) => {
                    let points = freeform::chords(curve, tolerance_mm)?;
                    let number = u32::try_from(index + 1).unwrap_or(u32::MAX);
                    for pair in points.windows(2) {
                        elements.extend(Element::line(pair[0], pair[1], number));
                    }
                    (points[0], points[points.len() - 1])
                }
            };
            check_count(elements.len())?;
            if elements.len() > first {
                ends.push((index, start, end, first));
            } else if (end - start).norm() > GAP_MM {
                return Err(GuideError::TooFewPoints { points: 0 });
            }
        }
        if elements.is_empty() {
            return Err(GuideError::TooFewPoints { points: 1 });
        }
        for (k, &(piece, _, end, _)) in ends.iter().enumerate() {
            let (next, start, _, first) = ends[(k + 1) % ends.len()];
            let gap_mm = (start - end).norm();
            if gap_mm > GAP_MM {
                return Err(GuideError::Open {
                    piece,
                    next,
                    gap_mm,
                    end_x_mm: end.x,
                    end_y_mm: end.y,
                    start_x_mm: start.x,
                    start_y_mm: start.y,
                });
            }
            let before = (first + elements.len() - 1) % elements.len();
            let joint = elements[before].end;
            let element = elements[first];
            elements[first] = match element.shape {
                Shape::Line { .. } => Element::line(joint, element.end, element.curve).unwrap_or(element),
                Shape::Arc { .. } => element.with_ends(joint, element.end),
            };
        }
        if elements.len() < 2 || elements.len() < 3 && elements.iter().all(|e| matches!(e.shape, Shape::Line { .. })) {
            return Err(GuideError::TooFewPoints { points: elements.len() });
        }
        Self::checked(elements)
    }

    fn checked(mut elements: Vec<Element>) -> Result<Self, GuideError> {
        check_count(elements.len())?;
        let Some(first) = elements.first().copied() else { return Err(GuideError::TooFewPoints { points: 0 }) };
        let bounds = elements.iter().map(Element::bounds).fold(first.bounds(), |a, b| a.join(&b));
        let tree = Tree::new(&elements);
        let eps = rounding(&bounds);
        if let Some(at) = crossing::itself(&elements, &tree, eps) {
            return Err(GuideError::SelfCrossing { x_mm: at.x, y_mm: at.y });
        }
        let area = 0.5 * elements.iter().map(|e| e.double_area(first.start)).sum::<f64>();
        let length: f64 = elements.iter().map(Element::length).sum();
        if !(area.abs() > 10.0 * eps * length) {
            return Err(GuideError::ZeroArea { x_mm: first.start.x, y_mm: first.start.y });
        }
        if area < 0.0 {
            elements = reversed(&elements);
        }
        Ok(Self { elements })
    }

    pub(super) fn into_elements(self) -> Vec<Element> {
        self.elements
    }

    pub(super) fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// The area inside it \[mm²\].
    pub fn area_mm2(&self) -> f64 {
        let origin = self.elements[0].start;
        0.5 * self.elements.iter().map(|e| e.double_area(origin)).sum::<f64>()
    }

    /// Its length \[mm\].
    pub fn length_mm(&self) -> f64 {
        self.elements.iter().map(Element::length).sum()
    }

    /// Whether a point lies inside.
    pub fn contains(&self, point_mm: Vector2<f64>) -> bool {
        winding(&self.elements, point_mm) != 0
    }

    /// Where two contours cross or touch.
    pub(super) fn meets(&self, other: &Self) -> Option<Point> {
        let (a, b) = (Tree::new(&self.elements), Tree::new(&other.elements));
        let bounds: Bounds = a.root().join(b.root());
        let eps = rounding(&bounds);
        let mut found = None;
        a.pairs(&b, 10.0 * eps, &mut |i, j| {
            found = crossing::meeting(&self.elements[i], &other.elements[j], Meeting::Apart, eps);
            found.is_none()
        });
        found
    }
}

fn check_count(elements: usize) -> Result<(), GuideError> {
    if elements > MAX_ELEMENTS {
        return Err(GuideError::TooManyElements { elements });
    }
    Ok(())
}

fn check_point(index: usize, point: Point) -> Result<(), GuideError> {
    match point.iter().find(|x| !(x.abs() <= MAX_COORDINATE_MM)) {
        Some(&value_mm) => Err(GuideError::BadCoordinate { index, value_mm }),
        None => Ok(()),
    }
}

/// An arc as parts of at most about a right angle.
fn arc(
    index: usize,
    start: Point,
    end: Point,
    centre: Point,
    counterclockwise: bool,
    elements: &mut Vec<Element>,
) -> Result<(), GuideError> {
    let (from, to) = (start - centre, end - centre);
    let (radius, other) = (from.norm(), to.norm());
    if !(radius > SAME_MM && (radius - other).abs() <= GAP_MM) {
        return Err(GuideError::BadArc { index, start_radius_mm: radius, end_radius_mm: other });
    }
    let sense = if counterclockwise { 1.0 } else { -1.0 };
    let (from, to) = (from / radius, to / other);
    let full = (end - start).norm() <= SAME_MM;
    let angle = if full {
        std::f64::consts::TAU
    } else {
        let angle = sense * turn(from, to);
        if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
    };
    let to = if full { from } else { to };
    let parts = parts(angle / 1.6);
    let mut before = from;
    for part in 1..=parts {
        let next = if part == parts {
            to
        } else {
            let (sine, cosine) = libm::sincos(sense * angle * part as f64 / parts as f64);
            Point::new(cosine * from.x - sine * from.y, sine * from.x + cosine * from.y)
        };
        elements.push(Element::arc(centre, radius, sense, before, next, 0));
        before = next;
    }
    Ok(())
}

/// The same boundary run the other way: the region on the other side.
pub(super) fn reversed(elements: &[Element]) -> Vec<Element> {
    elements.iter().rev().map(Element::reversed).collect()
}
