//! Blocks to a program's text.

use super::writing::Writing;
use std::io::Write;

use super::error::WriteError;
use super::fixed::Fixed;
use super::plan::{Plan, Shape, fixed_time};
use crate::nc::intervals::knot_of_block;
use crate::nc::read::Codes;
use crate::nc::read::Words;
use crate::nc::{Action, Block, Dialect, MAX_DWELL_S, MAX_LINE_BYTES, Plane};

/// What has been written.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Written {
    /// Blocks taken.
    pub blocks: usize,
    /// Lines of text.
    pub lines: usize,
    /// NURBS curves.
    pub curves: usize,
    /// Their control points.
    pub control_points: usize,
    /// Straight blocks at the feed.
    pub straight: usize,
    /// Rapid motions.
    pub rapid: usize,
    /// Upper bound of what rounding moves any point of the path \[mm\].
    pub rounding_mm: f64,
}

/// Writes a program block by block. Memory holds one block.
#[derive(Debug)]
pub struct Writer<W> {
    out: W,
    writing: Writing,
    position: Option<[Fixed; 3]>,
    feed: Option<Fixed>,
    /// The motion code in force.
    mode: Option<u8>,
    plane: Plane,
    /// Whether units and planes have been said.
    set: bool,
    ended: bool,
    number: u64,
    line: Vec<u8>,
    words: Words,
    written: Written,
}

impl<W: Write> Writer<W> {
    /// Begins a program. A buffered `out` is quicker.
    ///
    /// # Errors
    /// [`WriteError::Write`].
    pub fn new(out: W, writing: Writing) -> Result<Self, WriteError> {
        let mut writer = Self {
            out,
            writing,
            position: None,
            feed: None,
            mode: None,
            plane: Plane::Xy,
            set: false,
            ended: false,
            number: 0,
            line: Vec::new(),
            words: Words::default(),
            written: Written::default(),
        };
        writer.mark()?;
        Ok(writer)
    }

    /// Writes a block; returns the upper bound of what rounding moves the tool in it \[mm\].
    ///
    /// # Errors
    /// The block cannot be written in the dialect, does not join the one before, or rounding moves it by more than the
    /// tolerance. It has not been written then, not in part.
    pub fn write(&mut self, block: &Block) -> Result<f64, WriteError> {
        let index = self.written.blocks;
        if self.ended && !matches!(block.action, Action::Comment(_)) {
            return Err(WriteError::Ended { index });
        }
        let mut error_mm = 0.0;
        match &block.action {
            Action::Comment(text) => self.comment(text, index)?,
            Action::Auxiliary(text) => self.auxiliary(text, index)?,
            Action::Dwell { time_s } => self.dwell(*time_s, index)?,
            _ => {
                if let Some(plan) = Plan::of(block, index, self.position, &self.writing)? {
                    error_mm = plan.parts.total_mm();
                    if !(error_mm <= self.writing.tolerance_mm) {
                        return Err(plan.too_coarse(index, &self.writing));
                    }
                    self.motion(&plan)?;
                }
            }
        }
        self.written.blocks += 1;
        self.written.rounding_mm = self.written.rounding_mm.max(error_mm);
        Ok(error_mm)
    }

    /// Ends the program.
    ///
    /// # Errors
    /// [`WriteError::Write`].
    pub fn finish(mut self) -> Result<Written, WriteError> {
        if !self.ended {
            self.line.extend(b"M30");
            self.end_line()?;
        }
        self.mark()?;
        self.out.flush()?;
        Ok(self.written)
    }

    fn mark(&mut self) -> Result<(), WriteError> {
        if self.writing.dialect != Dialect::Siemens {
            self.out.write_all(b"%\n")?;
            self.written.lines += 1;
        }
        Ok(())
    }

    /// Ends the line, which becomes one of the program.
    fn end_line(&mut self) -> Result<(), WriteError> {
        if let Some(step) = self.writing.number_step {
            // A program's name has no number.
            if !self.line.starts_with(b"O") {
                self.number += u64::from(step);
                write!(self.out, "N{} ", self.number)?;
            }
        }
        self.line.push(b'\n');
        self.out.write_all(&self.line)?;
        self.line.clear();
        self.written.lines += 1;
        Ok(())
    }

