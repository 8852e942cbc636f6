//! What pictures of a tool path and of the part that it leaves are drawn from: plain numbers that do not know where they come from.

use crate::toolpath::{StepoverCurve, StepoverRow};

/// One deviation map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviationSubplot<'a> {
    /// What it shows: "nominal", "as cut".
    pub title: &'a str,
    /// Metrics of it, in one line below the map (where there is room).
    pub caption: &'a str,
    /// Lower left corner \[mm\].
    pub low_mm: [f64; 2],
    /// Side of a cell \[mm\].
    pub cell_mm: f64,
    /// Cells across.
    pub columns: usize,
    /// Deviations \[µm\], row after row, the lowest y first: NaN where there is no part, infinite where nothing was cut.
    pub values_um: &'a [f32],
}

/// One or two deviation maps (further ones are left out) with a shared scale.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviationPicture<'a> {
    /// Name of the part.
    pub name: &'a str,
    /// What was measured, in one line.
    pub caption: &'a str,
    /// The maps, side by side.
    pub maps: Vec<DeviationSubplot<'a>>,
    /// Deepest gouge allowed \[µm\], positive.
    pub gouge_limit_um: Option<f64>,
    /// Highest scallop allowed \[µm\].
    pub excess_limit_um: Option<f64>,
}

/// What a move is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoveKind {
    /// Cutting along a ring of this depth: 0 is the outermost.
    Ring(u32),
    /// Cutting on the way from one ring to the next.
    Link,
    /// Rapid motion: retract, positioning, plunge to the surface.
    Rapid,
}

/// One move of a tool path.
#[derive(Debug, Clone, PartialEq)]
pub struct PathMove {
    /// What it is.
    pub kind: MoveKind,
    /// Its places \[mm\], in the order of travel.
    pub points_mm: Vec<[f64; 3]>,
}

/// A tool path to be drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathPicture {
    /// Name of the part.
    pub name: String,
    /// How many rings, how long, in one line.
    pub caption: String,
    /// The moves in their order.
    pub moves: Vec<PathMove>,
    /// Borders of the machined region in plan \[mm\], each closed.
    pub borders_mm: Vec<Vec<[f64; 2]>>,
}

/// The comparison of the step-over forms: the error of the fast form over the curvature radius.
#[derive(Debug, Clone, PartialEq)]
pub struct StepoverPicture<'a> {
    /// Which forms, in one line.
    pub caption: &'a str,
    /// The curves; each may have no points.
    pub curves: Vec<StepoverCurve>,
    /// Rows of the table: those in the range of the plot are marked there.
    pub rows: Vec<StepoverRow>,
    /// Curvature radii that the plot shows, without sign \[mm\].
    pub range_mm: [f64; 2],
}
