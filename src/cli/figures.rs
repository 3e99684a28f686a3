//! Command `figures`: draws the paper's figures 2, 3 and 4 from the presets, as labelled contact
//! sheets, and those of the hair paper from models that the user names.

use std::path::PathBuf;

use clap::Args;

use super::backend::{BackendChoice, Opening};
use super::hair_figures::{self, Model};
use super::progress::Bars;
use super::say;
use super::sheet::Sheet;
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::image::Image;
use crate::io::output::{Inputs, MadeFolder, PendingFile};
use crate::io::{load_volume, png};
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Surroundings, complete};
use crate::scene::{Scene, descriptor};
use crate::settings::{Crossing, Lookup, MapKind, Settings, Shading};
use crate::shadow::{Map, TexelMap, ThresholdMap};
use crate::volume::presets::Preset;

/// Width and height in pixels of each picture on a sheet.
const CELL: u32 = 320;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Folder to write figure-2.png, figure-3.png, figure-4.png and more to; created if missing.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Also draw figures 1.1, 1.2 and 1.6 of "Real-Time Deep Shadow Maps" (hair-figure-1.1.png and so
    /// on) and measure its table 1.1 (hair-table-1.1.csv) on the CPU, with this model of hair. May be
    /// repeated: all are in figure 1.1, the others show the first.
    #[arg(long, value_name = "FILE")]
    hair: Vec<PathBuf>,
    /// Where to compute the figures of the presets: auto, gpu or cpu.
    #[arg(long, default_value = "auto", value_parser = |text: &str| text.parse::<BackendChoice>().map_err(|e| e.to_string()))]
    backend: BackendChoice,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let folder = &arguments.out;
    let _made = MadeFolder::create(folder)?;
    let inputs = Inputs::new(arguments.hair.iter().cloned());
    let mut models = Vec::new();
    for path in &arguments.hair {
        let (model, notes) = Model::of(path)?;
        models.push(model);
        notes.iter().filter(|_| !arguments.quiet).for_each(|note| say(note));
    }
    let progress: Box<dyn Progress> =
        if arguments.quiet { Box::new(Silent) } else { Box::new(Bars::default()) };
    let tell: fn(&str) = if arguments.quiet { |_| () } else { say };
    let painter = Painter {
        backend: Opening::begin(arguments.backend, None).finish(None, false, tell)?,
        progress,
    };
    let [cube, bucky, rods, clouds] = Preset::ALL.map(|preset| preset_scene(preset, true));
    let (cube, bucky, rods, clouds) = (cube?, bucky?, rods?, clouds?);
    let floating_cube = preset_scene(Preset::Box, false)?;

    let all = [&cube, &bucky, &rods, &clouds];
    let figures: [(&str, Draw<'_>); 3] = [
        ("figure-2.png", &|| painter.maps(&all)),
        ("figure-3.png", &|| painter.shading(&floating_cube)),
        ("figure-4.png", &|| painter.ground_shadows(&[&rods, &bucky, &cube])),
    ];
    let write = |name: &str, by: &dyn Backend, draw: &dyn Fn() -> Result<Vec<u8>>| -> Result<()> {
        let path = folder.join(name);
        let file = PendingFile::create(&path, &inputs)?;
        file.finish_with(&draw()?)?;
        if !arguments.quiet {
            say(&format!("wrote {}, {}", path.display(), by.description()));
        }
        Ok(())
    };
    for (name, draw) in figures {
        write(name, painter.backend, &|| encoded(draw()?))?;
    }
    let progress = &*painter.progress;
    if let Some(first) = models.first() {
        let draw = |name, draw: Draw<'_>| write(name, &CpuBackend, &|| encoded(draw()?));
        draw("hair-figure-1.1.png", &|| hair_figures::models(&models, progress))?;
        draw("hair-figure-1.2.png", &|| hair_figures::texel(first, progress))?;
        draw("hair-figure-1.6.png", &|| hair_figures::filters(first, progress))?;
        write("hair-table-1.1.csv", &CpuBackend, &|| {
            Ok(hair_figures::table(first, progress)?.into_bytes())
        })?;
    }
    Ok(())
}

/// A sheet as a PNG file.
fn encoded(sheet: Sheet) -> Result<Vec<u8>> {
    let (width, height, rgb) = sheet.into_rgb();
    png::encode_rgb(width, height, &rgb)
}

/// A preset as in the paper: without ambient light, on its ground.
struct PresetScene {
    name: &'static str,
    scene: Scene,
    settings: Settings,
}

fn preset_scene(preset: Preset, ground: bool) -> Result<PresetScene> {
    let mut file = descriptor(preset)?;
    file.ground.enabled = Some(ground);
    file.shadow.map = Some(MapKind::Threshold.to_string());
    file.image.width = Some(CELL);
    file.image.height = Some(CELL);
    let volume = load_volume(&file.volume[0])?;
    let (scene, settings, _) = complete(&file, vec![volume.into()], Surroundings::Void)?;
    let settings = settings.with(|s| {
        s.map.threshold.lookup = Lookup::Paper;
        s.map.threshold.crossing = Crossing::Smoothstep;
        s.view.shading = Shading::Paper;
    });
    Ok(PresetScene { name: preset.name(), scene, settings })
}

impl PresetScene {
    /// A map without any shadow, as of a medium without extinction.
    fn clear_map(&self) -> Result<Map> {
        let beam = self.scene.only_beam()?;
        let frame = Frame::new(&beam, &self.settings)?;
        let empty = vec![[0.0; 4]; self.settings.map.size.pow(2) as usize];
        Ok(Map::Threshold(ThresholdMap::new(empty, &self.settings, beam.view, &frame)))
    }
}

type Draw<'a> = &'a dyn Fn() -> Result<Sheet>;

struct Painter {
    backend: &'static dyn Backend,
    progress: Box<dyn Progress>,
}

impl Painter {
    /// Figure 2: one row per volume, with the whole map and its four channels.
    fn maps(&self, scenes: &[&PresetScene]) -> Result<Sheet> {
        let mut sheet = Sheet::new(5, scenes.len() as u32, [CELL; 2]);
        for (row, preset) in scenes.iter().enumerate() {
            let row = row as u32;
            let map = self.map(preset)?;
            let scaled = scaled_channels(&map, &preset.scene);
            sheet.put(0, row, &shrunk(&scaled, map.size(), |t| [t[0], t[1], t[2]]), preset.name);
            let labels = ["depth at 10 %", "depth at 50 %", "depth at 90 %", "maximum opacity"];
            for (c, label) in labels.into_iter().enumerate() {
                let channel = shrunk(&scaled, map.size(), |t| [t[c]; 3]);
                sheet.put(c as u32 + 1, row, &channel, label);
            }
        }
        Ok(sheet)
    }

    /// Figure 3: the volume without shadow, with shadow, and the opacity that was looked up.
    fn shading(&self, preset: &PresetScene) -> Result<Sheet> {
        let scene = &preset.scene;
        let shadowed = self.picture(scene, &preset.settings)?;
        let unshadowed = self.picture_through(scene, &preset.settings, &preset.clear_map()?)?;
        let mut opacity = unshadowed.clone();
        for (pixel, dark) in opacity.pixels.iter_mut().zip(&shadowed.pixels) {
            let average = if pixel[0] > 0.0 { 1.0 - dark[0] / pixel[0] } else { 0.0 };
            *pixel = [average, average, average, 1.0];
        }
        let mut sheet = Sheet::new(3, 1, [CELL; 2]);
        sheet.put(0, 0, &unshadowed.to_srgb8(1.0), "unshadowed");
        sheet.put(1, 0, &shadowed.to_srgb8(1.0), "shadowed");
        sheet.put(2, 0, &opacity.to_srgb8(1.0), "opacity from the map");
        Ok(sheet)
    }

    /// Figure 4: shadows on the ground from the maximum opacity.
    fn ground_shadows(&self, scenes: &[&PresetScene]) -> Result<Sheet> {
        let mut sheet = Sheet::new(scenes.len() as u32, 1, [CELL; 2]);
        for (column, preset) in scenes.iter().enumerate() {
            let picture = self.picture(&preset.scene, &preset.settings)?;
            sheet.put(column as u32, 0, &picture.to_srgb8(1.0), preset.name);
        }
        Ok(sheet)
    }

    /// The paper's map.
    fn map(&self, preset: &PresetScene) -> Result<ThresholdMap> {
        match self.backend.map(&preset.scene.only_beam()?, &preset.settings, &*self.progress)? {
            Map::Threshold(map) => Ok(map),
            _ => Err(Error::value("map", "figures show threshold maps")),
        }
    }

    fn picture(&self, scene: &Scene, settings: &Settings) -> Result<Image> {
        self.backend.render(scene, settings, &*self.progress)
    }

    fn picture_through(&self, scene: &Scene, settings: &Settings, map: &Map) -> Result<Image> {
        self.backend.view(&scene.only_beam()?, settings, map, &*self.progress)
    }
}

/// The map's channels as the paper draws them. Depths begin at the volume, and brighter is deeper;
/// unset channels and empty texels are black; opacity is unchanged.
fn scaled_channels(map: &ThresholdMap, scene: &Scene) -> Vec<[f32; 4]> {
    let [near, far] = depth_range(map, scene);
    let thresholds = map.thresholds().map(|t| t as f32);
    let scaled = |texel: &[f32; 4]| {
        let depth = |c: usize| {
            let set = texel[3] >= thresholds[c];
            if set { ((texel[c] - near) / (far - near)).clamp(0.0, 1.0) } else { 0.0 }
        };
        [depth(0), depth(1), depth(2), texel[3]]
    };
    map.texels().iter().map(scaled).collect()
}

fn depth_range(map: &ThresholdMap, scene: &Scene) -> [f32; 2] {
    let corners = scene.media.world_corners();
    let depths = corners.iter().filter_map(|&c| map.view().coordinates(c)).map(|c| c.z as f32);
    depths.fold([f32::MAX, f32::MIN], |[near, far], depth| [near.min(depth), far.max(depth)])
}

/// `CELL` x `CELL` pixels of RGBA from a square map; each is the mean of the texels that it covers.
/// Values are shown directly, without sRGB encoding.
fn shrunk(texels: &[[f32; 4]], size: u32, colour: impl Fn(&[f32; 4]) -> [f32; 3]) -> Vec<u8> {
    let span = |i: u32| {
        let (from, to) = (i * size / CELL, ((i + 1) * size).div_ceil(CELL));
        from..to.clamp(from + 1, size)
    };
    let mut rgba = Vec::with_capacity(4 * (CELL * CELL) as usize);
    for y in 0..CELL {
        for x in 0..CELL {
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for row in span(y) {
                for column in span(x) {
                    let texel = &texels[(row * size + column) as usize];
                    for (sum, c) in sum.iter_mut().zip(colour(texel)) {
                        *sum += c;
                    }
                    count += 1.0;
                }
            }
            rgba.extend(sum.map(|c| (c / count * 255.0).round() as u8));
            rgba.push(255);
        }
    }
    rgba
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// The figures' pictures are small, but their maps are those of the paper.
    #[test]
    fn maps_of_figures_are_as_large_as_the_papers() {
        let figure = preset_scene(Preset::Box, false).unwrap();
        assert_eq!(figure.settings.map.size, 512);
        assert_eq!(figure.settings.map.kind, Some(MapKind::Threshold));
    }
}
