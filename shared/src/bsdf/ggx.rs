//! The GGX distribution of normals, seen from one direction.

use crate::num;
use crate::vec::{dot, normalize};
use glam::{Vec2, Vec3};

/// GGX with Smith's masking (Walter et al. 2007; Heitz 2014), prepared for one direction to the viewer.
///
/// Normals are passed unnormalised, as sums of directions, so that those near the mirror direction keep their
/// relative precision. With r(v) = |(alpha v.x, alpha v.y, v.z)|, masking is 1 + Lambda(v) = (v.z + r(v)) / (2 v.z).
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    alpha: f32,
    wo: Vec3,
    /// r(wo).
    reach: f32,
    /// `(alpha wo.x, alpha wo.y, wo.z) / r(wo)`.
    stretched: Vec3,
    /// k: of the cap that normals come from, the part down to `-k` times the height of the viewer, 1 for all of it.
    bound: f32,
    /// `1 / (k wo.z + r(wo))`.
    inv_sum: f32,
}

/// Distribution and masking for one pair of directions and their common normal n.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// `D(n) / |n|^2`.
    pub density: f32,
    /// `|n|^2`.
    pub length_squared: f32,
    /// `G2 / (2 cos_o)`.
    pub masking: f32,
    /// `G1 / (2 cos_o)`, over the share of normals that are drawn.
    pub visible: f32,
}

impl Ggx {
    /// `alpha` in (0, 1], `wo.z` > 0. If the surface only `reflects`, fewer normals are drawn that would send light below the horizon.
    #[inline(always)]
    pub fn new(alpha: f32, wo: Vec3, reflects: bool) -> Self {
        let reach = reach(alpha, wo);
        let bound = if reflects { bound(alpha, wo) } else { 1.0 };
        let sum = bound * wo.z + reach;
        let both = num::recip(reach * sum);
        let stretched = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z) * (both * sum);
        Self { alpha, wo, reach, stretched, bound, inv_sum: both * reach }
    }

    /// Distribution and masking for light from `wi`, on either side, and the normal `n` of any length, `n.z` > 0.
    #[inline(always)]
    pub fn facet(&self, wi: Vec3, n: Vec3) -> Facet {
        let cos_i = num::abs(wi.z);
        let q = (n.x * n.x + n.y * n.y) + self.alpha * self.alpha * (n.z * n.z);
        let w = cos_i * self.reach + self.wo.z * reach(self.alpha, wi);
        // one division for 1 / q and 1 / w
        let both = num::recip(q * w);
        let peak = self.alpha * (both * w);
        let length_squared = dot(n, n);
        Facet {
            density: peak * peak * (length_squared * num::INV_PI),
            length_squared,
            masking: cos_i * (both * q),
            visible: self.inv_sum,
        }
    }

    /// A unit normal that is visible from `wo`, with density `2 visible D (wo.n)` per steradian; `u` in [0, 1)^2.
    ///
    /// Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps": a direction uniform on the cap that
    /// the stretched viewer's mirror image can reach; normals are half way. Eto and Tokuyoshi 2023, "Bounded VNDF Sampling for
    /// Smith-GGX Reflections", leave out the lowest part of the cap, which reflects to below the horizon.
    #[inline(always)]
    pub fn sample_normal(&self, u: Vec2) -> Vec3 {
        let w = self.stretched;
        let rise = 1.0 + self.bound * w.z;
        let down = u.x * rise;
        let up = (1.0 - u.x) * rise + self.left_out();
        // z = up - w.z; 1 - z = u.x rise, 1 + z = 2 - u.x rise
        let r = num::sqrt(num::max(down * (2.0 - down), 0.0));
        let (sin, cos) = num::sin_cos(u.y);
        let half = Vec3::new(r * cos + w.x, r * sin + w.y, up);
        normalize(Vec3::new(self.alpha * half.x, self.alpha * half.y, half.z))
    }

    /// The `u` of which [`Self::sample_normal`] makes the direction of `n`, whose length does not matter; the second
    /// number is `azimuth` if any would do.
    #[inline(always)]
    pub fn invert_normal(&self, n: Vec3, azimuth: f32) -> Vec2 {
        let w = self.stretched;
        let half = normalize(Vec3::new(n.x, n.y, self.alpha * n.z));
        let reach = 2.0 * dot(half, w);
        let (x, y) = (reach * half.x - w.x, reach * half.y - w.y);
        let turn = num::atan2(y, x);
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let up = num::div(reach * half.z - self.left_out(), 1.0 + self.bound * w.z);
        Vec2::new(1.0 - up, if (x == 0.0) & (y == 0.0) { azimuth } else { turn })
    }

    /// How much of the cap's height is left out.
    #[inline(always)]
    fn left_out(&self) -> f32 {
        (1.0 - self.bound) * self.stretched.z
    }
}

/// k of Eto and Tokuyoshi 2023, eq. 5: `(1 - alpha^2) s^2 / (s^2 + alpha^2 wo.z^2)` with `s = 1 + sin_o`.
#[inline(always)]
fn bound(alpha: f32, wo: Vec3) -> f32 {
    let alpha_squared = alpha * alpha;
    let s = 1.0 + num::sqrt(wo.x * wo.x + wo.y * wo.y);
    let squared = s * s;
    num::div((1.0 - alpha_squared) * squared, squared + alpha_squared * (wo.z * wo.z))
}

/// r(v).
#[inline(always)]
fn reach(alpha: f32, v: Vec3) -> f32 {
    num::sqrt(alpha * alpha * (v.x * v.x + v.y * v.y) + v.z * v.z)
}
