//! Choices: alias table, lights, integer distribution functions, two-dimensional tables; what is left of the number that
//! made the choice.

use super::support::{DRAWS, ROUNDING, two_words, words};
use glam::Vec3;
use restir_host::distribution::integer_cdf;
use restir_shared::lanes::{LANES, Lanes};
use restir_shared::num::mul_wide;
use restir_shared::rng;
use restir_shared::sampling::{
    CDF_END, Cell, discrete_probability, find_discrete_each, invert_discrete, invert_table_2d, sample_alias,
    sample_discrete, sample_table_2d, table_2d_pdf, table_2d_probability,
};
use restir_shared::scene::Lights;
use restir_tests::random::SplitMix;
use restir_tests::scenes::terrace;
use restir_tests::stats::{FAMILY_RATE, Family};

/// A table by hand: index i keeps its own with probability (i + 1) / 8, its alias is 7 - i.
pub(crate) fn alias_table_has_its_probabilities() {
    let entry = |i: u32| ((i + 1) as f32 * 0.125, 7 - i);
    let mut family = Family::new("alias table", FAMILY_RATE);
    let table = |i| sample_alias(two_words(i, 17), 8, entry) as usize;
    family.histogram("table of 8", 8, DRAWS, table, |i| (2 * i + 1) as f64 / 64.0);
    for count in [1, 3, 1000] {
        let cell = |i| sample_alias(two_words(i, 29 + count), count, |i| (1.0, i)) as usize;
        family.uniform(format!("{count} equal outcomes"), count as usize, DRAWS, cell);
    }
    assert!(sample_alias([u32::MAX, u32::MAX], 5, |i| (1.0, i)) == 4, "the last index is out of reach");
    family.assert();
}

/// Emitters of different power: how often each is drawn against the density that the scene states for it.
pub(crate) fn lights_have_their_density() {
    let setting = terrace();
    let buffers = setting.buffers();
    let view = buffers.view();
    // the emitters are told apart by the plane they lie in: `terrace` has one at z = -1.4 and one above y = 0.5
    let quads: [usize; 2] = [2, 3];
    let areas = quads.map(|quad| quad_area(setting.quads[quad].corners));
    let light = |i| view.sample_light(words(i, 37).into());
    let which = |position: Vec3| if position.y > 0.5 { 0 } else { 1 };
    let mut densities = [0.0; 2];
    for i in 0..1000 {
        let light = light(i);
        densities[which(light.position)] = f64::from(light.density);
    }
    let shares: Vec<_> = densities.iter().zip(areas).map(|(density, area)| density * area).collect();
    println!("emitters: probabilities {shares:.6?}");
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1.0e-6, "probabilities {shares:?} do not add to 1");
    assert!((shares[0] - shares[1]).abs() > 0.01, "the emitters are alike: no table");
    let mut family = Family::new("lights", FAMILY_RATE);
    family.histogram("emitters", 2, DRAWS, |i| which(light(i).position), |i| shares[i]);
    family.assert();
}

/// The area of a parallelogram.
fn quad_area([a, b, _, d]: [[f32; 3]; 4]) -> f64 {
    let [a, b, d] = [a, b, d].map(|corner| Vec3::from_array(corner).as_dvec3());
    (b - a).cross(d - a).length()
}

/// An integer distribution function over the items of a list.
struct Discrete(Vec<u32>);

impl Discrete {
    fn new(weights: &[f64]) -> Self {
        Self(integer_cdf(weights))
    }

    fn count(&self) -> u32 {
        self.0.len() as u32
    }

    fn sample(&self, word: u32) -> Cell {
        sample_discrete(word, self.count(), |i| self.0[i as usize])
    }

    fn invert(&self, index: u32, fraction: f32) -> u32 {
        invert_discrete(index, fraction, self.count(), |i| self.0[i as usize])
    }

    /// How many of the 2^32 words make an item.
    fn size(&self, index: usize) -> u64 {
        let bound = |i: usize| match self.0.get(i) {
            None | Some(&CDF_END) => 1 << 32,
            Some(&bound) => u64::from(bound),
        };
        bound(index + 1) - bound(index)
    }

    fn probability(&self, index: usize) -> f64 {
        self.size(index) as f64 / (1_u64 << 32) as f64
    }
}

/// Lists of weights: few and many, zeros at both ends, over many magnitudes.
fn weights() -> Vec<Vec<f64>> {
    let mut random = SplitMix::new(1);
    let mut list = |n: usize, spread: f64| -> Vec<f64> { (0..n).map(|_| (-spread * random.unit()).exp2()).collect() };
    let mut sparse = list(300, 4.0);
    sparse.iter_mut().step_by(3).for_each(|w| *w = 0.0);
    sparse.extend([0.0; 5]);
    vec![vec![1.0], vec![0.0, 0.0, 3.0, 0.0], list(5, 2.0), list(1000, 12.0), sparse, halves(16)]
}

