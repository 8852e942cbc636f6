//! The offset of closed boundaries by a distance `d` to their left, loops removed.
//!
//! Each line and arc is moved by `d` along its normal, and a reflex corner becomes an arc of radius `d` around it: the raw pieces. A
//! point of the true offset is a point of a raw piece that no other element of the boundary is nearer to than `d`. So from each raw
//! piece those intervals are taken away that lie within `d` of another element, and what is left is linked end to start.

use super::area::Area;
use super::element::{Bounds, Element, Point, Shape, cross, parts, rounding, turn};
use super::link::link;
use super::raw::{Boundary, Kept, NONE, Offset, Raw, Trouble};
use super::ring::Ring;

/// How often an inset is tried, each a little further in: a distance at which something just touches is avoided.
const ATTEMPTS: u32 = 12;

/// All areas further than `d` from the boundary `rings` (each closed, the region to its left).
///
/// `inherited` is the rounding of what the rings were made from: a small rest of a large region is not more exact than the region.
pub(super) fn inset(rings: &[&[Element]], d: f64, inherited: f64) -> Result<Vec<Area>, Trouble> {
    let mut trouble = Trouble { at: Point::zeros() };
    let Some(bounds) = Bounds::of_elements(rings.iter().flat_map(|ring| ring.iter())) else { return Ok(Vec::new()) };
    if d >= 0.5 * bounds.diagonal() {
        return Ok(Vec::new());
    }
    let boundary = Boundary::new(rings);
    let widest = boundary.elements.iter().map(Element::radius).fold(0.0, f64::max);
    let eps = rounding(&bounds).max(inherited).max(4e-16 * widest);
    let mut further = 0.0;
    for attempt in 0..ATTEMPTS {
        match (Offset { boundary: &boundary, d: d + further, eps, size: bounds.diagonal() }).areas() {
            Ok(areas) => return Ok(areas),
            Err(found) => trouble = found,
        }
        // In a region of 100 mm by 2e-10 mm, and 2e-9 mm at last.
        further = 30.0 * eps * f64::from(attempt + 1);
    }
    Err(trouble)
}

