//! What a technique asks of a scene, as small traits that an embedder implements as far as needed, and
//! [`SceneView`], which implements all of them over the scene's arenas.
//!
//! Every method is a function of its arguments alone: techniques rely on asking twice and getting the same bits.

use crate::geometry::{self, Hit, Ray};
use crate::layout::{
    ALIAS_WORDS, FEATURE_LIGHT_TABLE, LIGHT_WORDS, MATERIAL_TWO_SIDED_EMISSION, MATERIAL_WORDS, NONE, SceneHeader,
    TRIANGLE_WORDS,
};
use crate::num;
use crate::rng;
use crate::sampling::{sample_alias, sample_triangle};
use crate::vec::{cross, max_abs, normalize};
use glam::{UVec4, Vec2, Vec3};

/// Spawn offsets as a fraction of a triangle's largest coordinate: 2^-18, some sixty roundings.
const SPAWN_OFFSET: f32 = 1.0 / 262_144.0;

/// Visibility.
pub trait Trace {
    /// The nearest hit with `0 < t < ray.t_max`: the smallest (t, id) over all primitives. [`Hit::MISS`] if none.
    fn closest(&self, ray: &Ray) -> Hit;
    /// Whether there is any hit with `0 < t < ray.t_max`.
    fn occluded(&self, ray: &Ray) -> bool;
}

/// What answers visibility queries in place of the BVH in the arenas: natively, perhaps, a structure that suits the
/// processor better; on a device nothing.
#[cfg(not(target_arch = "spirv"))]
pub type Tracer<'a> = Option<&'a (dyn Trace + Sync)>;
/// Nothing: the arenas answer.
#[cfg(target_arch = "spirv")]
pub type Tracer<'a> = ();

/// What is at a hit.
pub trait Surface {
    /// Geometry and material at `hit`, which `closest` gave for `ray`.
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint;
}

/// Emitters, chosen without regard to the receiver: what reuse across pixels needs.
pub trait Lights {
    /// A point on an emitter from four random words; its density is zero if the scene has none.
    fn sample_light(&self, words: UVec4) -> LightSample;
    /// The density per area with which [`Self::sample_light`] gives the point at `hit`; zero off the emitters.
    fn light_density(&self, hit: &Hit) -> f32;
}

/// A point of a surface.
#[derive(Clone, Copy)]
pub struct SurfacePoint {
    /// World position.
    pub position: Vec3,
    /// Unit geometric normal of the front side.
    pub normal: Vec3,
    /// How far along the normal a ray that leaves the surface must begin, so that it does not hit it again.
    pub offset: f32,
    /// Diffuse reflectance, linear RGB in [0, 1].
    pub reflectance: Vec3,
    /// Radiance emitted towards the origin of the ray that hit, linear RGB.
    pub emission: Vec3,
}

/// A point on an emitter.
#[derive(Clone, Copy)]
pub struct LightSample {
    /// World position.
    pub position: Vec3,
    /// Unit normal of the front side.
    pub normal: Vec3,
    /// As [`SurfacePoint::offset`].
    pub offset: f32,
    /// Radiance emitted from the front side, linear RGB.
    pub emission: Vec3,
    /// Emits from the back as well.
    pub two_sided: bool,
    /// Density per area.
    pub density: f32,
}

/// A scene in its arenas, see [`crate::layout`].
#[derive(Clone, Copy)]
pub struct SceneView<'a> {
    /// Where the tables are.
    pub header: SceneHeader,
    /// Nodes and triangles.
    pub geometry: &'a [UVec4],
    /// Materials, lights, alias table.
    pub attributes: &'a [UVec4],
    /// Feature bits that the scene may have; a constant where the kernel was specialised.
    pub features: u32,
    /// What answers visibility queries in place of the geometry arena, with the same hits.
    pub tracer: Tracer<'a>,
}

/// A material record.
struct Material {
    reflectance: Vec3,
    emission: Vec3,
    two_sided: bool,
}

/// The float components x, y, z of a word.
#[inline(always)]
pub(crate) fn xyz(word: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(word.x), f32::from_bits(word.y), f32::from_bits(word.z))
}

