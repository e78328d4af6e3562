//! Sessions on the device of a renderer.

use super::{ATTRIBUTES, Begun, Device, Frozen, Session, Setup, View};
use crate::exec::Dispatches;
use crate::exec::gpu::{Pipelines, allocate, bind_group, dispatch, guarded};
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::{Error, buffers::SceneBuffers};
use restir_kernels::KernelDesc;
use std::collections::HashMap;
use std::sync::Arc;
use wgpu::util::DeviceExt;

/// Most groups of bindings that are kept: there are as many as planes change roles.
const MOST_GROUPS: usize = 4096;

/// A session on a renderer's own `wgpu::Device`. Frames are recorded into the renderer's encoders; nothing is submitted, and nothing is
/// waited for. Frames have to be submitted in the order in which they were recorded, any number of them at once; after one that was
/// recorded and is not submitted the session has to be [reset](Session::reset).
pub type GpuSession = Session<Gpu>;

/// A device of wgpu as that of a session.
#[derive(Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) pipelines: Pipelines,
    pub(super) buffers: Vec<wgpu::Buffer>,
    /// Of frames whose rays the renderer traces: their answers, and the rays.
    pub(super) rays: Vec<wgpu::Buffer>,
    /// The kernels of such frames are known to have a form for it, and are compiled.
    pub(super) is_deferrable: bool,
    /// The parameters of each pass of a frame, by kernel and how often it came before.
    params: HashMap<(&'static str, usize), wgpu::Buffer>,
    groups: HashMap<Bound, wgpu::BindGroup>,
    /// The passes of the last frame, without what it uploaded, each with the number of those of its kernel that come before it.
    pub(super) last: Vec<(Pass, usize)>,
}

/// A kernel with its constants, how often it came before in the frame, and its buffers.
type Bound = (&'static str, Vec<u32>, usize, Vec<BufferId>);

impl Device for Gpu {
    const DISPATCHES: Dispatches = Dispatches::Short;

    fn allocate(&mut self, buffers: &[Buffer], keep_arenas: bool, _scene: &Arc<SceneBuffers>) -> Result<(), Error> {
        let kept = if keep_arenas { ARENAS.len() } else { 0 };
        let made = guarded(&self.device, || allocate(&self.device, &buffers[kept..]))?;
        self.groups.clear();
        self.rays.clear();
        self.is_deferrable = false;
        self.buffers.truncate(kept);
        self.buffers.extend(made);
        Ok(())
    }

    fn prepare(&mut self, kernels: &[Frozen]) -> Result<(), Error> {
        self.pipelines.prepare(kernels, &mut |_, _| {})
    }
}

impl Gpu {
    /// Where the parameters of a pass are.
    pub(super) fn params(&mut self, kernel: &KernelDesc, before: usize) -> wgpu::Buffer {
        let device = &self.device;
        let make = || {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(kernel.name),
                size: u64::from(kernel.bindings[0].stride),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        self.params.entry((kernel.name, before)).or_insert_with(make).clone()
    }

    fn group(&mut self, pass: &Pass, before: usize, pipeline: &wgpu::ComputePipeline) -> wgpu::BindGroup {
        let bound = (pass.kernel.name, pass.constants.clone(), before, pass.bindings.clone());
        if let Some(group) = self.groups.get(&bound) {
            return group.clone();
        }
        if self.groups.len() == MOST_GROUPS {
            self.groups.clear();
        }
        let params = self.params(pass.kernel, before);
        let group = bind_group(&self.device, pass, pipeline, &params, &self.buffers);
        self.groups.insert(bound, group.clone());
        group
    }

    /// Copies what the frame needs, out of a buffer that lives until the device has done so: writes by the queue would come before all
    /// of a submission, and overtake frames that were recorded earlier.
    pub(super) fn upload(&mut self, encoder: &mut wgpu::CommandEncoder, passes: &[(Pass, usize)]) {
        let mut words: Vec<u32> = Vec::new();
        let mut copies = Vec::new();
        for upload in passes.iter().filter_map(|(pass, _)| pass.frame.as_ref()).flat_map(|frame| &frame.uploads) {
            copies.push((words.len(), self.buffers[upload.buffer].clone(), upload.first, upload.words.len()));
            words.extend_from_slice(&upload.words);
        }
        for (pass, before) in passes {
            copies.push((words.len(), self.params(pass.kernel, *before), 0, pass.params.len()));
            words.extend_from_slice(&pass.params);
        }
        let staging = self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frame"),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::COPY_SRC,
        });
        let bytes = |words: usize| words as u64 * 4;
        for (from, buffer, first, words) in copies {
            encoder.copy_buffer_to_buffer(&staging, bytes(from), &buffer, bytes(first), bytes(words));
        }
    }

    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, passes: Vec<(Pass, usize)>) -> Result<(), Error> {
        let wanted: Vec<_> = passes.iter().map(|(pass, _)| (pass.kernel, pass.constants.clone())).collect();
        self.pipelines.prepare(&wanted, &mut |_, _| {})?;
        self.upload(encoder, &passes);
        self.dispatch(encoder, &passes)?;
        self.last = passes.into_iter().map(|(pass, before)| (Pass { frame: None, ..pass }, before)).collect();
        Ok(())
    }

    pub(super) fn dispatch(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &[(Pass, usize)],
    ) -> Result<(), Error> {
        let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for (pass, before) in passes {
            let pipeline = self.pipelines.get(pass.kernel, &pass.constants)?;
            dispatch(&mut compute, pass, &pipeline, &self.group(pass, *before, &pipeline));
        }
        Ok(())
    }
}

