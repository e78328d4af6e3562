//! How much GGX reflects of light from everywhere, by quadrature: what the fits of the kernels are made from and
//! measured against.

use glam::DVec3;
use std::f64::consts::PI;

/// Nodes along both numbers of the sampling of visible normals; the second one covers half a turn, the other half
/// being its mirror image.
const NODES: [usize; 2] = [512, 192];

/// Directional albedos of single scattering by perfectly reflecting facets, the share that `f0 = f90 = 1` reflects.
#[derive(Clone, Copy, Debug)]
pub struct Reflected {
    /// Of facets that reflect everything: E(cos) in [0, 1].
    pub all: f64,
    /// Of facets that reflect `(1 - o.h)^5`, Schlick's weight.
    pub schlick: f64,
}

/// For a perceptual roughness in (0, 1] and a cosine in (0, 1]: the mean of `G2 / G1` over visible normals (Heitz 2018),
/// drawn as Dupuy and Benyoub 2023 do, with 0 where the light would go below the horizon.
pub fn reflected(roughness: f64, cos: f64) -> Reflected {
    let mut sums = Reflected { all: 0.0, schlick: 0.0 };
    lobe(roughness, cos, |masked, _, oh| {
        sums.all += masked;
        sums.schlick += masked * (1.0 - oh).powi(5);
    });
    sums
}

/// The light of that lobe: for each of many directions its share, its cosine, and that between the viewer and the facet.
pub fn lobe(roughness: f64, cos: f64, mut visit: impl FnMut(f64, f64, f64)) {
    let alpha = roughness * roughness;
    let wo = DVec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let w = DVec3::new(alpha * wo.x, 0.0, wo.z).normalize();
    let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 - c * c).max(0.0) / (c * c)).sqrt() - 1.0);
    let own = 1.0 + lambda(cos);
    let share = 1.0 / (NODES[0] * NODES[1]) as f64;
    for i in 0..NODES[0] {
        let z = 1.0 - (i as f64 + 0.5) / NODES[0] as f64 * (1.0 + w.z);
        let r = (1.0 - z * z).max(0.0).sqrt();
        for j in 0..NODES[1] {
            let (sin, cos) = (PI * (j as f64 + 0.5) / NODES[1] as f64).sin_cos();
            let half = DVec3::new(r * cos + w.x, r * sin, z + w.z);
            let h = DVec3::new(alpha * half.x, alpha * half.y, half.z).normalize();
            let oh = wo.dot(h).clamp(0.0, 1.0);
            let wi = 2.0 * oh * h.z - wo.z;
            if wi > 0.0 {
                visit(share * own / (own + lambda(wi)), wi, oh);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At roughness 1 and normal incidence E is 1 - ln 2.
    #[test]
    fn it_is_the_known_value() {
        let error = reflected(1.0, 1.0).all - (1.0 - 2.0_f64.ln());
        assert!(error.abs() < 1.0e-5, "off by {error:e}");
    }
}
