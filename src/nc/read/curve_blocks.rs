//! The blocks of NURBS curves, in every dialect.

use std::collections::VecDeque;
use std::ops::{Range, RangeInclusive};

use super::block_words::{AXES, BlockWords, F, K, L, P, R, W};
use super::curve::{Curve, Point};
use super::g_codes::{Code, Codes};
use super::modal_state::{ModalState, Mode};
use super::reading::Reading;
use super::words::{Address, Word};
use crate::diagnostics::Diagnostic;
use crate::nc::{Action, Block, Dialect, MAX_DEGREE, Plane};

impl ModalState {
    /// A curve begins at a place that is known, at a feed that is known, with absolute coordinates.
    fn open(&mut self, curve: Curve, block_words: &BlockWords, axes: &[usize]) -> Result<(), Diagnostic> {
        self.need_feed(block_words)?;
        if let Some(&axis) = axes.iter().find(|&&axis| !self.known[axis]) {
            let letter = ['X', 'Y', 'Z'][axis];
            return Err(Diagnostic::new(format!("where axis {letter} is before this curve is not known"))
                .at(block_words.all())
                .help("move to the first control point of the curve before, in X, Y and Z"));
        }
        if !self.absolute {
            return Err(Diagnostic::new("a curve in incremental coordinates")
                .at(block_words.all())
                .help("write its control points in absolute coordinates (`G90`)"));
        }
        self.mode = Mode::None;
        self.curve = Some(curve);
        Ok(())
    }

    pub(super) fn open_siemens(&mut self, block_words: &mut BlockWords, line: usize) -> Result<(), Diagnostic> {
        let degree = whole(block_words.take(Address::Degree), 3, 2..=3, "a degree (`SD`) is 2 or 3")?;
        self.open(Curve::new(Dialect::Siemens, line, self.position_mm, degree), block_words, &[0, 1, 2])?;
        if block_words.any(&AXES) { self.siemens_point(block_words) } else { Ok(()) }
    }

    pub(super) fn open_fanuc(&mut self, block_words: &mut BlockWords, line: usize) -> Result<(), Diagnostic> {
        let order = whole(block_words.take(P), 4, 2..=4, "an order (`P`, degree plus one) is 2, 3 or 4")?;
        self.open(Curve::new(Dialect::Fanuc, line, self.position_mm, order - 1), block_words, &[0, 1, 2])?;
        self.fanuc_point(block_words)
    }

    pub(super) fn open_linuxcnc(
        &mut self,
        block_words: &mut BlockWords,
        line: usize,
        span: Range<usize>,
    ) -> Result<(), Diagnostic> {
        if self.plane != Plane::Xy {
            return Err(Diagnostic::new("`G5.2` is supported in the plane XY only")
                .at(span)
                .help("write `G17` before"));
        }
        let order = whole(block_words.take(L), 3, 3..=MAX_DEGREE + 1, "an order (`L`, degree plus one) is 3 to 10")?;
        self.open(Curve::new(Dialect::LinuxCnc, line, self.position_mm, order - 1), block_words, &[0, 1])?;
        let place_mm = self.position_mm;
        if block_words.any(&AXES) {
            self.curve_push(Point { place_mm, weight: 1.0, parameter: None })?;
            self.linuxcnc_point(block_words)
        } else {
            let weight = weight(block_words.take(P), Dialect::LinuxCnc)?;
            self.curve_push(Point { place_mm, weight, parameter: None })
        }
    }

