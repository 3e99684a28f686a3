//! Every control is set, and what it should change has changed, in the scene file and in the picture.

use deepshadow::scene::SceneFile;
use deepshadow::scene::file::ExposureValue;
use deepshadow::{Backend, CpuBackend, Silent};
use deepshadow_explorer::Explorer;
use eframe::egui::Role;
use egui_kittest::kittest::Queryable;

use super::support::Window;

type Key = fn(&SceneFile) -> Option<f64>;
type Name = fn(&SceneFile) -> Option<String>;

/// The picture that the library makes of the scene file that the explorer would save, and that of
/// the explorer, are the same bit for bit.
fn assert_drawn(window: &mut Window, what: &str) {
    window.wait();
    assert_eq!(window.errors(), [""; 0], "{what}");
    let explorer = window.explorer();
    let picture = &explorer.pictures[0].as_ref().unwrap().picture;
    assert!(picture.whole, "{what}");
    let (image, made) = (picture.image.clone().unwrap(), picture.made.clone().unwrap());
    let expected = CpuBackend.render(&made.scene, &made.settings, &Silent).unwrap();
    assert!(*image == expected, "{what}");
}

/// What leaves a key to choice again is seen whole, beside its slider.
fn assert_stands_in_its_row(window: &Window, label: &str) {
    let slider = window.harness.get_by_role_and_label(Role::Slider, label).rect();
    let reset = window.harness.get_by_label(&format!("reset {label}")).rect();
    assert!(reset.right() < Explorer::PANELS, "{label}: {reset}");
    assert!((reset.center().y - slider.center().y).abs() < 2.0, "{label}: {reset}, {slider}");
}

#[test]
fn sliders_set_their_keys() {
    let mut window = Window::tall("box");
    let volume: [(&str, f64, Key); 3] = [
        ("density scale", 3.0, |file| file.volume[0].density_scale),
        ("phase (g)", 0.5, |file| file.volume[0].phase_g),
        ("octaves", 3.0, |file| file.shadow.octaves.map(f64::from)),
    ];
    let shadow: [(&str, f64, Key); 4] = [
        ("map size", 96.0, |file| file.shadow.size.map(f64::from)),
        ("quality", 2.0, |file| file.shadow.quality),
        ("light steps", 64.0, |file| file.shadow.steps.map(f64::from)),
        ("tolerance", 0.05, |file| file.shadow.tolerance),
    ];
    let picture: [(&str, f64, Key); 6] = [
        ("samples", 2.0, |file| file.image.samples.map(f64::from)),
        ("picture tolerance", 0.01, |file| file.image.tolerance),
        ("camera steps", 2.0, |file| file.shadow.view_steps.map(f64::from)),
        ("field of view", 50.0, |file| file.camera.fov_y_degrees),
        ("ground height", -0.4, |file| file.ground.height),
        ("ground albedo", 0.5, |file| file.ground.albedo),
    ];
    for (label, value, key) in volume.into_iter().chain(shadow).chain(picture) {
        let before = window.explorer().pictures[0].as_ref().unwrap().picture.image.clone().unwrap();
        assert_ne!(key(&window.file()), Some(value), "{label}");
        window.slide(label, value);
        let found = key(&window.file()).unwrap_or_else(|| panic!("{label} has set nothing"));
        assert!((found - value).abs() <= 0.02 * value.abs().max(0.02), "{label}: {found}");
        assert_drawn(&mut window, label);
        assert_stands_in_its_row(&window, label);
        let picture = &window.explorer().pictures[0].as_ref().unwrap().picture;
        // Steps of the light beyond what the box needs change nothing.
        if label != "light steps" {
            assert!(picture.image.clone().unwrap().pixels != before.pixels, "{label}");
        }
    }
}

#[test]
fn names_are_chosen() {
    let mut window = Window::tall("box");
    let choices: [(&str, &str, Name); 5] = [
        ("filter", "pcf5", |file| file.shadow.filter.clone()),
        ("slices", "planes", |file| file.shadow.slices.clone()),
        ("tone curve", "agx", |file| file.image.tonemap.clone()),
        ("projection", "orthographic", |file| file.camera.kind.clone()),
        ("preset", "rods", |file| file.volume[0].preset.clone()),
    ];
    for (list, item, key) in choices {
        window.choose(list, item);
        assert_eq!(key(&window.file()).as_deref(), Some(item), "{list}");
        assert_drawn(&mut window, list);
    }
    window.tick("links between texels");
    assert_eq!(window.file().shadow.links, Some(false));
    window.slide("tolerance", 0.0);
    window.wait();
    window.slide("truncation", 0.02);
    assert_drawn(&mut window, "truncation");
    assert_eq!(window.file().shadow.truncation, Some(0.02));
    // What was set can be left to choice again.
    window.press("reset filter");
    window.press("reset slices");
    assert_eq!((window.file().shadow.filter, window.file().shadow.slices), (None, None));
    assert_drawn(&mut window, "reset");
}

