//! Random numbers: a value is a function of (pixel, sample, dimension, seed) and nothing else, so it does not depend on the order
//! of execution, and a technique can replay any draw. All arithmetic is that of integers.
//!
//! [`Rng::hash`] gives independent numbers, by the mixer pcg4d (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", JCGT
//! 9(3)). [`Rng::draw`] gives numbers that are spread over the samples of a pixel as its [`Sampler`] says.
//!
//! ```
//! use restir_shared::rng::{Rng, Sampler, unit};
//!
//! // the numbers of sample 5 of the pixel (3, 4) with the seed 7: asked again, they are the same
//! let rng = Rng::new(3, 4, 5, 7, Sampler::Sobol);
//! assert_eq!(rng.draw(2), Rng::from_key(rng.key(), Sampler::Sobol).draw(2));
//! assert_ne!(rng.draw(2), rng.draw(3));
//!
//! // the first 16 samples of a pixel are spread: each sixteenth of [0, 1) has one of their numbers
//! let mut sixteenths = [0; 16];
//! for sample in 0..16 {
//!     let u = unit(rng.of_sample(sample).draw(2).x);
//!     sixteenths[(u * 16.0) as usize] += 1;
//! }
//! assert_eq!(sixteenths, [1; 16]);
//! ```

mod order;
mod owen;
mod sobol;

// how samplers are made
#[doc(hidden)]
pub use order::reordered;
#[doc(hidden)]
pub use owen::scramble;
#[doc(hidden)]
pub use sobol::sobol;

use glam::{UVec3, UVec4, Vec2};

/// 2^32 over the plastic number and over its square: the R2 sequence (Roberts 2018), whose every stretch is well spread.
const R2: [u32; 2] = [3_242_174_889, 2_447_445_414];

/// Four independent 32-bit random words.
#[doc(hidden)]
#[inline(always)]
pub fn pcg4d(key: UVec4) -> UVec4 {
    let mix = |v: UVec4| {
        let x = v.x.wrapping_add(v.y.wrapping_mul(v.w));
        let y = v.y.wrapping_add(v.z.wrapping_mul(x));
        let z = v.z.wrapping_add(x.wrapping_mul(y));
        let w = v.w.wrapping_add(y.wrapping_mul(z));
        UVec4::new(x, y, z, w)
    };
    let lcg = |x: u32| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let fold = |x: u32| x ^ (x >> 16);
    let v = mix(UVec4::new(lcg(key.x), lcg(key.y), lcg(key.z), lcg(key.w)));
    mix(UVec4::new(fold(v.x), fold(v.y), fold(v.z), fold(v.w)))
}

/// The numbers that [`unit`] gives are the multiples of 1 / CELLS.
pub(crate) const CELLS: f32 = 16_777_216.0;

/// The upper 24 bits of a random word as a number in [0, 1); exact.
#[inline(always)]
pub fn unit(word: u32) -> f32 {
    (word >> 8) as f32 * crate::num::UNIT_ROUNDOFF
}

/// The n-th point of the R2 sequence in the unit square, shifted by the words.
#[doc(hidden)]
#[inline(always)]
pub fn r2(shift: [u32; 2], n: u32) -> Vec2 {
    Vec2::new(unit(shift[0].wrapping_add(R2[0].wrapping_mul(n))), unit(shift[1].wrapping_add(R2[1].wrapping_mul(n))))
}

/// Dimensions of a stream.
pub(crate) const STREAM_DIMENSIONS: u32 = 1 << 24;

/// The first dimension of a stream, of which there are 256. Techniques that share a pixel, a sample and a seed, and whose numbers
/// have to be independent, draw from streams of their own; all that one sample needs lies in one stream.
pub const fn stream(id: u8) -> u32 {
    id as u32 * STREAM_DIMENSIONS
}

/// How the numbers that the samples of a pixel draw in a dimension are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// They are independent.
    Independent,
    /// They are points of Sobol's sequence in four dimensions (`sobol`), with the indices shuffled and the coordinates scrambled
    /// as Owen (1995) has it ([`scramble`]), otherwise for each pixel, dimension and seed (Burley 2020, "Practical Hash-based Owen
    /// Scrambling", JCGT 9(4)). So numbers of different pixels, dimensions or seeds are independent, each number is uniform, and the
    /// samples of every aligned stretch of 2^m are spread evenly: the first two words best, then the third, then the fourth.
    #[default]
    Sobol,
}

