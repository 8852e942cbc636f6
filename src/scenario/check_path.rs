//! The path of a scenario: from the points as written to a [`Path`], every problem with its place.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Vector2;
use toml::Spanned;

use super::diagnostics::Diagnostic;
use super::file::{RawCircle, RawLine, RawPath, RawPhSpline};
use super::numbers::RawPoint;
use crate::path::{Circle, Line, MAX_COORDINATE_MM, Path, PathError, PhSpline};

/// Most bad coordinates that are told one by one.
const MOST_BAD_POINTS: usize = 5;

type Checked = Result<Arc<dyn Path<2>>, Vec<Diagnostic>>;

/// The path, or what is wrong with it.
pub(super) fn path(raw: &Spanned<RawPath>) -> Checked {
    match raw.get_ref() {
        RawPath::PhSpline(spline) => ph_spline(spline, raw.span()),
        RawPath::Line(raw) => line(raw),
        RawPath::Circle(raw) => circle(raw),
    }
}

fn vector(point: &RawPoint) -> Vector2<f64> {
    Vector2::from(point.get_ref().0)
}

/// Every coordinate that is no finite number in range, each at its point.
fn bad_coordinates<'a>(points: impl Iterator<Item = &'a RawPoint>) -> Vec<Diagnostic> {
    let bad = |value: &&f64| value.is_nan() || value.abs() > MAX_COORDINATE_MM;
    points
        .filter_map(|point| Some((point.get_ref().0.iter().find(bad)?, point.span())))
        .take(MOST_BAD_POINTS)
        .map(|(value, span)| {
            Diagnostic::new(format!("coordinate {value} mm is not a finite number within ±{MAX_COORDINATE_MM} mm"))
                .at(span)
                .label("this point")
                .help("coordinates are in millimetres; a machine rarely has more than 10000 of them")
        })
        .collect()
}

fn line(raw: &RawLine) -> Checked {
    let bad = bad_coordinates([&raw.start_mm, &raw.end_mm].into_iter());
    if !bad.is_empty() {
        return Err(bad);
    }
    Line::new(vector(&raw.start_mm), vector(&raw.end_mm)).map(|line| Arc::new(line) as _).map_err(|error| {
        vec![
            Diagnostic::new(match error {
                PathError::CoincidentPoints { distance_mm, .. } => {
                    format!("the line's two points coincide ({distance_mm:.3e} mm apart)")
                }
                other => other.to_string(),
            })
            .at(raw.end_mm.span())
            .help("move `end_mm` away from `start_mm`: a line needs a direction"),
        ]
    })
}

