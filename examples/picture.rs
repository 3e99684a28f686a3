//! Renders a volume file to a picture, on the GPU if there is one: `cargo run --example picture --
//! smoke.vdb`.
#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

use deepshadow::volume::{Axis, presets::Preset};
use deepshadow::{Backend, CpuBackend, Result, Scene, Settings, Silent, io};

/// Writes a picture of `input`, or of a preset, into `folder`, and returns its path.
pub fn example(input: Option<&Path>, folder: &Path) -> Result<PathBuf> {
    let volume = match input {
        Some(path) => io::open(path)?,
        None => Preset::Bucky.volume(Axis::Y)?,
    };
    let scene = Scene::automatic(volume)?;
    let settings = Settings::default().with(|settings| settings.image.size = [320, 240]);
    let backend = best_backend();
    let image = backend.render(&scene, &settings, &Silent)?;
    let mut name = input.and_then(Path::file_stem).unwrap_or("bucky".as_ref()).to_owned();
    name.push(".png");
    let path = folder.join(name);
    image.save(&path, 1.0)?;
    println!("{} on {}", path.display(), backend.description());
    Ok(path)
}

#[cfg(feature = "gpu")]
fn best_backend() -> Box<dyn Backend> {
    use deepshadow::gpu::{AdapterChoice, GpuBackend};
    match GpuBackend::open(AdapterChoice::Hardware) {
        Ok(gpu) => Box::new(gpu),
        Err(_) => Box::new(CpuBackend),
    }
}

#[cfg(not(feature = "gpu"))]
fn best_backend() -> Box<dyn Backend> {
    Box::new(CpuBackend)
}

#[allow(dead_code)]
fn main() -> Result<()> {
    let input = std::env::args_os().nth(1).map(PathBuf::from);
    example(input.as_deref(), Path::new(".")).map(drop)
}
