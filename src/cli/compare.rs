//! `servosim compare`: one scenario in many variants, side by side.

use crate::parameters::AXIS_NAMES;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::comparison::{Cell, Column, Comparison};
use crate::recording::{Recorder, RecordingMetadata};
use crate::report;
use crate::scenario::{Document, Scenario};
use crate::servo::ControllerKind;
use crate::simulation::{Observer, SimulationError};
use clap::{Args, ValueEnum};

use super::comparison_table::table;
use super::interrupt::stop_flag;
use super::output::{OutputArgs, RecordArgs, make_folder, note, printable, wrote};

use super::{CliError, Outcome};
use crate::run::recorded;

/// Most columns of a table.
const MOST_COLUMNS: usize = 12;

/// Arguments of `servosim compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim compare alpha-real
      each effect of its drives alone, and all of them
  servosim compare alpha --controllers pdff,p-pi,pid,cascade
      the same loops under other controllers
  servosim compare alpha-real --gains output/alpha-tuned.toml
      tuned gains with the detailed drive model

Rows are drives: the ideal drive model, each effect of the scenario alone, all effects, and all effects with \
compensation. Columns are controllers or sets of gains. A cell is the largest contouring error of a whole run; Δ \
is the largest difference of the contouring error from that of the ideal drive model at the same time. The plots \
lay the runs of the last row over each other.

Exits with 3 if an axis locks up or a loop diverges in any run, or if a run of the last row breaks a limit of \
the scenario.")]
pub(crate) struct CompareArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Controllers, each a column; gains that the scenario does not give are those of equal loops
    #[arg(long, value_name = "KIND,…", value_enum, value_delimiter = ',')]
    controllers: Vec<Kind>,
    /// A scenario whose PDFF gains become one more column (may be given again)
    #[arg(long, value_name = "SCENARIO")]
    gains: Vec<String>,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    out: OutputArgs,
}

/// A kind of controller, as it is typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Pseudo-derivative feedback with feedforward
    Pdff,
    /// Position P, velocity PI
    PPi,
    /// Position PID
    Pid,
    /// Position P, velocity PI, feedforward of velocity and acceleration
    Cascade,
}

impl From<Kind> for ControllerKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Pdff => Self::Pdff,
            Kind::PPi => Self::PPi,
            Kind::Pid => Self::Pid,
            Kind::Cascade => Self::Cascade,
        }
    }
}

/// Compares.
pub(crate) fn run(args: &CompareArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find(&args.scenario)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let scenario = document.scenario()?;
    let columns = columns(args)?;
    let stop = stop_flag();
    let comparison = Comparison::until(&stop, &scenario, &columns)?
        .ok_or(CliError::Stopped("the comparison was done; nothing was written"))?;
    let written = plots(args, &scenario, &columns, &stop);
    args.out.print.show(&comparison, || table(&comparison) + &remarks(&scenario, &columns, &comparison))?;
    let written = written?;
    if !written.is_empty() {
        args.out.print.note(&wrote(&written));
    }
    if !comparison.is_broken() {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        note(&broken(&comparison).join("\n"));
    }
    Ok(Outcome::Broken)
}

/// The columns, each with a name of its own.
fn columns(args: &CompareArgs) -> Result<Vec<Column>, CliError> {
    let mut columns: Vec<Column> = Vec::new();
    for kind in &args.controllers {
        let column = Column::Controller((*kind).into());
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    if columns.is_empty() {
        columns.push(Column::Own);
    }
    let mut gains = Vec::new();
    for typed in &args.gains {
        let other = Document::find(typed)?.scenario()?;
        gains.push((typed, other.name, other.axes.map(|axis| axis.pdff)));
    }
    let same = |a: &str, b: &str| a.to_lowercase() == b.to_lowercase();
    for (typed, name, pdff) in &gains {
        // Two files of one name are told apart by what was typed.
        let is_own = gains.iter().filter(|(_, other, _)| same(other, name)).count() == 1
            && !columns.iter().any(|column| same(column.name(), name));
        let name = if is_own { name } else { typed.strip_suffix(".toml").unwrap_or(typed) };
        let column = Column::Gains(name.to_owned(), *pdff);
        if columns.contains(&column) {
            continue;
        }
        let taken = |name: &str| columns.iter().any(|column| same(column.name(), name));
        let numbered = (2..columns.len() + 3).map(|n| format!("{name} ({n})")).find(|name| !taken(name));
        columns.push(match numbered {
            Some(numbered) if taken(name) => Column::Gains(numbered, *pdff),
            _ => column,
        });
    }
    if columns.len() > MOST_COLUMNS {
        return Err(CliError::Usage(format!(
            "{} columns are too many for one table: at most {MOST_COLUMNS}",
            columns.len()
        )));
    }
    Ok(columns)
}

/// What files of a column are called, each another.
fn stems(scenario: &Scenario, columns: &[Column]) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for column in columns {
        let name: Vec<char> = column.name().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
        // A typed path may be long: its end tells more than its beginning.
        let of: String = name[name.len().saturating_sub(60)..].iter().collect();
        let plain = format!("{}-{}", scenario.name, of.trim_matches('-'));
        let mut stem = plain.clone();
        let mut number = 2;
        while stems.iter().any(|other| other.to_lowercase() == stem.to_lowercase()) {
            stem = format!("{plain}-{number}");
            number += 1;
        }
        stems.push(stem);
    }
    stems
}

