//! The sequential shift for a surface of two lobes: a reconnection, numbers drawn by inversion, a replay (Werner et al. 2024, supplemental,
//! section 3). Expectations are integrals.
//!
//! In the plane, pixels see points of the line y = 0, with normals up. A ray from such a point, at the angle whose tangent is `slope`, meets
//! the line y = 1 where `light` shines. One lobe is diffuse, with the cosine's density, the other a narrow one about its own direction. Each
//! pixel has other probabilities of the lobes, so that a number may choose another lobe where it is replayed.

use super::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// A point seen by a pixel.
struct Pixel {
    position: f64,
    /// Of the diffuse and of the narrow lobe.
    probabilities: [f64; 2],
    /// Slope about which the narrow lobe lies.
    centre: f64,
    width: f64,
}

const PIXELS: [Pixel; 3] = [
    Pixel { position: 0.0, probabilities: [0.8, 0.2], centre: 0.3, width: 0.5 },
    Pixel { position: 0.2, probabilities: [0.3, 0.7], centre: 0.1, width: 0.35 },
    Pixel { position: 0.5, probabilities: [0.55, 0.45], centre: -0.8, width: 0.25 },
];

impl Pixel {
    /// The slope that a lobe makes of a number.
    fn sample(&self, lobe: u32, u: f64) -> f64 {
        if lobe == 0 {
            let sin = 2.0 * u - 1.0;
            sin / (1.0 - sin * sin).sqrt()
        } else {
            self.centre + self.width * (PI * (u - 0.5)).tan()
        }
    }

    fn invert(&self, lobe: u32, slope: f64) -> f64 {
        if lobe == 0 {
            0.5 + 0.5 * slope / (1.0 + slope * slope).sqrt()
        } else {
            0.5 + ((slope - self.centre) / self.width).atan() / PI
        }
    }

    /// Of the lobes, per angle.
    fn densities(&self, slope: f64) -> [f64; 2] {
        let cos2 = cos2(slope);
        let off = (slope - self.centre) / self.width;
        [0.5 * cos2.sqrt(), 1.0 / (PI * self.width * (1.0 + off * off) * cos2)]
    }

    fn density(&self, slope: f64) -> f64 {
        density(&self.probabilities, &self.densities(slope))
    }

    /// What the surface reflects of the light towards the viewer, times the cosine.
    fn reflected(&self, slope: f64) -> f64 {
        let [diffuse, narrow] = self.densities(slope);
        (0.6 * diffuse + 0.9 * narrow) * light(self.position + slope)
    }
}

/// The squared cosine of an angle, by its slope; the derivative of the angle, too.
fn cos2(slope: f64) -> f64 {
    1.0 / (1.0 + slope * slope)
}

fn light(position: f64) -> f64 {
    (-position * position).exp() * (1.0 + 0.5 * (3.0 * position).sin())
}

/// Over all angles, given by slopes. The light lets integrands vanish before the ends.
fn over_angles(f: impl Fn(f64) -> f64) -> f64 {
    integral(4000, [-FRAC_PI_2, FRAC_PI_2], |angle| f(angle.tan()))
}

/// The mean at the last pixel. The middle pixel reconnects to what the first one sees, and its numbers come of gamma: the lobe by the
/// `likely` probabilities, the number that chooses it by those `chosen`. Both are the pixel's own, where they are right.
fn mean_after_shifts(likely: &[f64; 2], chosen: &[f64; 2]) -> f64 {
    let [first, middle, last] = &PIXELS;
    over_angles(|seen| {
        // the density of the first pixel cancels with the contribution weight
        let slope = first.position + seen - middle.position;
        let reconnection = cos2(slope) / cos2(seen);
        let numbers = |technique| invert(likely, &middle.densities(slope), Gamma { technique, place: 0.0 });
        let of_lobe = |lobe: u32| {
            let u = middle.invert(lobe, slope);
            let cell = find(chosen, 1.0, |technique, _| technique == lobe);
            mean_by(
                |place| choose(&last.probabilities, cell.number(place)).technique,
                |replayed| {
                    let there = last.sample(replayed, u);
                    last.reflected(there) / last.density(there)
                },
            )
        };
        reconnection * middle.density(slope) * mean_by(|u| numbers(u).technique, of_lobe)
    })
}

#[test]
fn the_sequential_shift_keeps_the_mean_with_the_offset_vertex_probabilities() {
    let [first, middle, last] = &PIXELS;
    let truth = over_angles(|slope| last.reflected(slope));
    let [base, offset] = [&first.probabilities, &middle.probabilities];
    let right = mean_after_shifts(offset, offset);
    assert!((right / truth - 1.0).abs() < 1e-7, "{right} in place of {truth}");
    // the base vertex's in both places; in the likelihood alone, and in the number that chooses the lobe, which is how equation 19 prints it
    for [likely, chosen] in [[base, base], [base, offset], [offset, base]] {
        let wrong = mean_after_shifts(likely, chosen);
        assert!(
            (wrong / truth - 1.0).abs() > 1e-3,
            "the base vertex's probabilities pass with {wrong} in place of {truth}"
        );
    }
}
