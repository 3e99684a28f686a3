//! Hair: what is read is what was written.

use deepshadow::Error;
use deepshadow::io::{Format, ReadOptions, surface_files, surface_up};
use deepshadow::surface::Varying;
use deepshadow::volume::Axis;
use glam::Vec3;

use super::dense_fixtures::gzip;
use super::surface_fixtures::{Hair, error, floats, gltf, read, seeds, strands, tfx, write};

#[test]
fn every_set_of_hair_arrays_is_read_or_its_default_is() {
    for flags in (0..32).filter(|flags| flags & 2 != 0) {
        let mut hair = Hair::new(flags);
        if flags & 1 != 0 {
            hair.counts = vec![2, 4];
            hair.segments = 77;
        }
        let bytes = hair.bytes();
        for bytes in [gzip(&bytes), bytes] {
            let (found, notes) = strands(read("curl.hair", &bytes));
            assert_eq!((found.name.as_str(), notes.len()), ("curl", 0));
            let lengths: Vec<u32> =
                (0..found.count()).map(|strand| found.strand(strand).len() as u32).collect();
            assert_eq!(lengths, hair.counts);
            let varies = [found.thickness(), found.opacity()]
                .map(|values| matches!(values, Varying::PerPoint(_)));
            assert_eq!(varies, [flags & 4 != 0, flags & 8 != 0]);
            for (index, point) in (0..6).zip(found.points()) {
                let at = index as usize;
                assert_eq!(*point, Vec3::from(Hair::point(index)));
                let thickness = if varies[0] { Hair::thickness(index) } else { 0.25 };
                assert_eq!(found.thickness().at(at), thickness);
                let transparency = if varies[1] { Hair::transparency(index) } else { 0.125 };
                assert_eq!(found.opacity().at(at), 1.0 - transparency);
                let color = if flags & 16 != 0 { Hair::color(index) } else { [0.5, 0.25, 1.0] };
                assert_eq!(found.albedo().at(at), Vec3::from(color));
            }
        }
    }
}

#[test]
fn hair_that_contradicts_itself_is_an_error_with_the_numbers() {
    let file = |change: fn(&mut Hair)| {
        let mut hair = Hair::new(0b10);
        change(&mut hair);
        hair.bytes()
    };
    let mut longer = Hair::new(0b10).bytes();
    longer.push(0);
    let cases = [
        (file(|hair| hair.segments = 3), "2 strands of 4 points, but there are 6"),
        (file(|hair| hair.flags = 0), "no points"),
        (file(|hair| hair.flags = 0b10_0010), "flags 0x22"),
        (file(|hair| hair.thickness = f32::NAN), "thickness is NaN"),
        (file(|hair| hair.thickness = -1.0), "thickness of -1"),
        (file(|hair| hair.transparency = f32::INFINITY), "transparency is inf"),
        (file(|hair| hair.counts.clear()), "no strands"),
        (file(|hair| (hair.counts, hair.segments) = (vec![1; 4], 0)), "none of its 4 strands"),
        (longer.clone(), "take 200 bytes, but it has 201"),
        (gzip(&longer), "take 200 bytes, but it has more than 200"),
    ];
    for (bytes, word) in cases {
        let text = error(read("h.hair", &bytes));
        assert!(text.contains(word) && text.contains("h.hair: "), "{text}");
    }
    // Segments that do not add up.
    let mut bytes = Hair::new(0b11).bytes();
    bytes[128] = 9;
    let text = error(read("h.hair", &bytes));
    assert!(text.contains("13 points, but there are 6"), "{text}");
}

#[test]
fn strands_that_cannot_be_drawn_are_left_out_with_a_note() {
    let mut bytes = Hair { counts: vec![1, 2, 3], ..Hair::new(0b1011) }.bytes();
    // The last strand's last point.
    let at = 128 + 6 + 5 * 12;
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    // A transparency of more than all.
    let at = 128 + 6 + 6 * 12 + 4;
    bytes[at..at + 4].copy_from_slice(&1.5_f32.to_le_bytes());
    let (found, notes) = strands(read("h.hair", &bytes));
    assert_eq!((found.count(), found.skipped()), (1, 2));
    assert_eq!(found.points()[0], Vec3::from(Hair::point(1)));
    assert_eq!(found.opacity().at(0), 0.0);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("1 of its transparencies"), "{notes:?}");
    assert!(notes[1].starts_with("2 strands are left out, of fewer than two points"), "{notes:?}");
}

#[test]
fn tressfx_hair_has_its_points_and_defaults_that_a_note_tells() {
    let (found, notes) = strands(read("curl.tfx", &tfx(2, 3, true)));
    assert_eq!((found.count(), found.strand(1)), (2, 3..6));
    for index in 0..6 {
        let at = index as usize;
        assert_eq!(found.points()[at], Vec3::from(Hair::point(index)));
        assert_eq!(found.thickness().at(at), Hair::thickness(index / 3));
        assert_eq!(found.albedo().at(at), Vec3::from(Hair::color(index)));
    }
    assert_eq!(notes.len(), 1, "{notes:?}");
    let (plain, notes) = strands(read("curl.tfx", &tfx(2, 3, false)));
    assert_eq!(plain.points(), found.points());
    let told = |word: &str| notes.iter().any(|note| note.contains(word));
    assert!(told("set `hair.thickness`") && told("set `hair.opacity`"), "{notes:?}");
}

