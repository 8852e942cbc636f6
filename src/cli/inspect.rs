//! `servosim inspect FILE`: what a recording holds.
//!
//! Exit codes: 0 the file was read, even where it ends early (a note on standard error says so, and `"complete"` in the
//! JSON); 1 it is not a recording, or damaged; 2 it cannot be opened.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::recording::{LogLevel, ReadError, Recording, csv};

use super::output::significant;
use super::{CliError, Outcome};

/// Arguments of `servosim inspect`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  servosim inspect output/alpha.mcap          what the recording holds
  servosim inspect alpha --csv > alpha.csv    every sample, for a spreadsheet
  servosim inspect alpha --format json | jq .summary
                                              the metrics of the run")]
pub(crate) struct InspectArgs {
    /// The recording: a file (.mcap, or the .mcap.partial of an interrupted run), or the name of one in the folder output
    #[arg(value_name = "RECORDING")]
    file: PathBuf,
    /// Form of the summary: text, or one JSON object
    #[arg(long, value_enum, default_value_t = InspectFormat::Text, conflicts_with = "csv")]
    format: InspectFormat,
    /// Write every sample as CSV to standard output instead: the signals of /servo and /drives
    #[arg(long)]
    csv: bool,
}

/// How the contents are summarised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum InspectFormat {
    Text,
    Json,
}

/// Reads the recording and tells what it holds.
pub(crate) fn run(args: &InspectArgs) -> Result<Outcome, CliError> {
    inspect(args, &mut io::stdout().lock(), &mut io::stderr().lock()).map(|()| Outcome::Fine)
}

/// Writes what the recording holds to `out`; a note about a file that ends early goes to `notes`. A closed `out`
/// (`| head`) is no error.
fn inspect(args: &InspectArgs, out: &mut dyn Write, notes: &mut dyn Write) -> Result<(), CliError> {
    match write_contents(args, out, notes) {
        Err(CliError::Stdout(error) | CliError::Read(ReadError::Visitor(error))) => {
            if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(CliError::Stdout(error)) }
        }
        result => result,
    }
}

fn write_contents(args: &InspectArgs, out: &mut dyn Write, notes: &mut dyn Write) -> Result<(), CliError> {
    let file = super::plot::find(&args.file);
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let recording = if args.csv {
        let mut header_due = true;
        let result = Recording::read(&file, |sample| {
            if header_due {
                header_due = false;
                csv::write_header(&mut out, if sample.third.is_some() { 3 } else { 2 }, sample.drives.is_some())?;
            }
            csv::write_row(&mut out, sample)
        });
        if header_due && let Ok(recording) = &result {
            csv::write_header(&mut out, recording.axes, recording.drives).map_err(CliError::Stdout)?;
        }
        // What was read before the damage is worth having.
        out.flush().map_err(CliError::Stdout)?;
        result?
    } else {
        Recording::open(&file)?
    };
    match args.format {
        _ if args.csv => {}
        InspectFormat::Text => write_text(&mut out, &file, &recording).map_err(CliError::Stdout)?,
        InspectFormat::Json => {
            serde_json::to_writer_pretty(&mut out, &to_json(&file, &recording))
                .map_err(|error| CliError::Stdout(error.into()))?;
            writeln!(out).map_err(CliError::Stdout)?;
        }
    }
    out.flush().map_err(CliError::Stdout)?;
    if let Some(why) = &recording.cut_short {
        // A lost note is not worth failing for.
        let _ = writeln!(notes, "note: {} was cut short: {why}; {}", file.display(), samples(&recording));
    }
    Ok(())
}

/// "1201 samples", or "512 of 1201 samples".
fn samples(recording: &Recording) -> String {
    match recording.plan.get("samples") {
        Some(planned) if *planned != recording.samples.to_string() => {
            format!("{} of {planned} samples", recording.samples)
        }
        _ => format!("{} samples", recording.samples),
    }
}

