//! Multiple importance sampling among reservoirs: how the inputs of a combine share what several of them can produce.
//!
//! Input 0 is canonical: the reservoir of the pixel that combines, which can produce everything that the pixel wants.
//! Every form obeys one contract: for any sample y with a_0(y) > 0, the weights of all inputs that can produce y sum to one
//! (for any other y to no more, which is all that a sample asks for that the pixel does not want). Two ways of applying a
//! weight have the same mean and different noise:
//!
//! * **inside**: `w_i = m_i(y_i) p(y_i) W_i`, and the result's contribution weight is `sum w / p(y)`;
//! * **after the selection** (Bitterli et al. 2020): `w_i = M_i p(y_i) W_i`, and it is `m(y) sum w / p(y)`, where
//!   `sum_i M_i m_i(y) = 1`.
//!
//! `a_j(y)` is the target of input j's pixel for the sample y, times its visibility there if the reservoirs lack what is
//! occluded; it must be zero exactly where input j cannot produce y. M are confidence weights, zero or from 2^-20 to 2^20,
//! M_0 > 0, and S is their sum. An input of confidence zero is as if it were not there.
//!
//! | form | weight | applied | asks for |
//! |---|---|---|---|
//! | [`Mis::ONE_OVER_M`] | 1 / S; biased where inputs differ in what they can produce | after | nothing |
//! | [`Mis::ONE_OVER_Z`] | 1 / sum of the M_j with a_j(y) > 0, zero for a_s(y) = 0 | after | a_j of the selected sample |
//! | [`Mis::CONTRIBUTION`] | a_s(y) / sum M_j a_j(y), s being where y comes from | after | a_j of the selected sample |
//! | [`Mis::TALBOT`] | M_i a_i(y) / sum M_j a_j(y) (generalised balance heuristic) | inside | all a_j(y_i) |
//! | [`Mis::PAIRWISE`] | C = S - M_0: `(M_i / C) C a_i / (C a_i + M_0 a_0)`, of the canonical the sum of the complements | inside | a_i(y_i), a_i(y_0) |
//! | [`Mis::PAIRWISE_COUNTED`] | as pairwise, with equal pairs, in which input i has the weight K M_i, K being the number of neighbours asked for (Bitterli 2022, eq. 9.10) | inside | a_i(y_i), a_i(y_0) |
//! | [`Mis::CONSTANT`] | M_i / S; biased unless all inputs can produce the same | inside | nothing |
//!
//! [`Mis::DEFENSIVE`] with a pairwise form gives the canonical input a share of its own, as of one more pair: `M_0 / S`,
//! the pairs keeping the rest.
//!
//! The formulas printed in the supplement of Bitterli et al. 2020 leave M out of the sum in contribution MIS, which is M
//! times too bright, and out of Talbot's weights, which is biased for unequal M.
//!
//! Two inputs that can both produce a sample, by the generalised balance heuristic:
//!
//! ```
//! use restir_shared::resample::mis::{Combine, Mis};
//!
//! // the same sample in two reservoirs, of the confidence 1 and 3; its target is 2 at the first pixel and 4 at the second one
//! let mut combine = Combine::new(Mis::TALBOT, 1.0);
//! combine.input(1.0, 1.0_f64);
//! combine.input(3.0, 1.0);
//! for receiver in [0, 1] {
//!     for sample in [0, 1] {
//!         assert!(Mis::TALBOT.asks_for(receiver, sample));
//!         combine.target(receiver, sample, [2.0, 4.0][receiver as usize]);
//!     }
//! }
//! // M_i a_i / (M_0 a_0 + M_1 a_1), which is one in sum; nothing is left to do after the selection
//! assert_eq!((combine.weight(0), combine.weight(1)), (1.0 * 2.0 / 14.0, 3.0 * 4.0 / 14.0));
//! assert_eq!(combine.share(), 1.0);
//! ```

use crate::num::Scalar;

/// The most inputs of a combine, the canonical one included.
#[doc(hidden)]
pub const INPUTS: usize = 9;

/// A form of the weights. Each has a bit, and the defensive ones [`Mis::DEFENSIVE`], too: a driver that knows which bits are zero
/// drops what the other forms need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mis(u32);

