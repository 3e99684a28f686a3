//! The interface of a renderer: maps and pictures of scenes, the passes behind them one by one, and
//! pictures one after another.

mod catcher;
mod fallback;
mod passes;
mod stage;

use crate::error::{Error, Result, memory};
use crate::image::Image;
use crate::progress::Progress;
use crate::scene::{Beam, Scene, Surfaces};
use crate::settings::{MapKind, Settings};
use crate::shadow::{Map, codec};
pub use catcher::ShadowCatcher;
pub use fallback::Fallback;
pub use passes::Passes;
use passes::{build_map, view_through};
#[cfg(feature = "gpu")]
pub(crate) use passes::{check_kind, unbuilt};
pub use stage::{Cause, HostStage, Stage};

/// What is known about a scene before it is loaded: one volume under parallel light, with the usual
/// settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Its extinction is its density times a constant.
    Plain,
    /// It has a transfer function.
    Function,
}

/// A renderer. Intermediate results stay where they are made, on the host or on a device. Maps are
/// transferred only when requested ([`Backend::map`]) or passed in ([`Backend::view`]), pictures
/// when they are finished.
pub trait Backend: Send + Sync {
    /// Description for people of what does the work: the processor or the graphics adapter.
    fn description(&self) -> String;

    /// The passes that everything else consists of, one by one.
    fn passes(&self) -> &dyn Passes;

    /// Whether this backend builds maps of `kind` and marches through them.
    fn builds(&self, kind: MapKind) -> bool {
        matches!(kind, MapKind::Threshold | MapKind::Fragments)
    }

    /// Whether this backend builds maps of `kind` of surfaces, and pictures of them through such.
    fn draws_surfaces(&self, _kind: MapKind) -> bool {
        false
    }

    /// Prepares, before a scene is known, what pictures through maps of `kind` will need if their
    /// scene is as `expected`. It is a hint: if it is wrong, it only costs time.
    fn expect(&self, _kind: Option<MapKind>, _expected: Expected) {}

    /// Checks, before any work, `settings` and that there is room for their picture and map.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] with what they take, if there is not, and those of
    /// [`Settings::check`].
    fn check_room(&self, settings: &Settings) -> Result<()> {
        check_host(settings)
    }

    /// Builds the shadow map of `beam`, of the kind in `settings`, and transfers it to the host.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if this backend does not build maps
    /// of the kind, or if the device fails or runs out of memory.
    fn map(&self, beam: &Beam, settings: &Settings, progress: &dyn Progress) -> Result<Map> {
        build_map(self.passes(), beam, settings, progress)
    }

    /// The picture of `beam`, lit through a map on the host, in linear radiance.
    ///
    /// # Errors
    /// If a setting is out of its range ([`Settings::check`]), if this backend does not march
    /// through such maps, or if the device fails or runs out of memory.
    fn view(
        &self,
        beam: &Beam,
        settings: &Settings,
        map: &Map,
        progress: &dyn Progress,
    ) -> Result<Image> {
        view_through(self.passes(), beam, settings, map, progress)
    }

    /// A stage, which makes pictures one after another and keeps what does not change between them.
    fn stage(&self) -> Box<dyn Stage + '_> {
        Box::new(HostStage::new(self.passes()))
    }

    /// The picture of `scene` in linear radiance: for each of its beams the map, then the camera
    /// march.
    ///
    /// # Errors
    /// As [`Stage::render`].
    fn render(&self, scene: &Scene, settings: &Settings, progress: &dyn Progress) -> Result<Image> {
        self.stage().render(scene, settings, progress)
    }
}

/// Checks that `backend` builds maps of `kind` of what `surfaces` there are.
///
/// # Errors
/// If it does not, and there are some.
pub fn check_surfaces(backend: &dyn Backend, surfaces: &Surfaces, kind: MapKind) -> Result<()> {
    if surfaces.is_empty() || backend.draws_surfaces(kind) {
        return Ok(());
    }
    Err(draws_no_surfaces(&backend.description(), kind))
}

/// The error of a renderer that makes no pictures of surfaces through maps of `kind`.
pub(crate) fn draws_no_surfaces(description: &str, kind: MapKind) -> Error {
    Error::value("backend", format!("{description} builds no '{kind}' maps of meshes and hair"))
}

/// Checks `settings`, and that the host has room for their picture and map.
///
/// # Errors
/// [`crate::ErrorKind::Limit`] with what they take, if it has not, and those of
/// [`Settings::check`].
pub fn check_host(settings: &Settings) -> Result<()> {
    // The sum of all beams, the picture of one beam, and the file.
    const COPIES: u64 = 3;
    const PIXEL: u64 = 16;
    settings.check()?;
    let [width, height] = settings.image.size;
    let texels = u64::from(settings.map.size) * u64::from(settings.map.size);
    let texel = match settings.map.kind {
        Some(MapKind::Coded(coding)) => codec(coding).stride() as u64,
        // Lists allocate their memory separately.
        Some(_) | None => PIXEL,
    };
    let picture = u64::from(width) * u64::from(height) * PIXEL * COPIES;
    memory::check(picture, &format!("a picture of {width}x{height}"))?;
    let size = settings.map.size;
    memory::check(picture + texels * texel * COPIES, &format!("a map of {size}x{size}"))
}