/// Each pass with the number of those of its kernel that come before it.
pub(super) fn numbered(passes: Vec<Pass>) -> Vec<(Pass, usize)> {
    let mut counts: HashMap<&'static str, usize> = HashMap::new();
    let number = |pass: Pass| {
        let count = counts.entry(pass.kernel.name).or_default();
        *count += 1;
        (pass, *count - 1)
    };
    passes.into_iter().map(number).collect()
}

/// A part of a buffer where the surfaces of a frame go.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePlane<'a> {
    /// A buffer with the usages `STORAGE`, `COPY_SRC` and `COPY_DST`, which holds the scene, too.
    pub buffer: &'a wgpu::Buffer,
    /// The first byte of the plane: a multiple of 16, and perhaps of nothing more, so that a shader binds the whole buffer.
    pub offset: u64,
    /// Bytes of the plane.
    pub size: u64,
    /// The number of the first pixel's surface.
    pub first_id: u32,
}

impl GpuSession {
    /// A session on `device`, with the pipelines of [`Pipelines::new`] for the same device; they are made here, which takes seconds
    /// where the driver has not kept them.
    ///
    /// # Errors
    /// [`Error::InvalidValue`] and [`Error::ConflictingSettings`] for settings out of range; [`Error::Binding`] if a plane is larger than the device binds, [`Error::AdapterMemory`] if there is no memory
    /// for it; [`Error::Kernel`] and [`Error::Adapter`] as of [`Pipelines::get`].
    pub fn new(device: &wgpu::Device, pipelines: Pipelines, setup: Setup) -> Result<Self, Error> {
        if setup.scene.is_foreign() {
            return Err(Error::ForeignScene { problem: "kernels of a device need a scene in arenas; build one" });
        }
        let gpu = Gpu {
            device: device.clone(),
            pipelines,
            buffers: Vec::new(),
            rays: Vec::new(),
            is_deferrable: false,
            params: HashMap::new(),
            groups: HashMap::new(),
            last: Vec::new(),
        };
        Self::over(setup, gpu)
    }

    /// Records the next frame into `encoder`.
    ///
    /// # Errors
    /// [`Error::Camera`] for a camera and [`Error::InvalidValue`] for a frame that is not finite, [`Error::Scene`] if an edited scene is broken; the session is then as it was, and nothing was recorded. [`Error::Memory`],
    /// [`Error::Kernel`] and [`Error::Adapter`] as of [`Self::new`]; the session should then be [reset](Session::reset).
    pub fn frame(&mut self, encoder: &mut wgpu::CommandEncoder, view: &View<'_>) -> Result<Begun, Error> {
        let (passes, begun) = self.passes(view, false)?;
        let passes = numbered(passes);
        let device = self.device.device.clone();
        guarded(&device, || self.device.record(encoder, passes))?;
        Ok(begun)
    }

