//! Media from the values of a scene file; values that it leaves out are chosen here.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use super::{Choices, Densities, VISIBLE_SHARE, digits, finite};
use crate::error::{Error, Result};
use crate::scene::blackbody::blackbody;
use crate::scene::file::{EmissionTable, VolumeTable};
use crate::scene::transfer::{self, TransferFunction};
use crate::scene::{Emission, Medium};
use crate::volume::Volume;

/// Chosen optical depth through the fuller columns of the volume, along all three axes.
const OPTICAL_DEPTH: f64 = 5.0;
/// The quantile of the column integrals that counts as a full column.
const FULL_COLUMN: f64 = 0.9;
/// Radiance of the fuller columns of what glows if nobody says.
const EMITTED: f64 = 0.6;
/// Temperatures, in kelvin, for the ends of a field that does not hold temperatures.
const KELVIN: [f64; 2] = [700.0, 2400.0];
/// A field whose largest value is above this holds temperatures in kelvin.
const LEAST_KELVIN: f64 = 500.0;

/// Everything that was loaded for one `[volume]` table of a scene file.
#[derive(Clone, Debug)]
pub struct Ingredients {
    /// The densities, or numbers that stand for them.
    pub volume: Arc<Volume>,
    /// The map between densities and the numbers in `volume`.
    pub densities: Densities,
    /// The transfer function over the numbers of `volume`, if there is one.
    pub transfer: Option<Arc<TransferFunction>>,
    /// Red, green and blue factors on the albedo, 0..1.
    pub color: Option<[Arc<Volume>; 3]>,
    /// A factor on the extinction, 0..1.
    pub modulation: Option<Arc<Volume>>,
    /// The grid that `[volume.emission]` names.
    pub emission_field: Option<Arc<Volume>>,
    /// The window of stored values that was chosen.
    pub window: Option<[f32; 2]>,
    /// The transfer function as given or chosen, over densities.
    pub function: Option<TransferFunction>,
    /// What was found out about the opacities of the volume.
    known: Known,
}

/// What choices depend on, of a volume with a transfer function or without: it takes a look at every
/// voxel, and a scene that is being edited asks for it all the time.
#[derive(Clone, Debug, Default)]
struct Known(Arc<Mutex<Option<(OfOpacities, Opacities)>>>);

/// Whose opacities they are.
type OfOpacities = (Arc<Volume>, Option<Arc<TransferFunction>>);

/// Where there is opacity, and how much.
#[derive(Clone, Debug)]
struct Opacities {
    /// Points around all of it that is visible.
    seen: Vec<DVec3>,
    /// The integral along a full column, 0 if there is none; left out if nobody asked.
    column: Option<f64>,
}

impl Ingredients {
    /// Those of a volume without anything else.
    pub fn of(volume: Arc<Volume>) -> Self {
        Self {
            volume,
            densities: Densities::default(),
            transfer: None,
            color: None,
            modulation: None,
            emission_field: None,
            window: None,
            function: None,
            known: Known::default(),
        }
    }

    /// Points around all of the volume that is visible.
    fn seen(&self) -> Vec<DVec3> {
        self.opacities(false).seen
    }

    /// The integral of opacity along a full column; `None` if there is none.
    fn column(&self) -> Option<f64> {
        self.opacities(true).column.filter(|&column| column > 0.0)
    }

    /// What is known of the opacities of the volume, with the column if that is asked for.
    fn opacities(&self, column: bool) -> Opacities {
        let mut known = self.known.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(((volume, transfer), known)) = &*known
            && Arc::ptr_eq(volume, &self.volume)
            && transfer.as_ref().map(Arc::as_ptr) == self.transfer.as_ref().map(Arc::as_ptr)
            && (known.column.is_some() || !column)
        {
            return known.clone();
        }
        let of = |volume: &Volume| Opacities {
            seen: volume.seen_points(VISIBLE_SHARE),
            column: column.then(|| volume.column_quantile(FULL_COLUMN).unwrap_or(0.0)),
        };
        let found = match &self.transfer {
            Some(function) => of(&classified(&self.volume, function)),
            None => of(&self.volume),
        };
        *known = Some(((self.volume.clone(), self.transfer.clone()), found.clone()));
        found
    }

