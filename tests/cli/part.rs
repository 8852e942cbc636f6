//! Parts: the files as they are written, and `servosim toolpath` and `servosim run PROGRAM` as a user types them.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use servosim::scenario::{Document, builtin_part_names};
use tempfile::TempDir;

/// A small inclined plane, a round region: quick to plan and to cut.
const SMALL: &str = r#"
[surface.nurbs]
degree = [1, 1]
control_points_mm = [[[0, 0, 0], [0, 30, 3]], [[30, 0, 2], [30, 30, 5]]]

[boundary.circle]
centre_mm = [15, 15]
radius_mm = 7

[cutter.ball]
radius_mm = 3

[toolpath]
scallop_mm = 0.3
tolerance_mm = 0.05
fit = "density"

[feed]
cut_mm_min = 3000

[machine]
rapid_mm_s = 200
accel_mm_s2 = 2000
jerk_mm_s3 = 50000

[check]
cell_mm = 0.2

[limits]
nominal_scallop_um = 300
nominal_gouge_um = 50
contour_error_um = 50
"#;

/// The small part with the axes of the built-in one.
fn small() -> String {
    let patch = Document::builtin("patch").unwrap();
    let axes = &patch.text()[patch.text().find("[axes.x.plant").unwrap()..patch.text().find("[check]").unwrap()];
    format!("{SMALL}\n{axes}")
}

fn folder_with(text: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.toml"), text).unwrap();
    folder
}

fn servosim(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("servosim").unwrap();
    command.current_dir(folder).env("NO_COLOR", "1");
    command
}

