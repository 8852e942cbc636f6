//! Look-ahead: a stream of pieces to a stream of motions.
//!
//! A program comes as pieces of path, each with a feed limit and a limit at its joint with the piece before. Pieces that
//! can be passed at one feed are one *stretch*, along which the speed is free to change; at the joints between stretches
//! the acceleration is 0. From the far end back (`v_i = min(limit_i, reach(v_{i+1}, L_i))`) and then forward the speeds at the joints follow, and
//! between them each stretch is a [`Span`].
//!
//! **What is settled.** A joint that can be passed at its limit even if the last piece known were the program's end does not depend
//! on what follows: the spans before it go out. Results therefore do not depend on how far ahead was looked, and memory holds
//! what a stop from the programmed feed takes.

use crate::parameters::OutOfRange;
use std::collections::VecDeque;

use super::span::{Bounds, Span};
use super::{FeedrateError, positive};

/// Most pieces that are looked at ahead. Where as many are not enough to stop on (pieces of nanometres), the motion is that of a
/// program that ends there, until more is known.
pub const MAX_LOOK_AHEAD: usize = 100_000;

/// Neighbours whose limits differ by no more than this ratio become one stretch where none of them reaches its programmed
/// feed: the lost speed is less than what it costs to have no acceleration at every joint.
const NEARLY: f64 = 1.1;

/// A piece of path as the planner sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPiece {
    /// Its length \[mm\], positive.
    pub length_mm: f64,
    /// The feed that was asked for \[mm/s\].
    pub feed_mm_s: f64,
    /// The highest speed that its shape allows \[mm/s\]; infinite for a straight one.
    pub limit_mm_s: f64,
    /// The highest speed at its start \[mm/s\]: 0 stops there, infinite is a smooth joint.
    pub joint_mm_s: f64,
    /// How long to stand still before it \[s\].
    pub pause_s: f64,
}

/// A run of pieces at one feed.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    pieces: usize,
    length: f64,
    /// Limit along it.
    feed: f64,
    /// Limit at its start, that of the stretch before included.
    joint: f64,
    pause: f64,
    /// The highest speed that any part of it can reach.
    top: f64,
    /// Whether that is the feed that was asked for.
    wanted: bool,
}

/// The planner: pieces in, spans out.
///
/// The motion starts and ends at rest. Feed, acceleration and jerk limits are never exceeded; the distance covered is exactly
/// that of the pieces.
///
/// ```
/// use servosim::feedrate::{LookAhead, PathPiece};
///
/// let mut planner = LookAhead::new(2000.0, 30_000.0)?;
/// let smooth = f64::INFINITY;
/// for _ in 0..100 {
///     planner.push(PathPiece { length_mm: 1.0, feed_mm_s: 50.0, limit_mm_s: smooth, joint_mm_s: smooth, pause_s: 0.0 })?;
/// }
/// planner.finish();
/// let total: f64 = planner.map(|span| span.total_s()).sum();
/// // 100 mm at 50 mm/s, and the time of one of the ramps, which are too short for the acceleration limit: 2 √(V/j).
/// assert!((total - (2.0 + 2.0 * (50.0_f64 / 30_000.0).sqrt())).abs() < 1e-12);
/// # Ok::<(), servosim::feedrate::FeedrateError>(())
/// ```
#[derive(Debug, Clone)]
pub struct LookAhead {
    bounds: Bounds,
    most: usize,
    /// The stretch that still grows: its settled front, and what a stop takes behind it.
    body: Option<Stretch>,
    tail: Option<Stretch>,
    /// Whether a front part of the growing stretch has gone out.
    cut: bool,
    stretches: VecDeque<Stretch>,
    /// Pieces in all of them.
    held: usize,
    /// Speed at the start of the first stretch.
    speed: f64,
    /// How many stretches are worth the next look.
    next_look: usize,
    ready: VecDeque<Span>,
    /// Speeds at the joints; reused.
    speeds: Vec<f64>,
}

