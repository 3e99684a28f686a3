//! Files written by the real OpenVDB library agree with what the library itself reads in them.
//!
//! The files and the truth (`NAME.vdb`, `NAME.json`) are outside data, in the folder `vdb`; for the
//! few files of the library that the repository has, see `vdb_fixtures.rs`.

use std::path::Path;

use deepshadow::io::vdb::{
    AnyValue, Grid, GridHeader, MetaValue, Statistics, SurveyDepth, Transform, VdbFile,
};
use glam::{DMat4, DVec3, IVec3};
use serde_json::Value as Json;

mod outside {
    use super::*;
    use crate::support::data::outside_grids;

    /// Twin: `the_ball_holds_its_formula_everywhere`, and the other tests of `vdb_fixtures.rs`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn every_file_of_the_real_library_agrees_with_its_truth() {
        let mut grids = 0;
        for path in outside_grids("vdb") {
            let truth = std::fs::read(path.with_extension("json")).unwrap();
            let truth: Json = serde_json::from_slice(&truth).unwrap();
            grids += check_file(&path, &truth);
        }
        assert!(grids > 0);
        eprintln!("{grids} grids agree");
    }

    /// Twin: `the_ball_holds_its_formula_everywhere`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn files_of_other_programs_load() {
        for path in outside_grids("data/vdb") {
            let file = VdbFile::open(&path).unwrap_or_else(|error| panic!("{error}"));
            for (index, header) in file.grids().iter().enumerate() {
                let what = format!("{} {:?}", path.display(), header.name);
                let grid = file.load(index).unwrap_or_else(|error| panic!("{error}"));
                let counted = header.metadata.get("file_voxel_count");
                if let Some(&MetaValue::Int64(count)) = counted {
                    assert_eq!(grid.active_voxel_count() as i64, count, "{what}");
                }
                if let (Some(MetaValue::Vec3i(min)), Some(MetaValue::Vec3i(max))) =
                    (header.metadata.get("file_bbox_min"), header.metadata.get("file_bbox_max"))
                {
                    let bounds = grid.active_bounds().unwrap();
                    assert_eq!(
                        (bounds.min.to_array(), bounds.max.to_array()),
                        (*min, *max),
                        "{what}"
                    );
                }
            }
        }
    }
}

/// Checks a file against its truth and returns the number of grids whose voxels agree.
fn check_file(path: &Path, truth: &Json) -> usize {
    let file = VdbFile::open(path).unwrap_or_else(|error| panic!("{error}"));
    let truth = &truth["truth"];
    assert_eq!(u64::from(file.version()), truth["file_version"].as_u64().unwrap());
    assert_eq!(Json::from(file.library_version().to_vec()), truth["library_version"]);
    for (key, value) in truth["file_metadata"].as_object().unwrap() {
        check_meta(file.metadata().get(key).unwrap(), value, key);
    }
    let Some(grids) = truth["grids"].as_array() else {
        assert_eq!(file.grids().len(), 0);
        return 0;
    };
    assert_eq!(file.grids().len(), grids.len());
    let mut agreed = 0;
    for truth in grids {
        let index = truth["file_order"].as_u64().unwrap() as usize;
        let header = &file.grids()[index];
        let what = format!("{} {:?}", path.display(), header.unique_name);
        check_header(header, truth, &what);
        if let Some(why) = &header.refused {
            let refused = ["points", "string"].iter().any(|kind| what.contains(kind));
            assert!(refused, "{what}: {why}");
            assert!(file.load(index).is_err());
            continue;
        }
        let grid = file.load(index).unwrap_or_else(|error| panic!("{error}"));
        check_voxels(&grid, truth, &what);
        let survey = file.survey(index, SurveyDepth::Values).unwrap();
        assert_eq!(Json::from(survey.leaf_count), truth["leaf_count"], "{what}");
        assert_eq!(Json::from(survey.active_tile_count), truth["active_tiles"], "{what}");
        assert_eq!(survey.active_voxels, grid.active_voxel_count(), "{what}");
        assert_eq!(survey.active_bounds, grid.active_bounds(), "{what}");
        assert_eq!(format!("{:?}", survey.statistics), format!("{:?}", grid.statistics()));
        assert_eq!(survey.memory_bytes, grid.memory_bytes(), "{what}");
        let outline = file.survey(index, SurveyDepth::Topology).unwrap();
        assert_eq!(outline.active_voxels, survey.active_voxels, "{what}");
        assert_eq!(outline.active_bounds, survey.active_bounds, "{what}");
        agreed += 1;
    }
    agreed
}

