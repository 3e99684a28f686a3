//! The formats of volumes, deep images, hair and meshes, recognised by the first bytes of a file.
//! Knows nothing else of their contents.

use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;

use super::deep_exr::DeepFile;
use super::files;
use super::surface;
use super::vdb::VdbFile;
use crate::error::{Error, Result};

/// A format that can be read; all are formats of volumes except deep images, hair and meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// OpenVDB, `.vdb`.
    OpenVdb,
    /// NanoVDB, `.nvdb`.
    NanoVdb,
    /// NumPy, `.npy`.
    Npy,
    /// NRRD, `.nrrd` and `.nhdr`.
    Nrrd,
    /// MetaImage, `.mha` and `.mhd`.
    MetaImage,
    /// The Erlangen volume library's `.pvm`, compressed or not.
    Pvm,
    /// NIfTI-1, `.nii`, `.nii.gz` and `.hdr` with `.img`.
    Nifti,
    /// VTK image data, `.vti`.
    Vti,
    /// Mitsuba's grid volumes, `.vol`.
    MitsubaVol,
    /// VolPack's densities, `.den`.
    Den,
    /// Deep OpenEXR, `.exr`: not a volume, but a map or a camera's deep image of one.
    DeepExr,
    /// Cem Yuksel's hair models, `.hair`, compressed by gzip or not.
    Hair,
    /// AMD's TressFX 4 hair, `.tfx`.
    TressFx,
    /// Wavefront meshes, `.obj`.
    Obj,
    /// glTF 2.0 meshes, `.gltf` and `.glb`.
    Gltf,
    /// Numbers without a header.
    Raw,
}

const NAMES: [(&str, Format); 16] = [
    ("openvdb", Format::OpenVdb),
    ("nanovdb", Format::NanoVdb),
    ("npy", Format::Npy),
    ("nrrd", Format::Nrrd),
    ("metaimage", Format::MetaImage),
    ("pvm", Format::Pvm),
    ("nifti", Format::Nifti),
    ("vti", Format::Vti),
    ("mitsuba-vol", Format::MitsubaVol),
    ("den", Format::Den),
    ("deep-exr", Format::DeepExr),
    ("hair", Format::Hair),
    ("tfx", Format::TressFx),
    ("obj", Format::Obj),
    ("gltf", Format::Gltf),
    ("raw", Format::Raw),
];

/// Number of bytes examined: NIfTI's magic number comes last, and XML and `.obj` may begin with
/// comments.
const START: u64 = 1 << 14;

