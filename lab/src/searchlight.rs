//! `cargo lab searchlight`: what half spaces and slabs reflect and transmit, and how far from where light enters.

use std::fmt::Write as _;

use clap::Args;
use restir_shared::glam::Vec3;
use restir_shared::medium::{albedo_of_color, color_behind};
use restir_tests::slab_walk::{Border, Entry, INDEX, Slab, walk};
use restir_tests::stats::{Moments, moments};

use crate::Error;
use crate::report::publish;

/// Deep enough that nothing comes through.
const HALF_SPACE: f32 = 1.0e9;
/// Borders of rings around where light enters, in mean free paths; the last one is open.
const RINGS: [f64; 9] = [0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0, 6.0, f64::INFINITY];
const BORDERS: [(Border, &str); 3] =
    [(Border::Open, "none"), (Border::DenserOutside, "denser outside"), (Border::Dielectric, "dielectric")];
const ALBEDOS: [f32; 7] = [0.1, 0.5, 0.8, 0.9, 0.95, 0.98, 0.99];
/// Walks that one task makes.
const CHUNK: u64 = 1 << 12;

/// Options of `cargo lab searchlight`.
#[derive(Args)]
pub struct Options {
    /// How many walks a row is of.
    #[arg(long, default_value_t = 1 << 20)]
    walks: u64,
    /// One medium instead of the report: the part of a collision that is scattered.
    #[arg(long)]
    albedo: Option<f32>,
    /// Of that medium: mean cosine of the angle of scattering.
    #[arg(long, default_value_t = 0.0, requires = "albedo", allow_hyphen_values = true)]
    anisotropy: f32,
    /// Of that medium: depth in mean free paths; a half space if not given.
    #[arg(long, requires = "albedo")]
    depth: Option<f32>,
    /// Write the report to docs/searchlight.md.
    #[arg(long, conflicts_with = "albedo")]
    write: bool,
}

/// What a slab gives back: reflected, transmitted, and of what is reflected each ring's part, after one collision and after more.
struct Row {
    reflected: Moments,
    transmitted: Moments,
    once: Vec<Moments>,
    more: Vec<Moments>,
}

fn row(slab: Slab, walks: u64, seed: u32) -> Row {
    const N: usize = RINGS.len() - 1;
    let all = moments(walks, CHUNK, 2 + 2 * N, |index| {
        let mut found = [0.0; 2 + 2 * N];
        if let Some(exit) = walk(&slab, seed, index) {
            found[usize::from(exit.transmitted)] = exit.weight;
            let ring = RINGS.iter().rposition(|&border| border <= exit.radius).unwrap_or(0).min(N - 1);
            let more = if exit.collisions > 1 { N } else { 0 };
            if !exit.transmitted && exit.collisions > 0 {
                found[2 + more + ring] = exit.weight;
            }
        }
        found
    });
    Row { reflected: all[0], transmitted: all[1], once: all[2..2 + N].to_vec(), more: all[2 + N..].to_vec() }
}

fn share(moments: Moments) -> String {
    format!("{:.5} +- {:.5}", moments.mean(), moments.standard_error())
}

/// Tallies one medium, or the report.
///
/// # Errors
/// [`Error::Environment`] for an albedo, an anisotropy or a depth that no medium has; others if the report cannot be written.
pub fn run(options: &Options) -> Result<(), Error> {
    let Some(albedo) = options.albedo else {
        return publish("searchlight", &report(options.walks), options.write);
    };
    let (anisotropy, depth) = (options.anisotropy, options.depth.unwrap_or(HALF_SPACE));
    if !((0.0..=1.0).contains(&albedo) && anisotropy.abs() <= 0.999 && depth > 0.0) {
        let problem =
            "there is no such medium; give an albedo in 0..1, an anisotropy within 0.999 of 0 and a depth above 0";
        return Err(Error::Environment(problem.to_owned()));
    }
    println!("{}", ring_head());
    for (border, name) in BORDERS {
        for entry in [Entry::Lambert, Entry::Normal] {
            let found = row(Slab { depth, albedo, anisotropy, border, index: INDEX, entry }, options.walks, 1);
            println!(
                "border: {name}, entry: {entry:?}: reflected {}, transmitted {}",
                share(found.reflected),
                share(found.transmitted)
            );
            print!("{}{}", ring_row("once", &found.once), ring_row("more", &found.more));
        }
    }
    Ok(())
}

fn ring_head() -> String {
    let ring = |ends: &[f64]| match ends {
        [from, to] if to.is_finite() => format!("{from} to {to}"),
        ends => format!("beyond {}", ends[0]),
    };
    let rings: Vec<String> = RINGS.windows(2).map(ring).collect();
    format!("| collisions | {} |\n|---|{}", rings.join(" | "), "---:|".repeat(rings.len()))
}

fn ring_row(name: &str, rings: &[Moments]) -> String {
    let rings: Vec<String> =
        rings.iter().map(|ring| format!("{:.4} +- {:.4}", ring.mean(), ring.standard_error())).collect();
    format!("| {name} | {} |\n", rings.join(" | "))
}

