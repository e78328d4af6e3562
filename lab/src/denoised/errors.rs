//! Errors of frames, and of what changes between two of them.

use restir_host::image::Image;
use restir_host::metrics::compare;
use restir_host::tonemap::{Operator, Tone};

use super::frames::Last;
use crate::{Error, flip};

/// How pictures are shown to eyes.
const SHOWN: Tone = Tone { exposure: 0.0, operator: Operator::Aces };
/// As of relMSE.
const EPSILON: f64 = 1.0e-3;

/// Means over images.
#[derive(Default)]
pub(super) struct Errors {
    pub(super) rel_mse: f64,
    pub(super) flip: f64,
    pub(super) light: f64,
    /// Of differences of frames; `None` if there is one.
    pub(super) unsteady: Option<f64>,
}

impl Errors {
    pub(super) fn of(images: &[Last], reference: &Last) -> Result<Self, Error> {
        let share = 1.0 / images.len() as f64;
        let mut mean = Self::default();
        for last in images {
            let compared = compare(&last.image, &reference.image)?;
            mean.rel_mse += share * compared.rel_mse;
            mean.light += share * compared.mean_ratio;
            mean.flip += share * flip::mean(SHOWN, &reference.image, &last.image);
            if let (Some(before), Some(right)) = (&last.before, &reference.before) {
                let change = unsteady([&last.image, before], [&reference.image, right]);
                mean.unsteady = Some(mean.unsteady.unwrap_or(0.0) + share * change);
            }
        }
        Ok(mean)
    }
}

/// The mean square of what the difference of two frames is off, relative to the square of the reference.
fn unsteady([last, before]: [&Image; 2], [right, right_before]: [&Image; 2]) -> f64 {
    let values = |image: &Image| image.pixels.as_flattened().iter().map(|value| f64::from(*value)).collect::<Vec<_>>();
    let [last, before, right, right_before] = [last, before, right, right_before].map(values);
    let value =
        |i: usize| ((last[i] - before[i]) - (right[i] - right_before[i])).powi(2) / (right[i].powi(2) + EPSILON);
    (0..last.len()).map(value).sum::<f64>() / last.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last(frames: [f32; 2]) -> Last {
        let [before, image] = frames.map(|value| Image { width: 16, height: 16, pixels: vec![[value; 3]; 256] });
        Last { image, before: Some(before) }
    }

    /// What is off by the same in both frames is steady; what is off in one of them is not.
    #[test]
    fn steady_errors_do_not_count() {
        let unsteady = |frames| Errors::of(&[last(frames)], &last([1.0, 2.0])).unwrap().unsteady.unwrap();
        assert!(unsteady([1.5, 2.5]) < 1e-9);
        assert!((unsteady([1.5, 2.0]) - 0.25 / 4.001).abs() < 1e-6);
    }
}
