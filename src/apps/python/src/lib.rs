//! The face of `deepshadow` for Python: arrays in, arrays out. It has no logic of its own but the
//! conversion of values; what is computed is the library's.

mod backends;
mod comparison;
mod errors;
mod files;
mod held;
mod keywords;
mod light;
mod loading;
mod maps;
mod mesh;
mod metadata;
mod numbers;
mod picture;
mod placement;
mod scene;
mod sparse;
mod strands;
mod surfaces;
mod tables;
mod vectors;
mod volume;
mod work;
mod writing;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    #[pymodule_export]
    use super::comparison::{Comparison, compare};
    #[pymodule_export]
    use super::files::{GridInfo, VolumeFile, open, read};
    #[pymodule_export]
    use super::light::transmittance;
    #[pymodule_export]
    use super::maps::{ShadowMap, choose, shadow_map};
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::picture::{Image, render};
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::sparse::SparseGrid;
    #[pymodule_export]
    use super::strands::Strands;
    #[pymodule_export]
    use super::surfaces::read_surface;
    #[pymodule_export]
    use super::volume::Volume;
    #[pymodule_export]
    use super::writing::write;
}
