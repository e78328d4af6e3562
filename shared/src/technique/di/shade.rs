//! Radiance from reservoirs: of a pixel's own, or of several by MIS.
//!
//! With neighbours every one of their samples is shaded by its weight in pairwise MIS: the mean over the selection that a
//! combine would make, which has the same expectation and less noise. Neighbours lie in pairs on opposite sides at offsets
//! that all pixels share, so to be neighbours is mutual, and what the weights ask for is worked out once: the target of
//! j's sample at i is both what i shades it by and what j weighs its own sample by (cf. reciprocal neighbours in Lin et
//! al. 2026, "ReSTIR PT Enhanced"). A pass has three parts, between which planes are complete:
//!
//! 1. [`offer`]: what the pixel shows its neighbours;
//! 2. [`exchange`]: the targets of the neighbours' samples at the pixel, and what these samples send by way of it;
//! 3. [`gather`]: to this the pixel's own sample, by the weight that the neighbours' targets give it.

use super::neighbour::{Facet, alike};
use super::pixel::Pixel;
use super::stored::Stored;
use super::{DI_FINAL_RAY, DI_MIS_VISIBILITY, DI_TRANSMITTANCE, DiPairs, DiParams, DiPoint, PAIRS};
use super::{Evaluation, evaluate, in_use};
use crate::layout::FilmPixel;
use crate::num::{self, Scalar};
use crate::pack::{decode_unit_vector, encode_unit_vector};
use crate::resample::mis::Pair;
use crate::rng::{self, Rng};
use crate::sampling::sample_concentric_disk;
use crate::scene::{AddressedLights, Surface, Trace};
use crate::transport::{Vertex, transmittance};
use crate::vec::length;
use glam::{UVec4, Vec2, Vec3};

/// Neighbours in a pass.
const NEIGHBOURS: usize = 2 * PAIRS;
/// No pixel.
const NOWHERE: u32 = u32::MAX;
/// The random dimension of offsets, which no pixel has.
const OFFSETS: u32 = (1 << 16) + 2;
/// Draws for each pair that is asked for, until the disk counts as exhausted.
const DRAWS: u32 = 64;

/// The radiance of the pixel (x, y), which sees `hit`, by way of its own reservoir, as a film's sample.
pub fn shade<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    [hit, reservoir]: [UVec4; 2],
    direct: FilmPixel,
    at: [u32; 2],
) -> FilmPixel {
    let point = offer(scene, params, flags, [hit, reservoir], at);
    film_pixel(params, direct, Vec3::from_array(point.radiance))
}

/// What the pixel (x, y), which sees `hit`, shows its neighbours.
#[inline(always)]
pub fn offer<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    [hit, reservoir]: [UVec4; 2],
    at: [u32; 2],
) -> DiPoint {
    let flags = in_use(flags, scene);
    let pixel = Pixel::new(&params.camera, flags, params.seed, params.frame, at, hit);
    let mut offered = DiPoint { reservoir: reservoir.to_array(), ..DiPoint::default() };
    if pixel.hit.is_hit() {
        let point = pixel.point(scene);
        offered.position = point.position.to_array();
        offered.normal = encode_unit_vector(point.normal);
        let stored = Stored::unpack(reservoir);
        if stored.has_sample() {
            let vertex = Vertex::new(&point, &pixel.ray, scene.features());
            let e = evaluate(flags, &vertex, &scene.light_at(stored.address));
            // what a reservoir keeps of a colour is not good enough for MIS
            let forgets = (flags & DI_MIS_VISIBILITY != 0) & (flags & DI_TRANSMITTANCE != 0);
            let traced = forgets | (flags & DI_FINAL_RAY != 0);
            let visibility = seen(scene, flags, &e, traced, stored.visibility);
            offered.target = mis_target(&e, visibility, flags);
            offered.radiance = sent(&e, visibility, stored.contribution_weight, 1.0).to_array();
        }
    }
    offered
}

