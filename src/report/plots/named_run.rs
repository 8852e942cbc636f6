//! Runs with the names and colours that they have in a plot, and what plots of runs share.

use super::super::axis::{Range, significant};
use super::super::curve::Dash;
use super::super::data::{PlotSample, RunData};
use super::super::font;
use super::super::style::{Colour, LineStyle, MUTED, RUN_COLOURS};
use super::super::subplot::{Entry, Heading, LEGEND_EM, TITLE_EM};
use super::words::{capital, printable};

/// Limits and bands are shown to scale up to this many times the largest value; beyond, they would flatten the curves.
pub(in super::super) const LIMIT_IN_VIEW: f64 = 3.0;

/// A locked-up run up to this many times as large as the runs that hold is shown to scale beside them.
const LOCKED_SHARE: f64 = 2.0;

/// Style of limit lines.
pub(in super::super) const LIMIT: LineStyle =
    LineStyle { colour: (70, 70, 70), width_px: 1.3, dash: Some(Dash::new(7.0, 4.0)) };

/// A run with the name and colour that it has in a plot.
pub(in super::super) struct Named<'a> {
    pub(in super::super) name: String,
    pub(in super::super) colour: Colour,
    /// From the seventh run on colours come again, with another dash.
    pub(in super::super) dash: Option<Dash>,
    pub(in super::super) data: &'a RunData,
}

impl Named<'_> {
    pub(in super::super) fn line_style(&self, width_px: f64) -> LineStyle {
        LineStyle { colour: self.colour, width_px, dash: self.dash }
    }

    /// The name, short enough that metrics find room behind it in the legend.
    pub(in super::super) fn short(&self) -> String {
        font::shortened(&self.name, LEGEND_EM, 220.0)
    }
}

/// Gives every run a colour, and a name of its own: a second "alpha" becomes "alpha (2)".
pub(in super::super) fn named(runs: &[RunData]) -> Vec<Named<'_>> {
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

/// Title, warnings and an empty legend for a plot of `what`.
pub(in super::super) fn heading(runs: &[Named<'_>], what: &str) -> Heading {
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

/// The different limits with this key that the runs are held to, and for each whether it fits a plot of values up to
/// `peak`.
pub(in super::super) fn limits(runs: &[Named<'_>], key: &str, peak: f64) -> Vec<(f64, bool)> {
    let mut limits: Vec<(f64, bool)> = Vec::new();
    for limit in runs.iter().filter_map(|run| run.data.limit(key)).map(|check| check.limit) {
        if !limits.iter().any(|(other, _)| *other == limit) {
            limits.push((limit, limit <= LIMIT_IN_VIEW * peak));
        }
    }
    limits
}

/// Legend entries for limits that lie beyond the plot.
pub(in super::super) fn off_scale(limits: &[(f64, bool)], what: &str, unit: &str) -> Vec<Entry> {
    let beyond = limits.iter().filter(|(_, in_view)| !in_view);
    beyond
        .map(|(limit, _)| Entry::line(LIMIT, format!("{what} {} {unit} (off scale)", significant(*limit, 6))))
        .collect()
}

/// The span of time that the runs cover, at least one control period.
pub(in super::super) fn time_range(runs: &[Named<'_>], samples: &[Vec<PlotSample>]) -> Range {
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
pub(in super::super) fn samples(runs: &[Named<'_>]) -> Vec<Vec<PlotSample>> {
    runs.iter().map(|run| run.data.samples()).collect()
}

/// Style of a profile that a run is compared with.
pub(in super::super) fn comparison_line_style(runs: &[Named<'_>], run: &Named<'_>) -> LineStyle {
    LineStyle {
        dash: Some(Dash::new(4.0, 3.0)),
        ..LineStyle::solid(if runs.len() == 1 { MUTED } else { run.colour }, 1.3)
    }
}

/// Whether each run takes part in setting the scale: a run that locked up does not where it would be more than [`LOCKED_SHARE`] times as
/// large as those that hold.
pub(in super::super) fn in_scale(runs: &[Named<'_>], size: impl Fn(&Named<'_>) -> f64) -> Vec<bool> {
    let is_locked = |run: &Named<'_>| run.data.metadata().locked_up;
    let held = runs.iter().filter(|run| !is_locked(run)).map(&size).fold(0.0, f64::max);
    runs.iter().map(|run| !is_locked(run) || held == 0.0 || size(run) <= LOCKED_SHARE * held).collect()
}

/// What the legend says of a run that does not take part.
pub(in super::super) fn off_scale_text(in_scale: bool) -> &'static str {
    if in_scale { "" } else { "; locked up, off scale" }
}
