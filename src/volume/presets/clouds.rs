//! Clouds: spectral noise with a vertical profile, which forms a layer with gaps. Index z is up.

use ndarray::{Array3, Axis};
use rayon::prelude::*;

use super::fourier::{Fourier, RealFourier, Wave};
use super::numpy_random::StandardNormal;

/// The exponent with which amplitude falls over the wave number.
const SLOPE: f64 = -11.0 / 6.0 - 0.25;
/// Waves with fewer cycles over the layer's width have amplitude zero.
const LOWEST_CYCLES: f64 = 3.0;

/// `n` x `n` x `nz` voxels from the noise of `seed`.
pub(super) fn voxels(n: usize, nz: usize, seed: u32) -> Array3<f32> {
    let noise = filtered_noise(n, nz, seed);
    let count = noise.len() as f64;
    let mean = noise.par_iter().map(|&v| f64::from(v)).sum::<f64>() / count;
    let variance = noise.par_iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / count;
    let profile: Vec<f64> = (0..nz)
        .map(|z| {
            let height = (z as f64 + 0.5) / nz as f64;
            0.9 * (1.0 - (2.0 * height - 0.9).powi(2) * 1.4) - 0.55
        })
        .collect();
    let gain = 0.35 / variance.sqrt();
    let mut values = Array3::zeros((nz, n, n));
    let bands: Vec<_> = values.axis_chunks_iter_mut(Axis(1), 16).collect();
    bands.into_par_iter().enumerate().for_each(|(band, mut rows)| {
        for (y, mut row) in rows.axis_iter_mut(Axis(1)).enumerate() {
            for (x, mut column) in row.axis_iter_mut(Axis(1)).enumerate() {
                let noise = &noise[(x * n + 16 * band + y) * nz..][..nz];
                for ((value, &noise), profile) in column.iter_mut().zip(noise).zip(&profile) {
                    *value = super::eight_bits(gain * f64::from(noise) + profile);
                }
            }
        }
    });
    values
}

/// White noise of `n` x `n` x `4 nz` (z fastest), filtered in the frequency domain; only the first
/// `nz` layers are kept.
fn filtered_noise(n: usize, nz: usize, seed: u32) -> Vec<f32> {
    let depth = nz * 4;
    let mut normals = StandardNormal::seeded(seed);
    let mut noise: Vec<f32> =
        std::iter::repeat_with(|| normals.next()).take(n * n * depth).collect();

    let (along_z, along) = (RealFourier::of(depth), Fourier::of(n));
    let waves = depth / 2 + 1;

    // For each x: along z, then along y; kept as [x][kz][y].
    let mut by_x = vec![Wave::default(); n * waves * n];
    by_x.par_chunks_exact_mut(waves * n).zip(noise.par_chunks_exact_mut(n * depth)).for_each(
        |(plane, rows)| {
            let mut row_waves = vec![Wave::default(); waves];
            for (y, row) in rows.chunks_exact_mut(depth).enumerate() {
                along_z.forward(row, &mut row_waves);
                for (kz, wave) in row_waves.iter().enumerate() {
                    plane[kz * n + y] = *wave;
                }
            }
            along.forward(plane);
        },
    );
    // For each kz: along x, the filter, back along x and y; kept as [kz][x][y].
    let mut by_kz = vec![Wave::default(); waves * n * n];
    by_kz.par_chunks_exact_mut(n * n).enumerate().for_each(|(kz, plane)| {
        for x in 0..n {
            for (y, wave) in by_x[(x * waves + kz) * n..][..n].iter().enumerate() {
                plane[y * n + x] = *wave;
            }
        }
        along.forward(plane);
        let amplitudes = amplitudes(n, kz as f64 / depth as f64);
        for (wave, amplitude) in plane.iter_mut().zip(amplitudes) {
            *wave *= amplitude;
        }
        along.back(plane);
        transpose(plane, n);
        along.back(plane);
    });
    drop(by_x);
    // For each x: back along z, keeping the first layers; stored as [x][y][z].
    let mut field = vec![0.0; n * n * nz];
    field.par_chunks_exact_mut(n * nz).enumerate().for_each(|(x, plane)| {
        let mut columns = vec![Wave::default(); n * waves];
        for kz in 0..waves {
            for (y, wave) in by_kz[(kz * n + x) * n..][..n].iter().enumerate() {
                columns[y * waves + kz] = *wave;
            }
        }
        let mut layers = vec![0.0; depth];
        for (waves, kept) in columns.chunks_exact_mut(waves).zip(plane.chunks_exact_mut(nz)) {
            // The ends of a real signal's spectrum are real; rounding leaves small imaginary parts.
            waves[0].im = 0.0;
            if let Some(last) = waves.last_mut() {
                last.im = 0.0;
            }
            along_z.back(waves, &mut layers);
            kept.copy_from_slice(&layers[..nz]);
        }
    });
    field
}

/// Cycles per voxel of the wave with index `i` of `n`.
fn frequency(i: usize, n: usize) -> f64 {
    let i = i as f64;
    let n = n as f64;
    (if i < n / 2.0 { i } else { i - n }) / n
}

/// The amplitudes of `n` x `n` waves with `z` cycles per voxel along z. A wave has that of the waves
/// that run the other way or with x and y exchanged, so an eighth of them is computed.
fn amplitudes(n: usize, z: f64) -> Vec<f32> {
    let mut all = vec![0.0; n * n];
    let mirrored = |i: usize| (n - i) % n;
    for y in 0..=n / 2 {
        for x in 0..=y {
            let amplitude = amplitude([frequency(x, n), frequency(y, n), z], n);
            for (x, y) in [(x, y), (y, x)] {
                for (x, y) in
                    [(x, y), (mirrored(x), y), (x, mirrored(y)), (mirrored(x), mirrored(y))]
                {
                    all[y * n + x] = amplitude;
                }
            }
        }
    }
    all
}

fn amplitude(cycles: [f64; 3], n: usize) -> f32 {
    let k2: f64 = cycles.iter().map(|c| c * c).sum();
    if k2.sqrt() * (n as f64) < LOWEST_CYCLES { 0.0 } else { k2.powf(SLOPE / 2.0) as f32 }
}

fn transpose(plane: &mut [Wave], n: usize) {
    for y in 0..n {
        for x in 0..y {
            plane.swap(y * n + x, x * n + y);
        }
    }
}
