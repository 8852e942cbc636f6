//! NC programs as a user has them at hand: what they mean, what is wrong with them, and never a panic.

use std::io::{self, BufReader};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::nc::{
    Action, Arc, Block, Dialect, JOIN_TOLERANCE_MM, NcError, Nurbs, Program, Reader, Reading, SyntaxError,
};

fn read_as(text: &str, reading: Reading) -> Result<Vec<Block>, NcError> {
    Reader::new(text.as_bytes(), "part.nc", reading).collect()
}

/// The blocks of a program; begins with the tool at the origin and a feed.
fn blocks(text: &str) -> Vec<Block> {
    let reading = Reading { start_mm: Some([0.0; 3]), ..Reading::default() };
    read_as(&format!("F600\n{text}"), reading).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

/// The motions of a program.
fn motions(text: &str) -> Vec<Block> {
    blocks(text).into_iter().filter(|block| block.is_feed_motion() || block.action == Action::Rapid).collect()
}

fn end(text: &str) -> [f64; 3] {
    motions(text).last().unwrap().end_mm
}

fn error(text: &str) -> SyntaxError {
    let reading = Reading { start_mm: Some([0.0; 3]), ..Reading::default() };
    error_as(text, reading)
}

fn error_as(text: &str, reading: Reading) -> SyntaxError {
    match read_as(text, reading) {
        Err(NcError::Syntax(error)) => *error,
        other => panic!("{text}: {other:?}"),
    }
}

fn arc(text: &str) -> (Arc, Block) {
    let block = motions(text).pop().unwrap();
    match block.action {
        Action::Arc(arc) => (arc, block),
        _ => panic!("{text}: {block:?}"),
    }
}

fn curve(text: &str) -> Nurbs {
    motions(text)
        .into_iter()
        .find_map(|block| if let Action::Nurbs(curve) = block.action { Some(curve) } else { None })
        .unwrap_or_else(|| panic!("{text}"))
}

/// A whole program of everyday codes, read into what it says.
#[test]
fn an_everyday_program_is_read() {
    let program = "%\nO0001 (PART 7)\nN10 G90 G21 G17 G40 G49 G80\nN20 T1 M6 ; ball 10\nN30 G54 S12000 M03\n\
                   N40 G00 X0 Y0\nN50 G43 H1 Z50.\nN60 Z2.0\ng1 z-1. f300\n  X 10.5 y+.5\nG3X20.5Y10.5J10.F1200\nG04 P1.5\n\
                   G1 G91 X-.5\nG90 G0 Z50 M9\nM5\nM30\n%\n";
    let blocks = Program::read(program, "part.nc").unwrap().blocks;
    let told: Vec<String> = blocks
        .iter()
        .map(|b| {
            let [x, y, z] = b.end_mm;
            let what = match &b.action {
                Action::Rapid => "rapid".to_owned(),
                Action::Linear => "line".to_owned(),
                Action::Arc(arc) => format!("arc {:?}", arc.centre_mm),
                Action::Dwell { time_s } => format!("dwell {time_s}"),
                Action::Auxiliary(words) | Action::Comment(words) => words.clone(),
                Action::Nurbs(_) => "curve".to_owned(),
            };
            format!("{}: {what} ({x} {y} {z}) F{}", b.line, b.feed_mm_min.unwrap_or(0.0))
        })
        .collect();
    assert_eq!(
        told,
        [
            "2: PART 7 (0 0 0) F0",
            "2: O0001 (0 0 0) F0",
            "3: G40 G49 G80 (0 0 0) F0",
            "4: ball 10 (0 0 0) F0",
            "4: T1 M6 (0 0 0) F0",
            "5: G54 S12000 M03 (0 0 0) F0",
            "6: rapid (0 0 0) F0",
            "7: G43 H1 (0 0 0) F0",
            "7: rapid (0 0 50) F0",
            "8: rapid (0 0 2) F0",
            "9: line (0 0 -1) F300",
            "10: line (10.5 0.5 -1) F300",
            "11: arc [10.5, 10.5, -1.0] (20.5 10.5 -1) F1200",
            "12: dwell 1.5 (20.5 10.5 -1) F1200",
            "13: line (20 10.5 -1) F1200",
            "14: rapid (20 10.5 50) F1200",
            "14: M9 (20 10.5 50) F1200",
            "15: M5 (20 10.5 50) F1200",
            "16: M30 (20 10.5 50) F1200",
        ]
    );
    // Every block begins where the one before ends.
    for pair in blocks.windows(2) {
        assert_eq!(pair[0].end_mm, pair[1].start_mm);
    }
}

#[test]
fn numbers_come_in_every_decimal_form() {
    for (text, x) in [
        ("X.5", 0.5),
        ("X5.", 5.0),
        ("X+1", 1.0),
        ("X-1", -1.0),
        ("X-.25", -0.25),
        ("X+0.0", 0.0),
        ("X 007.50", 7.5),
        ("x\t= 2.5", 2.5),
        ("X=-2", -2.0),
    ] {
        assert_eq!(end(&format!("G1 {text}"))[0], x, "{text}");
    }
}

#[test]
fn inches_hold_for_lengths_and_feeds() {
    for units in ["G20", "G700", "G70\u{20}"] {
        let text = format!("{units}\nG1 X1 Y-.5 F10");
        if units.starts_with("G70 ") {
            assert!(error(&text).to_string().contains("G700"), "{}", error(&text));
            continue;
        }
        let block = motions(&text).pop().unwrap();
        assert_eq!((block.end_mm, block.feed_mm_min), ([25.4, -12.7, 0.0], Some(254.0)));
    }
    assert_eq!(end("G20 G1 X1\nG21 X1"), [1.0, 0.0, 0.0]);
}

/// Centre, radius and sweep of the same arc from both forms, in every plane and quadrant, against the circle it was made from.
#[test]
fn validates_arcs_of_centre_and_radius_against_their_circle() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(71);
    for _ in 0..5_000 {
        let (plane, [a, b, c]) = [("G17", [0, 1, 2]), ("G18", [2, 0, 1]), ("G19", [1, 2, 0])][rng.random_range(0..3)];
        let clockwise: bool = rng.random();
        let radius = rng.random_range(0.5..50.0_f64);
        let from = rng.random_range(-3.1..3.1_f64);
        // Near a half turn the centre of the radius form is badly placed, near none and all both are.
        let sweep = rng.random_range(0.2..6.0_f64);
        if (sweep - std::f64::consts::PI).abs() < 0.05 {
            continue;
        }
        let to = if clockwise { from - sweep } else { from + sweep };
        let mut centre = [0.0; 3];
        (centre[a], centre[b], centre[c]) = (rng.random_range(-9.0..9.0), rng.random_range(-9.0..9.0), 1.0);
        let at = |angle: f64, height: f64| {
            let mut point = centre;
            point[a] += radius * angle.cos();
            point[b] += radius * angle.sin();
            point[c] = height;
            point
        };
        let (start, end) = (at(from, 1.0), at(to, 3.0));
        let code = if clockwise { "G2" } else { "G3" };
        let go = |point: [f64; 3]| format!("X{:.9} Y{:.9} Z{:.9}", point[0], point[1], point[2]);
        let [x, y, z] = [centre[0] - start[0], centre[1] - start[1], centre[2] - start[2]];
        let offsets = [format!("I{x:.9} J{y:.9}"), format!("K{z:.9} I{x:.9}"), format!("J{y:.9} K{z:.9}")];
        let signed = if sweep > std::f64::consts::PI { -radius } else { radius };
        let plane_index = [0, 1, 2].into_iter().find(|&i| ["G17", "G18", "G19"][i] == plane).unwrap();
        for form in [offsets[plane_index].clone(), format!("R{signed:.9}"), format!("CR={signed:.9}")] {
            let text = format!("{plane} G0 {}\n{code} {} {form}", go(start), go(end));
            let (arc, block) = arc(&text);
            // Nine decimals; the radius form divides by the cosine of half the sweep from the half turn, at least 0.025.
            for i in [a, b] {
                assert!((arc.centre_mm[i] - centre[i]).abs() < 1e-6, "{text}: {arc:?} {centre:?}");
            }
            assert!((arc.radius_mm(block.start_mm) - radius).abs() < 1e-6, "{text}");
            assert!((arc.sweep_rad(block.start_mm, block.end_mm) - sweep).abs() < 1e-5, "{text}");
            assert_eq!(arc.clockwise, clockwise);
        }
    }
}

