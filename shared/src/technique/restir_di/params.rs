//! What ReSTIR DI puts into buffers: parameters, and records of planes.

use super::stored::PackedReservoir;
use crate::layout::{CameraParams, Extent, FEATURE_CLEAR, SceneHeader};
use crate::num;
use crate::resample::exchange::{Neighbours, PAIRS};
use crate::resample::params::{Flags, LastFrame, ReuseParams, reuses};
use crate::scene::{GivenPlanes, Surface};
use bytemuck::{Pod, Zeroable};
use glam::UVec4;

impl Flags {
    /// Of ReSTIR DI: an initial sample that is occluded has no contribution weight ("visibility reuse").
    pub const INITIAL_VISIBILITY: Self = Self::of_technique(0);
    /// Of ReSTIR DI: samples are selected by their target times visibility.
    pub const TARGET_VISIBILITY: Self = Self::of_technique(1);
    /// Of ReSTIR DI: targets in MIS weights are multiplied by visibility.
    pub const MIS_VISIBILITY: Self = Self::of_technique(2);
    /// Of ReSTIR DI: shading traces a ray. Without it, it takes the visibility that the reservoir has.
    pub const FINAL_RAY: Self = Self::of_technique(3);
    /// Of ReSTIR DI: a combine's visibility is the weighted mean over its inputs, not that of the selected one.
    pub const AVERAGE_VISIBILITY: Self = Self::of_technique(4);
    /// Of ReSTIR DI: one candidate comes from scattering.
    pub const SCATTER_CANDIDATE: Self = Self::of_technique(5);
    /// Of ReSTIR DI: the target is red alone, not the luminance.
    pub const RED: Self = Self::of_technique(6);
    /// Of ReSTIR DI: the target is green alone.
    pub const GREEN: Self = Self::of_technique(7);
    /// Of ReSTIR DI: the target is blue alone.
    pub const BLUE: Self = Self::of_technique(8);
    /// Of ReSTIR DI: light passes straight through clear glass, if the scene has any ([`FEATURE_CLEAR`]).
    pub const TRANSMITTANCE: Self = Self::of_technique(9);
    /// Of ReSTIR DI: candidates from lights come from tiles ([`DiParams::tiles`]).
    pub const TILES: Self = Self::of_technique(10);
    /// Of ReSTIR DI: another technique adds what camera rays see directly, emission and environment.
    pub const PRIMARY_EMISSION_EXTERNAL: Self = Self::of_technique(11);

    /// Without what the scene does not have.
    #[inline(always)]
    pub(super) fn in_use<S: Surface>(self, scene: &S) -> Self {
        if scene.features() & FEATURE_CLEAR == 0 { self.without(Self::TRANSMITTANCE) } else { self }
    }
}

/// Most rounds of candidates after the first ([`DiParams::gloss_renewal`]).
#[doc(hidden)]
pub const MAX_GLOSS_RENEWAL: u32 = 15;

/// Parameters of the kernels of ReSTIR DI.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DiParams {
    /// What all techniques of reuse have in common.
    ///
    /// Of the frame's random numbers candidate i of the first round has those of the sample `frame * candidates + i`, and candidate
    /// `candidates + i` of later ones ([`Self::gloss_renewal`]) those of the sample `2^31 + frame * candidates * MAX_GLOSS_RENEWAL + i`, all
    /// modulo 2^32: before the frame `2^31 / (MAX_GLOSS_RENEWAL * candidates)` no two candidates have the same numbers.
    ///
    /// A combine has at most [`crate::resample::mis::INPUTS`] - 2 neighbours, and looks for them in each pixel; a pass of shading
    /// ([`super::exchange`]) has an even number of at most 2 [`PAIRS`], see [`Self::with_shading`]. `tile` is of no use here, and there is
    /// one layer.
    pub reuse: ReuseParams,
    /// Initial candidates from lights in a round, of which there is one where `gloss_renewal` adds none; at most 4000, so that those of 16 rounds have
    /// random dimensions of their own.
    pub candidates: u32,
    /// Largest distance of a neighbour in pixels.
    pub radius: f32,
    /// A neighbour nearer than this, in pixels, is believed to have the same visibility.
    pub near_radius: f32,
    /// Which of the frame's passes of shading this is, where a pixel is shaded several times, each time by other neighbours, and has the mean. What
    /// [`super::initial`] dropped is counted by the first, 0.
    pub shading_pass: u32,
    /// Candidates from lights in a group, of which one is tested by a ray if its visibility is asked for; 0 for one group a round.
    pub group: u32,
    /// Tiles of presampled candidates, with [`Flags::TILES`]; at most 2^15.
    pub tiles: u32,
    /// Candidates in a tile, with [`Flags::TILES`] from 1 to 2^15.
    pub tile_size: u32,
    /// How fast the confidence of another frame's reservoirs falls where a glossy surface is seen from another direction: the rate of
    /// [`crate::bsdf::Gloss::kept`], 0 for not at all.
    pub gloss_fade: f32,
    /// How many more rounds of candidates [`super::initial`] has where all confidence of the last frame's reservoirs falls away by [`Self::gloss_fade`],
    /// for `other_camera` saw the surface from elsewhere; where a part of it does, it has that part of them, rounded down. At most [`MAX_GLOSS_RENEWAL`];
    /// 0, as [`Self::new`] has it, in a frame that is not combined with the one before it ([`Self::renewed_after`]).
    pub gloss_renewal: f32,
    /// Offsets of a shading pass, as [`super::pair_offsets`] makes them: x in the lower half, y in the upper. Every pixel has the neighbours on
    /// both sides, so that `neighbours` is twice their number.
    pub pairs: [u32; PAIRS],
    /// Where the embedder gives surfaces, in a scene with [`FEATURE_GIVEN`](crate::layout::FEATURE_GIVEN).
    pub given: GivenPlanes,
}

