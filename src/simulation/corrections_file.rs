//! Corrections of the commands as a file: what `servosim learn` writes, and what a scenario's `[learned]` reads.
//!
//! ```text
//! sample,time_s,x_um,y_um
//! 0,0.000000000,0,0
//! 1,0.001000000,-0.03178234,1.2e-9
//! …
//! ```
//!
//! One line a sample of the run. The decimals are the shortest that read back as the same bits: µm in the file are mm in the program, and
//! only the decimal point moves.

use std::fmt::Write as _;
use std::io::{self, BufRead, BufReader, Read};
use std::sync::Arc;

use nalgebra::Vector2;

use crate::diagnostics::{brief, readable};

/// Most samples that are read: as many as are learned.
pub const MAX_CORRECTED_PERIODS: u64 = 1_000_000;

/// First line of the file, the names of its columns.
const HEADER: [&str; 4] = ["sample", "time_s", "x_um", "y_um"];

/// Longest line that is read \[bytes\]; one of ours has 80 at most.
const MOST_LINE: u64 = 1000;

/// Largest correction, as in [`Simulation::with_corrections`](super::Simulation::with_corrections) \[mm\].
const MOST_MM: f64 = 1e6;

/// Half of the last digit of a time in the file \[s\], and a little.
const TIME_S: f64 = 6e-10;

/// Why a file of corrections cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CorrectionsError {
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[from] io::Error),
    /// Its first line is another one.
    #[error("line 1: the columns must be `sample,time_s,x_um,y_um`, not `{found}`")]
    Header {
        /// What it is.
        found: String,
    },
    /// A line is not what it should be.
    #[error("line {line}, column {column}: {what}")]
    Line {
        /// From 1.
        line: u64,
        /// Character, from 1.
        column: usize,
        /// In words.
        what: String,
    },
    /// They belong to a run with another control period.
    #[error(
        "line {line}: its samples are {} s apart, those of this run {} s",
        readable(*file_s), readable(*run_s)
    )]
    Period {
        /// From 1.
        line: u64,
        /// Period of the file.
        file_s: f64,
        /// Control period of the run.
        run_s: f64,
    },
    /// They belong to a shorter run.
    #[error("ends after {file} samples, this run has {run}")]
    TooFew {
        /// Samples in the file.
        file: u64,
        /// Samples of the run.
        run: u64,
    },
    /// They belong to a longer run.
    #[error("line {line}: there are more samples than the {run} of this run")]
    TooMany {
        /// From 1.
        line: u64,
        /// Samples of the run.
        run: u64,
    },
    /// The run is too long.
    #[error("the run has {samples} control periods; at most {MAX_CORRECTED_PERIODS} can be corrected")]
    TooLong {
        /// How many.
        samples: u64,
    },
}

/// The text of a file of corrections, which reads back as the same bits.
///
/// - `shifts_mm`: what is added to the position commands, sample by sample \[mm\]
/// - `period_s`: control period \[s\]
pub fn write_corrections(shifts_mm: &[Vector2<f64>], period_s: f64) -> String {
    let mut out = HEADER.join(",");
    out.push('\n');
    for (k, shift) in shifts_mm.iter().enumerate() {
        let time_s = k as f64 * period_s;
        // Writing to a string does not fail.
        let _ = writeln!(out, "{k},{time_s:.9},{},{}", micrometres(shift.x), micrometres(shift.y));
    }
    out
}

/// Reads the corrections of a run of `samples` control periods of `period_s`, which may not have others.
///
/// No more is read of a long file than the run has use for.
///
/// # Errors
/// It cannot be read, has other columns or other samples than the run, or a value that is not a finite number.
pub fn read_corrections(
    reader: impl Read,
    samples: u64,
    period_s: f64,
) -> Result<Arc<[Vector2<f64>]>, CorrectionsError> {
    if samples > MAX_CORRECTED_PERIODS {
        return Err(CorrectionsError::TooLong { samples });
    }
    let mut lines = Lines { reader: BufReader::new(reader), number: 0, text: String::new() };
    let header = if lines.next()? { lines.text.trim_start_matches('\u{feff}') } else { "" };
    if !header.split(',').map(str::trim).eq(HEADER) {
        return Err(CorrectionsError::Header { found: brief(header) });
    }
    let mut shifts_mm: Vec<Vector2<f64>> = Vec::new();
    while lines.next()? {
        let (line, k) = (lines.number, shifts_mm.len() as u64);
        if lines.text.trim().is_empty() {
            continue;
        }
        if k == samples {
            return Err(CorrectionsError::TooMany { line, run: samples });
        }
        let [number, time, x, y] = lines.fields()?;
        if number.text.parse() != Ok(k) {
            return Err(
                number.wrong(line, &format!("is not the number of this sample, {k}: each comes once, in order"))
            );
        }
        let expected_s = k as f64 * period_s;
        match time.text.parse::<f64>() {
            Ok(time_s) if (time_s - expected_s).abs() <= TIME_S + 1e-12 * expected_s => {}
            Ok(time_s) if time_s.is_finite() && k > 0 => {
                return Err(CorrectionsError::Period { line, file_s: time_s / k as f64, run_s: period_s });
            }
            Ok(_) => return Err(time.wrong(line, "is not the time of this sample, 0")),
            Err(_) => return Err(time.wrong(line, "is not a number")),
        }
        shifts_mm.push(Vector2::new(x.millimetres(line)?, y.millimetres(line)?));
    }
    let file = shifts_mm.len() as u64;
    if file < samples {
        return Err(CorrectionsError::TooFew { file, run: samples });
    }
    Ok(shifts_mm.into())
}

