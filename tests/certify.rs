//! Tests of `--max-error` and `--max-map-bytes`: the written map has the properties in its
//! certificate.

use deepshadow::io::deep_exr::{Attribute, DeepFile};
use exr::prelude::{AttributeValue, read_first_flat_layer_from_file};

use crate::cli::{Folder, must_succeed, stderr};

/// The attribute `certificate` of a flat or a deep file.
fn certificate(folder: &Folder, name: &str) -> (String, u32) {
    let path = folder.path().join(name);
    if let Ok(deep) = DeepFile::open(&path, 1 << 30) {
        let [width, _] = deep.size();
        match deep.header().attribute("certificate") {
            Some(Attribute::Text(text)) => return (text.clone(), width),
            other => panic!("{other:?}"),
        }
    }
    let layer = read_first_flat_layer_from_file(path).unwrap().layer_data;
    let mut attributes = layer.attributes.other.iter();
    match attributes.find(|(key, _)| **key == *"certificate") {
        Some((_, AttributeValue::Text(text))) => (text.to_string(), layer.size.0 as u32),
        other => panic!("{other:?}"),
    }
}

/// The number in front of `unit`.
fn number(text: &str, unit: &str) -> f64 {
    let before = &text[..text.find(unit).unwrap_or_else(|| panic!("no {unit} in {text}"))];
    before.rsplit(' ').next().unwrap().parse().unwrap()
}

#[test]
fn the_error_asked_for_is_kept() {
    let folder = Folder::new();
    let mut sizes = Vec::new();
    for (error, name) in [("0.03", "coarse.exr"), ("0.0105", "fine.exr")] {
        let output = folder
            .run(&format!("map bucky --backend cpu --map-size 48 --max-error {error} -o {name}"));
        must_succeed(&output);
        let (text, _) = certificate(&folder, name);
        assert!(stderr(&output).contains(&text), "{}", stderr(&output));
        assert!(number(&text, " RMS") <= error.parse().unwrap(), "{text}");
        assert!(number(&text, " at most") >= number(&text, " RMS"), "{text}");
        assert!(text.contains("50000 random points") && text.contains("not a bound"), "{text}");
        sizes.push(number(&text, " bytes"));
    }
    assert!(sizes[0] < sizes[1], "less error takes more bytes: {sizes:?}");
}

#[test]
fn the_bytes_asked_for_are_kept() {
    let folder = Folder::new();
    must_succeed(&folder.run(
        "render bucky --backend cpu --size 24x20 --map-size 32 --max-map-bytes 16/texel -o a.exr",
    ));
    let (text, _) = certificate(&folder, "a.exr");
    assert!(text.contains("32x32") && number(&text, " bytes") <= 16.0 * 1024.0, "{text}");
    must_succeed(&folder.run(
        "map rods --backend cpu --map fragments --tolerance 0.01 --map-size 40 --max-map-bytes 1MiB -o b.exr",
    ));
    let (text, width) = certificate(&folder, "b.exr");
    assert_eq!(width, 40);
    assert!(text.starts_with("fragments 40x40") && text.contains("within 0.01"), "{text}");
}

#[test]
fn a_limit_that_cannot_be_kept_is_an_error_that_tells_how_far_off() {
    let folder = Folder::new();
    for (limits, named) in [
        ("--max-error 0.0000001", "the closest is"),
        ("--max-error 0.001 --max-map-bytes 6KiB", "max-error: no map tried meets the limits"),
        ("--max-map-bytes 1/texel", "no map tried is that small"),
    ] {
        let output =
            folder.run(&format!("map bucky --backend cpu --map-size 24 --quiet {limits} -o x.exr"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{limits}: {said}");
        assert!(said.contains(named) && said.lines().count() == 1, "{limits}: {said}");
    }
    for wrong in [
        "--max-error 0",
        "--max-error x",
        "--max-map-bytes 4MB",
        "--max-map-bytes 0",
        "--max-error 0.01 --filter edsm",
    ] {
        assert_eq!(
            folder.run(&format!("map bucky --backend cpu {wrong}")).status.code(),
            Some(2),
            "{wrong}"
        );
    }
    assert!(folder.names().is_empty());
}
