//! What a viewer shows that opens a recording in the middle.

use mcap::MessageStream;
use prost::Message;

use super::foxglove::{Point3, SceneUpdate};
use super::{Compression, Recorder, Recording, RecordingMetadata, RecordingOptions, Sample};
use crate::scenario::{Document, Scenario};
use crate::summary::Summary;

fn record(scenario: &Scenario, options: RecordingOptions) -> (Vec<u8>, Summary) {
    let metadata = RecordingMetadata::new("a", &scenario.source).with_drives(&scenario.drives);
    let mut recorder = Recorder::new_as(Vec::new(), metadata, options).unwrap();
    let mut observer = scenario.summary_observer();
    scenario.run(&mut [&mut observer, &mut recorder]).unwrap();
    let summary = observer.summary();
    (recorder.finish(&summary).unwrap().writer, summary)
}

fn samples(bytes: &[u8]) -> (Recording, Vec<Sample>) {
    let mut samples = Vec::new();
    let recording = Recording::read_from("test", std::io::Cursor::new(bytes), |sample| {
        samples.push(*sample);
        Ok(())
    });
    (recording.unwrap(), samples)
}

/// Time and lines of every message of a topic, and its size.
fn scenes(bytes: &[u8], topic: &str) -> Vec<(u64, Vec<Vec<Point3>>, usize)> {
    let messages = MessageStream::new(bytes).unwrap().map(Result::unwrap).filter(|m| m.channel.topic == topic);
    messages
        .map(|message| {
            let scene = SceneUpdate::decode(&*message.data).unwrap();
            let lines = scene.entities.into_iter().flat_map(|entity| entity.lines).map(|line| line.points);
            (message.log_time, lines.collect(), message.data.len())
        })
        .collect()
}

#[test]
fn the_path_and_the_whole_trace_are_there_from_any_time_on() {
    // Short, and long enough that the trace is thinned.
    for (set, most_share) in [("control.settling_s=0.2", 1.6), ("control.period_s=0.00002", 0.12)] {
        let mut document = Document::builtin("alpha").unwrap();
        document.set(set).unwrap();
        let (bytes, summary) = record(&document.scenario().unwrap(), RecordingOptions::default());
        let (_, samples) = samples(&bytes);
        let [path, trace, newest] = ["/path", "/trace", "/scene"].map(|topic| scenes(&bytes, topic));
        assert_eq!(path.iter().map(|(time, ..)| *time).collect::<Vec<_>>(), [0]);
        assert!((5..=14).contains(&trace.len()), "{set}: {} whole traces", trace.len());
        let servo: usize = samples.len() * 300;
        let pictures: usize = [&path, &trace, &newest].into_iter().flatten().map(|(.., size)| size).sum();
        assert!((pictures as f64) < most_share * servo as f64, "{set}: {pictures} of {servo}");

        let first = samples[0].servo;
        for at in (1..20).map(|i| summary.samples * i / 20) {
            let time_s = samples[usize::try_from(at).unwrap()].servo.time_s;
            // The last message of each topic; one of `/scene` from before the last whole trace is part of it.
            let last = |of: &[(u64, Vec<Vec<Point3>>, usize)]| {
                of.iter().rfind(|(time, ..)| *time as f64 * 1e-9 <= time_s + 1e-9).cloned()
            };
            let mut shown: Vec<Point3> = Vec::new();
            let whole = last(&trace);
            shown.extend(whole.iter().flat_map(|(_, lines, _)| &lines[0]));
            if let Some((_, lines, _)) = last(&newest) {
                shown.extend(&lines[0]);
            }
            // From the beginning …
            assert!(shown.iter().any(|p| p.x == first.x.actual_mm && p.y == first.y.actual_mm), "{set} {at}");
            // … to a fiftieth of the run before that time, without a hole.
            let known = usize::try_from(at.saturating_sub(summary.samples / 50 + 60)).unwrap();
            for sample in &samples[..known] {
                let (x, y) = (sample.servo.x.actual_mm, sample.servo.y.actual_mm);
                let near = shown.iter().map(|p| (p.x - x).hypot(p.y - y)).fold(f64::INFINITY, f64::min);
                assert!(near < 0.3, "{set}: the trace shown at sample {at} misses sample at {x} {y} by {near} mm");
            }
        }
        // In the end all of it is in the last whole trace.
        let end = &trace.last().unwrap().1[0];
        let last = samples.last().unwrap().servo;
        assert_eq!(end.last().map(|p| (p.x, p.y)), Some((last.x.actual_mm, last.y.actual_mm)));
    }
}

#[test]
fn compressed_and_thinned_out_recordings_hold_the_same_samples() {
    for name in ["alpha", "alpha-real"] {
        let scenario = Scenario::builtin(name).unwrap();
        let (plain, summary) = record(&scenario, RecordingOptions::default());
        let (_, all) = samples(&plain);
        let lz4 = RecordingOptions { compression: Compression::Lz4, every: 1 };
        let (bytes, _) = record(&scenario, lz4);
        assert!(bytes.len() < plain.len() * 9 / 10, "{name}: {} of {}", bytes.len(), plain.len());
        assert_eq!(samples(&bytes).1, all);
        assert_eq!(record(&scenario, lz4).0, bytes, "the same bytes again");
        for every in [2, 7, 100, 1_000_000, u64::MAX] {
            let (bytes, thinned) = record(&scenario, RecordingOptions { every, ..lz4 });
            // The metrics know every period.
            assert_eq!(thinned, summary);
            let (recording, some) = samples(&bytes);
            let last = all.len() - 1;
            let wanted = |k: &usize| (*k as u64).is_multiple_of(every) || *k == last;
            assert_eq!(some, (0..all.len()).filter(wanted).map(|k| all[k]).collect::<Vec<_>>(), "{name} {every}");
            assert_eq!(recording.plan["recorded_every"], every.to_string());
        }
    }
}

#[test]
fn the_seed_is_that_of_the_scenario() {
    let seed = |set: &[&str]| {
        let mut document = Document::builtin("alpha").unwrap();
        for key_value in set {
            document.set(key_value).unwrap();
        }
        let (bytes, _) = record(&document.scenario().unwrap(), RecordingOptions { every: 1000, ..Default::default() });
        samples(&bytes).0.run["seed"].clone()
    };
    let [x, y] = ["x", "y"].map(|axis| format!("axes.{axis}.effects.noise.rms_um=0.5"));
    let [own_x, own_y] = ["x", "y"].map(|axis| format!("axes.{axis}.effects.noise.seed=4"));
    assert_eq!(seed(&[]), "0");
    assert_eq!(seed(&[&x]), "1");
    assert_eq!(seed(&[&x, &own_x, &y, &own_y]), "4");
    assert_eq!(seed(&[&x, &y, &own_y]), "1 4");
}
