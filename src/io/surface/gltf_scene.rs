//! The triangles of a glTF document's scene: its nodes with their transforms, the meshes that they
//! place, and their materials.

use std::collections::HashMap;

use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use gltf::json::material::AlphaMode;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::Checked;
use gltf::json::{self, Index, Node, Root};

use super::counted;
use super::gltf_accessor::Reader;
use super::gltf_buffers::Buffers;
use super::input::Input;
use crate::error::Result;
use crate::error::memory;
use crate::surface::Material;

/// A node that is still to be visited, and its parent's transform.
type Waiting = (usize, DMat4);

/// The triangles of a scene.
#[derive(Default)]
pub(super) struct Assembly {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) materials: Vec<Material>,
    pub(super) material_of: Vec<u32>,
    /// Normals at the triangles' corners; zero where there are none.
    pub(super) normals: Vec<[Vec3; 3]>,
    pub(super) has_normals: bool,
    /// The index of the material of primitives without one.
    plain: Option<u32>,
    /// Primitives of points or lines, or without positions.
    left_out: usize,
    skinned: usize,
    morphed: usize,
}

impl Assembly {
    /// The scene that the document shows: the one that it names, or the first, or all nodes.
    pub(super) fn of(input: &mut Input, root: &Root, buffers: &mut Buffers) -> Result<Self> {
        let mut assembly = Self::default();
        assembly.take_materials(input, root)?;
        let count = root.nodes.len();
        input.take(count as u64 * (size_of::<Waiting>() + 2) as u64, "nodes")?;
        let mut seen = memory::filled(count, false, "nodes")?;
        let mut waiting: Vec<Waiting> = memory::room(count, "nodes")?;
        let tops = tops(input, root)?;
        add(input, &mut waiting, &mut seen, tops.into_iter(), DMat4::IDENTITY)?;
        while let Some((index, parent)) = waiting.pop() {
            let Some(node) = root.nodes.get(index) else { continue };
            let matrix = parent * matrix_of(input, index, node)?;
            if let Some(mesh) = node.mesh {
                let mut reader = Reader { root, input: &mut *input, buffers: &mut *buffers };
                assembly.place(&mut reader, mesh.value(), &matrix)?;
                assembly.skinned += usize::from(node.skin.is_some());
                assembly.morphed += usize::from(is_morphed(root, node));
            }
            let children = node.children.iter().flatten().map(Index::value);
            add(input, &mut waiting, &mut seen, children.rev(), matrix)?;
        }
        assembly.note(&mut input.notes);
        Ok(assembly)
    }

    fn note(&self, notes: &mut Vec<String>) {
        let note = [
            (self.left_out, "primitive", "of points or lines, or without positions, and left out"),
            (self.skinned, "mesh node", "skinned and shown without its skin"),
            (self.morphed, "mesh node", "morphed and shown without that"),
        ];
        for (count, what, how) in note.into_iter().filter(|(count, ..)| *count > 0) {
            notes.push(format!("{} {how}", counted(count, what)));
        }
    }

    /// The document's materials by their factors.
    fn take_materials(&mut self, input: &mut Input, root: &Root) -> Result<()> {
        let names = root.materials.iter().filter_map(|one| one.name.as_ref());
        let bytes = names.map(|name| name.len() as u64).sum::<u64>();
        let count = root.materials.len() as u64;
        input.take(bytes + count * size_of::<Material>() as u64, "materials")?;
        self.materials = memory::collected(root.materials.iter().map(material), "materials")?;
        let textured =
            |one: &&json::Material| one.pbr_metallic_roughness.base_color_texture.is_some();
        let textured = root.materials.iter().filter(textured).count();
        if textured > 0 {
            let count = counted(textured, "texture");
            input.notes.push(format!("{count} not read; `baseColorFactor` counts alone"));
        }
        Ok(())
    }

