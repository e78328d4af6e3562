//! Random numbers are a function, and spread.

use restir_shared::glam::UVec4;
use restir_shared::rng::{Rng, Sampler, pcg4d, sobol, unit};

/// Each of the four words has one number in each 256th; so have the first two in each cell of the shapes of an elementary interval.
#[test]
fn a_stretch_of_samples_is_spread() {
    for first in [0, 256, 0xffff_ff00] {
        let rng = |sample| Rng::new(17, 4, sample, 7, Sampler::Sobol).draw(2);
        let points: Vec<UVec4> = (first..=first + 255).map(rng).collect();
        let spread = |cell: &dyn Fn(&UVec4) -> u32| {
            let mut counts = [0; 256];
            points.iter().for_each(|point| counts[cell(point) as usize] += 1);
            counts == [1; 256]
        };
        assert!((0..4).all(|word| spread(&|point| point[word] >> 24)));
        assert!((1..8).all(|bits| spread(&|point| point.x >> (32 - bits) << (8 - bits) | point.y >> (24 + bits))));
    }
}

#[test]
fn numbers_are_below_one_and_unlike() {
    assert_eq!((unit(0), unit(u32::MAX)), (0.0, 1.0 - f32::EPSILON / 2.0));
    assert_eq!(sobol(0), UVec4::ZERO);
    let mean = |draw: &dyn Fn(u32) -> u32| (0..4096).map(|i| f64::from(unit(draw(i)))).sum::<f64>() / 4096.0;
    for word in 0..4 {
        assert!((mean(&|i| pcg4d(UVec4::new(i, 0, 0, 0))[word]) - 0.5).abs() < 0.02);
        assert!((mean(&|i| Rng::new(0, 0, 0, i, Sampler::Independent).draw(1)[word]) - 0.5).abs() < 0.02);
    }
}
