//! The mixture of lobes that a material is for one direction to the viewer.

use super::albedo::Towards;
use super::coat::Coat;
use super::compensation::Compensation;
use super::fresnel::Fresnel;
use super::{
    COS_MIN, DELTA_BELOW, DIFFUSE_REFLECTION, DIFFUSE_TRANSMISSION, Dielectric, Ggx, Gloss, Material,
    SPECULAR_REFLECTION, SPECULAR_TRANSMISSION, markers, schlick_weight,
};
use crate::layout::{
    FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_GLOSSY, FEATURE_MULTISCATTER, FEATURE_TRANSMISSION,
};
use crate::num::{self, eft, mul_wide};
use crate::rng::{self, CELLS};
use crate::sampling::{cosine_hemisphere_pdf, invert_cosine_hemisphere, sample_cosine_hemisphere};
use crate::vec::{dot, flush, luminance};
use glam::{UVec4, Vec2, Vec3};

/// A lobe that contributes is chosen at least this often, however small its estimate is.
const LEAST_SHARE: f32 = 1.0 / 1024.0;
/// Adding and subtracting it leaves a multiple of 2^-20.
const ROUNDER: f32 = 8.0;
const LAST_CELL: f32 = 16_777_215.0;

/// Value and density for a pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// `f |cos_i|`, linear RGB.
    pub value: Vec3,
    /// Density per steradian with which [`Bsdf::sample`] gives this direction.
    pub pdf: f32,
}

/// A direction drawn from a [`Bsdf`]. Weight and density are zero if the light is absorbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction.
    pub direction: Vec3,
    /// `f |cos_i| / pdf`, of the whole mixture; of a delta lobe its energy over its selection probability.
    pub weight: Vec3,
    /// Density of the mixture per steradian; of a delta lobe its selection probability.
    pub pdf: f32,
    /// The lobe that gave the direction.
    pub lobe: u32,
    /// Its part in the density.
    pub lobe_pdf: f32,
    /// Whether that lobe is a delta.
    pub delta: bool,
}

/// How a lobe spreads light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// Into the whole hemisphere.
    Diffuse,
    /// Around the directions of reflection or refraction.
    Specular,
    /// Into one direction.
    Delta,
}

/// A material, prepared for one direction to the viewer.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    features: u32,
    wo: Vec3,
    /// Colours of the diffuse lobes.
    reflected: Vec3,
    transmitted: Vec3,
    coat: Coat,
    coated: bool,
    /// `1 - Fs(cos_o)`.
    entering: f32,
    compensation: Compensation,
    /// Schlick's reflectance of metal and coat together.
    f0: Vec3,
    f90: f32,
    /// T and T times the tint.
    transmission: f32,
    tint: Vec3,
    interface: Dielectric,
    index: f32,
    /// Index of the other side over that of the viewer's, and its reciprocal.
    relative: f32,
    inv_relative: f32,
    /// `wo` is on the side of the lower index of a transmitting interface, which is not thin.
    front: bool,
    thin: bool,
    ggx: Ggx,
    roughness: f32,
    perfect_reflection: bool,
    perfect_transmission: bool,
    selection: Selection,
    /// What stands for F if the choice comes before the normal, because only transmission is perfect.
    early_fresnel: f32,
}

/// Probabilities of the lobes, by one number for the lobe and one for reflection or transmission.
#[derive(Clone, Copy, Debug)]
struct Selection {
    /// Below it diffuse reflection, above it diffuse transmission, then the specular lobes above `diffuse_end`:
    /// multiples of 2^-20, so that probabilities are what sampling makes of them.
    diffuse_reflection_end: f32,
    diffuse_end: f32,
    /// Of the specular lobes reflection has probability `opaque + clear F`.
    opaque: f32,
    clear: f32,
}

/// What lobes send to the viewer, roughly: the opaque specular part and the transmitting one are `mirror` and `clear`.
struct Estimates {
    reflection: f32,
    transmission: f32,
    mirror: f32,
    clear: f32,
}

