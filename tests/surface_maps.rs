//! Tests of links, kinds of map and backends with meshes and strands.

use deepshadow::accuracy::{Place, Points};
use deepshadow::settings::{Filter, MapKind};
use deepshadow::{Backend, CpuBackend, Silent};
use glam::DVec3;

use crate::support::backends::every_backend;
use crate::surfaces::{bare, fragments, mixed, pane, tangle};

#[test]
fn links_find_what_a_search_finds_on_strands() {
    let mut scene = bare(Vec::new(), DVec3::new(0.3, -1.0, 0.2));
    scene.surfaces = tangle(400);
    let beam = scene.only_beam().unwrap();
    let with = |links: bool| {
        let settings = fragments(64).with(|s| {
            s.map.filter = Filter::Pcf5;
            s.map.fragments.links = Some(links);
            s.map.fragments.tolerance = 0.0;
        });
        CpuBackend.map(&beam, &settings, &Silent).unwrap()
    };
    let (linked, plain) = (with(true), with(false));
    assert!(linked.as_fragments().unwrap().links().is_some());
    for i in 0..4_000 {
        let (u, v, depth) = ((i % 63) as f32 / 63.0, (i / 63) as f32 / 63.0, (i % 17) as f32 / 8.0);
        let found = [&linked, &plain].map(|map| map.texels().unwrap().filtered(5, u, v, depth));
        assert!((found[0] - found[1]).abs() < 1e-6, "{u}, {v}, {depth}: {found:?}");
    }
}

#[test]
fn other_kinds_of_map_take_surfaces_or_say_that_they_do_not() {
    let beam = mixed(0.4).only_beam().unwrap();
    let points = Points::draw(&beam, 64, &[Place::Rays], [2_000, 1], &Silent);
    // What a kind makes of steps is its own error; nothing would be some .5.
    let kinds = [
        ("fragments", 0.04),
        ("visibility", 0.04),
        ("nested", 0.05),
        ("slices:32", 0.06),
        ("relative", 0.1),
        ("threshold", 0.15),
        ("adaptive:16", 0.1),
    ];
    for (name, allowed) in kinds {
        let settings = fragments(64).with(|s| s.map.kind = Some(name.parse::<MapKind>().unwrap()));
        let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
        let rms = points.errors(Place::Rays, &map, 1).rms;
        eprintln!("{name}: {rms:.4}");
        assert!(rms < allowed, "{name}: {rms}");
    }
    let settings = fragments(64).with(|s| s.map.kind = Some("grid:16".parse().unwrap()));
    let error = CpuBackend.map(&beam, &settings, &Silent).unwrap_err().to_string();
    assert!(error.contains("meshes and hair"), "{error}");
}

#[test]
fn backends_draw_surfaces_or_say_that_they_do_not() {
    let scene = bare(vec![pane(1.0, 0.0, 0.5)], DVec3::NEG_Y);
    for backend in every_backend() {
        for kind in [MapKind::Fragments, MapKind::Threshold] {
            let settings = fragments(16).with(|s| s.map.kind = Some(kind));
            let picture = backend.render(&scene, &settings, &Silent).err();
            let map = backend.map(&scene.only_beam().unwrap(), &settings, &Silent).err();
            for error in [picture, map] {
                let said = error.map(|error| error.to_string()).unwrap_or_default();
                let refused = said.contains(&format!("builds no '{kind}' maps of meshes and hair"));
                let name = backend.description();
                assert_eq!(refused, !backend.draws_surfaces(kind), "{name}, {kind}: {said}");
                assert_eq!(refused, !said.is_empty(), "{name}, {kind}: {said}");
            }
        }
    }
}
