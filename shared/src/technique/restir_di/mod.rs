//! Direct light by resampling (ReSTIR DI; Bitterli et al. 2020, "Spatiotemporal Reservoir Resampling").
//!
//! A frame is a chain of passes over planes, of 16 bytes a pixel but for points (48) and pairs (32):
//!
//! | pass | reads | makes |
//! |---|---|---|
//! | [`primary`] | | hits: what each pixel sees |
//! | [`presample`] | | tiles of candidates that pixels share, if they are asked for |
//! | [`initial`] | hits, tiles | reservoirs of candidates from lights and scattering; direct: what needs no resampling |
//! | [`combine`], temporal | both frames' hits, the last frame's reservoirs | reservoirs, in place |
//! | [`combine`], spatial, any number | hits, reservoirs | reservoirs |
//! | [`shade`] | hits, reservoirs, direct | radiance of the pixel's own reservoir |
//!
//! Instead of the last one, with neighbours:
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
//! Visibility can enter in four places ([`Flags`]), and not every combination is unbiased; the host's
//! settings know which are.
//!
//! Two frames of a still scene, of two pixels side by side. (`Floor` is the scene that the documentation of [`scene`](crate::scene) shows;
//! with one lamp alone there is nothing to choose, and no noise.)
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::scene::Still;
//! use restir_shared::technique::restir_di::{DiParams, Planes, combine, initial, primary, shade};
//!
//! let pixels = [[0, 0], [1, 0]];
//! let camera = CameraParams::pinhole(Vec3::Y, Vec3::ZERO, Vec3::Z, 0.01, [2, 1]);
//! let mut last = Vec::new();
//! for frame in 0..2 {
//!     let params = DiParams::new(camera, [2, 1], 7).of_frame(frame, camera);
//!     let hits = pixels.map(|at| primary(&Floor, &params, at));
//!     let made = [0, 1].map(|i| initial(&Floor, &params, &[], hits[i], pixels[i]));
//!     let mut reservoirs = made.map(|(reservoir, _, _)| reservoir);
//!     if frame > 0 {
//!         let planes = Planes { hits: &hits, other_hits: &hits, others: &last };
//!         let params = params.with_last(camera, true);
//!         reservoirs = [0, 1].map(|i| combine(Still(Floor), &params, &planes, reservoirs[i], pixels[i]).0);
//!     }
//!     let planes = Planes { hits: &hits, other_hits: &hits, others: &reservoirs };
//!     let params = params.with_neighbours(0);
//!     let shared = [0, 1].map(|i| combine(Still(Floor), &params, &planes, reservoirs[i], pixels[i]).0);
//!     for i in [0, 1] {
//!         let pixel = shade(Floor, &params, hits[i], shared[i], made[i].1, pixels[i]);
//!         assert!((pixel.sum[0] - 1.0).abs() < 2e-3);
//!     }
//!     last = shared.to_vec();
//! }
//! ```

mod combine;
mod domain;
mod initial;
mod params;
mod pixel;
mod shade;
mod stored;
mod tile;

pub use crate::geometry::PackedHit;
pub use crate::resample::domain::Source;
pub use crate::resample::exchange::{PAIRS, PairTargets as DiPairs};
pub use crate::resample::packed::dithered;
pub use combine::{Planes, combine};
pub use initial::initial;
pub use params::*;
pub use pixel::primary;
pub use shade::{exchange, gather, offer, pair_offsets, shade};
pub use stored::{PackedReservoir, Stored};
pub use tile::presample;

use crate::bsdf::ScatteringFunction;
use crate::camera::AFTER_CAMERA;
use crate::geometry::Ray;
use crate::num;
use crate::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, Surface};
use crate::transport::Vertex;
use crate::vec::{flush, luminance};
use glam::Vec3;

/// Random dimensions after the camera's: one for scattering, then two a combine, then one in which all candidates from lights are
/// drawn, each as a sample of its own, then one a candidate for its selection.
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

impl Evaluation {
    /// The target of what is left of the contribution: it is zero where nothing can be shaded.
    #[inline(always)]
    fn visible_target(&self, visibility: Vec3, flags: Flags) -> f32 {
        if flags.contains(Flags::TRANSMITTANCE) {
            sanitized(brightness(flush(self.value * visibility), flags))
        } else {
            self.target * visibility.x
        }
    }
}

#[inline(always)]
fn evaluate<B: ScatteringFunction>(flags: Flags, vertex: &Vertex<B>, light: &AddressedLight) -> Evaluation {
    let connection = vertex.connect(&light.sample);
    // solid angle per area of the parametrisation
    let spread = if light.sample.kind == LightKind::Environment {
        light.extent
    } else {
        num::div(connection.cos_light * light.extent, connection.distance_squared)
    };
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