/// Lines of a text that may be anything.
struct Lines<R> {
    reader: BufReader<R>,
    /// Of the line, from 1.
    number: u64,
    text: String,
}

impl<R: Read> Lines<R> {
    /// Reads the next line, if there is one; of a long one its beginning, which is no line of ours.
    fn next(&mut self) -> Result<bool, CorrectionsError> {
        let mut bytes = Vec::new();
        (&mut self.reader).take(MOST_LINE).read_until(b'\n', &mut bytes)?;
        self.number += 1;
        self.text = String::from_utf8_lossy(&bytes).trim_end_matches(['\n', '\r']).to_owned();
        if bytes.len() as u64 == MOST_LINE && bytes.last() != Some(&b'\n') && self.number > 1 {
            let what = format!("the line is longer than {MOST_LINE} bytes");
            return Err(CorrectionsError::Line { line: self.number, column: 1, what });
        }
        Ok(!bytes.is_empty())
    }

    /// The four values of the line.
    fn fields(&self) -> Result<[Field<'_>; 4], CorrectionsError> {
        let mut column = 1;
        let mut fields = self.text.split(',').map(|text| {
            let at = column + text.chars().take_while(|c| c.is_whitespace()).count();
            column += text.chars().count() + 1;
            (text.trim(), at)
        });
        let mut found = HEADER.map(|name| Field { name, text: "", column: 0 });
        for field in &mut found {
            let Some((text, column)) = fields.next() else {
                let end = self.text.chars().count() + 1;
                let what = format!("`{}` is missing: a line has the values {}", field.name, HEADER.join(", "));
                return Err(CorrectionsError::Line { line: self.number, column: end, what });
            };
            (field.text, field.column) = (text, column);
        }
        if let Some((_, column)) = fields.next() {
            let what = format!("more than the values {}; decimals have a point", HEADER.join(", "));
            return Err(CorrectionsError::Line { line: self.number, column, what });
        }
        Ok(found)
    }
}

/// A value of a line.
struct Field<'a> {
    name: &'static str,
    text: &'a str,
    column: usize,
}

impl Field<'_> {
    fn wrong(&self, line: u64, what: &str) -> CorrectionsError {
        let what = format!("{} = `{}` {what}", self.name, brief(self.text));
        CorrectionsError::Line { line, column: self.column, what }
    }

    /// A number of µm as mm: its decimal point moved, not divided, so that nothing is rounded twice.
    fn millimetres(&self, line: u64) -> Result<f64, CorrectionsError> {
        let (mantissa, exponent) = self.text.split_once(['e', 'E']).unwrap_or((self.text, "0"));
        let moved = exponent.parse::<i32>().ok().and_then(|exponent| exponent.checked_sub(3));
        match moved.and_then(|exponent| format!("{mantissa}e{exponent}").parse::<f64>().ok()) {
            Some(mm) if mm.abs() <= MOST_MM => Ok(mm),
            Some(_) => Err(self.wrong(line, "is too large: at most 1e9 µm")),
            None => Err(self.wrong(line, "is not a finite number")),
        }
    }
}

