//! The observer that writes a recording.

use crate::parameters::AXIS_NAMES;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, WriteOptions, Writer};
use prost::Message;

use super::error::{RecordingError, into_io};
use super::foxglove::{Level, Log, SceneUpdate};
use super::layout::{LayoutOf, layout};
use super::log::{self, Thinning};
use super::messages::{
    AxisSignals, DriveSignals, Drives, Drives3, Nearest, PathSignals, Servo, Servo3, Third, ThirdDrive,
};
use super::place::Place;
use super::reader::hex_sha256;
use super::scene::{Due, Scene};
use super::schema::Described;
use super::{
    DRIVES_TOPIC, LOG_TOPIC, PATH_TOPIC, PLAN_METADATA, RUN_METADATA, SCENARIO_NAME, SCENE_TOPIC, SERVO_TOPIC,
    SUMMARY_NAME, TRACE_TOPIC,
};
use crate::limits::Limits;
use crate::servo::DriveModel;
use crate::simulation::{Event, Observer, ObserverError, Period, Place as BlockPlace, RunPlan};
use crate::summary::Summary;

/// Messages are written to the file in chunks of about this size; a killed run loses at most one.
const CHUNK_BYTES: u64 = 256 * 1024;

/// What is known of a run before it begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingMetadata {
    /// Name of the scenario.
    pub name: String,
    /// The scenario as TOML.
    pub scenario: String,
    /// Seed of the run's noise, as the scenario gives it; 0 where nothing is random. Where axes have seeds of their own, all of them,
    /// separated by spaces.
    pub seed: String,
    /// Version of the program.
    pub version: String,
}

impl RecordingMetadata {
    /// The metadata of a run of this scenario, in which nothing is random, with this version of servosim.
    pub fn new(name: impl Into<String>, scenario: impl Into<String>) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { name: name.into(), scenario: scenario.into(), seed: "0".to_owned(), version }
    }

    /// The same with the seeds of the noise of its drives.
    #[must_use]
    pub fn with_drives(mut self, drives: &[DriveModel]) -> Self {
        let mut seeds: Vec<String> =
            drives.iter().filter_map(|drive| drive.effects.noise).map(|noise| noise.given_seed().to_string()).collect();
        seeds.dedup();
        if !seeds.is_empty() {
            self.seed = seeds.join(" ");
        }
        self
    }
}

/// How a run is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Compression of the chunks.
    pub compression: Compression,
    /// Every how many control periods a sample is recorded, at least 1; the first and the last one always are. Pictures, log and summary
    /// know every period.
    pub every: u64,
}

impl Default for RecordingOptions {
    /// Every sample, not compressed.
    fn default() -> Self {
        Self { compression: Compression::None, every: 1 }
    }
}

/// Compression of a recording. Either way the same run gives the same bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// None: the fastest to write and to read.
    #[default]
    None,
    /// LZ4: about three quarters of the size.
    Lz4,
}

impl Compression {
    fn of_chunks(self) -> Option<mcap::Compression> {
        match self {
            Self::None => None,
            Self::Lz4 => Some(mcap::Compression::Lz4),
        }
    }
}

/// A recording that was written.
#[derive(Debug)]
pub struct Saved<W> {
    /// Where it is, when it is a file.
    pub path: Option<PathBuf>,
    /// What it was written to, flushed.
    pub writer: W,
    /// A layout for Foxglove or Lichtblick that fits the run, as the JSON document that they import.
    pub layout: String,
}

/// Writes a run to an MCAP file as it happens. Its memory does not grow with the run (but for some 200 bytes a chunk).
///
/// On disk the recording is `NAME.partial` until [`Recorder::finish`] gives it its name. When anything fails, and when the
/// recorder is dropped unfinished, that file is removed; a process that is killed leaves it, readable up to its last
/// whole chunk.
pub struct Recorder<W: Write> {
    output: Option<Writer<NoSeek<W>>>,
    place: Option<Place>,
    /// What messages call the recording.
    name: String,
    metadata: RecordingMetadata,
    /// Every how many periods a sample is recorded.
    every: u64,
    run: Option<Run>,
    /// The message being written; reused.
    buffer: Vec<u8>,
}

