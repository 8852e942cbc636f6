//! Error of the fast step-over form against the exact one, over the curvature radius.

use super::super::axis::{Axis, Range, figure};
use super::super::curve::{Dash, Frame};
use super::super::machining::{stepover_row, stepover_table};
use super::super::panel::{Entry, Heading, Panel, gutter};
use super::super::sheet::{Pen, RUN_COLOURS, Sheet};

/// Cutter radius \[mm\] and scallop heights \[mm\] of the paper's comparison.
pub(in super::super) const CUTTER_MM: f64 = 5.0;
pub(in super::super) const SCALLOPS_MM: [f64; 2] = [0.01, 0.1];

/// Curvature radii shown \[mm\].
const RADII: Range = Range { low: 2.0, high: 100.0 };
const SAMPLES: u32 = 400;

fn pen(scallop_mm: f64, convex: bool) -> Pen {
    let colour = RUN_COLOURS[usize::from(scallop_mm > SCALLOPS_MM[0])];
    Pen { dash: (!convex).then_some(Dash::new(8.0, 4.0)), ..Pen::solid(colour, 2.0) }
}

pub(in super::super) fn sheet() -> Sheet {
    let mut sheet = Sheet::default();
    let mut curves = Vec::new();
    for scallop in SCALLOPS_MM {
        for convex in [true, false] {
            let sign = if convex { 1.0 } else { -1.0 };
            let points: Vec<(f64, f64)> = (0..=SAMPLES)
                .map(|i| RADII.low * libm::pow(RADII.high / RADII.low, f64::from(i) / f64::from(SAMPLES)))
                // In a hollow hardly wider than the cutter the error runs away.
                .filter(|radius| convex || *radius >= 1.05 * CUTTER_MM)
                .filter_map(|radius| stepover_row(CUTTER_MM, scallop, sign * radius).ok())
                .map(|row| (row.curvature_radius_mm.abs(), row.error_percent))
                .collect();
            curves.push((scallop, convex, points));
        }
    }
    let legend = curves.iter().map(|(scallop, convex, _)| {
        let bent = if *convex { "convex" } else { "concave" };
        Entry::line(pen(*scallop, *convex), format!("{bent}, h = {} mm", figure(*scallop, 3)))
    });
    let head = Heading {
        title: "Step-over: error of the fast form".to_owned(),
        subtitle: format!(
            "(v − w)/w of the fast form v = √(8 h r R/(R + r)), w exact, without sign; cutter radius r = {} mm; the points are the paper's table",
            figure(CUTTER_MM, 3)
        ),
        legend: legend.collect(),
        ..Heading::default()
    };
    let space = head.draw(&mut sheet);
    let errors = Range::of(curves.iter().flat_map(|(_, _, points)| points).map(|(_, error)| *error));
    let y = Axis::decades(Range { low: 0.6 * errors.low, high: 1.3 * errors.high });
    let gutter = gutter(&[&y]);
    let frame = Frame { left: space.left + gutter, right: space.right - 8.0, ..space };
    let mut panel = Panel::new(frame, Axis::decades(RADII), y);
    panel.grid(&mut sheet);
    for (scallop, convex, points) in curves {
        panel.curve(&mut sheet, points, pen(scallop, convex));
    }
    let rows = stepover_table();
    for row in &rows {
        let at = panel.at(row.curvature_radius_mm.abs(), row.error_percent);
        sheet.ring(at, 4.5, 1.8, pen(row.scallop_mm, true).colour);
        panel.keep_clear(vec![(at.0, at.1 - 8.0), (at.0, at.1 + 9.0)]);
    }
    for row in &rows {
        let at = panel.at(row.curvature_radius_mm.abs(), row.error_percent);
        let error = |radius: f64| {
            let same = rows.iter().find(|r| r.scallop_mm == row.scallop_mm && r.curvature_radius_mm == radius);
            figure(same.map_or(f64::NAN, |row| row.error_percent), 3)
        };
        let text = match row.curvature_radius_mm {
            // Of the three concave ones the middle says it.
            -10.0 => format!("R = −11 … −9: {} … {} %", error(-11.0), error(-9.0)),
            radius if radius > 0.0 => format!("R = {}: {} %", figure(radius, 3), error(radius)),
            _ => continue,
        };
        panel.point_label(&mut sheet, at, &text, pen(row.scallop_mm, true).colour);
    }
    panel.border(&mut sheet, true, true);
    panel.x_title(&mut sheet, "curvature radius |R|", "mm");
    panel.y_title(&mut sheet, gutter, "error of the fast step-over", "%");
    sheet
}