#[test]
fn an_arc_that_ends_where_it_starts_is_a_full_circle() {
    for text in ["G2 I5", "G2 X0 Y0 I5 J0", "G91 G2 X0 I5"] {
        let (arc, block) = arc(text);
        assert_eq!((arc.centre_mm, block.end_mm), ([5.0, 0.0, 0.0], [0.0; 3]));
        assert_eq!(arc.sweep_rad(block.start_mm, block.end_mm), std::f64::consts::TAU);
    }
    let (arc, block) = arc("G3 J-2 Z-1");
    assert_eq!((arc.centre_mm, block.end_mm), ([0.0, -2.0, 0.0], [0.0, 0.0, -1.0]));
}

/// The largest mismatch that is taken, and a little more.
#[test]
fn the_end_of_an_arc_lies_on_its_circle_within_the_tolerance() {
    let text = |off: f64| format!("F1 G2 X{:.6} Y0 I5", 10.0 + off);
    let (taken, refused) = (0.99 * JOIN_TOLERANCE_MM, 1.01 * JOIN_TOLERANCE_MM);
    assert!(matches!(motions(&text(taken))[0].action, Action::Arc(_)));
    let error = error(&text(refused));
    assert!(error.message().contains("does not lie on its circle"), "{error}");
}

#[test]
fn motion_codes_feeds_and_places_hold_on() {
    let blocks = motions("G1 X1\nY2 F100\nG2 X3 R1 (semi)\nX1 R-1.5\nG0\nX7\nZ1");
    let kinds: Vec<&str> = blocks
        .iter()
        .map(|b| match b.action {
            Action::Linear => "line",
            Action::Arc(_) => "arc",
            Action::Rapid => "rapid",
            _ => "?",
        })
        .collect();
    assert_eq!(kinds, ["line", "line", "arc", "arc", "rapid", "rapid"]);
    assert_eq!(blocks[5].end_mm, [7.0, 2.0, 1.0]);
    assert_eq!(blocks[0].feed_mm_min, Some(600.0));
    assert_eq!(blocks[3].feed_mm_min, Some(100.0));
}