impl Offset<'_> {
    fn areas(&self) -> Result<Vec<Area>, Trouble> {
        let raw = self.raw();
        let kept = self.kept(&raw)?;
        let rings = self.rings(&raw, kept)?;
        self.nest(rings)
    }

    fn raw(&self) -> Vec<Raw> {
        let elements = &self.boundary.elements;
        let mut raw: Vec<Raw> = Vec::with_capacity(elements.len() * 2);
        for bounds in self.boundary.starts.windows(2) {
            let first = raw.len();
            // Whether the piece to come begins where the last one ends.
            let mut joined = false;
            let mut first_joins = false;
            let push = |raw: &mut Vec<Raw>, curve, owner, other, joined: bool| {
                let index = raw.len();
                if joined && let Some(last) = raw.last_mut() {
                    last.next = Some(index);
                }
                raw.push(Raw { curve, owner, other, next: None, smooth: [NONE; 2] });
            };
            for k in bounds[0]..bounds[1] {
                let (element, next) = (&elements[k], self.boundary.around[k][1]);
                if let Some(curve) = element.offset(self.d) {
                    first_joins |= k == bounds[0];
                    push(&mut raw, curve, k, k, joined);
                    joined = true;
                    let before = self.boundary.around[k][0];
                    if self.smooth(elements[before].normal_end, element.normal_start)
                        && !self.vanished(&elements[before])
                        && let Some(last) = raw.last_mut()
                    {
                        last.smooth[0] = before;
                    }
                } else {
                    joined = false;
                }
                let (from, to) = (element.normal_end, elements[next].normal_start);
                if self.smooth(from, to) {
                    if joined
                        && !self.vanished(&elements[next])
                        && let Some(last) = raw.last_mut()
                    {
                        last.smooth[1] = next;
                    }
                    continue;
                }
                if cross(from, to) > 0.0 {
                    joined = false;
                    continue;
                }
                let angle = turn(from, to);
                let parts = parts(-angle / 1.6);
                let mut normal = from;
                for part in 1..=parts {
                    let end = if part == parts {
                        to
                    } else {
                        let (sine, cosine) = libm::sincos(angle * part as f64 / parts as f64);
                        Point::new(cosine * from.x - sine * from.y, sine * from.x + cosine * from.y)
                    };
                    let curve = Element::arc(element.end, self.d, -1.0, normal, end, 0);
                    push(&mut raw, curve, k, next, joined);
                    joined = true;
                    normal = end;
                }
            }
            if joined
                && first_joins
                && raw.len() > first
                && let Some(last) = raw.last_mut()
            {
                last.next = Some(first);
            }
        }
        raw
    }

    /// Links the parts that stay into closed rings.
    fn rings(&self, raw: &[Raw], mut kept: Vec<Kept>) -> Result<Vec<Vec<Element>>, Trouble> {
        let reach = 4.0 * (self.eps * self.d).sqrt() + 1e4 * self.eps;
        loop {
            match link(raw, &kept, reach) {
                Ok(next) => return self.walk(&kept, &next),
                Err(loose) => {
                    // A crumb between three curves that meet in a point.
                    let before = kept.len();
                    let mut index = 0;
                    kept.retain(|part| {
                        index += 1;
                        !(loose[index - 1] && part.curve.length() < reach)
                    });
                    if kept.len() == before {
                        let at = loose.iter().position(|&l| l).map_or(Point::zeros(), |i| kept[i].curve.end);
                        return Err(Trouble { at });
                    }
                }
            }
        }
    }

    /// The rings as closed lists of elements; slivers that are nothing but rounding are left out.
    fn walk(&self, kept: &[Kept], next: &[usize]) -> Result<Vec<Vec<Element>>, Trouble> {
        let mut done = vec![false; kept.len()];
        let mut rings = Vec::new();
        for first in 0..kept.len() {
            if done[first] {
                continue;
            }
            let mut order = Vec::new();
            let mut k = first;
            while !done[k] {
                done[k] = true;
                order.push(k);
                k = next[k];
            }
            let mut ring = Vec::with_capacity(order.len());
            // Each corner is the middle between the end and the start that meet there.
            let corner = |a: usize, b: usize| (kept[a].curve.end + kept[b].curve.start) * 0.5;
            for (i, &k) in order.iter().enumerate() {
                let before = order[(i + order.len() - 1) % order.len()];
                let after = order[(i + 1) % order.len()];
                ring.push(kept[k].curve.with_ends(corner(before, k), corner(k, after)));
            }
            let tidy = tidy(ring, 2.0 * self.eps);
            let length: f64 = tidy.iter().map(Element::length).sum();
            let Some(start) = tidy.first().map(|e| e.start) else { continue };
            let area = 0.5 * tidy.iter().map(|e| e.double_area(start)).sum::<f64>();
            if area.abs() <= 20.0 * self.eps * length {
                continue;
            }
            // A simple closed curve turns once.
            if rotations(&tidy) != if area > 0.0 { 1 } else { -1 } {
                return Err(Trouble { at: start });
            }
            self.check_distance(&tidy)?;
            rings.push(tidy);
        }
        Ok(rings)
    }

    /// A few points of the ring against the whole boundary.
    fn check_distance(&self, ring: &[Element]) -> Result<(), Trouble> {
        let step = ring.len().div_ceil(16).max(1);
        let boundary = self.boundary;
        let slack = 100.0 * self.eps + 1e-6 * (self.eps * self.d).sqrt();
        for element in ring.iter().step_by(step) {
            let point = element.at(0.5 * element.span);
            if boundary.tree.nearest(&boundary.elements, point, self.d - slack).is_some() {
                return Err(Trouble { at: point });
            }
        }
        Ok(())
    }

    /// Gives each clockwise ring to the area around it.
    fn nest(&self, rings: Vec<Vec<Element>>) -> Result<Vec<Area>, Trouble> {
        let (mut outer, mut islands) = (Vec::new(), Vec::new());
        for ring in rings {
            let ring = Ring::new(ring);
            if ring.signed_area_mm2() > 0.0 { outer.push(ring) } else { islands.push(ring) }
        }
        let mut areas: Vec<Area> =
            outer.into_iter().map(|outer| Area { outer, islands: Vec::new(), rounding: self.eps }).collect();
        for island in islands {
            let Some(at) = island.elements().first().map(|e| e.start) else { continue };
            let mut inside = areas.iter().enumerate().filter(|(_, area)| area.outer.winds_around(at)).map(|(i, _)| i);
            let found = inside.next();
            let second = inside.next();
            drop(inside);
            match (found, second) {
                (Some(i), None) => areas[i].islands.push(island),
                _ => return Err(Trouble { at }),
            }
        }
        Ok(areas)
    }
}

/// How often the direction of a closed curve turns around: how often it passes the direction of X to the left, less those to the
/// right.
fn rotations(ring: &[Element]) -> i32 {
    let mut count = 0;
    let mut pass = |from: Point, to: Point, left: bool| {
        if left && from.y < 0.0 && to.y >= 0.0 {
            count += 1;
        } else if !left && from.y >= 0.0 && to.y < 0.0 {
            count -= 1;
        }
    };
    for (i, element) in ring.iter().enumerate() {
        let next = &ring[(i + 1) % ring.len()];
        if let Shape::Arc { sense, .. } = element.shape {
            pass(element.tangent_start(), element.tangent_end(), sense > 0.0);
        }
        let (from, to) = (element.tangent_end(), next.tangent_start());
        let sine = cross(from, to);
        // No corner of an offset is reflex: one that turns back does so to the left.
        pass(from, to, sine >= 0.0 || sine > -0.1 && from.dot(&to) < 0.0);
    }
    count
}

/// Elements shorter than rounding taken out, the ring closed again.
fn tidy(ring: Vec<Element>, shortest: f64) -> Vec<Element> {
    let mut tidy: Vec<Element> = Vec::with_capacity(ring.len());
    for element in ring {
        if element.span > 0.0 && element.length() > shortest {
            let mut element = element;
            if let Some(last) = tidy.last() {
                element = element.with_ends(last.end, element.end);
            }
            tidy.push(element);
        }
    }
    if let Some(end) = tidy.last().map(|e| e.end)
        && let Some(first) = tidy.first_mut()
    {
        *first = first.with_ends(end, first.end);
    }
    tidy
}
