//! What volumes are made of: the values of a scene file, and those that it leaves out.

use std::sync::Arc;

use super::{Choices, digits, finite};
use crate::error::{Error, Result};
use crate::scene::blackbody::blackbody;
use crate::scene::file::{EmissionTable, VolumeTable};
use crate::scene::transfer::{self, TransferFunction};
use crate::scene::{Emission, Light, Medium};
use crate::volume::Volume;

/// Optical depth through the fuller columns of the volume.
const OPTICAL_DEPTH: f64 = 5.0;
/// Which column counts as a full one.
const FULL_COLUMN: f64 = 0.9;
/// Radiance of what emits, through its fuller columns.
const EMITTED: f64 = 3.0;
/// Temperatures of the ends of a field that does not hold temperatures, kelvin.
const KELVIN: [f64; 2] = [700.0, 2400.0];
/// A field whose largest value is above this holds temperatures.
const LEAST_KELVIN: f64 = 500.0;

/// What was loaded for a table of a scene file.
#[derive(Clone, Debug)]
pub struct Ingredients {
    /// The densities.
    pub volume: Arc<Volume>,
    /// Their transfer function, over densities as they are.
    pub transfer: Option<Arc<TransferFunction>>,
    /// Red, green and blue factors on the albedo.
    pub color: Option<[Arc<Volume>; 3]>,
    /// A factor on the extinction.
    pub modulation: Option<Arc<Volume>>,
    /// The grid that the emission's table names.
    pub emission_field: Option<Arc<Volume>>,
}

impl From<Volume> for Ingredients {
    fn from(volume: Volume) -> Self {
        Self {
            volume: Arc::new(volume),
            transfer: None,
            color: None,
            modulation: None,
            emission_field: None,
        }
    }
}

/// What the volume of a table is made of.
pub(super) fn medium(
    table: &VolumeTable,
    own: &Ingredients,
    light: &Light,
    choices: &mut Choices,
) -> Result<Medium> {
    let volume = &own.volume;
    let density_scale = match in_range("volume.density_scale", table.density_scale)? {
        Some(scale) => scale,
        None => {
            let scale = match &own.transfer {
                Some(function) => scale_for(&classified(volume, function), light, OPTICAL_DEPTH),
                None => scale_for(volume, light, OPTICAL_DEPTH),
            };
            choices.took("density scale (--density-scale)", digits(scale));
            scale
        }
    };
    let albedo = finite("volume.albedo", table.albedo.unwrap_or([1.0; 3]))?;
    if albedo.min_element() < 0.0 || albedo.max_element() > 1.0 {
        return Err(Error::value("volume.albedo", format!("{albedo} is not between 0 and 1")));
    }
    let phase_g = table.phase_g.unwrap_or(0.0);
    if !(phase_g > -1.0 && phase_g < 1.0) {
        return Err(Error::value("volume.phase_g", format!("{phase_g} is not between -1 and 1")));
    }
    let tint = finite("volume.tint", table.tint.unwrap_or([1.0; 3]))?;
    if tint.min_element() < 0.0 || tint.max_element() > 1e6 {
        return Err(Error::value("volume.tint", format!("{tint} is not between 0 and 1e6")));
    }
    let emission = match &table.emission {
        Some(table) => Some(emission(table, own, light, choices)?),
        None => None,
    };
    let Ingredients { transfer, color, modulation, .. } = own.clone();
    Ok(Medium { density_scale, tint, albedo, phase_g, transfer, color, modulation, emission })
}

/// A scale that was given, if it is one.
fn in_range(what: &str, given: Option<f64>) -> Result<Option<f64>> {
    match given {
        Some(scale) if !(0.0..1e30).contains(&scale) => {
            Err(Error::value(what, format!("{scale} is not between 0 and 1e30")))
        }
        given => Ok(given),
    }
}

/// The factor that gives the fuller columns of a volume along the light an integral of `wanted`.
fn scale_for(volume: &Volume, light: &Light, wanted: f64) -> f64 {
    let columns = volume.column_integrals(light.direction_at(volume.world_bounds().center()));
    let full = columns.get((columns.len() as f64 * FULL_COLUMN) as usize);
    full.map_or(1.0, |integral| wanted / integral)
}

/// A volume with opacities in the place of densities.
fn classified(volume: &Volume, function: &TransferFunction) -> Volume {
    volume.mapped(|density| function.at(density.into()).1 as f32)
}

fn emission(
    table: &EmissionTable,
    own: &Ingredients,
    light: &Light,
    choices: &mut Choices,
) -> Result<Emission> {
    let field = own.emission_field.as_ref().unwrap_or(&own.volume);
    let largest = f64::from(field.largest());
    let [low, high] = table.range.unwrap_or([0.0, if largest > 0.0 { largest } else { 1.0 }]);
    if !(low.is_finite() && high.is_finite() && low < high) {
        let why = format!("{low}, {high} do not rise");
        return Err(Error::value("volume.emission.range", why));
    }
    let colors = table.colors.as_deref().unwrap_or("blackbody");
    let ramp = if colors == "blackbody" {
        let kelvin = table.kelvin.unwrap_or_else(|| {
            let kelvin = if high > LEAST_KELVIN { [low.max(1.0), high] } else { KELVIN };
            choices.took("temperatures (volume.emission.kelvin)", kelvin.map(digits).join(", "));
            kelvin
        });
        blackbody([low, high], kelvin)?
    } else {
        if table.kelvin.is_some() {
            let why = "means something for the colors of a blackbody only";
            return Err(Error::value("volume.emission.kelvin", why));
        }
        transfer::preset(colors)?.rescaled([low, high])?
    };
    let scale = match in_range("volume.emission.scale", table.scale)? {
        Some(scale) => scale,
        None => {
            let scale = scale_for(&classified(field, &ramp), light, EMITTED);
            choices.took("emission scale (volume.emission.scale)", digits(scale));
            scale
        }
    };
    Ok(Emission { field: own.emission_field.clone(), ramp: Arc::new(ramp), scale })
}
