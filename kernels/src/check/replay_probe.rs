//! Measures the size of a kernel that is not written yet: one that takes a sample of ReSTIR SSS from one pixel to another and back by the
//! hybrid shift, with replay of the segment that looks for an exit, and keeps one of two samples. `cargo lab probe` builds
//! it; it is never shipped.
//!
//! A sample is an exit of light around the entry that a pixel sees, known by the numbers of a [`Disk`], and a point of a light. Exits
//! that are far off the entry, or turned away from it, are kept (**reconnection**); others are found anew by their numbers
//! (**replay**), which takes a probe, and a shadow ray.

use restir_shared::bsdf::{Material, ScatteringFunction};
use restir_shared::camera::primary_ray;
use restir_shared::diffusion::{Disk, DiskNumbers, Multiple, Profile};
use restir_shared::geometry::{Crossings, Hit, PackedHit, Ray};
use restir_shared::glam::{UVec4, Vec2, Vec3};
use restir_shared::medium::Medium;
use restir_shared::num;
use restir_shared::resample::mis::{Combine, Mis};
use restir_shared::resample::reservoir::Reservoir;
use restir_shared::rng::{self, Rng, Sampler};
use restir_shared::scene::{AddressedLight, AddressedLights, LightAddress, Probe, Surface, SurfacePoint, Trace};
use restir_shared::technique::path::hybrid::{Exit, HybridParams};
use restir_shared::transport::Vertex;
use restir_shared::vec::{dot, length, luminance, max_component};

/// A sample and its weights: numbers, exit, light, density, contribution weight and confidence.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Packed(pub [UVec4; 3]);

kernel! {
    /// A neighbour's sample taken here, the pixel's own one taken there, and one of both kept.
    pub fn replay_probe(8, 8) {
        constants { 0: features = 0xffff_ffff, 1: settings = 0xffff_ffff }
        params 0: HybridParams,
        asks probed(features) { 1: geometry, 2: attributes, 3: texels },
        read { 4: hits: PackedHit, 5: reservoirs: Packed },
        own { 6: merged: Packed },
    }
    |x, y, at, p, scene| merged[at] = merge(&scene, &p.specialised(settings), hits, reservoirs, [x, y])
}

/// All that is asked of a scene.
trait Scene: Trace + Surface<Material = Material> + AddressedLights + Probe {}
impl<S: Trace + Surface<Material = Material> + AddressedLights + Probe> Scene for S {}

#[derive(Clone, Copy)]
struct Sample {
    numbers: DiskNumbers,
    /// Which of the crossings the exit is.
    crossing: u32,
    /// The exit is kept by shifts, not found anew.
    joined: bool,
    exit: Hit,
    light: LightAddress,
    /// Of the exit's coordinates.
    density: f32,
    contribution_weight: f32,
    confidence: f32,
}

impl Packed {
    #[inline(always)]
    fn unpack(self) -> Sample {
        let [a, b, c] = self.0;
        let f = f32::from_bits;
        Sample {
            numbers: DiskNumbers { axis: a.x & 3, channel: (a.x >> 2) & 3, radius: f(a.y), turn: f(a.z) },
            crossing: (a.x >> 4) & 0xff,
            joined: (a.x >> 12) & 1 != 0,
            exit: Hit { t: 0.0, id: a.w, uv: Vec2::new(f(b.x), f(b.y)) },
            light: LightAddress { light: b.z & LightAddress::NO_LIGHT, u: b.w >> 8, v: c.x >> 8 },
            confidence: (a.x >> 16) as f32,
            density: f(c.y),
            contribution_weight: f(c.z),
        }
    }

    #[inline(always)]
    fn pack(sample: &Sample) -> Self {
        let Sample { numbers, crossing, joined, exit, light, density, contribution_weight, confidence } = *sample;
        let DiskNumbers { axis, channel, radius, turn } = numbers;
        let joined = if joined { 1 << 12 } else { 0 };
        let numbers = axis | (channel << 2) | (crossing << 4) | joined | ((confidence as u32) << 16);
        Self([
            UVec4::new(numbers, radius.to_bits(), turn.to_bits(), exit.id),
            UVec4::new(exit.uv.x.to_bits(), exit.uv.y.to_bits(), light.light, light.u << 8),
            UVec4::new(light.v << 8, density.to_bits(), contribution_weight.to_bits(), 0),
        ])
    }
}

