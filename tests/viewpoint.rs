//! Where the camera was, as files tell it: the matrices of OpenEXR pictures, and the depths of deep
//! images.

use std::fs;

use exr::prelude::{Text, read_first_flat_layer_from_file};

use super::cli::{Folder, must_succeed};

/// A small cube, seen by a camera that looks down at a picture that is not square.
const SCENE: &str = r#"
[volume]
preset = "box"
bounds = [[0.27, 0.17, -0.13], [0.33, 0.23, -0.07]]
density_scale = 500.0
[camera]
position = [1.0, 0.8, 2.0]
target = [0.1, 0.0, 0.0]
fov_y_degrees = 40.0
[image]
width = 64
height = 48
[ground]
enabled = false
"#;

fn multiplied(point: [f64; 3], matrix: &[f32]) -> [f64; 4] {
    let row = [point[0], point[1], point[2], 1.0];
    [0, 1, 2, 3].map(|j| (0..4).map(|i| row[i] * f64::from(matrix[4 * i + j])).sum())
}

/// As OpenEXR defines them, `p * worldToNDC` is 0..1 from the upper left to the lower right corner,
/// and `p * worldToCamera` has z in front of the camera.
#[test]
fn the_matrices_of_an_exr_file_lead_from_the_world_to_the_pixel_where_it_is_seen() {
    let folder = Folder::new();
    for kind in ["", "kind = \"orthographic\"\nheight = 1.5\n"] {
        let scene = SCENE.replace("[camera]\n", &format!("[camera]\n{kind}"));
        let scene =
            if kind.is_empty() { scene } else { scene.replace("fov_y_degrees = 40.0\n", "") };
        fs::write(folder.path().join("s.toml"), scene).unwrap();
        must_succeed(&folder.run("render s.toml --backend cpu --quiet --transparent -o s.exr"));
        let image = read_first_flat_layer_from_file(folder.path().join("s.exr")).unwrap();
        let layer = image.layer_data;
        let to_ndc = layer.attributes.world_to_normalized_device.unwrap();
        let to_camera = layer.attributes.world_to_camera.unwrap();
        let alpha = &layer.channel_data.list[0];
        assert_eq!(alpha.name, Text::from("A"));
        let [mut sum, mut x_sum, mut y_sum] = [0.0; 3];
        for (at, a) in alpha.sample_data.values_as_f32().enumerate() {
            let a = f64::from(a);
            sum += a;
            x_sum += a * ((at % 64) as f64 + 0.5);
            y_sum += a * ((at / 64) as f64 + 0.5);
        }
        assert!(sum > 2.0, "the cube is seen: {sum}");
        let middle = [0.3, 0.2, -0.1];
        let [x, y, _, w] = multiplied(middle, &to_ndc);
        // The cube is symmetric about its middle and a few pixels large; perspective moves the
        // middle of what is seen by far less than a pixel.
        let off = [64.0 * x / w - x_sum / sum, 48.0 * y / w - y_sum / sum];
        assert!(off[0].hypot(off[1]) < 0.25, "{off:?}, {} at {}", x_sum / sum, y_sum / sum);
        let [x, y, z, w] = multiplied([0.1, 0.0, 0.0], &to_camera);
        let distance = f64::sqrt(0.9 * 0.9 + 0.8 * 0.8 + 2.0 * 2.0);
        assert!(x.abs() + y.abs() + (z - distance).abs() + (w - 1.0).abs() < 1e-5);
    }
}

/// The depths of a deep image's samples, front and back, pixel by pixel.
fn depths(folder: &Folder, name: &str) -> (String, Vec<Vec<[f32; 2]>>) {
    use deepshadow::io::deep_exr::{Attribute, DeepFile};

    let mut file = DeepFile::open(folder.path().join(name), 1 << 30).unwrap();
    let image = file.read().unwrap();
    let Some(Attribute::Text(kind)) = image.header.attribute("deep_z").cloned() else {
        panic!("no attribute says what depths are");
    };
    let channel = |name: &str| image.header.channels.iter().position(|c| c.name == name).unwrap();
    for name in ["worldToCamera", "worldToNDC"] {
        assert!(matches!(image.header.attribute(name), Some(Attribute::Matrix4x4(_))), "{name}");
    }
    let (z, back) = (channel("Z"), channel("ZBack"));
    let mut pixels = Vec::new();
    for row in &image.rows {
        for x in 0..row.width() {
            let at = |c: usize, i: usize| row.channels[c].get(i).unwrap();
            pixels.push(row.pixel(x).map(|i| [at(z, i), at(back, i)]).collect());
        }
    }
    (kind, pixels)
}

#[test]
fn planar_depths_are_distances_along_the_cameras_axis() {
    let folder = Folder::new();
    let scene = SCENE.replace("enabled = false", "height = -0.4");
    let scene = scene
        .replace("[[0.27, 0.17, -0.13], [0.33, 0.23, -0.07]]", "[[-1, -0.4, -1], [1, 0.4, 1]]");
    fs::write(folder.path().join("s.toml"), scene.replace("500.0", "2.0")).unwrap();
    let render = "render s.toml --backend cpu --quiet --map-size 16";
    must_succeed(&folder.run(&format!("{render} -o planar.deep.exr")));
    must_succeed(&folder.run(&format!("{render} --deep-z planar -o again.deep.exr")));
    must_succeed(&folder.run(&format!("{render} --deep-z ray -o ray.deep.exr")));
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("planar.deep.exr") == read("again.deep.exr"), "planar is the default");
    let (kind, planar) = depths(&folder, "planar.deep.exr");
    let (ray_kind, along_ray) = depths(&folder, "ray.deep.exr");
    assert_eq!((kind.as_str(), ray_kind.as_str()), ("planar", "ray"));
    let half = f64::to_radians(20.0).tan();
    let mut samples = 0;
    for (at, (planar, along_ray)) in planar.iter().zip(&along_ray).enumerate() {
        let x = (((at % 64) as f64 + 0.5) / 32.0 - 1.0) * half * 64.0 / 48.0;
        let y = (((at / 64) as f64 + 0.5) / 24.0 - 1.0) * half;
        let cosine = 1.0 / f64::sqrt(1.0 + x * x + y * y);
        assert_eq!(planar.len(), along_ray.len());
        for (planar, along_ray) in planar.iter().flatten().zip(along_ray.iter().flatten()) {
            let expected = f64::from(*along_ray) * cosine;
            // Each is rounded to f32 once.
            let error = (f64::from(*planar) - expected).abs();
            assert!(error <= 2.0 * f64::from(f32::EPSILON) * expected, "{planar} for {expected}");
            samples += 1;
        }
    }
    assert!(samples > 64 * 48, "{samples} depths");
}
