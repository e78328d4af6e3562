//! Parity cases of kernels whose rays are traced elsewhere: of captured passes, whose rays are traced here.

use crate::capture::Capture;
use crate::parity::run;
use restir_host::Error;
use restir_host::exec::CpuExecutor;
use restir_kernels::{Access, Case, DeferredKernel};
use restir_shared::geometry::{Hit, PackedHit};
use restir_shared::glam::{UVec4, Vec2};
use restir_shared::layout::{Field, Kind, SceneHeader};
use restir_shared::scene::{DeferredRay, SceneView, Trace};
use std::sync::Arc;

/// Of a captured pass: invocations that have all of their answers, and invocations that have half of them.
///
/// # Errors
/// As of the executor; [`Error::Kernel`] if an invocation asks for more rays than the kernel says, or if what it makes of all answers is
/// not what the pass makes, whose rays are traced inside.
pub fn cases(name: &str, capture: &Capture, form: &'static DeferredKernel) -> Result<Vec<Case>, Error> {
    let begun = Resolved::new(capture, form)?;
    let all = begun.case(format!("{name}, all answers"), |asked| asked);
    let half = begun.case(format!("{name}, half of the answers"), |asked| asked / 2);
    Ok(vec![all, half])
}

/// A pass whose rays are all resolved.
struct Resolved {
    /// With all answers, and what the pass finds.
    case: Case,
    /// How many rays each invocation asked for.
    asked: Vec<u32>,
    /// The places of the rays among the buffers.
    rays: usize,
}

impl Resolved {
    fn new(capture: &Capture, form: &'static DeferredKernel) -> Result<Self, Error> {
        let pass = &capture.pass;
        let count = pass.grid[0] as usize * pass.grid[1] as usize;
        let most = (form.most_rays)(&pass.constants, &pass.params) as usize;
        let contents = |name: &str| {
            let found = pass.bindings().zip(&capture.contents).find(|((binding, _), _)| binding.name == name);
            found.map(|(_, words)| words.clone())
        };
        let buffers = form.desc.bindings.iter().map(|binding| match *binding {
            DeferredKernel::ANSWERS => Some(vec![0; count * most.max(1) * 4].into()),
            DeferredKernel::RAYS => Some(vec![0; count * size_of::<DeferredRay>() / 4].into()),
            _ if binding.access == Access::Params => Some(pass.params.clone().into()),
            _ => contents(binding.name),
        });
        let case = Case {
            kernel: &form.desc,
            name: String::new(),
            grid: pass.grid,
            constants: pass.constants.clone(),
            buffers: buffers.collect(),
        };
        let place = |wanted| form.desc.bindings.iter().position(|binding| *binding == wanted);
        let (Some(answers), Some(rays)) = (place(DeferredKernel::ANSWERS), place(DeferredKernel::RAYS)) else {
            return Err(wrong(form, "it has no place for answers or rays".to_owned()));
        };
        let mut resolved = Self { case, asked: vec![0; count], rays };
        let begun = resolved.case.clone();
        for round in 0..=most {
            let left = resolved.run()?;
            if left.iter().all(DeferredRay::is_finished) {
                break;
            }
            if round == most {
                return Err(wrong(
                    form,
                    format!("an invocation asks for more than {most} rays, which it says are the most"),
                ));
            }
            resolved.resolve(capture, answers, &left)?;
        }
        let written = pass.bindings().filter(|(binding, _)| binding.access == Access::Own);
        let right = run(&mut CpuExecutor::inline(), &of_pass(capture))?;
        for ((binding, _), right) in written.zip(right) {
            let at = form.desc.bindings.iter().position(|of| of.name == binding.name);
            let made = at.and_then(|at| resolved.case.buffers[at].clone());
            if made.is_none_or(|made| *made != *right) {
                return Err(wrong(
                    form,
                    format!("it makes other {} than the form that traces its rays itself", binding.name),
                ));
            }
        }
        // what it begins with, but for the answers
        let answered = resolved.case.buffers[answers].clone();
        resolved.case.buffers = begun.buffers;
        resolved.case.buffers[answers] = answered;
        Ok(resolved)
    }

