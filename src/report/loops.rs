//! Plots of servo loops: Bode, Nyquist and step response of every axis.

use crate::parameters::axis_name;
use std::path::{Path, PathBuf};

use super::axis::{Axis, Range, significant};
use super::curve::{Dash, Frame};
use super::error::ReportError;
use super::figure::Figure;
use super::files::write_figures;
use super::format::Format;
use super::style::{CURVE_PX, Colour, DESIRED, INK, LineStyle, MUTED, RUN_COLOURS};
use super::subplot::{Entry, Heading, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use crate::analysis::{DriveLoop, Feedforward, Margins};

/// Points of a frequency response.
const POINTS: u32 = 3000;
const GAP: f64 = 18.0;
/// Reference lines: 0 dB, -180°, the unit circle.
const REFERENCE: LineStyle = LineStyle { colour: MUTED, width_px: 1.2, dash: None };
/// Gain factors that are farther away than this are no margin that anybody needs: their places are marked, and not labelled.
const LABELLED: f64 = 8.0;
const THIN: Dash = Dash::new(4.0, 4.0);

/// One axis as it is drawn.
struct Drawn<'a> {
    name: String,
    colour: Colour,
    drive: &'a DriveLoop,
    margins: Margins,
    crossovers: Vec<f64>,
    phase_crossovers: Vec<(f64, f64)>,
}

impl Drawn<'_> {
    fn line_style(&self) -> LineStyle {
        LineStyle::solid(self.colour, CURVE_PX)
    }
}

/// Draws the loops of the axes and writes `STEM-bode.svg`, `STEM-nyquist.svg` and `STEM-step.svg` (or `.png`) into `folder`
/// (made if missing; existing files are replaced). Returns the files in this order.
///
/// - `title`: what the plots are headed with; `axes`: their loops, of models or of detailed drives
///
/// # Errors
/// A stem that is no plain file name, a plot that cannot be drawn, a file or folder that cannot be written.
pub fn write_loops(
    title: &str,
    axes: &[DriveLoop],
    folder: &Path,
    stem: &str,
    format: Format,
) -> Result<Vec<PathBuf>, ReportError> {
    let drawn: Vec<Drawn<'_>> = axes
        .iter()
        .enumerate()
        .map(|(i, drive)| Drawn {
            name: axis_name(i).to_uppercase(),
            colour: RUN_COLOURS[i % RUN_COLOURS.len()],
            drive,
            margins: drive.margins(),
            crossovers: drive.crossovers_rad_s(),
            phase_crossovers: drive.phase_crossovers_rad_s(),
        })
        .collect();
    let title = super::plots::words::printable(title);
    let figures =
        [("bode", bode(&title, &drawn)), ("nyquist", nyquist(&title, &drawn)), ("step", step(&title, &drawn))];
    write_figures(figures, folder, stem, format)
}

