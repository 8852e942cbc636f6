//! The rings of a region, one step-over inside the other, as a tree.

use rayon::prelude::*;

use super::cover::{self, Worst, spaced};
use super::nearest::inside;
use super::ridge::{Point, Site};
use super::{Options, PlanError};
use crate::toolpath::guide::{Area, Region};

/// Chord error of a ring's arcs, as a share of the path tolerance.
const CHORD_SHARE: f64 = 0.05;

/// Most steps inwards.
const MOST_LEVELS: usize = 100_000;

/// Areas that are nowhere wider than this share of a step are left out where nothing stays behind without them.
const SMALLEST: f64 = 0.1;

/// An inset of nothing: the ring on the boundary itself \[mm\].
const ON_BOUNDARY_MM: f64 = 1e-7;

/// A closed ring in plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRing {
    /// Its points \[mm\], the area to be machined on the left; the first one is not repeated.
    pub points_mm: Vec<Point>,
    /// The ring that it lies directly inside of; none for the outermost.
    pub parent: Option<usize>,
    /// Steps from the first rings inwards.
    pub level: usize,
    /// Whether it goes around an island.
    pub island: bool,
}

/// All rings and what was found on the way.
#[derive(Debug)]
#[allow(clippy::struct_field_names)] // that is what they are
pub(super) struct Rings {
    pub(super) rings: Vec<PlanRing>,
    /// Least and largest distance between neighbouring rings.
    pub(super) steps_mm: Option<[f64; 2]>,
    /// Highest ridge that the check found.
    pub(super) ridge_mm: f64,
}

struct Level {
    step: f64,
    areas: Vec<Area>,
    worst: Worst,
}

pub(super) fn rings(site: &Site<'_>, region: &Region, options: &Options, tolerance: f64) -> Result<Rings, PlanError> {
    let chord = CHORD_SHARE * tolerance;
    let mut out = Rings { rings: Vec::new(), steps_mm: None, ridge_mm: 0.0 };
    let mut areas = region.inset(options.first_inset_mm.max(ON_BOUNDARY_MM))?;
    // A sliver narrower than the path is true is none.
    let least_mm = options.first_inset_mm + 25.0 * tolerance;
    if areas.is_empty() || region.inset(least_mm)?.is_empty() {
        return Err(PlanError::NothingLeft { inset_mm: least_mm, depth_mm: region.depth_mm()?.0 });
    }
    for level in 0.. {
        if areas.is_empty() {
            break;
        }
        if level == MOST_LEVELS {
            return Err(PlanError::TooManyRings { most: MOST_LEVELS });
        }
        // Areas are independent of each other, and kept in order.
        let next: Vec<_> = areas.par_iter().map(|area| inwards(site, area, options, chord)).collect();
        for area in &areas {
            for (index, ring) in area.rings().enumerate() {
                let points_mm = ring.points_mm(chord);
                out.rings.push(PlanRing { points_mm, parent: None, level, island: index > 0 });
            }
        }
        let mut further = Vec::new();
        for found in next {
            let found = found?;
            out.ridge_mm = out.ridge_mm.max(found.worst.ridge_mm);
            if !found.areas.is_empty() {
                let [least, most] = out.steps_mm.unwrap_or([f64::INFINITY, 0.0]);
                out.steps_mm = Some([least.min(found.step), most.max(found.step)]);
            }
            further.extend(found.areas);
        }
        areas = further;
    }
    nest(&mut out.rings);
    Ok(out)
}

