//! Path tracing: the reference for all other techniques.
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::explain::Place;
//! use restir_host::technique::path::{PathSettings, explain_sample};
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([32, 24], PathSettings { max_depth: 4, ..PathSettings::default() }) };
//!
//! // the third sample of a pixel, vertex by vertex; its contributions are all that the film gets of it
//! let path = explain_sample(&scene, &job, Place { x: 16, y: 12, sample: 2 })?;
//! assert!((1..=4).contains(&path.vertices.len()));
//! assert_eq!(path.sum_of_parts(), path.radiance);
//! # Ok::<(), Error>(())
//! ```

mod explain;
mod hybrid;
mod layers;
mod media;
mod orders;
mod plan;
mod replay;
mod vertices;

pub use hybrid::{Crossings, Fit, Parts, RadiusChoice, SupportChoice, Thickness, WayOut};
pub use media::{AfterSubsurface, Subsurface};
pub use orders::Orders;
// of one sample, for suites
#[doc(hidden)]
pub use replay::{film, params};
pub use vertices::{Emission, Escape, NextEvent, Path, Vertex, explain_sample};

use super::{
    About, Diagnose, Integral, PixelFilter, Repeats, Technique,
    inspect::{Inspect, Layered},
};
use crate::exec::{Executor, Observer};
use crate::image::Channel;
use crate::render::Render;
use crate::sequence::{Sequence, Stage};
use crate::settings::Settings;
use crate::technique::explain::{Explanation, Subject};
use crate::{Error, buffers::SceneBuffers};
use restir_shared::layout::FEATURE_SUBSURFACE;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::MAX_DEPTH;
use restir_shared::technique::path::hybrid::MAX_SEGMENTS;
use restir_shared::technique::path::media::MAX_WALK;

crate::settings! {
    /// Settings of path tracing.
    pub struct PathSettings {
        /// Russian roulette from the fourth segment on.
        roulette: bool = false;
        /// Samples are spread over the pixel instead of going through its centre.
        jitter: bool = true;
        /// How they are spread: evenly over the pixel, or by a window 3 pixels wide.
        filter: PixelFilter = PixelFilter::Box;
        /// The light that rough specular lobes lose in single scattering comes back.
        multiscatter: bool = true;
        /// How samples are spread.
        sampler: Sampler = Sampler::Sobol;
        /// Longest path: 1 is directly visible emission, 2 adds direct light.
        max_depth: u32 = 8, in 1..=MAX_DEPTH, unit "segments";
        /// How light that scatters under surfaces is rendered.
        subsurface: Subsurface = Subsurface::Walk;
        /// Lights inside of things are sampled where light collides, not only found. Without, punctual ones are dark.
        lights_inside: bool = true;
        /// How a path goes on that has left what scatters light.
        after_subsurface: AfterSubsurface = AfterSubsurface::Paths;
        /// How often light that counts was scattered inside of things: LO..HI, both included, or all.
        orders: Orders = Orders::ALL;
        /// Longest walk inside a medium in segments; longer ones are cut and their light is lost. A sample takes a dispatch for each 64.
        longest_walk: u32 = 16_384, in 1..=MAX_WALK, unit "segments";
        /// Which parts of subsurface light are rendered, where profiles are.
        parts: Parts = Parts::All;
        /// Which fit gives the width of profiles.
        profile: Fit = Fit::Diffuse;
        /// What the profile knows of how thick a body is, in a hybrid.
        thickness: Thickness = Thickness::Measured;
        /// In a hybrid the profile keeps light that has collided once, which is then counted twice: wrong on purpose, to show the error.
        counted_twice: bool = false;
        /// How light that has collided once leaves the medium, in a hybrid.
        way_out: WayOut = WayOut::Dimmed;
        /// Which points of a profile's segment through a body are taken.
        crossings: Crossings = Crossings::All;
        /// How many segments look for points of a profile where a path enters. Of two, one is along the normal.
        segments: u32 = 2, in 1..=MAX_SEGMENTS;
        /// With which probability a channel gives the radius of a profile's sample.
        radius_channel: RadiusChoice = RadiusChoice::Uniform;
        /// How the density of a profile's sample point is computed.
        support: SupportChoice = SupportChoice::Exact;
        /// A path goes on from one of the profile's points; without, light that enters there comes straight from lights.
        profile_paths: bool = true;
        /// Channels whose mean free path is shorter are Lambertian where profiles are.
        lambert_below: f32 = 0.0, in 0.0..=1000.0, unit "pixels";
        /// Most samples of a pixel in one dispatch, rounded down to a power of two; off leaves it to the size of the image
        /// and to the device. On a GPU a dispatch has no more than 64 segments a pixel, or one path, whatever is asked for. It
        /// does not change the image. Where light scatters inside of things, a dispatch has one.
        dispatch_samples: Option<u32> = None, unit "samples";
    }
}

