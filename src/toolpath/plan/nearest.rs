//! The nearest point of closed polygons, quickly.

use super::ridge::Point;

/// Most cells along one side.
const MOST_CELLS: f64 = 400.0;

/// Legs of closed polygons in a grid of square cells.
#[allow(clippy::struct_field_names)] // that is what they are
pub(super) struct Legs {
    legs: Vec<[Point; 2]>,
    low: Point,
    cell: f64,
    size: [usize; 2],
    /// Legs that pass through the boxes of each cell.
    cells: Vec<Vec<u32>>,
}

impl Legs {
    /// None where there are no legs.
    pub(super) fn new<'a>(rings: impl Iterator<Item = &'a [Point]>, cell: f64) -> Option<Self> {
        let mut legs = Vec::new();
        for ring in rings {
            legs.extend((0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]));
        }
        let first = legs.first()?[0];
        let (low, high) = legs.iter().fold((first, first), |(low, high), leg| (low.inf(&leg[0]), high.sup(&leg[0])));
        let extent = high - low;
        let cell = cell.max(extent.max() / MOST_CELLS).max(1e-9);
        let size = [count(extent.x, cell), count(extent.y, cell)];
        let mut cells = vec![Vec::new(); size[0] * size[1]];
        let mut grid = Self { legs, low, cell, size, cells: Vec::new() };
        for (index, leg) in grid.legs.iter().enumerate() {
            // Along the leg in parts shorter than a cell: few cells beside it.
            let parts = count((leg[1] - leg[0]).amax(), cell);
            for part in 0..parts {
                let at = |k: usize| leg[0] + (leg[1] - leg[0]) * (k as f64 / parts as f64);
                let (a, b) = (grid.cell_of(at(part)), grid.cell_of(at(part + 1)));
                for y in a[1].min(b[1])..=a[1].max(b[1]) {
                    for x in a[0].min(b[0])..=a[0].max(b[0]) {
                        let list: &mut Vec<u32> = &mut cells[y * size[0] + x];
                        let index = u32::try_from(index).unwrap_or(u32::MAX);
                        if list.last() != Some(&index) {
                            list.push(index);
                        }
                    }
                }
            }
        }
        grid.cells = cells;
        Some(grid)
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the grid
    fn cell_of(&self, at: Point) -> [usize; 2] {
        let place = (at - self.low) / self.cell;
        [(place.x.max(0.0) as usize).min(self.size[0] - 1), (place.y.max(0.0) as usize).min(self.size[1] - 1)]
    }

    /// The nearest point of the legs and its distance.
    #[allow(clippy::cast_possible_wrap)] // cells: at most a few hundred
    pub(super) fn nearest(&self, at: Point) -> (Point, f64) {
        let [cx, cy] = self.cell_of(at);
        let mut best = (self.legs[0][0], f64::INFINITY);
        let last = self.size[0].max(self.size[1]);
        for reach in 0..=last {
            let rows = cy.saturating_sub(reach)..=(cy + reach).min(self.size[1] - 1);
            for y in rows {
                let edge = y + reach == cy || y == cy + reach;
                let (from, to) = (cx as i64 - reach as i64, cx as i64 + reach as i64);
                let step = if edge || reach == 0 { 1 } else { 2 * reach };
                for x in (from..=to).step_by(step) {
                    let Ok(x) = usize::try_from(x) else { continue };
                    if x >= self.size[0] {
                        continue;
                    }
                    for &leg in &self.cells[y * self.size[0] + x] {
                        let on = on_leg(&self.legs[leg as usize], at);
                        let distance = (on - at).norm();
                        if distance < best.1 {
                            best = (on, distance);
                        }
                    }
                }
            }
            // Cells not looked at are at least this far away. A point beside the grid is as far from them as from its edge, or further.
            if best.1 <= reach as f64 * self.cell {
                break;
            }
        }
        best
    }

    pub(super) fn distance_mm(&self, at: Point) -> f64 {
        self.nearest(at).1
    }

    /// Where the horizontal line at `y` crosses the legs, in order.
    pub(super) fn crossings(&self, y: f64, out: &mut Vec<f64>) {
        for [a, b] in &self.legs {
            if (a.y <= y) != (b.y <= y) {
                out.push(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
            }
        }
    }

    pub(super) fn bounds(&self) -> [Point; 2] {
        let high = self.legs.iter().fold(self.low, |high, leg| high.sup(&leg[0]));
        [self.low, high]
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded by MOST_CELLS times a leg's share
fn count(extent: f64, cell: f64) -> usize {
    (extent / cell).floor().max(0.0).min(1e6) as usize + 1
}

/// The point of a leg nearest to `at`.
pub(super) fn on_leg(leg: &[Point; 2], at: Point) -> Point {
    let along = leg[1] - leg[0];
    let square = along.norm_squared();
    let share = if square > 0.0 { ((at - leg[0]).dot(&along) / square).max(0.0).min(1.0) } else { 0.0 };
    leg[0] + along * share
}

/// Whether a closed polygon winds around a point.
pub(super) fn inside(ring: &[Point], at: Point) -> bool {
    let mut odd = false;
    for (i, a) in ring.iter().enumerate() {
        let b = ring[(i + 1) % ring.len()];
        if (a.y <= at.y) != (b.y <= at.y) && a.x + (b.x - a.x) * ((at.y - a.y) / (b.y - a.y)) > at.x {
            odd = !odd;
        }
    }
    odd
}