/// Where a pixel's light leaves a body.
struct Receiver {
    at: SurfacePoint<Exit>,
    disk: Disk,
    rest: [Multiple; 3],
    extinction: Vec3,
    body: u32,
    /// What light inside is worth to the pixel.
    worth: Vec3,
}

/// A sample at a receiver.
#[derive(Clone, Copy)]
struct Shifted {
    exit: Hit,
    density: f32,
    target: f32,
    /// Target times Jacobian.
    arrives: f32,
}

const NOWHERE: Shifted = Shifted { exit: Hit::MISS, density: 0.0, target: 0.0, arrives: 0.0 };
/// The largest confidence that a record holds.
const MOST: f32 = 65_535.0;

#[inline(always)]
fn as_exit<S: Scene>(scene: &S, ray: &Ray, hit: &Hit) -> SurfacePoint<Exit> {
    let point = scene.surface(ray, hit);
    let SurfacePoint { position, normal, shading_normal, offset, emission, absorption, .. } = point;
    let material = Exit::new(&point.material, scene.features());
    SurfacePoint { position, normal, shading_normal, offset, material, emission, absorption }
}

impl Receiver {
    #[inline(always)]
    fn new<S: Scene>(scene: &S, params: &HybridParams, hit: &Hit, [x, y]: [u32; 2]) -> Self {
        let ray = primary_ray(&params.path.camera, Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::ZERO);
        let at = as_exit(scene, &ray, hit);
        let interior = scene.interior(hit);
        let medium = interior.medium(scene.absorbed(hit));
        let kept = params.fit().spread(&interior, hit.t);
        let profile = Profile::of_medium(&medium, params.fit().shape()).of_channels(kept);
        let Medium { albedo, absorbed, extinction, anisotropy } = medium;
        let rest = |albedo: f32, absorbed: f32| Multiple::new(albedo, absorbed, anisotropy, params.fit().remainder());
        let vertex: Vertex<Exit> = Vertex::new(&at, &ray, scene.features());
        Self {
            disk: Disk { support: params.fit().support(), ..Disk::new(at.position, at.normal, profile) },
            rest: [rest(albedo.x, absorbed.x), rest(albedo.y, absorbed.y), rest(albedo.z, absorbed.z)],
            extinction,
            body: interior.body,
            worth: vertex.bsdf.evaluate(vertex.frame.to_local(-ray.direction)).value * interior.gain,
            at,
        }
    }

    /// Whether an exit is kept: it is far off, or looks another way.
    #[inline(always)]
    fn joins(&self, exit: &SurfacePoint<Exit>) -> bool {
        let far = 2.0 * max_component(self.disk.profile.distance);
        (dot(self.at.normal, exit.normal) <= 0.5) | (length(exit.position - self.at.position) >= far)
    }

    /// The exit by the numbers of a sample.
    #[inline(always)]
    fn replay<S: Scene>(&self, scene: &S, sample: &Sample) -> Hit {
        let crossings = scene.probe(&self.disk.segment(&sample.numbers), self.body);
        let index = sample.crossing as usize;
        crossings.listed(index)
    }

