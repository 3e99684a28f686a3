//! Tests that every function of a shader has a twin in Rust, with the same name in the file of the
//! same name, unless it is declared here.
#![cfg(feature = "gpu")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::project;

/// Functions of shaders whose twin has another name or file: `file::function` and `file::function`;
/// methods have their own name.
const OTHERWISE: [(&str, &str); 55] = [
    ("kernel/blocks::sample_density", "kernel/density::sample_density"),
    ("kernel/fitting::fitter_start", "kernel/fitting::new"),
    ("kernel/fitting::fitter_add", "kernel/fitting::add"),
    ("kernel/fitting::fitter_finish", "kernel/fitting::finish"),
    ("kernel/fitting::fitter_is_dark", "kernel/fitting::is_dark"),
    ("kernel/fitting::fitter_point", "kernel/fitting::point"),
    ("kernel/fitting::fitter_range", "kernel/fitting::range"),
    ("kernel/fitting::fitter_close", "kernel/fitting::close"),
    ("kernel/lists::push_fragment", "shadow/fragments/lists::push"),
    ("kernel/march::colours", "cpu/march_colours::colours"),
    ("kernel/march::emitted_colours", "cpu/march_colours::emitted_colours"),
    ("kernel/march::lit_colours", "cpu/march_colours::source_of_colours"),
    ("kernel/march::lit_ground_of_colours", "cpu/ground::lit_ground_of_colours"),
    ("kernel/march::emitted", "cpu/march_view::emitted"),
    ("kernel/march::lit_pair", "cpu/march_view::batch"),
    ("kernel/march::march", "cpu/march_view::march"),
    ("kernel/march::paper_shading", "cpu/march_view::paper_shading"),
    ("kernel/march::pixel", "cpu/march_view::pixel"),
    ("kernel/march::sample_distance", "cpu/march_view::sample"),
    ("kernel/march::single_scattering", "cpu/march_view::single_scattering"),
    ("kernel/march::steps_of", "cpu/march_view::steps"),
    ("kernel/medium::left_behind", "kernel/medium::taken"),
    ("kernel/occupancy::walk_of", "kernel/occupancy::new"),
    ("kernel/ray::ray_at", "kernel/ray::at"),
    ("kernel/ray::index_ray_of", "kernel/ray::transformed"),
    ("kernel/shadow::four_aligned", "shadow/mod::alignment"),
    ("kernel/shadow::four_weights", "shadow/mod::four_weights"),
    ("kernel/shadow::shadow_lookup_colours", "shadow/fragments/mod::bilinear_colours"),
    ("kernel/shadow::aligned", "shadow/mod::aligned"),
    ("kernel/shadow::brute_force_mean", "shadow/mod::brute_force_mean"),
    ("kernel/shadow::shadow_lookup", "shadow/mod::filtered"),
    ("kernel/shadow::surface_depth", "kernel/view::surface_depth"),
    ("kernel/threshold::smooth_step", "kernel/threshold::smoothstep"),
    ("kernel/threshold::optical_depth_in", "kernel/threshold::optical_depth_at"),
    ("kernel/threshold::transmittance_default", "shadow/threshold::texel_transmittance"),
    ("map/curves::front", "shadow/threshold::front"),
    ("map/curves::texel_transmittance", "shadow/threshold::texel_transmittance"),
    ("map/fragments::front", "kernel/fragments::front_of"),
    ("map/fragments::linked_place", "shadow/fragments/mod::linked_mean"),
    ("map/fragments::nodes_before", "kernel/fragments::nodes_before"),
    ("map/fragments::place_transmittance", "shadow/fragments/mod::transmittance"),
    ("map/fragments::texel_transmittance", "shadow/fragments/mod::texel_transmittance"),
    ("map/fragments::window_mean", "shadow/fragments/mod::mean"),
    ("map/texels::window_mean", "shadow/mod::mean"),
    ("map/threshold::front", "shadow/threshold::front"),
    ("map/threshold::texel_transmittance", "shadow/threshold::texel_transmittance"),
    ("media/mixture::density_along", "kernel/mixture::mixture_density"),
    ("media/mixture::emission_along", "kernel/mixture::mixture_emission"),
    ("media/mixture::field_value", "kernel/mixture::field_value"),
    ("media/mixture::inside", "kernel/mixture::inside"),
    ("media/mixture::part_along", "kernel/mixture::part_along"),
    ("media/mixture::table_mean", "kernel/table::table_mean"),
    ("media/mixture::table_place", "kernel/table::place_of"),
    ("media/mixture::source_along", "kernel/mixture::mixture_source"),
    ("media/plain::source_along", "kernel/media::source_along"),
];

