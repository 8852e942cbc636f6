//! Paths in three dimensions: seen from above, from the right and the front, without perspective.

use super::super::axis::{Axis, Range, power_of_ten, round_up_125, significant};
use super::super::curve::{Frame, Px, length};
use super::super::figure::Figure;
use super::super::font;
use super::super::marks::{Anchor, TextFormat};
use super::super::part_data::{MoveKind, PathPicture};
use super::super::style::{BORDER, GRID, LineStyle};
use super::super::subplot::{Entry, Heading};
use super::named_run::{Named, heading as run_heading, in_scale, off_scale_text, samples};
use super::rings::{LINK_TEXT, RAPID, ends, heading, mark_ends, places};
use super::sweep::colour::{ROOM_PX, Scale};
use super::time::LEAST_ERROR_UM;
use super::words::capital;

/// Turn of the part about Z and slant of the view: sines and cosines of 35 and 32 degrees.
const TURN: (f64, f64) = (0.573_576_436_351_046, 0.819_152_044_288_991_8);
const SLANT: (f64, f64) = (0.529_919_264_233_204_9, 0.848_048_096_156_426);
/// A path lower than this share of its width is drawn higher.
const LEAST_HEIGHT: f64 = 0.15;
/// Room for the numbers of the axes \[px\].
const ROOM: f64 = 58.0;

/// From the part's millimetres to the figure.
struct View {
    middle: [f64; 3],
    px_per_mm: f64,
    /// Heights are drawn this many times as large.
    times: f64,
    centre: Px,
}

impl View {
    /// Before scale and place: right and up.
    fn plain(from_middle: [f64; 3], times: f64) -> Px {
        let [x, y, z] = from_middle;
        let (right, away) = (TURN.1 * x + TURN.0 * y, TURN.1 * y - TURN.0 * x);
        (right, SLANT.1 * times * z + SLANT.0 * away)
    }

    fn at(&self, p: [f64; 3]) -> Px {
        let (right, up) = Self::plain([0, 1, 2].map(|i| p[i] - self.middle[i]), self.times);
        (self.centre.0 + self.px_per_mm * right, self.centre.1 - self.px_per_mm * up)
    }
}

/// The view of what lies in these ranges, with the heading above it and the box around it drawn, and the frame of the picture.
fn stage(figure: &mut Figure, mut head: Heading, ranges: [Range; 3], room_px: f64) -> (View, Frame) {
    let ranges = ranges.map(|range| range.opened(1e-3));
    let wide = ranges[0].span().max(ranges[1].span());
    let times = if ranges[2].span() < LEAST_HEIGHT * wide {
        let (digit, exponent) = round_up_125(0.63 * LEAST_HEIGHT * wide / ranges[2].span());
        (f64::from(digit) * power_of_ten(exponent)).max(1.0)
    } else {
        1.0
    };
    if times > 1.0 {
        let large = format!("heights drawn {} times as large", significant(times, 3));
        head.subtitle = if head.subtitle.is_empty() { capital(&large) } else { format!("{}; {large}", head.subtitle) };
    }
    let space = head.draw(figure);
    let frame = Frame { right: space.right - room_px, bottom: space.bottom + 30.0, ..space };
    let middle = ranges.map(|range| range.middle());
    let corners = (0..8).map(|k| [0, 1, 2].map(|i| if k >> i & 1 == 0 { ranges[i].low } else { ranges[i].high }));
    let flat: Vec<Px> = corners.map(|c| View::plain([0, 1, 2].map(|i| c[i] - middle[i]), times)).collect();
    let (across, up) = (Range::of(flat.iter().map(|p| p.0)), Range::of(flat.iter().map(|p| p.1)));
    let px_per_mm = ((frame.width() - 2.0 * ROOM) / across.span()).min((frame.height() - 2.0 * ROOM) / up.span());
    let centre = (0.5 * (frame.left + frame.right), 0.5 * (frame.top + frame.bottom));
    let view = View { middle, px_per_mm, times, centre };
    box_and_axes(figure, &view, ranges);
    (view, frame)
}

/// The bar of the colours, and the scale behind it.
fn scale_of(values: Range, frame: &Frame) -> (Scale, Frame) {
    let bar = Frame { top: frame.top + 20.0, bottom: frame.bottom - 40.0, ..*frame };
    (Scale::of_lines(values, bar.height(), false), bar)
}

