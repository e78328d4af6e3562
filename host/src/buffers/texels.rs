//! The texel arena: sRGB table, textures, environment.

use super::environment::EnvironmentMap;
use crate::scene::{Scene, Texture};
use restir_shared::layout::NONE;

/// The arena and where things begin in it.
#[derive(Debug)]
pub(super) struct Texels {
    pub(super) words: Vec<u32>,
    /// First word of the sRGB table.
    pub(super) srgb_base: u32,
    /// First word of each of the scene's textures; [`NONE`] of those that no material uses.
    pub(super) textures: Vec<u32>,
    /// First words of the environment's pixels and rows.
    pub(super) environment: [u32; 2],
}

impl Texels {
    /// Empty for a scene without textures and environment.
    pub(super) fn new(scene: &Scene, used_materials: &[bool], environment: Option<&EnvironmentMap>) -> Self {
        let mut texels =
            Self { words: Vec::new(), srgb_base: 0, textures: vec![NONE; scene.textures.len()], environment: [0; 2] };
        for (material, _) in scene.materials.iter().zip(used_materials).filter(|(_, used)| **used) {
            for used in material.textures().into_iter().flatten() {
                if texels.words.is_empty() {
                    // all at once, for a vector that grows would take twice as much
                    let texels_of_all: usize = scene.textures.iter().map(|texture| texture.texels.len() + 4).sum();
                    texels.words.reserve_exact(4 * 256 + texels_of_all);
                    texels.add_srgb_table();
                }
                if texels.textures[used.texture] == NONE {
                    texels.textures[used.texture] = texels.add_texture(&scene.textures[used.texture]);
                }
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
        self.words.extend(texture.texels.iter().map(|&rgba| u32::from_le_bytes(rgba)));
        self.words.resize(self.words.len().next_multiple_of(4), 0);
        first
    }

    fn add_environment(&mut self, map: &EnvironmentMap) -> [u32; 2] {
        let pixels = self.next_word();
        self.words
            .extend(map.pixels.iter().flat_map(|&([r, g, b], bound)| [r.to_bits(), g.to_bits(), b.to_bits(), bound]));
        let rows = self.next_word();
        self.words.extend(map.rows.iter().flat_map(|&bound| [bound, 0, 0, 0]));
        [pixels, rows]
    }
}

/// The linear value of an sRGB code (IEC 61966-2-1).
pub(super) fn linear(code: u8) -> f64 {
    let s = f64::from(code) / 255.0;
    if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}
