//! Bodies: volumes with their optical properties.

use std::sync::Arc;

use glam::DVec3;

use super::TransferFunction;
use crate::volume::Volume;

/// A volume with its optical properties.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Body {
    /// The densities, shared, so that scenes are cheap to copy and change.
    pub volume: Arc<Volume>,
    /// The optical properties.
    pub medium: Medium,
}

/// Optical properties as functions of density: extinction, scattering and emission.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Medium {
    /// Extinction per unit of density, 1 / world length; at least 0. With a transfer function it is
    /// the extinction where opacity is 1.
    pub density_scale: f64,
    /// Factor on the extinction of each colour channel, at least 0; white for a grey medium.
    pub tint: DVec3,
    /// Share of the extinguished light that is scattered, per channel, 0..1.
    pub albedo: DVec3,
    /// Henyey and Greenstein's g, the mean cosine of the scattering angle, -1 < g < 1; 0 is
    /// isotropic.
    pub phase_g: f64,
    /// Colour and opacity over density; if `None`, extinction is proportional to density.
    pub transfer: Option<Arc<TransferFunction>>,
    /// Factor on the albedo that varies in space: red, green and blue, 0..1.
    pub color: Option<[Arc<Volume>; 3]>,
    /// Factor on the extinction that varies in space, 0..1.
    pub modulation: Option<Arc<Volume>>,
    /// Light that the medium emits. It casts no shadows and is not scattered.
    pub emission: Option<Emission>,
}

/// Emission of a medium.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Emission {
    /// The grid that determines the emission; `None` for the densities themselves.
    pub field: Option<Arc<Volume>>,
    /// Colour over the field's values; its opacity is a factor on the colour.
    pub ramp: Arc<TransferFunction>,
    /// Radiance per world length where colour and opacity are 1.
    pub scale: f64,
}

impl Body {
    /// A volume with its optical properties.
    pub fn new(volume: Arc<Volume>, medium: Medium) -> Self {
        Self { volume, medium }
    }
}

impl Emission {
    /// Emission over the densities themselves.
    pub fn new(ramp: Arc<TransferFunction>, scale: f64) -> Self {
        Self { field: None, ramp, scale }
    }

    /// The same over the values of another grid.
    #[must_use]
    pub fn over(self, field: Arc<Volume>) -> Self {
        Self { field: Some(field), ..self }
    }
}

impl Default for Medium {
    /// A white medium: all light is scattered isotropically, and extinction equals density.
    fn default() -> Self {
        Self {
            density_scale: 1.0,
            tint: DVec3::ONE,
            albedo: DVec3::ONE,
            phase_g: 0.0,
            transfer: None,
            color: None,
            modulation: None,
            emission: None,
        }
    }
}

impl Medium {
    /// A copy with a change.
    #[must_use]
    pub fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// A white medium with extinction `density_scale` per unit of density, in 1 / world length.
    pub fn new(density_scale: f64) -> Self {
        Self { density_scale, ..Self::default() }
    }

    /// Whether all properties are equal and refer to the same volumes in memory.
    pub(super) fn same(&self, other: &Self) -> bool {
        let grids = |medium: &Self| {
            let emitted = medium.emission.as_ref().and_then(|emission| emission.field.clone());
            let color = medium.color.iter().flatten().cloned();
            color
                .chain(medium.modulation.clone())
                .chain(emitted)
                .map(|grid| Arc::as_ptr(&grid))
                .collect::<Vec<_>>()
        };
        let kinds = |medium: &Self| {
            let emission = medium.emission.as_ref();
            let field = emission.map(|emission| emission.field.is_some());
            (medium.color.is_some(), medium.modulation.is_some(), field)
        };
        let emission = |medium: &Self| {
            medium.emission.as_ref().map(|emission| (emission.ramp.clone(), emission.scale))
        };
        let numbers =
            |medium: &Self| (medium.density_scale, medium.tint, medium.albedo, medium.phase_g);
        numbers(self) == numbers(other)
            && kinds(self) == kinds(other)
            && self.transfer == other.transfer
            && emission(self) == emission(other)
            && grids(self) == grids(other)
    }

    /// Whether extinction is density times a constant and nothing else varies in space.
    pub fn is_plain(&self) -> bool {
        self.transfer.is_none()
            && self.color.is_none()
            && self.modulation.is_none()
            && self.emission.is_none()
    }
}
