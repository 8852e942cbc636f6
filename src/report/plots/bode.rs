//! The Bode plot of servo loops.

use std::f64::consts::TAU;

use super::super::axis::{Axis, Range, significant};
use super::super::figure::Figure;
use super::super::style::{LineStyle, MUTED};
use super::super::subplot::{Subplot, gutter, stack, subplot_height, y_axis};
use super::servo_loop::{Drawn, LABELLED, REFERENCE, THIN, entries, frequencies, heading, in_the_loop, spaced};
use crate::analysis::Margins;

const GAP: f64 = 18.0;
/// Magnitudes that are shown: so far above the highest margin, and so far below the lowest.
const MOST_DB: f64 = 120.0;
const BEYOND_DB: f64 = 60.0;

fn decibel(magnitude: f64) -> f64 {
    20.0 * libm::log10(magnitude)
}

fn hz(omega_rad_s: f64) -> f64 {
    omega_rad_s / TAU
}

fn in_hz(range: Range) -> Range {
    Range { low: hz(range.low), high: hz(range.high) }
}

pub(in super::super) fn figure(title: &str, axes: &[Drawn<'_>]) -> Figure {
    let mut figure = Figure::default();
    let range = frequencies(axes);
    let mut magnitudes = Range::EMPTY;
    let mut phases = Range::of([-180.0]);
    let responses: Vec<Vec<(f64, f64, f64)>> = axes
        .iter()
        .map(|axis| {
            let mut last = -180.0;
            let response = spaced(Range { high: axis.drive.nyquist_rad_s(), ..range });
            let response = response.map(|omega| {
                let l = axis.drive.transfer(omega);
                // The branch nearest to the point before: at low frequencies two integrators, -180°.
                let principal = libm::atan2(l.im, l.re).to_degrees();
                last = principal + 360.0 * ((last - principal) / 360.0).round();
                (omega, decibel(libm::hypot(l.re, l.im)), last)
            });
            response.filter(|(_, magnitude, phase)| magnitude.is_finite() && phase.is_finite()).collect()
        })
        .collect();
    for (_, magnitude, phase) in responses.iter().flatten() {
        magnitudes.include(*magnitude);
        phases.include(*phase);
    }
    magnitudes.include(0.0);
    // Every margin stays in view; the bottom of a notch, or a pole beside the axis, does not flatten the rest.
    let marked = axes.iter().flat_map(|axis| &axis.phase_crossovers).map(|(_, factor)| -decibel(*factor));
    let marked = Range::of(marked.filter(|db| db.abs() <= MOST_DB).chain([0.0]));
    magnitudes.low = magnitudes.low.max(marked.low - BEYOND_DB);
    magnitudes.high = magnitudes.high.min(marked.high + MOST_DB);

    let mut head = heading(title, "loop transfer, broken at the plant input", axes);
    head.subtitle = in_the_loop(axes);
    head.legend = entries(axes);
    let space = head.draw(&mut figure);
    let height = subplot_height(&space, 2, GAP);
    let y = [y_axis(magnitudes.padded(0.18, 0.05), height, false), y_axis(phases.padded(0.1, 0.1), height, false)];
    let gutter = gutter(&[&y[0], &y[1]]);
    let frames = stack(&space, &[&y[0], &y[1]], GAP);
    let mut subplots: Vec<Subplot> =
        frames.into_iter().zip(y).map(|(frame, y)| Subplot::new(frame, Axis::decades(in_hz(range)), y)).collect();
    let [magnitude, phase] = subplots.as_mut_slice() else { return figure };
    for (subplot, level) in [(&mut *magnitude, 0.0), (&mut *phase, -180.0)] {
        subplot.grid(&mut figure);
        subplot.level(&mut figure, level, REFERENCE);
    }
    for (axis, response) in axes.iter().zip(&responses) {
        magnitude.curve(&mut figure, response.iter().map(|(omega, m, _)| (hz(*omega), *m)), axis.line_style());
        phase.curve(&mut figure, response.iter().map(|(omega, _, p)| (hz(*omega), *p)), axis.line_style());
    }
    for axis in axes {
        for &(omega, factor) in &axis.phase_crossovers {
            let at = magnitude.at(hz(omega), -decibel(factor));
            magnitude.ring(&mut figure, at, 4.0, 1.5, axis.colour);
            if factor < LABELLED {
                let text =
                    format!("{}: × {} ({} dB)", axis.name, significant(factor, 4), significant(decibel(factor), 3));
                magnitude.point_label(&mut figure, at, &text, axis.colour);
            }
        }
        if axis.margins.stable && axis.margins.phase_margin_deg.is_finite() {
            let Margins { crossover_rad_s: omega, phase_margin_deg: margin, .. } = axis.margins;
            magnitude.ring(&mut figure, magnitude.at(hz(omega), 0.0), 4.0, 1.5, axis.colour);
            let l = axis.drive.transfer(omega);
            let side = if l.im > 0.0 { -margin } else { margin };
            let at = phase.at(hz(omega), -180.0 + side);
            let line = vec![phase.at(hz(omega), -180.0), at];
            figure.line(&line, LineStyle { colour: axis.colour, width_px: 1.2, dash: Some(THIN) });
            phase.keep_clear(line);
            phase.ring(&mut figure, at, 4.0, 1.5, axis.colour);
            let text = format!(
                "{}: {}° at {} Hz ({} rad/s)",
                axis.name,
                significant(margin, 4),
                significant(hz(omega), 4),
                significant(omega, 4)
            );
            phase.point_label(&mut figure, at, &text, axis.colour);
        }
    }
    magnitude.level_label(&mut figure, 0.0, "0 dB", MUTED);
    phase.level_label(&mut figure, -180.0, "−180°", MUTED);
    magnitude.border(&mut figure, false, true);
    phase.border(&mut figure, true, true);
    magnitude.y_title(&mut figure, gutter, "magnitude", "dB");
    phase.y_title(&mut figure, gutter, "phase", "°");
    phase.x_title(&mut figure, "frequency", "Hz");
    figure
}
