//! Surfaces: meshes of triangles, and strands such as hair. They hold arrays as files store them,
//! in a space of their own. Knows no file format, no light and no place in the world.

mod mesh;
mod normals;
mod strands;

pub use mesh::{Material, Mesh};
pub use strands::{Segment, Strands, Varying};
