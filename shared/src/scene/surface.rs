//! Surfaces over the arenas: materials, textures, shading normals.

use super::texture::Uvs;
use super::view::TrianglePoint;
use super::{Location, SceneView, Surface, SurfacePoint};
use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::layout::{
    FEATURE_ALPHA, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_EMISSIVE, FEATURE_GLOSSY, FEATURE_SECOND_UVS,
    FEATURE_SHADING, FEATURE_SPECULAR, FEATURE_SUBSURFACE, FEATURE_TEXTURES, FEATURE_TRANSMISSION, FEATURE_VOLUME,
    INTERIOR_SLOTS, MATERIAL_TWO_SIDED_EMISSION, MATERIAL_VOLUME, MATERIAL_WORDS, NONE, SECOND_UV_WORDS, SHADING_WORDS,
    SLOT_BASE_COLOR, SLOT_EMISSION, SLOT_METALLIC_ROUGHNESS, SLOT_NORMAL, SLOT_SCATTERING_STRENGTH, SLOT_SPECULAR,
    SLOT_SPECULAR_COLOR, TEXTURE_SLOTS, TRIANGLE_ALPHA,
};
use crate::medium::{Interior, absorbed_of_color, albedo_of_color};
use crate::num;
use crate::pack::{decode_unit_vector, xyz};
use crate::vec::{cross, dot, normalize};
use glam::{Vec2, Vec3};

/// Squared lengths of interpolated normals and tangents below this give no direction.
const MIN_LENGTH_SQUARED: f32 = 1.0e-12;

/// Emission of a material at a point of its front side.
pub(super) struct Emitter {
    pub(super) emission: Vec3,
    pub(super) two_sided: bool,
    /// Of what is blended, the emission is that of the share which is there.
    pub(super) blended: bool,
}

/// What is interpolated over a triangle, with a tangent frame.
struct Shading {
    normal: Vec3,
    tangent: Vec3,
    bitangent_sign: f32,
    uvs: Uvs,
}

impl Shading {
    /// The shading of a flat triangle.
    #[inline(always)]
    fn of(normal: Vec3) -> Self {
        Self { normal, tangent: Vec3::ZERO, bitangent_sign: 1.0, uvs: Uvs::ZERO }
    }
}

/// The values of a material's textures at a point.
struct Textures {
    base_color: Vec3,
    metallic_roughness: Vec3,
    normal: Vec3,
    emission: Vec3,
    specular: f32,
    specular_color: Vec3,
}

impl Textures {
    /// No texture; the normal is the one that a texture of ones would never give: straight up.
    const NONE: Self = Self {
        base_color: Vec3::ONE,
        metallic_roughness: Vec3::ONE,
        normal: Vec3::new(0.5, 0.5, 1.0),
        emission: Vec3::ONE,
        specular: 1.0,
        specular_color: Vec3::ONE,
    };
}

/// The sum of unit vectors, each times its weight. No closure: those are compiled by themselves.
#[inline(always)]
fn mix([p, q, r]: [u32; 3], weights: Vec3) -> Vec3 {
    decode_unit_vector(p) * weights.x + decode_unit_vector(q) * weights.y + decode_unit_vector(r) * weights.z
}

/// The texture coordinates between those of a triangle's corners.
#[inline(always)]
fn mix_uvs(corners: [Vec2; 3], b: Vec2) -> Vec2 {
    corners[0] * (1.0 - b.x - b.y) + corners[1] * b.x + corners[2] * b.y
}

