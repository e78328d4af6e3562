//! What a technique asks of a scene, as small traits that an embedder implements as far as needed, and
//! [`SceneView`], which implements all of them over the scene's arenas.
//!
//! | trait | what it answers | who asks |
//! |---|---|---|
//! | [`Trace`] | what a ray hits, and whether a segment is blocked | every technique |
//! | [`Surface`] | position, normals and material at a hit | every technique |
//! | [`Lights`] | points on emitters, chosen without regard to the receiver | path tracing |
//! | [`AddressedLights`] | the same points by a light's index and two coordinates, so that a reservoir can keep them | techniques that reuse samples |
//! | [`Frames`] | the scene of this frame and of the last one | techniques that reuse samples over time |
//! | [`Probe`] | all hits of one object on a segment | light that walks under a surface |
//!
//! Every method is a function of its arguments alone: techniques rely on asking twice and getting the same bits. On a processor any
//! arithmetic will do for that; the functions of [`num`] are for who wants the same bits on several devices. A scene
//! that is not `Copy` is passed as a reference: `&S` implements every trait that `S` does.
//!
//! A scene whose emitters rays can hit ([`LightKind::Area`], [`LightKind::Environment`]) answers for them twice, and both answers have to agree:
//!
//! | question | path tracing asks | reuse asks | if it is not implemented |
//! |---|---|---|---|
//! | what a sampled point emits | [`Lights::sample_light`] | [`AddressedLights::choose_address`], [`AddressedLights::light_at`] | |
//! | what a point that was hit emits | [`Surface::surface`] | the same | |
//! | how often sampling finds a point that was hit | [`Lights::light_density`] | | the light is counted twice, too bright |
//! | which sample a point that was hit is | | [`AddressedLights::address_of_hit`], [`AddressedLights::address_of_environment`] | the light that scattering finds is lost, too dark |
//!
//! The crate `restir-host` has a check of these answers, `foreign::check`.
//!
//! The following scene can be path traced and rendered with reservoirs by any technique of this crate; the examples of other modules use it.
//!
//! ```
#![doc = include_str!("floor.rs")]
//!
//! let down = Ray { origin: Vec3::Y, direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
//! let hit = Floor.closest(&down);
//! assert_eq!((hit.t, Floor.surface(&down, &hit).position), (1.0, Vec3::ZERO));
//! ```
//!
//! Its lamp is a point. This one has two lamps that rays can hit:
//!
//! ```
#![doc = include_str!("lamps.rs")]
//!
//! use restir_shared::geometry::PackedHit;
//! use restir_shared::layout::CameraParams;
//! use restir_shared::rng::{Rng, Sampler};
//! use restir_shared::technique::path::radiance;
//! use restir_shared::technique::restir_di::{DiParams, initial, shade};
//!
//! // a point that was hit, and the sample that it is
//! let up = Ray { origin: Vec3::X, direction: Vec3::Y, t_max: Ray::FAR, key: 0 };
//! let hit = Lamps.closest(&up);
//! let light = Lamps.light_at(Lamps.address_of_hit(&hit));
//! assert!((light.sample.position - Lamps.surface(&up, &hit).position).abs().max_element() < 1e-6);
//! assert_eq!(light.sample.density, Lamps.light_density(&hit));
//!
//! // the floor below the second lamp, by path tracing and by resampling
//! let down = Ray { origin: Vec3::new(1.0, 1.0, 0.0), direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
//! let seen = PackedHit::pack(&Lamps.closest(&down));
//! let camera = CameraParams::pinhole(down.origin, Vec3::X, Vec3::Z, 0.01, [1, 1]);
//! let (mut traced, mut resampled) = (0.0, 0.0);
//! for sample in 0..4096 {
//!     traced += radiance(&Lamps, down, &Rng::new(0, 0, sample, 7, Sampler::Sobol), 2, false).x / 4096.0;
//!     let params = DiParams::new(camera, [1, 1], 7).of_frame(sample, camera);
//!     let drawn = initial(&Lamps, &params, &[], seen, [0, 0]);
//!     resampled += shade(&Lamps, &params, seen, drawn.reservoir, drawn.direct, [0, 0]).sum[0] / 4096.0;
//! }
//! assert!((traced - resampled).abs() < 0.01 * traced);
//! ```

#[cfg(not(target_arch = "spirv"))]
mod any;
mod coverage;
mod deferred;
mod delegate;
mod environment;
mod frames;
mod given;
mod light;
mod probe;
mod reference;
mod still;
mod surface;
mod texture;
mod view;

