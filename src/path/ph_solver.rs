//! The nonlinear system of the C2 PH quintic spline, solved by Newton with a tridiagonal Jacobian.
//!
//! With `w_i` from `z_{i-1}, z_i, z_{i+1}` (see [`PhSpline`](super::PhSpline)), passing through the nodal points means, for
//! `i = 1 … M`,
//!
//! ```text
//! 3 z_{i-1}² + 27 z_i² + 3 z_{i+1}² + z_{i-1} z_{i+1} + 13 z_{i-1} z_i + 13 z_i z_{i+1} = 60 (q_i - q_{i-1})
//! ```
//!
//! Clamped ends `(z_0 + z_1)² = 4 d_0` are used in their linear form `z_0 + z_1 = 2 √d_0`, the root's sign taken from the
//! first chord; closed ends are `z_0 = σ z_M`, `z_{M+1} = σ z_1` with `σ = -1` where the tangent turns an odd number of
//! times. The system has many real solutions; the start on the chords' square roots, each with the sign that turns by less
//! than a half turn, leads to the one that follows the polygon.

use super::PathError;
use super::bspline::{Ends, NodalPoints};
use super::ph_segment::{Point, complex};

/// Newton gives up after this many iterations.
const MAX_ITERATIONS: usize = 60;

/// A chord that turns back by more than this has no side to turn to \[rad\].
const LARGEST_TURN_RAD: f64 = std::f64::consts::PI - 1e-6;

/// What closes the system.
enum Closing {
    /// `z_0 + z_1` and `z_M + z_{M+1}`.
    Clamped(Point, Point),
    /// `σ`.
    Closed(f64),
}

/// `z_0 … z_{M+1}`.
pub(super) fn solve(nodal: &NodalPoints) -> Result<Vec<Point>, PathError> {
    let chords = chords(nodal)?;
    let (mut z, closing) = start(nodal, &chords);
    let scale = chords.iter().map(|c| c.norm_sqr().sqrt()).fold(0.0, f64::max);
    let mut system = System::new(&chords, &closing);
    let mut residual = system.residual(&z);
    let mut trial = z.clone();
    for iteration in 0..MAX_ITERATIONS {
        if residual.largest <= 1e-15 * scale {
            return Ok(z);
        }
        system.solve_step(&z);
        // A full step where it helps (it nearly always does), else half of it and so on.
        let mut share = 1.0;
        let after = loop {
            system.apply(&z, share, &mut trial);
            let after = system.residual(&trial);
            if after.sum < residual.sum || share < 1e-3 {
                break after;
            }
            share *= 0.5;
        };
        if !(after.sum < residual.sum) {
            // No step helps: rounding is reached, or the iteration is stuck.
            if residual.largest <= 1e-12 * scale {
                return Ok(z);
            }
            return Err(residual.stuck(iteration));
        }
        std::mem::swap(&mut z, &mut trial);
        residual = after;
    }
    if residual.largest <= 1e-12 * scale { Ok(z) } else { Err(residual.stuck(MAX_ITERATIONS)) }
}

/// `q_i - q_{i-1}`, none of them (nearly) zero, no two of them opposite.
fn chords(nodal: &NodalPoints) -> Result<Vec<Point>, PathError> {
    let chords: Vec<Point> = nodal.points.windows(2).map(|pair| complex(&(pair[1] - pair[0]))).collect();
    for (first, chord) in chords.iter().enumerate() {
        let distance_mm = chord.norm_sqr().sqrt();
        if distance_mm <= super::MIN_SEGMENT_MM {
            return Err(PathError::CoincidentPoints { first, second: first + 1, distance_mm });
        }
    }
    let check = |index: usize, before: Point, after: Point| {
        let turn = turn_rad(before, after);
        if turn.abs() > LARGEST_TURN_RAD {
            return Err(PathError::Reversal { index, turn_deg: turn.to_degrees() });
        }
        Ok(())
    };
    for (i, pair) in chords.windows(2).enumerate() {
        check(i + 1, pair[0], pair[1])?;
    }
    let last = chords.len() - 1;
    match nodal.ends {
        Ends::Closed => check(0, chords[last], chords[0])?,
        Ends::Clamped(start, end) => {
            for (tangent, end) in [(start, "start"), (end, "end")] {
                if tangent.norm() <= super::MIN_SEGMENT_MM {
                    return Err(PathError::ZeroEndTangent { end });
                }
            }
            check(0, complex(&start), chords[0])?;
            check(last + 1, chords[last], complex(&end))?;
        }
    }
    Ok(chords)
}

