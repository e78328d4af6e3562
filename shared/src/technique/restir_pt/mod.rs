//! Whole paths by resampling (ReSTIR PT; Lin et al. 2022, "Generalized Resampled Importance Sampling", §7).
//!
//! A path is traced from each pixel by the loop of [`path`](mod@super::path). It finds light many times, at each of its vertices: each time
//! is a [`Candidate`], and one of them is kept, with what [`shift`](crate::shift) has to know to take it to another pixel. In a plane a
//! path takes 64 bytes ([`PackedPath`]). Pixels share paths in [`mutual`] pairs. The passes:
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`trace`] | | origins: what each pixel sees; surfaces: where that is; paths: one of each pixel's candidates; direct: what the pixel sees to emit |
//! | [`recall`] | the last frame's paths | these, in place, where the scene has changed since |
//! | or [`retrace`], twice | the last frame's paths, and the pixels' own | these with what arrives at their vertices k in the respective other frame |
//! | [`mutual::reproject`] | origins, the last frame's surfaces | requests: for each pixel, where its surface was seen |
//! | [`mutual::answer`], twice | requests, both frames' origins and paths | results: what the last frame's path is at the pixel, and the pixel's in the last frame |
//! | [`mutual::merge`] | paths, requests, results | paths: one of a pixel's own and the last frame's |
//! | [`mutual::pair`] | surfaces | requests: for each pixel and neighbour, whether they share |
//! | [`mutual::answer`] | requests, origins, paths | results: what each request's path is at the pixel |
//! | [`mutual::merge`] | paths, requests, results | paths: one of a pixel's own and its neighbours' |
//! | [`mutual::shade`] | paths, direct | radiance |
//!
//! [`mutual`]: crate::resample::mutual
//! [`mutual::reproject`]: crate::resample::mutual::reproject
//! [`mutual::answer`]: crate::resample::mutual::answer
//! [`mutual::merge`]: crate::resample::mutual::merge
//! [`mutual::shade`]: crate::resample::mutual::shade
//! [`mutual::pair`]: crate::resample::mutual::pair
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
//! use restir_shared::resample::mutual::{Shares, answer, merge, pair, shade};
//! use restir_shared::scene::Still;
//! use restir_shared::technique::restir_pt::{PtParams, trace};
//!
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, [2, 1]);
//! let mut params = PtParams::new(camera, [2, 1], 7);
//! // two pairings in tiles of 2 x 2
//! (params.neighbours, params.tile) = (2, 1);
//! let traced = [0, 1].map(|x| trace(&Floor, &params, [x, 0]));
//! let (origins, paths) = (traced.map(|pixel| pixel.origin), traced.map(|pixel| pixel.path));
//! let layers = params.with_layers();
//! let requests = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|at| pair(&layers, &traced.map(|pixel| pixel.surface), at));
//! let results = requests.map(|request| answer(&Still(&Floor), &layers, request, &origins, &paths));
//! let shares = Shares { records: &paths, requests: &requests, results: &results, returned: &[] };
//! for x in [0, 1] {
//!     let pixel = shade(&merge(&params, &shares, paths[x as usize], [x, 0]).record, traced[x as usize].direct);
//!     assert!((pixel.sum[0] - 1.0).abs() < 2e-3);
//! }
//! ```

mod candidates;
mod initial;
mod params;
mod recall;
mod record;
mod retrace;
mod shift;

// steps of passes
#[doc(hidden)]
pub use candidates::{Candidate, Candidates, Keep};
pub use initial::{Traced, trace, trace_from};
pub use params::PtParams;
pub use recall::recall;
pub use record::PackedPath;
#[doc(hidden)]
pub use record::Stored;
#[doc(hidden)]
pub use retrace::arriving;
pub use retrace::retrace;

use super::path;
use crate::rng::{self, Rng, Sampler};
use crate::shift::{Joins, Numbers};
use glam::{UVec2, UVec3, UVec4};

/// Where the stream of the thresholds begins. Stream 0 is that of `path`.
const JOINS: u32 = rng::stream(1);
/// Where the stream of the selections begins: a dimension each. Streams 3 and 4 are those of [`mutual`](crate::resample::mutual).
const SELECTIONS: u32 = rng::stream(2);

/// The random numbers of the path of a pixel.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
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
