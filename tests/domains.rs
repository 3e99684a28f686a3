//! Tests that the media's domain contains everything that has extinction or emits.

use std::sync::Arc;

use deepshadow::math::Aabb;
use deepshadow::progress::Silent;
use deepshadow::scene::transfer::{TransferFunction, TransferPoint};
use deepshadow::scene::{Camera, Emission, Media, Medium};
use deepshadow::volume::Volume;
use glam::DVec3;

use crate::support::backends::every_backend;
use crate::support::scenes::{scene, settings, unit_cube, volume};

fn uniform(bounds: Aabb) -> Volume {
    volume([8; 3], bounds, |_| 1.0)
}

fn boxed(center: DVec3, size: f64) -> Aabb {
    Aabb { min: center - 0.5 * size, max: center + 0.5 * size }
}

/// A fire beside the smoke's box is seen completely: by a ray through it alone, and by one through
/// both.
#[test]
fn emission_goes_on_beyond_the_densities() {
    let point = TransferPoint { value: 0.0, color: DVec3::ONE, opacity: 1.0 };
    let end = TransferPoint { value: 1.0, ..point };
    let glowing = Arc::new(TransferFunction::new(vec![point, end]).unwrap());
    let fire = Arc::new(uniform(boxed(DVec3::new(0.0, 0.0, -3.0), 1.0)));
    let emission = Emission::new(glowing, 0.8).over(fire);
    let dark = Medium::new(0.5).with(|medium| {
        medium.albedo = DVec3::ZERO;
        medium.emission = Some(emission);
    });
    let mut scene = scene(uniform(unit_cube()), 1.0);
    scene.media = Media::of(Arc::new(uniform(unit_cube())), dark);
    let size = scene.media.world_bounds().size();
    assert!((size - DVec3::new(1.0, 1.0, 4.0)).length() < 1e-9, "{size}");
    // From the side only the fire is seen, from the front it is seen through the smoke.
    for (from, to, seen) in [
        (DVec3::new(9.0, 0.0, -3.0), DVec3::new(0.0, 0.0, -3.0), 0.8),
        (DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, 0.8 * f64::exp(-0.5)),
        (DVec3::new(9.0, 0.0, -1.5), DVec3::new(0.0, 0.0, -1.5), 0.0),
    ] {
        scene.camera = Camera::orthographic(from, to, 0.5);
        for backend in every_backend() {
            let image = backend.render(&scene, &settings(16, [8, 8]), &Silent).unwrap();
            let found = f64::from(image.pixels[36][0]);
            assert!((found - seen).abs() < 2e-3, "{}: {found}, not {seen}", backend.description());
        }
    }
}
