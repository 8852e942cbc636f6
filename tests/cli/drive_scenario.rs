//! Detailed drives, from the scenario file to the table of `servosim compare`.

use std::fs;
use std::sync::atomic::AtomicBool;

use crate::common::folder::Folder;
use nalgebra::Vector2;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use servosim::comparison::{Column, Comparison, Row};
use servosim::scenario::{Document, Scenario};
use servosim::servo::effects::{Integration, VelocityEstimate};
use servosim::servo::{ControllerGains, ControllerKind};
use servosim::simulation::Period;

fn alpha_with(tables: &str) -> Scenario {
    let document = Document::builtin("alpha").unwrap();
    Scenario::from_toml(&format!("{}\n{tables}\n", document.text()), "alpha.toml").unwrap()
}

/// The same tables on both axes: `@` stands for the axis.
fn on_both(tables: &str) -> Scenario {
    alpha_with(&["x", "y"].map(|axis| tables.replace('@', axis)).join("\n"))
}

#[test]
fn without_a_table_the_axes_are_their_models() {
    assert!(Scenario::builtin("alpha").unwrap().is_model());
    let real = Scenario::builtin("alpha-real").unwrap();
    assert!(!real.is_model());
    assert!(real.model().is_model());
    // The model of alpha-real is alpha, to the last bit.
    let (model, alpha) =
        (real.model().run(&mut []).unwrap(), Scenario::builtin("alpha").unwrap().run(&mut []).unwrap());
    assert_eq!(model.max_contour_error_um.to_bits(), alpha.max_contour_error_um.to_bits());
    assert_eq!(model.rms_voltage_v.to_bits(), alpha.rms_voltage_v.to_bits());
}

/// A controller table whose gains are those of the PDFF loop with `kvf = 1` and no feedforward is a PDFF loop.
#[test]
fn validates_p_pi_against_pdff_with_its_gains() {
    let p_pi = on_both("[axes.@.controller.p_pi]");
    let mut pdff = Scenario::builtin("alpha").unwrap();
    for axis in &mut pdff.axes {
        axis.pdff.kvf = 1.0;
        axis.pdff.kpf_rad_mm = 0.0;
    }
    let (a, b) = (p_pi.run(&mut []).unwrap(), pdff.run(&mut []).unwrap());
    // 1201 samples of a stable loop: rounding only.
    assert!((a.max_contour_error_um - b.max_contour_error_um).abs() < 1e-6, "{a:?} {b:?}");
    assert!((a.rms_voltage_v - b.rms_voltage_v).abs() < 1e-9);
}

#[test]
fn every_effect_of_alpha_real_counts_and_the_table_names_it() {
    let real = Scenario::builtin("alpha-real").unwrap();
    let comparison = Comparison::of(&real, &[Column::Own]).unwrap();
    let names: Vec<&str> = comparison.lines.iter().map(|line| line.drives.as_str()).collect();
    assert_eq!(
        names,
        [
            "ideal model",
            "mismatch",
            "encoder",
            "noise",
            "delay",
            "dac",
            "current loop",
            "two mass",
            "friction",
            "backlash",
            "pitch",
            "ripple",
            "force",
            "all effects",
            "with compensation"
        ]
    );
    let rms: Vec<f64> = comparison.lines.iter().map(|line| line.runs[0].unwrap().rms_contour_error_um).collect();
    for (name, value) in names.iter().zip(&rms).skip(1) {
        assert!((value - rms[0]).abs() > 1e-9 * rms[0], "{name} changes nothing: {value} {}", rms[0]);
    }
    // The last row is the scenario.
    let whole = real.run(&mut []).unwrap();
    assert_eq!(rms.last().unwrap().to_bits(), whole.rms_contour_error_um.to_bits());
    assert_eq!(Row::of_scenario(&real.model()), [Row::Model]);
}

/// Where the model is all there is, zero-phase tracking of both axes leaves what the filter cannot cancel: far less than the lag.
#[test]
fn zero_phase_tracking_takes_the_lag_away() {
    let plain = Scenario::builtin("alpha").unwrap().run(&mut []).unwrap();
    let tracking = on_both("[axes.@.compensation]\nzero_phase = true").run(&mut []).unwrap();
    assert!(tracking.max_tracking_error_um < 0.05 * plain.max_tracking_error_um, "{tracking:?}");
    assert!(tracking.max_contour_error_um < 0.05 * plain.max_contour_error_um, "{tracking:?}");
}

