//! Submits work to a device, waits for it, and reads results back to the host.

use std::panic::{AssertUnwindSafe, catch_unwind};

use bytemuck::Pod;

use super::renderer::{Renderer, TEXEL_BYTES};
use crate::error::memory;
use crate::error::{Error, Result};

/// Number of bytes that are read back at a time, so that no buffer exceeds the device's limits; a
/// multiple of every item's size.
const BYTES_AT_ONCE: u64 = 64 << 20;
/// Size in bytes of a pass's counter.
const COUNTER_BYTES: u64 = 8;

impl Renderer {
    /// Records commands with `record`, submits them, and waits for the device to finish.
    ///
    /// # Errors
    /// Those of `record`. If the device finds the commands invalid or is lost.
    pub fn submit(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<()> {
        let done = self.scoped(|| {
            let mut encoder =
                self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            record(&mut encoder)?;
            self.queue().submit([encoder.finish()]);
            self.wait()
        });
        done.map_err(Error::gpu)?
    }

    /// Waits for everything that was submitted.
    fn wait(&self) -> Result<()> {
        // wgpu 30 panics here if a driver has lost its device.
        let poll = || self.device().poll(wgpu::PollType::wait_indefinitely());
        match catch_unwind(AssertUnwindSafe(poll)) {
            Ok(waited) => waited.map(|_| ()).map_err(|error| Error::gpu(error.to_string())),
            Err(_) => Err(Error::gpu("the device is lost")),
        }
    }

    /// Reads a map or a picture back to the host, row by row, row 0 on top.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>> {
        Ok(self.read_with(texture, &[])?.0)
    }

    /// Like [`Renderer::read`]; also reads, in the same transfer, the first number of each counter.
    ///
    /// # Errors
    /// As [`Renderer::read`].
    pub(super) fn read_with(
        &self,
        texture: &wgpu::Texture,
        counters: &[wgpu::Buffer],
    ) -> Result<(Vec<[f32; 4]>, Vec<u32>)> {
        self.count_readback();
        let size = texture.size();
        let row = size.width * TEXEL_BYTES;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let rows = (BYTES_AT_ONCE / u64::from(padded)).clamp(1, size.height.into()) as u32;
        let texels = size.width as usize * size.height as usize;
        let mut all = memory::room(texels, "the results of the GPU")?;
        let mut counts = Vec::new();
        // Counters are stored behind the rows.
        let behind = u64::from(padded) * u64::from(rows);
        let buffer = self.readback(behind + counters.len() as u64 * COUNTER_BYTES);
        for first in (0..size.height).step_by(rows as usize) {
            let count = rows.min(size.height - first);
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: Some(count),
            };
            self.submit(|encoder| {
                let mut from = texture.as_image_copy();
                from.origin.y = first;
                let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
                let part = wgpu::Extent3d { height: count, ..size };
                encoder.copy_texture_to_buffer(from, target, part);
                for (i, counter) in (0..).zip(counters) {
                    let to = behind + i * COUNTER_BYTES;
                    encoder.copy_buffer_to_buffer(counter, 0, &buffer, to, COUNTER_BYTES);
                }
                Ok(())
            })?;
            let bytes = self.mapped(&buffer)?;
            for padded_row in bytes.chunks_exact(padded as usize).take(count as usize) {
                let texels = padded_row[..row as usize].chunks_exact(TEXEL_BYTES as usize);
                all.extend(texels.map(bytemuck::pod_read_unaligned::<[f32; 4]>));
            }
            counts = bytes[behind as usize..]
                .chunks_exact(COUNTER_BYTES as usize)
                .map(|counter| bytemuck::pod_read_unaligned(&counter[..4]))
                .collect();
            drop(bytes);
            buffer.unmap();
        }
        Ok((all, counts))
    }

    /// Reads the first `bytes` bytes of a storage buffer back to the host.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub(super) fn read_buffer<T: Pod>(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<T>> {
        self.count_readback();
        let mut all = memory::room(bytes as usize / size_of::<T>(), "the results of the GPU")?;
        let buffer = self.readback(bytes.min(BYTES_AT_ONCE));
        for first in (0..bytes).step_by(BYTES_AT_ONCE as usize) {
            let count = BYTES_AT_ONCE.min(bytes - first);
            self.submit(|encoder| {
                encoder.copy_buffer_to_buffer(source, first, &buffer, 0, count);
                Ok(())
            })?;
            let mapped = self.mapped(&buffer)?;
            let items = mapped[..count as usize].chunks_exact(size_of::<T>());
            all.extend(items.map(bytemuck::pod_read_unaligned::<T>));
            drop(mapped);
            buffer.unmap();
        }
        Ok(all)
    }

    fn readback(&self, size: u64) -> wgpu::Buffer {
        self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The bytes of a buffer that the device has filled.
    fn mapped(&self, buffer: &wgpu::Buffer) -> Result<wgpu::BufferView> {
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Sending fails only if the caller is gone.
            let _ = sender.send(result);
        });
        let failed = |why: String| Error::gpu(format!("readback: {why}"));
        self.wait()?;
        receiver
            .recv()
            .map_err(|error| failed(error.to_string()))?
            .map_err(|error| failed(error.to_string()))?;
        buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))
    }
}
