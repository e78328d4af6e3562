//! Where noise comes from: the variance of each part of the picture.

use restir_cli::trial::{Estimate, Tried};
use restir_host::Error;
use restir_host::render::Render;

use super::study::Study;
use restir_tests::technique::configured;

/// A part of the picture and its variance, the mean over the values of all pixels.
pub(super) struct Part {
    pub(super) name: &'static str,
    pub(super) variance: Estimate,
}

/// The renders of all parts: one sample of path tracing, or the last frame of a chain.
pub(super) fn renders(study: &Study, size: [u32; 2]) -> Result<Vec<Render>, Error> {
    let traced = |part: &str| Ok(Render::new(size, configured("path", &[study.part_of_path, part].join(","))?));
    let parts = study.parts.iter();
    parts.map(|&(_, is_traced, text)| if is_traced { traced(text) } else { study.chain(size, text) }).collect()
}

/// What the images of these renders tell.
pub(super) fn measured(study: &Study, tried: &[Tried]) -> Vec<Part> {
    let parts = study.parts.iter().zip(tried);
    parts.map(|(&(name, ..), tried)| Part { name, variance: variance(tried.values()) }).collect()
}

/// The mean over all values of their variance between images. Its error follows from how much each image adds to it.
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
