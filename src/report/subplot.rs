//! Subplots: a frame with two axes, grid, curves and labels that keep out of each other's way; and the heading above them.

use super::axis::{Axis, Range};
use super::curve::{Frame, Px, length, thinned};
use super::envelope::{Stretch, stretches};
use super::figure::{Figure, HEIGHT_PX, WIDTH_PX};
use super::font;
use super::marks::{Anchor, TextFormat};
use super::style::{BORDER, Colour, GRID, INK, LineStyle, MUTED, SHADE, VERMILLION, WHITE};

pub(super) const TITLE_EM: f64 = 20.0;
const SUBTITLE_EM: f64 = 14.0;
pub(super) const LEGEND_EM: f64 = 13.5;
const AXIS_EM: f64 = 14.0;
const TICK_EM: f64 = 12.5;
/// Size of labels inside a subplot.
pub(super) const LABEL_EM: f64 = 12.5;

/// White border of the figure \[px\].
const MARGIN: f64 = 26.0;
/// From the bottom of the lowest subplot to that of the figure \[px\].
const FOOT: f64 = 62.0;
/// Widest legend entry \[px\].
const LEGEND_ENTRY: f64 = 520.0;
/// Legend rows; what finds no place in them is counted.
const LEGEND_ROWS: usize = 4;

/// Ticks about so far apart \[px\].
const X_TICK: f64 = 95.0;

/// How much worse it is to hide a pixel of a curve than to be one place farther down in the order of places.
const HIDING: f64 = 20.0;
/// A label farther from its point than this has a line to it \[px\].
const LEADER_PX: f64 = 26.0;

/// Where the line begins, from the middle of the point's mark; and where it is clear of the marks of points beside it \[px\].
const LEADER_FROM_PX: f64 = 6.0;
const LEADER_CLEAR_PX: f64 = 10.0;

/// What stands before a legend entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Symbol {
    Line(LineStyle),
    Ring(Colour),
    Area(Colour),
}

/// One entry of the legend.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) symbol: Symbol,
    pub(super) text: String,
}

impl Entry {
    pub(super) fn line(line_style: LineStyle, text: impl Into<String>) -> Self {
        Self { symbol: Symbol::Line(line_style), text: text.into() }
    }
}

/// Title, lines below it, warnings and legend, at the top of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Heading {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) warnings: Vec<String>,
    pub(super) legend: Vec<Entry>,
}

impl Heading {
    /// Draws the heading; returns the space that is left for subplots.
    pub(super) fn draw(&self, figure: &mut Figure) -> Frame {
        let room = WIDTH_PX - 2.0 * MARGIN;
        let mut y = 30.0;
        let line = |y: f64, text: &str, em: f64, colour| {
            TextFormat::new((MARGIN, y), font::fitted(text, em, room), em, Anchor::Left).coloured(colour)
        };
        figure.text(line(y, &self.title, TITLE_EM, INK));
        if !self.subtitle.is_empty() {
            y += 26.0;
            figure.text(line(y, &self.subtitle, SUBTITLE_EM, MUTED));
        }
        for warning in self.warnings.iter().take(3) {
            y += 22.0;
            figure.text(line(y, warning, SUBTITLE_EM, VERMILLION));
        }
        y = self.draw_legend(figure, y);
        Frame { left: MARGIN, top: y + 20.0, right: WIDTH_PX - MARGIN, bottom: HEIGHT_PX - FOOT }
    }

