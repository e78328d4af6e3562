//! `cargo lab walks`: walks inside of white bodies, which have to come out again.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use restir_host::scene::{Mesh, Scene, builtin};
use restir_shared::glam::DVec3;
use restir_shared::technique::path::media::MAX_WALK;
use restir_tests::white_bodies::{Border, Lost, lost, scene};

use crate::Error;
use crate::report::{judge, publish};

/// Pictures that one task makes.
const PICTURES: u32 = 8;
/// Tasks between two looks at the count.
const TASKS: u32 = 64;
/// How many walks of a million may be lost.
const PER_MILLION: u64 = 1;

/// How light passes the surfaces of the bodies.
const BORDERS: [(Border, &str); 3] =
    [(Border::Lambert, "Lambert"), (Border::Dielectric(1.4), "dielectric"), (Border::Clear, "clear")];

/// Options of `cargo lab walks`.
#[derive(Args)]
pub struct Options {
    /// How many walks there are in each body.
    #[arg(long, default_value_t = 25_000_000)]
    walks: u64,
    /// A glTF file whose first mesh is closed, beside a sphere, a cube and the built-in statue.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Write the report to docs/walks.md.
    #[arg(long)]
    write: bool,
}

/// Walks through all bodies and says how many walks are lost.
///
/// # Errors
/// [`Error::Failed`] if more than one in a million is lost, [`Error::Host`] if the file cannot be loaded.
pub fn run(options: &Options) -> Result<(), Error> {
    let bare = |mesh: &Mesh| Mesh {
        normals: Vec::new(),
        uvs: Vec::new(),
        second_uvs: Vec::new(),
        tangents: Vec::new(),
        ..mesh.clone()
    };
    let first = |scene: Scene| scene.meshes.first().map(|mesh| bare(mesh));
    let mut bodies = vec![
        ("sphere".to_owned(), bare(&Mesh::sphere(DVec3::ZERO, 1.0, 5))),
        ("cube".to_owned(), Mesh::cuboid(DVec3::splat(-0.5), DVec3::splat(0.5))),
    ];
    bodies.extend(builtin::scene("statue").and_then(first).map(|mesh| ("statue".to_owned(), mesh)));
    if let Some(path) = &options.mesh {
        bodies.extend(first(Scene::open(path)?).map(|mesh| (path.display().to_string(), mesh)));
    }
    let (mut report, mut failed) = (head(options), Vec::new());
    for (name, mesh) in bodies {
        for (border, boundary) in BORDERS {
            let start = Instant::now();
            let Lost { walks, scatterings, cut, leaked, lost, .. } = walks(mesh.clone(), border, options.walks)?;
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("{name}, {boundary}: {seconds:.0} s");
            report += &format!(
                "| {name} | {boundary} | {walks} | {scatterings} | {cut} | {leaked} | {lost} | {seconds:.0} |\n"
            );
            if 1_000_000 * (lost + leaked) > PER_MILLION * walks {
                failed.push(format!("{name}, {boundary}"));
            }
        }
    }
    publish("walks", &report, options.write)?;
    judge("more than one walk in a million was lost", failed)
}

fn head(Options { walks, mesh, .. }: &Options) -> String {
    let mesh = mesh.as_ref().map(|path| format!(" --mesh {}", path.display())).unwrap_or_default();
    format!(
        "# Walks that do not come out again\n\nMade by `cargo lab walks --walks {walks}{mesh} --write`: white bodies that are ten mean free paths large, under a \
         white sky. Each walk has to leave its body by crossing the surface. *Too long* are those that were ended after {MAX_WALK} segments. \
         What *came back from outside* met the front of the surface that it was behind: it had left without crossing it, by rounding. *Lost* are samples that found no light at \
         all. Of a million walks at most {PER_MILLION} may be lost or come back; the seconds are those of a machine with other work.\n\n\
         | body | boundary | walks | collisions | too long | came back from outside | lost | seconds |\n|---|---|---:|---:|---:|---:|---:|---:|\n"
    )
}

/// In bodies that are ten mean free paths large.
fn walks(mesh: Mesh, border: Border, walks: u64) -> Result<Lost, Error> {
    let positions = mesh.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let (lo, hi) = positions.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let body = scene(mesh, (0.1 * (hi - lo).length()) as f32, border)?;
    let (mut sum, mut next) = (Lost::default(), 0);
    while sum.walks < walks {
        let tasks: Vec<Lost> = (next..next + TASKS)
            .into_par_iter()
            .map(|task| lost(&body, PICTURES, task * PICTURES))
            .collect::<Result<_, _>>()?;
        sum = tasks.into_iter().fold(sum, Lost::merge);
        next += TASKS;
    }
    Ok(sum)
}
