//! The machining check: pieces of a path a second, and cells of a map.

use nalgebra::Vector3;
use servosim::machining::{DeviationMap, HeightField};
use servosim::toolpath::{ContactLocation, Cutter, DesignSurface, SurfaceTop};

use crate::{fastest, seconds};

/// Level ground.
struct Ground;

impl DesignSurface for Ground {
    fn bounds_mm(&self) -> [Vector3<f64>; 2] {
        [Vector3::zeros(), Vector3::new(80.0, 80.0, 0.0)]
    }

    fn top(&self, _: f64, _: f64) -> Option<SurfaceTop> {
        Some(SurfaceTop { z_mm: 0.0, normal: Vector3::z() })
    }

    fn rest(&self, _: &Cutter, x_mm: f64, y_mm: f64) -> Option<ContactLocation> {
        Some(ContactLocation { tip_z_mm: 0.0, contact_mm: Vector3::new(x_mm, y_mm, 0.0), normal: Vector3::z() })
    }
}

/// Passes of 80 mm in pieces of 0.05 mm, on hills as steep as `slope`.
fn path(pieces: usize, slope: f64) -> Vec<Vector3<f64>> {
    (0..=pieces)
        .map(|i| {
            let (pass, along) = (i / 1600, 0.05 * (i % 1600) as f64);
            let x = if pass % 2 == 0 { along } else { 80.0 - along };
            Vector3::new(x, 2.0 + 2.4 * (pass % 32) as f64, 10.0 * slope * (0.1 * x).sin())
        })
        .collect()
}

pub(crate) fn bench(quick: bool) {
    let (pieces, rounds) = if quick { (2000, 1) } else { (50_000, 3) };
    let cutters = [
        ("ball", Cutter::ball(5.0).expect("a cutter")),
        ("flat", Cutter::flat(5.0).expect("a cutter")),
        ("bull-nose", Cutter::bull_nose(5.0, 1.0).expect("a cutter")),
    ];
    for (name, cutter) in cutters {
        for slope in [0.0, 0.3, 1.0] {
            let path = path(pieces, slope);
            let time = fastest((0..rounds).map(|_| {
                seconds(|| {
                    let mut field = HeightField::new([0.0; 2], [80.0; 2], 0.1).expect("a field");
                    field.cut_along(&cutter, &path).expect("a path");
                    field.heights_mm().len()
                })
                .0
            }));
            println!(
                "removal, {name:9} slope {slope:3.1}  {time:8.3} s for {pieces} pieces of 0.05 mm, r = 5 mm, cells of 0.1 mm  ({:.2} µs each)",
                1e6 * time / pieces as f64
            );
        }
    }
    let mut field = HeightField::new([0.0; 2], [80.0; 2], 0.1).expect("a field");
    field.cut_along(&cutters[0].1, &path(pieces, 0.3)).expect("a path");
    let (time, map) = seconds(|| DeviationMap::of(&mut field, &Ground, None));
    let (metrics, _) = seconds(|| map.metrics(-10.0..=250.0));
    println!("removal, map of {} cells  {:.3} s, metrics {metrics:.3} s", map.values_um().len(), time);
}
