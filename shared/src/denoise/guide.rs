//! What pixels see, by which neighbours are told apart.

use super::params::GuideParams;
use super::reflectance::{Reflectance, Samples, means};
use crate::bsdf::Material;
use crate::camera::central_ray;
use crate::geometry::Ray;
use crate::layout::CameraParams;
use crate::num;
use crate::pack::{f32_from_half2, half2_from_f32};
use crate::resample::reproject::{MIN_DEPTH, Point};
use crate::rng::Sampler;
use crate::scene::{Frames, Location, Probe, Surface, Trace};
use crate::vec::dot;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// The plane that a pixel sees, at the pixel's centre. Inverse depths are linear in the image over a plane, so that a slope tells those of all pixels
/// that see the same plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Guide {
    /// One over the distance along the camera's axis, in distances of the image plane.
    inverse_depth: f32,
    /// By which part of itself it grows from pixel to pixel, to the right and down, as two halves.
    slopes: u32,
    /// Unit geometric normal, each component in 10 bits.
    normal: u32,
    /// Which object it belongs to: pixels of other keys have nothing in common. 0 where nothing is.
    key: u32,
}

impl Guide {
    /// Nothing.
    pub const NONE: Self = Self { inverse_depth: 0.0, slopes: 0, normal: 0, key: 0 };

    /// A surface of an object, whose key is not 0.
    #[inline(always)]
    pub fn new(inverse_depth: f32, slopes: [f32; 2], normal: Vec3, key: u32) -> Self {
        // beyond that a pixel sees the surface from its edge
        let slope = |slope: f32| num::clamp(slope, -1.0, 1.0);
        let slopes = half2_from_f32(slope(slopes[0]), slope(slopes[1]));
        Self { inverse_depth, slopes, normal: steps_of(normal), key }
    }

    /// Which object it is.
    #[inline(always)]
    pub(super) fn key(&self) -> u32 {
        self.key
    }

    /// Whether there is a surface.
    #[inline(always)]
    pub fn exists(&self) -> bool {
        self.key != 0
    }

    /// How different a surface is that is seen `offset` pixels away: 0 in the same plane, 1 where it is hardly the same surface any more, and
    /// beyond [`Self::ANOTHER`] on another object. `spread` is that of [`super::DenoiseParams`].
    #[inline(always)]
    pub(super) fn difference(&self, other: &Self, offset: Vec2, spread: f32) -> f32 {
        if self.key != other.key {
            return Self::ANOTHER;
        }
        let between = from_steps(self.normal) - from_steps(other.normal);
        // one minus the cosine, exactly 0 of equal ones
        let turned = dot(between, between) * HALF_SQUARE_STEP;
        // between two points of a curved surface the slope is the mean of theirs
        let (here, there) = (self.change(offset) * self.inverse_depth, other.change(offset) * other.inverse_depth);
        let off = num::abs(other.inverse_depth - self.inverse_depth - 0.5 * (here + there));
        let bent = 0.5 * Self::BENT * (num::abs(here) + num::abs(there));
        let nearer = num::max(self.inverse_depth, other.inverse_depth);
        let off_plane = num::div(off, nearer * Self::tolerance(offset, spread) + bent);
        turned * Self::SHARPNESS + off_plane
    }

    /// By which part of itself the inverse depth grows over `offset`.
    #[inline(always)]
    fn change(&self, offset: Vec2) -> f32 {
        let (across, down) = f32_from_half2(self.slopes);
        across * offset.x + down * offset.y
    }

    /// By which part of itself an inverse depth may be off, `offset` pixels away on a plane that faces the camera.
    #[inline(always)]
    fn tolerance(offset: Vec2, spread: f32) -> f32 {
        let (across, down) = (num::abs(offset.x), num::abs(offset.y));
        // the distance, within 8 %
        let distance = num::max(across, down) + 0.4 * num::min(across, down);
        spread * distance + Self::ROUNDING
    }

    /// How far a point that is seen `offset` pixels away lies from the plane, where 1 is a slope of 45 degrees.
    #[inline(always)]
    pub(super) fn off_plane(&self, inverse_depth: f32, offset: Vec2, spread: f32) -> f32 {
        let change = self.change(offset);
        let off = num::abs(inverse_depth - self.inverse_depth * (1.0 + change));
        let tolerance = Self::tolerance(offset, spread) + Self::BENT * num::abs(change);
        num::div(off, self.inverse_depth * tolerance)
    }

    /// A difference beyond which nothing is alike.
    pub(super) const ANOTHER: f32 = 1.0e4;
    /// Normals differ by 1 where their cosine is 7/8.
    const SHARPNESS: f32 = 8.0;
    /// The part by which the slope of a surface that is seen at a grazing angle may change.
    const BENT: f32 = 0.125;
    /// Of depths, some roundings.
    const ROUNDING: f32 = 1.0e-5;
}

/// Steps from 0 to 1 of a normal's component.
const STEPS: f32 = 511.0;
/// Half the square of a step.
const HALF_SQUARE_STEP: f32 = 0.5 / (STEPS * STEPS);

