//! Tests of the fragment map against the exact integral and against itself: its errors on
//! texel-centre rays and at random points, its tolerance as a guarantee, and equal lists from every
//! way to build it.

use deepshadow::backend::Backend;
use deepshadow::cpu::CpuBackend;
use deepshadow::kernel::fitting::Fitter;
use deepshadow::kernel::fragments::{Node, nodes_before, optical_depth_between};
use deepshadow::progress::Silent;
use deepshadow::reference::{Extinction, TexelProfile};
use deepshadow::scene::{LightKind, Scene};
use deepshadow::settings::{Filter, MapKind, Settings, Slices};
use deepshadow::shadow::{Fragment, FragmentLists, FragmentMap, Map, Shadow, TexelMap};
use deepshadow::volume::presets::Preset;
use glam::DVec3;
use rayon::prelude::*;

use crate::support::scenes::{anchor_scene, scene, settings as all_settings, unit_cube, volume};
use crate::support::{Random, rms};

const MAP: u32 = 256;
const TEXELS: usize = 4_000;
const DEPTHS: usize = 256;

fn settings(map_size: u32) -> Settings {
    all_settings(map_size, [8, 8]).with(|s| s.map.kind = Some(MapKind::Fragments))
}

fn raw(map_size: u32) -> Settings {
    settings(map_size).with(|s| {
        s.map.fragments.tolerance = 0.0;
        s.map.fragments.truncation = 0.0;
    })
}

fn fragments(scene: &Scene, settings: &Settings) -> FragmentMap {
    match CpuBackend.map(&scene.only_beam().unwrap(), settings, &Silent).unwrap() {
        Map::Fragments(map) => map,
        other => panic!("not a fragment map: {other:?}"),
    }
}

/// Largest and root mean square error on the central rays of random texels.
fn error_on_rays(scene: &Scene, map: &FragmentMap) -> (f64, f64) {
    let exact = Extinction::of(&scene.media);
    let mut random = Random(11);
    let size = map.size();
    let texels: Vec<[u32; 2]> = (0..TEXELS)
        .map(|_| [random.unit(), random.unit()].map(|r| (r * f64::from(size)) as u32))
        .collect();
    let [near, far] = map.view().axial_extent(&scene.media);
    let per_texel = texels.into_par_iter().map(|[x, y]| {
        let mut random = Random(u64::from(y * size + x) + 1);
        let mut depths: Vec<f32> =
            (0..DEPTHS).map(|_| (near + random.unit() * (far - near)) as f32).collect();
        depths.sort_by(f32::total_cmp);
        let place = [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(size));
        let wanted: Vec<f64> = depths.iter().map(|&d| f64::from(d)).collect();
        let profile = TexelProfile::trace(&exact, map.view(), place, &wanted);
        let errors = depths
            .iter()
            .zip(&profile.transmittance)
            .map(|(&depth, truth)| (f64::from(map.texel_transmittance(x, y, depth)) - truth).abs());
        errors.fold((0.0_f64, 0.0_f64), |(most, sum), e| (most.max(e), sum + e * e))
    });
    let (most, sum) = per_texel.reduce(|| (0.0, 0.0), |a, b| (a.0.max(b.0), a.1 + b.1));
    (most, (sum / (TEXELS * DEPTHS) as f64).sqrt())
}

/// With 512 slabs per ray: within 1/255 everywhere. Fitted within 0.002: at most 0.0025, and 72
/// bytes per texel on average. With 512 planes, which are clipped: within 0.02.
#[test]
fn lists_are_as_exact_as_published() {
    for largest in [4.0, 16.0] {
        let mut bytes = 0.0;
        for preset in Preset::ALL {
            let scene = anchor_scene(preset, largest, MAP);
            let planes = raw(MAP).with(|s| s.map.fragments.slices = Slices::Planes);
            let ways = [("raw", raw(MAP), 1.0 / 255.0), ("fitted", settings(MAP), 0.0025)];
            for (name, settings, allowed) in ways.into_iter().chain([("planes", planes, 0.02)]) {
                let map = fragments(&scene, &settings);
                let (most, rms) = error_on_rays(&scene, &map);
                let per_texel = map.bytes() as f64 / f64::from(MAP * MAP);
                let preset = preset.name();
                eprintln!("{largest} {preset} {name}: {most:.5}, rms {rms:.6}, {per_texel:.1} B");
                assert!(most <= allowed, "{preset} {name} at depth {largest}: {most}");
                if name == "fitted" {
                    bytes += per_texel / 4.0;
                }
            }
        }
        eprintln!("depth {largest}: {bytes:.1} bytes a texel");
        assert!(bytes <= 72.0, "{bytes} bytes a texel");
    }
}

