//! Texture look-ups.

use super::SceneView;
use crate::layout::{
    FEATURE_FINE_TEXELS, FEATURE_SECOND_UVS, NONE, TEXTURE_FINE, TEXTURE_MIRROR_U, TEXTURE_NEAREST, TEXTURE_REPEAT_U,
    TEXTURE_REPEAT_V, TEXTURE_SECOND_UVS, TEXTURE_SRGB, TEXTURE_USE_WORDS,
};
use crate::num;
use crate::pack::xyz;
use glam::{UVec4, Vec2, Vec3};

/// Texture coordinates are limited to this magnitude: beyond it their fractions are too coarse to mean anything.
const MAX_COORDINATE: f32 = 1_048_576.0;
const INV_255: f32 = 1.0 / 255.0;
const INV_65535: f32 = 1.0 / 65_535.0;
/// One over the steps of 16 bits in a step of 8.
const INV_257: f32 = 1.0 / 257.0;
/// How far the flags of v are from those of u.
const V_SHIFT: u32 = 2;
const _: () = assert!(TEXTURE_REPEAT_U << V_SHIFT == TEXTURE_REPEAT_V);

/// The texture coordinates of a point.
#[derive(Clone, Copy)]
pub(super) struct Uvs {
    pub(super) first: Vec2,
    /// Zero in a scene without [`FEATURE_SECOND_UVS`].
    pub(super) second: Vec2,
}

impl Uvs {
    pub(super) const ZERO: Self = Self { first: Vec2::ZERO, second: Vec2::ZERO };
}

/// A texture as a material uses it.
struct TextureUse {
    /// First word of the texels.
    base: u32,
    width: u32,
    height: u32,
    flags: u32,
    transform: [Vec3; 2],
}

/// Two neighbouring texels along an axis, and the share of the second.
struct Taps {
    first: u32,
    second: u32,
    share: f32,
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// Whether a slot has a texture, of the texture uses that begin `uses` words after the materials.
    #[inline(always)]
    pub(super) fn has_texture(&self, uses: u32, slot: u32) -> bool {
        self.attribute(self.header.material_base + uses + slot * TEXTURE_USE_WORDS).x != NONE
    }

    /// RGB of a slot that has a texture, or with `alpha` three times that.
    #[inline(always)]
    pub(super) fn texture(&self, uses: u32, slot: u32, uvs: Uvs, alpha: bool) -> Vec3 {
        let texture = self.texture_use(self.header.material_base + uses + slot * TEXTURE_USE_WORDS);
        let is_second = self.has(FEATURE_SECOND_UVS) & (texture.flags & TEXTURE_SECOND_UVS != 0);
        let uv = if is_second { uvs.second } else { uvs.first };
        let [a, b] = texture.transform;
        let u = taps(a.x * uv.x + a.y * uv.y + a.z, texture.width, texture.flags);
        let v = taps(b.x * uv.x + b.y * uv.y + b.z, texture.height, texture.flags >> V_SHIFT);
        let nearest = texture.flags & TEXTURE_NEAREST != 0;
        let share_u = if nearest { round_share(u.share) } else { u.share };
        let share_v = if nearest { round_share(v.share) } else { v.share };
        let mut sum = Vec3::ZERO;
        let mut corner = 0;
        while corner < 4 {
            let (x, wx) = if corner & 1 == 0 { (u.first, 1.0 - share_u) } else { (u.second, share_u) };
            let (y, wy) = if corner & 2 == 0 { (v.first, 1.0 - share_v) } else { (v.second, share_v) };
            sum += self.texel(&texture, y * texture.width + x, alpha) * (wx * wy);
            corner += 1;
        }
        sum
    }

    #[inline(always)]
    fn texture_use(&self, at: u32) -> TextureUse {
        let head = self.attribute(at);
        let row = |word: u32| xyz(self.attribute(word));
        TextureUse { base: head.x, width: head.y, height: head.z, flags: head.w, transform: [row(at + 1), row(at + 2)] }
    }

