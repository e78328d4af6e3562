//! What is printed of a reservoir: from where it has its sample, back to the candidate.

use std::fmt::Write;

use restir_shared::technique::restir_di::{FROM_SCATTERING, Stored};
use serde_json::{Value, json};

use super::genealogy::{Generation, LightSource, Reuse, genealogy};
use super::{DiSettings, lineage::Origin};
use crate::technique::explain::{Explanation, Subject, light_kind as kind, verdict};
use crate::{Error, exec::Executor, render::Render, scene::Scene};

/// Explains the reservoir that a pixel has in the last frame.
pub(super) fn explain(
    settings: &DiSettings,
    executor: &mut dyn Executor,
    subject: Subject<'_>,
) -> Result<Explanation, Error> {
    let generations = genealogy(settings, executor, subject.buffers, subject.render, subject.place)?;
    let genealogy = Genealogy { scene: subject.scene, render: subject.render, generations: &generations };
    Ok(Explanation { text: genealogy.text(), json: genealogy.json() })
}

/// The reservoirs from which a pixel has its sample, the last one first.
struct Genealogy<'a> {
    scene: &'a Scene,
    render: &'a Render,
    generations: &'a [Generation],
}

impl Genealogy<'_> {
    fn text(&self) -> String {
        let Self { scene, render: Render { width, height, count, seed, .. }, generations, .. } = self;
        let mut text = format!("{}, {width} x {height} pixels, restir-di: {count} frames, seed {seed}\n", scene.name);
        generations.iter().for_each(|generation| text += &self.generation(generation));
        if generations.last().is_some_and(|last| last.stored().sample.is_light()) {
            let _ = write!(text, "the sample is {} frames old; ", self.age());
        }
        let same = verdict(generations.iter().all(is_identical));
        let _ = writeln!(text, "{} reservoirs replayed natively: {same}", generations.len());
        text
    }

    fn generation(&self, g: &Generation) -> String {
        let Stored { sample: address, contribution_weight, confidence, visibility } = g.stored();
        let ([x, y], Generation { frame, target, .. }, name) = (self.position(g.pixel), g, name(g.reuse));
        let mut text = format!(
            "frame {frame}, {name}, pixel ({x}, {y}): M {confidence}, W {contribution_weight:e}, visibility {visibility}, target {target:e}\n"
        );
        let _ = match &g.light {
            None => writeln!(text, "   it has no sample"),
            Some(light) => {
                let (u, v) = (unit(address.u), unit(address.v));
                let (what, origin) = (self.light(light), self.origin(g));
                writeln!(text, "   light {} ({what}) at u {u:.7}, v {v:.7}: {origin}", address.light)
            }
        };
        text
    }

    fn light(&self, light: &LightSource) -> String {
        match self.material(light) {
            Some(material) => format!("triangle {}, {material}", light.index),
            None => kind(light.kind).to_owned(),
        }
    }

    fn material(&self, light: &LightSource) -> Option<&str> {
        self.scene.materials.get(light.material? as usize).map(|material| material.name.as_str())
    }

    fn origin(&self, g: &Generation) -> String {
        match g.origin {
            Origin::Candidate(FROM_SCATTERING) => "drawn as the candidate from scattering".to_owned(),
            Origin::Candidate(index) => format!("drawn as candidate {index} of those from lights"),
            Origin::Reservoir { is_other: false, .. } => "the pixel keeps its own".to_owned(),
            Origin::Reservoir { pixel, of_last_frame, .. } => {
                let [x, y] = self.position(pixel);
                let [who, when] = if of_last_frame { ["pixel", " in the last frame"] } else { ["the neighbour", ""] };
                format!("{who} ({x}, {y}) had it{when}")
            }
        }
    }

    fn position(&self, pixel: u32) -> [u32; 2] {
        [pixel % self.render.width, pixel / self.render.width]
    }

    fn age(&self) -> u32 {
        let frame = |generation: Option<&Generation>| generation.map_or(0, |generation| generation.frame);
        frame(self.generations.first()) - frame(self.generations.last())
    }

    fn json(&self) -> Value {
        let Self { scene, render, generations, .. } = self;
        let reservoirs: Vec<Value> = generations.iter().map(|generation| self.generation_json(generation)).collect();
        json!({
            "scene": scene.name,
            "technique": "restir-di",
            "width": render.width,
            "height": render.height,
            "frames": render.count,
            "seed": render.seed,
            "age": self.age(),
            "reservoirs": reservoirs,
            "identical": generations.iter().all(is_identical),
        })
    }

    fn generation_json(&self, g: &Generation) -> Value {
        let Stored { sample: address, contribution_weight, confidence, visibility } = g.stored();
        let from = match g.origin {
            Origin::Candidate(FROM_SCATTERING) => json!({"candidate": null, "of": "scattering"}),
            Origin::Candidate(index) => json!({"candidate": index, "of": "lights"}),
            Origin::Reservoir { pixel: of, is_other, of_last_frame, .. } => {
                let what = match (is_other, of_last_frame) {
                    (false, _) => "own",
                    (_, true) => "last frame",
                    _ => "neighbour",
                };
                json!({"reservoir": what, "pixel": self.position(of)})
            }
        };
        json!({
            "frame": g.frame,
            "pass": name(g.reuse),
            "pixel": self.position(g.pixel),
            "confidence": confidence,
            "contribution_weight": contribution_weight,
            "visibility": visibility.to_array(),
            "target": g.target,
            "light": g.light.map(|light| json!({
                "index": address.light,
                "kind": kind(light.kind),
                "triangle": light.material.map(|_| light.index),
                "material": self.material(&light),
                "u": unit(address.u),
                "v": unit(address.v),
            })),
            "from": g.light.map(|_| from),
            "identical": is_identical(g),
        })
    }
}

fn is_identical(generation: &Generation) -> bool {
    generation.word == generation.replayed
}

fn name(reuse: Reuse) -> String {
    match reuse {
        Reuse::Initial => "initial candidates".to_owned(),
        Reuse::Temporal => "temporal reuse".to_owned(),
        Reuse::Fused => "fused reuse".to_owned(),
        Reuse::Spatial(pass) => format!("spatial reuse {pass}"),
    }
}

/// A coordinate in 2^-24.
fn unit(lattice: u32) -> f64 {
    f64::from(lattice) / f64::from(1 << 24)
}
