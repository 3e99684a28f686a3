//! The report of `info` on a deep image, and its text.

use std::path::Path;

use serde_json::{Value as Json, json};

use super::text::{Lines, in_memory};
use crate::error::Result;
use crate::io::deep_exr::{Attribute, Channel, DeepFile, DeepHeader, DeepStatistics, Window};
use crate::io::json::number;

/// What is known of a deep image; `None` for what is not known.
pub(super) struct DeepReport {
    size: [u32; 2],
    header: DeepHeader,
    statistics: Option<DeepStatistics>,
    other_parts: Vec<String>,
    file_bytes: u64,
}

impl DeepReport {
    /// Examines the file, including samples if `values`; keeps no line.
    pub(super) fn of(path: &Path, max_bytes: u64, values: bool) -> Result<Self> {
        let mut file = DeepFile::open(path, max_bytes)?;
        let statistics = if values { Some(file.statistics()?) } else { None };
        Ok(Self {
            size: file.size(),
            header: file.header().clone(),
            statistics,
            other_parts: file.other_parts().to_vec(),
            file_bytes: file.file_bytes(),
        })
    }

    /// All attributes without fields of their own.
    pub(super) fn metadata(&self) -> Vec<(String, Json)> {
        let attributes = self.header.attributes.iter();
        attributes.map(|(name, value)| (name.clone(), attribute(value))).collect()
    }

    pub(super) fn json(&self) -> Json {
        let channel =
            |channel: &Channel| json!({ "name": channel.name, "type": channel.pixel_type.name() });
        let window = |window: &Window| json!([window.min, window.max]);
        let none = || Json::Null;
        let found = self.statistics.as_ref();
        let samples_per_pixel = found.map_or_else(none, |found| {
            json!({ "min": found.fewest, "mean": number(found.mean_samples()), "max": found.most })
        });
        let depth = found
            .and_then(|found| found.depth)
            .map_or_else(none, |[low, high]| json!({ "min": number(low), "max": number(high) }));
        let opacity = found.map_or_else(none, |found| {
            let [min, mean, max] = found.opacity.map(number);
            json!({ "min": min, "mean": mean, "max": max })
        });
        json!({
            "width": self.size[0],
            "height": self.size[1],
            "data_window": window(&self.header.data_window),
            "display_window": window(&self.header.display_window),
            "channels": self.header.channels.iter().map(channel).collect::<Vec<_>>(),
            "samples": found.map(|found| found.samples),
            "samples_per_pixel": samples_per_pixel,
            "empty_pixels": found.map(|found| found.empty_pixels),
            "depth": depth,
            "final_alpha": opacity,
            "other_parts": self.other_parts,
            "compression": self.header.compression.name(),
            "file_bytes": self.file_bytes,
            "memory_bytes": self.memory_bytes(),
        })
    }

    /// Bytes of memory that the image takes once it is read.
    fn memory_bytes(&self) -> Option<u64> {
        let found = self.statistics.as_ref()?;
        Some(4 * found.pixels + found.samples * self.header.sample_bytes() as u64)
    }

    pub(super) fn text(&self, text: &mut Lines) {
        let [width, height] = self.size;
        let [x, y] = self.header.data_window.min;
        let of_picture = match self.header.display_window.size() {
            Some([width, height]) => format!(", of a picture of {width} x {height}"),
            None => String::new(),
        };
        text.add(format_args!("  pixels      {width} x {height}, first {x},{y}{of_picture}"));
        let channels = self.header.channels.iter();
        let channels = channels.map(|c| format!("{} ({})", c.name, c.pixel_type.name()));
        let channels = channels.collect::<Vec<_>>().join(", ");
        text.add(format_args!("  channels    {channels}"));
        if let Some(found) = &self.statistics {
            let [least, mean, most] = found.opacity;
            let a_pixel = [found.fewest, found.most].map(|count| count.to_string()).join(" .. ");
            let (samples, mean_samples) = (found.samples, found.mean_samples());
            text.add(format_args!(
                "  samples     {samples}, per pixel {a_pixel}, mean {mean_samples}"
            ));
            text.add(format_args!(
                "  empty       {} of {} pixels",
                found.empty_pixels, found.pixels
            ));
            if let Some([near, far]) = found.depth {
                text.add(format_args!("  depth       {near} .. {far}"));
            }
            text.add(format_args!("  final alpha {least} .. {most}, mean {mean}"));
        }
        let stored =
            format!("{} bytes, compression {}", self.file_bytes, self.header.compression.name());
        text.add(format_args!("  stored      {stored}{}", in_memory(self.memory_bytes())));
        for part in &self.other_parts {
            text.add(format_args!("  not read    part {part}"));
        }
    }
}

/// An attribute as JSON; for unknown types the number of bytes.
fn attribute(value: &Attribute) -> Json {
    let floats = |values: &[f32]| values.iter().map(|&value| number(value.into())).collect();
    match value {
        Attribute::Int(value) => (*value).into(),
        Attribute::Float(value) => number((*value).into()),
        Attribute::Double(value) => number(*value),
        Attribute::Text(text) => text.as_str().into(),
        Attribute::IntVec2(values) => values.to_vec().into(),
        Attribute::IntVec3(values) => values.to_vec().into(),
        Attribute::FloatVec2(values) => floats(values),
        Attribute::FloatVec3(values) => floats(values),
        Attribute::Matrix3x3(values) => floats(values),
        Attribute::Matrix4x4(values) => floats(values),
        Attribute::IntBox2(values) => values.to_vec().into(),
        Attribute::FloatBox2(values) => floats(values),
        Attribute::Other { type_name, bytes } => {
            format!("{} bytes of type {type_name}", bytes.len()).into()
        }
    }
}
