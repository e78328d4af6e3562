//! One reservoir of several: temporal reuse, spatial reuse, or both at once.

use super::domain::{Light, Neighbourhood};
use super::pixel::Pixel;
use super::{COMBINE_DIMENSION, DiParams, Flags, PackedHit, PackedReservoir};
use crate::resample::domain::Source;
use crate::resample::merge::{self, Combined, Draws, Others, Rules, Uses};
#[cfg(not(target_arch = "spirv"))]
use crate::resample::reproject::Grid;
use crate::scene::Frames;

/// The planes that a combine reads.
#[derive(Clone, Copy, Debug)]
pub struct Planes<'a> {
    /// What each pixel sees in this frame.
    pub hits: &'a [PackedHit],
    /// What each pixel saw in the frame of the other reservoirs: the same plane where they are of this frame.
    pub other_hits: &'a [PackedHit],
    /// The other reservoirs: the last frame's, or those of this frame, among which is the pixel's own.
    pub others: &'a [PackedReservoir],
}

impl Planes<'_> {
    /// # Panics
    /// If a plane has fewer elements than the image has pixels.
    #[cfg(not(target_arch = "spirv"))]
    #[inline(always)]
    pub(super) fn check(&self, grid: Grid) {
        let pixels = grid.width as usize * grid.height as usize;
        let least = self.hits.len().min(self.other_hits.len()).min(self.others.len());
        assert!(least >= pixels, "a plane has {least} elements, and the image {pixels} pixels");
    }
}

/// Combines the reservoir of the pixel `at` with others, and says which pixel the sample comes from. With the last frame
/// ([`Flags::OTHER_FRAME`]) the pixel's reservoir is `own`; with neighbours of the same frame it is taken from `planes.others`, and `own` has no
/// effect. A pixel that sees nothing keeps its reservoir. In the first frame of a chain there is no last one to combine with: leave it out.
///
/// What a reservoir of another frame can produce is what its pixel could see then. So visibility in MIS weights is asked of that
/// frame's scene, `frames.scene(true)`.
///
/// # Panics
/// Natively, if a plane has fewer elements than the image has pixels.
#[inline(always)]
pub fn combine<F: Frames + Copy>(
    frames: F,
    params: &DiParams,
    planes: &Planes<'_>,
    own: PackedReservoir,
    at: [u32; 2],
) -> Combined<PackedReservoir> {
    #[cfg(not(target_arch = "spirv"))]
    planes.check(params.grid());
    let light = Light { frames, flags: params.flags.in_use(&frames.scene(false)) };
    let index = params.grid().index(at);
    let canonical = if light.has(Flags::OTHER_FRAME) { own } else { planes.others[index as usize] };
    let pixel = params.view().pixel(at, planes.hits[index as usize]);
    if !pixel.hit.is_hit() {
        return Combined { reservoir: canonical, source: Source { is_other: false, pixel: index } };
    }
    let rules = rules(&light, params);
    let pixels = neighbourhood(light, params, planes, pixel);
    merge::combine(&pixels, &rules, canonical, at, &draws(params, at))
}

/// The pixels among which one combines.
#[inline(always)]
pub(super) fn neighbourhood<'a, F>(
    light: Light<F>,
    params: &DiParams,
    planes: &Planes<'a>,
    pixel: Pixel,
) -> Neighbourhood<'a, F> {
    Neighbourhood {
        light,
        planes: *planes,
        grid: params.grid(),
        pixel,
        view: params.other_view(),
        gloss_fade: params.gloss_fade,
    }
}

/// The random numbers of a combine of the pixel `at`.
#[inline(always)]
pub(super) fn draws(params: &DiParams, at: [u32; 2]) -> Draws {
    let dimension = COMBINE_DIMENSION.wrapping_add(params.merge.wrapping_mul(2));
    Draws { rng: params.rng(at), dimension }
}

#[inline(always)]
pub(super) fn rules<F>(light: &Light<F>, params: &DiParams) -> Rules {
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
