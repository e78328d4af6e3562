//! Where surfaces are: glTF's alpha, as a mask or as a probability.

use super::SceneView;
use crate::geometry::{Coverage, Hit, Ray};
use crate::layout::{
    FEATURE_ALPHA, FEATURE_BLEND, FEATURE_TEXTURES, MATERIAL_BLEND, MATERIAL_MASK, MATERIAL_WORDS, NONE,
    SLOT_BASE_COLOR,
};
use glam::{UVec4, Vec2};

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// The flags of a material.
    #[inline(always)]
    pub(super) fn material_flags(&self, material: u32) -> u32 {
        self.attribute(self.header.material_base + material * MATERIAL_WORDS).w
    }

    /// Whether a material of those flags is blended.
    #[inline(always)]
    pub(super) fn is_blended(&self, flags: u32) -> bool {
        self.has(FEATURE_BLEND) && flags & MATERIAL_BLEND != 0
    }

    /// The share of rays that meet a material at a point of a triangle: 0 or 1 of a mask.
    #[inline(always)]
    pub(super) fn coverage(&self, material: u32, triangle: u32, b: Vec2) -> f32 {
        let at = self.header.material_base + material * MATERIAL_WORDS;
        let uses = self.attribute(at + 1).w;
        let mut alpha = 1.0;
        if self.has(FEATURE_TEXTURES) && uses != NONE && self.has_texture(uses, SLOT_BASE_COLOR) {
            alpha = self.texture(uses, SLOT_BASE_COLOR, self.uvs(triangle, b), true).x;
        }
        self.share(self.material_flags(material), self.attribute(at + 5), alpha)
    }

    /// That share, of a material's flags, its word of alpha, and the alpha of its texture.
    #[inline(always)]
    pub(super) fn share(&self, flags: u32, factors: UVec4, texture: f32) -> f32 {
        let alpha = f32::from_bits(factors.x) * texture;
        if self.is_blended(flags) {
            alpha
        } else if flags & MATERIAL_MASK == 0 || alpha >= f32::from_bits(factors.y) {
            1.0
        } else {
            0.0
        }
    }
}

impl<const COMPILED: u32> Coverage for SceneView<'_, COMPILED> {
    #[inline(always)]
    fn covers(&self, ray: &Ray, hit: &Hit) -> bool {
        if !self.has(FEATURE_ALPHA) {
            return true;
        }
        let material = self.geometry_word(self.header.triangle_word(hit.id)).w;
        let blended = self.is_blended(self.material_flags(material));
        let chance = if blended { ray.chance(hit.id) } else { 0.5 };
        chance < self.coverage(material, hit.id, hit.uv)
    }
}
