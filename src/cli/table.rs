//! The figures of a run as a table for people.

use std::fmt::Write as _;

use servosim::summary::Summary;

use super::output::{figure, margin, percent, printable, short};

/// The table, ending in a newline.
pub(crate) fn table(summary: &Summary) -> String {
    let mut out = format!("{}\n\n", printable(&summary.scenario));
    let ended = if summary.complete { "" } else { " (interrupted)" };
    let n_c = summary.n_c.map(|n_c| short(n_c, 5));
    let searched =
        summary.n_c_search.as_ref().map(|steps| format!(", found in {} iterations", steps.len().saturating_sub(1)));
    section(
        &mut out,
        &[
            ("path length", figure(summary.path_length_mm, 8), "mm", String::new()),
            ("largest curvature", figure(summary.max_curvature_1_mm, 6), "1/mm", String::new()),
            ("motion time", figure(summary.motion_time_s, 7), "s", String::new()),
            (
                "samples",
                summary.samples.to_string(),
                "",
                format!("every {} ms{ended}", short(1e3 * summary.period_s, 6)),
            ),
            ("feed reached", figure(summary.feed_mm_s, 6), "mm/s", String::new()),
            ("peak acceleration", figure(summary.peak_accel_mm_s2, 5), "mm/s²", String::new()),
            (
                "peak jerk",
                figure(summary.peak_jerk_mm_s3, 5),
                "mm/s³",
                n_c.map_or(String::new(), |n_c| format!("n_c = {n_c}{}", searched.unwrap_or_default())),
            ),
        ],
    );
    let at = format!(
        "at {} s, {} mm along the path",
        figure(summary.max_contour_error_at_s, 4),
        figure(summary.max_contour_error_at_mm, 5)
    );
    let axes = |pick: fn(&servosim::summary::AxisSummary) -> String| {
        let each: Vec<String> = summary.axes.iter().map(|axis| format!("{} {}", axis.axis, pick(axis))).collect();
        each.join(", ")
    };
    section(
        &mut out,
        &[
            ("max contouring error", figure(summary.max_contour_error_um, 5), "µm", at),
            ("rms contouring error", figure(summary.rms_contour_error_um, 5), "µm", String::new()),
            (
                "max tracking error",
                figure(summary.max_tracking_error_um, 5),
                "µm",
                axes(|a| figure(a.max_tracking_error_um, 5)),
            ),
            (
                "rms tracking error",
                figure(summary.rms_tracking_error_um, 5),
                "µm",
                axes(|a| figure(a.rms_tracking_error_um, 5)),
            ),
            ("peak voltage", figure(summary.peak_voltage_v, 4), "V", axes(|a| figure(a.peak_voltage_v, 4))),
            ("rms voltage", figure(summary.rms_voltage_v, 4), "V", axes(|a| figure(a.rms_voltage_v, 4))),
            ("saturated", percent(100.0 * summary.saturated_share), "%", axes(|a| percent(100.0 * a.saturated_share))),
        ],
    );
    limits(&mut out, summary);
    if let Some(lockup) = &summary.lockup {
        // Writing to a string does not fail.
        let _ = writeln!(out, "\nLOCKED UP: {lockup}");
    }
    out
}

/// Rows of label, value, unit and remark, the values aligned at their decimal points.
fn section(out: &mut String, rows: &[(&str, String, &str, String)]) {
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

fn limits(out: &mut String, summary: &Summary) {
    if summary.limits.is_empty() {
        out.push_str("  no limits in the scenario\n");
        return;
    }
    for check in &summary.limits {
        let kept = if check.kept { "kept  " } else { "BROKEN" };
        // Writing to a string does not fail.
        let _ = writeln!(
            out,
            "  limit {:<18} {kept}  {} of {}, {}",
            check.name,
            figure(check.value, 5),
            short(check.limit, 5),
            margin(check.value, check.limit)
        );
    }
}
