//! Labelled contact sheets: pictures side by side, each with its name.

use std::convert::Infallible;

use embedded_graphics::mono_font::ascii::FONT_9X18;
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Gray8;
use embedded_graphics::prelude::{Drawable, GrayColor, OriginDimensions, Pixel, Point, Size};
use embedded_graphics::text::{Alignment, Text};

const FONT: MonoFont<'_> = FONT_9X18;
const LABEL_HEIGHT: u32 = 30;
const GAP: u32 = 8;
const PAPER: u8 = 24;

/// A grid of equal cells, each a picture with a label below it; 8-bit sRGB.
pub(super) struct Sheet {
    cell: [u32; 2],
    width: u32,
    height: u32,
    rgb: Vec<u8>,
}

impl Sheet {
    /// `columns` x `rows` empty cells for pictures of `cell` pixels.
    pub(super) fn new(columns: u32, rows: u32, cell: [u32; 2]) -> Self {
        let width = GAP + columns * (cell[0] + GAP);
        let height = GAP + rows * (cell[1] + LABEL_HEIGHT);
        Self { cell, width, height, rgb: vec![PAPER; 3 * width as usize * height as usize] }
    }

    /// Draws a picture (8-bit RGBA from [`crate::image::Image::to_srgb8`], over black) and its
    /// label into a cell.
    pub(super) fn put(&mut self, column: u32, row: u32, rgba: &[u8], label: &str) {
        let (left, top) =
            (GAP + column * (self.cell[0] + GAP), GAP + row * (self.cell[1] + LABEL_HEIGHT));
        for (i, pixel) in rgba.chunks_exact(4).enumerate() {
            let (x, y) = (left + i as u32 % self.cell[0], top + i as u32 / self.cell[0]);
            let at = 3 * (y as usize * self.width as usize + x as usize);
            let over_black = |c: u8| (u16::from(c) * u16::from(pixel[3]) / 255) as u8;
            if let Some(target) = self.rgb.get_mut(at..at + 3) {
                target.copy_from_slice(&[pixel[0], pixel[1], pixel[2]].map(over_black));
            }
        }
        let style = MonoTextStyle::new(&FONT, Gray8::new(225));
        let middle = Point::new((left + self.cell[0] / 2) as i32, (top + self.cell[1] + 19) as i32);
        let _: Result<Point, Infallible> =
            Text::with_alignment(label, middle, style, Alignment::Center).draw(self);
    }

    /// The sheet as a picture of (width, height, RGB).
    pub(super) fn into_rgb(self) -> (u32, u32, Vec<u8>) {
        (self.width, self.height, self.rgb)
    }
}

impl OriginDimensions for Sheet {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl embedded_graphics::draw_target::DrawTarget for Sheet {
    type Color = Gray8;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Gray8>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for Pixel(point, grey) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(point.x), u32::try_from(point.y)) else { continue };
            if x < self.width && y < self.height {
                let at = 3 * (y as usize * self.width as usize + x as usize);
                self.rgb[at..at + 3].fill(grey.luma());
            }
        }
        Ok(())
    }
}