    /// Adds a mesh.
    fn place(&mut self, reader: &mut Reader, mesh: usize, matrix: &DMat4) -> Result<()> {
        let all = &reader.root.meshes;
        let why = || reader.input.bad(format!("mesh {mesh} of {}", all.len()));
        let primitives = &all.get(mesh).ok_or_else(why)?.primitives;
        // Primitives of one mesh often share their vertices.
        let (mut placed, mut turned) = (HashMap::new(), HashMap::new());
        for (number, primitive) in primitives.iter().enumerate() {
            let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let mode = match primitive.mode {
                Checked::Valid(mode) => mode,
                Checked::Invalid => {
                    let why = format!("mesh {mesh}, primitive {number}: its mode is unknown");
                    return Err(reader.input.bad(why));
                }
            };
            let shape = match mode {
                Mode::Triangles => Shape::Separate,
                Mode::TriangleStrip => Shape::Strip,
                Mode::TriangleFan => Shape::Fan,
                _ => Shape::None,
            };
            let (Some(positions), true) = (positions, shape != Shape::None) else {
                self.left_out += 1;
                continue;
            };
            let positions = positions.value();
            let range = match placed.get(&positions) {
                Some(range) => *range,
                None => {
                    let range = self.vertices(reader, positions, matrix)?;
                    placed.insert(positions, range);
                    range
                }
            };
            let what = (mesh, number);
            let normals = primitive.attributes.get(&Checked::Valid(Semantic::Normals));
            let normals = normals.map(Index::value);
            if let Some(accessor) = normals.filter(|own| !turned.contains_key(own)) {
                turned.insert(accessor, self.vertex_normals(reader, accessor, matrix)?);
            }
            let normals = normals.and_then(|accessor| turned.get(&accessor));
            let normals = normals.map_or(&[][..], |own: &Vec<Vec3>| own);
            self.primitive(reader, primitive, (shape, range), normals, what)?;
        }
        Ok(())
    }

    /// Adds vertices; their first index and their number.
    fn vertices(
        &mut self,
        reader: &mut Reader,
        accessor: usize,
        matrix: &DMat4,
    ) -> Result<(u32, u32)> {
        let first = self.positions.len() as u64;
        let mut own = reader.vectors(accessor)?;
        // The largest index is kept free.
        if first + own.len() as u64 >= u64::from(u32::MAX) {
            return Err(reader.input.bad("its vertices exceed 32 bits"));
        }
        for vertex in &mut own {
            *vertex = matrix.transform_point3(vertex.as_dvec3()).as_vec3();
        }
        let count = own.len() as u32;
        if self.positions.is_empty() {
            self.positions = own;
        } else {
            reader.input.take(own.len() as u64 * size_of::<Vec3>() as u64, "vertices")?;
            memory::grow(&mut self.positions, own.len(), "vertices")?;
            self.positions.append(&mut own);
        }
        Ok((first as u32, count))
    }

    /// Normals of vertices, turned with them.
    fn vertex_normals(
        &mut self,
        reader: &mut Reader,
        accessor: usize,
        matrix: &DMat4,
    ) -> Result<Vec<Vec3>> {
        let mut normals = reader.vectors(accessor)?;
        let turn = DMat3::from_mat4(*matrix).inverse().transpose();
        for normal in &mut normals {
            *normal = (turn * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        self.has_normals |= !normals.is_empty();
        Ok(normals)
    }

    /// Adds the triangles of a primitive between vertices that are there.
    fn primitive(
        &mut self,
        reader: &mut Reader,
        primitive: &Primitive,
        (shape, (first, count)): (Shape, (u32, u32)),
        normals: &[Vec3],
        (mesh, number): (usize, usize),
    ) -> Result<()> {
        let what = || format!("mesh {mesh}, primitive {number}");
        let material = self.material(reader, primitive, &what)?;
        let indices = match primitive.indices {
            Some(accessor) => {
                let indices = reader.indices(accessor.value())?;
                if let Some(bad) = indices.iter().find(|&&index| index >= count) {
                    return Err(reader.input.bad(format!("{}: vertex {bad} of {count}", what())));
                }
                indices
            }
            None => {
                reader.input.take(4 * u64::from(count), "indices")?;
                memory::collected(0..count, "indices")?
            }
        };
        let triangles = shape.triangles(indices.len());
        let bytes = triangles as u64 * size_of::<([u32; 4], [Vec3; 3])>() as u64;
        reader.input.take(bytes, "triangles")?;
        memory::grow(&mut self.triangles, triangles, "triangles")?;
        memory::grow(&mut self.material_of, triangles, "triangles")?;
        memory::grow(&mut self.normals, triangles, "triangles")?;
        let normal = |index: u32| normals.get(index as usize).copied().unwrap_or_default();
        self.normals.extend(
            (0..triangles)
                .map(|triangle| shape.corners(triangle).map(|corner| normal(indices[corner]))),
        );
        self.triangles.extend(
            (0..triangles)
                .map(|triangle| shape.corners(triangle).map(|corner| first + indices[corner])),
        );
        self.material_of.extend((0..triangles).map(|_| material));
        Ok(())
    }

    /// The index of a primitive's material.
    fn material(
        &mut self,
        reader: &Reader,
        primitive: &Primitive,
        what: &dyn Fn() -> String,
    ) -> Result<u32> {
        let count = reader.root.materials.len();
        match (primitive.material, self.plain) {
            (Some(index), _) if index.value() < count => Ok(index.value() as u32),
            (Some(index), _) => {
                let why = format!("{}: material {} of {count}", what(), index.value());
                Err(reader.input.bad(why))
            }
            (None, Some(plain)) => Ok(plain),
            (None, None) => {
                let plain = self.materials.len() as u32;
                self.materials.push(material(&json::Material::default()));
                self.plain = Some(plain);
                Ok(plain)
            }
        }
    }
}

/// How indices make triangles.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Shape {
    None,
    Separate,
    Strip,
    Fan,
}

impl Shape {
    /// The number of triangles of so many indices. Incomplete ones do not count.
    fn triangles(self, indices: usize) -> usize {
        match self {
            Self::None => 0,
            Self::Separate => indices / 3,
            Self::Strip | Self::Fan => indices.saturating_sub(2),
        }
    }

