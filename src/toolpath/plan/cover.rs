//! Whether the passes around an area and those one step inside leave no ridge that is too high.
//!
//! Two things are looked at. Sections: from every place of an inner ring straight to the nearest place of the outer ones, the ridge
//! between those two passes. And the places that are further than that from both: at corners of a ring (a point of the bisector of a
//! corner with the interior angle `α` is up to `d/(1 + sin(α/2))` from either ring, where `d/2` is meant), in necks and where a
//! lobe vanishes. They are sought on a grid, climbing to where the distance from both is largest, and there what the nearest pass of
//! either ring leaves. What a pass leaves at all is less, so both are upper bounds.

use rayon::prelude::*;

use super::nearest::Legs;
use super::ridge::{Pass, Point, Site};

/// The highest ridge between rings, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worst {
    pub(super) ridge_mm: f64,
    pub(super) at: Point,
}

impl Worst {
    fn larger(self, other: Self) -> Self {
        if other.ridge_mm > self.ridge_mm { other } else { self }
    }
}

/// The highest ridge in the band between `outer` rings and `inner` ones (none: the whole area) that are about `step` apart.
pub(super) fn worst(site: &Site<'_>, outer: &[Vec<Point>], inner: &[Vec<Point>], step: f64) -> Worst {
    let nothing = Worst { ridge_mm: 0.0, at: Point::zeros() };
    let Some(outside) = Legs::new(outer.iter().map(Vec::as_slice), 0.5 * step) else { return nothing };
    let inside = Legs::new(inner.iter().map(Vec::as_slice), 0.5 * step);
    let places: Vec<Point> = inner.iter().flat_map(|ring| spaced(ring, 0.25 * step)).collect();
    let sections = places.par_iter().map(|&b| {
        let a = outside.nearest(b).0;
        let ridge_mm = match (site.pass(a), site.pass(b)) {
            (Some(a), Some(b)) => site.ridge_mm(&a, &b),
            _ => f64::INFINITY,
        };
        Worst { ridge_mm, at: (a + b) * 0.5 }
    });
    // The largest of all is the same in any order; of equal ones the first.
    let sections: Vec<Worst> = sections.collect();
    let mut found = sections.into_iter().fold(nothing, Worst::larger);
    let peaks = peaks(&outside, inside.as_ref(), inner, step);
    let climbed: Vec<Worst> = peaks.par_iter().map(|&at| climb(site, &outside, inside.as_ref(), at, step)).collect();
    found = climbed.into_iter().fold(found, Worst::larger);
    found
}

