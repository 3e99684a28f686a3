//! Work handed to a device and waited for, and results brought to the host.

use bytemuck::Pod;

use super::renderer::{Renderer, TEXEL_BYTES};
use crate::error::{Error, Result};

impl Renderer {
    /// Records with `record`, submits, and waits for the device to finish.
    ///
    /// # Errors
    /// What the device finds wrong with the work, or that it was lost.
    pub fn submit(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<()> {
        let memory = self.device().push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device().push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder =
            self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(&mut encoder);
        self.queue().submit([encoder.finish()]);
        let waited = self.device().poll(wgpu::PollType::wait_indefinitely());
        let found = [pollster::block_on(validation.pop()), pollster::block_on(memory.pop())];
        if let Some(error) = found.into_iter().flatten().next() {
            return Err(Error::gpu(error.to_string()));
        }
        waited.map(|_| ()).map_err(|error| Error::gpu(error.to_string()))
    }

    /// Copies a map or a picture to the host, row by row.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>> {
        let size = texture.size();
        let row = size.width * TEXEL_BYTES;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.readback(u64::from(padded) * u64::from(size.height));
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(padded),
            rows_per_image: Some(size.height),
        };
        self.submit(|encoder| {
            let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
        })?;
        let bytes = self.mapped(&buffer)?;
        let rows = bytes.chunks_exact(padded as usize);
        Ok(rows
            .flat_map(|r| bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&r[..row as usize]))
            .collect())
    }

    /// Copies the first `bytes` of a storage buffer to the host.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) fn read_buffer<T: Pod>(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<T>> {
        let buffer = self.readback(bytes);
        self.submit(|encoder| encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, bytes))?;
        Ok(bytemuck::pod_collect_to_vec(&self.mapped(&buffer)?))
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
            // Nobody listens only if the caller is gone.
            let _ = sender.send(result);
        });
        let failed = |why: String| Error::gpu(format!("readback: {why}"));
        self.device()
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| failed(error.to_string()))?;
        receiver
            .recv()
            .map_err(|error| failed(error.to_string()))?
            .map_err(|error| failed(error.to_string()))?;
        buffer.get_mapped_range(..).map_err(|error| failed(error.to_string()))
    }
}
