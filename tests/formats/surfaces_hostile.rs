//! Whatever the bytes of hair or a mesh are: an answer or an error, soon, and in little memory.

use std::time::{Duration, Instant};

use deepshadow::io::{SurfaceFile, read_surface};
use serde_json::{Value as Json, json};

use super::surface_fixtures::{
    Hair, MTL, OBJ, Read, base64, buffer, corners, document, error, glb, mesh, read, read_beside,
    seeds, tfx, write,
};
use super::vdb_hostile::{Random, mutate, rounds};

/// Longest time that a file may take, in an unoptimised build on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);

/// Reads the bytes in time, and walks through what they hold.
fn exercise(name: &str, bytes: &[u8], what: &str) -> Read {
    let start = Instant::now();
    let found = read(name, bytes);
    match &found {
        Ok((SurfaceFile::Mesh(mesh), _)) => {
            assert!(corners(mesh).iter().flatten().flatten().all(|x| x.is_finite()), "{what}");
        }
        Ok((SurfaceFile::Strands(strands), _)) => {
            let ends = (0..strands.count()).map(|index| strands.strand(index).end);
            assert_eq!(ends.max(), Some(strands.points().len()), "{what}");
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
    assert!(start.elapsed() < PATIENCE, "{what} took {:?}", start.elapsed());
    found
}

#[test]
fn mutated_surfaces_give_an_answer_or_an_error() {
    let rounds = rounds(300);
    for (number, (_, name, whole)) in seeds().into_iter().enumerate() {
        let mut read = 0;
        for round in 0..rounds {
            let mut random = Random(17 + (number * rounds + round) as u64 * 0x9e37_79b9);
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut random);
            let what = format!("{name}, round {round}");
            read += usize::from(exercise(name, &bytes, &what).is_ok());
        }
        eprintln!("{name}: read {read} of {rounds}");
    }
}

/// Each number of a text replaced by numbers that are easily forgotten.
fn replaced(text: &str) -> Vec<String> {
    const NUMBERS: [&str; 11] = [
        "0",
        "-1",
        "1",
        "5",
        "255",
        "0.5",
        "4294967295",
        "18446744073709551615",
        "1e30",
        "-1e300",
        "nan",
    ];
    let is_number = |c: char| c.is_ascii_digit() || "+-.".contains(c);
    let mut texts = Vec::new();
    let mut at = 0;
    while let Some(begin) = text[at..].find(|c: char| c.is_ascii_digit()).map(|found| at + found) {
        at = text[begin..].find(|c| !is_number(c)).map_or(text.len(), |length| begin + length);
        texts.extend(NUMBERS.map(|number| format!("{}{number}{}", &text[..begin], &text[at..])));
    }
    texts
}

#[test]
fn any_number_in_a_text_may_be_any_other() {
    let document = document(Some("data:;base64,A"));
    let texts = replaced(&document.to_string());
    assert!(texts.len() > 500);
    let uri = format!("data:;base64,{}", base64(&buffer()));
    let mut read = 0;
    for text in texts {
        let text = text.replace("data:;base64,A", &uri);
        read += usize::from(exercise("m.gltf", text.as_bytes(), &text).is_ok());
    }
    eprintln!("glTF: read {read}");
    for text in replaced(OBJ) {
        let _ = exercise("m.obj", text.as_bytes(), &text);
    }
    for mtl in replaced(&String::from_utf8_lossy(MTL)) {
        assert!(read_beside("m.obj", OBJ.as_bytes(), &[("of it.mtl", mtl.as_bytes())]).is_ok());
    }
}

#[test]
fn a_surface_cut_anywhere_is_an_error() {
    for (target, name, whole) in seeds() {
        assert!(read(name, &whole).is_ok(), "{name}");
        for length in 0..whole.len() {
            let found = exercise(name, &whole[..length], &format!("{name} cut at {length}"));
            // Text may end with any line, and its last number with any digit.
            assert!(found.is_err() || target == "obj", "{name} cut at {length}");
        }
    }
    for length in 0..MTL.len() {
        let found = read_beside("m.obj", OBJ.as_bytes(), &[("of it.mtl", &MTL[..length])]);
        assert!(found.is_ok(), "materials cut at {length}");
    }
}

#[test]
fn counts_that_the_file_cannot_hold_are_refused_before_memory_is_asked_for() {
    let with = |mut bytes: Vec<u8>, places: &[usize]| {
        for &at in places {
            bytes[at..at + 4].fill(0xff);
        }
        bytes
    };
    let hair = Hair::new(0b11111).bytes();
    for places in [&[4][..], &[8], &[4, 8], &[16]] {
        let bytes = with(hair.clone(), places);
        let plain = read("h.hair", &bytes);
        if places == [16] {
            // The default of segments does not count here.
            assert!(plain.is_ok());
            continue;
        }
        let text = error(plain);
        assert!(text.contains("4294967295"), "{text}");
        let text = error(read("h.hair.gz", &super::gzip(&bytes)));
        assert!(text.contains("but it has at most"), "{text}");
    }
    for places in [&[4][..], &[8], &[4, 8], &[12], &[24], &[28]] {
        let text = error(read("h.tfx", &with(tfx(2, 3, true), places)));
        assert!(text.contains("neither hair nor") || text.contains("bytes, but it"), "{text}");
    }
    let edits: [(&str, Json, &str); 11] = [
        ("/accessors/0/count", json!(u64::MAX), "accessor 0: it ends at byte"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessor 0: it ends at byte"),
        ("/accessors/2/count", json!(1_u64 << 62), "accessor 2: it ends at byte"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "view 0: it ends at byte"),
        ("/bufferViews/1/byteOffset", json!(u64::MAX), "view 1: it ends at byte"),
        ("/bufferViews/0/byteStride", json!(4), "12 bytes every 4"),
        ("/bufferViews/0/byteStride", json!(usize::MAX), "accessor 0: it ends at byte"),
        ("/buffers/0/byteLength", json!(109), "108 bytes, expected 109"),
        ("/accessors/0/bufferView", json!(7), "view 7 of 3"),
        ("/bufferViews/0/buffer", json!(1), "buffer 1 of 1"),
        ("/accessors/0/bufferView", Json::Null, "accessor 0 has no bytes"),
    ];
    for (place, value, word) in edits {
        let mut all = document(None);
        if place.ends_with("byteOffset") || all.pointer(place).is_none() {
            let (parent, key) = place.rsplit_once('/').unwrap();
            all.pointer_mut(parent).unwrap()[key] = value;
        } else {
            *all.pointer_mut(place).unwrap() = value;
        }
        let text = error(read("m.glb", &glb(&all, &buffer())));
        assert!(text.contains(word), "{place}: {text}");
    }
}

#[test]
fn indices_of_a_document_that_lead_nowhere_are_errors() {
    let edits: [(&str, Json, &str); 14] = [
        ("/scene", json!(2), "scene 2 of 2"),
        ("/scenes/1/nodes/0", json!(3), "node 3 of 3"),
        ("/nodes/0/children/0", json!(9), "node 9 of 3"),
        ("/nodes/0/children/0", json!(0), "node 0 is in its tree twice"),
        ("/nodes/0/children", json!([1, 1]), "node 1 is in its tree twice"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "node 0: its rotation"),
        ("/nodes/1/mesh", json!(1), "mesh 1 of 1"),
        ("/meshes/0/primitives/0/indices", json!(9), "accessor 9 of 3"),
        ("/meshes/0/primitives/0/indices", json!(0), "accessor 0 is not of the type Scalar"),
        ("/meshes/0/primitives/0/material", json!(3), "material 3 of 3"),
        ("/meshes/0/primitives/1/mode", json!(7), "primitive 1: its mode is unknown"),
        ("/accessors/2/componentType", json!(5126), "accessor 2: indices that are not"),
        ("/asset/version", json!("1.0"), "version 1.0"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh"),
    ];
    for (place, value, word) in edits {
        let mut all = document(None);
        *all.pointer_mut(place).unwrap() = value;
        let text = error(read("m.glb", &glb(&all, &buffer())));
        assert!(text.contains(word), "{place}: {text}");
    }
    // An index of a vertex.
    let mut bin = buffer();
    bin[96] = 4;
    let text = error(read("m.glb", &glb(&document(None), &bin)));
    assert!(text.contains("mesh 0, primitive 0: vertex 4 of 4"), "{text}");
    let circle = json!([{ "children": [1] }, { "children": [2] }, { "children": [0], "mesh": 0 }]);
    let mut all = document(None);
    all["nodes"] = circle;
    assert!(error(read("m.glb", &glb(&all, &buffer()))).contains("node 0 is in its tree twice"));
}

#[test]
fn buffers_that_are_no_files_beside_the_document_are_errors() {
    for (uri, word) in [
        ("https://example.org/a.bin", "is not a file beside it"),
        ("file:///dev/zero", "is not a file beside it"),
        ("not there.bin", "not there.bin: No such file"),
        ("data:application/octet-stream,abc", "not in base64"),
        ("data:;base64,AAA", "base64 ends early"),
        ("data:;base64,AA*A", "byte 42 is not base64"),
        ("data:;base64,AAAA", "buffer 0 has 3 bytes, expected 108"),
        (".", "not a file"),
    ] {
        let text = error(read("m.gltf", document(Some(uri)).to_string().as_bytes()));
        assert!(text.contains(word), "{uri}: {text}");
    }
    #[cfg(unix)]
    {
        let text = error(read("m.gltf", document(Some("/dev/zero")).to_string().as_bytes()));
        assert!(text.contains("/dev/zero: not a file"), "{text}");
        let (_, notes) = mesh(read("m.obj", b"mtllib /dev/zero\nv 0 0 0\nv 1 0 0\nf 1 2 1\n"));
        assert!(notes[0].contains("/dev/zero: not a file"), "{notes:?}");
    }
    // A first buffer without URI in a file that has no chunk for it.
    let text = error(read("m.gltf", document(None).to_string().as_bytes()));
    assert!(text.contains("buffer 0 has no bytes"), "{text}");
}

#[test]
fn deep_nesting_and_long_chains_end() {
    let deep = |key: &str, count: usize| {
        let nested = "[".repeat(count) + &"]".repeat(count);
        format!("{{\"asset\":{{\"version\":\"2.0\",\"{key}\":{nested}}}}}").into_bytes()
    };
    for key in ["extras", "unknown", "extensions", "version"] {
        assert!(exercise("m.gltf", &deep(key, 500_000), key).is_err());
    }
    // A chain of nodes, each a little further along x.
    let count = 20_000;
    let mut all = document(None);
    let mut nodes: Vec<Json> =
        (1..=count).map(|next| json!({ "children": [next], "translation": [1, 0, 0] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    all["nodes"] = nodes.into();
    let found = exercise("m.glb", &glb(&all, &buffer()), "a chain");
    assert_eq!(mesh(found).0.corners(0)[0].x, count as f32);
}

#[test]
fn small_files_that_unfold_to_much_end_at_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let limited = |name: &str, bytes: &[u8], limit: u64| {
        let start = Instant::now();
        let path = write(folder.path(), name, bytes);
        let text = read_surface(&path, limit).err().unwrap().to_string();
        assert!(text.contains(&format!("the limit is {limit} bytes")), "{text}");
        assert!(start.elapsed() < PATIENCE, "{name} took {:?}", start.elapsed());
    };
    // The same mesh thousands of times, and many primitives of the same indices.
    let mut all = document(None);
    all["nodes"] = (0..20_000).map(|_| json!({ "mesh": 0 })).collect();
    all["scenes"][1]["nodes"] = (0..20_000).collect();
    limited("nodes.glb", &glb(&all, &buffer()), 24_000_000);
    let empty = format!("{{\"asset\":{{}},\"nodes\":[{}{{}}]}}", "{},".repeat(100_000));
    limited("empty.gltf", empty.as_bytes(), 60_000_000);
    // Zeros that are in no buffer.
    let mut all = document(None);
    let values = json!({ "bufferView": 0, "componentType": 5121 });
    all["accessors"][0] = json!({ "componentType": 5126, "count": 1_u64 << 60, "type": "VEC3",
        "sparse": { "count": 1, "indices": values, "values": { "bufferView": 0 } } });
    limited("zeros.glb", &glb(&all, &buffer()), 1 << 26);
    // Triangles between the same few vertices.
    let fan = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1 2 3".repeat(20_000));
    limited("fan.obj", fan.as_bytes(), 500_000);
    let names = (0..1000).fold(String::new(), |text, i| text + &format!("usemtl {i}\n"));
    limited("names.obj", format!("v 0 0 0\n{names}").as_bytes(), 200_000);
    let bomb = Hair { counts: vec![100_000], segments: 99_999, ..Hair::new(0b10) };
    let bomb = super::gzip(&bomb.bytes()[..128 + 12 * 50_000]);
    let text = error(read("h.hair.gz", &bomb));
    assert!(text.contains("take 1200128 bytes"), "{text}");
    let libraries = (0..101).fold(String::new(), |text, i| text + &format!("mtllib {i}.mtl\n"));
    assert!(error(read("m.obj", libraries.as_bytes())).contains("more than 100 material files"));
}

#[test]
fn a_million_triangles_of_no_area_are_read() {
    let mut text = "v 1 2 3\n".to_owned();
    text += &"f 1 1 1\n".repeat(1_000_000);
    let found = exercise("m.obj", text.as_bytes(), "triangles of no area");
    assert_eq!(mesh(found).0.triangles().len(), 1_000_000);
}
