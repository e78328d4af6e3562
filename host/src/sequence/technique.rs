//! What a technique is to whoever plans frames: its passes, what they converge to, and whether they suit a scene.

use super::frames::{Sequence, Stage};
use super::pixel_filter::PixelFilter;
use crate::settings::{Declared, Settings};
use crate::{Error, buffers::SceneBuffers};
use restir_shared::layout::FEATURE_MULTISCATTER;
use std::{any::Any, fmt};

/// What the count of a render counts.
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
pub trait Technique: Settings + Diagnose + Duplicate + Any + fmt::Debug + Send + Sync {
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

    /// Whether the settings make sense together and suit the scene, for an image that is the mean of at most `repeats` samples or
    /// frames. Ranges are checked before.
    ///
    /// # Errors
    /// [`Error::InvalidValue`] or [`Error::ConflictingSettings`] that names the settings, [`Error::TooManyLights`] and [`Error::Setting`] for what of the scene is beyond the technique.
    fn check(&self, scene: &SceneBuffers, repeats: u32) -> Result<(), Error> {
        let _ = (scene, repeats);
        Ok(())
    }

    /// The technique with such settings that its frames are what paths of up to two segments carry, and nothing else, of an image that
    /// converges to `integral`: another technique may have its frames made by it then, and find longer paths alone. `None` of a technique
    /// that repeats samples, and of one that cannot be set so.
    fn for_direct_light(&self, integral: &Integral) -> Option<Box<dyn Technique>> {
        let _ = integral;
        None
    }
}

/// What there is to say of a technique's images before any is made.
pub trait Diagnose {
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

    /// With which settings, `KEY=VALUE,...`, the technique `path` shows this technique's image, if its defaults with the same [`Integral`] do not in
    /// every scene.
    fn shown_by_path(&self) -> String {
        String::new()
    }

    /// What `restir advise` tries, each as settings `KEY=VALUE,...`, with the word `last` where the last frame is the image and not
    /// the mean of all.
    fn advisable(&self) -> &'static [&'static str] {
        &[""]
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
