//! The metrics of a part as a table for people.

use crate::machining::PartMetrics;
use crate::scenario::ToolPathSummary;

use super::output::{percent, printable, short, significant};
use super::table::{Row, limit_lines, section};

/// The table of a tool path, ending in a newline.
pub(crate) fn tool_path(summary: &ToolPathSummary) -> String {
    let mut out = format!("{}\n\n", printable(&summary.part));
    section(&mut out, &path(summary));
    section(&mut out, &program(summary));
    section(&mut out, &part("nominal", &summary.nominal));
    limit_lines(&mut out, &summary.limits, "no limits for the part");
    out
}

fn path(summary: &ToolPathSummary) -> Vec<Row> {
    let row = |label, value, digits, unit, remark: String| (label, significant(value, digits), unit, remark);
    let [least, largest] = summary.step_over_mm;
    let steps = if summary.rings > 1 {
        format!("{} to {} mm apart in plan", significant(least, 4), significant(largest, 4))
    } else {
        String::new()
    };
    let jump = if summary.tangent_jump_rad > 0.0 {
        format!("tangents of neighbouring curves differ by up to {} rad", significant(summary.tangent_jump_rad, 2))
    } else {
        String::new()
    };
    vec![
        ("rings", summary.rings.to_string(), "", steps),
        row("length of the cut", summary.feed_length_mm, 6, "mm", jump),
        ("rapid moves", summary.air_moves.to_string(), "", String::new()),
        row("rapid length", summary.rapid_length_mm, 5, "mm", String::new()),
        row("path tolerance", summary.path_tolerance_mm, 3, "mm", "at most a quarter of the scallop height".to_owned()),
        row("fit error", summary.fit_error_mm, 3, "mm", String::new()),
        row("estimated time", summary.estimated_time_s, 5, "s", "length over feed".to_owned()),
        row("motion time", summary.motion_time_s, 5, "s", "on the machine: acceleration, jerk, corners".to_owned()),
    ]
}

fn program(summary: &ToolPathSummary) -> Vec<Row> {
    let times = summary.straight_lines as f64 / summary.lines.max(1) as f64;
    let compared = if summary.curves > 0 {
        format!("{} in straight blocks: {} times as many", summary.straight_lines, significant(times, 3))
    } else {
        String::new()
    };
    vec![
        ("program lines", summary.lines.to_string(), "", compared),
        ("NURBS curves", summary.curves.to_string(), "", format!("{} control points", summary.control_points)),
        ("straight blocks", summary.straight_blocks.to_string(), "", String::new()),
        ("rapid blocks", summary.rapid_blocks.to_string(), "", String::new()),
        ("rounding", significant(1e3 * summary.rounding_mm, 3), "µm", format!("at most, in {}", summary.dialect)),
    ]
}

/// Rows of a machined part.
pub(crate) fn part(title: &str, metrics: &PartMetrics) -> Vec<Row> {
    let at = |place: Option<[f64; 2]>| place.map_or_else(String::new, |[x, y]| format!("at x {x:.1}, y {y:.1} mm"));
    let uncut = if metrics.uncut_cells > 0 { format!(", {} not cut", metrics.uncut_cells) } else { String::new() };
    vec![
        ("part", title.to_owned(), "", format!("{} cells of {} mm{uncut}", metrics.cells, short(metrics.cell_mm, 3))),
        ("largest scallop", significant(metrics.largest_scallop_um, 4), "µm", at(metrics.largest_scallop_at_mm)),
        ("deepest gouge", significant(metrics.deepest_gouge_um, 4), "µm", at(metrics.deepest_gouge_at_mm)),
        (
            "within tolerance",
            percent(100.0 * metrics.within_share),
            "%",
            format!("rms {} µm", significant(metrics.rms_um, 4)),
        ),
    ]
}
