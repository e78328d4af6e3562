//! Every plain-data type that crosses the bus between host and device.
//!
//! All fields are 32 bits wide, so that native, std430 and SPIR-V layouts agree; the asserts at the end pin
//! the sizes. The scene lies in arenas of 16-byte words ([`UVec4`]); the [`SceneHeader`] says where each table
//! begins, in words. Floats are stored as their bits.
//!
//! | arena | table | words | contents |
//! |---|---|---|---|
//! | geometry | nodes | [`NODE_WORDS`] | `lo0.xyz, child0`, `hi0.xyz, child1`, `lo1.xyz, 0`, `hi1.xyz, 0` |
//! | geometry | triangles | [`TRIANGLE_WORDS`] | `v0.xyz, material`, `v1.xyz, light or NONE`, `v2.xyz, object` |
//! | geometry | shading | [`SHADING_WORDS`] | `n0, n1, n2, t0`, `t1, t2, uv0`, `uv1, uv2`: a record a triangle; `n` unit normals and `t` tangents as [`crate::pack`] has them, the lowest bit of a tangent set where the bitangent is `-n x t`; absent without [`FEATURE_SHADING`] |
//! | attributes | materials | [`MATERIAL_WORDS`] | `base colour.rgb, flags`, `emission.rgb, texture uses, in words after the first material, or NONE`, `metallic, roughness, ior, transmission`, `diffuse transmission.rgb, its share`, `absorption.rgb, normal scale` |
//! | attributes | texture uses | [`TEXTURE_USE_WORDS`] | `first texel word or NONE, width, height, flags`, `m00, m01, m02, 0`, `m10, m11, m12, 0`; [`TEXTURE_SLOTS`] in a row |
//! | attributes | lights | [`LIGHT_WORDS`] | `triangle or index, density, kind, area of a triangle or 1`; the environment is the last |
//! | attributes | punctual lights | [`PUNCTUAL_WORDS`] | `position.xyz, kind`, `direction.xyz, falloff scale`, `intensity.rgb, falloff offset` |
//! | attributes | environment | [`ENVIRONMENT_WORDS`] | `first texel word, width, height, first row word`, `rotation in turns, probability, 0, 0` |
//! | attributes | alias table | [`ALIAS_WORDS`] | `threshold, alias, 0, 0`; absent without [`FEATURE_LIGHT_TABLE`] |
//! | attributes | counterparts | a quarter | of four lights, their indices in the other frame or [`LightAddress::NO_LIGHT`](crate::scene::LightAddress::NO_LIGHT); absent where they are the same |
//! | texels | sRGB table | 1 | `linear value, 0, 0, 0` of each of 256 codes |
//! | texels | texture | a quarter | four RGBA texels of 8 bits a channel |
//! | texels | environment | 1 | `radiance.rgb, lower bound of the column's share of its row`, in 2^-32 |
//! | texels | environment rows | 1 | `lower bound of the row's share, 0, 0, 0`, in 2^-32 |

use bytemuck::{Pod, Zeroable};
use glam::UVec4;

/// Words of 16 bytes in a BVH node; it holds the boxes of its two children.
pub const NODE_WORDS: u32 = 4;
/// Words in a triangle.
pub const TRIANGLE_WORDS: u32 = 3;
/// Words in a material.
pub const MATERIAL_WORDS: u32 = 5;
/// Words in a triangle's normals, tangents and texture coordinates.
pub const SHADING_WORDS: u32 = 3;
/// Words in a material's use of a texture.
pub const TEXTURE_USE_WORDS: u32 = 3;
/// Textures that a material can use: base colour, metallic-roughness, normal, emission.
pub const TEXTURE_SLOTS: u32 = 4;
/// Words in a punctual light.
pub const PUNCTUAL_WORDS: u32 = 3;
/// Words in the record of the environment.
pub const ENVIRONMENT_WORDS: u32 = 2;
/// Words in a light.
pub const LIGHT_WORDS: u32 = 1;
/// Words in an entry of the alias table.
pub const ALIAS_WORDS: u32 = 1;

