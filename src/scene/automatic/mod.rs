//! Completes what a user wrote to a whole scene. Every value left out is chosen here, such that a
//! first picture of any volume is a good one. Choices that depend on the volume, or that differ
//! between scene files and volumes, are reported ([`Choice`]). Fixed defaults, such as a spot
//! light's cone, are not: the tables in [`super::file`] state them.

mod camera;
mod chosen;
mod densities;
mod light;
mod map_size;
mod medium;
mod shot;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::computed;
use super::file::{GroundTable, LightTable, SceneFile, VolumeTable};
use super::framing::shown_points;
use super::keyframes::LightKeyframe;
use super::{Body, Ground, Light, Media, Medium, Scene, Surfaces};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::settings::Settings;
use crate::volume::Volume;
use camera::camera;
pub use camera::{angles_of, direction_of};
pub use chosen::Choice;
use chosen::{Choices, digits, short};
pub use densities::Densities;
use light::{lights, usual_irradiance};
use map_size::map_size;
pub use medium::Ingredients;
use medium::{medium, visible_points};
pub use shot::Shot;

/// Voxels above this share of the largest density count as visible.
const VISIBLE_SHARE: f32 = 0.003;
/// The albedo of a photographer's grey card.
const GROUND_ALBEDO: f64 = 0.18;
/// A darker ground, on which a white medium stands out.
const STUDIO_GROUND_ALBEDO: f64 = 0.07;
/// Ambient radiance under a bright sky, for scenes that do not specify it.
const AMBIENT: DVec3 = DVec3::new(0.055, 0.07, 0.095);

/// What surrounds volumes where ambient light, background and the ground's albedo are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Surroundings {
    /// An opaque black background without ambient light, for scenes with absolute parameters. There
    /// still is a ground.
    Void,
    /// A dark ground under a soft sky, without a visible horizon, for a volume that somebody wants
    /// to see.
    Studio,
}

impl Surroundings {
    /// What surrounds the volumes of a scene file as it was written: what it says, else a studio,
    /// unless it says how bright a light is or where it stands, or what the ambient light, the
    /// background or a file's density scale are. Its values are then absolute, and what it leaves out
    /// adds no light.
    pub fn of(file: &SceneFile) -> Self {
        if let Some(said) = file.surroundings {
            return said;
        }
        let is_scaled = |table: &VolumeTable| table.path.is_some() && table.density_scale.is_some();
        let is_absolute = file.is_bare()
            || file.volume.iter().any(is_scaled)
            || file.light.iter().any(is_absolute)
            || file.ambient.radiance.is_some()
            || file.background.radiance.is_some()
            || file.ground.albedo.is_some();
        if is_absolute { Self::Void } else { Self::Studio }
    }
}

/// Whether a light is more than a direction of the usual one.
fn is_absolute(table: &LightTable) -> bool {
    let usual = table.kind.as_deref().is_none_or(|kind| kind == "directional");
    let others = LightTable { kind: None, direction: None, keyframes: None, ..table.clone() };
    let brighter = |one: &LightKeyframe| one.irradiance.is_some();
    !usual || others != LightTable::default() || table.keyframes.iter().flatten().any(brighter)
}

/// The window, in stored values, that separates a scanned object from its surroundings. It reaches
/// from the level of the volume's border to its largest value, without a few outliers. `None` if
/// the border is empty or nothing rises above it.
pub fn window(volume: &Volume) -> Option<[f32; 2]> {
    let (border, largest) = (volume.statistics().border, volume.typical_largest());
    let surrounded = border > 0.01 * largest;
    let rises = largest > border * 1.05;
    (surrounded && rises).then_some([border, largest])
}

impl Scene {
    /// A scene that shows a volume well: light from above, an endless ground under a soft sky, a
    /// camera that sees all of the volume in pictures that are at least as wide as high, and a
    /// density scale that makes its shadows visible.
    ///
    /// The background is the radiance of the ground under the chosen light, so that no horizon
    /// shows. Whoever changes the lights changes [`Scene::background`] too.
    ///
    /// # Errors
    /// If no camera, light or ground can be chosen for the volume.
    pub fn automatic(volume: Volume) -> Result<Self> {
        let ingredients = vec![volume.into()];
        let (scene, ..) = complete(&SceneFile::default(), ingredients, Surroundings::Studio)?;
        Ok(scene)
    }
}

