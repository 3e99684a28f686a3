//! The tables of a scene file for meshes and hair.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::file::{SceneFile, tables};
use super::keyframes::PlaceKeyframe;

tables! {
    /// `[mesh]` and `[hair]`: triangles and strands that cast shadows.
    SurfaceTable {
        /// OBJ or glTF file of a mesh; `.hair` or TressFX file of hair.
        path: PathBuf,
        /// Reflectance, linear RGB, 0..1; the file's own by default.
        albedo: [f64; 3],
        /// The share of light that one crossing takes, 0..1; the file's own by default.
        opacity: f64,
        /// Of hair alone: diameter of a strand in the file's lengths; the file's own by default.
        thickness: f64,
        /// Of hair alone: how bright its highlights are, 0..1; 0.1 by default.
        specular: f64,
        /// Of hair alone: how narrow its highlights are, at least 1; 40 by default.
        shininess: f64,
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
        self.volume.is_empty() && !self.has_surfaces()
    }

    /// Whether there are meshes or hair.
    pub fn has_surfaces(&self) -> bool {
        self.surfaces().next().is_some()
    }

    /// The tables of meshes and hair, each with its name.
    pub fn surfaces(&self) -> impl Iterator<Item = (&'static str, &SurfaceTable)> {
        let meshes = self.mesh.iter().map(|table| ("mesh", table));
        meshes.chain(self.hair.iter().map(|table| ("hair", table)))
    }

    /// The tables of meshes and hair, to be changed.
    pub fn surfaces_mut(&mut self) -> impl Iterator<Item = &mut SurfaceTable> {
        self.mesh.iter_mut().chain(self.hair.iter_mut())
    }
}