    /// A sample here, of which the exit is known if it is the pixel's `own`.
    #[inline(always)]
    fn shift<S: Scene>(&self, scene: &S, sample: &Sample, own: bool) -> Shifted {
        let kept = own | sample.joined;
        let exit = if kept { sample.exit } else { self.replay(scene, sample) };
        if !exit.is_hit() | (sample.confidence <= 0.0) {
            return NOWHERE;
        }
        let outside = Ray { direction: -self.at.normal, ..Ray::NONE };
        let point = as_exit(scene, &outside, &exit);
        let (weight, density) = self.disk.weight(point.position, point.normal);
        let density = density * scene.location(&exit).extent;
        let found = density > 0.0;
        if !found | (!own & (self.joins(&point) != sample.joined)) {
            return NOWHERE;
        }
        let outside = Ray { direction: -point.normal, ..Ray::NONE };
        let vertex: Vertex<Exit> = Vertex::new(&point, &outside, scene.features());
        let AddressedLight { sample: light, extent } = scene.light_at(sample.light);
        let connection = vertex.connect(&light);
        if max_component(connection.value) <= 0.0 || (!kept && scene.occluded(&connection.shadow)) {
            return NOWHERE;
        }
        let x = self.extinction * length(point.position - self.at.position);
        let rest = Vec3::new(self.rest[0].share(x.x), self.rest[1].share(x.y), self.rest[2].share(x.z));
        let value = self.worth * weight * rest * connection.value;
        let target = num::max(luminance(value), 0.0) * (density * extent * connection.per_area());
        let jacobian = if kept { 1.0 } else { num::div(sample.density, density) };
        Shifted { exit, density, target, arrives: target * jacobian }
    }
}

/// A pixel near by. What is reserved in the parameters holds the radius in pixels, and the form of MIS.
#[inline(always)]
fn partner(params: &HybridParams, rng: &Rng, [x, y]: [u32; 2]) -> [u32; 2] {
    let words = rng.hash(0);
    let (sin, cos) = num::sin_cos(rng::unit(words.x));
    let radius = f32::from_bits(params.reserved[1]) * num::sqrt(rng::unit(words.y));
    let place = |at: u32, off: f32, side: u32| num::clamp(at as f32 + off * radius, 0.0, side as f32 - 1.0) as u32;
    [place(x, cos, params.path.width), place(y, sin, params.path.height)]
}

fn merge<S: Scene>(
    scene: &S,
    params: &HybridParams,
    hits: &[PackedHit],
    reservoirs: &[Packed],
    at: [u32; 2],
) -> Packed {
    let rng = Rng::new(at[0], at[1], params.path.first_sample, params.path.seed, Sampler::Independent);
    let places = [at, partner(params, &rng, at)];
    let index = |[x, y]: [u32; 2]| (y * params.path.width + x) as usize;
    let seen = [hits[index(places[0])].unpack(), hits[index(places[1])].unpack()];
    let own = reservoirs[index(at)];
    let alike = seen[0].is_hit() & seen[1].is_hit();
    if !alike || scene.object(&seen[0]) != scene.object(&seen[1]) {
        return own;
    }
    let samples = [own.unpack(), reservoirs[index(places[1])].unpack()];
    // by receiver and sample
    let mut shifted = [NOWHERE; 4];
    let mut to = 0;
    while to < 2 {
        let receiver = Receiver::new(scene, params, &seen[to], places[to]);
        let mut of = 0;
        while of < 2 {
            shifted[2 * to + of] = receiver.shift(scene, &samples[of], of == to);
            of += 1;
        }
        to += 1;
    }
    select(params, &rng, &samples, &shifted)
}

/// One of two samples.
#[inline(always)]
fn select(params: &HybridParams, rng: &Rng, samples: &[Sample; 2], shifted: &[Shifted; 4]) -> Packed {
    let mut combine = Combine::new(Mis::from_bits(params.reserved[0]), 1.0);
    combine.input(samples[0].confidence, shifted[0].target * samples[0].contribution_weight);
    combine.input(samples[1].confidence, shifted[1].arrives * samples[1].contribution_weight);
    let mut pair = 0;
    while pair < 4 {
        let of = &shifted[pair as usize];
        let is_own = (pair == 0) | (pair == 3);
        combine.target(pair / 2, pair % 2, if is_own { of.target } else { of.arrives });
        pair += 1;
    }
    let mut reservoir = Reservoir::empty(0);
    let words = rng.hash(1);
    reservoir.update(0, combine.weight(0), 1.0, rng::unit(words.x));
    reservoir.update(1, combine.weight(1), 1.0, rng::unit(words.y));
    let chosen = reservoir.sample as usize;
    let Shifted { exit, density, target, .. } = shifted[chosen];
    Packed::pack(&Sample {
        exit,
        density,
        contribution_weight: reservoir.contribution_weight(1.0, target),
        confidence: num::min(combine.confidence(), MOST),
        ..samples[chosen]
    })
}
