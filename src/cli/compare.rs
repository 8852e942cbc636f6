//! `servosim compare`: one scenario in many variants, side by side.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use servosim::comparison::{Cell, Column, Comparison};
use servosim::recording::{Facts, Recorder};
use servosim::report;
use servosim::scenario::{Document, Scenario};
use servosim::servo::ControllerKind;
use servosim::simulation::Observer;

use super::output::{OutputArgs, figure, make_folder, printable};
use super::{CliError, Outcome, plot};

/// Most columns of a table.
const MOST_COLUMNS: usize = 12;

/// Arguments of `servosim compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim compare alpha-real                                     each effect of its drives alone, and all of them
  servosim compare alpha --controllers pdff,p-pi,pid,cascade      the same loops under other controllers
  servosim compare alpha-real --gains output/alpha-tuned.toml     do tuned gains stand the drive as it is?

Rows are what the drives do: the model alone, each effect of the scenario alone, all of them, all with its remedies. Columns are
how the axes are controlled. A cell is the largest contouring error of a whole run. The runs of the last row are laid over each other
in plots.")]
pub(crate) struct CompareArgs {
    /// Scenario file, or name of a built-in scenario
    scenario: String,
    /// Controllers, each a column; gains that the scenario does not give are those of the same loops
    #[arg(long, value_name = "KIND,…", value_enum, value_delimiter = ',')]
    controllers: Vec<Kind>,
    /// A scenario whose PDFF gains become one more column (may be given again)
    #[arg(long, value_name = "SCENARIO")]
    gains: Vec<String>,
    /// Replace one value of the scenario, such as axes.x.pdff.kpp=120 (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
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
    for name in &args.gains {
        let other = Document::find(name)?.scenario()?;
        columns.push(Column::Gains(other.name.clone(), other.axes.map(|axis| axis.pdff)));
    }
    if columns.len() > MOST_COLUMNS {
        return Err(CliError::Usage(format!(
            "{} columns are too many for one table: at most {MOST_COLUMNS}",
            columns.len()
        )));
    }
    let comparison = Comparison::of(&scenario, &columns)?;
    let written = if args.out.plots.format().is_some() { plots(args, &scenario, &columns) } else { Ok(Vec::new()) };
    args.out.print.show(&comparison, || table(&comparison))?;
    let written = written?;
    if !written.is_empty() {
        args.out.print.note(&plot::wrote(&written));
    }
    Ok(Outcome::Fine)
}

/// The whole scenario in every column, laid over each other.
fn plots(args: &CompareArgs, scenario: &Scenario, columns: &[Column]) -> Result<Vec<PathBuf>, CliError> {
    let Some(format) = args.out.plots.format() else { return Ok(Vec::new()) };
    make_folder(&args.out.folder)?;
    let mut written = Vec::new();
    let mut runs = Vec::new();
    for column in columns {
        let mut variant = column.of(scenario);
        let of: String = column.name().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
        variant.name = format!("{}-{of}", scenario.name);
        let path = args.out.folder.join(format!("{}.mcap", variant.name));
        let mut recorder = Recorder::create(&path, Facts::new(&variant.name, &variant.source))?;
        let mut observers: Vec<&mut dyn Observer<2>> = vec![&mut recorder];
        let summary = variant.run(&mut observers)?;
        recorder.finish(&summary)?;
        runs.push(plot::load(&path, None)?);
        written.push(path);
    }
    written.extend(report::write_all(&runs, &args.out.folder, &format!("{}-compared", scenario.name), format)?);
    Ok(written)
}

/// The table for people, ending in a newline.
pub(crate) fn table(comparison: &Comparison) -> String {
    let mut out = format!("{}\n\n", printable(&comparison.scenario));
    errors(&mut out, comparison);
    out
}

/// Largest contouring errors, line by line.
pub(crate) fn errors(out: &mut String, comparison: &Comparison) {
    let cell = |cell: &Option<Cell>| match cell {
        None => "diverged".to_owned(),
        Some(cell) if cell.locked_up => format!("{} locked", figure(cell.max_contour_error_um, 4)),
        Some(cell) => figure(cell.max_contour_error_um, 4),
    };
    let widths: Vec<usize> = (0..comparison.columns.len())
        .map(|k| {
            let cells = comparison.lines.iter().filter_map(|line| line.runs.get(k)).map(|run| cell(run).len());
            cells.chain([comparison.columns[k].chars().count()]).max().unwrap_or(0)
        })
        .collect();
    let head = "max contouring error";
    let mut line = |label: &str, cells: &mut dyn Iterator<Item = String>| {
        let _ = write!(out, "  {label:<20}");
        for (text, width) in cells.zip(&widths) {
            let _ = write!(out, "  {text:>width$}");
        }
        out.push_str(if label == head { "  µm\n" } else { "\n" });
    };
    line(head, &mut comparison.columns.iter().map(|name| printable(name)));
    for row in &comparison.lines {
        line(&row.drives, &mut row.runs.iter().map(cell));
    }
}
