//! Contouring error and voltages over time.

use super::super::axis::{Range, significant};
use super::super::data::PlotSample;
use super::super::figure::Figure;
use super::super::style::{CURVE_PX, INK};
use super::super::subplot::{Entry, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use super::named_run::{
    LIMIT, LIMIT_IN_VIEW, Named, heading, in_scale, limits, off_scale, off_scale_text, samples, time_range,
};
use super::words::capital;
use crate::parameters::{AXIS_NAMES, axis_title};

/// The contouring error is exact to a nanometre: a narrower range shows rounding \[µm\].
pub(super) const LEAST_ERROR_UM: f64 = 2e-3;
/// Runs whose largest error is labelled in the subplot; of more the legend tells.
const LABELLED_RUNS: usize = 3;
const GAP: f64 = 18.0;

pub(in super::super) fn contour(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let samples = samples(runs);
    let error = |sample: &PlotSample| sample.contour_error_um;
    let in_scale = in_scale(runs, |run| run.data.metrics().worst.contour_error_um.abs());
    let scaled = samples.iter().zip(&in_scale).filter(|(_, is_shown)| **is_shown).map(|(samples, _)| samples);
    let mut range = Range::of(scaled.flatten().map(error));
    range.include(0.0);
    let limits = limits(runs, "contour_error_um", range.magnitude());
    for (limit, _) in limits.iter().filter(|(_, in_view)| *in_view) {
        range.include(*limit);
        range.include(-*limit);
    }
    let range = range.opened(LEAST_ERROR_UM).padded(0.12, 0.12);

    let mut head = heading(runs, "contouring error");
    if let [run] = runs {
        head.subtitle = capital(&contour_metrics(run));
        if let Some(check) = run.data.limit("contour_error_um") {
            let verdict = if check.kept { "kept" } else { "broken" };
            head.subtitle = format!("{}, limit {} µm {verdict}", head.subtitle, significant(check.limit, 6));
        }
        head.legend.push(Entry::line(run.line_style(CURVE_PX), "contouring error, positive to the left of the path"));
    } else {
        let entry = |(run, in_scale): (&Named<'_>, &bool)| {
            let text = format!("{} ({}{})", run.short(), contour_metrics(run), off_scale_text(*in_scale));
            Entry::line(run.line_style(CURVE_PX), text)
        };
        head.legend.extend(runs.iter().zip(&in_scale).map(entry));
    }
    head.legend.extend(off_scale(&limits, "limit ±", "µm"));
    let space = head.draw(&mut figure);

    let y = y_axis(range, space.height(), false);
    let gutter = gutter(&[&y]);
    let Some(frame) = stack(&space, &[&y], GAP).pop() else { return figure };
    let mut subplot = Subplot::new(frame, x_axis(time_range(runs, &samples), frame.width(), false), y);
    subplot.grid(&mut figure);
    for (limit, _) in &limits {
        subplot.level(&mut figure, *limit, LIMIT);
        subplot.level(&mut figure, -*limit, LIMIT);
    }
    // Those that locked up below the others.
    let mut order: Vec<_> = runs.iter().zip(&samples).zip(&in_scale).collect();
    order.sort_by_key(|((run, _), _)| !run.data.metadata().locked_up);
    let curves = order.iter().map(|((run, samples), _)| {
        let values = samples.iter().map(|s| (s.time_s, error(s)));
        (values, run.line_style(CURVE_PX))
    });
    subplot.time_curves(&mut figure, curves);
    for ((run, samples), in_scale) in &order {
        if !**in_scale && let Some(out) = samples.iter().find(|s| !subplot.y.range.holds(error(s))) {
            let place = subplot.at(out.time_s, error(out));
            subplot.beyond(&mut figure, place, &format!("{}: locked up", run.short()), run.colour);
        }
    }
    for (run, _) in runs.iter().zip(&in_scale).filter(|(run, is_shown)| **is_shown && run.data.metrics().samples > 0) {
        let worst = run.data.metrics().worst;
        let at = subplot.at(worst.time_s, error(&worst));
        subplot.ring(&mut figure, at, 4.5, 1.5, run.colour);
        if runs.len() <= LABELLED_RUNS {
            let text = format!("max {} µm", significant(error(&worst).abs(), 4));
            subplot.point_label(&mut figure, at, &text, if runs.len() == 1 { INK } else { run.colour });
        }
    }
    for (limit, _) in &limits {
        // Where the limits lie close together beside a huge error, one label is enough.
        let apart = (subplot.at(0.0, *limit).1 - subplot.at(0.0, -*limit).1).abs();
        if apart < 40.0 {
            subplot.level_label(&mut figure, *limit, &format!("limit ±{} µm", significant(*limit, 6)), LIMIT.colour);
        } else {
            subplot.level_label(&mut figure, *limit, &format!("limit +{} µm", significant(*limit, 6)), LIMIT.colour);
            subplot.level_label(&mut figure, -*limit, &format!("limit {} µm", significant(-*limit, 6)), LIMIT.colour);
        }
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "time", "s");
    subplot.y_title(&mut figure, gutter, "contouring error", "µm");
    figure
}

/// The run's error in metrics.
fn contour_metrics(run: &Named<'_>) -> String {
    let metrics = run.data.metrics();
    if metrics.samples == 0 {
        return "no samples".to_owned();
    }
    format!(
        "max {} µm at {} s, rms {} µm",
        significant(metrics.worst.contour_error_um.abs(), 4),
        significant(metrics.worst.time_s, 4),
        significant(metrics.rms_contour_um(), 4)
    )
}

pub(in super::super) fn voltage(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let samples = samples(runs);
    let mut head = heading(runs, "motor voltage");
    if let [run] = runs {
        head.subtitle = capital(&voltage_metrics(run));
    } else {
        let entry = |run: &Named<'_>| {
            Entry::line(run.line_style(CURVE_PX), format!("{} ({})", run.short(), voltage_metrics(run)))
        };
        head.legend.extend(runs.iter().map(entry));
    }
    let scales: Vec<_> = (0..axes(runs)).map(|axis| voltage_scale(runs, &samples, axis)).collect();
    let hidden = |axis: usize, limit: f64| scales[axis].1.contains(&(limit, false));
    let mut told: Vec<f64> = Vec::new();
    for limit in scales.iter().flat_map(|(_, limits)| limits).filter(|(_, in_view)| !in_view).map(|(limit, _)| *limit) {
        if told.contains(&limit) {
            continue;
        }
        told.push(limit);
        // Of which axes, where others show it.
        let of: Vec<String> = (0..scales.len()).filter(|axis| hidden(*axis, limit)).map(axis_title).collect();
        let of = if of.len() < scales.len() { format!("{} ", of.join(", ")) } else { String::new() };
        head.legend.extend(off_scale(&[(limit, false)], &format!("{of}saturation ±"), "V"));
    }
    let space = head.draw(&mut figure);

    let (last, height) = (scales.len() - 1, subplot_height(&space, scales.len(), GAP));
    let y: Vec<_> = scales.iter().map(|(range, _)| y_axis(*range, height, false)).collect();
    let each: Vec<_> = y.iter().collect();
    let gutter = gutter(&each);
    let frames = stack(&space, &each, GAP);
    for (axis, ((frame, y), (range, limits))) in frames.into_iter().zip(y).zip(&scales).enumerate() {
        let mut subplot = Subplot::new(frame, x_axis(time_range(runs, &samples), frame.width(), false), y);
        let widest = limits.iter().map(|(limit, _)| *limit).fold(0.0, f64::max);
        if widest > 0.0 {
            subplot.shade(&mut figure, widest, range.high);
            subplot.shade(&mut figure, -widest, range.low);
        }
        subplot.grid(&mut figure);
        for (limit, _) in limits {
            subplot.level(&mut figure, *limit, LIMIT);
            subplot.level(&mut figure, -*limit, LIMIT);
        }
        let curves = runs.iter().zip(&samples).map(|(run, samples)| {
            let values = samples.iter().map(move |s| (s.time_s, s.voltage_v[axis]));
            (values, run.line_style(CURVE_PX))
        });
        subplot.time_curves(&mut figure, curves);
        for (limit, _) in limits {
            subplot.level_label(
                &mut figure,
                *limit,
                &format!("saturation ±{} V", significant(*limit, 6)),
                LIMIT.colour,
            );
        }
        subplot.border(&mut figure, axis == last, true);
        let name = axis_title(axis);
        subplot.y_title(&mut figure, gutter, &format!("{name} voltage"), "V");
        if axis == last {
            subplot.x_title(&mut figure, "time", "s");
        }
    }
    figure
}

