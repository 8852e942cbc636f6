//! Tuning: what is searched, what is kept, and the command line as a user types it.

use std::fs;
use std::process::{Command as Process, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::{contains, starts_with};
use servosim::analysis::margins;
use servosim::optimize::Random;
use servosim::scenario::{Document, Scenario};
use servosim::servo::{ControllerGains, ControllerKind};
use servosim::tuning::{
    Constraint, Constraints, Gain, Method, Objective, Problem, Tuned, Tuning, TuningError, Uncertainty, Variable,
    changes, report,
};

fn scenario(name: &str) -> Scenario {
    Scenario::builtin(name).unwrap()
}

fn all_gains(scenario: &Scenario) -> Vec<Variable> {
    (0..2).flat_map(|axis| Gain::ALL.map(|gain| Variable::new(scenario, axis, gain))).collect()
}

/// All gains of a scenario, nominal plants alone: what a debug build can search in a moment.
fn nominal(scenario: &Scenario) -> Problem<'_> {
    Problem::new(scenario, all_gains(scenario), Objective::MaxContourError, Constraints::default(), 0.0).unwrap()
}

fn quick(method: Method) -> Tuning {
    Tuning { method, starts: 3, seed: 1, budget: 900 }
}

fn run(problem: &Problem<'_>, tuning: &Tuning) -> Tuned {
    tuning.run(problem, &AtomicBool::new(false), &|_| {}).unwrap()
}

#[test]
fn every_method_leads_an_infeasible_start_inside_and_improves_it() {
    let heart = scenario("heart");
    // Two gains an axis, one of them with a say in the margins: what a debug build searches in a moment.
    let variables = (0..2).flat_map(|axis| [Gain::Kpp, Gain::Kpf].map(|gain| Variable::new(&heart, axis, gain)));
    let problem =
        Problem::new(&heart, variables.collect(), Objective::MaxContourError, Constraints::default(), 0.0).unwrap();
    for method in [Method::NelderMead, Method::CmaEs, Method::PatternSearch] {
        let tuned = run(&problem, &Tuning { starts: 2, budget: 240, ..quick(method) });
        // 4-servo.md: Ms of heart's own gains is 1.6033 and 1.6167.
        assert_eq!(tuned.before.violations.len(), 2, "{:?}", tuned.before.violations);
        assert!(tuned.before.violations.iter().all(|v| v.constraint == Constraint::PeakSensitivity));
        assert!(!tuned.before.value.is_feasible() && tuned.after.value.is_feasible(), "{method:?}");
        let metrics = tuned.after.metrics.unwrap();
        // The very run that anybody makes with these gains.
        let mut again = heart.clone();
        again.axes = tuned.after.axes;
        let summary = again.run(&mut []).unwrap();
        // 1 nm is what the contouring error of a batch may differ by.
        assert!((summary.max_contour_error_um - metrics.max_contour_error_um).abs() <= 1e-3);
        assert!(metrics.max_contour_error_um < 10.0, "{method:?}: {metrics:?}");
        assert!(tuned.after.margins.iter().all(|m| m.stable && m.peak_sensitivity <= 1.6));
        assert_eq!(metrics.saturated_share, 0.0);
        // The margins are those of the gains that are returned.
        for (axis, known) in tuned.after.axes.iter().zip(&tuned.after.margins) {
            assert_eq!(margins(axis, &heart.settings), *known);
        }
        let of_traces: usize = tuned.traces.iter().map(|trace| trace.steps.last().unwrap().evaluations).sum();
        assert_eq!(of_traces, tuned.evaluations);
        assert!(tuned.evaluations < 300, "{method:?}: {}", tuned.evaluations);
    }
}

#[test]
fn the_answer_depends_on_the_seed_and_not_on_the_cores() {
    let alpha = scenario("alpha");
    let problem = nominal(&alpha);
    let on = |threads: usize, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&problem, &Tuning { seed, budget: 120, ..quick(Method::CmaEs) }))
    };
    let one = on(1, 5);
    assert_eq!(one, on(3, 5));
    assert_ne!(one.point, on(1, 6).point);
}

