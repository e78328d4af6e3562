//! Numbers that are spread over the samples of a pixel: how evenly, and that nothing else depends on anything.

use super::support::DRAWS;
use restir_shared::glam::UVec4;
use restir_shared::rng::{Rng, Sampler, pcg4d, reordered, scramble, sobol};
use restir_tests::stats::{FAMILY_RATE, Family};

/// Samples of a stretch, as a power of two.
const STRETCH_LOG2: u32 = 9;
/// 2^32 over the golden ratio, by which the seed of the shuffle is made of two others.
const GOLDEN: u32 = 0x9e37_79b9;

/// Words that are used together, the quality t (of 2^m points every elementary interval of volume 2^(t - m) has 2^t), and the
/// least m of which it is as large. For polynomials of degrees e it is at most the sum of e - 1 (Sobol 1967; Niederreiter 1992,
/// theorem 4.49).
const QUALITIES: [(&[usize], u32, u32); 12] = [
    (&[0], 0, 0),
    (&[1], 0, 0),
    (&[2], 0, 0),
    (&[3], 0, 0),
    (&[0, 1], 0, 0),
    (&[0, 2], 1, 3),
    (&[1, 2], 1, 2),
    (&[0, 3], 2, 4),
    (&[1, 3], 2, 5),
    (&[2, 3], 3, 17),
    (&[0, 1, 2], 1, 2),
    (&[0, 1, 2, 3], 3, 8),
];

/// All ways to write `sum` as `parts` numbers, in order.
fn compositions(sum: u32, parts: usize) -> Vec<Vec<u32>> {
    if parts == 1 {
        return vec![vec![sum]];
    }
    let first_and_rest =
        |first: u32| compositions(sum - first, parts - 1).into_iter().map(move |rest| [vec![first], rest].concat());
    (0..=sum).flat_map(first_and_rest).collect()
}

/// Whether these words of the points, of which there are 2^m, are a (t, m, s)-net in base 2.
fn is_net(points: &[[u32; 4]], words: &[usize], t: u32) -> bool {
    let digits = points.len().ilog2() - t;
    compositions(digits, words.len()).iter().all(|shape| {
        let mut counts = vec![0_u32; 1 << digits];
        for point in points {
            let cell = words
                .iter()
                .zip(shape)
                .fold(0_u64, |cell, (&word, &digits)| (cell << digits) | (u64::from(point[word]) >> (32 - digits)));
            counts[cell as usize] += 1;
        }
        counts.iter().all(|&count| count == 1 << t)
    })
}

/// The words of an aligned stretch of samples.
fn stretch(first: u32, log2: u32, rng: Rng, dimension: u32) -> Vec<[u32; 4]> {
    (0..1 << log2).map(|i| rng.of_sample(first + i).draw(dimension).to_array()).collect()
}

/// At the beginning, at the end and at two random places of all 2^32 samples; of several pixels, dimensions and seeds.
fn stretches(sampler: Sampler) -> impl Iterator<Item = Vec<[u32; 4]>> {
    let keys = [(0, 0, 0, 0), (517, 260, 3, 1), (16_383, 16_383, 1 << 24, u32::MAX), (1, 0, 65_536, 7)];
    keys.into_iter().flat_map(move |(x, y, dimension, seed)| {
        let rng = Rng::new(x, y, 0, seed, sampler);
        (0..=STRETCH_LOG2).flat_map(move |log2| {
            let anywhere = pcg4d(UVec4::new(x, y, dimension, log2));
            [0, 1 << log2, u32::MAX, anywhere.x, anywhere.y]
                .map(|within| stretch(within & (u32::MAX << log2), log2, rng, dimension))
        })
    })
}

pub(crate) fn aligned_stretches_are_nets() {
    for points in stretches(Sampler::Sobol) {
        for (words, t, _) in QUALITIES {
            let t = t.min(points.len().ilog2());
            assert!(is_net(&points, words, t), "{} samples, words {words:?}: not with t = {t}", points.len());
        }
    }
    let evenly = |words: &[usize]| stretches(Sampler::Independent).all(|points| is_net(&points, words, 0));
    assert!(!evenly(&[0]) && !evenly(&[0, 1]), "independent numbers pass as a net");
}

