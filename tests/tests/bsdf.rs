//! Scattering functions: densities, inverses, reciprocity, energy, and all values against an independent `f64` shadow.
//! Seeds are fixed. The chi-square tests together raise a false alarm with probability [`FAMILY_RATE`]; the others
//! are deterministic, with tolerances stated where they are used.

use glam::{DVec3, UVec4, Vec3};
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_shared::bsdf::{
    Bsdf, BsdfSample, COS_MIN, DELTA_BELOW, Evaluation, IOR_MAX, Kind, LOBES, Material, SPECULAR_REFLECTION,
    SPECULAR_TRANSMISSION, is_specular, is_transmission,
};
use restir_shared::layout::FEATURES_ALL;
use restir_shared::rng::{self, pcg4d};
use restir_tests::bsdf_f64::Shadow;
use restir_tests::stats::{chi_square, sidak};
use restir_tests::suite::ensure;
use std::f64::consts::PI;

const FAMILY_RATE: f64 = 1.0e-3;
const ROUGHNESSES: [f32; 6] = [0.02, 0.05, 0.1, 0.3, 0.6, 1.0];
/// Half the distance between 1 and its neighbour, the error of one rounding.
const ROUNDING: f64 = 1.0 / 16_777_216.0;
const COSINES: [f32; 5] = [1.0, 0.7, 0.3, 0.05, 0.005];

restir_tests::suite! {
    samples_follow_the_density a_wrong_frame_of_visible_normals_is_seen a_missing_jacobian_is_seen
    densities_and_albedos_integrate values_equal_the_shadow samples_invert scattering_is_reciprocal
    no_energy_is_gained gltf_mixing_gains_energy smooth_dielectrics_keep_all_energy lobes_add_up
    features_change_no_bit extremes_are_finite
}

/// A surface and the side it is seen from.
#[derive(Clone, Copy)]
struct Surface {
    name: &'static str,
    material: Material,
    front: bool,
}

/// A surface of some roughness, seen at some angle.
#[derive(Clone, Copy)]
struct Setting {
    surface: Surface,
    wo: Vec3,
    /// Of random numbers.
    stream: u32,
}

impl Setting {
    fn new(surface: Surface, roughness: f32, cos: f32, stream: u32) -> Self {
        let material = Material { roughness, ..surface.material };
        Self { surface: Surface { material, ..surface }, wo: direction(cos, 0.1), stream }
    }

    fn bsdf(&self) -> Bsdf {
        Bsdf::new(&self.surface.material, self.wo, self.surface.front, FEATURES_ALL)
    }

    fn shadow(&self) -> Shadow {
        Shadow::new(&self.surface.material, self.wo, self.surface.front)
    }

    fn name(&self) -> String {
        let Surface { name, material, front } = self.surface;
        let side = if front { "" } else { " from inside" };
        format!("{name}{side}, ior {}, roughness {}, cos {}", material.ior, material.roughness, self.wo.z)
    }

    /// Lobes that [`Shadow`] knows: those that contribute and are not deltas.
    fn lobes(&self) -> Vec<u32> {
        let bsdf = self.bsdf();
        (0..LOBES).filter(|&lobe| bsdf.selection(lobe) > 0.0 && bsdf.kind(lobe) != Kind::Delta).collect()
    }
}

/// A unit vector, as near as `f32` allows.
fn direction(cos: f32, turn: f64) -> Vec3 {
    let z = f64::from(cos);
    let r = (1.0 - z * z).sqrt();
    let (y, x) = (turn * 2.0 * PI).sin_cos();
    Vec3::new((r * x) as f32, (r * y) as f32, cos)
}

fn plastic(ior: f32) -> Material {
    Material { ior, ..Material::diffuse(Vec3::new(0.8, 0.5, 0.2)) }
}

fn metal() -> Material {
    Material { metallic: 1.0, ..Material::diffuse(Vec3::new(1.0, 0.78, 0.34)) }
}

fn glass(ior: f32) -> Material {
    Material { ior, transmission: 1.0, ..Material::diffuse(Vec3::new(0.9, 0.95, 1.0)) }
}