/// Points of a ring at most `pitch` apart, with its corners.
pub(super) fn spaced(ring: &[Point], pitch: f64) -> Vec<Point> {
    let mut out = Vec::new();
    let mut since = f64::INFINITY;
    for (i, a) in ring.iter().enumerate() {
        let b = ring[(i + 1) % ring.len()];
        let before = ring[(i + ring.len() - 1) % ring.len()];
        let (u, v) = ((a - before).normalize(), (b - a).normalize());
        let length = (b - a).norm();
        // Of a curve's short chords not every one.
        if since + length > 0.5 * pitch || !(u.dot(&v) > 0.99) {
            out.push(*a);
            since = 0.0;
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (length / pitch).ceil().max(1.0).min(1e6) as usize;
        out.extend((1..parts).map(|k| a + (b - a) * (k as f64 / parts as f64)));
        since += length / parts as f64;
    }
    out
}

/// Places that are further than half a step from both.
fn peaks(outside: &Legs, inside: Option<&Legs>, inner: &[Vec<Point>], step: f64) -> Vec<Point> {
    let room = |at: Point| {
        let far = inside.map_or(f64::INFINITY, |legs| legs.distance_mm(at));
        far.min(outside.distance_mm(at))
    };
    let [low, high] = outside.bounds();
    let pitch = (0.2 * step).max((high - low).amax() / 2000.0);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 2000
    let rows = ((high.y - low.y) / pitch) as usize + 1;
    let seeds = (0..rows).into_par_iter().flat_map_iter(|row| {
        let y = low.y + (row as f64 + 0.5) * pitch;
        let mut crossings = Vec::new();
        outside.crossings(y, &mut crossings);
        if let Some(inside) = inside {
            inside.crossings(y, &mut crossings);
        }
        crossings.sort_by(f64::total_cmp);
        let mut seeds = Vec::new();
        for pair in crossings.chunks_exact(2) {
            let mut x = pair[0] + 0.5 * pitch.min(pair[1] - pair[0]);
            while x < pair[1] {
                seeds.push(Point::new(x, y));
                x += pitch;
            }
        }
        seeds
    });
    let mut seeds: Vec<Point> = seeds.collect();
    for ring in inner {
        for (i, b) in ring.iter().enumerate() {
            let (a, c) = (ring[(i + ring.len() - 1) % ring.len()], ring[(i + 1) % ring.len()]);
            let (u, v) = ((b - a).normalize(), (c - b).normalize());
            // Outwards along the bisector of a corner.
            if u.perp(&v) > 0.02 {
                let out = (u - v).normalize();
                seeds.extend([0.52, 0.6, 0.7, 0.85].map(|share| b + out * (share * step)));
            }
        }
    }
    let climbed: Vec<Option<Point>> = seeds
        .par_iter()
        .map(|&seed| {
            let mut at = seed;
            let mut here = room(at);
            if !(here > 0.42 * step) {
                return None;
            }
            let mut reach = 0.5 * pitch;
            while reach > 0.01 * step {
                let tries = DIRECTIONS.map(|d| at + d * reach);
                let values = tries.map(room);
                let best = (0..tries.len()).fold(0, |best, k| if values[k] > values[best] { k } else { best });
                if values[best] > here {
                    (at, here) = (tries[best], values[best]);
                } else {
                    reach *= 0.5;
                }
            }
            (here > 0.504 * step).then_some(at)
        })
        .collect();
    // One of those that came together.
    let mut taken = std::collections::HashSet::new();
    #[allow(clippy::cast_possible_truncation)]
    let key = |at: &Point| ((at.x / (0.1 * step)).floor() as i64, (at.y / (0.1 * step)).floor() as i64);
    climbed.into_iter().flatten().filter(|at| taken.insert(key(at))).collect()
}

const DIRECTIONS: [Point; 8] = {
    const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        Point::new(1.0, 0.0),
        Point::new(D, D),
        Point::new(0.0, 1.0),
        Point::new(-D, D),
        Point::new(-1.0, 0.0),
        Point::new(-D, -D),
        Point::new(0.0, -1.0),
        Point::new(D, -D),
    ]
};

/// What is left around a place, at the worst spot found.
fn climb(site: &Site<'_>, outside: &Legs, inside: Option<&Legs>, from: Point, step: f64) -> Worst {
    let left = |at: Point| {
        let Some(here) = site.pass(at) else { return f64::INFINITY };
        let of = |pass: Option<Pass>| pass.map_or(f64::INFINITY, |pass| site.left_mm(&pass, &here));
        let outer = of(site.pass(outside.nearest(at).0));
        inside.map_or(outer, |legs| outer.min(of(site.pass(legs.nearest(at).0))))
    };
    let (mut at, mut here) = (from, left(from));
    let mut reach = 0.04 * step;
    while reach > 0.01 * step && here.is_finite() && here > 0.8 * site.scallop_mm {
        let tries = DIRECTIONS.map(|d| at + d * reach);
        let values = tries.map(left);
        let best = (0..tries.len()).fold(0, |best, k| if values[k] > values[best] { k } else { best });
        if values[best] > here && values[best].is_finite() {
            (at, here) = (tries[best], values[best]);
        } else {
            reach *= 0.5;
        }
    }
    Worst { ridge_mm: here, at }
}
