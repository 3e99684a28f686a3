//! The lists of surfaces that a GPU makes are those of the CPU.
#![cfg(feature = "gpu")]

use deepshadow::backend::Passes;
use deepshadow::frame::{Frame, FrameSurfaces};
use deepshadow::gpu::{AdapterChoice, GpuBackend, Tile};
use deepshadow::scene::{Beam, LightKind, Scene, Shape, Surface, Surfaces};
use deepshadow::shadow::{Node, Runs};
use deepshadow::surface::{Strands, Varying};
use deepshadow::{CpuBackend, Settings, Silent};
use glam::{DMat4, DVec3, Vec3};

use crate::support::backends::{gpu, interpolates_in_f32};
use crate::support::scenes::{scene, unit_cube, volume};
use crate::surfaces::{ball, bare, fragments, pane};

const SIZE: u32 = 120;
/// Rounding of places in texels: eight times half an ulp of the map's size.
const PLACE: f32 = 8.0 * SIZE as f32 * f32::EPSILON;
/// Largest opacity of the strands.
const OPACITY: f32 = 0.4;
/// Rounding of depths along the steepest strands, which gain 16 texels of .02 over one, and of what
/// lies four lengths away.
const DEPTH: f32 = 16.0 * PLACE * 0.02 + 8.0 * 4.0 * f32::EPSILON;
/// On hardware that weighs voxels with 8 bits, each of three weights may be off by 1/512, and the
/// densities of neighbours differ by 1 at most, so optical depth by 3/512 of that of a density of 1,
/// and transmittance by that share of x exp(-x), which is at most 1 / e.
const EIGHT_BIT_MEDIA: f32 = 3.0 / 512.0 * 0.37;
/// Of all texels, so many at most may differ by more: middles within `PLACE` of an edge of a
/// triangle or, without coverage, of a strand, which half a thousand edges across the map may have.
const AT_EDGES: usize = (500.0 * 2.0 * PLACE * SIZE as f32) as usize;

fn lists(runs: &Runs) -> Vec<&[Node]> {
    runs.starts().windows(2).map(|ends| &runs.nodes()[ends[0] as usize..ends[1] as usize]).collect()
}

/// Strands that bend, so that texels hold several segments of one.
fn curls(thickness: f32, opacity: f32) -> Surface {
    let (count, points) = (60, 24);
    let place = |i: usize, j: usize| {
        let (a, t) = (i as f32 * 2.399, j as f32 / points as f32);
        let radius = 0.15 + 0.8 * (i as f32 / count as f32);
        let turn = a + 5.0 * t;
        Vec3::new(radius * turn.cos(), 1.6 * t - 0.8, radius * turn.sin())
    };
    let all = (0..count).flat_map(|i| (0..points).map(move |j| place(i, j))).collect();
    let (thickness, opacity) = (Varying::Same(thickness), Varying::Same(opacity));
    let white = Varying::Same(Vec3::ONE);
    let strands =
        Strands::new("curls", all, &[points as u32; 60], thickness, opacity, white).unwrap();
    Surface::new(Shape::Strands(strands.into()), DMat4::IDENTITY).unwrap()
}

/// Scenes whose surfaces are `bent`: opacities and thicknesses are multiplied by it.
pub fn scenes(bent: f64) -> Vec<(&'static str, Scene)> {
    let under = |surfaces: Surfaces, light: Option<DVec3>| {
        let mut scene = bare(Vec::new(), DVec3::new(0.3, -1.0, 0.2));
        scene.surfaces = surfaces;
        if let Some(position) = light {
            scene.lights[0].kind = LightKind::Point { position };
        }
        scene
    };
    let by = bent as f32;
    let hair = || Surfaces::from(vec![curls(0.03 * by, OPACITY * by)]);
    let panes =
        || vec![ball(12, 0.3 * bent), pane(2.0, 0.1, 0.5 * bent), pane(0.7, -0.3, 0.9 * bent)];
    let density = |[x, y, z]: [usize; 3]| ((x * 5 + y * 3 + z * 7) % 11) as f32 / 10.0;
    let mut mixed = scene(volume([8; 3], unit_cube(), density), 2.0);
    mixed.surfaces = vec![curls(0.03 * by, OPACITY * by), pane(0.4, 0.1, 0.6 * bent)].into();
    let mut inside = mixed.clone();
    inside.lights[0].kind = LightKind::Point { position: DVec3::new(0.05, 0.02, -0.03) };
    vec![
        ("hair", under(hair(), None)),
        ("hair, lamp", under(hair(), Some(DVec3::new(2.0, 3.0, 1.0)))),
        ("hair, lamp inside", under(hair(), Some(DVec3::new(0.02, 0.1, -0.03)))),
        ("ball", under(vec![ball(12, 0.3 * bent)].into(), None)),
        ("ball and panes", under(panes().into(), None)),
        ("ball and panes, lamp", under(panes().into(), Some(DVec3::new(2.0, 3.0, 1.0)))),
        ("volume, hair, pane", mixed),
        ("volume, hair, pane, lamp inside", inside),
    ]
}

