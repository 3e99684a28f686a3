//! Pass `raster_surfaces`: draws strands and triangles into the texels of a map. Each texel gets
//! the fragments that its surfaces leave, in order of depth.
//!
//! A strand leaves one fragment for each run of its segments through a texel. Its coverage is the
//! area of the texel that they cover together, its opacity that of a crossing times the coverage
//! (Lokovic and Veach 2000, section 3.1, filter visibility functions likewise), and it lies between
//! the depths where the strand enters and leaves the texel. Without coverage, and for triangles, a
//! fragment is what the texel's central ray meets.

use std::ops::Range;

use glam::{Vec2, Vec4Swizzles};

use super::tiles::TILE;
use crate::error::{ErrorKind, Result};
use crate::frame::{FIRST_SEGMENT, Frame, FrameSurfaces, LAST_SEGMENT, SEGMENT_POINT};
use crate::kernel::coverage::{
    Stroke, covered, depth_along, holds, nearest_share, range_over, stroke_of,
};
use crate::kernel::light::light_ray;
use crate::kernel::triangle::{MapTriangle, triangle_depth, triangle_of};
use crate::math::Each;
use crate::parallel;
use crate::scene::Casters;
use crate::shadow::{Fragment, disjoint};

/// Number of surfaces' parts that are prepared together.
const CHUNK: usize = 1024;

/// Most bytes of the fragments of a tile, of which each thread works on one, and of the tiles' lists.
const MOST_BYTES: f64 = (1_u64 << 29) as f64;

/// A segment in the map.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    stroke: Stroke,
    /// Index of its first point; the next segment of a strand has the next index.
    point: u32,
    opacities: [f32; 2],
}

