//! Forty nested rings of contours with ten thousand vertices, and whether all of them are closed.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::toolpath::guide::{Area, Contour, Piece, Region};

use crate::{fastest, seconds};

const LEVELS: u32 = 40;

pub(crate) fn bench(quick: bool) {
    let vertices = if quick { 400 } else { 10_000 };
    for (name, points) in contours(vertices) {
        let make = || {
            let contour = Contour::polygon(&points).expect("a contour");
            Region::new(contour, Vec::new()).expect("a region")
        };
        let step_mm = make().depth_mm().expect("a depth").0 / f64::from(LEVELS + 1);
        let mut counts = (0, 0, 0);
        let time = fastest((0..if quick { 1 } else { 5 }).map(|_| {
            let (time, levels) = seconds(|| nested(&make(), step_mm));
            let closed: Vec<bool> =
                levels.iter().flatten().flat_map(Area::rings).map(|r| closed(&r.pieces())).collect();
            counts = (levels.len(), closed.len(), closed.iter().filter(|closed| !**closed).count());
            time
        }));
        let (levels, rings, open) = counts;
        println!(
            "guide, {name:<12} {vertices} vertices, {levels} levels {step_mm:.3} mm apart, {rings} rings: {time:.3} s, {open} open  (promised: 0.5 s, 0)"
        );
    }
}

/// The areas of each level, until nothing is left or all levels are there.
fn nested(region: &Region, step_mm: f64) -> Vec<Vec<Area>> {
    let mut levels = vec![region.inset(step_mm).expect("an inset")];
    while levels.len() < LEVELS as usize {
        let last = &levels[levels.len() - 1];
        let next: Vec<Area> = last.iter().flat_map(|area| area.inset(step_mm).expect("an inset")).collect();
        if next.is_empty() {
            break;
        }
        levels.push(next);
    }
    levels
}

fn closed(pieces: &[Piece]) -> bool {
    let ends = |piece: &Piece| match piece {
        Piece::Line { start_mm, end_mm } | Piece::Arc { start_mm, end_mm, .. } => (*start_mm, *end_mm),
        Piece::Curve(curve) => (curve.point_mm(curve.domain().0), curve.point_mm(curve.domain().1)),
    };
    let next = pieces.iter().cycle().skip(1);
    pieces.iter().zip(next).all(|(piece, next)| ends(piece).1 == ends(next).0)
}

fn contours(vertices: u32) -> Vec<(&'static str, Vec<Vector2<f64>>)> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut polar = |radius: &dyn Fn(f64) -> f64, noise: f64| -> Vec<Vector2<f64>> {
        (0..vertices)
            .map(|i| {
                let angle = TAU * f64::from(i) / f64::from(vertices);
                let r = radius(angle) + noise * (random.random::<f64>() - 0.5);
                Vector2::new(r * angle.cos(), r * angle.sin())
            })
            .collect()
    };
    vec![
        ("circle", polar(&|_| 50.0, 0.0)),
        ("wavy", polar(&|a| 50.0 + 5.0 * (7.0 * a).sin() + 2.0 * (31.0 * a).cos(), 0.0)),
        ("star", polar(&|a| 30.0 + 20.0 * (5.0 * a).sin().powi(3), 0.0)),
        ("noisy circle", polar(&|_| 50.0, 0.05)),
        ("noisy star", polar(&|a| 40.0 + 10.0 * (5.0 * a).sin() + 3.0 * (13.0 * a).sin(), 0.2)),
        ("very noisy", polar(&|_| 50.0, 10.0)),
    ]
}
