//! Claims about volume files. Each format has files of its own.

mod deep_exr;
mod deep_exr_odd;
mod dense_fixtures;
mod dense_hostile;
mod dense_truth;
mod dense_write;
mod fuzz_targets;
mod vdb_blocks;
mod vdb_bytes;
mod vdb_dense;
mod vdb_fixtures;
mod vdb_headers;
mod vdb_hostile;
mod vdb_peer;
mod vdb_truth;
mod vdb_write;

pub use vdb_fixtures::fixture as vdb_fixture;
pub use vdb_hostile::fixtures as vdb_fixture_files;
pub use vdb_truth::shared_files as shared_vdb;
