//! The difference of a picture from the one through exact transmittances.

use std::collections::HashMap;
use std::time::Duration;

use deepshadow::accuracy::{ExactPoints, ExactTexels};
use deepshadow::image::Image;
use deepshadow::{CpuBackend, Frame, Result};
use eframe::egui;
use web_time::Instant;

use super::{Answer, Difference, Made, Wanted, colour};

/// Distances of the pixels that are compared, one after another.
const SPACINGS: [usize; 4] = [16, 8, 4, 2];
/// Pixels that are computed before it is asked whether they are still wanted.
const AT_ONCE: usize = 256;
/// After this time no finer pixels are begun.
const LONGEST: Duration = Duration::from_secs(8);

/// Compares pixels of a picture, ever closer ones.
pub(super) async fn difference(
    Made { scene, settings, .. }: &Made,
    image: &Image,
    wanted: &Wanted,
    tell: &dyn Fn(Answer),
) -> Result<()> {
    let settings = settings.with(|settings| settings.image.tolerance = 0.0);
    let [width, height] = [image.width as usize, image.height as usize];
    let beams = scene.beams_for(&settings)?;
    let mut parts = Vec::new();
    for beam in &beams {
        let exact = ExactPoints(ExactTexels::new(beam, settings.map.size));
        parts.push((beam, Frame::new(beam, &settings)?, exact));
    }
    let bright = brightest(image);
    let mut known: HashMap<[u32; 2], f64> = HashMap::new();
    let pixels_at = |spacing: usize| {
        let half = spacing / 2;
        let rows = (half..height).step_by(spacing);
        rows.flat_map(move |y| (half..width).step_by(spacing).map(move |x| [x as u32, y as u32]))
    };
    let all: usize = SPACINGS.iter().map(|&spacing| pixels_at(spacing).count()).sum();
    let mut done = 0;
    let begun = Instant::now();
    for spacing in SPACINGS {
        let pixels: Vec<[u32; 2]> = pixels_at(spacing).collect();
        for chunk in pixels.chunks(AT_ONCE) {
            wanted.check().await?;
            let mut sum = Image::filled(chunk.len() as u32, 1, [0.0; 4]);
            for (beam, frame, exact) in &parts {
                let seen = CpuBackend.march_pixels(beam.casters(), frame, exact, chunk)?;
                let seen = Image { width: chunk.len() as u32, height: 1, pixels: seen };
                beam.add(&seen, &mut sum);
            }
            for (&[x, y], truth) in chunk.iter().zip(&sum.pixels) {
                let own = image.pixel(x, y);
                let off = (0..3).map(|c| f64::from((own[c] - truth[c]).abs()));
                known.insert([x, y], off.fold(0.0, f64::max) / bright);
            }
            done += chunk.len();
            if done % (AT_ONCE * 8) < AT_ONCE {
                let share = done as f32 / all as f32;
                tell(Answer::Difference(heat(&known, [width, height], spacing, share)));
            }
        }
        // Finer ones take four times as long.
        let is_last = begun.elapsed() > LONGEST || done == all;
        let share = if is_last { 1.0 } else { done as f32 / all as f32 };
        tell(Answer::Difference(heat(&known, [width, height], spacing, share)));
        if is_last {
            break;
        }
    }
    Ok(())
}

/// The 99.9th percentile of the largest channels, above 0.
fn brightest(image: &Image) -> f64 {
    let mut largest: Vec<f32> =
        image.pixels.iter().map(|&[r, g, b, _]| r.max(g).max(b)).filter(|c| *c > 0.0).collect();
    if largest.is_empty() {
        return 1.0;
    }
    let rank = (largest.len() - 1) * 999 / 1000;
    f64::from(*largest.select_nth_unstable_by(rank, f32::total_cmp).1)
}

/// A picture of the differences at the pixels with this distance.
fn heat(
    known: &HashMap<[u32; 2], f64>,
    [width, height]: [usize; 2],
    spacing: usize,
    share: f32,
) -> Difference {
    let (mut squares, mut largest) = (0.0, 0.0_f64);
    for &off in known.values() {
        squares += off * off;
        largest = largest.max(off);
    }
    let rms = (squares / known.len().max(1) as f64).sqrt();
    let scale = (8.0 * rms).max(1e-6);
    let [columns, rows] = [width, height].map(|n| n.div_ceil(spacing).max(1));
    let half = spacing / 2;
    let pixel = |column: usize, row: usize| {
        let at = [(column * spacing + half) as u32, (row * spacing + half) as u32];
        // Where no finer pixel was compared yet, the nearest of a coarser lattice is shown.
        let finer = SPACINGS.iter().rev().filter(|&&coarse| coarse >= spacing);
        let near = finer.filter_map(|&coarse| {
            let half = coarse / 2;
            let to = |c: u32, n: usize| {
                let most = n.checked_sub(half + 1)? / coarse;
                let steps = (f64::from(c) - half as f64) / coarse as f64;
                Some(((steps.round().max(0.0) as usize).min(most) * coarse + half) as u32)
            };
            known.get(&[to(at[0], width)?, to(at[1], height)?])
        });
        let near = near.copied().next();
        colour(near.map_or(0.0, |off| off / scale))
    };
    let pixels: Vec<egui::Color32> =
        (0..rows).flat_map(|row| (0..columns).map(move |column| pixel(column, row))).collect();
    let heat = egui::ColorImage::new([columns, rows], pixels);
    let part = [width as f32 / (columns * spacing) as f32, height as f32 / (rows * spacing) as f32];
    Difference { heat, part, rms, largest, spacing, scale, share }
}
