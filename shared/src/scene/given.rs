//! Surfaces that an embedder gives, pixel by pixel: a G-buffer, which need not show anything that the scene has.
//!
//! Reuse stores of a surface its number and two coordinates, and asks for it again. A surface of a G-buffer has its pixel for a number
//! ([`GivenSurface::id`]), and [`Given`] answers for it by the G-buffer; for any other hit the scene does.
//!
//! ```
//! # mod floor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/scene/floor.rs")); }
//! # use floor::Floor;
//! use restir_shared::geometry::{Hit, Ray};
//! use restir_shared::glam::{Vec2, Vec3};
//! use restir_shared::scene::{Given, GivenSurface, GivenPlanes, Surface, SurfacePoint};
//! # #[derive(Clone, Copy)] struct Scene;
//! # impl Surface for Scene {
//! #     type Material = restir_shared::bsdf::Material;
//! #     fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint { Floor.surface(ray, hit) }
//! # }
//!
//! // pixel 1 of frame 0 sees something blue, which was elsewhere in the frame before
//! let point = SurfacePoint::diffuse(Vec3::X, Vec3::Y, 1e-3, Vec3::Z);
//! let surfaces = [GivenSurface::default(), GivenSurface::new(&point, Vec3::ZERO)];
//! let words = bytemuck::cast_slice(&surfaces);
//! let planes = GivenPlanes { base: 0, words: 16, half: 0 };
//! let scene = Given::new(Scene, words, planes);
//!
//! let down = Ray { origin: Vec3::Y, direction: Vec3::NEG_Y, t_max: Ray::FAR, key: 0 };
//! let hit = Hit { t: 1.0, id: GivenSurface::id(0, 1), uv: Vec2::ZERO };
//! let seen = scene.surface(&down, &hit);
//! assert_eq!((seen.position, seen.material.base_color), (Vec3::X, Vec3::Z));
//! // in the next frame it is one of the frame before, and in the frame before that one it was elsewhere
//! let before = Given::new(Scene, words, GivenPlanes { half: 1, ..planes });
//! assert_eq!(before.surface(&down, &hit).position, Vec3::ZERO);
//! ```

use super::delegate::delegate_lights;
use super::{Frames, LightAddress, Location, Surface, SurfacePoint, Trace};
use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::layout::FEATURE_GIVEN;
use crate::medium::Interior;
use crate::pack::{element, xyz};
use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec3};

/// Words of a surface.
const WORDS: u32 = 8;
/// The two highest bits of a number: no triangle has `01`, and no miss.
const GIVEN: u32 = 1;
const GIVEN_SHIFT: u32 = 30;
/// Which half of the planes.
const HALF_SHIFT: u32 = 29;

/// A surface of a G-buffer, in 128 bytes, which say all that the kernels ask of it. Of the material see [`Material`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GivenSurface {
    /// Position, in the session's coordinates.
    pub position: [f32; 3],
    /// See [`SurfacePoint::offset`]: rays begin so far off the surface.
    pub offset: f32,
    /// Unit normal of the surface as it is without shading.
    pub normal: [f32; 3],
    /// 1 for [`Material::thin`], else 0.
    pub thin: u32,
    /// Unit normal for shading.
    pub shading_normal: [f32; 3],
    /// See [`Material::roughness`].
    pub roughness: f32,
    /// See [`Material::base_color`].
    pub base_color: [f32; 3],
    /// See [`Material::metallic`].
    pub metallic: f32,
    /// Radiance that the surface sends to the camera.
    pub emission: [f32; 3],
    /// See [`Material::ior`].
    pub ior: f32,
    /// See [`Material::specular_color`].
    pub specular_color: [f32; 3],
    /// See [`Material::specular`].
    pub specular: f32,
    /// See [`Material::diffuse_transmission_color`].
    pub diffuse_transmission_color: [f32; 3],
    /// See [`Material::diffuse_transmission`].
    pub diffuse_transmission: f32,
    /// Where the point of the surface was in the last frame: what a motion vector says.
    pub last_position: [f32; 3],
    /// See [`Material::transmission`].
    pub transmission: f32,
}

