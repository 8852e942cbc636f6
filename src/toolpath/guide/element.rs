//! Lines and arcs of a boundary, the region to their left.

use nalgebra::Vector2;

/// Most lines and arcs of a contour.
pub const MAX_ELEMENTS: usize = 4_000_000;

pub(super) type Point = Vector2<f64>;

pub(super) fn cross(a: Point, b: Point) -> f64 {
    a.x * b.y - a.y * b.x
}

/// `a` turned left by a right angle.
pub(super) fn left(a: Point) -> Point {
    Point::new(-a.y, a.x)
}

/// `x` rounded up: a number of parts, 1 to `MAX_ELEMENTS`.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub(super) fn parts(x: f64) -> usize {
    x.ceil().max(1.0).min(MAX_ELEMENTS as f64) as usize
}

/// The angle from `a` to `b`, -π to π.
pub(super) fn turn(a: Point, b: Point) -> f64 {
    libm::atan2(cross(a, b), a.dot(&b))
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    Line {
        /// Unit vector.
        direction: Point,
    },
    Arc {
        centre: Point,
        radius: f64,
        /// 1: counterclockwise, its centre on the region's side. -1: clockwise.
        sense: f64,
    },
}

/// One line, or an arc of at most about a right angle.
///
/// The unit normals at its ends point into the region. They are kept and not computed from the points: an arc that began as a
/// corner keeps the directions of the lines beside it, however short it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Element {
    pub(super) start: Point,
    pub(super) end: Point,
    pub(super) normal_start: Point,
    pub(super) normal_end: Point,
    pub(super) shape: Shape,
    /// Length of a line \[mm\], angle of an arc \[rad\].
    pub(super) span: f64,
    /// The free-form curve that it is a chord of, counted from 1; 0 for none.
    pub(super) curve: u32,
}

impl Element {
    /// None where the points coincide.
    pub(super) fn line(start: Point, end: Point, curve: u32) -> Option<Self> {
        let span = (end - start).norm();
        if !(span > 0.0) {
            return None;
        }
        let direction = (end - start) / span;
        let normal = left(direction);
        let shape = Shape::Line { direction };
        Some(Self { start, end, normal_start: normal, normal_end: normal, shape, span, curve })
    }

    /// The arc around `centre` between two directions (unit vectors from the centre), at most about a right angle apart.
    pub(super) fn arc(centre: Point, radius: f64, sense: f64, from: Point, to: Point, curve: u32) -> Self {
        Self {
            start: centre + from * radius,
            end: centre + to * radius,
            normal_start: from * -sense,
            normal_end: to * -sense,
            shape: Shape::Arc { centre, radius, sense },
            span: (sense * turn(from, to)).max(0.0),
            curve,
        }
    }

    /// Run from its end to its start: the region is on its other side.
    pub(super) fn reversed(&self) -> Self {
        let shape = match self.shape {
            Shape::Line { direction } => Shape::Line { direction: -direction },
            Shape::Arc { centre, radius, sense } => Shape::Arc { centre, radius, sense: -sense },
        };
        let (start, end) = (self.end, self.start);
        Self { start, end, normal_start: -self.normal_end, normal_end: -self.normal_start, shape, ..*self }
    }

    pub(super) fn length(&self) -> f64 {
        match self.shape {
            Shape::Line { .. } => self.span,
            Shape::Arc { radius, .. } => self.span * radius,
        }
    }

    /// Radius of an arc, 0 for a line.
    pub(super) fn radius(&self) -> f64 {
        match self.shape {
            Shape::Line { .. } => 0.0,
            Shape::Arc { radius, .. } => radius,
        }
    }

    /// Millimetres a unit of the parameter.
    pub(super) fn rate(&self) -> f64 {
        match self.shape {
            Shape::Line { .. } => 1.0,
            Shape::Arc { radius, .. } => radius,
        }
    }

    /// Direction of travel at the start.
    pub(super) fn tangent_start(&self) -> Point {
        -left(self.normal_start)
    }

    /// Direction of travel at the end.
    pub(super) fn tangent_end(&self) -> Point {
        -left(self.normal_end)
    }

