//! Pass `refine_view`: pictures from fewer rays: pixels are marched on a coarse lattice first, and then where the
//! picture bends (Levoy 1990, "Volume rendering by adaptive refinement", whose lattice is halved
//! where it changes). Pixels that have several rays get all of them only there. Knows no ray:
//! pixels come from a function.
//!
//! Between four lattice points the picture is a cubic. Where the second differences of the lattice
//! say that a line would be wrong by more than the tolerance, which is more than the cubic is, the
//! points around are computed. If one of them turns out to differ from its cubic, so are those next
//! to it, until none does: edges that begin between lattice points are followed.

use glam::Vec4;

use crate::image::{BRIGHT, Image, lit_percentile};
use crate::math::Each;
use crate::parallel;
use crate::progress::{Progress, Uncounted};

/// Edge length, in lattice points, of the parts of a picture that a thread computes: neighbours
/// read the same voxels.
const PART: usize = 16;
/// Pixels that a thread computes where edges are followed.
const FOLLOWED: usize = 16;
/// A computed point that differs from its cubic by this many tolerances makes its neighbours
/// computed as well.
const WRONG: f32 = 2.0;

/// How a picture is refined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refinement {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Distance of the first lattice's points in pixels, a power of two.
    pub spacing: usize,
    /// Rays of a pixel where the picture bends.
    pub samples: u32,
    /// Largest error that is expected of an interpolated pixel: of radiance as a share of the first
    /// lattice's 99.9th percentile, of opacity as such.
    pub tolerance: f32,
}

/// A picture whose pixels are partly computed and partly interpolated. It extends beyond `size` to
/// the right and below, so that it ends with points of the first lattice.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Vec4>,
    /// Largest errors of radiance and opacity.
    allowed: Vec4,
}

/// The picture whose pixels are what `pixel` says at (x, y) for a number of rays, as far as that
/// is needed, and wherever the pixel is `empty`: nothing is seen there but the background, which
/// stays what it is.
pub(super) fn refine_view(
    refinement: Refinement,
    progress: &dyn Progress,
    empty: impl Fn([usize; 2]) -> bool + Sync,
    pixel: impl Fn([usize; 2], u32) -> Vec4 + Sync,
) -> Image {
    let Refinement { size, samples, tolerance, .. } = refinement;
    let mut spacing = refinement.spacing;
    let [width, height] = size.each(|n| (n - 1).next_multiple_of(spacing) + 1);
    let pixels = vec![Vec4::ZERO; width * height];
    let mut canvas = Canvas { width, height, pixels, allowed: Vec4::ZERO };
    progress.begin("picture", (width * height) as u64);
    let single = |place: [usize; 2]| pixel(place, 1);
    let first = canvas.lattice(spacing, |_| true);
    canvas.compute(first, progress, &single);
    let bright = canvas.bright(spacing);
    canvas.allowed = tolerance * Vec4::new(bright, bright, bright, 1.0);
    while spacing > 1 {
        canvas.halve(spacing, progress, &empty, &single);
        spacing /= 2;
    }
    if samples > 1 {
        canvas.sample(progress, &|place: [usize; 2]| pixel(place, samples));
    }
    let rows = canvas.pixels.chunks_exact(width).take(size[1]);
    let pixels = rows.flat_map(|row| row[..size[0]].iter().map(Vec4::to_array)).collect();
    Image { width: size[0] as u32, height: size[1] as u32, pixels }
}

impl Canvas {
    /// Points with distance `spacing` that are `wanted`, as (x, y), in parts.
    fn lattice(
        &self,
        spacing: usize,
        wanted: impl Fn([usize; 2]) -> bool + Sync,
    ) -> Vec<Vec<[usize; 2]>> {
        let reach = PART * spacing;
        let parts = (0..self.height).step_by(reach).flat_map(|top| {
            let lefts = (0..self.width).step_by(reach);
            lefts.map(move |left| [left, top])
        });
        let parts: Vec<[usize; 2]> = parts.collect();
        let mut points = parallel::map(parts, |[left, top]| {
            let rows = (top..self.height.min(top + reach)).step_by(spacing);
            let row = |y: usize| {
                let columns = (left..self.width.min(left + reach)).step_by(spacing);
                columns.map(move |x| [x, y])
            };
            rows.flat_map(row).filter(|&point| wanted(point)).collect::<Vec<_>>()
        });
        points.retain(|part| !part.is_empty());
        points
    }

