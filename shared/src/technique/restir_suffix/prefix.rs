//! Prefixes: paths from the camera up to where others may go on from.

use super::SuffixParams;
use crate::bsdf::{Scattering, ScatteringFunction};
use crate::camera::camera_ray;
use crate::film::CUT;
use crate::geometry::Hit;
use crate::layout::FilmPixel;
use crate::resample::params::Flags;
use crate::resample::similar::{GBufferSurface, PackedSurface};
use crate::rng::Rng;
use crate::scene::{EnvironmentPoint, Lights, Surface, SurfacePoint, Trace};
use crate::shift::PathOrigin;
use crate::technique::path::{Receiver, Walk};
use crate::transport::{Departure, Vertex};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Where prefixes end (Kettunen et al. 2023): at the first vertex from the `min_segments`-th on whose segment is long enough, between vertices that
/// are rough enough for paths to be joined there. The paper ends them at the second of two rough vertices in a row, the published code also asks for
/// a length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EndRule {
    /// The fewest segments, the camera ray among them: with 1 all prefixes end at what the camera sees.
    pub min_segments: u32,
    /// The least perceptual roughness of the lobe by which the path leaves the vertex before, and of the roughest lobe of the last one.
    pub min_roughness: f32,
    /// The least length of the last segment, as a part of the prefix's.
    pub min_distance: f32,
}

crate::fields!(EndRule: min_segments, min_roughness, min_distance);

/// What a pixel's path is worth up to its end, and where that is.
#[derive(Clone, Copy, Debug)]
pub struct Prefix {
    /// Its end; [`PathOrigin::NONE`] if it has none: it has met the void, or is as long as a path may be.
    pub end: PathOrigin,
    /// What radiance against its last segment is worth. What an interior absorbs on that segment is left to the suffix, as is all that a path finds
    /// from an origin on.
    pub throughput: Vec3,
    /// The light that the path finds before it ends; black if none is to be found.
    pub light: FilmPixel,
    /// What the camera sees.
    pub seen: PathOrigin,
    /// The surface there.
    pub surface: PackedSurface,
}

/// Takes what a prefix finds.
struct Ends {
    rule: EndRule,
    lights: bool,
    /// Light is taken from paths of at least so many segments.
    shortest: u32,
    light: Vec3,
    /// Vertices so far.
    vertices: u32,
    seen: PathOrigin,
    surface: PackedSurface,
    /// The last hit, and the length of the path up to there.
    hit: Hit,
    reach: f32,
    /// What the path is worth before its last segment, and how rough the lobe is by which it left the vertex before.
    throughput: Vec3,
    roughness: f32,
    end: PathOrigin,
}

impl Ends {
    /// Light that a path of so many segments has found.
    #[inline(always)]
    fn take(&mut self, segments: u32, value: Vec3) {
        let taken = self.lights & (segments >= self.shortest);
        self.light = if taken { self.light + value } else { self.light };
    }
}

impl<M: Scattering> Receiver<M> for Ends {
    #[inline(always)]
    fn add(&mut self, value: Vec3) {
        self.take(self.vertices, value);
    }

    #[inline(always)]
    fn emission(&mut self, _radiance: Vec3, _weight: f32, value: Vec3) {
        self.take(self.vertices, value);
    }

    #[inline(always)]
    fn next_event(&mut self, _scattered: Vec3, value: Vec3) {
        self.take(self.vertices + 1, value);
    }

    #[inline(always)]
    fn environment(&mut self, _environment: &EnvironmentPoint, _weight: f32, value: Vec3) {
        self.take(self.vertices + 1, value);
    }

    #[inline(always)]
    fn samples_lights(&self) -> bool {
        self.lights & (self.vertices + 1 >= self.shortest)
    }

    #[inline(always)]
    fn place<S: Surface<Material = M>>(&mut self, _scene: &S, walk: &Walk, hit: Hit) -> Hit {
        self.throughput = walk.throughput;
        self.reach += hit.t;
        self.hit = hit;
        hit
    }

    #[inline(always)]
    fn arrive(&mut self, walk: &Walk, hit: &Hit, point: &SurfacePoint<M>) {
        self.vertices = walk.depth + 1;
        if walk.depth == 0 {
            let (position, normal) = (point.position, point.normal);
            self.seen = PathOrigin::new(&walk.ray, hit);
            self.surface = PackedSurface::pack(&GBufferSurface { position, normal, distance: hit.t });
        }
    }

    #[inline(always)]
    fn ends(&mut self, walk: &Walk, vertex: &Vertex<M::Bsdf>) -> bool {
        let EndRule { min_segments, min_roughness, min_distance } = self.rule;
        let rough = |roughness: f32| (roughness > 0.0) & (roughness >= min_roughness);
        let joins =
            rough(self.roughness) & rough(vertex.bsdf.greatest_roughness()) & (self.hit.t >= min_distance * self.reach);
        let ends = (walk.depth >= min_segments) & (joins | (min_segments == 1));
        if ends {
            self.end = PathOrigin::of_prefix(&walk.ray, &self.hit, walk.depth, self.reach);
        }
        ends
    }

    #[inline(always)]
    fn depart(&mut self, departure: &Departure) {
        self.roughness = departure.roughness;
    }
}

/// Traces a prefix of the pixel `at` with these random numbers. With `lights` it finds the light on its way, by path tracing; with
/// [`Flags::INDIRECT_ONLY`] none by paths of up to two segments.
#[inline(always)]
pub fn prefix<S: Trace + Surface + Lights>(
    scene: &S,
    params: &SuffixParams,
    rng: &Rng,
    lights: bool,
    [x, y]: [u32; 2],
) -> Prefix {
    let jitter = params.flags.contains(Flags::JITTER);
    let ray = camera_ray(&params.camera, jitter, |u| u, scene.features(), rng, x, y);
    let mut ends = Ends {
        rule: params.ends,
        lights,
        shortest: if params.flags.contains(Flags::INDIRECT_ONLY) { 3 } else { 0 },
        light: Vec3::ZERO,
        vertices: 0,
        seen: PathOrigin::NONE,
        surface: PackedSurface::NONE,
        hit: Hit::MISS,
        reach: 0.0,
        throughput: Vec3::ONE,
        roughness: 0.0,
        end: PathOrigin::NONE,
    };
    let whole = Walk::new(ray).run(scene, rng, params.max_depth, false, &mut ends);
    let Ends { end, throughput, seen, surface, light, .. } = ends;
    let light = FilmPixel::from_radiance(if whole { light } else { CUT });
    Prefix { end, throughput, light, seen, surface }
}
