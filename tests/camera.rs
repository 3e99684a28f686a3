//! Tests of where the camera stands when angles, a side, a zoom or a position are asked for.

use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::{Projection, Scene, SceneFile};
use deepshadow::volume::Volume;
use glam::DVec3;
use ndarray::Array3;

use crate::cli::{Folder, must_succeed, stderr};
use crate::support::{Picture, Random};

fn made(camera: &str) -> deepshadow::Result<Scene> {
    let file = SceneFile::parse(&format!("[camera]\n{camera}\n"), "x.toml".as_ref()).unwrap();
    let volume = Volume::from_array("box", Array3::from_elem((6, 9, 12), 1.0), [0.1; 3]).unwrap();
    complete(&file, vec![volume.into()], Surroundings::Studio).map(|(scene, ..)| scene)
}

/// Where a point is in the picture, each 0..1 from the upper left corner.
fn seen(scene: &Scene, point: DVec3) -> [f64; 2] {
    let [forward, right, up] = scene.camera.axes();
    let to = point - scene.camera.position;
    let Projection::Perspective { fov_y_degrees } = scene.camera.projection else { panic!() };
    let slope = (fov_y_degrees.to_radians() * 0.5).tan() * to.dot(forward);
    [0.5 + 0.5 * to.dot(right) / slope, 0.5 - 0.5 * to.dot(up) / slope]
}

#[test]
fn a_turned_camera_stands_where_its_angles_say_and_sees_everything() {
    for (azimuth, elevation) in
        [(0.0, 0.0), (90.0, 0.0), (-90.0, 30.0), (200.0, -20.0), (33.0, 90.0), (0.0, -90.0)]
    {
        let text = format!("azimuth_degrees = {azimuth:?}\nelevation_degrees = {elevation:?}");
        let scene = made(&text).unwrap();
        let (turn, height) = (f64::to_radians(azimuth), f64::to_radians(elevation));
        let expected =
            DVec3::new(turn.sin() * height.cos(), height.sin(), turn.cos() * height.cos());
        let found = (scene.camera.position - scene.camera.target).normalize();
        assert!((found - expected).length() < 1e-9, "{azimuth}, {elevation}: {found}");
        for corner in scene.media.world_corners() {
            let place = seen(&scene, corner);
            let inside = place.iter().all(|c| (0.02..=0.98).contains(c));
            assert!(inside, "{azimuth}, {elevation}: {corner} at {place:?}");
        }
        assert!(scene.camera.axes().iter().all(|axis| (axis.length() - 1.0).abs() < 1e-9));
    }
}

#[test]
fn seen_from_above_the_far_side_is_up() {
    let above = made("azimuth_degrees = 0.0\nelevation_degrees = 90.0").unwrap();
    let below = made("azimuth_degrees = 0.0\nelevation_degrees = -90.0").unwrap();
    let turned = made("azimuth_degrees = 90.0\nelevation_degrees = 90.0").unwrap();
    for (scene, up) in [(&above, DVec3::NEG_Z), (&below, DVec3::Z), (&turned, DVec3::NEG_X)] {
        let [_, _, found] = scene.camera.axes();
        assert!((found - up).length() < 1e-6, "{found}, not {up}");
    }
}

#[test]
fn a_target_is_turned_around_and_zoom_enlarges() {
    let target = DVec3::new(0.1, 0.2, -0.1);
    let around = "target = [0.1, 0.2, -0.1]\nazimuth_degrees = 90.0\nelevation_degrees = 0.0";
    let scene = made(around).unwrap();
    let direction = (scene.camera.position - target).normalize();
    assert!((direction - DVec3::X).length() < 1e-9 && scene.camera.target == target);
    let point = DVec3::new(0.0, 0.3, 0.2);
    let [usual, closer] = ["", "zoom = 2.0"].map(|text| seen(&made(text).unwrap(), point));
    for (usual, closer) in usual.into_iter().zip(closer) {
        assert!((closer - 0.5 - 2.0 * (usual - 0.5)).abs() < 1e-9, "{usual}, {closer}");
    }
    let flat = |zoom: &str| {
        let scene = made(&format!("kind = \"orthographic\"\n{zoom}")).unwrap();
        let Projection::Orthographic { height } = scene.camera.projection else { panic!() };
        height
    };
    assert!((flat("") - 2.0 * flat("zoom = 2.0")).abs() < 1e-9);
}

