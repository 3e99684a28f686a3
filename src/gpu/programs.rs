//! The passes' pipelines. Each is compiled when it is first recorded, because drivers take up to
//! seconds for one.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, Builder};

use super::bindings;
use super::link::{self, Imports, MediaKind};
use super::passes::{Declaration, Pass};
use super::waiting::Scopes;
use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::settings::MapKind;

/// Which code of a shader a frame needs: by default that for all settings and for grey media.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Variant {
    /// Only that for the usual settings, to which the shaders' constant `USUAL` cuts it.
    usual: bool,
    /// That for channels of different extinction, which the constant `COLOURED` adds.
    coloured: bool,
    /// That for wide filters along links, which the constant `LINKED` adds.
    linked: bool,
}

impl Variant {
    /// For the usual settings and grey media.
    #[cfg(not(target_family = "wasm"))]
    pub(super) const USUAL: Self = Self { usual: true, coloured: false, linked: false };

    /// How many there are.
    const COUNT: usize = 8;

    pub(super) fn of(frame: &Frame) -> Self {
        Self {
            usual: frame.is_usual(),
            coloured: frame.media.coloured == 1,
            linked: frame.map.window > 1 && frame.map.follows_links == 1,
        }
    }

    /// A number below [`Self::COUNT`].
    pub(super) fn index(self) -> u8 {
        u8::from(self.usual) + 2 * u8::from(self.coloured) + 4 * u8::from(self.linked)
    }

    pub(super) fn at(index: u8) -> Self {
        Self { usual: index & 1 == 1, coloured: index & 2 == 2, linked: index & 4 == 4 }
    }

    /// The constants of a pipeline.
    fn constants(self) -> Vec<(&'static str, f64)> {
        let all = [("USUAL", self.usual), ("COLOURED", self.coloured), ("LINKED", self.linked)];
        all.into_iter().filter(|(_, is)| *is).map(|(name, _)| (name, 1.0)).collect()
    }
}

/// A compute pass for one kind of media.
#[derive(Debug)]
pub(super) struct Program {
    device: wgpu::Device,
    scopes: Scopes,
    pass: Pass,
    declaration: Declaration,
    media: MediaKind,
    pub(super) layout: wgpu::BindGroupLayout,
    /// By variant.
    compiled: [Mutex<Option<wgpu::ComputePipeline>>; Variant::COUNT],
}

impl Program {
    fn new((device, scopes): (&wgpu::Device, &Scopes), pass: Pass, media: MediaKind) -> Self {
        let (device, scopes, declaration) = (device.clone(), scopes.clone(), pass.declaration());
        let layout = layout(&device, &declaration, media);
        let compiled = Default::default();
        Self { device, scopes, pass, declaration, media, layout, compiled }
    }

    pub(super) fn workgroup(&self) -> [u32; 2] {
        self.declaration.workgroup
    }

    /// The pipeline for a variant, if the shader has it; compiled at the first call.
    pub(super) fn pipeline(&self, variant: Variant) -> Result<wgpu::ComputePipeline> {
        let declaration = &self.declaration;
        let variant = match (declaration.varies, declaration.map) {
            (false, _) => Variant::default(),
            (true, MapKind::Fragments) => variant,
            (true, _) => Variant { linked: false, ..variant },
        };
        // A thread that panicked left it empty or complete.
        let mut compiled = self.compiled[usize::from(variant.index())]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = &*compiled {
            return Ok(pipeline.clone());
        }
        let module = module(&self.device, &self.scopes, declaration, self.media)?;
        let constants = &variant.constants()[..];
        let pipeline = self.scopes.scoped(Error::gpu, || {
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(declaration.name),
                layout: Some(&of_one_group(&self.device, declaration.name, &self.layout)),
                module: &module,
                entry_point: Some(declaration.name),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    ..Default::default()
                },
                cache: None,
            })
        })?;
        Ok(compiled.insert(pipeline).clone())
    }
}

/// A pass that draws, and the format of the target that a render pass requires.
#[derive(Clone, Debug)]
pub(super) struct RasterProgram {
    pub(super) layout: wgpu::BindGroupLayout,
    pub(super) pipeline: wgpu::RenderPipeline,
}

impl RasterProgram {
    /// Format of the target, to which nothing is ever written.
    pub(super) const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

