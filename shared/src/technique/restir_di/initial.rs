//! Initial candidates.

use super::pixel::Pixel;
use super::select::{Candidate, Group, OneByOne, Select, Stream};
use super::{DiParams, Flags, PackedHit, PackedReservoir, SCATTER_DIMENSION, SELECTION_DIMENSION, Stored, TileWords};
use crate::bsdf::{BsdfSample, ScatteringFunction};
use crate::film::CUT;
use crate::geometry::Ray;
use crate::layout::{FEATURE_BLEND, FilmPixel};
use crate::num;
use crate::resample::packed::dithered;
use crate::resample::reservoir::Reservoir;
use crate::rng;
use crate::scene::{AddressedLights, LightAddress, Surface, Trace};
use crate::transport::{Departure, Passage, Vertex, follow};
use crate::vec::max_component;
use glam::Vec3;

/// The index of the candidate from scattering.
pub const FROM_SCATTERING: u32 = u32::MAX;

/// How light scatters where a pixel sees something, by one sample.
#[derive(Clone, Copy)]
pub(super) struct Scattering {
    pub(super) sample: BsdfSample,
    /// Whether there is a ray, and which.
    pub(super) goes_on: bool,
    pub(super) ray: Ray,
    /// Whether there is more than perfect lobes.
    pub(super) smooth: bool,
    /// Rounds of candidates from lights that the surface has.
    pub(super) rounds: u32,
}

impl Scattering {
    /// The sample of the pixel `at`, whose ray has met the vertex.
    #[inline(always)]
    pub(super) fn new<B: ScatteringFunction>(
        pixel: &Pixel,
        vertex: &Vertex<B>,
        params: &DiParams,
        features: u32,
        at: [u32; 2],
    ) -> Self {
        let words = params.rng(at).draw(SCATTER_DIMENSION);
        let Departure { sample, ray, alive, .. } = vertex.depart(words, features);
        let wanted = sample.delta | params.flags.contains(Flags::SCATTER_CANDIDATE);
        let key = if sample.delta { ray.key } else { Ray::THROUGH };
        Self {
            sample,
            goes_on: wanted & alive,
            ray: Ray { key, ..ray },
            smooth: vertex.bsdf.has_smooth_part(),
            rounds: pixel.rounds(params, vertex.bsdf.gloss()),
        }
    }
}

/// What scattering finds.
#[derive(Clone, Copy)]
pub(super) struct Scattered {
    pub(super) address: LightAddress,
    /// What is left of its light on the way.
    transmittance: Vec3,
    /// Light by way of a perfect lobe, weighted.
    radiance: Vec3,
}

impl Scattered {
    pub(super) const NOTHING: Self =
        Self { address: LightAddress::NONE, transmittance: Vec3::ONE, radiance: Vec3::ZERO };

    /// What the way of the scattered ray ends at.
    #[inline(always)]
    pub(super) fn found<S: Surface + AddressedLights>(scene: &S, delta: bool, weight: Vec3, passage: &Passage) -> Self {
        let Passage { hit, ray, transmittance } = passage;
        let mut scattered = Self { transmittance: *transmittance, ..Self::NOTHING };
        if hit.is_cut() {
            scattered.radiance = CUT;
        } else if delta {
            let seen =
                if hit.is_hit() { scene.surface(ray, hit).emission } else { scene.environment(ray.direction).radiance };
            scattered.radiance = weight * *transmittance * seen;
        } else if hit.is_hit() {
            scattered.address = scene.address_of_hit(hit);
        } else {
            scattered.address = scene.address_of_environment(ray.direction);
        }
        scattered
    }
}

/// What a pixel begins with.
#[derive(Clone, Copy, Debug)]
pub struct Initial {
    /// One of its candidates.
    pub reservoir: PackedReservoir,
    /// The radiance that needs no resampling (what is seen to emit, and what perfect lobes show), as a film's sample.
    pub direct: FilmPixel,
    /// The index of the candidate that the reservoir keeps, if it has a sample: of those from lights, or [`FROM_SCATTERING`].
    pub candidate: u32,
}

