//! What a pixel's candidates weigh when it chooses among them.

use super::tile::{self, Window};
use super::{CANDIDATE_DIMENSION, DiParams, Flags, SELECTION_DIMENSION, TileWords, evaluate};
use crate::bsdf::ScatteringFunction;
use crate::geometry::Ray;
use crate::num;
use crate::rng::Rng;
use crate::scene::{AddressedLight, AddressedLights, BsdfOf, LightAddress, Surface, SurfacePoint};
use crate::transport::Vertex;

/// What a pixel sees: the point that a ray has met, and the vertex there.
#[cfg_attr(
    target_arch = "spirv",
    allow(dead_code, reason = "point and ray are read where candidates are weighed in step")
)]
pub(super) struct Seen<'a, M, B> {
    pub(super) point: &'a SurfacePoint<M>,
    pub(super) ray: &'a Ray,
    pub(super) vertex: &'a Vertex<B>,
}

/// Which candidate it is: those from lights come first, and after them what scattering has found.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) index: u32,
    /// Whether it is that from scattering, whose address is `scattered`.
    pub(super) last: bool,
    pub(super) scattered: LightAddress,
}

/// A candidate's weight.
#[derive(Clone, Copy)]
pub(super) struct Weighed {
    pub(super) target: f32,
    /// The target over the density, zero of what is no light.
    pub(super) weight: f32,
    pub(super) shadow: Ray,
    /// Random words: one for the choice within a group, and one for that of the group, of which the last candidate's counts.
    pub(super) within: u32,
    pub(super) among: u32,
}

/// How candidates are weighed.
pub(super) trait Weigh<S: Surface> {
    /// The address and the weight of a candidate. It is asked for one after the other, from the first on.
    fn weigh(
        &mut self,
        scene: &S,
        tiles: &[TileWords],
        seen: &Seen<'_, S::Material, BsdfOf<S>>,
        stream: &Stream,
        place: Place,
    ) -> (LightAddress, Weighed);
}

/// Each when it is asked for.
pub(super) struct OneByOne;

impl<S: Surface + AddressedLights> Weigh<S> for OneByOne {
    #[inline(always)]
    fn weigh(
        &mut self,
        scene: &S,
        tiles: &[TileWords],
        seen: &Seen<'_, S::Material, BsdfOf<S>>,
        stream: &Stream,
        place: Place,
    ) -> (LightAddress, Weighed) {
        let (address, light) = if !place.last & stream.is_tiled() {
            stream.of_tile(tiles, place.index)
        } else {
            // in one place, since it takes much code
            with_light(scene, if place.last { place.scattered } else { stream.choose(scene, place.index) })
        };
        let weighed = if address.is_light() {
            stream.weighed(seen.vertex, place.index, &light)
        } else {
            stream.weightless(place.index)
        };
        (address, weighed)
    }
}

/// What the candidates of a pixel have in common.
#[derive(Clone, Copy)]
pub(super) struct Stream {
    rng: Rng,
    flags: Flags,
    window: Window,
    /// How many candidates come from lights.
    from_lights: f32,
    /// How many come from scattering: one or none.
    from_scattering: f32,
    /// The first candidate's number among those of all frames.
    first: u32,
    /// Surfaces may be blended.
    blends: bool,
}

impl Stream {
    #[inline(always)]
    pub(super) fn new(params: &DiParams, flags: Flags, at: [u32; 2], blends: bool) -> Self {
        let rng = params.rng(at);
        let tiled = flags.contains(Flags::TILES);
        Self {
            rng,
            flags,
            window: if tiled { Window::new(params, at, rng.hash(CANDIDATE_DIMENSION).x) } else { Window::NONE },
            from_lights: params.candidates as f32,
            from_scattering: if flags.contains(Flags::SCATTER_CANDIDATE) { 1.0 } else { 0.0 },
            first: params.frame.wrapping_mul(params.candidates),
            blends,
        }
    }

    /// Whether candidates from lights come from a tile.
    #[inline(always)]
    pub(super) fn is_tiled(&self) -> bool {
        self.flags.contains(Flags::TILES)
    }

    /// A candidate of the pixel's tile.
    #[inline(always)]
    pub(super) fn of_tile(&self, tiles: &[TileWords], index: u32) -> (LightAddress, AddressedLight) {
        tile::unpack(&tiles[self.window.at(index) as usize])
    }

    /// The address of a candidate from lights. Candidates are spread over those of a frame, and on over frames: a reservoir's mean is linear
    /// in what each candidate gives, so that it does not matter that they depend on each other.
    #[inline(always)]
    pub(super) fn choose<S: AddressedLights>(&self, scene: &S, index: u32) -> LightAddress {
        scene.choose_address(self.rng.of_sample(self.first.wrapping_add(index)).draw(CANDIDATE_DIMENSION))
    }

    /// The weight of a candidate by the density of all techniques, `sum n_t p_t`.
    #[inline(always)]
    pub(super) fn weighed<B: ScatteringFunction>(
        &self,
        vertex: &Vertex<B>,
        index: u32,
        light: &AddressedLight,
    ) -> Weighed {
        let e = evaluate(self.flags, vertex, light);
        let is_found = !(self.blends & light.sample.blended);
        let scatter_density = if is_found { self.from_scattering * e.scatter_density } else { 0.0 };
        let density = self.from_lights * e.light_density + scatter_density;
        let weight = if (e.target > 0.0) & (density > num::FLUSH_BELOW) { num::div(e.target, density) } else { 0.0 };
        Weighed { target: e.target, weight, shadow: e.shadow, ..self.weightless(index) }
    }

    /// The weight of what is no light, which is none.
    #[inline(always)]
    fn weightless(&self, index: u32) -> Weighed {
        let words = self.rng.hash(SELECTION_DIMENSION.wrapping_add(index));
        Weighed { target: 0.0, weight: 0.0, shadow: Ray::NONE, within: words.x, among: words.y }
    }
}

/// An address with what lies there.
#[inline(always)]
pub(super) fn with_light<S: AddressedLights>(scene: &S, address: LightAddress) -> (LightAddress, AddressedLight) {
    (address, if address.is_light() { scene.light_at(address) } else { AddressedLight::NONE })
}