fn settings(tolerance: f64, coverage: bool) -> Settings {
    fragments(SIZE).with(|s| {
        s.map.fragments.tolerance = tolerance;
        s.map.fragments.truncation = 0.0;
        s.map.fragments.coverage = coverage;
    })
}

/// The lists of a scene's beams.
fn made(backend: &dyn Passes, scene: &Scene, settings: &Settings) -> Vec<Runs> {
    made_within(settings.map.fragments.memory, backend, scene, settings)
}

/// The same with so many bytes at a time.
fn made_within(memory: u64, backend: &dyn Passes, scene: &Scene, settings: &Settings) -> Vec<Runs> {
    let of = |beam: &Beam| {
        let frame = Frame::new(beam, settings).unwrap();
        backend.trace_slices(beam.casters(), &frame, memory, &Silent).unwrap()
    };
    scene.beams_for(settings).unwrap().iter().map(of).collect()
}

/// The same, of surfaces that the graphics pipeline draws.
fn drawn(backend: &GpuBackend, scene: &Scene, settings: &Settings) -> Vec<Runs> {
    let gpu = backend.renderer();
    let of = |beam: &Beam| {
        let frame = Frame::new(beam, settings).unwrap();
        let media = gpu.upload(&beam.media).unwrap();
        let surfaces = gpu.upload_surfaces(&FrameSurfaces::of(beam.casters())).unwrap();
        let frame = gpu.frame(&frame, &media).unwrap();
        let lists = gpu.lists(surfaces.over(Tile::rows(SIZE, 0, SIZE, 1 << 20)));
        let fragments = gpu.fragments(Tile::rows(SIZE, 0, SIZE, 256)).unwrap();
        gpu.submit(|encoder| {
            gpu.draw_surfaces(encoder, &surfaces, &frame, &lists)?;
            gpu.sort_surfaces(encoder, &lists)?;
            gpu.prepare_casters(&media, &lists, &frame, &fragments).record(encoder)
        })
        .unwrap();
        assert!(gpu.fragments_drawn(&lists).unwrap() <= 1 << 20);
        assert_eq!(gpu.nodes_missing(&fragments).unwrap(), None);
        gpu.read_fragments(&fragments).unwrap()
    };
    scene.beams_for(settings).unwrap().iter().map(of).collect()
}

/// What is between two sets of lists.
#[derive(Debug, Default)]
struct Difference {
    /// Texels whose lists have other numbers of nodes, or let other shares of light through, by more
    /// than rounding explains.
    texels: usize,
    /// The largest difference of transmittance behind everything, of the other texels.
    largest: f32,
    /// The largest difference of nodes' depths, of the other texels.
    depth: f32,
}

/// How far rounding may change what a list lets through: by the areas of its strands, of which each
/// has two flanks as long as a texel's diagonal at most, and by eight roundings of each optical depth
/// (logarithms are exact to 2^-21 on any device).
fn allowed(nodes: &[Node]) -> f32 {
    nodes.len() as f32 * (OPACITY * 2.0 * std::f32::consts::SQRT_2 * PLACE + 8.0 * 2e-7 + 5e-7)
}

/// `media` is how far media may differ in transmittance.
fn difference(cpu: &[Runs], own: &[Runs], media: f32) -> Difference {
    let mut all = Difference::default();
    assert_eq!(cpu.len(), own.len());
    for (a, b) in cpu.iter().zip(own).flat_map(|(cpu, own)| lists(cpu).into_iter().zip(lists(own)))
    {
        let through = |nodes: &[Node]| nodes.last().map_or(1.0, |node| (-node.optical_depth).exp());
        let off = (through(a) - through(b)).abs();
        let depths = a.iter().zip(b).map(|(a, b)| (a.depth - b.depth).abs());
        let depth = depths.fold(0.0, f32::max);
        // A strand that touches a texel in a point may be there or not, and where a ray grazes a
        // triangle they meet anywhere. Media that differ are cut into other slabs.
        let is_same = media > 0.0 || (a.len() == b.len() && depth <= DEPTH);
        if !is_same || off > allowed(a) + media {
            all.texels += 1;
            continue;
        }
        all.largest = all.largest.max(off);
        all.depth = all.depth.max(depth);
    }
    all
}

