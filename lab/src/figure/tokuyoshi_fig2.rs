//! Tokuyoshi, supplement, figure 2: what the visibility of the selected sample and the averaged one converge to under
//! coloured lights, beside the reference.

use std::fmt::Write;

use crate::bootstrap::{Interval, draws, mean};
use rayon::prelude::*;
use restir::advanced::metrics::{self, RELATIVE_THRESHOLD};
use restir::advanced::reference::{Goal, Reference};
use restir::render::Render;
use restir::{Error, buffers::SceneBuffers, image::Image};

use super::averaging::{METHODS, settings};
use super::chains::{self, Chains, Protocol};
use super::claim::{self, Claim};
use super::picture::{enlarged, grey, grid};
use super::scenes::{coloured, wall};
use super::{Environs, Files, PICTURE};
use crate::bench::table::Setup;

const SCENE: &str = "coloured wall";
const RESAMPLES: u32 = 500;
/// The leak that is white in its map, in parts of the reference.
const WHITE_LEAK: f64 = 0.2;
/// Pixels of the pictures for one of the image.
const ENLARGED: u32 = 4;
/// What "significantly smaller" is taken for.
const SMALL: f64 = 1.0 / 3.0;

/// The statistics of the comparison, in percent.
const STATISTICS: [&str; 6] = [
    "RMSPE(prev, ref)",
    "RMSPE(ours, ref)",
    "their difference, points",
    "RMSPE(ours, prev)",
    "mean error of prev",
    "mean error of ours",
];

/// The mean images of all chains, by method, and the reference.
struct Comparison<'a> {
    chains: &'a [Chains],
    reference: Vec<f64>,
    /// What the reference's noise adds to a squared error.
    noise: Vec<f64>,
    /// Values of [`Self::reference`] that are not too dark for a relative error.
    counts: Vec<usize>,
}

impl<'a> Comparison<'a> {
    fn new(chains: &'a [Chains], reference: &Reference) -> Self {
        let (values, noise) = (reference.values(), reference.variances());
        let threshold = RELATIVE_THRESHOLD * values.iter().sum::<f64>() / values.len() as f64;
        let counts = (0..values.len()).filter(|&i| values[i] > threshold).collect();
        Self { chains, reference: values, noise, counts }
    }

    /// The mean of a method's chains, of the even or of the odd ones, at a value; they count `times` each.
    fn half(&self, method: usize, odd: usize, times: &[f64], i: usize) -> f64 {
        let of_half: Vec<f64> = self.chains[method].images.iter().skip(odd).step_by(2).map(|image| image[i]).collect();
        mean(&of_half, times)
    }

    /// Squares are products of the errors of two halves of the chains, which share no random number: their noise adds
    /// nothing to the expectation.
    fn statistics(&self, times: [&[f64]; 2]) -> [f64; STATISTICS.len()] {
        let (mut squares, mut sums) = ([0.0; 3], [0.0; 3]);
        for &i in &self.counts {
            let r = self.reference[i];
            let [prev, ours] = [0, 1].map(|method| [0, 1].map(|odd| self.half(method, odd, times[odd], i)));
            let off = |[a, b]: [f64; 2]| (a - r) * (b - r) - self.noise[i];
            let terms = [off(prev), off(ours), (ours[0] - prev[0]) * (ours[1] - prev[1])];
            squares.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term / (r * r));
            let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
            sums.iter_mut().zip([r, middle(prev), middle(ours)]).for_each(|(sum, x)| *sum += x);
        }
        // a square that noise took below zero stays visible as such
        let percent = |square: f64| 100.0 * (square.abs() / self.counts.len() as f64).sqrt().copysign(square);
        let [a, b, direct] = squares.map(percent);
        let [r, prev, ours] = sums;
        [a, b, b - a, direct, 100.0 * (prev / r - 1.0), 100.0 * (ours / r - 1.0)]
    }

    fn intervals(&self) -> [Interval; STATISTICS.len()] {
        let half = self.chains[0].images.len() / 2;
        let once = vec![1.0; half];
        let values = self.statistics([&once, &once]);
        let resampled: Vec<_> = (0..RESAMPLES)
            .into_par_iter()
            .map(|i| self.statistics([&draws(2 * i, half), &draws(2 * i + 1, half)]))
            .collect();
        std::array::from_fn(|k| Interval::basic(values[k], values[k], resampled.iter().map(|all| all[k]).collect()))
    }

    /// The mean image of a method.
    fn image(&self, [width, height]: [u32; 2], method: usize) -> Image {
        let images = &self.chains[method].images;
        let mean = |i: usize| (images.iter().map(|image| image[i]).sum::<f64>() / images.len() as f64) as f32;
        let pixels = (0..width * height).map(|i| [0, 1, 2].map(|channel| mean((3 * i + channel) as usize))).collect();
        Image { width, height, pixels }
    }
}

