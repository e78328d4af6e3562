//! Zhang and d'Eon 2025: what each collision under a surface adds, how distances are best sampled, and how far from where it enters light
//! leaves.

use std::fmt::Write;
use std::time::Instant;

use rayon::prelude::*;
use restir::image::Image;
use restir::render::Render;
use restir::scene::builtin;
use restir::technique::path::{Orders, PathSettings};
use restir::{Error, buffers::SceneBuffers};
use restir_shared::glam::{DVec3, Vec2, Vec3};
use restir_shared::medium::{Channels, transmittance};
use restir_shared::num;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::sampling::{sample_cosine_hemisphere, sample_henyey_greenstein};
use restir_shared::vec::{Frame, normalize};

use super::claim::{self, Claim};
use super::picture::grid;
use super::{Environs, Files, PICTURE};
use crate::bench::plot::{self, Line, Panel};
use crate::bench::table::Setup;

const SCENE: &str = "cube";
/// The most collisions of the images; of the last one all.
const STEPS: [u32; 7] = [0, 1, 2, 4, 8, 16, u32::MAX];
/// Of the tables beside the pictures.
const WALKS: u32 = 1 << 20;
/// A colourful medium, in a slab of the depth 1.
const EXTINCTION: Vec3 = Vec3::new(0.5, 2.0, 8.0);
const ALBEDO: Vec3 = Vec3::new(0.95, 0.8, 0.5);
/// A slab in which light collides once: depth in mean free paths, and albedo.
const ONCE: (f32, f32) = (1.5, 0.8);
/// Rings around where light enters, in mean free paths: so many a factor of ten, from a hundredth on.
const RINGS_A_DECADE: f64 = 8.0;
pub(super) const RINGS: usize = 25;
pub(super) const ALBEDOS: [f32; 3] = [0.8, 0.95, 0.99];

/// The files of the figure, of so many samples a pixel.
///
/// # Errors
/// As of [`Render::render`]; if a plot cannot be drawn.
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let images = bounces(environs, size, samples)?;
    let (distances, channels, rings) = (distances(), channels(), rings(Enters::Lambert));
    let drawn = plot::grid(&[searchlight(&rings)], 1, (720, 480));
    let drawn = drawn.map_err(|problem| Error::Setting(format!("the plot cannot be drawn: {problem}")))?;
    Ok(Files {
        picture: Some(grid(&images, 4)),
        texts: vec![("searchlight.csv".to_owned(), table(&rings)), ("searchlight.svg".to_owned(), drawn)],
        report: report(&images, samples, &distances, &channels, &setup.markdown("")),
    })
}

fn bounces(environs: &mut impl Environs, size: [u32; 2], samples: u32) -> Result<Vec<Image>, Error> {
    let unknown = || Error::Setting(format!("there is no scene {SCENE}"));
    let scene = SceneBuffers::build(&builtin::scene(SCENE).ok_or_else(unknown)?)?;
    let image = |most: u32| {
        let settings = PathSettings { orders: Orders { least: 0, most }, max_depth: 4, ..PathSettings::default() };
        let render = Render { count: samples, ..Render::new(size, settings) };
        environs.run(&format!("{SCENE}, {}", name(most)), |executor, observe| {
            render.render_observed(&scene, executor, &mut |step| observe(step.progress)).map(|rendered| rendered.image)
        })
    };
    STEPS.into_iter().map(image).collect()
}

fn name(most: u32) -> String {
    if most == u32::MAX { "all collisions".to_owned() } else { format!("up to {most} collisions") }
}

fn brightness(image: &Image) -> f64 {
    let values = image.pixels.as_flattened();
    values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
}

/// The mean of numbers, and their variance.
#[derive(Clone, Copy, Default)]
struct Estimate {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Estimate {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self::default(), |all, x| Self {
            count: all.count + 1.0,
            sum: all.sum + x,
            squares: all.squares + x * x,
        })
    }

    fn mean(self) -> f64 {
        self.sum / self.count
    }

    fn variance(self) -> f64 {
        self.squares / self.count - self.mean() * self.mean()
    }
}

