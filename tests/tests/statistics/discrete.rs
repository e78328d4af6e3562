//! Choices: alias table, lights, integer distribution functions, two-dimensional tables; what is left of the number that
//! made the choice.

use crate::support::{DRAWS, ROUNDING, family, report, words};
use glam::{UVec4, Vec3};
use libtest_mimic::Failed;
use restir_host::distribution::integer_cdf;
use restir_shared::num::mul_wide;
use restir_shared::rng::{self, pcg4d};
use restir_shared::sampling::{
    CDF_END, Cell, discrete_probability, invert_discrete, invert_table_2d, sample_alias, sample_discrete,
    sample_table_2d, table_2d_pdf, table_2d_probability,
};
use restir_shared::scene::Lights;
use restir_tests::random::SplitMix;
use restir_tests::scenes::terrace;
use restir_tests::stats::{Family, histogram, uniform};
use restir_tests::suite::ensure;

/// A table by hand: index i keeps its own with probability (i + 1) / 8, its alias is 7 - i.
pub(crate) fn alias_table_has_its_probabilities() -> Result<(), Failed> {
    let entry = |i: u32| ((i + 1) as f32 * 0.125, 7 - i);
    let mut family = family("alias table");
    let counts = histogram(8, DRAWS, |i| {
        let words = pcg4d(UVec4::new(i as u32, 17, 19, 23));
        sample_alias([words.x, words.y], 8, entry) as usize
    });
    let expected = |i: usize| DRAWS as f64 * ((i + 1) as f64 + (8 - (7 - i + 1)) as f64) / 64.0;
    family.chi_square("table of 8", counts.into_iter().enumerate().map(|(i, count)| (count, expected(i))));
    for count in [1, 3, 1000] {
        let cell = |i: u64| {
            let words = pcg4d(UVec4::new(i as u32, 29, count, 31));
            sample_alias([words.x, words.y], count, |i| (1.0, i)) as usize
        };
        family.chi_square(format!("{count} equal outcomes"), uniform(histogram(count as usize, DRAWS, cell)));
    }
    ensure(sample_alias([u32::MAX, u32::MAX], 5, |i| (1.0, i)) == 4, || "the last index is out of reach".to_owned())?;
    report(&family)
}

/// Emitters of different power: how often each is drawn against the density that the scene states for it.
pub(crate) fn lights_have_their_density() -> Result<(), Failed> {
    let setting = terrace();
    let buffers = setting.buffers();
    let view = buffers.view();
    // the emitters are told apart by the plane they lie in: `terrace` has one at z = -1.4 and one above y = 0.5
    let quads: [usize; 2] = [2, 3];
    let areas = quads.map(|quad| quad_area(setting.quads[quad].corners));
    let light = |i: u32| view.sample_light(pcg4d(UVec4::new(i, 37, 41, 43)));
    let which = |position: Vec3| if position.y > 0.5 { 0 } else { 1 };
    let mut densities = [0.0; 2];
    for i in 0..1000 {
        let light = light(i);
        densities[which(light.position)] = f64::from(light.density);
    }
    let shares: Vec<_> = densities.iter().zip(areas).map(|(density, area)| density * area).collect();
    println!("emitters: probabilities {shares:.6?}");
    ensure((shares.iter().sum::<f64>() - 1.0).abs() < 1.0e-6, || format!("probabilities {shares:?} do not add to 1"))?;
    ensure((shares[0] - shares[1]).abs() > 0.01, || "the emitters are alike: no table".to_owned())?;
    let counts = histogram(2, DRAWS, |i| which(light(i as u32).position));
    let mut family = family("lights");
    family.chi_square("emitters", counts.into_iter().zip(shares).map(|(count, share)| (count, share * DRAWS as f64)));
    report(&family)
}

/// The area of a parallelogram.
fn quad_area([a, b, _, d]: [[f32; 3]; 4]) -> f64 {
    let edge = |p: [f32; 3]| [0, 1, 2].map(|i| f64::from(p[i]) - f64::from(a[i]));
    let (e, f) = (edge(b), edge(d));
    let cross = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    cross.iter().map(|x| x * x).sum::<f64>().sqrt()
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

pub(crate) fn discrete_has_its_probabilities() -> Result<(), Failed> {
    let mut family = family("discrete");
    for (number, weights) in weights().iter().enumerate() {
        let list = Discrete::new(weights);
        let counts = histogram(weights.len(), DRAWS, |i| list.sample(words(i, 51 + number as u32)[0]).index as usize);
        let cells = counts.into_iter().enumerate().map(|(i, count)| (count, list.probability(i) * DRAWS as f64));
        family.chi_square(format!("list {number}"), cells);
        for (i, &weight) in weights.iter().enumerate() {
            let p = f64::from(discrete_probability(i as u32, list.count(), |i| list.0[i as usize]));
            let exact = list.probability(i);
            ensure((p - exact).abs() <= ROUNDING * exact, || format!("item {i} of list {number}: {p} for {exact}"))?;
            ensure((weight > 0.0) == (exact > 0.0), || format!("item {i} of list {number}: {exact}"))?;
        }
    }
    report(&family)
}

/// Bits that a test of what is left needs beyond those of its cells, so that cells are equal to within 2^-8 of a count's
/// deviation at these draws.
const SPARE_BITS: u32 = 12;

/// Within each item the fraction is uniform, as many bits as it is said to have: its leading bits for every item, its
/// last ones where 24 are left.
pub(crate) fn what_a_choice_leaves_is_uniform() -> Result<(), Failed> {
    let mut family = family("what a choice leaves");
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
        family.chi_square(format!("leading bits in item {item}"), uniform(histogram(1 << bits, DRAWS / 4, leading)));
        if size.ilog2() >= 24 + SPARE_BITS / 2 {
            let last = |i: u64| (fraction(i) / ROUNDING as f32) as usize & 0xff;
            family.chi_square(format!("last bits in item {item}"), uniform(histogram(256, DRAWS / 4, last)));
        }
    }
    independence(&mut family, |cell, _| cell.fraction);
    report(&family)
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
    let expected = |cell: usize| list.probability(cell / PARTS) * DRAWS as f64 / PARTS as f64;
    let counts = histogram(list.0.len() * PARTS, DRAWS, cell).into_iter().enumerate();
    family.chi_square("item and fraction", counts.map(|(i, count)| (count, expected(i))));
}

