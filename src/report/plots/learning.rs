//! How learning went: errors over runs, and what was learned.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::{Dash, Frame};
use super::super::figure::Figure;
use super::super::font;
use super::super::style::{CURVE_PX, Colour, INK, LineStyle, MUTED, RUN_COLOURS};
use super::super::subplot::{Entry, Heading, Subplot, TITLE_EM, gutter, x_axis, y_axis};
use super::words::printable;
use crate::learning::{LearnRun, Learned};

/// Room between the subplots, with the title of the upper one's axis in it \[px\].
const GAP: f64 = 62.0;
/// More runs than this are not marked one by one.
const MOST_MARKED: usize = 60;

/// Corrections of X and of Y: no colour stands for two things.
const SHIFTS: [Colour; 2] = [RUN_COLOURS[0], RUN_COLOURS[2]];

/// What is drawn over the runs.
type Curve = (&'static str, LineStyle, fn(&LearnRun) -> f64);

fn curves() -> [Curve; 3] {
    let dashed = |line_style: LineStyle| LineStyle { dash: Some(Dash::new(6.0, 4.0)), ..line_style };
    [
        ("tracking error, rms", LineStyle::solid(INK, CURVE_PX), |run| run.rms_tracking_error_um),
        ("largest tracking error", dashed(LineStyle::solid(MUTED, CURVE_PX)), |run| run.max_tracking_error_um),
        ("largest contouring error", LineStyle::solid(RUN_COLOURS[1], CURVE_PX), |run| run.max_contour_error_um),
    ]
}

pub(in super::super) fn figure(learned: &Learned) -> Figure {
    let mut figure = Figure::default();
    let space = heading(learned).draw(&mut figure);
    let half = 0.5 * (space.height() - GAP);
    let upper = Frame { bottom: space.top + half, ..space };
    let lower = Frame { top: space.bottom - half, ..space };

    // On a logarithmic axis zero has no place; below a picometre all is rounding.
    let shown = |value: f64| value.max(1e-6);
    let values = learned.runs.iter().flat_map(|run| curves().map(|(_, _, pick)| shown(pick(run))));
    let range = Range::of(values).opened(1e-9);
    let wide = Range { low: range.low / 1.15, high: range.high * 1.25 };
    let y = Axis::decades(wide);
    let shifts_um: Vec<Vec<(f64, f64)>> = [0, 1]
        .map(|axis| {
            let at = |(k, shift): (usize, &nalgebra::Vector2<f64>)| (k as f64 * learned.period_s, 1e3 * shift[axis]);
            learned.corrections_mm.iter().enumerate().map(at).collect()
        })
        .into();
    let mut shift_range = Range::of(shifts_um.iter().flatten().map(|(_, um)| *um));
    shift_range.include(0.0);
    let below = y_axis(shift_range.opened(1e-3).padded(0.08, 0.12), lower.height(), false);
    let gutter = gutter(&[&y, &below]);
    let inner = |frame: Frame| Frame { left: frame.left + gutter, right: frame.right - 8.0, ..frame };

    let last = learned.runs.last().map_or(1, |run| run.run);
    let runs = Range { low: 0.5, high: f64::from(last) + 0.5 };
    let frame = inner(upper);
    let mut subplot = Subplot::new(frame, x_axis(runs, frame.width(), true), y);
    subplot.grid(&mut figure);
    for (_, line_style, pick) in curves() {
        let points = learned.runs.iter().map(|run| (f64::from(run.run), shown(pick(run))));
        subplot.curve(&mut figure, points.clone(), line_style);
        if learned.runs.len() <= MOST_MARKED {
            for (run, value) in points {
                figure.dot(subplot.at(run, value), 2.6, line_style.colour);
            }
        }
    }
    if let Some(best) = learned.runs.iter().find(|run| run.run == learned.best_run) {
        for (_, line_style, pick) in curves() {
            let at = subplot.at(f64::from(best.run), shown(pick(best)));
            subplot.point_label(&mut figure, at, &format!("{} µm", significant(pick(best), 3)), line_style.colour);
        }
    }
    subplot.border(&mut figure, true, true);
    subplot.y_title(&mut figure, gutter, "error", "µm");
    subplot.x_title(&mut figure, "run", "");

    let end = learned.corrections_mm.len().saturating_sub(1).max(1) as f64 * learned.period_s;
    let frame = inner(lower);
    let mut subplot = Subplot::new(frame, x_axis(Range { low: 0.0, high: end }, frame.width(), false), below);
    subplot.grid(&mut figure);
    for (shift, colour) in shifts_um.into_iter().zip(SHIFTS) {
        subplot.curve(&mut figure, shift, LineStyle::solid(colour, CURVE_PX));
    }
    subplot.border(&mut figure, true, true);
    subplot.y_title(&mut figure, gutter, "correction of the command", "µm");
    subplot.x_title(&mut figure, "time", "s");
    figure
}

fn heading(learned: &Learned) -> Heading {
    let name = font::shortened(&printable(&learned.scenario), TITLE_EM, 600.0);
    let mut legend: Vec<Entry> =
        curves().into_iter().map(|(text, line_style, _)| Entry::line(line_style, text)).collect();
    let axes = ["correction of X", "correction of Y"].into_iter().zip(SHIFTS);
    legend.extend(axes.map(|(text, colour)| Entry::line(LineStyle::solid(colour, CURVE_PX), text)));
    Heading {
        title: format!("{name}: iterative learning, {} runs", learned.runs.len()),
        subtitle: format!(
            "Learning gain {}, low pass at {} Hz; below, what run {} was given",
            significant(learned.gain, 3),
            significant(learned.cutoff_hz, 4),
            learned.best_run
        ),
        warnings: learned.diverged.iter().chain(&learned.warnings).map(|text| printable(text)).collect(),
        legend,
    }
}
