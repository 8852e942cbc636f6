//! The response of servo loops to a step of the position command.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::Dash;
use super::super::figure::Figure;
use super::super::style::{CURVE_PX, DESIRED, INK, LineStyle};
use super::super::subplot::{Entry, Subplot, gutter, stack, subplot_height, x_axis, y_axis};
use super::servo_loop::{Drawn, THIN, heading, in_the_loop};
use crate::analysis::{Feedforward, StepResponse};

const GAP: f64 = 18.0;
/// A response farther from the step than this, in steps, leaves the plot where it diverges.
const LEAVES: f64 = 4.0;

/// One response of an axis.
struct Response {
    points: Vec<(f64, f64)>,
    dash: Option<Dash>,
    metrics: Option<crate::analysis::StepMetrics>,
    stable: bool,
}

impl Response {
    fn of(response: &StepResponse, dash: Option<Dash>, stable: bool) -> Self {
        let times = (0..).map(|k: u32| f64::from(k) * response.period_s);
        let points = times.zip(response.actual.iter().copied()).take_while(|(_, x)| x.is_finite());
        Self { points: points.collect(), dash, metrics: response.metrics, stable }
    }

    /// The first point of an unstable response that is beyond the plot.
    fn exit(&self) -> Option<usize> {
        let out = self.points.iter().position(|(_, x)| (x - 1.0).abs() > LEAVES);
        out.filter(|_| !self.stable)
    }

    /// What is drawn: of an unstable response the way out, for behind it there is nothing to be seen but lines up and down.
    fn shown(&self) -> &[(f64, f64)] {
        self.exit().and_then(|exit| self.points.get(..=exit)).unwrap_or(&self.points)
    }

    /// Where what is drawn crosses the end of a range, and whether upwards.
    fn crossing(&self, range: &Range) -> Option<((f64, f64), bool)> {
        self.exit()?;
        let [.., before, out] = self.shown() else { return None };
        let upwards = out.1 > 1.0;
        let edge = if upwards { range.high } else { range.low };
        let share = ((edge - before.1) / (out.1 - before.1)).clamp(0.0, 1.0);
        Some(((before.0 + share * (out.0 - before.0), edge), upwards))
    }

    /// How long it is to be seen: somewhat longer than it takes to settle, or to leave; else all there is.
    fn length_s(&self) -> f64 {
        match (&self.metrics, self.exit()) {
            (Some(metrics), _) => 1.4 * metrics.settling_s,
            (None, Some(_)) => self.shown().last().map_or(0.0, |(t, _)| 1.5 * t),
            (None, None) => self.points.last().map_or(0.0, |(t, _)| *t),
        }
    }

    fn range(&self, end_s: f64) -> Range {
        let shown = self.shown().iter().filter(|(t, _)| *t <= end_s).map(|(_, x)| *x);
        let range = Range::of(shown);
        if self.stable {
            return range;
        }
        // What leaves is clipped by the frame.
        Range { low: range.low.max(1.0 - LEAVES), high: range.high.min(1.0 + LEAVES) }
    }
}

pub(in super::super) fn figure(title: &str, axes: &[Drawn<'_>]) -> Figure {
    let mut figure = Figure::default();
    let kinds = [(Feedforward::With, Some(THIN)), (Feedforward::Without, None)];
    let responses: Vec<[Response; 2]> = axes
        .iter()
        .map(|axis| {
            let stable = axis.margins.stable;
            kinds.map(|(feedforward, dash)| Response::of(&axis.drive.step_response(feedforward), dash, stable))
        })
        .collect();
    let least = 10.0 * axes.first().map_or(0.0, |axis| axis.drive.settings().period_s);
    let end = responses.iter().flatten().map(Response::length_s).fold(least, f64::max);
    let mut head = heading(title, "response to a step of the position command", axes);
    let linear = ["Linear: no voltage limit. The shaded band is ±2 %".to_owned(), in_the_loop(axes)];
    head.subtitle = linear.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(". ");
    head.legend = vec![
        Entry::line(LineStyle::solid(INK, CURVE_PX), "feedback alone"),
        Entry::line(LineStyle { dash: Some(THIN), ..LineStyle::solid(INK, CURVE_PX) }, "with the velocity feedforward"),
    ];
    let space = head.draw(&mut figure);
    let height = subplot_height(&space, axes.len(), GAP);
    let y: Vec<Axis> = responses
        .iter()
        .map(|kinds| {
            let ranges = kinds.each_ref().map(|response| response.range(end));
            let mut range = Range::of(ranges.iter().flat_map(|range| [range.low, range.high]));
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
        for response in kinds {
            let line_style = LineStyle { dash: response.dash, ..axis.line_style() };
            subplot.curve(&mut figure, response.shown().iter().copied(), line_style);
        }
        for response in kinds.iter().rev() {
            mark(&mut figure, &mut subplot, axis, response);
        }
        subplot.border(&mut figure, i == last, true);
        subplot.y_title(&mut figure, gutter, &format!("{} actual / step", axis.name), "");
        if i == last {
            subplot.x_title(&mut figure, "time", "s");
        }
    }
    figure
}

/// Overshoot and settling of a response; of one that does not settle what it does instead.
fn mark(figure: &mut Figure, subplot: &mut Subplot, axis: &Drawn<'_>, response: &Response) {
    if let Some(((leaves_s, edge), upwards)) = response.crossing(&subplot.y.range) {
        let (x, y) = subplot.at(leaves_s, edge);
        let beyond = (x, if upwards { y - 1.0 } else { y + 1.0 });
        let text = format!("diverges, leaves the plot after {} ms", significant(1e3 * leaves_s, 3));
        subplot.beyond(figure, beyond, &text, axis.colour);
        return;
    }
    let Some(metrics) = response.metrics else {
        if let Some(&(t, x)) = response.points.last() {
            let text = if response.stable { "not settled yet" } else { "diverges slowly" };
            let at = subplot.at(t, x);
            subplot.point_label(figure, at, text, axis.colour);
        }
        return;
    };
    let points = &response.points;
    if metrics.overshoot_percent > 0.1 {
        let top = points.iter().copied().fold((0.0, 0.0), |best, p| if p.1 > best.1 { p } else { best });
        let at = subplot.at(top.0, top.1);
        subplot.ring(figure, at, 4.0, 1.5, axis.colour);
        let text = format!("overshoot {} %", significant(metrics.overshoot_percent, 3));
        subplot.point_label(figure, at, &text, axis.colour);
    }
    // It comes in over the edge that the sample before is nearer to.
    let before = points.iter().take_while(|(t, _)| *t < metrics.settling_s).last();
    let edge = if before.is_some_and(|(_, x)| *x > 1.0) { 1.02 } else { 0.98 };
    let at = subplot.at(metrics.settling_s, edge);
    subplot.ring(figure, at, 4.0, 1.5, axis.colour);
    let text = format!("settled in {} ms", significant(1e3 * metrics.settling_s, 3));
    subplot.point_label(figure, at, &text, axis.colour);
}
