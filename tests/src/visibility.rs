//! Averaged visibility (Tokuyoshi) beside that of the selected sample: native runs, and what they keep of every frame.

use crate::stats::Moments;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::technique::restir_di::{DiSettings, Visibility};
use restir_kernels::restir_di::di_shade;
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::restir_di::{DiParams, PackedReservoir, Stored};

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
    pub fn render(&self, seed: u32) -> Render {
        Render { count: self.frames, accumulate: true, seed, ..Render::new(self.size, self.settings.clone()) }
    }

    /// One restart; the seed is its number.
    ///
    /// # Panics
    /// If the plan is wrong.
    pub fn restart(&self, scene: &SceneBuffers, seed: u32) -> Restart {
        let mut restart = Restart { image: vec![[0.0; 3]; self.pixels()], visibility: Vec::new() };
        let weight = 1.0 / f64::from(self.frames - self.from);
        let render = self.render(seed);
        let result = CpuExecutor::inline().run_observed(render.plan(scene), &mut |step| {
            if step.pass.kernel.name != di_shade::DESC.name {
                return Ok(());
            }
            if step.pass.params::<DiParams>().is_some_and(|p| p.frame >= self.from) {
                for (sum, pixel) in restart.image.iter_mut().zip(step.plane::<FilmPixel>("film")?) {
                    *sum = std::array::from_fn(|channel| sum[channel] + weight * f64::from(pixel.sum[channel]));
                }
            }
            let reservoirs = step.plane("reservoirs")?;
            restart.visibility = reservoirs.into_iter().map(|word| Stored::unpack(word).visibility.x).collect();
            Ok(())
        });
        result.expect("the plan fits its kernels");
        restart
    }

    /// Independent restarts, in their order.
    pub fn restarts(&self, buffers: &SceneBuffers, count: u32) -> Vec<Restart> {
        (0..count).into_par_iter().map(|seed| self.restart(buffers, seed)).collect()
    }

    /// Pixels of the picture.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// A reservoir's sample, contribution weight and confidence, without its visibility.
pub fn without_visibility(reservoir: PackedReservoir) -> PackedReservoir {
    Stored { visibility: Vec3::ZERO, ..Stored::unpack(reservoir) }.pack()
}

/// Moments over restarts of the visibility of each pixel's reservoir.
pub fn visibility_moments(restarts: &[Restart]) -> Vec<Moments> {
    let pixels = restarts.first().map_or(0, |restart| restart.visibility.len());
    let of_pixel = |pixel: usize| restarts.iter().map(|restart| f64::from(restart.visibility[pixel])).collect();
    (0..pixels).map(of_pixel).collect()
}