/// The rule for `PL`: the knot interval that ends at the block's point.
#[test]
fn a_siemens_curve_has_the_knots_that_its_intervals_say() {
    let text = "BSPLINE SD=3\nX0 Y0 Z0 PL=0\nX1 PL=1\nX2 PW=2 PL=2.5\nX3 PL=0.5\nX4 PL=0\nX5 Y1 PL=0\nG1 X6";
    let curve = curve(text);
    assert_eq!(curve.degree, 3);
    assert_eq!(curve.knots, [0.0, 0.0, 0.0, 0.0, 1.0, 3.5, 4.0, 4.0, 4.0, 4.0]);
    assert_eq!(curve.weights, [1.0, 1.0, 2.0, 1.0, 1.0, 1.0]);
    assert_eq!(curve.control_points_mm[5], [5.0, 1.0, 0.0]);
    let [first, second] = motions(text).try_into().unwrap();
    assert_eq!((first.line, first.end_mm), (2, [5.0, 1.0, 0.0]));
    assert_eq!(second.start_mm, first.end_mm);

    // The paper's older form; the first control point left out (it is the tool's place); the block of `BSPLINE` with a point.
    let older = "BSPLINE X1 W1 PL1\nX2 W2 PL2.5\nX3 PL0.5\nX4\nX5 Y1\nM30";
    assert_eq!(self::curve(older), curve);
}

/// How the control spaces knots that are not given is not known: only on request are they uniform.
#[test]
fn a_siemens_curve_without_intervals_is_not_guessed() {
    let text = "F1 BSPLINE SD=2\nX1\nX2\nX3\n";
    let refused = error(text);
    assert!(refused.to_string().contains("PL"), "{refused}");
    assert!(refused.to_string().contains("begins on line 1"), "{refused}");
    let reading = Reading { start_mm: Some([0.0; 3]), uniform_knots: true, ..Reading::default() };
    let blocks = read_as(text, reading).unwrap();
    let Action::Nurbs(curve) = &blocks[0].action else { panic!() };
    assert_eq!(curve.knots, [0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]);
    assert_eq!(curve.control_points_mm.len(), 4);
}

