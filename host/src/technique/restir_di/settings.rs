//! Settings of ReSTIR DI: data, with the reasons why some of them bias.

use crate::settings::{Declared, Value};
use crate::technique::sequence::Frame;
use crate::{Error, choices, settings};
use restir_shared::resample::mis::{INPUTS, Mis};
use restir_shared::rng::Sampler;
use restir_shared::technique::restir_di::{Flags, MAX_GLOSS_RENEWAL};
use std::any::Any;

/// The most neighbours of one combine: its own reservoir and the last frame's are inputs as well.
pub const MAX_NEIGHBOURS: u32 = INPUTS as u32 - 2;
/// The most neighbours that are shaded: those of 16 passes.
pub const MAX_SHADED: u32 = 128;
/// The most candidates from lights, over all rounds of them.
pub const MAX_CANDIDATES: u32 = 1024;
/// The most rays for candidates, over all rounds of them: drivers may limit the rounds of all loops of an invocation together (lavapipe to 65 535), and a
/// ray takes hundreds.
pub const MAX_INITIAL_RAYS: u32 = 64;
/// The most tiles of candidates.
pub const MAX_TILES: u32 = 1024;
/// The most candidates of a tile.
pub const MAX_TILE_SIZE: u32 = 32768;
/// The most spatial passes of a frame.
pub const MAX_SPATIAL_PASSES: u32 = 8;
/// The most camera rays for what is seen directly.
const MAX_SEEN_RAYS: u32 = 1024;
/// The largest cap on confidence: what the packed reservoir holds.
pub const MAX_CONFIDENCE_CAP: u32 = 255;

choices! {
    /// How far a frame reuses the last one's reservoirs.
    pub enum Temporal {
        /// Each frame begins anew.
        "off" => Off,
        /// A pixel's reservoir is combined with the one that the last frame has for what it sees.
        "on" => On,
        /// The same pass also takes the last frame's neighbours, instead of spatial passes.
        "fused" => Fused,
    }
}

choices! {
    /// Where resampling uses the visibility of samples. Each level needs what the ones before it know.
    pub enum VisibilityReuse {
        /// Nowhere: samples are chosen as if nothing was in the way.
        "off" => Off,
        /// Initial samples that are occluded count for nothing (Bitterli et al. 2020, visibility reuse).
        "candidates" => Candidates,
        /// The targets in MIS weights are multiplied by visibility, too.
        "weights" => Weights,
        /// Samples are also selected by target times visibility.
        "selection" => Selection,
    }
}

choices! {
    /// Where shading takes visibility from.
    pub enum Visibility {
        /// A ray.
        "ray" => Ray,
        /// What the reservoir knows of its sample (Wyman and Panteleev 2021).
        "selected" => Selected,
        /// The mean over all samples that competed (Tokuyoshi).
        "averaged" => Averaged,
    }
}

choices! {
    /// What of its contribution a sample is selected by.
    pub enum Target {
        /// Its luminance.
        "luminance" => Luminance,
        /// Its red alone; the other channels of the image are of no use.
        "red" => Red,
        /// Its green alone.
        "green" => Green,
        /// Its blue alone.
        "blue" => Blue,
    }
}

/// Candidates from lights that are sampled once a frame and shared by pixels; written as `32x2048`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// How many tiles there are, in 1..=[`MAX_TILES`].
    pub count: u32,
    /// Candidates in a tile, in 1..=[`MAX_TILE_SIZE`].
    pub size: u32,
}

impl Value for Tiles {
    fn expected() -> String {
        format!("COUNTxSIZE from 1x1 to {MAX_TILES}x{MAX_TILE_SIZE}")
    }

    fn read(text: &str) -> Option<Self> {
        let (count, size) = text.split_once('x')?;
        Some(Self { count: count.parse().ok()?, size: size.parse().ok()? })
    }

    fn write(&self) -> String {
        format!("{}x{}", self.count, self.size)
    }
}

