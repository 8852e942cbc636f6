//! The results as tables: Parquet and CSV, one row a point. They depend on the definition alone.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::definition::Sweep;
use super::error::SweepError;
use super::evaluate::{Metric, Status};
use super::journal::Journal;
use super::outcome::{Outcome, Tally};
use super::picture::Sketch;
use super::variable::{Value, write_number};
use crate::report::SweepPicture;

/// Rows of a Parquet row group.
const GROUP: usize = 1 << 17;

/// What [`export`] wrote and found.
#[derive(Debug)]
pub struct Exported {
    /// The tables, Parquet and CSV.
    pub files: Vec<PathBuf>,
    /// The sweep in a few metrics.
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
        [one] => format!("{} keeps every point; the same command goes on from there", one.path().display()),
        _ => "the parts keep every point; the same command starts again from them".to_owned(),
    };
    let failed =
        |file: &Path, source: io::Error| SweepError::Write { file: file.to_owned(), source, kept: kept.clone() };
    fs::create_dir_all(folder).map_err(|source| failed(folder, source))?;
    let stem = format!("{}-sweep", sweep.scenario().name);
    let files = ["parquet", "csv"].map(|ending| folder.join(format!("{stem}.{ending}")));
    let drafts = ["parquet", "csv"].map(|ending| folder.join(format!(".{stem}.{ending}.{}.part", std::process::id())));
    let [parquet, csv] = &drafts;

    let mut tally = Tally::new(metric);
    let mut sketch = Sketch::new(sweep, metric);
    let write = |tally: &mut Tally, sketch: &mut Sketch| -> Result<(), SweepError> {
        let create = |path: &Path| File::create(path).map_err(|source| failed(path, source));
        let mut table = ParquetTable::new(sweep, create(parquet)?).map_err(|error| failed(parquet, into_io(error)))?;
        let mut text = BufWriter::with_capacity(1 << 20, create(csv)?);
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
                    table.push(index, values, *status, metrics).map_err(|error| failed(parquet, into_io(error)))?;
                }
                Ok(())
            })?;
        }
        text.flush().map_err(|source| failed(csv, source))?;
        table.finish().map_err(|error| failed(parquet, into_io(error)))?;
        for (draft, file) in drafts.iter().zip(&files) {
            fs::rename(draft, file).map_err(|source| failed(file, source))?;
        }
        Ok(())
    };
    let written = write(&mut tally, &mut sketch);
    if let Err(error) = written {
        for draft in &drafts {
            // What is told of is why it could not be written.
            let _ = fs::remove_file(draft);
        }
        return Err(error);
    }
    let best = tally.best();
    let outcome = tally.outcome(sweep);
    if outcome.invalid == outcome.points {
        let reason = sweep.why_invalid(0).unwrap_or_else(|| "its values make no valid scenario".to_owned());
        return Err(SweepError::NothingValid { count: outcome.points, reason });
    }
    let picture = sketch.finish(sweep, &outcome, best, &tally.metrics);
    Ok(Exported { files: files.to_vec(), outcome, picture })
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

/// A TOML string without its quotes: `"exact"` is exact.
fn plain(text: &str) -> String {
    let inner = ['"', '\''].iter().find_map(|&quote| text.strip_prefix(quote)?.strip_suffix(quote));
    inner.filter(|inner| !inner.contains(['"', '\'', '\\'])).unwrap_or(text).to_owned()
}

/// A field of a CSV file (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn into_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}

/// A column of a row group.
enum Column {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Text(Vec<ByteArray>),
    /// Numbers that may be missing, and which are there.
    Metric(Vec<f64>, Vec<i16>),
}

/// The Parquet file, a row group at a time.
struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Vec<Column>,
    rows: usize,
}

impl ParquetTable {
    fn new(sweep: &Sweep, file: File) -> Result<Self, ParquetError> {
        let field = |name: &str, physical, repetition, logical| {
            let field =
                Type::primitive_type_builder(name, physical).with_repetition(repetition).with_logical_type(logical);
            field.build().map(Arc::new)
        };
        let text = |name: &str| field(name, Physical::BYTE_ARRAY, Repetition::REQUIRED, Some(LogicalType::String));
        let mut fields = vec![field("index", Physical::INT64, Repetition::REQUIRED, None)?];
        let mut columns = vec![Column::Whole(Vec::new())];
        for variable in &sweep.definition().variables {
            if variable.values.is_numeric() {
                fields.push(field(&variable.key, Physical::DOUBLE, Repetition::REQUIRED, None)?);
                columns.push(Column::Number(Vec::new()));
            } else {
                fields.push(text(&variable.key)?);
                columns.push(Column::Text(Vec::new()));
            }
        }
        fields.push(text("status")?);
        columns.push(Column::Text(Vec::new()));
        for metric in sweep.metrics() {
            fields.push(field(metric.name(), Physical::DOUBLE, Repetition::OPTIONAL, None)?);
            columns.push(Column::Metric(Vec::new(), Vec::new()));
        }
        let schema = Arc::new(Type::group_type_builder("sweep").with_fields(fields).build()?);
        let definition =
            serde_json::to_string(sweep.definition()).map_err(|error| ParquetError::General(error.to_string()))?;
        let properties = WriterProperties::builder()
            .set_created_by(format!("servosim {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata(Some(vec![KeyValue::new("servosim.sweep".to_owned(), definition)]))
            .build();
        Ok(Self { writer: SerializedFileWriter::new(file, schema, Arc::new(properties))?, columns, rows: 0 })
    }

    fn push(&mut self, index: u64, values: Vec<Value>, status: Status, metrics: &[f64]) -> Result<(), ParquetError> {
        let mut columns = self.columns.iter_mut();
        if let Some(Column::Whole(column)) = columns.next() {
            column.push(i64::try_from(index).unwrap_or(i64::MAX));
        }
        for value in values {
            match (columns.next(), value) {
                (Some(Column::Number(column)), value) => column.push(value.number().unwrap_or(f64::NAN)),
                (Some(Column::Text(column)), value) => column.push(plain(&value.to_string()).into_bytes().into()),
                _ => {}
            }
        }
        if let Some(Column::Text(column)) = columns.next() {
            column.push(status.name().into());
        }
        for (column, metric) in columns.zip(metrics) {
            if let Column::Metric(numbers, there) = column {
                there.push(i16::from(!metric.is_nan()));
                numbers.extend(Some(*metric).filter(|metric| !metric.is_nan()));
            }
        }
        self.rows += 1;
        if self.rows == GROUP { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> Result<(), ParquetError> {
        if std::mem::take(&mut self.rows) == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let Some(mut writer) = group.next_column()? else { break };
            match column {
                Column::Whole(values) => {
                    writer.typed::<Int64Type>().write_batch(values, None, None)?;
                    values.clear();
                }
                Column::Number(values) => {
                    writer.typed::<DoubleType>().write_batch(values, None, None)?;
                    values.clear();
                }
                Column::Text(values) => {
                    writer.typed::<ByteArrayType>().write_batch(values, None, None)?;
                    values.clear();
                }
                Column::Metric(values, there) => {
                    writer.typed::<DoubleType>().write_batch(values, Some(there), None)?;
                    values.clear();
                    there.clear();
                }
            }
            writer.close()?;
        }
        group.close()?;
        Ok(())
    }

    fn finish(mut self) -> Result<(), ParquetError> {
        self.flush()?;
        self.writer.close()?;
        Ok(())
    }
}
