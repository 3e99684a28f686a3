//! Tests of the shadows of meshes and strands against closed forms and the f64 reference.

use std::f64::consts::PI;

use deepshadow::accuracy::ExactTexels;
use deepshadow::probe::{Probe, ProbePoint, probe};
use deepshadow::reference::Crossings;
use deepshadow::scene::{Beam, Light, LightKind, Media, Scene, Shape, Surface, Surfaces};
use deepshadow::settings::MapKind;
use deepshadow::shadow::TexelMap;
use deepshadow::surface::{Material, Mesh, Strands, Varying};
use deepshadow::{Backend, CpuBackend, Settings, Silent};
use glam::{DMat4, DVec2, DVec3, Vec3};

use crate::support::scenes::{scene, settings, unit_cube, volume};

/// Numbers of 0..1 (xorshift64).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Strands of two points, `thickness` thick.
pub fn rods(ends: &[[DVec3; 2]], thickness: f32, opacity: f32) -> Surface {
    let points: Vec<Vec3> = ends.iter().flatten().map(|p| p.as_vec3()).collect();
    let strands = Strands::new(
        "rods",
        points,
        &vec![2; ends.len()],
        Varying::Same(thickness),
        Varying::Same(opacity),
        Varying::Same(Vec3::ONE),
    );
    Surface::new(Shape::Strands(strands.unwrap().into()), DMat4::IDENTITY).unwrap()
}

pub fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, opacity: f64) -> Surface {
    let material = Material { opacity, ..Material::default() };
    let materials = vec![0; triangles.len()];
    let mesh = Mesh::new("mesh", positions, triangles, vec![material], materials, None).unwrap();
    Surface::new(Shape::Mesh(mesh.into()), DMat4::IDENTITY).unwrap()
}

/// A horizontal square of two triangles around (0, `height`, 0).
pub fn pane(half: f32, height: f32, opacity: f64) -> Surface {
    let corner = |x: f32, z: f32| Vec3::new(x * half, height, z * half);
    let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    mesh(corners, vec![[0, 1, 2], [2, 3, 0]], opacity)
}

