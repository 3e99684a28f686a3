//! Every control is set, and what it should change has changed, in the scene file and in the picture.

use deepshadow::scene::SceneFile;
use deepshadow::scene::file::ExposureValue;
use deepshadow::{Backend, CpuBackend, Silent};

use super::support::Window;

type Key = fn(&SceneFile) -> Option<f64>;

/// The picture that the library makes of the scene file that the explorer would save, and that of
/// the explorer, are the same bit for bit.
fn assert_drawn(window: &mut Window, what: &str) {
    window.wait();
    assert_eq!(window.errors(), [""; 0], "{what}");
    let explorer = window.explorer();
    let picture = &explorer.pictures[0].as_ref().unwrap().picture;
    assert!(picture.whole, "{what}");
    let image = picture.image.clone().unwrap();
    let expected = CpuBackend.render(&picture.scene, &picture.settings, &Silent).unwrap();
    assert!(*image == expected, "{what}");
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
    let choices: [(&str, &str, fn(&SceneFile) -> Option<String>); 5] = [
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
    window.slide("time of a moving picture", 50.0);
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
