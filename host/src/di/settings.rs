//! Settings of ReSTIR DI: data, with the reasons why some of them bias.

use crate::Error;
use restir_shared::resample::mis::{INPUTS, Mis};
use restir_shared::technique::di::{
    DI_AVERAGE_VISIBILITY, DI_FINAL_RAY, DI_INITIAL_VISIBILITY, DI_JITTER, DI_MIS_SHIFT, DI_MIS_VISIBILITY,
    DI_OTHER_FRAME, DI_SCATTER_CANDIDATE, DI_STILL, DI_TARGET_SHIFT, DI_TARGET_VISIBILITY, DI_TILES, DI_TRANSMITTANCE,
};

/// The most neighbours of one combine: its own reservoir and the last frame's are inputs as well.
pub const MAX_NEIGHBOURS: u32 = INPUTS as u32 - 2;
/// The most neighbours that are shaded: those of 16 passes.
pub const MAX_SHADED: u32 = 128;
/// The most candidates from lights.
pub const MAX_CANDIDATES: u32 = 1024;
/// The most tiles of candidates.
pub const MAX_TILES: u32 = 1024;
/// The most candidates of a tile.
pub const MAX_TILE_SIZE: u32 = 32768;
/// The most spatial passes of a frame.
pub const MAX_SPATIAL_PASSES: u32 = 8;
/// The largest cap on confidence: what the packed reservoir holds.
pub const MAX_CONFIDENCE_CAP: u32 = 255;

/// How the inputs of a combine share what several of them can produce: see [`restir_shared::mis`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MisForm {
    /// By confidence alone, after the selection. Biased.
    OneOverM,
    /// Over those that can produce the selected sample.
    OneOverZ,
    /// Contribution MIS of Bitterli et al. 2020, weighted by confidence.
    Contribution,
    /// Talbot's weights, the generalised balance heuristic.
    Talbot,
    /// Pairwise, weighted by confidence.
    Pairwise,
    /// Pairwise with a share of its own for the pixel's reservoir.
    PairwiseDefensive,
    /// Pairwise with equal pairs.
    PairwiseCounted,
    /// Equal pairs, with a share of its own for the pixel's reservoir.
    PairwiseCountedDefensive,
    /// By confidence alone, inside the weights. Biased.
    Constant,
}

impl MisForm {
    /// All of them, by the names that the program knows.
    pub const ALL: [(&'static str, Self); 9] = [
        ("1/m", Self::OneOverM),
        ("1/z", Self::OneOverZ),
        ("contribution", Self::Contribution),
        ("talbot", Self::Talbot),
        ("pairwise", Self::Pairwise),
        ("pairwise-defensive", Self::PairwiseDefensive),
        ("pairwise-counted", Self::PairwiseCounted),
        ("pairwise-counted-defensive", Self::PairwiseCountedDefensive),
        ("constant", Self::Constant),
    ];

    /// The kernels' form.
    pub fn mis(self) -> Mis {
        match self {
            Self::OneOverM => Mis::ONE_OVER_M,
            Self::OneOverZ => Mis::ONE_OVER_Z,
            Self::Contribution => Mis::CONTRIBUTION,
            Self::Talbot => Mis::TALBOT,
            Self::Pairwise => Mis::PAIRWISE,
            Self::PairwiseDefensive => Mis::PAIRWISE.with(Mis::DEFENSIVE),
            Self::PairwiseCounted => Mis::PAIRWISE_COUNTED,
            Self::PairwiseCountedDefensive => Mis::PAIRWISE_COUNTED.with(Mis::DEFENSIVE),
            Self::Constant => Mis::CONSTANT,
        }
    }

    /// The program's name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, form)| *form == self).map_or("", |(name, _)| name)
    }
}

/// Where shading takes visibility from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// A ray.
    Ray,
    /// What the reservoir knows of its sample (Wyman and Panteleev 2021).
    Selected,
    /// The mean over all samples that competed (Tokuyoshi).
    Averaged,
}

