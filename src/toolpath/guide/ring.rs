//! Closed rings of lines and arcs around areas.

use super::element::{Bounds, Element, Point, Shape, cross, parts, turn};
use super::piece::Piece;

/// A corner of a [`Ring`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where it is \[mm\].
    pub point_mm: Point,
    /// Angle on the area's side \[rad\]: below π where the corner points outwards, above π where it points into the area.
    pub interior_angle_rad: f64,
    /// Length along the ring from its first point \[mm\].
    pub along_mm: f64,
}

/// A closed curve of lines and arcs, the area to its left: counterclockwise around an area, clockwise around an island.
///
/// A ring is never open: its last piece ends where its first one starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    elements: Vec<Element>,
    bounds: Bounds,
}

impl Ring {
    pub(super) fn new(elements: Vec<Element>) -> Self {
        let bounds = Bounds::of_elements(&elements).unwrap_or(Bounds::of(Point::zeros()));
        Self { elements, bounds }
    }

    pub(super) fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// Its lines and arcs in order; of a free-form curve the chords.
    pub fn pieces(&self) -> Vec<Piece> {
        let mut pieces: Vec<(Element, f64)> = Vec::new();
        for element in &self.elements {
            if let (Shape::Arc { centre, radius, sense }, Some((last, span))) = (element.shape, pieces.last_mut())
                && last.shape == (Shape::Arc { centre, radius, sense })
                && last.end == element.start
                && *span + element.span < std::f64::consts::TAU * (1.0 + 1e-9)
            {
                *span += element.span;
                last.end = element.end;
                continue;
            }
            pieces.push((*element, element.span));
        }
        let piece = |(element, _): (Element, f64)| match element.shape {
            Shape::Line { .. } => Piece::Line { start_mm: element.start, end_mm: element.end },
            Shape::Arc { centre, sense, .. } => Piece::Arc {
                start_mm: element.start,
                end_mm: element.end,
                centre_mm: centre,
                counterclockwise: sense > 0.0,
            },
        };
        pieces.into_iter().map(piece).collect()
    }

    /// Its length \[mm\].
    pub fn length_mm(&self) -> f64 {
        self.elements.iter().map(Element::length).sum()
    }

    /// The area inside it \[mm²\], negative for a clockwise ring.
    pub fn signed_area_mm2(&self) -> f64 {
        let origin = self.bounds.low;
        0.5 * self.elements.iter().map(|e| e.double_area(origin)).sum::<f64>()
    }

    /// Points on the ring \[mm\] whose chords are within `max_chord_error_mm` of it: the ends of every piece, and of an arc as many
    /// between them as it needs. The first point is not repeated at the end. An error that is not positive asks for the ends alone.
    pub fn points_mm(&self, max_chord_error_mm: f64) -> Vec<Point> {
        let mut points = Vec::with_capacity(self.elements.len());
        for element in &self.elements {
            points.push(element.start);
            if let Shape::Arc { radius, .. } = element.shape {
                let share = max_chord_error_mm / radius;
                if share > 0.0 {
                    let step = if share < 1.0 { 2.0 * libm::acos(1.0 - share) } else { std::f64::consts::PI };
                    let parts = parts(element.span / step - 1e-9);
                    points.extend((1..parts).map(|k| element.at(element.span * k as f64 / parts as f64)));
                }
            }
        }
        points
    }

    /// The point at a length along the ring from its first point \[mm\], taken around as often as it needs; NaN: the first point.
    pub fn point_at_mm(&self, along_mm: f64) -> Point {
        let total = self.length_mm();
        let mut rest = along_mm.rem_euclid(total).max(0.0).min(total);
        for element in &self.elements {
            let length = element.length();
            if rest <= length {
                return element.at(rest / element.rate());
            }
            rest -= length;
        }
        self.elements.first().map_or_else(Point::zeros, |e| e.start)
    }

    /// The corners, where the direction changes by more than `least_turn_rad`. The joints inside a free-form curve are none.
    pub fn corners(&self, least_turn_rad: f64) -> Vec<Corner> {
        let mut corners = Vec::new();
        let mut along = 0.0;
        let mut before = self.elements.last();
        for element in &self.elements {
            if let Some(before) = before {
                let angle = turn(before.tangent_end(), element.tangent_start());
                // Chords of one curve meet at a small angle.
                let same = before.curve == element.curve && element.curve > 0 && angle.abs() < 0.35;
                if angle.abs() > least_turn_rad && !same {
                    let interior_angle_rad = std::f64::consts::PI - angle;
                    corners.push(Corner { point_mm: element.start, interior_angle_rad, along_mm: along });
                }
            }
            along += element.length();
            before = Some(element);
        }
        corners
    }

    /// Distance of a point from the ring \[mm\]; infinite for NaN.
    pub fn distance_mm(&self, point_mm: Point) -> f64 {
        self.elements.iter().map(|e| e.distance(point_mm)).fold(f64::INFINITY, f64::min)
    }

    /// Whether the ring winds around a point, in either sense.
    pub fn winds_around(&self, point_mm: Point) -> bool {
        self.bounds.distance(point_mm) <= 0.0 && winding(&self.elements, point_mm) != 0
    }
}

/// How often a closed boundary winds around a point: the polygon of the chords, and each arc's part outside its chord.
pub(super) fn winding(elements: &[Element], point: Point) -> i64 {
    let mut winding = 0;
    for element in elements {
        let (a, b) = (element.start - point, element.end - point);
        if (a.y <= 0.0) != (b.y <= 0.0) {
            let side = cross(a, b);
            if a.y <= 0.0 && side > 0.0 {
                winding += 1;
            } else if a.y > 0.0 && side < 0.0 {
                winding -= 1;
            }
        }
        if let Shape::Arc { centre, radius, sense } = element.shape
            && sense * cross(a, b) < 0.0
            && (point - centre).norm() < radius
        {
            winding += if sense > 0.0 { 1 } else { -1 };
        }
    }
    winding
}