    fn comment(&mut self, text: &str, index: usize) -> Result<(), WriteError> {
        if text.len() > MAX_LINE_BYTES / 2 {
            let text = text.chars().take(40).collect();
            return Err(WriteError::Words { index, text, why: "… is too long for one line: split the comment" });
        }
        let plain: String = text
            .chars()
            .map(|c| match c {
                '(' => '[',
                ')' => ']',
                c if c.is_control() => ' ',
                c => c,
            })
            .collect();
        match self.writing.dialect {
            Dialect::Siemens => write!(self.line, "; {}", plain.trim())?,
            _ => write!(self.line, "({})", plain.trim())?,
        }
        self.end_line()
    }

    /// Words are written as they are when a reader takes them for words that move nothing.
    fn auxiliary(&mut self, text: &str, index: usize) -> Result<(), WriteError> {
        let refused = |why| WriteError::Words { index, text: crate::diagnostics::brief(text), why };
        let unknown = refused("is not known to move nothing: write the motion as a block of its own");
        if self.words.cut(text).is_err() || self.words.mark || self.words.deletable || !self.words.comments.is_empty() {
            return Err(unknown);
        }
        let Ok(codes) = Codes::of(&self.words, text) else { return Err(unknown) };
        if self.words.list.iter().any(|word| codes.used & word.address.bit() == 0) {
            return Err(unknown);
        }
        if codes.before != text && codes.after != text {
            return Err(refused("is not in the order in which a control acts: write each word in a block of its own"));
        }
        self.line.extend(text.as_bytes());
        self.ended |= codes.ends;
        self.end_line()
    }

    fn dwell(&mut self, time_s: f64, index: usize) -> Result<(), WriteError> {
        if !(0.0..=MAX_DWELL_S).contains(&time_s) {
            return Err(WriteError::Dwell { index, time_s });
        }
        self.set()?;
        self.line.extend(match self.writing.dialect {
            Dialect::Siemens => b"G4 F".as_slice(),
            Dialect::Fanuc => b"G04 X",
            Dialect::LinuxCnc => b"G4 P",
        });
        fixed_time(time_s).write(&mut self.line)?;
        self.end_line()
    }

    /// Says units, plane and absolute coordinates, once, before the first motion.
    fn set(&mut self) -> Result<(), WriteError> {
        if self.set {
            return Ok(());
        }
        self.set = true;
        self.line.extend(match self.writing.dialect {
            Dialect::Siemens => b"G90 G71 G17".as_slice(),
            _ => b"G90 G21 G17",
        });
        self.end_line()
    }

    fn motion(&mut self, plan: &Plan) -> Result<(), WriteError> {
        self.set()?;
        if self.position.is_none() && !matches!(plan.shape, Shape::Rapid) {
            self.mode(0);
            self.axes(None, plan.start)?;
            self.end_line()?;
            self.position = Some(plan.start);
        }
        match &plan.shape {
            Shape::Rapid => {
                self.written.rapid += 1;
                self.mode(0);
                self.axes(self.position, plan.end)?;
                self.end_line()?;
            }
            Shape::Linear => {
                self.written.straight += 1;
                self.mode(1);
                self.axes(self.position, plan.end)?;
                self.feed(plan.feed)?;
                self.end_line()?;
            }
            Shape::Arc(arc, offset) => {
                if self.plane != arc.plane {
                    self.plane = arc.plane;
                    self.line.extend(match arc.plane {
                        Plane::Xy => b"G17".as_slice(),
                        Plane::Zx => b"G18",
                        Plane::Yz => b"G19",
                    });
                }
                self.mode(if arc.clockwise { 2 } else { 3 });
                if plan.end != plan.start {
                    self.axes(self.position, plan.end)?;
                }
                for axis in [0, 1, 2] {
                    if axis != arc.plane.axes()[2] {
                        self.number([b'I', b'J', b'K'][axis], offset[axis])?;
                    }
                }
                self.feed(plan.feed)?;
                self.end_line()?;
            }
            Shape::Nurbs { degree, points, weights, knots } => {
                self.written.curves += 1;
                self.written.control_points += points.len();
                match self.writing.dialect {
                    Dialect::Siemens => self.siemens(*degree, points, weights, knots, plan.feed)?,
                    Dialect::Fanuc => self.fanuc(*degree, points, weights, knots, plan.feed)?,
                    Dialect::LinuxCnc => self.linuxcnc(*degree, points, weights, plan.feed)?,
                }
            }
        }
        self.position = Some(plan.end);
        Ok(())
    }

