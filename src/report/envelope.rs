//! Curves over time that swing so often that their line would become a solid bar: there the envelope is drawn instead, the lowest and
//! the highest value of every column.

use super::curve::Px;

/// Width of a column \[px\].
const COLUMN_PX: f64 = 3.0;
/// A line that travels so many times the height of a column within it leaves no white between its strokes.
const CROSSINGS: f64 = 2.5;
/// Columns lower than this are a line, however often it swings \[px\].
const LEAST_HEIGHT_PX: f64 = 3.0;
/// Fewer columns side by side are left to the line: a short burst is seen.
const LEAST_COLUMNS: usize = 4;
/// So many columns of a line between bands, or at an end beside one, become part of them.
const GAP_COLUMNS: usize = 2;

/// A stretch of a curve.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Stretch {
    /// A line.
    Line(Vec<Px>),
    /// An envelope: its upper and its lower border, from left to right.
    Band {
        /// The highest point of every column.
        upper: Vec<Px>,
        /// The lowest.
        lower: Vec<Px>,
    },
}

/// The points of a column, from index to index, and its extremes.
struct Column {
    from: usize,
    to: usize,
    top: f64,
    bottom: f64,
    dense: bool,
}

/// The stretches of a curve, in their order; neighbours share a point or touch. A curve that does not run from left to right is one line.
pub(super) fn stretches(points: &[Px]) -> Vec<Stretch> {
    if !points.is_sorted_by(|a, b| a.0 <= b.0) {
        return vec![Stretch::Line(points.to_vec())];
    }
    let mut columns = columns(points);
    close_gaps(&mut columns);
    drop_bursts(&mut columns);
    let mut stretches = Vec::new();
    for run in columns.chunk_by(|a, b| a.dense == b.dense) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
        if first.dense {
            // From the first to the last point, so that the lines beside it meet it.
            let middle = |column: &Column| 0.5 * (points[column.from].0 + points[column.to - 1].0);
            let ends = (points[first.from].0, points[last.to - 1].0);
            let border = |of: fn(&Column) -> f64| {
                let inner = run.iter().map(|column| (middle(column), of(column)));
                [(ends.0, of(first))].into_iter().chain(inner).chain([(ends.1, of(last))]).collect()
            };
            stretches.push(Stretch::Band { upper: border(|c| c.top), lower: border(|c| c.bottom) });
        } else {
            // One point of each neighbour, so that nothing is torn apart.
            let (from, to) = (first.from.saturating_sub(1), (last.to + 1).min(points.len()));
            stretches.push(Stretch::Line(points[from..to].to_vec()));
        }
    }
    stretches
}

fn columns(points: &[Px]) -> Vec<Column> {
    let mut columns = Vec::new();
    let mut from = 0;
    for column in points.chunk_by(|a, b| (a.0 / COLUMN_PX).floor() == (b.0 / COLUMN_PX).floor()) {
        let to = from + column.len();
        let top = column.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let bottom = column.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let travel: f64 = column.windows(2).map(|p| (p[1].1 - p[0].1).abs()).sum();
        let dense = bottom - top > LEAST_HEIGHT_PX && travel > CROSSINGS * (bottom - top);
        columns.push(Column { from, to, top, bottom, dense });
        from = to;
    }
    columns
}

fn close_gaps(columns: &mut [Column]) {
    set_short_runs(columns, GAP_COLUMNS, false, true);
}

fn drop_bursts(columns: &mut [Column]) {
    set_short_runs(columns, LEAST_COLUMNS - 1, true, false);
}

/// Runs of at most `most` columns that are `from` become `to`; gaps only beside others.
fn set_short_runs(columns: &mut [Column], most: usize, from: bool, to: bool) {
    let mut start = 0;
    while start < columns.len() {
        let value = columns[start].dense;
        let end = start + columns[start..].iter().take_while(|column| column.dense == value).count();
        let is_beside = from || start > 0 || end < columns.len();
        if value == from && end - start <= most && is_beside {
            columns[start..end].iter_mut().for_each(|column| column.dense = to);
        }
        start = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(period_px: f64, from: f64, to: f64) -> Vec<Px> {
        (0..=40_000)
            .map(|i| from + (to - from) * f64::from(i) / 40_000.0)
            .map(|x| (x, 100.0 + 50.0 * (std::f64::consts::TAU * x / period_px).sin()))
            .collect()
    }

    #[test]
    fn a_fast_oscillation_is_an_envelope_that_keeps_its_extremes() {
        let mut points = wave(1.0, 0.0, 900.0);
        points[20_000].1 = 7.0;
        let stretches = stretches(&points);
        let [Stretch::Band { upper, lower }] = stretches.as_slice() else { panic!("{}", stretches.len()) };
        assert!(upper.len() < 310 && upper.len() == lower.len(), "{}", upper.len());
        assert_eq!((upper.first().map(|p| p.0), upper.last().map(|p| p.0)), (Some(0.0), Some(900.0)));
        assert!(upper.iter().any(|p| p.1 == 7.0));
        // The last column holds the last point alone.
        let inner =
            |border: &[Px]| border.iter().filter(|p| p.0 < 899.0 && p.1 != 7.0).map(|p| p.1).collect::<Vec<_>>();
        assert!(inner(upper).iter().all(|y| (y - 50.0).abs() < 0.1));
        assert!(inner(lower).iter().all(|y| (y - 150.0).abs() < 0.1));
    }

    #[test]
    fn a_slow_or_a_flat_one_stays_a_line() {
        for points in [wave(6.0, 0.0, 900.0), wave(300.0, 0.0, 900.0), vec![(0.0, 1.0); 3], Vec::new()] {
            let lines = stretches(&points);
            assert!(lines.iter().all(|s| matches!(s, Stretch::Line(_))) && lines.len() <= 1);
        }
        let flat: Vec<Px> = wave(1.0, 0.0, 900.0).iter().map(|(x, y)| (*x, 100.0 + 0.02 * (y - 100.0))).collect();
        assert_eq!(stretches(&flat), [Stretch::Line(flat)]);
    }

    #[test]
    fn line_and_envelope_meet() {
        let mut points = wave(200.0, 0.0, 300.0);
        points.extend(wave(1.0, 300.001, 600.0));
        points.extend(wave(200.0, 600.001, 900.0));
        let parts = stretches(&points);
        let [Stretch::Line(before), Stretch::Band { upper, .. }, Stretch::Line(after)] = parts.as_slice() else {
            panic!("{}", parts.len())
        };
        let (first, last) = (upper.first().unwrap().0, upper.last().unwrap().0);
        assert!((before.last().unwrap().0 - first).abs() < 0.1 && (after.first().unwrap().0 - last).abs() < 0.1);
    }
}
