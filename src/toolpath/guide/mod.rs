//! Guide contours: a boundary in plan, offset inwards again and again, splitting where it must.
//!
//! A [`Contour`] is a closed curve of lines, arcs and NURBS curves, a [`Region`] what lies inside one and outside of islands. Its
//! [`inset`](Region::inset) is all that is further than a distance from the boundary: a list of [`Area`]s, each of which can be inset
//! further with its own distance, until nothing is left.
//!
//! Lines and arcs are offset exactly: a line becomes a parallel line, an arc a concentric one, a corner that points into the region an
//! arc around it. A free-form curve is taken by chords within a tolerance, once, before the first offset: two boundaries that are
//! within `ε` of each other have distance functions that differ by at most `ε`, so that every ring made from the chords, however far
//! in, is within `ε` of its distance from the curve, and the errors of nested insets do not add up.
//!
//! Source: Piegl, Tiller, "Computing offsets of NURBS curves and surfaces", CAD 31 (1999), for the number of chords.

mod area;
mod contour;
mod cover;
mod crossing;
mod depth;
mod element;
mod error;
mod freeform;
mod inset;
mod intersection;
mod link;
mod offset;
mod piece;
mod raw;
mod region;
mod ring;
mod tree;

pub use area::Area;
pub use contour::{CURVE_TOLERANCE_MM, Contour};
pub use element::MAX_ELEMENTS;
pub use error::GuideError;
pub use piece::Piece;
pub use region::Region;
pub use ring::{Corner, Ring};