/// The angle from one direction to the next, in `(-π, π]`.
pub(super) fn turn_rad(before: Point, after: Point) -> f64 {
    let turn = after * before.conj();
    libm::atan2(turn.im, turn.re)
}

/// The square root that lies within a quarter turn of `beside`.
fn root_beside(square: Point, beside: Point) -> Point {
    let root = square_root(square);
    if root.re * beside.re + root.im * beside.im < 0.0 { -root } else { root }
}

/// Principal square root, from additions, products and real roots only: the same bits on every machine.
fn square_root(z: Point) -> Point {
    let modulus = (z.re * z.re + z.im * z.im).sqrt();
    let half = (0.5 * (modulus + z.re.abs())).sqrt();
    if half == 0.0 {
        return Point::new(0.0, 0.0);
    }
    let other = 0.5 * z.im.abs() / half;
    let (re, im) = if z.re >= 0.0 { (half, other) } else { (other, half) };
    Point::new(re, im.copysign(z.im))
}

/// `z_i = √(q_i - q_{i-1})`, signs chosen so that neighbours are less than a quarter turn apart.
fn start(nodal: &NodalPoints, chords: &[Point]) -> (Vec<Point>, Closing) {
    let m = chords.len();
    let mut z = Vec::with_capacity(m + 2);
    z.push(Point::new(0.0, 0.0));
    for &chord in chords {
        let before = z[z.len() - 1];
        let root = square_root(chord);
        z.push(if z.len() > 1 { root_beside(chord, before) } else { root });
    }
    z.push(Point::new(0.0, 0.0));
    let (first, last) = (z[1], z[m]);
    let closing = match nodal.ends {
        Ends::Clamped(start, end) => {
            let start = root_beside(complex(&start), first) * 2.0;
            let end = root_beside(complex(&end), last) * 2.0;
            z[0] = start - first;
            z[m + 1] = end - last;
            Closing::Clamped(start, end)
        }
        Ends::Closed => {
            let sigma = if first.re * last.re + first.im * last.im < 0.0 { -1.0 } else { 1.0 };
            z[0] = last * sigma;
            z[m + 1] = first * sigma;
            Closing::Closed(sigma)
        }
    };
    (z, closing)
}

/// Residual of the whole system, as chord errors \[mm\].
struct Residual {
    largest: f64,
    segment: usize,
    /// Sum of squares.
    sum: f64,
}

impl Residual {
    fn stuck(&self, iterations: usize) -> PathError {
        PathError::NoConvergence { iterations, segment: self.segment, residual_mm: self.largest }
    }
}

/// The linear system of one Newton step, its memory used again and again.
struct System<'a> {
    chords: &'a [Point],
    closing: &'a Closing,
    /// Eliminated super-diagonal, right-hand side and (closed) the column of the last unknown.
    upper: Vec<Point>,
    right: Vec<Point>,
    corner: Vec<Point>,
}

impl<'a> System<'a> {
    fn new(chords: &'a [Point], closing: &'a Closing) -> Self {
        let m = chords.len();
        let corner = if matches!(closing, Closing::Closed(_)) { m } else { 0 };
        let zero = Point::new(0.0, 0.0);
        Self { chords, closing, upper: vec![zero; m], right: vec![zero; m], corner: vec![zero; corner] }
    }

    /// Equation `i` (from 1) at `z`, in units of 60 mm.
    fn equation(&self, z: &[Point], i: usize) -> Point {
        let (a, b, c) = (z[i - 1], z[i], z[i + 1]);
        (a * a + c * c) * 3.0 + b * (b * 27.0 + (a + c) * 13.0) + a * c - self.chords[i - 1] * 60.0
    }

    fn residual(&self, z: &[Point]) -> Residual {
        let mut residual = Residual { largest: 0.0, segment: 0, sum: 0.0 };
        for i in 1..=self.chords.len() {
            let square = self.equation(z, i).norm_sqr() / 3600.0;
            residual.sum += square;
            if !(square <= residual.largest) {
                (residual.largest, residual.segment) = (square, i - 1);
            }
        }
        residual.largest = residual.largest.sqrt();
        residual
    }

    /// Row `i`: derivatives with respect to `z_{i-1}, z_i, z_{i+1}`.
    fn row(z: &[Point], i: usize) -> (Point, Point, Point) {
        let (a, b, c) = (z[i - 1], z[i], z[i + 1]);
        (a * 6.0 + c + b * 13.0, b * 54.0 + (a + c) * 13.0, c * 6.0 + a + b * 13.0)
    }