#[test]
fn a_stopped_search_keeps_the_best() {
    let alpha = scenario("alpha");
    let problem = nominal(&alpha);
    let stop = AtomicBool::new(false);
    let tuning = Tuning { budget: 1_000_000, ..quick(Method::NelderMead) };
    let tuned =
        tuning.run(&problem, &stop, &|progress| stop.store(progress.evaluations > 60, Ordering::Relaxed)).unwrap();
    assert!(tuned.interrupted && tuned.evaluations < 200, "{}", tuned.evaluations);
    let best = tuned.traces.iter().filter_map(|trace| trace.steps.last()).map(|step| step.objective);
    assert_eq!(tuned.after.value.objective, best.fold(f64::INFINITY, f64::min));
    assert!(tuned.after.value.objective <= tuned.before.value.objective);
    // Stopped before it began: the start is all there is.
    let stop = AtomicBool::new(true);
    let tuned = tuning.run(&problem, &stop, &|_| {}).unwrap();
    assert!(tuned.interrupted);
    assert_eq!(tuned.point, problem.start());
}

#[test]
fn what_is_evaluated_is_what_is_written() {
    let alpha = scenario("alpha");
    let problem = nominal(&alpha);
    let mut random = Random::new(4);
    for variable in all_gains(&alpha) {
        for _ in 0..200 {
            let position = random.uniform();
            let value = variable.value(position);
            assert!(variable.lower <= value && value <= variable.upper);
            // Seven digits of a factor of nine.
            assert!((variable.position(value) - position).abs() < 1e-6, "{variable:?}");
            assert!(format!("{value}").len() <= 11, "{value}");
            assert_eq!(format!("{value}").parse::<f64>().unwrap(), value);
        }
        assert_eq!((variable.value(-0.5), variable.value(1.5)), (variable.lower, variable.upper));
    }
    let tuned = run(&problem, &Tuning { budget: 100, ..quick(Method::NelderMead) });
    let mut document = Document::builtin("alpha").unwrap();
    for (key, value) in changes(&tuned) {
        document.set(&format!("{key}={value}")).unwrap();
    }
    assert_eq!(document.scenario().unwrap().axes, tuned.after.axes);
}

#[test]
fn a_gain_of_zero_is_searched_in_equal_steps() {
    let mut alpha = scenario("alpha");
    alpha.axes[0].pdff.kpf_rad_mm = 0.0;
    let variable = Variable::new(&alpha, 0, Gain::Kpf);
    // Twice full feedforward, 2/1.59, at the upper end.
    assert_eq!((variable.lower, variable.upper), (0.0, 1.26));
    assert!((variable.value(0.5) - 0.63).abs() < 1e-9);
    assert_eq!(variable.position(0.0), 0.0);
    for gain in Gain::ALL {
        let mut zero = alpha.clone();
        gain.set(&mut zero.axes[1].pdff, 0.0);
        let variable = Variable::new(&zero, 1, gain);
        let own = gain.of(&scenario("alpha").axes[1].pdff);
        assert!(variable.lower == 0.0 && variable.upper > own, "{variable:?} does not reach {own}");
    }
}

#[test]
fn validates_the_reserve_of_the_box_against_a_dense_grid() {
    let mut random = Random::new(11);
    let mut unstable = 0;
    for case in 0..300 {
        let name = if case % 2 == 0 { "alpha" } else { "heart" };
        let Scenario { axes: [mut axis, _], settings, .. } = scenario(name);
        for gain in Gain::ALL {
            let value = gain.of(&axis.pdff) * libm::exp(random.between(-1.2, 1.2));
            gain.set(&mut axis.pdff, value);
        }
        let uncertainty = Uncertainty { gain: random.between(0.0, 0.6), time_constant: random.between(0.0, 0.6) };
        let reserve = uncertainty.reserve(&axis, &settings);
        let is_stable = (0..=20).all(|i| {
            (0..=20).all(|j| {
                let mut plant = axis;
                plant.plant.gain_rad_s_v *= 1.0 + uncertainty.gain * (f64::from(i) / 10.0 - 1.0);
                plant.plant.time_constant_s *= 1.0 + uncertainty.time_constant * (f64::from(j) / 10.0 - 1.0);
                margins(&plant, &settings).stable
            })
        });
        // At the very edge the two may differ by the spacing of the grid.
        if (reserve - 1.0).abs() > 1e-3 {
            assert_eq!(reserve > 1.0, is_stable, "case {case}: {reserve} {uncertainty:?} {axis:?}");
        }
        unstable += usize::from(!is_stable);
    }
    assert!((50..250).contains(&unstable), "{unstable} of 300: the cases tell nothing");
}