/// At random points only the error of the map's resolution remains: the exact transmittance of
/// every texel, filtered in the same way, is hardly better.
#[test]
fn at_random_points_only_the_maps_resolution_is_left() {
    for preset in Preset::ALL {
        let scene = anchor_scene(preset, 4.0, MAP);
        let map = fragments(&scene, &raw(512));
        let truth_of = Extinction::of(&scene.media);
        let bounds = scene.media.world_bounds();
        let mut random = Random(42);
        let points: Vec<DVec3> = (0..10_000)
            .map(|_| bounds.min + DVec3::from_array([0; 3].map(|_| random.unit())) * bounds.size())
            .collect();
        let errors: Vec<[f64; 2]> = points
            .into_par_iter()
            .map(|point| {
                let truth = truth_of.light_transmittance(&scene.lights[0], point);
                let light = map.view().coordinates(point).unwrap();
                let exact = Exact { map: &map, extinction: &truth_of };
                let [u, v, depth] = light.as_vec3().to_array();
                [map.bilinear(u, v, depth), exact.bilinear(u, v, depth)]
                    .map(|t| f64::from(t) - truth)
            })
            .collect();
        let [ours, floor] = [0, 1].map(|i| rms(errors.iter().map(|e| e[i])));
        eprintln!("{}: {ours:.6}, floor {floor:.6}", preset.name());
        assert!(ours <= 1.1 * floor, "{}: {ours} over {floor}", preset.name());
    }
}

/// The exact transmittance of every texel as a map.
struct Exact<'a> {
    map: &'a FragmentMap,
    extinction: &'a Extinction<'a>,
}

impl Shadow for Exact<'_> {
    fn bytes(&self) -> u64 {
        0
    }

    fn lookup(&self, width: u32, u: f32, v: f32, depth: f32) -> f32 {
        self.filtered(width, u, v, depth)
    }
}

impl TexelMap for Exact<'_> {
    fn size(&self) -> u32 {
        self.map.size()
    }

    fn texel_transmittance(&self, x: u32, y: u32, depth: f32) -> f32 {
        let place = [x, y].map(|i| (f64::from(i) + 0.5) / f64::from(self.size()));
        let depths = [f64::from(depth)];
        let view = self.map.view();
        TexelProfile::trace(self.extinction, view, place, &depths).transmittance[0] as f32
    }
}

fn transmittance(nodes: &[Node], depth: f32) -> f64 {
    let tau = optical_depth_between(nodes, nodes_before(nodes, depth), depth);
    f64::from(-tau).exp()
}

fn nodes_of(fragments: &[Fragment], tolerance: f32) -> Vec<Node> {
    let mut nodes = Vec::new();
    let mut fitter = Fitter::new(tolerance);
    for fragment in fragments {
        let extent = [fragment.front, fragment.back];
        fitter.add(extent, fragment.optical_depth, &mut |node| nodes.push(node));
    }
    fitter.finish(&mut |node| nodes.push(node));
    nodes
}

