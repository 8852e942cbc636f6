//! `servosim analyze`: margins, poles, bandwidth and step response of the servo loops, without a run.

use crate::parameters::AXIS_NAMES;
use std::fmt::Write as _;

use crate::analysis::{DriveLoop, Linearized, LoopMetrics, Pole};
use crate::report;
use crate::scenario::{Document, Scenario};
use crate::servo::Derivative;
use clap::Args;
use serde::Serialize;

use super::output::{OutputArgs, make_folder, note, printable, short, significant, wrote};
use super::{CliError, Outcome};

/// Arguments of `servosim analyze`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim analyze alpha.toml
  servosim analyze alpha --set axes.x.pdff.kpv=2 --set control.delay_samples=1
  servosim analyze alpha --set axes.x.effects.delay.samples=0.5
  servosim analyze heart --format json --plots none

The analysis is linear: no saturation. With the detailed drive model it includes delay, current loop, two \
masses, viscous friction, mismatch, velocity estimate, encoder place, filters, feedforward and the controller; \
it neglects friction, backlash, encoder quantisation, DAC, noise, pitch error, ripple and force, and the table \
says so.

SCENARIO is looked for as by `servosim run`. Exits with 3 if a loop is unstable.")]
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
    /// Of the control; what its drive adds is in each axis'.
    delay_samples: u8,
    derivative: &'static str,
    axes: Vec<LoopMetrics>,
}

