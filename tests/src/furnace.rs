//! White surfaces under light of one from everywhere: how much of it the kernels' samples return.

use crate::microsurface::{self, Microsurface};
use crate::random::SplitMix;
use glam::{UVec4, Vec3};
use rayon::prelude::*;
use restir_shared::bsdf::{
    Bsdf, BsdfSample, DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION, Material, SPECULAR_REFLECTION, is_transmission,
};
use restir_shared::layout::{FEATURE_MULTISCATTER, FEATURES_ALL};
use restir_shared::num;
use std::fmt::Write;

/// Perceptual roughnesses, the first of a perfect mirror.
pub const ROUGHNESSES: [f32; 12] = [0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0];
/// Cosines of the viewer.
pub const COSINES: [f32; 8] = [1.0, 0.7, 0.4, 0.2, 0.1, 0.05, 1.0 / 32.0, 1.0 / 64.0];
const METALNESSES: [f32; 4] = [0.0, 0.25, 0.5, 1.0];
const INDICES: [f32; 5] = [1.0, 1.25, 1.5, 2.0, 3.0];

/// What a white surface may return.
pub const BOUNDS: [f64; 2] = [0.99, 1.0005];

/// Batches of samples, from whose differences the standard error follows.
const BATCHES: u32 = 16;

/// One surface seen at one angle.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The surface.
    pub material: Material,
    /// Cosine of the viewer.
    pub cos: f32,
    /// The share of the light that comes back, and its standard error.
    pub returned: [f64; 2],
}

impl Cell {
    /// Whether it is outside of [`BOUNDS`] by more than three standard errors.
    pub fn is_off(&self) -> bool {
        let [mean, error] = self.returned;
        mean + 3.0 * error < BOUNDS[0] || mean - 3.0 * error > BOUNDS[1]
    }
}

/// Opaque surfaces of every metalness and index at every roughness and cosine, `samples` a batch.
pub fn opaque(multiscatter: bool, samples: u32) -> Vec<Cell> {
    let white = Material::diffuse(Vec3::ONE);
    let kinds = METALNESSES.iter().flat_map(|&metallic| INDICES.map(|ior| Material { metallic, ior, ..white }));
    // of metal alone the index does not matter
    cells(kinds.filter(|kind| kind.metallic < 1.0 || kind.ior == 1.5), multiscatter, samples)
}

/// Glass, of which both what it reflects and what it lets through counts.
pub fn glass(samples: u32) -> Vec<Cell> {
    let white = Material { transmission: 1.0, ..Material::diffuse(Vec3::ONE) };
    cells(INDICES[1..].iter().map(|&ior| Material { ior, ..white }), true, samples)
}

/// Reflectances at normal incidence of metal beside a random walk.
pub const BASES: [f32; 3] = [0.9, 0.5, 0.1];
/// Samples of ours a batch, and walks in all.
const COLOURED_SAMPLES: u32 = 1 << 11;
const WALKS: u64 = 1 << 16;

/// Metal, and what a random walk on its microsurface returns, with its standard error.
#[derive(Clone, Debug)]
pub struct Walked {
    /// Ours.
    pub cell: Cell,
    /// The walk's share of the light, and its standard error.
    pub walk: [f64; 2],
}

impl Walked {
    /// What ours returns more than the walk does.
    pub fn difference(&self) -> f64 {
        self.cell.returned[0] - self.walk[0]
    }

    fn new(index: usize, cell: Cell) -> Self {
        let surface = Microsurface::new(cell.material.roughness.into());
        let base = f64::from(cell.material.base_color.x);
        let mut random = SplitMix::new(index as u64 + 1_000_000);
        let [sum, squares] = (0..WALKS).fold([0.0; 2], |[sum, squares], _| {
            let x = microsurface::returned(base, &surface.walk(cell.cos.into(), &mut random));
            [sum + x, squares + x * x]
        });
        let mean = sum / WALKS as f64;
        let variance = squares / WALKS as f64 - mean * mean;
        Self { cell, walk: [mean, (variance.max(0.0) / WALKS as f64).sqrt()] }
    }
}

/// Metal of [`BASES`] at every roughness and cosine.
pub fn walked() -> Vec<Walked> {
    let metal = |base| Material { metallic: 1.0, ior: 1.5, ..Material::diffuse(Vec3::splat(base)) };
    let cells = cells(BASES.into_iter().map(metal), true, COLOURED_SAMPLES);
    cells.into_par_iter().enumerate().map(|(index, cell)| Walked::new(index, cell)).collect()
}

