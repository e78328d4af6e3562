//! Renders the Cornell box on the CPU and on a GPU, and compares the two pictures bit for bit.
use restir::prelude::*;

fn main() -> Result<(), Error> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let job = Render { count: 16, ..Render::new([128, 128], PathSettings::default()) };

    let on_cpu = job.render(&scene, &mut CpuExecutor::new()?)?.image;
    let on_gpu = job.render(&scene, &mut GpuExecutor::open()?)?.image;
    assert_eq!(on_cpu.pixels, on_gpu.pixels);
    let file = std::env::temp_dir().join("cornell.exr");
    write_exr(&file, &on_cpu, &[])?;
    println!("the two pictures are the same; {} has them", file.display());
    Ok(())
}
