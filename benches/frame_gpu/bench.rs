//! A scene on the device, and the passes on it.

use std::time::Instant;

use deepshadow::frame::Frame;
use deepshadow::gpu::{GpuFragments, GpuFrame, GpuImage, GpuMedia, GpuShadow, Renderer, Tile};
use deepshadow::scene::{Beam, Scene};
use deepshadow::settings::{MapKind, Settings};

/// Number of steps at which a picture counts as converged.
pub const CONVERGED: u32 = 4096;

/// A scene, with the resources that its passes read and write.
pub struct Bench<'a> {
    pub gpu: &'a Renderer,
    pub name: String,
    pub scene: Scene,
    pub beam: Beam,
    pub volume: GpuMedia,
    pub settings: Settings,
    pub image: GpuImage,
}

impl<'a> Bench<'a> {
    /// A scene with maps and pictures of the benchmark's size.
    pub fn new(gpu: &'a Renderer, name: String, scene: Scene, settings: &Settings) -> Self {
        let size = size();
        let settings = settings.with(|s| {
            s.map.kind = Some(MapKind::Fragments);
            s.map.size = map_size();
            s.image.size = [size; 2];
        });
        let beam = scene.only_beam().unwrap();
        let volume = gpu.upload(&scene.media).unwrap();
        let image = gpu.image(size, size).unwrap();
        Self { gpu, name, scene, beam, volume, settings, image }
    }

    pub fn frame(&self, settings: &Settings, change: impl FnOnce(&mut Frame)) -> GpuFrame {
        let mut frame = Frame::new(&self.beam, settings).unwrap();
        frame.map.follows_links = 0;
        change(&mut frame);
        self.gpu.frame(&frame, &self.volume).unwrap()
    }

    pub fn threshold_ms(&self, frame: &GpuFrame) -> f64 {
        let map = self.gpu.map(self.settings.map.size).unwrap();
        milliseconds(|passes| {
            self.gpu
                .submit(|encoder| {
                    for _ in 0..passes {
                        self.gpu.trace_threshold(encoder, &self.volume, frame, &map)?;
                    }
                    Ok(())
                })
                .unwrap();
        })
    }

    /// Pass `trace_slices` with room for a number of nodes per texel: milliseconds and the map;
    /// `None` if the device has not that much memory.
    pub fn slices(&self, frame: &GpuFrame, nodes: u32) -> Option<(f64, GpuFragments)> {
        let size = self.settings.map.size;
        let map = self.gpu.fragments(Tile::rows(size, 0, size, nodes)).ok()?;
        let ms = milliseconds(|passes| {
            self.gpu
                .submit(|encoder| {
                    for _ in 0..passes {
                        self.gpu.trace_slices(encoder, &self.volume, frame, &map)?;
                    }
                    Ok(())
                })
                .unwrap();
        });
        assert_eq!(self.gpu.nodes_missing(&map).unwrap(), None, "nodes were lost");
        Some((ms, map))
    }

    /// Mean and largest number of nodes per texel.
    pub fn nodes(&self, map: &GpuFragments) -> String {
        let runs = self.gpu.read_fragments(map).unwrap();
        let most = runs.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
        format!("{:.1}, at most {most}", runs.nodes().len() as f64 / runs.texels() as f64)
    }

    /// Passes `raster_slices` and `sort_fragments`, in one submission each because their buffers
    /// are large: milliseconds, and fragments per texel.
    pub fn drawn(&self, frame: &GpuFrame, planes: u32) -> Option<(f64, f64)> {
        let size = self.settings.map.size;
        let lists = |capacity: u32| self.gpu.lists(Tile::rows(size, 0, size, capacity));
        let draw = |encoder: &mut _, lists: &_| {
            self.gpu.raster_slices(encoder, &self.volume, frame, planes, lists)
        };
        let none = lists(0);
        self.gpu.submit(|encoder| draw(encoder, &none)).unwrap();
        let drawn = self.gpu.fragments_drawn(&none).unwrap();
        if drawn * 16 > 2 << 30 {
            return None;
        }
        let drawn = drawn as u32;
        let room = lists(drawn);
        let mut times: Vec<f64> = (0..5)
            .map(|_| {
                let begun = Instant::now();
                self.gpu
                    .submit(|encoder| {
                        draw(encoder, &room)?;
                        self.gpu.sort_fragments(encoder, frame, &room, drawn).map(drop)
                    })
                    .unwrap();
                begun.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        Some((times[2], f64::from(drawn) / f64::from(size * size)))
    }

    pub fn march(&self, frame: &GpuFrame, shadow: GpuShadow<'_>, passes: u32) {
        self.gpu
            .submit(|encoder| {
                for _ in 0..passes {
                    self.gpu.march_view(encoder, &self.volume, frame, shadow, &self.image)?;
                }
                Ok(())
            })
            .unwrap();
    }

    pub fn view_ms(&self, frame: &GpuFrame, shadow: GpuShadow<'_>) -> f64 {
        milliseconds(|passes| self.march(frame, shadow, passes))
    }

    pub fn picture(&self, frame: &GpuFrame, shadow: GpuShadow<'_>) -> Vec<[f32; 4]> {
        self.march(frame, shadow, 1);
        self.gpu.read(self.image.texture()).unwrap()
    }
}

/// Texels along each edge of a map and pixels along that of a picture: 512, or
/// `DEEPSHADOW_BENCH_SIZE`.
pub fn size() -> u32 {
    asked("DEEPSHADOW_BENCH_SIZE").unwrap_or(512)
}

/// Texels along each edge of a map, if others are asked for: `DEEPSHADOW_BENCH_MAP`.
pub fn map_size() -> u32 {
    asked("DEEPSHADOW_BENCH_MAP").unwrap_or_else(size)
}

fn asked(name: &str) -> Option<u32> {
    std::env::var(name).ok().and_then(|n| n.parse().ok())
}

/// The largest difference over pixels and channels, in 1/255, and the number of pixels that differ
/// by more than 1/255.
pub fn difference(picture: &[[f32; 4]], truth: &[[f32; 4]]) -> (f32, u32) {
    let differences = picture.iter().zip(truth).map(|(a, b)| {
        let channels = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        255.0 * channels.fold(0.0, |most: f32, d| if d <= most { most } else { d })
    });
    differences.fold((0.0_f32, 0), |(most, above), d| {
        // NaN counts as the largest difference.
        let d = if d.is_nan() { f32::INFINITY } else { d };
        (most.max(d), above + u32::from(d > 1.0))
    })
}

/// Milliseconds per pass: the median of five submissions, each with as many passes as take 30 ms.
pub fn milliseconds(mut submit: impl FnMut(u32)) -> f64 {
    let mut timed = |passes: u32| {
        let begun = Instant::now();
        submit(passes);
        begun.elapsed().as_secs_f64() * 1e3
    };
    timed(1);
    let passes = (30.0 / timed(1)).ceil().clamp(1.0, 300.0) as u32;
    let mut times: Vec<f64> = (0..5).map(|_| timed(passes) / f64::from(passes)).collect();
    times.sort_by(f64::total_cmp);
    times[2]
}
