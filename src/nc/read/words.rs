//! A line of a program cut into words.

use std::ops::Range;

use crate::diagnostics::{Diagnostic, brief};

/// What a number belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::nc) enum Address {
    /// A letter, capital.
    Letter(u8),
    /// `SD=`: degree.
    Degree,
    /// `PW=`: weight.
    Weight,
    /// `PL=`: length of the parameter interval.
    Interval,
    /// `CR=`: radius of an arc.
    Radius,
    /// `BSPLINE`, without a number.
    Bspline,
    /// A name without a number that moves nothing.
    Switch,
}

impl Address {
    /// A bit of its own for every address.
    pub(in crate::nc) fn bit(self) -> u64 {
        match self {
            Self::Letter(letter) => 1 << (letter.saturating_sub(b'A') & 31),
            Self::Degree => 1 << 32,
            Self::Weight => 1 << 33,
            Self::Interval => 1 << 34,
            Self::Radius => 1 << 35,
            Self::Bspline => 1 << 36,
            Self::Switch => 1 << 37,
        }
    }
}

/// One word.
#[derive(Debug, Clone, Copy)]
pub(in crate::nc) struct Word {
    pub(in crate::nc) address: Address,
    /// Its number; 0 where it has none.
    pub(in crate::nc) value: f64,
    /// Whether the number has a decimal point.
    pub(in crate::nc) point: bool,
    start: usize,
    end: usize,
}

impl Word {
    /// Where it stands in its line, in bytes.
    pub(in crate::nc) fn span(&self) -> Range<usize> {
        self.start..self.end
    }

    /// As it stands in its line.
    pub(in crate::nc) fn text<'a>(&self, line: &'a str) -> &'a str {
        line.get(self.span()).unwrap_or_default()
    }
}

/// A line of a program.
#[derive(Debug, Default)]
pub(in crate::nc) struct Words {
    /// In order.
    pub(in crate::nc) list: Vec<Word>,
    /// Comments, without their marks.
    pub(in crate::nc) comments: Vec<String>,
    /// Whether it begins with `/`.
    pub(in crate::nc) deletable: bool,
    /// Whether it begins with `%`.
    pub(in crate::nc) mark: bool,
}

/// Names that change how exactly or how smoothly the tool follows, and move nothing.
const SWITCHES: [&str; 12] =
    ["BRISK", "SOFT", "DRIVE", "FFWON", "FFWOF", "COMPOF", "FNORM", "FLIN", "FCUB", "ORIWKS", "ORIMKS", "CFTCP"];

impl Words {
    /// Cuts a line into words.
    pub(in crate::nc) fn cut(&mut self, line: &str) -> Result<(), Diagnostic> {
        self.list.clear();
        self.comments.clear();
        (self.deletable, self.mark) = (false, false);
        let bytes = line.as_bytes();
        let mut at = spaces(bytes, 0);
        if bytes.get(at) == Some(&b'%') {
            self.mark = true;
            return Ok(());
        }
        if bytes.get(at) == Some(&b'/') {
            self.deletable = true;
            at = spaces(bytes, at + 1);
        }
        let mut numbered = false;
        while let Some(&byte) = bytes.get(at) {
            at = match byte {
                b';' => {
                    self.comments.push(line.get(at + 1..).unwrap_or_default().trim().to_owned());
                    bytes.len()
                }
                b'(' => self.bracketed(line, at)?,
                b'A'..=b'Z' | b'a'..=b'z' => {
                    let (word, next) = cut_word(line, at)?;
                    if word.address == Address::Letter(b'N') {
                        self.number(&word, line, numbered)?;
                        numbered = true;
                    } else {
                        self.list.push(word);
                    }
                    next
                }
                b'#' | b'[' | b']' | b'=' | b'$' | b'*' => {
                    return Err(unexpected(line, at)
                        .help("variables and expressions are not supported: let the CAM system write plain numbers"));
                }
                _ => return Err(unexpected(line, at)),
            };
            at = spaces(bytes, at);
        }
        Ok(())
    }

    fn bracketed(&mut self, line: &str, at: usize) -> Result<usize, Diagnostic> {
        let inside = line.get(at + 1..).unwrap_or_default();
        let Some(length) = inside.find(')') else {
            return Err(Diagnostic::new("the comment has no end")
                .at(at..line.len())
                .label("`)` is missing")
                .help("close the comment with `)` on the same line"));
        };
        self.comments.push(inside.get(..length).unwrap_or_default().trim().to_owned());
        Ok(at + 1 + length + 1)
    }

    /// A block number comes first and is a whole number.
    fn number(&self, word: &Word, line: &str, numbered: bool) -> Result<(), Diagnostic> {
        if numbered || !self.list.is_empty() {
            return Err(Diagnostic::new(format!("`{}` is not at the beginning of its line", brief(word.text(line))))
                .at(word.span())
                .label("a block number comes first, and once"));
        }
        if word.point || word.value < 0.0 {
            return Err(Diagnostic::new(format!("`{}` is no block number", brief(word.text(line))))
                .at(word.span())
                .help("a block number is a whole number, such as `N10`"));
        }
        Ok(())
    }
}

fn unexpected(line: &str, at: usize) -> Diagnostic {
    let c = line.get(at..).and_then(|rest| rest.chars().next()).unwrap_or(' ');
    let shown = if c.is_control() { format!("the character U+{:04X}", u32::from(c)) } else { format!("`{c}`") };
    Diagnostic::new(format!("{shown} begins no word"))
        .at(at..at + c.len_utf8())
        .help("a word is a letter and a number, such as `X12.5`; comments are written in `( )` or after `;`")
}

