//! What is printed of a path: every vertex, what it adds, and whether the sum has the bits of the film.

use std::fmt::Write;

use restir_shared::{glam::Vec3, scene::LightKind};
use serde_json::{Value, json};

use super::{NextEvent, Path, Vertex, explain_sample, film};
use crate::technique::explain::{Explanation, Place, Subject, light_kind as kind, vector, verdict};
use crate::{Error, exec::Executor, render::Render};

/// Explains a sample by its path.
pub(super) fn explain(executor: &mut dyn Executor, subject: Subject<'_>) -> Result<Explanation, Error> {
    let Subject { buffers, render, place, .. } = subject;
    let path = explain_sample(buffers, render, place)?;
    let film = film(executor, buffers, render, place.sample)?;
    let film = film.get((place.y * render.width + place.x) as usize);
    let film = film.map_or(Vec3::NAN, |pixel| Vec3::from_array(pixel.sum));
    let sample = Sample { subject, path: &path, film };
    Ok(Explanation { text: sample.text(), json: sample.json() })
}

/// A replayed sample, with all that the output needs.
struct Sample<'a> {
    subject: Subject<'a>,
    path: &'a Path,
    /// The sample on the film of the executor.
    film: Vec3,
}

fn same_bits(a: Vec3, b: Vec3) -> bool {
    a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits)
}

/// With as many digits as tell it from its neighbours.
fn exact(v: Vec3) -> String {
    format!("({:e}, {:e}, {:e})", v.x, v.y, v.z)
}

fn far(kind: LightKind) -> bool {
    matches!(kind, LightKind::Directional | LightKind::Environment)
}

impl Sample<'_> {
    fn material(&self, index: u32) -> &str {
        self.subject.scene.materials.get(index as usize).map_or("?", |material| &material.name)
    }

    fn text(&self) -> String {
        let Self { subject: Subject { scene, render, place: Place { x, y, sample }, .. }, path, film } = self;
        let Render { width, height, seed, technique, .. } = render;
        let (depth, origin) = (technique.integral().max_depth, vector(path.origin));
        let mut text = format!(
            "{}, {width} x {height} pixels: pixel ({x}, {y}), sample {sample}, seed {seed}, paths of up to {depth} segments\n\
             from the camera at {origin}\n",
            scene.name
        );
        path.vertices.iter().enumerate().for_each(|(i, vertex)| text += &self.vertex(i + 1, vertex));
        if let Some(escape) = path.escape {
            let (number, direction) = (path.vertices.len() + 1, vector(escape.direction));
            let _ = write!(text, "{number}. along {direction} nothing is hit");
            let _ = if escape.radiance == Vec3::ZERO {
                writeln!(text)
            } else {
                let (radiance, added) = (vector(escape.radiance), exact(escape.contribution));
                writeln!(text, "; the environment sends {radiance}: adds {added}")
            };
        }
        let _ = writeln!(text, "radiance of the sample  {}", exact(path.radiance));
        for (what, radiance) in [("sum of what was added  ", path.sum_of_parts()), ("on the film            ", *film)] {
            let same = verdict(same_bits(radiance, path.radiance));
            let _ = writeln!(text, "{what} {}: {same}", exact(radiance));
        }
        text
    }

    fn vertex(&self, number: usize, vertex: &Vertex) -> String {
        let v = vertex;
        let mut text = format!("{number}. along {}", vector(v.direction));
        if number > 1 {
            let _ = write!(text, ", chosen with density {:.5} per steradian", v.scatter_pdf);
        }
        let _ = writeln!(text, ", throughput {}", vector(v.throughput));
        let Vertex { t, triangle, instance, .. } = v;
        let (material, position, normal) = (self.material(v.material), vector(v.position), vector(v.normal));
        let _ = writeln!(
            text,
            "   at t {t:.6} hits triangle {triangle} ({material}, instance {instance}) at {position}, normal {normal}"
        );
        if let Some(e) = v.emission {
            let (radiance, added) = (vector(e.radiance), exact(e.contribution));
            let _ = writeln!(text, "   emits {radiance}, weight {:.6}: adds {added}", e.weight);
        }
        v.light.iter().for_each(|light| text += &self.light(light));
        text
    }

    fn light(&self, light: &NextEvent) -> String {
        let from = match (light.triangle, light.material) {
            (Some(triangle), Some(material)) => format!("triangle {triangle} ({})", self.material(material)),
            _ => format!("a light ({})", kind(light.kind)),
        };
        let outcome = match (light.visible, light.blocker) {
            (None, _) => "cannot light this point".to_owned(),
            (Some(false), Some(blocker)) => format!("hidden by triangle {blocker}"),
            (Some(false), None) => "hidden".to_owned(),
            (Some(true), _) => format!("visible: adds {}", exact(light.contribution)),
        };
        let position = vector(light.position);
        let at = if far(light.kind) { "towards" } else { "at" };
        format!("   light from {from} {at} {position}, density {:.5}: {outcome}\n", light.density)
    }

    fn json(&self) -> Value {
        let Self { subject: Subject { scene, render, place, .. }, path, film } = self;
        let vertices: Vec<Value> = path.vertices.iter().map(|vertex| self.vertex_json(vertex)).collect();
        json!({
            "scene": scene.name,
            "pixel": [place.x, place.y],
            "sample": place.sample,
            "seed": render.seed,
            "origin": path.origin,
            "vertices": vertices,
            "escape": path.escape,
            "radiance": path.radiance,
            "film": film,
            "sum_identical": same_bits(path.sum_of_parts(), path.radiance),
            "film_identical": same_bits(*film, path.radiance),
        })
    }

    fn vertex_json(&self, vertex: &Vertex) -> Value {
        let mut json = json!(vertex);
        json["material"] = json!(self.material(vertex.material));
        if let Some(light) = &vertex.light {
            json["light"]["kind"] = json!(kind(light.kind));
            json["light"]["material"] = json!(light.material.map(|material| self.material(material)));
        }
        json
    }
}
