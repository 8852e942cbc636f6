//! Recordings: what is written comes back bit for bit, whatever happens to the file or the disk in between.

use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Write};
use std::path::Path;

use nalgebra::Vector2;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{Motion, Profile};
use servosim::limits::Limits;
use servosim::path::{self, Circle, Line};
use servosim::recording::{
    LogLevel, ReadError, Recorder, Recording, RecordingError, RecordingMetadata, RecordingOptions, Sample, Servo, csv,
};
use servosim::servo::{AxisParameters, Drive, LoopSettings, Pdff, Plant};
use servosim::simulation::{Ending, Event, Observer, Period, Simulation, SimulationError};
use servosim::summary::{Summary, SummaryObserver};

const SCENARIO: &str = "# a circle\nname = \"circle\"\n";

/// A plausible axis.
fn axis(kpp_rad_s_mm: f64) -> AxisParameters {
    AxisParameters {
        plant: Plant { gain_rad_s_v: 34.0, time_constant_s: 0.08 },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm, kpv_nm_s_rad: 1.2, kiv_1_s: 250.0, kpf_rad_mm: 0.8, kvf: 0.85 },
    }
}

fn circle() -> Circle {
    Circle::new(Vector2::new(1.0, -2.0), 10.0, 0.25, false).unwrap()
}

fn settings(settling_s: f64) -> LoopSettings {
    LoopSettings { settling_s, ..LoopSettings::default() }
}

fn simulation(path: &dyn path::Path<2>, settling_s: f64) -> Simulation<'_, 2> {
    let motion = Motion::plan(path.length_mm(), 100.0, Profile::Quintic { phase_s: 0.1 }).unwrap();
    Simulation::new(path, &motion, [axis(97.0), axis(97.0)], settings(settling_s)).unwrap()
}

/// Runs the circle through a recorder, as the program does.
fn record_with<W: Write>(
    mut recorder: Recorder<W>,
    settling_s: f64,
) -> Result<(Recorder<W>, Summary), SimulationError> {
    let path = circle();
    let mut summary = SummaryObserver::new("circle");
    let limits = Limits { contour_error_um: Some(30.0), ..Limits::default() };
    simulation(&path, settling_s).run(&limits, None, &mut [&mut summary, &mut recorder])?;
    Ok((recorder, summary.summary()))
}

fn record(settling_s: f64) -> (Vec<u8>, Summary) {
    let recorder = Recorder::new(Vec::new(), RecordingMetadata::new("circle", SCENARIO)).unwrap();
    let (recorder, summary) = record_with(recorder, settling_s).unwrap();
    (recorder.finish(&summary).unwrap().writer, summary)
}

