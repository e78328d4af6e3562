//! What bodies reflect and let through, by profile and hybrid, beside the walk: over their size and what they absorb.

use std::fmt::Write as _;

use glam::DVec3;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Mesh, builtin};
use restir_host::technique::path::{PathSettings, Subsurface, Thickness};
use restir_tests::half_sky::{self, gray};
use restir_tests::meshes;

use super::pictures::{Interval, Pictures};
use super::settings;
use crate::Error;

/// Widths and heights of the pictures.
const SIZE: [u32; 2] = [24, 24];
/// The least extent of a body, in mean free paths.
const SIZES: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
const ALBEDOS: [f64; 6] = [0.5, 0.8, 0.9, 0.95, 0.98, 0.99];
/// What is compared with the walk.
const METHODS: [(Subsurface, Thickness); 3] = [
    (Subsurface::Diffusion, Thickness::Measured),
    (Subsurface::Hybrid, Thickness::Measured),
    (Subsurface::Hybrid, Thickness::Ignored),
];
const PROFILE: usize = 0;
const HYBRID: usize = 1;

/// A body: how its least extent is called, and its mesh; a slab has no end, and no mesh.
struct Body {
    name: &'static str,
    extent: &'static str,
    mesh: Option<Mesh>,
}

fn bodies() -> Result<Vec<Body>, Error> {
    let statue =
        builtin::scene("statue").and_then(|scene| scene.meshes.iter().find(|mesh| mesh.name == "statue").cloned());
    let statue = statue.ok_or_else(|| Error::Environment("the scene statue has no mesh of that name".to_owned()))?;
    // the test mesh is seen from inside
    let mut torus = meshes::torus(1.0, 0.4, 96, 48);
    torus.indices.iter_mut().for_each(|corners| corners.swap(1, 2));
    let sphere = Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 5) };
    Ok(vec![
        Body { name: "slab", extent: "its depth", mesh: None },
        Body { name: "sphere", extent: "its diameter", mesh: Some(sphere) },
        Body { name: "cube", extent: "its side", mesh: Some(Mesh::cuboid(DVec3::NEG_ONE, DVec3::ONE)) },
        Body { name: "torus", extent: "the diameter of its tube, a third of its own inside", mesh: Some(torus) },
        Body {
            name: "statue",
            extent: "its least extent, of which its ears are a tenth thick",
            mesh: Some((*statue).clone()),
        },
    ])
}

impl Body {
    /// Under half a sky, its least extent so many mean free paths long.
    fn scene(&self, size: f64, albedo: f64, above: bool) -> SceneBuffers {
        let Some(mesh) = &self.mesh else { return half_sky::slab(gray(albedo, 1.0), size, above) };
        let [low, high] = half_sky::bounds(mesh);
        half_sky::body(gray(albedo, (high - low).min_element() / size), mesh.clone(), above)
    }
}

/// What was found of a body of one size and albedo.
struct Cell {
    /// `|dR| + |dT|` of [`METHODS`].
    errors: [Interval; METHODS.len()],
    /// How much more the profile's is than the hybrid's.
    ahead: Interval,
}

fn cell(body: &Body, size: f64, albedo: f64, samples: u32) -> Result<Cell, Error> {
    let views = [true, false].map(|above| body.scene(size, albedo, above));
    let covered = half_sky::covered(&views[0])?;
    // by the same random numbers, so that what is seen beside the body is the same
    let of = |subsurface, thickness| -> Result<[Pictures; 2], Error> {
        let settings = PathSettings { thickness, ..settings(subsurface) };
        let of = |view: usize| Pictures::of(&views[view], &settings, SIZE, samples, view as u32);
        Ok([of(0)?, of(1)?])
    };
    let walk = of(Subsurface::Walk, Thickness::Measured)?;
    let others = METHODS.map(|(subsurface, thickness)| of(subsurface, thickness));
    let others = others.into_iter().collect::<Result<Vec<_>, _>>()?;
    let off = |method: usize, runs: &[usize]| {
        let of = |view: usize| (others[method][view].mean(runs) - walk[view].mean(runs)).abs();
        (of(0) + of(1)) / covered
    };
    Ok(Cell {
        errors: std::array::from_fn(|method| Interval::of(|runs| off(method, runs))),
        ahead: Interval::of(|runs| off(PROFILE, runs) - off(HYBRID, runs)),
    })
}

impl Cell {
    fn text(&self) -> String {
        let winner = self.ahead.is_positive().map(|hybrid| if hybrid { HYBRID } else { PROFILE });
        let of = |method: usize| {
            let bold = if winner == Some(method) { "**" } else { "" };
            format!("{bold}{:.3}{bold}", self.errors[method].value)
        };
        let widest = self.errors.iter().map(|error| error.half_width).fold(0.0, f64::max);
        format!("{} {} {} ± {widest:.3}", of(0), of(1), of(2))
    }
}

/// The albedo above which the profile is nearer to the walk.
fn crossover(cells: &[Cell]) -> String {
    let ahead: Vec<f64> = cells.iter().map(|cell| cell.ahead.value).collect();
    let last = (1..ahead.len()).rev().find(|&i| ahead[i - 1] > 0.0 && ahead[i] <= 0.0);
    match last {
        Some(i) => {
            let part = ahead[i - 1] / (ahead[i - 1] - ahead[i]);
            format!("{:.3}", ALBEDOS[i - 1] + part * (ALBEDOS[i] - ALBEDOS[i - 1]))
        }
        None if ahead.iter().all(|&ahead| ahead > 0.0) => "none: the hybrid".to_owned(),
        None => "none: the profile".to_owned(),
    }
}

/// Errors of reflection and transmission.
pub(super) fn report(samples: u32) -> Result<String, Error> {
    let mut text = "\n## Reflection and transmission\n\nBodies without colour under a sky that is white above the horizon and black below it. R is what a pixel of the \
        body shows in the mean, seen from straight above, T from straight below; of a white Lambertian surface R is 1. Each cell has `|dR| + |dT|` from the walk of the profile, of the hybrid \
        and of the hybrid with `thickness=ignored`, and the widest of their intervals of 95 % (8 renders of each, jackknife); an error \
        that is not larger than that is noise. The nearer one of the first two is bold where an interval of their difference decides. The crossover is \
        the albedo above which the profile is nearer, between two columns by a straight line.\n"
        .to_owned();
    for body in bodies()? {
        let _ = writeln!(text, "\n### {}\n\nSizes are of {}, in mean free paths.\n", body.name, body.extent);
        let _ =
            writeln!(text, "| size | {} | crossover |", ALBEDOS.map(|albedo| format!("albedo {albedo}")).join(" | "));
        let _ = writeln!(text, "|---:|{}---:|", "---:|".repeat(ALBEDOS.len()));
        let mut nearer = [0; 3];
        for size in SIZES {
            let cells = ALBEDOS.iter().map(|&albedo| cell(&body, size, albedo, samples));
            let cells = cells.collect::<Result<Vec<_>, _>>()?;
            for cell in &cells {
                nearer[cell.ahead.is_positive().map_or(2, usize::from)] += 1;
            }
            let row: Vec<String> = cells.iter().map(Cell::text).collect();
            let _ = writeln!(text, "| {size} | {} | {} |", row.join(" | "), crossover(&cells));
        }
        let [profile, hybrid, neither] = nearer;
        let _ =
            writeln!(text, "\nThe hybrid is nearer in {hybrid}, the profile in {profile}; {neither} are not decided.");
    }
    Ok(text)
}
