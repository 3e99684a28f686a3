//! Where the rays of a pixel go through it, and which of its cells each stands for.

use glam::Vec2;

/// Cells along each edge of a texel or a pixel, which a strand covers or not.
pub const CELLS: u32 = 8;

/// Position of sample `i` of `samples` within its pixel, 0..1 along both axes: the centre for one
/// sample, else points of the golden-ratio lattice, which cover the pixel evenly for any number.
pub fn pixel_offset(i: u32, samples: u32) -> Vec2 {
    if samples == 1 {
        return Vec2::splat(0.5);
    }
    let golden = (i as f32 * 0.618_034 + 0.5).fract();
    Vec2::new((i as f32 + 0.5) / samples as f32, golden)
}

/// The cells of a pixel that each of its rays stands for: those to which it is the nearest, or the one
/// that it goes through.
pub fn cells_around(rays: u32) -> Vec<u64> {
    let offsets: Vec<Vec2> = (0..rays).map(|ray| pixel_offset(ray, rays)).collect();
    let mut groups = vec![0_u64; offsets.len()];
    for (x, y) in (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y))) {
        let middle = (Vec2::new(x as f32, y as f32) + 0.5) / CELLS as f32;
        let distances = offsets.iter().map(|offset| offset.distance_squared(middle));
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        groups[nearest.map_or(0, |(ray, _)| ray)] |= 1 << (CELLS * y + x);
    }
    for (group, offset) in groups.iter_mut().zip(&offsets).filter(|(group, _)| **group == 0) {
        let [x, y] = (*offset * CELLS as f32).to_array().map(|c| (c as u32).min(CELLS - 1));
        *group = 1 << (CELLS * y + x);
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every cell belongs to one ray, unless there are more rays than that; and every ray has one.
    #[test]
    fn rays_share_the_cells_of_a_pixel() {
        for rays in [1, 2, 5, 8, 16, 33, 64, 256] {
            let groups = cells_around(rays);
            assert!(groups.len() == rays as usize && groups.iter().all(|&group| group != 0));
            assert_eq!(groups.iter().fold(0, |all, group| all | group), u64::MAX);
            let most = groups.iter().map(|group| group.count_ones()).max().unwrap_or(0);
            assert!(most <= 2 * (64 / rays).max(1) + 1, "{rays}: {most}");
            if rays <= 16 {
                assert_eq!(groups.iter().map(|group| group.count_ones()).sum::<u32>(), 64);
            }
        }
    }
}
