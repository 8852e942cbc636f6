//! The command line, as a user types it: scenarios found and not found, exit codes, what goes where.

use std::fs;
use std::path::Path;
use std::process::{Command as Process, Stdio};
use std::time::{Duration, Instant};

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::{contains, starts_with};
use servosim::summary::Summary;

/// A short line for X and Y: the smallest scenario there is.
fn line_scenario(feed_mm_s: f64) -> String {
    let axis = |name: &str| {
        format!(
            "[axes.{name}.plant.first_order]\ngain_rad_s_v = 83\ntime_constant_s = 0.2\n\
             [axes.{name}.pdff]\nkpp = 97\nkpv = 1\nkiv = 250\nkpf = 0.6\nkvf = 1\n"
        )
    };
    format!(
        "[path.line]\nstart_mm = [0, 0]\nend_mm = [30, 40]\n[feedrate]\nfeed_mm_s = {feed_mm_s}\n\
         [feedrate.profile.quintic]\nphase_s = 0.1\n{}{}",
        axis("x"),
        axis("y")
    )
}

#[test]
fn run_prints_the_figures_of_the_paper() {
    let folder = Folder::new();
    for (name, metrics) in [
        (
            "alpha.toml",
            ["99.941551 mm", "1.099416 s", "27.027 µm", "176.88  µm", "3.511 V", "27.027 of 30, 9.9 % to spare"],
        ),
        (
            "heart",
            ["296.75908  mm", "3.067591 s", "12.506  µm", "156.74   µm", "4.028  V", "12.506 of 30, 58.3 % to spare"],
        ),
    ] {
        let mut assert =
            folder.servosim(&format!("run {name}")).assert().success().stderr(starts_with("wrote output/"));
        for figure in metrics {
            assert = assert.stdout(contains(figure));
        }
        assert.stdout(contains("kept").and(contains("BROKEN").not()));
    }
    folder.servosim("run star").assert().success();
}

#[test]
fn json_is_exactly_one_object() {
    let folder = Folder::new();
    let output = folder
        .servosim("run alpha --format json")
        .assert()
        .success()
        .stderr(starts_with("wrote output/"))
        .get_output()
        .clone();
    let text = String::from_utf8(output.stdout).unwrap();
    let summary: Summary = serde_json::from_str(&text).unwrap();
    assert_eq!(summary.scenario, "alpha");
    assert!((summary.max_contour_error_um - 27.027).abs() < 5e-4);
    assert_eq!(text, serde_json::to_string_pretty(&summary).unwrap() + "\n");
    // The same bytes again, and --quiet leaves what was asked for.
    folder.servosim("run alpha --format json").assert().stdout(text.clone());
    folder.servosim("run alpha --format json --quiet").assert().stdout(text);
    folder.servosim("run alpha --quiet").assert().success().stdout("").stderr("");
}

#[test]
fn a_broken_limit_is_told_and_exits_with_3() {
    let folder = Folder::new();
    folder
        .servosim("run alpha --set limits.contour_error_um=20 --set limits.voltage_v=3.6")
        .assert()
        .code(3)
        .stdout(contains("limit contour_error_um   BROKEN  27.027 of 20, over by 35.1 %"))
        .stdout(contains("limit voltage_v          kept    3.5111 of 3.6, 2.5 % to spare"))
        .stderr(starts_with("wrote output/"));
    let output = folder.servosim("run alpha --set limits.contour_error_um=20 --format json").assert().code(3);
    let summary: Summary = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert!(!summary.passed() && !summary.limits[0].kept);
    // Where there is no table, standard error tells why the exit code is 3.
    let why = "limit contour_error_um broken: 27.027 of 20, over by 35.1 %\n";
    output.stderr(contains(why));
    folder.servosim("run alpha --set limits.contour_error_um=20 --quiet").assert().code(3).stdout("").stderr(why);
}

#[test]
fn rounding_breaks_no_limit() {
    let folder = Folder::new();
    // 100 mm/s in 0.05 s is 2000 mm/s², and 2000.0000000000005 in floating point.
    let linear = "run alpha --set feedrate.profile.linear.phase_s=0.05 --set limits={accel_mm_s2=2000}";
    folder.servosim(linear).assert().success().stdout(contains("limit accel_mm_s2        kept    2000.0 of 2000, 0 %"));
    let linear = linear.replace("2000}", "1999.999}");
    folder.servosim(&linear).assert().code(3).stdout(contains("BROKEN"));
}

