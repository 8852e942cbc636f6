//! Reading a recording back: as a stream, checked, and as far as it goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};
use prost::{DecodeError, Message};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::error::ReadError;
use super::fields::{self, Fields};
use super::foxglove::{Level, Log, SceneUpdate};
use super::messages::{Drives, Drives3, Sample, Servo, Servo3, Third, ThirdDrive};
use super::scene::DESIRED;
use super::schema::Described;
use super::{
    DRIVES_TOPIC, LOG_TOPIC, PATH_TOPIC, PLAN_METADATA, RUN_METADATA, SCENARIO_NAME, SCENE_TOPIC, SERVO_TOPIC,
    SUMMARY_NAME,
};
use crate::summary::Summary;

/// Longest record that is read: a scenario with all the points that a path may have is a quarter of it.
const MAX_RECORD_BYTES: usize = 1 << 29;

/// Most bytes asked for at once, so that a damaged length allocates no more than the file really holds.
const READ_BYTES: usize = 1 << 20;

/// Most lines of the log that are kept.
const MAX_LOG_LINES: usize = 1000;

/// What a recording holds, but for the samples themselves, which a visitor sees one by one.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Recording {
    /// Metadata of the run: `name`, `scenario_sha256`, `seed`, `units`, `version`.
    pub run: BTreeMap<String, String>,
    /// What was planned: `samples`, `period_s`, `path_length_mm`, `motion_time_s`, `error_magnification`,
    /// `contour_error_limit_um` (empty when there is none), `voltage_limit_x_v`, `voltage_limit_y_v`.
    pub plan: BTreeMap<String, String>,
    /// The scenario as TOML.
    pub scenario: Option<String>,
    /// The summary as written; see [`Recording::summary`].
    pub summary_json: Option<Value>,
    /// Topics in the order of the file.
    pub topics: Vec<TopicInfo>,
    /// Attachments in the order of the file.
    pub attachments: Vec<AttachmentInfo>,
    /// Axes of the machine: 2 or 3.
    pub axes: usize,
    /// Whether the drives tell more than their model: every sample has [`Sample::drives`] then.
    pub drives: bool,
    /// Samples read.
    pub samples: u64,
    /// Time of the first and of the last sample \[s\].
    pub time_range_s: Option<(f64, f64)>,
    /// The desired path as a polyline \[mm\].
    pub desired_mm: Vec<[f64; 2]>,
    /// The log; at most its first 1000 lines.
    pub log: Vec<LogLine>,
    /// Whether the file reaches its proper end.
    pub complete: bool,
    /// Why not, in words.
    pub cut_short: Option<String>,
}

/// A topic of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicInfo {
    /// Name, such as `/servo`.
    pub topic: String,
    /// Name of its schema.
    pub schema: String,
    /// Messages read.
    pub messages: u64,
}

/// An attachment of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttachmentInfo {
    /// Name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Size in bytes.
    pub bytes: usize,
}

/// How much a line of the log matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogLevel {
    /// Worth knowing.
    Info,
    /// Worth a look.
    Warning,
    /// The run is not what was asked for.
    Error,
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogLine {
    /// When \[s\].
    pub time_s: f64,
    /// How much it matters.
    pub level: LogLevel,
    /// The line.
    pub message: String,
}

