//! The circular test: radial deviation around the circle, much magnified.

use super::super::axis::{Axis, Range, Tick, power_of_ten, round_up_125, significant};
use super::super::curve::{Frame, Px};
use super::super::figure::Figure;
use super::super::font;
use super::super::marks::{Anchor, TextFormat};
use super::super::style::{BORDER, CURVE_PX, DESIRED, GRID, INK, LineStyle, MUTED, RUN_COLOURS, WHITE};
use super::super::subplot::{Entry, Heading, LABEL_EM, Subplot, Symbol, TITLE_EM, gutter, x_axis, y_axis};
use super::words::printable;
use crate::measure::{CircleTest, Direction, Radial, Spike};

/// The smallest circle of the grid, as a share of the largest.
const INNER: f64 = 0.38;
/// Circles of the grid, about.
const RINGS: f64 = 5.0;
/// Room for the angles around the grid \[px\].
const ANGLES_PX: f64 = 26.0;
/// Between the polar plot and the other one \[px\].
const GAP: f64 = 34.0;
/// Spikes lower than this share of the grid are not marked.
const SPIKE_SHARE: f64 = 0.02;
const NOMINAL: LineStyle = LineStyle { colour: DESIRED, width_px: 2.5, dash: None };

pub(in super::super) fn figure(test: &CircleTest) -> Figure {
    let mut figure = Figure::default();
    let space = heading(test).draw(&mut figure);
    let side = space.height().min(0.57 * space.width());
    let square = Frame { right: space.left + side, bottom: space.top + side, ..space };
    // The foot of the figure is for titles of axes, which a circle has not.
    let square = Frame { bottom: square.bottom + 20.0, top: square.top + 20.0, ..square };
    polar(&mut figure, test, &square);
    unrolled(&mut figure, test, &Frame { left: square.right + GAP, ..space });
    figure
}

fn line_styles(test: &CircleTest) -> impl Iterator<Item = (&Direction, LineStyle)> {
    test.directions.iter().zip(RUN_COLOURS).map(|(direction, colour)| (direction, LineStyle::solid(colour, CURVE_PX)))
}

fn name(direction: &Direction) -> &'static str {
    if direction.clockwise { "clockwise" } else { "counterclockwise" }
}

fn heading(test: &CircleTest) -> Heading {
    let title = font::shortened(&printable(&test.scenario), TITLE_EM, 520.0);
    let f = |value: f64| significant(value, 4);
    let [a, b] = &test.directions;
    let mut legend: Vec<Entry> = line_styles(test)
        .map(|(direction, line_style)| {
            Entry::line(line_style, format!("{}: G {} µm", name(direction), f(direction.circular_deviation_um)))
        })
        .collect();
    legend.push(Entry::line(NOMINAL, "nominal"));
    if line_styles(test).any(|(direction, _)| direction.spikes.iter().any(|spike| is_marked(spike, &grid(test).0))) {
        legend.push(Entry { symbol: Symbol::Ring(INK), text: "tip of a reversal spike".to_owned() });
    }
    Heading {
        title: format!(
            "{title}: circular test, radius {} mm at {} mm/s",
            significant(test.radius_mm, 5),
            significant(test.feed_mm_s, 5)
        ),
        subtitle: format!(
            "Both directions: G(b) {} µm, hysteresis H {} µm, mean radial deviation D {} µm; radial deviation F {} … {} µm",
            f(test.bidirectional_deviation_um),
            f(test.hysteresis_um),
            f(test.mean_radial_deviation_um),
            f(a.radial_min_um.min(b.radial_min_um)),
            f(a.radial_max_um.max(b.radial_max_um)),
        ),
        warnings: test.warnings.iter().map(|text| printable(text)).collect(),
        legend,
    }
}

/// A spike that stands out of the ripple, and is seen.
fn is_marked(spike: &Spike, range: &Range) -> bool {
    spike.clear && spike.height_um.abs() >= SPIKE_SHARE * range.span()
}

/// The deviations with room around them, and zero, in whole steps.
fn grid(test: &CircleTest) -> (Range, f64) {
    let mut range = Range::of(test.directions.iter().flat_map(|d| &d.trace).map(|radial| radial.deviation_um));
    range.include(0.0);
    // Below a nanometre there is nothing but rounding.
    let range = range.opened(1e-3);
    let (digit, exponent) = round_up_125(range.span() / RINGS);
    let step = f64::from(digit) * power_of_ten(exponent);
    let low = (range.low / step - 0.05).floor() * step;
    let high = (range.high / step + 0.05).ceil() * step;
    (Range { low, high }, step)
}

