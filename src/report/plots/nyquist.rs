//! The Nyquist plot of servo loops: the neighbourhood of -1, where the margins are read.

use super::super::axis::{Range, significant};
use super::super::curve::{Dash, Frame};
use super::super::figure::Figure;
use super::super::style::{CURVE_PX, INK, LineStyle};
use super::super::subplot::{Entry, Subplot, gutter, x_axis, y_axis};
use super::servo_loop::{Drawn, LABELLED, REFERENCE, THIN, entries, frequencies, heading, spaced};

/// Real parts that are always in view: -1 with room around it, and the unit circle.
const CORE: Range = Range { low: -2.2, high: 1.25 };
/// Crossings of the real axis are in view down to this real part; those farther left are told of at the edge.
const LEFTMOST: f64 = -3.5;
/// Imaginary parts that are in view at least: the unit circle.
const LEAST_HALF_HEIGHT: f64 = 1.12;

/// What is in view: the unit circle and the neighbourhood of -1 always, crossings of the real axis as far as these do not become small.
fn window(axes: &[Drawn<'_>], frame: &Frame) -> (Range, Range) {
    let mut x = CORE;
    for (_, factor) in axes.iter().flat_map(|axis| &axis.phase_crossovers) {
        let low = -1.12 / factor - 0.1;
        if low >= LEFTMOST {
            x.low = x.low.min(low);
        }
    }
    let per_px = (x.span() / frame.width()).max(2.0 * LEAST_HALF_HEIGHT / frame.height());
    // Room that is left over goes to the left, where the curves come from.
    x.low = x.high - per_px * frame.width();
    let half = 0.5 * per_px * frame.height();
    (x, Range { low: -half, high: half })
}

pub(in super::super) fn figure(title: &str, axes: &[Drawn<'_>]) -> Figure {
    let mut figure = Figure::default();
    let range = frequencies(axes);
    let curves: Vec<Vec<(f64, f64)>> = axes
        .iter()
        .map(|axis| {
            // Nyquist curves need their end exactly.
            let fine = Range { high: axis.drive.nyquist_rad_s(), ..range };
            let points = spaced(fine).map(|omega| axis.drive.transfer(omega)).map(|l| (l.re, l.im));
            points.filter(|p| p.0.is_finite() && p.1.is_finite()).collect()
        })
        .collect();
    let mut head = heading(title, "Nyquist plot of the loop transfer", axes);
    head.subtitle = String::from("Frequencies up to π/Δt, and their mirror image (thin)");
    if axes.iter().any(|axis| axis.margins.stable) {
        head.subtitle.push_str("; the dashed circle around −1 that the curve touches has the radius 1/Ms");
    }
    head.legend = entries(axes);
    // A first guess of the frame: the legend's texts do not change how high it is.
    let outside = |curve: &[(f64, f64)]| !curve.iter().any(|(re, im)| re.abs() <= 3.0 && im.abs() <= 1.0);
    for (entry, curve) in head.legend.iter_mut().zip(&curves) {
        if outside(curve) {
            entry.text.push_str(", curve outside of this window");
        }
    }
    head.legend.push(Entry::line(REFERENCE, "|L| = 1"));
    let space = head.draw(&mut figure);

    let room = gutter(&[&y_axis(Range { low: -1.0, high: 1.0 }, space.height(), false)]);
    let frame = Frame { left: space.left + room, right: space.right - 8.0, ..space };
    let (x, y) = window(axes, &frame);
    let mut subplot = Subplot::new(frame, x_axis(x, frame.width(), false), y_axis(y, frame.height(), false));
    subplot.grid(&mut figure);
    subplot.level(&mut figure, 0.0, REFERENCE);
    let circle = |centre: f64, radius: f64| {
        (0..=360).map(move |i| {
            let angle = f64::from(i).to_radians();
            (centre + radius * libm::cos(angle), radius * libm::sin(angle))
        })
    };
    subplot.curve(&mut figure, circle(0.0, 1.0), REFERENCE);
    for (axis, points) in axes.iter().zip(&curves) {
        let mirror = LineStyle { colour: axis.colour, width_px: 0.8, dash: Some(THIN) };
        subplot.curve(&mut figure, points.iter().map(|(re, im)| (*re, -im)), mirror);
        subplot.curve(&mut figure, points.iter().copied(), LineStyle::solid(axis.colour, CURVE_PX));
        if axis.margins.stable {
            let dash = Some(Dash::new(7.0, 4.0));
            let line_style = LineStyle { colour: axis.colour, width_px: 1.0, dash };
            subplot.curve(&mut figure, circle(-1.0, axis.margins.modulus_margin()), line_style);
        }
    }
    // Marks first: no label hides one.
    let crossings = || {
        let all = axes.iter().flat_map(|axis| axis.phase_crossovers.iter().map(move |(_, factor)| (axis, *factor)));
        all.map(|(axis, factor)| (axis, factor, -1.0 / factor))
    };
    for (axis, _, re) in crossings() {
        let at = subplot.at(re, 0.0);
        if subplot.holds(at) {
            subplot.ring(&mut figure, at, 4.0, 1.5, axis.colour);
        }
    }
    let phase_margins: Vec<_> = axes
        .iter()
        .filter(|axis| axis.margins.stable && axis.margins.phase_margin_deg.is_finite())
        .map(|axis| {
            let l = axis.drive.transfer(axis.margins.crossover_rad_s);
            (axis, subplot.at(l.re, l.im))
        })
        .collect();
    for (axis, at) in &phase_margins {
        subplot.ring(&mut figure, *at, 4.0, 1.5, axis.colour);
    }
    let critical = subplot.at(-1.0, 0.0);
    subplot.ring(&mut figure, critical, 4.5, 4.5, INK);
    figure.dot(critical, 4.5, INK);
    subplot.point_label(&mut figure, critical, "−1", INK);
    for (axis, factor, re) in crossings() {
        let at = subplot.at(re, 0.0);
        let text = format!("{}: −1/{}", axis.name, significant(factor, 4));
        if !subplot.holds(at) {
            if factor > 1.0 / LABELLED {
                subplot.beyond(&mut figure, at, &format!("{text} = {}", significant(re, 3)), axis.colour);
            }
        } else if factor < LABELLED {
            subplot.point_label(&mut figure, at, &text, axis.colour);
        }
    }
    for (axis, at) in phase_margins {
        let text = format!("{}: {}°", axis.name, significant(axis.margins.phase_margin_deg, 4));
        subplot.point_label(&mut figure, at, &text, axis.colour);
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "real part", "");
    subplot.y_title(&mut figure, room, "imaginary part", "");
    figure
}
