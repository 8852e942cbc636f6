//! `servosim test` as a user types it.

use std::fs;
use std::process::{Command as Process, Stdio};
use std::time::{Duration, Instant};

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::{contains, ends_with, starts_with};
use quick_xml::events::Event;
use quick_xml::{Reader, XmlVersion};
use serde_json::Value;

/// A folder with scenarios that pass, that break a limit, that lock up, that cannot be used.
fn suite() -> Folder {
    let folder = Folder::new();
    let alpha = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/alpha.toml")).unwrap();
    let change = |from: &str, to: &str| {
        assert!(alpha.contains(from));
        alpha.replace(from, to)
    };
    let (head, _) = alpha.split_once("\n[limits]").unwrap();
    folder.write("s/a good.toml", &alpha);
    folder.write("s/b tight <&'\">.toml", change("contour_error_um = 30", "contour_error_um = 20\nvoltage_v = 3"));
    folder.write("s/c weak.toml", change("voltage_limit_v = 5", "voltage_limit_v = 0.5"));
    folder.write("s/d wrong.toml", change("feed_mm_s = 100", "fed_mm_s = 100"));
    folder.write("s/e none.toml", head);
    folder.write("s/notes.txt", "no scenario");
    folder.write("s/f.toml/g.toml", "not looked at: a folder of that name is no scenario");
    folder
}

#[test]
fn every_scenario_of_a_folder_is_held_to_its_limits() {
    let folder = suite();
    folder
        .servosim("test s")
        .assert()
        // One that cannot be used weighs more than broken limits.
        .code(2)
        .stdout(starts_with("scenario              limit                      value  limit  margin\n"))
        .stdout(contains("\ns/a good.toml         contour_error_um  kept    27.027     30  9.9 % to spare\n"))
        .stdout(contains("\ns/b tight <&'\">.toml  contour_error_um  BROKEN  27.027     20  over by 35.1 %\n"))
        .stdout(contains("\n                      voltage_v         BROKEN  3.5111      3  over by 17.0 %\n"))
        .stdout(contains("\n                      axis y LOCKED UP: saturating since"))
        .stdout(contains("\ns/d wrong.toml        CANNOT BE USED\ns/e none.toml         skipped: no limits\n"))
        .stdout(ends_with(
            "\n5 scenarios: 1 passed, 1 skipped, without limits, 1 broke a limit, 1 locked up, 1 cannot be used\n",
        ))
        .stderr(contains("--> s/d wrong.toml:").and(ends_with("error: 1 of 5 scenarios cannot be used\n")));
    // Nothing is recorded or plotted.
    assert!(!folder.path("output").exists());
    assert_eq!(fs::read_dir(folder.path("s")).unwrap().count(), 7);
}

#[test]
fn the_exit_code_tells_what_happened() {
    let folder = Folder::new();
    folder.servosim("test alpha heart star").assert().success().stderr("").stdout(ends_with("3 scenarios: 3 passed\n"));
    let broken = "test alpha heart --set limits.contour_error_um=20";
    let last = "2 scenarios: 1 passed, 1 broke a limit\n";
    folder.servosim(broken).assert().code(3).stdout(ends_with(last)).stderr("");
    folder
        .servosim(&format!("{broken} --quiet"))
        .assert()
        .code(3)
        .stdout("")
        .stderr("alpha: limit contour_error_um broken: 27.027 of 20, over by 35.1 %\n");
    let both = "test alpha heart --set limits.contour_error_um=1";
    folder.servosim(both).assert().code(3).stdout(ends_with("2 scenarios: 2 broke limits\n"));
    folder
        .servosim("test alpha --set axes.x.drive.voltage_limit_v=0.5 --set limits={} --quiet")
        .assert()
        .code(3)
        .stderr(starts_with("alpha: axis x locked up"));
    // The others run all the same, and a scenario that is named twice runs once.
    let wrong = folder.servosim("test nothing alpha alpha").assert().code(2);
    wrong.stdout(ends_with("2 scenarios: 1 passed, 1 cannot be used\n")).stderr(contains("no scenario `nothing`"));
}

#[test]
fn the_output_does_not_depend_on_the_number_of_jobs() {
    let folder = suite();
    let run = |jobs: u8| {
        let command = format!("test s alpha heart star --junit r{jobs}.xml --jobs {jobs}");
        let output = folder.servosim(&command).output().unwrap();
        let json = folder.servosim(&format!("test s alpha heart star --format json --jobs {jobs}")).output().unwrap();
        // All but the times.
        let xml = fs::read_to_string(folder.path(&format!("r{jobs}.xml"))).unwrap();
        let xml: Vec<&str> = xml
            .split(" time=\"")
            .enumerate()
            .map(|(i, piece)| if i == 0 { piece } else { piece.split_once('"').unwrap().1 })
            .collect();
        let xml = xml.concat();
        (output.status.code(), output.stdout, output.stderr, xml, json.stdout, json.stderr)
    };
    let one = run(1);
    for jobs in [2, 3, 16] {
        assert!(run(jobs) == one, "{jobs}");
    }
}