/// The candidates of the pixel `at`, which sees `hit`, and what needs none.
///
/// One RIS over all candidates: with the balance heuristic each has the weight `p / sum n_t p_t`, whatever technique t
/// gave it (Veach 1997, eq. 9.8, in Talbot's form). Densities are over (light, u, v). Candidates from lights come in
/// groups; each group's selection is tested by a ray, and selected among by its group's weights. Where much of history fades there are several
/// rounds of them ([`DiParams::gloss_renewal`]), and the reservoir's confidence is their number. Without [`Flags::TILES`] no tiles are read, so that there may be none.
///
/// The ray of scattering looks through what is blended: whether that lets light pass is asked of its candidate as of every
/// other, by the ray that will be asked again, for an answer of its own would count twice. On blended surfaces scattering
/// then finds no light, and has no density there.
pub fn initial<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    tiles: &[TileWords],
    hit: PackedHit,
    at: [u32; 2],
) -> Initial {
    let pixel = params.view().pixel(at, hit);
    if !pixel.hit.is_hit() {
        return nothing(scene, params, &pixel);
    }
    let point = pixel.point(scene);
    let vertex = Vertex::new(&point, &pixel.ray, scene.features());
    let scattering = Scattering::new(&pixel, &vertex, params, scene.features(), at);
    let sight = Sight { emission: point.emission, scattering, known: None };
    resample(scene, params, tiles, &sight, at, &vertex, &mut OneByOne)
}

/// Of a pixel that sees nothing.
#[inline(always)]
pub(super) fn nothing<S: Surface + AddressedLights>(scene: &S, params: &DiParams, pixel: &Pixel) -> Initial {
    let apart = params.flags.contains(Flags::PRIMARY_EMISSION_EXTERNAL);
    let background = if apart { Vec3::ZERO } else { scene.environment(pixel.ray.direction).radiance };
    let radiance = if pixel.hit.is_cut() { CUT } else { background };
    Initial { reservoir: Stored::EMPTY.pack(), direct: FilmPixel::from_radiance(radiance), candidate: 0 }
}

/// What is known of a pixel that sees something, before candidates are drawn.
pub(super) struct Sight {
    pub(super) emission: Vec3,
    pub(super) scattering: Scattering,
    /// What scattering finds, if that is known.
    pub(super) known: Option<Scattered>,
}

/// What [`initial`] gives for the pixel `at`, of which `seen` says to `candidates` what they have to know.
#[inline(always)]
pub(super) fn resample<S: Trace + Surface + AddressedLights, C: Select<S>>(
    scene: &S,
    params: &DiParams,
    tiles: &[TileWords],
    sight: &Sight,
    at: [u32; 2],
    seen: &C::Seen,
    candidates: &mut C,
) -> Initial {
    let Selected { reservoir, visibility, radiance } = select(scene, params, tiles, sight, at, seen, candidates);
    let kept = reservoir.sample;
    let dither = rng::unit(params.rng(at).hash(SELECTION_DIMENSION).z);
    let stored = Stored {
        sample: kept.address,
        contribution_weight: reservoir.contribution_weight(1.0, kept.target),
        confidence: sight.scattering.rounds as f32,
        visibility: dithered(visibility, dither),
    };
    let emission = if params.flags.contains(Flags::PRIMARY_EMISSION_EXTERNAL) { Vec3::ZERO } else { sight.emission };
    Initial { reservoir: stored.pack(), direct: FilmPixel::from_radiance(emission + radiance), candidate: kept.index }
}

/// What is selected among all candidates.
struct Selected {
    reservoir: Reservoir<Candidate, f32>,
    /// That of the candidate, or the mean.
    visibility: Vec3,
    /// Light by way of a perfect lobe, weighted.
    radiance: Vec3,
}

