//! The step-over forms beside each other: a table, and curves over the curvature radius.

use serde::Serialize;

use super::stepover::{StepoverError, exact_mm, fast_mm, flat_mm};

/// Points of a curve.
const CURVE_POINTS: u32 = 400;

/// Concave curves begin at this multiple of the cutter radius: in a hollow hardly wider than the cutter the error runs away.
const NARROWEST_HOLLOW: f64 = 1.05;

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

/// What is compared: a cutter, scallop heights, curvature radii.
///
/// [`StepoverComparison::default`] is the paper's: cutter radius 5 mm; scallop heights 0.01 and 0.1 mm; curvature radii 10, 4, -9, -10
/// and -11 mm.
#[derive(Debug, Clone, PartialEq)]
pub struct StepoverComparison {
    /// Cutter radius \[mm\].
    pub radius_mm: f64,
    /// Scallop heights \[mm\].
    pub scallops_mm: Vec<f64>,
    /// Curvature radii of the table \[mm\]: positive where convex, negative where concave, infinite where flat.
    pub curvature_radii_mm: Vec<f64>,
    /// Curvature radii of the curves, without sign \[mm\]: 1e-6 to 1e9, the second above the first.
    pub range_mm: [f64; 2],
}

impl Default for StepoverComparison {
    fn default() -> Self {
        Self {
            radius_mm: 5.0,
            scallops_mm: vec![0.01, 0.1],
            curvature_radii_mm: vec![10.0, 4.0, -9.0, -10.0, -11.0],
            range_mm: [2.0, 100.0],
        }
    }
}

/// Error of the fast form at one scallop height, over the curvature radius.
#[derive(Debug, Clone, PartialEq)]
pub struct StepoverCurve {
    /// Scallop height \[mm\].
    pub scallop_mm: f64,
    /// Whether the surface is convex.
    pub convex: bool,
    /// Curvature radius without sign \[mm\] and error \[%\], the radius rising. Radii without a step-over are left out.
    pub points: Vec<[f64; 2]>,
}

impl StepoverComparison {
    /// The table: every curvature radius with every scallop height.
    ///
    /// # Errors
    /// As those of [`exact_mm`], of the first row that is not possible.
    pub fn rows(&self) -> Result<Vec<StepoverRow>, StepoverError> {
        let cases =
            self.curvature_radii_mm.iter().flat_map(|radius| self.scallops_mm.iter().map(move |h| (*h, *radius)));
        cases.map(|(scallop, radius)| stepover_row(self.radius_mm, scallop, radius)).collect()
    }

    /// The curves: for every scallop height a convex and a concave one, over [`range_mm`](Self::range_mm) (that of the paper if it
    /// is not possible), evenly spaced in the logarithm of the radius.
    pub fn curves(&self) -> Vec<StepoverCurve> {
        let [low, high] = self.sound_range_mm();
        let radii = || (0..=CURVE_POINTS).map(|i| low * libm::pow(high / low, f64::from(i) / f64::from(CURVE_POINTS)));
        let kinds = self.scallops_mm.iter().flat_map(|scallop| [true, false].map(|convex| (*scallop, convex)));
        let curve = |(scallop_mm, convex): (f64, bool)| {
            let sign = if convex { 1.0 } else { -1.0 };
            let points = radii()
                .filter(|radius| convex || *radius >= NARROWEST_HOLLOW * self.radius_mm)
                .filter_map(|radius| stepover_row(self.radius_mm, scallop_mm, sign * radius).ok())
                .map(|row| [row.curvature_radius_mm.abs(), row.error_percent]);
            StepoverCurve { scallop_mm, convex, points: points.collect() }
        };
        kinds.map(curve).collect()
    }

    /// The range of the curves: the one asked for, else the paper's.
    pub fn sound_range_mm(&self) -> [f64; 2] {
        let [low, high] = self.range_mm;
        let sound = low >= 1e-6 && high <= 1e9 && high >= 1.001 * low;
        if sound { [low, high] } else { Self::default().range_mm }
    }
}
