//! The bundled font: text sizes for the layout, glyphs for PNG.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, GlyphId};

/// Font families of an SVG, the bundled one first; the second has the same metrics, the rest are narrower.
pub(super) const FAMILY: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

static BYTES: &[u8] = include_bytes!("fonts/DejaVuSans-subset.ttf");

/// The bundled font, parsed once. `None` only if the file in the repository were damaged.
pub(super) fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(BYTES).ok()).as_ref()
}

/// Advance width of a glyph, in units of the font size.
pub(super) fn advance_em(font: &FontRef<'static>, glyph: GlyphId) -> f64 {
    f64::from(font.h_advance_unscaled(glyph)) / f64::from(font.units_per_em().unwrap_or(2048.0))
}

/// Width of a line of text \[px\] set in `em_px`.
pub(super) fn width_px(text: &str, em_px: f64) -> f64 {
    let ems = match font() {
        Some(font) => text.chars().map(|c| advance_em(font, font.glyph_id(c))).sum::<f64>(),
        None => 0.6 * text.chars().count() as f64,
    };
    ems * em_px
}

/// `text`, its middle left out where it is wider than `limit_px`: names of runs often differ at their ends.
pub(super) fn shortened(text: &str, em_px: f64, limit_px: f64) -> String {
    if width_px(text, em_px) <= limit_px {
        return text.to_owned();
    }
    let half = 0.5 * (limit_px - width_px("…", em_px));
    let fits = |chars: &mut dyn Iterator<Item = char>| {
        let mut width = 0.0;
        let mut kept: Vec<char> = Vec::new();
        for c in chars {
            width += width_px(c.encode_utf8(&mut [0; 4]), em_px);
            if width > half {
                break;
            }
            kept.push(c);
        }
        kept
    };
    let (start, end) = (fits(&mut text.chars()), fits(&mut text.chars().rev()));
    start.into_iter().chain(['…']).chain(end.into_iter().rev()).collect()
}

/// `text`, cut short with an ellipsis where it is wider than `limit_px`.
pub(super) fn fitted(text: &str, em_px: f64, limit_px: f64) -> String {
    if width_px(text, em_px) <= limit_px {
        return text.to_owned();
    }
    let mut kept = String::new();
    let mut width = width_px("…", em_px);
    for c in text.chars() {
        width += width_px(c.encode_utf8(&mut [0; 4]), em_px);
        if width > limit_px {
            break;
        }
        kept.push(c);
    }
    kept.truncate(kept.trim_end().len());
    kept.push('…');
    kept
}