crate::fields!(DiParams: reuse, candidates, radius, near_radius, shading_pass, group, tiles, tile_size, gloss_fade, gloss_renewal, pairs, given);

reuses!(DiParams);

impl Extent for DiParams {
    fn extent(&self) -> [u32; 2] {
        self.reuse.extent()
    }
}

impl DiParams {
    /// Parameters of the first frame of a chain in which every pixel shades its own sample: [`super::primary`], [`super::initial`], then
    /// from the second frame on [`super::combine`] with the last frame ([`Self::with_last`]), [`super::combine`] with neighbours
    /// ([`Self::with_neighbours`]), and [`super::shade`]. [`super::primary`], [`super::initial`] and [`super::shade`] take the frame's parameters as
    /// they are, [`super::initial`] better by [`Self::renewed_after`] where the camera moves. The scene's tables are left out: a scene of other types has none.
    ///
    /// The settings are unbiased:
    ///
    /// | setting | value | what it means |
    /// |---|---|---|
    /// | camera rays | through the centres of pixels | [`Flags::JITTER`] is not set, so that a still view has the same rays in every frame |
    /// | form of MIS | [`Mis::PAIRWISE_DEFENSIVE`](crate::resample::mis::Mis::PAIRWISE_DEFENSIVE) | |
    /// | visibility | [`Flags::INITIAL_VISIBILITY`], [`Flags::TARGET_VISIBILITY`], [`Flags::MIS_VISIBILITY`] | it is part of initial samples, of targets and of MIS weights; shading takes it from the reservoir and traces no ray ([`Flags::FINAL_RAY`]) |
    /// | candidates | `candidates` = 16, `group` = 0, [`Flags::SCATTER_CANDIDATE`] | 16 from lights, of which one is tested by a ray, and one from scattering, for which [`crate::scene::AddressedLights::address_of_hit`] is asked |
    /// | neighbours | `neighbours` = 4, `radius` | within a twenty-fourth of the image's longer side, at least 4 pixels |
    /// | likeness | `max_plane_distance` = 0.02, `min_normal_cos` = 0.5 | who is no neighbour; `near_radius` = 0: none is believed to see the same |
    /// | history | `confidence_cap` = 20 | a reservoir of the last frame counts for at most so many of this one: a larger cap has less noise where nothing moves, and keeps longer what is out of date |
    /// | gloss | `gloss_fade` = 30 | how fast that count falls where a glossy surface is seen from another direction: without, few pixels become very bright where highlights move |
    /// | rounds | `gloss_renewal` = 0 | candidates are drawn in one round; [`Self::renewed_after`] draws more of them where that count falls |
    /// | numbers | [`Flags::SOBOL`] | spread over frames and candidates |
    /// | glass | [`Flags::TRANSMITTANCE`] | costs nothing in a scene without clear glass |
    ///
    /// What may be changed without a second thought: `candidates`, `neighbours`, `radius` and `confidence_cap`.
    pub fn new(camera: CameraParams, [width, height]: [u32; 2], seed: u32) -> Self {
        let reuse = ReuseParams::new(camera, [width, height], seed);
        let flags = reuse.flags
            | Flags::INITIAL_VISIBILITY
            | Flags::TARGET_VISIBILITY
            | Flags::MIS_VISIBILITY
            | Flags::SCATTER_CANDIDATE
            | Flags::TRANSMITTANCE;
        Self {
            reuse: ReuseParams { flags, ..reuse },
            candidates: 16,
            gloss_fade: 30.0,
            radius: num::max(4.0, num::div(width.max(height) as f32, 24.0)),
            ..Self::default()
        }
    }

    /// The parameters of [`super::initial`] in a frame that is combined with the one before it, which `camera` saw: where a glossy surface is seen from
    /// another direction than then, candidates are drawn in up to `most` more rounds, since less of history is left ([`Self::gloss_renewal`]). The
    /// host's renders have 7. Without this call there is one round. A view that has not changed needs no more.
    ///
    /// A round costs as many rays as the first one: drivers limit the time of a dispatch and the rounds of an invocation's loops, which lavapipe does
    /// without a word, so that `1 + most` times `candidates / group` should be at most 64.
    #[doc(hidden)]
    #[must_use]
    pub fn renewed_after(self, camera: CameraParams, most: u32) -> Self {
        let reuse = ReuseParams { other_camera: camera, ..self.reuse };
        Self { reuse, gloss_renewal: most.min(MAX_GLOSS_RENEWAL) as f32, ..self }
    }

