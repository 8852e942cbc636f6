//! The results of a sweep as a Parquet file, a row group at a time.

use std::fs::File;
use std::io;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::definition::Sweep;
use super::metric::Status;
use super::variable::{Value, plain};

/// Rows of a row group.
const GROUP: usize = 1 << 17;

/// A column of a row group.
enum Column {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Text(Vec<ByteArray>),
    /// Numbers that may be missing, and which are there.
    Metric(Vec<f64>, Vec<i16>),
}

/// The Parquet file, a row group at a time.
pub(super) struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Vec<Column>,
    rows: usize,
}

impl ParquetTable {
    /// A table of the sweep's columns into `file`.
    pub(super) fn new(sweep: &Sweep, file: File) -> io::Result<Self> {
        Self::create(sweep, file).map_err(into_io)
    }

    /// Adds the row of a point.
    pub(super) fn push(&mut self, index: u64, values: Vec<Value>, status: Status, metrics: &[f64]) -> io::Result<()> {
        self.add(index, values, status, metrics).map_err(into_io)
    }

    /// Writes what is left, and the footer.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.flush().and_then(|()| self.writer.close().map(drop)).map_err(into_io)
    }

    fn create(sweep: &Sweep, file: File) -> Result<Self, ParquetError> {
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

    fn add(&mut self, index: u64, values: Vec<Value>, status: Status, metrics: &[f64]) -> Result<(), ParquetError> {
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