impl LookAhead {
    /// A planner with limits of acceleration \[mm/s²\] and jerk \[mm/s³\] along the path.
    ///
    /// # Errors
    /// A limit that is not between 1e-9 and 1e9.
    pub fn new(accel_mm_s2: f64, jerk_mm_s3: f64) -> Result<Self, FeedrateError> {
        let bounds = Bounds { accel: positive("accel_mm_s2", accel_mm_s2)?, jerk: positive("jerk_mm_s3", jerk_mm_s3)? };
        Ok(Self {
            bounds,
            most: MAX_LOOK_AHEAD,
            body: None,
            tail: None,
            cut: false,
            stretches: VecDeque::new(),
            held: 0,
            speed: 0.0,
            next_look: 1,
            ready: VecDeque::new(),
            speeds: Vec::new(),
        })
    }

    /// Looks at most this many pieces ahead (at least 1) instead of [`MAX_LOOK_AHEAD`].
    #[must_use]
    pub fn with_most_pieces(mut self, most: usize) -> Self {
        self.most = most.max(1);
        self
    }

    /// How many pieces are held: those whose motion is not settled yet.
    pub fn held(&self) -> usize {
        self.held
    }

    /// Whether spans are waiting to be taken.
    pub fn is_ready(&self) -> bool {
        !self.ready.is_empty()
    }

    /// Takes the next piece; spans may become ready by it.
    ///
    /// # Errors
    /// A length or feed that is not between 1e-9 and 1e9, a limit of the shape below 1e-9 or of the joint below 0, a pause that
    /// is not a time.
    pub fn push(&mut self, piece: PathPiece) -> Result<(), FeedrateError> {
        let out = |name, value, needed| Err(FeedrateError::OutOfRange(OutOfRange::new(name, value, needed)));
        let length = positive("length_mm", piece.length_mm)?;
        let asked = positive("feed_mm_s", piece.feed_mm_s)?;
        if !(piece.limit_mm_s >= 1e-9) {
            return out("limit_mm_s", piece.limit_mm_s, "1e-9 or more");
        }
        if !(piece.joint_mm_s >= 0.0) {
            return out("joint_mm_s", piece.joint_mm_s, "0 or more");
        }
        if !(piece.pause_s >= 0.0 && piece.pause_s <= 1e9) {
            return out("pause_s", piece.pause_s, "between 0 and 1e9");
        }
        let joint = if piece.pause_s > 0.0 { 0.0 } else { piece.joint_mm_s };
        let feed = asked.min(piece.limit_mm_s);
        // Nothing is faster at its start than what comes before, and the program begins at rest.
        let before = match (&self.tail, &self.body) {
            (Some(tail), _) if tail.pieces > 0 => tail.top,
            (_, None) if self.stretches.is_empty() => self.speed,
            _ => f64::INFINITY,
        };
        let top = feed.min(self.bounds.reach(joint.min(feed).min(before), length));
        let next = Stretch { pieces: 1, length, feed, joint, pause: piece.pause_s, top, wanted: top >= asked };
        self.held += 1;
        if !self.joined(&next) {
            self.close();
            self.tail = Some(next);
        }
        self.divide();
        if self.held > self.most {
            self.give_up_looking();
        }
        Ok(())
    }

    /// Adds a piece to the growing stretch, if it is one with it.
    fn joined(&mut self, next: &Stretch) -> bool {
        let Some(tail) = &mut self.tail else { return false };
        if next.feed == tail.feed && next.joint >= tail.feed {
            tail.pieces += next.pieces;
            tail.length += next.length;
            tail.top = tail.feed.min(self.bounds.reach(tail.joint.min(tail.feed), tail.length));
            tail.wanted |= next.wanted || tail.top >= tail.feed;
            return true;
        }
        // A stretch that is so long that its front part went out has a feed that cannot be changed any more.
        if self.cut || self.body.is_some() || tail.wanted || next.wanted {
            return false;
        }
        let feed = tail.feed.min(next.feed).min(next.joint);
        let top = tail.top.max(next.top);
        if !(top <= NEARLY * feed) {
            return false;
        }
        *tail = Stretch {
            pieces: tail.pieces + next.pieces,
            length: tail.length + next.length,
            feed,
            top,
            joint: tail.joint,
            pause: tail.pause,
            wanted: false,
        };
        true
    }

