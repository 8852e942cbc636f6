//! A plotters backend that paints into memory and gives a PNG file.
//!
//! plotters' own bitmap backend turns a thick polyline into one polygon, which tears at sharp turns: a noisy voltage is
//! nothing but sharp turns. Here every stroke is the set of points near its segments, smooth at the edges; and since
//! positions come in tenths of a pixel, curves do not stand in steps.

use std::convert::Infallible;

use ab_glyph::{Font, FontRef, GlyphId, PxScale, point};
use plotters_backend::text_anchor::HPos;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};

use super::curve::{Frame, Px, distance_to_segment, length};
use super::font::{self, CodeBox};
use super::marks::{Image, UNITS_PER_PX, em_units};

/// Pixels of the file per pixel of the layout: sharp on dense screens and in print.
const DENSITY: f64 = 2.0;
/// Units that positions come in per pixel of the file.
const UNITS: f64 = UNITS_PER_PX / DENSITY;
/// Half the height of a small letter, in units of the font size (`DejaVu` Sans).
const HALF_X_HEIGHT_EM: f64 = 0.27;
/// Long segments are painted piece by piece, so that the boxes around the pieces stay small.
const PIECE_PX: f64 = 24.0;
/// Scan lines a pixel when areas are filled.
const SCANS: u32 = 4;

/// Height of a digit, in units of the font size (`DejaVu` Sans).
const CAP_HEIGHT_EM: f64 = 0.729;

/// A line of text: where its anchor is on the file's pixels, and how it is turned.
struct TextLine {
    at: Px,
    transform: FontTransform,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

pub(super) struct Pixels {
    width: usize,
    height: usize,
    /// Red, green, blue.
    data: Vec<u8>,
    /// How much of each pixel the mark being painted covers, 0 to 1; all zero between marks.
    cover: Vec<f32>,
    /// Rows and columns that the mark touches: left, top, right, bottom (exclusive).
    touched: [usize; 4],
}

impl Pixels {
    /// A white figure of this size in pixels of the layout.
    pub(super) fn new(width_px: f64, height_px: f64) -> Self {
        let (width, height) = (index(width_px * DENSITY), index(height_px * DENSITY));
        let (data, cover) = (vec![255; 3 * width * height], vec![0.0; width * height]);
        Self { width, height, data, cover, touched: [usize::MAX, usize::MAX, 0, 0] }
    }