/// What is known once the run has begun.
struct Run {
    channels: [u16; 5],
    drives: DriveTopic,
    scene: Scene,
    thinning: Thinning,
    time_ns: u64,
    /// The next sample that may come, and the last of the run.
    next: u64,
    last: u64,
    /// Where in its program the run is.
    place: BlockPlace,
    contour_error_limit_um: Option<f64>,
    voltage_limits_v: Vec<f64>,
    scene_messages: u32,
    trace_messages: u32,
    log_messages: u32,
}

impl Run {
    /// The layout that fits it.
    fn layout(&self) -> String {
        layout(&LayoutOf {
            extent_mm: self.scene.extent_mm,
            contour_error_limit_um: self.contour_error_limit_um,
            voltage_limits_v: self.voltage_limits_v.clone(),
            has_drives: matches!(self.drives, DriveTopic::On(_)),
        })
    }
}

/// Whether the drives tell anything: the first sample knows.
#[derive(Clone, Copy)]
enum DriveTopic {
    Unknown,
    Nothing,
    /// On this channel.
    On(u16),
}

/// Index of a topic's channel, or the channel.
#[derive(Clone, Copy)]
enum Topic {
    Servo,
    Drives(u16),
    Path,
    Trace,
    Scene,
    Log,
}

impl Recorder<BufWriter<File>> {
    /// A recording that will be the file `path`. A recording of that name is replaced once this one is whole.
    ///
    /// # Errors
    /// The folder is missing or not writable, something other than a recording has that name, or another run is writing it.
    pub fn create(path: impl AsRef<Path>, metadata: RecordingMetadata) -> Result<Self, RecordingError> {
        Self::create_with(path, metadata, RecordingOptions::default(), BufWriter::new)
    }

    /// The same with options.
    ///
    /// # Errors
    /// See [`Recorder::create`].
    pub fn create_as(
        path: impl AsRef<Path>,
        metadata: RecordingMetadata,
        options: RecordingOptions,
    ) -> Result<Self, RecordingError> {
        Self::create_with(path, metadata, options, BufWriter::new)
    }
}

