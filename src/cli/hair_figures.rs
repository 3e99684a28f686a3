//! Figures 1.1, 1.2 and 1.6 and table 1.1 of "Real-Time Deep Shadow Maps", for models of hair that
//! the user names: none is part of the program.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use super::sheet::Sheet;
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::io::load_surfaces;
use crate::progress::{Progress, Silent};
use crate::scene::automatic::{Loaded, Surroundings, complete};
use crate::scene::{Beam, Scene, SceneFile};
use crate::settings::{Filter, MapKind, Settings};
use crate::shadow::{Map, Shadow, TexelMap};

/// Width and height in pixels of each picture.
const CELL: u32 = 480;
/// The table's picture, and its maps' sizes.
const TABLE_PICTURE: [u32; 2] = [1280, 720];
const TABLE_SIZES: [u32; 3] = [256, 512, 768];
/// The table's columns. A binary shadow map keeps the depth of the first fragment, here with the
/// opacity of all.
const COLUMNS: [(&str, &str, Filter); 7] = [
    ("SM", "peeling:1", Filter::Nearest),
    ("DSM", "fragments", Filter::Nearest),
    ("DSM3", "fragments", Filter::Pcf3),
    ("DSM5", "fragments", Filter::Pcf5),
    ("EDSM", "fragments", Filter::Edsm),
    ("EDSM3", "fragments", Filter::Edsm3),
    ("EDSM5", "fragments", Filter::Edsm5),
];

/// A model under the automatic light.
pub(super) struct Model {
    name: String,
    scene: Scene,
    settings: Settings,
}

impl Model {
    /// The hair in the file `path`, and what there is to say of it.
    pub(super) fn of(path: &Path) -> Result<(Self, Vec<String>)> {
        let mut file = SceneFile::default();
        file.hair.one_mut().path = Some(path.to_owned());
        (file.image.width, file.image.height) = (Some(CELL), Some(CELL));
        let (surfaces, notes) = load_surfaces(&file)?;
        let loaded = Loaded { surfaces, ..Loaded::default() };
        let (scene, settings, _) = complete(&file, loaded, Surroundings::Studio)?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
        Ok((Self { name, scene, settings }, notes))
    }

    fn picture(&self, settings: &Settings, progress: &dyn Progress) -> Result<Vec<u8>> {
        Ok(CpuBackend.render(&self.scene, settings, progress)?.to_srgb8(1.0))
    }
}

/// Figure 1.1: the models.
pub(super) fn models(models: &[Model], progress: &dyn Progress) -> Result<Sheet> {
    let mut sheet = Sheet::new(models.len() as u32, 1, [CELL; 2]);
    for (column, model) in models.iter().enumerate() {
        sheet.put(column as u32, 0, &model.picture(&model.settings, progress)?, &model.name);
    }
    Ok(sheet)
}

/// Figure 1.2: transmittance over depth in one texel, as a shadow map and as a deep one keep it; the
/// former puts the opacity of all where the first fragment is. The
/// texel is the one with the most nodes.
pub(super) fn texel(model: &Model, progress: &dyn Progress) -> Result<Sheet> {
    let beam = model.scene.only_beam()?;
    let kinds = ["peeling:1", "fragments"].map(|kind| {
        let kind = Some(kind.parse::<MapKind>()?);
        CpuBackend.map(&beam, &model.settings.with(|s| s.map.kind = kind), progress)
    });
    let [shallow, deep] = kinds;
    let (shallow, deep) = (shallow?, deep?);
    let Some(lists) = deep.as_fragments() else {
        return Err(Error::value("map", "figures show fragment maps"));
    };
    let size = lists.size();
    let texels = (0..size).flat_map(|y| (0..size).map(move |x| [x, y]));
    let fullest = texels.max_by_key(|&[x, y]| lists.nodes(x, y).len()).unwrap_or_default();
    let nodes = lists.nodes(fullest[0], fullest[1]);
    let ends = [nodes.first(), nodes.last()].map(|node| node.map_or(0.0, |node| node.depth));
    // There may be a single fragment.
    let margin = (0.1 * (ends[1] - ends[0])).max(1e-3 * ends[1].abs()).max(f32::MIN_POSITIVE);
    let mut sheet = Sheet::new(2, 1, [CELL; 2]);
    for (column, (map, label)) in
        [(&shallow, "shadow map: all at the first"), (&deep, "deep shadow map")]
            .into_iter()
            .enumerate()
    {
        let at = |share: f32| {
            let depth = ends[0] - margin + share * (ends[1] - ends[0] + 2.0 * margin);
            map.texels().map_or(1.0, |map| map.texel_transmittance(fullest[0], fullest[1], depth))
        };
        sheet.put(column as u32, 0, &curve(at), label);
    }
    Ok(sheet)
}