impl Recording {
    /// Reads the file `path` for what it holds.
    ///
    /// # Errors
    /// See [`Recording::read`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        Self::read(path, |_| Ok(()))
    }

    /// Reads the file `path` and shows every sample to `visit`, in order. Memory does not grow with the file.
    ///
    /// A file that ends early (the run was killed, or the disk was taken away) is read as far as its chunks are whole, and
    /// [`Recording::cut_short`] says so.
    ///
    /// # Errors
    /// The file cannot be opened or read, is not a recording, or is damaged (every checksum is checked); or `visit` failed.
    /// Samples before the damage have been shown by then.
    pub fn read(path: impl AsRef<Path>, visit: impl FnMut(&Sample) -> io::Result<()>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        if path.is_dir() {
            return Err(ReadError::Folder { name });
        }
        match File::open(path) {
            Ok(file) => Self::read_from(&name, BufReader::new(file), visit),
            Err(source) => Err(ReadError::Open { name, source }),
        }
    }

    /// As [`Recording::read`], from any source; `name` stands for it in messages.
    ///
    /// # Errors
    /// See [`Recording::read`].
    pub fn read_from(
        name: &str,
        mut source: impl Read + Seek,
        visit: impl FnMut(&Sample) -> io::Result<()>,
    ) -> Result<Self, ReadError> {
        let failed = |source| ReadError::Read { name: name.to_owned(), source };
        let ends = ends_as_recording(&mut source).map_err(failed)?;
        match ends {
            Ends::Empty => return Err(ReadError::Empty { name: name.to_owned() }),
            Ends::Foreign => return Err(ReadError::NotMcap { name: name.to_owned() }),
            Ends::Whole | Ends::Open => {}
        }
        let mut scan = Scan {
            name,
            found: Self { axes: 2, ..Self::default() },
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            drives: None,
            visit,
        };
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        let mut reader = LinearReader::new_with_options(options);
        loop {
            match reader.next_event() {
                None => {
                    scan.found.complete = true;
                    break;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => scan.record(opcode, data)?,
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let read = read_some(&mut source, reader.insert(wanted.clamp(1, READ_BYTES))).map_err(failed)?;
                    reader.notify_read(read);
                }
                Some(Err(McapError::UnexpectedEof)) => {
                    if matches!(ends, Ends::Whole) {
                        return Err(scan.damaged("a record's length runs past the end of the file"));
                    }
                    scan.found.cut_short = Some("the file ends before the recording does".to_owned());
                    break;
                }
                Some(Err(McapError::Io(source))) => return Err(failed(source)),
                Some(Err(error)) => return Err(scan.damaged(&in_words(error))),
            }
        }
        scan.finish()
    }

    /// The summary, when the run reached its end (or was stopped in an orderly way) and this version knows its form.
    pub fn summary(&self) -> Option<Summary> {
        self.summary_json.as_ref().and_then(|json| serde_json::from_value(json.clone()).ok())
    }
}

/// How a file begins and ends.
enum Ends {
    Empty,
    Foreign,
    /// With the format's mark at both ends.
    Whole,
    /// With the mark (or what there is of it) at the beginning only.
    Open,
}

fn ends_as_recording(source: &mut (impl Read + Seek)) -> io::Result<Ends> {
    let mut start = Vec::with_capacity(MAGIC.len());
    source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start)?;
    if start.is_empty() {
        return Ok(Ends::Empty);
    }
    if !MAGIC.starts_with(&start) {
        return Ok(Ends::Foreign);
    }
    let length = source.seek(SeekFrom::End(0))?;
    let mut end = Vec::with_capacity(MAGIC.len());
    source.seek(SeekFrom::Start(length.saturating_sub(MAGIC.len() as u64)))?;
    source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut end)?;
    source.rewind()?;
    Ok(if length > 2 * MAGIC.len() as u64 && end == MAGIC { Ends::Whole } else { Ends::Open })
}

fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            result => return result,
        }
    }
}

/// What the MCAP reader stumbled over.
fn in_words(error: McapError) -> String {
    match error {
        McapError::BadChunkCrc { .. } | McapError::BadDataCrc { .. } | McapError::BadSummaryCrc { .. } => {
            "a checksum does not match, so that bytes have changed since it was written".to_owned()
        }
        McapError::RecordTooLarge { len, .. } | McapError::ChunkTooLarge(len) => {
            format!("a record claims to be {len} bytes long")
        }
        McapError::BytesAfterEndMagic => "something follows its end".to_owned(),
        McapError::BadMagic => "it does not end as an MCAP file does".to_owned(),
        other => format!("its records do not fit together ({other})"),
    }
}

/// What a channel carries.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    Servo,
    Servo3,
    Drives,
    Drives3,
    Scene,
    Log,
    Other,
}

/// A recording while it is read.
struct Scan<'a, V> {
    name: &'a str,
    found: Recording,
    schemas: BTreeMap<u16, String>,
    /// What a channel carries, and its place in the list of topics.
    channels: BTreeMap<u16, (Content, usize)>,
    /// What the drives signals last; the sample that it belongs to follows.
    drives: Option<(Drives, Option<ThirdDrive>)>,
    visit: V,
}

