//! Passes with all their bindings, made once and recorded frame after frame. The parameters of a
//! frame may change in between ([`Renderer::update`]), so a light or a camera moves without
//! creating anything anew.

use std::sync::Arc;

use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{at, entry};
use super::fragments::GpuFragments;
use super::link::MediaKind;
use super::lists::GpuLists;
use super::media::GpuMedia;
use super::passes::Pass;
use super::programs::Program;
use super::renderer::{GpuFrame, GpuImage, GpuMap, Renderer};
use super::seen::GpuLooks;
use super::shadow::GpuShadow;
use crate::error::Result;
use crate::image::{Tone, ToneMap};

/// A pass with all its bindings, including the parameters of its frame.
#[derive(Clone, Debug)]
pub struct Prepared {
    program: Arc<Program>,
    /// The frame whose parameters it reads, if any.
    frame: Option<GpuFrame>,
    bindings: wgpu::BindGroup,
    workgroups: [u32; 2],
    /// A buffer that must be cleared before the pass.
    cleared: Option<wgpu::Buffer>,
}

impl Prepared {
    /// Records the pass with the parameters that its frame holds when the commands are submitted.
    /// When a variant of the shader is needed for the first time, the driver compiles the pass for
    /// it.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        let pipeline = self
            .program
            .pipeline(self.frame.as_ref().map(GpuFrame::variant).unwrap_or_default())?;
        if let Some(buffer) = &self.cleared {
            encoder.clear_buffer(buffer, 0, None);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        let [x, y] = self.workgroups;
        pass.dispatch_workgroups(x, y, 1);
        Ok(())
    }
}

