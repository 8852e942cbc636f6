//! NURBS surfaces: evaluation, derivatives, normals, curvatures, curves of constant parameter.

use nalgebra::{Vector2, Vector3};

use super::{NurbsCurve, NurbsError, basis, check_points, check_weights};

/// A tensor-product NURBS surface `Q(u, v) = Σ Σ N_i(u) N_j(v) w_ij P_ij / Σ Σ N_i(u) N_j(v) w_ij` in space \[mm\].
///
/// Source: Piegl, Tiller, "The NURBS Book", sections 3.4 and 4.4; do Carmo, "Differential Geometry of Curves and Surfaces", 3-3.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsSurface {
    degree: [usize; 2],
    knots: [Vec<f64>; 2],
    /// Row `i` (along u) after row, each over all `j`.
    points: Vec<Vector3<f64>>,
    weights: Option<Vec<f64>>,
    rows: usize,
    columns: usize,
}

/// A point of a surface with its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// `Q` \[mm\].
    pub point_mm: Vector3<f64>,
    /// `Q_u`.
    pub du: Vector3<f64>,
    /// `Q_v`.
    pub dv: Vector3<f64>,
    /// `Q_uu`.
    pub duu: Vector3<f64>,
    /// `Q_uv`.
    pub duv: Vector3<f64>,
    /// `Q_vv`.
    pub dvv: Vector3<f64>,
}

/// Principal curvatures `κ_1 ≥ κ_2` and their directions. Positive: the surface bends towards its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrincipalCurvatures {
    /// The larger one, `κ_1` \[1/mm\].
    pub largest_1_mm: f64,
    /// The smaller one, `κ_2` \[1/mm\].
    pub smallest_1_mm: f64,
    /// Unit direction of `κ_1` in space; where both are the same, any tangent direction.
    pub largest_direction: Vector3<f64>,
    /// Unit direction of `κ_2`, perpendicular to it.
    pub smallest_direction: Vector3<f64>,
}