/// With slabs that are thin and thick, clear and opaque, with gaps and surfaces, in any order of
/// sizes: the fit stays within its tolerance at every depth, also between the points that it was
/// fitted to.
#[test]
fn a_fits_tolerance_is_a_guarantee() {
    let mut random = Random(5);
    let (mut worst, mut at_worst) = (0.0_f64, String::new());
    for trial in 0..4_000 {
        let tolerance = [0.0005, 0.002, 0.01, 0.05][trial % 4];
        let largest = [0.02, 0.3, 3.0, 40.0][trial / 4 % 4];
        let mut depth = random.unit();
        let list: Vec<Fragment> = (0..random.unit().powi(2) as usize * 200 + 40)
            .map(|_| {
                let gap = if random.unit() < 0.2 { random.unit() * 0.1 } else { 0.0 };
                let front = (depth + gap) as f32;
                let surface = random.unit() < 0.1;
                let width = 1e-4 + random.unit() as f32 * 0.05;
                let back = if surface { front } else { front + width };
                depth = f64::from(back);
                let optical_depth = (random.unit().powi(4) * largest) as f32;
                Fragment { front, back, optical_depth }
            })
            .collect();
        let (all, fitted) = (nodes_of(&list, 0.0), nodes_of(&list, tolerance));
        assert!(fitted.len() <= all.len() && fitted.windows(2).all(|n| n[0].depth <= n[1].depth));
        // Anywhere, at the nodes, and just beside them.
        let nodes = all.iter().chain(&fitted).map(|node| node.depth);
        let beside = nodes.flat_map(|depth| [depth.next_down(), depth, depth.next_up()]);
        let anywhere = (0..400).map(|_| (random.unit() * 1.1 * depth) as f32);
        for at in beside.chain(anywhere) {
            let (truth, ours) = (transmittance(&all, at), transmittance(&fitted, at));
            let error = (truth - ours).abs() / f64::from(tolerance);
            if error > worst {
                let before = nodes_before(&all, at);
                worst = error;
                at_worst = format!(
                    "depth {at}, {ours} for {truth}, tolerance {tolerance}, among {:?}",
                    &all[before.saturating_sub(2)..(before + 2).min(all.len())],
                );
            }
        }
    }
    eprintln!("largest error of a fit: {worst:.4} of its tolerance");
    assert!(worst <= 1.0, "{worst}, {at_worst}");
    assert!(worst > 0.75, "tolerances are used");
}

#[test]
fn lists_of_any_length_are_sorted() {
    let mut random = Random(3);
    for length in [0, 1, 2, 31, 33, 4096] {
        let mut lists = FragmentLists::new(1);
        let mut order: Vec<usize> = (0..length).collect();
        order.sort_by_cached_key(|_| (random.unit() * 1e9) as u64);
        for i in order {
            let front = i as f32;
            let slab = Fragment { front, back: front + 1.0, optical_depth: 1e-3 * (i % 7) as f32 };
            lists.push(0, slab);
        }
        let mut nodes = Vec::new();
        lists.sorted_nodes(0, [0.0; 2], &mut nodes);
        let some = (0..length).filter(|i| i % 7 > 0).count();
        assert_eq!(lists.len(), some, "fragments without opacity leave no trace");
        let in_order: Vec<Fragment> = (0..length)
            .map(|i| (i as f32, 1e-3 * (i % 7) as f32))
            .filter(|(_, tau)| *tau > 0.0)
            .map(|(front, optical_depth)| Fragment { front, back: front + 1.0, optical_depth })
            .collect();
        assert_eq!(nodes, nodes_of(&in_order, 0.0), "{length}");
    }
}

#[test]
fn fragments_that_are_no_numbers_leave_no_trace() {
    let mut lists = FragmentLists::new(1);
    for (front, back, optical_depth) in [
        (f32::NAN, 1.0, 1.0),
        (0.0, f32::INFINITY, 1.0),
        (2.0, 1.0, 1.0),
        (0.0, 1.0, f32::NAN),
        (0.0, 1.0, -1.0),
    ] {
        lists.push(0, Fragment { front, back, optical_depth });
    }
    assert!(lists.is_empty());
    lists.push(0, Fragment::surface(0.5, 1.0));
    let mut nodes = Vec::new();
    lists.sorted_nodes(0, [0.002, 0.0], &mut nodes);
    assert!(transmittance(&nodes, 0.4) == 1.0 && transmittance(&nodes, 0.5) < 1e-30, "{nodes:?}");
}

/// Hair: a surface's shadow begins at the surface, and truncation never has a larger error than its
/// parameter.
#[test]
fn truncated_lists_stay_within_the_truncation() {
    let mut random = Random(9);
    let mut lists = FragmentLists::new(200);
    for texel in 0..200 {
        for _ in 0..20 {
            lists.push(texel, Fragment::surface(random.unit() as f32, 0.5 * random.unit() as f32));
        }
    }
    let (mut all, mut cut) = (Vec::new(), Vec::new());
    let (mut kept, mut worst) = (0, 0.0_f64);
    for texel in 0..200 {
        lists.sorted_nodes(texel, [0.0, 0.0], &mut all);
        lists.sorted_nodes(texel, [0.0, 0.001], &mut cut);
        kept += cut.len();
        for _ in 0..100 {
            let at = random.unit() as f32;
            worst = worst.max((transmittance(&all, at) - transmittance(&cut, at)).abs());
        }
    }
    eprintln!("{:.1} of {} nodes kept, worst {worst:.5}", kept as f64 / 200.0, all.len());
    assert!(worst < 0.001, "{worst}");
    assert!(kept < 200 * all.len(), "something is cut");
}