    /// `vertex` is the entry point that places what is drawn.
    fn new(
        (device, scopes): (&wgpu::Device, &Scopes),
        (pass, vertex): (Pass, &str),
        media: MediaKind,
    ) -> Result<Self> {
        let mut declaration = pass.declaration();
        for entry in &mut declaration.bindings {
            // Shaders that place corners write nothing.
            let writes = wgpu::BufferBindingType::Storage { read_only: false };
            entry.visibility = match entry.ty {
                wgpu::BindingType::Buffer { ty, .. } if ty == writes => {
                    wgpu::ShaderStages::FRAGMENT
                }
                _ => wgpu::ShaderStages::VERTEX_FRAGMENT,
            };
        }
        let layout = layout(device, &declaration, media);
        let module = module(device, scopes, &declaration, media)?;
        let pipeline = scopes.scoped(Error::gpu, || {
            let pipeline_layout = of_one_group(device, declaration.name, &layout);
            let target = wgpu::ColorTargetState {
                format: Self::TARGET,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            };
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(declaration.name),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(declaration.name),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(target)],
                }),
                multiview_mask: None,
                cache: None,
            })
        })?;
        Ok(Self { layout, pipeline })
    }
}

/// The layout of a pass's bind group.
fn layout(
    device: &wgpu::Device,
    declaration: &Declaration,
    media: MediaKind,
) -> wgpu::BindGroupLayout {
    let mut entries = declaration.bindings.clone();
    if declaration.media {
        let stages = entries.first().map_or(wgpu::ShaderStages::COMPUTE, |entry| entry.visibility);
        entries.extend(bindings::media(media).into_iter().map(|mut entry| {
            entry.visibility = stages;
            entry
        }));
    }
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(declaration.name),
        entries: &entries,
    })
}

fn of_one_group(
    device: &wgpu::Device,
    name: &str,
    group: &wgpu::BindGroupLayout,
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(group)],
        immediate_size: 0,
    })
}

fn module(
    device: &wgpu::Device,
    scopes: &Scopes,
    declaration: &Declaration,
    media: MediaKind,
) -> Result<wgpu::ShaderModule> {
    let &Declaration { name, source, map, surfaces, .. } = declaration;
    let linked = link::linked(source, Imports { map, media, surfaces })?;
    let text = wgpu::ShaderSource::Wgsl(linked.text.clone().into());
    let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source: text };
    let explain = move |why: String| Error::gpu(linked.explained(name, &why));
    scopes.scoped(explain, || device.create_shader_module(descriptor))
}

/// All programs of a device that were requested so far, by pass and kind of media.
#[derive(Debug)]
pub(super) struct Programs {
    device: wgpu::Device,
    scopes: Scopes,
    compute: Mutex<Vec<Arc<Program>>>,
    raster: Mutex<Vec<(Pass, MediaKind, RasterProgram)>>,
}

impl Programs {
    pub(super) fn new(device: &wgpu::Device, scopes: &Scopes) -> Self {
        let (device, scopes) = (device.clone(), scopes.clone());
        Self { device, scopes, compute: Mutex::default(), raster: Mutex::default() }
    }

    /// Forgets all programs.
    pub(super) fn forget(&self) {
        self.compute.lock().unwrap_or_else(PoisonError::into_inner).clear();
        self.raster.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// A compute pass, which may not be compiled yet.
    pub(super) fn compute(&self, pass: Pass, media: MediaKind) -> Arc<Program> {
        let mut known = self.compute.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = known.iter().find(|p| (p.pass, p.media) == (pass, media)) {
            return found.clone();
        }
        let made = Arc::new(Program::new((&self.device, &self.scopes), pass, media));
        known.push(made.clone());
        made
    }

    /// A pass that draws, with the entry point that places what is drawn.
    ///
    /// # Errors
    /// If the device rejects the shader.
    pub(super) fn raster(
        &self,
        (pass, vertex): (Pass, &str),
        media: MediaKind,
    ) -> Result<RasterProgram> {
        let mut known = self.raster.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, found)) =
            known.iter().find(|(of, kind, _)| (*of, *kind) == (pass, media))
        {
            return Ok(found.clone());
        }
        let made = RasterProgram::new((&self.device, &self.scopes), (pass, vertex), media)?;
        known.push((pass, media, made.clone()));
        Ok(made)
    }

    /// Compiles passes in parallel, before they are needed.
    ///
    /// # Errors
    /// If the device rejects a shader.
    pub(super) fn compile(
        &self,
        passes: &[Pass],
        media: MediaKind,
        variant: Variant,
    ) -> Result<()> {
        let compile = |pass: Pass| self.compute(pass, media).pipeline(variant).map(drop);
        if cfg!(target_family = "wasm") {
            // There are no threads, and browsers compile while nobody waits.
            return passes.iter().try_for_each(|&pass| compile(pass));
        }
        let [first, others @ ..] = passes else { return Ok(()) };
        thread::scope(|scope| {
            let spawn = |&pass: &Pass| Builder::new().spawn_scoped(scope, move || compile(pass));
            // If no thread can be started, a pass is compiled when it is recorded.
            let others: Vec<_> = others.iter().filter_map(|pass| spawn(pass).ok()).collect();
            let first = compile(*first);
            let joined = others.into_iter().map(|other| other.join().unwrap_or(Ok(())));
            std::iter::once(first).chain(joined).collect()
        })
    }
}
