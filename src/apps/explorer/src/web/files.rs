//! The files that people choose, and those that the browser saves.

use std::cell::RefCell;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

use deepshadow::io::{FileSource, Inputs, is_scene_file};
use deepshadow::{Error, Result};
use eframe::egui::Ui;
use js_sys::{Array, Uint8Array};
use wasm_bindgen::JsCast;
use web_sys::{Blob, BlobPropertyBag, File, FileReaderSync, HtmlAnchorElement, Url};

use super::engine::hands;
use super::threads::sleep;
use crate::explorer::Explorer;

thread_local! {
    /// Texts that people chose.
    static TEXTS: RefCell<HashMap<PathBuf, String>> = RefCell::default();
}

/// How long a browser may take to begin to save something, in milliseconds.
const SAVED: i32 = 60_000;

/// A file that somebody chose, for a worker, which reads parts of it when they are needed.
pub struct Chosen {
    file: File,
    reader: Option<FileReaderSync>,
}

impl Chosen {
    /// Of a browser's file.
    pub fn new(file: File) -> Self {
        Self { file, reader: FileReaderSync::new().ok() }
    }
}

impl FileSource for Chosen {
    fn length(&self) -> u64 {
        self.file.size() as u64
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
        let failed = |_| io::Error::other("the browser does not read it any more");
        let begin = offset.min(self.length());
        let end = (begin + bytes.len() as u64).min(self.length());
        let count = (end - begin) as usize;
        let part = self.file.slice_with_f64_and_f64(begin as f64, end as f64).map_err(failed)?;
        let reader = self.reader.as_ref().ok_or_else(|| io::Error::other("needs a worker"))?;
        let buffer = reader.read_as_array_buffer(&part).map_err(failed)?;
        let read = Uint8Array::new(&buffer);
        if read.length() as usize != count {
            return Err(io::Error::other("the browser read another number of bytes"));
        }
        read.copy_to(&mut bytes[..count]);
        Ok(count)
    }
}

/// Keeps a text that somebody chose.
pub(super) fn keep_text(path: &Path, text: String) {
    TEXTS.with_borrow_mut(|texts| texts.insert(path.to_owned(), text));
}

/// The text of a file that was chosen.
///
/// # Errors
/// If it was not.
pub fn read_text(path: &Path) -> Result<String> {
    let text = TEXTS.with_borrow(|texts| texts.get(path).cloned());
    text.ok_or_else(|| Error::contents(path, "is not among the files that were chosen"))
}

/// Lets the browser save what `make` makes, among what it downloads.
///
/// # Errors
/// None.
pub fn write(
    path: PathBuf,
    _inputs: impl FnOnce() -> Inputs + Send + 'static,
    make: impl FnOnce() -> Result<Vec<u8>> + Send + 'static,
    done: impl FnOnce(Result<String>) + Send + 'static,
) -> io::Result<()> {
    let name = path.file_name().map_or_else(|| "picture".into(), |name| name.to_string_lossy());
    done(make().and_then(|contents| {
        let kept = download(&name, &contents);
        let kept = kept.ok_or_else(|| Error::value("picture", "the browser saves no files"));
        kept.map(|()| format!("{name} is in the browser's downloads"))
    }));
    Ok(())
}

/// Lets the browser save bytes under a name.
pub(super) fn download(name: &str, contents: &[u8]) -> Option<()> {
    let document = web_sys::window()?.document()?;
    let bytes = Uint8Array::from(contents);
    let options = BlobPropertyBag::new();
    options.set_type("application/octet-stream");
    let parts = Array::of1(&bytes);
    let blob = Blob::new_with_u8_array_sequence_and_options(&parts, &options).ok()?;
    let address = Url::create_object_url_with_blob(&blob).ok()?;
    let link: HtmlAnchorElement = document.create_element("a").ok()?.dyn_into().ok()?;
    link.set_href(&address);
    link.set_download(name);
    link.click();
    wasm_bindgen_futures::spawn_local(async move {
        sleep(SAVED).await;
        let _ = Url::revoke_object_url(&address);
    });
    Some(())
}

/// Takes files, and opens the one that leads to the others.
pub(super) fn take(explorer: &mut Explorer, files: Vec<File>) {
    let files: Vec<(String, File)> = files.into_iter().map(|file| (file.name(), file)).collect();
    let Some(hands) = hands().filter(|_| !files.is_empty()) else { return };
    hands.mount(&files);
    let first = files.iter().map(|(name, _)| name).min_by_key(|name| rank(name));
    if let Some(name) = first {
        explorer.open(name);
    }
}

/// Scenes name other files, and headers do: which of several files is opened.
fn rank(name: &str) -> u32 {
    let path = Path::new(name);
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match &*ending {
        _ if is_scene_file(path) => 0,
        "mhd" | "nhdr" | "hdr" | "obj" | "gltf" => 1,
        "mtl" | "bin" | "raw" | "zraw" | "img" | "png" | "jpg" | "jpeg" | "json" => 3,
        _ => 2,
    }
}

/// Opens what was dropped on the page.
pub fn dropped(explorer: &mut Explorer, ui: &Ui) {
    let dropped = ui.input(|input| input.raw.dropped_files.clone());
    let files = dropped.iter().filter_map(|file| file.web_file().cloned()).collect();
    take(explorer, files);
}
