//! Native against device, word by word: every kernel, case, adapter and flavour.

use crate::scenes::named;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::metrics::ulp_distance;
use restir_host::plan::{Buffer, FramePlan, Pass, Upload};
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene};
use restir_host::technique::restir_di::DiSettings;
use restir_kernels::{Access, Case, CaseScene, CaseScenes, KernelDesc};
use restir_shared::layout::{CameraParams, SceneHeader};
use restir_shared::technique::di::{DI_OTHER_FRAME, DiParams};
use std::fmt;
use std::ops::ControlFlow;

/// Outputs begin as this: an invocation that ends early leaves it behind. It is a NaN.
pub const POISON: u32 = 0x7fc0_dead;
/// How many differing words a report lists.
const LISTED: usize = 8;

/// The built-in scenes and those of the harness, for the cases.
pub struct BuiltinScenes;

impl CaseScenes for BuiltinScenes {
    fn scene(&self, name: &str) -> CaseScene {
        let (name, frame) = name.split_once(' ').map_or((name, None), |(name, frame)| (name, frame.parse().ok()));
        let scene = named(name).map_or_else(|| Scene::load(name), Ok);
        let scene = scene.and_then(|s| SceneBuffers::build(&s)).and_then(|scene| {
            let arenas = frame.map_or_else(|| Ok(Arenas::still(&scene)), |frame| Arenas::of_frame(&scene, frame))?;
            Ok((scene, arenas))
        });
        let (scene, arenas) = scene.unwrap_or_else(|e| panic!("a case asks for the scene {name:?}: {e}"));
        let Arenas { headers: [header, other_header], words: [geometry, attributes, texels] } = arenas;
        let camera: Camera = scene.camera;
        CaseScene {
            header,
            other_header,
            geometry,
            attributes,
            texels,
            camera: Box::new(move |width, height| -> CameraParams { camera.params(width, height) }),
            features: scene.features,
        }
    }
}

/// What the kernels of ReSTIR DI are given of a scene: the headers of a frame and of the one before, and the arenas.
struct Arenas {
    headers: [SceneHeader; 2],
    words: [Vec<u32>; 3],
}

impl Arenas {
    fn still(scene: &SceneBuffers) -> Self {
        let words = [&scene.geometry, &scene.attributes, &scene.texels].map(|words| words.to_vec());
        Self { headers: [scene.header; 2], words }
    }

    /// As a render has them when it combines the frame with the one before.
    fn of_frame(scene: &SceneBuffers, frame: u32) -> Result<Self, Error> {
        let render = Render { count: frame + 1, ..Render::new([1, 1], DiSettings::default()) };
        let plan = render.technique.plan(scene, &render);
        let contents = |id: usize| {
            let Buffer { words, contents, .. } = &plan.buffers[id];
            contents.as_ref().map_or_else(|| vec![0; *words], |contents| contents.to_vec())
        };
        let mut arenas = Self { words: [0, 1, 2].map(contents), ..Self::still(scene) };
        for pass in plan.passes {
            let pass = pass?;
            for Upload { buffer, first, words } in pass.frame.iter().flat_map(|frame| &frame.uploads) {
                arenas.words[*buffer][*first..][..words.len()].copy_from_slice(words);
            }
            if let Ok([params]) = bytemuck::try_cast_slice::<u32, DiParams>(&pass.params) {
                arenas.headers = [params.scene, params.other_scene];
                if params.frame == frame && params.flags & DI_OTHER_FRAME != 0 {
                    break;
                }
            }
        }
        Ok(arenas)
    }
}

/// A kernel without cases is not tested, so it fails.
pub fn cases(kernel: &KernelDesc) -> Result<Vec<Case>, String> {
    let cases = (kernel.cases)(&BuiltinScenes);
    if cases.is_empty() {
        return Err(format!(
            "kernel {} has no parity cases; give its file a `cases` function that returns some",
            kernel.name
        ));
    }
    Ok(cases)
}

/// A word that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Name of the buffer.
    pub buffer: &'static str,
    /// Index of the element.
    pub element: usize,
    /// Index of the word in the element.
    pub word: usize,
    /// The host's word.
    pub host: u32,
    /// The device's word.
    pub device: u32,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { buffer, element, word, host, device } = *self;
        let (a, b) = (f32::from_bits(host), f32::from_bits(device));
        let ulp = ulp_distance(a, b);
        write!(f, "{buffer}[{element}] word {word}: host {host:08x} ({a:e}), device {device:08x} ({b:e}), {ulp} ulp")
    }
}

