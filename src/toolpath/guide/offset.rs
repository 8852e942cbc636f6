//! The offset of closed boundaries by a distance `d` to their left, loops removed.
//!
//! Each line and arc is moved by `d` along its normal, and a reflex corner becomes an arc of radius `d` around it: the raw pieces. A
//! point of the true offset is a point of a raw piece that no other element of the boundary is nearer to than `d`. So from each raw
//! piece those intervals are taken away that lie within `d` of another element, and what is left is linked end to start.

use super::area::{Area, Ring};
use super::element::{Bounds, Capsule, Element, Point, Shape, cross, left, rounding, turn};
use super::tree::Tree;

/// Why the linking failed, and where: the caller tries again a little further in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trouble {
    pub(super) at: Point,
}

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
    let eps = rounding(&bounds).max(inherited);
    let mut further = 0.0;
    for attempt in 0..ATTEMPTS {
        match (Offset { boundary: &boundary, d: d + further, eps }).areas() {
            Ok(areas) => return Ok(areas),
            Err(found) => trouble = found,
        }
        // 2e-10 mm in a region of 100 mm at first.
        further = 200.0 * eps * f64::from(1_u32 << attempt) * (1.0 + 0.1 * f64::from(attempt));
    }
    Err(trouble)
}

/// The elements of all rings and their tree.
struct Boundary {
    elements: Vec<Element>,
    /// For each element the one before and the one after it on its ring.
    around: Vec<[usize; 2]>,
    /// First element of each ring, and the end of the last one.
    starts: Vec<usize>,
    tree: Tree,
}

impl Boundary {
    fn new(rings: &[&[Element]]) -> Self {
        let elements: Vec<Element> = rings.iter().flat_map(|ring| ring.iter().copied()).collect();
        let mut around = Vec::with_capacity(elements.len());
        let mut starts = vec![0];
        for ring in rings {
            let (first, count) = (around.len(), ring.len());
            for k in 0..count {
                around.push([first + (k + count - 1) % count, first + (k + 1) % count]);
            }
            starts.push(around.len());
        }
        let tree = Tree::new(&elements);
        Self { elements, around, starts, tree }
    }
}

/// A raw piece of the offset.
struct Raw {
    curve: Element,
    /// The element that it belongs to; of a corner the one before it.
    owner: usize,
    /// Of a corner the one after it, else the owner.
    other: usize,
    /// The raw piece that goes on where this one ends, if one does.
    next: Option<usize>,
    /// Elements to which its own goes over smoothly, the one before and the one after it. Their distance from the piece is `d` where
    /// they meet and never less, unless they are arcs that have vanished.
    smooth: [usize; 2],
}

/// Most starts that are looked at near an end.
const MOST_NEAR: usize = 100;

/// No element.
const NONE: usize = usize::MAX;

/// A part of a raw piece that stays.
struct Kept {
    raw: usize,
    curve: Element,
    /// Whether it reaches the start of its raw piece.
    whole_start: bool,
    whole_end: bool,
}

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

struct Offset<'a> {
    boundary: &'a Boundary,
    d: f64,
    eps: f64,
}