impl Selection {
    /// Diffuse reflection alone.
    const LAMBERT: Self = Self { diffuse_reflection_end: 1.0, diffuse_end: 1.0, opaque: 1.0, clear: 0.0 };

    /// In proportion to the estimates, but for [`LEAST_SHARE`]; the flags say whether the specular parts exist.
    #[inline(always)]
    fn new(estimates: &Estimates, has_mirror: bool, has_clear: bool) -> Self {
        let Estimates { reflection, transmission, mirror, clear } = *estimates;
        let least = ((reflection + transmission) + (mirror + clear)) * LEAST_SHARE;
        let reflection = if reflection > 0.0 { reflection + least } else { 0.0 };
        let transmission = if transmission > 0.0 { transmission + least } else { 0.0 };
        let mirror = if has_mirror { mirror + least } else { 0.0 };
        let clear = if has_clear { clear + least } else { 0.0 };
        let specular = mirror + clear;
        let total = (reflection + transmission) + specular;
        let inv_total = if total > num::FLUSH_BELOW { num::recip(total) } else { 0.0 };
        let share = if has_clear & (specular > num::FLUSH_BELOW) { num::div(clear, specular) } else { 0.0 };
        // diffuse reflection has the rest: all of it if nothing scatters
        let diffuse_end = 1.0 - round(specular * inv_total);
        Self {
            diffuse_reflection_end: num::max(diffuse_end - round(transmission * inv_total), 0.0),
            diffuse_end,
            opaque: 1.0 - share,
            clear: share,
        }
    }
}

/// A direction on its way to a sample; Fresnel's terms are those of a delta lobe.
struct Draw {
    direction: Vec3,
    lobe: u32,
    delta: bool,
    fresnel: Fresnel,
}

const NOTHING: Evaluation = Evaluation { value: Vec3::ZERO, pdf: 0.0 };

