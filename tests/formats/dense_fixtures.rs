//! Small files of every dense format, built byte by byte. All hold the numbers 0, 1, 2, ... 11 in
//! 3 x 2 x 2 voxels, x fastest.

use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use glam::{DMat4, DVec3};
use tempfile::TempDir;

/// Files that belong together, the first of which is to be opened, and what they must say.
pub struct Case {
    pub name: &'static str,
    pub files: Vec<(String, Vec<u8>)>,
    pub world_from_index: DMat4,
}

impl Case {
    fn new(name: &'static str, file: &str, bytes: Vec<u8>, world_from_index: DMat4) -> Self {
        Self { name, files: vec![(file.to_owned(), bytes)], world_from_index }
    }

    fn beside(mut self, file: &str, bytes: Vec<u8>) -> Self {
        self.files.push((file.to_owned(), bytes));
        self
    }

    /// Writes the files; the path of the first.
    pub fn write(&self, folder: &TempDir) -> PathBuf {
        for (name, bytes) in &self.files {
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        folder.path().join(&self.files[0].0)
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| u32::from(group.get(i).copied().unwrap_or(0)));
        let bits = a << 16 | b << 8 | c;
        for digit in 0..4 {
            let known = digit <= group.len();
            let value = (bits >> (18 - 6 * digit)) & 63;
            text.push(if known { DIGITS[value as usize] as char } else { '=' });
        }
    }
    text
}

/// The Erlangen compression, with 8 bits for every byte.
pub fn dds(bytes: &[u8], version: char, skip: usize, strip: usize) -> Vec<u8> {
    let planes: Vec<u8> =
        (0..skip).flat_map(|plane| bytes.iter().skip(plane).step_by(skip).copied()).collect();
    let mut bits = Vec::new();
    let mut put = |value: usize, width: usize| {
        bits.extend((0..width).rev().map(|bit| (value >> bit) & 1 == 1));
    };
    put(skip - 1, 2);
    put(strip - 1, 16);
    for (run, values) in planes.chunks(100).enumerate() {
        put(values.len(), 7);
        put(7, 3);
        for offset in 0..values.len() {
            let n = 100 * run + offset;
            let mut predicted = if n > 0 { planes[n - 1] } else { 0 };
            if strip > 1 && n > strip {
                predicted = predicted.wrapping_add(planes[n - strip]);
                predicted = predicted.wrapping_sub(planes[n - strip - 1]);
            }
            put(usize::from(planes[n].wrapping_sub(predicted).wrapping_add(128)), 8);
        }
    }
    put(0, 7);
    let packed = bits.chunks(8).map(|byte| {
        byte.iter().enumerate().fold(0, |all, (at, &bit)| all | u8::from(bit) << (7 - at))
    });
    format!("DDS v3{version}\n").into_bytes().into_iter().chain(packed).collect()
}

macro_rules! numbers {
    ($type:ty, $to_bytes:ident) => {
        (0..12_u8).flat_map(|n| <$type>::from(n).$to_bytes()).collect::<Vec<u8>>()
    };
}

fn scaled(x: f64, y: f64, z: f64) -> DMat4 {
    DMat4::from_scale(DVec3::new(x, y, z))
}

fn columns(origin: [f64; 3], steps: [[f64; 3]; 3]) -> DMat4 {
    let [x, y, z] = steps.map(|step| DVec3::from(step).extend(0.0));
    DMat4::from_cols(x, y, z, DVec3::from(origin).extend(1.0))
}

