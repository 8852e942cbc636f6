//! A tree of boxes over the elements of a boundary, in their order along it: neighbours are near each other.

use super::element::{Bounds, Capsule, Element, Point};

/// Elements in a leaf.
const LEAF: usize = 4;

/// Node `k` has the children `2k + 1` and `2k + 2`; the leaves hold [`LEAF`] elements each, in order.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Bounds>,
    /// The same as a segment with a thickness: much nearer to a smooth boundary than a box.
    capsules: Vec<Option<Capsule>>,
    /// Those of the elements.
    leaves: Vec<Capsule>,
    /// Index of the first leaf.
    first_leaf: usize,
    count: usize,
}

impl Tree {
    pub(super) fn new(elements: &[Element]) -> Self {
        let leaves = elements.len().div_ceil(LEAF).max(1).next_power_of_two();
        let nothing = Bounds {
            low: Point::new(f64::INFINITY, f64::INFINITY),
            high: Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        let mut nodes = vec![nothing; 2 * leaves - 1];
        for (leaf, chunk) in elements.chunks(LEAF).enumerate() {
            nodes[leaves - 1 + leaf] = Bounds::of_elements(chunk).unwrap_or(nothing);
        }
        for k in (0..leaves - 1).rev() {
            nodes[k] = nodes[2 * k + 1].join(&nodes[2 * k + 2]);
        }
        let own: Vec<Capsule> = elements.iter().map(Capsule::of).collect();
        let mut capsules = vec![None; 2 * leaves - 1];
        for (leaf, chunk) in own.chunks(LEAF).enumerate() {
            capsules[leaves - 1 + leaf] = chunk.iter().copied().reduce(|a, b| a.join(&b));
        }
        for k in (0..leaves - 1).rev() {
            capsules[k] = match (capsules[2 * k + 1], capsules[2 * k + 2]) {
                (Some(a), Some(b)) => Some(a.join(&b)),
                (one, other) => one.or(other),
            };
        }
        Self { nodes, capsules, leaves: own, first_leaf: leaves - 1, count: elements.len() }
    }

    pub(super) fn capsule(&self, k: usize) -> Option<&Capsule> {
        self.capsules[k].as_ref()
    }

    pub(super) fn leaf_capsule(&self, element: usize) -> &Capsule {
        &self.leaves[element]
    }

    pub(super) fn root(&self) -> &Bounds {
        &self.nodes[0]
    }

    pub(super) fn node(&self, k: usize) -> &Bounds {
        &self.nodes[k]
    }

    /// The elements of a leaf; None for an inner node.
    pub(super) fn leaf(&self, k: usize) -> Option<std::ops::Range<usize>> {
        let leaf = k.checked_sub(self.first_leaf)?;
        Some((leaf * LEAF).min(self.count)..((leaf + 1) * LEAF).min(self.count))
    }

    /// Whether a node has at most four leaves.
    pub(super) fn is_small(&self, k: usize) -> bool {
        4 * k + 3 >= self.first_leaf
    }

    /// The nearest element and its distance, if nearer than `limit`.
    pub(super) fn nearest(&self, elements: &[Element], point: Point, limit: f64) -> Option<(usize, f64)> {
        let mut best = (usize::MAX, limit);
        self.nearest_in(0, elements, point, &mut best);
        (best.0 != usize::MAX).then_some(best)
    }

    fn nearest_in(&self, k: usize, elements: &[Element], point: Point, best: &mut (usize, f64)) {
        if let Some(range) = self.leaf(k) {
            for i in range {
                let distance = elements[i].distance(point);
                if distance < best.1 {
                    *best = (i, distance);
                }
            }
            return;
        }
        let (a, b) = (2 * k + 1, 2 * k + 2);
        let (da, db) = (self.nodes[a].distance(point), self.nodes[b].distance(point));
        let order = if da <= db { [(a, da), (b, db)] } else { [(b, db), (a, da)] };
        for (child, distance) in order {
            if distance < best.1 {
                self.nearest_in(child, elements, point, best);
            }
        }
    }

    /// Every pair of elements, the first of this tree and the second of the other, whose boxes are within `reach`, until
    /// `visit` returns false. Of a tree with itself each pair comes once (and each element with itself).
    pub(super) fn pairs(&self, other: &Self, reach: f64, visit: &mut impl FnMut(usize, usize) -> bool) -> bool {
        let same = std::ptr::eq(self, other);
        let mut stack = vec![(0_usize, 0_usize)];
        while let Some((a, b)) = stack.pop() {
            if !self.nodes[a].near(&other.nodes[b], reach) {
                continue;
            }
            match (self.leaf(a), other.leaf(b)) {
                (Some(range), Some(others)) => {
                    for i in range {
                        for j in others.clone() {
                            if (!same || i <= j) && !visit(i, j) {
                                return false;
                            }
                        }
                    }
                }
                (None, Some(_)) => stack.extend([(2 * a + 1, b), (2 * a + 2, b)]),
                (Some(_), None) => stack.extend([(a, 2 * b + 1), (a, 2 * b + 2)]),
                (None, None) if same && a == b => {
                    let (left, right) = (2 * a + 1, 2 * a + 2);
                    stack.extend([(left, left), (left, right), (right, right)]);
                }
                (None, None) => {
                    let (l, r) = ([2 * a + 1, 2 * a + 2], [2 * b + 1, 2 * b + 2]);
                    for x in l {
                        for y in r {
                            stack.push((x, y));
                        }
                    }
                }
            }
        }
        true
    }
}