impl Visibility {
    /// All of them, by the names that the program knows.
    pub const ALL: [(&'static str, Self); 3] =
        [("ray", Self::Ray), ("selected", Self::Selected), ("averaged", Self::Averaged)];

    /// The program's name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, visibility)| *visibility == self).map_or("", |(name, _)| name)
    }
}

/// What of its contribution a sample is selected by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Its luminance.
    Luminance,
    /// Its red alone; the other channels of the image are of no use.
    Red,
    /// Its green alone.
    Green,
    /// Its blue alone.
    Blue,
}

impl Target {
    /// All of them, by the names that the program knows.
    pub const ALL: [(&'static str, Self); 4] =
        [("luminance", Self::Luminance), ("red", Self::Red), ("green", Self::Green), ("blue", Self::Blue)];

    /// The program's name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }
}

/// Settings of ReSTIR DI. The defaults are unbiased.
#[derive(Clone, Debug, PartialEq)]
pub struct DiSettings {
    /// Initial candidates from lights, in 0..=[`MAX_CANDIDATES`]. Default 16.
    pub candidates: u32,
    /// At most so many groups of candidates from lights, of equal size but for the last, of each of which one is tested by a
    /// ray, in 1..=[`Self::candidates`]. Default 1.
    pub initial_rays: u32,
    /// Tiles of candidates from lights, sampled once a frame, of which each block of 8x8 pixels takes one, in
    /// 0..=[`MAX_TILES`]; none if 0, when each pixel samples its own. Pixels that share candidates share their errors. Default 0.
    pub tiles: u32,
    /// Candidates in a tile, in 1..=[`MAX_TILE_SIZE`]. Default 2048.
    pub tile_size: u32,
    /// One more candidate from scattering, which costs a ray. Default on. Biased if reservoirs are reused without
    /// [`Self::mis_visibility`].
    pub scatter: bool,
    /// Form of MIS in all combines. Default [`MisForm::PairwiseDefensive`].
    pub mis: MisForm,
    /// Reuse the last frame's reservoirs. Default on.
    pub temporal: bool,
    /// Where every pixel has the camera ray of the last frame, and the scene is the same, a pixel merges its two reservoirs by
    /// confidence alone, which is the balance heuristic then whatever [`Self::mis`] is, and takes their visibility as known.
    /// Not with [`Self::jitter`], [`Self::fused`] or a lens. Default on.
    pub still: bool,
    /// Passes of spatial reuse, in 0..=[`MAX_SPATIAL_PASSES`]. Default 1.
    pub spatial: u32,
    /// Neighbours of a pass, in 1..=[`MAX_NEIGHBOURS`]. Default 4.
    pub neighbours: u32,
    /// One pass for both: the neighbours are the last frame's. Instead of [`Self::spatial`] passes. Default off.
    pub fused: bool,
    /// Largest distance of neighbours in pixels. Default 16.
    pub radius: f32,
    /// The next frame reuses what spatial reuse has made, not what it began with. Default on.
    pub feedback: bool,
    /// Largest confidence of the last frame's reservoirs, in initial ones (one a frame), in 1..=[`MAX_CONFIDENCE_CAP`].
    /// Default 20.
    pub confidence_cap: u32,
    /// Initial samples that are occluded count for nothing (visibility reuse). Default on.
    pub initial_visibility: bool,
    /// What samples are selected by. Default [`Target::Luminance`].
    pub target: Target,
    /// Samples are selected by target times visibility. Default on.
    pub target_visibility: bool,
    /// Targets in MIS weights are multiplied by visibility. Default on.
    pub mis_visibility: bool,
    /// What shading multiplies by. Default [`Visibility::Selected`], which is exact with [`Self::mis_visibility`].
    pub visibility: Visibility,
    /// Neighbours whose samples are shaded beside the pixel's own, an even number in 0..=[`MAX_SHADED`], each by its weight in
    /// pairwise MIS, whatever [`Self::mis`] is. Default 4.
    pub shaded: u32,
    /// Largest distance of shaded neighbours in pixels. Default 16.
    pub shading_radius: f32,
    /// Neighbours nearer than this many pixels are believed to see the same, where visibility is reused. Default 0.
    pub near_radius: f32,
    /// A neighbour farther from the tangent plane than this part of the distance to the camera is left out. Default 0.02.
    pub max_plane_distance: f32,
    /// A neighbour whose normal has a smaller cosine with the pixel's is left out. Default 0.5.
    pub min_normal_cos: f32,
    /// Light passes straight through clear glass (smooth, transmitting, without a volume), up to 12 sheets of it, and is tinted;
    /// otherwise everything occludes. It costs nothing in a scene without. Default on.
    pub transmittance: bool,
    /// Spread camera rays over the pixel. Default off.
    pub jitter: bool,
}

impl Default for DiSettings {
    fn default() -> Self {
        Self {
            candidates: 16,
            initial_rays: 1,
            tiles: 0,
            tile_size: 2048,
            scatter: true,
            mis: MisForm::PairwiseDefensive,
            temporal: true,
            still: true,
            spatial: 1,
            neighbours: 4,
            fused: false,
            radius: 16.0,
            feedback: true,
            confidence_cap: 20,
            initial_visibility: true,
            target: Target::Luminance,
            target_visibility: true,
            mis_visibility: true,
            visibility: Visibility::Selected,
            shaded: 4,
            shading_radius: 16.0,
            near_radius: 0.0,
            max_plane_distance: 0.02,
            min_normal_cos: 0.5,
            transmittance: true,
            jitter: false,
        }
    }
}

impl DiSettings {
    /// The presets by name.
    pub const PRESETS: [&'static str; 8] =
        ["biased-2020", "unbiased-2020", "talbot", "wis", "quality", "offline", "progressive", "fast"];

    /// No visibility but in shading, by a ray for the one sample shaded; so no candidate from scattering, which finds only what
    /// is visible.
    pub fn visibility_in_shading() -> Self {
        Self {
            scatter: false,
            initial_visibility: false,
            target_visibility: false,
            mis_visibility: false,
            visibility: Visibility::Ray,
            shaded: 0,
            ..Self::default()
        }
    }

    /// A preset: the papers' by name and year, `quality` for views that move and `fast` for less of it; for those that stand still
    /// `offline`, of which the last frame counts, and `progressive`, whose frames are independent and have to be averaged
    /// ([`super::DiRender::accumulate`]).
    pub fn preset(name: &str) -> Option<Self> {
        // parameters of the papers
        let published = Self {
            candidates: 32,
            initial_visibility: true,
            neighbours: 3,
            radius: 30.0,
            ..Self::visibility_in_shading()
        };
        let quality = Self {
            mis: MisForm::Pairwise,
            initial_rays: 2,
            neighbours: 3,
            radius: 6.0,
            shading_radius: 4.0,
            shaded: 16,
            ..Self::default()
        };
        let still = Self {
            candidates: 32,
            tiles: 32,
            tile_size: 2048,
            initial_rays: 4,
            shading_radius: 3.0,
            ..quality.clone()
        };
        Some(match name {
            "biased-2020" => Self { mis: MisForm::OneOverM, neighbours: 5, spatial: 2, ..published },
            "unbiased-2020" => Self { mis: MisForm::Contribution, mis_visibility: true, ..published },
            "talbot" => Self { mis: MisForm::Talbot, mis_visibility: true, ..published },
            "wis" => Self { mis: MisForm::Talbot, visibility: Visibility::Averaged, neighbours: 1, ..published },
            "quality" => quality,
            "offline" => Self { spatial: 0, confidence_cap: MAX_CONFIDENCE_CAP, shaded: 32, ..still },
            "progressive" => Self { temporal: false, ..still },
            "fast" => Self { candidates: 8, neighbours: 1, ..Self::visibility_in_shading() },
            _ => return None,
        })
    }

    /// Whether the values are in range, and make sense together.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the setting.
    pub fn check(&self) -> Result<(), Error> {
        self.problem().map_or(Ok(()), |problem| Err(Error::Setting(problem)))
    }

    fn problem(&self) -> Option<String> {
        let in_range = |name, value: u32, low, high| {
            (!(low..=high).contains(&value))
                .then(|| format!("the setting {name} is {value}; it has to be from {low} to {high}"))
        };
        let positive = |name, value: f32, largest: f32| {
            (!(0.0..=largest).contains(&value))
                .then(|| format!("the setting {name} is {value}; it has to be from 0 to {largest}"))
        };
        let after = self.mis.mis().is_after_selection();
        in_range("candidates", self.candidates, 0, MAX_CANDIDATES)
            .or_else(|| in_range("initial_rays", self.initial_rays, 1, self.candidates.max(1)))
            .or_else(|| in_range("tiles", self.tiles, 0, MAX_TILES))
            .or_else(|| in_range("tile_size", self.tile_size, 1, MAX_TILE_SIZE))
            .or_else(|| in_range("spatial", self.spatial, 0, MAX_SPATIAL_PASSES))
            .or_else(|| in_range("neighbours", self.neighbours, 1, MAX_NEIGHBOURS))
            .or_else(|| in_range("shaded", self.shaded, 0, MAX_SHADED))
            .or_else(|| in_range("confidence_cap", self.confidence_cap, 1, MAX_CONFIDENCE_CAP))
            .or_else(|| positive("radius", self.radius, 4096.0))
            .or_else(|| positive("shading_radius", self.shading_radius, 4096.0))
            .or_else(|| positive("near_radius", self.near_radius, 4096.0))
            .or_else(|| positive("max_plane_distance", self.max_plane_distance, 1.0e6))
            .or_else(|| {
                (!(-1.0..=1.0).contains(&self.min_normal_cos))
                    .then(|| format!("the setting min_normal_cos is {}; it has to be from -1 to 1", self.min_normal_cos))
            })
            .or_else(|| {
                (self.candidates == 0 && !self.scatter)
                    .then(|| "no candidates: give candidates at least 1, or set scatter=on".to_owned())
            })
            .or_else(|| {
                (!self.shaded.is_multiple_of(2)).then(|| {
                    format!("the setting shaded is {}; neighbours come in pairs, so give an even number", self.shaded)
                })
            })
            .or_else(|| {
                (self.fused && !self.temporal)
                    .then(|| "fused=on reuses the last frame; set temporal=on as well".to_owned())
            })
            .or_else(|| {
                (self.target_visibility && !self.mis_visibility).then(|| {
                    "target_visibility=on needs mis_visibility=on: no reservoir has what is occluded at its own pixel"
                        .to_owned()
                })
            })
            .or_else(|| {
                (self.mis_visibility && !self.initial_visibility).then(|| {
                    "mis_visibility=on needs initial_visibility=on: the visibility of initial samples is not known"
                        .to_owned()
                })
            })
            .or_else(|| {
                (self.visibility == Visibility::Averaged && (self.mis_visibility || after)).then(|| {
                    "visibility=averaged needs mis_visibility=off and MIS weights inside (talbot, pairwise..., constant)"
                        .to_owned()
                })
            })
    }

    /// Whether pixels or frames use samples of others.
    pub fn reuses(&self) -> bool {
        self.temporal || self.spatial > 0 || self.shaded > 0
    }

    /// Why the mean of an image may be wrong; none for unbiased settings.
    pub fn biases(&self) -> Vec<&'static str> {
        let mut biases = Vec::new();
        if self.target != Target::Luminance {
            biases.push("samples are selected by one channel: the others lack the lights that have nothing of it");
        }
        if !self.reuses() {
            return biases;
        }
        let combines = self.temporal || self.spatial > 0;
        if combines && matches!(self.mis, MisForm::OneOverM | MisForm::Constant) {
            biases.push("the MIS weights count pixels that cannot produce a sample: darker");
        }
        if self.initial_visibility && !self.mis_visibility {
            biases.push("what neighbours found occluded is missing where it is visible: darker near shadows");
        }
        if self.scatter && !self.mis_visibility {
            biases.push("scattering does not find what is occluded, and weights of reused samples count on it: darker near shadows");
        }
        if self.temporal && self.visibility != Visibility::Ray && !self.mis_visibility {
            biases.push("visibility of the last frame is reused: shadows lag behind what moves");
        }
        if self.visibility == Visibility::Averaged && self.target == Target::Luminance {
            biases.push("averaged visibility does not know which colour it belongs to: leaks at coloured shadow edges");
        }
        if self.visibility != Visibility::Ray && !self.mis_visibility && self.near_radius > 0.0 {
            biases.push("near neighbours are believed to see the same: brighter in shadows");
        }
        biases
    }

    /// Candidates from lights in a group, of which one is tested by a ray.
    pub fn candidates_per_ray(&self) -> u32 {
        self.candidates.div_ceil(self.initial_rays)
    }

    /// The kernels' flags of the combine with the last frame. `same_view`: scene and camera rays are that frame's, so that both
    /// reservoirs are of one technique; confidence alone is the balance heuristic then, and replaces the form of MIS.
    pub fn temporal_flags(&self, same_view: bool) -> u32 {
        let still = same_view && self.still && !self.fused && !self.jitter;
        let settings = if still { Self { mis: MisForm::Constant, ..self.clone() } } else { self.clone() };
        settings.flags() | DI_OTHER_FRAME | if still { DI_STILL } else { 0 }
    }

    /// The kernels' flags, but for [`DI_OTHER_FRAME`] and [`DI_STILL`].
    pub fn flags(&self) -> u32 {
        let flag = |on, bit| if on { bit } else { 0 };
        flag(self.jitter, DI_JITTER)
            | flag(self.initial_visibility, DI_INITIAL_VISIBILITY)
            | flag(self.target_visibility, DI_TARGET_VISIBILITY)
            | flag(self.mis_visibility, DI_MIS_VISIBILITY)
            | flag(self.visibility == Visibility::Ray, DI_FINAL_RAY)
            | flag(self.visibility == Visibility::Averaged, DI_AVERAGE_VISIBILITY)
            | flag(self.scatter, DI_SCATTER_CANDIDATE)
            | flag(self.tiles > 0, DI_TILES)
            | flag(self.transmittance, DI_TRANSMITTANCE)
            | ((self.target as u32) << DI_TARGET_SHIFT)
            | (self.mis.mis().0 << DI_MIS_SHIFT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_sound_and_say_whether_they_bias() {
        for name in DiSettings::PRESETS {
            let preset = DiSettings::preset(name).expect("listed");
            preset.check().expect(name);
            assert_eq!(preset.biases().is_empty(), !matches!(name, "biased-2020" | "wis"), "{name}");
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
            DiSettings { fused: true, temporal: false, ..default() },
            DiSettings { tiles: MAX_TILES + 1, ..default() },
            DiSettings { tiles: 1, tile_size: 0, ..default() },
            DiSettings { mis_visibility: false, ..default() },
            DiSettings { initial_visibility: false, ..default() },
            DiSettings { visibility: Visibility::Averaged, ..default() },
            DiSettings {
                visibility: Visibility::Averaged,
                mis_visibility: false,
                target_visibility: false,
                mis: MisForm::Contribution,
                ..default()
            },
        ];
        for settings in wrong {
            settings.check().expect_err("refused");
        }
    }
}