#[test]
fn json_is_exactly_one_object() {
    let folder = suite();
    let output = folder.servosim("test s --format json").assert().code(2);
    let value: Value = serde_json::from_slice(&output.get_output().stdout).unwrap();
    let counts =
        ["passed", "skipped", "broken", "locked_up", "unusable", "failed"].map(|key| value[key].as_u64().unwrap());
    assert_eq!(counts, [1, 1, 1, 1, 1, 0]);
    let scenarios = value["scenarios"].as_array().unwrap();
    let verdicts: Vec<&str> = scenarios.iter().map(|s| s["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["passed", "broken", "locked_up", "unusable", "skipped"]);
    assert_eq!(scenarios[1]["limits"][0]["name"], "contour_error_um");
    assert_eq!(scenarios[1]["limits"][0]["kept"], false);
    assert!(scenarios[2]["lockup"].as_str().unwrap().contains("axis y locked up"));
    assert!(scenarios[3]["error"].as_str().unwrap().contains("unknown key `fed_mm_s`"));
    // The same metrics as a run.
    let run = folder.servosim("run alpha --format json --plots none --quiet").output().unwrap();
    let run: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(scenarios[0]["limits"], run["limits"]);
    // What broke is told where there is no table.
    output.stderr(contains("s/b tight <&'\">.toml: limit voltage_v broken: 3.5111 of 3, over by 17.0 %\n"));
}

#[test]
fn junit_has_a_case_for_every_limit_and_one_for_lock_up() {
    let folder = suite();
    folder.servosim("test s --junit made/deep/report.xml --quiet").assert().code(2);
    let xml = fs::read_to_string(folder.path("made/deep/report.xml")).unwrap();
    let left: Vec<_> = fs::read_dir(folder.path("made/deep")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["report.xml"]);
    // Read back by a parser: suite, case and what is wrong with it.
    let mut reader = Reader::from_str(&xml);
    reader.config_mut().check_end_names = true;
    let (mut cases, mut problems) = (Vec::new(), Vec::new());
    let (mut totals, mut values) = (String::new(), Vec::new());
    let (mut total_s, mut sum_s) = (0.0, 0.0);
    loop {
        let event = reader.read_event().unwrap();
        let (Event::Start(element) | Event::Empty(element)) = event else {
            if event == Event::Eof {
                break;
            }
            continue;
        };
        let attribute = |name: &str| {
            let value = element.try_get_attribute(name).unwrap().unwrap();
            value.normalized_value(XmlVersion::Explicit1_0).unwrap().into_owned()
        };
        match element.name().as_ref() {
            "testsuites" => {
                totals = ["tests", "failures", "errors", "skipped"].map(attribute).join(" ");
                total_s = attribute("time").parse().unwrap();
            }
            "testcase" => {
                cases.push(format!("{}: {}", attribute("classname"), attribute("name")));
                sum_s += attribute("time").parse::<f64>().unwrap();
            }
            "property" => values.push(format!("{} {}", attribute("name"), attribute("value"))),
            kind @ ("failure" | "error" | "skipped") => {
                let kind = kind.to_owned();
                problems.push(format!("{} {kind}: {}", cases.last().unwrap(), attribute("message")));
            }
            _ => {}
        }
    }
    assert_eq!(totals, "16 4 1 1");
    // Rounded to the microsecond each.
    assert!(total_s > 0.0 && (total_s - sum_s) / total_s < 0.01 + 2e-5 / total_s, "{total_s} {sum_s}");
    assert!(values[0].starts_with("value 27.02") && values[1] == "limit 30", "{values:?}");
    assert_eq!(
        cases[..9],
        [
            "s/a good.toml: contour_error_um",
            "s/a good.toml: accel_mm_s2",
            "s/a good.toml: jerk_mm_s3",
            "s/a good.toml: lock-up",
            "s/b tight <&'\">.toml: contour_error_um",
            "s/b tight <&'\">.toml: voltage_v",
            "s/b tight <&'\">.toml: accel_mm_s2",
            "s/b tight <&'\">.toml: jerk_mm_s3",
            "s/b tight <&'\">.toml: lock-up",
        ]
    );
    assert_eq!(problems.last().unwrap(), "s/e none.toml: limits skipped: the scenario has no limits");
    assert_eq!(problems[0], "s/b tight <&'\">.toml: contour_error_um failure: 27.027 of 20, over by 35.1 %");
    assert_eq!(problems[1], "s/b tight <&'\">.toml: voltage_v failure: 3.5111 of 3, over by 17.0 %");
    assert!(problems.iter().any(|p| p.starts_with("s/c weak.toml: lock-up failure: axis y locked up")), "{problems:?}");
    assert!(
        problems
            .iter()
            .any(|p| p.starts_with("s/d wrong.toml: scenario error: ") && p.contains("unknown key `fed_mm_s`"))
    );
}

#[test]
fn bad_input_is_told() {
    let folder = Folder::new();
    folder.servosim("test").assert().code(2).stderr(contains("<FILE_OR_FOLDER>"));
    folder.servosim("test alpha --jobs 0").assert().code(2).stderr(contains("0 is not in 1.."));
    fs::create_dir(folder.path("empty")).unwrap();
    folder.servosim("test empty").assert().code(2).stdout("").stderr(contains("there is no scenario in empty"));
    folder.servosim("test alpha --set nonsense").assert().code(2).stderr(contains("nonsense"));
    // A report that cannot be written is a failure; the table comes all the same.
    fs::create_dir(folder.path("taken.xml")).unwrap();
    let taken = folder.servosim("test alpha --junit taken.xml").assert().code(1);
    taken.stdout(ends_with("1 scenario: 1 passed\n")).stderr(contains("cannot write taken.xml"));
    assert_eq!(fs::read_dir(folder.0.path()).unwrap().count(), 2);
}

#[cfg(unix)]
#[test]
fn an_interrupted_suite_ends_soon_and_says_so() {
    let folder = Folder::new();
    let mut process = folder.process("test alpha heart --jobs 1 --set control.settling_s=9e4 --junit report.xml");
    let child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    let start = Instant::now();
    assert!(Process::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(5));
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "error: interrupted after 0 of 2 scenarios\n");
    assert!(output.stdout.is_empty() && !folder.path("report.xml").exists());
}
