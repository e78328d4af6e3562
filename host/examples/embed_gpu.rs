//! A committed kernel on a Device that this program made with default limits, in buffers that it owns. The result is
//! compared with the kernel's native twin. A device that cannot have the flavour `exact` is refused by a sentence; `fast` is asked for by
//! name: `cargo run --example embed_gpu fast`.
use restir_host::exec::{Flavour, gpu::Pipelines};
use restir_host::{Shaders, buffers::SceneBuffers, scene::Scene};
use restir_kernels::path::path::DESC;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path;
use restir_shared::technique::path::PathParams;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

const SIZE: u32 = 32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: adapter.features() & wgpu::Features::PASSTHROUGH_SHADERS,
        required_limits: wgpu::Limits::default(),
        ..Default::default()
    }))?;

    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let params = PathParams { scene: scene.header, ..PathParams::new(scene.camera.params(SIZE, SIZE), [SIZE; 2], 1) };
    let storage = |contents: &[u8], usage| {
        let usage = wgpu::BufferUsages::STORAGE | usage;
        device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    };
    let none = wgpu::BufferUsages::empty();
    let film_bytes = vec![0; (SIZE * SIZE) as usize * size_of::<FilmPixel>()];
    let film = storage(&film_bytes, wgpu::BufferUsages::COPY_SRC);
    let params_buffer = storage(bytemuck::bytes_of(&params), none);
    let geometry = storage(bytemuck::cast_slice(&scene.geometry), none);
    let attributes = storage(bytemuck::cast_slice(&scene.attributes), none);
    let texels = storage(bytemuck::cast_slice(&scene.texels), none);

    let exact = std::env::args().nth(1).is_none_or(|flavour| flavour != "fast");
    let flavour = if exact { Flavour::Exact } else { Flavour::Fast };
    let mut pipelines = Pipelines::new(&device, flavour, Shaders::Embedded);
    let pipeline = pipelines.get(&DESC, &[scene.features])?;
    let buffers = [&params_buffer, &geometry, &attributes, &texels, &film];
    let entries =
        [0, 1, 2, 3, 4].map(|i| wgpu::BindGroupEntry { binding: i, resource: buffers[i as usize].as_entire_binding() });
    let layout = &pipeline.get_bind_group_layout(0);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        let [x, y, _] = DESC.workgroup;
        pass.dispatch_workgroups(SIZE.div_ceil(x), SIZE.div_ceil(y), 1);
    }
    queue.submit([encoder.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    wgpu::util::DownloadBuffer::read_buffer(&device, &queue, &film.slice(..), move |result| {
        let _ = sender.send(result.map(|view| view.to_vec()));
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let device_film: Vec<FilmPixel> = bytemuck::pod_collect_to_vec(&receiver.recv()??);

    let native = |i: u32| path::pixel(&scene.view(), &params, i % SIZE, i / SIZE);
    let equal = (0..SIZE * SIZE).filter(|&i| native(i) == device_film[i as usize]).count();
    println!(
        "{}: {equal} of {} pixels equal the native ones ({})",
        adapter.get_info().name,
        SIZE * SIZE,
        pipelines.loading()
    );
    if exact && equal != (SIZE * SIZE) as usize { Err("an exact kernel differs".into()) } else { Ok(()) }
}
