//! The light's view of a volume: the rays of a shadow map's texels, and the way back from a point
//! to the map.
//!
//! ```text
//!   light  \ | /            (u, v) in 0..1 over the map, v = 0 is the top row
//!   near -- +-----+ u       depth: world length along the texel's ray,
//!           |  /\ |           from the near plane (directional)
//!           | /  \|           from the light      (point, spot)
//!           v \  /          the map's edges touch the volume's outline
//! ```

use glam::{DMat4, DVec3, DVec4, Vec3};

use super::{Casters, Light, LightKind, Media};
use crate::error::{Error, Result};
use crate::math::frame_of;

/// The largest angle, measured from the axis of its view, at which one view of a point or spot
/// light may see a corner of the volume.
const WIDEST_DEGREES: f64 = 80.0;

/// The smallest width or height of a view, as a share of what it sees.
const NARROWEST: f64 = 1e-6;

/// The rays through a map's texels, and the transform from the world to the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightView {
    /// World origin of the ray through (u, v) = (0, 0).
    pub origin: DVec3,
    /// Change of the origin over the map's width.
    pub origin_u: DVec3,
    /// Change of the origin over the map's height.
    pub origin_v: DVec3,
    /// Direction of the ray through (0, 0), not normalised.
    pub direction: DVec3,
    /// Change of the direction over the map's width.
    pub direction_u: DVec3,
    /// Change of the direction over the map's height.
    pub direction_v: DVec3,
    /// Transform from the world to (u, v, depth, 1), to be divided by the fourth component; column
    /// vectors. For point and spot lights the third component is the distance along the view's
    /// axis, before the division.
    pub light_from_world: DMat4,
    /// World position of a point or spot light; `None` for a directional light.
    pub position: Option<DVec3>,
    /// World length of a depth of 1 in a map ([`Media::unit`]).
    pub unit: f64,
    /// For a light among the media, the face of the cube around it that this view covers: +x, -x,
    /// +y, -y, +z, -z are 0 to 5. `None` if one view covers everything.
    pub face: Option<u32>,
}

/// The faces of a cube, as [`LightView::face`] numbers them.
const FACES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
/// How much wider than a face of the cube a view is, so that filters find texels beyond the face's
/// edges.
const FACE_MARGIN: f64 = 1.04;