fn write_text(out: &mut dyn Write, file: &Path, recording: &Recording) -> io::Result<()> {
    let fact = |key: &str| recording.run.get(key).map_or("unknown", String::as_str);
    let mut row = |name: &str, text: &str| writeln!(out, "{name:<12} {text}");
    row("recording", &file.display().to_string())?;
    row("state", &state(recording))?;
    row("scenario", fact("name"))?;
    row("hash", fact("scenario_sha256"))?;
    row("version", &format!("servosim {}, seed {}", fact("version"), fact("seed")))?;
    row("units", fact("units"))?;
    let period = recording.plan.get("period_s").map(|period| format!(" every {period} s")).unwrap_or_default();
    row("samples", &format!("{}{period}", samples(recording)))?;
    if let Some((from, to)) = recording.time_range_s {
        row("time", &format!("{from:.4} s to {to:.4} s"))?;
    }
    for (i, topic) in recording.topics.iter().enumerate() {
        let name = if i == 0 { "topics" } else { "" };
        row(name, &format!("{:<8} {:<21} {:>9} messages", topic.topic, topic.schema, topic.messages))?;
    }
    for (i, attachment) in recording.attachments.iter().enumerate() {
        let name = if i == 0 { "attachments" } else { "" };
        row(name, &format!("{:<14} {:<17} {:>7} bytes", attachment.name, attachment.media_type, attachment.bytes))?;
    }
    match recording.summary() {
        Some(summary) => {
            row(
                "path",
                &format!(
                    "{:.3} mm in {:.3} s at up to {} mm/s",
                    summary.path_length_mm, summary.motion_time_s, summary.feed_mm_s
                ),
            )?;
            row(
                "contouring",
                &format!(
                    "at most {:.3} µm (at {:.3} s), rms {:.3} µm",
                    summary.max_contour_error_um, summary.max_contour_error_at_s, summary.rms_contour_error_um
                ),
            )?;
            row("tracking", &format!("at most {:.3} µm", summary.max_tracking_error_um))?;
            row(
                "voltage",
                &format!(
                    "at most {:.4} V, saturated {:.2} % of the time",
                    summary.peak_voltage_v,
                    100.0 * summary.saturated_share
                ),
            )?;
            for check in &summary.limits {
                let kept = if check.kept { "kept" } else { "broken" };
                row("limit", &format!("{} = {}: {kept} ({})", check.name, check.limit, significant(check.value, 5)))?;
            }
            if let Some(lockup) = &summary.lockup {
                row("lock-up", lockup)?;
            }
        }
        None if recording.summary_json.is_some() => row("summary", "of a form that this version does not know")?,
        None => row("summary", "none: it is written at the end of a run")?,
    }
    for (i, line) in recording.log.iter().enumerate() {
        let name = if i == 0 { "log" } else { "" };
        row(name, &format!("{:>9.4} s {:<8} {}", line.time_s, level(line.level), line.message))?;
    }
    Ok(())
}

fn state(recording: &Recording) -> String {
    match (&recording.cut_short, recording.summary()) {
        (Some(why), _) => format!("cut short: {why}"),
        (None, Some(summary)) if !summary.complete => "whole file of a run that was interrupted".to_owned(),
        (None, _) => "complete".to_owned(),
    }
}

fn level(level: LogLevel) -> &'static str {
    match level {
        LogLevel::Info => "info",
        LogLevel::Warning => "warning",
        LogLevel::Error => "error",
    }
}

