//! Which ring follows which: chains of the tree, their order, where each ring starts.

use super::nearest::{inside, on_leg};
use super::ridge::Point;
use super::rings::PlanRing;
use super::shape::corners;
use crate::toolpath::guide::Region;

/// Up to this many chains every order is tried.
const EXHAUSTIVE_CHAINS: usize = 8;

/// A ring turned so that it begins at its start, and closed: the first point again at the end.
#[derive(Debug, Clone)]
pub(super) struct Turned {
    pub(super) ring: usize,
    pub(super) line: Vec<Point>,
}

impl Turned {
    pub(super) fn start(&self) -> Point {
        self.line[0]
    }
}

/// Rings that are machined one after the other without leaving the surface, outermost first.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub(super) rings: Vec<Turned>,
    /// The chain that the parent of the first ring is in.
    parent: Option<usize>,
}

/// The chains in the order in which they are machined, outside in.
///
/// A ring is joined to the one after it only where that lies directly inside; a chain never has two rings without children, so that
/// there are at least as many chains as the tree has such rings. Joining each ring to one of its children makes exactly so
/// many, wherever the straight way to a child stays in the region.
pub(super) fn chains(rings: &[PlanRing], region: &Region) -> Vec<Chain> {
    let mut children = vec![Vec::new(); rings.len()];
    for (index, ring) in rings.iter().enumerate() {
        if let Some(parent) = ring.parent {
            children[parent].push(index);
        }
    }
    // From the innermost outwards, so that a ring starts where it is nearest to the start of the next one.
    let order = outside_in(rings, &children);
    let mut starts: Vec<Option<(usize, Point)>> = vec![None; rings.len()];
    let mut next: Vec<Option<usize>> = vec![None; rings.len()];
    for &index in order.iter().rev() {
        let points = &rings[index].points_mm;
        let mut best: Option<(f64, usize, (usize, Point))> = None;
        for &child in &children[index] {
            let Some((_, there)) = starts[child] else { continue };
            let here = nearest_start(points, there);
            let length = (here.1 - there).norm();
            if best.as_ref().is_none_or(|best| length < best.0) && clear(region, here.1, there) {
                best = Some((length, child, here));
            }
        }
        starts[index] = Some(match best {
            Some((_, child, here)) => {
                next[index] = Some(child);
                here
            }
            None => first_start(points),
        });
    }
    let mut chains: Vec<Chain> = Vec::new();
    let mut chain_of = vec![usize::MAX; rings.len()];
    for &index in &order {
        if chain_of[index] != usize::MAX {
            continue;
        }
        let parent = rings[index].parent.map(|parent| chain_of[parent]);
        let mut own = Vec::new();
        let mut ring = Some(index);
        while let Some(index) = ring {
            chain_of[index] = chains.len();
            let (leg, start) = starts[index].unwrap_or((0, rings[index].points_mm[0]));
            own.push(Turned { ring: index, line: turned(&rings[index].points_mm, leg, start) });
            ring = next[index];
        }
        chains.push(Chain { rings: own, parent });
    }
    ordered(chains)
}

/// Every ring after its parent.
fn outside_in(rings: &[PlanRing], children: &[Vec<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..rings.len()).filter(|&i| rings[i].parent.is_none()).collect();
    let mut k = 0;
    while k < order.len() {
        order.extend(&children[order[k]]);
        k += 1;
    }
    order
}

/// The point of a ring nearest to `to`, or the corner that is hardly further: a curve that begins in a corner has one corner less. With
/// the leg that it is on.
fn nearest_start(points: &[Point], to: Point) -> (usize, Point) {
    let mut best = (0, points[0], f64::INFINITY);
    for (i, a) in points.iter().enumerate() {
        let on = on_leg(&[*a, points[(i + 1) % points.len()]], to);
        let distance = (on - to).norm();
        if distance < best.2 {
            best = (i, on, distance);
        }
    }
    for i in ring_corners(points) {
        if (points[i] - to).norm() < 2.0 * best.2 {
            return (i, points[i]);
        }
    }
    (best.0, best.1)
}

