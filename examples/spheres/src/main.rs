//! Renders the spheres on the CPU and on a GPU, and compares: `cargo xtask shader build --crate examples/spheres --out target/spheres`, then
//! `cargo run --release --bin spheres -- target/spheres spheres.png`.

use restir::advanced::tonemap::{Operator, Tone};
use restir::exec::{CpuExecutor, Executor, Flavour, GpuExecutor};
use restir::image::{Image, write_png};
use restir::{Error, Shaders};
use restir_shared::layout::FilmPixel;
use spheres::native::{path_plan, restir_di_plan};
use std::path::PathBuf;
use std::process::ExitCode;

const SIZE: [u32; 2] = [240, 160];
/// Samples of path tracing, as a power of two, and frames of ReSTIR DI.
const SAMPLES_LOG2: u32 = 4;
const FRAMES: u32 = 8;

fn main() -> ExitCode {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let Some(shaders) = words.next() else {
        eprintln!("error: give the folder of the shaders, and a PNG file if you like");
        return ExitCode::from(2);
    };
    match compare(shaders, words.next()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Whether both devices give the same bits.
fn compare(shaders: PathBuf, png: Option<PathBuf>) -> Result<bool, Error> {
    let mut cpu = CpuExecutor::new()?;
    let mut gpu = GpuExecutor::open()?.reload(Flavour::Exact, Shaders::Folder(shaders.clone()));
    let paths = || path_plan(SIZE, SAMPLES_LOG2, FRAMES - 1);
    let traced = cpu.run(paths()?)?.concat();
    let resampled = cpu.run(restir_di_plan(SIZE, FRAMES)?)?.concat();
    let device = gpu.run(restir_di_plan(SIZE, FRAMES)?)?.concat();
    let differ = [told("path tracing", &traced, &gpu.run(paths()?)?.concat()), told("ReSTIR DI", &resampled, &device)];
    // with the device's own division and roots: were this the same, too, the comparison would see nothing
    let mut fast = gpu.reload(Flavour::Fast, Shaders::Folder(shaders));
    let seen = told("path tracing, fast", &traced, &fast.run(paths()?)?.concat());
    if let Some(png) = png {
        let pixels = bytemuck::cast_slice::<u32, FilmPixel>(&device).iter().map(|pixel| pixel.sum).collect();
        let image = Image { width: SIZE[0], height: SIZE[1], pixels };
        write_png(&png, &Tone { exposure: 0.0, operator: Operator::Aces }.of(&image))?;
    }
    if seen == 0 {
        println!("the device's own arithmetic has the same bits, too: of this comparison nothing follows");
    }
    Ok(differ == [0, 0] && seen > 0)
}

/// How many words differ.
fn told(name: &str, native: &[u32], device: &[u32]) -> usize {
    let differing = native.iter().zip(device).filter(|(a, b)| a != b).count();
    println!("{name}: {differing} of {} words differ", native.len());
    differing + native.len().abs_diff(device.len())
}