/// The result of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Words compared.
    pub words: usize,
    /// Words that differ; two NaN do not, for their bits are unspecified.
    pub differing: usize,
    /// The largest distance between two words, as f32.
    pub max_ulp: u32,
    /// Words that still hold the poison on either side.
    pub poisoned: usize,
    /// The first few differences.
    pub first: Vec<Difference>,
}

impl Outcome {
    /// All words are equal and all were written.
    pub fn is_exact(&self) -> bool {
        self.differing == 0 && self.poisoned == 0
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_exact() {
            return write!(f, "exact, {} words", self.words);
        }
        write!(f, "approximate, {} of {} words differ, max {} ulp", self.differing, self.words, self.max_ulp)?;
        if self.poisoned > 0 {
            write!(f, ", {} words were never written", self.poisoned)?;
        }
        Ok(())
    }
}

/// Runs a case on an executor: the words of the kernel's [`Access::Own`] buffers.
///
/// # Errors
/// Whatever the executor reports.
pub fn run(executor: &mut dyn Executor, kernel: &'static KernelDesc, case: &Case) -> Result<Vec<Vec<u32>>, Error> {
    executor.run(plan(kernel, case), &mut |_| ControlFlow::Continue(()))
}

/// The plan of a case: one pass, which gives the kernel's [`Access::Own`] buffers.
pub fn plan(kernel: &'static KernelDesc, case: &Case) -> FramePlan<'static> {
    let mut constants: Vec<u32> = kernel.constants.iter().map(|c| c.default).collect();
    for &(index, value) in &case.constants {
        constants[index] = value;
    }
    let invocations = case.grid[0] as usize * case.grid[1] as usize;
    let buffers: Vec<Buffer> = kernel.bindings[1..]
        .iter()
        .zip(&case.buffers[1..])
        .map(|(binding, contents)| {
            let poison = || vec![POISON; invocations * binding.stride as usize / 4];
            let contents = contents.clone().unwrap_or_else(poison);
            Buffer { name: binding.name, words: contents.len(), contents: Some(contents.into()) }
        })
        .collect();
    let own = kernel.bindings[1..].iter().enumerate().filter(|(_, b)| b.access == Access::Own);
    let pass = Pass {
        frame: None,
        kernel,
        constants,
        params: case.buffers[0].clone().unwrap_or_default(),
        bindings: (0..buffers.len()).collect(),
        grid: case.grid,
    };
    FramePlan {
        outputs: own.map(|(i, _)| i).collect(),
        buffers,
        passes: Box::new(std::iter::once(Ok(pass))),
        pass_count: 1,
        scene: None,
    }
}

/// Runs a case natively and on `device`, and compares.
///
/// # Errors
/// Whatever the executors report.
pub fn compare(device: &mut dyn Executor, kernel: &'static KernelDesc, case: &Case) -> Result<Outcome, Error> {
    let host = run(&mut CpuExecutor::new(None)?, kernel, case)?;
    let device = run(device, kernel, case)?;
    let mut outcome = Outcome::default();
    let own = kernel.bindings.iter().filter(|b| b.access == Access::Own);
    for ((binding, host), device) in own.zip(&host).zip(&device) {
        let stride = binding.stride as usize / 4;
        for (at, (&host, &device)) in host.iter().zip(device).enumerate() {
            let difference = Difference { buffer: binding.name, element: at / stride, word: at % stride, host, device };
            record(&mut outcome, difference);
        }
    }
    Ok(outcome)
}

fn record(outcome: &mut Outcome, difference: Difference) {
    let Difference { host, device, .. } = difference;
    let is_nan = |bits: u32| bits & 0x7fff_ffff > 0x7f80_0000;
    outcome.words += 1;
    if host == POISON || device == POISON {
        outcome.poisoned += 1;
    }
    if host != device && !(is_nan(host) && is_nan(device)) {
        outcome.differing += 1;
        outcome.max_ulp = outcome.max_ulp.max(ulp_distance(f32::from_bits(host), f32::from_bits(device)));
        if outcome.first.len() < LISTED {
            outcome.first.push(difference);
        }
    }
}
