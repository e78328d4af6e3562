//! Media: coefficients, directions and distances against `f64`, and walks through slabs and half spaces against what is known of them.

use libtest_mimic::Failed;
use restir_shared::glam::{DVec3, Vec2, Vec3};
use restir_shared::medium::{Channels, Medium, albedo_of_color, color_behind};
use restir_shared::num;
use restir_shared::rng::{Rng, Sampler, unit};
use restir_shared::sampling::{henyey_greenstein_pdf, invert_henyey_greenstein, sample_henyey_greenstein};
use restir_tests::slab_walk::{Border, Entry, INDEX, Slab, walk};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest, moments};
use restir_tests::suite::ensure;

restir_tests::suite! {
    later {
        coefficients_keep_their_digits colours_are_those_of_half_spaces directions_keep_their_digits directions_come_back
        directions_have_their_density colors_behind_dielectrics_come_back distances_are_unbiased channels_that_scatter_nothing_keep_their_weights wrong_mixtures_are_seen
        slabs_reflect_and_transmit_what_they_should interfaces_of_half_spaces wrong_walks_are_seen
    }
}

/// Anisotropies from one end of their range to the other.
const ANISOTROPIES: [f32; 11] = [-0.999, -0.9, -0.5, -0.1, -0.001, 0.0, 0.002, 0.3, 0.8, 0.99, 0.999];
/// Numbers in [0, 1), with the smallest and the largest.
const NUMBERS: [f32; 9] = [0.0, 5.960_464_5e-8, 1.0e-6, 1.0e-3, 0.3, 0.5, 0.9, 0.999, 0.999_999_94];
const WALKS: u64 = 1 << 20;

fn off(a: f32, b: f64) -> f64 {
    if b == 0.0 { f64::from(a).abs() } else { (f64::from(a) - b).abs() / b.abs() }
}

/// Van de Hulst's S, by bisection of what it is the inverse of.
fn similarity(color: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let s = 0.5 * (low + high);
        if (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s) > color { low = s } else { high = s }
    }
    0.5 * (low + high)
}

fn coefficients_keep_their_digits() -> Result<(), Failed> {
    let mut worst = [0.0_f64; 2];
    for g in ANISOTROPIES {
        for color in [1.0e-6, 1.0e-3, 0.1, 0.5, 0.9, 0.99, 0.999, 0.999_99] {
            let medium = Medium::of_color(Vec3::splat(color), Vec3::new(1.0e-4, 1.0, 1.0e4), g);
            let (s, g) = (similarity(f64::from(color)), f64::from(g));
            let scale = 1.0 - g * s * s;
            let exact = [(1.0 - s) * (1.0 + s) / scale, s * s * (1.0 - g) / scale];
            let found = [off(medium.albedo.x, exact[0]), off(medium.absorbed.y, exact[1])];
            ensure(found.iter().all(|&off| off < 1.0e-5), || format!("colour {color}, g {g}: off by {found:?}"))?;
            worst = [0, 1].map(|i| worst[i].max(found[i]));
            let sum = f64::from(medium.albedo.x) + f64::from(medium.absorbed.x);
            ensure((sum - 1.0).abs() < 1.0e-6, || format!("colour {color}, g {g}: both parts are {sum}"))?;
            ensure(medium.extinction == Vec3::new(1.0e4, 1.0, 1.0e-4), || format!("{}", medium.extinction))?;
        }
        let ends = [0.0, 1.0].map(|color| Medium::of_color(Vec3::splat(color), Vec3::ONE, g));
        ensure(ends[0].albedo.x == 0.0 && ends[1].absorbed.x == 0.0 && ends[1].albedo.x == 1.0, || {
            format!("{ends:?}")
        })?;
    }
    println!("albedo off by {:.1e}, what is absorbed by {:.1e}", worst[0], worst[1]);
    Ok(())
}

/// The density by `f64`, of a cosine that is known by its distance from the nearer end.
fn exact_density(g: f64, w: DVec3) -> f64 {
    let side = w.x * w.x + w.y * w.y;
    let squared = if w.z >= 0.0 {
        (1.0 - g) * (1.0 - g) + 2.0 * g * side / (1.0 + w.z)
    } else {
        (1.0 + g) * (1.0 + g) - 2.0 * g * side / (1.0 - w.z)
    };
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * squared.powf(1.5))
}

