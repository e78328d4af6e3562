//! Samplers of continuous values against their densities.

use super::support::{DRAWS, ROUNDING, numbers};
use glam::{Vec2, Vec3};
use restir_shared::sampling::{
    blackman_harris_pdf, bounded_exponential_pdf, concentric_disk_pdf, cone_pdf, cosine_hemisphere_pdf,
    exponential_pdf, sample_blackman_harris, sample_bounded_exponential, sample_concentric_disk, sample_cone,
    sample_cosine_hemisphere, sample_exponential, sample_triangle, sample_uniform_hemisphere, sample_uniform_sphere,
    triangle_pdf, uniform_hemisphere_pdf, uniform_sphere_pdf, versine_of_sin2,
};
use restir_tests::stats::{Cap, Disk, Domain, FAMILY_RATE, Family, Line, Moments, SamplerTest, Triangle, ZTest};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Half angles from a third of a milliradian to almost the sphere.
const VERSINES: [f32; 4] = [5.0e-8, 1.0e-3, 0.4, 1.9];
/// Optical depths over the limit of the bounded density.
const DEPTHS: [f32; 4] = [0.0, 4.0e-4, 0.7, 30.0];
const T_MAX: f32 = 2.5;
const RATE: f32 = 3.0;
const AREA: f32 = 0.7;
/// Beyond this the unbounded density has no sample: there -ln(1 - u) would need u > 1 - 2^-24.
const LONGEST: f32 = 16.7 / RATE;
/// The smallest direction that a test may confuse with a longer one; all lengths are 1 to some roundings.
const LENGTH: f64 = 16.0 * ROUNDING;

/// A function as samplers and densities are.
trait Map<A, B>: Fn(A) -> B + Copy + Sync + 'static {}
impl<A, B, F: Fn(A) -> B + Copy + Sync + 'static> Map<A, B> for F {}

/// A sampler with the density that it should have.
struct Sampler {
    name: String,
    /// Counts and expected counts.
    table: Box<dyn Fn() -> Vec<(u64, f64)>>,
    /// The integral of the density.
    integral: Box<dyn Fn() -> f64>,
}

impl Sampler {
    fn new<D: Domain + Copy + 'static>(
        name: &str,
        domain: D,
        cells: [usize; 2],
        sample: impl Map<u64, D::Point>,
        pdf: impl Fn(&D::Point) -> f32 + Copy + Sync + 'static,
    ) -> Self {
        let test = SamplerTest { domain, cells, draws: DRAWS };
        let pdf = move |point: &D::Point| f64::from(pdf(point));
        let table = Box::new(move || test.table(|i| Some(sample(i)), pdf));
        Self { name: name.to_owned(), table, integral: Box::new(move || test.integral(pdf)) }
    }
}

/// A sampler of directions within an angle around +z, whose density depends on z.
fn directions(name: &str, versine: f32, sample: impl Map<Vec2, Vec3>, pdf: impl Map<f32, f32>) -> Sampler {
    let sample = move |i| sample(numbers(i, 1)).as_dvec3().to_array();
    Sampler::new(name, Cap { versine: versine.into() }, [32, 64], sample, move |w| pdf(w[2] as f32))
}

fn disk(name: &str, sample: impl Map<Vec2, Vec2>) -> Sampler {
    let sample = move |i| sample(numbers(i, 3)).as_dvec2().to_array();
    Sampler::new(name, Disk { radius: 1.0 }, [32, 64], sample, |_| concentric_disk_pdf())
}

fn triangle(name: &str, sample: impl Map<Vec2, Vec2>) -> Sampler {
    let sample = move |i| sample(numbers(i, 4)).as_dvec2().to_array();
    Sampler::new(name, Triangle { area: AREA.into() }, [32, 32], sample, |_| triangle_pdf(AREA))
}

/// A sampler of distances up to a limit.
fn distances(name: &str, limit: f32, sample: impl Map<f32, f32>, pdf: impl Map<f32, f32>) -> Sampler {
    let sample = move |i| sample(numbers(i, 5).x).into();
    Sampler::new(name, Line { lo: 0.0, hi: limit.into() }, [1024, 1], sample, move |t| pdf(*t as f32))
}

/// A sampler of places in the Blackman-Harris window.
fn window(name: &str, sample: impl Map<f32, f32>) -> Sampler {
    let sample = move |i| sample(numbers(i, 6).x).into();
    Sampler::new(name, Line { lo: -0.5, hi: 0.5 }, [1024, 1], sample, |x| blackman_harris_pdf(*x as f32))
}

