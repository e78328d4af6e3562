//! `cargo lab watertight`: rays from the inside of a closed mesh at its edges and vertices.

use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::Scene;
use restir_shared::geometry::Ray;
use restir_tests::watertight::Closed;

use crate::Error;

/// Parts of the work after which the progress is shown.
const PARTS: u64 = 20;

/// Options of `cargo lab watertight`.
#[derive(Args)]
pub struct Options {
    /// Name of a built-in scene or a glTF file: one closed mesh whose triangles face outwards.
    scene: String,
    /// Take only the mesh of this name.
    #[arg(long)]
    mesh: Option<String>,
    /// How many rays to trace.
    #[arg(long, default_value_t = 100_000_000)]
    rays: u64,
}

/// Traces the rays and says how many escape.
///
/// # Errors
/// [`Error::Failed`] if a ray escapes, [`Error::Host`] if the scene cannot be loaded, [`Error::Environment`] if it is not
/// closed.
pub fn run(options: &Options) -> Result<(), Error> {
    let mut scene = Scene::load(&options.scene)?;
    if let Some(name) = &options.mesh {
        let Scene { instances, meshes, .. } = &mut scene;
        instances.retain(|instance| meshes.get(instance.mesh).is_some_and(|mesh| mesh.name == *name));
    }
    let buffers = SceneBuffers::build(&scene)?;
    let closed = Closed::new(&buffers).map_err(|open| {
        Error::Environment(format!(
            "{} is not closed: {open} edges have triangles on one side only; give a scene of closed meshes, or --mesh",
            options.scene
        ))
    })?;
    let streams = options.rays.div_ceil(Closed::RAYS);
    let start = Instant::now();
    let mut escaped = 0;
    for part in 0..PARTS {
        let range = streams * part / PARTS..streams * (part + 1) / PARTS;
        let end = range.end;
        let escaping: Vec<Ray> = range.into_par_iter().flat_map_iter(|stream| closed.escaping(stream)).collect();
        for ray in &escaping {
            eprintln!("escaped: from {} along {}", ray.origin, ray.direction);
        }
        escaped += escaping.len();
        eprintln!("{:3} %, {} rays, {escaped} escaped", 100 * (part + 1) / PARTS, end * Closed::RAYS);
    }
    println!(
        "{}: {} triangles; {escaped} of {} rays from {streams} points inside escape; {:.0} s",
        options.scene,
        buffers.stats().triangles,
        streams * Closed::RAYS,
        start.elapsed().as_secs_f64()
    );
    if escaped > 0 { Err(Error::Failed(format!("{escaped} rays escape"))) } else { Ok(()) }
}
