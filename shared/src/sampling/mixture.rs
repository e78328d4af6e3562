//! Mixtures of techniques that can be inverted: which technique could have given a value, and by which random numbers.
//!
//! A mixture chooses technique t with its weight a_t by a number u2, and the technique makes a value x of numbers of its own, with the
//! density p_t(x). Several techniques can give the same x, so that x alone does not say of which numbers it was made. Two auxiliary numbers
//! gamma in [0, 1) say it. With D = sum of a_j p_j(x), and with a number u1 that sampling leaves unused,
//!
//! * gamma1 = (sum over j < t of a_j p_j(x) + u1 a_t p_t(x)) / D: the technique;
//! * gamma2 = (u2 - sum over j < t of a_j) / a_t: the place of u2 among the numbers that choose it.
//!
//! Both are uniform and independent of x. So a path that was reconnected, for which nobody knows random numbers, is given some by drawing
//! gamma and inverting, and these can be replayed elsewhere. Sampling has the Jacobian 1 / D, its inverse D. Their product is 1, which
//! leaves the density and the contribution weight as they are: gamma may be drawn anew at any time, right after a reconnection (eager) or
//! just before a replay (lazy). Weights and densities are those of the vertex where the path lies, not of the one from which it came.
//!
//! This is the supplemental document of Werner, Schüßler and Dachsbacher 2024, "ReSTIR Subsurface Scattering for Real-Time Path Tracing",
//! section 2, for any number of techniques as in Bitterli et al. 2017, "Reversible Jump Metropolis Light Transport Using Inverse Mappings".
//! Copies of it have `a_1 a_2 p_2` in equation 11, for technique 2; what equation 14 inverts is `u_1 a_2 p_2`.
//!
//! ```
//! use restir_shared::sampling::mixture::{Gamma, choose, gamma, invert};
//!
//! // two exponential densities of distances r, of which the second is chosen three times in four
//! let (weights, scales) = ([0.25_f64, 0.75], [1.0, 3.0]);
//! let densities = |r: f64| scales.map(|scale| (-r / scale).exp() / scale);
//! let sample = |technique: u32, u: f64| -scales[technique as usize] * (1.0 - u).ln();
//!
//! let chosen = choose(&weights, 0.1);
//! assert_eq!((chosen.technique, chosen.rest), (0, 0.4));
//! let r = sample(chosen.technique, 0.6);
//!
//! // its auxiliary numbers lead back to the numbers that made it
//! let of_sample = gamma(&weights, &densities(r), 0.1, 0.5);
//! let back = invert(&weights, &densities(r), of_sample);
//! assert!(back.technique == 0 && (back.choice - 0.1).abs() < 1e-12 && (back.free - 0.5).abs() < 1e-12);
//!
//! // others lead to the other technique, which gives the same distance by another number
//! let other = invert(&weights, &densities(r), Gamma { technique: 0.9, place: 0.5 });
//! assert_eq!(other.technique, choose(&weights, other.choice).technique);
//! let u = 1.0 - (-r / scales[1]).exp();
//! assert!(other.technique == 1 && (sample(1, u) - r).abs() < 1e-12);
//! ```

use crate::num::Scalar;

#[cfg(test)]
mod tests;

/// Stands for no technique.
pub const NONE: u32 = u32::MAX;

/// A technique that was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice<T> {
    /// Its index, or [`NONE`].
    pub technique: u32,
    /// What the choice has left of its number, uniform in [0, 1).
    pub rest: T,
}

/// The auxiliary numbers of a sample, in [0, 1) (Werner et al. 2024, supplemental, eq. 11).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gamma<T> {
    /// gamma1: tells techniques apart that could have given the value.
    pub technique: T,
    /// gamma2: the place among the numbers that choose the technique.
    pub place: T,
}

/// Of which random numbers a mixture makes a value, beside those of its technique (Werner et al. 2024, supplemental, eq. 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<T> {
    /// The technique, or [`NONE`], which leaves the numbers zero.
    pub technique: u32,
    /// u2, in [0, 1), by which [`choose`] chooses the technique.
    pub choice: T,
    /// u1, in [0, 1), which sampling does not use.
    pub free: T,
}

/// Chooses a technique with the probability of its weight; `u` in [0, 1) is u2 (Werner et al. 2024, supplemental, eq. 10).
///
/// Weights are 0 or more and, up to rounding, one in sum. The last technique with a weight has what rounding leaves; one without a weight
/// is never chosen, and [`NONE`] if no technique has one.
#[inline(always)]
pub fn choose<T: Scalar, const N: usize>(weights: &[T; N], u: T) -> Choice<T> {
    let cell = find(weights, T::ONE, |_, lower| lower <= u);
    Choice { technique: cell.technique, rest: cell.place(u) }
}

