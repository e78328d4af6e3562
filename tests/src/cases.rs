//! The parity cases of all kernels: those of the kernels that need no technique, of some with a scene, and passes captured from the plans of
//! techniques, one row of settings after the other.

use crate::capture::{Capture, captured};
use crate::parity::{POISON, run};
use crate::scenes::buffers;
use crate::technique::{DENOISED, Row, Trials};
use crate::traversal;
use crate::{crossings, deferral};
use glam::DVec3;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::CpuExecutor;
use restir_host::plan::FramePlan;
use restir_host::render::Render;
use restir_host::scene::Camera;
use restir_host::technique::{Repeats, Technique};
use restir_kernels::denoise::KERNELS as DENOISER;
use restir_kernels::{Access, Case, KernelDesc};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// All cases.
///
/// # Panics
/// If a row asks for a scene that there is not, or its plan is wrong.
pub fn all() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let of_technique = |trials: &Trials| of(trials).unwrap_or_else(|e| panic!("{}: {e}", trials.name()));
        let of_rays = traversal::cases().unwrap_or_else(|e| panic!("rays: {e}"));
        let of_kernels = restir_kernels::cases().into_iter().chain(crossings::cases()).chain(of_rays);
        let denoised = denoised().unwrap_or_else(|e| panic!("the denoiser: {e}"));
        of_kernels.chain(Trials::all().iter().flat_map(of_technique)).chain(denoised).collect()
    })
}

/// The cases of a kernel. One that has none is not tested, so it fails.
///
/// # Errors
/// A sentence, if there are none.
pub fn of_kernel(kernel: &KernelDesc) -> Result<Vec<&'static Case>, String> {
    let cases: Vec<&Case> = all().iter().filter(|case| case.kernel.name == kernel.name).collect();
    if cases.is_empty() {
        return Err(format!("kernel {} has no parity cases; add a row of settings whose plan runs it", kernel.name));
    }
    Ok(cases)
}

/// Of the rows of a technique that has many one in so many has frozen cases as well: they take another compilation each.
const FROZEN_EVERY: usize = 4;
const SEED: u32 = 5;

/// The cases of a technique's rows; without rows, of its settings in two scenes.
fn of(trials: &Trials) -> Result<Vec<Case>, Error> {
    let known = &trials.known.cases;
    let mut cases = Vec::new();
    for (index, &row) in known.rows.iter().enumerate() {
        let scene = buffers(row.scene)?;
        let variants = if known.variants.is_empty() { &[""] } else { known.variants };
        let renders: Vec<Render> = variants
            .iter()
            .map(|variant| {
                let settings = [known.common, row.settings, variant].join(",");
                Ok(render(&scene, trials.with(&settings)?, row))
            })
            .collect::<Result<_, Error>>()?;
        let frozen = known.rows.len() <= 2 * FROZEN_EVERY || index % FROZEN_EVERY == FROZEN_EVERY - 1;
        let plans = renders.iter().map(|render| render.plan(&scene));
        let lacks = |kernel: &KernelDesc| cases.iter().all(|case: &Case| case.kernel.name != kernel.name);
        let of_row = of_row(&format!("{}, {}", row.name, row.scene), frozen, &lacks, plans)?;
        cases.extend(of_row);
    }
    Ok(cases)
}

/// The cases of the denoiser's kernels.
fn denoised() -> Result<Vec<Case>, Error> {
    let mut cases = Vec::new();
    for (technique, row) in DENOISED {
        let scene = buffers(row.scene)?;
        let technique = Trials::of(technique)?.with(row.settings)?;
        let render = Render { denoise: Some(Denoise::default()), ..render(&scene, technique, row) };
        let of_plan = of_row(&format!("{}, {}", row.name, row.scene), true, &|_| true, [render.plan(&scene)])?;
        cases.extend(of_plan.into_iter().filter(|case| DENOISER.iter().any(|kernel| kernel.name == case.kernel.name)));
    }
    Ok(cases)
}

/// Of several frames the last is seen from a step aside, unless the settings are for a still view.
fn render(scene: &SceneBuffers, technique: Box<dyn Technique>, row: Row) -> Render {
    let moves = technique.value("still").as_deref() != Some("on");
    let aside = |frame: u32| moves && row.count > 1 && frame + 1 == row.count;
    let step = |frame| scene.camera.position + if aside(frame) { DVec3::X * 0.05 } else { DVec3::ZERO };
    let is_of_frames = technique.about().repeats == Repeats::Frames;
    let camera = |frame| Camera { position: step(frame), ..scene.camera };
    let cameras = if is_of_frames { (0..row.count).map(camera).collect() } else { Vec::new() };
    Render { count: row.count, seed: SEED, cameras, ..Render::new(row.size, technique) }
}

/// The last pass of each kernel in the plans of a row, the last of those that have one, but for kernels with cases of their
/// own: as cases of the general kernel and, if that is asked for, of the one frozen as the plan has it and of its form whose rays are traced
/// elsewhere, of which a kernel that `lacks` cases has some in any case.
fn of_row<'a>(
    name: &str,
    frozen: bool,
    lacks: &dyn Fn(&KernelDesc) -> bool,
    plans: impl IntoIterator<Item = FramePlan<'a>>,
) -> Result<Vec<Case>, Error> {
    let mut last: BTreeMap<&str, Capture> = BTreeMap::new();
    for plan in plans {
        last.extend(captured(plan)?.into_iter().map(|capture| (capture.pass.kernel.name, capture)));
    }
    let own = restir_kernels::cases();
    last.retain(|kernel, _| own.iter().all(|case| case.kernel.name != *kernel));
    let mut cases = Vec::new();
    for capture in last.values() {
        let general = case(format!("{name}, general"), capture)?;
        if frozen {
            let constants = capture.pass.constants.clone();
            cases.push(Case { name: format!("{name}, frozen"), constants, ..general.clone() });
        }
        if let Some(form) = capture.pass.kernel.rays.deferred().filter(|form| frozen || lacks(&form.desc)) {
            cases.extend(deferral::cases(name, capture, form)?);
        }
        cases.push(general);
    }
    Ok(cases)
}

/// A captured pass as a case of the general kernel. What it writes starts out poisoned, unless it reads that first: then other
/// words come of it.
fn case(name: String, capture: &Capture) -> Result<Case, Error> {
    let (pass, contents) = (&capture.pass, capture.contents.iter().cloned().map(Some));
    let params = Some(pass.params.clone().into());
    let kept = Case {
        kernel: pass.kernel,
        name,
        grid: pass.grid,
        constants: pass.kernel.constants.iter().map(|constant| constant.default).collect(),
        buffers: std::iter::once(params).chain(contents).collect(),
    };
    let mut poisoned = kept.clone();
    let buffers = pass.kernel.bindings.iter().zip(&mut poisoned.buffers);
    buffers.filter(|(binding, _)| binding.access == Access::Own).for_each(|(_, words)| *words = None);
    let right = run(&mut CpuExecutor::inline(), &kept)?;
    // what it reads may be an index, of poison one beyond what there is: no report of that
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| ()));
    let of_poison = std::panic::catch_unwind(|| run(&mut CpuExecutor::inline(), &poisoned));
    std::panic::set_hook(report);
    let made = of_poison.ok().transpose()?;
    let complete = made.is_some_and(|made| made == right && made.iter().flatten().all(|word| *word != POISON));
    Ok(if complete { poisoned } else { kept })
}