    fn draw_legend(&self, figure: &mut Figure, above: f64) -> f64 {
        const SYMBOL: f64 = 30.0;
        const GAP: f64 = 26.0;
        let (mut x, mut y) = (MARGIN, above + 26.0);
        let mut row = 1;
        for (i, entry) in self.legend.iter().enumerate() {
            let text = font::fitted(&entry.text, LEGEND_EM, LEGEND_ENTRY);
            let width = SYMBOL + 7.0 + font::width_px(&text, LEGEND_EM) + GAP;
            // The last row keeps room for the note that entries are missing.
            let more = format!("and {} more", self.legend.len() - i);
            let kept = if row == LEGEND_ROWS { font::width_px(&more, LEGEND_EM) } else { 0.0 };
            if x + width + kept > WIDTH_PX - MARGIN + if kept > 0.0 { 0.0 } else { GAP } && x > MARGIN {
                if row == LEGEND_ROWS {
                    figure.text(TextFormat::new((x, y), more, LEGEND_EM, Anchor::Left).coloured(MUTED));
                    break;
                }
                row += 1;
                (x, y) = (MARGIN, y + 22.0);
            }
            match entry.symbol {
                Symbol::Line(line_style) => {
                    figure.line(
                        &[(x, y), (x + SYMBOL, y)],
                        LineStyle { width_px: line_style.width_px.max(1.8), ..line_style },
                    );
                }
                Symbol::Ring(colour) => figure.ring((x + 0.5 * SYMBOL, y), 5.0, 1.6, colour),
                Symbol::Area(colour) => {
                    let frame = Frame { left: x + 6.0, top: y - 7.0, right: x + SYMBOL - 6.0, bottom: y + 7.0 };
                    figure.rectangle(&frame, BORDER);
                    let inside = Frame {
                        left: frame.left + 1.0,
                        top: frame.top + 1.0,
                        right: frame.right - 1.0,
                        bottom: frame.bottom - 1.0,
                    };
                    figure.rectangle(&inside, colour);
                }
            }
            figure.text(TextFormat::new((x + SYMBOL + 7.0, y), text, LEGEND_EM, Anchor::Left));
            x += width;
        }
        if self.legend.is_empty() { above } else { y }
    }
}

/// An axis along the bottom of a subplot.
pub(super) fn x_axis(range: Range, width_px: f64, whole: bool) -> Axis {
    Axis::linear(range, width_px, X_TICK, whole)
}

/// An axis along the side of a subplot.
pub(super) fn y_axis(range: Range, height_px: f64, whole: bool) -> Axis {
    // Denser where the subplot is low.
    Axis::linear(range, height_px, 30.0 + 0.036 * height_px, whole)
}

/// Frames one below the other in `space`, all as wide as the widest tick labels leave them; axis titles go to their left.
pub(super) fn stack(space: &Frame, y_axes: &[&Axis], gap: f64) -> Vec<Frame> {
    let left = space.left + gutter(y_axes);
    let height = subplot_height(space, y_axes.len(), gap);
    (0..y_axes.len())
        .map(|i| {
            let top = space.top + i as f64 * (height + gap);
            Frame { left, top, right: space.right - 8.0, bottom: top + height }
        })
        .collect()
}

/// Height of each of `count` subplots one below the other.
pub(super) fn subplot_height(space: &Frame, count: usize, gap: f64) -> f64 {
    let count = count.max(1) as f64;
    (space.height() - (count - 1.0) * gap) / count
}

/// Room to the left of a subplot for tick labels and axis title \[px\].
pub(super) fn gutter(y_axes: &[&Axis]) -> f64 {
    let labels = y_axes.iter().flat_map(|axis| &axis.ticks).map(|tick| font::width_px(&tick.label, TICK_EM));
    labels.fold(0.0, f64::max) + 8.0 + 14.0 + AXIS_EM
}

/// A frame with two axes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Subplot {
    pub(super) frame: Frame,
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// Curves and lines drawn: labels keep away from them.
    busy: Vec<Vec<Px>>,
    /// Labels drawn.
    taken: Vec<Frame>,
    /// Labels stand on white whatever is below them.
    plates: bool,
}

impl Subplot {
    pub(super) fn new(frame: Frame, x: Axis, y: Axis) -> Self {
        Self { frame, x, y, busy: Vec::new(), taken: Vec::new(), plates: false }
    }

    /// A subplot filled with colour: labels stand on white.
    pub(super) fn filled(frame: Frame, x: Axis, y: Axis) -> Self {
        Self { plates: true, ..Self::new(frame, x, y) }
    }

    /// Where a point of the axes lies on the figure.
    pub(super) fn at(&self, x: f64, y: f64) -> Px {
        let Frame { left, right, top, bottom } = self.frame;
        // Far outside is far enough: the rest is clipped away.
        let share = |axis: &Axis, value| axis.share(value).clamp(-1e6, 1e6);
        (left + share(&self.x, x) * (right - left), bottom - share(&self.y, y) * (bottom - top))
    }

    /// Grid lines, to be drawn first.
    pub(super) fn grid(&self, figure: &mut Figure) {
        let Frame { left, right, top, bottom } = self.frame;
        for tick in &self.x.ticks {
            let x = self.at(tick.value, 0.0).0;
            figure.line(&[(x, top), (x, bottom)], LineStyle::solid(GRID, 1.0));
        }
        for tick in &self.y.ticks {
            let y = self.at(0.0, tick.value).1;
            figure.line(&[(left, y), (right, y)], LineStyle::solid(GRID, 1.0));
        }
    }

