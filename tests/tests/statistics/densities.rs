//! Samplers of continuous values against their densities.

use crate::support::{DRAWS, ROUNDING, family, numbers, report, wide2, wide3};
use glam::{Vec2, Vec3};
use libtest_mimic::Failed;
use restir_shared::sampling::{
    bounded_exponential_pdf, concentric_disk_pdf, cone_pdf, cosine_hemisphere_pdf, exponential_pdf,
    sample_bounded_exponential, sample_concentric_disk, sample_cone, sample_cosine_hemisphere, sample_exponential,
    sample_triangle, sample_uniform_hemisphere, sample_uniform_sphere, triangle_pdf, uniform_hemisphere_pdf,
    uniform_sphere_pdf, versine_of_sin2,
};
use restir_tests::stats::{Cap, Disk, Family, Line, Moments, SamplerTest, Triangle, ZTest};
use restir_tests::suite::ensure;
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Half angles from a third of a milliradian to almost the sphere.
const VERSINES: [f32; 4] = [5.0e-8, 1.0e-3, 0.4, 1.9];
/// Optical depths over the limit of the bounded density.
const DEPTHS: [f32; 4] = [0.0, 4.0e-4, 0.7, 30.0];
const T_MAX: f32 = 2.5;
const RATE: f32 = 3.0;
const AREA: f32 = 0.7;
/// Beyond this the unbounded density has no sample: there -ln(1 - u) would need u > 1 - 2^-24.
const LONGEST: f64 = 16.7 / RATE as f64;
/// The smallest direction that a test may confuse with a longer one; all lengths are 1 to some roundings.
const LENGTH: f64 = 16.0 * ROUNDING;

fn directions(versine: f64) -> SamplerTest<Cap> {
    SamplerTest { domain: Cap { versine }, cells: [32, 64], draws: DRAWS }
}

fn line(hi: f64) -> SamplerTest<Line> {
    SamplerTest { domain: Line { lo: 0.0, hi }, cells: [1024, 1], draws: DRAWS }
}

const DISK: SamplerTest<Disk> = SamplerTest { domain: Disk { radius: 1.0 }, cells: [32, 64], draws: DRAWS };
const TRIANGLE: SamplerTest<Triangle> =
    SamplerTest { domain: Triangle { area: AREA as f64 }, cells: [32, 32], draws: DRAWS };

/// Adds the test of a sampler of directions, of which the density depends on z.
fn add_directions(
    family: &mut Family,
    name: &str,
    versine: f64,
    sample: impl Fn(Vec2) -> Vec3 + Sync,
    pdf: impl Fn(f32) -> f32 + Sync,
) {
    let sample = |i: u64| Some(wide3(sample(numbers(i, 1))));
    family.chi_square(name, directions(versine).table(sample, |w| f64::from(pdf(w[2] as f32))));
}

pub(crate) fn directions_have_their_density() -> Result<(), Failed> {
    let samplers: [fn(Vec2) -> Vec3; 4] =
        [sample_cosine_hemisphere, sample_uniform_hemisphere, sample_uniform_sphere, |u| sample_cone(u, 1.0e-4)];
    for sample in samplers {
        for i in 0..DRAWS / 8 {
            let w = sample(numbers(i, 1));
            let length: f64 = wide3(w).iter().map(|x| x * x).sum();
            // sine and cosine have 2 ulp, roots and products a rounding each
            ensure((length - 1.0).abs() < LENGTH, || format!("{w} has length {}", length.sqrt()))?;
        }
    }
    let mut family = family("directions");
    add_directions(&mut family, "cosine hemisphere", 1.0, sample_cosine_hemisphere, cosine_hemisphere_pdf);
    add_directions(&mut family, "uniform hemisphere", 1.0, sample_uniform_hemisphere, uniform_hemisphere_pdf);
    add_directions(&mut family, "uniform sphere", 2.0, sample_uniform_sphere, |_| uniform_sphere_pdf());
    for versine in VERSINES {
        let name = format!("cone of versine {versine}");
        add_directions(&mut family, &name, versine.into(), |u| sample_cone(u, versine), |_| cone_pdf(versine));
    }
    report(&family)
}