settings! {
    /// Settings of ReSTIR DI. The defaults are unbiased.
    pub struct DiSettings {
        /// Initial candidates from lights, in a round where gloss_renewal draws more.
        candidates: u32 = 16, in 0..=MAX_CANDIDATES, unit "candidates";
        /// Candidates from lights are dealt into this many groups of equal size, the last perhaps smaller; of each group one
        /// candidate is selected and tested by a ray.
        initial_rays: u32 = 1, in 1..=MAX_INITIAL_RAYS, unit "rays";
        /// Candidates from lights are sampled once a frame into tiles, of which each block of 8x8 pixels takes one; off if each
        /// pixel samples its own. Pixels that share candidates share their errors.
        tiles: Option<Tiles> = None;
        /// One more candidate from scattering, which costs a ray. It biases reused reservoirs unless visibility_reuse is at
        /// least weights.
        scatter: bool = true;
        /// Form of MIS in all combines.
        mis: Mis = Mis::PAIRWISE_DEFENSIVE;
        /// Reuse of the last frame's reservoirs.
        temporal: Temporal = Temporal::On;
        /// Where every pixel has the camera ray of the last frame, and the scene is the same, a pixel merges its two reservoirs
        /// by confidence alone, which is the balance heuristic then whatever mis is, and takes their visibility as known. It
        /// has no effect with jitter, a lens, or temporal=fused.
        still: bool = true;
        /// Passes of spatial reuse; none with temporal=fused.
        spatial: u32 = 1, in 0..=MAX_SPATIAL_PASSES, unit "passes";
        /// Neighbours of a pass.
        neighbours: u32 = 4, in 1..=MAX_NEIGHBOURS, unit "neighbours";
        /// Largest distance of neighbours.
        radius: f32 = 16.0, in 0.0..=4096.0, unit "pixels";
        /// The next frame reuses what spatial reuse has made, not what it began with.
        feedback: bool = true;
        /// Largest confidence of the last frame's reservoirs; an initial reservoir has one for each round of its candidates.
        confidence_cap: u32 = 20, in 1..=MAX_CONFIDENCE_CAP, unit "rounds of candidates";
        /// How fast that falls where a glossy surface is seen from another direction than in the last frame, until it counts as
        /// one round: it is divided by 1 + gloss_fade (s a)^2 / (alpha^2 + 0.001), s being the part of specular lobes in what is
        /// scattered, a the angle in radians, and alpha that of GGX, the square of the roughness. Without it highlights that
        /// move leave very bright pixels behind.
        gloss_fade: f32 = 30.0, in 0.0..=1.0e6;
        /// Where it falls, candidates from lights are drawn in more rounds, each with its initial_rays: gloss_renewal more where nothing is left of it,
        /// and of that a share, rounded down, where a share is gone; no more than a pixel has 64 rays and 1024 candidates for, nor a tile candidates.
        gloss_renewal: u32 = 7, in 0..=MAX_GLOSS_RENEWAL, unit "rounds";
        /// What samples are selected by.
        target: Target = Target::Luminance;
        /// Where resampling uses visibility.
        visibility_reuse: VisibilityReuse = VisibilityReuse::Selection;
        /// What shading multiplies by; selected is exact if visibility_reuse is at least weights.
        visibility: Visibility = Visibility::Selected;
        /// Neighbours whose samples are shaded beside the pixel's own, an even number, each by its weight in pairwise MIS,
        /// whatever mis is.
        shaded: u32 = 4, in 0..=MAX_SHADED, unit "neighbours";
        /// Largest distance of shaded neighbours.
        shading_radius: f32 = 16.0, in 0.0..=4096.0, unit "pixels";
        /// Neighbours nearer than this are believed to see the same, where visibility is reused.
        near_radius: f32 = 0.0, in 0.0..=4096.0, unit "pixels";
        /// A neighbour farther from the tangent plane than this is left out.
        max_plane_distance: f32 = 0.02, in 0.0..=1.0e6, unit "of the distance to the camera";
        /// A neighbour whose normal has a smaller cosine with the pixel's is left out.
        min_normal_cos: f32 = 0.5, in -1.0..=1.0;
        /// Light passes straight through clear glass (smooth, transmitting, without a volume), up to 12 sheets of it, and is
        /// tinted; otherwise everything occludes. It costs nothing in a scene without.
        transmittance: bool = true;
        /// Camera rays are spread over the pixel. Without, a still view has the same rays in every frame, which reuse over time
        /// lives on.
        jitter: bool = false;
        /// With jitter, camera rays a pixel and frame of which the image has the mean of what they see directly, lamps and
        /// background. One is the ray of the frame itself; more, which trace nothing else, smooth the edges of what is bright. On
        /// processors with AVX2 a scene without an environment has them only where lamps may be seen.
        seen_rays: u32 = 1, in 1..=MAX_SEEN_RAYS, unit "rays";
        /// How the samples of a pixel are spread: over candidates and frames.
        sampler: Sampler = Sampler::Sobol;
        /// The light that rough specular lobes lose in single scattering comes back.
        multiscatter: bool = true;
    }
    presets {
        "biased-2020" => Self { mis: Mis::ONE_OVER_M, neighbours: 5, spatial: 2, ..Self::published() },
        "unbiased-2020" => Self { mis: Mis::CONTRIBUTION, visibility_reuse: VisibilityReuse::Weights, ..Self::published() },
        "talbot" => Self { mis: Mis::TALBOT, visibility_reuse: VisibilityReuse::Weights, ..Self::published() },
        "wis" => Self { mis: Mis::TALBOT, visibility: Visibility::Averaged, neighbours: 1, ..Self::published() },
        "quality" => Self::quality(),
        "offline" => Self { confidence_cap: MAX_CONFIDENCE_CAP, ..Self::tiled() },
        "progressive" => Self::progressive(),
        "fast" => Self { candidates: 8, neighbours: 1, ..Self::visibility_in_shading() },
    }
}

