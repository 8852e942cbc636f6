//! `servosim run`: runs a scenario and prints its figures.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, ValueEnum};
use servosim::scenario::Document;
use servosim::simulation::{Ending, Observer};
use servosim::summary::Summary;

use super::output::print;
use super::progress::Progress;
use super::{CliError, Outcome, is_watched, table};

/// Arguments of `servosim run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim run alpha.toml
  servosim run alpha.toml --set feedrate.feed_mm_s=150 --set limits.contour_error_um=50
  servosim run alpha.toml --set feedrate.profile.quintic.phase_s=0.1
  servosim run heart --format json --plots none

SCENARIO is looked for as a file, then in the folder scenarios, then among the built-in ones (alpha, heart, star).")]
pub(crate) struct RunArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the recording and the plots; made if it is missing
    #[arg(long, value_name = "DIR", default_value = "output")]
    output: PathBuf,
    /// Format of the plots
    #[arg(long, value_enum, default_value = "svg")]
    plots: Plots,
    /// What to print: a table, or the summary as one JSON object and nothing else
    #[arg(long, value_enum, default_value = "table")]
    format: Format,
    /// Print no table, no progress and no notes: only errors, and the JSON if asked for
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Plots {
    Svg,
    Png,
    None,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Table,
    Json,
}

/// Runs the scenario.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let stop = stop_flag();
    fs::create_dir_all(&args.output).map_err(|source| CliError::Write { path: args.output.clone(), source })?;

    let mut figures = scenario.summary_observer();
    let mut progress = Progress::new(!args.quiet && is_watched());
    // The recorder is made here (and named by `figures.with_recording`), the plots' observer too; both join the list.
    let mut observers: Vec<&mut dyn Observer<2>> = vec![&mut figures, &mut progress];
    let ending = scenario.simulation()?.run(&scenario.limits, Some(&stop), &mut observers)?;
    progress.finish();
    let summary = figures.summary();
    // The recorder is finished with the summary here, and the plots are drawn.

    match args.format {
        Format::Json => print(&json(&summary)?)?,
        Format::Table if !args.quiet => print(&table::table(&summary))?,
        Format::Table => {}
    }
    match ending {
        Ending::Interrupted => {
            let time_s = summary.samples.saturating_sub(1) as f64 * summary.period_s;
            Err(CliError::Interrupted { time_s })
        }
        Ending::Complete if summary.passed() => Ok(Outcome::Fine),
        Ending::Complete => Ok(Outcome::Broken),
    }
}

fn json(summary: &Summary) -> Result<String, CliError> {
    let mut text = serde_json::to_string_pretty(summary).map_err(|error| CliError::Stdout(error.into()))?;
    text.push('\n');
    Ok(text)
}

/// A flag that Ctrl-C raises, so that a run ends after a whole period; a second Ctrl-C ends the program at once.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    // Without a handler Ctrl-C just ends the program, which is no reason not to run.
    let _ = ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    });
    flag
}
