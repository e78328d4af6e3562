//! Path tracing: the reference for all other techniques.

mod explain;
mod layers;
mod media;
mod orders;
mod plan;
mod replay;
mod vertices;

pub use media::{AfterSubsurface, Subsurface};
pub use orders::Orders;
pub use replay::{film, params};
pub use vertices::{Emission, Escape, NextEvent, Path, Vertex, explain_sample};

use super::{About, Integral, PixelFilter, Repeats, Technique};
use crate::exec::{Executor, Observer};
use crate::image::Channel;
use crate::render::{Render, Rendered};
use crate::technique::explain::{Explanation, Subject};
use crate::technique::sequence::{Sequence, Stage};
use crate::{Error, buffers::SceneBuffers};
use restir_shared::layout::FEATURE_SUBSURFACE;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::MAX_DEPTH;
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
        /// Light that scatters inside of things.
        subsurface: Subsurface = Subsurface::Walk;
        /// Lights inside of things are sampled where light collides, not only found. Without, punctual ones are dark.
        lights_inside: bool = true;
        /// How a path goes on that has left what scatters light.
        after_subsurface: AfterSubsurface = AfterSubsurface::Paths;
        /// How often light that counts was scattered inside of things: LO..HI, both included, or all.
        orders: Orders = Orders::ALL;
        /// Where a path ends inside of things, and its light is lost. A sample takes a dispatch for each 64.
        longest_walk: u32 = 16_384, in 1..=MAX_WALK, unit "segments";
        /// Most samples of a pixel in one dispatch, rounded down to a power of two; off leaves it to the size of the image.
        /// It does not change the image. Where light scatters inside of things, a dispatch has one.
        dispatch_samples: Option<u32> = None, unit "samples";
    }
}

impl PathSettings {
    /// The reference of all techniques that have this integral.
    pub fn of(integral: Integral) -> Self {
        let Integral { max_depth, jitter, filter, multiscatter } = integral;
        Self { max_depth, jitter, filter, multiscatter, ..Self::default() }
    }

    /// Whether paths walk through media in a scene of these features.
    fn walks(&self, features: u32) -> bool {
        self.subsurface == Subsurface::Walk && features & FEATURE_SUBSURFACE != 0
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

    fn check(&self, _scene: &SceneBuffers, _render: &Render) -> Result<(), Error> {
        if self.filter != PixelFilter::Box && !self.jitter {
            let problem =
                "samples through the centres of pixels cannot be filtered; leave out the filter or jitter=off";
            return Err(Error::Setting(problem.to_owned()));
        }
        match self.dispatch_samples {
            Some(0) => Err(Error::Setting("dispatches of 0 samples never end; give at least 1".to_owned())),
            _ => Ok(()),
        }
    }

    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<(Rendered, Vec<Channel>), Error> {
        layers::render_with_layers(self, executor, scene, render, observe)
    }

    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        if self.walks(scene.features) {
            let problem =
                "what light does inside of things is not written down; give subsurface=off to explain the rest";
            return Err(Error::Setting(problem.to_owned()));
        }
        crate::render::check(scene, render)
    }

    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::explain(executor, subject)
    }
}
