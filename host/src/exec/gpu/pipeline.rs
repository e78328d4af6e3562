//! Pipelines from compiled kernels: passthrough for `exact` on Vulkan, naga elsewhere.

use super::{cache::Cache, float_modes};
use crate::error::{AdapterError, Cause, explained};
use crate::spirv::{self, FloatMode};
use crate::{Error, Shaders, exec::Flavour};
use restir_kernels::{Access, KernelDesc};
use std::collections::{BTreeMap, HashMap};
use std::{borrow::Cow, path::Path, sync::mpsc};

/// Pipelines of the kernels on a device, by kernel and frozen constants.
///
/// For an embedder who dispatches kernels on buffers of their own: binding `i` of set 0 is
/// [`KernelDesc::bindings`]`[i]`, all of them storage buffers, read-only but for [`Access::Own`].
#[derive(Debug)]
pub struct Pipelines {
    device: wgpu::Device,
    flavour: Flavour,
    shaders: Shaders,
    passthrough: bool,
    /// `exact` modules may go through naga: only to show what that breaks
    without_guarantee: bool,
    dropped_modes: Vec<FloatMode>,
    cache: Option<Cache>,
    made: HashMap<Key, wgpu::ComputePipeline>,
}

/// Name of a kernel and values of its specialization constants.
type Key = (&'static str, Vec<u32>);

/// Whether the device takes SPIR-V as it is, which alone keeps its decorations: what the flavour `exact` needs.
pub fn takes_passthrough(device: &wgpu::Device) -> bool {
    let on_vulkan = device.adapter_info().backend == wgpu::Backend::Vulkan;
    on_vulkan && device.features().contains(wgpu::Features::PASSTHROUGH_SHADERS)
}

impl Pipelines {
    /// Kernels of the given flavour for `device`.
    pub fn new(device: &wgpu::Device, flavour: Flavour, shaders: Shaders) -> Self {
        Self {
            device: device.clone(),
            flavour,
            shaders,
            passthrough: flavour == Flavour::Exact && takes_passthrough(device),
            without_guarantee: false,
            dropped_modes: float_modes::unsupported(device),
            cache: None,
            made: HashMap::new(),
        }
    }

    /// Keeps what the driver compiles in a file of `folder`, and begins with what is there, if the device has the feature
    /// `PIPELINE_CACHE`; without, nothing changes. The file may be deleted at any time.
    #[doc(hidden)]
    #[must_use]
    pub fn kept_in(mut self, folder: &Path) -> Self {
        self.cache = Cache::open(&self.device, folder);
        self
    }

    pub(super) fn disable_passthrough(&mut self) {
        self.passthrough = false;
        self.without_guarantee = true;
        self.made.clear();
    }

    /// How modules are loaded, and which float-control modes were dropped.
    #[doc(hidden)]
    pub fn loading(&self) -> String {
        match (self.passthrough, self.dropped_modes.as_slice()) {
            (false, _) => format!("{} through naga", self.flavour),
            (true, []) => format!("{} by passthrough, all float-control modes on", self.flavour),
            (true, dropped) => format!("{} by passthrough, without {dropped:?}, which the adapter lacks", self.flavour),
        }
    }

    /// The pipeline of `kernel` with its specialization constants frozen to `constants`, in the order of the
    /// descriptor.
    ///
    /// # Errors
    /// [`Error::Module`] if the module is missing or damaged, [`Error::Kernel`] if the adapter rejects it; [`Error::Adapter`] for `exact` on
    /// a device without passthrough, where it would be wrong, not only inexact: drivers may cancel what it relies on.
    pub fn get(&mut self, kernel: &'static KernelDesc, constants: &[u32]) -> Result<wgpu::ComputePipeline, Error> {
        self.prepare(&[(kernel, constants.to_vec())], &mut |_, _| {})?;
        Ok(self.made[&(kernel.name, constants.to_vec())].clone())
    }

    /// Makes the pipelines that [`Self::get`] will be asked for, those that are missing side by side. `observe` is told
    /// how many are done, and of how many, after each of them.
    ///
    /// # Errors
    /// As [`Self::get`].
    #[doc(hidden)]
    pub fn prepare(
        &mut self,
        wanted: &[(&'static KernelDesc, Vec<u32>)],
        observe: &mut dyn FnMut(usize, usize),
    ) -> Result<(), Error> {
        let keyed = wanted.iter().map(|(kernel, constants)| ((kernel.name, constants.clone()), *kernel));
        let missing: BTreeMap<Key, _> = keyed.filter(|(key, _)| !self.made.contains_key(key)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let total = missing.len();
        let (sender, receiver) = mpsc::channel();
        let made: Result<Vec<_>, Error> = std::thread::scope(|scope| {
            let this = &*self;
            for (key, kernel) in missing {
                let sender = sender.clone();
                scope.spawn(move || sender.send(this.make(kernel, &key.1).map(|pipeline| (key, pipeline))));
            }
            drop(sender);
            receiver.iter().zip(1..).inspect(|&(_, done)| observe(done, total)).map(|(made, _)| made).collect()
        });
        self.made.extend(made?);
        self.cache.iter().for_each(Cache::save);
        Ok(())
    }

    fn make(&self, kernel: &KernelDesc, constants: &[u32]) -> Result<wgpu::ComputePipeline, Error> {
        if self.flavour == Flavour::Exact && !self.passthrough && !self.without_guarantee {
            let what = "Vulkan with the feature PASSTHROUGH_SHADERS";
            return Err(AdapterError::Lacks { adapter: "the device".to_owned(), what }.into());
        }
        let words = self.words(kernel, constants)?;
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(kernel.name),
            bind_group_layouts: &[Some(&bind_group_layout(&self.device, kernel))],
            ..wgpu::PipelineLayoutDescriptor::default()
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(kernel.name),
            layout: Some(&layout),
            module: &shader_module(&self.device, kernel, words, self.passthrough),
            entry_point: Some(kernel.name),
            compilation_options: wgpu::PipelineCompilationOptions {
                // nothing is read from it before it is written
                zero_initialize_workgroup_memory: false,
                ..wgpu::PipelineCompilationOptions::default()
            },
            cache: self.cache.as_ref().map(Cache::driver),
        });
        pollster::block_on(scope.pop()).map_or(Ok(pipeline), |error| {
            let said = super::one_line(&error);
            let sentence = format!("the adapter rejects the module: {said}; the CPU renders the same");
            Err(broken(kernel, explained(sentence, error)))
        })
    }

    /// The module as this device takes it.
    fn words(&self, kernel: &KernelDesc, constants: &[u32]) -> Result<Vec<u32>, Error> {
        let words = self.shaders.specialised(kernel, constants, self.flavour)?;
        // naga rejects the modes, and keeps no decoration that they would go with
        let dropped = if self.passthrough { self.dropped_modes.as_slice() } else { &FloatMode::ALL };
        spirv::strip_modes(&words, dropped)
            .ok_or_else(|| Error::Module { kernel: kernel.name.to_owned(), source: "it is no SPIR-V".into() })
    }
}

fn broken(kernel: &KernelDesc, cause: impl Into<Cause>) -> Error {
    Error::Kernel { kernel: kernel.name.to_owned(), source: cause.into() }
}

fn shader_module(device: &wgpu::Device, kernel: &KernelDesc, words: Vec<u32>, passthrough: bool) -> wgpu::ShaderModule {
    if !passthrough {
        return device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(kernel.name),
            source: wgpu::ShaderSource::SpirV(words.into()),
        });
    }
    let [x, y, z] = kernel.workgroup;
    let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
        label: Some(kernel.name),
        spirv: Some(Cow::Owned(words)),
        entry_points: Cow::Owned(vec![wgpu::PassthroughShaderEntryPoint {
            name: kernel.name.into(),
            workgroup_size: (x, y, z),
        }]),
        ..wgpu::ShaderModuleDescriptorPassthrough::default()
    };
    // SAFETY: the words are the committed module, whose hash was checked and which spirv-val accepted when it was
    // built; freezing a constant and dropping a mode keep it valid. Its bindings are those of the descriptor.
    unsafe { device.create_shader_module_passthrough(descriptor) }
}

fn bind_group_layout(device: &wgpu::Device, kernel: &KernelDesc) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(kernel.bindings)
        .map(|(binding, b)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: b.access != Access::Own },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(kernel.name), entries: &entries })
}
