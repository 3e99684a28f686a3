//! Scene files that repeat a picture: what was given, and everything that was chosen.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::file::{LightTable, SceneFile};
use super::{LightKind, Projection, Scene};
use crate::error::{Error, Result};
use crate::settings::Settings;

impl SceneFile {
    /// This file with the values that `scene` and `settings`, which were completed from it, have in
    /// place of those left out. `windows` are those that were chosen for the volumes. Paths become
    /// absolute. A scene without background keeps none in the file: that is no key.
    ///
    /// # Errors
    /// If the current folder is needed and not known.
    pub fn saved(
        &self,
        windows: &[Option<[f32; 2]>],
        scene: &Scene,
        settings: &Settings,
    ) -> Result<Self> {
        let mut file = self.with_absolute_paths()?;
        let bodies = scene.media.bodies().iter();
        for ((table, body), window) in file.volume.iter_mut().zip(bodies).zip(windows) {
            let medium = &body.medium;
            table.density_scale = Some(medium.density_scale);
            table.albedo = Some(medium.albedo.to_array());
            table.phase_g = Some(medium.phase_g);
            table.window = table.window.or(*window);
            if let (Some(table), Some(emission)) = (&mut table.emission, &medium.emission) {
                (table.scale, table.radiance) = (Some(emission.scale), None);
            }
        }
        // Without any table one light is chosen.
        file.light.one_mut();
        for (table, light) in file.light.iter_mut().zip(&scene.lights) {
            table.irradiance = Some(light.irradiance.to_array());
            place(table, light.kind);
        }
        let camera = &scene.camera;
        let table = &mut file.camera;
        (table.azimuth_degrees, table.elevation_degrees) = (None, None);
        (table.distance, table.zoom, table.fit) = (None, None, None);
        table.position = Some(camera.position.to_array());
        table.target = Some(camera.target.to_array());
        table.up = Some(camera.up.to_array());
        match camera.projection {
            Projection::Perspective { fov_y_degrees } => {
                table.fov_y_degrees = Some(fov_y_degrees);
            }
            Projection::Orthographic { height } => table.height = Some(height),
        }
        file.ambient.radiance = Some(scene.ambient.to_array());
        file.background.radiance = scene.background.map(|radiance: DVec3| radiance.to_array());
        file.ground.enabled = Some(scene.ground.is_some());
        if let Some(ground) = scene.ground {
            (file.ground.height, file.ground.albedo) = (Some(ground.height), Some(ground.albedo));
        }
        let [width, height] = settings.image.size;
        (file.image.width, file.image.height) = (Some(width), Some(height));
        let image = &settings.image;
        (file.image.tolerance, file.image.samples) = (Some(image.tolerance), Some(image.samples));
        (file.shadow.size, file.shadow.quality) = (Some(settings.map.size), Some(settings.quality));
        Ok(file)
    }

    /// This file with absolute paths, which mean the same wherever the file is put. A browser has no
    /// folders, so there paths stay as they are.
    ///
    /// # Errors
    /// If the current folder is needed and not known.
    pub fn with_absolute_paths(&self) -> Result<Self> {
        let mut file = self.clone();
        for table in file.volume.iter_mut() {
            let function = table.transfer.as_mut().and_then(|transfer| transfer.file.as_mut());
            for path in table.path.as_mut().into_iter().chain(function) {
                *path = absolute(path)?;
            }
        }
        for path in file.surfaces_mut().filter_map(|table| table.path.as_mut()) {
            *path = absolute(path)?;
        }
        Ok(file)
    }

    /// The text of the file.
    ///
    /// # Errors
    /// If a path is not Unicode, which TOML requires.
    pub fn to_text(&self) -> Result<String> {
        toml::to_string(self).map_err(|error| Error::value("scene", error.to_string()))
    }
}

fn absolute(path: &Path) -> Result<PathBuf> {
    if cfg!(target_family = "wasm") {
        // A browser has no folders: files have the names that people see.
        return Ok(path.to_owned());
    }
    std::path::absolute(path).map_err(|error| Error::file(path, error))
}

/// Writes where a light is and where it shines.
pub(super) fn place(table: &mut LightTable, kind: LightKind) {
    match kind {
        LightKind::Directional { direction } => table.direction = Some(direction.to_array()),
        LightKind::Point { position } => table.position = Some(position.to_array()),
        LightKind::Spot { position, direction, cone_degrees, cone_softness } => {
            table.position = Some(position.to_array());
            table.direction = Some(direction.to_array());
            (table.cone_degrees, table.cone_softness) = (Some(cone_degrees), Some(cone_softness));
        }
    }
}
