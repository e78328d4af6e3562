//! The scattering functions again in `f64`, straight from the formulas of the papers: angles, Snell's law and unit
//! normals where the kernels rearrange, Heitz's polar map of visible normals where they use spherical caps, and solid
//! angles by numerical differentiation where they have closed forms.

use glam::DVec3;
use restir_shared::bsdf::albedo::fit;
use restir_shared::bsdf::{DELTA_BELOW, Material, is_specular, is_transmission};
use std::f64::consts::{PI, TAU};

/// The golden ratio less 1.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Step of the central differences in [`Shadow::solid_angle`].
const STEP: f64 = 1.0e-6;

/// A material seen from `wo`, as [`restir_shared::bsdf`] documents it. Specular lobes are rough here; perfect ones are
/// for their tests to compute.
#[derive(Clone, Copy, Debug)]
pub struct Shadow {
    wo: DVec3,
    base: DVec3,
    through_color: DVec3,
    metallic: f64,
    alpha: f64,
    roughness: f64,
    ior: f64,
    /// Factor and colour of the coat's reflection.
    specular: f64,
    specular_color: DVec3,
    /// Light that specular lobes lose comes back.
    multiscatter: bool,
    transmission: f64,
    diffuse_transmission: f64,
    /// Indices on the side of the viewer and on the other one.
    indices: [f64; 2],
    thin: bool,
}

impl Shadow {
    /// The same inputs as the kernels', exactly.
    pub fn new(material: &Material, wo: glam::Vec3, front: bool, multiscatter: bool) -> Self {
        let ior = f64::from(material.ior);
        Self {
            wo: wo.as_dvec3(),
            base: material.base_color.as_dvec3(),
            through_color: material.diffuse_transmission_color.as_dvec3(),
            metallic: f64::from(material.metallic),
            alpha: f64::from(material.roughness).powi(2),
            roughness: f64::from(material.roughness),
            ior,
            specular: f64::from(material.specular),
            specular_color: material.specular_color.as_dvec3(),
            multiscatter,
            transmission: f64::from(material.transmission),
            diffuse_transmission: f64::from(material.diffuse_transmission),
            indices: if front || material.thin { [1.0, ior] } else { [ior, 1.0] },
            thin: material.thin,
        }
    }

    /// The same from a viewer that is no `f32`.
    #[must_use]
    pub fn seen_from(self, wo: DVec3) -> Self {
        Self { wo, ..self }
    }

    /// Width of the distribution of normals.
    pub(crate) fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Direction to the viewer.
    pub fn viewer(&self) -> DVec3 {
        self.wo
    }

    /// Cosine of the viewer.
    pub fn cos_o(&self) -> f64 {
        self.wo.z
    }

    /// T of the model.
    pub fn clear_share(&self) -> f64 {
        (1.0 - self.metallic) * self.transmission
    }

    fn opaque_share(&self) -> f64 {
        (1.0 - self.metallic) * (1.0 - self.transmission)
    }

    /// `f |cos_i|` of one lobe for light from `wi`.
    pub fn value(&self, lobe: u32, wi: DVec3) -> DVec3 {
        if is_transmission(lobe) != (wi.z < 0.0) {
            return DVec3::ZERO;
        }
        if is_specular(lobe) { self.specular(wi) } else { self.diffuse(wi) }
    }

    /// Schlick's reflectance of the coat.
    pub fn coat(&self, cos: f64) -> DVec3 {
        if self.ior == 1.0 {
            return DVec3::ZERO;
        }
        let f0 = self.coat_f0();
        f0 + (DVec3::splat(self.specular) - f0) * (1.0 - cos).max(0.0).powi(5)
    }

    fn coat_f0(&self) -> DVec3 {
        let f0 = ((self.ior - 1.0) / (self.ior + 1.0)).powi(2);
        (self.specular_color * f0).min(DVec3::ONE) * self.specular
    }

    fn diffuse(&self, wi: DVec3) -> DVec3 {
        let d = self.diffuse_transmission;
        let color = if wi.z < 0.0 { self.through_color * d } else { self.base * (1.0 - d) };
        let (co, ci) = (self.wo.z, wi.z.abs());
        color * (self.opaque_share() * self.coupling(co, ci) * ci / PI)
    }

    fn coupling(&self, co: f64, ci: f64) -> f64 {
        if !self.multiscatter {
            return (1.0 - self.coat(co).max_element()) * (1.0 - self.coat(ci).max_element());
        }
        if self.ior == 1.0 {
            return 1.0;
        }
        let (f0, f90) = (self.coat_f0().max_element(), self.specular);
        let clear = |Losses { all, schlick }: Losses| 1.0 - f0 * (1.0 - all) - (f90 - f0) * (1.0 - schlick);
        clear(Losses::at(self.roughness, co)) * clear(Losses::at(self.roughness, ci))
            / clear(Losses::mean(self.roughness))
    }