    /// The motion code, where it is not in force.
    fn mode(&mut self, code: u8) {
        if self.mode == Some(code) {
            return;
        }
        self.mode = Some(code);
        if !self.line.is_empty() {
            self.line.push(b' ');
        }
        self.line.push(b'G');
        if self.writing.dialect == Dialect::Fanuc {
            self.line.push(b'0');
        }
        self.line.push(b'0' + code);
    }

    /// A word, after a space where it is not the first.
    fn number(&mut self, letter: u8, number: Fixed) -> Result<(), WriteError> {
        if !self.line.is_empty() {
            self.line.push(b' ');
        }
        self.line.push(letter);
        Ok(number.write(&mut self.line)?)
    }

    /// The axes that move, or X where none does.
    fn axes(&mut self, from: Option<[Fixed; 3]>, to: [Fixed; 3]) -> Result<(), WriteError> {
        let still = from == Some(to);
        for axis in [0, 1, 2] {
            if from.is_none_or(|from| from[axis] != to[axis]) || (still && axis == 0) {
                self.number([b'X', b'Y', b'Z'][axis], to[axis])?;
            }
        }
        Ok(())
    }

    fn feed(&mut self, feed: Option<Fixed>) -> Result<(), WriteError> {
        if let Some(number) = feed.filter(|_| feed != self.feed) {
            self.feed = feed;
            self.line.extend(b" F");
            number.write_short(&mut self.line)?;
        }
        Ok(())
    }

    /// `BSPLINE SD=3`, then `X Y Z PW= PL=` a control point, then `G1`, which ends the curve.
    fn siemens(
        &mut self,
        degree: usize,
        points: &[[Fixed; 3]],
        weights: &[Fixed],
        knots: &[Fixed],
        feed: Option<Fixed>,
    ) -> Result<(), WriteError> {
        write!(self.line, "BSPLINE SD={degree}")?;
        self.feed(feed)?;
        self.end_line()?;
        for (block, (&point, &weight)) in points.iter().zip(weights).enumerate() {
            self.axes(None, point)?;
            if weight.value() != 1.0 {
                self.line.extend(b" PW=");
                weight.write(&mut self.line)?;
            }
            self.line.extend(b" PL=");
            match knot_of_block(degree, points.len(), block) {
                Some(knot) => knots[knot].minus(knots[knot - 1]).write(&mut self.line)?,
                None => self.line.push(b'0'),
            }
            self.end_line()?;
        }
        self.mode = None;
        self.mode(1);
        self.end_line()
    }

    /// `G06.2 P4 K X Y Z R`, then the knots that are left.
    fn fanuc(
        &mut self,
        degree: usize,
        points: &[[Fixed; 3]],
        weights: &[Fixed],
        knots: &[Fixed],
        feed: Option<Fixed>,
    ) -> Result<(), WriteError> {
        write!(self.line, "G06.2 P{}", degree + 1)?;
        for (index, &knot) in knots.iter().enumerate() {
            self.number(b'K', knot)?;
            if let (Some(&point), Some(&weight)) = (points.get(index), weights.get(index)) {
                self.axes(None, point)?;
                if weight.value() != 1.0 {
                    self.number(b'R', weight)?;
                }
            }
            if index == 0 {
                self.feed(feed)?;
            }
            self.end_line()?;
        }
        self.mode = None;
        Ok(())
    }

    /// `G5.2 P L4`, then `X Y P` a control point but the first, then `G5.3`.
    fn linuxcnc(
        &mut self,
        degree: usize,
        points: &[[Fixed; 3]],
        weights: &[Fixed],
        feed: Option<Fixed>,
    ) -> Result<(), WriteError> {
        if self.plane != Plane::Xy {
            self.plane = Plane::Xy;
            self.line.extend(b"G17");
            self.end_line()?;
        }
        self.line.extend(b"G5.2");
        for (index, (&[x, y, _], &weight)) in points.iter().zip(weights).enumerate() {
            if index > 0 {
                self.number(b'X', x)?;
                self.number(b'Y', y)?;
            }
            self.number(b'P', weight)?;
            if index == 0 {
                write!(self.line, " L{}", degree + 1)?;
                self.feed(feed)?;
            }
            self.end_line()?;
        }
        self.line.extend(b"G5.3");
        self.mode = None;
        self.end_line()
    }
}
