//! A perceptually uniform scale of colours, and the bar that explains it.

use super::super::super::axis::{Axis, Range};
use super::super::super::curve::Frame;
use super::super::super::figure::Figure;
use super::super::super::font;
use super::super::super::marks::{Anchor, TextFormat};
use super::super::super::style::{BORDER, Colour, LineStyle};

/// Viridis (S. van der Walt and N. Smith 2015, matplotlib, CC0) at nine even steps: lightness rises evenly, also for
/// colour-blind readers.
const VIRIDIS: [Colour; 9] = [
    (68, 1, 84),
    (71, 44, 122),
    (59, 81, 139),
    (44, 113, 142),
    (33, 144, 141),
    (39, 173, 129),
    (92, 200, 99),
    (170, 220, 50),
    (253, 231, 37),
];

/// Steps that are told apart; neighbouring cells of one step are drawn together.
const STEPS: u8 = 96;

const BAR_PX: f64 = 18.0;
/// Room that the bar takes with its labels, right of the subplot.
pub(in super::super) const ROOM_PX: f64 = 122.0;

/// A colour between neighbours of a row, at a share from 0 to 1 of it.
pub(in super::super) fn mixed<const N: usize>(nodes: &[Colour; N], share: f64) -> Colour {
    let place = share * (N - 1) as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // from 0 to the last but one
    let below = (place as usize).min(N - 2);
    let share = place - below as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 255
    let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
    let (a, b) = (nodes[below], nodes[below + 1]);
    (mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

/// From the metric to a colour.
pub(in super::super) struct Scale {
    axis: Axis,
    /// Steps of the colours that are used.
    steps: u8,
}

/// The lightest colours are lost in thin lines on white: lines take only this many of the steps.
const LINE_STEPS: u8 = 84;

impl Scale {
    /// A scale over all `values`, of their logarithm where all are positive.
    pub(super) fn of(values: impl Iterator<Item = f64>, height_px: f64) -> Self {
        let range = Range::of(values.filter(|value| value.abs() <= 1e100));
        let axis = if range.low > 0.0 && !range.is_empty() {
            Axis::logarithmic_within(range.opened(1e-12 * range.high), height_px, 40.0)
        } else {
            Axis::linear(range, height_px, 50.0, false)
        };
        Self { axis, steps: STEPS }
    }

    /// A linear scale over a range for the colours of lines; ticks on whole numbers only where `whole`.
    pub(in super::super) fn of_lines(range: Range, height_px: f64, whole: bool) -> Self {
        Self { axis: Axis::linear(range, height_px, 50.0, whole), steps: LINE_STEPS }
    }

    /// The colour of a value.
    pub(in super::super) fn colour_of(&self, value: f64) -> Colour {
        Self::colour(self.step(value))
    }

    /// The step of a value, from 0 to one less than there are steps.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // between 0 and the number of steps
    pub(in super::super) fn step(&self, value: f64) -> u8 {
        let share = self.axis.share(value).max(0.0).min(1.0);
        ((share * f64::from(self.steps)) as u8).min(self.steps - 1)
    }

    pub(in super::super) fn colour(step: u8) -> Colour {
        mixed(&VIRIDIS, f64::from(step) / f64::from(STEPS - 1))
    }

    /// The bar, right of a subplot.
    pub(in super::super) fn draw(&self, figure: &mut Figure, subplot: &Frame, quantity: &str, unit: &str) {
        let left = subplot.right + 22.0;
        let frame = Frame { left, right: left + BAR_PX, ..*subplot };
        let at = |share: f64| frame.bottom - share * frame.height();
        for step in 0..self.steps {
            let (low, high) = (f64::from(step) / f64::from(self.steps), f64::from(step + 1) / f64::from(self.steps));
            // Down to the bottom: what the next one does not cover shows no seam.
            let part = Frame { top: at(high), bottom: (at(low) + 1.0).min(frame.bottom), ..frame };
            figure.rectangle(&part, Self::colour(step));
        }
        let Frame { left, right, top, bottom } = frame;
        let line_style = LineStyle::solid(BORDER, 1.0);
        figure.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], line_style);
        for tick in &self.axis.ticks {
            let y = at(self.axis.share(tick.value));
            figure.line(&[(right, y), (right + 4.0, y)], line_style);
            figure.text(TextFormat::new((right + 8.0, y), tick.label.as_str(), 12.5, Anchor::Left));
        }
        let labels = self.axis.ticks.iter().map(|tick| font::width_px(&tick.label, 12.5)).fold(0.0, f64::max);
        let middle = (right + 8.0 + labels + 14.0, 0.5 * (top + bottom));
        let title = self.axis.title(quantity, unit);
        figure.text(TextFormat { upwards: true, ..TextFormat::new(middle, title, 14.0, Anchor::Middle) });
    }
}