#[test]
fn a_fanuc_curve_is_read() {
    let text = "G06.2 P3 K0. X0 Y0 Z0 R1.\nK0 X1 R2\nK0 (middle) X2 Y1\nK1.5\nK1.5\nK1.5\nG01 X9";
    let curve = curve(text);
    assert_eq!(curve.knots, [0.0, 0.0, 0.0, 1.5, 1.5, 1.5]);
    assert_eq!(curve.weights, [1.0, 2.0, 1.0]);
    assert_eq!(curve.control_points_mm, [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0]]);
    assert_eq!(end(text), [9.0, 1.0, 0.0]);
    // The comment does not wait for the curve.
    assert!(matches!(&blocks(text)[0].action, Action::Comment(text) if text == "middle"));
}

/// The example of LinuxCNC's manual (G-code reference, G5.2 G5.3), its knots those of the interpreter's
/// `nurbs_G5_knot_vector_creator`.
#[test]
fn a_linuxcnc_curve_is_read() {
    let curve = curve("G5.2 P1 L3\n   X0 Y1 P1\n   X2 Y2 P1\n   X2 Y0 P1\n   X0 Y0 P2\nG5.3\n");
    assert_eq!(curve.degree, 2);
    assert_eq!(curve.knots, [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 3.0, 3.0]);
    assert_eq!(curve.weights, [1.0, 1.0, 1.0, 1.0, 2.0]);
    assert_eq!(curve.control_points_mm[2], [2.0, 2.0, 0.0]);
    assert_eq!(self::curve("G5.2 X0 Y1 P1 L3\n X2 Y2 P1\n X2 Y0 P1\n X0 Y0 P2\nG5.3\n"), curve);
}

#[test]
fn the_time_of_a_dwell_is_never_guessed() {
    let dwell = |text: &str, dialect| {
        let blocks = read_as(text, Reading { dialect, ..Reading::default() })?;
        match blocks[0].action {
            Action::Dwell { time_s } => Ok::<f64, NcError>(time_s),
            _ => panic!("{text}"),
        }
    };
    for text in ["G4 P1.5", "G04 X1.5", "G4 F1.5"] {
        assert_eq!(dwell(text, None).unwrap(), 1.5, "{text}");
    }
    assert_eq!(dwell("G4 P1500", Some(Dialect::Fanuc)).unwrap(), 1.5);
    assert_eq!(dwell("G4 P2", Some(Dialect::LinuxCnc)).unwrap(), 2.0);
    assert!(dwell("G4 P2", None).unwrap_err().to_string().contains("unit of the dwell"));
    assert!(dwell("G4 P2", Some(Dialect::Siemens)).is_err());
}

#[test]
fn deleted_blocks_are_run_or_left_out_as_asked() {
    let text = "G0 X1 Y1 Z1\n/ G0 X5\n/N5 G0 Y7";
    assert_eq!(motions(text).len(), 3);
    let skipped = read_as(text, Reading { skip_deleted: true, ..Reading::default() }).unwrap();
    assert_eq!(skipped.len(), 1);
}

/// Latin-1 comments, line ends of other systems, a byte order mark, a last line without an end.
#[test]
fn texts_of_other_systems_are_read() {
    let bytes = b"\xef\xbb\xbfG0 X1 (Fr\xe4ser)\r\n;\xb5m\r\nY2";
    let reader = |bytes: &'static [u8]| Reader::new(bytes, "a", Reading::default()).collect::<Result<Vec<_>, _>>();
    let without_mark = reader(&bytes[3..]).unwrap();
    assert!(matches!(&without_mark[0].action, Action::Comment(text) if text == "Fräser"));
    assert!(matches!(&without_mark[2].action, Action::Comment(text) if text == "µm"));
    assert_eq!(without_mark.last().unwrap().end_mm, [1.0, 2.0, 0.0]);
    assert_eq!(reader("\u{feff}G0 X1 Y2 Z3".as_bytes()).unwrap()[0].end_mm, [1.0, 2.0, 3.0]);
}