fn all_directions() -> Vec<Sampler> {
    let mut all = vec![
        directions("cosine hemisphere", 1.0, sample_cosine_hemisphere, cosine_hemisphere_pdf),
        directions("uniform hemisphere", 1.0, sample_uniform_hemisphere, uniform_hemisphere_pdf),
        directions("uniform sphere", 2.0, sample_uniform_sphere, |_| uniform_sphere_pdf()),
    ];
    let cone = |versine| move |u| sample_cone(u, versine);
    all.extend(VERSINES.map(|v| directions(&format!("cone of versine {v}"), v, cone(v), move |_| cone_pdf(v))));
    all
}

fn all_points() -> Vec<Sampler> {
    vec![disk("disk", sample_concentric_disk), triangle("triangle", sample_triangle)]
}

fn all_distances() -> Vec<Sampler> {
    let exponential = |u| sample_exponential(u, RATE);
    let mut all = vec![distances("exponential", LONGEST, exponential, |t| exponential_pdf(t, RATE))];
    all.extend(DEPTHS.map(|depth| {
        let (name, rate) = (format!("bounded, depth {depth}"), depth / T_MAX);
        let pdf = move |t| bounded_exponential_pdf(t, rate, T_MAX);
        distances(&name, T_MAX, move |u| sample_bounded_exponential(u, rate, T_MAX), pdf)
    }));
    all.push(window("Blackman-Harris window", sample_blackman_harris));
    all
}

fn family(name: &str, samplers: Vec<Sampler>) -> Family {
    let mut family = Family::new(name, FAMILY_RATE);
    samplers.into_iter().for_each(|sampler| family.chi_square(sampler.name, (sampler.table)()));
    family
}

pub(crate) fn directions_have_their_density() {
    let samplers: [fn(Vec2) -> Vec3; 4] =
        [sample_cosine_hemisphere, sample_uniform_hemisphere, sample_uniform_sphere, |u| sample_cone(u, 1.0e-4)];
    for sample in samplers {
        for i in 0..DRAWS / 8 {
            let w = sample(numbers(i, 1));
            let length = w.as_dvec3().length_squared();
            // sine and cosine have 2 ulp, roots and products a rounding each
            assert!((length - 1.0).abs() < LENGTH, "{w} has length {}", length.sqrt());
        }
    }
    family("directions", all_directions()).assert();
}

pub(crate) fn points_have_their_density() {
    for i in 0..DRAWS / 8 {
        let b = sample_triangle(numbers(i, 4)).as_dvec2();
        assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0, "{b} is outside of the triangle");
    }
    family("points", all_points()).assert();
}

pub(crate) fn distances_have_their_density() {
    let mut family = family("distances", all_distances());
    let values = (0..DRAWS / 8).map(|i| sample_exponential(numbers(i, 5).x, RATE).into()).collect();
    family.kolmogorov("exponential", values, |t: f64| -(-f64::from(RATE) * t).exp_m1());
    let values = (0..DRAWS / 8).map(|i| sample_blackman_harris(numbers(i, 6).x).into()).collect();
    family.kolmogorov("Blackman-Harris window", values, blackman_harris_cdf);
    family.assert();
}

/// The integral of the four-term window (Harris 1978) over its mean.
fn blackman_harris_cdf(x: f64) -> f64 {
    let wave = |k: f64, a: f64| a / 0.358_75 * (TAU * k * x).sin() / (TAU * k);
    0.5 + x + wave(1.0, 0.488_29) + wave(2.0, 0.141_28) + wave(3.0, 0.011_68)
}

/// Every random number is the probability of its half of the window, to 1.4 steps of random numbers, and those of the upper half are those
/// of the lower one with the other sign.
pub(crate) fn window_has_its_distribution() {
    const CELLS: u64 = 1 << 24;
    let place = |cell: u64| sample_blackman_harris(cell as f32 / CELLS as f32);
    let mut worst = 0.0_f64;
    for cell in (0..4096).chain((4096..CELLS / 2).step_by(31)) {
        let x = place(cell);
        assert_eq!(place(CELLS - 1 - cell), -x);
        worst = worst.max((blackman_harris_cdf(x.into()) * CELLS as f64 - (cell as f64 + 0.5)).abs());
    }
    println!("worst: {worst:.2} steps");
    assert!(worst <= 1.6, "{worst} steps");
}

/// The projection of the cosine hemisphere is uniform on the disk (Malley), so x and y have the semicircle's density; the
/// mean of z is 2/3.
pub(crate) fn moments_of_the_cosine_hemisphere() {
    let mut family = Family::new("cosine hemisphere", FAMILY_RATE);
    let below = |x: f64| 0.5 + (x * (1.0 - x * x).max(0.0).sqrt() + x.asin()) / PI;
    let samples: Vec<_> = (0..DRAWS / 8).map(|i| sample_cosine_hemisphere(numbers(i, 2)).as_dvec3()).collect();
    family.kolmogorov("x", samples.iter().map(|w| w.x).collect(), below);
    family.kolmogorov("y", samples.iter().map(|w| w.y).collect(), below);
    let test = ZTest::new(samples.iter().map(|w| w.z).collect(), Moments::exact(2.0 / 3.0));
    println!("mean of z: {:+.2e}, detectable {:.1e}", test.difference, test.detectable_bias(family.share()));
    family.z_test("mean of z", test);
    family.assert();
}

