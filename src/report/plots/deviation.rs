//! Deviation maps side by side, with one scale.

use super::super::axis::{Axis, Range, significant};
use super::super::curve::Frame;
use super::super::figure::Figure;
use super::super::font;
use super::super::marks::{Anchor, Image, TextFormat};
use super::super::part_data::{DeviationPicture, DeviationSubplot};
use super::super::style::{BORDER, Colour, INK, LineStyle, MUTED, WHITE};
use super::super::subplot::{Entry, Heading, LABEL_EM, Subplot, Symbol, TITLE_EM, gutter, x_axis, y_axis};
use super::sweep::colour::mixed;
use super::words::{capital, printable};

/// From nothing to the deepest gouge, and to the highest excess: lightness falls evenly on both sides, and orange and blue are
/// told apart by colour-blind readers.
const GOUGE: [Colour; 5] = [(247, 247, 245), (253, 208, 154), (245, 145, 55), (190, 80, 5), (110, 38, 2)];
const EXCESS: [Colour; 5] = [(247, 247, 245), (190, 216, 234), (110, 170, 212), (42, 110, 178), (8, 48, 107)];
const UNCUT: Colour = (128, 128, 128);

/// Steps of each side.
const STEPS: u8 = 48;
/// Squares of a picture along a side at most: the file stays small.
const MOST_SQUARES: usize = 560;
const BAR_PX: f64 = 18.0;
/// Room right of the maps for the bar, its numbers and its title.
const ROOM_PX: f64 = 180.0;
/// Room above a map for its title.
const TITLE_PX: f64 = 24.0;
/// Below the lowest subplot.
const FOOT_PX: f64 = 62.0;
const GAP_PX: f64 = 36.0;

/// Deviations to colours: linear from nothing to each end, each side for itself, and each has at least a quarter of the bar.
struct Scale {
    gouge_um: f64,
    excess_um: f64,
    /// Where nothing lies on the bar, 0 to 1 from below.
    zero: f64,
}

impl Scale {
    fn of(picture: &DeviationPicture<'_>) -> Self {
        let values = picture.maps.iter().take(2).flat_map(|map| map.values_um).map(|value| f64::from(*value));
        let mut range = Range::of(values);
        range.include(0.0);
        let limit = |limit: Option<f64>| limit.filter(|limit| *limit > 0.0 && *limit <= 1e12);
        // A limit far beyond what is there would leave the map blank.
        let fits = |limit: f64, reached: f64| limit <= 4.0 * reached;
        let end = |reached: f64, allowed: Option<f64>| match limit(allowed) {
            Some(limit) if fits(limit, reached) => reached.max(1.05 * limit),
            _ => reached,
        };
        let (gouge, excess) = (end(-range.low, picture.gouge_limit_um), end(range.high, picture.excess_limit_um));
        let least = (1e-3 * gouge.max(excess)).max(1e-6);
        let (gouge_um, excess_um) = (gouge.max(least), excess.max(least));
        let zero = (gouge_um / (gouge_um + excess_um)).max(0.25).min(0.75);
        Self { gouge_um, excess_um, zero }
    }

    fn colour(&self, value: f64) -> Colour {
        let (side, share) =
            if value < 0.0 { (&GOUGE, -value / self.gouge_um) } else { (&EXCESS, value / self.excess_um) };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to the number of steps
        let step = ((share.max(0.0).min(1.0) * f64::from(STEPS)) as u8).min(STEPS - 1);
        mixed(side, f64::from(step) / f64::from(STEPS - 1))
    }

    /// Where a deviation lies on the bar, from below.
    fn place(&self, value: f64) -> f64 {
        if value < 0.0 {
            self.zero * (1.0 + (value / self.gouge_um).max(-1.0))
        } else {
            self.zero + (1.0 - self.zero) * (value / self.excess_um).min(1.0)
        }
    }

