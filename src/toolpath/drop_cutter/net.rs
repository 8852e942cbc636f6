//! Bezier nets in homogeneous coordinates `(w x, w y, w z, w)`: points with derivatives, and halves.

use nalgebra::{Vector2, Vector3, Vector4};

use crate::path::nurbs::MAX_DEGREE;
use crate::path::{NurbsCurve, NurbsError, NurbsSurface};

type Row = [f64; MAX_DEGREE + 1];

/// A Bezier patch over a part of a surface's domain.
#[derive(Debug, Clone)]
pub(super) struct Net {
    pub(super) degree: [usize; 2],
    /// Row after row (along `u`), each over all of `v`.
    pub(super) points: Vec<Vector4<f64>>,
    /// First parameters, and how far it runs.
    pub(super) from: Vector2<f64>,
    pub(super) size: Vector2<f64>,
}

/// A point with its partial derivatives over the net's own parameters, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub(super) point: Vector3<f64>,
    pub(super) d: [Vector3<f64>; 2],
    /// `uu`, `uv`, `vv`.
    pub(super) dd: [Vector3<f64>; 3],
}

impl Net {
    /// The patches of a surface, relative to `centre`.
    pub(super) fn patches(surface: &NurbsSurface, centre: Vector3<f64>) -> Result<Vec<Self>, NurbsError> {
        let [p, q] = surface.degree();
        let [u, v] = surface.knots();
        let columns = surface.size()[1];
        let weights = surface.weights();
        // A common factor changes nothing; none above 1 keeps the products in range.
        let most = weights.map_or(1.0, |w| w.iter().copied().fold(0.0, f64::max));
        let mut points = surface.control_points_mm().iter().enumerate().map(|(i, point)| {
            let w = weights.and_then(|w| w.get(i)).map_or(1.0, |w| w / most);
            ((point - centre) * w).push(w)
        });
        let mut rows = Vec::new();
        for _ in 0..surface.size()[0] {
            let row: Vec<Vector4<f64>> = points.by_ref().take(columns).collect();
            rows.push(NurbsCurve::<4>::new(q, v.to_vec(), row, None)?.bezier_pieces().collect::<Vec<_>>());
        }
        let mut out = Vec::new();
        for piece in 0..rows.first().map_or(0, Vec::len) {
            let mut strips = Vec::new();
            for j in 0..=q {
                let line = rows.iter().map(|row| row[piece].control_points_mm[j]).collect();
                strips.push(NurbsCurve::<4>::new(p, u.to_vec(), line, None)?.bezier_pieces().collect::<Vec<_>>());
            }
            for part in 0..strips.first().map_or(0, Vec::len) {
                let (along, across) = (&strips[0][part], &rows[0][piece]);
                out.push(Self {
                    degree: [p, q],
                    points: (0..=p)
                        .flat_map(|i| strips.iter().map(move |strip| strip[part].control_points_mm[i]))
                        .collect(),
                    from: Vector2::new(along.from, across.from),
                    size: Vector2::new(along.to - along.from, across.to - across.from),
                });
            }
        }
        Ok(out)
    }

    /// Least and largest coordinates of the control points: the patch is inside.
    pub(super) fn bounds(&self) -> [Vector3<f64>; 2] {
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for a in &self.points {
            let point = a.xyz() / a.w;
            (low, high) = (low.inf(&point), high.sup(&point));
        }
        [low, high]
    }

    /// The halves along `axis`.
    pub(super) fn halves(&self, axis: usize) -> [Self; 2] {
        let [p, q] = self.degree;
        let (length, lines) = if axis == 0 { (p + 1, q + 1) } else { (q + 1, p + 1) };
        let at = |line: usize, k: usize| if axis == 0 { k * (q + 1) + line } else { line * (q + 1) + k };
        let (mut left, mut right) = (self.clone(), self.clone());
        for line in 0..lines {
            for round in 1..length {
                for k in 0..length - round {
                    right.points[at(line, k)] = (right.points[at(line, k)] + right.points[at(line, k + 1)]) * 0.5;
                }
                left.points[at(line, round)] = right.points[at(line, 0)];
            }
        }
        left.size[axis] *= 0.5;
        right.size[axis] *= 0.5;
        right.from[axis] += right.size[axis];
        [left, right]
    }

    /// Parameters of the surface at the net's own `(s, t)`.
    pub(super) fn parameters(&self, at: Vector2<f64>) -> Vector2<f64> {
        self.from + self.size.component_mul(&at)
    }

    /// Point and derivatives at the net's own `(s, t)`.
    #[inline]
    pub(super) fn jet(&self, at: Vector2<f64>) -> Jet {
        let [p, q] = self.degree;
        let (bu, bv) = (bernstein(p, at.x), bernstein(q, at.y));
        let mut sums = [[Vector4::zeros(); 3]; 3];
        for (i, row) in self.points.chunks_exact(q + 1).enumerate() {
            let mut line = [Vector4::zeros(); 3];
            for (j, a) in row.iter().enumerate() {
                line[0] += a * bv[0][j];
                line[1] += a * bv[1][j];
                line[2] += a * bv[2][j];
            }
            sums[0][0] += line[0] * bu[0][i];
            sums[0][1] += line[1] * bu[0][i];
            sums[0][2] += line[2] * bu[0][i];
            sums[1][0] += line[0] * bu[1][i];
            sums[1][1] += line[1] * bu[1][i];
            sums[2][0] += line[0] * bu[2][i];
        }
        let w = 1.0 / sums[0][0].w;
        let [[a, av, avv], [au, auv, _], [auu, _, _]] = sums;
        let point = a.xyz() * w;
        let du = (au.xyz() - point * au.w) * w;
        let dv = (av.xyz() - point * av.w) * w;
        Jet {
            point,
            d: [du, dv],
            dd: [
                (auu.xyz() - du * (2.0 * au.w) - point * auu.w) * w,
                (auv.xyz() - du * av.w - dv * au.w - point * auv.w) * w,
                (avv.xyz() - dv * (2.0 * av.w) - point * avv.w) * w,
            ],
        }
    }
}

/// Bernstein polynomials of degree `p` with their first and second derivatives.
#[inline]
pub(super) fn bernstein(p: usize, x: f64) -> [Row; 3] {
    let mut out = [[0.0; MAX_DEGREE + 1]; 3];
    let mut b: Row = [0.0; MAX_DEGREE + 1];
    b[0] = 1.0;
    let y = 1.0 - x;
    let n = p as f64;
    for degree in 0..=p {
        if degree > 0 {
            for k in (1..=degree).rev() {
                b[k] = b[k] * y + b[k - 1] * x;
            }
            b[0] *= y;
        }
        if degree + 2 == p {
            for k in 0..=degree {
                let value = b[k] * n * (n - 1.0);
                out[2][k] += value;
                out[2][k + 1] -= 2.0 * value;
                out[2][k + 2] += value;
            }
        }
        if degree + 1 == p {
            for k in 0..=degree {
                out[1][k] -= b[k] * n;
                out[1][k + 1] += b[k] * n;
            }
        }
    }
    out[0] = b;
    out
}