/// A way to sample, with what it estimates and nanoseconds a sample.
struct Way {
    name: &'static str,
    estimate: Estimate,
    nanoseconds: f64,
}

fn timed(name: &'static str, of: impl Fn(u32) -> f64) -> Way {
    let start = Instant::now();
    let estimate = Estimate::of((0..WALKS).map(of));
    Way { name, estimate, nanoseconds: start.elapsed().as_secs_f64() * 1.0e9 / f64::from(WALKS) }
}

/// What leaves a slab after one collision, of light that enters straight: the distance sampled as light flies, or below the slab's depth.
fn distances() -> [Way; 2] {
    let (depth, albedo) = (ONCE.0, Vec3::splat(ONCE.1));
    let channels = Channels::new(Vec3::ONE, Vec3::ONE);
    let leaves = move |t: f32, words: restir_shared::glam::UVec4| {
        let turned = sample_henyey_greenstein(Vec2::new(unit(words.z), unit(words.w)), 0.0);
        let way = if turned.z > 0.0 { (depth - t) / turned.z } else { t / -turned.z };
        transmittance(Vec3::ONE, way.min(1.0e6)).x
    };
    let words = |i: u32| Rng::new(i, 0, 0, 1, Sampler::Independent).hash(0);
    let unbounded = timed("as light flies", |i| {
        let words = words(i);
        let t = channels.sample(Vec2::new(unit(words.x), unit(words.y)));
        if t < depth { f64::from((albedo * channels.collided(t)).x * leaves(t, words)) } else { 0.0 }
    });
    let bounded = timed("bounded by the depth", |i| {
        let words = words(i);
        let t = channels.sample_within(Vec2::new(unit(words.x), unit(words.y)), depth);
        f64::from((albedo * channels.collided_within(t, depth)).x * leaves(t, words))
    });
    [unbounded, bounded]
}

/// Where light leaves a slab, and what is left of it by channel.
struct Exit {
    reflected: bool,
    radius: f64,
    light: Vec3,
}

/// How light enters.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Enters {
    Lambert,
    Straight,
}

/// A walk from where light enters; `weights` are those of channels, of what the path is worth.
fn walk(
    rng: &Rng,
    enters: Enters,
    depth: f32,
    [extinction, albedo]: [Vec3; 2],
    weights: impl Fn(Vec3) -> Vec3,
) -> Option<Exit> {
    const MOST: u32 = 1 << 14;
    let words = rng.hash(0);
    let entered = sample_cosine_hemisphere(Vec2::new(unit(words.x), unit(words.y)));
    let entered = if enters == Enters::Straight { Vec3::Z } else { entered };
    let (mut at, mut direction) = (DVec3::ZERO, Vec3::new(entered.x, entered.y, -entered.z));
    let mut light = Vec3::ONE;
    for collision in 1..MOST {
        let words = rng.hash(2 * collision);
        let channels = Channels::new(extinction, weights(light * albedo));
        let distance = channels.sample(Vec2::new(unit(words.x), unit(words.y)));
        let border = if direction.z > 0.0 { 0.0 } else { f64::from(-depth) };
        let way = (border - at.z) / f64::from(direction.z);
        if way <= f64::from(distance) {
            let out = at + direction.as_dvec3() * way;
            let light = light * channels.passed(way as f32);
            return Some(Exit { reflected: direction.z > 0.0, radius: out.truncate().length(), light });
        }
        at += direction.as_dvec3() * f64::from(distance);
        light *= albedo * channels.collided(distance);
        if collision > 16 {
            let survival = num::clamp(light.max_element(), 0.05, 1.0);
            if unit(rng.hash(2 * collision + 1).x) >= survival {
                return None;
            }
            light /= survival;
        }
        let turned = sample_henyey_greenstein(Vec2::new(unit(words.z), unit(words.w)), 0.0);
        direction = normalize(Frame::new(direction).to_world(turned));
    }
    None
}

