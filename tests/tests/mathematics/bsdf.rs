//! Scattering functions: densities, inverses, reciprocity, energy, and all values against an independent `f64` shadow.
//! Seeds are fixed. The chi-square tests together raise a false alarm with probability [`FAMILY_RATE`]; the others
//! are deterministic, with tolerances stated where they are used.

use glam::{DVec3, UVec4, Vec3};
use rayon::prelude::*;
use restir_shared::bsdf::{
    Bsdf, BsdfSample, COS_MIN, DELTA_BELOW, Evaluation, IOR_MAX, Kind, LOBES, Material, SPECULAR_REFLECTION,
    SPECULAR_TRANSMISSION, is_transmission,
};
use restir_shared::layout::{FEATURE_MULTISCATTER, FEATURES_ALL};
use restir_shared::rng::{self, pcg4d};
use restir_tests::bsdf_f64::Shadow;
use restir_tests::furnace::{self, Cell};
use restir_tests::microsurface::Microsurface;
use restir_tests::random::SplitMix;
use restir_tests::stats::{FAMILY_RATE, chi_square, sidak};
use std::f64::consts::PI;

const ROUGHNESSES: [f32; 6] = [0.02, 0.05, 0.1, 0.3, 0.6, 1.0];
/// Half the distance between 1 and its neighbour, the error of one rounding.
const ROUNDING: f64 = 1.0 / 16_777_216.0;
const COSINES: [f32; 5] = [1.0, 0.7, 0.3, 0.05, 0.005];

restir_tests::suite! {
    later {
        samples_follow_the_density a_wrong_frame_of_visible_normals_is_seen a_missing_jacobian_is_seen
        densities_and_albedos_integrate values_equal_the_shadow samples_invert scattering_is_reciprocal
        no_energy_is_gained white_surfaces_return_the_light a_walk_scatters_once_as_the_lobe_does
        coloured_metal_is_near_a_random_walk gltf_mixing_gains_energy smooth_dielectrics_keep_all_energy lobes_add_up
        features_change_no_bit extremes_are_finite
    }
}

/// A surface and the side it is seen from.
#[derive(Clone, Copy)]
struct Surface {
    name: &'static str,
    material: Material,
    front: bool,
}

impl Surface {
    fn front(name: &'static str, material: Material) -> Self {
        Self { name, material, front: true }
    }

    fn back(name: &'static str, material: Material) -> Self {
        Self { front: false, ..Self::front(name, material) }
    }

    /// The ratio of the indices to a power, by whose square radiance is scaled that comes through; 1 where nothing bends.
    fn scale(&self, lobe: u32, power: i32) -> f64 {
        let bends = lobe == SPECULAR_TRANSMISSION && !self.material.thin;
        if bends { f64::from(self.material.ior).powi(if self.front { power } else { -power }) } else { 1.0 }
    }
}

/// A surface of some roughness, seen at some angle.
#[derive(Clone, Copy)]
struct Setting {
    surface: Surface,
    wo: Vec3,
    /// Light that specular lobes lose comes back.
    multiscatter: bool,
    /// Of random numbers.
    stream: u32,
}

impl Setting {
    fn new(surface: Surface, roughness: f32, cos: f32, stream: u32) -> Self {
        let material = Material { roughness, ..surface.material };
        Self { surface: Surface { material, ..surface }, wo: direction(cos, 0.1), multiscatter: true, stream }
    }

    /// The same without what single scattering loses.
    fn single(self) -> Self {
        Self { multiscatter: false, ..self }
    }

    fn features(&self) -> u32 {
        if self.multiscatter { FEATURES_ALL } else { FEATURES_ALL & !FEATURE_MULTISCATTER }
    }

    fn bsdf(&self) -> Bsdf {
        Bsdf::new(&self.surface.material, self.wo, self.surface.front, self.features())
    }

    fn shadow(&self) -> Shadow {
        Shadow::new(&self.surface.material, self.wo, self.surface.front, self.multiscatter)
    }

    fn name(&self) -> String {
        let Surface { name, material, front } = self.surface;
        let side = if front { "" } else { " from inside" };
        let scattering = if self.multiscatter { "" } else { ", single scattering" };
        format!("{name}{side}{scattering}, ior {}, roughness {}, cos {}", material.ior, material.roughness, self.wo.z)
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
    let (front, back) = (Surface::front, Surface::back);
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
        front("coated red", Material { specular: 0.7, specular_color: Vec3::new(9.0, 1.0, 0.2), ..plastic(1.5) }),
    ]
}

