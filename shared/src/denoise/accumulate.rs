//! Means over frames.

use super::estimate::brightness;
use super::guide::{Guide, Track};
use super::params::DenoiseParams;
use super::reflectance::Reflectance;
use crate::layout::FilmPixel;
use crate::num;
use crate::vec::flush;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A pixel's mean over frames, of light over reflectance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct History {
    /// The mean, linear RGB.
    pub color: [f32; 3],
    /// How many frames it is worth; 0 of a pixel that is not filtered.
    pub frames: f32,
    /// Mean luminance of single frames.
    pub first: f32,
    /// Mean square of that.
    pub second: f32,
    /// How many frames these two are of.
    pub observed: f32,
    /// The mean reflectance: how much of these frames is known of the light.
    pub reflectance: Reflectance,
}

const _: () = assert!(size_of::<History>() == 32);

/// Beyond this a pixel is none of light: 2^100.
const MAX: f32 = 1.267_650_6e30;

/// Adds a pixel of this frame to what the last frame knew of its surface. In a picture that is a mean itself, of frames that
/// [`DenoiseParams::frames`] counts, there is nothing to add.
#[inline(always)]
pub fn accumulate(
    params: &DenoiseParams,
    picture: FilmPixel,
    guide: &Guide,
    track: &Track,
    other_guides: &[Guide],
    other: &[History],
) -> History {
    let light = Vec3::from_array(picture.sum);
    let [x, y, z] = [num::abs(light.x), num::abs(light.y), num::abs(light.z)];
    if !guide.exists() | !((x < MAX) & (y < MAX) & (z < MAX)) {
        return History { color: picture.sum, ..History::default() };
    }
    let parts = track.reflectance.channels();
    let color = Vec3::new(num::div(light.x, parts.x), num::div(light.y, parts.y), num::div(light.z, parts.z));
    let last =
        if params.history > 0.0 { remembered(params, guide, track, other_guides, other) } else { History::default() };
    let frames = num::min(last.frames, params.history - 1.0) + 1.0;
    if params.frames > 1.0 || last.frames == 0.0 {
        return alone(color, track.reflectance, params.frames);
    }
    let bright = brightness(color.to_array());
    let observed = num::min(last.observed, params.history - 1.0) + 1.0;
    let (share, seen) = (num::recip(frames), num::recip(observed));
    let before = last.reflectance.channels();
    // the mean of light that was given back, over the mean of reflectances: a black surface tells nothing
    let mean = before + (parts - before) * share;
    let part = |now: f32, mean: f32| num::div(now * share, mean);
    let told = Vec3::new(part(parts.x, mean.x), part(parts.y, mean.y), part(parts.z, mean.z));
    let known = Vec3::from_array(last.color);
    History {
        color: flush(known + (color - known) * told).to_array(),
        frames,
        first: num::flush(last.first + (bright - last.first) * seen),
        second: num::flush(last.second + (bright * bright - last.second) * seen),
        observed,
        reflectance: Reflectance::new(mean),
    }
}

/// What begins anew, from a picture of so many frames.
#[inline(always)]
fn alone(color: Vec3, reflectance: Reflectance, frames: f32) -> History {
    let bright = brightness(color.to_array());
    let single = frames == 1.0;
    let observed = if single { 1.0 } else { 0.0 };
    let (first, second) = if single { (bright, bright * bright) } else { (0.0, 0.0) };
    History { color: color.to_array(), frames, first, second, observed, reflectance }
}

/// What the four pixels know around the place where the last frame saw the point, as far as they saw the same surface.
#[inline(always)]
fn remembered(
    params: &DenoiseParams,
    guide: &Guide,
    track: &Track,
    other_guides: &[Guide],
    other: &[History],
) -> History {
    let mut sum = Sums::default();
    let place = Vec2::from_array(track.place) - Vec2::splat(0.5);
    let (width, height) = (params.width as f32, params.height as f32);
    // compared as floats: a conversion beyond the range would not be the same everywhere
    let near = (place.x > -1.0) & (place.y > -1.0) & (place.x < width) & (place.y < height);
    if !near | (track.inverse_depth == 0.0) {
        return History::default();
    }
    let corner = Vec2::new(num::floor(place.x), num::floor(place.y));
    let within = place - corner;
    let mut tap = 0;
    while tap < 4 {
        let (dx, dy) = (tap & 1, tap >> 1);
        let (x, y) = (corner.x as i32 + dx, corner.y as i32 + dy);
        let (index, inside) = params.neighbour([0, 0], x, y);
        let (seen, known) = (other_guides[index], other[index]);
        let offset = within - Vec2::new(dx as f32, dy as f32);
        let same = (seen.key() == guide.key()) & (seen.off_plane(track.inverse_depth, offset, params.spread) < SAME);
        let weight = (1.0 - num::abs(offset.x)) * (1.0 - num::abs(offset.y));
        if inside & same & (known.frames > 0.0) {
            sum.add(&known, weight);
        }
        tap += 1;
    }
    if sum.weight > LEAST { sum.mean() } else { History::default() }
}

/// How far from the plane of the last frame's pixel a point may lie, as of [`Guide::off_plane`].
const SAME: f32 = 2.0;
/// The weight that the pixels of the last frame have at least in common.
const LEAST: f32 = 0.05;

/// Weighted sums of histories.
#[derive(Default)]
struct Sums {
    weight: f32,
    /// Of light that was given back, and of reflectances.
    light: Vec3,
    reflectance: Vec3,
    frames: f32,
    first: f32,
    second: f32,
    observed: f32,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, other: &History, weight: f32) {
        let reflectance = other.reflectance.channels() * weight;
        self.weight += weight;
        self.light += flush(Vec3::from_array(other.color) * reflectance);
        self.reflectance += reflectance;
        self.frames += other.frames * weight;
        self.first += num::flush(other.first * weight);
        self.second += num::flush(other.second * weight);
        self.observed += other.observed * weight;
    }

    #[inline(always)]
    fn mean(&self) -> History {
        let Self { light, reflectance: of, .. } = *self;
        let scale = num::recip(self.weight);
        let color = Vec3::new(num::div(light.x, of.x), num::div(light.y, of.y), num::div(light.z, of.z));
        History {
            color: flush(color).to_array(),
            frames: self.frames * scale,
            first: self.first * scale,
            second: self.second * scale,
            observed: self.observed * scale,
            reflectance: Reflectance::new(of * scale),
        }
    }
}
