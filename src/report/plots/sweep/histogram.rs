//! How often the metric takes which value.

use super::super::super::axis::{Axis, Range, told_apart};
use super::super::super::curve::{Dash, Frame};
use super::super::super::figure::Figure;
use super::super::super::style::{INK, LineStyle, RUN_COLOURS, WHITE};
use super::super::super::subplot::{Entry, Subplot, gutter, stack, x_axis, y_axis};
use super::shared::heading;
use crate::sweep::{SweepPicture, SweepPlot};

/// From this ratio of the 99th percentile to the smallest value on the axis is logarithmic.
const WIDE: f64 = 50.0;
/// Values beyond this multiple of the 99th percentile are told of, not drawn.
const BEYOND: f64 = 3.0;

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bins are few
pub(in super::super::super) fn figure(picture: &SweepPicture) -> Figure {
    let mut figure = Figure::default();
    let SweepPlot::Histogram { values, percentiles } = &picture.plot else { return figure };
    let mut head = heading(picture);
    let rare = percentiles.last().map_or(f64::INFINITY, |(_, value)| *value);
    let smallest = values.first().copied().unwrap_or(0.0);
    let logarithmic = smallest > 0.0 && rare > WIDE * smallest;
    let is_shown = |value: f64| value <= BEYOND * rare || logarithmic;
    let range = Range::of(values.iter().copied().filter(|value| is_shown(*value)));
    let beyond = values.iter().filter(|value| !is_shown(**value)).count();
    let line_styles = [[4.0, 3.0], [30.0, 0.1], [9.0, 4.0], [2.0, 2.0]]
        .map(|[on, off]| LineStyle { dash: (off > 1.0).then_some(Dash::new(on, off)), ..LineStyle::solid(INK, 1.5) });
    // Percentiles that lie close together are written with the digits that tell them apart.
    let all: Vec<f64> = percentiles.iter().map(|(_, value)| *value).chain(values.last().copied()).collect();
    let mut texts =
        told_apart(&all, 4).into_iter().map(|text| format!("{text} {}", picture.unit).trim_end().to_owned());
    for ((percent, _), line_style) in percentiles.iter().zip(line_styles) {
        let text = texts.next().unwrap_or_default();
        head.legend.push(Entry::line(line_style, format!("{percent} %: {text}")));
    }
    if let Some(largest) = texts.next_back() {
        let beyond = if beyond > 0 { format!(" ({beyond} beyond the right end)") } else { String::new() };
        head.subtitle = format!("{}; largest {largest}{beyond}", head.subtitle);
    }
    let space = head.draw(&mut figure);
    if range.is_empty() {
        return figure;
    }

    // Scott's rule would follow the spread; a fixed number in view is easier to compare.
    let bins = ((values.len() as f64).sqrt() as usize).clamp(8, 80);
    let axis = |width: f64| {
        if logarithmic {
            Axis::logarithmic_within(range, width, 90.0)
        } else {
            x_axis(range.opened(1e-9), width, false)
        }
    };
    let x = axis(space.width());
    let mut counts = vec![0_u64; bins];
    for value in values.iter().filter(|value| is_shown(**value)) {
        let bin = ((x.share(*value) * bins as f64).max(0.0) as usize).min(bins - 1);
        if let Some(count) = counts.get_mut(bin) {
            *count += 1;
        }
    }
    let most = counts.iter().copied().max().unwrap_or(0) as f64;
    let y = y_axis(Range { low: 0.0, high: 1.06 * most.max(1.0) }, space.height(), true);
    let gutter = gutter(&[&y]);
    let Some(frame) = stack(&space, &[&y], 0.0).pop() else { return figure };
    let subplot = Subplot::new(frame, axis(frame.width()), y);
    subplot.grid(&mut figure);
    let width = frame.width() / bins as f64;
    for (bin, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let left = frame.left + bin as f64 * width;
        let top = subplot.at(0.0, *count as f64).1;
        let bar = Frame { left, top, right: left + width, bottom: frame.bottom };
        figure.rectangle(&bar, WHITE);
        figure.rectangle(&Frame { left: left + 0.5, right: left + width - 0.5, ..bar }, RUN_COLOURS[0]);
    }
    for ((_, value), line_style) in percentiles.iter().zip(line_styles) {
        let x = subplot.at(*value, 0.0).0;
        if (frame.left..=frame.right).contains(&x) {
            figure.line(&[(x, frame.top), (x, frame.bottom)], line_style);
        }
    }
    subplot.border(&mut figure, true, true);
    subplot.x_title(&mut figure, picture.metric, picture.unit);
    subplot.y_title(&mut figure, gutter, "points", "");
    figure
}
