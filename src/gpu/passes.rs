//! Declares the passes: name, shader and bindings of each.

use wgpu::BindGroupLayoutEntry;

use super::bindings::{self, at, read, read_write};
use super::source::source;
use crate::settings::{Coding, MapKind};

/// The passes of the GPU backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Pass {
    TraceThreshold,
    FitCurves,
    TraceSlices,
    /// `trace_slices` among surfaces.
    TraceCasters,
    RasterSurfaces,
    RasterLarge,
    /// What both do, by the graphics pipeline.
    DrawSurfaces,
    SortSurfaces,
    RasterSlices,
    SortFragments,
    PackLists,
    LinkNeighbors,
    CodeNested,
    RasterView,
    RasterViewLarge,
    SortView,
    /// `march_view` through threshold maps.
    MarchThreshold,
    /// `march_view` through fragment maps.
    MarchFragments,
    /// The same with surfaces.
    MarchSurfaces,
    /// `march_view` through maps of nested knots.
    MarchNested,
    RankRadiance,
    /// `refine_view` through threshold maps.
    RefineThreshold,
    /// `refine_view` through fragment maps.
    RefineFragments,
    /// The same with surfaces.
    RefineSurfaces,
    /// `refine_view` through maps of nested knots.
    RefineNested,
    AddBeam,
    ShowImage,
}

/// Everything needed to compile and record a pass.
#[derive(Debug)]
pub(super) struct Declaration {
    /// Name of the shader and of its entry point.
    pub(super) name: &'static str,
    pub(super) source: &'static str,
    /// The kind of map that the pass reads or makes.
    pub(super) map: MapKind,
    /// Whether it samples media.
    pub(super) media: bool,
    /// Whether it reads what surfaces leave.
    pub(super) surfaces: bool,
    /// Its bindings besides the media.
    pub(super) bindings: Vec<BindGroupLayoutEntry>,
    /// Workgroup size along x and y, as in the shader.
    pub(super) workgroup: [u32; 2],
    /// Whether the shader has variants for some frames.
    pub(super) varies: bool,
}

/// Of a pass: the kind of map, whether it samples media, its bindings besides them, and the shader's
/// name and source.
type Content = (MapKind, bool, Vec<BindGroupLayoutEntry>, (&'static str, &'static str));

/// Maps of nested knots.
pub(super) const NESTED: MapKind = MapKind::Coded(Coding::Nested);

/// A shader's name and source.
macro_rules! named {
    ($name:literal) => {
        ($name, source!($name))
    };
}

impl Pass {
    /// All passes.
    pub(super) const ALL: [Self; 27] = [
        Self::TraceThreshold,
        Self::FitCurves,
        Self::TraceSlices,
        Self::TraceCasters,
        Self::RasterSurfaces,
        Self::RasterLarge,
        Self::DrawSurfaces,
        Self::SortSurfaces,
        Self::RasterSlices,
        Self::SortFragments,
        Self::PackLists,
        Self::LinkNeighbors,
        Self::CodeNested,
        Self::RasterView,
        Self::RasterViewLarge,
        Self::SortView,
        Self::MarchThreshold,
        Self::MarchFragments,
        Self::MarchSurfaces,
        Self::MarchNested,
        Self::RankRadiance,
        Self::RefineThreshold,
        Self::RefineFragments,
        Self::RefineSurfaces,
        Self::RefineNested,
        Self::AddBeam,
        Self::ShowImage,
    ];