#[test]
fn every_kind_of_map_draws() {
    let mut window = Window::tall("box");
    window.explorer().document.as_mut().unwrap().file.shadow.size = Some(48);
    for kind in deepshadow::settings::MapKind::all() {
        let text = kind.to_string();
        let name = text.split(':').next().unwrap();
        window.choose("map", name);
        assert_eq!(window.file().shadow.map, Some(text.clone()));
        assert_drawn(&mut window, name);
        let settings = window.explorer().settings().unwrap();
        assert_eq!(settings.map.kind, Some(kind));
        if text.contains(':') {
            window.slide("numbers a texel", 6.0);
            assert_drawn(&mut window, name);
            assert_ne!(window.file().shadow.map, Some(text.clone()), "{name}");
        }
    }
    window.choose("map", "threshold");
    window.wait();
    window.choose("lookup", "paper");
    window.choose("crossing", "bucket");
    window.choose("shading", "paper");
    window.wait();
    window.slide("light samples", 20.0);
    assert_drawn(&mut window, "paper");
    let shadow = window.file().shadow;
    let names = [shadow.lookup, shadow.crossing, shadow.shading].map(Option::unwrap);
    assert_eq!(
        (names, shadow.light_samples),
        (["paper", "bucket", "paper"].map(str::to_owned), Some(20))
    );
}

#[test]
fn lights_are_moved_added_and_changed() {
    let mut window = Window::tall("box");
    window.slide("light strength", 2.0);
    let [r, g, b] = window.file().light[0].irradiance.unwrap();
    assert!((r / (8.0 * std::f64::consts::PI) - 1.0).abs() < 0.01 && r == g && g == b);
    assert_drawn(&mut window, "light strength");
    window.slide("ambient", 0.5);
    let ambient = window.file().ambient.radiance.unwrap();
    assert!((ambient.into_iter().fold(0.0, f64::max) - 0.5).abs() < 0.01, "{ambient:?}");
    window.slide("background", 0.25);
    assert!(window.file().background.radiance.unwrap().iter().any(|c| (c - 0.25).abs() < 0.01));
    assert_drawn(&mut window, "background");
    for kind in ["spot", "point", "directional"] {
        window.choose("light kind", kind);
        assert_drawn(&mut window, kind);
        assert_eq!(window.file().light[0].kind.as_deref(), Some(kind));
        if kind == "spot" {
            window.slide("cone", 20.0);
            window.slide("cone softness", 0.5);
            let light = window.file().light[0].clone();
            assert_eq!((light.cone_degrees, light.cone_softness), (Some(20.0), Some(0.5)));
        }
    }
    window.press("add");
    assert_drawn(&mut window, "two lights");
    assert_eq!(window.explorer().scene().unwrap().lights.len(), 2);
    window.press("remove");
    assert_drawn(&mut window, "one light");
    assert_eq!(window.explorer().scene().unwrap().lights.len(), 1);
}

#[test]
fn the_picture_is_exposed_and_sized() {
    let mut window = Window::tall("box");
    window.slide("exposure", 1.0);
    assert_eq!(window.file().image.exposure, Some(ExposureValue::Factor(2.0)));
    let tone = window.explorer().pictures[0].as_ref().unwrap().picture.tone.exposure;
    window.wait();
    let brighter = window.explorer().pictures[0].as_ref().unwrap().picture.tone.exposure;
    assert_eq!((tone, brighter), (tone, 2.0));
    window.tick("auto");
    assert_eq!(window.file().image.exposure, Some(ExposureValue::Text("auto".to_owned())));
    window.tick("ground");
    assert_eq!(window.file().ground.enabled, Some(false));
    assert_drawn(&mut window, "no ground");
    assert!(window.explorer().scene().unwrap().ground.is_none());
    window.tick("own size");
    assert_eq!([window.file().image.width, window.file().image.height], [None; 2]);
    window.tick("own size");
    let size = window.explorer().settings().unwrap().image.size;
    assert_eq!([window.file().image.width, window.file().image.height], size.map(Some));
    window.slide("moving picture", 50.0);
    assert!((window.explorer().budget.as_secs_f64() - 0.05).abs() < 0.002);
    window.choose("device", "cpu");
    assert_eq!(window.explorer().device.name(), "cpu");
    assert_drawn(&mut window, "device");
}

