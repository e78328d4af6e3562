//! Initial candidates for processors with wide registers: [`LANES`] candidates of a pixel are weighed in step, with the same bits as one by one.

use super::initial::{Place, Stream, Weigh, Weighed, initial_by};
use super::{DiParams, PackedHit, PackedReservoir, TileWords};
use crate::geometry::Ray;
use crate::lanes::{LANES, Lanes, Registers, Stage, fields};
use crate::layout::FilmPixel;
use crate::scene::{AddressedLight, BsdfOf, LightAddress, LightSample, SceneView, Surface, SurfacePoint};
use crate::transport::Vertex;

fields! {
    LightsAtAddresses = AddressedLight { sample: LightSample, extent: f32 }
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
        let mut in_step = InStep { registers, addresses: [LightAddress::NONE; LANES], weighed: Lanes::ZERO };
        (*reservoir, *direct, _) = initial_by(scene, params, tiles, *hit, [x, y], &mut in_step);
    }
}

/// The candidates from lights that stand in a row of [`LANES`].
struct InStep<R> {
    registers: R,
    addresses: [LightAddress; LANES],
    weighed: Lanes<Weighed>,
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
            let mut lights = Lanes::ZERO;
            for lane in 0..LANES.min((params.candidates - place.index) as usize) {
                let next = Place { index: place.index + lane as u32, ..place };
                let (address, light) = stream.light(scene, params, tiles, next);
                self.addresses[lane] = address;
                lights.set(lane, light);
            }
            let weighing = Weighing { scene, params, stream, point, ray, first: place.index };
            self.registers.run(&weighing, &lights, &mut self.weighed);
        }
        (self.addresses[lane], self.weighed.get(lane))
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
