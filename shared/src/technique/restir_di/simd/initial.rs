//! Initial candidates by SIMD: what some pixels see and scattering finds there, then [`LANES`] candidates from lights of each pixel. The
//! choice among candidates goes one by one, as it depends on those before.

use super::super::initial::{Scattered, Scattering, Sight, nothing, resample};
use super::super::pixel::Pixel;
use super::super::select::{Candidate, Group, Select, Stream, Weighed, with_light};
use super::super::{DiParams, Flags, PackedHit, PackedReservoir, TileWords};
use super::Looking;
use super::read::{Look, LookUp, Sees};
use crate::bsdf::BsdfSample;
use crate::geometry::Ray;
use crate::lanes::{LANES, LaneKernel, Lanes, SimdToken, soa};
use crate::layout::{FEATURE_BLEND, FilmPixel};
use crate::resample::reservoir::Reservoir;
use crate::rng;
use crate::scene::{AddressedLight, LightAddress, SceneView, Surface, SurfacePoint};
use crate::transport::{Passage, Vertex, follow};
use glam::Vec3;

soa! {
    WeighedCandidates = Weighed { target: f32, weight: f32, shadow: Ray, within: u32, among: u32 }
    BsdfSamples = BsdfSample { direction: Vec3, weight: Vec3, pdf: f32, lobe: u32, lobe_pdf: f32, delta: bool }
    Scatterings = Scattering { sample: BsdfSample, goes_on: bool, ray: Ray, smooth: bool, rounds: u32 }
}

/// What [`initial`](super::super::initial()) finds for the pixels of a row from (x, y) on, in whose order the `hits`, `reservoirs` and `direct` radiances are.
#[inline(always)]
pub fn initial_row<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    tiles: &[TileWords],
    (hits, [x, y]): (&[PackedHit], [u32; 2]),
    (reservoirs, direct): (&mut [PackedReservoir], &mut [FilmPixel]),
    token: impl SimdToken,
) {
    let mut row = Row {
        params,
        look: Look { scene, view: params.view() },
        seen: Seen { looking: Lanes::ZERO, sees: Sees::ZERO },
        scattering: Lanes::ZERO,
        simd: Simd { token, scattered: Lanes::ZERO, chosen: Chosen::NONE, weighed: Lanes::ZERO },
    };
    let parts = hits.chunks(LANES).zip(reservoirs.chunks_mut(LANES).zip(direct.chunks_mut(LANES)));
    for (x, (hits, (reservoirs, direct))) in (x..).step_by(LANES).zip(parts) {
        row.initial(tiles, (hits, [x, y]), (reservoirs, direct));
    }
}

/// The pixels of a row.
struct Row<'a, R, const COMPILED: u32> {
    params: &'a DiParams,
    look: Look<'a, COMPILED>,
    seen: Seen,
    scattering: Lanes<Scattering>,
    simd: Simd<R>,
}

impl<R: SimdToken, const COMPILED: u32> Row<'_, R, COMPILED> {
    #[inline(always)]
    fn initial(
        &mut self,
        tiles: &[TileWords],
        (hits, [x, y]): (&[PackedHit], [u32; 2]),
        (reservoirs, direct): (&mut [PackedReservoir], &mut [FilmPixel]),
    ) {
        let (Look { scene, view }, params) = (self.look, self.params);
        let (token, seen, scattering) = (self.simd.token, &mut self.seen, &mut self.scattering);
        let mut sees = Lanes::ZERO;
        for (lane, hit) in hits.iter().map(|hit| hit.unpack()).enumerate().filter(|(_, hit)| hit.is_hit()) {
            seen.looking.set(lane, Looking { x: x.wrapping_add(lane as u32), y, hit });
            sees.set(lane, true);
        }
        let mut scattered = [Scattered::NOTHING; LANES];
        if sees.bits() != 0 {
            token.run(&self.look, &seen.looking, &mut seen.sees);
            token.run(&Scatter { scene, params }, seen, scattering);
            scattered = find(scene, params, &sees, scattering);
            let addresses = Lanes::from_fn(|lane| scattered[lane].address);
            let mut lights = Lanes::ZERO;
            token.run(&LookUp(scene), &addresses, &mut lights);
            token.run(&WeighScattered { scene, params, seen, scattering }, &lights, &mut self.simd.scattered);
        }
        let parts = hits.iter().zip(reservoirs.iter_mut().zip(direct)).enumerate();
        for (lane, (&hit, (reservoir, direct))) in parts {
            let at = [x.wrapping_add(lane as u32), y];
            let initial = if sees.get(lane) {
                let point = seen.sees.point.get(lane);
                let (emission, scattering) = (point.emission, scattering.get(lane));
                let sight = Sight { emission, scattering, known: Some(scattered[lane]) };
                let of_pixel = (point, seen.sees.ray.get(lane), lane);
                resample(scene, params, tiles, &sight, at, &of_pixel, &mut self.simd)
            } else {
                nothing(scene, params, &view.pixel(at, hit))
            };
            (*reservoir, *direct) = (initial.reservoir, initial.direct);
        }
    }
}

