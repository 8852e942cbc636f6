//! How a tuning converged: the best so far of every start, over evaluations.

use super::super::axis::{Axis, Range, significant, told_apart};
use super::super::convergence::Convergence;
use super::super::curve::{Dash, Frame};
use super::super::figure::Figure;
use super::super::font;
use super::super::style::{CURVE_PX, Colour, INK, LineStyle, RUN_COLOURS};
use super::super::subplot::{Entry, Heading, Subplot, TITLE_EM, gutter, x_axis};
use super::words::printable;
use crate::optimize::Step;

const GAP: f64 = 20.0;

/// Room above and below the objectives, as a factor on their logarithmic axis.
const MARGIN: f64 = 1.08;

/// Share of the height that the violations take, where there are any.
const VIOLATIONS: f64 = 0.28;

const EVALUATIONS: &str = "evaluations of each start, behind the longest those of the polish";
const EVALUATIONS_ALONE: &str = "evaluations of each start";

/// Stroke of the starts \[px\].
const THIN_PX: f64 = 1.1;

/// One search, its first evaluation at `offset` of the axis.
struct Drawn<'a> {
    steps: &'a [Step],
    offset: f64,
    line_style: LineStyle,
}

impl Drawn<'_> {
    fn place(&self, step: &Step) -> f64 {
        self.offset + step.evaluations as f64
    }

    /// Where the best so far is an allowed point: evaluations and objective.
    fn objectives(&self) -> Vec<(f64, f64)> {
        let allowed = |step: &&Step| step.value().is_feasible() && is_drawable(step.objective);
        self.steps.iter().filter(allowed).map(|step| (self.place(step), step.objective)).collect()
    }

    /// Where it is not: evaluations and violation.
    fn violations(&self) -> Vec<(f64, f64)> {
        let broken = |step: &&Step| is_drawable(step.violation);
        self.steps.iter().filter(broken).map(|step| (self.place(step), step.violation)).collect()
    }

    /// Where it found its first allowed point, if it began with another.
    fn entry(&self) -> Option<(f64, f64)> {
        let began_outside = self.steps.first().is_some_and(|step| !step.value().is_feasible());
        if began_outside { self.objectives().first().copied() } else { None }
    }
}

/// Positive and neither infinite nor beyond all reason.
fn is_drawable(value: f64) -> bool {
    value > 0.0 && value <= 1e100
}

pub(in super::super) fn figure(convergence: &Convergence<'_>) -> Figure {
    let mut figure = Figure::default();
    let searches = drawn(convergence);
    let is_any_outside = searches.iter().any(|search| !search.violations().is_empty());
    let space = heading(convergence, &searches, is_any_outside).draw(&mut figure);

    let places = searches.iter().flat_map(|search| search.steps.iter().map(|step| search.place(step)));
    let mut evaluations = Range::of(places);
    evaluations.include(0.0);
    evaluations.high = evaluations.high.max(evaluations.low + 1.0);
    let share = if is_any_outside { VIOLATIONS } else { 0.0 };
    let lower_px = share * space.height();
    let upper_px = space.height() - lower_px - if is_any_outside { GAP } else { 0.0 };
    let decades = |values: Vec<f64>, most| Axis::logarithmic(Range::of(values), most);
    let objectives = Range::of(searches.iter().flat_map(Drawn::objectives).map(|(_, objective)| objective));
    let wide = Range { low: objectives.low / MARGIN, high: objectives.high * MARGIN };
    let y = Axis::logarithmic_within(wide, upper_px, 45.0);
    let below = decades(searches.iter().flat_map(Drawn::violations).map(|(_, violation)| violation).collect(), 4);
    let gutter = if is_any_outside { gutter(&[&y, &below]) } else { gutter(&[&y]) };
    let frame = Frame { left: space.left + gutter, right: space.right - 8.0, ..space };
    let x = x_axis(evaluations.padded(0.0, 0.02), frame.width(), true);

    let is_polished = convergence.searches.iter().any(|(start, _)| start.is_none());
    let evaluations_title = if is_polished { EVALUATIONS } else { EVALUATIONS_ALONE };

    let mut subplot = Subplot::new(Frame { bottom: space.top + upper_px, ..frame }, x.clone(), y);
    subplot.grid(&mut figure);
    for search in &searches {
        subplot.curve(&mut figure, stairs(&search.objectives()), search.line_style);
    }
    for search in &searches {
        if let Some((x, y)) = search.entry() {
            figure.ring(subplot.at(x, y), 4.0, 1.5, search.line_style.colour);
        }
    }
    if let Some((at, objective)) = searches.last().and_then(|search| search.objectives().last().copied()) {
        let end = subplot.at(at, objective);
        figure.dot(end, 3.0, INK);
        subplot.point_label(&mut figure, end, &format!("{} {}", significant(objective, 4), convergence.unit), INK);
    }
    subplot.border(&mut figure, !is_any_outside, true);
    subplot.y_title(&mut figure, gutter, "best objective so far", convergence.unit);
    if is_any_outside {
        let mut subplot = Subplot::new(Frame { top: space.bottom - lower_px, ..frame }, x, below);
        subplot.grid(&mut figure);
        for search in &searches {
            subplot.curve(&mut figure, stairs(&search.violations()), search.line_style);
        }
        subplot.border(&mut figure, true, true);
        subplot.y_title(&mut figure, gutter, "violation", "");
        subplot.x_title(&mut figure, evaluations_title, "");
    } else {
        subplot.x_title(&mut figure, evaluations_title, "");
    }
    figure
}

