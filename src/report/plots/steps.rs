//! Step and following error of every axis.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::Frame;
use super::super::figure::Figure;
use super::super::font;
use super::super::style::{CURVE_PX, Colour, DESIRED, LineStyle, RUN_COLOURS};
use super::super::subplot::{Heading, Subplot, TITLE_EM, gutter, stack, subplot_height, x_axis, y_axis};
use super::words::printable;
use crate::measure::{AxisSteps, Sampled, Steps};

const GAP: f64 = 18.0;
/// Between the two columns \[px\].
const COLUMNS: f64 = 20.0;
const COMMAND: LineStyle = LineStyle { colour: DESIRED, width_px: 2.0, dash: None };

pub(in super::super) fn figure(measured: &Steps) -> Figure {
    let mut figure = Figure::default();
    let name = font::shortened(&printable(&measured.scenario), TITLE_EM, 600.0);
    let feed = measured.axes.first().map_or(0.0, |axis| axis.ramp.feed_mm_s);
    let head = Heading {
        title: format!(
            "{name}: step of {} µm, following error at {} mm/s",
            significant(measured.step_um, 5),
            significant(feed, 5)
        ),
        subtitle: format!("The shaded band is the window of ±{} µm", significant(measured.window_um, 4)),
        warnings: measured.warnings.iter().map(|text| printable(text)).collect(),
        ..Heading::default()
    };
    let space = head.draw(&mut figure);
    let half = 0.5 * (space.width() - COLUMNS);
    steps(&mut figure, measured, Frame { right: space.left + half, ..space });
    ramps(&mut figure, measured, Frame { left: space.right - half, ..space });
    figure
}

fn axes(measured: &Steps) -> impl Iterator<Item = (&AxisSteps, Colour)> {
    measured.axes.iter().zip(RUN_COLOURS)
}

/// Frames one below the other for the axes' values.
fn frames(space: &Frame, ranges: &[Range]) -> (Vec<(Frame, Axis)>, f64) {
    let height = subplot_height(space, ranges.len(), GAP);
    let y: Vec<Axis> = ranges.iter().map(|range| y_axis(range.padded(0.06, 0.14), height, false)).collect();
    let all: Vec<&Axis> = y.iter().collect();
    let gutter = gutter(&all);
    let frames = stack(space, &all, GAP);
    (frames.into_iter().zip(y.iter().cloned()).collect(), gutter)
}

fn steps(figure: &mut Figure, measured: &Steps, space: Frame) {
    // Somewhat longer than the slowest one takes.
    let longest = axes(measured).map(|(axis, _)| {
        let all = axis.step_samples.last().map_or(0.0, |sample| sample.time_s);
        axis.step.settling_s.map_or(all, |s| (2.0 * s).max(0.02)).min(all)
    });
    let end = longest.fold(1e-9, f64::max);
    let shown = |axis: &AxisSteps| -> Vec<(f64, f64)> {
        axis.step_samples.iter().take_while(|s| s.time_s <= end).map(|s| (1e3 * s.time_s, s.actual_um)).collect()
    };
    let range = |axis: &AxisSteps| {
        let mut range = Range::of(shown(axis).into_iter().map(|(_, x)| x));
        range.include(0.0);
        range.include(measured.step_um + measured.window_um.min(measured.step_um));
        range.opened(1e-6)
    };
    let ranges: Vec<Range> = axes(measured).map(|(axis, _)| range(axis)).collect();
    let (frames, gutter) = frames(&space, &ranges);
    let last = frames.len().saturating_sub(1);
    for (i, ((axis, colour), (frame, y))) in axes(measured).zip(frames).enumerate() {
        let x = x_axis(Range { low: 0.0, high: 1e3 * end }, frame.width(), false);
        let mut subplot = Subplot::new(frame, x, y);
        subplot.shade(figure, measured.step_um - measured.window_um, measured.step_um + measured.window_um);
        subplot.grid(figure);
        subplot.level(figure, measured.step_um, COMMAND);
        subplot.curve(figure, shown(axis), LineStyle::solid(colour, CURVE_PX));
        if let Some(settling_s) = axis.step.settling_s.filter(|settling_s| *settling_s <= end) {
            let at = subplot.at(1e3 * settling_s, near(&axis.step_samples, settling_s).actual_um);
            subplot.ring(figure, at, 4.0, 1.5, colour);
            let text = format!("settled in {} ms", significant(1e3 * settling_s, 3));
            subplot.point_label(figure, at, &text, colour);
        }
        if !axis.stable {
            subplot.note(figure, "does not settle: the loop is unstable", colour);
        } else if let (None, Some(last)) = (axis.step.settling_s, axis.step_samples.last()) {
            let at = subplot.at(0.75e3 * end, last.actual_um);
            let text = format!("rests {} µm off", significant(axis.step.rest_um.abs(), 3));
            subplot.point_label(figure, at, &text, colour);
        }
        let top = axis.step_samples.iter().copied().reduce(|a, b| if b.actual_um > a.actual_um { b } else { a });
        if let Some(top) = top.filter(|top| axis.stable && axis.step.overshoot_percent > 0.1 && top.time_s <= end) {
            let at = subplot.at(1e3 * top.time_s, top.actual_um);
            subplot.ring(figure, at, 4.0, 1.5, colour);
            let text = format!("overshoot {} %", significant(axis.step.overshoot_percent, 3));
            subplot.point_label(figure, at, &text, colour);
        }
        subplot.border(figure, i == last, true);
        subplot.y_title(figure, gutter, &format!("{} actual", axis.axis.to_uppercase()), "µm");
        if i == last {
            subplot.x_title(figure, "time from the step", "ms");
        }
    }
}

