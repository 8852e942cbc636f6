//! A tree of boxes seen from above: a cutter looks at what could touch it first.

use nalgebra::{Vector2, Vector3};

use super::facet::Profile;

/// Boxes of many things in a binary tree.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// A box without a bottom.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f64; 2],
    high: [f64; 2],
    top: f64,
    /// First of the two children, or first thing.
    first: u32,
    /// Number of things; 0 where there are children.
    count: u32,
}

/// Places for nodes that wait: one a level is enough, each level halves, and numbers of things have 32 bits.
const WAITING: usize = 64;

impl Tree {
    /// A tree over things with the given boxes, at most `most` in a leaf, and the order in which it wants them.
    pub(super) fn new(boxes: &[[Vector3<f64>; 2]], most: usize) -> (Self, Vec<u32>) {
        let mut order: Vec<(Vector2<f64>, u32)> =
            boxes.iter().zip(0..).map(|([low, high], i)| ((low + high).xy() * 0.5, i)).collect();
        let mut nodes = vec![Node::EMPTY];
        let mut waiting = vec![(0, 0, order.len())];
        while let Some((node, from, to)) = waiting.pop() {
            let part = &mut order[from..to];
            let mut own = Node::around(part.iter().map(|&(_, i)| &boxes[i as usize]));
            if part.len() <= most {
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
        (Self { nodes }, order.into_iter().map(|(_, i)| i).collect())
    }

    /// Hands out the leaves (as ranges of the order) that could let the cutter rest higher than it does; `look` gives back where
    /// it rests then.
    pub(super) fn descend(
        &self,
        profile: &Profile,
        at: Vector2<f64>,
        mut look: impl FnMut(std::ops::Range<usize>) -> f64,
    ) {
        let mut waiting = [(0_u32, f64::INFINITY); WAITING];
        let (mut count, mut tip) = (1, f64::NEG_INFINITY);
        while count > 0 {
            count -= 1;
            let (mut here, bound) = waiting[count];
            if bound <= tip {
                continue;
            }
            // Down along the more promising children; the others wait.
            loop {
                let node = &self.nodes[here as usize];
                if node.count > 0 {
                    tip = look(node.first as usize..(node.first + node.count) as usize);
                    break;
                }
                let bounds = [0, 1].map(|child| self.nodes[node.first as usize + child].bound(profile, at));
                let (near, far) = if bounds[1] > bounds[0] { (1, 0) } else { (0, 1) };
                if bounds[far as usize] > tip {
                    waiting[count] = (node.first + far, bounds[far as usize]);
                    count += 1;
                }
                if !(bounds[near as usize] > tip) {
                    break;
                }
                here = node.first + near;
            }
        }
    }

    /// Hands out the leaves that lie over or under a place, within `margin`, and reach higher than `look` has given back.
    pub(super) fn over(&self, at: Vector2<f64>, margin: f64, mut look: impl FnMut(std::ops::Range<usize>) -> f64) {
        let mut waiting = vec![0];
        let mut best = f64::NEG_INFINITY;
        while let Some(node) = waiting.pop().and_then(|node: usize| self.nodes.get(node)) {
            let inside = (0..2).all(|k| node.low[k] - margin <= at[k] && at[k] <= node.high[k] + margin);
            if !inside || node.top <= best {
                continue;
            }
            if node.count == 0 {
                waiting.extend([node.first as usize, node.first as usize + 1]);
            } else {
                best = look(node.first as usize..(node.first + node.count) as usize);
            }
        }
    }
}

/// Numbers of things and nodes are limited where they are made.
fn index(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

impl Node {
    const EMPTY: Self =
        Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2], top: f64::NEG_INFINITY, first: 0, count: 0 };

    fn around<'a>(boxes: impl Iterator<Item = &'a [Vector3<f64>; 2]>) -> Self {
        boxes.fold(Self::EMPTY, |mut own, [low, high]| {
            for axis in 0..2 {
                own.low[axis] = own.low[axis].min(low[axis]);
                own.high[axis] = own.high[axis].max(high[axis]);
            }
            own.top = own.top.max(high.z);
            own
        })
    }

    #[inline]
    fn bound(&self, profile: &Profile, at: Vector2<f64>) -> f64 {
        profile.box_bound(self.low, self.high, self.top, at)
    }
}
