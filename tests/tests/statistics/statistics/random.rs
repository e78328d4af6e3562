//! The random numbers of the kernels.

use super::support::{DRAWS, ROUNDING};
use restir_shared::rng::{self, Rng, Sampler};
use restir_tests::stats::{FAMILY_RATE, Family};

/// What varies while the rest of the key is fixed, and the sampler: over its samples alone numbers that are spread are not
/// independent.
const AXES: [(&str, Sampler); 7] = [
    ("pixel", Sampler::Independent),
    ("sample", Sampler::Independent),
    ("dimension", Sampler::Independent),
    ("seed", Sampler::Independent),
    ("pixel", Sampler::Sobol),
    ("dimension", Sampler::Sobol),
    ("seed", Sampler::Sobol),
];

/// The key (pixel, sample, dimension, seed) with `i` along one axis; a pixel is (x, y) of an image 1024 wide.
fn key((axis, sampler): (&str, Sampler), i: u32) -> (Rng, u32) {
    let (x, y) = if axis == "pixel" { (i % 1024, i / 1024) } else { (517, 260) };
    let on = |name: &str, otherwise: u32| if axis == name { i } else { otherwise };
    (Rng::new(x, y, on("sample", 3), on("seed", 1), sampler), on("dimension", 5))
}

fn draw(axis: (&str, Sampler), i: u32) -> [u32; 4] {
    let (rng, dimension) = key(axis, i);
    rng.draw(dimension).to_array()
}

pub(crate) fn words_are_uniform() {
    let mut family = Family::new("uniformity", FAMILY_RATE);
    for axis in AXES {
        for word in 0..4 {
            for (which, shift) in [("top", 20), ("low", 8)] {
                let bits = |i| (draw(axis, i as u32)[word] >> shift) as usize & 0xfff;
                family.uniform(format!("{which} bits of word {word} over {axis:?}"), 4096, DRAWS, bits);
            }
        }
    }
    family.assert();
}

/// Pairs of top bits of neighbours at distances that occur: the next, the next row, the next block.
fn serial_pairs(draw: impl Fn((&str, Sampler), u32) -> [u32; 4] + Sync) -> Family {
    let mut family = Family::new("serial pairs", FAMILY_RATE);
    for axis in AXES {
        for distance in [1, 2, 64, 1024] {
            for word in 0..4 {
                let pair = |i: u64| {
                    let i = i as u32;
                    let (a, b) = (draw(axis, i)[word], draw(axis, i + distance)[word]);
                    ((a >> 26) << 6 | b >> 26) as usize
                };
                family.uniform(format!("word {word}, {axis:?}s {distance} apart"), 4096, DRAWS / 4, pair);
            }
        }
    }
    family
}

pub(crate) fn neighbouring_keys_are_independent() {
    serial_pairs(draw).assert();
}

pub(crate) fn words_of_a_draw_are_independent() {
    let mut family = Family::new("pairs of words", FAMILY_RATE);
    for axis in AXES {
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            let pair = |i: u64| {
                let words = draw(axis, i as u32);
                ((words[a] >> 26) << 6 | words[b] >> 26) as usize
            };
            family.uniform(format!("words {a} and {b} over {axis:?}"), 4096, DRAWS / 4, pair);
        }
    }
    family.assert();
}

/// One multiplication per word, without the mixing between them.
pub(crate) fn a_weak_generator_is_seen() {
    let weak = |(axis, _): (&str, Sampler), i: u32| {
        let on = |name: &str, otherwise: u32| if axis == name { i } else { otherwise };
        let key = [on("pixel", 1), on("sample", 3), on("dimension", 5), on("seed", 7)];
        let sum = key.iter().fold(0_u32, |sum, &k| sum.wrapping_mul(31).wrapping_add(k));
        [1_664_525_u32, 22_695_477, 214_013, 1_103_515_245].map(|factor| sum.wrapping_mul(factor))
    };
    assert!(!serial_pairs(weak).passed(), "a linear congruence passes as random");
}

pub(crate) fn unit_numbers_are_below_one() {
    assert!(f64::from(rng::unit(u32::MAX)) == 1.0 - ROUNDING, "the largest number is not 1 - 2^-24");
    assert!(rng::unit(255) == 0.0 && rng::unit(256) > 0.0, "the low 8 bits count");
}
