//! The command that makes the same picture.

use deepshadow::scene::file::{ExposureValue, GroundTable, TransferRange, TransferTable};
use deepshadow::scene::{Light, NumberedName, SceneFile};

use crate::document::Document;

/// The command that makes the picture of `document`, of a size in pixels; `None` if not all of it
/// can be said by options.
pub fn command(document: &Document, size: Option<[u32; 2]>) -> Option<String> {
    let (now, opened) = (&document.file, &document.opened);
    let mut said = opened.clone();
    let input = match (&document.frames, NumberedName::of(document.input.as_ref())) {
        (Some(_), Some(name)) => name.at(document.frame).display().to_string(),
        (Some(_), None) => return None,
        (None, _) => document.input.clone(),
    };
    let mut words = vec!["deepshadow".to_owned(), "render".to_owned(), quoted(&input)];
    if is_keyed(now) || is_keyed(opened) {
        // Options change more than a moment of a motion.
        return None;
    }
    let mut say = |option: &str, value: String| {
        // A value that begins like an option must not be taken for one.
        let between = if value.starts_with('-') { '=' } else { ' ' };
        words.push(format!("--{option}{between}{}", quoted(&value)));
    };
    // One volume and one light are what options speak of.
    if let ([table], [own]) = (&now.volume[..], &mut said.volume[..]) {
        set(table.density_scale.as_ref(), &mut own.density_scale, |x| {
            say("density-scale", real(*x));
        });
        set(table.phase_g.as_ref(), &mut own.phase_g, |x| say("phase", real(*x)));
        set(table.grid.as_ref(), &mut own.grid, |x| say("grid", x.clone()));
        set(table.clip.as_ref(), &mut own.clip, |x| say("clip", list(x.as_flattened())));
        set(table.window.as_ref(), &mut own.window, |x| say("window", list(&x.map(f64::from))));
        // These change surfaces too.
        if !now.has_surfaces() {
            set(table.albedo.as_ref(), &mut own.albedo, |x| say("albedo", list(x)));
            set(table.up.as_ref(), &mut own.up, |x| say("up", x.clone()));
        }
        transfer(table.transfer.as_ref(), &mut own.transfer, &mut say);
    }
    let light = now.light.first();
    if let (Some(light), 1) = (light, now.light.len()) {
        let is_parallel = light.kind.as_deref().is_none_or(|kind| kind == "directional");
        let own = said.light.one_mut();
        if is_parallel && light.direction.is_some() {
            set(light.direction.as_ref(), &mut own.direction, |x| say("light", list(x)));
            own.kind.clone_from(&light.kind);
        }
        if let Some(irradiance) = light.irradiance.filter(|_| light.irradiance != own.irradiance) {
            let colour = irradiance.map(|c| c / Light::UNIT_IRRADIANCE);
            if colour.map(|c| c * Light::UNIT_IRRADIANCE) == irradiance {
                say("light-color", list(&colour));
                own.irradiance = Some(irradiance);
            }
        }
    }
    camera(now, &mut said, &mut say);
    shadow(now, &mut said, &mut say);
    let (image, own) = (&now.image, &mut said.image);
    let [width, height] = size.unwrap_or([512, 512]);
    say("size", format!("{width}x{height}"));
    (own.width, own.height) = (image.width, image.height);
    set(image.samples.as_ref(), &mut own.samples, |x| say("samples", x.to_string()));
    set(image.tolerance.as_ref(), &mut own.tolerance, |x| say("picture-tolerance", real(*x)));
    set(image.tonemap.as_ref(), &mut own.tonemap, |x| say("tonemap", x.clone()));
    set(image.exposure.as_ref(), &mut own.exposure, |x| match x {
        ExposureValue::Factor(x) => say("exposure", real(*x)),
        ExposureValue::Text(text) => say("exposure", text.clone()),
    });
    ground(&now.ground, &mut said.ground, &mut say);
    set(now.background.radiance.as_ref(), &mut said.background.radiance, |x| {
        say("background", list(x));
    });
    if *now != said {
        return None;
    }
    let out = document.default_output("png");
    Some(format!("{} -o {}", words.join(" "), quoted(&out.display().to_string())))
}

/// Says a key if it differs and was not left out.
fn set<T: Clone + PartialEq>(now: Option<&T>, own: &mut Option<T>, say: impl FnOnce(&T)) {
    if let Some(value) = now.filter(|_| now != own.as_ref()) {
        say(value);
        *own = Some(value.clone());
    }
}