/// The files of the figure. Of a chain all frames count.
///
/// # Errors
/// As of [`Render::render`] and of making references.
pub(crate) fn make(
    environs: &mut impl Environs,
    protocol: Protocol,
    goal: Goal,
    setup: &Setup,
) -> Result<Files, Error> {
    let scene = SceneBuffers::build(&wall(SCENE, &[1.0], coloured))?;
    let settings = settings(protocol.size[1]);
    settings.iter().try_for_each(|settings| Render::new(protocol.size, settings.clone()).check(&scene))?;
    let reference = environs.reference(SCENE, &scene, goal)?;
    let chains =
        environs.run(SCENE, |executor, observe| chains::run(executor, &scene, &settings, protocol, observe))?;
    let comparison = Comparison::new(&chains, &reference);
    let images = [0, 1].map(|method| comparison.image(protocol.size, method));
    Ok(Files {
        picture: Some(picture(&images, &reference.image())),
        texts: vec![("pixels.csv".to_owned(), table(&images, &reference.image()))],
        report: report(&comparison, &images, &reference, protocol, &setup.markdown(""))?,
    })
}

/// The leak of a pixel, in parts of the reference.
fn leak([prev, ours]: [&[f32; 3]; 2], reference: &[f32; 3], threshold: f64) -> f64 {
    let of_channel = |c: usize| (f64::from(ours[c]) - f64::from(prev[c])).abs() / (f64::from(reference[c]) + threshold);
    (0..3).map(of_channel).sum::<f64>() / 3.0
}

fn picture([prev, ours]: &[Image; 2], reference: &Image) -> Image {
    let values = reference.pixels.as_flattened();
    let threshold = RELATIVE_THRESHOLD * values.iter().map(|&r| f64::from(r)).sum::<f64>() / values.len() as f64;
    let pixels = prev.pixels.iter().zip(&ours.pixels).zip(&reference.pixels);
    let map = pixels.map(|((prev, ours), reference)| leak([prev, ours], reference, threshold) / WHITE_LEAK);
    let map = grey([prev.width, prev.height], map);
    grid(&[prev, ours, reference, &map].map(|image| enlarged(image, ENLARGED)), 2)
}

fn table([prev, ours]: &[Image; 2], reference: &Image) -> String {
    let mut text = "x,y,prev_r,prev_g,prev_b,ours_r,ours_g,ours_b,ref_r,ref_g,ref_b\n".to_owned();
    let width = prev.width;
    for (i, pixel) in (0..).zip(prev.pixels.iter().zip(&ours.pixels).zip(&reference.pixels)) {
        let ((prev, ours), reference) = pixel;
        let _ = write!(text, "{},{}", i % width, i / width);
        [prev, ours, reference].into_iter().flatten().for_each(|value| text += &format!(",{value:.4}"));
        text.push('\n');
    }
    text
}