/// A line through places with a value each, every piece in the colour of the mean of its ends.
fn coloured(figure: &mut Figure, view: &View, frame: &Frame, scale: &Scale, line: &[([f64; 3], f64)]) {
    // Pieces of one colour together.
    let colour = |i: usize| scale.step(0.5 * line[i].1 + 0.5 * line[i + 1].1) / 3;
    let mut from = 0;
    while from + 1 < line.len() {
        let step = colour(from);
        let mut to = from + 1;
        while to + 1 < line.len() && colour(to) == step {
            to += 1;
        }
        let run: Vec<Px> = line[from..=to].iter().map(|(p, _)| view.at(*p)).collect();
        figure.curve(&run, frame, LineStyle::solid(Scale::colour(3 * step + 1), 1.3));
        from = to;
    }
}

pub(in super::super) fn figure(picture: &PathPicture) -> Figure {
    let mut figure = Figure::default();
    let ranges = [0, 1, 2].map(|i| Range::of(picture.moves.iter().flat_map(places).map(|p| p[i])));
    let mut head = heading(picture, "tool path in three dimensions", |part| places(part).nth(1).is_some());
    // Here every cutting move has the colour of its height.
    head.legend.retain(|entry| entry.text != LINK_TEXT);
    let (view, frame) = stage(&mut figure, head, ranges, ROOM_PX);
    let heights = picture.moves.iter().filter(|m| m.kind != MoveKind::Rapid).flat_map(places).map(|p| p[2]);
    let cut = Range::of(heights);
    let (scale, bar) = scale_of(cut, &frame);
    for part in picture.moves.iter().filter(|m| m.kind != MoveKind::Rapid) {
        let line: Vec<_> = places(part).map(|p| (p, p[2])).collect();
        coloured(&mut figure, &view, &frame, &scale, &line);
    }
    for part in picture.moves.iter().filter(|m| m.kind == MoveKind::Rapid) {
        let line: Vec<Px> = places(part).map(|p| view.at(p)).collect();
        figure.curve(&line, &frame, RAPID);
    }
    if let Some(ends) = ends(picture) {
        mark_ends(&mut figure, ends.map(|p| view.at(p)));
    }
    if !cut.is_empty() {
        scale.draw(&mut figure, &bar, "height z", "mm");
    }
    figure
}

