//! Feed, acceleration and jerk over time, beside another profile.

use super::super::axis::{Range, significant};
use super::super::curve::Frame;
use super::super::data::PlotSample;
use super::super::figure::Figure;
use super::super::marks::{Anchor, TextFormat};
use super::super::style::{CURVE_PX, MUTED};
use super::super::subplot::{Entry, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use super::named_run::{LIMIT, Named, comparison_line_style, heading, limits, off_scale, samples, time_range};
use super::words::{change, printable};
use crate::feedrate::{Motion, MotionSample};

const GAP: f64 = 14.0;
/// Where the acceleration takes less than this share of the run it is drawn again, large, in a column of its own.
const SHORT_PHASE: f64 = 0.25;
/// Points of each phase of the other profile.
const PHASE_POINTS: u32 = 400;

/// One of the three quantities.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    limit: Option<&'static str>,
    of_sample: fn(&PlotSample) -> f64,
    of_motion: fn(&MotionSample) -> f64,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity { name: "feed", unit: "mm/s", limit: None, of_sample: |s| s.feed_mm_s, of_motion: |m| m.feed_mm_s },
    Quantity {
        name: "acceleration",
        unit: "mm/s²",
        limit: Some("accel_mm_s2"),
        of_sample: |s| s.accel_mm_s2,
        of_motion: |m| m.accel_mm_s2,
    },
    Quantity {
        name: "jerk",
        unit: "mm/s³",
        limit: Some("jerk_mm_s3"),
        of_sample: |s| s.jerk_mm_s3,
        of_motion: |m| m.jerk_mm_s3,
    },
];

/// Time and motion of a profile that runs are compared with.
type Profile = Vec<(f64, MotionSample)>;

pub(in super::super) fn figure(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let samples = samples(runs);
    let time = time_range(runs, &samples);
    let compared = comparisons(runs);

    let mut head = heading(runs, "feed, acceleration and jerk along the path");
    if let [run] = runs {
        head.subtitle = metrics(run);
    }
    for run in runs {
        let text =
            if runs.len() == 1 { run.name.clone() } else { format!("{} ({})", run.short(), peak_jerk_text(run)) };
        head.legend.push(Entry::line(run.line_style(CURVE_PX), text));
        if let Some((_, name, _)) = compared.iter().find(|(of, _, _)| of.name == run.name) {
            head.legend.push(Entry::line(comparison_line_style(runs, run), name.as_str()));
        }
    }
    let scales = QUANTITIES.each_ref().map(|quantity| scale(runs, &samples, &compared, quantity));
    for (quantity, (_, limits)) in QUANTITIES.iter().zip(&scales) {
        head.legend.extend(off_scale(limits, &format!("{} limit", quantity.name), quantity.unit));
    }
    let mut space = head.draw(&mut figure);
    let phase_end = short_phase_end(runs, &samples, &time);
    if phase_end.is_some() {
        space.top += 18.0;
    }

    let height = subplot_height(&space, 3, GAP);
    let y = scales.each_ref().map(|(range, _)| y_axis(*range, height, false));
    let y_axes = [&y[0], &y[1], &y[2]];
    let gutter = gutter(&y_axes);
    let frames = stack(&space, &y_axes, GAP);
    for (row, frame) in frames.into_iter().enumerate() {
        let (Some(quantity), Some(y), Some((_, limits))) = (QUANTITIES.get(row), y.get(row), scales.get(row)) else {
            break;
        };
        let (wide, narrow) = columns(frame, phase_end.is_some());
        let columns = [Some((wide, time)), narrow.zip(phase_end.map(|high| Range { low: time.low, high }))];
        for (column, (frame, time)) in columns.into_iter().flatten().enumerate() {
            let mut subplot = Subplot::new(frame, x_axis(time, frame.width(), false), y.clone());
            subplot.grid(&mut figure);
            for (limit, _) in limits {
                subplot.level(&mut figure, *limit, LIMIT);
                subplot.level(&mut figure, -*limit, LIMIT);
            }
            for (run, _, profile) in &compared {
                let values = profile.iter().map(|(t, m)| (*t, (quantity.of_motion)(m)));
                subplot.curve(&mut figure, values, comparison_line_style(runs, run));
            }
            let curves = runs.iter().zip(&samples).map(|(run, samples)| {
                let values = samples.iter().map(|s| (s.time_s, (quantity.of_sample)(s)));
                (values, run.line_style(CURVE_PX))
            });
            subplot.time_curves(&mut figure, curves);
            for (limit, _) in limits.iter().filter(|_| column == 0) {
                let text = format!("limit ±{} {}", significant(*limit, 6), quantity.unit);
                subplot.level_label(&mut figure, *limit, &text, LIMIT.colour);
            }
            subplot.border(&mut figure, row == 2, column == 0);
            if column == 0 {
                subplot.y_title(&mut figure, gutter, quantity.name, quantity.unit);
            }
            if row == 2 {
                subplot.x_title(&mut figure, "time", "s");
            }
            if row == 0 && phase_end.is_some() {
                let text = if column == 0 { "whole run" } else { "acceleration phase" };
                let at = (frame.left, frame.top - 12.0);
                figure.text(TextFormat::new(at, text, 13.0, Anchor::Left).coloured(MUTED));
            }
        }
    }
    figure
}

