//! Frequency response: measured points on the curve of the model.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::Dash;
use super::super::figure::Figure;
use super::super::font;
use super::super::style::{Colour, LineStyle, MUTED, RUN_COLOURS};
use super::super::subplot::{Entry, Heading, Subplot, Symbol, TITLE_EM, gutter, stack, subplot_height, y_axis};
use super::words::printable;
use crate::measure::{AxisResponse, Response, ResponsePoint};

const GAP: f64 = 18.0;
/// Lines across at 0 dB, -3 dB.
const REFERENCE: LineStyle = LineStyle { colour: MUTED, width_px: 1.2, dash: None };
const HALF_POWER: LineStyle = LineStyle { colour: MUTED, width_px: 1.2, dash: Some(Dash::new(7.0, 4.0)) };
/// -3 dB is -3.01 dB.
const HALF_POWER_DB: f64 = -3.010_299_956_639_812;

/// Magnitudes down to so far below -3 dB are shown \[dB\].
const MOST_BELOW_DB: f64 = 80.0;

/// The phase, on the branch that is nearest to the model's.
fn phase_deg(point: &ResponsePoint) -> f64 {
    match point.model_deg {
        Some(model) => point.phase_deg + 360.0 * ((model - point.phase_deg) / 360.0).round(),
        None => point.phase_deg,
    }
}

fn model_line_style(colour: Colour) -> LineStyle {
    LineStyle::solid(colour, 1.3)
}

pub(in super::super) fn figure(measured: &Response) -> Figure {
    let mut figure = Figure::default();
    let axes: Vec<(&AxisResponse, Colour)> = measured.axes.iter().zip(RUN_COLOURS).collect();
    let space = heading(measured, &axes).draw(&mut figure);
    let points = || measured.axes.iter().flat_map(|axis| &axis.points);
    let moving = || points().filter(|point| point.moves());
    let mut hz = Range::of(points().map(|point| point.frequency_hz));
    hz.low *= 0.93;
    hz.high *= 1.07;
    let model = || measured.axes.iter().flat_map(|axis| &axis.model_curve);
    // A few points far from the rest, where the table hardly moves, do not flatten the others: they are told of at the edge.
    let mut magnitudes = Range::of_most(moving().map(|point| point.magnitude_db));
    let mut phases = Range::of_most(moving().map(phase_deg));
    for [_, db, deg] in model() {
        magnitudes.include(*db);
        phases.include(*deg);
    }
    magnitudes.include(0.0);
    magnitudes.include(HALF_POWER_DB);
    // Nor does the bottom of a notch.
    magnitudes.low = magnitudes.low.max(HALF_POWER_DB - MOST_BELOW_DB);
    phases.include(0.0);
    let height = subplot_height(&space, 2, GAP);
    let y = [
        y_axis(magnitudes.opened(1.0).padded(0.1, 0.12), height, false),
        y_axis(phases.opened(10.0).padded(0.06, 0.06), height, false),
    ];
    let gutter = gutter(&[&y[0], &y[1]]);
    let frames = stack(&space, &[&y[0], &y[1]], GAP);
    let mut subplots: Vec<Subplot> =
        frames.into_iter().zip(y).map(|(frame, y)| Subplot::new(frame, Axis::decades(hz), y)).collect();
    let [magnitude, phase] = subplots.as_mut_slice() else { return figure };
    magnitude.grid(&mut figure);
    phase.grid(&mut figure);
    magnitude.level(&mut figure, 0.0, REFERENCE);
    magnitude.level(&mut figure, HALF_POWER_DB, HALF_POWER);
    // Axes that are alike lie on each other: one inside the other.
    for ((axis, colour), radius_px) in axes.iter().zip([4.4, 2.8]) {
        draw(&mut figure, magnitude, axis, *colour, radius_px, 1, |point| point.magnitude_db);
        draw(&mut figure, phase, axis, *colour, radius_px, 2, phase_deg);
    }
    for (axis, colour) in &axes {
        let name = axis.axis.to_uppercase();
        if let Some(hz) = axis.bandwidth_hz {
            let at = magnitude.at(hz, HALF_POWER_DB);
            if magnitude.holds(at) {
                magnitude.ring(&mut figure, at, 5.0, 1.5, *colour);
            }
            magnitude.point_label(&mut figure, at, &format!("{name}: −3 dB at {} Hz", significant(hz, 4)), *colour);
        }
        if axis.peak_db > 0.05 {
            let at = magnitude.at(axis.peak_hz, axis.peak_db);
            let text = format!("{name}: {} dB at {} Hz", significant(axis.peak_db, 3), significant(axis.peak_hz, 4));
            magnitude.point_label(&mut figure, at, &text, *colour);
        }
    }
    for (axis, colour) in &axes {
        let moving = axis.points.iter().filter(|point| point.moves());
        for point in moving {
            let name = axis.axis.to_uppercase();
            let hz = significant(point.frequency_hz, 4);
            let (db, deg) = (point.magnitude_db, phase_deg(point));
            let place = magnitude.at(point.frequency_hz, db);
            let text = format!("{name}: {} dB at {hz} Hz", significant(db, 3));
            magnitude.beyond(&mut figure, place, &text, *colour);
            let place = phase.at(point.frequency_hz, deg);
            let text = format!("{name}: {}° at {hz} Hz", significant(deg, 3));
            phase.beyond(&mut figure, place, &text, *colour);
        }
    }
    magnitude.level_label(&mut figure, HALF_POWER_DB, "−3 dB", MUTED);
    magnitude.border(&mut figure, false, true);
    phase.border(&mut figure, true, true);
    magnitude.y_title(&mut figure, gutter, "magnitude", "dB");
    phase.y_title(&mut figure, gutter, "phase", "°");
    phase.x_title(&mut figure, "frequency", "Hz");
    figure
}

