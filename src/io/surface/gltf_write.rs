//! Writes glTF 2.0 as one file (`.glb`).

use std::collections::HashMap;

use glam::Vec3;
use serde_json::{Value as Json, json};

use super::gltf::MAGIC;
use super::turn;
use crate::error::{Error, Result};
use crate::surface::{Material, Mesh};
use crate::volume::Axis;

/// Constants of the specification (5.11 and 5.24): component types, and what a view's bytes are for.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The bytes of a `.glb` file of `mesh`, whose axis `up` points up, as y does in such files: a
/// primitive for each of its materials, with normals if it has some of its own. Vertices at which
/// triangles have different normals become several.
///
/// # Errors
/// If it does not fit the 4 GiB of such a file.
pub fn encode_gltf(mesh: &Mesh, up: Axis) -> Result<Vec<u8>> {
    let Vertices { mut positions, mut normals, triangles } = Vertices::of(mesh);
    turn(&mut positions, up, Axis::Y);
    turn(&mut normals, up, Axis::Y);
    let mut document = Document::default();
    let mut attributes = json!({});
    attributes["POSITION"] = document.vectors(&positions, true).into();
    if !normals.is_empty() {
        attributes["NORMAL"] = document.vectors(&normals, false).into();
    }
    let mut primitives = Vec::new();
    for material in 0..mesh.materials().len() as u32 {
        let own = triangles.iter().zip(mesh.material_indices());
        let own = own.filter(|(_, of)| **of == material).flat_map(|(corners, _)| *corners);
        let indices: Vec<u32> = own.collect();
        if !indices.is_empty() {
            let indices = document.indices(&indices);
            let primitive =
                json!({ "attributes": attributes, "indices": indices, "material": material });
            primitives.push(primitive);
        }
    }
    let materials: Vec<Json> = mesh.materials().iter().map(material).collect();
    document.file(&mesh.name, &primitives, &materials)
}

/// A mesh's vertices, each with one normal.
struct Vertices {
    positions: Vec<Vec3>,
    /// Empty if the mesh is flat.
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Vertices {
    fn of(mesh: &Mesh) -> Self {
        let mut own = Self {
            positions: mesh.positions().to_vec(),
            normals: Vec::new(),
            triangles: mesh.triangles().to_vec(),
        };
        if mesh.is_flat() {
            return own;
        }
        // The first normal of each vertex is its own; another makes another vertex.
        let mut first: Vec<Option<Vec3>> = vec![None; own.positions.len()];
        let mut others: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        let mut added = Vec::new();
        for (triangle, corners) in own.triangles.iter_mut().enumerate() {
            for (vertex, normal) in corners.iter_mut().zip(mesh.normals(triangle)) {
                let known = &mut first[*vertex as usize];
                if known.is_none() || *known == Some(normal) {
                    *known = Some(normal);
                    continue;
                }
                let key = (*vertex, normal.to_array().map(f32::to_bits));
                *vertex = *others.entry(key).or_insert_with(|| {
                    own.positions.push(own.positions[*vertex as usize]);
                    added.push(normal);
                    own.positions.len() as u32 - 1
                });
            }
        }
        own.normals = first.into_iter().map(|normal| normal.unwrap_or(Vec3::Y)).collect();
        own.normals.extend(added);
        own
    }
}

fn material(of: &Material) -> Json {
    let Material { name, albedo, opacity } = of;
    let mut json = json!({
        "name": name,
        "doubleSided": true,
        "pbrMetallicRoughness": {
            "baseColorFactor": [albedo.x, albedo.y, albedo.z, opacity],
            "metallicFactor": 0.0,
        },
    });
    if *opacity < 1.0 {
        json["alphaMode"] = "BLEND".into();
    }
    json
}

/// Arrays one after another, and what the document says of each.
#[derive(Default)]
struct Document {
    bytes: Vec<u8>,
    views: Vec<Json>,
    accessors: Vec<Json>,
}

impl Document {
    /// Adds vectors, one for each vertex; the number of their accessor.
    fn vectors(&mut self, vectors: &[Vec3], bounded: bool) -> usize {
        let at = self.bytes.len();
        for number in vectors.iter().flat_map(Vec3::to_array) {
            self.bytes.extend(number.to_le_bytes());
        }
        let mut accessor =
            json!({ "componentType": FLOAT, "count": vectors.len(), "type": "VEC3" });
        if bounded {
            let finite = || vectors.iter().filter(|vector| vector.is_finite());
            let low = finite().fold(Vec3::INFINITY, |low, &vector| low.min(vector));
            let high = finite().fold(Vec3::NEG_INFINITY, |high, &vector| high.max(vector));
            accessor["min"] = json!(low.to_array());
            accessor["max"] = json!(high.to_array());
        }
        self.added(at, VERTICES, accessor)
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let at = self.bytes.len();
        self.bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()));
        let accessor =
            json!({ "componentType": UNSIGNED_INT, "count": indices.len(), "type": "SCALAR" });
        self.added(at, INDICES, accessor)
    }

    fn added(&mut self, at: usize, target: u32, mut accessor: Json) -> usize {
        accessor["bufferView"] = self.views.len().into();
        let length = self.bytes.len() - at;
        self.views
            .push(json!({ "buffer": 0, "byteOffset": at, "byteLength": length, "target": target }));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The whole file (specification, 4.4): a header and two chunks.
    fn file(self, name: &str, primitives: &[Json], materials: &[Json]) -> Result<Vec<u8>> {
        let Self { bytes, views, accessors } = self;
        let document = json!({
            "asset": { "version": "2.0", "generator": "deepshadow" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "name": name, "mesh": 0 }],
            "meshes": [{ "name": name, "primitives": primitives }],
            "materials": materials,
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{ "byteLength": bytes.len() }],
        });
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let all = 12 + 8 + text.len() + 8 + bytes.len();
        let Ok(all) = u32::try_from(all) else {
            let why = format!("it takes {all} bytes; .glb files hold at most 4294967295");
            return Err(Error::value(format!("mesh '{name}'"), why));
        };
        let mut file = MAGIC.to_vec();
        file.extend(2_u32.to_le_bytes());
        file.extend(all.to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bytes)] {
            // Neither is longer than both together.
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        Ok(file)
    }
}
