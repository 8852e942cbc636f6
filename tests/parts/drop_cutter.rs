//! The drop cutter on meshes and NURBS surfaces: closed forms, a dense check that nothing is gouged, two routes to one height, STL,
//! and the checks before planning.

use nalgebra::{Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::path::NurbsSurface;
use servosim::toolpath::drop_cutter::{MeshSurface, NurbsDesign, SurfaceFault, rests};
use servosim::toolpath::mesh::{Mesh, MeshError};
use servosim::toolpath::{Cutter, DesignSurface};

type Rng = Xoshiro256PlusPlus;

fn cutters(rng: &mut Rng) -> [Cutter; 3] {
    let radius = rng.random_range(0.5..8.0);
    [
        Cutter::ball(radius).unwrap(),
        Cutter::flat(radius).unwrap(),
        Cutter::bull_nose(radius, radius * rng.random_range(0.05..0.95)).unwrap(),
    ]
}

fn mesh_of(triangles: &[[Vector3<f64>; 3]]) -> MeshSurface {
    let vertices: Vec<_> = triangles.iter().flatten().copied().collect();
    let indices: Vec<_> = (0..u32::try_from(triangles.len()).unwrap()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    MeshSurface::new(&Mesh::new(&vertices, &indices).unwrap())
}

fn random_point(rng: &mut Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

/// Highest `z - g` over points on a triangle's edges and inside, by brute force with a shrinking window.
fn brute(cutter: &Cutter, [a, b, c]: &[Vector3<f64>; 3], x: f64, y: f64) -> f64 {
    let f = |s: f64, t: f64| {
        let (s, t) = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
        let q = a + (b - a) * s + (c - b) * (s * t);
        cutter.profile_mm((q.xy() - Vector2::new(x, y)).norm()).map_or(f64::NEG_INFINITY, |g| q.z - g)
    };
    let (mut best, mut at, mut half) = (f64::NEG_INFINITY, (0.5, 0.5), 0.5);
    for round in 0..60 {
        let n = if round == 0 { 60 } else { 8 };
        let centre = at;
        for k in 0..=n * n + 2 * n {
            let (i, j) = (f64::from(k / (n + 1)) / f64::from(n), f64::from(k % (n + 1)) / f64::from(n));
            let (s, t) = (centre.0 + (2.0 * i - 1.0) * half, centre.1 + (2.0 * j - 1.0) * half);
            let here = f(s, t);
            if here > best {
                (best, at) = (here, (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0)))
            }
        }
        half *= if round == 0 { 0.1 } else { 0.7 };
    }
    best
}

#[test]
fn validates_single_triangles_against_brute_force() {
    let mut rng = Rng::seed_from_u64(1);
    let (mut touched, mut near) = (0, 0);
    for case in 0..400 {
        let mut triangle = [0; 3].map(|_| random_point(&mut rng, 6.0));
        if case % 5 == 0 {
            triangle[1].z = triangle[0].z
        }
        if case % 7 == 0 {
            triangle[2] = triangle[0] + Vector3::z() * 2.0
        }
        let surface = mesh_of(&[triangle]);
        let (x, y) = (rng.random_range(-5.0..5.0), rng.random_range(-5.0..5.0));
        for cutter in cutters(&mut rng) {
            let slow = brute(&cutter, &triangle, x, y);
            let Some(rest) = surface.rest(&cutter, x, y) else {
                assert!(slow == f64::NEG_INFINITY, "case {case}: {slow}");
                continue;
            };
            touched += 1;
            // The search finds no higher place, and mostly the same one (it may miss a sliver of the triangle).
            assert!(rest.tip_z_mm > slow - 1e-9, "case {case} {cutter:?}: {} below {slow}", rest.tip_z_mm);
            near += usize::from(rest.tip_z_mm < slow + 1e-6);
            let rho = (rest.contact_mm.xy() - Vector2::new(x, y)).norm().min(cutter.radius_mm());
            let bottom = rest.tip_z_mm + cutter.profile_mm(rho).unwrap();
            assert!((rest.contact_mm.z - bottom).abs() < 1e-6, "case {case} {cutter:?}: contact is not on the cutter");
            assert!((rest.normal.norm() - 1.0).abs() < 1e-12 && rest.normal.z >= 0.0);
        }
    }
    assert!(touched > 700 && near as f64 > 0.93 * f64::from(touched), "{near} of {touched}");
}

#[test]
fn validates_planes_edges_and_vertices_in_closed_form() {
    let mut rng = Rng::seed_from_u64(2);
    for _ in 0..200 {
        let slope = Vector2::new(rng.random_range(-1.5..1.5), rng.random_range(-1.5..1.5));
        let at = |x: f64, y: f64| Vector3::new(x, y, slope.x * x + slope.y * y);
        let plane = [at(-100.0, -100.0), at(200.0, -100.0), at(-100.0, 200.0)];
        let (mesh, flat) = (mesh_of(&[plane]), bilinear([at(-50., -50.), at(-50., 50.), at(50., -50.), at(50., 50.)]));
        let design = NurbsDesign::new(&flat).unwrap();
        for cutter in cutters(&mut rng) {
            let (c, a) = (cutter.corner_radius_mm(), cutter.radius_mm() - cutter.corner_radius_mm());
            let root = (1.0 + slope.norm_squared()).sqrt();
            let (x, y) = (rng.random_range(-9.0..9.0), rng.random_range(-9.0..9.0));
            // Centre of the round over the plane by c / cos θ, its ring a away uphill.
            let tip = at(x, y).z + a * slope.norm() + c * root - c;
            let rest = mesh.rest(&cutter, x, y).unwrap();
            assert!((rest.tip_z_mm - tip).abs() < 1e-9, "{cutter:?} {slope:?}");
            assert!((rest.normal - Vector3::new(-slope.x, -slope.y, 1.0) / root).norm() < 1e-12);
            let rest = design.rest(&cutter, x, y).unwrap();
            assert!((rest.tip_z_mm - tip).abs() < 2e-7, "NURBS {cutter:?} {slope:?}: {}", rest.tip_z_mm - tip);
            assert!((mesh.top(x, y).unwrap().z_mm - at(x, y).z).abs() < 1e-12);
            assert!((design.top(x, y).unwrap().z_mm - at(x, y).z).abs() < 1e-9);
        }
    }
    // A spike: the cutter's own shape upside down.
    let spike = mesh_of(&[[Vector3::new(0., 0., 10.), Vector3::new(0.01, 0., -90.), Vector3::new(0., 0.01, -90.)]]);
    for cutter in cutters(&mut rng) {
        for i in 0..50 {
            let rho = f64::from(i) / 51.0 * cutter.radius_mm();
            let rest = spike.rest(&cutter, -rho, 0.0).unwrap();
            assert!((rest.tip_z_mm - (10.0 - cutter.profile_mm(rho).unwrap())).abs() < 1e-9);
        }
        assert!(spike.rest(&cutter, -cutter.radius_mm() - 1e-6, 0.0).is_none());
    }
}

fn bilinear([a, b, c, d]: [Vector3<f64>; 4]) -> NurbsSurface {
    let knots = vec![0.0, 0.0, 1.0, 1.0];
    NurbsSurface::new([1, 1], [knots.clone(), knots], &[vec![a, b], vec![c, d]], None).unwrap()
}

/// The upper (`up = 1`) or lower half of a sphere: one rational patch of quarter arcs each way, poles on the X axis.
fn half_sphere(radius: f64, up: f64) -> NurbsSurface {
    let w = 0.5_f64.sqrt();
    let arc = [(1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0), (-1.0, 1.0, w), (-1.0, 0.0, 1.0)];
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0];
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for (x, out, wu) in arc {
        points.push(arc.iter().map(|&(y, z, _)| Vector3::new(x, y * out, up * z * out) * radius).collect::<Vec<_>>());
        weights.push(arc.iter().map(|&(_, _, wv)| wu * wv).collect::<Vec<_>>());
    }
    NurbsSurface::new([2, 2], [knots.clone(), knots], &points, Some(&weights)).unwrap()
}

#[test]
fn validates_spheres_in_closed_form() {
    let (dome, bowl) = (half_sphere(10.0, 1.0), half_sphere(10.0, -1.0));
    let (dome, bowl) = (NurbsDesign::new(&dome).unwrap(), NurbsDesign::new(&bowl).unwrap());
    let mut rng = Rng::seed_from_u64(3);
    for _ in 0..100 {
        let cutter = Cutter::ball(rng.random_range(0.5..4.0)).unwrap();
        let r = cutter.radius_mm();
        let (rho, angle) = (rng.random_range(0.0..5.5), rng.random_range(0.0..std::f64::consts::TAU));
        let (x, y) = (rho * angle.cos(), rho * angle.sin());
        let high = ((10.0 + r).powi(2) - rho * rho).sqrt() - r;
        let low = -((10.0 - r).powi(2) - rho * rho).sqrt() - r;
        let (above, inside) = (dome.contact(&cutter, x, y).unwrap(), bowl.rest(&cutter, x, y).unwrap());
        assert!((above.rest.tip_z_mm - high).abs() < 2e-7, "dome {r} at {rho}: {}", above.rest.tip_z_mm - high);
        assert!((inside.tip_z_mm - low).abs() < 2e-7 || rho >= 10.0 - r, "bowl {r} at {rho}");
        let [u, v] = above.parameters;
        assert!((dome.surface().point_mm(u, v) - above.rest.contact_mm).norm() < 1e-9);
        assert!((above.rest.normal - above.rest.contact_mm / 10.0).norm() < 1e-6);
        assert!((dome.top(x, y).unwrap().z_mm - (100.0 - rho * rho).sqrt()).abs() < 1e-8);
    }
}

/// A bumpy surface of degrees 2 to 4, rational or not; `wild` ones overhang.
fn bumpy(rng: &mut Rng, wild: bool) -> NurbsSurface {
    let degree = [rng.random_range(2..=4), rng.random_range(2..=4)];
    let count = degree.map(|p| p + 1 + rng.random_range(0..4));
    let knots = [0, 1].map(|k| {
        let inner = (1..count[k] - degree[k]).map(|i| i as f64);
        let last = (count[k] - degree[k]) as f64;
        let mut knots = vec![0.0; degree[k] + 1];
        knots.extend(inner);
        knots.extend(vec![last; degree[k] + 1]);
        knots
    });
    let shift = if wild { 6.0 } else { 1.0 };
    let mut points = vec![vec![Vector3::zeros(); count[1]]; count[0]];
    let mut weights = vec![vec![1.0; count[1]]; count[0]];
    let rational = rng.random_bool(0.5);
    for i in 0..count[0] {
        for j in 0..count[1] {
            let place = Vector3::new(6.0 * i as f64, 6.0 * j as f64, 0.0);
            let noise = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            points[i][j] = place + noise.component_mul(&Vector3::new(shift, shift, 4.0));
            if rational {
                weights[i][j] = rng.random_range(0.5..2.0)
            }
        }
    }
    NurbsSurface::new(degree, knots, &points, Some(&weights)).unwrap()
}

#[test]
fn validates_that_nothing_is_gouged_on_bumpy_surfaces() {
    let mut rng = Rng::seed_from_u64(4);
    for case in 0..12 {
        let surface = bumpy(&mut rng, case % 3 == 0);
        let design = NurbsDesign::new(&surface).unwrap();
        let [(u0, u1), (v0, v1)] = surface.domain();
        let n = 120;
        let sheet: Vec<_> = (0..(n + 1) * (n + 1))
            .map(|k| {
                let (i, j) = (f64::from(k / (n + 1)) / f64::from(n), f64::from(k % (n + 1)) / f64::from(n));
                surface.point_mm(u0 + (u1 - u0) * i, v0 + (v1 - v0) * j)
            })
            .collect();
        let [low, high] = design.bounds_mm();
        assert!(sheet.iter().all(|p| p.iter().zip(&low).all(|(x, low)| x >= &(low - 1e-9))));
        for _ in 0..6 {
            let (x, y) = (rng.random_range(low.x - 1.0..high.x + 1.0), rng.random_range(low.y - 1.0..high.y + 1.0));
            for cutter in cutters(&mut rng) {
                let mut dense = f64::NEG_INFINITY;
                for p in &sheet {
                    let rho = (p.xy() - Vector2::new(x, y)).norm();
                    dense = dense.max(cutter.profile_mm(rho).map_or(f64::NEG_INFINITY, |g| p.z - g));
                }
                let Some(contact) = design.contact(&cutter, x, y) else {
                    assert!(dense == f64::NEG_INFINITY, "case {case}");
                    continue;
                };
                let (tip, point) = (contact.rest.tip_z_mm, contact.rest.contact_mm);
                assert!(tip > dense - 1e-6, "case {case} {cutter:?} at {x} {y}: {tip} gouges by {}", dense - tip);
                // The contact is on the cutter and on the surface: the height is not too high either.
                let rho = (point.xy() - Vector2::new(x, y)).norm().min(cutter.radius_mm());
                assert!((point.z - tip - cutter.profile_mm(rho).unwrap()).abs() < 1e-9, "case {case} {cutter:?}");
                let [u, v] = contact.parameters;
                assert!((surface.point_mm(u, v) - point).norm() < 1e-9, "case {case}");
            }
        }
    }
}

/// Triangles between the points of a grid on a surface.
fn triangulated(n: u32, at: impl Fn(f64, f64) -> Vector3<f64>) -> Mesh {
    let line = n + 1;
    let vertices: Vec<_> =
        (0..line * line).map(|k| at(f64::from(k / line) / f64::from(n), f64::from(k % line) / f64::from(n))).collect();
    let triangles: Vec<_> = (0..n * n)
        .flat_map(|k| {
            let a = k / n * line + k % n;
            [[a, a + line, a + line + 1], [a, a + line + 1, a + 1]]
        })
        .collect();
    Mesh::new(&vertices, &triangles).unwrap()
}

#[test]
fn validates_meshes_against_all_their_triangles_and_against_the_surface() {
    let mut rng = Rng::seed_from_u64(5);
    let surface = bumpy(&mut rng, false);
    let [(u0, u1), (v0, v1)] = surface.domain();
    let mesh = triangulated(60, |s, t| surface.point_mm(u0 + (u1 - u0) * s, v0 + (v1 - v0) * t));
    let (on_mesh, design) = (MeshSurface::new(&mesh), NurbsDesign::new(&surface).unwrap());
    let [low, high] = mesh.bounds_mm();
    for _ in 0..20 {
        let (x, y) = (rng.random_range(low.x..high.x), rng.random_range(low.y..high.y));
        for cutter in cutters(&mut rng) {
            let rest = on_mesh.rest(&cutter, x, y);
            let single = |&t: &[u32; 3]| {
                mesh_of(&[t.map(|v| mesh.vertices_mm()[v as usize])]).rest(&cutter, x, y).map(|rest| rest.tip_z_mm)
            };
            let slow = mesh.triangles().iter().step_by(1).filter_map(single).fold(f64::NEG_INFINITY, f64::max);
            assert!((rest.map_or(f64::NEG_INFINITY, |r| r.tip_z_mm) - slow).abs() < 1e-9 || rest.is_none());
            // Chords of 0.5 mm below curvatures of some 1/3 mm: within 0.1 mm.
            if let (Some(a), Some(b)) = (rest, design.rest(&cutter, x, y)) {
                assert!((a.tip_z_mm - b.tip_z_mm).abs() < 0.15, "{cutter:?}: {} {}", a.tip_z_mm, b.tip_z_mm);
            }
        }
    }
    let points: Vec<_> =
        (0..500).map(|_| Vector2::new(rng.random_range(0.0..20.0), rng.random_range(0.0..20.0))).collect();
    let cutter = Cutter::ball(3.0).unwrap();
    let all = rests(&on_mesh, &cutter, &points);
    assert!(points.iter().zip(&all).all(|(p, rest)| on_mesh.rest(&cutter, p.x, p.y) == *rest));
}

#[test]
fn faults_are_found_with_their_place() {
    // A gutter z = x²/8 along y: hollow with radius 4 at x = 0.
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let line = vec![0.0, 0.0, 1.0, 1.0];
    let row = |x: f64, z: f64| vec![Vector3::new(x, 0.0, z), Vector3::new(x, 10.0, z)];
    let gutter =
        NurbsSurface::new([2, 1], [knots.clone(), line.clone()], &[row(-4., 2.), row(0., -2.), row(4., 2.)], None)
            .unwrap();
    let gutter = NurbsDesign::new(&gutter).unwrap();
    let hollow = gutter.hollowest().unwrap();
    assert!((hollow.radius_mm - 4.0).abs() < 1e-9 && hollow.point_mm.x.abs() < 1e-5, "{hollow:?}");
    assert!(hollow.direction.x.abs() > 0.999);
    assert!(gutter.check(&Cutter::ball(3.9).unwrap()).is_ok());
    let error = gutter.check(&Cutter::ball(5.0).unwrap()).unwrap_err();
    assert!(matches!(error, SurfaceFault::CutterTooLarge { .. }) && error.to_string().contains("4.0000 mm"), "{error}");
    // An arch that overhangs: x goes forth and back.
    let arch = NurbsSurface::new([2, 1], [knots, line], &[row(0., 0.), row(6., 2.), row(2., 6.)], None).unwrap();
    let fault = NurbsDesign::new(&arch).unwrap().fold().unwrap();
    // x' = 12 (1 - t) - 8 t = 0 at t = 0.6: x = 12 · 0.24 + 2 · 0.36 = 3.6.
    let SurfaceFault::Fold { point_mm, parameters } = fault else { panic!("{fault}") };
    assert!((point_mm.x - 3.6).abs() < 1e-5 && (parameters[0] - 0.6).abs() < 1e-5, "{fault}");
    let dome = NurbsDesign::new(&half_sphere(10.0, 1.0)).unwrap();
    assert!(dome.fold().is_some());
    let hollow = dome.hollowest();
    assert!(hollow.is_none(), "{hollow:?}");
}

/// A binary STL of one triangle, with a given header and count.
fn binary(header: &[u8], count: u32, coordinates: [f32; 9]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    bytes.extend([0; 12]);
    bytes.extend(coordinates.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes
}

const CORNER: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];

#[test]
fn stl_is_read_in_both_kinds() {
    let mesh = Mesh::from_stl(&binary(b"solid in name only", 1, CORNER)[..], "a.stl").unwrap();
    assert_eq!((mesh.triangles().len(), mesh.vertices_mm().len(), mesh.statistics().open_edges), (1, 3, 3));
    let facet =
        "FACET NORMAL nan 0 0\r\n OUTER LOOP\n vertex 0 0 0\n\nvertex 1 0 0\nVERTEX 0 1e0 0\nendloop\nendfacet\n";
    let flat = facet.replace("1e0", "0");
    let text = format!("Solid one\n{facet}endsolid one\nsolid two\n{facet}{flat}endsolid two\n\n");
    let mesh = Mesh::from_stl(text.as_bytes(), "b.stl").unwrap();
    let statistics = mesh.statistics();
    assert_eq!((statistics.triangles, statistics.vertices, statistics.dropped), (2, 3, 1));
}

#[test]
fn damaged_stl_is_refused_with_its_place() {
    let refused = |bytes: &[u8]| Mesh::from_stl(bytes, "part.stl").unwrap_err().to_string();
    assert!(refused(b"").contains("empty"));
    assert!(refused(b"hello").contains("no STL"));
    assert!(refused(&binary(b"", u32::MAX, CORNER)).contains("cut short"));
    let error = refused(&binary(b"", 2, CORNER));
    assert!(error.contains("byte 134") && error.contains("triangle 2"), "{error}");
    assert!(refused(&binary(b"", 0, CORNER)).contains("counts 0 triangles"));
    let mut broken = CORNER;
    broken[4] = f32::NAN;
    assert!(refused(&binary(b"", 1, broken)).contains("triangle 1: a coordinate of NaN"));
    broken[4] = 1e30;
    assert!(refused(&binary(b"", 1, broken)).contains("triangle 1"));
    assert!(refused(&binary(b"", 1, [0.0; 9])).contains("nothing to machine"));
    let text = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 zero 0\n";
    let error = refused(text.as_bytes());
    assert!(error.contains("line 5") && error.contains("triangle 1"), "{error}");
    assert!(refused(b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n").contains("line 4"));
    // Any bytes: an error or a mesh, no panic.
    let mut rng = Rng::seed_from_u64(6);
    let whole = binary(b"solid", 1, CORNER);
    let text = format!(
        "solid a\n{}endsolid a\n",
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n".repeat(2)
    );
    for start in [whole.as_slice(), text.as_bytes()] {
        for _ in 0..500 {
            let mut bytes = start[..rng.random_range(0..=start.len())].to_vec();
            for _ in 0..rng.random_range(0..4) {
                if !bytes.is_empty() {
                    let at = rng.random_range(0..bytes.len());
                    bytes[at] = rng.random();
                }
            }
            let _ = Mesh::from_stl(&bytes[..], "any");
        }
    }
    assert!(matches!(Mesh::new(&[], &[[0, 1, 2]]), Err(MeshError::BadIndex { .. })));
}

#[test]
fn places_that_are_no_numbers_have_no_rest() {
    let design = NurbsDesign::new(&half_sphere(10.0, 1.0)).unwrap();
    let cutter = Cutter::ball(2.0).unwrap();
    for bad in [f64::NAN, f64::INFINITY, -1e300] {
        assert!(design.rest(&cutter, bad, 0.0).is_none() && design.top(0.0, bad).is_none());
    }
}

#[test]
fn validates_rests_on_a_dome_against_every_triangle_sampled() {
    let bytes = include_bytes!("../../scenarios/dome.stl");
    let mesh = Mesh::from_stl(&bytes[..], "dome.stl").unwrap();
    let surface = MeshSurface::new(&mesh);
    let cutter = Cutter::ball(4.0).unwrap();
    let vertices = mesh.vertices_mm();
    for (x, y) in [(22.6, 13.2), (30.0, 30.0), (12.0, 40.0), (45.3, 20.1), (24.2, 35.5), (21.0, 14.0)] {
        // Points of every triangle: no rest is below them, and one of them nearly touches.
        let (mut rest, mut top) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|i| vertices[i as usize]);
            for i in 0..=12 {
                for j in 0..=12 - i {
                    let (s, t) = (f64::from(i) / 12.0, f64::from(j) / 12.0);
                    let q = a + (b - a) * s + (c - a) * t;
                    let rho = (q.x - x).hypot(q.y - y);
                    if let Some(profile) = cutter.profile_mm(rho) {
                        rest = rest.max(q.z - profile);
                    }
                    if rho < 0.1 {
                        top = top.max(q.z);
                    }
                }
            }
        }
        let found = surface.rest(&cutter, x, y).unwrap();
        assert!(found.tip_z_mm >= rest - 1e-9 && found.tip_z_mm < rest + 0.02, "({x}, {y}): {found:?} {rest}");
        let seen = surface.top(x, y).unwrap();
        assert!((seen.z_mm - top).abs() < 0.2, "({x}, {y}): {seen:?} {top}");
        // The tip is on the vertical above the surface, and never in it.
        assert!(found.tip_z_mm >= seen.z_mm - 1e-9);
    }
}