impl Mis {
    /// See the module's table.
    pub const ONE_OVER_M: Self = Self(1);
    /// See the module's table.
    pub const ONE_OVER_Z: Self = Self(1 << 1);
    /// See the module's table.
    pub const CONTRIBUTION: Self = Self(1 << 2);
    /// See the module's table.
    pub const TALBOT: Self = Self(1 << 3);
    /// See the module's table.
    pub const PAIRWISE: Self = Self(1 << 4);
    /// See the module's table.
    pub const PAIRWISE_COUNTED: Self = Self(1 << 5);
    /// See the module's table.
    pub const CONSTANT: Self = Self(1 << 6);
    /// The canonical input of a pairwise form has a share of its own.
    pub const DEFENSIVE: Self = Self(1 << 7);
    /// [`Self::PAIRWISE`] with [`Self::DEFENSIVE`].
    pub const PAIRWISE_DEFENSIVE: Self = Self(Self::PAIRWISE.0 | Self::DEFENSIVE.0);
    /// [`Self::PAIRWISE_COUNTED`] with [`Self::DEFENSIVE`].
    pub const PAIRWISE_COUNTED_DEFENSIVE: Self = Self(Self::PAIRWISE_COUNTED.0 | Self::DEFENSIVE.0);

    /// Every form, and its name in settings.
    pub const NAMED: [(&'static str, Self); 9] = [
        ("1/m", Self::ONE_OVER_M),
        ("1/z", Self::ONE_OVER_Z),
        ("contribution", Self::CONTRIBUTION),
        ("talbot", Self::TALBOT),
        ("pairwise", Self::PAIRWISE),
        ("pairwise-defensive", Self::PAIRWISE_DEFENSIVE),
        ("pairwise-counted", Self::PAIRWISE_COUNTED),
        ("pairwise-counted-defensive", Self::PAIRWISE_COUNTED_DEFENSIVE),
        ("constant", Self::CONSTANT),
    ];

    /// The form in the lowest 8 bits of a word, whatever the others are.
    #[doc(hidden)]
    #[inline(always)]
    pub const fn from_bits(word: u32) -> Self {
        Self(word & 0xff)
    }

    /// The inverse of [`Self::from_bits`].
    #[doc(hidden)]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether it is another form, or has [`Self::DEFENSIVE`], if that is the other one.
    #[doc(hidden)]
    #[inline(always)]
    pub const fn is(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether it is one of the pairwise forms.
    #[inline(always)]
    pub(crate) const fn is_pairwise(self) -> bool {
        self.is(Self::PAIRWISE) | self.is(Self::PAIRWISE_COUNTED)
    }

    /// Whether the weight is applied after the selection.
    #[doc(hidden)]
    #[inline(always)]
    pub const fn is_after_selection(self) -> bool {
        self.is(Self::ONE_OVER_M) | self.asks_for_selected()
    }

    /// Whether it asks for the targets a_j of the selected sample at all inputs.
    #[doc(hidden)]
    #[inline(always)]
    pub const fn asks_for_selected(self) -> bool {
        self.is(Self::ONE_OVER_Z) | self.is(Self::CONTRIBUTION)
    }

    /// Whether it asks, before the selection, for targets at other inputs than the canonical one.
    #[doc(hidden)]
    #[inline(always)]
    pub(crate) const fn asks_for_pairs(self) -> bool {
        self.is(Self::TALBOT) | self.is_pairwise()
    }

    /// Whether it asks for the target of a sample at an input that is neither the canonical one nor where the sample is from.
    #[doc(hidden)]
    #[cfg(not(target_arch = "spirv"))]
    #[inline(always)]
    pub(crate) const fn asks_for_third(self) -> bool {
        self.is(Self::TALBOT) | self.asks_for_selected()
    }

    /// Whether it asks, before the selection, for the target of input `sample`'s sample at input `receiver`.
    #[doc(hidden)]
    #[inline(always)]
    pub fn asks_for(self, receiver: u32, sample: u32) -> bool {
        let pair = (receiver == sample) | (sample == 0) | (receiver == 0);
        self.is(Self::TALBOT) | (self.is_pairwise() & pair)
    }
}

/// What is known of an input.
#[derive(Clone, Copy, Debug)]
struct Terms<T> {
    /// M_i.
    confidence: T,
    /// p(y_i) W_i.
    contribution: T,
    /// a_0(y_i).
    at_canonical: T,
    /// a_i(y_i).
    at_source: T,
    /// Talbot: sum of M_j a_j(y_i); pairwise: a_i(y_0).
    other: T,
    /// Makes all inputs together larger than 256 bytes: RADV keeps a smaller array in registers, and chooses its elements by branches.
    _room: [T; 3],
}

const _: () = assert!(size_of::<[Terms<f32>; INPUTS]>() > 256);

impl<T: Scalar> Terms<T> {
    const NONE: Self = Self {
        confidence: T::ZERO,
        contribution: T::ZERO,
        at_canonical: T::ZERO,
        at_source: T::ZERO,
        other: T::ZERO,
        _room: [T::ZERO; 3],
    };
}

/// Up to [`INPUTS`] inputs on their way to one.
///
/// First [`Self::input`] for each, then [`Self::target`] for each pair that the form asks for, then [`Self::weight`] of
/// each, to select by. Forms after the selection are told a_j of the selected sample by [`Self::selected_target`], and
/// [`Self::share`] is what their weight sum is multiplied by.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Combine<T> {
    form: Mis,
    count: u32,
    /// K of the counted pairs.
    requested: T,
    /// The sum of the inputs' confidences.
    confidence_sum: T,
    /// C; of counted pairs the number of neighbours that stand for anything.
    neighbours: T,
    inputs: [Terms<T>; INPUTS],
    /// The selected sample's density at its source, a_s, and the sum that its form divides by.
    selected: [T; 2],
}

impl<T: Scalar> Combine<T> {
    /// No input yet. `requested` is the number of neighbours asked for, of which some may be missing.
    #[inline(always)]
    pub fn new(form: Mis, requested: T) -> Self {
        Self {
            form,
            count: 0,
            requested,
            confidence_sum: T::ZERO,
            neighbours: T::ZERO,
            inputs: [Terms::NONE; INPUTS],
            selected: [T::ZERO; 2],
        }
    }

