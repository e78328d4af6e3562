//! Random numbers and samplers: chi-square tests, inverses, densities. Seeds are fixed; each check's rate of false
//! alarms over all of its tests together is [`FAMILY_RATE`].

use glam::{UVec4, Vec2, Vec3};
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_shared::rng::{self, Rng, pcg4d};
use restir_shared::sampling::{
    cosine_hemisphere_pdf, invert_cosine_hemisphere, invert_triangle, sample_alias, sample_cosine_hemisphere,
    sample_triangle, triangle_pdf,
};
use restir_shared::scene::Lights;
use restir_tests::random::SplitMix;
use restir_tests::scenes::terrace;
use restir_tests::stats::{chi_square, sidak};
use restir_tests::suite::{ensure, run};
use std::f64::consts::{PI, TAU};
use std::process::ExitCode;

const FAMILY_RATE: f64 = 1.0e-3;
const DRAWS: u32 = 1 << 20;
/// Half the distance between 1 and its neighbour, the error of one rounding.
const ROUNDING: f64 = 1.0 / 16_777_216.0;

fn main() -> ExitCode {
    run(&[
        ("random_words_are_uniform", random_words_are_uniform),
        ("neighbouring_keys_are_independent", neighbouring_keys_are_independent),
        ("words_of_a_draw_are_independent", words_of_a_draw_are_independent),
        ("a_weak_generator_is_seen", a_weak_generator_is_seen),
        ("unit_numbers_are_below_one", unit_numbers_are_below_one),
        ("cosine_hemisphere_has_its_density", cosine_hemisphere_has_its_density),
        ("triangle_is_uniform", triangle_is_uniform),
        ("wrong_samplers_are_seen", wrong_samplers_are_seen),
        ("alias_table_has_its_probabilities", alias_table_has_its_probabilities),
        ("lights_have_their_density", lights_have_their_density),
        ("cosine_hemisphere_inverts", cosine_hemisphere_inverts),
        ("triangle_inverts", triangle_inverts),
        ("densities_integrate_to_one", densities_integrate_to_one),
    ])
}

/// A family of chi-square tests: fails if the smallest p-value is below its share of the family's rate.
#[derive(Default)]
struct Family(Vec<(String, f64)>);

impl Family {
    fn add(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = (u64, f64)>) {
        self.0.push((name.into(), chi_square(cells).p));
    }

    fn passed(&self) -> bool {
        self.0.iter().all(|(_, p)| *p >= sidak(FAMILY_RATE, self.0.len()))
    }

    fn verdict(&self, what: &str) -> Result<(), Failed> {
        let (name, p) = self.0.iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("a family has tests");
        let share = sidak(FAMILY_RATE, self.0.len());
        println!("{what}: smallest p {p:.2e} of {} ({name}), alarm below {share:.1e}", self.0.len());
        ensure(self.passed(), || format!("{what}: {name} has p = {p:.2e}, below {share:.1e}"))
    }
}

/// Counts of `DRAWS` cells.
fn histogram(cells: usize, draws: u32, cell: impl Fn(u32) -> usize + Sync) -> Vec<u64> {
    let chunk = |index: u32| {
        let mut counts = vec![0; cells];
        for i in index << 14..draws.min((index + 1) << 14) {
            counts[cell(i)] += 1;
        }
        counts
    };
    let add = |a: Vec<u64>, b: Vec<u64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
    (0..draws.div_ceil(1 << 14)).into_par_iter().map(chunk).reduce(|| vec![0; cells], add)
}

fn uniform(counts: Vec<u64>) -> impl Iterator<Item = (u64, f64)> {
    let expected = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    counts.into_iter().map(move |count| (count, expected))
}

/// What varies while the rest of the key is fixed.
const AXES: [&str; 4] = ["pixel", "sample", "dimension", "seed"];

/// The key (pixel, sample, dimension, seed) with `i` along one axis; a pixel is (x, y) of an image 1024 wide.
fn key(axis: usize, i: u32) -> (Rng, u32) {
    let (x, y) = if axis == 0 { (i % 1024, i / 1024) } else { (517, 260) };
    let on = |number: usize, otherwise: u32| if axis == number { i } else { otherwise };
    (Rng::new(x, y, on(1, 3), on(3, 1)), on(2, 5))
}

fn draw(axis: usize, i: u32) -> [u32; 4] {
    let (rng, dimension) = key(axis, i);
    rng.draw(dimension).to_array()
}

