//! The raw pieces of an offset, and what is known while they are cut and linked.

use super::element::{Element, Point, Shape, cross};
use super::tree::Tree;

/// Why the linking failed, and where: the caller tries again a little further in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trouble {
    pub(super) at: Point,
}

/// The elements of all rings and their tree.
pub(super) struct Boundary {
    pub(super) elements: Vec<Element>,
    /// For each element the one before and the one after it on its ring.
    pub(super) around: Vec<[usize; 2]>,
    /// First element of each ring, and the end of the last one.
    pub(super) starts: Vec<usize>,
    pub(super) tree: Tree,
}

impl Boundary {
    pub(super) fn new(rings: &[&[Element]]) -> Self {
        let elements: Vec<Element> = rings.iter().flat_map(|ring| ring.iter().copied()).collect();
        let mut around = Vec::with_capacity(elements.len());
        let mut starts = vec![0];
        for ring in rings {
            let (first, count) = (around.len(), ring.len());
            for k in 0..count {
                around.push([first + (k + count - 1) % count, first + (k + 1) % count]);
            }
            starts.push(around.len());
        }
        let tree = Tree::new(&elements);
        Self { elements, around, starts, tree }
    }
}

/// A raw piece of the offset.
pub(super) struct Raw {
    pub(super) curve: Element,
    /// The element that it belongs to; of a corner the one before it.
    pub(super) owner: usize,
    /// Of a corner the one after it, else the owner.
    pub(super) other: usize,
    /// The raw piece that goes on where this one ends, if one does.
    pub(super) next: Option<usize>,
    /// Elements to which its own goes over smoothly, the one before and the one after it. Their distance from the piece is `d` where
    /// they meet and never less, unless they are arcs that have vanished.
    pub(super) smooth: [usize; 2],
}

/// No element.
pub(super) const NONE: usize = usize::MAX;

/// A part of a raw piece that stays.
pub(super) struct Kept {
    pub(super) raw: usize,
    pub(super) curve: Element,
    /// Whether it reaches the start of its raw piece.
    pub(super) whole_start: bool,
    pub(super) whole_end: bool,
}

pub(super) struct Offset<'a> {
    pub(super) boundary: &'a Boundary,
    pub(super) d: f64,
    /// What rounding does \[mm\].
    pub(super) eps: f64,
    /// Size of the boundary.
    pub(super) size: f64,
}

impl Offset<'_> {
    /// Where the normals of two elements differ by a small enough angle `a`, the offset goes on as if they were tangent: it errs by `d a²/8`, which is
    /// rounding.
    pub(super) fn smooth(&self, from: Point, to: Point) -> bool {
        let sine = cross(from, to);
        sine * sine * self.d < 8.0 * self.eps && from.dot(&to) > 0.0
    }

    /// Elements further away than this have no say. What is at `d` exactly has: it may lie on the piece.
    pub(super) fn reach(&self) -> f64 {
        self.d + 2.0 * self.eps
    }

    /// Whether it is an arc whose offset is beyond its centre.
    pub(super) fn vanished(&self, element: &Element) -> bool {
        matches!(element.shape, Shape::Arc { radius, sense, .. } if sense > 0.0 && radius <= self.d * (1.0 + 1e-9))
    }
}
