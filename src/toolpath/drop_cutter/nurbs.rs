//! NURBS surfaces as cutters see them.

use std::collections::VecDeque;

use nalgebra::{Vector2, Vector3};

use super::bound::{Plan, Support};
use super::facet::Profile;
use super::net::Net;
use super::newton::{Place, climb, offset, place};
use super::tree::Tree;
use crate::path::{NurbsError, NurbsSurface};
use crate::toolpath::{ContactLocation, Cutter, DesignSurface, SurfaceTop};

/// How much lower than the true height a rest may be \[mm\].
pub const REST_TOLERANCE_MM: f64 = 1e-7;

/// Bezier pieces that a surface is cut into, about.
const PIECES: usize = 2048;
/// After so many parts of pieces the tolerance doubles: a cutter that fits an area all over touches everywhere.
const PARTS: usize = 20_000;
/// A part that is no larger is a point \[mm\].
const POINT_MM: f64 = 1e-9;
/// Most halvings of a piece: its parameters keep some digits.
const HALVINGS: usize = 80;

/// A NURBS surface cut into small Bezier pieces with a tree of boxes.
///
/// A rest is the global maximum of `Q_z - g(|Q_xy - (x, y)|)` over all of the surface, also where it overhangs, where its offset
/// folds over itself, and on its own edges: found by Newton's method, and proven by branch and bound, to
/// [`REST_TOLERANCE_MM`]. (Where a cutter touches an area all over, the proof ends at a tolerance that doubles with every 20 000
/// parts looked at.)
#[derive(Debug, Clone)]
pub struct NurbsDesign {
    surface: NurbsSurface,
    pub(super) centre: Vector3<f64>,
    bounds: [Vector3<f64>; 2],
    tree: Tree,
    /// In the order of the tree.
    pub(super) pieces: Vec<Piece>,
}

/// A Bezier piece, relative to the centre, and its box.
#[derive(Debug, Clone)]
pub(super) struct Piece {
    pub(super) net: Net,
    pub(super) bounds: [Vector3<f64>; 2],
}

/// A cutter at rest on a NURBS surface, and where on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The rest.
    pub rest: ContactLocation,
    /// Parameters `(u, v)` of the contact: [`NurbsSurface::evaluate`] gives the curvatures there.
    pub parameters: [f64; 2],
}

impl Piece {
    pub(super) fn new(net: Net) -> Self {
        let bounds = net.bounds();
        Self { net, bounds }
    }

    /// Its halves, across the longer way.
    pub(super) fn halves(&self) -> [Self; 2] {
        let [p, q] = self.net.degree;
        let corner = |i: usize, j: usize| {
            let a = &self.net.points[i * (q + 1) + j];
            a.xyz() / a.w
        };
        let u = (corner(p, 0) - corner(0, 0)).norm().max((corner(p, q) - corner(0, q)).norm());
        let v = (corner(0, q) - corner(0, 0)).norm().max((corner(p, q) - corner(p, 0)).norm());
        self.net.halves(usize::from(v > u)).map(Self::new)
    }

    pub(super) fn size(&self) -> f64 {
        (self.bounds[1] - self.bounds[0]).amax()
    }
}

/// The highest place so far.
struct Best {
    place: Place,
    parameters: Vector2<f64>,
    support: Support,
}