/// An index that refers to nothing.
pub const NONE: u32 = u32::MAX;

/// Marks a child reference of a BVH node as a leaf: bits 0..=26 are the first triangle, bits 27..=30 the count.
/// Without it the reference is the index of an inner node.
pub const LEAF: u32 = 1 << 31;
/// Position of the triangle count in a leaf reference.
pub const LEAF_COUNT_SHIFT: u32 = 27;
/// The most triangles that a leaf can hold.
pub const LEAF_MAX_COUNT: u32 = 15;
/// The most triangles that a scene can hold.
pub const MAX_TRIANGLES: u32 = 1 << LEAF_COUNT_SHIFT;
/// The most nodes that a traversal can have pending: the BVH builder keeps its depth at or below this.
pub const STACK_DEPTH: usize = 64;

/// Material flag: emits on both sides. Without it only the front (counter-clockwise) side emits.
pub const MATERIAL_TWO_SIDED_EMISSION: u32 = 1;
/// Material flag: encloses an interior. Without it the surface is a thin wall.
pub const MATERIAL_VOLUME: u32 = 2;

/// Texture slot: base colour, sRGB.
pub const SLOT_BASE_COLOR: u32 = 0;
/// Texture slot: green is roughness, blue metallic.
pub const SLOT_METALLIC_ROUGHNESS: u32 = 1;
/// Texture slot: tangent-space normal.
pub const SLOT_NORMAL: u32 = 2;
/// Texture slot: emission, sRGB.
pub const SLOT_EMISSION: u32 = 3;

/// Texture flag: along u, the texture repeats. Without it and [`TEXTURE_MIRROR_U`], the edge continues.
pub const TEXTURE_REPEAT_U: u32 = 1;
/// Texture flag: along u, the texture repeats mirrored.
pub const TEXTURE_MIRROR_U: u32 = 2;
/// As [`TEXTURE_REPEAT_U`], along v.
pub const TEXTURE_REPEAT_V: u32 = 4;
/// As [`TEXTURE_MIRROR_U`], along v.
pub const TEXTURE_MIRROR_V: u32 = 8;
/// Texture flag: the nearest texel instead of a bilinear mean.
pub const TEXTURE_NEAREST: u32 = 16;
/// Texture flag: RGB is sRGB-encoded.
pub const TEXTURE_SRGB: u32 = 32;

/// Kind of a light: an emissive triangle; density per area.
pub const LIGHT_TRIANGLE: u32 = 0;
/// Kind of a light: punctual; the density is its probability.
pub const LIGHT_PUNCTUAL: u32 = 1;
/// Kind of a light: the environment; the density is its probability.
pub const LIGHT_ENVIRONMENT: u32 = 2;

/// Kind of a punctual light: at a point, with a falloff about its direction.
pub const PUNCTUAL_POINT: u32 = 0;
/// Kind of a punctual light: infinitely far away.
pub const PUNCTUAL_DIRECTIONAL: u32 = 1;

/// Scene feature: emitters differ in power, so the choice among them needs the alias table.
pub const FEATURE_LIGHT_TABLE: u32 = 1;
/// Scene feature: emissive triangles.
pub const FEATURE_EMISSIVE: u32 = 1 << 1;
/// Scene feature: point, spot or directional lights.
pub const FEATURE_PUNCTUAL: u32 = 1 << 2;
/// Scene feature: an environment map.
pub const FEATURE_ENVIRONMENT: u32 = 1 << 3;
/// Scene feature: textures.
pub const FEATURE_TEXTURES: u32 = 1 << 4;
/// Scene feature: shading normals or texture coordinates.
pub const FEATURE_SHADING: u32 = 1 << 5;
/// Scene feature: rough specular lobes (GGX).
pub const FEATURE_GLOSSY: u32 = 1 << 6;
/// Scene feature: specular lobes so smooth that they are perfect (Dirac deltas).
pub const FEATURE_DELTA: u32 = 1 << 7;
/// Scene feature: dielectrics that transmit specularly.
pub const FEATURE_TRANSMISSION: u32 = 1 << 8;
/// Scene feature: diffuse transmission.
pub const FEATURE_DIFFUSE_TRANSMISSION: u32 = 1 << 9;
/// Scene feature: absorbing interiors.
pub const FEATURE_VOLUME: u32 = 1 << 10;
/// Scene feature: smooth glass without a volume, which light may pass straight.
pub const FEATURE_CLEAR: u32 = 1 << 11;
/// The features of a diffuse scene whose lights are triangles.
pub const FEATURES_DIFFUSE: u32 = FEATURE_EMISSIVE | FEATURE_LIGHT_TABLE;
/// All features: what a kernel that was not specialised to a scene assumes.
pub const FEATURES_ALL: u32 = u32::MAX;

