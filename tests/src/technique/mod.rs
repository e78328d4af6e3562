//! What the suites try of every technique of the registry.

use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Step};
use restir_host::render::Render;
use restir_host::technique::{self, Technique, configure};
use restir_kernels::Access;
use restir_shared::layout::FilmPixel;

/// Declares the files of techniques, named as their folders are.
macro_rules! known {
    ($($technique:ident),* $(,)?) => {
        $(pub mod $technique;)*

        /// What cannot be told from a technique's settings. A technique without a line has nothing of it.
        const KNOWN: &[(&str, Known)] = &[$((stringify!($technique), $technique::KNOWN)),*];
    };
}

known! {
    path,
    restir_di,
    restir_pt,
    restir_sss,
    restir_suffix,
}

/// See the fields.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Settings with which images converge to path tracing's in the scenes of the stress report.
    pub as_path: &'static str,
    /// Settings that are lengths in units of the scene.
    pub lengths: &'static [&'static str],
    /// Settings that no preset has, by name.
    pub rows: &'static [(&'static str, &'static str)],
    /// What the parity cases of its kernels are captured from.
    pub cases: Cases,
    /// The cells of `cargo lab unbiased --technique`.
    pub matrix: Matrix,
}

/// Settings whose bias is measured.
#[derive(Clone, Copy, Debug)]
pub struct Matrix {
    /// Scenes by name, with settings that suit them.
    pub scenes: &'static [(&'static str, &'static str)],
    /// The bias of the image that is to be noticed, in percent, in scenes where it is not 1.
    pub goals: &'static [(&'static str, f64)],
    /// The bias of a tile's channel that is to be noticed in half of them, in percent; infinite if any will do.
    pub tile_goal: f64,
    /// Scenes that the path tracer in `f64` does not know, with settings of path tracing that find light in another way: path tracing
    /// itself is compared with that there.
    pub beyond: &'static [(&'static str, &'static str)],
    /// Settings of all cells.
    pub common: &'static str,
    /// Cells: settings joined by commas. Whether one is biased is what [`Diagnose::biases`](restir_host::technique::Diagnose::biases) says.
    pub cells: fn() -> Vec<String>,
}

/// The bias of the image that a row of a matrix is to notice, in percent.
const GOAL: f64 = 1.0;

impl Matrix {
    /// The bias of the image that rows of the scene are to notice, in percent.
    pub fn goal(&self, scene: &str) -> f64 {
        self.goals.iter().find(|(name, _)| *name == scene).map_or(GOAL, |(_, goal)| *goal)
    }
}

/// Renders whose passes are parity cases. Every kernel of a technique has to be in one of its plans.
#[derive(Clone, Copy, Debug)]
pub struct Cases {
    /// Settings of all rows.
    pub common: &'static str,
    /// Each row is rendered with each of these settings; only once if there are none.
    pub variants: &'static [&'static str],
    /// See there.
    pub rows: &'static [Row],
}

/// A render.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// For messages.
    pub name: &'static str,
    /// Name of the scene.
    pub scene: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples or frames.
    pub count: u32,
    /// Settings.
    pub settings: &'static str,
}

/// Default settings and presets, on a few scenes.
const NOTHING: Known = Known {
    as_path: "",
    lengths: &[],
    rows: &[],
    cases: Cases {
        common: "",
        variants: &[],
        rows: &[row("defaults", "cornell", 3, ""), row("defaults", "tower", 3, ""), row("defaults", "moving", 6, "")],
    },
    matrix: Matrix {
        scenes: &[("cornell", ""), ("many-lights", "")],
        goals: &[("many-lights", 2.0)],
        tile_goal: f64::INFINITY,
        beyond: &[],
        common: "",
        cells: Vec::new,
    },
};

/// A row of the usual size.
const fn row(name: &'static str, scene: &'static str, count: u32, settings: &'static str) -> Row {
    Row { name, scene, size: [20, 14], count, settings }
}

