//! Dense files of other programs, `tests/fixtures/make_dense.py`, hold what its formulas say at
//! every voxel: 5 x 4 x 3 of them, of which (x, y, z) has the number x + 10 y + 100 z.

use std::path::PathBuf;

use deepshadow::io::Format;
use deepshadow::io::number::ValueType;
use glam::{DMat3, DMat4, DVec3};

use super::dense_truth::open;
use crate::support::fixture;

/// Where the voxels lie.
#[derive(Clone, Copy)]
enum Place {
    /// At their indices.
    Bare,
    /// At their indices times the spacing.
    Spaced,
    /// Turned about two axes, in LPS; the first voxel is that many steps from the origin.
    Oblique([f64; 3]),
    /// Filling the unit cube.
    UnitCube,
}

/// A fixture and what was written into it.
pub struct Fact {
    pub file: &'static str,
    /// Read along with it.
    pub beside: Option<&'static str>,
    format: Format,
    value_type: ValueType,
    /// Values are the first times the voxel's number plus the second.
    line: [f64; 2],
    place: Place,
}

const fn fact(
    file: &'static str,
    format: Format,
    value_type: ValueType,
    line: [f64; 2],
    place: Place,
) -> Fact {
    Fact { file, beside: None, format, value_type, line, place }
}

const DIMS: [usize; 3] = [5, 4, 3];
const OBLIQUE: Place = Place::Oblique([0.0; 3]);
const SHIFTED: Place = Place::Oblique([2.0, -3.0, 4.0]);
const SPACING: DVec3 = DVec3::new(0.5, 2.0, 3.0);

// The lines of numbers that fit the types.
const COUNT: [f64; 2] = [1.0, 0.0];
const REAL: [f64; 2] = [0.25, -20.0];
const SIGNED: [f64; 2] = [3.0, -300.0];
const WIDE: [f64; 2] = [250.0, 7.0];

/// All fixtures of dense formats but NanoVDB.
pub const FACTS: [Fact; 20] = [
    fact("nrrd/oblique_raw.nrrd", Format::Nrrd, ValueType::F32, REAL, OBLIQUE),
    fact("nrrd/ras_gzip.nrrd", Format::Nrrd, ValueType::I16, SIGNED, OBLIQUE),
    fact("nrrd/spaced_text.nrrd", Format::Nrrd, ValueType::I32, [1000.0, -7.0], Place::Spaced),
    Fact {
        beside: Some("nrrd/detached.raw"),
        ..fact("nrrd/detached.nhdr", Format::Nrrd, ValueType::U16, WIDE, Place::Spaced)
    },
    fact("nifti/sform.nii", Format::Nifti, ValueType::I16, SIGNED, OBLIQUE),
    fact("nifti/qform_scaled.nii.gz", Format::Nifti, ValueType::U8, [0.5, -3.0], OBLIQUE),
    Fact {
        beside: Some("nifti/big_pair.img"),
        ..fact("nifti/big_pair.hdr", Format::Nifti, ValueType::F32, REAL, OBLIQUE)
    },
    fact("metaimage/packed.mha", Format::MetaImage, ValueType::F64, REAL, OBLIQUE),
    Fact {
        beside: Some("metaimage/apart.raw"),
        ..fact("metaimage/apart.mhd", Format::MetaImage, ValueType::U8, COUNT, OBLIQUE)
    },
    fact("vti/appended_raw.vti", Format::Vti, ValueType::F32, REAL, OBLIQUE),
    fact("vti/appended_zlib.vti", Format::Vti, ValueType::U16, WIDE, SHIFTED),
    fact("vti/inline_zlib.vti", Format::Vti, ValueType::I16, SIGNED, OBLIQUE),
    fact("vti/text.vti", Format::Vti, ValueType::F64, REAL, OBLIQUE),
    fact("npy/half.npy", Format::Npy, ValueType::F16, REAL, Place::Bare),
    fact("npy/fortran.npy", Format::Npy, ValueType::I16, SIGNED, Place::Bare),
    fact("npy/big.npy", Format::Npy, ValueType::F32, REAL, Place::Bare),
    fact("mitsuba/grid.vol", Format::MitsubaVol, ValueType::F32, REAL, Place::UnitCube),
    fact("den/head.den", Format::Den, ValueType::U8, COUNT, Place::Bare),
    fact("pvm/packed.pvm", Format::Pvm, ValueType::U8, COUNT, Place::Spaced),
    fact("pvm/plain.pvm", Format::Pvm, ValueType::U16, WIDE, Place::Spaced),
];

/// Raw voxels are told by the sidecar.
pub const RAW: Fact = Fact {
    beside: Some("raw/voxels.toml"),
    ..fact("raw/voxels.raw", Format::Raw, ValueType::U16, WIDE, Place::Spaced)
};

impl Fact {
    pub fn path(&self) -> PathBuf {
        fixture(self.file)
    }

    fn world_from_index(&self) -> DMat4 {
        // A turn about z after one about x, of triangles with sides 3, 4, 5.
        let axes = DMat3::from_cols(
            DVec3::new(0.6, 0.8, 0.0),
            DVec3::new(-0.48, 0.36, 0.8),
            DVec3::new(0.64, -0.48, 0.6),
        );
        match self.place {
            Place::Bare => DMat4::IDENTITY,
            Place::Spaced => DMat4::from_scale(SPACING),
            Place::Oblique(steps) => {
                DMat4::from_translation(DVec3::new(10.0, -20.0, 30.5))
                    * DMat4::from_mat3(axes)
                    * DMat4::from_scale(SPACING)
                    * DMat4::from_translation(DVec3::from(steps))
            }
            Place::UnitCube => {
                let step = 1.0 / DVec3::from(DIMS.map(|n| n as f64));
                DMat4::from_scale(step) * DMat4::from_translation(DVec3::splat(0.5))
            }
        }
    }
}

#[test]
fn files_of_other_programs_hold_their_formulas_at_every_voxel() {
    for fact in FACTS.iter().chain([&RAW]) {
        let file = open(&fact.path()).unwrap_or_else(|error| panic!("{}: {error}", fact.file));
        let header = file.header();
        assert_eq!((file.format(), header.value_type), (fact.format, fact.value_type));
        assert_eq!((header.dims, header.components), (DIMS, 1), "{}", fact.file);
        // NIfTI's numbers have 24 bits, and those of VTK's text six digits.
        let (found, due) = (header.world_from_index, fact.world_from_index());
        assert!(found.abs_diff_eq(due, 2e-5), "{}: {found} instead of {due}", fact.file);

        let voxels = file.voxels().unwrap_or_else(|error| panic!("{}: {error}", fact.file));
        let density = voxels.density().unwrap();
        let [slope, intercept] = fact.line;
        for ((z, y, x), &found) in density.indexed_iter() {
            let due = slope * (x + 10 * y + 100 * z) as f64 + intercept;
            assert_eq!(f64::from(found), due, "{} at {x}, {y}, {z}", fact.file);
        }
        // 60 voxels, whose indices are 2, 1.5 and 1 on average.
        let mut sum = 0.0;
        voxels.for_each(|value, _| sum += value);
        assert_eq!(sum, 60.0 * (slope * 117.0 + intercept), "{}", fact.file);
    }
}