fn read(bytes: &[u8]) -> Result<(Recording, Vec<Servo>), ReadError> {
    let mut samples = Vec::new();
    let recording = Recording::read_from("test", Cursor::new(bytes), |sample| {
        samples.push(sample.servo);
        Ok(())
    })?;
    Ok((recording, samples))
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn validates_every_signal_comes_back_bit_for_bit() {
    let (bytes, summary) = record(0.1);
    let (recording, samples) = read(&bytes).unwrap();
    let path = circle();
    let periods: Vec<Period<2>> = simulation(&path, 0.1).collect();
    assert_eq!(samples.len(), periods.len());
    for (servo, period) in samples.iter().zip(&periods) {
        let setpoint = &period.setpoint;
        let mut pairs = vec![
            (servo.time_s, period.time_s),
            (servo.path.s_mm, setpoint.s_mm),
            (servo.path.feed_mm_s, setpoint.feed_mm_s),
            (servo.path.accel_mm_s2, setpoint.accel_mm_s2),
            (servo.path.jerk_mm_s3, setpoint.jerk_mm_s3),
            (servo.contour_error_um, period.contour_error_um),
            (servo.tracking_error_um, period.tracking_error_um),
            (servo.nearest.x_mm, period.nearest_mm.x),
            (servo.nearest.y_mm, period.nearest_mm.y),
            (servo.nearest.s_mm, period.nearest_s_mm),
        ];
        for (i, axis) in [servo.x, servo.y].iter().enumerate() {
            let signals = &period.axes[i];
            pairs.extend([
                (axis.command_mm, signals.command_mm),
                (axis.actual_mm, signals.actual_mm),
                (axis.velocity_command_rad_s, signals.velocity_command_rad_s),
                (axis.velocity_rad_s, signals.velocity_rad_s),
                (axis.torque_nm, signals.torque_nm),
                (axis.voltage_v, signals.voltage_v),
                (f64::from(axis.saturated), f64::from(signals.saturated)),
                (axis.setpoint_velocity_mm_s, setpoint.velocity_mm_s[i]),
                (axis.setpoint_accel_mm_s2, setpoint.acceleration_mm_s2[i]),
                (axis.setpoint_jerk_mm_s3, setpoint.jerk_vector_mm_s3[i]),
            ]);
        }
        for (n, (read, written)) in pairs.into_iter().enumerate() {
            assert_eq!(read.to_bits(), written.to_bits(), "signal {n} of sample {}: {read} is not {written}", period.k);
        }
    }
    assert!(recording.complete);
    assert_eq!(recording.cut_short, None);
    assert_eq!(recording.scenario.as_deref(), Some(SCENARIO));
    assert_eq!(recording.summary().as_ref(), Some(&summary));
    assert_eq!(recording.samples, summary.samples);
    assert_eq!(recording.run["name"], "circle");
    assert_eq!(recording.run["seed"], "0");
    assert_eq!(recording.run["version"], env!("CARGO_PKG_VERSION"));
    // From `sha256sum`.
    assert_eq!(recording.run["scenario_sha256"], "3540cd036deaa330d946ebe6bc2dc493583b4999adc6db95607be39e25a158b4");
    assert_eq!(recording.plan["samples"], summary.samples.to_string());
    let topics: Vec<_> = recording.topics.iter().map(|t| (t.topic.as_str(), t.schema.as_str())).collect();
    let scene = "foxglove.SceneUpdate";
    assert_eq!(
        topics,
        [
            ("/servo", "servosim.Servo"),
            ("/path", scene),
            ("/trace", scene),
            ("/scene", scene),
            ("/log", "foxglove.Log")
        ]
    );
    assert!(recording.log.iter().all(|line| !line.message.is_empty()));
    for [x, y] in &recording.desired_mm {
        let radius = (Vector2::new(*x, *y) - Vector2::new(1.0, -2.0)).norm();
        assert!((radius - 10.0).abs() < 1e-12, "a desired point lies at radius {radius}");
    }
    assert!(recording.desired_mm.len() > 50);
}

#[test]
fn negative_zero_infinity_and_nan_survive() {
    let path = circle();
    let run = simulation(&path, 0.0);
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("odd", "")).unwrap();
    let mut summary = SummaryObserver::new("odd");
    let stop = std::sync::atomic::AtomicBool::new(true);
    assert_eq!(
        run.clone().run(&Limits::default(), Some(&stop), &mut [&mut summary, &mut recorder]).unwrap(),
        Ending::Interrupted
    );
    let odd = [-0.0, f64::INFINITY, f64::NAN, f64::MIN_POSITIVE / 8.0, f64::MAX];
    let mut last = None;
    for (period, value) in run.skip(1).zip(odd) {
        let mut period = period;
        period.setpoint.jerk_mm_s3 = value;
        Observer::period(&mut recorder, &period).unwrap();
        last = Some(period.k);
    }
    assert_eq!(last, Some(5));
    let bytes = recorder.finish(&summary.summary()).unwrap().writer;
    let (_, samples) = read(&bytes).unwrap();
    for (servo, value) in samples[1..].iter().zip(odd) {
        assert_eq!(servo.path.jerk_mm_s3.to_bits(), value.to_bits());
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(record(0.1).0, record(0.1).0);
}

#[test]
fn time_never_goes_back_and_sequence_counts_the_samples() {
    // Long enough for several chunks.
    let (bytes, summary) = record(5.0);
    let mut last = 0;
    let (mut samples, mut chunks) = (0, 0);
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.log_time >= last, "{} after {last}", message.log_time);
        assert_eq!(message.log_time, message.publish_time);
        last = message.log_time;
        if message.channel.topic == "/servo" {
            assert_eq!(u64::from(message.sequence), samples);
            assert_eq!(message.log_time, samples * 1_000_000);
            samples += 1;
        }
    }
    assert_eq!(samples, summary.samples);
    for record in mcap::read::LinearReader::new(&bytes).unwrap() {
        chunks += u32::from(matches!(record.unwrap(), mcap::records::Record::Chunk { .. }));
    }
    assert!(chunks >= 3, "{chunks} chunks");
}

