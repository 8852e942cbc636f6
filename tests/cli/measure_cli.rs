//! `servosim measure` and `servosim learn` as a user types them.

use std::fs;
use std::process::{Command as Process, Stdio};
use std::time::Duration;

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::{contains, starts_with};
use serde_json::Value;

fn json(folder: &Folder, command: &str, code: i32) -> Value {
    let output = folder.servosim(&format!("{command} --format json --plots none")).assert().code(code);
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

#[test]
fn the_circle_is_told_drawn_and_written() {
    let folder = Folder::new();
    folder
        .servosim("measure circle alpha --radius-mm 20")
        .assert()
        .success()
        .stdout(starts_with("alpha: circular test, radius 20 mm at 100 mm/s\n"))
        .stdout(contains("circular deviation G").and(contains("bidirectional deviation G(b)")))
        .stdout(contains("spike at 90° (Y turns back)"))
        .stderr("wrote output/alpha-circle-ccw.mcap, output/alpha-circle-cw.mcap and output/alpha-circle.svg\n");
    // Every control period of both directions is recorded: the measured turns are there, to the bit.
    let radial = |direction: &str| -> Vec<f64> {
        let csv = folder.servosim(&format!("inspect output/alpha-circle-{direction}.mcap --csv")).assert().success();
        let csv = String::from_utf8(csv.get_output().stdout.clone()).unwrap();
        let mut lines = csv.lines();
        let column = |name: &str, header: &str| header.split(',').position(|field| field == name).unwrap();
        let header = lines.next().unwrap();
        let (x, y) = (column("x_actual_mm", header), column("y_actual_mm", header));
        let value = |line: &str, column: usize| -> f64 { line.split(',').nth(column).unwrap().parse().unwrap() };
        lines.map(|line| 1e3 * (value(line, x).hypot(value(line, y)) - 20.0)).collect()
    };
    let test = json(&folder, "measure circle alpha --radius-mm 20", 0);
    for (i, direction) in ["ccw", "cw"].into_iter().enumerate() {
        let largest = test["directions"][i]["radial_max_um"].as_f64().unwrap();
        assert!(radial(direction).iter().any(|um| (um - largest).abs() < 1e-9), "{direction}: {largest}");
    }
    let svg = fs::read_to_string(folder.path("output/alpha-circle.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("µm a division") && svg.contains("270°"));
    let value = json(
        &folder,
        "measure circle alpha --radius-mm 5 --feed-mm-s 50 --centre-mm -10,4 --turns 2 --set axes.x.effects.backlash.gap_um=5",
        0,
    );
    assert_eq!(value["turns"], 2);
    assert_eq!(value["directions"].as_array().unwrap().len(), 2);
    let lost = value["directions"][1]["lost_motion_um"][0].as_f64().unwrap();
    assert!((lost - 5.0).abs() < 0.25, "{lost}");
}

#[test]
fn the_response_agrees_with_its_model() {
    let folder = Folder::new();
    folder
        .servosim("measure response alpha --points 12 --plots png")
        .assert()
        .success()
        .stdout(contains("bandwidth (-3 dB)").and(contains("largest distance from the analysis")))
        .stderr("wrote output/alpha-response.png\n");
    let value = json(&folder, "measure response alpha --points 12 --high-hz 100", 0);
    for axis in value["axes"].as_array().unwrap() {
        assert!(axis["model_deviation_db"].as_f64().unwrap() < 0.1);
        assert!(axis["model_deviation_deg"].as_f64().unwrap() < 0.5);
        assert_eq!(axis["points"].as_array().unwrap().len(), 12);
    }
}

#[test]
fn step_and_ramp_are_told() {
    let folder = Folder::new();
    folder
        .servosim("measure step alpha --step-um 1 --window-um 0.02")
        .assert()
        .success()
        .stdout(contains("step: rise, 10 to 90 %").and(contains("following error at 100 mm/s")))
        .stderr("wrote output/alpha-steps.svg\n");
    let value = json(&folder, "measure step alpha", 0);
    assert_eq!((value["warnings"].as_array().unwrap().len(), &value["step_um"]), (0, &2.0.into()));
    assert!(value["axes"][0]["ramp"]["following_error_um"].as_f64().unwrap() < -100.0);
}

#[test]
fn a_loop_that_is_unstable_or_locks_up_exits_with_3() {
    let folder = Folder::new();
    for set in ["control.delay_samples=1", "axes.y.effects.delay.samples=1"] {
        folder
            .servosim(&format!("measure response alpha --points 3 --plots none -q --set {set}"))
            .assert()
            .code(3)
            .stdout("")
            .stderr(contains("has no frequency response: its loop is unstable"));
    }
    folder
        .servosim("measure step alpha --plots none --set axes.x.effects.delay.samples=3")
        .assert()
        .code(3)
        .stdout(contains("X: the loop is unstable").and(contains("X: the step locks the loop up")));
    folder
        .servosim("measure step alpha --plots none -q --set axes.x.effects.delay.samples=3")
        .assert()
        .code(3)
        .stdout("")
        .stderr(contains("X: the loop is unstable"));
}

/// What ties the axes together is in no measurement of one of them, and what was learned belongs to another motion.
#[test]
fn what_takes_no_part_is_told() {
    let folder = Folder::new();
    let coupled = "alpha --set control.cross_coupling.proportional=0.5";
    let alone = contains("without the cross-coupled control, which ties the axes together");
    folder.servosim(&format!("measure step {coupled} --plots none")).assert().code(0).stdout(alone.clone());
    folder
        .servosim(&format!("measure response {coupled} --points 3 --plots none"))
        .assert()
        .code(0)
        .stdout(alone.clone());
    folder.servosim(&format!("measure circle {coupled} --plots none")).assert().code(0).stdout(alone.clone().not());
    folder.servosim("measure step alpha --plots none").assert().code(0).stdout(alone.not());
    // The circle has it: it is rounder, and its metrics are others.
    let deviation =
        |scenario: &str| json(&folder, &format!("measure circle {scenario}"), 0)["mean_radial_deviation_um"].clone();
    let (with, without) = (deviation(coupled), deviation("alpha"));
    assert!(with.as_f64().unwrap().abs() < 0.9 * without.as_f64().unwrap().abs(), "{with} {without}");
    folder.servosim("learn alpha --runs 2 --plots none").assert().code(0);
    for kind in ["circle", "step", "response --points 3"] {
        folder
            .servosim(&format!("measure {kind} alpha --plots none --set learned.file=output/alpha-learned.csv"))
            .assert()
            .code(0)
            .stdout(contains("without the learned corrections"));
    }
}

#[test]
fn learning_that_gains_nothing_keeps_the_first_run_and_exits_with_3() {
    let folder = Folder::new();
    // No feedforward and slow loops: the corrections saturate the drives.
    let set = "--set axes.x.pdff.kpf=0 --set axes.y.pdff.kpf=0 --set axes.x.pdff.kpp=40 --set axes.y.pdff.kpp=40";
    folder
        .servosim(&format!("learn alpha --runs 3 {set} --plots none"))
        .assert()
        .code(3)
        .stdout(contains("nothing is gained: no run has a smaller contouring error than the first"))
        .stderr(contains("to run with it").not());
    // What is written is no correction.
    let csv = fs::read_to_string(folder.path("output/alpha-learned.csv")).unwrap();
    assert!(csv.lines().skip(1).all(|line| line.ends_with(",0,0") || line.ends_with(",0.0,0.0")), "{csv}");
}

#[test]
fn what_was_learned_is_written() {
    let folder = Folder::new();
    folder
        .servosim("learn alpha --runs 4")
        .assert()
        .success()
        .stdout(contains("tracking rms").and(contains("best")))
        .stderr(
            "wrote output/alpha-learned.csv and output/alpha-learning.svg\n\
             to run with it: --set learned.file=output/alpha-learned.csv, or at the top of the scenario: learned.file = \
             \"output/alpha-learned.csv\"\n",
        );
    let csv = fs::read_to_string(folder.path("output/alpha-learned.csv")).unwrap();
    assert!(csv.starts_with("sample,time_s,x_um,y_um\n0,0.000000000,"));
    assert_eq!(csv.lines().count(), 1202);
    let value = json(&folder, "learn alpha --runs 3 --gain 0.5", 0);
    assert_eq!((value["runs"].as_array().unwrap().len(), &value["best_run"]), (3, &3.into()));
    folder
        .servosim("learn alpha --runs 40 --gain 1.5 --cutoff-hz 150 --quiet --plots none --set axes.x.effects.delay.samples=0.5")
        .assert()
        .code(3)
        .stdout("")
        .stderr(contains("learning diverges: in run").and(contains("the learning gain of 1.5 is too high")));
}

#[test]
fn bad_input_is_told() {
    let folder = Folder::new();
    for (command, told) in [
        ("measure", "Usage"),
        ("measure circle nothing", "there is no scenario `nothing`"),
        ("measure circle alpha --radius-mm -3", "radius_mm"),
        ("measure circle alpha --radius-mm 0", "radius_mm = 0 is out of range"),
        ("measure circle alpha --radius-mm 0.1", "control periods"),
        ("measure circle alpha --centre-mm 3", "takes two numbers"),
        ("measure circle alpha --centre-mm 1e9,0", "centre_mm = 1e9 is out of range"),
        ("measure circle alpha --radius-mm 1e300", "radius_mm = 1e300 is out of range"),
        ("measure circle alpha --turns 0", "turns = 0 is out of range"),
        ("measure response alpha --high-hz 900", "high_hz = 900 is out of range"),
        (
            "measure response alpha --high-hz 480",
            "from 0.0005 to 475, 0.95 of the Nyquist frequency 0.5/period_s: nearer to it",
        ),
        ("measure response alpha --points 1", "points = 1 is out of range"),
        ("measure step alpha --step-um 1 --window-um 1", "smaller than the step of 1 µm"),
        ("measure step alpha --step-um nan", "step_um = NaN is out of range"),
        ("measure step alpha --set axes.x.pdff.kp=1", "kpp"),
        ("learn alpha --gain 2", "from 2 on it would grow"),
        ("learn alpha --gain -0.5", "gain = -0.5 is out of range"),
        ("learn alpha --runs 1", "runs = 1 is out of range"),
        ("learn alpha --cutoff-hz 1e-9", "one period in the whole run"),
        ("learn alpha --cutoff-hz 600", "cutoff_hz = 600 is out of range"),
    ] {
        folder.servosim(command).assert().code(2).stdout("").stderr(contains(told));
    }
    assert!(!folder.path("output").exists());
    folder.servosim("learn alpha --set control.delay_samples=1").assert().code(3).stderr(contains("is not stable"));
    folder
        .servosim("learn alpha --runs 2 -q --set axes.x.effects.delay.samples=3")
        .assert()
        .code(3)
        .stderr(contains("lock"));
    folder
        .servosim("measure circle alpha --feed-mm-s 400 --plots none -q")
        .assert()
        .code(3)
        .stdout("")
        .stderr(contains("locked up"));
}

/// Each says that it was interrupted, and ends with 1.
#[cfg(unix)]
#[test]
fn an_interrupt_is_answered() {
    let folder = Folder::new();
    let long = [
        "measure response alpha --points 1000 --low-hz 0.002 --high-hz 0.003",
        "compare alpha --set control.settling_s=9000",
        "learn alpha --runs 1000 --set control.settling_s=900",
    ];
    let children =
        long.map(|command| folder.process(command).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap());
    std::thread::sleep(Duration::from_secs(2));
    for (child, command) in children.into_iter().zip(long) {
        assert!(Process::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command}: {stderr}");
        assert!(stderr.contains("interrupted"), "{command}: {stderr}");
    }
}