/// The actual paths of runs: of one run coloured by its contouring error, of several each in the run's colour.
pub(in super::super) fn of_runs(runs: &[Named<'_>]) -> Figure {
    let mut figure = Figure::default();
    let samples = samples(runs);
    let cutting = || samples.iter().flatten().filter(|sample| !sample.rapid);
    let mut errors = Range::of(cutting().map(|sample| sample.contour_error_um.abs()));
    errors.include(0.0);
    // Of a run that has left the part behind only the commanded path is to be in view.
    let in_scale = in_scale(runs, |run| run.data.metrics().worst.contour_error_um.abs());
    let mut head = run_heading(runs, "actual path in three dimensions");
    if runs.len() == 1 {
        head.subtitle = format!("Largest contouring error at the feed {} µm", significant(errors.high, 4));
    } else {
        let entry = |(run, in_scale): (&Named<'_>, &bool)| {
            Entry::line(run.line_style(1.3), format!("{}{}", run.short(), off_scale_text(*in_scale)))
        };
        head.legend.extend(runs.iter().zip(&in_scale).map(entry));
    }
    let ranges = [0, 1, 2].map(|i| {
        let places = samples.iter().zip(&in_scale).flat_map(|(samples, in_scale)| {
            samples.iter().map(move |sample| if *in_scale { sample.actual_mm[i] } else { sample.command_mm[i] })
        });
        Range::of(places)
    });
    if samples.iter().flatten().any(|sample| sample.rapid) {
        head.legend.push(Entry::line(RAPID, "rapid motion"));
    }
    let (view, frame) = stage(&mut figure, head, ranges, if runs.len() == 1 { ROOM_PX } else { 0.0 });
    let (scale, bar) = scale_of(errors.opened(LEAST_ERROR_UM), &frame);
    for (run, samples) in runs.iter().zip(&samples) {
        let mut before = None;
        for part in samples.chunk_by(|a, b| a.rapid == b.rapid) {
            // Each begins where the one before ends.
            let line = || before.into_iter().chain(part.iter());
            let px = || line().map(|sample| view.at(sample.actual_mm)).collect::<Vec<Px>>();
            if part.first().is_some_and(|sample| sample.rapid) {
                figure.curve(&px(), &frame, RAPID);
            } else if runs.len() == 1 {
                let line: Vec<_> = line().map(|s| (s.actual_mm, s.contour_error_um.abs())).collect();
                coloured(&mut figure, &view, &frame, &scale, &line);
            } else {
                figure.curve(&px(), &frame, run.line_style(1.3));
            }
            before = part.last();
        }
    }
    if runs.len() == 1 && cutting().next().is_some() {
        scale.draw(&mut figure, &bar, "contouring error", "µm");
    }
    figure
}

/// Where the numbers of an axis stand: the edge, how far out, which end of them, and the axis' name.
type Edge<'a> = (&'a dyn Fn(f64) -> [f64; 3], Px, Anchor, &'static str);

/// The box around the path, ticks along three of its edges.
fn box_and_axes(figure: &mut Figure, view: &View, [x, y, z]: [Range; 3]) {
    let line = |figure: &mut Figure, a: [f64; 3], b: [f64; 3], line_style: LineStyle| {
        figure.line(&[view.at(a), view.at(b)], line_style)
    };
    let (faint, edge) = (LineStyle::solid(GRID, 1.0), LineStyle::solid(BORDER, 1.0));
    // Floor and the two walls behind; the numbers stand along the edges in front, and at the left.
    let px = |a: [f64; 3], b: [f64; 3]| {
        let (a, b) = (view.at(a), view.at(b));
        length((b.0 - a.0, b.1 - a.1))
    };
    let along_x = px([x.low, y.low, z.low], [x.high, y.low, z.low]);
    let along_y = px([x.high, y.low, z.low], [x.high, y.high, z.low]);
    let along_z = px([x.low, y.low, z.low], [x.low, y.low, z.high]);
    let axes = [(x, along_x, 62.0), (y, along_y, 62.0), (z, along_z, 30.0)]
        .map(|(range, px, tick)| Axis::linear(range, px.max(60.0), tick, false));
    for tick in axes[0].ticks.iter().map(|tick| tick.value) {
        line(figure, [tick, y.low, z.low], [tick, y.high, z.low], faint);
        line(figure, [tick, y.high, z.low], [tick, y.high, z.high], faint);
    }
    for tick in axes[1].ticks.iter().map(|tick| tick.value) {
        line(figure, [x.low, tick, z.low], [x.high, tick, z.low], faint);
        line(figure, [x.low, tick, z.low], [x.low, tick, z.high], faint);
    }
    for tick in axes[2].ticks.iter().map(|tick| tick.value) {
        line(figure, [x.low, y.low, tick], [x.low, y.high, tick], faint);
        line(figure, [x.low, y.high, tick], [x.high, y.high, tick], faint);
    }
    let floor = [[x.low, y.low], [x.high, y.low], [x.high, y.high], [x.low, y.high]];
    for (a, b) in floor.iter().zip(floor.iter().cycle().skip(1)) {
        line(figure, [a[0], a[1], z.low], [b[0], b[1], z.low], edge);
    }
    for [cx, cy] in [[x.low, y.low], [x.low, y.high], [x.high, y.high]] {
        line(figure, [cx, cy, z.low], [cx, cy, z.high], edge);
    }
    line(figure, [x.low, y.low, z.high], [x.low, y.high, z.high], edge);
    line(figure, [x.low, y.high, z.high], [x.high, y.high, z.high], edge);

    // Titles first, then each number a little outward of its edge, where there is room.
    let mut taken: Vec<Frame> = Vec::new();
    let edges: [Edge<'_>; 3] = [
        (&|t| [t, y.low, z.low], (-5.0, 10.0), Anchor::Right, "x"),
        (&|t| [x.high, t, z.low], (6.0, 10.0), Anchor::Left, "y"),
        (&|t| [x.low, y.low, t], (-9.0, 0.0), Anchor::Right, "z"),
    ];
    for (axis, (place, _, anchor, name)) in axes.iter().zip(&edges) {
        let widest = axis.ticks.iter().map(|tick| font::width_px(&tick.label, 12.5)).fold(0.0, f64::max);
        let middle = view.at(place(axis.range.middle()));
        let (at, anchor) = match *name {
            "x" => ((middle.0 - widest - 16.0, middle.1 + 34.0), *anchor),
            "y" => ((middle.0 + widest + 20.0, middle.1 + 30.0), *anchor),
            _ => (view.at(place(axis.range.high)), *anchor),
        };
        let title = axis.title(name, "mm");
        // Left of the edge that leads away from there, and on the figure.
        let least = font::width_px(&title, 14.0) + 8.0;
        let at = if *name == "z" { ((at.0 - 6.0).max(least), at.1 - 18.0) } else { at };
        let title = TextFormat::new(at, title, 14.0, anchor);
        taken.push(title.frame());
        figure.text(title);
    }
    for (axis, (place, out, anchor, _)) in axes.iter().zip(&edges) {
        for tick in &axis.ticks {
            let (px, py) = view.at(place(tick.value));
            let label = TextFormat::new((px + out.0, py + out.1), tick.label.as_str(), 12.5, *anchor);
            if !taken.iter().any(|other| other.overlaps(&label.frame())) {
                figure.line(&[(px, py), (px + 0.5 * out.0, py + 0.5 * out.1)], edge);
                taken.push(label.frame());
                figure.text(label);
            }
        }
    }
}
