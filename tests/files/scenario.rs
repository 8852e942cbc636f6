//! Scenarios: what is read from a file, and what is said about a file that cannot be used.

use crate::common::scenario::{alpha, altered, bare, refusal};
use servosim::feedrate::Profile;
use servosim::limits::{LimitCheck, Peaks};
use servosim::scenario::{FeedProfile, MAX_ARRAY_ITEMS, Scenario, builtin_names};
use servosim::servo::{Derivative, Drive, LoopSettings};

/// The text is refused, the message points at `place` (the first occurrence of it, as line and column), and says `words`.
#[track_caller]
fn assert_refused(text: &str, place: &str, words: &[&str]) {
    let error = refusal(text);
    let message = error.to_string();
    let at = text.find(place).unwrap_or_else(|| panic!("no `{place}` in the text"));
    let line = 1 + text[..at].matches('\n').count();
    let column = 1 + text[..at].chars().rev().take_while(|&c| c != '\n').count();
    assert!(message.contains(&format!("--> it.toml:{line}:{column}\n")), "not at {line}:{column}:\n{message}");
    for word in words {
        assert!(message.contains(word), "no `{word}` in\n{message}");
    }
    assert!(message.contains("help: "), "no help in\n{message}");
    assert!(message.lines().all(|line| line.chars().count() < 500), "a very long line in\n{message}");
}

#[test]
fn validates_the_built_in_scenarios_against_the_paper() {
    let of = |name| Scenario::builtin(name).unwrap();
    let (alpha, heart, star) = (of("alpha"), of("heart.toml"), of("star"));
    assert_eq!(alpha.name, "alpha");
    assert_eq!(alpha.profile, FeedProfile::Phases(Profile::Exponential { phase_s: 0.1, n_c: 8.12 }));
    assert_eq!(alpha.settings, LoopSettings::default());
    // The default drive is the paper's: the written-out factor is 1/0.716 to the last bit.
    assert!([&alpha, &heart, &star].iter().all(|s| s.axes.iter().all(|axis| axis.drive == Drive::default())));
    // Table 2: K, τ, kpp, kpv, kiv, kpf, kvf.
    let table = |s: &Scenario, axis: usize| {
        let a = s.axes[axis];
        let p = a.pdff;
        [a.plant.gain_rad_s_v, a.plant.time_constant_s, p.kpp_rad_s_mm, p.kpv_nm_s_rad, p.kiv_1_s, p.kpf_rad_mm, p.kvf]
    };
    assert_eq!(table(&alpha, 0), [83.0089, 0.19936, 97.38, 1.19, 252.8, 0.8, 0.85]);
    assert_eq!(table(&alpha, 1), [50.4977, 0.15641, 97.38, 1.53, 253.2, 0.8, 0.85]);
    for scenario in [&heart, &star] {
        assert_eq!(table(scenario, 0), [83.0089, 0.19936, 109.95, 1.2, 252.0, 0.8, 0.85]);
        assert_eq!(table(scenario, 1), [50.4977, 0.15641, 109.95, 1.5, 253.0, 0.8, 0.85]);
    }
    // Length [mm], motion time [s], largest curvature [1/mm], max contouring error [µm] from an independent implementation.
    for (scenario, expected) in
        [(&alpha, [99.941551, 1.099416, 0.129867, 27.027]), (&heart, [296.759079, 3.067591, 0.072750, 12.506])]
    {
        let s = scenario.run(&mut []).unwrap();
        let found = [s.path_length_mm, s.motion_time_s, s.max_curvature_1_mm, s.max_contour_error_um];
        for ((found, expected), half_digit) in found.into_iter().zip(expected).zip([5e-7, 5e-7, 5e-7, 5e-4]) {
            assert!((found - expected).abs() <= half_digit, "{}: {found} is not {expected}", scenario.name);
        }
    }
}

#[test]
fn every_built_in_scenario_keeps_its_limits() {
    for name in builtin_names() {
        let summary = Scenario::builtin(name).unwrap().run(&mut []).unwrap();
        assert!(summary.passed() && summary.limits.len() == 3, "{name}: {summary:?}");
    }
}