fn heading(title: &str, what: &str, axes: &[Drawn<'_>]) -> Heading {
    let unstable = axes.iter().filter(|axis| !axis.margins.stable);
    Heading {
        title: format!("{}: {what}", super::font::shortened(title, super::subplot::TITLE_EM, 700.0)),
        warnings: unstable
            .map(|axis| format!("{}: unstable, largest pole {}", axis.name, significant(axis.margins.pole_radius, 5)))
            .collect(),
        ..Heading::default()
    }
}

/// What is in the loops beyond their models; nothing of models.
fn in_the_loop(axes: &[Drawn<'_>]) -> String {
    let mut taken: Vec<&str> = Vec::new();
    for what in axes.iter().flat_map(|axis| &axis.drive.linearized().modelled) {
        if !taken.contains(&what.as_str()) {
            taken.push(what);
        }
    }
    let mut parts = Vec::new();
    if !taken.is_empty() {
        parts.push(format!("With {}", taken.join(", ")));
    }
    if axes.iter().any(|axis| !axis.drive.linearized().neglected.is_empty()) {
        parts.push("Nonlinear effects are neglected".to_owned());
    }
    parts.join(". ")
}

/// From well below the lowest frequency that matters up to `π/Δt` \[rad/s\].
fn frequencies(axes: &[Drawn<'_>]) -> Range {
    let mut range = Range::EMPTY;
    for axis in axes {
        let nyquist = axis.drive.nyquist_rad_s();
        // Room beside the last point.
        range.include(1.08 * nyquist);
        range.include(nyquist / 200.0);
        let marked = axis.phase_crossovers.iter().map(|(omega, _)| *omega);
        for omega in marked.chain(axis.crossovers.iter().copied()) {
            range.include((omega / 4.0).max(nyquist * 1e-7));
        }
    }
    range.opened(1e-9)
}

/// Frequencies evenly spaced in their logarithm.
fn spaced(range: Range) -> impl Iterator<Item = f64> {
    (0..=POINTS).map(move |i| range.low * libm::pow(range.high / range.low, f64::from(i) / f64::from(POINTS)))
}

fn decibel(magnitude: f64) -> f64 {
    20.0 * libm::log10(magnitude)
}

fn bode(title: &str, axes: &[Drawn<'_>]) -> Figure {
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

    let mut head = heading(title, "loop transfer, broken at the plant input", axes);
    head.subtitle = in_the_loop(axes);
    head.legend = axes
        .iter()
        .map(|axis| Entry::line(axis.line_style(), format!("{}: {}", axis.name, told(&axis.margins))))
        .collect();
    let space = head.draw(&mut figure);
    let height = subplot_height(&space, 2, GAP);
    let y = [y_axis(magnitudes.padded(0.18, 0.05), height, false), y_axis(phases.padded(0.1, 0.1), height, false)];
    let gutter = gutter(&[&y[0], &y[1]]);
    let frames = stack(&space, &[&y[0], &y[1]], GAP);
    let mut subplots: Vec<Subplot> =
        frames.into_iter().zip(y).map(|(frame, y)| Subplot::new(frame, Axis::decades(range), y)).collect();
    let [magnitude, phase] = subplots.as_mut_slice() else { return figure };
    for (subplot, level) in [(&mut *magnitude, 0.0), (&mut *phase, -180.0)] {
        subplot.grid(&mut figure);
        subplot.level(&mut figure, level, REFERENCE);
    }
    for (axis, response) in axes.iter().zip(&responses) {
        magnitude.curve(&mut figure, response.iter().map(|(omega, m, _)| (*omega, *m)), axis.line_style());
        phase.curve(&mut figure, response.iter().map(|(omega, _, p)| (*omega, *p)), axis.line_style());
    }
    for axis in axes {
        for &(omega, factor) in &axis.phase_crossovers {
            let at = magnitude.at(omega, -decibel(factor));
            figure.ring(at, 4.0, 1.5, axis.colour);
            if factor < LABELLED {
                let text =
                    format!("{}: × {} ({} dB)", axis.name, significant(factor, 4), significant(decibel(factor), 3));
                magnitude.point_label(&mut figure, at, &text, axis.colour);
            }
        }
        if axis.margins.stable && axis.margins.phase_margin_deg.is_finite() {
            let Margins { crossover_rad_s: omega, phase_margin_deg: margin, .. } = axis.margins;
            figure.ring(magnitude.at(omega, 0.0), 4.0, 1.5, axis.colour);
            let l = axis.drive.transfer(omega);
            let side = if l.im > 0.0 { -margin } else { margin };
            let at = phase.at(omega, -180.0 + side);
            figure.line(
                &[phase.at(omega, -180.0), at],
                LineStyle { colour: axis.colour, width_px: 1.2, dash: Some(THIN) },
            );
            figure.ring(at, 4.0, 1.5, axis.colour);
            let text = format!("{}: {}° at {} rad/s", axis.name, significant(margin, 4), significant(omega, 4));
            phase.point_label(&mut figure, at, &text, axis.colour);
        }
    }
    magnitude.level_label(&mut figure, 0.0, "0 dB", MUTED);
    phase.level_label(&mut figure, -180.0, "−180°", MUTED);
    magnitude.border(&mut figure, false, true);
    phase.border(&mut figure, true, true);
    magnitude.y_title(&mut figure, gutter, "magnitude", "dB");
    phase.y_title(&mut figure, gutter, "phase", "°");
    phase.x_title(&mut figure, "frequency", "rad/s");
    figure
}

/// Margins in few words, for a legend.
fn told(margins: &Margins) -> String {
    if !margins.stable {
        return "unstable".to_owned();
    }
    format!(
        "Ms {}, gain × {} to {}, phase {}°, delay {} ms",
        significant(margins.peak_sensitivity, 4),
        significant(margins.gain_down, 4),
        significant(margins.gain_up, 4),
        significant(margins.phase_margin_deg, 4),
        significant(1e3 * margins.delay_margin_s, 3)
    )
}

fn nyquist(title: &str, axes: &[Drawn<'_>]) -> Figure {
    let mut figure = Figure::default();
    let mut head = heading(title, "Nyquist plot of the loop transfer", axes);
    head.subtitle = String::from(
        "Frequencies up to π/Δt, and their mirror image (thin); the circle around −1 that the curve touches has the radius 1/Ms",
    );
    head.legend = axes
        .iter()
        .map(|axis| Entry::line(axis.line_style(), format!("{}: {}", axis.name, told(&axis.margins))))
        .collect();
    head.legend.push(Entry::line(REFERENCE, "|L| = 1"));
    let space = head.draw(&mut figure);

    // As far to the left as the gain may fall, but the surroundings of -1 stay visible.
    let mut x = Range { low: -2.2, high: 1.4 };
    for (_, factor) in axes.iter().flat_map(|axis| &axis.phase_crossovers) {
        x.low = x.low.min(-1.15 / factor).max(-7.0);
    }
    let room = gutter(&[&y_axis(Range { low: -1.0, high: 1.0 }, space.height(), false)]);
    let frame = Frame { left: space.left + room, right: space.right - 8.0, ..space };
    let per_px = x.span() / frame.width();
    let half = 0.5 * per_px * frame.height();
    let y = Range { low: -half, high: half };
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
    let range = frequencies(axes);
    for axis in axes {
        // Nyquist curves need their end exactly.
        let fine = Range { high: axis.drive.nyquist_rad_s(), ..range };
        let points: Vec<(f64, f64)> = spaced(fine)
            .map(|omega| axis.drive.transfer(omega))
            .map(|l| (l.re, l.im))
            .filter(|p| p.0.is_finite())
            .collect();
        let mirror = LineStyle { colour: axis.colour, width_px: 0.8, dash: Some(THIN) };
        subplot.curve(&mut figure, points.iter().map(|(re, im)| (*re, -im)), mirror);
        subplot.curve(&mut figure, points.iter().copied(), axis.line_style());
        if axis.margins.stable {
            let dash = Some(Dash::new(7.0, 4.0));
            let line_style = LineStyle { colour: axis.colour, width_px: 1.0, dash };
            subplot.curve(&mut figure, circle(-1.0, axis.margins.modulus_margin()), line_style);
        }
    }
    for axis in axes {
        for &(_, factor) in &axis.phase_crossovers {
            let at = subplot.at(-1.0 / factor, 0.0);
            if subplot.holds(at) {
                figure.ring(at, 4.0, 1.5, axis.colour);
                if factor < LABELLED {
                    let text = format!("{}: −1/{}", axis.name, significant(factor, 4));
                    subplot.point_label(&mut figure, at, &text, axis.colour);
                }
            }
        }
        if axis.margins.stable && axis.margins.phase_margin_deg.is_finite() {
            let l = axis.drive.transfer(axis.margins.crossover_rad_s);
            let at = subplot.at(l.re, l.im);
            figure.ring(at, 4.0, 1.5, axis.colour);
            let text = format!("{}: {}°", axis.name, significant(axis.margins.phase_margin_deg, 4));
            subplot.point_label(&mut figure, at, &text, axis.colour);
        }
    }
    let critical = subplot.at(-1.0, 0.0);
    figure.dot(critical, 4.5, INK);
    subplot.point_label(&mut figure, critical, "−1", INK);
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "real part", "");
    subplot.y_title(&mut figure, room, "imaginary part", "");
    figure
}

fn step(title: &str, axes: &[Drawn<'_>]) -> Figure {
    let mut figure = Figure::default();
    let kinds = [(Feedforward::With, Some(THIN)), (Feedforward::Without, None)];
    let responses: Vec<_> = axes
        .iter()
        .map(|axis| kinds.map(|(feedforward, dash)| (axis.drive.step_response(feedforward), dash)))
        .collect();
    // Somewhat longer than the slowest one takes; of an unstable one all there is.
    let longest = responses.iter().flatten().map(|(response, _)| {
        response.metrics.map_or(response.actual.len() as f64 * response.period_s, |f| 1.4 * f.settling_s)
    });
    let end = longest.fold(10.0 * axes.first().map_or(0.0, |axis| axis.drive.settings().period_s), f64::max);
    let mut head = heading(title, "response to a step of the position command", axes);
    let linear = ["Linear: no voltage limit. The shaded band is ±2 %".to_owned(), in_the_loop(axes)];
    head.subtitle = linear.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(". ");
    head.legend = vec![
        Entry::line(LineStyle::solid(INK, CURVE_PX), "feedback alone"),
        Entry::line(LineStyle { dash: Some(THIN), ..LineStyle::solid(INK, CURVE_PX) }, "with the velocity feedforward"),
    ];
    let space = head.draw(&mut figure);
    let height = subplot_height(&space, axes.len(), GAP);
    let shown = |response: &crate::analysis::StepResponse| -> Vec<(f64, f64)> {
        let times = (0..).map(|k: u32| f64::from(k) * response.period_s);
        times.zip(response.actual.iter().map(|x| x.clamp(-1e3, 1e3))).take_while(|(t, _)| *t <= end).collect()
    };
    let y: Vec<Axis> = responses
        .iter()
        .map(|kinds| {
            let mut range = Range::of(kinds.iter().flat_map(|(response, _)| shown(response)).map(|(_, x)| x));
            range.include(0.0);
            range.include(1.0);
            y_axis(range.padded(0.05, 0.12), height, false)
        })
        .collect();
    let all: Vec<&Axis> = y.iter().collect();
    let gutter = gutter(&all);
    let frames = stack(&space, &all, GAP);
    let last = axes.len().saturating_sub(1);
    for (i, ((axis, kinds), (frame, y))) in
        axes.iter().zip(&responses).zip(frames.into_iter().zip(y.iter().cloned())).enumerate()
    {
        let mut subplot = Subplot::new(frame, x_axis(Range { low: 0.0, high: end }, frame.width(), false), y);
        subplot.shade(&mut figure, 0.98, 1.02);
        subplot.grid(&mut figure);
        subplot.level(&mut figure, 1.0, LineStyle::solid(DESIRED, 1.2));
        for (response, dash) in kinds {
            subplot.curve(&mut figure, shown(response), LineStyle { dash: *dash, ..axis.line_style() });
        }
        for (response, _) in kinds.iter().rev() {
            let Some(metrics) = response.metrics else { continue };
            if metrics.overshoot_percent > 0.1 {
                let top = shown(response).into_iter().fold((0.0, 0.0), |best, p| if p.1 > best.1 { p } else { best });
                let at = subplot.at(top.0, top.1);
                figure.ring(at, 4.0, 1.5, axis.colour);
                subplot.point_label(
                    &mut figure,
                    at,
                    &format!("overshoot {} %", significant(metrics.overshoot_percent, 3)),
                    axis.colour,
                );
            }
            // It comes in over the edge that the sample before is nearer to.
            let before = shown(response).into_iter().take_while(|(t, _)| *t < metrics.settling_s).last();
            let edge = if before.is_some_and(|(_, x)| x > 1.0) { 1.02 } else { 0.98 };
            let at = subplot.at(metrics.settling_s, edge);
            figure.ring(at, 4.0, 1.5, axis.colour);
            let text = format!("settled in {} ms", significant(1e3 * metrics.settling_s, 3));
            subplot.point_label(&mut figure, at, &text, axis.colour);
        }
        subplot.border(&mut figure, i == last, true);
        subplot.y_title(&mut figure, gutter, &format!("{} actual / step", axis.name), "");
        if i == last {
            subplot.x_title(&mut figure, "time", "s");
        }
    }
    figure
}
