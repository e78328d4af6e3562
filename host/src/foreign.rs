//! A check of scenes of other types than this library's: the answers of [`Trace`](restir_shared::scene::Trace), `Surface` and
//! `AddressedLights` have to agree with each other, or images are wrong in ways that are hard to see.
//!
//! ```
//! use restir_host::{foreign, scene::Camera};
//! use restir_shared::bsdf::Material;
//! use restir_shared::geometry::{Hit, Ray};
//! use restir_shared::glam::{DVec3, UVec4, Vec2, Vec3};
//! use restir_shared::scene::{AddressedLight, AddressedLights, LightAddress, LightKind, LightSample, Lights};
//! use restir_shared::scene::{Surface, SurfacePoint, Trace};
//!
//! /// An endless floor under two lamps, and the probability with which each is chosen.
//! struct Floor(f32);
//! impl Trace for Floor {
//!     fn closest(&self, ray: &Ray) -> Hit {
//!         let t = -ray.origin.y / ray.direction.y;
//!         let at = ray.origin + ray.direction * t;
//!         if t > 0.0 && t < ray.t_max { Hit { t, id: 0, uv: Vec2::new(at.x, at.z) } } else { Hit::MISS }
//!     }
//! }
//! impl Surface for Floor {
//!     type Material = Material;
//!     fn surface(&self, _: &Ray, hit: &Hit) -> SurfacePoint {
//!         SurfacePoint::diffuse(Vec3::new(hit.uv.x, 0.0, hit.uv.y), Vec3::Y, 1e-3, Vec3::splat(0.5))
//!     }
//! }
//! impl Lights for Floor {
//!     fn sample_light(&self, words: UVec4) -> LightSample {
//!         self.light_at(self.choose_address(words)).sample
//!     }
//! }
//! impl AddressedLights for Floor {
//!     fn choose_address(&self, words: UVec4) -> LightAddress {
//!         LightAddress::of_words(words.z & 1, words)
//!     }
//!     fn light_at(&self, address: LightAddress) -> AddressedLight {
//!         let (position, density) = (Vec3::new(address.light as f32, 2.0, 0.0), self.0);
//!         let sample = LightSample { position, emission: Vec3::ONE, density, kind: LightKind::Point, ..LightSample::NONE };
//!         AddressedLight { sample, extent: 1.0 }
//!     }
//! }
//!
//! let camera = Camera::pinhole(DVec3::new(0.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, 0.8);
//! assert!(foreign::check(&Floor(0.5), &camera).is_ok());
//! // two lamps that are chosen with the probability 1 each cannot be
//! assert!(foreign::check(&Floor(1.0), &camera).is_err());
//! ```

use crate::Error;
use crate::scene::Camera;
use restir_shared::camera::camera_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{AnyScene, LightAddress, LightKind, LightSample, SurfacePoint};
use restir_shared::vec::{dot, normalize};
use std::collections::BTreeMap;

/// Pixels along a side of the view whose surfaces are looked at.
const SIDE: u32 = 32;
/// Light samples.
const DRAWS: u32 = 1 << 16;
/// Light samples whose point is looked at from surfaces.
const LOOKS: u32 = 1 << 12;
/// Relative differences up to this are those of rounding.
const ROUNDING: f32 = 1.0e-3;
/// An area that is measured is off by as much.
const DIFFERENCES: f64 = 1.0e-2;
/// Side of the cells whose area is measured, in points of the lattice, of which 2^24 make a side of the unit square; points on each
/// side of its border, and the smallest cells relative to the coordinates of their points.
const CELL: u32 = 1 << 19;
const BORDER: u32 = 8;
const SMALLEST: f64 = 1.0e-3;
/// Standard errors that a mean is never away from its expectation.
const SIGMAS: f64 = 5.0;

/// Checks that the answers of a scene agree: surfaces with the rays that hit them, from wherever they are seen; light samples with
/// addresses, there and back; and densities with extents, whose products have to be probabilities. What `camera` sees is looked at,
/// and lights from there, with fixed random numbers: what is wrong elsewhere is not found.
///
/// # Errors
/// [`Error::Scene`] that names the first thing that is inconsistent, and what it should be.
pub fn check(scene: &dyn AnyScene, camera: &Camera) -> Result<(), Error> {
    let points = surfaces(scene, camera)?;
    let by_light = samples(scene)?;
    probabilities(&by_light)?;
    emitters(scene, &points)?;
    directions(scene)
}

