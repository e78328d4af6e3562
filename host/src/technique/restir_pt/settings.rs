//! Settings of ReSTIR PT.

use crate::technique::Direct;
use crate::technique::reuse::Form;
use crate::{Error, choices, settings};
use restir_shared::resample::mutual::MAX_NEIGHBOURS;
use restir_shared::resample::params::Flags;
use restir_shared::rng::Sampler;
use restir_shared::shift::Hybrid;
use std::any::Any;

/// The most spatial passes of a frame.
pub const MAX_SPATIAL_PASSES: u32 = 4;
/// The largest cap on confidence: what the packed path holds.
pub const MAX_CONFIDENCE_CAP: u32 = 255;
/// The longest paths.
pub const MAX_DEPTH: u32 = 63;

choices! {
    /// How a path is taken to another pixel.
    pub enum Shift {
        /// It is joined at its second vertex, whatever that does to it.
        "reconnection" => Reconnection,
        /// Its random numbers are used again; only lights that are sampled are joined.
        "replay" => Replay,
        /// Replay up to the first segment that is long enough, between vertices that are rough enough (Lin et al. 2022).
        "hybrid" => Hybrid,
        /// Replay up to the first segment at whose ends the path spreads enough (Lin et al. 2026).
        "footprint" => Footprint,
    }
}

choices! {
    /// What becomes of paths that keep what arrives at a vertex, in a scene where something else may arrive there now.
    pub enum Changed {
        /// They are not reused.
        "drop" => Drop,
        /// They are reused with what arrived there in the last frame, which is biased.
        "stale" => Stale,
        /// What arrives there is traced once more by the path's random numbers, in either frame: at most as many rays a pixel and frame as two
        /// paths have segments.
        "retrace" => Retrace,
    }
}

settings! {
    /// Settings of ReSTIR PT. The defaults are unbiased.
    pub struct PtSettings {
        /// Longest path: 1 is directly visible emission, 2 adds direct light.
        max_depth: u32 = 8, in 1..=MAX_DEPTH, unit "segments";
        /// Who finds paths of up to two segments: another technique with its default settings, whose frames are added to this one's. Light
        /// through clear glass is a longer path.
        direct: Direct = Direct::UNIFIED;
        /// How paths are taken to other pixels. In scenes with blended surfaces it is replay, whatever is set: whether a ray passes
        /// such a surface is a hash of the ray, and a path that is joined has another ray.
        shift: Shift = Shift::Footprint;
        /// Of the hybrid shift: the least roughness of the vertices at both ends of a segment that is joined.
        min_roughness: f32 = 0.2, in 0.0..=2.0;
        /// Of the hybrid shift: the least length of a segment that is joined.
        min_distance: f32 = 0.1, in 0.0..=1.0e6, unit "units of the scene";
        /// Of the shift by footprint: a segment of length t is joined where t² / (p cos) > c² 4π d² / cos₁ at both of its ends: p is the
        /// density per steradian with which one end sends the path towards the other, cos the cosine at that other end, d the distance of the
        /// first surface from the camera, and cos₁ the cosine under which it is seen. This is c.
        footprint: f32 = 0.02, in 0.0..=1.0e3;
        /// Of the shift by footprint: the density p of the direction that is given up is at most 1 / r² per steradian. This is r.
        spread: f32 = 0.1, in 1.0e-6..=1.0e3;
        /// Most vertices that are replayed; a path that needs more is not reused.
        replays: u32 = MAX_DEPTH, in 0..=MAX_DEPTH, unit "vertices";
        /// How a pixel's path and those of its neighbours share what several pixels can find.
        mis: Form = Form::Pairwise;
        /// How a pixel's path and that of the last frame do: of two, pairwise is the balance heuristic with confidences.
        temporal_mis: Form = Form::Pairwise;
        /// Reuse of the last frame's paths: a pixel shares with the one that saw its surface then.
        temporal: bool = true;
        /// Where every pixel has the camera ray of the last frame, and the scene is the same, a path stays what it was, and the two of a
        /// pixel are merged by confidence alone, which is the balance heuristic then. It has no effect with jitter or a lens.
        still: bool = true;
        /// Largest confidence of the last frame's paths; an initial path has one.
        confidence_cap: u32 = 20, in 1..=MAX_CONFIDENCE_CAP, unit "initial paths";
        /// Where the scene has changed, what becomes of the last frame's paths that keep what arrived at the vertex at which they are joined, and
        /// not the light itself.
        changed: Changed = Changed::Drop;
        /// Passes of spatial reuse.
        spatial: u32 = 1, in 0..=MAX_SPATIAL_PASSES, unit "passes";
        /// Neighbours of a pass: each is the partner of a random pairing.
        neighbours: u32 = 4, in 0..=MAX_NEIGHBOURS, unit "neighbours";
        /// Side of the squares in which pixels are paired: a power of two. The squares lie elsewhere for each pairing.
        tile: u32 = 8, in 2..=256, unit "pixels";
        /// The next frame reuses what spatial reuse has made, not what it began with.
        feedback: bool = false;
        /// A neighbour farther from the tangent plane than this is left out.
        max_plane_distance: f32 = 0.02, in 0.0..=1.0e6, unit "of the distance to the camera";
        /// A neighbour whose normal has a smaller cosine with the pixel's is left out.
        min_normal_cos: f32 = 0.5, in -1.0..=1.0;
        /// Camera rays are spread over the pixel.
        jitter: bool = false;
        /// How the samples of a pixel are spread over frames.
        sampler: Sampler = Sampler::Sobol;
        /// The light that rough specular lobes lose in single scattering comes back.
        multiscatter: bool = true;
    }
    presets {
        "quality" => Self::default(),
        "progressive" => Self { temporal: false, ..Self::default() },
        "published" => Self::published(),
    }
}

