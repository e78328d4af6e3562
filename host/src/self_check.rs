//! The start-up check, which answers whether a device gives the host's bits.
//!
//! It runs a few hundred probes of the numeric contract, with the inputs on which a build that breaks it differs, and renders small frames by
//! every technique, of a scene with all that kernels know: glass, metal, a texture, an environment, lights of all kinds; and of wax, whose light
//! has kernels of its own. Where it is known what will be rendered, it renders small frames of that instead ([`GpuBuilder::for_render`]), and
//! no kernel is compiled for the check alone.
//!
//! ```
//! use restir_host::exec::{CpuExecutor, Parity};
//! use restir_host::self_check::self_check;
//!
//! // the CPU is the host; of a device `GpuExecutor::open` asks the same
//! assert_eq!(self_check(&mut CpuExecutor::new()?)?, Parity::Exact);
//! # Ok::<(), restir_host::Error>(())
//! ```

use crate::Error;
use crate::buffers::SceneBuffers;
use crate::exec::{CpuExecutor, Executor, Parity};
use crate::plan::{Buffer, FramePlan, Pass};
#[cfg(feature = "gpu")]
use crate::render::Shows;
use crate::scene::{
    Environment, Filter, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, UvSet, Volume, Wrap,
};
use crate::technique::path::{PathSettings, Subsurface};
#[cfg(feature = "gpu")]
use crate::{
    Shaders,
    exec::{Flavour, GpuExecutor},
};
use crate::{metrics::ulp_distance, render::Render, technique};
use glam::DVec3;
use restir_kernels::check::Probes;
use restir_kernels::check::self_check::{DESC, Results, boundary_operands, random_operands};
#[cfg(feature = "gpu")]
use std::path::Path;

/// Random probes beside the boundary cases.
const RANDOM_PROBES: u32 = 256;
/// Side of the frames, and how many follow each other.
const FRAME: u32 = 16;
const REPEATS: u32 = 2;
/// Of light inside of bodies: a dispatch.
const LONGEST_WALK: u32 = 64;

fn probes() -> Result<FramePlan<'static>, Error> {
    let operands = [boundary_operands(), random_operands(RANDOM_PROBES)].concat();
    let count = operands.len() as u32;
    let operands: Vec<u32> = bytemuck::cast_slice(&operands).to_vec();
    let pass = Pass::new(&DESC, &[], &Probes { count }, &[("operands", 0), ("results", 1)])?;
    let words = count as usize * size_of::<Results>() / 4;
    let buffers = vec![
        Buffer { name: "operands", words: operands.len(), contents: Some(operands.into()) },
        Buffer { name: "results", words, contents: None },
    ];
    Ok(FramePlan::of(buffers, vec![pass], vec![1]))
}

/// The largest distance between the host's and the executor's words, `None` if no word differs.
fn run_and_compare<'a>(
    executor: &mut dyn Executor,
    plan: impl Fn() -> Result<FramePlan<'a>, Error>,
) -> Result<Option<u32>, Error> {
    let host = CpuExecutor::new()?.run(plan()?)?;
    let device = executor.run(plan()?)?;
    let words = host.into_iter().flatten().zip(device.into_iter().flatten());
    let differing = words.filter(|(a, b)| a != b).map(|(a, b)| (f32::from_bits(a), f32::from_bits(b)));
    Ok(differing.filter(|(a, b)| !(a.is_nan() && b.is_nan())).map(|(a, b)| ulp_distance(a, b)).max())
}

/// The box with a ball of glass, a textured floor, and lights of all kinds.
fn scene() -> Result<Scene, Error> {
    let mut scene = Scene::load("glass")?;
    let texels = (0..16_u8).map(|i| [16 * i, 255 - 9 * i, 90 + i, 255]).collect();
    let (wrap, filter) = ([Wrap::Repeat; 2], Filter::Linear);
    let texture = Texture { name: "check".to_owned(), size: [4, 4], texels, wrap, filter };
    scene.textures.push(texture);
    let used = TextureUse {
        texture: scene.textures.len() - 1,
        transform: [3.0, 0.0, 0.0, 0.0, 3.0, 0.0],
        uv_set: UvSet::First,
    };
    if let Some(material) = scene.materials.iter_mut().find(|material| material.transmission == 0.0) {
        *material = Material { metallic: 0.4, roughness: 0.3, base_color_texture: Some(used), ..material.clone() };
    }
    let kind = LightKind::Point { position: DVec3::new(0.3, 0.4, 0.5) };
    scene.lights.push(Light { name: "check".to_owned(), kind, intensity: [0.5, 0.4, 0.3] });
    let pixels = (0..32_u8).map(|i| [f32::from(i) / 32.0, 0.5, 1.0]).collect();
    scene.environment = Some(Environment { name: "check".to_owned(), size: [8, 4], pixels, scale: 1.0, rotation: 0.0 });
    Ok(scene)
}

/// The same with a block of wax, inside of which light scatters.
fn scene_with_a_medium() -> Result<Scene, Error> {
    let mut scene = scene()?;
    let volume = Some(Volume::scattering([0.9, 0.8, 0.6], [0.2, 0.1, 0.05], 0.3));
    let wax = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("check", [1.0; 3]) };
    let material = scene.add_material(wax);
    scene.add_mesh("check", material, Mesh::cuboid(DVec3::new(-0.8, -0.9, 0.1), DVec3::new(-0.3, -0.4, 0.6)));
    Ok(scene)
}

