//! Meshes as cutters see them: a tree of boxes over the triangles.

use nalgebra::{Vector2, Vector3};

use super::facet::{Profile, Touch, side};
use crate::toolpath::mesh::Mesh;
use crate::toolpath::{Cutter, DesignSurface, Rest, SurfaceTop};

/// A mesh with a tree of boxes: a cutter looks at the triangles that could touch it first.
///
/// The heights are exact up to rounding: against facets, edges and vertices in closed form, but for the bull-nose on an edge, whose
/// contact is a root found to the last digits.
#[derive(Debug, Clone)]
pub struct MeshSurface {
    bounds: [Vector3<f64>; 2],
    nodes: Vec<Node>,
    /// Corners, in the order of the leaves.
    triangles: Vec<[Vector3<f64>; 3]>,
}

/// A box without a bottom.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f64; 2],
    high: [f64; 2],
    top: f64,
    /// First of the two children, or first triangle.
    first: u32,
    /// Number of triangles; 0 where there are children.
    count: u32,
}

/// Most triangles of a leaf.
const LEAF: usize = 4;
/// Places for nodes that wait: one a level is enough, and levels halve at least [`super::super::mesh::MAX_TRIANGLES`].
const WAITING: usize = 64;

impl MeshSurface {
    /// Builds the tree.
    pub fn new(mesh: &Mesh) -> Self {
        let corners: Vec<[Vector3<f64>; 3]> = mesh.triangles().iter().map(|&t| mesh.corners(t)).collect();
        let mut order: Vec<(Vector2<f64>, u32)> =
            corners.iter().zip(0..).map(|([a, b, c], i)| ((a + b + c).xy() / 3.0, i)).collect();
        let mut nodes = vec![Node::EMPTY];
        let mut waiting = vec![(0, 0, order.len())];
        while let Some((node, from, to)) = waiting.pop() {
            let part = &mut order[from..to];
            let mut own = Node::around(part.iter().flat_map(|&(_, i)| corners[i as usize]));
            if part.len() <= LEAF {
                (own.first, own.count) = (index(from), index(part.len()));
            } else {
                let (mut low, mut high) = (part[0].0, part[0].0);
                for (centre, _) in part.iter() {
                    (low, high) = (low.inf(centre), high.sup(centre));
                }
                let axis = usize::from(high.y - low.y > high.x - low.x);
                let middle = part.len() / 2;
                // The number decides between equal centres: the same tree everywhere.
                part.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
                own.first = index(nodes.len());
                waiting.extend([(nodes.len(), from, from + middle), (nodes.len() + 1, from + middle, to)]);
                nodes.extend([Node::EMPTY; 2]);
            }
            nodes[node] = own;
        }
        let triangles = order.iter().map(|&(_, i)| corners[i as usize]).collect();
        Self { bounds: mesh.bounds_mm(), nodes, triangles }
    }

    fn leaf(&self, node: &Node) -> &[[Vector3<f64>; 3]] {
        &self.triangles[node.first as usize..(node.first + node.count) as usize]
    }
}

/// Indices are below [`super::super::mesh::MAX_TRIANGLES`] and twice that.
fn index(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

impl Node {
    const EMPTY: Self =
        Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2], top: f64::NEG_INFINITY, first: 0, count: 0 };

    fn around(points: impl Iterator<Item = Vector3<f64>>) -> Self {
        points.fold(Self::EMPTY, |mut own, p| {
            for axis in 0..2 {
                own.low[axis] = own.low[axis].min(p[axis]);
                own.high[axis] = own.high[axis].max(p[axis]);
            }
            own.top = own.top.max(p.z);
            own
        })
    }

    /// The highest that a cutter above `(x, y)` could rest on anything in the box; minus infinity where it is beside the cutter.
    #[inline]
    fn bound(&self, profile: &Profile, x: f64, y: f64) -> f64 {
        let dx = (self.low[0] - x).max(x - self.high[0]).max(0.0);
        let dy = (self.low[1] - y).max(y - self.high[1]).max(0.0);
        let square = dx * dx + dy * dy;
        if square > profile.radius * profile.radius * (1.0 + 1e-14) {
            return f64::NEG_INFINITY;
        }
        if square <= profile.flat * profile.flat { self.top } else { self.top - profile.height(square.sqrt()) }
    }
}

impl DesignSurface for MeshSurface {
    fn bounds_mm(&self) -> [Vector3<f64>; 2] {
        self.bounds
    }

    fn top(&self, x_mm: f64, y_mm: f64) -> Option<SurfaceTop> {
        let at = Vector2::new(x_mm, y_mm);
        let mut best: Option<SurfaceTop> = None;
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            let Some(node) = self.nodes.get(node) else { continue };
            let inside = (0..2).all(|axis| node.low[axis] <= at[axis] && at[axis] <= node.high[axis]);
            if !inside || best.is_some_and(|best| node.top <= best.z_mm) {
                continue;
            }
            if node.count == 0 {
                waiting.extend([node.first as usize, node.first as usize + 1]);
                continue;
            }
            for [a, b, c] in self.leaf(node) {
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
        }
        best
    }

    fn rest(&self, cutter: &Cutter, x_mm: f64, y_mm: f64) -> Option<Rest> {
        if !(x_mm.is_finite() && y_mm.is_finite()) {
            return None;
        }
        let profile = Profile::new(cutter);
        let axis = Vector3::new(x_mm, y_mm, 0.0);
        let mut touch = Touch::none();
        let mut waiting = [(0_u32, f64::INFINITY); WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (mut at, bound) = waiting[count];
            if bound <= touch.tip {
                continue;
            }
            // Down along the more promising children; the others wait.
            loop {
                let node = &self.nodes[at as usize];
                if node.count > 0 {
                    for triangle in self.leaf(node) {
                        touch.triangle(&profile, &triangle.map(|corner| corner - axis));
                    }
                    break;
                }
                let bounds =
                    [0, 1].map(|child| self.nodes[node.first as usize + child].bound(&profile, x_mm, y_mm));
                let (near, far) = if bounds[1] > bounds[0] { (1, 0) } else { (0, 1) };
                if bounds[far as usize] > touch.tip && count < WAITING {
                    waiting[count] = (node.first + far, bounds[far as usize]);
                    count += 1;
                }
                if !(bounds[near as usize] > touch.tip) {
                    break;
                }
                at = node.first + near;
            }
        }
        touch.rest(&profile, x_mm, y_mm)
    }
}
