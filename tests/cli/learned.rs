//! What `servosim learn` wrote, read back into runs.

use std::fs;

use crate::common::folder::Folder;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;
use servosim::learning::{LearnRequest, learn};
use servosim::scenario::{Document, Scenario};
use servosim::simulation::write_corrections;

fn json(folder: &Folder, command: &str, code: i32) -> Value {
    let out =
        folder.servosim(&format!("{command} --format json --plots none -q")).assert().code(code).get_output().clone();
    serde_json::from_slice(&out.stdout).unwrap()
}

/// Metrics of a run that `learn` prints too.
const METRICS: [&str; 5] = [
    "max_contour_error_um",
    "rms_contour_error_um",
    "max_tracking_error_um",
    "rms_tracking_error_um",
    "peak_voltage_v",
];

/// The best run of `learn` and a run from the file that it wrote: the same bits.
fn assert_same(learned: &Value, run: &Value) {
    let best = &learned["runs"][usize::try_from(learned["best_run"].as_u64().unwrap()).unwrap() - 1];
    for name in METRICS {
        assert_eq!(best[name].as_f64().unwrap().to_bits(), run[name].as_f64().unwrap().to_bits(), "{name}");
    }
}

#[test]
fn validates_a_run_from_the_file_against_the_best_run_of_learn() {
    let folder = Folder::new();
    for scenario in [
        "alpha",
        // a detailed drive, that looks ahead too. (Without noise, which is another one in every run.)
        "alpha --set axes.x.effects.backlash.gap_um=3 --set axes.y.compensation.zero_phase=true \
         --set axes.x.effects.friction.coulomb.coulomb_nm=0.1",
    ] {
        let learned = json(&folder, &format!("learn {scenario} --runs 4"), 0);
        let run = json(&folder, &format!("run {scenario} --set learned.file=output/alpha-learned.csv"), 0);
        assert_same(&learned, &run);
        assert!(run["max_contour_error_um"].as_f64().unwrap() < 5.0);
    }
}

#[test]
fn the_file_is_seen_from_the_folder_of_the_scenario() {
    let folder = Folder::new();
    folder.write("scenarios/mine.toml", Document::builtin("alpha").unwrap().text());
    folder.servosim("learn mine --runs 2 --plots none").assert().code(0).stderr(contains(
        "to run with it: --set learned.file=../output/mine-learned.csv, or at the top of the scenario: learned.file = \
         \"../output/mine-learned.csv\"\n",
    ));
    // As typed with the shell's help: told what it is called from there.
    folder
        .servosim("run mine --set learned.file=output/mine-learned.csv")
        .assert()
        .code(2)
        .stderr(contains("cannot be read").and(contains("from there it is `../output/mine-learned.csv`")));
    // As the last line of `learn` says.
    let text = format!("learned.file = \"../output/mine-learned.csv\"\n{}", Document::builtin("alpha").unwrap().text());
    folder.write("scenarios/mine.toml", text);
    folder.servosim("check mine").assert().code(0).stdout(contains("1201 samples, learned corrections up to"));
    folder
        .servosim("run mine --plots none")
        .assert()
        .code(0)
        .stdout(contains("ideal model").and(contains("with compensation")));
    folder.servosim("test scenarios").assert().code(0);
    folder.servosim("compare mine --controllers pdff,p-pi --plots none").assert().stdout(contains(
        "every column has the learned corrections, which belong to the gains that they were learned with",
    ));
    folder.servosim("analyze mine --plots none").assert().code(0).stdout(contains("learned corrections"));
    // In a folder whose name needs quotes.
    folder
        .process("learn mine --runs 2 --plots none --output")
        .arg("my output")
        .output()
        .map(|out| {
            let told = String::from_utf8(out.stderr).unwrap();
            assert!(told.contains("--set 'learned.file=\"../my output/mine-learned.csv\"'"), "{told}");
        })
        .unwrap();
}

#[test]
fn learning_goes_on_from_what_was_learned() {
    let folder = Folder::new();
    let first = json(&folder, "learn alpha --runs 3", 0);
    let more = json(&folder, "learn alpha --runs 3 --set learned.file=output/alpha-learned.csv --output more", 0);
    assert_eq!((&first["continued"], &more["continued"]), (&false.into(), &true.into()));
    // Runs 3, 4 and 5 of one learning, to the bit.
    let whole = json(&folder, "learn alpha --runs 5 --output whole", 0);
    for (of_more, of_whole) in [(0, 2), (1, 3), (2, 4)] {
        for name in METRICS {
            assert_eq!(more["runs"][of_more][name], whole["runs"][of_whole][name], "{name}");
        }
    }
    let csv = |place: &str| fs::read_to_string(folder.path(&format!("{place}/alpha-learned.csv"))).unwrap();
    assert_eq!(csv("more"), csv("whole"));
    folder
        .servosim("learn alpha --runs 2 --plots none --set learned.file=more/alpha-learned.csv")
        .assert()
        .code(0)
        .stdout(contains("continues from the correction of the scenario"));
}

