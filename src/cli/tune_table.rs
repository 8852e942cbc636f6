//! What came of a tuning, as tables for people.

use std::fmt::Write as _;

use crate::tuning::{AxisMargins, Check, GainSet, Metrics, TuningReport};

use super::output::{percent, printable, significant};

/// Label, before, after, unit and remark.
struct Row {
    label: String,
    before: String,
    after: String,
    unit: &'static str,
    remark: String,
}

/// All tables, ending in a newline.
pub(crate) fn tables(report: &TuningReport) -> String {
    let mut out = format!("{}: {}\n\n", printable(&report.scenario), headline(report));
    let head = Row {
        label: String::new(),
        before: "before".to_owned(),
        after: "after".to_owned(),
        unit: "",
        remark: String::new(),
    };
    rows(&mut out, &head, &results(report));
    rows(&mut out, &head, &margins(report));
    rows(&mut out, &head, &gains(report));
    active(&mut out, report);
    sensitivities(&mut out, report);
    checks(&mut out, report);
    if !report.notes.is_empty() {
        out.push_str("\n  not seen by the search\n");
        for line in &report.notes {
            let _ = writeln!(out, "    {line}");
        }
    }
    out
}

/// One line: what was searched, and how.
pub(crate) fn headline(report: &TuningReport) -> String {
    let search = &report.search;
    let objective = match search.objective {
        "rms" => "rms contouring error",
        "weighted" => "weighted max contouring error and peak voltage",
        _ => "max contouring error",
    };
    let worst = if search.plants > 1 {
        format!(" + {} × that of the worst of {} corner plants", search.worst_weight, search.plants - 1)
    } else {
        String::new()
    };
    let starts = if search.starts == 1 { "1 start".to_owned() } else { format!("{} starts", search.starts) };
    let ended = if search.interrupted { ", interrupted" } else { "" };
    format!("{objective}{worst}, {}, {starts}, {} evaluations{ended}", search.method, search.evaluations)
}

fn results(report: &TuningReport) -> Vec<Row> {
    let (before, after) = (&report.before, &report.after);
    let row = |label: &str, digits: usize, unit, pick: &dyn Fn(&Metrics) -> f64, remark: String| {
        let value =
            |side: &GainSet| side.metrics.as_ref().map_or_else(|| "-".to_owned(), |f| significant(pick(f), digits));
        Row { label: label.to_owned(), before: value(before), after: value(after), unit, remark }
    };
    let sampled = |label: &str, pick: &dyn Fn(&GainSet) -> f64, remark: String| Row {
        label: label.to_owned(),
        before: significant(pick(before), 5),
        after: significant(pick(after), 5),
        unit: "µm",
        remark,
    };
    let search = &report.search;
    let box_of = if search.gain_uncertainty == search.time_constant_uncertainty {
        format!("gain and time constant ±{} %", percent(100.0 * search.gain_uncertainty))
    } else {
        format!(
            "gain ±{} %, time constant ±{} %",
            percent(100.0 * search.gain_uncertainty),
            percent(100.0 * search.time_constant_uncertainty)
        )
    };
    let trouble = |side: &GainSet| match (side.sampled.locked_up, side.sampled.saturated) {
        (0, 0) => String::new(),
        (0, saturated) => format!("; {saturated} of the {} saturate", side.sampled.plants),
        (locked_up, _) => format!("; {locked_up} of the {} lock up", side.sampled.plants),
    };
    vec![
        row("max contouring error", 5, "µm", &|f| f.max_contour_error_um, String::new()),
        row("rms contouring error", 5, "µm", &|f| f.rms_contour_error_um, String::new()),
        row("max tracking error", 5, "µm", &|f| f.max_tracking_error_um, String::new()),
        row("peak voltage", 4, "V", &|f| f.peak_voltage_v.iter().copied().fold(0.0, f64::max), String::new()),
        sampled(
            &format!("worst of {} plants", after.sampled.plants),
            &|side| side.sampled.worst_um,
            format!("{box_of}, seed {}{}", search.seed, trouble(after)),
        ),
        sampled("95 % of them below", &|side| side.sampled.percentile_95_um, String::new()),
    ]
}

fn margins(report: &TuningReport) -> Vec<Row> {
    let search = &report.search;
    let mut rows = Vec::new();
    let axes = || report.before.axes.iter().zip(&report.after.axes);
    let mut add = |label: &str, unit, pick: &dyn Fn(&AxisMargins) -> String, remark: &str| {
        for (before, after) in axes() {
            let label = format!("{label}, axis {}", after.axis);
            rows.push(Row { label, before: pick(before), after: pick(after), unit, remark: remark.to_owned() });
        }
    };
    add("Ms", "", &|axis| significant(axis.peak_sensitivity, 5), &format!("at most {}", search.max_ms));
    let least =
        search.min_delay_margin_s.map(|limit| format!("at least {}", significant(1e3 * limit, 3))).unwrap_or_default();
    add("delay margin", "ms", &|axis| significant(1e3 * axis.delay_margin_s, 4), &least);
    add("phase margin", "deg", &|axis| significant(axis.phase_margin_deg, 4), "");
    add("gain may fall to", "", &|axis| significant(axis.gain_down, 4), "times");
    add("gain may rise to", "", &|axis| significant(axis.gain_up, 4), "times");
    rows
}

