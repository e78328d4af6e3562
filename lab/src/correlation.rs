//! How errors of frames hang together: what reuse does to noise beside making it less.
//!
//! A frame that reuses others' samples has their errors as well. Neighbours then err alike, which the eye sees as blobs, and so do frames
//! after each other, so that their mean converges more slowly than their noise suggests, and a denoiser takes errors for the picture.
//! With e the error of a value (a channel of a pixel of a frame), all channels counting alike:
//!
//! | measure | definition |
//! |---|---|
//! | correlation over time | `ρ(τ) = mean e_t(p) e_{t+τ}(p) / mean e²` |
//! | correlation over pixels | `ρ(d) = mean e_t(p) e_t(p + d) / mean e²` |
//! | variance inflation | `VIF_K = K mean (mean of K frames' e)² / mean e²`: 1 of independent frames, K of equal ones |
//! | block shift | mean over blocks and channels of `abs mean e`, less `sqrt(2 / π)` of the standard deviation that the mean of independent errors would have |
//! | error by age | mean e² of the pixels whose surface has been seen for so many frames: after disocclusion it is that of a frame without history |
//!
//! A quotient of sums without terms, or over no error, is NaN. The frames are those of a view that stands still, after warm-up.
//!
//! ```
//! use restir_lab::correlation::{Errors, over_time};
//! use restir_host::image::Image;
//!
//! let frame = |pixels: [f32; 2]| Image { width: 2, height: 1, pixels: pixels.map(|x| [x; 3]).to_vec() };
//! let reference = frame([1.0, 1.0]);
//! // the first pixel keeps its error, that of the second one alternates
//! let frames = [frame([2.0, 2.0]), frame([2.0, 0.0]), frame([2.0, 2.0]), frame([2.0, 0.0])];
//! let errors = Errors::new(&frames, &reference)?;
//! assert_eq!(errors.over_time(1), 0.0);
//! assert_eq!(errors.over_time(2), 1.0);
//! // the mean of two frames has lost the error of one pixel, and none of the other's
//! assert_eq!(errors.variance_inflation(2), 1.0);
//! // a row over time, to be looked at
//! assert_eq!((over_time(&frames, 0)?.width, over_time(&frames, 0)?.height), (2, 4));
//! # Ok::<(), restir_host::Error>(())
//! ```

use restir_host::Error;
use restir_host::image::Image;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_2_PI;

/// Errors of frames of a size.
#[derive(Clone, Debug)]
pub struct Errors {
    width: usize,
    height: usize,
    /// Frame by frame and pixel by pixel.
    frames: Vec<Vec<[f64; 3]>>,
}

/// A mean of products.
#[derive(Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, x: f64) {
        self.sum += x;
        self.count += 1.0;
    }

    fn value(self) -> f64 {
        self.sum / self.count
    }
}

impl Errors {
    /// The errors of frames.
    ///
    /// # Errors
    /// [`Error::Setting`] if there are no frames or pixels, or the sizes differ.
    pub fn new(frames: &[Image], reference: &Image) -> Result<Self, Error> {
        check(frames)?;
        check(&[frames[0].clone(), reference.clone()])?;
        let error = |(x, r): (&[f32; 3], &[f32; 3])| std::array::from_fn(|i| f64::from(x[i]) - f64::from(r[i]));
        let of_frame = |frame: &Image| frame.pixels.iter().zip(&reference.pixels).map(error).collect();
        Ok(Self {
            width: reference.width as usize,
            height: reference.height as usize,
            frames: frames.iter().map(of_frame).collect(),
        })
    }

    /// Mean squared error of a value.
    pub fn squared(&self) -> f64 {
        let mut mean = Mean::default();
        self.frames.iter().flatten().flatten().for_each(|e| mean.add(e * e));
        mean.value()
    }

    /// ρ(τ): the correlation of a pixel's errors that many frames apart.
    pub fn over_time(&self, lag: usize) -> f64 {
        let mut mean = Mean::default();
        for (a, b) in self.frames.iter().zip(self.frames.iter().skip(lag)) {
            a.iter().flatten().zip(b.iter().flatten()).for_each(|(a, b)| mean.add(a * b));
        }
        mean.value() / self.squared()
    }