/// The selection among all candidates, and the radiance by way of a perfect lobe.
///
/// The ray of scattering and the shadow rays of what groups select are followed in one place, for a way through glass takes
/// much code: a round follows a ray, then streams the next group.
#[inline(always)]
fn select<S: Trace + Surface + AddressedLights, C: Select<S>>(
    scene: &S,
    params: &DiParams,
    tiles: &[TileWords],
    Sight { scattering, known, .. }: &Sight,
    at: [u32; 2],
    seen: &C::Seen,
    candidates: &mut C,
) -> Selected {
    let flags = params.flags.in_use(scene);
    let through_glass = flags.contains(Flags::TRANSMITTANCE);
    let blends = scene.features() & FEATURE_BLEND != 0;
    let loses = flags.contains(Flags::INITIAL_VISIBILITY);
    let asks = loses | !flags.contains(Flags::FINAL_RAY);
    let stream = Stream::new(params, flags, at, blends, scattering.rounds);
    let scatters = scattering.goes_on & known.is_none();
    let mut scattered = known.unwrap_or(Scattered::NOTHING);
    if scatters {
        // it is the sample's weight until the ray has been followed: one of its own would take registers in all rounds
        scattered.radiance = scattering.sample.weight;
    }
    let mut group = Reservoir::empty(Candidate::NONE);
    let mut all = Reservoir::empty(Candidate::NONE);
    let mut arriving = Vec3::ZERO;
    let mut ray = scattering.ray;
    let mut follows = scatters;
    let mut among = 0;
    let mut i = 0_u32;
    let mut first = true;
    let mut open = true;
    while open {
        let passage = if follows { follow(scene, through_glass, &ray) } else { Passage::begin(&ray) };
        if first {
            if scatters {
                scattered = Scattered::found(scene, scattering.sample.delta, scattered.radiance, &passage);
            }
        } else {
            let mut selected = group.sample;
            if follows {
                selected.transmittance = passage.arriving();
            }
            let visibility = selected.visibility(through_glass);
            let lost = loses & (max_component(visibility) <= 0.0);
            let weight = if lost { 0.0 } else { group.weight_sum };
            all.update(selected, weight, 1.0, rng::unit(among));
            arriving += visibility * weight;
        }
        first = false;
        // after the groups of candidates from lights the one from scattering
        let drawn = stream.drawn();
        let last = i >= drawn;
        open = scattering.smooth & (i <= drawn);
        let visibility = if last { scattered.transmittance } else { Vec3::ONE };
        let size = if params.group == 0 { params.candidates } else { params.group };
        let end = if !open {
            i
        } else if last {
            i.wrapping_add(1)
        } else {
            i.wrapping_add(size).min(drawn)
        };
        let next = Group { begin: i, end, last, scattered: scattered.address, visibility };
        (group, among) = candidates.select(scene, tiles, seen, &stream, &next, among);
        i = end;
        let traced = asks & (!last | blends) & (group.sample.target > 0.0);
        follows = traced & through_glass;
        ray = group.sample.shadow;
        if traced && !follows && scene.occluded(&ray) {
            group.sample.occluded = true;
        }
    }
    let mut visibility = all.sample.visibility(through_glass);
    if flags.contains(Flags::AVERAGE_VISIBILITY) & (all.weight_sum > 0.0) {
        let mean = |sum: f32| num::clamp(num::div(sum, all.weight_sum), 0.0, 1.0);
        // without glass it is the same in all channels, and a compiler that is told keeps one of them
        let arriving = if through_glass { arriving } else { Vec3::splat(arriving.x) };
        visibility = Vec3::new(mean(arriving.x), mean(arriving.y), mean(arriving.z));
    }
    if all.sample.index == stream.drawn() {
        all.sample.index = FROM_SCATTERING;
    }
    Selected { reservoir: all, visibility, radiance: scattered.radiance }
}
