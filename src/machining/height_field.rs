//! The stock as a field of heights, lowered by every piece of a cutter's path.

use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;

use super::height_field_sweep::{Cut, Profile, Sweep};
use crate::path::MAX_COORDINATE_MM;
use crate::toolpath::Cutter;

/// Most cells of a field.
pub const MAX_CELLS: usize = 40_000_000;

/// Cuts gathered before the cells are lowered.
const BATCH: usize = 16_384;
/// Rows that one task lowers.
const ROWS: usize = 16;
/// A move shorter than this is none \[mm\].
const STILL_MM: f64 = 1e-9;

/// Why a height field cannot be made or cut.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeightFieldError {
    /// The rectangle is empty, or a corner no number in range.
    #[error(
        "the rectangle from ({}, {}) to ({}, {}) mm has no area within ±{} mm: give a lower and an upper corner",
        low_mm[0], low_mm[1], high_mm[0], high_mm[1], MAX_COORDINATE_MM
    )]
    BadRectangle {
        /// Least coordinates.
        low_mm: [f64; 2],
        /// Largest coordinates.
        high_mm: [f64; 2],
    },
    /// The cell size is not a positive finite number.
    #[error("a cell size of {cell_mm} mm is not a positive finite number")]
    BadCell {
        /// The cell size.
        cell_mm: f64,
    },
    /// More than [`MAX_CELLS`].
    #[error(
        "cells of {cell_mm} mm over {width_mm} × {height_mm} mm are {cells:.3e}, more than {MAX_CELLS}: take cells of {least_mm:.2} mm or more"
    )]
    TooManyCells {
        /// The cell size.
        cell_mm: f64,
        /// Width of the rectangle.
        width_mm: f64,
        /// Height of the rectangle.
        height_mm: f64,
        /// How many cells there would be.
        cells: f64,
        /// A cell size that is possible.
        least_mm: f64,
    },
    /// A place of the cutter is no number in range.
    #[error("the tip at ({}, {}, {}) mm is not within ±{} mm on every axis", tip_mm[0], tip_mm[1], tip_mm[2], MAX_COORDINATE_MM)]
    BadTip {
        /// The place.
        tip_mm: [f64; 3],
    },
}

/// Where the cutter stands.
#[derive(Debug, Clone, Copy)]
struct Standing {
    profile: Profile,
    /// As it was given, and as it is taken: moves shorter than [`STILL_MM`] are gathered.
    given: Vector3<f64>,
    tip: Vector3<f64>,
    /// The piece that came here, while the vertex at its end is not yet cut.
    came: Option<Sweep>,
}

/// Heights \[mm\] of the stock at the centres of square cells over a rectangle in plan; infinite where nothing was cut.
///
/// [`cut`](Self::cut) lowers every cell to the exact lower envelope of a ball, flat or bull-nose cutter swept along a straight
/// piece (rounding: 1e-9 mm for pieces less steep than 1000 : 1, 1e-7 mm for any). Pieces are gathered and cells lowered in
/// batches, rows side by side on all cores: memory does not grow with the path, and neither the number of cores nor the batches
/// change a bit of the result, for the least of some numbers is the same in any order.
///
/// ```
/// use nalgebra::Vector3;
/// use servosim::machining::HeightField;
/// use servosim::toolpath::Cutter;
///
/// let mut field = HeightField::new([0.0, 0.0], [10.0, 10.0], 0.1)?;
/// field.cut(&Cutter::ball(5.0)?, Vector3::new(0.0, 5.05, 1.0), Vector3::new(10.0, 5.05, 1.0))?;
/// // Along the middle row of cells the tip passed at z = 1.
/// assert!((field.height_mm(4.0, 5.05).unwrap_or_default() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct HeightField {
    low: Vector2<f64>,
    cell: f64,
    columns: usize,
    rows: usize,
    heights: Vec<f64>,
    pending: Vec<Cut>,
    standing: Option<Standing>,
}

