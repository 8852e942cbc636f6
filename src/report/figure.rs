//! The figure: a list of marks in pixels, laid out once and then played to a plotters backend.

use std::collections::BTreeSet;

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoFont, RGBAColor, RGBColor, ShapeStyle, TextStyle};
use plotters_backend::DrawingErrorKind;

use super::curve::{Frame, Px, dashed, thinned};
use super::font;
use super::marks::{Anchor, Image, Mark, PLOTTERS_FONT_SCALE, TextFormat, UNITS_PER_PX};
use super::pixels::Pixels;
use super::style::{Colour, LineStyle, WHITE};

/// Size of every figure \[px\].
pub(super) const WIDTH_PX: f64 = 1200.0;
/// See [`WIDTH_PX`].
pub(super) const HEIGHT_PX: f64 = 800.0;

/// A backend that can show an image.
trait Canvas: DrawingBackend {
    fn image(&mut self, image: &Image) -> Result<(), DrawingErrorKind<Self::ErrorType>>;
}

impl Canvas for Pixels {
    fn image(&mut self, image: &Image) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.paint_image(image);
        Ok(())
    }
}

/// Stands in an SVG where an image goes: plotters knows no embedded ones. No mark has this colour.
const PLACEHOLDER: Colour = (1, 2, 3);

impl Canvas for SVGBackend<'_> {
    fn image(&mut self, image: &Image) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        let style = ShapeStyle { color: rgba(PLACEHOLDER), filled: true, stroke_width: 0 };
        let Frame { left, top, right, bottom } = image.frame;
        self.draw_rect(unit_point((left, top)), unit_point((right, bottom)), &style, true)
    }
}

/// What is to be drawn, in the order of drawing.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Figure {
    pub(super) marks: Vec<Mark>,
}

impl Figure {
    pub(super) fn line(&mut self, points: &[Px], line_style: LineStyle) {
        let LineStyle { colour, width_px, dash } = line_style;
        let pieces = match dash {
            Some(dash) => dashed(points, dash),
            None => vec![points.to_vec()],
        };
        for points in pieces.into_iter().filter(|points| points.len() > 1) {
            self.marks.push(Mark::Line { points, colour, width_px });
        }
    }

    /// A curve: thinned and clipped to `frame`.
    pub(super) fn curve(&mut self, points: &[Px], frame: &Frame, line_style: LineStyle) {
        for piece in frame.clipped(&thinned(points)) {
            self.line(&piece, line_style);
        }
    }

    pub(super) fn area(&mut self, points: Vec<Px>, colour: Colour) {
        self.marks.push(Mark::Area { points, colour });
    }

    pub(super) fn rectangle(&mut self, frame: &Frame, colour: Colour) {
        let Frame { left, top, right, bottom } = *frame;
        self.area(vec![(left, top), (right, top), (right, bottom), (left, bottom)], colour);
    }

    pub(super) fn dot(&mut self, at: Px, radius_px: f64, colour: Colour) {
        self.marks.push(Mark::Dot { at, radius_px, colour });
    }

    /// A circle with a white inside.
    pub(super) fn ring(&mut self, at: Px, radius_px: f64, width_px: f64, colour: Colour) {
        self.dot(at, radius_px, colour);
        self.dot(at, radius_px - width_px, WHITE);
    }

    pub(super) fn text(&mut self, text: TextFormat) {
        if !text.text.is_empty() {
            self.marks.push(Mark::TextFormat(text));
        }
    }

    pub(super) fn image(&mut self, image: Image) {
        if !image.colours.is_empty() {
            self.marks.push(Mark::Image(image));
        }
    }

    /// The figure as an SVG document.
    pub(super) fn svg(&self) -> Result<Vec<u8>, String> {
        let mut out = String::new();
        let mut backend = SVGBackend::with_string(&mut out, (units_u(WIDTH_PX), units_u(HEIGHT_PX)));
        self.play(&mut backend).map_err(|error| error.to_string())?;
        drop(backend);
        let size = |scale: f64| format!("width=\"{}\" height=\"{}\"", WIDTH_PX * scale, HEIGHT_PX * scale);
        let head = format!("{} stroke-linejoin=\"round\" stroke-linecap=\"round\"", size(1.0));
        let images =
            self.marks.iter().filter_map(|mark| if let Mark::Image(image) = mark { Some(image) } else { None });
        for image in images {
            // The next placeholder's element, from its `<` to its `>`.
            let colour = format!("fill=\"#{:02X}{:02X}{:02X}\"", PLACEHOLDER.0, PLACEHOLDER.1, PLACEHOLDER.2);
            let found =
                out.find(&colour).and_then(|at| Some((out.get(..at)?.rfind('<')?, at + out.get(at..)?.find('>')?)));
            let (from, to) = found.ok_or("an image has lost its place")?;
            out.replace_range(from..=to, &embedded(image)?);
        }
        Ok(out.replacen(&size(UNITS_PER_PX), &head, 1).into_bytes())
    }