/// The constant k of `A = (1 - q) / (1 + k q)`, `q^2 = 1 - albedo`, by least squares of relative errors, and the largest of them.
fn fit(points: &[(f32, f64)]) -> (f64, f64) {
    let q = |albedo: f32| (1.0 - f64::from(albedo)).sqrt();
    let error =
        |k: f64| points.iter().map(move |&(albedo, found)| (1.0 - q(albedo)) / (1.0 + k * q(albedo)) / found - 1.0);
    let squares = |k: f64| error(k).map(|e| e * e).sum::<f64>();
    let best = (0..40_000).map(|i| f64::from(i) * 1.0e-3).min_by(|a, b| squares(*a).total_cmp(&squares(*b)));
    let best = best.unwrap_or(0.0);
    (best, error(best).fold(0.0, |worst: f64, e| worst.max(e.abs())))
}

/// What half spaces behind smooth dielectrics reflect, beside the colour of which `medium::color_behind` finds the medium.
fn behind_dielectrics(walks: u64) -> String {
    const INDICES: [f32; 5] = [1.1, 1.2, 1.33, 1.45, 1.6];
    let mut text = "\n## Half spaces behind smooth dielectrics\n\nReflected by half spaces whose albedo is found by `medium::color_behind` for a colour, \
                    over that colour.\n\n| colour |"
        .to_owned();
    INDICES.iter().for_each(|index| text += &format!(" index {index} |"));
    text += &format!("\n|---:|{}\n", "---:|".repeat(INDICES.len()));
    for color in [0.05, 0.2, 0.4, 0.6, 0.8, 0.9] {
        text += &format!("| {color} |");
        for index in INDICES {
            let albedo = albedo_of_color(Vec3::splat(color_behind(color, index)), 0.0).x;
            let slab = Slab {
                depth: HALF_SPACE,
                albedo,
                anisotropy: 0.0,
                border: Border::Dielectric,
                index,
                entry: Entry::Lambert,
            };
            let found = row(slab, walks, 4).reflected;
            let color = f64::from(color);
            text += &format!(" {:.4} +- {:.4} |", found.mean() / color, found.standard_error() / color);
        }
        text.push('\n');
    }
    text
}

fn report(walks: u64) -> String {
    let mut text = format!(
        "# What media reflect\n\nMade by `cargo lab searchlight --write`: {walks} walks a row by the library's distances, directions and \
         interfaces, without a scene. Lengths are in mean free paths; light enters at a point by Lambert's law, behind the border, and scattering is \
         isotropic. A border may mirror light from inside, as a dielectric of the index {INDEX} does, or as if the outside was denser by \
         {INDEX}: never totally.\n\n## Half spaces\n\nReflected in all, and the fit `A = (1 - q) / (1 + k q)`, where `q^2` is one less the albedo \
         (Zhang and d'Eon 2025 have k = 1.554, for the border \"denser outside\").\n\n| albedo | {} |\n|---:|{}\n",
        BORDERS.map(|(_, name)| name).join(" | "),
        "---:|".repeat(BORDERS.len())
    );
    let of =
        |albedo, border, depth| Slab { depth, albedo, anisotropy: 0.0, border, index: INDEX, entry: Entry::Lambert };
    let found =
        ALBEDOS.map(|albedo| BORDERS.map(|(border, _)| row(of(albedo, border, HALF_SPACE), walks, 1).reflected));
    for (albedo, row) in ALBEDOS.iter().zip(&found) {
        let _ = writeln!(text, "| {albedo} | {} |", row.map(share).join(" | "));
    }
    let fits: [String; 3] = std::array::from_fn(|border| {
        let points: Vec<(f32, f64)> = ALBEDOS.iter().zip(&found).map(|(&a, row)| (a, row[border].mean())).collect();
        let (k, worst) = fit(&points);
        format!("k = {k:.3}, within {:.1} %", 100.0 * worst)
    });
    let _ = writeln!(text, "| fit | {} |", fits.join(" | "));
    let _ = write!(
        text,
        "\n## Around a beam\n\nAlbedo 0.9, no border: what leaves between two distances from where light enters.\n\n{}\n",
        ring_head()
    );
    let rings = row(of(0.9, Border::Open, HALF_SPACE), walks, 2);
    text += &(ring_row("one", &rings.once) + &ring_row("more", &rings.more));
    text += &behind_dielectrics(walks);
    text += "\n## Slabs\n\n| depth | albedo | border | reflected | transmitted |\n|---:|---:|---|---:|---:|\n";
    for (depth, albedo) in [(1.0, 0.9), (4.0, 0.9), (4.0, 0.99)] {
        for (border, name) in BORDERS {
            let found = row(of(albedo, border, depth), walks, 3);
            let (reflected, transmitted) = (share(found.reflected), share(found.transmitted));
            let _ = writeln!(text, "| {depth} | {albedo} | {name} | {reflected} | {transmitted} |");
        }
    }
    text
}
