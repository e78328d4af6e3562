//! The wgpu executor. It takes an existing device and queue, or opens an adapter of its own.
//!
//! ```no_run
//! use restir_host::exec::{CpuExecutor, Flavour, GpuExecutor};
//! use restir_host::render::Render;
//! use restir_host::technique::path::PathSettings;
//! use restir_host::{Error, Shaders, buffers::SceneBuffers, scene::Scene};
//!
//! // the first hardware adapter, whose bits are compared with the host's before it renders
//! let mut gpu = GpuExecutor::open()?;
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render::new([64, 64], PathSettings::default());
//! let on_device = job.render(&scene, &mut gpu)?;
//! let native = job.render(&scene, &mut CpuExecutor::new()?)?;
//! assert_eq!(on_device.image, native.image);
//! # Ok::<(), Error>(())
//! ```

mod adapter;
mod cache;
mod float_modes;
mod pipeline;
mod timed;

pub(crate) use adapter::open as open_adapter;
pub use adapter::{AdapterInfo, adapters, requirements};
pub use pipeline::{Pipelines, takes_passthrough};
#[doc(hidden)]
pub use timed::{Span, Timeline};

use super::{Description, Executor, Flavour, Observer, Parity, Progress, Step};
use crate::error::{AdapterError, explained};
use crate::plan::{Buffer, BufferId, FramePlan, Pass, Upload};
use crate::{Error, Shaders};
use std::{fmt, path::Path};
use wgpu::util::DeviceExt;

/// How many passes are looked at before the first is run, to make the pipelines that they need side by side. Those that
/// are new later are made when their turn comes.
const LOOK_AHEAD: usize = 64;

/// Runs compiled kernels on a GPU.
pub struct GpuExecutor {
    device: wgpu::Device,
    queue: wgpu::Queue,
    flavour: Flavour,
    pipelines: Pipelines,
    observe_pipelines: Box<dyn FnMut(usize, usize) + Send>,
    /// The result of the self-check, once it was made.
    pub(crate) parity: Option<Parity>,
}

impl fmt::Debug for GpuExecutor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("GpuExecutor").field("description", &self.describe()).finish_non_exhaustive()
    }
}

impl GpuExecutor {
    /// An executor on the embedder's device. Kernels need no more than the default limits; the `exact` flavour needs
    /// [`takes_passthrough`]. [`Self::check`] tells whether the device keeps its promise.
    pub fn with_device(device: wgpu::Device, queue: wgpu::Queue, flavour: Flavour, shaders: Shaders) -> Self {
        let pipelines = Pipelines::new(&device, flavour, shaders);
        Self { device, queue, flavour, pipelines, observe_pipelines: Box::new(|_, _| {}), parity: None }
    }

    /// Keeps compiled pipelines in a file of `folder` ([`Pipelines::kept_in`]).
    #[must_use]
    pub fn keep_pipelines_in(mut self, folder: &Path) -> Self {
        self.pipelines = self.pipelines.kept_in(folder);
        self
    }

    /// Pipelines take seconds, and a run begins with them: `observe` is told how many are done, and of how many.
    #[must_use]
    pub fn observe_pipelines(mut self, observe: impl FnMut(usize, usize) + Send + 'static) -> Self {
        self.observe_pipelines = Box::new(observe);
        self
    }

    /// The same device with other kernels; no self-check was made.
    #[doc(hidden)]
    #[must_use]
    pub fn reload(&self, flavour: Flavour, shaders: Shaders) -> Self {
        Self::with_device(self.device.clone(), self.queue.clone(), flavour, shaders)
    }

    /// Loads `exact` through naga from now on, which drops the decorations that make it exact. A control for tests: the
    /// results are wrong on devices that contract or reassociate.
    #[doc(hidden)]
    #[must_use]
    pub fn without_passthrough(mut self) -> Self {
        self.pipelines.disable_passthrough();
        self
    }

    /// The device, for an embedder's own work beside the kernels'.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The queue of the device.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// How modules are loaded and which float-control modes were dropped.
    #[doc(hidden)]
    pub fn loading(&self) -> String {
        self.pipelines.loading()
    }

    /// What a pass is bound to, with parameters of its own.
    fn group(&self, pass: &Pass, pipeline: &wgpu::ComputePipeline, buffers: &[wgpu::Buffer]) -> wgpu::BindGroup {
        let params = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("params"),
            contents: bytemuck::cast_slice(&pass.params),
            usage: wgpu::BufferUsages::STORAGE,
        });
        bind_group(&self.device, pass, pipeline, &params, buffers)
    }

    /// Writes what differs in the frame that begins with a pass, before what is submitted next.
    fn upload(&self, pass: &Pass, buffers: &[wgpu::Buffer]) {
        for Upload { buffer, first, words } in pass.frame.iter().flat_map(|frame| &frame.uploads) {
            self.queue.write_buffer(&buffers[*buffer], *first as u64 * 4, bytemuck::cast_slice(words));
        }
    }

    fn submit(&self, pass: &Pass, pipeline: &wgpu::ComputePipeline, buffers: &[wgpu::Buffer]) -> Result<(), Error> {
        let group = self.group(pass, pipeline, buffers);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        dispatch(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()), pass, pipeline, &group);
        self.queue.submit([encoder.finish()]);
        self.wait()
    }

    fn wait(&self) -> Result<(), Error> {
        let polled = self.device.poll(wgpu::PollType::wait_indefinitely());
        polled.map(drop).map_err(|e| AdapterError::Lost(e.into()).into())
    }

    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u32>, Error> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let view =
            staging.get_mapped_range(..).map_err(|e| AdapterError::Lost(format!("no result to read, {e:?}").into()))?;
        Ok(bytemuck::pod_collect_to_vec(&view[..]))
    }
}

