//! `servosim inspect FILE`: what a recording holds.
//!
//! Exit codes: 0 the file was read, even where it ends early (a note on standard error says so, and `"complete"` in the
//! JSON); 1 it is not a recording, or damaged; 2 it cannot be opened.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::recording::{LogLevel, ReadError, Recording, csv};

/// Summarise a recording, or export it.
#[derive(Debug, Clone, Args)]
pub struct InspectArgs {
    /// The recording (.mcap; a .mcap.partial of an interrupted run will do).
    pub file: PathBuf,
    /// How the contents are summarised.
    #[arg(long, value_enum, default_value_t = InspectFormat::Text, conflicts_with = "csv")]
    pub format: InspectFormat,
    /// Write the samples of /servo as CSV to standard output instead.
    #[arg(long)]
    pub csv: bool,
}

/// How the contents are summarised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum InspectFormat {
    /// For people.
    Text,
    /// One JSON object.
    Json,
}

/// Why a recording could not be inspected.
#[derive(Debug, thiserror::Error)]
pub enum InspectError {
    /// It could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// What it holds could not be written.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

impl InspectError {
    /// The exit code of the program: 2 when the file cannot be opened, else 1.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Read(ReadError::Open { .. } | ReadError::Folder { .. }) => 2,
            Self::Read(_) | Self::Output(_) => 1,
        }
    }
}

/// Reads the recording and writes what it holds to `out`; a note about a file that ends early goes to `notes`.
///
/// A closed `out` (`| head`) is no error.
///
/// # Errors
/// The recording cannot be read, or `out` cannot be written.
pub fn inspect(args: &InspectArgs, out: &mut dyn Write, notes: &mut dyn Write) -> Result<(), InspectError> {
    match write_contents(args, out, notes) {
        Err(InspectError::Output(error) | InspectError::Read(ReadError::Visitor(error))) => {
            if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(InspectError::Output(error)) }
        }
        result => result,
    }
}

fn write_contents(args: &InspectArgs, out: &mut dyn Write, notes: &mut dyn Write) -> Result<(), InspectError> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let recording = if args.csv {
        let mut header_due = true;
        let result = Recording::read(&args.file, |servo| {
            if header_due {
                header_due = false;
                csv::write_header(&mut out)?;
            }
            csv::write_row(&mut out, servo)
        });
        if header_due && result.is_ok() {
            csv::write_header(&mut out)?;
        }
        // What was read before the damage is worth having.
        out.flush()?;
        result?
    } else {
        Recording::open(&args.file)?
    };
    match args.format {
        _ if args.csv => {}
        InspectFormat::Text => write_text(&mut out, &args.file, &recording)?,
        InspectFormat::Json => {
            serde_json::to_writer_pretty(&mut out, &to_json(&args.file, &recording)).map_err(io::Error::from)?;
            writeln!(out)?;
        }
    }
    out.flush()?;
    if let Some(why) = &recording.cut_short {
        // A lost note is not worth failing for.
        let _ = writeln!(notes, "note: {} was cut short: {why}; {}", args.file.display(), samples(&recording));
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
        row("time", &format!("{from} s to {to} s"))?;
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
                row("limit", &format!("{} = {}: {kept} ({})", check.name, check.limit, check.value))?;
            }
            if let Some(lockup) = &summary.lockup {
                row("lock-up", lockup)?;
            }
        }
        None => row("summary", "none that this version can read")?,
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
