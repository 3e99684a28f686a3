//! The lines of scripts.

use std::path::PathBuf;

use eframe::egui;

use crate::engine::Device;

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Line {
    Open(String),
    Window([f32; 2]),
    Drag { of_light: bool, by: [f64; 2], steps: u32 },
    Pan([f64; 2]),
    Zoom(f64),
    Frame,
    FrameAt(i64),
    LookFromLight,
    Set(String, String),
    Unset(String),
    Device(Device),
    Budget(f64),
    Panels(bool),
    Help(bool),
    Theme(egui::Theme),
    Section(String),
    Compare(bool),
    Wiper(f32),
    Heat(bool),
    Curves([f64; 2]),
    AllKinds(bool),
    Wait,
    Screenshot(PathBuf),
    Picture(PathBuf),
    Scene(PathBuf),
}

/// A line without its comment. A `#` within quotes is none, nor one within a word.
pub(super) fn uncommented(line: &str) -> &str {
    let mut quoted = false;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match c {
            '"' | '\'' => quoted = !quoted,
            '#' if !quoted && before.is_whitespace() => return line[..at].trim(),
            _ => {}
        }
        before = c;
    }
    line.trim()
}

pub(super) fn parse(line: &str) -> Result<Line, String> {
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let rest = rest.trim();
    let number =
        |text: &str| text.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or("needs numbers");
    let numbers = |text: &str| {
        let all = text.split_whitespace().map(number);
        all.collect::<Result<Vec<f64>, _>>()
    };
    let pair = |text: &str| match numbers(text)?[..] {
        [x, y] => Ok([x, y]),
        _ => Err("needs two numbers"),
    };
    let on = |text: &str| match text {
        "on" | "" => Ok(true),
        "off" => Ok(false),
        _ => Err("needs on or off"),
    };
    let path = |text: &str| {
        if text.is_empty() { Err("needs a file") } else { Ok(PathBuf::from(text)) }
    };
    Ok(match (word, rest) {
        ("open", "") => return Err("needs an input".to_owned()),
        ("open", input) => Line::Open(input.to_owned()),
        ("window", size) => {
            let size = pair(size)?;
            if size.iter().any(|n| !(64.0..=16384.0).contains(n)) {
                return Err("needs a width and a height from 64 to 16384".to_owned());
            }
            Line::Window(size.map(|n| n as f32))
        }
        ("drag", rest) => {
            let (what, rest) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let of_light = match what {
                "light" => true,
                "camera" => false,
                _ => return Err("drags neither camera nor light".to_owned()),
            };
            match numbers(rest)?[..] {
                [x, y] => Line::Drag { of_light, by: [x, y], steps: 1 },
                [x, y, steps] if (1.0..=1e5).contains(&steps) => {
                    Line::Drag { of_light, by: [x, y], steps: steps as u32 }
                }
                _ => return Err("needs two shares and a number of steps".to_owned()),
            }
        }
        ("pan", by) => Line::Pan(pair(by)?),
        ("zoom", by) => Line::Zoom(number(by)?),
        ("frame", "") => Line::Frame,
        ("frame", number) => {
            Line::FrameAt(number.parse().map_err(|_| "needs a frame's number".to_owned())?)
        }
        ("look", "from light") => Line::LookFromLight,
        ("set", rest) => {
            let (key, value) = rest.split_once(char::is_whitespace).ok_or("needs key and value")?;
            Line::Set(key.to_owned(), value.trim().to_owned())
        }
        ("unset", key) => Line::Unset(key.to_owned()),
        ("device", name) => {
            Line::Device(name.parse().map_err(|_| "is not one of auto, gpu, cpu".to_owned())?)
        }
        ("budget", milliseconds) => Line::Budget(number(milliseconds)?.clamp(1.0, 1e5)),
        ("panels", word) => Line::Panels(on(word)?),
        ("help", word) => Line::Help(on(word)?),
        ("theme", "light") => Line::Theme(egui::Theme::Light),
        ("theme", "dark") => Line::Theme(egui::Theme::Dark),
        ("section", name) if crate::panels::SECTIONS.contains(&name) => {
            Line::Section(name.to_owned())
        }
        ("section", _) => {
            return Err(format!("names none of {}", crate::panels::SECTIONS.join(", ")));
        }
        ("compare", word) => Line::Compare(on(word)?),
        ("wiper", share) => Line::Wiper(number(share)?.clamp(0.0, 1.0) as f32),
        ("heat", word) => Line::Heat(on(word)?),
        ("curves", at) => Line::Curves(pair(at)?),
        ("all", rest) if rest.starts_with("kinds") => {
            Line::AllKinds(on(rest.trim_start_matches("kinds").trim())?)
        }
        ("wait", "") => Line::Wait,
        ("screenshot", file) if !file.to_ascii_lowercase().ends_with(".png") => {
            return Err("needs a file that ends in .png".to_owned());
        }
        ("screenshot", file) => Line::Screenshot(path(file)?),
        ("picture", file) => Line::Picture(path(file)?),
        ("scene", file) => Line::Scene(path(file)?),
        _ => return Err("is no command".to_owned()),
    })
}