/// D, the density of the mixture where its techniques have the given ones: the sum of weights times densities, each
/// [within the range](Scalar::within_range). A technique adds nothing whose weight is too small beside those before it for any number to
/// choose it.
#[inline(always)]
pub fn density<T: Scalar, const N: usize>(weights: &[T; N], densities: &[T; N]) -> T {
    sum(&shares(weights, densities))
}

/// The auxiliary numbers of a sample: those with which [`invert`] gives `choice` = u2 and `free` = u1, both in [0, 1) (Werner et al. 2024,
/// supplemental, eq. 11).
///
/// Weights are as for [`choose`], densities those of all techniques at the value. The technique that `choice` chooses has a positive
/// density there, because it gave the value.
#[inline(always)]
pub fn gamma<T: Scalar, const N: usize>(weights: &[T; N], densities: &[T; N], choice: T, free: T) -> Gamma<T> {
    let chosen = choose(weights, choice);
    let shares = shares(weights, densities);
    let cell = find(&shares, inverse(sum(&shares)), |technique, _| technique == chosen.technique);
    Gamma { technique: cell.number(free), place: chosen.rest }
}

/// The inverse of [`gamma`]: a technique in proportion to its share a_t p_t(x) in the density, and numbers that choose it. What the
/// technique makes x of is the technique's to invert (Werner et al. 2024, supplemental, eqs. 13 and 14).
///
/// Weights and densities are as for [`gamma`]. [`choose`] chooses by `choice` the technique that is found, whatever is rounded. A technique
/// without a weight or a density is never found, and [`NONE`] if all are without.
#[inline(always)]
pub fn invert<T: Scalar, const N: usize>(weights: &[T; N], densities: &[T; N], gamma: Gamma<T>) -> Numbers<T> {
    let shares = shares(weights, densities);
    let share = find(&shares, inverse(sum(&shares)), |_, lower| lower <= gamma.technique);
    let weight = find(weights, T::ONE, |technique, _| technique == share.technique);
    Numbers { technique: share.technique, choice: weight.number(gamma.place), free: share.place(gamma.technique) }
}

/// The numbers that stand for a technique: from `lower` up to, but without, `end`.
#[derive(Clone, Copy)]
struct Cell<T> {
    technique: u32,
    lower: T,
    end: T,
}

impl<T: Scalar> Cell<T> {
    /// Where in the cell a number lies, in [0, 1).
    #[inline(always)]
    fn place(&self, number: T) -> T {
        if self.lower < self.end {
            least((number - self.lower).over(self.end - self.lower), T::BELOW_ONE).within_range()
        } else {
            T::ZERO
        }
    }

    /// The number at a place. Rounding does not take it out of the cell, because the last number before the end is a product.
    #[inline(always)]
    fn number(&self, place: T) -> T {
        let number = self.lower + place * (self.end - self.lower);
        least(number, self.end * T::BELOW_ONE).within_range()
    }
}

/// The last cell that is not empty and `accepts` its technique and lower bound. Bounds are sums of parts, times `scale`, and flushed, so
/// that no device takes a cell for empty that another finds.
#[inline(always)]
fn find<T: Scalar, const N: usize>(parts: &[T; N], scale: T, accepts: impl Fn(u32, T) -> bool) -> Cell<T> {
    let mut found = Cell { technique: NONE, lower: T::ZERO, end: T::ZERO };
    let (mut sum, mut lower, mut i) = (T::ZERO, T::ZERO, 0);
    while i < N {
        sum = sum + parts[i].within_range();
        let end = least((sum * scale).within_range(), T::ONE);
        let technique = i as u32;
        if (lower < end) & accepts(technique, lower) {
            found = Cell { technique, lower, end };
        }
        lower = end;
        i += 1;
    }
    found
}

/// a_t p_t of each technique; zero for one whose weight is too small beside those before it for any number to choose it.
#[inline(always)]
fn shares<T: Scalar, const N: usize>(weights: &[T; N], densities: &[T; N]) -> [T; N] {
    let mut shares = [T::ZERO; N];
    let (mut lower, mut i) = (T::ZERO, 0);
    while i < N {
        let weight = weights[i].within_range();
        let end = least(lower + weight, T::ONE);
        if lower < end {
            shares[i] = (weight * densities[i].within_range()).within_range();
        }
        lower = end;
        i += 1;
    }
    shares
}

#[inline(always)]
fn sum<T: Scalar, const N: usize>(parts: &[T; N]) -> T {
    let (mut sum, mut i) = (T::ZERO, 0);
    while i < N {
        sum = sum + parts[i];
        i += 1;
    }
    sum
}

/// One over a sum; zero for zero.
#[inline(always)]
fn inverse<T: Scalar>(sum: T) -> T {
    if sum > T::ZERO { T::ONE.over(sum) } else { T::ZERO }
}

#[inline(always)]
fn least<T: Scalar>(a: T, b: T) -> T {
    if a < b { a } else { b }
}