#[test]
fn everything_that_can_be_left_out_has_its_documented_default() {
    let text = "[path.line]\nstart_mm = [0, 0]\nend_mm = [30, 40]\n[feedrate]\nfeed_mm_s = 100\n\
        [feedrate.profile.jerk_limited]\naccel_mm_s2 = 2000\njerk_mm_s3 = 5e4\n"
        .to_owned();
    let axis = |name: &str| {
        format!(
            "[axes.{name}.plant.first_order]\ngain_rad_s_v = 83\ntime_constant_s = 0.2\n\
            [axes.{name}.pdff]\nkpp = 97\nkpv = 1\nkiv = 250\nkpf = 0.6\nkvf = 1\n"
        )
    };
    let scenario = Scenario::from_toml(&(text + &axis("x") + &axis("y")), "parts/small.toml").unwrap();
    assert_eq!(scenario.name, "small");
    assert_eq!(scenario.settings, LoopSettings::default());
    assert_eq!(scenario.axes[1].drive, Drive::default());
    assert_eq!(scenario.limits, servosim::limits::Limits::default());
    assert!((scenario.path.length_mm() - 50.0).abs() < 1e-12);
    assert!(scenario.run(&mut []).unwrap().limits.is_empty());
}

#[test]
fn every_option_reaches_its_value() {
    let text = altered("derivative = \"backward\"", "derivative = \"exact\"")
        .replacen("delay_samples = 0", "delay_samples = 1", 1)
        .replacen("n_c = 8.12", "n_c = \"optimize\"", 1)
        .replacen("[limits]", "[limits]\ntracking_error_um = 200\nvoltage_v = 5", 1);
    let scenario = Scenario::from_toml(&text, "it.toml").unwrap();
    assert_eq!(scenario.settings.derivative, Derivative::Exact);
    assert!(scenario.settings.one_sample_delay);
    assert_eq!((scenario.limits.tracking_error_um, scenario.limits.voltage_v), (Some(200.0), Some(5.0)));
    // The published optimum: n_c = 8.350 with 48 146 mm/s³.
    assert!((scenario.n_c().unwrap() - 8.350).abs() < 5e-4);
    assert!((scenario.n_c_search.as_ref().unwrap().objective - 48146.0).abs() < 0.5);

    let mechanics = altered(
        "[axes.x.plant.first_order]",
        "[axes.x.plant.mechanics]\nmass_kg = 20\ninertia_kg_m2 = 1e-3\nviscous_friction_nm_s_rad = 0.01\n[unused]",
    )
    .replacen("[unused]\ngain_rad_s_v = 83.0089\ntime_constant_s = 0.19936\n", "", 1);
    let plant = Scenario::from_toml(&mechanics, "it.toml").unwrap().axes[0].plant;
    // J = 1e-3 + 20 kg (1.59e-3 m/rad)²; K = 1/(k_T B), τ = J/B.
    assert!((plant.time_constant_s - (1e-3 + 20.0 * 1.59e-3 * 1.59e-3) / 0.01).abs() < 1e-15);
    assert!((plant.gain_rad_s_v - 0.716 / 0.01).abs() < 1e-12);

    let circle =
        alpha().replacen("[path.ph_spline]", "[path.circle]\ncentre_mm = [1, 2]\nradius_mm = 10\nstart_deg = 90", 1);
    let circle = circle.lines().filter(|l| !l.starts_with("control_points_mm") && !l.starts_with("closed"));
    let circle = Scenario::from_toml(&circle.collect::<Vec<_>>().join("\n"), "it.toml").unwrap();
    let start = circle.path.frame(0.0, &mut servosim::path::Cursor::default()).point_mm;
    assert!((start - nalgebra::Vector2::new(1.0, 12.0)).norm() < 1e-12);
}

#[test]
fn what_is_not_toml_is_told_with_its_place() {
    let at_line_end = |text: &str, key: &str| {
        let error = refusal(text).to_string();
        let line = 1 + text.lines().position(|l| l.starts_with(key)).unwrap();
        assert!(error.contains(&format!("--> it.toml:{line}:")), "{error}");
        error
    };
    assert!(at_line_end(&altered("period_s = 0.001", "period_s ="), "period_s").contains("write a value"));
    assert!(at_line_end(&altered("[limits]", "[limits"), "[limits").contains("unclosed table"));
    assert_refused(&altered("0.001", "1ms"), "1ms", &["not a TOML value", "no unit"]);
    assert_refused(&altered("[limits]", "[control]\n[limits]"), "control]\n[limits]", &["duplicate", "remove one"]);
    assert!(refusal("This is a letter.\nNot a scenario.\n").to_string().contains("--> it.toml:1:"));
    assert!(refusal("\0\u{1}\u{2}binary").to_string().contains("--> it.toml:1:"));
}

