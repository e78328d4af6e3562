//! What the checks share.

use restir_shared::resample::mis::Mis;
use restir_tests::resampling::forms::Real;

/// The library's forms.
pub(crate) const MIS: [Mis; 9] = [
    Mis::ONE_OVER_M,
    Mis::CONSTANT,
    Mis::ONE_OVER_Z,
    Mis::CONTRIBUTION,
    Mis::TALBOT,
    Mis::PAIRWISE,
    Mis::PAIRWISE_COUNTED,
    Mis::PAIRWISE_DEFENSIVE,
    Mis::PAIRWISE_COUNTED_DEFENSIVE,
];

/// Those that are unbiased although inputs differ in what they can produce.
pub(crate) fn is_unbiased(mis: Mis) -> bool {
    (mis != Mis::ONE_OVER_M) & (mis != Mis::CONSTANT)
}

/// The largest uniform number of 24 bits.
pub(crate) const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

/// Uniform numbers with which a stream keeps its item `selected`, if that has a weight.
pub(crate) fn keep<T: Real>(selected: usize) -> impl FnMut() -> T {
    let mut item = 0;
    move || {
        item += 1;
        if item == selected + 1 { T::ZERO } else { T::of(LAST) }
    }
}

/// Whether two numbers are equal up to a part of the second.
pub(crate) fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}
