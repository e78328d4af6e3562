//! `cargo xtask unbiased`: z-tests of a technique against an independent estimate of the same picture, tile by tile,
//! over many independent restarts of one sample a pixel.
//!
//! A cell is `<technique>/<scene>`. `path` is tested against the path tracer in `f64` of the harness, which shares no
//! code with it, on scenes of Lambertian surfaces with few triangles; `path-roulette` against `path`, on any scene. The
//! moments are kept in a file after every round, so that a cell can be interrupted and continued, or given more restarts.
//! The file knows the scene and the settings it is of, not the code: after a change of that, begin anew by `--fresh`.
//!
//! `restir-di:<settings>` is tested against `path` with direct light alone, see `direct`; `--di` runs all its cells.

mod direct;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::output::write_atomically;
use restir_host::render::{PathSettings, RenderSettings};
use restir_host::replay;
use restir_host::scene::{Scene, builtin};
use restir_tests::oracle::{Camera, Oracle, Triangle};
use restir_tests::stats::{Moments, TileGrid, TileTest};
use restir_tests::wrong::{Faulty, Throughput};
use serde::{Deserialize, Serialize};

use crate::Error;

const SIZE: u32 = 32;
const TILE: u32 = 8;
const MAX_DEPTH: u32 = 6;
/// How often the test of a cell fails although nothing is wrong.
const FAMILY_RATE: f64 = 1.0e-3;
/// Restarts, if nothing else is asked for.
const RESTARTS: u32 = 16_384;
/// Restarts between two writes of the state.
const ROUND: u32 = 256;
/// Restarts of the reference for each of the technique: it is the noisier of the two.
const REFERENCE_RESTARTS: u32 = 4;
/// Brute force has its limits.
const MAX_ORACLE_TRIANGLES: usize = 500;
const WRONG_THROUGHPUT: f32 = 1.01;
/// Seeds of references lie beyond those of the technique.
const REFERENCE_SEED: u32 = 1 << 31;

/// Options of `cargo xtask unbiased`.
#[derive(Args)]
pub struct Options {
    /// The cell, as `<technique>/<scene>`: path, path-roulette or `restir-di:SETTINGS`, and a built-in scene.
    #[arg(long, required_unless_present = "di", conflicts_with = "di", default_value = "")]
    cell: String,
    /// All cells of ReSTIR DI, and the report on them.
    #[arg(long)]
    di: bool,
    /// With --di: replace docs/restir-di-bias.md.
    #[arg(long, requires = "di")]
    write: bool,
    /// Restarts of the technique in all; 16384 if not given, of ReSTIR DI 512.
    #[arg(long)]
    restarts: Option<u32>,
    /// Folder of the state files; target/unbiased if not given.
    #[arg(long)]
    state: Option<PathBuf>,
    /// Discard the state of the cell.
    #[arg(long)]
    fresh: bool,
    /// Test a known-wrong form, with throughput or, of ReSTIR DI, radiance x 1.01: the test has to fail.
    #[arg(long)]
    wrong: bool,
}

/// What is tested against what.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// `path` against the oracle.
    Oracle,
    /// `path-roulette` against `path`.
    Roulette,
}

struct Cell {
    kind: Kind,
    /// Factor of the tested technique's throughput at every bounce; 1 is right.
    throughput: f32,
    /// Restarts of a round.
    round: u32,
    scene: Scene,
    buffers: SceneBuffers,
}

/// The moments so far; numbers as bits, because a continued cell gives the same verdict as one that ran through.
#[derive(Serialize, Deserialize)]
struct State {
    /// What it is of.
    digest: String,
    /// Restarts of the technique that are done.
    restarts: u32,
    tested: Vec<[u64; 3]>,
    reference: Vec<[u64; 3]>,
}

/// Runs or continues a cell and prints its verdict.
///
/// # Errors
/// [`Error::Failed`] if the expectations differ; [`Error::Environment`] for a cell that does not exist or a state that
/// is of something else; [`Error::Io`] if the state cannot be read or written.
pub fn run(options: &Options) -> Result<(), Error> {
    if options.di {
        return direct::run_matrix(options);
    }
    let direct = options.cell.strip_prefix("restir-di:").and_then(|cell| cell.rsplit_once('/'));
    match direct {
        Some((settings, scene)) => direct::run_cell(options, settings, scene),
        None => run_in_rounds(options, ROUND),
    }
}

