//! Materials: glTF's metallic-roughness model with its extensions.

use glam::Vec3;
use restir_shared::layout::{INTERIOR_SLOTS, TEXTURE_SLOTS};
use restir_shared::medium::Medium;
use restir_shared::vec::max_component;

/// How a surface scatters and emits light: the metallic-roughness model of glTF 2.0 with the extensions
/// `KHR_materials_emissive_strength`, `_ior`, `_specular`, `_transmission`, `_diffuse_transmission`, `_volume` and
/// `_volume_scatter`.
///
/// A texture multiplies the factor beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Diffuse reflectance of a dielectric, reflectance at normal incidence of a metal, tint of transmitted light; linear
    /// RGB in [0, 1].
    pub base_color: [f32; 3],
    /// Factor on the alpha of the base colour's texture, in [0, 1].
    pub alpha: f32,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// sRGB, with a linear alpha.
    pub base_color_texture: Option<TextureUse>,
    /// 0 is a dielectric, 1 a metal.
    pub metallic: f32,
    /// Perceptual roughness in [0, 1]; GGX's alpha is its square.
    pub roughness: f32,
    /// Linear; green is roughness, blue metallic.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Linear, tangent space.
    pub normal_texture: Option<TextureUse>,
    /// Factor on x and y of the normal map.
    pub normal_scale: f32,
    /// Emitted radiance, linear RGB, not negative; see [`EMISSION_RANGE`](super::EMISSION_RANGE).
    pub emission: [f32; 3],
    /// sRGB.
    pub emission_texture: Option<TextureUse>,
    /// Emits on both sides, not only on the front.
    pub two_sided_emission: bool,
    /// Index of refraction, at least 1. With 1 a dielectric has no specular reflection: purely diffuse.
    pub ior: f32,
    /// Strength of the specular reflection of a dielectric that does not transmit, in [0, 1].
    pub specular: f32,
    /// Linear, in alpha.
    pub specular_texture: Option<TextureUse>,
    /// Scales that reflection at normal incidence, where it stays at most 1; linear RGB, not negative.
    pub specular_color: [f32; 3],
    /// sRGB.
    pub specular_color_texture: Option<TextureUse>,
    /// Share of the dielectric's light that is transmitted specularly instead of reflected diffusely, in [0, 1].
    pub transmission: f32,
    /// Share of the diffuse light that is transmitted diffusely, in [0, 1].
    pub diffuse_transmission: f32,
    /// Colour of diffusely transmitted light, linear RGB in [0, 1].
    pub diffuse_transmission_color: [f32; 3],
    /// What a closed surface encloses; `None` is a thin wall, which light passes without being bent.
    pub volume: Option<Volume>,
}

/// What the alpha of a base colour means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is not looked at: the surface is opaque.
    #[default]
    Opaque,
    /// There is a surface where alpha is no less than the cutoff, which is not negative.
    Mask {
        /// Least alpha of the surface; above 1 there is none.
        cutoff: f32,
    },
    /// The share of light that meets the surface. The rest goes straight on, its colour unchanged.
    Blend,
}

/// A homogeneous interior (`KHR_materials_volume`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Share of white light that is left after `attenuation_distance`, linear RGB in (0, 1].
    pub attenuation_color: [f32; 3],
    /// In the scene's unit of length; infinite for a clear interior.
    pub attenuation_distance: f32,
    /// What becomes of the light that the attenuation takes out of its way; `None` if it is absorbed.
    pub scattering: Option<VolumeScattering>,
}

/// How an interior scatters light (`KHR_materials_volume_scatter`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeScattering {
    /// What a half space of the medium reflects of light that enters and leaves it by Lambert's law, linear RGB in [0, 1]: the colour
    /// of a thick body ([`restir_shared::medium::Medium::of_color`]).
    pub color: [f32; 3],
    /// sRGB. Where light enters decides for its whole way inside.
    pub color_texture: Option<TextureUse>,
    /// Linear, in alpha: a factor on the colour.
    pub strength_texture: Option<TextureUse>,
    /// Mean cosine of the angle by which light turns, within plus and minus [`restir_shared::medium::MAX_ANISOTROPY`].
    pub anisotropy: f32,
    /// See [`restir_shared::medium::Interior::denser_outside`]; 1 for nothing of the kind.
    pub denser_outside: f32,
}

impl Volume {
    /// An interior that absorbs: `color` is left of white light after `distance`.
    pub fn absorbing(color: [f32; 3], distance: f32) -> Self {
        Self { attenuation_color: color, attenuation_distance: distance, scattering: None }
    }

