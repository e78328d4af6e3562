//! Where noise comes from: the variance of parts of the picture, each by itself.

use restir_cli::trial::{Estimate, Subject, Trial, Tried, Window, try_once};
use restir_host::Error;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;

use super::FRAMES;
use super::study::{PartOf, Study, configured};
use crate::time::thread_seconds;

/// Mean variance of the values of a picture's pixels.
pub(super) struct Part {
    pub(super) name: &'static str,
    pub(super) variance: Estimate,
}

/// Each part of the study in so many images; in a picture of such a truth.
pub(super) fn measured(
    subject: &Subject,
    study: &Study,
    [images, width, height]: [u32; 3],
) -> Result<Vec<Part>, Error> {
    let size = [width, height];
    let whole = [Window { whole: size, size, margin: 0, middle: [0.0; 2] }];
    let render = |part: &PartOf| {
        let count = if part.technique == "path" { 1 } else { FRAMES };
        Ok(Render { count, ..Render::new(size, configured(part.technique, part.settings)?) })
    };
    let renders = study.parts.iter().map(render).collect::<Result<Vec<_>, Error>>()?;
    let trials: Vec<Trial<'_>> = renders.iter().map(|render| subject.trial(render, &whole)).collect();
    let mut tried = vec![Tried::default(); trials.len()];
    for seed in 0..images {
        try_once(&mut CpuExecutor::inline(), &thread_seconds, &trials, &mut tried, seed, &mut |_| Ok(()))?;
    }
    let parts = study.parts.iter().zip(&tried);
    Ok(parts.map(|(part, tried)| Part { name: part.name, variance: variance(tried.values()) }).collect())
}

/// The variance of a value, the mean over all of them; its error by how much the images differ in what they add to it.
fn variance(images: &[Vec<f64>]) -> Estimate {
    let n = images.len() as f64;
    let values = images.first().map_or(0, Vec::len);
    let mean: Vec<f64> = (0..values).map(|i| images.iter().map(|image| image[i]).sum::<f64>() / n).collect();
    let squares = |image: &Vec<f64>| {
        let sum: f64 = image.iter().zip(&mean).map(|(value, mean)| (value - mean).powi(2)).sum();
        sum / values as f64 * n / (n - 1.0)
    };
    let of_images: Vec<f64> = images.iter().map(squares).collect();
    let value = of_images.iter().sum::<f64>() / n;
    let spread = of_images.iter().map(|of| (of - value).powi(2)).sum::<f64>() / (n - 1.0);
    Estimate { value, error: (spread / n).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variances_are_means_over_pixels() {
        // of the values 1, 3 and 0, 0 in two images: 2 and 0
        let Estimate { value, error } = variance(&[vec![1.0, 0.0], vec![3.0, 0.0]]);
        assert!((value - 1.0).abs() < 1e-12 && error < 1e-12);
    }
}