/// Where each chunk ends, and how many samples there are up to there.
fn chunk_ends(bytes: &[u8]) -> Vec<(usize, usize)> {
    let (mut at, mut samples, mut ends) = (8, 0, Vec::new());
    while at + 9 <= bytes.len() {
        let length = usize::try_from(u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap())).unwrap();
        let body = &bytes[at + 9..at + 9 + length];
        if bytes[at] == 0x06 {
            let mut inner = &body[8 + 8 + 8 + 4 + 4 + 8..];
            while !inner.is_empty() {
                let length = usize::try_from(u64::from_le_bytes(inner[1..9].try_into().unwrap())).unwrap();
                // Channel 1 is /servo: it is the first to be added.
                samples += usize::from(inner[0] == 0x05 && inner[9..11] == [1, 0]);
                inner = &inner[9 + length..];
            }
            ends.push((at + 9 + length, samples));
        }
        at += 9 + length;
        if bytes[at..] == *mcap::MAGIC {
            break;
        }
    }
    ends
}

#[test]
fn a_cut_file_gives_exactly_the_samples_of_its_whole_chunks() {
    let (bytes, _) = record(2.0);
    let (_, all) = read(&bytes).unwrap();
    let ends = chunk_ends(&bytes);
    assert!(ends.len() >= 3);
    assert_eq!(ends.last().map(|end| end.1), Some(all.len()));
    // The steps before the end of the last chunk, and every byte of the tail's beginning and end.
    let cuts = (1..bytes.len()).filter(|cut| cut % 9973 == 0 || *cut < 100 || bytes.len() - cut < 100);
    let edges = ends.iter().flat_map(|(end, _)| [end - 1, *end, end + 1]);
    for cut in cuts.chain(edges) {
        let (recording, samples) = read(&bytes[..cut]).unwrap_or_else(|error| panic!("cut at {cut}: {error}"));
        let expected = ends.iter().rev().find(|(end, _)| *end <= cut).map_or(0, |(_, samples)| *samples);
        assert_eq!(samples.len(), expected, "cut at {cut}");
        assert_eq!(samples, all[..expected]);
        assert!(!recording.complete && recording.cut_short.is_some(), "cut at {cut}");
    }
    assert!(matches!(read(&[]), Err(ReadError::Empty { .. })));
}

/// A short recording, so that thousands of variants of it can be read.
fn short_recording() -> Vec<u8> {
    let path = Line::new(Vector2::new(0.0, 0.0), Vector2::new(2.0, 1.0)).unwrap();
    let motion = Motion::plan(path::Path::length_mm(&path), 100.0, Profile::Quintic { phase_s: 0.05 }).unwrap();
    let run = Simulation::new(&path, &motion, [axis(97.0), axis(97.0)], settings(0.0)).unwrap();
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("line", "name = \"line\"\n")).unwrap();
    let mut summary = SummaryObserver::new("line");
    run.run(&Limits::default(), None, &mut [&mut summary, &mut recorder]).unwrap();
    recorder.finish(&summary.summary()).unwrap().writer
}