    /// ρ(d): the correlation of the errors of pixels that lie so many columns and rows apart.
    pub fn over_pixels(&self, [dx, dy]: [i32; 2]) -> f64 {
        let mut mean = Mean::default();
        for (x, y) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))) {
            let there = x.checked_add_signed(dx as isize).zip(y.checked_add_signed(dy as isize));
            let Some((u, v)) = there.filter(|&(u, v)| u < self.width && v < self.height) else { continue };
            for frame in &self.frames {
                let (a, b) = (frame[y * self.width + x], frame[v * self.width + u]);
                a.iter().zip(b).for_each(|(a, b)| mean.add(a * b));
            }
        }
        mean.value() / self.squared()
    }

    /// `VIF_K`, of stretches of K frames after each other that have none in common; K is at least 1.
    pub fn variance_inflation(&self, k: usize) -> f64 {
        let mut mean = Mean::default();
        for stretch in self.frames.chunks_exact(k.max(1)) {
            for i in 0..3 * self.width * self.height {
                let e = stretch.iter().map(|frame| frame[i / 3][i % 3]).sum::<f64>() / k as f64;
                mean.add(e * e);
            }
        }
        k as f64 * mean.value() / self.squared()
    }

    /// How far the colour of blocks of `side` x `side` pixels is off, mean over channels, blocks and frames, beyond what errors that do not
    /// depend on each other would do, taken to be normal in the mean. Blocks at the borders may be smaller.
    pub fn block_shift(&self, side: usize) -> f64 {
        let side = side.max(1);
        let mut mean = Mean::default();
        let corners = (0..self.height).step_by(side).flat_map(|y| (0..self.width).step_by(side).map(move |x| (x, y)));
        for ((x, y), frame) in corners.flat_map(|corner| self.frames.iter().map(move |frame| (corner, frame))) {
            let (columns, rows) = (x..self.width.min(x + side), y..self.height.min(y + side));
            let pixels: Vec<[f64; 3]> = rows
                .flat_map(|y| columns.clone().map(move |x| (x, y)))
                .map(|(x, y)| frame[y * self.width + x])
                .collect();
            let count = pixels.len() as f64;
            for channel in 0..3 {
                let sum: f64 = pixels.iter().map(|e| e[channel]).sum();
                let squared: f64 = pixels.iter().map(|e| e[channel] * e[channel]).sum();
                mean.add((sum.abs() - (FRAC_2_PI * squared).sqrt()) / count);
            }
        }
        mean.value()
    }

    /// The number of pixels of each age and the mean squared error of their values, in the frame of that index.
    ///
    /// # Errors
    /// [`Error::Setting`] if there is no such frame, or not an age for each pixel.
    pub fn by_age(&self, frame: usize, ages: &[u32]) -> Result<BTreeMap<u32, (u64, f64)>, Error> {
        let errors = self.frames.get(frame).filter(|errors| errors.len() == ages.len());
        let errors = errors.ok_or_else(|| {
            let (frames, ages, pixels) = (self.frames.len(), ages.len(), self.width * self.height);
            Error::Setting(format!(
                "{ages} ages were given of frame {frame}; {frames} frames of {pixels} pixels have errors"
            ))
        })?;
        let mut means: BTreeMap<u32, Mean> = BTreeMap::new();
        for (errors, age) in errors.iter().zip(ages) {
            errors.iter().for_each(|e| means.entry(*age).or_default().add(e * e));
        }
        Ok(means.into_iter().map(|(age, mean)| (age, (mean.count as u64 / 3, mean.value()))).collect())
    }
}

/// A row of each frame, one below the other: column x and row t have what the pixel x of the row was in frame t. Errors that stay look like
/// upright streaks, those that neighbours share like lying ones.
///
/// # Errors
/// [`Error::Setting`] if there are no frames, their sizes differ, or they have no such row.
pub fn over_time(frames: &[Image], row: u32) -> Result<Image, Error> {
    check(frames)?;
    let Image { width, height, .. } = frames[0];
    if row >= height {
        return Err(Error::Setting(format!("the frames have {height} rows, and none of index {row}")));
    }
    let first = row as usize * width as usize;
    let of_frame = |frame: &Image| frame.pixels[first..][..width as usize].to_vec();
    Ok(Image { width, height: frames.len() as u32, pixels: frames.iter().flat_map(of_frame).collect() })
}

/// For how many frames pixels have seen their surfaces, by where each of them was in the last frame (index of the pixel), if it was seen
/// there. A surface that comes into view has the age 0.
pub fn ages(last: &[u32], before: &[Option<usize>]) -> Vec<u32> {
    let age = |&was: &Option<usize>| was.and_then(|pixel| last.get(pixel)).map_or(0, |age| age.saturating_add(1));
    before.iter().map(age).collect()
}

