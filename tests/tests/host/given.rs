//! Sessions whose first surfaces somebody else gives, as a rasteriser does.

use super::deferred::read;
use super::session::{OnDevice, SIZE, camera, source};
use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::{CpuExecutor, GpuExecutor};
use restir_host::scene::Camera;
use restir_host::session::{CpuSession, SceneChange, Setup, View};
use restir_host::technique::path::PathSettings;
use restir_host::wgpu;
use restir_shared::camera::camera_ray;
use restir_shared::geometry::PackedHit;
use restir_shared::layout::FilmPixel;
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{GivenSurface, Surface, Trace};
use restir_tests::checks;
use restir_tests::device;
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::restir_di::settings;

const FRAMES: u32 = 4;
/// Textures and normal maps, glass, many lamps, and things that move.
const SCENES: [&str; 4] = ["tower", "panes", "many-lights", "moving"];
const SETTINGS: [&str; 3] = ["", "preset=quality", "spatial=2,feedback=off,tiles=4x32"];

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials =
        checks! { later { the_picture_of_the_built_in_first_pass what_is_given_is_shown others_are_refused } };
    trials.extend(device::trials(|adapter| {
        vec![adapter.trial("the picture of the built-in first pass, with rays of either kind", on_device)]
    }));
    trials
}

/// What a rasteriser writes: hits without their numbers, and surfaces.
fn gbuffer(
    this: &SceneBuffers,
    last: &SceneBuffers,
    camera: Camera,
    first_id: u32,
) -> (Vec<PackedHit>, Vec<GivenSurface>) {
    let (scene, params) = (this.traced_view(), camera.params(SIZE[0], SIZE[1]));
    let of_pixel = |pixel: u32| {
        let (x, y) = (pixel % SIZE[0], pixel / SIZE[0]);
        let rng = Rng::new(x, y, 0, 0, Sampler::Sobol);
        let ray = camera_ray(&params, false, |point| point, this.features, &rng, x, y);
        let mut hit = scene.closest(&ray);
        if !hit.is_hit() {
            return (PackedHit::pack(&hit), GivenSurface::default());
        }
        let moved = last.view().surface(&ray, &hit).position;
        let surface = GivenSurface::new(&scene.surface(&ray, &hit), moved);
        hit.id = first_id + pixel;
        (PackedHit::pack(&hit), surface)
    };
    (0..SIZE[0] * SIZE[1]).map(of_pixel).unzip()
}

/// How many pixels of some frames differ from those of a session that finds its surfaces itself; `change` is what a renderer does wrong.
fn differing(scene: &str, text: &str, change: impl Fn(&mut [GivenSurface])) -> Result<usize, Failed> {
    let buffers = SceneBuffers::build(&source(scene)?)?;
    let setup = Setup { seed: 3, ..Setup::new(buffers.clone(), settings(text), SIZE) };
    let mut own = CpuSession::new(setup.clone(), CpuExecutor::new()?)?;
    let mut given = CpuSession::new(Setup { surfaces_given: true, ..setup }, CpuExecutor::new()?)?;
    let (mut last, mut differing) = (buffers.clone(), 0);
    for frame in 0..FRAMES {
        let this = buffers.at(f64::from(frame))?;
        let scene = SceneChange::Frame(f64::from(frame));
        let view = View { camera: Some(camera(frame)), scene, ..View::default() };
        own.frame(&view)?;
        let (plane, first_id) = given.surfaces_mut().ok_or("there is no plane of surfaces")?;
        let (hits, surfaces) = gbuffer(&this, &last, camera(frame), first_id);
        plane.copy_from_slice(&surfaces);
        change(plane);
        given.primary_mut().ok_or("there is no plane of hits")?.copy_from_slice(&hits);
        given.frame(&View { primary_given: true, ..view })?;
        differing += count_differing(own.pixels(), given.pixels());
        last = this;
    }
    Ok(differing)
}

fn count_differing(a: &[FilmPixel], b: &[FilmPixel]) -> usize {
    a.iter().zip(b).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count()
        + a.len().abs_diff(b.len())
}

