//! Paths of neighbours: who shares with whom, and what becomes of it.

use super::params::{Job, JobShifted, PtFacet, PtParams};
use super::record::PackedPath;
use super::{INPUTS_OF_MERGE, MERGES, OFFSETS};
use crate::layout::FilmPixel;
use crate::num;
use crate::resample::exchange;
use crate::resample::mis::{Combine, INPUTS};
use crate::resample::reservoir::Reservoir;
use crate::resample::similar::Facet;
use crate::rng::{self, Rng, Sampler};
use crate::vec::luminance;
use glam::Vec3;

/// The offsets of a pass of neighbours, see [`exchange::pair_offsets`]: those of a frame and a merge.
pub fn pair_offsets(seed: u32, frame: u32, merge: u32, radius: f32, offsets: &mut [u32]) -> usize {
    let words = Rng::new(0, 0, frame, seed, Sampler::Independent).hash(OFFSETS.wrapping_add(merge));
    exchange::pair_offsets([words.x, words.y], radius, offsets)
}

/// The job of the element (x, row) of a grid with a layer for each neighbour: to take the path of the pixel's n-th neighbour to the
/// pixel. There is none if either does not find the other alike. The neighbour's job n ^ 1 is the way back.
#[inline(always)]
pub fn pair(params: &PtParams, facets: &[PtFacet], [x, row]: [u32; 2]) -> Job {
    let neighbours = params.sharing();
    let (n, y) = (row / params.height, row % params.height);
    let pixel = neighbours.grid.index([x, y]);
    let partner = neighbours.partner([x, y], n);
    if partner == Job::NONE.path {
        return Job::NONE;
    }
    let (here, there) = (facets[pixel as usize].facet(), facets[partner as usize].facet());
    let seen = (here.distance > 0.0) & (there.distance > 0.0);
    let alike = neighbours.similarity.holds(&here, &there) & neighbours.similarity.holds(&there, &here);
    if seen & alike { Job { path: partner, start: pixel } } else { Job::NONE }
}

impl PtFacet {
    #[inline(always)]
    fn facet(&self) -> Facet {
        let Self { position, distance, normal, .. } = *self;
        Facet { position: Vec3::from_array(position), normal: Vec3::from_array(normal), distance }
    }
}

/// What a merge reads: of each pixel its path, of each element of the grid of jobs the job and what became of it.
#[derive(Clone, Copy)]
pub struct Shares<'a> {
    /// Paths.
    pub paths: &'a [PackedPath],
    /// Jobs that [`pair`] gave.
    pub jobs: &'a [Job],
    /// What became of them.
    pub shifted: &'a [JobShifted],
}

impl Shares<'_> {
    /// The target of a job's path at its start, in the measure of where the path comes from: times the Jacobian.
    #[inline(always)]
    fn target(&self, job: u32, path: &PackedPath) -> f32 {
        let JobShifted { value, term } = self.shifted[job as usize];
        let jacobian = if term > 0.0 { num::div(term, path.term()) } else { 0.0 };
        luminance(Vec3::from_array(value)) * jacobian
    }
}

/// One path of a pixel's own and those of its neighbours, by pairwise MIS.
#[inline(always)]
pub fn merge(params: &PtParams, shares: &Shares<'_>, at: [u32; 2]) -> PackedPath {
    let neighbours = params.sharing();
    let pixels = params.width * params.height;
    let index = neighbours.grid.index(at);
    let own = shares.paths[index as usize];
    let mut combine = Combine::new(params.form(), params.neighbours as f32);
    let mut jobs = [0; INPUTS];
    let mut count = 0;
    // the pixel itself, then its neighbours
    let mut i = 0;
    while i <= params.neighbours {
        let n = i.wrapping_sub(1);
        let job = if i == 0 { index } else { n * pixels + index };
        let partner = if i == 0 { index } else { shares.jobs[job as usize].path };
        if partner != Job::NONE.path {
            let path = shares.paths[partner as usize];
            let at_source = luminance(path.value());
            let here = if i == 0 { at_source } else { shares.target(job, &path) };
            combine.input(path.confidence(), here * path.contribution_weight());
            combine.target(count, count, at_source);
            if i != 0 {
                combine.target(0, count, here);
                combine.target(count, 0, shares.target((n ^ 1) * pixels + partner, &own));
            }
            jobs[count as usize] = job;
            count += 1;
        }
        i += 1;
    }
    let rng = Rng::new(at[0], at[1], params.frame, params.seed, params.sampler());
    let first = MERGES.wrapping_add(params.merge.wrapping_mul(INPUTS_OF_MERGE));
    let mut reservoir = Reservoir::empty(0);
    i = 0;
    while i < count {
        let u = rng::unit(rng.hash(first.wrapping_add(i)).x);
        reservoir.update(i, combine.weight(i), 1.0, u);
        i += 1;
    }
    let selected = reservoir.sample;
    let job = jobs[selected as usize] as usize;
    let (path, value) = if selected == 0 {
        (own, own.value())
    } else {
        let JobShifted { value, term } = shares.shifted[job];
        let value = Vec3::from_array(value);
        (shares.paths[shares.jobs[job].path as usize].moved(value, term), value)
    };
    path.weighted(reservoir.contribution_weight(1.0, luminance(value)), combine.confidence())
}

/// What a pixel's path sends to the camera, with what needs no path.
#[inline(always)]
pub fn shade(path: &PackedPath, direct: FilmPixel) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + path.value() * path.contribution_weight());
    FilmPixel { dropped: num::min(pixel.dropped + direct.dropped, 1.0), ..pixel }
}