/// The second part, for the pixel (x, y), which sees `hit`.
pub fn exchange<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    flags: u32,
    points: &[DiPoint],
    hit: UVec4,
    [x, y]: [u32; 2],
) -> (DiPairs, FilmPixel) {
    let flags = in_use(flags, scene);
    let mut pairs = DiPairs { targets: [DiPairs::NONE; NEIGHBOURS] };
    let mut radiance = Vec3::ZERO;
    let pixel = Pixel::new(&params.camera, flags, params.seed, params.frame, [x, y], hit);
    if !pixel.hit.is_hit() {
        return (pairs, FilmPixel::default());
    }
    let (places, all) = neighbours(params, points, [x, y]);
    let own = reservoir(&points[(y * params.width + x) as usize]);
    let vertex = pixel.vertex(scene);
    let in_mis = flags & DI_MIS_VISIBILITY != 0;
    let mut n = 0;
    while n < params.neighbours {
        let place = places[n as usize];
        if place != NOWHERE {
            let other = points[place as usize];
            let stored = reservoir(&other);
            let mut target = 0.0;
            if stored.has_sample() {
                let e = evaluate(flags, &vertex, &scene.light_at(stored.address));
                let traced = in_mis | (flags & DI_FINAL_RAY != 0) | !is_near(params, n);
                let visibility = seen(scene, flags, &e, traced, stored.visibility);
                target = mis_target(&e, visibility, flags);
                let pair = Pair::new(stored.confidence, all, own.confidence);
                let weight = pair.of_neighbour(other.target, target);
                radiance += sent(&e, visibility, stored.contribution_weight, weight);
            }
            pairs.targets[n as usize] = target;
        }
        n = n.wrapping_add(1);
    }
    (pairs, FilmPixel { sum: radiance.to_array(), dropped: 0.0 })
}

/// The third part, for the pixel (x, y), of which the second made `sent`: the radiance as a film's sample.
pub fn gather(
    params: &DiParams,
    points: &[DiPoint],
    pairs: &[DiPairs],
    direct: FilmPixel,
    sent: FilmPixel,
    at: [u32; 2],
) -> FilmPixel {
    let index = (at[1] * params.width + at[0]) as usize;
    let own = points[index];
    let mut places = [NOWHERE; NEIGHBOURS];
    let mut all = 0.0;
    let mut n = 0;
    while n < params.neighbours {
        // the pixel is its neighbour's neighbour on the other side
        let place = partner(params, at, n);
        if place != NOWHERE && pairs[place as usize].targets[(n ^ 1) as usize] >= 0.0 {
            places[n as usize] = place;
            all += reservoir(&points[place as usize]).confidence;
        }
        n = n.wrapping_add(1);
    }
    let confidence = reservoir(&own).confidence;
    let mut share = if all > 0.0 { 0.0 } else { 1.0 };
    n = 0;
    while n < params.neighbours {
        let place = places[n as usize];
        if place != NOWHERE {
            let pair = Pair::new(reservoir(&points[place as usize]).confidence, all, confidence);
            share += pair.of_canonical(own.target, pairs[place as usize].targets[(n ^ 1) as usize]);
        }
        n = n.wrapping_add(1);
    }
    film_pixel(params, direct, Vec3::from_array(sent.sum) + Vec3::from_array(own.radiance) * share)
}

/// A frame's offsets within `radius` pixels, one of each pair and no two the same: fills `offsets` as far as the disk has
/// that many, and returns how many there are. They are packed as in [`DiParams::pairs`]; every stretch of them is well
/// spread.
pub fn pair_offsets(seed: u32, frame: u32, radius: f32, offsets: &mut [u32]) -> usize {
    let words = Rng::new(0, 0, frame, seed).draw(OFFSETS);
    let draws = (offsets.len() as u32).wrapping_mul(DRAWS);
    let mut count = 0;
    let mut n = 0;
    while (count < offsets.len()) & (n < draws) {
        let u = rng::r2([words.x, words.y], n);
        // of each pair the one in the upper half of the disk
        let offset = sample_concentric_disk(Vec2::new(u.x, 0.5 + 0.5 * u.y)) * radius;
        let (x, y) = (num::nearest(offset.x), num::nearest(offset.y));
        let x = if (y == 0) & (x < 0) { x.wrapping_neg() } else { x };
        let packed = (x as u32 & 0xffff) | ((y as u32) << 16);
        if packed != 0 && !offsets[..count].contains(&packed) {
            offsets[count] = packed;
            count += 1;
        }
        n = n.wrapping_add(1);
    }
    count
}