fn leaf() -> Material {
    let color = Vec3::new(0.3, 0.7, 0.2);
    Material { diffuse_transmission: 0.4, diffuse_transmission_color: color, ..plastic(1.4) }
}

fn everything() -> Material {
    Material { metallic: 0.3, transmission: 0.5, ..leaf() }
}

fn surfaces() -> Vec<Surface> {
    let front = |name, material| Surface { name, material, front: true };
    let back = |name, material| Surface { name, material, front: false };
    vec![
        front("Lambert", plastic(1.0)),
        front("plastic", plastic(1.1)),
        front("plastic", plastic(1.5)),
        front("plastic", plastic(2.4)),
        front("metal", metal()),
        front("glass", glass(1.1)),
        back("glass", glass(1.1)),
        front("glass", glass(1.5)),
        back("glass", glass(1.5)),
        front("glass", glass(2.4)),
        back("glass", glass(2.4)),
        front("thin glass", Material { thin: true, ..glass(1.5) }),
        front("diffuse transmitter", Material { ior: 1.0, ..leaf() }),
        front("leaf", leaf()),
        front("everything", everything()),
        back("everything", everything()),
    ]
}

/// Every surface with every roughness, if it has a specular lobe, at every angle.
fn settings(surfaces: &[Surface], roughnesses: &[f32], cosines: &[f32]) -> Vec<Setting> {
    let mut settings = Vec::new();
    for &surface in surfaces {
        let material = surface.material;
        let specular = material.ior > 1.0 || material.metallic > 0.0 || material.transmission > 0.0;
        for &roughness in if specular { roughnesses } else { &roughnesses[..1] } {
            for &cos in cosines {
                settings.push(Setting::new(surface, roughness, cos, settings.len() as u32));
            }
        }
    }
    settings
}

/// Random words of a setting; each use has some of its own.
fn random_words(setting: &Setting, purpose: u32) -> impl Fn(u32) -> UVec4 {
    let stream = setting.stream;
    move |i| pcg4d(UVec4::new(i, stream, purpose, 9))
}

/// Points of the four-dimensional cube that fill it evenly: a Kronecker sequence on powers of the root of
/// x^5 = x + 1 (Roberts 2018).
fn even_words(i: u32) -> UVec4 {
    const ROOT: f64 = 1.167_303_978_261_418_7;
    let axis = |k: i32| ((0.5 + f64::from(i + 1) * ROOT.powi(-k)).fract() * 4_294_967_296.0) as u32;
    UVec4::new(axis(1), axis(2), axis(3), axis(4))
}

// chi-square

const GRID: usize = 16;
const DRAWS: u32 = 1 << 16;

fn cell([a, b]: [f64; 2]) -> usize {
    let index = |x: f64| ((x * GRID as f64) as usize).min(GRID - 1);
    index(a) * GRID + index(b)
}

/// p-value of the counts of each lobe in cells of the shadow's unit square against the density's integral over the
/// cell; what is absorbed has the rest. `draw` gives a lobe and a direction, or nothing.
fn fit(setting: &Setting, draw: impl Fn(u32) -> Option<(u32, DVec3)>, density: impl Fn(u32, DVec3) -> f64) -> f64 {
    let (shadow, lobes) = (setting.shadow(), setting.lobes());
    let mut counts = vec![vec![0_u64; GRID * GRID]; LOBES as usize];
    for i in 0..DRAWS {
        if let Some((lobe, wi)) = draw(i) {
            counts[lobe as usize][cell(shadow.coordinates(lobe, wi))] += 1;
        }
    }
    let mut cells = Vec::new();
    let mut rest = (u64::from(DRAWS), f64::from(DRAWS));
    for lobe in lobes {
        for (index, &count) in counts[lobe as usize].iter().enumerate() {
            let lo = [index / GRID, index % GRID].map(|k| k as f64 / GRID as f64);
            let hi = lo.map(|x| x + 1.0 / GRID as f64);
            if let Some(share) = share(&shadow, lobe, lo, hi, &density) {
                cells.push((count, share * f64::from(DRAWS)));
                rest = (rest.0 - count, rest.1 - share * f64::from(DRAWS));
            }
        }
    }
    // cells that the horizon cuts, and what is absorbed
    if rest.1 > 1.0e-3 * f64::from(DRAWS) {
        cells.push(rest);
    }
    chi_square(cells).p
}