    /// The parameters of the combine of a frame with the one before it. Without this call a combine takes the other reservoirs for
    /// neighbours in the same frame.
    #[must_use]
    pub fn with_last(self, last: &LastFrame) -> Self {
        Self { reuse: ReuseParams { neighbours: 0, ..self.reuse.with_last(last) }, ..self }
    }

    /// The parameters of [`super::offer`], [`super::exchange`] and [`super::gather`], by which a pixel is shaded by its own sample and those of up to
    /// `neighbours` others within `radius` pixels, the same offsets for all pixels of the frame.
    #[must_use]
    pub fn with_shading(self, radius: f32, neighbours: u32) -> Self {
        let mut offsets = [0; PAIRS];
        let most = (neighbours as usize / 2).min(PAIRS);
        let pairs = super::pair_offsets(self.seed, self.frame, radius, &mut offsets[..most]);
        self.with_pairs(&offsets[..pairs], self.shading_pass)
    }

    /// The same by the neighbours on both sides at these offsets, at most [`PAIRS`], in the frame's pass of shading of that number.
    #[must_use]
    pub fn with_pairs(self, offsets: &[u32], shading_pass: u32) -> Self {
        let count = offsets.len().min(PAIRS);
        let mut pairs = [0; PAIRS];
        pairs[..count].copy_from_slice(&offsets[..count]);
        let reuse = ReuseParams { neighbours: 2 * count as u32, ..self.reuse };
        Self { reuse, shading_pass, pairs, ..self }
    }

    /// See [`ReuseParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { reuse: self.reuse.specialised(bits), ..self }
    }

    /// The neighbours of a pass of shading.
    #[inline(always)]
    pub(super) fn shading_neighbours(&self) -> Neighbours {
        Neighbours {
            grid: self.grid(),
            count: self.neighbours,
            pairs: self.pairs,
            near_radius: self.near_radius,
            similarity: self.similarity(),
        }
    }

    /// Parameters of what fills the tiles.
    #[doc(hidden)]
    pub fn tile_params(&self) -> TileParams {
        let Self { reuse: ReuseParams { scene, frame, seed, flags, .. }, tile_size, tiles, .. } = *self;
        TileParams { scene, tile_size, tiles, frame, seed, flags, ..TileParams::default() }
    }
}

/// What a pixel shows its neighbours where samples are shaded together; but for the reservoir all zero where nothing is hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DiPoint {
    /// Radiance by way of the pixel's own sample, linear RGB.
    pub radiance: [f32; 3],
    /// The sample's target there, as MIS weights have it.
    pub target: f32,
    /// What the pixel sees.
    pub position: [f32; 3],
    /// Its normal, see [`crate::pack::encode_unit_vector`].
    pub normal: u32,
    /// The pixel's reservoir, which its neighbours evaluate at their own surfaces.
    pub reservoir: PackedReservoir,
}

/// Parameters of the kernel that fills tiles with candidates.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TileParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// Candidates in a tile, at most 2^15.
    pub tile_size: u32,
    /// Tiles, at most 2^15.
    pub tiles: u32,
    /// Index of the frame: its candidates are samples `frame tile_size` and on of their tile.
    pub frame: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// What the pass does: [`Flags::SOBOL`] counts.
    pub flags: Flags,
    /// Zero.
    pub reserved: [u32; 3],
}

crate::fields!(TileParams: scene, tile_size, tiles, frame, seed, flags, reserved);

impl Extent for TileParams {
    fn extent(&self) -> [u32; 2] {
        [self.tile_size, self.tiles]
    }
}

impl TileParams {
    /// As [`DiParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: self.flags.within(bits), ..self }
    }
}

/// A candidate in a tile: a light's address and all that lies there, floats as their bits.
///
/// | word | x, y, z | w |
/// |---|---|---|
/// | 0 | position | index of the light |
/// | 1 | normal | u, in 2^-24 |
/// | 2 | emission | v, in 2^-24 |
/// | 3 | density; offset and extent, or the falloff of a light at a point | kind, + 4 if it is two-sided, + 8 if blended |
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TileWords {
    /// Word 0.
    pub position: UVec4,
    /// Word 1.
    pub normal: UVec4,
    /// Word 2.
    pub emission: UVec4,
    /// Word 3.
    pub rest: UVec4,
}

const _: () = {
    assert!(size_of::<DiParams>() == 404);
    assert!(size_of::<DiPoint>() == 48);
    assert!(size_of::<TileParams>() == 112);
    assert!(size_of::<TileWords>() == 64);
};