    /// Takes a block of a curve. False where the curve was over before it.
    pub(super) fn continue_curve(
        &mut self,
        codes: &Codes,
        spline: Option<&Word>,
        block_words: &mut BlockWords,
        reading: &Reading,
        ready: &mut VecDeque<Block>,
    ) -> Result<bool, Diagnostic> {
        let Some(curve) = &self.curve else { return Ok(false) };
        let (dialect, line) = (curve.dialect, curve.line);
        if let Some(word) = spline {
            return Err(Diagnostic::new("`BSPLINE` inside a curve")
                .at(word.span())
                .note(format!("the curve begins on line {line}"))
                .help("end the curve before with a block `G1`"));
        }
        let closes = dialect == Dialect::LinuxCnc && matches!(codes.motion, Some((Code::CloseCurve, _)));
        if closes {
            self.end(reading.uniform_knots, ready)?;
        } else if dialect == Dialect::Siemens && (codes.ends || codes.motion.is_some()) {
            self.end(reading.uniform_knots, ready)?;
            return Ok(false);
        }
        let settles = codes.dwell || codes.plane.is_some() || codes.units_mm.is_some() || codes.absolute.is_some();
        if (codes.motion.is_some() && !closes) || settles || !codes.before.is_empty() || !codes.after.is_empty() {
            let end = match dialect {
                Dialect::Siemens => "end the curve before with a block `G1`",
                Dialect::Fanuc => "end the curve before with its blocks of `K` only",
                Dialect::LinuxCnc => "end the curve before with `G5.3`",
            };
            return Err(Diagnostic::new("this block is inside a curve")
                .at(block_words.all())
                .note(format!("the curve begins on line {line}"))
                .help(end));
        }
        if self.curve.is_none() {
            return Ok(true);
        }
        if curve_allows_feed(self.curve.as_ref()) {
            self.feed(block_words)?;
        } else if let Some(word) = block_words.peek(F) {
            return Err(Diagnostic::new("the feed changes inside a curve")
                .at(word.span())
                .help("one curve has one feed: write it into the block that begins the curve"));
        }
        match dialect {
            Dialect::Siemens => self.siemens_point(block_words)?,
            Dialect::Fanuc if block_words.any(&AXES) => self.fanuc_point(block_words)?,
            Dialect::Fanuc => self.fanuc_knot(block_words, reading, ready)?,
            Dialect::LinuxCnc => self.linuxcnc_point(block_words)?,
        }
        Ok(true)
    }

    /// The curve is over: its block.
    fn end(&mut self, uniform: bool, ready: &mut VecDeque<Block>) -> Result<(), Diagnostic> {
        let Some(curve) = self.curve.take() else { return Ok(()) };
        let (line, start_mm) = (curve.line, curve.start_mm);
        let end_mm = curve.place_mm();
        let action = Action::Nurbs(curve.finish(uniform)?);
        self.position_mm = end_mm;
        self.moved = true;
        ready.push_back(Block { line, start_mm, end_mm, feed_mm_min: self.feed_mm_min, action });
        Ok(())
    }

    /// The text is over, and with it a Siemens curve.
    pub(super) fn end_curve(&mut self, uniform: bool, ready: &mut VecDeque<Block>) -> Result<(), Diagnostic> {
        let Some(curve) = &self.curve else { return Ok(()) };
        let missing = match curve.dialect {
            Dialect::Siemens => return self.end(uniform, ready),
            Dialect::Fanuc => "the blocks of `K` only that end it are missing",
            Dialect::LinuxCnc => "`G5.3` is missing",
        };
        Err(Diagnostic::new(format!("the program ends inside a curve: {missing}"))
            .note(format!("the curve begins on line {}", curve.line))
            .help("complete the curve"))
    }

    fn curve_push(&mut self, point: Point) -> Result<(), Diagnostic> {
        self.curve.as_mut().map_or(Ok(()), |curve| curve.push(point))
    }

    /// The control point of a block; the axes that it leaves out stay.
    fn control_point(&self, block_words: &mut BlockWords) -> Result<[f64; 3], Diagnostic> {
        let place_mm = self.curve.as_ref().map_or(self.position_mm, Curve::place_mm);
        if !block_words.any(&AXES) {
            return Err(Diagnostic::new("the block has no control point")
                .at(block_words.all())
                .help("write its coordinates: `X Y Z`"));
        }
        Ok(self.target(block_words, place_mm)?.0)
    }

    /// `X Y Z PW= PL=`; of an older form `W` for `PW=`.
    fn siemens_point(&mut self, block_words: &mut BlockWords) -> Result<(), Diagnostic> {
        let place_mm = self.control_point(block_words)?;
        let word = block_words.take(Address::Weight).or_else(|| block_words.take(W));
        let weight = if word.is_some() { weight(word, Dialect::Siemens)? } else { 1.0 };
        let interval = block_words.take(Address::Interval);
        let parameter = interval.map(|word| word.value);
        self.curve_push(Point { place_mm, weight, parameter }).map_err(|problem| at(problem, interval))
    }

