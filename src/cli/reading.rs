//! Options for reading a volume file.

use clap::Args;

use super::arguments::{Numbers, dims, numbers, overlay, valid, value_type};
use crate::io::fog::Class;
use crate::io::format::Format;
use crate::io::number::Endian;
use crate::scene::file::VolumeTable;

/// How to read a volume file, as options.
#[derive(Debug, Args)]
pub(super) struct FileArguments {
    /// Format of the file, regardless of how it begins: openvdb, npy, nrrd, metaimage, pvm, nifti,
    /// vti, mitsuba-vol, den, nanovdb, deep-exr, hair, tfx, obj, gltf, raw.
    #[arg(long, value_name = "FORMAT", value_parser = valid::<Format>, help_heading = "Volume")]
    pub from: Option<String>,
    /// Grid to read from a file that holds several.
    #[arg(long, value_name = "NAME", help_heading = "Volume")]
    pub grid: Option<String>,
    /// Bytes that a volume's voxels may take [4 GiB].
    #[arg(long, value_name = "N", help_heading = "Volume")]
    pub max_bytes: Option<u64>,
    /// Voxels of raw data along x, y, z; also XxYxZ.
    #[arg(long, value_name = "X,Y,Z", value_parser = dims, help_heading = "Volume")]
    pub dims: Option<Numbers<usize, 3>>,
    /// Number type of raw data: u8, i8, u16, i16, u32, i32, f16, f32, f64; also uint8, float32 and
    /// the like.
    #[arg(long = "type", value_name = "TYPE", value_parser = value_type, help_heading = "Volume")]
    pub value_type: Option<String>,
    /// Byte order of raw data: little or big [little].
    #[arg(long, value_name = "ORDER", value_parser = valid::<Endian>, help_heading = "Volume")]
    pub endian: Option<String>,
    /// What a file's numbers are, regardless of what it says: level-set (distances, negative
    /// inside) or fog (densities).
    #[arg(long, value_name = "CLASS", value_parser = valid::<Class>, help_heading = "Volume")]
    pub class: Option<String>,
    /// Distance between voxels along x, y, z.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<f64, 3>, help_heading = "Volume")]
    pub spacing: Option<Numbers<f64, 3>>,
}

impl FileArguments {
    /// Writes the given options into `volume`.
    pub(super) fn overlay(&self, volume: &mut VolumeTable) {
        overlay! {
            volume.from => self.from.clone(),
            volume.grid => self.grid.clone(),
            volume.max_bytes => self.max_bytes,
            volume.dims => self.dims.map(|d| d.0),
            volume.value_type => self.value_type.clone(),
            volume.endian => self.endian.clone(),
            volume.spacing => self.spacing.map(|s| s.0),
            volume.class => self.class.clone(),
        }
    }
}
