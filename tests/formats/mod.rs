//! Claims about files of volumes, hair and meshes. Each format has files of its own.

mod deep_by_others;
mod deep_exr;
mod deep_exr_odd;
mod dense_ambiguous;
mod dense_by_others;
mod dense_fixtures;
mod dense_hostile;
mod dense_spaces;
mod dense_truth;
mod dense_write;
mod fixture_list;
mod fuzz_targets;
mod nanovdb_fixtures;
mod surface_fixtures;
mod surfaces;
mod surfaces_hostile;
mod surfaces_mesh;
mod surfaces_write;
mod vdb_blocks;
mod vdb_bytes;
mod vdb_dense;
mod vdb_fixtures;
mod vdb_headers;
mod vdb_hostile;
mod vdb_peer;
mod vdb_truth;
mod vdb_write;

pub use deep_exr::{COMPRESSIONS as DEEP_COMPRESSIONS, small_image as small_deep_image};
pub use dense_fixtures::{cases as dense_cases, gzip};
pub use nanovdb_fixtures::{BUMPS as NANOVDB_FIXTURES, bytes_of as nanovdb_fixture};
pub use surface_fixtures::{MTL as MATERIALS, OBJ, seeds as surface_seeds};
pub use vdb_fixtures::fixture as vdb_fixture;
pub use vdb_hostile::{Random as Xorshift, fixtures as vdb_fixture_files, mutate};
