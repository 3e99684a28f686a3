//! Meshes: what is read is what was written.

use deepshadow::io::surface_files;
use deepshadow::surface::{Material, Mesh};
use glam::{DVec3, Vec3};
use serde_json::{Value as Json, json};

use super::surface_fixtures::{
    MTL, OBJ, buffer, corners, document, error, floats, glb, gltf, mesh, read, read_beside, write,
};

fn material(name: &str, albedo: [f64; 3], opacity: f64) -> Material {
    Material { name: name.to_owned(), albedo: DVec3::from(albedo), opacity }
}

#[test]
fn obj_faces_have_their_corners_and_materials() {
    let (found, notes) = mesh(read_beside("m.obj", OBJ.as_bytes(), &[("of it.mtl", MTL)]));
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let top = [0.0, 0.0, 2.0];
    assert_eq!(corners(&found), [[a, b, c], [a, c, d], [a, b, top], [top, d, a]]);
    // One of the six vertices is not used.
    assert_eq!((found.name.as_str(), found.positions().len()), ("m", 5));
    let red = material("red", [0.5, 0.25, 0.125], 0.75);
    let glass = material("thin glass", [0.5; 3], 0.75);
    assert_eq!(found.materials(), [red.clone(), glass.clone()]);
    let of_triangles: Vec<&Material> = (0..4).map(|i| found.material(i)).collect();
    assert_eq!(of_triangles, [&red, &red, &glass, &glass]);
    assert_eq!(notes, ["1 texture is not read; `Kd` and `d` count alone"]);
}

#[test]
fn a_missing_material_file_is_a_note() {
    let (found, notes) = mesh(read("m.obj", OBJ.as_bytes()));
    assert_eq!(found.triangles().len(), 4);
    assert_eq!(found.materials()[1], material("thin glass", [0.7; 3], 1.0));
    let [first, second, third] = [&notes[0], &notes[1], &notes[2]];
    assert!(first.contains("of: ") && second.contains("it.mtl: "), "{notes:?}");
    assert!(third.starts_with("2 materials are in no file"), "{notes:?}");
}

#[test]
fn material_files_may_be_several_and_odd() {
    let obj = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nmtllib a.mtl b.mtl\nusemtl x\nf 3 2 1\n";
    let a = b"Kd 1 1 1\nnewmtl x\nKd spectral file.rfl 1\nd -halo 0.5\nnewmtl y\nKd nan 1 1\nd\n";
    let b = b"newmtl x\nKd 2 0.5 -1\nTr 0.25\nd 7\nnewmtl \xff\xfe\nKd\n";
    let (found, notes) = mesh(read_beside("m.obj", obj, &[("a.mtl", a), ("b.mtl", b)]));
    assert_eq!(*found.material(1), material("x", [1.0, 0.5, 0.0], 1.0));
    assert_eq!(*found.material(0), Material::default());
    assert_eq!(notes, ["3 numbers are clamped to 0..1 in its materials"]);
}