    /// The PNG file.
    pub(super) fn encode(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut out = Vec::new();
        let size = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
        let mut encoder = png::Encoder::new(&mut out, size(self.width), size(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Default);
        // Most rows are like the one above.
        encoder.set_filter(png::FilterType::Up);
        // 192 dots an inch, so that it prints in the size of the layout.
        let per_metre = 7559;
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }));
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.data)?;
        writer.finish()?;
        Ok(out)
    }

    /// Raises the cover of the pixels of a box to what `of` says of their centres.
    fn raise(&mut self, low: Px, high: Px, of: impl Fn(Px) -> f64) {
        let (left, top) = (index(low.0.floor()), index(low.1.floor()));
        let (right, bottom) = (index(high.0.ceil()).min(self.width), index(high.1.ceil()).min(self.height));
        for y in top..bottom {
            for x in left..right {
                let share = narrow(of((x as f64 + 0.5, y as f64 + 0.5)).clamp(0.0, 1.0));
                if let Some(cover) = self.cover.get_mut(y * self.width + x) {
                    *cover = cover.max(share);
                }
            }
        }
        self.touch(left, top, right, bottom);
    }

    fn touch(&mut self, left: usize, top: usize, right: usize, bottom: usize) {
        if left < right && top < bottom {
            let [l, t, r, b] = self.touched;
            self.touched = [l.min(left), t.min(top), r.max(right), b.max(bottom)];
        }
    }

    fn stroke(&mut self, a: Px, b: Px, width: f64) {
        // A line thinner than a pixel is drawn a pixel wide but paler.
        let (half, strength) = (0.5 * width.max(1.0), width.min(1.0));
        let pieces = (length((b.0 - a.0, b.1 - a.1)) / PIECE_PX).ceil().max(1.0);
        let at = |i: usize| {
            let t = i as f64 / pieces;
            (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
        };
        for i in 0..index(pieces) {
            let (from, to) = (at(i), at(i + 1));
            let reach = half + 1.0;
            let low = (from.0.min(to.0) - reach, from.1.min(to.1) - reach);
            let high = (from.0.max(to.0) + reach, from.1.max(to.1) + reach);
            self.raise(low, high, |p| strength * (half + 0.5 - distance_to_segment(p, from, to)));
        }
    }

    /// Everything that the outline runs round at least once, whatever the direction.
    fn fill(&mut self, outline: &[Px]) {
        let edges: Vec<(Px, Px)> =
            outline.iter().copied().zip(outline.iter().copied().cycle().skip(1)).filter(|(a, b)| a.1 != b.1).collect();
        let bounds = edges.iter().flat_map(|(a, b)| [a.1, b.1]);
        let (top, bottom) = bounds.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
        let mut crossings = Vec::new();
        for y in index(top.floor())..index(bottom.ceil()).min(self.height) {
            for scan in 0..SCANS {
                let level = y as f64 + (f64::from(scan) + 0.5) / f64::from(SCANS);
                crossings.clear();
                crossings.extend(
                    edges.iter().filter(|(a, b)| (a.1 <= level) != (b.1 <= level)).map(|(a, b)| {
                        (a.0 + (level - a.1) / (b.1 - a.1) * (b.0 - a.0), if a.1 < b.1 { 1 } else { -1 })
                    }),
                );
                crossings.sort_by(|a: &(f64, i32), b| a.0.total_cmp(&b.0));
                let mut winding = 0;
                for pair in crossings.windows(2) {
                    winding += pair[0].1;
                    if winding != 0 {
                        self.span(y, pair[0].0, pair[1].0);
                    }
                }
            }
        }
    }

    /// One scan line of an area.
    fn span(&mut self, y: usize, from: f64, to: f64) {
        let (left, right) = (index(from.floor()), index(to.ceil()).min(self.width));
        for x in left..right {
            let covered = to.min(x as f64 + 1.0) - from.max(x as f64);
            if let Some(cover) = self.cover.get_mut(y * self.width + x) {
                *cover = (*cover + narrow(covered.max(0.0) / f64::from(SCANS))).min(1.0);
            }
        }
        self.touch(left, y, right, y + 1);
    }

    /// Paints an image, each pixel the colour of the square that holds its centre.
    pub(super) fn paint_image(&mut self, image: &Image) {
        let Frame { left, top, right, bottom } = image.frame;
        let [left, top, right, bottom] = [left, top, right, bottom].map(|px| px * DENSITY);
        let rows = image.rows();
        for y in index(top.round())..index(bottom.round()).min(self.height) {
            let row = index((y as f64 + 0.5 - top) / (bottom - top) * rows as f64).min(rows.saturating_sub(1));
            for x in index(left.round())..index(right.round()).min(self.width) {
                let column = index((x as f64 + 0.5 - left) / (right - left) * image.columns as f64);
                let colour = image.colours.get(row * image.columns + column.min(image.columns.saturating_sub(1)));
                let at = 3 * (y * self.width + x);
                if let (Some((r, g, b)), Some(pixel)) = (colour, self.data.get_mut(at..at + 3)) {
                    pixel.copy_from_slice(&[*r, *g, *b]);
                }
            }
        }
    }

    /// Covers a glyph, its base point at `at` of the line.
    fn glyph(&mut self, line: &TextLine, font: &FontRef<'static>, id: GlyphId, em: f64, at: Px) {
        let units_per_em = f64::from(font.units_per_em().unwrap_or(2048.0));
        let scale = PxScale::from(narrow(em * f64::from(font.height_unscaled()) / units_per_em));
        let glyph = id.with_scale_and_position(scale, point(narrow(at.0), narrow(at.1)));
        let Some(outline) = font.outline_glyph(glyph) else { return };
        let bounds = outline.px_bounds();
        outline.draw(|column, row, share| {
            let right = f64::from(bounds.min.x) + f64::from(column);
            let down = f64::from(bounds.min.y) + f64::from(row);
            self.raise_on(line, (right, down), f64::from(share));
        });
    }

    /// Covers what stands for a character that the font lacks.
    fn code_box(&mut self, line: &TextLine, font: &FontRef<'static>, code: &CodeBox, em: f64, (along, base): Px) {
        let digits = CodeBox::DIGIT_EM * em;
        let padding = CodeBox::PADDING_EM * em;
        let high = CAP_HEIGHT_EM * digits;
        let left = along + CodeBox::SIDE_EM * em;
        let bottom = base + 0.14 * em;
        let top = bottom - 2.0 * high - 3.0 * padding;
        let right = left + code.width_em() * em;
        for (row, text) in code.rows.iter().enumerate() {
            let base = top + (row as f64 + 1.0) * (high + padding);
            for (i, digit) in text.chars().enumerate() {
                let at = left + padding + i as f64 * CodeBox::DIGIT_ADVANCE_EM * em;
                self.glyph(line, font, font.glyph_id(digit), digits, (at, base));
            }
        }
        let [left, top, right, bottom] = [left, top, right, bottom].map(f64::round);
        let mut column = left;
        while column < right {
            let mut row = top;
            while row < bottom {
                if column == left || column == right - 1.0 || row == top || row == bottom - 1.0 {
                    self.raise_on(line, (column, row), 1.0);
                }
                row += 1.0;
            }
            column += 1.0;
        }
    }

    /// Raises the cover of the pixel whose upper left corner is at `(right, down)` of a line.
    fn raise_on(&mut self, line: &TextLine, (right, down): Px, share: f64) {
        let (dx, dy) = match line.transform {
            FontTransform::None => (right, down),
            FontTransform::Rotate90 => (-down - 1.0, right),
            FontTransform::Rotate180 => (-right - 1.0, -down - 1.0),
            FontTransform::Rotate270 => (down, -right - 1.0),
        };
        let corner = (line.at.0 + dx, line.at.1 + dy);
        if corner.0 >= 0.0 && corner.1 >= 0.0 {
            self.raise(corner, (corner.0 + 1.0, corner.1 + 1.0), |_| share);
        }
    }

    /// Paints what is covered and forgets it.
    fn paint(&mut self, colour: BackendColor) {
        let [left, top, right, bottom] = self.touched;
        self.touched = [usize::MAX, usize::MAX, 0, 0];
        let (r, g, b) = colour.rgb;
        for y in top..bottom.min(self.height) {
            for x in left..right.min(self.width) {
                let at = y * self.width + x;
                let Some(cover) = self.cover.get_mut(at) else { continue };
                let share = *cover * narrow(colour.alpha);
                *cover = 0.0;
                if share > 0.0
                    && let Some(pixel) = self.data.get_mut(3 * at..3 * at + 3)
                {
                    for (old, new) in pixel.iter_mut().zip([r, g, b]) {
                        *old = byte(f32::from(*old) + share * (f32::from(new) - f32::from(*old)));
                    }
                }
            }
        }
    }
}