fn random_words_are_uniform() -> Result<(), Failed> {
    let mut family = Family::default();
    for (axis, name) in AXES.iter().enumerate() {
        for word in 0..4 {
            let bits = |shift: u32, i: u32| (draw(axis, i)[word] >> shift) as usize & 0xfff;
            family
                .add(format!("top bits of word {word} over {name}"), uniform(histogram(4096, DRAWS, |i| bits(20, i))));
            family.add(format!("low bits of word {word} over {name}"), uniform(histogram(4096, DRAWS, |i| bits(8, i))));
        }
    }
    family.verdict("uniformity")
}

/// Pairs of top bits of neighbours at distances that occur: the next, the next row, the next block.
fn serial_pairs(draw: impl Fn(usize, u32) -> [u32; 4] + Sync) -> Family {
    let mut family = Family::default();
    for (axis, name) in AXES.iter().enumerate() {
        for distance in [1, 2, 64, 1024] {
            for word in 0..4 {
                let pair = |i: u32| {
                    let (a, b) = (draw(axis, i)[word], draw(axis, i + distance)[word]);
                    ((a >> 26) << 6 | b >> 26) as usize
                };
                let name = format!("word {word}, {name}s {distance} apart");
                family.add(name, uniform(histogram(4096, DRAWS / 4, pair)));
            }
        }
    }
    family
}

fn neighbouring_keys_are_independent() -> Result<(), Failed> {
    serial_pairs(draw).verdict("serial pairs")
}

fn words_of_a_draw_are_independent() -> Result<(), Failed> {
    let mut family = Family::default();
    for (axis, name) in AXES.iter().enumerate() {
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let pair = |i: u32| {
                let words = draw(axis, i);
                ((words[a] >> 26) << 6 | words[b] >> 26) as usize
            };
            family.add(format!("words {a} and {b} over {name}"), uniform(histogram(4096, DRAWS / 4, pair)));
        }
    }
    family.verdict("pairs of words")
}

/// One multiplication per word, without the mixing between them.
fn a_weak_generator_is_seen() -> Result<(), Failed> {
    let weak = |axis: usize, i: u32| {
        let mut key = [1_u32, 3, 5, 7];
        key[axis] = i;
        let sum = key.iter().fold(0_u32, |sum, &k| sum.wrapping_mul(31).wrapping_add(k));
        [1_664_525_u32, 22_695_477, 214_013, 1_103_515_245].map(|factor| sum.wrapping_mul(factor))
    };
    ensure(!serial_pairs(weak).passed(), || "a linear congruence passes as random".to_owned())
}

fn unit_numbers_are_below_one() -> Result<(), Failed> {
    ensure(f64::from(rng::unit(u32::MAX)) == 1.0 - ROUNDING, || "the largest number is not 1 - 2^-24".to_owned())?;
    ensure(rng::unit(255) == 0.0 && rng::unit(256) > 0.0, || "the low 8 bits count".to_owned())
}

/// Uniform numbers for the samplers.
fn numbers(i: u32, stream: u32) -> Vec2 {
    let words = pcg4d(UVec4::new(i, stream, 11, 13));
    Vec2::new(rng::unit(words.x), rng::unit(words.y))
}

/// Cells uniform in z and in the angle, and in x and y.
fn hemisphere_family(sample: impl Fn(Vec2) -> Vec3 + Sync) -> Family {
    const RINGS: usize = 32;
    const SECTORS: usize = 64;
    let mut family = Family::default();
    let cell = |i: u32| {
        let w = sample(numbers(i, 1));
        let turn = (f64::from(w.y).atan2(f64::from(w.x)) / TAU).rem_euclid(1.0);
        let ring = ((f64::from(w.z) * RINGS as f64) as usize).min(RINGS - 1);
        ring * SECTORS + ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
    };
    let expected = |cell: usize| {
        let z = |ring: usize| ring as f64 / RINGS as f64;
        let ring = cell / SECTORS;
        f64::from(DRAWS) * (z(ring + 1).powi(2) - z(ring).powi(2)) / SECTORS as f64
    };
    let counts = histogram(RINGS * SECTORS, DRAWS, cell);
    family.add("z and angle", counts.into_iter().enumerate().map(|(i, count)| (count, expected(i))));
    // Malley: the projection is uniform on the disk, so x has the semicircle's density
    let below = |x: f64| 0.5 + (x * (1.0 - x * x).max(0.0).sqrt() + x.asin()) / PI;
    for axis in 0..2 {
        let cell = |i: u32| ((f64::from(sample(numbers(i, 2))[axis]) + 1.0) * 128.0).clamp(0.0, 255.0) as usize;
        let edge = |i: usize| below((i as f64 / 128.0 - 1.0).clamp(-1.0, 1.0));
        let cells = histogram(256, DRAWS, cell).into_iter().enumerate();
        let cells = cells.map(|(i, count)| (count, f64::from(DRAWS) * (edge(i + 1) - edge(i))));
        family.add(["x", "y"][axis], cells);
    }
    family
}

