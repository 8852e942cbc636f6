//! The design surface as a cutter sees it from above.

use nalgebra::Vector3;

use super::Cutter;

/// A surface to be machined along Z: a NURBS surface or a mesh, with whatever index makes it quick to ask.
///
/// Where the surface lies over itself the highest sheet counts: a cutter that rests on it from above never gouges.
pub trait DesignSurface: Send + Sync {
    /// Corners of a box around the surface \[mm\]: least and largest coordinates.
    fn bounds_mm(&self) -> [Vector3<f64>; 2];

    /// The surface's highest point on the vertical line through `(x, y)`. None beside the surface.
    fn top(&self, x_mm: f64, y_mm: f64) -> Option<SurfaceTop>;

    /// Where the cutter comes to rest with its axis on `(x, y)`: let down along Z until it first touches, its tip is at
    /// `z = max over the points Q of the surface under the cutter of Q_z - g(|Q_xy - (x, y)|)` with the profile `g`
    /// ([`Cutter::profile_mm`]). None where no point of the surface lies under the cutter.
    fn rest(&self, cutter: &Cutter, x_mm: f64, y_mm: f64) -> Option<ContactLocation>;
}

/// A highest point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceTop {
    /// Its height \[mm\].
    pub z_mm: f64,
    /// Unit normal of the surface there, upwards (`n_z ≥ 0`).
    pub normal: Vector3<f64>,
}

/// A cutter at rest on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLocation {
    /// Height of the cutter's tip \[mm\].
    pub tip_z_mm: f64,
    /// Where it touches \[mm\].
    pub contact_mm: Vector3<f64>,
    /// Unit normal of the surface there, upwards; the direction from the contact to the ball's centre where an edge or a
    /// corner is touched.
    pub normal: Vector3<f64>,
}
