//! What a smooth interface reflects.

use super::markers;
use crate::num;

/// `(1 - cos)^5`: Schlick's reflectance is `f0 + (f90 - f0)` times it (Schlick 1994, eq. 15).
#[inline(always)]
pub fn schlick_weight(cos: f32) -> f32 {
    let x = num::clamp(1.0 - cos, 0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// `1 - schlick_weight(cos)`, without cancellation.
#[inline(always)]
pub fn schlick_complement(cos: f32) -> f32 {
    let x = num::clamp(1.0 - cos, 0.0, 1.0);
    let x2 = x * x;
    num::clamp(cos, 0.0, 1.0) * ((1.0 + x) * (1.0 + x2) + x2 * x2)
}

/// An interface to a medium of relative index n.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Square of the index of refraction n behind the surface, over that on the light's side.
    pub index_squared: f32,
    /// n^2 - 1, without cancellation.
    pub contrast: f32,
}

/// What Fresnel's equations say about one angle of incidence.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// The reflected part of unpolarised light.
    pub reflected: f32,
    /// The transmitted part: `1 - reflected`, without cancellation.
    pub transmitted: f32,
    /// `n cos_t`, where cos_t is the cosine of the angle of refraction; zero if reflection is total.
    pub bent: f32,
    /// `cos - n cos_t`, without cancellation: what refraction adds along the normal.
    pub shift: f32,
}

impl Dielectric {
    /// The interface to a medium of this index, seen from outside or from inside.
    #[inline(always)]
    pub fn new(index: f32, inv_index: f32, outside: bool) -> Self {
        let (squared, inv_squared) = (index * index, inv_index * inv_index);
        let contrast = (index - 1.0) * (index + 1.0);
        Self {
            index_squared: if outside { squared } else { inv_squared },
            contrast: if outside { contrast } else { -contrast * inv_squared },
        }
    }

    /// Snell's law: `n cos_t` for light at the positive cosine `c`; zero if reflection is total.
    #[inline(always)]
    pub fn bent(&self, c: f32) -> f32 {
        let squared = self.contrast + c * c;
        if squared < markers::TRANSMISSION { 0.0 } else { num::sqrt(squared) }
    }

    /// Fresnel's equations for light at the positive cosine `c` and `g = n cos_t`, which [`Self::bent`] gives: near total
    /// reflection g is ill-conditioned in c, so whoever knows the refracted direction takes it from there.
    ///
    /// With s = c + g and e = n^2 c + g (Walter et al. 2007, eq. 22, rearranged in positive sums):
    /// R_s = ((n^2 - 1) / s^2)^2, R_p = ((n^2 - 1)(c s - 1) / (s e))^2, 1 - R = 2 c g (1 / s^2 + n^2 / e^2).
    #[inline(always)]
    pub fn fresnel(&self, c: f32, g: f32) -> Fresnel {
        if g <= 0.0 {
            return Fresnel { reflected: 1.0, transmitted: 0.0, bent: 0.0, shift: c };
        }
        let s = c + g;
        let e = self.index_squared * c + g;
        let both = num::recip(s * e);
        let (inv_s, inv_e) = (both * e, both * s);
        let rs = self.contrast * (inv_s * inv_s);
        let rp = self.contrast * (c * s - 1.0) * both;
        Fresnel {
            reflected: 0.5 * (rs * rs + rp * rp),
            transmitted: 2.0 * c * g * (inv_s * inv_s + self.index_squared * (inv_e * inv_e)),
            bent: g,
            shift: -self.contrast * inv_s,
        }
    }
}

impl Fresnel {
    /// What no interface does: it neither reflects nor lets anything pass.
    pub const NONE: Self = Self { reflected: 0.0, transmitted: 0.0, bent: 0.0, shift: 0.0 };
}
