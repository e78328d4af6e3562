//! What ReSTIR DI puts into buffers: parameters, and records of planes.

use super::stored::PackedReservoir;
use crate::layout::{CameraParams, Extent, FEATURE_CLEAR, SceneHeader};
use crate::num;
use crate::resample::exchange::{Neighbours, PAIRS};
use crate::resample::mis::Mis;
use crate::resample::reproject::Grid;
use crate::resample::similar::Similarity;
use crate::rng::Sampler;
use crate::scene::Surface;
use bytemuck::{Pod, Zeroable};
use core::ops::BitOr;
use glam::UVec4;

/// What a pass does: a set of flags, and a form of MIS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Flags(u32);

impl Flags {
    /// Camera rays are spread uniformly over the pixel.
    pub const JITTER: Self = Self(1);
    /// An initial sample that is occluded has no contribution weight ("visibility reuse").
    pub const INITIAL_VISIBILITY: Self = Self(1 << 1);
    /// Samples are selected by their target times visibility.
    pub const TARGET_VISIBILITY: Self = Self(1 << 2);
    /// Targets in MIS weights are multiplied by visibility.
    pub const MIS_VISIBILITY: Self = Self(1 << 3);
    /// Shading traces a ray. Without it, it takes the visibility that the reservoir has.
    pub const FINAL_RAY: Self = Self(1 << 4);
    /// A combine's visibility is the weighted mean over its inputs, not that of the selected one.
    pub const AVERAGE_VISIBILITY: Self = Self(1 << 5);
    /// One candidate comes from scattering.
    pub const SCATTER_CANDIDATE: Self = Self(1 << 6);
    /// A combine takes the other reservoirs from another frame; the first of them is at the place that the camera of that frame
    /// saw the surface. Without this flag they are of the same frame, and the pixel's own, the canonical one, is among them.
    pub const OTHER_FRAME: Self = Self(1 << 7);
    /// The target is red alone, not the luminance.
    pub const RED: Self = Self(1 << 8);
    /// The target is green alone.
    pub const GREEN: Self = Self(1 << 9);
    /// The target is blue alone.
    pub const BLUE: Self = Self(1 << 10);
    /// Light passes straight through clear glass, if the scene has any ([`FEATURE_CLEAR`]).
    pub const TRANSMITTANCE: Self = Self(1 << 11);
    /// In a combine with another frame, without neighbours, every pixel has the same camera ray in both frames, and the scene is the same.
    /// Both reservoirs are the pixel's own then, and the visibility that they have is its own.
    pub const STILL: Self = Self(1 << 12);
    /// Candidates from lights come from tiles ([`DiParams::tiles`]).
    pub const TILES: Self = Self(1 << 13);
    /// Numbers are drawn by [`Sampler::Sobol`].
    pub const SOBOL: Self = Self(1 << 14);
    /// What camera rays see directly, emission and environment, is left out: somebody else adds it.
    pub const SEEN_APART: Self = Self(1 << 15);
    /// Position of the bits of [`Mis`].
    const MIS_SHIFT: u32 = 16;

    /// These flags but for those in `others`.
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// No flag but a form of MIS. To replace the form of other flags is for [`Self::with_form`]: `|` would mix the two.
    pub const fn of_form(form: Mis) -> Self {
        Self(form.bits() << Self::MIS_SHIFT)
    }

    /// These flags with a form of MIS in place of their own. The cost of [`Mis::PAIRWISE_DEFENSIVE`] grows with the
    /// number of neighbours, that of [`Mis::TALBOT`] with the square of that number.
    #[must_use]
    pub const fn with_form(self, form: Mis) -> Self {
        Self(self.0 & ((1 << Self::MIS_SHIFT) - 1) | Self::of_form(form).0)
    }

    /// The form of MIS.
    #[inline(always)]
    pub fn form(self) -> Mis {
        Mis::from_bits(self.0 >> Self::MIS_SHIFT)
    }

    /// Whether a flag is set.
    #[inline(always)]
    pub fn contains(self, flag: Self) -> bool {
        self.0 & flag.0 != 0
    }

