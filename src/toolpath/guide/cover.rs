//! What stays of the raw pieces of an offset: what no other element of the boundary is nearer to than the distance.

use rayon::prelude::*;

use super::element::{Capsule, Element, Point, Shape, cross};
use super::intersection::{meet_circle, meet_line};
use super::raw::{Kept, Offset, Raw, Trouble};

/// Raw pieces that one thread takes at a time.
const CHUNK: usize = 512;

/// Raw pieces that search the tree together.
const GROUP: usize = 8;

/// Most nodes that such a search may leave.
const MOST_NODES: usize = 12;

/// What is not yet covered of a raw piece.
struct Cover {
    low: f64,
    high: f64,
    inside: Vec<(f64, f64)>,
    candidates: Vec<f64>,
}

impl Cover {
    fn add(&mut self, from: f64, to: f64) {
        if !(from < to) || to <= self.low || from >= self.high {
            return;
        }
        if from <= self.low {
            self.low = to;
        } else if to >= self.high {
            self.high = from;
        } else {
            self.inside.push((from, to));
        }
    }

    fn full(&self) -> bool {
        self.low >= self.high
    }
}

/// A stretch of a raw piece: parameters, middle point, half its length.
#[derive(Clone, Copy)]
struct Stretch {
    from: f64,
    to: f64,
    middle: Point,
    half: f64,
    capsule: Capsule,
}

impl Stretch {
    fn new(curve: &Element, from: f64, to: f64) -> Self {
        let middle = curve.at(0.5 * (from + to));
        Self { from, to, middle, half: 0.5 * (to - from) * curve.rate(), capsule: Capsule::of(&curve.part(from, to)) }
    }
}