    /// The next input, the canonical one first: its confidence weight and p(y_i) W_i, p being the canonical pixel's target,
    /// W_i the contribution weight, times the Jacobian if the sample had to be shifted.
    #[inline(always)]
    pub fn input(&mut self, confidence: T, contribution: T) {
        let at = self.count as usize;
        self.inputs[at].confidence = confidence;
        self.inputs[at].contribution = contribution.within_range();
        if at > 0 {
            self.neighbours = self.neighbours + self.pair(confidence);
        }
        self.confidence_sum = self.confidence_sum + confidence;
        self.count = self.count.wrapping_add(1);
    }

    /// a_receiver(y_sample), for a pair that [`Mis::asks_for`].
    #[inline(always)]
    pub fn target(&mut self, receiver: u32, sample: u32, a: T) {
        let i = sample as usize;
        let a = a.within_range();
        if receiver == 0 {
            self.inputs[i].at_canonical = a;
        }
        if receiver == sample {
            self.inputs[i].at_source = a;
        }
        if self.form.is(Mis::TALBOT) {
            self.inputs[i].other = self.inputs[i].other + self.inputs[receiver as usize].confidence * a;
        } else if sample == 0 {
            self.inputs[receiver as usize].other = a;
        }
    }

    /// a_receiver of the selected sample, which comes from input `source`.
    #[inline(always)]
    pub fn selected_target(&mut self, receiver: u32, source: u32, a: T) {
        let a = a.within_range();
        if receiver == source {
            self.selected[0] = a;
        }
        let confidence = self.inputs[receiver as usize].confidence;
        let part = if self.form.is(Mis::CONTRIBUTION) {
            confidence * a
        } else if a > T::ZERO {
            confidence
        } else {
            T::ZERO
        };
        self.selected[1] = self.selected[1] + part;
    }

    /// S.
    #[inline(always)]
    pub fn confidence(&self) -> T {
        self.confidence_sum
    }

    /// The weight with which the input is selected.
    #[inline(always)]
    pub fn weight(&self, input: u32) -> T {
        let i = input as usize;
        let m = if self.form.is_after_selection() {
            self.inputs[i].confidence
        } else if self.form.is(Mis::CONSTANT) {
            ratio(self.inputs[i].confidence, self.confidence_sum)
        } else if self.form.is(Mis::TALBOT) {
            ratio(self.inputs[i].confidence * self.inputs[i].at_source, self.inputs[i].other)
        } else if input == 0 {
            self.canonical_share()
        } else {
            self.pair_of(i).of_neighbour(self.inputs[i].at_source, self.inputs[i].at_canonical)
        };
        (m * self.inputs[i].contribution).within_range()
    }

