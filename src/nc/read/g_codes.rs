//! What the codes of a program do.

use super::words::{Address, Word, Words};
use crate::diagnostics::{Diagnostic, brief};
use crate::nc::Plane;

/// What a G code does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::nc) enum Code {
    Rapid,
    Linear,
    Arc {
        clockwise: bool,
    },
    /// `G06.2`.
    FanucCurve,
    /// `G5.2`.
    OpenCurve,
    /// `G5.3`.
    CloseCurve,
    Dwell,
    Plane(Plane),
    /// Millimetres in one unit of length.
    Units(f64),
    Absolute(bool),
    FeedPerMinute,
    /// Which work offset.
    Offset(u32),
    /// Moves nothing; the letters that belong to it.
    Kept(&'static [u8]),
}

/// When an M code acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::nc) enum Miscellaneous {
    Before,
    After,
    /// Ends the program.
    End,
}

const NO_SPLINES: &str = "only NURBS curves with control points are supported: `G5.2`, `G06.2`, `BSPLINE`";
const NO_CYCLES: &str = "canned cycles are not supported: write the moves out";
const NO_SHIFT: &str = "the coordinate system cannot be changed: write the program in the part's coordinates";

/// The meaning of a G code, given ten times its number; else what to do without it.
fn g_code(tenths: u32) -> Result<Code, &'static str> {
    Ok(match tenths {
        0 => Code::Rapid,
        10 => Code::Linear,
        20 => Code::Arc { clockwise: true },
        30 => Code::Arc { clockwise: false },
        40 => Code::Dwell,
        51 => Code::Kept(b"Q"),
        52 => Code::OpenCurve,
        53 => Code::CloseCurve,
        62 => Code::FanucCurve,
        170 => Code::Plane(Plane::Xy),
        180 => Code::Plane(Plane::Zx),
        190 => Code::Plane(Plane::Yz),
        200 | 7000 => Code::Units(25.4),
        210 | 710 | 7100 => Code::Units(1.0),
        430 => Code::Kept(b"H"),
        640 => Code::Kept(b"PQ"),
        540 | 550 | 560 | 570 | 580 | 590 => Code::Offset(tenths / 10),
        900 => Code::Absolute(true),
        910 => Code::Absolute(false),
        940 => Code::FeedPerMinute,
        90 | 150 | 400 | 490 | 610 | 611 | 690 | 800 | 911 | 970 | 980 | 990 | 6010 | 6020 | 6030 | 6410 | 6420
        | 6430 | 6440 | 6450 => Code::Kept(b""),
        50 | 60 | 61 => return Err(NO_SPLINES),
        100 | 520 | 500 | 510 | 680 | 920..=923 | 160 => return Err(NO_SHIFT),
        280 | 281 | 300 | 301 | 270 | 290 => {
            return Err("where the reference point is the program does not say: write the move with `G0`");
        }
        410 | 420 | 411 | 421 => {
            return Err(
                "cutter compensation changes the path in a way that only the control knows: let the CAM system write the tool's path",
            );
        }
        530 => return Err("machine coordinates are not known here: write the move in the part's coordinates"),
        700 => return Err("whether `G70` holds for the feed too depends on the machine: write `G700` or `G20`"),
        730..=760 | 810..=890 => return Err(NO_CYCLES),
        901 => return Err("arc centres are read as seen from the start point: write them with `G91.1`"),
        930 | 950 => return Err("write the feed in millimetres a minute (`G94`)"),
        330..=332 | 960 => return Err("motion that follows the spindle is not supported"),
        380..=385 | 310 => return Err("where a probe stops the program does not say"),
        _ => return Err("whether it moves the tool is not known: remove it, or write the motion with `G0 G1 G2 G3`"),
    })
}

/// The meaning of an M code; else what to do without it.
fn m_code(number: u32) -> Result<Miscellaneous, &'static str> {
    Ok(match number {
        3..=8 | 10..=14 | 19 | 48 | 49 => Miscellaneous::Before,
        0 | 1 | 9 | 60 => Miscellaneous::After,
        2 | 17 | 30 => Miscellaneous::End,
        97..=99 => return Err("subprograms are not supported: write one program"),
        _ => return Err("whether it moves the tool is not known: remove it"),
    })
}

/// The codes of one line.
#[derive(Debug, Default)]
pub(in crate::nc) struct Codes {
    /// The motion code, and which word it is.
    pub(in crate::nc) motion: Option<(Code, usize)>,
    pub(in crate::nc) dwell: bool,
    pub(in crate::nc) plane: Option<Plane>,
    pub(in crate::nc) units_mm: Option<f64>,
    pub(in crate::nc) absolute: Option<bool>,
    /// The work offset, and which word it is.
    pub(in crate::nc) offset: Option<(u32, usize)>,
    /// Words that move nothing and act before the motion.
    pub(in crate::nc) before: String,
    /// Words that act after it.
    pub(in crate::nc) after: String,
    /// Whether the program ends.
    pub(in crate::nc) ends: bool,
    /// Bits of the addresses used up.
    pub(in crate::nc) used: u64,
}

