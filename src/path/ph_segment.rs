//! One segment of a PH quintic spline: `r'(ξ) = w(ξ)²` with a quadratic `w`.

use nalgebra::{Complex, Vector2};

use super::{Foot, Frame, Graph, bernstein};

/// A point of the plane as a complex number.
pub(super) type Point = Complex<f64>;

/// A vector of the plane as a complex number.
pub(super) fn complex(v: &Vector2<f64>) -> Point {
    Point::new(v.x, v.y)
}

fn vector(z: Point) -> Vector2<f64> {
    Vector2::new(z.re, z.im)
}

fn dot(a: Point, b: Point) -> f64 {
    a.re * b.re + a.im * b.im
}

fn cross(a: Point, b: Point) -> f64 {
    a.re * b.im - a.im * b.re
}

/// A segment, ready to be evaluated: everything in powers of `ξ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    start: Point,
    /// `w(ξ) = w_0 + w_1 ξ + w_2 ξ²`.
    w: [Point; 3],
    /// `r(ξ) - start`, coefficients of `ξ … ξ⁵`.
    position: [Point; 5],
    /// `s(ξ)`, coefficients of `ξ … ξ⁵`.
    length: [f64; 5],
    /// Largest curvature on the segment \[1/mm\].
    max_curvature: f64,
}

/// The hodograph's preimage at one parameter.
struct Preimage {
    w: Point,
    w1: Point,
    w2: Point,
    /// Parametric speed `σ = |w|²`.
    speed: f64,
}

/// What the search for the nearest point needs at one parameter.
pub(super) struct Slope {
    /// Half the squared distance to the point \[mm²\].
    pub(super) half_square: f64,
    /// Its first derivative, `(r - p)·r'`.
    pub(super) first: f64,
    /// Its second derivative.
    pub(super) second: f64,
    /// Parametric speed `σ` \[mm\].
    pub(super) speed: f64,
}

impl Segment {
    /// From the start point and the Bernstein coefficients `(a, b, c)` of `w`.
    ///
    /// Returns the parameter of a cusp instead where the parametric speed vanishes (below 1e-9 of its largest).
    pub(super) fn new(start: Point, [a, b, c]: [Point; 3]) -> Result<Self, f64> {
        let w = [a, (b - a) * 2.0, a - b * 2.0 + c];
        // r' = w²; σ = |w|².
        let [p, q, r] = w;
        let hodograph = [p * p, p * q * 2.0, q * q + p * r * 2.0, q * r * 2.0, r * r];
        let speed = [p.norm_sqr(), 2.0 * dot(p, q), q.norm_sqr() + 2.0 * dot(p, r), 2.0 * dot(q, r), r.norm_sqr()];
        let mut segment = Self {
            start,
            w,
            position: std::array::from_fn(|k| hodograph[k] / (k as f64 + 1.0)),
            length: std::array::from_fn(|k| speed[k] / (k as f64 + 1.0)),
            max_curvature: 0.0,
        };
        let sigma = [a.norm_sqr(), dot(a, b), (2.0 * b.norm_sqr() + dot(a, c)) / 3.0, dot(b, c), c.norm_sqr()];
        segment.check_speed(&sigma)?;
        segment.max_curvature = segment.find_max_curvature(&sigma, [a, b, c]);
        Ok(segment)
    }

    /// The smallest parametric speed must not vanish.
    fn check_speed(&self, sigma: &[f64; 5]) -> Result<(), f64> {
        let largest = sigma.iter().fold(0.0_f64, |m, &x| m.max(x.abs()));
        let floor = 1e-9 * largest;
        // The polynomial lies above its lowest coefficient.
        if sigma.iter().all(|&x| x > floor) {
            return Ok(());
        }
        let mut lowest = (0.0, sigma[0]);
        let mut offer = |xi: f64, speed: f64| {
            if speed < lowest.1 {
                lowest = (xi, speed);
            }
        };
        offer(1.0, sigma[4]);
        bernstein::roots(&bernstein::derivative::<5, 4>(sigma), &mut |xi| offer(xi, self.preimage(xi).speed));
        if lowest.1 > floor { Ok(()) } else { Err(lowest.0) }
    }

