//! What is measured: a technique with its settings, and the path tracing that it is compared with.

use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene};
use restir_tests::technique::configured;

use super::FRAMES;

/// A scene as it is seen.
pub(super) struct Pictured {
    scene: &'static str,
    /// What fills its bodies, and how long a millimetre is.
    medium: Option<(&'static str, f64)>,
    /// The camera orbits.
    pub(super) orbits: bool,
}

impl Pictured {
    const fn new(scene: &'static str, orbits: bool) -> Self {
        Self { scene, medium: None, orbits }
    }

    const fn filled(scene: &'static str, medium: (&'static str, f64), orbits: bool) -> Self {
        Self { scene, medium: Some(medium), orbits }
    }

    /// For tables.
    pub(super) fn name(&self) -> String {
        let medium = self.medium.map(|(name, scale)| format!(" of {name}, {scale}")).unwrap_or_default();
        format!("{}{medium}{}", self.scene, if self.orbits { ", from an orbit" } else { "" })
    }

    pub(super) fn scene(&self) -> Result<Scene, Error> {
        let mut scene = Scene::load(self.scene)?;
        if !scene.has_light() {
            scene.add_default_light();
        }
        if let Some((medium, scale)) = self.medium {
            scene.fill(medium, Some(scale))?;
            // what comes without a camera is seen as a whole
            let seen = SceneBuffers::build(&scene)?.camera;
            let closer = |camera: Camera| Camera { vertical_fov: camera.vertical_fov * CLOSER, ..camera };
            scene.camera = Some(closer(seen));
        }
        Ok(scene)
    }
}

/// Bodies fill the picture: by this part of the angle of view.
const CLOSER: f64 = 0.6;

/// A technique beside path tracing.
pub(super) struct Study {
    /// The name of the report.
    pub(super) report: &'static str,
    technique: &'static str,
    /// What it is called.
    pub(super) title: &'static str,
    /// The settings of path tracing.
    pub(super) path: &'static str,
    pub(super) views: &'static [Pictured],
    /// Settings, and whether their mean over all frames is looked at, and not the last frame.
    pub(super) settings: &'static [(&'static str, bool)],
    /// Techniques and settings of which is looked at what errors have in common, too.
    pub(super) correlated: &'static [(&'static str, &'static str)],
    /// Techniques and settings of which is looked at how noisy surfaces are that come into view.
    pub(super) uncovered: &'static [(&'static str, &'static str)],
    /// What changes of a scene do to it is measured, too.
    pub(super) moving: bool,
    /// The settings of path tracing where it renders a part of the picture.
    pub(super) part_of_path: &'static str,
    /// Parts of the picture whose variance is measured: the name, whether path tracing renders it and not the technique, and settings.
    pub(super) parts: &'static [(&'static str, bool, &'static str)],
}

/// ReSTIR PT.
pub(super) const PATHS: Study = Study {
    report: "restir-pt-gains",
    technique: "restir-pt",
    title: "ReSTIR PT",
    path: "jitter=off",
    views: &[
        Pictured::new("ajar", false),
        Pictured::new("tower", false),
        Pictured::new("cornell", false),
        Pictured::new("cornell", true),
    ],
    settings: &[
        ("", false),
        ("still=off", false),
        ("neighbours=8", false),
        ("neighbours=2", false),
        ("tile=4", false),
        ("shift=hybrid", false),
        ("shift=reconnection", false),
        ("shift=replay", false),
        ("replays=0", false),
        ("mis=pairwise-defensive", false),
        ("confidence_cap=5", false),
        ("spatial=0", false),
        ("temporal=off", false),
        ("temporal=off,spatial=0", false),
        ("feedback=on", false),
        ("preset=published", false),
        ("direct=restir-di", false),
        ("temporal=off,spatial=0", true),
        ("preset=progressive", true),
        ("preset=progressive,neighbours=8", true),
        ("preset=progressive,neighbours=2", true),
    ],
    correlated: &[
        ("restir-pt", ""),
        ("restir-pt", "tile=4"),
        ("restir-pt", "spatial=0"),
        ("restir-pt", "temporal=off"),
        ("restir-pt", "feedback=on"),
        ("restir-pt", "preset=published"),
    ],
    uncovered: &[],
    moving: true,
    part_of_path: "",
    parts: &[],
};