#[test]
fn drawn_planes_give_the_lists_that_marched_planes_give() {
    for light in [None, Some(DVec3::new(0.8, 1.5, 0.6))] {
        let mut scene = anchor_scene(Preset::Bucky, 6.0, 32);
        if let Some(position) = light {
            scene.lights[0].kind = LightKind::Point { position };
        }
        let marched = raw(40).with(|s| s.map.fragments.slices = Slices::Planes);
        let drawn = raw(40).with(|s| s.map.fragments.slices = Slices::Raster);
        let (a, b) = (fragments(&scene, &marched), fragments(&scene, &drawn));
        assert_eq!(a.runs().starts(), b.runs().starts());
        assert_eq!(a.runs().nodes(), b.runs().nodes());
        assert!(a.runs().nodes().len() > 10_000);
    }
}

#[test]
fn windows_along_links_are_windows_by_brute_force() {
    let mut scene = anchor_scene(Preset::Rods, 6.0, 32);
    for position in [None, Some(DVec3::new(0.8, 1.5, 0.6))] {
        if let Some(position) = position {
            scene.lights[0].kind = LightKind::Point { position };
        }
        for filter in [Filter::Pcf3, Filter::Pcf7, Filter::Edsm5] {
            let linked = settings(60).with(|s| {
                s.map.filter = filter;
                s.map.fragments.links = Some(true);
            });
            let map = fragments(&scene, &linked);
            let plain = fragments(&scene, &linked.with(|s| s.map.fragments.links = Some(false)));
            assert!(map.links().is_some() && plain.links().is_none());
            let mut random = Random(8);
            let [near, far] = map.view().axial_extent(&scene.media);
            for _ in 0..4_000 {
                let [u, v] = [random.unit() as f32, random.unit() as f32];
                let depth = (near + (random.unit() * 1.2 - 0.1) * (far - near)) as f32;
                let width = filter.window().0;
                let (ours, truth) =
                    (map.filtered(width, u, v, depth), plain.filtered(width, u, v, depth));
                assert!((ours - truth).abs() <= 1e-6, "{filter:?} {u} {v} {depth}: {ours} {truth}");
            }
        }
    }
}

#[test]
fn extreme_volumes_are_right_or_refused() {
    let settings = raw(4).with(|s| s.map.steps = 4096);
    let dense = |extinction: f64| scene(volume([1024, 2, 2], unit_cube(), |_| 1.0), extinction);
    // A texel with 4,096 fragments, along a long row of voxels.
    let mut long = dense(2.0);
    long.lights[0].kind = LightKind::Directional { direction: DVec3::X };
    let map = fragments(&long, &settings);
    assert_eq!(map.fragments(1, 1).count(), 4096);
    assert!((f64::from(map.texel_transmittance(1, 1, 0.25)) - (-0.5_f64).exp()).abs() < 1e-5);
    // Opaque within the first slab.
    let mut opaque = dense(1e9);
    opaque.lights[0].kind = LightKind::Directional { direction: DVec3::X };
    for settings in [settings.clone(), settings.with(|s| s.map.fragments.tolerance = 0.002)] {
        let map = fragments(&opaque, &settings);
        assert_eq!(map.texel_transmittance(1, 1, -0.1), 1.0);
        assert!(map.texel_transmittance(1, 1, 1e-3) < 1e-6);
        assert!(map.texel_transmittance(1, 1, 9.0) < 1e-6);
    }
    // An empty volume.
    let empty = scene(volume([4; 3], unit_cube(), |_| 0.0), 1.0);
    let map = fragments(&empty, &settings);
    assert_eq!((map.runs().nodes().len(), map.bilinear(0.4, 0.6, 1.0)), (0, 1.0));
}