fn cosine_hemisphere_has_its_density() -> Result<(), Failed> {
    for i in 0..DRAWS {
        let w = sample_cosine_hemisphere(numbers(i, 1));
        let length: f64 = w.to_array().iter().map(|&x| f64::from(x).powi(2)).sum();
        // sine and cosine have 2 ulp, roots and products a rounding each
        ensure((length - 1.0).abs() < 16.0 * ROUNDING, || format!("{w} has length {}", length.sqrt()))?;
    }
    hemisphere_family(sample_cosine_hemisphere).verdict("cosine hemisphere")
}

/// Cells of a grid over the barycentric coordinates; those on the diagonal have half of the others' share.
fn triangle_family(sample: impl Fn(Vec2) -> Vec2 + Sync) -> Family {
    const SIDE: usize = 32;
    let cell = |i: u32| {
        let b = sample(numbers(i, 3));
        let index = |x: f32| ((x * SIDE as f32) as usize).min(SIDE - 1);
        index(b.y) * SIDE + index(b.x)
    };
    let whole = 2.0 * f64::from(DRAWS) / (SIDE * SIDE) as f64;
    let expected = |cell: usize| match (cell / SIDE + cell % SIDE).cmp(&(SIDE - 1)) {
        std::cmp::Ordering::Less => whole,
        std::cmp::Ordering::Equal => 0.5 * whole,
        std::cmp::Ordering::Greater => 0.0,
    };
    let mut family = Family::default();
    let counts = histogram(SIDE * SIDE, DRAWS, cell);
    family.add("barycentric grid", counts.into_iter().enumerate().map(|(i, count)| (count, expected(i))));
    family
}

fn triangle_is_uniform() -> Result<(), Failed> {
    for i in 0..DRAWS {
        let b = sample_triangle(numbers(i, 3));
        let inside = b.x >= 0.0 && b.y >= 0.0 && f64::from(b.x) + f64::from(b.y) <= 1.0;
        ensure(inside, || format!("{b} is outside"))?;
    }
    triangle_family(sample_triangle).verdict("triangle")
}

fn wrong_samplers_are_seen() -> Result<(), Failed> {
    let uniform_hemisphere = |u: Vec2| {
        let z = f64::from(u.x);
        let (r, angle) = ((1.0 - z * z).sqrt(), TAU * f64::from(u.y));
        Vec3::new((r * angle.cos()) as f32, (r * angle.sin()) as f32, z as f32)
    };
    let lifted = |u: Vec2| sample_cosine_hemisphere(Vec2::new(u.x * 0.99, u.y));
    let clustered = |u: Vec2| {
        let b = Vec2::new(u.x, u.y);
        if b.x + b.y > 1.0 { b * 0.5 } else { b }
    };
    ensure(!hemisphere_family(uniform_hemisphere).passed(), || "uniform passes as cosine".to_owned())?;
    ensure(!hemisphere_family(lifted).passed(), || "a missing horizon goes unnoticed".to_owned())?;
    ensure(!triangle_family(clustered).passed(), || "a clustered triangle passes as uniform".to_owned())
}

/// A table by hand: index i keeps its own with probability (i + 1) / 8, its alias is 7 - i.
fn alias_table_has_its_probabilities() -> Result<(), Failed> {
    let entry = |i: u32| ((i + 1) as f32 * 0.125, 7 - i);
    let mut family = Family::default();
    let counts = histogram(8, DRAWS, |i| {
        let words = pcg4d(UVec4::new(i, 17, 19, 23));
        sample_alias([words.x, words.y], 8, entry) as usize
    });
    let expected = |i: usize| f64::from(DRAWS) * ((i + 1) as f64 + (8 - (7 - i + 1)) as f64) / 64.0;
    family.add("table of 8", counts.into_iter().enumerate().map(|(i, count)| (count, expected(i))));
    for count in [1, 3, 1000] {
        let cell = |i: u32| {
            let words = pcg4d(UVec4::new(i, 29, count, 31));
            sample_alias([words.x, words.y], count, |i| (1.0, i)) as usize
        };
        family.add(format!("{count} equal outcomes"), uniform(histogram(count as usize, DRAWS, cell)));
    }
    ensure(sample_alias([u32::MAX, u32::MAX], 5, |i| (1.0, i)) == 4, || "the last index is out of reach".to_owned())?;
    family.verdict("alias table")
}

