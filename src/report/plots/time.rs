//! Contouring error and voltages over time.

use super::super::PlotSample;
use super::super::axis::{Range, figure};
use super::super::panel::{Entry, Panel, gutter, panel_height, stack, x_axis, y_axis};
use super::super::sheet::{CURVE_PX, INK, Sheet};
use super::{LIMIT, LIMIT_IN_VIEW, Named, capital, heading, limits, off_scale, samples, time_range};
use crate::limits::AXIS_NAMES;

/// The contouring error is exact to a nanometre: a narrower range shows rounding \[µm\].
pub(super) const LEAST_ERROR_UM: f64 = 2e-3;
/// Runs whose largest error is labelled in the panel; of more the legend tells.
const LABELLED_RUNS: usize = 3;
const GAP: f64 = 18.0;

pub(super) fn contour(runs: &[Named<'_>]) -> Sheet {
    let mut sheet = Sheet::default();
    let samples = samples(runs);
    let error = |sample: &PlotSample| sample.contour_error_um;
    let mut range = Range::of(samples.iter().flatten().map(error));
    range.include(0.0);
    let limits = limits(runs, "contour_error_um", range.magnitude());
    for (limit, _) in limits.iter().filter(|(_, in_view)| *in_view) {
        range.include(*limit);
        range.include(-*limit);
    }
    let range = range.opened(LEAST_ERROR_UM).padded(0.12, 0.12);

    let mut head = heading(runs, "contouring error");
    if let [run] = runs {
        head.subtitle = capital(&contour_figures(run));
        if let Some(check) = run.data.limit("contour_error_um") {
            let verdict = if check.kept { "kept" } else { "broken" };
            head.subtitle = format!("{}, limit {} µm {verdict}", head.subtitle, figure(check.limit, 6));
        }
        head.legend.push(Entry::line(run.pen(CURVE_PX), "contouring error, positive to the left of the path"));
    } else {
        let entry =
            |run: &Named<'_>| Entry::line(run.pen(CURVE_PX), format!("{} ({})", run.short(), contour_figures(run)));
        head.legend.extend(runs.iter().map(entry));
    }
    head.legend.extend(off_scale(&limits, "limit ±", "µm"));
    let space = head.draw(&mut sheet);

    let y = y_axis(range, space.height(), false);
    let gutter = gutter(&[&y]);
    let Some(frame) = stack(&space, &[&y], GAP).pop() else { return sheet };
    let mut panel = Panel::new(frame, x_axis(time_range(runs, &samples), frame.width(), false), y);
    panel.grid(&mut sheet);
    for (limit, _) in &limits {
        panel.level(&mut sheet, *limit, LIMIT);
        panel.level(&mut sheet, -*limit, LIMIT);
    }
    for (run, samples) in runs.iter().zip(&samples) {
        panel.curve(&mut sheet, samples.iter().map(|s| (s.time_s, error(s))), run.pen(CURVE_PX));
    }
    for run in runs.iter().filter(|run| run.data.figures().samples > 0) {
        let worst = run.data.figures().worst;
        let at = panel.at(worst.time_s, error(&worst));
        sheet.ring(at, 4.5, 1.5, run.colour);
        if runs.len() <= LABELLED_RUNS {
            let text = format!("max {} µm", figure(error(&worst).abs(), 4));
            panel.point_label(&mut sheet, at, &text, if runs.len() == 1 { INK } else { run.colour });
        }
    }
    for (limit, _) in &limits {
        // Where the limits lie close together beside a huge error, one label is enough.
        let apart = (panel.at(0.0, *limit).1 - panel.at(0.0, -*limit).1).abs();
        if apart < 40.0 {
            panel.level_label(&mut sheet, *limit, &format!("limit ±{} µm", figure(*limit, 6)), LIMIT.colour);
        } else {
            panel.level_label(&mut sheet, *limit, &format!("limit +{} µm", figure(*limit, 6)), LIMIT.colour);
            panel.level_label(&mut sheet, -*limit, &format!("limit {} µm", figure(-*limit, 6)), LIMIT.colour);
        }
    }
    panel.border(&mut sheet, true, true);
    panel.x_title(&mut sheet, "time", "s");
    panel.y_title(&mut sheet, gutter, "contouring error", "µm");
    sheet
}

/// The run's error in figures.
fn contour_figures(run: &Named<'_>) -> String {
    let figures = run.data.figures();
    if figures.samples == 0 {
        return "no samples".to_owned();
    }
    format!(
        "max {} µm at {} s, rms {} µm",
        figure(figures.worst.contour_error_um.abs(), 4),
        figure(figures.worst.time_s, 4),
        figure(figures.rms_contour_um(), 4)
    )
}

pub(super) fn voltage(runs: &[Named<'_>]) -> Sheet {
    let mut sheet = Sheet::default();
    let samples = samples(runs);
    let mut head = heading(runs, "motor voltage");
    if let [run] = runs {
        head.subtitle = capital(&voltage_figures(run));
    } else {
        let entry =
            |run: &Named<'_>| Entry::line(run.pen(CURVE_PX), format!("{} ({})", run.short(), voltage_figures(run)));
        head.legend.extend(runs.iter().map(entry));
    }
    let scales: Vec<_> = (0..axes(runs)).map(|axis| voltage_scale(runs, &samples, axis)).collect();
    let mut beyond: Vec<(f64, bool)> = scales.iter().flat_map(|(_, limits)| limits.iter().copied()).collect();
    beyond.dedup();
    head.legend.extend(off_scale(&beyond, "saturation ±", "V"));
    let space = head.draw(&mut sheet);

    let (last, height) = (scales.len() - 1, panel_height(&space, scales.len(), GAP));
    let y: Vec<_> = scales.iter().map(|(range, _)| y_axis(*range, height, false)).collect();
    let each: Vec<_> = y.iter().collect();
    let gutter = gutter(&each);
    let frames = stack(&space, &each, GAP);
    for (axis, ((frame, y), (range, limits))) in frames.into_iter().zip(y).zip(&scales).enumerate() {
        let mut panel = Panel::new(frame, x_axis(time_range(runs, &samples), frame.width(), false), y);
        let widest = limits.iter().map(|(limit, _)| *limit).fold(0.0, f64::max);
        if widest > 0.0 {
            panel.shade(&mut sheet, widest, range.high);
            panel.shade(&mut sheet, -widest, range.low);
        }
        panel.grid(&mut sheet);
        for (limit, _) in limits {
            panel.level(&mut sheet, *limit, LIMIT);
            panel.level(&mut sheet, -*limit, LIMIT);
        }
        for (run, samples) in runs.iter().zip(&samples) {
            panel.curve(&mut sheet, samples.iter().map(|s| (s.time_s, s.voltage_v[axis])), run.pen(CURVE_PX));
        }
        for (limit, _) in limits {
            panel.level_label(&mut sheet, *limit, &format!("saturation ±{} V", figure(*limit, 6)), LIMIT.colour);
        }
        panel.border(&mut sheet, axis == last, true);
        let name = AXIS_NAMES.get(axis).copied().unwrap_or("?").to_uppercase();
        panel.y_title(&mut sheet, gutter, &format!("{name} voltage"), "V");
        if axis == last {
            panel.x_title(&mut sheet, "time", "s");
        }
    }
    sheet
}

/// How many axes are drawn.
fn axes(runs: &[Named<'_>]) -> usize {
    if runs.iter().any(|run| run.data.facts().three_axes) { 3 } else { 2 }
}

/// Range of one axis' voltage, and its limits with whether they are in view.
fn voltage_scale(runs: &[Named<'_>], samples: &[Vec<PlotSample>], axis: usize) -> (Range, Vec<(f64, bool)>) {
    let mut range = Range::of(samples.iter().flatten().map(|sample| sample.voltage_v[axis]));
    range.include(0.0);
    let mut limits: Vec<(f64, bool)> = Vec::new();
    let peak = range.magnitude();
    for limit in runs.iter().map(|run| run.data.facts().voltage_limit_v[axis]) {
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

fn voltage_figures(run: &Named<'_>) -> String {
    if run.data.figures().samples == 0 {
        return "no samples".to_owned();
    }
    let peaks = run.data.figures().peak_voltage_v;
    let limits = run.data.facts().voltage_limit_v;
    let count = axes(std::slice::from_ref(run));
    let axes = AXIS_NAMES.iter().zip(peaks).zip(limits).take(count).map(|((name, peak), limit)| {
        let of = if limit > 0.0 && limit <= 1e100 { format!(" of {}", figure(limit, 4)) } else { String::new() };
        format!("{} {}{of} V", name.to_uppercase(), figure(peak, 4))
    });
    format!("peak {}", axes.collect::<Vec<_>>().join(", "))
}