/// One less the cosine and one more, which the map from numbers to angles gives.
fn exact_turn(g: f64, u: f64) -> [f64; 2] {
    let (v, d) = (1.0 - u, 1.0 - g + 2.0 * g * u);
    [
        2.0 * v * (1.0 - g) * (1.0 - g) * (1.0 + g * u) / (d * d),
        2.0 * u * (1.0 + g) * (1.0 + g) * (1.0 - g * v) / (d * d),
    ]
}

fn directions_keep_their_digits() -> Result<(), Failed> {
    let mut worst = [0.0_f64; 3];
    for g in ANISOTROPIES {
        for u in NUMBERS {
            let w = sample_henyey_greenstein(Vec2::new(u, 0.3), g);
            let [less, more] = exact_turn(f64::from(g), f64::from(u));
            let sine = (less * more).sqrt();
            let there = DVec3::new(w.x.into(), w.y.into(), w.z.into());
            let found = (there.x * there.x + there.y * there.y).sqrt();
            // a sine of zero is that of the pole
            let sine_off = if sine > 0.0 { (found - sine).abs() / sine } else { found };
            let density_off = off(henyey_greenstein_pdf(w, g), exact_density(f64::from(g), there));
            worst = [worst[0].max(sine_off), worst[1].max(density_off), worst[2].max((there.length() - 1.0).abs())];
            ensure(sine_off < 3.0e-6 && density_off < 1.0e-5, || {
                format!("g {g}, u {u}: off by {sine_off:e}, {density_off:e}")
            })?;
        }
    }
    println!("sines off by {:.1e}, densities by {:.1e}, lengths by {:.1e}", worst[0], worst[1], worst[2]);
    Ok(())
}

/// Numbers come back within rounding, on the circle of azimuths.
fn directions_come_back() -> Result<(), Failed> {
    let mut worst = 0.0_f32;
    for g in ANISOTROPIES {
        for index in 0..4096 {
            let words = Rng::new(index, 0, 0, 1, Sampler::Independent).hash(0);
            let u = Vec2::new(unit(words.x), unit(words.y));
            let again = invert_henyey_greenstein(sample_henyey_greenstein(u, g), g);
            let turned = (again.y - u.y).abs();
            let away = (again.x - u.x).abs().max(turned.min(1.0 - turned));
            worst = worst.max(away);
            ensure(away < 1.0e-6, || format!("g {g}: {u} comes back {away:e} away"))?;
        }
    }
    println!("numbers come back within {worst:.1e}");
    Ok(())
}

