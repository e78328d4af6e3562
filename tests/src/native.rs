//! Plans run natively: over any scene, with passes changed, and with settings that the host refuses, for a plan does not check.

use bytemuck::Pod;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{FramePlan, Pass};
use restir_host::render::Render;
use restir_shared::layout::FilmPixel;
use restir_shared::scene::{AnyProbed, AnyScene, Probed, Still};

/// The plan of a render, whose settings may be such as renders refuse.
pub fn plan<'a>(scene: &'a SceneBuffers, render: &'a Render) -> FramePlan<'a> {
    render.plan(scene)
}

/// The film that a plan leaves, run over its own scene.
///
/// # Errors
/// As of the executor.
pub fn film(plan: FramePlan<'_>) -> Result<Vec<FilmPixel>, Error> {
    CpuExecutor::inline().run(plan).map(|words| pixels(&words))
}

/// As [`film`], over a scene of any type that stands still.
///
/// # Errors
/// As of the executor.
pub fn film_over(scene: &dyn AnyScene, plan: FramePlan<'_>) -> Result<Vec<FilmPixel>, Error> {
    CpuExecutor::run_over(&Still(scene), plan).map(|words| pixels(&words))
}

/// As [`film_over`], over a scene that knows its objects.
///
/// # Errors
/// As of the executor.
pub fn film_probed(scene: &dyn AnyProbed, plan: FramePlan<'_>) -> Result<Vec<FilmPixel>, Error> {
    CpuExecutor::run_over(&Probed(scene), plan).map(|words| pixels(&words))
}

fn pixels(outputs: &[Vec<u32>]) -> Vec<FilmPixel> {
    outputs.first().map_or_else(Vec::new, |words| bytemuck::pod_collect_to_vec(words))
}

/// A plan whose passes are changed before they run.
pub fn changed<'a>(plan: FramePlan<'a>, change: impl Fn(&mut Pass) + 'a) -> FramePlan<'a> {
    let passes = plan.passes.map(move |pass| {
        pass.map(|mut pass| {
            change(&mut pass);
            pass
        })
    });
    FramePlan { passes: Box::new(passes), ..plan }
}

/// Changes the parameters of a pass that has some of type `P`. Its kernel is still frozen to the scene, but to no settings.
pub fn edit<P: Pod>(pass: &mut Pass, edit: impl FnOnce(&mut P)) {
    if let Some(mut params) = pass.params::<P>() {
        edit(&mut params);
        pass.params = bytemuck::cast_slice(&[params]).to_vec();
        let constants = pass.kernel.constants.iter().zip(&mut pass.constants);
        constants.filter(|(constant, _)| constant.name != "features").for_each(|(c, value)| *value = c.default);
    }
}
