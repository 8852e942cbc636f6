//! The boundary and the islands of a part: from the file as written to a region in plan, every problem with its place.

use std::ops::Range;

use nalgebra::Vector2;
use toml::Spanned;

use super::check_surface::nurbs_curve;
use super::diagnostics::Diagnostic;
use super::diagnostics::Problems;
use super::number_table::out_of_range;
use super::part_file::{RawContour, RawPiece};
use crate::parameters::OutOfRange;
use crate::path::{NurbsCurve, NurbsSurface};
use crate::toolpath::guide::{Contour, GuideError, Piece, Region};

/// A closed curve as the file gives it.
fn contour(raw: &Spanned<RawContour>) -> Result<Contour, Diagnostic> {
    match raw.get_ref() {
        RawContour::Polygon(polygon) => {
            let given = polygon.points_mm.get_ref();
            let points: Vec<_> = given.iter().map(|point| Vector2::from(point.get_ref().0)).collect();
            let at = |index: usize| given.get(index).map_or_else(|| polygon.points_mm.span(), Spanned::span);
            Contour::polygon(&points).map_err(|error| of_guide(&error, polygon.points_mm.span(), &at))
        }
        RawContour::Circle(circle) => {
            let radius = *circle.radius_mm.get_ref();
            if !(radius > 0.0) {
                let error = OutOfRange::new("radius_mm", radius, "positive");
                return Err(out_of_range("", &error, circle.radius_mm.span(), "give the radius in millimetres"));
            }
            let centre = Vector2::from(circle.centre_mm.get_ref().0);
            let at = |_| circle.centre_mm.span();
            Contour::circle(centre, radius).map_err(|error| of_guide(&error, circle.radius_mm.span(), &at))
        }
        RawContour::Nurbs(curve) => {
            let span = curve.control_points_mm.span();
            Contour::new(&[Piece::Curve(nurbs_curve(curve)?)])
                .map_err(|error| of_guide(&error, span.clone(), &|_| span.clone()))
        }
        RawContour::Contour(raw) => {
            let given = raw.pieces.get_ref();
            let mut start_mm = Vector2::from(raw.start_mm.get_ref().0);
            let mut pieces = Vec::with_capacity(given.len());
            for piece in given {
                let made = match piece.get_ref() {
                    RawPiece::Line(line) => Piece::Line { start_mm, end_mm: Vector2::from(line.end_mm.get_ref().0) },
                    RawPiece::Arc(arc) => Piece::Arc {
                        start_mm,
                        end_mm: Vector2::from(arc.end_mm.get_ref().0),
                        centre_mm: Vector2::from(arc.centre_mm.get_ref().0),
                        counterclockwise: !arc.clockwise,
                    },
                    RawPiece::Nurbs(curve) => Piece::Curve(nurbs_curve(curve)?),
                };
                start_mm = match &made {
                    Piece::Line { end_mm, .. } | Piece::Arc { end_mm, .. } => *end_mm,
                    Piece::Curve(curve) => curve.control_points_mm().last().copied().unwrap_or(start_mm),
                };
                pieces.push(made);
            }
            let at = |index: usize| given.get(index).map_or_else(|| raw.pieces.span(), Spanned::span);
            Contour::new(&pieces).map_err(|error| of_guide(&error, raw.pieces.span(), &at))
        }
    }
}

/// A problem of a contour: at the point or piece where it is known, else at the whole.
fn of_guide(error: &GuideError, whole: Range<usize>, at: &dyn Fn(usize) -> Range<usize>) -> Diagnostic {
    let problem = Diagnostic::new(error.to_string());
    match error {
        GuideError::BadCoordinate { index, .. } => problem.at(at(*index)).help("coordinates are in millimetres"),
        GuideError::BadArc { index, .. } => {
            problem.at(at(*index)).help("an arc starts where the piece before it ends: check `end_mm` and `centre_mm`")
        }
        GuideError::Open { next, .. } => {
            problem.at(at(*next)).help("pieces are joined end to end, and the last one ends at the start")
        }
        GuideError::TooFewPoints { .. } => problem.at(whole).help("give at least three different points"),
        _ => problem.at(whole).help("the curve is seen from above, in millimetres"),
    }
}