impl Bsdf {
    /// `wo` is a unit vector with z > 0, and `front` says whether it is on the outside of the surface. Of `features`
    /// (see [`crate::layout`]) those of [`Material::features`] must be set; others only add code.
    #[inline(always)]
    pub fn new(material: &Material, wo: Vec3, front: bool, features: u32) -> Self {
        let has = |feature: u32| features & feature != 0;
        let has_specular = has(FEATURE_GLOSSY | FEATURE_DELTA);
        let has_transmission = has(FEATURE_TRANSMISSION);
        let has_diffuse_transmission = has(FEATURE_DIFFUSE_TRANSMISSION);
        let base = material.base_color;

        let metallic = if has_specular { material.metallic } else { 0.0 };
        let dielectric = if has_specular { 1.0 - metallic } else { 1.0 };
        let transmission = if has_transmission { dielectric * material.transmission } else { 0.0 };
        let opaque = if has_transmission { dielectric * (1.0 - material.transmission) } else { dielectric };
        let through = if has_diffuse_transmission & (material.diffuse_transmission > markers::DIFFUSE_TRANSMISSION) {
            material.diffuse_transmission
        } else {
            0.0
        };
        let reflected = if has_diffuse_transmission { base * (opaque * (1.0 - through)) } else { base * opaque };
        let transmitted = if has_diffuse_transmission {
            material.diffuse_transmission_color * (opaque * through)
        } else {
            Vec3::ZERO
        };

        let index = material.ior;
        let coated = has_specular & (index > 1.0);
        let (inv_index, ratio) = if has_specular {
            let both = num::recip(index * (index + 1.0));
            (both * (index + 1.0), (index - 1.0) * (both * index))
        } else {
            (1.0, 0.0)
        };
        let interface_f0 = ratio * ratio;
        let interface_f90 = if coated { 1.0 } else { 0.0 };
        let schlick_o = if has_specular { schlick_weight(wo.z) } else { 0.0 };
        let coat = Coat::new(material, interface_f0, interface_f90, features);
        let entering = if coated { coat.clear(wo.z) } else { 1.0 };
        let mirrored = if coated { interface_f0 + (1.0 - interface_f0) * schlick_o } else { 0.0 };
        let f0 = if has_specular { coat.beside(base * metallic, opaque) } else { Vec3::ZERO };
        let f90 = if has_specular { metallic + opaque * coat.f90 } else { 0.0 };

        let front = front | material.thin;
        let interface = Dielectric::new(index, inv_index, front);
        let perfect_reflection = if has(FEATURE_GLOSSY) {
            has(FEATURE_DELTA) & (material.roughness < DELTA_BELOW)
        } else {
            has(FEATURE_DELTA)
        };
        let perfect_transmission = perfect_reflection | (has(FEATURE_DELTA) & has_transmission & material.is_narrow());
        let alpha = num::max(material.roughness * material.roughness, markers::GLOSSY);

        let rough_metal = if perfect_reflection { 0.0 } else { metallic };
        let loses = (coated & (opaque > 0.0)) | (rough_metal > 0.0);
        let compensation = if has(FEATURE_MULTISCATTER) & loses {
            Compensation::new(coat, rough_metal, base, material.roughness, wo.z)
        } else {
            Compensation::NONE
        };

        let f0_luminance = luminance(f0);
        let mut estimates = Estimates {
            reflection: luminance(reflected) * entering,
            transmission: luminance(transmitted) * entering,
            mirror: f0_luminance + (f90 - f0_luminance) * schlick_o,
            clear: transmission * (mirrored + (1.0 - mirrored) * luminance(base)),
        };
        if has(FEATURE_MULTISCATTER) & compensation.needed {
            let metal = luminance(base);
            estimates.reflection = luminance(reflected) * compensation.passing;
            estimates.transmission = luminance(transmitted) * compensation.passing;
            estimates.mirror = metallic * (metal + (1.0 - metal) * schlick_o) + opaque * (1.0 - compensation.passing);
        }
        let selection = if has_specular | has_diffuse_transmission {
            Selection::new(&estimates, f90 > 0.0, transmission > 0.0)
        } else {
            Selection::LAMBERT
        };
        let total = has_transmission & (interface.contrast + wo.z * wo.z < markers::TRANSMISSION);
        Self {
            features,
            wo,
            reflected,
            transmitted,
            coat,
            coated,
            entering,
            compensation,
            f0,
            f90,
            transmission,
            tint: base * transmission,
            interface,
            index,
            relative: if front { index } else { inv_index },
            inv_relative: if front { inv_index } else { index },
            front,
            thin: material.thin,
            ggx: Ggx::new(alpha, wo, !has_transmission | (transmission <= 0.0)),
            roughness: material.roughness,
            perfect_reflection,
            perfect_transmission,
            selection,
            early_fresnel: if total { 1.0 } else { mirrored },
        }
    }

    #[inline(always)]
    fn has(&self, features: u32) -> bool {
        self.features & features != 0
    }

    /// Value and density of all lobes but deltas, for light from any direction.
    #[inline(always)]
    pub fn evaluate(&self, wi: Vec3) -> Evaluation {
        self.evaluate_with_lobe(DIFFUSE_REFLECTION, wi).0
    }

    /// Value and density of one lobe, its selection probability included; of a delta nothing.
    #[doc(hidden)]
    #[inline(always)]
    pub fn evaluate_lobe(&self, lobe: u32, wi: Vec3) -> Evaluation {
        part(lobe, wi, self.parts(wi))
    }

    /// What [`Self::evaluate`] gives, and the density that [`Self::evaluate_lobe`] gives, for the price of one.
    #[inline(always)]
    pub(crate) fn evaluate_with_lobe(&self, lobe: u32, wi: Vec3) -> (Evaluation, f32) {
        let parts = self.parts(wi);
        let (diffuse, specular) = parts;
        let all = Evaluation { value: flush(diffuse.value + specular.value), pdf: diffuse.pdf + specular.pdf };
        (all, part(lobe, wi, parts).pdf)
    }

    /// The probability with which the lobe, of the specular lobes either, is selected: densities over it are those
    /// given the selection.
    #[doc(hidden)]
    #[inline(always)]
    pub fn selection(&self, lobe: u32) -> f32 {
        if is_specular(lobe) {
            1.0 - self.selection.diffuse_end
        } else if lobe == DIFFUSE_TRANSMISSION {
            self.selection.diffuse_end - self.selection.diffuse_reflection_end
        } else {
            self.selection.diffuse_reflection_end
        }
    }

