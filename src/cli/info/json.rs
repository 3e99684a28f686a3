//! A report as JSON. JSON has no NaN and no infinity: they are the strings "nan", "inf", "-inf".

use glam::DMat4;
use serde_json::{Map, Value as Json, json};

use super::report::{GridReport, Report};
use crate::io::json::number;
use crate::io::vdb::{AnyValue, MetaValue, Metadata, Statistics};

pub(super) fn write(report: &Report) -> String {
    let grids: Vec<Json> = report.grids.iter().map(grid).collect();
    let mut object = json!({
        "format": report.format,
        "metadata": object(&report.metadata),
        "grids": grids,
    });
    if let Some(deep) = &report.deep {
        object["deep"] = deep.json();
    }
    if let Some(surface) = &report.surface {
        object["surface"] = surface.json();
    }
    if let Some(why) = &report.unreachable {
        object["unreachable"] = why.as_str().into();
    }
    format!("{object:#}\n")
}

fn grid(grid: &GridReport) -> Json {
    let statistic = |pick: fn(&Statistics) -> f64| match grid.statistics.as_slice() {
        [] => Json::Null,
        [one] => number(pick(one)),
        several => several.iter().map(|one| number(pick(one))).collect(),
    };
    let mut object = json!({
        "name": grid.name,
        "type": grid.value_type,
        "class": grid.class,
        "active_voxels": grid.active_voxels,
        "active_bbox": grid.active_bounds,
        "background": grid.background,
        "world_from_index": grid.world_from_index.as_ref().map(rows),
        "min": statistic(|one| one.min),
        "max": statistic(|one| one.max),
        "mean": statistic(|one| one.mean),
        "metadata": object(&grid.metadata),
        "compression": grid.compression,
        "file_bytes": grid.file_bytes,
        "memory_bytes": grid.memory_bytes,
    });
    if let Some(why) = &grid.refused {
        object["refused"] = why.as_str().into();
    }
    object
}

fn object(entries: &[(String, Json)]) -> Json {
    Json::Object(entries.iter().cloned().collect::<Map<_, _>>())
}

fn rows(matrix: &DMat4) -> Json {
    let rows = matrix.transpose().to_cols_array_2d();
    rows.iter().map(|row| numbers(row)).collect()
}

fn numbers<T: Copy + Into<f64>>(values: &[T]) -> Json {
    values.iter().map(|&value| number(value.into())).collect()
}

/// A voxel's value.
pub(super) fn value(value: AnyValue) -> Json {
    match value {
        AnyValue::Float(value) => number(value.into()),
        AnyValue::Double(value) => number(value),
        AnyValue::Half(value) => number(value.into()),
        AnyValue::Int32(value) => value.into(),
        AnyValue::Int64(value) => value.into(),
        AnyValue::Bool(value) => value.into(),
        AnyValue::Vec3s(values) => numbers(&values),
        AnyValue::Vec3d(values) => numbers(&values),
        AnyValue::Vec3i(values) => values.to_vec().into(),
    }
}

/// All entries; for unknown types the number of bytes.
pub(super) fn metadata(metadata: &Metadata) -> Vec<(String, Json)> {
    let json = |value: &MetaValue| match value {
        MetaValue::Bool(value) => (*value).into(),
        MetaValue::Int32(value) => (*value).into(),
        MetaValue::Int64(value) => (*value).into(),
        MetaValue::Float(value) => number((*value).into()),
        MetaValue::Double(value) => number(*value),
        MetaValue::String(text) => text.as_str().into(),
        MetaValue::Vec2i(values) => values.to_vec().into(),
        MetaValue::Vec2s(values) => numbers(values),
        MetaValue::Vec2d(values) => numbers(values),
        MetaValue::Vec3i(values) => values.to_vec().into(),
        MetaValue::Vec3s(values) => numbers(values),
        MetaValue::Vec3d(values) => numbers(values),
        MetaValue::Vec4i(values) => values.to_vec().into(),
        MetaValue::Vec4s(values) => numbers(values),
        MetaValue::Vec4d(values) => numbers(values),
        MetaValue::Mat4s(values) => numbers(values),
        MetaValue::Mat4d(values) => numbers(values),
        MetaValue::Other { type_name, bytes } => {
            format!("{} bytes of type {type_name}", bytes.len()).into()
        }
    };
    metadata.iter().map(|(key, value)| (key.to_owned(), json(value))).collect()
}
