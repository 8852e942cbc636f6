//! `servosim sweep`: one scenario at many points, computed so that a kill loses nothing.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::scenario::Document;
use crate::sweep::{
    Exported, Journal, Method, Metric, Outcome, PERCENTILES, Plan, Session, Shard, Start, Sweep, SweepError, Value,
    export,
};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::interrupt::stop_flag;
use super::output::{OutputArgs, make_folder, note, percent, printable, short, significant, wrote};
use super::{CliError, Outcome as Found, is_watched};

/// Arguments of `servosim sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim sweep alpha --vary x.kpp=60:140:81 --vary x.kiv=100:400:61
  servosim sweep alpha --vary feedrate.feed_mm_s=50,100,150
  servosim sweep alpha --vary axes.x.plant.gain_rad_s_v=±20% \\
      --vary axes.y.plant.gain_rad_s_v=±20% --method sobol --samples 4096
  servosim sweep alpha --vary 'x.kpp=normal(±5%)' --samples 10000 --seed 7
  servosim sweep alpha --vary axes.x.pdff.kpp=60:140:100001 --shard 3/8
      one of 8 tasks of a job array; at the end: servosim merge output/*.part

Values of --vary:
  60:140:81        81 values from 60 to 140
  60:140:81:log    the same, evenly spaced in the logarithm
  50,100,150       a list
  ±20%:5           5 values around the scenario's own (also typed +-20%); ±2:5 in
                   its unit
and for sampled sweeps:
  60:140           any value between; also 60:140:log, ±20%, ±2
  normal(97.4, 2)  normally distributed: mean and standard deviation; also
                   normal(±5%)

The table that the scenario has chosen may be omitted from a key: axes.x.plant.gain_rad_s_v. A gain has a short \
key: x.kpp is axes.x.pdff.kpp.

Writes NAME-sweep.parquet, NAME-sweep.csv and NAME-sweep.svg. Until then NAME-sweep.journal keeps the results so \
far: after a kill or Ctrl-C the same command continues from there.")]
pub(crate) struct SweepArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Vary one value of the scenario, such as axes.x.pdff.kpp=60:140:81 (may be given again)
    #[arg(long = "vary", value_name = "KEY=VALUES", required = true, allow_hyphen_values = true)]
    vary: Vec<String>,
    /// Replace one value of the scenario at all points, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// How points are chosen [default: grid if every --vary lists its values and there is no --samples; else monte-carlo if
    /// one is normal(…), latin-hypercube if none is]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// How many points a sampled method takes
    #[arg(long, value_name = "N")]
    samples: Option<u64>,
    /// Seed of the sampled methods: the same seed gives the same points
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Add the margins of every point's loops to the tables (peak sensitivity, gain, phase and delay margins of both axes, as
    /// `servosim analyze` gives them: of the detailed drive model)
    #[arg(long)]
    margins: bool,
    /// Compute the I-th of N parts only, for `servosim merge`
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Discard the journal of an earlier sweep
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    finish: FinishArgs,
}

/// What is made of the metrics, by `sweep` and by `merge`.
#[derive(Debug, Args)]
pub(crate) struct FinishArgs {
    /// Metric of the plot, the best point and the percentiles: a column of the tables
    #[arg(long, alias = "figure", value_name = "COLUMN", default_value = "max_contour_error_um", value_parser = metric_of)]
    metric: Metric,
    #[command(flatten)]
    out: OutputArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Grid,
    LatinHypercube,
    Sobol,
    MonteCarlo,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Grid => Self::Grid,
            MethodName::LatinHypercube => Self::LatinHypercube,
            MethodName::Sobol => Self::Sobol,
            MethodName::MonteCarlo => Self::MonteCarlo,
        }
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((index, of)) if index >= 1 && index <= of => Ok(Shard { index, of }),
        _ => Err("write it as I/N, from 1/N to N/N, such as 3/8".to_owned()),
    }
}

fn metric_of(name: &str) -> Result<Metric, String> {
    Metric::find(name).ok_or_else(|| {
        let known: Vec<&str> = Metric::all(true).map(Metric::name).collect();
        format!("known here: {}", known.join(", "))
    })
}

/// Computes the sweep, or one shard of it.
pub(crate) fn run(args: &SweepArgs) -> Result<Found, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let margins = args.margins || args.finish.metric.is_margin();
    let plan = Plan { method: args.method.map(Method::from), samples: args.samples, seed: args.seed, margins };
    let sweep = Sweep::new(&document, &args.vary, &plan)?;
    let stop = stop_flag();
    let finish = &args.finish;
    make_folder(&finish.out.folder)?;
    let session = Session::open(&sweep, &finish.out.folder, args.shard.unwrap_or(Shard::WHOLE), args.fresh, None)?;
    if !finish.out.print.quiet {
        match session.start() {
            Start::New => {}
            Start::Resumed(done) => note(&format!("going on after {done} of {} points", session.points())),
            Start::Finished => note("this shard is computed already"),
        }
    }
    let journal = compute(session, &stop, finish.out.print.quiet)?;
    if args.shard.is_some_and(|shard| shard.of > 1) {
        if !finish.out.print.quiet {
            note(&format!(
                "wrote {}; when all parts are there: servosim merge {}",
                journal.path().display(),
                finish.out.folder.join(format!("{}-sweep.*.part", sweep.scenario().name)).display()
            ));
        }
        return Ok(Found::Fine);
    }
    let path = journal.path().to_owned();
    let written = finish.write(&sweep, &[journal], &stop);
    if matches!(written, Ok(_) | Err(CliError::Sweep(SweepError::NothingValid { .. }) | CliError::Report(_))) {
        // The tables hold it all. A journal that stays is only in the way of the next sweep.
        let _ = std::fs::remove_file(path);
    }
    written
}

/// Computes what is missing, with a bar where a person watches.
fn compute(session: Session<'_>, stop: &AtomicBool, quiet: bool) -> Result<Journal, CliError> {
    let (done, points) = (session.done(), session.points());
    let bar = (!quiet && is_watched() && done < points)
        .then(|| ProgressBar::with_draw_target(Some(points), ProgressDrawTarget::stderr()));
    if let Some(bar) = &bar {
        let style = "{bar:40} {percent:>3} %, {pos} of {len} runs, {per_sec}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style.with_key(
                "per_sec",
                |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
                    let _ = write!(out, "{:.0} runs/s", state.per_sec());
                },
            ));
        }
        bar.set_position(done);
        bar.reset_eta();
    }
    let started = Instant::now();
    let journal = session.compute(Some(stop), &mut |done| {
        if let Some(bar) = &bar {
            bar.set_position(done);
        }
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let journal = journal?;
    let (new, seconds) = (points - done, started.elapsed().as_secs_f64());
    if !quiet && new > 0 && seconds >= 1.0 {
        note(&format!("{new} runs in {} s, {} runs/s", short(seconds, 3), short((new as f64 / seconds).round(), 4)));
    }
    Ok(journal)
}

impl FinishArgs {
    /// Writes tables and plot, and tells what came of the sweep.
    pub(crate) fn write(&self, sweep: &Sweep, journals: &[Journal], stop: &AtomicBool) -> Result<Found, CliError> {
        let Exported { mut files, outcome, picture } =
            export(sweep, journals, &self.out.folder, self.metric, Some(stop))?;
        self.out.print.show(&outcome, || table(&outcome))?;
        let plots = match self.out.plots.format() {
            Some(format) => picture.write(&self.out.folder, format).map(|plots| files.extend(plots)),
            None => Ok(()),
        };
        self.out.print.note(&wrote(&files));
        plots?;
        Ok(Found::Fine)
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.out.folder
    }
}

/// The sweep in a few lines, ending in a newline. (Writing to a string does not fail.)
fn table(outcome: &Outcome) -> String {
    let plural = if outcome.points == 1 { "" } else { "s" };
    let mut out = format!("{}: {} point{plural}, {}\n\n", printable(&outcome.scenario), outcome.points, outcome.method);
    let counts = [
        ("ok", outcome.ok, ""),
        ("saturated", outcome.saturated, "and recovered"),
        ("locked up", outcome.locked_up, "an axis did not recover"),
        ("diverged", outcome.diverged, "a signal grew beyond all numbers"),
        ("invalid", outcome.invalid, "the values make no valid scenario"),
    ];
    let width = outcome.points.to_string().len();
    for (name, count, remark) in counts.iter().filter(|(name, count, _)| *count > 0 || *name == "ok") {
        let share = format!("{:>5} %", percent(100.0 * *count as f64 / outcome.points.max(1) as f64));
        let _ = writeln!(out, "{}", format!("  {name:<12} {count:>width$}  {share}  {remark}").trim_end());
    }
    let measured = Metric::find(&outcome.metric);
    let (title, unit) = measured.map_or((outcome.metric.as_str(), ""), |metric| (metric.title(), metric.unit()));
    if let Some(percentiles) = outcome.percentiles {
        let _ = writeln!(out, "\n  {title}{}", if unit.is_empty() { String::new() } else { format!(" [{unit}]") });
        for (percent, value) in PERCENTILES.iter().zip(percentiles) {
            let name = if *percent == 100 { "largest".to_owned() } else { format!("{percent} %") };
            let _ = writeln!(out, "  {name:>12}  {:>12}", significant(value, 5));
        }
    }
    if let Some(best) = &outcome.best {
        let _ = writeln!(out, "\n  best point: {}", best.index);
        let names = outcome.variables.iter().chain(&outcome.metrics);
        let width = names.map(String::len).max().unwrap_or(0);
        for (key, value) in outcome.variables.iter().zip(&best.values) {
            let _ = writeln!(out, "    {key:<width$}  {}", value.number().map_or(value.to_string(), value_of));
        }
        for (name, value) in outcome.metrics.iter().zip(&best.metrics) {
            let _ = writeln!(out, "    {name:<width$}  {}", metric_of_point(*value));
        }
    } else {
        out.push_str("\n  no point of the sweep is sound: an axis locks up, or a loop is unstable, at every one\n");
    }
    out.push('\n');
    out
}

/// A value of a variable: 8 digits, and no zeros behind them.
fn value_of(value: f64) -> String {
    Value::Number(format!("{value:.7e}").parse().unwrap_or(value)).to_string()
}

/// A metric of the best point: five digits also of a margin of a millisecond, in seconds.
fn metric_of_point(value: f64) -> String {
    let magnitude = value.abs();
    if !(1e-4..1.0).contains(&magnitude) {
        return significant(value, 5);
    }
    let zeros = [0.1, 0.01, 0.001].iter().filter(|bound| magnitude < **bound).count();
    significant(value, 5 + zeros)
}
