//! Scenarios as documents: values that are set, the schema, files, and damaged text.

use std::path::Path;

use crate::common::scenario::{alpha, altered, bare};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::feedrate::{AxisLimits, Profile};
use servosim::scenario::{Document, FeedProfile, Scenario, ScenarioError, builtin_names, json_schema};
use servosim::servo::Derivative;

fn with(sets: &[&str]) -> Result<Scenario, ScenarioError> {
    let mut document = Document::builtin("alpha").unwrap();
    for set in sets {
        document.set(set)?;
    }
    document.scenario()
}

#[test]
fn a_value_that_is_set_is_the_only_thing_that_changes() {
    let mut document = Document::builtin("alpha").unwrap();
    document.set("axes.x.pdff.kpp=120").unwrap();
    document.set("limits.contour_error_um = 40.5").unwrap();
    let changed: Vec<(String, String)> = alpha()
        .lines()
        .zip(document.text().lines())
        .filter(|(before, after)| before != after)
        .map(|(before, after)| (before.to_owned(), after.to_owned()))
        .collect();
    let line = |text: &str| text.to_owned();
    assert_eq!(
        changed,
        [(line("kpp = 97.38"), line("kpp = 120")), (line("contour_error_um = 30"), line("contour_error_um = 40.5"))]
    );
    let scenario = document.scenario().unwrap();
    assert_eq!(scenario.axes[0].pdff.kpp_rad_s_mm, 120.0);
    assert_eq!(scenario.axes[1].pdff.kpp_rad_s_mm, 97.38);
    assert_eq!(scenario.source, document.text());
    // The text that is kept is the whole truth.
    let again = Scenario::from_toml(&scenario.source, "alpha.toml").unwrap();
    assert_eq!(again.run(&mut []).unwrap(), scenario.run(&mut []).unwrap());
}

#[test]
fn a_gain_can_be_set_by_its_short_key() {
    assert_eq!(with(&["x.kpp=120"]).unwrap().axes, with(&["axes.x.pdff.kpp=120"]).unwrap().axes);
    assert_eq!(with(&["y.kvf=0.5"]).unwrap().axes[1].pdff.kvf, 0.5);
    assert!(with(&["z.kpp=120"]).is_err() && with(&["x.kp=120"]).is_err());
}

#[test]
fn words_lists_and_new_tables_can_be_set() {
    assert_eq!(with(&["name=foo"]).unwrap().name, "foo");
    assert_eq!(with(&["name=\"foo = bar\""]).unwrap().name, "foo = bar");
    assert_eq!(with(&["control.derivative=exact"]).unwrap().settings.derivative, Derivative::Exact);
    assert!(with(&["feedrate.profile.exponential.n_c=optimize"]).unwrap().n_c_search.is_some());
    let line = with(&["path={line={start_mm=[0,0],end_mm=[3,4]}}"]).unwrap();
    assert!((line.path.length_mm() - 5.0).abs() < 1e-12);
    let mut bare = Document::from_text(alpha()[..alpha().find("[limits]").unwrap()].to_owned(), "bare.toml");
    bare.set("limits.voltage_v=4.5").unwrap();
    assert_eq!(bare.scenario().unwrap().limits.voltage_v, Some(4.5));
    // The last one counts.
    assert_eq!(with(&["axes.y.pdff.kpp=1", "axes.y.pdff.kpp=2"]).unwrap().axes[1].pdff.kpp_rad_s_mm, 2.0);
    // A comment behind a value stays.
    let mut heart = Document::builtin("heart").unwrap();
    heart.set("axes.x.pdff.kpp=7").unwrap();
    assert!(heart.text().contains("kpp = 7  # rad/s/mm\n"), "{}", heart.text());
}

