//! How far an image is from a reference that has noise itself.
//!
//! For values x of an image (every channel of every pixel counts alike), r of the reference and m its mean:
//!
//! | figure | definition |
//! |---|---|
//! | MSE | `mean (x-r)²` |
//! | relMSE | `mean (x-r)² / (r² + 0.01 m²)` |
//! | MAPE | `mean abs(x-r) / (r + 0.01 m)` |
//!
//! The noise of the reference is independent of the image's, so it adds its variance to the MSE, and the weighted
//! variance to relMSE; [`Figure`] subtracts it, as far as it is known. A mean of magnitudes has no such rule: MAPE stays as
//! it is measured, too large by about half of the share that the reference has in the MSE, which must be small.

use restir::advanced::{metrics::RELATIVE_THRESHOLD, reference::Reference};
use restir::image::Image;

/// Where the reference has a larger share in a measured error, what cannot be corrected is refused.
pub(crate) const SMALL_SHARE: f64 = 0.05;
/// Where it has a larger one, all is: the denominators of relMSE are too noisy then.
pub(crate) const LARGEST_SHARE: f64 = 0.25;
/// A corrected error is refused if two standard errors of the noise are more than this part of it.
pub(crate) const LARGEST_DOUBT: f64 = 0.05;
const DARK: f64 = 0.01;

/// A reference, prepared for comparisons.
#[derive(Clone)]
pub(crate) struct Truth {
    pub(crate) values: Vec<f64>,
    /// Mean over all values.
    pub(crate) mean: f64,
    /// Standard error of the mean.
    pub(crate) mean_error: f64,
    /// What the reference's noise adds to an MSE.
    pub(crate) noise: f64,
    /// What it adds to a relMSE.
    pub(crate) relative_noise: f64,
    /// Standard errors of [`Self::noise`] and [`Self::relative_noise`].
    pub(crate) noise_errors: [f64; 2],
}

/// An image's errors as they are measured, and its mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Errors {
    pub(crate) mse: f64,
    pub(crate) rel_mse: f64,
    pub(crate) mape: f64,
    /// RMAE of form A and of form B, as in [`restir::advanced::metrics`]: as measured, like MAPE.
    pub(crate) rmae: f64,
    pub(crate) rmae_global: f64,
    pub(crate) mean: f64,
}

/// A measured error and the part that the reference's noise has in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Figure {
    pub(crate) measured: f64,
    pub(crate) noise: f64,
    /// The standard error of that part.
    pub(crate) noise_error: f64,
}

impl Figure {
    /// The error of the image alone; `None` if the reference is too noisy to tell.
    pub(crate) fn corrected(self) -> Option<f64> {
        let corrected = self.measured - self.noise;
        let known = self.noise <= LARGEST_SHARE * self.measured && 2.0 * self.noise_error <= LARGEST_DOUBT * corrected;
        known.then_some(corrected)
    }

    /// Whether the reference's noise hardly matters.
    pub(crate) fn is_pure(self) -> bool {
        self.noise <= SMALL_SHARE * self.measured
    }
}

impl Errors {
    /// The mean of those of images, or of single values; NaN of none.
    pub(crate) fn mean(of: impl IntoIterator<Item = Self>) -> Self {
        let mut count = 0.0;
        let sum = of.into_iter().fold(Self::default(), |sum, one| {
            count += 1.0;
            sum.combined(one, |sum, one| sum + one)
        });
        sum.combined(sum, |sum, _| sum * (1.0 / count))
    }

    /// Each error from those of both.
    fn combined(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            mse: of(self.mse, other.mse),
            rel_mse: of(self.rel_mse, other.rel_mse),
            mape: of(self.mape, other.mape),
            rmae: of(self.rmae, other.rmae),
            rmae_global: of(self.rmae_global, other.rmae_global),
            mean: of(self.mean, other.mean),
        }
    }
}

impl Truth {
    pub(crate) fn new(reference: &Reference) -> Self {
        Self::from_values(reference.values(), &reference.variances(), reference.standard_error_of_mean())
    }

    fn from_values(values: Vec<f64>, variances: &[f64], mean_error: f64) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let (noise, error) = mean_and_error_of_pixels(variances);
        let truth = Self { values, mean, mean_error, noise, relative_noise: 0.0, noise_errors: [error, 0.0] };
        let weighted = truth.values.iter().zip(variances).map(|(&r, &variance)| ratio(variance, truth.scale(r)));
        let (relative_noise, relative_error) = mean_and_error_of_pixels(&weighted.collect::<Vec<_>>());
        Self { relative_noise, noise_errors: [error, relative_error], ..truth }
    }

    /// An MSE as it is measured.
    pub(crate) fn mse(&self, measured: f64) -> Figure {
        Figure { measured, noise: self.noise, noise_error: self.noise_errors[0] }
    }

    /// A relMSE as it is measured.
    pub(crate) fn rel_mse(&self, measured: f64) -> Figure {
        Figure { measured, noise: self.relative_noise, noise_error: self.noise_errors[1] }
    }

    /// The denominator of relMSE.
    fn scale(&self, r: f64) -> f64 {
        r * r + DARK * self.mean * self.mean
    }

    /// The errors of an image of the reference's size.
    pub(crate) fn errors(&self, image: &Image) -> Errors {
        self.errors_of(image.pixels.as_flattened().iter().map(|&x| f64::from(x)))
    }

    /// As [`Self::errors`], of an image's values.
    pub(crate) fn errors_of(&self, image: impl Iterator<Item = f64>) -> Errors {
        Errors::mean(image.zip(&self.values).map(|(x, &r)| {
            let error = (x - r).abs();
            Errors {
                mse: error * error,
                rel_mse: ratio(error * error, self.scale(r)),
                mape: ratio(error, r + DARK * self.mean),
                rmae: ratio(error, r + RELATIVE_THRESHOLD * self.mean),
                rmae_global: ratio(error, self.mean),
                mean: x,
            }
        }))
    }
}

