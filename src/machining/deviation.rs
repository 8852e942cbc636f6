//! How far the part as machined is from the design surface.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;

use super::height_field::{HeightField, count};
use crate::toolpath::{Cutter, DesignSurface, SurfaceTop};

/// A second look is taken at the design surface where the nearest point lies farther than this from the first \[mm in plan\].
const NEAR_MM: f64 = 1e-3;
/// Rows that one task measures.
const ROWS: usize = 8;

/// The part of a field that is looked at: inside closed polygons (even-odd, so that inner ones are islands), and not nearer to
/// their edges than a margin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapRegion {
    /// Each closed, its last point joined to its first; plan coordinates \[mm\]. Points that are no numbers are left out.
    pub polygons_mm: Vec<Vec<[f64; 2]>>,
    /// The margin \[mm\]; negative is zero.
    pub margin_mm: f64,
    /// With a cutter the polygons are where its axis goes: looked at are the places of the surface that it touches from there.
    pub cutter: Option<Cutter>,
}

impl MapRegion {
    /// Where the axis of the cutter stands while it touches the surface at `(x, y)`, whose normal there is `n`: `(x, y)` itself
    /// without a cutter; else further on along `n_xy` by the corner radius `c n_xy` and the flat `(R - c) n_xy/|n_xy|`.
    fn axis(&self, x: f64, y: f64, normal: &Vector3<f64>) -> Vector2<f64> {
        let at = Vector2::new(x, y);
        let Some(cutter) = self.cutter else { return at };
        let (flat, corner) = (cutter.radius_mm() - cutter.corner_radius_mm(), cutter.corner_radius_mm());
        let across = normal.xy();
        let steep = across.norm();
        // On a level place any part of the flat touches: its middle does.
        at + across * corner + if steep > 1e-9 { across * (flat / steep) } else { Vector2::zeros() }
    }
}

/// Deviation of the machined part from the design surface, cell by cell, in micrometres: positive where material is left
/// (scallop), negative where the part is cut too deep (gouge).
///
/// The point machined at a cell's centre, `P = (x, y, h)`, is measured along the surface's normal: with the top `Q` of the design
/// surface on the vertical through `P` and the normal `n` there the deviation is
///
/// ```text
/// d₁ = (h - Q_z) n_z            exact on planes; else off by about κ d² tan²θ / 2
/// d₂ = (P - Q') · n'            Q', n': top and normal below the foot P - d₁ n
/// ```
///
/// `κ` \[1/mm\] the largest curvature, `θ` the steepness. `d₂` is taken where foot and `Q` lie more than a micrometre apart in plan:
/// what is left is below `κ (1 µm)²/2` or of the order `κ³ d⁴/8`: under 0.01 µm for a deviation of 0.25 mm and a radius of 10 mm.
/// Where there is no design surface below the foot (past its border) it is `d₁`. Values are stored as `f32`: 1e-7 of themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviationMap {
    pub(super) low: Vector2<f64>,
    pub(super) cell: f64,
    pub(super) columns: usize,
    pub(super) values: Vec<f32>,
}

impl DeviationMap {
    /// Measures a field against a surface, all over it or within `region`. Cells are measured side by side on all cores.
    pub fn of(field: &mut HeightField, surface: &dyn DesignSurface, region: Option<&MapRegion>) -> Self {
        let (low, cell, [columns, rows]) = (Vector2::from(field.low_mm()), field.cell_mm(), field.size());
        let mask = region.map(|region| mask(region, low, cell, [columns, rows]));
        let heights = field.heights_mm();
        let mut values = vec![f32::NAN; heights.len()];
        values.par_chunks_mut(ROWS * columns).enumerate().for_each(|(task, values)| {
            let first = task * ROWS * columns;
            for (at, value) in (first..).zip(values) {
                let in_mask = |at: usize| mask.as_ref().is_none_or(|mask| mask.get(at) == Some(&true));
                if region.is_none_or(|region| region.cutter.is_none()) && !in_mask(at) {
                    continue;
                }
                let x = low.x + ((at % columns) as f64 + 0.5) * cell;
                let y = low.y + ((at / columns) as f64 + 0.5) * cell;
                let (Some(top), Some(height)) = (surface.top(x, y), heights.get(at)) else { continue };
                if let Some(region) = region
                    && region.cutter.is_some()
                {
                    let from = (region.axis(x, y, &top.normal) - low) / cell;
                    let inside = from.x >= 0.0 && from.y >= 0.0 && from.x < columns as f64;
                    if !inside || !in_mask(count(from.y).saturating_mul(columns).saturating_add(count(from.x))) {
                        continue;
                    }
                }
                *value = single(1e3 * deviation_mm(Vector3::new(x, y, *height), top, surface));
            }
        });
        Self { low, cell, columns, values }
    }

