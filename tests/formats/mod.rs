//! Claims about volume files. Each format has files of its own.

mod vdb_blocks;
mod vdb_bytes;
mod vdb_dense;
mod vdb_fixtures;
mod vdb_headers;
mod vdb_hostile;
mod vdb_truth;
