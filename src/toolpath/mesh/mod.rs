//! Triangle meshes, and STL in.

mod stl;

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::path::MAX_COORDINATE_MM;

/// Most triangles that a mesh takes.
pub const MAX_TRIANGLES: usize = 10_000_000;

/// Triangles in space \[mm\]. Corners at the same place are one vertex; triangles without an area are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    dropped: usize,
}

/// Why a mesh could not be read or made. Triangles, bytes and vertices are counted from 1, as a person counts.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Reading failed.
    #[error("cannot read {origin}: {source}")]
    Read {
        /// What the data comes from.
        origin: String,
        /// Why.
        source: std::io::Error,
    },
    /// More bytes than any mesh in range has.
    #[error("{origin} has more than {most} bytes: reduce the mesh first")]
    TooLarge {
        /// What the data comes from.
        origin: String,
        /// Most bytes.
        most: u64,
    },
    /// Neither a binary nor an ASCII STL.
    #[error("{origin} is no STL: {problem}")]
    NoStl {
        /// What the data comes from.
        origin: String,
        /// What was found.
        problem: String,
    },
    /// Something in a text is wrong.
    #[error("{origin}, line {line} (triangle {triangle}): {problem}")]
    Ascii {
        /// What the data comes from.
        origin: String,
        /// The line.
        line: usize,
        /// The triangle that was being read.
        triangle: usize,
        /// What is wrong.
        problem: String,
    },
    /// The data ends before the triangles do.
    #[error(
        "{origin}, byte {byte}: the header counts {counted} triangles, but the data end in triangle {triangle}: \
         the file is damaged or cut short; export it again"
    )]
    CutShort {
        /// What the data comes from.
        origin: String,
        /// Where the data end.
        byte: usize,
        /// The header's count.
        counted: usize,
        /// The triangle that is not whole.
        triangle: usize,
    },
    /// A coordinate is NaN, infinite, or too large.
    #[error(
        "{origin}, triangle {triangle}: a coordinate of {value} is not a finite number within ±{} mm",
        MAX_COORDINATE_MM
    )]
    BadCoordinate {
        /// What the data comes from.
        origin: String,
        /// The triangle.
        triangle: usize,
        /// The coordinate.
        value: f64,
    },
    /// A triangle's corner is no vertex.
    #[error("triangle {triangle} names vertex {vertex}, but there are {count} (the first is 0)")]
    BadIndex {
        /// The triangle.
        triangle: usize,
        /// The index.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// Too many triangles.
    #[error("{origin} has {counted} triangles, {} are taken: reduce the mesh first", MAX_TRIANGLES)]
    TooMany {
        /// What the data comes from.
        origin: String,
        /// How many.
        counted: usize,
    },
    /// No triangle with an area.
    #[error("{origin} has no triangle with an area ({dropped} without one): there is nothing to machine")]
    Empty {
        /// What the data comes from.
        origin: String,
        /// How many without an area.
        dropped: usize,
    },
}

/// What a mesh is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshStatistics {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Triangles without an area that were left out.
    pub dropped: usize,
    /// Edges of one triangle only: 0 for a closed body.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub crowded_edges: usize,
    /// Least and largest coordinates \[mm\].
    pub bounds_mm: [Vector3<f64>; 2],
}

impl Mesh {
    /// A mesh from vertices and triangles of vertices (counted from 0).
    ///
    /// # Errors
    /// No triangle with an area, too many of them, a corner that is no vertex, a coordinate out of range.
    pub fn new(vertices_mm: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        if triangles.len() > MAX_TRIANGLES {
            return Err(MeshError::TooMany { origin: THE_MESH.into(), counted: triangles.len() });
        }
        let mut builder = Builder::default();
        for (index, corners) in triangles.iter().enumerate() {
            let mut points = [Vector3::zeros(); 3];
            for (point, &vertex) in points.iter_mut().zip(corners) {
                let found = vertices_mm.get(vertex as usize);
                let bad = MeshError::BadIndex { triangle: index + 1, vertex, count: vertices_mm.len() };
                *point = *found.ok_or(bad)?;
            }
            builder.add(THE_MESH, points)?;
        }
        builder.finish(THE_MESH)
    }

    /// Vertices \[mm\].
    pub fn vertices_mm(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// Triangles of vertices (counted from 0).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of a triangle \[mm\].
    pub(super) fn corners(&self, triangle: [u32; 3]) -> [Vector3<f64>; 3] {
        triangle.map(|vertex| self.vertices[vertex as usize])
    }

    /// Least and largest coordinates \[mm\].
    pub fn bounds_mm(&self) -> [Vector3<f64>; 2] {
        let around = |of: fn(f64, f64) -> f64, start: f64| {
            self.vertices.iter().fold(Vector3::repeat(start), |sum, v| sum.zip_map(v, of))
        };
        [around(f64::min, f64::INFINITY), around(f64::max, f64::NEG_INFINITY)]
    }

    /// Counts and bounds; looks at every edge.
    pub fn statistics(&self) -> MeshStatistics {
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to))));
        }
        edges.sort_unstable();
        let (mut open_edges, mut crowded_edges) = (0, 0);
        for same in edges.chunk_by(|a, b| a == b) {
            match same.len() {
                1 => open_edges += 1,
                2 => {}
                _ => crowded_edges += 1,
            }
        }
        MeshStatistics {
            triangles: self.triangles.len(),
            vertices: self.vertices.len(),
            dropped: self.dropped,
            open_edges,
            crowded_edges,
            bounds_mm: self.bounds_mm(),
        }
    }
}

/// What a mesh made of numbers is called in messages.
const THE_MESH: &str = "the mesh";

/// A mesh in the making.
#[derive(Default)]
struct Builder {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    index: HashMap<[u64; 3], u32>,
    dropped: usize,
}

impl Builder {
    /// Number of triangles so far, those without an area too.
    fn count(&self) -> usize {
        self.triangles.len() + self.dropped
    }

    fn add(&mut self, origin: &str, corners: [Vector3<f64>; 3]) -> Result<(), MeshError> {
        let triangle = self.count() + 1;
        if triangle > MAX_TRIANGLES {
            return Err(MeshError::TooMany { origin: origin.into(), counted: triangle });
        }
        for value in corners.iter().flatten().copied() {
            if !(value.abs() <= MAX_COORDINATE_MM) {
                return Err(MeshError::BadCoordinate { origin: origin.into(), triangle, value });
            }
        }
        let [a, b, c] = corners;
        let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
        // Corners in line, up to rounding: the edges belong to the neighbours too.
        if !((b - a).cross(&(c - a)).norm() > 1e-14 * longest) {
            self.dropped += 1;
            return Ok(());
        }
        // + 0: minus zero is the same place.
        let corners = corners.map(|corner| {
            let next = self.vertices.len();
            let key = [corner.x, corner.y, corner.z].map(|x| (x + 0.0).to_bits());
            // At most three times MAX_TRIANGLES: it fits.
            *self.index.entry(key).or_insert_with(|| {
                self.vertices.push(corner);
                u32::try_from(next).unwrap_or(u32::MAX)
            })
        });
        self.triangles.push(corners);
        Ok(())
    }

    fn finish(self, origin: &str) -> Result<Mesh, MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty { origin: origin.into(), dropped: self.dropped });
        }
        Ok(Mesh { vertices: self.vertices, triangles: self.triangles, dropped: self.dropped })
    }
}
