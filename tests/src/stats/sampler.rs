//! The chi-square test of a sampler against its density.

use super::Domain;
use super::quadrature::Rectangle;
use rayon::prelude::*;

/// Draws that one task makes.
const CHUNK: u64 = 1 << 14;
/// Error of an expected count: nothing against its square root, which is 2 at least.
const COUNT_ERROR: f64 = 1.0e-2;

/// A sampler's test: a grid over the coordinates of a domain.
#[derive(Clone, Copy, Debug)]
pub struct SamplerTest<D> {
    /// Where the samples lie.
    pub domain: D,
    /// Cells along each coordinate: so many that a cell is not much wider than the narrowest detail of the density.
    pub cells: [usize; 2],
    /// How many samples are drawn.
    pub draws: u64,
}

impl<D: Domain> SamplerTest<D> {
    /// The probability of each cell under a density over the domain's measure.
    pub fn probabilities(&self, pdf: impl Fn(&D::Point) -> f64 + Sync) -> Vec<f64> {
        let sides = self.cells.map(|n| 1.0 / n as f64);
        let measure = self.domain.measure();
        let density = |at| measure * pdf(&self.domain.point(at));
        (0..self.cells[0] * self.cells[1])
            .into_par_iter()
            .map(|cell| {
                let [column, row] = [cell % self.cells[0], cell / self.cells[0]];
                let corner = [column as f64 * sides[0], row as f64 * sides[1]];
                Rectangle { corner, sides }.integrate(&density, COUNT_ERROR / self.draws as f64)
            })
            .collect()
    }

    /// The integral of a density: 1, unless its sampler gives up on some samples.
    pub fn integral(&self, pdf: impl Fn(&D::Point) -> f64 + Sync) -> f64 {
        self.probabilities(pdf).iter().sum()
    }

    /// Counts and expected counts for [`super::Family::chi_square`]: of every cell, of points outside of the domain
    /// (which nobody expects), and of draws without a sample, of which the density's integral leaves the rest.
    /// `sample(index)` makes the sample with the given number.
    pub fn table(
        &self,
        sample: impl Fn(u64) -> Option<D::Point> + Sync,
        pdf: impl Fn(&D::Point) -> f64 + Sync,
    ) -> Vec<(u64, f64)> {
        let probabilities = self.probabilities(pdf);
        let (outside, none) = (probabilities.len(), probabilities.len() + 1);
        let counts = histogram(none + 1, self.draws, |index| match sample(index) {
            None => none,
            Some(point) => self.domain.coordinates(&point).map_or(outside, |at| self.cell(at)),
        });
        let draws = self.draws as f64;
        let rest = (1.0 - probabilities.iter().sum::<f64>()).max(0.0);
        let expected = probabilities.into_iter().chain([0.0, rest]).map(|p| p * draws);
        counts.into_iter().zip(expected).collect()
    }

    fn cell(&self, at: [f64; 2]) -> usize {
        let [column, row] = std::array::from_fn(|axis| {
            let cells = self.cells[axis];
            ((at[axis] * cells as f64) as usize).min(cells - 1)
        });
        row * self.cells[0] + column
    }
}

/// How many of the indices below `draws` fall into each of `cells`; `cell(index)` says into which.
pub(super) fn histogram(cells: usize, draws: u64, cell: impl Fn(u64) -> usize + Sync) -> Vec<u64> {
    let chunk = |index: u64| {
        let mut counts = vec![0; cells];
        for i in index * CHUNK..draws.min((index + 1) * CHUNK) {
            counts[cell(i)] += 1;
        }
        counts
    };
    let add = |a: Vec<u64>, b: Vec<u64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
    (0..draws.div_ceil(CHUNK)).into_par_iter().map(chunk).reduce(|| vec![0; cells], add)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;
    use crate::stats::{Line, chi_square};

    const TEST: SamplerTest<Line> = SamplerTest { domain: Line { lo: 0.0, hi: 1.0 }, cells: [32, 1], draws: 50_000 };

    #[test]
    fn what_the_density_leaves_is_expected_to_give_up() {
        let ramp = |x: &f64| 2.0 * x;
        let sample = |index: u64| Some(SplitMix::new(index).unit().sqrt());
        assert!(chi_square(TEST.table(sample, ramp)) > 1e-3);
        // half of the samples give up
        let half = |index: u64| sample(index).filter(|x| *x < 0.5_f64.sqrt());
        let cut = |x: &f64| if *x < 0.5_f64.sqrt() { ramp(x) } else { 0.0 };
        assert!(chi_square(TEST.table(half, cut)) > 1e-3);
        assert_eq!(chi_square(TEST.table(half, ramp)), 0.0);
        assert_eq!(chi_square(TEST.table(sample, cut)), 0.0);
    }

    #[test]
    fn a_sample_outside_of_the_domain_fails() {
        let stray = |index: u64| Some(if index == 7 { 1.5 } else { SplitMix::new(index).unit() });
        assert_eq!(chi_square(TEST.table(stray, |_| 1.0)), 0.0);
    }
}
