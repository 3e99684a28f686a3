//! What a program needs that edits scenes and draws them all the time: work that is given up, and
//! files that are not read again.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use deepshadow::io::{SceneLoader, encode_array, load_ingredients};
use deepshadow::ndarray::Array3;
use deepshadow::progress::Progress;
use deepshadow::scene::automatic::{Surroundings, complete};
use deepshadow::scene::file::{TransferTable, VolumeTable};
use deepshadow::scene::{Scene, SceneFile};
use deepshadow::settings::MapKind;
use deepshadow::volume::{Axis, presets::Preset};
use deepshadow::{Backend, CpuBackend, ErrorKind, Settings, Silent};

/// Progress that is cancelled after a number of reports.
struct Impatient {
    left: AtomicU64,
    heard: AtomicU64,
}

impl Impatient {
    fn after(reports: u64) -> Self {
        Self { left: AtomicU64::new(reports), heard: AtomicU64::new(0) }
    }
}

impl Progress for Impatient {
    fn begin(&self, _what: &str, _total: u64) {}

    fn advance(&self, _parts: u64) {
        self.heard.fetch_add(1, Ordering::Relaxed);
        let _ = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1));
    }

    fn cancelled(&self) -> bool {
        self.left.load(Ordering::Relaxed) == 0
    }
}

fn small() -> (Scene, Settings) {
    let scene = Scene::automatic(Preset::Bucky.volume(Axis::Y).unwrap()).unwrap();
    let settings = Settings::default().with(|settings| {
        settings.map.size = 160;
        settings.image.size = [160, 120];
    });
    (scene, settings)
}

/// Maps of every kind, and pictures, end early with their own error, and there is never a result
/// that is incomplete.
#[test]
fn work_that_nobody_wants_ends() {
    let (scene, settings) = small();
    for kind in MapKind::all() {
        let settings = settings.with(|settings| settings.map.kind = Some(kind));
        let beam = scene.only_beam().unwrap();
        let whole = Impatient::after(u64::MAX);
        CpuBackend.map(&beam, &settings, &whole).unwrap();
        let all = whole.heard.load(Ordering::Relaxed);
        for patience in [0, 1] {
            let progress = Impatient::after(patience);
            let error = CpuBackend.map(&beam, &settings, &progress).unwrap_err();
            assert!(matches!(error.kind(), ErrorKind::Cancelled), "{kind}: {error}");
            let heard = progress.heard.load(Ordering::Relaxed);
            assert!(heard < all, "{kind}: {heard} of {all} reports");
        }
    }
    for samples in [1, 3] {
        for tolerance in [0.0, 0.002] {
            let settings = settings.with(|settings| {
                (settings.image.samples, settings.image.tolerance) = (samples, tolerance);
            });
            let beam = scene.only_beam().unwrap();
            let map = CpuBackend.map(&beam, &settings, &Silent).unwrap();
            let whole = Impatient::after(u64::MAX);
            let picture = CpuBackend.view(&beam, &settings, &map, &whole).unwrap();
            assert_eq!(picture, CpuBackend.view(&beam, &settings, &map, &Silent).unwrap());
            let all = whole.heard.load(Ordering::Relaxed);
            for patience in [0, 1, all / 2] {
                let progress = Impatient::after(patience);
                let error = CpuBackend.view(&beam, &settings, &map, &progress).unwrap_err();
                assert!(matches!(error.kind(), ErrorKind::Cancelled), "{samples}: {error}");
            }
        }
    }
}

/// Remembers what was done.
struct Works(std::sync::Mutex<Vec<String>>);
impl Progress for Works {
    fn begin(&self, what: &str, _total: u64) {
        self.0.lock().unwrap().push(what.to_owned());
    }
    fn advance(&self, _parts: u64) {}
}

/// A picture that is cancelled leaves its stage the map, and the next picture is the right one.
#[test]
fn a_cancelled_picture_keeps_the_map() {
    let (scene, settings) = small();
    let expected = CpuBackend.render(&scene, &settings, &Silent).unwrap();
    let mut stage = CpuBackend.stage();
    // The map makes ten reports.
    let progress = Impatient::after(12);
    let error = stage.render(&scene, &settings, &progress).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::Cancelled), "{error}");
    let works = Works(std::sync::Mutex::default());
    assert_eq!(stage.render(&scene, &settings, &works).unwrap(), expected);
    assert_eq!(*works.0.lock().unwrap(), ["picture"]);
}