    /// How samples are spread over frames and candidates.
    #[inline(always)]
    pub fn sampler(self) -> Sampler {
        if self.contains(Self::SOBOL) { Sampler::Sobol } else { Sampler::Independent }
    }

    /// The word, to which a kernel is specialised.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Without what the scene does not have.
    #[inline(always)]
    pub(super) fn in_use<S: Surface>(self, scene: &S) -> Self {
        if scene.features() & FEATURE_CLEAR == 0 { self.without(Self::TRANSMITTANCE) } else { self }
    }
}

impl BitOr for Flags {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Most rounds of candidates after the first ([`DiParams::gloss_renewal`]).
pub const MAX_GLOSS_RENEWAL: u32 = 15;

/// Parameters of the kernels of ReSTIR DI.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DiParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The tables of the other reservoirs' frame, in the same arenas; the same ones within a frame, and of a scene that
    /// does not move.
    pub other_scene: SceneHeader,
    /// The camera of this frame.
    pub camera: CameraParams,
    /// The camera of the other reservoirs' frame; the same one within a frame.
    pub other_camera: CameraParams,
    /// Image width in pixels, at most 16384.
    pub width: u32,
    /// Image height in pixels, at most 16384.
    pub height: u32,
    /// Index of the frame. Its random numbers are those of the sample of this index; candidate i of the first round has those of the sample
    /// `frame * candidates + i`, and candidate `candidates + i` of later ones ([`Self::gloss_renewal`]) those of the sample
    /// `2^31 + frame * candidates * MAX_GLOSS_RENEWAL + i`, all modulo 2^32: before the frame `2^31 / (MAX_GLOSS_RENEWAL * candidates)` no two
    /// candidates have the same numbers.
    pub frame: u32,
    /// Index of the other reservoirs' frame.
    pub other_frame: u32,
    /// Seed of the random numbers. Runs with different seeds, neighbouring ones too, are independent.
    pub seed: u32,
    /// What the pass does.
    pub flags: Flags,
    /// Initial candidates from lights in a round, of which there is one where `gloss_renewal` adds none; at most 4000, so that those of 16 rounds have
    /// random dimensions of their own.
    pub candidates: u32,
    /// How many neighbours the pass has. A combine has at most [`crate::resample::mis::INPUTS`] - 2, and looks for others in each pixel; a pass of
    /// shading ([`super::exchange`]) has an even number of at most 2 [`PAIRS`], see [`Self::with_shading`].
    pub neighbours: u32,
    /// Which combine of the frame this is: their random numbers differ.
    pub combine: u32,
    /// Largest confidence of a reservoir of another frame.
    pub confidence_cap: f32,
    /// Largest distance of a neighbour in pixels.
    pub radius: f32,
    /// A neighbour nearer than this, in pixels, is believed to have the same visibility.
    pub near_radius: f32,
    /// A neighbour's distance from the tangent plane is at most this part of the distance to the camera.
    pub max_plane_distance: f32,
    /// A neighbour's normal has at least this cosine with the pixel's.
    pub min_normal_cos: f32,
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
}