/// What a colourful slab reflects, channels chosen by what the path is worth, and all alike; red, green and blue.
fn channels() -> [[Estimate; 3]; 2] {
    let of = |weights: fn(Vec3) -> Vec3| {
        let reflected = |i: u32| {
            let rng = Rng::new(i, 0, 0, 2, Sampler::Independent);
            let exit = walk(&rng, Enters::Lambert, 1.0, [EXTINCTION, ALBEDO], weights).filter(|exit| exit.reflected);
            exit.map_or(Vec3::ZERO, |exit| exit.light)
        };
        let all: Vec<Vec3> = (0..WALKS).into_par_iter().map(reflected).collect();
        [0, 1, 2].map(|channel| Estimate::of(all.iter().map(|light| f64::from(light[channel]))))
    };
    [of(|worth| worth), of(|_| Vec3::ONE)]
}

/// The middle of a ring, and its ends.
pub(super) fn ring(index: usize) -> (f64, [f64; 2]) {
    let end = |i: usize| 10.0_f64.powf(i as f64 / RINGS_A_DECADE - 2.0);
    ((end(index) * end(index + 1)).sqrt(), [end(index), end(index + 1)])
}

/// What leaves a half space a unit of area, in rings around where light enters, by albedo.
pub(super) fn rings(enters: Enters) -> Vec<[f64; RINGS]> {
    let of = |albedo: f32| {
        let exit = |i: u32| {
            let rng = Rng::new(i, 1, 0, 3, Sampler::Independent);
            walk(&rng, enters, 1.0e9, [Vec3::ONE, Vec3::splat(albedo)], |worth| worth)
        };
        let exits: Vec<Exit> = (0..WALKS).into_par_iter().filter_map(exit).collect();
        let mut sums = [0.0; RINGS];
        for exit in exits.iter().filter(|exit| exit.reflected) {
            let index = (exit.radius.log10() + 2.0) * RINGS_A_DECADE;
            if let Some(sum) = (index >= 0.0).then(|| sums.get_mut(index as usize)).flatten() {
                *sum += f64::from(exit.light.x);
            }
        }
        std::array::from_fn(|i| {
            let (_, [from, to]) = ring(i);
            sums[i] / (f64::from(WALKS) * std::f64::consts::PI * (to * to - from * from))
        })
    };
    ALBEDOS.into_iter().map(of).collect()
}

fn searchlight(rings: &[[f64; RINGS]]) -> Panel {
    let line = |(albedo, values): (f32, &[f64; RINGS])| Line {
        name: format!("albedo {albedo}"),
        points: values.iter().enumerate().map(|(i, &value)| (ring(i).0, value)).collect(),
    };
    Panel {
        title: "Reflected by a half space around where light enters".to_owned(),
        axes: ["distance, mean free paths", "R, a squared mean free path"],
        lines: ALBEDOS.into_iter().zip(rings).map(line).collect(),
    }
}

fn table(rings: &[[f64; RINGS]]) -> String {
    let mut text = "distance".to_owned();
    ALBEDOS.iter().for_each(|albedo| text += &format!(",R at albedo {albedo}"));
    for i in 0..RINGS {
        let _ = write!(text, "\n{:.6}", ring(i).0);
        rings.iter().for_each(|values| text += &format!(",{:.6e}", values[i]));
    }
    text + "\n"
}

