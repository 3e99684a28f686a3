//! Collects what `info` reports, independently of the output format.

use std::path::{Path, PathBuf};

use glam::DMat4;
use serde_json::Value as Json;

use super::deep::DeepReport;
use super::json;
use super::surface::SurfaceReport;
use crate::cli::say;
use crate::error::{Error, Result};
use crate::io::dense::DenseFile;
use crate::io::format::Format;
use crate::io::json::number;
use crate::io::number::ValueType;
use crate::io::vdb::{GridHeader, Statistics, SurveyDepth, Transform, VdbFile};
use crate::io::{FiniteRange, Histogram, ReadOptions};
use crate::volume::presets::Preset;
use crate::volume::{Axis, Volume};

/// A file and its grids.
pub(super) struct Report {
    pub path: PathBuf,
    /// The format's name, or `preset`.
    pub format: &'static str,
    pub metadata: Vec<(String, Json)>,
    /// Why the list of grids may be incomplete.
    pub unreachable: Option<String>,
    pub grids: Vec<GridReport>,
    /// The report on a deep image, which has no grids.
    pub deep: Option<DeepReport>,
    /// The report on hair or a mesh, which has no grids.
    pub surface: Option<SurfaceReport>,
}

/// A grid; `None` for what is not known.
pub(super) struct GridReport {
    pub name: String,
    pub value_type: String,
    pub class: String,
    /// Why its voxels cannot be read.
    pub refused: Option<String>,
    pub active_voxels: Option<u64>,
    /// Lowest and highest index, inclusive.
    pub active_bounds: Option<[[i64; 3]; 2]>,
    pub background: Json,
    pub world_from_index: Option<DMat4>,
    /// One per component.
    pub statistics: Vec<Statistics>,
    pub histogram: Option<Histogram>,
    pub metadata: Vec<(String, Json)>,
    pub compression: String,
    pub file_bytes: u64,
    pub memory_bytes: Option<u64>,
}

const BINS: usize = 16;

impl Report {
    /// Examines the file `path`, including values if `statistics`, and with a histogram if
    /// `histograms`.
    pub(super) fn of(
        path: &Path,
        options: &ReadOptions,
        statistics: bool,
        histograms: bool,
    ) -> Result<Self> {
        let format = options.format_of(path)?;
        let mut report = Self {
            path: path.to_owned(),
            format: format.name(),
            metadata: Vec::new(),
            unreachable: None,
            grids: Vec::new(),
            deep: None,
            surface: None,
        };
        match format {
            Format::OpenVdb => {
                report.fill_from_vdb(options, statistics, statistics && histograms)?;
            }
            Format::DeepExr => {
                let deep = DeepReport::of(path, options.max_bytes, statistics)?;
                report.metadata = deep.metadata();
                report.deep = Some(deep);
            }
            _ if format.is_surface() => {
                let what = format!("{} (format {})", path.display(), format.name());
                options.refuse(&what, &["dims", "type", "endian", "spacing", "grid", "class"])?;
                report.surface = Some(SurfaceReport::of(path, format, options.max_bytes)?);
            }
            _ => {
                let file = DenseFile::open(path, format, options)?;
                for note in &file.header().notes {
                    say(note);
                }
                let grid = GridReport::of_dense(&file, statistics, statistics && histograms)?;
                report.grids.push(grid);
            }
        }
        Ok(report)
    }

    /// Examines a volume that the program makes.
    pub(super) fn of_preset(
        preset: Preset,
        options: &ReadOptions,
        values: bool,
        histograms: bool,
    ) -> Result<Self> {
        let keys = ["dims", "type", "endian", "spacing", "grid", "from", "class"];
        options.refuse("a preset", &keys)?;
        let volume = preset.volume(Axis::default())?;
        Ok(Self {
            path: preset.name().into(),
            format: "preset",
            metadata: Vec::new(),
            unreachable: None,
            grids: vec![GridReport::of_volume(&volume, values, values && histograms)],
            deep: None,
            surface: None,
        })
    }

    fn fill_from_vdb(
        &mut self,
        options: &ReadOptions,
        values: bool,
        histograms: bool,
    ) -> Result<()> {
        let file = VdbFile::open(&self.path)?;
        self.metadata = json::metadata(file.metadata());
        self.unreachable = file.unreachable().map(str::to_owned);
        let wanted = match &options.grid {
            Some(name) => {
                let found = file.find(name);
                let missing = || Error::contents(&self.path, format!("no grid '{name}'"));
                let index = found.ok_or_else(missing)?;
                index..index + 1
            }
            None => 0..file.grids().len(),
        };
        for index in wanted {
            self.grids.push(GridReport::of_vdb(&file, index, values, histograms)?);
        }
        Ok(())
    }
}

impl GridReport {
    fn of_vdb(file: &VdbFile, index: usize, values: bool, histogram: bool) -> Result<Self> {
        let header: &GridHeader = &file.grids()[index];
        let mut report = Self {
            name: header.name.clone(),
            value_type: header.value_type.name().to_owned(),
            class: header.class().to_owned(),
            refused: header.refused.clone(),
            active_voxels: None,
            active_bounds: None,
            background: header.background.map_or(Json::Null, json::value),
            world_from_index: match &header.transform {
                Transform::Affine(matrix) => Some(*matrix),
                Transform::Refused(_) => None,
            },
            statistics: Vec::new(),
            histogram: None,
            metadata: json::metadata(&header.metadata),
            compression: header.compression.to_string(),
            file_bytes: header.file_bytes,
            memory_bytes: None,
        };
        if header.refused.is_some() {
            return Ok(report);
        }
        let depth = match (values, histogram) {
            (_, true) => SurveyDepth::Histogram(BINS),
            (true, false) => SurveyDepth::Values,
            (false, false) => SurveyDepth::Topology,
        };
        let survey = file.survey(index, depth)?;
        report.active_voxels = Some(survey.active_voxels);
        report.active_bounds = survey
            .active_bounds
            .map(|bounds| [bounds.min, bounds.max].map(|corner| corner.to_array().map(i64::from)));
        report.memory_bytes = Some(survey.memory_bytes);
        report.statistics = survey.statistics;
        report.histogram = survey.histogram;
        Ok(report)
    }