    /// Largest curvature: at an end or where `N'σ - 2Nσ' = 0`, with `κ = 2N/σ²`, `N = Im(w* w')`.
    fn find_max_curvature(&self, sigma: &[f64; 5], [a, b, c]: [Point; 3]) -> f64 {
        // N is quadratic: the cubic term of w* w' is real. Its Bernstein coefficients are 2 Im(a* b), Im(a* c), 2 Im(b* c).
        let n = [2.0 * cross(a, b), cross(a, c), 2.0 * cross(b, c)];
        let n1: [f64; 2] = bernstein::derivative(&n);
        let sigma1: [f64; 4] = bernstein::derivative(sigma);
        let first: [f64; 6] = bernstein::product(&n1, sigma);
        let second: [f64; 6] = bernstein::product(&n, &sigma1);
        let stationary: [f64; 6] = std::array::from_fn(|i| first[i] - 2.0 * second[i]);
        let mut largest = self.curvature(0.0).abs().max(self.curvature(1.0).abs());
        bernstein::roots(&stationary, &mut |xi| largest = largest.max(self.curvature(xi).abs()));
        largest
    }

    /// Largest curvature on the segment \[1/mm\].
    pub(super) fn max_curvature(&self) -> f64 {
        self.max_curvature
    }

    #[inline]
    fn preimage(&self, xi: f64) -> Preimage {
        let [p, q, r] = self.w;
        let w = p + (q + r * xi) * xi;
        Preimage { w, w1: q + r * (2.0 * xi), w2: r * 2.0, speed: w.norm_sqr() }
    }

    /// Parametric speed `σ` \[mm\].
    pub(super) fn speed(&self, xi: f64) -> f64 {
        self.preimage(xi).speed
    }

    /// Signed curvature `2 Im(w* w')/σ²` \[1/mm\].
    pub(super) fn curvature(&self, xi: f64) -> f64 {
        let p = self.preimage(xi);
        2.0 * cross(p.w, p.w1) / (p.speed * p.speed)
    }

    /// Change of the tangent's direction from `ξ = from` to `ξ = to` \[rad\], followed in steps.
    pub(super) fn turning(&self, from: f64, to: f64) -> f64 {
        const STEPS: u32 = 4;
        let at = |i: u32| self.preimage(from + (to - from) * f64::from(i) / f64::from(STEPS)).w;
        (0..STEPS).map(|i| at(i + 1) * at(i).conj()).map(|turn| 2.0 * libm::atan2(turn.im, turn.re)).sum()
    }

    /// `∫ κ² ds` \[1/mm\], by adaptive Gauss quadrature of `4 N²/σ³` to 1e-13 relative. A segment of length `L` that turns by
    /// less than 1e-13 rad is straight to rounding: nothing below 1e-26/L is refined.
    pub(super) fn bending_energy(&self) -> f64 {
        super::quadrature::integrate(
            &|xi| {
                let p = self.preimage(xi);
                let n = cross(p.w, p.w1);
                4.0 * n * n / (p.speed * p.speed * p.speed)
            },
            1e-13,
            1e-26 / self.arc_length(1.0),
        )
    }

    /// Arc length from the start of the segment \[mm\].
    #[inline]
    pub(super) fn arc_length(&self, xi: f64) -> f64 {
        // Estrin's scheme: half the depth of Horner's.
        let [a, b, c, d, e] = self.length;
        let square = xi * xi;
        ((a + b * xi) + square * ((c + d * xi) + square * e)) * xi
    }

    /// The point \[mm\].
    #[inline]
    pub(super) fn point(&self, xi: f64) -> Point {
        let [a, b, c, d, e] = self.position;
        let square = xi * xi;
        self.start + ((a + b * xi) + ((c + d * xi) + e * square) * square) * xi
    }