impl LightView {
    /// The views of `light` that together see all of `casters`, which may be media alone. That is
    /// one tight view, except where a point or spot light stands among them, or so close that one
    /// view would be wider than 80 degrees to a side. Then it is a view for each face of a cube
    /// around the light that the light shines through.
    ///
    /// # Errors
    /// If a directional light's direction is zero.
    pub fn of<'a>(light: &Light, casters: impl Into<Casters<'a>>) -> Result<Vec<Self>> {
        let casters = casters.into();
        match light.kind {
            LightKind::Directional { direction } => {
                let forward = direction.try_normalize().ok_or_else(|| {
                    Error::value("light", format!("its direction {direction} has zero length"))
                })?;
                Ok(vec![Self::parallel(forward, casters)])
            }
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                let one = Self::tight(position, casters);
                Ok(one.map_or_else(
                    || Self::faces(light, position, casters.unit()),
                    |view| vec![view],
                ))
            }
        }
    }

    /// The smallest rectangle around the outline. It has a side along a projected edge of the media
    /// or, where there are surfaces, along a side of the outline's convex hull.
    fn parallel(forward: DVec3, casters: Casters<'_>) -> Self {
        let fit = |hint: DVec3| -> (f64, Self) {
            let (across, up) = frame_of(forward, hint);
            let down = -up;
            let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
            casters.for_each_ball(|center, radius| {
                for (end, axis) in ends.iter_mut().zip([across, down, forward]) {
                    let place = center.dot(axis);
                    *end = [end[0].min(place - radius), end[1].max(place + radius)];
                }
            });
            let [[u0, u1], [v0, v1], [near, far]] = ends;
            // Flat things seen from the side would have a map of no width.
            let largest = (u1 - u0).max(v1 - v0).max(far - near);
            let least = if largest > 0.0 { NARROWEST * largest } else { 1.0 };
            let (width, height) = ((u1 - u0).max(least), (v1 - v0).max(least));
            let rows = [
                (across / width).extend(-u0 / width),
                (down / height).extend(-v0 / height),
                forward.extend(-near),
                DVec4::W,
            ];
            let view = Self {
                origin: across * u0 + down * v0 + forward * near,
                origin_u: across * width,
                origin_v: down * height,
                direction: forward,
                direction_u: DVec3::ZERO,
                direction_v: DVec3::ZERO,
                light_from_world: from_rows(rows),
                position: None,
                unit: casters.unit(),
                face: None,
            };
            (width * height, view)
        };
        if !casters.surfaces.is_empty() {
            let (x, y) = frame_of(forward, DVec3::Y);
            return fit(casters.best_side(x, y)).1;
        }
        let corners = casters.media.world_corners();
        // An edge parallel to the light projects to a point; its rectangle is arbitrary, but still
        // a bound.
        let edges = [2, 1, 4].map(|i: usize| corners[i] - corners[0]);
        let smaller = |best: (f64, Self), other: (f64, Self)| {
            if other.0 < best.0 * (1.0 - 1e-9) { other } else { best }
        };
        smaller(smaller(fit(edges[0]), fit(edges[1])), fit(edges[2])).1
    }

    /// The view from a position outside of the volume; `None` if it would be too wide.
    fn tight(position: DVec3, casters: Casters<'_>) -> Option<Self> {
        if casters.is_empty() {
            // Nothing casts a shadow, so any view will do.
            let axes = [DVec3::X, DVec3::Z, DVec3::NEG_Y];
            return Some(Self::from_point(position, axes, [(-1.0, 1.0); 2], casters.unit()));
        }
        if casters.surround(position) {
            return None;
        }
        let to_corners: Vec<DVec3> = casters.corners().iter().map(|c| *c - position).collect();
        let forward = to_corners
            .iter()
            .map(|c| c.normalize_or_zero())
            .sum::<DVec3>()
            .try_normalize()
            .unwrap_or(DVec3::NEG_Y);
        let narrowest = WIDEST_DEGREES.to_radians().cos();
        if to_corners.iter().any(|c| c.normalize_or_zero().dot(forward) < narrowest) {
            return None;
        }
        let (right, up) = frame_of(forward, DVec3::Y);
        let slopes = |axis: DVec3| extent(to_corners.iter().map(|c| c.dot(axis) / c.dot(forward)));
        let sides = [slopes(right), slopes(-up)];
        Some(Self::from_point(position, [right, -up, forward], sides, casters.unit()))
    }

    /// A view for each face of a cube around `position` that the light shines through.
    fn faces(light: &Light, position: DVec3, unit: f64) -> Vec<Self> {
        // Angle between the directions to a face's centre and to its corners.
        let to_corner = 3.0_f64.sqrt().recip().acos();
        let lit = |forward: DVec3| match light.kind {
            LightKind::Spot { direction, cone_degrees, .. } => {
                let angle = forward.angle_between(direction);
                angle < cone_degrees.to_radians() + to_corner
            }
            _ => true,
        };
        let faces = (0..).zip(FACES).filter(|&(_, forward)| lit(forward));
        let view = |(face, forward): (u32, DVec3)| {
            let (right, up) = frame_of(forward, if forward.y == 0.0 { DVec3::Y } else { DVec3::Z });
            let sides = [(-FACE_MARGIN, FACE_MARGIN); 2];
            let view = Self::from_point(position, [right, -up, forward], sides, unit);
            Self { face: Some(face), ..view }
        };
        faces.map(view).collect()
    }

    /// A view from a position along `forward`, between the given slopes to the right and downwards.
    fn from_point(
        position: DVec3,
        [right, down, forward]: [DVec3; 3],
        [(u0, u1), (v0, v1)]: [(f64, f64); 2],
        unit: f64,
    ) -> Self {
        let about_light = |row: DVec3| row.extend(-row.dot(position));
        let rows = [
            about_light((right - forward * u0) / (u1 - u0)),
            about_light((down - forward * v0) / (v1 - v0)),
            about_light(forward),
            about_light(forward),
        ];
        Self {
            origin: position,
            origin_u: DVec3::ZERO,
            origin_v: DVec3::ZERO,
            direction: forward + right * u0 + down * v0,
            direction_u: right * (u1 - u0),
            direction_v: down * (v1 - v0),
            light_from_world: from_rows(rows),
            position: Some(position),
            unit,
            face: None,
        }
    }

    /// Origin and unit direction of the light ray through `(u, v)`.
    pub fn ray(&self, u: f64, v: f64) -> (DVec3, DVec3) {
        let direction = self.direction + u * self.direction_u + v * self.direction_v;
        (self.origin + u * self.origin_u + v * self.origin_v, direction.normalize())
    }

    /// Distances along the view's axis of the volume's nearest and farthest corner, in world
    /// lengths: from the near plane (directional) or from the light.
    pub fn axial_extent(&self, media: &Media) -> [f64; 2] {
        let corners = media.world_corners();
        let (near, far) = extent(corners.iter().map(|c| (self.light_from_world * c.extend(1.0)).z));
        [near.max(0.0), far]
    }

    /// Distances along the view's axis of what is nearest and farthest among media and surfaces, in
    /// world lengths: from the near plane (directional) or from the light.
    pub fn depths_of(&self, casters: Casters<'_>) -> [f64; 2] {
        if casters.surfaces.is_empty() {
            return self.axial_extent(casters.media);
        }
        let depth = |corner: DVec3| (self.light_from_world * corner.extend(1.0)).z;
        let (near, far) = extent(casters.corners().into_iter().map(depth));
        [near.max(0.0), far]
    }

    /// Number of voxel lengths between those two distances along the view's axis.
    pub fn axial_voxels(&self, media: &Media) -> f64 {
        let [near, far] = self.axial_extent(media);
        let axis = self.light_from_world.row(2).truncate().normalize_or_zero();
        let index_axis = media.world_from_index().inverse().transform_vector3(axis);
        (far - near) * index_axis.length()
    }

    /// The larger number of voxel lengths over the map's width and height: for a point or spot
    /// light, at its distance from the farthest corner.
    pub fn voxels_across(&self, media: &Media) -> f64 {
        let [_, far] = self.axial_extent(media);
        let across = |origin: DVec3, direction: DVec3| match self.position {
            Some(_) => direction * far,
            None => origin,
        };
        let sides =
            [across(self.origin_u, self.direction_u), across(self.origin_v, self.direction_v)];
        let index_from_world = media.world_from_index().inverse();
        let voxels = sides.map(|side| index_from_world.transform_vector3(side).length());
        voxels[0].max(voxels[1])
    }

    /// Whether this view covers the light at a world position: true, unless the position lies
    /// behind another face of the cube.
    pub fn answers_for(&self, world: DVec3) -> bool {
        let Some((position, face)) = self.position.zip(self.face) else { return true };
        let from_light = world - position;
        let along = |(_, forward): &(u32, DVec3)| from_light.dot(*forward);
        let most = |a: (u32, DVec3), b: (u32, DVec3)| if along(&b) > along(&a) { b } else { a };
        (0..).zip(FACES).reduce(most).is_some_and(|(own, _)| own == face)
    }

    /// (u, v, depth) of a world position, with depth in world lengths; `None` for positions behind
    /// a point or spot light.
    pub fn coordinates(&self, world: DVec3) -> Option<DVec3> {
        let light = self.light_from_world * world.extend(1.0);
        match self.position {
            None => Some(light.truncate()),
            Some(position) if light.w > 0.0 => {
                let depth = (world - position).length();
                Some(DVec3::new(light.x / light.w, light.y / light.w, depth))
            }
            Some(_) => None,
        }
    }

    /// (u, v, depth) of a world position as lookups in maps take them: depth in [`Self::unit`];
    /// `None` for positions behind a point or spot light.
    pub fn place(&self, world: DVec3) -> Option<Vec3> {
        let [u, v, depth] = self.coordinates(world)?.to_array();
        Some(DVec3::new(u, v, depth / self.unit).as_vec3())
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
}

fn from_rows(rows: [DVec4; 4]) -> DMat4 {
    DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
}
