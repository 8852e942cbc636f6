//! The run of an NC program: through the machine of its part, and the part that comes of it.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::error::RunError;
use super::files::{make_folder, write_layout};
use super::request::{RunReport, RunRequest, Stage, Watch};
use super::scenario::draw;
use crate::analysis::DriveLoop;
use crate::limits::LimitCheck;
use crate::machining::{DeviationMap, Inspection, MachinedPart, PartMetrics, ProgramRun, ProgramStatistics};
use crate::nc::{Reader, Reading};
use crate::parameters::AXIS_NAMES;
use crate::recording::{Recorder, RecordingMetadata};
use crate::scenario::Part;
use crate::simulation::{Ending, Observer};
use crate::summary::SummaryObserver;

/// Endings of the names of NC programs.
const ENDINGS: [&str; 13] = ["nc", "ngc", "mpf", "spf", "tap", "cnc", "gcode", "gc", "g", "eia", "min", "ncp", "iso"];

/// Whether the name is that of an NC program.
pub fn is_program(name: &str) -> bool {
    Path::new(name)
        .extension()
        .and_then(|ending| ending.to_str())
        .is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// A program and the machine that runs it.
#[derive(Debug)]
pub struct Program<'a> {
    /// The file; it is read a block at a time, and more than once.
    pub file: &'a Path,
    /// The part that it belongs to, or one whose machine runs it.
    pub part: &'a Part,
    /// Whether the part itself is cut and looked at: not where only its machine runs the program.
    pub with_part: bool,
}

impl Program<'_> {
    /// How it is read: a program of a part is in the part's dialect.
    fn reading(&self) -> Reading {
        if self.with_part { self.part.reading() } else { Reading::default() }
    }

    fn open(&self) -> Result<Reader<BufReader<File>>, RunError> {
        let file = self.file;
        let opened = File::open(file).map_err(|source| RunError::NoProgram { path: file.to_owned(), source })?;
        if opened.metadata().is_ok_and(|meta| meta.is_dir()) {
            return Err(RunError::NoProgram { path: file.to_owned(), source: io::ErrorKind::IsADirectory.into() });
        }
        Ok(Reader::new(BufReader::with_capacity(1 << 16, opened), file.display().to_string(), self.reading()))
    }
}

/// What stands in the program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProgramMetrics {
    /// Name of the file.
    pub file: String,
    /// Blocks of rapid motion.
    pub rapid_blocks: u64,
    /// Straight blocks at the feed.
    pub straight_blocks: u64,
    /// Arcs.
    pub arcs: u64,
    /// NURBS curves.
    pub nurbs: u64,
    /// Their control points.
    pub control_points: u64,
    /// Length at the feed.
    pub feed_length_mm: f64,
    /// Length of the rapid motion.
    pub rapid_length_mm: f64,
    /// Time of the dwells.
    pub dwell_s: f64,
}

/// The part as the program has it and as it is cut.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartPair {
    /// As the program has it.
    pub nominal: PartMetrics,
    /// As it is cut.
    pub as_cut: PartMetrics,
    /// Largest difference of the two, cell by cell, either way.
    pub largest_difference_um: f64,
    /// The limits that the part is held to.
    pub limits: Vec<LimitCheck>,
}

/// The maps that the metrics of a part are of.
#[derive(Debug)]
pub struct PartMaps {
    /// Of the part as the program has it.
    pub nominal: DeviationMap,
    /// Of the part as it is cut.
    pub as_cut: DeviationMap,
}

/// What is left of the run of a program.
#[derive(Debug)]
#[non_exhaustive]
pub struct ProgramReport {
    /// As of any run.
    pub run: RunReport,
    /// What stands in the program.
    pub program: ProgramMetrics,
    /// The part, where it was looked at and the run was not stopped.
    pub part: Option<(PartPair, PartMaps)>,
}

impl ProgramReport {
    /// Whether every limit of the run and of the part is kept and no axis locked up.
    pub fn passed(&self) -> bool {
        self.run.passed() && self.part.iter().all(|(pair, _)| pair.limits.iter().all(|check| check.kept))
    }
}