    /// The figure as a PNG file, two pixels a pixel.
    pub(super) fn png(&self) -> Result<Vec<u8>, String> {
        let mut pixels = Pixels::new(WIDTH_PX, HEIGHT_PX);
        self.play(&mut pixels).map_err(|error| error.to_string())?;
        pixels.encode().map_err(|error| error.to_string())
    }

    fn play<B: Canvas>(&self, backend: &mut B) -> Result<(), DrawingErrorKind<B::ErrorType>> {
        let filled = |colour| ShapeStyle { color: rgba(colour), filled: true, stroke_width: 0 };
        backend.ensure_prepared()?;
        backend.draw_rect((0, 0), unit_point((WIDTH_PX, HEIGHT_PX)), &filled(WHITE), true)?;
        for mark in &self.marks {
            match mark {
                Mark::Line { points, colour, width_px } => {
                    let stroke_width = units_u(*width_px).max(1);
                    let style = ShapeStyle { color: rgba(*colour), filled: false, stroke_width };
                    backend.draw_path(points.iter().copied().map(unit_point), &style)?;
                }
                Mark::Area { points, colour } => {
                    backend.fill_polygon(points.iter().copied().map(unit_point), &filled(*colour))?;
                }
                Mark::Dot { at, radius_px, colour } => {
                    backend.draw_circle(unit_point(*at), units_u(*radius_px), &filled(*colour), true)?;
                }
                Mark::Image(image) => backend.image(image)?,
                Mark::TextFormat(text) => {
                    let size = text.em_px * UNITS_PER_PX * PLOTTERS_FONT_SCALE;
                    let horizontal = match text.anchor {
                        Anchor::Left => HPos::Left,
                        Anchor::Middle => HPos::Center,
                        Anchor::Right => HPos::Right,
                    };
                    let turn = if text.upwards { FontTransform::Rotate270 } else { FontTransform::None };
                    let colour = rgba(text.colour);
                    let style = TextStyle::from((font::FAMILY, size).into_font())
                        .color(&colour)
                        .pos(Pos::new(horizontal, VPos::Center))
                        .transform(turn);
                    backend.draw_text(&text.text, &style, unit_point(text.at))?;
                }
            }
        }
        backend.present()
    }
}

/// The element of an image in an SVG.
fn embedded(image: &Image) -> Result<String, String> {
    let Frame { left, top, right, bottom } = image.frame;
    let [left, top, width, height] = [left, top, right - left, bottom - top].map(units);
    let png = encoded(image).map_err(|error| error.to_string())?;
    Ok(format!(
        "<image x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
        base64(&png)
    ))
}

/// An image of at most 256 colours as a PNG file with a palette, else in full colour.
fn encoded(image: &Image) -> Result<Vec<u8>, png::EncodingError> {
    let palette: BTreeSet<Colour> = image.colours.iter().copied().collect();
    let palette: Vec<Colour> = palette.into_iter().collect();
    let size = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, size(image.columns), size(image.rows()));
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Best);
    let place = |colour: &Colour| palette.binary_search(colour).ok().and_then(|at| u8::try_from(at).ok());
    let bytes = if let Some(bytes) = image.colours.iter().map(place).collect::<Option<Vec<u8>>>() {
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_filter(png::FilterType::NoFilter);
        encoder.set_palette(flat(&palette));
        bytes
    } else {
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_filter(png::FilterType::Paeth);
        flat(&image.colours)
    };
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(out)
}

fn flat(colours: &[Colour]) -> Vec<u8> {
    colours.iter().flat_map(|&(r, g, b)| [r, g, b]).collect()
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let byte = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let digit = (bits >> (18 - 6 * i)) & 63;
            let digit = DIGITS.get(digit as usize).copied().unwrap_or(b'A');
            out.push(if i <= three.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

fn rgba((r, g, b): Colour) -> RGBAColor {
    RGBColor(r, g, b).to_rgba()
}

fn unit_point((x, y): Px) -> (i32, i32) {
    (units(x), units(y))
}

#[allow(clippy::cast_possible_truncation)] // marks are clipped to the figure; a cast saturates
fn units(px: f64) -> i32 {
    (px * UNITS_PER_PX).round() as i32
}

fn units_u(px: f64) -> u32 {
    units(px).unsigned_abs()
}
