//! `servosim run PROGRAM.nc`: a program through the machine, and the part that comes of it.

use crate::parameters::AXIS_NAMES;
use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use crate::analysis::DriveLoop;
use crate::limits::LimitCheck;
use crate::machining::{
    DeviationMap, Inspection, MachinedPart, PartMetrics, ProgramError, ProgramRun, ProgramStatistics,
};
use crate::nc::{Reader, Reading};
use crate::recording::{Recorder, RecordingMetadata};
use crate::scenario::{Document, Part};
use crate::simulation::{Ending, Observer};
use crate::summary::{Summary, SummaryObserver};
use serde::Serialize;

use super::output::{make_folder, note, printable, significant};
use super::part_table;
use super::progress::{Progress, Stages};
use super::run::{RunArgs, stop_flag};
use super::table::{self, limit_lines, section};
use super::toolpath::reading;
use super::{CliError, Outcome, pictures, plot};

/// Endings of the names of NC programs.
const ENDINGS: [&str; 13] = ["nc", "ngc", "mpf", "spf", "tap", "cnc", "gcode", "gc", "g", "eia", "min", "ncp", "iso"];

/// The part whose machine runs a program that comes alone.
const DEFAULT_PART: &str = "patch";

/// Whether the name is that of an NC program.
pub(crate) fn is_program(name: &str) -> bool {
    Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str())
        .is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// The metrics of a run: those of any run, and those of the program and the part.
#[derive(Debug, Serialize)]
struct ProgramSummary<'a> {
    #[serde(flatten)]
    run: &'a Summary,
    program: ProgramMetrics,
    part: Option<PartPair>,
}

/// What stands in the program.
#[derive(Debug, Serialize)]
struct ProgramMetrics {
    file: String,
    rapid_blocks: u64,
    straight_blocks: u64,
    arcs: u64,
    nurbs: u64,
    control_points: u64,
    feed_length_mm: f64,
    rapid_length_mm: f64,
    dwell_s: f64,
}

/// The part as the program has it and as it is cut.
#[derive(Debug, Serialize)]
struct PartPair {
    nominal: PartMetrics,
    as_cut: PartMetrics,
    /// Largest difference of the two, cell by cell, either way.
    largest_difference_um: f64,
    limits: Vec<LimitCheck>,
}