#[test]
fn an_empty_text_is_told_what_to_do() {
    for text in ["", "\n", "  \r\n\t", "\u{feff}"] {
        let message = refusal(text).to_string();
        assert!(message.contains("empty") && message.contains("servosim new"), "{message}");
    }
    let message = refusal("# nothing but a remark").to_string();
    assert!(message.contains("it.toml:1:1") && message.contains("`path` is missing"), "{message}");
}

#[test]
fn a_wrong_type_is_told_with_the_right_one() {
    assert_refused(&altered("kpp = 97.38", "kpp = \"97\""), "\"97\"", &["`kpp` must be a number", "without quotes"]);
    assert_refused(&altered("kpp = 97.38", "kpp = [9, 7]"), "[9, 7]", &["`kpp` must be a number, not a list"]);
    assert_refused(&altered("closed = false", "closed = 'no'"), "'no'", &["`closed` must be true or false"]);
    assert_refused(&altered("[path", "name = 7\n[path"), "7\n[path", &["`name` must be a string"]);
    assert_refused(&altered("delay_samples = 0", "delay_samples = 0.5"), "0.5", &["a whole number"]);
    assert_refused(&altered("[12, 18]", "[12, 18, 3]"), "[12, 18, 3]", &["must be [x, y]", "length 3"]);
    assert_refused(&altered("[12, 18]", "[12]"), "[12]", &["must be [x, y]", "length 1"]);
    assert_refused(&altered("[12, 18]", "12"), "12, [24", &["must be [x, y]"]);
    assert_refused(&altered("[12, 18]", "[12, 'x']"), "'x'", &["a number"]);
    assert_refused(&altered("n_c = 8.12", "n_c = \"best\""), "\"best\"", &["a number or \"optimize\""]);
    assert_refused(&altered("[limits]", "[[limits]]"), "limits]]", &["must be a table", "single brackets"]);
    assert_refused("path = 'line'", "'line'", &["`path` must be a table, such as [path.ph_spline]"]);
    assert_refused("path = 3", "3", &["`path` must be a table"]);
    // A table by position would be read without its keys.
    assert_refused("feedrate = [1, 2]", "feedrate", &["must be a table"]);
}

#[test]
fn an_unknown_key_is_told_with_the_nearest_known_one() {
    assert_refused(
        &altered("kpp = 97.38", "kp = 97.38"),
        "kp = ",
        &["unknown key `kp`", "did you mean `kpp`?", "`kvf`"],
    );
    assert_refused(
        &altered("contour_error_um", "contour_error"),
        "contour_error",
        &["did you mean `contour_error_um`?"],
    );
    assert_refused(&altered("[control]", "[contol]"), "contol]", &["unknown key `contol`", "did you mean `control`?"]);
    assert_refused(
        &altered("profile.exponential", "profile.exponental"),
        "exponental]",
        &["did you mean `exponential`?"],
    );
    assert_refused(&altered("path.ph_spline", "path.spline"), "spline]", &["`path` cannot be `spline`", "`line`"]);
    assert_refused(
        &altered("\"backward\"", "\"backwards\""),
        "\"backwards\"",
        &["did you mean `backward`?", "`exact`"],
    );
    // A key that is known elsewhere is told its home.
    assert_refused(&altered("feed_mm_s = 100", "feed_mm_s = 100\nkiv = 2"), "kiv = 2", &["[axes.x.pdff]"]);
    // A strange name cannot write to the terminal.
    let text = altered("[limits]", "[limits]\n\"\\u001b[31m\\nred\" = 1");
    assert_refused(&text, "\"\\u001b", &["\\u{1b}[31m red"]);
    assert!(!refusal(&text).to_string().contains('\u{1b}'));
}

