//! The drive signals, as a user finds it in the recording and in its CSV; and that models leave nothing of it.

use std::collections::HashMap;
use std::fs;
use std::io::Cursor;

use crate::common::folder::Folder;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use servosim::limits::Limits;
use servosim::machining::{Machine, ProgramRun, ProgramStatistics};
use servosim::nc::{Reader, Reading};
use servosim::recording::{DriveSignals, Recorder, Recording, RecordingMetadata, Sample, csv};
use servosim::scenario::{Document, Scenario};
use servosim::servo::DriveSignals as Told;
use servosim::simulation::{Observer, Period};
use servosim::summary::SummaryObserver;

/// A table: names and columns.
struct Table {
    names: Vec<String>,
    columns: HashMap<String, Vec<f64>>,
}

impl Table {
    /// What `servosim inspect NAME --csv` prints.
    fn of(folder: &Folder, name: &str) -> Self {
        let output = folder.servosim(&format!("inspect {name} --csv")).assert().success().stderr("");
        let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let mut columns: HashMap<_, _> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
        assert_eq!(columns.len(), names.len(), "no name stands twice");
        for line in lines {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            assert_eq!(cells.len(), names.len(), "{line}");
            for (name, cell) in names.iter().zip(cells) {
                columns.get_mut(name).unwrap().push(cell);
            }
        }
        Self { names, columns }
    }

    fn column(&self, name: &str) -> &[f64] {
        self.columns.get(name).unwrap_or_else(|| panic!("there is no column {name}"))
    }
}

fn topics(folder: &Folder, name: &str) -> Vec<(String, String, u64)> {
    let output = folder.servosim(&format!("inspect {name} --format json")).output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let topic = |t: &serde_json::Value| (text(&t["topic"]), text(&t["schema"]), t["messages"].as_u64().unwrap());
    json["topics"].as_array().unwrap().iter().map(topic).collect()
}

#[test]
fn validates_the_columns_of_real_drives() {
    let folder = Folder::new();
    folder.servosim("run alpha-real.toml --quiet --plots none").assert().success();
    let told = topics(&folder, "alpha-real");
    assert!(told.contains(&("/drives".to_owned(), "servosim.Drives".to_owned(), 1201)), "{told:?}");
    folder
        .servosim("inspect alpha-real")
        .assert()
        .success()
        .stdout(contains("/drives  servosim.Drives            1201"));

    let table = Table::of(&folder, "alpha-real");
    assert_eq!(table.names, [csv::COLUMNS, csv::DRIVE_COLUMNS].concat());
    assert_eq!(table.column("time_s").len(), 1201);
    for axis in ["x", "y"] {
        let of = |name: &str| table.column(&format!("{axis}_{name}"));
        let (measured, motor, table_mm_s) = (of("measured_mm"), of("motor_mm"), of("table_mm_s"));
        let (friction, stuck, in_gap) = (of("friction_nm"), of("stuck"), of("in_gap"));
        for k in 0..measured.len() {
            // The encoder is on the motor: rounded to the nearest count of 0.1 µm, after noise of 0.02 µm, of which six deviations.
            let apart_um = 1e3 * (measured[k] - motor[k]).abs();
            assert!(apart_um <= 0.05 + 6.0 * 0.02, "{axis}, sample {k}: {apart_um} µm");
            let counts = measured[k] / 1e-4;
            assert!((counts - counts.round()).abs() < 1e-6, "{axis}, sample {k}: {counts} counts");
            // Flags are 0 or 1; a table that sticks does not move, and holds with up to the static friction.
            for flag in [stuck[k], in_gap[k]] {
                assert!(flag == 0.0 || flag == 1.0, "{axis}, sample {k}: {flag}");
            }
            if stuck[k] == 1.0 {
                assert!(table_mm_s[k] == 0.0 && friction[k].abs() <= 0.2, "{axis}, sample {k}: {}", friction[k]);
            } else {
                // Friction pushes against the motion, with something between Coulomb's and the static one.
                assert!(friction[k] * table_mm_s[k] <= 0.0, "{axis}, sample {k}: {}, {}", friction[k], table_mm_s[k]);
                assert!((0.15..=0.2).contains(&friction[k].abs()), "{axis}, sample {k}: {}", friction[k]);
            }
        }
        let count = |flag: &[f64]| flag.iter().sum::<f64>();
        // At rest before the motion and after it; and the gap is crossed at each reversal.
        assert!((10.0..300.0).contains(&count(stuck)) && (10.0..600.0).contains(&count(in_gap)), "{axis}");
        // The cut and the ripple, as the scenario has them: 1.59e-3 m/rad times the force; six waves a revolution.
        let force_n = if axis == "x" { -150.0 } else { 100.0 };
        assert!((of("force_nm")[500] - 1.59e-3 * force_n).abs() < 1e-12 && of("force_nm")[100] == 0.0);
        let largest = of("ripple_nm").iter().fold(0.0_f64, |most, ripple| most.max(ripple.abs()));
        assert!((0.0199..=0.02).contains(&largest), "{largest}");

        // The table goes as far as its velocity takes it. The trapezoid of a velocity v misses the way by h³/12 v''. What
        // changes the table's acceleration is the spring, k/m times the twist that comes with the recorded difference w of the two
        // velocities: h²/12 k/m w at most. And friction that turns around, 0.35 N m over m r_g, at once: h/8 of that.
        let (h, r_g) = (1e-3, 1.59);
        let (mass_kg, stiffness_n_m) = if axis == "x" { (120.0, 400e6) } else { (80.0, 300e6) };
        let velocity = of("velocity_rad_s");
        let twisting = (0..velocity.len()).map(|k| (r_g * velocity[k] - table_mm_s[k]).abs()).fold(0.0, f64::max);
        let turned_mm_s2 = 1e3 * 0.35 / (1e-3 * r_g) / mass_kg;
        let bound = h * h / 12.0 * stiffness_n_m / mass_kg * twisting + h / 8.0 * turned_mm_s2;
        let actual = of("actual_mm");
        let missed: Vec<f64> = (1..actual.len())
            .map(|k| ((actual[k] - actual[k - 1]) / h - 0.5 * (table_mm_s[k] + table_mm_s[k - 1])).abs())
            .collect();
        let worst = missed.iter().copied().fold(0.0, f64::max);
        let rms = (missed.iter().map(|mm_s| mm_s * mm_s).sum::<f64>() / missed.len() as f64).sqrt();
        println!("{axis}: the way misses the velocity by {worst:.3} mm/s, rms {rms:.3} mm/s; bound {bound:.3} mm/s");
        assert!(worst < bound && bound < 5.0 && rms < 0.1, "{axis}: {worst} mm/s, rms {rms} mm/s, bound {bound} mm/s");
    }
}

