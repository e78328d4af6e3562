//! Techniques: what turns a scene into an image.
//!
//! A technique is a struct of settings that implements [`Technique`], in a folder of its own, and a line in `techniques!`.
//! Whatever drives techniques (renders, benchmarks, references, replay, the program, the tests) takes a
//! `Box<dyn Technique>` and knows none by name.
//!
//! ```
//! use restir_host::technique::{all, configure, named};
//!
//! // by name, with settings as text, as a program has them
//! let mut technique = named("path")?;
//! configure(&mut *technique, &["max_depth=5", "sampler=independent"])?;
//! assert_eq!(technique.value("max_depth").as_deref(), Some("5"));
//! assert_eq!(technique.integral().max_depth, 5);
//!
//! // what is wrong is told in a sentence that names the setting
//! assert!(configure(&mut *technique, &["depth=5"]).unwrap_err().to_string().contains("max_depth"));
//! assert!(all().iter().all(|technique| named(technique.about().name).is_ok()));
//! # Ok::<(), restir_host::Error>(())
//! ```

pub mod asked;
pub mod explain;
mod pixel_filter;
pub mod render;
pub mod sequence;

use crate::exec::{Executor, Observer};
use crate::render::{Render, Rendered};
use crate::settings::{Declared, Settings, unknown};
use crate::{Error, buffers::SceneBuffers, image::Channel};
use explain::{Explanation, Subject};
pub use pixel_filter::PixelFilter;
use restir_shared::layout::FEATURE_MULTISCATTER;
use sequence::{Sequence, Stage};
use std::{any::Any, fmt};

/// Declares the techniques: the folder of each, and its settings.
macro_rules! techniques {
    ($($name:ident: $settings:ident),* $(,)?) => {
        $(pub mod $name;)*

        /// Every technique with its default settings, in the order in which they are listed.
        pub fn all() -> Vec<Box<dyn Technique>> {
            vec![$($name::$settings::default().into()),*]
        }
    };
}

techniques! {
    path: PathSettings,
    restir_di: DiSettings,
    restir_pt: PtSettings,
}

/// The technique of that name with its default settings.
///
/// # Errors
/// [`Error::Unknown`] for a name that there is not.
pub fn named(name: &str) -> Result<Box<dyn Technique>, Error> {
    let found = all().into_iter().find(|technique| technique.about().name == name);
    found.ok_or_else(|| unknown("technique", name, all().iter().map(|technique| technique.about().name)))
}

/// What [`Render::count`] counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeats {
    /// Independent samples of each pixel, whose mean is the image.
    Samples,
    /// Frames, each of which may reuse what the ones before it have found; frame f shows an animated scene at frame f.
    Frames,
}

impl Repeats {
    /// What they are called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Frames => "frames",
        }
    }
}

/// What a technique is, whatever its settings are.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// The name by which it is asked for.
    pub name: &'static str,
    /// What it does, in a phrase.
    pub summary: &'static str,
    /// What its renders repeat.
    pub repeats: Repeats,
    /// How many of them a render has, unless it is told.
    pub default_count: u32,
    /// How many repeats differ from all later ones in what they cost.
    pub settling: u32,
}

/// What an image converges to: the mean over the pixel, or its value at the centre, of the light that paths carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integral {
    /// Longest path in segments: 1 is directly visible emission, 2 adds direct light.
    pub max_depth: u32,
    /// Camera rays are spread over the pixel instead of going through its centre.
    pub jitter: bool,
    /// How they are spread.
    pub filter: PixelFilter,
    /// The light that rough specular lobes lose in single scattering comes back.
    pub multiscatter: bool,
}

impl Integral {
    /// The features that its kernels may have, of those of a scene.
    pub fn features(&self, scene: u32) -> u32 {
        if self.multiscatter { scene } else { scene & !FEATURE_MULTISCATTER }
    }
}

/// A technique with its settings.
pub trait Technique: Settings + Duplicate + Any + fmt::Debug + Send + Sync {
    /// What it is.
    fn about(&self) -> &'static About;

    /// The passes of frames one after another, for settings and a scene that [`Self::check`] accepts. Others may be planned as
    /// well, for tests that have to see what is wrong with them.
    fn sequence(&self, stage: &Stage) -> Box<dyn Sequence>;

    /// Whether a frame reads the scene of the last one.
    fn looks_back(&self) -> bool {
        false
    }

    /// What the image converges to.
    fn integral(&self) -> Integral;

