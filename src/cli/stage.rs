//! Options that place camera, light and surroundings.

use clap::Args;
use glam::DVec3;

use super::arguments::{Numbers, above_0, number, numbers, overlay, still};
use crate::scene::automatic::{angles_of, direction_of};
use crate::scene::file::CameraTable;
use crate::scene::{Light, SceneFile};
use crate::volume::Axis;

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
    /// What a chosen view contains: the volume and its shadow (shadow), or the volume [shadow].
    #[arg(long, value_name = "WHAT", value_parser = ["volume", "shadow"], help_heading = "Camera")]
    pub fit: Option<String>,
    /// Side from which the camera looks: front (+z), back, left (-x), right, top, bottom; of a
    /// patient's scan also anterior, posterior, superior, inferior, and left is the patient's.
    #[arg(long, value_name = "SIDE", value_parser = side, conflicts_with_all = ["camera", "azimuth"], help_heading = "Camera")]
    pub view: Option<Side>,
    /// The light's colour and strength; 1,1,1 gives a fully lit white medium radiance 1.
    #[arg(long, value_name = "R,G,B", value_parser = colour, allow_hyphen_values = true, help_heading = "Scene")]
    pub light_color: Option<Numbers<f64, 3>>,
    /// World height of the ground, or none.
    #[arg(long, value_name = "HEIGHT|none", value_parser = ground, allow_negative_numbers = true, help_heading = "Scene")]
    pub ground: Option<GroundChoice>,
    /// With --transparent, the ground is not seen but its shadow is, as black with alpha.
    #[arg(long, requires = "transparent", help_heading = "Scene")]
    pub catch_shadow: bool,
    /// Linear radiance of the background.
    #[arg(long, value_name = "R,G,B", value_parser = colour, allow_hyphen_values = true, conflicts_with = "transparent", help_heading = "Scene")]
    pub background: Option<Numbers<f64, 3>>,
    /// Share of the extinguished light that the medium scatters, 0 to 1.
    #[arg(long, value_name = "R,G,B", value_parser = colour, allow_hyphen_values = true, help_heading = "Volume")]
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
        let (azimuth, elevation) = match self.view {
            Some(Side::Scene([azimuth, elevation]) | Side::Either([azimuth, elevation], _)) => {
                (Some(azimuth), self.elevation.or(Some(elevation)))
            }
            // Set once the patient's axes are known.
            Some(Side::Patient(..)) => (Some(0.0), self.elevation.or(Some(0.0))),
            None => (self.azimuth, self.elevation),
        };
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
            camera.fit => self.fit.clone(),
            file.background.radiance => self.background.map(|c| c.0),
        }
        if self.catch_shadow {
            file.ground.enabled = None;
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
        for surface in file.surfaces_mut() {
            overlay! { surface.albedo => self.albedo.map(|c| c.0), }
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

/// A colour, or one number for grey.
fn colour(text: &str) -> Result<Numbers<f64, 3>, String> {
    if text.contains(',') {
        return numbers(text)
            .map_err(|why| format!("{why}, linear red, green and blue, or one for grey"));
    }
    let Numbers([grey]) = numbers::<f64, 1>(text)?;
    Ok(Numbers([grey; 3]))
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

/// A side from which the camera can look.
#[derive(Clone, Copy, Debug)]
pub(super) enum Side {
    /// By azimuth and elevation in degrees.
    Scene([f64; 2]),
    /// Its name and its direction in a patient's space, LPS.
    Patient(&'static str, DVec3),
    /// The patient's side if the scan knows it, else that of the scene.
    Either([f64; 2], DVec3),
}

const SIDES: [(&str, Side); 10] = [
    ("front", Side::Scene([0.0, 0.0])),
    ("back", Side::Scene([180.0, 0.0])),
    ("left", Side::Either([-90.0, 0.0], DVec3::X)),
    ("right", Side::Either([90.0, 0.0], DVec3::NEG_X)),
    ("top", Side::Scene([0.0, 90.0])),
    ("bottom", Side::Scene([0.0, -90.0])),
    ("anterior", Side::Patient("anterior", DVec3::NEG_Y)),
    ("posterior", Side::Patient("posterior", DVec3::Y)),
    ("superior", Side::Patient("superior", DVec3::Z)),
    ("inferior", Side::Patient("inferior", DVec3::NEG_Z)),
];

fn side(text: &str) -> Result<Side, String> {
    match SIDES.iter().find(|(name, _)| *name == text) {
        Some((_, side)) => Ok(*side),
        None => Err(format!("'{text}' is not one of {}", SIDES.map(|(name, _)| name).join(", "))),
    }
}

/// Turns the camera to a side of a patient who stands along `up`, the axis of the file that points
/// up in the world.
pub(super) fn look_at_patient(camera: &mut CameraTable, from: DVec3, up: Axis) {
    let turn = up.world_from_file();
    let from_above = from.z != 0.0;
    // The head is up in the picture, or the patient's front below, as it lies in a scanner.
    let upward = turn * if from_above { DVec3::Y * from.z } else { DVec3::Z };
    let [azimuth, elevation] = angles_of(turn * from);
    camera.azimuth_degrees = Some(azimuth);
    // One that was asked for stays, above a side that is not itself above or below.
    let raised = camera.elevation_degrees.filter(|raised| *raised != 0.0 && elevation.abs() < 1.0);
    camera.elevation_degrees = raised.or(Some(elevation));
    camera.up.get_or_insert(upward.to_array());
}
