//! The ridge that a pass leaves, and how far away the next pass may be.
//!
//! All places are those of the tool axis in plan. A place `q` of that plane stands for the point `x(q)` of the surface that the
//! cutter touches when its axis is there; a pass at `p` leaves on `x(q)` the height `(z_p + g(|x - p|) - x_z) n_z`: what stands between
//! the cutter's bottom and the surface, along the surface's normal. On a plane of any slope that is the exact height of the ridge.
//! (Of a cutter with a sharp edge `x(q)` is the point under `q`: on a slope an upper bound, that passes further down improve on.)

use nalgebra::Vector2;

use super::{PlanError, StepForm};
use crate::toolpath::{Cutter, CutterError, DesignSurface, stepover};

pub(super) type Point = Vector2<f64>;

/// Largest step-over, in cutter radii.
const LARGEST_STEP: f64 = 1.9;

/// A surface, a cutter, and the ridge that it may leave.
pub(super) struct Site<'a> {
    pub(super) surface: &'a dyn DesignSurface,
    pub(super) cutter: Cutter,
    /// The body that every cutter displaced by at most the path tolerance contains: smaller by it on all sides.
    inner: Cutter,
    raise_mm: f64,
    /// Whether its edge is no rounder than the path tolerance. A slope is touched by the edge, which the smaller body does not hold: a place
    /// of the plane then stands for the point of the surface under it.
    sharp: bool,
    /// Largest ridge \[mm\].
    pub(super) scallop_mm: f64,
    /// Ridge that passes without error leave where displaced ones leave `scallop_mm` \[mm\].
    pub(super) planned_mm: f64,
}

/// The cutter at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    pub(super) at: Point,
    pub(super) tip_mm: f64,
    contact: nalgebra::Vector3<f64>,
    n_z: f64,
}

impl<'a> Site<'a> {
    pub(super) fn new(
        surface: &'a dyn DesignSurface,
        cutter: Cutter,
        scallop_mm: f64,
        path_tolerance_mm: f64,
    ) -> Result<Self, CutterError> {
        let (r, c, e, h) = (cutter.radius_mm(), cutter.corner_radius_mm(), path_tolerance_mm, scallop_mm);
        let sharp = c <= e;
        let inner = Cutter::bull_nose(r - e, (c - e).max(0.0))?;
        // On a plane: half a step-over of the smaller ball, (c-e)² - (c-h)², and the ridge of the whole one.
        let half_square = (2.0 * c - e - h) * (h - e);
        let planned_mm = if c > h { half_square / (c + (c * c - half_square).sqrt()) } else { h - e };
        Ok(Self { surface, cutter, inner, sharp, raise_mm: e, scallop_mm, planned_mm })
    }

    /// The cutter at rest with its axis there.
    pub(super) fn pass(&self, at: Point) -> Option<Pass> {
        let rest = self.surface.rest(&self.cutter, at.x, at.y)?;
        let (contact, normal) = if self.sharp {
            let top = self.surface.top(at.x, at.y)?;
            (nalgebra::Vector3::new(at.x, at.y, top.z_mm), top.normal)
        } else {
            (rest.contact_mm, rest.normal)
        };
        let finite = rest.tip_z_mm.is_finite() && contact.iter().chain(&normal).all(|x| x.is_finite());
        finite.then_some(Pass { at, tip_mm: rest.tip_z_mm, contact, n_z: normal.z })
    }

    /// What the pass leaves on the point touched from `of` \[mm\]; infinite where it does not reach.
    pub(super) fn left_mm(&self, pass: &Pass, of: &Pass) -> f64 {
        let rho = (of.contact.xy() - pass.at).norm();
        let Some(profile) = self.inner.profile_mm(rho) else { return f64::INFINITY };
        (pass.tip_mm + self.raise_mm + profile - of.contact.z) * of.n_z
    }

    /// The highest ridge between two passes \[mm\]: on the straight line between them, where both leave the same. Infinite where there is
    /// no rest between them.
    pub(super) fn ridge_mm(&self, a: &Pass, b: &Pass) -> f64 {
        let (mut low, mut high) = ((0.0, -1.0), (1.0, 1.0));
        let mut t = 0.5;
        let mut most = 0.0_f64;
        for _ in 0..8 {
            let Some(between) = self.pass(a.at + (b.at - a.at) * t) else { return f64::INFINITY };
            let (from_a, from_b) = (self.left_mm(a, &between), self.left_mm(b, &between));
            most = most.max(from_a.min(from_b));
            if from_a.is_infinite() && from_b.is_infinite() {
                return f64::INFINITY;
            }
            let apart = from_a - from_b;
            if apart.abs() < 1e-3 * self.scallop_mm {
                break;
            }
            if apart < 0.0 {
                low = (t, apart)
            } else {
                high = (t, apart)
            }
            // The secant, kept off the ends.
            let share = low.1 / (low.1 - high.1);
            let share = if share.is_finite() { share.max(0.1).min(0.9) } else { 0.5 };
            t = low.0 + (high.0 - low.0) * share;
        }
        most
    }