    /// The bar, right of the maps.
    fn draw(&self, figure: &mut Figure, beside: &Frame, picture: &DeviationPicture<'_>) {
        let left = beside.right + 26.0;
        let frame = Frame { left, right: left + BAR_PX, ..*beside };
        let at = |value: f64| frame.bottom - self.place(value) * frame.height();
        for step in 0..STEPS {
            let ends = [step, step + 1].map(|step| f64::from(step) / f64::from(STEPS));
            let middle = 0.5 * (ends[0] + ends[1]);
            for (end, sign) in [(self.gouge_um, -1.0), (self.excess_um, 1.0)] {
                let (a, b) = (at(sign * end * ends[0]), at(sign * end * ends[1]));
                let part = Frame { top: a.min(b), bottom: (a.max(b) + 0.6).min(frame.bottom), ..frame };
                figure.rectangle(&part, self.colour(sign * end * middle));
            }
        }
        let Frame { left, right, top, bottom } = frame;
        let line_style = LineStyle::solid(BORDER, 1.0);
        figure.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], line_style);
        let mut taken: Vec<Frame> = Vec::new();
        let mut label = |figure: &mut Figure, y: f64, text: &str, colour: Colour| {
            let text = TextFormat::new((right + 9.0, y), text, LABEL_EM, Anchor::Left).coloured(colour);
            let free = !taken.iter().any(|other| other.overlaps(&text.frame()));
            if free {
                taken.push(text.frame());
                figure.text(text);
            }
            free
        };
        // The limits first: numbers give way to them.
        let limits =
            [(picture.gouge_limit_um.map(|limit| -limit), self.gouge_um), (picture.excess_limit_um, self.excess_um)];
        for (limit, end) in limits {
            if let Some(limit) = limit.filter(|limit| *limit != 0.0 && limit.abs() <= end) {
                let y = at(limit);
                figure.line(&[(left - 5.0, y), (right + 6.0, y)], LineStyle::solid(INK, 2.0));
                label(figure, y, &font::fitted(&format!("limit {}", significant(limit, 4)), LABEL_EM, 100.0), INK);
            }
        }
        let sides = [Range { low: 0.0, high: self.excess_um }, Range { low: -self.gouge_um, high: 0.0 }];
        for (range, share) in sides.into_iter().zip([1.0 - self.zero, self.zero]) {
            let axis = Axis::linear(range, share * frame.height(), 34.0, false);
            for tick in axis.ticks {
                let y = at(tick.value);
                if label(figure, y, &significant(tick.value, 4), INK) {
                    figure.line(&[(right, y), (right + 4.0, y)], line_style);
                }
            }
        }
        if self.gouge_um.max(self.excess_um) > 1.05 * self.gouge_um.min(self.excess_um) {
            // A gouge of 10 µm beside a scallop of 250 µm would not be seen on one scale; but the reader must know.
            let zero = at(0.0);
            figure.line(&[(left - 5.0, zero), (right + 4.0, zero)], LineStyle::solid(INK, 1.2));
            // Below the numbers of the map beside it.
            for (line, text) in [(33.0, "Each half has its"), (49.0, "own scale.")] {
                let text = TextFormat::new((left - 4.0, bottom + line), text, LABEL_EM, Anchor::Left);
                figure.text(text.coloured(MUTED));
            }
        }
        let at = (beside.right + ROOM_PX - 16.0, 0.5 * (top + bottom));
        let title = TextFormat::new(at, "deviation [µm]: gouge −, excess +", 14.0, Anchor::Middle);
        figure.text(TextFormat { upwards: true, ..title });
    }
}

/// A map with rows counted, its extremes found.
struct Map<'a> {
    subplot: &'a DeviationSubplot<'a>,
    rows: usize,
    largest: Option<(f64, [f64; 2])>,
    least: Option<(f64, [f64; 2])>,
    uncut: bool,
}

impl<'a> Map<'a> {
    fn of(subplot: &'a DeviationSubplot<'a>) -> Option<Self> {
        let rows = subplot.values_um.len() / subplot.columns.max(1);
        let sound = subplot.cell_mm > 0.0 && subplot.cell_mm <= 1e6 && subplot.low_mm.iter().all(|c| c.abs() <= 1e9);
        if !sound || subplot.columns == 0 || rows == 0 {
            return None;
        }
        let mut map = Self { subplot, rows, largest: None, least: None, uncut: false };
        for (index, value) in subplot.values_um.iter().take(rows * subplot.columns).enumerate() {
            map.uncut |= *value == f32::INFINITY;
            if !value.is_finite() {
                continue;
            }
            let value = f64::from(*value);
            let at = || {
                let place = [index % subplot.columns, index / subplot.columns];
                [0, 1].map(|i| subplot.low_mm[i] + (place[i] as f64 + 0.5) * subplot.cell_mm)
            };
            if map.largest.is_none_or(|(other, _)| value > other) {
                map.largest = Some((value, at()));
            }
            if map.least.is_none_or(|(other, _)| value < other) {
                map.least = Some((value, at()));
            }
        }
        Some(map)
    }