    /// Records the kernels of the last frame once more, by themselves: what a measurement compares with a frame that uploads as well. They reuse what
    /// they have written, which makes no picture; [reset](Session::reset) the session before one counts again.
    ///
    /// # Errors
    /// As of [`Self::frame`].
    #[doc(hidden)]
    pub fn repeat_kernels(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), Error> {
        let (device, last) = (self.device.device.clone(), std::mem::take(&mut self.device.last));
        guarded(&device, || self.device.dispatch(encoder, &last))?;
        self.device.last = last;
        Ok(())
    }

    /// The buffer of the image after the frames that were recorded: for each pixel, rows from top to bottom, three `f32` of linear RGB
    /// radiance, and one that counts samples that were not finite. It can be bound as a storage buffer, and be copied from. Another
    /// size, technique or scene makes another buffer.
    pub fn output(&self) -> &wgpu::Buffer {
        &self.device.buffers[self.sequence.output()]
    }

    /// Records a copy of the image into a texture of its size, with the format `Rgba32Float` and the usage `COPY_DST`; alpha is then
    /// the count of samples that were not finite. Of this texture the renderer makes the views that it wants. A copy on a device converts
    /// nothing: for another format, such as `Rgba16Float`, the renderer's own shader reads [`Self::output`], which it has to tonemap anyway.
    ///
    /// # Errors
    /// [`Error::Texture`] if the texture is of another size or format.
    pub fn copy_to_texture(&self, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) -> Result<(), Error> {
        const TEXEL: u32 = 16;
        let [width, height] = self.setup().size;
        let format = wgpu::TextureFormat::Rgba32Float;
        if (texture.width(), texture.height(), texture.format()) != (width, height, format) {
            let described = |width: u32, height: u32, format| format!("{width} x {height} of {format:?}");
            return Err(Error::Texture {
                image: described(width, height, format),
                texture: described(texture.width(), texture.height(), texture.format()),
            });
        }
        // rows of a copy are aligned, those of the image follow each other
        let rows = if (width * TEXEL).is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT) { height } else { 1 };
        for y in (0..height).step_by(rows as usize) {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: u64::from(y) * u64::from(width * TEXEL),
                bytes_per_row: (rows > 1).then_some(width * TEXEL),
                rows_per_image: None,
            };
            let source = wgpu::TexelCopyBufferInfo { buffer: self.output(), layout };
            let mut target = texture.as_image_copy();
            target.origin.y = y;
            let size = wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 };
            encoder.copy_buffer_to_texture(source, target, size);
        }
        Ok(())
    }

    /// The buffer of what the camera sees in the next frame, 16 bytes a pixel
    /// ([`restir_shared::geometry::PackedHit`]), for a renderer that knows it: who fills it gives
    /// [`View::primary_given`]. None, if the technique has no such plane.
    pub fn primary(&self) -> Option<&wgpu::Buffer> {
        self.primary_plane().map(|plane| &self.device.buffers[plane])
    }

    /// Where the renderer writes the surfaces of the next frame, of a session whose [surfaces are given](Setup::surfaces_given): a
    /// [`restir_shared::scene::GivenSurface`] of 128 bytes a pixel, rows from top to bottom. The hit of pixel i in [`Self::primary`] has the number
    /// `first_id + i`, or that of a miss.
    pub fn surfaces(&self) -> Option<SurfacePlane<'_>> {
        let (first, words, first_id) = self.surface_plane()?;
        let [offset, size] = [first, words].map(|words| words as u64 * 4);
        Some(SurfacePlane { buffer: &self.device.buffers[ATTRIBUTES], offset, size, first_id })
    }

    /// Bytes of the device's memory that the session holds between frames.
    #[doc(hidden)]
    pub fn bytes(&self) -> u64 {
        self.device
            .buffers
            .iter()
            .chain(&self.device.rays)
            .chain(self.device.params.values())
            .map(wgpu::Buffer::size)
            .sum()
    }
}
