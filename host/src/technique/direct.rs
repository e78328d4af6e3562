//! Direct light of techniques that find whole paths: their own, or that of another technique.

use super::{Integral, PixelFilter, Technique, all, named};
use crate::settings::Value;
use crate::{Error, buffers::SceneBuffers};

/// What whole paths converge to, of any length.
const WHOLE_PATHS: Integral = Integral { max_depth: 2, jitter: false, filter: PixelFilter::Box, multiscatter: true };

/// Who finds paths of up to two segments: light on what the camera sees, and what is seen to emit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direct(Option<&'static str>);

impl Direct {
    /// This technique, as it finds all others.
    pub const UNIFIED: Self = Self(None);

    /// The techniques that can do it instead.
    fn others() -> impl Iterator<Item = &'static str> {
        all().into_iter().filter(|other| other.for_direct_light(&WHOLE_PATHS).is_some()).map(|other| other.about().name)
    }

    /// The technique that does it instead, with its default settings, if it is another one and can.
    pub(in crate::technique) fn technique(self, integral: &Integral) -> Option<Box<dyn Technique>> {
        named(self.0?).ok()?.for_direct_light(integral)
    }

    pub(in crate::technique) fn is_unified(self) -> bool {
        self.0.is_none()
    }

    /// Whether the other technique, if there is one, can find direct light.
    ///
    /// # Errors
    /// [`Error::ConflictingSettings`] if paths are too short to have any; those of [`Technique::check`].
    pub(in crate::technique) fn check(self, of: &Integral, scene: &SceneBuffers, repeats: u32) -> Result<(), Error> {
        let max_depth = of.max_depth;
        if !self.is_unified() && max_depth < 2 {
            let problem = format!(
                "paths of {max_depth} segment have no direct light; give max_depth=2 or more, or direct=unified"
            );
            return Err(Error::ConflictingSettings { settings: &["direct", "max_depth"], problem });
        }
        self.technique(of).map_or(Ok(()), |technique| technique.check(scene, repeats))
    }

    /// Whether it reads the last frame.
    pub(in crate::technique) fn looks_back(self, of: &Integral) -> bool {
        self.technique(of).is_some_and(|technique| technique.looks_back())
    }

    /// Whether it reuses samples.
    pub(in crate::technique) fn reuses(self, of: &Integral) -> bool {
        self.technique(of).is_some_and(|technique| technique.reuses())
    }

    /// Its known biases.
    pub(in crate::technique) fn biases(self, of: &Integral) -> Vec<&'static str> {
        self.technique(of).map_or_else(Vec::new, |technique| technique.biases())
    }
}

impl Value for Direct {
    fn expected() -> String {
        ["unified"].into_iter().chain(Self::others()).collect::<Vec<_>>().join(" | ")
    }

    fn read(text: &str) -> Option<Self> {
        let other = || Self::others().find(|name| *name == text);
        if text == "unified" { Some(Self::UNIFIED) } else { other().map(|name| Self(Some(name))) }
    }

    fn write(&self) -> String {
        self.0.unwrap_or("unified").to_owned()
    }
}