    /// The diffuse and the specular lobe on the side of `wi`.
    #[inline(always)]
    fn parts(&self, wi: Vec3) -> (Evaluation, Evaluation) {
        let cos = num::abs(wi.z);
        if (self.wo.z < COS_MIN) | (cos < COS_MIN) {
            return (NOTHING, NOTHING);
        }
        let light = if self.compensates() { self.compensation.towards(cos) } else { Towards::NONE };
        let specular = if self.has(FEATURE_GLOSSY) { self.specular(wi, &light) } else { NOTHING };
        (self.diffuse(wi, &light), specular)
    }

    #[inline(always)]
    fn diffuse(&self, wi: Vec3, light: &Towards) -> Evaluation {
        let cos = num::abs(wi.z);
        let pdf = cosine_hemisphere_pdf(cos);
        let below = wi.z < 0.0;
        let color = if below { self.transmitted } else { self.reflected };
        let share = self.selection(if below { DIFFUSE_TRANSMISSION } else { DIFFUSE_REFLECTION });
        let coupling = if self.compensates() { self.compensation.coupling(light) } else { self.coupling(cos) };
        Evaluation { value: color * (coupling * pdf), pdf: share * pdf }
    }

    #[inline(always)]
    fn compensates(&self) -> bool {
        self.has(FEATURE_MULTISCATTER) & self.compensation.needed
    }

    /// What enters and leaves through the coat, in single scattering.
    #[inline(always)]
    fn coupling(&self, cos_i: f32) -> f32 {
        if self.coated { self.entering * self.coat.clear(cos_i) } else { 1.0 }
    }

    /// The rough specular lobe on the side of `wi`.
    #[inline(always)]
    fn specular(&self, wi: Vec3, light: &Towards) -> Evaluation {
        let below = wi.z < 0.0;
        let bends = below & !self.thin & self.has(FEATURE_TRANSMISSION);
        let n = self.normal(wi);
        let (on, in_) = (dot(self.wo, n), dot(wi, n));
        let perfect = if below { self.perfect_transmission } else { self.perfect_reflection };
        let absent = below & !self.has(FEATURE_TRANSMISSION);
        let impossible = (n.z <= 0.0) | (bends & ((on <= 0.0) | (in_ >= 0.0)));
        if perfect | absent | impossible {
            return NOTHING;
        }
        let facet = self.ggx.facet(wi, n);
        let inv_length = num::rsqrt(facet.length_squared);
        let cos = if bends { on * inv_length } else { 0.5 * (facet.length_squared * inv_length) };
        let cos_t = -(in_ * inv_length);
        let g = if bends { self.relative * cos_t } else { self.bent(cos) };
        let fresnel = self.fresnel(cos, g);
        // the change of variables from normals to directions, times (o.n) and 2: the cosines cancel in reflection
        let (density, scale_value, scale_pdf) = if bends {
            let squared = self.index * self.index;
            let jacobian = 2.0 * cos * cos_t * facet.density;
            if self.front { (jacobian, 1.0, squared) } else { (jacobian, squared, 1.0) }
        } else {
            (0.5 * facet.density * facet.length_squared, 1.0, 1.0)
        };
        let color = if below { self.tint * fresnel.transmitted } else { self.reflectance(cos, &fresnel) };
        let color = if self.compensates() & !below {
            color + self.compensation.interreflected(light, schlick_weight(cos))
        } else {
            color
        };
        let choice = if below { self.choose_transmission(&fresnel) } else { self.choose_reflection(&fresnel) };
        Evaluation {
            value: color * (density * facet.masking * scale_value),
            pdf: density * facet.visible * scale_pdf * (choice * self.selection(SPECULAR_REFLECTION)),
        }
    }