/// The parameters and the buffers of a pass, as its pipeline takes them.
pub(crate) fn bind_group(
    device: &wgpu::Device,
    pass: &Pass,
    pipeline: &wgpu::ComputePipeline,
    params: &wgpu::Buffer,
    buffers: &[wgpu::Buffer],
) -> wgpu::BindGroup {
    let bound = std::iter::once(params).chain(pass.bindings.iter().map(|&id| &buffers[id]));
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
        .zip(bound)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(pass.kernel.name),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}

/// Records a pass.
pub(crate) fn dispatch(
    compute: &mut wgpu::ComputePass<'_>,
    pass: &Pass,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
) {
    compute.set_pipeline(pipeline);
    compute.set_bind_group(0, group, &[]);
    let [x, y, z] = pass.workgroups();
    compute.dispatch_workgroups(x, y, z);
}

/// Makes buffers.
pub(crate) fn allocate(device: &wgpu::Device, buffers: &[Buffer]) -> Result<Vec<wgpu::Buffer>, Error> {
    let limits = device.limits();
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let largest = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let create = |buffer: &Buffer| {
        let size = buffer.words as u64 * 4;
        let label = Some(buffer.name);
        match &buffer.contents {
            Some(_) => {
                let words = buffer.initial();
                let contents = bytemuck::cast_slice(&words);
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
            }
            None => device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false }),
        }
    };
    if let Some(Buffer { name, words, .. }) = buffers.iter().find(|buffer| buffer.words as u64 * 4 > largest) {
        return Err(Error::Binding { buffer: name, bytes: *words as u64 * 4, limit: largest });
    }
    guarded(device, || Ok(buffers.iter().map(create).collect()))
}

/// Turns what the device reports during `work` into errors; uncaught, it would be a panic.
pub(crate) fn guarded<T>(device: &wgpu::Device, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let result = work();
    let invalid = pollster::block_on(validation.pop());
    if let Some(error) = pollster::block_on(memory.pop()) {
        return Err(Error::AdapterMemory(explained(one_line(&error), error)));
    }
    invalid.map_or(result, |error| Err(AdapterError::Refused(explained(one_line(&error), error)).into()))
}

/// The first passes of a plan; of a scene that moves none beyond the second frame's first, because frames are large.
fn look_ahead(passes: &mut dyn Iterator<Item = Result<Pass, Error>>) -> Vec<Result<Pass, Error>> {
    let mut ahead = Vec::new();
    for pass in passes.take(LOOK_AHEAD) {
        let is_next_frame = !ahead.is_empty() && pass.as_ref().is_ok_and(|pass| pass.frame.is_some());
        ahead.push(pass);
        if is_next_frame {
            break;
        }
    }
    ahead
}

/// An error's text without line breaks.
fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Executor for GpuExecutor {
    fn describe(&self) -> Description {
        let info = self.device.adapter_info();
        let driver = format!("{} {}", info.driver, info.driver_info);
        Description {
            executor: "gpu",
            adapter: Some(format!("{} ({}, {})", info.name, info.backend, driver.trim())),
            flavour: self.flavour,
            parity: self.parity,
        }
    }

    fn run_observed(&mut self, plan: FramePlan<'_>, observe: &mut Observer<'_>) -> Result<Vec<Vec<u32>>, Error> {
        let buffers = allocate(&self.device, &plan.buffers)?;
        let mut passes = plan.passes;
        let ahead = look_ahead(&mut passes);
        let wanted: Vec<_> = ahead.iter().flatten().map(|pass| (pass.kernel, pass.constants.clone())).collect();
        self.pipelines.prepare(&wanted, &mut *self.observe_pipelines)?;
        for (done, pass) in (1..).zip(ahead.into_iter().chain(passes)) {
            let pass = pass?;
            pass.check(&plan.buffers)?;
            let pipeline = self.pipelines.get(pass.kernel, &pass.constants)?;
            guarded(&self.device, || {
                self.upload(&pass, &buffers);
                self.submit(&pass, &pipeline, &buffers)
            })?;
            let read = |id: BufferId| guarded(&self.device, || self.read(&buffers[id]));
            observe(&Step::new(Progress { done, total: plan.pass_count }, &pass, &read))?;
        }
        plan.outputs.iter().map(|&id| guarded(&self.device, || self.read(&buffers[id]))).collect()
    }
}
