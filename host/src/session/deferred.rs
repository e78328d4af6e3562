//! Frames of a session whose rays the renderer traces.

use super::gpu::Gpu;
use super::{Begun, GpuSession, View};
use crate::Error;
use crate::exec::gpu::{allocate, bind_group, dispatch, guarded};
use crate::plan::{Buffer, Pass};
use restir_kernels::{Binding, DeferredKernel, KernelDesc, Rays};
use restir_shared::geometry::PackedHit;
use restir_shared::scene::DeferredRay;

/// A round of rays, which whoever traces them resolves.
///
/// For each i below [`Self::count`] `rays` has a [`DeferredRay`] of 48 bytes. Where its `asks` is [`DeferredRay::CLOSEST`] or
/// [`DeferredRay::OCCLUDED`] the hit, a [`PackedHit`] of 16 bytes, goes to the element `plane * count + i` of `answers`; other rays need none.
/// A hit has the number of its triangle in the order of [`SceneBuffers::triangles`](crate::buffers::SceneBuffers::triangles). Of a
/// ray with `other_frame` set the hit is that in the scene of the last frame.
#[derive(Clone, Copy, Debug)]
pub struct RayRound<'a> {
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
    /// path tracing with n segments has 2 n - 1 rounds. An invocation is run again in each of them ([`restir_shared::scene::Deferred`]). The answers of
    /// a pass take 16 bytes a pixel and round. A scene with masks or blended surfaces leaves to `trace` which of their hits count.
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
    /// `restir-pt`, scenes in which light goes through media, and frames that are denoised.
    pub fn frame_deferred(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View<'_>,
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<Begun, Error> {
        for (kernel, _) in super::kernels(&self.setup, &self.moments)? {
            check(kernel, &self.device.device)?;
        }
        let (passes, begun) = self.passes(view, false)?;
        let passes = super::gpu::numbered(passes);
        let device = self.device.device.clone();
        guarded(&device, || self.device.record_deferred(encoder, &passes, trace))?;
        Ok(begun)
    }
}

/// Whether the kernel traces no rays, or has a form whose rays are traced elsewhere and which fits the device.
fn check(kernel: &KernelDesc, device: &wgpu::Device) -> Result<(), Error> {
    let refuse = |problem: String| Err(Error::Kernel { kernel: kernel.name.to_owned(), source: problem.into() });
    let most = device.limits().max_storage_buffers_per_shader_stage;
    match kernel.rays {
        Rays::None => Ok(()),
        Rays::Deferrable(form) if form.desc.bindings.len() > most as usize => refuse(format!(
            "its form whose rays are traced elsewhere has {} storage buffers, and the device allows {most}; ask for more by \
             max_storage_buffers_per_shader_stage",
            form.desc.bindings.len()
        )),
        Rays::Deferrable(_) => Ok(()),
        _ => refuse(
            "it traces its rays itself; choose path, restir-di or restir-pt, a scene without media, and no denoiser, or let the \
             session trace rays"
                .to_owned(),
        ),
    }
}

impl Gpu {
    fn record_deferred(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &[(Pass, usize)],
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<(), Error> {
        let first = self.buffers.len();
        let form =
            |pass: &Pass| pass.kernel.rays.deferred().map(|form| DeferredPass::of(pass, form, first)).transpose();
        let forms: Vec<Option<DeferredPass>> = passes.iter().map(|(pass, _)| form(pass)).collect::<Result<_, _>>()?;
        let run = |(pass, form): (&(Pass, usize), &Option<DeferredPass>)| {
            form.as_ref().map_or(pass.0.kernel, |form| form.pass.kernel)
        };
        let kernels = passes.iter().zip(&forms).map(|pass| (run(pass), pass.0.0.constants.clone()));
        self.pipelines.prepare(&kernels.collect::<Vec<_>>(), &mut |_, _| {})?;
        self.upload(encoder, passes);
        let buffers = self.with_rays(&forms)?;
        for (form, pass) in forms.iter().zip(passes) {
            match form {
                Some(form) => self.rounds(encoder, form, pass, &buffers, trace)?,
                None => self.dispatch(encoder, std::slice::from_ref(pass))?,
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

    fn rounds(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        form: &DeferredPass,
        (of, before): &(Pass, usize),
        buffers: &[wgpu::Buffer],
        trace: &mut dyn FnMut(&mut wgpu::CommandEncoder, &RayRound<'_>),
    ) -> Result<(), Error> {
        let pipeline = self.pipelines.get(form.pass.kernel, &form.pass.constants)?;
        let params = self.params(of.kernel, *before);
        let group = bind_group(&self.device, &form.pass, &pipeline, &params, buffers);
        let [answers, rays] = [&self.rays[0], &self.rays[1]];
        let run = |encoder: &mut wgpu::CommandEncoder| {
            let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            dispatch(&mut compute, &form.pass, &pipeline, &group);
        };
        encoder.clear_buffer(rays, 0, None);
        for round in 0..form.most_rays {
            run(encoder);
            trace(
                encoder,
                &RayRound { rays, answers, count: form.count() as u32, round, kernel: form.pass.kernel.name },
            );
        }
        run(encoder);
        Ok(())
    }
}
