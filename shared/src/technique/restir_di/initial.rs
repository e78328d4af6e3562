//! Initial candidates.

use super::weigh::{OneByOne, Place, Seen, Stream, Weigh};
use super::{DiParams, Flags, PackedHit, PackedReservoir, SCATTER_DIMENSION, SELECTION_DIMENSION, Stored, TileWords};
use crate::bsdf::{BsdfSample, ScatteringFunction};
use crate::film::CUT;
use crate::geometry::Ray;
use crate::layout::{FEATURE_BLEND, FilmPixel};
use crate::num;
use crate::resample::packed::dithered;
use crate::resample::reservoir::Reservoir;
use crate::rng;
use crate::scene::{AddressedLights, LightAddress, Surface, SurfacePoint, Trace};
use crate::transport::{Passage, Vertex, follow};
use crate::vec::max_component;
use glam::Vec3;

/// An address in a stream of candidates.
#[derive(Clone, Copy)]
struct Candidate {
    address: LightAddress,
    target: f32,
    /// Index in the stream; the one after the lights' is scattering's.
    index: u32,
    shadow: Ray,
    /// As far as it is asked for: one until then.
    visibility: Vec3,
}

impl Candidate {
    const NONE: Self = Self {
        address: LightAddress::NONE,
        target: 0.0,
        index: 0,
        shadow: Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: Ray::FAR, key: 0 },
        visibility: Vec3::ZERO,
    };
}

/// What scattering finds.
struct Scattered {
    address: LightAddress,
    /// What is left of its light on the way.
    transmittance: Vec3,
    /// Light by way of a perfect lobe, weighted.
    radiance: Vec3,
}

impl Scattered {
    const NOTHING: Self = Self { address: LightAddress::NONE, transmittance: Vec3::ONE, radiance: Vec3::ZERO };
}

/// The reservoir of the pixel `at`, the immediate radiance, which needs no resampling (what is seen to emit, and what perfect lobes show),
/// as a film's sample, and the index of the candidate that the reservoir keeps, if it has a sample: those from lights come first, then
/// the one from scattering.
///
/// One RIS over all candidates: with the balance heuristic each has the weight `p / sum n_t p_t`, whatever technique t
/// gave it (Veach 1997, eq. 9.8, in Talbot's form). Densities are over (light, u, v). Candidates from lights come in
/// groups; each group's selection is tested by a ray, and selected among by its group's weights. The reservoir's
/// confidence is 1. Without [`Flags::TILES`] no tiles are read, so that there may be none.
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
) -> (PackedReservoir, FilmPixel, u32) {
    initial_by(scene, params, tiles, hit, at, &mut OneByOne)
}

/// [`initial`], whose candidates are weighed in some way.
#[inline(always)]
pub(super) fn initial_by<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    tiles: &[TileWords],
    hit: PackedHit,
    at: [u32; 2],
    weigh: &mut impl Weigh<S>,
) -> (PackedReservoir, FilmPixel, u32) {
    let pixel = params.view().pixel(at, hit);
    let apart = params.flags.contains(Flags::SEEN_APART);
    if !pixel.hit.is_hit() {
        let background = if apart { Vec3::ZERO } else { scene.environment(pixel.ray.direction).radiance };
        let radiance = if pixel.hit.is_cut() { CUT } else { background };
        return (Stored::EMPTY.pack(), FilmPixel::from_radiance(radiance), 0);
    }
    let point = pixel.point(scene);
    let (reservoir, radiance) = resample(scene, params, tiles, (&point, &pixel.ray), at, weigh);
    let kept = reservoir.sample;
    let dither = rng::unit(params.rng(at).hash(SELECTION_DIMENSION).z);
    let stored = Stored {
        sample: kept.address,
        contribution_weight: reservoir.contribution_weight(1.0, kept.target),
        confidence: 1.0,
        visibility: dithered(kept.visibility, dither),
    };
    let seen = if apart { Vec3::ZERO } else { point.emission };
    (stored.pack(), FilmPixel::from_radiance(seen + radiance), kept.index)
}

