//! A tool path from above.

use super::super::axis::Range;
use super::super::curve::{Dash, Frame, Px};
use super::super::figure::Figure;
use super::super::font;
use super::super::part_data::{MoveKind, PathMove, PathPicture};
use super::super::style::{INK, LineStyle, MUTED, VERMILLION};
use super::super::subplot::{Entry, Heading, Symbol, TITLE_EM};
use super::path::{arrows, equal_scale};
use super::sweep::colour::{ROOM_PX, Scale};
use super::words::{capital, printable};

pub(super) const RAPID: LineStyle = LineStyle { colour: VERMILLION, width_px: 1.0, dash: Some(Dash::new(5.0, 4.0)) };
const LINK: LineStyle = LineStyle { colour: INK, width_px: 1.6, dash: None };
pub(super) const LINK_TEXT: &str = "from ring to ring, cutting";
const BORDER: LineStyle = LineStyle { colour: MUTED, width_px: 2.4, dash: None };
/// Rings with arrows: some of many.
const ARROWED: usize = 5;

/// Title, caption and what every kind of move that is drawn looks like; `is_drawn` says of a move whether it is.
pub(super) fn heading(picture: &PathPicture, what: &str, is_drawn: impl Fn(&PathMove) -> bool) -> Heading {
    let has = |wanted: fn(MoveKind) -> bool| picture.moves.iter().any(|m| wanted(m.kind) && is_drawn(m));
    let mut legend = Vec::new();
    legend.extend(has(|kind| kind == MoveKind::Link).then(|| Entry::line(LINK, LINK_TEXT)));
    legend.extend(has(|kind| kind == MoveKind::Rapid).then(|| Entry::line(RAPID, "rapid moves")));
    if ends(picture).is_some() {
        legend.push(Entry { symbol: Symbol::Ring(INK), text: "start".to_owned() });
        legend.push(Entry { symbol: Symbol::Ring(VERMILLION), text: "end".to_owned() });
    }
    Heading {
        title: format!("{}: {what}", font::shortened(&printable(&picture.name), TITLE_EM, 700.0)),
        subtitle: capital(&printable(&picture.caption)),
        legend,
        ..Heading::default()
    }
}

/// The places of a move that are numbers.
pub(super) fn places(of: &PathMove) -> impl DoubleEndedIterator<Item = [f64; 3]> + '_ {
    of.points_mm.iter().copied().filter(|p| p.iter().all(|c| c.abs() <= 1e100))
}

/// Whether a move is more than a point in plan: a plunge is not.
fn is_seen_in_plan(of: &PathMove) -> bool {
    let mut points = places(of).map(|p| [p[0], p[1]]);
    points.next().is_some_and(|first| points.any(|point| point != first))
}

/// First and last place of a path.
pub(super) fn ends(picture: &PathPicture) -> Option<[[f64; 3]; 2]> {
    let first = picture.moves.iter().find_map(|m| places(m).next())?;
    let last = picture.moves.iter().rev().find_map(|m| places(m).next_back())?;
    Some([first, last])
}

/// Marks where a path starts and ends.
pub(super) fn mark_ends(figure: &mut Figure, [start, end]: [Px; 2]) {
    for (at, radius, colour) in [(start, 7.0, INK), (end, 4.5, VERMILLION)] {
        figure.ring(at, radius, 2.0, colour);
    }
}

pub(in super::super) fn figure(picture: &PathPicture) -> Figure {
    let mut figure = Figure::default();
    let mut head = heading(picture, "tool path in plan", is_seen_in_plan);
    let borders: Vec<Vec<(f64, f64)>> = picture
        .borders_mm
        .iter()
        .map(|border| {
            let points = border.iter().filter(|p| p.iter().all(|c| c.abs() <= 1e100)).map(|[x, y]| (*x, *y));
            let mut points: Vec<(f64, f64)> = points.collect();
            points.extend(points.first().copied());
            points
        })
        .filter(|border| border.len() > 1)
        .collect();
    if !borders.is_empty() {
        head.legend.insert(0, Entry::line(BORDER, "border of the region"));
    }
    let depths = || {
        let rings = picture.moves.iter().filter(|m| places(m).next().is_some());
        rings.filter_map(|m| if let MoveKind::Ring(depth) = m.kind { Some(depth) } else { None })
    };
    if let Some(deepest) = depths().max() {
        head.subtitle = format!(
            "{}{}rings of depth 0 to {deepest}",
            head.subtitle,
            if head.subtitle.is_empty() { "" } else { "; " }
        );
    }
    let space = head.draw(&mut figure);
    let points = || {
        let path = picture.moves.iter().flat_map(places).map(|p| (p[0], p[1]));
        path.chain(borders.iter().flatten().copied())
    };
    let (x, y) = (Range::of(points().map(|p| p.0)), Range::of(points().map(|p| p.1)));
    let (mut subplot, gutter) = equal_scale(Frame { right: space.right - ROOM_PX, ..space }, x, y);
    let range = Range::of(depths().map(f64::from));
    let scale = Scale::of_lines(Range { low: range.low.min(0.0), ..range }, subplot.frame.height(), true);

    subplot.grid(&mut figure);
    for border in borders {
        subplot.curve(&mut figure, border, BORDER);
    }
    // Rings first, so that the moves between them are seen.
    let mut arrowed = Vec::new();
    for rank in 0..3 {
        for part in &picture.moves {
            let line_style = match (rank, part.kind) {
                (0, MoveKind::Ring(depth)) => LineStyle::solid(scale.colour_of(f64::from(depth)), 1.3),
                (1, MoveKind::Link) => LINK,
                (2, MoveKind::Rapid) => RAPID,
                _ => continue,
            };
            let line: Vec<(f64, f64)> = places(part).map(|p| (p[0], p[1])).collect();
            if !is_seen_in_plan(part) {
                continue;
            }
            subplot.curve(&mut figure, line.iter().copied(), line_style);
            if rank == 0 {
                arrowed.push(line);
            }
        }
    }
    let every = arrowed.len().div_ceil(ARROWED).max(1);
    for line in arrowed.iter().step_by(every) {
        arrows(&mut figure, &subplot, line);
    }
    if let Some(ends) = ends(picture) {
        mark_ends(&mut figure, ends.map(|p| subplot.at(p[0], p[1])));
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, "x", "mm");
    subplot.y_title(&mut figure, gutter, "y", "mm");
    if depths().next().is_some() {
        scale.draw(&mut figure, &subplot.frame, "depth of the ring", "");
    }
    figure
}
