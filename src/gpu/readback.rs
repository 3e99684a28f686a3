//! Submits work to a device, and reads results back to the host.

use bytemuck::Pod;

use super::bindings::SCREEN;
use super::renderer::{GpuImage, Renderer};
use super::waiting::{Heard, word};
use crate::error::memory;
use crate::error::{Error, Result};
use crate::image::Tone;

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
    pub async fn submit_async(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<()> {
        let sent = self.send(record);
        self.scopes.settled().await?;
        if let Some(finished) = sent? {
            finished.await;
        }
        Ok(())
    }

    /// Records commands and submits them. The result is as of [`Renderer::finished`].
    fn send(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<Option<Heard<()>>> {
        self.scopes.scoped(Error::gpu, || {
            let mut encoder =
                self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            record(&mut encoder)?;
            self.queue().submit([encoder.finish()]);
            self.finished()
        })?
    }

    /// Waits for everything that was submitted; in a browser, gives what is ready when it is done.
    fn finished(&self) -> Result<Option<Heard<()>>> {
        if cfg!(target_family = "wasm") {
            let (word, heard) = word();
            self.queue().on_submitted_work_done(move || word.give(()));
            return Ok(Some(heard));
        }
        self.poll()?;
        Ok(None)
    }

    /// Waits for everything that was submitted, and for its callbacks. Browsers call them when the
    /// program has returned to them.
    fn poll(&self) -> Result<()> {
        // wgpu 30 panics here if a driver has lost its device.
        let poll = || self.device().poll(wgpu::PollType::wait_indefinitely());
        match std::panic::catch_unwind(std::panic::AssertUnwindSafe(poll)) {
            Ok(waited) => waited.map(|_| ()).map_err(|error| Error::gpu(error.to_string())),
            Err(_) => Err(Error::gpu("the device is lost")),
        }
    }

    /// Reads a map or a picture back to the host, row by row, row 0 on top.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub async fn read_async(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>> {
        Ok(self.read_with(texture, &[]).await?.0)
    }

    /// Like [`Renderer::read_async`]; also reads, in the same transfer, the first number of each
    /// counter.
    ///
    /// # Errors
    /// As [`Renderer::read_async`].
    pub(super) async fn read_with(
        &self,
        texture: &wgpu::Texture,
        counters: &[wgpu::Buffer],
    ) -> Result<(Vec<[f32; 4]>, Vec<u32>)> {
        self.read_after(|_| Ok(()), texture, counters).await
    }

    /// What a screen shows of a picture ([`Renderer::show_image`]): red, green, blue and straight
    /// alpha of each pixel, sRGB-encoded, row by row, row 0 on top.
    ///
    /// # Errors
    /// If the device fails, or if there is not enough memory.
    pub async fn shown_async(&self, image: &GpuImage, tone: Tone) -> Result<Vec<u8>> {
        let [width, height] = image.size();
        let screen = self.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("screen"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SCREEN,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = screen.create_view(&wgpu::TextureViewDescriptor::default());
        let show =
            |encoder: &mut wgpu::CommandEncoder| self.show_image(encoder, image, tone, &view);
        let (pixels, _) = self.read_after::<[u8; 4]>(show, &screen, &[]).await?;
        Ok(pixels.into_flattened())
    }

    /// Records commands with `before`, submits them, and reads the texels of a texture and the
    /// first number of each counter.
    async fn read_after<T: Pod>(
        &self,
        before: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
        texture: &wgpu::Texture,
        counters: &[wgpu::Buffer],
    ) -> Result<(Vec<T>, Vec<u32>)> {
        self.count_readback();
        let size = texture.size();
        let row = size.width * size_of::<T>() as u32;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let rows = (BYTES_AT_ONCE / u64::from(padded)).clamp(1, size.height.into()) as u32;
        let texels = size.width as usize * size.height as usize;
        let mut all = memory::room(texels, "the results of the GPU")?;
        let mut counts = Vec::new();
        // Counters are stored behind the rows.
        let behind = u64::from(padded) * u64::from(rows);
        let buffer = self.readback(behind + counters.len() as u64 * COUNTER_BYTES);
        let mut before = Some(before);
        for first in (0..size.height).step_by(rows as usize) {
            let count = rows.min(size.height - first);
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: Some(count),
            };
            let copy = |encoder: &mut wgpu::CommandEncoder| {
                before.take().map_or(Ok(()), |before| before(encoder))?;
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
            };
            let bytes = self.filled_by(&buffer, copy).await?;
            for padded_row in bytes.chunks_exact(padded as usize).take(count as usize) {
                let texels = padded_row[..row as usize].chunks_exact(size_of::<T>());
                all.extend(texels.map(bytemuck::pod_read_unaligned::<T>));
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
    pub(super) async fn read_buffer<T: Pod>(
        &self,
        source: &wgpu::Buffer,
        bytes: u64,
    ) -> Result<Vec<T>> {
        self.count_readback();
        let mut all = memory::room(bytes as usize / size_of::<T>(), "the results of the GPU")?;
        let buffer = self.readback(bytes.min(BYTES_AT_ONCE));
        for first in (0..bytes).step_by(BYTES_AT_ONCE as usize) {
            let count = BYTES_AT_ONCE.min(bytes - first);
            let copy = |encoder: &mut wgpu::CommandEncoder| {
                encoder.copy_buffer_to_buffer(source, first, &buffer, 0, count);
                Ok(())
            };
            let mapped = self.filled_by(&buffer, copy).await?;
            let items = mapped[..count as usize].chunks_exact(size_of::<T>());
            all.extend(items.map(bytemuck::pod_read_unaligned::<T>));
            drop(mapped);
            buffer.unmap();
        }
        Ok(all)
    }

    /// The first number of each counter.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) async fn first_numbers(&self, counters: &[wgpu::Buffer]) -> Result<Vec<u32>> {
        let mut numbers = Vec::new();
        for counter in counters {
            numbers.extend(self.read_buffer::<u32>(counter, 4).await?);
        }
        Ok(numbers)
    }

    fn readback(&self, size: u64) -> wgpu::Buffer {
        self.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The bytes of a buffer that recorded commands fill.
    async fn filled_by(
        &self,
        buffer: &wgpu::Buffer,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<wgpu::BufferView> {
        // A mapped buffer is filled, so a browser need not tell that the device has finished.
        let asked = self.send(record).and_then(|_| self.mapped(buffer));
        self.scopes.settled().await?;
        let failed = |why: String| Error::gpu(format!("readback: {why}"));
        asked?
            .await
            .ok_or_else(|| failed("nobody tells that the buffer is mapped".to_owned()))?
            .map_err(|error| failed(error.to_string()))?;
        buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))
    }

    /// Maps a buffer.
    fn mapped(&self, buffer: &wgpu::Buffer) -> Result<Heard<Result<(), wgpu::BufferAsyncError>>> {
        let (word, heard) = word();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| word.give(result));
        self.poll()?;
        Ok(heard)
    }
}
