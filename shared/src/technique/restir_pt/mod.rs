//! Whole paths by resampling (ReSTIR PT; Lin et al. 2022, "Generalized Resampled Importance Sampling", §7).
//!
//! A path is traced from each pixel by the loop of [`path`](mod@super::path). It finds light many times, at each of its vertices: each time
//! is a [`Candidate`], and one of them is kept, with what [`shift`](crate::shift) has to know to take it to another pixel. In a plane a
//! path takes 64 bytes ([`PackedPath`]). Pixels share paths in random pairs ([`pairing`](crate::resample::pairing)), and with as many
//! pairings as they have neighbours. What a pixel's path is at a neighbour is what the neighbour may select, and what the pixel weighs its own
//! path by. So a neighbour costs one shift. The passes:
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`trace`] | | starts: what each pixel sees; facets: the surface there; paths: one of each pixel's candidates; direct: what the pixel sees to emit |
//! | [`recall`] | the last frame's paths | these, in place, where the scene has changed since |
//! | or [`retrace`], twice | the last frame's paths, and the pixels' own | these with what arrives at their vertices k in the respective other frame |
//! | [`reproject`] | starts, the last frame's facets | jobs: for each pixel, where its surface was seen |
//! | [`shift_job`], twice | jobs, both frames' starts and paths | what the last frame's path is at the pixel, and the pixel's in the last frame |
//! | [`merge`] | paths, jobs, what became of them | paths: one of a pixel's own and the last frame's |
//! | [`pair`] | facets | jobs: for each pixel and neighbour, whether they share |
//! | [`shift_job`] | jobs, starts, paths | what each job's path is at the pixel: 16 bytes |
//! | [`merge`] | paths, jobs, what became of them | paths: one of a pixel's own and its neighbours' |
//! | [`shade`] | paths, direct | radiance |
//!
//! | stream of random numbers | what it decides |
//! |---|---|
//! | 0 | what `path` draws: so the candidates of a pixel are what `path` adds up, bit for bit |
//! | 1 | thresholds of the hybrid shift |
//! | 2 | which candidate is kept |
//! | 3 | which neighbour's path is kept |
//! | 4 | who is paired with whom |
//!
//! Two pixels that share their paths with each other. (`Floor` is the scene that the documentation of [`scene`](crate::scene) shows.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::scene::Still;
//! use restir_shared::technique::restir_pt::{PtParams, Shares, merge, pair, shade, shift_job, trace};
//!
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, [2, 1]);
//! // two pairings in tiles of 2 x 2
//! let params = PtParams { neighbours: 2, tile: 1, ..PtParams::new(camera, [2, 1], 7) };
//! let traced = [0, 1].map(|x| trace(&Floor, &params, [x, 0]));
//! let (starts, paths) = (traced.map(|pixel| pixel.start), traced.map(|pixel| pixel.path));
//! let jobs = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|at| pair(&params.with_jobs(), &traced.map(|pixel| pixel.facet), at));
//! let shifted = jobs.map(|job| shift_job(&Still(&Floor), &params.with_jobs(), job, &starts, &paths));
//! let shares = Shares { paths: &paths, jobs: &jobs, shifted: &shifted, returned: &[] };
//! for x in [0, 1] {
//!     let pixel = shade(&merge(&params, &shares, paths[x as usize], [x, 0]).path, traced[x as usize].direct);
//!     assert!((pixel.sum[0] - 1.0).abs() < 2e-3);
//! }
//! ```

mod candidates;
mod initial;
mod params;
mod recall;
mod record;
mod retrace;
mod share;

pub use candidates::{Candidate, Candidates, Keep};
pub use initial::{Traced, trace};
pub use params::{
    Job, JobShifted, MAX_NEIGHBOURS, PT_BACK, PT_CHANGED, PT_INDIRECT, PT_JITTER, PT_OTHER_FRAME, PT_SOBOL, PT_STILL,
    PT_TAKES_ALL, PtFacet, PtParams,
};
pub use recall::{recall, reproject};
pub use record::{PackedPath, Stored};
pub use retrace::{arriving, retrace};
pub use share::{Merged, Shares, merge, pair, shade};

use super::path;
use crate::num;
use crate::rng::{self, Rng, Sampler};
use crate::scene::{AddressedLights, Frames, Surface, Trace};
use crate::shift::{Joins, Numbers, Shifted, Start, shift};
use glam::{UVec2, UVec3, UVec4};

