//! Direct light by resampling (ReSTIR DI; Bitterli et al. 2020, "Spatiotemporal Reservoir Resampling").
//!
//! The words, which the papers have and this page uses:
//!
//! * a *target* is what a sample should be chosen in proportion to: here the luminance of its contribution to the pixel;
//! * a *reservoir* ([`PackedReservoir`]) is one sample that was chosen from many candidates, with a weight that stands for all of them;
//! * its *contribution weight* is an estimate of one over the density with which it was chosen: contribution times weight is the pixel's radiance;
//! * its *confidence* is how many rounds of candidates it counts for when it is weighed against others; most frames have one for each pixel;
//! * to *combine* is to choose again, from several reservoirs of which one, the *canonical* one, is the pixel's own;
//! * a *form of MIS* ([`Mis`](crate::resample::mis::Mis)) says how the samples of several pixels are weighed, so that what more than one of them can find is
//!   counted once;
//! * the *other* reservoirs of a combine are those of neighbours in the same frame, or of the last frame;
//! * *pairwise* MIS weighs the canonical reservoir against each of the others, pair by pair, so that its cost grows with their number and not with its
//!   square; *defensive* is that the canonical one keeps a share however well the others do;
//! * a *plane* is a slice with one element for each pixel, row by row from the upper left corner: `y * width + x`, as
//!   [`ReuseParams::grid`](crate::resample::params::ReuseParams::grid) counts.
//!
//! A frame is a chain of passes over planes, of 16 bytes a pixel but for points (48) and pairs (32). Pixels of one pass may be done in any order
//! and at once; a pass begins when the one before has done all pixels.
//!
//! | pass | reads | makes | rays a pixel with [`DiParams::new`] |
//! |---|---|---|---|
//! | [`primary`] | | hits: what each pixel sees | 1 |
//! | [`presample`] | | tiles of candidates that pixels share, if they are asked for | |
//! | [`initial`] | hits, tiles | reservoirs of candidates from lights and scattering; direct: radiance that needs no resampling, emission that is seen and what perfect mirrors show | 1 from scattering, 1 to the light that is chosen, and as many more as there are more rounds of candidates ([`DiParams::renewed_after`]) |
//! | [`combine`], temporal | both frames' hits, the last frame's reservoirs | reservoirs, in place | none in a still view, else 2 |
//! | [`combine`], spatial, any number | hits, reservoirs of neighbours | reservoirs, in another plane: in place it would read what is already combined, which is noisier by far | up to 2 for each neighbour |
//! | [`shade`] | hits, reservoirs, direct | radiance of the pixel's own reservoir | none |
//!
//! The history, which the next frame reads, may be the reservoirs after the temporal combine or those after a spatial one. Which is better depends on the
//! scene. After the temporal combine the errors of neighbours stay independent: better where a pixel's own candidates are good. After a spatial one
//! neighbours come to hold the same samples, so that the error soon falls no more, but a good sample spreads far: better where most candidates are worth
//! nothing. In the 16th frame of a still view the former has 0.6 of the latter's squared error in the scene `cornell`, which has one lamp, and 1.4 of it in
//! `many-lights` (`restir render SCENE --technique restir-di --set shaded=0 --set feedback=off --frames 16`, and `feedback=on`).
//!
//! Instead of [`shade`] a pixel can be shaded by the samples of its neighbours together, with the parameters of [`DiParams::with_shading`]. It takes the
//! place of a spatial combine; behind one there is little left for it to do:
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`offer`] | hits, reservoirs | points: surface, reservoir and radiance of each pixel |
//! | [`exchange`] | hits, points | pairs: the targets of neighbours' samples; what they send |
//! | [`gather`] | points, pairs, direct | radiance of several reservoirs |
//!
//! The sample is an address, see [`crate::scene::AddressedLights`]: a light and a point of its parametrisation. Over this
//! domain a sample moves between pixels and frames with a Jacobian of 1. The target is the luminance of what the
//! address sends to the camera, or one channel of it ([`Flags::RED`]), without visibility unless
//! [`Flags::TARGET_VISIBILITY`] says so.
//!
//! Visibility is a factor by channel in [0, 1]: 0 or 1, unless light passes through clear glass (smooth sheets that transmit,
//! [`Flags::TRANSMITTANCE`]). Targets with visibility are those of what is left of the contribution.
//!
//! Visibility can enter in four places ([`Flags`]), and not every combination is unbiased. What [`DiParams::new`] sets is. A chain with one of these
//! is not:
//!
//! | what | unless there is also | what is wrong then |
//! |---|---|---|
//! | [`Mis::ONE_OVER_M`](crate::resample::mis::Mis::ONE_OVER_M) or [`CONSTANT`](crate::resample::mis::Mis::CONSTANT) between pixels | | pixels are counted that cannot produce a sample: darker |
//! | [`Flags::INITIAL_VISIBILITY`] | [`Flags::MIS_VISIBILITY`] | a neighbour threw away what is occluded there, and the weights do not know it: darker near shadows |
//! | [`Flags::SCATTER_CANDIDATE`] | [`Flags::MIS_VISIBILITY`] | scattering does not find what is occluded, and the weights count on it: darker near shadows |
//! | a combine with the last frame | [`Flags::MIS_VISIBILITY`] or [`Flags::FINAL_RAY`] | visibility of the last frame is reused: shadows lag |
//! | [`Flags::AVERAGE_VISIBILITY`] | [`Flags::RED`], [`Flags::GREEN`] or [`Flags::BLUE`] | an average does not know its colour: leaks at coloured shadow edges |
//! | `near_radius` above 0 | [`Flags::MIS_VISIBILITY`] or [`Flags::FINAL_RAY`] | near neighbours are believed to see the same: brighter in shadows |
//!
//! Four frames of a still scene, of 3 x 2 pixels. (`Floor` is the scene that the documentation of [`scene`](crate::scene) shows;
//! with one lamp alone there is nothing to choose, and no noise. A scene that is not [`Copy`] is taken by reference where these functions want one by value: `&scene`,
//! and `Still(&scene)` for [`combine`].)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::scene::Still;
//! use restir_shared::technique::restir_di::{DiParams, LastFrame, Planes, combine, initial, primary, shade};
//!
//! let (scene, size) = (Floor, [3, 2]);
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, size);
//! let of_all = DiParams::new(camera, size, 7);
//! let pixels: Vec<[u32; 2]> = (0..size[0] * size[1]).map(|index| of_all.grid().at(index)).collect();
//! let mut last = Vec::new();
//! for frame in 0..4 {
//!     let params = of_all.of_frame(frame, camera);
//!     let hits: Vec<_> = pixels.iter().map(|&at| primary(&scene, &params, at)).collect();
//!     let seen = || pixels.iter().zip(&hits).map(|(&at, &hit)| (at, hit));
//!     let made: Vec<_> = seen().map(|(at, hit)| initial(&scene, &params, &[], hit, at)).collect();
//!     let (mut reservoirs, direct): (Vec<_>, Vec<_>) = made.iter().map(|made| (made.reservoir, made.direct)).unzip();
//!     if frame > 0 {
//!         let planes = Planes { hits: &hits, other_hits: &hits, others: &last };
//!         let params = params.with_last(&LastFrame::of_view(camera, true));
//!         for (own, &at) in reservoirs.iter_mut().zip(&pixels) {
//!             *own = combine(Still(scene), &params, &planes, *own, at).reservoir;
//!         }
//!     }
//!     let planes = Planes { hits: &hits, other_hits: &hits, others: &reservoirs };
//!     let spatial = params.with_neighbours(0);
//!     let own = reservoirs.iter().zip(&pixels);
//!     let shared: Vec<_> = own.map(|(&own, &at)| combine(Still(scene), &spatial, &planes, own, at).reservoir).collect();
//!     for (index, (at, hit)) in seen().enumerate() {
//!         let pixel = shade(scene, &params, hit, shared[index], direct[index], at);
//!         assert!((pixel.sum[0] - 1.0).abs() < 2e-3);
//!     }
//!     last = reservoirs;
//! }
//! ```
//!
//! A frame in which pixels are shaded by several samples:
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::technique::restir_di::{DiParams, exchange, gather, initial, offer, primary};
//!
//! let (scene, pixels) = (Floor, [[0, 0], [1, 0]]);
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, [2, 1]);
//! let params = DiParams::new(camera, [2, 1], 7);
//! let params = params.with_shading(params.radius, 4);
//! let hits = pixels.map(|at| primary(&scene, &params, at));
//! let made = [0, 1].map(|i| initial(&scene, &params, &[], hits[i], pixels[i]));
//! let points = [0, 1].map(|i| offer(scene, &params, hits[i], made[i].reservoir, pixels[i]));
//! let sent = [0, 1].map(|i| exchange(scene, &params, &points, hits[i], pixels[i]));
//! let targets = sent.map(|sent| sent.pairs);
//! for i in [0, 1] {
//!     let pixel = gather(&params, &points, &targets, made[i].direct, sent[i].sent, pixels[i]);
//!     assert!((pixel.sum[0] - 1.0).abs() < 2e-3);
//! }
//! ```

