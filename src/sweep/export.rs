//! The results as tables: CSV, and with the feature `parquet` Parquet; one row a point. They depend on the definition alone.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::chart::SweepPicture;
use super::definition::Sweep;
use super::error::SweepError;
use super::journal::Journal;
use super::metric::{Metric, Status};
use super::outcome::{Outcome, Tally};
#[cfg(feature = "parquet")]
use super::parquet_table::ParquetTable;
use super::picture::Sketch;
use super::variable::{Value, plain, write_number};
use crate::whole_file::Draft;

/// What [`export`] wrote and found.
#[derive(Debug)]
pub struct Exported {
    /// The tables: Parquet (feature `parquet`) and CSV.
    pub files: Vec<PathBuf>,
    /// The sweep in a few numbers.
    pub outcome: Outcome,
    /// The sweep to be drawn.
    pub picture: SweepPicture,
}

/// Writes `NAME-sweep.parquet` and `NAME-sweep.csv` into `folder` from the journals, which hold the sweep from its first
/// point to its last. Each file appears under its name when it is whole; earlier ones are replaced.
///
/// Columns: `index`, the variables by their keys, `status`, the metrics (null or empty where a point has none). `metric` is
/// the one that [`Outcome`] and picture are of.
///
/// # Errors
/// A journal cannot be read, a file cannot be written, or `stop` was raised.
pub fn export(
    sweep: &Sweep,
    journals: &[Journal],
    folder: &Path,
    metric: Metric,
    stop: Option<&AtomicBool>,
) -> Result<Exported, SweepError> {
    if !sweep.metrics().any(|known| known == metric) {
        return Err(SweepError::request(
            format!("the sweep has no {}: it was computed without margins", metric.name()),
            "compute it anew with --margins, or choose another --metric",
        ));
    }
    let kept = match journals {
        [one] => format!("{} keeps every point; the same command continues from there", one.path().display()),
        _ => "the parts keep every point; the same command starts again from them".to_owned(),
    };
    let failed =
        |file: &Path, source: io::Error| SweepError::Write { file: file.to_owned(), source, kept: kept.clone() };
    fs::create_dir_all(folder).map_err(|source| failed(folder, source))?;
    let stem = format!("{}-sweep", sweep.scenario().name);
    let endings: &[&str] = if cfg!(feature = "parquet") { &["parquet", "csv"] } else { &["csv"] };
    let files: Vec<PathBuf> = endings.iter().map(|ending| folder.join(format!("{stem}.{ending}"))).collect();
    let mut tally = Tally::new(metric);
    let mut sketch = Sketch::new(sweep, metric);
    let write = |tally: &mut Tally, sketch: &mut Sketch| -> Result<(), SweepError> {
        let csv = &folder.join(format!("{stem}.csv"));
        let mut drafts = files
            .iter()
            .map(|file| Draft::create(file).map_err(|source| failed(file, source)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut handles = Vec::with_capacity(drafts.len());
        for (draft, file) in drafts.iter_mut().zip(&files) {
            handles.push(draft.file().try_clone().map_err(|source| failed(file, source))?);
        }
        // In the order of the endings.
        let mut handles = handles.into_iter();
        let mut next = || handles.next().ok_or_else(|| failed(csv, io::ErrorKind::NotFound.into()));
        #[cfg(feature = "parquet")]
        let parquet = &folder.join(format!("{stem}.parquet"));
        #[cfg(feature = "parquet")]
        let mut table = ParquetTable::new(sweep, next()?).map_err(|source| failed(parquet, source))?;
        let mut text = BufWriter::with_capacity(1 << 20, next()?);
        write_csv_header(&mut text, sweep).map_err(|source| failed(csv, source))?;
        let mut line = String::new();
        for journal in journals {
            journal.for_each(|first, rows| {
                if let Some(stop) = stop
                    && stop.load(Ordering::Relaxed)
                {
                    let points = sweep.count();
                    return Err(SweepError::Interrupted {
                        done: points,
                        count: points,
                        journal: journal.path().to_owned(),
                    });
                }
                for (place, status) in rows.status.iter().enumerate() {
                    let index = first + place as u64;
                    let (values, metrics) = (sweep.values(index), rows.metrics_of(place));
                    line.clear();
                    csv_row(&mut line, index, &values, *status, metrics);
                    text.write_all(line.as_bytes()).map_err(|source| failed(csv, source))?;
                    tally.push(index, *status, metrics, || sweep.is_stable(index));
                    sketch.push(sweep, index, &values, *status, metrics);
                    #[cfg(feature = "parquet")]
                    table.push(index, values, *status, metrics).map_err(|source| failed(parquet, source))?;
                }
                Ok(())
            })?;
        }
        text.flush().map_err(|source| failed(csv, source))?;
        #[cfg(feature = "parquet")]
        table.finish().map_err(|source| failed(parquet, source))?;
        for (draft, file) in drafts.into_iter().zip(&files) {
            draft.keep().map_err(|source| failed(file, source))?;
        }
        Ok(())
    };
    write(&mut tally, &mut sketch)?;
    let best = tally.best();
    let outcome = tally.outcome(sweep);
    if outcome.invalid == outcome.points {
        let reason = sweep.why_invalid(0).unwrap_or_else(|| "its values make no valid scenario".to_owned());
        return Err(SweepError::NothingValid { count: outcome.points, reason });
    }
    let picture = sketch.finish(sweep, &outcome, best, &tally.metrics);
    Ok(Exported { files, outcome, picture })
}

fn write_csv_header(out: &mut impl Write, sweep: &Sweep) -> io::Result<()> {
    out.write_all(b"index")?;
    for variable in &sweep.definition().variables {
        write!(out, ",{}", variable.key)?;
    }
    out.write_all(b",status")?;
    for metric in sweep.metrics() {
        write!(out, ",{}", metric.name())?;
    }
    writeln!(out)
}

fn csv_row(line: &mut String, index: u64, values: &[Value], status: Status, metrics: &[f64]) {
    // Writing to a string does not fail.
    let _ = write!(line, "{index}");
    for value in values {
        line.push(',');
        match value {
            Value::Number(number) => drop(write_number(line, *number)),
            Value::Text(text) => line.push_str(&quoted(&plain(text))),
        }
    }
    line.push(',');
    line.push_str(status.name());
    for metric in metrics {
        line.push(',');
        // (An infinite margin is written as `inf`.)
        if !metric.is_nan() {
            let _ = write_number(line, *metric);
        }
    }
    line.push('\n');
}

/// A field of a CSV file (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
