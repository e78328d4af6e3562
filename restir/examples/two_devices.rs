//! Renders the Cornell box on the CPU and on a GPU, and compares the two pictures bit for bit.
use restir::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir::render::{Render, render};
use restir::{Error, Shaders, buffers::SceneBuffers, image::write_exr, scene::Scene, technique::path::PathSettings};

fn main() -> Result<(), Error> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let picture = Render { count: 16, ..Render::new([128, 128], PathSettings::default()) };
    let image = |device: &mut dyn Executor| Ok::<_, Error>(render(device, &scene, &picture, &mut |_| Ok(()))?.image);

    let on_cpu = image(&mut CpuExecutor::new(None)?)?;
    let on_gpu = image(&mut GpuExecutor::open(None, Flavour::Exact, Shaders::Embedded)?)?;
    assert_eq!(on_cpu.pixels, on_gpu.pixels);
    let file = std::env::temp_dir().join("cornell.exr");
    write_exr(&file, &on_cpu, &[])?;
    println!("the two pictures are the same; {} has them", file.display());
    Ok(())
}