#[inline(always)]
fn steps_of(normal: Vec3) -> u32 {
    let code = |component: f32| num::nearest((num::clamp(component, -1.0, 1.0) + 1.0) * STEPS) as u32;
    code(normal.x) | code(normal.y) << 10 | code(normal.z) << 20
}

/// The normal and (1, 1, 1), times [`STEPS`].
#[inline(always)]
fn from_steps(code: u32) -> Vec3 {
    Vec3::new((code & 0x3ff) as f32, (code >> 10 & 0x3ff) as f32, (code >> 20) as f32)
}

/// What of a pixel goes into light, and where the last frame saw its point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Track {
    /// See there.
    pub reflectance: Reflectance,
    /// Where in the last frame's image the point was, in pixels from the upper left corner.
    pub place: [f32; 2],
    /// Its inverse depth there, as of [`Guide`]; 0 if it lay behind the camera.
    pub inverse_depth: f32,
}

const _: () = assert!(size_of::<Guide>() == 16 && size_of::<Track>() == 16);

/// What the pixel (x, y) sees: the surface that its first sample meets, as if all of the pixel saw it, and means over its samples.
///
/// A pixel of which some samples see a lamp or nothing, and others do not, has no guide: what it shows is neither's light.
#[inline(always)]
pub fn guide<F>(frames: &F, params: &GuideParams, at: [u32; 2]) -> (Guide, Track)
where
    F: Frames,
    F::Scene: Probe + Surface<Material = Material>,
{
    let scene = frames.scene(false);
    let samples = params.camera_rays();
    let ray = samples.ray(scene.features(), 0, at);
    let hit = scene.closest(&ray);
    let means = means(&scene, &samples, at);
    if !hit.is_hit() | ((means.lights > 0) & (means.lights < samples.count)) {
        return (Guide::NONE, Track::default());
    }
    // an object's number may be any of 31 bits
    let key = scene.object(&hit).wrapping_mul(2).wrapping_add(u32::from(means.lights > 0)).wrapping_add(1);
    let Location { position, normal, .. } = scene.location(&hit);
    let moved = frames.scene(true).location(&hit).position - position;
    let centre = central_ray(&params.camera, Vec2::new(at[0] as f32 + 0.5, at[1] as f32 + 0.5));
    let position = met(&centre, position, normal);
    let depth = params.grid().point(&params.camera, position).depth;
    let slopes = slopes(&params.camera, &centre, normal);
    let then = params.grid().point(&params.other_camera, position + moved);
    let track = Track { reflectance: means.reflectance(), ..Track::seen(&then) };
    (Guide::new(num::recip(num::max(depth, MIN_DEPTH)), slopes, normal, key), track)
}

impl GuideParams {
    /// The camera rays of the picture.
    #[inline(always)]
    fn camera_rays(&self) -> Samples<'_> {
        let Self { seed, first_sample: first, samples: count, flags, .. } = *self;
        let [jitter, wide] = [flags & Self::JITTER != 0, flags & Self::BLACKMAN_HARRIS != 0];
        let independent = flags & Self::INDEPENDENT != 0;
        let sampler = if independent { Sampler::Independent } else { Sampler::Sobol };
        Samples { camera: &self.camera, jitter, wide, sampler, seed, first, count }
    }
}

impl Track {
    /// A point where the last frame saw it.
    #[inline(always)]
    fn seen(point: &Point) -> Self {
        let before = point.depth > MIN_DEPTH;
        let inverse_depth = if before { num::recip(point.depth) } else { 0.0 };
        Self { place: [point.x, point.y], inverse_depth, ..Self::default() }
    }
}

/// Where a ray meets the plane of a surface next to it; seen from the plane's edge, as far away as the surface.
#[inline(always)]
fn met(ray: &Ray, position: Vec3, normal: Vec3) -> Vec3 {
    let to = position - ray.origin;
    let far = dot(to, ray.direction);
    let distance = num::div(dot(to, normal), dot(ray.direction, normal));
    let near = num::abs(distance - far) < far * 0.5;
    ray.origin + ray.direction * if near { distance } else { far }
}

/// By which part of itself the inverse depth of a plane grows from pixel to pixel, at the point that a ray through the centre of a pixel
/// meets: a plane `n . p = c`, seen from the origin along `d`, has the inverse depth `n . d / c`.
#[inline(always)]
fn slopes(camera: &CameraParams, ray: &Ray, normal: Vec3) -> [f32; 2] {
    let [forward, right, up] =
        [Vec3::from_array(camera.forward), Vec3::from_array(camera.right), Vec3::from_array(camera.up)];
    // along the ray, as far as the image plane
    let scale = num::div(dot(forward, forward), dot(ray.direction, forward));
    let across = dot(normal, ray.direction) * scale;
    let part = |axis: Vec3| num::div(2.0 * dot(normal, axis), across);
    [part(right) * camera.inv_width, -(part(up) * camera.inv_height)]
}