    /// Unit normal into the region at parameter `t` (0 to `span`).
    pub(super) fn normal(&self, t: f64) -> Point {
        match self.shape {
            Shape::Line { .. } => self.normal_start,
            Shape::Arc { sense, .. } => {
                let (sine, cosine) = libm::sincos(sense * t);
                let n = self.normal_start;
                Point::new(cosine * n.x - sine * n.y, sine * n.x + cosine * n.y)
            }
        }
    }

    /// The point at parameter `t`.
    pub(super) fn at(&self, t: f64) -> Point {
        match self.shape {
            Shape::Line { direction } => self.start + direction * t,
            Shape::Arc { centre, radius, sense } => centre - self.normal(t) * (sense * radius),
        }
    }

    /// Parameter of a point on the curve, or of the one beside it; of an arc -π to π.
    pub(super) fn parameter(&self, point: Point) -> f64 {
        match self.shape {
            Shape::Line { direction } => (point - self.start).dot(&direction),
            Shape::Arc { centre, sense, .. } => {
                let from = self.normal_start * -sense;
                sense * turn(from, point - centre)
            }
        }
    }

    /// The part between two parameters.
    pub(super) fn part(&self, from: f64, to: f64) -> Self {
        let mut part = *self;
        if from > 0.0 {
            part.start = self.at(from);
            part.normal_start = self.normal(from);
        }
        if to < self.span {
            part.end = self.at(to);
            part.normal_end = self.normal(to);
        }
        part.span = to.min(self.span) - from.max(0.0);
        part
    }

    /// The part with its ends moved by rounding errors.
    pub(super) fn with_ends(&self, start: Point, end: Point) -> Self {
        let mut moved = *self;
        moved.start = start;
        moved.end = end;
        if let Shape::Line { direction } = self.shape {
            moved.span = (end - start).dot(&direction);
        }
        moved
    }

    /// The curve at distance `d` to the left; None where the arc has shrunk to nothing.
    pub(super) fn offset(&self, d: f64) -> Option<Self> {
        let mut moved = *self;
        if let Shape::Arc { centre, radius, sense } = self.shape {
            let radius = radius - sense * d;
            if !(radius > 1e-15 * d) {
                return None;
            }
            moved.shape = Shape::Arc { centre, radius, sense };
            moved.start = centre - self.normal_start * (sense * radius);
            moved.end = centre - self.normal_end * (sense * radius);
        } else {
            moved.start += self.normal_start * d;
            moved.end += self.normal_end * d;
        }
        Some(moved)
    }

    /// Distance of a point from the element.
    pub(super) fn distance(&self, point: Point) -> f64 {
        match self.shape {
            Shape::Line { direction } => {
                let along = (point - self.start).dot(&direction);
                if along <= 0.0 {
                    (point - self.start).norm()
                } else if along >= self.span {
                    (point - self.end).norm()
                } else {
                    cross(direction, point - self.start).abs()
                }
            }
            Shape::Arc { centre, radius, sense } => {
                let w = point - centre;
                let (from, to) = (self.normal_start * -sense, self.normal_end * -sense);
                if sense * cross(from, w) >= 0.0 && sense * cross(w, to) >= 0.0 {
                    (w.norm() - radius).abs()
                } else {
                    (point - self.start).norm().min((point - self.end).norm())
                }
            }
        }
    }

    /// Twice the area between the element, seen from `origin`.
    pub(super) fn double_area(&self, origin: Point) -> f64 {
        let chord = cross(self.start - origin, self.end - origin);
        match self.shape {
            Shape::Line { .. } => chord,
            Shape::Arc { radius, sense, .. } => chord + sense * radius * radius * segment(self.span),
        }
    }

    /// The box around it.
    pub(super) fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::of(self.start);
        bounds.add(self.end);
        if let Shape::Arc { radius, .. } = self.shape {
            // The arc rises above its chord by the sagitta at most, whatever way it bulges.
            bounds.grow(radius.min(self.sagitta()));
        }
        bounds
    }

    /// How far it rises above its chord, with a little for rounding.
    fn sagitta(&self) -> f64 {
        match self.shape {
            Shape::Line { .. } => 0.0,
            Shape::Arc { radius, .. } => {
                let half = libm::sin(0.25 * self.span);
                2.001 * radius * half * half
            }
        }
    }
}

