//! Eight frames of a moving camera, by ReSTIR DI on the CPU, each in a PNG file:
//! `cargo run --release --example frames_to_png -- assets/suzanne.glb`. Without a file it renders a built-in scene.

use restir_host::image::write_png;
use restir_host::scene::{Camera, Scene};
use restir_host::session::{CpuSession, Setup, View};
use restir_host::technique::restir_di::DiSettings;
use restir_host::tonemap::{Operator, Tone};
use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor};

fn main() -> Result<(), Error> {
    let size = [256, 192];
    let mut scene = Scene::load(&std::env::args().nth(1).unwrap_or_else(|| "toys".to_owned()))?;
    // before the light is added, which would be in view otherwise
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let start = *scene.camera.get_or_insert(Camera::framing(scene.bounds(), aspect));
    if !scene.has_light() {
        scene.add_default_light();
    }
    let settings = DiSettings::preset("quality").expect("a preset of that name");
    let setup = Setup::new(SceneBuffers::build(&scene)?, settings, size);
    let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
    let tone = Tone { exposure: 0.0, operator: Operator::Aces };
    for frame in 0..8 {
        let turn = glam::DQuat::from_rotation_y(0.02 * f64::from(frame));
        let camera = Camera { position: start.target + turn * (start.position - start.target), ..start };
        let begun = session.frame(&View { camera: Some(camera), ..View::default() })?;
        let file = std::env::temp_dir().join(format!("frame-{frame}.png"));
        write_png(&file, &tone.of(&session.image()))?;
        println!("{}: history {:?}", file.display(), begun.history);
    }
    Ok(())
}