impl<W: Write> Recorder<W> {
    /// A recording into any writer.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new(writer: W, metadata: RecordingMetadata) -> Result<Self, RecordingError> {
        Self::start(writer, None, "to its stream".to_owned(), metadata, RecordingOptions::default())
    }

    /// The same with options.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new_as(writer: W, metadata: RecordingMetadata, options: RecordingOptions) -> Result<Self, RecordingError> {
        Self::start(writer, None, "to its stream".to_owned(), metadata, options)
    }

    /// As [`Recorder::create`], with the open file wrapped in a writer of your own.
    ///
    /// # Errors
    /// See [`Recorder::create`].
    pub fn create_with(
        path: impl AsRef<Path>,
        metadata: RecordingMetadata,
        options: RecordingOptions,
        wrap: impl FnOnce(File) -> W,
    ) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let (place, file) = Place::open(path)?;
        Self::start(wrap(file), Some(place), path.display().to_string(), metadata, options)
    }

    fn start(
        writer: W,
        place: Option<Place>,
        name: String,
        metadata: RecordingMetadata,
        options: RecordingOptions,
    ) -> Result<Self, RecordingError> {
        let every = options.every.max(1);
        let options = WriteOptions::new()
            .compression(options.compression.of_chunks())
            .chunk_size(Some(CHUNK_BYTES))
            // A chunk is gathered in memory and written whole: a killed run leaves no half-made one behind.
            .disable_seeking(true)
            .library(format!("servosim {}", metadata.version));
        let mut recorder =
            Self { output: None, place, name, metadata, every, run: None, buffer: Vec::with_capacity(512) };
        match options.create(NoSeek::new(writer)) {
            Ok(output) => recorder.output = Some(output),
            Err(error) => return Err(recorder.fail(error)),
        }
        recorder.write_metadata()?;
        Ok(recorder)
    }

    fn write_metadata(&mut self) -> Result<(), RecordingError> {
        let metadata = [
            ("name", self.metadata.name.clone()),
            ("scenario_sha256", hex_sha256(&self.metadata.scenario)),
            ("seed", self.metadata.seed.clone()),
            ("units", "mm, s, rad, V, N m; errors in µm; one unit of /path, /trace and /scene is 1 mm".to_owned()),
            ("version", self.metadata.version.clone()),
        ];
        let text = self.metadata.scenario.clone().into_bytes();
        self.metadata(RUN_METADATA, metadata)?;
        self.attach(SCENARIO_NAME, "application/toml", text)
    }

    /// Writes the summary and the end of the file and gives it its name.
    ///
    /// # Errors
    /// The run was not begun, or writing failed.
    pub fn finish(self, summary: &Summary) -> Result<Saved<W>, RecordingError> {
        self.close(summary, true)
    }

    /// Ends the recording of a run that was stopped: the file is as well-formed as any, but keeps the name `NAME.partial`, so
    /// that a shorter run does not replace an earlier whole one.
    ///
    /// # Errors
    /// The run was not begun, or writing failed.
    pub fn interrupted(self, summary: &Summary) -> Result<Saved<W>, RecordingError> {
        self.close(summary, false)
    }

    fn close(mut self, summary: &Summary, whole: bool) -> Result<Saved<W>, RecordingError> {
        let Some((thinning, time_ns, layout)) = self.run.as_ref().map(|run| (run.thinning, run.time_ns, run.layout()))
        else {
            return Err(self.out_of_order("it is finished before its run began"));
        };
        self.picture(Due::Trace)?;
        for line in thinning.counts() {
            self.log(time_ns, Level::Warning, line)?;
        }
        self.log(time_ns, Level::Info, log::headline(summary))?;
        let json = match serde_json::to_vec(summary) {
            Ok(json) => json,
            Err(error) => return Err(self.fail(McapError::Io(error.into()))),
        };
        self.attach(SUMMARY_NAME, "application/json", json)?;
        let Some(mut output) = self.output.take() else {
            return Err(self.out_of_order("it failed before"));
        };
        // Dropping the writer would hide this error.
        if let Err(error) = output.finish() {
            return Err(self.fail(error));
        }
        let mut writer = output.into_inner().into_inner();
        if let Err(error) = writer.flush() {
            return Err(self.fail(McapError::Io(error)));
        }
        let path = match self.place.take() {
            Some(place) if whole => {
                place.keep()?;
                Some(place.whole)
            }
            Some(place) => Some(place.partial),
            None => None,
        };
        Ok(Saved { path, writer, layout })
    }

    /// Gives up: removes the partial file and says what happened.
    fn fail(&mut self, error: McapError) -> RecordingError {
        self.abandon();
        RecordingError::Write { name: self.name.clone(), source: into_io(error) }
    }

    fn out_of_order(&mut self, what: &'static str) -> RecordingError {
        RecordingError::Order { name: self.name.clone(), what }
    }

    fn abandon(&mut self) {
        // Taken apart, because a dropped writer would try to finish the file.
        if let Some(output) = self.output.take() {
            drop(output.into_inner());
        }
        if let Some(place) = self.place.take() {
            place.discard();
        }
    }

    /// Calls the writer, and gives up when it fails.
    #[inline]
    fn write<T>(
        &mut self,
        call: impl FnOnce(&mut Writer<NoSeek<W>>, &[u8]) -> Result<T, McapError>,
    ) -> Result<T, RecordingError> {
        let result = match &mut self.output {
            Some(output) => call(output, &self.buffer),
            None => Err(McapError::AttemptedWriteAfterFailure),
        };
        result.map_err(|error| self.fail(error))
    }

    fn metadata<'k>(
        &mut self,
        name: &str,
        pairs: impl IntoIterator<Item = (&'k str, String)>,
    ) -> Result<(), RecordingError> {
        let metadata = pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let metadata = Metadata { name: name.to_owned(), metadata };
        self.write(|output, _| output.write_metadata(&metadata))
    }

    fn attach(&mut self, name: &str, media_type: &str, data: Vec<u8>) -> Result<(), RecordingError> {
        // No time of day: the same run gives the same bytes.
        let attachment = Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: data.into(),
        };
        self.write(|output, _| output.attach(&attachment))
    }

    fn channel<M: Described>(&mut self, topic: &str) -> Result<u16, RecordingError> {
        self.write(|output, _| {
            let schema = output.add_schema(&M::full_name(), "protobuf", &M::schema())?;
            output.add_channel(schema, topic, "protobuf", &BTreeMap::new())
        })
    }

    /// Writes the message in the buffer.
    #[inline]
    fn message(&mut self, topic: Topic, sequence: u32) -> Result<(), RecordingError> {
        let Some(run) = &self.run else {
            return Err(self.out_of_order("the run has not begun"));
        };
        let [servo, path, trace, scene, log] = run.channels;
        let channel_id = match topic {
            Topic::Servo => servo,
            Topic::Drives(channel) => channel,
            Topic::Path => path,
            Topic::Trace => trace,
            Topic::Scene => scene,
            Topic::Log => log,
        };
        let header = MessageHeader { channel_id, sequence, log_time: run.time_ns, publish_time: run.time_ns };
        self.write(|output, data| output.write_to_known_channel(&header, data))
    }

    fn log(&mut self, time_ns: u64, level: Level, line: String) -> Result<(), RecordingError> {
        encode(&mut self.buffer, &log::log(time_ns, level, line));
        let sequence = self.run.as_mut().map_or(0, |run| {
            run.log_messages += 1;
            run.log_messages - 1
        });
        self.message(Topic::Log, sequence)
    }

    /// Writes what is due of the picture, if there is something new.
    fn picture(&mut self, due: Due) -> Result<(), RecordingError> {
        let Some(run) = &mut self.run else { return Ok(()) };
        let (update, messages, topic) = match due {
            Due::Nothing => return Ok(()),
            Due::Newest => (run.scene.newest(run.time_ns), &mut run.scene_messages, Topic::Scene),
            Due::Trace => (run.scene.trace(run.time_ns), &mut run.trace_messages, Topic::Trace),
        };
        let Some(update) = update else { return Ok(()) };
        encode(&mut self.buffer, update);
        let sequence = *messages;
        *messages += 1;
        self.message(topic, sequence)
    }

    fn begin_run<const A: usize, M: Described>(&mut self, plan: &RunPlan<'_, A>) -> Result<(), RecordingError> {
        if self.run.is_some() {
            return Err(self.out_of_order("a recording holds one run"));
        }
        let (scene, desired) = Scene::begin(plan);
        let period_s = plan.settings.period_s;
        let Limits { contour_error_um, .. } = plan.limits;
        // Sorted by their keys when they are written.
        let limits_v = AXIS_NAMES.iter().zip(plan.axes).map(|(name, axis)| (format!("voltage_limit_{name}_v"), axis));
        let limits_v: Vec<_> = limits_v.map(|(key, axis)| (key, axis.drive.voltage_limit_v.to_string())).collect();
        self.metadata(
            PLAN_METADATA,
            [
                ("contour_error_limit_um", contour_error_um.map(|limit| limit.to_string()).unwrap_or_default()),
                ("error_magnification", scene.magnification.to_string()),
                ("path_length_mm", plan.totals.length_mm.to_string()),
                ("motion_time_s", plan.totals.time_s.to_string()),
                ("period_s", period_s.to_string()),
                ("samples", plan.samples.to_string()),
                ("recorded_every", self.every.to_string()),
            ]
            .into_iter()
            .chain(limits_v.iter().map(|(key, value)| (key.as_str(), value.clone()))),
        )?;
        let channels = [
            self.channel::<M>(SERVO_TOPIC)?,
            self.channel::<SceneUpdate>(PATH_TOPIC)?,
            self.channel::<SceneUpdate>(TRACE_TOPIC)?,
            self.channel::<SceneUpdate>(SCENE_TOPIC)?,
            self.channel::<Log>(LOG_TOPIC)?,
        ];
        let first = format!(
            "run {}: {} samples of {period_s} s along {:.3} mm",
            self.metadata.name, plan.samples, plan.totals.length_mm
        );
        self.run = Some(Run {
            channels,
            drives: DriveTopic::Unknown,
            scene,
            thinning: Thinning::default(),
            time_ns: 0,
            next: 0,
            last: plan.samples.saturating_sub(1),
            place: BlockPlace::default(),
            contour_error_limit_um: *contour_error_um,
            voltage_limits_v: plan.axes.iter().map(|axis| axis.drive.voltage_limit_v).collect(),
            scene_messages: 0,
            trace_messages: 0,
            log_messages: 0,
        });
        self.log(0, Level::Info, first)?;
        encode(&mut self.buffer, &desired);
        self.message(Topic::Path, 0)
    }

    /// Writes the drive signals. It stands before the signals of its sample: where a file ends early, no sample is without it.
    #[inline]
    fn add_drives<const A: usize, const N: usize, M: Described>(
        &mut self,
        period: &Period<A>,
        sequence: u32,
        bytes: impl FnOnce(f64, &[crate::servo::DriveSignals; A]) -> [u8; N],
    ) -> Result<(), RecordingError> {
        let topic = self.run.as_ref().map_or(DriveTopic::Nothing, |run| run.drives);
        let channel = match (topic, &period.drives) {
            (DriveTopic::Nothing, None) => return Ok(()),
            (DriveTopic::On(channel), Some(_)) => channel,
            (DriveTopic::Unknown, drives) => {
                let topic = match drives {
                    Some(_) => DriveTopic::On(self.channel::<M>(DRIVES_TOPIC)?),
                    None => DriveTopic::Nothing,
                };
                if let Some(run) = &mut self.run {
                    run.drives = topic;
                }
                match topic {
                    DriveTopic::On(channel) => channel,
                    DriveTopic::Unknown | DriveTopic::Nothing => return Ok(()),
                }
            }
            _ => return Err(self.out_of_order("only some of the samples have drive signals")),
        };
        if let Some(drives) = &period.drives {
            self.buffer.clear();
            self.buffer.extend_from_slice(&bytes(period.time_s, drives));
            self.message(Topic::Drives(channel), sequence)?;
        }
        Ok(())
    }

    #[inline]
    fn add_period<const A: usize, const N: usize, const D: usize, M: Described>(
        &mut self,
        period: &Period<A>,
        bytes: impl FnOnce(&Period<A>, &BlockPlace) -> [u8; N],
        drives: impl FnOnce(f64, &[crate::servo::DriveSignals; A]) -> [u8; D],
    ) -> Result<(), RecordingError> {
        let every = self.every;
        let Some(run) = &mut self.run else {
            return Err(self.out_of_order("the run has not begun"));
        };
        let Ok(sequence) = u32::try_from(period.k) else {
            return Err(self.out_of_order("it holds at most 4294967296 samples"));
        };
        if period.k < run.next {
            return Err(self.out_of_order("a sample came after a later one"));
        }
        run.next = period.k + 1;
        run.time_ns = run.time_ns.max(nanos(period.time_s));
        let due = run.scene.add(period);
        let place = run.place;
        if !period.k.is_multiple_of(every) && period.k != run.last {
            return self.picture(due);
        }
        self.add_drives::<A, D, M>(period, sequence, drives)?;
        self.buffer.clear();
        self.buffer.extend_from_slice(&bytes(period, &place));
        self.message(Topic::Servo, sequence)?;
        self.picture(due)
    }

    fn add_event(&mut self, event: &Event) -> Result<(), RecordingError> {
        let Some(run) = &mut self.run else {
            return Err(self.out_of_order("the run has not begun"));
        };
        match run.thinning.line(event) {
            Some(line) => self.log(nanos(event.time_s()), log::level(event.severity()), line),
            None => Ok(()),
        }
    }
}