/// Path tracing flag: samples are spread uniformly over the pixel instead of going through its centre.
pub const PATH_JITTER: u32 = 1;
/// Path tracing flag: Russian roulette on the throughput from the fourth segment on.
pub const PATH_ROULETTE: u32 = 2;

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
/// Direct light flag: light passes straight through clear glass, if the scene has any ([`FEATURE_CLEAR`]).
pub const DI_TRANSMITTANCE: u32 = 1 << 10;
/// Position of two bits among the flags of direct light: the target is 0 the luminance, else the channel of that number,
/// red being 1.
pub const DI_TARGET_SHIFT: u32 = 8;
/// Direct light flag of a combine with another frame, without neighbours: every pixel has the same camera ray in it, and
/// scenes are the same. Both reservoirs are the pixel's own then, and the visibility that they have is its own.
pub const DI_STILL: u32 = 1 << 11;
/// Direct light flag: candidates from lights come from tiles ([`DiParams::tiles`]).
pub const DI_TILES: u32 = 1 << 12;
/// Position of the bits of [`crate::mis::Mis`] among the flags of direct light.
pub const DI_MIS_SHIFT: u32 = 16;

/// A launch over a two-dimensional grid; each parameter block knows its extent.
pub trait Extent {
    /// Width and height of the grid in invocations.
    fn extent(&self) -> [u32; 2];
}

/// Where the tables of a scene begin in its arenas, and its bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SceneHeader {
    /// Lower corner of the bounds of all triangles.
    pub bounds_lo: [f32; 3],
    /// First word of the triangles in the geometry arena.
    pub triangle_base: u32,
    /// Upper corner of the bounds of all triangles.
    pub bounds_hi: [f32; 3],
    /// Number of triangles.
    pub triangle_count: u32,
    /// First word of the lights in the attribute arena.
    pub light_base: u32,
    /// Number of lights of all kinds.
    pub light_count: u32,
    /// First word of the alias table in the attribute arena; [`NONE`] without one.
    pub alias_base: u32,
    /// Reference to the root, encoded as a child of a node; [`NONE`] for a scene without triangles.
    pub root: u32,
    /// First word of the shading records in the geometry arena; [`NONE`] without.
    pub shading_base: u32,
    /// First word of the punctual lights in the attribute arena.
    pub punctual_base: u32,
    /// First word of the environment's record in the attribute arena; [`NONE`] without.
    pub environment_base: u32,
    /// First word of the sRGB table in the texel arena.
    pub srgb_base: u32,
    /// First word of the nodes in the geometry arena.
    pub node_base: u32,
    /// First word of the materials in the attribute arena.
    pub material_base: u32,
    /// First word of the lights' counterparts in the other frame, in the attribute arena; [`NONE`] where they are the same.
    pub counterpart_base: u32,
    /// Zero.
    pub reserved: u32,
}

impl SceneHeader {
    /// Of the same tables, so many words further on in the geometry and the attribute arena.
    #[must_use]
    pub fn moved(self, geometry: u32, attributes: u32) -> Self {
        let by = |base: u32, words: u32| if base == NONE { NONE } else { base.wrapping_add(words) };
        Self {
            node_base: by(self.node_base, geometry),
            triangle_base: by(self.triangle_base, geometry),
            shading_base: by(self.shading_base, geometry),
            material_base: by(self.material_base, attributes),
            light_base: by(self.light_base, attributes),
            alias_base: by(self.alias_base, attributes),
            punctual_base: by(self.punctual_base, attributes),
            environment_base: by(self.environment_base, attributes),
            counterpart_base: by(self.counterpart_base, attributes),
            ..self
        }
    }
}

