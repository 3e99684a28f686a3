//! Renders an array of densities, and asks how much light reaches points of it.
#![allow(clippy::print_stdout)]

use std::path::Path;

use deepshadow::glam::DVec3;
use deepshadow::ndarray::Array3;
use deepshadow::shadow::Shadow;
use deepshadow::{Backend, CpuBackend, Result, Scene, Settings, Silent, Volume};

/// Writes `puff.png` into `folder`, and returns how much light reaches five points along a line,
/// 0..1.
pub fn example(folder: &Path) -> Result<Vec<f32>> {
    // A soft ball; densities by (z, y, x).
    let puff = Array3::from_shape_fn((48, 48, 48), |(z, y, x)| {
        let from_middle = [x, y, z].map(|i| (i as f32 - 23.5) / 24.0);
        let squared: f32 = from_middle.iter().map(|c| c * c).sum();
        (1.0 - squared).max(0.0)
    });
    let volume = Volume::from_array("puff", puff, [0.02; 3])?;
    let scene = Scene::automatic(volume)?;
    let settings = Settings::default().with(|settings| {
        settings.image.size = [160, 120];
        settings.map.size = 128;
    });
    CpuBackend.render(&scene, &settings, &Silent)?.save(folder.join("puff.png"), 1.0)?;

    // The light's map, queried at world positions.
    let beam = scene.only_beam()?;
    let map = CpuBackend.map(&beam, &settings, &Silent)?;
    let middle = scene.media.world_bounds().center();
    let way = beam.light.direction_at(middle);
    let points = [-0.6, -0.3, 0.0, 0.3, 0.6].map(|distance| middle + distance * way);
    let light_at = |point: DVec3| {
        let place = beam.view.place(point)?;
        Some(map.lookup(0, place.x, place.y, place.z))
    };
    Ok(points.into_iter().filter_map(light_at).collect())
}

#[allow(dead_code)]
fn main() -> Result<()> {
    println!("light from front to back: {:.3?}", example(Path::new("."))?);
    Ok(())
}