    /// Lets the front part of a long stretch go: what stays is enough to stop on, what goes enough to reach the feed.
    fn divide(&mut self) {
        let Some(tail) = &self.tail else { return };
        // A tenth more, because the steady reach is that much shorter than the exact one.
        let enough = 1.1 * self.bounds.distance(0.0, tail.feed);
        if tail.length < enough {
            return;
        }
        if let Some(tail) = self.tail.take() {
            // The rest of the stretch begins where nothing slows it.
            let rest = Stretch { pieces: 0, length: 0.0, joint: f64::INFINITY, pause: 0.0, ..tail };
            match &mut self.body {
                None => {
                    self.body = Some(tail);
                }
                Some(body) if body.length >= enough => {
                    let body = *body;
                    self.body = Some(tail);
                    self.cut = true;
                    self.add(body);
                }
                Some(body) => {
                    body.pieces += tail.pieces;
                    body.length += tail.length;
                }
            }
            self.tail = Some(rest);
        }
    }

    /// Ends the growing stretch.
    fn close(&mut self) {
        let whole = match (self.body.take(), self.tail.take()) {
            (Some(body), Some(tail)) => {
                Some(Stretch { pieces: body.pieces + tail.pieces, length: body.length + tail.length, ..body })
            }
            (body, tail) => body.or(tail),
        };
        self.cut = false;
        if let Some(whole) = whole
            && whole.pieces > 0
        {
            self.add(whole);
        }
    }

    /// A stretch is whole.
    fn add(&mut self, mut stretch: Stretch) {
        stretch.joint = stretch.joint.min(stretch.feed);
        if let Some(before) = self.stretches.back() {
            stretch.joint = stretch.joint.min(before.feed);
        }
        if self.stretches.is_empty() {
            // What went out before has left at this speed.
            stretch.joint = self.speed;
        }
        self.stretches.push_back(stretch);
        if self.stretches.len() >= self.next_look {
            self.look();
            self.next_look = 2 * self.stretches.len().max(1);
        }
    }

    /// Speeds at the starts of the stretches if the last one ended the program.
    fn look_back(&mut self) {
        self.speeds.clear();
        self.speeds.resize(self.stretches.len() + 1, 0.0);
        let mut speed = 0.0_f64;
        for (i, stretch) in self.stretches.iter().enumerate().rev() {
            speed = self.bounds.steady_reach(speed, stretch.length).min(stretch.joint);
            if let Some(entry) = self.speeds.get_mut(i) {
                *entry = speed;
            }
        }
    }

    /// Makes spans of the stretches before the last settled joint.
    fn look(&mut self) {
        self.look_back();
        let settled = (1..self.stretches.len())
            .rev()
            .find(|&i| self.stretches.get(i).zip(self.speeds.get(i)).is_some_and(|(s, v)| *v >= s.joint));
        if let Some(settled) = settled {
            self.go(settled);
        }
    }

    /// Makes spans of the first `count` stretches, with the speeds found.
    fn go(&mut self, count: usize) {
        for i in 0..count {
            let Some(stretch) = self.stretches.pop_front() else { break };
            let known = self.speeds.get(i + 1).copied().unwrap_or(0.0);
            let from = self.speed;
            let to = if known > from { known.min(self.bounds.reach(from, stretch.length)).max(from) } else { known };
            let mut span = Span::new(stretch.length, from, to, stretch.feed.max(from).max(to), self.bounds);
            span.pause_s = stretch.pause;
            self.ready.push_back(span);
            self.speed = to;
            self.held -= stretch.pieces;
        }
        if let Some(first) = self.stretches.front_mut() {
            first.joint = self.speed;
        }
    }

    /// More pieces than are held: half of the stretches go as if the program ended with the last.
    fn give_up_looking(&mut self) {
        self.close();
        self.look_back();
        self.go(self.stretches.len().div_ceil(2));
        self.next_look = 2 * self.stretches.len().max(1);
    }

    /// The program ends: the rest of its spans become ready, the last one comes to rest.
    pub fn finish(&mut self) {
        self.close();
        self.look_back();
        self.go(self.stretches.len());
        self.next_look = 1;
    }
}

impl Iterator for LookAhead {
    type Item = Span;

    /// The next span that is settled; none until more pieces are known.
    fn next(&mut self) -> Option<Span> {
        self.ready.pop_front()
    }
}