/// A ball of radius 1 whose octahedron's edges are cut into `parts`.
pub fn ball(parts: u32, opacity: f64) -> Surface {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for signs in 0..8_u32 {
        let sign = |bit: u32| if signs & bit == 0 { 1.0 } else { -1.0 };
        let corner = |i: u32, j: u32| {
            let k = parts - i - j;
            let p = Vec3::new(sign(1) * i as f32, sign(2) * j as f32, sign(4) * k as f32);
            p.normalize()
        };
        let mut add = |corners: [Vec3; 3]| {
            let first = positions.len() as u32;
            positions.extend(corners);
            triangles.push([first, first + 1, first + 2]);
        };
        for i in 0..parts {
            for j in 0..parts - i {
                add([corner(i, j), corner(i + 1, j), corner(i, j + 1)]);
                if i + j + 2 <= parts {
                    add([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                }
            }
        }
    }
    mesh(positions, triangles, opacity)
}

/// A scene of surfaces alone under light from above.
pub fn bare(surfaces: Vec<Surface>, direction: DVec3) -> Scene {
    let mut bare = scene(volume([2; 3], unit_cube(), |_| 0.0), 0.0);
    bare.media = Media::none();
    bare.lights = vec![Light::directional(direction)];
    bare.surfaces = surfaces.into();
    bare
}

pub fn fragments(size: u32) -> Settings {
    settings(size, [8, 8]).with(|s| s.map.kind = Some(MapKind::Fragments))
}

fn measured(scene: &Scene, settings: &Settings, point: DVec3, how: &Probe) -> f64 {
    let found = probe(scene, settings, &CpuBackend, &[point.into()], how, &Silent).unwrap();
    f64::from(found[0][0][0])
}

pub fn exact(footprint: Option<f64>) -> Probe {
    let mut how = Probe::default();
    (how.exact, how.footprint) = (true, footprint);
    how
}

pub fn through_map(footprint: Option<f64>) -> Probe {
    let mut how = Probe::default();
    how.footprint = footprint;
    how
}

#[test]
fn a_grid_of_strands_takes_its_share_of_the_light() {
    // Rods along x at a distance of .25, .1 thick: they cover 40 %, and two layers 64 %.
    let rod = |z: f64, y: f64| [DVec3::new(-4.0, y, z), DVec3::new(4.0, y, z)];
    let across = |x: f64, y: f64| [DVec3::new(x, y, -4.0), DVec3::new(x, y, 4.0)];
    let places = || (-12..=12).map(|i| f64::from(i) * 0.25);
    let one: Vec<_> = places().map(|z| rod(z, 0.0)).collect();
    let two: Vec<_> = places().map(|x| across(x, -1.0)).chain(one.clone()).collect();
    let point = DVec3::new(0.3, -2.0, 0.2);
    for (ends, layers) in [(one, 1), (two, 2)] {
        let scene = bare(vec![rods(&ends, 0.1, 0.5)], DVec3::NEG_Y);
        let due = (1.0_f64 - 0.5 * 0.4).powi(layers);
        // Over two periods along both, with rays that divide them.
        let found = measured(&scene, &fragments(16), point, &exact(Some(0.5)));
        assert!((found - due).abs() < 0.004, "rays, {layers} layers: {found}, not {due}");
        // Texels smaller and larger than rods, over so many periods that its edges do not matter. The fit may be off by .002 a texel, and where two
        // layers share a texel their parts are taken to be independent, as they are here.
        for size in [60, 700] {
            let found = measured(&scene, &fragments(size), point, &through_map(Some(4.0)));
            assert!((found - due).abs() < 0.004, "{size}^2, {layers} layers: {found}, not {due}");
        }
    }
}

/// The flanks of a strand that tapers off are where the cone around its axis has them.
#[test]
fn strands_may_taper_off() {
    let points = vec![Vec3::NEG_X, Vec3::X];
    let thickness = Varying::PerPoint(vec![0.4, 0.0]);
    let (opacity, white) = (Varying::Same(0.5), Varying::Same(Vec3::ONE));
    let strands = Strands::new("cone", points, &[2], thickness, opacity, white).unwrap();
    let shape = Shape::Strands(strands.into());
    let cone = Surface::new(shape, DMat4::IDENTITY).unwrap();
    let scene = bare(vec![cone], DVec3::NEG_Y);
    for x in [-0.8_f64, -0.5, 0.0, 0.5] {
        // Its half angle has a sine of .1.
        let flank = 0.1 * (1.0 - x);
        for (z, due) in [(flank - 0.006, 0.5), (flank + 0.006, 1.0)] {
            for how in [exact(None), through_map(None)] {
                let found = measured(&scene, &fragments(700), DVec3::new(x, -1.0, z), &how);
                assert!((found - due).abs() < 0.01, "{x}, {z}: {found}, not {due}");
            }
        }
    }
}

#[test]
fn meshes_shadow_what_lies_behind_them() {
    for (opacity, due) in [(1.0, 0.0), (0.5, 0.25), (0.0, 1.0)] {
        let direction = DVec3::new(0.2, -1.0, 0.1);
        let scene = bare(vec![ball(24, opacity)], direction);
        for how in [exact(None), through_map(None)] {
            let at = |t: f64| measured(&scene, &fragments(64), direction * t, &how);
            assert!((at(2.0) - due).abs() < 1e-6, "behind, {opacity}: {}", at(2.0));
            assert!((at(0.0) - due.sqrt()).abs() < 1e-6, "within, {opacity}: {}", at(0.0));
            assert_eq!(at(-2.0), 1.0, "in front, {opacity}");
            let beside = measured(&scene, &fragments(64), DVec3::new(1.5, -2.0, 0.0), &how);
            assert_eq!(beside, 1.0, "beside, {opacity}");
        }
    }
    // Of a square with an edge of 2.5, a ball covers pi / 2.5^2; with n parts an edge a ball of
    // triangles lacks some 1 / n^2 of it.
    let covered = |parts: u32| {
        let crossings = Crossings::of(&vec![ball(parts, 1.0)].into());
        let n = 500;
        let at = |i: u32| ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * 2.5;
        let meets = |i: u32| {
            let from = DVec3::new(at(i % n), 3.0, at(i / n));
            crossings.transmittance(from, DVec3::NEG_Y, [0.0, 9.0]) == 0.0
        };
        (0..n * n).filter(|&i| meets(i)).count() as f64 * (2.5 / f64::from(n)).powi(2)
    };
    let lacks = |parts: u32| PI - covered(parts);
    let (coarse, fine) = (lacks(4), lacks(8));
    eprintln!("a ball of triangles lacks {coarse:.4}, {fine:.4}");
    assert!(fine > 0.0 && coarse / fine > 3.0 && coarse < 0.4, "{coarse} {fine}");
}

/// The radius of the strands below.
const RADIUS: f64 = 0.04;

/// Where strands begin and end.
pub fn ends() -> Vec<[DVec3; 2]> {
    let mut random = Random(5);
    let mut place = || DVec3::from_array([0; 3].map(|_| random.unit())) * 1.6 - 0.8;
    (0..24).map(|_| [place(), place()]).collect()
}

/// Strands, a pane and a ball of glass, and a medium, for lights anywhere.
pub fn mixed(opacity: f64) -> Scene {
    let density = |[x, y, z]: [usize; 3]| ((x * 5 + y * 3 + z * 7) % 11) as f32 / 10.0;
    let mut mixed = scene(volume([8; 3], unit_cube(), density), 2.0);
    let strands = rods(&ends(), 2.0 * RADIUS as f32, opacity as f32);
    mixed.surfaces = vec![strands, pane(0.4, 0.1, 0.6), ball(6, 0.3)].into();
    mixed
}

/// How many of a map's lookups in texels, at several depths, are wrong by more than `allowed`, and
/// how many were made. Where the truth changes within a texel or a strand's radius of depth nothing
/// is looked up, and nothing at the ends of strands, which are round in the truth alone.
fn wrong_lookups(beam: &Beam, against: &Beam, settings: &Settings, allowed: f64) -> (usize, usize) {
    let map = CpuBackend.map(beam, settings, &Silent).unwrap();
    let map = map.as_fragments().unwrap();
    let size = settings.map.size;
    let truth = ExactTexels::new(against, size);
    let n = f64::from(size);
    let (mut wrong, mut count) = (0, 0);
    for y in (0..size).step_by(3) {
        for x in (0..size).step_by(3) {
            let at = |dx: f64, dy: f64, depth: f64| {
                let u = (f64::from(x) + 0.5 + dx) / n;
                let v = (f64::from(y) + 0.5 + dy) / n;
                truth.transmittance(u, v, depth)
            };
            let (origin, direction) =
                beam.view.ray((f64::from(x) + 0.5) / n, (f64::from(y) + 0.5) / n);
            let away = |end: &DVec3| (*end - origin).reject_from(direction).length();
            if ends().iter().flatten().any(|end| away(end) < 1.5 * RADIUS) {
                continue;
            }
            for depth in [0.4, 0.9, 1.3, 1.9, 5.0] {
                let due = at(0.0, 0.0, depth);
                let around = (0..12).map(|i| DVec2::from_angle(f64::from(i) * PI / 6.0));
                // A strand's crossing takes four tenths.
                let alike = |other: f64| (other - due).abs() < 0.1 * due;
                let ways = around.flat_map(|way| [way, 0.5 * way]);
                let smooth = ways.map(|way| at(way.x, way.y, depth)).all(alike)
                    && [-RADIUS, RADIUS].iter().all(|by| alike(at(0.0, 0.0, depth + by)));
                if smooth {
                    count += 1;
                    let found = map.texel_transmittance(x, y, depth as f32);
                    wrong += usize::from((f64::from(found) - due).abs() > allowed);
                }
            }
        }
    }
    (wrong, count)
}

#[test]
fn a_medium_strands_and_meshes_multiply_in_one_texel() {
    let kinds = [
        LightKind::Directional { direction: DVec3::new(0.3, -1.0, 0.2) },
        LightKind::Directional { direction: DVec3::NEG_Y },
        LightKind::Point { position: DVec3::new(0.4, 3.0, 0.5) },
        LightKind::Point { position: DVec3::new(0.05, 0.3, 0.3) },
    ];
    let mut all_bent = 0;
    for kind in kinds {
        let with = |opacity: f64| {
            let mut scene = mixed(opacity);
            scene.lights[0] = Light::new(kind, DVec3::ONE);
            scene.beams().unwrap()
        };
        let settings = fragments(120).with(|s| {
            s.map.fragments.coverage = false;
            s.map.fragments.tolerance = 0.002;
        });
        let (mut wrong, mut count, mut bent) = (0, 0, 0);
        for (beam, other) in with(0.4).iter().zip(&with(0.41)) {
            // The fit's tolerance, and the slabs' own error of as much.
            let found = wrong_lookups(beam, beam, &settings, 0.004);
            (wrong, count) = (wrong + found.0, count + found.1);
            bent += wrong_lookups(other, beam, &settings, 0.004).0;
        }
        eprintln!("{kind:?}: {wrong} of {count} wrong; {bent} with strands 2.5 % more opaque");
        assert!(count > 2_000, "{kind:?}: only {count}");
        assert_eq!(wrong, 0, "{kind:?}: of {count}");
        all_bent += bent;
    }
    assert!(all_bent > 200, "{all_bent}");
}

/// A ball of hair.
pub fn tangle(count: usize) -> Surfaces {
    let mut random = Random(11);
    let mut place = || loop {
        let p = DVec3::from_array([0; 3].map(|_| random.unit())) * 2.0 - 1.0;
        if p.length() < 1.0 {
            break p;
        }
    };
    let ends: Vec<[DVec3; 2]> = (0..count).map(|_| [place(), place()]).collect();
    vec![rods(&ends, 0.02, 0.3)].into()
}

#[test]
fn coverage_adds_up_to_the_area_of_strands() {
    let mut scene = bare(Vec::new(), DVec3::new(0.3, -1.0, 0.2));
    scene.surfaces = tangle(200);
    let Shape::Strands(strands) = &scene.surfaces[0].shape else { panic!() };
    let faint = strands.as_ref().clone().with_values(None, Some(0.01), None).unwrap();
    let light = DVec3::new(0.3, -1.0, 0.2).normalize();
    let area: f64 = (0..faint.count())
        .map(|i| {
            let [a, b] = faint.segment(faint.strand(i).start).ends.map(Vec3::as_dvec3);
            0.02 * (b - a).reject_from(light).length() + 0.25 * PI * 0.02 * 0.02
        })
        .sum();
    let shape = Shape::Strands(faint.into());
    scene.surfaces = vec![Surface::new(shape, DMat4::IDENTITY).unwrap()].into();
    let beam = scene.only_beam().unwrap();
    let settings = fragments(100).with(|s| s.map.fragments.tolerance = 0.0);
    let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
    let map = map.as_fragments().unwrap();
    let texel = beam.view.origin_u.length() * beam.view.origin_v.length() / 1e4;
    let taken: f64 = (0..100 * 100)
        .map(|i| f64::from(1.0 - map.texel_transmittance(i % 100, i / 100, 1e9)))
        .sum();
    // What one strand takes of another's light is a few hundredths of a percent.
    let found = taken * texel / 0.01;
    assert!((found / area - 1.0).abs() < 0.01, "{found} of {area}");
}

#[test]
fn what_is_asked_for_as_a_footprint_gets_better_with_every_doubling() {
    let mut scene = bare(Vec::new(), DVec3::new(0.3, -1.0, 0.2));
    scene.surfaces = tangle(900);
    let mut random = Random(3);
    let points: Vec<ProbePoint> =
        (0..300).map(|_| DVec3::from_array([0; 3].map(|_| random.unit() - 0.5)).into()).collect();
    let rows = |settings: &Settings, how: &Probe| -> Vec<f64> {
        let found = probe(&scene, settings, &CpuBackend, &points, how, &Silent).unwrap();
        found.iter().map(|row| f64::from(row[0][0])).collect()
    };
    let footprint = Some(0.04);
    let truth = rows(&fragments(16), &exact(footprint));
    let mut last = f64::INFINITY;
    for size in [25, 50, 100, 200] {
        let found = rows(&fragments(size), &through_map(footprint));
        let squares = found.iter().zip(&truth).map(|(a, b)| (a - b).powi(2));
        let rms = (squares.sum::<f64>() / truth.len() as f64).sqrt();
        eprintln!("{size}^2: {rms:.4}");
        assert!(rms < 0.8 * last, "{size}^2: {rms}, before {last}");
        last = rms;
    }
    assert!(last < 0.02, "{last}");
    // Without coverage the same map is worse.
    let uncovered = fragments(100).with(|s| s.map.fragments.coverage = false);
    let found = rows(&uncovered, &through_map(footprint));
    let squares = found.iter().zip(&truth).map(|(a, b)| (a - b).powi(2));
    let rms = (squares.sum::<f64>() / truth.len() as f64).sqrt();
    assert!(rms > 1.5 * last, "{rms}");
}
