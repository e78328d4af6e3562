//! What is printed of a record: from where it comes, back to the candidate.

use super::{Generation, Origin, Reuse, Reused, genealogy};
use crate::technique::explain::{Explanation, Subject, verdict};
use crate::{Error, exec::Executor, render::Render, scene::Scene};
use serde_json::{Value, json};
use std::fmt::Write;

/// Explains the record that a pixel has in the last frame.
///
/// # Errors
/// As of [`genealogy`].
pub(crate) fn explain<R: Reused>(executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
    let Subject { scene, buffers, render, place } = subject;
    let genealogy = Genealogy { scene, render, generations: genealogy::<R>(executor, buffers, render, place)? };
    Ok(Explanation { text: genealogy.text(), json: genealogy.json() })
}

/// The records from which a pixel has its own, the last one first.
#[derive(Debug)]
pub struct Genealogy<'a, R: Reused> {
    pub(crate) scene: &'a Scene,
    render: &'a Render,
    pub(crate) generations: Vec<Generation<R>>,
}

impl<R: Reused> Genealogy<'_, R> {
    /// The place of a pixel.
    pub(crate) fn position(&self, pixel: u32) -> [u32; 2] {
        [pixel % self.render.width, pixel / self.render.width]
    }

    /// How many frames the sample is old.
    pub(crate) fn age(&self) -> u32 {
        let frame = |generation: Option<&Generation<R>>| generation.map_or(0, |generation| generation.frame);
        frame(self.generations.first()) - frame(self.generations.last())
    }

    /// Where a record comes from.
    pub(crate) fn origin(&self, origin: Origin) -> String {
        match origin {
            Origin::Candidate(index) => R::drawn(index),
            Origin::Record { is_other: false, .. } => "the pixel keeps its own".to_owned(),
            Origin::Record { pixel, of_last_frame, .. } => {
                let ([x, y], [here, before]) = (self.position(pixel), R::OTHER);
                if of_last_frame {
                    format!("{before} ({x}, {y}) had it in the last frame")
                } else {
                    format!("{here} ({x}, {y}) had it")
                }
            }
        }
    }

    fn is_identical(&self) -> bool {
        self.generations.iter().all(Generation::is_identical)
    }

    fn text(&self) -> String {
        let Self { scene, render: Render { width, height, count, seed, technique, .. }, generations } = self;
        let (scene, name) = (&scene.name, technique.about().name);
        let mut text = format!("{scene}, {width} x {height} pixels, {name}: {count} frames, seed {seed}\n");
        for g in generations {
            let ([x, y], what, confidence) = (self.position(g.pixel), what::<R>(g.reuse), g.record.confidence());
            let _ = write!(text, "frame {}, {what}, pixel ({x}, {y}): M {confidence}, {}", g.frame, R::words(self, g));
        }
        let _ = writeln!(text, "{} replayed natively: {}", R::summary(self).0, verdict(self.is_identical()));
        text
    }

    fn json(&self) -> Value {
        let Self { scene, render, generations } = self;
        let common = json!({
            "scene": scene.name,
            "technique": render.technique.about().name,
            "width": render.width,
            "height": render.height,
            "frames": render.count,
            "seed": render.seed,
            R::RECORDS: generations.iter().map(|generation| self.generation_json(generation)).collect::<Vec<_>>(),
            "identical": self.is_identical(),
        });
        joined([common, R::summary(self).1])
    }

    fn generation_json(&self, g: &Generation<R>) -> Value {
        let common = json!({
            "frame": g.frame,
            "pass": what::<R>(g.reuse),
            "pixel": self.position(g.pixel),
            "confidence": g.record.confidence(),
            "identical": g.is_identical(),
        });
        joined([common, R::fields(self, g)])
    }
}

/// One object of the fields of both.
fn joined(objects: [Value; 2]) -> Value {
    let fields = objects.into_iter().filter_map(|object| object.as_object().cloned());
    Value::Object(fields.flatten().collect())
}

/// What a pass does.
fn what<R: Reused>(reuse: Reuse) -> String {
    match reuse {
        Reuse::Initial => R::INITIAL.to_owned(),
        Reuse::Recalled => "in the scene as it is now".to_owned(),
        Reuse::Readied => "ready for another shift".to_owned(),
        Reuse::Temporal => "temporal reuse".to_owned(),
        Reuse::Fused => "fused reuse".to_owned(),
        Reuse::Spatial(pass) => format!("spatial reuse {pass}"),
    }
}