/// Runs a program, records it, compares the part as programmed and as cut with its surface, and draws plots.
///
/// # Errors
/// As [`run_scenario`](super::run_scenario); a program that cannot be read or run, a part that cannot be looked at.
pub fn run_program(
    program: &Program<'_>,
    request: &RunRequest,
    stop: &AtomicBool,
    watch: &mut dyn Watch<3>,
) -> Result<ProgramReport, RunError> {
    let Program { file, part, with_part } = *program;
    let own = file.file_stem().map_or_else(|| "program".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let stem = request.stem(&own)?;
    let wrong = |error| RunError::program(file, error);
    let statistics = ProgramStatistics::of(program.open()?, &part.machine).map_err(wrong)?;
    if statistics.length_mm == 0.0 && statistics.dwell_s == 0.0 {
        return Err(RunError::NoMotion { path: file.to_owned() });
    }
    make_folder(&request.folder)?;
    let inspection = with_part
        .then(|| Inspection::new(&*part.surface, part.cutter, &part.region, part.options.tolerance_mm, part.cell_mm))
        .transpose()
        .map_err(|error| RunError::inspection(file, error))?;

    let recording = request.folder.join(format!("{stem}.mcap"));
    let replaced = recording.is_file();
    let metadata = RecordingMetadata::new(&stem, &part.source).with_drives(&part.drives);
    let mut recorder = Recorder::create_as(&recording, metadata, request.recording)?;
    let file_name = recording.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut metrics = SummaryObserver::<3>::new(own.as_str()).with_recording(file_name);
    let mut cut = inspection.as_ref().map(Inspection::part);
    watch.stage(Stage::Simulating);
    let mut observers: Vec<&mut dyn Observer<3>> = vec![&mut metrics, &mut recorder, &mut *watch];
    if let Some(cut) = &mut cut {
        observers.push(cut);
    }
    let drives = Some((&part.drives, part.cross_coupling.as_ref()));
    let simulation = ProgramRun::with_drives(program.open()?, &part.machine, drives).map_err(wrong)?;
    let ending = simulation.run(&statistics, &part.limits, Some(stop), &mut observers).map_err(wrong)?;
    let mut run = RunReport {
        summary: metrics.summary(),
        interrupted: ending == Ending::Interrupted,
        recording,
        replaced,
        written: Vec::new(),
        removed: Vec::new(),
        plots_error: None,
        effects: None,
        unstable_axes: Vec::new(),
    };
    let program_metrics = of_program(file, &statistics);
    if run.interrupted {
        if let Some(partial) = recorder.interrupted(&run.summary)?.path {
            run.recording = partial;
        }
        return Ok(ProgramReport { run, program: program_metrics, part: None });
    }
    let saved = recorder.finish(&run.summary)?;
    run.written.push(run.recording.clone());
    run.written.push(write_layout(&request.folder, &stem, &saved.layout)?);
    let maps = match (&inspection, cut) {
        (Some(inspection), Some(cut)) => {
            watch.stage(Stage::CuttingNominalPart);
            let nominal = inspection.nominal(program.open()?).map_err(|error| RunError::inspection(file, error))?;
            Some(PartMaps { nominal, as_cut: MachinedPart::map(cut) })
        }
        _ => None,
    };
    let compared = maps.map(|maps| (compared(part, &maps), maps));
    draw(&mut run, request, &stem, stop, || watch.stage(Stage::Drawing));
    if let Some((pair, maps)) = &compared
        && run.plots_error.is_none()
    {
        match draw_maps(request, &stem, part, pair, maps) {
            Ok(files) => run.written.extend(files),
            Err(error) => run.plots_error = Some(error),
        }
    }
    let loops = AXIS_NAMES.into_iter().zip(part.machine.axes.iter().zip(&part.drives));
    run.unstable_axes = loops
        .filter(|(_, (axis, drive))| {
            DriveLoop::new(axis, drive, &part.machine.settings).is_ok_and(|of| !of.is_stable())
        })
        .map(|(name, _)| name)
        .collect();
    Ok(ProgramReport { run, program: program_metrics, part: compared })
}

/// The part as the program has it beside the part as it is cut.
fn compared(part: &Part, maps: &PartMaps) -> PartPair {
    let of = |map| PartMetrics::of(map, part.options.scallop_mm, part.options.tolerance_mm);
    let (before, after) = (of(&maps.nominal), of(&maps.as_cut));
    let limits = &part.part_limits;
    let names = ["nominal_scallop_um", "nominal_gouge_um"];
    let mut checks = before.check(names, limits.nominal_scallop_um, limits.nominal_gouge_um);
    let names = ["as_cut_scallop_um", "as_cut_gouge_um"];
    checks.extend(after.check(names, limits.as_cut_scallop_um, limits.as_cut_gouge_um));
    let difference = maps.as_cut.minus(&maps.nominal).and_then(|map| map.metrics(0.0..=0.0).worst());
    PartPair {
        nominal: before,
        as_cut: after,
        largest_difference_um: difference.map_or(0.0, |place| place.value_um.abs()),
        limits: checks,
    }
}

#[cfg(feature = "plots")]
fn draw_maps(
    request: &RunRequest,
    stem: &str,
    part: &Part,
    pair: &PartPair,
    maps: &PartMaps,
) -> Result<Vec<PathBuf>, RunError> {
    let Some(format) = request.plots else { return Ok(Vec::new()) };
    let maps = [("nominal", &maps.nominal, &pair.nominal), ("as cut", &maps.as_cut, &pair.as_cut)];
    Ok(super::pictures::of_maps(part, &maps, |picture| picture.write(&request.folder, stem, format))?)
}

#[cfg(not(feature = "plots"))]
#[allow(clippy::unnecessary_wraps)] // the signature with plots
fn draw_maps(_: &RunRequest, _: &str, _: &Part, _: &PartPair, _: &PartMaps) -> Result<Vec<PathBuf>, RunError> {
    Ok(Vec::new())
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
