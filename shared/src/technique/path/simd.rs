//! Path tracing by SIMD, for processors with wide registers: the samples of a row of pixels, [`LANES`] at a time, with the same bits as one by one.
//!
//! The scene is asked for sixteen rays at a time, and what lies between them are [`LaneKernel`]s. A path that ends makes room for the next sample at once,
//! so that lanes are idle only at the end of a batch.

use super::walk::{Numbers, Walk};
use super::{PathFlags, PathParams, camera_segment};
use crate::bsdf::Material;
use crate::camera::{camera_ray, has_lens, rays_about_pixel};
use crate::film::{CUT, MAX_BLOCK_LOG2, sum_block};
use crate::geometry::{Hit, Ray};
use crate::lanes::{LANES, LaneKernel, Lanes, SimdToken, lanes_of, soa};
use crate::layout::{CameraParams, FEATURE_ENVIRONMENT, FEATURE_TEXTURES, FilmPixel};
use crate::rng::Rng;
use crate::scene::{LightSample, Lights, SceneView, Surface, SurfacePoint};
use crate::transport::{Chosen, Vertex, next_event, through_interior};
use crate::vec::max_component;
use glam::{UVec4, Vec3};

/// Samples that are kept until they are summed: of 64 pixels, or of more where blocks are smaller. At its end lanes run empty.
const BATCH: usize = 64 << MAX_BLOCK_LOG2;

/// The sum of one block of samples of each pixel of a row, from (x, y) on, as [`super::pixel`] gives it.
#[inline(always)]
pub fn pixels<T: SimdToken, const COMPILED: u32>(
    scene: &SceneView<'_, COMPILED>,
    params: &PathParams,
    [x, y]: [u32; 2],
    film: &mut [FilmPixel],
    token: T,
) {
    let block_log2 = params.block_log2.min(MAX_BLOCK_LOG2);
    let mut radiances = [Vec3::ZERO; BATCH];
    let mut at = 0;
    while at < film.len() {
        let batch = Batch { scene, params, at: [x.wrapping_add(at as u32), y], block_log2, token };
        let most = (BATCH >> block_log2).min(film.len() - at);
        let count = (0..most).take_while(|&pixel| !batch.is_black(pixel as u32)).count();
        if count > 0 {
            batch.sums(&mut film[at..at + count], &mut radiances);
        }
        if count < most {
            film[at + count] = FilmPixel::default();
        }
        at += most.min(count + 1);
    }
}

/// The samples of some pixels in a row, numbered from 0.
struct Batch<'a, T, const COMPILED: u32> {
    scene: &'a SceneView<'a, COMPILED>,
    params: &'a PathParams,
    /// The first pixel.
    at: [u32; 2],
    block_log2: u32,
    token: T,
}

soa! { Walks = Walk { ray: Ray, throughput: Vec3, chosen: Chosen, depth: u32 } }

/// Paths that have not ended.
#[derive(Clone, Copy)]
struct Paths {
    walk: Lanes<Walk>,
    /// Which sample of the batch each is.
    sample: Lanes<u32>,
    /// What it has found.
    sum: Lanes<Vec3>,
}

impl Paths {
    const NONE: Self = Self { walk: Lanes::ZERO, sample: Lanes::ZERO, sum: Lanes::ZERO };

    #[inline(always)]
    fn set(&mut self, lane: usize, walk: Walk, sample: u32, sum: Vec3) {
        self.walk.set(lane, walk);
        self.sample.set(lane, sample);
        self.sum.set(lane, sum);
    }
}

/// Paths that have met the scene.
struct Arrived {
    paths: Paths,
    /// Whether there is one at all. A lane without computes its last vertex again, of which nothing is used.
    any: Lanes<bool>,
    hit: Lanes<Hit>,
}

/// What the scene's tables have about hits, where [`Surfaces`] is a stage.
struct Located {
    point: Lanes<SurfacePoint>,
    /// The density of light samples there, if the point emits.
    density: Lanes<f32>,
}

/// Paths that have met the scene, at points and with light samples that are known where these are stages.
struct Vertices {
    arrived: Arrived,
    located: Located,
    /// Where [`ChooseLights`] is a stage.
    light: Lanes<LightSample>,
}

/// Paths that have been scattered.
struct Scattered {
    paths: Paths,
    /// Whether they go on.
    alive: Lanes<bool>,
    /// Whether the light sample counts, and what it adds if nothing is in its way.
    lit: Lanes<bool>,
    shadow: Lanes<Ray>,
    value: Lanes<Vec3>,
}

