//! Light that collides once in slabs and half spaces.

use libtest_mimic::Failed;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{Vec2, Vec3, Vec4};
use restir_shared::medium::{Medium, transmittance};
use restir_shared::sampling::sample_cosine_hemisphere;
use restir_shared::scene::Trace;
use restir_shared::transport::{ScatteredOnce, WayOut, scatter_once};
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest, moments};
use restir_tests::suite::ensure;

use super::solids::numbers;

const SAMPLES: u64 = 1 << 20;

/// From z = 0 down to minus its depth; the first side is the upper one.
struct Slab(f32);

impl Trace for Slab {
    fn closest(&self, ray: &Ray) -> Hit {
        let down = ray.direction.z < 0.0;
        let border = if down { -self.0 } else { 0.0 };
        let t = (border - ray.origin.z) / ray.direction.z;
        let hit = t > 0.0 && t < ray.t_max;
        if hit { Hit { t, id: u32::from(down), uv: Vec2::ZERO } } else { Hit::MISS }
    }
}

/// What enters.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Entry {
    /// Along the normal.
    Pencil,
    /// By Lambert's law.
    Diffuse,
}

fn medium(extinction: Vec3, albedo: Vec3, anisotropy: f32) -> Medium {
    Medium { extinction, albedo, absorbed: Vec3::ONE - albedo, anisotropy }
}

/// A ray in, to the border ahead.
fn entering(slab: &Slab, entry: Entry, u: Vec2) -> Ray {
    let inward = match entry {
        Entry::Pencil => Vec3::NEG_Z,
        Entry::Diffuse => -sample_cosine_hemisphere(u),
    };
    Ray { origin: Vec3::ZERO, direction: inward, t_max: slab.0 / -inward.z, key: 0 }
}

fn pair(u: Vec4) -> [Vec2; 2] {
    [Vec2::new(u.x, u.y), Vec2::new(u.z, u.w)]
}

/// Of each channel what is reflected, and what is transmitted.
fn once(slab: &Slab, medium: &Medium, entry: Entry, way: WayOut) -> Vec<Moments> {
    moments(SAMPLES, 1 << 12, 6, |index| {
        let mut random = SplitMix::new(12 << 41 | index);
        let [a, b] = pair(numbers(&mut random));
        let [c, d] = pair(numbers(&mut random));
        let ScatteredOnce { hit, worth, .. } = scatter_once(slab, &entering(slab, entry, a), medium, [b, c, d], way);
        let mut found = [0.0; 6];
        if hit.is_hit() {
            let side = 3 * hit.id as usize;
            found[side..side + 3].copy_from_slice(&worth.to_array().map(f64::from));
        }
        found
    })
}

/// `int_0^1 exp(-x / mu) dmu`.
fn second_exponential_integral(x: f64) -> f64 {
    const STEPS: u32 = 2000;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    (0..STEPS).map(|i| (-x / middle(i)).exp()).sum::<f64>() / f64::from(STEPS)
}

/// What a slab of a depth in mean free paths reflects and transmits of a pencil, after one collision that turns light anywhere.
fn of_pencil(depth: f64, albedo: f64) -> [f64; 2] {
    const STEPS: u32 = 600;
    let step = depth / f64::from(STEPS);
    (0..STEPS).fold([0.0; 2], |sums, i| {
        let t = (f64::from(i) + 0.5) * step;
        let collided = 0.5 * albedo * (-t).exp() * step;
        let out = [t, depth - t].map(second_exponential_integral);
        [sums[0] + collided * out[0], sums[1] + collided * out[1]]
    })
}

/// Of walks elsewhere, with their standard error.
fn walked(value: f64) -> Moments {
    Moments::known(value, 5.0e-4)
}