/// 2^-i: the number of bits that a choice takes grows by one from item to item.
fn halves(n: i32) -> Vec<f64> {
    (0..n).map(|i| f64::exp2(-f64::from(i))).collect()
}

pub(crate) fn discrete_has_its_probabilities() {
    let mut family = Family::new("discrete", FAMILY_RATE);
    for (number, weights) in weights().iter().enumerate() {
        let list = Discrete::new(weights);
        let item = |i| list.sample(words(i, 51 + number as u32)[0]).index as usize;
        family.histogram(format!("list {number}"), weights.len(), DRAWS, item, |i| list.probability(i));
        for (i, &weight) in weights.iter().enumerate() {
            let p = f64::from(discrete_probability(i as u32, list.count(), |i| list.0[i as usize]));
            let exact = list.probability(i);
            assert!((p - exact).abs() <= ROUNDING * exact, "item {i} of list {number}: {p} for {exact}");
            assert!((weight > 0.0) == (exact > 0.0), "item {i} of list {number}: {exact}");
        }
    }
    family.assert();
}

/// Bits that a test of what is left needs beyond those of its cells, so that cells are equal to within 2^-8 of a count's
/// deviation at these draws.
const SPARE_BITS: u32 = 12;

/// Within each item the fraction is uniform, as many bits as it is said to have: its leading bits for every item, its
/// last ones where 24 are left.
pub(crate) fn what_a_choice_leaves_is_uniform() {
    let mut family = Family::new("what a choice leaves", FAMILY_RATE);
    let list = Discrete::new(&halves(16));
    for item in 0..list.0.len() {
        let size = list.size(item);
        let bits = size.ilog2().saturating_sub(SPARE_BITS).min(8);
        // the words of the item, all equally likely
        let fraction = |i: u64| {
            let word = words(i, 61 + item as u32)[0];
            let (offset, _) = mul_wide(word, size as u32);
            let cell = list.sample(list.0[item].wrapping_add(offset));
            assert_eq!(cell.index as usize, item, "a word of the item makes the item");
            cell.fraction
        };
        let leading = |i: u64| (fraction(i) * (1_u32 << bits) as f32) as usize;
        family.uniform(format!("leading bits in item {item}"), 1 << bits, DRAWS / 4, leading);
        if size.ilog2() >= 24 + SPARE_BITS / 2 {
            let last = |i: u64| (fraction(i) / ROUNDING as f32) as usize & 0xff;
            family.uniform(format!("last bits in item {item}"), 256, DRAWS / 4, last);
        }
    }
    independence(&mut family, |cell, _| cell.fraction);
    family.assert();
}

/// Item and fraction together.
fn independence(family: &mut Family, fraction: impl Fn(Cell, u32) -> f32 + Sync) {
    const PARTS: usize = 32;
    let list = Discrete::new(&[3.0, 1.0, 0.0, 2.0, 5.0, 0.25, 1.0, 7.0]);
    let cell = |i: u64| {
        let word = words(i, 83)[0];
        let cell = list.sample(word);
        cell.index as usize * PARTS + ((fraction(cell, word) * PARTS as f32) as usize).min(PARTS - 1)
    };
    let probability = |cell: usize| list.probability(cell / PARTS) / PARTS as f64;
    family.histogram("item and fraction", list.0.len() * PARTS, DRAWS, cell, probability);
}

/// The number that made the choice, taken as the next number, is known to lie in the item's interval.
pub(crate) fn reuse_without_remapping_is_seen() {
    let mut family = Family::new("the same number again", FAMILY_RATE);
    independence(&mut family, |_, word| rng::unit(word));
    assert!(!family.passed(), "a number that was used passes as unused");
}

const WIDTH: usize = 9;
const HEIGHT: usize = 7;

/// A table with an empty row, an empty column and a bright spot.
fn luminance(column: usize, row: usize) -> f64 {
    match (column, row) {
        (2, _) | (_, 3) => 0.0,
        (5, 5) => 40.0,
        _ => 0.5 + ((column * 7 + row * 5) % 11) as f64,
    }
}