/// Functions of shaders that Rust does not need, with the reason.
const ALONE: [(&str, &str); 27] = [
    ("kernel/curves::keep_curve", "curves are arrays there"),
    ("kernel/fitting::fitter_slopes", "a part of `point` there"),
    ("kernel/fragments::list_of_run", "runs have one layout there"),
    ("kernel/fragments::packed_link", "links are pairs there"),
    ("kernel/march::arriving_at", "parallel light is computed once there"),
    ("kernel/march::four_samples", "a part of `cut` there"),
    ("kernel/march::light_coordinates_of", "coordinates are computed point by point there"),
    ("kernel/march::light_place", "the same"),
    ("kernel/shadow::shadow_at", "for other programs' shaders"),
    ("kernel/threshold::piece_of", "a curve is a value there"),
    ("map/fragments::four_searches", "four lists at once hide what memory takes"),
    ("map/fragments::four_transmittances", "the same"),
    ("map/fragments::is_in", "the place of the lookup before is tried first"),
    ("map/fragments::list_of", "runs have one layout there"),
    ("map/fragments::node_of", "a node is a value there"),
    ("map/fragments::place_at", "a place is an index there"),
    ("map/fragments::place_near", "the place of the lookup before is tried first"),
    ("map/fragments::place_searched", "searching is the library's there"),
    ("map/fragments::place_towards", "the place of the lookup before is tried first"),
    ("map/texels::four_transmittances", "a part of `bilinear` there"),
    ("media/fields::stored_number", "a binding is chosen by a switch"),
    ("media/mixture::media_ray_of", "texture coordinates are shaders' own"),
    ("media/mixture::sample_field", "a volume is a value there"),
    ("media/one_field::stored_number", "a binding is chosen by a switch"),
    ("media/plain::density_along", "`four_along` is what the CPU takes"),
    ("media/plain::emission_along", "plain media emit nothing"),
    ("media/plain::media_ray_of", "texture coordinates are shaders' own"),
];

/// The names after `fn ` in a file, without its tests.
fn functions(path: &Path) -> BTreeSet<String> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let name = |rest: &str| {
        rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
    };
    text.split("fn ").skip(1).map(name).filter(|name| !name.is_empty()).collect()
}

/// `folder/file::function` for all shared shader files.
fn of_shaders() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for folder in ["kernel", "map", "media"] {
        for entry in fs::read_dir(project().join("shaders").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let file = path.file_stem().unwrap().to_string_lossy().into_owned();
            let names = functions_of_shader(&path);
            found.extend(names.into_iter().map(|name| format!("{folder}/{file}::{name}")));
        }
    }
    found
}

/// The names of a shader's functions, which begin a line.
fn functions_of_shader(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let begins = text.lines().filter_map(|line| line.strip_prefix("fn "));
    begins.map(|rest| rest.split('(').next().unwrap().to_owned()).collect()
}

fn exists_in_rust(name: &str) -> bool {
    let (file, function) = name.split_once("::").unwrap();
    functions(&project().join("src").join(file).with_extension("rs")).contains(function)
}

#[test]
fn every_function_of_a_shader_has_its_twin_or_says_why_not() {
    let shaders = of_shaders();
    assert!(shaders.len() > 90, "only {} functions were found", shaders.len());
    let mut complaints = Vec::new();
    for name in &shaders {
        let otherwise = OTHERWISE.iter().find(|(own, _)| own == name);
        let alone = ALONE.iter().any(|(own, _)| own == name);
        let twin = match otherwise {
            Some((_, twin)) => exists_in_rust(twin),
            None => alone || exists_in_rust(name),
        };
        if !twin {
            complaints.push(format!("{name} has no twin"));
        }
    }
    let declared = OTHERWISE.iter().map(|(name, _)| name).chain(ALONE.iter().map(|(name, _)| name));
    for name in declared.filter(|name| !shaders.contains(**name)) {
        complaints.push(format!("{name} is declared and does not exist"));
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}