/// Analyses the loops of the scenario.
pub(crate) fn run(args: &AnalyzeArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let settings = &scenario.settings;
    let loops = loops(&scenario)?;
    let mut axes: Vec<LoopMetrics> =
        AXIS_NAMES.iter().zip(&loops).map(|(name, of)| LoopMetrics::of(name, of)).collect();
    if scenario.cross_coupling.is_some() {
        // It ties the axes together: no loop of one axis has it.
        for axis in &mut axes {
            axis.linearized.neglected.push("cross-coupled control".to_owned());
        }
    }
    if scenario.corrections_mm.is_some() {
        // They are part of the command.
        for axis in &mut axes {
            axis.linearized.neglected.push("learned corrections".to_owned());
        }
    }
    let analysis = Analysis {
        scenario: &scenario.name,
        period_s: settings.period_s,
        delay_samples: u8::from(settings.one_sample_delay),
        derivative: match settings.derivative {
            Derivative::Backward => "backward",
            Derivative::Exact => "exact",
        },
        axes,
    };
    args.out.print.show(&analysis, || table(&analysis, &scenario))?;
    // The metrics are there whatever becomes of the plots.
    if let Some(format) = args.out.plots.format() {
        make_folder(&args.out.folder)?;
        let name = &scenario.name;
        let written = report::write_loops(name, &loops, &args.out.folder, name, format)?;
        args.out.print.note(&wrote(&written));
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

/// The loops of the scenario's axes.
pub(super) fn loops(scenario: &Scenario) -> Result<Vec<DriveLoop>, CliError> {
    let axes = scenario.axes.iter().zip(&scenario.drives);
    let loops = axes.map(|(axis, drive)| DriveLoop::new(axis, drive, &scenario.settings));
    loops.collect::<Result<_, _>>().map_err(|error| CliError::Simulation(error.into()))
}

/// What is in linear loops beyond their models, and what is left out, axis by axis; empty for models.
pub(super) fn linearized<'a>(axes: impl Iterator<Item = (&'a str, &'a Linearized)> + Clone) -> Vec<String> {
    let mut lines: Vec<(Vec<String>, String)> = Vec::new();
    let mut add = |name: &str, text: String| {
        let name = name.to_uppercase();
        match lines.iter_mut().find(|(_, known)| *known == text) {
            Some((names, _)) => names.push(name),
            None => lines.push((vec![name], text)),
        }
    };
    for (name, linear) in axes.clone() {
        let mut parts = linear.modelled.clone();
        if linear.controller != "pdff" {
            parts.insert(0, format!("{} controller", linear.controller));
        }
        if !parts.is_empty() {
            add(name, format!("in the loop: {}", parts.join(", ")));
        }
    }
    for (name, linear) in axes.filter(|(_, linear)| !linear.neglected.is_empty()) {
        add(name, format!("neglected, not linear: {}", linear.neglected.join(", ")));
    }
    lines.into_iter().map(|(names, text)| format!("{}: {text}", names.join(" and "))).collect()
}

/// How late the voltage is.
fn told_delay(axes: &[LoopMetrics]) -> String {
    let one = |samples: f64| match samples {
        0.0 => "no delay".to_owned(),
        1.0 => "one sample of delay".to_owned(),
        _ => format!("{} samples of delay", short(samples, 5)),
    };
    let first = axes.first().map_or(0.0, |axis| axis.delay_samples);
    if axes.iter().all(|axis| axis.delay_samples == first) {
        return one(first);
    }
    let each = axes.iter().map(|axis| format!("{}: {}", axis.axis.to_uppercase(), one(axis.delay_samples)));
    each.collect::<Vec<_>>().join(", ")
}

/// A figure of an axis, as it is shown; an unstable loop has none of some.
type Cell<'a> = &'a dyn Fn(&LoopMetrics) -> Option<String>;

fn table(analysis: &Analysis<'_>, scenario: &Scenario) -> String {
    let axes = &analysis.axes;
    let mut out = format!(
        "{}: servo loops, sampled every {} ms, {}\n",
        printable(analysis.scenario),
        short(1e3 * analysis.period_s, 6),
        told_delay(axes)
    );
    for line in linearized(axes.iter().map(|axis| (axis.axis.as_str(), &axis.linearized))) {
        let _ = writeln!(out, "  {line}");
    }
    out.push('\n');
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
    let stable = |axis: &LoopMetrics, value: String| axis.stable.then_some(value);
    row("", "", &|axis| Some(axis.axis.to_uppercase()));
    row("loop", "", &|axis| Some(if axis.stable { "stable" } else { "UNSTABLE" }.to_owned()));
    row("peak sensitivity Ms", "", &|axis| stable(axis, significant(axis.peak_sensitivity, 5)));
    row("  at", "rad/s", &|axis| stable(axis, significant(axis.peak_sensitivity_at_rad_s, 4)));
    row("stable from this gain factor on", "", &|axis| stable(axis, significant(axis.gain_factor_down, 4)));
    row("  and up to this one", "", &|axis| stable(axis, significant(axis.gain_factor_up, 5)));
    row("phase margin", "°", &|axis| stable(axis, significant(axis.phase_margin_deg, 4)));
    row("  at crossover", "rad/s", &|axis| stable(axis, significant(axis.crossover_rad_s, 4)));
    row("delay margin", "ms", &|axis| stable(axis, significant(1e3 * axis.delay_margin_s, 3)));
    row("largest pole", "", &|axis| Some(significant(axis.pole_radius, 5)));
    row("  least damped pole: damping", "", &|axis| Some(significant(least_damped(axis)?.damping, 3)));
    row("  its natural frequency", "rad/s", &|axis| Some(significant(least_damped(axis)?.natural_rad_s, 4)));
    let any = axes.iter().any(|axis| axis.stable);
    let blank = |_: &LoopMetrics| any.then(String::new);
    row("", "", &blank);
    row("velocity gain Kv, feedback alone", "1/s", &|axis| Some(significant(axis.kv_1_s?, 4)));
    row("", "m/min/mm", &|axis| Some(significant(axis.kv_m_min_mm?, 4)));
    let title = "bandwidth (-3 dB), feedback alone";
    row(title, "rad/s", &|axis| Some(significant(axis.bandwidth_feedback_rad_s?, 4)));
    row("", "Hz", &|axis| Some(significant(axis.bandwidth_feedback_hz?, 4)));
    row("  rises again, below from here on", "rad/s", &|axis| {
        again(axis.bandwidth_feedback_rad_s, axis.bandwidth_feedback_last_rad_s)
    });
    row("  with feedforward", "rad/s", &|axis| Some(significant(axis.bandwidth_rad_s?, 4)));
    row("", "Hz", &|axis| Some(significant(axis.bandwidth_hz?, 4)));
    row("  rises again, below from here on", "rad/s", &|axis| again(axis.bandwidth_rad_s, axis.bandwidth_last_rad_s));
    for (title, with) in [("step, feedback alone: rise", false), ("step, with feedforward: rise", true)] {
        let step = |axis: &LoopMetrics| if with { axis.step } else { axis.step_feedback };
        row(title, "ms", &|axis| Some(significant(1e3 * step(axis)?.rise_s, 3)));
        row("  overshoot", "%", &|axis| Some(significant(step(axis)?.overshoot_percent, 3)));
        row("  settled to 2 %", "ms", &|axis| Some(significant(1e3 * step(axis)?.settling_s, 3)));
    }
    row("", "", &blank);
    let feed = scenario.feed_mm_s;
    let at_feed = format!("tracking error at {} mm/s", short(feed, 5));
    row(&at_feed, "µm (negative: ahead)", &|axis| Some(significant(axis.tracking_error_um_per_mm_s? * feed, 5)));
    row("  for each mm/s of speed", "µm", &|axis| Some(significant(axis.tracking_error_um_per_mm_s?, 5)));
    row("  for each m/s² of acceleration", "µm", &|axis| {
        Some(significant(1e3 * axis.tracking_error_um_per_mm_s2?, 5))
    });
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

/// The last crossing of -3 dB where it is another one than the first.
fn again(first: Option<f64>, last: Option<f64>) -> Option<String> {
    let first = first?;
    match last {
        Some(last) if last == first => None,
        Some(last) => Some(significant(last, 4)),
        None => Some("never".to_owned()),
    }
}

fn least_damped(axis: &LoopMetrics) -> Option<Pole> {
    axis.poles.iter().copied().min_by(|a, b| a.damping.total_cmp(&b.damping))
}