    /// Bytes of all voxels together.
    pub fn bytes(&self) -> u64 {
        let more = self.color.iter().flatten().chain(&self.modulation).chain(&self.emission_field);
        let all = more.chain([&self.volume]).map(|volume| volume.voxels().bytes() as u64);
        all.fold(0, u64::saturating_add)
    }
}

impl From<Volume> for Ingredients {
    fn from(volume: Volume) -> Self {
        Self::of(Arc::new(volume))
    }
}

/// The medium of a table's volume.
pub(super) fn medium(
    table: &VolumeTable,
    own: &Ingredients,
    choices: &mut Choices,
) -> Result<Medium> {
    let density_scale = match in_range("volume.density_scale", table.density_scale)? {
        Some(scale) => scale,
        None => {
            let scale = own.column().map_or(1.0, |column| OPTICAL_DEPTH / column);
            choices.took("density scale (`volume.density_scale`)", digits(scale));
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
        Some(table) => Some(emission(table, (own, density_scale), choices)?),
        None => None,
    };
    let Ingredients { transfer, color, modulation, .. } = own.clone();
    Ok(Medium { density_scale, tint, albedo, phase_g, transfer, color, modulation, emission })
}

/// Checks a given scale: it must be at least 0 and below 1e30.
fn in_range(what: &str, given: Option<f64>) -> Result<Option<f64>> {
    match given {
        Some(scale) if !(0.0..1e30).contains(&scale) => {
            Err(Error::value(what, format!("{scale} is not between 0 and 1e30")))
        }
        given => Ok(given),
    }
}

/// The factor on density that gives the fuller columns of a volume an integral of `wanted`,
/// independently of the volume's orientation.
fn scale_for(volume: &Volume, wanted: f64) -> f64 {
    volume.column_quantile(FULL_COLUMN).map_or(1.0, |integral| wanted / integral)
}

/// Points around the visible parts of a body ([`Volume::visible_points`]): those with extinction,
/// and those that emit.
pub(super) fn visible_points(own: &Ingredients, medium: &Medium) -> Vec<DVec3> {
    let mut points = own.seen();
    if let Some(emission) = &medium.emission {
        let field = emission.field.as_ref().unwrap_or(&own.volume);
        points.extend(classified(field, &emission.ramp).seen_points(VISIBLE_SHARE));
    }
    if points.is_empty() { own.volume.world_corners().to_vec() } else { points }
}

/// A volume that holds opacities in place of densities.
fn classified(volume: &Volume, function: &TransferFunction) -> Volume {
    volume.mapped(|density| function.at(density.into()).1 as f32)
}

/// The share of light sent out evenly along the volume's fuller columns that leaves them.
fn shown_share(own: &Ingredients, density_scale: f64) -> f64 {
    let depth = density_scale * own.column().unwrap_or(0.0);
    if depth > 1e-6 { -(-depth).exp_m1() / depth } else { 1.0 }
}

fn emission(
    table: &EmissionTable,
    (own, density_scale): (&Ingredients, f64),
    choices: &mut Choices,
) -> Result<Emission> {
    let (field, densities) = match &own.emission_field {
        Some(field) => (field, Densities::default()),
        None => (&own.volume, own.densities),
    };
    let largest = densities.density(field.typical_largest().into());
    let [low, high] = table.range.unwrap_or([0.0, if largest > 0.0 { largest } else { 1.0 }]);
    if !(low.is_finite() && high.is_finite() && low < high) {
        let why = format!("{low}, {high} are not in increasing order");
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
            let why = "applies only to blackbody colors";
            return Err(Error::value("volume.emission.kelvin", why));
        }
        transfer::preset(colors)?.rescaled([low, high])?
    };
    let ramp = densities.held(&ramp)?;
    let radiance = in_range("volume.emission.radiance", table.radiance)?;
    let scale = match in_range("volume.emission.scale", table.scale)? {
        Some(_) if radiance.is_some() => {
            let why = "contradicts a radiance; give one of them";
            return Err(Error::value("volume.emission.scale", why));
        }
        Some(scale) => scale,
        None => {
            let wanted = radiance.unwrap_or(EMITTED);
            let shown = shown_share(own, density_scale);
            let scale = scale_for(&classified(field, &ramp), wanted / shown);
            choices.took("emission radiance (`volume.emission.radiance`)", digits(wanted));
            choices.took("emission scale (volume.emission.scale)", digits(scale));
            scale
        }
    };
    Ok(Emission { field: own.emission_field.clone(), ramp: Arc::new(ramp), scale })
}