/// Every way to list surfaces on a GPU, in every scene, against the CPU; says what is not the same.
fn complaints(backend: &GpuBackend, bent: f64) -> Vec<String> {
    let mut complaints = Vec::new();
    for (right, (name, scene)) in scenes(1.0).into_iter().zip(scenes(bent)).map(|(a, b)| (a.1, b)) {
        let is_exact = interpolates_in_f32(backend) || right.media.bodies().is_empty();
        let media = if is_exact { 0.0 } else { EIGHT_BIT_MEDIA };
        for coverage in [true, false] {
            let settings = settings(0.0, coverage);
            let cpu = made(&CpuBackend, &right, &settings);
            let own = [made(backend, &scene, &settings), drawn(backend, &scene, &settings)];
            for (how, own) in ["computed", "drawn"].into_iter().zip(own) {
                let found = difference(&cpu, &own, media);
                let said = format!("{name}, coverage {coverage}, {how}: {found:?}");
                eprintln!("{said}");
                if found.texels > AT_EDGES * cpu.len() {
                    complaints.push(said);
                }
            }
        }
    }
    complaints
}

#[test]
fn a_gpu_lists_surfaces_as_the_cpu_does_and_one_percent_is_noticed() {
    if gpu().is_none() {
        return;
    }
    let backend = GpuBackend::open(AdapterChoice::Any).unwrap();
    let found = complaints(&backend, 1.0);
    assert!(found.is_empty(), "{found:#?}");
    let found = complaints(&backend, 1.01);
    assert_eq!(found.len(), 4 * scenes(1.0).len(), "{found:#?}");
}

/// Transmittance at a depth.
fn transmittance(nodes: &[Node], depth: f32) -> f32 {
    let before = nodes.partition_point(|node| node.depth <= depth);
    let Some(a) = before.checked_sub(1).map(|i| nodes[i]) else { return 1.0 };
    let Some(b) = nodes.get(before) else { return (-a.optical_depth).exp() };
    let share = (depth - a.depth) / (b.depth - a.depth);
    (-(a.optical_depth + (b.optical_depth - a.optical_depth) * share)).exp()
}

#[test]
fn lists_that_a_gpu_fits_keep_the_tolerance() {
    const TOLERANCE: f64 = 0.004;
    let Some(gpu) = gpu() else { return };
    // Slabs of media are not cut alike in raw and in fitted lists.
    for (name, scene) in scenes(1.0).into_iter().filter(|(_, it)| it.media.bodies().is_empty()) {
        let [raw, fitted] = [0.0, TOLERANCE].map(|it| made(&*gpu, &scene, &settings(it, true)));
        let (mut largest, mut count) = (0.0_f32, [0, 0]);
        for (raw, fitted) in raw.iter().zip(&fitted) {
            for (raw, fitted) in lists(raw).into_iter().zip(lists(fitted)) {
                // Within a few roundings of depth nothing can be told.
                let told = |pair: &&[Node]| pair[1].depth - pair[0].depth > 1e-5 * pair[1].depth;
                for pair in raw.windows(2).filter(told) {
                    let depth = 0.5 * (pair[0].depth + pair[1].depth);
                    let off = transmittance(raw, depth) - transmittance(fitted, depth);
                    largest = largest.max(off.abs());
                }
            }
            count = [count[0] + raw.nodes().len(), count[1] + fitted.nodes().len()];
        }
        eprintln!("{name}: {largest:.1e}, {count:?} nodes");
        assert!(f64::from(largest) <= TOLERANCE && count[1] <= count[0], "{name}: {largest}");
    }
}

/// With memory for a few rows at a time, and for a few parts at first, there are the same lists.
#[test]
fn a_gpu_lists_the_same_under_any_memory() {
    let Some(gpu) = gpu() else { return };
    let scene = scenes(1.0).swap_remove(6).1;
    let with = |memory: u64| made_within(memory, &*gpu, &scene, &settings(0.0, true));
    let all = with(1 << 30);
    // The last is less than a row needs.
    for memory in [1 << 20, 1 << 16, 1 << 10] {
        let own = with(memory);
        let found = difference(&all, &own, 0.0);
        assert_eq!((found.texels, found.depth), (0, 0.0), "{memory}: {found:?}");
        assert_eq!(own[0].nodes().len(), all[0].nodes().len());
    }
}
