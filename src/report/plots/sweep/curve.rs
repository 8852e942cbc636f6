//! The figure over one variable.

use super::super::super::axis::{Axis, Range, figure};
use super::super::super::panel::{Entry, Panel, gutter, stack, y_axis};
use super::super::super::sheet::{CURVE_PX, MUTED, Pen, RUN_COLOURS, Sheet};
use super::super::super::sweep::{SweepCell, SweepPicture, SweepPlot};
use super::{BEST, LOCKED, MISSING, across, heading, marker, missing_entries, ring_entry, with_unit};
use crate::report::curve::Dash;

/// From this ratio of largest to smallest on the figure is drawn on a logarithmic axis.
const WIDE: f64 = 50.0;

pub(super) fn sheet(picture: &SweepPicture) -> Sheet {
    let mut sheet = Sheet::default();
    let SweepPlot::Curve { axis, points, own, best } = &picture.plot else { return sheet };
    let pen = Pen::solid(RUN_COLOURS[0], CURVE_PX);
    let own_pen = Pen { dash: Some(Dash::new(6.0, 4.0)), ..Pen::solid(MUTED, 1.3) };
    let mut x_range = Range::of(points.iter().map(|(x, _)| *x));
    if !axis.logarithmic {
        x_range = x_range.opened(1e-300).padded(0.02, 0.02);
    }
    let mut head = heading(picture);
    head.legend.push(Entry::line(pen, picture.figure));
    if let Some((x, value)) = best {
        head.legend.push(ring_entry(BEST, format!("best: {} at {}", with_unit(picture, *value), figure(*x, 5))));
    }
    if let Some(own) = own {
        let beyond = if (x_range.low..=x_range.high).contains(own) { "" } else { ", outside" };
        head.legend.push(Entry::line(own_pen, format!("the scenario ({}){beyond}", figure(*own, 5))));
    }
    head.legend.extend(missing_entries(points.iter().map(|(_, cell)| *cell)));
    let space = head.draw(&mut sheet);

    let value = |cell: &SweepCell| if let SweepCell::Figure(value) = cell { Some(*value) } else { None };
    let range = Range::of(points.iter().filter_map(|(_, cell)| value(cell)));
    let y = if range.low > 0.0 && range.high > WIDE * range.low {
        Axis::logarithmic_within(range, space.height(), 45.0)
    } else {
        y_axis(range.opened(1e-9).padded(0.08, 0.1), space.height(), false)
    };
    let gutter = gutter(&[&y]);
    let Some(frame) = stack(&space, &[&y], 0.0).pop() else { return sheet };
    let mut panel = Panel::new(frame, across(x_range, frame.width(), axis.logarithmic), y);
    panel.grid(&mut sheet);
    if let Some(own) = own.filter(|own| (x_range.low..=x_range.high).contains(own)) {
        let x = panel.at(own, 0.0).0;
        sheet.line(&[(x, frame.top), (x, frame.bottom)], own_pen);
    }
    // A point without a figure breaks the curve, and is marked at the foot.
    for piece in points.chunk_by(|a, b| value(&a.1).is_some() == value(&b.1).is_some()) {
        let curve: Vec<(f64, f64)> = piece.iter().filter_map(|(x, cell)| Some((*x, value(cell)?))).collect();
        if !curve.is_empty() {
            panel.curve(&mut sheet, curve.iter().copied(), pen);
            if points.len() <= 120 {
                for (x, y) in &curve {
                    sheet.dot(panel.at(*x, *y), 2.6, pen.colour);
                }
            }
        }
        for (x, cell) in piece.iter().filter(|(_, cell)| value(cell).is_none()) {
            let colour = if *cell == SweepCell::LockedUp { LOCKED } else { MISSING };
            let x = panel.at(*x, 0.0).0;
            sheet.line(&[(x, frame.bottom - 12.0), (x, frame.bottom - 1.0)], Pen::solid(colour, 4.0));
        }
    }
    panel.border(&mut sheet, true, true);
    panel.x_title(&mut sheet, &axis.title, "");
    panel.y_title(&mut sheet, gutter, picture.figure, picture.unit);
    if let Some((x, value)) = best {
        marker(&mut sheet, panel.at(*x, *value), BEST);
    }
    sheet
}