const _: () = assert!(size_of::<GivenSurface>() == 16 * WORDS as usize);

impl GivenSurface {
    /// Of a point, and where it was in the last frame. What it absorbs is lost.
    pub fn new(point: &SurfacePoint, last_position: Vec3) -> Self {
        let Material { base_color, metallic, roughness, ior, specular, specular_color, transmission, .. } =
            point.material;
        Self {
            position: point.position.to_array(),
            offset: point.offset,
            normal: point.normal.to_array(),
            thin: point.material.thin as u32,
            shading_normal: point.shading_normal.to_array(),
            roughness,
            base_color: base_color.to_array(),
            metallic,
            emission: point.emission.to_array(),
            ior,
            specular_color: specular_color.to_array(),
            specular,
            diffuse_transmission_color: point.material.diffuse_transmission_color.to_array(),
            diffuse_transmission: point.material.diffuse_transmission,
            last_position: last_position.to_array(),
            transmission,
        }
    }

    /// The number of the surface that a pixel, below 2^29, sees, as hits have it: in the half 0 or 1 of the planes.
    #[inline(always)]
    pub fn id(half: u32, pixel: u32) -> u32 {
        (GIVEN << GIVEN_SHIFT) | (half << HALF_SHIFT) | pixel
    }
}

/// Where surfaces are given: two planes one after another in an arena, which frames write in turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GivenPlanes {
    /// First word of the first plane, in words of 16 bytes.
    pub base: u32,
    /// Words of a plane.
    pub words: u32,
    /// Which plane is of this frame: 0 or 1.
    pub half: u32,
}

crate::fields!(GivenPlanes: base, words, half);

/// A scene, or [`Frames`] of one, in which some surfaces are given. Without [`FEATURE_GIVEN`] there are none.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a, S> {
    scene: S,
    arena: &'a [UVec4],
    planes: GivenPlanes,
}

impl<'a, S> Given<'a, S> {
    /// Over the arena in which the planes are.
    #[inline(always)]
    pub fn new(scene: S, arena: &'a [UVec4], planes: GivenPlanes) -> Self {
        Self { scene, arena, planes }
    }
}

impl<S: Surface> Given<'_, S> {
    #[inline(always)]
    fn gives(&self, hit: &Hit) -> bool {
        // a scene of other types may have the feature, which it knows nothing of, and such numbers
        let has_planes = (self.scene.features() & FEATURE_GIVEN != 0) & (self.planes.words != 0);
        has_planes & (hit.id >> GIVEN_SHIFT == GIVEN)
    }

    #[inline(always)]
    fn word(&self, at: usize) -> UVec4 {
        element(self.arena, at)
    }

    /// Where the record of a surface begins, and whether it is one of this frame.
    #[inline(always)]
    fn record(&self, hit: &Hit) -> (usize, bool) {
        let (half, pixel) = ((hit.id >> HALF_SHIFT) & 1, hit.id & ((1 << HALF_SHIFT) - 1));
        let GivenPlanes { base, words, half: this } = self.planes;
        ((base + half * words + pixel * WORDS) as usize, half == this)
    }
}

impl<S: Trace> Trace for Given<'_, S> {
    #[inline(always)]
    fn closest(&self, ray: &Ray) -> Hit {
        self.scene.closest(ray)
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded(ray)
    }
}