/// What scattering finds in each lane.
#[inline(always)]
fn find<const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &DiParams,
    sees: &Lanes<bool>,
    scattering: &Lanes<Scattering>,
) -> [Scattered; LANES] {
    let through_glass = params.flags.in_use(scene).contains(Flags::TRANSMITTANCE);
    let goes_on = Lanes::from_fn(|lane| sees.get(lane) & scattering.get(lane).goes_on);
    let rays = Lanes::from_fn(|lane| scattering.get(lane).ray);
    let hits = scene.closest_each(&rays, if through_glass { &Lanes::ZERO } else { &goes_on });
    core::array::from_fn(|lane| {
        if !goes_on.get(lane) {
            return Scattered::NOTHING;
        }
        let Scattering { ray, sample, .. } = scattering.get(lane);
        let passage = if through_glass {
            follow(scene, through_glass, &ray)
        } else {
            Passage { hit: hits.get(lane), ..Passage::begin(&ray) }
        };
        Scattered::found(scene, sample.delta, sample.weight, &passage)
    })
}

/// Pixels, and what they see.
struct Seen {
    looking: Lanes<Looking>,
    sees: Sees,
}

/// Scatters at the points that pixels see.
struct Scatter<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a DiParams,
}

impl<const COMPILED: u32> LaneKernel for Scatter<'_, COMPILED> {
    type In = Seen;
    type Out = Lanes<Scattering>;

    #[inline(always)]
    fn run(&self, seen: &Seen, scattering: &mut Lanes<Scattering>) {
        let (scene, params) = (*self.scene, *self.params);
        for lane in 0..LANES {
            let Looking { x, y, hit } = seen.looking.get(lane);
            let pixel = Pixel { ray: seen.sees.ray.get(lane), hit };
            let vertex = Vertex::new(&seen.sees.point.get(lane), &pixel.ray, scene.features());
            scattering.set(lane, Scattering::new(&pixel, &vertex, &params, scene.features(), [x, y]));
        }
    }
}

/// Weighs what scattering has found, in each lane for another pixel.
struct WeighScattered<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a DiParams,
    seen: &'a Seen,
    scattering: &'a Lanes<Scattering>,
}

impl<const COMPILED: u32> LaneKernel for WeighScattered<'_, COMPILED> {
    type In = Lanes<AddressedLight>;
    type Out = Lanes<Weighed>;

    #[inline(always)]
    fn run(&self, lights: &Lanes<AddressedLight>, weighed: &mut Lanes<Weighed>) {
        let (scene, params) = (*self.scene, *self.params);
        let flags = params.flags.in_use(&scene);
        let blends = scene.features() & FEATURE_BLEND != 0;
        for lane in 0..LANES {
            let Looking { x, y, .. } = self.seen.looking.get(lane);
            let vertex = Vertex::new(&self.seen.sees.point.get(lane), &self.seen.sees.ray.get(lane), scene.features());
            let stream = Stream::new(&params, flags, [x, y], blends, self.scattering.get(lane).rounds);
            weighed.set(lane, stream.weighed(&vertex, stream.drawn(), &lights.get(lane)));
        }
    }
}