#[test]
fn a_locked_loop_is_told_in_words_and_exits_with_3() {
    let folder = Folder::new();
    let scenario = "run alpha --set axes.x.drive.voltage_limit_v=0.5 --set limits={}";
    folder.servosim(scenario).assert().code(3).stdout(contains("\n  axis x LOCKED UP: saturating since"));
    let quiet = folder.servosim(&format!("{scenario} --quiet")).assert().code(3).stdout("");
    quiet.stderr(starts_with("axis x locked up: saturating since"));
}

#[test]
fn an_unstable_loop_that_does_not_show_it_is_told() {
    let folder = Folder::new();
    // The largest pole lies at 1.001: nothing to see in a second.
    let scenario = "run alpha --plots none --set axes.x.pdff.kpp=100 --set axes.x.pdff.kpv=0.251";
    folder.servosim(scenario).assert().stderr(contains("note: the loop of axis x is unstable"));
    folder.servosim("run alpha --plots none").assert().success().stderr(contains("unstable").not());
}

#[test]
fn an_infinite_jerk_can_be_printed() {
    let folder = Folder::new();
    let linear = "run alpha --set feedrate.profile.linear.phase_s=0.1";
    folder.servosim(linear).assert().code(3).stdout(contains("infinite of 50000, over without bound"));
    let output = folder.servosim(&format!("{linear} --format json")).assert().code(3);
    let summary: Summary = serde_json::from_slice(&output.get_output().stdout).unwrap();
    assert!(summary.peak_jerk_mm_s3.is_infinite());
}

#[test]
fn a_scenario_is_a_file_first_then_in_scenarios_then_built_in() {
    let folder = Folder::new();
    // A path too short for the feed tells the three apart by the feed that is reached.
    let feed = |arguments: &str| {
        let output = folder.servosim(&format!("run {arguments} --format json")).output().unwrap();
        serde_json::from_slice::<Summary>(&output.stdout).unwrap().feed_mm_s
    };
    for name in ["alpha", "alpha.toml"] {
        assert_eq!(feed(name), 100.0);
    }
    folder.write("scenarios/alpha.toml", line_scenario(20.0));
    for name in ["alpha", "alpha.toml", "scenarios/alpha.toml", "scenarios/alpha"] {
        assert_eq!(feed(name), 20.0, "{name}");
    }
    folder.write("alpha.toml", line_scenario(10.0));
    for name in ["alpha", "alpha.toml", "./alpha.toml"] {
        assert_eq!(feed(name), 10.0, "{name}");
    }
    // A folder in the way is no scenario.
    fs::create_dir(folder.path("heart")).unwrap();
    assert_eq!(feed("heart"), 100.0);
    // The default name is that of the file.
    folder.write("two words.txt", line_scenario(5.0));
    let output = folder.process("run --format json").arg("two words.txt").output().unwrap();
    assert_eq!(serde_json::from_slice::<Summary>(&output.stdout).unwrap().scenario, "two words");
}

#[test]
fn a_part_that_is_not_there_is_no_scenario() {
    let folder = Folder::new();
    folder.write("x.ngc", "G21 G90\nG1 X10 F600\n");
    for command in ["run x.ngc --part nopart.toml", "toolpath nopart.toml"] {
        let told =
            contains("there is no part `nopart.toml`").and(contains("`servosim new NAME --part` writes a new one"));
        folder.servosim(command).assert().code(2).stdout("").stderr(told.and(contains("alpha").not()));
    }
}

#[test]
fn a_scenario_that_is_not_there_is_told_with_where_it_was_looked_for() {
    let folder = Folder::new();
    folder.write("bracket.toml", line_scenario(10.0));
    for command in ["run", "check"] {
        folder
            .servosim(&format!("{command} brcket"))
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains("there is no scenario `brcket`"))
            .stderr(contains("looked for `brcket`, `brcket.toml`, `scenarios/brcket`, `scenarios/brcket.toml`"))
            .stderr(contains("did you mean `bracket`?"))
            .stderr(contains("built in: alpha, alpha-real, heart, star"));
    }
    folder.servosim("run alhpa.toml").assert().code(2).stderr(contains("did you mean `alpha`?"));
    folder.process("run").arg("").output().map(|o| assert_eq!(o.status.code(), Some(2))).unwrap();
    let strange = folder.process("run").arg("\u{1b}[31mred\n").output().unwrap();
    assert_eq!(strange.status.code(), Some(2));
    assert!(!strange.stderr.contains(&0x1b));
    folder.servosim("run").arg("a".repeat(5000)).assert().code(2);
}

