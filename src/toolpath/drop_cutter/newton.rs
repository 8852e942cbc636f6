//! Contacts by Newton's method: good places, not proofs.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::facet::Profile;
use super::net::{Jet, Net};

/// A place where the cutter could touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Height of the tip.
    pub(super) tip: f64,
    /// Parameters of the net.
    pub(super) own: Vector2<f64>,
    pub(super) jet: Jet,
}

impl Jet {
    /// Unit normal, upwards; Z where there is none.
    pub(super) fn normal(&self) -> Vector3<f64> {
        let n = self.d[0].cross(&self.d[1]);
        let least = 1e-12 * self.d[0].norm() * self.d[1].norm();
        n.try_normalize(least).map_or(Vector3::z(), |n| if n.z < 0.0 { -n } else { n })
    }
}

/// The point at the net's own parameters; None where it is not under the cutter (rounding allowed: a flat end touches with its rim).
pub(super) fn place(net: &Net, profile: &Profile, axis: Vector2<f64>, own: Vector2<f64>) -> Option<Place> {
    let jet = net.jet(own);
    let rho = (jet.point.xy() - axis).norm();
    (rho <= profile.radius * (1.0 + 1e-11)).then(|| Place { tip: jet.point.z - profile.height(rho), own, jet })
}

/// Uphill on `f = Q_z - g` from the middle of a net, within it.
pub(super) fn climb(net: &Net, profile: &Profile, axis: Vector2<f64>) -> Option<Place> {
    let mut here = enter(net, profile, axis)?;
    for _ in 0..16 {
        let (gradient, m) = model(profile, axis, &here.jet);
        let pressed =
            |k: usize| (here.own[k] <= 0.0 && gradient[k] <= 0.0) || (here.own[k] >= 1.0 && gradient[k] >= 0.0);
        let single = |k: usize| if pressed(k) { 0.0 } else { gradient[k] / m[(k, k)].abs().max(f64::MIN_POSITIVE) };
        let det = m.determinant();
        let mut step = Vector2::new(single(0), single(1));
        if !pressed(0) && !pressed(1) {
            if m.m11 > 0.0 && det > 1e-9 * m.m11 * m.m22 {
                step = Vector2::new(m.m22 * gradient.x - m.m12 * gradient.y, m.m11 * gradient.y - m.m12 * gradient.x)
                    / det;
            } else {
                step *= 0.5;
            }
        }
        let mut found = None;
        for _ in 0..10 {
            let own = (here.own + step).map(|x| x.max(0.0).min(1.0));
            if own == here.own {
                break;
            }
            found = place(net, profile, axis, own).filter(|next| next.tip > here.tip);
            if found.is_some() {
                break;
            }
            step *= 0.25;
        }
        let Some(next) = found else { break };
        let moved = (next.own - here.own).amax();
        here = next;
        if moved < 1e-9 {
            break;
        }
    }
    Some(here)
}

/// From the middle towards the axis until the point is under the cutter.
fn enter(net: &Net, profile: &Profile, axis: Vector2<f64>) -> Option<Place> {
    let mut own = Vector2::repeat(0.5);
    for _ in 0..6 {
        let jet = net.jet(own);
        let d = jet.point.xy() - axis;
        let rho = d.norm();
        if rho <= profile.radius {
            return Some(Place { tip: jet.point.z - profile.height(rho), own, jet });
        }
        let inverse = Matrix2::from_columns(&[jet.d[0].xy(), jet.d[1].xy()]).try_inverse()?;
        let next = (own - inverse * d * (1.0 - 0.95 * profile.radius / rho)).map(|x| x.max(0.0).min(1.0));
        if next == own {
            return None;
        }
        own = next;
    }
    None
}

/// Gradient of `f` over the parameters, and minus its Hessian.
fn model(profile: &Profile, axis: Vector2<f64>, jet: &Jet) -> (Vector2<f64>, Matrix2<f64>) {
    let d = jet.point.xy() - axis;
    let rho = d.norm();
    let out = if rho > 0.0 { d / rho } else { Vector2::x() };
    let (sin, cos) = profile.slope(rho);
    let cos = cos.max(1e-6);
    let slope = sin / cos;
    let (radial, around) = if profile.corner == 0.0 {
        (0.0, 0.0)
    } else if profile.flat == 0.0 {
        (1.0 / (profile.corner * cos * cos * cos), 1.0 / (profile.corner * cos))
    } else if sin > 0.0 {
        (1.0 / (profile.corner * cos * cos * cos), slope / rho)
    } else {
        (0.0, 0.0)
    };
    let along = jet.d.map(|d| d.xy().dot(&out));
    let across = jet.d.map(|d| out.perp(&d.xy()));
    let rise = |q: &Vector3<f64>| q.z - slope * q.xy().dot(&out);
    let bend = |a: usize, b: usize| radial * along[a] * along[b] + around * across[a] * across[b];
    let m12 = bend(0, 1) - rise(&jet.dd[1]);
    (
        Vector2::new(rise(&jet.d[0]), rise(&jet.d[1])),
        Matrix2::new(bend(0, 0) - rise(&jet.dd[0]), m12, m12, bend(1, 1) - rise(&jet.dd[2])),
    )
}

/// A contact with a flat or bull-nose end away from its disc: `Q_xy + c n_xy + a n_xy / |n_xy|` is the axis, with the unit normal
/// `n` (the offset surface by Newton).
pub(super) fn offset(net: &Net, profile: &Profile, axis: Vector2<f64>) -> Option<Place> {
    let mut own = Vector2::repeat(0.5);
    for _ in 0..10 {
        let jet = net.jet(own);
        let [du, dv] = jet.d;
        let [duu, duv, dvv] = jet.dd;
        let n = du.cross(&dv);
        let turn = if n.z < 0.0 { -1.0 } else { 1.0 };
        let length = n.norm() * turn;
        let unit = n / length;
        let flat = unit.xy().norm();
        if !(flat > 1e-9) {
            return None;
        }
        let out = unit.xy() / flat;
        let side = |n1: Vector3<f64>| {
            let unit1 = ((n1 - unit * unit.dot(&n1)) / length).xy();
            unit1 * profile.corner + (unit1 - out * out.dot(&unit1)) * (profile.flat / flat)
        };
        let columns =
            [du.xy() + side(duu.cross(&dv) + du.cross(&duv)), dv.xy() + side(duv.cross(&dv) + du.cross(&dvv))];
        let miss = jet.point.xy() + unit.xy() * profile.corner + out * profile.flat - axis;
        let step = Matrix2::from_columns(&columns).try_inverse()? * miss;
        let next = (own - step).map(|x| x.max(-0.5).min(1.5));
        let moved = (next - own).amax();
        own = next;
        if moved < 1e-12 {
            let inside = own.map(|x| x.max(0.0).min(1.0));
            return ((inside - own).amax() < 1e-9).then(|| place(net, profile, axis, inside)).flatten();
        }
    }
    None
}
