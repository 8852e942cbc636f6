//! `servosim analyze`: margins, poles, bandwidth and step response of the servo loops, without a run.

use std::fmt::Write as _;

use clap::Args;
use serde::Serialize;
use servosim::analysis::{LoopFigures, Pole};
use servosim::limits::AXIS_NAMES;
use servosim::report;
use servosim::scenario::{Document, Scenario};
use servosim::servo::Derivative;

use super::output::{OutputArgs, figure, make_folder, note, printable, short};
use super::{CliError, Outcome, plot};

/// Arguments of `servosim analyze`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim analyze alpha.toml
  servosim analyze alpha.toml --set axes.x.pdff.kpv=2 --set control.delay_samples=1
  servosim analyze heart --format json --plots none

The loops are linear: no saturation. SCENARIO is looked for as `servosim run` does.
Exits with 3 if a loop is unstable.")]
pub(crate) struct AnalyzeArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    out: OutputArgs,
}

/// What `--format json` prints.
#[derive(Debug, Serialize)]
struct Analysis<'a> {
    scenario: &'a str,
    period_s: f64,
    delay_samples: u8,
    derivative: &'static str,
    axes: Vec<LoopFigures>,
}

/// Analyses the loops of the scenario.
pub(crate) fn run(args: &AnalyzeArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let settings = &scenario.settings;
    let axes = AXIS_NAMES.iter().zip(&scenario.axes).map(|(name, axis)| LoopFigures::new(name, axis, settings));
    let analysis = Analysis {
        scenario: &scenario.name,
        period_s: settings.period_s,
        delay_samples: u8::from(settings.one_sample_delay),
        derivative: match settings.derivative {
            Derivative::Backward => "backward",
            Derivative::Exact => "exact",
        },
        axes: axes.collect(),
    };
    args.out.print.show(&analysis, || table(&analysis, &scenario))?;
    // The figures are there whatever becomes of the plots.
    if let Some(format) = args.out.plots.format() {
        make_folder(&args.out.folder)?;
        let name = &scenario.name;
        let written = report::write_loops(name, &scenario.axes, settings, &args.out.folder, name, format)?;
        args.out.print.note(&plot::wrote(&written));
    }
    if analysis.axes.iter().all(|axis| axis.stable) {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        for axis in analysis.axes.iter().filter(|axis| !axis.stable) {
            note(&format!("axis {}: {}", axis.axis, axis.warnings.join("; ")));
        }
    }
    Ok(Outcome::Broken)
}

/// A figure of an axis, as it is shown; an unstable loop has none of some.
type Cell<'a> = &'a dyn Fn(&LoopFigures) -> Option<String>;

fn table(analysis: &Analysis<'_>, scenario: &Scenario) -> String {
    let axes = &analysis.axes;
    let delay = if analysis.delay_samples == 0 { "no delay" } else { "one sample of delay" };
    let mut out = format!(
        "{}: servo loops, sampled every {} ms, {delay}\n\n",
        printable(analysis.scenario),
        short(1e3 * analysis.period_s, 6)
    );
    let mut row = |label: &str, unit: &str, cell: Cell<'_>| {
        let cells: Vec<Option<String>> = axes.iter().map(cell).collect();
        if cells.iter().all(Option::is_none) {
            return;
        }
        let mut line = format!("  {label:<34}");
        for cell in cells {
            // Writing to a string does not fail.
            let _ = write!(line, "  {:>12}", cell.as_deref().unwrap_or("-"));
        }
        let _ = write!(line, "  {unit}");
        out.push_str(line.trim_end());
        out.push('\n');
    };
    let stable = |axis: &LoopFigures, value: String| axis.stable.then_some(value);
    row("", "", &|axis| Some(axis.axis.to_uppercase()));
    row("loop", "", &|axis| Some(if axis.stable { "stable" } else { "UNSTABLE" }.to_owned()));
    row("peak sensitivity Ms", "", &|axis| stable(axis, figure(axis.peak_sensitivity, 5)));
    row("  at", "rad/s", &|axis| stable(axis, figure(axis.peak_sensitivity_at_rad_s, 4)));
    row("stable from this gain factor on", "", &|axis| stable(axis, figure(axis.gain_factor_down, 4)));
    row("  and up to this one", "", &|axis| stable(axis, figure(axis.gain_factor_up, 5)));
    row("phase margin", "°", &|axis| stable(axis, figure(axis.phase_margin_deg, 4)));
    row("  at crossover", "rad/s", &|axis| stable(axis, figure(axis.crossover_rad_s, 4)));
    row("delay margin", "ms", &|axis| stable(axis, figure(1e3 * axis.delay_margin_s, 3)));
    row("largest pole", "", &|axis| Some(figure(axis.pole_radius, 5)));
    row("  least damped pole: damping", "", &|axis| Some(figure(least_damped(axis)?.damping, 3)));
    row("  its natural frequency", "rad/s", &|axis| Some(figure(least_damped(axis)?.natural_rad_s, 4)));
    let any = axes.iter().any(|axis| axis.stable);
    let blank = |_: &LoopFigures| any.then(String::new);
    row("", "", &blank);
    row("bandwidth (-3 dB), feedback alone", "rad/s", &|axis| Some(figure(axis.bandwidth_feedback_rad_s?, 4)));
    row("  with feedforward", "rad/s", &|axis| Some(figure(axis.bandwidth_rad_s?, 4)));
    for (title, with) in [("step, feedback alone: rise", false), ("step, with feedforward: rise", true)] {
        let step = |axis: &LoopFigures| if with { axis.step } else { axis.step_feedback };
        row(title, "ms", &|axis| Some(figure(1e3 * step(axis)?.rise_s, 3)));
        row("  overshoot", "%", &|axis| Some(figure(step(axis)?.overshoot_percent, 3)));
        row("  settled to 2 %", "ms", &|axis| Some(figure(1e3 * step(axis)?.settling_s, 3)));
    }
    row("", "", &blank);
    let feed = scenario.feed_mm_s;
    let at_feed = format!("tracking error at {} mm/s", short(feed, 5));
    row(&at_feed, "µm (negative: ahead)", &|axis| Some(figure(axis.tracking_error_um_per_mm_s? * feed, 5)));
    row("  for each mm/s of speed", "µm", &|axis| Some(figure(axis.tracking_error_um_per_mm_s?, 5)));
    row("  for each m/s² of acceleration", "µm", &|axis| Some(figure(1e3 * axis.tracking_error_um_per_mm_s2?, 5)));
    let mut warnings: Vec<(&str, Vec<String>)> = Vec::new();
    for axis in axes {
        for warning in &axis.warnings {
            match warnings.iter_mut().find(|(text, _)| text == warning) {
                Some((_, names)) => names.push(axis.axis.to_uppercase()),
                None => warnings.push((warning, vec![axis.axis.to_uppercase()])),
            }
        }
    }
    for (i, (warning, names)) in warnings.iter().enumerate() {
        let _ = writeln!(out, "{}  {}: {warning}", if i == 0 { "\n" } else { "" }, names.join(" and "));
    }
    out
}

fn least_damped(axis: &LoopFigures) -> Option<Pole> {
    axis.poles.iter().copied().min_by(|a, b| a.damping.total_cmp(&b.damping))
}