fn stdout(command: &mut Command) -> (i32, String, String) {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

fn json(command: &mut Command) -> Value {
    let (code, out, err) = stdout(command);
    assert_eq!(code, 0, "{out}\n{err}");
    serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}"))
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {value:#}"))
}

#[test]
fn a_part_becomes_a_program_and_the_program_a_part() {
    let folder = folder_with(&small());
    let planned = json(servosim(folder.path()).args(["toolpath", "small.toml", "--format", "json"]));
    assert!(number(&planned, "/nominal/largest_scallop_um") <= 300.0);
    assert!(number(&planned, "/nominal/largest_scallop_um") > 100.0, "{planned:#}");
    assert!(number(&planned, "/nominal/deepest_gouge_um") <= 50.0);
    assert_eq!(number(&planned, "/nominal/uncut_cells"), 0.0);
    assert!(number(&planned, "/curves") >= 2.0 && number(&planned, "/lines") > number(&planned, "/control_points"));
    assert!(number(&planned, "/motion_time_s") > number(&planned, "/estimated_time_s"));
    for file in ["small.nc", "small.part.toml", "small-rings.svg", "small-path3d.svg", "small-deviation.svg"] {
        assert!(folder.path().join("output").join(file).is_file(), "{file}");
    }

    let run = json(servosim(folder.path()).args(["run", "output/small.nc", "--format", "json"]));
    // The same program, the same check.
    for key in ["largest_scallop_um", "deepest_gouge_um", "rms_um", "cells"] {
        assert_eq!(
            number(&run, &format!("/part/nominal/{key}")),
            number(&planned, &format!("/nominal/{key}")),
            "{key}"
        );
    }
    // The cutter is never further from its path than the contouring error, so no cell differs by more, but for what the chords of
    // the swept path are off and for the tool's way into the material.
    let (difference, error) = (number(&run, "/part/largest_difference_um"), number(&run, "/max_contour_error_um"));
    assert!(difference > 0.1 && difference <= error + 1.0, "{difference} {error}");
    assert_eq!(run.pointer("/axes/2/axis").and_then(Value::as_str), Some("z"));
    for file in ["small.mcap", "small-path.svg", "small-contour.svg", "small-voltage.svg", "small-deviation.svg"] {
        assert!(folder.path().join("output").join(file).is_file(), "{file}");
    }
    let table = stdout(servosim(folder.path()).args(["run", "output/small.nc", "--plots", "none"])).1;
    assert!(table.contains("nominal") && table.contains("as cut") && table.contains("largest difference"), "{table}");
}

#[test]
fn every_dialect_cuts_the_same_part() {
    let folder = folder_with(&small());
    let mut gouges = Vec::new();
    for (dialect, blocks) in [("siemens", "nurbs"), ("fanuc", "nurbs"), ("linuxcnc", "straight")] {
        let set = [format!("program.dialect={dialect}"), format!("program.blocks={blocks}")];
        let planned = json(servosim(folder.path()).args([
            "toolpath", "small", "--set", &set[0], "--set", &set[1], "--plots", "none", "--format", "json", "--output",
            dialect,
        ]));
        gouges.push(number(&planned, "/nominal/rms_um"));
        assert_eq!(number(&planned, "/curves") > 0.0, blocks == "nurbs");
        let run = json(servosim(folder.path()).args([
            "run",
            &format!("{dialect}/small.nc"),
            "--plots",
            "none",
            "--format",
            "json",
            "--output",
            dialect,
        ]));
        assert_eq!(number(&run, "/part/nominal/rms_um"), number(&planned, "/nominal/rms_um"));
    }
    assert!((gouges[0] - gouges[1]).abs() < 1.0, "{gouges:?}");
}

#[test]
fn a_limit_that_is_broken_is_told_of_and_exits_with_3() {
    let folder = folder_with(&small());
    let set = ["--set", "limits.nominal_scallop_um=1", "--plots", "none"];
    let (code, out, _) = stdout(servosim(folder.path()).args(["toolpath", "small.toml"]).args(set));
    assert_eq!(code, 3);
    assert!(out.contains("nominal_scallop_um") && out.contains("BROKEN"), "{out}");
    assert!(folder.path().join("output/small.nc").is_file());
    let (code, out, err) = stdout(servosim(folder.path()).args(["toolpath", "small.toml", "--quiet"]).args(set));
    assert_eq!((code, out.as_str()), (3, ""));
    assert!(err.contains("nominal_scallop_um broken"), "{err}");
}

#[test]
fn plain_g_code_runs_on_the_built_in_machine() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("mine.ngc"),
        "G21 G90\nG0 X0 Y0 Z5\nG1 Z0 F600\nX20 F3000\nG3 X20 Y20 I0 J10\nG1 X0\nG0 Z5\nM30\n",
    )
    .unwrap();
    let (code, out, err) = stdout(servosim(folder.path()).args(["run", "mine.ngc", "--plots", "none"]));
    assert_eq!(code, 0, "{out}\n{err}");
    assert!(out.contains("max contouring error") && err.contains("no part file"), "{out}\n{err}");
}

#[test]
fn wrong_programs_are_told_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("G0 X0 Y0 Z0\nG1 X1 F100\nG1 Q5\n", "wrong.nc:3"),
        ("G0 X0 Y0 Z0\nG1 X1e9 F100\n", "wrong.nc:2"),
        ("G0 X0 Y0 Z0\nG1 X10\n", "wrong.nc:2"),
    ];
    for (text, place) in cases {
        fs::write(folder.path().join("wrong.nc"), text).unwrap();
        let (code, _, err) = stdout(servosim(folder.path()).args(["run", "wrong.nc"]));
        assert_eq!(code, 2, "{text}: {err}");
        assert!(err.contains(place), "{text}: {err}");
    }
    let (code, _, err) = stdout(servosim(folder.path()).args(["run", "absent.nc"]));
    assert_eq!(code, 2);
    assert!(err.contains("absent.nc"), "{err}");
}

/// What is wrong with the small part after a replacement.
fn problem(from: &str, to: &str) -> String {
    let text = small();
    assert!(text.contains(from), "{from}");
    let error = Document::from_text(text.replacen(from, to, 1), "small.toml").part().expect_err(to);
    error.to_string()
}