    /// The normal that takes light from `wi` to `wo`, of any length and pointing up if there is one.
    ///
    /// For refraction it is `-+(n_o wo + n_i wi)`, with the rounding error of the product added back: the sum may be
    /// small and its tangential part is then smaller still.
    #[inline(always)]
    fn normal(&self, wi: Vec3) -> Vec3 {
        let mirrored = self.wo + Vec3::new(wi.x, wi.y, num::abs(wi.z));
        if !self.has(FEATURE_TRANSMISSION) | self.thin | (wi.z >= 0.0) {
            return mirrored;
        }
        let (dense, thin) = if self.front { (-wi, -self.wo) } else { (self.wo, wi) };
        Vec3::new(
            self.scale_and_add(dense.x, thin.x),
            self.scale_and_add(dense.y, thin.y),
            self.scale_and_add(dense.z, thin.z),
        )
    }

    /// `index a + b`, rounded once but for an ulp.
    #[inline(always)]
    fn scale_and_add(&self, a: f32, b: f32) -> f32 {
        let (product, product_error) = eft::two_prod(self.index, a);
        let (sum, sum_error) = eft::two_sum(product, b);
        sum + (sum_error + product_error)
    }

    #[inline(always)]
    fn bent(&self, cos: f32) -> f32 {
        if self.has(FEATURE_TRANSMISSION) { self.interface.bent(cos) } else { 0.0 }
    }

    #[inline(always)]
    fn fresnel(&self, cos: f32, bent: f32) -> Fresnel {
        if self.has(FEATURE_TRANSMISSION) { self.interface.fresnel(cos, bent) } else { Fresnel::NONE }
    }

    /// Fresnel reflectance of all parts at the angle between `wo` and a normal.
    #[inline(always)]
    fn reflectance(&self, cos: f32, fresnel: &Fresnel) -> Vec3 {
        let opaque = self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick_weight(cos);
        if self.has(FEATURE_TRANSMISSION) {
            opaque + Vec3::splat(self.transmission * fresnel.reflected)
        } else {
            opaque
        }
    }

    /// Only transmission is perfect: the choice is made before a normal is drawn.
    #[inline(always)]
    fn chooses_early(&self) -> bool {
        self.has(FEATURE_TRANSMISSION) & self.perfect_transmission & !self.perfect_reflection
    }

    /// The probability of reflection among the specular lobes.
    #[inline(always)]
    fn choose_reflection(&self, fresnel: &Fresnel) -> f32 {
        let f = if self.chooses_early() { self.early_fresnel } else { fresnel.reflected };
        self.selection.opaque + self.selection.clear * f
    }

    /// One less [`Self::choose_reflection`].
    #[inline(always)]
    fn choose_transmission(&self, fresnel: &Fresnel) -> f32 {
        self.selection.clear * if self.chooses_early() { 1.0 - self.early_fresnel } else { fresnel.transmitted }
    }

    /// Draws a direction. `words.xy` give the direction, `z` chooses the lobe, `w` reflection or refraction.
    #[inline(always)]
    pub fn sample(&self, words: UVec4) -> BsdfSample {
        let u = Vec2::new(rng::unit(words.x), rng::unit(words.y));
        let selector = rng::unit(words.z);
        let draw = if selector < self.selection.diffuse_end {
            self.draw_diffuse(u, selector < self.selection.diffuse_reflection_end)
        } else {
            self.draw_specular(u, rng::unit(words.w))
        };
        let Draw { direction, lobe, .. } = draw;
        let delta = self.has(FEATURE_DELTA) & draw.delta;
        let (Evaluation { value, pdf }, lobe_pdf) = if delta {
            let perfect = self.perfect(&draw);
            (perfect, perfect.pdf)
        } else {
            self.evaluate_with_lobe(lobe, direction)
        };
        // a facet may send light to the wrong side, where it would meet another one: it counts as absorbed
        let pdf = if is_transmission(lobe) == (direction.z < 0.0) { pdf } else { 0.0 };
        let weight = if pdf <= 0.0 {
            Vec3::ZERO
        } else if self.selection.diffuse_reflection_end == 1.0 {
            // of a coat, the specular lobe would have a share
            self.reflected * self.coupling(direction.z)
        } else {
            value * num::recip(pdf)
        };
        BsdfSample { direction, weight: flush(weight), pdf, lobe, lobe_pdf, delta }
    }

