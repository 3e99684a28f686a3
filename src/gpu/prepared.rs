//! Passes with all that they bind: made once, recorded frame after frame. The parameters of a frame may change in
//! between ([`Renderer::update`]), so that a light or a camera moves without anything being made anew.

use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::media::GpuMedia;
use super::renderer::{GpuFrame, GpuImage, GpuMap, GpuShadow, Renderer};

/// Threads of a workgroup along x and y, as in the shaders.
const WORKGROUP: [u32; 2] = [8, 8];
/// Those of `trace_slices`, whose threads differ most in how long they take.
const SMALL_WORKGROUP: [u32; 2] = [8, 4];

/// A pass and all that it binds.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// For the usual settings, and for all.
    pipelines: [wgpu::ComputePipeline; 2],
    bindings: wgpu::BindGroup,
    workgroups: [u32; 2],
    /// What has to be 0 before it.
    cleared: Option<wgpu::Buffer>,
}

impl Prepared {
    /// Records the pass. `frame` is what it was prepared with, as it is or updated since.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, frame: &GpuFrame) {
        self.record_for(encoder, frame.usual());
    }

    /// The same in workgroups of so many threads.
    fn in_groups(self, size: [u32; 2], threads: [u32; 2]) -> Self {
        let workgroups = std::array::from_fn(|axis| size[axis].div_ceil(threads[axis]));
        Self { workgroups, ..self }
    }

    /// Records the pass for the usual settings or for all.
    pub(super) fn record_for(&self, encoder: &mut wgpu::CommandEncoder, usual: bool) {
        if let Some(buffer) = &self.cleared {
            encoder.clear_buffer(buffer, 0, None);
        }
        let [for_usual, general] = &self.pipelines;
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(if usual { for_usual } else { general });
        pass.set_bind_group(0, &self.bindings, &[]);
        let [x, y] = self.workgroups;
        pass.dispatch_workgroups(x, y, 1);
    }
}

impl Renderer {
    /// Pass `trace_threshold`, which fills `map` for the light of `frame`.
    pub fn prepare_threshold(&self, media: &GpuMedia, frame: &GpuFrame, map: &GpuMap) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        entries.push(entry(at::OUTPUT, BindingResource::TextureView(map.view())));
        entries.extend(map.curve_entries());
        let size = map.texture().width();
        self.prepare(&self.passes(media).trace_threshold, &entries, [size, size])
    }

    /// Pass `trace_slices`, which fills `fragments` for the light of `frame`.
    pub fn prepare_slices(
        &self,
        media: &GpuMedia,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        entries.extend(fragments.slices_entries());
        let pipeline = &self.passes(media).trace_slices;
        let extent = fragments.tile.extent;
        let prepared = self.prepare(pipeline, &entries, extent).in_groups(extent, SMALL_WORKGROUP);
        Prepared { cleared: Some(fragments.counters.clone()), ..prepared }
    }

    /// Pass `march_view`, which fills `image` for the camera of `frame`, lit through `shadow`.
    pub fn prepare_view(
        &self,
        media: &GpuMedia,
        frame: &GpuFrame,
        shadow: GpuShadow<'_>,
        image: &GpuImage,
    ) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        entries.push(entry(at::OUTPUT, BindingResource::TextureView(image.view())));
        let [usual, general] = match shadow {
            GpuShadow::Threshold(map) => {
                entries.push(entry(at::THRESHOLD_MAP, BindingResource::TextureView(map.view())));
                entries.extend(map.curve_entries());
                &self.passes(media).march_view
            }
            GpuShadow::Fragments(map) => {
                entries.push(entry(at::RUNS, map.runs().as_entire_binding()));
                entries.push(entry(at::NODES, map.nodes().as_entire_binding()));
                entries.push(entry(at::LINKS, map.links().as_entire_binding()));
                &self.passes(media).march_view_fragments
            }
        };
        let size = [image.texture().width(), image.texture().height()];
        let prepared = self.prepare(usual, &entries, size);
        Prepared { pipelines: [usual.clone(), general.clone()], ..prepared }
    }

    /// A pass over so many texels or pixels.
    pub(super) fn prepare(
        &self,
        pipeline: &wgpu::ComputePipeline,
        entries: &[BindGroupEntry<'_>],
        size: [u32; 2],
    ) -> Prepared {
        let bindings = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries,
        });
        let pipelines = [pipeline.clone(), pipeline.clone()];
        Prepared { pipelines, bindings, workgroups: [0; 2], cleared: None }
            .in_groups(size, WORKGROUP)
    }
}
