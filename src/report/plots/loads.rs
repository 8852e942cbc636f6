//! What a motion under limits of the axes asks of every axis, beside the limits.

use super::super::axis::{Range, significant};
use super::super::curve::Dash;
use super::super::data::{AxisLoad, AxisLoads};
use super::super::figure::Figure;
use super::super::style::{CURVE_PX, LineStyle, RUN_COLOURS};
use super::super::subplot::{Entry, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use super::named_run::{LIMIT, LIMIT_IN_VIEW, Named, heading, off_scale};
use crate::parameters::{AXIS_NAMES, axis_title};

const GAP: f64 = 14.0;

/// One of the three quantities.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    of_load: fn(&AxisLoad) -> [f64; 2],
    limits: fn(&AxisLoads) -> [f64; 2],
}

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        name: "velocity",
        unit: "mm/s",
        of_load: |load| load.velocity_mm_s,
        limits: |loads| loads.limits.velocity_mm_s,
    },
    Quantity {
        name: "acceleration",
        unit: "mm/s²",
        of_load: |load| load.acceleration_mm_s2,
        limits: |loads| loads.limits.acceleration_mm_s2,
    },
    Quantity { name: "jerk", unit: "mm/s³", of_load: |load| load.jerk_mm_s3, limits: |loads| loads.limits.jerk_mm_s3 },
];

pub(in super::super) fn figure(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let loads: Vec<(&Named<'_>, &AxisLoads)> =
        runs.iter().filter_map(|run| Some((run, run.data.metadata().axis_loads.as_ref()?))).collect();
    let mut head = heading(runs, "velocity, acceleration and jerk of the axes");
    if let [(_, loads)] = loads.as_slice() {
        head.subtitle = format!("At most {} of the axes' limits", shares(loads));
    }
    for (run, loads_of) in &loads {
        for (axis, name) in AXIS_NAMES.iter().enumerate().take(2) {
            let name = name.to_uppercase();
            let text = match (runs.len(), axis) {
                (1, _) => format!("{name} axis"),
                (_, 0) => format!("{}, {name} ({})", run.short(), shares(loads_of)),
                _ => name,
            };
            head.legend.push(Entry::line(line_style(runs, run, axis), text));
        }
    }
    let scales = QUANTITIES.each_ref().map(|quantity| scale(&loads, quantity));
    for (quantity, (_, limits)) in QUANTITIES.iter().zip(&scales) {
        head.legend.extend(off_scale(limits, &format!("{} limit ±", quantity.name), quantity.unit));
    }
    let space = head.draw(&mut figure);
    let time = Range::of(loads.iter().flat_map(|(_, loads)| loads.samples.iter().map(|load| load.time_s)));
    let height = subplot_height(&space, 3, GAP);
    let y = scales.each_ref().map(|(range, _)| y_axis(*range, height, false));
    let y_axes = [&y[0], &y[1], &y[2]];
    let gutter = gutter(&y_axes);
    let frames = stack(&space, &y_axes, GAP);
    for (row, (((frame, y), quantity), (_, limits))) in
        frames.into_iter().zip(y.clone()).zip(&QUANTITIES).zip(&scales).enumerate()
    {
        let mut subplot = Subplot::new(frame, x_axis(time, frame.width(), false), y);
        subplot.grid(&mut figure);
        for (limit, _) in limits {
            subplot.level(&mut figure, *limit, LIMIT);
            subplot.level(&mut figure, -*limit, LIMIT);
        }
        let curves = loads.iter().flat_map(|(run, loads)| {
            [0, 1].map(|axis| {
                let values = loads.samples.iter().map(move |load| (load.time_s, (quantity.of_load)(load)[axis]));
                (values, line_style(runs, run, axis))
            })
        });
        subplot.time_curves(&mut figure, curves);
        for (limit, _) in limits {
            let text =
                format!("{}limit ±{} {}", whose(&loads, quantity, *limit), significant(*limit, 6), quantity.unit);
            subplot.level_label(&mut figure, *limit, &text, LIMIT.colour);
        }
        subplot.border(&mut figure, row == 2, true);
        subplot.y_title(&mut figure, gutter, quantity.name, quantity.unit);
        if row == 2 {
            subplot.x_title(&mut figure, "time", "s");
        }
    }
    figure
}

/// Of one run the axes have colours, of several the runs, and Y is dashed.
fn line_style(runs: &[Named<'_>], run: &Named<'_>, axis: usize) -> LineStyle {
    if runs.len() == 1 {
        return LineStyle::solid(RUN_COLOURS[axis % RUN_COLOURS.len()], CURVE_PX);
    }
    let line_style = run.line_style(CURVE_PX);
    if axis == 0 { line_style } else { LineStyle { dash: Some(Dash::new(6.0, 3.0)), ..line_style } }
}

/// Range of a quantity over all runs and axes, and its limits with whether they are in view.
fn scale(loads: &[(&Named<'_>, &AxisLoads)], quantity: &Quantity) -> (Range, Vec<(f64, bool)>) {
    let values = loads.iter().flat_map(|(_, loads)| loads.samples.iter().flat_map(|load| (quantity.of_load)(load)));
    let mut range = Range::of(values);
    range.include(0.0);
    let peak = range.magnitude();
    let mut limits: Vec<(f64, bool)> = Vec::new();
    for limit in loads.iter().flat_map(|(_, loads)| (quantity.limits)(loads)) {
        if !limits.iter().any(|(other, _)| *other == limit) {
            let in_view = limit <= LIMIT_IN_VIEW * peak;
            limits.push((limit, in_view));
            if in_view {
                range.include(limit);
                range.include(-limit);
            }
        }
    }
    (range.opened(1e-6).padded(0.1, 0.14), limits)
}

/// Of which axis a limit is, where they differ.
fn whose(loads: &[(&Named<'_>, &AxisLoads)], quantity: &Quantity, limit: f64) -> String {
    let of_axis = |axis: usize| loads.iter().any(|(_, loads)| (quantity.limits)(loads)[axis] == limit);
    match (of_axis(0), of_axis(1)) {
        (true, false) => format!("{} ", axis_title(0)),
        (false, true) => format!("{} ", axis_title(1)),
        _ => String::new(),
    }
}

/// The largest shares of the limits that are used.
fn shares(loads: &AxisLoads) -> String {
    let share = |quantity: &Quantity| {
        let limits = (quantity.limits)(loads);
        let used = |load: &AxisLoad| {
            let [x, y] = (quantity.of_load)(load);
            (x / limits[0]).abs().max((y / limits[1]).abs())
        };
        let largest = loads.samples.iter().map(used).fold(0.0, f64::max);
        format!("{:.1} %", 100.0 * largest)
    };
    let [velocity, acceleration, jerk] = QUANTITIES.each_ref().map(share);
    format!("{velocity}, {acceleration} and {jerk}")
}