impl<V: FnMut(&Sample) -> io::Result<()>> Scan<'_, V> {
    fn damaged(&self, what: &str) -> ReadError {
        ReadError::Damaged { name: self.name.to_owned(), what: what.to_owned() }
    }

    fn record(&mut self, opcode: u8, data: &[u8]) -> Result<(), ReadError> {
        use mcap::records::op;
        match opcode {
            op::HEADER => {
                let header = fields::header(&mut Fields::new(data));
                let library = header.ok_or_else(|| self.damaged("its header is not one"))?;
                if library.starts_with("servosim ") {
                    return Ok(());
                }
                Err(ReadError::Foreign { name: self.name.to_owned(), library: library.to_owned() })
            }
            op::SCHEMA => {
                let (id, name) =
                    fields::schema(&mut Fields::new(data)).ok_or_else(|| self.damaged("a schema is not one"))?;
                self.schemas.entry(id).or_insert_with(|| name.to_owned());
                Ok(())
            }
            op::CHANNEL => self.channel(data),
            op::MESSAGE => self.message(data),
            op::ATTACHMENT => self.attachment(data),
            op::METADATA => {
                let (name, pairs) =
                    fields::metadata(&mut Fields::new(data)).ok_or_else(|| self.damaged("its metadata are not"))?;
                match name {
                    RUN_METADATA => self.found.run = pairs,
                    PLAN_METADATA => self.found.plan = pairs,
                    _ => {}
                }
                Ok(())
            }
            // The rest repeats what is known by then, for readers that jump about.
            _ => Ok(()),
        }
    }

    fn channel(&mut self, data: &[u8]) -> Result<(), ReadError> {
        let channel = fields::channel(&mut Fields::new(data)).ok_or_else(|| self.damaged("a channel is not one"))?;
        if self.channels.contains_key(&channel.id) {
            return Ok(());
        }
        let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
        let is = |topic: &str, name: String| {
            channel.topic == topic && schema == name && channel.message_encoding == "protobuf"
        };
        let content = if is(SERVO_TOPIC, Servo::full_name()) {
            Content::Servo
        } else if is(SERVO_TOPIC, Servo3::full_name()) {
            self.found.axes = 3;
            Content::Servo3
        } else if is(DRIVES_TOPIC, Drives::full_name()) {
            self.found.drives = true;
            Content::Drives
        } else if is(DRIVES_TOPIC, Drives3::full_name()) {
            self.found.drives = true;
            Content::Drives3
        } else if is(PATH_TOPIC, SceneUpdate::full_name()) || is(SCENE_TOPIC, SceneUpdate::full_name()) {
            // Before it had a topic of its own the desired path was the first message of `/scene`.
            Content::Scene
        } else if is(LOG_TOPIC, Log::full_name()) {
            Content::Log
        } else {
            Content::Other
        };
        self.channels.insert(channel.id, (content, self.found.topics.len()));
        self.found.topics.push(TopicInfo { topic: channel.topic.to_owned(), schema, messages: 0 });
        Ok(())
    }

    fn message(&mut self, data: &[u8]) -> Result<(), ReadError> {
        let (channel, body) =
            fields::message(&mut Fields::new(data)).ok_or_else(|| self.damaged("a message is not one"))?;
        let Some(&(content, index)) = self.channels.get(&channel) else {
            return Err(self.damaged("a message belongs to no topic"));
        };
        let Some(topic) = self.found.topics.get_mut(index) else { return Ok(()) };
        topic.messages += 1;
        let first = topic.messages == 1;
        match content {
            Content::Servo | Content::Servo3 => {
                let mut sample = sample(body, content == Content::Servo3)
                    .map_err(|error| self.damaged(&format!("a sample is not one: {error}")))?;
                let (drives, third_drive) = self.drives.take().unzip();
                (sample.drives, sample.third_drive) = (drives, third_drive.flatten());
                let servo = &sample.servo;
                let at_its_time = sample.drives.is_none_or(|drives| drives.time_s.to_bits() == servo.time_s.to_bits());
                let is_whole = sample.drives.is_some() == self.found.drives
                    && sample.third_drive.is_some() == (self.found.drives && sample.third.is_some());
                if !(at_its_time && is_whole) {
                    return Err(self.damaged("the drive signals do not belong to its sample"));
                }
                self.found.samples += 1;
                let (start, _) = self.found.time_range_s.unwrap_or((servo.time_s, servo.time_s));
                self.found.time_range_s = Some((start, servo.time_s));
                (self.visit)(&sample).map_err(ReadError::Visitor)
            }
            Content::Drives | Content::Drives3 => {
                let signals = drives(body, content == Content::Drives3);
                let signals =
                    signals.map_err(|error| self.damaged(&format!("the drive signals cannot be decoded: {error}")))?;
                self.drives = Some(signals);
                Ok(())
            }
            Content::Scene if first => {
                let scene =
                    SceneUpdate::decode(body).map_err(|error| self.damaged(&format!("a scene is not one: {error}")))?;
                if let Some(desired) = scene.entities.iter().find(|entity| entity.id == DESIRED) {
                    let points = desired.lines.iter().flat_map(|line| &line.points);
                    self.found.desired_mm = points.map(|p| [p.x, p.y]).collect();
                }
                Ok(())
            }
            Content::Log if self.found.log.len() < MAX_LOG_LINES => {
                let log = Log::decode(body)
                    .map_err(|error| self.damaged(&format!("a line of the log is not one: {error}")))?;
                let level = match log.level() {
                    Level::Warning => LogLevel::Warning,
                    Level::Error | Level::Fatal => LogLevel::Error,
                    Level::Unknown | Level::Debug | Level::Info => LogLevel::Info,
                };
                let time_s = log.timestamp.seconds as f64 + 1e-9 * f64::from(log.timestamp.nanos);
                self.found.log.push(LogLine { time_s, level, message: log.message });
                Ok(())
            }
            Content::Scene | Content::Log | Content::Other => Ok(()),
        }
    }

    fn attachment(&mut self, data: &[u8]) -> Result<(), ReadError> {
        let (name, media_type, body) =
            fields::attachment(&mut Fields::new(data)).ok_or_else(|| self.damaged("an attachment is not one"))?;
        match name {
            SCENARIO_NAME => {
                let text = std::str::from_utf8(body).map_err(|_| self.damaged("its scenario is not text"))?;
                self.found.scenario = Some(text.to_owned());
            }
            SUMMARY_NAME => {
                let json = serde_json::from_slice(body);
                self.found.summary_json =
                    Some(json.map_err(|error| self.damaged(&format!("its summary is not JSON: {error}")))?);
            }
            _ => {}
        }
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        self.found.attachments.push(AttachmentInfo { name, media_type, bytes: body.len() });
        Ok(())
    }

    /// Holds what was found against each other.
    fn finish(self) -> Result<Recording, ReadError> {
        if let (Some(scenario), Some(hash)) = (&self.found.scenario, self.found.run.get("scenario_sha256"))
            && *hash != hex_sha256(scenario)
        {
            return Err(self.damaged("its scenario is not the one that was run (the hash differs)"));
        }
        Ok(self.found)
    }
}

/// A sample of a machine with two axes or with three.
fn sample(body: &[u8], third: bool) -> Result<Sample, DecodeError> {
    let third = if third { Some(Third::decode(body)?) } else { None };
    Ok(Sample { servo: Servo::decode(body)?, third, drives: None, third_drive: None })
}

/// What the drives of a machine with two axes or with three tell.
fn drives(body: &[u8], third: bool) -> Result<(Drives, Option<ThirdDrive>), DecodeError> {
    let third = if third { Some(ThirdDrive::decode(body)?) } else { None };
    Ok((Drives::decode(body)?, third))
}

/// SHA-256 of a text, in hexadecimal digits.
pub(crate) fn hex_sha256(text: &str) -> String {
    use std::fmt::Write;
    Sha256::digest(text.as_bytes()).iter().fold(String::new(), |mut hex, byte| {
        // Writing to a string cannot fail.
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}
