//! What is printed of a path: whose it was, back to the pixel that traced it.

use super::PtSettings;
use super::genealogy::{Generation, Offered, Reuse, genealogy};
use super::lineage::Origin;
use crate::technique::explain::{Explanation, Subject, verdict};
use crate::{Error, exec::Executor, render::Render};
use restir_shared::shift::{Cause, Path};
use serde_json::{Value, json};
use std::fmt::Write;

/// Explains the path that a pixel has in the last frame.
pub(super) fn explain(
    settings: &PtSettings,
    executor: &mut dyn Executor,
    subject: Subject<'_>,
) -> Result<Explanation, Error> {
    let generations = genealogy(settings, executor, subject.buffers, subject.render, subject.place)?;
    let genealogy = Genealogy { scene: &subject.scene.name, render: subject.render, generations: &generations };
    Ok(Explanation { text: genealogy.text(), json: genealogy.json() })
}

/// The pixels that had a path, the last one first.
struct Genealogy<'a> {
    scene: &'a str,
    render: &'a Render,
    generations: &'a [Generation],
}

impl Genealogy<'_> {
    fn text(&self) -> String {
        let Self { scene, render: Render { width, height, count, seed, .. }, generations } = self;
        let mut text = format!("{scene}, {width} x {height} pixels, restir-pt: {count} frames, seed {seed}\n");
        generations.iter().for_each(|generation| text += &self.generation(generation));
        let same = verdict(generations.iter().all(is_identical));
        let _ = writeln!(text, "{} passes replayed natively: {same}", generations.len());
        text
    }

    fn generation(&self, g: &Generation) -> String {
        let (stored, [x, y], name) = (g.stored(), self.position(g.pixel), name(g.reuse));
        let (weight, confidence) = (stored.contribution_weight, stored.confidence);
        let mut text = format!("frame {}, {name}, pixel ({x}, {y}): M {confidence}, ", g.frame);
        let _ = if stored.path.length == 0 {
            writeln!(text, "it has no path")
        } else {
            let (what, origin) = (ending(&stored.path), self.origin(g));
            writeln!(text, "W {weight:e}, {what}\n   value {}, {origin}", stored.value)
        };
        for Offered { pixel, cause, jacobian } in &g.offers {
            let [x, y] = self.position(*pixel);
            let _ = match cause {
                Cause::Nothing => writeln!(text, "   from ({x}, {y}): a path, Jacobian {jacobian:e}"),
                _ => writeln!(text, "   from ({x}, {y}): no path, {}", why(*cause)),
            };
        }
        text
    }

    fn origin(&self, g: &Generation) -> String {
        match g.origin {
            Origin::Traced => "traced here".to_owned(),
            Origin::Path { is_other: false, .. } => "the pixel keeps its own".to_owned(),
            Origin::Path { pixel, .. } => {
                let [x, y] = self.position(pixel);
                let when = if g.reuse == Reuse::Temporal { " in the last frame" } else { "" };
                format!("the pixel ({x}, {y}) had it{when}")
            }
        }
    }

    fn position(&self, pixel: u32) -> [u32; 2] {
        [pixel % self.render.width, pixel / self.render.width]
    }

    fn json(&self) -> Value {
        let Self { scene, render, generations } = self;
        let paths: Vec<Value> = generations.iter().map(|generation| self.generation_json(generation)).collect();
        json!({
            "scene": scene,
            "technique": "restir-pt",
            "width": render.width,
            "height": render.height,
            "frames": render.count,
            "seed": render.seed,
            "paths": paths,
            "identical": generations.iter().all(is_identical),
        })
    }

    fn generation_json(&self, g: &Generation) -> Value {
        let stored = g.stored();
        let path = (stored.path.length > 0).then(|| {
            json!({
                "contribution_weight": stored.contribution_weight,
                "value": stored.value.to_array(),
                "length": stored.path.length,
                "k": stored.path.reconnection,
                "light_sampled": stored.path.light_sampled,
                "traced_by": [stored.path.key.x & 0xffff, stored.path.key.x >> 16],
                "traced_in": stored.path.key.y,
                "from": match g.origin {
                    Origin::Traced => json!("traced"),
                    Origin::Path { is_other: false, .. } => json!("own"),
                    Origin::Path { pixel, .. } => json!({ "pixel": self.position(pixel) }),
                },
            })
        });
        let offer = |offer: &Offered| {
            let why = (offer.cause != Cause::Nothing).then(|| why(offer.cause));
            json!({ "pixel": self.position(offer.pixel), "jacobian": offer.jacobian, "fails": why })
        };
        json!({
            "frame": g.frame,
            "pass": name(g.reuse),
            "pixel": self.position(g.pixel),
            "confidence": stored.confidence,
            "path": path,
            "offers": g.offers.iter().map(offer).collect::<Vec<_>>(),
            "identical": is_identical(g),
        })
    }
}

/// How long it is, what it ends at and where it is joined.
fn ending(path: &Path) -> String {
    let light = if path.light_sampled { "a light that was sampled" } else { "light that scattering found" };
    let joined = match path.reconnection {
        0 => "replayed as a whole".to_owned(),
        k => format!("kept from vertex {k} on"),
    };
    format!("{} segments to {light}, {joined}", path.length)
}

fn is_identical(generation: &Generation) -> bool {
    generation.word == generation.replayed
}

fn name(reuse: Reuse) -> String {
    match reuse {
        Reuse::Initial => "initial path".to_owned(),
        Reuse::Recalled => "in the scene as it is now".to_owned(),
        Reuse::Temporal => "temporal reuse".to_owned(),
        Reuse::Spatial(pass) => format!("spatial reuse {pass}"),
    }
}

/// Why a shift gives no path.
fn why(cause: Cause) -> &'static str {
    match cause {
        Cause::Nothing => "it gives one",
        Cause::Unshiftable => "there is none, or none that can be shifted",
        Cause::Joins => "it would have to be joined at another vertex",
        Cause::Replay => "replay ends too early",
        Cause::Dark => "what is to be joined sends nothing this way",
        Cause::Blocked => "something lies between",
        Cause::Broken => "a number is out of range",
    }
}