impl DiSettings {
    /// The presets by name.
    pub const PRESETS: &[&str] = <Self as Declared>::PRESETS;

    /// No visibility but in shading, by a ray for the one sample shaded; so no candidate from scattering, which finds only what
    /// is visible.
    pub(crate) fn visibility_in_shading() -> Self {
        Self {
            scatter: false,
            visibility_reuse: VisibilityReuse::Off,
            visibility: Visibility::Ray,
            shaded: 0,
            ..Self::default()
        }
    }

    /// A preset of that name: the papers' by name and year, `quality` for views that move and `fast` for less of it; for those
    /// that stand still `offline`, of which the last frame counts, and `progressive`, whose frames are independent and have to
    /// be averaged ([`crate::render::Render::accumulate`]).
    pub fn preset(name: &str) -> Option<Self> {
        <Self as Declared>::preset(name)
    }

    /// The settings of a render that is of this technique.
    pub fn of(render: &crate::render::Render) -> Option<&Self> {
        (&*render.technique as &dyn Any).downcast_ref()
    }

    /// Parameters of the papers.
    fn published() -> Self {
        Self {
            candidates: 32,
            visibility_reuse: VisibilityReuse::Candidates,
            neighbours: 3,
            radius: 30.0,
            ..Self::visibility_in_shading()
        }
    }

    fn quality() -> Self {
        Self { spatial: 0, neighbours: 3, radius: 6.0, shading_radius: 3.0, shaded: 32, ..Self::default() }
    }

    /// No pass shares samples between pixels before they are shaded: neighbours that had the same one would tell each other less.
    fn progressive() -> Self {
        Self {
            temporal: Temporal::Off,
            candidates: 32,
            initial_rays: 4,
            shaded: 12,
            shading_radius: 2.0,
            ..Self::quality()
        }
    }

    /// Of views that stand still.
    fn tiled() -> Self {
        Self { candidates: 32, tiles: Some(Tiles { count: 32, size: 2048 }), initial_rays: 4, ..Self::quality() }
    }

