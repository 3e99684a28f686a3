//! The picture of the document, in a canvas of its own below the window's: it is seen as soon as it has
//! come, and a window that a processor draws need not draw it.

use std::cell::RefCell;

use eframe::egui;
use wasm_bindgen::{Clamped, JsCast};
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, ImageData};
use web_time::Instant;

use crate::engine::{Face, Picture};

/// The canvas.
struct Pane {
    canvas: HtmlCanvasElement,
    context: CanvasRenderingContext2d,
    /// The wish of the picture in it, whether that is whole, and since when it is there.
    shown: Option<(u64, bool, Instant)>,
    /// Width and height of the picture at rest, to which its place fits.
    size: Option<[u32; 2]>,
    /// How it is placed.
    style: String,
}

thread_local! {
    static PANE: RefCell<Option<Pane>> = RefCell::new(Pane::find());
}

/// The canvas in the page.
const NAME: &str = "picture";

impl Pane {
    fn find() -> Option<Self> {
        let document = web_sys::window()?.document()?;
        let canvas: HtmlCanvasElement = document.get_element_by_id(NAME)?.dyn_into().ok()?;
        let context = canvas.get_context("2d").ok()??.dyn_into().ok()?;
        Some(Self { canvas, context, shown: None, size: None, style: String::new() })
    }

    /// Shows a picture, if it is not there; returns since when it is.
    fn show(&mut self, picture: &Picture) -> Option<Instant> {
        let Face::Pixels(pixels) = &picture.face else { return None };
        let own = (picture.serial, picture.whole);
        if let Some((serial, whole, since)) = self.shown
            && (serial, whole) == own
        {
            return Some(since);
        }
        let [width, height] = pixels.size.map(|n| n as u32);
        let bytes: Vec<u8> = pixels.pixels.iter().flat_map(|p| p.to_srgba_unmultiplied()).collect();
        let image = ImageData::new_with_u8_clamped_array_and_sh(Clamped(&bytes), width, height);
        if [self.canvas.width(), self.canvas.height()] != [width, height] {
            self.canvas.set_width(width);
            self.canvas.set_height(height);
        }
        self.context.put_image_data(&image.ok()?, 0.0, 0.0).ok()?;
        let now = Instant::now();
        self.shown = Some((own.0, own.1, now));
        self.size = Some(picture.settings.image.size);
        Some(now)
    }
}

/// Shows a picture that has come before the window is drawn again, if it fits the place of the last
/// one.
pub(super) fn show_early(picture: &Picture) {
    PANE.with_borrow_mut(|pane| {
        if let Some(pane) = pane
            && pane.size == Some(picture.settings.image.size)
        {
            pane.show(picture);
        }
    });
}

/// Shows a picture below the window; returns since when it is there.
pub fn show_below(picture: &Picture) -> Option<Instant> {
    PANE.with_borrow_mut(|pane| pane.as_mut()?.show(picture))
}

/// Places what is below the window, so that its pixels are those of the screen where there are as many.
pub fn place_below(rect: egui::Rect, context: &egui::Context) {
    let scale = context.pixels_per_point();
    // Lengths in style sheets do not know of egui's own zoom.
    let unit = f64::from(context.zoom_factor() / scale);
    let [left, top, width, height] = [rect.min.x, rect.min.y, rect.width(), rect.height()]
        .map(|length| f64::from((length * scale).round()) * unit);
    let style = format!("left:{left}px;top:{top}px;width:{width}px;height:{height}px");
    PANE.with_borrow_mut(|pane| {
        if let Some(pane) = pane
            && pane.style != style
            && pane.canvas.set_attribute("style", &style).is_ok()
        {
            pane.style = style;
        }
    });
}
