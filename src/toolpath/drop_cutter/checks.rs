//! What a user needs to know of a surface before planning: where it folds, and the largest ball that fits.

use nalgebra::{Vector2, Vector3};

use super::bound::Plan;
use super::nurbs::{NurbsDesign, Piece};
use crate::path::nurbs::SurfacePoint;
use crate::toolpath::{Cutter, DesignSurface};

/// Where a surface is hollowest, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Concavity {
    /// Radius of the hollow \[mm\]: that of the largest ball that fits.
    pub radius_mm: f64,
    /// The place \[mm\].
    pub point_mm: Vector3<f64>,
    /// Its parameters `(u, v)`.
    pub parameters: [f64; 2],
    /// Unit direction along the surface in which it is hollowest.
    pub direction: Vector3<f64>,
}

/// What stands against machining a surface from above with a cutter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceFault {
    /// The surface stands upright or overhangs.
    #[error(
        "the surface stands upright or folds over itself at x {:.4}, y {:.4}, z {:.4} mm (u = {:.6}, v = {:.6}): seen from above only its highest \
         sheet can be machined; trim it there or turn the part",
        .point_mm.x, .point_mm.y, .point_mm.z, .parameters[0], .parameters[1]
    )]
    Fold {
        /// The place \[mm\].
        point_mm: Vector3<f64>,
        /// Its parameters `(u, v)`.
        parameters: [f64; 2],
    },
    /// The surface has no normal.
    #[error(
        "the surface has no normal at x {:.4}, y {:.4}, z {:.4} mm (u = {:.6}, v = {:.6}): control points coincide or lie in line there (a pole, \
         a collapsed edge); pull them apart",
        .point_mm.x, .point_mm.y, .point_mm.z, .parameters[0], .parameters[1]
    )]
    Degenerate {
        /// The place \[mm\].
        point_mm: Vector3<f64>,
        /// Its parameters `(u, v)`.
        parameters: [f64; 2],
    },
    /// The cutter does not fit into a hollow.
    #[error(
        "a cutter of radius {cutter_mm} mm does not fit at x {:.4}, y {:.4}, z {:.4} mm (u = {:.6}, v = {:.6}): the surface is hollow with a radius \
         of {:.4} mm there, and the largest ball that fits everywhere has that radius; take a smaller cutter, or accept what it leaves",
        .hollow.point_mm.x, .hollow.point_mm.y, .hollow.point_mm.z, .hollow.parameters[0], .hollow.parameters[1], .hollow.radius_mm
    )]
    CutterTooLarge {
        /// Its radius \[mm\].
        cutter_mm: f64,
        /// The hollow.
        hollow: Concavity,
    },
}

/// Places looked at along each way of a piece.
const SAMPLES: u32 = 3;
/// Places that are improved.
const CANDIDATES: usize = 8;
/// A part so small is a place \[mm\].
const PLACE_MM: f64 = 1e-6;

