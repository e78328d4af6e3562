//! Settings of suffix ReSTIR.

use crate::settings;
use crate::technique::Direct;
use crate::technique::restir_pt::{MAX_CONFIDENCE_CAP, MAX_DEPTH, PtSettings, Shift};
use restir_shared::resample::params::Flags;
use restir_shared::rng::Sampler;
use restir_shared::shift::Hybrid;
use restir_shared::technique::restir_suffix::{EndRule, MAX_BORROWED};

/// The most integration prefixes of a pixel.
const MAX_PREFIXES: u32 = 128;
/// The most rounds of spatial reuse.
const MAX_ROUNDS: u32 = 4;
/// Longest time for which a supporting prefix is kept.
const MAX_KEPT: u32 = 1 << 16;

settings! {
    /// Settings of suffix ReSTIR. The defaults are unbiased.
    pub struct SuffixSettings {
        /// Longest path: 1 is directly visible emission, 2 adds direct light.
        max_depth: u32 = 8, in 1..=MAX_DEPTH, unit "segments";
        /// Who finds paths of up to two segments: this technique, as it finds what prefixes meet on their way, or another one with its default settings.
        direct: Direct = Direct::UNIFIED;
        /// Integration prefixes of a pixel and frame: paths from the camera to where suffixes are borrowed. Time grows with their number, and noise falls.
        prefixes: u32 = 4, in 1..=MAX_PREFIXES, unit "prefixes";
        /// Suffixes that an integration prefix borrows: those of the supporting prefixes that end nearest. Of k it takes k² shifts, and k more where there is a canonical suffix.
        borrowed: u32 = 2, in 1..=MAX_BORROWED, unit "suffixes";
        /// One of so many integration prefixes, from the first on, has a suffix of its own, which counts for the others, too: with 1 each has.
        canonical: u32 = 4, in 1..=MAX_PREFIXES, unit "prefixes";
        /// How far away from the end of an integration prefix supporting ones may end: so many pixels, as seen at the length of the prefix, up to a factor of the root of 2.
        radius: f32 = 4.0, in 0.0..=1.0e3, unit "pixels";
        /// Prefixes have at least so many segments, the camera ray among them. With 1 all end at what the camera sees.
        min_segments: u32 = 2, in 1..=MAX_DEPTH, unit "segments";
        /// A prefix ends between vertices of at least this roughness.
        end_roughness: f32 = 0.2, in 0.0..=2.0;
        /// The last segment of a prefix is at least this part of it.
        end_distance: f32 = 0.01, in 0.0..=1.0;
        /// Reuse of the last frame's suffixes and supporting prefixes: a pixel goes on with those of the pixel that saw its surface then.
        temporal: bool = true;
        /// For how long a supporting prefix is kept in the mean.
        kept_for: u32 = 50, in 1..=MAX_KEPT, unit "frames";
        /// Largest confidence of the last frame's suffixes, and of borrowed ones; a new suffix has one.
        confidence_cap: u32 = 50, in 1..=MAX_CONFIDENCE_CAP, unit "new suffixes";
        /// Rounds in which supporting prefixes that end near each other share their suffixes in pairs.
        spatial: u32 = 1, in 0..=MAX_ROUNDS, unit "rounds";
        /// The next frame reuses what these rounds have made, not what they began with.
        feedback: bool = false;
        /// Prefixes that end on surfaces whose normals have a smaller cosine do not share.
        min_normal_cos: f32 = 0.5, in -1.0..=1.0;
        /// A supporting prefix is not kept if the surface that its pixel saw is farther than this from the tangent plane.
        max_plane_distance: f32 = 0.02, in 0.0..=1.0e6, unit "of the distance to the camera";
        /// How a suffix is taken to the end of another prefix, as of the technique restir-pt.
        shift: Shift = Shift::Footprint;
        /// Of the hybrid shift: the least roughness of the vertices at both ends of a segment that is joined.
        min_roughness: f32 = 0.2, in 0.0..=2.0;
        /// Of the hybrid shift: the least length of a segment that is joined.
        min_distance: f32 = 0.1, in 0.0..=1.0e6, unit "units of the scene";
        /// Of the shift by footprint: c, as of the technique restir-pt, where d is the length of the prefix.
        footprint: f32 = 0.02, in 0.0..=1.0e3;
        /// Of the shift by footprint: r, as of the technique restir-pt.
        spread: f32 = 0.1, in 1.0e-6..=1.0e3;
        /// Most vertices that are replayed; a suffix that needs more is not reused.
        replays: u32 = MAX_DEPTH, in 0..=MAX_DEPTH, unit "vertices";
        /// Camera rays are spread over the pixel.
        jitter: bool = false;
        /// How the samples of a pixel are spread over frames and integration prefixes.
        sampler: Sampler = Sampler::Sobol;
        /// The light that rough specular lobes lose in single scattering comes back.
        multiscatter: bool = true;
    }
    presets {
        "quality" => Self::default(),
        "mmis" => Self { temporal: false, spatial: 0, borrowed: 3, ..Self::default() },
        "published" => Self {
            borrowed: 1,
            canonical: MAX_PREFIXES,
            radius: 2.0,
            shift: Shift::Hybrid,
            feedback: true,
            ..Self::default()
        },
    }
}

impl SuffixSettings {
    /// Where suffixes are joined, in a scene that has blended surfaces or not.
    pub(super) fn hybrid(&self, blended: bool) -> Hybrid {
        let Self { shift, min_roughness, min_distance, footprint, spread, replays, .. } = *self;
        let paths =
            PtSettings { shift, min_roughness, min_distance, footprint, spread, replays, ..PtSettings::default() };
        paths.hybrid(blended)
    }

    /// Where prefixes end.
    pub(super) fn end_rule(&self) -> EndRule {
        let Self { min_segments, end_roughness, end_distance, .. } = *self;
        EndRule { min_segments, min_roughness: end_roughness, min_distance: end_distance }
    }

    /// The kernels' flags of all passes.
    pub(super) fn flags(&self) -> Flags {
        let jitter = if self.jitter { Flags::JITTER } else { Flags::default() };
        let sobol = if self.sampler == Sampler::Sobol { Flags::SOBOL } else { Flags::default() };
        let indirect = if self.direct.is_unified() { Flags::default() } else { Flags::INDIRECT_ONLY };
        jitter | sobol | indirect
    }
}