impl<W: Write> Observer<2> for Recorder<W> {
    fn begin(&mut self, plan: &RunPlan<'_, 2>) -> Result<(), ObserverError> {
        Ok(self.begin_run::<2, Servo>(plan)?)
    }

    #[inline]
    fn period(&mut self, period: &Period<2>) -> Result<(), ObserverError> {
        let drives = |time_s, drives: &_| two_drives(time_s, drives).to_bytes();
        Ok(self.add_period::<2, _, _, Drives>(period, |period, _| servo(period).to_bytes(), drives)?)
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        Ok(self.add_event(event)?)
    }
}

impl<W: Write> Observer<3> for Recorder<W> {
    fn begin(&mut self, plan: &RunPlan<'_, 3>) -> Result<(), ObserverError> {
        Ok(self.begin_run::<3, Servo3>(plan)?)
    }

    fn place(&mut self, place: &BlockPlace) -> Result<(), ObserverError> {
        if let Some(run) = &mut self.run {
            run.place = *place;
        }
        Ok(())
    }

    #[inline]
    fn period(&mut self, period: &Period<3>) -> Result<(), ObserverError> {
        let bytes = |period: &Period<3>, place: &_| Servo3::to_bytes(&servo(period), &third(period, place));
        let drives = |time_s, drives: &[_; 3]| {
            Drives3::to_bytes(&two_drives(time_s, drives), &ThirdDrive { z: drive(&drives[2]) })
        };
        Ok(self.add_period::<3, _, _, Drives3>(period, bytes, drives)?)
    }