    /// Runs a round; the rays that it leaves.
    fn run(&mut self) -> Result<Vec<DeferredRay>, Error> {
        let made = run(&mut CpuExecutor::inline(), &self.case)?;
        let bindings = self.case.kernel.bindings.iter().enumerate();
        let own = bindings.filter(|(_, binding)| binding.access == Access::Own).map(|(at, _)| at);
        for (at, words) in own.zip(made) {
            self.case.buffers[at] = Some(words.into());
        }
        Ok(bytemuck::pod_collect_to_vec(self.case.buffers[self.rays].as_deref().unwrap_or_default()))
    }

    /// Traces the rays of a round.
    fn resolve(&mut self, capture: &Capture, answers: usize, rays: &[DeferredRay]) -> Result<(), Error> {
        let scenes = [scene(capture, "scene")?, scene(capture, "other_scene").or_else(|_| scene(capture, "scene"))?];
        let mut words = self.case.buffers[answers].as_deref().unwrap_or_default().to_vec();
        let planes: &mut [PackedHit] = bytemuck::cast_slice_mut(&mut words);
        for (index, ray) in rays.iter().enumerate().filter(|(_, ray)| !ray.is_finished()) {
            let scene = &scenes[ray.other_frame as usize];
            let hit = match ray.asks {
                DeferredRay::CLOSEST => scene.closest(&ray.ray()),
                // of such an answer nothing but that there is one may count
                _ if scene.occluded(&ray.ray()) => Hit { t: f32::NAN, id: 0, uv: Vec2::NAN },
                _ => Hit::MISS,
            };
            planes[ray.plane as usize * rays.len() + index] = PackedHit::pack(&hit);
            self.asked[index] = ray.known();
        }
        self.case.buffers[answers] = Some(words.into());
        Ok(())
    }

    /// The case where each invocation knows as many answers as `known` says of those that it asks for.
    fn case(&self, name: String, known: impl Fn(u32) -> u32) -> Case {
        let ray = |&asked: &u32| match known(asked) {
            0 => DeferredRay::default(),
            known => DeferredRay { asks: DeferredRay::CLOSEST, plane: known - 1, ..DeferredRay::default() },
        };
        let rays: Vec<DeferredRay> = self.asked.iter().map(ray).collect();
        let mut case = Case { name, ..self.case.clone() };
        case.buffers[self.rays] = Some(bytemuck::cast_slice(&rays).into());
        case
    }
}

/// The pass with what it finds.
fn of_pass(capture: &Capture) -> Case {
    let pass = &capture.pass;
    let params = Arc::from(pass.params.clone());
    Case {
        kernel: pass.kernel,
        name: String::new(),
        grid: pass.grid,
        constants: pass.constants.clone(),
        buffers: std::iter::once(params).chain(capture.contents.iter().cloned()).map(Some).collect(),
    }
}

/// The scene whose header is that field of the parameters.
fn scene<'a>(capture: &'a Capture, field: &str) -> Result<SceneView<'a>, Error> {
    fn byte(fields: &[Field], name: &str) -> Option<usize> {
        fields.iter().find_map(|field| match field.kind {
            _ if field.name == name => Some(field.byte as usize),
            Kind::Block(inner) => Some(field.byte as usize + byte(inner, name)?),
            Kind::Unsigned(_) | Kind::Floats(_) => None,
        })
    }
    let pass = &capture.pass;
    let misfit = || Error::Kernel {
        kernel: pass.kernel.name.to_owned(),
        source: format!("its parameters have no {field}").into(),
    };
    let first = byte(pass.kernel.fields, field).ok_or_else(misfit)?;
    let words = &bytemuck::cast_slice::<u32, u8>(&pass.params)[first..][..size_of::<SceneHeader>()];
    let arena = |name: &str| -> &'a [UVec4] {
        let found = pass.bindings().zip(&capture.contents).find(|((binding, _), _)| binding.name == name);
        found.map_or(&[], |(_, words)| bytemuck::cast_slice(words))
    };
    Ok(SceneView {
        header: bytemuck::pod_read_unaligned(words),
        geometry: arena("geometry"),
        attributes: arena("attributes"),
        texels: arena("texels"),
        features: restir_shared::layout::FEATURES_ALL,
        tracer: None,
    })
}

fn wrong(form: &DeferredKernel, problem: String) -> Error {
    Error::Kernel { kernel: form.desc.name.to_owned(), source: problem.into() }
}