/// The probability of a cell; none where the horizon or total reflection cuts it.
fn share(shadow: &Shadow, lobe: u32, lo: [f64; 2], hi: [f64; 2], density: impl Fn(u32, DVec3) -> f64) -> Option<f64> {
    let corners = [[lo[0], lo[1]], [lo[0], hi[1]], [hi[0], lo[1]], [hi[0], hi[1]]];
    let inside = |&u: &[f64; 2]| {
        shadow
            .direction(lobe, u)
            .is_some_and(|wi| (wi.z < 0.0) == is_transmission(lobe) && wi.z.abs() > 1.0e-3 * shadow.cos_o())
    };
    let whole = corners.iter().all(inside);
    whole.then(|| shadow.nodes(lobe, lo, hi, 34).map(|(wi, solid_angle)| density(lobe, wi) * solid_angle).sum())
}

fn drawn(sample: &BsdfSample) -> Option<(u32, DVec3)> {
    (sample.pdf > 0.0).then(|| (sample.lobe, sample.direction.as_dvec3()))
}

fn smallest(settings: &[Setting], p: impl Fn(&Setting) -> f64 + Sync) -> (f64, String) {
    let all: Vec<_> = settings.par_iter().map(|setting| (p(setting), setting.name())).collect();
    all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are settings")
}

fn samples_follow_the_density() -> Result<(), Failed> {
    let mut surfaces = surfaces();
    // at the least roughness its refraction is narrow, a delta beside a rough reflection
    surfaces.push(Surface { name: "glass", material: glass(1.02), front: true });
    let settings = settings(&surfaces, &[0.02, 0.1, 0.3, 1.0], &[1.0, 0.3, 0.02]);
    let (p, name) = smallest(&settings, |setting| {
        let (bsdf, words) = (setting.bsdf(), random_words(setting, 1));
        fit(
            setting,
            |i| drawn(&bsdf.sample(words(i))),
            |lobe, wi| f64::from(bsdf.evaluate_lobe(lobe, wi.as_vec3()).pdf),
        )
    });
    let share = sidak(FAMILY_RATE, settings.len());
    println!("smallest p {p:.2e} of {} ({name}), alarm below {share:.1e}", settings.len());
    ensure(p >= share, || format!("{name}: p = {p:.2e}, below {share:.1e}"))
}

/// Visible normals around an arbitrary frame, as a general routine for frames gives it.
fn a_wrong_frame_of_visible_normals_is_seen() -> Result<(), Failed> {
    let surface = Surface { name: "metal", material: metal(), front: true };
    let setting = Setting::new(surface, 0.6, 0.3, 0);
    let (bsdf, shadow) = (setting.bsdf(), setting.shadow());
    let alpha = f64::from(setting.surface.material.roughness).powi(2);
    let stretched = (setting.wo.as_dvec3() * DVec3::new(alpha, alpha, 1.0)).normalize();
    let tangent = DVec3::X.cross(stretched).normalize();
    let p = |frame: Option<[DVec3; 3]>| {
        let words = random_words(&setting, 2);
        let draw = |i: u32| {
            let u = [f64::from(rng::unit(words(i).x)), f64::from(rng::unit(words(i).y))];
            let wi = match frame {
                Some(frame) => shadow.direction_in(SPECULAR_REFLECTION, u, frame),
                None => shadow.direction(SPECULAR_REFLECTION, u),
            };
            wi.filter(|wi| wi.z > 0.0).map(|wi| (SPECULAR_REFLECTION, wi))
        };
        fit(&setting, draw, |lobe, wi| f64::from(bsdf.evaluate_lobe(lobe, wi.as_vec3()).pdf))
    };
    let (right, wrong) = (p(None), p(Some([tangent, stretched.cross(tangent), stretched])));
    println!("p {right:.2e} with the horizontal frame, {wrong:.2e} with another");
    ensure(right > 1.0e-6 && wrong < 1.0e-12, || "the frame makes no difference".to_owned())
}

