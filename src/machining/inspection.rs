//! The part that a program leaves: as programmed (nominal), and as the machine cuts it.

use std::f64::consts::SQRT_2;

use nalgebra::SVector;

use super::{DeviationMap, HeightField, HeightFieldError, MapRegion, Motion, MotionReader, ProgramError};
use crate::nc::{Block, NcError};
use crate::path::{Cursor, Path};
use crate::simulation::{Observer, ObserverError, Period};
use crate::toolpath::guide::{GuideError, Region};
use crate::toolpath::{Cutter, DesignSurface};

/// How far the chords that the cutter is swept along may be from the curve \[mm\].
pub const CHORD_ERROR_MM: f64 = 1e-4;

/// Chord error of the region's curves where the map is cut out \[mm\].
const EDGE_MM: f64 = 1e-2;

/// Of a curve so much is looked at at a time \[mm\].
const STRETCH_MM: f64 = 1.0;

/// An inset of nothing: the region itself \[mm\].
const ON_BOUNDARY_MM: f64 = 1e-7;

/// Why a part could not be inspected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InspectionError {
    /// The field would have too many cells, or none.
    #[error(transparent)]
    Field(#[from] HeightFieldError),
    /// The region has no inside.
    #[error(transparent)]
    Region(#[from] GuideError),
    /// There is nothing to look at.
    #[error(
        "no place of the surface is touched by the cutter with its axis inside the boundary: there is nothing to inspect; \
         is the cutter too large for this surface?"
    )]
    NothingTouched,
    /// What is wrong with the program.
    #[error(transparent)]
    Program(#[from] ProgramError),
}

/// The machining check of a part: where it is looked at, and against what.
#[derive(Clone)]
pub struct Inspection<'a> {
    surface: &'a dyn DesignSurface,
    cutter: Cutter,
    region: MapRegion,
    field: HeightField,
}

impl<'a> Inspection<'a> {
    /// A check of what `cutter` leaves of `surface` where it touches it with its axis inside of `region`, further in than
    /// `tolerance_mm` and a cell, in cells of `cell_mm`.
    ///
    /// # Errors
    /// Too many cells; a region without an inside.
    pub fn new(
        surface: &'a dyn DesignSurface,
        cutter: Cutter,
        region: &Region,
        tolerance_mm: f64,
        cell_mm: f64,
    ) -> Result<Self, InspectionError> {
        let mut polygons_mm = Vec::new();
        for area in region.inset(ON_BOUNDARY_MM)? {
            polygons_mm.extend(
                area.rings().map(|ring| ring.points_mm(EDGE_MM).into_iter().map(<[f64; 2]>::from).collect::<Vec<_>>()),
            );
        }
        let corners = polygons_mm.iter().flatten();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in corners {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        // The cutter reaches past its axis, but there is nothing to look at beside the surface.
        let reach = cutter.radius_mm();
        let [least, most] = surface.bounds_mm();
        for axis in 0..2 {
            low[axis] = (low[axis] - reach).max(least[axis].min(low[axis]));
            high[axis] = (high[axis] + reach).min(most[axis].max(high[axis]));
        }
        let field = HeightField::new(low, high, cell_mm)?;
        // The path keeps its tolerance at the edge too, and an edge runs through cells.
        let margin_mm = tolerance_mm.max(0.0) + cell_mm;
        Ok(Self { surface, cutter, region: MapRegion { polygons_mm, margin_mm, cutter: Some(cutter) }, field })
    }

    /// The part as the program has it: the cutter swept along its curves (by chords within [`CHORD_ERROR_MM`]).
    ///
    /// # Errors
    /// What is wrong with the program.
    pub fn nominal(
        &self,
        blocks: impl Iterator<Item = Result<Block, NcError>>,
    ) -> Result<DeviationMap, InspectionError> {
        let mut part = self.part();
        let mut shapes = MotionReader::new(blocks);
        while let Some(motion) = shapes.next_seeing(&mut |_| {}) {
            part.follow(&motion?)?;
        }
        let map = part.map();
        if map.values_um().iter().all(|value| value.is_nan()) { Err(InspectionError::NothingTouched) } else { Ok(map) }
    }

    /// The borders of what is looked at, each closed \[mm\].
    pub fn borders_mm(&self) -> &[Vec<[f64; 2]>] {
        &self.region.polygons_mm
    }

    /// A part to be cut by a run, as one of its observers.
    pub fn part(&self) -> MachinedPart<'a> {
        MachinedPart {
            surface: self.surface,
            cutter: self.cutter,
            region: self.region.clone(),
            field: self.field.clone(),
            tip_mm: None,
        }
    }
}

/// A part that is being cut. As an [`Observer`] it is cut where the tool really is, servo errors included.
pub struct MachinedPart<'a> {
    surface: &'a dyn DesignSurface,
    cutter: Cutter,
    region: MapRegion,
    field: HeightField,
    tip_mm: Option<SVector<f64, 3>>,
}

impl MachinedPart<'_> {
    /// Sweeps the cutter on to `tip_mm`.
    ///
    /// # Errors
    /// A coordinate that is not a number.
    pub fn cut_to(&mut self, tip_mm: SVector<f64, 3>) -> Result<(), HeightFieldError> {
        let from = self.tip_mm.replace(tip_mm).unwrap_or(tip_mm);
        self.field.cut(&self.cutter, from, tip_mm)
    }

    fn follow(&mut self, motion: &Motion) -> Result<(), HeightFieldError> {
        let shape = &motion.shape;
        let length = shape.length_mm();
        let mut cursor = Cursor::default();
        self.cut_to(shape.point_mm(0.0, &mut cursor))?;
        let mut from = 0.0;
        while from < length {
            let to = if length - from <= SQRT_2 * STRETCH_MM { length } else { from + STRETCH_MM };
            // A corner counts with the stretch before it; on either side the curve is what it is.
            let bend = shape.curvature_bound_1_mm(from, to);
            let bend = if bend.is_finite() { bend } else { 1.0 / CHORD_ERROR_MM };
            // The sagitta κ l²/8 of a chord l.
            let parts = ((to - from) * (bend / (8.0 * CHORD_ERROR_MM)).sqrt()).ceil().max(1.0);
            let mut part = 0.0;
            while part < parts {
                part += 1.0;
                let s = if part < parts { from + (to - from) * part / parts } else { to };
                self.cut_to(shape.point_mm(s, &mut cursor))?;
            }
            from = to;
        }
        Ok(())
    }

    /// How far the part as it is now is from the surface.
    pub fn map(mut self) -> DeviationMap {
        DeviationMap::of(&mut self.field, self.surface, Some(&self.region))
    }
}

impl Observer<3> for MachinedPart<'_> {
    fn period(&mut self, period: &Period<3>) -> Result<(), ObserverError> {
        Ok(self.cut_to(period.actual_mm)?)
    }
}
