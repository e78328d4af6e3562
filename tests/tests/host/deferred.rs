//! Sessions whose rays somebody else traces: here the harness, triangle by triangle.

use super::session::{OnDevice, SIZE, camera, source, techniques};
use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::gpu::Pipelines;
use restir_host::exec::{CpuExecutor, Flavour, GpuExecutor};
use restir_host::session::{CpuSession, GpuSession, RayRound, SceneChange, Setup, View};
use restir_host::technique::Technique;
use restir_host::technique::path::PathSettings;
use restir_host::{Error, Shaders, wgpu};
use restir_shared::geometry::{Hit, PackedHit};
use restir_shared::layout::FilmPixel;
use restir_shared::scene::DeferredRay;
use restir_tests::brute::Triangles;
use restir_tests::device;
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::Trials;
use std::sync::mpsc;

const FRAMES: u32 = 4;

pub(crate) fn trials() -> Vec<Trial> {
    device::trials(|adapter| {
        vec![
            adapter.trial("the bits of rays that are traced inside", same_bits),
            adapter.trial("a tracer that takes the wrong frame is seen", wrong_frames_are_seen),
            adapter.trial("whatever happens to the scene and to the session", whatever_happens),
            adapter.trial("what traces its rays itself is refused", others_are_refused),
        ]
    })
}

/// Which scene a ray is asked of.
type Choose = fn(&DeferredRay) -> usize;

fn right(ray: &DeferredRay) -> usize {
    ray.other_frame as usize
}

/// The answer to a ray of one of two scenes, that of this frame and that of the last one.
fn answer(scenes: &[&SceneBuffers; 2], choose: Choose, ray: &DeferredRay) -> PackedHit {
    let hit = Triangles::new(scenes[choose(ray)].view()).closest(&ray.ray());
    PackedHit::pack(&match ray.asks {
        DeferredRay::OCCLUDED if hit.is_hit() => Hit { t: f32::NAN, id: 0, ..hit },
        _ => hit,
    })
}

/// A session on a device, whose rays are traced here.
struct Traced {
    player: OnDevice,
    rounds: u32,
}

impl Traced {
    fn new(executor: &GpuExecutor, setup: Setup) -> Result<Self, Error> {
        Ok(Self { player: OnDevice::new(executor, setup)?, rounds: 0 })
    }

    fn frame(&mut self, view: &View<'_>, choose: Choose) -> Result<Vec<FilmPixel>, Failed> {
        let OnDevice { session, device, queue } = &mut self.player;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (mut problem, rounds) = (None, &mut self.rounds);
        session.frame_deferred(&mut encoder, view, &mut |encoder, round| {
            *rounds += 1;
            let resolved = resolve(device, queue, encoder, round, choose);
            problem = resolved.err().or(problem.take());
        })?;
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
        problem.map_or(Ok(()), Err)?;
        Ok(bytemuck::pod_collect_to_vec(&read(device, queue, session.output())?))
    }
}

/// Traces a round.
pub(super) fn trace(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    encoder: &mut wgpu::CommandEncoder,
    round: &RayRound<'_>,
) -> Result<(), Failed> {
    resolve(device, queue, encoder, round, right)
}

/// The answers are made of what was submitted, and what comes next goes on with an encoder of its own.
fn resolve(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    encoder: &mut wgpu::CommandEncoder,
    round: &RayRound<'_>,
    choose: Choose,
) -> Result<(), Failed> {
    let next = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    queue.submit([std::mem::replace(encoder, next).finish()]);
    let rays: Vec<DeferredRay> = bytemuck::pod_collect_to_vec(&read(device, queue, round.rays)?);
    let asked = rays.iter().take(round.count as usize).enumerate();
    for (index, ray) in asked.filter(|(_, ray)| !ray.is_finished()) {
        let at = u64::from(ray.plane * round.count) + index as u64;
        queue.write_buffer(round.answers, at * 16, bytemuck::bytes_of(&answer(&round.scenes, choose, ray)));
    }
    Ok(())
}

