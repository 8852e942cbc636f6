//! `servosim learn`: iterative learning over repeated runs.

use std::fmt::Write as _;
use std::path::Path;

use crate::learning::{LearnRequest, Learned, learn_until};
use crate::report;
use crate::scenario::{Document, Scenario};
use crate::simulation::write_corrections;
use clap::Args;

use super::interrupt::stop_flag;
use super::output::{OutputArgs, make_folder, note, printable, significant, wrote};
use super::{CliError, Outcome};

/// Arguments of `servosim learn`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim learn alpha --runs 10
  servosim learn alpha-real --runs 20 --gain 0.5 --cutoff-hz 40

Each run is corrected by what the run before has taught: its error, through the inverse of the axis' linear \
model and a zero-phase low pass. The correction goes to NAME-learned.csv: for every sample, the offset of the \
position commands. The last line says how the scenario runs with it: `learned.file = \"…\"` at the top of the \
file, or --set learned.file=…, relative to the folder of the scenario. A scenario that has such a file continues \
from there.

The best run is the one with the smallest contouring error; learning itself works on the tracking error. The first \
run, without a correction, is one of them: what is written is never worse.

Exits with 3 if no run is better than the first, learning diverges, an axis locks up or a loop is unstable; the \
correction of the best run is written in any case, also after Ctrl-C.")]
pub(crate) struct LearnArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Number of runs; the first has no correction, or the one of the scenario
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: u32,
    /// Learning gain, below 2: with an exact model |1 - gain| of the error remains after each run
    #[arg(long, value_name = "GAIN", default_value_t = 0.8, allow_hyphen_values = true)]
    gain: f64,
    /// Cutoff of the low pass [default: a quarter of the bandwidth of the slower axis, at most a tenth of the Nyquist frequency]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    cutoff_hz: Option<f64>,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Learns.
pub(crate) fn run(args: &LearnArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let request = LearnRequest { runs: args.runs, gain: args.gain, cutoff_hz: args.cutoff_hz };
    let learned = learn_until(&stop_flag(), &scenario, &request)?;
    if learned.runs.is_empty() {
        return Err(CliError::Stopped("the first run was done; nothing was written"));
    }
    args.out.print.show(&learned, || table(&learned))?;
    if args.out.print.has_no_table() {
        let locked = learned.locked_up.then(|| "an axis locks up in the first run".to_owned());
        let gained = (!learned.improved() && !learned.interrupted)
            .then(|| "no run has a smaller contouring error than the first".to_owned());
        learned.diverged.iter().chain(&locked).chain(&gained).for_each(|text| note(text));
    }
    make_folder(&args.out.folder)?;
    let file = args.out.folder.join(format!("{}-learned.csv", scenario.name));
    report::write_file(&file, write_corrections(&learned.corrections_mm, learned.period_s).as_bytes())?;
    let mut written = vec![file.clone()];
    if let Some(format) = args.out.plots.format() {
        written.extend(report::write_learning(&learned, &args.out.folder, &scenario.name, format)?);
    }
    args.out.print.note(&wrote(&written));
    if learned.improved() || learned.continued {
        args.out.print.note(&how_to_run(&document, &scenario, &file));
    }
    if learned.interrupted {
        return Err(CliError::LearningInterrupted { runs: learned.runs.len(), file });
    }
    Ok(if learned.diverged.is_some() || learned.locked_up || !learned.improved() {
        Outcome::Broken
    } else {
        Outcome::Fine
    })
}

/// The table for people.
fn table(learned: &Learned) -> String {
    let mut out = format!(
        "{}: iterative learning, gain {}, low pass at {} Hz\n\n",
        printable(&learned.scenario),
        significant(learned.gain, 3),
        significant(learned.cutoff_hz, 4)
    );
    // Writing to a string does not fail.
    if learned.continued {
        out.push_str("  continues from the correction of the scenario: the first run is made with it\n\n");
    }
    let _ = writeln!(out, "  run   tracking rms       max   contouring rms       max   voltage");
    for run in &learned.runs {
        let best = if run.run == learned.best_run { "  best" } else { "" };
        let _ = writeln!(
            out,
            "  {:>3} {:>14} {:>9} {:>16} {:>9} {:>9}{best}",
            run.run,
            significant(run.rms_tracking_error_um, 4),
            significant(run.max_tracking_error_um, 4),
            significant(run.rms_contour_error_um, 4),
            significant(run.max_contour_error_um, 4),
            significant(run.peak_voltage_v, 4)
        );
    }
    let _ = writeln!(out, "                 µm        µm               µm        µm         V");
    for line in learned.diverged.iter().chain(&learned.warnings) {
        let _ = writeln!(out, "\n  {}", printable(line));
    }
    out
}

/// How a run is made with what was learned.
fn how_to_run(document: &Document, scenario: &Scenario, file: &Path) -> String {
    let name = document.name_of(file);
    // As TOML writes it.
    let quoted = toml_edit::Value::from(name.as_str()).to_string();
    let plain = name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/'))
        && (name.starts_with("../") || name.starts_with(|c: char| c.is_alphabetic() || c == '/'));
    let set = if plain {
        format!("learned.file={name}")
    } else {
        // As a shell takes it.
        format!("'learned.file={}'", quoted.trim().replace('\'', r"'\''"))
    };
    let noise = if scenario.drives.iter().any(|drive| drive.effects.noise.is_some()) {
        "; each run above had noise of its own, that one has the scenario's"
    } else {
        ""
    };
    format!("to run with it: --set {set}, or at the top of the scenario: learned.file = {}{noise}", quoted.trim())
}