impl NurbsDesign {
    /// Cuts a surface into pieces.
    ///
    /// # Errors
    /// None that a valid surface meets.
    pub fn new(surface: &NurbsSurface) -> Result<Self, NurbsError> {
        let points = surface.control_points_mm();
        let (low, high) = points
            .iter()
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
                (low.inf(p), high.sup(p))
            });
        let centre = (low + high) * 0.5;
        let mut pieces: Vec<Piece> = Net::patches(surface, centre)?.into_iter().map(Piece::new).collect();
        while pieces.len() < PIECES {
            pieces = pieces.iter().flat_map(Piece::halves).collect();
        }
        let boxes: Vec<_> = pieces.iter().map(|piece| piece.bounds).collect();
        let (tree, order) = Tree::new(&boxes, 1);
        let pieces: Vec<Piece> = order.iter().filter_map(|&i| pieces.get(i as usize).cloned()).collect();
        let around = boxes.iter().fold([high, low], |[low, high], own| [low.inf(&own[0]), high.sup(&own[1])]);
        let bounds = around.map(|corner| corner + centre);
        Ok(Self { surface: surface.clone(), centre, bounds, tree, pieces })
    }

    /// The surface.
    pub fn surface(&self) -> &NurbsSurface {
        &self.surface
    }

    /// As [`DesignSurface::rest`], with the surface's parameters at the contact.
    pub fn contact(&self, cutter: &Cutter, x_mm: f64, y_mm: f64) -> Option<Contact> {
        let axis = Vector2::new(x_mm, y_mm) - self.centre.xy();
        if !(axis.x.is_finite() && axis.y.is_finite()) {
            return None;
        }
        let profile = Profile::new(cutter);
        let mut search = Search { profile, axis, best: None, waiting: VecDeque::new(), parts: 0 };
        // What is not decided waits until all pieces are seen: against the highest place most of it is.
        let mut open = Vec::new();
        self.tree.descend(&profile, axis, |leaf| {
            open.extend(self.pieces[leaf].iter().filter(|piece| !search.decided(piece, 0)));
            search.tip()
        });
        for piece in open {
            search.piece(piece);
        }
        let Best { place, parameters, .. } = search.best?;
        let point = place.jet.point;
        let inwards = profile.inwards(point.xy() - axis);
        let normal = place.jet.normal();
        let [(u0, u1), (v0, v1)] = self.surface.domain();
        let edge = [u0, u1].contains(&parameters.x) || [v0, v1].contains(&parameters.y);
        // Edges, corners and creases: where the surface's normal is not the cutter's.
        let apart = (normal - inwards).amax() > 1e-6;
        let normal = if apart && (edge || profile.corner > 0.0) { inwards } else { normal };
        let contact_mm = point + self.centre;
        let rest = ContactLocation { tip_z_mm: place.tip + self.centre.z, contact_mm, normal };
        Some(Contact { rest, parameters: parameters.into() })
    }
}

/// One search for a rest.
struct Search {
    profile: Profile,
    axis: Vector2<f64>,
    best: Option<Best>,
    /// Parts of a piece that are not decided, with their halvings.
    waiting: VecDeque<(Piece, usize)>,
    parts: usize,
}

impl Search {
    fn tip(&self) -> f64 {
        self.best.as_ref().map_or(f64::NEG_INFINITY, |best| best.place.tip)
    }

    fn target(&self) -> f64 {
        let doublings = i32::try_from(self.parts / PARTS).unwrap_or(i32::MAX).min(40);
        self.tip() + REST_TOLERANCE_MM * 2.0_f64.powi(doublings)
    }

    fn piece(&mut self, piece: &Piece) {
        if self.decided(piece, 0) {
            return;
        }
        self.waiting.extend(piece.halves().map(|half| (half, 1)));
        while let Some((part, halvings)) = self.waiting.pop_front() {
            self.parts += 1;
            if !self.decided(&part, halvings) && halvings < HALVINGS && part.size() > POINT_MM {
                self.waiting.extend(part.halves().map(|half| (half, halvings + 1)));
            }
        }
    }

    /// Looks for a higher place on a piece; whether it surely holds none above the target.
    fn decided(&mut self, piece: &Piece, halvings: usize) -> bool {
        let Piece { net, bounds: bounds @ [low, high] } = piece;
        let bound = self.profile.box_bound([low.x, low.y], [high.x, high.y], high.z, self.axis);
        if bound <= self.target() {
            return true;
        }
        if self.best.as_ref().is_some_and(|best| best.support.excludes(net, bounds, self.target())) {
            return true;
        }
        let own = climb(net, &self.profile, self.axis);
        let mut around = own.map(|place| (place, self.support(&place)));
        self.offer(net, around);
        if self.profile.flat > 0.0 {
            if let Some(place) = offset(net, &self.profile, self.axis) {
                let found = (place, self.support(&place));
                self.offer(net, Some(found));
                if around.is_none_or(|(other, _)| other.tip <= place.tip) {
                    around = Some(found)
                }
            }
            for corner in if halvings > 0 { &CORNERS[..] } else { &[] } {
                let found = place(net, &self.profile, self.axis, Vector2::from(*corner));
                self.offer(net, found.map(|place| (place, self.support(&place))));
            }
        }
        let target = self.target();
        if bound <= target {
            return true;
        }
        around.is_some_and(|(place, support)| {
            support.excludes_around(net, place.own, target) || support.excludes(net, bounds, target)
        })
    }