pub(super) fn read(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Failed> {
    let (sender, receiver) = mpsc::channel();
    wgpu::util::DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |read| {
        // who waits for it lives longer
        let _ = sender.send(read.map(|view| view.to_vec()));
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(receiver.recv()??)
}

/// How many pixels of some frames differ from those of a session that traces its rays itself; at least one round in each.
fn differing(
    executor: &GpuExecutor,
    scene: &str,
    technique: Box<dyn Technique>,
    choose: Choose,
) -> Result<usize, Failed> {
    let buffers = SceneBuffers::build(&source(scene)?)?;
    let setup = Setup { seed: 3, ..Setup::new(buffers.clone(), technique, SIZE) };
    let mut host = CpuSession::new(setup.clone(), CpuExecutor::new()?)?;
    let mut traced = Traced::new(executor, setup)?;
    let mut differing = 0;
    for frame in 0..FRAMES {
        let scene = SceneChange::Frame(f64::from(frame));
        let view = View { camera: Some(camera(frame)), scene, ..View::default() };
        host.frame(&view)?;
        let before = traced.rounds;
        let pixels = traced.frame(&view, choose)?;
        ensure(traced.rounds > before, || format!("frame {frame} asks for no ray"))?;
        let differ = |(a, b): &(&FilmPixel, &FilmPixel)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b);
        differing += host.pixels().iter().zip(&pixels).filter(differ).count();
    }
    Ok(differing)
}

/// In scenes that move and stand still, one of which has glass in the way of light.
fn same_bits(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scenes = ["moving", "panes"];
    for (scene, (name, technique)) in
        scenes.into_iter().flat_map(|scene| techniques().into_iter().map(move |t| (scene, t)))
    {
        let differing = differing(executor, scene, technique, right)?;
        ensure(differing == 0, || format!("{scene}, {name}: {differing} pixels differ"))?;
    }
    Ok(())
}

/// Reuse in time asks what a pixel saw in the last frame.
fn wrong_frames_are_seen(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let technique = Trials::of("restir-pt")?.with("")?;
    let differing = differing(executor, "moving", technique, |_| 0)?;
    ensure(differing > 0, || "rays of the last frame's scene are asked of this one's, and nobody sees it".to_owned())
}

/// The scene is edited, built anew, and replaced; the session is resized, reset, and has another technique, and several samples a frame.
fn whatever_happens(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = source("moving")?;
    let of = |name: &str, text: &str| Trials::of(name).and_then(|trials| trials.with(text));
    let setup = Setup::new(SceneBuffers::build_editable(&scene.at(0.0))?, of("restir-di", "")?, SIZE);
    let setup = Setup { samples: 2, ..setup };
    let mut host = CpuSession::new(setup.clone(), CpuExecutor::new()?)?;
    let mut traced = Traced::new(executor, setup)?;
    for frame in 0..8 {
        let mut edited = scene.at(f64::from(frame / 2));
        match frame {
            2 => edited.instances.truncate(edited.instances.len() - 1),
            3 => (host.resize([9, 7])?, traced.player.session.resize([9, 7])?).1,
            4 => (host.reset(), traced.player.session.reset()).1,
            5 => {
                host.set_technique(of("restir-pt", "")?)?;
                traced.player.session.set_technique(of("restir-pt", "")?)?;
            }
            6 => {
                host.set_technique(of("path", "max_depth=3")?)?;
                traced.player.session.set_technique(of("path", "max_depth=3")?)?;
            }
            _ => (),
        }
        let scene = if frame == 7 { SceneChange::None } else { SceneChange::Edited(&edited) };
        let view = View { camera: Some(camera(frame)), scene, ..View::default() };
        let begun = host.frame(&view)?;
        let pixels = traced.frame(&view, right)?;
        let same =
            bytemuck::cast_slice::<FilmPixel, u8>(host.pixels()) == bytemuck::cast_slice::<FilmPixel, u8>(&pixels);
        ensure(same, || format!("frame {frame}, {:?}: the pixels are others", begun.history))?;
    }
    Ok(())
}

fn others_are_refused(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let device = executor.device();
    let refused = |setup: Setup, expected: &str| -> Result<(), Failed> {
        let pipelines = Pipelines::new(device, Flavour::Exact, Shaders::Embedded);
        let mut session = GpuSession::new(device, pipelines, setup)?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let result = session.frame_deferred(&mut encoder, &View::default(), &mut |_, _: &RayRound<'_>| ());
        let told = result.err().map(|error| error.to_string()).unwrap_or_default();
        ensure(told.contains(expected) && session.frames() == 0, || format!("{told:?} is not about {expected}"))
    };
    let cornell = || Ok::<_, Failed>(SceneBuffers::build(&source("cornell")?)?);
    let denoise = Some(Denoise::default());
    refused(Setup { denoise, ..Setup::new(cornell()?, PathSettings::default(), SIZE) }, "denoise_guide")?;
    refused(Setup::new(cornell()?, Trials::of("restir-suffix")?.with("")?, SIZE), "suffix_")?;
    let media = SceneBuffers::build(&source("moving-media")?)?;
    refused(Setup::new(media, PathSettings::default(), SIZE), "path_media")
}
