//! What each plot shows.

pub(super) mod circle;
pub(super) mod deviation;
mod feedrate;
pub(super) mod learning;
mod loads;
mod path;
pub(super) mod path_3d;
pub(super) mod response;
pub(super) mod rings;
mod search;
pub(super) mod stepover;
pub(super) mod steps;
pub(super) mod sweep;
mod time;
mod tune;

use super::axis::{Range, significant};
use super::curve::Dash;
use super::figure::{Colour, Figure, LineStyle, MUTED, RUN_COLOURS};
use super::font;
use super::subplot::{Entry, Heading, LEGEND_EM, TITLE_EM};
use super::{PlotKind, RunData};

/// Limits and bands are shown to scale up to this many times the largest value; beyond, they would flatten the curves.
const LIMIT_IN_VIEW: f64 = 3.0;

/// Style of limit lines.
const LIMIT: LineStyle = LineStyle { colour: (70, 70, 70), width_px: 1.3, dash: Some(Dash::new(7.0, 4.0)) };

pub(super) use tune::figure as convergence_figure;

/// The figure of one plot.
pub(super) fn figure(runs: &[RunData], kind: PlotKind) -> Figure {
    let runs = named(runs);
    match kind {
        PlotKind::Path => path::figure(&runs),
        PlotKind::Contour => time::contour(&runs),
        PlotKind::Feedrate => feedrate::figure(&runs),
        PlotKind::Axes => loads::figure(&runs),
        PlotKind::Voltage => time::voltage(&runs),
        PlotKind::Space => path_3d::of_runs(&runs),
        PlotKind::Search => search::figure(&runs),
    }
}

/// A run with the name and colour that it has in a plot.
struct Named<'a> {
    name: String,
    colour: Colour,
    /// From the seventh run on colours come again, with another dash.
    dash: Option<Dash>,
    data: &'a RunData,
}

impl Named<'_> {
    fn line_style(&self, width_px: f64) -> LineStyle {
        LineStyle { colour: self.colour, width_px, dash: self.dash }
    }

    /// The name, short enough that metrics find room behind it in the legend.
    fn short(&self) -> String {
        font::shortened(&self.name, LEGEND_EM, 220.0)
    }
}

/// Gives every run a colour, and a name of its own: a second "alpha" becomes "alpha (2)".
fn named(runs: &[RunData]) -> Vec<Named<'_>> {
    const DASHES: [Option<Dash>; 4] =
        [None, Some(Dash::new(9.0, 4.0)), Some(Dash::new(3.0, 3.0)), Some(Dash::new(14.0, 4.0))];
    let mut named: Vec<Named<'_>> = Vec::with_capacity(runs.len());
    for (i, data) in runs.iter().enumerate() {
        let plain = printable(&data.metadata().name);
        let plain = if plain.trim().is_empty() { "run".to_owned() } else { plain };
        let mut name = plain.clone();
        let mut number = 2;
        while named.iter().any(|other| other.name == name) {
            name = format!("{plain} ({number})");
            number += 1;
        }
        let colour = RUN_COLOURS[i % RUN_COLOURS.len()];
        let dash = DASHES[(i / RUN_COLOURS.len()) % DASHES.len()];
        named.push(Named { name, colour, dash, data });
    }
    named
}

/// Without characters that XML forbids or that have no place in a line of text.
pub(super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') { ' ' } else { c }).collect()
}

/// Title, warnings and an empty legend for a plot of `what`.
fn heading(runs: &[Named<'_>], what: &str) -> Heading {
    let title = match runs {
        [run] => format!("{}: {what}", font::shortened(&run.name, TITLE_EM, 700.0)),
        _ => format!("{} of {} runs", capital(what), runs.len()),
    };
    let mut warnings = Vec::new();
    for run in runs {
        // In front of a name the case is the name's own.
        let capital = |text: &str| if runs.len() > 1 { text.to_owned() } else { capital(text) };
        let prefix = if runs.len() > 1 { format!("{}: ", run.short()) } else { String::new() };
        if let Some(warning) = &run.data.metadata().warning {
            warnings.push(capital(&format!("{prefix}{}", printable(warning))));
        }
        match run.data.skipped() {
            0 => {}
            n => warnings.push(format!("{prefix}{n} samples not drawn: a value is not a finite number")),
        }
        if run.data.metrics().samples == 0 {
            warnings.push(capital(&format!("{prefix}no samples")));
        }
    }
    Heading { title, warnings, ..Heading::default() }
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map(|c| c.to_uppercase().chain(chars).collect()).unwrap_or_default()
}

/// `+8.3 %` between two metrics; nothing where there is no sense in it.
fn change(from: f64, to: f64) -> Option<String> {
    let percent = 100.0 * (to / from - 1.0);
    (percent.is_finite() && percent.abs() < 1e4).then(|| {
        let sign = if percent < 0.0 { "−" } else { "+" };
        format!("{sign}{:.1} %", percent.abs())
    })
}

/// The different limits with this key that the runs are held to, and for each whether it fits a plot of values up to
/// `peak`.
fn limits(runs: &[Named<'_>], key: &str, peak: f64) -> Vec<(f64, bool)> {
    let mut limits: Vec<(f64, bool)> = Vec::new();
    for limit in runs.iter().filter_map(|run| run.data.limit(key)).map(|check| check.limit) {
        if !limits.iter().any(|(other, _)| *other == limit) {
            limits.push((limit, limit <= LIMIT_IN_VIEW * peak));
        }
    }
    limits
}

/// Legend entries for limits that lie beyond the plot.
fn off_scale(limits: &[(f64, bool)], what: &str, unit: &str) -> Vec<Entry> {
    let beyond = limits.iter().filter(|(_, in_view)| !in_view);
    beyond
        .map(|(limit, _)| Entry::line(LIMIT, format!("{what} {} {unit} (off scale)", significant(*limit, 6))))
        .collect()
}

/// The span of time that the runs cover, at least one control period.
fn time_range(runs: &[Named<'_>], samples: &[Vec<super::PlotSample>]) -> Range {
    let mut range = Range::of(samples.iter().flatten().map(|sample| sample.time_s));
    if range.is_empty() {
        return range;
    }
    let period =
        runs.iter().map(|run| run.data.metadata().period_s).filter(|p| *p > 0.0 && *p <= 1e9).fold(0.0, f64::max);
    let least = if period > 0.0 { period } else { 1e-3 };
    range.high = range.high.max(range.low + least);
    range
}

/// The samples of every run.
fn samples(runs: &[Named<'_>]) -> Vec<Vec<super::PlotSample>> {
    runs.iter().map(|run| run.data.samples()).collect()
}

/// Style of a profile that a run is compared with.
fn comparison_line_style(runs: &[Named<'_>], run: &Named<'_>) -> LineStyle {
    LineStyle {
        dash: Some(Dash::new(4.0, 3.0)),
        ..LineStyle::solid(if runs.len() == 1 { MUTED } else { run.colour }, 1.3)
    }
}