impl DrawingBackend for Pixels {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let units = |pixels: usize| u32::try_from(index(pixels as f64 * UNITS)).unwrap_or(u32::MAX);
        (units(self.width), units(self.height))
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        let (x, y) = pixel(point);
        self.raise((x - 0.5, y - 0.5), (x + 0.5, y + 0.5), |_| 1.0);
        self.paint(color);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, a: BackendCoord, b: BackendCoord, style: &S, fill: bool) -> Drawn {
        let corners = [a, (b.0, a.1), b, (a.0, b.1)];
        if fill { self.fill_polygon(corners, style) } else { self.draw_path(corners.into_iter().chain([a]), style) }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        let width = f64::from(style.stroke_width()) / UNITS;
        let mut last = None;
        for at in path.into_iter().map(pixel) {
            if let Some(last) = last {
                self.stroke(last, at, width);
            }
            last = Some(at);
        }
        self.paint(style.color());
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, center: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        let (centre, radius) = (pixel(center), f64::from(radius) / UNITS);
        let half = if fill { 0.0 } else { 0.5 * f64::from(style.stroke_width()) / UNITS };
        let reach = radius + half + 1.0;
        let (low, high) = ((centre.0 - reach, centre.1 - reach), (centre.0 + reach, centre.1 + reach));
        self.raise(low, high, |p| {
            let distance = length((p.0 - centre.0, p.1 - centre.1));
            if fill { radius + 0.5 - distance } else { half + 0.5 - (distance - radius).abs() }
        });
        self.paint(style.color());
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        let outline: Vec<Px> = path.into_iter().map(pixel).collect();
        self.fill(&outline);
        self.paint(style.color());
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, pos: BackendCoord) -> Drawn {
        let Some(font) = font::font() else { return Ok(()) };
        let em = em_units(style.size()) / UNITS;
        let width = font::width_px(text, em);
        let mut along = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * width,
            HPos::Right => -width,
        };
        // All text is anchored at half the height of its small letters. Turned text has to start on a whole pixel.
        let (x, y) = pixel(pos);
        let line = TextLine { at: (x.round(), y.round()), transform: style.transform() };
        let base = HALF_X_HEIGHT_EM * em;
        for c in text.chars() {
            match font::glyph(font, c) {
                Some(id) => self.glyph(&line, font, id, em, (along, base)),
                None => self.code_box(&line, font, &CodeBox::of(c), em, (along, base)),
            }
            along += font::char_advance_em(font, c) * em;
        }
        self.paint(style.color());
        Ok(())
    }
}

fn pixel((x, y): BackendCoord) -> Px {
    (f64::from(x) / UNITS, f64::from(y) / UNITS)
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a cast saturates: left of the figure is column 0
fn index(value: f64) -> usize {
    value as usize
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 to 255 by construction; a cast saturates
fn byte(value: f32) -> u8 {
    value.round() as u8
}

#[allow(clippy::cast_possible_truncation)] // seven digits are plenty for a pixel
fn narrow(value: f64) -> f32 {
    value as f32
}
