//! A game loop: ReSTIR DI on a Device that this program made, recorded frame by frame into its own encoders, while the camera and
//! objects move. A session on the CPU makes the same frames, with the same bits.
use restir_host::exec::gpu::{Pipelines, requirements};
use restir_host::exec::{CpuExecutor, Flavour};
use restir_host::scene::{Camera, Scene};
use restir_host::session::{CpuSession, GpuSession, SceneChange, Setup, View};
use restir_host::{Shaders, buffers::SceneBuffers, technique::restir_di::DiSettings};
use restir_shared::layout::FilmPixel;
use std::time::Instant;

const FRAMES: u32 = 16;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let flavour = Flavour::Exact;
    let (device, queue) = pollster::block_on(adapter.request_device(&requirements(&adapter, flavour)?))?;

    let mut scene = Scene::load("cornell")?;
    let setup = Setup::new(SceneBuffers::build_editable(&scene)?, DiSettings::default(), [64, 48]);
    let camera = setup.scene.camera;
    let pipelines = Pipelines::new(&device, flavour, Shaders::Embedded);
    let mut session = GpuSession::new(&device, pipelines, setup.clone())?;
    let mut twin = CpuSession::new(setup, CpuExecutor::new()?)?;

    let start = Instant::now();
    for frame in 0..FRAMES {
        let step = f64::from(frame) / 100.0;
        if let Some(object) = scene.instances.last_mut() {
            object.transform.translation.x += 0.01;
        }
        let camera = Camera { position: camera.position + step, ..camera };
        let view = View { camera: Some(camera), scene: SceneChange::Edited(&scene), ..View::default() };
        let mut encoder = device.create_command_encoder(&Default::default());
        session.frame(&mut encoder, &view)?;
        // here a game would show the image: `session.output()` is a storage buffer, and `copy_to_texture` fills a texture
        queue.submit([encoder.finish()]);
        twin.frame(&view)?;
    }
    let (sender, receiver) = std::sync::mpsc::channel();
    wgpu::util::DownloadBuffer::read_buffer(&device, &queue, &session.output().slice(..), move |result| {
        let _ = sender.send(result.map(|view| view.to_vec()));
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let image: Vec<FilmPixel> = bytemuck::pod_collect_to_vec(&receiver.recv()??);
    let equal = image.iter().zip(twin.pixels()).filter(|(a, b)| a == b).count();
    println!(
        "{}: {FRAMES} frames in {:.2} s, beside those of the CPU",
        adapter.get_info().name,
        start.elapsed().as_secs_f64()
    );
    println!("{equal} of {} pixels of the last one equal the CPU's", image.len());
    if equal != image.len() { Err("an exact frame differs".into()) } else { Ok(()) }
}