/// Each thing that is wrong: what is said, where, and that it helps.
#[test]
fn what_is_wrong_is_named_with_its_place() {
    let long = "9".repeat(400);
    let overflow = format!("G1 X{long}");
    check_wrong(&[
        ("F1 G1 X1\nG1 X1 Q7", (2, 7), "`Q7` has no use"),
        ("G1 X1", (1, 1), "feed is not given"),
        ("X1", (1, 1), "no motion code"),
        ("G999 X1", (1, 1), "`G999` is not supported"),
        ("g0 x1 g12.34 y1", (1, 7), "`G12.34`"),
        ("G81 X1 Z-5 R2", (1, 1), "cycles"),
        ("G41 D1", (1, 1), "cutter compensation"),
        ("G28 Z0", (1, 1), "reference point"),
        ("G53 Z0", (1, 1), "machine coordinates"),
        ("G92 X0", (1, 1), "coordinate system"),
        ("M98 P1000", (1, 1), "subprograms"),
        ("M123", (1, 1), "`M123`"),
        ("G0 X1 X2", (1, 7), "already"),
        ("G0 G1 X1", (1, 4), "contradicts"),
        ("G90 G91", (1, 5), "contradicts"),
        ("G0 G4 P1.", (1, 4), "contradicts"),
        ("G0 X1e5", (1, 6), "`E5`"),
        ("G0 X1.2.3", (1, 4), "two numbers"),
        ("G0 X1 2", (1, 4), "two numbers"),
        ("G0 X", (1, 4), "`X` has no number"),
        ("G0 X--1", (1, 4), "no number"),
        ("G0 X.", (1, 4), "no number"),
        ("G0 X#1", (1, 4), "no number"),
        ("#1=5", (1, 1), "begins no word"),
        ("R1=5", (1, 1), "not supported"),
        ("G0 X[1+2]", (1, 4), "variables"),
        ("G0 X=AC(5)", (1, 4), "no number"),
        ("S2=1000", (1, 1), "not supported"),
        ("G0 X1000001", (1, 4), "out of range"),
        (overflow.as_str(), (1, 4), "too large"),
        ("F0", (1, 1), "feed of 0"),
        ("F-5", (1, 1), "out of range"),
        ("F99999999", (1, 1), "out of range"),
        ("S-5", (1, 1), "out of range"),
        ("F1 G2 X10 Y0 I4", (1, 1), "does not lie on its circle"),
        ("F1 G2 X10 R4.9", (1, 11), "no arc of radius"),
        ("F1 G2 X0 Y0 R4", (1, 13), "ends where it starts"),
        ("F1 G2 X1 Y1", (1, 1), "neither centre nor radius"),
        ("F1 G2 X1 I0", (1, 1), "centre of the arc"),
        ("F1 G2 X10 I5 K1", (1, 14), "`K1` has no use"),
        ("F1 G2 X10 I5 R5", (1, 11), "`I5` has no use"),
        ("F1 G1 X1 A30", (1, 10), "`A30` has no use"),
        ("G93", (1, 1), "G94"),
        ("G0 X1 (open", (1, 7), "no end"),
        ("G0 X1\nN10 N20 X5", (2, 5), "block number"),
        ("G0 X1 N5", (1, 7), "block number"),
        ("N1.5 G0", (1, 1), "block number"),
        ("M30\nG0 X1", (2, 1), "has ended"),
        ("%\nG0 X1\n%\nX2", (4, 1), "has ended"),
        ("TRAORI", (1, 1), "five-axis"),
        ("CSPLINE", (1, 1), "BSPLINE"),
        ("GOTOF ende", (1, 1), "branches"),
        ("G0 X1 $", (1, 7), "begins no word"),
        ("G0 X1 \u{1}", (1, 7), "U+0001"),
        ("G0 X1 ä", (1, 7), "`ä` begins"),
        ("F1 G1 X1\nG55 X2", (2, 1), "work offset"),
        ("G5 X1 Y1 I1 J1", (1, 1), "NURBS"),
        ("G5.1 X1 Y1 I1 J1", (1, 1), "NURBS"),
    ]);
}

