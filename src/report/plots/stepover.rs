//! Error of the fast step-over form against the exact one, over the curvature radius.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::{Dash, Frame};
use super::super::figure::{Figure, LineStyle, RUN_COLOURS};
use super::super::machining::{StepoverPicture, StepoverRow, stepover_row};
use super::super::subplot::{Entry, Heading, Subplot, gutter};

/// Points of a curve.
const SAMPLES: u32 = 400;
/// Decades of the error shown at most: where the forms cross it is nothing at all.
const MOST_DECADES: f64 = 1e5;
/// Neighbouring concave radii up to this many times each other are told of together.
const TOGETHER: f64 = 1.5;

fn line_style(scallop: usize, convex: bool) -> LineStyle {
    let colour = RUN_COLOURS[scallop % RUN_COLOURS.len()];
    LineStyle { dash: (!convex).then_some(Dash::new(8.0, 4.0)), ..LineStyle::solid(colour, 2.0) }
}

/// Radii that can be drawn: the range asked for, else the paper's.
fn radii(picture: &StepoverPicture) -> Range {
    let [low, high] = picture.range_mm;
    let sound = low >= 1e-6 && high <= 1e9 && high >= 1.001 * low;
    let [low, high] = if sound { [low, high] } else { StepoverPicture::default().range_mm };
    Range { low, high }
}

pub(in super::super) fn figure(picture: &StepoverPicture) -> Figure {
    let mut figure = Figure::default();
    let (radii, cutter) = (radii(picture), picture.radius_mm);
    let mut curves = Vec::new();
    for (i, scallop) in picture.scallops_mm.iter().enumerate() {
        for convex in [true, false] {
            let sign = if convex { 1.0 } else { -1.0 };
            let points: Vec<(f64, f64)> = (0..=SAMPLES)
                .map(|i| radii.low * libm::pow(radii.high / radii.low, f64::from(i) / f64::from(SAMPLES)))
                // In a hollow hardly wider than the cutter the error runs away.
                .filter(|radius| convex || *radius >= 1.05 * cutter)
                .filter_map(|radius| stepover_row(cutter, *scallop, sign * radius).ok())
                .map(|row| (row.curvature_radius_mm.abs(), row.error_percent))
                .collect();
            curves.push((i, convex, points));
        }
    }
    let legend = curves.iter().filter(|(_, _, points)| !points.is_empty()).map(|(i, convex, _)| {
        let bent = if *convex { "convex" } else { "concave" };
        let scallop = picture.scallops_mm.get(*i).copied().unwrap_or_default();
        Entry::line(line_style(*i, *convex), format!("{bent}, h = {} mm", significant(scallop, 3)))
    });
    let mut head = Heading {
        title: "Step-over: error of the fast form".to_owned(),
        subtitle: format!(
            "(v − w)/w of the fast form v = √(8 h r R/(R + r)), w exact, without sign; cutter radius r = {} mm; the points are {}",
            significant(cutter, 3),
            if *picture == StepoverPicture::default() { "the paper's table" } else { "those of the table" }
        ),
        legend: legend.collect(),
        ..Heading::default()
    };
    let mut errors = Range::of(curves.iter().flat_map(|(_, _, points)| points).map(|(_, error)| *error));
    if errors.is_empty() {
        head.warnings.push("Nothing to show: no curvature radius of this range has a step-over".to_owned());
        errors = Range { low: 0.1, high: 1.0 };
    }
    errors.high = errors.high.max(1e-9);
    errors.low = errors.low.max(errors.high / MOST_DECADES);
    let space = head.draw(&mut figure);
    let y = Axis::decades(Range { low: 0.6 * errors.low, high: 1.3 * errors.high });
    let gutter = gutter(&[&y]);
    let frame = Frame { left: space.left + gutter, right: space.right - 8.0, ..space };
    let mut subplot = Subplot::new(frame, Axis::decades(radii), y);
    subplot.grid(&mut figure);
    for (i, convex, points) in curves {
        subplot.curve(&mut figure, points, line_style(i, convex));
    }
    let marked: Vec<Vec<StepoverRow>> = picture
        .scallops_mm
        .iter()
        .map(|scallop| {
            let rows = picture.curvature_radii_mm.iter().filter_map(|r| stepover_row(cutter, *scallop, *r).ok());
            rows.filter(|row| subplot.holds(subplot.at(row.curvature_radius_mm.abs(), row.error_percent))).collect()
        })
        .collect();
    for (i, row) in marked.iter().enumerate().flat_map(|(i, rows)| rows.iter().map(move |row| (i, row))) {
        let at = subplot.at(row.curvature_radius_mm.abs(), row.error_percent);
        figure.ring(at, 4.5, 1.8, line_style(i, true).colour);
        subplot.keep_clear(vec![(at.0, at.1 - 8.0), (at.0, at.1 + 9.0)]);
    }
    for (i, rows) in marked.iter().enumerate() {
        for (of, text) in labels(rows) {
            // Below or above all points that it is of.
            let px = of.iter().map(|row| subplot.at(row.curvature_radius_mm.abs(), row.error_percent));
            let (x, y) = (Range::of(px.clone().map(|at| at.0)), Range::of(px.map(|at| at.1)));
            subplot.point_label(&mut figure, (x.middle(), y.high), &text, line_style(i, true).colour);
        }
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "curvature radius |R|", "mm");
    subplot.y_title(&mut figure, gutter, "error of the fast step-over", "%");
    figure
}

/// What is said of the points of one scallop height: of neighbouring concave ones it is said once.
fn labels(rows: &[StepoverRow]) -> Vec<(Vec<StepoverRow>, String)> {
    let signed = |radius: f64| significant(radius, 3);
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| a.curvature_radius_mm.total_cmp(&b.curvature_radius_mm));
    let together = |a: &StepoverRow, b: &StepoverRow| {
        b.curvature_radius_mm < 0.0 && a.curvature_radius_mm >= TOGETHER * b.curvature_radius_mm
    };
    let text = |group: &[StepoverRow]| match group {
        [first, .., last] => format!(
            "R = {} … {}: {} … {} %",
            signed(first.curvature_radius_mm),
            signed(last.curvature_radius_mm),
            significant(first.error_percent, 3),
            significant(last.error_percent, 3)
        ),
        [row] => format!("R = {}: {} %", signed(row.curvature_radius_mm), significant(row.error_percent, 3)),
        [] => String::new(),
    };
    sorted.chunk_by(together).map(|group| (group.to_vec(), text(group))).collect()
}