#[test]
fn setting_another_choice_replaces_the_one_that_is_there() {
    assert_eq!(
        with(&["feedrate.profile.quintic.phase_s=0.2"]).unwrap().profile,
        FeedProfile::Phases(Profile::Quintic { phase_s: 0.2 })
    );
    assert_eq!(
        with(&["feedrate.profile.jerk_limited.accel_mm_s2=2000", "feedrate.profile.jerk_limited.jerk_mm_s3=5e4"])
            .unwrap()
            .profile,
        FeedProfile::Phases(Profile::JerkLimited { accel_mm_s2: 2000.0, jerk_mm_s3: 5e4 })
    );
    let limits = ["velocity_mm_s=[150, 120]", "acceleration_mm_s2=[2000, 1500]", "jerk_mm_s3=[5e4, 4e4]"]
        .map(|limit| format!("feedrate.profile.axis_limited.{limit}"));
    assert_eq!(
        with(&limits.each_ref().map(String::as_str)).unwrap().profile,
        FeedProfile::AxisLimited(AxisLimits {
            velocity_mm_s: [150.0, 120.0],
            acceleration_mm_s2: [2000.0, 1500.0],
            jerk_mm_s3: [5e4, 4e4],
        })
    );
    let circle = with(&["path.circle.radius_mm=10", "path.circle.centre_mm=[0, 0]"]).unwrap();
    assert!((circle.path.length_mm() - std::f64::consts::TAU * 10.0).abs() < 1e-12);
    let plant = "axes.y.plant.mechanics";
    let sets = ["mass_kg=20", "inertia_kg_m2=1e-3", "viscous_friction_nm_s_rad=0.01"].map(|s| format!("{plant}.{s}"));
    let mechanics = with(&sets.each_ref().map(String::as_str)).unwrap();
    assert!((mechanics.axes[1].plant.gain_rad_s_v - 71.6).abs() < 1e-9);
    // Within an inline table too.
    let mut inline = Document::from_text(
        altered(
            "[feedrate.profile.exponential]",
            "profile = { exponential = { phase_s = 0.1, n_c = 8.12 } }\n[unused]",
        )
        .replacen("\n[unused]", "", 1)
        .replacen("\nphase_s = 0.1\n", "\n", 1)
        .replacen("\nn_c = 8.12\n", "\n", 1),
        "inline.toml",
    );
    inline.set("feedrate.profile.cubic.phase_s=0.3").unwrap();
    assert_eq!(inline.scenario().unwrap().profile, FeedProfile::Phases(Profile::Cubic { phase_s: 0.3 }));
}

#[test]
fn a_mistake_in_what_is_set_is_blamed_on_it() {
    let message = |sets: &[&str]| match with(sets) {
        Err(error) => error.to_string(),
        Ok(scenario) => panic!("{sets:?} accepted: {scenario:?}"),
    };
    for (set, words) in [
        ("axes.x.pdff.kpp=-1", "zero or a positive"),
        ("axes.x.pdff.kpp=fast", "must be a number"),
        ("axes.x.pdff.kp=1", "did you mean `kpp`?"),
        ("feedrate.profile.quintc.phase_s=1", "did you mean `quintic`?"),
        ("feedrate.profile.jerk_limited.accel_mm_s2=1", "`jerk_mm_s3` is missing"),
        ("control=3", "must be a table"),
        ("path.ph_spline.control_points_mm=[[0,0]]", "too few"),
    ] {
        let message = message(&[set]);
        assert!(message.contains(words), "{set}: {message}");
        assert!(message.contains(&format!("this comes from `--set {set}`")), "{set}: {message}");
        assert!(message.contains("--> alpha.toml (built in, after --set):"), "{set}: {message}");
    }
    for (set, words) in [
        ("kpp", "has no `=`"),
        ("=3", "not a key"),
        ("a b=3", "not a key"),
        ("limits.voltage_v=", "has no value"),
        ("limits.voltage_v=[1", "not TOML"),
        ("limits.voltage_v=3 volts", "not TOML"),
        ("feedrate.feed_mm_s.x=3", "`feed_mm_s` is a value"),
        ("name=\u{1b}[31m", "not TOML"),
    ] {
        let message = message(&[set]);
        assert!(message.contains(words) && message.contains("help: "), "{set}: {message}");
        assert!(!message.contains('\u{1b}'), "{set}: {message:?}");
    }
    assert!(message(&[&format!("a{}=1", ".a".repeat(100_000))]).len() < 1000);
    assert!(message(&[&format!("a={}", "[".repeat(100_000))]).contains("too deeply"));
    // What the file did wrong is not blamed on what was set.
    let mut document = Document::from_text(altered("kpv = 1.19", "kpv = -1"), "mine.toml");
    document.set("axes.x.pdff.kpp=120").unwrap();
    assert!(!document.scenario().unwrap_err().to_string().contains("this comes from"));
    let mut broken = Document::from_text(altered("period_s = 0.001", "period_s ="), "mine.toml");
    assert!(broken.set("name=foo").unwrap_err().to_string().contains("write a value"));
}