/// What a run of segments of one strand covers of a texel.
#[derive(Clone, Copy)]
struct Part {
    /// Index of the texel in its tile.
    texel: u32,
    /// Index of the last segment's first point.
    point: u32,
    area: f32,
    /// Area times opacity.
    taken: f32,
    depths: [f32; 2],
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
            Some(run) if run.point + 1 == part.point => {
                run.point = part.point;
                run.area += part.area;
                run.taken += part.taken;
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

/// Lists of texels or tiles.
#[derive(Debug)]
pub(super) struct Lists<T> {
    /// The index of each list's first item, and the number of items at the end.
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Lists<T> {
    /// The items of (list, item) pairs, each list's in the order of the pairs.
    fn sorted<'a>(count: usize, pairs: impl Iterator<Item = &'a (u32, T)> + Clone) -> Self
    where
        T: 'a,
    {
        let mut starts = vec![0_u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[*list as usize + 1] += 1;
        }
        for list in 0..count {
            starts[list + 1] += starts[list];
        }
        let mut next = starts.clone();
        let mut items = vec![T::default(); starts[count] as usize];
        for (list, item) in pairs {
            let place = &mut next[*list as usize];
            items[*place as usize] = *item;
            *place += 1;
        }
        Self { starts, items }
    }

    /// The items of a list.
    pub(super) fn of(&self, list: usize) -> &[T] {
        &self.items[self.starts[list] as usize..self.starts[list + 1] as usize]
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
    triangles: Vec<MapTriangle>,
    /// For each tile, which segments and triangles may touch it.
    segments_of: Lists<u32>,
    triangles_of: Lists<u32>,
    covers: bool,
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
        let size = frame.map.size as usize;
        let surfaces = FrameSurfaces::of(casters);
        let segments: Vec<Drawn> = flat(&surfaces.segments, |&segment| {
            let point = segment & SEGMENT_POINT;
            let both = [point as usize, point as usize + 1];
            let caps = [segment & FIRST_SEGMENT != 0, segment & LAST_SEGMENT != 0];
            let stroke = stroke_of(frame, both.map(|i| surfaces.points[i]), caps)?;
            Some(Drawn { stroke, point, opacities: both.map(|i| surfaces.opacities[i]) })
        });
        let triangles: Vec<MapTriangle> = flat(&surfaces.triangles, |corners| {
            triangle_of(frame, corners.map(Vec4Swizzles::xyz), corners[0].w)
        });
        let segments_of = bins(&segments, size, |drawn| drawn.stroke.outline)?;
        let triangles_of = bins(&triangles, size, |triangle| triangle.corners)?;
        let covers = frame.map.covers == 1;
        let frame = *frame;
        let all = Self { size, segments, triangles, segments_of, triangles_of, covers, frame };
        all.check_room().map(|()| Some(all))
    }

    /// Checks that there is memory for the fragments of the fullest tile.
    fn check_room(&self) -> Result<()> {
        let cells = (TILE * TILE) as f64;
        let of_segment = |index: &u32| {
            touched_cells(&self.segments[*index as usize].stroke.outline, 1.0).min(cells)
        };
        let of_triangles = (TILE * TILE * size_of::<(u32, Fragment)>()) as f64;
        let of_tile = |tile: usize| {
            let segments: f64 = self.segments_of.of(tile).iter().map(of_segment).sum();
            let triangles = self.triangles_of.of(tile).len() as f64 * of_triangles;
            segments * (size_of::<Part>() + 4 * size_of::<Fragment>()) as f64 + triangles
        };
        let tiles = self.size.div_ceil(TILE).pow(2);
        let fullest = (0..tiles).map(of_tile).fold(0.0, f64::max);
        check(fullest, "hair or meshes over one tile of the map")
    }

    /// The fragments of the texels in some columns and rows, which lie in one tile, row by row.
    pub(super) fn tile(&self, columns: Range<usize>, rows: Range<usize>) -> Lists<Fragment> {
        let texels = columns.len() * rows.len();
        let tile = rows.start / TILE * self.size.div_ceil(TILE) + columns.start / TILE;
        let mut parts = Parts { all: Vec::new(), open: vec![u32::MAX; texels] };
        for &index in self.segments_of.of(tile) {
            self.draw(&self.segments[index as usize], &columns, &rows, &mut parts);
        }
        let mut fragments: Vec<(u32, Fragment)> = parts
            .all
            .iter()
            .filter_map(|part| self.fragment(part).map(|fragment| (part.texel, fragment)))
            .collect();
        for &index in self.triangles_of.of(tile) {
            self.fill(&self.triangles[index as usize], &columns, &rows, &mut fragments);
        }
        pieces_of(texels, &fragments)
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
                if area <= 0.0 {
                    continue;
                }
                let opacity = opacities[0] + (opacities[1] - opacities[0]) * 0.5 * (from + to);
                let depths = [from, to].each(|share| depth_along(&self.frame, stroke, share));
                parts.add(Part {
                    texel: ((y - rows.start) * columns.len() + x - columns.start) as u32,
                    point: *point,
                    area,
                    taken: area * opacity,
                    depths: [depths[0].min(depths[1]), depths[0].max(depths[1])],
                });
            }
        }
    }

    /// What a run of segments of one strand leaves in a texel.
    fn fragment(&self, run: &Part) -> Option<Fragment> {
        let Part { area, taken, depths: [front, back], .. } = *run;
        let alpha = if area > 1.0 || !self.covers { taken / area } else { taken };
        let middle = 0.5 * (front + back);
        let [front, back] = if self.covers { [front, back] } else { [middle; 2] };
        let fragment = Fragment { back, ..Fragment::surface(front, alpha.clamp(0.0, 1.0)) };
        (fragment.optical_depth > 0.0 && back.is_finite()).then_some(fragment)
    }

    /// Adds to `fragments` those of the texels, in some columns and rows, whose central rays meet a
    /// triangle.
    fn fill(
        &self,
        triangle: &MapTriangle,
        columns: &Range<usize>,
        rows: &Range<usize>,
        fragments: &mut Vec<(u32, Fragment)>,
    ) {
        let size = self.size as f32;
        let outline = triangle.corners;
        for y in texels(outline.iter().map(|corner| corner.y), rows) {
            let Some([low, high]) = row_extent(&outline, y as f32) else { continue };
            for x in texels([low, high].into_iter(), columns) {
                let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let ray = light_ray(&self.frame, center.x / size, center.y / size);
                if let Some(depth) = triangle_depth(triangle, center, &ray) {
                    let texel = (y - rows.start) * columns.len() + x - columns.start;
                    let optical_depth = triangle.optical_depth;
                    let fragment = Fragment { front: depth, back: depth, optical_depth };
                    fragments.push((texel as u32, fragment));
                }
            }
        }
    }
}

