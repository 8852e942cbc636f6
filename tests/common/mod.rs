//! What several tests share: the reference runs and the paper's parameters.
#![allow(dead_code, unreachable_pub)] // each test binary uses its own part

pub mod drive;
pub mod folder;
pub mod regions;
pub mod scenario;
pub mod sweep;

use nalgebra::Vector2;
use serde_json::Value;
use servosim::feedrate::{Motion, Profile};
use servosim::path::{Path, PhSpline};
use servosim::servo::{AxisParameters, Drive, LoopSettings, Pdff, Plant};
use servosim::simulation::Simulation;

/// The control points of alpha (open).
pub const ALPHA: [[f64; 2]; 7] = [[0., 0.], [12., 18.], [24., 27.], [36., 9.], [24., -9.], [12., 0.], [0., 18.]];

/// The control points of heart (closed).
pub const HEART: [[f64; 2]; 8] =
    [[-20., -50.], [0., -5.], [0., 5.], [-20., 50.], [40., 50.], [75., 5.], [75., -5.], [40., -50.]];

/// The exponential profile of the paper's runs.
pub const PROFILE: Profile = Profile::Exponential { phase_s: 0.1, n_c: 8.12 };

/// One of the paper's two runs.
pub struct Case {
    pub name: &'static str,
    pub path: PhSpline,
    pub axes: [AxisParameters; 2],
    pub reference: Value,
}

impl Case {
    pub fn alpha() -> Self {
        Self {
            name: "alpha",
            path: PhSpline::from_control_points(&ALPHA.map(Vector2::from), false).unwrap(),
            axes: axes([97.38, 1.19, 252.8, 0.8, 0.85], [97.38, 1.53, 253.2, 0.8, 0.85]),
            reference: serde_json::from_str(include_str!("../reference/alpha.json")).unwrap(),
        }
    }

    pub fn heart() -> Self {
        Self {
            name: "heart",
            path: PhSpline::from_control_points(&HEART.map(Vector2::from), true).unwrap(),
            axes: axes([109.95, 1.2, 252.0, 0.8, 0.85], [109.95, 1.5, 253.0, 0.8, 0.85]),
            reference: serde_json::from_str(include_str!("../reference/heart.json")).unwrap(),
        }
    }

    pub fn both() -> [Self; 2] {
        [Self::alpha(), Self::heart()]
    }

    pub fn motion(&self, profile: Profile) -> Motion {
        Motion::plan(self.path.length_mm(), 100.0, profile).unwrap()
    }

    pub fn simulation(&self, profile: Profile) -> Simulation<'_, 2> {
        Simulation::new(&self.path, &self.motion(profile), self.axes, LoopSettings::default()).unwrap()
    }
}

/// The two axes of the paper with these gains (kpp, kpv, kiv, kpf, kvf).
pub fn axes(x: [f64; 5], y: [f64; 5]) -> [AxisParameters; 2] {
    let axis = |gain_rad_s_v, time_constant_s, [kpp, kpv, kiv, kpf, kvf]: [f64; 5]| AxisParameters {
        plant: Plant { gain_rad_s_v, time_constant_s },
        drive: Drive::default(),
        pdff: Pdff { kpp_rad_s_mm: kpp, kpv_nm_s_rad: kpv, kiv_1_s: kiv, kpf_rad_mm: kpf, kvf },
    };
    [axis(83.0089, 0.19936, x), axis(50.4977, 0.15641, y)]
}

/// A list of numbers.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// A list of planar points.
pub fn points(value: &Value) -> Vec<Vector2<f64>> {
    value.as_array().unwrap().iter().map(|v| Vector2::from_vec(numbers(v))).collect()
}

/// A random smooth-ish path of nodal points: a random walk whose chords turn by at most `turn` rad and differ in length by
/// at most a factor of 2.
pub fn random_walk(rng: &mut rand_xoshiro::Xoshiro256PlusPlus, count: usize, turn: f64) -> Vec<Vector2<f64>> {
    use rand::RngExt;
    let (mut angle, mut point) = (rng.random_range(-3.0..3.0_f64), Vector2::new(0.0, 0.0));
    let scale = 10.0_f64.powf(rng.random_range(-1.0..2.0));
    (0..count)
        .map(|_| {
            let here = point;
            angle += rng.random_range(-turn..turn);
            point += Vector2::new(angle.cos(), angle.sin()) * scale * rng.random_range(1.0..2.0);
            here
        })
        .collect()
}

/// A random closed path of nodal points around the origin.
pub fn random_ring(rng: &mut rand_xoshiro::Xoshiro256PlusPlus, count: usize) -> Vec<Vector2<f64>> {
    use rand::RngExt;
    let scale = 10.0_f64.powf(rng.random_range(0.0..2.0));
    (0..count)
        .map(|i| {
            let angle = std::f64::consts::TAU * (i as f64 + rng.random_range(-0.2..0.2)) / count as f64;
            Vector2::new(angle.cos(), angle.sin()) * scale * rng.random_range(0.7..1.3)
        })
        .collect()
}
