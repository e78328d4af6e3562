//! One reservoir of several: temporal reuse, spatial reuse, or both at once.

use super::domain::{Light, Neighbourhood};
use super::{COMBINE_DIMENSION, DiParams, Flags, PackedHit, PackedReservoir};
use crate::resample::domain::Source;
use crate::resample::merge::{self, Draws, Others, Rules, Uses};
use crate::scene::Frames;

/// The planes that a combine reads.
#[derive(Clone, Copy)]
pub struct Planes<'a> {
    /// Hits of the pixel's frame.
    pub hits: &'a [PackedHit],
    /// Hits of the other reservoirs' frame.
    pub other_hits: &'a [PackedHit],
    /// The other reservoirs.
    pub others: &'a [PackedReservoir],
}

/// Combines the reservoir of the pixel `at`, `own`, with others, and says which pixel the sample comes from. Pixels of another
/// frame see that frame's scene: what a reservoir can produce was decided there.
#[inline(always)]
pub fn combine<F: Frames + Copy>(
    frames: F,
    params: &DiParams,
    planes: &Planes<'_>,
    own: PackedReservoir,
    at: [u32; 2],
) -> (PackedReservoir, Source) {
    let light = Light { frames, flags: params.flags.in_use(&frames.scene(false)) };
    let index = params.grid().index(at);
    let canonical = if light.has(Flags::OTHER_FRAME) { own } else { planes.others[index as usize] };
    let pixel = params.view().pixel(at, planes.hits[index as usize]);
    if !pixel.hit.is_hit() {
        return (canonical, Source { is_other: false, pixel: index });
    }
    let dimension = COMBINE_DIMENSION.wrapping_add(params.combine.wrapping_mul(2));
    let draws = Draws { rng: params.rng(at), dimension };
    let rules = rules(&light, params);
    let pixels = Neighbourhood { light, planes: *planes, grid: params.grid(), pixel, view: params.other_view() };
    merge::combine(&pixels, &rules, canonical, at, &draws)
}

#[inline(always)]
fn rules<F>(light: &Light<F>, params: &DiParams) -> Rules {
    Rules {
        form: light.flags.form(),
        others: if !light.has(Flags::OTHER_FRAME) {
            Others::SameFrame
        } else if light.has(Flags::STILL) {
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
            selection: light.has(Flags::TARGET_VISIBILITY),
            mis: light.has(Flags::MIS_VISIBILITY),
            forgotten: light.forgets(),
            shading: !light.has(Flags::FINAL_RAY),
            mean: light.has(Flags::AVERAGE_VISIBILITY),
        },
    }
}
