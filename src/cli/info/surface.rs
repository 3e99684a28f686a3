//! The report of `info` on hair and meshes, and its text.

use std::path::Path;

use glam::Vec3;
use serde_json::{Value as Json, json};

use super::text::Lines;
use crate::cli::say;
use crate::error::Result;
use crate::io::json::number;
use crate::io::{Format, SurfaceFile, read_surface_as};
use crate::surface::{Material, Mesh, Strands};

/// Materials that are listed for people.
const LISTED: usize = 20;

/// What is known of a surface; 0 for what it has not.
pub(super) struct SurfaceReport {
    kind: &'static str,
    strands: usize,
    points: usize,
    segments: usize,
    vertices: usize,
    triangles: usize,
    /// Whether a mesh has normals of its own.
    smooth: bool,
    /// Of what is kept.
    bounds: [Vec3; 2],
    thickness: Option<[f64; 2]>,
    opacity: [f64; 2],
    materials: Vec<Material>,
    skipped: usize,
    file_bytes: u64,
    memory_bytes: u64,
}

impl SurfaceReport {
    /// Reads the file, and prints what people should know of it.
    pub(super) fn of(path: &Path, format: Format, max_bytes: u64) -> Result<Self> {
        let (surface, notes) = read_surface_as(path, format, max_bytes)?;
        for note in &notes {
            say(note);
        }
        let file_bytes = path.metadata().map_or(0, |found| found.len());
        Ok(match surface {
            SurfaceFile::Mesh(mesh) => Self::of_mesh(&mesh, file_bytes),
            SurfaceFile::Strands(strands) => Self::of_strands(&strands, file_bytes),
        })
    }

    fn of_strands(strands: &Strands, file_bytes: u64) -> Self {
        let points = strands.points().len();
        Self {
            kind: "strands",
            strands: strands.count(),
            points,
            segments: points - strands.count(),
            vertices: 0,
            triangles: 0,
            smooth: false,
            bounds: bounds(strands.points().iter().copied()),
            thickness: Some(range(strands.thickness().values().iter().map(|&x| x.into()))),
            opacity: range(strands.opacity().values().iter().map(|&x| x.into())),
            materials: Vec::new(),
            skipped: strands.skipped(),
            file_bytes,
            memory_bytes: strands.bytes(),
        }
    }

    fn of_mesh(mesh: &Mesh, file_bytes: u64) -> Self {
        let triangles = mesh.triangles().len();
        let corners = (0..triangles).flat_map(|triangle| mesh.corners(triangle));
        Self {
            kind: "mesh",
            strands: 0,
            points: 0,
            segments: 0,
            vertices: mesh.positions().len(),
            triangles,
            smooth: !mesh.is_flat(),
            bounds: bounds(corners),
            thickness: None,
            opacity: range((0..triangles).map(|triangle| mesh.material(triangle).opacity)),
            materials: mesh.materials().to_vec(),
            skipped: mesh.skipped(),
            file_bytes,
            memory_bytes: mesh.bytes(),
        }
    }

    fn is_mesh(&self) -> bool {
        self.kind == "mesh"
    }

    pub(super) fn json(&self) -> Json {
        let numbers = |values: [f64; 2]| values.map(number);
        let vector = |v: Vec3| v.to_array().map(|x| number(x.into()));
        let material = |one: &Material| {
            let albedo = one.albedo.to_array().map(number);
            json!({ "name": one.name, "albedo": albedo, "opacity": number(one.opacity) })
        };
        let of = |is_mesh: bool, count: usize| (self.is_mesh() == is_mesh).then_some(count);
        json!({
            "kind": self.kind,
            "strands": of(false, self.strands),
            "points": of(false, self.points),
            "segments": of(false, self.segments),
            "vertices": of(true, self.vertices),
            "triangles": of(true, self.triangles),
            "smooth": self.is_mesh().then_some(self.smooth),
            "bounds": self.bounds.map(vector),
            "thickness": self.thickness.map(numbers),
            "opacity": numbers(self.opacity),
            "materials": self.materials.iter().map(material).collect::<Vec<_>>(),
            "skipped": self.skipped,
            "file_bytes": self.file_bytes,
            "memory_bytes": self.memory_bytes,
        })
    }

    pub(super) fn text(&self, text: &mut Lines) {
        let list = |v: Vec3| v.to_array().map(|x| x.to_string()).join(",");
        let span = |[low, high]: [f64; 2]| {
            // Numbers of files have 32 bits.
            let [low, high] = [low as f32, high as f32];
            if low == high { low.to_string() } else { format!("{low} .. {high}") }
        };
        if self.is_mesh() {
            text.add(format_args!("  triangles   {}", self.triangles));
            text.add(format_args!("  vertices    {}", self.vertices));
            let edges = if self.smooth { "smooth" } else { "sharp" };
            text.add(format_args!("  edges       {edges}"));
        } else {
            let Self { strands, points, segments, .. } = self;
            text.add(format_args!("  strands     {strands}"));
            text.add(format_args!("  points      {points}, {segments} segments"));
        }
        let [low, high] = self.bounds.map(list);
        text.add(format_args!("  bounds      {low} .. {high}"));
        if let Some(thickness) = self.thickness {
            text.add(format_args!("  thickness   {}", span(thickness)));
        }
        text.add(format_args!("  opacity     {}", span(self.opacity)));
        for one in self.materials.iter().take(LISTED) {
            let name = if one.name.is_empty() { "(unnamed)" } else { &one.name };
            let (albedo, opacity) = (list(one.albedo.as_vec3()), one.opacity as f32);
            text.add(format_args!("  material    {name}: albedo {albedo}, opacity {opacity}"));
        }
        if self.materials.len() > LISTED {
            text.add(format_args!("  material    {} more", self.materials.len() - LISTED));
        }
        if self.skipped > 0 {
            let what = if self.is_mesh() { "triangles" } else { "strands" };
            text.add(format_args!("  left out    {} {what}", self.skipped));
        }
        let Self { file_bytes, memory_bytes, .. } = self;
        text.add(format_args!("  stored      {file_bytes} bytes, {memory_bytes} bytes in memory"));
    }
}

fn bounds(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    points.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], point| {
        [low.min(point), high.max(point)]
    })
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}
