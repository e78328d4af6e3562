//! The streaming reservoir: one sample out of many, kept in proportion to its weight (Chao 1982; Bitterli et al. 2020,
//! Algorithm 2).
//!
//! ```
//! use restir_shared::resample::reservoir::Reservoir;
//! use restir_shared::rng::{Rng, Sampler, unit};
//!
//! // 32 uniform candidates x in [0, 1), of which one is kept in proportion to the target x: what resampled importance sampling does
//! let estimate = |pixel: u32| {
//!     let mut reservoir = Reservoir::empty(0.0_f32);
//!     for candidate in 0..32 {
//!         let words = Rng::new(pixel, 0, 0, 7, Sampler::Independent).hash(candidate);
//!         let x = unit(words.x);
//!         reservoir.update(x, x, 1.0, unit(words.y));
//!     }
//!     // the contribution weight stands for 1 / density of the sample that was kept
//!     let x = reservoir.sample;
//!     x * x * reservoir.contribution_weight(1.0 / reservoir.confidence, x)
//! };
//!
//! // the mean of f(x) times that weight is the integral of f, for any f that is zero where the target is: here x², of 1/3
//! let mean = (0..2000).map(estimate).sum::<f32>() / 2000.0;
//! assert!((mean - 1.0 / 3.0).abs() < 0.02);
//! ```

use crate::num::Scalar;

/// A sample kept from a stream of weighted ones, of any type `S`, with weights of type `T`.
///
/// Merging is updating with another reservoir's sample, weight sum and confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reservoir<S, T> {
    /// The sample kept; what the reservoir began with, while the sum is zero.
    pub sample: S,
    /// Sum of the weights streamed so far.
    pub weight_sum: T,
    /// Confidence weight: how many candidates the sample stands for.
    pub confidence: T,
}

impl<S: Copy, T: Scalar> Reservoir<S, T> {
    /// Nothing streamed yet; `sample` stands in for none.
    #[inline(always)]
    pub fn empty(sample: S) -> Self {
        Self { sample, weight_sum: T::ZERO, confidence: T::ZERO }
    }

    /// Streams one sample with its weight >= 0; `u` in [0, 1) decides, with probability weight / sum, whether it is kept.
    /// Says whether it was. A weight of zero never is, the first one above zero always.
    ///
    /// Weights are taken [within their range](Scalar::within_range), so that the sum of 2^27 of them is finite, and the
    /// first is kept in spite of rounding.
    #[inline(always)]
    pub fn update(&mut self, sample: S, weight: T, confidence: T, u: T) -> bool {
        let weight = weight.within_range();
        self.weight_sum = self.weight_sum + weight;
        self.confidence = self.confidence + confidence;
        let kept = u * self.weight_sum < weight;
        if kept {
            self.sample = sample;
        }
        kept
    }

    /// The unbiased contribution weight of the sample kept, an estimate of 1 / its density: `share` times the sum over the
    /// sample's target, zero if either is (Bitterli et al. 2020, eq. 6; Lin et al. 2022, eq. 22).
    ///
    /// Multiplied and divided one after the other: the product of share and target may leave the range.
    #[inline(always)]
    pub fn contribution_weight(&self, share: T, target: T) -> T {
        if (self.weight_sum > T::ZERO) & (target > T::ZERO) {
            (share * self.weight_sum).within_range().over(target).within_range()
        } else {
            T::ZERO
        }
    }
}
