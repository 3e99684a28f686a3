//! Pass `raster_surfaces`: draws strands and triangles into the texels of a map. Each texel gets
//! the fragments that its surfaces leave, in order of depth.
//!
//! A strand leaves one fragment for each run of its segments through a texel. Its coverage is the
//! area of the texel that they cover together, its opacity that of a crossing times the coverage
//! (Lokovic and Veach 2000, section 3.1, filter visibility functions likewise), and it lies between
//! the depths where the strand enters and leaves the texel. Without coverage, and for triangles, a
//! fragment is what the texel's central ray meets.

use std::ops::Range;

use glam::{Vec2, Vec4, Vec4Swizzles};

use super::bins::{Lists, bins, check, flat, row_extent, texels, touched_cells};
use super::tiles::TILE;
use crate::error::Result;
use crate::frame::{CELLS, FIRST_SEGMENT, Frame, FrameSurfaces, LAST_SEGMENT, SEGMENT_POINT};
use crate::kernel::coverage::{
    LEAST_AREA, Stroke, cells_of, covered, depth_along, holds, nearest_share, range_over,
    share_along, stroke_of,
};
use crate::kernel::light::light_ray;
use crate::kernel::triangle::{MapTriangle, triangle_depth, triangle_of};
use crate::math::Each;
use crate::scene::Casters;
use crate::shadow::{Fragment, disjoint};

/// A segment in the map.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    stroke: Stroke,
    /// Index of its first point; the next segment of a strand has the next index.
    point: u32,
    opacities: [f32; 2],
}

/// What a run of segments of one strand covers of a texel.
#[derive(Clone, Copy, Default)]
pub(super) struct Part {
    /// Index of the texel in its tile.
    pub texel: u32,
    /// Indices of the first points of its first and its last segment.
    points: [u32; 2],
    area: f32,
    /// Area times opacity.
    taken: f32,
    /// Area times distance along the strand from the first of the points, of which each is 1 from
    /// the next.
    along: f32,
    depths: [f32; 2],
    /// The cells of the texel that it covers ([`cells_of`]), for pictures.
    cells: u64,
}

impl Part {
    /// The share of light that it takes of its texel, 0..1.
    pub(super) fn alpha(&self) -> f32 {
        (self.taken / self.area.max(1.0)).clamp(0.0, 1.0)
    }

    /// The cells of its texel that it covers, and the share of light that it takes of each of them
    /// and of each of the others, 0..1: together it takes what its area says. What is too thin to
    /// meet the cells' middles is spread over all.
    pub(super) fn cells(&self) -> (u64, [f32; 2]) {
        let cells = (CELLS * CELLS) as f32;
        let (alpha, met) = (self.alpha(), self.cells.count_ones() as f32);
        if 2.0 * met < cells * self.area.min(1.0) || met == 0.0 {
            return (u64::MAX, [alpha, 0.0]);
        }
        let of_met = alpha * cells / met;
        let rest = (of_met - 1.0).max(0.0) * met / (cells - met).max(1.0);
        (self.cells, [of_met, rest].map(|share| share.min(1.0)))
    }

    /// The depth in its middle.
    pub(super) fn depth(&self) -> f32 {
        0.5 * (self.depths[0] + self.depths[1])
    }

    /// The place in its middle: the point where a segment begins, and a share of the way to the
    /// next.
    pub(super) fn place(&self) -> (u32, f32) {
        let [first, last] = self.points;
        let along = self.along / self.area;
        let whole = (along as u32).min(last - first);
        (first + whole, (along - whole as f32).clamp(0.0, 1.0))
    }
}

/// The parts of a tile's texels.
struct Parts {
    all: Vec<Part>,
    /// For each texel the index of its last part, whose strand may go on.
    open: Vec<u32>,
}

impl Parts {
    /// Adds what one more segment covers. The segments of a strand come in their order.
    #[inline]
    fn add(&mut self, part: Part) {
        let open = &mut self.open[part.texel as usize];
        match self.all.get_mut(*open as usize) {
            Some(run) if run.points[1] + 1 == part.points[0] => {
                run.points[1] = part.points[0];
                run.area += part.area;
                run.taken += part.taken;
                let before = (part.points[0] - run.points[0]) as f32;
                run.along += part.along + part.area * before;
                run.cells |= part.cells;
                run.depths[0] = run.depths[0].min(part.depths[0]);
                run.depths[1] = run.depths[1].max(part.depths[1]);
            }
            _ => {
                *open = self.all.len() as u32;
                self.all.push(part);
            }
        }
    }
}

