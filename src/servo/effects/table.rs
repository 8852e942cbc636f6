//! A function given by points: straight lines between them.

use crate::servo::ServoError;

/// A function given by points `(at, value)`, with straight lines between them.
///
/// Before the first and after the last point it keeps their values, unless it repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    at: Vec<f64>,
    value: Vec<f64>,
    period: Option<f64>,
}

impl Table {
    /// The function through these points. With a `period` it repeats: the points span at most one period, and the last is joined
    /// to the first of the next.
    ///
    /// # Errors
    /// No point, a number that is not finite or above 1e9, points that do not rise, a period that they do not fit in.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>, period: Option<f64>) -> Result<Self, ServoError> {
        let (mut at, mut value): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
        let error = |name, value, needed| Err(ServoError { name, value, needed });
        let Some((&first, &last)) = at.first().zip(at.last()) else {
            return error("table (number of points)", 0.0, "at least 1");
        };
        if let Some(&wrong) = at.iter().chain(&value).find(|x| !(x.abs() <= 1e9)) {
            return error("table", wrong, "made of finite numbers, at most 1e9");
        }
        if let Some(pair) = at.windows(2).find(|pair| !(pair[1] > pair[0])) {
            return error("table", pair[1], "given at points that rise strictly, from one to the next");
        }
        if let Some(period) = period {
            let span = last - first;
            if !(1e-6..=1e9).contains(&period) || span > period {
                return error("table period", period, "from 1e-6 to 1e9, and no shorter than what the points span");
            }
            if span < period {
                at.push(first + period);
                value.push(value[0]);
            }
        }
        Ok(Self { at, value, period })
    }

    /// Largest magnitude of the values.
    pub fn largest(&self) -> f64 {
        self.value.iter().fold(0.0, |largest, x| f64::max(largest, x.abs()))
    }

    /// The value at `x`, looked for from `near` on (where the last one was found).
    #[inline(always)]
    pub(in crate::servo) fn near(&self, x: f64, near: &mut usize) -> f64 {
        let first = self.at[0];
        let x = match self.period {
            Some(period) => x - period * ((x - first) / period).floor(),
            None => x,
        };
        let last = self.at.len() - 1;
        if last == 0 || !(x > first) {
            return self.value[0];
        }
        if x >= self.at[last] {
            return self.value[last];
        }
        let mut i = (*near).min(last - 1);
        if !(self.at[i] <= x && x < self.at[i + 1]) {
            i = if i + 2 <= last && self.at[i + 1] <= x && x < self.at[i + 2] {
                i + 1
            } else {
                // The first point is at most x, the last one above it.
                self.at.partition_point(|&at| at <= x).saturating_sub(1).min(last - 1)
            };
            *near = i;
        }
        let share = (x - self.at[i]) / (self.at[i + 1] - self.at[i]);
        self.value[i] + share * (self.value[i + 1] - self.value[i])
    }

    /// The value at `x`.
    pub fn value(&self, x: f64) -> f64 {
        self.near(x, &mut 0)
    }
}
