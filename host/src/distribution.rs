//! Integer distribution functions for [`restir_shared::sampling::sample_discrete`], made of weights.
//!
//! ```
//! use restir_host::distribution::integer_cdf;
//! use restir_shared::sampling::{discrete_probability, sample_discrete};
//!
//! // three lights, the second of which is dark
//! let bounds = integer_cdf(&[1.0, 0.0, 3.0]);
//! let of = |light: u32| discrete_probability(light, 3, |i| bounds[i as usize]);
//! assert_eq!([of(0), of(1), of(2)], [0.25, 0.0, 0.75]);
//!
//! let chosen = sample_discrete(1 << 31, 3, |i| bounds[i as usize]);
//! assert_eq!(chosen.index, 2);
//! ```

/// Counts to distribute: 2^32 less one, which the last item with a weight gets besides, because a bound of
/// [`restir_shared::sampling::CDF_END`] stands for 2^32.
const COUNTS: f64 = 4_294_967_295.0;

/// The lower bounds of items with the given weights, which are not negative and have a finite sum; fewer than 2^31 of them are
/// positive. Each of those gets at least one of the 2^32 words; the others never are drawn. Probabilities are off by at
/// most two words, and by one word for each positive weight in proportion. Without any positive weight all items are
/// equal: that is the row of a table that is never chosen.
pub fn integer_cdf(weights: &[f64]) -> Vec<u32> {
    let total: f64 = weights.iter().sum();
    if total == 0.0 && !weights.is_empty() {
        return integer_cdf(&vec![1.0; weights.len()]);
    }
    let positive = weights.iter().filter(|&&w| w > 0.0).count() as f64;
    let (mut items, mut sum) = (0.0, 0.0);
    let bound = |&weight: &f64| {
        // one word for each item before, the rest in proportion
        let bound = items + ((COUNTS - positive) * (sum / total)).floor();
        items += f64::from(u8::from(weight > 0.0));
        sum += weight;
        bound as u32
    };
    weights.iter().map(bound).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use restir_shared::sampling::{CDF_END, discrete_probability, sample_discrete};

    fn probabilities(cdf: &[u32]) -> Vec<f64> {
        let count = cdf.len() as u32;
        (0..count).map(|i| f64::from(discrete_probability(i, count, |i| cdf[i as usize]))).collect()
    }

    #[test]
    fn probabilities_follow_the_weights() {
        let weights = [1.0, 2.0, 1.0e-3, 7.5, 7.5, 1.0e-3, 100.0];
        let total: f64 = weights.iter().sum();
        for (p, w) in probabilities(&integer_cdf(&weights)).iter().zip(weights) {
            // words, and the rounding of the probability
            let error = (weights.len() as f64 + 2.0) / 4_294_967_296.0 + p / 16_777_216.0;
            assert!((p - w / total).abs() <= error, "{p} for {w}");
        }
    }

    #[test]
    fn every_positive_weight_is_drawn_and_no_other() {
        for weights in [
            vec![0.0, 0.0, 1.0e-300, 1.0, 0.0, 1.0e-20, 0.0],
            vec![1.0, 1.0e-30],
            vec![0.0, 1.0],
            vec![1.0, 0.0],
            vec![5.0],
            [vec![1.0e-12; 1000], vec![1.0], vec![1.0e-12; 1000], vec![0.0; 3]].concat(),
        ] {
            let cdf = integer_cdf(&weights);
            let p = probabilities(&cdf);
            for (i, (p, w)) in p.iter().zip(&weights).enumerate() {
                assert_eq!(*p > 0.0, *w > 0.0, "item {i} of {weights:?}");
            }
            assert!((p.iter().sum::<f64>() - 1.0).abs() < 1.0e-6, "{weights:?}");
            // the ends of every item are its own
            let draw = |word| sample_discrete(word, cdf.len() as u32, |i| cdf[i as usize]).index as usize;
            for word in cdf.iter().flat_map(|&bound| [bound, bound.wrapping_sub(1)]).chain([0, CDF_END]) {
                assert!(weights[draw(word)] > 0.0, "word {word} of {weights:?}");
            }
        }
    }

    #[test]
    fn without_weights_all_are_equal() {
        assert_eq!(integer_cdf(&[0.0; 4]), integer_cdf(&[1.0; 4]));
        assert!(integer_cdf(&[]).is_empty());
    }
}
