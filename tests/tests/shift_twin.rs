//! Jacobians of shifts: the formulas in `f64` against differences of random numbers, and the kernels' against the formulas.

use libtest_mimic::Failed;
use restir_shared::geometry::Ray;
use restir_shared::glam::DVec3;
use restir_shared::layout::FEATURE_VOLUME;
use restir_shared::scene::{AddressedLight, AddressedLights, LightKind, LightSample, Surface, SurfacePoint};
use restir_shared::shift::{Hybrid, Path, Start};
use restir_shared::transport::Vertex;
use restir_shared::vec::dot;
use restir_tests::scenes::buffers;
use restir_tests::shift_f64::{Case, Configuration, Corner, Leg, Seen, Wrong};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_pt::Picture;
use std::collections::BTreeMap;

restir_tests::suite! {
    formulas_are_differences wrong_formulas_are_not kernels_follow_the_formulas
}

/// The relative error that differences may have.
const DIFFERENCES: f64 = 1.0e-6;
/// A wrong Jacobian that is off by this is seen.
const OFF: f64 = 1.0e-3;

/// Random configurations with their Jacobians by differences.
fn configurations() -> impl Iterator<Item = (Configuration, f64)> {
    let configurations = (0..200_000).filter_map(Configuration::random);
    configurations.filter_map(|configuration| configuration.differences().map(|jacobian| (configuration, jacobian)))
}

/// Cases A, A', B with C, and E. The numbers of D, F, G and H are the same at both ends.
fn formulas_are_differences() -> Result<(), Failed> {
    let (mut worst, mut behind) = (0.0_f64, 0);
    let mut counts: BTreeMap<Case, u32> = BTreeMap::new();
    for (configuration, expected) in configurations() {
        worst = worst.max((configuration.jacobian(None) / expected - 1.0).abs());
        *counts.entry(configuration.case).or_default() += 1;
        behind += u32::from(configuration.is_behind());
    }
    println!("{counts:?}, of which {behind} join a surface from behind: off by at most {worst:.1e}");
    ensure(counts.len() == 4 && counts.values().all(|&n| n > 100) && behind > 100, || "too few".into())?;
    ensure(worst < DIFFERENCES, || format!("a Jacobian is off by {worst:e}"))
}

fn wrong_formulas_are_not() -> Result<(), Failed> {
    for wrong in [Wrong::LeftOut, Wrong::Inverted, Wrong::Saturated, Wrong::FirstOnly, Wrong::AllLobes] {
        let off = |&(configuration, expected): &(Configuration, f64)| {
            let error = (configuration.jacobian(Some(wrong)) / expected - 1.0).abs();
            // zero over zero is no number, and no Jacobian
            error.is_nan() || error > OFF
        };
        let count = configurations().filter(off).count();
        println!("{wrong:?}: {count} are off");
        ensure(count > 100, || format!("{wrong:?} is seen {count} times"))?;
    }
    Ok(())
}

/// The relative error of a term or an integrand that `f32` may have.
const KERNELS: f64 = 1.0e-4;
/// The error of a cosine, of directions that are right to a rounding or two in each component.
const COSINE: f64 = 2.0e-7;

fn kernels_follow_the_formulas() -> Result<(), Failed> {
    let mut kinds: BTreeMap<&str, u32> = BTreeMap::new();
    let mut worst = [0.0_f64; 2];
    for name in ["cornell", "glossy", "all-lights", "tower", "glass"] {
        let buffers = buffers(name)?;
        let picture = Picture::new(&buffers, 24, 6, Hybrid::new(0.2, 0.1));
        for [x, y] in picture.pairs([2, 1]) {
            let Some(away) = picture.start(y) else { continue };
            for found in (0..8).flat_map(|frame| picture.found(x, frame)) {
                let path = found.stored.unpack().path;
                let shifted = picture.shift(&found.stored, &away);
                let Some((kind, twin)) = (if shifted.term > 0.0 { twin(&picture, &path, &away) } else { None }) else {
                    continue;
                };
                let term = (f64::from(shifted.term) / twin.term - 1.0).abs();
                let value = (shifted.value.as_dvec3() - twin.value).abs().max_element() / twin.value.max_element();
                let allowed = KERNELS + COSINE / twin.least_cos;
                ensure(term < allowed && value < allowed, || {
                    format!("{name}, {kind}, {x:?} to {y:?}: off by {term:.1e} and {value:.1e}, {path:?}")
                })?;
                worst = [worst[0].max(term), worst[1].max(value)];
                *kinds.entry(kind).or_default() += 1;
            }
        }
    }
    println!("{kinds:?}: terms off by {:.1e}, integrands by {:.1e}", worst[0], worst[1]);
    ensure(kinds.len() == 9 && kinds.values().all(|&n| n > 20), || format!("{kinds:?} are too few"))
}