#[test]
fn a_missing_key_is_told_at_its_table() {
    assert_refused(
        &altered("kpp = 97.38\n", ""),
        "[axes.x.pdff]",
        &["`kpp` is missing in [axes.x.pdff]", "add a line `kpp"],
    );
    assert_refused(&altered("phase_s = 0.1\n", ""), "[feedrate.profile.exponential]", &["`phase_s` is missing"]);
    assert_refused(&altered("feed_mm_s = 100\n", ""), "[feedrate]", &["`feed_mm_s` is missing in [feedrate]"]);
    let text = bare();
    let plant = text.find("[axes.y.plant.first_order]").unwrap();
    let drive = text.find("[axes.y.drive]").unwrap();
    let without = format!("{}{}", &text[..plant], &text[drive..]);
    assert_refused(&without, "y.drive]", &["`plant` is missing in [axes.y]", "[axes.y.plant.first_order]"]);
    assert_refused(
        &altered("[path.ph_spline]", "[path]\n[unused]"),
        "[path]",
        &["[path] holds none of", "[path.ph_spline]"],
    );
    assert_refused(
        &altered("[path.ph_spline]", "[path.circle]\nradius_mm = 1\n[path.ph_spline]"),
        "path.circle]",
        &["more than one of `ph_spline`, `line`, `circle`"],
    );
    let points = bare().lines().find(|l| l.starts_with("control_points_mm")).unwrap().to_owned();
    assert_refused(&altered(&points, ""), "path.ph_spline]", &["neither", "control_points_mm ="]);
    let both = format!("{points}\nnodal_points_mm = [[0, 0], [1, 1]]");
    assert_refused(&altered(&points, &both), "[[0, 0], [1, 1]]", &["both", "keep one"]);
}

#[test]
fn nan_and_infinity_are_refused_everywhere() {
    let keys = [
        "feed_mm_s = 100",
        "phase_s = 0.1",
        "n_c = 8.12",
        "period_s = 0.001",
        "settling_s = 0.1",
        "gain_rad_s_v = 83.0089",
        "time_constant_s = 0.19936",
        "transmission_mm_rad = 1.59",
        "torque_to_voltage_v_nm = 1.3966480446927374",
        "voltage_limit_v = 5",
        "kpp = 97.38",
        "kpv = 1.19",
        "kiv = 252.8",
        "kpf = 0.8",
        "kvf = 0.85",
        "contour_error_um = 30",
        "accel_mm_s2 = 2000",
        "jerk_mm_s3 = 50000",
    ];
    for line in keys {
        let key = line.split(' ').next().unwrap();
        for value in ["nan", "-nan", "inf", "-inf", "1e300"] {
            // A limit of 1e300 is never broken, but it is a number.
            if value == "1e300" && (key.starts_with("contour") || key.starts_with("accel") || key.starts_with("jerk")) {
                continue;
            }
            let text = altered(&format!("\n{line}\n"), &format!("\n{key} = {value}\n"));
            let place = format!("{value}\n");
            assert_refused(&text, &place, &[key]);
        }
    }
    for value in ["nan", "inf", "-inf"] {
        let point = format!("[12, {value}]");
        assert_refused(&altered("[12, 18]", &point), &point, &["not a finite number", "millimetres"]);
    }
}

#[test]
fn values_out_of_range_are_told_with_the_range() {
    for (line, wrong, words) in [
        ("period_s = 0.001", ["0", "-0.001"], "0.001"),
        ("settling_s = 0.1", ["-1", "-1e-9"], "settling_s"),
        ("time_constant_s = 0.19936", ["0", "-0.2"], "positive"),
        ("gain_rad_s_v = 83.0089", ["0", "-83"], "positive"),
        ("voltage_limit_v = 5", ["0", "-5"], "positive"),
        ("kpp = 97.38", ["-97.38", "-1"], "zero or a positive"),
        ("phase_s = 0.1", ["0", "-0.1"], "positive"),
        ("feed_mm_s = 100", ["0", "-100"], "positive"),
        ("n_c = 8.12", ["0.5", "21"], "from 1 to 20"),
        ("delay_samples = 0", ["2", "-1"], "0 or 1"),
        ("jerk_mm_s3 = 50000", ["0", "-1"], "positive"),
    ] {
        let key = line.split(' ').next().unwrap();
        for value in wrong {
            let text = altered(&format!("\n{line}\n"), &format!("\n{key} = {value} # here\n"));
            assert_refused(&text, &format!("{value} # here"), &[words, "out of range"]);
        }
    }
    let mechanics = |mass: &str, friction: &str| {
        altered(
            "gain_rad_s_v = 83.0089\ntime_constant_s = 0.19936",
            &format!("mass_kg = {mass}\ninertia_kg_m2 = 0\nviscous_friction_nm_s_rad = {friction}"),
        )
        .replacen("plant.first_order]", "plant.mechanics]", 1)
    };
    assert_refused(&mechanics("-1", "0.1"), "-1\ninertia", &["mass_kg", "zero or a positive"]);
    assert_refused(&mechanics("nan", "0.1"), "nan\ninertia", &["mass_kg"]);
    assert_refused(&mechanics("1", "0"), "0\n[axes.x.drive]", &["viscous_friction_nm_s_rad"]);
    assert_refused(&mechanics("0", "1"), "[axes.x.plant.mechanics]", &["time_constant_s"]);
    // Sound one by one, not together.
    assert_refused(&altered("n_c = 8.12", "n_c = 19"), "19\n", &["too strong", "lower n_c"]);
    assert_refused(&altered("period_s = 0.001", "period_s = 1e-9"), "1e-9", &["control periods", "raise `period_s`"]);
    assert_refused(&altered("phase_s = 0.1", "phase_s = 1e-307"), "1e-307", &["phase_s", "from 1e-9 to 1e9"]);
    assert_refused(&altered("[path", "name = \"../x\"\n[path"), "\"../x\"", &["name cannot be used"]);
}