    fn support(&self, place: &Place) -> Support {
        Support::new(&self.profile, self.axis, place.jet.point.xy(), place.jet.normal())
    }

    fn offer(&mut self, net: &Net, found: Option<(Place, Support)>) {
        if let Some((place, support)) = found.filter(|(place, _)| place.tip > self.tip()) {
            self.best = Some(Best { place, parameters: net.parameters(place.own), support });
        }
    }
}

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];

impl DesignSurface for NurbsDesign {
    fn bounds_mm(&self) -> [Vector3<f64>; 2] {
        self.bounds
    }

    fn top(&self, x_mm: f64, y_mm: f64) -> Option<SurfaceTop> {
        let at = Vector2::new(x_mm, y_mm) - self.centre.xy();
        let mut best: Option<SurfaceTop> = None;
        let mut waiting: Vec<(Piece, usize)> = Vec::new();
        self.tree.over(at, EDGE_MM, |leaf| {
            waiting.extend(self.pieces[leaf].iter().map(|piece| (piece.clone(), 0)));
            while let Some((piece, halvings)) = waiting.pop() {
                let [low, high] = piece.bounds;
                let beside = (0..2).any(|k| at[k] < low[k] - EDGE_MM || at[k] > high[k] + EDGE_MM);
                if beside || best.is_some_and(|best| high.z <= best.z_mm) {
                    continue;
                }
                let small = piece.size() <= POINT_MM || halvings >= HALVINGS;
                let found = if small { Some(Vector2::repeat(0.5)) } else { under(&piece.net, at) };
                if let Some(jet) = found.map(|own| piece.net.jet(own))
                    && best.is_none_or(|best| jet.point.z > best.z_mm)
                {
                    best = Some(SurfaceTop { z_mm: jet.point.z, normal: jet.normal() });
                }
                // One to one in plan: there is no second point.
                if !small && !(Plan::new(&piece.net, at).spread < 0.5) {
                    waiting.extend(piece.halves().map(|half| (half, halvings + 1)));
                }
            }
            best.map_or(f64::NEG_INFINITY, |best| best.z_mm)
        });
        best.map(|best| SurfaceTop { z_mm: best.z_mm + self.centre.z, ..best })
    }

    fn rest(&self, cutter: &Cutter, x_mm: f64, y_mm: f64) -> Option<ContactLocation> {
        self.contact(cutter, x_mm, y_mm).map(|contact| contact.rest)
    }
}

/// A place so near to the surface's edge lies on it \[mm\].
const EDGE_MM: f64 = 1e-9;

/// The net's own parameters of a point over or under `at`.
fn under(net: &Net, at: Vector2<f64>) -> Option<Vector2<f64>> {
    let mut own = Vector2::repeat(0.5);
    for _ in 0..20 {
        let jet = net.jet(own);
        let inverse = nalgebra::Matrix2::from_columns(&[jet.d[0].xy(), jet.d[1].xy()]).try_inverse()?;
        let next = (own - inverse * (jet.point.xy() - at)).map(|x| x.max(-0.5).min(1.5));
        let moved = (next - own).amax();
        own = next;
        if moved < 1e-13 {
            break;
        }
    }
    let own = own.map(|x| x.max(0.0).min(1.0));
    ((net.jet(own).point.xy() - at).norm() <= EDGE_MM).then_some(own)
}
