//! Media on a device: the texture or the blocks of one volume, or the textures, parameters and
//! tables of a mixture.

use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroupEntry, BindingResource};

use super::bindings::{at, entry};
use super::blocks::GpuBlocks;
use super::field::{GpuField, longer, texture, write_layers};
use super::link::MediaKind;
use super::renderer::Renderer;
use crate::error::{ErrorKind, Result};
use crate::frame::{Field, MOST_FIELDS, MOST_PARTS, Mixture, Part};
use crate::scene::{Body, Media, Occupancy};
use crate::volume::{Volume, Voxels};

/// Media on a device.
#[derive(Clone, Debug)]
pub struct GpuMedia {
    content: Content,
    /// The bricks' codes.
    occupancy: wgpu::TextureView,
}

/// The resources that passes bind.
#[derive(Clone, Debug)]
enum Content {
    Plain(GpuField),
    Blocks(GpuBlocks),
    Mixed { fields: Vec<GpuField>, one_field: bool, mixture: wgpu::Buffer, tables: wgpu::Buffer },
}

/// The uniform `Mixture` of `shaders/media/mixture.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct MixtureUniform {
    counts: [u32; 4],
    parts: [Part; MOST_PARTS],
    fields: [Field; MOST_FIELDS],
}

impl GpuMedia {
    /// The kind of media, which selects shader files.
    pub fn kind(&self) -> MediaKind {
        match self.content {
            Content::Plain(_) => MediaKind::Plain,
            Content::Blocks(_) => MediaKind::Blocks,
            Content::Mixed { one_field: true, .. } => MediaKind::OneField,
            Content::Mixed { .. } => MediaKind::Mixed,
        }
    }

    /// The kind that media will have on a device.
    pub(super) fn kind_of(device: &wgpu::Device, media: &Media) -> MediaKind {
        let limit = device.limits().max_texture_dimension_3d;
        match media.plain() {
            None if of_one_field(media) => MediaKind::OneField,
            None => MediaKind::Mixed,
            Some(volume) => match volume.voxels() {
                Voxels::Dense(_) if longer(volume.dims(), limit).is_none() => MediaKind::Plain,
                _ => MediaKind::Blocks,
            },
        }
    }

    /// The density for which a texture value of 1 stands; 1 for mixtures, whose fields hold their
    /// own.
    pub(super) fn scale(&self) -> f32 {
        match &self.content {
            Content::Plain(field) => field.scale,
            Content::Blocks(blocks) => blocks.stored.scale,
            Content::Mixed { .. } => 1.0,
        }
    }

    /// The bind group entries for passes.
    pub(super) fn entries<'a>(&'a self, sampler: &'a wgpu::Sampler) -> Vec<BindGroupEntry<'a>> {
        let mut entries = vec![
            entry(at::TRILINEAR, BindingResource::Sampler(sampler)),
            entry(at::OCCUPANCY, BindingResource::TextureView(&self.occupancy)),
        ];
        match &self.content {
            Content::Plain(field) => {
                entries.push(entry(at::VOXELS, BindingResource::TextureView(&field.view)));
            }
            Content::Blocks(GpuBlocks { stored, table }) => {
                entries.push(entry(at::VOXELS, BindingResource::TextureView(&stored.view)));
                entries.push(entry(at::BLOCKS, BindingResource::TextureView(table)));
            }
            Content::Mixed { fields, one_field, mixture, tables } => {
                entries.push(entry(at::MIXTURE, mixture.as_entire_binding()));
                entries.push(entry(at::TABLES, tables.as_entire_binding()));
                // Fields that no body uses are never read; the first field fills their bindings.
                let spare = &fields[0];
                for i in 0..if *one_field { 1 } else { MOST_FIELDS } {
                    let view = &fields.get(i).unwrap_or(spare).view;
                    entries.push(entry(at::FIELDS + i as u32, BindingResource::TextureView(view)));
                }
            }
        }
        entries
    }