#[test]
fn transfer_functions_and_emission_are_set() {
    let mut window = Window::tall("box");
    window.choose("transfer function", "fire");
    assert_drawn(&mut window, "fire");
    let name = window.file().volume[0].transfer.clone().unwrap().name;
    assert_eq!(name.as_deref(), Some("fire"));
    window.tick("steep places only");
    window.slide("steepness", 0.5);
    assert_drawn(&mut window, "steep");
    let gradient = window.file().volume[0].transfer.clone().unwrap().gradient.unwrap();
    assert_eq!(gradient[1][0], 0.5);
    window.tick("emission");
    window.wait();
    window.choose("emission colours", "viridis");
    window.slide("emission radiance", 2.0);
    assert_drawn(&mut window, "emission");
    let emission = window.file().volume[0].emission.clone().unwrap();
    assert_eq!(emission.colors.as_deref(), Some("viridis"));
    assert!((emission.radiance.unwrap() - 2.0).abs() < 0.05);
    window.choose("transfer function", "none");
    assert_eq!(window.file().volume[0].transfer, None);
}

/// A mesh and a strand above it, in files.
fn surfaces(folder: &std::path::Path) -> String {
    let mesh = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(folder.join("plane.obj"), mesh).unwrap();
    // A TressFX file: version, strands, points of each, and points of four numbers.
    let mut hair = Vec::new();
    let head = [4.0_f32.to_bits(), 2, 4, 160, 0, 0, 0, 0];
    hair.extend(head.into_iter().flat_map(u32::to_le_bytes));
    hair.resize(160, 0);
    for strand in 0..2 {
        for point in 0..4 {
            let at = [0.3 * strand as f32, 0.3 + 0.2 * point as f32, 0.1 * point as f32, 1.0];
            hair.extend(at.into_iter().flat_map(f32::to_le_bytes));
        }
    }
    std::fs::write(folder.join("two.tfx"), hair).unwrap();
    let scene = "[mesh]\npath = 'plane.obj'\n[hair]\npath = 'two.tfx'\nthickness = 0.1\n";
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn surfaces_are_set() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::tall(&surfaces(folder.path()));
    let keys: [(&str, f64, Key); 5] = [
        ("mesh opacity", 0.5, |file| file.mesh[0].opacity),
        ("hair opacity", 0.25, |file| file.hair[0].opacity),
        ("hair thickness", 0.2, |file| file.hair[0].thickness),
        ("hair highlight", 0.8, |file| file.hair[0].specular),
        ("hair shininess", 100.0, |file| file.hair[0].shininess),
    ];
    for (label, value, key) in keys {
        window.slide(label, value);
        let found = key(&window.file()).unwrap();
        assert!((found - value).abs() <= 0.02 * value, "{label}: {found}");
        assert_drawn(&mut window, label);
    }
    window.slide("bias", 0.05);
    assert!((window.file().shadow.bias.unwrap() - 0.05).abs() < 1e-3);
    window.tick("coverage of strands");
    assert_eq!(window.file().shadow.coverage, Some(false));
    window.tick("hair casts shadows");
    window.tick("mesh receives shadows");
    assert_drawn(&mut window, "switches");
    let file = window.file();
    assert_eq!((file.hair[0].casts, file.mesh[0].receives), (Some(false), Some(false)));
}

#[test]
fn a_box_is_clipped() {
    let mut window = Window::tall("bucky");
    window.tick("clip box");
    window.slide("clip x to", 0.5);
    window.slide("clip z from", 0.25);
    assert_eq!(window.file().volume[0].clip, Some([[0.0, 0.0, 0.25], [0.5, 1.0, 1.0]]));
    assert_drawn(&mut window, "clip");
    let made = window.explorer().shown().unwrap().picture.made.clone().unwrap();
    let volume = &made.scene.media.bodies()[0].volume;
    assert!(volume.domain().size().x < 0.51 * volume.dims()[0] as f64);
    window.tick("clip box");
    assert_eq!(window.file().volume[0].clip, None);
    assert_drawn(&mut window, "whole");
}

