//! The passes from a picture, of which is known what its pixels see, to the denoised one.

use crate::Error;
use crate::plan::{Buffer, BufferId, Pass};
use restir_kernels::denoise::{
    denoise_accumulate, denoise_contrast, denoise_estimate, denoise_filter, denoise_modulate, denoise_share,
};
use restir_shared::denoise::{DenoiseParams, Estimate, Guide, History, Share, Track};
use restir_shared::layout::FilmPixel;

/// Planes that two frames, or two rounds, have in turn, and those that one frame has.
pub(crate) struct Planes {
    guides: [BufferId; 2],
    means: [BufferId; 2],
    estimates: [BufferId; 2],
    tracks: BufferId,
    shares: BufferId,
    denoised: BufferId,
}

/// Where to write what the pixels of a frame see.
pub(crate) struct Seen {
    pub(crate) guides: BufferId,
    pub(crate) tracks: BufferId,
}

impl Planes {
    pub(crate) fn new(buffers: &mut Vec<Buffer>, [width, height]: [u32; 2]) -> Self {
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

    pub(crate) fn seen(&self) -> Seen {
        Seen { guides: self.guides[0], tracks: self.tracks }
    }

    pub(crate) fn denoised(&self) -> BufferId {
        self.denoised
    }

    /// What is of this frame becomes that of the last one.
    pub(crate) fn swap(&mut self) {
        self.guides.swap(0, 1);
        self.means.swap(0, 1);
    }

    /// How many passes there are.
    pub(crate) fn count(rounds: u32) -> u64 {
        4 + 2 * u64::from(rounds)
    }

    pub(crate) fn passes(&self, params: &DenoiseParams, rounds: u32, picture: BufferId) -> Vec<Result<Pass, Error>> {
        let Self { guides: [guides, other_guides], means: [means, other_means], estimates, tracks, shares, denoised } =
            *self;
        let mut passes = Vec::new();
        let seen = [("picture", picture), ("guides", guides), ("tracks", tracks)];
        let history = [("other_guides", other_guides), ("other_means", other_means), ("means", means)];
        passes.push(Pass::new(&denoise_accumulate::DESC, &[], params, &[seen, history].concat()));
        // where the first round's output goes
        let known = [("guides", guides), ("means", means), ("contrasts", estimates[1])];
        passes.push(Pass::new(&denoise_contrast::DESC, &[], params, &known));
        let noise = [known.as_slice(), &[("estimates", estimates[0])]].concat();
        passes.push(Pass::new(&denoise_estimate::DESC, &[], params, &noise));
        for round in 0..rounds {
            let (from, to) = (estimates[round as usize % 2], estimates[(round as usize + 1) % 2]);
            let step = 1 << round;
            let params = DenoiseParams { step, deviations: params.deviations / step as f32, ..*params };
            let [seen, worth] = [("guides", guides), ("shares", shares)];
            passes.push(Pass::new(&denoise_share::DESC, &[], &params, &[seen, ("means", means), worth]));
            let bound = [seen, worth, ("estimates", from), ("filtered", to)];
            passes.push(Pass::new(&denoise_filter::DESC, &[], &params, &bound));
        }
        let filtered = [("filtered", estimates[rounds as usize % 2]), ("denoised", denoised)];
        passes.push(Pass::new(&denoise_modulate::DESC, &[], params, &[seen.as_slice(), &filtered].concat()));
        passes
    }
}
