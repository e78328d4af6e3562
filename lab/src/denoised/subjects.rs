//! What is denoised.

use restir_host::Error;
use restir_host::scene::Scene;
use restir_host::technique::Technique;
use restir_tests::scenes;
use restir_tests::technique::configured;

/// A technique and its name.
pub(super) type Named = (&'static str, Box<dyn Technique>);

/// A scene, and the techniques that render it.
pub(super) struct Subject {
    pub(super) scene: &'static str,
    /// The settings of path tracing, which has the same image.
    pub(super) path: &'static str,
    /// Further techniques, with their settings.
    pub(super) others: &'static [(&'static str, &'static str)],
}

/// Scenes with large lights, a small one behind a door, many small ones, and light under skin.
pub(super) const SUBJECTS: [Subject; 4] = [
    Subject {
        scene: "cornell",
        path: "jitter=off,max_depth=4",
        others: &[("restir-pt", "max_depth=4"), ("restir-suffix", "max_depth=4")],
    },
    Subject {
        scene: "ajar",
        path: "jitter=off,max_depth=4",
        others: &[("restir-pt", "max_depth=4"), ("restir-suffix", "max_depth=4")],
    },
    Subject {
        scene: "many-lights",
        path: "jitter=off,max_depth=2",
        others: &[("restir-di", ""), ("restir-pt", "max_depth=2")],
    },
    Subject {
        scene: "skin-statue",
        path: "jitter=off,max_depth=3,subsurface=diffusion",
        others: &[("restir-sss", "")],
    },
];

/// What may hurt a denoiser in reuse, switched off or turned down: a scene, a technique, and its settings in each row.
pub(super) const VARIANTS: [(&str, &str, &[&str]); 2] = [
    (
        "many-lights",
        "restir-di",
        &[
            "",
            "confidence_cap=4",
            "feedback=off",
            "temporal=off",
            "spatial=0",
            "shaded=0",
            "spatial=0,shaded=0",
            "preset=quality",
        ],
    ),
    (
        "ajar",
        "restir-pt",
        &[
            "max_depth=4",
            "max_depth=4,confidence_cap=4",
            "max_depth=4,temporal=off",
            "max_depth=4,spatial=0",
            "max_depth=4,feedback=on",
        ],
    ),
];

impl Subject {
    pub(super) fn scene(&self) -> Result<Scene, Error> {
        scenes::named(self.scene).map_or_else(|| Scene::load(self.scene), Ok)
    }

    /// Path tracing first, each with its name.
    pub(super) fn techniques(&self) -> Result<Vec<Named>, Error> {
        let all = std::iter::once(("path", self.path)).chain(self.others.iter().copied());
        all.map(|(name, settings)| Ok((name, configured(name, settings)?))).collect()
    }
}