#[test]
fn a_file_that_cannot_be_used_is_told_with_line_column_and_help() {
    let folder = Folder::new();
    let good = line_scenario(100.0);
    let not_utf8 = [good.as_bytes(), b"name = \"\xff\"\n"].concat();
    let last = good.lines().count() + 1;
    for (name, text, place, help) in [
        ("empty", b"".to_vec(), "empty.toml", "servosim new"),
        ("syntax", b"[path.line]\nstart_mm = [0, 0\n[feedrate]\n".to_vec(), "syntax.toml:", "help: "),
        ("type", good.replace("kpp = 97", "kpp = \"97\"").into(), "type.toml:12:7", "`kpp` must be a number"),
        ("unknown", good.replace("kpp = 97", "kp = 97").into(), "unknown.toml:12:1", "did you mean `kpp`?"),
        ("missing", good.replace("kpp = 97\n", "").into(), "missing.toml:11:1", "add a line `kpp = …`"),
        (
            "nan",
            good.replace("kpp = 97", "kpp = nan").into(),
            "nan.toml:12:7",
            "zero or a positive number, at most 1e9 rad/s/mm",
        ),
        ("zero", good.replace("time_constant_s = 0.2", "time_constant_s = 0").into(), "zero.toml:10:19", "positive"),
        ("far", good.replace("[30, 40]", "[1e9, 40]").into(), "far.toml:3:10", "millimetres"),
        ("same", good.replace("[30, 40]", "[0, 0]").into(), "same.toml:3:10", "move `end_mm`"),
        ("utf8", not_utf8, &*format!("utf8.toml:{last}:9"), "save the file as UTF-8"),
        ("comma", good.replace("kpp = 97", "kpp = 97,38").into(), "comma.toml:12:9", "97.38, not 97,38"),
        ("huge", good.replace("kpp = 97", "kpp = 1e300").into(), "huge.toml:12:7", "kpp = 1e300 is out of range"),
        ("bits", good.replace("kpp = 97", "kpp = 99999999999999999999").into(), "bits.toml:12:7", "such as 1e20"),
        ("quick", good.replace("= 0.1", "= 1e-160").into(), "quick.toml:7:11", "from 1e-9 to 1e9"),
        ("axis", (good.clone() + "[axes.z]\nk = 1\n").into(), &*format!("axis.toml:{last}:7"), "key `z` in [axes]"),
        ("utf16bom", [b"\xff\xfe", &good.as_bytes()[..8]].concat(), "utf16bom.toml:1:1", "this is UTF-16"),
        ("utf16", good.encode_utf16().flat_map(u16::to_le_bytes).collect(), "utf16.toml", "help: "),
        ("deep", "[".repeat(100_000).into(), "deep.toml:1:", "help: "),
        ("deeper", format!("a = {}", "[".repeat(100_000)).into(), "deeper.toml:1:21", "nested too deeply"),
    ] {
        folder.write(&format!("{name}.toml"), text);
        for command in ["run", "check"] {
            folder
                .servosim(&format!("{command} {name}"))
                .assert()
                .code(2)
                .stdout("")
                .stderr(contains("error: ").and(contains(place)).and(contains(help)).and(contains('\u{1b}').not()));
        }
    }
    folder.servosim("run .").assert().code(2).stderr(contains("this is a folder"));
    assert!(!folder.path("output").exists(), "an invalid scenario leaves no folder");
}

#[test]
fn a_file_that_may_not_be_read_is_told() {
    let folder = Folder::new();
    folder.write("secret.toml", line_scenario(100.0));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(folder.path("secret.toml"), fs::Permissions::from_mode(0o000)).unwrap();
    }
    // Root may read everything; `scenario::document` tests the message itself.
    if fs::File::open(folder.path("secret.toml")).is_err() {
        folder.servosim("run secret").assert().code(2).stderr(contains("permission denied").and(contains("chmod")));
    }
}

#[test]
fn a_file_that_is_too_long_is_refused_with_its_biggest_array() {
    let folder = Folder::new();
    let points = "[0.125, 0.25], ".repeat((65 << 20) / 15);
    folder.write("long.toml", format!("# long\n[path.ph_spline]\ncontrol_points_mm = [{points}]\n"));
    folder
        .servosim("check long")
        .assert()
        .code(2)
        .stderr(contains("longer than 64 MiB").and(contains("long.toml:3:1")).and(contains("control_points_mm")));
}

