//! The texel arena: sRGB table, textures, environment.

use super::{color::linear, environment::EnvironmentMap};
use crate::scene::{self, AlphaMode, Material, Scene, Texture};
use restir_shared::layout::{ENVIRONMENT_PART, MATERIAL_BLEND, MATERIAL_MASK, NONE};

/// The arena and where things begin in it.
#[derive(Debug)]
pub(super) struct Texels {
    pub(super) words: Vec<u32>,
    /// First word of the sRGB table.
    pub(super) srgb_base: u32,
    /// First word of each of the scene's textures; [`NONE`] of those that no material uses.
    pub(super) textures: Vec<u32>,
    /// The least alpha of each of the textures that an alpha is taken from; 1 of others.
    least_alpha: Vec<f32>,
    /// First words of the environment's pixels and rows.
    pub(super) environment: [u32; 2],
}

impl Texels {
    /// Empty for a scene without textures and environment.
    pub(super) fn new(scene: &Scene, used_materials: &[bool], environment: Option<&EnvironmentMap>) -> Self {
        let count = scene.textures.len();
        let mut texels = Self {
            words: Vec::new(),
            srgb_base: 0,
            textures: vec![NONE; count],
            least_alpha: vec![1.0; count],
            environment: [0; 2],
        };
        for (material, _) in scene.materials.iter().zip(used_materials).filter(|(_, used)| **used) {
            for used in material.all_textures() {
                if texels.words.is_empty() {
                    // all at once, for a vector that grows would take twice as much
                    let words = |texture: &Texture| texture.texels.bytes() as usize / 4 + 4;
                    texels.words.reserve_exact(4 * 256 + scene.textures.iter().map(words).sum::<usize>());
                    texels.add_srgb_table();
                }
                if texels.textures[used.texture] == NONE {
                    texels.textures[used.texture] = texels.add_texture(&scene.textures[used.texture]);
                }
            }
            if let Some(used) = material.base_color_texture.filter(|_| material.alpha_mode != AlphaMode::Opaque) {
                texels.least_alpha[used.texture] = least_alpha(&scene.textures[used.texture]);
            }
        }
        if let Some(map) = environment {
            texels.environment = texels.add_environment(map);
        }
        texels
    }

    /// How many of the scene's textures it has.
    pub(super) fn count(&self) -> usize {
        self.textures.iter().filter(|&&first| first != NONE).count()
    }

    /// Whether any of them has 16 bits a channel.
    pub(super) fn any_fine(&self, scene: &Scene) -> bool {
        let mut used = self.textures.iter().zip(&scene.textures).filter(|(first, _)| **first != NONE);
        used.any(|(_, texture)| texture.texels.is_fine())
    }

    /// The `MATERIAL_` flags of a material's alpha: none if it is everywhere.
    pub(super) fn alpha_flags(&self, material: &Material) -> u32 {
        let texture = material.base_color_texture.map_or(1.0, |used| self.least_alpha[used.texture]);
        let least = material.alpha * texture;
        match material.alpha_mode {
            AlphaMode::Mask { cutoff } if least < cutoff => MATERIAL_MASK,
            AlphaMode::Blend if least < 1.0 => MATERIAL_BLEND,
            _ => 0,
        }
    }

    fn next_word(&self) -> u32 {
        (self.words.len() / 4) as u32
    }

    fn add_srgb_table(&mut self) {
        for code in 0..=u8::MAX {
            self.words.extend([(linear(code) as f32).to_bits(), 0, 0, 0]);
        }
    }

    fn add_texture(&mut self, texture: &Texture) -> u32 {
        let first = self.next_word();
        match &texture.texels {
            scene::Texels::Eight(texels) => self.words.extend(texels.iter().map(|&rgba| u32::from_le_bytes(rgba))),
            scene::Texels::Sixteen(texels) => {
                let pair = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
                self.words.extend(texels.iter().flat_map(|&[r, g, b, a]| [pair(r, g), pair(b, a)]));
            }
        }
        self.words.resize(self.words.len().next_multiple_of(4), 0);
        first
    }

    fn add_environment(&mut self, map: &EnvironmentMap) -> [u32; 2] {
        let pixels = self.next_word();
        self.words
            .extend(map.pixels.iter().flat_map(|&([r, g, b], bound)| [r.to_bits(), g.to_bits(), b.to_bits(), bound]));
        let rows = self.next_word();
        self.words.extend(map.rows.iter().flat_map(|&bound| [bound, 0, 0, 0]));
        self.words.extend(map.rows.iter().step_by(ENVIRONMENT_PART as usize));
        for row in map.pixels.chunks(map.size[0] as usize) {
            self.words.extend(row.iter().step_by(ENVIRONMENT_PART as usize).map(|&(_, bound)| bound));
        }
        self.words.resize(self.words.len().next_multiple_of(4), 0);
        [pixels, rows]
    }
}

fn least_alpha(texture: &Texture) -> f32 {
    let least = texture.texels.iter().map(|texel| texel[3]).min().unwrap_or(u16::MAX);
    // of what has 8 bits, the code that kernels divide
    if texture.texels.is_fine() { f32::from(least) / 65_535.0 } else { f32::from(least / 257) / 255.0 }
}