#[test]
fn obj_lines_that_are_wrong_are_named() {
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (line, word) in [
        ("f 0 1 2", "line 4: vertex 0 of 3"),
        ("f 1 2 4", "line 4: vertex 4 of 3"),
        ("f 1 2 -4", "line 4: vertex -4 of 3"),
        ("f 1 2 9223372036854775807", "line 4: vertex 9223372036854775807 of 3"),
        ("f -9223372036854775808 1 2", "line 4: vertex -9223372036854775808 of 3"),
        ("f 4294967296 1 2", "line 4: vertex 4294967296 of 3"),
        ("f 1 2 x/1", "line 4: 'x/1' is not a vertex"),
        ("f 1 2 \\\n3 9", "line 5: vertex 9 of 3"),
        ("v 1 2", "line 4: '1 2' is not three numbers"),
        ("v 1 2 z", "line 4: '1 2 z' is not three numbers"),
        ("f 1 2", "it has no triangles"),
        ("l 1 2 3", "it has no triangles"),
    ] {
        let text = error(read("m.obj", format!("{square}{line}\n").as_bytes()));
        assert!(text.contains(word), "{text}");
    }
    // A vertex may follow the face that names it.
    let (found, notes) = mesh(read("m.obj", b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nl 1 2 3"));
    assert_eq!(found.triangles(), [[0, 1, 2]]);
    assert!(notes[0].starts_with("1 face is of fewer than three"), "{notes:?}");
    assert!(notes[1].starts_with("1 element is left out"), "{notes:?}");
}

#[test]
fn triangles_that_are_not_finite_are_left_out_with_a_note() {
    let text = b"v 0 0 0\nv nan 0 0\nv 0 1e39 0\nv 1 0 0\nv 0 0 1\nf 1 2 4\nf 1 3 4\nf 1 4 5\n";
    let (found, notes) = mesh(read("m.obj", text));
    assert_eq!((found.triangles().len(), found.skipped()), (1, 2));
    assert_eq!(notes, ["2 triangles are left out, with vertices that are not finite"]);
    let text = error(read("m.obj", b"v nan 0 0\nf 1 1 1\n"));
    assert!(text.contains("none of its 1 triangles"), "{text}");
}

/// The triangles of [`document`]: 2 x (x + 1), a quarter turn about z, 10 along x.
fn expected() -> Vec<[[f32; 3]; 3]> {
    let placed = |[x, y]: [f32; 2]| [10.0 - 2.0 * y, 2.0 * (x + 1.0), 0.0];
    let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(placed);
    vec![
        [a, b, c],
        [a, c, d],
        // A strip, a fan, and triangles again.
        [a, b, c],
        [b, c, d],
        [a, b, c],
        [a, c, d],
        [a, b, c],
        [a, c, d],
    ]
}

#[test]
fn gltf_triangles_are_placed_by_their_nodes_wherever_their_bytes_are() {
    let beside = document(Some("my%20buffer.bin")).to_string();
    let with_mark = [b"\xef\xbb\xbf", &gltf()[..]].concat();
    for (name, bytes) in [
        ("m.glb", glb(&document(None), &buffer())),
        ("m.gltf", gltf()),
        ("m.gltf", with_mark),
        ("m.gltf", beside.into_bytes()),
    ] {
        let others: [(&str, &[u8]); 1] = [("my buffer.bin", &buffer())];
        let (found, notes) = mesh(read_beside(name, &bytes, &others));
        for (found, expected) in corners(&found).iter().flatten().zip(expected().iter().flatten()) {
            let error = (0..3).map(|axis| (found[axis] - expected[axis]).abs()).fold(0.0, f32::max);
            // The document has eight digits of a rotation.
            assert!(error < 4e-6, "{found:?} {expected:?}");
        }
        assert_eq!(corners(&found).len(), expected().len());
        // Two accessors, one of them used by three primitives.
        assert_eq!(found.positions().len(), 8);
        let opacity: Vec<f64> = (0..8).map(|i| found.material(i).opacity).collect();
        assert_eq!(opacity, [1.0, 1.0, 0.25, 0.25, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(*found.material(2), material("glass", [0.5, 0.25, 1.0], 0.25));
        assert_eq!(*found.material(7), material("", [1.0; 3], 1.0));
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].starts_with("1 primitive is of points or lines"), "{notes:?}");
    }
}

#[test]
fn sparse_vertices_replace_those_of_the_buffer() {
    let mut bin = buffer();
    bin.extend([1, 3, 0, 0]);
    bin.extend(floats(&[5.0, 0.0, 0.0, 0.0, 7.0, 0.0]));
    let mut all = document(None);
    all["buffers"][0]["byteLength"] = bin.len().into();
    all["nodes"] = json!([{ "mesh": 0 }]);
    let views = all["bufferViews"].as_array_mut().unwrap();
    views.push(json!({ "buffer": 0, "byteOffset": 108, "byteLength": 4 }));
    views.push(json!({ "buffer": 0, "byteOffset": 112, "byteLength": 24 }));
    let indices = json!({ "bufferView": 3, "componentType": 5121 });
    all["accessors"][0]["sparse"] =
        json!({ "count": 2, "indices": indices, "values": { "bufferView": 4 } });
    let first = |all: &Json| mesh(read("m.glb", &glb(all, &bin))).0.corners(0);
    assert_eq!(first(&all).map(|corner| corner.x), [0.0, 5.0, 1.0]);
    let (found, _) = mesh(read("m.glb", &glb(&all, &bin)));
    assert_eq!(found.corners(1)[2].to_array(), [0.0, 7.0, 0.0]);
    // Without a view they replace zeros.
    all["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(first(&all).map(|corner| corner.x), [0.0, 5.0, 0.0]);
    all["accessors"][0]["count"] = 3.into();
    let text = error(read("m.glb", &glb(&all, &bin)));
    assert!(text.contains("accessor 0: sparse item 3 of 3"), "{text}");
}

#[test]
fn integers_are_numbers_as_they_are_unless_normalized() {
    let with = |kind: u32, normalized: bool, corner: &[u8]| {
        let mut all = document(None);
        all["nodes"] = json!([{ "mesh": 0 }]);
        all["scenes"][1]["nodes"] = json!([0]);
        all["accessors"][0]["componentType"] = kind.into();
        all["accessors"][0]["normalized"] = normalized.into();
        let mut bin = buffer();
        bin[..corner.len()].copy_from_slice(corner);
        mesh(read("m.glb", &glb(&all, &bin))).0.corners(0)[0].to_array()
    };
    assert_eq!(with(5120, false, &[1, 0x80, 0x7f]), [1.0, -128.0, 127.0]);
    assert_eq!(with(5120, true, &[0, 0x80, 0x7f]), [0.0, -1.0, 1.0]);
    assert_eq!(with(5121, true, &[0, 51, 255]), [0.0, 0.2, 1.0]);
    assert_eq!(with(5122, false, &[1, 0, 0, 0x80, 2, 0]), [1.0, -32768.0, 2.0]);
    assert_eq!(with(5123, true, &[0xff, 0xff, 0x33, 0x33, 0, 0]), [1.0, 0.2, 0.0]);
}

#[test]
fn documents_without_a_scene_show_all_nodes_and_odd_ones_are_noted() {
    let mut all = document(None);
    all.as_object_mut().unwrap().remove("scenes");
    all.as_object_mut().unwrap().remove("scene");
    all["nodes"][2]["skin"] = 0.into();
    all["nodes"][2]["weights"] = json!([0.5]);
    all["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 9 });
    all["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing", "KHR_materials_ior"]);
    all["animations"] = json!([{ "channels": [], "samplers": [] }]);
    let (found, notes) = mesh(read("m.glb", &glb(&all, &buffer())));
    assert_eq!(found.triangles().len(), 16);
    for word in ["skinned", "morphed", "1 texture", "EXT_mesh_gpu_instancing", "animations"] {
        assert!(notes.iter().any(|note| note.contains(word)), "{word}: {notes:?}");
    }
    // The corners of the second node's first triangle are those of the buffer.
    assert!(corners(&found).contains(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]));
}

#[test]
fn every_file_that_a_mesh_is_read_from_is_listed() {
    let folder = tempfile::tempdir().unwrap();
    let obj = write(folder.path(), "m.obj", OBJ.as_bytes());
    assert_eq!(surface_files(&obj).unwrap(), std::slice::from_ref(&obj));
    let mtl = write(folder.path(), "of it.mtl", MTL);
    assert_eq!(surface_files(&obj).unwrap(), [obj, mtl]);
    let text = document(Some("my%20buffer.bin")).to_string();
    let gltf = write(folder.path(), "m.gltf", text.as_bytes());
    let bin = folder.path().join("my buffer.bin");
    assert_eq!(surface_files(&gltf).unwrap(), [gltf, bin]);
    let glb = write(folder.path(), "m.glb", &glb(&document(None), &buffer()));
    assert_eq!(surface_files(&glb).unwrap(), [glb]);
}

/// The normals at a triangle's corners, rounded to thousandths.
fn normals(mesh: &Mesh, triangle: usize) -> [[f32; 3]; 3] {
    mesh.normals(triangle).map(|n| n.to_array().map(|x| (x * 1000.0).round() / 1000.0 + 0.0))
}

const ROOF: &str = "v 0 0 0\nv 0 0 1\nv 1 0.3 0\nv 1 0.3 1\nv 2 0 0\nv 2 0 1\n";

#[test]
fn obj_normals_are_the_files_or_smooth_up_to_an_angle() {
    let of = |faces: &str| mesh(read("m.obj", format!("{ROOF}{faces}").as_bytes())).0;
    // Without normals, the ridge of a flat roof is smooth: both sides' normals meet there.
    let faces = "f 1 2 4 3\nf 3 4 6 5\n";
    let flat = |slope: f32| (Vec3::new(slope, 1.0, 0.0).normalize() * 1000.0).round() / 1000.0;
    let smooth = of(faces);
    assert!(!smooth.is_flat());
    let [eaves, _, ridge] = normals(&smooth, 0);
    assert_eq!((eaves, ridge), (flat(-0.3).to_array(), [0.0, 1.0, 0.0]));
    // That of a steep one is sharp, and so is everything where smoothing is off.
    let steep = of(&format!("{}{faces}", ROOF.replace("0.3", "1.3"))
        .replace("f 1 2 4 3\nf 3 4 6 5", "f 7 8 10 9\nf 9 10 12 11"));
    assert_eq!(normals(&steep, 0), [flat(-1.3).to_array(); 3]);
    for off in ["s off\n", "s 0\n"] {
        assert_eq!(normals(&of(&format!("{off}{faces}")), 0), [flat(-0.3).to_array(); 3]);
    }
    assert_eq!(normals(&of(&format!("s 1\n{faces}s off\n")), 0)[2], [0.0, 1.0, 0.0]);
    // Normals of the file, some of them missing, of no direction or counted backwards.
    let given = of("vn 0 3 4\nvn 0 0 0\nvn 2 0 0\nf 1//1 2//-1 4//2 3\nf 3/7/1 4//9 6 5\n");
    let own = flat(-0.3).to_array();
    assert_eq!(normals(&given, 0), [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], own]);
    assert_eq!(normals(&given, 1), [[0.0, 0.6, 0.8], own, own]);
    let other = flat(0.3).to_array();
    assert_eq!(normals(&given, 2), [[0.0, 0.6, 0.8], other, other]);
}

#[test]
fn gltf_normals_turn_with_their_nodes_and_are_sharp_without() {
    let sharp = mesh(read("m.glb", &glb(&document(None), &buffer()))).0;
    assert!(sharp.is_flat() && normals(&sharp, 0) == [[0.0, 0.0, 1.0]; 3]);
    let mut all = document(None);
    all["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0.into();
    let (found, _) = mesh(read("m.glb", &glb(&all, &buffer())));
    // The node turns x to y; the first normal has no direction.
    let half = 0.707;
    assert_eq!(normals(&found, 0), [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-half, half, 0.0]]);
    // Other primitives have none.
    assert_eq!(normals(&found, 2), [[0.0, 0.0, 1.0]; 3]);
    // Unequal scales turn normals the other way.
    all["nodes"][0]["scale"] = json!([2, 1, 1]);
    let (found, _) = mesh(read("m.glb", &glb(&all, &buffer())));
    assert_eq!(normals(&found, 0)[2], [-0.894, 0.447, 0.0]);
}