impl Extent for DiParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
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
    /// | form of MIS | [`Mis::PAIRWISE_DEFENSIVE`] | |
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
        let flags = Flags::of_form(Mis::PAIRWISE_DEFENSIVE)
            | Flags::INITIAL_VISIBILITY
            | Flags::TARGET_VISIBILITY
            | Flags::MIS_VISIBILITY
            | Flags::SCATTER_CANDIDATE
            | Flags::SOBOL
            | Flags::TRANSMITTANCE;
        Self {
            camera,
            other_camera: camera,
            width,
            height,
            seed,
            flags,
            candidates: 16,
            neighbours: 4,
            confidence_cap: 20.0,
            gloss_fade: 30.0,
            radius: num::max(4.0, num::div(width.max(height) as f32, 24.0)),
            max_plane_distance: 0.02,
            min_normal_cos: 0.5,
            ..Self::default()
        }
    }

    /// The same chain's frame of that index, seen by `camera`. Each frame needs its own index: with that of another frame the numbers of
    /// both are the same, and their reuse is biased.
    #[must_use]
    pub fn of_frame(self, frame: u32, camera: CameraParams) -> Self {
        Self { frame, other_frame: frame, camera, other_camera: camera, ..self }
    }

    /// The parameters of [`super::initial`] in a frame that is combined with the one before it, which `camera` saw: where a glossy surface is seen from
    /// another direction than then, candidates are drawn in up to `most` more rounds, since less of history is left ([`Self::gloss_renewal`]). The
    /// host's renders have 7. Without this call there is one round. A view that has not changed needs no more.
    ///
    /// A round costs as many rays as the first one: drivers limit the time of a dispatch and the rounds of an invocation's loops, which lavapipe does
    /// without a word, so that `1 + most` times `candidates / group` should be at most 64.
    #[must_use]
    pub fn renewed_after(self, camera: CameraParams, most: u32) -> Self {
        Self { other_camera: camera, gloss_renewal: most.min(MAX_GLOSS_RENEWAL) as f32, ..self }
    }

    /// The parameters of the combine of a frame with the one before it, which `camera` saw. `same_view` says that every pixel had the same
    /// ray in it, and the scene was the same: a fact to state, which saves the rays that find out what the last frame saw. Without this call
    /// a combine takes the other reservoirs for neighbours in the same frame.
    #[must_use]
    pub fn with_last(self, camera: CameraParams, same_view: bool) -> Self {
        let flags = if same_view { self.flags.with_form(Mis::CONSTANT) | Flags::STILL } else { self.flags };
        let flags = flags | Flags::OTHER_FRAME;
        Self { flags, other_camera: camera, other_frame: self.frame.wrapping_sub(1), neighbours: 0, ..self }
    }

    /// The parameters of the combine with neighbours in the same frame, the `pass`-th of them, counted from 0. Without this call it
    /// would draw the numbers of the combine with the last frame again.
    #[must_use]
    pub fn with_neighbours(self, pass: u32) -> Self {
        Self { combine: 1 + pass, ..self }
    }

    /// The parameters of [`super::offer`], [`super::exchange`] and [`super::gather`], by which a pixel is shaded by its own sample and those of up to
    /// `neighbours` others within `radius` pixels, the same offsets for all pixels of the frame.
    #[must_use]
    pub fn with_shading(self, radius: f32, neighbours: u32) -> Self {
        let mut params = self;
        let most = (neighbours as usize / 2).min(PAIRS);
        let pairs = super::pair_offsets(self.seed, self.frame, radius, &mut params.pairs[..most]);
        Self { neighbours: 2 * pairs as u32, ..params }
    }

    /// The same in a kernel that was specialised to the flags in `bits`, or to none by a word without zeros: what other flags
    /// ask for, a driver need not compile.
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: Flags(self.flags.0 & bits), ..self }
    }

    /// The pixels of the image, by which neighbours are found.
    #[inline(always)]
    pub fn grid(&self) -> Grid {
        Grid { width: self.width, height: self.height }
    }

    /// How alike neighbours have to be.
    #[inline(always)]
    pub fn similarity(&self) -> Similarity {
        Similarity { max_plane_distance: self.max_plane_distance, min_normal_cos: self.min_normal_cos }
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
    pub fn tile_params(&self) -> TileParams {
        let Self { scene, tile_size, tiles, frame, seed, flags, .. } = *self;
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

impl Extent for TileParams {
    fn extent(&self) -> [u32; 2] {
        [self.tile_size, self.tiles]
    }
}

impl TileParams {
    /// As [`DiParams::specialised`].
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: Flags(self.flags.0 & bits), ..self }
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
    assert!(size_of::<DiParams>() == 384);
    assert!(size_of::<DiPoint>() == 48);
    assert!(size_of::<TileParams>() == 112);
    assert!(size_of::<TileWords>() == 64);
};