/// The mean cosine is g, and of 16 parts of equal probability each has its share.
fn directions_have_their_density() -> Result<(), Failed> {
    const DRAWS: u32 = 1 << 16;
    let mut family = Family::new("directions by Henyey and Greenstein's function", FAMILY_RATE);
    for (seed, g) in (0..).zip(ANISOTROPIES) {
        let draw = |i: u32| {
            let words = Rng::new(i, 0, 0, seed, Sampler::Independent).hash(1);
            sample_henyey_greenstein(Vec2::new(unit(words.x), unit(words.y)), g)
        };
        let cosines: Moments = (0..DRAWS).map(|i| f64::from(draw(i).z)).collect();
        family.z_test(format!("mean cosine, g {g}"), ZTest::new(cosines, Moments::exact(f64::from(g))));
        let mut counts = [0_u64; 16];
        // limits by the distribution function in f64, not by the map that is tested
        let below = |cos: f64| {
            let g = f64::from(g);
            let q = (1.0 + g * g - 2.0 * g * cos).sqrt();
            if g.abs() < 1.0e-2 {
                0.5 * (1.0 + cos) - 0.75 * g * (1.0 - cos * cos)
            } else {
                (1.0 - g * g) / (2.0 * g) * (1.0 / q - 1.0 / (1.0 + g))
            }
        };
        for i in 0..DRAWS {
            counts[((below(f64::from(draw(i).z)).clamp(0.0, 1.0) * 16.0) as usize).min(15)] += 1;
        }
        if g.abs() < 0.95 {
            family.chi_square(format!("cosines, g {g}"), counts.map(|count| (count, f64::from(DRAWS) / 16.0)));
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

const EXTINCTION: Vec3 = Vec3::new(0.5, 2.0, 8.0);
const ALBEDO: Vec3 = Vec3::new(0.95, 0.8, 0.5);
const DEPTH: f32 = 1.5;

/// How a distance is weighted.
#[derive(Clone, Copy, PartialEq)]
enum Mixture {
    Right,
    /// By the density of the chosen channel alone.
    ChosenAlone,
}

/// Means of what collides before a depth, of what passes it, and of what collides for certain: by channel.
fn distances(mixture: Mixture) -> Vec<Moments> {
    let channels = Channels::new(EXTINCTION, EXTINCTION * ALBEDO);
    moments(1 << 20, 1 << 12, 9, |i| {
        let words = Rng::new(i as u32 & 0xffff, (i >> 16) as u32, 0, 4, Sampler::Independent).hash(0);
        let u = Vec2::new(unit(words.x), unit(words.y));
        let (free, bounded) =
            (channels.sample(u), channels.sample_within(Vec2::new(unit(words.z), unit(words.w)), DEPTH));
        let collided = if free < DEPTH { channels.collided(free) } else { Vec3::ZERO };
        let passed = if free < DEPTH { Vec3::ZERO } else { channels.passed(DEPTH) };
        let mut within = channels.collided_within(bounded, DEPTH);
        if mixture == Mixture::ChosenAlone {
            // what a published listing computes
            let share = EXTINCTION * ALBEDO / (EXTINCTION * ALBEDO).element_sum();
            let z = unit(words.z);
            let chosen = if z < share.x {
                0
            } else if z < share.x + share.y {
                1
            } else {
                2
            };
            let rate = EXTINCTION[chosen];
            let density = rate * num::exp(-rate * bounded) / -num::expm1(-rate * DEPTH);
            let left = Vec3::from_array(EXTINCTION.to_array().map(|rate| num::exp(-rate * bounded)));
            within = EXTINCTION * left / density;
        }
        [collided * ALBEDO, passed, within * ALBEDO].map(|v| v.to_array().map(f64::from)).into_iter().flatten()
    })
}

fn expected_distances() -> [f64; 9] {
    let channel = |i: usize| {
        let left = (-f64::from(EXTINCTION[i % 3]) * f64::from(DEPTH)).exp();
        if i / 3 == 1 { left } else { f64::from(ALBEDO[i % 3]) * (1.0 - left) }
    };
    std::array::from_fn(channel)
}

fn distances_are_unbiased() -> Result<(), Failed> {
    let mut family = Family::new("distances by channel", FAMILY_RATE);
    for (index, (mean, exact)) in distances(Mixture::Right).into_iter().zip(expected_distances()).enumerate() {
        family.z_test(format!("number {index}"), ZTest::new(mean, Moments::exact(exact)));
    }
    println!("{}", family.verdict()?);
    // a channel that is never absorbed, one that is not chosen, and a vacuum
    let vacuum = Channels::new(Vec3::ZERO, Vec3::ZERO);
    ensure(vacuum.sample(Vec2::splat(0.5)) > 1.0e20 && vacuum.passed(1.0e4) == Vec3::ONE, || "a vacuum".to_owned())?;
    let red = Channels::new(Vec3::new(0.0, 1.0e-6, 1.0e3), Vec3::new(0.0, 1.0, 0.0));
    let far = red.sample(Vec2::new(0.3, 0.999_999_94));
    let weights = [red.collided(far), red.passed(far), red.collided_within(0.1, 0.2)];
    ensure(weights.iter().all(|weight| weight.is_finite()) && far > 1.0e6, || format!("{far}: {weights:?}"))
}

/// Light goes farther in a channel that scatters nothing than in those by which distances are sampled: chosen by what they scatter alone, its weight has no
/// bound.
fn channels_that_scatter_nothing_keep_their_weights() -> Result<(), Failed> {
    let (extinction, albedo) = (Vec3::new(2.0, 0.05, 1.0), Vec3::new(0.9, 0.0, 0.5));
    let largest = |channels: Channels| {
        let weights = (0..870).map(|tenth| channels.passed(0.1 * tenth as f32));
        weights.map(|weight| weight.max_element()).fold(0.0, f32::max)
    };
    for throughput in [Vec3::ONE, Vec3::new(1.0e-4, 1.0, 0.2)] {
        let [right, wrong] =
            [Channels::of_path(extinction, throughput, albedo), Channels::new(extinction, throughput * albedo)];
        let (most, bound) = (throughput.y * largest(right), 1024.0 * throughput.element_sum());
        println!(
            "throughput {throughput}: light of {most} at most, {:e} without a floor",
            throughput.y * largest(wrong)
        );
        ensure(most <= bound && throughput.y * largest(wrong) > 1.0e6, || format!("{most} of at most {bound}"))?;
        // weights are those of the distances that are sampled: what passes is what is left
        const DRAWS: u32 = 1 << 22;
        // of a lattice, for what is rarely chosen weighs much
        let number = |i: u32, step: f64| (f64::from(i) * step).fract() as f32;
        let draw = |i: u32| right.sample(Vec2::new(number(i, 0.754_877_666_2), number(i, 0.569_840_290_9)));
        let left = (0..DRAWS).map(|i| if draw(i) > 4.0 { f64::from(right.passed(4.0).y) } else { 0.0 });
        let left = left.sum::<f64>() / f64::from(DRAWS);
        ensure((left - (-0.2_f64).exp()).abs() < 0.005, || format!("{left} passes"))?;
    }
    Ok(())
}

fn wrong_mixtures_are_seen() -> Result<(), Failed> {
    let wrong = distances(Mixture::ChosenAlone);
    let z = |i: usize| ZTest::new(wrong[i], Moments::exact(expected_distances()[i])).z.abs();
    let variance = |all: &[Moments]| (6..9).map(|i| all[i].variance()).sum::<f64>();
    let [right, chosen] = [variance(&distances(Mixture::Right)), variance(&wrong)];
    println!("z {:.1}, {:.1}, {:.1}; variance {chosen:.2} instead of {right:.4}", z(6), z(7), z(8));
    // a channel's own density is right in the mean and useless in its variance
    ensure(chosen > 20.0 * right, || "the density of the chosen channel does as well".to_owned())
}

/// What is wrong in walks that have to be noticed.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    Throughput,
    Anisotropy,
}

/// Reflected and transmitted: in all, without a collision, and after one.
fn shares(slab: &Slab, seed: u32, index: u64, fault: Fault) -> [f64; 6] {
    let mut found = [0.0; 6];
    let turned = Slab { anisotropy: slab.anisotropy + 0.02, ..*slab };
    if let Some(exit) = walk(if fault == Fault::Anisotropy { &turned } else { slab }, seed, index) {
        let weight = if fault == Fault::Throughput { 1.01 * exit.weight } else { exit.weight };
        let side = usize::from(exit.transmitted);
        found[side] = weight;
        if exit.collisions < 2 {
            found[2 + 2 * exit.collisions as usize + side] = weight;
        }
    }
    found
}

fn walks(slab: Slab, seed: u32, fault: Fault) -> Vec<Moments> {
    moments(WALKS, 1 << 12, 6, |index| shares(&slab, seed, index, fault))
}

/// Depth, albedo and anisotropy; reflected and transmitted in all; and by order, where known.
type Known = ([f32; 3], [f64; 2], Option<[f64; 3]>);

/// The same by 10^6 walks elsewhere (Zhang and d'Eon 2025, with Lambert's entry and no interface); without a collision
/// `2 E3(depth)`: reflected, transmitted; transmitted without a collision; reflected, transmitted after one.
const SLABS: [Known; 5] = [
    ([1.0, 0.9, 0.0], [0.3529, 0.4746], Some([0.219_384, 0.1770, 0.1044])),
    ([1.0, 0.9, 0.5], [0.2278, 0.5986], Some([0.219_384, 0.0844, 0.1794])),
    ([4.0, 0.9, 0.0], [0.4731, 0.0903], Some([0.0054, 0.1834, 0.0063])),
    ([4.0, 0.99, 0.0], [0.7104, 0.2161], None),
    ([10.0, 0.99, 0.8], [0.5216, 0.3074], None),
];
/// What 10^6 walks leave open in those figures, and the rounding of their digits.
const KNOWN_TO: f64 = 5.0e-4;

/// A colour behind a dielectric is found again by walks in the medium that [`color_behind`] finds, to 2.5 %; a medium of that colour without an
/// interface is darker there by more than 3 %.
fn colors_behind_dielectrics_come_back() -> Result<(), Failed> {
    let reflected = |color: f32, index: f32| {
        let albedo = albedo_of_color(Vec3::splat(color), 0.0).x;
        let half_space = slab([1.0e9, albedo, 0.0], Border::Dielectric);
        moments(1 << 15, 1 << 12, 1, |walked| {
            walk(&Slab { index, ..half_space }, 3, walked).map_or([0.0], |exit| [exit.weight])
        })[0]
    };
    for index in [1.1, 1.33, 1.5, 1.7] {
        for color in [0.1, 0.4, 0.8] {
            let found = reflected(color_behind(color, index), index);
            let (off, error) = (found.mean() / f64::from(color) - 1.0, found.standard_error() / f64::from(color));
            println!("index {index}, colour {color}: {off:+.4} +- {error:.4}");
            ensure(off.abs() < 0.025 + 4.0 * error, || format!("index {index}, colour {color}: {off:+.4}"))?;
            ensure(reflected(color, index).mean() < 0.97 * f64::from(color), || "no interface is noticed".to_owned())?;
        }
    }
    ensure(color_behind(0.3, 1.0) == 0.3 && color_behind(1.0, 1.5) == 1.0, || "a colour changes".to_owned())
}

fn slab([depth, albedo, anisotropy]: [f32; 3], border: Border) -> Slab {
    Slab { depth, albedo, anisotropy, border, index: INDEX, entry: Entry::Lambert }
}

fn slabs_reflect_and_transmit_what_they_should() -> Result<(), Failed> {
    let mut family = Family::new("slabs", FAMILY_RATE);
    for (seed, (parameters, [reflected, transmitted], orders)) in (0..).zip(SLABS) {
        let found = walks(slab(parameters, Border::Open), seed, Fault::None);
        let [once, reflected_once, transmitted_once] = orders.unwrap_or_default();
        let expected = [reflected, transmitted, 0.0, once, reflected_once, transmitted_once];
        for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
            if i < 2 || orders.is_some() && i != 2 {
                let test = ZTest::new(*found, Moments::known(expected, KNOWN_TO));
                println!(
                    "{parameters:?}, number {i}: {:.5} +- {:.5}, expected {expected}",
                    found.mean(),
                    found.variance_of_mean().sqrt()
                );
                family.z_test(format!("{parameters:?}, number {i}"), test);
            }
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Half spaces that light enters by Lambert's law: albedo of a collision, then what is reflected where light leaves freely, by
/// Chandrasekhar's H: `1 - 2 sqrt(1 - albedo)` times the integral of H(m) m; out of a dielectric; and as if the outside was denser.
const HALF_SPACES: [(f32, [f64; 3]); 4] = [
    (0.5, [0.146_544, 0.0654, 0.1350]),
    (0.9, [0.478_024, 0.2898, 0.4582]),
    (0.95, [0.596_669, 0.4040, 0.5784]),
    (0.98, [0.722_319, 0.5509, 0.7079]),
];

fn interfaces_of_half_spaces() -> Result<(), Failed> {
    let mut family = Family::new("half spaces", FAMILY_RATE);
    for (seed, (albedo, reflected)) in (10..).zip(HALF_SPACES) {
        let borders = [(Border::Open, 0.0), (Border::Dielectric, KNOWN_TO), (Border::DenserOutside, KNOWN_TO)];
        for ((border, known_to), expected) in borders.into_iter().zip(reflected) {
            let found = walks(slab([1.0e9, albedo, 0.0], border), seed, Fault::None)[0];
            let error = found.variance_of_mean().sqrt();
            println!("{border:?}, albedo {albedo}: {:.5} +- {error:.5}, expected {expected}", found.mean());
            family
                .z_test(format!("{border:?}, albedo {albedo}"), ZTest::new(found, Moments::known(expected, known_to)));
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Colours are what half spaces reflect, as far as van de Hulst's formula is: to 1.2 % of it, and better for light ones.
fn colours_are_those_of_half_spaces() -> Result<(), Failed> {
    for (seed, color) in (20..).zip([0.1, 0.5, 0.8, 0.95]) {
        let medium = Medium::of_color(Vec3::splat(color), Vec3::ONE, 0.0);
        let found = walks(slab([1.0e9, medium.albedo.x, 0.0], Border::Open), seed, Fault::None)[0];
        println!("colour {color}: {:.5} +- {:.5}", found.mean(), found.variance_of_mean().sqrt());
        let off = (found.mean() / f64::from(color) - 1.0).abs();
        ensure(off < 0.02, || format!("colour {color} reflects {}", found.mean()))?;
    }
    Ok(())
}

/// A throughput of 1.01, and an anisotropy that is off by 0.02.
fn wrong_walks_are_seen() -> Result<(), Failed> {
    let (parameters, [reflected, _], _) = SLABS[1];
    for fault in [Fault::Throughput, Fault::Anisotropy] {
        let found = walks(slab(parameters, Border::Open), 1, fault)[0];
        let test = ZTest::new(found, Moments::known(reflected, KNOWN_TO));
        println!("z {:.1}", test.z);
        ensure(test.z.abs() > 3.5, || format!("z {:.1}", test.z))?;
    }
    Ok(())
}
