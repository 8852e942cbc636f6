//! `servosim check`: validates scenarios, tells what they plan, and validates parts.

use std::fmt::Write as _;

use crate::limits::is_kept;
use crate::scenario::{Document, Part, Scenario, ScenarioError};
use clap::Args;

use super::output::{margin, print, printable, short, significant};
use super::{CliError, Outcome, tell};

/// Arguments of `servosim check`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  servosim check scenarios/*.toml

Exits with 2 if any of them cannot be used.")]
pub(crate) struct CheckArgs {
    /// Scenario and part files, or names of built-in ones
    #[arg(required = true, value_name = "FILE")]
    files: Vec<String>,
}

/// Checks every file, in the order given.
pub(crate) fn run(args: &CheckArgs) -> Result<Outcome, CliError> {
    let mut invalid = 0;
    for file in &args.files {
        match Document::find(file).and_then(|document| checked(file, &document)) {
            Ok(lines) => print(&lines)?,
            Err(error) if args.files.len() == 1 => return Err(error.into()),
            Err(error) => {
                invalid += 1;
                tell(&error.into());
            }
        }
    }
    if invalid == 0 { Ok(Outcome::Fine) } else { Err(CliError::Invalid { invalid, count: args.files.len() }) }
}

/// What is said of a sound file.
fn checked(file: &str, document: &Document) -> Result<String, ScenarioError> {
    if document.is_part() { Ok(sound(file, &document.part()?)) } else { Ok(planned(file, &document.scenario()?)) }
}

/// One line for a sound part. Whether its cutter fits everywhere only the tool path can tell.
fn sound(file: &str, part: &Part) -> String {
    let options = &part.options;
    format!(
        "{}: ok (part; {}, scallop {} mm, tolerance {} mm)\n",
        printable(file),
        part.cutter,
        short(options.scallop_mm, 5),
        short(options.tolerance_mm, 5)
    )
}

/// One line for a sound scenario, and one for each limit that its plan alone breaks already.
fn planned(file: &str, scenario: &Scenario) -> String {
    let peaks = scenario.motion.peaks();
    let samples = scenario.simulation().map_or(0, |simulation| simulation.samples());
    let learned = scenario.corrections_mm.as_ref().map_or(String::new(), |corrections| {
        let largest_mm = corrections.iter().map(nalgebra::Matrix::amax).fold(0.0, f64::max);
        format!(", learned corrections up to {} µm", significant(1e3 * largest_mm, 4))
    });
    let mut out = format!(
        "{}: ok ({} mm, {} mm/s, {} s, peak jerk {} mm/s³, {samples} samples{learned})\n",
        printable(file),
        significant(scenario.path.length_mm(), 6),
        short(scenario.motion.feed_mm_s(), 5),
        significant(scenario.motion.total_s(), 4),
        significant(peaks.jerk_mm_s3, 5),
    );
    // A feed that is planned under limits of the axes keeps those: limits along the path are not its own.
    let along = scenario.limits.axes.is_none();
    let limits = [
        ("accel_mm_s2", peaks.accel_mm_s2, scenario.limits.accel_mm_s2),
        ("jerk_mm_s3", peaks.jerk_mm_s3, scenario.limits.jerk_mm_s3),
    ];
    for (name, value, limit) in limits {
        if let Some(limit) = limit
            && along
            && !is_kept(value, limit)
        {
            // Writing to a string does not fail.
            let _ = writeln!(
                out,
                "  the planned motion breaks {name} = {}: {} ({})",
                short(limit, 5),
                significant(value, 5),
                margin(value, limit)
            );
        }
    }
    out
}