    /// Bindings besides the media, and shader, of passes of surfaces, whose maps are of fragments.
    fn of_surfaces(self) -> Option<Content> {
        let (frame, tile, output) = (bindings::frame(), bindings::tile(), bindings::output());
        let [runs, nodes, heads, elements, counters, large] =
            [at::RUNS, at::NODES, at::HEADS, at::ELEMENTS, at::COUNTERS, at::LARGE].map(read_write);
        let casting = [at::POINTS, at::OPACITIES, at::SEGMENTS, at::CORNERS].map(read);
        let seeing = [at::SEGMENTS, at::LOOKS].map(read);
        let drawing = [frame, tile, heads, elements, counters];
        let marching = [frame, output, tile, heads, elements, read(at::LOOKS)];
        let lists = [at::RUNS, at::NODES, at::LINKS].map(read);
        let single = [bindings::single(), read(at::BRIGHT)];
        let (media, bindings, source) = match self {
            Self::TraceCasters => (
                true,
                vec![frame, runs, nodes, tile, counters, heads, elements],
                named!("trace_slices"),
            ),
            Self::RasterSurfaces => {
                (false, [&drawing[..], &casting, &[large]].concat(), named!("raster_surfaces"))
            }
            Self::RasterLarge => {
                (false, [&drawing[..], &casting, &[large]].concat(), named!("raster_large"))
            }
            Self::DrawSurfaces => {
                (false, [&drawing[..], &casting].concat(), named!("draw_surfaces"))
            }
            Self::SortSurfaces => {
                (false, vec![tile, heads, elements, counters], named!("sort_surfaces"))
            }
            Self::RasterView => {
                (false, [&drawing[..], &seeing, &[large]].concat(), named!("raster_view"))
            }
            Self::RasterViewLarge => {
                (false, [&drawing[..], &seeing, &[large]].concat(), named!("raster_view_large"))
            }
            Self::SortView => (false, vec![tile, heads, elements, counters], named!("sort_view")),
            Self::MarchSurfaces => (true, [&marching[..], &lists].concat(), named!("march_view")),
            Self::RefineSurfaces => {
                (true, [&marching[..], &lists, &single].concat(), named!("refine_view"))
            }
            _ => return None,
        };
        Some((MapKind::Fragments, media, bindings, source))
    }

    /// The same of the passes of maps of nested knots.
    fn of_nested(self) -> Option<Content> {
        let (frame, tile, output) = (bindings::frame(), bindings::tile(), bindings::output());
        let lists = [at::RUNS, at::NODES].map(read);
        let coded = [at::CODED, at::EXTENTS];
        let march = [&[frame, output], &coded.map(read)[..]].concat();
        let single = [bindings::single(), read(at::BRIGHT)];
        let (media, bindings, source) = match self {
            Self::CodeNested => (
                false,
                [&[frame, tile], &lists[..], &coded.map(read_write)].concat(),
                named!("code_nested"),
            ),
            Self::MarchNested => (true, march, named!("march_view")),
            Self::RefineNested => (true, [march, single.to_vec()].concat(), named!("refine_view")),
            _ => return None,
        };
        Some((NESTED, media, bindings, source))
    }

    /// The same of all other passes, with the kind of map.
    fn of_others(self) -> Content {
        let (frame, tile, output) = (bindings::frame(), bindings::tile(), bindings::output());
        let [runs, nodes, heads, elements, counters] =
            [at::RUNS, at::NODES, at::HEADS, at::ELEMENTS, at::COUNTERS].map(read_write);
        let kept_curves = [at::PIECE_ENDS, at::CUBICS].map(read_write);
        let [ends, cubics] = [at::PIECE_ENDS, at::CUBICS].map(read);
        let threshold_map = bindings::threshold_map();
        let lists = [at::RUNS, at::NODES, at::LINKS].map(read);
        let packed = [at::PACKED_RUNS, at::PACKED_NODES].map(read_write);
        let single = [bindings::single(), read(at::BRIGHT)];
        let slices = vec![frame, runs, nodes, tile, counters];
        match self {
            Self::TraceThreshold => (
                MapKind::Threshold,
                true,
                [&[frame, output], &kept_curves[..]].concat(),
                named!("trace_threshold"),
            ),
            Self::FitCurves => (
                MapKind::Threshold,
                false,
                [&[frame, threshold_map], &kept_curves[..]].concat(),
                named!("fit_curves"),
            ),
            Self::TraceSlices => (MapKind::Fragments, true, slices, named!("trace_slices")),
            Self::RasterSlices => (
                MapKind::Fragments,
                true,
                vec![frame, tile, heads, elements, counters],
                named!("raster_slices"),
            ),
            Self::SortFragments => (
                MapKind::Fragments,
                false,
                vec![frame, runs, nodes, tile, heads, elements, counters],
                named!("sort_fragments"),
            ),
            Self::PackLists => (
                MapKind::Fragments,
                false,
                [&[tile, counters], &lists[..2], &packed].concat(),
                named!("pack_lists"),
            ),
            Self::LinkNeighbors => (
                MapKind::Fragments,
                false,
                vec![read(at::RUNS), read(at::NODES), read_write(at::LINKS), tile],
                named!("link_neighbors"),
            ),
            Self::MarchThreshold => (
                MapKind::Threshold,
                true,
                vec![frame, threshold_map, output, ends, cubics],
                named!("march_view"),
            ),
            Self::MarchFragments => (
                MapKind::Fragments,
                true,
                [&[frame, output], &lists[..]].concat(),
                named!("march_view"),
            ),
            Self::RankRadiance => (
                MapKind::Fragments,
                false,
                vec![bindings::single(), read_write(at::BRIGHT)],
                named!("rank_radiance"),
            ),
            Self::RefineThreshold => (
                MapKind::Threshold,
                true,
                [&[frame, threshold_map, output, ends, cubics], &single[..]].concat(),
                named!("refine_view"),
            ),
            Self::RefineFragments => (
                MapKind::Fragments,
                true,
                [&[frame, output], &lists[..], &single[..]].concat(),
                named!("refine_view"),
            ),
            Self::ShowImage => (
                MapKind::Fragments,
                false,
                vec![bindings::single(), bindings::screen(), bindings::tone()],
                named!("show_image"),
            ),
            // `AddBeam`: those of surfaces and of nested knots were found before.
            _ => (
                MapKind::Fragments,
                false,
                vec![bindings::sum(), bindings::beam(), bindings::weights(), output],
                named!("add_beam"),
            ),
        }
    }