fn add_points(
    family: &mut Family,
    name: &str,
    disk: impl Fn(Vec2) -> Vec2 + Sync,
    triangle: impl Fn(Vec2) -> Vec2 + Sync,
) {
    let on_disk = DISK.table(|i| Some(wide2(disk(numbers(i, 3)))), |_| concentric_disk_pdf().into());
    family.chi_square(format!("{name}: disk"), on_disk);
    let on_triangle = TRIANGLE.table(|i| Some(wide2(triangle(numbers(i, 4)))), |_| triangle_pdf(AREA).into());
    family.chi_square(format!("{name}: triangle"), on_triangle);
}

pub(crate) fn points_have_their_density() -> Result<(), Failed> {
    for i in 0..DRAWS / 8 {
        let b = wide2(sample_triangle(numbers(i, 4)));
        let inside = b[0] >= 0.0 && b[1] >= 0.0 && b[0] + b[1] <= 1.0;
        ensure(inside, || format!("{b:?} is outside of the triangle"))?;
    }
    let mut family = family("points");
    add_points(&mut family, "points", sample_concentric_disk, sample_triangle);
    report(&family)
}

pub(crate) fn distances_have_their_density() -> Result<(), Failed> {
    let mut family = family("distances");
    let sample = |i: u64| Some(sample_exponential(numbers(i, 5).x, RATE).into());
    family.chi_square("exponential", line(LONGEST).table(sample, |t| exponential_pdf(*t as f32, RATE).into()));
    let values = (0..DRAWS / 8).filter_map(sample).collect();
    family.kolmogorov("exponential", values, |t: f64| -(-f64::from(RATE) * t).exp_m1());
    for depth in DEPTHS {
        let rate = depth / T_MAX;
        let sample = |i: u64| Some(sample_bounded_exponential(numbers(i, 6).x, rate, T_MAX).into());
        let pdf = |t: &f64| bounded_exponential_pdf(*t as f32, rate, T_MAX).into();
        family.chi_square(format!("bounded, depth {depth}"), line(T_MAX.into()).table(sample, pdf));
    }
    report(&family)
}

/// The projection of the cosine hemisphere is uniform on the disk (Malley), so x and y have the semicircle's density; the
/// mean of z is 2/3.
pub(crate) fn moments_of_the_cosine_hemisphere() -> Result<(), Failed> {
    let mut family = family("cosine hemisphere");
    let below = |x: f64| 0.5 + (x * (1.0 - x * x).max(0.0).sqrt() + x.asin()) / PI;
    let samples: Vec<_> = (0..DRAWS / 8).map(|i| wide3(sample_cosine_hemisphere(numbers(i, 2)))).collect();
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        family.kolmogorov(name, samples.iter().map(|w| w[axis]).collect(), below);
    }
    let mean: Moments = samples.iter().map(|w| w[2]).collect();
    let test = ZTest::new(mean, Moments::exact(2.0 / 3.0));
    println!("mean of z: {:+.2e}, detectable {:.1e}", test.difference, test.detectable_bias(family.share()));
    family.z_test("mean of z", test);
    report(&family)
}

pub(crate) fn densities_integrate_to_one() -> Result<(), Failed> {
    // a density is rounded some four times; the quadrature is exact for the constants among them
    let check =
        |name: &str, integral: f64| ensure((integral - 1.0).abs() <= 8.0 * ROUNDING, || format!("{name}: {integral}"));
    let cap =
        |versine: f64, pdf: &(dyn Fn(f32) -> f32 + Sync)| directions(versine).integral(|w| pdf(w[2] as f32).into());
    check("cosine hemisphere", cap(1.0, &cosine_hemisphere_pdf))?;
    check("cosine hemisphere over the sphere", cap(2.0, &cosine_hemisphere_pdf))?;
    check("uniform hemisphere", cap(1.0, &uniform_hemisphere_pdf))?;
    check("uniform hemisphere over the sphere", cap(2.0, &uniform_hemisphere_pdf))?;
    check("uniform sphere", cap(2.0, &|_| uniform_sphere_pdf()))?;
    for versine in VERSINES {
        check("cone", cap(versine.into(), &|_| cone_pdf(versine)))?;
    }
    check("disk", DISK.integral(|_| concentric_disk_pdf().into()))?;
    check("triangle", TRIANGLE.integral(|_| triangle_pdf(AREA).into()))?;
    // what lies beyond is e^-16.7
    check("exponential", line(LONGEST).integral(|t| exponential_pdf(*t as f32, RATE).into()))?;
    for depth in DEPTHS {
        let pdf = |t: &f64| f64::from(bounded_exponential_pdf(*t as f32, depth / T_MAX, T_MAX));
        check("bounded exponential", line(T_MAX.into()).integral(pdf))?;
    }
    // a cone by the ratio of a sphere's radius to its distance
    for sin in [1.0e-6_f64, 1.0e-3, 0.5, 1.0] {
        let exact = 1.0 - (1.0 - sin * sin).sqrt();
        let exact = if sin < 1.0e-2 { 0.5 * sin * sin * (1.0 + 0.25 * sin * sin) } else { exact };
        let versine = f64::from(versine_of_sin2((sin * sin) as f32));
        ensure((versine / exact - 1.0).abs() <= 6.0 * ROUNDING, || format!("sine {sin}: {versine} for {exact}"))?;
    }
    Ok(())
}