    /// Which of the indices are a triangle's.
    fn corners(self, triangle: usize) -> [usize; 3] {
        match self {
            Self::None | Self::Separate => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
            Self::Strip => [triangle, triangle + 1, triangle + 2],
            Self::Fan => [0, triangle + 1, triangle + 2],
        }
    }
}

/// The scene's nodes without parents.
fn tops(input: &Input, root: &Root) -> Result<Vec<usize>> {
    let scene = match root.scene {
        Some(scene) => {
            let (index, count) = (scene.value(), root.scenes.len());
            let why = || input.bad(format!("scene {index} of {count}"));
            Some(root.scenes.get(index).ok_or_else(why)?)
        }
        None => root.scenes.first(),
    };
    if let Some(scene) = scene {
        return memory::collected(scene.nodes.iter().map(Index::value).rev(), "nodes");
    }
    let mut is_child = memory::filled(root.nodes.len(), false, "nodes")?;
    for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if let Some(one) = is_child.get_mut(child.value()) {
            *one = true;
        }
    }
    Ok((0..root.nodes.len()).rev().filter(|&node| !is_child[node]).collect())
}

/// Lets nodes wait for their visit. A tree has no node twice, so a document cannot grow as it is
/// read, nor go in circles.
fn add(
    input: &Input,
    waiting: &mut Vec<Waiting>,
    seen: &mut [bool],
    nodes: impl Iterator<Item = usize>,
    matrix: DMat4,
) -> Result<()> {
    let count = seen.len();
    for node in nodes {
        match seen.get_mut(node) {
            None => return Err(input.bad(format!("node {node} of {count}"))),
            Some(true) => return Err(input.bad(format!("node {node} is in its tree twice"))),
            Some(seen) => *seen = true,
        }
        waiting.push((node, matrix));
    }
    Ok(())
}

/// A node's transform.
fn matrix_of(input: &Input, index: usize, node: &Node) -> Result<DMat4> {
    if let Some(matrix) = node.matrix {
        return Ok(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let vector = |given: Option<[f32; 3]>, otherwise: f32| {
        DVec3::from(given.unwrap_or([otherwise; 3]).map(f64::from))
    };
    let UnitQuaternion(turn) = node.rotation.unwrap_or_default();
    let turn = DQuat::from_array(turn.map(f64::from));
    if !(turn.length_squared() > 0.0 && turn.is_finite()) {
        return Err(input.bad(format!("node {index}: its rotation {turn} is none")));
    }
    let (scale, to) = (vector(node.scale, 1.0), vector(node.translation, 0.0));
    Ok(DMat4::from_scale_rotation_translation(scale, turn.normalize(), to))
}

/// Whether a node's mesh is a mixture of several shapes.
fn is_morphed(root: &Root, node: &Node) -> bool {
    let mesh = node.mesh.and_then(|mesh| root.meshes.get(mesh.value()));
    let weights = node.weights.as_ref().or(mesh.and_then(|mesh| mesh.weights.as_ref()));
    weights.is_some_and(|weights| weights.iter().any(|&weight| weight != 0.0))
}

/// A material by its factors. Alpha counts as the document says.
fn material(from: &json::Material) -> Material {
    let [r, g, b, alpha] = from.pbr_metallic_roughness.base_color_factor.0.map(f64::from);
    let in_unit = |x: f64| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) };
    let cutoff = from.alpha_cutoff.unwrap_or_default().0;
    let opacity = match from.alpha_mode {
        Checked::Valid(AlphaMode::Blend) => in_unit(alpha),
        Checked::Valid(AlphaMode::Mask) => f64::from(u8::from(alpha >= f64::from(cutoff))),
        _ => 1.0,
    };
    let name = from.name.clone().unwrap_or_default();
    Material { name, albedo: DVec3::from([r, g, b].map(in_unit)), opacity }
}
