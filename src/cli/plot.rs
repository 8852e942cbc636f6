//! `servosim plot`: plots of recordings, one or several laid over each other.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::feedrate::{Motion, Profile, optimize_n_c};
use crate::recording::{Recording, Sample, Third};
use crate::report::{self, AxisLoads, PlotSample, RunData, RunMetadata};
use crate::scenario::{Document, FeedProfile, Scenario};
use clap::{Args, ValueEnum};

use super::output::{make_folder, note};
use super::{CliError, Outcome};

/// Most runs that one plot takes.
const MOST_RUNS: usize = 16;

/// Arguments of `servosim plot`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  servosim plot output/alpha.mcap                     plots of one run
  servosim plot before/alpha.mcap after/alpha.mcap    two runs laid over each other
  servosim plot alpha heart --format png              output/alpha.mcap, output/heart.mcap")]
pub(crate) struct PlotArgs {
    /// Recordings: files, or names of recordings in the folder output
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Folder for the plots; created if it is missing
    #[arg(long, value_name = "DIR", default_value = "output")]
    output: PathBuf,
    /// Format of the plots
    #[arg(long, value_enum, default_value = "svg")]
    format: Format,
    /// Prefix of the plots' file names [default: the runs' names]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Do not list the files that were written
    #[arg(long, short)]
    quiet: bool,
}

/// Format of plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Svg,
    Png,
}

impl From<Format> for report::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Svg => Self::Svg,
            Format::Png => Self::Png,
        }
    }
}

/// Draws the plots.
pub(crate) fn run(args: &PlotArgs) -> Result<Outcome, CliError> {
    let count = args.recordings.len();
    if count > MOST_RUNS {
        return Err(CliError::Usage(format!("{count} recordings are too many for one plot: at most {MOST_RUNS}")));
    }
    let files: Vec<PathBuf> = args.recordings.iter().map(|name| find(name)).collect();
    let mut runs = files.iter().map(|file| load(file, None)).collect::<Result<Vec<_>, _>>()?;
    let stem = match &args.name {
        Some(name) => name.clone(),
        None => runs.iter().map(|run| run.metadata().name.as_str()).take(4).collect::<Vec<_>>().join("-vs-"),
    };
    tell_apart(&mut runs, &files);
    make_folder(&args.output)?;
    let written = report::write_all(&runs, &args.output, &stem, args.format.into())?;
    if !args.quiet {
        note(&wrote(&written));
    }
    Ok(Outcome::Fine)
}

/// "wrote a, b and c".
pub(crate) fn wrote(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    match names.as_slice() {
        [] => "wrote nothing".to_owned(),
        [one] => format!("wrote {one}"),
        [first @ .., last] => format!("wrote {} and {last}", first.join(", ")),
    }
}

/// The recording that is meant: a file of that name, else `NAME.mcap`, else `output/NAME.mcap`; the name itself where there
/// is none.
pub(crate) fn find(name: &Path) -> PathBuf {
    let mut with_ending = name.as_os_str().to_owned();
    with_ending.push(".mcap");
    let candidates = [name.to_owned(), with_ending.clone().into(), Path::new("output").join(with_ending)];
    candidates.iter().find(|path| path.is_file()).cloned().unwrap_or_else(|| name.to_owned())
}

/// Runs of the same name get that of their folder in front: `before/alpha` and `after/alpha`.
fn tell_apart(runs: &mut [RunData], files: &[PathBuf]) {
    let names: Vec<String> = runs.iter().map(|run| run.metadata().name.clone()).collect();
    for (i, (run, file)) in runs.iter_mut().zip(files).enumerate() {
        let is_shared = names.iter().enumerate().any(|(j, name)| j != i && *name == run.metadata().name);
        if is_shared && let Some(folder) = file.parent().and_then(Path::file_name) {
            let metadata = run.metadata_mut();
            metadata.name = format!("{}/{}", folder.to_string_lossy(), metadata.name);
        }
    }
}

/// Everything of a recording that is drawn.
///
/// A raised `stop` ends it: a long recording takes seconds to read.
pub(crate) fn load(path: &Path, stop: Option<&AtomicBool>) -> Result<RunData, CliError> {
    let mut data = RunData::new(RunMetadata::default());
    let is_stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
    let recording = Recording::read(path, |read| {
        if is_stopped() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        data.push(&sample(read));
        Ok(())
    })
    .map_err(|error| {
        if is_stopped() { CliError::PlotsInterrupted { recording: path.to_owned() } } else { error.into() }
    })?;
    *data.metadata_mut() = metadata(path, &recording);
    Ok(data)
}

