//! A linked tool path.

use nalgebra::Vector3;

use super::rings::PlanRing;
use crate::path::NurbsCurve;

/// One motion of the tool tip.
#[derive(Debug, Clone, PartialEq)]
pub enum Move {
    /// Rapidly at clearance height.
    Rapid {
        /// Its end \[mm\].
        to_mm: Vector3<f64>,
    },
    /// Straight down onto the surface, at the plunge feed.
    Plunge {
        /// Its end \[mm\].
        to_mm: Vector3<f64>,
    },
    /// Straight up to clearance height, rapidly.
    Retract {
        /// Its end \[mm\].
        to_mm: Vector3<f64>,
    },
    /// A ring, or a turn of a helix.
    Cut {
        /// The motion.
        stretch: Stretch,
        /// Steps of its ring from the first rings inwards.
        level: usize,
    },
    /// From a ring to the next one, on the surface.
    Link(Stretch),
}

/// A motion on the surface, in two forms with the same ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// As one curve.
    pub curve: NurbsCurve<3>,
    /// As a polyline with few points, within the same tolerance \[mm\].
    pub straight_mm: Vec<Vector3<f64>>,
}

impl Stretch {
    fn end(&self) -> Option<Vector3<f64>> {
        self.curve.control_points_mm().last().copied()
    }
}

impl Move {
    /// Where it ends \[mm\]: the very numbers that the next one starts with.
    pub fn end_mm(&self) -> Vector3<f64> {
        match self {
            Self::Rapid { to_mm } | Self::Plunge { to_mm } | Self::Retract { to_mm } => *to_mm,
            Self::Cut { stretch, .. } | Self::Link(stretch) => stretch.end().unwrap_or_else(Vector3::zeros),
        }
    }
}

/// A tool path and what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolPath {
    /// The motions, each from where the one before ended. The first is a rapid one, the last a retraction.
    pub moves: Vec<Move>,
    /// The rings in plan.
    pub rings: Vec<PlanRing>,
    /// Metrics.
    pub statistics: Statistics,
}

/// Metrics of a tool path.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Rings.
    pub rings: usize,
    /// Stretches on the surface without a break.
    pub chains: usize,
    /// Control points of all curves, links too.
    pub control_points: usize,
    /// Points of all polylines, links too.
    pub straight_points: usize,
    /// Corners inside of curves.
    pub corners: usize,
    /// Length on the surface \[mm\], along the polylines.
    pub length_mm: f64,
    /// Times that the tool leaves the surface for another place.
    pub air_moves: usize,
    /// Length of rapid motions, plunges and retractions between them \[mm\].
    pub air_length_mm: f64,
    /// Largest distance of a curve to the points that it was fitted to \[mm\].
    pub fit_error_mm: f64,
    /// The path tolerance `ε' = min(ε, h/4)` \[mm\].
    pub path_tolerance_mm: f64,
    /// What of it is left to the rounding of a program \[mm\].
    pub rounding_mm: f64,
    /// The ridge `h'` that a path without error leaves where one within `ε'` leaves `h` \[mm\].
    pub planned_scallop_mm: f64,
    /// Largest ridge that the check of the rings found, for any path within `ε'` of them \[mm\].
    pub ridge_mm: f64,
    /// Least distance in plan of one ring to the next \[mm\]; 0 where there is one only.
    pub least_step_mm: f64,
    /// Largest distance in plan of one ring to the next \[mm\].
    pub largest_step_mm: f64,
    /// Largest change of direction between neighbouring turns of a helix \[rad\].
    pub tangent_jump_rad: f64,
}