impl NurbsSurface {
    /// A surface from rows of control points: `control_points_mm[i][j]` with `i` along `u` and `j` along `v`; weights alike.
    ///
    /// # Errors
    /// As [`NurbsCurve::new`], for each of the two directions; rows of different lengths.
    pub fn new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        control_points_mm: &[Vec<Vector3<f64>>],
        weights: Option<&[Vec<f64>]>,
    ) -> Result<Self, NurbsError> {
        let rows = control_points_mm.len();
        let columns = control_points_mm.first().map_or(0, Vec::len);
        for (row, points) in control_points_mm.iter().enumerate() {
            if points.len() != columns {
                return Err(NurbsError::RaggedRows { row, given: points.len(), needed: columns });
            }
        }
        basis::check(degree[0], &knots[0], rows)?;
        basis::check(degree[1], &knots[1], columns)?;
        let points: Vec<_> = control_points_mm.iter().flatten().copied().collect();
        check_points(&points)?;
        if let Some(weights) = weights {
            for (row, own) in weights.iter().enumerate() {
                if own.len() != columns {
                    return Err(NurbsError::RaggedRows { row, given: own.len(), needed: columns });
                }
            }
        }
        let weights = check_weights(weights.map(<[Vec<f64>]>::concat), points.len())?;
        Ok(Self { degree, knots, points, weights, rows, columns })
    }

    /// Degrees along `u` and `v`.
    pub fn degree(&self) -> [usize; 2] {
        self.degree
    }

    /// Knots along `u` and `v`.
    pub fn knots(&self) -> [&[f64]; 2] {
        [&self.knots[0], &self.knots[1]]
    }

    /// Numbers of control points along `u` and `v`.
    pub fn size(&self) -> [usize; 2] {
        [self.rows, self.columns]
    }

    /// Control point `P_ij` \[mm\]; None beyond the net.
    pub fn control_point_mm(&self, i: usize, j: usize) -> Option<Vector3<f64>> {
        (j < self.columns).then(|| self.points.get(i * self.columns + j).copied()).flatten()
    }

    /// All control points \[mm\], row after row.
    pub fn control_points_mm(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// The weights, in the order of [`NurbsSurface::control_points_mm`]; None where all are the same.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// First and last parameter along `u` and along `v`.
    pub fn domain(&self) -> [(f64, f64); 2] {
        [
            (self.knots[0][self.degree[0]], self.knots[0][self.rows]),
            (self.knots[1][self.degree[1]], self.knots[1][self.columns]),
        ]
    }

    fn weight(&self, index: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |w| w[index])
    }

    /// Parameters clamped to the domain (NaN: its start).
    fn clamp(&self, u: f64, v: f64) -> (f64, f64) {
        let [(u0, u1), (v0, v1)] = self.domain();
        (u.max(u0).min(u1), v.max(v0).min(v1))
    }

    /// The point at `(u, v)` \[mm\], clamped to the domain (NaN: its start).
    pub fn point_mm(&self, u: f64, v: f64) -> Vector3<f64> {
        self.homogeneous::<1>(u, v)[0][0].0
    }

    /// Partial derivatives of `w Q` and of `w`, orders below `K` each way, divided by `w`.
    #[allow(clippy::needless_range_loop)] // i and j are those of the sum
    fn homogeneous<const K: usize>(&self, u: f64, v: f64) -> [[(Vector3<f64>, f64); K]; K] {
        let (u, v) = self.clamp(u, v);
        let [p, q] = self.degree;
        let (su, sv) = (basis::span(p, &self.knots[0], u), basis::span(q, &self.knots[1], v));
        let nu = basis::derivatives::<K>(p, &self.knots[0], su, u);
        let nv = basis::derivatives::<K>(q, &self.knots[1], sv, v);
        let mut out = [[(Vector3::zeros(), 0.0); K]; K];
        for i in 0..=p {
            let first = (su - p + i) * self.columns + sv - q;
            let mut row = [(Vector3::zeros(), 0.0); K];
            for j in 0..=q {
                let (point, weight) = (self.points[first + j], self.weight(first + j));
                for (l, (a, w)) in row.iter_mut().enumerate() {
                    *a += point * (nv[l][j] * weight);
                    *w += nv[l][j] * weight;
                }
            }
            for (k, out) in out.iter_mut().enumerate() {
                for (l, (a, w)) in out.iter_mut().enumerate() {
                    *a += row[l].0 * nu[k][i];
                    *w += row[l].1 * nu[k][i];
                }
            }
        }
        let whole = out[0][0].1;
        out.map(|row| row.map(|(a, w)| (a / whole, w / whole)))
    }

    /// The point with its first and second derivatives, parameters clamped to the domain (NaN: its start).
    pub fn evaluate(&self, u: f64, v: f64) -> SurfacePoint {
        let h = self.homogeneous::<3>(u, v);
        let point = h[0][0].0;
        let du = h[1][0].0 - point * h[1][0].1;
        let dv = h[0][1].0 - point * h[0][1].1;
        SurfacePoint {
            point_mm: point,
            du,
            dv,
            duu: h[2][0].0 - du * (2.0 * h[1][0].1) - point * h[2][0].1,
            duv: h[1][1].0 - du * h[0][1].1 - dv * h[1][0].1 - point * h[1][1].1,
            dvv: h[0][2].0 - dv * (2.0 * h[0][1].1) - point * h[0][2].1,
        }
    }

    /// The curve `u = constant` (it runs along `v`).
    ///
    /// # Errors
    /// None that a valid surface meets: control points of the curve are means of its own.
    pub fn curve_at_u(&self, u: f64) -> Result<NurbsCurve<3>, NurbsError> {
        let (u, _) = self.clamp(u, f64::NAN);
        let span = basis::span(self.degree[0], &self.knots[0], u);
        let n = basis::values(self.degree[0], &self.knots[0], span, u);
        let first = span - self.degree[0];
        let line = (0..self.columns).map(|j| self.mean(&n, self.degree[0], |k| (first + k) * self.columns + j));
        self.curve(1, line.collect())
    }

    /// The curve `v = constant` (it runs along `u`).
    ///
    /// # Errors
    /// None that a valid surface meets.
    pub fn curve_at_v(&self, v: f64) -> Result<NurbsCurve<3>, NurbsError> {
        let (_, v) = self.clamp(f64::NAN, v);
        let span = basis::span(self.degree[1], &self.knots[1], v);
        let n = basis::values(self.degree[1], &self.knots[1], span, v);
        let first = span - self.degree[1];
        let line = (0..self.rows).map(|i| self.mean(&n, self.degree[1], |k| i * self.columns + first + k));
        self.curve(0, line.collect())
    }

    fn mean(&self, n: &basis::Row, degree: usize, index: impl Fn(usize) -> usize) -> (Vector3<f64>, f64) {
        let (mut a, mut w) = (Vector3::zeros(), 0.0);
        for (k, n) in n[..=degree].iter().enumerate() {
            let weighted = n * self.weight(index(k));
            a += self.points[index(k)] * weighted;
            w += weighted;
        }
        (a / w, w)
    }

    fn curve(&self, along: usize, line: Vec<(Vector3<f64>, f64)>) -> Result<NurbsCurve<3>, NurbsError> {
        let (points, weights) = line.into_iter().unzip();
        let weights = self.weights.is_some().then_some(weights);
        NurbsCurve::new(self.degree[along], self.knots[along].clone(), points, weights)
    }
}