/// The next areas inside one, as far in as the ridge between allows.
fn inwards(site: &Site<'_>, area: &Area, options: &Options, chord: f64) -> Result<Level, PlanError> {
    // For the check chords of a ten-thousandth of a step are near enough.
    let chord = chord.max(1e-4 * site.flat_step_mm());
    let outer: Vec<Vec<Point>> = area.rings().map(|ring| ring.points_mm(chord)).collect();
    let first = smallest_step(site, &outer, options)?;
    let attempt = |step: f64| -> Result<Level, PlanError> {
        let inner = area.inset(step)?;
        let wide = |area: &Area| area.outer.length_mm() > 2.0 * SMALLEST * first;
        let areas: Vec<Area> = inner.into_iter().filter(wide).collect();
        let rings: Vec<Vec<Point>> = areas.iter().flat_map(Area::rings).map(|ring| ring.points_mm(chord)).collect();
        let worst = cover::worst(site, &outer, &rings, step);
        Ok(Level { step, areas, worst })
    };
    let mut high = first;
    let mut level = attempt(first)?;
    while !(level.worst.ridge_mm <= site.scallop_mm) {
        if level.step < first / 16.0 {
            let at = level.worst.at;
            return Err(PlanError::Uncovered { x_mm: at.x, y_mm: at.y, ridge_mm: level.worst.ridge_mm });
        }
        high = level.step;
        // Ridges grow with the square of the distance.
        let share = (site.scallop_mm / level.worst.ridge_mm).sqrt();
        level = attempt(level.step * (0.997 * share).max(0.7))?;
    }
    // Nearer to the largest step that holds.
    for _ in 0..4 {
        if high - level.step < 0.01 * high {
            break;
        }
        let between = attempt(0.5 * (high + level.step))?;
        if between.worst.ridge_mm <= site.scallop_mm { level = between } else { high = between.step }
    }
    Ok(level)
}

/// The smallest step-over on the rings of an area, inwards.
fn smallest_step(site: &Site<'_>, rings: &[Vec<Point>], options: &Options) -> Result<f64, PlanError> {
    let pitch = 0.5 * site.flat_step_mm();
    let mut places = Vec::new();
    for ring in rings {
        let points = spaced(ring, pitch);
        for (i, a) in points.iter().enumerate() {
            let leg = points[(i + 1) % points.len()] - a;
            let length = leg.norm();
            if length > 0.0 {
                places.push((a + leg * 0.5, Point::new(-leg.y, leg.x) / length));
            }
        }
    }
    let steps: Vec<Result<Option<f64>, PlanError>> = places
        .par_iter()
        .map(|&(at, normal)| {
            let pass = site.pass(at).ok_or(PlanError::NoRest { x_mm: at.x, y_mm: at.y })?;
            site.step_mm(options.step, &pass, normal)
        })
        .collect();
    let mut least = f64::INFINITY;
    for step in steps {
        if let Some(step) = step? {
            least = least.min(step);
        }
    }
    let flat = site.flat_step_mm();
    Ok(if least.is_finite() { least.max(1e-3 * flat) } else { flat })
}

/// Each ring's parent: the smallest ring that it lies inside of.
fn nest(rings: &mut [PlanRing]) {
    let size = |ring: &PlanRing| {
        let twice: f64 = (0..ring.points_mm.len())
            .map(|i| {
                let origin = ring.points_mm[0];
                let (a, b) = (ring.points_mm[i], ring.points_mm[(i + 1) % ring.points_mm.len()]);
                (a - origin).perp(&(b - origin))
            })
            .sum();
        twice.abs()
    };
    let sizes: Vec<f64> = rings.iter().map(size).collect();
    let boxes: Vec<[Point; 2]> = rings
        .iter()
        .map(|ring| {
            let first = ring.points_mm[0];
            ring.points_mm.iter().fold([first, first], |[low, high], p| [low.inf(p), high.sup(p)])
        })
        .collect();
    let parents: Vec<Option<usize>> = (0..rings.len())
        .into_par_iter()
        .map(|i| {
            let at = rings[i].points_mm[0];
            let around = |&j: &usize| {
                let [low, high] = boxes[j];
                let boxed = (low.x..=high.x).contains(&at.x) && (low.y..=high.y).contains(&at.y);
                j != i && sizes[j] > sizes[i] && boxed && inside(&rings[j].points_mm, at)
            };
            (0..rings.len()).filter(around).min_by(|&a, &b| sizes[a].total_cmp(&sizes[b]))
        })
        .collect();
    for (ring, parent) in rings.iter_mut().zip(parents) {
        ring.parent = parent;
    }
}
