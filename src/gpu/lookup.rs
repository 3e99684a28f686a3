//! The shadow lookup for shaders of other wgpu programs: its WGSL, and the bind group that it reads.

use wgpu::{BindGroup, BindGroupLayout, BindGroupLayoutEntry, BindingResource, ShaderStages};

use super::bindings::{self, at, entry};
use super::link::lookup;
use super::passes::NESTED;
use super::renderer::{GpuFrame, Renderer};
use super::shadow::GpuShadow;
use crate::error::{Error, Result};
use crate::settings::MapKind;

/// What the names of the lookup begin with, but for `shadow_at`.
pub const PREFIX: &str = "deepshadow_";
/// The function that other shaders call.
const SHADOW_AT: &str = "shadow_at";

/// The WGSL that another wgpu program puts in front of its own shaders to shade its objects with a
/// shadow map: `shadow_at(world: vec3<f32>) -> f32` returns the share of the light, 0..1, that
/// arrives at a position in the world. All other names begin with [`PREFIX`]. Its bindings are in
/// bind group `group`, which [`Renderer::shadow_group`] makes.
///
/// The answer is for one beam: one light, in the beam's channels, through one of the light's views.
/// A scene of several beams needs a bind group for each; where a light has several views,
/// [`LightView::answers_for`](crate::scene::LightView::answers_for) says which one covers a
/// position. Positions are taken to lie on surfaces:
/// [`ViewSettings::bias`](crate::settings::ViewSettings::bias) is subtracted from their depth.
///
/// # Errors
/// If `map` is neither [`MapKind::Threshold`] nor [`MapKind::Fragments`] nor `nested`: other kinds are
/// looked up on the CPU only.
pub fn shadow_wgsl(group: u32, map: MapKind) -> Result<String> {
    check(map)?;
    let text = lookup(map)?.text.replace("@group(0)", &format!("@group({group})"));
    Ok(prefixed(&text))
}

fn check(map: MapKind) -> Result<()> {
    if matches!(map, MapKind::Threshold | MapKind::Fragments | NESTED) {
        return Ok(());
    }
    Err(Error::value("map", format!("maps of kind '{map}' are looked up on the CPU only")))
}

fn entries(map: MapKind) -> Vec<BindGroupLayoutEntry> {
    match map {
        MapKind::Threshold => vec![bindings::frame(), bindings::threshold_map()],
        NESTED => {
            let texels = [at::CODED, at::EXTENTS].map(bindings::read);
            [bindings::frame()].into_iter().chain(texels).collect()
        }
        _ => {
            let lists = [at::RUNS, at::NODES, at::LINKS].map(bindings::read);
            [bindings::frame()].into_iter().chain(lists).collect()
        }
    }
}

impl Renderer {
    /// The layout of the bind group that [`shadow_wgsl`] reads, for pipelines that call `shadow_at`
    /// in the stages `visibility`.
    ///
    /// # Errors
    /// As [`shadow_wgsl`].
    pub fn shadow_layout(&self, map: MapKind, visibility: ShaderStages) -> Result<BindGroupLayout> {
        check(map)?;
        let entries: Vec<_> = entries(map)
            .into_iter()
            .map(|entry| BindGroupLayoutEntry { visibility, ..entry })
            .collect();
        Ok(self.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow lookup"),
            entries: &entries,
        }))
    }

    /// The bind group that [`shadow_wgsl`] reads: the map `shadow`, which was built from `frame`.
    /// `layout` is that of [`Renderer::shadow_layout`] for the same kind of map.
    pub fn shadow_group(
        &self,
        layout: &BindGroupLayout,
        frame: &GpuFrame,
        shadow: GpuShadow<'_>,
    ) -> BindGroup {
        let mut entries = vec![entry(at::FRAME, frame.buffer().as_entire_binding())];
        match shadow {
            GpuShadow::Threshold(map) => {
                entries.push(entry(at::THRESHOLD_MAP, BindingResource::TextureView(map.view())));
            }
            GpuShadow::Fragments(lists) => entries.extend(lists.lookup_entries()),
            GpuShadow::Nested(map) => entries.extend(map.entries()),
        }
        self.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow lookup"),
            layout,
            entries: &entries,
        })
    }
}

/// WGSL in which every name of the module but `shadow_at` begins with [`PREFIX`].
fn prefixed(source: &str) -> String {
    let declared: Vec<&str> =
        source.lines().filter_map(declared_name).filter(|name| *name != SHADOW_AT).collect();
    let mut text = String::with_capacity(source.len() * 5 / 4);
    let mut in_struct = false;
    for line in source.lines() {
        in_struct = (in_struct || line.starts_with("struct ")) && line != "}";
        let code = line.split("//").next().unwrap_or_default();
        let mut rest = code;
        let mut before = ' ';
        while let Some(start) = rest.find(is_word) {
            before = rest[..start].chars().last().unwrap_or(before);
            text.push_str(&rest[..start]);
            let length = rest[start..].find(|c| !is_word(c)).unwrap_or(rest.len() - start);
            let (word, after) = rest[start..].split_at(length);
            // Members keep their names, in their declaration and behind a dot.
            let member = before == '.' || in_struct && after.starts_with(':');
            if !member && declared.contains(&word) {
                text.push_str(PREFIX);
            }
            text.push_str(word);
            before = ' ';
            rest = after;
        }
        text.push_str(rest);
        text.push_str(&line[code.len()..]);
        text.push('\n');
    }
    text
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The name that a line declares for the whole module, as this project's shaders are written.
fn declared_name(line: &str) -> Option<&str> {
    let line = line.split("//").next()?;
    // Attributes (of bindings) end with the last parenthesis in front of the keyword.
    let line = if line.starts_with('@') { line.rsplit_once(") ")?.1 } else { line };
    let (keyword, rest) = line.split_once([' ', '<'])?;
    let rest = match keyword {
        "fn" | "struct" | "const" | "override" | "alias" => rest,
        "var" => rest.split_once("> ").map_or(rest, |(_, name)| name),
        _ => return None,
    };
    let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
    Some(&rest[..end]).filter(|name| !name.is_empty())
}