    /// An interior of the given colour, in which light flies `mean_free_path` > 0 between two collisions, by channel. A path that is 10^5 times the
    /// shortest is right to 0.05 %.
    pub fn scattering(color: [f32; 3], mean_free_path: [f32; 3], anisotropy: f32) -> Self {
        // where neither of the extremes loses its digits in what is left
        let [longest, shortest] = [f32::max, f32::min].map(|of| mean_free_path.into_iter().reduce(of).unwrap_or(1.0));
        let distance = f32::min(longest, 12.0 * shortest);
        let left = |mean: f32| (-f64::from(distance) / f64::from(mean)).exp() as f32;
        let scattering = VolumeScattering { anisotropy, ..VolumeScattering::of_color(color) };
        Self { scattering: Some(scattering), ..Self::absorbing(mean_free_path.map(left), distance) }
    }

    /// The textures of its scattering, in the order of the slots of [`restir_shared::layout`].
    pub fn textures(&self) -> [Option<&TextureUse>; INTERIOR_SLOTS as usize] {
        let scattering = self.scattering.as_ref();
        [scattering.and_then(|s| s.color_texture.as_ref()), scattering.and_then(|s| s.strength_texture.as_ref())]
    }

    /// Expected number of collisions of light per unit length, by channel (Beer and Lambert).
    pub fn extinction(&self) -> [f32; 3] {
        let distance = f64::from(self.attenuation_distance);
        self.attenuation_color.map(|left| (-f64::from(left).max(LEAST_LEFT).ln() / distance) as f32)
    }

    /// What its attenuation and its scattering make it; `None` if it is said to absorb alone.
    pub(crate) fn medium(&self) -> Option<Medium> {
        let scattering = self.scattering?;
        let extinction = Vec3::from_array(self.extinction());
        let medium = Medium::of_color(Vec3::from_array(scattering.color), Vec3::ONE, scattering.anisotropy);
        Some(Medium { extinction, ..medium })
    }

    /// Whether any light is scattered inside.
    pub(crate) fn scatters(&self) -> bool {
        self.medium().is_some_and(|medium| max_component(medium.extinction * medium.albedo) > 0.0)
    }
}

impl VolumeScattering {
    /// The scattering of a colour, in all directions alike.
    pub fn of_color(color: [f32; 3]) -> Self {
        Self { color, color_texture: None, strength_texture: None, anisotropy: 0.0, denser_outside: 1.0 }
    }
}

/// An attenuation colour of zero counts as this.
const LEAST_LEFT: f64 = 1.0e-6;

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`super::Scene::textures`].
    pub texture: usize,
    /// From the mesh's texture coordinates to the texture's, affine: u' = m\[0\] u + m\[1\] v + m\[2\], v' = m\[3\] u + m\[4\] v + m\[5\].
    pub transform: [f32; 6],
    /// The texture coordinates that it lies on.
    pub uv_set: UvSet,
}

/// One of a mesh's sets of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UvSet {
    /// [`Mesh::uvs`](super::Mesh::uvs).
    #[default]
    First,
    /// [`Mesh::second_uvs`](super::Mesh::second_uvs).
    Second,
}

impl Material {
    /// A Lambertian material.
    pub fn diffuse(name: impl Into<String>, reflectance: [f32; 3]) -> Self {
        Self {
            name: name.into(),
            base_color: reflectance,
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission: [0.0; 3],
            emission_texture: None,
            two_sided_emission: false,
            ior: 1.0,
            specular: 1.0,
            specular_texture: None,
            specular_color: [1.0; 3],
            specular_color_texture: None,
            transmission: 0.0,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: [1.0; 3],
            volume: None,
        }
    }

    /// The textures of its surface, in the order of the slots of [`restir_shared::layout`].
    pub fn textures(&self) -> [Option<&TextureUse>; TEXTURE_SLOTS as usize] {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.emission_texture,
            &self.specular_texture,
            &self.specular_color_texture,
        ]
        .map(Option::as_ref)
    }

    /// All textures in use, of the surface and of what is inside.
    pub(crate) fn all_textures(&self) -> impl Iterator<Item = &TextureUse> {
        let inside = self.volume.iter().flat_map(|volume| volume.textures());
        self.textures().into_iter().chain(inside).flatten()
    }

    /// Whether any texture lies on the second set of texture coordinates.
    pub(crate) fn needs_second_uvs(&self) -> bool {
        self.all_textures().any(|used| used.uv_set == UvSet::Second)
    }

    /// Whether it has any texture.
    pub(crate) fn is_textured(&self) -> bool {
        self.all_textures().next().is_some()
    }

    /// A Lambertian material that emits from its front.
    pub fn emitter(name: impl Into<String>, reflectance: [f32; 3], emission: [f32; 3]) -> Self {
        Self { emission, ..Self::diffuse(name, reflectance) }
    }
}

impl TextureUse {
    /// The texture as it lies on the mesh's first texture coordinates.
    pub fn new(texture: usize) -> Self {
        Self { texture, transform: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0], uv_set: UvSet::First }
    }
}