pub fn npy(version: u8, dictionary: &str, voxels: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    let length = dictionary.len() as u32;
    bytes.extend(&length.to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
    [&bytes, dictionary.as_bytes(), voxels].concat()
}

/// The header of a NIfTI file, numbers put where they belong; its bytes in `big` order or not.
pub fn nifti(code: i16, big: bool, mark: [u8; 4], puts: &[(usize, f32)]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, number: &[u8]| {
        let place = &mut bytes[at..at + number.len()];
        place.copy_from_slice(number);
        if big {
            place.reverse();
        }
    };
    put(0, &348_i32.to_le_bytes());
    for (axis, length) in [3_i16, 3, 2, 2, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * axis, &length.to_le_bytes());
    }
    put(70, &code.to_le_bytes());
    put(108, &352.0_f32.to_le_bytes());
    for &(at, number) in puts {
        if at == 252 || at == 254 {
            put(at, &(number as i16).to_le_bytes());
        } else {
            put(at, &number.to_le_bytes());
        }
    }
    bytes[344..348].copy_from_slice(&mark);
    bytes
}

pub fn vti(attributes: &str, array: &str, appended: &[u8]) -> Vec<u8> {
    let head = format!(
        "<?xml version=\"1.0\"?>\n<!-- made by hand -->\n\
         <VTKFile type=\"ImageData\" version=\"1.0\" {attributes}>\n\
         <ImageData WholeExtent=\"1 3 0 1 0 1\" Origin=\"10 20 30\" Spacing=\"1 2 4\" \
         Direction=\"0 -1 0 1 0 0 0 0 1\">\n<Piece Extent=\"1 3 0 1 0 1\">\n\
         <PointData Scalars=\"d\">\n{array}\n</PointData>\n</Piece>\n</ImageData>\n"
    );
    [head.as_bytes(), appended, b"</VTKFile>\n"].concat()
}

/// Compressed blocks as VTK has them: lengths, then the blocks; all of `bytes` in two blocks.
pub fn vtk_blocks(bytes: &[u8], block: usize) -> [Vec<u8>; 2] {
    let blocks: Vec<Vec<u8>> = bytes.chunks(block).map(zlib).collect();
    let last = bytes.len() % block;
    let mut lengths = vec![blocks.len(), block, last];
    lengths.extend(blocks.iter().map(Vec::len));
    [lengths.iter().flat_map(|&n| (n as u64).to_le_bytes()).collect(), blocks.concat()]
}

fn vti_cases() -> Vec<Case> {
    // One step along x goes along the world's y, one along y against its x.
    let placed = columns([10.0, 21.0, 30.0], [[0.0, 1.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 4.0]]);
    let little = "byte_order=\"LittleEndian\"";
    let case = |name, bytes| Case::new(name, "v.vti", bytes, placed);
    let other = "<DataArray type=\"Int8\" Name=\"other\" format=\"ascii\">1 2</DataArray>\n";
    let ascii = format!(
        "{other}<DataArray type=\"Float64\" Name=\"d\" format=\"ascii\">\n\
         <InformationKey name=\"k\"/>0 1 2 3 4 5\n6 7 8 9 10 11\n</DataArray>"
    );
    let inline = |bytes: &[u8]| {
        let text = base64(bytes);
        format!("<DataArray type=\"Int16\" Name=\"d\" format=\"binary\">\n {text}\n</DataArray>")
    };
    let numbers = numbers!(i16, to_be_bytes);
    let bare = [&24_u32.to_be_bytes()[..], &numbers].concat();
    let appended = "<DataArray type=\"UInt16\" Name=\"d\" format=\"appended\" offset=\"3\"/>";
    let numbers = numbers!(u16, to_le_bytes);
    let [lengths, blocks] = vtk_blocks(&numbers, 10);
    let wide = format!("{little} header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\"");
    let raw = [b"<AppendedData encoding=\"raw\">\n _<&>", &*lengths, &blocks, b"</AppendedData>"];
    let text = format!(
        "<AppendedData encoding=\"base64\">_===={}{}</AppendedData>",
        base64(&lengths),
        base64(&blocks)
    );
    let fourth = appended.replace("\"3\"", "\"4\"");
    vec![
        case("vti_ascii", vti(little, &ascii, b"")),
        case("vti_base64", vti("byte_order=\"BigEndian\"", &inline(&bare), b"")),
        case("vti_appended_raw_zlib", vti(&wide, appended, &raw.concat())),
        case("vti_appended_base64_zlib", vti(&wide, &fourth, text.as_bytes())),
    ]
}