/// `CELL` x `CELL` pixels of RGBA with a function of 0..1 over 0..1, dark below it.
fn curve(at: impl Fn(f32) -> f32) -> Vec<u8> {
    let columns: Vec<f32> = (0..CELL).map(|x| at((x as f32 + 0.5) / CELL as f32)).collect();
    let pixel = |x: u32, y: u32| {
        let height = 1.0 - (y as f32 + 0.5) / CELL as f32;
        // A twentieth of the picture stays free above 1.
        let below = height / 0.95 <= columns[x as usize];
        let grid = (10.0 * height / 0.95).fract() < 10.0 / CELL as f32;
        match (below, grid) {
            (true, false) => [70, 130, 180, 255],
            (true, true) => [80, 145, 195, 255],
            (false, true) => [52, 52, 52, 255],
            (false, false) => [36, 36, 36, 255],
        }
    };
    (0..CELL).flat_map(|y| (0..CELL).flat_map(move |x| pixel(x, y))).collect()
}

/// Figure 1.6: a model without filter, with percentage-closer filtering and with exponential tests.
pub(super) fn filters(model: &Model, progress: &dyn Progress) -> Result<Sheet> {
    let filters = [
        ("no filter", Filter::Nearest),
        ("PCF, 5 x 5", Filter::Pcf5),
        ("EDSM, 5 x 5", Filter::Edsm5),
    ];
    let mut sheet = Sheet::new(filters.len() as u32, 1, [CELL; 2]);
    for (column, (label, filter)) in filters.into_iter().enumerate() {
        // As coarse as the paper's maps are, so that the difference shows.
        let settings = model.settings.with(|s| (s.map.filter, s.map.size) = (filter, 256));
        sheet.put(column as u32, 0, &model.picture(&settings, progress)?, label);
    }
    Ok(sheet)
}

/// Table 1.1 as lines of CSV: for each map size and method the milliseconds of the map (its links
/// included) and of the picture at 1280 x 720, one ray a pixel, and frames a second.
pub(super) fn table(model: &Model, progress: &dyn Progress) -> Result<String> {
    let mut csv = "map_size,method,map_ms,picture_ms,frames_per_second\n".to_owned();
    progress.begin("table", (TABLE_SIZES.len() * COLUMNS.len()) as u64);
    let beam = model.scene.only_beam()?;
    for size in TABLE_SIZES {
        for (name, kind, filter) in COLUMNS {
            let settings = model.settings.with(|s| {
                (s.map.size, s.map.filter) = (size, filter);
                (s.image.size, s.image.samples) = (TABLE_PICTURE, 1);
                s.map.fragments.links = Some(true);
            });
            let kind = Some(kind.parse::<MapKind>()?);
            let [map, picture] = timed(&beam, &settings.with(|s| s.map.kind = kind))?;
            let rate = 1000.0 / (map + picture);
            let _ = writeln!(csv, "{size},{name},{map:.1},{picture:.1},{rate:.2}");
            progress.advance(1);
        }
    }
    Ok(csv)
}

/// Milliseconds of a map and of the picture through it.
fn timed(beam: &Beam, settings: &Settings) -> Result<[f64; 2]> {
    let begun = Instant::now();
    let map: Map = CpuBackend.map(beam, settings, &Silent)?;
    map.prepare();
    let built = begun.elapsed().as_secs_f64();
    let frame = Frame::new(beam, settings)?;
    let begun = Instant::now();
    CpuBackend.march_view_through(beam.casters(), &frame, &map, &Silent)?;
    Ok([built, begun.elapsed().as_secs_f64()].map(|seconds| 1000.0 * seconds))
}
