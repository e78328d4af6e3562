//! What explains a pixel of a render, and the explanation that every technique has.

use crate::buffers::SceneBuffers;
use crate::exec::{CpuExecutor, Executor, Step};
use crate::render::{Render, render_shown};
use crate::scene::Scene;
use crate::{Error, technique::Repeats};
use restir_kernels::Access;
use restir_shared::scene::LightKind;
use serde_json::{Value, json};
use std::fmt::Write;
use std::ops::ControlFlow;

/// What is explained.
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
    /// [`Error::Setting`] if it does not.
    pub fn check(&self, render: &Render) -> Result<(), Error> {
        let (Self { x, y, .. }, Render { width, height, .. }) = (self, render);
        if x < width && y < height {
            return Ok(());
        }
        Err(Error::Setting(format!(
            "the pixel ({x}, {y}) is outside of the image of {width} x {height} pixels; count from 0, from the upper left corner"
        )))
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
        let bindings = step.pass.kernel.bindings.iter().skip(1).zip(&step.pass.bindings);
        let own = bindings.filter(|(binding, _)| binding.access == Access::Own);
        let plane = |(binding, &id): (&restir_kernels::Binding, &usize)| {
            let words = binding.stride as usize / 4;
            Ok((binding.name, step.read(id)?[index * words..][..words].to_vec()))
        };
        Ok(Some(Self { kernel: step.pass.kernel.name, planes: own.map(plane).collect::<Result<_, Error>>()? }))
    }
}

/// What every pass of a render writes for a pixel, natively and on the executor.
///
/// # Errors
/// As of [`crate::render::render`], and for a pixel outside of the image.
pub fn passes(
    executor: &mut dyn Executor,
    (scene, buffers): (&Scene, &SceneBuffers),
    render: &Render,
    place: Place,
) -> Result<Explanation, Error> {
    place.check(render)?;
    let is_samples = render.technique.about().repeats == Repeats::Samples;
    let count = if is_samples { place.sample.saturating_add(1) } else { render.count };
    let render = Render { count, ..render.clone() };
    let index = (place.y * render.width + place.x) as usize;
    let written = |executor: &mut dyn Executor| {
        let mut all = Vec::new();
        let show = &mut |step: &Step<'_>| {
            all.extend(Written::by(step, &render, index)?);
            Ok(())
        };
        render_shown(executor, buffers, &render, show, &mut |_| ControlFlow::Continue(())).map(|_| all)
    };
    let native = written(&mut CpuExecutor::new(Some(1))?)?;
    let device = written(executor)?;
    let name = render.technique.about().name;
    let mut text = format!(
        "{}, {} x {} pixels, {name}: pixel ({}, {}), {count} {}, seed {}\n",
        scene.name,
        render.width,
        render.height,
        place.x,
        place.y,
        render.technique.about().repeats.name(),
        render.seed
    );
    let mut rows = Vec::new();
    for (native, device) in native.iter().zip(&device) {
        let same = native == device;
        let _ = writeln!(text, "{}: {}", native.kernel, if same { "the same bits" } else { "OTHER BITS" });
        for (plane, words) in &native.planes {
            let floats: Vec<String> = words.iter().map(|&word| format!("{:e}", f32::from_bits(word))).collect();
            let _ = writeln!(text, "   {plane}: {words:08x?}, as numbers {}", floats.join(" "));
        }
        let planes: Vec<Value> =
            native.planes.iter().map(|(plane, words)| json!({"plane": plane, "words": words})).collect();
        rows.push(json!({"kernel": native.kernel, "planes": planes, "identical": same}));
    }
    let json = json!({
        "scene": scene.name,
        "technique": name,
        "pixel": [place.x, place.y],
        "seed": render.seed,
        "passes": rows,
        "identical": native == device,
    });
    Ok(Explanation { text, json })
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
