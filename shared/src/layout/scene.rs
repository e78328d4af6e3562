//! The scene in its arenas.

use bytemuck::{Pod, Zeroable};
use glam::UVec4;

/// Words of 16 bytes in a BVH node; it holds the boxes of its two children.
pub const NODE_WORDS: u32 = 4;
/// Words in a triangle.
pub const TRIANGLE_WORDS: u32 = 3;
/// Words in a material.
pub const MATERIAL_WORDS: u32 = 7;
/// Words in the record of an interior that scatters.
pub const INTERIOR_WORDS: u32 = 3;
/// Textures that an interior can use: colour and strength of scattering.
pub const INTERIOR_SLOTS: u32 = 2;
/// Words in a triangle's normals, tangents and texture coordinates.
pub const SHADING_WORDS: u32 = 3;
/// Words in a triangle's second set of texture coordinates.
pub const SECOND_UV_WORDS: u32 = 2;
/// Words in a material's use of a texture.
pub const TEXTURE_USE_WORDS: u32 = 3;
/// Textures that a material can use: base colour, metallic-roughness, normal, emission, specular factor and colour.
pub const TEXTURE_SLOTS: u32 = 6;
/// Words in a punctual light.
pub const PUNCTUAL_WORDS: u32 = 3;
/// Words in the record of the environment.
pub const ENVIRONMENT_WORDS: u32 = 2;
/// Rows, and columns of a row, in a part of an environment.
pub const ENVIRONMENT_PART: u32 = 16;
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
/// The most inner nodes on a way from the root of a BVH: its builder keeps to it, and traversals have room for so many pending nodes.
pub const TREE_DEPTH: usize = 64;

/// Material flag: emits on both sides. Without it only the front (counter-clockwise) side emits.
pub const MATERIAL_TWO_SIDED_EMISSION: u32 = 1;
/// Material flag: encloses an interior. Without it the surface is a thin wall.
pub const MATERIAL_VOLUME: u32 = 2;

/// Material flag: a mask. Where alpha is below the cutoff, there is no surface.
pub const MATERIAL_MASK: u32 = 4;
/// Material flag: blended. Alpha is the probability with which a ray meets the surface.
pub const MATERIAL_BLEND: u32 = 8;
/// Marks the object of a triangle whose material is [`MATERIAL_MASK`] or [`MATERIAL_BLEND`]: rays may miss it where they hit it.
pub const TRIANGLE_ALPHA: u32 = 1 << 31;

/// Texture slot: base colour, sRGB; alpha is linear.
pub const SLOT_BASE_COLOR: u32 = 0;
/// Texture slot: green is roughness, blue metallic.
pub const SLOT_METALLIC_ROUGHNESS: u32 = 1;
/// Texture slot: tangent-space normal.
pub const SLOT_NORMAL: u32 = 2;
/// Texture slot: emission, sRGB.
pub const SLOT_EMISSION: u32 = 3;
/// Texture slot: alpha is the factor on specular reflection. From here on, slots are of [`FEATURE_SPECULAR`].
pub const SLOT_SPECULAR: u32 = 4;
/// Texture slot: colour of specular reflection, sRGB.
pub const SLOT_SPECULAR_COLOR: u32 = 5;