fn check_header(header: &GridHeader, truth: &Json, what: &str) {
    assert_eq!(header.name, truth["name"], "{what}");
    assert_eq!(header.unique_name, truth["unique_name"], "{what}");
    assert_eq!(header.type_name, truth["type_string_in_file"], "{what}");
    assert_eq!(header.saved_as_half, truth["half"].as_bool().unwrap(), "{what}");
    assert_eq!(header.class(), truth["class"], "{what}");
    assert_eq!(header.instance_of.as_deref().unwrap_or(""), truth["instance_parent"], "{what}");
    let flags = truth["compression_flags_in_file"].as_u64().unwrap();
    let compression = header.compression;
    let found = [compression.zip, compression.active_mask, compression.blosc];
    assert_eq!(found, [1, 2, 4].map(|flag| flags & flag != 0), "{what}");
    let map = truth["map_in_file"].as_str().unwrap().split('/').next().unwrap();
    assert_eq!(header.map_name, map, "{what}");
    for (key, value) in truth["metadata"].as_object().unwrap() {
        let found = header.metadata.get(key).unwrap_or_else(|| panic!("{what}: no {key}"));
        check_meta(found, value, what);
    }
    match &header.transform {
        Transform::Affine(matrix) => check_transform(*matrix, truth, what),
        Transform::Refused(why) => {
            assert_eq!(truth["map_type"], "NonlinearFrustumMap", "{what}: {why}");
        }
    }
}

/// The truth has row vectors: its rows are our columns.
fn check_transform(matrix: DMat4, truth: &Json, what: &str) {
    let rows: [[f64; 4]; 4] = serde_json::from_value(truth["matrix_row_vector"].clone()).unwrap();
    assert_eq!(matrix.to_cols_array_2d(), rows, "{what}");
    for pair in truth["index_to_world"].as_array().unwrap() {
        let [index, world]: [[f64; 3]; 2] = serde_json::from_value(pair.clone()).unwrap();
        let found = matrix.transform_point3(DVec3::from_array(index));
        let error = (found - DVec3::from_array(world)).length();
        assert!(error <= 1e-12 * (1.0 + found.length()), "{what}: {index:?} at {found}");
    }
}

fn check_meta(found: &MetaValue, truth: &Json, what: &str) {
    assert_eq!(found.type_name(), truth["type"], "{what}");
    let text = match found {
        MetaValue::String(text) => text.clone(),
        MetaValue::Bool(value) => value.to_string(),
        MetaValue::Int32(value) => value.to_string(),
        MetaValue::Int64(value) => value.to_string(),
        MetaValue::Float(value) => value.to_string(),
        MetaValue::Double(value) => value.to_string(),
        MetaValue::Vec2i(values) => format!("{values:?}"),
        MetaValue::Vec3i(values) => format!("{values:?}"),
        MetaValue::Vec4i(values) => format!("{values:?}"),
        MetaValue::Vec2s(values) => plain(values),
        MetaValue::Vec3s(values) => plain(values),
        MetaValue::Vec4s(values) => plain(values),
        MetaValue::Vec2d(values) => plain(values),
        MetaValue::Vec3d(values) => plain(values),
        MetaValue::Vec4d(values) => plain(values),
        MetaValue::Mat4s(values) => {
            assert_eq!(DMat4::from_cols_array(&values.map(f64::from)), DMat4::IDENTITY);
            return;
        }
        MetaValue::Mat4d(values) => {
            assert_eq!(DMat4::from_cols_array(values), DMat4::IDENTITY);
            return;
        }
        other => panic!("{what}: {other:?}"),
    };
    assert_eq!(text, truth["str"], "{what}");
}

