//! Areas further than a distance from their boundary.

use super::area::Area;
use super::element::Element;
use super::error::GuideError;
use super::offset;

impl Area {
    /// All connected areas of its points that are further than `distance_mm` from its rings; none where it is not that deep.
    ///
    /// # Errors
    /// A distance that is not positive and finite; [`GuideError::Lost`].
    pub fn inset(&self, distance_mm: f64) -> Result<Vec<Area>, GuideError> {
        inset(&self.boundary(), distance_mm, self.rounding)
    }
}

/// All connected areas of the points that are further than `distance_mm` from the rings; `inherited` is the rounding of what they were made from.
pub(super) fn inset(rings: &[&[Element]], distance_mm: f64, inherited: f64) -> Result<Vec<Area>, GuideError> {
    if !(distance_mm > 0.0 && distance_mm.is_finite()) {
        return Err(GuideError::BadDistance { distance_mm });
    }
    offset::inset(rings, distance_mm, inherited).map_err(|trouble| GuideError::Lost {
        distance_mm,
        x_mm: trouble.at.x,
        y_mm: trouble.at.y,
    })
}