#[test]
fn what_contradicts_itself_is_an_error() {
    for (text, expected) in [
        ("position = [0.0, 0.0, 3.0]\nazimuth_degrees = 3.0", "contradict"),
        ("elevation_degrees = 91.0", "not between -90 and 90"),
        ("azimuth_degrees = nan", "not finite"),
        ("zoom = 0.0", "not above 0"),
    ] {
        let error = made(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}

fn picture(folder: &Folder, options: &str) -> Vec<u8> {
    let command =
        format!("render bucky --backend cpu --size 48x40 --map-size 32 {options} -o p.png");
    must_succeed(&folder.run(&command));
    Picture::open(folder.path().join("p.png")).bytes
}

#[test]
fn options_place_camera_light_and_surroundings() {
    let folder = Folder::new();
    let same = [
        ("--view right", "--azimuth 90 --elevation 0"),
        ("--light 0,90", "--light 0,-1,0"),
        ("--light 90,30", "--light -0.8660254,-0.5,0"),
        ("--light-color 1,1,1", ""),
        ("--albedo 1,1,1 --phase 0", ""),
    ];
    for (one, other) in same {
        let pair = [picture(&folder, one), picture(&folder, other)];
        let largest = pair[0].iter().zip(&pair[1]).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(largest <= Some(1), "{one} is not {other}: {largest:?}");
    }
    let usual = picture(&folder, "");
    for other in [
        "--view top",
        "--zoom 1.5",
        "--fov 60 --camera 0,1,4 --target 0,0,0",
        "--ground none",
        "--ground -0.7",
        "--light-color 0.2,0.5,1",
        "--background 0,0,1 --ground none",
        "--albedo 1,0.2,0.1",
        "--phase 0.7",
        "--up-vector 1,1,0",
    ] {
        assert!(picture(&folder, other) != usual, "{other} changes nothing");
    }
}

/// The choices that are printed repeat the picture when they are given.
#[test]
fn printed_choices_are_options_that_repeat_the_picture() {
    let folder = Folder::new();
    let start = "render bucky --backend cpu --size 48x40 --map-size 32";
    let output = folder.run(&format!("{start} -o a.png"));
    must_succeed(&output);
    let said = stderr(&output);
    let value = |option: &str| {
        let line =
            said.lines().find(|line| line.contains(option)).unwrap_or_else(|| panic!("{option}"));
        let value = line.split(") ").nth(1).unwrap().replace(" (chosen)", "").replace(", ", ",");
        format!("{option} {value}")
    };
    let options =
        ["--camera", "--target", "--fov", "--light", "--ground", "--background"].map(value);
    must_succeed(&folder.run(&format!("{start} {} -o b.png", options.join(" "))));
    let [a, b] = ["a.png", "b.png"].map(|name| Picture::open(folder.path().join(name)).bytes);
    let largest = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(largest <= Some(1), "{options:?}: {largest:?}");
}

#[test]
fn wrong_places_are_refused() {
    let folder = Folder::new();
    for (options, expected) in [
        ("--view up", "'up' is not one of front, back, left, right, top, bottom"),
        ("--view top --azimuth 3", "cannot be used with"),
        ("--camera 0,0,3 --elevation 3", "cannot be used with"),
        ("--elevation 91", "not between -90 and 90"),
        ("--light 3", "expected X,Y,Z (where it travels) or AZIMUTH,ELEVATION"),
        ("--light 0,91", "not between -90 and 90"),
        ("--ground low", "expected a number"),
        ("--zoom 0", "above 0"),
        ("--transparent --ground 3", "except for --catch-shadow"),
    ] {
        let output = folder.run(&format!("render bucky --backend cpu {options} -o no.png"));
        assert!(!output.status.success(), "{options}");
        assert!(stderr(&output).contains(expected), "{options}: {}", stderr(&output));
    }
}

/// The range of places in the picture, horizontally and vertically.
fn span(places: impl IntoIterator<Item = [f64; 2]>) -> [f64; 2] {
    let ranges = places.into_iter().fold([[f64::MAX, f64::MIN]; 2], |ranges, place| {
        [0, 1].map(|i| [ranges[i][0].min(place[i]), ranges[i][1].max(place[i])])
    });
    ranges.map(|[low, high]| high - low)
}

#[test]
fn a_picture_of_any_shape_contains_a_volume_and_its_shadow_under_any_light() {
    let mut random = Random(7);
    for case in 0..1000 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
        let spacing = [0; 3].map(|_| 10_f64.powf(between(-1.0, 1.0)));
        let aspect = 3_f64.powf(between(-1.0, 1.0));
        let turn = [between(-180.0, 180.0), between(-80.0, 80.0)];
        let light = [0; 3].map(|_| between(-1.0, 1.0));
        // A third of all lights graze the ground.
        let light = if case % 3 == 0 { [light[0], 0.1 * light[1], light[2]] } else { light };
        let width = (600.0 * aspect.sqrt()).round();
        let text = format!(
            "[image]\nwidth = {width}\nheight = {}\n[light]\ndirection = {light:?}\n{}",
            (width / aspect).round(),
            if case % 2 == 0 {
                format!(
                    "[camera]\nazimuth_degrees = {}\nelevation_degrees = {}\n",
                    turn[0], turn[1]
                )
            } else {
                String::new()
            }
        );
        let file = SceneFile::parse(&text, "x.toml".as_ref()).unwrap();
        let volume = Volume::from_array("box", Array3::from_elem((3, 4, 5), 1.0), spacing).unwrap();
        let (scene, settings, _) =
            complete(&file, vec![volume.into()], Surroundings::Studio).unwrap();
        let [width, height] = settings.image.size.map(f64::from);
        let place = |point: DVec3| {
            let [x, y] = seen(&scene, point);
            [0.5 + (x - 0.5) * height / width, y]
        };
        let corners = scene.media.world_corners();
        for corner in corners {
            let place = place(corner);
            let inside = place.iter().all(|c| (0.02..=0.98).contains(c));
            assert!(inside, "{case}: {corner} at {place:?}\n{text}");
        }
        // The shadows of points all over the edges, as far as they count.
        let Some(ground) = scene.ground.map(|ground| ground.height) else {
            // From below there is none.
            assert!(scene.camera.position.y < scene.camera.target.y, "{case}\n{text}");
            let alone = span(corners.map(place));
            assert!(alone.into_iter().fold(0.0, f64::max) >= 0.7, "{case}: {alone:?}\n{text}");
            continue;
        };
        let size = corners[7] - corners[0];
        let light = DVec3::from(light);
        let farthest = 3.0 * size.y;
        let upright = corners.into_iter().map(|corner| {
            let away = DVec3::new(light.x, 0.0, light.z).length() * (corner.y - ground) / -light.y;
            let share = (farthest * (1.0 - 1e-9) / away.max(farthest)).min(1.0);
            DVec3::new(corner.x, ground + share * (corner.y - ground), corner.z)
        });
        let edges = corners.iter().flat_map(|&a| corners.iter().map(move |&b| [a, b]));
        let points = edges.flat_map(|[a, b]| (0..=40).map(move |i| a.lerp(b, f64::from(i) / 40.0)));
        let shadows = points.chain(upright).filter_map(|point| {
            let distance = (ground - point.y) / light.y;
            let away = light * distance;
            let counts = light.y < 0.0 && DVec3::new(away.x, 0.0, away.z).length() <= farthest;
            counts.then_some(point + away)
        });
        let alone = span(corners.map(place));
        let all = span(corners.into_iter().chain(shadows).map(place));
        let largest = alone.into_iter().chain(all).fold(0.0, f64::max);
        assert!(largest >= 0.7, "{case}: {alone:?}, {all:?}\n{text}");
    }
}

#[test]
fn the_ground_touches_what_stands_on_it() {
    let scene = made("").unwrap();
    let lowest = scene.media.world_corners().map(|corner| corner.y).into_iter().fold(0.0, f64::min);
    assert!((scene.ground.unwrap().height - lowest).abs() < 1e-9);
}
