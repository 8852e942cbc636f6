//! The drop cutter: points a second on a mesh of 100,000 triangles and on a bicubic patch. The peer's side on the same mesh and the
//! same points is `tests/drop_opencamlib.py`; with `SERVOSIM_DROP_HEIGHTS=file` the heights are written for it.

use std::io::Write;

use nalgebra::{Vector2, Vector3};
use servosim::path::NurbsSurface;
use servosim::toolpath::drop_cutter::{MeshSurface, NurbsDesign, rests};
use servosim::toolpath::mesh::Mesh;
use servosim::toolpath::{Cutter, DesignSurface};

use crate::{fastest, seconds};

/// Quads of the mesh each way: 99,904 triangles, 100 mm.
const QUADS: u32 = 223;

fn height(x: f64, y: f64) -> f64 {
    3.0 * (x / 7.0).sin() * (y / 9.0).cos() + 0.3 * (x / 1.5).sin() * (y / 1.7).sin()
}

fn mesh() -> Mesh {
    let step = 100.0 / f64::from(QUADS);
    let line = QUADS + 1;
    let vertices: Vec<_> = (0..line * line)
        .map(|i| {
            let (x, y) = (step * f64::from(i / line), step * f64::from(i % line));
            Vector3::new(x, y, height(x, y))
        })
        .collect();
    let triangles: Vec<_> = (0..QUADS * QUADS)
        .flat_map(|i| {
            let a = i / QUADS * line + i % QUADS;
            [[a, a + line, a + line + 1], [a, a + line + 1, a + 1]]
        })
        .collect();
    Mesh::new(&vertices, &triangles).expect("a mesh")
}

fn patch() -> NurbsDesign {
    let points: Vec<Vec<_>> = (0..6)
        .map(|i| {
            let point = |j| {
                let (x, y) = (16.0 * f64::from(i), 16.0 * f64::from(j));
                Vector3::new(x, y, 6.0 * (x / 17.0).sin() * (y / 21.0).cos())
            };
            (0..6).map(point).collect()
        })
        .collect();
    let knots = vec![0., 0., 0., 0., 1., 2., 3., 3., 3., 3.];
    let surface = NurbsSurface::new([3, 3], [knots.clone(), knots], &points, None).expect("a patch");
    NurbsDesign::new(&surface).expect("a patch")
}

/// A grid of points over `0 … width`.
fn grid(count: u32, width: f64) -> Vec<Vector2<f64>> {
    let step = width / f64::from(count);
    (0..count * count)
        .map(|i| Vector2::new((f64::from(i / count) + 0.5) * step, (f64::from(i % count) + 0.5) * step))
        .collect()
}

pub(crate) fn bench(quick: bool) {
    let cutters = [
        ("ball", Cutter::ball(5.0).expect("a cutter")),
        ("flat", Cutter::flat(5.0).expect("a cutter")),
        ("bull-nose", Cutter::bull_nose(5.0, 1.0).expect("a cutter")),
    ];
    let rounds = if quick { 1 } else { 5 };
    let mesh = mesh();
    let (build, on_mesh) = seconds(|| MeshSurface::new(&mesh));
    println!("drop, tree over {} triangles {:.0} ms", mesh.triangles().len(), build * 1e3);
    let points = grid(if quick { 20 } else { 200 }, 100.0);
    let heights = std::env::var_os("SERVOSIM_DROP_HEIGHTS");
    let mut file = heights.map(|path| std::fs::File::create(path).expect("a file"));
    for (name, cutter) in &cutters {
        let run = || seconds(|| rests(&on_mesh, cutter, &points));
        let time = fastest((0..rounds).map(|_| run().0));
        println!("drop, mesh, {name:<9} {:>10.0} points/s on all cores", points.len() as f64 / time);
        for rest in run().1.iter().flatten() {
            if let Some(file) = &mut file {
                writeln!(file, "{name},{}", rest.tip_z_mm).expect("a line")
            }
        }
    }
    let patch = patch();
    for (name, cutter) in &cutters {
        let few = if quick || *name != "ball" { 20 } else { 150 };
        let points = grid(few, 80.0);
        let run = || seconds(|| points.iter().filter_map(|at| patch.rest(cutter, at.x, at.y)).count());
        let time = fastest((0..rounds).map(|_| run().0));
        let promise = if *name == "ball" { "  (promised: 50000)" } else { "" };
        println!("drop, NURBS, {name:<9} {:>9.0} points/s on one core{promise}", points.len() as f64 / time);
    }
}