impl Offset<'_> {
    pub(super) fn kept(&self, raw: &[Raw]) -> Result<Vec<Kept>, Trouble> {
        let chunks: Vec<Result<Vec<Kept>, Trouble>> =
            raw.par_chunks(CHUNK).enumerate().map(|(k, chunk)| self.kept_of(chunk, k * CHUNK)).collect();
        let mut kept = Vec::with_capacity(raw.len());
        for chunk in chunks {
            kept.extend(chunk?);
        }
        Ok(kept)
    }

    /// What stays of some raw pieces that follow each other, the first one with this index.
    fn kept_of(&self, raw: &[Raw], first: usize) -> Result<Vec<Kept>, Trouble> {
        let mut kept = Vec::with_capacity(raw.len());
        let mut cover = Cover { low: 0.0, high: 0.0, inside: Vec::new(), candidates: Vec::new() };
        let mut nodes = Vec::new();
        for (index, piece) in raw.iter().enumerate() {
            if index % GROUP == 0 {
                self.nodes_near(&raw[index..raw.len().min(index + GROUP)], &mut nodes);
            }
            cover.low = 0.0;
            cover.high = piece.curve.span;
            cover.inside.clear();
            self.cover(piece, &nodes, &mut cover)?;
            if cover.full() {
                continue;
            }
            cover.inside.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut from = cover.low;
            let mut keep = |from: f64, to: f64| {
                let whole = (from <= 0.0, to >= piece.curve.span);
                if whole == (true, true) || (to - from) * piece.curve.rate() > self.eps {
                    let curve = piece.curve.part(from, to);
                    kept.push(Kept { raw: first + index, curve, whole_start: whole.0, whole_end: whole.1 });
                }
            };
            for &(a, b) in &cover.inside {
                if a >= cover.high {
                    break;
                }
                if a > from {
                    keep(from, a);
                }
                from = from.max(b);
            }
            if cover.high > from {
                keep(from, cover.high);
            }
        }
        Ok(kept)
    }

    /// Takes from a raw piece what lies within `d` of another element.
    fn cover(&self, raw: &Raw, nodes: &[usize], cover: &mut Cover) -> Result<(), Trouble> {
        let whole = Stretch::new(&raw.curve, 0.0, raw.curve.span);
        // Most of what goes is covered by a neighbour.
        let (before, after) = (self.boundary.around[raw.owner][0], self.boundary.around[raw.other][1]);
        for j in [after, before] {
            self.cover_by(raw, j, &whole, cover)?;
            if cover.full() {
                return Ok(());
            }
        }
        for &node in nodes {
            if self.square_if_near(node, &whole).is_some() {
                self.visit(raw, node, &whole, cover)?;
            }
        }
        Ok(())
    }

    /// Small nodes that hold all elements near some raw pieces that follow each other; the root where there would be many.
    fn nodes_near(&self, raw: &[Raw], nodes: &mut Vec<usize>) {
        nodes.clear();
        let tree = &self.boundary.tree;
        let Some(group) = raw.iter().map(|piece| Capsule::of(&piece.curve)).reduce(|a, b| a.join(&b)) else { return };
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            if tree.capsule(node).is_none_or(|capsule| group.apart(capsule, self.reach())) {
                continue;
            }
            if tree.is_small(node) {
                nodes.push(node);
                if nodes.len() > MOST_NODES {
                    nodes.clear();
                    nodes.push(0);
                    return;
                }
            } else {
                stack.extend([2 * node + 2, 2 * node + 1]);
            }
        }
    }

    /// Square of the distance of a stretch's middle from a node that may hold elements within reach of the stretch.
    fn square_if_near(&self, node: usize, stretch: &Stretch) -> Option<f64> {
        let capsule = self.boundary.tree.capsule(node)?;
        let square = capsule.square(stretch.middle);
        let reach = self.reach() + stretch.half + capsule.thickness;
        (square < reach * reach && !stretch.capsule.apart(capsule, self.reach())).then_some(square)
    }

    fn visit(&self, raw: &Raw, node: usize, stretch: &Stretch, cover: &mut Cover) -> Result<(), Trouble> {
        let tree = &self.boundary.tree;
        if cover.full() || stretch.to <= cover.low || stretch.from >= cover.high {
            return Ok(());
        }
        if let Some(range) = tree.leaf(node) {
            for j in range {
                if !stretch.capsule.apart(tree.leaf_capsule(j), self.reach()) {
                    self.cover_by(raw, j, stretch, cover)?;
                }
            }
            return Ok(());
        }
        // A long stretch meets boxes that its parts do not.
        if stretch.half > tree.node(node).diagonal() && stretch.half > 0.2 * self.d {
            let middle = 0.5 * (stretch.from + stretch.to);
            for part in [(stretch.from, middle), (middle, stretch.to)] {
                let part = Stretch::new(&raw.curve, part.0, part.1);
                if tree.capsule(node).is_some_and(|capsule| !part.capsule.apart(capsule, self.reach())) {
                    self.visit(raw, node, &part, cover)?;
                }
            }
            return Ok(());
        }
        let child = |k: usize| self.square_if_near(k, stretch).map(|square| (k, square));
        match (child(2 * node + 1), child(2 * node + 2)) {
            (Some(a), Some(b)) => {
                // The nearest first: it is the likeliest to cover everything.
                let (first, second) = if a.1 <= b.1 { (a.0, b.0) } else { (b.0, a.0) };
                self.visit(raw, first, stretch, cover)?;
                self.visit(raw, second, stretch, cover)
            }
            (Some((only, _)), None) | (None, Some((only, _))) => self.visit(raw, only, stretch, cover),
            (None, None) => Ok(()),
        }
    }

    /// Takes what element `j` covers.
    fn cover_by(&self, raw: &Raw, j: usize, stretch: &Stretch, cover: &mut Cover) -> Result<(), Trouble> {
        let element = &self.boundary.elements[j];
        let own = j == raw.owner || j == raw.other;
        if own {
            // Its own element is never nearer, nor are the two beside a corner; but an arc that has vanished leaves a corner that
            // looks across its centre.
            if raw.owner == raw.other || !self.vanished(element) {
                return Ok(());
            }
        }
        if raw.smooth[0] == j || raw.smooth[1] == j {
            return Ok(());
        }
        let distance = element.distance(stretch.middle);
        if distance >= self.d + stretch.half {
            return Ok(());
        }
        if distance + stretch.half < self.d - self.eps {
            cover.add(stretch.from, stretch.to);
            return Ok(());
        }
        if let (Shape::Line { direction }, Shape::Line { direction: other }) = (raw.curve.shape, element.shape) {
            return self.cover_line_by_line(raw, direction, j, other, cover);
        }
        self.candidates(raw, element, cover);
        cover.candidates.sort_by(f64::total_cmp);
        let mut from = cover.low;
        let end = cover.high;
        let candidates = std::mem::take(&mut cover.candidates);
        let mut result = Ok(());
        for to in candidates.iter().copied().filter(|t| *t > cover.low && *t < end).chain([end]).collect::<Vec<_>>() {
            if to > from {
                let middle = raw.curve.at(0.5 * (from + to));
                let depth = self.d - element.distance(middle);
                if depth > self.eps {
                    cover.add(from, to);
                } else if !own && depth >= -self.eps && self.long((to - from) * raw.curve.rate()) {
                    // Of its own corner a piece is at this distance everywhere.
                    result = Err(Trouble { at: middle });
                }
            }
            from = to;
        }
        cover.candidates = candidates;
        result
    }

    /// Whether two curves that agree to rounding over this length lie on each other; a shorter one is a grazing touch.
    fn long(&self, length: f64) -> bool {
        length > 20.0 * (self.eps * self.d.max(self.size)).sqrt()
    }

    fn cover_line_by_line(
        &self,
        raw: &Raw,
        direction: Point,
        j: usize,
        other: Point,
        cover: &mut Cover,
    ) -> Result<(), Trouble> {
        let (curve, element) = (&raw.curve, &self.boundary.elements[j]);
        let from_start = curve.start - element.start;
        // Foot on the element and height above it, both linear in t.
        let (along, along_rate) = (from_start.dot(&other), direction.dot(&other));
        let (height, height_rate) = (cross(other, from_start), cross(other, direction));
        let (mut low, mut high) = (cover.low, cover.high);
        clip(along, along_rate, 0.0, element.span, &mut low, &mut high);
        if low < high {
            if height_rate.abs() * (high - low) < self.eps {
                let depth = self.d - (height + height_rate * 0.5 * (low + high)).abs();
                if depth > self.eps {
                    cover.add(low, high);
                } else if depth >= -self.eps && self.long(high - low) {
                    return Err(Trouble { at: curve.at(0.5 * (low + high)) });
                }
            } else {
                clip(height, height_rate, -self.d, self.d, &mut low, &mut high);
                cover.add(low, high);
            }
        }
        // Each corner is the start of one element. A raw piece is never nearer than `d` to its own corners.
        if j != self.boundary.around[raw.owner][1] {
            let b = -from_start.dot(&direction);
            let h = cross(direction, from_start).abs();
            let depth = self.d - h;
            if depth > self.eps {
                let half = (depth * (self.d + h)).sqrt();
                cover.add(b - half, b + half);
            }
        }
        Ok(())
    }

    /// Parameters of the raw piece at which its distance from the element can be `d`.
    fn candidates(&self, raw: &Raw, element: &Element, cover: &mut Cover) {
        let out = &mut cover.candidates;
        out.clear();
        match element.shape {
            Shape::Line { direction } => {
                for side in [self.d, -self.d] {
                    meet_line(&raw.curve, element.start + element.normal_start * side, direction, out);
                }
            }
            Shape::Arc { centre, radius, .. } => {
                meet_circle(&raw.curve, centre, radius + self.d, out);
                meet_circle(&raw.curve, centre, (radius - self.d).abs(), out);
            }
        }
        meet_circle(&raw.curve, element.start, self.d, out);
        meet_circle(&raw.curve, element.end, self.d, out);
    }
}

/// Where `low ≤ a + b t ≤ high`, cut from an interval of `t`.
fn clip(a: f64, b: f64, low: f64, high: f64, from: &mut f64, to: &mut f64) {
    if b == 0.0 {
        if !(a > low && a < high) {
            *to = *from;
        }
        return;
    }
    let (x, y) = ((low - a) / b, (high - a) / b);
    *from = from.max(x.min(y));
    *to = to.min(x.max(y));
}