impl Sampler {
    /// All samplers with their names.
    pub const NAMED: [(&'static str, Self); 2] = [("independent", Self::Independent), ("sobol", Self::Sobol)];
}

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rng {
    pixel: u32,
    sample: u32,
    seed: u32,
    sampler: Sampler,
    /// Of the sample's point in dimension 0. It takes a hash, which code that draws jointly in several places has once.
    index: u32,
}

/// An odd factor, 2^32 over the golden ratio: with it two independent words make a third that is independent of each of them.
const GOLDEN: u32 = 0x9e37_79b9;

impl Rng {
    /// Pixel coordinates are below 2^16.
    #[inline(always)]
    pub fn new(x: u32, y: u32, sample: u32, seed: u32, sampler: Sampler) -> Self {
        Self::from_key(UVec3::new(x | (y << 16), sample, seed), sampler)
    }

    /// What the numbers are a function of, beside the sampler: who stores it can draw them again, at any other pixel
    /// ([`Self::from_key`]).
    #[doc(hidden)]
    #[inline(always)]
    pub fn key(&self) -> UVec3 {
        UVec3::new(self.pixel, self.sample, self.seed)
    }

    /// The random numbers of a key that [`Self::key`] gave.
    #[doc(hidden)]
    #[inline(always)]
    pub fn from_key(key: UVec3, sampler: Sampler) -> Self {
        let first = Self { pixel: key.x, sample: 0, seed: key.z, sampler, index: 0 };
        Self { sample: key.y, index: shuffled(key.y, first.hash(0)), ..first }
    }

    /// The numbers of another sample of the pixel.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn of_sample(self, sample: u32) -> Self {
        Self::from_key(UVec3::new(self.pixel, sample, self.seed), self.sampler)
    }

    /// The numbers of another pixel, whose coordinates are below 2^16.
    #[inline(always)]
    #[must_use]
    pub fn at(self, x: u32, y: u32) -> Self {
        Self::new(x, y, self.sample, self.seed, self.sampler)
    }

    /// The numbers that [`Sampler::Independent`] draws.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn independent(self) -> Self {
        Self { sampler: Sampler::Independent, ..self }
    }

    /// Four random words for a dimension, spread over the pixel's samples. A technique gives each of its decisions a dimension of
    /// its own, and the first two words to what they are to choose together: a point, or a direction.
    ///
    /// By [`Sampler::Sobol`] 2^m samples, from a multiple of 2^m on, have 2^t points in every elementary box of volume 2^(t - m) (a
    /// (t, m, s)-net): t is 0 of each word and of the first two, 1 of the first and third and of the second and third, 2 of the fourth
    /// and the first or second, 3 of the last two and of all four.
    #[inline(always)]
    pub fn draw(&self, dimension: u32) -> UVec4 {
        let words = self.scrambles(dimension);
        if self.spreads() { spread(shuffled(self.sample, words), words) } else { words }
    }

    /// Four random words for a dimension, which are spread as [`Self::draw`] has it and also jointly with those that dimension 0 draws
    /// and with those of every other dimension that is drawn by this function. It is for decisions whose integrand is not a sum of
    /// functions of one of them each, such as where in the pixel a path begins and which point of a light it sees from there.
    ///
    /// All of them take the shuffled index that dimension 0 has, each in an order of its own ([`reordered`]), and scrambles of their own, so
    /// that the numbers of a sample are independent. The orders were found by search for dimensions 0, 2, 3, 5 and 6: of the first two words
    /// in one of these with the first two in another, t is 0, 1, 2, 3, 4, 5, 4, 4, 4, 5, 5 and 6 at most for 2^1 to 2^12 samples.
    #[inline(always)]
    pub fn draw_jointly(&self, dimension: u32) -> UVec4 {
        let words = self.scrambles(dimension);
        if self.spreads() { spread(reordered(self.index, dimension), words) } else { words }
    }

    #[inline(always)]
    fn spreads(&self) -> bool {
        self.sampler == Sampler::Sobol
    }

    /// What scrambles the numbers of a dimension or, if they are not spread, the numbers: one hash for both, so that code that
    /// knows the sampler only when it runs has it once.
    #[inline(always)]
    fn scrambles(&self, dimension: u32) -> UVec4 {
        Self { sample: if self.spreads() { 0 } else { self.sample }, ..*self }.hash(dimension)
    }

    /// Four independent random words for a dimension in which nothing is drawn by [`Self::draw`]: for decisions that gain nothing
    /// by being spread.
    #[inline(always)]
    pub fn hash(&self, dimension: u32) -> UVec4 {
        pcg4d(UVec4::new(self.pixel, self.sample, dimension, self.seed))
    }
}

/// The index of a sample's point, which four independent words choose.
#[inline(always)]
fn shuffled(sample: u32, seeds: UVec4) -> u32 {
    // reversed, because aligned stretches of indices stay together if each bit depends on the higher ones alone
    scramble(sample.reverse_bits(), seeds.x.wrapping_add(seeds.y.wrapping_mul(GOLDEN))).reverse_bits()
}

/// The point of an index, scrambled by four independent words.
#[inline(always)]
fn spread(index: u32, seeds: UVec4) -> UVec4 {
    let point = sobol(index);
    UVec4::new(
        scramble(point.x, seeds.x).reverse_bits(),
        scramble(point.y, seeds.y).reverse_bits(),
        scramble(point.z, seeds.z).reverse_bits(),
        scramble(point.w, seeds.w).reverse_bits(),
    )
}
