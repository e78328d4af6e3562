//! The passes of path tracing with diffusion.

use super::{PathSettings, Subsurface};
use crate::plan::{Buffer, BufferId};
use restir_kernels::KernelDesc;
use restir_kernels::path::{path_entry, path_exits, path_profile};
use restir_shared::camera::spread;
use restir_shared::technique::path::hybrid::*;
use restir_shared::technique::path::{PathFlags, PathParams};

crate::choices! {
    /// Which parts of subsurface light are rendered, where profiles are.
    pub enum Parts {
        /// All light.
        "all" => All,
        /// Light that enters no interior that scatters.
        "rest" => Rest,
        /// Of that, what the first surface sends on by diffuse lobes, and what shines itself.
        "diffuse" => Diffuse,
        /// Of that, what the first surface sends on by specular lobes.
        "specular" => Specular,
        /// Light that crosses bodies without a collision, in a hybrid.
        "boundary" => Boundary,
        /// Light that collides once, in a hybrid.
        "single" => Single,
        /// Light that the profile stands for.
        "profile" => Profile,
        /// All light that enters interiors that scatter.
        "subsurface" => Subsurface,
    }
}

impl Parts {
    /// Whether `part` counts.
    pub(super) fn has(self, part: Self) -> bool {
        match self {
            Self::All => true,
            Self::Rest => part.is_outside(),
            Self::Subsurface => !part.is_outside(),
            _ => self == part,
        }
    }

    /// Whether it enters no interior.
    fn is_outside(self) -> bool {
        matches!(self, Self::Rest | Self::Diffuse | Self::Specular)
    }
}

crate::choices! {
    /// The fit of a profile.
    pub enum Fit {
        /// For light that enters by Lambert's law: less what has scattered once it is nowhere negative.
        "diffuse" => Diffuse,
        /// For a beam that enters straight: less what has scattered once it is negative near the entry.
        "searchlight" => Searchlight,
        /// As for a beam, without what is negative, and with the same sum.
        "clamped" => Clamped,
    }
}

crate::choices! {
    /// What the profile of a hybrid knows of how thick a body is.
    pub enum Thickness {
        /// How far the ray of the boundary term goes through it: thin places send less back, and let more through.
        "measured" => Measured,
        /// Nothing: every body is a half space, as it is published.
        "ignored" => Ignored,
    }
}

crate::choices! {
    /// How light that has collided once comes out.
    pub enum WayOut {
        /// All the way, dimmed.
        "dimmed" => Dimmed,
        /// As far as it would go to its next collision.
        "drawn" => Drawn,
    }
}

crate::choices! {
    /// Which points of a segment through a body are taken.
    pub enum Crossings {
        /// All of them.
        "all" => All,
        /// One of them, each with the same probability.
        "one" => One,
    }
}

crate::choices! {
    /// With which probability a channel gives the radius.
    pub enum RadiusChoice {
        /// All alike.
        "uniform" => Uniform,
        /// In proportion to the albedo.
        "albedo" => Albedo,
    }
}

crate::choices! {
    /// How the density of a profile's sample point is computed.
    pub enum SupportChoice {
        /// From the segments and channels that can find the point.
        "exact" => Exact,
        /// From all channels, as published programs have it, whose light is too dark.
        "published" => Published,
    }
}

/// The planes of paths at entries and beside them, and the turns of a sample.
pub(super) struct Hybrid {
    pub(super) entries: BufferId,
    /// If paths go on from entries.
    pub(super) exits: Option<BufferId>,
    settings: PathSettings,
    /// Another technique finds what profiles hold.
    is_shared: bool,
    /// The turns to come, of the sample in work.
    pending: Option<(HybridParams, BufferId, &'static [&'static KernelDesc])>,
}

/// The turns of a sample, in their order.
const TURNS: [&KernelDesc; 3] = [&path_entry::DESC, &path_profile::DESC, &path_exits::DESC];

impl Hybrid {
    /// The planes of an image; with `is_shared` another technique finds what profiles hold.
    pub(super) fn new(
        buffers: &mut Vec<Buffer>,
        [width, height]: [u32; 2],
        settings: &PathSettings,
        is_shared: bool,
    ) -> Self {
        let mut plane = |name, bytes: usize| {
            buffers.push(Buffer { name, words: width as usize * height as usize * bytes / 4, contents: None });
            buffers.len() - 1
        };
        let entries = plane("entries", size_of::<PackedEntry>());
        let mut hybrid = Self { entries, exits: None, settings: settings.clone(), is_shared, pending: None };
        hybrid.exits = (hybrid.turns().len() > 1).then(|| plane("exits", size_of::<PackedExit>()));
        hybrid
    }

    /// What the settings are in the parameters.
    pub(super) fn flags(&self) -> PathFlags {
        let s = &self.settings;
        let shown = |part: Parts| s.parts.has(part);
        let hybrid = s.subsurface == Subsurface::Hybrid;
        let profile = shown(Parts::Profile) && !self.is_shared;
        PathFlags::REST.only_if(shown(Parts::Rest) || s.parts.is_outside())
            | PathFlags::DIFFUSE.only_if(s.parts == Parts::Diffuse)
            | PathFlags::SPECULAR.only_if(s.parts == Parts::Specular)
            | PathFlags::BOUNDARY.only_if(hybrid && shown(Parts::Boundary))
            | PathFlags::SINGLE.only_if(hybrid && shown(Parts::Single))
            | PathFlags::PROFILE.only_if(profile)
            | PathFlags::WHOLE.only_if(!hybrid || s.counted_twice)
            | PathFlags::SIGNED.only_if(s.profile == Fit::Searchlight)
            | PathFlags::CLAMPED.only_if(s.profile == Fit::Clamped)
            | PathFlags::DRAWN.only_if(s.way_out == WayOut::Drawn)
            | PathFlags::ONE_CROSSING.only_if(s.crossings == Crossings::One)
            | PathFlags::BY_ALBEDO.only_if(s.radius_channel == RadiusChoice::Albedo)
            | PathFlags::PUBLISHED.only_if(s.support == SupportChoice::Published)
            | PathFlags::GOES_ON.only_if(profile && s.profile_paths)
            | PathFlags::THICKNESS.only_if(shown(Parts::Profile) && s.knows_thickness())
    }

    /// The kernels that have something to do.
    fn turns(&self) -> &'static [&'static KernelDesc] {
        let flags = self.flags();
        let branches = flags.contains(PathFlags::BOUNDARY | PathFlags::SINGLE | PathFlags::GOES_ON);
        let profile = branches || flags.contains(PathFlags::PROFILE);
        &TURNS[..1 + usize::from(profile) + usize::from(branches)]
    }

    /// In how many dispatches a sample is done.
    pub(super) fn dispatches(&self) -> u32 {
        self.turns().len() as u32
    }

    /// Begins a sample that goes into a plane of the film.
    pub(super) fn begin(&mut self, path: PathParams, film: BufferId) {
        let lambert_below = self.settings.lambert_below * spread(&path.camera);
        let params = HybridParams { path, lambert_below, segments: self.settings.segments, reserved: [0; 2] };
        self.pending = Some((params, film, self.turns()));
    }

    /// The next turn of the sample.
    pub(super) fn next(&mut self) -> Option<(&'static KernelDesc, HybridParams, BufferId)> {
        let (params, film, turns) = self.pending?;
        let (kernel, rest) = turns.split_first()?;
        self.pending = (!rest.is_empty()).then_some((params, film, rest));
        Some((kernel, params, film))
    }
}
