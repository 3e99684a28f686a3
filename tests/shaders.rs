//! Tests of the shaders without a device: they are valid, and what they share with Rust is equal.
#![cfg(feature = "gpu")]

use std::any::type_name_of_val;
use std::mem::offset_of;

use deepshadow::frame::{
    self, Field, Frame, FrameGround, FrameLight, FrameMap, FrameMedia, FrameView, Marching, Part,
};
use deepshadow::gpu::{Imports, MediaKind, PREFIX, PassSource, linked, pass_sources, shadow_wgsl};
use deepshadow::kernel::{
    coverage, fitting, fragments, light, medium, occupancy, surface, threshold,
};
use deepshadow::scene::{EMPTY, ROUGHEST};
use deepshadow::settings::{Coding, MapKind};
use deepshadow::shadow::{MOST_WALKED, NO_LINK};
use deepshadow::volume::{BLOCK, BLOCK_EDGE};
use naga::{Expression, Literal, Module, TypeInner};

fn imports(map: MapKind, media: MediaKind) -> Imports {
    Imports { map, media, surfaces: true }
}

fn parsed(text: &str) -> Module {
    naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)))
}

fn validated(text: &str) -> Module {
    let module = parsed(text);
    let capabilities = naga::valid::Capabilities::default();
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(text)));
    module
}

const NESTED: MapKind = MapKind::Coded(Coding::Nested);

