//! The shaders without a device: they are valid, and what they share with Rust is the same.
#![cfg(feature = "gpu")]

use std::mem::offset_of;

use deepshadow::frame::{self, Frame};
use deepshadow::gpu::{PASSES, linked, shadow_wgsl};
use deepshadow::kernel::{threshold, view};
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
        let module = validated(&linked(source).unwrap());
        assert!(module.entry_points.iter().any(|entry| entry.name == name), "{name}");
    }
}

#[test]
fn the_lookup_for_other_programs_is_valid_in_any_bind_group() {
    for group in [0, 3] {
        let module = validated(&shadow_wgsl(group).unwrap());
        assert!(module.functions.iter().any(|(_, f)| f.name.as_deref() == Some("shadow_at")));
        for (_, variable) in module.global_variables.iter() {
            assert_eq!(variable.binding.map(|binding| binding.group), Some(group));
        }
    }
}

#[test]
fn an_import_of_a_missing_file_is_an_error() {
    assert!(linked("#import kernel/none\n").unwrap_err().to_string().contains("kernel/none"));
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
        sizes,
        steps,
        methods,
        counts,
    ];
    let module = parsed(&linked("#import kernel/frame\n").unwrap());
    let (members, span) = module
        .types
        .iter()
        .find_map(|(_, ty)| match &ty.inner {
            TypeInner::Struct { members, span } if ty.name.as_deref() == Some("Frame") => {
                Some((members.clone(), *span))
            }
            _ => None,
        })
        .unwrap();
    let theirs: Vec<(&str, usize)> =
        members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
    assert_eq!(ours, theirs);
    assert_eq!(size_of::<Frame>(), span as usize);
}

fn constant(module: &Module, name: &str) -> Vec<f32> {
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, constant)| constant.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no constant {name}"));
    let number = |handle| match module.global_expressions[handle] {
        Expression::Literal(Literal::F32(value)) => value,
        ref other => panic!("{name} holds {other:?}"),
    };
    match &module.global_expressions[constant.init] {
        Expression::Compose { components, .. } => components.iter().map(|c| number(*c)).collect(),
        _ => vec![number(constant.init)],
    }
}

#[test]
fn constants_are_the_same_on_both_sides() {
    let module = parsed(&linked("#import kernel/shadow\n").unwrap());
    let shared = [
        ("LIGHT_STEPS_PER_VOXEL", vec![frame::LIGHT_STEPS_PER_VOXEL]),
        ("VIEW_STEPS_PER_VOXEL", vec![frame::VIEW_STEPS_PER_VOXEL]),
        ("OPAQUE_TRANSMITTANCE", vec![frame::OPAQUE_TRANSMITTANCE]),
        ("UNSET_SHARES", threshold::UNSET_SHARES.to_array().to_vec()),
        ("LAST_SHARE_ABOVE", vec![threshold::LAST_SHARE_ABOVE]),
        ("MIDDLE_SHARE_ABOVE", vec![threshold::MIDDLE_SHARE_ABOVE]),
        ("LARGEST_OPTICAL_DEPTH", vec![threshold::LARGEST_OPTICAL_DEPTH]),
        ("SMALLEST_OPACITY", vec![threshold::SMALLEST_OPACITY]),
        ("FAR", vec![view::FAR]),
    ];
    for (name, value) in &shared {
        assert_eq!(constant(&module, name), *value, "{name}");
    }
    assert_eq!(module.constants.len(), shared.len(), "each constant of the lookup is compared");
}
