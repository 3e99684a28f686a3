//! Pictures of hair: what pixels see of it, lit without and with shadows, by filter.

use deepshadow::frame::{Frame, FrameLooks};
use deepshadow::gpu::{GpuFragments, GpuImage, GpuLists, GpuLooks, Prepared, Renderer, Tile};
use deepshadow::scene::Beam;
use deepshadow::settings::{Filter, MapKind, Settings};

use crate::clock::Clock;
use crate::device::Gpu;
use crate::hair::{Lit, scene};

/// Texels of the map, sizes of pictures, and rays of each of their pixels.
const MAP: u32 = 512;
const PICTURES: [[u32; 2]; 2] = [[1280, 720], [1920, 1080]];
const RAYS: [u32; 2] = [1, 8];

/// What pixels see, and the picture.
struct Seen<'a> {
    gpu: &'a Renderer,
    lit: &'a Lit<'a>,
    beam: &'a Beam,
    settings: Settings,
    looks: GpuLooks,
    lists: GpuLists,
    image: GpuImage,
}

impl<'a> Seen<'a> {
    /// `None` if the device has not that much memory in a buffer. Without `shadows` none are looked
    /// up.
    fn new(
        gpu: &'a Renderer,
        lit: &'a Lit<'a>,
        beam: &'a Beam,
        settings: &Settings,
        shadows: bool,
    ) -> Option<Self> {
        let [width, height] = settings.image.size;
        let mut looks = FrameLooks::of(beam.casters());
        looks.coats.iter_mut().for_each(|coat| coat.receives = shadows);
        let looks = gpu.upload_looks(&looks, settings.image.samples).ok()?;
        let tile = |capacity: u32| Tile {
            origin: [0, 0],
            extent: [width, height],
            ..Tile::rows(width, 0, 0, capacity)
        };
        let image = gpu.image(width, height).ok()?;
        let made = |capacity: u32| {
            let lists = gpu.seen(looks.over(tile(capacity)));
            let (looks, image) = (looks.clone(), image.clone());
            let settings = settings.clone();
            Self { gpu, lit, beam, settings, looks, lists, image }
        };
        let first = made(1);
        gpu.submit(|encoder| {
            first.raster(encoder);
            Ok(())
        })
        .unwrap();
        let needed = gpu.fragments_drawn(&first.lists).unwrap();
        (needed * 56 < 1 << 31).then(|| made(needed as u32))
    }

    fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let frame = Frame::new(self.beam, &self.settings).unwrap().from_camera();
        let frame = self.gpu.frame(&frame, &self.lit.media).unwrap();
        self.gpu.raster_view(encoder, &self.looks, &frame, &self.lists).unwrap();
    }

    fn raster(&self, encoder: &mut wgpu::CommandEncoder) {
        self.draw(encoder);
        self.gpu.sort_view(encoder, &self.lists).unwrap();
    }

    /// The march with a filter, along links if there are some and `follows` says so.
    fn march(&self, map: &GpuFragments, filter: Filter, follows: bool) -> Prepared {
        let settings = self.settings.with(|s| s.map.filter = filter);
        let mut frame = Frame::new(self.beam, &settings).unwrap();
        frame.map.follows_links = u32::from(follows && map.linked());
        let frame = self.gpu.frame(&frame, &self.lit.media).unwrap();
        let seen = (&self.looks, &self.lists);
        self.gpu.prepare_surfaces((&self.lit.media, &frame), map, seen, &self.image)
    }
}

fn linked(gpu: &Renderer, lit: &Lit<'_>) -> GpuFragments {
    let mut made = None;
    gpu.submit(|encoder| {
        lit.raster(encoder);
        lit.sort_and_fit(encoder);
        made = Some(gpu.link_neighbors(encoder, lit.fragments.clone())?);
        Ok(())
    })
    .unwrap();
    made.unwrap()
}

/// Prints the tables of pictures of hair.
pub fn table(gpu: &Gpu) {
    let (name, scene, settings) = scene();
    let (renderer, clock) = (&gpu.renderer, Clock::new(gpu));
    let beam = scene.only_beam().unwrap();
    println!("\nPictures of hair: {name}, map of {MAP}^2. ms, {}", clock.method());
    for (tolerance, truncation) in [(0.002, 0.0), (0.0, 0.0), (0.0, 0.001)] {
        let settings = settings.with(|s| {
            s.map.kind = Some(MapKind::Fragments);
            s.map.size = MAP;
            s.map.fragments.tolerance = tolerance;
            s.map.fragments.truncation = truncation;
        });
        let Some(lit) = Lit::new(renderer, &beam, &settings) else { continue };
        let map = linked(renderer, &lit);
        println!("\nTolerance {tolerance}, truncation {truncation}");
        println!(
            "| picture, rays | map | raster_view | sort_view | march without shadows | DSM | DSM 3 \
             | DSM 7 | along links | EDSM 5 | along links |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        for (size, rays) in PICTURES.into_iter().flat_map(|size| RAYS.map(|rays| (size, rays))) {
            let settings = settings.with(|s| (s.image.size, s.image.samples) = (size, rays));
            let new = |shadows: bool| Seen::new(renderer, &lit, &beam, &settings, shadows);
            let (Some(bare), Some(seen)) = (new(false), new(true)) else { continue };
            let targets = |encoder: &mut _| seen.raster(encoder);
            // Marches light strands once for each list, so lists are made anew.
            let unlit = bare.march(&map, Filter::Bilinear, false);
            let marches = [
                (Filter::Bilinear, false),
                (Filter::Pcf3, false),
                (Filter::Pcf7, false),
                (Filter::Pcf7, true),
                (Filter::Edsm5, false),
                (Filter::Edsm5, true),
            ]
            .map(|(filter, follows)| seen.march(&map, filter, follows));
            let with = |encoder: &mut _, march: &Prepared| {
                seen.raster(encoder);
                march.record(encoder).unwrap();
            };
            let [lists, drawn, targets, unlit, a, b, c, d, e, f] = clock.interleaved([
                &|encoder| {
                    lit.raster(encoder);
                    lit.sort_and_fit(encoder);
                },
                &|encoder| seen.draw(encoder),
                &targets,
                &|encoder| {
                    bare.raster(encoder);
                    unlit.record(encoder).unwrap();
                },
                &|encoder| with(encoder, &marches[0]),
                &|encoder| with(encoder, &marches[1]),
                &|encoder| with(encoder, &marches[2]),
                &|encoder| with(encoder, &marches[3]),
                &|encoder| with(encoder, &marches[4]),
                &|encoder| with(encoder, &marches[5]),
            ]);
            let lookups = [a, b, c, d, e, f].map(|ms| format!("{:.3}", ms - unlit)).join(" | ");
            println!(
                "| {} x {}, {rays} | {lists:.3} | {drawn:.3} | {:.3} | {:.3} | {lookups} |",
                size[0],
                size[1],
                targets - drawn,
                unlit - targets
            );
        }
    }
}