fn nrrd_cases() -> Vec<Case> {
    let head = "NRRD0004\n# by hand\ndimension: 3\nsizes: 3 2 2\n";
    let directions = "space: left-posterior-superior\n\
         space directions: (0,2,0) (-3,0,0) (0,0,0.5)\nspace origin: (7,8,9.5)\n";
    let turned = columns([7.0, 8.0, 9.5], [[0.0, 2.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 0.5]]);
    let raw = format!("{head}{directions}type: short\nendian: big\nencoding: raw\n\n");
    let packed = format!("{head}type: float\nendian: little\nspacings: 1 2 nan\nencoding: gz\n\n");
    let apart = format!(
        "{head}type: uint8\nencoding: raw\nbyte skip: 4\ndata file: voxels.bin\nkey:=a value\n"
    );
    let text = format!("{head}type: double\nencoding: ascii\n\n0 1 2 3 4 5 6\n7 8 9 10 11\n");
    let numbers = |head: String, numbers: &[u8]| [head.as_bytes(), numbers].concat();
    let skipped = [b"skip", &*numbers!(u8, to_le_bytes)].concat();
    let short = numbers!(i16, to_be_bytes);
    let float = gzip(&numbers!(f32, to_le_bytes));
    vec![
        Case::new("nrrd_raw", "v.nrrd", numbers(raw, &short), turned),
        Case::new("nrrd_gzip", "v.nrrd", numbers(packed, &float), scaled(1.0, 2.0, 1.0)),
        Case::new("nrrd_detached", "v.nhdr", apart.into(), DMat4::IDENTITY)
            .beside("voxels.bin", skipped),
        Case::new("nrrd_text", "v.nrrd", text.into(), DMat4::IDENTITY),
    ]
}

fn metaimage_cases() -> Vec<Case> {
    let head = "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementSpacing = 2 3 4\n\
         Offset = 1 -1 0.5\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\n";
    let turned = columns([1.0, -1.0, 0.5], [[0.0, 2.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 0.0, 4.0]]);
    let local = format!("{head}ElementType = MET_DOUBLE\nElementDataFile = LOCAL\n");
    let apart = format!(
        "{head}ElementType = MET_USHORT\nElementByteOrderMSB = True\nCompressedData = True\n\
         ElementDataFile = v.zraw\n"
    );
    let local = [local.as_bytes(), &numbers!(f64, to_le_bytes)].concat();
    vec![
        Case::new("metaimage_local", "v.mha", local, turned),
        Case::new("metaimage_zlib", "v.mhd", apart.into(), turned)
            .beside("v.zraw", zlib(&numbers!(u16, to_be_bytes))),
    ]
}

fn nifti_cases() -> Vec<Case> {
    let sform =
        [(254, 1.0), (280, -2.0), (292, 5.0), (300, 3.0), (308, 6.0), (320, 4.0), (324, 7.0)];
    // In LPS: NIfTI's x and y are negated.
    let placed = columns([-5.0, -6.0, 7.0], [[2.0, 0.0, 0.0], [0.0, -3.0, 0.0], [0.0, 0.0, 4.0]]);
    // Half of the numbers, scaled by two and lifted by a half each: see the test of the scale.
    let plain = [nifti(4, false, *b"n+1\0", &sform), numbers!(i16, to_le_bytes)].concat();
    // A half turn about z, and the third axis mirrored.
    let half = 0.5_f32.sqrt();
    let qform = [(252, 1.0), (76, -1.0), (80, 2.0), (84, 3.0), (88, 4.0), (264, half), (268, 1.0)];
    let turned = columns([-1.0, 0.0, 0.0], [[0.0, -2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, -4.0]]);
    let packed = [nifti(16, true, *b"n+1\0", &qform), numbers!(f32, to_be_bytes)].concat();
    let pair = nifti(2, false, *b"ni1\0", &[(80, 1.0), (84, 1.0), (88, 2.0), (108, 0.0)]);
    vec![
        Case::new("nifti_sform", "v.nii", plain, placed),
        Case::new("nifti_qform_gzip_big", "v.nii.gz", gzip(&packed), turned),
        Case::new("nifti_pair", "v.hdr", pair, scaled(1.0, 1.0, 2.0))
            .beside("v.img", numbers!(u8, to_le_bytes)),
    ]
}

