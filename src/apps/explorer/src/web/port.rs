//! What pages and workers tell each other: text, and what must not be copied into text.

use std::sync::Arc;

use deepshadow::image::{Image, Tone};
use eframe::egui;
use js_sys::{Array, Float32Array, Uint8Array};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use wasm_bindgen::{JsCast, JsValue};

use crate::document::Document;
use crate::engine::truth::{Answer, Question};
use crate::engine::worker::Part;
use crate::engine::{Doing, Event, Face, Wish};

/// What a page tells a worker.
#[derive(Debug, Deserialize, Serialize)]
pub enum Order {
    /// Take a GPU, if there is one.
    Gpu,
    /// Files of these names come with it.
    Mount(Vec<String>),
    /// Open what a name stands for.
    Open(String),
    /// Draw this.
    Wish {
        /// Its number.
        serial: u64,
        /// It.
        wish: Box<Wish>,
        /// What is drawn of it.
        part: Part,
    },
    /// A whole picture of a side was shown so.
    Tone(usize, Tone),
    /// Answer a question about the whole picture of a wish.
    Ask {
        /// The number of the question.
        number: u64,
        /// The number of the wish.
        serial: u64,
        /// The question.
        question: Question,
    },
    /// No question before this number needs an answer.
    Quiet(u64),
    /// What was wished for is not wanted any more.
    GiveUp,
}

/// What a worker tells the page.
#[derive(Debug, Deserialize, Serialize)]
pub enum Report {
    /// It has taken a GPU, or there is none: what it is, and whether it is hardware.
    Gpu(Result<(String, bool), String>),
    /// What the engine tells; pixels come with it.
    Event(Event),
    /// What a name stands for, or why it cannot be opened.
    Opened(String, Result<Box<Document>, String>),
    /// What is being done.
    Doing(Option<Doing>),
    /// An answer to the question of this number; pixels come with it.
    Answer(u64, Answer),
    /// As many orders are done.
    Done(u64),
}

/// A message of a text and what comes with it.
///
/// # Errors
/// If it cannot be written as text.
pub fn packed<T: Serialize>(message: &T, parts: &[JsValue]) -> Result<Array, String> {
    let text = serde_json::to_string(message).map_err(|error| error.to_string())?;
    let all = Array::of1(&JsValue::from_str(&text));
    for part in parts {
        all.push(part);
    }
    Ok(all)
}

/// A message, and what came with it.
///
/// # Errors
/// If it is none.
pub fn unpacked<T: DeserializeOwned>(data: JsValue) -> Result<(T, Vec<JsValue>), String> {
    let all: Array = data.dyn_into().map_err(|_| "a message is no list".to_owned())?;
    let text = all.get(0).as_string().ok_or("a message without text")?;
    let message = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    Ok((message, all.iter().skip(1).collect()))
}

/// Packs a report with its pixels; also returns what is handed over instead of being copied.
///
/// # Errors
/// If it cannot be written as text.
pub fn reported(report: &Report) -> Result<(Array, Array), String> {
    let mut parts: Vec<JsValue> = Vec::new();
    match report {
        Report::Event(Event::Picture(picture)) => {
            if let Face::Pixels(face) = &picture.face {
                push_pixels(&mut parts, face);
            }
            if let (Some(image), true) = (&picture.image, picture.whole) {
                let values: &[f32] = bytemuck::cast_slice(&image.pixels);
                parts.push(Float32Array::from(values).into());
            }
        }
        Report::Answer(_, Answer::Difference(difference)) => {
            push_pixels(&mut parts, &difference.heat);
        }
        Report::Answer(_, Answer::Curves(drawn)) => push_pixels(&mut parts, &drawn.map),
        _ => {}
    }
    let buffers = parts.iter().filter_map(|part| {
        let bytes = part.dyn_ref::<Uint8Array>().map(Uint8Array::buffer);
        bytes.or_else(|| part.dyn_ref::<Float32Array>().map(Float32Array::buffer))
    });
    let handed: Array = buffers.collect();
    Ok((packed(report, &parts)?, handed))
}

/// Unpacks a report with its pixels.
///
/// # Errors
/// If it is none.
pub fn received(data: JsValue) -> Result<Report, String> {
    let (mut report, parts) = unpacked::<Report>(data)?;
    match &mut report {
        Report::Event(Event::Picture(picture)) => {
            let pixels = taken_pixels(&parts).ok_or("a picture without pixels")?;
            picture.face = Face::Pixels(pixels);
            if let Some(values) = parts.get(2).and_then(|part| part.dyn_ref::<Float32Array>()) {
                let mut pixels = vec![[0.0_f32; 4]; values.length() as usize / 4];
                let flat: &mut [f32] = bytemuck::cast_slice_mut(&mut pixels);
                if flat.len() == values.length() as usize {
                    values.copy_to(flat);
                }
                let [width, height] = picture.size;
                picture.image = Some(Arc::new(Image { width, height, pixels }));
            }
        }
        Report::Answer(_, Answer::Difference(difference)) => {
            difference.heat = taken_pixels(&parts).ok_or("an answer without pixels")?;
        }
        Report::Answer(_, Answer::Curves(drawn)) => {
            drawn.map = taken_pixels(&parts).ok_or("an answer without pixels")?;
        }
        _ => {}
    }
    Ok(report)
}

/// Adds the width and the bytes of pixels.
fn push_pixels(parts: &mut Vec<JsValue>, pixels: &egui::ColorImage) {
    parts.push((pixels.size[0] as f64).into());
    parts.push(Uint8Array::from(pixels.as_raw()).into());
}

/// The pixels that come first.
fn taken_pixels(parts: &[JsValue]) -> Option<egui::ColorImage> {
    let width = parts.first()?.as_f64()? as usize;
    let bytes = parts.get(1)?.dyn_ref::<Uint8Array>()?.to_vec();
    let height = (bytes.len() / 4).checked_div(width).unwrap_or(0);
    (bytes.len() == 4 * width * height)
        .then(|| egui::ColorImage::from_rgba_premultiplied([width, height], &bytes))
}
