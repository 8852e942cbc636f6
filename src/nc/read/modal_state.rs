//! What holds from block to block, and the motions that follow from it.

use std::collections::VecDeque;

use super::block_words::{AXES, BlockWords, F, OFFSETS, P, R, S};
use super::curve::Curve;
use super::g_codes::{Code, Codes};
use super::reading::Reading;
use super::words::{Address, Word};
use crate::diagnostics::{Diagnostic, brief};
use crate::nc::arc::ArcFault;
use crate::nc::{
    Action, Arc, Block, Dialect, JOIN_TOLERANCE_MM, MAX_COORDINATE_MM, MAX_DWELL_S, MAX_FEED_MM_MIN, Plane,
};

/// Which motion a block without a motion code continues.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mode {
    None,
    Rapid,
    Linear,
    Arc { clockwise: bool },
}

/// What holds from block to block.
#[allow(clippy::struct_excessive_bools)] // independent metadata, each with its name
#[derive(Debug)]
pub(super) struct ModalState {
    pub(super) mode: Mode,
    pub(super) position_mm: [f64; 3],
    /// Which axes have been given a place.
    pub(super) known: [bool; 3],
    pub(super) feed_mm_min: Option<f64>,
    pub(super) plane: Plane,
    pub(super) units_mm: f64,
    pub(super) absolute: bool,
    pub(super) offset: Option<u32>,
    pub(super) curve: Option<Curve>,
    /// Whether anything but comments has come.
    pub(super) begun: bool,
    /// Whether the program has ended.
    pub(super) ended: bool,
    pub(super) moved: bool,
}

impl ModalState {
    /// Before the program.
    pub(super) fn new(start_mm: Option<[f64; 3]>) -> Self {
        Self {
            mode: Mode::None,
            position_mm: start_mm.unwrap_or_default(),
            known: [start_mm.is_some(); 3],
            feed_mm_min: None,
            plane: Plane::Xy,
            units_mm: 1.0,
            absolute: true,
            offset: None,
            curve: None,
            begun: false,
            ended: false,
            moved: false,
        }
    }

    /// A block in which nothing moves.
    pub(super) fn still(&self, line: usize, action: Action) -> Block {
        let (start_mm, end_mm) = (self.position_mm, self.position_mm);
        Block { line, start_mm, end_mm, feed_mm_min: self.feed_mm_min, action }
    }

    pub(super) fn block(
        &mut self,
        codes: &Codes,
        block_words: &mut BlockWords,
        line: usize,
        reading: &Reading,
        ready: &mut VecDeque<Block>,
    ) -> Result<(), Diagnostic> {
        let spline = block_words.take(Address::Bspline);
        if self.curve.is_some() && self.continue_curve(codes, spline, block_words, reading, ready)? {
            return block_words.finish();
        }
        self.set(codes, block_words)?;
        if !codes.before.is_empty() {
            ready.push_back(self.still(line, Action::Auxiliary(codes.before.clone())));
        }
        if codes.dwell {
            let time_s = dwell_s(block_words, reading.dialect)?;
            ready.push_back(self.still(line, Action::Dwell { time_s }));
        }
        self.feed(block_words)?;
        match (codes.motion, spline) {
            (Some((_, index)), Some(_)) => {
                let span = block_words.words.get(index).map_or(0..0, Word::span);
                return Err(Diagnostic::new("a motion code and `BSPLINE` in one block")
                    .at(span)
                    .help("write `BSPLINE` without it"));
            }
            (None, Some(_)) => self.open_siemens(block_words, line)?,
            (Some((code @ (Code::FanucCurve | Code::OpenCurve | Code::CloseCurve), index)), None) => {
                let span = block_words.words.get(index).map_or(0..0, Word::span);
                match code {
                    Code::FanucCurve => self.open_fanuc(block_words, line)?,
                    Code::OpenCurve => self.open_linuxcnc(block_words, line, span)?,
                    _ => {
                        return Err(Diagnostic::new("`G5.3` ends no curve")
                            .at(span)
                            .help("a curve begins with `G5.2`"));
                    }
                }
            }
            (motion, None) => {
                match motion {
                    Some((Code::Rapid, _)) => self.mode = Mode::Rapid,
                    Some((Code::Linear, _)) => self.mode = Mode::Linear,
                    Some((Code::Arc { clockwise }, _)) => self.mode = Mode::Arc { clockwise },
                    _ => {}
                }
                if !codes.dwell {
                    ready.extend(self.motion(block_words, line)?);
                }
            }
        }
        block_words.finish()?;
        if !codes.after.is_empty() {
            if let (true, Some(curve)) = (codes.ends, &self.curve) {
                return Err(Diagnostic::new("the program ends in the block that begins a curve")
                    .note(format!("the curve begins on line {}", curve.line)));
            }
            ready.push_back(self.still(line, Action::Auxiliary(codes.after.clone())));
        }
        self.ended |= codes.ends;
        Ok(())
    }