/// The edge of a surface, seen from above.
fn edge(surface: &NurbsSurface, place: Range<usize>) -> Result<Contour, Diagnostic> {
    let [(u0, u1), (v0, v1)] = surface.domain();
    let curves = [surface.curve_at_v(v0), surface.curve_at_u(u1), surface.curve_at_v(v1), surface.curve_at_u(u0)];
    let unusable = |why: String| {
        Diagnostic::new(format!("the surface's edge is no boundary: {why}"))
            .at(place.clone())
            .help("give a [boundary] that the tool's axis stays inside of, such as [boundary.polygon]")
    };
    let mut pieces = Vec::with_capacity(4);
    for (side, curve) in curves.into_iter().enumerate() {
        let curve = curve.map_err(|error| unusable(error.to_string()))?;
        let flat = in_plan(&curve, side >= 2).map_err(|error| unusable(error.to_string()))?;
        // A side that is a single point (a pole) is no piece.
        if let Some(flat) = flat {
            pieces.push(flat);
        }
    }
    Contour::new(&pieces).map_err(|error| unusable(error.to_string()))
}

/// A curve seen from above, run backwards or not; a line where it is one.
fn in_plan(curve: &NurbsCurve<3>, backwards: bool) -> Result<Option<Piece>, crate::path::NurbsError> {
    let mut points: Vec<Vector2<f64>> =
        curve.control_points_mm().iter().map(|point| Vector2::new(point.x, point.y)).collect();
    let mut weights = curve.weights().map(<[f64]>::to_vec);
    let mut knots = curve.knots().to_vec();
    if backwards {
        points.reverse();
        if let Some(weights) = &mut weights {
            weights.reverse();
        }
        let (first, last) = (knots[0], knots[knots.len() - 1]);
        knots = knots.iter().rev().map(|u| first + last - u).collect();
    }
    let (Some(&start_mm), Some(&end_mm)) = (points.first(), points.last()) else { return Ok(None) };
    let chord = end_mm - start_mm;
    if points.iter().all(|p| (p - start_mm).norm() <= 1e-9) {
        return Ok(None);
    }
    // Control points on the chord, in order: the curve is the chord.
    let straight = chord.norm() > 0.0
        && points.iter().all(|p| chord.perp(&(p - start_mm)).abs() <= 1e-9 * chord.norm())
        && points.windows(2).all(|pair| (pair[1] - pair[0]).dot(&chord) >= 0.0);
    if straight {
        return Ok(Some(Piece::Line { start_mm, end_mm }));
    }
    NurbsCurve::new(curve.degree(), knots, points, weights).map(|curve| Some(Piece::Curve(curve)))
}

/// Where the tool's axis may go.
pub(super) fn region(
    boundary: Option<&Spanned<RawContour>>,
    islands: &[Spanned<RawContour>],
    surface: Option<&NurbsSurface>,
    surface_place: Range<usize>,
    problems: &mut Problems,
) -> Option<Region> {
    let outer = match (boundary, surface) {
        (Some(raw), _) => contour(raw),
        (None, Some(surface)) => edge(surface, surface_place.clone()),
        (None, None) => Err(Diagnostic::new("a mesh has no edge to stay inside of: `boundary` is missing")
            .at(surface_place.clone())
            .help(
                "add a table such as [boundary.polygon] with points_mm: where the tool's axis may go, seen from above",
            )),
    };
    let mut keep = |result: Result<Contour, Diagnostic>| result.map_err(|problem| problems.push(problem)).ok();
    let outer = keep(outer);
    let made: Vec<_> = islands.iter().map(|raw| keep(contour(raw))).collect();
    let inner: Vec<Contour> = made.into_iter().collect::<Option<_>>()?;
    let place = boundary.map_or(surface_place, Spanned::span);
    match Region::new(outer?, inner) {
        Ok(region) => Some(region),
        Err(error) => {
            let span = match &error {
                GuideError::IslandOutside { island, .. } | GuideError::IslandsMeet { second: island, .. } => {
                    islands.get(*island).map(Spanned::span)
                }
                _ => None,
            };
            problems.push(Diagnostic::new(error.to_string()).at(span.unwrap_or(place)));
            None
        }
    }
}