impl<S: Surface<Material = Material>> Surface for Given<'_, S> {
    type Material = Material;

    #[inline(always)]
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        // each a variable of its own: as members of one they would all be computed where one is asked for
        let (position, normal, shading_normal, offset, emission, absorption);
        let (base_color, metallic, roughness, ior, specular, specular_color, transmission, thin);
        let (diffuse_transmission, diffuse_transmission_color);
        if self.gives(hit) {
            let (at, is_of_this_frame) = self.record(hit);
            let (w0, w1) = (self.word(at), self.word(at + 1));
            let (w2, w3) = (self.word(at + 2), self.word(at + 3));
            let (w4, w5) = (self.word(at + 4), self.word(at + 5));
            let (w6, w7) = (self.word(at + 6), self.word(at + 7));
            position = if is_of_this_frame { xyz(w0) } else { xyz(w7) };
            normal = xyz(w1);
            shading_normal = xyz(w2);
            offset = f32::from_bits(w0.w);
            emission = xyz(w4);
            absorption = Vec3::ZERO;
            base_color = xyz(w3);
            metallic = f32::from_bits(w3.w);
            roughness = f32::from_bits(w2.w);
            ior = f32::from_bits(w4.w);
            specular = f32::from_bits(w5.w);
            specular_color = xyz(w5);
            transmission = f32::from_bits(w7.w);
            diffuse_transmission = f32::from_bits(w6.w);
            diffuse_transmission_color = xyz(w6);
            thin = w1.w != 0;
        } else {
            let point = self.scene.surface(ray, hit);
            position = point.position;
            normal = point.normal;
            shading_normal = point.shading_normal;
            offset = point.offset;
            emission = point.emission;
            absorption = point.absorption;
            base_color = point.material.base_color;
            metallic = point.material.metallic;
            roughness = point.material.roughness;
            ior = point.material.ior;
            specular = point.material.specular;
            specular_color = point.material.specular_color;
            transmission = point.material.transmission;
            diffuse_transmission = point.material.diffuse_transmission;
            diffuse_transmission_color = point.material.diffuse_transmission_color;
            thin = point.material.thin;
        }
        let material = Material {
            base_color,
            metallic,
            roughness,
            ior,
            specular,
            specular_color,
            transmission,
            diffuse_transmission,
            diffuse_transmission_color,
            thin,
        };
        SurfacePoint { position, normal, shading_normal, offset, material, emission, absorption }
    }

    #[inline(always)]
    fn location(&self, hit: &Hit) -> Location {
        if !self.gives(hit) {
            return self.scene.location(hit);
        }
        let (at, is_of_this_frame) = self.record(hit);
        let (w0, w1, w7) = (self.word(at), self.word(at + 1), self.word(at + 7));
        let position = if is_of_this_frame { xyz(w0) } else { xyz(w7) };
        Location { position, normal: xyz(w1), offset: f32::from_bits(w0.w), extent: 1.0 }
    }

    // the following are asked of what rays have hit, which is never given

    #[inline(always)]
    fn off_edges(&self, hit: &Hit) -> Hit {
        self.scene.off_edges(hit)
    }

    #[inline(always)]
    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.scene.sheet(ray, hit)
    }

    #[inline(always)]
    fn interior(&self, hit: &Hit) -> Interior {
        self.scene.interior(hit)
    }

    #[inline(always)]
    fn absorbed(&self, hit: &Hit) -> Vec3 {
        self.scene.absorbed(hit)
    }

    #[inline(always)]
    fn features(&self) -> u32 {
        self.scene.features()
    }
}

delegate_lights!(['a] Given<'a, S>, self => self.scene);

impl<'a, F: Frames<Scene: Surface<Material = Material>>> Frames for Given<'a, F> {
    type Scene = Given<'a, F::Scene>;

    #[inline(always)]
    fn scene(&self, other: bool) -> Self::Scene {
        let planes = GivenPlanes { half: self.planes.half ^ other as u32, ..self.planes };
        Given { scene: self.scene.scene(other), arena: self.arena, planes }
    }

    #[inline(always)]
    fn counterpart(&self, address: LightAddress, of_other: bool) -> LightAddress {
        self.scene.counterpart(address, of_other)
    }
}
