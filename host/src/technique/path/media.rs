//! The passes of paths through media.

use super::PathSettings;
use crate::plan::{Buffer, BufferId};
use restir_shared::technique::path::PathParams;
use restir_shared::technique::path::media::{MediaParams, PackedWalker, Tally};

crate::choices! {
    /// What becomes of light that interiors scatter.
    pub enum Subsurface {
        /// It is lost: interiors absorb.
        "off" => Off,
        /// It is followed from collision to collision.
        "walk" => Walk,
        /// A diffusion profile stands for all of it.
        "diffusion" => Diffusion,
        /// What collides not at all or once is followed, a diffusion profile stands for the rest.
        "hybrid" => Hybrid,
    }
}

crate::choices! {
    /// How a path goes on that has left a medium.
    pub enum AfterSubsurface {
        /// As any other, up to its last segment.
        "paths" => Paths,
        /// It finds the light that shines where it has left, and ends: as light that diffuses under surfaces is usually told from light that goes
        /// around (Zhang and d'Eon 2025).
        "direct-light" => DirectLight,
    }
}

/// Segments inside of media in one dispatch: drivers may limit the rounds of an invocation's loops (lavapipe to 65 535).
const STRETCH: u32 = 64;

/// What is counted of walks.
pub(super) const COUNTS: [&str; 4] = ["walks", "scatterings", "cut_walks", "leaked_walks"];

/// The planes of paths through media, and how they are gone through.
pub(super) struct Media {
    pub(super) walkers: BufferId,
    pub(super) tallies: BufferId,
    settings: PathSettings,
    /// The stretches of the sample in work that are to come.
    pending: Option<(MediaParams, BufferId, u32)>,
    counts_anew: bool,
}

impl Media {
    pub(super) fn new(buffers: &mut Vec<Buffer>, [width, height]: [u32; 2], settings: &PathSettings) -> Self {
        let mut plane = |name, bytes: usize| {
            buffers.push(Buffer { name, words: width as usize * height as usize * bytes / 4, contents: None });
            buffers.len() - 1
        };
        let walkers = plane("walkers", size_of::<PackedWalker>());
        let tallies = plane("tallies", size_of::<Tally>());
        Self { walkers, tallies, settings: settings.clone(), pending: None, counts_anew: true }
    }

    /// In how many dispatches the longest walk ends.
    pub(super) fn stretches(&self) -> u32 {
        // a stretch may end with its first segment, at the collision after which it is long enough
        self.settings.longest_walk / STRETCH + 1
    }

    /// Begins a sample that goes into a plane of the film.
    pub(super) fn begin(&mut self, path: PathParams, film: BufferId) {
        let params = MediaParams {
            path,
            begins: 1,
            counts_anew: u32::from(std::mem::take(&mut self.counts_anew)),
            stretch: STRETCH,
            longest_walk: self.settings.longest_walk,
            least_order: self.settings.orders.least,
            most_order: self.settings.orders.most,
            lights_inside: u32::from(self.settings.lights_inside),
            ends_after_media: u32::from(self.settings.after_subsurface == AfterSubsurface::DirectLight),
        };
        self.pending = Some((params, film, self.stretches()));
    }

    /// The next stretch of the sample.
    pub(super) fn next(&mut self) -> Option<(MediaParams, BufferId)> {
        let (params, film, left) = self.pending?;
        let after = MediaParams { begins: 0, counts_anew: 0, ..params };
        self.pending = (left > 1).then_some((after, film, left - 1));
        Some((params, film))
    }
}