#[test]
fn all_problems_are_told_at_once() {
    let text = altered("kpp = 97.38", "kpp = nan")
        .replacen("kpv = 1.19", "kpv = -1", 1)
        .replacen("period_s = 0.001", "period_s = 0", 1)
        .replacen("feed_mm_s = 100", "feed_mm_s = 0", 1)
        .replacen("n_c = 8.12", "n_c = 99", 1)
        .replacen("contour_error_um = 30", "contour_error_um = -30", 1)
        .replacen("[12, 18]", "[12, 1e9]", 1)
        .replacen("[36, 9]", "[nan, 9]", 1);
    let error = refusal(&text);
    assert_eq!(error.problems().len(), 8, "{error}");
    assert_eq!(error.to_string().matches("--> it.toml:").count(), 8, "{error}");
}

#[test]
fn paths_that_cannot_be_are_told_at_their_points() {
    let with = |points: &str, more: &str| {
        let line = bare().lines().find(|l| l.starts_with("control_points_mm")).unwrap().to_owned();
        altered(&line, points).replacen("closed = false", more, 1)
    };
    let control = |points: &str| with(&format!("control_points_mm = {points}"), "closed = false");
    let nodal = |points: &str, more: &str| with(&format!("nodal_points_mm = {points}"), more);
    assert_refused(&control("[[0, 0], [1, 1], [2, 0]]"), "[[0, 0], [1, 1]", &["3 control points are too few", "4"]);
    assert_refused(&control("[]"), "[]", &["0 control points are too few"]);
    assert_refused(&nodal("[[0, 0]]", ""), "[[0, 0]]", &["1 nodal points are too few"]);
    assert_refused(
        &nodal("[[0, 0], [5, 5], [5, 5], [9, 0]]", ""),
        "[5, 5], [9",
        &["1 and 2 coincide", "remove or move"],
    );
    assert_refused(
        &nodal("[[0, 0], [5, 5], [9, 0], [0, 0]]", "closed = true"),
        "[0, 0]]",
        &["coincide", "gives its first point once"],
    );
    assert_refused(&nodal("[[0, 0], [10, 0], [0, 0]]", ""), "[10, 0]", &["turns back on itself", "no cusp"]);
    assert_refused(&control("[[0, 0], [1e9, 0], [2, 0], [3, 3]]"), "[1e9, 0]", &["±1000000 mm", "millimetres"]);
    assert_refused(
        &control("[[0, 0], [3, 3], [3, 3], [3, 3], [3, 3], [3, 3], [9, 9]]"),
        "[3, 3], [3, 3], [3, 3], [9",
        &["coincide", "control point 3, the nearest to nodal point 2", "counted from 0"],
    );
    assert_refused(&control("[[0, 0], [0, 0], [9, 9], [20, 0]]"), "[0, 0], [0, 0]", &["end tangent at the start"]);
    let tangents = |t: &str| nodal("[[0, 0], [9, 9], [20, 0]]", &format!("end_tangents = {t}"));
    assert_refused(&tangents("[[1, 1]]"), "[[1, 1]]", &["two are needed"]);
    assert_refused(&tangents("[[1, 1], [0, 0]]"), "[0, 0]]", &["end tangent at the end", "leave `end_tangents` out"]);
    assert_refused(&tangents("[[1, inf], [1, 0]]"), "[1, inf]", &["not a finite number"]);
    Scenario::from_toml(&tangents("[[9, 9], [9, -9]]"), "it.toml").unwrap();
    let line = |text: &str| format!("[path.line]\n{text}{}", &bare()[bare().find("[feedrate]").unwrap()..]);
    assert_refused(&line("start_mm = [1, 1]\nend_mm = [1, 1]\n"), "[1, 1]\n[feed", &["coincide", "move `end_mm`"]);
    let circle = |text: &str| line(text).replacen("path.line", "path.circle", 1);
    assert_refused(&circle("centre_mm = [0, 0]\nradius_mm = 0\n"), "0\n[feed", &["radius", "above 0"]);
    assert_refused(&circle("centre_mm = [0, 0]\nradius_mm = 5\nstart_deg = nan\n"), "nan", &["start_deg"]);
}

