//! z-tests between two independent sets of images, per tile and for the whole image, with their power.

use super::{Moments, POWER, moments, sidak, two_sided_threshold, upper_tail_quantile};

/// Images that one task makes.
const CHUNK: u64 = 64;
/// The arithmetic's own error, relative to a mean: some twenty roundings of an `f32`.
const ARITHMETIC: f64 = 1.0e-6;

/// How an image is divided. One image gives a number for each channel of each tile, then of the whole image.
#[derive(Clone, Copy, Debug)]
pub struct TileGrid {
    /// Width of the image in pixels, a multiple of the tile's.
    pub width: u32,
    /// Height of the image in pixels, a multiple of the tile's.
    pub height: u32,
    /// Side of a tile in pixels.
    pub tile: u32,
}

impl TileGrid {
    fn columns(self) -> u32 {
        self.width / self.tile
    }

    fn tiles(self) -> usize {
        (self.columns() * (self.height / self.tile)) as usize
    }

    /// Numbers that one image gives.
    fn numbers(self) -> usize {
        3 * (self.tiles() + 1)
    }

    fn name(self, number: usize) -> String {
        let channel = ["red", "green", "blue"][number % 3];
        let tile = (number / 3) as u32;
        if number / 3 == self.tiles() {
            format!("image, {channel}")
        } else {
            format!("tile ({}, {}), {channel}", tile % self.columns(), tile / self.columns())
        }
    }

    /// The means of an image given by its pixels' radiance.
    fn means(self, pixel: impl Fn(u32, u32) -> [f64; 3]) -> Vec<f64> {
        let mut sums = vec![0.0; self.numbers()];
        let per_tile = 1.0 / f64::from(self.tile * self.tile);
        let per_image = 1.0 / f64::from(self.width * self.height);
        let image = 3 * self.tiles();
        for y in 0..self.height {
            for x in 0..self.width {
                let tile = 3 * (y / self.tile * self.columns() + x / self.tile) as usize;
                for (channel, value) in pixel(x, y).into_iter().enumerate() {
                    sums[tile + channel] += value * per_tile;
                    sums[image + channel] += value * per_image;
                }
            }
        }
        sums
    }

    /// Moments over independent images; `pixel(restart, x, y)` is an estimate of the pixel's radiance.
    pub fn moments(self, restarts: u32, pixel: impl Fn(u32, u32, u32) -> [f64; 3] + Sync) -> Vec<Moments> {
        let means = |restart| self.means(|x, y| pixel(restart as u32, x, y));
        moments(restarts.into(), CHUNK, self.numbers(), means)
    }

    /// Moments over independent images given by their pixels' radiance, rows from top to bottom.
    pub fn moments_of(self, images: &[Vec<[f64; 3]>]) -> Vec<Moments> {
        self.moments(images.len() as u32, |image, x, y| images[image as usize][(y * self.width + x) as usize])
    }

    /// The moments of an image that is known.
    pub fn exact(self, pixel: impl Fn(u32, u32) -> [f64; 3]) -> Vec<Moments> {
        self.means(pixel).into_iter().map(Moments::exact).collect()
    }
}

/// A family of z-tests over the tiles of an image.
#[derive(Clone, Copy, Debug)]
pub struct TileTest {
    /// The tiles.
    pub grid: TileGrid,
    /// How often the family is wrong about equal expectations.
    pub family_rate: f64,
}

/// What a [`TileTest`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// The largest |z|.
    pub max_z: f64,
    /// Where it is.
    pub worst: String,
    /// Its relative difference.
    pub worst_difference: f64,
    /// The |z| beyond which expectations differ.
    pub threshold: f64,
    /// The relative bias of a tile that is noticed with 99 % probability, for the worst tile and channel.
    pub detectable_in_tile: f64,
    /// The same for the image's mean.
    pub detectable_in_image: f64,
}

impl Verdict {
    /// Whether nothing differs.
    pub fn passed(&self) -> bool {
        self.max_z <= self.threshold
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "max |z| {:.2} of {:.2} in {} ({:+.3} %), detectable bias {:.3} % of a tile, {:.3} % of the image",
            self.max_z,
            self.threshold,
            self.worst,
            100.0 * self.worst_difference,
            100.0 * self.detectable_in_tile,
            100.0 * self.detectable_in_image
        )
    }
}

impl TileTest {
    /// Compares moments of `grid`; relative figures refer to `reference`.
    pub fn compare(&self, tested: &[Moments], reference: &[Moments]) -> Verdict {
        let threshold = two_sided_threshold(sidak(self.family_rate, tested.len()));
        let reach = threshold + upper_tail_quantile(1.0 - POWER);
        let mut verdict = Verdict { threshold, ..Verdict::default() };
        for (number, (a, b)) in tested.iter().zip(reference).enumerate() {
            let error = (a.variance_of_mean() + b.variance_of_mean() + (ARITHMETIC * b.mean()).powi(2)).sqrt();
            if error == 0.0 && a.mean() == b.mean() {
                continue;
            }
            let difference = a.mean() - b.mean();
            let z = (difference / error).abs();
            let z = if z.is_nan() { f64::INFINITY } else { z };
            if z > verdict.max_z {
                (verdict.max_z, verdict.worst) = (z, self.grid.name(number));
                verdict.worst_difference = difference / b.mean();
            }
            let is_tile = number < 3 * self.grid.tiles();
            let Verdict { detectable_in_tile, detectable_in_image, .. } = &mut verdict;
            let detectable = if is_tile { detectable_in_tile } else { detectable_in_image };
            *detectable = detectable.max(error * reach / b.mean());
        }
        verdict
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    const TEST: TileTest = TileTest { grid: TileGrid { width: 4, height: 2, tile: 2 }, family_rate: 1e-3 };

    fn noise(stream: u64, scale: f64) -> Vec<Moments> {
        TEST.grid.moments(2000, |restart, x, y| {
            let key = (u64::from(restart) * 4 + u64::from(x)) * 2 + u64::from(y);
            let mut random = SplitMix::new(key ^ stream << 40);
            [scale; 3].map(|scale| scale * (0.5 + random.unit()))
        })
    }

    #[test]
    fn equal_noise_passes_and_a_bias_of_the_stated_size_does_not() {
        let verdict = TEST.compare(&noise(1, 1.0), &noise(2, 1.0));
        assert!(verdict.passed(), "{verdict}");
        let biased = TEST.compare(&noise(1, 1.0 + verdict.detectable_in_tile), &noise(2, 1.0));
        assert!(!biased.passed(), "{biased}");
    }

    #[test]
    fn what_is_not_a_number_fails() {
        let exact = TEST.grid.exact(|_, _| [1.0; 3]);
        assert!(TEST.compare(&exact, &exact).passed());
        assert!(!TEST.compare(&TEST.grid.exact(|_, _| [f64::NAN; 3]), &exact).passed());
        assert!(!TEST.compare(&TEST.grid.exact(|_, _| [1.0001; 3]), &exact).passed());
    }
}
