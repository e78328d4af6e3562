//! Samples with contribution weights.

use super::source::{Apart, Scalar, Source};
use core::marker::PhantomData;

/// A sample, and its contribution weight given `Z`, drawn by the random numbers of `R`.
#[derive(Clone, Copy, Debug)]
pub struct Weighted<X, W, R, Z = ()> {
    value: X,
    weight: W,
    drawn: PhantomData<(R, Z)>,
}

/// A sample that `R` drew, under which others are drawn. It may be one of several that were chosen from: then all of these are given.
#[derive(Clone, Copy, Debug)]
pub struct Given<X, R> {
    value: X,
    drawn: PhantomData<R>,
}

impl<X: Copy, W: Scalar, R: Source> Weighted<X, W, R> {
    /// A sample, given nothing; the weight may be one over its density.
    #[inline(always)]
    pub fn new(value: X, weight: W) -> Self {
        Self::of(value, weight)
    }

    /// What others can be drawn under.
    #[inline(always)]
    pub fn given(&self) -> Given<X, R> {
        Given { value: self.value, drawn: PhantomData }
    }

    /// This and what was drawn under it (theorem 4.1).
    #[inline(always)]
    pub fn with<Y: Copy, T: Apart<R>>(&self, other: &Weighted<Y, W, T, Given<X, R>>) -> Weighted<(X, Y), W, (R, T)> {
        Weighted::of((self.value, other.value), self.weight * other.weight)
    }
}

impl<X: Copy, W: Scalar, R, Z> Weighted<X, W, R, Z> {
    #[inline(always)]
    pub(super) fn of(value: X, weight: W) -> Self {
        Self { value, weight, drawn: PhantomData }
    }

    /// The sample.
    #[inline(always)]
    pub fn value(&self) -> X {
        self.value
    }

    /// Its weight.
    #[inline(always)]
    pub fn weight(&self) -> W {
        self.weight
    }
}

impl<X: Copy, R: Source> Given<X, R> {
    /// The sample.
    #[inline(always)]
    pub fn value(&self) -> X {
        self.value
    }

    /// What `T` drew under it.
    #[inline(always)]
    pub fn draw<Y: Copy, T: Apart<R>, W: Scalar>(&self, value: Y, weight: W) -> Weighted<Y, W, T, Self> {
        Weighted::of(value, weight)
    }

    /// What was drawn under another one of the same source; where it is now, and the Jacobian of the shift that took it there, if it has a place.
    #[inline(always)]
    pub fn take<Y: Copy, W: Scalar, T: Apart<R>>(
        &self,
        other: &Weighted<Y, W, T, Self>,
        shift: impl FnOnce(&Y) -> Option<(Y, W)>,
    ) -> Option<Weighted<Y, W, T, Self>> {
        shift(&other.value).map(|(value, jacobian)| Weighted::of(value, other.weight * jacobian))
    }

    /// As [`Self::take`], of another source: this sample is independent of that one, and of what was drawn under it.
    #[inline(always)]
    pub fn borrow<Y: Copy, W: Scalar, T, X2: Copy, R2>(
        &self,
        other: &Weighted<Y, W, T, Given<X2, R2>>,
        shift: impl FnOnce(&Y) -> Option<(Y, W)>,
    ) -> Option<Weighted<Y, W, T, Self>>
    where
        T: Apart<R>,
        R: Apart<R2>,
    {
        shift(&other.value).map(|(value, jacobian)| Weighted::of(value, other.weight * jacobian))
    }
}