fn circle(raw: &RawCircle) -> Checked {
    let mut problems = bad_coordinates([&raw.centre_mm].into_iter());
    let start_deg = raw.start_deg.as_ref().map_or(0.0, |start| *start.get_ref());
    // Each value by itself, beside others that are fine, so that none hides another.
    for (radius, start) in [(*raw.radius_mm.get_ref(), 0.0), (1.0, start_deg)] {
        let span = if start == 0.0 { Some(raw.radius_mm.span()) } else { raw.start_deg.as_ref().map(Spanned::span) };
        if let (Err(error), Some(span)) = (Circle::new(Vector2::zeros(), radius, f64::to_radians(start), false), span) {
            problems.push(match error {
                PathError::BadAngle { .. } => {
                    Diagnostic::new(format!("start_deg = {start} is not a finite number of reasonable size"))
                        .at(span)
                        .help("give an angle in degrees, 0 to 360")
                }
                error => Diagnostic::new(error.to_string())
                    .at(span)
                    .help(format!("give a radius above 0 and up to {MAX_COORDINATE_MM} mm")),
            });
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    match Circle::new(vector(&raw.centre_mm), *raw.radius_mm.get_ref(), start_deg.to_radians(), raw.clockwise) {
        Ok(circle) => Ok(Arc::new(circle)),
        Err(error) => Err(vec![Diagnostic::new(error.to_string()).at(raw.radius_mm.span())]),
    }
}

fn ph_spline(raw: &RawPhSpline, table: Range<usize>) -> Checked {
    let (points, from_control) = match (&raw.control_points_mm, &raw.nodal_points_mm) {
        (Some(points), None) => (points, true),
        (None, Some(points)) => (points, false),
        (Some(_), Some(second)) => {
            return Err(vec![
                Diagnostic::new("both `control_points_mm` and `nodal_points_mm` are given")
                    .at(second.span())
                    .help("keep one: control points draw the curve towards them, nodal points lie on it"),
            ]);
        }
        (None, None) => {
            return Err(vec![
                Diagnostic::new("neither `control_points_mm` nor `nodal_points_mm` is given")
                    .at(table)
                    .label("this path has no points")
                    .help("add `control_points_mm = [[x, y], …]` (draw the curve) or `nodal_points_mm` (lie on it)"),
            ]);
        }
    };
    let tangents = raw.end_tangents.as_ref();
    let mut problems = bad_coordinates(points.get_ref().iter().chain(tangents.iter().flat_map(|t| t.get_ref())));
    let mut end_tangents = None;
    if let Some(given) = tangents {
        let pair = given.get_ref().as_slice();
        let refusal = match pair {
            _ if from_control => Some("with control points the ends of the polygon give the tangents"),
            _ if raw.closed => Some("a closed curve has no ends"),
            [start, end] => {
                end_tangents = Some((vector(start), vector(end)));
                None
            }
            _ => Some("two are needed: [[x, y], [x, y]], at the start and at the end"),
        };
        if let Some(why) = refusal {
            problems.push(
                Diagnostic::new(format!("`end_tangents` does not fit: {why}"))
                    .at(given.span())
                    .help("remove it, or give two tangents to an open curve through `nodal_points_mm`"),
            );
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let vectors: Vec<Vector2<f64>> = points.get_ref().iter().map(vector).collect();
    let spline = if from_control {
        PhSpline::from_control_points(&vectors, raw.closed)
    } else {
        PhSpline::from_nodal_points(&vectors, raw.closed, end_tangents)
    };
    match spline {
        Ok(spline) => Ok(Arc::new(spline)),
        Err(error) => Err(vec![spline_problem(&error, raw, points, from_control)]),
    }
}

/// A spline's error at the points that it is about.
fn spline_problem(
    error: &PathError,
    raw: &RawPhSpline,
    points: &Spanned<Vec<RawPoint>>,
    from_control: bool,
) -> Diagnostic {
    let given = points.get_ref();
    // The given point that is nearest to a nodal point: the same one, or the control point with the largest weight.
    let nearest = |nodal: usize| {
        let count = given.len().max(1);
        match (from_control, raw.closed) {
            (false, _) => nodal % count,
            (true, true) => (nodal + 1) % count,
            (true, false) if nodal == 0 => 0,
            (true, false) if nodal + 3 >= count => count - 1,
            (true, false) => nodal + 1,
        }
    };
    let at_nodal = |problem: Diagnostic, nodal: usize| {
        let index = nearest(nodal);
        let span = given.get(index).map_or_else(|| points.span(), Spanned::span);
        let problem = problem.at(span);
        if from_control {
            problem
                .label(format!("control point {index}, the nearest to nodal point {nodal}"))
                .note("nodal points are where the curve's segments meet; all points are counted from 0")
        } else {
            problem.label(format!("nodal point {nodal} (counted from 0)"))
        }
    };
    let problem = Diagnostic::new(error.to_string());
    match error {
        PathError::TooFewPoints { needed, .. } => problem.at(points.span()).help(format!(
            "add points until there are {needed}{}",
            if raw.closed { "" } else { ", or use [path.line] for a straight line" }
        )),
        PathError::CoincidentPoints { second, .. } => {
            let closes = raw.closed && second % given.len().max(1) == 0;
            let help = if closes {
                "a closed curve gives its first point once: remove the repetition at the end"
            } else {
                "remove or move one of the two"
            };
            // The repetition stands at the end of the list, not at its start.
            at_nodal(problem, if closes { second.saturating_sub(1) } else { *second }).help(help)
        }
        PathError::Reversal { index, .. } => at_nodal(problem, *index)
            .help("round the reversal off with another point beside it, or split the path there"),
        PathError::Cusp { segment, .. } => at_nodal(problem, *segment)
            .help("move the points around this one apart, so that the curve has room to turn"),
        PathError::NoConvergence { segment, .. } | PathError::WrongRoot { segment, .. } => {
            at_nodal(problem, segment + 1).help(
                "make the spacing of the points around this one more even, or add points where the path turns sharply",
            )
        }
        PathError::ZeroEndTangent { end } => {
            let is_start = *end == "start";
            let pair = raw.end_tangents.as_ref().map(Spanned::get_ref).map_or([].as_slice(), Vec::as_slice);
            let ends = if pair.len() == 2 { pair } else { given.as_slice() };
            let culprit = if is_start { ends.first() } else { ends.last() };
            let span = culprit.map_or_else(|| points.span(), Spanned::span);
            let help = if from_control {
                "the first two and the last two control points must differ: they give the direction there"
            } else {
                "give a tangent about as long as the neighbouring segment, or leave `end_tangents` out"
            };
            problem.at(span).help(help)
        }
        PathError::BadCoordinate { index, .. } => {
            problem.at(given.get(*index).map_or_else(|| points.span(), Spanned::span))
        }
        _ => problem.at(points.span()).help("change the points"),
    }
}
