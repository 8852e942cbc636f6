//! The metric over one variable.

use super::super::super::axis::{Axis, Range, significant};
use super::super::super::curve::Dash;
use super::super::super::figure::Figure;
use super::super::super::style::{CURVE_PX, LineStyle, MUTED, RUN_COLOURS};
use super::super::super::subplot::{Entry, Subplot, gutter, stack, y_axis};
use super::shared::{BEST, LOCKED, MISSING, across, heading, marker, missing_entries, ring_entry, with_unit};
use crate::sweep::{SweepCell, SweepPicture, SweepPlot};

/// From this ratio of largest to smallest on the metric is drawn on a logarithmic axis.
const WIDE: f64 = 50.0;

pub(in super::super::super) fn figure(picture: &SweepPicture) -> Figure {
    let mut figure = Figure::default();
    let SweepPlot::Curve { axis, points, own, best } = &picture.plot else { return figure };
    let line_style = LineStyle::solid(RUN_COLOURS[0], CURVE_PX);
    let own_line_style = LineStyle { dash: Some(Dash::new(6.0, 4.0)), ..LineStyle::solid(MUTED, 1.3) };
    let mut x_range = Range::of(points.iter().map(|(x, _)| *x));
    if !axis.logarithmic {
        x_range = x_range.opened(1e-300).padded(0.02, 0.02);
    }
    let mut head = heading(picture);
    head.legend.push(Entry::line(line_style, picture.metric));
    if let Some((x, value)) = best {
        head.legend.push(ring_entry(BEST, format!("best: {} at {}", with_unit(picture, *value), significant(*x, 5))));
    }
    if let Some(own) = own {
        let beyond = if (x_range.low..=x_range.high).contains(own) { "" } else { ", outside" };
        head.legend.push(Entry::line(own_line_style, format!("the scenario ({}){beyond}", significant(*own, 5))));
    }
    head.legend.extend(missing_entries(points.iter().map(|(_, cell)| *cell)));
    let space = head.draw(&mut figure);

    let value = |cell: &SweepCell| if let SweepCell::Metric(value) = cell { Some(*value) } else { None };
    let range = Range::of(points.iter().filter_map(|(_, cell)| value(cell)));
    let y = if range.low > 0.0 && range.high > WIDE * range.low {
        Axis::logarithmic_within(range, space.height(), 45.0)
    } else {
        y_axis(range.opened(1e-9).padded(0.08, 0.1), space.height(), false)
    };
    let gutter = gutter(&[&y]);
    let Some(frame) = stack(&space, &[&y], 0.0).pop() else { return figure };
    let mut subplot = Subplot::new(frame, across(x_range, frame.width(), axis.logarithmic), y);
    subplot.grid(&mut figure);
    if let Some(own) = own.filter(|own| (x_range.low..=x_range.high).contains(own)) {
        let x = subplot.at(own, 0.0).0;
        figure.line(&[(x, frame.top), (x, frame.bottom)], own_line_style);
    }
    // A point without a metric breaks the curve, and is marked at the foot.
    for piece in points.chunk_by(|a, b| value(&a.1).is_some() == value(&b.1).is_some()) {
        let curve: Vec<(f64, f64)> = piece.iter().filter_map(|(x, cell)| Some((*x, value(cell)?))).collect();
        if !curve.is_empty() {
            subplot.curve(&mut figure, curve.iter().copied(), line_style);
            if points.len() <= 120 {
                for (x, y) in &curve {
                    figure.dot(subplot.at(*x, *y), 2.6, line_style.colour);
                }
            }
        }
        for (x, cell) in piece.iter().filter(|(_, cell)| value(cell).is_none()) {
            let colour = if *cell == SweepCell::LockedUp { LOCKED } else { MISSING };
            let x = subplot.at(*x, 0.0).0;
            figure.line(&[(x, frame.bottom - 12.0), (x, frame.bottom - 1.0)], LineStyle::solid(colour, 4.0));
        }
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, &axis.title, "");
    subplot.y_title(&mut figure, gutter, picture.metric, picture.unit);
    if let Some((x, value)) = best {
        marker(&mut figure, subplot.at(*x, *value), BEST);
    }
    figure
}