/// A file of values from `low` to `high`, as one `[volume]` table.
fn table_of(folder: &std::path::Path, name: &str, [low, high]: [f32; 2]) -> VolumeTable {
    let value = |(z, y, x): (usize, usize, usize)| {
        let share = ((x * 7 + y * 5 + z * 3) % 32) as f32 / 31.0;
        if x == 0 || y == 0 || z == 0 { low } else { low + share * (high - low) }
    };
    let values = Array3::from_shape_fn((9, 10, 11), value);
    let path = folder.join(name);
    std::fs::write(&path, encode_array(values.shape(), values.iter().copied()).unwrap()).unwrap();
    VolumeTable { path: Some(path), ..VolumeTable::default() }
}

fn with_points(table: &VolumeTable, points: &[[f64; 5]]) -> SceneFile {
    let transfer = TransferTable { points: Some(points.to_vec()), ..TransferTable::default() };
    let table = VolumeTable { transfer: Some(transfer), ..table.clone() };
    SceneFile { volume: vec![table].into(), ..SceneFile::default() }
}

/// Whatever is edited, the loader gives what reading the file gives, and it reads the file only where
/// that makes a difference.
#[test]
fn an_edited_transfer_function_needs_no_file() {
    let folder = tempfile::tempdir().unwrap();
    for (name, range) in [("positive", [0.0, 2.0]), ("signed", [-300.0, 900.0])] {
        let table = table_of(folder.path(), &format!("{name}.npy"), range);
        let [low, high] = range.map(f64::from);
        let at = |share: f64| low + share * (high - low);
        let function =
            |a: f64, b: f64| [[at(a), 1.0, 0.5, 0.25, 0.0], [at(b), 0.5, 0.75, 1.0, 1.0]];
        let mut loader = SceneLoader::default();
        let plain = SceneFile { volume: vec![table.clone()].into(), ..SceneFile::default() };
        loader.load(&plain, true).unwrap();
        let mut last = None;
        for (a, b, again) in [
            (0.0, 1.0, None),
            (0.1, 0.9, Some(true)),
            (0.0, 0.4, Some(true)),
            (0.3, 0.31, Some(false)),
            (0.0, 1.0, Some(false)),
            (0.2, 1.0, Some(true)),
        ] {
            let file = with_points(&table, &function(a, b));
            assert!(!loader.holds(&file, true));
            let (loaded, _) = loader.load(&file, true).unwrap();
            assert!(loader.holds(&file, true));
            let own = &loaded.volumes[0];
            let (fresh, _) = load_ingredients(&file.volume[0], true).unwrap();
            let what = format!("{name} {a} {b}");
            assert_eq!(own.volume.values(), fresh.volume.values(), "{what}");
            assert_eq!(own.volume.moved_by(), fresh.volume.moved_by(), "{what}");
            assert_eq!(own.volume.stored_range(), fresh.volume.stored_range(), "{what}");
            assert_eq!(own.transfer, fresh.transfer, "{what}");
            assert_eq!(own.densities, fresh.densities, "{what}");
            if let (Some(last), Some(again)) = (&last, again) {
                assert_eq!(Arc::ptr_eq(last, &own.volume), again, "{what}");
            }
            last = Some(own.volume.clone());
            // What is chosen for both is the same, again and again.
            let chosen = |loaded| {
                let (scene, _, choices) = complete(&file, loaded, Surroundings::Studio).unwrap();
                (scene.camera, scene.media.bodies()[0].medium.density_scale, choices)
            };
            let expected = chosen(vec![fresh].into());
            assert_eq!(chosen(loaded.clone()), expected, "{what}");
            assert_eq!(chosen(loaded), expected, "{what}");
        }
    }
}

/// A scene whose density alone is changed holds the very same volume; another path is read.
#[test]
fn what_stays_the_same_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["a.npy", "b.npy"].map(|name| table_of(folder.path(), name, [0.0, 1.0]));
    let file_of = |table: &VolumeTable| SceneFile {
        volume: vec![table.clone()].into(),
        ..SceneFile::default()
    };
    let mut loader = SceneLoader::default();
    let (loaded, _) = loader.load(&file_of(&first), true).unwrap();
    let denser = VolumeTable { density_scale: Some(9.0), ..first.clone() };
    assert!(loader.holds(&file_of(&denser), true));
    let (again, _) = loader.load(&file_of(&denser), true).unwrap();
    assert!(Arc::ptr_eq(&loaded.volumes[0].volume, &again.volumes[0].volume));
    assert!(!loader.holds(&file_of(&second), true));
    let (other, _) = loader.load(&file_of(&second), true).unwrap();
    assert!(!Arc::ptr_eq(&loaded.volumes[0].volume, &other.volumes[0].volume));
}