/// The first place at or after `at` that is not a space.
fn spaces(bytes: &[u8], at: usize) -> usize {
    run(bytes, at, |b| b == b' ' || b == b'\t')
}

/// The first place at or after `at` whose byte is not of the kind.
fn run(bytes: &[u8], at: usize, kind: impl Fn(u8) -> bool) -> usize {
    at + bytes.get(at..).unwrap_or_default().iter().take_while(|&&b| kind(b)).count()
}

/// The word at `at`, and the place after it.
fn cut_word(line: &str, at: usize) -> Result<(Word, usize), Diagnostic> {
    let bytes = line.as_bytes();
    let name_end = run(bytes, at, |b| b.is_ascii_alphabetic());
    let name = line.get(at..name_end).unwrap_or_default();
    let is = |known: &str| name.eq_ignore_ascii_case(known);
    let address = match bytes.get(at) {
        Some(letter) if name_end == at + 1 => Address::Letter(letter.to_ascii_uppercase()),
        _ if is("SD") => Address::Degree,
        _ if is("PW") => Address::Weight,
        _ if is("PL") => Address::Interval,
        _ if is("CR") => Address::Radius,
        _ if is("BSPLINE") || SWITCHES.iter().any(|s| is(s)) => {
            let address = if is("BSPLINE") { Address::Bspline } else { Address::Switch };
            return Ok((Word { address, value: 0.0, point: false, start: at, end: name_end }, name_end));
        }
        _ => return Err(unknown_name(name, at..name_end)),
    };
    let mut start = spaces(bytes, name_end);
    if bytes.get(start) == Some(&b'=') {
        start = spaces(bytes, start + 1);
    }
    let digits = run(bytes, start, |b| b == b'+' || b == b'-').min(start + 1);
    let whole = run(bytes, digits, |b| b.is_ascii_digit());
    let point = bytes.get(whole) == Some(&b'.');
    let end = if point { run(bytes, whole + 1, |b| b.is_ascii_digit()) } else { whole };
    if whole - digits + end.saturating_sub(whole + 1) == 0 {
        return Err(no_number(line, name, at..name_end, start));
    }
    let next = spaces(bytes, end);
    if matches!(bytes.get(next), Some(b'0'..=b'9' | b'.' | b'+' | b'-')) {
        return Err(Diagnostic::new(format!("two numbers after `{name}`"))
            .at(at..next + 1)
            .help("a number has at most one decimal point and no space in it"));
    }
    if bytes.get(next) == Some(&b'=') {
        return Err(Diagnostic::new(format!("`{}=` is not supported", brief(line.get(at..end).unwrap_or_default())))
            .at(at..next + 1)
            .help("variables, expressions and numbered spindles are not supported: write plain words"));
    }
    // Digits, at most one point and a sign: always a number, perhaps an infinite one.
    let value: f64 = line.get(start..end).and_then(|number| number.parse().ok()).unwrap_or(f64::INFINITY);
    if !value.is_finite() {
        return Err(Diagnostic::new(format!("the number after `{name}` is too large"))
            .at(at..end)
            .help("numbers of a program have a few digits before the decimal point"));
    }
    Ok((Word { address, value, point, start: at, end }, end))
}

fn no_number(line: &str, name: &str, span: Range<usize>, start: usize) -> Diagnostic {
    let problem = Diagnostic::new(format!("`{name}` has no number"));
    match line.as_bytes().get(start) {
        Some(b'#' | b'[' | b'(' | b'R' | b'r' | b'A' | b'a' | b'I' | b'i' | b'"') => {
            problem.at(span.start..start + 1).help(
                "variables, expressions and calls are not supported: let the CAM system write plain numbers, such as `X12.5`",
            )
        }
        _ => problem.at(span).help("a word is a letter and a number, such as `X12.5`, `X-.5` or `X+3.`"),
    }
}

fn unknown_name(name: &str, span: Range<usize>) -> Diagnostic {
    let problem = Diagnostic::new(format!("`{}` is not known", brief(name))).at(span);
    let upper = name.to_ascii_uppercase();
    match upper.as_str() {
        "ASPLINE" | "CSPLINE" => problem.help("only `BSPLINE` is supported, which has control points"),
        "G" | "GOTO" | "GOTOF" | "GOTOB" | "IF" | "ELSE" | "ENDIF" | "FOR" | "WHILE" | "LOOP" | "CALL" | "REPEAT"
        | "DEF" | "WAIT" | "PROC" => problem.help("branches, loops and calls are not supported: unroll the program"),
        "CIP" | "CT" => problem.help("write the arc with `G2` or `G3` and its centre (`I J K`) or radius"),
        "TRANS" | "ATRANS" | "ROT" | "AROT" | "SCALE" | "ASCALE" | "MIRROR" | "AMIRROR" => {
            problem.help("the coordinate system cannot be changed: write the program in the part's coordinates")
        }
        "TRAORI" | "ORICURVE" => problem.help("five-axis motion is not supported"),
        "COMPON" | "COMPCURV" | "COMPCAD" | "COMPSURF" => {
            problem.help("the compressor changes the path in a way that only the control knows: remove the word")
        }
        "MSG" => problem.help("write the message as a comment: `; text`"),
        _ => problem.help("a word is a letter and a number; a comment is written in `( )` or after `;`"),
    }
}
