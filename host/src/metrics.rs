//! How far an image is from a reference.
//!
//! Conventions, for a test image `x` and a reference `r` in linear RGB: a mean runs over all N values, that is every
//! channel of every pixel counts alike; sums are in `f64`, in the order of the pixels; `m` is the mean of `r`.
//!
//! | metric | definition |
//! |---|---|
//! | RMSE | `sqrt(mean (x-r)²)` |
//! | relMSE | `mean (x-r)² / (r² + ε)`, ε = 1e-3 |
//! | RMAE | form A: `mean abs(x-r) / (abs r + ε)`, ε = [`RELATIVE_THRESHOLD`] `m`; a term 0 / 0 is 0 |
//! | RMAE, global | form B: `Σ abs(x-r) / Σ r` |
//! | RMSPE | `100 sqrt(mean ((x-r)/r)²)` over the values with `r >= ` [`RELATIVE_THRESHOLD`] `m` and `r > 0` |
//! | SMAPE | `100 mean 2 abs(x-r) / (abs x + abs r)`, from 0 to 200; a term 0 / 0 is 0 |
//! | mean ratio | `mean x / mean r` |
//!
//! A metric that has no value (a black reference, a NaN in an image) is NaN or infinite.
//!
//! ```
//! use restir_host::image::Image;
//! use restir_host::metrics::{compare, ulp_distance};
//!
//! let image = |value: f32| Image { width: 2, height: 1, pixels: vec![[value; 3], [0.5; 3]] };
//! let difference = compare(&image(1.2), &image(1.0))?;
//! assert!(!difference.identical && difference.differing_words == 3);
//! // three of six values are off by 0.2, which is a fifth of the reference
//! assert!((difference.rmse - (0.04_f64 / 2.0).sqrt()).abs() < 1e-6);
//! assert!((difference.rel_mse - 0.04 / 1.001 / 2.0).abs() < 1e-6);
//! assert!((difference.mean_ratio - 1.7 / 1.5).abs() < 1e-6);
//!
//! assert_eq!(ulp_distance(1.0, 1.0_f32.next_up()), 1);
//! # Ok::<(), restir_host::Error>(())
//! ```

use crate::Error;
use crate::image::Image;

/// ε of relMSE, in squared radiance.
pub(crate) const REL_MSE_EPSILON: f64 = 1e-3;

/// What RMAE adds to the reference and RMSPE excludes below, as a fraction of the reference's mean.
pub const RELATIVE_THRESHOLD: f64 = 1e-3;

/// The difference between a test image and a reference; the module says how each number is defined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Every value has the same bits.
    pub identical: bool,
    /// How many 32-bit values (three a pixel) differ in their bits.
    pub differing_words: u64,
    /// Largest distance of two values, see [`ulp_distance`].
    pub max_ulp: u32,
    /// Root mean square error, in radiance.
    pub rmse: f64,
    /// Relative mean square error.
    pub rel_mse: f64,
    /// Relative mean absolute error, form A: the mean of the relative errors.
    pub rmae: f64,
    /// Relative mean absolute error, form B: the mean error over the mean of the reference.
    pub rmae_global: f64,
    /// Root mean square percentage error, in percent.
    pub rmspe: f64,
    /// How many values RMSPE excludes because the reference is dark there.
    pub rmspe_excluded: u64,
    /// Symmetric mean absolute percentage error, in percent, from 0 to 200.
    pub smape: f64,
    /// Mean of the test image over the mean of the reference.
    pub mean_ratio: f64,
}

/// Compares a test image with a reference of the same size.
///
/// # Errors
/// [`Error::SizeMismatch`] if the sizes differ, [`Error::EmptyImage`] if the images have no pixels.
pub fn compare(test: &Image, reference: &Image) -> Result<Comparison, Error> {
    check_sizes(test, reference)?;
    let values = || test.pixels.as_flattened().iter().copied().zip(reference.pixels.as_flattened().iter().copied());
    let differing_words = values().filter(|(x, r)| x.to_bits() != r.to_bits()).count() as u64;
    let count = values().count() as f64;
    let threshold = RELATIVE_THRESHOLD * (values().map(|(_, r)| f64::from(r)).sum::<f64>() / count);
    let mut sums = Sums::default();
    values().for_each(|(x, r)| sums.add(f64::from(x), f64::from(r), threshold));
    Ok(Comparison {
        identical: differing_words == 0,
        differing_words,
        max_ulp: values().fold(0, |most, (x, r)| most.max(ulp_distance(x, r))),
        rmse: (sums.squared / count).sqrt(),
        rel_mse: sums.relative_squared / count,
        rmae: sums.relative / count,
        rmae_global: sums.absolute / sums.reference,
        rmspe: 100.0 * (sums.percentage_squared / sums.percentage_count as f64).sqrt(),
        rmspe_excluded: values().count() as u64 - sums.percentage_count,
        smape: 100.0 * sums.symmetric / count,
        mean_ratio: sums.test / sums.reference,
    })
}