#[test]
fn bad_parts_are_told_with_their_place() {
    let circle = "[boundary.circle]\ncentre_mm = [15, 15]\nradius_mm = 7";
    let open = "[boundary.contour]\nstart_mm = [5, 5]\npieces = [{ line = { end_mm = [20, 5] } }, { line = { end_mm = [20, 20] } }]";
    let crossing = "[boundary.polygon]\npoints_mm = [[5, 5], [20, 20], [20, 5], [5, 20]]";
    let cases = [
        (circle, open, "open"),
        (circle, crossing, "crosses"),
        (circle, "[boundary.polygon]\npoints_mm = [[5, 5], [20, 20]]", "three"),
        ("radius_mm = 7", "radius_mm = -7", "positive"),
        ("radius_mm = 3", "radius_mm = 0", "cutter radius"),
        ("scallop_mm = 0.3", "scallop_mm = 3", "scallop height"),
        ("tolerance_mm = 0.05", "tolerance_mm = nan", "tolerance_mm"),
        ("fit = \"density\"", "fit = \"dense\"", "density"),
        ("degree = [1, 1]", "degree = [1, 1]\nknots_u = [0, 1, 0, 1]", "decrease"),
        ("degree = [1, 1]", "degree = [3, 3]", "too few"),
        ("[[0, 0, 0], [0, 30, 3]]", "[[0, 0, 0]]", "control points"),
        ("[[0, 0, 0], [0, 30, 3]]", "[[0, 0], [0, 30, 3]]", "[x, y, z]"),
        ("cut_mm_min = 3000", "cut_mm_min = 0", "cut_mm_min"),
        ("rapid_mm_s = 200", "rapid_mm_s = inf", "rapid_mm_s"),
        ("[cutter.ball]\nradius_mm = 3", "[cutter.bull_nose]\nradius_mm = 3\ncorner_radius_mm = 4", "corner radius"),
        ("[cutter.ball]", "[cutter.sphere]", "ball"),
        ("[surface.nurbs]", "[surface.mesh]\nfile = \"absent.stl\"\n[surface.nurbs]", "more than one"),
        ("[limits]", "[limits]\nnominal_scallop = 3", "nominal_scallop_um"),
    ];
    for (from, to, said) in cases {
        let message = problem(from, to);
        assert!(message.contains(said), "{to}: {message}");
        // The place, underlined.
        assert!(message.contains("small.toml:") && message.contains('^'), "{to}: {message}");
    }
}

#[test]
fn a_cutter_too_large_and_a_surface_that_folds_are_told_where() {
    let hollow = "degree = [2, 2]\ncontrol_points_mm = [[[0, 0, 9], [0, 15, 9], [0, 30, 9]], [[15, 0, -14], [15, 15, -14], [15, 30, -14]], [[30, 0, 9], [30, 15, 9], [30, 30, 9]]]";
    let plane = "degree = [1, 1]\ncontrol_points_mm = [[[0, 0, 0], [0, 30, 3]], [[30, 0, 2], [30, 30, 5]]]";
    let text = small().replacen(plane, hollow, 1).replacen("radius_mm = 3", "radius_mm = 12", 1).replacen(
        "scallop_mm = 0.3",
        "scallop_mm = 0.1",
        1,
    );
    let message = Document::from_text(text.clone(), "small.toml").part().unwrap_err().to_string();
    assert!(message.contains("does not fit at x") && message.contains("hollow"), "{message}");
    let leave = text.replacen("[toolpath]", "[toolpath]\nunreachable = \"leave\"", 1);
    Document::from_text(leave, "small.toml").part().unwrap();
    let fold = "degree = [2, 1]\ncontrol_points_mm = [[[0, 0, 0], [0, 30, 0]], [[40, 0, 10], [40, 30, 10]], [[10, 0, 20], [10, 30, 20]]]";
    let message = problem(plane, fold);
    assert!(message.contains("folds over itself at x"), "{message}");
}

#[test]
fn a_flat_end_on_a_slope_keeps_the_scallop_or_says_where_it_cannot() {
    // A slope of 0.12: a flat end leaves 0.12 r under its axis however near the passes are.
    let folder = folder_with(&small());
    let with = |radius_mm: f64| {
        let mut command = servosim(folder.path());
        let set = format!("cutter.flat.radius_mm={radius_mm}");
        command.args(["toolpath", "small.toml", "--plots", "none", "--format", "json", "--set", &set]);
        command
    };
    for radius_mm in [1.0, 2.0] {
        let summary = json(&mut with(radius_mm));
        assert!(number(&summary, "/nominal/largest_scallop_um") <= 300.0, "{summary:#}");
    }
    let (code, _, err) = stdout(&mut with(4.0));
    assert!(code == 2 && err.contains("a ridge of") && err.contains("stays however near"), "{code}: {err}");
}

