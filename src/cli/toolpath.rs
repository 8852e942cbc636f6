//! `servosim toolpath`: a part's tool path, its NC program, and what the program leaves of the part.

use std::path::{Path, PathBuf};

use crate::machining::{Inspection, PartMetrics, ProgramStatistics};
use crate::nc::Reader;
use crate::report::write_file;
use crate::run::RunError;
use crate::scenario::{Document, Part, PlannedProgram, ToolPathSummary};
use clap::Args;

use super::output::{OutputArgs, make_folder, note, wrote};
use super::progress::Stages;
use super::{CliError, Outcome, part_table, table};

/// Arguments of `servosim toolpath`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim toolpath patch.toml
  servosim toolpath patch --set toolpath.tolerance_mm=0.01 --set program.dialect=fanuc
  servosim toolpath island.toml --output nc --format json

PART is looked for as a file, then in the folder scenarios, then among the built-in ones (patch, island). The \
program is OUTPUT/NAME.nc; beside it NAME.part.toml keeps the part as it was, for `servosim run OUTPUT/NAME.nc`.")]
pub(crate) struct ToolpathArgs {
    /// Part file, or name of a built-in part
    part: String,
    /// Replace one value of the part, such as toolpath.fit=paper (may be given again)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Plans, writes, checks and draws.
pub(crate) fn run(args: &ToolpathArgs) -> Result<Outcome, CliError> {
    let mut document = Document::find_part(&args.part)?;
    for key_value in &args.set {
        document.set(key_value)?;
    }
    let part = document.part()?;
    make_folder(&args.out.folder)?;
    let stages = Stages::new(args.out.print.is_watched());
    stages.begin("planning the tool path");
    let path = part.tool_path()?;
    stages.begin("writing the program");
    let program = PlannedProgram::new(&part, &path)?;
    let file = args.out.folder.join(format!("{}.nc", part.name));
    let mut written = vec![file.clone()];
    write_file(&file, program.text.as_bytes())?;
    written.extend(write_beside(&document, &part, &args.out.folder)?);

    stages.begin("cutting the part");
    // What is checked is what stands in the file.
    let blocks = || Reader::new(program.text.as_bytes(), file.display().to_string(), part.reading());
    let statistics = ProgramStatistics::of(blocks(), &part.machine).map_err(|error| RunError::program(&file, error))?;
    let inspection =
        Inspection::new(&*part.surface, part.cutter, &part.region, part.options.tolerance_mm, part.cell_mm)
            .map_err(|error| RunError::inspection(&file, error))?;
    let map = inspection.nominal(blocks()).map_err(|error| RunError::inspection(&file, error))?;
    let nominal = PartMetrics::of(&map, part.options.scallop_mm, part.options.tolerance_mm);
    let summary = ToolPathSummary::new(&part, &path, &program, &statistics, nominal);
    drop(stages);
    if let Some(format) = args.out.plots.format() {
        written.extend(crate::run::pictures::of_path(&part, &path, &inspection, &summary).write(
            &args.out.folder,
            &part.name,
            format,
        )?);
        let maps = [("nominal", &map, &summary.nominal)];
        written.extend(crate::run::pictures::of_maps(&part, &maps, |picture| {
            picture.write(&args.out.folder, &part.name, format)
        })?);
    }
    args.out.print.show(&summary, || part_table::tool_path(&summary))?;
    args.out.print.note(&wrote(&written));
    for remark in &program.remarks {
        args.out.print.note(&format!("note: {remark}"));
    }
    if summary.passed() {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        note(&table::broken(&summary.limits).join("\n"));
    }
    Ok(Outcome::Broken)
}

/// Keeps the part as it was beside its program, with its mesh, so that the program can be run and checked by itself.
fn write_beside(document: &Document, part: &Part, folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mesh_file = format!("{}.stl", part.name);
    let (text, mesh) = document.portable_part(&part.name, &mesh_file)?;
    let mut written = Vec::new();
    if let Some(bytes) = mesh {
        let file = folder.join(mesh_file);
        write_file(&file, &bytes)?;
        written.push(file);
    }
    let file = folder.join(format!("{}.part.toml", part.name));
    write_file(&file, text.as_bytes())?;
    written.push(file);
    Ok(written)
}