    /// `K X Y Z R`.
    fn fanuc_point(&mut self, block_words: &mut BlockWords) -> Result<(), Diagnostic> {
        if self.curve.as_ref().is_some_and(Curve::in_tail) {
            return Err(Diagnostic::new("a control point after the first block of `K` only")
                .at(block_words.all())
                .help("the control points come first, then as many blocks with `K` only as `P` says"));
        }
        let place_mm = self.control_point(block_words)?;
        let word = block_words.take(R);
        let weight = if word.is_some() { weight(word, Dialect::Fanuc)? } else { 1.0 };
        let knot = knot(block_words)?;
        let parameter = Some(knot.value);
        self.curve_push(Point { place_mm, weight, parameter }).map_err(|problem| at(problem, Some(knot)))
    }

    fn fanuc_knot(
        &mut self,
        block_words: &mut BlockWords,
        reading: &Reading,
        ready: &mut VecDeque<Block>,
    ) -> Result<(), Diagnostic> {
        let knot = knot(block_words)?;
        if let Some(curve) = &mut self.curve {
            curve.push_knot(knot.value).map_err(|problem| at(problem, Some(knot)))?;
            if curve.is_whole() {
                self.end(reading.uniform_knots, ready)?;
            }
        }
        Ok(())
    }

    /// `X Y P`.
    fn linuxcnc_point(&mut self, block_words: &mut BlockWords) -> Result<(), Diagnostic> {
        if block_words.peek(AXES[0]).is_none() || block_words.peek(AXES[1]).is_none() {
            return Err(Diagnostic::new("a control point needs both X and Y")
                .at(block_words.all())
                .help("write the control point as `X1.5 Y2 P1`, or end the curve with `G5.3`"));
        }
        if let Some(word) = block_words.peek(AXES[2]) {
            return Err(Diagnostic::new("a curve of `G5.2` lies in a plane").at(word.span()).help("remove Z"));
        }
        let place_mm = self.control_point(block_words)?;
        let weight = weight(block_words.take(P), Dialect::LinuxCnc).map_err(|problem| at(problem, None))?;
        self.curve_push(Point { place_mm, weight, parameter: None })
    }
}

/// Whether the feed may still be given: before the first control point, but not between `G5.2` and `G5.3`.
fn curve_allows_feed(curve: Option<&Curve>) -> bool {
    curve.is_some_and(Curve::is_empty)
}

/// The problem at a word, where it has no place of its own.
fn at(problem: Diagnostic, word: Option<&Word>) -> Diagnostic {
    match (problem.span.is_none(), word) {
        (true, Some(word)) => problem.at(word.span()),
        _ => problem,
    }
}

/// The knot of a Fanuc block.
fn knot<'a>(block_words: &mut BlockWords<'a>) -> Result<&'a Word, Diagnostic> {
    let whole = block_words.all();
    block_words.take(K).ok_or_else(|| {
        Diagnostic::new("the block has no knot (`K`)")
            .at(whole)
            .help("a knot with every control point, then as many blocks with `K` only as `P` says")
    })
}

/// A weight: above 0, and at most what the dialect takes.
fn weight(word: Option<&Word>, dialect: Dialect) -> Result<f64, Diagnostic> {
    let most = dialect.max_weight();
    let Some(word) = word else {
        return Err(Diagnostic::new("the control point has no weight (`P`)").help("write its weight, such as `P1`"));
    };
    if word.value > 0.0 && word.value <= most {
        return Ok(word.value);
    }
    Err(Diagnostic::new(format!("a weight of {} is out of range", word.value))
        .at(word.span())
        .help(format!("above 0, at most {most} ({})", dialect.name())))
}

/// A whole number in a range, or what is taken where it is left out.
fn whole(word: Option<&Word>, default: usize, range: RangeInclusive<usize>, help: &str) -> Result<usize, Diagnostic> {
    let Some(word) = word else { return Ok(default) };
    range
        .into_iter()
        .find(|&n| n as f64 == word.value)
        .ok_or_else(|| Diagnostic::new(format!("{} is out of range", word.value)).at(word.span()).help(help))
}
