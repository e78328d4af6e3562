//! The denoiser's passes after those of a technique.

use super::Denoise;
use crate::Error;
use crate::plan::{ARENAS, Buffer, BufferId, Pass};
use crate::sequence::pixel_filter::PixelFilter;
use crate::sequence::technique::Integral;
use crate::sequence::{Frame, Sequence, Stage, Work};
use restir_kernels::denoise::{
    denoise_accumulate, denoise_contrast, denoise_estimate, denoise_filter, denoise_guide, denoise_modulate,
    denoise_share,
};
use restir_shared::camera::spread;
use restir_shared::denoise::{DenoiseParams, Estimate, Guide, GuideParams, History, Share, Track};
use restir_shared::layout::{CameraParams, FilmPixel};
use std::collections::VecDeque;

/// Most samples of a pixel that its reflectance is a mean of.
const MOST_SAMPLES: u32 = 16;

/// The frames of a technique, each of which is denoised where it is shown.
pub(super) struct Denoised {
    denoise: Denoise,
    integral: Integral,
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

/// Planes that two frames, or two rounds, have in turn, and those that one frame has.
struct Planes {
    guides: [BufferId; 2],
    means: [BufferId; 2],
    estimates: [BufferId; 2],
    tracks: BufferId,
    shares: BufferId,
    denoised: BufferId,
}

impl Planes {
    fn new(buffers: &mut Vec<Buffer>, [width, height]: [u32; 2]) -> Self {
        let mut add = |name, bytes: usize| {
            buffers.push(Buffer { name, words: bytes / 4 * width as usize * height as usize, contents: None });
            buffers.len() - 1
        };
        let mut pair = |name, bytes| [add(name, bytes), add(name, bytes)];
        Self {
            guides: pair("guides", size_of::<Guide>()),
            means: pair("means", size_of::<History>()),
            estimates: pair("estimates", size_of::<Estimate>()),
            tracks: add("tracks", size_of::<Track>()),
            shares: add("shares", size_of::<Share>()),
            denoised: add("denoised", size_of::<FilmPixel>()),
        }
    }
}

impl Denoised {
    pub(super) fn new(denoise: Denoise, integral: Integral, picture: Box<dyn Sequence>, stage: &Stage) -> Self {
        let mut buffers = picture.buffers().to_vec();
        let planes = Planes::new(&mut buffers, stage.size);
        Self {
            denoise,
            integral,
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
        self.held = [frames.saturating_add(1), samples.saturating_add(frame.samples)];
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
            // samples of a mean that goes on begin with the first
            first_sample: if self.progressive { 0 } else { frame.index.wrapping_mul(frame.samples) },
            samples: if jitter { samples.clamp(1, MOST_SAMPLES) } else { 1 },
            flags: flag(jitter, GuideParams::JITTER) | flag(wide, GuideParams::BLACKMAN_HARRIS),
        };
        let constants = [("features", self.integral.features(frame.features))];
        let planes = [("guides", self.planes.guides[0]), ("tracks", self.planes.tracks)];
        Pass::new(&denoise_guide::DESC, &constants, &params, &[ARENAS.as_slice(), &planes].concat())
    }

    fn params(&self, frame: &Frame) -> DenoiseParams {
        let [width, height] = self.size;
        let Denoise { history, deviations, .. } = self.denoise;
        DenoiseParams {
            width,
            height,
            step: 1,
            history: if self.last.is_some() { history as f32 } else { 0.0 },
            frames: self.held[0] as f32,
            spread: spread(&frame.camera),
            deviations,
            reserved: 0,
        }
    }

    fn denoise(&mut self, frame: &Frame) -> Vec<Result<Pass, Error>> {
        let (params, picture) = (self.params(frame), self.picture.output());
        let Planes { guides: [guides, other_guides], means: [means, other_means], estimates, tracks, shares, denoised } =
            self.planes;
        let mut passes = vec![self.guide(frame)];
        let seen = [("picture", picture), ("guides", guides), ("tracks", tracks)];
        let history = [("other_guides", other_guides), ("other_means", other_means), ("means", means)];
        passes.push(Pass::new(&denoise_accumulate::DESC, &[], &params, &[seen, history].concat()));
        // where the first round's output goes
        let known = [("guides", guides), ("means", means), ("contrasts", estimates[1])];
        passes.push(Pass::new(&denoise_contrast::DESC, &[], &params, &known));
        let noise = [known.as_slice(), &[("estimates", estimates[0])]].concat();
        passes.push(Pass::new(&denoise_estimate::DESC, &[], &params, &noise));
        for round in 0..self.denoise.rounds {
            let (from, to) = (estimates[round as usize % 2], estimates[(round as usize + 1) % 2]);
            let step = 1 << round;
            let params = DenoiseParams { step, deviations: params.deviations / step as f32, ..params };
            let [seen, worth] = [("guides", guides), ("shares", shares)];
            passes.push(Pass::new(&denoise_share::DESC, &[], &params, &[seen, ("means", means), worth]));
            let bound = [seen, worth, ("estimates", from), ("filtered", to)];
            passes.push(Pass::new(&denoise_filter::DESC, &[], &params, &bound));
        }
        let filtered = [("filtered", estimates[self.denoise.rounds as usize % 2]), ("denoised", denoised)];
        let bound = [seen.as_slice(), &filtered].concat();
        passes.push(Pass::new(&denoise_modulate::DESC, &[], &params, &bound));
        self.last = Some(frame.camera);
        self.planes.guides.swap(0, 1);
        self.planes.means.swap(0, 1);
        passes
    }
}

impl Sequence for Denoised {
    fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    fn output(&self) -> BufferId {
        self.planes.denoised
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
        let own = if frame.shows { 5 + 2 * u64::from(self.denoise.rounds) } else { 0 };
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
