//! What a pixel's candidates weigh, and the choice among them.

use super::tile::{self, Window};
use super::{CANDIDATE_DIMENSION, DiParams, Flags, MAX_GLOSS_RENEWAL, SELECTION_DIMENSION, TileWords, evaluate};
use crate::bsdf::ScatteringFunction;
use crate::geometry::Ray;
use crate::num;
use crate::resample::reservoir::Reservoir;
use crate::rng::{self, Rng};
use crate::scene::{AddressedLight, AddressedLights, BsdfOf, LightAddress, Surface};
use crate::transport::Vertex;
use glam::Vec3;

/// Where the numbers of candidates begin that are not of first rounds.
const OTHER_ROUNDS: u32 = 1 << 31;

/// An address in a stream of candidates.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) address: LightAddress,
    pub(super) target: f32,
    /// Index in the stream; the one after the lights' is scattering's, which has [`super::FROM_SCATTERING`] once all are known.
    pub(super) index: u32,
    pub(super) shadow: Ray,
    /// What arrives of it where light may come through glass, as far as it is asked for: all until then.
    pub(super) transmittance: Vec3,
    /// Nothing arrives of it, where no light comes through glass.
    pub(super) occluded: bool,
}

impl Candidate {
    pub(super) const NONE: Self = Self {
        address: LightAddress::NONE,
        target: 0.0,
        index: 0,
        shadow: Ray::NONE,
        transmittance: Vec3::ZERO,
        occluded: true,
    };

    /// Its visibility. Without glass it is one bit, which takes no register of a GPU.
    #[inline(always)]
    pub(super) fn visibility(&self, through_glass: bool) -> Vec3 {
        if through_glass {
            self.transmittance
        } else if self.occluded {
            Vec3::ZERO
        } else {
            Vec3::ONE
        }
    }
}

/// Candidates that follow each other, of which one is selected.
#[derive(Clone, Copy)]
pub(super) struct Group {
    pub(super) begin: u32,
    pub(super) end: u32,
    /// Whether it is that of the one candidate from scattering, whose address is `scattered`: it comes after all from lights.
    pub(super) last: bool,
    pub(super) scattered: LightAddress,
    /// What is known of the visibility of its candidates.
    pub(super) visibility: Vec3,
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

/// How candidates are weighed and selected.
pub(super) trait Select<S: Surface> {
    /// What it has to know of the pixel.
    type Seen;

    /// The selection of a group, and the word for the choice among groups, which stays what it was, `among`, if there are no candidates. Groups of a
    /// pixel follow each other.
    fn select(
        &mut self,
        scene: &S,
        tiles: &[TileWords],
        seen: &Self::Seen,
        stream: &Stream,
        group: &Group,
        among: u32,
    ) -> (Reservoir<Candidate, f32>, u32);
}

/// Each candidate after the one before.
pub(super) struct OneByOne;

impl<S: Surface + AddressedLights> Select<S> for OneByOne {
    type Seen = Vertex<BsdfOf<S>>;

    #[inline(always)]
    fn select(
        &mut self,
        scene: &S,
        tiles: &[TileWords],
        vertex: &Vertex<BsdfOf<S>>,
        stream: &Stream,
        group: &Group,
        mut among: u32,
    ) -> (Reservoir<Candidate, f32>, u32) {
        let Group { begin, end, last, scattered, visibility } = *group;
        let mut selected = Reservoir::empty(Candidate::NONE);
        let mut i = begin;
        while i < end {
            let (address, light) = if !last & stream.is_tiled() {
                stream.of_tile(tiles, i)
            } else {
                // in one place, since it takes much code
                with_light(scene, if last { scattered } else { stream.choose(scene, i) })
            };
            let weighed = if address.is_light() { stream.weighed(vertex, i, &light) } else { stream.weightless(i) };
            let Weighed { target, shadow, .. } = weighed;
            let candidate = Candidate { address, target, index: i, shadow, transmittance: visibility, occluded: false };
            selected.update(candidate, weighed.weight, 1.0, rng::unit(weighed.within));
            among = weighed.among;
            i = i.wrapping_add(1);
        }
        (selected, among)
    }
}

/// What the candidates of a pixel have in common.
#[derive(Clone, Copy)]
pub(super) struct Stream {
    rng: Rng,
    flags: Flags,
    window: Window,
    /// How many candidates are drawn from lights in a round, and how many rounds there are.
    of_round: u32,
    rounds: u32,
    /// How many come from scattering: one or none.
    from_scattering: f32,
    /// The number of the frame's candidate 0 among the candidates of first rounds of all frames.
    first: u32,
    /// The number of the frame's first candidate after the first round, which are counted elsewhere: a frame whose pixels have one round draws no other
    /// numbers for it.
    first_of_others: u32,
    /// Surfaces may be blended.
    blends: bool,
}

impl Stream {
    #[inline(always)]
    pub(super) fn new(params: &DiParams, flags: Flags, at: [u32; 2], blends: bool, rounds: u32) -> Self {
        let of_round = params.candidates;
        let first = params.frame.wrapping_mul(of_round);
        let rng = params.rng(at);
        let tiled = flags.contains(Flags::TILES);
        Self {
            rng,
            flags,
            window: if tiled { Window::new(params, at, rng.hash(CANDIDATE_DIMENSION).x) } else { Window::NONE },
            of_round,
            rounds,
            from_scattering: if flags.contains(Flags::SCATTER_CANDIDATE) { 1.0 } else { 0.0 },
            first,
            first_of_others: OTHER_ROUNDS.wrapping_add(first.wrapping_mul(MAX_GLOSS_RENEWAL)),
            blends,
        }
    }

    /// How many candidates are drawn from lights, over all rounds: the index of the one from scattering.
    #[inline(always)]
    pub(super) fn drawn(&self) -> u32 {
        self.of_round.wrapping_mul(self.rounds)
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
        let sample = if index < self.of_round {
            self.first.wrapping_add(index)
        } else {
            self.first_of_others.wrapping_add(index.wrapping_sub(self.of_round))
        };
        scene.choose_address(self.rng.of_sample(sample).draw(CANDIDATE_DIMENSION))
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
        let density = self.drawn() as f32 * e.light_density + scatter_density;
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