#[test]
fn corners_out_of_the_drives_reach_do_not_count() {
    let plants = |scenario: &Scenario, weight| {
        Problem::new(scenario, all_gains(scenario), Objective::MaxContourError, Constraints::default(), weight)
            .unwrap()
            .plants()
    };
    let (alpha, heart) = (scenario("alpha"), scenario("heart"));
    // Alpha's Y axis needs 3.5 of 5 V: every plant ±20 % can follow. Heart's needs 4.0 V: with 20 % less gain and a time constant
    // 20 % longer 5.8 V, which three of the twelve corners share.
    assert_eq!((plants(&alpha, 0.2), plants(&heart, 0.2)), (13, 10));
    assert_eq!(plants(&alpha, 0.0), 1);
}

#[test]
fn drawn_plants_lie_in_the_box_and_are_the_same_for_all_gains() {
    let uncertainty = Uncertainty { gain: 0.2, time_constant: 0.1 };
    let (alpha, heart) = (scenario("alpha").axes, scenario("heart").axes);
    let (a, b) = (uncertainty.sampled(&alpha, 500, 3), uncertainty.sampled(&heart, 500, 3));
    let mut widest = (0.0_f64, 0.0_f64);
    for (a, b) in a.iter().zip(&b) {
        for axis in 0..2 {
            assert_eq!(a[axis].plant, b[axis].plant);
            assert_eq!((a[axis].pdff, b[axis].pdff), (alpha[axis].pdff, heart[axis].pdff));
            let gain = a[axis].plant.gain_rad_s_v / alpha[axis].plant.gain_rad_s_v - 1.0;
            let time = a[axis].plant.time_constant_s / alpha[axis].plant.time_constant_s - 1.0;
            widest = (widest.0.max(gain.abs()), widest.1.max(time.abs()));
        }
    }
    assert!((0.19..=0.2 + 1e-12).contains(&widest.0) && (0.09..=0.1 + 1e-12).contains(&widest.1), "{widest:?}");
    assert_ne!(a[0][0].plant, uncertainty.sampled(&alpha, 1, 4)[0][0].plant);
}

#[test]
fn constraints_are_told_apart() {
    let alpha = scenario("alpha");
    let assess = |constraints: Constraints, change: &dyn Fn(&mut Scenario)| {
        let mut scenario = alpha.clone();
        change(&mut scenario);
        let variables = all_gains(&scenario);
        let problem = Problem::new(&scenario, variables, Objective::MaxContourError, constraints, 0.0).unwrap();
        let assessment = problem.assess(scenario.axes);
        let told: Vec<Constraint> = assessment.violations.iter().map(|violation| violation.constraint).collect();
        assert_eq!(assessment.value.is_feasible(), told.is_empty(), "{assessment:?}");
        (told, assessment)
    };
    let default = Constraints::default();
    assert_eq!(assess(default, &|_| {}).0, []);
    let (told, assessment) = assess(Constraints { max_ms: 1.5, ..default }, &|_| {});
    assert_eq!(told, [Constraint::PeakSensitivity; 2]);
    // 4-servo.md: 1.5635 and 1.5620.
    assert!((assessment.violations[0].by - (1.5635 / 1.5 - 1.0)).abs() < 1e-4);
    assert_eq!(assessment.violations[0].to_string(), "axis x: Ms = 1.5635 is above 1.5 by 4.23 %");
    // 0.984 and 0.987 ms.
    let strict = Constraints { min_delay_margin_s: Some(0.985e-3), ..default };
    assert_eq!(assess(strict, &|_| {}).0, [Constraint::DelayMargin]);
    // Stable down to a gain of 0.21.
    let wide = Constraints { uncertainty: Uncertainty { gain: 0.8, time_constant: 0.0 }, ..default };
    assert_eq!(assess(wide, &|_| {}).0, [Constraint::StableBox; 2]);
    // A drive with too little voltage.
    let (told, assessment) = assess(default, &|scenario| scenario.axes[1].drive.voltage_limit_v = 3.4);
    assert_eq!(told, [Constraint::Saturation]);
    assert!(assessment.value.violation < 1.0 && assessment.metrics.is_some());
    let (told, locked) = assess(default, &|scenario| scenario.axes[0].drive.voltage_limit_v = 0.5);
    assert!(told.contains(&Constraint::Lockup), "{told:?}");
    // An unstable loop is not worth a run, and further away than one that saturates for good.
    let (told, unstable) = assess(default, &|scenario| scenario.axes[0].pdff.kpv_nm_s_rad = 20.0);
    assert_eq!(told[0], Constraint::PeakSensitivity);
    assert!(unstable.metrics.is_none());
    assert!(assessment.value.is_better_than(&locked.value) && locked.value.is_better_than(&unstable.value));
}