/// The candidates of pixels.
struct Simd<R> {
    token: R,
    /// What scattering has found, of a pixel in each lane.
    scattered: Lanes<Weighed>,
    /// What lights give one pixel from the last multiple of [`LANES`] on, a candidate in each lane.
    chosen: Chosen,
    /// The weights of those.
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

impl<R: SimdToken, const COMPILED: u32> Select<SceneView<'_, COMPILED>> for Simd<R> {
    /// The point, the ray that has met it, and the pixel's lane.
    type Seen = (SurfacePoint, Ray, usize);

    #[inline(always)]
    fn select(
        &mut self,
        scene: &SceneView<'_, COMPILED>,
        tiles: &[TileWords],
        (point, ray, of_pixel): &Self::Seen,
        stream: &Stream,
        group: &Group,
        mut among: u32,
    ) -> (Reservoir<Candidate, f32>, u32) {
        let Group { begin, end, last, scattered, visibility } = *group;
        let mut kept = Candidate::NONE;
        let mut selected = Reservoir::empty(());
        if last {
            let weighed = self.scattered.get(*of_pixel);
            if begin < end {
                let weight = if scattered.is_light() { weighed.weight } else { 0.0 };
                if selected.update((), weight, 1.0, rng::unit(weighed.within)) {
                    kept = candidate(scattered, &weighed, begin, visibility);
                }
                among = weighed.among;
            }
        } else {
            let mut i = begin;
            while i < end {
                let first = i - i % LANES as u32;
                if i == first {
                    self.weigh(scene, tiles, point, ray, stream, first);
                }
                let until = end.min(first + LANES as u32);
                let mut index = None;
                while i < until {
                    let lane = (i - first) as usize % LANES;
                    let weighed = self.weighed.get(lane);
                    let keeps = selected.update((), weighed.weight, 1.0, rng::unit(weighed.within));
                    index = if keeps { Some(lane) } else { index };
                    among = weighed.among;
                    i += 1;
                }
                if let Some(lane) = index {
                    let address = self.chosen.addresses.get(lane);
                    kept = candidate(address, &self.weighed.get(lane), first + lane as u32, visibility);
                }
            }
        }
        let Reservoir { weight_sum, confidence, .. } = selected;
        (Reservoir { sample: kept, weight_sum, confidence }, among)
    }
}

#[inline(always)]
fn candidate(address: LightAddress, weighed: &Weighed, index: u32, visibility: Vec3) -> Candidate {
    let Weighed { target, shadow, .. } = *weighed;
    Candidate { address, target, index, shadow, transmittance: visibility, occluded: false }
}

impl<R: SimdToken> Simd<R> {
    /// Chooses and weighs candidates from `first` on.
    #[inline(always)]
    fn weigh<const COMPILED: u32>(
        &mut self,
        scene: &SceneView<'_, COMPILED>,
        tiles: &[TileWords],
        point: &SurfacePoint,
        ray: &Ray,
        stream: &Stream,
        first: u32,
    ) {
        if stream.is_tiled() {
            for lane in 0..LANES {
                self.chosen.set(lane, stream.of_tile(tiles, first.wrapping_add(lane as u32)));
            }
        } else {
            self.token.run(&Choose { scene, stream, first }, &(), &mut self.chosen);
        }
        self.token.run(&WeighEach { scene, stream, point, ray, first }, &self.chosen.lights, &mut self.weighed);
    }
}

/// Chooses candidates from `first` on.
struct Choose<'a, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    stream: &'a Stream,
    first: u32,
}

impl<const COMPILED: u32> LaneKernel for Choose<'_, COMPILED> {
    type In = ();
    type Out = Chosen;

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

impl<const COMPILED: u32> LaneKernel for WeighEach<'_, COMPILED> {
    type In = Lanes<AddressedLight>;
    type Out = Lanes<Weighed>;

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