    /// What metal reflects more than once, over what it reflects once.
    fn interreflected(&self, ci: f64) -> DVec3 {
        if !self.multiscatter || self.roughness < f64::from(DELTA_BELOW) {
            return DVec3::ZERO;
        }
        let lost = Losses::mean(self.roughness).all;
        let mean = self.base + (DVec3::ONE - self.base) / 21.0;
        let color = mean * (1.0 - lost) / (DVec3::ONE - mean * lost);
        color * (gain(self.roughness, self.wo.z) * gain(self.roughness, ci) - 1.0)
    }

    fn specular(&self, wi: DVec3) -> DVec3 {
        let h = self.normal(wi);
        let ih = wi.dot(h);
        let g = 1.0 / (1.0 + self.lambda(self.wo) + self.lambda(wi));
        let d = self.distribution(h);
        let (co, ci) = (self.wo.z, wi.z.abs());
        if wi.z > 0.0 || self.thin {
            let factor = d * g / (4.0 * co * ci) * ci;
            let oh = self.cosine(wi);
            let through = self.base * (self.clear_share() * (1.0 - self.dielectric(oh)));
            let metal = self.metal(oh) * (DVec3::ONE + self.interreflected(ci));
            return if wi.z > 0.0 { metal + self.dielectric_part(oh) } else { through } * factor;
        }
        let oh = self.wo.dot(h);
        if h.z <= 0.0 || oh <= 0.0 || ih >= 0.0 {
            return DVec3::ZERO;
        }
        let [no, ni] = self.indices;
        let f = (ih * oh).abs() / (co * ci) * no * no * g * d / (ni * ih + no * oh).powi(2);
        self.base * (self.clear_share() * (1.0 - self.fresnel(wi)) * f * ci)
    }

    /// Density of directions that mirror the viewer at visible normals.
    pub fn mirrored_pdf(&self, wi: DVec3) -> f64 {
        0.25 * self.distribution(self.normal(wi)) / (self.wo.z * (1.0 + self.lambda(self.wo)))
    }

    /// k of Eto and Tokuyoshi 2023, eq. 5.
    pub(crate) fn bound(&self) -> f64 {
        let (a2, s) = (self.alpha * self.alpha, 1.0 + self.wo.x.hypot(self.wo.y));
        (1.0 - a2) * s * s / (s * s + a2 * self.wo.z * self.wo.z)
    }

    /// Density of directions given the specular lobe and its choice: visible normals (Heitz 2018, eq. 2), where nothing is
    /// transmitted only some (Eto and Tokuyoshi 2023, eq. 8), and the change of variables of Walter et al. 2007, eqs. 14 and 17.
    pub fn pdf(&self, lobe: u32, wi: DVec3) -> f64 {
        let h = self.normal(wi);
        if self.clear_share() == 0.0 {
            return 0.25 * self.distribution(h) / (self.wo.z * (0.5 * (1.0 + self.bound()) + self.lambda(self.wo)));
        }
        let visible = self.distribution(h) / (self.wo.z * (1.0 + self.lambda(self.wo)));
        if !is_transmission(lobe) || self.thin {
            return self.mirrored_pdf(wi);
        }
        let ([no, ni], oh, ih) = (self.indices, self.wo.dot(h), wi.dot(h));
        if h.z <= 0.0 || oh <= 0.0 || ih >= 0.0 {
            return 0.0;
        }
        visible * oh * ni * ni * ih.abs() / (ni * ih + no * oh).powi(2)
    }

    /// F at the facet that takes light from `wi` to `wo`. Of refraction both cosines are known: near total reflection they
    /// tell more than one of them and Snell's law.
    pub fn fresnel(&self, wi: DVec3) -> f64 {
        if wi.z >= 0.0 || self.thin {
            return self.dielectric(self.cosine(wi));
        }
        let h = self.normal(wi);
        reflectance(self.indices[1] / self.indices[0], self.wo.dot(h), -wi.dot(h))
    }

    /// The cosine between `wo` and the normal of a reflection: half of |o + i|, which is o.h for unit vectors.
    pub fn cosine(&self, wi: DVec3) -> f64 {
        0.5 * (self.wo + DVec3::new(wi.x, wi.y, wi.z.abs())).length()
    }

    /// What all specular parts reflect at a normal, once.
    pub fn reflectance(&self, oh: f64) -> DVec3 {
        self.metal(oh) + self.dielectric_part(oh)
    }

    fn metal(&self, oh: f64) -> DVec3 {
        (self.base + (DVec3::ONE - self.base) * (1.0 - oh).max(0.0).powi(5)) * self.metallic
    }