/// `round` restarts between two writes of the state.
fn run_in_rounds(options: &Options, round: u32) -> Result<(), Error> {
    let throughput = if options.wrong { WRONG_THROUGHPUT } else { 1.0 };
    let cell = Cell { throughput, round, ..Cell::open(&options.cell)? };
    let path = state_path(options)?;
    let digest = cell.digest()?;
    let mut state = if options.fresh { State::new(digest) } else { State::load(&path, digest)? };
    let start = Instant::now();
    let restarts = options.restarts.unwrap_or(RESTARTS).max(1).next_multiple_of(round);
    while state.restarts < restarts {
        cell.round(&mut state)?;
        save(&state, &path)?;
        eprintln!("{} of {} restarts, {:.0} s", state.restarts, restarts, start.elapsed().as_secs_f64());
    }
    report(options, &state)
}

fn report(options: &Options, state: &State) -> Result<(), Error> {
    let (tested, reference) = (moments(&state.tested), moments(&state.reference));
    let verdict = TileTest { grid: grid(), family_rate: FAMILY_RATE }.compare(&tested, &reference);
    let wrong = if options.wrong { format!(", throughput x {WRONG_THROUGHPUT}") } else { String::new() };
    println!("{}{wrong}: {SIZE} x {SIZE} pixels, depth {MAX_DEPTH}, {} restarts", options.cell, state.restarts);
    println!("false-alarm rate of the family {FAMILY_RATE}, power 99 %: {verdict}");
    print_tiles(&tested, &reference);
    if verdict.passed() { Ok(()) } else { Err(Error::Failed(format!("{}{wrong} is biased: {verdict}", options.cell))) }
}

fn print_tiles(tested: &[Moments], reference: &[Moments]) {
    println!("largest |z| of each tile's channels:");
    let largest = z_scores(tested, reference);
    let (tiles, _) = largest.split_at(largest.len() - 1);
    for row in tiles.chunks(grid_columns()) {
        println!("{}", row.iter().map(|z| format!("{z:6.2}")).collect::<String>());
    }
    println!("{} of {} tiles beyond 3", tiles.iter().filter(|z| **z > 3.0).count(), tiles.len());
}

fn grid() -> TileGrid {
    TileGrid { width: SIZE, height: SIZE, tile: TILE }
}

fn grid_columns() -> usize {
    (SIZE / TILE) as usize
}

/// The largest |z| over the three channels of each tile, then of the image.
fn z_scores(tested: &[Moments], reference: &[Moments]) -> Vec<f64> {
    let z = |(a, b): (&Moments, &Moments)| {
        let error = (a.variance_of_mean() + b.variance_of_mean()).sqrt();
        if a.mean() == b.mean() { 0.0 } else { ((a.mean() - b.mean()) / error).abs() }
    };
    let all: Vec<f64> = tested.iter().zip(reference).map(z).collect();
    all.chunks(3).map(|channels| channels.iter().copied().fold(0.0, f64::max)).collect()
}

impl Cell {
    fn open(name: &str) -> Result<Self, Error> {
        let unknown = || {
            let scenes: Vec<&str> = builtin::NAMES.iter().map(|(name, _)| *name).collect();
            let scenes = scenes.join(", ");
            Error::Environment(format!(
                "there is no cell {name}; it is path/<scene>, path-roulette/<scene> or restir-di:<settings>/<scene> of \
                 {scenes}"
            ))
        };
        let (technique, scene) = name.split_once('/').ok_or_else(unknown)?;
        let kind = match technique {
            "path" => Kind::Oracle,
            "path-roulette" => Kind::Roulette,
            _ => return Err(unknown()),
        };
        let scene = builtin::scene(scene).ok_or_else(unknown)?;
        let triangles: usize = scene.instances.iter().map(|i| scene.meshes[i.mesh].indices.len()).sum();
        if kind == Kind::Oracle && triangles > MAX_ORACLE_TRIANGLES {
            return Err(Error::Environment(format!(
                "{name}: {triangles} triangles are too many for brute force, which takes {MAX_ORACLE_TRIANGLES}; test \
                 path-roulette/{}",
                scene.name
            )));
        }
        let buffers = SceneBuffers::build(&scene).map_err(environment)?;
        Ok(Self { kind, throughput: 1.0, round: ROUND, scene, buffers })
    }