impl NurbsDesign {
    /// Where the surface is hollowest seen from above: the largest principal curvature `κ` bending upwards over the whole surface, the
    /// radius `1/κ`. None where it is hollow nowhere.
    ///
    /// Found from 9 places on each of some 2000 pieces and improved from the best 8 by a search; not proven.
    pub fn hollowest(&self) -> Option<Concavity> {
        let mut places: Vec<(f64, Vector2<f64>, Vector2<f64>)> = Vec::new();
        for piece in &self.pieces {
            for k in 0..SAMPLES * SAMPLES {
                let own = Vector2::new(f64::from(k / SAMPLES), f64::from(k % SAMPLES)) / f64::from(SAMPLES - 1);
                let at = piece.net.parameters(own);
                if let Some((curvature, _)) = self.upwards(at) {
                    places.push((curvature, at, piece.net.size));
                }
            }
        }
        places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.x.total_cmp(&b.1.x)).then(a.1.y.total_cmp(&b.1.y)));
        let improved =
            places.iter().take(CANDIDATES).map(|&(curvature, at, size)| self.improve(curvature, at, size * 0.5));
        let (curvature, at) = improved.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
        let here = self.surface().evaluate(at.x, at.y);
        let (_, direction) = self.upwards(at)?;
        // Flat up to rounding is not hollow.
        (curvature > 1e-9).then(|| Concavity {
            radius_mm: 1.0 / curvature,
            point_mm: here.point_mm,
            parameters: at.into(),
            direction,
        })
    }

    /// Steps along the parameters, halved where none helps.
    fn improve(&self, mut curvature: f64, mut at: Vector2<f64>, mut step: Vector2<f64>) -> (f64, Vector2<f64>) {
        let domain = self.surface().domain();
        for _ in 0..400 {
            let tries = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|way| {
                let mut next = at + Vector2::from(way).component_mul(&step);
                for (x, (low, high)) in next.iter_mut().zip(domain) {
                    *x = x.max(low).min(high)
                }
                (self.upwards(next).map_or(f64::NEG_INFINITY, |found| found.0), next)
            });
            let best = tries.into_iter().fold((curvature, at), |best, next| if next.0 > best.0 { next } else { best });
            if best.0 > curvature {
                (curvature, at) = best;
            } else {
                step *= 0.5;
                if step.amax() < 1e-12 {
                    break;
                }
            }
        }
        (curvature, at)
    }

    /// A place where the surface stands upright, overhangs or has no normal; None where its normal surely points to one side of the
    /// horizontal everywhere: proven on every piece by bounds of its Jacobian in plan.
    pub fn fold(&self) -> Option<SurfaceFault> {
        let mut sign = 0.0;
        let mut other = None;
        for piece in &self.pieces {
            let mut waiting = vec![piece.clone()];
            while let Some(part) = waiting.pop() {
                let turn = turn(&part);
                if turn == 0.0 && part.size() > PLACE_MM {
                    waiting.extend(part.halves());
                } else if turn == 0.0 {
                    return Some(self.fault(&part));
                } else if sign == 0.0 {
                    sign = turn;
                } else if turn != sign && other.is_none() {
                    other = Some(part);
                }
            }
        }
        // Sides change at a crease, without a place that stands upright.
        other.map(|part| self.fault(&part))
    }

    /// The largest curvature towards the upper side, and its direction; None where the surface stands upright or has no normal.
    fn upwards(&self, at: Vector2<f64>) -> Option<(f64, Vector3<f64>)> {
        let here = self.surface().evaluate(at.x, at.y);
        let normal = here.normal().filter(|normal| normal.z.abs() > 1e-9 && !self.is_degenerate(&here))?;
        let principal = here.principal_curvatures()?;
        Some(if normal.z < 0.0 {
            (-principal.smallest_1_mm, principal.smallest_direction)
        } else {
            (principal.largest_1_mm, principal.largest_direction)
        })
    }

    /// Whether the area that a parameter step spans is next to none, against what the surface's size would give.
    fn is_degenerate(&self, here: &SurfacePoint) -> bool {
        let [(u0, u1), (v0, v1)] = self.surface().domain();
        let [low, high] = self.bounds_mm();
        here.du.cross(&here.dv).norm() * (u1 - u0) * (v1 - v0) < 1e-6 * (high - low).norm_squared()
    }

    fn fault(&self, part: &Piece) -> SurfaceFault {
        let parameters = part.net.parameters(Vector2::repeat(0.5));
        let here = self.surface().evaluate(parameters.x, parameters.y);
        let (point_mm, parameters) = (here.point_mm, parameters.into());
        if self.is_degenerate(&here) {
            SurfaceFault::Degenerate { point_mm, parameters }
        } else {
            SurfaceFault::Fold { point_mm, parameters }
        }
    }

    /// Whether the surface can be machined from above with a cutter: no fold, and no hollow narrower than its radius.
    ///
    /// # Errors
    /// The first fault, with its place; for a cutter that is too large also the largest ball that fits.
    pub fn check(&self, cutter: &Cutter) -> Result<(), SurfaceFault> {
        if let Some(fault) = self.fold() {
            return Err(fault);
        }
        match self.hollowest().filter(|hollow| hollow.radius_mm < cutter.radius_mm()) {
            Some(hollow) => Err(SurfaceFault::CutterTooLarge { cutter_mm: cutter.radius_mm(), hollow }),
            None => Ok(()),
        }
    }
}

/// The sign of the normal's z all over a part; 0 where that is not certain.
fn turn(part: &Piece) -> f64 {
    let [low, high] = part.bounds;
    // w Q_s = D_s - w_s (Q - x): the second part counts as spread.
    let [p, q] = part.net.degree;
    let weights = |i: usize, j: usize| part.net.points[i * (q + 1) + j].w;
    let mut steps = 0.0_f64;
    for i in 0..=p {
        for j in 0..=q {
            if i < p {
                steps = steps.max(p as f64 * (weights(i + 1, j) - weights(i, j)).abs())
            }
            if j < q {
                steps = steps.max(q as f64 * (weights(i, j + 1) - weights(i, j)).abs())
            }
        }
    }
    let plan = Plan::new(&part.net, (low.xy() + high.xy()) * 0.5);
    let spread = plan.spread + std::f64::consts::SQRT_2 * steps * 0.5 * (high - low).xy().norm() / plan.least;
    if spread < 1.0 { plan.jacobian.determinant().signum() } else { 0.0 }
}