fn gains(report: &TuningReport) -> Vec<Row> {
    let row = |gain: &crate::tuning::GainSensitivity| Row {
        label: gain.name.clone(),
        before: significant(gain.before, 6),
        after: significant(gain.after, 6),
        unit: gain.unit,
        remark: format!("searched from {} to {}", significant(gain.lower, 3), significant(gain.upper, 3)),
    };
    report.gains.iter().map(row).collect()
}

/// Rows with two columns of values, aligned at their decimal points.
fn rows(out: &mut String, head: &Row, rows: &[Row]) {
    let label = rows.iter().map(|row| row.label.chars().count()).max().unwrap_or(0).max(20);
    let (before, after) = (Column::of(rows.iter().map(|r| &*r.before)), Column::of(rows.iter().map(|r| &*r.after)));
    for row in std::iter::once(head).chain(rows) {
        let (old, new) = if row.label.is_empty() {
            (before.title(&row.before), after.title(&row.after))
        } else {
            (before.aligned(&row.before), after.aligned(&row.after))
        };
        let line = format!("  {:<label$}  {old}  {new} {:<9} {}", row.label, row.unit, row.remark);
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out.push('\n');
}

/// How wide a column of numbers is before and behind the point.
struct Column {
    before: usize,
    behind: usize,
}

impl Column {
    fn point(value: &str) -> usize {
        value.find('.').unwrap_or(value.len())
    }

    fn of<'a>(values: impl Iterator<Item = &'a str> + Clone) -> Self {
        let before = values.clone().map(Self::point).max().unwrap_or(0);
        let behind = values.map(|value| value.len() - Self::point(value)).max().unwrap_or(0);
        // Room for the title.
        Self { before: before.max(8usize.saturating_sub(behind)), behind }
    }

    fn aligned(&self, value: &str) -> String {
        let point = Self::point(value);
        let (left, right) = (self.before - point, self.behind - (value.len() - point));
        format!("{:left$}{value}{:right$}", "", "")
    }

    fn title(&self, title: &str) -> String {
        format!("{title:>width$}", width = self.before + self.behind)
    }
}

// Writing to a string does not fail.
fn active(out: &mut String, report: &TuningReport) {
    if report.active.is_empty() {
        out.push_str("  no constraint and no bound is active\n\n");
        return;
    }
    out.push_str("  active constraints and bounds\n");
    for line in &report.active {
        let _ = writeln!(out, "    {line}");
    }
    out.push('\n');
}

fn sensitivities(out: &mut String, report: &TuningReport) {
    let unit = if report.search.objective == "weighted" { "objective" } else { "error [µm]" };
    let _ = writeln!(out, "  effect of one percent  {unit:>14} -1 %     +1 %        Ms -1 %     +1 %");
    for gain in &report.gains {
        let _ = writeln!(
            out,
            "    {:<20} {:>19} {:>8}  {:>13} {:>8}",
            gain.name,
            significant(gain.objective_less, 4),
            significant(gain.objective_more, 4),
            significant(gain.ms_less, 5),
            significant(gain.ms_more, 5)
        );
    }
    out.push('\n');
}

fn checks(out: &mut String, report: &TuningReport) {
    out.push_str("  further checks\n");
    for check in &report.checks {
        // Where the drive is at its limit no gains help: that is no merit of these.
        let saturates = check.after.is_some_and(|after| after.saturated_share > 0.0);
        let verdict = match (check.survives, saturates) {
            (true, false) => "passes",
            (true, true) => "no worse than before",
            (false, _) => "FAILS",
        };
        let _ = writeln!(out, "    {:<26} {verdict}: {}", check.name, of_check(check));
    }
}

fn of_check(check: &Check) -> String {
    let Some(after) = &check.after else { return "not run".to_owned() };
    let before = check.before.as_ref().map(|f| format!(" ({} before)", significant(f.max_contour_error_um, 5)));
    let trouble = if after.locked_up {
        ", an axis locks up".to_owned()
    } else if after.saturated_share > 0.0 {
        format!(", saturated {} % of the time", percent(100.0 * after.saturated_share))
    } else {
        String::new()
    };
    format!(
        "max contouring error {} µm{}, peak voltage {} V{trouble}",
        significant(after.max_contour_error_um, 4),
        before.unwrap_or_default(),
        significant(after.peak_voltage_v.iter().copied().fold(0.0, f64::max), 4),
    )
}