/// The density of normals instead of that of directions, scaled to the same total.
fn a_missing_jacobian_is_seen() -> Result<(), Failed> {
    for (lobe, material) in [(SPECULAR_REFLECTION, metal()), (SPECULAR_TRANSMISSION, glass(1.5))] {
        let setting = Setting::new(Surface { name: "rough", material, front: true }, 0.6, 0.7, 0);
        let (bsdf, shadow, words) = (setting.bsdf(), setting.shadow(), random_words(&setting, 3));
        let wo = setting.wo.as_dvec3();
        let right = |l: u32, wi: DVec3| f64::from(bsdf.evaluate_lobe(l, wi.as_vec3()).pdf);
        let wrong = |l: u32, wi: DVec3| {
            let n = wo + wi * 1.5;
            let jacobian = if l == SPECULAR_REFLECTION {
                1.0 / (4.0 * (wo + wi).length() * 0.5)
            } else {
                2.25 * (wi.dot(n) / n.length()).abs() / n.length_squared()
            };
            right(l, wi) / jacobian
        };
        let total = |f: &dyn Fn(u32, DVec3) -> f64| shadow.integrate(lobe, 4000, |wi| DVec3::splat(f(lobe, wi))).x;
        let scale = total(&right) / total(&wrong);
        let draw = |i| drawn(&bsdf.sample(words(i)));
        let p = fit(&setting, draw, |l, wi| if l == lobe { wrong(l, wi) * scale } else { right(l, wi) });
        println!("lobe {lobe}: p {p:.2e} without the Jacobian");
        ensure(p < 1.0e-12, || format!("lobe {lobe}: the Jacobian makes no difference"))?;
    }
    Ok(())
}

// integrals

/// Nodes of the quadrature of a lobe.
const NODES: usize = 16_384;
const SAMPLES: u32 = 1 << 16;

/// What quadrature and the mean over samples say about a setting.
struct Integrals {
    /// Of the density.
    density: f64,
    /// Share of samples that are not absorbed.
    survivors: f64,
    /// Albedos: of the shadow, of the kernels' values, and the mean of the samples' weights.
    albedos: [DVec3; 3],
}

impl Integrals {
    fn new(setting: &Setting) -> Self {
        let (bsdf, shadow) = (setting.bsdf(), setting.shadow());
        let (mut density, mut exact, mut value) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for lobe in setting.lobes() {
            for (wi, solid_angle) in shadow.nodes(lobe, [0.0; 2], [1.0; 2], NODES) {
                let evaluation = bsdf.evaluate_lobe(lobe, wi.as_vec3());
                exact += shadow.value(lobe, wi) * solid_angle;
                value += evaluation.value.as_dvec3() * solid_angle;
                density += f64::from(evaluation.pdf) * solid_angle;
            }
        }
        let (mut survivors, mut mean) = (0.0, DVec3::ZERO);
        for i in 0..SAMPLES {
            let sample = bsdf.sample(even_words(i));
            survivors += f64::from(u8::from(sample.pdf > 0.0));
            mean += sample.weight.as_dvec3();
        }
        let n = f64::from(SAMPLES);
        Self { density, survivors: survivors / n, albedos: [exact, value, mean / n] }
    }

    /// Of the density's integral, of the values' albedo, and of the samples'.
    fn errors(&self) -> [f64; 3] {
        let [exact, value, mean] = self.albedos;
        let distance = |a: DVec3| (a - exact).abs().max_element();
        [(self.density - self.survivors).abs(), distance(value), distance(mean)]
    }
}