/// Every surface with every roughness, if it has a specular lobe, at every angle; then those again whose single scattering
/// loses light, with single scattering.
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
    let loses = |setting: &&Setting| setting.surface.material.features() & FEATURE_MULTISCATTER != 0;
    let single: Vec<Setting> = settings.iter().filter(loses).map(|setting| setting.single()).collect();
    settings.extend(single);
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
    chi_square(cells)
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

fn pdf(bsdf: &Bsdf, lobe: u32, wi: DVec3) -> f64 {
    bsdf.evaluate_lobe(lobe, wi.as_vec3()).pdf.into()
}

fn drawn(sample: &BsdfSample) -> Option<(u32, DVec3)> {
    (sample.pdf > 0.0).then(|| (sample.lobe, sample.direction.as_dvec3()))
}

/// The largest of a number over the settings, and where it is.
fn largest(settings: &[Setting], number: impl Fn(&Setting) -> f64 + Sync) -> (f64, String) {
    let all = settings.par_iter().map(|setting| (number(setting), setting.name()));
    all.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are settings")
}

fn samples_follow_the_density() {
    let mut surfaces = surfaces();
    // at the least roughness its refraction is narrow, a delta beside a rough reflection
    surfaces.push(Surface::front("glass", glass(1.02)));
    let settings = settings(&surfaces, &[0.02, 0.1, 0.3, 1.0], &[1.0, 0.3, 0.02]);
    let (p, name) = largest(&settings, |setting| {
        let (bsdf, words) = (setting.bsdf(), random_words(setting, 1));
        -fit(setting, |i| drawn(&bsdf.sample(words(i))), |lobe, wi| pdf(&bsdf, lobe, wi))
    });
    let p = -p;
    let share = sidak(FAMILY_RATE, settings.len());
    println!("smallest p {p:.2e} of {} ({name}), alarm below {share:.1e}", settings.len());
    assert!(p >= share, "{name}: p = {p:.2e}, below {share:.1e}");
}

/// Visible normals around an arbitrary frame, as a general routine for frames gives it.
fn a_wrong_frame_of_visible_normals_is_seen() {
    let setting = Setting::new(Surface::front("metal", metal()), 0.6, 0.3, 0).single();
    let shadow = setting.shadow();
    let alpha = f64::from(setting.surface.material.roughness).powi(2);
    let stretched = (setting.wo.as_dvec3() * DVec3::new(alpha, alpha, 1.0)).normalize();
    let tangent = DVec3::X.cross(stretched).normalize();
    let p = |frame: [DVec3; 3]| {
        let words = random_words(&setting, 2);
        let draw = |i: u32| {
            let u = [words(i).x, words(i).y].map(|word| f64::from(rng::unit(word)));
            let wi = shadow.direction_in(SPECULAR_REFLECTION, u, frame).filter(|wi| wi.z > 0.0);
            wi.map(|wi| (SPECULAR_REFLECTION, wi))
        };
        fit(&setting, draw, |_, wi| shadow.mirrored_pdf(wi))
    };
    let (right, wrong) = (p(shadow.frame()), p([tangent, stretched.cross(tangent), stretched]));
    println!("p {right:.2e} with the horizontal frame, {wrong:.2e} with another");
    assert!(right > 1.0e-6 && wrong < 1.0e-12, "the frame makes no difference");
}

/// The density of normals instead of that of directions, scaled to the same total.
fn a_missing_jacobian_is_seen() {
    for (lobe, material) in [(SPECULAR_REFLECTION, metal()), (SPECULAR_TRANSMISSION, glass(1.5))] {
        let setting = Setting::new(Surface::front("rough", material), 0.6, 0.7, 0);
        let (bsdf, shadow, words) = (setting.bsdf(), setting.shadow(), random_words(&setting, 3));
        let wo = setting.wo.as_dvec3();
        let right = |l: u32, wi: DVec3| pdf(&bsdf, l, wi);
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
        assert!(p < 1.0e-12, "lobe {lobe}: the Jacobian makes no difference");
    }
}

// integrals

/// Nodes of the quadrature of a lobe.
const NODES: usize = 16_384;
const SAMPLES: u32 = 1 << 16;

