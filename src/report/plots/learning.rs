//! How learning went: errors over runs, and what was learned.

use super::super::axis::{Axis, Range, figure};
use super::super::curve::{Dash, Frame};
use super::super::font;
use super::super::panel::{Entry, Heading, Panel, TITLE_EM, gutter, x_axis, y_axis};
use super::super::sheet::{CURVE_PX, Colour, INK, MUTED, Pen, RUN_COLOURS, Sheet};
use super::printable;
use crate::learning::{LearnRun, Learned};

/// Room between the panels, with the title of the upper one's axis in it \[px\].
const GAP: f64 = 62.0;
/// More runs than this are not marked one by one.
const MOST_MARKED: usize = 60;

/// Corrections of X and of Y: no colour stands for two things.
const SHIFTS: [Colour; 2] = [RUN_COLOURS[0], RUN_COLOURS[2]];

/// What is drawn over the runs.
type Curve = (&'static str, Pen, fn(&LearnRun) -> f64);

fn curves() -> [Curve; 3] {
    let dashed = |pen: Pen| Pen { dash: Some(Dash::new(6.0, 4.0)), ..pen };
    [
        ("tracking error, rms", Pen::solid(INK, CURVE_PX), |run| run.rms_tracking_error_um),
        ("largest tracking error", dashed(Pen::solid(MUTED, CURVE_PX)), |run| run.max_tracking_error_um),
        ("largest contouring error", Pen::solid(RUN_COLOURS[1], CURVE_PX), |run| run.max_contour_error_um),
    ]
}

pub(in super::super) fn sheet(learned: &Learned) -> Sheet {
    let mut sheet = Sheet::default();
    let space = heading(learned).draw(&mut sheet);
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
    let mut panel = Panel::new(frame, x_axis(runs, frame.width(), true), y);
    panel.grid(&mut sheet);
    for (_, pen, pick) in curves() {
        let points = learned.runs.iter().map(|run| (f64::from(run.run), shown(pick(run))));
        panel.curve(&mut sheet, points.clone(), pen);
        if learned.runs.len() <= MOST_MARKED {
            for (run, value) in points {
                sheet.dot(panel.at(run, value), 2.6, pen.colour);
            }
        }
    }
    if let Some(best) = learned.runs.iter().find(|run| run.run == learned.best_run) {
        for (_, pen, pick) in curves() {
            let at = panel.at(f64::from(best.run), shown(pick(best)));
            panel.point_label(&mut sheet, at, &format!("{} µm", figure(pick(best), 3)), pen.colour);
        }
    }
    panel.border(&mut sheet, true, true);
    panel.y_title(&mut sheet, gutter, "error", "µm");
    panel.x_title(&mut sheet, "run", "");

    let end = learned.corrections_mm.len().saturating_sub(1).max(1) as f64 * learned.period_s;
    let frame = inner(lower);
    let mut panel = Panel::new(frame, x_axis(Range { low: 0.0, high: end }, frame.width(), false), below);
    panel.grid(&mut sheet);
    for (shift, colour) in shifts_um.into_iter().zip(SHIFTS) {
        panel.curve(&mut sheet, shift, Pen::solid(colour, CURVE_PX));
    }
    panel.border(&mut sheet, true, true);
    panel.y_title(&mut sheet, gutter, "correction of the command", "µm");
    panel.x_title(&mut sheet, "time", "s");
    sheet
}

fn heading(learned: &Learned) -> Heading {
    let name = font::shortened(&printable(&learned.scenario), TITLE_EM, 600.0);
    let mut legend: Vec<Entry> = curves().into_iter().map(|(text, pen, _)| Entry::line(pen, text)).collect();
    let axes = ["correction of X", "correction of Y"].into_iter().zip(SHIFTS);
    legend.extend(axes.map(|(text, colour)| Entry::line(Pen::solid(colour, CURVE_PX), text)));
    Heading {
        title: format!("{name}: iterative learning, {} runs", learned.runs.len()),
        subtitle: format!(
            "Learning gain {}, low pass at {} Hz; below, what run {} was given",
            figure(learned.gain, 3),
            figure(learned.cutoff_hz, 4),
            learned.best_run
        ),
        warnings: learned.diverged.iter().chain(&learned.warnings).map(|text| printable(text)).collect(),
        legend,
    }
}
