//! Surfaces that are written are read as they were.

use deepshadow::io::{encode_gltf, encode_hair};
use deepshadow::surface::{Material, Mesh, Strands, Varying};
use deepshadow::volume::Axis;
use glam::{DVec3, Vec3};

use super::surface_fixtures::{mesh, read, strands};

fn points() -> Vec<Vec3> {
    (0..9).map(|i| Vec3::new(i as f32 * 0.1, 1.0 / (i as f32 + 1.0), -0.25 * i as f32)).collect()
}

fn hair(thickness: Varying<f32>, opacity: Varying<f32>, albedo: Varying<Vec3>) -> Strands {
    Strands::new("hair", points(), &[2, 4, 3], thickness, opacity, albedo).unwrap()
}

#[test]
fn hair_comes_back_whichever_numbers_vary() {
    let numbers = |scale: f32| (0..9).map(|i| scale * i as f32).collect::<Vec<f32>>();
    let same = (Varying::Same(0.125), Varying::Same(0.75), Varying::Same(Vec3::new(0.1, 0.2, 0.3)));
    let colors = (0..9).map(|i| Vec3::splat(0.1 * i as f32)).collect();
    let varying = (
        Varying::PerPoint(numbers(0.01)),
        Varying::PerPoint(numbers(0.125)),
        Varying::PerPoint(colors),
    );
    for held in 0..8 {
        let own = hair(
            if held & 1 == 0 { same.0.clone() } else { varying.0.clone() },
            if held & 2 == 0 { same.1.clone() } else { varying.1.clone() },
            if held & 4 == 0 { same.2.clone() } else { varying.2.clone() },
        );
        let (back, notes) = strands(read("m.hair", &encode_hair(&own, Axis::Z).unwrap()));
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(back.points(), own.points());
        let runs = |of: &Strands| (0..of.count()).map(|i| of.strand(i)).collect::<Vec<_>>();
        assert_eq!(runs(&back), runs(&own));
        assert_eq!(back.thickness(), own.thickness());
        assert_eq!(back.opacity(), own.opacity(), "eighths are exact as transparencies");
        assert_eq!(back.albedo(), own.albedo());
    }
}

#[test]
fn a_strand_too_long_for_the_format_is_an_error() {
    let count = 65_537;
    let points = (0..count).map(|i| Vec3::splat(i as f32)).collect();
    let long = |count: u32| vec![count];
    let own = Strands::new(
        "long",
        points,
        &long(count),
        Varying::Same(1.0),
        Varying::Same(1.0),
        Varying::Same(Vec3::ONE),
    );
    let error = encode_hair(&own.unwrap(), Axis::Z).unwrap_err().to_string();
    assert_eq!(error, "hair: a strand of 65537 points; .hair files have at most 65536");
}

/// Two squares at a right angle, of two materials.
fn corner(normals: Option<Vec<[Vec3; 3]>>) -> Mesh {
    let positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1]];
    let positions = positions.map(|p| Vec3::from(p.map(|x| x as f32 / 3.0))).to_vec();
    let triangles = vec![[0, 1, 2], [0, 4, 5], [2, 3, 0], [5, 1, 0]];
    let glass = Material { name: "glass".into(), albedo: DVec3::new(0.25, 0.5, 1.0), opacity: 0.5 };
    let wall = Material { name: "wall".into(), ..Material::default() };
    Mesh::new("corner", positions, triangles, vec![glass, wall], vec![0, 1, 0, 1], normals).unwrap()
}

#[test]
fn meshes_come_back_with_materials_and_normals() {
    let turned = |x: f32| [Vec3::X, Vec3::Y, Vec3::new(0.0, x.sin(), x.cos())];
    let smooth = (0..4).map(|i| turned(i as f32)).collect();
    for own in [corner(None), corner(Some(smooth))] {
        let (back, notes) = mesh(read("m.glb", &encode_gltf(&own, Axis::Y).unwrap()));
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(back.is_flat(), own.is_flat());
        // Triangles come by their materials.
        for (new, old) in [0, 2, 1, 3].into_iter().enumerate() {
            assert_eq!(back.corners(new), own.corners(old));
            for (new, old) in back.normals(new).into_iter().zip(own.normals(old)) {
                assert!((new - old).length() < 1e-6, "{new} {old}");
            }
            let (new, old) = (back.material(new), own.material(old));
            assert_eq!(new.name, old.name);
            assert!((new.albedo - old.albedo).length() < 1e-7);
            assert_eq!(new.opacity, old.opacity);
        }
        if own.is_flat() {
            assert_eq!(back.positions(), own.positions());
        }
    }
}

#[test]
fn what_points_up_points_up_in_the_file() {
    let own = corner(Some(vec![[Vec3::Z; 3]; 4]));
    let (back, _) = mesh(read("m.glb", &encode_gltf(&own, Axis::Z).unwrap()));
    // A file's z is the world's y, and its y goes to the back.
    let turned = |v: Vec3| Vec3::new(v.x, v.z, -v.y);
    assert_eq!(back.corners(0), own.corners(0).map(turned));
    assert_eq!(back.normals(0), [Vec3::Y; 3]);
    let own = hair(Varying::Same(1.0), Varying::Same(1.0), Varying::Same(Vec3::ONE));
    let (back, _) = strands(read("m.hair", &encode_hair(&own, Axis::Y).unwrap()));
    let turned: Vec<Vec3> = own.points().iter().map(|v| Vec3::new(v.x, -v.z, v.y)).collect();
    assert_eq!(back.points(), turned);
}
