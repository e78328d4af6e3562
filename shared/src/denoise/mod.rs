//! A denoiser: neighbours on the same surface are averaged, over space and frames, as far as noise explains their difference.
//!
//! It is the spatiotemporal variance-guided filter of Schied et al. 2017 ("Spatiotemporal Variance-Guided Filtering", SVGF), but that no light is lost. A
//! frame goes through kernels, each a function of this module once a pixel:
//!
//! | function | makes of it |
//! |---|---|
//! | [`guide()`] | what the pixel sees: depth, normal, object, reflectance, and where the last frame saw the same point |
//! | [`accumulate()`] | light over reflectance, averaged with the last frame's ([`History`]), and moments of its luminance |
//! | [`contrast()`] | how its mean differs from the next ones |
//! | [`estimate()`] | the variance of that mean: over frames, or over neighbours where there are too few |
//! | [`share()`] and [`filter()`] | one round of an edge-avoiding à-trous filter (Dammertz et al. 2010), of 5 x 5 pixels that are 1, 2, 4, ... apart |
//! | [`modulate()`] | light, of the filtered one and the reflectance |
//!
//! Each pixel of the result is light of its neighbourhood: a weighted mean over pixels that see the same object. A pixel that
//! is far brighter than its neighbours, which agree, stays as it is, and nobody takes from it.
//!
//! ```
//! use restir_shared::denoise::{DenoiseParams, Estimate, Guide, History, Reflectance, filter, share};
//! use restir_shared::glam::Vec3;
//!
//! // a wall of 8 x 8 pixels in front of the camera, on which every other pixel is black
//! let params = DenoiseParams { width: 8, height: 8, ..DenoiseParams::default() };
//! let guides = [Guide::new(1.0, [0.0; 2], Vec3::Z, 1); 64];
//! let means = [History { reflectance: Reflectance::new(Vec3::splat(0.5)), ..History::default() }; 64];
//! let shares: Vec<_> = (0..64).map(|i| share(&params, &guides, &means, [i % 8, i / 8])).collect();
//! let noisy: Vec<_> = (0..64).map(|i| Estimate { color: [(i % 2) as f32; 3], variance: 0.25 }).collect();
//! let once = filter(&params, &guides, &noisy, &shares, [4, 4]);
//! assert!((once.color[0] - 0.5).abs() < 0.1 && once.variance < 0.05);
//!
//! // without noise, the difference is one of light
//! let sharp = noisy.iter().map(|pixel| Estimate { variance: 0.0, ..*pixel }).collect::<Vec<_>>();
//! assert_eq!(filter(&params, &guides, &sharp, &shares, [4, 4]).color, sharp[4 * 8 + 4].color);
//! ```

mod accumulate;
mod estimate;
mod filter;
mod guide;
mod params;
mod reflectance;

pub use accumulate::{History, accumulate};
pub use estimate::{Contrast, Estimate, contrast, estimate};
pub use filter::{Share, filter, modulate, share};
pub use guide::{Guide, Track, guide};
pub use params::{DenoiseParams, GuideParams};
pub use reflectance::{Means, Reflectance, Samples, means};