/// Runs the program.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, CliError> {
    let file = PathBuf::from(&args.scenario);
    let (part, comes_alone) = part_of(args, &file)?;
    let name = file.file_stem().map_or_else(|| "program".to_owned(), |stem| stem.to_string_lossy().into_owned());
    // The program is read a block at a time, and more than once.
    let how = if comes_alone { Reading::default() } else { reading(&part) };
    let open = || -> Result<Reader<BufReader<File>>, CliError> {
        let opened = File::open(&file).map_err(|source| CliError::NoProgram { path: file.clone(), source })?;
        if opened.metadata().is_ok_and(|meta| meta.is_dir()) {
            return Err(CliError::NoProgram { path: file.clone(), source: io::ErrorKind::IsADirectory.into() });
        }
        Ok(Reader::new(BufReader::with_capacity(1 << 16, opened), file.display().to_string(), how))
    };
    let stop = stop_flag();
    let wrong = |error: ProgramError| CliError::program(&file, error);
    let statistics = ProgramStatistics::of(open()?, &part.machine).map_err(wrong)?;
    if statistics.length_mm == 0.0 && statistics.dwell_s == 0.0 {
        return Err(CliError::Usage(format!(
            "{}: the program moves nothing\nhelp: it holds no G00, G01, G02, G03 or NURBS block that leads anywhere",
            file.display()
        )));
    }
    make_folder(&args.out.folder)?;
    let inspection = if comes_alone {
        None
    } else {
        Some(
            Inspection::new(&*part.surface, part.cutter, &part.region, part.options.tolerance_mm, part.cell_mm)
                .map_err(|error| CliError::inspection(&file, error))?,
        )
    };

    let recording = args.out.folder.join(format!("{name}.mcap"));
    let mut recorder = Recorder::create(&recording, RecordingMetadata::new(&name, &part.source))?;
    let recording_name = recording.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut metrics = SummaryObserver::<3>::new(name.as_str()).with_recording(recording_name);
    let mut progress = Progress::new(args.out.print.is_watched());
    let mut cut = inspection.as_ref().map(Inspection::part);
    let mut observers: Vec<&mut dyn Observer<3>> = vec![&mut metrics, &mut recorder, &mut progress];
    if let Some(cut) = &mut cut {
        observers.push(cut);
    }
    let drives = Some((&part.drives, part.cross_coupling.as_ref()));
    let simulation = ProgramRun::with_drives(open()?, &part.machine, drives).map_err(wrong)?;
    let ending = simulation.run(&statistics, &part.limits, Some(&stop), &mut observers).map_err(wrong)?;
    progress.finish();
    let summary = metrics.summary();
    if ending == Ending::Interrupted {
        let saved = recorder.interrupted(&summary)?.path.unwrap_or(recording);
        let time_s = summary.samples.saturating_sub(1) as f64 * summary.period_s;
        return Err(CliError::Interrupted { time_s, recording: saved });
    }
    recorder.finish(&summary)?;
    let mut written = vec![recording];
    let maps = match (&inspection, cut) {
        (Some(inspection), Some(cut)) => {
            let stages = Stages::new(args.out.print.is_watched());
            stages.begin("cutting the part as the program has it");
            let nominal = inspection.nominal(open()?).map_err(|error| CliError::inspection(&file, error))?;
            Some((nominal, MachinedPart::map(cut)))
        }
        _ => None,
    };
    let pair = maps.as_ref().map(|(nominal, as_cut)| compared(&part, nominal, as_cut));
    let summary = ProgramSummary { run: &summary, program: of_program(&file, &statistics), part: pair };
    args.out.print.show(&summary, || table(&summary))?;
    if let Some(format) = args.out.plots.format() {
        let data = plot::load(&written[0], Some(&stop))?;
        written.extend(crate::report::write_all(&[data], &args.out.folder, &name, format)?);
        if let (Some((nominal, as_cut)), Some(pair)) = (&maps, &summary.part) {
            let maps = [("nominal", nominal, &pair.nominal), ("as cut", as_cut, &pair.as_cut)];
            written.extend(pictures::of_maps(&part, &maps, |picture| picture.write(&args.out.folder, &name, format))?);
        }
    }
    if !args.out.print.quiet {
        note(&plot::wrote(&written));
        if comes_alone {
            note(&format!(
                "note: no part file beside the program: it ran on the machine of the built-in part `{DEFAULT_PART}`, and no part was looked at; --part FILE names one"
            ));
        }
        for warning in summary.run.warnings() {
            note(&format!("warning: {warning}"));
        }
        for ((axis, parameters), drive) in AXIS_NAMES.iter().zip(&part.machine.axes).zip(&part.drives) {
            if DriveLoop::new(parameters, drive, &part.machine.settings).is_ok_and(|of| !of.is_stable()) {
                note(&format!("note: the loop of axis {axis} is unstable, even if this run does not show it"));
            }
        }
    }
    let broken: Vec<String> = summary.part.iter().flat_map(|pair| table::broken(&pair.limits)).collect();
    if summary.run.passed() && broken.is_empty() {
        return Ok(Outcome::Fine);
    }
    if args.out.print.has_no_table() {
        let run = table::failures(summary.run);
        note([vec![run], broken].concat().join("\n").trim_start());
    }
    Ok(Outcome::Broken)
}

/// The part as the program has it beside the part as it is cut.
fn compared(part: &Part, nominal: &DeviationMap, as_cut: &DeviationMap) -> PartPair {
    let of = |map| PartMetrics::of(map, part.options.scallop_mm, part.options.tolerance_mm);
    let (before, after) = (of(nominal), of(as_cut));
    let limits = &part.part_limits;
    let names = ["nominal_scallop_um", "nominal_gouge_um"];
    let mut checks = before.check(names, limits.nominal_scallop_um, limits.nominal_gouge_um);
    let names = ["as_cut_scallop_um", "as_cut_gouge_um"];
    checks.extend(after.check(names, limits.as_cut_scallop_um, limits.as_cut_gouge_um));
    let difference = as_cut.minus(nominal).and_then(|map| map.metrics(0.0..=0.0).worst());
    PartPair {
        nominal: before,
        as_cut: after,
        largest_difference_um: difference.map_or(0.0, |place| place.value_um.abs()),
        limits: checks,
    }
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

fn of_program(file: &Path, statistics: &ProgramStatistics) -> ProgramMetrics {
    ProgramMetrics {
        file: file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        rapid_blocks: statistics.blocks.rapid,
        straight_blocks: statistics.blocks.linear,
        arcs: statistics.blocks.arc,
        nurbs: statistics.blocks.nurbs,
        control_points: statistics.blocks.control_points,
        feed_length_mm: statistics.feed_length_mm,
        rapid_length_mm: statistics.rapid_length_mm,
        dwell_s: statistics.dwell_s,
    }
}

fn table(summary: &ProgramSummary<'_>) -> String {
    let mut out = format!("{}\n\n", printable(&summary.run.scenario));
    let program = &summary.program;
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
    if let Some(pair) = &summary.part {
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