/// What walks are told alone, and what profiles are.
const OF_WALKS: &[&str] = &["lights_inside", "after_subsurface", "orders", "longest_walk"];
const OF_PROFILES: &[&str] = &[
    "parts",
    "profile",
    "thickness",
    "counted_twice",
    "way_out",
    "crossings",
    "segments",
    "radius_channel",
    "support",
    "profile_paths",
    "lambert_below",
];

impl PathSettings {
    /// The reference of all techniques that have this integral.
    pub fn of(integral: Integral) -> Self {
        let Integral { max_depth, jitter, filter, multiscatter } = integral;
        Self { max_depth, jitter, filter, multiscatter, ..Self::default() }
    }

    /// The frames of another technique's path tracing, which finds what profiles hold itself, from the plane `entries` on.
    pub(crate) fn without_profiles(&self, stage: &Stage) -> Box<dyn Sequence> {
        Box::new(plan::Paths::without_profiles(self, stage))
    }

    /// Whether profiles depend on how thick bodies are: fits are of what has collided more than once.
    fn knows_thickness(&self) -> bool {
        self.subsurface == Subsurface::Hybrid && !self.counted_twice && self.thickness == Thickness::Measured
    }

    /// What becomes of light inside of things in a scene of these features.
    fn subsurface(&self, features: u32) -> Subsurface {
        if features & FEATURE_SUBSURFACE != 0 { self.subsurface } else { Subsurface::Off }
    }
}

impl Technique for PathSettings {
    fn about(&self) -> &'static About {
        &About {
            name: "path",
            summary: "Path tracing with next-event estimation",
            repeats: Repeats::Samples,
            default_count: 64,
            settling: 0,
        }
    }

    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence> {
        Box::new(plan::Paths::new(self, stage))
    }

    fn integral(&self) -> Integral {
        let Self { max_depth, jitter, filter, multiscatter, .. } = *self;
        Integral { max_depth, jitter, filter, multiscatter }
    }

    fn check(&self, _scene: &SceneBuffers, _repeats: u32) -> Result<(), Error> {
        if self.filter != PixelFilter::Box && !self.jitter {
            let problem =
                "samples through the centres of pixels cannot be filtered; leave out the filter or jitter=off";
            return Err(Error::ConflictingSettings { settings: &["filter", "jitter"], problem: problem.to_owned() });
        }
        match self.dispatch_samples {
            Some(0) => Err(Error::InvalidValue {
                setting: "dispatch_samples",
                value: "0".to_owned(),
                expected: "at least 1, because dispatches without samples never end".to_owned(),
            }),
            _ => Ok(()),
        }
    }
}

impl Diagnose for PathSettings {
    fn without_effect(&self, scene: &SceneBuffers) -> Option<String> {
        let (idle, why) = match self.subsurface(scene.features) {
            Subsurface::Off => ([OF_WALKS, OF_PROFILES].concat(), "where no light is followed inside of things"),
            Subsurface::Walk => (OF_PROFILES.to_vec(), "with subsurface=walk; profiles are in diffusion and hybrid"),
            Subsurface::Diffusion | Subsurface::Hybrid => (OF_WALKS.to_vec(), "with profiles; give subsurface=walk"),
        };
        let default = Self::default();
        let set: Vec<&str> = idle.into_iter().filter(|key| self.value(key) != default.value(key)).collect();
        (!set.is_empty()).then(|| format!("has no use for {} {why}", set.join(", ")))
    }
}

impl Inspect for PathSettings {
    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<Layered<Vec<Channel>>, Error> {
        layers::render_with_layers(self, executor, scene, render, observe)
    }

    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        if self.subsurface(scene.features) != Subsurface::Off {
            let problem =
                "what light does inside of things is not written down; give subsurface=off to explain the rest";
            return Err(Error::ConflictingSettings { settings: &["subsurface"], problem: problem.to_owned() });
        }
        render.check(scene)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::explain(executor, subject)
    }
}
