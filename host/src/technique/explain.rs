//! Explanations of a pixel of a render, and the one that every technique has: what each of its passes writes there.
//!
//! ```
//! use restir_host::exec::CpuExecutor;
//! use restir_host::render::Render;
//! use restir_host::technique::explain::{Place, Subject, passes};
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::{Error, buffers::SceneBuffers, scene::Scene};
//!
//! let scene = Scene::load("cornell")?;
//! let buffers = SceneBuffers::build(&scene)?;
//! let render = Render { count: 2, ..Render::new([16, 16], DiSettings::default()) };
//! let subject = Subject { scene: &scene, buffers: &buffers, render: &render, place: Place { x: 8, y: 8, sample: 0 } };
//!
//! // a replay on the host is compared with the executor, here the host itself
//! let explanation = passes(&mut CpuExecutor::new()?, subject)?;
//! assert!(explanation.text.contains("pixel (8, 8)") && explanation.json["identical"] == true);
//! # Ok::<(), Error>(())
//! ```

use crate::exec::{CpuExecutor, Executor, Step};
use crate::technique::{About, Repeats};
use crate::{Error, buffers::SceneBuffers, plan::BufferId, render::Render, scene::Scene};
use restir_kernels::{Access, Binding};
use restir_shared::{glam::Vec3, scene::LightKind};
use serde_json::{Value, json};
use std::fmt::Write;

/// What is explained.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same as kernels see it.
    pub buffers: &'a SceneBuffers,
    /// The render.
    pub render: &'a Render,
    /// The place in its image.
    pub place: Place,
}

/// A pixel, and a sample of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Column of the pixel, from the left.
    pub x: u32,
    /// Row of the pixel, from the top.
    pub y: u32,
    /// Index of the sample; of a technique of frames the last one is explained.
    pub sample: u32,
}

impl Place {
    /// Whether the pixel lies in the image.
    ///
    /// # Errors
    /// [`Error::Pixel`] if it does not.
    pub fn check(&self, render: &Render) -> Result<(), Error> {
        let (Self { x, y, .. }, Render { width, height, .. }) = (self, render);
        if x < width && y < height {
            return Ok(());
        }
        Err(Error::Pixel { pixel: [*x, *y], size: [*width, *height] })
    }
}

/// An explanation in two forms.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// Lines for a reader.
    pub text: String,
    /// The same as an object.
    pub json: Value,
}

/// What a pass has written for the pixel.
#[derive(PartialEq)]
struct Written {
    kernel: &'static str,
    planes: Vec<(&'static str, Vec<u32>)>,
}

impl Written {
    /// Nothing for a pass whose grid is not the image.
    fn by(step: &Step<'_>, render: &Render, index: usize) -> Result<Option<Self>, Error> {
        if step.pass.grid != [render.width, render.height] {
            return Ok(None);
        }
        let own = step.pass.bindings().filter(|(binding, _)| binding.access == Access::Own);
        let plane = |(binding, id): (&Binding, BufferId)| {
            let words = binding.stride as usize / 4;
            Ok((binding.name, step.read(id)?[index * words..][..words].to_vec()))
        };
        Ok(Some(Self { kernel: step.pass.kernel.name, planes: own.map(plane).collect::<Result<_, Error>>()? }))
    }
}

/// What every pass of a render writes for a pixel, natively and on the executor.
///
/// # Errors
/// As of [`Render::render`], and for a pixel outside of the image.
#[doc(hidden)]
pub fn passes(executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
    let Subject { scene, buffers, render, place: Place { x, y, sample } } = subject;
    subject.place.check(render)?;
    let About { name, repeats, .. } = render.technique.about();
    let count = if *repeats == Repeats::Samples { sample.saturating_add(1) } else { render.count };
    let render = Render { count, ..render.clone() };
    let Render { width, height, seed, .. } = render;
    let index = (y * width + x) as usize;
    let written = |executor: &mut dyn Executor| {
        let mut all = Vec::new();
        let rendered = render.render_observed(buffers, executor, &mut |step| {
            all.extend(Written::by(step, &render, index)?);
            Ok(())
        });
        rendered.map(|_| all)
    };
    let native = written(&mut CpuExecutor::with_threads(1)?)?;
    let device = written(executor)?;
    let (scene, repeats) = (&scene.name, repeats.name());
    let mut text =
        format!("{scene}, {width} x {height} pixels, {name}: pixel ({x}, {y}), {count} {repeats}, seed {seed}\n");
    let mut rows = Vec::new();
    for (native, device) in native.iter().zip(&device) {
        let same = native == device;
        let _ = writeln!(text, "{}: {}", native.kernel, verdict(same));
        for (plane, words) in &native.planes {
            let floats: Vec<String> = words.iter().map(|&word| format!("{:e}", f32::from_bits(word))).collect();
            let _ = writeln!(text, "   {plane}: {words:08x?}, as numbers {}", floats.join(" "));
        }
        let planes: Vec<Value> =
            native.planes.iter().map(|(plane, words)| json!({"plane": plane, "words": words})).collect();
        rows.push(json!({"kernel": native.kernel, "planes": planes, "identical": same}));
    }
    let json = json!({
        "scene": scene,
        "technique": name,
        "pixel": [x, y],
        "seed": seed,
        "passes": rows,
        "identical": native == device,
    });
    Ok(Explanation { text, json })
}

/// What is said of bits that a replay has found the same, or not.
pub(super) fn verdict(same: bool) -> &'static str {
    if same { "the same bits" } else { "OTHER BITS" }
}

/// Three numbers for a reader.
pub(super) fn vector(v: Vec3) -> String {
    format!("({:.6}, {:.6}, {:.6})", v.x, v.y, v.z)
}

/// What a light is called.
pub(super) fn light_kind(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Area => "surface",
        LightKind::Point => "point",
        LightKind::Directional => "directional",
        LightKind::Environment => "environment",
    }
}