    #[inline(always)]
    fn draw_diffuse(&self, u: Vec2, reflect: bool) -> Draw {
        let w = sample_cosine_hemisphere(u);
        let reflect = reflect | !self.has(FEATURE_DIFFUSE_TRANSMISSION);
        Draw {
            direction: if reflect { w } else { Vec3::new(w.x, w.y, -w.z) },
            lobe: if reflect { DIFFUSE_REFLECTION } else { DIFFUSE_TRANSMISSION },
            delta: false,
            fresnel: Fresnel::NONE,
        }
    }

    #[inline(always)]
    fn draw_specular(&self, u: Vec2, choice: f32) -> Draw {
        let transmits = self.has(FEATURE_TRANSMISSION);
        let early = self.chooses_early() & (choice >= self.choose_reflection(&Fresnel::NONE));
        let perfect = self.perfect_reflection | early;
        let rough = self.has(FEATURE_GLOSSY) & !perfect;
        let n = if rough { self.ggx.sample_normal(u) } else { Vec3::Z };
        let cos = if rough { num::max(dot(self.wo, n), COS_MIN) } else { self.wo.z };
        let fresnel = self.fresnel(cos, self.bent(cos));
        let reflect = !transmits | (choice < self.choose_reflection(&fresnel));
        let mirrored = if rough { n * (2.0 * cos) - self.wo } else { Vec3::new(-self.wo.x, -self.wo.y, self.wo.z) };
        let direction = if reflect {
            mirrored
        } else if self.thin {
            Vec3::new(mirrored.x, mirrored.y, -mirrored.z)
        } else if rough {
            (n * fresnel.shift - self.wo) * self.inv_relative
        } else {
            Vec3::new(-self.wo.x, -self.wo.y, -fresnel.bent) * self.inv_relative
        };
        let lobe = if reflect { SPECULAR_REFLECTION } else { SPECULAR_TRANSMISSION };
        Draw { direction, lobe, delta: perfect, fresnel }
    }

    /// The energy of a delta lobe and its selection probability.
    #[inline(always)]
    fn perfect(&self, draw: &Draw) -> Evaluation {
        let Draw { direction, lobe, fresnel, .. } = draw;
        let through = self.has(FEATURE_TRANSMISSION) & is_transmission(*lobe);
        let choice = if through { self.choose_transmission(fresnel) } else { self.choose_reflection(fresnel) };
        let probability = choice * self.selection(SPECULAR_REFLECTION);
        let scale = if self.thin { 1.0 } else { self.inv_relative * self.inv_relative };
        let value =
            if through { self.tint * (fresnel.transmitted * scale) } else { self.reflectance(self.wo.z, fresnel) };
        let visible = (probability > markers::DELTA) & (self.wo.z >= COS_MIN) & (num::abs(direction.z) >= COS_MIN);
        if visible { Evaluation { value, pdf: probability } } else { NOTHING }
    }

    /// Random words of which [`Self::sample`] makes this lobe and direction, up to rounding; what they leave free comes
    /// from `gamma`. The lobe must have a positive density there; for a delta the direction does not matter.
    #[inline(always)]
    pub fn invert(&self, lobe: u32, wi: Vec3, gamma: UVec4) -> UVec4 {
        let transmits = is_transmission(lobe);
        if !is_specular(lobe) {
            let u = invert_cosine_hemisphere(Vec3::new(wi.x, wi.y, num::abs(wi.z)));
            let z = if transmits {
                within(self.selection.diffuse_reflection_end, self.selection.diffuse_end, gamma.z)
            } else {
                within(0.0, self.selection.diffuse_reflection_end, gamma.z)
            };
            return UVec4::new(word(u.x, gamma.x), word(u.y, gamma.y), z, gamma.w);
        }
        let perfect = if transmits { self.perfect_transmission } else { self.perfect_reflection };
        let n = self.normal(wi);
        let cos = if perfect { self.wo.z } else { num::max(dot(self.wo, n) * num::rsqrt(dot(n, n)), COS_MIN) };
        let reflection = self.choose_reflection(&self.fresnel(cos, self.bent(cos)));
        let w = if transmits { within(reflection, 1.0, gamma.w) } else { within(0.0, reflection, gamma.w) };
        let z = within(self.selection.diffuse_end, 1.0, gamma.z);
        if perfect {
            return UVec4::new(gamma.x, gamma.y, z, w);
        }
        let u = self.ggx.invert_normal(n, rng::unit(gamma.y));
        UVec4::new(word(u.x, gamma.x), word(u.y, gamma.y), z, w)
    }