    #[inline(always)]
    fn texel(&self, texture: &TextureUse, index: u32, alpha: bool) -> Vec3 {
        if self.has(FEATURE_FINE_TEXELS) && texture.flags & TEXTURE_FINE != 0 {
            self.fine_texel(texture, index, alpha)
        } else {
            self.coarse_texel(texture, index, alpha)
        }
    }

    /// A texel of 16 bits a channel.
    #[inline(always)]
    fn fine_texel(&self, texture: &TextureUse, index: u32, alpha: bool) -> Vec3 {
        let word = self.texel_word(texture.base + (index >> 1));
        let (rg, ba) = if index & 1 == 0 { (word.x, word.y) } else { (word.z, word.w) };
        let (r, g, b) = (rg & 0xffff, rg >> 16, ba & 0xffff);
        if alpha {
            Vec3::splat((ba >> 16) as f32 * INV_65535)
        } else if texture.flags & TEXTURE_SRGB != 0 {
            Vec3::new(self.fine_linear(r), self.fine_linear(g), self.fine_linear(b))
        } else {
            Vec3::new(r as f32, g as f32, b as f32) * INV_65535
        }
    }

    /// The linear value of an sRGB code of 16 bits: between those of 8, which it is at most 6e-6 above.
    #[inline(always)]
    fn fine_linear(&self, code: u32) -> f32 {
        // code / 257
        let below = code.wrapping_sub(code >> 8) >> 8;
        let share = code.wrapping_sub(below * 257) as f32 * INV_257;
        let linear = |code: u32| f32::from_bits(self.texel_word(self.header.srgb_base + code).x);
        let low = linear(below);
        low + (linear((below + 1).min(255)) - low) * share
    }

    /// A texel of 8 bits a channel.
    #[inline(always)]
    fn coarse_texel(&self, texture: &TextureUse, index: u32, alpha: bool) -> Vec3 {
        let rgba = component(self.texel_word(texture.base + (index >> 2)), index & 3);
        let code = |shift: u32| rgba >> shift & 0xff;
        if alpha {
            Vec3::splat(code(24) as f32 * INV_255)
        } else if texture.flags & TEXTURE_SRGB != 0 {
            let linear = |code: u32| f32::from_bits(self.texel_word(self.header.srgb_base + code).x);
            Vec3::new(linear(code(0)), linear(code(8)), linear(code(16)))
        } else {
            Vec3::new(code(0) as f32, code(8) as f32, code(16) as f32) * INV_255
        }
    }
}

#[inline(always)]
pub(super) fn component(word: UVec4, index: u32) -> u32 {
    let low = if index & 1 == 0 { word.x } else { word.y };
    let high = if index & 1 == 0 { word.z } else { word.w };
    if index & 2 == 0 { low } else { high }
}

#[inline(always)]
fn round_share(share: f32) -> f32 {
    if share < 0.5 { 0.0 } else { 1.0 }
}

/// The texels around the coordinate `x`, where [0, 1] spans the texture; texel i has its centre at (i + 1/2) / size.
#[inline(always)]
fn taps(x: f32, size: u32, flags: u32) -> Taps {
    let limited = num::clamp(x, -MAX_COORDINATE, MAX_COORDINATE);
    let repeat = flags & TEXTURE_REPEAT_U != 0;
    let inside = if repeat {
        limited - num::floor(limited)
    } else if flags & TEXTURE_MIRROR_U != 0 {
        let period = limited * 0.5;
        let twice = (period - num::floor(period)) * 2.0;
        if twice > 1.0 { 2.0 - twice } else { twice }
    } else {
        num::clamp(limited, 0.0, 1.0)
    };
    let at = inside * size as f32 - 0.5;
    let below = num::floor(at);
    let last = size.wrapping_sub(1);
    // -1 at the lower edge, `size` at the upper one
    let first = below as i32;
    let second = first.wrapping_add(1);
    Taps {
        first: if first < 0 { if repeat { last } else { 0 } } else { (first as u32).min(last) },
        second: if second as u32 > last { if repeat { 0 } else { last } } else { second as u32 },
        share: at - below,
    }
}
