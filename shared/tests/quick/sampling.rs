//! What a distribution gives for two numbers has its density, and gives the numbers back.

use crate::squares;
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::sampling as s;

/// Directions about +z, their density, and the numbers that give them.
type Row = (&'static str, fn(Vec2) -> Vec3, fn(Vec3) -> f32, fn(Vec3) -> Vec2);

const ROWS: [Row; 4] = [
    ("sphere", s::sample_uniform_sphere, |_| s::uniform_sphere_pdf(), s::invert_uniform_sphere),
    ("hemisphere", s::sample_uniform_hemisphere, |w| s::uniform_hemisphere_pdf(w.z), s::invert_uniform_hemisphere),
    ("cosine", s::sample_cosine_hemisphere, |w| s::cosine_hemisphere_pdf(w.z), s::invert_cosine_hemisphere),
    (
        "phase function",
        |u| s::sample_henyey_greenstein(u, 0.6),
        |w| s::henyey_greenstein_pdf(w, 0.6),
        |w| s::invert_henyey_greenstein(w, 0.6),
    ),
];

#[test]
fn numbers_come_back() {
    for (name, sample, _, invert) in ROWS {
        for u in squares() {
            let back = invert(sample(u));
            assert!((back - u).abs().max_element() < 2.0e-5, "{name}: {u} comes back as {back}");
        }
    }
}

/// The mean of f / p over samples is the integral of f: of (1 + z)^2 over the sphere 16 pi / 3, over the upper half 14 pi / 3.
#[test]
fn samples_have_their_density() {
    for (name, sample, density, _) in ROWS {
        let value = |u| {
            let w = sample(u);
            f64::from((1.0 + w.z) * (1.0 + w.z) / density(w))
        };
        let mean = squares().map(value).sum::<f64>() / 4096.0 / std::f64::consts::PI * 3.0;
        let expected = if name.contains("hemi") || name == "cosine" { 14.0 } else { 16.0 };
        assert!((mean / expected - 1.0).abs() < 0.02, "{name}: {mean} in place of {expected}");
    }
}
