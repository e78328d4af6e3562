//! One reservoir of several: temporal reuse, spatial reuse, or both at once.

use super::domain::{Light, Neighbourhood};
use super::pixel::Pixel;
use super::{
    COMBINE_DIMENSION, DI_AVERAGE_VISIBILITY, DI_FINAL_RAY, DI_MIS_SHIFT, DI_MIS_VISIBILITY, DI_OTHER_FRAME, DI_STILL,
    DI_TARGET_VISIBILITY, DiParams, in_use,
};
use crate::resample::domain::Source;
use crate::resample::merge::{self, Draws, Others, Rules, Uses};
use crate::resample::mis::Mis;
use crate::rng::Rng;
use crate::scene::Frames;
use glam::UVec4;

/// The planes that a combine reads.
#[derive(Clone, Copy)]
pub struct Planes<'a> {
    /// Hits of the pixel's frame.
    pub hits: &'a [UVec4],
    /// Hits of the other reservoirs' frame.
    pub other_hits: &'a [UVec4],
    /// The other reservoirs.
    pub others: &'a [UVec4],
}

/// Combines the reservoir of the pixel `at`, `own`, with others; both are packed. Pixels of another frame see that frame's
/// scene: what a reservoir can produce was decided there.
pub fn combine<F: Frames + Copy>(
    frames: F,
    params: &DiParams,
    flags: u32,
    planes: &Planes<'_>,
    own: UVec4,
    at: [u32; 2],
) -> UVec4 {
    combine_from(frames, params, flags, planes, own, at).0
}

/// As [`combine`], with the pixel that the sample comes from.
#[inline(always)]
pub fn combine_from<F: Frames + Copy>(
    frames: F,
    params: &DiParams,
    flags: u32,
    planes: &Planes<'_>,
    own: UVec4,
    at: [u32; 2],
) -> (UVec4, Source) {
    let light = Light { frames, flags: in_use(flags, &frames.scene(false)) };
    let index = params.grid().index(at);
    let canonical = if light.has(DI_OTHER_FRAME) { own } else { planes.others[index as usize] };
    let hit = planes.hits[index as usize];
    let pixel = Pixel::new(&params.camera, light.flags, params.seed, params.frame, at, hit);
    if !pixel.hit.is_hit() {
        return (canonical, Source { is_other: false, pixel: index });
    }
    let draws = Draws {
        rng: Rng::new(at[0], at[1], params.frame, params.seed),
        dimension: COMBINE_DIMENSION.wrapping_add(params.combine.wrapping_mul(2)),
    };
    let rules = rules(&light, params);
    let (camera, frame) = if light.has(DI_OTHER_FRAME) {
        (params.other_camera, params.other_frame)
    } else {
        (params.camera, params.frame)
    };
    let (grid, seed, planes) = (params.grid(), params.seed, *planes);
    let pixels = Neighbourhood { light, planes, grid, seed, pixel, camera, frame };
    merge::combine(&pixels, &rules, canonical, at, &draws)
}

#[inline(always)]
fn rules<F>(light: &Light<F>, params: &DiParams) -> Rules {
    Rules {
        form: Mis((light.flags >> DI_MIS_SHIFT) & Mis::MASK),
        others: if !light.has(DI_OTHER_FRAME) {
            Others::SameFrame
        } else if light.has(DI_STILL) {
            Others::Unchanged
        } else {
            Others::OtherFrame
        },
        neighbours: params.neighbours,
        radius: params.radius,
        near_radius: params.near_radius,
        similarity: params.similarity(),
        confidence_cap: params.confidence_cap,
        visibility: Uses {
            selection: light.has(DI_TARGET_VISIBILITY),
            mis: light.has(DI_MIS_VISIBILITY),
            forgotten: light.forgets(),
            shading: !light.has(DI_FINAL_RAY),
            mean: light.has(DI_AVERAGE_VISIBILITY),
        },
    }
}
