//! Error-free transforms: the rounding error of a sum or product as a second number.
//!
//! In the documentation of these functions `fl(x)` is the floating-point number nearest to x. The transforms hold only where nothing is
//! contracted or reassociated, so a build that breaks this contract shows in them first.
//!
//! ```
//! use restir_shared::num::eft::{Sum, difference_of_products, two_prod, two_sum};
//!
//! // what a sum loses comes back as the second number
//! assert_eq!(two_sum(1.0, 1e-9), (1.0, 1e-9));
//! let (product, error) = two_prod(0.1, 0.1);
//! assert_eq!(f64::from(product) + f64::from(error), f64::from(0.1_f32) * f64::from(0.1_f32));
//!
//! // (1 + e)(1 - e) - 1 = -e², of which ordinary arithmetic leaves nothing
//! let e = 1.0 / 8192.0;
//! assert_eq!(difference_of_products(1.0 + e, 1.0 - e, 1.0, 1.0), -e * e);
//! assert_eq!(Sum::new(1.0, 1e-9).plus(-1.0).total(), 1e-9);
//! ```

/// `(s, e)` with `s = fl(a + b)` and `s + e = a + b` (Knuth).
#[inline(always)]
pub fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// `(hi, lo)` of 12 bits each with `hi + lo = a` (Veltkamp), for |a| < 2^115.
#[inline(always)]
pub fn split(a: f32) -> (f32, f32) {
    let c = 4097.0 * a;
    let hi = c - (c - a);
    (hi, a - hi)
}

/// `(p, e)` with `p = fl(a b)` and `p + e = a b` (Dekker), while neither p nor e leaves the range of normal numbers.
#[inline(always)]
pub fn two_prod(a: f32, b: f32) -> (f32, f32) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

/// `a b - c d` with an error below one unit in the last place, however much cancels (after Kahan; J. R. Shewchuk 1997 for
/// the sum). For products that are zero or of magnitudes in [2^-78, 2^126], operands below 2^115.
#[inline(always)]
pub fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    sum_of_products(a, b, -c, d)
}

/// `a b + c d`, as [`difference_of_products`].
#[inline(always)]
pub fn sum_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    let (p, p_error) = two_prod(a, b);
    let (q, q_error) = two_prod(c, d);
    let (s, s_error) = two_sum(p, q);
    s + (s_error + (p_error + q_error))
}

/// A sum with the rounding errors beside it (Neumaier 1974, "Rundungsfehleranalyse einiger Verfahren zur Summation
/// endlicher Summen"): the error of n terms is one rounding of the total and about n^2 2^-48 of the sum of magnitudes.
///
/// It begins with two terms: a sum that begins with a constant zero would not get past the allow-list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sum {
    sum: f32,
    error: f32,
}

impl Sum {
    /// The sum of two terms.
    #[inline(always)]
    pub fn new(a: f32, b: f32) -> Self {
        let (sum, error) = two_sum(a, b);
        Self { sum, error }
    }

    /// With one more term.
    #[inline(always)]
    pub fn plus(self, x: f32) -> Self {
        let (sum, error) = two_sum(self.sum, x);
        Self { sum, error: self.error + error }
    }

    /// The total, rounded.
    #[inline(always)]
    pub fn total(self) -> f32 {
        self.sum + self.error
    }
}