/// A camera with a thin lens, or a pinhole. `right` and `up` span half of the image plane at distance `|forward|`, which
/// is the plane in focus if there is a lens. A point (x, y) of the unit disk is the point
/// `position + right * (lens_right * x) + up * (lens_up * y)` of the lens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CameraParams {
    /// Centre of projection.
    pub position: [f32; 3],
    /// 1 / width of the image in pixels.
    pub inv_width: f32,
    /// From the centre of projection to the centre of the image plane.
    pub forward: [f32; 3],
    /// 1 / height of the image in pixels.
    pub inv_height: f32,
    /// From the centre of the image plane to the middle of its right edge.
    pub right: [f32; 3],
    /// Radius of the lens over the length of `right`; zero for a pinhole.
    pub lens_right: f32,
    /// From the centre of the image plane to the middle of its upper edge.
    pub up: [f32; 3],
    /// Radius of the lens over the length of `up`; zero for a pinhole.
    pub lens_up: f32,
}

/// Parameters of the kernel `path`: one aligned block of samples of every pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PathParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The camera.
    pub camera: CameraParams,
    /// Image width in pixels, at most 16384.
    pub width: u32,
    /// Image height in pixels, at most 16384.
    pub height: u32,
    /// Index of the first sample, a multiple of `2^block_log2`.
    pub first_sample: u32,
    /// The block has `2^block_log2` samples; at most [`crate::film::MAX_BLOCK_LOG2`].
    pub block_log2: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Longest path, in segments: 1 is directly visible emission, 2 adds direct light.
    pub max_depth: u32,
    /// [`PATH_JITTER`] and [`PATH_ROULETTE`].
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

impl Extent for PathParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// Pairs of neighbours on opposite sides in a pass of shading.
pub const PAIRS: usize = 4;

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
    /// `DI_` bits, and those of [`crate::mis::Mis`] from [`DI_MIS_SHIFT`] on.
    pub flags: u32,
    /// Initial candidates from lights.
    pub candidates: u32,
    /// Neighbours of a combine, at most [`crate::mis::INPUTS`] - 2; of a shading pass, at most 2 [`PAIRS`], and even.
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
    /// The reservoir, see [`crate::technique::di::Stored`].
    pub reservoir: [u32; 4],
}

/// Of a pixel's neighbours in a pass of shading: the targets of their samples at the pixel, as MIS weights have them, or
/// [`Self::NONE`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DiPairs {
    /// In the order of [`DiParams::pairs`], of each pair first the neighbour at the offset, then the one opposite.
    pub targets: [f32; 2 * PAIRS],
}

impl DiPairs {
    /// There is no neighbour, or it is too different.
    pub const NONE: f32 = -1.0;
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

/// Parameters of the film kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FilmParams {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Number of samples that the film holds (`film_resolve` divides by it).
    pub samples: f32,
    /// Zero.
    pub reserved: u32,
}

impl Extent for FilmParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

/// A pixel of a film plane: a sum over an aligned block of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct FilmPixel {
    /// Sum of radiance, linear RGB.
    pub sum: [f32; 3],
    /// How many samples were dropped because they were not finite or the device cut them short.
    pub dropped: f32,
}

const _: () = {
    assert!(size_of::<UVec4>() == 16);
    assert!(size_of::<SceneHeader>() == 80);
    assert!(size_of::<CameraParams>() == 64);
    assert!(size_of::<PathParams>() == 176);
    assert!(size_of::<DiParams>() == 384);
    assert!(size_of::<DiPoint>() == 48);
    assert!(size_of::<DiPairs>() == 32);
    assert!(size_of::<TileParams>() == 96);
    assert!(size_of::<TileWords>() == 64);
    assert!(size_of::<FilmParams>() == 16);
    assert!(size_of::<FilmPixel>() == 16);
};