    /// Whether the settings make sense together and suit the scene. Ranges are checked before.
    ///
    /// # Errors
    /// [`Error::Value`] or [`Error::Together`] that names the settings, [`Error::Lights`] and [`Error::Setting`] for what of the scene is beyond the technique.
    fn check(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        let _ = (scene, render);
        Ok(())
    }

    /// What `restir advise` tries, each as settings `KEY=VALUE,...`, with the word `last` where the last frame is the image and not
    /// the mean of all.
    fn advisable(&self) -> &'static [&'static str] {
        &[""]
    }

    /// The technique with such settings that its frames are what paths of up to two segments carry, and nothing else, of an image that
    /// converges to `integral`: another technique may have its frames made by it then, and find longer paths alone. `None` of a technique
    /// that repeats samples, and of one that cannot be set so.
    fn for_direct_light(&self, integral: &Integral) -> Option<Box<dyn Technique>> {
        let _ = integral;
        None
    }

    /// Whether samples of other pixels or frames are used, so that the repeats of a render depend on each other.
    fn reuses(&self) -> bool {
        false
    }

    /// Why the mean of an image may be wrong; empty for unbiased settings.
    fn biases(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Which light of this scene the image lacks, if the technique does not follow all of it; the sentence goes on after the
    /// technique's name. What renders such a scene should say so: nothing else tells that the image is wrong.
    fn leaves_out(&self, scene: &SceneBuffers) -> Option<&'static str> {
        let _ = scene;
        None
    }

    /// Which settings differ from their defaults and do nothing in this scene, as a sentence that goes on after the technique's
    /// name; `None` if all that is set counts.
    fn without_effect(&self, scene: &SceneBuffers) -> Option<String> {
        let _ = scene;
        None
    }

    /// Why the image of this scene converges to something else than the technique `path` with the same [`Integral`] does,
    /// if it does; the sentence goes on after the technique's name.
    fn differs_from_path(&self, scene: &SceneBuffers) -> Option<&'static str> {
        self.leaves_out(scene)
    }

    /// Explains one pixel of a render. What is printed by default is what every pass reads and writes there, replayed
    /// natively and compared with the executor.
    ///
    /// # Errors
    /// As of [`crate::render::render`], and for a place outside of the image.
    fn explain(&self, executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
        explain::passes(executor, subject)
    }

    /// Whether [`Self::explain`] can be done, before a device is opened for it.
    ///
    /// # Errors
    /// As of [`crate::render::check`].
    fn check_explained(&self, scene: &SceneBuffers, render: &Render) -> Result<(), Error> {
        crate::render::check(scene, render)
    }

    /// Renders, and gives further channels that show what the technique holds after its last pass.
    ///
    /// # Errors
    /// As of [`crate::render::render`]; [`Error::Layers`] if the technique has nothing to show.
    fn render_with_layers(
        &self,
        executor: &mut dyn Executor,
        scene: &SceneBuffers,
        render: &Render,
        observe: &mut Observer<'_>,
    ) -> Result<(Rendered, Vec<Channel>), Error> {
        let _ = (executor, scene, render, observe);
        let reason = "it holds nothing beside the image";
        Err(Error::Layers { technique: self.about().name, reason })
    }
}

/// Copies of a technique behind a `Box`.
pub trait Duplicate {
    /// A copy.
    fn boxed(&self) -> Box<dyn Technique>;
}

impl<T: Technique + Declared> Duplicate for T {
    fn boxed(&self) -> Box<dyn Technique> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Technique> {
    fn clone(&self) -> Self {
        self.as_ref().boxed()
    }
}

/// The same technique with the same settings.
impl PartialEq for dyn Technique {
    fn eq(&self, other: &Self) -> bool {
        self.about().name == other.about().name && self.entries() == other.entries()
    }
}

impl<T: Technique + Declared> From<T> for Box<dyn Technique> {
    fn from(technique: T) -> Self {
        Box::new(technique)
    }
}

/// Applies settings written as `key=value`, in their order.
///
/// # Errors
/// [`Error::Technique`], around what [`Settings::set`] says.
pub fn configure(technique: &mut dyn Technique, texts: &[impl AsRef<str>]) -> Result<(), Error> {
    texts.iter().try_for_each(|text| {
        let (key, value) = text.as_ref().split_once('=').unwrap_or((text.as_ref(), ""));
        technique
            .set(key, value)
            .map_err(|error| Error::Technique { technique: technique.about().name, reason: Box::new(error) })
    })
}
