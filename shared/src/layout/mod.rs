//! The plain-data types that host and device exchange. Those of one technique lie in the folder of that technique.
//!
//! All fields are 32 bits wide, so that native, std430 and SPIR-V layouts agree; asserts beside the types pin the
//! sizes. The scene lies in arenas of 16-byte words ([`UVec4`](glam::UVec4)); the [`SceneHeader`] says where each table
//! begins, in words. Floats are stored as their bits.
//!
//! | arena | table | words | contents |
//! |---|---|---|---|
//! | geometry | nodes | [`NODE_WORDS`] | `lo0.xyz, child0`, `hi0.xyz, child1`, `lo1.xyz, 0`, `hi1.xyz, 0` |
//! | geometry | triangles | [`TRIANGLE_WORDS`] | `v0.xyz, material`, `v1.xyz, light or NONE`, `v2.xyz, object`, which [`TRIANGLE_ALPHA`] marks; of an object any number that no other has |
//! | geometry | shading | [`SHADING_WORDS`] | `n0, n1, n2, t0`, `t1, t2, uv0`, `uv1, uv2`: a record a triangle; `n` unit normals and `t` tangents as [`crate::pack`] has them, the lowest bit of a tangent set where the bitangent is `-n x t`; absent without [`FEATURE_SHADING`] |
//! | geometry | second texture coordinates | [`SECOND_UV_WORDS`] | `uv0, uv1`, `uv2, 0, 0`: a record a triangle; absent without [`FEATURE_SECOND_UVS`] |
//! | attributes | materials | [`MATERIAL_WORDS`] | `base colour.rgb, flags`, `emission.rgb, texture uses, in words after the first material, or NONE`, `metallic, roughness, ior, transmission`, `diffuse transmission.rgb, its share`, `absorption.rgb, normal scale`, `alpha, cutoff of a mask, interior, in words after the first material, or 0, one more than a triangle of the body around it, or 0`, `specular colour.rgb, specular factor` |
//! | attributes | interiors | [`INTERIOR_WORDS`] | `albedo.rgb, anisotropy`, `index of the denser outside, 1, or 0 of a clear border, texture uses or NONE, 1 where lights are sampled, constant factor of a turn's density`, `absorbed.rgb, unused`: of the materials that scatter inside, whose absorption is the extinction |
//! | attributes | texture uses | [`TEXTURE_USE_WORDS`] | `first texel word or NONE, width, height, flags`, `m00, m01, m02, 0`, `m10, m11, m12, 0`; [`TEXTURE_SLOTS`] in a row |
//! | attributes | lights | [`LIGHT_WORDS`] | `triangle or index, density, kind, area of a triangle or 1`; the environment is the last |
//! | attributes | punctual lights | [`PUNCTUAL_WORDS`] | `position.xyz, kind`, `direction.xyz, falloff scale`, `intensity.rgb, falloff offset` |
//! | attributes | environment | [`ENVIRONMENT_WORDS`] | `first texel word, width, height, first row word`, `rotation in turns, probability, 0, 0` |
//! | attributes | alias table | [`ALIAS_WORDS`] | `threshold, alias, 0, 0`; absent without [`FEATURE_LIGHT_TABLE`] |
//! | attributes | counterparts | a quarter | of four lights, their indices in the other frame or [`LightAddress::NO_LIGHT`](crate::scene::LightAddress::NO_LIGHT); absent where they are the same |
//! | texels | sRGB table | 1 | `linear value, 0, 0, 0` of each of 256 codes |
//! | texels | texture | a quarter | four RGBA texels of 8 bits a channel; or a half: two of 16 |
//! | texels | environment | 1 | `radiance.rgb, lower bound of the column's share of its row`, in 2^-32 |
//! | texels | environment rows | 1 | `lower bound of the row's share, 0, 0, 0`, in 2^-32 |
//! | texels | environment parts | a quarter | the lower bounds of every [`ENVIRONMENT_PART`]th row, then of every such column of each row, from the first on: copies, of which a cache holds more |
//!
//! A scene of one grey triangle, laid out by hand:
//!
//! ```
//! use restir_shared::geometry::Ray;
//! use restir_shared::glam::{UVec4, Vec3};
//! use restir_shared::layout::{LEAF, LEAF_COUNT_SHIFT, MATERIAL_WORDS, NONE, SceneHeader};
//! use restir_shared::scene::{SceneView, Surface, Trace};
//!
//! let word = |[x, y, z]: [f32; 3], w| UVec4::new(x.to_bits(), y.to_bits(), z.to_bits(), w);
//! // the corners, with the material 0, no light, and the object 0
//! let geometry = [word([0.0, 0.0, 0.0], 0), word([1.0, 0.0, 0.0], NONE), word([0.0, 1.0, 0.0], 0)];
//! let mut attributes = [UVec4::ZERO; MATERIAL_WORDS as usize];
//! attributes[0] = word([0.5; 3], 0);
//! attributes[1].w = NONE;
//!
//! let header = SceneHeader {
//!     bounds_hi: [1.0, 1.0, 0.0],
//!     triangle_count: 1,
//!     // the root is a leaf of one triangle, the one of index 0
//!     root: LEAF | (1 << LEAF_COUNT_SHIFT),
//!     alias_base: NONE,
//!     shading_base: NONE,
//!     environment_base: NONE,
//!     counterpart_base: NONE,
//!     ..SceneHeader::default()
//! };
//! let (geometry, attributes) = (&geometry, &attributes);
//! let scene: SceneView = SceneView { header, geometry, attributes, texels: &[], features: 0, tracer: None };
//!
//! let ray = Ray { origin: Vec3::new(0.25, 0.5, 2.0), direction: Vec3::NEG_Z, t_max: Ray::FAR, key: 0 };
//! let hit = scene.closest(&ray);
//! assert_eq!((hit.t, hit.id, hit.uv.to_array()), (2.0, 0, [0.25, 0.5]));
//! assert_eq!(scene.surface(&ray, &hit).material.base_color, Vec3::splat(0.5));
//! ```

mod camera;
mod fields;
mod film;
mod scene;

pub use camera::CameraParams;
#[doc(hidden)]
pub use fields::{Field, Kind, OfWords, fields_of, kind_of};
#[doc(hidden)]
pub use film::FilmParams;
pub use film::FilmPixel;
pub use scene::{
    FEATURE_ALPHA, FEATURE_BLEND, FEATURE_CLEAR, FEATURE_CLEAR_BORDER, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION,
    FEATURE_EMISSIVE, FEATURE_ENVIRONMENT, FEATURE_GLOSSY, FEATURE_LIGHT_TABLE, FEATURE_MULTISCATTER, FEATURE_PUNCTUAL,
    FEATURE_SHADING, FEATURE_SPECULAR, FEATURE_SUBSURFACE, FEATURE_TEXTURES, FEATURE_TRANSMISSION, FEATURE_VOLUME,
    FEATURES_ALL, FEATURES_DIFFUSE, NONE, SceneHeader,
};
// the words of the arenas, which a host and its kernels of one version share
#[doc(hidden)]
pub use scene::*;

/// A launch over a two-dimensional grid; each parameter block knows its extent.
#[doc(hidden)]
pub trait Extent {
    /// Width and height of the grid in invocations.
    fn extent(&self) -> [u32; 2];
}
