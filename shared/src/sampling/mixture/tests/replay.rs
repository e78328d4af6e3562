//! Estimates of one integral after shifts among three pixels, whose techniques have the same weights and other scales. Expectations are
//! integrals, too: they are computed, not sampled.
//!
//! A sample r of the first pixel has the contribution weight 1 / p(r), p being the mixture's density. A shift by replay has the Jacobian
//! p(r) / p'(r'), a reconnection, which leaves r as it is, has 1.

use super::*;

const WEIGHTS: [f64; 2] = [0.25, 0.75];
const PIXELS: [Exponentials<2>; 3] = [
    Exponentials { weights: WEIGHTS, scales: [1.0, 3.0] },
    Exponentials { weights: WEIGHTS, scales: [0.9, 0.5] },
    Exponentials { weights: WEIGHTS, scales: [0.4, 2.0] },
];
/// The integral of [`g`], half of that of e^{-1.7 r} (3 - cos 6 r).
const TRUTH: f64 = 1.5 / 1.7 - 0.5 * 1.7 / (1.7 * 1.7 + 36.0);
/// Half of the last of seven digits, and what the quadrature may be off.
const LAST_DIGIT: f64 = 0.51e-7;

fn g(r: f64) -> f64 {
    (-1.7 * r).exp() * (1.0 + (3.0 * r).sin().powi(2))
}

/// A replay shortens distances to no less than a sixth, so that integrands fall at least as e^{-1.7 r / 6}: by 10^-14 up to the end.
fn over_distances(f: impl Fn(f64) -> f64) -> f64 {
    integral(12_000, [0.0, 120.0], f)
}

/// The mean over the technique of which a pixel that knows its own numbers has made r.
fn mean_by_origin(pixel: &Exponentials<2>, r: f64, value: impl Fn(u32) -> f64) -> f64 {
    let densities = pixel.densities(r);
    (0..2).map(|t| WEIGHTS[t] * densities[t] / pixel.density(r) * value(t as u32)).sum()
}

/// The mean over the technique that [`invert`] finds at a pixel, `choice` of whose numbers is passed on.
fn mean_by_inversion(pixel: &Exponentials<2>, r: f64, value: impl Fn(u32) -> f64) -> f64 {
    let inverted = |technique| invert(&WEIGHTS, &pixel.densities(r), Gamma { technique, place: 0.5 });
    // the weights are everywhere the same, so that any number of a technique chooses it at any pixel
    mean_by(|u| choose(&WEIGHTS, inverted(u).choice).technique, value)
}

/// Of a pixel's distance, made by a technique, the distance that another pixel makes of the same number.
fn replayed(from: &Exponentials<2>, to: &Exponentials<2>, technique: u32, r: f64) -> f64 {
    // S'(S^-1(r)) without its detour by a number near 1
    r * to.scales[technique as usize] / from.scales[technique as usize]
}

/// The second pixel replays numbers of the first; the Jacobian of technique, r and r'.
fn delayed(jacobian: impl Fn(u32, f64, f64) -> f64) -> f64 {
    let [first, second, _] = PIXELS;
    over_distances(|r| {
        mean_by_origin(&first, r, |t| {
            let there = replayed(&first, &second, t, r);
            g(there) * jacobian(t, r, there)
        })
    })
}

/// The second pixel takes the first one's r as it is; the third replays the numbers that the second is said to have. These come of
/// `mean`, over the technique, and of the pixel `of`, whose number is replayed.
fn reconnected(mean: impl Fn(f64, &dyn Fn(u32) -> f64) -> f64, of: usize) -> f64 {
    let [_, second, third] = PIXELS;
    over_distances(|r| {
        mean(r, &|t| {
            let there = replayed(&PIXELS[of], &third, t, r);
            g(there) * second.density(r) / third.density(there)
        })
    })
}

#[track_caller]
fn assert_digits(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() < tolerance, "{found} in place of {expected}");
}

#[test]
fn replay_has_the_jacobian_of_the_mixture() {
    assert_digits(TRUTH, 0.860_496_4, LAST_DIGIT);
    assert_digits(over_distances(g), TRUTH, 1e-8);
    let [first, second, _] = PIXELS;
    let of_mixture = delayed(|_, r, there| first.density(r) / second.density(there));
    assert_digits(of_mixture, TRUTH, 1e-8);
    // of the technique, with the contribution weight of the mixture
    let of_technique = delayed(|t, r, there| {
        let t = t as usize;
        first.densities(r)[t] / second.densities(there)[t]
    });
    assert_digits(of_technique, 1.049_793_8, LAST_DIGIT);
}

#[test]
fn reconnected_samples_can_be_replayed_once_their_numbers_are_drawn() {
    let [first, second, _] = PIXELS;
    assert_digits(reconnected(|r, value| mean_by_inversion(&second, r, value), 1), TRUTH, 1e-8);
    // the first pixel's technique, with the second one's number for it
    let kept_technique = reconnected(|r, value| mean_by_origin(&first, r, value), 1);
    assert_digits(kept_technique, 0.862_087_4, LAST_DIGIT);
    // the first pixel's technique and number
    let stale = reconnected(|r, value| mean_by_origin(&first, r, value), 0);
    assert_digits(stale, 1.249, 0.51e-3);
}

/// A reconnection to the second pixel, and replays at the third one and the first. The numbers of the second pixel are kept for both, or
/// each pixel draws its own, by densities of `owner` at the third.
#[test]
fn numbers_can_be_drawn_at_once_or_before_each_replay() {
    let [first, second, third] = PIXELS;
    let eager = over_distances(|r| {
        mean_by_inversion(&second, r, |t| {
            let there = replayed(&second, &first, t, r);
            g(there) * second.density(r) / first.density(there)
        })
    });
    assert_digits(eager, TRUTH, 1e-8);
    let lazy = |owner: &Exponentials<2>| {
        over_distances(|r| {
            mean_by_inversion(&second, r, |t| {
                let there = replayed(&second, &third, t, r);
                let weight = second.density(r) / third.density(there);
                mean_by_inversion(owner, there, |t| {
                    let back = replayed(&third, &first, t, there);
                    weight * g(back) * third.density(there) / first.density(back)
                })
            })
        })
    };
    assert_digits(lazy(&third), TRUTH, 1e-8);
    let stranger = lazy(&second);
    assert!((stranger / TRUTH - 1.0).abs() > 0.01, "numbers of another pixel pass with {stranger}");
}
