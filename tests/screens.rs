//! What a screen shows, made on a device: pass `show_image` against the library's own conversion, and
//! pictures that stay on a device against those that are read back.
#![cfg(feature = "gpu")]

use deepshadow::gpu::{AdapterChoice, GpuBackend, GpuImage, Renderer};
use deepshadow::image::{Image, Tone, ToneMap};
use deepshadow::volume::{Axis, presets::Preset};
use deepshadow::{Backend, Scene, Settings, Silent, wgpu};

use super::support::Random;

fn backend() -> Option<GpuBackend> {
    if std::env::var("DEEPSHADOW_TEST_GPU").is_ok_and(|value| value == "skip") {
        eprintln!("SKIPPED: DEEPSHADOW_TEST_GPU=skip, nothing is tested on a GPU");
        return None;
    }
    Some(GpuBackend::open(AdapterChoice::Any).unwrap())
}

/// What pass `show_image` makes of a picture on the device.
fn shown(gpu: &Renderer, image: &GpuImage, tone: Tone) -> Vec<u8> {
    let [width, height] = image.size();
    let device = gpu.device();
    let screen = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = screen.create_view(&Default::default());
    let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * height),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.submit(|encoder| {
        gpu.show_image(encoder, image, tone, &view)?;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: Some(height),
        };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(screen.as_image_copy(), target, screen.size());
        Ok(())
    })
    .unwrap();
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.get_mapped_range(..).unwrap();
    bytes.chunks_exact(row as usize).flat_map(|row| row[..4 * width as usize].to_vec()).collect()
}

/// A picture on the device with the pixels of `image`.
fn uploaded(gpu: &Renderer, queue: &wgpu::Queue, image: &Image) -> GpuImage {
    let held = gpu.image(image.width, image.height).unwrap();
    queue.write_texture(
        held.texture().as_image_copy(),
        bytemuck::cast_slice(&image.pixels),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * image.width),
            rows_per_image: Some(image.height),
        },
        held.texture().size(),
    );
    held
}

/// Bytes that differ by more than a step of rounding, as a share.
fn off(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    let far = a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    far as f64 / a.len() as f64
}

#[test]
fn a_device_shows_what_the_library_shows() {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    if backend().is_none() {
        return;
    }
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
    let gpu = Renderer::new(&device, &queue);
    let mut random = Random(11);
    // Dark and bright, grey and coloured, opaque and not.
    let pixels = (0..61 * 40).map(|i| {
        let bright = 10.0_f64.powf(random.unit() * 6.0 - 4.0);
        let alpha = if i % 3 == 0 { random.unit() } else { 1.0 };
        let colour = [0; 3].map(|_| (bright * random.unit() * alpha) as f32);
        let own = [colour[0], colour[1], colour[2], alpha as f32];
        if i % 17 == 0 { [0.0; 4] } else { own }
    });
    let image = Image { width: 61, height: 40, pixels: pixels.collect() };
    let held = uploaded(&gpu, &queue, &image);
    for map in ToneMap::ALL {
        for exposure in [0.25, 1.0, 3.0] {
            let tone = Tone::new(exposure, map);
            let own = shown(&gpu, &held, tone);
            assert_eq!(off(&own, &image.to_srgb8(tone)), 0.0, "{} {exposure}", map.name());
            // A step of rounding hides a percent in dark pixels and behind curves, but not in all.
            let bent = Tone::new(exposure * 1.03, map);
            let noticed = off(&own, &image.to_srgb8(bent));
            assert!(noticed > 0.02, "{} {exposure}: {noticed}", map.name());
        }
    }
}

#[test]
fn pictures_that_stay_are_those_that_are_read() {
    let Some(gpu) = backend() else { return };
    let mut scene = Scene::automatic(Preset::Bucky.volume(Axis::Y).unwrap()).unwrap();
    let settings = Settings::default().with(|settings| {
        (settings.image.size, settings.map.size) = ([96, 64], 96);
    });
    let (mut stays, mut read) = (gpu.gpu_stage(), gpu.stage());
    for step in 0..3 {
        scene.camera.position += 0.1 * f64::from(step) * scene.camera.up;
        let image = stays.draw(&scene, &settings, &Silent).unwrap();
        let pixels = gpu.renderer().read(image.texture()).unwrap();
        assert_eq!(pixels, read.render(&scene, &settings, &Silent).unwrap().pixels);
    }
}

/// A picture on a device that is given up leaves its maps, and only if they are whole.
#[test]
fn a_cancelled_picture_keeps_its_maps() {
    use std::sync::Mutex;

    use deepshadow::ErrorKind;
    use deepshadow::progress::Progress;

    /// Gives up when the map is made.
    #[derive(Default)]
    struct UpToTheMap(Mutex<(Vec<String>, bool)>);
    impl Progress for UpToTheMap {
        fn begin(&self, what: &str, _total: u64) {
            self.0.lock().unwrap().0.push(what.to_owned());
        }
        fn advance(&self, _parts: u64) {
            self.0.lock().unwrap().1 = true;
        }
        fn cancelled(&self) -> bool {
            self.0.lock().unwrap().1
        }
    }
    /// Remembers what was done.
    #[derive(Default)]
    struct Works(Mutex<Vec<String>>);
    impl Progress for Works {
        fn begin(&self, what: &str, _total: u64) {
            self.0.lock().unwrap().push(what.to_owned());
        }
        fn advance(&self, _parts: u64) {}
    }
    let Some(gpu) = backend() else { return };
    let scene = Scene::automatic(Preset::Bucky.volume(Axis::Y).unwrap()).unwrap();
    let settings = Settings::default().with(|settings| {
        (settings.image.size, settings.map.size) = ([96, 64], 96);
    });
    let expected = gpu.render(&scene, &settings, &Silent).unwrap();
    let mut stage = gpu.stage();
    let progress = UpToTheMap::default();
    let error = stage.render(&scene, &settings, &progress).map(|_| ()).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Cancelled), "{error}");
    assert_eq!(progress.0.into_inner().unwrap().0, ["shadow map"]);
    let works = Works::default();
    assert!(stage.render(&scene, &settings, &works).unwrap() == expected);
    assert_eq!(works.0.into_inner().unwrap(), ["picture"]);
}