impl HeightField {
    /// A field of uncut stock over the rectangle from `low_mm` to `high_mm`, with square cells of `cell_mm`; the last column and
    /// row may reach beyond it.
    ///
    /// # Errors
    /// A rectangle without area, a cell size that is not positive, more than [`MAX_CELLS`] cells.
    pub fn new(low_mm: [f64; 2], high_mm: [f64; 2], cell_mm: f64) -> Result<Self, HeightFieldError> {
        let fits = |value: &f64| value.abs() <= MAX_COORDINATE_MM;
        let [width_mm, height_mm] = [0, 1].map(|i| high_mm[i] - low_mm[i]);
        if !(low_mm.iter().chain(&high_mm).all(fits) && width_mm > 0.0 && height_mm > 0.0) {
            return Err(HeightFieldError::BadRectangle { low_mm, high_mm });
        }
        if !(cell_mm > 0.0 && cell_mm.is_finite()) {
            return Err(HeightFieldError::BadCell { cell_mm });
        }
        // A hair less: 10 mm of 0.1 mm are 100 cells, whatever the rounding of the quotient.
        let [columns, rows] = [width_mm, height_mm].map(|side| (side / cell_mm * (1.0 - 1e-12)).ceil().max(1.0));
        let cells = columns * rows;
        if !(cells <= MAX_CELLS as f64) {
            let least_mm = 1.01 * (width_mm * height_mm / MAX_CELLS as f64).sqrt().max(width_mm.max(height_mm) / 2e7);
            let least_mm = (least_mm * 100.0).ceil() / 100.0;
            return Err(HeightFieldError::TooManyCells { cell_mm, width_mm, height_mm, cells, least_mm });
        }
        let [columns, rows] = [columns, rows].map(count);
        Ok(Self {
            low: Vector2::from(low_mm),
            cell: cell_mm,
            columns,
            rows,
            heights: vec![f64::INFINITY; columns * rows],
            pending: Vec::new(),
            standing: None,
        })
    }

    /// Cells across (x) and up (y).
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Side of a cell \[mm\].
    pub fn cell_mm(&self) -> f64 {
        self.cell
    }

    /// The lower left corner \[mm\].
    pub fn low_mm(&self) -> [f64; 2] {
        self.low.into()
    }

    /// The centre of a cell \[mm\].
    pub fn centre_mm(&self, column: usize, row: usize) -> [f64; 2] {
        centre(self.low, self.cell, column, row).into()
    }

    /// Cuts with the tip of `cutter` moving straight from one place to another \[mm\]. Pieces that begin where the one before
    /// ended are quicker.
    ///
    /// # Errors
    /// A coordinate that is not a finite number in range; nothing is cut then.
    pub fn cut(&mut self, cutter: &Cutter, from_mm: Vector3<f64>, to_mm: Vector3<f64>) -> Result<(), HeightFieldError> {
        for tip in [from_mm, to_mm] {
            if !tip.iter().all(|c| c.abs() <= MAX_COORDINATE_MM) {
                return Err(HeightFieldError::BadTip { tip_mm: tip.into() });
            }
        }
        let profile = Profile::of(cutter);
        let standing = match self.standing {
            Some(standing) if standing.given == from_mm && standing.profile == profile => standing,
            _ => {
                self.finish_chain();
                self.push(Cut::stamp(profile, from_mm));
                Standing { profile, given: from_mm, tip: from_mm, came: None }
            }
        };
        if (to_mm - standing.tip).amax() <= STILL_MM {
            self.standing = Some(Standing { given: to_mm, ..standing });
            return Ok(());
        }
        let came = Sweep::new(profile, standing.tip, to_mm);
        match (&standing.came, &came) {
            (Some(before), Some(after)) => self.push(Cut::vertex(standing.tip, before, after)),
            (Some(_), None) => self.push(Cut::stamp(profile, standing.tip)),
            // The vertex is cut already.
            (None, _) => {}
        }
        match came {
            Some(sweep) => self.push(Cut::Sweep(sweep)),
            None if to_mm.z < standing.tip.z => self.push(Cut::stamp(profile, to_mm)),
            // Straight up nothing is cut, but that the axis may have moved a little.
            None => {}
        }
        self.standing = Some(Standing { profile, given: to_mm, tip: to_mm, came });
        Ok(())
    }