    /// The largest excess, and where it is.
    fn excess(&self) -> Option<(f64, [f64; 2])> {
        self.largest.filter(|(value, _)| *value > 0.0)
    }

    /// The deepest gouge, and where it is.
    fn gouge(&self) -> Option<(f64, [f64; 2])> {
        self.least.filter(|(value, _)| *value < 0.0)
    }

    fn side(&self, cells: usize) -> f64 {
        cells as f64 * self.subplot.cell_mm
    }

    fn ranges(&self) -> [Range; 2] {
        let [x, y] = self.subplot.low_mm;
        [Range { low: x, high: x + self.side(self.subplot.columns) }, Range { low: y, high: y + self.side(self.rows) }]
    }

    /// The map's picture: the worst of each block of cells.
    fn image(&self, scale: &Scale, frame: Frame) -> Image {
        let (width, height) = (self.subplot.columns, self.rows);
        let block = width.max(height).div_ceil(MOST_SQUARES).max(1);
        let (columns, rows) = (width.div_ceil(block), height.div_ceil(block));
        let mut worst = vec![f32::NAN; columns * rows];
        for (row, values) in self.subplot.values_um.chunks(width).take(height).enumerate() {
            for (column, value) in values.iter().enumerate() {
                let square = (rows - 1 - row / block) * columns + column / block;
                if let Some(worst) = worst.get_mut(square)
                    && !value.is_nan()
                    && (worst.is_nan() || value.abs() > worst.abs())
                {
                    *worst = *value;
                }
            }
        }
        let colours = worst.into_iter().map(|value| match value {
            value if value.is_nan() => WHITE,
            value if value.is_infinite() => UNCUT,
            value => scale.colour(f64::from(value)),
        });
        // Blocks that reach beyond the last cells would shift the picture: the frame grows with them.
        let grown = |cells: usize, squares: usize| (squares * block) as f64 / cells as f64;
        let frame = Frame {
            right: frame.left + frame.width() * grown(width, columns),
            bottom: frame.bottom,
            top: frame.bottom - frame.height() * grown(height, rows),
            ..frame
        };
        Image { frame, columns, colours: colours.collect() }
    }
}

/// An axis without the numbers that would touch the one before: on a part that is long and thin there is room for one or two.
fn apart(mut axis: Axis, length_px: f64, across: bool) -> Axis {
    let mut end = f64::NEG_INFINITY;
    let places: Vec<f64> = axis.ticks.iter().map(|tick| axis.share(tick.value) * length_px).collect();
    let mut places = places.into_iter();
    axis.ticks.retain(|tick| {
        let half = 0.5 * if across { font::width_px(&tick.label, LABEL_EM) } else { LABEL_EM };
        let place = places.next().unwrap_or_default();
        let free = place - half > end;
        if free {
            end = place + half + 4.0;
        }
        free
    });
    axis
}