fn transfer(
    now: Option<&TransferTable>,
    own: &mut Option<TransferTable>,
    say: &mut impl FnMut(&str, String),
) {
    let Some(table) = now.filter(|_| now != own.as_ref()) else { return };
    let plain = TransferTable { name: None, file: None, range: None, ..table.clone() };
    if plain != TransferTable::default() {
        return;
    }
    match (&table.name, &table.file) {
        (Some(name), None) => say("transfer", name.clone()),
        (None, Some(file)) => say("transfer", file.display().to_string()),
        _ => return,
    }
    match table.range {
        Some(TransferRange::Values(range)) => say("transfer-range", list(&range)),
        Some(TransferRange::Word(_)) => say("transfer-range", "data".to_owned()),
        None => {}
    }
    *own = Some(table.clone());
}

/// One option switches the ground on and off, and says where it is.
fn ground(now: &GroundTable, said: &mut GroundTable, say: &mut impl FnMut(&str, String)) {
    if now.enabled == Some(false) && now.enabled != said.enabled {
        say("ground", "none".to_owned());
        said.enabled = now.enabled;
    } else if now.enabled != Some(false)
        && let Some(height) = now.height.filter(|_| now.height != said.height)
    {
        say("ground", real(height));
        // It is there then, as it is if nobody says so.
        *said = GroundTable { enabled: now.enabled, height: now.height, ..said.clone() };
    }
}

/// Whether something of a scene moves by keyframes.
fn is_keyed(file: &SceneFile) -> bool {
    file.camera.keyframes.is_some()
        || file.light.iter().any(|table| table.keyframes.is_some())
        || file.volume.iter().any(|table| table.keyframes.is_some())
        || file.surfaces().any(|(_, table)| table.keyframes.is_some())
}

fn camera(now: &SceneFile, said: &mut SceneFile, say: &mut impl FnMut(&str, String)) {
    let (table, own) = (&now.camera, &mut said.camera);
    if table.position.is_some() && table.position != own.position {
        // They are left out where a position stands.
        (own.azimuth_degrees, own.elevation_degrees, own.distance) = (None, None, None);
    }
    set(table.position.as_ref(), &mut own.position, |x| say("camera", list(x)));
    set(table.target.as_ref(), &mut own.target, |x| say("target", list(x)));
    set(table.up.as_ref(), &mut own.up, |x| say("up-vector", list(x)));
    set(table.fov_y_degrees.as_ref(), &mut own.fov_y_degrees, |x| say("fov", real(*x)));
}

fn shadow(now: &SceneFile, said: &mut SceneFile, say: &mut impl FnMut(&str, String)) {
    let (table, own) = (&now.shadow, &mut said.shadow);
    set(table.map.as_ref(), &mut own.map, |x| say("map", x.clone()));
    set(table.size.as_ref(), &mut own.size, |x| say("map-size", x.to_string()));
    set(table.filter.as_ref(), &mut own.filter, |x| say("filter", x.clone()));
    set(table.quality.as_ref(), &mut own.quality, |x| say("quality", real(*x)));
    set(table.steps.as_ref(), &mut own.steps, |x| say("steps", x.to_string()));
    set(table.view_steps.as_ref(), &mut own.view_steps, |x| say("view-steps", x.to_string()));
    set(table.lookup.as_ref(), &mut own.lookup, |x| say("lookup", x.clone()));
    set(table.crossing.as_ref(), &mut own.crossing, |x| say("crossing", x.clone()));
    set(table.thresholds.as_ref(), &mut own.thresholds, |x| say("thresholds", list(x)));
    set(table.slices.as_ref(), &mut own.slices, |x| say("slices", x.clone()));
    set(table.tolerance.as_ref(), &mut own.tolerance, |x| say("tolerance", real(*x)));
    set(table.truncation.as_ref(), &mut own.truncation, |x| say("truncation", real(*x)));
    set(table.shading.as_ref(), &mut own.shading, |x| say("shading", x.clone()));
    set(table.light_samples.as_ref(), &mut own.light_samples, |x| {
        say("light-samples", x.to_string());
    });
    set(table.octaves.as_ref(), &mut own.octaves, |x| say("octaves", x.to_string()));
}

/// A number that is read as the same one.
fn real(x: f64) -> String {
    format!("{x}")
}

fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|x| real(*x)).collect::<Vec<_>>().join(",")
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
