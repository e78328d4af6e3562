//! One of several samples.

use super::source::Scalar;
use super::weighted::Weighted;
use core::marker::PhantomData;

/// One of several samples that have the same source and are given the same, by a target that sees the sample alone: resampled importance sampling
/// (Talbot et al. 2005) with everything conditioned by `Z`.
#[derive(Clone, Copy, Debug)]
pub struct Choice<X, W, R, Z, F> {
    chosen: Option<(X, W)>,
    sum: W,
    target: F,
    drawn: PhantomData<(R, Z)>,
}

impl<X: Copy, W: Scalar, R, Z, F: Fn(&X) -> W> Choice<X, W, R, Z, F> {
    /// Of nothing yet.
    #[inline(always)]
    pub fn new(target: F) -> Self {
        Self { chosen: None, sum: W::ZERO, target, drawn: PhantomData }
    }

    /// Offers a sample with the weight `mis` of multiple importance sampling. `keep` is told with which probability it has to take the place
    /// of what was chosen before.
    #[inline(always)]
    pub fn offer(&mut self, sample: &Weighted<X, W, R, Z>, mis: W, keep: impl FnOnce(W) -> bool) {
        let (value, target) = (sample.value(), (self.target)(&sample.value()));
        let weight = mis * target * sample.weight();
        if weight > W::ZERO {
            self.sum = self.sum + weight;
            if keep(weight.over(self.sum)) {
                self.chosen = Some((value, target));
            }
        }
    }

    /// The chosen one, and its contribution weight; none if all weights were zero.
    #[inline(always)]
    pub fn finish(self) -> Option<Weighted<X, W, R, Z>> {
        self.chosen.map(|(value, target)| Weighted::of(value, self.sum.over(target)))
    }
}

/// The balance heuristic of two: the density of the technique that made a sample, and that of the other one. 0 of nothing.
#[inline(always)]
pub fn balance<W: Scalar>(own: W, other: W) -> W {
    if own > W::ZERO { own.over(own + other) } else { W::ZERO }
}