/// What is denoised, with any technique: a technique and its render: pictures of a camera and objects that move, of bodies under whose skin light scatters, and of rays that are
/// spread over pixels with textures.
pub const DENOISED: [(&str, Row); 3] = [
    ("restir-pt", Row { name: "denoised", scene: "moving", size: [20, 14], count: 4, settings: "" }),
    ("restir-sss", Row { name: "denoised", scene: "moving-media", size: [20, 14], count: 6, settings: "" }),
    ("path", Row { name: "denoised", scene: "tower", size: [20, 14], count: 4, settings: "max_depth=3" }),
];

/// A technique, and what is tried of it.
#[derive(Debug)]
pub struct Trials {
    /// With its default settings.
    pub technique: Box<dyn Technique>,
    /// See there.
    pub known: Known,
}

impl Trials {
    /// Those of every technique.
    pub fn all() -> Vec<Self> {
        let of = |name: &str| KNOWN.iter().find(|(known, _)| *known == name.replace('-', "_"));
        let known = |name| of(name).map_or(NOTHING, |(_, known)| *known);
        technique::all().into_iter().map(|technique| Self { known: known(technique.about().name), technique }).collect()
    }

    /// Those of the technique of that name.
    ///
    /// # Errors
    /// As of [`technique::named`].
    pub fn of(name: &str) -> Result<Self, Error> {
        technique::named(name)?;
        Self::all().into_iter().find(|trials| trials.name() == name).ok_or(Error::Interrupted)
    }

    /// The technique's name.
    pub fn name(&self) -> &'static str {
        self.technique.about().name
    }

    /// The technique with further settings, `key=value` joined by commas.
    ///
    /// # Errors
    /// As of [`configure`].
    pub fn with(&self, settings: &str) -> Result<Box<dyn Technique>, Error> {
        let mut technique = self.technique.clone();
        configure_by(technique.as_mut(), settings).map(|()| technique)
    }

    /// Its presets, or the default settings if it has none; then what no preset has.
    pub fn rows(&self) -> Vec<(&'static str, Box<dyn Technique>)> {
        let with = |settings: &str| self.with(settings).expect("the harness knows the settings");
        let presets = self.technique.presets();
        let mut rows: Vec<_> = presets.iter().map(|(name, _)| (*name, with(&format!("preset={name}")))).collect();
        if rows.is_empty() {
            rows.push(("defaults", self.technique.clone()));
        }
        rows.into_iter().chain(self.known.rows.iter().map(|(name, settings)| (*name, with(settings)))).collect()
    }
}

/// Applies settings, `key=value` joined by commas.
///
/// # Errors
/// As of [`configure`].
pub fn configure_by(technique: &mut dyn Technique, settings: &str) -> Result<(), Error> {
    let texts: Vec<&str> = settings.split(',').filter(|text| !text.is_empty()).collect();
    configure(technique, &texts)
}

/// A technique by its name, with settings.
///
/// # Errors
/// As of [`technique::named`] and [`configure`].
pub fn configured(name: &str, settings: &str) -> Result<Box<dyn Technique>, Error> {
    let mut technique = technique::named(name)?;
    configure_by(technique.as_mut(), settings)?;
    Ok(technique)
}

/// Runs a render natively and shows the pictures that its film adds up, in their order: a plane of the film as the last
/// pass left it that has it as its own.
///
/// # Panics
/// If the plan is wrong.
pub fn pictures(scene: &SceneBuffers, render: &Render, observe: &mut dyn FnMut(&[FilmPixel])) {
    let mut pending: Option<(usize, Vec<FilmPixel>)> = None;
    let mut show = |step: &Step<'_>| {
        let owns = |binding: &restir_kernels::Binding| binding.access == Access::Own && binding.name == "film";
        let film = step.pass.kernel.bindings.iter().any(owns).then(|| step.pass.bound("film")).transpose()?;
        if let Some((_, picture)) = pending.take().filter(|(plane, _)| film != Some(*plane)) {
            observe(&picture);
        }
        pending = film.map(|plane| step.plane("film").map(|picture| (plane, picture))).transpose()?;
        Ok(())
    };
    CpuExecutor::inline().run_observed(render.plan(scene), &mut show).expect("the plan fits its kernels");
}
