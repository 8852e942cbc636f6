//! `servosim run`: runs a scenario, records it, plots it and prints its metrics.

use crate::run::{RunRequest, is_program, recording_bytes, run_scenario};
use crate::scenario::{Document, Scenario};

use super::interrupt::stop_flag;
use super::output::{note, short};
use super::running::{RunArgs, Shown, finish};
use super::{CliError, Outcome, comparison_table, program, table};

/// From this size on a recording is told of before it is written \[bytes\].
const WORTH_A_WARNING: u64 = 1_000_000_000;

/// Runs the scenario or the program.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, CliError> {
    if is_program(&args.scenario) {
        return program::run(args);
    }
    if args.part.is_some() {
        return Err(CliError::Usage(
            "--part goes with an NC program, such as output/patch.nc, not with a scenario".to_owned(),
        ));
    }
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let request = args.request();
    warn_of_size(args, &scenario, &request)?;
    let mut shown = Shown::new(args.out.print.is_watched());
    let report = run_scenario(&scenario, &request, &stop_flag(), &mut shown)?;
    shown.finish();
    let effects = report.effects.as_ref().map_or(String::new(), |effects| {
        let mut out = "\n".to_owned();
        comparison_table::errors(&mut out, effects);
        out
    });
    // Metrics and recording are there whatever becomes of the plots.
    args.out.print.show(&report.summary, || table::table(&report.summary) + &effects)?;
    finish(args, report, "; `servosim analyze` says more")
}

/// A recording that fills a disk is told of before it is written.
fn warn_of_size(args: &RunArgs, scenario: &Scenario, request: &RunRequest) -> Result<(), CliError> {
    let (samples, bytes) = recording_bytes(scenario, request)?;
    if !args.out.print.quiet && bytes >= WORTH_A_WARNING {
        note(&format!(
            "note: {samples} samples make a recording of about {} GB in {}; Ctrl-C ends the run, --every N records each Nth",
            short(bytes as f64 / 1e9, 2),
            args.out.folder.display()
        ));
    }
    Ok(())
}