#[test]
fn a_file_that_does_not_fit_is_refused_with_its_line() {
    let folder = Folder::new();
    let alpha = Scenario::builtin("alpha").unwrap();
    let learned = learn(&alpha, &LearnRequest { runs: 2, ..LearnRequest::default() }).unwrap();
    let sound = write_corrections(&learned.corrections_mm, learned.period_s);
    folder.write("sound.csv", &sound);
    folder.write("word.csv", sound.replacen("\n17,0.017000000,", "\n17,0.017000000,word", 1));
    folder.write("nan.csv", sound.replacen("\n17,0.017000000,", "\n17,0.017000000,nan,0\n#", 1));
    folder.write("short.csv", sound.lines().take(1000).fold(String::new(), |out, line| out + line + "\n"));
    folder.write("long.csv", format!("{sound}1201,1.201000000,0,0\n"));
    folder.write("header.csv", sound.replacen("x_um", "x_mm", 1));
    folder.write("gap.csv", sound.replacen("\n17,0.017", "\n18,0.018", 1));
    folder.write("huge.csv", vec![b'7'; 1 << 22]);
    folder.write("bytes.csv", [0xff_u8, 0x00, 0x0a, 0xfe]);
    fs::create_dir_all(folder.path("folder.csv")).unwrap();
    for (setting, told) in [
        ("learned.file=nothing.csv", "the learned corrections `nothing.csv` cannot be read"),
        ("learned.file=folder.csv", "give the CSV file that `servosim learn` wrote"),
        ("learned.file=word.csv", "`word.csv`, line 19, column 16: x_um = `word"),
        ("learned.file=nan.csv", "`nan.csv`, line 19, column 16: x_um = `nan` is not a finite number"),
        ("learned.file=short.csv", "`short.csv` ends after 999 samples, this run has 1201"),
        ("learned.file=long.csv", "`long.csv`, line 1203: there are more samples than the 1201 of this run"),
        ("learned.file=header.csv", "the columns must be `sample,time_s,x_um,y_um`, not `sample,time_s,x_mm,y_um`"),
        ("learned.file=gap.csv", "line 19, column 1: sample = `18` is not the number of this sample, 17"),
        ("learned.file=huge.csv", "line 1: the columns must be"),
        ("learned.file=bytes.csv", "line 1: the columns must be"),
        ("learned.file=3", "`file` must be a string"),
        ("learned.fil=\"a.csv\"", "unknown key `fil` in [learned]"),
        ("learned=\"sound.csv\"", "learned"),
        ("learned.file=sound.csv --set control.period_s=0.0005", "0.001 s apart, those of this run 0.0005 s"),
        ("learned.file=sound.csv --set feedrate.feed_mm_s=110", "there are more samples than the"),
        ("learned.file=sound.csv --set feedrate.feed_mm_s=90", "`servosim learn` again"),
    ] {
        for command in ["run", "learn"] {
            let command = format!("{command} alpha --plots none --set {setting}");
            let out = folder.servosim(&command).assert().code(2).stdout("").get_output().clone();
            let error = String::from_utf8(out.stderr).unwrap();
            assert!(error.contains(told) && error.contains('^'), "{command}\n{error}");
        }
    }
    assert!(!folder.path("output").exists());
    // Lines of another system, no end of the last line, and a text that has been through a spreadsheet.
    folder.write("crlf.csv", format!("\u{feff}{}", sound.trim_end().replace('\n', "\r\n")));
    let run = |file: &str| json(&folder, &format!("run alpha --set learned.file={file}"), 0);
    assert_eq!(run("sound.csv"), run("crlf.csv"));
}

#[test]
fn commands_that_cannot_use_it_say_so() {
    let folder = Folder::new();
    folder.servosim("learn alpha --runs 3 --plots none").assert().code(0);
    let with = "alpha --set learned.file=output/alpha-learned.csv";
    // What is tuned has no use for it, and its file is in another folder.
    folder
        .servosim(&format!("tune {with} --gains kpp --budget 60 --starts 1 --plots none"))
        .assert()
        .stdout(contains("without the learned corrections"));
    let tuned = fs::read_to_string(folder.path("output/alpha-tuned.toml")).unwrap();
    assert!(!tuned.contains("learned.file") && !tuned.contains("[learned]"), "{tuned}");
    folder.servosim("run output/alpha-tuned.toml --plots none").assert().code(0);
}

#[test]
fn a_sweep_runs_with_it_and_knows_its_content() {
    let folder = Folder::new();
    folder.servosim("learn alpha --runs 3 --plots none").assert().code(0);
    let with = "alpha --set learned.file=output/alpha-learned.csv";
    let run = json(&folder, &format!("run {with}"), 0);
    folder.servosim(&format!("sweep {with} --vary x.kpp=97.38,100 --plots none --output swept")).assert().code(0);
    let row = |place: &str| {
        let csv = fs::read_to_string(folder.path(&format!("{place}/alpha-sweep.csv"))).unwrap();
        csv.lines().find(|line| line.contains("97.38")).unwrap().to_owned()
    };
    let error = run["max_contour_error_um"].as_f64().unwrap();
    assert!(row("swept").contains(&error.to_string()), "{} {error}", row("swept"));
    // Where the run becomes another one there are no metrics.
    folder
        .servosim(&format!("sweep {with} --vary feedrate.feed_mm_s=100,120 --plots none --output feeds"))
        .assert()
        .code(0)
        .stdout(contains("invalid"));
    // Shards are joined where the file is not.
    for shard in ["1/2", "2/2"] {
        folder
            .servosim(&format!("sweep {with} --vary x.kpp=97.38,100 --plots none --output parts --shard {shard}"))
            .assert()
            .code(0);
    }
    fs::create_dir_all(folder.path("elsewhere")).unwrap();
    let mut merge =
        folder.process("merge ../parts/alpha-sweep.1-of-2.part ../parts/alpha-sweep.2-of-2.part --plots none");
    let out = merge.current_dir(folder.path("elsewhere")).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert_eq!(row("elsewhere/output"), row("swept"));
    folder
        .servosim(&format!("sweep {with} --vary learned.file=a.csv,b.csv"))
        .assert()
        .code(2)
        .stderr(contains("cannot be varied"));
}