#[test]
fn too_much_is_refused_before_it_is_parsed() {
    let text = format!("[path.ph_spline]\ncontrol_points_mm = [{}]\n", "[0,0],".repeat(10_000_000));
    assert_refused(&text, "control_points_mm", &["10000000 items", "at most 1000000"]);
    for opening in ["a = [", "a = {a="] {
        let (key, bracket) = opening.split_at(4);
        let text = format!("{key}{}", bracket.repeat(100_000));
        let message = refusal(&text).to_string();
        assert!(message.contains("nested too deeply") && message.contains("it.toml:1:"), "{message}");
        assert!(message.len() < 1000, "{message}");
    }
    for text in [format!("a{} = 1", ".a".repeat(100_000)), format!("[a{}]", ".a".repeat(100_000)), "[".repeat(100_000)]
    {
        let message = refusal(&text).to_string();
        assert!(message.contains("it.toml:1:") && message.len() < 1000, "{message}");
    }
}

#[test]
fn a_mistake_in_a_very_long_line_is_shown_cropped() {
    let many = "[1.25, 2.5], ".repeat(42_000);
    let text = altered("[12, 18], ", &format!("[12, 18], {many}[3, 'x'], {many}"));
    assert!(text.len() > 1 << 20);
    assert_refused(&text, "'x'", &["[3, 'x']", "a number", "…"]);
    // One more point than is read.
    let many = "[1.25, 2.5], ".repeat(MAX_ARRAY_ITEMS + 1);
    assert_refused(&altered("[12, 18], ", &many), "control_points_mm = ", &["at most 1000000"]);
}

#[test]
fn line_ends_and_byte_order_marks_change_nothing() {
    let plain = Scenario::from_toml(&alpha(), "alpha.toml").unwrap();
    for text in [alpha().replace('\n', "\r\n"), format!("\u{feff}{}", alpha())] {
        let other = Scenario::from_toml(&text, "alpha.toml").unwrap();
        assert_eq!(other.run(&mut []).unwrap(), plain.run(&mut []).unwrap());
    }
    let text = altered("kpp = 97.38", "kp = 97.38").replace('\n', "\r\n");
    assert_refused(&text, "kp = ", &["did you mean `kpp`?"]);
    let with_mark = format!("\u{feff}kp = 1\n{}", alpha());
    assert!(refusal(&with_mark).to_string().contains("it.toml:1:1\n"));
}

/// alpha under limits of the axes, with what comes behind them in the file.
fn limited(rest: &str) -> String {
    let profile = "[feedrate.profile.axis_limited]\nvelocity_mm_s = [150, 120]\nacceleration_mm_s2 = [2000, 1500]\njerk_mm_s3 = [50000, 40000]\n";
    altered("[feedrate.profile.exponential]\nphase_s = 0.1\nn_c = 8.12\n", &format!("{profile}{rest}"))
}

#[test]
fn a_feed_under_limits_of_the_axes_keeps_them() {
    let scenario = Scenario::from_toml(&limited(""), "it.toml").unwrap();
    assert!(scenario.motion.feed_mm_s() <= 100.0 * 1.0001, "{}", scenario.motion.feed_mm_s());
    let (limits, mut worst) = ([[100.0, 100.0], [2000.0, 1500.0], [50_000.0, 40_000.0]], [0.0_f64; 3]);
    for period in scenario.simulation().unwrap() {
        let at = &period.setpoint;
        for (k, vector) in [at.velocity_mm_s, at.acceleration_mm_s2, at.jerk_vector_mm_s3].into_iter().enumerate() {
            (0..2).for_each(|axis| worst[k] = worst[k].max(vector[axis].abs() / limits[k][axis]));
        }
    }
    assert!(worst.iter().all(|share| *share <= 1.001) && worst[2] > 0.98, "{worst:?}");
    // Each wrong value, all at once, even beside a wrong feed.
    for (from, to) in [("[150, 120]", "[150, 0]"), ("[2000, 1500]", "[nan, 1500]"), ("[50000, 40000]", "[5e4, 1e10]")] {
        assert_refused(
            &limited("").replacen(from, to, 1),
            to,
            &["is out of range", "from 1e-9 to 1e9", "for X and one for Y"],
        );
    }
    let wrong = limited("")
        .replacen("feed_mm_s = 100", "feed_mm_s = 0", 1)
        .replacen("[150, 120]", "[150, 0]", 1)
        .replacen("[50000, 40000]", "[-1, 1]", 1);
    assert_eq!(refusal(&wrong).problems().len(), 3, "{}", refusal(&wrong));
    for to in ["[1]", "[1, 2, 3]", "2000", "true"] {
        let text = limited("").replacen("[2000, 1500]", to, 1);
        assert_refused(&text, &format!("{to}\n"), &["`acceleration_mm_s2` must be one number for X and one for Y"]);
    }
    assert_refused(
        &limited("").replacen("[150, 120]", "[1e-3, 1e-3]", 1),
        "[1e-3",
        &["grid points", "raise velocity_mm_s"],
    );
}