pub(crate) fn no_pair_is_better_than_stated() {
    for (words, t, log2) in QUALITIES.into_iter().filter(|(_, t, _)| *t > 0) {
        let points = stretch(0, log2, Rng::new(3, 1, 0, 1, Sampler::Sobol), 2);
        assert!(!is_net(&points, words, t - 1), "words {words:?} have less than t = {t}");
        assert!(is_net(&points, words, t), "words {words:?} have more than t = {t}");
    }
}

/// Dimensions that are drawn jointly: of the pixel, and of the light and the direction at the first two vertices of a path.
const JOINT: [u32; 5] = [0, 2, 3, 5, 6];
/// What t is at most of 2^m samples, of the first two words in one joint dimension with the first two in another; m from 1 on.
const JOINT_QUALITIES: [u32; 12] = [0, 1, 2, 3, 4, 5, 4, 4, 4, 5, 5, 6];

fn joint_pairs() -> impl Iterator<Item = (u32, u32)> {
    (0..JOINT.len()).flat_map(|second| (0..second).map(move |first| (JOINT[first], JOINT[second])))
}

/// The first two words in two dimensions, of an aligned stretch of 2^log2 samples.
fn joint_stretch(first: u32, log2: u32, rng: Rng, (a, b): (u32, u32), draw: Draw) -> Vec<[u32; 4]> {
    let point = |sample: u32| {
        let [a, b] = [a, b].map(|dimension| draw(rng.of_sample(first + sample), dimension));
        [a[0], a[1], b[0], b[1]]
    };
    (0..1 << log2).map(point).collect()
}

/// Whether the pairs of joint dimensions have the qualities, at the beginning of all samples and in the middle.
fn are_joint(draw: Draw) -> bool {
    [0, 1 << 31].into_iter().all(|first| {
        (1..).zip(JOINT_QUALITIES).all(|(log2, t)| {
            let rng = Rng::new(517, 260, 0, 7, Sampler::Sobol);
            joint_pairs().all(|pair| is_net(&joint_stretch(first, log2, rng, pair, draw), &[0, 1, 2, 3], t))
        })
    })
}

pub(crate) fn joint_dimensions_are_nets() {
    assert!(are_joint(|rng, dimension| rng.draw_jointly(dimension).to_array()));
    let rng = Rng::new(517, 260, 0, 7, Sampler::Sobol);
    for (log2, t) in (1..).zip(JOINT_QUALITIES).filter(|(_, t)| *t > 0) {
        let draw: Draw = |rng, dimension| rng.draw_jointly(dimension).to_array();
        let better = |pair| is_net(&joint_stretch(0, log2, rng, pair, draw), &[0, 1, 2, 3], t - 1);
        assert!(!joint_pairs().all(better), "all pairs have less than t = {t} of 2^{log2} samples");
    }
    let apart: Draw = |rng, dimension| rng.draw(dimension).to_array();
    let in_one_order: Draw =
        |rng, dimension| built_of_index(index_of(rng, seeds(rng, 0), scramble), seeds(rng, dimension));
    for (fault, draw) in [("each for itself", apart), ("all in one order", in_one_order)] {
        assert!(!are_joint(draw), "{fault}: passes");
    }
}

/// Words of joint dimensions, of one sample, over pixels.
fn joint_words(draw: Draw) -> Family {
    let mut family = Family::new("pairs of joint dimensions", FAMILY_RATE);
    for (a, b) in joint_pairs() {
        for (word, other, sample) in [(0, 0, 0), (0, 1, 1), (1, 0, 6), (1, 1, u32::MAX), (2, 2, 9)] {
            let numbers = |i: u64| {
                let rng = Rng::new(i as u32 % 1024, i as u32 / 1024, sample, 1, Sampler::Sobol);
                (draw(rng, a)[word] >> 29 << 3 | draw(rng, b)[other] >> 29) as usize
            };
            let words = format!("word {word} of dimension {a}, word {other} of {b}, sample {sample}");
            family.uniform(words, 64, DRAWS / 16, numbers);
        }
    }
    family
}

