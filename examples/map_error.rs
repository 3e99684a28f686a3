//! Compares the errors of shadow maps for their size: each kind against the exact line integral
//! along its own rays.
#![allow(clippy::print_stdout)]

use deepshadow::accuracy::{Place, Points};
use deepshadow::settings::MapKind;
use deepshadow::shadow::Shadow;
use deepshadow::volume::{Axis, presets::Preset};
use deepshadow::{Backend, CpuBackend, Result, Scene, Settings, Silent};

/// For each kind its bytes, and the root mean square of its errors of transmittance on texels'
/// rays, which exclude the error of the map's resolution.
pub fn example() -> Result<Vec<(MapKind, u64, f64)>> {
    let scene = Scene::automatic(Preset::Rods.volume(Axis::Y)?)?;
    let beam = scene.only_beam()?;
    let size = 64;
    let (count, seed) = (5_000, 1);
    let points = Points::draw(&beam, size, &[Place::Rays], [count, seed], &Silent);
    let mut found = Vec::new();
    for kind in [MapKind::Threshold, MapKind::Fragments, MapKind::Visibility] {
        let settings = Settings::default().with(|settings| {
            settings.map.kind = Some(kind);
            settings.map.size = size;
        });
        let map = CpuBackend.map(&beam, &settings, &Silent)?;
        found.push((kind, map.bytes(), points.errors(Place::Rays, &map, 0).rms));
    }
    Ok(found)
}

#[allow(dead_code)]
fn main() -> Result<()> {
    for (kind, bytes, rms) in example()? {
        println!("{kind:>12}: {bytes:>8} bytes, RMS {rms:.4}");
    }
    Ok(())
}