#[test]
fn every_97th_cut_is_read_without_panic() {
    let bytes = short_recording();
    for cut in (97..bytes.len()).step_by(97) {
        let (recording, _) = read(&bytes[..cut]).unwrap_or_else(|error| panic!("cut at {cut}: {error}"));
        assert!(!recording.complete, "cut at {cut}");
    }
}

#[test]
fn a_damaged_file_is_never_taken_for_a_whole_one() {
    let bytes = short_recording();
    let whole = read(&bytes).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(20);
    let try_one = |at: usize, flip: u8| {
        let mut damaged = bytes.clone();
        damaged[at] ^= flip;
        if let Ok(found) = read(&damaged) {
            assert!(!found.0.complete || found == whole, "byte {at} ^ {flip:#x} passed unnoticed");
        }
    };
    for _ in 0..1500 {
        try_one(rng.random_range(0..bytes.len()), rng.random_range(1..=255));
    }
    // The fields that readers stumble over: the lengths at the beginning, and the whole tail.
    for at in (0..300).chain(bytes.len() - 300..bytes.len()) {
        try_one(at, 0x80);
        try_one(at, 0xff);
    }
    // Blocks of noise.
    for _ in 0..300 {
        let mut damaged = bytes.clone();
        let at = rng.random_range(0..bytes.len() - 64);
        rng.fill_bytes(&mut damaged[at..at + 64]);
        let _ = read(&damaged);
    }
}

#[test]
fn other_files_are_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, contents: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, contents).unwrap();
        Recording::open(&path).unwrap_err().to_string()
    };
    assert!(message("empty.mcap", b"").ends_with("empty.mcap is empty"));
    assert!(message("text.mcap", b"time,x\n0,1\n").ends_with("it does not begin as an MCAP file does"));
    let mut foreign = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    foreign.finish().unwrap();
    let foreign = foreign.into_inner().into_inner();
    assert!(message("foreign.mcap", &foreign).contains("not a recording of servosim"));
    assert!(Recording::open(folder.path()).unwrap_err().to_string().contains("it is a folder"));
    let missing = Recording::open(folder.path().join("missing.mcap")).unwrap_err();
    assert!(matches!(missing, ReadError::Open { .. }), "{missing}");
}

#[test]
fn a_huge_length_takes_no_memory() {
    let mut bytes = short_recording();
    // The length of the first record behind the mark, then cut off: nothing follows it.
    bytes[9..17].copy_from_slice(&(400_u64 << 20).to_le_bytes());
    bytes.truncate(2000);
    assert!(!read(&bytes).unwrap().0.complete);
    bytes[9..17].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(read(&bytes), Err(ReadError::Damaged { .. })));
}

/// A disk with room for so many bytes.
struct FullDisk {
    file: File,
    room: usize,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.room == 0 {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"));
        }
        let written = self.file.write(&bytes[..bytes.len().min(self.room)])?;
        self.room -= written;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[test]
fn a_full_disk_names_the_file_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("circle.mcap");
    let whole = record(0.1).0.len();
    let run = |room: usize| -> Result<(), String> {
        let recorder = Recorder::create_with(
            &path,
            RecordingMetadata::new("circle", SCENARIO),
            RecordingOptions::default(),
            |file| BufWriter::with_capacity(64, FullDisk { file, room }),
        );
        let recorder = recorder.map_err(|error| error.to_string())?;
        let (recorder, summary) = record_with(recorder, 0.1).map_err(|error| error.to_string())?;
        recorder.finish(&summary).map_err(|error| error.to_string())?;
        Ok(())
    };
    for room in (0..whole).step_by(whole / 40).chain([whole - 9, whole - 1]) {
        let error = run(room).expect_err("the disk is full");
        assert!(error.contains("circle.mcap: no space left on device"), "{room} bytes: {error}");
        assert_eq!(entries(folder.path()), Vec::<String>::new(), "{room} bytes");
    }
    run(whole).unwrap();
    assert_eq!(entries(folder.path()), ["circle.mcap"]);
}

