//! Sampling and its inverse have Jacobians whose product is 1 (Werner et al. 2024, supplemental, eqs. 7, 12, 15 and 16).

use super::*;

/// Of the finite differences.
const STEP: f64 = 1e-5;

/// The determinant of the derivatives at a point, by central differences.
fn jacobian(map: impl Fn([f64; 3]) -> [f64; 3], at: [f64; 3]) -> f64 {
    let column = |axis: usize| {
        let moved = |by: f64| {
            let mut moved = at;
            moved[axis] += by;
            map(moved)
        };
        let (above, below) = (moved(STEP), moved(-STEP));
        [0, 1, 2].map(|row| (above[row] - below[row]) / (2.0 * STEP))
    };
    let [a, b, c] = [column(0), column(1), column(2)];
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// (u1, u2, u3) to (x, gamma1, gamma2), the densities being what `seen` makes of the true ones.
fn sampling<const N: usize>(
    mixture: &Exponentials<N>,
    seen: impl Fn([f64; N]) -> [f64; N],
    [free, choice, u]: [f64; 3],
) -> [f64; 3] {
    let x = mixture.sample(choose(&mixture.weights, choice).technique, u);
    let gamma = gamma(&mixture.weights, &seen(mixture.densities(x)), choice, free);
    [x, gamma.technique, gamma.place]
}

/// The inverse.
fn inversion<const N: usize>(
    mixture: &Exponentials<N>,
    seen: impl Fn([f64; N]) -> [f64; N],
    [x, technique, place]: [f64; 3],
) -> [f64; 3] {
    let numbers = invert(&mixture.weights, &seen(mixture.densities(x)), Gamma { technique, place });
    [numbers.free, numbers.choice, mixture.invert(numbers.technique, x)]
}

fn product_is_one<const N: usize>() {
    let mut random = Random::new(200 + N as u32);
    for _ in 0..200 {
        let mixture = Exponentials::<N>::random(&mut random);
        // far enough from the ends of a technique's numbers that no step leaves them
        let mut inner = || random.between(0.1, 0.9);
        let (technique, u) = ((inner() * N as f64) as u32, [inner(), inner(), inner()]);
        let cell = find(&mixture.weights, 1.0, |i, _| i == technique);
        let numbers = [u[0], cell.number(u[1]), u[2]];
        let seen = |densities| densities;
        let there = jacobian(|u| sampling(&mixture, seen, u), numbers);
        let sample = sampling(&mixture, seen, numbers);
        let back = jacobian(|sample| inversion(&mixture, seen, sample), sample);
        // the largest term beyond the derivatives is STEP^2 / 3 / (1 - u3)^2 of them, 3.4e-9; roundings are 2^-53 / STEP of a quotient by
        // a share above 4e-4, relative to that quotient
        assert!((there * back - 1.0).abs() < 1e-8, "{N} techniques: {there} times {back}");
        assert!((there * mixture.density(sample[0]) - 1.0).abs() < 1e-8, "{N} techniques: {there}");

        // an inverse with the weights twice in its shares, and gamma2 = u2
        let twice = |densities: [f64; N]| core::array::from_fn(|t| densities[t] * mixture.weights[t]);
        let back = jacobian(|sample| inversion(&mixture, twice, sample), sample);
        assert!((there * back - 1.0).abs() > 1e-6, "{N} techniques: weights counted twice pass");
        let not_stretched = |u: [f64; 3]| {
            let [x, technique, _] = sampling(&mixture, seen, u);
            [x, technique, u[1]]
        };
        let there = jacobian(not_stretched, numbers);
        assert!((there * mixture.density(sample[0]) - 1.0).abs() > 0.1, "{N} techniques: gamma2 = u2 passes");
    }
}

#[test]
fn jacobians_of_sampling_and_inversion_cancel() {
    product_is_one::<2>();
    product_is_one::<3>();
    product_is_one::<4>();
    product_is_one::<5>();
    product_is_one::<6>();
    product_is_one::<7>();
    product_is_one::<8>();
    product_is_one::<9>();
}
