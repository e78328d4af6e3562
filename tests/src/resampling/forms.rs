//! One combine, by the library's forms and by those that were printed wrong.

use restir_shared::num::Scalar;
use restir_shared::resample::mis::{Combine, INPUTS, Mis};
use restir_shared::resample::reservoir::Reservoir;
use std::fmt::Debug;

/// A number in which a combine is computed.
pub trait Real: Scalar + Debug + Into<f64> + Send + Sync {
    /// The nearest one.
    fn of(x: f64) -> Self;
}

impl Real for f32 {
    fn of(x: f64) -> Self {
        x as f32
    }
}

impl Real for f64 {
    fn of(x: f64) -> Self {
        x
    }
}

/// An input of a combine, the canonical one first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<T> {
    /// M_i.
    pub confidence: T,
    /// p(y_i) W_i, p being the canonical pixel's target, times the Jacobian of the shift.
    pub contribution: T,
}

/// A way to combine reservoirs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The library's.
    Library(Mis),
    /// Contribution MIS as Algorithm 1 of Bitterli et al.'s supplement prints it: the sum of the targets lacks M.
    LiteralContribution,
    /// Talbot's as Algorithm 2 prints it: the weights lack M, the sum is divided by S.
    LiteralTalbot,
}

impl Form {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 11] = [
        Self::Library(Mis::ONE_OVER_M),
        Self::Library(Mis::CONSTANT),
        Self::Library(Mis::ONE_OVER_Z),
        Self::LiteralContribution,
        Self::Library(Mis::CONTRIBUTION),
        Self::LiteralTalbot,
        Self::Library(Mis::TALBOT),
        Self::Library(Mis::PAIRWISE_COUNTED),
        Self::Library(Mis::PAIRWISE),
        Self::Library(Mis::PAIRWISE_DEFENSIVE),
        Self::Library(Mis::PAIRWISE_COUNTED_DEFENSIVE),
    ];

    /// What tables call it.
    pub fn name(self) -> &'static str {
        /// In the order of [`Form::ALL`].
        const NAMES: [&str; 11] = [
            "1/M",
            "constant",
            "1/Z",
            "Alg. 1 literal",
            "contribution",
            "Alg. 2 literal",
            "Talbot",
            "pairwise, counted",
            "pairwise",
            "pairwise, defensive",
            "pairwise, counted, defensive",
        ];
        Self::ALL.iter().position(|form| *form == self).map_or("unknown", |form| NAMES[form])
    }

    /// Whether it is one of those that were printed wrong.
    pub fn is_literal(self) -> bool {
        !matches!(self, Self::Library(_))
    }

    /// Combines the inputs; `a(receiver, sample)` is the target of an input's pixel for another input's sample, `u` gives
    /// uniform numbers in [0, 1), one for each input. All of the neighbours asked for are there.
    pub fn combine<T: Real>(
        self,
        inputs: &[Input<T>],
        a: impl Fn(usize, usize) -> T,
        u: impl FnMut() -> T,
    ) -> Combined<T> {
        let k = inputs.len();
        match self {
            Self::Library(mis) => library(mis, inputs, a, u),
            Self::LiteralContribution => {
                let weight = |i: usize| inputs[i].confidence * inputs[i].contribution;
                let share = |s: usize| a(s, s).over(sum(k, |j| a(j, s)));
                Combined::select(inputs, weight, share, u)
            }
            Self::LiteralTalbot => {
                let m = |i: usize| a(i, i).over(sum(k, |j| a(j, i)).over(T::of(k as f64)));
                let weight = |i: usize| m(i) * inputs[i].confidence * inputs[i].contribution;
                let share = |_| T::ONE.over(sum(k, |j| inputs[j].confidence));
                Combined::select(inputs, weight, share, u)
            }
        }
    }
}

/// What a combine came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined<T> {
    /// The weight by which each input was selected.
    pub weights: [T; INPUTS],
    /// The input selected, the sum of the weights and of the confidence.
    pub reservoir: Reservoir<usize, T>,
    /// What the sum of the weights is multiplied by.
    pub share: T,
}

impl<T: Real> Combined<T> {
    fn select(
        inputs: &[Input<T>],
        weight: impl Fn(usize) -> T,
        share: impl FnOnce(usize) -> T,
        mut u: impl FnMut() -> T,
    ) -> Self {
        let mut weights = [T::ZERO; INPUTS];
        let mut reservoir = Reservoir::empty(0);
        for (i, input) in inputs.iter().enumerate() {
            weights[i] = weight(i);
            reservoir.update(i, weights[i], input.confidence, u());
        }
        Self { weights, reservoir, share: share(reservoir.sample) }
    }

    /// The mean of a value of the inputs, weighted as they were for the selection (Tokuyoshi, eq. 4); zero if nothing was
    /// selected.
    pub fn average(&self, inputs: usize, value: impl Fn(usize) -> T) -> T {
        let sum = sum(inputs, |i| self.weights[i] * value(i));
        if self.reservoir.weight_sum > T::ZERO { sum.over(self.reservoir.weight_sum) } else { T::ZERO }
    }
}

fn library<T: Real>(mis: Mis, inputs: &[Input<T>], a: impl Fn(usize, usize) -> T, u: impl FnMut() -> T) -> Combined<T> {
    let combine = weighed(mis, inputs.len() - 1, inputs, &a);
    Combined::select(inputs, |i| combine.weight(i as u32), |source| share(mis, combine, inputs.len(), source, &a), u)
}

/// The library's combine of inputs, with the targets that it asks for, of as many neighbours as were requested.
pub fn weighed<T: Real>(mis: Mis, requested: usize, inputs: &[Input<T>], a: impl Fn(usize, usize) -> T) -> Combine<T> {
    let mut combine = Combine::new(mis, T::of(requested as f64));
    inputs.iter().for_each(|input| combine.input(input.confidence, input.contribution));
    for (sample, receiver) in (0..inputs.len()).flat_map(|i| (0..inputs.len()).map(move |j| (i, j))) {
        if mis.asks_for(receiver as u32, sample as u32) {
            combine.target(receiver as u32, sample as u32, a(receiver, sample));
        }
    }
    combine
}

/// What the sum of the weights is multiplied by if a combine of `k` inputs selects one of them.
pub fn share<T: Real>(mis: Mis, mut combine: Combine<T>, k: usize, source: usize, a: impl Fn(usize, usize) -> T) -> T {
    if mis.asks_for_selected() {
        (0..k).for_each(|j| combine.selected_target(j as u32, source as u32, a(j, source)));
    }
    combine.share()
}

fn sum<T: Real>(count: usize, term: impl Fn(usize) -> T) -> T {
    (0..count).fold(T::ZERO, |sum, i| sum + term(i))
}