pub(crate) fn joint_words_are_independent() {
    joint_words(|rng, dimension| rng.draw_jointly(dimension).to_array()).assert();
    let one_scramble: Draw = |rng, dimension| built_of_index(reordered(rng.key().y, dimension), seeds(rng, 0));
    assert!(!joint_words(one_scramble).passed(), "one scramble for all, and indices in order: passes");
}

pub(crate) fn orders_keep_aligned_stretches() {
    for dimension in JOINT {
        for log2 in 0..10 {
            for first in [0, 1 << log2, 0x5555_5555, u32::MAX].map(|first: u32| first & (u32::MAX << log2)) {
                let mut indices: Vec<_> = (0..1 << log2).map(|i| reordered(first | i, dimension)).collect();
                indices.sort_unstable();
                let start = indices[0];
                assert!(
                    start.trailing_zeros() >= log2 && (start..=u32::MAX).zip(&indices).all(|(at, &index)| at == index)
                );
            }
        }
    }
    for index in [0, 1, 0x1234_5678, u32::MAX] {
        assert_eq!(reordered(index, 0), index, "dimension 0 has another order");
    }
}

/// The coordinates by direction numbers, as Joe and Kuo (2008, "Constructing Sobol sequences with better two-dimensional
/// projections") list them: degree, coefficients between the first and the last, first numbers.
pub(crate) fn coordinates_are_those_of_joe_and_kuo() {
    let listed: [(usize, u32, &[u32]); 3] = [(1, 0, &[1]), (2, 1, &[1, 3]), (3, 1, &[1, 3, 1])];
    let directions = listed.map(|(degree, coefficients, first)| {
        let mut v: Vec<u32> = first.iter().enumerate().map(|(i, m)| m << (31 - i)).collect();
        for i in degree..32 {
            let earlier = (1..degree).filter(|k| coefficients >> (degree - 1 - k) & 1 == 1).map(|k| v[i - k]);
            v.push(earlier.fold(v[i - degree] ^ (v[i - degree] >> degree), |sum, v| sum ^ v));
        }
        v
    });
    let indices = (0..4096).chain((0..DRAWS as u32).map(|i| pcg4d(UVec4::new(i, 0, 0, 0)).x)).chain([u32::MAX]);
    for index in indices {
        let [first, rest @ ..] = sobol(index).to_array().map(u32::reverse_bits);
        assert_eq!(first, index.reverse_bits());
        for (word, v) in rest.into_iter().zip(&directions) {
            let expected = (0..32).filter(|bit| index >> bit & 1 == 1).fold(0, |sum, bit| sum ^ v[bit as usize]);
            assert_eq!(word, expected, "index {index}");
        }
    }
}

/// Samples whose numbers are looked at together: the bits in which their indices differ are not the same.
const PAIRS: [(u32, u32); 4] = [(0, 2), (1, 6), (3, 12), (0xffff_fff0, 0xffff_fff9)];

/// Draws of a dimension as a function of the pixel and of the sample.
type Draw = fn(Rng, u32) -> [u32; 4];

/// What has to be independent over pixels: a number and that of another dimension, and how two samples differ in the one and in the
/// other.
fn dimensions(draw: Draw) -> Family {
    let mut family = Family::new("pairs of dimensions", FAMILY_RATE);
    let at = |i: u64, sample: u32| Rng::new(i as u32 % 1024, i as u32 / 1024, sample, 1, Sampler::Sobol);
    for word in 0..4 {
        for (a, b) in [(2, 3), (2, 5), (3, 6)] {
            for (sample, other) in PAIRS {
                let number = |i: u64, sample: u32, dimension: u32| draw(at(i, sample), dimension)[word] >> 29;
                let numbers = |i| (number(i, sample, a) << 3 | number(i, sample, b)) as usize;
                family.uniform(
                    format!("word {word}, dimensions {a} and {b}, sample {sample}"),
                    64,
                    DRAWS / 16,
                    numbers,
                );
                let differs = |i, dimension| number(i, sample, dimension) ^ number(i, other, dimension);
                let mut counts = [[0_u64; 8]; 8];
                (0..DRAWS / 16).for_each(|i| counts[differs(i, a) as usize][differs(i, b) as usize] += 1);
                family.chi_square(
                    format!("word {word}, dimensions {a} and {b}, samples {sample} and {other}"),
                    cells(&counts),
                );
            }
        }
    }
    family
}

