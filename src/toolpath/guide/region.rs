//! What is to be machined: inside a contour, outside of its islands.

use nalgebra::Vector2;

use super::area::Area;
use super::contour::{Contour, reversed};
use super::depth;
use super::element::Element;
use super::error::GuideError;
use super::inset::inset;
use super::ring::winding;

/// A region: inside its outer contour, outside of every island.
///
/// ```
/// use nalgebra::Vector2;
/// use servosim::toolpath::guide::{Contour, Region};
///
/// let square = [[0., 0.], [20., 0.], [20., 20.], [0., 20.]].map(Vector2::from);
/// let region = Region::new(Contour::polygon(&square)?, Vec::new())?;
/// let areas = region.inset(3.0)?;
/// assert_eq!(areas.len(), 1);
/// assert!((areas[0].area_mm2() - 14.0 * 14.0).abs() < 1e-9);
/// assert!(region.inset(10.0)?.is_empty());
/// assert!((region.depth_mm()?.0 - 10.0).abs() < 1e-9);
/// # Ok::<(), servosim::toolpath::guide::GuideError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Each with the region to its left, the outer one first.
    rings: Vec<Vec<Element>>,
}

impl Region {
    /// The region inside `outer` and outside of the `islands`.
    ///
    /// # Errors
    /// An island that is not inside the outer contour, or two that overlap or touch; the message says which (counted from 0) and where.
    pub fn new(outer: Contour, islands: Vec<Contour>) -> Result<Self, GuideError> {
        let corner = |contour: &Contour| contour.elements().first().map_or_else(Vector2::zeros, |e| e.start);
        for (index, island) in islands.iter().enumerate() {
            let outside = |at: Vector2<f64>| GuideError::IslandOutside { island: index, x_mm: at.x, y_mm: at.y };
            if let Some(at) = outer.meets(island) {
                return Err(outside(at));
            }
            if !outer.contains(corner(island)) {
                return Err(outside(corner(island)));
            }
            for (other, before) in islands[..index].iter().enumerate() {
                let at = before.meets(island).or_else(|| {
                    if before.contains(corner(island)) {
                        return Some(corner(island));
                    }
                    island.contains(corner(before)).then(|| corner(before))
                });
                if let Some(at) = at {
                    return Err(GuideError::IslandsMeet { first: other, second: index, x_mm: at.x, y_mm: at.y });
                }
            }
        }
        let mut rings = vec![outer.into_elements()];
        rings.extend(islands.into_iter().map(|island| reversed(&island.into_elements())));
        Ok(Self { rings })
    }

    fn boundary(&self) -> Vec<&[Element]> {
        self.rings.iter().map(Vec::as_slice).collect()
    }

    /// All connected areas of the points further than `distance_mm` from the boundary; none where the region is not that deep.
    ///
    /// # Errors
    /// A distance that is not positive and finite; [`GuideError::Lost`].
    pub fn inset(&self, distance_mm: f64) -> Result<Vec<Area>, GuideError> {
        inset(&self.boundary(), distance_mm, 0.0)
    }

    /// The largest distance from the boundary at which something is left \[mm\], and a point that is that far from it.
    ///
    /// # Errors
    /// [`GuideError::Lost`].
    pub fn depth_mm(&self) -> Result<(f64, Vector2<f64>), GuideError> {
        depth::depth(&self.boundary(), 0.0)
    }

    /// Its size \[mm²\].
    pub fn area_mm2(&self) -> f64 {
        let Some(origin) = self.rings.first().and_then(|ring| ring.first()).map(|e| e.start) else { return 0.0 };
        0.5 * self.rings.iter().flatten().map(|e| e.double_area(origin)).sum::<f64>()
    }

    /// Whether a point lies in the region.
    pub fn contains(&self, point_mm: Vector2<f64>) -> bool {
        self.rings.iter().map(|ring| winding(ring, point_mm)).sum::<i64>() > 0
    }

    /// Distance of a point from the boundary \[mm\].
    pub fn distance_mm(&self, point_mm: Vector2<f64>) -> f64 {
        self.rings.iter().flatten().map(|e| e.distance(point_mm)).fold(f64::INFINITY, f64::min)
    }
}
