//! What a camera sees of surfaces: passes `raster_view`, `raster_view_large` and `sort_view`.

use bytemuck::cast_slice;
use glam::{Vec3, Vec4};
use wgpu::{BindGroupEntry, BufferUsages};

use super::bindings::{at, entry};
use super::lists::{GpuLists, Kind};
use super::passes::Pass;
use super::renderer::{GpuFrame, Renderer};
use super::surfaces::Drawing;
use super::tile::Tile;
use crate::error::{Error, Result};
use crate::frame::{Frame, FrameLooks, cells_around};
use crate::scene::Casters;

/// Bytes of a part of a strand, or of a triangle, in a pixel.
pub(super) const PART_BYTES: u64 = 56;
/// Pixels that see surfaces have at most as many rays as cells.
const MOST_RAYS: u32 = 64;

/// Strands and triangles on a device, and what they look like.
#[derive(Clone, Debug)]
pub struct GpuLooks {
    looks: wgpu::Buffer,
    segments: wgpu::Buffer,
    large: wgpu::Buffer,
    /// How many segments, triangles and points there are.
    counts: [u32; 3],
    /// The most rays of a pixel.
    pub(super) rays: u32,
}

impl GpuLooks {
    /// A tile of a picture in whose pixels these surfaces are seen.
    pub fn over(&self, tile: Tile) -> Tile {
        let [segments, triangles, points] = self.counts;
        Tile { segments, triangles, points, ..tile }
    }

    pub(super) fn entry(&self) -> BindGroupEntry<'_> {
        entry(at::LOOKS, self.looks.as_entire_binding())
    }
}

impl Renderer {
    /// Uploads surfaces with their looks to the device, for pictures with a number of rays a pixel.
    ///
    /// # Errors
    /// If they exceed the device's largest buffer binding, or if it has not enough memory.
    pub fn upload_looks(&self, looks: &FrameLooks, rays: u32) -> Result<GpuLooks> {
        let segments = &looks.shapes.segments;
        let counts = [segments.len(), looks.shapes.triangles.len(), looks.shapes.points.len()];
        let counts = counts.map(|count| count as u32);
        let rays = rays.min(MOST_RAYS);
        let laid_out = laid_out(looks, rays);
        let held: [(&str, &[u8]); 2] = [
            ("hair and meshes", cast_slice(&laid_out)),
            ("segments of hair", cast_slice(segments)),
        ];
        self.check_bindings(&held)?;
        let [looks, segments] = self
            .scopes
            .scoped(Error::gpu, || held.map(|(label, bytes)| self.storage_of(label, bytes)))?;
        let large = self.storage("large surfaces", u64::from(counts[0] + counts[1]) * 4);
        Ok(GpuLooks { looks, segments, large, counts, rays })
    }

    /// Uploads the surfaces of a picture, if there are some.
    ///
    /// # Errors
    /// As [`Renderer::upload_looks`], and if shading is the paper's, which has no place for them.
    pub(super) fn looks(&self, casters: Casters<'_>, frame: &Frame) -> Result<Option<GpuLooks>> {
        if casters.surfaces.is_empty() {
            return Ok(None);
        }
        frame.check_surfaces()?;
        self.upload_looks(&FrameLooks::of(casters), frame.view.samples).map(Some)
    }

    /// A storage buffer with contents; bindings must not be empty.
    pub(super) fn storage_of(&self, label: &str, bytes: &[u8]) -> wgpu::Buffer {
        match bytes {
            [] => self.storage(label, 0),
            _ => self.buffer(label, bytes, BufferUsages::STORAGE),
        }
    }

    /// Allocates lists of what is seen in the pixels of a tile ([`GpuLooks::over`]).
    pub fn seen(&self, tile: Tile) -> GpuLists {
        self.lists_of(tile, Kind { bytes: PART_BYTES, heads: 2 })
    }

    /// Records passes `raster_view` and `raster_view_large`, which fill empty lists.
    /// `frame` is the camera's ([`crate::frame::Frame::from_camera`]).
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn raster_view(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        looks: &GpuLooks,
        frame: &GpuFrame,
        lists: &GpuLists,
    ) -> Result<()> {
        let own = [entry(at::SEGMENTS, looks.segments.as_entire_binding()), looks.entry()];
        let drawing = Drawing {
            passes: [Pass::RasterView, Pass::RasterViewLarge],
            count: looks.counts[0] + looks.counts[1],
            own: &own,
            large: &looks.large,
        };
        self.record_raster(encoder, &drawing, frame, lists)
    }

    /// Records pass `sort_view`, which sorts the lists for [`Renderer::prepare_surfaces`].
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub fn sort_view(&self, encoder: &mut wgpu::CommandEncoder, lists: &GpuLists) -> Result<()> {
        self.record_over(encoder, Pass::SortView, lists)
    }
}

/// Looks as the shaders read them (`shaders/kernel/seen.wgsl`).
fn laid_out(looks: &FrameLooks, rays: u32) -> Vec<Vec4> {
    let FrameLooks { shapes, tangents, albedos, normals, triangle_albedos, coats } = looks;
    let mut all = vec![Vec4::new(rays as f32, 0.0, 0.0, 0.0)];
    all.extend(cells_around(rays).into_iter().map(|cells| {
        Vec4::from_array([0, 16, 32, 48].map(|first| f32::from((cells >> first) as u16)))
    }));
    for (i, point) in shapes.points.iter().enumerate() {
        all.extend([*point, tangents[i].extend(shapes.opacities[i]), albedos[i]]);
    }
    for (i, corners) in shapes.triangles.iter().enumerate() {
        all.extend(corners);
        all.extend(normals[i].map(|normal| normal.extend(0.0)));
        all.push(triangle_albedos[i]);
    }
    all.extend(coats.iter().map(|coat| {
        Vec3::new(f32::from(u8::from(coat.receives)), coat.specular, coat.shininess).extend(0.0)
    }));
    all
}
