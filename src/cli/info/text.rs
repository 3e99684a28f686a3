//! A report as a short table for people, with a histogram.

use std::fmt::Arguments;

use serde_json::Value as Json;

use super::report::{GridReport, Report};
use crate::error::quote::{LONGEST_LINE, one_line};
use crate::io::Histogram;

/// Lines for people. Text that is quoted from a file stays on one line and cannot control a
/// terminal.
pub(super) struct Lines(String);

impl Lines {
    pub(super) fn add(&mut self, line: Arguments) {
        self.0 += &one_line(&line.to_string(), LONGEST_LINE);
        self.0.push('\n');
    }
}

pub(super) fn write(report: &Report) -> String {
    let mut text = Lines(String::new());
    let (name, format) = (report.path.display(), report.format);
    match report.grids.len() {
        0 if report.deep.is_some() || report.surface.is_some() => {
            text.add(format_args!("{name}: {format}"));
        }
        1 => text.add(format_args!("{name}: {format}, 1 grid")),
        count => text.add(format_args!("{name}: {format}, {count} grids")),
    }
    if let Some(surface) = &report.surface {
        surface.text(&mut text);
    }
    if let Some(deep) = &report.deep {
        deep.text(&mut text);
    }
    metadata(&mut text, &report.metadata);
    for grid in &report.grids {
        table(&mut text, grid);
    }
    if let Some(why) = &report.unreachable {
        text.add(format_args!(""));
        text.add(format_args!("{why}"));
    }
    text.0
}

fn table(text: &mut Lines, grid: &GridReport) {
    let name = if grid.name.is_empty() { "(unnamed)" } else { &grid.name };
    text.add(format_args!(""));
    text.add(format_args!("{name}"));
    text.add(format_args!("  type        {}, {}", grid.value_type, grid.class));
    if let Some(why) = &grid.refused {
        text.add(format_args!("  not read    {why}"));
    }
    if let (Some(count), Some([low, high])) = (grid.active_voxels, grid.active_bounds) {
        let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis] + 1);
        let (low, high) = (list(&low), list(&high));
        text.add(format_args!("  voxels      {count} in {x} x {y} x {z}, {low} .. {high}"));
    } else if let Some(count) = grid.active_voxels {
        text.add(format_args!("  voxels      {count}"));
    }
    match &grid.world_from_index {
        Some(matrix) => {
            let steps = [0, 1, 2].map(|axis| matrix.col(axis).truncate());
            let lengths = steps.map(glam::DVec3::length);
            text.add(format_args!("  voxel size  {}", list(&lengths)));
            // Usually the axes of a grid are parallel to the world's, so their lengths are enough.
            if steps.iter().enumerate().any(|(axis, step)| step[axis] != lengths[axis]) {
                let steps = steps.map(|step| list(&step.to_array()));
                text.add(format_args!("  axes        {}", steps.join("; ")));
            }
            let origin = matrix.w_axis.truncate().to_array();
            text.add(format_args!("  origin      {}", list(&origin)));
        }
        None => text.add(format_args!("  transform   none that can be used")),
    }
    if grid.background != Json::Null {
        text.add(format_args!("  background  {}", grid.background));
    }
    for one in &grid.statistics {
        let nan = match one.nan_count {
            0 => String::new(),
            count => format!(", {count} NaN"),
        };
        let (min, max, mean) = (one.min, one.max, one.mean);
        text.add(format_args!("  values      {min} .. {max}, mean {mean}{nan}"));
    }
    let stored = format!("{} bytes, compression {}", grid.file_bytes, grid.compression);
    text.add(format_args!("  stored      {stored}{}", in_memory(grid.memory_bytes)));
    metadata(text, &grid.metadata);
    if let Some(histogram) = &grid.histogram {
        bars(text, histogram);
    }
}

/// The text behind the bytes in a file, if the bytes in memory are known.
pub(super) fn in_memory(bytes: Option<u64>) -> String {
    bytes.map_or_else(String::new, |bytes| format!(", {bytes} bytes in memory"))
}

fn list<T: ToString>(values: &[T]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
}

fn metadata(text: &mut Lines, entries: &[(String, Json)]) {
    const LONGEST: usize = 100;
    for (key, value) in entries {
        text.add(format_args!("  {key} = {}", one_line(&value.to_string(), LONGEST)));
    }
}

/// One bar per bin. Its length is proportional to the square root of the count, so that rare values
/// are visible.
fn bars(text: &mut Lines, histogram: &Histogram) {
    const WIDTH: f64 = 40.0;
    let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let width = (histogram.high - histogram.low) / histogram.counts.len() as f64;
    text.add(format_args!("  histogram (bar = square root of the count)"));
    for (bin, &count) in histogram.counts.iter().enumerate() {
        let length = (WIDTH * (count as f64 / most).sqrt()).ceil() as usize;
        let from = histogram.low + width * bin as f64;
        text.add(format_args!("  {from:>13.6} |{:<40} {count}", "#".repeat(length)));
    }
}
