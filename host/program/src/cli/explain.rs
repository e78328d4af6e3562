//! `restir explain`

use std::fmt::Write;
use std::path::PathBuf;
use std::str::FromStr;

use restir::Error;
use restir::di::{DiRender, DiSettings};
use restir::render::RenderSettings;
use restir::replay::{self, NextEvent, Path, Sample, Vertex};
use restir::scene::Scene;
use restir_shared::glam::Vec3;
use restir_shared::scene::LightKind;
use serde_json::{Value, json};

use super::genealogy::Genealogy;
use super::reference::Integral;
use super::render::{DEFAULT_FRAMES, Technique, cameras, check_direct, natural};
use super::scene::DEFAULT_SIZE;
use super::{console, device, settings};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Name of a built-in scene, or a .gltf or .glb file.
    scene: PathBuf,
    /// The pixel as X,Y, counted from 0 from the upper left corner.
    #[arg(long, allow_hyphen_values = true)]
    pixel: Pixel,
    /// What is explained: a path, or a reservoir of restir-di.
    #[arg(long, value_enum, default_value_t = Technique::Path)]
    technique: Technique,
    /// Index of the sample of the technique path; 0 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    sample: Option<u32>,
    /// Frames of the technique restir-di, of which the last is explained; 16 if not given.
    #[arg(long, value_parser = natural::<u32>, allow_hyphen_values = true)]
    frames: Option<u32>,
    /// Move the camera from frame to frame: orbit, pan, or a JSON file of keyframes.
    #[arg(long, value_name = "PATH")]
    camera_path: Option<PathBuf>,
    /// Seed of the random numbers.
    #[arg(long, default_value = "0", value_parser = natural::<u32>, allow_hyphen_values = true)]
    seed: u32,
    #[command(flatten)]
    integral: Integral,
    /// A setting of the technique, as KEY=VALUE; a wrong key lists the known ones.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Print one JSON object; a number that is not finite is null.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    device: device::DeviceArguments,
}

/// A pixel as the user wrote it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pixel {
    x: u32,
    y: u32,
}

impl FromStr for Pixel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (x, y) = text.split_once(',').ok_or("it has to be X,Y, as in 12,34")?;
        Ok(Self { x: natural(x)?, y: natural(y)? })
    }
}

/// A replayed sample, with all that the output needs.
struct Explanation<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    sample: Sample,
    path: &'a Path,
    /// The sample on the film of the executor.
    film: Vec3,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    settings::check_jitter(arguments.integral.jitter, &arguments.settings)?;
    match arguments.technique {
        Technique::Path => explain_path(arguments),
        Technique::RestirDi => explain_reservoir(arguments),
    }
}

fn explain_reservoir(arguments: &Arguments) -> Result<(), Error> {
    if arguments.sample.is_some() {
        return Err(Error::Setting(
            "--sample is for the technique path; restir-di explains the last of --frames".to_owned(),
        ));
    }
    let Arguments { integral, pixel: Pixel { x, y }, .. } = arguments;
    check_direct(integral.max_depth)?;
    let mut settings = DiSettings::default();
    settings::apply_di(&mut settings, &arguments.settings)?;
    let mut scene = integral.additions.open(&arguments.scene)?;
    let RenderSettings { width, height, path, .. } = integral.settings(scene.default_size.unwrap_or(DEFAULT_SIZE))?;
    settings.jitter |= path.jitter;
    integral.additions.complete(&mut scene, [width, height])?;
    let buffers = integral.additions.buffers(&scene)?;
    let frames = arguments.frames.unwrap_or(DEFAULT_FRAMES);
    let cameras = cameras(arguments.camera_path.as_deref(), buffers.camera, frames)?;
    let render = DiRender { frames, seed: arguments.seed, cameras, ..DiRender::new([width, height], settings) };
    replay::check_genealogy(&buffers, &render, [*x, *y])?;
    let mut device = device::open(&arguments.device)?;
    let generations = replay::genealogy(device.executor.as_mut(), &buffers, &render, [*x, *y])?;
    let genealogy = Genealogy { scene: &scene, render: &render, generations: &generations };
    console::print(&if arguments.json { genealogy.json() } else { genealogy.text() })
}

fn explain_path(arguments: &Arguments) -> Result<(), Error> {
    if arguments.frames.is_some() || arguments.camera_path.is_some() {
        return Err(Error::Setting(
            "--frames and --camera-path are for the technique restir-di; path explains a --sample".to_owned(),
        ));
    }
    let additions = &arguments.integral.additions;
    let mut scene = additions.open(&arguments.scene)?;
    let size = scene.default_size.unwrap_or(DEFAULT_SIZE);
    let mut settings = RenderSettings { seed: arguments.seed, ..arguments.integral.settings(size)? };
    arguments.settings.iter().try_for_each(|setting| settings::apply(&mut settings, setting))?;
    additions.complete(&mut scene, [settings.width, settings.height])?;
    let buffers = additions.buffers(&scene)?;
    let Pixel { x, y } = arguments.pixel;
    let sample = Sample { x, y, index: arguments.sample.unwrap_or(0) };
    let path = replay::explain(&buffers, &settings, sample)?;
    let mut device = device::open(&arguments.device)?;
    let film = replay::film(device.executor.as_mut(), &buffers, &settings, sample.index)?;
    let film = film.get((y * settings.width + x) as usize).map_or(Vec3::NAN, |pixel| Vec3::from_array(pixel.sum));
    let explanation = Explanation { scene: &scene, settings: &settings, sample, path: &path, film };
    console::print(&if arguments.json { explanation.json() } else { explanation.text() })
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

pub(super) fn kind(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Area => "surface",
        LightKind::Point => "point",
        LightKind::Directional => "directional",
        LightKind::Environment => "environment",
    }
}

fn far(kind: LightKind) -> bool {
    matches!(kind, LightKind::Directional | LightKind::Environment)
}

impl Explanation<'_> {
    fn material(&self, index: u32) -> &str {
        self.scene.materials.get(index as usize).map_or("?", |material| &material.name)
    }

    fn text(&self) -> String {
        let (s, path) = (&self.settings, self.path);
        let Sample { x, y, index } = self.sample;
        let mut text = format!(
            "{}, {} x {} pixels: pixel ({x}, {y}), sample {index}, seed {}, paths of up to {} segments\n\
             from the camera at {}\n",
            self.scene.name,
            s.width,
            s.height,
            s.seed,
            s.path.max_depth,
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
        if v.emission.radiance != Vec3::ZERO {
            let e = &v.emission;
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

    fn json(&self) -> String {
        let path = self.path;
        let vertices: Vec<Value> = path.vertices.iter().map(|vertex| self.vertex_json(vertex)).collect();
        let object = json!({
            "scene": self.scene.name,
            "pixel": [self.sample.x, self.sample.y],
            "sample": self.sample.index,
            "seed": self.settings.seed,
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
        });
        format!("{object}\n")
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
            "emission": {
                "radiance": v.emission.radiance.to_array(),
                "weight": v.emission.weight,
                "contribution": v.emission.contribution.to_array(),
            },
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_parsed() {
        assert_eq!("12,34".parse(), Ok(Pixel { x: 12, y: 34 }));
        for text in ["", "12", "12,", ",3", "-1,2", "1,2,3", "1.5,2", "4294967296,0"] {
            text.parse::<Pixel>().unwrap_err();
        }
    }
}
