//! The tables of a scene file for meshes and hair.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::file::{SceneFile, tables};
use super::keyframes::PlaceKeyframe;

tables! {
    /// `[mesh]`: triangles that cast shadows.
    MeshTable {
        /// OBJ or glTF file.
        path: PathBuf,
        /// Reflectance, linear RGB, 0..1; the file's own by default.
        albedo: [f64; 3],
        /// The share of light that one crossing takes, 0..1; the file's own by default.
        opacity: f64,
        /// Axis of the file that points up, such as `z` or `-y`; `y` by default.
        up: String,
        /// Translation in world lengths, after `rotate_degrees` and `scale`.
        translate: [f64; 3],
        /// Angles in degrees about the world's x, y and z axes, in this order.
        rotate_degrees: [f64; 3],
        /// Scaling about the world's origin, above 0; 1 by default.
        scale: f64,
        /// Whether it casts shadows; yes by default.
        casts: bool,
        /// Whether shadows fall on it; yes by default.
        receives: bool,
        /// Values at numbered frames.
        keyframes: Vec<PlaceKeyframe>,
    }
    /// `[hair]`: strands that cast shadows.
    HairTable {
        /// `.hair` or TressFX file.
        path: PathBuf,
        /// Reflectance, linear RGB, 0..1; the file's own by default.
        albedo: [f64; 3],
        /// The share of light that one crossing of a strand takes, 0..1; the file's own by default.
        opacity: f64,
        /// Diameter of a strand in the file's lengths; the file's own by default.
        thickness: f64,
        /// Axis of the file that points up, such as `z` or `-y`; `z` for .hair files and `y` for
        /// others by default.
        up: String,
        /// Translation in world lengths, after `rotate_degrees` and `scale`.
        translate: [f64; 3],
        /// Angles in degrees about the world's x, y and z axes, in this order.
        rotate_degrees: [f64; 3],
        /// Scaling about the world's origin, above 0; 1 by default.
        scale: f64,
        /// Whether it casts shadows; yes by default.
        casts: bool,
        /// Whether shadows fall on it; yes by default.
        receives: bool,
        /// Values at numbered frames.
        keyframes: Vec<PlaceKeyframe>,
    }
}

impl SceneFile {
    /// Whether there is nothing in it that casts a shadow.
    pub fn is_bare(&self) -> bool {
        self.volume.is_empty() && self.mesh.is_empty() && self.hair.is_empty()
    }

    /// The albedos of meshes and hair.
    pub fn surface_albedos_mut(&mut self) -> impl Iterator<Item = &mut Option<[f64; 3]>> {
        let meshes = self.mesh.iter_mut().map(|table| &mut table.albedo);
        meshes.chain(self.hair.iter_mut().map(|table| &mut table.albedo))
    }

    /// The paths of meshes and hair.
    pub fn surface_paths_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let meshes = self.mesh.iter_mut().filter_map(|table| table.path.as_mut());
        meshes.chain(self.hair.iter_mut().filter_map(|table| table.path.as_mut()))
    }
}
