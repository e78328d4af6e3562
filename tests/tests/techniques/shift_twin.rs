//! Jacobians of shifts: the formulas in `f64` against differences of random numbers, and the kernels' against the formulas.

use libtest_mimic::Failed;
use restir_shared::geometry::Ray;
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::layout::FEATURE_VOLUME;
use restir_shared::scene::{
    AddressedLight, AddressedLights, LightKind, LightSample, Lights, Surface, SurfacePoint, Trace,
};
use restir_shared::shift::{Hybrid, Numbers, Path, PathOrigin};
use restir_shared::technique::restir_pt::PathNumbers;
use restir_shared::transport::Vertex;
use restir_shared::vec::dot;
use restir_tests::scenes::buffers;
use restir_tests::shift_f64::{Case, Configuration, Corner, Leg, PLAIN, Seen, Wrong};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_pt::Picture;
use std::collections::BTreeMap;

restir_tests::suite! {
    later {
        formulas_are_differences grazing_formulas_are_differences wrong_formulas_are_not kernels_follow_the_formulas
    }
}

/// The relative error that differences may have.
const DIFFERENCES: f64 = 1.0e-6;
/// A wrong Jacobian that is off by this is seen.
const OFF: f64 = 1.0e-3;
/// The smallest cosine of grazing configurations.
const GRAZING: f64 = 1.0e-3;
/// Random numbers of which configurations are made, where there are any; few graze a surface and still reach the next one.
const PLAIN_ONES: u64 = 200_000;
const GRAZING_ONES: u64 = 1_000_000;

/// A Jacobian by differences, and how far that may be off.
struct Measured {
    configuration: Configuration,
    jacobian: f64,
    error: f64,
}

/// Random configurations with their Jacobians by differences.
fn configurations(least_cos: f64, count: u64) -> impl Iterator<Item = Measured> {
    let configurations = (0..count).filter_map(move |index| Configuration::random(index, least_cos));
    configurations.filter_map(|configuration| {
        configuration.differences().map(|(jacobian, error)| Measured { configuration, jacobian, error })
    })
}

/// All cases, of which a light may have another share of its table in the other frame and another form.
fn formulas_are_differences() -> Result<(), Failed> {
    let (mut worst, mut behind) = (0.0_f64, 0);
    let mut counts: BTreeMap<Case, u32> = BTreeMap::new();
    for Measured { configuration, jacobian, .. } in configurations(PLAIN, PLAIN_ONES) {
        worst = worst.max((configuration.jacobian(None) / jacobian - 1.0).abs());
        *counts.entry(configuration.case).or_default() += 1;
        behind += u32::from(configuration.is_behind());
    }
    println!("{counts:?}, of which {behind} join a surface from behind: off by at most {worst:.1e}");
    let all = counts.len() == Case::ALL.len() && counts.values().all(|&n| n > 100);
    ensure(all && behind > 100, || "too few".into())?;
    ensure(worst < DIFFERENCES, || format!("a Jacobian is off by {worst:e}"))
}

/// The same where segments leave or meet surfaces almost along them. Densities bend faster there, so differences know less: by how much they
/// change with the step. Where that is more than a wrong formula would be off by, nothing is said.
fn grazing_formulas_are_differences() -> Result<(), Failed> {
    let (mut told, mut untold, mut worst) = (0, 0, 0.0_f64);
    for Measured { configuration, jacobian, error } in configurations(GRAZING, GRAZING_ONES) {
        if !configuration.is_grazing() {
            continue;
        }
        if error > OFF * jacobian {
            untold += 1;
            continue;
        }
        told += 1;
        let off = (configuration.jacobian(None) - jacobian).abs();
        worst = worst.max(off / jacobian);
        ensure(off <= DIFFERENCES * jacobian + error, || {
            format!("a Jacobian of {jacobian:e} is off by {off:e}, and may be by {error:e}: {configuration:?}")
        })?;
    }
    println!("{told} grazing ones, off by at most {worst:.1e}; of {untold} differences tell nothing");
    ensure(told > 1_000 && untold * 20 < told, || format!("{told} are told, {untold} are not"))
}

fn wrong_formulas_are_not() -> Result<(), Failed> {
    for wrong in [
        Wrong::LeftOut,
        Wrong::Inverted,
        Wrong::Saturated,
        Wrong::FirstOnly,
        Wrong::AllLobes,
        Wrong::NoExtent,
        Wrong::ReplayCounted,
    ] {
        let off = |measured: &Measured| {
            let error = (measured.configuration.jacobian(Some(wrong)) / measured.jacobian - 1.0).abs();
            // zero over zero is no number, and no Jacobian
            error.is_nan() || error > OFF
        };
        let count = configurations(PLAIN, PLAIN_ONES).filter(off).count();
        println!("{wrong:?}: {count} are off");
        ensure(count > 100, || format!("{wrong:?} is seen {count} times"))?;
    }
    Ok(())
}

/// The relative error of a term or an integrand that `f32` may have.
const KERNELS: f64 = 1.0e-4;
/// The error of a cosine, of directions that are right to a rounding or two in each component.
const COSINE: f64 = 2.0e-7;

