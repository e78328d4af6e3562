//! Radiance from reservoirs: of a pixel's own, or of several by MIS.
//!
//! With neighbours ([`crate::resample::exchange`]), a pass has three parts, between which planes are complete:
//!
//! 1. [`offer`]: what the pixel shows its neighbours;
//! 2. [`exchange`]: the targets of the neighbours' samples at the pixel, and what these samples send by way of it;
//! 3. [`gather`]: to this the pixel's own sample, by the weight that the neighbours' targets give it.

use super::domain::{Light, Receiver};
use super::{DiPairs, DiParams, DiPoint, Flags, PackedHit, PackedReservoir, Stored};
use crate::layout::FilmPixel;
use crate::num;
use crate::pack::{decode_unit_vector, encode_unit_vector};
use crate::resample::exchange::{self, Offers, Uses};
use crate::resample::similar::GBufferSurface;
use crate::rng::{Rng, Sampler};
use crate::scene::{AddressedLights, LightAddress, Still, Surface, Trace};
use crate::transport::Vertex;
use crate::vec::length;
use glam::Vec3;

/// The random dimension of offsets, which no pixel has.
const OFFSETS: u32 = (1 << 16) + 2;

/// What pixels show each other.
pub(super) struct Points<'a> {
    camera: Vec3,
    points: &'a [DiPoint],
}

impl<'a> Points<'a> {
    #[inline(always)]
    pub(super) fn new(params: &DiParams, points: &'a [DiPoint]) -> Self {
        Self { camera: Vec3::from_array(params.camera.position), points }
    }
}

impl Offers for Points<'_> {
    type Sample = LightAddress;

    #[inline(always)]
    fn reservoir(&self, pixel: u32) -> Stored {
        Stored::unpack(self.points[pixel as usize].reservoir)
    }

    #[inline(always)]
    fn surface(&self, pixel: u32) -> GBufferSurface {
        let point = &self.points[pixel as usize];
        let position = Vec3::from_array(point.position);
        let distance = length(position - self.camera);
        GBufferSurface { position, normal: decode_unit_vector(point.normal), distance }
    }

    #[inline(always)]
    fn target(&self, pixel: u32) -> f32 {
        self.points[pixel as usize].target
    }
}

/// The radiance of the pixel `at`, which sees `hit`, by way of its own reservoir, and what [`super::initial`] found `direct`, as one sample of a
/// film: its `sum` is the radiance, and `dropped` is 1 where that was no number.
pub fn shade<S: Trace + Surface + AddressedLights + Copy>(
    scene: S,
    params: &DiParams,
    hit: PackedHit,
    reservoir: PackedReservoir,
    direct: FilmPixel,
    at: [u32; 2],
) -> FilmPixel {
    let point = offer(scene, params, hit, reservoir, at);
    film_pixel(params, direct, Vec3::from_array(point.radiance))
}

/// The first of the three passes that shade pixels by several samples: what the pixel `at`, which sees `hit`, shows its neighbours.
#[inline(always)]
pub fn offer<S: Trace + Surface + AddressedLights + Copy>(
    scene: S,
    params: &DiParams,
    hit: PackedHit,
    reservoir: PackedReservoir,
    at: [u32; 2],
) -> DiPoint {
    let light = Light { frames: Still(scene), flags: params.flags.in_use(&scene) };
    let pixel = params.view().pixel(at, hit);
    let mut offered = DiPoint { reservoir, ..DiPoint::default() };
    if pixel.hit.is_hit() {
        let point = pixel.point(&scene);
        offered.position = point.position.to_array();
        offered.normal = encode_unit_vector(point.normal);
        let stored = Stored::unpack(reservoir);
        if stored.has_sample() {
            let receiver = Receiver { vertex: Vertex::new(&point, &pixel.ray, scene.features()), elsewhere: false };
            let traced = light.forgets() | light.has(Flags::FINAL_RAY);
            let own = exchange::offer(&light, &receiver, &stored, light.has(Flags::MIS_VISIBILITY), traced);
            offered.target = own.target;
            offered.radiance = own.radiance.to_array();
        }
    }
    offered
}

/// What a pixel makes of its neighbours' samples.
#[derive(Clone, Copy, Debug)]
pub struct Exchanged {
    /// Their targets at the pixel.
    pub pairs: DiPairs,
    /// What they send by way of it, each by its weight.
    pub sent: FilmPixel,
}

/// The second of the three passes that shade pixels by several samples, after [`offer`]: at the pixel `at`, which sees `hit`, the targets
/// of its neighbours' samples, and what these send by way of it, each by its weight.
pub fn exchange<S: Trace + Surface + AddressedLights + Copy>(
    scene: S,
    params: &DiParams,
    points: &[DiPoint],
    hit: PackedHit,
    at: [u32; 2],
) -> Exchanged {
    let light = Light { frames: Still(scene), flags: params.flags.in_use(&scene) };
    let pixel = params.view().pixel(at, hit);
    if !pixel.hit.is_hit() {
        return Exchanged { pairs: DiPairs::ALONE, sent: FilmPixel::default() };
    }
    let receiver = Receiver { vertex: pixel.vertex(&scene), elsewhere: false };
    let points = Points::new(params, points);
    let (pairs, sent) = exchange::receive(&light, &points, &params.shading_neighbours(), uses(&light), &receiver, at);
    Exchanged { pairs, sent: FilmPixel { sum: sent.to_array(), dropped: 0.0 } }
}

/// Where visibility enters shading with neighbours.
#[inline(always)]
pub(super) fn uses<F>(light: &Light<F>) -> Uses {
    let mis = light.has(Flags::MIS_VISIBILITY);
    Uses { mis, traced: mis | light.has(Flags::FINAL_RAY) }
}

/// The last of the three passes that shade pixels by several samples: the radiance of the pixel `at`, as [`shade`] gives it. `pairs` is the plane of what
/// [`exchange()`] found of all pixels, `sent` what it sent by way of this one.
pub fn gather(
    params: &DiParams,
    points: &[DiPoint],
    pairs: &[DiPairs],
    direct: FilmPixel,
    sent: FilmPixel,
    at: [u32; 2],
) -> FilmPixel {
    let share = exchange::own_share(&Points::new(params, points), &params.shading_neighbours(), pairs, at);
    let own = points[params.grid().index(at) as usize];
    film_pixel(params, direct, Vec3::from_array(sent.sum) + Vec3::from_array(own.radiance) * share)
}

/// A frame's offsets within `radius` pixels, see [`exchange::pair_offsets`].
pub fn pair_offsets(seed: u32, frame: u32, radius: f32, offsets: &mut [u32]) -> usize {
    let words = Rng::new(0, 0, frame, seed, Sampler::Independent).hash(OFFSETS);
    exchange::pair_offsets([words.x, words.y], radius, offsets)
}

/// With what needs no resampling, whose dropped samples are counted once, however many passes shade.
#[inline(always)]
fn film_pixel(params: &DiParams, direct: FilmPixel, radiance: Vec3) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + radiance);
    let of_direct = if params.shading_pass == 0 { direct.dropped } else { 0.0 };
    FilmPixel { sum: pixel.sum, dropped: num::min(pixel.dropped + of_direct, 1.0) }
}