    /// Border, ticks and their labels, to be drawn last.
    pub(super) fn border(&self, figure: &mut Figure, x_labels: bool, y_labels: bool) {
        let Frame { left, right, top, bottom } = self.frame;
        let line_style = LineStyle::solid(BORDER, 1.0);
        figure.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], line_style);
        for tick in &self.x.ticks {
            let x = self.at(tick.value, 0.0).0;
            figure.line(&[(x, bottom), (x, bottom + 4.0)], line_style);
            if x_labels {
                figure.text(TextFormat::new((x, bottom + 16.0), tick.label.as_str(), TICK_EM, Anchor::Middle));
            }
        }
        for tick in self.y.ticks.iter().filter(|_| y_labels) {
            let y = self.at(0.0, tick.value).1;
            figure.line(&[(left - 4.0, y), (left, y)], line_style);
            figure.text(TextFormat::new((left - 8.0, y), tick.label.as_str(), TICK_EM, Anchor::Right));
        }
    }

    /// Title below the axis.
    pub(super) fn x_title(&self, figure: &mut Figure, quantity: &str, unit: &str) {
        let at = (0.5 * (self.frame.left + self.frame.right), self.frame.bottom + 40.0);
        figure.text(TextFormat::new(at, self.x.title(quantity, unit), AXIS_EM, Anchor::Middle));
    }

    /// Title beside the axis, `gutter_px` left of the frame.
    pub(super) fn y_title(&self, figure: &mut Figure, gutter_px: f64, quantity: &str, unit: &str) {
        let title = self.y.title(quantity, unit);
        // A low subplot has room for smaller letters only.
        let wide = font::width_px(&title, AXIS_EM);
        let em = AXIS_EM * (self.frame.height() / wide).min(1.0);
        let at = (self.frame.left - gutter_px + 0.5 * AXIS_EM, 0.5 * (self.frame.top + self.frame.bottom));
        figure.text(TextFormat { upwards: true, ..TextFormat::new(at, title, em, Anchor::Middle) });
    }

    /// A curve through values; a single one becomes a dot.
    pub(super) fn curve(
        &mut self,
        figure: &mut Figure,
        values: impl IntoIterator<Item = (f64, f64)>,
        line_style: LineStyle,
    ) {
        let points: Vec<Px> = values.into_iter().map(|(x, y)| self.at(x, y)).collect();
        self.px_curve(figure, &points, line_style);
    }

    fn px_curve(&mut self, figure: &mut Figure, points: &[Px], line_style: LineStyle) {
        if let [at] = points {
            if self.holds(*at) {
                figure.dot(*at, 3.0, line_style.colour);
            }
            return;
        }
        let points = thinned(points);
        for piece in self.frame.clipped(&points) {
            figure.line(&piece, line_style);
        }
        self.keep_clear(points);
    }

    /// Curves over time, laid over each other: where one swings so often that its line would be a solid bar, its envelope is drawn, pale
    /// between two borders.
    pub(super) fn time_curves<V: IntoIterator<Item = (f64, f64)>>(
        &mut self,
        figure: &mut Figure,
        curves: impl IntoIterator<Item = (V, LineStyle)>,
    ) {
        let mut lines: Vec<(Vec<Px>, LineStyle)> = Vec::new();
        for (values, line_style) in curves {
            let points: Vec<Px> = values.into_iter().map(|(x, y)| self.at(x, y)).collect();
            for stretch in stretches(&points) {
                match stretch {
                    Stretch::Line(points) => lines.push((points, line_style)),
                    Stretch::Band { upper, lower } => {
                        let Frame { left, top, right, bottom } = self.frame;
                        let inside = |(x, y): Px| (x.clamp(left, right), y.clamp(top, bottom));
                        let outline = upper.iter().copied().chain(lower.iter().rev().copied()).map(inside);
                        figure.area(outline.collect(), line_style.colour_of_band());
                        let border = LineStyle { width_px: 1.0, dash: None, ..line_style };
                        lines.extend([(upper, border), (lower, border)]);
                    }
                }
            }
        }
        for (points, line_style) in lines {
            self.px_curve(figure, &points, line_style);
        }
    }

    /// A ring at a point, which labels keep away from.
    pub(super) fn ring(&mut self, figure: &mut Figure, at: Px, radius_px: f64, width_px: f64, colour: Colour) {
        figure.ring(at, radius_px, width_px, colour);
        let ((x, y), r) = (at, radius_px + 1.0);
        self.taken.push(Frame { left: x - r, top: y - r, right: x + r, bottom: y + r });
    }

    /// A triangle on the edge of the frame that points to a place beyond it, and what is told of it. Nothing where the place is inside.
    pub(super) fn beyond(&mut self, figure: &mut Figure, place: Px, text: &str, colour: Colour) {
        if self.holds(place) {
            return;
        }
        let Frame { left, top, right, bottom } = self.frame;
        let (x, y) = (place.0.clamp(left + 6.0, right - 6.0), place.1.clamp(top + 6.0, bottom - 6.0));
        let (dx, dy) = if place.1 < top {
            (0.0, -1.0)
        } else if place.1 > bottom {
            (0.0, 1.0)
        } else if place.0 < left {
            (-1.0, 0.0)
        } else {
            (1.0, 0.0)
        };
        let (tip_x, tip_y) = (x + 5.0 * dx, y + 5.0 * dy);
        let corner = |side: f64| (x - 5.0 * dx + 5.0 * side * dy, y - 5.0 * dy + 5.0 * side * dx);
        figure.area(vec![(tip_x, tip_y), corner(1.0), corner(-1.0)], colour);
        self.taken.push(Frame { left: x - 6.0, top: y - 6.0, right: x + 6.0, bottom: y + 6.0 });
        self.point_label(figure, (x, y), text, colour);
    }

    /// A curve that labels keep away from.
    pub(super) fn keep_clear(&mut self, points: Vec<Px>) {
        self.busy.push(points);
    }

    /// Text that labels do not lie on.
    pub(super) fn keep_off(&mut self, text: Frame) {
        self.taken.push(text);
    }

    /// Whether a point of the figure lies in the frame.
    pub(super) fn holds(&self, at: Px) -> bool {
        let Frame { left, right, top, bottom } = self.frame;
        (left..=right).contains(&at.0) && (top..=bottom).contains(&at.1)
    }

    /// A line right across at a value, if the axis reaches it.
    pub(super) fn level(&mut self, figure: &mut Figure, value: f64, line_style: LineStyle) {
        let y = self.at(0.0, value).1;
        if (self.frame.top..=self.frame.bottom).contains(&y) {
            let line = vec![(self.frame.left, y), (self.frame.right, y)];
            figure.line(&line, line_style);
            self.busy.push(line);
        }
    }

    /// Shades what lies between two values.
    pub(super) fn shade(&self, figure: &mut Figure, from: f64, to: f64) {
        let Frame { left, right, top, bottom } = self.frame;
        let (a, b) = (self.at(0.0, from).1.clamp(top, bottom), self.at(0.0, to).1.clamp(top, bottom));
        if a != b {
            figure.rectangle(&Frame { left, top: a.min(b), right, bottom: a.max(b) }, SHADE);
        }
    }

    /// A label on a line across at `value`, at the right end where it hides least.
    pub(super) fn level_label(&mut self, figure: &mut Figure, value: f64, text: &str, colour: Colour) {
        let y = self.at(0.0, value).1;
        if !(self.frame.top..=self.frame.bottom).contains(&y) {
            return;
        }
        let places: Vec<(Px, Anchor)> = [0.98, 0.75, 0.5, 0.25, 0.86, 0.62, 0.37, 0.14]
            .into_iter()
            .flat_map(|share| [(share, -10.0), (share, 11.0)])
            .map(|(share, dy)| ((self.frame.left + share * self.frame.width(), y + dy), Anchor::Right))
            .collect();
        self.label(figure, text, colour, &places, None);
    }

    /// A label on the whole subplot, where it hides least.
    pub(super) fn note(&mut self, figure: &mut Figure, text: &str, colour: Colour) {
        let Frame { left, right, top, bottom } = self.frame;
        let places: Vec<(Px, Anchor)> = [top + 13.0, bottom - 13.0]
            .into_iter()
            .flat_map(|y| {
                [(left + 10.0, Anchor::Left), (0.5 * (left + right), Anchor::Middle), (right - 10.0, Anchor::Right)]
                    .map(|(x, anchor)| ((x, y), anchor))
            })
            .collect();
        self.label(figure, text, colour, &places, None);
    }

    /// A label beside a point: near it where nothing is drawn, else farther away with a thin line to it.
    pub(super) fn point_label(&mut self, figure: &mut Figure, at: Px, text: &str, colour: Colour) {
        let (x, y) = at;
        let mut places = Vec::new();
        for far in [0.0, 14.0, 30.0, 60.0, 95.0, 140.0] {
            places.extend([
                ((x, y - 15.0 - far), Anchor::Middle),
                ((x, y + 15.0 + far), Anchor::Middle),
                ((x + 11.0 + far, y), Anchor::Left),
                ((x - 11.0 - far, y), Anchor::Right),
                ((x + 8.0 + far, y - 12.0 - far), Anchor::Left),
                ((x - 8.0 - far, y - 12.0 - far), Anchor::Right),
                ((x + 8.0 + far, y + 12.0 + far), Anchor::Left),
                ((x - 8.0 - far, y + 12.0 + far), Anchor::Right),
            ]);
            if far > 0.0 {
                places.extend([
                    ((x + 8.0 + 0.5 * far, y - 12.0 - far), Anchor::Left),
                    ((x - 8.0 - 0.5 * far, y - 12.0 - far), Anchor::Right),
                    ((x + 8.0 + 0.5 * far, y + 12.0 + far), Anchor::Left),
                    ((x - 8.0 - 0.5 * far, y + 12.0 + far), Anchor::Right),
                ]);
            }
        }
        self.label(figure, text, colour, &places, Some(at));
    }

    /// A label at the one of `places` where it lies inside the frame, on no other label, and hides least; earlier ones are
    /// preferred among those that hide the same. Where every place is taken there is none. A line leads to `point` from far away.
    fn label(&mut self, figure: &mut Figure, text: &str, colour: Colour, places: &[(Px, Anchor)], point: Option<Px>) {
        let inner = Frame {
            left: self.frame.left + 3.0,
            top: self.frame.top + 2.0,
            right: self.frame.right - 3.0,
            bottom: self.frame.bottom - 2.0,
        };
        let hidden = |frame: &Frame| {
            let lines = self.busy.iter().flat_map(|line| line.windows(2)).filter_map(|p| frame.clip(p[0], p[1]));
            lines.map(|(a, b)| 1.0 + length((b.0 - a.0, b.1 - a.1))).sum::<f64>()
        };
        let best = places
            .iter()
            .enumerate()
            .filter_map(|(i, &(at, anchor))| {
                let label = TextFormat::new(at, text, LABEL_EM, anchor).coloured(colour);
                let frame = label.frame();
                let free = frame.is_within(&inner) && !self.taken.iter().any(|other| other.overlaps(&frame));
                let leader = point.and_then(|point| leader(point, &frame, LEADER_CLEAR_PX));
                let free = free
                    && !leader.is_some_and(|(from, to)| self.taken.iter().any(|other| other.clip(from, to).is_some()));
                let around = Frame { top: frame.top - 1.5, bottom: frame.bottom + 1.5, ..frame };
                free.then(|| (HIDING * hidden(&around) + 1.5 * i as f64, label))
            })
            .reduce(|best, next| if next.0 < best.0 { next } else { best });
        if let Some((_, label)) = best {
            let Frame { left, top, right, bottom } = label.frame();
            let frame = Frame { left: left - 3.0, top, right: right + 3.0, bottom };
            if let Some((from, to)) = point.and_then(|point| leader(point, &label.frame(), LEADER_FROM_PX)) {
                figure.line(&[from, to], LineStyle::solid(BORDER, 0.8));
            }
            // Grid lines may show through, curves may not.
            if self.plates || hidden(&frame) > 0.0 {
                figure.rectangle(&frame, WHITE);
            }
            figure.text(label);
            self.taken.push(frame);
        }
    }
}

/// The line from a point, `from_px` away from it, to its label; none where the label is near.
fn leader(point: Px, label: &Frame, from_px: f64) -> Option<(Px, Px)> {
    let to = (point.0.clamp(label.left, label.right), point.1.clamp(label.top, label.bottom));
    let (dx, dy) = (to.0 - point.0, to.1 - point.1);
    let distance = length((dx, dy));
    let share = from_px / distance;
    (distance > LEADER_PX).then_some(((point.0 + share * dx, point.1 + share * dy), to))
}
