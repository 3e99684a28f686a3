//! Surfaces in a scene: meshes and strands at their places in the world.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::surface::{Mesh, Strands};

/// What a surface consists of.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub enum Shape {
    Mesh(Arc<Mesh>),
    Strands(Arc<Strands>),
}

/// A mesh or strands, placed in the world.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its triangles or strands.
    pub shape: Shape,
    /// Transform from its own space to the world: a rotation, one scale for all axes, and a
    /// translation, for column vectors.
    world_from_object: DMat4,
    /// The box around it in the world.
    bounds: Aabb,
    /// Whether it casts shadows.
    pub casts: bool,
    /// Whether shadows fall on it.
    pub receives: bool,
    /// How strands reflect light besides their albedo.
    pub gloss: Gloss,
    /// Whether it reflects light at all; black otherwise.
    pub reflects: bool,
}

/// The highlight of strands (Kajiya and Kay 1989): rays leave a strand on a cone around it, at the
/// angle at which the light arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Radiance in the middle of the highlight, as a share of that of a white surface that faces the
    /// light, 0..1.
    pub specular: f64,
    /// How narrow it is: the power to which the cosine of the angle to the cone is raised, at least
    /// 1.
    pub shininess: f64,
}

impl Default for Gloss {
    fn default() -> Self {
        Self { specular: 0.1, shininess: 40.0 }
    }
}

/// Points on strands are looked up this many thicknesses nearer to the light, so that their own
/// strand is no part of their shadow.
pub const OFF_STRANDS: f64 = 1.1;

/// The surfaces of a scene. Copies share them.
#[derive(Clone, Debug, Default)]
pub struct Surfaces(Arc<Vec<Surface>>);

impl Surface {
    /// A surface that casts and receives shadows, at `world_from_object`, for column vectors.
    ///
    /// # Errors
    /// If that transform stretches unequally, so that a strand's thickness would have no meaning,
    /// or is not finite.
    pub fn new(shape: Shape, world_from_object: DMat4) -> Result<Self> {
        let axes = [0, 1, 2].map(|i| world_from_object.col(i).truncate());
        let scale = axes[0].length();
        let is_square = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-9 * scale * scale;
        let is_equal = axes.iter().all(|axis| (axis.length() - scale).abs() <= 1e-9 * scale);
        let right_angles = is_square(axes[0], axes[1])
            && is_square(axes[1], axes[2])
            && is_square(axes[0], axes[2]);
        if !(world_from_object.is_finite() && scale > 0.0 && is_equal && right_angles) {
            let why = "its transform is not a rotation, a scale above 0 and a translation";
            return Err(Error::value("surface", why));
        }
        let (min, max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut own = Self {
            shape,
            world_from_object,
            bounds: Aabb { min, max },
            casts: true,
            receives: true,
            gloss: Gloss::default(),
            reflects: true,
        };
        let mut bounds = own.bounds;
        own.for_each_ball(|center, radius| {
            (bounds.min, bounds.max) =
                (bounds.min.min(center - radius), bounds.max.max(center + radius));
        });
        own.bounds = bounds;
        Ok(own)
    }

    /// Transform from its own space to the world, for column vectors.
    pub fn world_from_object(&self) -> &DMat4 {
        &self.world_from_object
    }

    /// The box around it in the world.
    pub fn world_bounds(&self) -> Aabb {
        self.bounds
    }

    /// World lengths of a length of 1 in its own space.
    pub fn scale(&self) -> f64 {
        self.world_from_object.col(0).truncate().length()
    }

    /// Calls `visit` for points in the world, and the radius around each of a ball that belongs to
    /// the surface. The convex hull of all balls holds the surface.
    pub fn for_each_ball(&self, mut visit: impl FnMut(DVec3, f64)) {
        let to = &self.world_from_object;
        match &self.shape {
            Shape::Mesh(mesh) => {
                for &index in mesh.triangles().iter().flatten() {
                    let position = mesh.positions()[index as usize];
                    visit(to.transform_point3(position.as_dvec3()), 0.0);
                }
            }
            Shape::Strands(strands) => {
                let scale = 0.5 * self.scale();
                for (i, point) in strands.points().iter().enumerate() {
                    let radius = scale * f64::from(strands.thickness().at(i));
                    visit(to.transform_point3(point.as_dvec3()), radius);
                }
            }
        }
    }

    /// Whether both have the same triangles or strands in memory at the same place.
    fn same(&self, other: &Self) -> bool {
        let shape = match (&self.shape, &other.shape) {
            (Shape::Mesh(a), Shape::Mesh(b)) => Arc::ptr_eq(a, b),
            (Shape::Strands(a), Shape::Strands(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        shape && (self.world_from_object, self.casts) == (other.world_from_object, other.casts)
    }
}

impl From<Vec<Surface>> for Surfaces {
    fn from(surfaces: Vec<Surface>) -> Self {
        Self(Arc::new(surfaces))
    }
}

impl std::ops::Deref for Surfaces {
    type Target = [Surface];

    fn deref(&self) -> &[Surface] {
        &self.0
    }
}

impl Surfaces {
    /// Those that cast shadows.
    #[must_use]
    pub fn casting(&self) -> Self {
        if self.iter().all(|surface| surface.casts) {
            return self.clone();
        }
        let casting: Vec<Surface> = self.iter().filter(|one| one.casts).cloned().collect();
        casting.into()
    }

    /// The same surfaces, all of them black.
    #[must_use]
    pub fn black(&self) -> Self {
        let black = |surface: &Surface| Surface { reflects: false, ..surface.clone() };
        self.iter().map(black).collect::<Vec<Surface>>().into()
    }

    /// Whether both are the same surfaces in memory at the same places.
    pub fn same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
            || (self.len() == other.len() && self.iter().zip(&**other).all(|(a, b)| a.same(b)))
    }

    /// The box around all of them in the world; `None` if there are none.
    pub fn world_bounds(&self) -> Option<Aabb> {
        let boxes = self.iter().map(Surface::world_bounds);
        boxes.reduce(|a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) })
    }
}
