//! The same in double precision, as published.

/// `Rd(r; d)`.
pub(crate) fn profile(r: f64, d: f64) -> f64 {
    ((-r / d).exp() + (-r / (3.0 * d)).exp()) / (8.0 * std::f64::consts::PI * d * r)
}

/// The part that comes out beyond x.
pub(crate) fn ccdf(x: f64) -> f64 {
    0.25 * (-x).exp() + 0.75 * (-x / 3.0).exp()
}

/// The part that comes out nearer than x, by the series where the difference would cancel.
pub(crate) fn cdf(x: f64) -> f64 {
    let v = -(-x / 3.0).exp_m1();
    v * (6.0 - 3.0 * v + v * v) / 4.0
}

/// The x of which a number `xi` is the distribution function: the root of a cubic, by Newton's steps.
pub(crate) fn quantile(xi: f64) -> f64 {
    let mut v = xi / 1.5;
    for _ in 0..100 {
        v -= (v * (6.0 + v * (v - 3.0)) - 4.0 * xi) / (6.0 + v * (3.0 * v - 6.0));
    }
    -3.0 * (-v).ln_1p()
}

/// The x beyond which there is `u`.
pub(crate) fn beyond(u: f64) -> f64 {
    -3.0 * (2.0 * ((2.0 * u).asinh() / 3.0).sinh()).ln()
}

/// `A` by the root `q` of what a collision absorbs.
pub(crate) fn albedo(q: f64) -> f64 {
    (1.0 - q) / (1.0 + 1.554 * q)
}

/// The slope of `A` in the albedo of a collision where that is zero.
pub(crate) const SLOPE: f64 = 0.5 / 2.554;

pub(crate) fn searchlight(albedo: f64) -> f64 {
    1.85 - albedo + 7.0 * (albedo - 0.8).abs().powi(3)
}

pub(crate) fn diffuse(albedo: f64) -> f64 {
    1.9 - albedo + 3.5 * (albedo - 0.8).powi(2)
}

/// `R1` of a mean free path of 1, by the shape factor of black.
pub(crate) fn single(r: f64, alpha: f64, of_black: f64) -> f64 {
    alpha * SLOPE * profile(r, 1.0 / of_black)
}

/// `R` of a mean free path of 1.
pub(crate) fn all(r: f64, alpha: f64, shape: fn(f64) -> f64) -> f64 {
    let albedo = albedo((1.0 - alpha).sqrt());
    albedo * profile(r, 1.0 / shape(albedo))
}

/// The integral of a function of the distance over a ring, with an integrand that is smooth at the centre.
pub(crate) fn ring(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 20_000;
    let step = 1.0 / f64::from(STEPS);
    // by cubes, so that what is near the centre has its share
    let middle = |i: u32| (f64::from(i) + 0.5) * step;
    let place = |u: f64| from + (to - from) * u * u * u;
    (0..STEPS)
        .map(middle)
        .map(|u| {
            let r = place(u);
            std::f64::consts::TAU * r * f(r) * (to - from) * 3.0 * u * u * step
        })
        .sum()
}
