//! Checks the layers of ARCHITECTURE.md in the sources: a module imports only from layers below it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::project;

/// The lowest layer first.
const LAYERS: [&[&str]; 10] = [
    &["error", "math", "parallel", "progress"],
    &["image", "settings", "surface", "volume"],
    &["scene"],
    &["frame"],
    &["kernel", "reference"],
    &["shadow"],
    &["accuracy", "backend"],
    &["cpu", "gpu", "io"],
    &["compare", "probe"],
    &["cli"],
];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|modules| modules.contains(&module))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        // Build output of the fuzz targets is not a source.
        if path.ends_with("tests/fuzz/target") {
            continue;
        }
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found
}

/// Those of the library and its program; the members of the workspace in `src/apps` are their own
/// crates.
fn library() -> Vec<PathBuf> {
    let root = project().join("src");
    let mut found = sources(&root);
    found.retain(|path| !path.starts_with(root.join("apps")));
    found
}

/// The module directly below the crate root that a file belongs to.
fn module_of(path: &Path, root: &Path) -> String {
    let first = path.strip_prefix(root).unwrap().components().next().unwrap();
    Path::new(first.as_os_str()).file_stem().unwrap().to_string_lossy().into_owned()
}

/// The names after each `crate::`, and those in braces directly after it. `Error` and `Result`,
/// which the crate's root re-exports, count as `error`.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        let names = match rest.strip_prefix('{') {
            Some(list) => list.split('}').next().unwrap_or_default(),
            None => rest,
        };
        let whole = rest.starts_with('{');
        for part in names.split(',').take(if whole { usize::MAX } else { 1 }) {
            let is_name = |c: char| c.is_alphanumeric() || c == '_';
            let name: String = part.trim().chars().take_while(|&c| is_name(c)).collect();
            found.push(if ["Error", "ErrorKind", "Result"].contains(&name.as_str()) {
                "error".to_owned()
            } else {
                name
            });
        }
    }
    found
}

#[test]
fn modules_import_only_from_layers_below() {
    let root = project().join("src");
    let mut wrong = Vec::new();
    for path in library() {
        let module = module_of(&path, &root);
        if module == "lib" || module == "main" {
            continue;
        }
        let own = layer(&module).unwrap_or_else(|| panic!("'{module}' stands in no layer"));
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains("super::super::"), "{} climbs two modules", path.display());
        for import in imports(&text).into_iter().filter(|import| *import != module) {
            if layer(&import).is_none_or(|other| other >= own) {
                wrong.push(format!("{} imports crate::{import}", path.display()));
            }
        }
        // The GPU's results must not come from the CPU.
        if module == "gpu" && imports(&text).iter().any(|import| import == "kernel") {
            wrong.push(format!("{} imports crate::kernel", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn files_stay_small_enough_to_hold_in_the_head() {
    let root = project();
    for folder in ["src", "tests"] {
        for path in sources(&root.join(folder)) {
            let lines = fs::read_to_string(&path).unwrap().lines().count();
            assert!(lines <= 400, "{} has {lines} lines", path.display());
        }
    }
}

/// The library uses the names of scene files; the command line's names for them are known in one
/// place only.
#[test]
fn options_of_the_command_line_are_known_to_it_alone() {
    for file in library() {
        let name = file.strip_prefix(project()).unwrap().to_string_lossy().into_owned();
        if name.starts_with("src/cli") {
            continue;
        }
        for line in fs::read_to_string(&file).unwrap().lines() {
            let code = line.split("//").next().unwrap_or_default();
            let option = code.split("--").nth(1).is_some_and(|rest| {
                code.contains('"') && rest.starts_with(|c: char| c.is_ascii_lowercase())
            });
            assert!(!option, "{name}: {line}");
        }
    }
}

/// Members of the workspace use nothing but the library's public face: no module that is hidden from
/// its documentation. (Their tests may run the program.)
#[test]
fn apps_use_the_public_face_alone() {
    let apps = project().join("src/apps");
    let mut found = 0;
    for app in fs::read_dir(apps).unwrap() {
        for path in sources(&app.unwrap().path().join("src")) {
            found += 1;
            let text = fs::read_to_string(&path).unwrap();
            for hidden in ["cli", "frame", "kernel"] {
                let used = text.contains(&format!("deepshadow::{hidden}"));
                assert!(!used, "{} uses deepshadow::{hidden}", path.display());
            }
        }
    }
    assert!(found > 10, "{found} files");
}

/// Where there is no disk, `io` reads what a program has mounted: nothing but `files` asks the disk,
/// and what writes.
#[test]
fn files_are_read_through_one_place() {
    let root = project().join("src/io");
    let asks = ["std::fs", "fs::", "File::open(", ".exists()", ".canonicalize()", ".is_dir()"];
    let mut found = 0;
    for path in sources(&root) {
        let name = path.strip_prefix(&root).unwrap();
        if name.starts_with("files") || name.starts_with("output") {
            continue;
        }
        found += 1;
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            // Files of an older output are removed.
            let removes = name.ends_with("dense/detached.rs");
            // Types may end like the standard library's.
            let own = ["VdbFile::open(", "DeepFile::open(", "DenseFile::open("];
            let asked = asks.iter().any(|ask| line.contains(ask));
            let own = own.iter().any(|own| line.contains(own));
            assert!(!asked || own || removes, "{}: {line}", name.display());
        }
    }
    assert!(found > 50, "{found} files");
}

/// Passes that only GPUs need: on the host, a threshold map computes its curves itself, pictures are
/// added up, and lists are vectors that are filled and sorted at once and take what they need.
#[cfg(feature = "gpu")]
const GPU_ONLY: [&str; 11] = [
    "fit_curves",
    "code_nested",
    "raster_large",
    "draw_surfaces",
    "sort_surfaces",
    "pack_lists",
    "raster_view_large",
    "sort_view",
    "rank_radiance",
    "add_beam",
    "show_image",
];

/// A pass has the same name everywhere: its shader, its entry point, its CPU file.
#[cfg(feature = "gpu")]
#[test]
fn every_pass_has_one_name() {
    use deepshadow::gpu::{PassSource, pass_sources};
    let root = project();
    for PassSource { name, source, .. } in pass_sources() {
        assert!(source.contains(&format!("fn {name}(")), "{name}.wgsl has no such entry point");
        let there = root.join(format!("src/cpu/{name}.rs")).exists();
        assert!(there || GPU_ONLY.contains(&name), "no src/cpu/{name}.rs");
        let page = fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
        assert!(page.contains(name), "ARCHITECTURE.md does not name {name}");
    }
}