/// Range of a quantity over all runs, and its limits with whether they are in view.
fn scale(
    runs: &[Named<'_>],
    samples: &[Vec<PlotSample>],
    compared: &[(&Named<'_>, String, Profile)],
    quantity: &Quantity,
) -> (Range, Vec<(f64, bool)>) {
    let mut range = Range::of(samples.iter().flatten().map(quantity.of_sample));
    for (_, m) in compared.iter().flat_map(|(_, _, profile)| profile) {
        range.include((quantity.of_motion)(m));
    }
    range.include(0.0);
    let limits = quantity.limit.map(|key| limits(runs, key, range.magnitude())).unwrap_or_default();
    for (limit, _) in limits.iter().filter(|(_, in_view)| *in_view) {
        range.include(*limit);
        range.include(-*limit);
    }
    let below = if range.low < 0.0 { 0.1 } else { 0.04 };
    (range.opened(1e-6).padded(below, 0.12), limits)
}

/// The profiles to compare with, each different one once.
fn comparisons<'a, 'b>(runs: &'a [Named<'b>]) -> Vec<(&'a Named<'b>, String, Profile)> {
    let mut seen: Vec<&Motion> = Vec::new();
    let mut compared = Vec::new();
    for run in runs {
        let Some((name, motion)) = &run.data.metadata().comparison else { continue };
        if !seen.contains(&motion) {
            seen.push(motion);
            compared.push((run, printable(name), profile(motion)));
        }
    }
    compared
}

/// A motion as a curve: its phases densely, their ends from both sides, for there the acceleration may jump.
fn profile(motion: &Motion) -> Profile {
    let (phase, cruise_end, end) = (motion.phase_s(), motion.phase_s() + motion.cruise_s(), motion.total_s());
    let mut times = vec![-f64::MIN_POSITIVE];
    let mut dense = |from: f64, to: f64, points: u32| {
        for i in 0..=points {
            let t = from + (to - from) * f64::from(i) / f64::from(points);
            times.push(if i == points { to.next_down() } else { t });
        }
    };
    dense(0.0, phase, PHASE_POINTS);
    dense(phase, cruise_end, 2);
    dense(cruise_end.next_up(), end, PHASE_POINTS);
    times.push(end);
    times.iter().map(|&t| (t.max(0.0), motion.at(t))).filter(|(_, m)| is_drawable(m)).collect()
}

fn is_drawable(m: &MotionSample) -> bool {
    [m.feed_mm_s, m.accel_mm_s2, m.jerk_mm_s3].iter().all(|value| value.abs() <= 1e100)
}

/// Where the column of the acceleration phase ends, if the phase is short beside the run but not a few samples only.
fn short_phase_end(runs: &[Named<'_>], samples: &[Vec<PlotSample>], time: &Range) -> Option<f64> {
    let mut end = f64::NEG_INFINITY;
    let period = runs.iter().map(|run| run.data.metadata().period_s).fold(0.0, f64::max);
    for samples in samples {
        let peak = samples.iter().map(|s| s.feed_mm_s.abs()).fold(0.0, f64::max);
        let reached = samples.iter().find(|s| s.feed_mm_s.abs() >= 0.9999 * peak && peak > 0.0)?;
        end = end.max(time.low + 1.2 * (reached.time_s - time.low));
    }
    (end - time.low > 10.0 * period && end - time.low < SHORT_PHASE * time.span()).then_some(end)
}

/// The frame of a row, divided where the acceleration phase has a column of its own.
fn columns(frame: Frame, divided: bool) -> (Frame, Option<Frame>) {
    if !divided {
        return (frame, None);
    }
    let cut = frame.left + 0.62 * frame.width();
    (Frame { right: cut - 22.0, ..frame }, Some(Frame { left: cut + 22.0, ..frame }))
}

/// The largest jerk of a run, infinite where the acceleration steps; that of the samples if nothing better is known.
fn peak_jerk(run: &Named<'_>) -> f64 {
    let checked = || run.data.limit("jerk_mm_s3").map(|check| check.value);
    run.data.metadata().peak_jerk_mm_s3.or_else(checked).unwrap_or(run.data.metrics().peak_jerk_mm_s3)
}

fn peak_jerk_text(run: &Named<'_>) -> String {
    format!("peak jerk {} mm/s³", significant(peak_jerk(run), 5))
}

fn metrics(run: &Named<'_>) -> String {
    let metrics = run.data.metrics();
    let mut text = format!(
        "Peak feed {} mm/s, acceleration {} mm/s², jerk {} mm/s³",
        significant(metrics.peak_feed_mm_s, 5),
        significant(metrics.peak_accel_mm_s2, 5),
        significant(peak_jerk(run), 5)
    );
    if let Some((name, motion)) = &run.data.metadata().comparison {
        let other = motion.peaks().jerk_mm_s3;
        let change = change(other, peak_jerk(run)).map(|change| format!("{change} against ")).unwrap_or_default();
        text = format!("{text} ({change}{}: {})", printable(name), significant(other, 5));
    }
    match run.data.metadata().n_c {
        Some(n_c) => format!("{text}, n_c = {}", significant(n_c, 5)),
        None => text,
    }
}