mod combine;
mod domain;
mod initial;
mod params;
mod pixel;
#[cfg(not(target_arch = "spirv"))]
mod rays;
mod select;
mod shade;
#[cfg(not(target_arch = "spirv"))]
mod simd;
mod stored;
mod tile;

pub use crate::geometry::PackedHit;
pub use crate::resample::domain::Source;
pub use crate::resample::exchange::{PAIRS, PairTargets as DiPairs};
pub use crate::resample::merge::Combined;
#[doc(hidden)]
pub use crate::resample::packed::dithered;
pub use crate::resample::params::{Flags, LastFrame};
pub use combine::{Planes, combine};
#[doc(hidden)]
pub use initial::FROM_SCATTERING;
pub use initial::{Initial, initial};
pub use params::*;
pub use pixel::{primary, primary_ray};
#[doc(hidden)]
pub use shade::pair_offsets;
pub use shade::{Exchanged, exchange, gather, offer, shade};
#[cfg(not(target_arch = "spirv"))]
#[doc(hidden)]
pub use simd::{combine_row, exchange_row, initial_row, primary_row};
pub use stored::{PackedReservoir, Stored};
#[doc(hidden)]
pub use tile::presample;

use crate::bsdf::ScatteringFunction;
use crate::camera::AFTER_CAMERA;
use crate::geometry::Ray;
use crate::num;
use crate::scene::{AddressedLight, AddressedLights, LightAddress, Surface};
use crate::transport::Vertex;
use crate::vec::{flush, luminance};
use glam::Vec3;

