//! Loads the volumes and surfaces of scene files one after another, and keeps those that stay the same.

use crate::error::{Error, ErrorKind, Result};
use crate::io::dense::DEFAULT_MAX_BYTES;
use crate::io::{LoadedShape, load_ingredients, load_shape, place_shape};
use crate::scene::automatic::{Ingredients, Loaded};
use crate::scene::file::{SurfaceTable, VolumeTable};
use crate::scene::{SceneFile, Surfaces};

/// The volumes and surfaces of the last scene file.
#[derive(Default)]
pub(super) struct Volumes {
    loaded: Vec<OfTable>,
    /// The shapes of surfaces, and what they were loaded for.
    shapes: Vec<((&'static str, SurfaceTable), LoadedShape)>,
}

struct OfTable {
    /// What it was loaded for.
    table: VolumeTable,
    /// Whether a window could be chosen.
    automatic: bool,
    ingredients: Ingredients,
}

impl Volumes {
    /// The volumes and surfaces of `file`, and what there is to say of those that were not loaded before. `scan`
    /// as of [`load_ingredients`].
    ///
    /// # Errors
    /// If one cannot be loaded, or if they are too large together.
    pub(super) fn load(&mut self, file: &SceneFile, scan: bool) -> Result<(Loaded, Vec<String>)> {
        let wanted = file
            .volume
            .iter()
            .map(|table| (what_is_loaded(table), scan || table.density_scale.is_none()));
        let wanted: Vec<(VolumeTable, bool)> = wanted.collect();
        let mut kept = Vec::new();
        for (index, loaded) in std::mem::take(&mut self.loaded).into_iter().enumerate() {
            let same = wanted.get(index).is_some_and(|(table, automatic)| {
                // What has no window, although one could be chosen, has none without choice.
                let has_none = loaded.automatic && loaded.ingredients.window.is_none();
                *table == loaded.table && (*automatic == loaded.automatic || has_none)
            });
            kept.push(same.then_some(loaded));
        }
        kept.resize_with(wanted.len(), || None);
        let mut notes = Vec::new();
        let mut held = 0;
        for (index, ((table, automatic), kept)) in wanted.into_iter().zip(kept).enumerate() {
            let most = table.max_bytes.unwrap_or(DEFAULT_MAX_BYTES);
            let (ingredients, automatic) = if let Some(kept) = kept {
                (kept.ingredients, kept.automatic)
            } else {
                let left = most.saturating_sub(held);
                let left = VolumeTable { max_bytes: Some(left), ..file.volume[index].clone() };
                let loaded = load_ingredients(&left, scan);
                let (own, said) = loaded.map_err(|error| beside(error, held))?;
                notes.extend(said);
                (own, automatic)
            };
            held += ingredients.bytes();
            if held > most {
                let what = format!("{} volumes together", index + 1);
                let (needed, limit) = (format!("{held} bytes"), format!("{most} bytes"));
                return Err(ErrorKind::Limit { what, needed, limit }.into());
            }
            self.loaded.push(OfTable { table, automatic, ingredients });
        }
        let volumes = self.loaded.iter().map(|loaded| loaded.ingredients.clone()).collect();
        let surfaces = self.surfaces(file, &mut notes)?;
        Ok((Loaded { volumes, surfaces }, notes))
    }

    /// The surfaces of `file`; `notes` get what there is to say of those that were not loaded
    /// before.
    fn surfaces(&mut self, file: &SceneFile, notes: &mut Vec<String>) -> Result<Surfaces> {
        let known = std::mem::take(&mut self.shapes);
        let mut surfaces = Vec::new();
        for (what, table) in file.surfaces() {
            // Its place is no part of what is loaded.
            let SurfaceTable { path, albedo, opacity, thickness, .. } = table.clone();
            let key = SurfaceTable { path, albedo, opacity, thickness, ..SurfaceTable::default() };
            let key = (what, key);
            let loaded = known.iter().chain(&self.shapes);
            let shape = match loaded.into_iter().find(|(known, _)| *known == key) {
                Some((_, shape)) => shape.clone(),
                None => {
                    let (shape, said) = load_shape(what, table)?;
                    notes.extend(said);
                    shape
                }
            };
            surfaces.push(place_shape(what, table, &shape)?);
            self.shapes.push((key, shape));
        }
        Ok(surfaces.into())
    }
}

/// The keys of a table on which it depends what is loaded.
fn what_is_loaded(table: &VolumeTable) -> VolumeTable {
    let mut table = table.clone();
    table.density_scale = None;
    (table.albedo, table.phase_g, table.tint) = (None, None, None);
    if let Some(emission) = &mut table.emission {
        (emission.colors, emission.range, emission.kelvin) = (None, None, None);
        (emission.radiance, emission.scale) = (None, None);
    }
    table
}

/// Adds to an error of too much memory what other volumes have taken already.
fn beside(error: Error, held: u64) -> Error {
    match error.kind() {
        ErrorKind::Limit { what, needed, limit } if held > 0 => {
            let limit = format!("{limit}, in addition to {held} bytes of other volumes");
            ErrorKind::Limit { what: what.clone(), needed: needed.clone(), limit }.into()
        }
        _ => error,
    }
}