    pub(super) fn upload(gpu: &Renderer, media: &Media) -> Result<Self> {
        let (device, queue) = (gpu.device(), gpu.queue());
        let content = match (Self::kind_of(device, media), media.plain()) {
            (MediaKind::Plain, Some(volume)) => {
                Content::Plain(GpuField::upload(device, queue, volume)?)
            }
            (_, Some(volume)) => Content::Blocks(GpuBlocks::upload(device, queue, volume)?),
            (_, None) => mixed(gpu, media)?,
        };
        let occupancy = codes(device, queue, media.occupancy())?;
        Ok(Self { content, occupancy })
    }
}

/// Whether a single volume is the only grid that is sampled; true also if there is none.
fn of_one_field(media: &Media) -> bool {
    let alone = |Body { medium, .. }: &Body| {
        let glows = medium.emission.as_ref().is_some_and(|emission| emission.field.is_some());
        medium.color.is_none() && medium.modulation.is_none() && !glows
    };
    media.bodies().len() < 2 && media.bodies().iter().all(alone)
}

/// The bricks' codes as a texture of integers.
fn codes(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    occupancy: &Occupancy,
) -> Result<wgpu::TextureView> {
    let [width, height, depth] = occupancy.dims().map(|n| n as u32);
    let limit = device.limits().max_texture_dimension_3d;
    if width.max(height).max(depth) > limit {
        let what = "bricks of a scene as one 3D texture".to_owned();
        let needed = format!("{width}x{height}x{depth}");
        return Err(ErrorKind::Limit { what, needed, limit: limit.to_string() }.into());
    }
    let size = [width, height, depth];
    let texture = texture(device, "occupancy", size, wgpu::TextureFormat::R8Uint);
    let of_layer = width as usize * height as usize;
    write_layers(queue, &texture, 1, |layers| {
        occupancy.codes()[layers.start * of_layer..layers.end * of_layer].to_vec()
    });
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

fn mixed(gpu: &Renderer, media: &Media) -> Result<Content> {
    let Mixture { parts, mut fields, volumes, tables, .. } = Mixture::of(media);
    for (what, count, most) in
        [("volumes", parts.len(), MOST_PARTS), ("grids", fields.len(), MOST_FIELDS)]
    {
        if count > most {
            let (needed, limit) = (count.to_string(), format!("{most} (the CPU backend has none)"));
            let what = format!("{what} of a scene on the GPU");
            return Err(ErrorKind::Limit { what, needed, limit }.into());
        }
    }
    // A grid that is used twice is uploaded once.
    let mut held: Vec<(*const Volume, GpuField)> = Vec::new();
    let mut uploaded = Vec::new();
    for (field, volume) in fields.iter_mut().zip(volumes) {
        let known = held.iter().find(|(known, _)| std::ptr::eq(*known, volume));
        let own = match known {
            Some((_, own)) => own.clone(),
            None => {
                let own = GpuField::upload(gpu.device(), gpu.queue(), volume)?;
                held.push((volume, own.clone()));
                own
            }
        };
        field.domain_min.w = own.scale;
        uploaded.push(own);
    }
    if uploaded.is_empty() {
        uploaded.push(GpuField::nothing(gpu.device()));
    }
    let mut uniform =
        MixtureUniform { counts: [parts.len() as u32, 0, 0, 0], ..Default::default() };
    uniform.parts[..parts.len()].copy_from_slice(&parts);
    uniform.fields[..fields.len()].copy_from_slice(&fields);
    let some = if tables.is_empty() { vec![glam::Vec4::ZERO] } else { tables };
    Ok(Content::Mixed {
        fields: uploaded,
        one_field: of_one_field(media),
        mixture: gpu.buffer("mixture", bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM),
        tables: gpu.buffer("tables", bytemuck::cast_slice(&some), wgpu::BufferUsages::STORAGE),
    })
}