/// A number of mm in µm: its shortest digits, the decimal point moved.
fn micrometres(mm: f64) -> String {
    if mm == 0.0 {
        return if mm.is_sign_negative() { "-0" } else { "0" }.to_owned();
    }
    let text = format!("{mm:e}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let exponent = exponent.parse::<i32>().unwrap_or(0) + 3;
    let (sign, digits) = mantissa.strip_prefix('-').map_or(("", mantissa), |digits| ("-", digits));
    let digits = digits.replace('.', "");
    match usize::try_from(exponent + 1) {
        Ok(whole) if whole > 0 && whole < digits.len() => {
            let (before, after) = digits.split_at(whole);
            format!("{sign}{before}.{after}")
        }
        Ok(whole) if whole > 0 && whole <= 15 => format!("{sign}{digits:0<whole$}"),
        _ if (-6..0).contains(&exponent) => {
            let zeros = usize::try_from(-exponent - 1).unwrap_or(0);
            format!("{sign}0.{}{digits}", "0".repeat(zeros))
        }
        _ => format!("{mantissa}e{exponent}"),
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn read(text: &str, samples: u64) -> Result<Arc<[Vector2<f64>]>, CorrectionsError> {
        read_corrections(text.as_bytes(), samples, 1e-3)
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut any = || {
            let mm: f64 = f64::from_bits(rng.random());
            let scaled = rng.random_range(-1.0..1.0) * libm::pow(10.0, rng.random_range(-12.0..6.0));
            if mm.abs() <= 1e6 && rng.random_bool(0.5) { mm } else { scaled }
        };
        let mut shifts: Vec<Vector2<f64>> = (0..20_000).map(|_| Vector2::new(any(), any())).collect();
        shifts.extend([0.0, -0.0, 1.0, 1e-3, 1e6, -1e6, 0.1, 5e-324, 1e-9, 123.456].map(|x| Vector2::new(x, -x)));
        let back = read(&write_corrections(&shifts, 1e-3), shifts.len() as u64).unwrap();
        for (a, b) in shifts.iter().zip(back.iter()) {
            assert_eq!([a.x.to_bits(), a.y.to_bits()], [b.x.to_bits(), b.y.to_bits()], "{a} {b}");
        }
    }

    #[test]
    fn numbers_are_micrometres_in_plain_decimals() {
        for (mm, um) in [
            (0.0, "0"),
            (1.0, "1000"),
            (-0.5, "-500"),
            (0.043_217, "43.217"),
            (1.234_567_8, "1234.5678"),
            (1e-3, "1"),
            (-2.5e-4, "-0.25"),
            (1e-9, "0.000001"),
            (1.5e-10, "1.5e-7"),
            (1e6, "1000000000"),
        ] {
            assert_eq!(micrometres(mm), um);
        }
        // As people write them.
        let text = "\u{feff}sample,time_s,x_um,y_um\r\n0,0,+1,.5\r\n1, 0.001 ,1E3, -2.5e-1\r\n\r\n";
        let shifts = read(text, 2).unwrap();
        assert_eq!(*shifts, [Vector2::new(1e-3, 5e-4), Vector2::new(1.0, -2.5e-4)]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let with = |rest: &str| format!("sample,time_s,x_um,y_um\n0,0,0,0\n{rest}\n2,0.002,0,0\n");
        let long = format!("1,0.001,0,{}", "0".repeat(5000));
        for (text, told) in [
            (String::new(), "line 1: the columns must be `sample,time_s,x_um,y_um`, not ``"),
            ("sample;time_s;x_um;y_um\n".to_owned(), "line 1: the columns must be"),
            ("{\"json\": 1}".repeat(1000), "line 1: the columns must be"),
            (with("1,0.001,abc,0"), "line 3, column 9: x_um = `abc` is not a finite number"),
            (with("1,0.001,0,nan"), "line 3, column 11: y_um = `nan` is not a finite number"),
            (with("1,0.001,0,-inf"), "y_um = `-inf` is not a finite number"),
            (with("1,0.001,1e400,0"), "x_um = `1e400` is too large"),
            (with("1,0.001,1e99999999999,0"), "x_um = `1e99999999999` is not a finite number"),
            (with("1,0.001,,0"), "x_um = `` is not a finite number"),
            (with("1,0.001,2e9,0"), "x_um = `2e9` is too large: at most 1e9 µm"),
            (with("1,0.001,0"), "line 3, column 10: `y_um` is missing"),
            (with("1,0.001,0,5,0"), "line 3, column 13: more than the values"),
            (with("2,0.002,0,0"), "line 3, column 1: sample = `2` is not the number of this sample, 1"),
            (with("x,0.001,0,0"), "sample = `x` is not the number"),
            (with("1,soon,0,0"), "line 3, column 3: time_s = `soon` is not a number"),
            (with("1,nan,0,0"), "time_s = `nan` is not the time"),
            (with("1,0.002,0,0"), "line 3: its samples are 0.002 s apart, those of this run 0.001 s"),
            (with(&long), "line 3, column 1: the line is longer than 1000 bytes"),
            (with("1,0.001,0,0\n\n2,0.002,0,0"), "line 6: there are more samples than the 3 of this run"),
            ("sample,time_s,x_um,y_um\n0,0,0,0\n".to_owned(), "ends after 1 samples, this run has 3"),
            ("sample,time_s,x_um,y_um\n0,0.5,0,0\n".to_owned(), "time_s = `0.5` is not the time of this sample, 0"),
        ] {
            let error = read(&text, 3).unwrap_err().to_string();
            assert!(error.contains(told), "{told}\n{error}");
        }
        assert!(matches!(read("", 2_000_000), Err(CorrectionsError::TooLong { .. })));
        // A file without an end is not read to its end.
        let endless = io::repeat(b'7');
        assert!(matches!(read_corrections(endless, 3, 1e-3), Err(CorrectionsError::Header { .. })));
    }
}