#[test]
fn numbers_are_typed_and_colours_picked() {
    let mut window = Window::tall("box");
    for (axis, value) in [("x", 0.5), ("y", -0.25), ("z", 0.75)] {
        window.type_number(&format!("light direction {axis}"), value);
    }
    assert_drawn(&mut window, "light direction");
    assert_eq!(window.file().light[0].direction, Some([0.5, -0.25, 0.75]));
    window.type_number("window to", 0.5);
    assert_drawn(&mut window, "window");
    assert_eq!(window.file().volume[0].window.unwrap()[1], 0.5);
    window.choose("map", "threshold");
    window.wait();
    window.type_number("threshold 2", 0.4);
    assert_drawn(&mut window, "thresholds");
    assert_eq!(window.file().shadow.thresholds, Some([0.1, 0.4, 0.9]));
    window.type_number("picture width", 64.0);
    window.type_number("picture height", 48.0);
    assert_drawn(&mut window, "size");
    assert_eq!(window.explorer().settings().unwrap().image.size, [64, 48]);
    window.pick_colour("albedo");
    assert_drawn(&mut window, "albedo");
    assert!(window.file().volume[0].albedo.is_some_and(|albedo| albedo != [1.0; 3]));
    window.choose("projection", "orthographic");
    window.wait();
    window.slide("view height", 4.0);
    assert_drawn(&mut window, "view height");
    assert!((window.file().camera.height.unwrap() - 4.0).abs() < 0.1);
}

#[test]
fn another_setting_stands_beside() {
    let mut window = Window::tall("box");
    window.press("compare with these settings");
    window.until(|explorer| explorer.pictures[1].as_ref().is_some_and(|p| p.picture.whole));
    window.choose("map", "peeling");
    window.wait();
    let [own, beside] =
        [0, 1].map(|side| window.harness.state().pictures[side].as_ref().unwrap().picture.clone());
    assert_eq!(beside.settings.map.kind, None);
    assert!(own.settings.map.kind.is_some());
    assert!(own.image != beside.image);
    window.slide("wiper", 0.25);
    assert!((window.explorer().wiper - 0.25).abs() < 0.01);
    // Both are seen from the same place.
    window.press("look from the light");
    window.wait();
    window.until(|explorer| explorer.pictures[1].as_ref().is_some_and(|p| p.picture.whole));
    let cameras = [0, 1]
        .map(|side| window.harness.state().pictures[side].as_ref().unwrap().picture.scene.camera);
    assert_eq!(cameras[0], cameras[1]);
    let scene = window.explorer().scene().unwrap();
    let [forward, ..] = cameras[0].axes();
    assert!(forward.distance(scene.lights[0].direction_at(scene.camera.target)) < 1e-9);
    window.press("end");
    assert!(window.explorer().beside.is_none());
}

#[test]
fn what_is_looked_into_and_written_is_chosen() {
    use deepshadow_explorer::engine::truth::Channel;
    use deepshadow_explorer::panels::Look;

    let mut window = Window::tall("box");
    window.tick("difference to the truth");
    window.until(|explorer| {
        let difference = explorer.looking.difference.as_ref();
        difference.is_some_and(|(difference, _)| difference.share >= 1.0)
    });
    window.tick("map and curves");
    assert_eq!(window.explorer().looking.look, Some(Look::Curves));
    window.tick("all kinds of map");
    assert!(window.explorer().looking.all);
    window.explorer().looking.at = Some([0.5, 0.5]);
    for (name, channel) in [
        ("depth at 50 %", Channel::Depth(0.5)),
        ("transmittance at a depth", Channel::Transmittance(0.5)),
    ] {
        window.choose("map shows", name);
        assert_eq!(window.explorer().looking.channel, channel);
        window.until(|explorer| !explorer.looking.pending && explorer.looking.drawn.is_some());
    }
    window.slide("share of the depth", 1.0);
    assert_eq!(window.explorer().looking.channel, Channel::Transmittance(1.0));
    window.until(|explorer| !explorer.looking.pending);
    let (drawn, _) = window.explorer().looking.drawn.as_ref().unwrap();
    assert_eq!(drawn.kinds.len(), deepshadow::settings::MapKind::all().count());
    // The box is homogeneous: lists keep its curve, and behind it light is what they say.
    let (kind, curve, bytes, off) = &drawn.kinds[0];
    assert!(kind.to_string() == "fragments" && *bytes > 0 && *off < 0.003, "{off}");
    assert_eq!(curve.len(), drawn.truth.len());
    assert!(drawn.truth[0][1] == 1.0 && drawn.truth.last().unwrap()[1] < 0.9);
    window.tick("map and curves");
    assert_eq!(window.explorer().looking.look, None);
    window.type_number("pictures around", 12.0);
    assert_eq!(window.explorer().output.count, 12);
    window.press("by the light");
    assert!(window.explorer().output.of_light);
}