/// How far the integral of the density is from the share of samples that are not absorbed, the albedo of the kernels' values
/// from the shadow's, and the mean of the samples' weights from it.
fn errors_of_integrals(setting: &Setting) -> [f64; 3] {
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
    for sample in (0..SAMPLES).map(|i| bsdf.sample(even_words(i))) {
        survivors += f64::from(u8::from(sample.pdf > 0.0)) / f64::from(SAMPLES);
        mean += sample.weight.as_dvec3() / f64::from(SAMPLES);
    }
    let distance = |albedo: DVec3| (albedo - exact).abs().max_element();
    [(density - survivors).abs(), distance(value), distance(mean)]
}

/// Tolerance 1e-3 throughout: quadrature errs where the horizon or total reflection cuts a lobe, and the mean over evenly
/// spread samples by its discrepancy.
fn densities_and_albedos_integrate() {
    let settings = settings(&surfaces(), &[0.02, 0.1, 0.3, 1.0], &[1.0, 0.3, 0.05, 0.005]);
    let all: Vec<_> = settings.par_iter().map(errors_of_integrals).collect();
    for (index, what) in ["density", "albedo of values", "albedo of samples"].into_iter().enumerate() {
        let errors = all.iter().zip(&settings).map(|(errors, setting)| (errors[index], setting.name()));
        let (error, name) = errors.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are settings");
        println!("{what}: off by {error:.1e} at most ({name})");
        assert!(error < 1.0e-3, "{what}, {name}: off by {error:.2e}");
    }
}

/// Values at sampled directions against the shadow's, to 1e-5.
fn values_equal_the_shadow() {
    let settings = settings(&surfaces(), &ROUGHNESSES, &COSINES);
    let (error, name) = largest(&settings, |setting| {
        let (bsdf, shadow, words) = (setting.bsdf(), setting.shadow(), random_words(setting, 4));
        let error = |sample: BsdfSample| {
            let (lobe, wi) = (sample.lobe, sample.direction);
            let value = bsdf.evaluate_lobe(lobe, wi).value.as_dvec3();
            let exact = shadow.value(lobe, wi.as_dvec3());
            let error = (value - exact).abs().max_element() / exact.max_element().max(1.0e-30);
            // a rounding of the cosine moves Fresnel's reflectance most near total reflection
            let slope = |cos: f64| {
                let [a, b] = [1.0, -1.0].map(|sign| shadow.reflectance(cos * (1.0 + sign * 4.0 * ROUNDING)));
                (a - b).abs().max_element() / shadow.reflectance(cos).max_element()
            };
            if lobe == SPECULAR_REFLECTION { error - slope(shadow.cosine(wi.as_dvec3())) } else { error }
        };
        (0..2000).map(|i| bsdf.sample(words(i))).filter(|sample| sample.pdf > 0.0).map(error).fold(0.0, f64::max)
    });
    println!("relative error {error:.1e} at most ({name})");
    assert!(error < 1.0e-5, "{name}: relative error {error:.2e}");
}

/// How far apart the points are that choose a direction; the second coordinate is an angle in turns.
fn distance(a: UVec4, b: UVec4) -> f64 {
    let apart = |a, b| (f64::from(rng::unit(a)) - f64::from(rng::unit(b))).abs();
    let y = apart(a.y, b.y);
    apart(a.x, b.x).max(y.min(1.0 - y))
}

/// A direction of 24 bits does not resolve the random numbers of a narrow lobe, nor do these the directions of its tail:
/// one of the two must return to 1e-5, except for one sample in a thousand, far in a tail, where both are coarse. Near
/// the critical angle refraction spreads directions by 1 / cos.
fn samples_invert() {
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
    assert!(typical < 1.0e-5 && worst < 1.0e-4, "off by {typical:.2e} and {worst:.2e}");
}

// physics

fn flipped(v: Vec3) -> Vec3 {
    Vec3::new(v.x, v.y, -v.z)
}