/// Checks a number of bytes against the most that are taken.
fn check(bytes: f64, what: &str) -> Result<()> {
    if bytes <= MOST_BYTES {
        return Ok(());
    }
    let (needed, limit) = (format!("{bytes:.0} bytes"), format!("{MOST_BYTES:.0} bytes"));
    Err(ErrorKind::Limit { what: what.to_owned(), needed, limit }.into())
}

/// The number of square cells, with edges of `edge` texels, that a convex outline touches, on
/// average over its places: the area of the outline grown by a cell.
fn touched_cells(outline: &[Vec2; 4], edge: f32) -> f64 {
    let [a, b, c, d] = outline.each(|corner| corner / edge);
    let area = 0.5 * (c - a).perp_dot(d - b).abs();
    let spans = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
    f64::from(area + spans.x + spans.y + 1.0)
}

/// What `one` makes of items, on all threads, in their order.
fn flat<T: Sync, U: Send>(items: &[T], one: impl Fn(&T) -> Option<U> + Sync) -> Vec<U> {
    let chunks = parallel::map(items.chunks(CHUNK), |chunk| -> Vec<U> {
        chunk.iter().filter_map(&one).collect()
    });
    chunks.into_iter().flatten().collect()
}

/// The columns or rows among `all` that lie between places of these coordinates, in texels.
fn texels(places: impl Iterator<Item = f32>, all: &Range<usize>) -> Range<usize> {
    let (low, high) =
        places.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    // Conversions cut off the fraction and saturate, and NaN is 0.
    let begin = (low as usize).max(all.start);
    let end = (high as usize).saturating_add(usize::from(high >= 0.0)).min(all.end);
    begin.min(end)..end
}

/// The range of u of an outline between the rows' borders `y` and `y + 1`, in texels.
fn row_extent(outline: &[Vec2], y: f32) -> Option<[f32; 2]> {
    let mut extent: Option<[f32; 2]> = None;
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let (top, bottom) = if a.y < b.y { (a, b) } else { (b, a) };
        if bottom.y < y || top.y > y + 1.0 {
            continue;
        }
        let rise = bottom.y - top.y;
        for at in [y, y + 1.0] {
            let at = at.clamp(top.y, bottom.y);
            let share = if rise > 0.0 { (at - top.y) / rise } else { 0.0 };
            let x = top.x + (bottom.x - top.x) * share;
            let [low, high] = extent.unwrap_or([x; 2]);
            extent = Some([low.min(x), high.max(x)]);
        }
        if rise <= 0.0 {
            let [low, high] = extent.unwrap_or([bottom.x; 2]);
            extent = Some([low.min(bottom.x), high.max(bottom.x)]);
        }
    }
    extent
}

/// For each tile of a map of `size` squared texels, the indices of the items whose outlines touch it.
///
/// # Errors
/// If their lists would take too much memory.
fn bins<T: Sync>(
    items: &[T],
    size: usize,
    outline: impl Fn(&T) -> [Vec2; 4] + Sync,
) -> Result<Lists<u32>> {
    let across = size.div_ceil(TILE);
    let all = (across * across) as f64;
    let pairs = items.iter().map(|one| touched_cells(&outline(one), TILE as f32).min(all));
    check(pairs.sum::<f64>() * size_of::<(u32, u32)>() as f64, "wide hair or large triangles")?;
    let touched = |item: &T| -> Vec<u32> {
        let tiles = outline(item).each(|corner| corner / TILE as f32);
        let rows = texels(tiles.iter().map(|corner| corner.y), &(0..across));
        let of_row = |y: usize| {
            let extent = row_extent(&tiles, y as f32);
            let columns = extent.map(|ends| texels(ends.into_iter(), &(0..across)));
            columns.unwrap_or(0..0).map(move |x| (y * across + x) as u32)
        };
        rows.flat_map(of_row).collect()
    };
    let chunks = parallel::map(items.chunks(CHUNK).enumerate(), |(chunk, items)| {
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(2 * items.len());
        for (i, item) in items.iter().enumerate() {
            let index = (chunk * CHUNK + i) as u32;
            pairs.extend(touched(item).into_iter().map(|tile| (tile, index)));
        }
        pairs
    });
    Ok(Lists::sorted(across * across, chunks.iter().flatten()))
}