fn wrong(problem: String) -> Error {
    Error::Scene { scene: "of foreign types".to_owned(), problem }
}

fn ensure(holds: bool, problem: impl FnOnce() -> String) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(wrong(problem())) }
}

fn length(v: Vec3) -> f32 {
    v.as_dvec3().length() as f32
}

fn differ(a: f32, b: f32) -> bool {
    (a - b).abs() > ROUNDING * a.abs().max(b.abs()) || a.is_nan() || b.is_nan()
}

fn numbers(index: u32) -> Rng {
    Rng::new(index & 0xffff, 0, 0, 1, Sampler::Independent)
}

/// What the camera sees, after its checks.
fn surfaces(scene: &dyn AnyScene, camera: &Camera) -> Result<Vec<SurfacePoint>, Error> {
    let params = camera.params(SIDE, SIDE);
    let mut points = Vec::new();
    for pixel in 0..SIDE * SIDE {
        let ray = camera_ray(&params, false, |uv| uv, 0, &numbers(pixel), pixel % SIDE, pixel / SIDE);
        let hit = scene.closest(&ray);
        if hit.is_hit() {
            points.push(surface(scene, &ray, &hit)?);
        }
    }
    Ok(points)
}

fn surface(scene: &dyn AnyScene, ray: &Ray, hit: &Hit) -> Result<SurfacePoint, Error> {
    let (id, point) = (hit.id, scene.surface(ray, hit));
    let reach = hit.t * length(ray.direction);
    let off = length(point.position - (ray.origin + ray.direction * hit.t));
    ensure(off <= ROUNDING * (reach + length(point.position)), || {
        format!("surface() puts the hit of {id} {off:e} away from where closest() found it, {reach:e} along the ray")
    })?;
    for (name, normal) in [("normal", point.normal), ("shading_normal", point.shading_normal)] {
        ensure(!differ(length(normal), 1.0), || {
            format!("the {name} of the hit of {id} has the length {}, not 1", length(normal))
        })?;
    }
    ensure(point.offset >= 0.0 && point.offset.is_finite(), || {
        format!("the offset {} of the hit of {id} is none", point.offset)
    })?;
    // reuse asks with a ray that was never traced
    let elsewhere = Ray { origin: point.position + point.normal, direction: -point.normal, ..*ray };
    let again = scene.surface(&elsewhere, &Hit { t: 1.0, ..*hit });
    ensure((again.position, again.normal) == (point.position, point.normal), || {
        format!(
            "the stored hit of {id} is another point when it is seen from a new direction: surface() has to use its id and uv alone"
        )
    })?;
    ensure(scene.occluded(&Ray { t_max: hit.t * (1.0 + ROUNDING), ..*ray }), || {
        format!("occluded() finds nothing up to the hit of {id} that closest() found")
    })?;
    ensure(!scene.occluded(&Ray { t_max: hit.t * (1.0 - ROUNDING), ..*ray }), || {
        format!("occluded() finds something before the nearest hit, of {id}")
    })?;
    Ok(point)
}

/// Densities over (light, u, v) of the draws of each light.
type ByLight = BTreeMap<u32, Vec<f64>>;

/// Addresses and samples of the same random words.
fn samples(scene: &dyn AnyScene) -> Result<ByLight, Error> {
    let mut by_light = ByLight::new();
    for index in 0..DRAWS {
        let words = numbers(index).hash(index >> 16);
        let (address, sample) = (scene.choose_address(words), scene.sample_light(words));
        if !address.is_light() {
            ensure(sample.density == 0.0, || {
                "sample_light() finds a light where choose_address() finds none".to_owned()
            })?;
            continue;
        }
        let found = scene.light_at(address);
        same_light(&format!("light {}", address.light), &found.sample, &sample)?;
        let density = f64::from(found.sample.density) * f64::from(found.extent);
        ensure(density >= 0.0 && density.is_finite(), || {
            format!("light {} has the density {} and the extent {}", address.light, found.sample.density, found.extent)
        })?;
        if index < LOOKS {
            extent(scene, address)?;
        }
        by_light.entry(address.light).or_default().push(density);
    }
    Ok(by_light)
}