/// The largest relative difference between `f(o, i) / no^2` and `f(i, o) / ni^2`, the indices raised to `power`.
fn asymmetry(power: i32) -> (f64, String) {
    let settings = settings(&surfaces(), &ROUGHNESSES, &COSINES);
    largest(&settings, |setting| {
        let Surface { material, front, .. } = setting.surface;
        let (bsdf, words) = (setting.bsdf(), random_words(setting, 7));
        let error = |BsdfSample { lobe, direction: wi, .. }| {
            let through = is_transmission(lobe);
            let (viewer, light, side) =
                if through { (flipped(wi), flipped(setting.wo), !front) } else { (wi, setting.wo, front) };
            let back = Bsdf::new(&material, viewer, side, setting.features());
            let forth = bsdf.evaluate_lobe(lobe, wi).value.as_dvec3() / f64::from(wi.z.abs());
            let back = back.evaluate_lobe(lobe, light).value.as_dvec3() / f64::from(light.z.abs());
            let back = back / setting.surface.scale(lobe, power);
            (forth - back).abs().max_element() / forth.max_element()
        };
        (0..500).map(|i| bsdf.sample(words(i))).filter(|sample| sample.pdf > 0.0).map(error).fold(0.0, f64::max)
    })
}

fn scattering_is_reciprocal() {
    let (error, name) = asymmetry(2);
    println!("asymmetry {error:.1e} at most ({name})");
    assert!(error < 1.0e-5, "{name}: asymmetry {error:.2e}");
    let (without, _) = asymmetry(0);
    assert!(without > 0.1, "radiance scaling makes no difference");
}

fn white(material: Material) -> Material {
    Material { base_color: Vec3::ONE, diffuse_transmission_color: Vec3::ONE, ..material }
}

/// White surfaces under light of one, or of the square of the index where light bends: what comes back is at most as
/// much. The shadow's weights are at most 1 pointwise, so that the quadrature adds no error of its own; differentiation
/// adds some 1e-6. The kernels' values equal the shadow's (see [`values_equal_the_shadow`]).
fn no_energy_is_gained() {
    let front = |name, material| Surface::front(name, white(material));
    let mut white_surfaces = vec![front("metal", metal())];
    for ior in [1.0, 1.02, 1.1, 1.33, 1.5, 2.0, 2.5, 3.0, 5.0] {
        white_surfaces.push(front("plastic", plastic(ior)));
        white_surfaces.push(front("leaf", Material { ior, ..leaf() }));
        white_surfaces.push(front("everything", Material { ior, ..everything() }));
        if ior > 1.0 {
            white_surfaces.push(front("glass", glass(ior)));
            white_surfaces.push(Surface::back("glass", white(glass(ior))));
            white_surfaces.push(front("thin glass", Material { thin: true, ..glass(ior) }));
        }
    }
    let settings = settings(&white_surfaces, &ROUGHNESSES, &COSINES);
    // the fits of losses are as good as that up to index 3
    let allowed = |setting: &Setting| match setting {
        Setting { multiscatter: false, .. } => 1.0e-5,
        Setting { surface: Surface { material, .. }, .. } if material.ior <= 3.0 => 5.0e-4,
        _ => 1.0e-3,
    };
    let (excess, name) = largest(&settings, |setting| {
        let (bsdf, shadow) = (setting.bsdf(), setting.shadow());
        // a refracted lobe too narrow to be rough
        let narrow = bsdf.kind(SPECULAR_TRANSMISSION) == Kind::Delta;
        let through = if narrow { shadow.clear_share() * (1.0 - shadow.dielectric(shadow.cos_o())) } else { 0.0 };
        let flux = |lobe| {
            shadow.albedo(lobe, if setting.multiscatter { 4000 } else { 600 }).max_element()
                * setting.surface.scale(lobe, 2)
        };
        through + setting.lobes().into_iter().map(flux).sum::<f64>() - 1.0 - allowed(setting)
    });
    println!("the most light of {} is {excess:.6} more than allowed ({name})", settings.len());
    assert!(excess <= 0.0, "{name}: {excess} more than allowed");
}

/// Samples a batch. The largest standard error is then below 0.001 (it is asserted), so that a gain or a loss of 0.0054 beyond
/// the bounds is seen in any cell with a probability of 99 %. A cell that lies on a bound raises a false alarm with one seed in
/// 220 (Student's t of 16 batches); the seeds are fixed.
const FURNACE_SAMPLES: u32 = 2048;

