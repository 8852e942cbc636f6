//! What a run leaves behind: recording and plots, as a user finds them, and what is in their way.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command as Process, Stdio};

use crate::common::folder::Folder;
use predicates::prelude::*;
use predicates::str::contains;
use servosim::recording::Recording;
use servosim::summary::Summary;

/// Names of the files in a folder, sorted.
fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_run_leaves_a_recording_and_four_plots() {
    let folder = Folder::new();
    folder.servosim("run alpha.toml").assert().success().stderr(contains("wrote output/alpha.mcap"));
    let plots = ["alpha-contour.svg", "alpha-feedrate.svg", "alpha-path.svg", "alpha-voltage.svg"];
    let wanted = [&plots[..], &["alpha.layout.json", "alpha.mcap"]].concat();
    assert_eq!(entries(&folder.path("output")), wanted);
    let recording = Recording::open(folder.path("output/alpha.mcap")).unwrap();
    assert!(recording.complete && recording.samples == 1201);
    // The attachment, --format json and the table tell of the same run.
    let output = folder.servosim("run alpha.toml --plots none --format json").output().unwrap();
    let printed: Summary = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(recording.summary().unwrap(), printed);
    assert_eq!(printed.recording.as_deref(), Some("alpha.mcap"));
    assert_eq!(format!("{:.3}", printed.max_contour_error_um), "27.027");
}

#[test]
fn a_search_has_a_plot_of_its_own_and_png_is_png() {
    let folder = Folder::new();
    let set = r#"feedrate.profile.exponential.n_c="optimize""#;
    folder.servosim(&format!("run alpha --output here/and/there --plots png --set {set}")).assert().success();
    let names = entries(&folder.path("here/and/there"));
    assert_eq!(names.len(), 7, "{names:?}");
    let mut head = [0; 8];
    fs::File::open(folder.path("here/and/there/alpha-search.png")).unwrap().read_exact(&mut head).unwrap();
    assert_eq!(&head, b"\x89PNG\r\n\x1a\n");
    let summary = Recording::open(folder.path("here/and/there/alpha.mcap")).unwrap().summary().unwrap();
    assert_eq!(format!("{:.3} {:.0}", summary.n_c.unwrap(), summary.peak_jerk_mm_s3), "8.350 48146");
    assert!(summary.n_c_search.unwrap().len() > 10);
}

#[test]
fn a_broken_limit_still_leaves_everything() {
    let folder = Folder::new();
    folder.servosim("run alpha --set limits.contour_error_um=20").assert().code(3).stdout(contains("BROKEN"));
    assert_eq!(entries(&folder.path("output")).len(), 6);
    folder.servosim("run heart --set feedrate.feed_mm_s=400").assert().code(3).stdout(contains("axis y LOCKED UP"));
    let recording = Recording::open(folder.path("output/heart.mcap")).unwrap();
    assert!(recording.log.iter().any(|line| line.message.contains("locked up")), "{:?}", recording.log);
}

