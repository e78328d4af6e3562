//! Settings of ReSTIR SSS.

use crate::technique::Technique;
use crate::technique::path::{Crossings, Fit, PathSettings, RadiusChoice, Subsurface, SupportChoice, Thickness};
use crate::technique::reuse::Form;
use crate::{Error, choices, settings};
use restir_shared::resample::mutual::MAX_NEIGHBOURS;
use restir_shared::resample::params::Flags;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::PathFlags;
use restir_shared::technique::path::hybrid::MAX_SEGMENTS;

/// The most spatial passes of a frame.
const MAX_SPATIAL_PASSES: u32 = 4;
/// The largest cap on confidence: what the packed sample holds.
const MAX_CONFIDENCE_CAP: u32 = 255;
/// The longest paths.
const MAX_DEPTH: u32 = 63;

choices! {
    /// How a sample is taken to another pixel.
    pub enum Shift {
        /// The point of the body and the light stay.
        "reconnection" => Reconnection,
        /// The point is found around the other pixel's by the same random numbers; the light stays.
        "delayed" => Delayed,
        /// The point stays where the profile is smooth, and is found anew where it is not.
        "hybrid" => Hybrid,
        /// The point stays, but in the last spatial pass of a frame it is found anew; in between, each pixel finds random numbers for its point.
        "sequential" => Sequential,
    }
}

choices! {
    /// What of light under surfaces is path traced.
    pub enum Traced {
        /// Nothing: a profile stands for all of it.
        "nothing" => Nothing,
        /// What collides not at all or once; the profile is that of the rest.
        "single" => Single,
    }
}

choices! {
    /// By which samples a pixel is shaded.
    pub enum Shading {
        /// By the one that it has selected.
        "selected" => Selected,
        /// By its own and its neighbours' together, each by its weight.
        "all" => All,
    }
}

settings! {
    /// Settings of ReSTIR SSS. The defaults are unbiased.
    pub struct SssSettings {
        /// Longest path: 1 is directly visible emission, 2 adds direct light, 3 adds light under surfaces. Light that enters a body ends a path.
        max_depth: u32 = 3, in 1..=MAX_DEPTH, unit "segments";
        /// What of light under surfaces is path traced, and not resampled.
        traced: Traced = Traced::Nothing;
        /// Which fit gives the width of profiles.
        profile: Fit = Fit::Diffuse;
        /// With `traced=single`: what the profile knows of how thick a body is.
        thickness: Thickness = Thickness::Measured;
        /// Channels whose mean free path is shorter are Lambertian.
        lambert_below: f32 = 0.0, in 0.0..=1000.0, unit "pixels";
        /// How many segments of a pixel look for points. Of two, one is along the normal.
        segments: u32 = 1, in 1..=MAX_SEGMENTS;
        /// Which points of a segment through a body are candidates.
        crossings: Crossings = Crossings::All;
        /// With which probability a channel gives the radius of a point.
        radius_channel: RadiusChoice = RadiusChoice::Uniform;
        /// How the density of a point is computed.
        support: SupportChoice = SupportChoice::Exact;
        /// How samples are taken to other pixels.
        shift: Shift = Shift::Hybrid;
        /// Of the hybrid shift: points farther from the entry stay, and those two of the profile's lengths away.
        reconnected_beyond: f32 = 2.0, in 0.0..=1.0e6, unit "pixels";
        /// How a pixel's sample and those of its neighbours share what several pixels can find.
        mis: Form = Form::Defensive;
        /// How a pixel's sample and that of the last frame do: of two, pairwise is the balance heuristic with confidences.
        temporal_mis: Form = Form::Pairwise;
        /// Reuse of the last frame's samples: a pixel shares with the one that saw its surface then.
        temporal: bool = true;
        /// Largest confidence of the last frame's samples; an initial sample has one.
        confidence_cap: u32 = 10, in 1..=MAX_CONFIDENCE_CAP, unit "initial samples";
        /// Passes of spatial reuse.
        spatial: u32 = 1, in 0..=MAX_SPATIAL_PASSES, unit "passes";
        /// Neighbours of a pass: each is the partner of a random pairing.
        neighbours: u32 = 8, in 0..=MAX_NEIGHBOURS, unit "neighbours";
        /// Side of the squares in which pixels are paired: a power of two. The squares lie elsewhere for each pairing.
        tile: u32 = 8, in 2..=256, unit "pixels";
        /// By which samples a pixel is shaded. A single sample has the colours of one distance, which differ more than their brightness.
        shading: Shading = Shading::All;
        /// The next frame reuses what spatial reuse has made, not what it began with.
        feedback: bool = true;
        /// A neighbour farther from the tangent plane than this is left out.
        max_plane_distance: f32 = 1.0e6, in 0.0..=1.0e6, unit "of the distance to the camera";
        /// A neighbour whose normal has a smaller cosine with the pixel's is left out.
        min_normal_cos: f32 = -1.0, in -1.0..=1.0;
        /// Camera rays are spread over the pixel.
        jitter: bool = false;
        /// How the samples of a pixel are spread over frames.
        sampler: Sampler = Sampler::Sobol;
        /// The light that rough specular lobes lose in single scattering comes back.
        multiscatter: bool = true;
    }
    presets {
        "hybrid" => Self::default(),
        "reconnection" => Self { shift: Shift::Reconnection, ..Self::default() },
        "delayed" => Self { shift: Shift::Delayed, ..Self::default() },
        "sequential" => Self { shift: Shift::Sequential, spatial: 2, neighbours: 4, ..Self::default() },
        "pathtracing" => Self { temporal: false, spatial: 0, ..Self::default() },
        "published" => Self { mis: Form::Counted, confidence_cap: 20, shading: Shading::Selected, tile: 32, support: SupportChoice::Published, reconnected_beyond: 1.0e6, ..Self::default() },
    }
}