#[test]
fn problems_that_make_no_sense_are_refused() {
    let alpha = scenario("alpha");
    let refused = |variables, constraints, weight| {
        Problem::new(&alpha, variables, Objective::MaxContourError, constraints, weight).unwrap_err().to_string()
    };
    let default = Constraints::default();
    let all = || all_gains(&alpha);
    assert_eq!(refused(vec![], default, 0.2), "there is nothing to vary: name at least one gain");
    assert_eq!(refused([all(), all()].concat(), default, 0.2), "axes.x.pdff.kpp is varied twice");
    for max_ms in [1.0, 0.5, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(all(), Constraints { max_ms, ..default }, 0.2).contains("above 1"), "{max_ms}");
    }
    for gain in [-0.1, 1.0, f64::NAN] {
        let uncertainty = Uncertainty { gain, time_constant: 0.2 };
        assert!(refused(all(), Constraints { uncertainty, ..default }, 0.2).contains("the gain"), "{gain}");
    }
    assert!(refused(all(), default, -1.0).contains("weight of the worst plants"));
    let mut other = scenario("alpha");
    other.drives[1].controller = ControllerGains::like(ControllerKind::Pid, &other.axes[1], &other.settings);
    let refused = Problem::new(&other, all(), Objective::MaxContourError, default, 0.0).unwrap_err();
    assert!(matches!(refused, TuningError::Controller { axis: "y", controller: "pid" }), "{refused}");
    let problem = nominal(&alpha);
    let error = |tuning: Tuning| tuning.run(&problem, &AtomicBool::new(false), &|_| {}).unwrap_err();
    assert!(matches!(error(Tuning { starts: 0, ..Tuning::default() }), TuningError::NoStart));
    assert!(matches!(error(Tuning { budget: 3, ..Tuning::default() }), TuningError::Budget { budget: 3, .. }));
}

#[test]
fn findings_tell_what_is_in_the_way() {
    let alpha = scenario("alpha");
    // kpf alone, and bounds that leave full feedforward (0.629) out.
    let variables = vec![
        Variable::parse("x.kpf=0.7:0.9", &alpha).unwrap(),
        Variable::parse("axes.y.pdff.kpf = 0.7 : 0.9", &alpha).unwrap(),
    ];
    let problem = Problem::new(&alpha, variables, Objective::RmsContourError, Constraints::default(), 0.0).unwrap();
    let tuning = Tuning { starts: 1, budget: 150, ..quick(Method::NelderMead) };
    let tuned = run(&problem, &tuning);
    let report = report(&problem, &tuning, &tuned);
    assert!(report.feasible && report.after.objective < report.before.objective);
    assert!(report.active.iter().any(|line| line.starts_with("x.kpf is at its lower bound 0.7")), "{report:?}");
    assert_eq!((report.gains.len(), report.after.sampled.plants), (2, 1000));
    for gain in &report.gains {
        // Feedforward does not change the loop, and the error grows with it here.
        assert_eq!(gain.ms_less, gain.ms_more);
    }
    assert!(report.after.sampled.worst_um >= report.after.sampled.percentile_95_um);
    assert!(report.after.sampled.percentile_95_um >= report.after.sampled.median_um);
    assert_eq!(report.checks.len(), 3);
    assert!(report.checks.iter().all(|check| check.survives), "{:?}", report.checks);
}

// ---- The command line ---------------------------------------------------------------------------------------------

/// A search that a debug build does in a moment.
const QUICK: &str = "--budget 120 --starts 2 --worst-weight 0 --method nelder-mead";