    pub(super) fn declaration(self) -> Declaration {
        let content = self.of_surfaces().or_else(|| self.of_nested());
        let content = content.unwrap_or_else(|| self.of_others());
        let (map, media, bindings, (name, source)) = content;
        // In `trace_slices` the threads' run times differ most.
        let workgroup = match self {
            Self::TraceSlices | Self::TraceCasters => [8, 4],
            Self::RasterSurfaces | Self::RasterLarge | Self::RasterView | Self::RasterViewLarge => {
                [64, 1]
            }
            Self::RankRadiance => [16, 16],
            _ => [8, 8],
        };
        let varies = matches!(name, "march_view" | "refine_view");
        let surfaces =
            matches!(self, Self::TraceCasters | Self::MarchSurfaces | Self::RefineSurfaces);
        Declaration { name, source, map, media, surfaces, bindings, workgroup, varies }
    }
}

/// The passes of pictures through maps of `kind`.
pub(super) fn passes(kind: MapKind) -> Vec<Pass> {
    match kind {
        MapKind::Threshold => vec![Pass::TraceThreshold, Pass::MarchThreshold],
        NESTED => vec![Pass::TraceSlices, Pass::CodeNested, Pass::MarchNested],
        _ => vec![Pass::TraceSlices, Pass::MarchFragments],
    }
}

/// The passes of pictures with surfaces, and of maps if some cast shadows.
pub(super) fn passes_of_surfaces(casts: bool, refines: bool) -> Vec<Pass> {
    let view = [Pass::RasterView, Pass::RasterViewLarge, Pass::SortView, Pass::MarchSurfaces];
    let refined = [Pass::RankRadiance, Pass::RefineSurfaces];
    let map: &[Pass] = if casts {
        &[Pass::TraceCasters, Pass::RasterSurfaces, Pass::RasterLarge, Pass::SortSurfaces]
    } else {
        &[Pass::TraceSlices]
    };
    [map, &view, if refines { &refined } else { &[] }].concat()
}

/// The root of a pass's shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassSource {
    /// Name of the pass and of its entry point.
    pub name: &'static str,
    /// The source, with its `#import` lines.
    pub source: &'static str,
    /// Workgroup size along x and y.
    pub workgroup: [u32; 2],
}

/// The roots of all passes' shaders.
pub fn pass_sources() -> Vec<PassSource> {
    let of = |pass: Pass| {
        let Declaration { name, source, workgroup, .. } = pass.declaration();
        PassSource { name, source, workgroup }
    };
    let mut sources = Pass::ALL.map(of).to_vec();
    sources.dedup();
    sources
}