/// Where the stream of the thresholds begins. Stream 0 is that of `path`.
const JOINS: u32 = rng::stream(1);
/// Where the stream of the selections begins: a dimension each.
const SELECTIONS: u32 = rng::stream(2);
/// Where the stream of the merges begins.
const MERGES: u32 = rng::stream(3);
/// Dimensions of a merge.
const INPUTS_OF_MERGE: u32 = 16;
/// Where the stream of the pairings begins: a dimension for each neighbour of each pass of a frame.
const PAIRINGS: u32 = rng::stream(4);

/// The random numbers of the path of a pixel.
#[derive(Clone, Copy)]
pub struct PathNumbers {
    rng: Rng,
}

impl PathNumbers {
    /// The random numbers of a pixel and a frame.
    #[inline(always)]
    pub fn new(rng: Rng) -> Self {
        Self { rng }
    }

    /// The random numbers of a path whose [`key`](Self::key) this is.
    #[inline(always)]
    pub fn of_key(key: UVec2, seed: u32, sampler: Sampler) -> Self {
        Self { rng: Rng::from_key(UVec3::new(key.x, key.y, seed), sampler) }
    }

    /// What a path has to keep of them: the pixel and the frame. The seed and the sampler are those of all paths.
    #[inline(always)]
    pub fn key(&self) -> UVec2 {
        let key = self.rng.key();
        UVec2::new(key.x, key.y)
    }

    /// The random numbers of the pixel's path.
    #[inline(always)]
    pub fn rng(&self) -> &Rng {
        &self.rng
    }

    /// The numbers by which the path samples a light at the vertex of that index.
    #[inline(always)]
    pub fn light(&self, vertex: u32) -> UVec4 {
        path::Numbers::at(&self.rng, vertex).light()
    }
}

impl Numbers for PathNumbers {
    #[inline(always)]
    fn scatter(&self, vertex: u32) -> UVec4 {
        path::Numbers::at(&self.rng, vertex).scatter()
    }

    #[inline(always)]
    fn joins(&self) -> UVec4 {
        self.rng.hash(JOINS)
    }
}

impl PtParams {
    /// The thresholds of a path.
    #[inline(always)]
    pub fn joins(&self, numbers: &PathNumbers) -> Joins {
        self.hybrid.of_path(numbers.joins())
    }
}

/// Shifts a stored path to a start.
#[inline(always)]
pub fn shift_path<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &PtParams,
    path: &PackedPath,
    start: &Start,
) -> Shifted {
    let path = path.unpack().path;
    let numbers = PathNumbers::of_key(path.key, params.seed, params.sampler());
    shift(scene, &numbers, &params.hybrid, start, &path, params.has(PT_CHANGED))
}

/// Does one job, in 16 bytes: see [`shifted_job`].
#[inline(always)]
pub fn shift_job<F: Frames>(
    frames: &F,
    params: &PtParams,
    job: Job,
    starts: &[Start],
    paths: &[PackedPath],
) -> JobShifted {
    if job.path == Job::NONE.path {
        return JobShifted::default();
    }
    let Shifted { value, term, .. } = shifted_job(frames, params, job, starts, paths);
    JobShifted { value: value.to_array(), term }
}

/// Does one job that is none of [`Job::NONE`]: takes the path that it names to the start that it names; with [`PT_BACK`] the path of the
/// pixel that the job is of to the start of the other frame.
#[inline(always)]
pub fn shifted_job<F: Frames>(
    frames: &F,
    params: &PtParams,
    job: Job,
    starts: &[Start],
    paths: &[PackedPath],
) -> Shifted {
    let back = params.has(PT_BACK);
    let (from, to) = if back { (job.start, job.path) } else { (job.path, job.start) };
    let mut path = paths[from as usize].unpack().path;
    let mut extent = 1.0;
    let changed = params.has(PT_CHANGED);
    if back & changed {
        // what comes the other way has been recalled
        extent = recall::carry(frames, params, false, &mut path);
    }
    let numbers = PathNumbers::of_key(path.key, params.seed, params.sampler());
    let shifted = shift(&frames.scene(back), &numbers, &params.hybrid, &starts[to as usize], &path, changed);
    Shifted { term: num::flush(shifted.term * extent), ..shifted }
}