/// The pieces of `texels` texels, made of their fragments: in order of depth, of which none overlaps
/// another.
fn pieces_of(texels: usize, fragments: &[(u32, Fragment)]) -> Lists<Fragment> {
    let Lists { starts: ends, items: mut sorted } = Lists::sorted(texels, fragments.iter());
    let mut pieces = Lists { starts: vec![0], items: Vec::with_capacity(2 * fragments.len()) };
    let mut open = Vec::new();
    for ends in ends.windows(2) {
        let own = &mut sorted[ends[0] as usize..ends[1] as usize];
        disjoint(own, &mut open, &mut pieces.items);
        pieces.starts.push(pieces.items.len() as u32);
    }
    pieces
}

/// Surfaces as a map sees them, sorted into its tiles.
#[derive(Debug)]
pub(super) struct SurfaceRaster {
    size: usize,
    segments: Vec<Drawn>,
    /// Triangles, each with its index.
    triangles: Vec<(u32, MapTriangle)>,
    /// For each tile, which segments and triangles may touch it.
    segments_of: Lists<u32>,
    triangles_of: Lists<u32>,
    covers: bool,
    /// Whether parts know which cells they cover.
    has_cells: bool,
    frame: Frame,
}

impl SurfaceRaster {
    /// Prepares the surfaces of `casters` that cast shadows; `None` if there are none.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] if so many wide strands lie over each other that a tile's fragments
    /// would not fit memory.
    pub(super) fn new(casters: Casters<'_>, frame: &Frame) -> Result<Option<Self>> {
        if casters.surfaces.iter().all(|surface| !surface.casts) {
            return Ok(None);
        }
        Self::of(&FrameSurfaces::of(casters), frame, false).map(Some)
    }

    /// Prepares `surfaces`; of strands `has_cells` says whether their cells are wanted.
    ///
    /// # Errors
    /// As [`SurfaceRaster::new`].
    pub(super) fn of(surfaces: &FrameSurfaces, frame: &Frame, has_cells: bool) -> Result<Self> {
        let size = frame.map.size as usize;
        let segments: Vec<Drawn> = flat(&surfaces.segments, |&segment| {
            let point = segment & SEGMENT_POINT;
            let both = [point as usize, point as usize + 1];
            let caps = [segment & FIRST_SEGMENT != 0, segment & LAST_SEGMENT != 0];
            let stroke = stroke_of(frame, both.map(|i| surfaces.points[i]), caps)?;
            Some(Drawn { stroke, point, opacities: both.map(|i| surfaces.opacities[i]) })
        });
        let indexed: Vec<(u32, &[Vec4; 3])> = (0..).zip(&surfaces.triangles).collect();
        let triangles: Vec<(u32, MapTriangle)> = flat(&indexed, |&(index, corners)| {
            let triangle = triangle_of(frame, corners.map(Vec4Swizzles::xyz), corners[0].w)?;
            Some((index, triangle))
        });
        let segments_of = bins(&segments, size, |drawn| drawn.stroke.outline)?;
        let triangles_of = bins(&triangles, size, |(_, triangle)| triangle.corners)?;
        let covers = frame.map.covers == 1;
        let frame = *frame;
        let all =
            Self { size, segments, triangles, segments_of, triangles_of, covers, has_cells, frame };
        all.check_room().map(|()| all)
    }

    /// Checks that there is memory for the fragments of the fullest tile.
    fn check_room(&self) -> Result<()> {
        let cells = (TILE * TILE) as f64;
        let of_segment = |index: &u32| {
            touched_cells(&self.segments[*index as usize].stroke.outline, 1.0).min(cells)
        };
        let of_triangle =
            |number: &u32| touched_cells(&self.triangle(*number).1.corners, 1.0).min(cells);
        let of_tile = |tile: usize| {
            let segments: f64 = self.segments_of.of(tile).iter().map(of_segment).sum();
            let triangles: f64 = self.triangles_of.of(tile).iter().map(of_triangle).sum();
            segments * (size_of::<Part>() + 4 * size_of::<Fragment>()) as f64
                + triangles * size_of::<(u32, Fragment)>() as f64
        };
        let tiles = self.size.div_ceil(TILE).pow(2);
        let fullest = (0..tiles).map(of_tile).fold(0.0, f64::max);
        check(fullest, "hair or meshes over one tile of a map or a picture")
    }

    /// The fragments of the texels in some columns and rows, which lie in one tile, row by row.
    pub(super) fn tile(&self, columns: Range<usize>, rows: Range<usize>) -> Lists<Fragment> {
        let fragment = |part: &Part| self.fragment(part).map(|fragment| (part.texel, fragment));
        let parts = self.strands(&columns, &rows);
        let mut fragments: Vec<(u32, Fragment)> = parts.iter().filter_map(fragment).collect();
        let size = self.size as f32;
        self.triangles(&columns, &rows, |texel, place, index| {
            let triangle = &self.triangle(index).1;
            let center = place + 0.5;
            let ray = light_ray(&self.frame, center.x / size, center.y / size);
            if let Some(depth) = triangle_depth(triangle, center, &ray) {
                let optical_depth = triangle.optical_depth;
                fragments.push((texel, Fragment { front: depth, back: depth, optical_depth }));
            }
        });
        pieces_of(columns.len() * rows.len(), &fragments)
    }