/// How far the samples of a batch are.
struct Progress<'a> {
    /// How many samples have begun.
    begun: usize,
    /// The first segments of those from the last multiple of [`LANES`] on, and what they meet.
    ahead: Lanes<Ray>,
    first_hits: Lanes<Hit>,
    /// Paths that have left the scene, and how many.
    escaped: Paths,
    escapes: usize,
    /// What samples have found that have ended.
    radiances: &'a mut [Vec3],
}

/// The first segments of the samples from `first` on. `PLAIN` cameras have no lens, and pixels the box for a filter: what others need
/// are calls and loops, which the stage of plain ones does not even name.
struct CameraSegments<'a, T, const COMPILED: u32, const PLAIN: bool> {
    batch: &'a Batch<'a, T, COMPILED>,
    first: u32,
}

impl<T: SimdToken, const COMPILED: u32, const PLAIN: bool> LaneKernel for CameraSegments<'_, T, COMPILED, PLAIN> {
    type In = ();
    type Out = Lanes<Ray>;

    #[inline(always)]
    fn run(&self, (): &(), rays: &mut Lanes<Ray>) {
        let Batch { scene, params, .. } = *self.batch;
        let (features, jitter) = (scene.features(), params.flags.contains(PathFlags::JITTER));
        let pinhole = CameraParams { lens_right: 0.0, lens_up: 0.0, ..params.camera };
        for lane in 0..LANES {
            let (rng, [x, y]) = self.batch.numbers(self.first + lane as u32);
            rays.set(
                lane,
                if PLAIN {
                    camera_ray(&pinhole, jitter, |u| u, features, &rng, x, y)
                } else {
                    camera_segment(params, &rng, features, [x, y])
                },
            );
        }
    }
}

/// Geometry and materials at the hits. A stage by itself where it would keep compilers from vectorising the rest: textures are loops, and
/// not all registers are loaded from many addresses.
struct Surfaces<'a, T, const COMPILED: u32>(&'a Batch<'a, T, COMPILED>);

impl<T: SimdToken, const COMPILED: u32> LaneKernel for Surfaces<'_, T, COMPILED> {
    type In = Arrived;
    type Out = Located;

    #[inline(always)]
    fn run(&self, from: &Arrived, located: &mut Located) {
        let scene = self.0.scene;
        for lane in 0..LANES {
            let hit = from.hit.get(lane);
            located.point.set(lane, scene.surface(&from.paths.walk.get(lane).ray, &hit));
            located.density.set(lane, scene.light_density(&hit));
        }
    }
}

/// Light samples for all vertices, whether they need one or not. A stage by itself as [`Surfaces`] is: a point of an environment is searched for.
struct ChooseLights<'a, T, const COMPILED: u32>(&'a Batch<'a, T, COMPILED>);

impl<T: SimdToken, const COMPILED: u32> LaneKernel for ChooseLights<'_, T, COMPILED> {
    type In = Arrived;
    type Out = Lanes<LightSample>;

    #[inline(always)]
    fn run(&self, from: &Arrived, lights: &mut Lanes<LightSample>) {
        let scene = self.0.scene;
        let mut words = [Lanes::<u32>::ZERO; 4];
        for lane in 0..LANES {
            let (rng, _) = self.0.numbers(from.paths.sample.get(lane));
            let drawn = Numbers::at(&rng, from.paths.walk.get(lane).depth + 1).light();
            words[0].set(lane, drawn.x);
            words[1].set(lane, drawn.y);
            words[2].set(lane, drawn.z);
            words[3].set(lane, drawn.w);
        }
        let environment = if scene.features() & FEATURE_ENVIRONMENT != 0 {
            scene.sample_environment_each(&[words[0], words[1]])
        } else {
            Lanes::all(LightSample::NONE)
        };
        for lane in 0..LANES {
            let drawn = UVec4::new(words[0].get(lane), words[1].get(lane), words[2].get(lane), words[3].get(lane));
            lights.set(lane, scene.sample_light_of(drawn, || environment.get(lane)));
        }
    }
}

/// Emission, light from the samples, and next directions.
struct Scatter<'a, T, const COMPILED: u32>(&'a Batch<'a, T, COMPILED>);