#[test]
fn what_is_set_on_the_command_line_counts_and_is_blamed() {
    let folder = Folder::new();
    let stiff = folder.servosim("run alpha --set axes.x.pdff.kpp=120 --set axes.y.pdff.kpp=120 --format json").output();
    let summary: Summary = serde_json::from_slice(&stiff.unwrap().stdout).unwrap();
    // A higher position gain follows more closely.
    assert!(summary.max_tracking_error_um < 176.0, "{}", summary.max_tracking_error_um);
    folder.servosim("run alpha --set name=foo").assert().success().stdout(predicates::str::starts_with("foo\n"));
    folder
        .servosim("run alpha --set axes.x.pdff.kpp=-1")
        .assert()
        .code(2)
        .stderr(contains("alpha.toml (built in, after --set):"))
        .stderr(contains("this comes from `--set axes.x.pdff.kpp=-1`, not from the file"));
    folder.servosim("run alpha --set kpp").assert().code(2).stderr(contains("`--set kpp` has no `=`"));
    for (value, help) in [
        ("12,5", "write decimals with a point"),
        ("120Hz", "decimal point, no unit"),
        ("99999999999999999999", "such as 1e20"),
        ("[1", "lists in [brackets]"),
    ] {
        folder.servosim(&format!("run alpha --set axes.x.pdff.kpp={value}")).assert().code(2).stderr(contains(help));
    }
}

#[test]
fn check_tells_of_every_file() {
    let folder = Folder::new();
    folder.write("bad.toml", line_scenario(100.0).replace("kpp = 97", "kpp = -97"));
    folder.write("good.toml", line_scenario(100.0));
    folder
        .servosim("check bad.toml good.toml alpha nothing")
        .assert()
        .code(2)
        .stdout(contains("good.toml: ok (50.0000 mm, 100 mm/s, 0.6000 s, peak jerk 57735 mm/s³, 701 samples)\n"))
        .stdout(contains("alpha: ok (99.9416 mm, 100 mm/s, 1.099 s, peak jerk 49127 mm/s³, 1201 samples)\n"))
        .stderr(contains("bad.toml:12:7").and(contains("no scenario `nothing`")).and(contains("2 of 4")));
    folder.servosim("check alpha heart star").assert().success().stderr("");
    // A plan that breaks a limit by itself is told, though the scenario is sound.
    folder.write("fast.toml", line_scenario(200.0) + "[limits]\njerk_mm_s3 = 1e5\n");
    folder
        .servosim("check fast")
        .assert()
        .success()
        .stdout(contains("breaks jerk_mm_s3 = 100000: 115470 (over by 15.5 %)"));
    folder.servosim("check").assert().code(2);
}

#[test]
fn new_check_run() {
    let folder = Folder::new();
    folder.servosim("new bracket").assert().success().stdout(contains("wrote bracket.toml"));
    let text = fs::read_to_string(folder.path("bracket.toml")).unwrap();
    assert!(text.contains("servosim run bracket.toml") && !text.contains("{file}"));
    folder.servosim("check bracket.toml").assert().success();
    folder.servosim("run bracket").assert().success().stdout(contains("bracket").and(contains("iterations")));

    folder.write("bracket.toml", "mine");
    folder.servosim("new bracket.toml").assert().code(2).stderr(contains("exists already").and(contains("--force")));
    assert_eq!(fs::read_to_string(folder.path("bracket.toml")).unwrap(), "mine");
    folder.servosim("new bracket --force").assert().success();
    assert_eq!(fs::read_to_string(folder.path("bracket.toml")).unwrap(), text);

    for name in ["..", ".", "a/", ".toml", "a/.."] {
        folder.servosim(&format!("new {name}")).assert().code(2).stderr(contains("no name for a scenario"));
    }
    folder.process("new").arg("").output().map(|o| assert_eq!(o.status.code(), Some(2))).unwrap();
    folder.servosim("new parts/a").assert().code(2).stderr(contains("does not exist").and(contains("mkdir")));
    fs::create_dir(folder.path("parts")).unwrap();
    folder.servosim("new parts/a").assert().success();
    folder.servosim("check parts/a").assert().success();
}

