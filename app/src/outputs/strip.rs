//! A strip of labelled pictures side by side, for the demo.

use embedded_graphics::{
    mono_font::{MonoTextStyle, ascii::FONT_9X15},
    pixelcolor::BinaryColor,
    prelude::{DrawTarget, OriginDimensions, Pixel, Point, Size},
    text::{Alignment, Text},
};
use lookalike::image::Image;
use std::convert::Infallible;

/// One picture of the strip: linear Rec. 709, already exposed.
#[derive(Debug)]
pub(crate) struct Panel<'a> {
    pub(crate) image: &'a Image,
    /// Lines of text below it.
    pub(crate) label: [String; 3],
}

const MARGIN: usize = 12;
const LABEL_HEIGHT: usize = 62;
/// Linear grey values of the background and the text.
const GROUND: f32 = 0.006;
const INK: f32 = 0.7;

/// Draws the strip.
pub(crate) fn strip(panels: &[Panel<'_>]) -> Image {
    let height = panels.iter().map(|p| p.image.height()).max().unwrap_or(0);
    let width = panels.iter().map(|p| p.image.width() + MARGIN).sum::<usize>() + MARGIN;
    let mut canvas = Canvas { image: Image::new(width, height + LABEL_HEIGHT + 2 * MARGIN) };
    canvas.image.pixels_mut().fill([GROUND; 3]);
    let style = MonoTextStyle::new(&FONT_9X15, BinaryColor::On);
    let mut left = MARGIN;
    for panel in panels {
        canvas.paste(panel.image, left, MARGIN);
        let centre = left + panel.image.width() / 2;
        for (line, text) in panel.label.iter().enumerate() {
            let baseline = MARGIN + height + 20 + line * 18;
            let at = Point::new(i32::try_from(centre).unwrap_or(0), i32::try_from(baseline).unwrap_or(0));
            // Drawing on this canvas cannot fail.
            let Ok(_) = embedded_graphics::Drawable::draw(
                &Text::with_alignment(text, at, style, Alignment::Center),
                &mut canvas,
            );
        }
        left += panel.image.width() + MARGIN;
    }
    canvas.image
}

struct Canvas {
    image: Image,
}

impl Canvas {
    fn paste(&mut self, image: &Image, left: usize, top: usize) {
        let width = self.image.width();
        for row in 0..image.height() {
            let from = &image.pixels()[row * image.width()..][..image.width()];
            self.image.pixels_mut()[(top + row) * width + left..][..image.width()].copy_from_slice(from);
        }
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Size::new(side(self.image.width()), side(self.image.height()))
    }
}

impl DrawTarget for Canvas {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<BinaryColor>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        let (width, height) = (self.image.width(), self.image.height());
        for Pixel(point, colour) in pixels {
            let (Ok(x), Ok(y)) = (usize::try_from(point.x), usize::try_from(point.y)) else { continue };
            if colour == BinaryColor::On && x < width && y < height {
                self.image.pixels_mut()[y * width + x] = [INK; 3];
            }
        }
        Ok(())
    }
}
