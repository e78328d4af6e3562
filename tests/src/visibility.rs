//! Averaged visibility (Tokuyoshi) beside that of the selected sample: native runs, and what they keep of every frame.

use crate::stats::Moments;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::di::{DiRender, DiSettings, Visibility};
use restir_host::replay::Frames;
use restir_kernels as kernels;
use restir_shared::glam::UVec4;
use restir_shared::scene::{AddressedLights, Surface, Trace};
use restir_shared::technique::di::{DiParams, Stored};

/// What is run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Frames of a restart.
    pub frames: u32,
    /// The first frame that counts: those before it build up the history.
    pub from: u32,
    /// Settings.
    pub settings: DiSettings,
}

/// What comes of a restart.
#[derive(Clone, Debug, Default)]
pub struct Restart {
    /// Radiance of each pixel, the mean of the frames that count.
    pub image: Vec<[f64; 3]>,
    /// Visibility of each pixel's reservoir in the last frame, in red if it has a colour.
    pub visibility: Vec<f32>,
}

/// The settings of Tokuyoshi's algorithm 1 at a size of some tens of pixels: two shadow rays a pixel.
pub fn settings(visibility: Visibility) -> DiSettings {
    let preset = DiSettings::preset("wis").unwrap_or_default();
    DiSettings { candidates: 8, scatter: false, radius: 4.0, visibility, ..preset }
}

impl Run {
    /// As the host plans it.
    pub fn render(&self, seed: u32) -> DiRender {
        DiRender { frames: self.frames, accumulate: true, seed, ..DiRender::new(self.size, self.settings.clone()) }
    }

    /// One restart; the seed is its number.
    pub fn restart<S: Trace + Surface + AddressedLights>(
        &self,
        scene: &S,
        buffers: &SceneBuffers,
        seed: u32,
    ) -> Restart {
        let mut restart = Restart { image: vec![[0.0; 3]; self.pixels()], visibility: Vec::new() };
        let weight = 1.0 / f64::from(self.frames - self.from);
        Frames::replay(scene, buffers, &self.render(seed), &mut |pass, frames| {
            if pass.kernel.name != kernels::di::di_shade::DESC.name {
                return;
            }
            let [reservoirs, film] = [4, 6].map(|binding| frames.plane(pass.bindings[binding]));
            if bytemuck::cast_slice::<u32, DiParams>(&pass.params)[0].frame >= self.from {
                for (sum, pixel) in restart.image.iter_mut().zip(film) {
                    let radiance = [pixel.x, pixel.y, pixel.z].map(|bits| f64::from(f32::from_bits(bits)));
                    *sum = std::array::from_fn(|channel| sum[channel] + weight * radiance[channel]);
                }
            }
            restart.visibility = reservoirs.iter().map(|&word| Stored::unpack(word).visibility.x).collect();
        });
        restart
    }

    /// Independent restarts, in their order.
    pub fn restarts(&self, buffers: &SceneBuffers, count: u32) -> Vec<Restart> {
        let view = buffers.view();
        (0..count).into_par_iter().map(|seed| self.restart(&view, buffers, seed)).collect()
    }

    /// Pixels of the picture.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// A reservoir's sample, contribution weight and confidence, without its visibility.
pub fn without_visibility(word: UVec4) -> UVec4 {
    UVec4::new(word.x, word.y & 0x00ff_ffff, word.z & 0x00ff_ffff, word.w)
}

/// Moments over restarts of the visibility of each pixel's reservoir.
pub fn visibility_moments(restarts: &[Restart]) -> Vec<Moments> {
    let pixels = restarts.first().map_or(0, |restart| restart.visibility.len());
    (0..pixels)
        .map(|pixel| {
            let mut moments = Moments::default();
            restarts.iter().for_each(|restart| moments.push(f64::from(restart.visibility[pixel])));
            moments
        })
        .collect()
}