impl Offset<'_> {
    fn areas(&self) -> Result<Vec<Area>, Trouble> {
        let raw = self.raw();
        let kept = self.kept(&raw)?;
        let rings = self.rings(&raw, kept)?;
        self.nest(rings)
    }

    /// Where the normals of two elements differ by a small enough angle `a`, the offset goes on as if they were tangent: it errs by `d a²/8`, which is
    /// rounding.
    fn smooth(&self, from: Point, to: Point) -> bool {
        let sine = cross(from, to);
        sine * sine * self.d < 8.0 * self.eps && from.dot(&to) > 0.0
    }

    /// Elements further away than this have no say. What is at `d` exactly has: it may lie on the piece.
    fn reach(&self) -> f64 {
        self.d + 2.0 * self.eps
    }

    /// Whether it is an arc whose offset is beyond its centre.
    fn vanished(&self, element: &Element) -> bool {
        matches!(element.shape, Shape::Arc { radius, sense, .. } if sense > 0.0 && radius <= self.d * (1.0 + 1e-9))
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
                let parts = (-angle / 1.6).ceil().max(1.0);
                let mut normal = from;
                for part in 1..=parts as usize {
                    let end = if part as f64 >= parts {
                        to
                    } else {
                        let (sine, cosine) = libm::sincos(angle * part as f64 / parts);
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

    fn kept(&self, raw: &[Raw]) -> Result<Vec<Kept>, Trouble> {
        let mut kept = Vec::new();
        let mut cover = Cover { low: 0.0, high: 0.0, inside: Vec::new(), candidates: Vec::new() };
        for (index, piece) in raw.iter().enumerate() {
            cover.low = 0.0;
            cover.high = piece.curve.span;
            cover.inside.clear();
            self.cover(piece, &mut cover)?;
            if cover.full() {
                continue;
            }
            cover.inside.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut from = cover.low;
            let mut keep = |from: f64, to: f64| {
                let whole = (from <= 0.0, to >= piece.curve.span);
                if whole == (true, true) || (to - from) * piece.curve.rate() > self.eps {
                    let curve = piece.curve.part(from, to);
                    kept.push(Kept { raw: index, curve, whole_start: whole.0, whole_end: whole.1 });
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
    fn cover(&self, raw: &Raw, cover: &mut Cover) -> Result<(), Trouble> {
        let whole = Stretch::new(&raw.curve, 0.0, raw.curve.span);
        // Most of what goes is covered by a neighbour.
        let (before, after) = (self.boundary.around[raw.owner][0], self.boundary.around[raw.other][1]);
        for j in [after, before] {
            self.cover_by(raw, j, &whole, cover)?;
            if cover.full() {
                return Ok(());
            }
        }
        self.visit(raw, 0, &whole, cover)
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
        let child = |k: usize| {
            let capsule = tree.capsule(k)?;
            let square = capsule.square(stretch.middle);
            let reach = self.d + stretch.half + capsule.thickness;
            (square < reach * reach && !stretch.capsule.apart(capsule, self.reach())).then_some((k, square))
        };
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
        length > 20.0 * (self.eps * self.d).sqrt()
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

/// For each part the one that follows it; or which parts have a loose end or start.
fn link(raw: &[Raw], kept: &[Kept], reach: f64) -> Result<Vec<usize>, Vec<bool>> {
    let mut next = vec![NONE; kept.len()];
    let mut taken = vec![false; kept.len()];
    // Where the raw pieces go on into each other; the kept parts are in the order of the raw pieces.
    for (k, part) in kept.iter().enumerate() {
        if !part.whole_end {
            continue;
        }
        let Some(follower) = raw[part.raw].next else { continue };
        let at = kept.partition_point(|other| other.raw < follower);
        if let Some(other) = kept.get(at)
            && other.raw == follower
            && other.whole_start
        {
            next[k] = at;
            taken[at] = true;
        }
    }
    // The rest by distance, the nearest first; the wider reach is for what no near one was found for.
    for reach in [1e-3 * reach, reach] {
        let mut starts: Vec<(f64, usize)> =
            (0..kept.len()).filter(|&k| !taken[k]).map(|k| (kept[k].curve.start.x, k)).collect();
        starts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut pairs = Vec::new();
        for k in (0..kept.len()).filter(|&k| next[k] == NONE) {
            let end = kept[k].curve.end;
            let first = starts.partition_point(|s| s.0 < end.x - reach);
            let near = starts[first..].iter().take_while(|s| s.0 <= end.x + reach);
            // A rest that is all within reach would make too many pairs.
            let gaps = near.map(|s| ((kept[s.1].curve.start - end).norm(), k, s.1)).filter(|pair| pair.0 <= reach);
            pairs.extend(gaps.take(MOST_NEAR));
        }
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, k, s) in pairs {
            // A part that ends where it starts is a crumb, not a ring.
            if next[k] == NONE && !taken[s] && (k != s || kept[k].curve.length() > 4.0 * reach) {
                next[k] = s;
                taken[s] = true;
            }
        }
    }
    if next.contains(&NONE) {
        return Err((0..kept.len()).map(|k| next[k] == NONE || !taken[k]).collect());
    }
    Ok(next)
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

/// Parameters at which a curve meets an infinite line.
pub(super) fn meet_line(curve: &Element, point: Point, direction: Point, out: &mut Vec<f64>) {
    match curve.shape {
        Shape::Line { direction: own } => {
            let slope = cross(direction, own);
            out.push(-cross(direction, curve.start - point) / slope);
        }
        Shape::Arc { centre, radius, .. } => {
            let height = cross(direction, centre - point);
            let square = (radius - height) * (radius + height);
            if square >= 0.0 {
                let foot = centre - left(direction) * height;
                let half = direction * square.sqrt();
                out.push(curve.parameter(foot + half));
                out.push(curve.parameter(foot - half));
            }
        }
    }
}

/// Parameters at which a curve meets a circle.
pub(super) fn meet_circle(curve: &Element, middle: Point, size: f64, out: &mut Vec<f64>) {
    match curve.shape {
        Shape::Line { direction } => {
            let w = middle - curve.start;
            let height = cross(direction, w);
            let square = (size - height) * (size + height);
            if square >= 0.0 {
                let (b, half) = (w.dot(&direction), square.sqrt());
                out.push(b - half);
                out.push(b + half);
            }
        }
        Shape::Arc { centre, radius, .. } => {
            let w = middle - centre;
            let apart = w.norm();
            if !(apart > 0.0) {
                return;
            }
            let axis = w / apart;
            let a = 0.5 * (apart + (radius - size) * (radius + size) / apart);
            let square = (radius - a) * (radius + a);
            if square >= 0.0 {
                let half = left(axis) * square.sqrt();
                out.push(curve.parameter(centre + axis * a + half));
                out.push(curve.parameter(centre + axis * a - half));
            }
        }
    }
}