/// Every key path of a document, with `*` for nothing: tables and values alike.
fn key_paths(value: &toml::Value, path: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    if let toml::Value::Table(table) = value {
        for (key, inner) in table {
            path.push(key.clone());
            found.push(path.clone());
            key_paths(inner, path, found);
            path.pop();
        }
    }
}

/// Whether the schema knows the key path, refusing what a closed table does not list.
fn schema_accepts(node: &serde_json::Value, path: &[String]) -> bool {
    let Some((first, rest)) = path.split_first() else { return true };
    if let Some(properties) = node.get("properties") {
        assert_eq!(node["additionalProperties"], false, "an open table before {path:?}");
        return properties.get(first).is_some_and(|next| schema_accepts(next, rest));
    }
    ["oneOf", "anyOf"]
        .iter()
        .filter_map(|key| node.get(key)?.as_array())
        .flatten()
        .any(|choice| schema_accepts(choice, path))
}

#[test]
fn the_schema_knows_the_keys_of_the_built_in_scenarios_and_no_others() {
    let schema = json_schema();
    let mut seen = 0;
    for name in builtin_names() {
        let value: toml::Value = toml::from_str(Document::builtin(name).unwrap().text()).unwrap();
        let mut paths = Vec::new();
        key_paths(&value, &mut Vec::new(), &mut paths);
        for path in &paths {
            assert!(schema_accepts(&schema, path), "{name}: the schema does not know {path:?}");
            let mut wrong = path.clone();
            wrong.last_mut().unwrap().push('x');
            assert!(!schema_accepts(&schema, &wrong), "{name}: the schema accepts {wrong:?}");
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
    assert_eq!(schema["required"], serde_json::json!(["path", "feedrate", "axes"]));
}

#[test]
fn the_schema_describes_every_key() {
    fn check(node: &serde_json::Value, path: &str) {
        if let Some(properties) = node.get("properties").and_then(serde_json::Value::as_object) {
            for (key, inner) in properties {
                assert!(inner.get("description").is_some(), "{path}.{key} has no description");
                check(inner, &format!("{path}.{key}"));
            }
        }
        for choice in node.get("oneOf").and_then(serde_json::Value::as_array).into_iter().flatten() {
            check(choice, path);
        }
    }
    check(&json_schema(), "");
}

#[test]
fn files_are_read_and_what_cannot_be_read_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    std::fs::write(&path, alpha()).unwrap();
    assert_eq!(Scenario::load(&path).unwrap().name, "mine");
    let message = |path: &Path| Scenario::load(path).unwrap_err().to_string();
    assert!(message(&folder.path().join("nothing.toml")).contains("there is no scenario"));
    assert!(message(folder.path()).contains("this is a folder"));
    let mut bytes = altered("kpp = 97.38", "kpp = µ?").into_bytes();
    let place = bytes.windows(2).position(|pair| pair == "µ".as_bytes()).unwrap();
    bytes[place + 1] = b'?';
    std::fs::write(&path, &bytes).unwrap();
    let line = bytes[..place].split(|&b| b == b'\n').count();
    let found = message(&path);
    assert!(found.contains("not UTF-8") && found.contains(&format!("mine.toml:{line}:7\n")), "{found}");
}

/// Random damage never panics and always gets a message that can be shown.
#[test]
fn damaged_text_is_refused_or_accepted_but_never_worse() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let meaning = bare().into_bytes();
    let (mut accepted, mut refused) = (0, 0);
    for case in 0..4000 {
        let mut bytes = meaning.clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..5) {
                0 => bytes[at] = random.random(),
                1 => bytes[at] = b"[]{}=.,\"'#-+e0_9\n "[random.random_range(0..18)],
                2 => drop(bytes.remove(at)),
                3 => bytes.insert(at, b"[]{}=.,\"'#-+e0_9\n "[random.random_range(0..18)]),
                _ => {
                    let end = (at + random.random_range(1..30)).min(bytes.len());
                    let piece: Vec<u8> = bytes.drain(at..end).collect();
                    let to = random.random_range(0..=bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if case % 4 == 0 {
            let _ = Document::from_text(&*text, "it.toml").set("feedrate.profile.cubic.phase_s=0.1");
        }
        match Scenario::from_toml(&text, "it.toml") {
            Ok(_) => accepted += 1,
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                let shown = message.chars().all(|c| c == '\n' || !c.is_control());
                assert!(message.starts_with("error: ") && shown, "case {case}: {message:?}\n{text}");
            }
        }
    }
    assert!(accepted > 100 && refused > 2000, "{accepted} accepted, {refused} refused");
}
