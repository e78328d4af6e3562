//! What GGX reflects of light from everywhere, and what balances it: fits made by `cargo lab albedo`.
//!
//! With the cosine mu, alpha the square of the roughness r, `m^2 = alpha^2 (1 - mu^2) + mu^2`, s = mu / m and
//! `p^2 = 1 - s^2`, let `Q(s, alpha) = (p^2 A(s, alpha) + alpha^2 B(s, alpha)) / (1 + s D(s, alpha))` with polynomials A, B and
//! D. Of facets that reflect everything,
//!
//! * single scattering loses the share `L = s Q`;
//! * the values times `g(cos_o) g(cos_i)` lose nothing, `g = 1 + Q` with other polynomials: the lobe is scaled to an albedo of 1 at every
//!   angle, and stays reciprocal (Sinkhorn and Knopp 1967 have shown that there is one such g).
//!
//! Facets that reflect Schlick's weight reflect `(1 - L) (1 - c)^5` with `c = mu + alpha p H(s, mu, r)`, a mean cosine
//! between the viewer and their normals. The fits err towards loss: a white surface never returns more than 1.0005 of the
//! light that reaches it, and at least 0.99 (docs/albedo.md).
//!
//! ```
//! use restir_shared::bsdf::albedo::Albedo;
//!
//! // of the roughest metal, seen from above, single scattering loses the share ln 2
//! let rough = Albedo::new(1.0).towards(1.0);
//! assert!((rough.losses.all - core::f32::consts::LN_2).abs() < 0.01);
//! // what balances the loss enlarges the lobe, and smooth metal needs next to nothing of it
//! let smooth = Albedo::new(0.1).towards(1.0);
//! assert!(rough.gain > 1.2 && (1.0..1.001).contains(&smooth.gain));
//!
//! // the mean over all directions, by the projected solid angle, lies between those of the best and the worst direction
//! let mean = Albedo::mean(0.5).all;
//! let of = |cos| Albedo::new(0.5).towards(cos).losses.all;
//! assert!(of(1.0) < mean && mean < of(0.3));
//! ```

pub mod fit;

use super::schlick_complement;
use crate::num;

/// Q at one alpha: the coefficients of A, of B times alpha^2, and of D, by power of s.
#[derive(Clone, Copy, Debug)]
struct Quotient {
    edge: [f32; 2],
    deep: [f32; 2],
    below: [f32; 3],
}

impl Quotient {
    const NONE: Self = Self { edge: [0.0; 2], deep: [0.0; 2], below: [0.0; 3] };

    #[inline(always)]
    fn new(rows: [[f32; 4]; 7], alpha: f32) -> Self {
        let row = |i: usize| cubic(rows[i], alpha);
        let squared = alpha * alpha;
        Self { edge: [row(0), row(1)], deep: [squared * row(2), squared * row(3)], below: [row(4), row(5), row(6)] }
    }

    /// Above and below the line, for s and p^2.
    #[inline(always)]
    fn at(&self, s: f32, p_squared: f32) -> (f32, f32) {
        let edge = self.edge[0] + self.edge[1] * s;
        let deep = self.deep[0] + self.deep[1] * s;
        let below = 1.0 + s * (self.below[0] + s * (self.below[1] + s * self.below[2]));
        (p_squared * edge + deep, below)
    }
}

/// What does not come back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Losses {
    /// From facets that reflect everything: L, in [0, 1].
    pub all: f32,
    /// From facets that reflect Schlick's weight: 1 less what comes back.
    pub schlick: f32,
}

impl Losses {
    /// From facets that reflect `f0 + (f90 - f0) (1 - o.h)^5`.
    #[inline(always)]
    pub fn of(&self, f0: f32, f90: f32) -> f32 {
        (1.0 - f90) + (f0 * self.all + (f90 - f0) * self.schlick)
    }
}

/// What concerns one direction, of a viewer or of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Towards {
    /// What does not come back from there.
    pub losses: Losses,
    /// The factor by which a lobe is multiplied, so that it keeps the energy that one reflection loses: g of Turquin 2019.
    pub gain: f32,
}

impl Towards {
    /// There is no surface, and nothing is lost.
    pub const NONE: Self = Self { losses: Losses { all: 0.0, schlick: 0.0 }, gain: 1.0 };
}

/// The fits at one roughness.
#[derive(Clone, Copy, Debug)]
pub struct Albedo {
    alpha: f32,
    lost: Quotient,
    balance: Quotient,
    schlick: [f32; 5],
}

impl Albedo {
    /// There is no surface, and nothing is lost.
    pub const NONE: Self = Self { alpha: 0.0, lost: Quotient::NONE, balance: Quotient::NONE, schlick: [0.0; 5] };

    /// `roughness` in [0, 1].
    #[inline(always)]
    pub fn new(roughness: f32) -> Self {
        let alpha = roughness * roughness;
        let row = |i: usize| {
            let [constant, a, b, c, d] = fit::SCHLICK[i];
            constant + roughness * cubic([a, b, c, d], roughness)
        };
        let (lost, balance) = (Quotient::new(fit::LOST, alpha), Quotient::new(fit::BALANCE, alpha));
        Self { alpha, lost, balance, schlick: [row(0), row(1), row(2), row(3), row(4)] }
    }

    /// Means of the losses over all directions, by the projected solid angle.
    #[inline(always)]
    pub fn mean(roughness: f32) -> Losses {
        let all = num::max(roughness * roughness * septic(fit::MEAN_LOST, roughness), 0.0);
        Losses { all, schlick: septic(fit::MEAN_SCHLICK, roughness) }
    }

    /// For a viewer, or light, at this cosine in (0, 1].
    #[inline(always)]
    pub fn towards(&self, cos: f32) -> Towards {
        let squared = cos * cos;
        let grazing = self.alpha * self.alpha * num::max(1.0 - squared, 0.0);
        let inv_reach = num::rsqrt(grazing + squared);
        // not 1 - s^2, of which little is left for smooth surfaces
        let (s, p_squared) = (cos * inv_reach, grazing * (inv_reach * inv_reach));
        let ((lost, below), (gained, under)) = (self.lost.at(s, p_squared), self.balance.at(s, p_squared));
        // one division for two
        let both = num::recip(below * under);
        let all = num::clamp(s * lost * (both * under), 0.0, 1.0);
        let [constant, by_s, by_cos, by_square, by_both] = self.schlick;
        let h = (constant + by_s * s) + cos * ((by_cos + by_square * cos) + by_both * s);
        let facet = cos + self.alpha * (num::sqrt(p_squared) * h);
        let schlick = all + (1.0 - all) * schlick_complement(facet);
        Towards { losses: Losses { all, schlick }, gain: 1.0 + gained * (both * below) }
    }
}

#[inline(always)]
fn cubic(c: [f32; 4], x: f32) -> f32 {
    c[0] + x * (c[1] + x * (c[2] + x * c[3]))
}

#[inline(always)]
fn septic(c: [f32; 8], x: f32) -> f32 {
    let x2 = x * x;
    cubic([c[0], c[1], c[2], c[3]], x) + (x2 * x2) * cubic([c[4], c[5], c[6], c[7]], x)
}
