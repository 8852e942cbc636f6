//! A tool path as a program.

use crate::parameters::{Parameter, Range, parameters};
use nalgebra::Vector3;

use crate::nc::{Action, Block, Nurbs, Program};
use crate::path::NurbsCurve;
use crate::toolpath::plan::{Move, Stretch, ToolPath};

/// Feeds \[mm/min\]. Rapid motions have none in a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feeds {
    /// On the surface.
    pub cut_mm_min: f64,
    /// Straight down.
    pub plunge_mm_min: f64,
}

parameters!(
    "Feeds",
    Feeds {
        cut_mm_min: Parameter::new("feed.cut_mm_min", "mm/min", Range::above(0.0, 1e6), "Feed along the cut")
            .logarithmic(100.0, 20_000.0)
            .hint("give the feed in mm/min, such as 3000"),
        plunge_mm_min: Parameter::new(
            "feed.plunge_mm_min",
            "mm/min",
            Range::above(0.0, 1e6),
            "Feed down into the part"
        )
        .otherwise("a third of the feed along the cut")
        .logarithmic(50.0, 10_000.0)
        .hint("give the feed in mm/min, such as 1000"),
    }
);

/// What the motions on the surface are written as.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Blocks {
    /// One NURBS curve a ring.
    #[default]
    Nurbs,
    /// Straight blocks, within the same tolerance.
    Straight,
}

/// The blocks of a tool path. Rounding them by at most [`rounding_mm`](crate::toolpath::plan::Statistics::rounding_mm) keeps what
/// the path promises: a [`Writing`](crate::nc::Writing)'s tolerance.
pub fn program(path: &ToolPath, feeds: &Feeds, as_blocks: Blocks) -> Program {
    let mut blocks = Vec::new();
    let mut at: Option<Vector3<f64>> = None;
    let mut push = |from: Vector3<f64>, to: Vector3<f64>, feed_mm_min: Option<f64>, action: Action| {
        blocks.push(Block { line: 0, start_mm: from.into(), end_mm: to.into(), feed_mm_min, action });
    };
    for motion in &path.moves {
        let end = motion.end_mm();
        let start = at.unwrap_or(end);
        match motion {
            Move::Rapid { .. } | Move::Retract { .. } => push(start, end, None, Action::Rapid),
            Move::Plunge { .. } => push(start, end, Some(feeds.plunge_mm_min), Action::Linear),
            Move::Cut { stretch, .. } | Move::Link(stretch) => {
                let Stretch { curve, straight_mm } = stretch;
                // A straight way is no curve, whatever else is.
                match as_blocks {
                    Blocks::Nurbs if straight_mm.len() > 2 => {
                        push(start, end, Some(feeds.cut_mm_min), Action::Nurbs(nurbs(curve)))
                    }
                    Blocks::Nurbs | Blocks::Straight => {
                        for leg in straight_mm.windows(2) {
                            push(leg[0], leg[1], Some(feeds.cut_mm_min), Action::Linear);
                        }
                    }
                }
            }
        }
        at = Some(end);
    }
    Program { blocks }
}

fn nurbs(curve: &NurbsCurve<3>) -> Nurbs {
    let points = curve.control_points_mm();
    Nurbs {
        degree: curve.degree(),
        knots: curve.knots().to_vec(),
        weights: curve.weights().map_or_else(|| vec![1.0; points.len()], <[f64]>::to_vec),
        control_points_mm: points.iter().map(|&point| point.into()).collect(),
    }
}
