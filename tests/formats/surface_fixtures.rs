//! Small files of hair and meshes, written byte by byte, and how tests read them.

use std::path::Path;

use deepshadow::Result;
use deepshadow::io::{SurfaceFile, read_surface};
use deepshadow::surface::{Mesh, Strands};
use serde_json::{Value as Json, json};

use super::dense_fixtures::gzip;

/// Bytes that a reader may take, unless a test says otherwise.
pub const LIMIT: u64 = 1 << 26;

pub type Read = Result<(SurfaceFile, Vec<String>)>;

/// Reads bytes as a file of this name.
pub fn read(name: &str, bytes: &[u8]) -> Read {
    read_beside(name, bytes, &[])
}

/// The same with other files in its folder.
pub fn read_beside(name: &str, bytes: &[u8], others: &[(&str, &[u8])]) -> Read {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in others.iter().chain([&(name, bytes)]) {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    read_surface(&folder.path().join(name), LIMIT)
}

pub fn strands(read: Read) -> (Strands, Vec<String>) {
    match read.unwrap() {
        (SurfaceFile::Strands(strands), notes) => (strands, notes),
        (other, _) => panic!("{other:?}"),
    }
}

pub fn mesh(read: Read) -> (Mesh, Vec<String>) {
    match read.unwrap() {
        (SurfaceFile::Mesh(mesh), notes) => (mesh, notes),
        (other, _) => panic!("{other:?}"),
    }
}

/// The text of an error, which is one line.
pub fn error(read: Read) -> String {
    let text = read.map(drop).unwrap_err().to_string();
    assert!(!text.contains('\n') && text.chars().count() <= 300, "{text}");
    text
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A `.hair` file: its header, and arrays by flags.
#[derive(Clone)]
pub struct Hair {
    pub flags: u32,
    /// Points of each strand.
    pub counts: Vec<u32>,
    pub segments: u32,
    pub thickness: f32,
    pub transparency: f32,
    pub color: [f32; 3],
}

impl Hair {
    /// Two strands of three points.
    pub fn new(flags: u32) -> Self {
        let (thickness, transparency, color) = (0.25, 0.125, [0.5, 0.25, 1.0]);
        Self { flags, counts: vec![3, 3], segments: 2, thickness, transparency, color }
    }

    pub fn point(index: u32) -> [f32; 3] {
        let x = index as f32;
        [x, 0.5 - x, 2.0 * x]
    }

    pub fn thickness(index: u32) -> f32 {
        0.5 + index as f32
    }

    pub fn transparency(index: u32) -> f32 {
        index as f32 / 16.0
    }

    pub fn color(index: u32) -> [f32; 3] {
        [index as f32 / 32.0, 0.75, 0.0]
    }

    pub fn bytes(&self) -> Vec<u8> {
        let points = self.counts.iter().sum::<u32>();
        let mut bytes = b"HAIR".to_vec();
        for number in [self.counts.len() as u32, points, self.flags, self.segments] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(floats(&[self.thickness, self.transparency]));
        bytes.extend(floats(&self.color));
        bytes.resize(128, b' ');
        let has = |bit: u32| self.flags >> bit & 1 == 1;
        if has(0) {
            bytes.extend(self.counts.iter().flat_map(|count| (*count as u16 - 1).to_le_bytes()));
        }
        if has(1) {
            bytes.extend((0..points).flat_map(|i| floats(&Self::point(i))));
        }
        if has(2) {
            bytes.extend((0..points).flat_map(|i| floats(&[Self::thickness(i)])));
        }
        if has(3) {
            bytes.extend((0..points).flat_map(|i| floats(&[Self::transparency(i)])));
        }
        if has(4) {
            bytes.extend((0..points).flat_map(|i| floats(&Self::color(i))));
        }
        bytes
    }
}

/// A `.tfx` file of `strands` x `vertices` points as in [`Hair`], with thicknesses of strands and
/// colours of vertices if `all`.
pub fn tfx(strands: u32, vertices: u32, all: bool) -> Vec<u8> {
    let points = strands * vertices;
    let behind = 160 + 16 * points;
    let (thickness, color) = if all { (behind, behind + 4 * strands) } else { (0, 0) };
    let mut bytes = 4.0_f32.to_le_bytes().to_vec();
    for number in [strands, vertices, 160, 0, 0, thickness, color] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.resize(160, 0);
    for index in 0..points {
        bytes.extend(floats(&Hair::point(index)));
        bytes.extend(floats(&[(index % vertices).min(1) as f32]));
    }
    if all {
        bytes.extend((0..strands).flat_map(|i| floats(&[Hair::thickness(i)])));
        for index in 0..points {
            bytes.extend(floats(&Hair::color(index)));
            bytes.extend(floats(&[1.0]));
        }
    }
    bytes
}

/// Two materials, three faces, and everything that is skipped.
pub const OBJ: &str = "# a comment \\\nmtllib of it.mtl\no thing\n\
    v 0 0 0\nv 1 0 0 1.0\r\nv 1 1 0 0.5 0.5 0.5\nvn 0 0 1\nvt 0 0\nv 0 1 0\n\
    g part\nusemtl red\ns off\nf 1/1 2/1/1 3//1 -1\nusemtl thin glass\n\
    v 9 9 9\nv 0 0 2\nf 1 \\\n  2 6\nf -1 -3 -6\n";

pub const MTL: &[u8] = b"newmtl red\nKd 0.5 0.25 0.125\nillum 2\nd 0.75\nTr 0.75\n\
    newmtl thin glass\n Kd 0.5\n Tr 0.25\nmap_Kd wood.png\n";

/// A `.glb` file.
pub fn glb(json: &Json, bin: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let chunks = [(b"JSON", padded(json.to_string().as_bytes(), b' ')), (b"BIN\0", padded(bin, 0))];
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    let length: usize = chunks.iter().map(|(_, chunk)| 8 + chunk.len()).sum();
    bytes.extend((12 + length as u32).to_le_bytes());
    for (kind, chunk) in chunks {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// The buffer of [`document`]: four corners of a unit square as floats, 16 bytes each, the last four
/// without meaning; then as normalised 16-bit integers, 8 bytes each; then six indices.
pub fn buffer() -> Vec<u8> {
    let square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
    let mut bytes = Vec::new();
    for corner in square {
        bytes.extend(floats(&corner.map(|x| x as f32)));
        bytes.extend([0xff; 4]);
    }
    for corner in square {
        bytes.extend(corner.iter().flat_map(|x| (x * i16::MAX).to_le_bytes()));
        bytes.extend([0xff; 2]);
    }
    bytes.extend([0, 1, 2, 0, 2, 3_u16].iter().flat_map(|index| index.to_le_bytes()));
    bytes
}

/// A square as triangles, strip and fan below two nodes, and primitives that are no triangles.
/// `uri` says where its buffer is.
pub fn document(uri: Option<&str>) -> Json {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let material = |name: &str, alpha: f64, mode: &str| {
        let factors = json!({ "baseColorFactor": [0.5, 0.25, 1, alpha] });
        json!({ "name": name, "pbrMetallicRoughness": factors, "alphaMode": mode })
    };
    let mut buffer = json!({ "byteLength": 108 });
    if let Some(uri) = uri {
        buffer["uri"] = uri.into();
    }
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_mesh_quantization"],
        "extensionsRequired": ["KHR_mesh_quantization"],
        "scene": 1,
        "scenes": [{ "nodes": [2] }, { "nodes": [0], "extras": [1, "any"] }],
        "nodes": [
            { "children": [1], "translation": [10, 0, 0], "rotation": [0, 0, half, half],
              "scale": [2, 2, 2] },
            { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1] },
            { "mesh": 0 },
        ],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "_OTHER": 0 }, "indices": 2, "material": 0 },
            { "attributes": { "POSITION": 1 }, "mode": 5, "material": 1 },
            { "attributes": { "POSITION": 0 }, "mode": 6, "material": 2 },
            { "attributes": { "POSITION": 0 }, "mode": 1 },
            { "attributes": { "POSITION": 0 }, "indices": 2 },
        ]}],
        "materials": [
            material("solid", 0.25, "OPAQUE"), material("glass", 0.25, "BLEND"),
            material("leaf", 0.25, "MASK"),
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5122, "count": 4, "type": "VEC3",
              "normalized": true },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 64, "byteStride": 16 },
            { "buffer": 0, "byteOffset": 64, "byteLength": 32, "byteStride": 8 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 12 },
        ],
        "buffers": [buffer],
    })
}

