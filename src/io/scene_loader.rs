//! Loads the volumes and surfaces of scene files one after another, and keeps those that stay the
//! same.

use std::mem::take;

use super::body::load_ingredients_like;
use super::dense::DEFAULT_MAX_BYTES;
use super::placed::{LoadedShape, load_shape, place_shape};
use crate::error::{Error, ErrorKind, Result};
use crate::scene::automatic::{Ingredients, Loaded};
use crate::scene::file::{SurfaceTable, VolumeTable};
use crate::scene::{SceneFile, Surfaces};

/// Loads scene files one after another, such as the frames of a sequence or a scene that is being
/// edited, and keeps what stays the same: volumes and shapes that the next file names too are not
/// read again.
///
/// Clones share what was loaded.
#[derive(Clone, Debug, Default)]
pub struct SceneLoader {
    loaded: Vec<OfTable>,
    /// The shapes of surfaces, and what they were loaded for.
    shapes: Vec<(OfSurface, LoadedShape)>,
}

/// The name of a table of surfaces, and the table.
type OfSurface = (&'static str, SurfaceTable);

#[derive(Clone, Debug)]
struct OfTable {
    /// What it was loaded for.
    table: VolumeTable,
    /// Whether a window could be chosen.
    automatic: bool,
    ingredients: Ingredients,
}

impl SceneLoader {
    /// The volumes and surfaces of `file`, and what there is to say of those that were not loaded
    /// before. `scan` as of [`load_ingredients`](super::load_ingredients). What `file` does not name
    /// is let go before anything is read; after an error it may have to be read again.
    ///
    /// # Errors
    /// If one cannot be loaded, or if they are too large together.
    pub fn load(&mut self, file: &SceneFile, scan: bool) -> Result<(Loaded, Vec<String>)> {
        let tables: Vec<_> = file.volume.iter().map(|table| wanted(table, scan)).collect();
        let mut known: Vec<Option<OfTable>> =
            take(&mut self.loaded).into_iter().map(Some).collect();
        known.resize_with(tables.len(), || None);
        for ((table, _), known) in tables.iter().zip(&mut known) {
            *known = known.take().filter(|known| known.is_like(table));
        }
        let mut notes = Vec::new();
        let mut held = 0;
        for (index, ((table, automatic), known)) in tables.into_iter().zip(known).enumerate() {
            let most = table.max_bytes.unwrap_or(DEFAULT_MAX_BYTES);
            let (ingredients, automatic) = if let Some(known) = &known
                && known.suits(&table, automatic)
            {
                (known.ingredients.clone(), known.automatic)
            } else {
                let left = most.saturating_sub(held);
                let left = VolumeTable { max_bytes: Some(left), ..file.volume[index].clone() };
                let like = known.as_ref().map(|known| &known.ingredients);
                let loaded = load_ingredients_like(&left, scan, like);
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

    /// Whether [`SceneLoader::load`] would read no file for `file`, so that it is quick.
    pub fn holds(&self, file: &SceneFile, scan: bool) -> bool {
        let mut volumes = file.volume.iter().enumerate();
        let volumes = volumes.all(|(index, table)| {
            let (table, automatic) = wanted(table, scan);
            self.loaded.get(index).is_some_and(|known| known.suits(&table, automatic))
        });
        volumes
            && file.surfaces().all(|(what, table)| {
                let key = shape_of(what, table);
                self.shapes.iter().any(|(known, _)| *known == key)
            })
    }

    /// The surfaces of `file`; `notes` get what there is to say of those that were not loaded
    /// before.
    fn surfaces(&mut self, file: &SceneFile, notes: &mut Vec<String>) -> Result<Surfaces> {
        let known = take(&mut self.shapes);
        let mut surfaces = Vec::new();
        for (what, table) in file.surfaces() {
            let key = shape_of(what, table);
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

impl OfTable {
    /// Whether it is what a table wants.
    fn suits(&self, table: &VolumeTable, automatic: bool) -> bool {
        // What has no window, although one could be chosen, has none without choice.
        let has_none = self.automatic && self.ingredients.window.is_none();
        *table == self.table && (automatic == self.automatic || has_none)
    }

    /// Whether a table differs in nothing but the transfer function and what is clipped, so that the
    /// volume need not be read again.
    fn is_like(&self, table: &VolumeTable) -> bool {
        let (clip, transfer) = (self.table.clip, self.table.transfer.clone());
        VolumeTable { clip, transfer, ..table.clone() } == self.table
    }
}

/// What a table wants loaded, and whether a window may be chosen for it.
fn wanted(table: &VolumeTable, scan: bool) -> (VolumeTable, bool) {
    (what_is_loaded(table), scan || table.density_scale.is_none())
}

/// The name and the keys of a table on which it depends what shape is loaded; its place is none.
fn shape_of(what: &'static str, table: &SurfaceTable) -> OfSurface {
    let SurfaceTable { path, albedo, opacity, thickness, .. } = table.clone();
    (what, SurfaceTable { path, albedo, opacity, thickness, ..SurfaceTable::default() })
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
