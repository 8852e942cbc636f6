//! Recording against the bare MCAP writer that is handed the very messages of the recording, encoded beforehand: of models, and of real
//! drives with what they tell.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::write::NoSeek;
use mcap::{MessageStream, WriteOptions, records::MessageHeader};
use servosim::feedrate::{Motion, Profile};
use servosim::limits::Limits;
use servosim::path::Path;
use servosim::recording::{Recorder, RecordingMetadata};
use servosim::scenario::Scenario;
use servosim::servo::LoopSettings;
use servosim::simulation::{Observer, Period, RunPlan, Simulation};
use servosim::summary::SummaryObserver;

use crate::{fastest, seconds};

pub(crate) fn bench(quick: bool) {
    of("recording", false, quick);
    of("recording, real drives", true, quick);
}

fn of(name: &str, real: bool, quick: bool) {
    let (path, axes) = crate::alpha();
    let motion = Motion::plan(path.length_mm(), 100.0, Profile::Exponential { phase_s: 0.1, n_c: 8.12 })
        .expect("a motion along alpha");
    let settings = LoopSettings { settling_s: if quick { 1.0 } else { 10.0 }, ..LoopSettings::default() };
    let limits = Limits::default();
    let drives = Scenario::builtin("alpha-real").expect("alpha-real").drives;
    let simulation = if real {
        Simulation::with_drives(&path, &motion, axes, &drives, None, settings)
    } else {
        Simulation::new(&path, &motion, axes, settings)
    };
    let simulation = simulation.expect("a run");
    let samples = simulation.samples();
    let periods: Vec<Period<2>> = simulation.collect();
    let plan = RunPlan::new(&path, &motion, &settings, &axes, &limits, samples);
    let mut metrics = SummaryObserver::<2>::new("bench");
    metrics.begin(&plan).expect("a summary begins");
    for period in &periods {
        metrics.period(period).expect("a summary goes on");
    }
    let summary = metrics.summary();

    let record = |room: Vec<u8>| {
        let mut recorder = Recorder::new(room, RecordingMetadata::new("bench", "")).expect("a recorder");
        recorder.begin(&plan).expect("a recording begins");
        for period in &periods {
            recorder.period(period).expect("a recording goes on");
        }
        recorder.finish(&summary).expect("a recording ends").writer
    };
    let bytes = record(Vec::new());
    let messages: Vec<_> = MessageStream::new(&bytes)
        .expect("a recording is an MCAP file")
        .map(|message| message.expect("a whole message"))
        .collect();
    let bare = |room: Vec<u8>| {
        let mut writer = WriteOptions::new()
            .compression(None)
            .chunk_size(Some(256 * 1024))
            .disable_seeking(true)
            .create(NoSeek::new(room))
            .expect("a writer");
        let mut channels = BTreeMap::new();
        for message in &messages {
            let channel = &message.channel;
            let id = *channels.entry(Arc::as_ptr(channel)).or_insert_with(|| {
                let schema = channel.schema.as_ref().expect("a schema");
                let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).expect("a schema");
                writer.add_channel(schema, &channel.topic, "protobuf", &channel.metadata).expect("a channel")
            });
            let header = MessageHeader {
                channel_id: id,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer.write_to_known_channel(&header, &message.data).expect("a message");
        }
        writer.finish().expect("the end");
        writer.into_inner().into_inner()
    };

    let rounds = if quick { 1 } else { 100 };
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        // Memory that was touched before: neither side pays for the pages.
        let room = || {
            let mut room = vec![1; bytes.len() + 4096];
            room.clear();
            room
        };
        let (one, two) = (room(), room());
        ours.push(seconds(|| record(one)).0);
        theirs.push(seconds(|| bare(two)).0);
    }
    let (ours, theirs) = (fastest(ours), fastest(theirs));
    println!(
        "{name:<26} {:7.1} ns/sample  ({:.2} times the bare writer; promised: at most 1.5)",
        1e9 * ours / samples as f64,
        ours / theirs
    );
}