impl<T: SimdToken, const COMPILED: u32> LaneKernel for Scatter<'_, T, COMPILED> {
    type In = Vertices;
    type Out = Scattered;

    #[inline(always)]
    fn run(&self, from: &Vertices, to: &mut Scattered) {
        let Batch { scene, params, .. } = *self.0;
        let (features, Vertices { arrived, located, .. }) = (scene.features(), from);
        let paths = &arrived.paths;
        for lane in 0..LANES {
            let (mut walk, sample, mut sum) = (paths.walk.get(lane), paths.sample.get(lane), paths.sum.get(lane));
            let hit = arrived.hit.get(lane);
            let point = if Self::LOCATED { located.point.get(lane) } else { scene.surface(&walk.ray, &hit) };
            walk.throughput = through_interior(walk.throughput, &point, &walk.ray, hit.t, features);
            if max_component(point.emission) > 0.0 {
                let density = if Self::LOCATED { located.density.get(lane) } else { scene.light_density(&hit) };
                walk.find_emission(density, hit.t, &point, &mut sum);
            }
            walk.depth += 1;
            let counts = arrived.any.get(lane) & (walk.depth < params.max_depth);
            let goes_on = counts & (max_component(walk.throughput) > 0.0);
            let vertex = Vertex::new(&point, &walk.ray, features);
            let numbers = Numbers::at(&self.0.numbers(sample).0, walk.depth);
            let light = if Self::LIT { from.light.get(lane) } else { scene.sample_light(numbers.light()) };
            let connection = vertex.connect(&light);
            let lit = vertex.bsdf.has_smooth_part() & connection.shines();
            to.lit.set(lane, goes_on & lit);
            to.shadow.set(lane, connection.shadow);
            to.value.set(lane, walk.throughput * next_event(light.density, &connection));
            let roulette = params.flags.contains(PathFlags::ROULETTE);
            let (words, number) = (numbers.scatter(), || numbers.roulette());
            let departure = walk.bounce(features, &vertex, words, roulette, number);
            to.alive.set(lane, goes_on & departure.alive);
            to.paths.set(lane, walk, sample, sum);
        }
    }
}

impl<T: SimdToken, const COMPILED: u32> Scatter<'_, T, COMPILED> {
    /// Whether [`Surfaces`] is a stage.
    const LOCATED: bool = !T::GATHERS || COMPILED & FEATURE_TEXTURES != 0;
    /// Whether [`ChooseLights`] is.
    const LIT: bool = !T::GATHERS || COMPILED & FEATURE_ENVIRONMENT != 0;
}

/// What camera rays find that leave the scene at once, where the chance of a light sample does not matter.
struct Background<'a, T, const COMPILED: u32>(&'a Batch<'a, T, COMPILED>);

impl<T: SimdToken, const COMPILED: u32> LaneKernel for Background<'_, T, COMPILED> {
    type In = Lanes<Ray>;
    type Out = Lanes<Vec3>;

    #[inline(always)]
    fn run(&self, rays: &Lanes<Ray>, sums: &mut Lanes<Vec3>) {
        let mut directions = Lanes::ZERO;
        for lane in 0..LANES {
            directions.set(lane, rays.get(lane).direction);
        }
        let seen = self.0.scene.environment_points::<false>(&directions);
        for lane in 0..LANES {
            let mut sum = Vec3::ZERO;
            Walk::new(rays.get(lane)).see::<Material, _>(&seen.get(lane), &mut sum);
            sums.set(lane, sum);
        }
    }
}

/// What paths find that leave the scene, with what they had found before.
struct Escape<'a, T, const COMPILED: u32>(&'a Batch<'a, T, COMPILED>);

impl<T: SimdToken, const COMPILED: u32> LaneKernel for Escape<'_, T, COMPILED> {
    type In = Paths;
    type Out = Lanes<Vec3>;

    #[inline(always)]
    fn run(&self, paths: &Paths, sums: &mut Lanes<Vec3>) {
        let mut directions = Lanes::ZERO;
        for lane in 0..LANES {
            directions.set(lane, paths.walk.get(lane).ray.direction);
        }
        let seen = self.0.scene.environment_points::<true>(&directions);
        for lane in 0..LANES {
            let mut sum = paths.sum.get(lane);
            paths.walk.get(lane).see::<Material, _>(&seen.get(lane), &mut sum);
            sums.set(lane, sum);
        }
    }
}