/// Where the screw is rigid, the table's velocity is the motor's; where nothing else is in the way, so is its place.
#[test]
fn validates_a_rigid_axis_with_friction() {
    let folder = Folder::new();
    let friction = "axes.x.effects.friction.coulomb.coulomb_nm=0.1";
    folder.servosim(&format!("run alpha.toml --quiet --plots none --set {friction}")).assert().success();
    let table = Table::of(&folder, "alpha");
    assert_eq!(table.names, [csv::COLUMNS, csv::DRIVE_COLUMNS].concat(), "one axis is enough, and both tell");
    for axis in ["x", "y"] {
        let of = |name: &str| table.column(&format!("{axis}_{name}"));
        for k in 0..of("actual_mm").len() {
            let exact = 1.59 * of("velocity_rad_s")[k];
            assert!((of("table_mm_s")[k] - exact).abs() <= 1e-13 * exact.abs(), "{axis}, sample {k}");
            assert_eq!(of("motor_mm")[k].to_bits(), of("actual_mm")[k].to_bits());
            assert_eq!(of("measured_mm")[k].to_bits(), of("actual_mm")[k].to_bits());
            assert_eq!(of("measured_rad_s")[k].to_bits(), of("velocity_rad_s")[k].to_bits());
            assert_eq!((of("ripple_nm")[k], of("force_nm")[k], of("in_gap")[k]), (0.0, 0.0, 0.0));
            // The voltage of the last sample is on the motor: 0.716 N m a volt. At rest before the first.
            let volt = if k > 0 { of("voltage_v")[k - 1] } else { 0.0 };
            assert!((of("motor_torque_nm")[k] - volt / 1.3966480446927374).abs() < 1e-12, "{axis}, sample {k}");
            let coulomb = if axis == "x" { 0.1 } else { 0.0 };
            let held = of("stuck")[k] == 1.0;
            assert!(of("friction_nm")[k].abs() == coulomb || (held && of("friction_nm")[k].abs() < coulomb));
            assert!(of("friction_nm")[k] * of("table_mm_s")[k] <= 0.0);
        }
    }
}