    fn dielectric_part(&self, oh: f64) -> DVec3 {
        self.coat(oh) * self.opaque_share() + DVec3::splat(self.clear_share() * self.dielectric(oh))
    }

    /// Fresnel's equations for unpolarised light that comes from the viewer's side.
    pub fn dielectric(&self, cos: f64) -> f64 {
        let n = self.indices[1] / self.indices[0];
        // n^2 cos_t^2, without the cancellation of 1 - sin^2 at grazing angles
        let bent = (n - 1.0) * (n + 1.0) + cos * cos;
        if bent <= 0.0 { 1.0 } else { reflectance(n, cos, bent.sqrt() / n) }
    }

    /// The unit normal between `wo` and `wi`.
    fn normal(&self, wi: DVec3) -> DVec3 {
        let n = if wi.z >= 0.0 {
            self.wo + wi
        } else if self.thin {
            self.wo + DVec3::new(wi.x, wi.y, -wi.z)
        } else {
            (self.wo * self.indices[0] + wi * self.indices[1]) * (self.indices[0] - self.indices[1]).signum()
        };
        n.normalize()
    }

    fn distribution(&self, h: DVec3) -> f64 {
        let tan2 = (h.x * h.x + h.y * h.y) / (h.z * h.z);
        let a2 = self.alpha * self.alpha;
        1.0 / (PI * a2 * h.z.powi(4) * (1.0 + tan2 / a2).powi(2))
    }

