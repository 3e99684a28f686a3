//! The shaders without a device: they are valid, and what they share with Rust is the same.
#![cfg(feature = "gpu")]

use std::mem::offset_of;

use deepshadow::frame::{self, Field, Frame, Part};
use deepshadow::gpu::{MediaKind, PASSES, linked, shadow_wgsl};
use deepshadow::kernel::{fitting, fragments, medium, occupancy, threshold, view};
use deepshadow::scene::{EMPTY, ROUGHEST};
use deepshadow::settings::MapKind;
use deepshadow::shadow::{MOST_WALKED, NO_LINK};
use deepshadow::volume::{BLOCK, BLOCK_EDGE};
use naga::{Expression, Literal, Module, TypeInner};

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

#[test]
fn every_pass_is_valid_and_declares_its_entry_point() {
    for (name, source) in PASSES {
        for map in [MapKind::Threshold, MapKind::Fragments] {
            for media in [MediaKind::Plain, MediaKind::Blocks, MediaKind::Mixed] {
                let module = validated(&linked(source, map, media).unwrap());
                assert!(module.entry_points.iter().any(|entry| entry.name == name), "{name}");
            }
        }
    }
}

#[test]
fn the_lookup_for_other_programs_is_valid_in_any_bind_group() {
    for (group, map) in [(0, MapKind::Threshold), (3, MapKind::Threshold), (2, MapKind::Fragments)]
    {
        let module = validated(&shadow_wgsl(group, map).unwrap());
        assert!(module.functions.iter().any(|(_, f)| f.name.as_deref() == Some("shadow_at")));
        for (_, variable) in module.global_variables.iter() {
            let expected = (variable.space != naga::AddressSpace::Private).then_some(group);
            assert_eq!(variable.binding.map(|binding| binding.group), expected);
        }
    }
}

#[test]
fn an_import_of_a_missing_file_is_an_error() {
    assert!(
        linked("#import kernel/none\n", MapKind::Threshold, MediaKind::Plain)
            .unwrap_err()
            .to_string()
            .contains("kernel/none")
    );
}

/// Field by field: the uniform that Rust fills is the one that the shaders read.
#[test]
fn the_frame_has_the_same_fields_at_the_same_places() {
    macro_rules! fields {
        ($($name:ident),* $(,)?) => { vec![$((stringify!($name), offset_of!(Frame, $name))),*] };
    }
    let ours = fields![
        index_from_frame,
        domain_min,
        domain_max,
        voxel_share,
        brick_scale,
        brick_offset,
        rates,
        lengths,
        longest,
        limits,
        albedo,
        light_origin,
        light_origin_u,
        light_origin_v,
        light_direction,
        light_direction_u,
        light_direction_v,
        light_from_frame,
        light_position,
        light_axis,
        irradiance,
        ambient,
        view_origin,
        view_origin_x,
        view_origin_y,
        view_direction,
        view_direction_x,
        view_direction_y,
        ground,
        world_origin,
        background,
        thresholds,
        threshold_depths,
        slices,
        filtering,
        sizes,
        steps,
        methods,
        counts,
    ];
    same_layout("#import kernel/frame\n", "Frame", &ours, size_of::<Frame>());
}

/// The same for what mixtures are made of.
#[test]
fn mixtures_have_the_same_fields_at_the_same_places() {
    macro_rules! fields {
        ($type:ident: $($name:ident),*) => { vec![$((stringify!($name), offset_of!($type, $name))),*] };
    }
    let part = fields!(Part: albedo, strength, transfer, emission, fields);
    same_layout(MIXTURE, "Part", &part, size_of::<Part>());
    let field = fields!(Field: index_from_media, domain_min, domain_max, voxel_share);
    same_layout(MIXTURE, "Field", &field, size_of::<Field>());
}

const MIXTURE: &str = "#import media/mixture\n";

fn same_layout(root: &str, name: &str, ours: &[(&str, usize)], bytes: usize) {
    let text = linked(root, MapKind::Threshold, MediaKind::Mixed).unwrap();
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
    let theirs: Vec<(&str, usize)> =
        members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
    assert_eq!(ours, theirs);
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

/// Everything that has constants, with what roots of `kernel/fitting` define.
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
        ("FAR", one(view::FAR)),
        ("POINT_SPACING", one(fitting::POINT_SPACING)),
        ("FIT_SHARE", one(fitting::FIT_SHARE)),
        ("LEAST_ROOM", one(fitting::LEAST_ROOM)),
        ("BEND", one(fitting::BEND)),
        ("LOWEST_SHARE", one(fitting::LOWEST_SHARE)),
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
        let module = parsed(&linked(ALL_CONSTANTS, map, media).unwrap());
        for (name, value) in common.iter().chain(own).chain(more) {
            assert_eq!(constant(&module, name), *value, "{name}");
        }
        // Whether media are mixed and maps are lists is the shaders' own business: truth values.
        let shared = common.len() + own.len() + more.len() + 2;
        assert_eq!(module.constants.len(), shared, "each constant is compared");
    }
}
