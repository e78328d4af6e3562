//! Lights over the arenas.

use super::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightKind, LightSample, Lights, SceneView,
};
use crate::geometry::Hit;
use crate::layout::{
    ALIAS_WORDS, FEATURE_EMISSIVE, FEATURE_ENVIRONMENT, FEATURE_LIGHT_TABLE, FEATURE_PUNCTUAL, LIGHT_ENVIRONMENT,
    LIGHT_PUNCTUAL, LIGHT_TRIANGLE, LIGHT_WORDS, NONE, PUNCTUAL_DIRECTIONAL, PUNCTUAL_WORDS,
};
use crate::pack::xyz;
use crate::sampling::{invert_triangle, sample_alias, sample_triangle};
use glam::{UVec4, Vec2, Vec3};

/// A light record.
struct Light {
    /// Triangle, or index among the punctual lights.
    index: u32,
    density: f32,
    kind: u32,
    /// Area of a triangle, 1 of other lights.
    area: f32,
}

impl<const COMPILED: u32> SceneView<'_, COMPILED> {
    #[inline(always)]
    fn light(&self, index: u32) -> Light {
        let word = self.attribute(self.header.light_base + index * LIGHT_WORDS);
        Light { index: word.x, density: f32::from_bits(word.y), kind: word.z, area: f32::from_bits(word.w) }
    }

    #[inline(always)]
    fn choose_light(&self, words: [u32; 2]) -> u32 {
        sample_alias(words, self.header.light_count, |i| {
            if self.has(FEATURE_LIGHT_TABLE) && self.header.alias_base != NONE {
                let word = self.attribute(self.header.alias_base + i * ALIAS_WORDS);
                (f32::from_bits(word.x), word.y)
            } else {
                (1.0, i)
            }
        })
    }

    /// [`Lights::sample_light`], where `environment` gives the sample of it that the first two words choose.
    #[inline(always)]
    pub(crate) fn sample_light_of(&self, words: UVec4, environment: impl FnOnce() -> LightSample) -> LightSample {
        let mut sample = LightSample::NONE;
        if self.header.light_count != 0 {
            let address = LightAddress::of_words(self.choose_light([words.z, words.w]), words);
            let light = self.light(address.light);
            if self.has(FEATURE_EMISSIVE) && light.kind == LIGHT_TRIANGLE {
                sample = self.sample_emissive(&light, address);
            }
            if self.has(FEATURE_PUNCTUAL) && light.kind == LIGHT_PUNCTUAL {
                sample = self.punctual(&light, address);
            }
            if self.has(FEATURE_ENVIRONMENT) && light.kind == LIGHT_ENVIRONMENT {
                sample = environment();
            }
        }
        sample
    }

    #[inline(always)]
    fn sample_emissive(&self, light: &Light, address: LightAddress) -> LightSample {
        let b = sample_triangle(address.uv());
        let p = self.triangle_point(light.index, b);
        let material = self.emitter(p.material, light.index, b);
        LightSample {
            position: p.position,
            normal: p.normal,
            offset: p.offset,
            emission: material.emission,
            two_sided: material.two_sided,
            density: light.density,
            kind: LightKind::Area,
            blended: material.blended,
            key: address.key(self.features & COMPILED),
            ..LightSample::NONE
        }
    }

    #[inline(always)]
    fn punctual(&self, light: &Light, address: LightAddress) -> LightSample {
        let at = self.header.punctual_base + light.index * PUNCTUAL_WORDS;
        let (a, b, c) = (self.attribute(at), self.attribute(at + 1), self.attribute(at + 2));
        let directional = a.w == PUNCTUAL_DIRECTIONAL;
        LightSample {
            position: if directional { -xyz(b) } else { xyz(a) },
            normal: xyz(b),
            emission: xyz(c),
            density: light.density,
            kind: if directional { LightKind::Directional } else { LightKind::Point },
            key: address.key(self.features & COMPILED),
            falloff: Vec2::new(f32::from_bits(b.w), f32::from_bits(c.w)),
            ..LightSample::NONE
        }
    }
}

impl<const COMPILED: u32> Lights for SceneView<'_, COMPILED> {
    #[inline(always)]
    fn sample_light(&self, words: UVec4) -> LightSample {
        self.sample_light_of(words, || self.sample_environment([words.x, words.y]))
    }

    #[inline(always)]
    fn light_density(&self, hit: &Hit) -> f32 {
        if !self.has(FEATURE_EMISSIVE) {
            return 0.0;
        }
        let light = self.geometry_word(self.header.triangle_word(hit.id) + 1).w;
        if light == NONE { 0.0 } else { self.light(light).density }
    }

    #[inline(always)]
    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        if self.has(FEATURE_ENVIRONMENT) && self.header.environment_base != NONE {
            self.environment_point(direction)
        } else {
            EnvironmentPoint { radiance: Vec3::ZERO, density: 0.0 }
        }
    }
}

impl<const COMPILED: u32> AddressedLights for SceneView<'_, COMPILED> {
    #[inline(always)]
    fn choose_address(&self, words: UVec4) -> LightAddress {
        if self.header.light_count == 0 {
            return LightAddress::NONE;
        }
        let index = self.choose_light([words.z, words.w]);
        if self.has(FEATURE_ENVIRONMENT) && self.light(index).kind == LIGHT_ENVIRONMENT {
            LightAddress::nearest(index, self.sample_map([words.x, words.y]))
        } else {
            LightAddress::of_words(index, words)
        }
    }

    #[inline(always)]
    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let light = self.light(address.light);
        let mut found = AddressedLight { sample: LightSample::NONE, extent: light.area };
        if self.has(FEATURE_EMISSIVE) && light.kind == LIGHT_TRIANGLE {
            found.sample = self.sample_emissive(&light, address);
        }
        if self.has(FEATURE_PUNCTUAL) && light.kind == LIGHT_PUNCTUAL {
            found.sample = self.punctual(&light, address);
        }
        if self.has(FEATURE_ENVIRONMENT) && light.kind == LIGHT_ENVIRONMENT {
            found = self.environment_sample(address.uv());
        }
        found
    }

    #[inline(always)]
    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        let light = self.geometry_word(self.header.triangle_word(hit.id) + 1).w;
        if self.has(FEATURE_EMISSIVE) && light != NONE {
            LightAddress::nearest(light, invert_triangle(hit.uv))
        } else {
            LightAddress::NONE
        }
    }

    #[inline(always)]
    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        if self.has(FEATURE_ENVIRONMENT) && self.header.environment_base != NONE {
            // the environment is the last of the lights
            let (uv, _) = self.map_point(direction);
            LightAddress::nearest(self.header.light_count.wrapping_sub(1), uv)
        } else {
            LightAddress::NONE
        }
    }
}