#[test]
fn every_pass_is_valid_and_declares_its_entry_point() {
    for PassSource { name, source, workgroup } in pass_sources() {
        for map in [MapKind::Threshold, MapKind::Fragments, NESTED] {
            for media in
                [MediaKind::Plain, MediaKind::Blocks, MediaKind::OneField, MediaKind::Mixed]
            {
                for surfaces in [false, true] {
                    let imports = Imports { map, media, surfaces };
                    let module = validated(&linked(source, imports).unwrap().text);
                    let entry = module.entry_points.iter().find(|entry| entry.name == name);
                    let entry = entry.unwrap_or_else(|| panic!("{name}"));
                    if entry.stage == naga::ShaderStage::Compute {
                        assert_eq!(entry.workgroup_size, [workgroup[0], workgroup[1], 1], "{name}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_lookup_for_other_programs_is_valid_in_any_bind_group() {
    for (group, map) in
        [(0, MapKind::Threshold), (3, MapKind::Threshold), (2, MapKind::Fragments), (1, NESTED)]
    {
        let module = validated(&shadow_wgsl(group, map).unwrap());
        let functions = module.functions.iter().map(|(_, f)| &f.name);
        let variables = module.global_variables.iter().map(|(_, variable)| &variable.name);
        let types = module.types.iter().map(|(_, of)| &of.name);
        let constants = module.constants.iter().map(|(_, constant)| &constant.name);
        let switches = module.overrides.iter().map(|(_, switch)| &switch.name);
        let names = functions.chain(variables).chain(types).chain(constants).chain(switches);
        let names: Vec<_> = names.flatten().collect();
        let others: Vec<_> = names.iter().filter(|name| !name.starts_with(PREFIX)).collect();
        assert_eq!(others, [&"shadow_at"]);
        assert!(names.len() > 20, "{names:?}");
        for (_, variable) in module.global_variables.iter() {
            let expected = (variable.space != naga::AddressSpace::Private).then_some(group);
            assert_eq!(variable.binding.map(|binding| binding.group), expected);
        }
    }
}

/// A line in a compiler's message leads to the file and line that a person can open.
#[test]
fn lines_of_linked_shaders_are_found_in_their_files() {
    for PassSource { name, source, .. } in pass_sources() {
        let linked = linked(source, imports(MapKind::Fragments, MediaKind::Mixed)).unwrap();
        for (i, line) in linked.text.lines().enumerate() {
            let (file, number) = linked.place(i + 1).unwrap();
            let file = if file.is_empty() { name } else { file };
            let path = crate::support::project().join("shaders").join(file).with_extension("wgsl");
            let text = std::fs::read_to_string(path).unwrap();
            assert_eq!(text.lines().nth(number - 1), Some(line), "{file}, line {number}");
        }
    }
    let wrong = "#import kernel/ray\n\nfn wrong() -> f32 { return 1u; }\n";
    let linked = linked(wrong, imports(MapKind::Threshold, MediaKind::Plain)).unwrap();
    let line = linked.text.lines().count();
    let said = linked.explained("wrong", &format!("error at wgsl:{line}:21: type"));
    assert!(said.starts_with("shaders/wrong.wgsl, line 3: error"), "{said}");
}

#[test]
fn an_import_of_a_missing_file_is_an_error() {
    assert!(
        linked("#import kernel/none\n", imports(MapKind::Threshold, MediaKind::Plain))
            .unwrap_err()
            .to_string()
            .contains("kernel/none")
    );
}

/// Names and offsets of fields, and the type of those that are numbers.
macro_rules! fields {
    ($type:ident: $($name:ident),* $(,)?) => {{
        let zero: $type = bytemuck::Zeroable::zeroed();
        vec![$((stringify!($name), offset_of!($type, $name), scalar(type_name_of_val(&zero.$name)))),*]
    }};
}

/// The uniform that Rust fills has the same fields as the one that the shaders read.
#[test]
fn the_frame_has_the_same_fields_at_the_same_places() {
    macro_rules! same {
        ($type:ident: $($name:ident),* $(,)?) => {
            let ours = fields!($type: $($name),*);
            same_layout("#import kernel/frame\n", stringify!($type), &ours, size_of::<$type>());
        };
    }
    same!(Frame: media, light, view, map);
    same!(FrameMedia: index_from_frame, domain_min, extinction, domain_max, largest, voxel_share,
        most_voxels, brick_scale, stored_one, brick_offset, emits, albedo, phase_g, ratios, coloured);
    same!(FrameLight: origin, origin_u, origin_v, direction, direction_u, direction_v, from_frame,
        position, spread, axis, cone_inner, irradiance, cone_outer);
    same!(Marching: per_voxel, rough, longest, limit, least, most, hiding, samples);
    same!(FrameGround: height, albedo, half_extent, exists);
    same!(FrameView: origin, origin_x, origin_y, direction, direction_x, direction_y, world_origin,
        per_world, ambient, octaves, background, ground, width, height, samples, shading,
        light_samples, opaque, shared_weight, shared_length, tolerance, spacing,
        first_row, unused, march);
    same!(FrameMap: rays, slabs, thresholds, sharpness, threshold_depths, surface_reach, size,
        crossing, lookup, window, near, far, tolerance, truncation, planes, follows_links, bias, covers);
}

/// The same for the parts of mixtures.
#[test]
fn mixtures_have_the_same_fields_at_the_same_places() {
    let part = fields!(Part: albedo, strength, transfer, emission, fields);
    same_layout(MIXTURE, "Part", &part, size_of::<Part>());
    let field = fields!(Field: index_from_media, domain_min, domain_max, voxel_share);
    same_layout(MIXTURE, "Field", &field, size_of::<Field>());
}

/// The type of a number; empty for all others.
fn scalar(name: &'static str) -> &'static str {
    if matches!(name, "f32" | "u32") { name } else { "" }
}

const MIXTURE: &str = "#import media/mixture\n";

fn same_layout(root: &str, name: &str, ours: &[(&str, usize, &str)], bytes: usize) {
    let text = linked(root, imports(MapKind::Threshold, MediaKind::Mixed)).unwrap().text;
    let module = parsed(&text);
    let (members, span) = module
        .types
        .iter()
        .find_map(|(_, ty)| match &ty.inner {
            TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
                Some((members.clone(), *span))
            }
            _ => None,
        })
        .unwrap();
    let kind = |ty| match module.types[ty].inner {
        TypeInner::Scalar(naga::Scalar::F32) => "f32",
        TypeInner::Scalar(naga::Scalar::U32) => "u32",
        _ => "",
    };
    let theirs: Vec<(&str, usize, &str)> = members
        .iter()
        .map(|m| (m.name.as_deref().unwrap(), m.offset as usize, kind(m.ty)))
        .collect();
    assert_eq!(ours, theirs, "{name}");
    assert_eq!(bytes, span as usize);
}

fn constant(module: &Module, name: &str) -> Vec<f64> {
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, constant)| constant.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no constant {name}"));
    let number = |handle| match module.global_expressions[handle] {
        Expression::Literal(Literal::F32(value)) => f64::from(value),
        Expression::Literal(Literal::U32(value)) => f64::from(value),
        ref other => panic!("{name} holds {other:?}"),
    };
    match &module.global_expressions[constant.init] {
        Expression::Compose { components, .. } => components.iter().map(|c| number(*c)).collect(),
        _ => vec![number(constant.init)],
    }
}

/// Everything with constants, and the functions that roots with `kernel/fitting` must define.
const ALL_CONSTANTS: &str = "#import kernel/shadow
#import kernel/fitting
#import kernel/lists
#import kernel/medium
#import kernel/occupancy
#import kernel/slices
#import media
fn keep_node(node: vec2<f32>) {}
fn kept_node(k: u32) -> vec2<f32> { return vec2<f32>(f32(k)); }
";

#[test]
fn constants_are_the_same_on_both_sides() {
    let one = |value: f32| vec![f64::from(value)];
    let common = [
        ("ANGLE", one(light::ANGLE)),
        ("MOST_ANGLES", vec![f64::from(light::MOST_ANGLES)]),
        ("FOUR_PI", one(medium::FOUR_PI)),
        ("SMALLEST_WEIGHT", one(medium::SMALLEST_WEIGHT)),
        ("EMPTY", vec![f64::from(EMPTY)]),
        ("ROUGHEST", vec![f64::from(ROUGHEST)]),
        ("BATCH", vec![f64::from(occupancy::BATCH)]),
        ("LEAP", one(occupancy::LEAP)),
        ("LEAST_SHARE", one(occupancy::LEAST_SHARE)),
        ("SHORTEST_CUT", one(occupancy::SHORTEST_CUT)),
        ("LONGEST_CUT", one(occupancy::LONGEST_CUT)),
        ("CUT_SHARE", one(occupancy::CUT_SHARE)),
        ("CUT_LIMIT", one(occupancy::CUT_LIMIT)),
        ("HIDING", one(occupancy::HIDING)),
        ("POINT_SPACING", one(fitting::POINT_SPACING)),
        ("FIT_SHARE", one(fitting::FIT_SHARE)),
        ("LEAST_ROOM", one(fitting::LEAST_ROOM)),
        ("BEND", one(fitting::BEND)),
        ("LOWEST_SHARE", one(fitting::LOWEST_SHARE)),
        ("LOWEST_DEPTH", one(fitting::LOWEST_DEPTH)),
        ("DARK_SHARE", one(fitting::DARK_SHARE)),
        ("STEEPEST", one(fitting::STEEPEST)),
        ("SMALLEST", one(fitting::SMALLEST)),
        ("OPAQUE_OPTICAL_DEPTH", one(fragments::OPAQUE_OPTICAL_DEPTH)),
    ];
    let thresholds = [
        ("UNSET_SHARES", threshold::UNSET_SHARES.to_array().map(f64::from).to_vec()),
        ("LAST_SHARE_ABOVE", one(threshold::LAST_SHARE_ABOVE)),
        ("MIDDLE_SHARE_ABOVE", one(threshold::MIDDLE_SHARE_ABOVE)),
        ("LARGEST_OPTICAL_DEPTH", one(threshold::LARGEST_OPTICAL_DEPTH)),
        ("BENT_OPTICAL_DEPTH", one(threshold::BENT_OPTICAL_DEPTH)),
        ("SMALLEST_OPACITY", one(threshold::SMALLEST_OPACITY)),
    ];
    let lists = [
        ("NO_LINK", vec![f64::from(NO_LINK)]),
        ("FARTHEST", one(3e38)),
        ("FRONT_DEPTH", one(fragments::FRONT_DEPTH)),
        ("LEAST_WITH_FRONT", one(fragments::LEAST_WITH_FRONT)),
        ("MOST_WALKED", vec![f64::from(MOST_WALKED)]),
        ("INTERLEAVED", vec![f64::from(deepshadow::gpu::INTERLEAVED)]),
        ("INTERLEAVED_STRIDE", vec![f64::from(deepshadow::gpu::INTERLEAVED_STRIDE)]),
    ];
    let mixtures = [
        ("MOST_PARTS", vec![frame::MOST_PARTS as f64]),
        ("MOST_FIELDS", vec![frame::MOST_FIELDS as f64]),
        ("TABLE_CELLS", vec![f64::from(frame::TABLE_CELLS)]),
        ("LEAST_CELLS", one(frame::LEAST_CELLS)),
        ("FARTHEST_CELL", one(frame::FARTHEST_CELL)),
    ];
    let blocks = [
        ("NO_BLOCK", vec![f64::from(deepshadow::gpu::NO_BLOCK)]),
        ("BLOCK", vec![BLOCK as f64]),
        ("BLOCK_EDGE", vec![BLOCK_EDGE as f64]),
    ];
    for (map, media, own, more) in [
        (MapKind::Threshold, MediaKind::Plain, &thresholds[..], &[][..]),
        (MapKind::Threshold, MediaKind::Blocks, &thresholds[..], &blocks[..]),
        (MapKind::Fragments, MediaKind::Mixed, &lists[..], &mixtures[..]),
    ] {
        let module = parsed(&linked(ALL_CONSTANTS, imports(map, media)).unwrap().text);
        for (name, value) in common.iter().chain(own).chain(more) {
            assert_eq!(constant(&module, name), *value, "{name}");
        }
        // Booleans are the shaders' own: whether media are mixed, whether they have one grid, and
        // whether maps are lists.
        let named = usize::from(media == MediaKind::Mixed);
        let shared = common.len() + own.len() + more.len() + 2 + named;
        assert_eq!(module.constants.len(), shared, "each constant is compared");
    }
}

/// The same for surfaces; the others of their constants are the shaders' own.
#[test]
fn constants_of_surfaces_are_the_same_on_both_sides() {
    let one = |value: f32| vec![f64::from(value)];
    let shared = [
        ("NEAREST", one(coverage::NEAREST)),
        ("NEAREST_RADII", one(coverage::NEAREST_RADII)),
        ("FAR_RADII", one(coverage::FAR_RADII)),
        ("LEAST_SQUARE", one(coverage::LEAST_SQUARE)),
        ("LEAST_AREA", one(coverage::LEAST_AREA)),
        ("SHORTEST", one(coverage::SHORTEST)),
        ("REACH", one(surface::REACH)),
        ("LEAST_WIDTH", one(surface::LEAST_WIDTH)),
        ("LEAST_OFF", one(surface::LEAST_OFF)),
        ("OFF_RADII", one(surface::OFF_RADII)),
        ("SEGMENT_POINT", vec![f64::from(frame::SEGMENT_POINT)]),
        ("FIRST_SEGMENT", vec![f64::from(frame::FIRST_SEGMENT)]),
        ("LAST_SEGMENT", vec![f64::from(frame::LAST_SEGMENT)]),
    ];
    let root = "#import kernel/surface\n#import kernel/casting\n";
    let module = parsed(&linked(root, imports(MapKind::Fragments, MediaKind::Plain)).unwrap().text);
    for (name, value) in shared {
        assert_eq!(constant(&module, name), value, "{name}");
    }
}