#[cfg(not(target_arch = "spirv"))]
pub use any::{AnyFrames, AnyScene};
#[cfg(not(target_arch = "spirv"))]
#[doc(hidden)]
pub use any::{AnyProbed, ProbedFrames};
#[cfg(not(target_arch = "spirv"))]
pub use deferred::Asked;
#[doc(hidden)]
pub use deferred::Memory;
pub use deferred::{Deferred, DeferredRay, KnownHits};
pub use frames::SceneFrames;
pub use given::{Given, GivenPlanes, GivenSurface};
#[cfg(not(target_arch = "spirv"))]
pub use still::Probed;
pub use still::Still;
pub use view::SceneView;

use crate::bsdf::{Material, Scattering};
#[cfg(not(target_arch = "spirv"))]
use crate::geometry::Coverage;
use crate::geometry::{Crossings, Hit, Ray};
#[cfg(not(target_arch = "spirv"))]
use crate::lanes::Lanes;
use crate::layout::FEATURES_ALL;
use crate::medium::Interior;
use crate::num;
use crate::pack::floor_24;
use glam::{UVec4, Vec2, Vec3};

/// Rays against the scene: what they hit first, and whether anything is in their way.
pub trait Trace {
    /// The nearest hit with `0 < t < ray.t_max`: the smallest (t, id) over all primitives that the ray meets, from either side.
    /// [`Hit::MISS`] if none.
    fn closest(&self, ray: &Ray) -> Hit;
    /// Whether there is any hit with `0 < t < ray.t_max`. It looks for the nearest one, if not implemented.
    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_hit()
    }
}

/// Objects, and all places in which a segment meets one: what light that walks under a surface needs. Whoever has no such material
/// need not implement it.
///
/// An object is what light may cross without leaving it. Its number says nothing but that two points belong together.
pub trait Probe {
    /// The object of a hit.
    fn object(&self, hit: &Hit) -> u32;
    /// All hits of an object with `0 < t < ray.t_max`, of front and back sides. Other objects neither count nor block. The answer is a
    /// function of the set of hits alone.
    fn probe(&self, ray: &Ray, object: u32) -> Crossings;
}

/// A hierarchy over a scene's triangles in place of the BVH in the arenas, with the same hits.
#[doc(hidden)]
#[cfg(not(target_arch = "spirv"))]
pub trait Hierarchy {
    /// As [`Trace::closest`]; `coverage` says which hits of marked triangles count.
    fn closest(&self, ray: &Ray, coverage: &dyn Coverage) -> Hit;
    /// [`Self::closest`] of each ray. They have most of their way in common, which need not be used.
    fn closest_together(&self, rays: &Lanes<Ray>, coverage: &dyn Coverage) -> Lanes<Hit> {
        self.closest_each(rays, &Lanes::all(true), coverage)
    }
    /// [`Self::closest`] of each ray in `of`, in the place of others [`Hit::MISS`]. What is computed for all at once may be faster.
    fn closest_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> Lanes<Hit> {
        Lanes::from_fn(|lane| if of.get(lane) { self.closest(&rays.get(lane), coverage) } else { Hit::MISS })
    }
    /// [`Self::occluded`] of each ray in `of`, in the place of others false.
    fn occluded_each(&self, rays: &Lanes<Ray>, of: &Lanes<bool>, coverage: &dyn Coverage) -> Lanes<bool> {
        Lanes::from_fn(|lane| of.get(lane) && self.occluded(&rays.get(lane), coverage))
    }
    /// Whether one of the rays may meet a triangle that emits, be it behind others. Nobody traces the rays where the answer is no, so that it
    /// has to be sure. If this is not implemented, the answer is always yes.
    fn may_meet_emitters(&self, rays: &Lanes<Ray>) -> bool {
        let _ = rays;
        true
    }
    /// [`Self::may_meet_emitters`] of all rays between the given ones: those whose origin and direction have components between theirs.
    /// Directions may have any length.
    fn emitters_between(&self, rays: &Lanes<Ray>) -> bool {
        let _ = rays;
        true
    }
    /// As [`Trace::occluded`].
    fn occluded(&self, ray: &Ray, coverage: &dyn Coverage) -> bool;
    /// As [`Probe::probe`]; `coverage` is asked of the hits of all triangles, marked or not, and says which count and belong to the
    /// object.
    fn crossings(&self, ray: &Ray, coverage: &dyn Coverage) -> Crossings;
}