fn check(frames: &[Image]) -> Result<(), Error> {
    let size = |image: &Image| (image.width, image.height, image.pixels.len());
    let problem = match frames {
        [] => "there are no frames to be compared",
        [first, ..] if first.pixels.is_empty() => "images without pixels cannot be compared",
        [first, others @ ..] if others.iter().any(|other| size(other) != size(first)) => {
            "images of different sizes cannot be compared"
        }
        _ => return Ok(()),
    };
    Err(Error::Setting(problem.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of errors in the first channel; the others have none.
    fn errors(width: u32, frames: &[&[f32]]) -> Errors {
        let image = |pixels: &[f32]| Image {
            width,
            height: pixels.len() as u32 / width,
            pixels: pixels.iter().map(|&x| [x + 4.0, 1.0, 2.0]).collect(),
        };
        let images: Vec<Image> = frames.iter().map(|frame| image(frame)).collect();
        Errors::new(&images, &image(&vec![0.0; frames[0].len()])).expect("of a size")
    }

    #[test]
    fn errors_that_repeat_are_correlated() {
        let e = errors(2, &[&[1.0, 2.0], &[1.0, -2.0], &[1.0, 2.0], &[1.0, -2.0]]);
        assert_eq!(e.squared(), 20.0 / 24.0);
        // three pairs of frames: (1 - 4) each; two pairs: (1 + 4) each
        assert_eq!(e.over_time(0), 1.0);
        assert_eq!(e.over_time(1), (3.0 * -3.0 / 18.0) / (20.0 / 24.0));
        assert_eq!(e.over_time(2), 1.0);
        assert!(e.over_time(4).is_nan());
        // means of two frames: errors 1 and 0
        assert_eq!(e.variance_inflation(1), 1.0);
        assert_eq!(e.variance_inflation(2), 2.0 * (2.0 / 12.0) / (20.0 / 24.0));
        assert!(e.variance_inflation(5).is_nan());
        // frames that are equal are worth one, those that cancel nothing at all
        assert_eq!(errors(1, &[&[3.0_f32][..]; 16]).variance_inflation(16), 16.0);
        assert_eq!(errors(1, &[&[3.0], &[-3.0]]).variance_inflation(2), 0.0);
    }

    #[test]
    fn errors_that_neighbours_share_are_correlated() {
        let e = errors(3, &[&[1.0, 2.0, 3.0, 0.0, -1.0, 4.0]]);
        let squared = 31.0 / 18.0;
        assert_eq!(e.over_pixels([1, 0]), ((2.0 + 6.0 - 4.0) / 12.0) / squared);
        assert_eq!(e.over_pixels([-1, 0]), e.over_pixels([1, 0]));
        assert_eq!(e.over_pixels([0, 1]), ((-2.0 + 12.0) / 9.0) / squared);
        assert_eq!(e.over_pixels([1, 1]), ((-1.0 + 8.0) / 6.0) / squared);
        assert_eq!(e.over_pixels([-2, 1]), 0.0);
        assert!(e.over_pixels([3, 0]).is_nan());
    }

    #[test]
    fn blocks_of_one_colour_are_shifted() {
        let independent = FRAC_2_PI.sqrt();
        // blocks of 2 x 2: all errors alike, none in the mean; the third is cut by the border
        let e = errors(5, &[&[1.0, 1.0, 2.0, -2.0, 3.0, 1.0, 1.0, -2.0, 2.0, 3.0]]);
        let expected = [
            1.0 - independent * (4.0_f64).sqrt() / 4.0,
            -independent * (16.0_f64).sqrt() / 4.0,
            3.0 - independent * (18.0_f64).sqrt() / 2.0,
        ];
        assert!((e.block_shift(2) - expected.iter().sum::<f64>() / 9.0).abs() < 1e-15);
        // single pixels are off by |e| where independent errors of that size would be by sqrt(2 / π) |e|
        assert!((errors(1, &[&[2.0]]).block_shift(1) - 2.0 * (1.0 - independent) / 3.0).abs() < 1e-15);
    }

    #[test]
    fn what_comes_into_view_is_young() {
        let first = ages(&[], &[None; 4]);
        let second = ages(&first, &[Some(0), Some(0), Some(1), None]);
        let third = ages(&second, &[None, Some(0), Some(3), Some(9)]);
        assert_eq!((&first[..], &second[..], &third[..]), (&[0; 4][..], &[1, 1, 1, 0][..], &[0, 2, 1, 0][..]));
        let e = errors(4, &[&[0.0; 4], &[3.0, 1.0, 2.0, 3.0]]);
        let by_age = e.by_age(1, &third).expect("an age each");
        assert_eq!(by_age.into_iter().collect::<Vec<_>>(), [(0, (2, 3.0)), (1, (1, 4.0 / 3.0)), (2, (1, 1.0 / 3.0))]);
        assert!(e.by_age(2, &third).is_err() && e.by_age(1, &third[1..]).is_err());
    }

    #[test]
    fn a_row_over_time_is_that_row() {
        let image = |pixels: [f32; 4]| Image { width: 2, height: 2, pixels: pixels.map(|x| [x; 3]).to_vec() };
        let frames = [image([1.0, 2.0, 3.0, 4.0]), image([5.0, 6.0, 7.0, 8.0]), image([0.0; 4])];
        let plot = over_time(&frames, 1).expect("a row");
        let pixels = [3.0, 4.0, 7.0, 8.0, 0.0, 0.0].map(|x| [x; 3]).to_vec();
        assert_eq!(plot, Image { width: 2, height: 3, pixels });
        assert!(over_time(&frames, 2).is_err() && over_time(&[], 0).is_err());
        let other = Image { width: 4, height: 1, ..frames[0].clone() };
        assert!(over_time(&[frames[0].clone(), other.clone()], 0).is_err() && Errors::new(&frames, &other).is_err());
    }
}