#[test]
fn damaged_meshes_are_told_of() {
    let mesh = small().replacen(
        "[surface.nurbs]\ndegree = [1, 1]\ncontrol_points_mm = [[[0, 0, 0], [0, 30, 3]], [[30, 0, 2], [30, 30, 5]]]",
        "[surface.mesh]\nfile = \"it.stl\"",
        1,
    );
    let folder = folder_with(&mesh);
    let file = folder.path().join("it.stl");
    let whole = fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/dome.stl")).unwrap();
    let cases: [(&[u8], &str); 4] = [
        (b"", "empty"),
        (b"solid x\nfacet normal 0 0\n", "line 2"),
        (&whole[..1000], "cut short"),
        (b"hello", "no STL"),
    ];
    for (bytes, said) in cases {
        fs::write(&file, bytes).unwrap();
        let (code, _, err) = stdout(servosim(folder.path()).args(["toolpath", "small.toml"]));
        assert_eq!(code, 2, "{err}");
        assert!(err.contains(said) && err.contains("small.toml:"), "{said}: {err}");
    }
    fs::remove_file(&file).unwrap();
    let (code, _, err) = stdout(servosim(folder.path()).args(["toolpath", "small.toml"]));
    assert_eq!(code, 2);
    assert!(err.contains("it.stl"), "{err}");
}

#[test]
fn parts_and_scenarios_are_told_apart() {
    let folder = folder_with(&small());
    let (code, _, err) = stdout(servosim(folder.path()).args(["run", "small.toml"]));
    assert_eq!(code, 2);
    assert!(err.contains("servosim toolpath"), "{err}");
    let (code, _, err) = stdout(servosim(folder.path()).args(["toolpath", "alpha"]));
    assert_eq!(code, 2);
    assert!(err.contains("[surface."), "{err}");
    let (code, _, err) = stdout(servosim(folder.path()).args(["run", "alpha", "--part", "small.toml"]));
    assert_eq!(code, 2);
    assert!(err.contains("--part"), "{err}");
}

#[test]
fn built_in_parts_are_sound_and_the_schema_knows_their_keys() {
    for name in builtin_part_names() {
        let document = Document::builtin(name).unwrap();
        assert!(document.is_part());
        assert_eq!(document.part().unwrap().name, name);
    }
    let (code, out, _) = stdout(servosim(Path::new(".")).args(["schema", "--part"]));
    assert_eq!(code, 0);
    let schema: Value = serde_json::from_str(&out).unwrap();
    assert!(schema.pointer("/properties/surface").is_some());
}