/// What answers visibility queries in place of the BVH in the arenas: natively, perhaps, a structure that suits the
/// processor better.
#[doc(hidden)]
#[cfg(not(target_arch = "spirv"))]
pub type Tracer<'a> = Option<&'a (dyn Hierarchy + Sync)>;
/// The arenas answer, with a ring in this place.
#[doc(hidden)]
#[cfg(target_arch = "spirv")]
pub type Tracer<'a> = crate::geometry::Scratch;

/// What is at a hit.
pub trait Surface {
    /// How its points scatter: [`Material`], or a model of the embedder's.
    type Material: Scattering;

    /// Geometry and material at `hit`, seen along `ray`.
    ///
    /// The point is that of `hit.id` and `hit.uv` alone: reuse stores these two and asks for the same point from elsewhere, with a ray
    /// that was never traced, so that neither its origin nor `hit.t` says where the point is. `ray.direction` says from which side it
    /// is seen. A scene without triangles puts into `uv` whatever coordinates find its points again.
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<Self::Material>;

    /// Where the point of `hit.id` and `hit.uv` is, without its material. If not implemented, [`Self::surface`] is asked, with a ray along
    /// +z, and the extent is 1: of surfaces that move without being deformed it does not matter.
    #[inline(always)]
    fn location(&self, hit: &Hit) -> Location {
        let any = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR, key: 0 };
        let SurfacePoint { position, normal, offset, .. } = self.surface(&any, hit);
        Location { position, normal, offset, extent: 1.0 }
    }

    /// The hit, moved by [`SurfacePoint::offset`] from the edge if it lies on one. Where two walls meet, a point on the edge lies in the
    /// plane of both, and a ray that leaves the one begins in the plane of the other: roundings decide whether it hits that at a distance
    /// of zero. The hit as it is, if not implemented, which is right for surfaces without edges.
    #[inline(always)]
    fn off_edges(&self, hit: &Hit) -> Hit {
        *hit
    }

    /// As [`Self::surface`], of what passes straight through: the shading normal may be the geometric one, and the emission that
    /// without its texture.
    #[inline(always)]
    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<Self::Material> {
        self.surface(ray, hit)
    }

    /// What the surface encloses at `hit`. Nothing, if not implemented: all surfaces are sheets, and a scene should leave
    /// [`crate::layout::FEATURE_SUBSURFACE`] out of its features. Whoever traces paths through media asks
    /// again where it goes on, so that the answer must be that of `hit.id` and `hit.uv` alone, on both sides.
    #[inline(always)]
    fn interior(&self, hit: &Hit) -> Interior {
        let _ = hit;
        Interior::NONE
    }

    /// The part of a collision that is absorbed in the interior at `hit`: one less the albedo. That is what it is if not implemented, and it has lost its
    /// digits where next to nothing is absorbed; profiles of such media need them.
    #[inline(always)]
    fn absorbed(&self, hit: &Hit) -> Vec3 {
        Vec3::ONE - self.interior(hit).albedo
    }

    /// The `FEATURE_` bits of [`crate::layout`] that surfaces and lights may have: code for others is skipped. All of them, if not
    /// implemented, which is right for any scene and the slowest answer. A bit says what the answers to the other methods may hold, not how
    /// the scene stores it: emitters of any shape are [`crate::layout::FEATURE_EMISSIVE`], and how lights are chosen is nobody's concern.
    #[inline(always)]
    fn features(&self) -> u32 {
        FEATURES_ALL
    }
}

/// Emitters, chosen without regard to the receiver: what reuse across pixels needs.
pub trait Lights {
    /// A point on an emitter from four random words; its density is zero if the scene has none. The first two words are spread best
    /// ([`crate::rng::Rng::draw`]), so they should make the point, and the others choose the emitter.
    fn sample_light(&self, words: UVec4) -> LightSample;
    /// The density per area with which [`Self::sample_light`] gives the point at `hit`; zero off the emitters, and everywhere, if not
    /// implemented. It has to be implemented if rays can hit what is sampled: path tracing would count such light twice.
    #[inline(always)]
    fn light_density(&self, hit: &Hit) -> f32 {
        let _ = hit;
        0.0
    }
    /// What arrives along a ray of the given unit direction that hits nothing. Black, if not implemented.
    #[inline(always)]
    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        let _ = direction;
        EnvironmentPoint { radiance: Vec3::ZERO, density: 0.0 }
    }
}

