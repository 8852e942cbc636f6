//! Parts and tool paths as pictures.

use std::path::PathBuf;

use crate::machining::{DeviationMap, Inspection, PartMetrics};
use crate::report::{DeviationPicture, DeviationSubplot, MoveKind, PathMove, PathPicture, ReportError};
use crate::scenario::{Part, ToolPathSummary};
use crate::toolpath::plan::{Move, Stretch, ToolPath};

use crate::numbers::{short, significant};

/// Points that every piece of a curve is drawn with; what cannot be seen of them is left out.
const POINTS_A_SPAN: u32 = 16;

/// A tool path: its rings in plan, and in three dimensions.
pub fn of_path(part: &Part, path: &ToolPath, inspection: &Inspection<'_>, summary: &ToolPathSummary) -> PathPicture {
    let mut moves = Vec::with_capacity(path.moves.len());
    let mut at: Option<[f64; 3]> = None;
    let curves = summary.curves > 0;
    for motion in &path.moves {
        let end: [f64; 3] = motion.end_mm().into();
        let (kind, points_mm) = match motion {
            Move::Cut { stretch, level } => {
                (MoveKind::Ring(u32::try_from(*level).unwrap_or(u32::MAX)), drawn(stretch, curves))
            }
            Move::Link(stretch) => (MoveKind::Link, drawn(stretch, curves)),
            _ => (MoveKind::Rapid, at.into_iter().chain([end]).collect()),
        };
        moves.push(PathMove { kind, points_mm });
        at = Some(end);
    }
    let blocks = if summary.curves > 0 {
        format!("{} control points in {} curves", summary.control_points, summary.curves)
    } else {
        format!("{} straight blocks", summary.straight_blocks)
    };
    PathPicture {
        name: part.name.clone(),
        caption: format!(
            "{} rings, {} mm on the surface, {} rapid moves; {blocks}",
            summary.rings,
            significant(summary.feed_length_mm, 5),
            summary.air_moves,
        ),
        moves,
        borders_mm: inspection.borders_mm().to_vec(),
    }
}

/// Points of a motion on the surface, in the form that the program has it in.
fn drawn(stretch: &Stretch, as_curve: bool) -> Vec<[f64; 3]> {
    // A straight way is no curve in the program either.
    if !as_curve || stretch.straight_mm.len() <= 2 {
        return stretch.straight_mm.iter().map(|&point| point.into()).collect();
    }
    let curve = &stretch.curve;
    let spans = curve.knots().windows(2).filter(|span| span[0] < span[1]);
    let inner = spans.flat_map(|span| (0..POINTS_A_SPAN).map(|i| (span[0], span[1], f64::from(i))));
    let at = inner.map(|(from, to, i)| from + (to - from) * i / f64::from(POINTS_A_SPAN));
    at.chain([curve.domain().1]).map(|u| curve.point_mm(u).into()).collect()
}

/// Deviation maps side by side: title, map and metrics of each.
///
/// # Errors
/// Those of `write`.
pub fn of_maps(
    part: &Part,
    maps: &[(&str, &DeviationMap, &PartMetrics)],
    write: impl FnOnce(&DeviationPicture<'_>) -> Result<Vec<PathBuf>, ReportError>,
) -> Result<Vec<PathBuf>, ReportError> {
    let caption: Vec<String> = maps
        .iter()
        .map(|(_, _, metrics)| {
            format!(
                "scallop {} µm, gouge {} µm",
                significant(metrics.largest_scallop_um, 4),
                significant(metrics.deepest_gouge_um, 4)
            )
        })
        .collect();
    let cell = maps.first().map_or(0.0, |(_, map, _)| map.cell_mm());
    write(&DeviationPicture {
        name: &part.name,
        caption: &format!("deviation from the surface, along its normal; cells of {} mm", short(cell, 3)),
        maps: maps
            .iter()
            .zip(&caption)
            .map(|((title, map, _), caption)| DeviationSubplot {
                title,
                caption,
                low_mm: map.low_mm(),
                cell_mm: map.cell_mm(),
                columns: map.size()[0],
                values_um: map.values_um(),
            })
            .collect(),
        gouge_limit_um: Some(1e3 * part.options.tolerance_mm),
        excess_limit_um: Some(1e3 * part.options.scallop_mm),
    })
}
