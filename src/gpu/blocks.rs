//! A volume as blocks, side by side in one 3D texture, with a table of their positions: for sparse
//! volumes, and for those that exceed the size of a texture.

use rayon::prelude::*;
use wgpu::TextureFormat;

use super::field::{Encoding, GpuField, limit_error, longer, texture, write_layers};
use crate::error::Result;
use crate::volume::{BLOCK_EDGE, BLOCK_VALUES, SparseVoxels, Volume, place_of};

/// The table's entry for an empty block, which is not stored.
pub const NO_BLOCK: u32 = u32::MAX;
/// The largest number of blocks along an axis of the texture; the table has ten bits for each.
const MOST_ALONG: usize = 1 << 10;

/// Blocks of a volume on a device.
#[derive(Clone, Debug)]
pub(super) struct GpuBlocks {
    /// The stored blocks.
    pub(super) stored: GpuField,
    /// A texture with the position of each block among them.
    pub(super) table: wgpu::TextureView,
}

impl GpuBlocks {
    pub(super) fn upload(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        volume: &Volume,
    ) -> Result<Self> {
        let voxels = volume.voxels().to_sparse();
        let limit = device.limits().max_texture_dimension_3d;
        let blocks = voxels.blocks();
        if let Some(long) = longer(blocks, limit) {
            let what = format!("{long} blocks along an axis");
            return Err(limit_error(volume, what, limit.to_string()));
        }
        let held = held(&voxels);
        let most = (limit as usize / BLOCK_EDGE).min(MOST_ALONG);
        let Some(slots) = arranged(held.len(), most) else {
            let what = format!("{} blocks in one 3D texture", held.len());
            return Err(limit_error(volume, what, format!("{}", most * most * most)));
        };
        let table = table(&voxels, &held, slots);
        let size = blocks.map(|n| n as u32);
        let places = texture(device, "blocks", size, TextureFormat::R32Uint);
        write_layers(queue, &places, 4, |layers| {
            let of_layer = blocks[0] * blocks[1];
            bytemuck::cast_slice(&table[layers.start * of_layer..layers.end * of_layer]).to_vec()
        });
        let encoding = Encoding::of(volume, device);
        let size = slots.map(|n| (n * BLOCK_EDGE) as u32);
        let stored = texture(device, "volume", size, encoding.format);
        write_layers(queue, &stored, encoding.texel_bytes(), |layers| {
            let planes = layers.into_par_iter();
            let planes = planes.map(|z| encoding.bytes(&plane(&voxels, &held, slots, z)));
            planes.collect::<Vec<_>>().concat()
        });
        Ok(Self {
            stored: GpuField::new(&stored, &encoding),
            table: places.create_view(&wgpu::TextureViewDescriptor::default()),
        })
    }
}

/// Indices of the stored blocks that are not zero everywhere.
fn held(voxels: &SparseVoxels) -> Vec<u32> {
    let blocks = voxels.uniform().into_iter().enumerate();
    blocks.filter(|(_, uniform)| *uniform != Some(0.0)).map(|(stored, _)| stored as u32).collect()
}

/// How many blocks lie along each axis of a texture for `count` blocks, at most `most`; `None` if
/// there is not enough room.
fn arranged(count: usize, most: usize) -> Option<[usize; 3]> {
    let x = ((count as f64).cbrt().ceil() as usize).clamp(1, most);
    let y = ((count as f64 / x as f64).sqrt().ceil() as usize).clamp(1, most);
    let z = count.div_ceil(x * y).max(1);
    (z <= most).then_some([x, y, z])
}

fn table(voxels: &SparseVoxels, held: &[u32], slots: [usize; 3]) -> Vec<u32> {
    let stored = voxels.values().len() / BLOCK_VALUES;
    let mut places = vec![NO_BLOCK; stored];
    for (i, &stored) in held.iter().enumerate() {
        let [x, y, z] = place_of(i, slots);
        places[stored as usize] = (x | (y << 10) | (z << 20)) as u32;
    }
    voxels.table().iter().map(|&stored| places[stored as usize]).collect()
}

/// One layer of texels through the stored blocks side by side.
fn plane(voxels: &SparseVoxels, held: &[u32], [nx, ny, _]: [usize; 3], z: usize) -> Vec<f32> {
    let width = nx * BLOCK_EDGE;
    let mut texels = vec![0.0; width * ny * BLOCK_EDGE];
    let first = z / BLOCK_EDGE * nx * ny;
    let layer = held[first..].iter().take(nx * ny);
    for (i, &stored) in layer.enumerate() {
        let block = &voxels.values()[stored as usize * BLOCK_VALUES..][..BLOCK_VALUES];
        let rows = &block[z % BLOCK_EDGE * BLOCK_EDGE * BLOCK_EDGE..];
        let corner = i / nx * BLOCK_EDGE * width + i % nx * BLOCK_EDGE;
        for (y, row) in rows.chunks_exact(BLOCK_EDGE).take(BLOCK_EDGE).enumerate() {
            texels[corner + y * width..][..BLOCK_EDGE].copy_from_slice(row);
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn blocks_find_room_up_to_the_last() {
        for count in [0, 1, 2, 7, 8, 9, 26, 27, 28, 999, 1000] {
            let [x, y, z] = arranged(count, 10).unwrap();
            assert!(x.max(y).max(z) <= 10 && x * y * z >= count, "{count}");
        }
        assert_eq!(arranged(1001, 10), None);
    }
}