    /// Cells across (x) and up (y).
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.values.len() / self.columns.max(1)]
    }

    /// Side of a cell \[mm\].
    pub fn cell_mm(&self) -> f64 {
        self.cell
    }

    /// The lower left corner \[mm\].
    pub fn low_mm(&self) -> [f64; 2] {
        self.low.into()
    }

    /// The deviations \[µm\], row after row, the lowest y first: NaN beside the surface and outside the region, infinite where
    /// nothing was cut.
    pub fn values_um(&self) -> &[f32] {
        &self.values
    }

    /// This map minus another of the same cells (as cut minus nominal, say), where both have a value. None for other cells.
    pub fn minus(&self, other: &Self) -> Option<Self> {
        if (self.low, self.cell, self.columns, self.values.len())
            != (other.low, other.cell, other.columns, other.values.len())
        {
            return None;
        }
        let difference = |(a, b): (&f32, &f32)| if a.is_finite() && b.is_finite() { a - b } else { f32::NAN };
        let values = self.values.iter().zip(&other.values).map(difference).collect();
        Some(Self { values, ..*self })
    }

    /// The centre of the cell with this index \[mm\].
    pub(super) fn centre_mm(&self, index: usize) -> [f64; 2] {
        let columns = self.columns.max(1);
        [
            self.low.x + ((index % columns) as f64 + 0.5) * self.cell,
            self.low.y + ((index / columns) as f64 + 0.5) * self.cell,
        ]
    }
}

/// Signed distance of a machined point to the surface, `top` being above or below it. Infinite where it is.
fn deviation_mm(point: Vector3<f64>, top: SurfaceTop, surface: &dyn DesignSurface) -> f64 {
    let first = (point.z - top.z_mm) * top.normal.z;
    // Not cut, or an upright wall.
    if !first.is_finite() || !(first.abs() * top.normal.xy().norm() > NEAR_MM) {
        return if point.z == f64::INFINITY { f64::INFINITY } else { first };
    }
    let foot = point - first * top.normal;
    match surface.top(foot.x, foot.y) {
        Some(top) => (point - Vector3::new(foot.x, foot.y, top.z_mm)).dot(&top.normal),
        None => first,
    }
}

#[allow(clippy::cast_possible_truncation)] // seven digits of a deviation
fn single(value: f64) -> f32 {
    value as f32
}

/// Which cells lie in the region.
fn mask(region: &MapRegion, low: Vector2<f64>, cell: f64, [columns, rows]: [usize; 2]) -> Vec<bool> {
    let edges: Vec<[Vector2<f64>; 2]> = region
        .polygons_mm
        .iter()
        .flat_map(|polygon| {
            let points: Vec<Vector2<f64>> =
                polygon.iter().filter(|p| p.iter().all(|c| c.is_finite())).copied().map(Vector2::from).collect();
            let next: Vec<Vector2<f64>> = points.iter().copied().cycle().skip(1).take(points.len()).collect();
            points.into_iter().zip(next).map(|(a, b)| [a, b]).collect::<Vec<_>>()
        })
        .collect();
    let margin = region.margin_mm.max(0.0);
    let mut mask = vec![false; columns * rows];
    mask.par_chunks_mut(columns).enumerate().for_each(|(row, mask)| {
        let y = low.y + (row as f64 + 0.5) * cell;
        let x_of = |column: usize| low.x + (column as f64 + 0.5) * cell;
        let mut crossings: Vec<f64> = edges
            .iter()
            .filter(|[a, b]| (a.y <= y) != (b.y <= y))
            .map(|[a, b]| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x))
            .collect();
        crossings.sort_by(f64::total_cmp);
        let mut passed = 0;
        for (column, inside) in mask.iter_mut().enumerate() {
            while crossings.get(passed).is_some_and(|x| *x <= x_of(column)) {
                passed += 1;
            }
            *inside = passed % 2 == 1;
        }
        if !(margin > 0.0) {
            return;
        }
        for [a, b] in &edges {
            if a.y.min(b.y) - margin > y || a.y.max(b.y) + margin < y {
                continue;
            }
            let (from, to) =
                ((a.x.min(b.x) - margin - low.x) / cell - 1.0, (a.x.max(b.x) + margin - low.x) / cell + 1.0);
            if to < 0.0 || from > columns as f64 {
                continue;
            }
            for (column, inside) in mask.iter_mut().enumerate().take(count(to).saturating_add(1)).skip(count(from)) {
                let (point, way) = (Vector2::new(x_of(column), y), b - a);
                let square = way.norm_squared();
                let along = if square > 0.0 { ((point - a).dot(&way) / square).max(0.0).min(1.0) } else { 0.0 };
                *inside &= (point - a - along * way).norm() >= margin;
            }
        }
    });
    mask
}
