//! The run of a scenario.

use std::sync::atomic::AtomicBool;

use super::error::RunError;
use super::files::{make_folder, write_layout};
use super::request::{RunReport, RunRequest, Stage, Watch};
use crate::analysis::DriveLoop;
use crate::comparison::{Column, Comparison};
use crate::parameters::AXIS_NAMES;
use crate::recording::{Recorder, RecordingMetadata};
use crate::scenario::Scenario;
use crate::simulation::{Ending, Observer};

/// What a control period takes in a recording, about \[bytes\], and what the drive signals take beside it.
const BYTES_A_SAMPLE: u64 = 311;
const BYTES_A_SAMPLE_OF_DRIVES: u64 = 212;

/// Up to so many samples the effects of the drives are run one by one too.
const MOST_COMPARED: u64 = 1_000_000;

/// Samples of the run, and about how many bytes its recording takes: before anything is run.
///
/// # Errors
/// Drives that cannot be simulated.
pub fn recording_bytes(scenario: &Scenario, request: &RunRequest) -> Result<(u64, u64), RunError> {
    let samples = scenario.simulation()?.samples();
    let of_drives = if scenario.is_model() { 0 } else { BYTES_A_SAMPLE_OF_DRIVES };
    Ok((samples, (samples / request.recording.every.max(1)).saturating_mul(BYTES_A_SAMPLE + of_drives)))
}

/// Runs a scenario, records it as `NAME.mcap` with `NAME.layout.json` for a viewer, and draws its plots.
///
/// A raised `stop` ends the run in order: what is recorded by then is kept as `NAME.mcap.partial`.
///
/// # Errors
/// A name that is none, a folder or recording that cannot be written, a simulation that fails. Plots that fail are no error:
/// [`RunReport::plots_error`].
pub fn run_scenario(
    scenario: &Scenario,
    request: &RunRequest,
    stop: &AtomicBool,
    watch: &mut dyn Watch<2>,
) -> Result<RunReport, RunError> {
    let stem = request.stem(&scenario.name)?;
    make_folder(&request.folder)?;
    let simulation = scenario.simulation()?;
    let samples = simulation.samples();
    let recording = request.folder.join(format!("{stem}.mcap"));
    let replaced = recording.is_file();
    let metadata = RecordingMetadata::new(&stem, &scenario.source).with_drives(&scenario.drives);
    let mut recorder = Recorder::create_as(&recording, metadata, request.recording)?;
    let file_name = recording.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut metrics = scenario.summary_observer().with_recording(file_name);
    watch.stage(Stage::Simulating);
    let mut observers: Vec<&mut dyn Observer<2>> = vec![&mut metrics, &mut recorder, watch];
    let ending = simulation.run(&scenario.limits, Some(stop), &mut observers)?;
    let summary = metrics.summary();
    let mut report = RunReport {
        summary,
        interrupted: ending == Ending::Interrupted,
        recording,
        replaced,
        written: Vec::new(),
        removed: Vec::new(),
        plots_error: None,
        effects: None,
        unstable_axes: Vec::new(),
    };
    if request.compare_effects
        && samples <= MOST_COMPARED
        && (!scenario.is_model() || scenario.corrections_mm.is_some())
    {
        watch.stage(Stage::ComparingEffects);
        report.effects = Comparison::until(stop, scenario, &[Column::Own]).ok().flatten();
    }
    if report.interrupted {
        if let Some(partial) = recorder.interrupted(&report.summary)?.path {
            report.recording = partial;
        }
        return Ok(report);
    }
    let saved = recorder.finish(&report.summary)?;
    report.written.push(report.recording.clone());
    report.written.push(write_layout(&request.folder, &stem, &saved.layout)?);
    draw(&mut report, request, &stem, stop, || watch.stage(Stage::Drawing));
    let loops = AXIS_NAMES.into_iter().zip(scenario.axes.iter().zip(&scenario.drives));
    report.unstable_axes = loops
        .filter(|(_, (axis, drive))| DriveLoop::new(axis, drive, &scenario.settings).is_ok_and(|of| !of.is_stable()))
        .map(|(name, _)| name)
        .collect();
    Ok(report)
}

/// Draws the plots of the recording, as `servosim plot` does: what is seen is what was recorded. Plots that show another run go.
#[cfg(feature = "plots")]
pub(super) fn draw(report: &mut RunReport, request: &RunRequest, stem: &str, stop: &AtomicBool, begin: impl FnOnce()) {
    // Before drawing: what fails half way leaves plots of this run only.
    let removed = super::files::remove_plots(&request.folder, stem);
    let mut plots = Vec::new();
    if let Some(format) = request.plots {
        begin();
        let drawn = super::recorded(&report.recording, Some(stop))
            .and_then(|data| Ok(crate::report::write_all(&[data], &request.folder, stem, format)?));
        match drawn {
            Ok(files) => plots = files,
            Err(error) => report.plots_error = Some(error),
        }
    }
    report.removed = removed.into_iter().filter(|file| !file.exists()).collect();
    report.written.extend(plots);
}

/// Without the feature `plots` nothing is drawn.
#[cfg(not(feature = "plots"))]
pub(super) fn draw(_: &mut RunReport, _: &RunRequest, _: &str, _: &AtomicBool, _: impl FnOnce()) {}