/// Random dimensions after the camera's: one for scattering, then two a combine, then one in which all candidates from lights are
/// drawn, each as a sample of its own, then one a candidate of a frame for its selection.
const SCATTER_DIMENSION: u32 = AFTER_CAMERA;
const COMBINE_DIMENSION: u32 = SCATTER_DIMENSION + 1;
/// Combines of a frame that have dimensions of their own.
const COMBINES: u32 = 16;
const CANDIDATE_DIMENSION: u32 = COMBINE_DIMENSION + 2 * COMBINES;
const SELECTION_DIMENSION: u32 = CANDIDATE_DIMENSION + 1;
/// The largest target: 2^60, so that sums and products with confidence weights stay far from infinity.
const MAX_TARGET: f32 = 1.152_921_5e18;

/// What an address sends to the camera by way of a vertex.
#[derive(Clone, Copy)]
struct Evaluation {
    /// Contribution over (light, u, v), without visibility.
    value: Vec3,
    /// Its luminance, or one channel.
    target: f32,
    /// Density over (light, u, v) with which lights are sampled.
    light_density: f32,
    /// Density over (light, u, v) with which scattering finds the address.
    scatter_density: f32,
    shadow: Ray,
}

/// What of an evaluation is asked after candidates have been drawn.
#[derive(Clone, Copy, Default)]
struct Sent {
    value: Vec3,
    target: f32,
    shadow: Ray,
}

impl Sent {
    #[inline(always)]
    fn of<B: ScatteringFunction>(flags: Flags, vertex: &Vertex<B>, light: &AddressedLight) -> Self {
        let Evaluation { value, target, shadow, .. } = evaluate(flags, vertex, light);
        Self { value, target, shadow }
    }
}

/// The target of what is left of a contribution: it is zero where nothing can be shaded.
#[inline(always)]
fn visible_target(value: Vec3, target: f32, visibility: Vec3, flags: Flags) -> f32 {
    if flags.contains(Flags::TRANSMITTANCE) {
        sanitized(brightness(flush(value * visibility), flags))
    } else {
        target * visibility.x
    }
}

#[inline(always)]
fn evaluate<B: ScatteringFunction>(flags: Flags, vertex: &Vertex<B>, light: &AddressedLight) -> Evaluation {
    let connection = vertex.connect(&light.sample);
    let spread = connection.spread(light);
    let value = flush(connection.value * spread);
    Evaluation {
        value,
        target: sanitized(brightness(value, flags)),
        light_density: light.sample.density * light.extent,
        scatter_density: connection.scatter_pdf * spread,
        shadow: connection.shadow,
    }
}

/// The target of an address at the pixel (x, y), which sees `hit`, without visibility: zero where nothing is hit.
pub fn target<S: Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    hit: PackedHit,
    at: [u32; 2],
    address: LightAddress,
) -> f32 {
    let pixel = params.view().pixel(at, hit);
    if pixel.hit.is_hit() & address.is_light() {
        evaluate(params.flags, &pixel.vertex(scene), &scene.light_at(address)).target
    } else {
        0.0
    }
}

/// What of a contribution the target is.
#[inline(always)]
fn brightness(value: Vec3, flags: Flags) -> f32 {
    if flags.contains(Flags::RED) {
        value.x
    } else if flags.contains(Flags::GREEN) {
        value.y
    } else if flags.contains(Flags::BLUE) {
        value.z
    } else {
        luminance(value)
    }
}

/// A target in range: zero if it is no number.
#[inline(always)]
fn sanitized(target: f32) -> f32 {
    if target > num::FLUSH_BELOW { num::min(target, MAX_TARGET) } else { 0.0 }
}