fn claims(steps: &[f64], distances: &[Way; 2], channels: &[[Estimate; 3]; 2]) -> Vec<Claim> {
    let claim = |id, text: &str, scene: &str, found: String, holds| Claim {
        id,
        text: text.to_owned(),
        scene: scene.to_owned(),
        found,
        holds: Some(holds),
    };
    let largest = (1..steps.len()).max_by(|&a, &b| steps[a].total_cmp(&steps[b])).unwrap_or(1);
    let [unbounded, bounded] = distances;
    let ratio = bounded.estimate.variance() / unbounded.estimate.variance();
    let variance = |way: usize| channels[way].iter().map(|e| e.variance() / (e.mean() * e.mean())).sum::<f64>() / 3.0;
    vec![
        claim(
            "W1",
            "of the steps 0, 1, 2, 4, 8, 16 and all, that from 0 to 1 changes the picture most",
            SCENE,
            format!("the step to {} adds most: {:.1} % of the light", name(STEPS[largest]), 100.0 * steps[largest]),
            largest == 1,
        ),
        claim(
            "W2",
            "distances bounded by the depth have less variance where light collides once",
            "slab",
            format!("{ratio:.3} of the variance"),
            ratio < 1.0,
        ),
        claim(
            "W3",
            "channels by what the path is worth have less variance than all alike",
            "colourful slab",
            format!("{:.3} of the relative variance, in the mean of the channels", variance(0) / variance(1)),
            variance(0) < variance(1),
        ),
    ]
}

fn report(images: &[Image], samples: u32, distances: &[Way; 2], channels: &[[Estimate; 3]; 2], origin: &str) -> String {
    let light: Vec<f64> = images.iter().map(brightness).collect();
    let whole = light.last().copied().unwrap_or(1.0);
    let steps: Vec<f64> =
        (0..light.len()).map(|i| (light[i] - if i > 0 { light[i - 1] } else { 0.0 }) / whole).collect();
    let mut text = format!(
        "# Light that walks under a surface\n\nAfter Zhang and d'Eon 2025.\n\n{origin}\n![Seven images]({PICTURE})\n\nThe scene `{SCENE}` \
         with the light that has collided at most 0, 1, 2, 4, 8 and 16 times inside of the cube, and with all; {samples} samples a pixel, paths of \
         4 segments.\n\n## Claims\n\n{}\n## Collisions\n\n| collisions | light, of all | added by the step |\n|---|---:|---:|\n",
        claim::table(&claims(&steps, distances, channels))
    );
    for ((&most, &light), step) in STEPS.iter().zip(&light).zip(&steps) {
        let _ = writeln!(text, "| {} | {:.2} % | {:.2} % |", name(most), 100.0 * light / whole, 100.0 * step);
    }
    let _ = write!(
        text,
        "\nThe first row holds what never enters the cube, too: the floor and the sky.\n\n## Distances\n\nOf light that enters a slab of \
         {} mean free paths and the albedo {} straight, what leaves after one collision; {WALKS} samples.\n\n| distance | mean | variance | \
         ns a sample | variance x time |\n|---|---:|---:|---:|---:|\n",
        ONCE.0, ONCE.1
    );
    for Way { name, estimate, nanoseconds } in distances {
        let (mean, variance) = (estimate.mean(), estimate.variance());
        let _ =
            writeln!(text, "| {name} | {mean:.5} | {variance:.5} | {nanoseconds:.1} | {:.3} |", variance * nanoseconds);
    }
    let _ = write!(
        text,
        "\n## Channels\n\nOf light that enters a slab of the depth 1 by Lambert's law, what is reflected; extinction {EXTINCTION}, albedo {ALBEDO}, \
         {WALKS} walks.\n\n| channel chosen | mean: red, green, blue | variance: red, green, blue |\n|---|---|---|\n"
    );
    for (name, estimates) in ["by what the path is worth", "all alike"].iter().zip(channels) {
        let of = |what: fn(Estimate) -> f64| estimates.map(|e| format!("{:.5}", what(e))).join(", ");
        let _ = writeln!(text, "| {name} | {} | {} |", of(Estimate::mean), of(Estimate::variance));
    }
    text + "\n## Around a beam\n\n![R over the distance](searchlight.svg)\n\nWhat a half space reflects a unit of area, in mean free paths, of light that \
            enters at a point by Lambert's law ([data](searchlight.csv)).\n"
}
