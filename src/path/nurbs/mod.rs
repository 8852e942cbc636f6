//! NURBS curves and surfaces.
//!
//! [`NurbsCurve`] is the curve over its own parameter, [`NurbsPath`] runs along one by arc length, [`NurbsSurface`] is the
//! tensor product.

mod arc;
pub(crate) mod basis;
mod bezier;
mod curve;
mod error;
mod length;
mod run;
mod surface;

use nalgebra::SVector;

pub use curve::{BezierPiece, NurbsCurve};
pub use error::{MAX_DEGREE, NurbsError};
pub use run::{LENGTH_TOLERANCE, NurbsPath};
pub use surface::{NurbsSurface, PrincipalCurvatures, SurfacePoint};

use super::MAX_COORDINATE_MM;

/// Every coordinate finite and within [`MAX_COORDINATE_MM`].
fn check_points<const D: usize>(points: &[SVector<f64, D>]) -> Result<(), NurbsError> {
    for (index, point) in points.iter().enumerate() {
        if let Some(&value) = point.iter().find(|x| !(x.abs() <= MAX_COORDINATE_MM)) {
            return Err(NurbsError::BadCoordinate { index, value });
        }
    }
    Ok(())
}

/// Weights that are positive, one for each of `count` control points; None where all are the same: a common factor changes
/// nothing.
fn check_weights(weights: Option<Vec<f64>>, count: usize) -> Result<Option<Vec<f64>>, NurbsError> {
    let Some(weights) = weights else { return Ok(None) };
    if weights.len() != count {
        return Err(NurbsError::WrongWeightCount { given: weights.len(), points: count });
    }
    let largest = weights.iter().copied().fold(0.0, f64::max);
    for (index, &value) in weights.iter().enumerate() {
        if !(value.is_finite() && value > 0.0 && value >= 1e-9 * largest) {
            return Err(NurbsError::BadWeight { index, value });
        }
    }
    let same = weights.iter().all(|&w| w == weights[0]);
    Ok((!same).then_some(weights))
}