impl Renderer {
    /// Prepares pass `trace_threshold`, which fills `map` for the light of `frame`.
    pub fn prepare_threshold(&self, media: &GpuMedia, frame: &GpuFrame, map: &GpuMap) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.push(entry(at::OUTPUT, BindingResource::TextureView(map.view())));
        entries.extend(map.curve_entries());
        let size = map.texture().width();
        self.prepare(Pass::TraceThreshold, media.kind(), Some(frame), entries, [size, size])
    }

    /// Prepares pass `trace_slices`, which fills `fragments` for the light of `frame`.
    pub fn prepare_slices(
        &self,
        media: &GpuMedia,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Prepared {
        self.prepare_lists(Pass::TraceSlices, (media, frame), &[], fragments)
    }

    /// Prepares pass `trace_slices` among surfaces, whose lists pass `sort_surfaces` has sorted, for
    /// the same tile. It relinks the lists.
    pub fn prepare_casters(
        &self,
        media: &GpuMedia,
        lists: &GpuLists,
        frame: &GpuFrame,
        fragments: &GpuFragments,
    ) -> Prepared {
        let more = lists.sorted_entries();
        self.prepare_lists(Pass::TraceCasters, (media, frame), &more, fragments)
    }

    /// Prepares pass `trace_slices`, with what it binds among surfaces as well.
    fn prepare_lists(
        &self,
        pass: Pass,
        (media, frame): (&GpuMedia, &GpuFrame),
        more: &[BindGroupEntry<'_>],
        fragments: &GpuFragments,
    ) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.extend(fragments.slices_entries());
        entries.extend_from_slice(more);
        let extent = fragments.tile.extent;
        let prepared = self.prepare(pass, media.kind(), Some(frame), entries, extent);
        Prepared { cleared: Some(fragments.counters.clone()), ..prepared }
    }

    /// Prepares pass `march_view`, which fills `image` for the camera of `frame`, lit through
    /// `shadow`.
    pub fn prepare_view(
        &self,
        media: &GpuMedia,
        frame: &GpuFrame,
        shadow: GpuShadow<'_>,
        image: &GpuImage,
    ) -> Prepared {
        self.prepare_rows(shadow.march(), (media, frame), shadow, (&[], image), image.size())
    }

    /// Prepares pass `march_view` with surfaces, for the rows of the picture in which pass
    /// `raster_view` listed what pixels see; the frame's first row is that of their tile.
    pub fn prepare_surfaces(
        &self,
        (media, frame): (&GpuMedia, &GpuFrame),
        map: &GpuFragments,
        (looks, seen): (&GpuLooks, &GpuLists),
        image: &GpuImage,
    ) -> Prepared {
        let entries = [&seen.seen_entries()[..], &[looks.entry()]].concat();
        let (shadow, extent) = (GpuShadow::Fragments(map), seen.tile().extent);
        let more = (&entries[..], image);
        self.prepare_rows(Pass::MarchSurfaces, (media, frame), shadow, more, extent)
    }

    /// Prepares `march_view` or `refine_view`, with what the latter binds as well, for the first
    /// `size` pixels behind the frame's first row.
    pub(super) fn prepare_rows(
        &self,
        pass: Pass,
        (media, frame): (&GpuMedia, &GpuFrame),
        shadow: GpuShadow<'_>,
        (more, image): (&[BindGroupEntry<'_>], &GpuImage),
        size: [u32; 2],
    ) -> Prepared {
        let mut entries = self.media_entries(media);
        entries.extend_from_slice(more);
        entries.push(entry(at::OUTPUT, BindingResource::TextureView(image.view())));
        match shadow {
            GpuShadow::Threshold(map) => {
                entries.push(entry(at::THRESHOLD_MAP, BindingResource::TextureView(map.view())));
                entries.extend(map.curve_entries());
            }
            GpuShadow::Fragments(map) => entries.extend(map.lookup_entries()),
            GpuShadow::Nested(map) => entries.extend(map.entries()),
        }
        self.prepare(pass, media.kind(), Some(frame), entries, size)
    }

    /// Prepares pass `add_beam`, which writes the sum of `sum` and the weighted `beam` to `output`.
    pub(super) fn prepare_sum(
        &self,
        [sum, beam, output]: [&GpuImage; 3],
        weights: glam::Vec4,
    ) -> Prepared {
        let weights =
            self.buffer("weights", bytemuck::bytes_of(&weights), wgpu::BufferUsages::UNIFORM);
        let entries = vec![
            entry(at::SUM, BindingResource::TextureView(sum.view())),
            entry(at::BEAM, BindingResource::TextureView(beam.view())),
            entry(at::WEIGHTS, weights.as_entire_binding()),
            entry(at::OUTPUT, BindingResource::TextureView(output.view())),
        ];
        self.prepare(Pass::AddBeam, MediaKind::Plain, None, entries, output.size())
    }

    /// Records pass `show_image`, which writes what a screen shows of `image` to `screen`: a view of
    /// a texture of format `Rgba8Unorm`, usable as storage and as large as the picture, that is
    /// to be shown as it is, sRGB-encoded, with straight alpha. [`Image::to_srgb8`] gives the same
    /// within a step of 8 bits.
    ///
    /// [`Image::to_srgb8`]: crate::image::Image::to_srgb8
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn show_image(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        image: &GpuImage,
        tone: Tone,
        screen: &wgpu::TextureView,
    ) -> Result<()> {
        let curve = ToneMap::ALL.iter().position(|one| *one == tone.map).unwrap_or_default();
        let tone = glam::Vec4::new(tone.exposure, curve as f32, 0.0, 0.0);
        let tone = self.buffer("tone", bytemuck::bytes_of(&tone), wgpu::BufferUsages::UNIFORM);
        let entries = vec![
            entry(at::SINGLE, BindingResource::TextureView(image.view())),
            entry(at::SCREEN, BindingResource::TextureView(screen)),
            entry(at::TONE, tone.as_entire_binding()),
        ];
        let size = image.size();
        self.prepare(Pass::ShowImage, MediaKind::Plain, None, entries, size).record(encoder)
    }

    /// A pass over the given number of texels or pixels.
    pub(super) fn prepare<'a>(
        &self,
        pass: Pass,
        media: MediaKind,
        frame: Option<&'a GpuFrame>,
        mut entries: Vec<BindGroupEntry<'a>>,
        size: [u32; 2],
    ) -> Prepared {
        let program = self.programs.compute(pass, media);
        if let Some(frame) = frame {
            entries.push(entry(at::FRAME, frame.buffer().as_entire_binding()));
        }
        let bindings = self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &program.layout,
            entries: &entries,
        });
        let threads = program.workgroup();
        let workgroups = std::array::from_fn(|axis| size[axis].div_ceil(threads[axis]));
        Prepared { program, frame: frame.cloned(), bindings, workgroups, cleared: None }
    }
}
