//! A function given by points: straight lines between them.

use crate::parameters::OutOfRange;

/// A function given by points `(at, value)`, with straight lines between them.
///
/// Before the first and after the last point it keeps their values, unless it repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct LookupTable {
    points: Vec<Point>,
    /// Period and its inverse.
    period: Option<[f64; 2]>,
}

/// A point, and the slope of the line that begins there.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    at: f64,
    value: f64,
    slope: f64,
}

impl Point {
    #[inline(always)]
    fn at_x(&self, x: f64) -> [f64; 2] {
        [self.slope.mul_add(x - self.at, self.value), self.slope]
    }
}

impl LookupTable {
    /// The function through these points. With a `period` it repeats: the points span at most one period, and the last is joined
    /// to the first of the next.
    ///
    /// # Errors
    /// No point, a number that is not finite or above 1e9, points that do not rise, a period that they do not fit in.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>, period: Option<f64>) -> Result<Self, OutOfRange> {
        let (mut at, mut value): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        let error = |name, value, needed| Err(OutOfRange::new(name, value, needed));
        let Some((&first, &last)) = at.first().zip(at.last()) else {
            return error("number of points", 0.0, "at least 1");
        };
        if let Some(&wrong) = at.iter().chain(&value).find(|x| !(x.abs() <= 1e9)) {
            return error("points", wrong, "made of finite numbers, at most 1e9");
        }
        if let Some(pair) = at.windows(2).find(|pair| !(pair[1] > pair[0])) {
            return error("points", pair[1], "given at points that rise strictly, from one to the next");
        }
        if let Some(period) = period {
            let span = last - first;
            if !(1e-6..=1e9).contains(&period) || span > period {
                return error("period", period, "from 1e-6 to 1e9, and no shorter than what the points span");
            }
            if span < period {
                at.push(first + period);
                value.push(value[0]);
            }
        }
        let slope = |i: usize| match (at.get(i + 1), value.get(i + 1)) {
            (Some(next), Some(then)) => (then - value[i]) / (next - at[i]),
            _ => 0.0,
        };
        let points = (0..at.len()).map(|i| Point { at: at[i], value: value[i], slope: slope(i) }).collect();
        Ok(Self { points, period: period.map(|period| [period, 1.0 / period]) })
    }

    /// Largest magnitude of the values.
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |largest, point| f64::max(largest, point.value.abs()))
    }

    /// The value at `x`, looked for from `near` on (where the last one was found).
    #[inline(always)]
    pub(in crate::servo) fn near(&self, x: f64, near: &mut usize) -> f64 {
        self.with_slope(x, near)[0]
    }

    /// Value and slope at `x`, looked for from `near` on.
    #[inline(always)]
    pub(in crate::servo) fn with_slope(&self, x: f64, near: &mut usize) -> [f64; 2] {
        let (first, last) = (&self.points[0], self.points.len() - 1);
        let x = match self.period {
            Some([period, inverse]) => x - period * ((x - first.at) * inverse).floor(),
            None => x,
        };
        if let Some([from, to]) = self.points.get(*near..).and_then(<[Point]>::first_chunk)
            && from.at <= x
            && x < to.at
        {
            return from.at_x(x);
        }
        if last == 0 || !(x > first.at) {
            return [first.value, 0.0];
        }
        if x >= self.points[last].at {
            return [self.points[last].value, 0.0];
        }
        // The first point is at most x, the last one above it.
        let i = self.points.partition_point(|point| point.at <= x).saturating_sub(1).min(last - 1);
        *near = i;
        self.points[i].at_x(x)
    }

    /// The value at `x`.
    pub fn value(&self, x: f64) -> f64 {
        self.near(x, &mut 0)
    }
}
