//! Whole paths by resampling (ReSTIR PT; Lin et al. 2022, "Generalized Resampled Importance Sampling", §7).
//!
//! A path is traced from each pixel by the loop of [`path`](super::path). It finds light many times, at each of its vertices: each time
//! is a [`Candidate`], and one of them is kept, with what [`shift`](crate::shift) has to know to take it to another pixel. In a plane a
//! path takes 64 bytes ([`PackedPath`]). [`shift_job`] takes one path to one pixel.
//!
//! | stream of random numbers | what it decides |
//! |---|---|
//! | 0 | what `path` draws: so the candidates of a pixel are what `path` adds up, bit for bit |
//! | 1 | thresholds of the hybrid shift |

mod candidates;
mod params;
mod record;

pub use candidates::{Candidate, Candidates, Keep};
pub use params::{Job, JobShifted, PT_SOBOL, PtParams};
pub use record::{PackedPath, Stored};

use super::path;
use crate::rng::{self, Rng, Sampler};
use crate::scene::{AddressedLights, Surface, Trace};
use crate::shift::{Joins, Numbers, Shifted, Start, shift};
use glam::{UVec2, UVec3, UVec4};

/// Where the stream of the thresholds begins. Stream 0 is that of `path`.
const JOINS: u32 = rng::stream(1);

/// The random numbers of the path of a pixel.
#[derive(Clone, Copy)]
pub struct PathNumbers {
    rng: Rng,
}

impl PathNumbers {
    /// Those of a pixel and a frame.
    #[inline(always)]
    pub fn new(rng: Rng) -> Self {
        Self { rng }
    }

    /// Those of a path whose [`key`](Self::key) this is.
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

    /// The generator.
    #[inline(always)]
    pub fn rng(&self) -> &Rng {
        &self.rng
    }

    /// Those by which the path samples a light at the vertex of that index.
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
    shift(scene, &numbers, &params.hybrid, start, &path)
}

/// Does one job: the path that it names at the start that it names.
#[inline(always)]
pub fn shift_job<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &PtParams,
    job: Job,
    starts: &[Start],
    paths: &[PackedPath],
) -> JobShifted {
    if job.path == Job::NONE.path {
        return JobShifted::default();
    }
    let shifted = shift_path(scene, params, &paths[job.path as usize], &starts[job.start as usize]);
    JobShifted { value: shifted.value.to_array(), term: shifted.term }
}