/// How many axes are drawn.
fn axes(runs: &[Named<'_>]) -> usize {
    if runs.iter().any(|run| run.data.metadata().three_axes) { 3 } else { 2 }
}

/// Range of one axis' voltage, and its limits with whether they are in view.
fn voltage_scale(runs: &[Named<'_>], samples: &[Vec<PlotSample>], axis: usize) -> (Range, Vec<(f64, bool)>) {
    let mut range = Range::of(samples.iter().flatten().map(|sample| sample.voltage_v[axis]));
    range.include(0.0);
    let mut limits: Vec<(f64, bool)> = Vec::new();
    let peak = range.magnitude();
    for limit in runs.iter().map(|run| run.data.metadata().voltage_limit_v[axis]) {
        if limit > 0.0 && limit <= 1e100 && !limits.iter().any(|(other, _)| *other == limit) {
            let in_view = limit <= LIMIT_IN_VIEW * peak;
            limits.push((limit, in_view));
            if in_view {
                range.include(limit);
                range.include(-limit);
            }
        }
    }
    (range.opened(1e-6).padded(0.13, 0.13), limits)
}

fn voltage_metrics(run: &Named<'_>) -> String {
    if run.data.metrics().samples == 0 {
        return "no samples".to_owned();
    }
    let peaks = run.data.metrics().peak_voltage_v;
    let limits = run.data.metadata().voltage_limit_v;
    let count = axes(std::slice::from_ref(run));
    let axes = AXIS_NAMES.iter().zip(peaks).zip(limits).take(count).map(|((name, peak), limit)| {
        let of = if limit > 0.0 && limit <= 1e100 { format!(" of {}", significant(limit, 4)) } else { String::new() };
        format!("{} {}{of} V", name.to_uppercase(), significant(peak, 4))
    });
    format!("peak {}", axes.collect::<Vec<_>>().join(", "))
}
