//! The passes' pipelines, named as the passes.

use super::bindings::{self, at, pipeline, read, read_write};
use super::link::MediaKind;
use super::{lists, pass};
use crate::error::Result;
use crate::settings::MapKind;

/// Those that sample media, compiled for one kind of them.
#[derive(Debug)]
pub(super) struct MediaPasses {
    pub(super) trace_threshold: wgpu::ComputePipeline,
    pub(super) trace_slices: wgpu::ComputePipeline,
    pub(super) raster_slices: wgpu::RenderPipeline,
    /// For the usual settings and for all.
    pub(super) march_view: [wgpu::ComputePipeline; 2],
    pub(super) march_view_fragments: [wgpu::ComputePipeline; 2],
}

impl MediaPasses {
    /// Compiles them side by side: drivers take up to a second for each.
    pub(super) fn new(device: &wgpu::Device, media: MediaKind) -> Result<Self> {
        let sampled = |more: &[_]| {
            let mut entries = bindings::media(media);
            entries.push(bindings::frame());
            entries.extend_from_slice(more);
            entries
        };
        let compute = |name, map, entries: &[_]| {
            pipeline(device, pass(name)?, (map, media), &sampled(entries))
        };
        let march = |map, entries: &[_]| {
            let pass = pass("march_view")?;
            bindings::usual_and_general(device, pass, (map, media), &sampled(entries))
        };
        let (tile, output) = (bindings::tile(), bindings::output());
        let [runs, nodes, heads, elements, counters] =
            [at::RUNS, at::NODES, at::HEADS, at::ELEMENTS, at::COUNTERS].map(read_write);
        let lists = [read(at::RUNS), read(at::NODES), read(at::LINKS)];
        let [kept_ends, kept_cubics] = bindings::curves(read_write);
        let [ends, cubics] = bindings::curves(read);
        let map = bindings::threshold_map();
        let drawn = sampled(&[tile, heads, elements, counters]);
        let threshold =
            || compute("trace_threshold", MapKind::Threshold, &[output, kept_ends, kept_cubics]);
        let slices = || compute("trace_slices", MapKind::Fragments, &[runs, nodes, tile, counters]);
        let raster = || {
            bindings::checked(device, || {
                lists::raster_pipeline(device, pass("raster_slices")?, media, drawn)
            })
        };
        let view = || march(MapKind::Threshold, &[map, output, ends, cubics]);
        let lists = || march(MapKind::Fragments, &[output, lists[0], lists[1], lists[2]]);
        let ((threshold, (slices, raster)), (view, lists)) = rayon::join(
            || rayon::join(threshold, || rayon::join(slices, raster)),
            || rayon::join(view, lists),
        );
        Ok(Self {
            trace_threshold: threshold?,
            trace_slices: slices?,
            raster_slices: raster?,
            march_view: view?,
            march_view_fragments: lists?,
        })
    }
}

/// Those that work on maps alone.
#[derive(Debug)]
pub(super) struct MapPasses {
    pub(super) fit_curves: wgpu::ComputePipeline,
    pub(super) sort_fragments: wgpu::ComputePipeline,
    pub(super) link_neighbors: wgpu::ComputePipeline,
}

impl MapPasses {
    pub(super) fn new(device: &wgpu::Device) -> Result<Self> {
        let compute = |name, entries: &[_]| {
            pipeline(device, pass(name)?, (MapKind::Fragments, MediaKind::Plain), entries)
        };
        let (frame, tile) = (bindings::frame(), bindings::tile());
        let [runs, nodes, heads, elements, counters] =
            [at::RUNS, at::NODES, at::HEADS, at::ELEMENTS, at::COUNTERS].map(read_write);
        let links = read_write(at::LINKS);
        let [ends, cubics] = bindings::curves(read_write);
        Ok(Self {
            fit_curves: compute("fit_curves", &[frame, bindings::threshold_map(), ends, cubics])?,
            sort_fragments: compute(
                "sort_fragments",
                &[frame, runs, nodes, tile, heads, elements, counters],
            )?,
            link_neighbors: compute(
                "link_neighbors",
                &[read(at::RUNS), read(at::NODES), links, tile],
            )?,
        })
    }
}