/// The linear analysis as a line, measured points as rings; filled where the voltage was clamped.
///
/// - `model`: which number of the analysis' points
fn draw(
    figure: &mut Figure,
    subplot: &mut Subplot,
    axis: &AxisResponse,
    colour: Colour,
    radius_px: f64,
    model: usize,
    pick: impl Fn(&ResponsePoint) -> f64,
) {
    let curve = axis.model_curve.iter().filter_map(|point| Some((point[0], *point.get(model)?)));
    subplot.curve(figure, curve, model_line_style(colour));
    let mut places = Vec::with_capacity(axis.points.len());
    for point in axis.points.iter().filter(|point| point.moves()) {
        let at = subplot.at(point.frequency_hz, pick(point));
        if !subplot.holds(at) {
            continue;
        }
        if point.saturated {
            figure.dot(at, radius_px, colour)
        } else {
            figure.ring(at, radius_px, 1.2, colour)
        }
        places.push(at);
    }
    subplot.keep_clear(places);
}

fn heading(measured: &Response, axes: &[(&AxisResponse, Colour)]) -> Heading {
    let name = font::shortened(&printable(&measured.scenario), TITLE_EM, 600.0);
    let mut legend = Vec::new();
    for (axis, colour) in axes {
        let name = axis.axis.to_uppercase();
        if axis.points.iter().any(ResponsePoint::moves) {
            legend.push(Entry { symbol: Symbol::Ring(*colour), text: format!("{name} measured") });
        }
        if let (Some(db), Some(deg)) = (axis.model_deviation_db, axis.model_deviation_deg) {
            let within = |value: f64| if value < 1e-3 { "0.001".to_owned() } else { significant(1.005 * value, 2) };
            let apart = format!("{name} linear analysis (within {} dB, {}°)", within(db), within(deg));
            legend.push(Entry::line(model_line_style(*colour), apart));
        }
    }
    let warnings =
        axes.iter().flat_map(|(axis, _)| axis.warnings.iter().map(|w| format!("{}: {w}", axis.axis.to_uppercase())));
    let is_filled = axes.iter().flat_map(|(axis, _)| &axis.points).any(|point| point.moves() && point.saturated);
    let filled = if is_filled { "; filled points are where the drive saturated" } else { "" };
    Heading {
        title: format!("{name}: frequency response, command to table"),
        subtitle: format!("Sine by sine through the loop{filled}"),
        warnings: warnings.collect(),
        legend,
    }
}