    /// The number of points of a lattice.
    fn points(&self, spacing: usize) -> usize {
        [self.width, self.height].map(|n| (n - 1) / spacing + 1).into_iter().product()
    }

    fn at(&self, [x, y]: [usize; 2]) -> Vec4 {
        self.pixels[y * self.width + x]
    }

    /// Computes points, and returns those that differ from what stood there by too much.
    fn compute(
        &mut self,
        parts: Vec<Vec<[usize; 2]>>,
        progress: &dyn Progress,
        pixel: &(impl Fn([usize; 2]) -> Vec4 + Sync),
    ) -> Vec<[usize; 2]> {
        let computed = parallel::map(&parts, |part| {
            if progress.cancelled() {
                return vec![Vec4::ZERO; part.len()];
            }
            let colours: Vec<Vec4> = part.iter().map(|&place| pixel(place)).collect();
            progress.advance(part.len() as u64);
            colours
        });
        if progress.cancelled() {
            return Vec::new();
        }
        let allowed = WRONG * self.allowed;
        let mut wrong = Vec::new();
        for (place, colour) in parts.into_iter().flatten().zip(computed.into_iter().flatten()) {
            let [x, y] = place;
            let pixel = &mut self.pixels[y * self.width + x];
            if (colour - *pixel).abs().cmpgt(allowed).any() {
                wrong.push(place);
            }
            *pixel = colour;
        }
        wrong
    }

    /// The 99.9th percentile of radiance over the lit points of a lattice; 0 if none is lit.
    fn bright(&self, spacing: usize) -> f32 {
        let rows = self.pixels.chunks_exact(self.width).step_by(spacing);
        let points = rows.flat_map(|row| row.iter().step_by(spacing));
        lit_percentile(points.map(|pixel| pixel.truncate().max_element()), BRIGHT)
    }

    /// Where the points of a lattice bend: a line through the two next to one, in any of four
    /// directions, misses it by eight times what a line from it to the next may be wrong by.
    fn bends(&self, spacing: usize) -> Vec<bool> {
        let [columns, rows] = [self.width, self.height].each(|n| (n - 1) / spacing + 1);
        let allowed = 8.0 * self.allowed;
        let bends = parallel::map(0..rows, |row| {
            let near = |i: usize, count: usize| [i.saturating_sub(1), (i + 1).min(count - 1)];
            let [above, below] = near(row, rows);
            let point = |x: usize, y: usize| self.at([x * spacing, y * spacing]);
            let bend = |x: usize| {
                let [left, right] = near(x, columns);
                let twice = 2.0 * point(x, row);
                let sides = [
                    point(left, row) + point(right, row),
                    point(x, above) + point(x, below),
                    point(left, above) + point(right, below),
                    point(left, below) + point(right, above),
                ];
                sides.into_iter().any(|side| (side - twice).abs().cmpgt(allowed).any())
            };
            (0..columns).map(bend).collect::<Vec<_>>()
        });
        bends.concat()
    }

    /// Halves the spacing of a lattice.
    fn halve(
        &mut self,
        spacing: usize,
        progress: &dyn Progress,
        empty: &(impl Fn([usize; 2]) -> bool + Sync),
        pixel: &(impl Fn([usize; 2]) -> Vec4 + Sync),
    ) {
        let half = spacing / 2;
        let columns = (self.width - 1) / spacing + 1;
        let bends = self.bends(spacing);
        let new = |[x, y]: [usize; 2]| x % spacing != 0 || y % spacing != 0;
        // The lattice points around a point: one, two or four.
        let bent = |[x, y]: [usize; 2]| {
            let around = |c: usize| [c / spacing, c.div_ceil(spacing)];
            let ([left, right], [above, below]) = (around(x), around(y));
            [[left, above], [right, above], [left, below], [right, below]]
                .into_iter()
                .any(|[x, y]| bends[y * columns + x])
        };
        let wanted = self.lattice(half, |point| new(point) && (bent(point) || empty(point)));
        self.interpolate(spacing);
        let mut known = vec![false; self.pixels.len()];
        for &[x, y] in wanted.iter().flatten() {
            known[y * self.width + x] = true;
        }
        let count: usize = wanted.iter().map(Vec::len).sum();
        let interpolated = self.points(half) - self.points(spacing) - count;
        progress.advance(interpolated as u64);
        let wrong = self.compute(wanted, progress, pixel);
        self.follow(wrong, half, known, new, (progress, pixel));
    }

