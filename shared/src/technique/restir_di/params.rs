//! What ReSTIR DI puts into buffers: parameters, and records of planes.

use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::resample::exchange::{Neighbours, PAIRS};
use crate::resample::reproject::Grid;
use crate::resample::similar::Similarity;
use bytemuck::{Pod, Zeroable};

/// Direct light flag: camera rays are spread uniformly over the pixel.
pub const DI_JITTER: u32 = 1;
/// Direct light flag: an initial sample that is occluded has no contribution weight ("visibility reuse").
pub const DI_INITIAL_VISIBILITY: u32 = 1 << 1;
/// Direct light flag: samples are selected by their target times visibility.
pub const DI_TARGET_VISIBILITY: u32 = 1 << 2;
/// Direct light flag: targets in MIS weights are multiplied by visibility.
pub const DI_MIS_VISIBILITY: u32 = 1 << 3;
/// Direct light flag: shading traces a ray. Without it, it takes the visibility that the reservoir has.
pub const DI_FINAL_RAY: u32 = 1 << 4;
/// Direct light flag: a combine's visibility is the weighted mean over its inputs, not that of the selected one.
pub const DI_AVERAGE_VISIBILITY: u32 = 1 << 5;
/// Direct light flag: one candidate comes from scattering.
pub const DI_SCATTER_CANDIDATE: u32 = 1 << 6;
/// Direct light flag of a combine: the other reservoirs are of another frame; the first of them is at the place that the
/// camera of that frame saw the surface. Without it they are of the same frame, the canonical one is among them.
pub const DI_OTHER_FRAME: u32 = 1 << 7;
/// Direct light flag: light passes straight through clear glass, if the scene has any ([`crate::layout::FEATURE_CLEAR`]).
pub const DI_TRANSMITTANCE: u32 = 1 << 10;
/// Position of two bits among the flags of direct light: the target is 0 the luminance, else the channel of that number,
/// red being 1.
pub const DI_TARGET_SHIFT: u32 = 8;
/// Direct light flag of a combine with another frame, without neighbours: every pixel has the same camera ray in it, and
/// scenes are the same. Both reservoirs are the pixel's own then, and the visibility that they have is its own.
pub const DI_STILL: u32 = 1 << 11;
/// Direct light flag: candidates from lights come from tiles ([`DiParams::tiles`]).
pub const DI_TILES: u32 = 1 << 12;
/// Position of the bits of [`crate::resample::mis::Mis`] among the flags of direct light.
pub const DI_MIS_SHIFT: u32 = 16;

/// Parameters of the kernels of ReSTIR DI.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DiParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The tables of the other reservoirs' frame, in the same arenas; the same ones within a frame, and of a scene that
    /// does not move.
    pub other_scene: SceneHeader,
    /// The camera.
    pub camera: CameraParams,
    /// The camera of the other reservoirs' frame; the same one within a frame.
    pub other_camera: CameraParams,
    /// Image width in pixels, at most 16384.
    pub width: u32,
    /// Image height in pixels, at most 16384.
    pub height: u32,
    /// Index of the frame: the sample index of its random numbers.
    pub frame: u32,
    /// Index of the other reservoirs' frame.
    pub other_frame: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// `DI_` bits, and those of [`crate::resample::mis::Mis`] from [`DI_MIS_SHIFT`] on.
    pub flags: u32,
    /// Initial candidates from lights.
    pub candidates: u32,
    /// Neighbours of a combine, at most [`crate::resample::mis::INPUTS`] - 2; of a shading pass, at most 2 [`PAIRS`], and even.
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
    /// Which of the frame's passes of shading this is.
    pub shading_pass: u32,
    /// Candidates from lights in a group, of which one is tested by a ray if its visibility is asked for; 0 for one group.
    pub group: u32,
    /// Tiles of presampled candidates, with [`DI_TILES`]; at most 2^15.
    pub tiles: u32,
    /// Candidates in a tile, with [`DI_TILES`] from 1 to 2^15.
    pub tile_size: u32,
    /// Zero.
    pub reserved: [u32; 2],
    /// Offsets of a shading pass, of which every pixel has the neighbours on both sides: x in the lower half, y in the upper.
    pub pairs: [u32; PAIRS],
}

impl Extent for DiParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

impl DiParams {
    /// The image.
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
        let Self { scene, tile_size, tiles, frame, seed, .. } = *self;
        TileParams { scene, tile_size, tiles, frame, seed }
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
    /// The reservoir, see [`super::Stored`].
    pub reservoir: [u32; 4],
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
    /// Index of the frame: the sample index of its random numbers.
    pub frame: u32,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Extent for TileParams {
    fn extent(&self) -> [u32; 2] {
        [self.tile_size, self.tiles]
    }
}

/// A candidate in a tile: a light's address and all that lies there, in four words of 16 bytes.
///
/// | word | x, y, z | w |
/// |---|---|---|
/// | 0 | position | index of the light |
/// | 1 | normal | u, in 2^-24 |
/// | 2 | emission | v, in 2^-24 |
/// | 3 | density; offset and extent, or the falloff of a light at a point | kind, + 4 if it is two-sided |
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TileWords {
    /// Word 0.
    pub position: [u32; 4],
    /// Word 1.
    pub normal: [u32; 4],
    /// Word 2.
    pub emission: [u32; 4],
    /// Word 3.
    pub rest: [u32; 4],
}

const _: () = {
    assert!(size_of::<DiParams>() == 384);
    assert!(size_of::<DiPoint>() == 48);
    assert!(size_of::<TileParams>() == 96);
    assert!(size_of::<TileWords>() == 64);
};