/// Texture slot of an interior: colour of scattering, sRGB.
pub const SLOT_SCATTERING_COLOR: u32 = 0;
/// Texture slot of an interior: alpha scales the colour.
pub const SLOT_SCATTERING_STRENGTH: u32 = 1;

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
/// Texture flag: it lies on the second set of texture coordinates; with [`FEATURE_SECOND_UVS`].
pub const TEXTURE_SECOND_UVS: u32 = 64;
/// Texture flag: its texels have 16 bits a channel; with [`FEATURE_FINE_TEXELS`].
pub const TEXTURE_FINE: u32 = 128;

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
/// Scene feature: emissive triangles, or emitters of any other shape with an area.
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
/// Scene feature: specular reflection whose losses come back (multiple scattering). It may be taken from a scene that has
/// it, to render single scattering.
pub const FEATURE_MULTISCATTER: u32 = 1 << 12;
/// Scene feature: specular reflection scaled by factor and colour, with or without textures.
pub const FEATURE_SPECULAR: u32 = 1 << 14;
/// Scene feature: surfaces that are not everywhere, by a mask or blended.
pub const FEATURE_ALPHA: u32 = 1 << 13;
/// Scene feature: blended surfaces; with [`FEATURE_ALPHA`].
pub const FEATURE_BLEND: u32 = 1 << 15;
/// Scene feature: interiors that scatter light; with [`FEATURE_VOLUME`].
pub const FEATURE_SUBSURFACE: u32 = 1 << 16;
/// Scene feature: interiors that scatter light, and whose surface light passes straight; with [`FEATURE_SUBSURFACE`].
pub const FEATURE_CLEAR_BORDER: u32 = 1 << 17;
/// Scene feature: textures on a second set of texture coordinates; with [`FEATURE_TEXTURES`].
pub const FEATURE_SECOND_UVS: u32 = 1 << 18;
/// Scene feature: textures of 16 bits a channel; with [`FEATURE_TEXTURES`].
pub const FEATURE_FINE_TEXELS: u32 = 1 << 19;
/// A session's feature, of no scene: surfaces of a G-buffer that the embedder gives ([`Given`](crate::scene::Given)).
pub const FEATURE_GIVEN: u32 = 1 << 20;
/// The features of a diffuse scene whose lights are triangles.
pub const FEATURES_DIFFUSE: u32 = FEATURE_EMISSIVE | FEATURE_LIGHT_TABLE;
/// The features of a scene without textures, an environment, media, and surfaces that are not everywhere.
pub const FEATURES_UNTEXTURED: u32 = FEATURES_DIFFUSE
    | FEATURE_PUNCTUAL
    | FEATURE_SHADING
    | FEATURE_GLOSSY
    | FEATURE_DELTA
    | FEATURE_TRANSMISSION
    | FEATURE_MULTISCATTER
    | FEATURE_SPECULAR;
/// The features of a scene of media under an environment, some of which glow, whose surfaces are diffuse or clear.
pub const FEATURES_MEDIA: u32 = FEATURES_DIFFUSE
    | FEATURE_ENVIRONMENT
    | FEATURE_DELTA
    | FEATURE_TRANSMISSION
    | FEATURE_DIFFUSE_TRANSMISSION
    | FEATURE_VOLUME
    | FEATURE_SUBSURFACE
    | FEATURE_CLEAR_BORDER;
/// All features: what a kernel that was not specialised to a scene assumes.
pub const FEATURES_ALL: u32 = u32::MAX;

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
    /// First word of the second sets of texture coordinates in the geometry arena; [`NONE`] without.
    pub second_uv_base: u32,
}

crate::fields!(SceneHeader: bounds_lo, triangle_base, bounds_hi, triangle_count, light_base, light_count, alias_base, root, shading_base, punctual_base, environment_base, srgb_base, node_base, material_base, counterpart_base, second_uv_base);

impl SceneHeader {
    /// First word of a triangle in the geometry arena.
    #[doc(hidden)]
    #[inline(always)]
    pub fn triangle_word(&self, triangle: u32) -> usize {
        (self.triangle_base + triangle * TRIANGLE_WORDS) as usize
    }

    /// The header of the same tables, so many words further on in the geometry and the attribute arena.
    #[doc(hidden)]
    #[must_use]
    pub fn moved(self, geometry: u32, attributes: u32) -> Self {
        let by = |base: u32, words: u32| if base == NONE { NONE } else { base.wrapping_add(words) };
        Self {
            node_base: by(self.node_base, geometry),
            triangle_base: by(self.triangle_base, geometry),
            shading_base: by(self.shading_base, geometry),
            second_uv_base: by(self.second_uv_base, geometry),
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

const _: () = {
    assert!(size_of::<UVec4>() == 16);
    assert!(size_of::<SceneHeader>() == 80);
};
