//! What a renderer does: maps and pictures of scenes; the passes that they are made by, one by one;
//! and pictures one after another.

mod passes;
mod stage;

use crate::error::{Result, memory};
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Scene};
use crate::settings::{MapKind, Settings};
use crate::shadow::{Map, codec};
pub use passes::Passes;
use passes::{build_map, view_through};
pub use stage::{Cause, HostStage, Stage};

/// What is known of a scene before it is loaded: one volume under parallel light, with the usual
/// settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Whose extinction is its density times a number.
    Plain,
    /// Seen through a transfer function.
    Function,
}

/// A renderer. What it makes on the way to a picture stays where it is made, on the host or on a
/// device; maps cross over where they are asked for ([`Backend::map`]) or brought
/// ([`Backend::view`]), and pictures at their end.
pub trait Backend: Send + Sync {
    /// What does the work, for people: the processor or the graphics adapter.
    fn description(&self) -> String;

    /// The kind of map that is built where none is asked for: the exact one where it costs little
    /// more than the other.
    fn default_map(&self) -> MapKind;

    /// The passes that all else is made by, one by one.
    fn passes(&self) -> &dyn Passes;

    /// Whether maps of `kind` are built and marched through here.
    fn builds(&self, kind: MapKind) -> bool {
        matches!(kind, MapKind::Threshold | MapKind::Fragments)
    }

    /// Makes ready, before a scene is there, what its pictures through maps of `kind` will take, if
    /// they are as `expected`. A hint: what it says wrong costs time alone.
    fn expect(&self, _kind: Option<MapKind>, _expected: Expected) {}

    /// Makes sure, before any work, that there is room for the picture and the map of `settings`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] with what they take, if there is none.
    fn check_room(&self, settings: &Settings) -> Result<()> {
        check_host(settings)
    }

    /// The shadow map of `beam`, of the kind that `settings` ask for, brought to the host.
    ///
    /// # Errors
    /// If maps of the kind are not built here, or if the device fails or runs out of memory.
    fn map(&self, beam: &Beam, settings: &Settings, progress: &dyn Progress) -> Result<Map> {
        build_map(self.passes(), beam, settings, progress)
    }

    /// The picture of `beam`, lit through a map that the host holds.
    ///
    /// # Errors
    /// If such maps are not marched through here, or if the device fails or runs out of memory.
    fn view(
        &self,
        beam: &Beam,
        settings: &Settings,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        view_through(self.passes(), beam, settings, map, progress)
    }

    /// What makes pictures one after another, and keeps what stays the same between them.
    fn stage(&self) -> Box<dyn Stage + '_> {
        Box::new(HostStage::new(self.passes()))
    }

    /// A picture of `scene`: for each of its beams the map, then the camera march.
    ///
    /// # Errors
    /// As [`Stage::render`].
    fn render(&self, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Image> {
        self.stage().render(scene, settings, progress)
    }
}

/// Makes sure that the host has room for the picture and the map of `settings`.
///
/// # Errors
/// [`crate::ErrorKind::Limit`] with what they take, if it has none.
pub fn check_host(settings: &Settings) -> Result<()> {
    // The sum of all beams, that of one, and the file.
    const COPIES: u64 = 3;
    const PIXEL: u64 = 16;
    let [width, height] = settings.image.size;
    let texels = u64::from(settings.map.size) * u64::from(settings.map.size);
    let texel = match settings.map.kind {
        Some(MapKind::Coded(coding)) => codec(coding).stride() as u64,
        // Lists ask for their own.
        Some(_) | None => PIXEL,
    };
    let picture = u64::from(width) * u64::from(height) * PIXEL * COPIES;
    memory::check(picture, &format!("a picture of {width}x{height}"))?;
    let size = settings.map.size;
    memory::check(picture + texels * texel * COPIES, &format!("a map of {size}x{size}"))
}