/// `x - sin x` without loss for small `x`.
fn segment(x: f64) -> f64 {
    if x < 0.1 {
        let square = x * x;
        x * square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
    } else {
        x - libm::sin(x)
    }
}

/// A box, its sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: Point,
    pub(super) high: Point,
}

impl Bounds {
    pub(super) fn of(point: Point) -> Self {
        Self { low: point, high: point }
    }

    pub(super) fn add(&mut self, point: Point) {
        self.low = self.low.inf(&point);
        self.high = self.high.sup(&point);
    }

    pub(super) fn join(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    pub(super) fn grow(&mut self, by: f64) {
        self.low -= Point::new(by, by);
        self.high += Point::new(by, by);
    }

    pub(super) fn diagonal(&self) -> f64 {
        (self.high - self.low).norm()
    }

    /// Distance of a point, 0 inside.
    pub(super) fn distance(&self, point: Point) -> f64 {
        let x = (self.low.x - point.x).max(point.x - self.high.x).max(0.0);
        let y = (self.low.y - point.y).max(point.y - self.high.y).max(0.0);
        (x * x + y * y).sqrt()
    }

    /// Whether two boxes are within `reach` of each other.
    pub(super) fn near(&self, other: &Self, reach: f64) -> bool {
        self.low.x <= other.high.x + reach
            && other.low.x <= self.high.x + reach
            && self.low.y <= other.high.y + reach
            && other.low.y <= self.high.y + reach
    }

    pub(super) fn of_elements<'a>(elements: impl IntoIterator<Item = &'a Element>) -> Option<Self> {
        elements.into_iter().map(Element::bounds).reduce(|a, b| a.join(&b))
    }
}

/// A line segment with everything that it stands for within `thickness` of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Capsule {
    start: Point,
    end: Point,
    direction: Point,
    span: f64,
    pub(super) thickness: f64,
}

impl Capsule {
    fn between(start: Point, end: Point, thickness: f64) -> Self {
        let span = (end - start).norm();
        let direction = if span > 0.0 { (end - start) / span } else { Point::zeros() };
        Self { start, end, direction, span, thickness }
    }

    pub(super) fn of(element: &Element) -> Self {
        Self::between(element.start, element.end, element.sagitta())
    }

    /// Around two that follow each other. The distance from a segment is largest at an end of the other one: it is convex.
    pub(super) fn join(&self, other: &Self) -> Self {
        let mut both = Self::between(self.start, other.end, 0.0);
        let reach = |part: &Self| both.square(part.start).max(both.square(part.end)).sqrt() + part.thickness;
        both.thickness = reach(self).max(reach(other)) * (1.0 + 1e-14);
        both
    }

    /// Square of a point's distance from the segment.
    #[inline]
    pub(super) fn square(&self, point: Point) -> f64 {
        let w = point - self.start;
        let along = w.dot(&self.direction).max(0.0).min(self.span);
        (w - self.direction * along).norm_squared()
    }

    /// Whether the two are further apart than `d`, their thickness aside. Segments that cross are near.
    #[inline]
    pub(super) fn apart(&self, other: &Self, d: f64) -> bool {
        let reach = d + self.thickness + other.thickness;
        let square = reach * reach;
        if self.square(other.start) < square || self.square(other.end) < square {
            return false;
        }
        if other.square(self.start) < square || other.square(self.end) < square {
            return false;
        }
        let sides = |a: &Self, b: &Self| {
            (cross(a.direction, b.start - a.start) < 0.0) != (cross(a.direction, b.end - a.start) < 0.0)
        };
        !(sides(self, other) && sides(other, self))
    }
}

/// What rounding does to coordinates and lengths of a figure \[mm\].
pub(super) fn rounding(bounds: &Bounds) -> f64 {
    let largest = bounds.low.amax().max(bounds.high.amax());
    4e-14 * bounds.diagonal() + 4e-15 * largest
}
