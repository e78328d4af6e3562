//! The scattering functions of [`restir_shared::bsdf`].

use super::{Axis, Expected, Function, Row};
use crate::bsdf_f64::Shadow;
use glam::{DVec3, Vec3};
use restir_shared::bsdf::{
    Bsdf, BsdfSample, COS_MIN, IOR_MAX, Kind, LOBES, Material, SPECULAR_REFLECTION, SPECULAR_TRANSMISSION,
    is_transmission,
};
use restir_shared::layout::FEATURES_ALL;
use std::f64::consts::TAU;
use std::ops::Range;

/// Plastic, metal, leaf, all at once from outside and inside, glass from outside and inside, a sheet of glass, a sheet
/// of all at once.
const SURFACE: (&str, Axis) = ("surface", Axis::Set(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]));
/// Those with specular reflection and transmission alone.
const SIMPLE: (&str, Axis) = ("surface", Axis::Set(&[5.0, 6.0, 7.0]));
const IOR: (&str, Axis) = ("ior", Axis::Set(&[1.0, 1.000_000_1, 1.02, 1.5, 2.4, IOR_MAX]));
const ROUGH: (&str, Axis) = ("roughness", Axis::Log(0.01, 1.0));
const SMOOTH: (&str, Axis) = ("roughness", Axis::Set(&[0.0, 0.0099]));
const COS_O: (&str, Axis) = ("cos_o", Axis::Log(COS_MIN, 1.0));
const COS_I: (&str, Axis) = ("cos_i", Axis::Log(COS_MIN, 1.0));
const SIDE: (&str, Axis) = ("side", Axis::Set(&[-1.0, 1.0]));
const TURN: (&str, Axis) = ("turn", Axis::Set(&[0.0, 0.1, 0.5, 0.6, 0.600_01, 0.9]));
const U: (&str, Axis) = ("u", Axis::Coarse);
const V: (&str, Axis) = ("v", Axis::Coarse);
const LOBE: (&str, Axis) = ("lobe", Axis::Coarse);
const CHOICE: (&str, Axis) = ("choice", Axis::Coarse);

/// Above [`restir_shared::bsdf::markers::DELTA`] over the least share that a lobe has of the choice.
const RARE: f32 = 1.0e-5;
/// The viewer's azimuth in turns.
const AZIMUTH: f64 = 0.1;

pub(super) fn rows() -> Vec<Row> {
    let given = [SURFACE, IOR, ROUGH, COS_O, SIDE, COS_I, TURN];
    let length = Function::new("Bsdf::sample, length", &drawn(SURFACE, ROUGH), |p| {
        [sample(p).direction.as_dvec3().length() as f32]
    })
    .against(|_| [Expected::relative(1.0)]);
    vec![
        Function::new("Bsdf::evaluate_lobe", &given, values).against(exact_values).near(DIRECTIONS).of(to_given),
        near("Bsdf::evaluate_lobe, sampled", &drawn(SURFACE, ROUGH), values, exact_values),
        near("Bsdf::evaluate_lobe, density", &drawn(SIMPLE, ROUGH), density, exact_density),
        near("Bsdf::sample, weight x density", &drawn(SURFACE, ROUGH), energy, exact_energy),
        near("Bsdf::sample of a delta", &drawn(SURFACE, SMOOTH), energy, exact_energy),
        // leaving a dense medium multiplies the relative error of the sine by the index, twice
        Row { tolerance: 2.0e-5, ..length.of(to_sampled) },
    ]
}