/// Bytes in base64.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| u32::from(group.get(i).copied().unwrap_or(0)));
        let number = a << 16 | b << 8 | c;
        for digit in 0..4 {
            let known = digit <= group.len();
            let digit = DIGITS[(number >> (18 - 6 * digit) & 63) as usize];
            text.push(if known { char::from(digit) } else { '=' });
        }
    }
    text
}

/// [`document`] with its buffer in itself.
pub fn gltf() -> Vec<u8> {
    let uri = format!("data:application/octet-stream;base64,{}", base64(&buffer()));
    document(Some(&uri)).to_string().into_bytes()
}

/// Valid files: the fuzz target, the file's name, and its bytes.
pub fn seeds() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let all = Hair { counts: vec![2, 4], ..Hair::new(0b11111) }.bytes();
    vec![
        ("hair", "h.hair", all.clone()),
        ("hair", "plain.hair", Hair::new(0b10).bytes()),
        ("hair", "h.hair.gz", gzip(&all)),
        ("tfx", "h.tfx", tfx(2, 3, true)),
        ("tfx", "plain.tfx", tfx(3, 2, false)),
        ("obj", "m.obj", OBJ.into()),
        ("gltf", "m.glb", glb(&document(None), &buffer())),
        ("gltf", "m.gltf", gltf()),
    ]
}

/// The three corners of each triangle.
pub fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    (0..mesh.triangles().len()).map(|i| mesh.corners(i).map(|corner| corner.to_array())).collect()
}

/// Writes a file and names it.
pub fn write(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}