fn sample(Sample { servo, third, .. }: &Sample) -> PlotSample {
    let Third { z, nearest_z_mm, rapid, .. } = third.unwrap_or_default();
    PlotSample {
        time_s: servo.time_s,
        s_mm: servo.path.s_mm,
        feed_mm_s: servo.path.feed_mm_s,
        accel_mm_s2: servo.path.accel_mm_s2,
        jerk_mm_s3: servo.path.jerk_mm_s3,
        command_mm: [servo.x.command_mm, servo.y.command_mm, z.command_mm],
        actual_mm: [servo.x.actual_mm, servo.y.actual_mm, z.actual_mm],
        nearest_mm: [servo.nearest.x_mm, servo.nearest.y_mm, nearest_z_mm],
        voltage_v: [servo.x.voltage_v, servo.y.voltage_v, z.voltage_v],
        contour_error_um: servo.contour_error_um,
        tracking_error_um: servo.tracking_error_um,
        rapid,
    }
}

fn metadata(path: &Path, recording: &Recording) -> RunMetadata {
    let planned = |key: &str| recording.plan.get(key).and_then(|text| text.parse::<f64>().ok());
    let stem = || path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let desired_path_mm = recording.desired_mm.clone();
    let mut metadata = RunMetadata {
        name: recording.run.get("name").cloned().unwrap_or_else(stem),
        period_s: planned("period_s").unwrap_or(0.0),
        three_axes: recording.axes > 2,
        voltage_limit_v: ["voltage_limit_x_v", "voltage_limit_y_v", "voltage_limit_z_v"]
            .map(|key| planned(key).unwrap_or(0.0)),
        closed: desired_path_mm.len() > 2 && desired_path_mm.first() == desired_path_mm.last(),
        desired_path_mm,
        warning: recording.cut_short.as_ref().map(|_| "the recording was cut short".to_owned()),
        ..RunMetadata::default()
    };
    if let Some(summary) = recording.summary() {
        metadata.locked_up = summary.lockup.is_some();
        metadata.warning = match (&summary.lockup, summary.complete) {
            (Some(lockup), _) => Some(lockup.clone()),
            (None, false) => Some("the run was interrupted".to_owned()),
            (None, true) => metadata.warning,
        };
        metadata.limits = summary.limits;
        metadata.peak_jerk_mm_s3 = Some(summary.peak_jerk_mm_s3);
        metadata.n_c = summary.n_c;
        metadata.n_c_search = summary.n_c_search;
    }
    let scenario =
        recording.scenario.as_deref().and_then(|text| Document::from_text(text, "recording").scenario().ok());
    if let Some(scenario) = &scenario {
        metadata.comparison = comparison(scenario);
        metadata.axis_loads = axis_loads(scenario);
    }
    metadata
}

/// The other of the paper's two profiles, along the same path in the same time: the plain quintic, or for a quintic the
/// exponential one with the lowest jerk. None for motions under axis limits or a feed override.
fn comparison(scenario: &Scenario) -> Option<(String, Motion)> {
    let (length_mm, feed) = (scenario.motion.length_mm(), scenario.feed_mm_s);
    if matches!(scenario.profile, FeedProfile::AxisLimited(_)) || !scenario.motion.overrides().is_empty() {
        return None;
    }
    if let FeedProfile::Phases(Profile::Quintic { phase_s }) = scenario.profile {
        let n_c = *optimize_n_c(feed, phase_s).ok()?.point.first()?;
        let motion = Motion::plan(length_mm, feed, Profile::Exponential { phase_s, n_c }).ok()?;
        return Some((format!("exponential, n_c = {n_c:.2}"), motion));
    }
    let phase_s = scenario.motion.phase_s();
    let motion = Motion::plan(length_mm, feed, Profile::Quintic { phase_s }).ok()?;
    Some(("plain quintic".to_owned(), motion))
}

/// What a motion under limits of the axes asks of them.
fn axis_loads(scenario: &Scenario) -> Option<AxisLoads> {
    match scenario.profile {
        FeedProfile::AxisLimited(limits) => Some(AxisLoads::of(&*scenario.path, &scenario.motion, limits)),
        FeedProfile::Phases(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_for_plots_can_be_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.mcap");
        let scenario = crate::scenario::Scenario::builtin("alpha").unwrap();
        let mut summary = scenario.summary_observer();
        let metadata = crate::recording::RecordingMetadata::new("a", &scenario.source);
        let mut recorder = crate::recording::Recorder::create(&file, metadata).unwrap();
        scenario.run(&mut [&mut summary, &mut recorder]).unwrap();
        recorder.finish(&summary.summary()).unwrap();
        assert!(load(&file, Some(&AtomicBool::new(false))).is_ok());
        let error = load(&file, Some(&AtomicBool::new(true))).err().unwrap();
        assert!(error.to_string().contains("a.mcap is whole"), "{error}");
    }
}
