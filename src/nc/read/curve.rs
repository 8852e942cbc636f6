//! NURBS curves gathered from the blocks of a program.

use crate::diagnostics::Diagnostic;
use crate::nc::arc::distance;
use crate::nc::intervals::{knots, uniform_knots};
use crate::nc::{Dialect, JOIN_TOLERANCE_MM, MAX_CONTROL_POINTS, MAX_KNOT, Nurbs, NurbsFault};

/// A curve whose blocks are still coming.
#[derive(Debug)]
pub(super) struct Curve {
    pub(super) dialect: Dialect,
    /// Line that it begins on.
    pub(super) line: usize,
    /// Where the tool was \[mm\].
    pub(super) start_mm: [f64; 3],
    pub(super) degree: usize,
    points_mm: Vec<[f64; 3]>,
    weights: Vec<f64>,
    /// Siemens: the interval of each block. Fanuc: the knots.
    parameters: Vec<Option<f64>>,
}

/// A control point as a block gives it.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) place_mm: [f64; 3],
    pub(super) weight: f64,
    /// `PL`, `K`.
    pub(super) parameter: Option<f64>,
}

impl Curve {
    pub(super) fn new(dialect: Dialect, line: usize, start_mm: [f64; 3], degree: usize) -> Self {
        let (points_mm, weights, parameters) = (Vec::new(), Vec::new(), Vec::new());
        Self { dialect, line, start_mm, degree, points_mm, weights, parameters }
    }

    /// The tool's place after the blocks so far: what axes that a block leaves out keep.
    pub(super) fn place_mm(&self) -> [f64; 3] {
        self.points_mm.last().copied().unwrap_or(self.start_mm)
    }

    /// Whether no control point has come yet.
    pub(super) fn is_empty(&self) -> bool {
        self.points_mm.is_empty()
    }

    /// Whether all knots that a Fanuc curve needs are there.
    pub(super) fn is_whole(&self) -> bool {
        self.parameters.len() > self.points_mm.len() + self.degree
    }

    /// Whether a Fanuc curve has had a block with a knot only: no point may follow.
    pub(super) fn in_tail(&self) -> bool {
        self.parameters.len() > self.points_mm.len()
    }

    /// Takes a control point.
    pub(super) fn push(&mut self, point: Point) -> Result<(), Diagnostic> {
        if self.points_mm.len() >= MAX_CONTROL_POINTS {
            return Err(Diagnostic::new(NurbsFault::TooManyPoints { given: self.points_mm.len() + 1 }.to_string())
                .help("split the curve"));
        }
        if self.points_mm.is_empty() {
            self.first(&point)?;
        }
        if let Some(parameter) = point.parameter {
            self.check_parameter(parameter)?;
        }
        self.points_mm.push(point.place_mm);
        self.weights.push(point.weight);
        self.parameters.push(point.parameter);
        Ok(())
    }

    /// Whether a curve begins where the tool is. A Siemens curve may leave its first control point out: the tool's place.
    fn first(&mut self, point: &Point) -> Result<(), Diagnostic> {
        let gap_mm = distance(self.start_mm, point.place_mm);
        let neglected = match (self.dialect, point.parameter) {
            (Dialect::LinuxCnc, _) => true,
            (Dialect::Fanuc, _) => false,
            (Dialect::Siemens, Some(interval)) => interval != 0.0,
            (Dialect::Siemens, None) => gap_mm > JOIN_TOLERANCE_MM,
        };
        if neglected {
            // LinuxCNC: the point is the tool's place itself, with a weight of its own.
            if self.dialect == Dialect::Siemens {
                self.points_mm.push(self.start_mm);
                self.weights.push(1.0);
                self.parameters.push(None);
            }
        } else if !(gap_mm <= JOIN_TOLERANCE_MM) {
            return Err(Diagnostic::new(format!("the curve begins {gap_mm:.4} mm away from the tool"))
                .help(format!("move to its first control point before (within {JOIN_TOLERANCE_MM} mm)")));
        }
        Ok(())
    }