    /// Units, plane, distance mode, work offset.
    pub(super) fn set(&mut self, codes: &Codes, block_words: &BlockWords) -> Result<(), Diagnostic> {
        self.units_mm = codes.units_mm.unwrap_or(self.units_mm);
        self.plane = codes.plane.unwrap_or(self.plane);
        self.absolute = codes.absolute.unwrap_or(self.absolute);
        if let Some((offset, index)) = codes.offset {
            if self.moved && self.offset.unwrap_or(54) != offset {
                let span = block_words.words.get(index).map_or(0..0, Word::span);
                return Err(Diagnostic::new(format!(
                    "`G{offset}` changes the work offset in the middle of the program"
                ))
                .at(span)
                .help("how the offsets lie to each other is not known: write one program for each"));
            }
            self.offset = Some(offset);
        }
        Ok(())
    }

    pub(super) fn feed(&mut self, block_words: &mut BlockWords) -> Result<(), Diagnostic> {
        if let Some(word) = block_words.take(F) {
            let feed = word.value * self.units_mm;
            if !(feed > 0.0 && feed <= MAX_FEED_MM_MIN) {
                return Err(Diagnostic::new(format!("a feed of {feed} mm/min is out of range"))
                    .at(word.span())
                    .help(format!("above 0, at most {MAX_FEED_MM_MIN} mm/min")));
            }
            self.feed_mm_min = Some(feed);
        }
        Ok(())
    }

    /// The feed is needed from here on.
    pub(super) fn need_feed(&self, block_words: &BlockWords) -> Result<(), Diagnostic> {
        match self.feed_mm_min {
            Some(_) => Ok(()),
            None => Err(Diagnostic::new("the feed is not given")
                .at(block_words.all())
                .label("moves at the feed")
                .help("write the feed in this block or before, such as `F1200` (mm/min)")),
        }
    }

    /// A place that has been given, moved by the axes of the block.
    pub(super) fn target(
        &self,
        block_words: &mut BlockWords,
        from_mm: [f64; 3],
    ) -> Result<([f64; 3], [bool; 3]), Diagnostic> {
        let (mut target_mm, mut named) = (from_mm, [false; 3]);
        for axis in 0..3 {
            let Some(word) = block_words.take(AXES[axis]) else { continue };
            named[axis] = true;
            let value = word.value * self.units_mm;
            if !self.absolute && !self.known[axis] {
                return Err(unknown_place(word, "is moved by a distance"));
            }
            target_mm[axis] = if self.absolute { value } else { from_mm[axis] + value };
            if !(target_mm[axis].abs() <= MAX_COORDINATE_MM) {
                let shown = brief(&word.text(block_words.text).to_ascii_uppercase());
                return Err(Diagnostic::new(format!("`{shown}` is out of range"))
                    .at(word.span())
                    .help(format!("coordinates are within ±{MAX_COORDINATE_MM} mm")));
            }
        }
        Ok((target_mm, named))
    }

    /// Every axis that moves at the feed has been given a place before.
    pub(super) fn need_place(&self, block_words: &BlockWords, named: [bool; 3]) -> Result<(), Diagnostic> {
        for axis in 0..3 {
            if named[axis]
                && !self.known[axis]
                && let Some(word) = block_words.words.iter().find(|word| word.address == AXES[axis])
            {
                return Err(unknown_place(word, "moves at the feed"));
            }
        }
        Ok(())
    }

    /// The motion of a block, if it has one.
    pub(super) fn motion(&mut self, block_words: &mut BlockWords, line: usize) -> Result<Option<Block>, Diagnostic> {
        let arc = matches!(self.mode, Mode::Arc { .. });
        if !block_words.any(&AXES) && !(arc && (block_words.any(&OFFSETS) || block_words.any(&[R, Address::Radius]))) {
            return Ok(None);
        }
        let start_mm = self.position_mm;
        let (end_mm, named) = self.target(block_words, start_mm)?;
        let action = match self.mode {
            Mode::None => {
                return Err(Diagnostic::new("no motion code is in force")
                    .at(block_words.all())
                    .label("how to move is not said")
                    .help(
                        "write `G0`, `G1`, `G2` or `G3` into this block or before (a curve ends the one before it)",
                    ));
            }
            Mode::Rapid => Action::Rapid,
            Mode::Linear => Action::Linear,
            Mode::Arc { clockwise } => Action::Arc(self.arc(clockwise, block_words, start_mm, end_mm)?),
        };
        if self.mode != Mode::Rapid {
            self.need_place(block_words, named)?;
            if let Action::Arc(arc) = &action {
                self.need_plane(arc.plane, block_words)?;
            }
            self.need_feed(block_words)?;
        }
        for (known, named) in self.known.iter_mut().zip(named) {
            *known |= named;
        }
        self.position_mm = end_mm;
        self.moved = true;
        Ok(Some(Block { line, start_mm, end_mm, feed_mm_min: self.feed_mm_min, action }))
    }

