//! What an inset leaves: connected areas.

use super::element::{Element, Point};
use super::ring::Ring;

/// A connected area: what is inside `outer` and outside of every island.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// The ring around it, counterclockwise.
    pub outer: Ring,
    /// The rings around its holes, clockwise.
    pub islands: Vec<Ring>,
    /// How exact the rings are.
    pub(super) rounding: f64,
}

impl Area {
    /// All its rings, the outer one first.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        std::iter::once(&self.outer).chain(&self.islands)
    }

    pub(super) fn boundary(&self) -> Vec<&[Element]> {
        self.rings().map(Ring::elements).collect()
    }

    /// Its size \[mm²\].
    pub fn area_mm2(&self) -> f64 {
        self.rings().map(Ring::signed_area_mm2).sum()
    }

    /// Whether a point lies in the area.
    pub fn contains(&self, point_mm: Point) -> bool {
        self.outer.winds_around(point_mm) && !self.islands.iter().any(|island| island.winds_around(point_mm))
    }

    /// Distance of a point from the nearest ring \[mm\].
    pub fn distance_mm(&self, point_mm: Point) -> f64 {
        self.rings().map(|ring| ring.distance_mm(point_mm)).fold(f64::INFINITY, f64::min)
    }
}