#[test]
fn a_model_leaves_no_drives() {
    let folder = Folder::new();
    folder.servosim("run alpha.toml --quiet --plots none").assert().success();
    let names: Vec<String> = topics(&folder, "alpha").into_iter().map(|(topic, ..)| topic).collect();
    assert_eq!(names, ["/servo", "/path", "/trace", "/scene", "/log"]);
    folder.servosim("inspect alpha").assert().success().stdout(contains("/drives").not());
    assert_eq!(Table::of(&folder, "alpha").names, csv::COLUMNS);
    let recording = Recording::open(folder.path("output/alpha.mcap")).unwrap();
    assert!(!recording.drives);
    let alpha = Scenario::builtin("alpha").unwrap();
    assert!(alpha.simulation().unwrap().all(|period| period.drives.is_none()));
    // A cross-coupled controller alone makes the axes more than their models.
    let document = Document::builtin("alpha").unwrap();
    let crossed = format!("{}\n[control.cross_coupling]\nproportional = 1\n", document.text());
    let crossed = Scenario::from_toml(&crossed, "alpha.toml").unwrap();
    assert!(crossed.simulation().unwrap().all(|period| period.drives.is_some()));
}

/// What a file holds of a drive, beside what the drive told.
fn assert_same(read: &DriveSignals, told: &Told, what: &str) {
    let read_bits = [
        read.measured_mm,
        read.measured_rad_s,
        read.motor_mm,
        read.table_mm_s,
        read.motor_torque_nm,
        read.ripple_nm,
        read.friction_nm,
        read.force_nm,
    ];
    let told_bits = [
        told.measured_mm,
        told.measured_rad_s,
        told.motor_mm,
        told.table_mm_s,
        told.motor_torque_nm,
        told.ripple_nm,
        told.friction_nm,
        told.force_nm,
    ];
    assert_eq!(read_bits.map(f64::to_bits), told_bits.map(f64::to_bits), "{what}: {read:?}, {told:?}");
    assert_eq!((read.stuck, read.in_gap), (told.stuck, told.in_gap), "{what}");
}

#[test]
fn validates_what_drives_tell_comes_back_bit_for_bit() {
    let folder = Folder::new();
    folder.servosim("run alpha-real.toml --quiet --plots none").assert().success();
    let periods: Vec<Period<2>> = Scenario::builtin("alpha-real").unwrap().simulation().unwrap().collect();
    let mut samples = Vec::new();
    let recording = Recording::read(folder.path("output/alpha-real.mcap"), |sample| {
        samples.push(*sample);
        Ok(())
    })
    .unwrap();
    assert!(recording.complete && recording.drives && recording.axes == 2);
    assert_eq!(samples.len(), periods.len());
    for (sample, period) in samples.iter().zip(&periods) {
        let (drives, told) = (sample.drives.unwrap(), period.drives.unwrap());
        assert_eq!(drives.time_s.to_bits(), period.time_s.to_bits());
        assert_eq!(sample.servo.x.actual_mm.to_bits(), period.axes[0].actual_mm.to_bits());
        assert!(sample.third.is_none() && sample.third_drive.is_none());
        assert_same(&drives.x, &told[0], &format!("x, sample {}", period.k));
        assert_same(&drives.y, &told[1], &format!("y, sample {}", period.k));
    }
    // The drives of the table are two.
    assert!(periods.iter().any(|period| period.drives.unwrap()[0] != period.drives.unwrap()[1]));
    // Twice the same bytes.
    let bytes = fs::read(folder.path("output/alpha-real.mcap")).unwrap();
    folder.servosim("run alpha-real.toml --quiet --plots none").assert().success();
    assert!(bytes == fs::read(folder.path("output/alpha-real.mcap")).unwrap());
    // 523 bytes a sample, of which 212 are the drives', and the pictures.
    assert!(bytes.len() < 1201 * 523 + 320_000, "{} bytes", bytes.len());
}

/// The recording of alpha on real drives that settles for so long.
fn record(settling_s: f64) -> Vec<u8> {
    let mut scenario = Scenario::builtin("alpha-real").unwrap();
    scenario.settings.settling_s = settling_s;
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("real", "")).unwrap();
    let mut summary = SummaryObserver::<2>::new("real");
    scenario.run(&mut [&mut summary, &mut recorder]).unwrap();
    recorder.finish(&summary.summary()).unwrap().writer
}

fn read(bytes: &[u8]) -> (Recording, Vec<Sample>) {
    let mut samples = Vec::new();
    let recording = Recording::read_from("test", Cursor::new(bytes), |sample| {
        samples.push(*sample);
        Ok(())
    });
    (recording.unwrap(), samples)
}

#[test]
fn time_and_sequence_are_those_of_the_samples() {
    let bytes = record(0.0);
    let (mut last, mut told) = (0, None);
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.log_time >= last && message.publish_time == message.log_time);
        last = message.log_time;
        match message.channel.topic.as_str() {
            "/drives" => assert_eq!(told.replace((message.sequence, message.log_time)), None),
            "/servo" => assert_eq!(told.take(), Some((message.sequence, message.log_time))),
            _ => {}
        }
    }
    assert_eq!(told, None);
}

