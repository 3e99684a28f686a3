//! Pass `raster_view`: which surfaces the pixels of a picture see. Strands cover parts of pixels, as
//! they do of a map's texels; triangles are met by a pixel's rays.

use std::ops::Range;

use glam::Vec2;

use super::bins::Lists;
use super::raster_surfaces::{Part, SurfaceRaster};
use crate::error::Result;
use crate::frame::{Frame, FrameLooks};
use crate::kernel::light::light_ray;
use crate::kernel::triangle::triangle_depth;
use crate::scene::Casters;

/// Surfaces as a camera sees them, sorted into the tiles of its picture.
pub(super) struct ViewRaster {
    raster: SurfaceRaster,
    pub looks: FrameLooks,
    /// The camera in a light's place.
    frame: Frame,
}

/// A triangle that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Distance along the ray.
    pub depth: f32,
    pub triangle: u32,
    /// The cells of its pixel that the ray stands for.
    pub cells: u64,
}

/// What the pixels in some columns and rows see.
pub(super) struct Seen {
    /// What strands cover of each pixel.
    pub strands: Lists<Part>,
    /// The triangles that may touch each pixel, as the raster counts them.
    pub triangles: Lists<u32>,
}

impl ViewRaster {
    /// Prepares the surfaces of `casters`; `None` if there are none.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] if a tile's surfaces would not fit memory, and if shading is the
    /// paper's, which has no place for surfaces.
    pub(super) fn new(casters: Casters<'_>, frame: &Frame) -> Result<Option<Self>> {
        if casters.surfaces.is_empty() {
            return Ok(None);
        }
        frame.check_surfaces()?;
        let (looks, frame) = (FrameLooks::of(casters), frame.from_camera());
        let raster = SurfaceRaster::of(&looks.shapes, &frame, true)?;
        Ok(Some(Self { raster, looks, frame }))
    }

    /// What the pixels in some columns and rows, which lie in one tile, see, row by row.
    pub(super) fn tile(&self, columns: &Range<usize>, rows: &Range<usize>) -> Seen {
        let pixels = columns.len() * rows.len();
        let strands: Vec<(u32, Part)> =
            self.raster.strands(columns, rows).into_iter().map(|part| (part.texel, part)).collect();
        let mut triangles = Vec::new();
        self.raster.triangles(columns, rows, |pixel, _, index| triangles.push((pixel, index)));
        Seen {
            strands: Lists::sorted(pixels, strands.iter()),
            triangles: Lists::sorted(pixels, triangles.iter()),
        }
    }

    /// Adds to `hits` the triangles, among `some`, that the ray at an offset within pixel (x, y)
    /// meets, and which stands for some `cells`; all are then in order of depth.
    pub(super) fn meet(
        &self,
        some: &[u32],
        [x, y]: [usize; 2],
        (offset, cells): (Vec2, u64),
        hits: &mut Vec<Hit>,
    ) {
        let place = Vec2::new(x as f32, y as f32) + offset;
        let size = self.frame.map.size as f32;
        let ray = light_ray(&self.frame, place.x / size, place.y / size);
        hits.extend(some.iter().filter_map(|&index| {
            let (triangle, own) = self.raster.triangle(index);
            let depth = triangle_depth(own, place, &ray)?;
            Some(Hit { depth, triangle: *triangle, cells })
        }));
        hits.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    }
}