pub(crate) fn slabs_scatter_once_as_they_should() -> Result<(), Failed> {
    let mut family = Family::new("single scattering", FAMILY_RATE);
    let gray = |albedo: f32, g: f32| medium(Vec3::ONE, Vec3::splat(albedo), g);
    let pencil = of_pencil(1.5, 0.8);
    ensure((pencil[0] + pencil[1] - 0.187_627).abs() < 5.0e-6, || format!("{pencil:?}"))?;
    let mut variances = Vec::new();
    for way in [WayOut::Dimmed, WayOut::Drawn] {
        let found = once(&Slab(1.5), &gray(0.8, 0.0), Entry::Pencil, way);
        for (side, expected) in pencil.into_iter().enumerate() {
            family.z_test(format!("pencil, {way:?}, {side}"), ZTest::new(found[3 * side], Moments::exact(expected)));
        }
        let both = |index: usize| (found[index].mean(), found[index].standard_error());
        // only one of the two sides has something
        let [up, down] = [&found[0], &found[3]];
        let variance = up.variance() + down.variance() - 2.0 * up.mean() * down.mean();
        println!("{way:?}: {:?} and {:?}, variance {variance:.4}", both(0), both(3));
        variances.push(variance);
        let known = [(1.0, 0.9, 0.0, 0.1770, 0.1044), (1.0, 0.9, 0.5, 0.0844, 0.1794), (4.0, 0.9, 0.0, 0.1834, 0.0063)];
        for (depth, albedo, g, reflected, transmitted) in known {
            let found = once(&Slab(depth), &gray(albedo, g), Entry::Diffuse, way);
            for (side, value) in [reflected, transmitted].into_iter().enumerate() {
                family.z_test(
                    format!("depth {depth}, g {g}, {way:?}, {side}"),
                    ZTest::new(found[3 * side], walked(value)),
                );
            }
        }
        // a half space: (2 / 3) (1 - ln 2) of the albedo
        let half_space = once(&Slab(1.0e4), &gray(0.5, 0.0), Entry::Diffuse, way);
        let expected = 0.5 * 2.0 / 3.0 * (1.0 - std::f64::consts::LN_2);
        family.z_test(format!("half space, {way:?}"), ZTest::new(half_space[0], Moments::exact(expected)));
    }
    println!("{}", family.verdict()?);
    // known as 0.031 and 0.081
    let close = (variances[0] / 0.031 - 1.0).abs() < 0.03 && (variances[1] / 0.081 - 1.0).abs() < 0.03;
    ensure(close, || format!("variances {variances:?}"))?;
    // what has not collided: 2 E3(1) through a slab of depth 1
    let passed = moments(SAMPLES, 1 << 12, 1, |index| {
        let [a, _] = pair(numbers(&mut SplitMix::new(13 << 41 | index)));
        [f64::from(transmittance(gray(0.9, 0.0).extinction, entering(&Slab(1.0), Entry::Diffuse, a).t_max).x)]
    });
    let test = ZTest::new(passed[0], Moments::exact(0.219_384));
    ensure(test.p > FAMILY_RATE, || format!("{} passes", passed[0].mean()))
}

/// Each channel has what a medium of its own coefficients would give.
pub(crate) fn channels_share_their_collisions() -> Result<(), Failed> {
    let (extinction, albedo) = (Vec3::new(0.5, 2.0, 8.0), Vec3::new(0.95, 0.8, 0.5));
    let mut family = Family::new("single scattering by channel", FAMILY_RATE);
    for way in [WayOut::Dimmed, WayOut::Drawn] {
        let found = once(&Slab(1.5), &medium(extinction, albedo, 0.0), Entry::Pencil, way);
        for channel in 0..3 {
            let expected = of_pencil(1.5 * f64::from(extinction[channel]), albedo[channel].into());
            for side in 0..2 {
                let name = format!("{way:?}, channel {channel}, side {side}");
                family.z_test(name, ZTest::new(found[3 * side + channel], Moments::exact(expected[side])));
            }
        }
    }
    println!("{}", family.verdict()?);
    // black, and without any collisions, nothing comes of it, and no NaN
    let nothing = [medium(extinction, Vec3::ZERO, 0.0), medium(Vec3::ZERO, albedo, 0.0)];
    for (medium, way) in nothing.iter().flat_map(|medium| [(medium, WayOut::Dimmed), (medium, WayOut::Drawn)]) {
        let found = once(&Slab(1.0), medium, Entry::Pencil, way);
        ensure(found.iter().all(|found| found.mean() == 0.0), || format!("{medium:?}, {way:?}"))?;
    }
    Ok(())
}

