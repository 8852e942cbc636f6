//! How deep a region is.

use super::area::{Area, Ring};
use super::element::{Bounds, Element, Point, rounding};
use super::{GuideError, area};

/// The largest distance from the boundary at which something is left, and a point there.
///
/// By halving: as the inset goes on, fewer and fewer elements are left, so that most steps cost nothing.
pub(super) fn depth(rings: &[&[Element]]) -> Result<(f64, Point), GuideError> {
    let Some(bounds) = Bounds::of_elements(rings.iter().flat_map(|ring| ring.iter())) else {
        return Ok((0.0, Point::zeros()));
    };
    let finest = 100.0 * rounding(&bounds);
    let size = bounds.high - bounds.low;
    let mut reached = 0.0;
    let mut above = 0.5 * size.min();
    let mut left: Option<Vec<Area>> = None;
    while above - reached > finest {
        let step = 0.5 * (above - reached);
        let further = match &left {
            None => area::inset(rings, step),
            Some(areas) => areas.iter().try_fold(Vec::new(), |mut all, area| {
                all.extend(area.inset(step)?);
                Ok(all)
            }),
        };
        match further {
            Ok(areas) if areas.is_empty() => above = reached + step,
            Ok(areas) => {
                reached += step;
                left = Some(areas);
            }
            // What is left is as small as rounding.
            Err(_) if above - reached < 1e-6 * bounds.diagonal() => above = reached + step,
            Err(error) => return Err(error),
        }
    }
    let ring = left.as_ref().and_then(|areas| areas.first()).map(|area| &area.outer);
    let point = ring.map_or((bounds.low + bounds.high) * 0.5, middle);
    Ok((reached, point))
}

/// A point of a ring that is a sliver or nearly a point.
fn middle(ring: &Ring) -> Point {
    let (a, b) = (ring.point_at_mm(0.0), ring.point_at_mm(0.5 * ring.length_mm()));
    let middle = (a + b) * 0.5;
    if ring.winds_around(middle) { middle } else { a }
}
