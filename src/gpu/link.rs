//! Joins shader files: a line `#import kernel/NAME` stands for that file, each file once.

use crate::error::{Error, Result};

/// The files that can be imported.
const KERNEL: [(&str, &str); 8] = [
    ("kernel/density", include_str!("../../shaders/kernel/density.wgsl")),
    ("kernel/frame", include_str!("../../shaders/kernel/frame.wgsl")),
    ("kernel/light", include_str!("../../shaders/kernel/light.wgsl")),
    ("kernel/medium", include_str!("../../shaders/kernel/medium.wgsl")),
    ("kernel/ray", include_str!("../../shaders/kernel/ray.wgsl")),
    ("kernel/shadow", include_str!("../../shaders/kernel/shadow.wgsl")),
    ("kernel/threshold", include_str!("../../shaders/kernel/threshold.wgsl")),
    ("kernel/view", include_str!("../../shaders/kernel/view.wgsl")),
];

/// `root` with all that it imports in front of it, imports first.
///
/// # Errors
/// If it imports a file that does not exist.
pub fn linked(root: &str) -> Result<String> {
    let mut text = String::new();
    append(root, &mut Vec::new(), &mut text)?;
    Ok(text)
}

/// The WGSL that another wgpu program puts in front of its own shaders to shade its objects with a
/// threshold map: `shadow_at(world: vec3<f32>) -> f32` is the transmittance from the light. Its
/// bindings are in bind group `group`: 0 the uniform buffer ([`super::GpuFrame::buffer`]), 3 the map
/// ([`super::GpuMap::view`], a `texture_2d<f32>` that need not be filterable).
///
/// # Errors
/// Never with the shaders that the crate is built with.
pub fn shadow_wgsl(group: u32) -> Result<String> {
    let text = linked("#import kernel/shadow\n")?;
    Ok(text.replace("@group(0)", &format!("@group({group})")))
}

fn append<'a>(source: &'a str, done: &mut Vec<&'a str>, text: &mut String) -> Result<()> {
    for line in source.lines() {
        let Some(name) = line.strip_prefix("#import ") else {
            text.push_str(line);
            text.push('\n');
            continue;
        };
        if done.contains(&name) {
            continue;
        }
        done.push(name);
        let file = KERNEL.iter().find(|(file, _)| *file == name);
        let (_, source) =
            file.ok_or_else(|| Error::value("shader", format!("no file '{name}' to import")))?;
        append(source, done, text)?;
    }
    Ok(())
}