/// The whole scenario in every column, laid over each other.
fn plots(
    args: &CompareArgs,
    scenario: &Scenario,
    columns: &[Column],
    stop: &AtomicBool,
) -> Result<Vec<PathBuf>, CliError> {
    let Some(format) = args.out.plots.format() else { return Ok(Vec::new()) };
    make_folder(&args.out.folder)?;
    let mut written = Vec::new();
    let mut runs = Vec::new();
    for (column, stem) in columns.iter().zip(stems(scenario, columns)) {
        let mut variant = column.of(scenario);
        variant.name = stem;
        let path = args.out.folder.join(format!("{}.mcap", variant.name));
        let metadata = RecordingMetadata::new(&variant.name, &variant.source).with_drives(&variant.drives);
        let mut recorder = Recorder::create_as(&path, metadata, args.record.options())?;
        let mut observers: Vec<&mut dyn Observer<2>> = vec![&mut recorder];
        let summary = match variant.run_until(Some(stop), &mut observers) {
            Ok(summary) => summary,
            // The table says so.
            Err(SimulationError::Diverged { .. }) => continue,
            Err(error) => return Err(error.into()),
        };
        if !summary.complete {
            return Err(CliError::Stopped("the plots were drawn; the table is whole"));
        }
        recorder.finish(&summary)?;
        let mut data = recorded(&path, Some(stop))?;
        if columns.len() > 1 {
            column.name().clone_into(&mut data.metadata_mut().name);
        }
        runs.push(data);
        written.push(path);
    }
    if !runs.is_empty() {
        written.extend(report::write_all(&runs, &args.out.folder, &format!("{}-compared", scenario.name), format)?);
    }
    Ok(written)
}

/// What a person should know beside the table.
fn remarks(scenario: &Scenario, columns: &[Column], comparison: &Comparison) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    for line in broken(comparison) {
        let _ = writeln!(out, "\n  {line}");
    }
    if scenario.corrections_mm.is_some() && columns.iter().any(|column| *column != Column::Own) {
        let _ = writeln!(
            out,
            "\n  with compensation: every column has the learned corrections, which belong to the gains that they were learned with"
        );
    }
    for column in columns {
        let without: Vec<&str> = (0..2)
            .filter(|&axis| scenario.drives[axis].zero_phase && !column.of(scenario).drives[axis].zero_phase)
            .map(|axis| AXIS_NAMES[axis])
            .collect();
        if !without.is_empty() {
            let _ = writeln!(
                out,
                "\n  {}: without the zero-phase tracking of {}, which undoes the PDFF loop",
                printable(column.name()),
                without.join(" and ")
            );
        }
    }
    if comparison.lines.len() == 1 && columns.len() == 1 {
        out.push_str(
            "\n  nothing to compare: the axes are what their models say. See `servosim compare alpha-real` for detailed drives; \
             or give\n  --controllers pdff,p-pi,pid,cascade, or --gains SCENARIO\n",
        );
    }
    out
}

/// What makes the program exit with 3.
fn broken(comparison: &Comparison) -> Vec<String> {
    let mut out = Vec::new();
    for (k, column) in comparison.columns.iter().enumerate() {
        let column = printable(column);
        let of = |pick: &dyn Fn(&Option<Cell>) -> bool| -> Vec<&str> {
            let lines = comparison.lines.iter().filter(|line| line.runs.get(k).is_some_and(pick));
            lines.map(|line| line.drives.as_str()).collect()
        };
        let lost = of(&|run| run.is_none_or(|cell| cell.locked_up));
        if !lost.is_empty() {
            out.push(format!("{column}: locked up or diverged with {}", lost.join(", ")));
        } else if let Some(Some(Some(cell))) = comparison.lines.last().map(|line| line.runs.get(k))
            && !cell.passed
        {
            let last = comparison.lines.last().map_or("", |line| line.drives.as_str());
            out.push(format!("{column}: breaks a limit of the scenario ({last}); `servosim run` says which"));
        }
    }
    out
}