/// Where each chunk ends, how many samples there are up to there, and whether a drive's message is its last of the two.
fn chunk_ends(bytes: &[u8]) -> Vec<(usize, usize, bool)> {
    let (mut at, mut samples, mut ends) = (8, 0, Vec::new());
    while bytes[at..] != *mcap::MAGIC {
        let length = usize::try_from(u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap())).unwrap();
        let mut drives_last = false;
        if bytes[at] == 0x06 {
            let mut inner = &bytes[at + 9 + 8 + 8 + 8 + 4 + 4 + 8..at + 9 + length];
            while !inner.is_empty() {
                let length = usize::try_from(u64::from_le_bytes(inner[1..9].try_into().unwrap())).unwrap();
                // Channels in their order: /servo, /path, /trace, /scene, /log, /drives.
                match (inner[0], &inner[9..11]) {
                    (0x05, [1, 0]) => (samples, drives_last) = (samples + 1, false),
                    (0x05, [6, 0]) => drives_last = true,
                    _ => {}
                }
                inner = &inner[9 + length..];
            }
            ends.push((at + 9 + length, samples, drives_last));
        }
        at += 9 + length;
    }
    ends
}

#[test]
fn a_cut_file_gives_samples_with_their_drives() {
    let bytes = record(5.0);
    let (_, all) = read(&bytes);
    let ends = chunk_ends(&bytes);
    assert_eq!(ends.last().map(|end| end.1), Some(all.len()));
    // A chunk ends between a sample and its drives, and one does not.
    assert!(ends.iter().any(|end| end.2) && ends.iter().any(|end| !end.2), "{ends:?}");
    let cuts = (1..bytes.len()).filter(|cut| cut % 499_979 == 0 || *cut < 20);
    for cut in cuts.chain(ends.iter().flat_map(|(end, ..)| [end - 1, *end, end + 1])) {
        let (recording, samples) = read(&bytes[..cut]);
        let expected = ends.iter().rev().find(|(end, ..)| *end <= cut).map_or(0, |(_, samples, _)| *samples);
        assert!(samples == all[..expected], "cut at {cut}: {} samples", samples.len());
        assert!(samples.iter().all(|sample| sample.drives.is_some()));
        assert!(!recording.complete && recording.drives == (expected > 0), "cut at {cut}");
    }
    // As a user sees it: lines of one length, and the note.
    let folder = Folder::new();
    folder.write("cut.mcap.partial", &bytes[..ends[2].0 + 77]);
    let text = folder.servosim("inspect cut.mcap.partial --csv").assert().success();
    let text = String::from_utf8(text.get_output().stdout.clone()).unwrap();
    assert_eq!(text.lines().count(), ends[2].1 + 1);
    assert!(text.lines().all(|line| line.split(',').count() == 50));
    folder.servosim("plot cut.mcap.partial --output plots").assert().success();
}

#[test]
fn a_run_in_which_the_drives_fall_silent_is_refused() {
    let scenario = Scenario::builtin("alpha-real").unwrap();
    let stop = std::sync::atomic::AtomicBool::new(true);
    for first in [true, false] {
        let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("odd", "")).unwrap();
        let run = if first { scenario.clone() } else { scenario.model() };
        run.simulation().unwrap().run(&Limits::default(), Some(&stop), &mut [&mut recorder]).unwrap();
        let mut periods = scenario.simulation().unwrap().skip(1);
        let mut period = periods.next().unwrap();
        period.drives = period.drives.filter(|_| first);
        Observer::period(&mut recorder, &period).unwrap();
        let mut period = periods.next().unwrap();
        period.drives = period.drives.filter(|_| !first);
        let error = Observer::period(&mut recorder, &period).unwrap_err();
        assert!(error.to_string().contains("only some of the samples have drive signals"), "{error}");
    }
}

