//! Bucky: C60, an electron-density-like sum of 60 atoms and 90 bonds over a faint shell.

use glam::DVec3;
use ndarray::{Array3, Axis};
use rayon::prelude::*;

const RADIUS: f64 = 0.72;
const ATOM_SIGMA: f64 = 0.075;
const BOND_SIGMA: f64 = 0.05;
const BOND_DENSITY: f64 = 0.55;
const SHELL_SIGMA: f64 = 0.18;
const SHELL_DENSITY: f64 = 0.05;

/// Gaussians at the atoms, the nearest bond's Gaussian along the bonds, scaled to a peak of 1.
pub(super) fn voxels(n: usize) -> Array3<f32> {
    let atoms = truncated_icosahedron().map(|p| p.normalize() * RADIUS);
    let bonds = bonds(&atoms);
    let density = |p: DVec3| {
        let atoms: f64 = atoms.iter().map(|a| gaussian((p - a).length(), ATOM_SIGMA)).sum();
        let nearest = bonds.iter().map(|&[a, b]| distance_to_segment(p, a, b));
        let bonds = BOND_DENSITY * gaussian(nearest.fold(f64::INFINITY, f64::min), BOND_SIGMA);
        let from_shell = (p.length() - RADIUS) / SHELL_SIGMA;
        atoms.max(bonds) + SHELL_DENSITY * (-from_shell * from_shell).exp()
    };
    let centre = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let mut values = Array3::zeros((n, n, n));
    let planes: Vec<_> = values.axis_iter_mut(Axis(0)).collect();
    planes.into_par_iter().enumerate().for_each(|(z, mut plane)| {
        for ((y, x), value) in plane.indexed_iter_mut() {
            *value = density(DVec3::new(centre(x), centre(y), centre(z)));
        }
    });
    let peak = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    values.mapv(|v| super::eight_bits(v / peak))
}

fn gaussian(distance: f64, sigma: f64) -> f64 {
    (-(distance * distance) / (2.0 * sigma * sigma)).exp()
}

fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    (p - a - along * (b - a)).length()
}

/// The 60 vertices: the cyclic permutations of three points with all combinations of signs, each
/// once.
fn truncated_icosahedron() -> [DVec3; 60] {
    let phi = f64::midpoint(1.0, 5.0_f64.sqrt());
    // The first point contains a zero, so half of its sign combinations are duplicates; 3 x (4 + 8
    // + 8) = 60.
    let with_zero = signed([0.0, 1.0, 3.0 * phi]).into_iter().step_by(2);
    let others = [[1.0, 2.0 + phi, 2.0 * phi], [phi, 2.0, 2.0 * phi + 1.0]];
    let mut points = with_zero
        .chain(others.into_iter().flat_map(signed))
        .flat_map(|[x, y, z]| [[x, y, z], [y, z, x], [z, x, y]]);
    std::array::from_fn(|_| DVec3::from_array(points.next().unwrap_or_default()))
}

fn signed(p: [f64; 3]) -> [[f64; 3]; 8] {
    std::array::from_fn(|i| {
        std::array::from_fn(|axis| if i >> axis & 1 == 0 { p[axis] } else { -p[axis] })
    })
}

/// Pairs of atoms at the distance of one edge: 90 of them.
fn bonds(atoms: &[DVec3; 60]) -> Vec<[DVec3; 2]> {
    let pairs: Vec<[DVec3; 2]> = (0..atoms.len())
        .flat_map(|i| (0..i).map(move |j| [i, j]))
        .map(|[i, j]| [atoms[i], atoms[j]])
        .collect();
    let length = |[a, b]: &[DVec3; 2]| (a - b).length();
    let edge = pairs.iter().map(length).fold(f64::INFINITY, f64::min);
    pairs.into_iter().filter(|pair| length(pair) < edge * 1.1).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn c60_has_sixty_distinct_atoms_and_ninety_bonds() {
        let atoms = super::truncated_icosahedron().map(glam::DVec3::normalize);
        for (i, a) in atoms.iter().enumerate() {
            assert!(atoms[..i].iter().all(|b| (a - b).length() > 0.1), "atom {i} stands twice");
        }
        assert_eq!(super::bonds(&atoms).len(), 90);
    }
}