#[test]
fn the_same_run_gives_the_same_bytes_on_any_number_of_cores() {
    let folder = Folder::new();
    let set = "--set feedrate.profile.exponential.n_c=optimize";
    folder.servosim(&format!("run heart {set} --output a")).assert().success();
    folder.servosim(&format!("run heart {set} --output b")).assert().success();
    let mut folders = vec!["b"];
    // One core, where the system can say so.
    let pinned = Process::new("taskset")
        .args(["-c", "0", env!("CARGO_BIN_EXE_servosim"), "run", "heart", "--output", "c"])
        .args(set.split(' '))
        .current_dir(folder.0.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if pinned.is_ok_and(|status| status.success()) {
        folders.push("c");
    }
    let names = entries(&folder.path("a"));
    assert_eq!(names.len(), 7);
    for other in folders {
        for name in &names {
            let (one, two) = (fs::read(folder.path("a").join(name)), fs::read(folder.path(other).join(name)));
            assert!(one.unwrap() == two.unwrap(), "{name} differs in {other}");
        }
    }
}

#[test]
fn regression_the_recordings_of_the_built_in_scenarios() {
    // The very bytes, in every profile and on every machine: no operation depends on the compiler, the C library or the
    // number of cores. A change of the first hash is a change of the samples, to the last bit of a value; one of the second of the
    // recording around them (its schemas, metadata and the attached scenario). Say either in the changelog.
    let folder = Folder::new();
    let mut hashes = Vec::new();
    for name in ["alpha", "heart", "star"] {
        folder.servosim(&format!("run {name} --plots none")).assert().success();
        let csv = folder
            .servosim(&format!("inspect output/{name}.mcap --csv"))
            .assert()
            .success()
            .get_output()
            .stdout
            .clone();
        let lines = csv.iter().position(|byte| *byte == b'\n').unwrap();
        let (mut samples, mut file) = (Fnv::default(), Fnv::default());
        samples.add(&csv[lines..]);
        file.add(&fs::read(folder.path(&format!("output/{name}.mcap"))).unwrap());
        hashes.push(format!("{name} samples {:016x} file {:016x}", samples.0, file.0));
    }
    insta::assert_snapshot!(hashes.join("\n"));
}

/// FNV-1a, 64 bits.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

#[test]
fn a_second_run_replaces_the_first_and_says_so() {
    let folder = Folder::new();
    folder.servosim("run alpha --plots none").assert().success().stderr(contains("replaced").not());
    folder.servosim("run alpha --plots none --set axes.x.pdff.kpp=90").assert().stderr(contains("replaced"));
    assert_eq!(entries(&folder.path("output")), ["alpha.layout.json", "alpha.mcap"]);
}

#[test]
fn a_run_has_a_name_and_takes_away_plots_of_another() {
    let folder = Folder::new();
    folder
        .servosim("run alpha --name before")
        .assert()
        .success()
        .stderr(contains("wrote output/before.mcap, output/before.layout.json, output/before-path.svg"));
    // The scenario keeps its own name, the recording and what is drawn from it have the other.
    let recording = Recording::open(folder.path("output/before.mcap")).unwrap();
    assert_eq!((recording.run["name"].as_str(), recording.summary().unwrap().scenario.as_str()), ("before", "alpha"));
    folder.write("output/before-notes.svg", "mine");
    folder.write("output/before-path.png", "of an earlier version");
    // Other plots: none of the earlier run stay, and nothing else goes.
    folder
        .servosim("run alpha --name before --plots none --set axes.x.pdff.kpp=90")
        .assert()
        .stderr(contains("; 5 plots of an earlier run removed"));
    assert_eq!(entries(&folder.path("output")), ["before-notes.svg", "before.layout.json", "before.mcap"]);
    folder
        .servosim("run alpha --plots none --output other --name a/b")
        .assert()
        .code(2)
        .stderr(contains("`a/b` is no name for the files of a run"));
}

#[test]
fn recordings_can_be_smaller() {
    let folder = Folder::new();
    folder.servosim("run alpha-real --plots none --name plain").assert().success();
    folder.servosim("run alpha-real --plots none --name packed --compress lz4").assert().success();
    folder.servosim("run alpha-real --name thin --compress lz4 --every 10").assert().success();
    let [plain, packed, thin] = ["plain", "packed", "thin"]
        .map(|name| fs::metadata(folder.path(&format!("output/{name}.mcap"))).unwrap().len());
    assert!(packed * 10 < plain * 9 && thin * 2 < packed, "{plain} {packed} {thin}");
    let csv = |name: &str| {
        let csv = folder.servosim(&format!("inspect output/{name}.mcap --csv")).assert().success();
        String::from_utf8(csv.get_output().stdout.clone()).unwrap()
    };
    assert_eq!(csv("plain"), csv("packed"));
    assert_eq!(csv("thin").lines().count(), 1 + 121);
    let summary = |name: &str| {
        let summary = Recording::open(folder.path(&format!("output/{name}.mcap"))).unwrap().summary().unwrap();
        Summary { recording: None, ..summary }
    };
    assert_eq!(summary("plain"), summary("thin"));
    assert!(folder.path("output/thin-contour.svg").is_file());
    folder.servosim("run alpha --every 0").assert().code(2).stderr(contains("--every"));
}

#[test]
fn what_is_in_the_way_is_left_alone() {
    let folder = Folder::new();
    folder.write("output/alpha.mcap", "my notes");
    folder
        .servosim("run alpha")
        .assert()
        .code(2)
        .stdout("")
        .stderr(contains("output/alpha.mcap exists and is not a recording"));
    assert_eq!(fs::read_to_string(folder.path("output/alpha.mcap")).unwrap(), "my notes");
    assert_eq!(entries(&folder.path("output")), ["alpha.mcap"]);
    fs::create_dir_all(folder.path("output/heart.mcap")).unwrap();
    folder.servosim("run heart").assert().code(2).stderr(contains("is a folder"));
}

#[cfg(unix)]
#[test]
fn a_full_disk_names_the_file_and_leaves_nothing_half_written() {
    let folder = Folder::new();
    folder.servosim("run alpha --plots none --output before").assert().success();
    let whole = fs::read(folder.path("before/alpha.mcap")).unwrap();
    fs::create_dir(folder.path("output")).unwrap();
    fs::write(folder.path("output/alpha.mcap"), &whole).unwrap();
    // A limit on the size of a file stands in for a full disk: the write fails the same way.
    for (blocks, plots) in [(64, "none"), (300, "none"), (446, "svg"), (446, "png")] {
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" run alpha --plots {plots} --set name=full");
        let output = Process::new("bash")
            .args(["-c", &script, env!("CARGO_BIN_EXE_servosim")])
            .current_dir(folder.0.path())
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        if blocks < 440 {
            assert_eq!(output.status.code(), Some(1), "{blocks}: {stderr}");
            assert!(stderr.contains("cannot write the recording output/full.mcap"), "{stderr}");
            assert_eq!(entries(&folder.path("output")), ["alpha.mcap"], "nothing half-written is left");
        }
        for name in entries(&folder.path("output")) {
            if Path::new(&name).extension().is_some_and(|ending| ending == "mcap") {
                assert!(Recording::open(folder.path("output").join(&name)).unwrap().complete, "{name}");
            }
            assert!(!name.contains("partial") && !name.contains("tmp"), "{name}");
        }
    }
    assert!(fs::read(folder.path("output/alpha.mcap")).unwrap() == whole, "the earlier recording is as it was");
}