#[test]
fn a_recorder_that_is_dropped_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = Recorder::create(folder.path().join("a.mcap"), RecordingMetadata::new("a", "")).unwrap();
    assert_eq!(entries(folder.path()), ["a.mcap.partial"]);
    drop(record_with(recorder, 0.1).unwrap());
    assert_eq!(entries(folder.path()), Vec::<String>::new());
}

#[test]
fn a_killed_run_can_be_read_up_to_its_last_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let recorder = Recorder::create(&path, RecordingMetadata::new("a", SCENARIO)).unwrap();
    let (recorder, summary) = record_with(recorder, 3.0).unwrap();
    // Neither finished nor dropped, as when the process is killed.
    let partial = folder.path().join("a.mcap.partial");
    let recording = Recording::open(&partial).unwrap();
    assert!(recording.cut_short.is_some() && !recording.complete);
    assert!(recording.samples > summary.samples / 2, "{} of {}", recording.samples, summary.samples);
    assert!(recording.samples < summary.samples);
    assert_eq!(recording.plan["samples"], summary.samples.to_string());
    assert!(!path.exists());
    drop(recorder);
}

#[test]
fn an_interrupted_run_is_whole_but_does_not_replace_an_earlier_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let recorder = Recorder::create(&path, RecordingMetadata::new("a", "")).unwrap();
    let (recorder, summary) = record_with(recorder, 0.1).unwrap();
    assert_eq!(recorder.finish(&summary).unwrap().path.as_deref(), Some(path.as_path()));
    let earlier = fs::read(&path).unwrap();

    let recorder = Recorder::create(&path, RecordingMetadata::new("a", "")).unwrap();
    let (recorder, mut summary) = record_with(recorder, 0.0).unwrap();
    summary.complete = false;
    let saved = recorder.interrupted(&summary).unwrap().path.unwrap();
    assert_eq!(saved, folder.path().join("a.mcap.partial"));
    assert_eq!(fs::read(&path).unwrap(), earlier);
    let recording = Recording::open(&saved).unwrap();
    assert!(recording.complete);
    assert_eq!(recording.summary(), Some(summary));

    // The next run takes the place of both.
    let recorder = Recorder::create(&path, RecordingMetadata::new("b", "")).unwrap();
    let (recorder, summary) = record_with(recorder, 0.1).unwrap();
    recorder.finish(&summary).unwrap();
    assert_eq!(entries(folder.path()), ["a.mcap"]);
    assert_eq!(Recording::open(&path).unwrap().run["name"], "b");
}

#[test]
fn what_is_in_the_way_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let create = |name: &str| match Recorder::create(folder.path().join(name), RecordingMetadata::new("a", "")) {
        Ok(_) => panic!("{name} was taken"),
        Err(error) => error.to_string(),
    };
    fs::write(folder.path().join("notes.mcap"), "my notes").unwrap();
    assert!(
        create("notes.mcap").ends_with("notes.mcap exists and is not a recording; move it away or name another file")
    );
    assert_eq!(fs::read_to_string(folder.path().join("notes.mcap")).unwrap(), "my notes");
    fs::write(folder.path().join("b.mcap.partial"), "my notes").unwrap();
    assert!(create("b.mcap").contains("b.mcap.partial exists and is not a recording"));
    fs::create_dir(folder.path().join("c.mcap")).unwrap();
    assert!(create("c.mcap").contains("that is a folder"));
    fs::create_dir(folder.path().join("d.mcap.partial")).unwrap();
    assert!(create("d.mcap").contains("that is a folder"));
    assert!(create("missing/e.mcap").contains("the folder"));
    assert!(create("notes.mcap/e.mcap").contains("cannot create the recording"));
    let running = Recorder::create(folder.path().join("f.mcap"), RecordingMetadata::new("a", "")).unwrap();
    assert!(
        create("f.mcap").ends_with("f.mcap.partial is being written by another run; wait for it or name another file")
    );
    drop(running);
    drop(Recorder::create(folder.path().join("f.mcap"), RecordingMetadata::new("a", "")).unwrap());
}

