//! What came of a tuning, as tables for people.

use std::fmt::Write as _;

use crate::tuning::{AxisMargins, Check, Figures, Findings, Side};

use super::output::{figure, percent, printable};

/// Label, before, after, unit and remark.
struct Row {
    label: String,
    before: String,
    after: String,
    unit: &'static str,
    remark: String,
}

/// All tables, ending in a newline.
pub(crate) fn tables(findings: &Findings) -> String {
    let mut out = format!("{}: {}\n\n", printable(&findings.scenario), headline(findings));
    let head = Row {
        label: String::new(),
        before: "before".to_owned(),
        after: "after".to_owned(),
        unit: "",
        remark: String::new(),
    };
    rows(&mut out, &head, &results(findings));
    rows(&mut out, &head, &margins(findings));
    rows(&mut out, &head, &gains(findings));
    active(&mut out, findings);
    sensitivities(&mut out, findings);
    checks(&mut out, findings);
    if !findings.notes.is_empty() {
        out.push_str("\n  not seen by the search\n");
        for line in &findings.notes {
            let _ = writeln!(out, "    {line}");
        }
    }
    out
}

/// One line: what was searched, and how.
pub(crate) fn headline(findings: &Findings) -> String {
    let search = &findings.search;
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

fn results(findings: &Findings) -> Vec<Row> {
    let (before, after) = (&findings.before, &findings.after);
    let row = |label: &str, digits: usize, unit, pick: &dyn Fn(&Figures) -> f64, remark: String| {
        let value = |side: &Side| side.figures.as_ref().map_or_else(|| "-".to_owned(), |f| figure(pick(f), digits));
        Row { label: label.to_owned(), before: value(before), after: value(after), unit, remark }
    };
    let drawn = |label: &str, pick: &dyn Fn(&Side) -> f64, remark: String| Row {
        label: label.to_owned(),
        before: figure(pick(before), 5),
        after: figure(pick(after), 5),
        unit: "µm",
        remark,
    };
    let search = &findings.search;
    let box_of = if search.gain_uncertainty == search.time_constant_uncertainty {
        format!("gain and time constant ±{} %", percent(100.0 * search.gain_uncertainty))
    } else {
        format!(
            "gain ±{} %, time constant ±{} %",
            percent(100.0 * search.gain_uncertainty),
            percent(100.0 * search.time_constant_uncertainty)
        )
    };
    let trouble = |side: &Side| match (side.drawn.locked_up, side.drawn.saturated) {
        (0, 0) => String::new(),
        (0, saturated) => format!("; {saturated} of the {} saturate", side.drawn.plants),
        (locked_up, _) => format!("; {locked_up} of the {} lock up", side.drawn.plants),
    };
    vec![
        row("max contouring error", 5, "µm", &|f| f.max_contour_error_um, String::new()),
        row("rms contouring error", 5, "µm", &|f| f.rms_contour_error_um, String::new()),
        row("max tracking error", 5, "µm", &|f| f.max_tracking_error_um, String::new()),
        row("peak voltage", 4, "V", &|f| f.peak_voltage_v.iter().copied().fold(0.0, f64::max), String::new()),
        drawn(
            &format!("worst of {} plants", after.drawn.plants),
            &|side| side.drawn.worst_um,
            format!("{box_of}, seed {}{}", search.seed, trouble(after)),
        ),
        drawn("95 % of them below", &|side| side.drawn.percentile_95_um, String::new()),
    ]
}

fn margins(findings: &Findings) -> Vec<Row> {
    let search = &findings.search;
    let mut rows = Vec::new();
    let axes = || findings.before.axes.iter().zip(&findings.after.axes);
    let mut add = |label: &str, unit, pick: &dyn Fn(&AxisMargins) -> String, remark: &str| {
        for (before, after) in axes() {
            let label = format!("{label}, axis {}", after.axis);
            rows.push(Row { label, before: pick(before), after: pick(after), unit, remark: remark.to_owned() });
        }
    };
    add("Ms", "", &|axis| figure(axis.peak_sensitivity, 5), &format!("at most {}", search.max_ms));
    let least =
        search.min_delay_margin_s.map(|limit| format!("at least {}", figure(1e3 * limit, 3))).unwrap_or_default();
    add("delay margin", "ms", &|axis| figure(1e3 * axis.delay_margin_s, 4), &least);
    add("phase margin", "deg", &|axis| figure(axis.phase_margin_deg, 4), "");
    add("gain may fall to", "", &|axis| figure(axis.gain_down, 4), "times");
    add("gain may rise to", "", &|axis| figure(axis.gain_up, 4), "times");
    rows
}

fn gains(findings: &Findings) -> Vec<Row> {
    let row = |gain: &crate::tuning::GainFindings| Row {
        label: gain.name.clone(),
        before: figure(gain.before, 6),
        after: figure(gain.after, 6),
        unit: gain.unit,
        remark: format!("searched from {} to {}", figure(gain.lower, 3), figure(gain.upper, 3)),
    };
    findings.gains.iter().map(row).collect()
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
fn active(out: &mut String, findings: &Findings) {
    if findings.active.is_empty() {
        out.push_str("  no limit and no bound is in the way\n\n");
        return;
    }
    out.push_str("  what is in the way of a smaller error\n");
    for line in &findings.active {
        let _ = writeln!(out, "    {line}");
    }
    out.push('\n');
}

fn sensitivities(out: &mut String, findings: &Findings) {
    let unit = if findings.search.objective == "weighted" { "objective" } else { "error [µm]" };
    let _ = writeln!(out, "  what one percent does  {unit:>14} -1 %     +1 %        Ms -1 %     +1 %");
    for gain in &findings.gains {
        let _ = writeln!(
            out,
            "    {:<20} {:>19} {:>8}  {:>13} {:>8}",
            gain.name,
            figure(gain.objective_less, 4),
            figure(gain.objective_more, 4),
            figure(gain.ms_less, 5),
            figure(gain.ms_more, 5)
        );
    }
    out.push('\n');
}

fn checks(out: &mut String, findings: &Findings) {
    out.push_str("  checked beyond the objective\n");
    for check in &findings.checks {
        // Where the drive is at its limit no gains help: that is no merit of these.
        let saturates = check.after.is_some_and(|after| after.saturated_share > 0.0);
        let verdict = match (check.survives, saturates) {
            (true, false) => "survives",
            (true, true) => "no worse than before",
            (false, _) => "DOES NOT SURVIVE",
        };
        let _ = writeln!(out, "    {:<26} {verdict}: {}", check.name, of_check(check));
    }
}

fn of_check(check: &Check) -> String {
    let Some(after) = &check.after else { return "it could not be run".to_owned() };
    let before = check.before.as_ref().map(|f| format!(" ({} before)", figure(f.max_contour_error_um, 5)));
    let trouble = if after.locked_up {
        ", an axis locks up".to_owned()
    } else if after.saturated_share > 0.0 {
        format!(", saturated {} % of the time", percent(100.0 * after.saturated_share))
    } else {
        String::new()
    };
    format!(
        "max contouring error {} µm{}, peak voltage {} V{trouble}",
        figure(after.max_contour_error_um, 4),
        before.unwrap_or_default(),
        figure(after.peak_voltage_v.iter().copied().fold(0.0, f64::max), 4),
    )
}