#[test]
fn the_step_over_formulas_stand_beside_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = stdout(servosim(folder.path()).arg("stepover"));
    assert_eq!((code, err.as_str()), (0, "wrote output/ball-5mm-stepover.svg\n"), "{out}");
    // The specification's table.
    for (row, error) in [
        ("convex 10 0.01", "0.1084 %"),
        ("convex 10 0.1", "1.088 %"),
        ("convex 4 0.01", "0.2097 %"),
        ("convex 4 0.1", "2.095 %"),
        ("concave -9 0.01", "0.0292 %"),
        ("concave -11 0.1", "0.2357 %"),
    ] {
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let line = out.lines().map(words).find(|line| line.starts_with(&format!("{row} "))).unwrap_or_default();
        assert!(line.contains(error), "{row}: {line}");
    }
    assert!(folder.path().join("output/ball-5mm-stepover.svg").is_file());

    let asked = "stepover --radius 3 --scallop 0.02 --curvature -12,inf --range 3.5:200 --plots none --format json";
    let values = json(servosim(folder.path()).args(asked.split(' ')));
    assert_eq!(values["rows"].as_array().unwrap().len(), 2);
    assert!(number(&values, "/rows/0/exact_mm") > number(&values, "/rows/0/flat_mm"), "{values:#}");
    assert_eq!(values["rows"][1]["curvature_radius_mm"], Value::Null);
    assert_eq!(number(&values, "/rows/1/exact_mm"), number(&values, "/rows/1/flat_mm"));

    for (asked, said) in [
        ("--curvature -4", "a cutter of radius 5 mm does not fit into a hollow of radius 4 mm"),
        ("--scallop 6", "a scallop height of 6 mm is not possible"),
        ("--radius -1", "a cutter radius of -1 mm is not a positive finite number"),
        ("--radius nan", "not a positive finite number"),
        ("--curvature 0", "a curvature radius of 0 mm is not possible"),
        ("--curvature ten", "invalid float"),
        ("--range 5", "write it as LOW:HIGH"),
        ("--range 5:2", "write it as LOW:HIGH"),
        ("--scallop .1,.2,.3,.4,.5,.6,.7", "7 scallop heights are too many for one plot: at most 6"),
    ] {
        let (code, out, err) = stdout(servosim(folder.path()).arg("stepover").args(asked.split(' ')));
        assert!(code == 2 && out.is_empty() && err.contains(said), "{asked}: {code} {err}");
    }
}

#[test]
fn a_part_is_started_and_checked_like_a_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = stdout(servosim(folder.path()).args(["new", "lid", "--part"]));
    assert_eq!(
        (code, out.as_str()),
        (0, "wrote lid.toml and servosim.part.schema.json, which editors read; next: servosim toolpath lid.toml\n"),
        "{err}"
    );
    let text = fs::read_to_string(folder.path().join("lid.toml")).unwrap();
    assert!(text.contains("servosim run output/lid.nc") && !text.contains("patch"), "{text}");
    let mut command = servosim(folder.path());
    let (code, out, err) = stdout(command.args(["check", "lid", "island", "alpha"]));
    assert_eq!(code, 0, "{err}");
    assert!(out.starts_with("lid: ok (part; ball cutter, radius 5 mm, scallop 0.25 mm, tolerance 0.25 mm)\n"), "{out}");
    assert_eq!(out.lines().count(), 3);

    fs::write(folder.path().join("bad.toml"), text.replace("degree = [3, 3]", "degree = [3, 9]")).unwrap();
    let (code, _, err) = stdout(servosim(folder.path()).args(["check", "bad.toml"]));
    assert!(code == 2 && err.contains("control points are too few for degree 9"), "{err}");
    for key in ["scallop_mm", "tolerance_mm"] {
        let fine = text.replace(&format!("{key} = 0.25"), &format!("{key} = 1e-9"));
        fs::write(folder.path().join("bad.toml"), fine).unwrap();
        let (code, _, err) = stdout(servosim(folder.path()).args(["check", "bad.toml"]));
        assert!(
            code == 2
                && err.contains(&format!(
                    "{key} = 1e-9 is out of range: it must be a positive number, from 1e-5 to 1e6 mm"
                )),
            "{err}"
        );
    }
    let two = text.clone()
        + "\n[boundary.circle]\ncentre_mm = [40, 40]\nradius_mm = 30\n[boundary.polygon]\npoints_mm = [[0, 0], [1, 0], [1, 1]]\n";
    fs::write(folder.path().join("bad.toml"), two).unwrap();
    let (code, _, err) = stdout(servosim(folder.path()).args(["check", "bad.toml"]));
    let said = err.contains("[boundary] holds more than one of `") && err.contains("`circle`");
    assert!(code == 2 && said, "{err}");
}

#[test]
fn a_program_that_moves_nothing_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for text in ["", "%\n(nothing)\nG21 G90\nM30\n%\n", "G0 X0 Y0 Z0\n"] {
        fs::write(folder.path().join("still.nc"), text).unwrap();
        let (code, out, err) = stdout(servosim(folder.path()).args(["run", "still.nc"]));
        assert!(code == 2 && out.is_empty() && err.contains("still.nc: the program moves nothing"), "{text}: {err}");
        assert!(!folder.path().join("output").exists());
    }
}
