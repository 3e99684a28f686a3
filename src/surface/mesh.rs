//! Meshes: triangles between shared vertices, each of one material.

use glam::{DVec3, Vec3};

use super::normals;
use crate::error::{Error, Result};

/// What a triangle is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the source; may be empty.
    pub name: String,
    /// Lambertian reflectance, linear RGB, 0..1.
    pub albedo: DVec3,
    /// The share of light that one crossing takes, 0..1.
    pub opacity: f64,
}

impl Default for Material {
    /// Light grey and opaque.
    fn default() -> Self {
        Self { name: String::new(), albedo: DVec3::splat(0.7), opacity: 1.0 }
    }
}

/// Triangles between shared vertices. They need not be closed; both sides are alike.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Its name in the source: a file's stem.
    pub name: String,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    materials: Vec<Material>,
    /// The index of each triangle's material.
    material_of: Vec<u32>,
    /// Unit normals at each triangle's corners, for shading; `None` for those of their planes.
    normals: Option<Vec<[Vec3; 3]>>,
    skipped: usize,
}

impl Mesh {
    /// A mesh of `triangles`, each three indices of `positions`; `material_of` holds an index of
    /// `materials` for each triangle. `normals`, of any length, are those at its corners, for
    /// shading; without them, and where one has no direction, they are those of its plane. Triangles
    /// with a vertex that is not finite are left out and
    /// counted ([`Mesh::skipped`]). Those of no area are kept; no ray meets them.
    ///
    /// # Errors
    /// If an index is out of range, if there are not as many `material_of` or `normals` as `triangles`, if a
    /// material is out of its range, or if no triangle is left.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<Vec3>,
        mut triangles: Vec<[u32; 3]>,
        materials: Vec<Material>,
        mut material_of: Vec<u32>,
        mut normals: Option<Vec<[Vec3; 3]>>,
    ) -> Result<Self> {
        let name = name.into();
        let wrong = |why: String| Err(Error::value(format!("mesh '{name}'"), why));
        let (count, kinds) = (positions.len(), materials.len());
        if triangles.len() != material_of.len() {
            let (triangles, materials) = (triangles.len(), material_of.len());
            return wrong(format!("{triangles} triangles with the materials of {materials}"));
        }
        if let Some(normals) = normals.as_ref().filter(|own| own.len() != triangles.len()) {
            let (triangles, normals) = (triangles.len(), normals.len());
            return wrong(format!("{triangles} triangles with the normals of {normals}"));
        }
        if let Some(index) = triangles.iter().flatten().find(|&&index| index as usize >= count) {
            return wrong(format!("a triangle has vertex {index} of {count}"));
        }
        if let Some(index) = material_of.iter().find(|&&index| index as usize >= kinds) {
            return wrong(format!("a triangle has material {index} of {kinds}"));
        }
        for Material { name, albedo, opacity } in &materials {
            if !in_unit(albedo.min_element()) || !in_unit(albedo.max_element()) {
                return wrong(format!("the albedo {albedo} of material '{name}' is not in 0..1"));
            }
            if !in_unit(*opacity) {
                return wrong(format!("the opacity {opacity} of material '{name}' is not in 0..1"));
            }
        }
        let before = triangles.len();
        let finite: Vec<bool> = triangles
            .iter()
            .map(|corners| corners.iter().all(|&i| positions[i as usize].is_finite()))
            .collect();
        if finite.contains(&false) {
            let mut keep = finite.iter();
            triangles.retain(|_| keep.next() == Some(&true));
            let mut keep = finite.iter();
            material_of.retain(|_| keep.next() == Some(&true));
            if let Some(normals) = &mut normals {
                let mut keep = finite.iter();
                normals.retain(|_| keep.next() == Some(&true));
            }
        }
        if triangles.is_empty() {
            return wrong(match before {
                0 => "it has no triangles".to_owned(),
                some => format!("none of its {some} triangles has three finite vertices"),
            });
        }
        let skipped = before - triangles.len();
        for (triangle, own) in triangles.iter().zip(normals.iter_mut().flatten()) {
            *own = normals::complete(*own, triangle.map(|index| positions[index as usize]));
        }
        Ok(Self { name, positions, triangles, materials, material_of, normals, skipped })
    }

    /// The same mesh with normals that are smooth over edges of at most `crease_degrees` between
    /// the planes of triangles.
    #[must_use]
    pub fn smoothed(mut self, crease_degrees: f64) -> Self {
        let corners = |triangle| self.corners(triangle);
        let crease = crease_degrees.to_radians();
        self.normals = Some(normals::smooth(self.triangles.len(), corners, crease));
        self
    }

    /// The same mesh, with `albedo` (linear RGB) and `opacity`, each 0..1, in place of those of all
    /// materials.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn with_material(mut self, albedo: Option<DVec3>, opacity: Option<f64>) -> Result<Self> {
        let wrong = |what: &str, value: String| {
            Err(Error::value(format!("mesh.{what}"), format!("{value} is not in 0..1")))
        };
        if let Some(albedo) = albedo.filter(|c| c.to_array().iter().any(|&c| !in_unit(c))) {
            return wrong("albedo", albedo.to_string());
        }
        if let Some(opacity) = opacity.filter(|&opacity| !in_unit(opacity)) {
            return wrong("opacity", opacity.to_string());
        }
        for material in &mut self.materials {
            material.albedo = albedo.unwrap_or(material.albedo);
            material.opacity = opacity.unwrap_or(material.opacity);
        }
        Ok(self)
    }

    /// The vertices' positions.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles, as indices of three vertices each.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The positions of a triangle's corners.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|index| self.positions[index as usize])
    }

    /// Unit normals at a triangle's corners, for shading; zero if it has none of its own and no
    /// area.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn normals(&self, triangle: usize) -> [Vec3; 3] {
        match &self.normals {
            Some(normals) => normals[triangle],
            None => [normals::flat(self.corners(triangle)); 3],
        }
    }

    /// Whether its normals are those of its triangles' planes.
    pub fn is_flat(&self) -> bool {
        self.normals.is_none()
    }

    /// The materials.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The index of each triangle's material.
    pub fn material_indices(&self) -> &[u32] {
        &self.material_of
    }

    /// A triangle's material.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn material(&self, triangle: usize) -> &Material {
        &self.materials[self.material_of[triangle] as usize]
    }

    /// How many triangles were left out because a vertex was not finite.
    pub fn skipped(&self) -> usize {
        self.skipped
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        let arrays = size_of_val(&*self.positions) + size_of_val(&*self.triangles);
        let normals = self.normals.as_ref().map_or(0, |own| size_of_val(&**own));
        (arrays + size_of_val(&*self.material_of) + normals) as u64
    }
}

fn in_unit(x: f64) -> bool {
    (0.0..=1.0).contains(&x)
}