/// One of each.
pub fn cases() -> Vec<Case> {
    let c = "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 2, 3), }\n";
    let fortran = "{'descr': '>f4', 'fortran_order': True, 'shape': (2, 2, 3)}";
    // z is the fastest index of a Fortran array of shape (z, y, x).
    let turned: Vec<u8> = (0..3_u8)
        .flat_map(|x| (0..2_u8).flat_map(move |y| (0..2_u8).map(move |z| x + 3 * y + 6 * z)))
        .flat_map(|n| f32::from(n).to_be_bytes())
        .collect();
    let sidecar = "index_origin = [1, 0, 0]\nspacing = [2, 1, 1]\n";
    let sidecar_world =
        columns([2.0, 0.0, 0.0], [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let pvm = [b"PVM2\n3 2 2\n1 1 2.5\n2\n", &*numbers!(u16, to_be_bytes)].concat();
    let pvm3 =
        [b"PVM3\n3 2 2\n1 1 2.5\n1\n", &*numbers!(u8, to_le_bytes), b"what\0who\0\0\0"].concat();
    let mut mitsuba = b"VOL\x03".to_vec();
    mitsuba.extend([1, 3, 2, 2, 1].into_iter().flat_map(i32::to_le_bytes));
    mitsuba.extend([0.0_f32, 0.0, 0.0, 3.0, 4.0, 8.0].into_iter().flat_map(f32::to_le_bytes));
    mitsuba.extend(numbers!(f32, to_le_bytes));
    let mitsuba_world =
        columns([0.5, 1.0, 2.0], [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0]]);
    let mut den = vec![1, 0];
    den.extend([0; 48]);
    den.extend([3, 0, 2, 0, 2, 0, 1, 0, 12, 0, 0, 0]);
    den.extend(numbers!(u8, to_le_bytes));
    let raw = "dims = [3, 2, 2]\ntype = \"u32\"\nendian = \"big\"\nspacing = [1, 1, 3]\n";
    let mut cases = vec![
        Case::new("npy_c", "v.npy", npy(1, c, &numbers!(i16, to_le_bytes)), sidecar_world)
            .beside("v.toml", sidecar.into()),
        Case::new("npy_fortran", "v.npy", npy(2, fortran, &turned), DMat4::IDENTITY),
        Case::new("pvm_plain", "v.pvm", pvm.clone(), scaled(1.0, 1.0, 2.5)),
        Case::new("pvm_v3d", "v.pvm", dds(&pvm3, 'd', 1, 3), scaled(1.0, 1.0, 2.5)),
        Case::new("pvm_v3e", "v.pvm", dds(&pvm, 'e', 2, 1), scaled(1.0, 1.0, 2.5)),
        Case::new("mitsuba", "v.vol", mitsuba, mitsuba_world),
        Case::new("den", "v.den", den, DMat4::IDENTITY),
        Case::new("raw", "v.raw", numbers!(u32, to_be_bytes), scaled(1.0, 1.0, 3.0))
            .beside("v.toml", raw.into()),
    ];
    cases.extend(nrrd_cases());
    cases.extend(metaimage_cases());
    cases.extend(nifti_cases());
    cases.extend(vti_cases());
    cases
}