    fn lambda(&self, v: DVec3) -> f64 {
        let tan2 = (v.x * v.x + v.y * v.y) / (v.z * v.z);
        0.5 * ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0)
    }

    /// The frame of Heitz 2018: the stretched viewer and two vectors across, the first of them horizontal.
    pub fn frame(&self) -> [DVec3; 3] {
        let w = DVec3::new(self.alpha * self.wo.x, self.alpha * self.wo.y, self.wo.z).normalize();
        let across = DVec3::new(-w.y, w.x, 0.0);
        let t1 = if across.length() > 0.0 { across.normalize() } else { DVec3::X };
        [t1, w.cross(t1), w]
    }

    /// A direction of the lobe for a point of the unit square: cosine-weighted, or about the visible normals of Heitz
    /// 2018, "Sampling the GGX Distribution of Visible Normals". None if total reflection leaves none; below the
    /// horizon there are some.
    pub fn direction(&self, lobe: u32, u: [f64; 2]) -> Option<DVec3> {
        self.direction_in(lobe, u, self.frame())
    }

    /// [`Self::direction`] with another frame, for wrong ones.
    pub fn direction_in(&self, lobe: u32, [a, b]: [f64; 2], [t1, t2, w]: [DVec3; 3]) -> Option<DVec3> {
        let r = a.sqrt();
        let (y, x) = (TAU * b).sin_cos();
        let side = if is_transmission(lobe) { -1.0 } else { 1.0 };
        if !is_specular(lobe) {
            return Some(DVec3::new(r * x, r * y, side * (1.0 - a).sqrt()));
        }
        let p1 = r * x;
        let s = 0.5 * (1.0 + w.z);
        let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * r * y;
        let n = t1 * p1 + t2 * p2 + w * (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt();
        self.scatter(lobe, DVec3::new(self.alpha * n.x, self.alpha * n.y, n.z).normalize())
    }

    /// What becomes of light from the viewer at a facet.
    fn scatter(&self, lobe: u32, h: DVec3) -> Option<DVec3> {
        let oh = self.wo.dot(h);
        let mirrored = h * (2.0 * oh) - self.wo;
        if !is_transmission(lobe) {
            return Some(mirrored);
        }
        if self.thin {
            return Some(DVec3::new(mirrored.x, mirrored.y, -mirrored.z));
        }
        // Snell's law
        let n = self.indices[1] / self.indices[0];
        let cos_t2 = 1.0 - (1.0 - oh * oh) / (n * n);
        (cos_t2 > 0.0).then(|| h * (oh / n - cos_t2.sqrt()) - self.wo / n)
    }

    /// The point of the unit square that [`Self::direction`] maps to `wi`.
    pub fn coordinates(&self, lobe: u32, wi: DVec3) -> [f64; 2] {
        let turn = |y: f64, x: f64| (y.atan2(x) / TAU).rem_euclid(1.0);
        if !is_specular(lobe) {
            return [wi.x * wi.x + wi.y * wi.y, turn(wi.y, wi.x)];
        }
        let h = self.normal(wi);
        let n = DVec3::new(h.x / self.alpha, h.y / self.alpha, h.z).normalize();
        let [t1, t2, w] = self.frame();
        let s = 0.5 * (1.0 + w.z);
        let p1 = n.dot(t1);
        let p2 = (n.dot(t2) - (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt()) / s;
        [p1 * p1 + p2 * p2, turn(p2, p1)]
    }

    /// Solid angle per area of the unit square at `u`, by central differences; zero where the map is not defined.
    pub fn solid_angle(&self, lobe: u32, [a, b]: [f64; 2]) -> f64 {
        let at = |x: f64, y: f64| self.direction(lobe, [x, y]);
        match (at(a + STEP, b), at(a - STEP, b), at(a, b + STEP), at(a, b - STEP)) {
            (Some(right), Some(left), Some(up), Some(down)) => {
                (right - left).cross(up - down).length() / (4.0 * STEP * STEP)
            }
            _ => 0.0,
        }
    }

    /// Directions of a lobe and their solid angles, for sums that are integrals: `n` points of a lattice over the part of
    /// the unit square from `lo` to `hi`. Directions on the wrong side count for nothing.
    pub fn nodes(&self, lobe: u32, lo: [f64; 2], hi: [f64; 2], n: usize) -> impl Iterator<Item = (DVec3, f64)> {
        let size = [hi[0] - lo[0], hi[1] - lo[1]];
        let area = size[0] * size[1] / n as f64;
        (0..n).filter_map(move |i| {
            let at = i as f64 + 0.5;
            let u = [lo[0] + size[0] * (at / n as f64), lo[1] + size[1] * (at * GOLDEN).fract()];
            let wi = self.direction(lobe, u).filter(|wi| (wi.z < 0.0) == is_transmission(lobe))?;
            Some((wi, self.solid_angle(lobe, u) * area))
        })
    }

    /// The integral of a function over the directions of a lobe.
    pub fn integrate(&self, lobe: u32, n: usize, f: impl Fn(DVec3) -> DVec3) -> DVec3 {
        self.nodes(lobe, [0.0; 2], [1.0; 2], n).map(|(wi, solid_angle)| f(wi) * solid_angle).sum()
    }

    /// Directional albedo of a lobe.
    pub fn albedo(&self, lobe: u32, n: usize) -> DVec3 {
        self.integrate(lobe, n, |wi| self.value(lobe, wi))
    }
}

/// What facets lose that reflect everything, and that reflect Schlick's weight: the fits of the kernels in `f64`.
#[derive(Clone, Copy)]
struct Losses {
    all: f64,
    schlick: f64,
}

impl Losses {
    fn at(roughness: f64, cos: f64) -> Self {
        let (s, p, alpha) = stretched(roughness, cos);
        let all = (s * quotient(&fit::LOST, s, p, alpha)).clamp(0.0, 1.0);
        let basis = [1.0, s, cos, cos * cos, s * cos];
        let h: f64 = basis.iter().zip(&fit::SCHLICK).map(|(b, row)| b * at(row, roughness)).sum();
        let facet = (cos + alpha * p * h).clamp(0.0, 1.0);
        Self { all, schlick: 1.0 - (1.0 - all) * (1.0 - facet).powi(5) }
    }

    fn mean(roughness: f64) -> Self {
        let all = (roughness * roughness * at(&fit::MEAN_LOST, roughness)).max(0.0);
        Self { all, schlick: at(&fit::MEAN_SCHLICK, roughness) }
    }
}

/// What scales white metal to an albedo of 1, for each of the two directions.
fn gain(roughness: f64, cos: f64) -> f64 {
    let (s, p, alpha) = stretched(roughness, cos);
    1.0 + quotient(&fit::BALANCE, s, p, alpha)
}

/// The cosine and the sine in the space where the distribution of normals is uniform, and alpha.
fn stretched(roughness: f64, cos: f64) -> (f64, f64, f64) {
    let alpha = roughness * roughness;
    let sine2 = (1.0 - cos * cos).max(0.0);
    let reach = (alpha * alpha * sine2 + cos * cos).sqrt();
    (cos / reach, alpha * sine2.sqrt() / reach, alpha)
}

fn quotient(rows: &[[f32; 4]; 7], s: f64, p: f64, alpha: f64) -> f64 {
    let part = |rows: &[[f32; 4]]| polynomial(&rows.iter().map(|row| at(row, alpha)).collect::<Vec<_>>(), s);
    (p * p * part(&rows[..2]) + alpha * alpha * part(&rows[2..4])) / (1.0 + s * part(&rows[4..]))
}

fn at(coefficients: &[f32], x: f64) -> f64 {
    polynomial(&coefficients.iter().map(|&c| f64::from(c)).collect::<Vec<_>>(), x)
}

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Fresnel's equations for a relative index and the cosines on both sides.
fn reflectance(n: f64, cos: f64, cos_t: f64) -> f64 {
    let s = (cos - n * cos_t) / (cos + n * cos_t);
    let p = (n * cos - cos_t) / (n * cos + cos_t);
    0.5 * (s * s + p * p)
}
