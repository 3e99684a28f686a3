//! Tests that every function of a shader has a twin in Rust, with the same name in the file of the
//! same name, unless it is declared here.
#![cfg(feature = "gpu")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::project;

/// Functions of shaders whose twin has another name or file: `file::function` and `file::function`;
/// methods have their own name.
const OTHERWISE: [(&str, &str); 109] = [
    ("kernel/casting::leave", "cpu/raster_surfaces::fragment"),
    ("kernel/casting::meets", "cpu/raster_surfaces::tile"),
    ("kernel/coverage::direction_or_across", "kernel/coverage::direction"),
    ("kernel/coverage::row_extent", "cpu/bins::row_extent"),
    ("kernel/fitting::fitter_add_fragment", "kernel/fitting::add_fragment"),
    ("kernel/layers::among_layers", "cpu/layers::among"),
    ("kernel/layers::coming_to_strand", "cpu/shade_view::strand_radiance"),
    ("kernel/layers::coming_to_triangle", "cpu/shade_view::triangle_radiance"),
    ("kernel/layers::find_layers", "cpu/layers::find_layers"),
    ("kernel/layers::hit_behind", "cpu/raster_view::meet"),
    ("kernel/layers::layers_of", "cpu/layers::go_on"),
    ("kernel/layers::lit_among_layers", "cpu/march_view::batch"),
    ("kernel/layers::rays_of", "cpu/shade_view::shade"),
    ("kernel/layers::with_layers", "cpu/layers::composed"),
    ("kernel/march::behind_all", "cpu/ground::behind"),
    ("kernel/march::ray_within", "cpu/march_view::ray"),
    ("kernel/pieces::add_between", "cpu/trace_slices::add_merged"),
    ("kernel/pieces::add_merged", "shadow/fragments/overlaps::through"),
    ("kernel/pieces::add_rest", "shadow/fragments/overlaps::up_to"),
    ("kernel/pieces::begin_pieces", "shadow/fragments/overlaps::new"),
    ("kernel/pieces::next_piece", "shadow/fragments/overlaps::disjoint"),
    ("kernel/seeing::leave", "cpu/raster_surfaces::place"),
    ("kernel/seeing::meets", "cpu/raster_view::meet"),
    ("kernel/seeing::share_cells", "cpu/raster_surfaces::cells"),
    ("kernel/surface::arriving_on", "cpu/shade_view::arriving_at"),
    ("kernel/surface::within", "cpu/shade_view::within"),
    ("kernel/surfaces::alpha_of", "cpu/raster_surfaces::alpha"),
    ("kernel/surfaces::left_by_strand", "cpu/raster_surfaces::add"),
    ("kernel/surfaces::strip_of", "cpu/raster_surfaces::draw"),
    ("kernel/surfaces::texels_between", "cpu/bins::texels"),
    ("kernel/tone::aces", "image/tone::aces"),
    ("kernel/tone::agx", "image/tone::agx"),
    ("kernel/tone::khronos_neutral", "image/tone::khronos_neutral"),
    ("kernel/tone::shown", "image/tone::shown"),
    ("kernel/tone::srgb_from_linear", "image/mod::srgb_from_linear"),
    ("kernel/triangle::plane_depth", "kernel/triangle::triangle_depth"),
    ("kernel/triangle::triangle_holds", "kernel/triangle::triangle_depth"),
    ("kernel/view::pixel_offset", "frame/pixels::pixel_offset"),
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
    ("kernel/nested::nested_transmittance", "shadow/coded/nested/mod::transmittance"),
    ("kernel/nested::share", "shadow/coded/nested/mod::share"),
    ("kernel/nested::unit", "shadow/coded/nested/samples::unit"),
    ("kernel/nested_fit::farthest_between", "shadow/coded/nested/fit::farthest_between"),
    ("kernel/nested_fit::farthest_points", "shadow/coded/nested/fit::farthest_points"),
    ("kernel/nested_fit::fit_knots", "shadow/coded/nested/fit::new"),
    ("kernel/nested_fit::move_first", "shadow/coded/nested/fit::move_first"),
    ("kernel/nested_fit::move_inner", "shadow/coded/nested/fit::move_inner"),
    ("kernel/nested_fit::move_last", "shadow/coded/nested/fit::move_last"),
    ("kernel/nested_fit::settle", "shadow/coded/nested/fit::settle"),
    ("kernel/nested_fit::slope_between", "shadow/coded/nested/fit::new"),
    ("kernel/nested_fit::weigh", "shadow/coded/nested/samples::weigh"),
    ("kernel/nested_fit::words_of", "shadow/coded/nested/mod::words_of"),
    ("kernel/occupancy::walk_of", "kernel/occupancy::new"),
    ("kernel/ray::ray_at", "kernel/ray::at"),
    ("kernel/ray::index_ray_of", "kernel/ray::transformed"),
    ("kernel/shadow::aligned_depths", "shadow/mod::alignment"),
    ("kernel/shadow::four_texels", "shadow/mod::four_texels"),
    ("kernel/shadow::four_weights", "shadow/mod::four_weights"),
    ("kernel/shadow::shadow_lookup_colours", "shadow/fragments/mod::bilinear_colours"),
    ("kernel/shadow::shadow_lookup", "shadow/mod::filtered"),
    ("kernel/shadow::window_texels", "shadow/mod::brute_force_mean"),
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
    ("map/fragments::four_transmittances", "shadow/fragments/mod::texel_transmittance"),
    ("map/fragments::linked_mean", "shadow/fragments/mod::linked_mean"),
    ("map/nested::front", "shadow/mod::front"),
    ("map/nested::texel_transmittance", "shadow/mod::texel_transmittance"),
    ("map/threshold::front", "shadow/threshold::front"),
    ("map/threshold::texel_transmittance", "shadow/threshold::texel_transmittance"),
    ("media/mixture::four_along", "kernel/media::four_along"),
    ("media/plain::four_along", "kernel/media::four_along"),
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
const ALONE: [(&str, &str); 58] = [
    ("kernel/casting::corner_of", "an index there"),
    ("kernel/casting::opacity_of", "an index there"),
    ("kernel/casting::point_of", "an index there"),
    ("kernel/coverage::cell_at", "a closure there"),
    ("kernel/coverage::stroke_end", "a closure there"),
    ("kernel/coverage::texel_place", "a closure there"),
    ("kernel/layers::channels", "a closure there"),
    ("kernel/layers::clear_at", "a closure there"),
    ("kernel/layers::is_complete", "`Shaded` says it there"),
    ("kernel/layers::is_in_part", "there are no workgroups there"),
    ("kernel/layers::layer_light", "a product there"),
    ("kernel/layers::take", "a closure there"),
    ("kernel/layers::take_four", "the same"),
    ("kernel/layers::triangle_corners", "an index there"),
    ("kernel/lists::put_fragment", "lists are vectors there"),
    ("kernel/pieces::add_medium", "a closure there"),
    ("kernel/seeing::corner_of", "an index there"),
    ("kernel/seeing::opacity_of", "an index there"),
    ("kernel/seeing::point_of", "an index there"),
    ("kernel/surface::raised", "a loop there"),
    ("kernel/surfaces::area_of", "segments are drawn in order there, and parts added to runs"),
    ("kernel/surfaces::area_of_segment", "the same"),
    ("kernel/surfaces::area_of_touching", "the same"),
    ("kernel/surfaces::columns_of", "a part of `draw` there"),
    ("kernel/surfaces::drawn_of", "all are prepared at once there"),
    ("kernel/surfaces::in_tile", "an index there"),
    ("kernel/surfaces::is_near", "segments are drawn in order there, and parts added to runs"),
    ("kernel/surfaces::left_in", "strands and triangles have loops of their own there"),
    ("kernel/surfaces::rows_of", "a part of `draw` there"),
    ("kernel/surfaces::segment_box", "segments are drawn in order there, and parts added to runs"),
    ("kernel/surfaces::segment_stroke", "all are prepared at once there"),
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
    ("map/fragments::is_in", "the place of the lookup before is tried first"),
    ("map/fragments::list_of", "runs have one layout there"),
    ("map/fragments::node_of", "a node is a value there"),
    ("map/fragments::place_at", "a place is an index there"),
    ("map/fragments::place_near", "the place of the lookup before is tried first"),
    ("map/fragments::place_searched", "searching is the library's there"),
    ("map/fragments::place_towards", "the place of the lookup before is tried first"),
    ("map/texels::four_transmittances", "a part of `bilinear` there"),
    ("map/texels::linked_mean", "there are no links"),
    ("media/fields::stored_number", "a binding is chosen by a switch"),
    ("media/mixture::media_ray_of", "texture coordinates are shaders' own"),
    ("media/mixture::sample_field", "a volume is a value there"),
    ("media/one_field::stored_number", "a binding is chosen by a switch"),
    ("media/plain::density_along", "`four_along` is what the CPU takes"),
    ("media/plain::emission_along", "plain media emit nothing"),
    ("media/plain::media_ray_of", "texture coordinates are shaders' own"),
];

/// Files of shaders of which Rust needs nothing, with the reason.
const FILES_ALONE: [(&str, &str); 6] = [
    ("kernel/no_layers", "there is no code for what is not there"),
    ("kernel/no_pieces", "the same"),
    ("kernel/raster", "threads share work in another way there"),
    ("kernel/seen", "buffers are structs there"),
    ("kernel/sorted_lists", "lists are vectors there, which the library sorts"),
    ("kernel/sorting", "the same"),
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
        let file = name.split("::").next();
        let alone = ALONE.iter().any(|(own, _)| own == name)
            || FILES_ALONE.iter().any(|(own, _)| Some(*own) == file);
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