/// Everything that was loaded for a scene file.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The volumes of its `[volume]` tables, in their order.
    pub volumes: Vec<Ingredients>,
    /// The surfaces of its `[mesh]` and `[hair]` tables.
    pub surfaces: Surfaces,
}

impl From<Vec<Ingredients>> for Loaded {
    fn from(volumes: Vec<Ingredients>) -> Self {
        Self { volumes, ..Self::default() }
    }
}

impl From<Surfaces> for Loaded {
    fn from(surfaces: Surfaces) -> Self {
        Self { surfaces, ..Self::default() }
    }
}

/// Rays a pixel where there are meshes or hair: edges of triangles, and the shadows of strands, are
/// finer than pixels.
const SURFACE_SAMPLES: u32 = 8;

/// Completes `file` to a scene and its settings, and lists the values chosen for this scene.
/// `loaded` is what its tables name, or the volumes alone.
///
/// # Errors
/// If a value of `file` is out of its range or contradicts another one, or if not as many volumes
/// were loaded as the file has.
pub fn complete(
    file: &SceneFile,
    loaded: impl Into<Loaded>,
    surroundings: Surroundings,
) -> Result<(Scene, Settings, Vec<Choice>)> {
    let loaded = loaded.into();
    let mut choices = Choices(Vec::new());
    let mut settings = computed::settings(file)?;
    let fits_shadow = camera::fits_shadow(&file.camera)?;
    let mut of_media = Choices(Vec::new());
    let mediums = mediums(file, &loaded.volumes, &mut of_media)?;
    let visible = visible(&loaded, &mediums);
    let visible = if visible.is_empty() { Media::none().world_corners().to_vec() } else { visible };
    let bounds = bounds_of(&visible);
    if !loaded.surfaces.is_empty() && bounds.size() == DVec3::ZERO {
        let why = format!("everything lies at one point, {}", bounds.min);
        return Err(Error::value("scene", why));
    }
    let irradiance = usual_irradiance(file, surroundings);
    let lights = lights(file, &bounds, irradiance, &mut choices)?;
    let mut of_ground = Choices(Vec::new());
    let mut ground = ground(file, &bounds, surroundings, &mut of_ground)?;
    let view = |ground: Option<Ground>, choices: &mut Choices| {
        let shown = shown_points(&visible, lights.first(), ground.filter(|_| fits_shadow));
        camera(&file.camera, (&visible, &shown), aspect(&settings), choices)
    };
    let mut of_camera = Choices(Vec::new());
    let mut camera = view(ground, &mut of_camera)?;
    let is_chosen = file.ground == GroundTable::default();
    if ground.is_some_and(|ground| is_chosen && camera.position.y < ground.height) {
        // From below it would hide everything.
        ground = None;
        (of_ground, of_camera) = (Choices(Vec::new()), Choices(Vec::new()));
        of_ground.took("ground (`ground.height`)", "none, seen from below".to_owned());
        camera = view(None, &mut of_camera)?;
    }
    choices.0.extend(of_ground.0.into_iter().chain(of_media.0).chain(of_camera.0));
    let bodies = loaded.volumes.into_iter().zip(mediums);
    let bodies = bodies.map(|(own, medium)| Body { volume: own.volume, medium });
    let media = Media::new(bodies.collect());
    let ambient = match (file.ambient.radiance, surroundings) {
        (Some(radiance), _) => radiance_of("ambient.radiance", radiance)?,
        (None, Surroundings::Void) => DVec3::ZERO,
        (None, Surroundings::Studio) => {
            choices.took("ambient radiance (ambient.radiance)", short(AMBIENT));
            AMBIENT
        }
    };
    let background = match (file.background.radiance, surroundings) {
        (Some(radiance), _) => radiance_of("background.radiance", radiance)?,
        (None, Surroundings::Void) => DVec3::ZERO,
        (None, Surroundings::Studio) => {
            let lit = lit_ground(&lights, ground, ambient, bounds.center());
            choices.took("background radiance (`background.radiance`)", short(lit));
            lit
        }
    };
    let background = Some(background);
    let surfaces = loaded.surfaces;
    if !surfaces.is_empty() && file.image.samples.is_none() {
        settings.image.samples = SURFACE_SAMPLES;
        choices.took("rays a pixel (`image.samples`)", SURFACE_SAMPLES.to_string());
    }
    let scene = Scene { media, surfaces, lights, ambient, camera, ground, background };
    if file.shadow.size.is_none() {
        settings.map.size = map_size(&scene, &settings)?;
    }
    Ok((scene, settings, choices.0))
}