    /// Takes a knot without a point (Fanuc).
    pub(super) fn push_knot(&mut self, knot: f64) -> Result<(), Diagnostic> {
        self.check_parameter(knot)?;
        self.parameters.push(Some(knot));
        Ok(())
    }

    fn check_parameter(&self, value: f64) -> Result<(), Diagnostic> {
        if !(value.abs() <= MAX_KNOT) {
            return Err(
                Diagnostic::new(format!("a knot of {value} is out of range")).help(format!("at most {MAX_KNOT}"))
            );
        }
        match self.dialect {
            Dialect::Siemens if value < 0.0 => {
                Err(Diagnostic::new(format!("an interval of {value}: the knots would decrease"))
                    .help("`PL` is 0 or more"))
            }
            Dialect::Fanuc => match self.parameters.last() {
                Some(&Some(before)) if value < before => {
                    Err(Diagnostic::new(format!("knot {value} is less than the {before} before it"))
                        .help("knots must not decrease"))
                }
                _ => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// The curve, when all its blocks are there. `uniform` spaces knots evenly where the program gives none.
    pub(super) fn finish(self, uniform: bool) -> Result<Nurbs, Diagnostic> {
        let (degree, points, line) = (self.degree, self.points_mm.len(), self.line);
        let begins = |problem: Diagnostic| problem.note(format!("the curve begins on line {line}"));
        if points <= degree {
            return Err(begins(
                Diagnostic::new(format!(
                    "the curve is not whole: {}",
                    NurbsFault::TooFewPoints { given: points, degree }
                ))
                .help("add control points or lower the degree"),
            ));
        }
        let knots = match self.dialect {
            Dialect::LinuxCnc => uniform_knots(degree, points),
            Dialect::Fanuc => self.parameters.into_iter().flatten().collect(),
            Dialect::Siemens => siemens_knots(degree, &self.parameters, uniform).map_err(begins)?,
        };
        let curve = Nurbs { degree, knots, weights: self.weights, control_points_mm: self.points_mm };
        match curve.check() {
            Ok(()) => Ok(curve),
            Err(fault) => Err(begins(Diagnostic::new(format!("this is no curve: {fault}")).help(help(&fault)))),
        }
    }
}

fn help(fault: &NurbsFault) -> &'static str {
    match fault {
        NurbsFault::Knots { .. } => {
            "a knot (`K`) with every control point, then as many blocks with `K` only as `P` says"
        }
        NurbsFault::NotClamped { .. } | NurbsFault::NoExtent => {
            "the first and the last knots are repeated, one time more than the degree"
        }
        NurbsFault::Gap { .. } => "split the curve there",
        _ => "mend the curve",
    }
}

fn siemens_knots(degree: usize, intervals: &[Option<f64>], uniform: bool) -> Result<Vec<f64>, Diagnostic> {
    let points = intervals.len();
    // The first is 0, said or not.
    if intervals.iter().skip(1).all(Option::is_none) {
        return if uniform {
            Ok(uniform_knots(degree, points))
        } else {
            Err(Diagnostic::new("the curve has no `PL`: how the control spaces its knots is not known")
                .help("write `PL=` with every control point, or have the knots taken as uniform"))
        };
    }
    for (block, interval) in intervals.iter().enumerate() {
        let carries = crate::nc::intervals::knot_of_block(degree, points, block).is_some();
        if carries && interval.is_none() {
            return Err(Diagnostic::new(format!("control point {block} (counted from 0) of the curve has no `PL`"))
                .help("write `PL=` with every control point, or with none"));
        }
        if !carries && interval.is_some_and(|length| length != 0.0) {
            let length = interval.unwrap_or_default();
            return Err(Diagnostic::new(format!(
                "control point {block} (counted from 0) of the curve has `PL={length}`"
            ))
            .note("`PL` is read as the knot interval that ends at the block's point")
            .help("the first control point and the last ones (degree - 1 of them) have `PL=0`"));
        }
    }
    let intervals: Vec<f64> = intervals.iter().map(|length| length.unwrap_or_default()).collect();
    Ok(knots(degree, &intervals))
}
