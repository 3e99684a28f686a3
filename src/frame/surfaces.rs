//! Surfaces in f32, laid out as shaders read them: strands as points and segments, meshes as
//! triangles, all in frame space.

use glam::{Vec4, Vec4Swizzles};

use super::fill::Space;
use crate::scene::{Casters, Shape, Surface};

/// In a segment's number: the point where it begins.
pub const SEGMENT_POINT: u32 = (1 << 30) - 1;
/// In a segment's number: nothing of its strand lies in front of it.
pub const FIRST_SEGMENT: u32 = 1 << 31;
/// In a segment's number: nothing of its strand follows it.
pub const LAST_SEGMENT: u32 = 1 << 30;

/// Optical depth of an opaque surface: its transmittance is about the smallest normal f32.
pub const OPAQUE: f32 = 87.0;

/// Surfaces: those that cast a beam's shadows, or those that the camera sees.
#[derive(Clone, Debug, Default)]
pub struct FrameSurfaces {
    /// Points of strands: position, and the strand's radius there.
    pub points: Vec<Vec4>,
    /// The opacity of a strand's crossing at each point, 0..1.
    pub opacities: Vec<f32>,
    /// For each segment of a strand the index of the point where it begins, with
    /// [`FIRST_SEGMENT`] and [`LAST_SEGMENT`]. It ends at the next point.
    pub segments: Vec<u32>,
    /// Corners of triangles; the first one's w is the optical depth of a crossing.
    pub triangles: Vec<[Vec4; 3]>,
}

impl FrameSurfaces {
    /// The surfaces of `casters` that cast shadows, in the space of their frame.
    pub fn of(casters: Casters<'_>) -> Self {
        Self::among(casters, |surface| surface.casts)
    }

    /// The surfaces of `casters` that are `wanted`, in the space of their frame.
    pub(super) fn among(casters: Casters<'_>, wanted: impl Fn(&Surface) -> bool) -> Self {
        let space = Space::of(casters);
        let mut all = Self::default();
        for surface in casters.surfaces.iter().filter(|surface| wanted(surface)) {
            let to = surface.world_from_object();
            match &surface.shape {
                Shape::Mesh(mesh) => all.triangles.extend((0..mesh.triangles().len()).map(|i| {
                    let optical_depth = -(1.0 - mesh.material(i).opacity).ln();
                    let [a, b, c] = mesh
                        .corners(i)
                        .map(|p| space.point(to.transform_point3(p.as_dvec3())).extend(0.0));
                    [a.xyz().extend((optical_depth as f32).min(OPAQUE)), b, c]
                })),
                Shape::Strands(strands) => {
                    let radius = 0.5 * surface.scale() / space.unit;
                    let before = all.points.len() as u32;
                    all.points.extend(strands.points().iter().enumerate().map(|(i, point)| {
                        let radius = radius * f64::from(strands.thickness().at(i));
                        let place = to.transform_point3(point.as_dvec3());
                        space.point(place).extend(radius as f32)
                    }));
                    all.opacities
                        .extend((0..strands.points().len()).map(|i| strands.opacity().at(i)));
                    for points in (0..strands.count()).map(|index| strands.strand(index)) {
                        let last = points.end - 2;
                        all.segments.extend((points.start..=last).map(|first| {
                            let begins = if first == points.start { FIRST_SEGMENT } else { 0 };
                            let ends = if first == last { LAST_SEGMENT } else { 0 };
                            (before + first as u32) | begins | ends
                        }));
                    }
                }
            }
        }
        all
    }
}