/// The media of the volumes in `ingredients`, by the `[volume]` tables of `file`.
fn mediums(
    file: &SceneFile,
    ingredients: &[Ingredients],
    choices: &mut Choices,
) -> Result<Vec<Medium>> {
    // Without a `[volume]` table, all values of the loaded volumes are chosen.
    let unsaid = vec![VolumeTable::default(); ingredients.len()];
    let tables = if file.volume.is_empty() { &unsaid[..] } else { &file.volume };
    if tables.len() != ingredients.len() {
        return Err(Error::value(
            "volume",
            "the scene has a different number of volumes than were loaded",
        ));
    }
    tables.iter().zip(ingredients).map(|(table, own)| medium(table, own, choices)).collect()
}

/// Points around everything that is visible.
fn visible(loaded: &Loaded, mediums: &[Medium]) -> Vec<DVec3> {
    let volumes = loaded.volumes.iter().zip(mediums);
    let mut points: Vec<DVec3> =
        volumes.flat_map(|(own, medium)| visible_points(own, medium)).collect();
    for surface in loaded.surfaces.iter() {
        surface.for_each_ball(|center, _| points.push(center));
    }
    points
}

/// The box around points; that of a scene without media if there are none.
fn bounds_of(points: &[DVec3]) -> Aabb {
    Aabb::around(points.iter().copied()).unwrap_or_else(|| Media::none().world_bounds())
}

/// The width of a picture as a multiple of its height.
fn aspect(settings: &Settings) -> f64 {
    let [width, height] = settings.image.size;
    f64::from(width) / f64::from(height)
}

/// Radiance of the ground where no shadow falls. An endless ground before a background of this
/// radiance has no visible horizon.
fn lit_ground(lights: &[Light], ground: Option<Ground>, ambient: DVec3, at: DVec3) -> DVec3 {
    let albedo = ground.map_or(GROUND_ALBEDO, |ground| ground.albedo);
    albedo * (lights.iter().map(|light| light.on_ground_at(at)).sum::<DVec3>() + ambient)
}

fn ground(
    file: &SceneFile,
    bounds: &Aabb,
    surroundings: Surroundings,
    choices: &mut Choices,
) -> Result<Option<Ground>> {
    let table = &file.ground;
    if table.enabled == Some(false) {
        return Ok(None);
    }
    let height = match table.height {
        Some(height) => finite("ground.height", [height; 3])?.x,
        None => {
            let height = bounds.min.y;
            choices.took("ground height (`ground.height`)", digits(height));
            height
        }
    };
    let albedo = match (table.albedo, surroundings) {
        (Some(albedo), _) => albedo,
        (None, Surroundings::Void) => GROUND_ALBEDO,
        (None, Surroundings::Studio) => {
            // As bright in any light that is chosen.
            let given = file.light.iter().any(|light| light.irradiance.is_some());
            let usual =
                if given { Light::UNIT_IRRADIANCE } else { usual_irradiance(file, surroundings) };
            let albedo = STUDIO_GROUND_ALBEDO * Light::UNIT_IRRADIANCE / usual;
            choices.took("ground albedo (ground.albedo)", albedo.to_string());
            albedo
        }
    };
    if !(0.0..=1.0).contains(&albedo) {
        return Err(Error::value("ground.albedo", format!("{albedo} is not between 0 and 1")));
    }
    if let Some(extent) = table.half_extent
        && !(extent > 0.0 && extent.is_finite())
    {
        return Err(Error::value("ground.half_extent", format!("{extent} is not above 0")));
    }
    Ok(Some(Ground { height, albedo, half_extent: table.half_extent }))
}

fn finite(what: &str, given: [f64; 3]) -> Result<DVec3> {
    let v = DVec3::from_array(given);
    if v.is_finite() { Ok(v) } else { Err(Error::value(what, format!("{v} is not finite"))) }
}

fn radiance_of(what: &str, given: [f64; 3]) -> Result<DVec3> {
    let v = finite(what, given)?;
    if v.min_element() >= 0.0 { Ok(v) } else { Err(Error::value(what, format!("{v} is below 0"))) }
}
