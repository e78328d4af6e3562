//! Initial candidates for processors with wide registers: [`LANES`] candidates of a pixel are weighed in step, with the same bits as one by one.

use super::initial::{Place, Stream, Weigh, Weighed, candidate, initial_by};
use super::{DiParams, Flags, PackedHit, PackedReservoir, TileWords};
use crate::geometry::Ray;
use crate::lanes::{LANES, Lanes, Registers, Stage, fields};
use crate::layout::FilmPixel;
use crate::scene::{AddressedLight, AddressedLights, BsdfOf, LightAddress, LightSample, SceneView, Surface, SurfacePoint};
use crate::transport::Vertex;

fields! {
    LightsAtAddresses = AddressedLight { sample: LightSample, extent: f32 }
    LightAddresses = LightAddress { light: u32, u: u32, v: u32 }
    WeighedCandidates = Weighed { target: f32, weight: f32, shadow: Ray, within: u32, among: u32 }
}

/// [`initial`](super::initial()) of the pixels of a row from (x, y) on.
#[inline(always)]
pub fn initial_row<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    tiles: &[TileWords],
    (hits, [x, y]): (&[PackedHit], [u32; 2]),
    (reservoirs, direct): (&mut [PackedReservoir], &mut [FilmPixel]),
    registers: impl Registers,
) {
    let row = hits.iter().zip(reservoirs).zip(direct);
    for (x, ((hit, reservoir), direct)) in (x..).zip(row) {
        let chosen = Chosen { addresses: Lanes::ZERO, lights: Lanes::ZERO };
        let mut in_step = InStep { registers, chosen, weighed: Lanes::ZERO };
        (*reservoir, *direct, _) = initial_by(scene, params, tiles, *hit, [x, y], &mut in_step);
    }
}

/// The candidates from lights that stand in a row of [`LANES`].
struct InStep<R> {
    registers: R,
    chosen: Chosen,
    weighed: Lanes<Weighed>,
}

/// Candidates from lights.
struct Chosen {
    addresses: Lanes<LightAddress>,
    lights: Lanes<AddressedLight>,
}

impl<R: Registers, const COMPILED: u32> Weigh<SceneView<'_, COMPILED>> for InStep<R> {
    #[inline(always)]
    fn weigh(
        &mut self,
        scene: &SceneView<'_, COMPILED>,
        params: &DiParams,
        tiles: &[TileWords],
        (point, ray, vertex): (&SurfacePoint, &Ray, &Vertex<BsdfOf<SceneView<'_, COMPILED>>>),
        stream: &Stream,
        place: Place,
    ) -> (LightAddress, Weighed) {
        let lane = place.index as usize % LANES;
        if place.last {
            let (address, light) = stream.light(scene, params, tiles, place);
            return (address, stream.weighed(params, vertex, place.index, &light));
        }
        if lane == 0 {
            let weighing = Weighing { scene, params, stream, point, ray, first: place.index };
            if stream.flags.contains(Flags::TILES) {
                for lane in 0..LANES.min((params.candidates - place.index) as usize) {
                    let next = Place { index: place.index + lane as u32, ..place };
                    let (address, light) = stream.light(scene, params, tiles, next);
                    self.chosen.addresses.set(lane, address);
                    self.chosen.lights.set(lane, light);
                }
            } else {
                self.registers.run(&Choosing { scene, params, stream, first: place.index }, &(), &mut self.chosen);
            }
            self.registers.run(&weighing, &self.chosen.lights, &mut self.weighed);
        }
        (self.chosen.addresses.get(lane), self.weighed.get(lane))
    }
}

/// Candidates that follow each other, from `first` on.
struct Choosing<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a DiParams,
    stream: &'a Stream,
    first: u32,
}

impl<const COMPILED: u32> Stage for Choosing<'_, COMPILED> {
    type From = ();
    type To = Chosen;

    #[inline(always)]
    fn run(&self, (): &(), chosen: &mut Chosen) {
        let (scene, stream, params) = (*self.scene, *self.stream, *self.params);
        for lane in 0..LANES {
            let address = scene.choose_address(candidate(&params, stream.rng, self.first + lane as u32));
            chosen.addresses.set(lane, address);
            chosen.lights.set(lane, if address.is_light() { scene.light_at(address) } else { AddressedLight::NONE });
        }
    }
}

/// Candidates that follow each other, from `first` on.
struct Weighing<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a DiParams,
    stream: &'a Stream,
    point: &'a SurfacePoint,
    ray: &'a Ray,
    first: u32,
}

impl<const COMPILED: u32> Stage for Weighing<'_, COMPILED> {
    type From = Lanes<AddressedLight>;
    type To = Lanes<Weighed>;

    #[inline(always)]
    fn run(&self, lights: &Lanes<AddressedLight>, weighed: &mut Lanes<Weighed>) {
        let (stream, params) = (*self.stream, *self.params);
        // here and not outside, so that the compiler knows the features
        let vertex = Vertex::new(self.point, self.ray, self.scene.features());
        for lane in 0..LANES {
            weighed.set(lane, stream.weighed(&params, &vertex, self.first + lane as u32, &lights.get(lane)));
        }
    }
}
