//! Frames of a session whose rays the renderer traces.

use super::gpu::Gpu;
use super::{Begun, GpuSession, View};
use crate::exec::gpu::{allocate, bind_group, dispatch, guarded};
use crate::plan::{Buffer, Pass};
use crate::{Error, buffers::SceneBuffers};
use restir_kernels::{Binding, DeferredKernel, KernelDesc, Rays};
use restir_shared::geometry::PackedHit;
use restir_shared::scene::DeferredRay;

/// A round of rays, which whoever traces them resolves.
///
/// For each i below [`Self::count`] `rays` has a [`DeferredRay`] of 48 bytes. Where its `asks` is [`DeferredRay::CLOSEST`] or
/// [`DeferredRay::OCCLUDED`] the hit, a [`PackedHit`] of 16 bytes, goes to the element `plane * count + i` of `answers`; other rays need none.
/// A hit has the number of its triangle in the order of [`SceneBuffers::triangles`].
#[derive(Clone, Copy, Debug)]
pub struct RayRound<'a> {
    /// The scene of this frame and, for rays with `other_frame` set, that of the last one: the same where nothing has moved.
    pub scenes: [&'a SceneBuffers; 2],
    /// What is asked. It has the usages `STORAGE`, `COPY_SRC` and `COPY_DST`, as `answers` has.
    pub rays: &'a wgpu::Buffer,
    /// Where the answers go. Other planes hold what was answered in earlier rounds, and have to stay.
    pub answers: &'a wgpu::Buffer,
    /// Rays, of which any number may ask for nothing.
    pub count: u32,
    /// The number of the round in its pass, from 0: the `plane` of all of its rays.
    pub round: u32,
    /// The kernel whose rays these are.
    pub kernel: &'static str,
}

/// A pass in the form whose rays are traced elsewhere.
struct DeferredPass {
    pass: Pass,
    most_rays: u32,
}

impl DeferredPass {
    /// Of a pass that traces rays. `first` is the buffer of answers, which that of rays follows.
    fn of(pass: &Pass, kernel: &'static DeferredKernel, first: usize) -> Result<Self, Error> {
        let most_rays = (kernel.most_rays)(&pass.constants, &pass.params);
        let bound = |binding: &Binding| match *binding {
            DeferredKernel::ANSWERS => Ok(first),
            DeferredKernel::RAYS => Ok(first + 1),
            Binding { name, .. } => pass.bound(name),
        };
        let bindings = kernel.desc.bindings[1..].iter().map(bound).collect::<Result<_, _>>()?;
        Ok(Self { pass: Pass { kernel: &kernel.desc, bindings, frame: None, ..pass.clone() }, most_rays })
    }

    fn count(&self) -> u64 {
        self.pass.grid.iter().map(|&side| u64::from(side)).product()
    }
}