/// What is rendered: every technique, and light inside of bodies, followed and by profiles.
fn renders() -> Result<Vec<(SceneBuffers, Render)>, Error> {
    let render = |technique| Render { seed: 1, count: REPEATS, ..Render::new([FRAME; 2], technique) };
    let [scene, with_medium] = [scene()?, scene_with_a_medium()?].map(|scene| SceneBuffers::build(&scene));
    let (scene, with_medium) = (scene?, with_medium?);
    let media = [Subsurface::Walk, Subsurface::Hybrid].map(|subsurface| {
        let settings = PathSettings { longest_walk: LONGEST_WALK, subsurface, ..PathSettings::default() };
        (with_medium.clone(), render(settings.into()))
    });
    let techniques = technique::all().into_iter().map(|technique| (scene.clone(), render(technique)));
    Ok(techniques.chain(media).collect())
}

/// Compares the executor with the host.
///
/// # Errors
/// Whatever the executor reports.
pub fn self_check(executor: &mut dyn Executor) -> Result<Parity, Error> {
    let mut farthest = run_and_compare(executor, probes)?;
    for (scene, render) in renders()? {
        farthest = farthest.max(run_and_compare(executor, || Ok(render.plan(&scene)))?);
    }
    Ok(parity(farthest))
}

/// Compares the executor with the host by probes, and by small frames of what it is to render.
#[cfg(feature = "gpu")]
fn self_check_of(executor: &mut dyn Executor, scene: &SceneBuffers, render: &Render) -> Result<Parity, Error> {
    let small =
        Render { width: FRAME, height: FRAME, count: render.count.min(REPEATS), shows: Shows::Last, ..render.clone() };
    let probes = run_and_compare(executor, probes)?;
    let frames = run_and_compare(executor, || Ok(small.plan(scene)))?;
    Ok(parity(probes.max(frames)))
}

fn parity(farthest: Option<u32>) -> Parity {
    farthest.map_or(Parity::Exact, |max_ulp| Parity::Approximate { max_ulp })
}

/// What [`GpuExecutor::builder`] opens.
#[cfg(feature = "gpu")]
#[derive(Clone, Debug)]
pub struct GpuBuilder<'a> {
    adapter: Option<&'a str>,
    flavour: Flavour,
    shaders: Shaders,
    render: Option<(&'a SceneBuffers, &'a Render)>,
    pipelines: Option<&'a Path>,
}

#[cfg(feature = "gpu")]
impl<'a> GpuBuilder<'a> {
    /// The first adapter whose name contains this, in any case; by default the first hardware adapter.
    #[must_use]
    pub fn adapter(self, name: impl Into<Option<&'a str>>) -> Self {
        Self { adapter: name.into(), ..self }
    }

    /// The build of the kernels, by default [`Flavour::Exact`].
    #[must_use]
    pub fn flavour(self, flavour: Flavour) -> Self {
        Self { flavour, ..self }
    }

    /// Where the kernels are, by default [`Shaders::Embedded`].
    #[must_use]
    pub fn shaders(self, shaders: Shaders) -> Self {
        Self { shaders, ..self }
    }

    /// What is to be rendered. The self-check then renders small frames of it, in place of frames by every technique of a scene that has
    /// everything: it takes the kernels that the render takes, and tells nothing of others.
    #[must_use]
    pub fn for_render(self, scene: &'a SceneBuffers, render: &'a Render) -> Self {
        Self { render: Some((scene, render)), ..self }
    }

    /// Keeps compiled pipelines, also those of the self-check, in a file of `folder` ([`GpuExecutor::keep_pipelines_in`]).
    #[must_use]
    pub fn keep_pipelines_in(self, folder: impl Into<Option<&'a Path>>) -> Self {
        Self { pipelines: folder.into(), ..self }
    }
}

#[cfg(feature = "gpu")]
impl GpuBuilder<'_> {
    /// Opens the adapter, and runs the self-check on its kernels.
    ///
    /// # Errors
    /// [`Error::Adapter`] if there is none, it cannot be opened, or it cannot run the flavour: one that cannot run `exact` is asked for
    /// `fast` by name. What the self-check reports.
    pub fn open(self) -> Result<GpuExecutor, Error> {
        let (device, queue) = crate::exec::gpu::open_adapter(self.adapter, self.flavour)?;
        let mut executor = GpuExecutor::with_device(device, queue, self.flavour, self.shaders);
        if let Some(folder) = self.pipelines {
            executor = executor.keep_pipelines_in(folder);
        }
        match self.render {
            Some((scene, render)) => executor.check_for(scene, render)?,
            None => executor.check()?,
        };
        Ok(executor)
    }
}

#[cfg(feature = "gpu")]
impl GpuExecutor {
    /// An executor on an adapter that is yet to be opened.
    pub fn builder<'a>() -> GpuBuilder<'a> {
        GpuBuilder { adapter: None, flavour: Flavour::Exact, shaders: Shaders::Embedded, render: None, pipelines: None }
    }

    /// Opens the first hardware adapter for the flavour `exact` of the embedded kernels. [`Self::builder`] opens others.
    ///
    /// # Errors
    /// As of [`GpuBuilder::open`].
    pub fn open() -> Result<Self, Error> {
        Self::builder().open()
    }

    /// Runs the self-check and remembers its result for [`Executor::describe`]. [`Self::open`] has done so.
    ///
    /// # Errors
    /// What the kernels report.
    pub fn check(&mut self) -> Result<Parity, Error> {
        let parity = self_check(self)?;
        self.parity = Some(parity);
        Ok(parity)
    }

    /// As [`Self::check`], by small frames of what is to be rendered ([`GpuBuilder::for_render`]).
    ///
    /// # Errors
    /// What the kernels report.
    #[doc(hidden)]
    pub fn check_for(&mut self, scene: &SceneBuffers, render: &Render) -> Result<Parity, Error> {
        let parity = self_check_of(self, scene, render)?;
        self.parity = Some(parity);
        Ok(parity)
    }
}