    fn event(&mut self, event: &Event) -> Result<(), ObserverError> {
        Ok(self.add_event(event)?)
    }
}

impl<W: Write> Drop for Recorder<W> {
    fn drop(&mut self) {
        self.abandon();
    }
}

/// The signals of one axis of a period.
#[inline]
fn axis<const A: usize>(period: &Period<A>, axis: usize) -> AxisSignals {
    let (setpoint, signals) = (&period.setpoint, &period.axes[axis]);
    AxisSignals {
        command_mm: signals.command_mm,
        actual_mm: signals.actual_mm,
        velocity_command_rad_s: signals.velocity_command_rad_s,
        velocity_rad_s: signals.velocity_rad_s,
        torque_nm: signals.torque_nm,
        voltage_v: signals.voltage_v,
        saturated: signals.saturated,
        setpoint_velocity_mm_s: setpoint.velocity_mm_s[axis],
        setpoint_accel_mm_s2: setpoint.acceleration_mm_s2[axis],
        setpoint_jerk_mm_s3: setpoint.jerk_vector_mm_s3[axis],
    }
}

#[inline]
fn path_signals<const A: usize>(setpoint: &crate::interpolator::Setpoint<A>) -> PathSignals {
    PathSignals {
        s_mm: setpoint.s_mm,
        feed_mm_s: setpoint.feed_mm_s,
        accel_mm_s2: setpoint.accel_mm_s2,
        jerk_mm_s3: setpoint.jerk_mm_s3,
    }
}