impl Format {
    /// The format's name, as `--from` takes it.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, format)| *format == self).map_or("", |(name, _)| name)
    }

    /// Whether it is a format of hair or meshes, which [`read_surface`](super::read_surface) reads.
    pub fn is_surface(self) -> bool {
        matches!(self, Self::Hair | Self::TressFx | Self::Obj | Self::Gltf)
    }

    /// What a file of this format is, if that is no volume.
    pub(super) fn no_volume(self) -> Option<&'static str> {
        match self {
            Self::DeepExr => Some("a deep image, not a volume"),
            Self::Hair | Self::TressFx => Some("hair, not a volume"),
            Self::Obj | Self::Gltf => Some("a mesh, not a volume"),
            _ => None,
        }
    }

    /// The format of the file `path`, by its first bytes. A file without a known magic number is
    /// raw.
    ///
    /// # Errors
    /// If the file cannot be read, or if it is recognised as something that is not supported.
    pub fn of_file(path: &Path) -> Result<Self> {
        let failed = |error| Error::file(path, error);
        let (file, size) = files::open_sized(path).map_err(failed)?;
        let mut start = Vec::new();
        file.take(START).read_to_end(&mut start).map_err(failed)?;
        Self::detect(&start, size).map_err(|why| Error::contents(path, why))
    }

    /// The format of a file of `size` bytes that begins with `start`. The error says what it is
    /// instead, if that is known and not supported.
    fn detect(start: &[u8], size: u64) -> Result<Self, &'static str> {
        let begins = |mark: &[u8]| start.starts_with(mark);
        if let Some(deep) = DeepFile::recognizes(start) {
            let flat = "a flat OpenEXR picture; only deep OpenEXR images are supported";
            return if deep { Ok(Self::DeepExr) } else { Err(flat) };
        }
        let found = if VdbFile::recognizes(start) {
            Self::OpenVdb
        } else if begins(b"NanoVDB") {
            Self::NanoVdb
        } else if begins(b"\x93NUMPY") {
            Self::Npy
        } else if begins(b"NRRD") {
            Self::Nrrd
        } else if begins(b"PVM") || begins(b"DDS v3") {
            Self::Pvm
        } else if begins(b"VOL\x03") {
            Self::MitsubaVol
        } else if begins(b"\x1f\x8b") {
            let mut inner = Vec::new();
            // A file that cannot be decompressed is not NIfTI.
            let _ = GzDecoder::new(start).take(352).read_to_end(&mut inner);
            return if is_nifti(&inner) {
                Ok(Self::Nifti)
            } else if inner.starts_with(b"HAIR") {
                Ok(Self::Hair)
            } else {
                Err("a gzip file that contains nothing this program can read; unpack it first")
            };
        } else if is_nifti(start) {
            Self::Nifti
        } else if is_metaimage(start) {
            Self::MetaImage
        } else if is_den(start, size) {
            Self::Den
        } else if start.trim_ascii_start().starts_with(b"<") && contains(start, b"<VTKFile") {
            Self::Vti
        } else if begins(b"# vtk DataFile") {
            return Err("a legacy VTK file, which is not supported; save it as .vti");
        } else if begins(b"PK\x03\x04") {
            return Err("a zip archive (NumPy's .npz?), which is not supported; unpack it first");
        } else if begins(b"<?xml") {
            return Err("an XML file, but not a VTK one");
        } else if let Some(surface) = surface::recognized(start, size) {
            surface
        } else {
            Self::Raw
        };
        Ok(found)
    }
}

impl std::str::FromStr for Format {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let found = NAMES.iter().find(|(name, _)| *name == text).map(|(_, format)| *format);
        found.ok_or_else(|| {
            let names = NAMES.map(|(name, _)| name).join(", ");
            Error::value("from", format!("'{text}' is not one of {names}"))
        })
    }
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// NIfTI: the header's own size at its beginning, in either byte order, and the magic number at its
/// end.
fn is_nifti(start: &[u8]) -> bool {
    let size =
        [start.starts_with(&348_u32.to_le_bytes()), start.starts_with(&348_u32.to_be_bytes())];
    let mark = start.get(344..348);
    let nifti1 = size.contains(&true) && (mark == Some(b"n+1\0") || mark == Some(b"ni1\0"));
    nifti1 || start.get(4..8) == Some(b"n+2\0")
}

/// MetaImage has no magic number; its first line has one of few keys.
fn is_metaimage(start: &[u8]) -> bool {
    // Some editors write a byte order mark first.
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let line = start.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let Some(equals) = line.iter().position(|&byte| byte == b'=') else { return false };
    let key = line[..equals].trim_ascii();
    [&b"ObjectType"[..], b"NDims", b"Comment", b"ObjectSubType"].contains(&key)
}

/// VolPack has no magic number; the version is 1, and lengths agree with each other and with the
/// file's size.
fn is_den(start: &[u8], size: u64) -> bool {
    let short =
        |at: usize| start.get(at..at + 2).map(|b| u64::from(u16::from_le_bytes([b[0], b[1]])));
    let product = [50, 52, 54].map(short).into_iter().try_fold(1, |all, n| Some(all * n?));
    short(0) == Some(1) && product.is_some_and(|n| n > 0 && size == n + 62)
}
