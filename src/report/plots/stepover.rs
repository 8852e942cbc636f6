//! Error of the fast step-over form against the exact one, over the curvature radius.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::{Dash, Frame};
use super::super::figure::Figure;
use super::super::part_data::StepoverPicture;
use super::super::style::{LineStyle, RUN_COLOURS};
use super::super::subplot::{Entry, Heading, Subplot, gutter};
use super::words::printable;
use crate::toolpath::{StepoverCurve, StepoverRow};

/// Decades of the error shown at most: where the forms cross it is nothing at all.
const MOST_DECADES: f64 = 1e5;
/// Neighbouring concave radii up to this many times each other are told of together.
const TOGETHER: f64 = 1.5;

fn line_style(scallop: usize, convex: bool) -> LineStyle {
    let colour = RUN_COLOURS[scallop % RUN_COLOURS.len()];
    LineStyle { dash: (!convex).then_some(Dash::new(8.0, 4.0)), ..LineStyle::solid(colour, 2.0) }
}

pub(in super::super) fn figure(picture: &StepoverPicture<'_>) -> Figure {
    let mut figure = Figure::default();
    let [low, high] = picture.range_mm;
    let is_range = low >= 1e-6 && high <= 1e9 && high >= 1.001 * low;
    let radii = if is_range { Range { low, high } } else { Range { low: 1.0, high: 100.0 } };
    let scallops = distinct(picture.curves.iter().map(|curve| curve.scallop_mm));
    let style = |curve: &StepoverCurve| line_style(place(&scallops, curve.scallop_mm), curve.convex);
    let legend = picture.curves.iter().filter(|curve| !curve.points.is_empty()).map(|curve| {
        let bent = if curve.convex { "convex" } else { "concave" };
        Entry::line(style(curve), format!("{bent}, h = {} mm", significant(curve.scallop_mm, 3)))
    });
    let mut head = Heading {
        title: "Step-over: error of the fast form".to_owned(),
        subtitle: printable(picture.caption),
        legend: legend.collect(),
        ..Heading::default()
    };
    let mut errors = Range::of(picture.curves.iter().flat_map(|curve| &curve.points).map(|[_, error]| *error));
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
    for curve in &picture.curves {
        subplot.curve(&mut figure, curve.points.iter().map(|[radius, error]| (*radius, *error)), style(curve));
    }
    let is_shown = |row: &StepoverRow| subplot.holds(subplot.at(row.curvature_radius_mm.abs(), row.error_percent));
    let of = |scallop: f64| picture.rows.iter().filter(move |row| row.scallop_mm == scallop).copied();
    let marked: Vec<Vec<StepoverRow>> =
        scallops.iter().map(|scallop| of(*scallop).filter(is_shown).collect()).collect();
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

/// The different scallop heights, in their order.
fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut distinct = Vec::new();
    for value in values {
        if !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}

fn place(values: &[f64], value: f64) -> usize {
    values.iter().position(|other| *other == value).unwrap_or(0)
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
