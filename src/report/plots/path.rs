//! Desired path, actual path, and the contouring error drawn large.

use super::super::axis::{Range, power_of_ten, round_up_125, significant};
use super::super::curve::{Dash, Frame, Px, length, thinned};
use super::super::data::PlotSample;
use super::super::figure::Figure;
use super::super::style::{CURVE_PX, DESIRED, INK, LineStyle, MUTED, TINT, VERMILLION};
use super::super::subplot::{Entry, Subplot, Symbol, gutter, x_axis, y_axis};
use super::magnified::magnified;
use super::named_run::{Named, heading, in_scale, off_scale_text, samples};
use super::words::capital;

/// The largest error is drawn about this large beside the path.
const ERROR_SHARE: f64 = 0.04;
/// More nodal points than this hide the path.
const MOST_NODES: usize = 200;
/// Arrows that show the direction of travel, as shares of the path's length.
const ARROWS: [f64; 4] = [0.06, 0.31, 0.56, 0.81];
const DESIRED_STYLE: LineStyle = LineStyle { colour: DESIRED, width_px: 4.0, dash: None };

pub(in super::super) fn figure(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let samples = samples(runs);
    let desired = desired_paths(runs);
    let in_scale = in_scale(runs, |run| run.data.metrics().worst.contour_error_um.abs());
    let times = magnification(runs, &in_scale, &desired, &samples);
    let drawn: Vec<(Vec<(f64, f64)>, bool)> =
        samples.iter().map(|samples| magnified(samples, times.unwrap_or(1.0))).collect();
    let is_limited = times.is_some() && drawn.iter().any(|(_, is_limited)| *is_limited);
    let nodes = nodal_points(runs);

    let head = legend(runs, &in_scale, &desired, times.map(|times| (times, is_limited)), !nodes.is_empty());
    let space = head.draw(&mut figure);
    let points = || {
        let paths = desired.iter().flatten().chain(&nodes).copied();
        let runs = samples.iter().zip(&drawn).zip(&in_scale).filter(|(_, in_scale)| **in_scale);
        let places = runs.flat_map(|((samples, (large, _)), _)| {
            samples.iter().map(|s| (s.actual_mm[0], s.actual_mm[1])).zip(large.iter().copied())
        });
        paths.chain(places.flat_map(|(actual, large)| [actual, large]))
    };
    let (x, y) = (Range::of(points().map(|p| p.0)), Range::of(points().map(|p| p.1)));
    let (mut subplot, gutter) = equal_scale(space, x, y);

    subplot.grid(&mut figure);
    if let ([run], Some(_)) = (runs, times)
        && run.data.metrics().samples > 1
        && let (Some(samples), Some((large, _))) = (samples.first(), drawn.first())
    {
        // The band between path and error: out along the one, back along the other.
        let mut band = thinned(&large.iter().map(|(x, y)| subplot.at(*x, *y)).collect::<Vec<Px>>());
        let mut nearest: Vec<Px> = samples.iter().map(|s| subplot.at(s.nearest_mm[0], s.nearest_mm[1])).collect();
        nearest.reverse();
        band.extend(thinned(&nearest));
        figure.area(band, TINT);
    }
    for path in &desired {
        subplot.curve(&mut figure, path.iter().copied(), DESIRED_STYLE);
    }
    // Those that locked up below the others.
    let mut order: Vec<_> = runs.iter().zip(&samples).zip(&drawn).collect();
    order.sort_by_key(|((run, _), _)| !run.data.metadata().locked_up);
    for ((run, samples), (large, _)) in order {
        let actual = samples.iter().map(|s| (s.actual_mm[0], s.actual_mm[1]));
        subplot.curve(&mut figure, actual, actual_line_style(runs, run));
        if times.is_some() {
            subplot.curve(&mut figure, large.iter().copied(), error_line_style(runs, run));
        }
    }
    for (x, y) in nodes {
        figure.ring(subplot.at(x, y), 3.2, 1.2, MUTED);
    }
    if let Some(path) = desired.first() {
        arrows(&mut figure, &subplot, path);
    }
    if let Some(&(x, y)) = desired.first().and_then(|path| path.first()) {
        let at = subplot.at(x, y);
        figure.ring(at, 5.5, 1.8, INK);
        subplot.point_label(&mut figure, at, "start", INK);
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "x", "mm");
    subplot.y_title(&mut figure, gutter, "y", "mm");
    figure
}