fn the_picture_of_the_built_in_first_pass() -> Result<(), Failed> {
    for (scene, text) in SCENES.into_iter().flat_map(|scene| SETTINGS.map(|text| (scene, text))) {
        let differing = differing(scene, text, |_| ())?;
        ensure(differing == 0, || format!("{scene}, {text:?}: {differing} pixels differ"))?;
    }
    Ok(())
}

type Change = fn(&mut GivenSurface);

/// The scene's triangles are not asked: where the surfaces say something else the picture does, and where motion is wrong other pixels are
/// reused.
fn what_is_given_is_shown() -> Result<(), Failed> {
    let wrong: [(&str, Change); 3] = [
        ("a colour", |surface| surface.base_color[0] *= 0.5),
        ("a normal", |surface| surface.shading_normal = [0.0, 0.6, 0.8]),
        ("a motion vector", |surface| surface.last_position[0] += 0.3),
    ];
    for (what, change) in wrong {
        let differing = differing("moving", "", |surfaces| surfaces.iter_mut().for_each(change))?;
        ensure(differing > 50, || format!("{what} is another, and {differing} pixels differ"))?;
    }
    Ok(())
}

fn others_are_refused() -> Result<(), Failed> {
    let buffers = SceneBuffers::build(&source("cornell")?)?;
    let setup = Setup { surfaces_given: true, ..Setup::new(buffers, PathSettings::default(), SIZE) };
    let denoised = Setup { technique: settings("").into(), denoise: Some(Denoise::default()), ..setup.clone() };
    let foreign = Setup { surfaces_given: true, ..Setup::foreign(0, settings(""), SIZE) };
    for (setup, expected) in [(setup, "choose restir-di"), (denoised, "denoiser"), (foreign, "foreign scene")] {
        let told = CpuSession::new(setup, CpuExecutor::new()?).err().map(|error| error.to_string()).unwrap_or_default();
        ensure(told.contains(expected), || format!("told {told:?} instead of {expected}"))?;
    }
    Ok(())
}

/// On a device, whose session traces rays itself or has them traced.
fn on_device(executor: &mut GpuExecutor) -> Result<(), Failed> {
    for (scene, deferred) in [("moving", false), ("tower", false), ("moving", true)] {
        let buffers = SceneBuffers::build(&source(scene)?)?;
        let setup = Setup { seed: 3, ..Setup::new(buffers.clone(), settings(""), SIZE) };
        let mut own = CpuSession::new(setup.clone(), CpuExecutor::new()?)?;
        let OnDevice { mut session, device, queue } = OnDevice::new(executor, Setup { surfaces_given: true, ..setup })?;
        let mut last = buffers.clone();
        for frame in 0..FRAMES {
            let this = buffers.at(f64::from(frame))?;
            let change = SceneChange::Frame(f64::from(frame));
            let view = View { camera: Some(camera(frame)), scene: change, ..View::default() };
            own.frame(&view)?;
            let plane = session.surfaces().ok_or("there is no plane of surfaces")?;
            let (hits, surfaces) = gbuffer(&this, &last, camera(frame), plane.first_id);
            queue.write_buffer(plane.buffer, plane.offset, bytemuck::cast_slice(&surfaces));
            queue.write_buffer(session.primary().ok_or("there are hits")?, 0, bytemuck::cast_slice(&hits));
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let view = View { primary_given: true, ..view };
            if deferred {
                let mut problem = None;
                session.frame_deferred(&mut encoder, &view, &mut |encoder, round| {
                    let traced = super::deferred::trace(&device, &queue, encoder, round);
                    problem = traced.err().or(problem.take());
                })?;
                problem.map_or(Ok(()), Err)?;
            } else {
                session.frame(&mut encoder, &view)?;
            }
            queue.submit([encoder.finish()]);
            device.poll(wgpu::PollType::wait_indefinitely())?;
            let pixels: Vec<FilmPixel> = bytemuck::pod_collect_to_vec(&read(&device, &queue, session.output())?);
            let differing = count_differing(own.pixels(), &pixels);
            ensure(differing == 0, || {
                format!("{scene}, deferred {deferred}, frame {frame}: {differing} pixels differ")
            })?;
            last = this;
        }
    }
    Ok(())
}