    /// Solves `s(ξ) = length_mm` on the segment from `xi`, kept inside a shrinking bracket.
    ///
    /// Newton's step with Halley's correction, `ξ ← ξ - f σ/(σ² - ½ f σ')` with `f = s(ξ) - length`: from where a stream is
    /// expected to be, one step reaches rounding.
    #[inline]
    pub(super) fn solve_length(&self, length_mm: f64, xi: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        // In this order a NaN becomes 0.
        let mut xi = xi.max(0.0).min(1.0);
        for _ in 0..60 {
            let miss = self.arc_length(xi) - length_mm;
            if miss < 0.0 {
                low = xi
            } else {
                high = xi
            }
            let p = self.preimage(xi);
            let step = miss * p.speed / (p.speed * p.speed - miss * dot(p.w, p.w1));
            let next = xi - step;
            // Convergence is cubic: after this the arc length is wrong by the order of σ step³, below rounding.
            if step.abs() < 5e-6 {
                return next.clamp(0.0, 1.0);
            }
            xi = if next >= low && next <= high { next } else { 0.5 * (low + high) };
        }
        xi
    }

    /// Point, tangent, curvature and its rate; `s_mm` is the arc length that the frame is given.
    #[inline]
    pub(super) fn frame(&self, xi: f64, s_mm: f64) -> Frame<2> {
        let p = self.preimage(xi);
        let inverse = 1.0 / p.speed;
        let tangent = p.w * p.w * inverse;
        let normal = Point::new(-tangent.im, tangent.re);
        let kappa = 2.0 * cross(p.w, p.w1) * inverse * inverse;
        // dκ/dξ = 2 Im(w* w'')/σ² - 2κ σ'/σ with σ' = 2 Re(w* w'); divided by σ it is dκ/ds.
        let speed1 = 2.0 * dot(p.w, p.w1);
        let kappa_s = (2.0 * cross(p.w, p.w2) * inverse - 2.0 * kappa * speed1) * inverse * inverse;
        Frame {
            s_mm,
            point_mm: vector(self.point(xi)),
            tangent: vector(tangent),
            curvature_1_mm: vector(normal * kappa),
            curvature_rate_1_mm2: vector(normal * kappa_s - tangent * (kappa * kappa)),
        }
    }

    /// The segment as a graph over its tangent at `ξ`.
    pub(super) fn graph(&self, xi: f64) -> Graph {
        // The position in powers of ξ - xi: Horner's scheme again and again.
        let mut z = [Point::new(0.0, 0.0); 6];
        z[1..].copy_from_slice(&self.position);
        for first in 0..5 {
            for j in (first..5).rev() {
                z[j] += z[j + 1] * xi;
            }
        }
        Graph::of_quintic(vector(self.point(xi)), [z[1], z[2], z[3], z[4], z[5]], -xi, 1.0 - xi)
    }

    /// The point and its tangent; `start_mm` is the arc length at the start of the segment.
    #[inline]
    pub(super) fn foot(&self, xi: f64, start_mm: f64) -> Foot<2> {
        let w = self.preimage(xi).w;
        Foot {
            s_mm: start_mm + self.arc_length(xi),
            point_mm: vector(self.point(xi)),
            tangent: vector(w * w / w.norm_sqr()),
        }
    }

    /// Half the squared distance to `target` with its derivatives in `ξ`.
    #[inline]
    pub(super) fn slope(&self, xi: f64, target: Point) -> Slope {
        let p = self.preimage(xi);
        let away = self.point(xi) - target;
        let r1 = p.w * p.w;
        let r2 = p.w * p.w1 * 2.0;
        Slope {
            half_square: 0.5 * away.norm_sqr(),
            first: dot(away, r1),
            second: p.speed * p.speed + dot(away, r2),
            speed: p.speed,
        }
    }
}