#[test]
fn cross_coupling_makes_the_contouring_error_smaller() {
    let plain = Scenario::builtin("alpha").unwrap().run(&mut []).unwrap();
    let coupled = alpha_with("[control.cross_coupling]\nproportional = 0.5").run(&mut []).unwrap();
    assert!(coupled.max_contour_error_um < 0.9 * plain.max_contour_error_um, "{coupled:?}");
}

#[test]
fn controllers_have_gains_of_the_same_loops() {
    let alpha = Scenario::builtin("alpha").unwrap();
    let columns = ControllerKind::ALL.map(Column::Controller);
    let comparison = Comparison::of(&alpha, &columns).unwrap();
    assert_eq!(comparison.columns, ["pdff", "p-pi", "pid", "cascade"]);
    let errors: Vec<f64> = comparison.lines[0].runs.iter().map(|run| run.unwrap().max_contour_error_um).collect();
    let own = alpha.run(&mut []).unwrap().max_contour_error_um;
    assert_eq!(errors[0].to_bits(), own.to_bits());
    // All of the feedforward: less than with part of it.
    assert!(errors[3] < 0.5 * errors[0], "{errors:?}");
    let ControllerGains::Pid(pid) = ControllerGains::like(ControllerKind::Pid, &alpha.axes[0], &alpha.settings) else {
        panic!("no PID gains");
    };
    // kp = k_T kv (kp + ki/r_g), by hand: 1.39665 · 1.19 · (97.38 + 252.8/1.59).
    assert!((pid.proportional_v_mm - 426.09).abs() < 0.01, "{pid:?}");
}