    /// Gives pixels that bend all of their rays.
    fn sample(&mut self, progress: &dyn Progress, pixel: &(impl Fn([usize; 2]) -> Vec4 + Sync)) {
        let known = self.bends(1);
        let wanted = self.lattice(1, |[x, y]| known[y * self.width + x]);
        progress.begin("picture", wanted.iter().map(Vec::len).sum::<usize>() as u64);
        let wrong = self.compute(wanted, progress, pixel);
        self.follow(wrong, 1, known, |_| true, (progress, pixel));
    }

    /// Computes the points of a lattice around those that were `wrong`, unless they are `known` or
    /// not `new`, then those around points that were wrong among them, and so on.
    fn follow(
        &mut self,
        mut wrong: Vec<[usize; 2]>,
        spacing: usize,
        mut known: Vec<bool>,
        new: impl Fn([usize; 2]) -> bool,
        (progress, pixel): (&dyn Progress, &(impl Fn([usize; 2]) -> Vec4 + Sync)),
    ) {
        while !wrong.is_empty() {
            let mut around = Vec::new();
            for [x, y] in wrong {
                let near = |c: usize, n: usize| {
                    (c.saturating_sub(spacing)..n.min(c + spacing + 1)).step_by(spacing)
                };
                for y in near(y, self.height) {
                    for x in near(x, self.width) {
                        let seen = &mut known[y * self.width + x];
                        if !*seen && new([x, y]) {
                            *seen = true;
                            around.push([x, y]);
                        }
                    }
                }
            }
            let parts = around.chunks(FOLLOWED).map(<[_]>::to_vec).collect();
            wrong = self.compute(parts, &Uncounted(progress), pixel);
        }
    }

    /// Cubics between the points of a lattice, at half their spacing.
    fn interpolate(&mut self, spacing: usize) {
        let (width, half) = (self.width, spacing / 2);
        // Along the lattice's rows...
        parallel::for_each(self.pixels.chunks_mut(width).step_by(spacing), |row| {
            for x in (half..width).step_by(spacing) {
                row[x] = halfway(|i| row[i], x, [half, width]);
            }
        });
        // ...then between these rows.
        let rows: Vec<usize> = (half..self.height).step_by(spacing).collect();
        let between = parallel::map(&rows, |&y| {
            let columns = (0..width).step_by(half);
            let point = |x: usize| halfway(|y| self.at([x, y]), y, [half, self.height]);
            columns.map(point).collect::<Vec<_>>()
        });
        for (y, row) in rows.into_iter().zip(between) {
            for (i, colour) in row.into_iter().enumerate() {
                self.pixels[y * width + i * half] = colour;
            }
        }
    }
}

