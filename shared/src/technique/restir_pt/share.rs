//! Paths of neighbours: who shares with whom, and what becomes of it.

use super::params::{Job, JobShifted, MAX_NEIGHBOURS, PT_OTHER_FRAME, PT_STILL, PtFacet, PtParams};
use super::record::{MAX_CONFIDENCE, PackedPath};
use super::{INPUTS_OF_MERGE, MERGES, PAIRINGS};
use crate::layout::FilmPixel;
use crate::num;
use crate::resample::mis::{Combine, INPUTS};
use crate::resample::pairing::Pairing;
use crate::resample::reservoir::Reservoir;
use crate::resample::similar::Facet;
use crate::rng::{self, Rng, Sampler};
use crate::vec::luminance;
use glam::Vec3;

/// The job of the element (x, row) of a grid with a layer for each neighbour: to take the path of the pixel's n-th neighbour to the
/// pixel. There is none if either does not find the other alike. The neighbour's job in the same layer is the way back.
#[inline(always)]
pub fn pair(params: &PtParams, facets: &[PtFacet], [x, row]: [u32; 2]) -> Job {
    let (n, y) = (row / params.height, row % params.height);
    let rng = Rng::new(0, 0, params.frame, params.seed, Sampler::Independent);
    let dimension = PAIRINGS.wrapping_add(params.merge.wrapping_mul(MAX_NEIGHBOURS).wrapping_add(n));
    let pairing = Pairing { grid: params.grid(), tile: params.tile, rng, dimension };
    let (pixel, partner) = (pairing.grid.index([x, y]), pairing.partner([x, y]));
    if partner == Job::NONE.path {
        return Job::NONE;
    }
    let (here, there) = (facets[pixel as usize].facet(), facets[partner as usize].facet());
    let seen = (here.distance > 0.0) & (there.distance > 0.0);
    let similarity = params.similarity();
    let alike = similarity.holds(&here, &there) & similarity.holds(&there, &here);
    if seen & alike { Job { path: partner, start: pixel } } else { Job::NONE }
}

impl PtFacet {
    #[inline(always)]
    pub(super) fn facet(&self) -> Facet {
        let Self { position, distance, normal, .. } = *self;
        Facet { position: Vec3::from_array(position), normal: Vec3::from_array(normal), distance }
    }
}

/// What a merge reads: of each pixel the path that others may take, of each element of the grid of jobs the job and what became of it.
#[derive(Clone, Copy)]
pub struct Shares<'a> {
    /// Paths of neighbours, or of another frame.
    pub paths: &'a [PackedPath],
    /// Jobs that [`pair`] or [`reproject`](super::reproject) gave.
    pub jobs: &'a [Job],
    /// What became of them.
    pub shifted: &'a [JobShifted],
    /// What became of them the other way, with another frame.
    pub returned: &'a [JobShifted],
}

/// The target of a path where it was shifted to, in the measure of where it comes from: times the Jacobian.
#[inline(always)]
fn target(shifted: &JobShifted, path: &PackedPath) -> f32 {
    let JobShifted { value, term } = *shifted;
    let jacobian = if term > 0.0 { num::div(term, path.term()) } else { 0.0 };
    luminance(Vec3::from_array(value)) * jacobian
}

/// What a merge has selected.
#[derive(Clone, Copy, Debug)]
pub struct Merged {
    /// The path.
    pub path: PackedPath,
    /// Whether it is another pixel's, or of another frame.
    pub is_other: bool,
    /// Of another's the element of the grid of jobs.
    pub job: u32,
}

/// One path of a pixel's own and those of its neighbours, or of the other frame's at its place, by pairwise MIS.
#[inline(always)]
pub fn merge(params: &PtParams, shares: &Shares<'_>, own: PackedPath, at: [u32; 2]) -> Merged {
    let (crosses, still) = (params.has(PT_OTHER_FRAME), params.has(PT_STILL));
    let pixels = params.width * params.height;
    let index = params.grid().index(at);
    let mut combine = Combine::new(params.form(), params.neighbours as f32);
    let mut jobs = [0; INPUTS];
    let mut count = 0;
    // the pixel itself, then the others
    let mut i = 0;
    while i <= params.neighbours {
        let n = i.wrapping_sub(1);
        let job = if i == 0 { index } else { n * pixels + index };
        let partner = if (i == 0) | still { index } else { shares.jobs[job as usize].path };
        if partner != Job::NONE.path {
            let path = if i == 0 { own } else { shares.paths[partner as usize] };
            let at_source = luminance(path.value());
            let unchanged = (i == 0) | still;
            let here = if unchanged { at_source } else { target(&shares.shifted[job as usize], &path) };
            let most = if crosses & (i != 0) { params.confidence_cap } else { MAX_CONFIDENCE };
            combine.input(num::min(path.confidence(), most), here * path.contribution_weight());
            combine.target(count, count, at_source);
            if i != 0 {
                let back = if still {
                    JobShifted::default()
                } else if crosses {
                    shares.returned[index as usize]
                } else {
                    shares.shifted[(n * pixels + partner) as usize]
                };
                combine.target(0, count, here);
                combine.target(count, 0, target(&back, &own));
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
    let is_other = reservoir.sample != 0;
    let job = jobs[reservoir.sample as usize];
    let path = if !is_other {
        own
    } else if still {
        shares.paths[index as usize]
    } else {
        let JobShifted { value, term } = shares.shifted[job as usize];
        shares.paths[shares.jobs[job as usize].path as usize].moved(Vec3::from_array(value), term)
    };
    let weight = reservoir.contribution_weight(1.0, luminance(path.value()));
    Merged { path: path.weighted(weight, combine.confidence()), is_other, job }
}

/// What a pixel's path sends to the camera, with what needs no path.
#[inline(always)]
pub fn shade(path: &PackedPath, direct: FilmPixel) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + path.value() * path.contribution_weight());
    FilmPixel { dropped: num::min(pixel.dropped + direct.dropped, 1.0), ..pixel }
}