impl Codes {
    /// Reads the codes of a line, and the words that move nothing.
    pub(in crate::nc) fn of(words: &Words, line: &str) -> Result<Self, Diagnostic> {
        let mut codes = Self::default();
        let mut letters = 0;
        let axes = words.list.iter().any(|word| matches!(word.address, Address::Letter(b'X' | b'Y' | b'Z')));
        for (index, word) in words.list.iter().enumerate() {
            match word.address {
                Address::Letter(b'G') => codes.g_word(word, index, line, axes, &mut letters)?,
                Address::Letter(b'M') => codes.m_word(word, line)?,
                Address::Letter(b'S' | b'T' | b'H' | b'D' | b'O') => {
                    if !(0.0..=1e8).contains(&word.value) {
                        return Err(Diagnostic::new(format!("`{}` is out of range", brief(word.text(line))))
                            .at(word.span())
                            .help("its number is 0 to 100000000"));
                    }
                    push_word(&mut codes.before, word, line);
                }
                Address::Switch => push_word(&mut codes.before, word, line),
                Address::Letter(letter) if letters & Address::Letter(letter).bit() != 0 => {
                    push_word(&mut codes.before, word, line);
                }
                _ => continue,
            }
            codes.used |= word.address.bit();
        }
        Ok(codes)
    }

    /// Reads a G word (in a block with or without axes). `letters` gathers those that belong to a code.
    fn g_word(
        &mut self,
        word: &Word,
        index: usize,
        line: &str,
        axes: bool,
        letters: &mut u64,
    ) -> Result<(), Diagnostic> {
        let shown = || brief(&word.text(line).to_ascii_uppercase());
        let unknown = |help: &str| {
            Diagnostic::new(format!("`{}` is not supported", shown())).at(word.span()).help(help.to_owned())
        };
        let tenths = tenths(word).ok_or_else(|| unknown("a G code has at most one decimal, such as `G5.2`"))?;
        let twice = || {
            Diagnostic::new(format!("`{}` contradicts another code of this block", shown()))
                .at(word.span())
                .help("write the codes in two blocks")
        };
        if tenths == 51 && axes {
            return Err(unknown(NO_SPLINES));
        }
        let code = g_code(tenths).map_err(unknown)?;
        let taken = match code {
            Code::Rapid | Code::Linear | Code::Arc { .. } | Code::FanucCurve | Code::OpenCurve | Code::CloseCurve => {
                self.dwell || self.motion.replace((code, index)).is_some()
            }
            Code::Dwell => std::mem::replace(&mut self.dwell, true) || self.motion.is_some(),
            Code::Plane(plane) => self.plane.replace(plane).is_some(),
            Code::Units(units) => self.units_mm.replace(units).is_some(),
            Code::Absolute(absolute) => self.absolute.replace(absolute).is_some(),
            Code::FeedPerMinute => false,
            Code::Offset(offset) => {
                push_word(&mut self.before, word, line);
                self.offset.replace((offset, index)).is_some()
            }
            Code::Kept(own) => {
                push_word(&mut self.before, word, line);
                *letters |= own.iter().map(|&letter| Address::Letter(letter).bit()).sum::<u64>();
                false
            }
        };
        if taken { Err(twice()) } else { Ok(()) }
    }

    fn m_word(&mut self, word: &Word, line: &str) -> Result<(), Diagnostic> {
        let unknown = |help: &str| {
            let shown = brief(&word.text(line).to_ascii_uppercase());
            Diagnostic::new(format!("`{shown}` is not supported")).at(word.span()).help(help.to_owned())
        };
        let tenths = tenths(word).filter(|t| t % 10 == 0).ok_or_else(|| unknown("an M code is a whole number"))?;
        match m_code(tenths / 10).map_err(unknown)? {
            Miscellaneous::Before => push_word(&mut self.before, word, line),
            Miscellaneous::After => push_word(&mut self.after, word, line),
            Miscellaneous::End => {
                push_word(&mut self.after, word, line);
                self.ends = true;
            }
        }
        Ok(())
    }
}

/// Ten times the number of a code; none where it has more decimals, or is too large.
fn tenths(word: &Word) -> Option<u32> {
    let tenths = word.value * 10.0;
    // At most 99999: fits.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    ((0.0..=99_999.0).contains(&tenths) && (tenths - tenths.round()).abs() < 1e-6).then(|| tenths.round() as u32)
}

/// Appends a word in capital letters, without the spaces in it.
fn push_word(out: &mut String, word: &Word, line: &str) {
    if !out.is_empty() {
        out.push(' ');
    }
    out.extend(word.text(line).chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_uppercase()));
}