/// A shifted path.
struct Twin {
    value: DVec3,
    term: f64,
    /// Of the angles under which it leaves surfaces.
    least_cos: f64,
}

/// What the formulas say of a path that is joined at vertex 2, with the name of its case; nothing of longer replays, of interiors, and
/// of surfaces whose lobes the twin does not know.
fn twin(picture: &Picture<'_>, path: &Path, start: &Start) -> Option<(&'static str, Twin)> {
    let scene = &picture.scene;
    let see = |ray: &Ray, direction: DVec3, point: &SurfacePoint| -> Option<(Seen, Vertex)> {
        let vertex = Vertex::new(point, ray, scene.features);
        let seen = Corner::new(point).seen(direction, &vertex.bsdf, scene.features);
        let absorbs = scene.features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0;
        (seen.is_known() && !absorbs).then_some((seen, vertex))
    };
    if path.reconnection != 2 {
        return None;
    }
    let ray = start.ray();
    let (mut seen, vertex) =
        see(&ray, ray.direction.as_dvec3().normalize(), &scene.surface(&ray, &start.hit.unpack()))?;
    let (mut value, mut term, mut lobe, mut least_cos) = (DVec3::ONE, 1.0, path.lobes[0], 1.0_f64);
    if path.keeps_surface() {
        let joint = LightSample::surface(&scene.location(&path.hit));
        let ray = Ray { direction: vertex.connect_by(&joint, lobe).direction, ..ray };
        let point = scene.surface(&ray, &path.hit);
        let leg = Leg::new(&seen, point.position.as_dvec3());
        value = seen.value(leg.direction) / seen.pdf_of_all(leg.direction);
        term = seen.pdf(lobe, leg.direction) * leg.per_area(point.normal.as_dvec3());
        least_cos = seen.cos(leg.direction).min(point.normal.as_dvec3().dot(leg.direction).abs());
        seen = see(&ray, leg.direction, &point)?.0;
        lobe = path.lobes[1];
    }
    if !path.keeps_light() {
        let direction = path.direction.as_dvec3().normalize();
        let factor = seen.value(direction) / seen.pdf_of_all(direction);
        let drawn = seen.pdf(lobe, direction);
        let least_cos = least_cos.min(seen.cos(direction));
        return Some(("A", Twin { value: value * factor * path.radiance.as_dvec3(), term: term * drawn, least_cos }));
    }
    let light = scene.light_at(path.light);
    let (factor, drawn, cos) = lit(&seen, &light, lobe, path.light_sampled);
    let least_cos = least_cos.min(cos);
    let kind = match (path.keeps_surface(), path.light_sampled, light.sample.kind) {
        (true, true, LightKind::Environment | LightKind::Area) => "B",
        (true, true, _) => "B and H",
        (true, false, _) => "A'",
        (false, true, LightKind::Environment) => "F",
        (false, true, LightKind::Area) => "D",
        (false, true, _) => "H",
        (false, false, LightKind::Environment) => "E",
        (false, false, _) => "C",
    };
    Some((kind, Twin { value: value * factor, term: term * drawn, least_cos }))
}

/// What a vertex does to a light, in random numbers and weighted, the light's part of the term, and the smallest cosine.
fn lit(seen: &Seen, light: &AddressedLight, lobe: u32, sampled: bool) -> (DVec3, f64, f64) {
    let AddressedLight { sample, extent } = light;
    let position = sample.position.as_dvec3();
    let leg = if sample.at_infinity() { Leg::far(position) } else { Leg::new(seen, position) };
    let normal = sample.normal.as_dvec3().normalize();
    let area = match sample.kind {
        LightKind::Area => leg.per_area(normal),
        LightKind::Point => leg.distance.powi(-2),
        LightKind::Directional | LightKind::Environment => 1.0,
    };
    let falloff = if sample.kind == LightKind::Point {
        f64::from(sample.spot_falloff(-normal.dot(leg.direction) as f32))
    } else {
        1.0
    };
    let found = if sample.is_punctual() { 0.0 } else { seen.pdf_of_all(leg.direction) * area };
    let (density, extent) = (f64::from(sample.density), f64::from(*extent));
    let value = seen.value(leg.direction) * sample.emission.as_dvec3() * (falloff * area / (density + found));
    let cos_light = if sample.kind == LightKind::Area { normal.dot(leg.direction).abs() } else { 1.0 };
    let term = extent * if sampled { density } else { seen.pdf(lobe, leg.direction) * area };
    (value, term, seen.cos(leg.direction).min(cos_light))
}