/// A function of sampled directions, which are rounded.
fn near(
    name: &'static str,
    axes: &[(&'static str, Axis)],
    function: fn(&[f32]) -> Vec<f32>,
    shadow: fn(&[f64]) -> Vec<Expected>,
) -> Row {
    Function::new(name, axes, function).against(shadow).near(DIRECTIONS).of(to_sampled)
}

fn drawn(surface: (&'static str, Axis), roughness: (&'static str, Axis)) -> [(&'static str, Axis); 8] {
    [surface, IOR, roughness, COS_O, U, V, LOBE, CHOICE]
}

/// A surface by its number, and whether it is seen from outside.
fn surface(p: &[f32]) -> (Material, bool) {
    let base = Material { ior: p[1], roughness: p[2], ..Material::diffuse(Vec3::new(0.9, 0.6, 0.2)) };
    let green = Vec3::new(0.3, 0.7, 0.2);
    let leaf = Material { diffuse_transmission: 0.4, diffuse_transmission_color: green, ..base };
    let everything = Material { metallic: 0.3, transmission: 0.5, ..leaf };
    let glass = Material { transmission: 1.0, ..base };
    match p[0] as u32 {
        0 => (base, true),
        1 => (Material { metallic: 1.0, ..base }, true),
        2 => (leaf, true),
        3 => (everything, true),
        4 => (everything, false),
        5 => (glass, true),
        6 => (glass, false),
        7 => (Material { thin: true, ..glass }, true),
        _ => (Material { thin: true, ..everything }, true),
    }
}

/// A unit vector, as near as `f32` allows.
fn direction(cos: f32, turn: f64) -> Vec3 {
    let z = f64::from(cos);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (y, x) = (TAU * turn).sin_cos();
    Vec3::new((r * x) as f32, (r * y) as f32, cos)
}

// arguments: surface, index, roughness, viewer, light, whether cosines are large enough; of samples also random numbers,
// lobe, and whether the kernel kept the sample

/// The viewer and the light: unit vectors but for rounding.
const DIRECTIONS: Range<usize> = 3..9;
const SEEN: usize = 9;
const NUMBERS: Range<usize> = 10..14;
const DRAWN_LOBE: usize = 14;
const KEPT: usize = 15;

fn viewed(p: &[f32]) -> Vec<f32> {
    [&p[..3], &direction(p[3], AZIMUTH).to_array()].concat()
}

fn to_given(p: &[f32]) -> Vec<f32> {
    lit(&viewed(p), direction(p[4] * p[5], f64::from(p[6])))
}

fn to_sampled(p: &[f32]) -> Vec<f32> {
    let (viewed, words) = (viewed(p), &p[4..8]);
    let BsdfSample { direction, lobe, pdf, .. } = draw(&viewed, words);
    [&lit(&viewed, direction), words, &[lobe as f32, f32::from(u8::from(pdf > 0.0))]].concat()
}

fn lit(viewed: &[f32], wi: Vec3) -> Vec<f32> {
    let seen = viewed[5].min(wi.z.abs()) >= COS_MIN;
    [viewed, &wi.to_array(), &[f32::from(u8::from(seen))]].concat()
}

fn bsdf(p: &[f32]) -> Bsdf {
    let (material, front) = surface(p);
    Bsdf::new(&material, Vec3::from_slice(&p[3..]), front, FEATURES_ALL)
}

fn draw(viewed: &[f32], words: &[f32]) -> BsdfSample {
    let word = |i: usize| ((words[i] * 16_777_216.0) as u32) << 8;
    bsdf(viewed).sample([0, 1, 2, 3].map(word).into())
}

fn sample(p: &[f32]) -> BsdfSample {
    draw(p, &p[NUMBERS])
}

// the kernels' functions

/// Diffuse and specular value on the side of the light.
fn values(p: &[f32]) -> Vec<f32> {
    let (bsdf, wi) = (bsdf(p), Vec3::from_slice(&p[6..]));
    (0..LOBES).flat_map(|lobe| bsdf.evaluate_lobe(lobe, wi).value.to_array()).collect()
}

fn density(p: &[f32]) -> Vec<f32> {
    vec![bsdf(p).evaluate(Vec3::from_slice(&p[6..])).pdf]
}

fn energy(p: &[f32]) -> Vec<f32> {
    let sample = sample(p);
    let energy = (sample.weight * sample.pdf).to_array();
    if sample.delta { [energy, sample.direction.to_array()].concat() } else { energy.to_vec() }
}

// the shadow

/// One input of the shadow. Directions may have been moved; decisions depend on all else, which is as it was.
struct Case {
    arguments: Vec<f32>,
    bsdf: Bsdf,
    shadow: Shadow,
    wi: DVec3,
}

impl Case {
    fn new(p: &[f64]) -> Self {
        let arguments: Vec<f32> = p.iter().map(|&x| x as f32).collect();
        let (wo, wi) = (DVec3::from_slice(&p[3..]), DVec3::from_slice(&p[6..]));
        let ((material, front), bsdf) = (surface(&arguments), bsdf(&arguments));
        Self { shadow: Shadow::new(&material, wo.as_vec3(), front, true).seen_from(wo), arguments, bsdf, wi }
    }

    fn seen(&self) -> bool {
        self.arguments[SEEN] > 0.0
    }

    fn is_delta(&self, lobe: u32) -> bool {
        self.bsdf.kind(lobe) == Kind::Delta
    }

    /// Value of a lobe; of a delta nothing.
    fn value(&self, lobe: u32) -> DVec3 {
        if self.seen() & !self.is_delta(lobe) { self.shadow.value(lobe, self.wi) } else { DVec3::ZERO }
    }
}

/// A colour, relative to its largest component.
fn color(value: DVec3) -> [Expected; 3] {
    value.to_array().map(|component| Expected::against(component, value.abs().max_element()))
}

fn exact_values(p: &[f64]) -> Vec<Expected> {
    let case = Case::new(p);
    (0..LOBES).flat_map(|lobe| color(case.value(lobe))).collect()
}

/// The surfaces have one lobe on either side, chosen by Fresnel's reflectance if there are two.
fn exact_density(p: &[f64]) -> Vec<Expected> {
    let case = Case::new(p);
    let (shadow, through) = (&case.shadow, case.wi.z < 0.0);
    let lobe = if through { SPECULAR_TRANSMISSION } else { SPECULAR_REFLECTION };
    if !case.seen() || case.is_delta(lobe) {
        return vec![Expected::relative(0.0)];
    }
    let reflected = if shadow.clear_share() == 0.0 {
        1.0
    } else if case.is_delta(SPECULAR_TRANSMISSION) {
        // the choice comes before the normal
        let cos = shadow.cos_o();
        if shadow.dielectric(cos) == 1.0 { 1.0 } else { shadow.coat(cos).x }
    } else {
        shadow.fresnel(case.wi)
    };
    let choice = if through { 1.0 - reflected } else { reflected };
    vec![Expected::relative(shadow.pdf(lobe, case.wi) * choice)]
}

fn exact_energy(p: &[f64]) -> Vec<Expected> {
    let case = Case::new(p);
    let lobe = case.arguments[DRAWN_LOBE] as u32;
    if case.is_delta(lobe) {
        return exact_delta(&case, lobe);
    }
    // what a facet sends to the wrong side counts as absorbed
    let kept = is_transmission(lobe) == (case.wi.z < 0.0);
    color(if kept { (0..LOBES).map(|lobe| case.value(lobe)).sum() } else { DVec3::ZERO }).to_vec()
}

/// Energy and direction by the laws of reflection and refraction.
fn exact_delta(case: &Case, lobe: u32) -> Vec<Expected> {
    let ((material, front), shadow) = (surface(&case.arguments), &case.shadow);
    let (through, wo) = (is_transmission(lobe), shadow.viewer());
    let ior = f64::from(material.ior);
    let n = match (material.thin, front) {
        (true, _) => 1.0,
        (false, true) => ior,
        (false, false) => 1.0 / ior,
    };
    let energy = if through {
        material.base_color.as_dvec3() * (shadow.clear_share() / (n * n) * (1.0 - shadow.dielectric(wo.z)))
    } else {
        shadow.reflectance(wo.z)
    };
    let direction = match (through, material.thin) {
        (false, _) => DVec3::new(-wo.x, -wo.y, wo.z),
        (true, true) => -wo,
        (true, false) => {
            let cos_t2 = 1.0 - (1.0 - wo.z * wo.z) / (n * n);
            DVec3::new(-wo.x / n, -wo.y / n, -cos_t2.max(0.0).sqrt())
        }
    };
    // one that is as good as never drawn may be dropped
    let choice = case.arguments[NUMBERS.end - 1];
    let rare = choice.min(1.0 - choice) < RARE;
    let kept = case.seen() && (!rare || case.arguments[KEPT] > 0.0);
    let place = direction.to_array().map(|x| Expected::against(x, 1.0));
    [color(if kept { energy } else { DVec3::ZERO }), place].concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::{Effort, Finding};

    fn run(function: fn(&[f32]) -> Vec<f32>, shadow: fn(&[f64]) -> Vec<Expected>) -> Finding {
        near("", &drawn(SURFACE, ROUGH), function, shadow).run(Effort::Reduced)
    }

    fn scaled(p: &[f32], factor: f32) -> Vec<f32> {
        values(p).into_iter().map(|x| x * factor).collect()
    }

    /// Values off by two parts in 10^5, and light that is lost at one end of the random numbers.
    #[test]
    fn wrong_ones_fail() {
        let (off, double) = (run(|p| scaled(p, 1.000_02), exact_values), run(|p| scaled(p, 2.0), exact_values));
        assert!(off.failures * 4 > double.failures * 3 && !off.passed(), "{off:?} {double:?}");
        let lost = |p: &[f32]| if p[NUMBERS.start] == 0.0 { vec![0.0; 3] } else { energy(p) };
        assert!(!run(lost, exact_energy).passed());
    }

    /// Where light is reflected from outside and far from the horizon, roundings of the directions explain nothing.
    #[test]
    fn small_errors_fail_where_values_are_well_conditioned() {
        fn scaled_there(p: &[f32], factor: f32) -> Vec<f32> {
            let outside = (p[0] != 4.0) & (p[0] != 6.0);
            let there = outside & (p[1] == 1.5) & (p[2] > 0.2) & (p[5] > 0.5) & (p[8] > 0.5);
            scaled(p, if there { factor } else { 1.0 })
        }
        let off = run(|p| scaled_there(p, 1.000_02), exact_values);
        let double = run(|p| scaled_there(p, 2.0), exact_values);
        assert!(off.failures > 500 && off.failures == double.failures, "{off:?} {double:?}");
    }
}
