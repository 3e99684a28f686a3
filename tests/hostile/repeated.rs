//! The same input gives the same bytes, in whatever process.

use std::fs;

use crate::cli::{Folder, must_succeed};
use crate::formats::vdb_fixture;

#[test]
fn outputs_of_every_kind_are_the_same_in_two_processes() {
    let folder = Folder::new();
    let small = "--map-size 12 --backend cpu";
    let picture = format!("{small} --size 12x10");
    let scene = "[[light]]\ndirection = [0.0, -1.0, 0.2]\n[[light]]\ndirection = [0.3, -1.0, 0.0]\n\
                 [volume]\npreset = \"rods\"\ntint = [1.0, 0.5, 0.2]\n";
    fs::write(folder.path().join("two.toml"), scene).unwrap();
    let ball = vdb_fixture("ball_blosc.vdb");
    let ball = ball.display();
    let mut commands: Vec<(String, &str)> = vec![
        (format!("render rods {picture}"), "png"),
        (format!("render rods {picture} --transparent"), "exr"),
        (format!("render rods {picture}"), "deep.exr"),
        (format!("render rods {picture} --max-error 0.2"), "exr"),
        (format!("render two.toml {picture}"), "exr"),
        (format!("map two.toml {small} --map threshold"), "exr"),
        (format!("map rods {small} --map fragments --statistics"), "exr"),
        (format!("convert {ball}"), "vdb"),
        (format!("convert {ball}"), "npy"),
        (format!("convert {ball} --compression gzip"), "nrrd"),
        (format!("convert {ball} --compression zlib"), "mha"),
    ];
    for kind in ["threshold", "fragments", "nested", "moments:4", "fourier:3", "slices:8"] {
        commands.push((format!("map rods {small} --map {kind}"), "exr"));
    }
    for (command, ending) in commands {
        let contents = ["a", "b"].map(|name| {
            let flag = if command.starts_with("convert") { "" } else { "-o" };
            must_succeed(&folder.run(&format!("{command} {flag} {name}.{ending}")));
            fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap()
        });
        assert!(contents[0] == contents[1], "{command}: .{ending} differs");
    }
}