/// Paths are joined as soon as possible, late enough for some to be replayed first, and not at all.
const CRITERIA: [Hybrid; 3] = [Hybrid::new(0.2, 0.1), Hybrid::new(0.2, 1.5), Hybrid::REPLAY];
/// Cases that have to be seen: of the table in `restir_shared::shift`, and of paths that are joined after a replay.
const KINDS: [&str; 13] = [
    "A, k = 2",
    "A', k = 2",
    "B, k = 2",
    "B and H, k = 2",
    "C, k = 2",
    "D, k = 2",
    "E, k = 2",
    "F, k = 2",
    "H, k = 2",
    "A, k = 3",
    "B, k = 3",
    "D, k = 3",
    "G",
];

fn kernels_follow_the_formulas() -> Result<(), Failed> {
    let mut kinds: BTreeMap<String, u32> = BTreeMap::new();
    let mut worst = [0.0_f64; 2];
    for (name, hybrid) in ["cornell", "glossy", "all-lights", "tower", "glass"]
        .into_iter()
        .flat_map(|name| CRITERIA.map(|hybrid| (name, hybrid)))
    {
        let buffers = buffers(name)?;
        let picture = Picture::new(&buffers, 24, 6, hybrid);
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
                let k = if path.reconnection == 0 { String::new() } else { format!(", k = {}", path.reconnection) };
                *kinds.entry(kind.to_owned() + &k).or_default() += 1;
            }
        }
    }
    println!("{kinds:?}: terms off by {:.1e}, integrands by {:.1e}", worst[0], worst[1]);
    let few = KINDS.iter().filter(|kind| kinds.get(**kind).is_none_or(|&count| count <= 20));
    let few: Vec<_> = few.collect();
    ensure(few.is_empty(), || format!("{few:?} are too few of {kinds:?}"))
}

/// A shifted path.
struct Twin {
    value: DVec3,
    term: f64,
    /// Of the angles under which it leaves surfaces.
    least_cos: f64,
}

/// What the formulas say of a path, with the name of its case; nothing of interiors, of surfaces whose lobes the twin does not know, and of
/// perfect lobes. Vertices that are replayed are where the kernels' rays say.
fn twin(picture: &Picture<'_>, path: &Path, start: &PathOrigin) -> Option<(&'static str, Twin)> {
    let scene = &picture.scene;
    let see = |ray: &Ray, direction: DVec3, point: &SurfacePoint| -> Option<(Seen, Vertex)> {
        let vertex = Vertex::new(point, ray, scene.features);
        let seen = Corner::new(point).seen(direction, &vertex.bsdf, scene.features);
        let absorbs = scene.features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0;
        (seen.is_known() && !absorbs).then_some((seen, vertex))
    };
    let along = |ray: &Ray| ray.direction.as_dvec3().normalize();
    let numbers = PathNumbers::of_key(path.key, picture.params.seed, picture.params.flags.sampler());
    let (mut ray, mut hit) = (start.ray(), start.hit.unpack());
    let (mut value, mut least_cos) = (DVec3::ONE, 1.0_f64);
    let (mut seen, mut vertex) = see(&ray, along(&ray), &scene.surface(&ray, &hit))?;
    for index in 1..path.last_replayed() {
        let departure = vertex.depart(numbers.scatter(index), scene.features);
        ray = departure.ray;
        let direction = along(&ray);
        let density = seen.pdf_of_all(direction);
        value *= seen.value(direction) / density;
        least_cos = least_cos.min(seen.cos(direction));
        if departure.sample.delta {
            return None;
        }
        hit = scene.closest(&ray);
        let found = |radiance: Vec3, per_area: f64, light: f64, least_cos: f64| {
            let weight = density * per_area / (density * per_area + light);
            ("G", Twin { value: value * radiance.as_dvec3() * weight, term: 1.0, least_cos })
        };
        if !hit.is_hit() {
            let environment = scene.environment(ray.direction);
            return Some(found(environment.radiance, 1.0, f64::from(environment.density), least_cos));
        }
        let point = scene.surface(&ray, &hit);
        let cos = point.normal.as_dvec3().normalize().dot(direction).abs();
        least_cos = least_cos.min(cos);
        if index + 1 == path.length {
            let per_area = cos / f64::from(hit.t).powi(2);
            let absorbs = scene.features & FEATURE_VOLUME != 0 && dot(point.normal, ray.direction) > 0.0;
            let density = f64::from(scene.light_density(&hit));
            return (!absorbs).then(|| found(point.emission, per_area, density, least_cos));
        }
        (seen, vertex) = see(&ray, direction, &point)?;
    }
    let (mut term, mut lobe) = (1.0, path.lobes[0]);
    if path.keeps_surface() {
        let joint = LightSample::surface(&scene.location(&path.hit));
        let ray = Ray { direction: vertex.connect_by(&joint, lobe).direction, ..ray };
        let point = scene.surface(&ray, &path.hit);
        let leg = Leg::new(&seen, point.position.as_dvec3());
        value *= seen.value(leg.direction) / seen.pdf_of_all(leg.direction);
        term = seen.pdf(lobe, leg.direction) * leg.per_area(point.normal.as_dvec3());
        least_cos = least_cos.min(seen.cos(leg.direction)).min(point.normal.as_dvec3().dot(leg.direction).abs());
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