impl<T: SimdToken, const COMPILED: u32> Batch<'_, T, COMPILED> {
    /// The sum of each pixel's samples, whose radiances are written down in `radiances`.
    #[inline(always)]
    fn sums(&self, film: &mut [FilmPixel], radiances: &mut [Vec3; BATCH]) {
        let radiances = &mut radiances[..film.len() << self.block_log2];
        radiances.fill(Vec3::ZERO);
        if self.params.max_depth > 0 {
            self.trace(radiances);
        }
        for (pixel, radiances) in film.iter_mut().zip(radiances.chunks(1 << self.block_log2)) {
            let of_sample = |index: u32| radiances[index.wrapping_sub(self.params.first_sample) as usize];
            *pixel = sum_block(self.params.first_sample, self.block_log2, of_sample);
        }
    }

    /// The radiance of each sample.
    #[inline(always)]
    fn trace(&self, radiances: &mut [Vec3]) {
        let mut progress = Progress {
            begun: 0,
            ahead: Lanes::ZERO,
            first_hits: Lanes::all(Hit::MISS),
            escaped: Paths::NONE,
            escapes: 0,
            radiances,
        };
        let mut vertices = Vertices {
            arrived: Arrived { paths: Paths::NONE, any: Lanes::ZERO, hit: Lanes::ZERO },
            located: Located { point: Lanes::ZERO, density: Lanes::ZERO },
            light: Lanes::ZERO,
        };
        let mut scattered = Scattered {
            paths: Paths::NONE,
            alive: Lanes::ZERO,
            lit: Lanes::ZERO,
            shadow: Lanes::ZERO,
            value: Lanes::ZERO,
        };
        while self.extend(&mut scattered, &mut vertices.arrived, &mut progress) {
            if Scatter::<T, COMPILED>::LOCATED {
                self.token.run(&Surfaces(self), &vertices.arrived, &mut vertices.located);
            }
            if Scatter::<T, COMPILED>::LIT {
                self.token.run(&ChooseLights(self), &vertices.arrived, &mut vertices.light);
            }
            self.token.run(&Scatter(self), &vertices, &mut scattered);
            self.look(&vertices.arrived, &mut scattered, progress.radiances);
        }
        self.escape(&mut progress);
    }

    /// Traces all paths to their next vertex; whether there is any. Those that leave the scene make room for others.
    #[inline(always)]
    fn extend(&self, scattered: &mut Scattered, arrived: &mut Arrived, progress: &mut Progress<'_>) -> bool {
        let Scattered { paths, alive, .. } = scattered;
        let mut rays = Lanes::ZERO;
        for lane in 0..LANES {
            rays.set(lane, paths.walk.get(lane).ray);
        }
        // where a lane's last vertex is computed again
        let before = arrived.hit;
        arrived.hit = self.scene.closest_each(&rays, alive);
        for lane in 0..LANES {
            arrived.any.set(lane, arrived.hit.get(lane).is_hit());
        }
        let all = Lanes::all(true).bits();
        for lane in lanes_of(all & !arrived.any.bits()) {
            let miss = arrived.hit.get(lane);
            let mut hit = if alive.get(lane) { Some(miss) } else { self.begin(paths, lane, progress) };
            while let Some(miss) = hit.filter(|hit| !hit.is_hit()) {
                self.leave(paths, lane, &miss, progress);
                hit = self.begin(paths, lane, progress);
            }
            arrived.any.set(lane, hit.is_some());
            arrived.hit.set(lane, hit.unwrap_or(before.get(lane)));
        }
        arrived.paths = *paths;
        arrived.any.bits() != 0
    }

    /// Begins the next sample, if there is one, and gives what its first segment meets.
    #[inline(always)]
    fn begin(&self, paths: &mut Paths, lane: usize, progress: &mut Progress<'_>) -> Option<Hit> {
        while progress.begun.is_multiple_of(LANES) && progress.begun < progress.radiances.len() {
            self.look_ahead(progress.begun as u32, &mut progress.ahead);
            self.meet(progress);
            if (0..LANES).any(|lane| progress.first_hits.get(lane) != Hit::MISS) {
                break;
            }
            self.pass_by(progress);
        }
        let next = progress.begun;
        if next >= progress.radiances.len() {
            return None;
        }
        progress.begun += 1;
        paths.set(lane, Walk::new(progress.ahead.get(next % LANES)), next as u32, Vec3::ZERO);
        Some(progress.first_hits.get(next % LANES))
    }

    /// Writes down what the next samples find, none of which meets anything.
    #[inline(always)]
    fn pass_by(&self, progress: &mut Progress<'_>) {
        let mut sums = Lanes::ZERO;
        self.token.run(&Background(self), &progress.ahead, &mut sums);
        for (lane, radiance) in progress.radiances[progress.begun..].iter_mut().take(LANES).enumerate() {
            *radiance = sums.get(lane);
        }
        progress.begun += LANES;
    }

    /// The first segments of the samples from `first` on.
    #[inline(always)]
    fn look_ahead(&self, first: u32, rays: &mut Lanes<Ray>) {
        if self.has_plain_camera() {
            self.token.run(&CameraSegments::<T, COMPILED, true> { batch: self, first }, &(), rays);
        } else {
            self.token.run(&CameraSegments::<T, COMPILED, false> { batch: self, first }, &(), rays);
        }
    }

    /// Traces the first segments of the next samples.
    #[inline(always)]
    fn meet(&self, progress: &mut Progress<'_>) {
        if LANES >> self.block_log2 <= 2 {
            // the rays are of one pixel, or of two beside each other, and have most of their way in common. Where only emitters
            // count, rays that meet none need not be traced: what they hit adds as much as a miss does
            let may_count = !self.only_emitters_count() || self.scene.may_meet_emitters(&progress.ahead);
            progress.first_hits =
                if may_count { self.scene.closest_together(&progress.ahead) } else { Lanes::all(Hit::MISS) };
            return;
        }
        let left = progress.radiances.len() - progress.begun;
        let mut of = Lanes::ZERO;
        for lane in 0..LANES {
            of.set(lane, lane < left);
        }
        progress.first_hits = self.scene.closest_each(&progress.ahead, &of);
    }

    /// Whether first segments find nothing but what emitters send: paths end with them, and what is behind everything is black.
    #[inline(always)]
    fn only_emitters_count(&self) -> bool {
        let environment = self.scene.features() & FEATURE_ENVIRONMENT != 0;
        (self.params.max_depth == 1) & !environment
    }

    /// Whether no sample of the pixel, by its number from the first one on, finds any light.
    #[inline(always)]
    fn is_black(&self, pixel: u32) -> bool {
        let at = [self.at[0].wrapping_add(pixel), self.at[1]];
        self.only_emitters_count()
            && self.has_plain_camera()
            && !self.scene.emitters_between(&rays_about_pixel(&self.params.camera, at))
    }

    /// Whether rays are within their pixel, and from one point.
    #[inline(always)]
    fn has_plain_camera(&self) -> bool {
        !has_lens(&self.params.camera) & !self.params.flags.contains(PathFlags::BLACKMAN_HARRIS)
    }

    /// Puts a path that leaves the scene beside others that have.
    #[inline(always)]
    fn leave(&self, paths: &Paths, lane: usize, miss: &Hit, progress: &mut Progress<'_>) {
        let sample = paths.sample.get(lane);
        if miss.is_cut() {
            progress.radiances[sample as usize] = CUT;
            return;
        }
        progress.escaped.set(progress.escapes, paths.walk.get(lane), sample, paths.sum.get(lane));
        progress.escapes += 1;
        if progress.escapes == LANES {
            self.escape(progress);
        }
    }

    /// Writes down what paths have found that have left the scene.
    #[inline(always)]
    fn escape(&self, progress: &mut Progress<'_>) {
        let mut sums = Lanes::ZERO;
        self.token.run(&Escape(self), &progress.escaped, &mut sums);
        for lane in 0..progress.escapes {
            progress.radiances[progress.escaped.sample.get(lane) as usize] = sums.get(lane);
        }
        progress.escapes = 0;
    }

    /// Adds the light samples that arrive, and writes down what paths have found that end.
    #[inline(always)]
    fn look(&self, arrived: &Arrived, scattered: &mut Scattered, radiances: &mut [Vec3]) {
        let Scattered { paths, alive, lit, shadow, value } = scattered;
        let occluded = self.scene.occluded_each(shadow, lit);
        for lane in 0..LANES {
            let (sum, arrives) = (paths.sum.get(lane), lit.get(lane) & !occluded.get(lane));
            paths.sum.set(lane, if arrives { sum + value.get(lane) } else { sum });
        }
        for lane in lanes_of(arrived.any.bits() & !alive.bits()) {
            radiances[paths.sample.get(lane) as usize] = paths.sum.get(lane);
        }
    }
}

impl<T: SimdToken, const COMPILED: u32> Batch<'_, T, COMPILED> {
    /// The random numbers of a sample, and its pixel.
    #[inline(always)]
    fn numbers(&self, sample: u32) -> (Rng, [u32; 2]) {
        let [x, y] = self.at;
        let x = x.wrapping_add(sample >> self.block_log2);
        let index = self.params.first_sample.wrapping_add(sample & ((1 << self.block_log2) - 1));
        (Rng::new(x, y, index, self.params.seed, self.params.sampler()), [x, y])
    }
}