/// What [`walked`] has found, as a section of a Markdown document.
pub fn walked_tables(all: &[Walked]) -> String {
    let error = all.iter().map(|w| w.walk[1].hypot(w.cell.returned[1])).fold(0.0, f64::max);
    let mut text = format!(
        "\n## Coloured metal beside a random walk on its microsurface\n\nWhat coloured metal returns beyond its first reflection is an \
         approximation (Fdez-Aguera 2019, made reciprocal). A random walk between the facets of Smith's model (Heitz et al. 2016), in double \
         precision, with Schlick's reflectance at each of them, is what it stands for. The tables have the share that the walk returns and, \
         in brackets, how much more ours does; {WALKS} walks and {} samples leave a standard error of at most {error:.1e}.\n",
        BATCHES * COLOURED_SAMPLES,
    );
    for kind in all.chunks(ROUGHNESSES.len() * COSINES.len()) {
        let differences = || kind.iter().map(Walked::difference);
        let (least, most) = (differences().fold(0.0, f64::min), differences().fold(0.0, f64::max));
        let base = kind[0].cell.material.base_color.x;
        let _ = write!(text, "\n### metal of reflectance {base}: {least:+.4} to {most:+.4}\n\n{}", head());
        for row in kind.chunks(COSINES.len()) {
            let values: Vec<String> =
                row.iter().map(|w| format!(" {:.3} ({:+.3}) |", w.walk[0], w.difference())).collect();
            let _ = writeln!(text, "| {} |{}", row[0].cell.material.roughness, values.concat());
        }
    }
    text
}

fn cells(kinds: impl Iterator<Item = Material>, multiscatter: bool, samples: u32) -> Vec<Cell> {
    let of_kind = |kind: Material| ROUGHNESSES.iter().map(move |&roughness| Material { roughness, ..kind });
    let at = |material: Material| COSINES.map(|cos| Cell { material, cos, returned: [0.0; 2] });
    let mut cells: Vec<Cell> = kinds.flat_map(of_kind).flat_map(at).collect();
    let features = if multiscatter { FEATURES_ALL } else { FEATURES_ALL & !FEATURE_MULTISCATTER };
    cells.par_iter_mut().enumerate().for_each(|(index, cell)| {
        let mut random = SplitMix::new(index as u64 + 1);
        let means: Vec<f64> = (0..BATCHES).map(|_| batch(cell, features, samples, &mut random)).collect();
        let mean = means.iter().sum::<f64>() / f64::from(BATCHES);
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / f64::from(BATCHES - 1);
        cell.returned = [mean, (variance / f64::from(BATCHES)).sqrt()];
    });
    cells
}

/// The mean weight of samples that fill the unit square evenly, from a random point on, over all lobes in proportion to their
/// probabilities.
fn batch(cell: &Cell, features: u32, samples: u32, random: &mut SplitMix) -> f64 {
    let wo = Vec3::new(num::sqrt((1.0 - cell.cos * cell.cos).max(0.0)), 0.0, cell.cos);
    let bsdf = Bsdf::new(&cell.material, wo, true, features);
    // powers of the root of x^4 = x + 1 (Roberts 2018)
    let steps = [1, 2, 3].map(|k| (1.220_744_084_605_759_6_f64.powi(-k) * 4_294_967_296.0) as u32);
    let begin: [u32; 3] = std::array::from_fn(|_| random.word() as u32);
    let mut sum = 0.0;
    for i in 0..samples {
        let [x, y, w] = std::array::from_fn(|k| begin[k].wrapping_add(steps[k].wrapping_mul(i)));
        let mut first = 0.0;
        for lobe in [DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION, SPECULAR_REFLECTION] {
            let share = f64::from(bsdf.selection(lobe));
            if share > 0.0 {
                let z = ((first + 0.5 * share) * 4_294_967_296.0) as u32;
                sum += share * returned(&bsdf.sample(UVec4::new(x, y, z, w)), &cell.material);
            }
            first += share;
        }
    }
    sum / f64::from(samples)
}

/// The flux that a sample stands for: radiance is scaled where it enters a denser medium.
fn returned(sample: &BsdfSample, material: &Material) -> f64 {
    let bends = is_transmission(sample.lobe) && !material.thin;
    let scale = if bends { f64::from(material.ior).powi(2) } else { 1.0 };
    f64::from(sample.weight.x) * scale
}

/// The head of a table.
fn head() -> String {
    let cosines = COSINES.map(|cos| format!(" {cos} |")).concat();
    format!("| roughness |{cosines}\n|---:|{}\n", "---:|".repeat(COSINES.len()))
}

/// A table of roughnesses and cosines for each kind of surface, as sections of a Markdown document.
pub fn tables(cells: &[Cell]) -> String {
    let mut text = String::new();
    let size = ROUGHNESSES.len() * COSINES.len();
    for kind in cells.chunks(size) {
        let Material { metallic, ior, transmission, .. } = kind[0].material;
        let name = if transmission > 0.0 {
            format!("glass of index {ior}")
        } else if metallic == 1.0 {
            "metal".to_owned()
        } else {
            format!("metalness {metallic}, index {ior}")
        };
        let _ = write!(text, "\n### {name}\n\n{}", head());
        for row in kind.chunks(COSINES.len()) {
            let values: Vec<String> = row.iter().map(|cell| format!(" {:.4} |", cell.returned[0])).collect();
            let _ = writeln!(text, "| {} |{}", row[0].material.roughness, values.concat());
        }
    }
    text
}