#[test]
fn bad_values_are_told_where_they_are() {
    for (tables, problem, marked) in [
        ("[axes.x.effects.two_mass]\ntable_mass_kg = 100\nstiffness_n_um = -1", "stiffness_n_um = -1", "-1"),
        ("[axes.x.effects.two_mass]\ntable_mass_kg = 1e6\nstiffness_n_um = 100", "lighter", "1e6"),
        ("[axes.y.effects.friction.coulomb]\ncoulomb_nm = 0.2\nstatic_nm = 0.1", "never sticks", "0.1"),
        ("[axes.x.effects.friction.coulomb]\ncoulomb_nm = 0.2\nstatic_nm = 100", "never slip", "100"),
        ("[axes.x.effects.friction.lu_gre]\ncoulomb_nm = 0.2\nstiffness_nm_rad = 0", "stiffness_nm_rad = 0", "= 0"),
        ("[axes.x.compensation.notch]\nfrequency_hz = 600", "Nyquist", "600"),
        ("[axes.x.compensation.low_pass]\nfrequency_hz = 500", "Nyquist", "500"),
        ("[axes.x.effects.encoder]\nvelocity = \"observer\"\nvelocity_hz = 400", "observer is unstable", "400"),
        ("[axes.x.effects.delay]\nsamples = 2000", "no drive computes for longer", "2000"),
        ("[axes.x.effects.dac]\nbits = 1", "from 2 to 32", "1"),
        ("[axes.x.effects.dac]\nbits = -5", "from 2 to 32", "-5"),
        ("[axes.x.effects.backlash]\ngap_um = nan", "gap_um = NaN", "nan"),
        ("[axes.x.effects.pitch]\npoints_mm_um = [[0, 0], [0, 1]]", "rise strictly", "[[0, 0], [0, 1]]"),
        ("[axes.x.effects.force.over_time]\npoints_s_n = []", "at least 1", "[]"),
        ("[[axes.x.effects.ripple.harmonics]]\nper_revolution = 0\namplitude_nm = 1", "per_revolution = 0", "0"),
        ("[axes.x.effects.mismatch]\ngain_factor = 0", "gain_factor = 0", "0"),
        ("[axes.x.effects.current_loop]\nbandwidth_hz = -3", "bandwidth_hz", "-3"),
        ("[axes.x.controller.pid]\nfilter_hz = 0", "filter_hz = 0", "0"),
        ("[axes.x.controller.p_pi]\n[axes.x.compensation]\nzero_phase = true", "undoes the PDFF loop", "true"),
        ("[control.cross_coupling]\nproportional = -1", "proportional = -1", "-1"),
        ("[axes.x.effects.fricton]\ngap_um = 1", "fricton", "fricton"),
        ("[axes.x.effects.friction]\nkind = \"coulomb\"\ncoulomb_nm = 0.2", "unknown key `kind`", "kind"),
        (
            "[axes.x.effects.friction]\ncoulomb_nm = 0.2\nstatic_nm = 0.3",
            "[axes.x.effects.friction.coulomb]",
            "coulomb_nm",
        ),
        ("[axes.x.effects.friction.coulomb]\ncoulomb_nm = 3.6", "= 3.5800 N m", "3.6"),
        ("[axes.x.effects.encoder]\nvelocity = \"observer\"\nvelocity_hz = 140", "below 131.8 Hz", "140"),
        ("[axes.x.effects.encoder]\nvelocity = \"observer\"\nvelocity_hz = -1", "velocity_hz = -1", "-1"),
        ("[axes.x.effects.encoder]\nvelocity = \"tachometer\"\nvelocity_hz = 50", "`velocity_hz` does nothing", "50"),
        (
            "[axes.x.effects.encoder]\nvelocity = \"low_pass\"\nvelocity_damping = 2",
            "`velocity_damping` does nothing",
            "2",
        ),
        ("[axes.x.effects.encoder]\nvelocity = \"low_pass\"\nvelocity_hz = 2000", "at most 500 Hz", "2000"),
        ("[axes.x.controller.pid]\nfilter_hz = 900", "at most 500 Hz", "900"),
        ("[axes.x.compensation.notch]\nfrequency_hz = 499", "below 499 Hz", "499"),
        ("[axes.x.effects.delay]\nsamples = 17", "samples = 17 is out of range", "17"),
        ("[axes.x.effects.dac]\nbits = 40", "bits = 40 is out of range", "40"),
        ("[axes.x.effects.pitch]\npoints_mm_um = [\n[0, 0],\n[5, 1],\n[-5, 2]]", "point 3 is at -5 mm", "[-5, 2]"),
        ("[axes.x.effects.pitch]\npoints_mm_um = [[0, 0], [5, nan]]", "`points_mm_um` holds NaN", "nan"),
        ("[axes.x.effects.pitch]\npoints_mm_um = [[0, 0], [5]]", "a place in mm and an error in µm", "[5]"),
        ("[axes.x.compensation.pitch]\npoints_mm_um = [[0, 0], [5, 20000]]", "points_mm_um = 20000", "20000"),
        ("[axes.x.effects.force.over_time]\npoints_s_n = [[0, 1, 2]]", "a time in s and a force in N", "[0, 1, 2]"),
        ("[axes.x.effects.force.over_time]\npoints_s_n = [[0, 1], [1, 2]]\nperiod_s = 0.5", "period_s = 0.5", "0.5"),
        (
            "[[axes.x.effects.ripple.harmonics]]\nper_revolution = 1.5\namplitude_nm = 1",
            "`per_revolution` must be a whole number",
            "1.5",
        ),
        (
            "[axes.x.effects.integration]\nsubsteps = 0",
            "substeps = 0 is out of range: it must be a whole number from 1",
            "0",
        ),
        ("[axes.x.effects.integration]\nsubsteps = -7", "substeps = -7 is out of range", "-7"),
        ("[axes.x.effects.integration]\nsubsteps = 1025", "from 1 to 1024", "1025"),
        ("[axes.x.effects.integration]\nsubsteps = 99999999999", "substeps = 99999999999 is out of range", "999"),
        ("[axes.x.effects.integration]\nsubsteps = 1.5", "`substeps` must be a whole number", "1.5"),
        ("[axes.y.effects.integration]\ntolerance_mm_s = 0", "axis y: tolerance_mm_s = 0 is out of range", "0"),
        ("[axes.y.effects.integration]\ntolerance_mm_s = nan", "leave the key out for its default", "nan"),
        ("[axes.y.effects.integration]\nsteps = 2", "unknown key `steps`", "steps"),
        ("[axes.x.effects.noise]\nrms_um = 1\nseed = -1", "`seed` must be a whole number from 0 to 4294967295", "-1"),
    ] {
        let document = Document::builtin("alpha").unwrap();
        let text = format!("{}\n{tables}\n", document.text());
        let error = Scenario::from_toml(&text, "alpha.toml").expect_err(tables);
        let shown = error.render(false);
        assert!(shown.contains(problem) && shown.contains('^'), "{tables}\n{shown}");
        // The line of the wrong value is shown.
        let last = tables.lines().rfind(|line| line.contains(marked)).unwrap();
        assert!(shown.contains(last), "{tables}\n{shown}");
    }
}

