//! How far parts differ, and what that says of the error of their mean.

use super::cover::{Cell, cells};
use super::file::PartFile;
use super::header::{Tile, Unit};
use crate::Error;
use restir_shared::layout::FilmPixel;

/// How noisy the mean of parts is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The standard error of the mean's values, root mean square over the image, relative to the image's mean.
    pub relative: f64,
    /// How many samples or chains the mean has.
    pub count: u32,
}

impl Noise {
    /// How many samples or chains bring it down to `goal`, as far as the error falls with the root of their number; a multiple of `step`. None, if
    /// there are not as many: they are numbered by 32 bits.
    pub fn wanted(&self, goal: f64, step: u32) -> Option<u32> {
        let step = f64::from(step.max(1));
        let wanted = f64::from(self.count) * (self.relative / goal).powi(2);
        let wanted = ((wanted / step).ceil() * step).max(f64::from(self.count));
        (wanted < f64::from(u32::MAX)).then_some(wanted as u32)
    }
}

/// Sums over the values of an image.
#[derive(Default)]
struct Spread {
    /// Variances of single samples.
    variances: f64,
    means: f64,
    values: f64,
}

/// The noise of the image that [`super::merge`] makes of the parts, by how far their blocks differ. Blocks of chains are independent. Those of samples are spread
/// over the pixel together, so that this is expected to say too much for them, not too little.
///
/// # Errors
/// As of [`super::merge`]; [`Error::Setting`] of frames, which depend on each other, and of a single block.
pub fn noise(parts: &[PartFile]) -> Result<Noise, Error> {
    let (cells, count) = cells(parts)?;
    if parts[0].header().unit == Unit::Frames {
        let problem =
            "frames of a chain depend on each other, so that they do not say how noisy their mean is; render chains";
        return Err(Error::Setting(problem.to_owned()));
    }
    let mut spread = Spread::default();
    for Cell { rectangle, parts } in &cells {
        rectangle.bands().try_for_each(|band| spread.add(band, parts))?;
    }
    let Spread { variances, means, values } = spread;
    let error = (variances / values / f64::from(count)).sqrt();
    let relative = if error == 0.0 { 0.0 } else { error / (means / values).abs() };
    Ok(Noise { relative, count })
}

impl Spread {
    fn add(&mut self, rectangle: Tile, parts: &[&PartFile]) -> Result<(), Error> {
        let values = 3 * rectangle.pixels();
        // of each value, over the blocks: how many samples, their sum, and sums squared over the samples of the block
        let (mut samples, mut blocks) = (0.0, 0.0);
        let (mut sums, mut squares) = (vec![0.0; values], vec![0.0; values]);
        for part in parts {
            for (&(_, log2), plane) in part.header().blocks.iter().zip(part.read(rectangle)?) {
                let of_block = f64::from(log2).exp2();
                samples += of_block;
                blocks += 1.0;
                let plane = plane.iter().flat_map(|FilmPixel { sum, .. }| sum.map(f64::from));
                for ((sum, square), value) in sums.iter_mut().zip(&mut squares).zip(plane) {
                    *sum += value;
                    *square += value * value / of_block;
                }
            }
        }
        if blocks < 2.0 {
            let problem = "a single block of samples does not say how noisy it is; give more parts";
            return Err(Error::Setting(problem.to_owned()));
        }
        let of = |(sum, square): (&f64, &f64)| (square - sum * sum / samples).max(0.0) / (blocks - 1.0);
        self.variances += sums.iter().zip(&squares).map(of).sum::<f64>();
        self.means += sums.iter().sum::<f64>() / samples;
        self.values += values as f64;
        Ok(())
    }
}