/// White surfaces of every roughness, metalness and index return between 0.99 and 1.0005 at every cosine from 1/64 on; by
/// single scattering metal and plastic do not.
fn white_surfaces_return_the_light() {
    let cells = furnace::opaque(true, FURNACE_SAMPLES);
    let error = cells.iter().map(|cell| cell.returned[1]).fold(0.0, f64::max);
    let [least, most] = [f64::min, f64::max].map(|f| cells.iter().map(|cell| cell.returned[0]).reduce(f).unwrap());
    println!("{} white surfaces return {least:.4} to {most:.4}, standard errors up to {error:.1e}", cells.len());
    assert!(error < 1.0e-3, "standard errors up to {error:.1e}");
    let off: Vec<_> = cells.iter().filter(|cell| cell.is_off()).collect();
    assert!(off.is_empty(), "{off:?}");
    let off = |cells: &[Cell], metallic| cells.iter().any(|cell| cell.material.metallic == metallic && cell.is_off());
    let single = furnace::opaque(false, FURNACE_SAMPLES / 8);
    assert!(off(&single, 0.0) && off(&single, 1.0), "what single scattering loses is not seen");
}

/// Of the walks on a microsurface as many leave after one reflection as single scattering returns of white metal: both are the same
/// integral, so that the walk's facets, its heights and its visible normals are those of the lobe.
fn a_walk_scatters_once_as_the_lobe_does() {
    const WALKS: u64 = 1 << 14;
    let single = furnace::opaque(false, FURNACE_SAMPLES);
    let metal = single.iter().filter(|cell| cell.material.metallic == 1.0);
    // 96 of them, each beyond 4.4 standard errors with a probability of 1e-5
    for (stream, cell) in (0..).zip(metal) {
        let surface = Microsurface::new(cell.material.roughness.into());
        let mut random = SplitMix::new(stream);
        let once = (0..WALKS).filter(|_| surface.walk(cell.cos.into(), &mut random).len() == 1).count();
        let (share, [mean, error]) = (once as f64 / WALKS as f64, cell.returned);
        let deviation = (mean * (1.0 - mean).max(0.0) / WALKS as f64).sqrt().hypot(error) + 1.0e-5;
        let z = (share - mean) / deviation;
        assert!(z.abs() < 4.4, "roughness {}, cosine {}: {z} of {deviation}", cell.material.roughness, cell.cos);
    }
}

/// What is approximate about coloured metal: it returns no more than the walk does, and at most 0.063 of all the light less. That is dark
/// metal of roughness 0.1 at the least cosine, of which facets reflect most of the light at grazing angles.
fn coloured_metal_is_near_a_random_walk() {
    let all = furnace::walked();
    println!("{}", furnace::walked_tables(&all));
    for walked in &all {
        let error = walked.walk[1].hypot(walked.cell.returned[1]);
        let (least, most) = (walked.difference() - 3.0 * error, walked.difference() + 3.0 * error);
        assert!(most > -0.063 && least < 0.0005, "{walked:?}");
    }
}

/// glTF weighs the diffuse part by `1 - Fs(o.h)`.
fn gltf_mixing_gains_energy() {
    let setting = Setting::new(Surface::front("plastic", white(plastic(1.5))), 0.1, 0.05, 0);
    let shadow = setting.shadow();
    let wo = setting.wo.as_dvec3();
    let diffuse = shadow.integrate(0, 4000, |wi| (DVec3::ONE - shadow.coat(0.5 * (wo + wi).length())) * (wi.z / PI));
    let sum = (diffuse + shadow.albedo(SPECULAR_REFLECTION, 4000)).x;
    println!("albedo {sum:.3} with glTF's weights");
    assert!(sum > 1.1, "albedo {sum}");
}

fn smooth_dielectrics_keep_all_energy() {
    let mut worst = 0.0_f64;
    for ior in [1.0, 1.0001, 1.02, 1.1, 1.33, 1.5, 2.4, 3.0, IOR_MAX] {
        for (thin, front) in [(false, true), (false, false), (true, true)] {
            for cos in [1.0, 0.99, 0.8, 0.66, 0.4, 0.1, 0.01, 1.0e-4] {
                let material = white(Material { roughness: 0.0, thin, ..glass(ior) });
                let surface = Surface { name: "glass", material, front };
                let bsdf = Bsdf::new(&material, direction(cos, 0.3), front, FEATURES_ALL);
                let mut sum = 0.0;
                let mut seen = [false; LOBES as usize];
                for word in [0, u32::MAX] {
                    let sample = bsdf.sample(UVec4::new(5, 6, 7, word));
                    if !std::mem::replace(&mut seen[sample.lobe as usize], true) && sample.pdf > 0.0 {
                        assert!(sample.delta, "a smooth lobe is no delta");
                        sum += f64::from(sample.weight.x) * f64::from(sample.pdf) * surface.scale(sample.lobe, 2);
                    }
                }
                worst = worst.max((sum - 1.0).abs());
            }
        }
    }
    println!("reflected and transmitted energy is off by {worst:.1e} at most");
    // thirty roundings: the fourth power of an inverse that has four, and their like in the transmission
    assert!(worst < 30.0 * ROUNDING, "energy off by {worst:.2e}");
}