    /// Plan distance to the next pass in direction `normal` \[mm\]. None where the surface tells nothing: it ends there.
    pub(super) fn step_mm(&self, form: StepForm, pass: &Pass, normal: Point) -> Result<Option<f64>, PlanError> {
        match form {
            StepForm::Measured => Ok(self.measured_mm(pass, normal)),
            StepForm::Exact | StepForm::Fast => self.formula_mm(form, pass, normal),
        }
    }

    /// Step-over on a horizontal plane \[mm\].
    pub(super) fn flat_step_mm(&self) -> f64 {
        let (r, c, h) = (self.cutter.radius_mm(), self.cutter.corner_radius_mm(), self.planned_mm);
        let round = if c > h { (h * (2.0 * c - h)).sqrt() } else { c };
        (2.0 * (r - c + round)).min(LARGEST_STEP * r)
    }

    fn measured_mm(&self, pass: &Pass, normal: Point) -> Option<f64> {
        let h = self.scallop_mm;
        let (mut low, mut high) = (0.0, LARGEST_STEP * self.cutter.radius_mm());
        let mut step = self.flat_step_mm();
        for _ in 0..14 {
            let ridge = self.pass(pass.at + normal * step).map(|next| self.ridge_mm(pass, &next));
            let ridge = ridge.unwrap_or(f64::INFINITY);
            if ridge <= h {
                low = step;
                if ridge > 0.996 * h {
                    break;
                }
            } else {
                high = step;
            }
            if high - low < 2e-3 * high {
                break;
            }
            // Ridges grow with the square of the distance.
            let guess = step * (0.998 * h / ridge).sqrt();
            step = if guess > low && guess < high { guess } else { 0.5 * (low + high) };
        }
        (low > 0.0).then_some(low)
    }

    /// With the normal curvature of the surface across the path, by a second difference at the scale of the step-over. The step-over
    /// between contacts becomes that of the ball's centres, `(R + r)/R` times as long, and that its part in plan: across the path the
    /// slopes `z_n` and, along it, `z_t` lengthen a plan distance by `√(1 + z_n²/(1 + z_t²))`.
    fn formula_mm(&self, form: StepForm, pass: &Pass, normal: Point) -> Result<Option<f64>, PlanError> {
        if !self.cutter.is_ball() {
            return Err(PlanError::FormulaNeedsBall);
        }
        let (r, h) = (self.cutter.radius_mm(), self.planned_mm);
        let flat = self.flat_step_mm();
        let scale = 0.25 * flat;
        let along = Point::new(normal.y, -normal.x);
        let top = |at: Point| self.surface.top(at.x, at.y).map(|top| top.z_mm);
        let slopes = |at: Point, direction: Point| Some((top(at + direction)? - top(at - direction)?) / (2.0 * scale));
        let x = pass.contact.xy();
        let (Some(here), Some(across), Some(lengthways)) =
            (top(x), slopes(x, normal * scale), slopes(x, along * scale))
        else {
            return Ok(None);
        };
        // Perpendicular to the path within the surface, seen in plan.
        let lean = across * lengthways / (1.0 + lengthways * lengthways);
        let direction = normal - along * lean;
        let (Some(ahead), Some(behind)) = (top(x + direction * scale), top(x - direction * scale)) else {
            return Ok(None);
        };
        let second = (ahead - 2.0 * here + behind) / (scale * scale);
        let rise = across - lean * lengthways;
        let n_z = 1.0 / (1.0 + across * across + lengthways * lengthways).sqrt();
        let curvature = -second * n_z / (direction.norm_squared() + rise * rise);
        let radius = if curvature.abs() < 1e-9 { f64::INFINITY } else { 1.0 / curvature };
        let step = match form {
            StepForm::Fast => stepover::fast_mm(r, h, radius),
            _ => stepover::exact_mm(r, h, radius),
        };
        let contacts = step.map_err(|source| PlanError::StepOver { x_mm: x.x, y_mm: x.y, source })?;
        let centres = contacts * (1.0 + r * curvature);
        let in_plan = centres / (1.0 + across * across / (1.0 + lengthways * lengthways)).sqrt();
        Ok(Some(in_plan.min(LARGEST_STEP * r)))
    }
}