/// The counts of a table with those that its margins and independence would give.
fn cells(counts: &[[u64; 8]; 8]) -> Vec<(u64, f64)> {
    let row = |i: usize| counts[i].iter().sum::<u64>() as f64;
    let column = |j: usize| counts.iter().map(|row| row[j]).sum::<u64>() as f64;
    let all: f64 = (0..8).map(row).sum();
    let cell = |i: usize, j: usize| (counts[i][j], row(i) * column(j) / all);
    (0..64).map(|at| cell(at / 8, at % 8)).filter(|(_, expected)| *expected > 0.0).collect()
}

pub(crate) fn dimensions_are_independent() {
    dimensions(|rng, dimension| rng.draw(dimension).to_array()).assert();
}

/// The construction of [`Rng::draw`] with what `shuffle` makes of an index and a seed, from the seeds of a dimension.
fn built(rng: Rng, seeds: UVec4, shuffle: impl Fn(u32, u32) -> u32) -> [u32; 4] {
    built_of_index(index_of(rng, seeds, shuffle), seeds)
}

fn index_of(rng: Rng, seeds: UVec4, shuffle: impl Fn(u32, u32) -> u32) -> u32 {
    let seed = seeds.x.wrapping_add(seeds.y.wrapping_mul(GOLDEN));
    shuffle(rng.key().y.reverse_bits(), seed).reverse_bits()
}

fn built_of_index(index: u32, seeds: UVec4) -> [u32; 4] {
    let (point, seeds) = (sobol(index).to_array(), seeds.to_array());
    std::array::from_fn(|word| scramble(point[word], seeds[word]).reverse_bits())
}

fn seeds(rng: Rng, dimension: u32) -> UVec4 {
    rng.of_sample(0).hash(dimension)
}

/// What goes wrong in practice: faults of the construction, which without them gives the words of [`Rng::draw`].
pub(crate) fn broken_scrambles_are_seen() {
    for sample in (0..1000).chain([u32::MAX]) {
        let rng = Rng::new(sample % 97, 5, sample.wrapping_mul(GOLDEN), 1, Sampler::Sobol);
        assert_eq!(built(rng, seeds(rng, 3), scramble), rng.draw(3).to_array(), "another construction");
        let joint = reordered(index_of(rng, seeds(rng, 0), scramble), 3);
        assert_eq!(built_of_index(joint, seeds(rng, 3)), rng.draw_jointly(3).to_array(), "another joint construction");
        assert_eq!(rng.draw_jointly(0), rng.draw(0), "dimension 0 is drawn otherwise jointly");
    }
    let fixed: Draw = |rng, dimension| {
        // the lowest bit of an index, of which it depends in which half a number lies
        let shuffle = |index, seed| (scramble(index, seed) & (u32::MAX >> 1)) | (index & (1 << 31));
        built(rng, seeds(rng, dimension), shuffle)
    };
    let not_shuffled: Draw = |rng, dimension| built(rng, seeds(rng, dimension), |index, _| index);
    let same: Draw = |rng, _| built(rng, seeds(rng, 0), scramble);
    let faults =
        [("one bit of the index is fixed", fixed), ("no shuffle", not_shuffled), ("one scramble for all", same)];
    for (fault, draw) in faults {
        assert!(!dimensions(draw).passed(), "{fault}: passes");
    }
}