fn same_light(what: &str, at: &LightSample, sample: &LightSample) -> Result<(), Error> {
    ensure(!differ(at.density, sample.density) && at.kind == sample.kind, || {
        format!(
            "light_at() gives {what} the density {} ({:?}), sample_light() gives {} ({:?}) by the same words",
            at.density, at.kind, sample.density, sample.kind
        )
    })?;
    let off = length(at.position - sample.position);
    ensure(off <= ROUNDING * (1.0 + length(at.position)), || {
        format!("light_at() and sample_light() put {what} {off:e} apart by the same words")
    })
}

/// The extent against the area, or the solid angle, that a small part of the unit square covers.
fn extent(scene: &dyn AnyScene, address: LightAddress) -> Result<(), Error> {
    let (light, found) = (address.light, scene.light_at(address));
    if found.sample.is_punctual() {
        return ensure(found.extent == 1.0, || {
            format!("the extent of light {light}, which has none, is {} and not 1", found.extent)
        });
    }
    let [fine, coarse] = match [CELL / 2, CELL].map(|cell| area(scene, address, cell)) {
        [Some(fine), Some(coarse)] => [fine, coarse],
        _ => return Ok(()),
    };
    // where the parametrisation is curved or has a kink the two say something else, and nothing of the extent
    let smooth = (fine - coarse).abs() <= 0.5 * DIFFERENCES * fine;
    let off = (fine - f64::from(found.extent)).abs();
    ensure(!smooth || off <= DIFFERENCES * fine, || {
        format!(
            "light {light} covers {fine:.6e} per area of the unit square at its address, and its extent is {:.6e}",
            found.extent
        )
    })
}

/// The area, per area of the unit square, of the cell about an address: that within the image of its border. None, if the cell reaches
/// beyond the square, or is too small for the rounding of positions.
fn area(scene: &dyn AnyScene, LightAddress { light, u, v }: LightAddress, cell: u32) -> Option<f64> {
    let inside = |x: u32| (cell / 2..(1 << 24) - cell / 2).contains(&x);
    if !inside(u) || !inside(v) {
        return None;
    }
    let [u, v] = [u - cell / 2, v - cell / 2];
    let along = |i: u32| cell / BORDER * i;
    let border = (0..BORDER)
        .map(|i| (along(i), 0))
        .chain((0..BORDER).map(|i| (along(BORDER), along(i))))
        .chain((0..BORDER).map(|i| (along(BORDER - i), along(BORDER))))
        .chain((0..BORDER).map(|i| (0, along(BORDER - i))));
    let point = |(du, dv)| scene.light_at(LightAddress { light, u: u + du, v: v + dv }).sample.position.as_dvec3();
    let points: Vec<DVec3> = border.map(point).collect();
    let first = points[0];
    let reach = points.iter().map(|point| (*point - first).length()).fold(0.0, f64::max);
    let next = points.iter().skip(1).chain([&first]);
    let twice: DVec3 = points.iter().zip(next).map(|(a, b)| (*a - first).cross(*b - first)).sum();
    let side = f64::from(cell) / f64::from(1 << 24);
    (reach > SMALLEST * first.length()).then(|| 0.5 * twice.length() / (side * side))
}

/// Density times extent is a density over (light, u, v), whose integral is 1.
fn probabilities(by_light: &ByLight) -> Result<(), Error> {
    let draws: usize = by_light.values().map(Vec::len).sum();
    if draws == 0 {
        return Ok(());
    }
    let draws = draws as f64;
    let constant =
        |densities: &Vec<f64>| densities.iter().all(|density| (density - densities[0]).abs() <= 1e-5 * densities[0]);
    let (mut sum, mut variance, mut rare) = (0.0, 0.0, 0.0);
    for (light, densities) in by_light {
        let share = densities.len() as f64 / draws;
        rare += f64::from(u8::from(densities.len() == 1));
        if constant(densities) {
            sum += densities[0];
            continue;
        }
        // the mean of 1 / density over the draws of a light is the area of the unit square that they come from
        let inverse: Vec<f64> = densities.iter().map(|density| density.recip()).collect();
        let area = inverse.iter().sum::<f64>() / draws;
        let square = inverse.iter().map(|x| x * x).sum::<f64>() / draws;
        let error = ((square - area * area).max(0.0) / draws).sqrt();
        ensure(area <= 1.0 + SIGMAS * error + f64::from(ROUNDING), || {
            format!(
                "the density times the extent of light {light} is too small by a factor of {area:.4} (+- {error:.4}) over its draws"
            )
        })?;
        sum += share;
        variance += share * (1.0 - share) / draws;
    }
    // lights that no draw has met weigh about as much as those that one has
    let missing = rare / draws;
    let tolerance = f64::from(ROUNDING) + SIGMAS * (variance.sqrt() + rare.sqrt() / draws);
    ensure((sum + missing - 1.0).abs() <= tolerance, || {
        format!(
            "the products of density and extent sum up to {:.4} over all lights, and have to be a probability, 1: \
             a density, or an extent, is off",
            sum + missing
        )
    })
}