    /// Whether the settings make sense together; ranges are for [`crate::settings::Settings::check_ranges`].
    ///
    /// # Errors
    /// [`Error::InvalidValue`] for one setting, [`Error::ConflictingSettings`] for several.
    pub(crate) fn check_together(&self) -> Result<(), Error> {
        let after = self.mis.is_after_selection();
        let sized = |tiles: &Tiles| (1..=MAX_TILES).contains(&tiles.count) && (1..=MAX_TILE_SIZE).contains(&tiles.size);
        if !self.tiles.as_ref().is_none_or(sized) {
            let expected = format!("off or {}", Tiles::expected());
            return Err(Error::InvalidValue { setting: "tiles", value: self.tiles.write(), expected });
        }
        if !self.shaded.is_multiple_of(2) {
            let expected = "an even number, because neighbours come in pairs".to_owned();
            return Err(Error::InvalidValue { setting: "shaded", value: self.shaded.to_string(), expected });
        }
        let (settings, problem): (&[_], _) = if self.initial_rays > self.candidates.max(1) {
            let problem =
                format!("initial_rays={} needs as many candidates; there are {}", self.initial_rays, self.candidates);
            (&["initial_rays", "candidates"], problem)
        } else if self.candidates == 0 && !self.scatter {
            let problem = "no candidates: give candidates at least 1, or set scatter=on";
            (&["candidates", "scatter"], problem.to_owned())
        } else if self.visibility == Visibility::Averaged && (self.knows_visibility() || after) {
            let problem = "visibility=averaged needs visibility_reuse off or candidates, and MIS weights inside (talbot, \
                           pairwise..., constant)";
            (&["visibility", "visibility_reuse", "mis"], problem.to_owned())
        } else {
            return Ok(());
        };
        Err(Error::ConflictingSettings { settings, problem })
    }

    /// Whether the targets in MIS weights have visibility, so that all that is reused knows what it sees.
    #[doc(hidden)]
    pub fn knows_visibility(&self) -> bool {
        self.visibility_reuse >= VisibilityReuse::Weights
    }

    /// Rounds of candidates after the first, at most: as many of `gloss_renewal` as keep a pixel within [`MAX_INITIAL_RAYS`] and [`MAX_CANDIDATES`]. A
    /// tile that has fewer candidates would give some of them again.
    pub(super) fn renewal(&self) -> u32 {
        let candidates = self.tiles.map_or(MAX_CANDIDATES, |tiles| tiles.size.min(MAX_CANDIDATES));
        let rounds = (MAX_INITIAL_RAYS / self.initial_rays.max(1)).min(candidates / self.candidates.max(1));
        self.gloss_renewal.min(rounds.saturating_sub(1))
    }

    /// Whether occluded initial samples count for nothing.
    fn drops_occluded(&self) -> bool {
        self.visibility_reuse >= VisibilityReuse::Candidates
    }

    /// Whether other rays than those that are shaded find what is seen directly.
    pub(super) fn sees_apart(&self) -> bool {
        self.jitter && self.seen_rays > 1
    }

    /// Passes of spatial reuse that are made.
    pub(crate) fn spatial_passes(&self) -> u32 {
        if self.temporal == Temporal::Fused { 0 } else { self.spatial }
    }