pub(in super::super) fn figure(picture: &DeviationPicture<'_>) -> Figure {
    let mut figure = Figure::default();
    let maps: Vec<Map<'_>> = picture.maps.iter().take(2).filter_map(Map::of).collect();
    let scale = Scale::of(picture);
    let mut head = Heading {
        title: format!(
            "{}: deviation from the design surface",
            font::shortened(&printable(picture.name), TITLE_EM, 620.0)
        ),
        subtitle: capital(&printable(picture.caption)),
        ..Heading::default()
    };
    if maps.is_empty() {
        head.warnings.push("Nothing to show: no map has a cell".to_owned());
    }
    let ring = |colour, text: &str| Entry { symbol: Symbol::Ring(colour), text: text.to_owned() };
    if maps.iter().any(|map| map.excess().is_some()) {
        head.legend.push(ring(EXCESS[4], "largest excess"));
    }
    if maps.iter().any(|map| map.gouge().is_some()) {
        head.legend.push(ring(GOUGE[3], "deepest gouge"));
    }
    for (limit, end, what) in [
        (picture.gouge_limit_um, scale.gouge_um, "limit of the gouge"),
        (picture.excess_limit_um, scale.excess_um, "limit of the excess"),
    ] {
        if let Some(limit) = limit.filter(|limit| *limit > end) {
            head.legend.push(Entry::line(
                LineStyle::solid(INK, 2.0),
                format!("{what} {} µm (off scale)", significant(limit, 4)),
            ));
        }
    }
    if maps.iter().any(|map| map.uncut) {
        head.legend.push(Entry { symbol: Symbol::Area(UNCUT), text: "uncut".to_owned() });
    }
    let space = head.draw(&mut figure);
    let maps_frame = Frame { top: space.top + TITLE_PX, right: space.right - ROOM_PX, ..space };
    let count = maps.len().max(1) as f64;
    let all = |i: usize| {
        let ranges = maps.iter().map(|map| map.ranges()[i]);
        ranges.fold(Range::EMPTY, |all, range| Range { low: all.low.min(range.low), high: all.high.max(range.high) })
    };
    let (x, y) = if maps.is_empty() { (Range::EMPTY.opened(1.0), Range::EMPTY.opened(1.0)) } else { (all(0), all(1)) };
    // Equal scale of both axes, in frames just as large as the maps.
    let mut y_numbers = y_axis(y, maps_frame.height(), false);
    let gutter = gutter(&[&y_numbers]);
    // Neighbouring numbers below the maps keep apart.
    let x_numbers = x_axis(x, 0.5 * maps_frame.width(), false);
    let widest = x_numbers.ticks.iter().map(|tick| font::width_px(&tick.label, LABEL_EM)).fold(0.0, f64::max);
    let gap = GAP_PX.max(widest + 20.0);
    let room = (maps_frame.width() - gutter - (count - 1.0) * gap) / count;
    let px_per_mm = (room / x.span()).min(maps_frame.height() / y.span());
    // However long and thin a part is, there is a subplot.
    let (width, height) = ((px_per_mm * x.span()).max(40.0), (px_per_mm * y.span()).max(40.0));
    y_numbers = if height < 0.8 * maps_frame.height() { y_axis(y, height, false) } else { y_numbers };
    y_numbers = apart(y_numbers, height, false);
    let mut last = Frame { left: maps_frame.left + gutter, top: maps_frame.top, right: maps_frame.left, bottom: 0.0 };
    for (i, map) in maps.iter().enumerate() {
        let left = maps_frame.left + gutter + i as f64 * (width + gap);
        let frame = Frame { left, top: maps_frame.top, right: left + width, bottom: maps_frame.top + height };
        last = frame;
        let mut subplot = Subplot::filled(frame, apart(x_axis(x, width, false), width, true), y_numbers.clone());
        let [own_x, own_y] = map.ranges();
        let ((left, bottom), (right, top)) = (subplot.at(own_x.low, own_y.low), subplot.at(own_x.high, own_y.high));
        figure.image(map.image(&scale, Frame { left, top, right, bottom }));
        subplot.border(&mut figure, true, i == 0);
        subplot.x_title(&mut figure, "x", "mm");
        if i == 0 {
            subplot.y_title(&mut figure, gutter, "y", "mm");
        }
        // Up to the next map, or the bar.
        let slot = if i + 1 < maps.len() { width + gap - 10.0 } else { maps_frame.right - left };
        let caption = font::fitted(&printable(map.subplot.caption), LABEL_EM, slot);
        if height + 90.0 < maps_frame.height() + FOOT_PX {
            figure.text(
                TextFormat::new((frame.left, frame.bottom + 66.0), caption, LABEL_EM, Anchor::Left).coloured(MUTED),
            );
        }
        let title = font::fitted(&printable(map.subplot.title), 15.0, slot);
        figure.text(TextFormat::new((frame.left, frame.top - 14.0), title, 15.0, Anchor::Left));
        let signed = |value: f64| format!("{}{} µm", if value > 0.0 { "+" } else { "" }, significant(value, 4));
        let marks = [(map.excess(), EXCESS[4]), (map.gouge(), GOUGE[3])];
        let marks = marks.map(|(found, colour)| found.map(|(value, [x, y])| (subplot.at(x, y), signed(value), colour)));
        for (at, _, colour) in marks.iter().flatten() {
            figure.dot(*at, 7.0, WHITE);
            figure.ring(*at, 6.0, 2.2, *colour);
            // No label hides a mark.
            let corners = [(-8.0, -8.0), (8.0, 8.0), (-8.0, 8.0), (8.0, -8.0)];
            subplot.keep_clear(corners.iter().map(|(dx, dy)| (at.0 + dx, at.1 + dy)).collect());
        }
        for (at, text, colour) in marks.into_iter().flatten() {
            subplot.point_label(&mut figure, at, &text, colour);
        }
    }
    if !maps.is_empty() {
        scale.draw(&mut figure, &Frame { bottom: last.bottom.max(last.top + 220.0), ..last }, picture);
    }
    figure
}