fn lobes_add_up() {
    for setting in settings(&surfaces(), &[0.005, 0.1, 1.0], &COSINES) {
        let (bsdf, words) = (setting.bsdf(), random_words(&setting, 8));
        for i in 0..200 {
            let sample = bsdf.sample(words(i));
            let whole = bsdf.evaluate(sample.direction);
            let parts: Vec<_> = (0..LOBES).map(|lobe| bsdf.evaluate_lobe(lobe, sample.direction)).collect();
            let value: Vec3 = parts.iter().map(|part| part.value).sum();
            let pdf: f32 = parts.iter().map(|part| part.pdf).sum();
            assert!(value == whole.value && pdf == whole.pdf, "{}: parts of {whole:?}", setting.name());
            let matches = sample.delta || sample.pdf == 0.0 || sample.pdf == whole.pdf;
            assert!(matches, "{}: {sample:?} has another density", setting.name());
        }
        let selections = bsdf.selection(0) + bsdf.selection(1) + bsdf.selection(2);
        assert!(selections == 1.0, "{}: selection adds to {selections}", setting.name());
    }
}

/// The general kernel and the one for the material's own features give the same bits.
fn features_change_no_bit() {
    for setting in settings(&surfaces(), &[0.0, 0.3], &COSINES) {
        let Surface { material, front, .. } = setting.surface;
        let own = Bsdf::new(&material, setting.wo, front, material.features() & setting.features());
        let (general, words) = (setting.bsdf(), random_words(&setting, 9));
        for i in 0..500 {
            let (a, b) = (own.sample(words(i)), general.sample(words(i)));
            assert!(a == b, "{}: {a:?} and {b:?}", setting.name());
            let wi = if i & 1 == 0 { a.direction } else { flipped(a.direction) };
            assert!(own.evaluate(wi) == general.evaluate(wi), "{}: to {wi}", setting.name());
        }
    }
}

/// The ends of all ranges.
fn extremes_are_finite() {
    let words = [0, 0xff, 0x100, 1 << 31, u32::MAX - 0x100, u32::MAX];
    let roughnesses = [0.0, 0.5 * DELTA_BELOW, DELTA_BELOW, 0.02, 1.0];
    let cosines = [1.0, 0.5, 1.0e-3, 1.0e-5, 2.0 * COS_MIN, COS_MIN, 0.5 * COS_MIN];
    let mut surfaces = surfaces();
    for ior in [1.000_000_1, 1.0001, 1.01, IOR_MAX] {
        surfaces.extend([Surface::back("glass", glass(ior)), Surface::front("glass", glass(ior))]);
    }
    surfaces.push(Surface::front("black", Material::diffuse(Vec3::ZERO)));
    surfaces.push(Surface::front("black metal", Material { base_color: Vec3::ZERO, ..metal() }));
    let fine = |v: Vec3| v.is_finite() && v.min_element() >= 0.0;
    settings(&surfaces, &roughnesses, &cosines).par_iter().for_each(|setting| {
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
            assert!(good, "{}: {sample:?}, length {length}", setting.name());
            for wi in [-setting.wo, flipped(setting.wo), Vec3::Z, -Vec3::Z, flipped(sample.direction)] {
                let Evaluation { value, pdf } = bsdf.evaluate(wi);
                let good = fine(value) && (0.0..1.0e30).contains(&pdf);
                assert!(good, "{}: {value} and {pdf} to {wi}", setting.name());
            }
            let inverse = bsdf.invert(sample.lobe, sample.direction, UVec4::new(word(3), word(2), word(1), word(0)));
            let again = bsdf.sample(inverse);
            assert!(sample.pdf == 0.0 || fine(again.weight), "{}: {again:?}", setting.name());
        }
    });
}