#[inline(always)]
fn unpacked_uv(u: u32, v: u32) -> Vec2 {
    Vec2::new(f32::from_bits(u), f32::from_bits(v))
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    /// Normal, tangent and texture coordinates at a point of a triangle.
    #[inline(always)]
    fn shading(&self, triangle: u32, b: Vec2, geometric: Vec3) -> Shading {
        let at = (self.header.shading_base + triangle * SHADING_WORDS) as usize;
        let (w0, w1) = (self.geometry_word(at), self.geometry_word(at + 1));
        let weights = Vec3::new(1.0 - b.x - b.y, b.x, b.y);
        let normal = mix([w0.x, w0.y, w0.z], weights);
        let smooth = dot(normal, normal) > MIN_LENGTH_SQUARED;
        let normal = if smooth { normalize(normal) } else { geometric };
        let normal = if dot(normal, geometric) < 0.0 { -normal } else { normal };
        let tangent = if self.has(FEATURE_TEXTURES) { mix([w0.w, w1.x, w1.y], weights) } else { Vec3::ZERO };
        let bitangent_sign = if w0.w & 1 == 0 { 1.0 } else { -1.0 };
        Shading { normal, tangent, bitangent_sign, uvs: self.uvs(triangle, b) }
    }

    /// Texture coordinates.
    #[inline(always)]
    pub(super) fn uvs(&self, triangle: u32, b: Vec2) -> Uvs {
        let at = (self.header.shading_base + triangle * SHADING_WORDS) as usize;
        let (w1, w2) = (self.geometry_word(at + 1), self.geometry_word(at + 2));
        let first = mix_uvs([unpacked_uv(w1.z, w1.w), unpacked_uv(w2.x, w2.y), unpacked_uv(w2.z, w2.w)], b);
        let mut second = Vec2::ZERO;
        if self.has(FEATURE_SECOND_UVS) && self.header.second_uv_base != NONE {
            let at = (self.header.second_uv_base + triangle * SECOND_UV_WORDS) as usize;
            let (w0, w1) = (self.geometry_word(at), self.geometry_word(at + 1));
            second = mix_uvs([unpacked_uv(w0.x, w0.y), unpacked_uv(w0.z, w0.w), unpacked_uv(w1.x, w1.y)], b);
        }
        Uvs { first, second }
    }

    /// How many slots a material of this scene's features may use.
    #[inline(always)]
    fn slots(&self) -> u32 {
        if self.has(FEATURE_SPECULAR) { TEXTURE_SLOTS } else { SLOT_SPECULAR }
    }

    /// The textures of the slots below `end`.
    #[inline(always)]
    fn textures(&self, uses: u32, uvs: Uvs, end: u32) -> Textures {
        let mut textures = Textures::NONE;
        let mut slot = 0;
        while slot < end {
            if self.has_texture(uses, slot) {
                let specular = self.has(FEATURE_SPECULAR);
                let value = self.texture(uses, slot, uvs, specular & (slot == SLOT_SPECULAR));
                if slot == SLOT_BASE_COLOR {
                    textures.base_color = value;
                } else if slot == SLOT_METALLIC_ROUGHNESS {
                    textures.metallic_roughness = value;
                } else if slot == SLOT_NORMAL {
                    textures.normal = value;
                } else if specular & (slot == SLOT_SPECULAR) {
                    textures.specular = value.x;
                } else if specular & (slot == SLOT_SPECULAR_COLOR) {
                    textures.specular_color = value;
                } else {
                    textures.emission = value;
                }
            }
            slot += 1;
        }
        textures
    }

    /// What the textures of emission and, where a scene has any, of alpha give. They are looked up in one place, for a look-up
    /// takes much code.
    #[inline(always)]
    fn emission_and_alpha(&self, uses: u32, uvs: Uvs) -> (Vec3, f32) {
        let (mut emission, mut alpha) = (Vec3::ONE, 1.0);
        let mut slot = SLOT_EMISSION;
        loop {
            let of_alpha = self.has(FEATURE_ALPHA) & (slot == SLOT_BASE_COLOR);
            if self.has_texture(uses, slot) {
                let value = self.texture(uses, slot, uvs, of_alpha);
                if of_alpha {
                    alpha = value.x;
                } else {
                    emission = value;
                }
            }
            if of_alpha | !self.has(FEATURE_ALPHA) {
                return (emission, alpha);
            }
            slot = SLOT_BASE_COLOR;
        }
    }

    /// What a material emits at a point of a triangle.
    #[inline(always)]
    pub(super) fn emitter(&self, material: u32, triangle: u32, b: Vec2) -> Emitter {
        let at = self.header.material_base + material * MATERIAL_WORDS;
        let (a, e) = (self.attribute(at), self.attribute(at + 1));
        let mut emission = xyz(e);
        let mut alpha = 1.0;
        if self.has(FEATURE_TEXTURES) && e.w != NONE {
            let textures = self.emission_and_alpha(e.w, self.uvs(triangle, b));
            emission *= textures.0;
            alpha = textures.1;
        }
        if self.has(FEATURE_ALPHA) {
            emission *= self.share(a.w, self.attribute(at + 5), alpha);
        }
        Emitter { emission, two_sided: a.w & MATERIAL_TWO_SIDED_EMISSION != 0, blended: self.is_blended(a.w) }
    }

    /// The product of what the textures of an interior give.
    #[inline(always)]
    fn scattering_texture(&self, uses: u32, uvs: Uvs) -> Vec3 {
        let mut product = Vec3::ONE;
        let mut slot = 0;
        while slot < INTERIOR_SLOTS {
            if self.has_texture(uses, slot) {
                product *= self.texture(uses, slot, uvs, slot == SLOT_SCATTERING_STRENGTH);
            }
            slot += 1;
        }
        product
    }

    /// A material whose parameters are factors alone; what the scene's features exclude is not read.
    #[inline(always)]
    fn material(&self, at: u32, flags: u32) -> Material {
        let mut material = Material::diffuse(xyz(self.attribute(at)));
        if self.has(FEATURE_GLOSSY | FEATURE_DELTA | FEATURE_TRANSMISSION) {
            let word = self.attribute(at + 2);
            material.metallic = f32::from_bits(word.x);
            material.roughness = f32::from_bits(word.y);
            material.ior = f32::from_bits(word.z);
            material.transmission = f32::from_bits(word.w);
            material.thin = flags & MATERIAL_VOLUME == 0;
        }
        if self.has(FEATURE_SPECULAR) {
            let word = self.attribute(at + 6);
            material.specular_color = xyz(word);
            material.specular = f32::from_bits(word.w);
        }
        if self.has(FEATURE_DIFFUSE_TRANSMISSION) {
            let word = self.attribute(at + 3);
            material.diffuse_transmission_color = xyz(word);
            material.diffuse_transmission = f32::from_bits(word.w);
        }
        material
    }

    /// The shading normal under a normal map.
    #[inline(always)]
    fn mapped_normal(&self, shading: &Shading, texel: Vec3, scale: f32) -> Vec3 {
        let n = shading.normal;
        let tangent = shading.tangent - n * dot(n, shading.tangent);
        let length_squared = dot(tangent, tangent);
        if length_squared < MIN_LENGTH_SQUARED {
            return n;
        }
        let t = tangent * num::rsqrt(length_squared);
        let b = cross(n, t) * shading.bitangent_sign;
        let mapped =
            t * ((texel.x * 2.0 - 1.0) * scale) + b * ((texel.y * 2.0 - 1.0) * scale) + n * (texel.z * 2.0 - 1.0);
        if dot(mapped, mapped) < MIN_LENGTH_SQUARED { n } else { normalize(mapped) }
    }

    /// A point, with its shading normal and the texture of its emission, or without.
    #[inline(always)]
    fn point<const SHADED: bool>(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let p: TrianglePoint = self.triangle_point(hit.id, hit.uv);
        let at = self.header.material_base + p.material * MATERIAL_WORDS;
        let flags = self.attribute(at).w;
        let front = dot(p.normal, ray.direction) < 0.0;
        let word = self.attribute(at + 1);
        // each a variable of its own: a member of a larger one would be carried with all others through every branch
        let shines = self.has(FEATURE_EMISSIVE) && (front || flags & MATERIAL_TWO_SIDED_EMISSION != 0);
        let mut emission = if shines { xyz(word) } else { Vec3::ZERO };
        let absorbs = self.has(FEATURE_VOLUME) && flags & MATERIAL_VOLUME != 0;
        let absorption = if absorbs { xyz(self.attribute(at + 4)) } else { Vec3::ZERO };
        let mut textures = Textures::NONE;
        let mut shading_normal = p.normal;
        let textured = self.has(FEATURE_TEXTURES) && word.w != NONE;
        if self.has(FEATURE_SHADING) && self.header.shading_base != NONE {
            let shading = if SHADED {
                self.shading(hit.id, hit.uv, p.normal)
            } else {
                Shading { uvs: self.uvs(hit.id, hit.uv), ..Shading::of(p.normal) }
            };
            shading_normal = shading.normal;
            if textured {
                textures = self.textures(word.w, shading.uvs, if SHADED { self.slots() } else { SLOT_NORMAL });
                emission *= textures.emission;
                if SHADED && self.has_texture(word.w, SLOT_NORMAL) {
                    let scale = f32::from_bits(self.attribute(at + 4).w);
                    shading_normal = self.mapped_normal(&shading, textures.normal, scale);
                }
            }
        }
        let mut material = self.material(at, flags);
        if self.has(FEATURE_TEXTURES) {
            material.base_color *= textures.base_color;
            material.roughness *= textures.metallic_roughness.y;
            material.metallic *= textures.metallic_roughness.z;
        }
        if self.has(FEATURE_TEXTURES) & self.has(FEATURE_SPECULAR) {
            material.specular *= textures.specular;
            material.specular_color *= textures.specular_color;
        }
        let TrianglePoint { position, normal, offset, .. } = p;
        SurfacePoint { position, normal, shading_normal, offset, material, emission, absorption }
    }
}