    /// Both axes of the plane have a place.
    pub(super) fn need_plane(&self, plane: Plane, block_words: &BlockWords) -> Result<(), Diagnostic> {
        match plane.axes()[..2].iter().find(|&&axis| !self.known[axis]) {
            None => Ok(()),
            Some(&axis) => {
                let letter = ['X', 'Y', 'Z'][axis];
                Err(Diagnostic::new(format!("where axis {letter} is before this block is not known"))
                    .at(block_words.all())
                    .help(format!("bring the tool to a place first, such as `G0 {letter}0`")))
            }
        }
    }

    pub(super) fn arc(
        &self,
        clockwise: bool,
        block_words: &mut BlockWords,
        start_mm: [f64; 3],
        end_mm: [f64; 3],
    ) -> Result<Arc, Diagnostic> {
        let whole = block_words.all();
        let radius = block_words.take(R).or_else(|| block_words.take(Address::Radius));
        let mut offset_mm = [0.0; 3];
        let mut centred = false;
        if radius.is_none() {
            for &axis in &self.plane.axes()[..2] {
                if let Some(word) = block_words.take(OFFSETS[axis]) {
                    (offset_mm[axis], centred) = (word.value * self.units_mm, true);
                }
            }
        }
        let arc = match radius {
            Some(word) => Arc::of_radius(self.plane, clockwise, start_mm, end_mm, word.value * self.units_mm),
            None if centred => Arc::around(self.plane, clockwise, start_mm, end_mm, offset_mm),
            None => {
                return Err(Diagnostic::new("the arc has neither centre nor radius")
                    .at(whole)
                    .help("write the centre as seen from the start point (`I J K`), or the radius (`R`)"));
            }
        };
        arc.map_err(|fault| arc_problem(fault).at(radius.map_or(whole, Word::span)))
    }
}

fn unknown_place(word: &Word, what: &str) -> Diagnostic {
    let letter = if let Address::Letter(letter) = word.address { char::from(letter) } else { '?' };
    Diagnostic::new(format!("where axis {letter} is before this block is not known"))
        .at(word.span())
        .label(what)
        .help(format!("bring the tool to a place first, such as `G0 {letter}0`"))
}

/// The time of a `G4`.
fn dwell_s(block_words: &mut BlockWords, dialect: Option<Dialect>) -> Result<f64, Diagnostic> {
    let whole = block_words.all();
    if let Some(word) = block_words.words.iter().find(|word| word.address == S) {
        return Err(Diagnostic::new("a dwell in turns of the spindle")
            .at(word.span())
            .help("write it in seconds: `G4 F1.5`"));
    }
    let Some(word) = block_words.take(P).or_else(|| block_words.take(AXES[0])).or_else(|| block_words.take(F)) else {
        return Err(Diagnostic::new("the dwell has no time").at(whole).help("write it in seconds, such as `G4 P1.5`"));
    };
    let unit_s = match (word.address, dialect) {
        (F, _) => 1.0,
        _ if word.point => 1.0,
        (P, Some(Dialect::LinuxCnc)) => 1.0,
        (_, Some(Dialect::Fanuc)) => 1e-3,
        _ => {
            return Err(Diagnostic::new("the unit of the dwell is not known")
                .at(word.span())
                .label("s on LinuxCNC, ms on Fanuc")
                .help("write it in seconds with a decimal point, such as `G4 P1.5`, or say which dialect this is"));
        }
    };
    let time_s = word.value * unit_s;
    if (0.0..=MAX_DWELL_S).contains(&time_s) {
        return Ok(time_s);
    }
    Err(Diagnostic::new(format!("a dwell of {time_s} s is out of range"))
        .at(word.span())
        .help(format!("0 to {MAX_DWELL_S} s")))
}

fn arc_problem(fault: ArcFault) -> Diagnostic {
    match fault {
        ArcFault::NoRadius => Diagnostic::new("the centre of the arc is its start point")
            .help("write the centre as seen from the start point (`I J K`)"),
        ArcFault::OffCircle { start_radius_mm, end_radius_mm } => Diagnostic::new(format!(
            "the end of the arc does not lie on its circle: it is {end_radius_mm:.4} mm from the centre, the start {start_radius_mm:.4} mm"
        ))
        .note(format!("the two may differ by {JOIN_TOLERANCE_MM} mm"))
        .help("the centre is written as seen from the start point (`I J K`); check the plane (`G17`, `G18`, `G19`) too"),
        ArcFault::SamePoint => Diagnostic::new("an arc of a radius that ends where it starts")
            .help("write a full circle with its centre: `G2 I… J…`"),
        ArcFault::TooSmall { radius_mm, chord_mm } => Diagnostic::new(format!(
            "no arc of radius {radius_mm} mm reaches the end point: it is {chord_mm:.4} mm away"
        ))
        .help(format!("the radius is at least half of that: {:.4} mm", 0.5 * chord_mm)),
    }
}