fn report(
    comparison: &Comparison<'_>,
    images: &[Image; 2],
    reference: &Reference,
    protocol: Protocol,
    origin: &str,
) -> Result<String, Error> {
    let intervals = comparison.intervals();
    let rmspe = |image| Ok::<_, Error>(metrics::compare(image, &reference.image())?.rmspe);
    let [prev, ours] = [rmspe(&images[0])?, rmspe(&images[1])?];
    let mut text = format!(
        "# What averaged visibility converges to under coloured lights\n\nFigure 2 of the supplement of Tokuyoshi, \
         *Efficient Visibility Reuse for Real-time ReSTIR*.\n\n{origin}\n![Four images]({PICTURE})\n\n\
         Above: what the visibility of the selected sample converges to (\"prev\") and the averaged one (\"ours\"). Below: \
         the reference, and the leak, the mean over the channels of abs(ours - prev) / ref, from black to white for {:.0} %.\n\n\
         The scene is a wall, lit past a board by a row of 24 small lights from red by way of green to blue, so that each \
         shadow edge has a colour. Biased ReSTIR as in algorithm 1 (preset `wis`, {} candidates); {} chains of {} frames, all of \
         which count; both methods have the same seeds. The reference is a path tracer's, {} samples a pixel.\n\n\
         ## Claims\n\n{}\n## Error\n\n| | percent |\n|---|---:|\n",
        100.0 * WHITE_LEAK,
        settings(protocol.size[1])[1].candidates,
        protocol.chains,
        protocol.warm_up + 1,
        reference.samples(),
        claim::table(&claims(&intervals)),
    );
    for (name, interval) in STATISTICS.iter().zip(&intervals) {
        let _ = writeln!(text, "| {name} | {interval} |");
    }
    let _ = write!(
        text,
        "\nOver all channels of the pixels whose reference is above a thousandth of the mean ({} of {} values). Squares are \
         products of the errors of two halves of the chains, so that noise adds nothing to them; brackets are 95 % intervals, \
         basic bootstrap over chains. Of the images as they are, noise and all: RMSPE({}, ref) {:.3} %, RMSPE({}, ref) {:.3} \
         %.\n\nThe paper has 15.3 % and 15.7 % for its scene, and says that the leak is 0.4 % in RMSPE. Read as the \
         difference of the two, that is {:.3} points here; read as the RMSPE of ours to prev, {:.3} %.\n",
        comparison.counts.len(),
        comparison.reference.len(),
        METHODS[0].0,
        prev,
        METHODS[1].0,
        ours,
        intervals[2].value,
        intervals[3].value,
    );
    Ok(text)
}

fn claims(intervals: &[Interval; STATISTICS.len()]) -> Vec<Claim> {
    let [prev, _, difference, direct, mean_of_prev, mean_of_ours] = intervals;
    let claim = |id, text, found: &Interval, range| Claim::of_interval(id, text, SCENE, Some(*found), range);
    let darker = [f64::NEG_INFINITY, 0.0];
    let small = [f64::NEG_INFINITY, SMALL * prev.ends[0]];
    let of_difference = "the leak as difference of the RMSPEs is less than a third of prev's RMSPE";
    let of_ours = "the leak as RMSPE of ours to prev is less than a third of prev's RMSPE";
    vec![
        claim("T22", "prev is darker than the reference, mean error in %", mean_of_prev, darker),
        claim("T22", "ours is darker than the reference, mean error in %", mean_of_ours, darker),
        claim("T21", "ours has a larger RMSPE than prev, in points", difference, [0.0, f64::INFINITY]),
        claim("T21", of_difference, difference, small),
        claim("T21", of_ours, direct, small),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chains whose noise alone would be an RMSPE of some 10 %, at known distances from the truth.
    #[test]
    fn noise_is_taken_off_and_intervals_hold_the_truth() {
        let values = 600;
        // the same for both methods, as their seeds are
        let unit = |chain: u32, i: u32| {
            let word = restir_shared::rng::pcg4d(restir_shared::glam::UVec4::new(0, chain, i, 3)).x;
            f64::from(word) * 2.0_f64.powi(-32)
        };
        let chains = [0.9, 0.88].map(|mean| {
            let image = |chain| (0..values).map(|i| mean * (1.0 + 1.4 * (unit(chain, i) - 0.5))).collect();
            Chains { seconds: Vec::new(), images: (0..16).map(image).collect() }
        });
        let count = values as usize;
        let comparison = Comparison {
            chains: &chains,
            reference: vec![1.0; count],
            noise: vec![0.0; count],
            counts: (0..count).collect(),
        };
        let found = comparison.intervals();
        for (interval, truth) in found.iter().zip([10.0, 12.0, 2.0, 2.0, -10.0, -12.0]) {
            assert_eq!(interval.inside(truth - 3.0, truth + 3.0), Some(true), "{interval} for {truth}");
        }
        // the known-wrong figure, which keeps the noise: its own RMSPE is 100 * 0.9 * 1.4 / sqrt(12 * 16) = 9.1 %
        let mean = |i: usize| chains[0].images.iter().map(|image| image[i]).sum::<f64>() / 16.0;
        let raw = 100.0 * ((0..count).map(|i| (mean(i) - 1.0).powi(2)).sum::<f64>() / count as f64).sqrt();
        assert_eq!(found[0].inside(raw, f64::INFINITY), Some(false), "{raw} {}", found[0]);
    }
}