fn first_start(points: &[Point]) -> (usize, Point) {
    let corner = ring_corners(points).first().copied().unwrap_or(0);
    (corner, points[corner])
}

/// Corners of a closed ring.
fn ring_corners(points: &[Point]) -> Vec<usize> {
    let closed: Vec<Point> = points.last().into_iter().chain(points).chain(points.first()).copied().collect();
    corners(&closed).into_iter().map(|i| i - 1).collect()
}

/// The ring from a point on one of its legs around to it again.
fn turned(points: &[Point], leg: usize, start: Point) -> Vec<Point> {
    let n = points.len();
    let mut line = vec![start];
    for k in 1..=n {
        let at = points[(leg + k) % n];
        if (at - line[line.len() - 1]).norm() > 1e-7 && (at - start).norm() > 1e-7 {
            line.push(at);
        }
    }
    line.push(start);
    line
}

/// Whether the straight way stays in the region.
fn clear(region: &Region, from: Point, to: Point) -> bool {
    let parts = 16;
    (1..parts).all(|k| {
        let at = from + (to - from) * (f64::from(k) / f64::from(parts));
        region.contains(at) || region.distance_mm(at) < 1e-5
    })
}

/// In the order, parents before their children, that makes the way through the air short: the shortest of all where there are few
/// chains, else always to the nearest.
fn ordered(chains: Vec<Chain>) -> Vec<Chain> {
    let ends: Vec<[Point; 2]> = chains
        .iter()
        .map(|chain| {
            let (first, last) = (&chain.rings[0], &chain.rings[chain.rings.len() - 1]);
            [first.start(), last.start()]
        })
        .collect();
    let n = chains.len();
    let mut best: (f64, Vec<usize>) = (f64::INFINITY, Vec::new());
    if n <= EXHAUSTIVE_CHAINS {
        search(&chains, &ends, &mut Vec::new(), 0.0, &mut best);
    }
    if best.1.len() != n {
        best.1.clear();
        let mut done = vec![false; n];
        for _ in 0..n {
            let from = best.1.last().map(|&k: &usize| ends[k][1]);
            let ready = |&k: &usize| !done[k] && chains[k].parent.is_none_or(|parent| done[parent]);
            let far = |k: usize| from.map_or(0.0, |from| (ends[k][0] - from).norm());
            let Some(k) = (0..n).filter(ready).min_by(|&a, &b| far(a).total_cmp(&far(b))) else { break };
            done[k] = true;
            best.1.push(k);
        }
    }
    let mut slots: Vec<Option<Chain>> = chains.into_iter().map(Some).collect();
    best.1.into_iter().filter_map(|k| slots[k].take()).collect()
}

fn search(chains: &[Chain], ends: &[[Point; 2]], so_far: &mut Vec<usize>, length: f64, best: &mut (f64, Vec<usize>)) {
    if length >= best.0 {
        return;
    }
    if so_far.len() == chains.len() {
        *best = (length, so_far.clone());
        return;
    }
    for k in 0..chains.len() {
        if so_far.contains(&k) || chains[k].parent.is_some_and(|parent| !so_far.contains(&parent)) {
            continue;
        }
        let air = so_far.last().map_or(0.0, |&last| (ends[k][0] - ends[last][1]).norm());
        so_far.push(k);
        search(chains, ends, so_far, length + air, best);
        so_far.pop();
    }
}

/// Whether two rings are turns of one helix: both around an island or neither, and everywhere about as far apart as at their starts.
pub(super) fn alike(a: &PlanRing, b: &PlanRing) -> bool {
    a.island == b.island && inside(&a.points_mm, b.points_mm[0]) != inside(&b.points_mm, a.points_mm[0])
}