/// The number of representable values from `a` to `b`, which is 0 for `a == b` (so for +0 and -0) and for two NaNs,
/// and [`u32::MAX`] if just one is NaN.
pub fn ulp_distance(a: f32, b: f32) -> u32 {
    match (a.is_nan(), b.is_nan()) {
        (true, true) => 0,
        (false, false) => ordered(a).abs_diff(ordered(b)),
        _ => u32::MAX,
    }
}

/// Maps floats to integers that have the same order, one apart for neighbours.
fn ordered(value: f32) -> i32 {
    let magnitude = (value.to_bits() & 0x7fff_ffff) as i32;
    if value.is_sign_negative() { -magnitude } else { magnitude }
}

fn check_sizes(test: &Image, reference: &Image) -> Result<(), Error> {
    let size = |image: &Image| (image.width, image.height, image.pixels.len());
    if size(test) != size(reference) {
        let [test, reference] = [test, reference].map(|image| [image.width, image.height]);
        return Err(Error::SizeMismatch { test, reference });
    }
    if test.pixels.is_empty() {
        return Err(Error::EmptyImage { size: [test.width, test.height] });
    }
    Ok(())
}

#[derive(Default)]
struct Sums {
    test: f64,
    reference: f64,
    absolute: f64,
    squared: f64,
    relative: f64,
    relative_squared: f64,
    percentage_squared: f64,
    percentage_count: u64,
    symmetric: f64,
}

impl Sums {
    fn add(&mut self, x: f64, r: f64, threshold: f64) {
        let error = (x - r).abs();
        self.test += x;
        self.reference += r;
        self.absolute += error;
        self.squared += error * error;
        self.relative += ratio(error, r.abs() + threshold);
        self.relative_squared += error * error / (r * r + REL_MSE_EPSILON);
        self.symmetric += ratio(2.0 * error, x.abs() + r.abs());
        if r >= threshold && r > 0.0 {
            self.percentage_squared += (error / r) * (error / r);
            self.percentage_count += 1;
        }
    }
}

/// `error / scale`, where no error is 0 on any scale.
fn ratio(error: f64, scale: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &[[f32; 3]]) -> Image {
        Image { width: pixels.len() as u32, height: 1, pixels: pixels.to_vec() }
    }

    fn assert_close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() <= 1e-12 * expected.abs(), "{actual} is not {expected}");
    }

    #[test]
    fn values_computed_by_hand() {
        // Errors 1, 1, 0, 0, 0, 2; the mean of the reference is 12 / 6 = 2, so the threshold is 0.002.
        let reference = image(&[[1.0, 2.0, 4.0], [3.0, 2.0, 0.0]]);
        let test = image(&[[2.0, 1.0, 4.0], [3.0, 2.0, 2.0]]);
        let comparison = compare(&test, &reference).unwrap();
        assert!(!comparison.identical);
        assert_eq!(comparison.differing_words, 3);
        assert_close(comparison.rmse, 1.0);
        assert_close(comparison.rel_mse, (1.0 / 1.001 + 1.0 / 4.001 + 4.0 / 0.001) / 6.0);
        assert_close(comparison.rmae, (1.0 / 1.002 + 1.0 / 2.002 + 2.0 / 0.002) / 6.0);
        assert_close(comparison.rmae_global, 4.0 / 12.0);
        assert_eq!(comparison.rmspe_excluded, 1);
        assert_close(comparison.rmspe, 50.0);
        assert_close(comparison.smape, 100.0 * (2.0 / 3.0 + 2.0 / 3.0 + 2.0) / 6.0);
        assert_close(comparison.mean_ratio, 14.0 / 12.0);
    }

    #[test]
    fn an_image_is_identical_to_itself() {
        let image = image(&[[0.0, -0.0, f32::NAN]]);
        let comparison = compare(&image, &image).unwrap();
        assert!(comparison.identical);
        assert_eq!((comparison.differing_words, comparison.max_ulp), (0, 0));
    }

    #[test]
    fn black_images_have_no_error_and_no_mean_ratio() {
        let black = image(&[[0.0; 3]; 4]);
        let comparison = compare(&black, &black).unwrap();
        assert_eq!((comparison.rmse, comparison.rmae, comparison.smape), (0.0, 0.0, 0.0));
        assert!(comparison.mean_ratio.is_nan() && comparison.rmspe.is_nan());
    }

    #[test]
    fn ulps_are_counted_across_zero() {
        assert_eq!(ulp_distance(1.0, 1.0_f32.next_up()), 1);
        assert_eq!(ulp_distance(0.0, -0.0), 0);
        assert_eq!(ulp_distance(0.0_f32.next_up(), 0.0_f32.next_down()), 2);
        assert_eq!(ulp_distance(f32::NEG_INFINITY, f32::INFINITY), 2 * 0x7f80_0000);
        assert_eq!(ulp_distance(f32::NAN, f32::NAN), 0);
        assert_eq!(ulp_distance(f32::NAN, f32::INFINITY), u32::MAX);
    }

    #[test]
    fn other_sizes_are_refused() {
        let error = compare(&image(&[[0.0; 3]]), &image(&[[0.0; 3]; 2])).unwrap_err();
        assert!(error.to_string().contains("1 x 1 and 2 x 1"));
        compare(&image(&[]), &image(&[])).unwrap_err();
    }
}
