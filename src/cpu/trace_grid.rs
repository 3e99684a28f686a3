//! Pass `trace_grid`: marches from the centre of every cell of a grid to the light.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::tiles::finished;
use crate::error::Result;
use crate::frame::Frame;
use crate::kernel::light::{light_coordinates, light_extent, light_ray};
use crate::kernel::media::Sampler;
use crate::kernel::slices::{ray_optical_depth, samples_over};
use crate::progress::Progress;
use crate::scene::Media;
use crate::shadow::grid_point;

/// Transmittance at the centres of all cells, times 255, x fastest.
pub(super) fn trace_grid(
    media: &Media,
    frame: &Frame,
    shape: [usize; 3],
    progress: &dyn Progress,
) -> Result<Vec<u8>> {
    let [nx, ny, nz] = shape;
    progress.begin("shadow grid", (ny * nz) as u64);
    let sampler = Sampler::of_extinction(media);
    let columns = frame.media.index_from_frame;
    let linear =
        Mat3::from_cols_array_2d(&columns.map(|row| row.truncate().to_array())).transpose();
    let (frame_from_index, offset) = (linear.inverse(), Vec3::from_array(columns.map(|row| row.w)));
    let mut values = vec![0; nx * ny * nz];
    values.par_chunks_exact_mut(nx).enumerate().for_each(|(row, values)| {
        if progress.cancelled() {
            return;
        }
        for (x, value) in values.iter_mut().enumerate() {
            let index = grid_point(frame, shape, [x, row % ny, row / ny]);
            let light = light_coordinates(frame, frame_from_index * (index - offset));
            let (enter, exit) = light_extent(frame, light.x, light.y);
            let ray = light_ray(frame, light.x, light.y).transformed(&frame.media.index_from_frame);
            let way = [enter, light.z.max(enter)];
            let samples = samples_over(frame, &ray, way[1] - way[0], exit - enter);
            let optical_depth = ray_optical_depth(&sampler, frame, &ray, way, samples);
            *value = ((-optical_depth).exp() * 255.0).round() as u8;
        }
        progress.advance(1);
    });
    finished(progress).map(|()| values)
}