#[cfg(unix)]
#[test]
fn a_folder_without_permission_is_told() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    fs::create_dir(folder.path("output")).unwrap();
    fs::set_permissions(folder.path("output"), fs::Permissions::from_mode(0o555)).unwrap();
    // Root may write everywhere: there the run succeeds, which is no answer.
    if fs::write(folder.path("output/probe"), "").is_ok() {
        return;
    }
    folder
        .servosim("run alpha")
        .assert()
        .code(1)
        .stderr(contains("cannot create the recording output/alpha.mcap").and(contains("Permission denied")));
}

#[cfg(unix)]
#[test]
fn an_interrupted_or_killed_run_leaves_what_it_recorded() {
    for (signal, code) in [("INT", Some(1)), ("KILL", None)] {
        let folder = Folder::new();
        folder.servosim("run alpha --plots none").assert().success();
        let whole = fs::read(folder.path("output/alpha.mcap")).unwrap();
        let mut process = folder.process("run alpha --set control.settling_s=90000");
        let child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let partial = folder.path("output/alpha.mcap.partial");
        let started = std::time::Instant::now();
        while fs::metadata(&partial).map_or(0, |data| data.len()) < 2_000_000 {
            assert!(started.elapsed().as_secs() < 60, "the recording does not grow");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(Process::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), code, "{}", String::from_utf8_lossy(&output.stderr));
        assert!(fs::read(folder.path("output/alpha.mcap")).unwrap() == whole, "the earlier recording is as it was");
        let recording = Recording::open(&partial).unwrap();
        assert!(recording.samples > 1000, "{}", recording.samples);
        let inspect = folder.servosim("inspect output/alpha.mcap.partial").assert().success();
        if signal == "INT" {
            assert!(recording.complete && !recording.summary().unwrap().complete);
            assert!(String::from_utf8_lossy(&output.stderr).contains("output/alpha.mcap.partial"));
            inspect.stdout(contains("interrupted"));
        } else {
            assert!(!recording.complete && recording.summary().is_none());
            inspect.stdout(contains("cut short")).stderr(contains("was cut short"));
        }
        // The next run is not in the way of what is left.
        folder.servosim("run alpha --plots none").assert().success();
        assert_eq!(entries(&folder.path("output")), ["alpha.layout.json", "alpha.mcap"]);
    }
}

#[test]
fn plot_lays_runs_over_each_other() {
    let folder = Folder::new();
    folder.servosim("run alpha --plots none").assert().success();
    folder.servosim("run alpha --plots none --output other --set axes.x.pdff.kpp=90").assert().code(3);
    folder.servosim("plot output/alpha.mcap other/alpha.mcap --output plots").assert().success().stdout("");
    let names = entries(&folder.path("plots"));
    assert_eq!(names.len(), 4, "{names:?}");
    assert!(names.contains(&"alpha-vs-alpha-contour.svg".to_owned()), "{names:?}");
    let contour = fs::read_to_string(folder.path("plots/alpha-vs-alpha-contour.svg")).unwrap();
    assert!(contour.contains("contouring error [µm]") && contour.contains("limit"), "axes carry units");
    // A name is enough for a recording in the output folder.
    folder.servosim("plot alpha --format png --name again").assert().success();
    assert!(folder.path("output/again-path.png").is_file());
    // The plots that `run` draws are those of `plot`.
    folder.servosim("run alpha --output run").assert().success();
    folder.servosim("plot run/alpha.mcap --output plot").assert().success();
    for name in entries(&folder.path("plot")) {
        let (one, two) = (fs::read(folder.path("run").join(&name)), fs::read(folder.path("plot").join(&name)));
        assert!(one.unwrap() == two.unwrap(), "{name}");
    }
}