/// As printed: divided by the density of the length of the way out, whose mean has no bound, and without what the way in takes.
pub(crate) fn slides_are_seen_to_be_wrong() -> Result<(), Failed> {
    const DEPTH: f64 = 1.5;
    const ALBEDO: f64 = 0.8;
    let literal = moments(SAMPLES, 1 << 12, 2, |index| {
        let mut random = SplitMix::new(14 << 41 | index);
        let collided = 1.0 - (-DEPTH).exp();
        let t = -(-random.unit() * collided).ln_1p();
        let cos = 2.0 * random.unit() - 1.0;
        let out = if cos < 0.0 { t / -cos } else { (DEPTH - t) / cos };
        let drawn = -(-random.unit()).ln_1p();
        let density = (-t).exp() / collided;
        let reaches = drawn > out;
        // T(out) over the densities of both lengths; and with the way out alone
        [
            if reaches { ALBEDO * (-out).exp() / (density * (-drawn).exp()) * (-t).exp() } else { 0.0 },
            ALBEDO * (-out).exp() / density,
        ]
    });
    let [drawn, dimmed] = [literal[0].mean(), literal[1].mean()];
    println!("as printed {drawn:.2} and {dimmed:.3}, where the truth is 0.1876");
    // the first grows with the logarithm of how many samples there are: about 0.19 times the longest way
    ensure(drawn > 1.0 && (dimmed - 0.354).abs() < 3.0e-3, || format!("{literal:?}"))
}

/// The slides' listing has the rate of the chosen channel in all exponents of the mixture, and normalises each channel by its own depth.
/// That is not biased, as has been said of it: the chosen channel's exponential cancels, and what is left of the choice sums to 1.
/// What it does is to leave weights without a bound: the second moment grows as fast as the thickest channel is deep.
pub(crate) fn listings_of_channels_are_noisy() -> Result<(), Failed> {
    const STEPS: u32 = 100_000;
    let (rates, albedos, depth) = ([0.5_f64, 2.0, 8.0], [0.95, 0.8, 0.5], 1.5);
    let scattered = [0, 1, 2].map(|c: usize| rates[c] * albedos[c]);
    let chosen = scattered.map(|scattering| scattering / scattered.iter().sum::<f64>());
    let collides = rates.map(|rate| 1.0 - (-rate * depth).exp());
    let density = |t: f64, rate: [f64; 3]| -> f64 {
        (0..3).map(|k| chosen[k] * rates[k] * (-rate[k] * t).exp() / collides[k]).sum()
    };
    // mean and second moment of each channel's worth, over distances and choices
    let of = |literal: bool| {
        let mut moments = [[0.0_f64; 3]; 2];
        for (hero, step) in (0..3).flat_map(|hero| (0..STEPS).map(move |step| (hero, step))) {
            let t = (f64::from(step) + 0.5) * depth / f64::from(STEPS);
            let drawn =
                chosen[hero] * rates[hero] * (-rates[hero] * t).exp() / collides[hero] * depth / f64::from(STEPS);
            let taken = density(t, if literal { [rates[hero]; 3] } else { rates });
            for channel in 0..3 {
                let worth = scattered[channel] * (-rates[channel] * t).exp() / taken;
                moments[0][channel] += drawn * worth;
                moments[1][channel] += drawn * worth * worth;
            }
        }
        moments
    };
    let [right, literal] = [false, true].map(of);
    println!("by the mixture {right:.5?}, as printed {literal:.5?}");
    for (channel, exact) in [0.501_25, 0.760_17, 0.499_997].into_iter().enumerate() {
        let means = [right[0][channel], literal[0][channel]];
        ensure(means.iter().all(|mean| (mean - exact).abs() < 6.0e-6), || format!("{means:?}, not {exact}"))?;
    }
    ensure(literal[1][0] > 100.0 * right[1][0], || "the listing does as well".to_owned())
}