    fn settings(roulette: bool) -> RenderSettings {
        let path = PathSettings { max_depth: MAX_DEPTH, jitter: true, roulette };
        RenderSettings { width: SIZE, height: SIZE, samples: 1, seed: 0, path, dispatch_samples: None }
    }

    fn digest(&self) -> Result<String, Error> {
        let params = path::params(&self.buffers, &Self::settings(false), 0).map_err(environment)?;
        let mut hasher = blake3::Hasher::new();
        let arenas = [&self.buffers.geometry, &self.buffers.attributes];
        hasher.update(
            &arenas.iter().flat_map(|words| words.iter().flat_map(|word| word.to_le_bytes())).collect::<Vec<_>>(),
        );
        hasher.update(
            format!("{params:?} {:?} {} {TILE} {} {REFERENCE_RESTARTS}", self.kind, self.throughput, self.round)
                .as_bytes(),
        );
        Ok(hasher.finalize().to_hex().to_string())
    }

    /// Adds a round to both sides.
    fn round(&self, state: &mut State) -> Result<(), Error> {
        let first = state.restarts;
        let tested = self.trace(self.kind == Kind::Roulette, self.throughput, self.round, first)?;
        let (count, from) = (self.round * REFERENCE_RESTARTS, first * REFERENCE_RESTARTS);
        let reference = match self.kind {
            Kind::Roulette => self.trace(false, 1.0, count, REFERENCE_SEED + from)?,
            Kind::Oracle => {
                let oracle = oracle(&self.scene, &self.buffers);
                grid().moments(count, |restart, x, y| oracle.pixel(from + restart, x, y))
            }
        };
        state.tested = merged(&state.tested, tested);
        state.reference = merged(&state.reference, reference);
        state.restarts += self.round;
        Ok(())
    }

    /// Moments of the technique's images; a restart is a seed.
    fn trace(&self, roulette: bool, throughput: f32, restarts: u32, seed: u32) -> Result<Vec<Moments>, Error> {
        let params = path::params(&self.buffers, &Self::settings(roulette), 0).map_err(environment)?;
        let scene = Faulty { scene: self.buffers.view(), fault: Throughput(throughput) };
        Ok(grid().moments(restarts, |restart, x, y| {
            let mut params = params;
            params.seed = seed + restart;
            path::trace(&scene, &params, x, y).sum.map(f64::from)
        }))
    }
}

/// The scene in the oracle's form. It knows Lambertian surfaces only.
fn oracle(scene: &Scene, buffers: &SceneBuffers) -> Oracle {
    let wide = |v: [f32; 3]| v.map(f64::from);
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let material = &scene.materials[mesh.material];
        // rounded, as in the arenas
        let position = |i: u32| {
            let local = DVec3::from_array(wide(mesh.positions[i as usize]));
            wide(instance.transform.transform_point3(local).as_vec3().to_array())
        };
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        triangles.extend(mesh.indices.iter().map(|&[a, b, c]| Triangle {
            vertices: (if mirrored { [a, c, b] } else { [a, b, c] }).map(position),
            reflectance: wide(material.base_color),
            emission: wide(material.emission),
            two_sided: material.two_sided_emission,
        }));
    }
    let camera = buffers.camera.params(SIZE, SIZE);
    let camera = Camera {
        position: wide(camera.position),
        forward: wide(camera.forward),
        right: wide(camera.right),
        up: wide(camera.up),
        size: [SIZE; 2],
    };
    Oracle::new(triangles, camera, MAX_DEPTH, true)
}

