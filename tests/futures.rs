//! Tests of a GPU's futures: they make what the functions make that wait for them, bit by bit, and
//! whoever drops one halfway gets whole pictures after it.
#![cfg(feature = "gpu")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use deepshadow::backend::Backend;
use deepshadow::gpu::{AdapterChoice, GpuBackend, adapters, adapters_async};
use deepshadow::image::{Tone, ToneMap};
use deepshadow::progress::{Progress, Silent};
use deepshadow::settings::{MapKind, Settings, Slices};
use deepshadow::volume::presets::Preset;
use deepshadow::{Error, ErrorKind};
use pollster::block_on;

use crate::support::backends;
use crate::support::scenes::{anchor_scene, scene, settings, unit_cube, volume};
use crate::{surface_lists, surfaces};

fn device() -> Option<GpuBackend> {
    backends::gpu()?;
    Some(block_on(GpuBackend::request(AdapterChoice::Any)).unwrap())
}

/// With the least memory, and a map that does not fit it: with 32 nodes a texel it takes 1.3 MiB.
fn tiled(settings: &Settings) -> Settings {
    settings.with(|s| (s.map.size, s.map.fragments.memory) = (72, 1 << 20))
}

/// Both kinds of maps, and such as the host assembles: drawn ones, and those built in tiles.
fn ways() -> Vec<(&'static str, Settings)> {
    let usual = settings(24, [20, 16]).with(|s| s.map.kind = Some(MapKind::Fragments));
    vec![
        ("threshold", usual.with(|s| s.map.kind = Some(MapKind::Threshold))),
        ("fragments", usual.clone()),
        ("drawn", usual.with(|s| s.map.fragments.slices = Slices::Raster)),
        ("tiles", tiled(&usual)),
        ("refined", usual.with(|s| s.image.samples = 4)),
    ]
}

#[test]
fn futures_make_the_pictures_of_those_who_wait() {
    let Some(gpu) = device() else { return };
    assert_eq!(gpu.description(), Backend::description(&gpu));
    assert_eq!(block_on(adapters_async()), adapters());
    let scene = anchor_scene(Preset::Bucky, 4.0, 24);
    for (way, settings) in ways() {
        let expected = gpu.render(&scene, &settings, &Silent).unwrap();
        let mut stage = gpu.gpu_stage();
        // With a new map, and with the one that was kept.
        for _ in 0..2 {
            let image = block_on(stage.render_async(&scene, &settings, &Silent)).unwrap();
            assert!(image == expected, "{way}");
        }
        let held = block_on(gpu.gpu_stage().draw_async(&scene, &settings, &Silent)).unwrap();
        let pixels = block_on(gpu.renderer().read_async(held.texture())).unwrap();
        assert!(pixels == expected.pixels, "{way}");
        let beam = scene.only_beam().unwrap();
        let map = block_on(gpu.map_async(&beam, &settings, &Silent)).unwrap();
        let own = gpu.map(&beam, &settings, &Silent).unwrap();
        let image = block_on(gpu.view_async(&beam, &settings, &map, &Silent)).unwrap();
        assert!(image == gpu.view(&beam, &settings, &own, &Silent).unwrap(), "{way}");
        let tone = Tone::new(0.7, ToneMap::ALL[0]);
        let bytes = block_on(stage.show_async(&held, tone)).unwrap();
        assert_eq!(bytes, stage.show(&held, tone).unwrap());
        // The device's own conversion differs from the host's by its rounding alone.
        let own = expected.to_srgb8(tone);
        assert_eq!(bytes.len(), own.len());
        assert!(bytes.iter().zip(&own).all(|(a, b)| a.abs_diff(*b) <= 1), "{way}");
    }
}

/// Gives up when the map is made.
#[derive(Default)]
struct UpToTheMap(AtomicBool);

impl Progress for UpToTheMap {
    fn begin(&self, _what: &str, _total: u64) {}
    fn advance(&self, _parts: u64) {
        self.0.store(true, Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

#[test]
fn futures_fail_as_those_who_wait_do() {
    let Some(gpu) = device() else { return };
    let scene = anchor_scene(Preset::Bucky, 4.0, 24);
    let usual = &ways()[1].1;
    let mut stage = gpu.gpu_stage();
    let cancelled =
        block_on(stage.render_async(&scene, usual, &UpToTheMap::default())).map(drop).unwrap_err();
    assert!(matches!(cancelled.kind(), ErrorKind::Cancelled), "{cancelled}");
    let text = |error: Option<Error>| error.map(|error| error.to_string()).unwrap();
    let large = usual.with(|s| s.map.size = 1 << 20);
    let coded = usual.with(|s| s.map.kind = Some(MapKind::Visibility));
    for settings in [&large, &coded] {
        let own = block_on(stage.render_async(&scene, settings, &Silent)).err();
        let waited = gpu.render(&scene, settings, &Silent).err();
        assert_eq!(text(own), text(waited));
    }
    assert!(block_on(stage.render_async(&scene, usual, &Silent)).is_ok());
}

#[test]
fn futures_draw_hair_and_meshes() {
    let Some(gpu) = device() else { return };
    let usual = surfaces::fragments(48).with(|s| s.image.size = [40, 32]);
    let tiles = tiled(&usual);
    for (name, scene) in surface_lists::scenes(1.0).into_iter().skip(4).step_by(2) {
        for settings in [&usual, &tiles] {
            let expected = gpu.render(&scene, settings, &Silent).unwrap();
            let mut stage = gpu.gpu_stage();
            let image = block_on(stage.render_async(&scene, settings, &Silent)).unwrap();
            assert!(image == expected, "{name}");
        }
    }
}

/// Panics where the map has been made, and nobody has asked yet whether its lists are whole.
struct Panics;

impl Progress for Panics {
    fn begin(&self, what: &str, _total: u64) {
        assert!(what != "picture", "given up");
    }
    fn advance(&self, _parts: u64) {}
}

/// A future that is dropped halfway, here by a panic, leaves no truncated lists to the next picture.
#[test]
fn what_was_given_up_halfway_is_made_anew() {
    let Some(gpu) = device() else { return };
    let noise = |[x, y, z]: [usize; 3]| ((x * 7 + y * 13 + z * 31) % 5) as f32;
    let scene = scene(volume([9, 11, 48], unit_cube(), noise), 1.5);
    let settings = settings(24, [20, 16]).with(|s| {
        s.map.kind = Some(MapKind::Fragments);
        s.map.fragments.tolerance = 1e-6;
    });
    let expected = gpu.render(&scene, &settings, &Silent).unwrap();
    let mut stage = gpu.gpu_stage();
    let given_up = catch_unwind(AssertUnwindSafe(|| {
        block_on(stage.render_async(&scene, &settings, &Panics)).map(drop)
    }));
    assert!(given_up.is_err());
    assert!(block_on(stage.render_async(&scene, &settings, &Silent)).unwrap() == expected);
}