/// Emitters by address: what keeps light samples and evaluates them elsewhere.
///
/// An address is a light and a point (u, v) of the unit square, which parametrises it. The lattice of (u, v) is as fine
/// as random numbers are, so that an address in a reservoir is the sample itself, and not its rounding.
pub trait AddressedLights: Lights {
    /// The address of a light chosen as [`Lights::sample_light`] does, from four random words;
    /// [`LightAddress::NONE`] if the scene has none.
    fn choose_address(&self, words: UVec4) -> LightAddress;
    /// What lies at an address that one of the other methods gave.
    fn light_at(&self, address: LightAddress) -> AddressedLight;
    /// The address nearest to a hit; [`LightAddress::NONE`] off the emitters, and everywhere, if not implemented. It has to be implemented
    /// if rays can hit what is sampled: reuse takes what scattering finds for a candidate, and what has no address is lost.
    #[inline(always)]
    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        let _ = hit;
        LightAddress::NONE
    }
    /// The address nearest to a direction of the environment; [`LightAddress::NONE`] without one, and if not implemented, which
    /// loses light as of [`Self::address_of_hit`].
    #[inline(always)]
    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        let _ = direction;
        LightAddress::NONE
    }
}

/// A scene that may move, in two frames: what reuse over time needs. A surface keeps its hits' ids and coordinates.
pub trait Frames {
    /// The scene of a frame.
    type Scene: Trace + Surface + AddressedLights;

    /// The scene of this frame or, with `other`, of the other one.
    fn scene(&self, other: bool) -> Self::Scene;

    /// Where an address of this frame or, with `of_other`, of the other one lies in the respective other frame;
    /// [`LightAddress::NONE`] where its light does not shine there.
    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress;
}

/// A light and a point of its parametrisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightAddress {
    /// Index of the light, below [`LightAddress::NO_LIGHT`].
    pub light: u32,
    /// Coordinate in 2^-24.
    pub u: u32,
    /// Coordinate in 2^-24.
    pub v: u32,
}

impl LightAddress {
    /// An index that refers to no light: the largest of 24 bits.
    pub const NO_LIGHT: u32 = 0x00ff_ffff;
    /// The address of no light: what a chooser gives in a scene without lights.
    pub const NONE: Self = Self { light: Self::NO_LIGHT, u: 0, v: 0 };

    /// Whether there is a light.
    #[inline(always)]
    pub fn is_light(&self) -> bool {
        self.light != Self::NO_LIGHT
    }

    /// A uniform point of a light, from the first two of four random words.
    #[inline(always)]
    pub fn of_words(light: u32, words: UVec4) -> Self {
        Self { light, u: words.x >> 8, v: words.y >> 8 }
    }

    /// The lattice point below `uv`, which is limited to the unit square.
    #[inline(always)]
    pub fn nearest(light: u32, uv: Vec2) -> Self {
        Self { light, u: floor_24(uv.x), v: floor_24(uv.y) }
    }

    /// The key of the rays that ask whether the light is seen, in a scene of these features. It is a function of the point, so that
    /// to ask twice gives the same answer. A light without an extent uses its point for nothing else, and blended surfaces dim
    /// it in the mean over its points.
    #[inline(always)]
    pub fn key(&self, features: u32) -> u32 {
        Ray::random_key(features, self.u ^ (self.v << 8))
    }

    /// The point of the unit square.
    #[inline(always)]
    pub fn uv(&self) -> Vec2 {
        Vec2::new(self.u as f32 * num::UNIT_ROUNDOFF, self.v as f32 * num::UNIT_ROUNDOFF)
    }
}

/// A light sample and the measure of its light's parametrisation.
#[derive(Clone, Copy, Debug)]
pub struct AddressedLight {
    /// The sample, with the density that [`Lights::sample_light`] would give it.
    pub sample: LightSample,
    /// Area on a surface, or solid angle in the environment, per area of the unit square, 1 of a punctual light: times
    /// the density, it is the density over (light, u, v).
    pub extent: f32,
}

impl AddressedLight {
    /// No light.
    pub const NONE: Self = Self { sample: LightSample::NONE, extent: 1.0 };
}

/// How the surfaces of a scene scatter in one direction.
pub(crate) type BsdfOf<S> = <<S as Surface>::Material as Scattering>::Bsdf;