/// The mean of all values, and its standard error: the channels of a pixel are dependent, pixels are not.
fn mean_and_error_of_pixels(values: &[f64]) -> (f64, f64) {
    let pixels: Vec<f64> = values.chunks_exact(3).map(|pixel| pixel.iter().sum::<f64>() / 3.0).collect();
    let count = pixels.len() as f64;
    let mean = pixels.iter().sum::<f64>() / count;
    let squares: f64 = pixels.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, squares.sqrt() / count)
}

/// `error / scale`, where no error is 0 on any scale.
fn ratio(error: f64, scale: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / scale }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::noise::Noise;

    const COUNT: usize = 60_000;

    /// A picture, a reference of it whose two halves have the variance `half`, and an image with the variance 1.
    fn synthetic(half: f64) -> (Truth, Errors) {
        let mut noise = Noise::new(1);
        let picture: Vec<f64> = (0..COUNT).map(|i| 5.0 + (i % 7) as f64).collect();
        let mut noisy =
            |variance: f64| -> Vec<f64> { picture.iter().map(|r| r + variance.sqrt() * noise.normal()).collect() };
        let (a, b, image) = (noisy(half), noisy(half), noisy(1.0));
        let mean = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
        let variances: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.25 * (a - b) * (a - b)).collect();
        let truth = Truth::from_values(mean, &variances, 0.0);
        let errors = truth.errors_of(image.into_iter());
        (truth, errors)
    }

    /// The standard error of a mean of squares of normal numbers, relative: sqrt(2 / count).
    fn tolerance() -> f64 {
        4.0 * (2.0 / COUNT as f64).sqrt()
    }

    #[test]
    fn the_noise_of_the_reference_is_subtracted() {
        // halves with variance 0.08 give a reference with 0.04: a share just below the limit
        let (truth, errors) = synthetic(0.08);
        let figure = truth.mse(errors.mse);
        let corrected = figure.corrected().expect("the reference is good enough");
        assert!((corrected - 1.0).abs() < tolerance(), "{corrected}");
        // the known-wrong figure, which does not subtract, is off by more than chance
        assert!((errors.mse - 1.0).abs() > tolerance(), "{}", errors.mse);
    }

    #[test]
    fn so_it_is_for_relative_errors() {
        let (truth, errors) = synthetic(0.08);
        let corrected = truth.rel_mse(errors.rel_mse).corrected().unwrap();
        let exact = synthetic(0.0).1.rel_mse;
        // the weights take part: some of the terms count more
        assert!((corrected / exact - 1.0).abs() < 1.5 * tolerance(), "{corrected} {exact}");
        assert!((errors.rel_mse / exact - 1.0).abs() > 1.5 * tolerance(), "{} {exact}", errors.rel_mse);
    }

    #[test]
    fn too_noisy_a_reference_gives_no_figure() {
        let (truth, errors) = synthetic(0.14);
        let figure = truth.mse(errors.mse);
        assert!(!figure.is_pure() && figure.corrected().is_some_and(|left| (left - 1.0).abs() < tolerance()));
        let (truth, errors) = synthetic(0.8);
        assert_eq!(truth.mse(errors.mse).corrected(), None);
        let figure = |measured, noise, noise_error| Figure { measured, noise, noise_error }.corrected();
        assert_eq!(figure(1.0, LARGEST_SHARE, 0.01), Some(1.0 - LARGEST_SHARE));
        assert_eq!(figure(1.0, LARGEST_SHARE, 0.02), None);
        assert_eq!(figure(0.0, 0.0, 0.0), Some(0.0));
        assert_eq!(figure(f64::NAN, 0.0, 0.0), None);
    }

    #[test]
    fn values_computed_by_hand() {
        // errors 1, 0, 2; the mean of the reference is 2
        let truth = Truth::from_values(vec![1.0, 5.0, 0.0], &[0.5, 0.0, 0.1], 0.0);
        let errors = truth.errors_of([2.0, 5.0, 2.0].into_iter());
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        close(errors.mse, 5.0 / 3.0);
        close(errors.rel_mse, (1.0 / 1.04 + 4.0 / 0.04) / 3.0);
        close(errors.mape, (1.0 / 1.02 + 2.0 / 0.02) / 3.0);
        close(errors.mean, 3.0);
        close(truth.noise, 0.2);
        close(truth.relative_noise, (0.5 / 1.04 + 0.1 / 0.04) / 3.0);
    }
}
