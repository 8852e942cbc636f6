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

/// The glyph of a character; none of one that the bundled font lacks.
pub(super) fn glyph(font: &FontRef<'static>, c: char) -> Option<GlyphId> {
    Some(font.glyph_id(c)).filter(|id| id.0 != 0)
}

/// Advance width of a glyph, in units of the font size.
pub(super) fn advance_em(font: &FontRef<'static>, glyph: GlyphId) -> f64 {
    f64::from(font.h_advance_unscaled(glyph)) / f64::from(font.units_per_em().unwrap_or(2048.0))
}

/// What stands for a character that the font lacks: its code point in two rows of hexadecimal digits, with a box around them.
/// Nothing is lost without a word.
pub(super) struct CodeBox {
    /// The digits, row after row.
    pub(super) rows: [String; 2],
}

impl CodeBox {
    /// Size of the digits, in units of the font size.
    pub(super) const DIGIT_EM: f64 = 0.38;
    /// From a digit to the next.
    pub(super) const DIGIT_ADVANCE_EM: f64 = 0.636 * Self::DIGIT_EM;
    /// Between digits and border.
    pub(super) const PADDING_EM: f64 = 0.07;
    /// Left and right of the border.
    pub(super) const SIDE_EM: f64 = 0.05;

    pub(super) fn of(c: char) -> Self {
        let code = u32::from(c);
        let digits = if code > 0xffff { format!("{code:06X}") } else { format!("{code:04X}") };
        let (upper, lower) = digits.split_at(digits.len() / 2);
        Self { rows: [upper.to_owned(), lower.to_owned()] }
    }

    /// Width of the border.
    pub(super) fn width_em(&self) -> f64 {
        self.rows[0].len() as f64 * Self::DIGIT_ADVANCE_EM + 2.0 * Self::PADDING_EM
    }

    pub(super) fn advance_em(&self) -> f64 {
        self.width_em() + 2.0 * Self::SIDE_EM
    }
}

/// How far a character moves the next one, in units of the font size.
pub(super) fn char_advance_em(font: &FontRef<'static>, c: char) -> f64 {
    match glyph(font, c) {
        Some(id) => advance_em(font, id),
        None => CodeBox::of(c).advance_em(),
    }
}

/// Width of a line of text \[px\] set in `em_px`.
pub(super) fn width_px(text: &str, em_px: f64) -> f64 {
    let ems = match font() {
        Some(font) => text.chars().map(|c| char_advance_em(font, c)).sum::<f64>(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_a_text_has_a_width() {
        for c in "aß…−Ω∞⁻³šЖ中🙂\u{301}".chars() {
            assert!(width_px(&c.to_string(), 10.0) > 1.0, "{c}");
        }
        let font = font().unwrap();
        for c in "Łódź, Škoda, Ţepeș, Ўфа, Ωµ√≈≤①✓€".chars() {
            assert!(glyph(font, c).is_some(), "{c}");
        }
        assert!(glyph(font, '中').is_none());
        assert_eq!(CodeBox::of('中').rows, ["4E", "2D"]);
        assert_eq!(CodeBox::of('🙂').rows, ["01F", "642"]);
    }
}