/// Tolerance 1e-3 throughout: quadrature errs where the horizon or total reflection cuts a lobe, and the mean over evenly
/// spread samples by its discrepancy.
fn densities_and_albedos_integrate() -> Result<(), Failed> {
    let settings = settings(&surfaces(), &[0.02, 0.1, 0.3, 1.0], &[1.0, 0.3, 0.05, 0.005]);
    let all: Vec<_> = settings.par_iter().map(|setting| Integrals::new(setting).errors()).collect();
    let mut failed = Vec::new();
    for (index, what) in ["density", "albedo of values", "albedo of samples"].into_iter().enumerate() {
        let worst = all.iter().zip(&settings).map(|(errors, setting)| (errors[index], setting.name()));
        let (error, name) = worst.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are settings");
        println!("{what}: off by {error:.1e} at most ({name})");
        if error >= 1.0e-3 {
            failed.push(format!("{what}, {name}: off by {error:.2e}"));
        }
    }
    ensure(failed.is_empty(), || failed.join("; "))
}

/// Values at sampled directions against the shadow's, to 1e-5.
fn values_equal_the_shadow() -> Result<(), Failed> {
    let settings = settings(&surfaces(), &ROUGHNESSES, &COSINES);
    let worst = |setting: &Setting| {
        let (bsdf, shadow, words) = (setting.bsdf(), setting.shadow(), random_words(setting, 4));
        let mut worst = (0.0_f64, String::new());
        for i in 0..2000 {
            let sample = bsdf.sample(words(i));
            let (lobe, wi) = (sample.lobe, sample.direction);
            let value = bsdf.evaluate_lobe(lobe, wi).value.as_dvec3();
            let exact = shadow.value(lobe, wi.as_dvec3());
            let error = (value - exact).abs().max_element() / exact.max_element().max(1.0e-30);
            // a rounding of the cosine moves Fresnel's reflectance most near total reflection
            let slope = |cos: f64| {
                let [a, b] = [1.0, -1.0].map(|sign| shadow.reflectance(cos * (1.0 + sign * 4.0 * ROUNDING)));
                (a - b).abs().max_element() / shadow.reflectance(cos).max_element()
            };
            let error = if lobe == SPECULAR_REFLECTION { error - slope(shadow.cosine(wi.as_dvec3())) } else { error };
            if sample.pdf > 0.0 && error > worst.0 {
                worst = (error, format!("lobe {lobe} of {}, to {wi}", setting.name()));
            }
        }
        worst
    };
    let all: Vec<_> = settings.par_iter().map(worst).collect();
    let mut sorted = all;
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("relative error {:.1e} at most ({})", sorted[0].0, sorted[0].1);
    ensure(sorted[0].0 < 1.0e-5, || format!("{}: relative error {:.2e}", sorted[0].1, sorted[0].0))
}

/// How far apart the points are that choose a direction; the second coordinate is an angle in turns.
fn distance(a: UVec4, b: UVec4) -> f64 {
    let x = (f64::from(rng::unit(a.x)) - f64::from(rng::unit(b.x))).abs();
    let y = (f64::from(rng::unit(a.y)) - f64::from(rng::unit(b.y))).abs();
    x.max(y.min(1.0 - y))
}

/// A direction of 24 bits does not resolve the random numbers of a narrow lobe, nor do these the directions of its tail:
/// one of the two must return to 1e-5, except for one sample in a thousand, far in a tail, where both are coarse. Near
/// the critical angle refraction spreads directions by 1 / cos.
fn samples_invert() -> Result<(), Failed> {
    const DRAWS: u32 = 2000;
    let settings = settings(&surfaces(), &ROUGHNESSES, &COSINES);
    let errors = |setting: &Setting| {
        let (bsdf, words, free) = (setting.bsdf(), random_words(setting, 5), random_words(setting, 6));
        let error = |i: u32| {
            let sample = bsdf.sample(words(i));
            if sample.pdf <= 0.0 {
                return 0.0;
            }
            let inverse = bsdf.invert(sample.lobe, sample.direction, free(i));
            let again = bsdf.sample(inverse);
            if again.lobe != sample.lobe {
                return f64::INFINITY;
            }
            let moved = (again.direction - sample.direction).as_dvec3().length();
            let bends = sample.lobe == SPECULAR_TRANSMISSION;
            let moved = if bends { moved * f64::from(sample.direction.z.abs()) } else { moved };
            moved.min(distance(words(i), inverse))
        };
        (0..DRAWS).map(error).collect::<Vec<_>>()
    };
    let mut all: Vec<_> = settings.par_iter().flat_map(errors).collect();
    all.sort_by(f64::total_cmp);
    let (typical, worst) = (all[all.len() - all.len() / 1000], all[all.len() - 1]);
    println!("directions or numbers return within {typical:.1e} but for 0.1 %, and within {worst:.1e}");
    ensure(typical < 1.0e-5 && worst < 1.0e-4, || format!("off by {typical:.2e} and {worst:.2e}"))
}

