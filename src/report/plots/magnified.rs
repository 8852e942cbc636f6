//! The contouring error drawn large beside the path, without folds.

use super::super::data::PlotSample;

/// The path is looked at as far on both sides of a point as this multiple of the largest offset: round a whole half circle.
const WINDOW: f64 = 3.2;
/// Points of the path on each side of a point that are looked at.
const POINTS: f64 = 240.0;
/// Offsets end so far before they would touch those of another piece of the path, as a share.
const APART: f64 = 0.98;

/// The error of every sample, drawn `times` as large from the nearest point of the path, and whether any had to be drawn smaller.
///
/// Magnified offsets fold where the path bends more sharply than they are long: behind a centre of curvature, or past the bisector of
/// a corner. So no offset is longer than the radius of the circle that touches the path in its nearest point `n` and reaches another
/// point `q` of the path near by,
///
/// ```text
/// r = |q - n|² / (2 u·(q - n))      u: unit vector from n to where the tool is
/// ```
///
/// (the radius of the medial ball; J. Ma, S. Bae, S. Choi, "3D medial axis point approximation using nearest neighbors and the normal
/// field", The Visual Computer 28, 2012). On smooth stretches nothing changes.
pub(super) fn magnified(samples: &[PlotSample], times: f64) -> (Vec<(f64, f64)>, bool) {
    let errors: Vec<[f64; 2]> = samples.iter().map(|s| [0, 1].map(|i| s.actual_mm[i] - s.nearest_mm[i])).collect();
    let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let longest = times * errors.iter().map(|error| length(*error)).fold(0.0, f64::max);
    let window = WINDOW * longest;
    let path = Path::of(samples, window / POINTS);
    let mut is_limited = false;
    let place = |(i, (sample, error)): (usize, (&PlotSample, &[f64; 2]))| {
        let [nx, ny] = [sample.nearest_mm[0], sample.nearest_mm[1]];
        let offset = times * length(*error);
        let limit = if offset > 0.0 { path.limit(i, [nx, ny], *error, window) } else { f64::INFINITY };
        let times = if offset > limit {
            is_limited = true;
            times * limit / offset
        } else {
            times
        };
        (nx + times * error[0], ny + times * error[1])
    };
    let points = samples.iter().zip(&errors).enumerate().map(place).collect();
    (points, is_limited)
}

/// The path that the nearest points run along, in steps.
struct Path {
    step: f64,
    points: Vec<[f64; 2]>,
    /// Length of the path up to each point.
    lengths: Vec<f64>,
    /// Of every sample the last point before it.
    of_sample: Vec<usize>,
}

impl Path {
    fn of(samples: &[PlotSample], step: f64) -> Self {
        let mut path = Self { step, points: Vec::new(), lengths: Vec::new(), of_sample: Vec::new() };
        for sample in samples {
            let at = [sample.nearest_mm[0], sample.nearest_mm[1]];
            let distance = path.points.last().map(|last| distance(*last, at));
            if distance.is_none_or(|distance| distance >= step) {
                path.lengths.push(path.lengths.last().copied().unwrap_or(0.0) + distance.unwrap_or(0.0));
                path.points.push(at);
            }
            path.of_sample.push(path.points.len() - 1);
        }
        path
    }

