//! NC programs as streams: long ones, broken ones, and any bytes at all.

use std::io::{self, BufReader, Read};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::nc::{Action, NcError, Program, Reader, Reading};

/// A text of any length that is made while it is read.
struct Endless {
    line: u64,
    lines: u64,
    left: Vec<u8>,
}

impl Read for Endless {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.left.is_empty() && self.line < self.lines {
            self.line += 1;
            let x = self.line % 1000;
            self.left = match self.line {
                1 => b"G0 X0 Y0 Z0 F1000\n".to_vec(),
                _ => format!("N{} G01 X{x}.125 Y-{x}.5 Z.25\n", self.line).into_bytes(),
            };
        }
        let count = self.left.len().min(out.len());
        out[..count].copy_from_slice(&self.left[..count]);
        self.left.drain(..count);
        Ok(count)
    }
}

#[test]
fn a_long_program_is_a_stream() {
    let lines = 200_000;
    let endless = BufReader::new(Endless { line: 0, lines, left: Vec::new() });
    let mut blocks = 0;
    for block in Reader::new(endless, "long", Reading::default()) {
        block.unwrap();
        blocks += 1;
    }
    assert_eq!(blocks, lines);
}

#[test]
fn a_reader_that_fails_is_reported() {
    struct Broken;
    impl Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("the disk is gone"))
        }
    }
    let mut reader = Reader::new(BufReader::new(Broken), "part.nc", Reading::default());
    let error = reader.next().unwrap().unwrap_err();
    assert_eq!(error.to_string(), "cannot read part.nc: the disk is gone");
    assert!(reader.next().is_none());
}

const VALID: [&str; 4] = [
    "%\nO0001 (PART)\nN10 G90 G21 G17 G54\nG0 X0 Y0 Z50\nS900 M3\nG1 Z-1.5 F300\nG2 X10 R5\nG3 X0 I-5 J0\nG4 P1.5\nG18 G2 X4 Z-1.5 R3\nG0 Z50\nM30\n%\n",
    "; siemens\nG90 G71\nG0 X0 Y0 Z0\nBSPLINE SD=3 F600\nX0 Y0 Z0 PL=0\nX1 PL=1\nX2 PW=2 PL=2.5\nX3 PL=0.5\nX4 PL=0\nX5 Y1 PL=0\nG1 X6\nM30\n",
    "G0 X0 Y0 Z0\nG06.2 P3 K0. X0 Y0 Z0 R1. F500.\nK0 X1 R2\nK0 X2 Y1\nK1.5\nK1.5\nK1.5\nG01 X9\nM30\n",
    "G0 X0 Y0 Z0\nF100\nG5.2 P1 L3\n X0 Y1 P1\n X2 Y2 P1\n X2 Y0 P1\n X0 Y0 P2\nG5.3\nM2\n",
];

/// Whatever comes: blocks, or an error with a place in the text.
fn check_any(bytes: &[u8]) {
    for (start_mm, uniform_knots) in [(None, false), (Some([0.0; 3]), true)] {
        let reading = Reading { start_mm, uniform_knots, ..Reading::default() };
        let lines = bytes.split(|&b| b == b'\n').count();
        for block in Reader::new(bytes, "fuzz", reading) {
            match block {
                Ok(block) => {
                    assert!(block.line >= 1 && block.line <= lines);
                    assert!(block.start_mm.iter().chain(&block.end_mm).all(|c| c.abs() <= 1e6), "{block:?}");
                    assert!(!block.is_feed_motion() || block.feed_mm_min.is_some_and(|f| f > 0.0), "{block:?}");
                    match &block.action {
                        Action::Nurbs(curve) => curve.check().unwrap(),
                        Action::Arc(arc) => assert!(arc.sweep_rad(block.start_mm, block.end_mm) > 0.0),
                        _ => {}
                    }
                }
                Err(NcError::Syntax(error)) => {
                    assert!((1..=lines).contains(&error.line()) && error.column() >= 1, "{error}");
                    assert!(!error.render(true).is_empty());
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
}

#[test]
fn valid_programs_are_valid() {
    for text in VALID {
        Program::read(text, "valid").unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn every_prefix_of_a_program_is_read_or_refused() {
    for text in VALID {
        for length in 0..=text.len() {
            check_any(&text.as_bytes()[..length]);
        }
    }
}

#[test]
fn random_bytes_are_read_or_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(72);
    let letters = b"GGGXYZIJKRFPLNMSTWQ0123456789..--+ =\n\n();%/BSPLINE SD= PL= PW=\xff\x00\xe4#[]";
    for case in 0..20_000 {
        let bytes: Vec<u8> = (0..rng.random_range(0..80))
            .map(|_| if case % 2 == 0 { rng.random() } else { letters[rng.random_range(0..letters.len())] })
            .collect();
        check_any(&bytes);
    }
}

#[test]
fn programs_with_random_changes_are_read_or_refused() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(73);
    let pieces = [
        "G1",
        "G2",
        "G5.2",
        "G5.3",
        "G06.2",
        "BSPLINE",
        "SD=2",
        "PL=1",
        "PL=-1",
        "PW=4",
        "X1e9",
        "X-99999999999",
        "K0",
        "\n",
        "R5",
        "M30",
        "%",
        "(",
        ")",
        ";",
        "/",
        "I5",
        "P4",
        "L3",
        "G91",
        "G20",
        "G18",
        "F0",
        ".",
        "-",
        " ",
        "\0",
        "\u{feff}",
        "9999999999999999999999",
    ];
    for _ in 0..20_000 {
        let mut bytes = VALID[rng.random_range(0..VALID.len())].as_bytes().to_vec();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len());
            match rng.random_range(0..4) {
                0 if at < bytes.len() => bytes[at] = rng.random(),
                1 if at < bytes.len() => drop(bytes.remove(at)),
                2 => {
                    let to = (at + rng.random_range(0..30)).min(bytes.len());
                    bytes.drain(at..to);
                }
                _ => drop(bytes.splice(at..at, pieces[rng.random_range(0..pieces.len())].bytes())),
            }
        }
        check_any(&bytes);
    }
}