impl PtSettings {
    /// Lin et al. 2022, but for where neighbours lie, and how unlike they may be: in a disk of 20 pixels there, and up to a tenth nearer to
    /// the camera or farther from it.
    fn published() -> Self {
        let default = Self::default();
        Self {
            shift: Shift::Hybrid,
            mis: Form::Counted,
            temporal_mis: Form::Pairwise,
            neighbours: 3,
            tile: 32,
            still: false,
            feedback: true,
            ..default
        }
    }

    /// The settings of a render that is of this technique.
    pub fn of(render: &crate::render::Render) -> Option<&Self> {
        (&*render.technique as &dyn Any).downcast_ref()
    }

    /// Whether the settings make sense together; ranges are for [`crate::settings::Settings::check_ranges`].
    ///
    /// # Errors
    /// [`Error::InvalidValue`] with the key of the setting.
    pub(crate) fn check_together(&self) -> Result<(), Error> {
        if !self.tile.is_power_of_two() {
            let expected = "a power of two, as 4, 8 or 16".to_owned();
            return Err(Error::InvalidValue { setting: "tile", value: self.tile.to_string(), expected });
        }
        Ok(())
    }

    /// Where paths are joined, in a scene that has blended surfaces or not.
    pub(in crate::technique) fn hybrid(&self, blended: bool) -> Hybrid {
        let criterion = match self.shift {
            _ if blended => Hybrid::REPLAY,
            Shift::Reconnection => Hybrid::RECONNECTION,
            Shift::Replay => Hybrid::REPLAY,
            Shift::Hybrid => Hybrid::new(self.min_roughness, self.min_distance),
            Shift::Footprint => Hybrid::by_footprint(self.footprint, self.spread),
        };
        Hybrid { replays: criterion.replays.min(self.replays), ..criterion }
    }

    /// Whether spatial passes are made.
    pub(super) fn shares(&self) -> bool {
        self.spatial > 0 && self.neighbours > 0
    }

    /// The kernels' flags of all passes.
    pub(super) fn flags(&self) -> Flags {
        let all = [
            (self.jitter, Flags::JITTER),
            (self.sampler == Sampler::Sobol, Flags::SOBOL),
            (!self.direct.is_unified(), Flags::INDIRECT_ONLY),
        ];
        all.into_iter().filter(|(is_on, _)| *is_on).fold(Flags::default(), |flags, (_, flag)| flags | flag)
    }
}