/// The selection among all candidates, and the radiance by way of a perfect lobe.
///
/// The ray of scattering and the shadow rays of what groups select are followed in one place, for a way through glass takes
/// much code: a round follows a ray, then streams the next group.
#[inline(always)]
fn resample<S: Trace + Surface + AddressedLights>(
    scene: &S,
    params: &DiParams,
    tiles: &[TileWords],
    (point, seen_by): (&SurfacePoint<S::Material>, &Ray),
    at: [u32; 2],
    weigh: &mut impl Weigh<S>,
) -> (Reservoir<Candidate, f32>, Vec3) {
    let vertex = &Vertex::new(point, seen_by, scene.features());
    let seen = Seen { point, ray: seen_by, vertex };
    let rng = params.rng(at);
    let flags = params.flags.in_use(scene);
    let through_glass = flags.contains(Flags::TRANSMITTANCE);
    let blends = scene.features() & FEATURE_BLEND != 0;
    let loses = flags.contains(Flags::INITIAL_VISIBILITY);
    let asks = loses | !flags.contains(Flags::FINAL_RAY);
    let scatter_words = rng.draw(SCATTER_DIMENSION);
    let sample = vertex.bsdf.sample(scatter_words);
    let direction = vertex.frame.to_world(sample.direction);
    let wanted = sample.delta | flags.contains(Flags::SCATTER_CANDIDATE);
    let scatters = wanted & (sample.pdf > 0.0) & vertex.is_consistent(direction, sample.direction);
    let count = if vertex.bsdf.has_smooth_part() { params.candidates.wrapping_add(1) } else { 0 };
    let stream = Stream::new(params, flags, at, blends);
    let mut scattered = Scattered::NOTHING;
    let mut group = Reservoir::empty(Candidate::NONE);
    let mut all = Reservoir::empty(Candidate::NONE);
    let mut arriving = Vec3::ZERO;
    let key = if sample.delta { Ray::random_key(scene.features(), scatter_words.x) } else { Ray::THROUGH };
    let mut ray = Ray { origin: vertex.origin(direction), direction, t_max: Ray::FAR, key };
    let mut follows = scatters;
    let mut among = 0;
    let mut i = 0_u32;
    let mut first = true;
    let mut open = true;
    while open {
        let passage = if follows { follow(scene, through_glass, &ray) } else { Passage::begin(&ray) };
        if first {
            if scatters {
                scattered = found(scene, &sample, &passage);
            }
        } else {
            let mut selected = group.sample;
            if follows {
                selected.visibility = passage.arriving();
            }
            let lost = loses & (max_component(selected.visibility) <= 0.0);
            let weight = if lost { 0.0 } else { group.weight_sum };
            all.update(selected, weight, 1.0, rng::unit(among));
            arriving += selected.visibility * weight;
        }
        first = false;
        open = i < count;
        group = Reservoir::empty(Candidate::NONE);
        // after the groups of candidates from lights the one from scattering
        let last = i >= params.candidates;
        let visibility = if last { scattered.transmittance } else { Vec3::ONE };
        let size = if params.group == 0 { params.candidates } else { params.group };
        let end = if last { count } else { i.wrapping_add(size).min(params.candidates).min(count) };
        while i < end {
            let place = Place { index: i, last, scattered: scattered.address };
            let (address, weighed) = weigh.weigh(scene, tiles, &seen, &stream, place);
            let candidate = Candidate { address, target: weighed.target, index: i, shadow: weighed.shadow, visibility };
            group.update(candidate, weighed.weight, 1.0, rng::unit(weighed.within));
            among = weighed.among;
            i = i.wrapping_add(1);
        }
        let traced = asks & (!last | blends) & (group.sample.target > 0.0);
        follows = traced & through_glass;
        ray = group.sample.shadow;
        if traced && !follows && scene.occluded(&ray) {
            group.sample.visibility = Vec3::ZERO;
        }
    }
    if flags.contains(Flags::AVERAGE_VISIBILITY) & (all.weight_sum > 0.0) {
        let mean = |sum: f32| num::clamp(num::div(sum, all.weight_sum), 0.0, 1.0);
        all.sample.visibility = Vec3::new(mean(arriving.x), mean(arriving.y), mean(arriving.z));
    }
    (all, scattered.radiance)
}

/// What the way of a scattered ray ends at.
#[inline(always)]
fn found<S: Surface + AddressedLights>(scene: &S, sample: &BsdfSample, passage: &Passage) -> Scattered {
    let Passage { hit, ray, transmittance } = passage;
    let mut scattered = Scattered { transmittance: *transmittance, ..Scattered::NOTHING };
    if hit.is_cut() {
        scattered.radiance = CUT;
    } else if sample.delta {
        let seen =
            if hit.is_hit() { scene.surface(ray, hit).emission } else { scene.environment(ray.direction).radiance };
        scattered.radiance = sample.weight * *transmittance * seen;
    } else if hit.is_hit() {
        scattered.address = scene.address_of_hit(hit);
    } else {
        scattered.address = scene.address_of_environment(ray.direction);
    }
    scattered
}
