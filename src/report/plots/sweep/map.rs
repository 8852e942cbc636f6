//! The metric over two variables: cells of a grid, or scattered dots.

use super::super::super::axis::{Axis, Range, significant};
use super::super::super::curve::Frame;
use super::super::super::figure::Figure;
use super::super::super::style::{INK, WHITE};
use super::super::super::subplot::{Subplot, gutter, y_axis};
use super::colour::{ROOM_PX, Scale};
use super::shared::{BEST, LOCKED, MISSING, OWN, across, heading, marker, missing_entries, ring_entry, with_unit};
use crate::sweep::{SweepAxis, SweepCell, SweepPicture, SweepPlot};

/// A map or scattered dots, taken apart.
struct Parts<'a> {
    axes: &'a [SweepAxis; 2],
    ranges: [Range; 2],
    own: Option<[f64; 2]>,
    best: Option<([f64; 2], f64)>,
    cells: Vec<SweepCell>,
}

fn parts(plot: &SweepPlot) -> Option<Parts<'_>> {
    match plot {
        SweepPlot::Map { axes, edges, cells, own, best, .. } => {
            let ranges = edges.each_ref().map(|edges| Range::of(edges.iter().copied()));
            Some(Parts { axes, ranges, own: *own, best: *best, cells: cells.clone() })
        }
        SweepPlot::Scatter { axes, points, own, best } => {
            let ranges = [0, 1].map(|i| {
                let range = Range::of(points.iter().map(|(point, _)| point[i]));
                if axes[i].logarithmic { range } else { range.opened(1e-300).padded(0.03, 0.03) }
            });
            let cells = points.iter().map(|(_, cell)| *cell).collect();
            Some(Parts { axes, ranges, own: *own, best: *best, cells })
        }
        _ => None,
    }
}

pub(in super::super::super) fn figure(picture: &SweepPicture) -> Figure {
    let mut figure = Figure::default();
    let Some(Parts { axes, ranges, own, best, cells }) = parts(&picture.plot) else { return figure };
    let mut head = heading(picture);
    if matches!(&picture.plot, SweepPlot::Map { shared: true, .. }) {
        head.subtitle.push_str("; a cell shows the worst of several points");
    }
    let is_inside = |at: [f64; 2]| [0, 1].iter().all(|&i| (ranges[i].low..=ranges[i].high).contains(&at[i]));
    if let Some((at, value)) = best {
        let text =
            format!("best: {} at ({}, {})", with_unit(picture, value), significant(at[0], 5), significant(at[1], 5));
        head.legend.push(ring_entry(BEST, text));
    }
    if let Some(at) = own {
        let beyond = if is_inside(at) { "" } else { ", outside" };
        head.legend.push(ring_entry(
            OWN,
            format!("the scenario ({}, {}){beyond}", significant(at[0], 5), significant(at[1], 5)),
        ));
    }
    head.legend.extend(missing_entries(cells.iter().copied()));
    let space = head.draw(&mut figure);

    let y = if axes[1].logarithmic {
        Axis::logarithmic_within(ranges[1], space.height(), 45.0)
    } else {
        y_axis(ranges[1], space.height(), false)
    };
    let gutter = gutter(&[&y]);
    let frame = Frame { left: space.left + gutter, right: space.right - ROOM_PX, ..space };
    let subplot = Subplot::new(frame, across(ranges[0], frame.width(), axes[0].logarithmic), y);
    let values = cells.iter().filter_map(|cell| if let SweepCell::Metric(value) = cell { Some(*value) } else { None });
    let scale = Scale::of(values, frame.height());

    match &picture.plot {
        SweepPlot::Map { edges, cells, .. } => draw_cells(&mut figure, &subplot, &scale, edges, cells),
        SweepPlot::Scatter { points, .. } => {
            subplot.grid(&mut figure);
            let radius = if points.len() > 1000 { 2.6 } else { 4.0 };
            for (point, cell) in points {
                let Some(colour) = colour(&scale, *cell) else { continue };
                let at = subplot.at(point[0], point[1]);
                // A thin dark rim keeps the light colours visible on white.
                figure.dot(at, radius, INK);
                figure.dot(at, radius - 0.5, colour);
            }
        }
        _ => {}
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, &axes[0].title, "");
    subplot.y_title(&mut figure, gutter, &axes[1].title, "");
    scale.draw(&mut figure, &frame, picture.metric, picture.unit);
    for (at, colour) in [(own.filter(|at| is_inside(*at)), OWN), (best.map(|(at, _)| at), BEST)] {
        if let Some(at) = at {
            marker(&mut figure, subplot.at(at[0], at[1]), colour);
        }
    }
    figure
}

fn colour(scale: &Scale, cell: SweepCell) -> Option<(u8, u8, u8)> {
    match cell {
        SweepCell::Empty => None,
        SweepCell::Metric(value) => Some(Scale::colour(scale.step(value))),
        SweepCell::LockedUp => Some(LOCKED),
        SweepCell::Missing => Some(MISSING),
    }
}

/// Cells row by row, neighbours of one colour together; each reaches under the next, so that no seam shows.
fn draw_cells(figure: &mut Figure, subplot: &Subplot, scale: &Scale, edges: &[Vec<f64>; 2], cells: &[SweepCell]) {
    let Some(width) = edges[0].len().checked_sub(1).filter(|width| *width > 0) else { return };
    for (row, bounds) in cells.chunks(width).zip(edges[1].windows(2)).rev() {
        let colours: Vec<_> = row.iter().map(|cell| colour(scale, *cell).unwrap_or(WHITE)).collect();
        let mut start = 0;
        for run in colours.chunk_by(|a, b| a == b) {
            let (from, to) = (edges[0].get(start), edges[0].get(start + run.len()));
            start += run.len();
            if let (Some(from), Some(to), Some(colour)) = (from, to, run.first()) {
                let ((left, top), (right, bottom)) = (subplot.at(*from, bounds[1]), subplot.at(*to, bounds[0]));
                let frame = Frame {
                    left,
                    top,
                    right: (right + 0.5).min(subplot.frame.right),
                    bottom: (bottom + 0.5).min(subplot.frame.bottom),
                };
                figure.rectangle(&frame, *colour);
            }
        }
    }
}