/// The starts side by side from 0, the polish of the best behind the longest of them.
fn drawn<'a>(convergence: &Convergence<'a>) -> Vec<Drawn<'a>> {
    let length = |steps: &[Step]| steps.last().map_or(0, |step| step.evaluations) as f64;
    let starts = convergence.searches.iter().filter(|(start, _)| start.is_some());
    let longest = starts.map(|(_, steps)| length(steps)).fold(0.0, f64::max);
    let pale = |(r, g, b): Colour| {
        // Starts stand back behind the polish.
        let lighter = |c: u8| c + (255 - c) / 4;
        (lighter(r), lighter(g), lighter(b))
    };
    let one = |(start, steps): &(Option<usize>, &'a [Step])| match start {
        Some(start) => {
            let line_style = LineStyle { dash: dash(*start), ..LineStyle::solid(pale(own_or_other(*start)), THIN_PX) };
            Drawn { steps, offset: 0.0, line_style }
        }
        None => Drawn { steps, offset: longest, line_style: LineStyle::solid(INK, CURVE_PX) },
    };
    convergence.searches.iter().map(one).collect()
}

/// The first colour is that of the scenario's own gains alone.
fn own_or_other(start: usize) -> Colour {
    let others = RUN_COLOURS.len() - 1;
    if start == 0 { RUN_COLOURS[0] } else { RUN_COLOURS[1 + (start - 1) % others] }
}

/// Where colours come again, dashes tell starts apart.
fn dash(start: usize) -> Option<Dash> {
    const DASHES: [Option<Dash>; 3] = [None, Some(Dash::new(8.0, 4.0)), Some(Dash::new(3.0, 3.0))];
    let others = RUN_COLOURS.len() - 1;
    DASHES[start.saturating_sub(1) / others % DASHES.len()]
}

/// The best so far stays until there is a better one.
fn stairs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut stairs: Vec<(f64, f64)> = Vec::with_capacity(2 * points.len());
    for &(x, y) in points {
        if let Some(&(_, before)) = stairs.last()
            && before != y
        {
            stairs.push((x, before));
        }
        stairs.push((x, y));
    }
    stairs
}

fn heading(convergence: &Convergence<'_>, searches: &[Drawn<'_>], is_any_outside: bool) -> Heading {
    let name = font::shortened(&printable(convergence.name), TITLE_EM, 700.0);
    let mut heading =
        Heading { title: format!("{name}: tuning"), subtitle: printable(convergence.subtitle), ..Heading::default() };
    let finals: Vec<Option<f64>> =
        searches.iter().map(|search| search.objectives().last().map(|(_, objective)| *objective)).collect();
    let mut texts = told_apart(&finals.iter().flatten().copied().collect::<Vec<_>>(), 4).into_iter();
    for ((search, reached), (start, _)) in searches.iter().zip(&finals).zip(&convergence.searches) {
        let what = match start {
            Some(0) => "start 1, the scenario's own gains".to_owned(),
            Some(start) => format!("start {}", start + 1),
            None => "polish of the best".to_owned(),
        };
        let reached = match reached {
            Some(_) => format!("{} {}", texts.next().unwrap_or_default(), convergence.unit),
            None => "keeps not every constraint".to_owned(),
        };
        heading.legend.push(Entry::line(search.line_style, format!("{what}: {reached}")));
    }
    if is_any_outside && let Some(search) = searches.iter().find(|search| search.entry().is_some()) {
        let symbol = super::super::subplot::Symbol::Ring(search.line_style.colour);
        heading.legend.push(Entry { symbol, text: "keeps every constraint from here on".to_owned() });
    }
    heading
}