/// A period as its message.
#[inline]
pub(crate) fn servo<const A: usize>(period: &Period<A>) -> Servo {
    Servo {
        time_s: period.time_s,
        path: path_signals(&period.setpoint),
        x: axis(period, 0),
        y: axis(period, 1),
        contour_error_um: period.contour_error_um,
        tracking_error_um: period.tracking_error_um,
        nearest: Nearest { x_mm: period.nearest_mm[0], y_mm: period.nearest_mm[1], s_mm: period.nearest_s_mm },
    }
}

/// What a machine with three axes adds to it.
#[inline]
fn third(period: &Period<3>, place: &BlockPlace) -> Third {
    Third { z: axis(period, 2), nearest_z_mm: period.nearest_mm.z, line: place.line as f64, rapid: place.rapid }
}

/// What one drive tells.
#[inline]
fn drive(signals: &crate::servo::DriveSignals) -> DriveSignals {
    DriveSignals {
        measured_mm: signals.measured_mm,
        measured_rad_s: signals.measured_rad_s,
        motor_mm: signals.motor_mm,
        table_mm_s: signals.table_mm_s,
        motor_torque_nm: signals.motor_torque_nm,
        ripple_nm: signals.ripple_nm,
        friction_nm: signals.friction_nm,
        force_nm: signals.force_nm,
        stuck: signals.stuck,
        in_gap: signals.in_gap,
    }
}

/// What the first two drives tell.
#[inline]
fn two_drives<const A: usize>(time_s: f64, drives: &[crate::servo::DriveSignals; A]) -> Drives {
    Drives { time_s, x: drive(&drives[0]), y: drive(&drives[1]) }
}

/// Puts the message into the buffer, which grows to the largest message and is then reused.
fn encode(buffer: &mut Vec<u8>, message: &impl Message) {
    buffer.clear();
    message.encode_raw(buffer);
}

/// Seconds as whole nanoseconds, the nearest ones.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a float cast saturates
fn nanos(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}