#[test]
fn what_is_wrong_with_a_curve_is_named_with_its_place() {
    check_wrong(&[
        ("F1 BSPLINE SD=4", (1, 12), "out of range"),
        ("BSPLINE SD=3", (1, 1), "feed"),
        ("F1 G1 BSPLINE", (1, 4), "one block"),
        ("F1 BSPLINE\nX0 PL=0\nX1 PL=0\nX2 PL=0\nX3 PL=0\nG1 X1\n", (6, 1), "all knots are the same"),
        ("F1 BSPLINE\nX1 PL=1\nX2 PL=0\nG1 X1\n", (4, 1), "too few"),
        ("F1 BSPLINE\nX1 PL=1 PW=3.5", (2, 9), "weight of 3.5"),
        ("F1 BSPLINE\nX1 PL=1 PW=-1", (2, 9), "weight"),
        ("F1 BSPLINE\nX1 PL=1\nX2 PL=-1", (3, 4), "decrease"),
        ("F1 BSPLINE\nX1 PL=1\nX2 F5", (3, 4), "feed changes"),
        ("F1 BSPLINE\nX1 PL=1\nM8", (3, 1), "inside a curve"),
        ("F1 BSPLINE\nX1 PL=1\nPW=2", (3, 1), "no control point"),
        ("F1 BSPLINE\nX1 PL=0", (2, 4), "away from the tool"),
        ("F1 BSPLINE SD=2\nX1 PL=1\nX2 PL=1\nX3\nX4 PL=0\nG1", (6, 1), "has no `PL`"),
        ("F1 BSPLINE SD=2\nX1 PL=1\nX2 PL=1\nX3 PL=1\nG1", (5, 1), "`PL=1`"),
        ("F1 BSPLINE SD=2\nX1 PL=0.1\nBSPLINE", (3, 1), "inside"),
        ("F1 G91 BSPLINE", (1, 1), "incremental"),
        ("F1 G06.2 P5 K0 X0 Y0 Z0", (1, 10), "out of range"),
        ("F1 G06.2 K1 X0\nK0 X1", (2, 1), "less than"),
        ("F1 G06.2 X0", (1, 1), "no knot"),
        ("F1 G06.2 K0 X5", (1, 10), "away from the tool"),
        ("F1 G06.2 P2 K0 X0\nK0 X1\nK1\nK2\nG1 X5", (4, 1), "last 2 knots"),
        ("F1 G06.2 P2 K0 X0\nK0 X1\nK1\nX5 K2", (4, 1), "after the first block of `K` only"),
        ("F1 G06.2 P2 K0 X0\nK0 X1\nK1\nG1 X5", (4, 1), "inside a curve"),
        ("F1 G06.2 P2 K0 X0\nK0 X1\nK1", (3, 1), "ends inside a curve"),
        ("F1 G06.2 P2 K0 X0 R0\nK0 X1\nK1", (1, 19), "weight of 0"),
        ("F1 G5.2 P1 L4\nX1 Y1 P1\nG5.3", (3, 1), "too few"),
        ("F1 G5.2 P1 L11", (1, 12), "out of range"),
        ("F1 G5.2 P1 L3\nX1 P1", (2, 1), "both X and Y"),
        ("F1 G5.2 P1 L3\nX1 Y1", (2, 1), "no weight"),
        ("F1 G5.2 P1 L3\nX1 Y1 Z1 P1", (2, 7), "plane"),
        ("F1 G5.2 P1 L3\nX1 Y1 P1\n", (2, 1), "`G5.3` is missing"),
        ("F1 G18 G5.2 P1 L3", (1, 8), "plane XY"),
        ("G5.3", (1, 1), "ends no curve"),
    ]);
}

