//! How deep a region is.

use super::area::Area;
use super::element::{Bounds, Element, Point, rounding};
use super::error::GuideError;
use super::inset::inset;
use super::ring::Ring;

impl Area {
    /// The largest distance from the rings at which something is left \[mm\], and a point that is that far from them.
    ///
    /// # Errors
    /// [`GuideError::Lost`].
    pub fn depth_mm(&self) -> Result<(f64, Point), GuideError> {
        depth(&self.boundary(), self.rounding)
    }
}

/// The largest distance from the boundary at which something is left, and a point there.
///
/// By halving: as the inset goes on, fewer and fewer elements are left, so that most steps cost nothing.
pub(super) fn depth(rings: &[&[Element]], inherited: f64) -> Result<(f64, Point), GuideError> {
    let Some(bounds) = Bounds::of_elements(rings.iter().flat_map(|ring| ring.iter())) else {
        return Ok((0.0, Point::zeros()));
    };
    let rounding = rounding(&bounds).max(inherited);
    let size = bounds.high - bounds.low;
    let mut reached = 0.0;
    let mut above = 0.5 * size.min();
    let mut left: Option<Vec<Area>> = None;
    while above - reached > 50.0 * rounding {
        let mut trouble = None;
        let mut found = None;
        // Another step where one fails.
        for share in [0.5, 0.4, 0.6, 0.3, 0.7] {
            let step = share * (above - reached);
            let further = match &left {
                None => inset(rings, step, inherited),
                Some(areas) => areas.iter().try_fold(Vec::new(), |mut all, area| {
                    all.extend(area.inset(step)?);
                    Ok(all)
                }),
            };
            match further {
                Ok(areas) => {
                    found = Some((step, areas));
                    break;
                }
                Err(error) => trouble = Some(error),
            }
        }
        match (found, trouble) {
            (Some((step, areas)), _) if areas.is_empty() => above = reached + step,
            (Some((step, areas)), _) => {
                reached += step;
                left = Some(areas);
            }
            // What is left is as small as rounding.
            (None, Some(error)) if above - reached > 1e4 * rounding => return Err(error),
            (None, _) => break,
        }
    }
    let ring = left.as_ref().and_then(|areas| areas.first()).map(|area| &area.outer);
    let point = ring.map_or((bounds.low + bounds.high) * 0.5, middle);
    // The rest is not quite empty: what the point really has.
    let own = rings.iter().flat_map(|ring| ring.iter()).map(|e| e.distance(point)).fold(f64::INFINITY, f64::min);
    Ok((if left.is_some() { own.max(reached) } else { reached }, point))
}

/// A point of a ring that is a sliver or nearly a point.
fn middle(ring: &Ring) -> Point {
    let (a, b) = (ring.point_at_mm(0.0), ring.point_at_mm(0.5 * ring.length_mm()));
    let middle = (a + b) * 0.5;
    if ring.winds_around(middle) { middle } else { a }
}