fn polar(z: f64, turn: f32) -> Vec3 {
    let (r, angle) = ((1.0 - z * z).max(0.0).sqrt(), TAU * f64::from(turn));
    Vec3::new((r * angle.cos()) as f32, (r * angle.sin()) as f32, z as f32)
}

pub(crate) fn wrong_samplers_are_seen() -> Result<(), Failed> {
    let mut families = Vec::new();
    let mut wrong =
        |name: &str, versine: f64, sample: &(dyn Fn(Vec2) -> Vec3 + Sync), pdf: &(dyn Fn(f32) -> f32 + Sync)| {
            let mut family = family(name);
            add_directions(&mut family, name, versine, sample, pdf);
            families.push(family);
        };
    wrong("uniform as cosine", 1.0, &|u| polar(u.x.into(), u.y), &cosine_hemisphere_pdf);
    let lifted = |u: Vec2| sample_cosine_hemisphere(Vec2::new(u.x * 0.99, u.y));
    wrong("a missing horizon", 1.0, &lifted, &cosine_hemisphere_pdf);
    wrong("a hemisphere below the horizon", 1.0, &|u| -sample_uniform_hemisphere(u), &uniform_hemisphere_pdf);
    wrong("the polar angle uniform", 2.0, &|u| polar((PI * f64::from(u.x)).cos(), u.y), &|_| uniform_sphere_pdf());
    wrong("a hemisphere as sphere", 2.0, &sample_uniform_hemisphere, &|_| uniform_sphere_pdf());
    wrong("a cone without its versine", 0.4, &sample_uniform_hemisphere, &|_| cone_pdf(0.4));
    wrong("a density without the versine", 0.4, &|u| sample_cone(u, 0.4), &|_| uniform_hemisphere_pdf(1.0));
    let narrow = |u: Vec2| polar((1.0 - u.x * 5.0e-8).into(), u.y);
    wrong("a narrow cone by its cosine", 5.0e-8, &narrow, &|_| cone_pdf(5.0e-8));
    let mut points = |name: &str, disk: &(dyn Fn(Vec2) -> Vec2 + Sync), triangle: &(dyn Fn(Vec2) -> Vec2 + Sync)| {
        let mut family = family(name);
        add_points(&mut family, name, disk, triangle);
        families.push(family);
    };
    let no_root = |u: Vec2| {
        let w = polar(0.0, u.y);
        Vec2::new(w.x * u.x, w.y * u.x)
    };
    points("a disk without the root", &no_root, &sample_triangle);
    points("a square as disk", &|u| u * 2.0 - Vec2::ONE, &sample_triangle);
    let clustered = |u: Vec2| if u.x + u.y > 1.0 { u * 0.5 } else { u };
    points("a clustered triangle", &sample_concentric_disk, &clustered);
    let mut distances = |name: &str, sample: &(dyn Fn(f32) -> f32 + Sync)| {
        let mut family = family(name);
        let pdf = |t: &f64| bounded_exponential_pdf(*t as f32, RATE, T_MAX).into();
        family.chi_square(name, line(T_MAX.into()).table(|i| Some(sample(numbers(i, 7).x).into()), pdf));
        families.push(family);
    };
    distances("limited instead of bounded", &|u| sample_exponential(u, RATE).min(T_MAX));
    distances("twice the rate", &|u| sample_bounded_exponential(u, 2.0 * RATE, T_MAX));
    for family in &families {
        if family.passed() {
            return Err(format!("passes: {}", family.verdict().unwrap_or_default()).into());
        }
    }
    // a density that is off by 2 % everywhere
    let integral = DISK.integral(|_| FRAC_1_PI * 1.02);
    ensure((integral - 1.02).abs() < 1.0e-9, || format!("2 % too much integrates to {integral}"))
}