pub(crate) fn densities_integrate_to_one() {
    let over_the_sphere = vec![
        directions("cosine hemisphere over the sphere", 2.0, sample_cosine_hemisphere, cosine_hemisphere_pdf),
        directions("uniform hemisphere over the sphere", 2.0, sample_uniform_hemisphere, uniform_hemisphere_pdf),
    ];
    let all = [all_directions(), over_the_sphere, all_points(), all_distances()];
    for Sampler { name, integral, .. } in all.into_iter().flatten() {
        // a density is rounded some four times; the quadrature is exact for the constants among them; what lies beyond the
        // longest distance is e^-16.7
        let integral = integral();
        assert!((integral - 1.0).abs() <= 8.0 * ROUNDING, "{name}: {integral}");
    }
    // a cone by the ratio of a sphere's radius to its distance
    for sin in [1.0e-6_f64, 1.0e-3, 0.5, 1.0] {
        let exact = 1.0 - (1.0 - sin * sin).sqrt();
        let exact = if sin < 1.0e-2 { 0.5 * sin * sin * (1.0 + 0.25 * sin * sin) } else { exact };
        let versine = f64::from(versine_of_sin2((sin * sin) as f32));
        assert!((versine / exact - 1.0).abs() <= 6.0 * ROUNDING, "sine {sin}: {versine} for {exact}");
    }
}

fn polar(z: f64, turn: f32) -> Vec3 {
    let (r, angle) = ((1.0 - z * z).max(0.0).sqrt(), TAU * f64::from(turn));
    Vec3::new((r * angle.cos()) as f32, (r * angle.sin()) as f32, z as f32)
}

pub(crate) fn wrong_samplers_are_seen() {
    let lifted = |u: Vec2| sample_cosine_hemisphere(Vec2::new(u.x * 0.99, u.y));
    let even_angle = |u: Vec2| polar((PI * f64::from(u.x)).cos(), u.y);
    let narrow = |u: Vec2| polar((1.0 - u.x * 5.0e-8).into(), u.y);
    let no_root = |u: Vec2| polar(0.0, u.y).truncate() * u.x;
    let clustered = |u: Vec2| if u.x + u.y > 1.0 { u * 0.5 } else { u };
    let bounded = |t| bounded_exponential_pdf(t, RATE, T_MAX);
    let wrong = [
        directions("uniform as cosine", 1.0, |u| polar(u.x.into(), u.y), cosine_hemisphere_pdf),
        directions("a missing horizon", 1.0, lifted, cosine_hemisphere_pdf),
        directions("below the horizon", 1.0, |u| -sample_uniform_hemisphere(u), uniform_hemisphere_pdf),
        directions("the polar angle uniform", 2.0, even_angle, |_| uniform_sphere_pdf()),
        directions("a hemisphere as sphere", 2.0, sample_uniform_hemisphere, |_| uniform_sphere_pdf()),
        directions("a cone without its versine", 0.4, sample_uniform_hemisphere, |_| cone_pdf(0.4)),
        directions("a density without it", 0.4, |u| sample_cone(u, 0.4), |_| uniform_hemisphere_pdf(1.0)),
        directions("a narrow cone by its cosine", 5.0e-8, narrow, |_| cone_pdf(5.0e-8)),
        disk("a disk without the root", no_root),
        disk("a square as disk", |u| u * 2.0 - Vec2::ONE),
        triangle("a clustered triangle", clustered),
        distances("limited instead of bounded", T_MAX, |u| sample_exponential(u, RATE).min(T_MAX), bounded),
        window("a window too wide by 0.5 %", |u| sample_blackman_harris(u) * 1.005),
        distances("twice the rate", T_MAX, |u| sample_bounded_exponential(u, 2.0 * RATE, T_MAX), bounded),
    ];
    for sampler in wrong {
        let name = sampler.name.clone();
        assert!(!family(&name, vec![sampler]).passed(), "{name} passes");
    }
    // a density that is off by 2 % everywhere
    let disk = SamplerTest { domain: Disk { radius: 1.0 }, cells: [32, 64], draws: DRAWS };
    let integral = disk.integral(|_| FRAC_1_PI * 1.02);
    assert!((integral - 1.02).abs() < 1.0e-9, "2 % too much integrates to {integral}");
}