#[test]
fn tune_then_run_keeps_the_limits_and_the_comments() {
    let folder = Folder::new();
    folder
        .servosim(&format!("tune alpha.toml {QUICK}"))
        .assert()
        .success()
        .stdout(starts_with("alpha: max contouring error, nelder-mead, 2 starts, "))
        .stdout(contains("worst of 1000 plants").and(contains("further checks")))
        .stdout(contains("effect of one percent").and(contains("at most 1.6")))
        .stderr("wrote output/alpha-tuned.toml and output/alpha-tune.svg\n");
    let text = fs::read_to_string(folder.path("output/alpha-tuned.toml")).unwrap();
    let original = include_str!("../../scenarios/alpha.toml");
    let (head, rest) = text.split_once("\n\n").unwrap();
    assert!(head.starts_with("# Tuned by servosim ") && head.contains("from alpha.toml"), "{head}");
    // Line by line the same, but for the values of the ten gains.
    assert_eq!(rest.lines().count(), original.lines().count());
    let changed: Vec<&str> = rest.lines().zip(original.lines()).filter(|(a, b)| a != b).map(|(a, _)| a).collect();
    assert!((1..=10).contains(&changed.len()), "{changed:?}");
    assert!(changed.iter().all(|line| line.starts_with('k') && line.contains(" = ")), "{changed:?}");
    folder
        .servosim("run output/alpha-tuned.toml")
        .assert()
        .success()
        .stdout(starts_with("alpha-tuned\n").and(contains("contour_error_um   kept")));
    assert!(folder.path("output/alpha-tuned.mcap").is_file());
    // The same again: the same bytes, over our own file; and a tuned scenario can be tuned.
    folder.servosim(&format!("tune alpha.toml {QUICK} --quiet")).assert().success().stdout("").stderr("");
    assert_eq!(fs::read_to_string(folder.path("output/alpha-tuned.toml")).unwrap(), text);
    folder.servosim(&format!("tune output/alpha-tuned.toml {QUICK} --quiet --plots none")).assert().success();
    let twice = fs::read_to_string(folder.path("output/alpha-tuned-tuned.toml")).unwrap();
    assert_eq!(twice.matches("# Tuned by servosim").count(), 1);
    let files = fs::read_dir(folder.path("output"))
        .unwrap()
        .filter(|f| f.as_ref().unwrap().file_name().to_string_lossy().contains("part"));
    assert_eq!(files.count(), 0);
}

#[test]
fn a_scenario_with_a_name_of_its_own_gets_another() {
    let folder = Folder::new();
    folder.write("mine.toml", format!("name = \"bracket\"\n{}", include_str!("../../scenarios/alpha.toml")));
    folder.servosim(&format!("tune mine.toml {QUICK} --plots none --output out")).assert().success();
    let tuned = Scenario::load(folder.path("out/bracket-tuned.toml")).unwrap();
    assert_eq!(tuned.name, "bracket-tuned");
}

#[test]
fn json_is_exactly_one_object() {
    let folder = Folder::new();
    let output =
        folder.servosim(&format!("tune alpha {QUICK} --gains kpf --format json --plots none")).assert().success();
    let json: serde_json::Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert_eq!(json["scenario"], "alpha");
    assert_eq!(json["feasible"], true);
    assert!((json["before"]["metrics"]["max_contour_error_um"].as_f64().unwrap() - 27.027).abs() < 2e-3);
    let after = json["after"]["metrics"]["max_contour_error_um"].as_f64().unwrap();
    assert!(after < 27.0);
    let keys: Vec<&str> = json["gains"].as_array().unwrap().iter().map(|g| g["key"].as_str().unwrap()).collect();
    assert_eq!(keys, ["axes.x.pdff.kpf", "axes.y.pdff.kpf"]);
    assert_eq!(json["checks"].as_array().unwrap().len(), 3);
    assert_eq!(json["notes"].as_array().unwrap().len(), 0);
}

#[test]
fn a_drive_that_is_more_than_its_model_is_told_of() {
    let folder = Folder::new();
    let set = "--set axes.x.effects.delay.samples=0.4 --set axes.x.effects.backlash.gap_um=2";
    folder
        .servosim(&format!("tune alpha {QUICK} --gains kpf --plots none {set}"))
        .assert()
        .success()
        .stdout(contains("not seen by the search\n    axis x was tuned on its ideal model, without its delay of 0.4 samples, backlash"))
        .stdout(contains("with the tuned gains the detailed drive model has Ms"))
        .stderr(contains("`servosim compare alpha --gains output/alpha-tuned.toml` judges them on the detailed drive model"));
}