#[test]
fn runs_to_the_same_file_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let finished: usize = std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4)
            .map(|_| {
                scope.spawn(|| {
                    let mut finished = 0;
                    for _ in 0..10 {
                        match Recorder::create(&path, RecordingMetadata::new("circle", SCENARIO)) {
                            Ok(recorder) => {
                                let (recorder, summary) = record_with(recorder, 0.0).unwrap();
                                recorder.finish(&summary).unwrap();
                                finished += 1;
                            }
                            Err(error) => assert!(matches!(error, RecordingError::Busy { .. }), "{error}"),
                        }
                    }
                    finished
                })
            })
            .collect();
        runs.into_iter().map(|run| run.join().unwrap()).sum()
    });
    assert!(finished >= 1);
    assert_eq!(fs::read(&path).unwrap(), record(0.0).0);
    assert_eq!(entries(folder.path()), ["a.mcap"]);
}

#[test]
fn the_order_of_calls_is_kept() {
    let recorder = Recorder::new(Vec::new(), RecordingMetadata::new("a", "")).unwrap();
    let path = circle();
    let period = simulation(&path, 0.0).next().unwrap();
    let (_, summary) = record(0.0);
    let mut early = recorder;
    assert!(Observer::period(&mut early, &period).unwrap_err().to_string().contains("the run has not begun"));
    assert!(early.finish(&summary).is_err());
    let recorder = Recorder::new(Vec::new(), RecordingMetadata::new("a", "")).unwrap();
    let (mut recorder, _) = record_with(recorder, 0.0).unwrap();
    assert!(
        Observer::period(&mut recorder, &period).unwrap_err().to_string().contains("a sample came after a later one")
    );
    assert!(record_with(recorder, 0.0).err().unwrap().to_string().contains("a recording holds one run"));
}

#[test]
fn a_limit_cycle_does_not_flood_the_log() {
    let recorder = Recorder::new(Vec::new(), RecordingMetadata::new("cycle", "")).unwrap();
    let (mut recorder, summary) = record_with(recorder, 0.0).unwrap();
    let time_s = summary.samples as f64 * summary.period_s;
    for _ in 0..3000 {
        Observer::<2>::event(&mut recorder, &Event::SaturationBegan { axis: 1, time_s }).unwrap();
        Observer::<2>::event(&mut recorder, &Event::SaturationEnded { axis: 1, time_s, lasted_s: 0.002 }).unwrap();
    }
    Observer::<2>::event(&mut recorder, &Event::SaturationBegan { axis: 0, time_s }).unwrap();
    let (recording, _) = read(&recorder.finish(&summary).unwrap().writer).unwrap();
    let lines: Vec<&str> = recording.log.iter().map(|line| line.message.as_str()).collect();
    assert!(lines[0].starts_with("run cycle: "), "{lines:?}");
    let of_y: Vec<&&str> = lines.iter().filter(|line| line.contains("axis y") && line.contains("began")).collect();
    assert_eq!(of_y.len(), 20);
    assert!(of_y[19].ends_with("for the 20th time; further ones of this axis are only counted"), "{}", of_y[19]);
    assert!(lines.contains(&"axis y: saturated 3000 times in all, 2980 of them not listed"), "{lines:?}");
    assert!(lines.contains(&"axis x: saturation began"));
    assert!(lines.last().unwrap().starts_with("run complete after "), "{lines:?}");
    assert_eq!(recording.log.last().unwrap().level, LogLevel::Info);
}

