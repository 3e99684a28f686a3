//! NIfTI-1 (`.nii`, `.nii.gz`, `.hdr` with `.img`): medical images with their position in the
//! patient. A file may have an affine transform (sform), a rotation (qform) and plain voxel sizes,
//! in this order of priority.

use std::io::Read;

use flate2::read::GzDecoder;
use glam::{DMat3, DMat4, DQuat, DVec3};

use super::input::Input;
use super::payload::{Packing, Payload};
use super::space::LPS_FROM_RAS;
use super::target::is_sheared;
use super::{DenseHeader, Space, placed};
use crate::error::Result;
use crate::io::files;
use crate::io::number::{Endian, ValueType};

const HEADER: usize = 348;

/// The header's bytes and their byte order.
struct Fields {
    bytes: Vec<u8>,
    endian: Endian,
}

impl Fields {
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        // The header is complete, and the offsets are fixed by the format.
        let mut bytes: [u8; N] =
            self.bytes.get(at..at + N).and_then(|b| b.try_into().ok()).unwrap_or([0; N]);
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn short(&self, at: usize) -> i64 {
        i64::from(i16::from_le_bytes(self.array(at)))
    }

    fn float(&self, at: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.array(at)))
    }

    fn vector(&self, at: usize) -> DVec3 {
        DVec3::new(self.float(at), self.float(at + 4), self.float(at + 8))
    }
}

pub(super) fn read(input: &Input) -> Result<(DenseHeader, Payload)> {
    let gzip = input.head.starts_with(b"\x1f\x8b");
    let mut bytes = Vec::new();
    if gzip {
        let unpacked = GzDecoder::new(&*input.head).take(HEADER as u64).read_to_end(&mut bytes);
        unpacked.map_err(|error| input.bad(format!("its header cannot be unpacked: {error}")))?;
    } else {
        bytes.extend(input.head.iter().take(HEADER));
    }
    if bytes.len() < HEADER {
        return Err(input.bad(format!("its header has {} bytes, expected {HEADER}", bytes.len())));
    }
    let endian = match bytes.get(..4) {
        Some([0x5c, 1, 0, 0]) => Endian::Little,
        Some([0, 0, 1, 0x5c]) => Endian::Big,
        _ if bytes.get(4..8) == Some(b"n+2\0") => {
            return Err(input.bad("NIfTI-2, which is not supported; NIfTI-1 is"));
        }
        _ => return Err(input.bad("its header does not begin with its size, 348")),
    };
    let detached = bytes[344..].starts_with(b"ni1");
    let fields = Fields { bytes, endian };

    let axes = fields.short(40);
    let length = |axis: i64| if axis <= axes { fields.short(40 + 2 * axis as usize) } else { 1 };
    if !(1..=7).contains(&axes) {
        return Err(input.bad(format!("{axes} axes, expected 1 to 7")));
    }
    if let Some(axis) = (4..=7).find(|&axis| length(axis) > 1) {
        let what = if axis == 4 { "time steps" } else { "values per voxel" };
        return Err(input.bad(format!("{} {what}; only one is supported", length(axis))));
    }
    let (value_type, components) = number_type(input, fields.short(70))?;
    let dims = input.dims([length(1), length(2), length(3)])?;
    let mut header = DenseHeader::new(dims, value_type);
    header.components = components;
    header.endian = endian;
    let [slope, intercept] = [fields.float(112), fields.float(116)];
    if slope != 0.0 && slope.is_finite() && intercept.is_finite() && components == 1 {
        header.scale = [slope, intercept];
    }
    let place = transform(&fields);
    header.world_from_index = place.world_from_index;
    header.space = place.of_patient.then_some(Space::Lps);
    header.notes.extend(place.note.map(str::to_owned));
    describe(&fields, &mut header);

    let offset = fields.float(108);
    let least = if detached { 0.0 } else { HEADER as f64 };
    if !(least..1e12).contains(&offset) {
        return Err(input.bad(format!("its voxels cannot start at byte {offset}")));
    }
    let offset = offset as u64;
    let payload = match (detached, gzip) {
        (true, _) => {
            let (bare, packed) =
                (input.path.with_extension("img"), input.path.with_extension("img.gz"));
            if !files::exists(&bare) && files::exists(&packed) {
                header.compression = "gzip";
                let packing = Packing::Gzip;
                Payload::Stored { path: packed, offset: 0, packing, skip: offset }
            } else {
                Payload::bare(&bare, offset)
            }
        }
        (false, false) => Payload::bare(input.path, offset),
        (false, true) => {
            header.compression = "gzip";
            let (path, packing) = (input.path.to_owned(), Packing::Gzip);
            Payload::Stored { path, offset: 0, packing, skip: offset }
        }
    };
    Ok((header, payload))
}