#[test]
fn new_prints_a_command_that_a_shell_takes_and_replaces_all_or_nothing() {
    let folder = Folder::new();
    for (name, argument) in [("two words", "'two words.toml'"), ("it's", r"'it'\''s.toml'"), ("müll", "müll.toml")] {
        let output = folder.process("new").arg(name).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.ends_with(&format!("next: servosim run {argument}\n")), "{text}");
    }
    folder.servosim("new -- -dash").assert().success().stdout(contains("servosim run ./-dash.toml\n"));
    fs::create_dir(folder.path("folder.toml")).unwrap();
    folder.servosim("new folder --force").assert().code(1).stderr(contains("cannot write folder.toml"));
    folder.servosim("new müll --force").assert().success();
    let left: Vec<_> = fs::read_dir(folder.0.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 6, "{left:?}");
}

#[test]
fn new_names_a_schema_that_editors_find() {
    let folder = Folder::new();
    folder.servosim("new bracket").assert().success().stdout(contains("and servosim.schema.json, which editors read"));
    folder.servosim("new other").assert().success().stdout(contains("wrote other.toml; next"));
    folder.servosim("new lid --part").assert().success().stdout(contains("and servosim.part.schema.json"));
    for (name, schema, command) in
        [("bracket", "servosim.schema.json", "schema"), ("lid", "servosim.part.schema.json", "schema --part")]
    {
        let text = fs::read_to_string(folder.path(&format!("{name}.toml"))).unwrap();
        assert!(text.starts_with(&format!("#:schema ./{schema}\n")), "{text}");
        let printed = folder.servosim(command).assert().success().get_output().stdout.clone();
        assert!(fs::read(folder.path(schema)).unwrap() == printed, "{schema}");
    }
    folder.servosim("check bracket.toml other.toml lid.toml").assert().success();
}

#[test]
fn an_unknown_command_is_answered_with_the_one_that_was_meant() {
    let folder = Folder::new();
    for (given, meant) in [("analyse", "analyze"), ("simulate", "run"), ("tuning", "tune")] {
        folder.servosim(&format!("{given} alpha")).assert().code(2).stderr(contains(format!("'{meant}'")));
    }
    folder.servosim("frobnicate").assert().code(2).stderr(contains("similar").not());
}

#[test]
fn a_file_whose_name_no_output_can_have_is_told_before_the_run() {
    let folder = Folder::new();
    for name in ["n".repeat(240), "new\nline".to_owned(), "ü".repeat(110)] {
        folder.write(&format!("{name}.toml"), line_scenario(50.0));
        let output = folder.process("run").arg(format!("{name}.toml")).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains("name of its own"), "{stderr}");
        assert!(!folder.path("output").exists());
        let output = folder.process("run --set name=short").arg(format!("{name}.toml")).output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        fs::remove_dir_all(folder.path("output")).unwrap();
    }
    // A hundred characters of four bytes each are too long for a file's name, too.
    let output = folder.process("run alpha --set").arg(format!("name={}", "\u{20000}".repeat(100))).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn schema_is_json_that_names_the_keys() {
    let folder = Folder::new();
    let output = folder.servosim("schema").assert().success().stderr("").get_output().clone();
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        schema["properties"]["axes"]["properties"]["x"]["properties"]["pdff"]["properties"]["kpp"]["minimum"],
        0
    );
    assert_eq!(schema["properties"]["control"]["properties"]["period_s"]["minimum"], 1e-9);
}