impl<const COMPILED: u32> Surface for SceneView<'_, COMPILED> {
    type Material = Material;

    #[inline(always)]
    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.point::<true>(ray, hit)
    }

    #[inline(always)]
    fn location(&self, hit: &Hit) -> Location {
        let TrianglePoint { position, normal, offset, extent, .. } = self.triangle_point(hit.id, hit.uv);
        Location { position, normal, offset, extent }
    }

    #[inline(always)]
    fn off_edges(&self, hit: &Hit) -> Hit {
        Hit { uv: self.off_triangle_edges(hit.id, hit.uv), ..*hit }
    }

    #[inline(always)]
    fn sheet(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.point::<false>(ray, hit)
    }

    #[inline(always)]
    fn interior(&self, hit: &Hit) -> Interior {
        let p: TrianglePoint = self.triangle_point(hit.id, hit.uv);
        let at = self.header.material_base + p.material * MATERIAL_WORDS;
        let (record, around) = if self.has(FEATURE_SUBSURFACE) {
            let word = self.attribute(at + 5);
            (word.z, word.w)
        } else {
            (0, 0)
        };
        let interior = Interior {
            around,
            closed: self.attribute(at).w & MATERIAL_VOLUME != 0,
            body: self.geometry_word(self.header.triangle_word(hit.id) + 2).w & !TRIANGLE_ALPHA,
            extinction: xyz(self.attribute(at + 4)),
            offset: p.offset,
            ..Interior::NONE
        };
        if record == 0 {
            return interior;
        }
        let specular = self.attribute(at + 2);
        let (index, transmission) = (f32::from_bits(specular.z), f32::from_bits(specular.w));
        let (w0, w1) = (
            self.attribute(self.header.material_base + record),
            self.attribute(self.header.material_base + record + 1),
        );
        let anisotropy = f32::from_bits(w0.w);
        let mut albedo = xyz(w0);
        // where it is textured the record has the colour
        if self.has(FEATURE_TEXTURES) && w1.y != NONE {
            albedo = albedo_of_color(albedo * self.scattering_texture(w1.y, self.uvs(hit.id, hit.uv)), anisotropy);
        }
        Interior {
            filled: true,
            albedo,
            anisotropy,
            denser_outside: f32::from_bits(w1.x),
            turn_scale: f32::from_bits(w1.w),
            lit: w1.z != 0,
            gain: if transmission > 0.0 { index * index } else { 1.0 },
            ..interior
        }
    }

    #[inline(always)]
    fn absorbed(&self, hit: &Hit) -> Vec3 {
        let p: TrianglePoint = self.triangle_point(hit.id, hit.uv);
        let record = self.attribute(self.header.material_base + p.material * MATERIAL_WORDS + 5).z;
        if record == 0 {
            return Vec3::ONE;
        }
        let word = |index: u32| self.attribute(self.header.material_base + record + index);
        let (w0, uses) = (word(0), word(1).y);
        if self.has(FEATURE_TEXTURES) && uses != NONE {
            let color = xyz(w0) * self.scattering_texture(uses, self.uvs(hit.id, hit.uv));
            return absorbed_of_color(color, f32::from_bits(w0.w));
        }
        xyz(word(2))
    }

    #[inline(always)]
    fn features(&self) -> u32 {
        self.features & COMPILED
    }
}
