//! Zhang and d'Eon 2025, parameters of media: colour by mean free path. What is dense looks as a diffuse surface of the same colour.

use std::fmt::Write;
use std::sync::Arc;

use restir::image::Image;
use restir::render::{Render, Rendered};
use restir::scene::{Material, Mesh, Scene, builtin};
use restir::technique::path::PathSettings;
use restir::{Error, buffers::SceneBuffers};

use super::claim::{self, Claim};
use super::picture::grid;
use super::{Environs, Files, PICTURE};
use crate::bench::table::Setup;

const SCENE: &str = "cube";
const COLORS: [&str; 4] = ["0.9,0.85,0.7", "0.85,0.3,0.2", "0.3,0.65,0.35", "0.2,0.3,0.75"];
/// In sides of the cube.
const MEAN_FREE_PATHS: [f64; 5] = [0.003, 0.01, 0.03, 0.1, 0.3];
/// Pixels of a side of the tiles in which pictures are compared, so that noise matters little.
const TILE: u32 = 8;
/// How near to diffuse the densest bodies are to be: two percent are the fit of albedo to colour, the rest is how far light goes.
const DIFFUSE: f64 = 0.05;

/// A row of the figure: the cube of one colour, by mean free path, and diffuse.
struct Row {
    color: &'static str,
    walks: Vec<Rendered>,
    diffuse: Image,
}

/// The files of the figure, of so many samples a pixel.
///
/// # Errors
/// As of [`Render::render`].
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let rows = COLORS.iter().map(|color| row(environs, color, size, samples)).collect::<Result<Vec<_>, _>>()?;
    let images: Vec<Image> = rows.iter().flat_map(Row::images).collect();
    let texts = vec![("cells.csv".to_owned(), table(&rows))];
    let report = report(&rows, samples, &setup.markdown(""));
    Ok(Files { picture: Some(grid(&images, MEAN_FREE_PATHS.len() + 1)), texts, report })
}

fn row(environs: &mut impl Environs, color: &'static str, size: [u32; 2], samples: u32) -> Result<Row, Error> {
    let mut rendered = |what: String, scene: &Scene| {
        let scene = SceneBuffers::build(scene)?;
        let settings = PathSettings { max_depth: 4, jitter: true, ..PathSettings::default() };
        let render = Render { count: samples, ..Render::new(size, settings) };
        environs.run(&what, |executor, observe| {
            render.render_observed(&scene, executor, &mut |step| observe(step.progress))
        })
    };
    let walk = |length: &f64| {
        let mut scene = scene()?;
        scene.fill(color, Some(*length))?;
        rendered(format!("colour {color}, mean free path {length}"), &scene)
    };
    let walks = MEAN_FREE_PATHS.iter().map(walk).collect::<Result<Vec<_>, _>>()?;
    let diffuse = rendered(format!("colour {color}, diffuse"), &painted(color)?)?.image;
    Ok(Row { color, walks, diffuse })
}

fn scene() -> Result<Scene, Error> {
    builtin::scene(SCENE).ok_or_else(|| Error::Setting(format!("there is no scene {SCENE}")))
}

/// The scene with a diffuse cube.
fn painted(color: &str) -> Result<Scene, Error> {
    let mut scene = scene()?;
    let volume = restir::scene::subsurface::medium(color, 1.0)?;
    let color = volume.scattering.map_or([0.0; 3], |scattering| scattering.color);
    let paint = scene.add_material(Material::diffuse("paint", color));
    for mesh in scene.meshes.iter_mut().filter(|mesh| mesh.name == SCENE) {
        *mesh = Arc::new(Mesh { material: paint, ..Mesh::clone(mesh) });
    }
    Ok(scene)
}

impl Row {
    fn images(&self) -> Vec<Image> {
        self.walks.iter().map(|walk| walk.image.clone()).chain([self.diffuse.clone()]).collect()
    }

    /// By how much each picture differs from the diffuse one: the mean difference of tiles over their mean.
    fn differences(&self) -> Vec<f64> {
        let diffuse = tiles(&self.diffuse);
        let mean = diffuse.iter().sum::<f64>();
        let of =
            |walk: &Rendered| tiles(&walk.image).iter().zip(&diffuse).map(|(a, b)| (a - b).abs()).sum::<f64>() / mean;
        self.walks.iter().map(of).collect()
    }