#[test]
fn bad_input_says_what_is_wrong_and_exits_with_2() {
    let folder = Folder::new();
    for (arguments, message) in [
        ("--vary axes.x.pdff.kpp=140:60", "the lower bound comes first"),
        ("--vary axes.x.pdff.kpp=60:60", "nothing is left to choose"),
        ("--vary axes.x.pdff.kpp=-1:60", "a gain is not negative"),
        ("--vary axes.x.pdff.kpp=a:60", "a bound is not a number"),
        ("--vary axes.x.pdff.kpp=60", "there is no `:`"),
        ("--vary axes.x.pdff.kpp=1:inf", "a bound is not finite"),
        ("--vary axes.x.pdff.kp=60:140", "there is no gain `axes.x.pdff.kp` to vary: did you mean `axes.x.pdff.kpp`?"),
        ("--gains kpp,kvp", "there is no gain `kvp` to vary: did you mean `k"),
        ("--vary x.kpp --vary axes.x.pdff.kpp=1:2", "axes.x.pdff.kpp is varied twice"),
        ("--starts 0", "at least one start"),
        ("--budget 5", "a budget of 5 evaluations is too small"),
        ("--max-ms 1", "must be above 1"),
        ("--max-ms=-3", "must be above 1"),
        ("--max-ms -3", "must be above 1"),
        ("--max-ms inf", "and finite"),
        ("--min-delay-margin-ms -1", "positive and finite"),
        ("--uncertainty -5%", "at least 0"),
        ("--max-ms nan", "must be above 1"),
        ("--min-delay-margin-ms 0", "positive and finite"),
        ("--uncertainty 100%", "below 100 %"),
        ("--uncertainty lots", "not a share"),
        ("--worst-weight -1", "not negative"),
        ("--objective weighted --voltage-weight -1", "not negative"),
        ("--objective weighted --voltage-weight inf", "finite"),
        ("--method annealing", "possible values"),
        ("--set axes.x.pdff.kpp=-5", "kpp"),
        (
            "--set axes.x.controller.pid={}",
            "axis x has a pid controller: tuning searches the gains of the PDFF controller",
        ),
    ] {
        folder
            .servosim(&format!("tune alpha {arguments}"))
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains(message).and(contains("error")));
    }
    assert!(!folder.path("output").exists(), "nothing may be left behind");
}

#[test]
fn no_allowed_gains_say_which_constraint_and_by_how_much() {
    let folder = Folder::new();
    folder
        .servosim(&format!("tune alpha {QUICK} --max-ms 1.05"))
        .assert()
        .code(3)
        .stdout("")
        .stderr(contains("no gains were found that keep every constraint; nothing was written"))
        .stderr(contains("is above 1.05 by").and(contains("help: loosen the limit (--max-ms")));
    assert!(!folder.path("output").exists());
}

#[test]
fn a_file_that_is_not_ours_is_left_alone() {
    let folder = Folder::new();
    folder.write("output/alpha-tuned.toml", "# my own work\n");
    let assert = folder.servosim(&format!("tune alpha {QUICK}")).assert().code(2).stdout("");
    assert.stderr(contains("alpha-tuned.toml exists already and is not one that `servosim tune` wrote"));
    assert_eq!(fs::read_to_string(folder.path("output/alpha-tuned.toml")).unwrap(), "# my own work\n");
    fs::remove_file(folder.path("output/alpha-tuned.toml")).unwrap();
    fs::create_dir(folder.path("output/alpha-tuned.toml")).unwrap();
    folder.servosim(&format!("tune alpha {QUICK}")).assert().code(2).stderr(contains("is a folder"));
}

#[test]
#[cfg(unix)]
fn an_interrupted_search_writes_the_best_so_far() {
    let folder = Folder::new();
    let mut process = folder.process("tune alpha --budget 100000000 --worst-weight 0 --plots none");
    let child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    // Twice at once, as `timeout` does: one wish to stop, not the second Ctrl-C that ends the program.
    let pid = child.id().to_string();
    assert!(
        Process::new("bash").args(["-c", &format!("kill -INT {pid}; kill -INT {pid}")]).status().unwrap().success()
    );
    let started = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(started.elapsed() < Duration::from_secs(20), "{:?}", started.elapsed());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("interrupted after") && stderr.contains("output/alpha-tuned.toml"), "{stderr}");
    assert!(String::from_utf8(output.stdout).unwrap().contains("interrupted"));
    Scenario::load(folder.path("output/alpha-tuned.toml")).unwrap();
}
