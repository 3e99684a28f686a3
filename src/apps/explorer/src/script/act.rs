//! Does what takes no time.

use std::time::Duration;

use deepshadow::scene::SceneFile;
use deepshadow::{Error, Result};

use super::line::Line;
use crate::document::check_numbers;
use crate::explorer::Explorer;
use crate::hands;
use crate::panels::Look;

/// Does what takes no time.
pub(super) fn act(explorer: &mut Explorer, line: Line) -> Result<()> {
    match line {
        Line::Pan(by) => move_camera(explorer, |camera| hands::pan(camera, by)),
        Line::Zoom(by) => move_camera(explorer, |camera| hands::zoom(camera, by)),
        Line::Frame => explorer.frame(),
        Line::FrameAt(frame) => {
            let document = explorer.document.as_mut();
            let frames = document.as_ref().and_then(|document| document.frames.clone());
            match (document, frames) {
                (Some(document), Some(frames)) if frames.contains(&frame) => document.frame = frame,
                _ => return Err(Error::value("frame", format!("there is no frame {frame}"))),
            }
        }
        Line::LookFromLight => explorer.look_from_light = true,
        Line::Set(key, value) => change(explorer, &key, Some(&value))?,
        Line::Unset(key) => change(explorer, &key, None)?,
        Line::Device(device) => explorer.device = device,
        Line::Budget(milliseconds) => {
            explorer.budget = Duration::from_secs_f64(milliseconds / 1e3);
        }
        Line::Panels(on) => explorer.panels = on,
        Line::Help(on) => explorer.help = on,
        Line::Theme(theme) => explorer.context().set_theme(theme),
        Line::Section(name) => explorer.toggled.push(name),
        Line::Compare(on) => {
            explorer.end_comparison();
            let document = explorer.document.take();
            if let (Some(document), true) = (&document, on) {
                explorer.compare(document);
            }
            explorer.document = document;
        }
        Line::Wiper(share) => explorer.wiper = share,
        Line::Heat(on) => explorer.looking.look = on.then_some(Look::Difference),
        Line::Curves(at) => {
            explorer.looking.look = Some(Look::Curves);
            explorer.looking.at = Some(at);
        }
        Line::AllKinds(on) => explorer.looking.all = on,
        _ => {}
    }
    Ok(())
}

fn move_camera(explorer: &mut Explorer, change: impl FnOnce(&mut deepshadow::scene::Camera)) {
    let Some(mut camera) = explorer.scene().map(|scene| scene.camera) else { return };
    change(&mut camera);
    if let Some(document) = &mut explorer.document {
        document.place_camera(&camera);
    }
}

/// Sets a key of the scene file to a TOML value, or removes it.
fn change(explorer: &mut Explorer, key: &str, value: Option<&str>) -> Result<()> {
    let Some(document) = &mut explorer.document else {
        return Err(Error::value("script", "nothing is open"));
    };
    document.file = changed(&document.file, key, value)?;
    Ok(())
}

/// The scene file with another value of a key, such as `shadow.map`.
///
/// # Errors
/// If there is no such key, or if the value is not one of it.
pub fn changed(file: &SceneFile, key: &str, value: Option<&str>) -> Result<SceneFile> {
    let wrong = |why: String| Error::value(key, why);
    let mut table = toml::Table::try_from(file).map_err(|error| wrong(error.to_string()))?;
    let mut names: Vec<&str> = key.split('.').collect();
    let last = names.pop().unwrap_or_default();
    let mut at = &mut table;
    for name in names {
        let entry = at.entry(name).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        // The first of several tables of one name.
        let entry = match entry {
            toml::Value::Array(tables) => tables.first_mut(),
            one => Some(one),
        };
        at = entry
            .and_then(toml::Value::as_table_mut)
            .ok_or_else(|| wrong(format!("'{name}' is no table")))?;
    }
    match value {
        None => _ = at.remove(last),
        Some(value) => {
            let parsed: toml::Table = toml::from_str(&format!("value = {value}"))
                .map_err(|error| wrong(format!("'{value}': {}", error.message())))?;
            let parsed = parsed.get("value").cloned();
            let parsed = parsed.ok_or_else(|| wrong("needs a value".to_owned()))?;
            at.insert(last.to_owned(), parsed);
        }
    }
    let file = table.try_into();
    let file: SceneFile =
        file.map_err(|error: toml::de::Error| wrong(error.message().to_owned()))?;
    check_numbers(&file)?;
    Ok(file)
}