    /// The tile that holds the texels in some columns and rows.
    fn tile_of(&self, columns: &Range<usize>, rows: &Range<usize>) -> usize {
        rows.start / TILE * self.size.div_ceil(TILE) + columns.start / TILE
    }

    /// What strands cover of the texels in some columns and rows, which lie in one tile.
    pub(super) fn strands(&self, columns: &Range<usize>, rows: &Range<usize>) -> Vec<Part> {
        let open = vec![u32::MAX; columns.len() * rows.len()];
        let mut parts = Parts { all: Vec::new(), open };
        for &index in self.segments_of.of(self.tile_of(columns, rows)) {
            self.draw(&self.segments[index as usize], columns, rows, &mut parts);
        }
        parts.all
    }

    /// A triangle by the number that it has here, with its index among all.
    pub(super) fn triangle(&self, number: u32) -> &(u32, MapTriangle) {
        &self.triangles[number as usize]
    }

    /// Calls `visit` for the texels, in some columns and rows in one tile, that triangles may touch,
    /// with the texel's index there, its upper left corner, and the number of the triangle.
    pub(super) fn triangles(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
        mut visit: impl FnMut(u32, Vec2, u32),
    ) {
        for &index in self.triangles_of.of(self.tile_of(columns, rows)) {
            let outline = self.triangle(index).1.corners;
            for y in texels(outline.iter().map(|corner| corner.y), rows) {
                let Some([low, high]) = row_extent(&outline, y as f32) else { continue };
                for x in texels([low, high].into_iter(), columns) {
                    let texel = (y - rows.start) * columns.len() + x - columns.start;
                    visit(texel as u32, Vec2::new(x as f32, y as f32), index);
                }
            }
        }
    }

    /// Adds to `parts` what a segment covers of the texels in some columns and rows.
    fn draw(&self, drawn: &Drawn, columns: &Range<usize>, rows: &Range<usize>, parts: &mut Parts) {
        let Drawn { stroke, point, opacities } = drawn;
        for y in texels(stroke.outline.iter().map(|corner| corner.y), rows) {
            let Some([low, high]) = row_extent(&stroke.outline, y as f32) else { continue };
            for x in texels([low, high].into_iter(), columns) {
                let texel = Vec2::new(x as f32, y as f32);
                let (area, [from, to]) = if self.covers {
                    (covered(&stroke.sides, texel), range_over(stroke, texel))
                } else {
                    let center = texel + 0.5;
                    let share = nearest_share(stroke, center);
                    (f32::from(holds(&stroke.outline, center)), [share; 2])
                };
                if area <= LEAST_AREA {
                    continue;
                }
                let [from, to] = [from, to].each(|share| share_along(stroke, share));
                let depths = [from, to].each(|share| depth_along(&self.frame, stroke, share));
                let [begin, end] = stroke.shares;
                let middle = begin + (end - begin) * 0.5 * (from + to);
                let opacity = opacities[0] + (opacities[1] - opacities[0]) * middle;
                parts.add(Part {
                    texel: ((y - rows.start) * columns.len() + x - columns.start) as u32,
                    points: [*point; 2],
                    area,
                    taken: area * opacity,
                    along: area * middle,
                    cells: if self.has_cells { cells_of(&stroke.sides, texel) } else { 0 },
                    depths: [depths[0].min(depths[1]), depths[0].max(depths[1])],
                });
            }
        }
    }

    /// What a run of segments of one strand leaves in a texel.
    fn fragment(&self, run: &Part) -> Option<Fragment> {
        let [front, back] = if self.covers { run.depths } else { [run.depth(); 2] };
        let fragment = Fragment { back, ..Fragment::surface(front, run.alpha()) };
        (fragment.optical_depth > 0.0 && back.is_finite()).then_some(fragment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However many of the cells' middles a strand meets, it takes what its area says.
    #[test]
    fn cells_take_what_the_area_says() {
        for (met, area) in [(40, 0.64), (40, 0.62), (3, 0.05), (0, 0.01), (1, 0.2), (64, 1.3)] {
            for opacity in [0.3, 1.0] {
                let cells = if met == 64 { u64::MAX } else { (1 << met) - 1 };
                let part = Part { area, taken: area * opacity, cells, ..Part::default() };
                let (bits, [own, rest]) = part.cells();
                let met = bits.count_ones() as f32;
                let taken = (met * own + (64.0 - met) * rest) / 64.0;
                let due = area.min(1.0) * opacity;
                assert!((taken - due).abs() < 1e-6, "{met}, {area}: {taken}, not {due}");
            }
        }
    }
}