fn to_json(file: &Path, recording: &Recording) -> Value {
    let topics: Vec<Value> = recording
        .topics
        .iter()
        .map(|t| json!({ "topic": t.topic, "schema": t.schema, "messages": t.messages }))
        .collect();
    let attachments: Vec<Value> = recording
        .attachments
        .iter()
        .map(|a| json!({ "name": a.name, "media_type": a.media_type, "bytes": a.bytes }))
        .collect();
    let log: Vec<Value> = recording
        .log
        .iter()
        .map(|l| json!({ "time_s": l.time_s, "level": level(l.level), "message": l.message }))
        .collect();
    json!({
        "recording": file.display().to_string(),
        "complete": recording.complete,
        "cut_short": recording.cut_short,
        "run": recording.run,
        "plan": recording.plan,
        "samples": recording.samples,
        "first_s": recording.time_range_s.map(|(first, _)| first),
        "last_s": recording.time_range_s.map(|(_, last)| last),
        "topics": topics,
        "attachments": attachments,
        "summary": recording.summary_json,
        "log": log,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::feedrate::{Motion, Profile};
    use crate::limits::Limits;
    use crate::path::Line;
    use crate::recording::{Recorder, RecordingMetadata};
    use crate::servo::{AxisParameters, Drive, LoopSettings, Pdff, Plant};
    use crate::simulation::Simulation;
    use crate::summary::SummaryObserver;

    /// A recording of a short line, and its bytes.
    fn recording(folder: &Path) -> (PathBuf, Vec<u8>) {
        let path = Line::new(Vector2::new(0.0, 0.0), Vector2::new(40.0, 30.0)).unwrap();
        let motion = Motion::plan(50.0, 100.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
        let axis = AxisParameters {
            plant: Plant { gain_rad_s_v: 34.0, time_constant_s: 0.08 },
            drive: Drive::default(),
            pdff: Pdff { kpp_rad_s_mm: 97.0, kpv_nm_s_rad: 1.2, kiv_1_s: 250.0, kpf_rad_mm: 0.8, kvf: 0.85 },
        };
        let settings = LoopSettings { settling_s: 2.0, ..LoopSettings::default() };
        let run = Simulation::new(&path, &motion, [axis, axis], settings).unwrap();
        let file = folder.join("line.mcap");
        let mut recorder = Recorder::create(&file, RecordingMetadata::new("line", "name = \"line\"\n")).unwrap();
        let mut summary = SummaryObserver::new("line");
        let limits = Limits { contour_error_um: Some(30.0), ..Limits::default() };
        run.run(&limits, None, &mut [&mut summary, &mut recorder]).unwrap();
        recorder.finish(&summary.summary()).unwrap();
        let bytes = std::fs::read(&file).unwrap();
        (file, bytes)
    }

    /// Standard output and the notes.
    fn run(file: &Path, format: InspectFormat, csv: bool) -> (Result<(), CliError>, String, String) {
        let (mut out, mut notes) = (Vec::new(), Vec::new());
        let args = InspectArgs { file: file.to_owned(), format, csv };
        let result = inspect(&args, &mut out, &mut notes);
        (result, String::from_utf8(out).unwrap(), String::from_utf8(notes).unwrap())
    }

    #[test]
    fn a_whole_recording_is_summarised() {
        let folder = tempfile::tempdir().unwrap();
        let (file, _) = recording(folder.path());
        let (result, text, notes) = run(&file, InspectFormat::Text, false);
        result.unwrap();
        assert_eq!(notes, "");
        for wanted in [
            "state        complete",
            "line",
            "/servo   servosim.Servo",
            "2601",
            "contour_error_um = 30: kept",
            "run complete",
        ] {
            assert!(text.contains(wanted), "{wanted} is missing in:\n{text}");
        }
        let (result, text, _) = run(&file, InspectFormat::Json, false);
        result.unwrap();
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["complete"], true);
        assert_eq!(json["samples"], 2601);
        assert_eq!(json["summary"]["samples"], 2601);
        assert_eq!(json["topics"][0]["topic"], "/servo");
        let (result, text, _) = run(&file, InspectFormat::Text, true);
        result.unwrap();
        assert_eq!(text.lines().count(), 2602);
        assert!(text.starts_with("time_s,path_s_mm,"));
    }

    #[test]
    fn a_cut_recording_says_so_and_gives_what_it_holds() {
        let folder = tempfile::tempdir().unwrap();
        let (file, bytes) = recording(folder.path());
        std::fs::write(&file, &bytes[..bytes.len() * 2 / 3]).unwrap();
        let (result, text, notes) = run(&file, InspectFormat::Text, false);
        result.unwrap();
        assert!(text.contains("state        cut short: the file ends before the recording does"), "{text}");
        assert!(notes.contains("line.mcap was cut short") && notes.contains("of 2601 samples"), "{notes}");
        let (_, text, notes) = run(&file, InspectFormat::Text, true);
        let rows = text.lines().count() - 1;
        assert!((500..2601).contains(&rows), "{rows} rows");
        assert!(notes.contains(&format!("{rows} of 2601 samples")), "{notes}");
        let (_, text, _) = run(&file, InspectFormat::Json, false);
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["complete"], false);
    }

    #[test]
    fn exit_codes_tell_what_is_wrong() {
        let folder = tempfile::tempdir().unwrap();
        let (file, mut bytes) = recording(folder.path());
        let code = |file: &Path| run(file, InspectFormat::Text, false).0.unwrap_err().exit_code();
        assert_eq!(code(&folder.path().join("missing.mcap")), 2);
        assert_eq!(code(folder.path()), 2);
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&file, &bytes).unwrap();
        assert_eq!(code(&file), 1);
        std::fs::write(&file, "").unwrap();
        assert_eq!(code(&file), 1);
    }

    /// A reader that has left.
    struct Closed;

    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::BrokenPipe.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_closed_pipe_is_no_error() {
        let folder = tempfile::tempdir().unwrap();
        let (file, _) = recording(folder.path());
        for (format, csv) in [(InspectFormat::Text, false), (InspectFormat::Json, false), (InspectFormat::Text, true)] {
            let args = InspectArgs { file: file.clone(), format, csv };
            inspect(&args, &mut Closed, &mut Vec::new()).unwrap();
        }
    }
}
