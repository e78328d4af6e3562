//! Initial candidates for processors with wide registers: [`LANES`] candidates of a pixel from lights are chosen and weighed in step, with the
//! same bits as one by one. The choice among them goes one by one, as it depends on the candidates before.

use super::super::initial::initial_by;
use super::super::weigh::{OneByOne, Place, Seen, Stream, Weigh, Weighed, with_light};
use super::super::{DiParams, PackedHit, PackedReservoir, TileWords};
use crate::geometry::Ray;
use crate::lanes::{LANES, Lanes, Registers, Stage, fields};
use crate::layout::FilmPixel;
use crate::scene::{AddressedLight, BsdfOf, LightAddress, LightSample, SceneView, Surface, SurfacePoint};
use crate::transport::Vertex;

fields! {
    LightsAtAddresses = AddressedLight { sample: LightSample, extent: f32 }
    LightAddresses = LightAddress { light: u32, u: u32, v: u32 }
    WeighedCandidates = Weighed { target: f32, weight: f32, shadow: Ray, within: u32, among: u32 }
}

/// What [`initial`](super::super::initial()) finds for the pixels of a row from (x, y) on, in whose order the `hits`, `reservoirs` and `direct` radiances are.
#[inline(always)]
pub fn initial_row<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    tiles: &[TileWords],
    (hits, [x, y]): (&[PackedHit], [u32; 2]),
    (reservoirs, direct): (&mut [PackedReservoir], &mut [FilmPixel]),
    registers: impl Registers,
) {
    let mut in_step = InStep { registers, chosen: Chosen::NONE, weighed: Lanes::ZERO };
    for (x, ((hit, reservoir), direct)) in (x..).zip(hits.iter().zip(reservoirs).zip(direct)) {
        (*reservoir, *direct, _) = initial_by(scene, params, tiles, *hit, [x, y], &mut in_step);
    }
}

/// The candidates from the last multiple of [`LANES`] on.
struct InStep<R> {
    registers: R,
    chosen: Chosen,
    weighed: Lanes<Weighed>,
}

/// Addresses, and what lies there.
struct Chosen {
    addresses: Lanes<LightAddress>,
    lights: Lanes<AddressedLight>,
}

impl Chosen {
    const NONE: Self = Self { addresses: Lanes::ZERO, lights: Lanes::ZERO };

    #[inline(always)]
    fn set(&mut self, lane: usize, (address, light): (LightAddress, AddressedLight)) {
        self.addresses.set(lane, address);
        self.lights.set(lane, light);
    }
}

impl<R: Registers, const COMPILED: u32> Weigh<SceneView<'_, COMPILED>> for InStep<R> {
    #[inline(always)]
    fn weigh(
        &mut self,
        scene: &SceneView<'_, COMPILED>,
        tiles: &[TileWords],
        seen: &Seen<'_, <SceneView<'_, COMPILED> as Surface>::Material, BsdfOf<SceneView<'_, COMPILED>>>,
        stream: &Stream,
        place: Place,
    ) -> (LightAddress, Weighed) {
        if place.last {
            return OneByOne.weigh(scene, tiles, seen, stream, place);
        }
        let (lane, first) = (place.index as usize % LANES, place.index);
        if lane == 0 {
            if stream.is_tiled() {
                for lane in 0..LANES {
                    self.chosen.set(lane, stream.of_tile(tiles, first.wrapping_add(lane as u32)));
                }
            } else {
                self.registers.run(&Choose { scene, stream, first }, &(), &mut self.chosen);
            }
            let weigh = WeighEach { scene, stream, point: seen.point, ray: seen.ray, first };
            self.registers.run(&weigh, &self.chosen.lights, &mut self.weighed);
        }
        (self.chosen.addresses.get(lane), self.weighed.get(lane))
    }
}

/// Chooses candidates from `first` on.
struct Choose<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    stream: &'a Stream,
    first: u32,
}

impl<const COMPILED: u32> Stage for Choose<'_, COMPILED> {
    type From = ();
    type To = Chosen;

    #[inline(always)]
    fn run(&self, (): &(), chosen: &mut Chosen) {
        // copies, of which the compiler sees that nobody writes to them
        let (scene, stream) = (*self.scene, *self.stream);
        for lane in 0..LANES {
            let address = stream.choose(&scene, self.first.wrapping_add(lane as u32));
            chosen.set(lane, with_light(&scene, address));
        }
    }
}

/// Weighs candidates from `first` on, at the point that the ray has met.
struct WeighEach<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    stream: &'a Stream,
    point: &'a SurfacePoint,
    ray: &'a Ray,
    first: u32,
}

impl<const COMPILED: u32> Stage for WeighEach<'_, COMPILED> {
    type From = Lanes<AddressedLight>;
    type To = Lanes<Weighed>;

    #[inline(always)]
    fn run(&self, lights: &Lanes<AddressedLight>, weighed: &mut Lanes<Weighed>) {
        let stream = *self.stream;
        // made here, where the compiler knows the features
        let vertex = Vertex::new(self.point, self.ray, self.scene.features());
        for lane in 0..LANES {
            weighed.set(lane, stream.weighed(&vertex, self.first.wrapping_add(lane as u32), &lights.get(lane)));
        }
    }
}
