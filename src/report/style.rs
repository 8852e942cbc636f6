//! Colours, and how lines are drawn.

use super::curve::Dash;

pub(super) type Colour = (u8, u8, u8);

pub(super) const INK: Colour = (34, 34, 34);
pub(super) const MUTED: Colour = (100, 100, 100);
pub(super) const GRID: Colour = (229, 229, 229);
pub(super) const BORDER: Colour = (130, 130, 130);
pub(super) const DESIRED: Colour = (178, 178, 178);
pub(super) const SHADE: Colour = (244, 240, 234);
pub(super) const TINT: Colour = (250, 224, 205);
pub(super) const WHITE: Colour = (255, 255, 255);

/// One colour a run, told apart by colour-blind readers too (Okabe and Ito 2008, without its yellow).
pub(super) const RUN_COLOURS: [Colour; 6] =
    [(0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233)];
pub(super) const VERMILLION: Colour = RUN_COLOURS[1];

/// Stroke of the curves \[px\].
pub(super) const CURVE_PX: f64 = 1.5;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LineStyle {
    pub(super) colour: Colour,
    pub(super) width_px: f64,
    pub(super) dash: Option<Dash>,
}

impl LineStyle {
    pub(super) fn solid(colour: Colour, width_px: f64) -> Self {
        Self { colour, width_px, dash: None }
    }

    /// The pale colour between the borders of an envelope.
    pub(super) fn colour_of_band(&self) -> Colour {
        let pale = |c: u8| 255 - (255 - c) / 4;
        let (r, g, b) = self.colour;
        (pale(r), pale(g), pale(b))
    }
}