fn plain<T: std::fmt::Display>(values: &[T]) -> String {
    let words: Vec<_> = values.iter().map(ToString::to_string).collect();
    format!("[{}]", words.join(", "))
}

fn check_voxels(grid: &Grid, truth: &Json, what: &str) {
    check_value(grid.background(), &truth["background"], what);
    assert_eq!(Json::from(grid.active_voxel_count()), truth["active_voxels"], "{what}");
    let bounds = grid.active_bounds().map(|bounds| [bounds.min.to_array(), bounds.max.to_array()]);
    assert_eq!(serde_json::to_value(bounds).unwrap(), truth["active_bbox"], "{what}");
    let statistics = grid.statistics();
    let no_statistics = Vec::new();
    let expected = truth["stats"].as_array().unwrap_or(&no_statistics);
    assert_eq!(statistics.len(), expected.len(), "{what}");
    for (found, truth) in statistics.iter().zip(expected) {
        check_statistics(found, truth, what);
    }
    for sample in truth["samples"].as_array().unwrap() {
        let index: [i32; 3] = serde_json::from_value(sample["ijk"].clone()).unwrap();
        let (value, active) = grid.get(IVec3::from_array(index));
        let what = format!("{what} at {index:?}");
        assert_eq!(active, sample["active"].as_bool().unwrap(), "{what}");
        check_value(value, &sample["value"], &what);
    }
}

fn check_statistics(found: &Statistics, truth: &Json, what: &str) {
    assert!(same(found.min, number(&truth["min"])), "{what}: {found:?} {truth}");
    assert!(same(found.max, number(&truth["max"])), "{what}: {found:?} {truth}");
    assert_eq!(Json::from(found.nan_count), truth["nan"], "{what}");
    // The truth was summed in another order.
    let mean = number(&truth["mean"]);
    let close = (found.mean - mean).abs() <= 1e-10 * (1.0 + mean.abs());
    assert!(close || same(found.mean, mean), "{what}: {found:?} {truth}");
}

fn check_value(found: AnyValue, truth: &Json, what: &str) {
    let components: Vec<f64> = match found {
        AnyValue::Float(value) => vec![f64::from(value)],
        AnyValue::Double(value) => vec![value],
        AnyValue::Half(value) => vec![value.to_f64()],
        AnyValue::Int32(value) => vec![f64::from(value)],
        AnyValue::Int64(value) => {
            assert_eq!(Json::from(value), *truth, "{what}");
            return;
        }
        AnyValue::Bool(value) => {
            assert_eq!(Json::from(value), *truth, "{what}");
            return;
        }
        AnyValue::Vec3s(values) => values.map(f64::from).to_vec(),
        AnyValue::Vec3d(values) => values.to_vec(),
        AnyValue::Vec3i(values) => values.map(f64::from).to_vec(),
        other => panic!("{what}: {other:?}"),
    };
    let expected: Vec<f64> = match truth {
        Json::Array(values) => values.iter().map(number).collect(),
        single => vec![number(single)],
    };
    assert_eq!(components.len(), expected.len(), "{what}");
    for (found, truth) in components.iter().zip(&expected) {
        assert!(same(*found, *truth), "{what}: {found} instead of {truth}");
    }
}

/// Bit for bit, but for the sign of zero, which JSON's integers lose, and the bits of a NaN.
fn same(found: f64, truth: f64) -> bool {
    found == truth || (found.is_nan() && truth.is_nan())
}

fn number(json: &Json) -> f64 {
    match json.as_str() {
        Some(text) => text.parse().unwrap(),
        None => json.as_f64().unwrap(),
    }
}
