//! What is drawn of a run, read back from its recording.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::RunError;
use crate::feedrate::{Motion, Profile, optimize_n_c};
use crate::recording::{Recording, Sample, Third};
use crate::report::{AxisLoads, PlotSample, RunData, RunMetadata};
use crate::scenario::{Document, FeedProfile, Scenario};

/// Everything of a recording that is drawn: its samples, and what its attached scenario planned.
///
/// A raised `stop` ends it: a long recording takes seconds to read.
///
/// # Errors
/// The file cannot be read or is no recording; `stop` was raised.
pub fn recorded(path: &Path, stop: Option<&AtomicBool>) -> Result<RunData, RunError> {
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
        if is_stopped() { RunError::PlotsInterrupted { recording: path.to_owned() } } else { error.into() }
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
        assert!(recorded(&file, Some(&AtomicBool::new(false))).is_ok());
        let error = recorded(&file, Some(&AtomicBool::new(true))).err().unwrap();
        assert!(error.to_string().contains("a.mcap is whole"), "{error}");
    }
}
