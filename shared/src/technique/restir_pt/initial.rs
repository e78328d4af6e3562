//! Initial paths: of all that a traced path finds, one.

use super::candidates::{Candidate, Candidates, Keep};
use super::record::{PackedPath, Stored};
use super::{PathNumbers, PtParams, SELECTIONS};
use crate::camera::camera_ray;
use crate::film::CUT;
use crate::geometry::Ray;
use crate::layout::FilmPixel;
use crate::resample::params::Flags;
use crate::resample::reservoir::Reservoir;
use crate::resample::similar::PackedSurface;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLights, Surface, Trace};
use crate::shift::{Path, PathOrigin};
use crate::technique::path::Walk;
use crate::vec::luminance;
use glam::Vec3;

/// What a pixel's path gives.
#[derive(Clone, Copy, Debug)]
pub struct Traced {
    /// Where all paths of the pixel begin.
    pub origin: PathOrigin,
    /// The surface there.
    pub surface: PackedSurface,
    /// One of its candidates, selected in proportion to its luminance, with a confidence of 1. Its contribution weight is in the
    /// measure of random numbers: the sum of all luminances over its own.
    pub path: PackedPath,
    /// What is seen without any path from the origin on; with [`Flags::INDIRECT_ONLY`] nothing.
    pub direct: FilmPixel,
}

/// Keeps one candidate.
#[derive(Debug)]
struct Selection {
    rng: Rng,
    count: u32,
    /// Paths of up to two segments are not taken.
    indirect: bool,
    reservoir: Reservoir<Candidate, f32>,
    value: Vec3,
    direct: Vec3,
}

impl Keep for Selection {
    #[inline(always)]
    fn candidate(&mut self, value: Vec3, candidate: &Candidate) {
        let u = rng::unit(self.rng.hash(SELECTIONS.wrapping_add(self.count)).x);
        self.count = self.count.wrapping_add(1);
        let taken = !self.indirect | (candidate.path.length > 2);
        let target = if taken { luminance(value) } else { 0.0 };
        if self.reservoir.update(*candidate, target, 1.0, u) {
            self.value = value;
        }
    }

    #[inline(always)]
    fn direct(&mut self, value: Vec3) {
        self.direct = if self.indirect { self.direct } else { self.direct + value };
    }
}

/// Traces the path of the pixel `at`. Its random numbers are those of a sample of `path` with the frame's index.
#[inline(always)]
pub fn trace<S: Trace + Surface + AddressedLights>(scene: &S, params: &PtParams, at: [u32; 2]) -> Traced {
    let [x, y] = at;
    let numbers = PathNumbers::new(params.rng(at));
    let jitter = params.has(Flags::JITTER);
    let ray = camera_ray(&params.camera, jitter, |u| u, scene.features(), numbers.rng(), x, y);
    traced::<_, false>(scene, params, &numbers, ray, PathOrigin::NONE)
}

/// Traces a path on from an `origin`, which is one: a suffix of the paths that lead there.
#[inline(always)]
pub fn trace_from<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &PtParams,
    numbers: &PathNumbers,
    origin: &PathOrigin,
) -> PackedPath {
    traced::<_, true>(scene, params, numbers, origin.ray(), *origin).path
}

/// Traces a path that begins at the end of the ray or, a `SUFFIX`, at the origin.
#[inline(always)]
fn traced<S: Trace + Surface + AddressedLights, const SUFFIX: bool>(
    scene: &S,
    params: &PtParams,
    numbers: &PathNumbers,
    ray: Ray,
    origin: PathOrigin,
) -> Traced {
    let keep = Selection {
        rng: *numbers.rng(),
        count: 0,
        // what goes on from a second vertex has more segments
        indirect: params.has(Flags::INDIRECT_ONLY) & (!SUFFIX | (origin.segments() < 2)),
        reservoir: Reservoir::empty(Candidate::NONE),
        value: Vec3::ZERO,
        direct: Vec3::ZERO,
    };
    let off_edges = !params.has(Flags::JITTER) & !SUFFIX;
    let joins = params.joins(numbers);
    let mut candidates = Candidates::<_, SUFFIX>::new(keep, scene.features(), numbers.key(), joins, off_edges, origin);
    // the segment that leads to the origin is the first of those that are left
    let before = if SUFFIX { origin.segments() - 1 } else { 0 };
    let whole = Walk::new(ray).run(scene, numbers.rng(), params.max_depth - before, false, &mut candidates);
    let Selection { reservoir, value, direct, .. } = candidates.keep;
    let weight = reservoir.contribution_weight(1.0, luminance(value));
    let found = whole & (weight > 0.0);
    let stored = Stored {
        path: if found { reservoir.sample.path(scene, numbers) } else { Path::NONE },
        value,
        contribution_weight: if found { weight } else { 0.0 },
        confidence: 1.0,
    };
    let direct = FilmPixel::from_radiance(if whole { direct } else { CUT });
    Traced { origin: candidates.origin, surface: candidates.surface, path: stored.pack(), direct }
}