    /// Collisions a walk, of each picture.
    fn collisions(&self) -> Vec<f64> {
        let of = |walk: &Rendered| {
            let count = |name| walk.counts.iter().find(|(of, _)| *of == name).map_or(0.0, |(_, count)| *count as f64);
            count("scatterings") / f64::max(count("walks"), 1.0)
        };
        self.walks.iter().map(of).collect()
    }
}

/// Sums of each tile's channels; what is left at the right and below is left out.
fn tiles(image: &Image) -> Vec<f64> {
    let [columns, rows] = [image.width, image.height].map(|side| (side / TILE).max(1));
    let mut sums = vec![0.0; (3 * columns * rows) as usize];
    for (i, pixel) in (0..).zip(&image.pixels) {
        let [column, row] = [i % image.width / TILE, i / image.width / TILE];
        if column < columns && row < rows {
            let tile = 3 * (row * columns + column) as usize;
            pixel.iter().enumerate().for_each(|(channel, &value)| sums[tile + channel] += f64::from(value));
        }
    }
    sums
}

fn table(rows: &[Row]) -> String {
    let mut text = "colour,mean free path,difference from diffuse,collisions a walk\n".to_owned();
    for row in rows {
        for ((length, difference), collisions) in MEAN_FREE_PATHS.iter().zip(row.differences()).zip(row.collisions()) {
            let _ = writeln!(text, "\"{}\",{length},{difference:.5},{collisions:.2}", row.color);
        }
    }
    text
}

fn claims(rows: &[Row]) -> Vec<Claim> {
    let claim =
        |id, text: String, found: String, holds| Claim { id, text, scene: SCENE.to_owned(), found, holds: Some(holds) };
    let differences: Vec<Vec<f64>> = rows.iter().map(Row::differences).collect();
    let nearest = differences.iter().map(|row| row[0]).fold(0.0, f64::max);
    let falls = differences.iter().flat_map(|row| row.windows(2)).filter(|pair| pair[0] < pair[1]).count();
    let steps = rows.len() * (MEAN_FREE_PATHS.len() - 1);
    vec![
        claim(
            "G1",
            format!("a body of short mean free paths looks diffuse: by less than {:.0} % different", 100.0 * DIFFUSE),
            format!("at most {:.1} % at {}", 100.0 * nearest, MEAN_FREE_PATHS[0]),
            nearest < DIFFUSE,
        ),
        claim(
            "G2",
            "the longer mean free paths are, the less it does".to_owned(),
            format!("in {falls} of {steps} steps"),
            falls == steps,
        ),
    ]
}

fn report(rows: &[Row], samples: u32, origin: &str) -> String {
    let mut text = format!(
        "# Colour and mean free path\n\nAfter Zhang and d'Eon 2025.\n\n{origin}\n![Cubes by colour and mean free path]({PICTURE})\n\nThe scene `{SCENE}`, a row a \
         colour, with a mean free path of {} sides of the cube from left to right, and at last a diffuse cube; {samples} samples a pixel, paths of 4 \
         segments. A cell is what `--subsurface COLOUR:LENGTH --max-depth 4 --jitter` makes of the scene.\n\n## Claims\n\n{}\n## Difference from the diffuse \
         cube\n\nThe mean difference of tiles of {TILE} x {TILE} pixels over their mean, floor and sky included.\n\n{}",
        MEAN_FREE_PATHS.map(|length| length.to_string()).join(", "),
        claim::table(&claims(rows)),
        cells(rows, |row| row.differences().iter().map(|x| format!("{:.2} %", 100.0 * x)).collect())
    );
    text += "\n## Collisions a walk\n\nOf all that enter; roulette ends walks of more than 16.\n\n";
    text + &cells(rows, |row| row.collisions().iter().map(|x| format!("{x:.1}")).collect())
}

/// A table of numbers by colour and mean free path.
fn cells(rows: &[Row], of: impl Fn(&Row) -> Vec<String>) -> String {
    let head: Vec<String> = MEAN_FREE_PATHS.iter().map(f64::to_string).collect();
    let mut text = format!("| colour | {} |\n|---|{}\n", head.join(" | "), "---:|".repeat(head.len()));
    rows.iter().for_each(|row| text += &format!("| {} | {} |\n", row.color, of(row).join(" | ")));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_what_their_pixels_hold() {
        let (width, height) = (2 * TILE + 1, TILE);
        let pixels = (0..width * height).map(|i| [(i % width / TILE) as f32, 1.0, 0.0]).collect();
        let area = f64::from(TILE * TILE);
        assert_eq!(tiles(&Image { width, height, pixels }), [0.0, area, 0.0, area, area, 0.0]);
    }
}
