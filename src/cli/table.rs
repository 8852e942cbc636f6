//! The metrics of a run as a table for people.

use std::fmt::Write as _;

use crate::limits::LimitCheck;
use crate::summary::{AxisSummary, OverrideSummary, Summary, VectorPeak};

use super::output::{margin, percent, printable, short, significant};

/// Label, value, unit and remark.
pub(crate) type Row = (&'static str, String, &'static str, String);

/// How many changes of the feed override are told one by one.
const LISTED_OVERRIDES: usize = 10;

/// The table, ending in a newline.
pub(crate) fn table(summary: &Summary) -> String {
    let mut out = format!("{}\n\n", printable(&summary.scenario));
    metrics(&mut out, summary);
    limit_lines(&mut out, &summary.limits, "no limits in the scenario");
    lockup(&mut out, summary);
    out
}

/// What was asked for and what came of it.
pub(crate) fn metrics(out: &mut String, summary: &Summary) {
    section(out, &plan(summary));
    section(out, &errors(summary));
}

/// A line on a lock-up, if there was one.
pub(crate) fn lockup(out: &mut String, summary: &Summary) {
    if let Some(lockup) = &summary.lockup {
        // Writing to a string does not fail.
        let _ = writeln!(out, "\n  {}", lockup.replacen("locked up", "LOCKED UP", 1));
    }
}

/// One line for every limit that was broken and for a lock-up, where there is no table to tell.
pub(crate) fn failures(summary: &Summary) -> String {
    broken(&summary.limits).into_iter().chain(summary.lockup.clone()).collect::<Vec<_>>().join("\n")
}

/// One line for every limit that was broken.
pub(crate) fn broken(limits: &[LimitCheck]) -> Vec<String> {
    let broken = limits.iter().filter(|check| !check.kept).map(|check| {
        format!(
            "limit {} broken: {} of {}, {}",
            check.name,
            significant(check.value, 5),
            short(check.limit, 5),
            margin(check.value, check.limit)
        )
    });
    broken.collect()
}

/// What was asked for.
fn plan(summary: &Summary) -> Vec<Row> {
    let row = |label, value, digits, unit| (label, significant(value, digits), unit, String::new());
    let ended = if summary.complete { "" } else { ", interrupted" };
    let every = format!("every {} ms{ended}", short(1e3 * summary.period_s, 6));
    let searched = summary.n_c_search.as_ref().map(|steps| steps.len().saturating_sub(1));
    let exponent = match (summary.n_c, searched) {
        (Some(n_c), Some(iterations)) => format!("n_c = {}, found in {iterations} iterations", short(n_c, 5)),
        (Some(n_c), None) => format!("n_c = {}", short(n_c, 5)),
        (None, _) => String::new(),
    };
    let vector = |label, vector: &VectorPeak, unit, pick: &dyn Fn(&AxisSummary) -> f64| {
        let axes: Vec<_> =
            summary.axes.iter().map(|axis| format!("{} {}", axis.axis, significant(pick(axis), 5))).collect();
        let at = format!("at {} mm", significant(vector.at_mm, 5));
        (label, significant(vector.peak, 5), unit, format!("{}, {at}", axes.join(", ")))
    };
    let mut rows = vec![
        row("path length", summary.path_length_mm, 8, "mm"),
        row("largest curvature", summary.max_curvature_1_mm, 6, "1/mm"),
        row("motion time", summary.motion_time_s, 7, "s"),
        ("samples", summary.samples.to_string(), "", every),
        row("feed reached", summary.feed_mm_s, 6, "mm/s"),
        row("peak acceleration", summary.peak_accel_mm_s2, 5, "mm/s²"),
        ("peak jerk", significant(summary.peak_jerk_mm_s3, 5), "mm/s³", exponent),
        vector("vector acceleration", &summary.vector_accel_mm_s2, "mm/s²", &|axis| axis.peak_accel_mm_s2),
        vector("vector jerk", &summary.vector_jerk_mm_s3, "mm/s³", &|axis| axis.peak_jerk_mm_s3),
    ];
    for change in summary.overrides.iter().take(LISTED_OVERRIDES) {
        let label = if change.percent > 0.0 { "feed override" } else { "feed hold" };
        rows.push((label, short(change.percent, 4), "%", what_came_of(change)));
    }
    let more = summary.overrides.len().saturating_sub(LISTED_OVERRIDES);
    if more > 0 {
        rows.push(("further changes", more.to_string(), "", "of the feed override".to_owned()));
    }
    rows
}

