//! The denoiser's passes after those of a technique.

use super::Denoise;
use super::passes::{Planes, Seen};
use crate::Error;
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::sequence::pixel_filter::PixelFilter;
use crate::sequence::technique::{Integral, Repeats, Technique};
use crate::sequence::{Frame, Sequence, Stage, Work};
use restir_kernels::denoise::denoise_guide;
use restir_shared::camera::spread;
use restir_shared::denoise::{DenoiseParams, GuideParams};
use restir_shared::layout::CameraParams;
use std::collections::VecDeque;

/// Most samples of a pixel that its reflectance is a mean of.
const MOST_SAMPLES: u32 = 16;

/// The frames of a technique, each of which is denoised where it is shown.
pub(super) struct Denoised {
    denoise: Denoise,
    integral: Integral,
    repeats: Repeats,
    /// Random numbers of different samples are independent.
    independent: bool,
    size: [u32; 2],
    seed: u32,
    progressive: bool,
    picture: Box<dyn Sequence>,
    buffers: Vec<Buffer>,
    planes: Planes,
    frame: Option<Frame>,
    /// Frames and samples in the picture.
    held: [u32; 2],
    /// The camera of the last picture.
    last: Option<CameraParams>,
    /// The passes that are left once the picture is made; not yet thought of before.
    passes: Option<VecDeque<Result<Pass, Error>>>,
}

impl Denoised {
    pub(super) fn new(denoise: Denoise, technique: &dyn Technique, stage: &Stage) -> Self {
        let picture = technique.sequence(stage);
        let mut buffers = picture.buffers().to_vec();
        let planes = Planes::new(&mut buffers, stage.size);
        Self {
            denoise,
            integral: technique.integral(),
            repeats: technique.about().repeats,
            independent: technique.value("sampler").as_deref() == Some("independent"),
            size: stage.size,
            seed: stage.seed,
            progressive: stage.progressive,
            picture,
            buffers,
            planes,
            frame: None,
            held: [0; 2],
            last: None,
            passes: None,
        }
    }

    /// Adds a frame to what the picture is the mean of.
    fn hold(&mut self, frame: &Frame) {
        if frame.clears || !self.progressive {
            self.held = [0; 2];
        }
        let [frames, samples] = self.held;
        self.held = [frames.saturating_add(1), samples.saturating_add(self.samples(frame))];
    }

    fn samples(&self, frame: &Frame) -> u32 {
        if self.repeats == Repeats::Samples { frame.samples } else { 1 }
    }

    /// The number of the first sample in the picture.
    fn first_sample(&self, frame: &Frame) -> u32 {
        match (self.repeats, self.progressive) {
            // those of a mean that goes on are counted from its beginning
            (Repeats::Samples, true) => 0,
            (Repeats::Samples, false) => frame.index.wrapping_mul(frame.samples),
            (Repeats::Frames, _) => (frame.index + 1).wrapping_sub(self.held[0]),
        }
    }

    fn guide(&self, frame: &Frame) -> Result<Pass, Error> {
        let Integral { jitter, filter, .. } = self.integral;
        let [width, height] = self.size;
        let samples = self.held[1];
        let wide = filter == PixelFilter::BlackmanHarris;
        let flag = |on: bool, flag: u32| if on { flag } else { 0 };
        let params = GuideParams {
            scene: frame.scenes[0],
            other_scene: frame.scenes[1],
            camera: frame.camera,
            other_camera: self.last.unwrap_or(frame.camera),
            width,
            height,
            seed: self.seed,
            first_sample: self.first_sample(frame),
            samples: if jitter { samples.clamp(1, MOST_SAMPLES) } else { 1 },
            flags: flag(jitter, GuideParams::JITTER)
                | flag(wide, GuideParams::BLACKMAN_HARRIS)
                | flag(self.independent, GuideParams::INDEPENDENT),
        };
        let constants = [("features", self.integral.features(frame.features))];
        let Seen { guides, tracks } = self.planes.seen();
        let planes = [("guides", guides), ("tracks", tracks)];
        Pass::new(&denoise_guide::DESC, &constants, &params, &[ARENAS.as_slice(), &planes].concat())
    }

    fn params(&self, frame: &Frame) -> DenoiseParams {
        let [frames, samples] = self.held;
        let history = if self.last.is_some() { self.denoise.history as f32 } else { 0.0 };
        let mean =
            DenoiseParams { history, frames: frames as f32, spread: spread(&frame.camera), ..DenoiseParams::default() };
        self.denoise.params(self.size, samples, mean)
    }

    fn denoise(&mut self, frame: &Frame) -> Vec<Result<Pass, Error>> {
        let params = self.params(frame);
        let mut passes = vec![self.guide(frame)];
        passes.extend(self.planes.passes(&params, self.denoise.rounds, self.picture.output()));
        self.last = Some(frame.camera);
        self.planes.swap();
        passes
    }
}

impl Sequence for Denoised {
    fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    fn output(&self) -> BufferId {
        self.planes.denoised()
    }

    fn counts(&self) -> Option<(BufferId, [&'static str; 4])> {
        self.picture.counts()
    }

    fn primary(&self, frame: u32) -> Option<BufferId> {
        self.picture.primary(frame)
    }

    fn begin(&mut self, frame: Frame) -> Work {
        let Work { passes, blocks } = self.picture.begin(frame.clone());
        self.hold(&frame);
        let own = if frame.shows { 1 + Planes::count(self.denoise.rounds) } else { 0 };
        self.frame = Some(frame);
        self.passes = None;
        Work { passes: passes + own, blocks }
    }

    fn next_pass(&mut self) -> Option<Result<Pass, Error>> {
        if let Some(pass) = self.picture.next_pass() {
            return Some(pass);
        }
        if let Some(frame) = self.frame.take() {
            let passes = if frame.shows { self.denoise(&frame) } else { Vec::new() };
            self.passes = Some(passes.into());
        }
        self.passes.as_mut()?.pop_front()
    }
}
