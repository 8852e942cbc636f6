//! `servosim run PROGRAM.nc`: a program through the machine, and the part that comes of it.

use std::path::{Path, PathBuf};

use crate::limits::LimitCheck;
use crate::run::{PartPair, Program, ProgramMetrics, run_program};
use crate::scenario::{Document, Part};
use crate::summary::Summary;
use serde::Serialize;

use super::interrupt::stop_flag;
use super::output::{note, printable, significant};
use super::part_table;
use super::running::{RunArgs, Shown, finish};
use super::table::{self, limit_lines, section};
use super::{CliError, Outcome};

/// The part whose machine runs a program that comes alone.
const DEFAULT_PART: &str = "patch";

/// The metrics of a run: those of any run, and those of the program and the part.
#[derive(Debug, Serialize)]
struct ProgramSummary<'a> {
    #[serde(flatten)]
    run: &'a Summary,
    program: &'a ProgramMetrics,
    part: Option<&'a PartPair>,
}

/// Runs the program.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, CliError> {
    let file = PathBuf::from(&args.scenario);
    let (part, comes_alone) = part_of(args, &file)?;
    let program = Program { file: &file, part: &part, with_part: !comes_alone };
    let mut shown = Shown::new(args.out.print.is_watched());
    let report = run_program(&program, &args.request(), &stop_flag(), &mut shown)?;
    shown.finish();
    let pair = report.part.as_ref().map(|(pair, _)| pair);
    if !report.run.interrupted {
        let summary = ProgramSummary { run: &report.run.summary, program: &report.program, part: pair };
        args.out.print.show(&summary, || table(&summary))?;
    }
    let broken: Vec<String> = pair.iter().flat_map(|pair| table::broken(&pair.limits)).collect();
    let outcome = finish(args, report.run, "")?;
    if comes_alone {
        args.out.print.note(&format!(
            "note: no part file beside the program: it ran on the machine of the built-in part `{DEFAULT_PART}`, and no part was looked at; --part FILE names one"
        ));
    }
    if broken.is_empty() {
        return Ok(outcome);
    }
    if args.out.print.has_no_table() {
        note(&broken.join("\n"));
    }
    Ok(Outcome::Broken)
}

/// The part that the program belongs to: the one named, or the one beside it; else that of the program itself, which has no more
/// than its machine.
fn part_of(args: &RunArgs, file: &Path) -> Result<(Part, bool), CliError> {
    let beside = file.with_extension("part.toml");
    let (mut document, comes_alone) = match &args.part {
        Some(name) => (Document::find_part(name)?, false),
        None if beside.is_file() => (Document::read(&beside)?, false),
        None => (Document::find(&format!("{DEFAULT_PART}.toml"))?, true),
    };
    for key_value in &args.set {
        document.set(key_value)?;
    }
    Ok((document.part()?, comes_alone))
}

fn table(summary: &ProgramSummary<'_>) -> String {
    let mut out = format!("{}\n\n", printable(&summary.run.scenario));
    let program = summary.program;
    let blocks = format!(
        "{} straight, {} arcs, {} NURBS of {} control points, {} rapid",
        program.straight_blocks, program.arcs, program.nurbs, program.control_points, program.rapid_blocks
    );
    let motions = program.straight_blocks + program.arcs + program.nurbs + program.rapid_blocks;
    section(
        &mut out,
        &[
            ("motions", motions.to_string(), "", blocks),
            ("length at the feed", significant(program.feed_length_mm, 6), "mm", String::new()),
            ("rapid length", significant(program.rapid_length_mm, 5), "mm", String::new()),
        ],
    );
    table::metrics(&mut out, summary.run);
    if let Some(pair) = summary.part {
        section(&mut out, &part_table::part("nominal", &pair.nominal));
        let mut rows = part_table::part("as cut", &pair.as_cut);
        let difference = significant(pair.largest_difference_um, 4);
        rows.push(("largest difference", difference, "µm", "as cut against nominal, cell by cell".to_owned()));
        section(&mut out, &rows);
    }
    let part = summary.part.iter().flat_map(|pair| pair.limits.iter());
    let limits: Vec<LimitCheck> = summary.run.limits.iter().chain(part).cloned().collect();
    limit_lines(&mut out, &limits, "no limits for the part");
    table::lockup(&mut out, summary.run);
    out
}