/// The cubic through the values at `middle` ± `half` and ± 3 `half`, at `middle`; beyond an edge,
/// which is at 0 and at the last of `count`, values go on as a line. No colour is below 0, and no
/// opacity above 1.
fn halfway(value: impl Fn(usize) -> Vec4, middle: usize, [half, count]: [usize; 2]) -> Vec4 {
    let (before, after) = (value(middle - half), value(middle + half));
    let first = if middle >= 3 * half { value(middle - 3 * half) } else { 2.0 * before - after };
    let last =
        if middle + 3 * half < count { value(middle + 3 * half) } else { 2.0 * after - before };
    let cubic = (9.0 * (before + after) - first - last) / 16.0;
    let cubic = cubic.max(Vec4::ZERO);
    cubic.truncate().extend(cubic.w.min(1.0))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::progress::Silent;

    const TOLERANCE: f32 = 0.004;

    /// The refined picture of `colour`, and how many pixels were computed.
    fn refined(
        size: [usize; 2],
        [spacing, samples]: [usize; 2],
        colour: impl Fn([usize; 2], u32) -> f32 + Sync,
    ) -> (Image, usize) {
        let computed = AtomicUsize::new(0);
        let samples = samples as u32;
        let refinement = Refinement { size, spacing, samples, tolerance: TOLERANCE };
        let image = refine_view(
            refinement,
            &Silent,
            |_| false,
            |place, rays| {
                computed.fetch_add(1, Ordering::Relaxed);
                Vec4::splat(colour(place, rays)).truncate().extend(1.0)
            },
        );
        (image, computed.into_inner())
    }

    /// The largest difference of a picture from `colour`.
    fn error(image: &Image, colour: impl Fn([usize; 2], u32) -> f32) -> f32 {
        let width = image.width as usize;
        let errors = image.pixels.iter().enumerate().map(|(i, pixel)| {
            let expected = colour([i % width, i / width], 1);
            (0..3).map(|c| (pixel[c] - expected).abs()).fold((pixel[3] - 1.0).abs(), f32::max)
        });
        errors.fold(0.0, f32::max)
    }

    #[test]
    fn what_changes_evenly_is_known_from_the_first_lattice() {
        let plane = |[x, y]: [usize; 2], _| 0.5 + 0.0005 * x as f32 + 0.001 * y as f32;
        for size in [[1, 1], [1, 7], [5, 3], [64, 48], [61, 50]] {
            for spacing in [1, 2, 4, 8] {
                let (image, computed) = refined(size, [spacing, 1], plane);
                assert_eq!([image.width, image.height], size.map(|n| n as u32));
                let points = size.map(|n| (n - 1).div_ceil(spacing) + 1);
                assert_eq!(computed, points[0] * points[1], "{size:?}, {spacing}");
                assert!(error(&image, plane) < 1e-5, "{size:?}, {spacing}");
            }
        }
        let (image, computed) = refined([64, 64], [8, 4], |_, _| 0.0);
        assert_eq!((computed, error(&image, |_, _| 0.0)), (81, 0.0));
    }

    #[test]
    fn what_bends_is_computed_and_errors_keep_the_tolerance() {
        let waves = |[x, y]: [usize; 2], _| {
            // Slow on the left, fast on the right.
            0.5 + 0.4 * (0.00002 * (x * x) as f32 + 0.03 * y as f32).sin()
        };
        for spacing in [2, 4, 8] {
            let (image, computed) = refined([200, 160], [spacing, 1], waves);
            assert!(error(&image, waves) <= TOLERANCE * 0.9, "{spacing}");
            assert!(computed < 200 * 160 / 2, "{spacing}: {computed}");
        }
    }

    #[test]
    fn edges_that_lattice_points_miss_are_followed() {
        // Lines as narrow as two lattice points are apart, in all directions.
        for turn in 0..12 {
            let (s, c) = (0.26 * turn as f32).sin_cos();
            let line = |[x, y]: [usize; 2], _| {
                let away = (x as f32 - 60.3) * s - (y as f32 - 55.9) * c;
                f32::from(u8::from(away.abs() < 2.0))
            };
            let (image, computed) = refined([120, 110], [4, 1], line);
            assert!(error(&image, line) <= 2.0 * TOLERANCE, "{turn}");
            assert!(computed < 120 * 110 / 3, "{turn}: {computed}");
        }
    }

    #[test]
    fn edges_get_all_rays_and_nothing_else_does() {
        // One ray sees one side of the edge, several see how much there is of each.
        let edge = |[x, y]: [usize; 2], rays: u32| {
            let away = x as f32 + 0.4 * y as f32 - 50.0;
            if rays == 1 { f32::from(u8::from(away > 0.0)) } else { (away + 0.5).clamp(0.0, 1.0) }
        };
        for spacing in [1, 4] {
            let (image, computed) = refined([90, 60], [spacing, 4], edge);
            assert!(error(&image, |place, _| edge(place, 4)) <= 2.0 * TOLERANCE);
            let most = if spacing == 1 { 90 * 60 + 60 * 5 } else { 90 * 60 / 3 };
            assert!(computed < most, "{computed}");
        }
    }
}