/// Emitters that rays find, from what the camera sees.
fn emitters(scene: &dyn AnyScene, points: &[SurfacePoint]) -> Result<(), Error> {
    if points.is_empty() {
        return Ok(());
    }
    for index in 0..LOOKS {
        let rng = numbers(index);
        let sample = scene.sample_light(rng.hash(7));
        let point = points[rng.hash(8).x as usize % points.len()];
        if sample.density == 0.0 || sample.kind != LightKind::Area {
            continue;
        }
        let to_light = sample.position - point.position;
        let side = if dot(to_light, point.normal) < 0.0 { -point.offset } else { point.offset };
        let origin = point.position + point.normal * side;
        let direction = normalize(sample.position - origin);
        let ray = Ray { origin, direction, t_max: Ray::FAR, key: 0 };
        let hit = scene.closest(&ray);
        let density = if hit.is_hit() { scene.light_density(&hit) } else { 0.0 };
        if density > 0.0 {
            emitter(scene, &ray, &hit, density)?;
        } else if hit.is_hit() {
            ensure(!scene.address_of_hit(&hit).is_light(), || {
                format!("address_of_hit() finds a light at the hit of {}, and light_density() finds none", hit.id)
            })?;
        }
    }
    Ok(())
}

fn emitter(scene: &dyn AnyScene, ray: &Ray, hit: &Hit, density: f32) -> Result<(), Error> {
    let address = scene.address_of_hit(hit);
    ensure(address.is_light(), || {
        format!("light_density() finds a light at the hit of {}, address_of_hit() finds none", hit.id)
    })?;
    let (light, found, point) = (address.light, scene.light_at(address).sample, scene.surface(ray, hit));
    let off = length(found.position - point.position);
    ensure(off <= ROUNDING * (hit.t + length(point.position)), || {
        format!(
            "address_of_hit() gives the hit of {} to light {light}, whose point there is {off:e} away: the address is another one's",
            hit.id
        )
    })?;
    ensure(!differ(found.density, density), || {
        format!("light {light} has the density {} by light_at() and {density} by light_density()", found.density)
    })?;
    let shines = found.two_sided || dot(ray.direction, found.normal) < 0.0;
    let expected = if shines { found.emission } else { Vec3::ZERO };
    ensure((0..3).all(|i| !differ(expected[i], point.emission[i])), || {
        format!("light {light} emits {expected} by light_at() and {} by surface()", point.emission)
    })
}

/// The environment, there and back.
fn directions(scene: &dyn AnyScene) -> Result<(), Error> {
    for index in 0..LOOKS {
        let words = numbers(index).hash(9);
        let address = scene.choose_address(words);
        if !address.is_light() || scene.light_at(address).sample.kind != LightKind::Environment {
            continue;
        }
        let there = scene.light_at(address).sample;
        let point = scene.environment(there.position);
        ensure(!differ(there.density, point.density), || {
            format!(
                "a direction has the density {} by light_at() and {} by environment()",
                there.density, point.density
            )
        })?;
        let (emission, radiance) = (there.emission, point.radiance);
        ensure((0..3).all(|i| !differ(emission[i], radiance[i])), || {
            format!("a direction emits {emission} by light_at(), and {radiance} arrives by environment()")
        })?;
        let back = scene.address_of_environment(there.position);
        ensure(back.light == address.light, || {
            format!("address_of_environment() gives a direction of light {} to light {}", address.light, back.light)
        })?;
        let off = length(scene.light_at(back).sample.position - there.position);
        ensure(off <= ROUNDING, || format!("address_of_environment() leads to a direction {off:e} away"))?;
    }
    Ok(())
}