impl SurfacePoint {
    /// Unit normal `Q_u × Q_v / |Q_u × Q_v|`; None where the surface has none (a pole, a fold).
    pub fn normal(&self) -> Option<Vector3<f64>> {
        let n = self.du.cross(&self.dv);
        let length = n.norm();
        (length > 1e-12 * self.du.norm() * self.dv.norm() && length > 0.0).then(|| n / length)
    }

    /// First and second fundamental forms `[E, F, G]`, `[L, M, N]`.
    fn forms(&self) -> Option<([f64; 3], [f64; 3])> {
        let n = self.normal()?;
        let first = [self.du.norm_squared(), self.du.dot(&self.dv), self.dv.norm_squared()];
        Some((first, [self.duu.dot(&n), self.duv.dot(&n), self.dvv.dot(&n)]))
    }

    /// Normal curvature \[1/mm\] in the direction of the tangent vector `direction` (its part along the normal is left out):
    /// `κ_n = (L a² + 2 M a b + N b²)/(E a² + 2 F a b + G b²)` for `direction = a Q_u + b Q_v`. Positive: the surface bends towards its
    /// normal. None where there is no normal or no direction.
    pub fn normal_curvature_1_mm(&self, direction: &Vector3<f64>) -> Option<f64> {
        let ([e, f, g], [l, m, n]) = self.forms()?;
        let right = Vector2::new(self.du.dot(direction), self.dv.dot(direction));
        let (a, b) = (g * right.x - f * right.y, e * right.y - f * right.x);
        let length = e * a * a + 2.0 * f * a * b + g * b * b;
        (length > 0.0).then(|| (l * a * a + 2.0 * m * a * b + n * b * b) / length)
    }

    /// Principal curvatures and directions; None where there is no normal.
    pub fn principal_curvatures(&self) -> Option<PrincipalCurvatures> {
        let normal = self.normal()?;
        // An orthonormal frame of the tangent plane: the shape operator is a symmetric matrix there.
        let x = self.du.normalize();
        let y = normal.cross(&x);
        // x = α Q_u, y = β Q_u + γ Q_v.
        let alpha = 1.0 / self.du.norm();
        let gamma = 1.0 / self.dv.dot(&y);
        let beta = -gamma * self.dv.dot(&x) * alpha;
        let (l, m, n) = (self.duu.dot(&normal), self.duv.dot(&normal), self.dvv.dot(&normal));
        let xx = alpha * alpha * l;
        let xy = alpha * (beta * l + gamma * m);
        let yy = beta * beta * l + 2.0 * beta * gamma * m + gamma * gamma * n;
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let apart = half.hypot(xy);
        let angle = 0.5 * libm::atan2(xy, half);
        let (sin, cos) = libm::sincos(angle);
        Some(PrincipalCurvatures {
            largest_1_mm: mean + apart,
            smallest_1_mm: mean - apart,
            largest_direction: x * cos + y * sin,
            smallest_direction: y * cos - x * sin,
        })
    }
}
