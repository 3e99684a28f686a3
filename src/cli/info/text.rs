//! A report as a short table for people, with a histogram.

use std::fmt::Write;

use serde_json::Value as Json;

use super::report::{GridReport, Report};
use crate::io::Histogram;

pub(super) fn write(report: &Report) -> String {
    let mut text = String::new();
    let (name, format) = (report.path.display(), report.format.name());
    // Writing to a string cannot fail.
    let _ = match (&report.deep, report.grids.len()) {
        (Some(_), _) => writeln!(text, "{name}: {format}"),
        (None, 1) => writeln!(text, "{name}: {format}, 1 grid"),
        (None, count) => writeln!(text, "{name}: {format}, {count} grids"),
    };
    if let Some(deep) = &report.deep {
        let _ = deep.text(&mut text);
    }
    metadata(&mut text, "  ", &report.metadata);
    for grid in &report.grids {
        let _ = table(&mut text, grid);
    }
    if let Some(why) = &report.unreachable {
        let _ = writeln!(text, "\n{why}");
    }
    text
}

fn table(text: &mut String, grid: &GridReport) -> std::fmt::Result {
    let name = if grid.name.is_empty() { "(unnamed)" } else { &grid.name };
    writeln!(text, "\n{}", name.escape_debug())?;
    writeln!(text, "  type        {}, {}", grid.value_type, grid.class.escape_debug())?;
    if let Some(why) = &grid.refused {
        writeln!(text, "  not read    {why}")?;
    }
    if let (Some(count), Some([low, high])) = (grid.active_voxels, grid.active_bounds) {
        let [x, y, z] = [0, 1, 2].map(|axis| high[axis] - low[axis] + 1);
        writeln!(
            text,
            "  voxels      {count} in {x} x {y} x {z}, {} .. {}",
            list(&low),
            list(&high)
        )?;
    } else if let Some(count) = grid.active_voxels {
        writeln!(text, "  voxels      {count}")?;
    }
    match &grid.world_from_index {
        Some(matrix) => {
            let steps = [0, 1, 2].map(|axis| matrix.col(axis).truncate());
            let lengths = steps.map(glam::DVec3::length);
            writeln!(text, "  voxel size  {}", list(&lengths))?;
            // Axes that only have a length are the usual case.
            if steps.iter().enumerate().any(|(axis, step)| step[axis] != lengths[axis]) {
                let steps = steps.map(|step| list(&step.to_array()));
                writeln!(text, "  axes        {}", steps.join("; "))?;
            }
            writeln!(text, "  origin      {}", list(&matrix.w_axis.truncate().to_array()))?;
        }
        None => writeln!(text, "  transform   none that can be used")?,
    }
    if grid.background != Json::Null {
        writeln!(text, "  background  {}", grid.background)?;
    }
    for one in &grid.statistics {
        write!(text, "  values      {} .. {}, mean {}", one.min, one.max, one.mean)?;
        if one.nan_count > 0 {
            write!(text, ", {} NaN", one.nan_count)?;
        }
        writeln!(text)?;
    }
    write!(text, "  stored      {} bytes, compression {}", grid.file_bytes, grid.compression)?;
    match grid.memory_bytes {
        Some(bytes) => writeln!(text, ", {bytes} bytes in memory")?,
        None => writeln!(text)?,
    }
    metadata(text, "  ", &grid.metadata);
    match &grid.histogram {
        Some(histogram) => bars(text, histogram),
        None => Ok(()),
    }
}

fn list<T: ToString>(values: &[T]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
}

fn metadata(text: &mut String, indent: &str, entries: &[(String, Json)]) {
    const LONGEST: usize = 100;
    for (key, value) in entries {
        let value: String = value.to_string().chars().take(LONGEST).collect();
        let _ = writeln!(text, "{indent}{} = {value}", key.escape_debug());
    }
}

/// A bar a bin; its length grows with the square root of the count, so that rare values are seen.
fn bars(text: &mut String, histogram: &Histogram) -> std::fmt::Result {
    const WIDTH: f64 = 40.0;
    let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let width = (histogram.high - histogram.low) / histogram.counts.len() as f64;
    writeln!(text, "  histogram (bar = square root of the count)")?;
    for (bin, &count) in histogram.counts.iter().enumerate() {
        let length = (WIDTH * (count as f64 / most).sqrt()).ceil() as usize;
        let from = histogram.low + width * bin as f64;
        writeln!(text, "  {from:>13.6} |{:<40} {count}", "#".repeat(length))?;
    }
    Ok(())
}
