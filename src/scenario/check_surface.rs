//! The surface and the contours of a part: from the file as written to geometry, every problem with its place.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};
use toml::Spanned;

use super::diagnostics::Diagnostic;
use super::number_table::out_of_range;
use super::part_file::{RawNurbsCurve, RawNurbsSurface};
use crate::parameters::OutOfRange;
use crate::path::nurbs::MAX_DEGREE;
use crate::path::{NurbsCurve, NurbsError, NurbsSurface};

/// Degree of curves and surfaces whose file gives none.
const CUBIC: usize = 3;

/// The degree that a file gives.
fn degree(value: i64, span: Range<usize>) -> Result<usize, Diagnostic> {
    usize::try_from(value).ok().filter(|degree| (1..=MAX_DEGREE).contains(degree)).ok_or_else(|| {
        let needed = format!("a whole number from 1 to {MAX_DEGREE}");
        out_of_range("", &OutOfRange::new("degree", value as f64, needed), span, "3 (cubic) is usual")
    })
}

/// Uniform knots from 0 to 1 for so many control points, the first and last repeated.
fn uniform_knots(degree: usize, points: usize) -> Vec<f64> {
    let spans = points.saturating_sub(degree).max(1);
    (0..=points + degree).map(|i| i.saturating_sub(degree).min(spans) as f64 / spans as f64).collect()
}

/// What a list of numbers is in a file: where it stands, or where it would stand.
struct Place {
    points: Range<usize>,
    weights: Option<Range<usize>>,
    knots: Option<Range<usize>>,
}

/// A NURBS error at its place.
fn of_nurbs(error: &NurbsError, place: &Place) -> Diagnostic {
    use NurbsError as E;
    let problem = Diagnostic::new(error.to_string());
    let at = |span: &Option<Range<usize>>| span.clone().unwrap_or_else(|| place.points.clone());
    match error {
        E::WrongKnotCount { .. } => {
            problem.at(at(&place.knots)).help("give as many knots as control points plus degree plus one, or none")
        }
        E::BadKnot { .. } | E::DecreasingKnots { .. } | E::TooManyEqualKnots { .. } | E::EmptyDomain { .. } => {
            problem.at(at(&place.knots)).help(
                "knots grow or stay the same from one to the next, such as [0, 0, 0, 0, 0.5, 1, 1, 1, 1] for 5 points",
            )
        }
        E::WrongWeightCount { .. } | E::BadWeight { .. } => {
            problem.at(at(&place.weights)).help("leave the weights out for a surface or curve without them")
        }
        E::TooFewControlPoints { .. } => {
            problem.at(place.points.clone()).help("give more control points, or lower the degree")
        }
        E::RaggedRows { .. } => problem.at(place.points.clone()).help("every row has as many points as the first one"),
        _ => problem.at(place.points.clone()).help("coordinates are in millimetres"),
    }
}

/// The NURBS surface of a file.
pub(super) fn nurbs_surface(raw: &RawNurbsSurface) -> Result<NurbsSurface, Diagnostic> {
    let degrees = match &raw.degree {
        Some(given) => {
            let [u, v] = *given.get_ref();
            [degree(u, given.span())?, degree(v, given.span())?]
        }
        None => [CUBIC, CUBIC],
    };
    let rows = raw.control_points_mm.get_ref();
    let columns = rows.first().map_or(0, |row| row.get_ref().len());
    if let Some((index, row)) = rows.iter().enumerate().find(|(_, row)| row.get_ref().len() != columns) {
        return Err(Diagnostic::new(format!(
            "row {index} (counted from 0) has {} control points, the first one has {columns}",
            row.get_ref().len()
        ))
        .at(row.span())
        .help("every row has as many points as the first one"));
    }
    let finite = |x: &f64| x.abs() <= crate::path::MAX_COORDINATE_MM;
    if let Some(bad) = rows.iter().flat_map(Spanned::get_ref).find(|p| !p.get_ref().0.iter().all(finite)) {
        return Err(Diagnostic::new("a coordinate is not a finite number within ±1e6 mm")
            .at(bad.span())
            .help("coordinates are in millimetres"));
    }
    let points: Vec<Vec<Vector3<f64>>> =
        rows.iter().map(|row| row.get_ref().iter().map(|p| Vector3::from(p.get_ref().0)).collect()).collect();
    let knots = [(&raw.knots_u, degrees[0], points.len()), (&raw.knots_v, degrees[1], columns)];
    let knots = knots.map(|(given, p, n)| given.as_ref().map_or_else(|| uniform_knots(p, n), |k| k.get_ref().clone()));
    let weights = raw.weights.as_ref();
    // The two directions one by one: of a fault in both together the constructor does not tell which.
    for (direction, (given, p, n)) in
        [("u", (&raw.knots_u, degrees[0], points.len())), ("v", (&raw.knots_v, degrees[1], columns))]
    {
        let place =
            Place { points: raw.control_points_mm.span(), weights: None, knots: given.as_ref().map(Spanned::span) };
        let line = (0..n).map(|i| Vector2::new(i as f64, 0.0)).collect();
        let own = if direction == "u" { &knots[0] } else { &knots[1] };
        if let Err(error) = NurbsCurve::<2>::new(p, own.clone(), line, None) {
            return Err(of_nurbs(&error, &place).note(format!("along {direction}")));
        }
    }
    let place = Place { points: raw.control_points_mm.span(), weights: weights.map(Spanned::span), knots: None };
    NurbsSurface::new(degrees, knots, &points, weights.map(|w| w.get_ref().as_slice()))
        .map_err(|error| of_nurbs(&error, &place))
}

/// A NURBS curve in plan.
pub(super) fn nurbs_curve(raw: &RawNurbsCurve) -> Result<NurbsCurve<2>, Diagnostic> {
    let degree = match &raw.degree {
        Some(given) => degree(*given.get_ref(), given.span())?,
        None => CUBIC,
    };
    let points: Vec<_> = raw.control_points_mm.get_ref().iter().map(|p| Vector2::from(p.get_ref().0)).collect();
    let knots = raw.knots.as_ref().map_or_else(|| uniform_knots(degree, points.len()), |knots| knots.get_ref().clone());
    let place = Place {
        points: raw.control_points_mm.span(),
        weights: raw.weights.as_ref().map(Spanned::span),
        knots: raw.knots.as_ref().map(Spanned::span),
    };
    NurbsCurve::new(degree, knots, points, raw.weights.as_ref().map(|w| w.get_ref().clone()))
        .map_err(|error| of_nurbs(&error, &place))
}