fn number_type(input: &Input, code: i64) -> Result<(ValueType, usize)> {
    Ok(match code {
        2 => (ValueType::U8, 1),
        4 => (ValueType::I16, 1),
        8 => (ValueType::I32, 1),
        16 => (ValueType::F32, 1),
        64 => (ValueType::F64, 1),
        128 => (ValueType::U8, 3),
        256 => (ValueType::I8, 1),
        512 => (ValueType::U16, 1),
        768 => (ValueType::U32, 1),
        1024 => (ValueType::I64, 1),
        1280 => (ValueType::U64, 1),
        2304 => (ValueType::U8, 4),
        _ => return Err(input.bad(format!("number type {code} is not supported"))),
    })
}

/// The transform of the voxels.
struct Place {
    world_from_index: DMat4,
    /// Whether it leads to a patient's space.
    of_patient: bool,
    note: Option<&'static str>,
}

/// The matrices of sform and qform count as equal up to this share of a step's length.
const SAME: f64 = 1e-4;

fn transform(fields: &Fields) -> Place {
    // A size of 0 is unknown; the sign of a size has no meaning.
    let sizes = fields.vector(80).to_array();
    let sizes = sizes.map(|size| if size == 0.0 { 1.0 } else { size.abs() });
    let (qform, sform) = (fields.short(252) > 0, fields.short(254) > 0);
    let affine = Some(affine(fields)).filter(|matrix| sform && is_place(matrix));
    let turned = qform.then(|| rotation(fields, sizes));
    // As in ITK: an sform that gives scanner coordinates is preferred; any other only if there is
    // no different qform.
    let (world_from_index, note) = match (affine, turned) {
        (None, None) => {
            let steps = DMat4::from_scale(DVec3::from(sizes));
            return Place { world_from_index: steps, of_patient: false, note: None };
        }
        (Some(affine), None) => (affine, None),
        (None, Some(turned)) => (turned, None),
        (Some(affine), Some(turned)) => {
            let scanner = fields.short(254) == 1 && !is_sheared(&affine);
            let same = is_same(&affine, &turned);
            let note = "its sform and qform differ; the qform is used, as in ITK";
            let other = "its sform and qform differ; the sform is used, as in ITK";
            match (scanner, same) {
                (_, true) => (affine, None),
                (true, false) => (affine, Some(other)),
                (false, false) => (turned, Some(note)),
            }
        }
    };
    let world_from_index = DMat4::from_scale(LPS_FROM_RAS) * world_from_index;
    Place { world_from_index, of_patient: true, note }
}

/// The matrix (sform).
fn affine(fields: &Fields) -> DMat4 {
    let rows = [280, 296, 312].map(|at| fields.vector(at).extend(fields.float(at + 12)));
    let [x, y, z] = rows;
    DMat4::from_cols(x, y, z, glam::DVec4::W).transpose()
}

/// The rotation (qform) with voxels of these sizes.
fn rotation(fields: &Fields, sizes: [f64; 3]) -> DMat4 {
    let q = fields.vector(256);
    let w = (1.0 - q.length_squared()).max(0.0).sqrt();
    // The factor in pixdim[0] mirrors the third axis.
    let mirror = if fields.float(76) < 0.0 { -1.0 } else { 1.0 };
    let turn = DMat3::from_quat(DQuat::from_xyzw(q.x, q.y, q.z, w).normalize());
    let steps = DMat3::from_diagonal(DVec3::from(sizes) * DVec3::new(1.0, 1.0, mirror));
    let [x, y, z] = (turn * steps).to_cols_array_2d().map(DVec3::from);
    placed(fields.vector(268), [x, y, z])
}

/// Some programs declare a matrix but write zeros.
fn is_place(matrix: &DMat4) -> bool {
    matrix.is_finite() && matrix.determinant().is_normal()
}

fn is_same(one: &DMat4, other: &DMat4) -> bool {
    let length = other.x_axis.length().max(other.y_axis.length()).max(other.z_axis.length());
    let off = (*one - *other).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    off <= SAME * length
}

fn describe(fields: &Fields, header: &mut DenseHeader) {
    for (key, at, length) in [("descrip", 148, 80), ("intent_name", 328, 16)] {
        let text =
            fields.bytes[at..at + length].split(|&byte| byte == 0).next().unwrap_or_default();
        let text = String::from_utf8_lossy(text).trim().to_owned();
        if !text.is_empty() {
            header.metadata.push((key.to_owned(), text));
        }
    }
    for (key, at) in [("qform_code", 252), ("sform_code", 254)] {
        header.metadata.push((key.to_owned(), fields.short(at).to_string()));
    }
}
