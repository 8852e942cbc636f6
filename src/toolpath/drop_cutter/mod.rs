//! The drop cutter: where a ball, a flat end or a bull-nose comes to rest on a surface.

mod bound;
mod checks;
mod facet;
mod mesh;
mod net;
mod newton;
mod nurbs;
mod tree;

use nalgebra::Vector2;
use rayon::prelude::*;

pub use checks::{Concavity, SurfaceFault};
pub use mesh::MeshSurface;
pub use nurbs::{Contact, NurbsDesign, REST_TOLERANCE_MM};

use super::{ContactLocation, Cutter, DesignSurface};

/// The cutter at rest above each of many points, on all cores; the same results whatever their number.
pub fn rests<S: DesignSurface + ?Sized>(
    surface: &S,
    cutter: &Cutter,
    points_mm: &[Vector2<f64>],
) -> Vec<Option<ContactLocation>> {
    points_mm.par_iter().with_min_len(64).map(|at| surface.rest(cutter, at.x, at.y)).collect()
}