#[test]
fn wrong_usage_exits_with_2_and_help_with_0() {
    let folder = Folder::new();
    for arguments in ["", "run", "rum alpha", "run alpha --plots pdf", "run alpha beta", "new", "run alpha --set"] {
        folder.servosim(arguments).assert().code(2).stdout("").stderr(contains("Usage").or(contains("--help")));
    }
    for arguments in ["--help", "run --help", "check --help", "new --help", "schema --help"] {
        folder.servosim(arguments).assert().success().stdout(contains("Usage")).stderr("");
    }
    folder.servosim("--help").assert().stdout(contains("Exit codes").and(contains("Examples")));
    folder.servosim("--version").assert().success().stdout(contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn the_output_folder_is_made_and_what_is_in_its_way_is_told() {
    let folder = Folder::new();
    folder.servosim("run alpha").assert().success();
    assert!(folder.path("output").is_dir());
    folder.servosim("run alpha --output a/b/c").assert().success();
    assert!(folder.path("a/b/c").is_dir());
    folder.write("file", "in the way");
    folder.servosim("run alpha --output file/below").assert().code(1).stdout("").stderr(contains("file/below"));
    for command in ["run alpha", "plot alpha"] {
        let in_the_way = folder.servosim(&format!("{command} --output file")).assert().code(2).stdout("");
        in_the_way.stderr(contains("file: it is a file, not a folder").and(contains("help: --output takes a folder")));
    }
    assert_eq!(fs::read_to_string(folder.path("file")).unwrap(), "in the way");
}

/// Standard output whose reader has gone away before anything is written.
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = Folder::new();
    for (arguments, code) in [
        ("run alpha", 0),
        ("run alpha --format json", 0),
        ("run alpha --set limits.voltage_v=1", 3),
        ("check alpha", 0),
        ("schema", 0),
        ("--help", 0),
        ("new piped", 0),
    ] {
        let output = folder.process(arguments).stdout(closed_pipe()).stderr(Stdio::piped()).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments}");
        assert!(stderr.is_empty() || stderr.starts_with("wrote output/"), "{arguments}: {stderr}");
    }
    // Nobody to tell: still the right code.
    let status = folder.process("run nothing").stderr(closed_pipe()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_standard_output_is_a_failure() {
    let folder = Folder::new();
    for arguments in ["run alpha", "run alpha --format json", "schema", "check alpha"] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = folder.process(arguments).stdout(full).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("cannot write to standard output"), "{arguments}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_after_a_whole_period() {
    let folder = Folder::new();
    for signal in ["INT", "TERM"] {
        let _ = fs::remove_dir_all(folder.path("output"));
        // 99 million periods: nobody waits for the end of that.
        let mut process = folder.process("run alpha --set control.settling_s=99000 --format json");
        let child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // The folder is made after the handler is in place.
        wait_for(&folder.path("output"));
        std::thread::sleep(Duration::from_millis(100));
        let killed = Process::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains("interrupted at t = "), "{stderr}");
        // The metrics until then are there, and say that they are not all.
        let summary: Summary = serde_json::from_slice(&output.stdout).unwrap();
        assert!(!summary.complete && summary.samples > 0 && summary.samples < 99_000_000);
    }
}

fn wait_for(path: &Path) {
    let started = Instant::now();
    while !path.exists() {
        assert!(started.elapsed() < Duration::from_mins(1), "{} did not appear", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn colour_is_for_terminals_only() {
    let folder = Folder::new();
    folder.servosim("run nothing").assert().stderr(contains('\u{1b}').not());
    folder.servosim("run nothing").env("CLICOLOR_FORCE", "1").assert().stderr(contains('\u{1b}'));
    folder.servosim("run nothing").env("CLICOLOR_FORCE", "1").env("NO_COLOR", "1").assert().stderr(contains("error"));
}

#[test]
fn check_tells_all_mistakes_in_the_order_of_the_file() {
    let folder = Folder::new();
    let alpha = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/alpha.toml")).unwrap();
    let mut text = String::new();
    // An unknown key, a value of the wrong type, one that is missing, one out of its range, an unknown table, a word that is none.
    for line in alpha.lines() {
        let axis = |prefix: &str| line.trim_start().starts_with(prefix);
        match () {
            () if axis("feed_mm_s") => text.push_str("fed_mm_s = 100\nfeed_mm_s = -3\n"),
            () if axis("phase_s") => text.push_str("phase_s = \"0.1\"\n"),
            () if axis("kvf") && !text.contains("kfv") => text.push_str("kfv = 1\n"),
            () => {
                text.push_str(line);
                text.push('\n');
            }
        }
    }
    text.push_str("\n[controll]\nperiod_s = 0.001\n");
    folder.write("wrong.toml", &text);
    for command in ["check wrong.toml", "run wrong.toml", "analyze wrong.toml"] {
        let output = folder.servosim(command).assert().code(2);
        let told = String::from_utf8(output.get_output().stderr.clone()).unwrap();
        let wanted = [
            "unknown key `fed_mm_s`",
            "feed_mm_s",
            "phase_s",
            "`kvf` is missing",
            "unknown key `kfv`",
            "unknown key `controll`",
        ];
        let mut at = 0;
        for text in wanted {
            at += told[at..].find(text).unwrap_or_else(|| panic!("{command}: no `{text}` behind {at} in\n{told}"));
        }
        assert_eq!(told.matches("error:").count(), wanted.len(), "{told}");
        // Each with its line.
        assert_eq!(told.matches("wrong.toml:").count(), wanted.len(), "{told}");
    }
    assert!(!folder.path("output").exists());
}