    /// Perceptual roughness: 1 of a diffuse lobe, 0 of a delta.
    #[inline(always)]
    pub fn roughness(&self, lobe: u32) -> f32 {
        match self.kind(lobe) {
            Kind::Diffuse => 1.0,
            Kind::Specular => self.roughness,
            Kind::Delta => 0.0,
        }
    }

    /// The strength of the rough specular lobes, by which they are selected, and their width.
    #[doc(hidden)]
    #[inline(always)]
    pub fn gloss(&self) -> Gloss {
        if !self.has(FEATURE_GLOSSY) | self.perfect_reflection {
            return Gloss::NONE;
        }
        Gloss { share: self.selection(SPECULAR_REFLECTION), alpha: self.roughness * self.roughness }
    }

    /// The roughness of the roughest lobe that takes part.
    #[inline(always)]
    pub(crate) fn greatest_roughness(&self) -> f32 {
        let specular = if self.perfect_reflection { 0.0 } else { self.roughness };
        if self.selection.diffuse_end > 0.0 { 1.0 } else { specular }
    }

    /// How the lobe spreads light.
    #[inline(always)]
    pub fn kind(&self, lobe: u32) -> Kind {
        let perfect = if is_transmission(lobe) { self.perfect_transmission } else { self.perfect_reflection };
        if !is_specular(lobe) {
            Kind::Diffuse
        } else if perfect {
            Kind::Delta
        } else {
            Kind::Specular
        }
    }

    /// Whether any lobe can be evaluated: without one, light that is sampled elsewhere contributes nothing.
    #[inline(always)]
    pub(crate) fn has_smooth_part(&self) -> bool {
        (self.selection.diffuse_end > 0.0) | !self.perfect_reflection
    }
}

/// A lobe's part in what the diffuse and the specular lobe give for a direction.
#[inline(always)]
fn part(lobe: u32, wi: Vec3, (diffuse, specular): (Evaluation, Evaluation)) -> Evaluation {
    let part = if is_specular(lobe) { specular } else { diffuse };
    if is_transmission(lobe) == (wi.z < 0.0) { part } else { NOTHING }
}

/// Whether the lobe lies on the other side of the surface.
#[inline(always)]
pub fn is_transmission(lobe: u32) -> bool {
    lobe & 1 != 0
}

/// Whether the lobe is a specular one.
#[inline(always)]
pub fn is_specular(lobe: u32) -> bool {
    lobe & 2 != 0
}

/// `p` in [0, 1], rounded to a multiple of 2^-20.
#[inline(always)]
fn round(p: f32) -> f32 {
    (p + ROUNDER) - ROUNDER
}

/// The word whose number is nearest to `u`, below 1.
#[inline(always)]
fn word(u: f32, free: u32) -> u32 {
    (num::clamp(u * CELLS + 0.5, 0.0, LAST_CELL) as u32) << 8 | (free & 0xff)
}

/// A word whose number is uniform in [lo, hi).
#[inline(always)]
fn within(lo: f32, hi: f32, free: u32) -> u32 {
    let first = cells_below(lo);
    let (cell, rest) = mul_wide(free, cells_below(hi).wrapping_sub(first));
    first.wrapping_add(cell) << 8 | (rest >> 24)
}

/// How many random numbers are below `p`.
#[inline(always)]
fn cells_below(p: f32) -> u32 {
    let scaled = num::clamp(p, 0.0, 1.0) * CELLS;
    let cell = scaled as u32;
    if (cell as f32) < scaled { cell.wrapping_add(1) } else { cell }
}