/// The n-th offset of a pass.
#[inline(always)]
fn offset(params: &DiParams, n: u32) -> [i32; 2] {
    let packed = params.pairs[(n >> 1) as usize];
    let [x, y] = [((packed << 16) as i32) >> 16, (packed as i32) >> 16];
    if n & 1 == 0 { [x, y] } else { [x.wrapping_neg(), y.wrapping_neg()] }
}

/// Index of the pixel's n-th neighbour, [`NOWHERE`] beyond the image.
#[inline(always)]
fn partner(params: &DiParams, [x, y]: [u32; 2], n: u32) -> u32 {
    let [dx, dy] = offset(params, n);
    // below zero wraps to beyond any image
    let (x, y) = (x.wrapping_add(dx as u32), y.wrapping_add(dy as u32));
    if (x < params.width) & (y < params.height) { y * params.width + x } else { NOWHERE }
}

#[inline(always)]
fn is_near(params: &DiParams, n: u32) -> bool {
    let [dx, dy] = offset(params, n);
    let (dx, dy) = (dx as f32, dy as f32);
    dx * dx + dy * dy < params.near_radius * params.near_radius
}

/// The neighbours that take part, and the sum of their confidence. Each of two pixels has to find the other like itself.
#[inline(always)]
fn neighbours(params: &DiParams, points: &[DiPoint], at: [u32; 2]) -> ([u32; NEIGHBOURS], f32) {
    let mut places = [NOWHERE; NEIGHBOURS];
    let mut all = 0.0;
    let (here, distance) = facet(params, &points[(at[1] * params.width + at[0]) as usize]);
    let mut n = 0;
    while n < params.neighbours {
        let place = partner(params, at, n);
        if place != NOWHERE {
            let other = points[place as usize];
            let confidence = reservoir(&other).confidence;
            if confidence > 0.0 {
                let (there, other_distance) = facet(params, &other);
                if alike(params, distance, &here, &there) & alike(params, other_distance, &there, &here) {
                    places[n as usize] = place;
                    all += confidence;
                }
            }
        }
        n = n.wrapping_add(1);
    }
    (places, all)
}

#[inline(always)]
fn reservoir(point: &DiPoint) -> Stored {
    Stored::unpack(UVec4::from_array(point.reservoir))
}

/// A pixel's surface, and its distance to the camera.
#[inline(always)]
fn facet(params: &DiParams, point: &DiPoint) -> (Facet, f32) {
    let position = Vec3::from_array(point.position);
    let distance = length(position - Vec3::from_array(params.camera.position));
    (Facet { position, normal: decode_unit_vector(point.normal) }, distance)
}

#[inline(always)]
fn seen<S: Trace + Surface>(scene: &S, flags: u32, e: &Evaluation, traced: bool, known: Vec3) -> Vec3 {
    if traced & (e.target > 0.0) { transmittance(scene, flags & DI_TRANSMITTANCE != 0, &e.shadow) } else { known }
}

/// What MIS weighs a sample by.
#[inline(always)]
fn mis_target(e: &Evaluation, visibility: Vec3, flags: u32) -> f32 {
    let target = if flags & DI_MIS_VISIBILITY != 0 { e.visible_target(visibility, flags) } else { e.target };
    target.within_range()
}

/// What a sample sends by way of a pixel, weighted. The product of target and contribution weight is in range where each
/// alone may not be.
#[inline(always)]
fn sent(e: &Evaluation, visibility: Vec3, contribution_weight: f32, weight: f32) -> Vec3 {
    if e.target > 0.0 {
        let contribution = (weight * (e.target * contribution_weight).within_range()).within_range();
        e.value * num::recip(e.target) * (visibility * contribution)
    } else {
        Vec3::ZERO
    }
}

/// With what needs no resampling, whose dropped samples are counted once, however many passes shade.
#[inline(always)]
fn film_pixel(params: &DiParams, direct: FilmPixel, radiance: Vec3) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + radiance);
    let of_direct = if params.shading_pass == 0 { direct.dropped } else { 0.0 };
    FilmPixel { sum: pixel.sum, dropped: num::min(pixel.dropped + of_direct, 1.0) }
}