/// Largest distance of the errors of two runs at the same time \[µm\].
fn apart_um(a: &Scenario, b: &Scenario) -> f64 {
    let [a, b] = [a, b].map(|scenario| {
        let mut run = Vec::new();
        scenario.run(&mut [&mut |period: &Period<2>| run.push(1e3 * (period.nearest_mm - period.actual_mm))]).unwrap();
        run
    });
    a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// As a user checks that it is fine enough: half the step moves the largest error by less than 1 nm.
#[test]
fn validates_half_the_step_on_alpha_real() {
    // Counts and DAC turn less than a nanometre into a whole count: without them.
    let exact = ["encoder.resolution_um=0", "noise.rms_um=0", "dac.bits=32"];
    let real = |settings: &[&str]| {
        let mut document = Document::builtin("alpha-real").unwrap();
        let settings: Vec<&str> = exact.iter().chain(settings).copied().collect();
        for axis in ["x", "y"] {
            for setting in &settings {
                document.set(&format!("axes.{axis}.effects.{setting}")).unwrap();
            }
        }
        document.scenario().unwrap()
    };
    // The ballscrew takes two steps a period by itself.
    let (whole, half) = (real(&[]), real(&["integration.substeps=4"]));
    assert_eq!(half.drives[1].effects.integration, Integration { substeps: 4, ..Integration::default() });
    assert_eq!(apart_um(&whole, &real(&["integration.substeps=2"])), 0.0);
    let largest = |scenario: &Scenario| scenario.run(&mut []).unwrap().max_contour_error_um;
    let (a, b) = (largest(&whole), largest(&half));
    assert!((a - b).abs() < 1e-3 && a > 1.0, "{a} {b}");
    // Where the table crosses the gap between the two masses and sticks there, single samples are some nanometres apart.
    let apart = apart_um(&whole, &half);
    assert!(apart > 0.0 && apart < 0.01, "{apart}");
    // The other key does something too.
    assert!(apart_um(&whole, &real(&["integration.tolerance_mm_s=1e3"])) > 0.0);
}

/// How finely nothing is integrated changes no bit.
#[test]
fn integration_alone_leaves_the_model() {
    let (alpha, fine) = (Scenario::builtin("alpha").unwrap(), on_both("[axes.@.effects.integration]\nsubsteps = 8"));
    assert!(fine.is_model() && fine.drives[0].effects.integration.substeps == 8);
    let (a, b) = (alpha.run(&mut []).unwrap(), fine.run(&mut []).unwrap());
    assert_eq!(a, b);
    assert_eq!(Row::of_scenario(&fine), [Row::Model]);
}

/// What is left out is stable, whatever the control period.
#[test]
fn an_observer_needs_no_more_than_its_name() {
    for period_s in ["0.01", "0.001", "0.0001"] {
        let mut document = Document::builtin("alpha").unwrap();
        document.set(&format!("control.period_s={period_s}")).unwrap();
        for estimate in ["observer", "low_pass"] {
            document.set(&format!("axes.x.effects.encoder.velocity={estimate}")).unwrap();
            document.scenario().unwrap();
        }
    }
    // 2 (√2 - 1) / (2π · 1 ms), Jury's condition for ζ = 1 by hand.
    let below_hz = VelocityEstimate::observer_below_hz(1.0, 1e-3);
    assert!((below_hz - 131.85).abs() < 0.01, "{below_hz}");
}

#[test]
fn the_difference_from_the_model_is_told_beside_the_error() {
    let scenario = on_both("[axes.@.effects.backlash]\ngap_um = 4");
    let comparison = Comparison::of(&scenario, &[Column::Own]).unwrap();
    let mut errors: Vec<Vec<Vector2<f64>>> = Vec::new();
    for scenario in [scenario.model(), scenario] {
        let mut run = Vec::new();
        scenario.run(&mut [&mut |period: &Period<2>| run.push(1e3 * (period.nearest_mm - period.actual_mm))]).unwrap();
        errors.push(run);
    }
    let apart = errors[0].iter().zip(&errors[1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let told: Vec<Option<f64>> = comparison.lines.iter().map(|line| line.runs[0].unwrap().from_model_um).collect();
    // Errors of some micrometres, differences of positions of some millimetres: the same but for their last digits.
    assert!(told[0] == Some(0.0) && (told[1].unwrap() - apart).abs() < 1e-9, "{told:?} {apart}");
    // A backlash of 4 µm moves the table by about 2.
    assert!(apart > 1.0 && apart < 6.0, "{apart}");
    // Stopped before it began, there is none.
    assert_eq!(Comparison::until(&AtomicBool::new(true), &on_both(""), &[Column::Own]).unwrap(), None);
}

#[test]
fn gains_of_one_name_are_told_apart() {
    let folder = Folder::new();
    let alpha = Document::builtin("alpha").unwrap();
    for (place, kpp) in [("d1", 90), ("d2", 100)] {
        let mut document = alpha.clone();
        document.set(&format!("axes.x.pdff.kpp={kpp}")).unwrap();
        folder.write(&format!("{place}/a.toml"), document.text());
    }
    folder
        .servosim("compare alpha-real --gains d1/a.toml --gains d2/a.toml --gains d2/a.toml")
        .assert()
        .code(0)
        .stdout(contains("d1/a").and(contains("d2/a")).and(contains("d2/a (2)").not()))
        .stderr(contains("alpha-real-d1-a.mcap").and(contains("alpha-real-d2-a.mcap")));
    let plot = fs::read_to_string(folder.path("output/alpha-real-compared-contour.svg")).unwrap();
    assert!(plot.contains("d1/a") && plot.contains("d2/a"));
}

#[test]
fn the_former_name_of_the_compensation_table_still_works() {
    let now = on_both("[axes.@.compensation]\nzero_phase = true");
    let former = on_both("[axes.@.remedies]\nzero_phase = true");
    assert!(now.drives[0].zero_phase && former.drives[0].zero_phase);
    // An override reaches the table whatever the file and the override call it.
    for (table, key) in [("remedies", "compensation"), ("compensation", "remedies"), ("remedies", "remedies")] {
        let text = format!("{}\n[axes.x.{table}]\nzero_phase = true\n", include_str!("../../scenarios/alpha.toml"));
        let mut document = Document::from_text(&text, "alpha");
        document.set(&format!("axes.x.{key}.zero_phase=false")).unwrap();
        assert!(!document.scenario().unwrap().drives[0].zero_phase, "{table} {key}");
    }
}

#[test]
fn compare_as_a_user_types_it() {
    let folder = Folder::new();
    folder
        .servosim("compare alpha-real --gains heart --plots none")
        .assert()
        .code(0)
        .stdout(contains("max contouring error"))
        .stdout(contains("with compensation"));
    folder.servosim("compare alpha --controllers pdff,cascade --output out").assert().code(0);
    for file in ["alpha-pdff.mcap", "alpha-cascade.mcap", "alpha-compared-contour.svg"] {
        assert!(folder.path(&format!("out/{file}")).is_file(), "{file}");
    }
    // A locked or unstable loop, and a broken limit of the scenario as it is, end with 3, and are told without a table too.
    folder
        .servosim("compare alpha-real --controllers pid --plots none -q")
        .assert()
        .code(3)
        .stdout("")
        .stderr(contains("pid: locked up or diverged with"));
    folder
        .servosim("compare alpha --set limits.contour_error_um=20 --plots none")
        .assert()
        .code(3)
        .stdout(contains("scenario: breaks a limit of the scenario (ideal model)").and(contains("nothing to compare")));
    folder
        .servosim("compare alpha --controllers pdff,cascade --plots none --set axes.x.compensation.zero_phase=true")
        .assert()
        .stdout(contains("cascade: without the zero-phase tracking of x"));
    folder.servosim("compare alpha --controllers pidd").assert().code(2).stderr(contains("pid"));
    folder.servosim("compare alpha-real --format json --plots none").assert().code(0).stdout(contains("\"lines\""));
    folder.servosim("run alpha-real --plots none").assert().code(0).stdout(contains("backlash"));
    folder.servosim("run alpha --plots none").assert().code(0).stdout(contains("ideal model").not());
    folder
        .servosim("run alpha --set axes.x.effects.backlash.gap_um=5 --plots none")
        .assert()
        .stdout(contains("backlash"));
}

/// An axis whose controller is given in full is checked, analysed and run without a table `pdff`.
#[test]
fn a_complete_controller_needs_no_pdff() {
    let alpha = Document::builtin("alpha").unwrap();
    let (before, rest) = alpha.text().split_once("[axes.y.pdff]").unwrap();
    let rest = rest.split_once("\n[").map_or("", |(_, rest)| rest);
    let p_pi = "[axes.y.controller.p_pi]\nposition_rad_s_mm = 97\nvelocity_nm_s_rad = 1.5\nintegral_1_s = 250\n";
    let folder = Folder::new();
    folder.write("p-pi.toml", format!("{before}{p_pi}[{rest}"));
    for command in
        ["check p-pi.toml", "analyze p-pi.toml", "run p-pi.toml --plots none --set limits.contour_error_um=5000"]
    {
        let output = folder.process(command).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{command}\n{stderr}");
    }
    folder.write("half.toml", format!("{before}{}[{rest}", p_pi.replace("integral_1_s = 250\n", "")));
    let output = folder.process("check half.toml").output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("`integral_1_s` of the controller is not given") && stderr.contains('^'), "{stderr}");
}