#[test]
fn a_feed_override_is_read_and_its_mistakes_are_told() {
    let change = |at_s: &str, percent: &str| format!("[[feedrate.override]]\nat_s = {at_s}\npercent = {percent}\n");
    let with = |rest: &str| altered("n_c = 8.12\n", &format!("n_c = 8.12\n{rest}"));
    let plan = Scenario::from_toml(&bare(), "it.toml").unwrap();
    let turned =
        Scenario::from_toml(&with(&(change("0.3", "50") + &change("0.6", "0") + &change("0.9", "100"))), "it.toml");
    let turned = turned.unwrap();
    let steps = turned.motion.overrides();
    assert_eq!(
        steps.iter().map(|step| (step.at_s, step.ratio)).collect::<Vec<_>>(),
        [(0.3, 0.5), (0.6, 0.0), (0.9, 1.0)]
    );
    // About as short as the plan's acceleration and jerk allow, while it cruises at its feed: jerk one way, then the other.
    let peaks = plan.motion.peaks();
    assert!(turned.motion.peaks().accel_mm_s2 <= peaks.accel_mm_s2 * 1.001);
    assert!(turned.motion.peaks().jerk_mm_s3 <= peaks.jerk_mm_s3 * 1.001);
    let shortest = 2.0 * (50.0 / peaks.jerk_mm_s3).sqrt();
    assert!(50.0 * peaks.jerk_mm_s3 < peaks.accel_mm_s2.powi(2));
    assert!((1.0..1.03).contains(&(steps[0].transition_s / shortest)), "{steps:?} {shortest}");
    // The path is the same, and its end is reached; the summary and the log tell of every change.
    let summary = turned.run(&mut []).unwrap();
    assert_eq!(summary.path_length_mm, plan.path.length_mm());
    assert_eq!(summary.overrides.iter().map(|change| change.percent).collect::<Vec<_>>(), [50.0, 0.0, 100.0]);
    assert!(!serde_json::to_string(&plan.run(&mut []).unwrap()).unwrap().contains("overrides"));
    let last = turned.simulation().unwrap().last().unwrap().setpoint;
    // But for rounding: the way there is another.
    assert!((last.position_mm - plan.simulation().unwrap().last().unwrap().setpoint.position_mm).norm() < 1e-12);
    assert!(turned.simulation().unwrap().is_sorted_by(|a, b| a.setpoint.s_mm <= b.setpoint.s_mm));
    // 100 % is the plan, bit by bit.
    let same = Scenario::from_toml(&with(&change("0.3", "100")), "it.toml").unwrap();
    assert_eq!(same.motion, plan.motion);
    assert!(plan.simulation().unwrap().eq(same.simulation().unwrap()));
    // As one line.
    let line = altered(
        "feed_mm_s = 100\n",
        "feed_mm_s = 100\noverride = [{ at_s = 0.3, percent = 50, transition_s = 0.2 }]\n",
    );
    let slow = Scenario::from_toml(&line, "it.toml").unwrap().motion.overrides()[0].transition_s;
    assert!((slow - 0.2).abs() < 1e-9, "{slow}");
    // One that is asked for too quickly takes as long as the limits need; one that is cut off, and one after the end, are told of.
    let hasty = line.replacen("transition_s = 0.2", "transition_s = 0.001", 1);
    let summary = Scenario::from_toml(&hasty, "it.toml").unwrap().run(&mut []).unwrap();
    assert_eq!(summary.overrides[0].asked_transition_s, Some(0.001));
    assert!(summary.overrides[0].transition_s > 0.05, "{:?}", summary.overrides);
    let cut = with(&(change("0.3", "0") + &change("0.31", "100") + &change("50", "10")));
    let cut = Scenario::from_toml(&cut, "it.toml").unwrap().run(&mut []).unwrap().overrides;
    assert!(cut[0].reached_percent.is_some_and(|reached| (80.0..100.0).contains(&reached)), "{cut:?}");
    assert_eq!((cut[1].reached_percent, cut[1].after_the_end, cut[2].after_the_end), (None, false, true));
    // A run that only its override makes too long.
    let long = with(&(change("0.3", "0") + &change("1e9", "100")));
    assert_refused(&long, "1e9", &["end the hold earlier"]);

    assert_refused(
        &with(&change("0.3", "0")),
        "0\n[control]",
        &["the feed hold at 0.3 s is never ended", "percent = 100"],
    );
    let order = with(&(change("0.3", "0") + &change("0.2", "100")));
    assert_refused(&order, "0.2", &["changes at 0.2 s after a change at 0.3 s", "in the order of their at_s"]);
    assert_refused(&with(&change("-1", "50")), "-1", &["at_s = -1 is out of range", "such as 0.4"]);
    assert_refused(&with(&change("nan", "50")), "nan", &["at_s = NaN is out of range"]);
    assert_refused(&with(&change("0.3", "201")), "201", &["percent = 201 is out of range", "0 holds the feed"]);
    assert_refused(&with(&change("0.3", "nan")), "nan", &["percent = NaN is out of range"]);
    let transition = |value: &str| with(&format!("{}transition_s = {value}\n", change("0.3", "50")));
    assert_refused(&transition("0"), "0\n[control]", &["transition_s = 0 is out of range", "leave the key out"]);
    assert_refused(&with("[[feedrate.override]]\nat_s = 0.3\n"), "[[feedrate", &["`percent` is missing"]);
    assert_refused(&with(&(change("0.3", "50") + "share = 2\n")), "share", &["unknown key `share`", "`percent`"]);
    assert_refused(&limited(&change("0.3", "120")), "120\n[control]", &["from 0 to 100", "above 100 %"]);
    // Under limits of the axes the changes take longer where the plan leaves little of them.
    let held = limited(&(change("0.25", "0") + &change("3", "100"))).replacen("feed_mm_s = 100", "feed_mm_s = 150", 1);
    let held = Scenario::from_toml(&held, "it.toml").unwrap();
    let mut worst = [0.0_f64; 2];
    for period in held.simulation().unwrap() {
        let at = &period.setpoint;
        for axis in 0..2 {
            worst[0] = worst[0].max(at.acceleration_mm_s2[axis].abs() / [2000.0, 1500.0][axis]);
            worst[1] = worst[1].max(at.jerk_vector_mm_s3[axis].abs() / [50_000.0, 40_000.0][axis]);
        }
    }
    assert!(worst[0] <= 1.001 && worst[1] <= 1.001, "{worst:?}");
    // The summary holds each axis to its limits, and the limits of the scenario too: none of the path's own.
    let summary = held.run(&mut []).unwrap();
    let limit = |name: &str| summary.limits.iter().find(|check| check.name == name).unwrap();
    let (x, y) = (limit("x.accel_mm_s2"), limit("y.accel_mm_s2"));
    assert_eq!((x.limit, y.limit, limit("y.velocity_mm_s").limit), (2000.0, 1500.0, 120.0));
    let of_the_feed = |check: &&LimitCheck| check.name != "contour_error_um";
    assert!((0.9..=1.001).contains(&(y.value / y.limit)), "{y:?}");
    assert!(summary.limits.iter().filter(of_the_feed).all(|check| check.kept), "{summary:?}");
    let least = &held.limits.check(&Peaks { axes: [[0.0; 3], [0.0, 1600.0, 0.0], [0.0; 3]], ..Peaks::default() });
    assert!(least.iter().any(|check| check.name == "y.accel_mm_s2" && !check.kept), "{least:?}");
    // Many at once: all told.
    assert_eq!(refusal(&with(&(change("-1", "50") + &change("0.5", "300")))).problems().len(), 2);
    let many = refusal(&with(&change("0.3", "50").repeat(1001))).to_string();
    assert!(many.contains("changes 1001 times; at most 1000"), "{many}");
}