fn polar(figure: &mut Figure, test: &CircleTest, square: &Frame) {
    let unit = || Axis::linear(Range { low: -1.0, high: 1.0 }, square.width(), 95.0, false);
    // Labels keep off the angles around the grid.
    let inset = ANGLES_PX - 4.0;
    let inner = Frame {
        left: square.left + inset,
        top: square.top + inset,
        right: square.right - inset,
        bottom: square.bottom - inset,
    };
    let mut subplot = Subplot::new(inner, unit(), unit());
    let middle = (0.5 * (square.left + square.right), 0.5 * (square.top + square.bottom));
    let outer = 0.5 * square.width() - ANGLES_PX;
    let (range, step) = grid(test);
    let place = |angle_deg: f64, deviation_um: f64| -> Px {
        let share = ((deviation_um - range.low) / range.span()).clamp(0.0, 1.0);
        let radius = outer * (INNER + (1.0 - INNER) * share);
        let (sin, cos) = libm::sincos(angle_deg.to_radians());
        (middle.0 + radius * cos, middle.1 - radius * sin)
    };
    let ring = |deviation_um: f64| -> Vec<Px> { (0..=360).map(|a| place(f64::from(a), deviation_um)).collect() };
    let steps = (range.span() / step).round().clamp(1.0, 20.0);
    let levels = || (0..=20).map(f64::from).take_while(move |k| *k <= steps).map(move |k| range.low + k * step);
    for level in levels() {
        let line_style = if level == range.low + steps * step { BORDER } else { GRID };
        figure.curve(&ring(level), square, LineStyle::solid(line_style, 1.0));
    }
    for angle in (0..360).step_by(45).map(f64::from) {
        figure.line(&[place(angle, range.low), place(angle, range.high)], LineStyle::solid(GRID, 1.0));
        let (sin, cos) = libm::sincos(angle.to_radians());
        let at = (middle.0 + (outer + 17.0) * cos, middle.1 - (outer + 14.0) * sin);
        let label =
            TextFormat::new(at, format!("{}°", significant(angle, 3)), LABEL_EM, Anchor::Middle).coloured(MUTED);
        subplot.keep_off(label.frame());
        figure.text(label);
    }
    let nominal = ring(0.0);
    figure.curve(&nominal, square, NOMINAL);
    subplot.keep_clear(nominal);
    for (direction, line_style) in line_styles(test) {
        let points: Vec<Px> = closed(&direction.trace).map(|r| place(r.angle_deg, r.deviation_um)).collect();
        figure.curve(&points, square, line_style);
        subplot.keep_clear(points);
    }
    // Over the curves: a number that is crossed out tells nothing.
    for level in levels() {
        let label =
            TextFormat::new(place(67.5, level), significant(level, 4), LABEL_EM, Anchor::Middle).coloured(MUTED);
        let Frame { left, top, right, bottom } = label.frame();
        figure.rectangle(&Frame { left: left - 2.0, top: top + 1.0, right: right + 2.0, bottom: bottom - 1.0 }, WHITE);
        subplot.keep_off(label.frame());
        figure.text(label);
    }
    let said = format!("{} µm a division", significant(step, 3));
    let division = TextFormat::new(middle, said, LABEL_EM, Anchor::Middle).coloured(MUTED);
    subplot.keep_off(division.frame());
    figure.text(division);
    let marked = || {
        let all = line_styles(test)
            .flat_map(|(direction, line_style)| direction.spikes.iter().map(move |spike| (spike, line_style)));
        let seen = all.filter(|(spike, _)| is_marked(spike, &range));
        seen.map(|(spike, line_style)| (spike, line_style, place(spike.tip_deg, spike.tip_um)))
    };
    for (_, line_style, (x, y)) in marked() {
        figure.ring((x, y), 4.0, 1.5, line_style.colour);
        subplot.keep_off(Frame { left: x - 5.0, top: y - 5.0, right: x + 5.0, bottom: y + 5.0 });
    }
    for (spike, line_style, at) in marked() {
        let text = format!("{} {} µm", spike.axis.to_uppercase(), significant(spike.height_um, 3));
        subplot.point_label(figure, at, &text, line_style.colour);
    }
}

/// The path with its first point again at its end, where it comes back there.
fn closed(trace: &[Radial]) -> impl Iterator<Item = Radial> + '_ {
    trace.iter().chain(trace.first()).copied()
}

fn unrolled(figure: &mut Figure, test: &CircleTest, space: &Frame) {
    let (range, _) = grid(test);
    let y = y_axis(range, space.height(), false);
    let gutter = gutter(&[&y]);
    let frame = Frame { left: space.left + gutter, right: space.right - 8.0, ..*space };
    let mut x = x_axis(Range { low: 0.0, high: 360.0 }, frame.width(), false);
    x.ticks = [0.0, 90.0, 180.0, 270.0, 360.0].map(|value| Tick { value, label: format!("{value}") }).into();
    let mut subplot = Subplot::new(frame, x, y);
    subplot.grid(figure);
    subplot.level(figure, 0.0, NOMINAL);
    let curves = line_styles(test).map(|(direction, line_style)| {
        let mut trace = direction.trace.clone();
        trace.sort_by(|a, b| a.angle_deg.total_cmp(&b.angle_deg));
        (trace.into_iter().map(|r| (r.angle_deg, r.deviation_um)), line_style)
    });
    subplot.time_curves(figure, curves);
    subplot.border(figure, true, true);
    subplot.x_title(figure, "angle from +X", "°");
    subplot.y_title(figure, gutter, "radial deviation", "µm");
}
