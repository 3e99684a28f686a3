//! Hair in a map: what strands leave in texels' lists, sorted, and the map fitted to them; the file
//! `DEEPSHADOW_BENCH_HAIR`, or else strands on a ball.

use std::path::{Path, PathBuf};

use deepshadow::frame::{Frame, FrameSurfaces};
use deepshadow::gpu::{GpuFragments, GpuFrame, GpuLists, GpuMedia, GpuSurfaces, Renderer, Tile};
use deepshadow::io::load_surfaces;
use deepshadow::scene::automatic::{Loaded, Surroundings, complete};
use deepshadow::scene::{Beam, Scene, SceneFile, Shape, Surface};
use deepshadow::settings::{MapKind, Settings};
use deepshadow::surface::{Strands, Varying};
use glam::{DMat4, Vec3};

use crate::clock::Clock;
use crate::device::Gpu;

/// Strands, and points of each, of the hair that is made up.
const STRANDS: u32 = 10_000;
const POINTS: u32 = 16;
/// Sizes of maps.
const SIZES: [u32; 3] = [256, 512, 1024];

/// Strands on the upper half of a ball, which hang down.
fn made_up() -> Surface {
    let place = |i: u32, j: u32| {
        let (share, turn) = ((i as f32 + 0.5) / STRANDS as f32, i as f32 * 2.399_963_2);
        let (height, t) = (1.0 - share, j as f32 / (POINTS - 1) as f32);
        let out = (1.0 - height * height).sqrt() * (1.0 + 0.4 * t);
        Vec3::new(out * turn.cos(), height - 1.8 * t * t, out * turn.sin())
    };
    let points = (0..STRANDS).flat_map(|i| (0..POINTS).map(move |j| place(i, j))).collect();
    let counts = vec![POINTS; STRANDS as usize];
    let (thick, opacity, white) =
        (Varying::Same(0.004), Varying::Same(0.356), Varying::Same(Vec3::ONE));
    let strands = Strands::new("made up", points, &counts, thick, opacity, white).unwrap();
    Surface::new(Shape::Strands(strands.into()), DMat4::IDENTITY).unwrap()
}

/// The scene of a file, or of made-up hair, and its name.
pub fn scene() -> (String, Scene, Settings) {
    let path = std::env::var_os("DEEPSHADOW_BENCH_HAIR").map(PathBuf::from);
    let (name, text) = match &path {
        Some(path) => {
            let name = path.display().to_string();
            (name.clone(), format!("[[hair]]\npath = {name:?}\n"))
        }
        None => ("strands on a ball".to_owned(), String::new()),
    };
    let file = SceneFile::parse(&text, Path::new("scene.toml")).unwrap();
    let surfaces = match path {
        Some(_) => load_surfaces(&file).unwrap().0,
        None => vec![made_up()].into(),
    };
    let loaded = Loaded { volumes: Vec::new(), surfaces };
    let (scene, settings, _) = complete(&file, loaded, Surroundings::Studio).unwrap();
    (name, scene, settings)
}

/// A map's passes, with everything that they bind.
pub struct Lit<'a> {
    gpu: &'a Renderer,
    pub media: GpuMedia,
    surfaces: GpuSurfaces,
    frame: GpuFrame,
    lists: GpuLists,
    pub fragments: GpuFragments,
    drawn: u64,
}

impl<'a> Lit<'a> {
    /// `None` if the device has not that much memory.
    pub fn new(gpu: &'a Renderer, beam: &Beam, settings: &Settings) -> Option<Self> {
        let media = gpu.upload(&beam.media).unwrap();
        let surfaces = gpu.upload_surfaces(&FrameSurfaces::of(beam.casters())).unwrap();
        let frame = gpu.frame(&Frame::new(beam, settings).unwrap(), &media).unwrap();
        let size = settings.map.size;
        let lists = gpu.lists(surfaces.over(Tile::rows(size, 0, size, 1)));
        gpu.submit(|encoder| gpu.raster_surfaces(encoder, &surfaces, &frame, &lists)).unwrap();
        let drawn = gpu.fragments_drawn(&lists).unwrap();
        let lists = gpu.lists(surfaces.over(Tile::rows(size, 0, size, drawn as u32)));
        let mut nodes = 32;
        loop {
            let fragments = gpu.fragments(Tile::rows(size, 0, size, nodes)).ok()?;
            let surfaces = surfaces.clone();
            let (media, frame, lists) = (media.clone(), frame.clone(), lists.clone());
            let lit = Self { gpu, media, surfaces, frame, lists, fragments, drawn };
            gpu.submit(|encoder| {
                lit.raster(encoder);
                lit.sort_and_fit(encoder);
                Ok(())
            })
            .unwrap();
            match gpu.nodes_missing(&lit.fragments).unwrap() {
                Some(needed) => nodes = needed,
                None => return Some(lit),
            }
        }
    }

    pub fn raster(&self, encoder: &mut wgpu::CommandEncoder) {
        self.gpu.raster_surfaces(encoder, &self.surfaces, &self.frame, &self.lists).unwrap();
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        self.gpu.draw_surfaces(encoder, &self.surfaces, &self.frame, &self.lists).unwrap();
    }

    fn sort(&self, encoder: &mut wgpu::CommandEncoder) {
        self.gpu.sort_surfaces(encoder, &self.lists).unwrap();
    }

    pub fn sort_and_fit(&self, encoder: &mut wgpu::CommandEncoder) {
        self.sort(encoder);
        self.gpu
            .prepare_casters(&self.media, &self.lists, &self.frame, &self.fragments)
            .record(encoder)
            .unwrap();
    }
}

/// Prints the table of hair.
pub fn table(gpu: &Gpu) {
    let (name, scene, settings) = scene();
    let clock = Clock::new(gpu);
    let beam = scene.only_beam().unwrap();
    println!("\nHair: {name}. ms, {}", clock.method());
    println!(
        "| map | fragments | nodes a texel, at most | raster_surfaces | sort_surfaces | fit | together | link_neighbors | draw_surfaces |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for size in SIZES {
        for tolerance in [settings.map.fragments.tolerance, 0.0] {
            let settings = settings.with(|s| {
                s.map.kind = Some(MapKind::Fragments);
                s.map.size = size;
                s.map.fragments.tolerance = tolerance;
            });
            let Some(lit) = Lit::new(&gpu.renderer, &beam, &settings) else { continue };
            let [raster, sorted, all, linked, drawn] = clock.interleaved([
                &|encoder| lit.raster(encoder),
                &|encoder| {
                    lit.raster(encoder);
                    lit.sort(encoder);
                },
                &|encoder| {
                    lit.raster(encoder);
                    lit.sort_and_fit(encoder);
                },
                &|encoder| {
                    lit.raster(encoder);
                    lit.sort_and_fit(encoder);
                    gpu.renderer.link_neighbors(encoder, lit.fragments.clone()).unwrap();
                },
                &|encoder| lit.draw(encoder),
            ]);
            let runs = gpu.renderer.read_fragments(&lit.fragments).unwrap();
            let most = runs.starts().windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
            let mean = runs.nodes().len() as f64 / runs.texels() as f64;
            println!(
                "| {size}^2, {tolerance} | {} | {mean:.1}, {most} | {raster:.3} | {:.3} | {:.3} | {all:.3} | {:.3} | {drawn:.3} |",
                lit.drawn,
                sorted - raster,
                all - sorted,
                linked - all,
            );
        }
    }
}