impl GpuSession {
    /// As [`Self::frame`], with rays that `trace` resolves: hardware, or a tree of the renderer's own. It is called for each round of rays, and
    /// records what traces them into the encoder. It may also submit what is recorded so far, and go on with another encoder in its place.
    ///
    /// The bits are those of [`Self::frame`] if the hits are. How many rounds there are is known beforehand, and nothing is read back:
    /// one sample of path tracing with n segments has 2 n - 1 rounds. An invocation is run again in each of them ([`restir_shared::scene::Deferred`]). The answers of
    /// a pass take 16 bytes an invocation and round, its rays 48 bytes an invocation. A scene with masks or blended surfaces leaves to `trace` which of their hits count.
    ///
    /// The device has to allow 10 storage buffers a stage (`max_storage_buffers_per_shader_stage`), and bindings as large as the answers. Pipelines are made by the
    /// first call.
    ///
    /// ```no_run
    /// use restir_host::session::{GpuSession, RayRound, View};
    ///
    /// # fn tracer(encoder: &mut wgpu::CommandEncoder, rays: &wgpu::Buffer, answers: &wgpu::Buffer, count: u32) {}
    /// # fn frame(session: &mut GpuSession, encoder: &mut wgpu::CommandEncoder) -> Result<(), restir_host::Error> {
    /// session.frame_deferred(encoder, &View::default(), &mut |encoder, round: &RayRound<'_>| {
    ///     tracer(encoder, round.rays, round.answers, round.count);
    /// })?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As of [`Self::frame`]; [`Error::Kernel`] if the technique has a kernel that traces rays itself: techniques other than `path`, `restir-di` and
    /// `restir-pt`, scenes in which light goes through media, and frames that are denoised; [`Error::Binding`] if the answers are larger than the device binds. An edit
    /// that makes such a scene, and answers that do not fit, are found when the frame has begun: the session should then be [reset](super::Session::reset).
    pub fn frame_deferred(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View<'_>,
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<Begun, Error> {
        if !self.device.is_deferrable {
            let kernels = super::kernels(&self.setup, &self.moments)?;
            self.device.prepare_deferred(kernels.iter().map(|(kernel, constants)| (*kernel, constants)))?;
            self.device.is_deferrable = true;
        }
        let (passes, begun) = self.passes(view, false)?;
        let passes = super::gpu::numbered(passes);
        let scenes = self.moments.scenes().map(|scene| &**scene);
        self.device.record_deferred(encoder, &passes, scenes, trace)?;
        Ok(begun)
    }
}

/// The kernel itself if it traces no rays, else its form whose rays are traced elsewhere.
fn form(kernel: &'static KernelDesc) -> Result<&'static KernelDesc, Error> {
    match kernel.rays {
        Rays::None => Ok(kernel),
        Rays::Deferrable(form) => Ok(&form.desc),
        _ => {
            let problem = "it traces its rays itself; choose path, restir-di or restir-pt, a scene without media, and no \
                           denoiser, or let the session trace rays";
            Err(Error::Kernel { kernel: kernel.name.to_owned(), source: problem.into() })
        }
    }
}

/// Whether the device binds as many buffers as the kernel has.
fn check_bindings(kernel: &KernelDesc, device: &wgpu::Device) -> Result<(), Error> {
    let (buffers, most) = (kernel.bindings.len(), device.limits().max_storage_buffers_per_shader_stage);
    if buffers <= most as usize {
        return Ok(());
    }
    let problem = format!(
        "it has {buffers} storage buffers, and the device allows {most}; ask for more by \
         max_storage_buffers_per_shader_stage"
    );
    Err(Error::Kernel { kernel: kernel.name.to_owned(), source: problem.into() })
}

impl Gpu {
    /// Compiles the forms of kernels that frames will have.
    fn prepare_deferred<'a>(
        &mut self,
        kernels: impl Iterator<Item = (&'static KernelDesc, &'a Vec<u32>)>,
    ) -> Result<(), Error> {
        let forms = kernels.map(|(kernel, constants)| Ok((form(kernel)?, constants.clone())));
        let forms: Vec<_> = forms.collect::<Result<_, Error>>()?;
        forms.iter().try_for_each(|(form, _)| check_bindings(form, &self.device))?;
        let device = self.device.clone();
        guarded(&device, || self.pipelines.prepare(&forms, &mut |_, _| {}))
    }

    fn record_deferred(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &[(Pass, usize)],
        scenes: [&SceneBuffers; 2],
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<(), Error> {
        self.prepare_deferred(passes.iter().map(|(pass, _)| (pass.kernel, &pass.constants)))?;
        let first = self.buffers.len();
        let of = |pass: &Pass| pass.kernel.rays.deferred().map(|form| DeferredPass::of(pass, form, first)).transpose();
        let forms: Vec<Option<DeferredPass>> = passes.iter().map(|(pass, _)| of(pass)).collect::<Result<_, _>>()?;
        let device = self.device.clone();
        let buffers = self.with_rays(&forms)?;
        guarded(&device, || {
            self.upload(encoder, passes);
            Ok(())
        })?;
        for (form, pass) in forms.iter().zip(passes) {
            match form {
                Some(form) => self.rounds(encoder, form, pass, &buffers, scenes, trace)?,
                None => guarded(&device, || self.dispatch(encoder, std::slice::from_ref(pass)))?,
            }
        }
        self.last.clear();
        Ok(())
    }

    /// The session's buffers, then one of answers and one of rays that are large enough for all of the passes.
    fn with_rays(&mut self, forms: &[Option<DeferredPass>]) -> Result<Vec<wgpu::Buffer>, Error> {
        let words = |elements: u64, bytes: usize| elements as usize * bytes / 4;
        let rays = forms.iter().flatten().map(DeferredPass::count).max().unwrap_or(1);
        let answers =
            forms.iter().flatten().map(|form| form.count() * u64::from(form.most_rays.max(1))).max().unwrap_or(1);
        let wanted = [
            Buffer { name: "answers", words: words(answers, size_of::<PackedHit>()), contents: None },
            Buffer { name: "rays", words: words(rays, size_of::<DeferredRay>()), contents: None },
        ];
        let fits = |(buffer, wanted): (&wgpu::Buffer, &Buffer)| buffer.size() >= wanted.words as u64 * 4;
        if self.rays.is_empty() || !self.rays.iter().zip(&wanted).all(fits) {
            self.rays = allocate(&self.device, &wanted)?;
        }
        Ok(self.buffers.iter().chain(&self.rays).cloned().collect())
    }

    /// What the renderer records is not guarded: its errors are its own.
    fn rounds(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        form: &DeferredPass,
        (of, before): &(Pass, usize),
        buffers: &[wgpu::Buffer],
        scenes: [&SceneBuffers; 2],
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<(), Error> {
        let device = self.device.clone();
        let pipeline = self.pipelines.get(form.pass.kernel, &form.pass.constants)?;
        let params = self.params(of.kernel, *before);
        let group = guarded(&device, || Ok(bind_group(&device, &form.pass, &pipeline, &params, buffers)))?;
        let [answers, rays] = [&self.rays[0], &self.rays[1]];
        encoder.clear_buffer(rays, 0, None);
        for round in 0..=form.most_rays {
            guarded(&device, || {
                let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                dispatch(&mut compute, &form.pass, &pipeline, &group);
                Ok(())
            })?;
            // after the last round all rays are known
            if round < form.most_rays {
                let (count, kernel) = (form.count() as u32, form.pass.kernel.name);
                trace(encoder, &RayRound { scenes, rays, answers, count, round, kernel });
            }
        }
        Ok(())
    }
}