    /// Cuts along a polyline of places of the tip \[mm\].
    ///
    /// # Errors
    /// As [`cut`](Self::cut); what comes before the place in question is cut.
    pub fn cut_along(&mut self, cutter: &Cutter, tips_mm: &[Vector3<f64>]) -> Result<(), HeightFieldError> {
        for pair in tips_mm.windows(2) {
            self.cut(cutter, pair[0], pair[1])?;
        }
        Ok(())
    }

    /// The heights \[mm\], row after row, the lowest y first; infinite where nothing was cut. Cuts what is still gathered.
    pub fn heights_mm(&mut self) -> &[f64] {
        self.finish_chain();
        self.lower();
        &self.heights
    }

    /// The height at the centre of the cell that holds a point \[mm\]. None beside the field.
    pub fn height_mm(&mut self, x_mm: f64, y_mm: f64) -> Option<f64> {
        let place = |value: f64, low: f64, cells: usize| {
            let index = (value - low) / self.cell;
            (index >= 0.0 && index < cells as f64).then(|| count(index))
        };
        let (column, row) = (place(x_mm, self.low.x, self.columns)?, place(y_mm, self.low.y, self.rows)?);
        let at = row * self.columns + column;
        self.heights_mm().get(at).copied()
    }

    /// The last piece's end is cut whole.
    fn finish_chain(&mut self) {
        if let Some(standing) = &mut self.standing
            && standing.came.take().is_some()
        {
            let stamp = Cut::stamp(standing.profile, standing.tip);
            self.push(stamp);
        }
    }

    fn push(&mut self, cut: Cut) {
        self.pending.push(cut);
        if self.pending.len() >= BATCH {
            self.lower();
        }
    }

    /// Lowers the cells by what was gathered.
    fn lower(&mut self) {
        let Self { low, cell, columns, ref pending, .. } = *self;
        if pending.is_empty() {
            return;
        }
        self.heights.par_chunks_mut(ROWS * columns).enumerate().for_each(|(task, heights)| {
            let first = task * ROWS;
            let [bottom, top] = [first, first + ROWS].map(|row| low.y + row as f64 * cell);
            for cut in pending {
                let [least, most] = cut.rows();
                if least > top || most < bottom {
                    continue;
                }
                for (row, heights) in (first..).zip(heights.chunks_mut(columns)) {
                    let y = centre(low, cell, 0, row).y;
                    if y < least || y > most {
                        continue;
                    }
                    let [left, right] = cut.interval(y);
                    if !(left <= right) {
                        continue;
                    }
                    // The cells whose centres lie there; one more each side costs little.
                    let (from, to) = ((left - low.x) / cell - 1.0, (right - low.x) / cell + 1.0);
                    if to < 0.0 || from > columns as f64 {
                        continue;
                    }
                    let (from, to) = (count(from), count(to).min(columns - 1));
                    if let Some(heights) = heights.get_mut(from..=to) {
                        for (column, height) in (from..).zip(heights) {
                            let new = cut.height(centre(low, cell, column, row));
                            if new < *height {
                                *height = new;
                            }
                        }
                    }
                }
            }
        });
        self.pending.clear();
    }
}

/// The centre of a cell.
#[inline(always)]
fn centre(low: Vector2<f64>, cell: f64, column: usize, row: usize) -> Vector2<f64> {
    Vector2::new(low.x + (column as f64 + 0.5) * cell, low.y + (row as f64 + 0.5) * cell)
}

/// A count from a float.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a cast saturates: below zero is zero
pub(super) fn count(value: f64) -> usize {
    value as usize
}