    /// A dense volume in memory.
    fn of_volume(volume: &Volume, values: bool, with_histogram: bool) -> Self {
        let count = volume.dims().into_iter().map(|n| n as u64).product();
        let mut tally = Tally::default();
        let mut range = FiniteRange::default();
        let visit = |add: &mut dyn FnMut(f32, u64)| {
            let mut held = 0;
            volume.voxels().for_each_held(|part, value| {
                held += part.voxels() as u64;
                add(value, part.voxels() as u64);
            });
            add(0.0, count - held);
        };
        visit(&mut |value, count| {
            if count > 0 {
                tally.add_several(value.into(), count);
                range.add(value);
            }
        });
        let histogram = range.0.filter(|_| with_histogram).map(|range| {
            let mut histogram = Histogram::new(range, BINS);
            visit(&mut |value, count| histogram.add(value, count));
            histogram
        });
        let bytes = volume.voxels().bytes() as u64;
        Self {
            name: volume.name.clone(),
            value_type: ValueType::F32.name().to_owned(),
            class: "dense".to_owned(),
            refused: None,
            active_voxels: Some(count),
            active_bounds: Some([[0; 3], volume.dims().map(|n| n as i64 - 1)]),
            background: Json::Null,
            world_from_index: Some(*volume.world_from_index()),
            statistics: if values { vec![tally.statistics()] } else { Vec::new() },
            histogram,
            metadata: Vec::new(),
            compression: "none".to_owned(),
            file_bytes: 0,
            memory_bytes: Some(bytes),
        }
    }

    fn of_dense(file: &DenseFile, values: bool, with_histogram: bool) -> Result<Self> {
        let header = file.header();
        let lengths = header.dims.map(|n| n as u64);
        let text = |(key, value): &(String, String)| (key.clone(), Json::from(value.as_str()));
        let mut report = Self {
            name: file.name(),
            value_type: match header.components {
                1 => header.value_type.name().to_owned(),
                count => format!("{} x {count}", header.value_type.name()),
            },
            class: "dense".to_owned(),
            refused: None,
            active_voxels: Some(lengths.into_iter().fold(1, u64::saturating_mul)),
            active_bounds: Some([[0; 3], header.dims.map(|n| n as i64 - 1)]),
            background: Json::Null,
            world_from_index: Some(header.world_from_index),
            statistics: Vec::new(),
            histogram: None,
            metadata: {
                let space =
                    header.space.map(|space| ("space".to_owned(), Json::from(space.name())));
                header.metadata.iter().map(text).chain(space).collect()
            },
            compression: header.compression.to_owned(),
            file_bytes: file.file_bytes(),
            memory_bytes: u64::try_from(header.memory_bytes()).ok(),
        };
        if let Some(sparse) = &header.sparse {
            let bounds = sparse.active_bounds;
            let class = if sparse.level_set { "level set" } else { "unknown" };
            class.clone_into(&mut report.class);
            report.active_voxels = Some(sparse.active_voxels);
            report.active_bounds =
                Some([bounds.min, bounds.max].map(|corner| corner.to_array().map(i64::from)));
            report.background = number(sparse.background.into());
            // The box begins one voxel before the active ones.
            let first = bounds.padded(1).min.as_dvec3();
            let world_from_index = header.world_from_index * DMat4::from_translation(-first);
            report.world_from_index = Some(world_from_index);
            if values {
                report.statistics = vec![sparse.statistics];
            }
        } else if values {
            // Nothing is kept, because the voxels may exceed the memory.
            let mut tallies = vec![Tally::default(); header.components];
            let mut range = FiniteRange::default();
            file.scan(|values, densities| {
                for (&value, component) in values.iter().zip((0..header.components).cycle()) {
                    tallies[component].add(value);
                }
                for &density in densities {
                    range.add(density);
                }
            })?;
            report.statistics = tallies.iter().map(Tally::statistics).collect();
            if let (true, Some(range)) = (with_histogram, range.0) {
                let mut histogram = Histogram::new(range, BINS);
                file.scan(|_, densities| densities.iter().for_each(|&one| histogram.add(one, 1)))?;
                report.histogram = Some(histogram);
            }
        }
        Ok(report)
    }
}

/// Accumulates statistics.
#[derive(Clone, Copy)]
struct Tally {
    min: f64,
    max: f64,
    sum: f64,
    count: u64,
    nan_count: u64,
}

impl Default for Tally {
    fn default() -> Self {
        Self { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0, count: 0, nan_count: 0 }
    }
}

impl Tally {
    fn add(&mut self, value: f64) {
        self.add_several(value, 1);
    }

    fn add_several(&mut self, value: f64, count: u64) {
        if value.is_nan() {
            self.nan_count += count;
        } else {
            self.min = self.min.min(value);
            self.max = self.max.max(value);
            self.sum += value * count as f64;
            self.count += count;
        }
    }

    fn statistics(&self) -> Statistics {
        let Self { min, max, sum, count, nan_count } = *self;
        if count == 0 {
            return Statistics { min: f64::NAN, max: f64::NAN, mean: f64::NAN, nan_count };
        }
        Statistics { min, max, mean: sum / count as f64, nan_count }
    }
}