// physics

fn flipped(v: Vec3) -> Vec3 {
    Vec3::new(v.x, v.y, -v.z)
}

/// The largest relative difference between `f(o, i) / no^2` and `f(i, o) / ni^2`, the indices raised to `power`.
fn asymmetry(power: i32) -> (f64, String) {
    let settings = settings(&surfaces(), &ROUGHNESSES, &COSINES);
    let worst = |setting: &Setting| {
        let Surface { material, front, .. } = setting.surface;
        let (bsdf, words) = (setting.bsdf(), random_words(setting, 7));
        let mut worst = 0.0_f64;
        for i in 0..500 {
            let sample = bsdf.sample(words(i));
            let wi = sample.direction;
            let through = is_transmission(sample.lobe);
            let (viewer, light, side) =
                if through { (flipped(wi), flipped(setting.wo), !front) } else { (wi, setting.wo, front) };
            if sample.pdf > 0.0 {
                let back = Bsdf::new(&material, viewer, side, FEATURES_ALL);
                let forth = bsdf.evaluate_lobe(sample.lobe, wi).value.as_dvec3() / f64::from(wi.z.abs());
                let back = back.evaluate_lobe(sample.lobe, light).value.as_dvec3() / f64::from(light.z.abs());
                let bends = is_specular(sample.lobe) && through && !material.thin;
                let ratio = f64::from(material.ior).powi(if front { power } else { -power });
                let back = if bends { back / ratio } else { back };
                worst = worst.max((forth - back).abs().max_element() / forth.max_element());
            }
        }
        (worst, setting.name())
    };
    let all: Vec<_> = settings.par_iter().map(worst).collect();
    all.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are settings")
}

fn scattering_is_reciprocal() -> Result<(), Failed> {
    let (error, name) = asymmetry(2);
    println!("asymmetry {error:.1e} at most ({name})");
    ensure(error < 2.0e-5, || format!("{name}: asymmetry {error:.2e}"))?;
    let (without, _) = asymmetry(0);
    ensure(without > 0.1, || "radiance scaling makes no difference".to_owned())
}

fn white(material: Material) -> Material {
    Material { base_color: Vec3::ONE, diffuse_transmission_color: Vec3::ONE, ..material }
}

/// White surfaces under light of one, or of the square of the index where light bends: what comes back is at most as
/// much. The shadow's weights are at most 1 pointwise, so that the quadrature adds no error of its own; differentiation
/// adds some 1e-6. The kernels' values equal the shadow's (see [`values_equal_the_shadow`]).
fn no_energy_is_gained() -> Result<(), Failed> {
    let mut white_surfaces = vec![Surface { name: "metal", material: white(metal()), front: true }];
    for ior in [1.0, 1.02, 1.1, 1.33, 1.5, 2.0, 2.5, 3.0, 5.0] {
        let mut add = |name, material, front| white_surfaces.push(Surface { name, material: white(material), front });
        add("plastic", plastic(ior), true);
        add("leaf", Material { ior, ..leaf() }, true);
        add("everything", Material { ior, ..everything() }, true);
        if ior > 1.0 {
            add("glass", glass(ior), true);
            add("glass", glass(ior), false);
            add("thin glass", Material { thin: true, ..glass(ior) }, true);
        }
    }
    let settings = settings(&white_surfaces, &ROUGHNESSES, &COSINES);
    let albedo = |setting: &Setting| {
        let (bsdf, shadow) = (setting.bsdf(), setting.shadow());
        let Surface { material, front, .. } = setting.surface;
        // a refracted lobe too narrow to be rough
        let narrow = bsdf.kind(SPECULAR_TRANSMISSION) == Kind::Delta;
        let mut sum = if narrow { shadow.clear_share() * (1.0 - shadow.dielectric(shadow.cos_o())) } else { 0.0 };
        for lobe in setting.lobes() {
            let bends = lobe == SPECULAR_TRANSMISSION && !material.thin;
            let flux = if bends { f64::from(material.ior).powi(if front { 2 } else { -2 }) } else { 1.0 };
            sum += shadow.albedo(lobe, 600).max_element() * flux;
        }
        (sum, setting.name())
    };
    let all: Vec<_> = settings.par_iter().map(albedo).collect();
    for (what, order) in [("largest", 1.0), ("smallest", -1.0)] {
        let (sum, name) =
            all.iter().max_by(|a, b| (order * a.0).total_cmp(&(order * b.0))).expect("there are settings");
        println!("{what} albedo {sum:.6} of {} ({name})", all.len());
    }
    let gain = all.iter().find(|(sum, _)| *sum > 1.0 + 1.0e-5);
    ensure(gain.is_none(), || format!("{gain:?}"))
}