    /// What the sum of the weights is multiplied by, once the selected sample's targets are known.
    #[inline(always)]
    pub fn share(&self) -> T {
        // an input can hold what a_s says that it cannot produce: what its neighbours saw and it does not
        let produced = self.form.is(Mis::ONE_OVER_M) | (self.selected[0] > T::ZERO);
        let numerator = if self.form.is(Mis::CONTRIBUTION) {
            self.selected[0]
        } else if produced {
            T::ONE
        } else {
            T::ZERO
        };
        let divisor = if self.form.is(Mis::ONE_OVER_M) { self.confidence_sum } else { self.selected[1] };
        if self.form.is_after_selection() { ratio(numerator, divisor) } else { T::ONE }
    }

    /// The canonical input's weight in a pairwise form: in each pair what the neighbour leaves, and its own share.
    #[inline(always)]
    fn canonical_share(&self) -> T {
        let all = self.neighbours;
        let mut share = if all > T::ZERO { fraction(self.canonical_pair(), all) } else { T::ONE };
        let mut i = 1;
        while i < self.count as usize {
            share = share + self.pair_of(i).of_canonical(self.inputs[0].at_canonical, self.inputs[i].other);
            i += 1;
        }
        share
    }

    /// What the canonical input's own share is in proportion to.
    #[inline(always)]
    fn canonical_pair(&self) -> T {
        if !self.form.is(Mis::DEFENSIVE) {
            T::ZERO
        } else if self.form.is(Mis::PAIRWISE_COUNTED) {
            T::ONE
        } else {
            self.inputs[0].confidence
        }
    }

    /// Input i and the canonical one.
    #[inline(always)]
    fn pair_of(&self, i: usize) -> Pair<T> {
        Pair {
            share: ratio(self.pair(self.inputs[i].confidence), self.neighbours + self.canonical_pair()),
            neighbour: self.neighbour_confidence(i),
            canonical: self.inputs[0].confidence,
        }
    }

    /// What the share of the pair of a neighbour with the given confidence is in proportion to.
    #[inline(always)]
    fn pair(&self, confidence: T) -> T {
        if !self.form.is(Mis::PAIRWISE_COUNTED) {
            confidence
        } else if confidence > T::ZERO {
            T::ONE
        } else {
            T::ZERO
        }
    }

    /// What multiplies a neighbour's target against the canonical one's.
    #[inline(always)]
    fn neighbour_confidence(&self, i: usize) -> T {
        if self.form.is(Mis::PAIRWISE_COUNTED) { self.requested * self.inputs[i].confidence } else { self.neighbours }
    }
}

/// A neighbour and the canonical input in a pairwise form: the balance heuristic between the two, of which the pair has a
/// share.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Pair<T> {
    share: T,
    /// What multiplies the neighbour's target.
    neighbour: T,
    /// What multiplies the canonical one's.
    canonical: T,
}

impl<T: Scalar> Pair<T> {
    /// A pair of [`Mis::PAIRWISE`]: of a neighbour of that confidence, one of neighbours whose confidence is `all` in sum.
    #[inline(always)]
    pub fn new(confidence: T, all: T, canonical: T) -> Self {
        Self { share: ratio(confidence, all), neighbour: all, canonical }
    }

    /// The weight of the neighbour's sample y, from `neighbour` = a_i(y) and `canonical` = a_0(y).
    #[inline(always)]
    pub fn of_neighbour(&self, neighbour: T, canonical: T) -> T {
        self.share * fraction(self.neighbour * neighbour, self.canonical * canonical)
    }

    /// What the pair gives to the weight of the canonical sample y, from a_0(y) and a_i(y).
    #[inline(always)]
    pub fn of_canonical(&self, canonical: T, neighbour: T) -> T {
        self.share * fraction(self.canonical * canonical, self.neighbour * neighbour)
    }
}

/// `a / (a + b)`, zero for a = 0.
#[inline(always)]
fn fraction<T: Scalar>(a: T, b: T) -> T {
    ratio(a, a + b)
}

/// `a / b`, zero for a = 0 and for b = 0, [within the range](Scalar::within_range) of weights: a device gives zero for a
/// quotient that is not a normal number.
#[inline(always)]
fn ratio<T: Scalar>(a: T, b: T) -> T {
    if (a > T::ZERO) & (b > T::ZERO) { a.over(b).within_range() } else { T::ZERO }
}
