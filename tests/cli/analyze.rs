//! `servosim analyze` as a user types it.

use std::fs;

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::{contains, starts_with};
use serde_json::Value;

fn json(folder: &Folder, arguments: &str, code: i32) -> Value {
    let output = folder.servosim(&format!("analyze {arguments} --format json --plots none")).assert().code(code);
    serde_json::from_slice(&output.get_output().stdout).unwrap()
}

#[test]
fn the_table_shows_both_axes_and_the_plots_are_written() {
    let folder = Folder::new();
    folder
        .servosim("analyze alpha")
        .assert()
        .success()
        .stdout(starts_with("alpha: servo loops, sampled every 1 ms, no delay\n"))
        .stdout(contains("\n  peak sensitivity Ms                       1.5635        1.5620\n"))
        .stdout(contains("\n  stable from this gain factor on           0.2114        0.2095\n"))
        .stdout(contains("\n    and up to this one                      3.3081        3.3190\n"))
        .stdout(contains("\n  phase margin                               37.76         37.80  °\n"))
        .stdout(contains("\n    at crossover                             670.1         668.3  rad/s\n"))
        .stdout(contains("X and Y: conditionally stable").and(contains("saturation (±5 V) is too little gain")))
        .stdout(contains("full feedforward (1/r_g = 0.6289 rad/mm)"))
        .stderr("wrote output/alpha-bode.svg, output/alpha-nyquist.svg and output/alpha-step.svg\n");
    for (plot, text) in
        [("bode", "37.76° at 106.7 Hz (670.1 rad/s)"), ("nyquist", "X: −1/3.308"), ("step", "settled in 24 ms")]
    {
        let svg = fs::read_to_string(folder.path(&format!("output/alpha-{plot}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains(text), "{plot}");
    }
    assert_eq!(fs::read_dir(folder.path("output")).unwrap().count(), 3);
}

#[test]
fn json_is_exactly_one_object_with_units_in_its_keys() {
    let folder = Folder::new();
    let value = json(&folder, "heart", 0);
    assert_eq!(
        (&value["scenario"], &value["period_s"], &value["delay_samples"]),
        (&"heart".into(), &1e-3.into(), &0.into())
    );
    let axes = value["axes"].as_array().unwrap();
    for (axis, ms) in axes.iter().zip([1.6033, 1.6167]) {
        assert!((axis["peak_sensitivity"].as_f64().unwrap() - ms).abs() < 5e-5, "{axis}");
        assert_eq!(axis["stable"], true);
        assert_eq!(axis["poles"].as_array().unwrap().len(), 3);
        for key in ["phase_margin_deg", "crossover_rad_s", "delay_margin_s", "bandwidth_rad_s", "gain_factor_up"] {
            assert!(axis[key].as_f64().unwrap() > 0.0, "{key}");
        }
        assert!(axis["step_feedback"]["settling_s"].as_f64().unwrap() < 0.1);
    }
    assert!(!folder.path("output").exists());
    // The same bytes again; --quiet leaves what was asked for.
    let text = |more: &str| {
        let command = format!("analyze heart --format json --plots none {more}");
        folder.servosim(&command).assert().success().stderr("").get_output().stdout.clone()
    };
    assert_eq!(text(""), text("--quiet"));
    folder.servosim("analyze heart --quiet --output here").assert().success().stdout("").stderr("");
    assert!(folder.path("here/heart-bode.svg").is_file());
}

#[test]
fn an_unstable_loop_exits_with_3_and_says_what_gain_would_do() {
    let folder = Folder::new();
    let delayed = "analyze alpha --set control.delay_samples=1";
    let told = "unstable; kpv times a factor from 0.4534 to 0.9685 would make it stable";
    folder
        .servosim(delayed)
        .assert()
        .code(3)
        .stdout(contains("UNSTABLE").and(contains(told)).and(contains("bandwidth").not()))
        .stderr(starts_with("wrote output/alpha-bode.svg"));
    folder.servosim(&format!("{delayed} --quiet --plots none")).assert().code(3).stdout("").stderr(contains(told));
    let value = json(&folder, "alpha --set control.delay_samples=1", 3);
    let axis = &value["axes"][0];
    assert_eq!(
        (&axis["stable"], &axis["peak_sensitivity"], &axis["step"]),
        (&false.into(), &Value::Null, &Value::Null)
    );
    // And it is so.
    let factor = axis["stable_gain_factors"][0][1].as_f64().unwrap();
    for (share, stable) in [(0.999, true), (1.001, false)] {
        let kpv = 1.19 * factor * share;
        let value = json(
            &folder,
            &format!("alpha --set control.delay_samples=1 --set axes.x.pdff.kpv={kpv} --set axes.y.pdff.kpv=1.4"),
            if stable { 0 } else { 3 },
        );
        assert_eq!(value["axes"][0]["stable"], stable);
    }
}

#[test]
fn warnings_are_worth_telling() {
    let folder = Folder::new();
    let table = |set: &str, code: i32| {
        let output = folder.servosim(&format!("analyze alpha --plots none {set}")).assert().code(code);
        String::from_utf8(output.get_output().stdout.clone()).unwrap()
    };
    let text = table("--set axes.x.pdff.kpv=3", 0);
    assert!(text.contains("X: peak sensitivity 4.20") && text.contains("is high"), "{text}");
    let text = table("--set axes.x.pdff.kpp=0", 3);
    assert!(text.contains("X: does not hold its position: kpp is 0"), "{text}");
    let text = table("--set axes.x.pdff.kiv=0 --set axes.x.pdff.kpf=0.6", 0);
    assert!(!text.contains("X and Y") && !text.contains("\n  X:"), "{text}");
    assert!(text.contains("gain factor on                0        0.2095"), "{text}");
    let text = table("--set axes.x.pdff.kpv=1e5", 3);
    assert!(text.contains("X: unstable; kpv times a factor"), "{text}");
    let text = table("--set axes.x.pdff.kpp=1e6 --set axes.x.pdff.kvf=0", 3);
    assert!(text.contains("no loop gain would change that"), "{text}");
}

#[test]
fn any_sound_loop_can_be_drawn() {
    let folder = Folder::new();
    for set in [
        "axes.x.pdff.kpv=0",
        "axes.x.pdff.kpv=1e9",
        "axes.x.pdff.kpp=1e-9",
        "axes.x.plant.first_order.time_constant_s=1e-9",
        "axes.x.plant.first_order.time_constant_s=1e9",
        "axes.x.plant.first_order.gain_rad_s_v=1e-9",
        "axes.x.drive.transmission_mm_rad=1e9",
        "control.period_s=1e-6",
        "control.period_s=0.05",
        "control.derivative=exact",
    ] {
        let output = folder.servosim(&format!("analyze alpha --set {set}")).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(matches!(output.status.code(), Some(0 | 3)), "{set}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(!text.contains("NaN") && text.contains("loop"), "{set}: {text}");
        for plot in ["bode", "nyquist", "step"] {
            let svg = fs::read_to_string(folder.path(&format!("output/alpha-{plot}.svg"))).unwrap();
            assert!(!svg.contains("NaN") && svg.len() < 2_000_000, "{set} {plot} {}", svg.len());
        }
    }
}

#[test]
fn bad_input_is_told() {
    let folder = Folder::new();
    folder.servosim("analyze nothing").assert().code(2).stdout("").stderr(contains("there is no scenario `nothing`"));
    folder.servosim("analyze alpha --set axes.x.pdff.kpp=-1").assert().code(2).stdout("").stderr(contains("kpp"));
    folder.servosim("analyze alpha --set axes.x.pdff.kp=1").assert().code(2).stdout("").stderr(contains("kpp"));
    folder.servosim("analyze").assert().code(2).stderr(contains("<SCENARIO>"));
    folder.servosim("analyze alpha --plots pdf").assert().code(2).stderr(contains("svg, png, none"));
    folder.write("file", "");
    let blocked = folder.servosim("analyze alpha --output file").assert().code(2);
    // The metrics come all the same.
    blocked.stdout(contains("phase margin")).stderr(contains("it is a file, not a folder"));
    fs::create_dir_all(folder.path("out/alpha-bode.svg")).unwrap();
    folder.servosim("analyze alpha --output out").assert().code(1).stderr(contains("cannot write out/alpha-bode.svg"));
    let left: Vec<_> = fs::read_dir(folder.path("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["alpha-bode.svg"]);
}

#[test]
fn a_drive_as_it_is_is_analysed_as_it_is() {
    let folder = Folder::new();
    // A sample of delay is a sample of delay, wherever it is said to be.
    let own = json(&folder, "alpha --set control.delay_samples=1", 3);
    let drive = json(&folder, "alpha --set axes.x.effects.delay.samples=1 --set axes.y.effects.delay.samples=1", 3);
    for (own, drive) in own["axes"].as_array().unwrap().iter().zip(drive["axes"].as_array().unwrap()) {
        let radius = |axis: &Value| axis["pole_radius"].as_f64().unwrap();
        assert!((radius(own) - radius(drive)).abs() < 1e-9);
        assert_eq!((&drive["stable"], &drive["delay_samples"]), (&false.into(), &1.0.into()));
        assert_eq!(own["warnings"], drive["warnings"]);
    }
    folder
        .servosim("analyze alpha-real")
        .assert()
        .success()
        .stdout(contains("X and Y: in the loop: mismatch, delay of 0.3 samples, current loop, two masses\n"))
        .stdout(contains("X and Y: neglected, not linear: encoder quantisation, noise, DAC, friction, backlash"));
    let svg = fs::read_to_string(folder.path("output/alpha-real-bode.svg")).unwrap();
    assert!(svg.contains("With mismatch, delay of 0.3 samples, current loop, two masses"));
    // Another controller is another loop.
    let pid = json(&folder, "alpha --set axes.x.controller.pid={}", 0);
    let (x, y) = (&pid["axes"][0], &pid["axes"][1]);
    assert_eq!((&x["controller"], &y["controller"]), (&"pid".into(), &"pdff".into()));
    assert!((x["peak_sensitivity"].as_f64().unwrap() - 1.5635).abs() > 0.01);
    // A run tells of it too.
    folder
        .servosim("run alpha --plots none --set axes.x.effects.delay.samples=1")
        .assert()
        .stderr(contains("note: the loop of axis x is unstable, even if this run does not show it"));
}