#[test]
fn csv_holds_every_signal_in_full() {
    let (bytes, summary) = record(0.0);
    let (_, samples) = read(&bytes).unwrap();
    let mut text = Vec::new();
    csv::write_header(&mut text, 2, false).unwrap();
    for &servo in &samples {
        csv::write_row(&mut text, &Sample { servo, third: None, drives: None, third_drive: None }).unwrap();
    }
    let text = String::from_utf8(text).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(names, csv::COLUMNS);
    // 1 + 4 + 10 + 10 + 2 + 3: as many as the schema has numbers and flags.
    assert_eq!(names.len(), 30);
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let mut rows = 0;
    for (line, servo) in lines.zip(&samples) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(cells.len(), names.len());
        assert_eq!(cells[column("time_s")], servo.time_s);
        assert_eq!(cells[column("path_jerk_mm_s3")].to_bits(), servo.path.jerk_mm_s3.to_bits());
        assert_eq!(cells[column("y_voltage_v")].to_bits(), servo.y.voltage_v.to_bits());
        assert_eq!(cells[column("contour_error_um")].to_bits(), servo.contour_error_um.to_bits());
        assert_eq!(cells[column("x_saturated")], f64::from(servo.x.saturated));
        rows += 1;
    }
    assert_eq!(rows, summary.samples);
}

#[test]
fn any_writer_gets_the_same_bytes() {
    let mut cursor = Cursor::new(Vec::new());
    let recorder = Recorder::new(&mut cursor, RecordingMetadata::new("circle", SCENARIO)).unwrap();
    let (recorder, summary) = record_with(recorder, 0.1).unwrap();
    let saved = recorder.finish(&summary).unwrap();
    assert_eq!(saved.path, None);
    assert_eq!(cursor.into_inner(), record(0.1).0);
}

/// The layout that fits a run of a built-in scenario.
fn layout(name: &str) -> String {
    let scenario = servosim::scenario::Scenario::builtin(name).unwrap();
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new(name, "")).unwrap();
    let mut summary = scenario.summary_observer();
    scenario.run(&mut [&mut summary, &mut recorder]).unwrap();
    recorder.finish(&summary.summary()).unwrap().layout
}

/// Every `"value": "/servo…"` of a layout is a signal that a recording has.
#[test]
fn the_viewer_layout_plots_signals_that_exist() {
    // The one beside the scenarios is that of alpha.
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/servosim.layout.json");
    assert!(
        fs::read_to_string(shipped).unwrap() == layout("alpha"),
        "servosim run alpha writes the layout that is shipped"
    );
    for name in ["alpha", "alpha-real", "heart"] {
        let layout: serde_json::Value = serde_json::from_str(&layout(name)).unwrap();
        the_panels_fit(&layout);
        let text = layout.to_string();
        assert_eq!(text.contains("/drives"), name == "alpha-real");
        assert!(text.contains("limit (µm), ") && text.contains("saturation (V), -5"), "{name}");
        // All of the path is in sight.
        let camera = &layout["configById"]["3D!scene"]["cameraState"];
        let distance = camera["distance"].as_f64().unwrap();
        assert!(distance > 20.0 && distance < 200.0, "{distance}");
    }
}

fn the_panels_fit(layout: &serde_json::Value) {
    let panels = layout["configById"].as_object().unwrap();
    let mut signals = 0;
    for (name, panel) in panels {
        for path in panel["paths"].as_array().into_iter().flatten() {
            let value = path["value"].as_str().unwrap();
            if let Some(signal) = value.strip_prefix("/servo.").or_else(|| value.strip_prefix("/drives.")) {
                let column = signal.replace('.', "_");
                let known = [csv::COLUMNS, csv::DRIVE_COLUMNS].concat();
                assert!(known.contains(&column.as_str()), "{name}: {value}");
                signals += 1;
            } else {
                assert!(value.parse::<f64>().is_ok(), "{name}: {value} is neither a signal nor a reference line");
            }
        }
    }
    assert!(signals >= 10, "{signals} signals");
    // The mosaic shows every panel.
    let mosaic = layout["layout"].to_string();
    for name in panels.keys() {
        assert!(mosaic.contains(&format!("{name:?}")), "{name} is not shown");
    }
}