impl SssSettings {
    /// Whether the settings make sense together; ranges are for [`crate::settings::Settings::check_ranges`].
    ///
    /// # Errors
    /// [`Error::InvalidValue`] with the key of the setting.
    pub(super) fn check_together(&self) -> Result<(), Error> {
        if self.tile.is_power_of_two() {
            return Ok(());
        }
        let expected = "a power of two, as 8, 16 or 32".to_owned();
        Err(Error::InvalidValue { setting: "tile", value: self.tile.to_string(), expected })
    }

    /// Whether spatial passes are made.
    pub(super) fn shares(&self) -> bool {
        self.spatial > 0 && self.neighbours > 0
    }

    /// Path tracing of all that is not resampled.
    pub(super) fn path(&self) -> PathSettings {
        let subsurface = if self.traced == Traced::Single { Subsurface::Hybrid } else { Subsurface::Diffusion };
        PathSettings {
            subsurface,
            profile: self.profile,
            thickness: self.thickness,
            lambert_below: self.lambert_below,
            sampler: self.sampler,
            ..PathSettings::of(self.integral())
        }
    }

    /// The kernels' flags of all passes, but for the last spatial one of the sequential shift.
    pub(super) fn flags(&self) -> Flags {
        let all = [
            (self.jitter, Flags::JITTER),
            (self.sampler == Sampler::Sobol, Flags::SOBOL),
            (matches!(self.shift, Shift::Delayed | Shift::Hybrid), Flags::DELAYED),
            (self.shift == Shift::Hybrid, Flags::BY_CRITERION),
        ];
        all.into_iter().filter(|(is_on, _)| *is_on).fold(Flags::default(), |flags, (_, flag)| flags | flag)
    }

    /// What profiles are.
    pub(super) fn profile_flags(&self) -> PathFlags {
        let (is_whole, is_measured) = (self.traced == Traced::Nothing, self.thickness == Thickness::Measured);
        PathFlags::WHOLE.only_if(is_whole)
            | PathFlags::THICKNESS.only_if(is_measured && !is_whole)
            | PathFlags::SIGNED.only_if(self.profile == Fit::Searchlight)
            | PathFlags::CLAMPED.only_if(self.profile == Fit::Clamped)
            | PathFlags::ONE_CROSSING.only_if(self.crossings == Crossings::One)
            | PathFlags::BY_ALBEDO.only_if(self.radius_channel == RadiusChoice::Albedo)
            | PathFlags::PUBLISHED.only_if(self.support == SupportChoice::Published)
    }
}
