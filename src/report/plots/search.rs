//! The pattern search for `n_c`, iteration by iteration.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::Frame;
use super::super::figure::Figure;
use super::super::style::CURVE_PX;
use super::super::subplot::{Entry, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use super::named_run::{Named, heading};
use crate::optimize::Step;

const GAP: f64 = 20.0;

/// One of the four quantities.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    of: fn(&Step) -> f64,
    logarithmic: bool,
    whole: bool,
}

/// By columns.
const QUANTITIES: [[Quantity; 2]; 2] = [
    [
        Quantity { name: "peak jerk", unit: "mm/s³", of: |s| s.objective, logarithmic: false, whole: false },
        Quantity {
            name: "best n_c",
            unit: "",
            of: |s| s.point.first().copied().unwrap_or(f64::NAN),
            logarithmic: false,
            whole: false,
        },
    ],
    [
        Quantity { name: "mesh size", unit: "", of: |s| s.mesh, logarithmic: true, whole: false },
        Quantity { name: "evaluations", unit: "", of: |s| s.evaluations as f64, logarithmic: false, whole: true },
    ],
];

pub(in super::super) fn figure(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let searches: Vec<(&Named<'_>, &[Step])> = runs
        .iter()
        .filter_map(|run| Some((run, run.data.metadata().n_c_search.as_deref()?)))
        .filter(|(_, steps)| !steps.is_empty())
        .collect();
    let mut head = heading(runs, "pattern search for n_c");
    if let [(run, steps)] = searches.as_slice() {
        head.subtitle = metrics(steps, false);
        head.legend.push(Entry::line(run.line_style(CURVE_PX), "best so far, an iteration a dot"));
    } else {
        let entry = |(run, steps): &(&Named<'_>, &[Step])| {
            Entry::line(run.line_style(CURVE_PX), format!("{} ({})", run.short(), metrics(steps, true)))
        };
        head.legend.extend(searches.iter().map(entry));
    }
    let space = head.draw(&mut figure);
    let all = || searches.iter().flat_map(|(_, steps)| steps.iter());
    let mut iterations = Range::of(all().map(|step| step.iteration as f64));
    iterations.high = iterations.high.max(iterations.low + 1.0);

    let height = subplot_height(&space, 2, GAP);
    let middle = 0.5 * (space.left + space.right);
    let halves = [Frame { right: middle - 10.0, ..space }, Frame { left: middle + 10.0, ..space }];
    for (half, quantities) in halves.iter().zip(&QUANTITIES) {
        let y = quantities.each_ref().map(|quantity| axis(quantity, &mut all().map(quantity.of), height));
        let gutter = gutter(&[&y[0], &y[1]]);
        let frames = stack(half, &[&y[0], &y[1]], GAP);
        for (row, ((frame, y), quantity)) in frames.into_iter().zip(y).zip(quantities).enumerate() {
            let x = x_axis(iterations.padded(0.02, 0.02), frame.width(), true);
            let mut subplot = Subplot::new(frame, x, y);
            subplot.grid(&mut figure);
            for (run, steps) in &searches {
                let drawable = |step: &&Step| {
                    let value = (quantity.of)(step);
                    value.abs() <= 1e100 && (value > 0.0 || !quantity.logarithmic)
                };
                let values: Vec<(f64, f64)> =
                    steps.iter().filter(drawable).map(|step| (step.iteration as f64, (quantity.of)(step))).collect();
                subplot.curve(&mut figure, values.iter().copied(), run.line_style(CURVE_PX));
                // Dots that do not touch.
                if (values.len() as f64) * 7.0 < frame.width() {
                    for (x, y) in &values {
                        figure.dot(subplot.at(*x, *y), 2.6, run.colour);
                    }
                }
            }
            subplot.border(&mut figure, row == 1, true);
            subplot.y_title(&mut figure, gutter, quantity.name, quantity.unit);
            if row == 1 {
                subplot.x_title(&mut figure, "iteration", "");
            }
        }
    }
    figure
}

fn axis(quantity: &Quantity, values: &mut dyn Iterator<Item = f64>, height_px: f64) -> Axis {
    let values = values.filter(|value| value.abs() <= 1e100 && (*value > 0.0 || !quantity.logarithmic));
    let range = Range::of(values);
    if quantity.logarithmic {
        return Axis::logarithmic(range, 6);
    }
    y_axis(range.opened(if quantity.whole { 1.0 } else { 1e-9 }).padded(0.08, 0.1), height_px, quantity.whole)
}

/// Where the search ended; in few words for a legend.
fn metrics(steps: &[Step], short: bool) -> String {
    let Some(last) = steps.last() else { return String::new() };
    let n_c = last.point.first().map(|n_c| format!("n_c = {}, ", significant(*n_c, 5))).unwrap_or_default();
    let (jerk, evaluations) = (significant(last.objective, 5), last.evaluations);
    if short {
        format!("{n_c}{jerk} mm/s³, {evaluations} evaluations")
    } else {
        format!("Best {n_c}peak jerk {jerk} mm/s³ after {} iterations and {evaluations} evaluations", last.iteration)
    }
}
