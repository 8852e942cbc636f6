//! Pieces of which a closed curve in plan is made.

use nalgebra::Vector2;

use crate::path::NurbsCurve;

/// One piece of a closed curve.
#[derive(Debug, Clone, PartialEq)]
pub enum Piece {
    /// A straight line.
    Line {
        /// Where it starts \[mm\].
        start_mm: Vector2<f64>,
        /// Where it ends \[mm\].
        end_mm: Vector2<f64>,
    },
    /// An arc; a full circle where it ends at its start.
    Arc {
        /// Where it starts \[mm\].
        start_mm: Vector2<f64>,
        /// Where it ends \[mm\].
        end_mm: Vector2<f64>,
        /// Its centre \[mm\].
        centre_mm: Vector2<f64>,
        /// Which way it runs.
        counterclockwise: bool,
    },
    /// A free-form curve.
    Curve(NurbsCurve<2>),
}