#[test]
fn an_assumed_thickness_grows_with_the_strands_and_shrinks_with_their_number() {
    let thickness = |strands_of: u32, scale: f32| {
        let mut bytes = tfx(strands_of, 2, false);
        for strand in 0..strands_of as usize {
            let (x, y) = ((strand % 32) as f32, (strand / 32) as f32);
            let points = [x, y, 0.0, 0.0, x, y, 10.0, 0.0].map(|v| v * scale);
            bytes[160 + 32 * strand..160 + 32 * (strand + 1)].copy_from_slice(&floats(&points));
        }
        strands(read("h.tfx", &bytes)).0.thickness().at(0)
    };
    let (few, many) = (thickness(64, 1.0), thickness(1024, 1.0));
    // A box of 31 x 1 x 10: its diagonal is a bound. One of 31 x 31 x 10 shows a quarter of its
    // surface, and the cylinders pi / 4 times thickness times 10 each.
    let [diagonal, surface] = [f32::sqrt(31.0 * 31.0 + 1.0 + 100.0), 2.0 * (961.0 + 620.0)];
    assert!((few / (diagonal / 200.0) - 1.0).abs() < 1e-5, "{few}");
    let even = surface / (std::f32::consts::PI * 10240.0);
    assert!((many / even - 1.0).abs() < 1e-5, "{many} {even}");
    assert!((thickness(1024, 8.0) / (8.0 * many) - 1.0).abs() < 1e-5);
}

#[test]
fn surfaces_are_known_by_content_and_are_no_volumes() {
    let folder = tempfile::tempdir().unwrap();
    for (target, name, bytes) in seeds() {
        // Whatever the name is.
        let path = write(folder.path(), "thing.vdb", &bytes);
        let format = Format::of_file(&path).unwrap();
        assert_eq!((format.name(), format.is_surface()), (target, true), "{name}");
        let what = if ["hair", "tfx"].contains(&target) { "hair" } else { "a mesh" };
        let options = ReadOptions::default();
        let refused: Vec<Option<Error>> = vec![
            options.check(&path, format).err(),
            deepshadow::io::dense::DenseFile::open(&path, format, &options).err(),
            deepshadow::io::open(&path).err(),
        ];
        for refusal in refused {
            let text = refusal.unwrap().to_string();
            assert!(text.ends_with(&format!("thing.vdb: {what}, not a volume")), "{text}");
        }
        assert_eq!(surface_up(format), if target == "hair" { Axis::Z } else { Axis::Y });
    }
    let volume = write(folder.path(), "a.npy", b"\x93NUMPY");
    assert!(surface_files(&volume).err().unwrap().to_string().contains("npy, which is neither"));
}

#[test]
fn a_document_is_known_whichever_key_comes_first() {
    let text = String::from_utf8(gltf()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (text, expected) in [
        (text.replacen("\"accessors\"", " \"scenes\" : [], \"accessors\"", 1), Format::Gltf),
        (format!("\u{feff}\n{text}"), Format::Gltf),
        ("{\"width\": 3}".to_owned(), Format::Raw),
        ("\n# comment\n\nvn 0 0 1\nv 0 0 0\nf 1".to_owned(), Format::Obj),
        ("v 0 0 0\nsome other text\n".to_owned(), Format::Raw),
        ("# only a comment\n".to_owned(), Format::Raw),
    ] {
        let path = write(folder.path(), "m", text.as_bytes());
        assert_eq!(Format::of_file(&path).unwrap(), expected, "{text}");
    }
}

mod outside {
    use deepshadow::io::{SurfaceFile, read_surface};

    use super::*;
    use crate::support::data::outside;

    /// Twin: `every_set_of_hair_arrays_is_read_or_its_default_is`.
    #[test]
    #[ignore = "needs DEEPSHADOW_DATA"]
    fn real_hair_and_meshes_are_read() {
        let file = |name: &str| read_surface(&outside("data").join(name), 1 << 28);
        let (hair, notes) = strands(file("hair/straight.hair.gz"));
        assert_eq!((hair.count(), hair.points().len(), notes.len()), (10_000, 160_000, 0));
        assert!((0..hair.count()).all(|strand| hair.strand(strand).len() == 16));
        assert_eq!(*hair.opacity(), Varying::Same(1.0 - 0.355_777_4));
        assert_eq!(*hair.thickness(), Varying::Same(0.1));
        let (hair, notes) = strands(file("hair/sintel.tfx"));
        assert_eq!((hair.count(), hair.points().len(), notes.len()), (228, 228 * 32, 2));
        for (name, triangles) in [
            ("teapot.obj", 6320),
            ("suzanne.obj", 968),
            ("sintel.obj", 5952),
            ("city_building-small-a.glb", 452),
            ("city_building-small-b.glb", 600),
            ("city_grass-trees.glb", 380),
            ("city_road-intersection.glb", 154),
            ("city_road-straight-lightposts.glb", 190),
        ] {
            let (SurfaceFile::Mesh(mesh), _) = file(&format!("mesh/{name}")).unwrap() else {
                panic!("{name}")
            };
            assert_eq!((mesh.triangles().len(), mesh.skipped()), (triangles, 0), "{name}");
        }
    }
}