/// Texts with the place of what is wrong with them and what is said.
fn check_wrong(cases: &[(&str, (usize, usize), &str)]) {
    let mut wrong = Vec::new();
    for &(text, place, says) in cases {
        let error = error(text);
        let shown = error.to_string();
        let place_shown = shown.contains(&format!("part.nc:{}:{}", place.0, place.1)) && shown.contains('^');
        let helps = !error.help().is_empty() || shown.contains("block number comes first");
        if !(shown.contains(says) && (error.line(), error.column()) == place && place_shown && helps) {
            wrong.push(format!("{text}: {place:?} {says}\n{shown}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// Where the tool is before the program is not known: it is brought somewhere before it cuts.
#[test]
fn a_cut_from_an_unknown_place_is_refused() {
    for (text, column) in [("F1 G1 X5", 7), ("G91 G0 X5", 8), ("F1 G2 X0 Y0 I5", 7), ("F1 G2 I5", 1), ("F1 BSPLINE", 1)]
    {
        let error = error_as(text, Reading::default());
        assert!(error.message().contains("not known"), "{text}: {error}");
        assert_eq!(error.column(), column, "{text}: {error}");
    }
    // A program in the plane never names Z.
    let planar = read_as("G0 X1 Y1\nG1 X5 F100\nG2 X7 R1", Reading::default()).unwrap();
    assert_eq!(planar.last().unwrap().end_mm, [7.0, 1.0, 0.0]);
}

#[test]
fn a_problem_looks_as_a_user_sees_it() {
    let error = error("G0 X0 Y0 Z5\n(pocket)\nG2 X10 Y0 I4 J0 F300");
    assert_eq!(
        error.to_string(),
        "error: the end of the arc does not lie on its circle: it is 6.0000 mm from the centre, the start 4.0000 mm
 --> part.nc:3:1
  |
3 | G2 X10 Y0 I4 J0 F300
  | ^^^^^^^^^^^^^^^^^^^^
  |
  = note: the two may differ by 0.005 mm
  = help: the centre is written as seen from the start point (`I J K`); check the plane (`G17`, `G18`, `G19`) too"
    );
    assert!(error.render(true).contains("\u{1b}["));
}

/// A line without an end is refused before it fills the memory.
#[test]
fn an_endless_line_is_refused() {
    let endless = BufReader::new(io::repeat(b'X'));
    let first = Reader::new(endless, "endless", Reading::default()).next().unwrap();
    assert!(first.unwrap_err().to_string().contains("line is too long"));
}

/// Nobody says where the tool is: it does not cut its way there from the origin.
#[test]
fn a_program_begins_where_its_first_rapid_motions_put_the_tool() {
    let ends = |text: &str| -> Vec<([f64; 3], [f64; 3])> {
        let reader = Reader::new(text.as_bytes(), "part.nc", Reading::default());
        reader.map(|block| block.unwrap()).map(|block| (block.start_mm, block.end_mm)).collect()
    };
    let at = |place: [f64; 3]| (place, place);
    assert_eq!(ends("G0 X5 Y6 Z7\nG1 X8 F100")[..], [at([5., 6., 7.]), ([5., 6., 7.], [8., 6., 7.])]);
    // Axis by axis, with what stands between.
    let text = "(first)\nG0 Z9\nM3\nG4 F1\nG0 X1 Y2\nG1 Z3 F100";
    let found = ends(text);
    assert_eq!(found[..found.len() - 1], vec![at([1., 2., 9.]); found.len() - 1][..]);
    assert_eq!(found.last(), Some(&([1., 2., 9.], [1., 2., 3.])));
    // An axis that is moved twice before the others have a place.
    let found = ends("G0 Z9\nG0 Z5\nG0 X1 Y2");
    assert_eq!(found[..], [at([1., 2., 9.]), ([1., 2., 9.], [1., 2., 5.]), at([1., 2., 5.])]);
    // A planar program: the third axis is at 0.
    assert_eq!(ends("G0 X1 Y2\nG1 X3 F100\nG0 Z5")[2], ([3., 2., 0.], [3., 2., 5.]));
    // Neighbours join, whatever comes first, and an error comes after what is before it.
    let reader = Reader::new(&b"G0 X1\nG0 X2\nG0 X3 Q9\n"[..], "part.nc", Reading::default());
    let found: Vec<_> = reader.collect();
    assert!(found.len() == 3 && found[1].is_ok() && found[2].is_err(), "{found:?}");
}