/// When a change of the override came, and how far.
fn what_came_of(change: &OverrideSummary) -> String {
    let at = short(change.at_s, 6);
    if change.after_the_end {
        return format!("at {at} s: after the end of the motion, no effect");
    }
    let within = short(change.transition_s, 4);
    let asked = change.asked_transition_s.filter(|asked| change.transition_s > 1.001 * asked);
    match (change.reached_percent, asked) {
        (Some(reached), _) => format!("from {at} s on, cut off at {} % after {within} s", short(reached, 4)),
        (None, Some(asked)) => {
            format!("from {at} s on, within {within} s: the limits need longer than {} s", short(asked, 4))
        }
        (None, None) => format!("from {at} s on, within {within} s"),
    }
}

/// What came of it.
fn errors(summary: &Summary) -> Vec<Row> {
    let axes = |pick: &dyn Fn(&AxisSummary) -> String| {
        summary.axes.iter().map(|axis| format!("{} {}", axis.axis, pick(axis))).collect::<Vec<_>>().join(", ")
    };
    let row = |label, value, digits, unit, pick: fn(&AxisSummary) -> f64| {
        (label, significant(value, digits), unit, axes(&|axis| significant(pick(axis), digits)))
    };
    let at = format!(
        "at {} s, {} mm along the path",
        significant(summary.max_contour_error_at_s, 4),
        significant(summary.max_contour_error_at_mm, 5)
    );
    vec![
        ("max contouring error", significant(summary.max_contour_error_um, 5), "µm", at),
        ("rms contouring error", significant(summary.rms_contour_error_um, 5), "µm", String::new()),
        row("max tracking error", summary.max_tracking_error_um, 5, "µm", |a| a.max_tracking_error_um),
        row("rms tracking error", summary.rms_tracking_error_um, 5, "µm", |a| a.rms_tracking_error_um),
        row("peak voltage", summary.peak_voltage_v, 4, "V", |a| a.peak_voltage_v),
        row("rms voltage", summary.rms_voltage_v, 4, "V", |a| a.rms_voltage_v),
        (
            "saturated",
            percent(100.0 * summary.saturated_share),
            "%",
            axes(&|axis| percent(100.0 * axis.saturated_share)),
        ),
    ]
}

/// Rows of label, value, unit and remark, the values aligned at their decimal points.
pub(crate) fn section(out: &mut String, rows: &[Row]) {
    let point = |value: &str| value.find('.').unwrap_or(value.len());
    let before = rows.iter().map(|(_, value, ..)| point(value)).max().unwrap_or(0);
    let behind = rows.iter().map(|(_, value, ..)| value.len() - point(value)).max().unwrap_or(0);
    for (label, value, unit, remark) in rows {
        let (left, right) = (before - point(value), behind - (value.len() - point(value)));
        let row = format!("  {label:<20}  {:left$}{value}{:right$} {unit:<6} {remark}", "", "");
        out.push_str(row.trim_end());
        out.push('\n');
    }
    out.push('\n');
}

/// One line for every limit.
pub(crate) fn limit_lines(out: &mut String, limits: &[LimitCheck], none: &str) {
    if limits.is_empty() {
        // Writing to a string does not fail.
        let _ = writeln!(out, "  {none}");
    }
    for check in limits {
        let kept = if check.kept { "kept  " } else { "BROKEN" };
        let _ = writeln!(
            out,
            "  limit {:<18} {kept}  {} of {}, {}",
            check.name,
            significant(check.value, 5),
            short(check.limit, 5),
            margin(check.value, check.limit)
        );
    }
}
