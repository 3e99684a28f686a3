//! A seeded cloud of any resolution: fractal value noise inside a sphere, in a cube of edge 1.

use deepshadow::volume::Volume;
use glam::{DMat4, DVec3};
use ndarray::Array3;
use rayon::prelude::*;

const OCTAVES: usize = 5;
/// Cells of the coarsest noise along an edge; each octave has twice as many.
const COARSEST: usize = 4;
/// Amplitude of an octave relative to the one before.
const PERSISTENCE: f32 = 0.55;
/// Radius of the sphere.
const RADIUS: f32 = 0.48;
/// Optical depth along the central lines.
const OPTICAL_DEPTH: f64 = 8.0;

/// Random values on a lattice, interpolated between its points.
struct Octave {
    /// Points along an edge.
    points: usize,
    amplitude: f32,
    values: Vec<f32>,
    /// For each voxel along an edge, the lattice point in front of it, and the weight of the one
    /// behind.
    places: Vec<(usize, f32)>,
}

impl Octave {
    fn new(index: usize, voxels: usize) -> Self {
        let cells = COARSEST << index;
        let points = cells + 1;
        let values = (0..points.pow(3)).map(|i| random((index * 100_000_000 + i) as u64)).collect();
        let places = (0..voxels).map(|i| {
            let x = coordinate(i, voxels) * cells as f32;
            let cell = (x as usize).min(cells - 1);
            let f = x - cell as f32;
            (cell, f * f * f * (f * (6.0 * f - 15.0) + 10.0))
        });
        Self { points, amplitude: PERSISTENCE.powi(index as i32), values, places: places.collect() }
    }

    /// Interpolates the lattice between two of its planes or rows.
    fn blended(lattice: &[f32], length: usize, (before, weight): (usize, f32)) -> Vec<f32> {
        let near = &lattice[before * length..][..length];
        let far = &lattice[(before + 1) * length..][..length];
        near.iter().zip(far).map(|(a, b)| a + (b - a) * weight).collect()
    }
}

/// The cloud of `n` cubed voxels, and the density scale that gives its central lines, on average,
/// the optical depth above.
pub fn cloud(n: usize) -> (Volume, f64) {
    let octaves: Vec<Octave> = (0..OCTAVES).map(|index| Octave::new(index, n)).collect();
    let mut values = vec![0.0_f32; n.pow(3)];
    values.par_chunks_mut(n * n).enumerate().for_each(|(z, slice)| fill(slice, z, n, &octaves));
    let at = |x: usize, y: usize, z: usize| f64::from(values[(z * n + y) * n + x]);
    let h = n / 2;
    let sum: f64 = (0..n).map(|i| at(i, h, h) + at(h, i, h) + at(h, h, i)).sum();
    let scale = OPTICAL_DEPTH / (sum / (3 * n) as f64);
    let edge = 1.0 / n as f64;
    let place = DMat4::from_translation(DVec3::splat(0.5 * edge - 0.5))
        * DMat4::from_scale(DVec3::splat(edge));
    let values = Array3::from_shape_vec((n, n, n), values).unwrap();
    (Volume::new(format!("cloud {n}"), values, place).unwrap(), scale)
}

/// Fills one slice of constant z. Lattices are interpolated along z, then y, then x.
fn fill(slice: &mut [f32], z: usize, n: usize, octaves: &[Octave]) {
    let total: f32 = octaves.iter().map(|octave| octave.amplitude).sum();
    let planes: Vec<Vec<f32>> = octaves
        .iter()
        .map(|octave| Octave::blended(&octave.values, octave.points.pow(2), octave.places[z]))
        .collect();
    let mut noise = vec![0.0_f32; n];
    for (y, row) in slice.chunks_exact_mut(n).enumerate() {
        noise.fill(0.0);
        for (octave, plane) in octaves.iter().zip(&planes) {
            let line = Octave::blended(plane, octave.points, octave.places[y]);
            for (sum, &(before, weight)) in noise.iter_mut().zip(&octave.places) {
                let value = line[before] + (line[before + 1] - line[before]) * weight;
                *sum += octave.amplitude / total * value;
            }
        }
        let [dy, dz] = [y, z].map(|i| coordinate(i, n) - 0.5);
        for (x, (value, noise)) in row.iter_mut().zip(&noise).enumerate() {
            let dx = coordinate(x, n) - 0.5;
            *value = density((dx * dx + dy * dy + dz * dz).sqrt() / RADIUS, *noise);
        }
    }
}

/// Density at a distance from the sphere's centre, as a share of its radius.
fn density(r: f32, noise: f32) -> f32 {
    if r >= 1.0 {
        return 0.0;
    }
    let s = 1.35 * (1.0 - r.powf(1.6)) + 2.3 * noise - 0.45;
    let d = (s / 0.7).clamp(0.0, 1.0);
    let d = d * d * (3.0 - 2.0 * d) * ((1.0 - r) / 0.08).min(1.0);
    if d < 1e-3 { 0.0 } else { d }
}

/// Centre of a voxel, 0..1.
fn coordinate(i: usize, n: usize) -> f32 {
    (i as f32 + 0.5) / n as f32
}

/// A number in -1..1 from a seed (SplitMix64).
fn random(seed: u64) -> f32 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x0bad_5eed);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
}