/// glTF weighs the diffuse part by `1 - Fs(o.h)`.
fn gltf_mixing_gains_energy() -> Result<(), Failed> {
    let surface = Surface { name: "plastic", material: white(plastic(1.5)), front: true };
    let setting = Setting::new(surface, 0.1, 0.05, 0);
    let shadow = setting.shadow();
    let wo = setting.wo.as_dvec3();
    let diffuse = shadow.integrate(0, 4000, |wi| {
        let coat = shadow.coat(0.5 * (wo + wi).length());
        DVec3::splat((1.0 - coat) * wi.z / PI)
    });
    let sum = (diffuse + shadow.albedo(SPECULAR_REFLECTION, 4000)).x;
    println!("albedo {sum:.3} with glTF's weights");
    ensure(sum > 1.1, || format!("albedo {sum}"))
}

fn smooth_dielectrics_keep_all_energy() -> Result<(), Failed> {
    let mut worst = 0.0_f64;
    for ior in [1.0, 1.0001, 1.02, 1.1, 1.33, 1.5, 2.4, 3.0, IOR_MAX] {
        for (thin, front) in [(false, true), (false, false), (true, true)] {
            for cos in [1.0, 0.99, 0.8, 0.66, 0.4, 0.1, 0.01, 1.0e-4] {
                let material = white(Material { roughness: 0.0, thin, ..glass(ior) });
                let bsdf = Bsdf::new(&material, direction(cos, 0.3), front, FEATURES_ALL);
                let scale = if thin { 1.0 } else { f64::from(ior).powi(if front { 2 } else { -2 }) };
                let mut sum = 0.0;
                let mut seen = [false; LOBES as usize];
                for word in [0, u32::MAX] {
                    let sample = bsdf.sample(UVec4::new(5, 6, 7, word));
                    if !std::mem::replace(&mut seen[sample.lobe as usize], true) && sample.pdf > 0.0 {
                        ensure(sample.delta, || "a smooth lobe is no delta".to_owned())?;
                        let energy = f64::from(sample.weight.x) * f64::from(sample.pdf);
                        sum += if sample.lobe == SPECULAR_TRANSMISSION { energy * scale } else { energy };
                    }
                }
                worst = worst.max((sum - 1.0).abs());
            }
        }
    }
    println!("reflected and transmitted energy is off by {worst:.1e} at most");
    // thirty roundings: the fourth power of an inverse that has four, and their like in the transmission
    ensure(worst < 30.0 * ROUNDING, || format!("energy off by {worst:.2e}"))
}

fn lobes_add_up() -> Result<(), Failed> {
    for setting in settings(&surfaces(), &[0.005, 0.1, 1.0], &COSINES) {
        let (bsdf, words) = (setting.bsdf(), random_words(&setting, 8));
        for i in 0..200 {
            let sample = bsdf.sample(words(i));
            let whole = bsdf.evaluate(sample.direction);
            let parts: Vec<_> = (0..LOBES).map(|lobe| bsdf.evaluate_lobe(lobe, sample.direction)).collect();
            let value: Vec3 = parts.iter().map(|part| part.value).sum();
            let pdf: f32 = parts.iter().map(|part| part.pdf).sum();
            ensure(value == whole.value && pdf == whole.pdf, || format!("{}: parts of {whole:?}", setting.name()))?;
            let matches = sample.delta || sample.pdf == 0.0 || sample.pdf == whole.pdf;
            ensure(matches, || format!("{}: {sample:?} has another density", setting.name()))?;
        }
        let selections = bsdf.selection(0) + bsdf.selection(1) + bsdf.selection(2);
        ensure(selections == 1.0, || format!("{}: selection adds to {selections}", setting.name()))?;
    }
    Ok(())
}

