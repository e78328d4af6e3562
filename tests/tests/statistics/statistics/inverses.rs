//! Inverses of the samplers.

use super::support::{DRAWS, ROUNDING, numbers};
use glam::{Vec2, Vec3};
use restir_shared::sampling::{
    invert_blackman_harris, invert_bounded_exponential, invert_concentric_disk, invert_cone, invert_cosine_hemisphere,
    invert_exponential, invert_triangle, invert_uniform_hemisphere, invert_uniform_sphere, sample_blackman_harris,
    sample_bounded_exponential, sample_concentric_disk, sample_cone, sample_cosine_hemisphere, sample_exponential,
    sample_triangle, sample_uniform_hemisphere, sample_uniform_sphere,
};

/// Draws of each sampler.
const TRIPS: u64 = DRAWS / 4;

/// The largest error of the trips, in roundings.
fn worst(error: impl Fn(u64) -> f64) -> f64 {
    (0..TRIPS).map(error).fold(0.0, f64::max) / ROUNDING
}

fn assert_returns(name: &str, limit: f64, error: impl Fn(u64) -> f64) {
    let worst = worst(error);
    println!("{name}: {worst:.2} roundings");
    assert!(worst <= limit, "{name}: off by {worst} roundings, more than {limit}");
}

/// The error of the first number of `back(u)`, relative to `u` where that is above a random number's step.
fn radius_error(i: u64, back: impl Fn(Vec2) -> Vec2) -> f64 {
    let u = numbers(i, 5);
    (f64::from(u.x) - f64::from(back(u).x)).abs() / f64::from(u.x).max(ROUNDING)
}

/// The distance between the second numbers on a circle of circumference 1.
fn angle_error(i: u64, back: impl Fn(Vec2) -> Vec2) -> f64 {
    let u = numbers(i, 5);
    let distance = (f64::from(u.y) - f64::from(back(u).y)).abs();
    if u.x > 0.0 { distance.min(1.0 - distance) } else { 0.0 }
}

pub(crate) fn directions_invert() {
    let check = |name: &str, back: &dyn Fn(Vec2) -> Vec2| {
        // radius: the root and the two factors are squared, 2 (1/2 + 3.3 + 1/2) ulp of two roundings at most, a sum and,
        // for heights, a quotient of two roundings
        assert_returns(name, 22.0, |i| radius_error(i, back));
        // 3.3 roundings in sine and cosine turn the angle by 3.3 / 2 pi, and atan2 has 2 ulp of up to 1/2
        assert_returns(&format!("{name}, angle"), 4.0, |i| angle_error(i, back));
    };
    check("cosine hemisphere", &|u| invert_cosine_hemisphere(sample_cosine_hemisphere(u)));
    check("uniform hemisphere", &|u| invert_uniform_hemisphere(sample_uniform_hemisphere(u)));
    check("uniform sphere", &|u| invert_uniform_sphere(sample_uniform_sphere(u)));
    for versine in [1.0e-12, 1.0e-4, 0.3, 2.0] {
        check(&format!("cone of versine {versine}"), &|u| invert_cone(sample_cone(u, versine), versine));
    }
    // the inverse by the cosine has nothing left near the pole
    let by_cosine = worst(|i| radius_error(i, |u| Vec2::splat(1.0 - sample_cosine_hemisphere(u).z)));
    assert!(by_cosine > 1000.0, "the inverse by the cosine passes");
}

pub(crate) fn points_invert() {
    let error = |i: u64, back: fn(Vec2) -> Vec2| {
        let u = numbers(i, 7);
        (u.as_dvec2() - back(u).as_dvec2()).abs().max_element()
    };
    // one difference and one sum are rounded
    assert_returns("triangle", 2.0, |i| error(i, |u| invert_triangle(sample_triangle(u))));
    // radius: 3.3 in sine or cosine, its product, square, sum, root; angle: 4 ulp of two roundings besides; halved, and a sum
    assert_returns("disk", 8.0, |i| error(i, |u| invert_concentric_disk(sample_concentric_disk(u))));
}

pub(crate) fn distances_invert() {
    let check = |name: &str, back: &dyn Fn(f32) -> f32| {
        let error = |i: u64| {
            // numbers of a grid, and those that an inverse may make, down to 2^-40
            let scale = if i.is_multiple_of(2) { 0 } else { (i as u32 >> 1) % 40 };
            let u = numbers(i, 9).x * f32::from_bits(0x3f80_0000 - (scale << 23));
            (f64::from(u) - f64::from(back(u))).abs() / f64::from(u.max(f32::MIN_POSITIVE))
        };
        // ln has 1.7 roundings, exp 2, a quotient 1; log1p and expm1 twice as many each and a quotient more
        assert_returns(name, 16.0, error);
    };
    for rate in [1.0e-6, 1.0, 3.0e5] {
        check("exponential", &|u| invert_exponential(sample_exponential(u, rate), rate));
    }
    for depth in [0.0, 1.0e-6, 4.8e-4, 4.9e-4, 1.0e-2, 1.0, 30.0, 1.0e6] {
        let (rate, t_max) = (depth * 0.25, 4.0);
        let back = |u| invert_bounded_exponential(sample_bounded_exponential(u, rate, t_max), rate, t_max);
        check(&format!("bounded exponential, depth {depth}"), &back);
    }
}

pub(crate) fn the_window_inverts() {
    // sampling leaves 1.4 steps of random numbers, the distribution function is rounded as often again, and half a step is its middle
    assert_returns("Blackman-Harris window", 4.0, |i| {
        let u = numbers(i, 6).x;
        (f64::from(u) - f64::from(invert_blackman_harris(sample_blackman_harris(u)))).abs()
    });
}

/// Values at the ends, and beyond by a rounding: no inverse leaves [0, 1), so its numbers can be sampled again.
pub(crate) fn inverses_stay_below_one() {
    let check = |name: &str, u: Vec2| {
        let unit = |x: f32| (0.0..1.0).contains(&x);
        assert!(unit(u.x) && unit(u.y), "{name}: {u}");
    };
    let above = 1.0 + 2.0 * ROUNDING as f32;
    let below = -f32::MIN_POSITIVE;
    for w in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::Y, Vec3::new(above, below, 0.0), Vec3::new(below, above, below)] {
        check("cosine hemisphere", invert_cosine_hemisphere(w));
        check("uniform hemisphere", invert_uniform_hemisphere(w));
        check("uniform sphere", invert_uniform_sphere(w));
        check("cone", invert_cone(w, 0.5));
        check("disk", invert_concentric_disk(Vec2::new(w.x, w.y)));
        check("triangle", invert_triangle(Vec2::new(w.x, w.y)));
    }
    for t in [0.0, 1.0, above, 1.0e30] {
        check("exponential", Vec2::splat(invert_exponential(t, 100.0)));
        check("bounded exponential", Vec2::splat(invert_bounded_exponential(t, 100.0, 1.0)));
        check("Blackman-Harris window", Vec2::new(invert_blackman_harris(t), invert_blackman_harris(-t)));
    }
}
