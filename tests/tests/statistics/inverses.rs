//! Inverses of the samplers.

use crate::support::{DRAWS, ROUNDING, numbers};
use glam::{Vec2, Vec3};
use libtest_mimic::Failed;
use restir_shared::sampling::{
    invert_bounded_exponential, invert_concentric_disk, invert_cone, invert_cosine_hemisphere, invert_exponential,
    invert_triangle, invert_uniform_hemisphere, invert_uniform_sphere, sample_bounded_exponential,
    sample_concentric_disk, sample_cone, sample_cosine_hemisphere, sample_exponential, sample_triangle,
    sample_uniform_hemisphere, sample_uniform_sphere,
};
use restir_tests::suite::ensure;

/// Draws of each sampler.
const TRIPS: u64 = DRAWS / 4;

/// The distance between two numbers of a circle of circumference 1.
fn around(a: f32, b: f32) -> f64 {
    let d = (f64::from(a) - f64::from(b)).abs();
    d.min(1.0 - d)
}

/// |a - b|, relative to `a` where that is above a random number's step.
fn relative(a: f32, b: f32) -> f64 {
    (f64::from(a) - f64::from(b)).abs() / f64::from(a).max(ROUNDING)
}

/// The largest errors of `back(u)` against `u`: of the first number relative to itself, of the second as an angle; in
/// roundings.
fn polar_error(back: impl Fn(Vec2) -> Vec2) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for i in 0..TRIPS {
        let u = numbers(i, 5);
        let v = back(u);
        worst[0] = worst[0].max(relative(u.x, v.x));
        if u.x > 0.0 {
            worst[1] = worst[1].max(around(u.y, v.y));
        }
    }
    worst.map(|error| error / ROUNDING)
}

pub(crate) fn directions_invert() -> Result<(), Failed> {
    let check = |name: &str, [radius, angle]: [f64; 2]| {
        println!("{name}: {radius:.1} and {angle:.1} roundings");
        // radius: the root and the two factors are squared, 2 (1/2 + 3.3 + 1/2) ulp of two roundings at most, a sum and,
        // for heights, a quotient of two roundings
        ensure(radius <= 22.0, || format!("{name}: off by {radius} roundings"))?;
        // 3.3 roundings in sine and cosine turn the angle by 3.3 / 2 pi, and atan2 has 2 ulp of up to 1/2
        ensure(angle <= 4.0, || format!("{name}: angle off by {angle} roundings"))
    };
    check("cosine hemisphere", polar_error(|u| invert_cosine_hemisphere(sample_cosine_hemisphere(u))))?;
    check("uniform hemisphere", polar_error(|u| invert_uniform_hemisphere(sample_uniform_hemisphere(u))))?;
    check("uniform sphere", polar_error(|u| invert_uniform_sphere(sample_uniform_sphere(u))))?;
    for versine in [1.0e-12, 1.0e-4, 0.3, 2.0] {
        let name = format!("cone of versine {versine}");
        check(&name, polar_error(|u| invert_cone(sample_cone(u, versine), versine)))?;
    }
    // the inverse by the cosine has nothing left near the pole
    let cosine = |w: Vec3| Vec2::new(1.0 - w.z, 0.0);
    let [radius, _] = polar_error(|u| cosine(sample_cosine_hemisphere(u)));
    ensure(radius > 1000.0, || "the inverse by the cosine passes".to_owned())
}

pub(crate) fn points_invert() -> Result<(), Failed> {
    let check = |name: &str, limit: f64, back: fn(Vec2) -> Vec2| {
        let error = |i: u64| {
            let u = numbers(i, 7);
            let d = (u.as_dvec2() - back(u).as_dvec2()).abs();
            d.max_element() / ROUNDING
        };
        let worst = (0..TRIPS).map(error).fold(0.0, f64::max);
        println!("{name}: {worst:.2} roundings");
        ensure(worst <= limit, || format!("{name}: off by {worst} roundings, more than {limit}"))
    };
    // one difference and one sum are rounded
    check("triangle", 2.0, |u| invert_triangle(sample_triangle(u)))?;
    // radius: 3.3 in sine or cosine, its product, square, sum, root; angle: 4 ulp of two roundings besides; halved, and a sum
    check("disk", 8.0, |u| invert_concentric_disk(sample_concentric_disk(u)))
}

pub(crate) fn distances_invert() -> Result<(), Failed> {
    let check = |name: &str, back: &dyn Fn(f32) -> f32| {
        // numbers of a grid, and those that an inverse may make, down to 2^-40
        let small = |i: u64, u: f32| {
            if i.is_multiple_of(2) { u } else { u * f32::from_bits(0x3f80_0000 - (((i as u32 >> 1) % 40) << 23)) }
        };
        let error = |i: u64| {
            let u = small(i, numbers(i, 9).x);
            (f64::from(u) - f64::from(back(u))).abs() / f64::from(u).max(f64::from(f32::MIN_POSITIVE)) / ROUNDING
        };
        let worst = (0..TRIPS).map(error).fold(0.0, f64::max);
        println!("{name}: {worst:.1} roundings");
        // ln has 1.7 roundings, exp 2, a quotient 1; log1p and expm1 twice as many each and a quotient more
        ensure(worst <= 16.0, || format!("{name}: off by {worst} roundings"))
    };
    for rate in [1.0e-6, 1.0, 3.0e5] {
        check("exponential", &|u| invert_exponential(sample_exponential(u, rate), rate))?;
    }
    for depth in [0.0, 1.0e-6, 4.8e-4, 4.9e-4, 1.0e-2, 1.0, 30.0, 1.0e6] {
        let (rate, t_max) = (depth * 0.25, 4.0);
        let back = |u| invert_bounded_exponential(sample_bounded_exponential(u, rate, t_max), rate, t_max);
        check(&format!("bounded exponential, depth {depth}"), &back)?;
    }
    Ok(())
}

/// Values at the ends, and beyond by a rounding: no inverse leaves [0, 1), so its numbers can be sampled again.
pub(crate) fn inverses_stay_below_one() -> Result<(), Failed> {
    let check = |name: &str, u: Vec2| {
        let unit = |x: f32| (0.0..1.0).contains(&x);
        ensure(unit(u.x) && unit(u.y), || format!("{name}: {u}"))
    };
    let above = 1.0 + 2.0 * ROUNDING as f32;
    let below = -f32::MIN_POSITIVE;
    for w in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::Y, Vec3::new(above, below, 0.0), Vec3::new(below, above, below)] {
        check("cosine hemisphere", invert_cosine_hemisphere(w))?;
        check("uniform hemisphere", invert_uniform_hemisphere(w))?;
        check("uniform sphere", invert_uniform_sphere(w))?;
        check("cone", invert_cone(w, 0.5))?;
        check("disk", invert_concentric_disk(Vec2::new(w.x, w.y)))?;
        check("triangle", invert_triangle(Vec2::new(w.x, w.y)))?;
    }
    for t in [0.0, 1.0, above, 1.0e30] {
        check("exponential", Vec2::splat(invert_exponential(t, 100.0)))?;
        check("bounded exponential", Vec2::splat(invert_bounded_exponential(t, 100.0, 1.0)))?;
    }
    Ok(())
}