/// The general kernel and the one for the material's own features give the same bits.
fn features_change_no_bit() -> Result<(), Failed> {
    for setting in settings(&surfaces(), &[0.0, 0.3], &COSINES) {
        let Surface { material, front, .. } = setting.surface;
        let own = Bsdf::new(&material, setting.wo, front, material.features());
        let (general, words) = (setting.bsdf(), random_words(&setting, 9));
        for i in 0..500 {
            let (a, b) = (own.sample(words(i)), general.sample(words(i)));
            ensure(a == b, || format!("{}: {a:?} and {b:?}", setting.name()))?;
            let wi = if i & 1 == 0 { a.direction } else { flipped(a.direction) };
            ensure(own.evaluate(wi) == general.evaluate(wi), || format!("{}: to {wi}", setting.name()))?;
        }
    }
    Ok(())
}

/// The ends of all ranges.
fn extremes_are_finite() -> Result<(), Failed> {
    let words = [0, 0xff, 0x100, 1 << 31, u32::MAX - 0x100, u32::MAX];
    let roughnesses = [0.0, 0.5 * DELTA_BELOW, DELTA_BELOW, 0.02, 1.0];
    let cosines = [1.0, 0.5, 1.0e-3, 1.0e-5, 2.0 * COS_MIN, COS_MIN, 0.5 * COS_MIN];
    let mut surfaces = surfaces();
    for ior in [1.000_000_1, 1.0001, 1.01, IOR_MAX] {
        for front in [false, true] {
            surfaces.push(Surface { name: "glass", material: glass(ior), front });
        }
    }
    surfaces.push(Surface { name: "black", material: Material::diffuse(Vec3::ZERO), front: true });
    let black_metal = Material { base_color: Vec3::ZERO, ..metal() };
    surfaces.push(Surface { name: "black metal", material: black_metal, front: true });
    let fine = |v: Vec3| v.is_finite() && v.min_element() >= 0.0;
    settings(&surfaces, &roughnesses, &cosines).par_iter().try_for_each(|setting| {
        let bsdf = setting.bsdf();
        // leaving a dense medium multiplies the relative error of the sine by the index, twice
        let tolerance = 1.0e-6 + 2.0 * ROUNDING * f64::from(setting.surface.material.ior).powi(2);
        for i in 0..6_usize.pow(4) {
            let word = |k: u32| words[i / 6_usize.pow(k) % 6];
            let sample = bsdf.sample(UVec4::new(word(0), word(1), word(2), word(3)));
            let length = sample.direction.as_dvec3().length();
            let good = fine(sample.weight)
                && (0.0..1.0e30).contains(&sample.pdf)
                && (length - 1.0).abs() < tolerance
                && sample.weight.max_element() < 1.0e4;
            ensure(good, || format!("{}: {sample:?}, length {length}", setting.name()))?;
            for wi in [-setting.wo, flipped(setting.wo), Vec3::Z, -Vec3::Z, flipped(sample.direction)] {
                let Evaluation { value, pdf } = bsdf.evaluate(wi);
                let good = fine(value) && (0.0..1.0e30).contains(&pdf);
                ensure(good, || format!("{}: {value} and {pdf} to {wi}", setting.name()))?;
            }
            let inverse = bsdf.invert(sample.lobe, sample.direction, UVec4::new(word(3), word(2), word(1), word(0)));
            let again = bsdf.sample(inverse);
            ensure(sample.pdf == 0.0 || fine(again.weight), || format!("{}: {again:?}", setting.name()))?;
        }
        Ok(())
    })
}
