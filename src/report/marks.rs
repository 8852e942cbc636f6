//! The marks that a figure is made of, in pixels of the layout.

use super::curve::{Frame, Px};
use super::font;
use super::style::{Colour, INK};

/// Backends take whole numbers only: they are given tenths of a pixel, so that curves stay smooth.
pub(super) const UNITS_PER_PX: f64 = 10.0;

/// plotters' SVG backend divides the font size by this.
pub(super) const PLOTTERS_FONT_SCALE: f64 = 1.24;

/// Which point of a text is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct TextFormat {
    /// Anchor; half the height of a small letter above the base line.
    pub(super) at: Px,
    pub(super) text: String,
    pub(super) em_px: f64,
    pub(super) colour: Colour,
    pub(super) anchor: Anchor,
    /// Reads from bottom to top.
    pub(super) upwards: bool,
}

impl TextFormat {
    pub(super) fn new(at: Px, text: impl Into<String>, em_px: f64, anchor: Anchor) -> Self {
        Self { at, text: text.into(), em_px, colour: INK, anchor, upwards: false }
    }

    #[must_use]
    pub(super) fn coloured(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// The rectangle that the text covers.
    pub(super) fn frame(&self) -> Frame {
        let width = font::width_px(&self.text, self.em_px);
        let start = match self.anchor {
            Anchor::Left => 0.0,
            Anchor::Middle => -0.5 * width,
            Anchor::Right => -width,
        };
        // Ascenders reach 0.5 em above the anchor, descenders 0.5 em below.
        let half = 0.5 * self.em_px;
        let (x, y) = self.at;
        if self.upwards {
            Frame { left: x - half, top: y - start - width, right: x + half, bottom: y - start }
        } else {
            Frame { left: x + start, top: y - half, right: x + start + width, bottom: y + half }
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mark {
    Line { points: Vec<Px>, colour: Colour, width_px: f64 },
    Area { points: Vec<Px>, colour: Colour },
    Dot { at: Px, radius_px: f64, colour: Colour },
    TextFormat(TextFormat),
    Image(Image),
}

/// Coloured squares, row after row from the top, stretched over a frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Image {
    pub(super) frame: Frame,
    pub(super) columns: usize,
    pub(super) colours: Vec<Colour>,
}

impl Image {
    pub(super) fn rows(&self) -> usize {
        self.colours.len() / self.columns.max(1)
    }
}

/// Font size in units from the size that a backend is given.
pub(super) fn em_units(plotters_size: f64) -> f64 {
    plotters_size / PLOTTERS_FONT_SCALE
}