fn moments(bits: &[[u64; 3]]) -> Vec<Moments> {
    bits.iter().map(|bits| Moments::from_parts(bits.map(f64::from_bits))).collect()
}

fn merged(before: &[[u64; 3]], round: Vec<Moments>) -> Vec<[u64; 3]> {
    let before = if before.is_empty() { vec![Moments::default(); round.len()] } else { moments(before) };
    before.into_iter().zip(round).map(|(a, b)| a.merge(b).parts().map(f64::to_bits)).collect()
}

impl State {
    fn new(digest: String) -> Self {
        Self { digest, restarts: 0, tested: Vec::new(), reference: Vec::new() }
    }

    fn load(path: &Path, digest: String) -> Result<Self, Error> {
        if !path.exists() {
            return Ok(Self::new(digest));
        }
        let text = std::fs::read_to_string(path).map_err(Error::io("read", path))?;
        let state: Option<Self> = serde_json::from_str(&text).ok();
        let numbers = 3 * (grid_columns() * grid_columns() + 1);
        let complete = |state: &Self| state.tested.len() == numbers && state.reference.len() == numbers;
        state.filter(|state| state.digest == digest && complete(state)).ok_or_else(|| {
            Error::Environment(format!("{} is of another scene or version; discard it by --fresh", path.display()))
        })
    }
}

fn save(state: &impl Serialize, path: &Path) -> Result<(), Error> {
    let write = |file: &mut std::io::BufWriter<&std::fs::File>| Ok(serde_json::to_writer(file, state)?);
    write_atomically(path, write).map_err(environment)
}

/// Where the states are.
fn folder(options: &Options) -> Result<PathBuf, Error> {
    let target = || {
        let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("target");
        std::env::var_os("CARGO_TARGET_DIR").map_or(workspace, PathBuf::from).join("unbiased")
    };
    let folder = options.state.clone().unwrap_or_else(target);
    std::fs::create_dir_all(&folder).map_err(Error::io("create", &folder))?;
    Ok(folder)
}

fn state_path(options: &Options) -> Result<PathBuf, Error> {
    let wrong = if options.wrong { "-wrong" } else { "" };
    Ok(folder(options)?.join(format!("{}{wrong}.json", options.cell.replace('/', "-"))))
}

fn environment(error: restir_host::Error) -> Error {
    Error::Environment(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Short ones, of a single task.
    const SHORT: u32 = 64;

    pub(super) fn options(cell: &str, folder: &Path, rounds: u32) -> Options {
        let state = Some(folder.to_owned());
        let restarts = Some(rounds * SHORT);
        Options { cell: cell.to_owned(), di: false, write: false, restarts, state, fresh: false, wrong: false }
    }

    #[test]
    fn a_cell_that_was_interrupted_ends_as_one_that_ran_through() {
        let [through, stopped] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let run = |folder: &tempfile::TempDir, rounds| {
            run_in_rounds(&options("path-roulette/furnace", folder.path(), rounds), SHORT).unwrap();
        };
        run(&through, 2);
        run(&stopped, 1);
        run(&stopped, 2);
        let state = |folder: &tempfile::TempDir| {
            std::fs::read_to_string(folder.path().join("path-roulette-furnace.json")).unwrap()
        };
        assert_eq!(state(&through), state(&stopped));
    }

    #[test]
    fn a_wrong_technique_is_biased() {
        let folder = tempfile::tempdir().unwrap();
        let wrong = Options { wrong: true, ..options("path/furnace", folder.path(), 1) };
        assert!(matches!(run_in_rounds(&wrong, SHORT), Err(Error::Failed(_))));
    }

    #[test]
    fn cells_and_states_that_do_not_fit_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for cell in ["path", "path/teapot", "magic/cornell"] {
            let message = run(&options(cell, folder.path(), 1)).unwrap_err().to_string();
            assert!(message.contains(cell) && message.contains("cornell-mitsuba"), "{message}");
        }
        std::fs::write(folder.path().join("path-cornell.json"), "{}").unwrap();
        let message = run(&options("path/cornell", folder.path(), 1)).unwrap_err().to_string();
        assert!(message.contains("--fresh"), "{message}");
    }
}