/// - `times`: how much larger errors are drawn, and whether somewhere less than that
fn legend(
    runs: &[Named<'_>],
    in_scale: &[bool],
    desired: &[Vec<(f64, f64)>],
    times: Option<(f64, bool)>,
    nodes: bool,
) -> super::super::subplot::Heading {
    let mut head = heading(runs, "path and contouring error");
    let by = times.map(|(m, _)| format!("error × {}", significant(m, 6)));
    if let [run] = runs {
        let metrics = run.data.metrics();
        if metrics.samples > 0 {
            let worst = significant(metrics.worst.contour_error_um.abs(), 4);
            let large = times.map(|(m, _)| format!(", drawn {} times as large", significant(m, 6))).unwrap_or_default();
            head.subtitle = format!("Largest contouring error {worst} µm{large}");
        }
    }
    if times.is_some_and(|(_, is_limited)| is_limited) {
        let less = "where the path bends sharply errors are drawn less large, so that they do not fold";
        head.subtitle = if head.subtitle.is_empty() { capital(less) } else { format!("{}; {less}", head.subtitle) };
    }
    if !desired.is_empty() {
        head.legend.push(Entry::line(DESIRED_STYLE, "desired path"));
    }
    let legend_dash = (runs.len() > 1).then_some(Dash::new(6.0, 6.0));
    let has_samples = |run: &Named<'_>| run.data.metrics().samples > 0;
    // Of three and more runs each has one entry.
    if runs.len() > 2 {
        let line_style = |dash| LineStyle { dash, ..LineStyle::solid(MUTED, CURVE_PX) };
        head.legend.push(Entry::line(line_style(legend_dash), "actual paths"));
        head.legend.extend(by.map(|by| Entry::line(line_style(None), by)));
        let entry = |(run, in_scale): (&Named<'_>, &bool)| {
            Entry::line(error_line_style(runs, run), format!("{}{}", run.short(), off_scale_text(*in_scale)))
        };
        head.legend.extend(runs.iter().zip(in_scale).filter(|(run, _)| has_samples(run)).map(entry));
        return head;
    }
    for (run, in_scale) in runs.iter().zip(in_scale).filter(|(run, _)| has_samples(run)) {
        let of = if runs.len() == 1 { String::new() } else { format!("{}: ", run.short()) };
        head.legend.push(Entry::line(
            LineStyle { dash: legend_dash, ..actual_line_style(runs, run) },
            format!("{of}actual path{}", off_scale_text(*in_scale)),
        ));
        if let Some(by) = &by {
            head.legend.push(Entry::line(error_line_style(runs, run), format!("{of}{by}")));
        }
    }
    if nodes {
        head.legend.push(Entry { symbol: Symbol::Ring(MUTED), text: "nodal points".to_owned() });
    }
    head
}

fn actual_line_style(runs: &[Named<'_>], run: &Named<'_>) -> LineStyle {
    if runs.len() == 1 {
        return run.line_style(1.2);
    }
    // Paths that differ by micrometres lie on top of each other: their dashes take turns.
    let turns = runs.len().clamp(2, 4);
    let turn = runs.iter().position(|other| other.name == run.name).unwrap_or(0) % turns;
    let dash = Dash { lead: 6.0 * turn as f64, on: 6.0, off: 6.0 * (turns - 1) as f64 };
    LineStyle { dash: Some(dash), ..run.line_style(1.4) }
}

fn error_line_style(runs: &[Named<'_>], run: &Named<'_>) -> LineStyle {
    if runs.len() == 1 { LineStyle::solid(VERMILLION, CURVE_PX) } else { run.line_style(CURVE_PX) }
}

/// The different desired paths, closed where they are.
fn desired_paths(runs: &[Named<'_>]) -> Vec<Vec<(f64, f64)>> {
    let mut paths: Vec<Vec<(f64, f64)>> = Vec::new();
    for run in runs {
        let metadata = run.data.metadata();
        let mut path = finite(&metadata.desired_path_mm);
        if metadata.closed && path.first() != path.last() {
            path.extend(path.first().copied());
        }
        if !path.is_empty() && !paths.contains(&path) {
            paths.push(path);
        }
    }
    paths
}

fn nodal_points(runs: &[Named<'_>]) -> Vec<(f64, f64)> {
    let nodes = runs.first().map(|run| finite(&run.data.metadata().nodal_points_mm)).unwrap_or_default();
    if nodes.len() <= MOST_NODES { nodes } else { Vec::new() }
}

fn finite(points: &[[f64; 2]]) -> Vec<(f64, f64)> {
    points.iter().filter(|p| p.iter().all(|c| c.abs() <= 1e100)).map(|[x, y]| (*x, *y)).collect()
}

/// How many times as large the error is drawn: 1, 2 or 5 times a power of ten, so that the largest one of the runs in
/// scale is about [`ERROR_SHARE`] of the path's extent. `None` where it can be seen as it is, or is not there at all.
fn magnification(
    runs: &[Named<'_>],
    in_scale: &[bool],
    desired: &[Vec<(f64, f64)>],
    samples: &[Vec<PlotSample>],
) -> Option<f64> {
    let points = || {
        let followed = samples.iter().flatten().map(|s| (s.nearest_mm[0], s.nearest_mm[1]));
        desired.iter().flatten().copied().chain(followed)
    };
    let extent = Range::of(points().map(|p| p.0)).span().max(Range::of(points().map(|p| p.1)).span());
    let shown = runs.iter().zip(in_scale).filter(|(_, in_scale)| **in_scale);
    let worst_mm = shown.map(|(run, _)| run.data.metrics().worst.contour_error_um.abs() * 1e-3).fold(0.0, f64::max);
    let wanted = ERROR_SHARE * extent / worst_mm;
    if !(wanted.is_finite() && wanted > 1.0) {
        return None;
    }
    // 1-2-5 next to the wanted one: from 0.63 to 1.58 times it. An error below a nanometre is rounding.
    let (digit, exponent) = round_up_125(0.63 * wanted.min(1e6));
    let times = f64::from(digit) * power_of_ten(exponent);
    (times > 1.0).then_some(times)
}

/// A subplot that fills `space` with the same scale on both axes; and the room that the y axis takes.
pub(super) fn equal_scale(space: Frame, x: Range, y: Range) -> (Subplot, f64) {
    let (x, y) = (centred(x), centred(y));
    let mut frame = Frame { right: space.right - 8.0, ..space };
    // A point, or a path lost in rounding, is shown with a millionth of its coordinates around it.
    let least = (1e-6 * x.magnitude().max(y.magnitude())).max(1e-3);
    let axes = |frame: &Frame| {
        let spans = [x.span() / frame.width(), y.span() / frame.height(), least / frame.width()];
        let mm_per_px = 1.08 * spans.into_iter().fold(0.0, f64::max);
        let widened = |range: Range, px: f64| Range {
            low: range.middle() - 0.5 * px * mm_per_px,
            high: range.middle() + 0.5 * px * mm_per_px,
        };
        let (width, height) = (frame.width(), frame.height());
        (x_axis(widened(x, width), width, false), y_axis(widened(y, height), height, false))
    };
    // The tick labels decide how much room is left, and that decides the ticks; it settles at once or nearly so.
    let mut taken: f64 = 0.0;
    for _ in 0..3 {
        taken = taken.max(gutter(&[&axes(&frame).1]));
        frame.left = space.left + taken;
    }
    let (x, y) = axes(&frame);
    (Subplot::new(frame, x, y), taken)
}

/// A range that is not empty; it may have no width as long as the other has.
fn centred(range: Range) -> Range {
    if range.is_empty() { range.opened(1.0) } else { range }
}

/// Arrowheads along the path.
pub(super) fn arrows(figure: &mut Figure, subplot: &Subplot, path: &[(f64, f64)]) {
    let points: Vec<Px> = path.iter().map(|&(x, y)| subplot.at(x, y)).collect();
    let lengths = || points.windows(2).map(|p| length((p[1].0 - p[0].0, p[1].1 - p[0].1)));
    let total: f64 = lengths().sum();
    if total < 120.0 {
        return;
    }
    for share in ARROWS {
        let mut left = share * total;
        for (pair, step) in points.windows(2).zip(lengths()) {
            if left > step || step == 0.0 {
                left -= step;
                continue;
            }
            let ((ax, ay), (bx, by)) = (pair[0], pair[1]);
            let (tx, ty) = ((bx - ax) / step, (by - ay) / step);
            let (x, y) = (ax + left * tx, ay + left * ty);
            let corner = |along: f64, across: f64| (x + along * tx - across * ty, y + along * ty + across * tx);
            figure.area(vec![corner(7.0, 0.0), corner(-6.0, 5.0), corner(-3.0, 0.0), corner(-6.0, -5.0)], MUTED);
            break;
        }
    }
}