/// Suffix ReSTIR.
pub(super) const SUFFIXES: Study = Study {
    report: "restir-suffix-gains",
    technique: "restir-suffix",
    title: "suffix ReSTIR",
    path: "jitter=off",
    views: PATHS.views,
    settings: &[
        ("", false),
        ("prefixes=1", false),
        ("prefixes=8", false),
        ("prefixes=16", false),
        ("borrowed=1", false),
        ("borrowed=3", false),
        ("borrowed=4", false),
        ("canonical=1", false),
        ("prefixes=8,canonical=8", false),
        ("direct=restir-di", false),
        ("prefixes=8,direct=restir-di", false),
        ("prefixes=16,canonical=16", false),
        ("prefixes=16,canonical=1", false),
        ("sampler=independent", false),
        ("radius=2", false),
        ("spatial=0", false),
        ("spatial=2", false),
        ("feedback=on", false),
        ("kept_for=200,confidence_cap=200", false),
        ("temporal=off", false),
        ("temporal=off,spatial=0", false),
        ("preset=mmis", false),
        ("preset=published", false),
        ("temporal=off,spatial=0", true),
        ("", true),
        ("prefixes=8", true),
    ],
    correlated: &[
        ("restir-suffix", ""),
        ("restir-suffix", "prefixes=8"),
        ("restir-suffix", "spatial=2"),
        ("restir-suffix", "feedback=on"),
        ("restir-suffix", "preset=mmis"),
        ("restir-pt", ""),
        ("restir-pt", "feedback=on"),
    ],
    uncovered: &[
        ("restir-suffix", ""),
        ("restir-suffix", "prefixes=8"),
        ("restir-suffix", "preset=mmis"),
        ("restir-pt", ""),
        ("restir-pt", "feedback=on"),
    ],
    moving: false,
    part_of_path: "",
    parts: &[],
};

/// ReSTIR SSS.
pub(super) const SUBSURFACE: Study = Study {
    report: "restir-sss-gains",
    technique: "restir-sss",
    title: "ReSTIR SSS",
    path: "jitter=off,max_depth=3,subsurface=diffusion,profile_paths=off,segments=1",
    views: &[
        Pictured::filled("statue", ("skin1", 0.1), true),
        Pictured::filled("statue", ("skin1", 0.1), false),
        Pictured::filled("statue", ("marble", 0.02), true),
        Pictured::filled("assets/bunny.glb", ("skin1", 0.1), true),
    ],
    settings: &[
        ("", false),
        ("preset=reconnection", false),
        ("preset=delayed", false),
        ("preset=sequential", false),
        ("preset=published", false),
        ("reconnected_beyond=1e6", false),
        ("reconnected_beyond=4", false),
        ("neighbours=4", false),
        ("tile=16", false),
        ("feedback=off", false),
        ("shading=selected", false),
        ("mis=pairwise", false),
        ("confidence_cap=20", false),
        ("spatial=0", false),
        ("temporal=off", false),
        ("preset=reconnection,temporal=off", false),
        ("preset=pathtracing", false),
    ],
    correlated: &[],
    uncovered: &[],
    moving: false,
    part_of_path: "jitter=off,max_depth=3,subsurface=hybrid,profile_paths=off,segments=1",
    parts: &[
        ("light that enters nothing", true, "parts=rest"),
        ("boundary term", true, "parts=boundary"),
        ("single scattering", true, "parts=single"),
        ("profile", true, "parts=profile"),
        ("all", true, "parts=all"),
        ("all, the profile resampled", false, "traced=single"),
    ],
};

impl Study {
    /// The name of the technique.
    pub(super) fn technique(&self) -> &'static str {
        self.technique
    }

    /// Path tracing through the middles of pixels, as the technique has it.
    pub(super) fn path_tracing(&self, size: [u32; 2]) -> Result<Render, Error> {
        Ok(Render::new(size, configured("path", self.path)?))
    }

    /// Frames of the technique with settings beside its defaults.
    pub(super) fn chain(&self, size: [u32; 2], text: &str) -> Result<Render, Error> {
        chain(self.technique, size, text)
    }
}

/// Frames of a technique with settings beside its defaults.
pub(super) fn chain(technique: &str, size: [u32; 2], text: &str) -> Result<Render, Error> {
    Ok(Render { count: FRAMES, ..Render::new(size, configured(technique, text)?) })
}
