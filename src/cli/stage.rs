//! Options that place camera, light and surroundings.

use clap::Args;
use glam::DVec3;

use super::arguments::{Numbers, above_0, number, numbers, overlay, still};
use crate::scene::automatic::direction_of;
use crate::scene::{Light, SceneFile};

/// Camera and surroundings, as options.
#[derive(Debug, Args)]
pub(super) struct StageArguments {
    /// World position of the camera.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, help_heading = "Camera")]
    pub camera: Option<Numbers<f64, 3>>,
    /// World position in the middle of the picture.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, help_heading = "Camera")]
    pub target: Option<Numbers<f64, 3>>,
    /// Angle between the picture's upper and lower edge [32].
    #[arg(long, value_name = "DEGREES", value_parser = above_0, allow_negative_numbers = true, help_heading = "Camera")]
    pub fov: Option<f64>,
    /// Direction that is up in the picture [0,1,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, help_heading = "Camera")]
    pub up_vector: Option<Numbers<f64, 3>>,
    /// Degrees by which the camera stands around the vertical, from +z towards +x.
    #[arg(long, value_name = "DEGREES", value_parser = finite, allow_negative_numbers = true, conflicts_with = "camera", help_heading = "Camera")]
    pub azimuth: Option<f64>,
    /// Degrees by which the camera stands above the horizon, -90 to 90.
    #[arg(long, value_name = "DEGREES", value_parser = finite, allow_negative_numbers = true, conflicts_with = "camera", help_heading = "Camera")]
    pub elevation: Option<f64>,
    /// How much larger everything appears than in the framed view [1].
    #[arg(long, value_name = "X", value_parser = above_0, allow_negative_numbers = true, help_heading = "Camera")]
    pub zoom: Option<f64>,
    /// Side from which the camera looks: front (+z), back, left (-x), right, top, bottom.
    #[arg(long, value_name = "SIDE", value_parser = side, conflicts_with_all = ["camera", "azimuth", "elevation"], help_heading = "Camera")]
    pub view: Option<[f64; 2]>,
    /// The light's colour and strength; 1,1,1 gives a fully lit white medium radiance 1.
    #[arg(long, value_name = "R,G,B", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, help_heading = "Scene")]
    pub light_color: Option<Numbers<f64, 3>>,
    /// World height of the ground, or none.
    #[arg(long, value_name = "HEIGHT|none", value_parser = ground, allow_negative_numbers = true, conflicts_with = "transparent", help_heading = "Scene")]
    pub ground: Option<GroundChoice>,
    /// Linear radiance of the background.
    #[arg(long, value_name = "R,G,B", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, conflicts_with = "transparent", help_heading = "Scene")]
    pub background: Option<Numbers<f64, 3>>,
    /// Share of the extinguished light that the medium scatters, 0 to 1.
    #[arg(long, value_name = "R,G,B", value_parser = numbers::<f64, 3>, allow_hyphen_values = true, help_heading = "Volume")]
    pub albedo: Option<Numbers<f64, 3>>,
    /// Mean cosine of the scattering angle, -1 to 1: above 0 forwards [0].
    #[arg(long, value_name = "G", value_parser = finite, allow_negative_numbers = true, help_heading = "Volume")]
    pub phase: Option<f64>,
}

impl StageArguments {
    /// Writes the given options into `file`.
    pub(super) fn overlay(&self, file: &mut SceneFile) {
        let camera = &mut file.camera;
        if self.camera.is_some() {
            (camera.azimuth_degrees, camera.elevation_degrees) = (None, None);
        }
        let sides = self.view.map(|[azimuth, elevation]| (Some(azimuth), Some(elevation)));
        let (azimuth, elevation) = sides.unwrap_or((self.azimuth, self.elevation));
        if azimuth.is_some() || elevation.is_some() {
            camera.position = None;
        }
        if self.camera.is_some() || azimuth.is_some() || elevation.is_some() {
            camera.distance = None;
            camera.keyframes = None;
        }
        still(&mut camera.keyframes, |one| {
            one.target = one.target.filter(|_| self.target.is_none());
            one.fov_y_degrees = one.fov_y_degrees.filter(|_| self.fov.is_none());
            one.up = one.up.filter(|_| self.up_vector.is_none());
            one.zoom = one.zoom.filter(|_| self.zoom.is_none());
        });
        overlay! {
            camera.position => self.camera.map(|c| c.0),
            camera.target => self.target.map(|c| c.0),
            camera.fov_y_degrees => self.fov,
            camera.up => self.up_vector.map(|c| c.0),
            camera.azimuth_degrees => azimuth,
            camera.elevation_degrees => elevation,
            camera.zoom => self.zoom,
            file.background.radiance => self.background.map(|c| c.0),
        }
        match self.ground {
            Some(GroundChoice::None) => file.ground.enabled = Some(false),
            Some(GroundChoice::At(height)) => {
                (file.ground.enabled, file.ground.height) = (Some(true), Some(height));
            }
            None => {}
        }
        if let Some(Numbers(color)) = self.light_color {
            let light = file.light.one_mut();
            light.irradiance = Some(color.map(|c| c * Light::UNIT_IRRADIANCE));
            still(&mut light.keyframes, |one| one.irradiance = None);
        }
        for volume in file.volume.iter_mut() {
            overlay! {
                volume.albedo => self.albedo.map(|c| c.0),
                volume.phase_g => self.phase,
            }
            still(&mut volume.keyframes, |one| {
                one.albedo = one.albedo.filter(|_| self.albedo.is_none());
                one.phase_g = one.phase_g.filter(|_| self.phase.is_none());
            });
        }
    }
}

/// The direction of `--light`: that in which it travels, or degrees of where it comes from.
pub(super) fn light(text: &str) -> Result<Numbers<f64, 3>, String> {
    match text.split(',').count() {
        2 => {}
        3 => return numbers(text),
        _ => return Err("expected X,Y,Z (where it travels) or AZIMUTH,ELEVATION (degrees)".into()),
    }
    let Numbers([azimuth, elevation]) = numbers::<f64, 2>(text)?;
    if !(azimuth.is_finite() && (-90.0..=90.0).contains(&elevation)) {
        return Err(format!("elevation {elevation} is not between -90 and 90"));
    }
    // Not its negative, which would have negative zeros.
    Ok(Numbers((DVec3::ZERO - direction_of(azimuth, elevation)).to_array()))
}

/// What `--ground` asks for.
#[derive(Clone, Copy, Debug)]
pub(super) enum GroundChoice {
    None,
    /// World height.
    At(f64),
}

fn ground(text: &str) -> Result<GroundChoice, String> {
    if text == "none" { Ok(GroundChoice::None) } else { finite(text).map(GroundChoice::At) }
}

fn finite(text: &str) -> Result<f64, String> {
    number(text, f64::is_finite, "that is finite")
}

/// Azimuth and elevation of a side.
fn side(text: &str) -> Result<[f64; 2], String> {
    let sides = [
        ("front", [0.0, 0.0]),
        ("back", [180.0, 0.0]),
        ("left", [-90.0, 0.0]),
        ("right", [90.0, 0.0]),
        ("top", [0.0, 90.0]),
        ("bottom", [0.0, -90.0]),
    ];
    match sides.iter().find(|(name, _)| *name == text) {
        Some((_, angles)) => Ok(*angles),
        None => Err(format!("'{text}' is not one of {}", sides.map(|(name, _)| name).join(", "))),
    }
}
