//! What is printed of a path: every vertex, what it adds, and whether the sum has the bits of the film.

use std::fmt::Write;

use restir_shared::glam::Vec3;
use restir_shared::scene::LightKind;
use serde_json::{Value, json};

use super::{NextEvent, Path, Vertex, explain_sample, film};
use crate::Error;
use crate::buffers::SceneBuffers;
use crate::exec::Executor;
use crate::render::Render;
use crate::scene::Scene;
use crate::technique::explain::{Explanation, Place, light_kind as kind};

/// Explains a sample by its path.
pub(super) fn explain(
    executor: &mut dyn Executor,
    (scene, buffers): (&Scene, &SceneBuffers),
    render: &Render,
    place: Place,
) -> Result<Explanation, Error> {
    let path = explain_sample(buffers, render, place)?;
    let film = film(executor, buffers, render, place.sample)?;
    let film = film.get((place.y * render.width + place.x) as usize);
    let film = film.map_or(Vec3::NAN, |pixel| Vec3::from_array(pixel.sum));
    let sample = Sample { scene, render, place, path: &path, film };
    Ok(Explanation { text: sample.text(), json: sample.json() })
}

/// A replayed sample, with all that the output needs.
struct Sample<'a> {
    scene: &'a Scene,
    render: &'a Render,
    place: Place,
    path: &'a Path,
    /// The sample on the film of the executor.
    film: Vec3,
}

fn same_bits(a: Vec3, b: Vec3) -> bool {
    a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits)
}

fn vector(v: Vec3) -> String {
    format!("({:.6}, {:.6}, {:.6})", v.x, v.y, v.z)
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
        self.scene.materials.get(index as usize).map_or("?", |material| &material.name)
    }

    fn text(&self) -> String {
        let (r, path) = (self.render, self.path);
        let Place { x, y, sample } = self.place;
        let mut text = format!(
            "{}, {} x {} pixels: pixel ({x}, {y}), sample {sample}, seed {}, paths of up to {} segments\n\
             from the camera at {}\n",
            self.scene.name,
            r.width,
            r.height,
            r.seed,
            r.technique.integral().max_depth,
            vector(path.origin)
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
        let verdict = |same| if same { "the same bits" } else { "OTHER BITS" };
        let sum = path.sum_of_parts();
        let _ = writeln!(text, "radiance of the sample  {}", exact(path.radiance));
        let _ = writeln!(text, "sum of what was added   {}: {}", exact(sum), verdict(same_bits(sum, path.radiance)));
        let _ = writeln!(
            text,
            "on the film             {}: {}",
            exact(self.film),
            verdict(same_bits(self.film, path.radiance))
        );
        text
    }

    fn vertex(&self, number: usize, vertex: &Vertex) -> String {
        let v = vertex;
        let mut text = format!("{number}. along {}", vector(v.direction));
        if number > 1 {
            let _ = write!(text, ", chosen with density {:.5} per steradian", v.scatter_pdf);
        }
        let _ = writeln!(text, ", throughput {}", vector(v.throughput));
        let _ = writeln!(
            text,
            "   at t {:.6} hits triangle {} ({}, instance {}) at {}, normal {}",
            v.t,
            v.triangle,
            self.material(v.material),
            v.object,
            vector(v.position),
            vector(v.normal)
        );
        if let Some(e) = v.emission {
            let (radiance, added) = (vector(e.radiance), exact(e.contribution));
            let _ = writeln!(text, "   emits {radiance}, weight {:.6}: adds {added}", e.weight);
        }
        v.next_event.iter().for_each(|light| text += &self.light(light));
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
        let path = self.path;
        let vertices: Vec<Value> = path.vertices.iter().map(|vertex| self.vertex_json(vertex)).collect();
        json!({
            "scene": self.scene.name,
            "pixel": [self.place.x, self.place.y],
            "sample": self.place.sample,
            "seed": self.render.seed,
            "origin": path.origin.to_array(),
            "vertices": vertices,
            "escape": path.escape.map(|escape| json!({
                "direction": escape.direction.to_array(),
                "radiance": escape.radiance.to_array(),
                "contribution": escape.contribution.to_array(),
            })),
            "radiance": path.radiance.to_array(),
            "film": self.film.to_array(),
            "sum_identical": same_bits(path.sum_of_parts(), path.radiance),
            "film_identical": same_bits(self.film, path.radiance),
        })
    }

    fn vertex_json(&self, v: &Vertex) -> Value {
        json!({
            "direction": v.direction.to_array(),
            "scatter_pdf": v.scatter_pdf,
            "throughput": v.throughput.to_array(),
            "t": v.t,
            "triangle": v.triangle,
            "material": self.material(v.material),
            "instance": v.object,
            "position": v.position.to_array(),
            "normal": v.normal.to_array(),
            "emission": v.emission.map(|emission| json!({
                "radiance": emission.radiance.to_array(),
                "weight": emission.weight,
                "contribution": emission.contribution.to_array(),
            })),
            "light": v.next_event.map(|light| json!({
                "triangle": light.triangle,
                "material": light.material.map(|material| self.material(material)),
                "kind": kind(light.kind),
                "position": light.position.to_array(),
                "density": light.density,
                "visible": light.visible,
                "blocker": light.blocker,
                "contribution": light.contribution.to_array(),
            })),
        })
    }
}