    /// Longest offset from `nearest` along `error` of a sample.
    fn limit(&self, sample: usize, nearest: [f64; 2], error: [f64; 2], window: f64) -> f64 {
        let Some(&here) = self.of_sample.get(sample) else { return f64::INFINITY };
        let unit = 1.0 / (error[0] * error[0] + error[1] * error[1]).sqrt();
        let is_near = |k: &usize| (self.lengths[*k] - self.lengths[here]).abs() <= window;
        let radius = |k: usize| {
            let (dx, dy) = (self.points[k][0] - nearest[0], self.points[k][1] - nearest[1]);
            let (square, along) = (dx * dx + dy * dy, (dx * error[0] + dy * error[1]) * unit);
            // Points next to the nearest one say nothing: their distance from the tangent is rounding.
            if along > 0.0 && square > 0.25 * self.step * self.step { 0.5 * square / along } else { f64::INFINITY }
        };
        let before = (0..=here).rev().take_while(is_near);
        let after = (here + 1..self.points.len()).take_while(is_near);
        APART * before.chain(after).map(radius).fold(f64::INFINITY, f64::min)
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(nearest: [f64; 2], actual: [f64; 2]) -> PlotSample {
        let z = |[x, y]: [f64; 2]| [x, y, 0.0];
        PlotSample { nearest_mm: z(nearest), actual_mm: z(actual), ..PlotSample::default() }
    }

    /// Along X to a corner at the origin, then along Y, with an error to the left of 20 µm that grows towards the corner to 30.
    fn corner() -> Vec<PlotSample> {
        let error = |far: f64| 0.02 + 0.01 * (-far).exp();
        let before = (1..400).rev().map(|i| 0.03 + 0.01 * f64::from(i)).map(|x| sample([-x, 0.0], [-x, error(x)]));
        let after = (1..400).map(|i| 0.03 + 0.01 * f64::from(i)).map(|y| sample([0.0, y], [-error(y), y]));
        before.chain(after).collect()
    }

    /// How often a polyline crosses itself.
    fn crossings(points: &[(f64, f64)]) -> usize {
        let side = |a: (f64, f64), b: (f64, f64), p: (f64, f64)| (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
        let cross = |a: &[(f64, f64)], b: &[(f64, f64)]| {
            side(a[0], a[1], b[0]) * side(a[0], a[1], b[1]) < 0.0
                && side(b[0], b[1], a[0]) * side(b[0], b[1], a[1]) < 0.0
        };
        let segments: Vec<_> = points.windows(2).collect();
        (0..segments.len()).map(|i| (0..i).filter(|j| cross(segments[i], segments[*j])).count()).sum()
    }

    #[test]
    fn the_error_does_not_fold_at_a_sharp_corner() {
        let samples = corner();
        let plain: Vec<(f64, f64)> = samples
            .iter()
            .map(|s| [0, 1].map(|i| s.nearest_mm[i] + 50.0 * (s.actual_mm[i] - s.nearest_mm[i])))
            .map(|[x, y]| (x, y))
            .collect();
        assert!(crossings(&plain) > 0);
        let (points, is_limited) = magnified(&samples, 50.0);
        assert!(is_limited);
        // The largest offset is 1.5 mm, some 45 pixels. Within one pixel of the corner the steps along the path are too long to tell.
        let seen: Vec<(f64, f64)> = points.iter().copied().filter(|(x, y)| x.hypot(*y) > 0.04).collect();
        assert_eq!(crossings(&seen), 0);
        // Away from the corner nothing changes.
        assert_eq!(points[..200], plain[..200]);
        assert_eq!(points[points.len() - 200..], plain[plain.len() - 200..]);
    }

    #[test]
    fn validates_the_limit_on_a_circle_against_its_centre() {
        // Inside a circle of 1 mm an error of 20 µm, 100 times as large, would come out on the other side; outside it does not fold.
        for (radius, folds) in [(0.98, true), (1.02, false)] {
            let at = |i: u32, r: f64| {
                let angle = 0.002 * f64::from(i);
                [r * angle.cos(), r * angle.sin()]
            };
            let samples: Vec<PlotSample> = (0..1500).map(|i| sample(at(i, 1.0), at(i, radius))).collect();
            let (points, is_limited) = magnified(&samples, 100.0);
            assert_eq!(is_limited, folds);
            for (x, y) in points {
                let far = (x * x + y * y).sqrt();
                let wanted = if folds { 1.0 - APART } else { 3.0 };
                assert!((far - wanted).abs() < 1e-6, "{far} instead of {wanted}");
            }
        }
    }

    #[test]
    fn a_straight_line_is_not_limited() {
        let samples: Vec<PlotSample> =
            (0..500).map(|i| 0.02 * f64::from(i)).map(|x| sample([x, 0.0], [x, 0.03 * x.sin()])).collect();
        assert!(!magnified(&samples, 100.0).1);
        assert!(!magnified(&samples[..1], 100.0).1 && magnified(&[], 100.0).0.is_empty());
    }
}