/// The number that made the choice, taken as the next number, is known to lie in the item's interval.
pub(crate) fn reuse_without_remapping_is_seen() -> Result<(), Failed> {
    let mut family = family("the same number again");
    independence(&mut family, |_, word| rng::unit(word));
    ensure(!family.passed(), || "a number that was used passes as unused".to_owned())
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

pub(crate) fn table_has_its_density() -> Result<(), Failed> {
    const PARTS: usize = 4;
    let columns: Vec<Discrete> = (0..HEIGHT)
        .map(|row| Discrete::new(&(0..WIDTH).map(|column| luminance(column, row)).collect::<Vec<_>>()))
        .collect();
    let sums: Vec<f64> = (0..HEIGHT).map(|row| (0..WIDTH).map(|column| luminance(column, row)).sum()).collect();
    let rows = Discrete::new(&sums);
    let (width, height) = (WIDTH as u32, HEIGHT as u32);
    let row_cdf = |row: u32| rows.0[row as usize];
    let column_cdf = |row: u32, column: u32| columns[row as usize].0[column as usize];
    let sample = |i: u64| {
        let words = words(i, 91);
        sample_table_2d([words[0], words[1]], width, height, row_cdf, column_cdf)
    };
    // position in the unit square, on a grid finer than the table's
    let cell = |i: u64| {
        let s = sample(i);
        let part = |cell: u32, fraction: f32| cell as usize * PARTS + ((fraction * PARTS as f32) as usize);
        part(s.cell[1], s.fraction.y) * WIDTH * PARTS + part(s.cell[0], s.fraction.x)
    };
    let total: f64 = sums.iter().sum();
    let expected = |cell: usize| {
        let (column, row) = (cell % (WIDTH * PARTS) / PARTS, cell / (WIDTH * PARTS) / PARTS);
        luminance(column, row) / total * DRAWS as f64 / (PARTS * PARTS) as f64
    };
    let mut family = family("table");
    let counts = histogram(WIDTH * HEIGHT * PARTS * PARTS, DRAWS, cell).into_iter().enumerate();
    family.chi_square("unit square", counts.map(|(i, count)| (count, expected(i))));
    let mut integral = 0.0;
    for (row, columns) in columns.iter().enumerate() {
        for column in 0..WIDTH {
            let p = table_2d_probability([column as u32, row as u32], width, height, row_cdf, column_cdf);
            let exact = rows.probability(row) * columns.probability(column);
            ensure((f64::from(p) - exact).abs() <= 3.0 * ROUNDING * exact, || format!("({column}, {row}): {p}"))?;
            integral += f64::from(table_2d_pdf(p, width, height)) / (WIDTH * HEIGHT) as f64;
        }
    }
    ensure((integral - 1.0).abs() <= 4.0 * ROUNDING, || format!("the density integrates to {integral}"))?;
    for i in 0..10_000 {
        let s = sample(i);
        let p = table_2d_probability(s.cell, width, height, row_cdf, column_cdf);
        ensure(p == s.probability, || format!("{:?} is drawn with {}, stated as {p}", s.cell, s.probability))?;
        let back = invert_table_2d(s.cell, s.fraction, width, height, row_cdf, column_cdf);
        let again = sample_table_2d(back, width, height, row_cdf, column_cdf);
        let moved = (again.fraction - s.fraction).abs();
        let near = again.cell == s.cell && f64::from(moved.max_element()) <= 4.0 * ROUNDING;
        ensure(near, || format!("{s:?} comes back as {again:?}"))?;
    }
    report(&family)
}

pub(crate) fn discrete_inverts() -> Result<(), Failed> {
    for (number, weights) in weights().iter().enumerate() {
        let list = Discrete::new(weights);
        let ends = list.0.iter().flat_map(|&bound| [bound, bound.wrapping_sub(1)]);
        for word in ends.chain((0..DRAWS / 8).map(|i| words(i, 97)[0])) {
            let Cell { index, fraction, .. } = list.sample(word);
            let back = list.invert(index, fraction);
            // above 2^23 words three roundings of 2^-24 of the item show
            let size = list.size(index as usize);
            let slack = if size > 1 << 23 { size >> 22 } else { 0 };
            ensure(u64::from(word.abs_diff(back)) <= slack, || format!("list {number}: {word} comes back as {back}"))?;
            ensure(list.sample(back).index == index, || format!("list {number}: {word} comes back in another item"))?;
        }
        for index in (0..list.count()).filter(|&i| list.size(i as usize) > 0) {
            for fraction in [0.0, f32::MIN_POSITIVE, 1.0 - ROUNDING as f32, 1.0, f32::NAN] {
                let found = list.sample(list.invert(index, fraction)).index;
                ensure(found == index, || format!("list {number}: {fraction} of item {index} is in item {found}"))?;
            }
        }
    }
    Ok(())
}