    /// Why the mean of an image may be wrong; none for unbiased settings.
    pub(super) fn reasons_for_bias(&self) -> Vec<&'static str> {
        let mut biases = Vec::new();
        if self.target != Target::Luminance {
            biases.push("samples are selected by one channel: the others lack the lights that have nothing of it");
        }
        let over_time = self.temporal != Temporal::Off;
        let combines = over_time || self.spatial > 0;
        if !combines && self.shaded == 0 {
            return biases;
        }
        let known = self.knows_visibility();
        if combines && matches!(self.mis, Mis::ONE_OVER_M | Mis::CONSTANT) {
            biases.push("the MIS weights count pixels that cannot produce a sample: darker");
        }
        if self.drops_occluded() && !known {
            biases.push("what neighbours found occluded is missing where it is visible: darker near shadows");
        }
        if self.scatter && !known {
            biases.push("scattering does not find what is occluded, and weights of reused samples count on it: darker near shadows");
        }
        if over_time && self.visibility != Visibility::Ray && !known {
            biases.push("visibility of the last frame is reused: shadows lag behind what moves");
        }
        if self.visibility == Visibility::Averaged && self.target == Target::Luminance {
            biases.push("averaged visibility does not know which colour it belongs to: leaks at coloured shadow edges");
        }
        if self.visibility != Visibility::Ray && !known && self.near_radius > 0.0 {
            biases.push("near neighbours are believed to see the same: brighter in shadows");
        }
        biases
    }

    /// Whether scene and camera rays are the last frame's, so that both reservoirs of a pixel are of one technique, and they are merged as
    /// such: confidence alone is the balance heuristic then, and replaces the form of MIS.
    pub(super) fn merges_as_still(&self, now: &Frame) -> bool {
        self.still && self.temporal != Temporal::Fused && !self.jitter && now.is_still()
    }

    /// The kernels' flags, but for [`Flags::OTHER_FRAME`] and [`Flags::STILL`].
    #[doc(hidden)]
    pub fn flags(&self) -> Flags {
        [
            (self.jitter, Flags::JITTER),
            (self.drops_occluded(), Flags::INITIAL_VISIBILITY),
            (self.visibility_reuse == VisibilityReuse::Selection, Flags::TARGET_VISIBILITY),
            (self.knows_visibility(), Flags::MIS_VISIBILITY),
            (self.visibility == Visibility::Ray, Flags::FINAL_RAY),
            (self.visibility == Visibility::Averaged, Flags::AVERAGE_VISIBILITY),
            (self.scatter, Flags::SCATTER_CANDIDATE),
            (self.tiles.is_some(), Flags::TILES),
            (self.sampler == Sampler::Sobol, Flags::SOBOL),
            (self.transmittance, Flags::TRANSMITTANCE),
            (self.sees_apart(), Flags::PRIMARY_EMISSION_EXTERNAL),
            (self.target == Target::Red, Flags::RED),
            (self.target == Target::Green, Flags::GREEN),
            (self.target == Target::Blue, Flags::BLUE),
        ]
        .into_iter()
        .filter(|(is_on, _)| *is_on)
        .fold(Flags::of_form(self.mis), |flags, (_, flag)| flags | flag)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    #[test]
    fn presets_are_sound_and_say_whether_they_bias() {
        for &name in DiSettings::PRESETS {
            let preset = DiSettings::preset(name).expect("listed");
            preset.check_ranges().expect(name);
            preset.check_together().expect(name);
            assert_eq!(preset.reasons_for_bias().is_empty(), !matches!(name, "biased-2020" | "wis"), "{name}");
        }
        assert!(DiSettings::preset("none").is_none());
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let default = DiSettings::default;
        let wrong = [
            DiSettings { neighbours: MAX_NEIGHBOURS + 1, ..default() },
            DiSettings { radius: f32::NAN, ..default() },
            DiSettings { shading_radius: -1.0, ..default() },
            DiSettings { shaded: MAX_SHADED + 1, ..default() },
            DiSettings { initial_rays: 0, ..default() },
            DiSettings { initial_rays: 17, ..default() },
            DiSettings { candidates: 0, scatter: false, ..default() },
            DiSettings { tiles: Some(Tiles { count: MAX_TILES + 1, size: 1 }), ..default() },
            DiSettings { tiles: Some(Tiles { count: 1, size: 0 }), ..default() },
            DiSettings { visibility: Visibility::Averaged, ..default() },
            DiSettings {
                visibility: Visibility::Averaged,
                visibility_reuse: VisibilityReuse::Off,
                mis: Mis::CONTRIBUTION,
                ..default()
            },
        ];
        for settings in wrong {
            settings.check_ranges().and_then(|()| settings.check_together()).expect_err("refused");
        }
    }
}