#[test]
fn the_three_drives_of_a_program_are_recorded() {
    const PART: &str = "G0 X0 Y0 Z5\nG1 Z0 F600\nX20 F3000\nG3 X20 Y20 I0 J10\nG1 X0\nY0\nG0 Z5\nM30\n";
    let real = Scenario::builtin("alpha-real").unwrap();
    let ([x, y], [drive_x, drive_y]) = (real.axes, real.drives.clone());
    let machine = Machine {
        axes: [x, y, x],
        settings: real.settings,
        rapid_mm_s: 200.0,
        accel_mm_s2: 2000.0,
        jerk_mm_s3: 50_000.0,
        lateral_accel_mm_s2: 1000.0,
        corner_velocity_step_mm_s: 5.0,
        junction_accel_step_mm_s2: 50.0,
    };
    let blocks = || Reader::new(PART.as_bytes(), "part.nc", Reading::default());
    let metadata = ProgramStatistics::of(blocks(), &machine).unwrap();
    let drives = [drive_x.clone(), drive_y, drive_x];
    let mut recorder = Recorder::new(Vec::new(), RecordingMetadata::new("part", "")).unwrap();
    let mut summary = SummaryObserver::<3>::new("part");
    let mut told = Vec::new();
    let mut note = |period: &Period<3>| told.push(period.drives.unwrap());
    let run = ProgramRun::with_drives(blocks(), &machine, Some((&drives, None))).unwrap();
    run.run(&metadata, &Limits::default(), None, &mut [&mut summary, &mut recorder, &mut note]).unwrap();
    let bytes = recorder.finish(&summary.summary()).unwrap().writer;
    let (recording, samples) = read(&bytes);
    assert!(recording.drives && recording.axes == 3 && recording.complete);
    assert!(recording.topics.iter().any(|t| t.topic == "/drives" && t.schema == "servosim.Drives3"));
    assert_eq!(samples.len(), told.len());
    let mut table = Vec::new();
    csv::write_header(&mut table, 3, true).unwrap();
    for (k, (sample, told)) in samples.iter().zip(&told).enumerate() {
        let (drives, third) = (sample.drives.unwrap(), sample.third_drive.unwrap());
        for (read, told) in [drives.x, drives.y, third.z].iter().zip(told) {
            assert_same(read, told, &format!("sample {k}"));
        }
        csv::write_row(&mut table, sample).unwrap();
    }
    assert!(told.iter().any(|[.., z]| z.motor_mm > 4.9) && told.iter().any(|[.., z]| z.motor_mm < 0.1));
    let table = String::from_utf8(table).unwrap();
    let names: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    assert_eq!(names, [csv::COLUMNS, csv::THIRD_COLUMNS, csv::DRIVE_COLUMNS, csv::THIRD_DRIVE_COLUMNS].concat());
    let at = names.iter().position(|name| *name == "z_motor_mm").unwrap();
    for (line, told) in table.lines().skip(1).zip(&told) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!((cells.len(), cells[at].to_bits()), (names.len(), told[2].motor_mm.to_bits()));
    }
    // And as a user runs it: the program's own recording, its CSV and its plots.
    let folder = Folder::new();
    folder.write("part.mcap", &bytes);
    assert_eq!(Table::of(&folder, "part.mcap").names, names);
    folder.servosim("plot part.mcap --output plots").assert().success();
}

#[cfg(target_os = "linux")]
#[test]
fn without_threads_from_the_system_a_run_goes_on_on_one_core() {
    use std::process::Command;
    let folder = Folder::new();
    folder.servosim("run alpha-real --plots none --quiet").assert().success();
    // The limit does not bind root: somebody else runs it then.
    let open = Command::new("chmod").args(["-R", "777"]).arg(folder.0.path()).status();
    let id = Command::new("id").arg("-u").output().map(|output| output.stdout);
    let is_root = id.is_ok_and(|id| id == b"0\n");
    let limited = |command: &str| {
        let script = format!("ulimit -u 1 && exec '{}' {command}", env!("CARGO_BIN_EXE_servosim"));
        let mut process = if is_root {
            let mut process = Command::new("setpriv");
            process.args(["--reuid", "54321", "--clear-groups", "bash", "-c", &script]);
            process
        } else {
            let mut process = Command::new("bash");
            process.args(["-c", &script]);
            process
        };
        process.current_dir(folder.0.path()).output()
    };
    // Without setpriv, or where that user may not run the program, there is nothing to be seen.
    let can = limited("--version").is_ok_and(|output| output.status.success());
    if !open.is_ok_and(|status| status.success()) || !can {
        eprintln!("skipped: no way to run as a user whom the limit binds");
        return;
    }
    let sweep = "sweep alpha --vary axes.x.pdff.kpp=60:140:5 --plots none --output one";
    for command in
        ["run alpha-real --plots none --output one", "compare alpha-real --plots none", sweep, "test alpha heart"]
    {
        let output = limited(command).unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !stderr.contains("panicked"), "{command}: {:?} {stderr}", output.status);
    }
    let [one, many] = ["one", "output"].map(|name| fs::read(folder.path(name).join("alpha-real.mcap")).unwrap());
    assert!(one == many, "the same bytes on one core");
}