/// Emitters of different power: how often each is drawn against the density that the scene states for it.
fn lights_have_their_density() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let view = buffers.view();
    // the emitters are told apart by the plane they lie in: `terrace` has one at z = -1.4 and one above y = 0.5
    let quads: [usize; 2] = [2, 3];
    let areas = quads.map(|quad| quad_area(setting.quads[quad].corners));
    let light = |i: u32| view.sample_light(pcg4d(UVec4::new(i, 37, 41, 43)));
    let which = |position: Vec3| if position.y > 0.5 { 0 } else { 1 };
    let mut densities = [0.0; 2];
    for i in 0..1000 {
        let light = light(i);
        densities[which(light.position)] = f64::from(light.density);
    }
    let shares: Vec<_> = densities.iter().zip(areas).map(|(density, area)| density * area).collect();
    println!("emitters: probabilities {shares:.6?}");
    ensure((shares.iter().sum::<f64>() - 1.0).abs() < 1.0e-6, || format!("probabilities {shares:?} do not add to 1"))?;
    ensure((shares[0] - shares[1]).abs() > 0.01, || "the emitters are alike: no table".to_owned())?;
    let counts = histogram(2, DRAWS, |i| which(light(i).position));
    let mut family = Family::default();
    family.add("emitters", counts.into_iter().zip(shares).map(|(count, share)| (count, share * f64::from(DRAWS))));
    family.verdict("lights")
}

/// The area of a parallelogram.
fn quad_area([a, b, _, d]: [[f32; 3]; 4]) -> f64 {
    let edge = |p: [f32; 3]| [0, 1, 2].map(|i| f64::from(p[i]) - f64::from(a[i]));
    let (e, f) = (edge(b), edge(d));
    let cross = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    cross.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The distance between two numbers of a circle of circumference 1.
fn around(a: f32, b: f32) -> f64 {
    let d = (f64::from(a) - f64::from(b)).abs();
    d.min(1.0 - d)
}

fn cosine_hemisphere_inverts() -> Result<(), Failed> {
    let mut worst = [0.0_f64; 2];
    for i in 0..DRAWS {
        let u = numbers(i, 5);
        let v = invert_cosine_hemisphere(sample_cosine_hemisphere(u));
        worst[0] = worst[0].max((f64::from(u.x) - f64::from(v.x)).abs() / f64::from(u.x).max(ROUNDING));
        if u.x > 0.0 {
            worst[1] = worst[1].max(around(u.y, v.y));
        }
    }
    println!("inverse of the cosine hemisphere: {:.1} and {:.1} roundings", worst[0] / ROUNDING, worst[1] / ROUNDING);
    // x: the root and the two factors are squared, 2 (1/2 + 3.3 + 1/2) ulp of two roundings at most, and a sum
    ensure(worst[0] <= 20.0 * ROUNDING, || format!("radius off by {}", worst[0]))?;
    // y: 3.3 roundings in sine and cosine turn the angle by 3.3 / 2 pi, and atan2 has 2 ulp of up to 1/2
    ensure(worst[1] <= 4.0 * ROUNDING, || format!("angle off by {}", worst[1]))
}

fn triangle_inverts() -> Result<(), Failed> {
    let mut worst = 0.0_f64;
    for i in 0..DRAWS {
        let u = numbers(i, 7);
        let v = invert_triangle(sample_triangle(u));
        worst = worst.max((f64::from(u.x) - f64::from(v.x)).abs()).max((f64::from(u.y) - f64::from(v.y)).abs());
    }
    println!("inverse of the triangle: {:.2} roundings", worst / ROUNDING);
    // one difference and one sum are rounded
    ensure(worst <= 2.0 * ROUNDING, || format!("off by {worst}"))
}

fn densities_integrate_to_one() -> Result<(), Failed> {
    // the midpoint rule is exact for what is linear in z
    let rings = 1000;
    let integral: f64 = (0..rings)
        .map(|i| f64::from(cosine_hemisphere_pdf((i as f32 + 0.5) / rings as f32)) * TAU / f64::from(rings))
        .sum();
    ensure((integral - 1.0).abs() < 4.0 * ROUNDING, || format!("cosine hemisphere: {integral}"))?;
    ensure(cosine_hemisphere_pdf(-0.5) == 0.0, || "density below the horizon".to_owned())?;
    let mut random = SplitMix::new(1);
    for _ in 0..1000 {
        let area = random.range(1e-6, 1e6) as f32;
        let integral = f64::from(triangle_pdf(area)) * f64::from(area);
        ensure((integral - 1.0).abs() <= ROUNDING, || format!("triangle of area {area}: {integral}"))?;
    }
    Ok(())
}