impl SceneView<'_> {
    /// First word of a triangle in the geometry arena.
    #[inline(always)]
    pub(crate) fn triangle_word(&self, triangle: u32) -> usize {
        (self.header.triangle_base + triangle * TRIANGLE_WORDS) as usize
    }

    #[inline(always)]
    fn material(&self, index: u32) -> Material {
        let at = (index * MATERIAL_WORDS) as usize;
        let a = self.attributes[at];
        let b = self.attributes[at + 1];
        Material { reflectance: xyz(a), emission: xyz(b), two_sided: a.w & MATERIAL_TWO_SIDED_EMISSION != 0 }
    }

    /// (triangle, density per area) of a light.
    #[inline(always)]
    fn light(&self, index: u32) -> (u32, f32) {
        let word = self.attributes[(self.header.light_base + index * LIGHT_WORDS) as usize];
        (word.x, f32::from_bits(word.y))
    }

    #[inline(always)]
    fn choose_light(&self, words: [u32; 2]) -> u32 {
        sample_alias(words, self.header.light_count, |i| {
            if self.features & FEATURE_LIGHT_TABLE != 0 && self.header.alias_base != NONE {
                let word = self.attributes[(self.header.alias_base + i * ALIAS_WORDS) as usize];
                (f32::from_bits(word.x), word.y)
            } else {
                (1.0, i)
            }
        })
    }

    /// The point of a triangle with the given barycentric coordinates.
    #[inline(always)]
    fn triangle_point(&self, triangle: u32, b: Vec2) -> TrianglePoint {
        let at = self.triangle_word(triangle);
        let (w0, w1, w2) = (self.geometry[at], self.geometry[at + 1], self.geometry[at + 2]);
        let (v0, v1, v2) = (xyz(w0), xyz(w1), xyz(w2));
        let extent = num::max(num::max(max_abs(v0), max_abs(v1)), max_abs(v2));
        TrianglePoint {
            position: v0 * (1.0 - b.x - b.y) + v1 * b.x + v2 * b.y,
            normal: normalize(cross(v1 - v0, v2 - v0)),
            offset: extent * SPAWN_OFFSET,
            material: w0.w,
        }
    }
}

struct TrianglePoint {
    position: Vec3,
    normal: Vec3,
    offset: f32,
    material: u32,
}

impl Trace for SceneView<'_> {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        #[cfg(not(target_arch = "spirv"))]
        if let Some(tracer) = self.tracer {
            return tracer.closest(ray);
        }
        geometry::traverse::<false>(self, ray)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        #[cfg(not(target_arch = "spirv"))]
        if let Some(tracer) = self.tracer {
            return tracer.occluded(ray);
        }
        let hit = geometry::traverse::<true>(self, ray);
        hit.is_hit() | hit.is_cut()
    }
}

impl Surface for SceneView<'_> {
    #[inline(always)]
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let p = self.triangle_point(hit.id, hit.uv);
        let m = self.material(p.material);
        let front = crate::vec::dot(p.normal, ray.direction) < 0.0;
        SurfacePoint {
            position: p.position,
            normal: p.normal,
            offset: p.offset,
            reflectance: m.reflectance,
            emission: if front || m.two_sided { m.emission } else { Vec3::ZERO },
        }
    }
}

impl Lights for SceneView<'_> {
    #[inline(always)]
    fn sample_light(&self, words: UVec4) -> LightSample {
        if self.header.light_count == 0 {
            return LightSample {
                position: Vec3::ZERO,
                normal: Vec3::Z,
                offset: 0.0,
                emission: Vec3::ZERO,
                two_sided: false,
                density: 0.0,
            };
        }
        let (triangle, density) = self.light(self.choose_light([words.x, words.y]));
        let p = self.triangle_point(triangle, sample_triangle(Vec2::new(rng::unit(words.z), rng::unit(words.w))));
        let m = self.material(p.material);
        LightSample {
            position: p.position,
            normal: p.normal,
            offset: p.offset,
            emission: m.emission,
            two_sided: m.two_sided,
            density,
        }
    }

    #[inline(always)]
    fn light_density(&self, hit: &Hit) -> f32 {
        let light = self.geometry[self.triangle_word(hit.id) + 1].w;
        if light == NONE { 0.0 } else { self.light(light).1 }
    }
}