#[test]
fn what_cannot_be_plotted_or_inspected_is_told() {
    let folder = Folder::new();
    folder.write("empty.mcap", "");
    folder.write("notes.mcap", "these are notes");
    for command in ["plot", "inspect"] {
        folder.servosim(&format!("{command} missing.mcap")).assert().code(2).stderr(contains("missing.mcap"));
        folder.servosim(&format!("{command} .")).assert().code(2).stderr(contains("is a folder"));
        folder.servosim(&format!("{command} empty.mcap")).assert().code(1).stderr(contains("empty.mcap is empty"));
        folder.servosim(&format!("{command} notes.mcap")).assert().code(1).stderr(contains("not a recording"));
        folder.servosim(command).assert().code(2);
    }
    folder.servosim("run alpha --plots none").assert().success();
    folder.servosim("plot alpha --name ../up").assert().failure().stderr(contains("../up"));
}

#[test]
fn inspect_exports_every_sample_and_minds_no_closed_pipe() {
    let folder = Folder::new();
    folder.servosim("run alpha --plots none").assert().success();
    let output = folder.servosim("inspect output/alpha.mcap --csv").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1202);
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    for name in ["time_s", "path_feed_mm_s", "x_actual_mm", "y_voltage_v", "contour_error_um"] {
        assert!(header.contains(&name), "{name} {header:?}");
    }
    assert!(output.stderr.is_empty());
    let mut child = folder
        .process("inspect output/alpha.mcap --csv")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    folder.servosim("inspect alpha --format json").assert().success().stdout(contains("\"complete\": true"));
}

#[test]
fn plots_that_cannot_be_written_cost_neither_figures_nor_recording() {
    let folder = Folder::new();
    folder.write("output/alpha-voltage.svg/in", "the way");
    folder.servosim("run alpha").assert().code(1).stdout(contains("max contouring error   27.027 µm")).stderr(
        contains("wrote output/alpha.mcap and output/alpha.layout.json\n")
            .and(contains("cannot write output/alpha-voltage.svg")),
    );
}

#[test]
fn runs_of_one_name_are_told_apart_by_their_folders() {
    let folder = Folder::new();
    folder.servosim("run alpha --plots none --output before").assert().success();
    folder.servosim("run alpha --plots none --output after --set axes.x.pdff.kpp=99").assert().success();
    folder.servosim("run heart --plots none").assert().success();
    folder.servosim("plot before/alpha.mcap after/alpha.mcap heart --name all").assert().success();
    let svg = fs::read_to_string(folder.path("output/all-contour.svg")).unwrap();
    assert!(svg.contains("before/alpha") && svg.contains("after/alpha") && svg.contains("heart"));
    assert!(!svg.contains("alpha (2)") && !svg.contains("output/heart"));
}

#[test]
fn what_a_user_can_do_about_it_is_told_in_the_terms_of_the_command_line() {
    let folder = Folder::new();
    for command in ["plot", "inspect"] {
        let nothing = folder.servosim(&format!("{command} nothing")).assert().code(2);
        nothing.stderr(contains("cannot open nothing").and(contains("help: looked for a file of that name")));
    }
    folder.write("output/alpha.mcap", "no recording");
    folder.servosim("run alpha").assert().code(2).stderr(contains("help: --output DIR writes to another folder"));
    folder.servosim("run heart").assert().success();
    folder.servosim("plot heart --name a/b").assert().code(2).stderr(contains("plain name"));
    folder.servosim("inspect heart").assert().stdout(contains("contour_error_um = 30: kept (12.506)"));
}

#[cfg(unix)]
#[test]
fn a_recording_of_gigabytes_is_told_of_before_it_is_written() {
    let folder = Folder::new();
    let scenario = "run alpha --set control.settling_s=9000";
    for (quiet, told) in [("", true), (" --quiet", false)] {
        let mut process = folder.process(&format!("{scenario} --output out{quiet}"));
        let mut child = process.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let recording = folder.path("out/alpha.mcap.partial");
        while !recording.exists() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        child.kill().unwrap();
        let mut text = String::new();
        child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        child.wait().unwrap();
        assert_eq!(text.contains("9001101 samples make a recording of about 2.8 GB in out"), told, "{text}");
        fs::remove_dir_all(folder.path("out")).unwrap();
    }
}
