//! What is loaded for wishes, on threads of their own.

use std::sync::Arc;

use deepshadow::io::vdb::VdbFile;
use deepshadow::io::{Format, SceneLoader};
use deepshadow::scene::automatic::Ingredients;
use deepshadow::scene::file::VolumeTable;

use super::pace::Motion;
use super::progress::{Arrival, Doing};
use super::worker::Worker;
use super::{Event, Wish};
use crate::host::threads;
use crate::panels::{Known, OfDensities};

/// Something that is being loaded.
pub(super) struct Loading {
    /// The number of the wish.
    pub(super) serial: u64,
    pub(super) side: usize,
    pub(super) wish: Box<Wish>,
}

impl Worker {
    /// Takes what was loaded.
    pub(super) async fn arrived(&mut self, arrival: Arrival) {
        let Arrival { serial, side, loader, loaded, grids, histograms } = arrival;
        let is_own = |loading: &mut Loading| (loading.serial, loading.side) == (serial, side);
        let Some(Loading { wish, .. }) = self.loading.take_if(is_own) else { return };
        match loaded {
            Ok((_, notes)) => {
                let latest = self.wish.as_ref().map(|(_, latest)| latest);
                // Somebody who went back does not want it any more.
                let same = latest.is_some_and(|latest| latest.document == wish.document);
                if same || !latest.is_some_and(|latest| self.holds(side, latest)) {
                    self.sides[side].take(wish.document, loader, histograms);
                    if side == 0 {
                        (self.tell)(Event::Loaded { document: wish.document, notes, grids });
                    }
                }
                // What was wished for meanwhile may need something else: this is shown until then.
                let held = self.wish.as_ref().is_some_and(|(_, latest)| self.holds(0, latest));
                if same && !held && side == 0 {
                    let hurried = Wish { motion: Motion::Light, ..*wish };
                    let _ = self.fulfil(serial, &hurried).await;
                }
            }
            Err(error) => {
                (self.tell)(Event::Failed { serial, why: error.to_string(), loading: true });
                self.wish.take_if(|(latest, _)| *latest == serial);
            }
        }
        self.serve().await;
    }

    /// Whether everything is loaded that one side of a wish needs.
    pub(super) fn holds(&self, side: usize, wish: &Wish) -> bool {
        let own = &self.sides[side];
        own.document == Some(wish.document)
            && wish.files()[side].is_none_or(|file| own.loader.holds(file, wish.scans()))
    }

    /// Begins to load what one side of `wish` needs, unless something is being loaded already.
    pub(super) fn load(&mut self, serial: u64, side: usize, wish: &Wish) {
        if self.loading.is_some() {
            return;
        }
        let Some(file) = wish.files()[side].cloned() else { return };
        let names = file.volume.iter().filter_map(|table| table.path.clone());
        let names = names.chain(file.surfaces().filter_map(|(_, table)| table.path.clone()));
        let name = names.last().and_then(|path| Some(path.file_name()?.display().to_string()));
        let own = &self.sides[side];
        let same = own.document == Some(wish.document);
        let doing = if same { "updating" } else { "loading" };
        let what = format!("{doing} {}", name.unwrap_or_else(|| "the scene".to_owned()));
        self.shared.say(Some(Doing { what, share: None }));
        self.loading = Some(Loading { serial, side, wish: Box::new(wish.clone()) });
        let scan = wish.scans();
        // The files of another document may have changed since they were read for it.
        let mut loader = if same { own.loader.clone() } else { SceneLoader::default() };
        let (mut histograms, shared) = (own.histograms.clone(), self.shared.clone());
        let work = move || {
            let loaded = loader.load(&file, scan);
            let grids = file.volume.iter().map(grid_names).collect();
            let volumes = loaded.as_ref().map_or(&[][..], |(loaded, _)| &loaded.volumes[..]);
            histograms = volumes.iter().map(|own| histogram(own, &histograms)).collect();
            shared.arrive(Arrival { serial, side, loader, loaded, grids, histograms });
        };
        if let Err(error) = threads::start("loading", work) {
            self.loading = None;
            let why = format!("the system starts no thread: {error}");
            (self.tell)(Event::Failed { serial, why, loading: true });
        }
    }
}

/// The histogram of a volume, which may be `known`.
fn histogram(own: &Ingredients, known: &[Known]) -> Known {
    let made = || Arc::new(OfDensities::of(&own.volume, &own.densities));
    (own.volume.clone(), crate::panels::known(known, &own.volume).unwrap_or_else(made))
}

/// The names of the grids in a volume's file, if it is OpenVDB.
fn grid_names(table: &VolumeTable) -> Vec<String> {
    let Some(path) = &table.path else { return Vec::new() };
    let file = Format::of_file(path).ok().filter(|format| *format == Format::OpenVdb);
    let file = file.and_then(|_| VdbFile::open(path).ok());
    let grids = file.iter().flat_map(VdbFile::grids);
    grids.map(|grid| grid.name.clone()).collect()
}
