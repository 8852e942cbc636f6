//! Pictures of a tool path and of the part that it leaves: deviation maps, rings in plan, the path in three dimensions, and the
//! comparison of the step-over formulas.
//!
//! The pictures take plain numbers and do not know where they come from.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::files::write_figures;
use super::plots::{deviation, path_3d, rings, stepover};
use super::{Format, ReportError, drawn};
use crate::toolpath::stepover::{StepoverError, exact_mm, fast_mm, flat_mm};

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

impl DeviationPicture<'_> {
    /// The bytes of an SVG document (UTF-8) or of a PNG file. Where a map has more cells than the figure can show, each square of
    /// the picture has the worst deviation of its cells: uncut, else the largest in magnitude.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&deviation::figure(self), "deviation", format)
    }

    /// Writes `STEM-deviation.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("deviation", deviation::figure(self))], folder, stem, format)
    }
}

/// What a move is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoveKind {
    /// Cutting along a ring of this depth: 0 is the outermost.
    Ring(u32),
    /// Cutting on the way from one ring to the next.
    Link,
    /// Through the air.
    Air,
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

impl PathPicture {
    /// The path in plan, rings coloured by their depth: the bytes of an SVG document (UTF-8) or of a PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw_rings(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&rings::figure(self), "rings", format)
    }

    /// The path in three dimensions, seen along a slanted axis, coloured by height: the bytes of an SVG document (UTF-8) or of a
    /// PNG file.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw_3d(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&path_3d::figure(self), "path3d", format)
    }

    /// Writes `STEM-rings.svg` and `STEM-path3d.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("rings", rings::figure(self)), ("path3d", path_3d::figure(self))], folder, stem, format)
    }
}

/// The three step-over forms at one curvature radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepoverRow {
    /// Scallop height \[mm\].
    pub scallop_mm: f64,
    /// Curvature radius \[mm\]: positive where convex, negative where concave.
    pub curvature_radius_mm: f64,
    /// The step-over on a flat surface \[mm\].
    pub flat_mm: f64,
    /// The exact step-over \[mm\].
    pub exact_mm: f64,
    /// The fast one \[mm\].
    pub fast_mm: f64,
    /// Error of the fast form, `100 |w' - w| / w`.
    pub error_percent: f64,
    /// The same of the flat form.
    pub flat_error_percent: f64,
}

/// The step-over forms for a cutter radius, at one scallop height and curvature radius \[mm\].
///
/// # Errors
/// As those of [`exact_mm`].
pub fn stepover_row(radius_mm: f64, scallop_mm: f64, curvature_radius_mm: f64) -> Result<StepoverRow, StepoverError> {
    let exact = exact_mm(radius_mm, scallop_mm, curvature_radius_mm)?;
    let fast = fast_mm(radius_mm, scallop_mm, curvature_radius_mm)?;
    let flat = flat_mm(radius_mm, scallop_mm)?;
    let error_percent = |form: f64| 100.0 * (form - exact).abs() / exact;
    Ok(StepoverRow {
        scallop_mm,
        curvature_radius_mm,
        flat_mm: flat,
        exact_mm: exact,
        fast_mm: fast,
        error_percent: error_percent(fast),
        flat_error_percent: error_percent(flat),
    })
}

/// The comparison of the step-over forms: a table, and the error of the fast form over the curvature radius as a plot.
///
/// [`StepoverPicture::default`] is the paper's: cutter radius 5 mm; scallop heights 0.01 and 0.1 mm; curvature radii 10, 4, -9, -10
/// and -11 mm.
#[derive(Debug, Clone, PartialEq)]
pub struct StepoverPicture {
    /// Cutter radius \[mm\].
    pub radius_mm: f64,
    /// Scallop heights \[mm\].
    pub scallops_mm: Vec<f64>,
    /// Curvature radii of the table \[mm\]: positive where convex, negative where concave, infinite where flat. Those in the range
    /// of the plot are marked there.
    pub curvature_radii_mm: Vec<f64>,
    /// Curvature radii that the plot shows, without sign \[mm\].
    pub range_mm: [f64; 2],
}

impl Default for StepoverPicture {
    fn default() -> Self {
        Self {
            radius_mm: 5.0,
            scallops_mm: vec![0.01, 0.1],
            curvature_radii_mm: vec![10.0, 4.0, -9.0, -10.0, -11.0],
            range_mm: [2.0, 100.0],
        }
    }
}

impl StepoverPicture {
    /// The table: every curvature radius with every scallop height.
    ///
    /// # Errors
    /// As those of [`exact_mm`], of the first row that is not possible.
    pub fn rows(&self) -> Result<Vec<StepoverRow>, StepoverError> {
        let cases =
            self.curvature_radii_mm.iter().flat_map(|radius| self.scallops_mm.iter().map(move |h| (*h, *radius)));
        cases.map(|(scallop, radius)| stepover_row(self.radius_mm, scallop, radius)).collect()
    }

    /// The plot: the bytes of an SVG document (UTF-8) or of a PNG file. What is not possible is left out.
    ///
    /// # Errors
    /// A failure of the drawing backend.
    pub fn draw(&self, format: Format) -> Result<Vec<u8>, ReportError> {
        drawn(&stepover::figure(self), "stepover", format)
    }

    /// Writes `STEM-stepover.svg` (or `.png`) into `folder`.
    ///
    /// # Errors
    /// A stem that is no plain file name, a failure of the drawing backend, a file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str, format: Format) -> Result<Vec<PathBuf>, ReportError> {
        write_figures([("stepover", stepover::figure(self))], folder, stem, format)
    }
}