/// The sample next to a time.
fn near(samples: &[Sampled], time_s: f64) -> Sampled {
    let after = samples.partition_point(|sample| sample.time_s < time_s);
    let none = Sampled { time_s, command_um: 0.0, actual_um: 0.0 };
    let (Some(a), Some(b)) = (samples.get(after.saturating_sub(1)), samples.get(after)) else {
        return samples.last().copied().unwrap_or(none);
    };
    let share = if b.time_s > a.time_s { (time_s - a.time_s) / (b.time_s - a.time_s) } else { 0.0 };
    Sampled { actual_um: a.actual_um + share * (b.actual_um - a.actual_um), ..*a }
}

fn ramps(figure: &mut Figure, measured: &Steps, space: Frame) {
    let error = |sample: &Sampled| sample.command_um - sample.actual_um;
    let range = |axis: &AxisSteps| {
        let mut range = Range::of(axis.ramp_samples.iter().map(error));
        range.include(measured.window_um.min(range.magnitude()));
        range.include(-measured.window_um.min(range.magnitude()));
        range.opened(1e-6)
    };
    let ranges: Vec<Range> = axes(measured).map(|(axis, _)| range(axis)).collect();
    let ends = axes(measured).filter_map(|(axis, _)| axis.ramp_samples.last()).map(|sample| sample.time_s);
    let end = ends.fold(1e-9, f64::max);
    let (frames, gutter) = frames(&space, &ranges);
    let last = frames.len().saturating_sub(1);
    for (i, ((axis, colour), (frame, y))) in axes(measured).zip(frames).enumerate() {
        let mut subplot = Subplot::new(frame, x_axis(Range { low: 0.0, high: end }, frame.width(), false), y);
        subplot.shade(figure, -measured.window_um, measured.window_um);
        subplot.grid(figure);
        subplot.level(figure, 0.0, COMMAND);
        subplot.curve(
            figure,
            axis.ramp_samples.iter().map(|s| (s.time_s, error(s))),
            LineStyle::solid(colour, CURVE_PX),
        );
        let at = subplot.at(0.45, axis.ramp.following_error_um);
        // Labels that would not fit are left out.
        subplot.point_label(figure, at, &format!("{} µm", significant(axis.ramp.following_error_um, 4)), colour);
        subplot.border(figure, i == last, true);
        subplot.y_title(figure, gutter, &format!("{} following error", axis.axis.to_uppercase()), "µm");
        if i == last {
            subplot.x_title(figure, "time", "s");
        }
    }
}