pub(crate) fn table_has_its_density() {
    const PARTS: usize = 4;
    let table: [[f64; WIDTH]; HEIGHT] = std::array::from_fn(|row| std::array::from_fn(|column| luminance(column, row)));
    let columns = table.map(|row| Discrete::new(&row));
    let sums = table.map(|row| row.iter().sum());
    let rows = Discrete::new(&sums);
    let (width, height) = (WIDTH as u32, HEIGHT as u32);
    let row_cdf = |row: u32| rows.0[row as usize];
    let column_cdf = |row: u32, column: u32| columns[row as usize].0[column as usize];
    let sample = |i| sample_table_2d(two_words(i, 91), width, height, row_cdf, column_cdf);
    // position in the unit square, on a grid finer than the table's
    let cell = |i: u64| {
        let s = sample(i);
        let part = |cell: u32, fraction: f32| cell as usize * PARTS + ((fraction * PARTS as f32) as usize);
        part(s.cell[1], s.fraction.y) * WIDTH * PARTS + part(s.cell[0], s.fraction.x)
    };
    let total: f64 = sums.iter().sum();
    let probability = |cell: usize| {
        let (column, row) = (cell % (WIDTH * PARTS) / PARTS, cell / (WIDTH * PARTS) / PARTS);
        luminance(column, row) / total / (PARTS * PARTS) as f64
    };
    let mut family = Family::new("table", FAMILY_RATE);
    family.histogram("unit square", WIDTH * HEIGHT * PARTS * PARTS, DRAWS, cell, probability);
    let mut integral = 0.0;
    for (row, columns) in columns.iter().enumerate() {
        for column in 0..WIDTH {
            let p = table_2d_probability([column as u32, row as u32], width, height, row_cdf, column_cdf);
            let exact = rows.probability(row) * columns.probability(column);
            assert!((f64::from(p) - exact).abs() <= 3.0 * ROUNDING * exact, "({column}, {row}): {p}");
            integral += f64::from(table_2d_pdf(p, width, height)) / (WIDTH * HEIGHT) as f64;
        }
    }
    assert!((integral - 1.0).abs() <= 4.0 * ROUNDING, "the density integrates to {integral}");
    for i in 0..10_000 {
        let s = sample(i);
        let p = table_2d_probability(s.cell, width, height, row_cdf, column_cdf);
        assert!(p == s.probability, "{:?} is drawn with {}, stated as {p}", s.cell, s.probability);
        let back = invert_table_2d(s.cell, s.fraction, width, height, row_cdf, column_cdf);
        let again = sample_table_2d(back, width, height, row_cdf, column_cdf);
        let moved = (again.fraction - s.fraction).abs();
        let near = again.cell == s.cell && f64::from(moved.max_element()) <= 4.0 * ROUNDING;
        assert!(near, "{s:?} comes back as {again:?}");
    }
    family.assert();
}

/// In lanes, of lists of all lengths, for random words and for those at which items begin and end.
pub(crate) fn items_are_found_in_step() {
    let ends = |list: &Discrete, i: usize| {
        let bound = list.0[i % list.0.len()];
        [bound.wrapping_sub(1), bound, bound.wrapping_add(1), u32::MAX]
    };
    for (number, weights) in weights().iter().enumerate() {
        let list = Discrete::new(weights);
        for i in 0..1000 {
            let random = words(i as u64, 71 + number as u32);
            let ends = ends(&list, i);
            let mut words = Lanes::ZERO;
            for lane in 0..LANES {
                words.set(lane, if lane % 2 == 0 { ends[lane / 2 % 4] } else { random[0].rotate_left(lane as u32) });
            }
            let found = [1, 4, 16].map(|part| {
                let parts: Vec<u32> = list.0.iter().copied().step_by(part).collect();
                find_discrete_each(&words, list.count(), part as u32, |_| &parts, |_, i| list.0[i as usize])
            });
            for lane in 0..LANES {
                let word = words.get(lane);
                let one_by_one = [list.sample(word).index; 3];
                assert_eq!(found.map(|found| found.get(lane)), one_by_one, "list {number}, word {word}");
            }
        }
    }
}

pub(crate) fn discrete_inverts() {
    for (number, weights) in weights().iter().enumerate() {
        let list = Discrete::new(weights);
        let ends = list.0.iter().flat_map(|&bound| [bound, bound.wrapping_sub(1)]);
        for word in ends.chain((0..DRAWS / 8).map(|i| words(i, 97)[0])) {
            let Cell { index, fraction, .. } = list.sample(word);
            let back = list.invert(index, fraction);
            // above 2^23 words three roundings of 2^-24 of the item show
            let size = list.size(index as usize);
            let slack = if size > 1 << 23 { size >> 22 } else { 0 };
            assert!(u64::from(word.abs_diff(back)) <= slack, "list {number}: {word} comes back as {back}");
            assert!(list.sample(back).index == index, "list {number}: {word} comes back in another item");
        }
        for index in (0..list.count()).filter(|&i| list.size(i as usize) > 0) {
            for fraction in [0.0, f32::MIN_POSITIVE, 1.0 - ROUNDING as f32, 1.0, f32::NAN] {
                let found = list.sample(list.invert(index, fraction)).index;
                assert!(found == index, "list {number}: {fraction} of item {index} is in item {found}");
            }
        }
    }
}