    /// Solves for the step of `z_1 … z_M`, left in `right`.
    ///
    /// The end unknowns are eliminated beforehand: `δz_0 = -δz_1` (clamped) or `σ δz_M` (closed). The closed system is
    /// tridiagonal with two corners: the elimination carries the column of the last unknown along.
    fn solve_step(&mut self, z: &[Point]) {
        let m = self.chords.len();
        let zero = Point::new(0.0, 0.0);
        let sigma = match self.closing {
            Closing::Clamped(..) => 0.0,
            Closing::Closed(sigma) => *sigma,
        };
        let clamped = matches!(self.closing, Closing::Clamped(..));
        // The last row, eliminated on the way in the closed case: its entries at the unknown in hand and at the last one.
        let (last_below, mut last_diagonal, last_above) = Self::row(z, m);
        let mut last_entry = last_above * sigma;
        let mut last_right = -self.equation(z, m);
        let rows = if clamped { m } else { m - 1 };
        for i in 1..=rows {
            let (below, mut diagonal, mut above) = Self::row(z, i);
            let mut right = -self.equation(z, i);
            let mut corner = zero;
            if clamped {
                if i == 1 {
                    diagonal -= below;
                }
                if i == m {
                    diagonal -= above;
                }
            } else {
                if i == 1 {
                    corner = below * sigma;
                }
                if i == rows {
                    corner += above;
                    above = zero;
                }
            }
            if i > 1 {
                diagonal -= below * self.upper[i - 2];
                right -= below * self.right[i - 2];
                if !clamped {
                    corner -= below * self.corner[i - 2];
                }
            }
            let pivot = diagonal.inv();
            self.upper[i - 1] = above * pivot;
            self.right[i - 1] = right * pivot;
            if !clamped {
                self.corner[i - 1] = corner * pivot;
                if i == rows {
                    last_entry += last_below;
                }
                last_right -= last_entry * self.right[i - 1];
                last_diagonal -= last_entry * self.corner[i - 1];
                last_entry = -(last_entry * self.upper[i - 1]);
            }
        }
        if clamped {
            for i in (1..m).rev() {
                let next = self.right[i];
                let upper = self.upper[i - 1];
                self.right[i - 1] -= upper * next;
            }
        } else {
            let last = last_right / last_diagonal;
            self.right[m - 1] = last;
            for i in (1..m).rev() {
                let next = if i == m - 1 { zero } else { self.right[i] };
                let (upper, corner) = (self.upper[i - 1], self.corner[i - 1]);
                self.right[i - 1] -= upper * next + corner * last;
            }
        }
    }

    /// `trial = z + share · step`, ends included.
    fn apply(&self, z: &[Point], share: f64, trial: &mut [Point]) {
        let m = self.chords.len();
        for i in 1..=m {
            trial[i] = z[i] + self.right[i - 1] * share;
        }
        match self.closing {
            Closing::Clamped(start, end) => {
                trial[0] = start - trial[1];
                trial[m + 1] = end - trial[m];
            }
            Closing::Closed(sigma) => {
                trial[0] = trial[m] * *sigma;
                trial[m + 1] = trial[1] * *sigma;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Newton corrects itself: a wrong elimination would only cost iterations. So the step itself is put into its equations.
    #[test]
    fn validates_that_a_step_solves_the_linear_system() {
        let at = |i: usize| Point::new(1.0 + (i as f64 * 1.3).sin(), 0.7 * (i as f64 * 0.9).cos());
        for m in 1..12 {
            let chords: Vec<Point> = (0..m).map(|i| at(i) * 2.0).collect();
            let z: Vec<Point> = (0..m + 2).map(|i| at(i + 5)).collect();
            for closing in [Closing::Clamped(at(1), at(2)), Closing::Closed(1.0), Closing::Closed(-1.0)] {
                let sigma = match closing {
                    Closing::Closed(sigma) if m >= 3 => Some(sigma),
                    Closing::Closed(_) => continue,
                    Closing::Clamped(..) => None,
                };
                let mut system = System::new(&chords, &closing);
                system.solve_step(&z);
                let step = system.right.clone();
                let before = sigma.map_or(-step[0], |sigma| step[m - 1] * sigma);
                let after = sigma.map_or(-step[m - 1], |sigma| step[0] * sigma);
                for i in 1..=m {
                    let (below, diagonal, above) = System::row(&z, i);
                    let left = if i == 1 { before } else { step[i - 2] };
                    let right = if i == m { after } else { step[i] };
                    let miss = below * left + diagonal * step[i - 1] + above * right + system.equation(&z, i);
                    assert!(miss.norm_sqr().sqrt() < 1e-9, "{m} unknowns, closed {sigma:?}, row {i}: {miss}");
                }
            }
        }
    }
}
