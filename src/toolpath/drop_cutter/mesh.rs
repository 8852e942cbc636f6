//! Meshes as cutters see them: a tree of boxes over the triangles.

use nalgebra::{Vector2, Vector3};

use super::facet::{Profile, Touch, side};
use super::tree::Tree;
use crate::toolpath::mesh::Mesh;
use crate::toolpath::{ContactLocation, Cutter, DesignSurface, SurfaceTop};

/// A mesh with a tree of boxes: a cutter looks at the triangles that could touch it first.
///
/// The heights are exact up to rounding: against facets, edges and vertices in closed form, but for the bull-nose on an edge, whose
/// contact is a root found to the last digits.
#[derive(Debug, Clone)]
pub struct MeshSurface {
    bounds: [Vector3<f64>; 2],
    tree: Tree,
    /// Corners, in the order of the tree.
    triangles: Vec<[Vector3<f64>; 3]>,
}

/// Most triangles of a leaf.
const LEAF: usize = 4;

impl MeshSurface {
    /// Builds the tree.
    pub fn new(mesh: &Mesh) -> Self {
        let corners: Vec<[Vector3<f64>; 3]> = mesh.triangles().iter().map(|&t| mesh.corners(t)).collect();
        let boxes: Vec<_> = corners.iter().map(|[a, b, c]| [a.inf(b).inf(c), a.sup(b).sup(c)]).collect();
        let (tree, order) = Tree::new(&boxes, LEAF);
        let triangles = order.iter().map(|&i| corners[i as usize]).collect();
        Self { bounds: mesh.bounds_mm(), tree, triangles }
    }
}

impl DesignSurface for MeshSurface {
    fn bounds_mm(&self) -> [Vector3<f64>; 2] {
        self.bounds
    }

    fn top(&self, x_mm: f64, y_mm: f64) -> Option<SurfaceTop> {
        let at = Vector2::new(x_mm, y_mm);
        let mut best: Option<SurfaceTop> = None;
        self.tree.over(at, 0.0, |leaf| {
            for [a, b, c] in &self.triangles[leaf] {
                let mut n = (b - a).cross(&(c - a));
                let turn = if n.z < 0.0 { -1.0 } else { 1.0 };
                n *= turn;
                let beside = [(a, b), (b, c), (c, a)].iter().any(|(from, to)| side(from, to, at) * turn < 0.0);
                if beside || !(n.z > 0.0) {
                    continue;
                }
                let z = a.z - (n.x * (at.x - a.x) + n.y * (at.y - a.y)) / n.z;
                // Not beyond the corners, however steep the facet.
                let z_mm = z.max(a.z.min(b.z).min(c.z)).min(a.z.max(b.z).max(c.z));
                if best.is_none_or(|best| z_mm > best.z_mm) {
                    best = Some(SurfaceTop { z_mm, normal: n.normalize() });
                }
            }
            best.map_or(f64::NEG_INFINITY, |best| best.z_mm)
        });
        best
    }

    fn rest(&self, cutter: &Cutter, x_mm: f64, y_mm: f64) -> Option<ContactLocation> {
        if !(x_mm.is_finite() && y_mm.is_finite()) {
            return None;
        }
        let profile = Profile::new(cutter);
        let axis = Vector3::new(x_mm, y_mm, 0.0);
        let mut touch = Touch::none();
        self.tree.descend(&profile, axis.xy(), |leaf| {
            for triangle in &self.triangles[leaf] {
                touch.triangle(&profile, &triangle.map(|corner| corner - axis));
            }
            touch.tip
        });
        touch.rest(&profile, x_mm, y_mm)
    }
}