/// Where a point of a surface is.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal of the front side.
    pub normal: Vec3,
    /// As [`SurfacePoint::offset`].
    pub offset: f32,
    /// Area per area of the hit's coordinates, which changes where a surface is deformed.
    pub extent: f32,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<M = Material> {
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal of the front side. It need not face the ray: what is seen from the back is turned.
    pub normal: Vec3,
    /// Unit shading normal, on the front side. The geometric normal where the surface is what it seems.
    pub shading_normal: Vec3,
    /// How far from the surface, in units of the scene, a ray that leaves it must begin, so that it does not hit it again: on the side to which it
    /// goes. More than the rounding of hits; 10^-5 of the size of the scene is usual.
    pub offset: f32,
    /// How it scatters.
    pub material: M,
    /// Radiance emitted towards the origin of the ray that hit, linear RGB.
    pub emission: Vec3,
    /// Absorption behind the surface, per unit length, linear RGB: of a segment that ends at the back of the surface.
    pub absorption: Vec3,
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::soa! {
    SurfacePoints = SurfacePoint {
        position: Vec3, normal: Vec3, shading_normal: Vec3, offset: f32, material: Material, emission: Vec3, absorption: Vec3
    }
}

impl SurfacePoint {
    /// A point of a surface that scatters on both sides by Lambert's law, and emits nothing.
    #[inline(always)]
    pub fn diffuse(position: Vec3, normal: Vec3, offset: f32, reflectance: Vec3) -> Self {
        Self {
            position,
            normal,
            shading_normal: normal,
            offset,
            material: Material::diffuse(reflectance),
            emission: Vec3::ZERO,
            absorption: Vec3::ZERO,
        }
    }
}

/// A point on an emitter, or a direction in which there is one.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// World position; the unit direction towards a light at infinity.
    pub position: Vec3,
    /// Unit normal of an emitting surface's front side; where a spot light shines to.
    pub normal: Vec3,
    /// As [`SurfacePoint::offset`]: shadow rays end so far before the emitter, on the side from which they come.
    pub offset: f32,
    /// Radiance of a surface's front side or of the environment, radiant intensity of a punctual light along its axis,
    /// irradiance from a directional light; linear RGB.
    pub emission: Vec3,
    /// An emitting surface emits from its back as well.
    pub two_sided: bool,
    /// Density: per area on a surface, per steradian in the environment, else the probability of the light. Zero: no
    /// light.
    pub density: f32,
    /// What it lies on.
    pub kind: LightKind,
    /// It lies on a blended surface, of which it is the part that is there: rays of [`Ray::THROUGH`] do not find it.
    pub blended: bool,
    /// The key of the rays that ask whether it is seen ([`LightAddress::key`]).
    pub key: u32,
    /// The intensity of a light at a point depends on the cosine c to its axis as the square of c x + y, limited to [0, 1].
    pub falloff: Vec2,
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::soa! {
    LightSamples = LightSample {
        position: Vec3, normal: Vec3, offset: f32, emission: Vec3, two_sided: bool, density: f32, kind: LightKind,
        blended: bool, key: u32, falloff: Vec2
    }
}

/// What a light sample lies on. Scattering finds the first and the last kind, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LightKind {
    /// A point on a surface that emits; rays can hit it.
    Area,
    /// A point in space.
    Point,
    /// A single direction.
    Directional,
    /// A direction of the environment.
    Environment,
}

#[cfg(not(target_arch = "spirv"))]
crate::lanes::numbers! { LightKind = LightKind::Area }

impl LightSample {
    /// No light: the density is zero. As a base for others it shines evenly in all directions, is neither two-sided nor blended, and has
    /// the key 0.
    pub const NONE: Self = Self {
        position: Vec3::ZERO,
        normal: Vec3::Z,
        offset: 0.0,
        emission: Vec3::ZERO,
        two_sided: false,
        density: 0.0,
        kind: LightKind::Area,
        blended: false,
        key: 0,
        falloff: Vec2::Y,
    };

    /// A point of a surface that shines as 1 from both sides: what arrives of it is what the receiver does to light from there.
    #[inline(always)]
    pub fn surface(location: &Location) -> Self {
        let Location { position, normal, offset, .. } = *location;
        Self { position, normal, offset, emission: Vec3::ONE, two_sided: true, density: 1.0, ..Self::NONE }
    }

    /// Whether the light is infinitely far away.
    #[inline(always)]
    pub fn at_infinity(&self) -> bool {
        (self.kind == LightKind::Directional) | (self.kind == LightKind::Environment)
    }

    /// Whether scattering cannot find the light.
    #[inline(always)]
    pub fn is_punctual(&self) -> bool {
        (self.kind == LightKind::Point) | (self.kind == LightKind::Directional)
    }

    /// The factor on a point light's intensity, where `cos` is that of the angle between its axis and the receiver.
    #[inline(always)]
    pub fn spot_falloff(&self, cos: f32) -> f32 {
        let linear = num::clamp(cos * self.falloff.x + self.falloff.y, 0.0, 1.0);
        linear * linear
    }
}

/// The environment in a direction.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentPoint {
    /// Radiance that arrives from the direction, linear RGB.
    pub radiance: Vec3,
    /// Density per steradian with which [`Lights::sample_light`] gives the direction.
    pub density: f32,
}
