//! What techniques that resample paths stand on: receivers of what a path finds, reconnections of a vertex with a point of
//! another surface, random numbers from a stored key.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_shared::bsdf::{self, LOBES};
use restir_shared::camera::primary_ray;
use restir_shared::geometry::Ray;
use restir_shared::glam::{DVec3, Vec2, Vec3};
use restir_shared::rng::{self, Rng, Sampler};
use restir_shared::scene::{LightKind, LightSample, Lights, Location, Surface, SurfacePoint, Trace};
use restir_shared::technique::path::{self, Receiver, Walk};
use restir_shared::transport::{Connection, Vertex};
use restir_shared::vec::dot;
use restir_tests::random::SplitMix;
use restir_tests::scenes::buffers;
use restir_tests::stats::Moments;
use restir_tests::suite::ensure;

restir_tests::suite! {
    later {
        what_a_receiver_gets_is_the_radiance one_path_of_many_keeps_the_mean reconnecting_to_an_emitter_is_next_event
        densities_of_lobes_add_up a_reconnection_measures_solid_angle a_stored_key_draws_the_same_numbers
    }
}

const SIDE: u32 = 24;
const DEPTH: u32 = 6;

/// Camera rays of a small picture.
fn rays(buffers: &SceneBuffers) -> impl Iterator<Item = Ray> {
    let camera = buffers.camera.params(SIDE, SIDE);
    (0..SIDE * SIDE).map(move |i| primary_ray(&camera, Vec2::new((i % SIDE) as f32, (i / SIDE) as f32), Vec2::ZERO))
}

/// Keeps all values.
#[derive(Default)]
struct All(Vec<Vec3>);

impl Receiver for All {
    fn add(&mut self, value: Vec3) {
        self.0.push(value);
    }
}

fn what_a_receiver_gets_is_the_radiance() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    let mut values = 0;
    for (i, ray) in (0..).zip(rays(&buffers)) {
        let (rng, mut all) = (Rng::new(i, 0, 0, 1, Sampler::Independent), All::default());
        ensure(Walk::new(ray).run(&buffers.view(), &rng, DEPTH, true, &mut all), || format!("path {i} was cut"))?;
        let sum = all.0.iter().fold(Vec3::ZERO, |sum, value| sum + *value);
        let radiance = path::radiance(&buffers.view(), ray, &rng, DEPTH, true);
        ensure(sum == radiance, || format!("path {i}: {sum} for {radiance}"))?;
        values += all.0.len();
    }
    ensure(values > (SIDE * SIDE) as usize, || format!("{values} values are too few to tell"))
}

/// Path-tree RIS in its simplest form (Lin et al. 2022, §5): keeps one value, with a probability in proportion to its brightness,
/// and what it then stands for.
struct One {
    random: SplitMix,
    kept: Vec3,
    sum_of_weights: f32,
    wrong: bool,
}

impl Receiver for One {
    fn add(&mut self, value: Vec3) {
        let target = value.element_sum();
        self.sum_of_weights += target;
        if self.random.range(0.0, f64::from(self.sum_of_weights)) < f64::from(target) {
            self.kept = value;
        }
    }
}

impl One {
    /// The estimate; the wrong one is that of the value alone, as if it were all there is.
    fn estimate(&self) -> Vec3 {
        let scale = if self.wrong { 1.0 } else { self.sum_of_weights / self.kept.element_sum().max(f32::MIN_POSITIVE) };
        self.kept * scale
    }
}

/// Two-sided tests of a right estimate fail with probability 0.001.
const CRITICAL: f64 = 3.29;

fn one_path_of_many_keeps_the_mean() -> Result<(), Failed> {
    let buffers = buffers("cornell")?;
    for wrong in [false, true] {
        let mut difference = Moments::default();
        let mut whole = Moments::default();
        for seed in 0..64 {
            for (i, ray) in (0..).zip(rays(&buffers)) {
                let rng = Rng::new(i, 0, 0, seed, Sampler::Independent);
                let stream = u64::from(i) << 32 | u64::from(seed);
                let mut one = One { random: SplitMix::new(stream), kept: Vec3::ZERO, sum_of_weights: 0.0, wrong };
                Walk::new(ray).run(&buffers.view(), &rng, DEPTH, false, &mut one);
                let all = path::radiance(&buffers.view(), ray, &rng, DEPTH, false);
                difference.push(f64::from(one.estimate().x - all.x));
                whole.push(f64::from(all.x));
            }
        }
        let z = difference.mean() / difference.standard_error();
        // what the test would notice with probability 0.99
        let noticed = (CRITICAL + 2.33) * difference.standard_error() / whole.mean();
        println!("one path kept, wrong {wrong}: z {z:.1}, a bias of {:.2} % is noticed", 100.0 * noticed);
        ensure(wrong || noticed < 0.01, || format!("a bias of {noticed} may go unnoticed"))?;
        ensure((z.abs() > CRITICAL) == wrong, || format!("wrong {wrong}, {z:.1} standard errors"))?;
    }
    Ok(())
}

/// Vertices where camera rays end, with what lies there.
fn vertices(buffers: &SceneBuffers) -> Vec<(Vertex, SurfacePoint)> {
    let view = buffers.view();
    let hits = rays(buffers).map(|ray| (ray, view.closest(&ray))).filter(|(_, hit)| hit.is_hit());
    let seen = hits.map(|(ray, hit)| (ray, view.surface(&ray, &hit)));
    seen.map(|(ray, point)| (Vertex::new(&point, &ray, view.features()), point)).collect()
}

/// The surface on which a light sample lies.
fn surface_of(light: &LightSample) -> SurfacePoint {
    SurfacePoint::diffuse(light.position, light.normal, light.offset, Vec3::ZERO)
}

/// The connection with a point of another surface.
fn connect(vertex: &Vertex, point: &SurfacePoint, lobe: u32) -> Connection {
    vertex.connect_by(
        &LightSample::surface(&Location {
            position: point.position,
            normal: point.normal,
            offset: point.offset,
            extent: 1.0,
        }),
        lobe,
    )
}

fn bits(v: Vec3) -> [u32; 3] {
    v.to_array().map(f32::to_bits)
}

fn reconnecting_to_an_emitter_is_next_event() -> Result<(), Failed> {
    let mut compared = 0;
    for name in ["cornell", "all-lights", "glossy"] {
        let buffers = buffers(name)?;
        for (i, (vertex, _)) in (0..).zip(vertices(&buffers)) {
            let light = buffers.view().sample_light(Rng::new(i, 0, 0, 2, Sampler::Independent).draw(0));
            let connection: Connection = vertex.connect(&LightSample { two_sided: true, ..light });
            if light.kind != LightKind::Area || connection.value == Vec3::ZERO {
                continue;
            }
            let link = connect(&vertex, &surface_of(&light), 0);
            let Connection { value, scatter_pdf, shadow, .. } = link;
            let close = |a: f32, b: f32| (a - b).abs() <= 1.0e-6 * b.abs();
            let same = close(scatter_pdf, connection.scatter_pdf)
                && close(link.per_area(), connection.cos_light / connection.distance_squared)
                && (0..3).all(|k| close(value[k] * light.emission[k], connection.value[k]))
                && bits(shadow.origin) == bits(connection.shadow.origin)
                && bits(shadow.direction) == bits(connection.shadow.direction);
            ensure(same, || format!("{name}, vertex {i}: the two ways differ"))?;
            compared += 1;
        }
    }
    ensure(compared > 500, || format!("{compared} vertices are too few"))
}

/// Pairs of vertices and surface points of a scene, at random.
fn pairs(buffers: &SceneBuffers) -> Vec<(Vertex, SurfacePoint)> {
    let points: Vec<SurfacePoint> = vertices(buffers).into_iter().map(|(_, point)| point).collect();
    let mut random = SplitMix::new(5);
    vertices(buffers).into_iter().map(|(vertex, _)| (vertex, points[random.below(points.len())])).collect()
}

fn densities_of_lobes_add_up() -> Result<(), Failed> {
    let mut shared = 0;
    for name in ["glossy", "all-lights", "glass"] {
        for (i, (vertex, point)) in pairs(&buffers(name)?).into_iter().enumerate() {
            let all = connect(&vertex, &point, 0);
            let lobes: Vec<f32> = (0..LOBES).map(|lobe| connect(&vertex, &point, lobe).lobe_pdf).collect();
            // two lobes at most lie on the side of the point, of which the specular one may be either
            let specular = lobes[bsdf::SPECULAR_REFLECTION as usize].max(lobes[bsdf::SPECULAR_TRANSMISSION as usize]);
            let sum = lobes[0] + lobes[1] + specular;
            ensure((sum - all.scatter_pdf).abs() <= 1.0e-6 * all.scatter_pdf, || {
                format!("{name} {i}: {lobes:?} for {}", all.scatter_pdf)
            })?;
            shared += usize::from(lobes.iter().all(|pdf| *pdf < all.scatter_pdf) && all.scatter_pdf > 0.0);
        }
    }
    ensure(shared > 100, || format!("{shared} directions are given by two lobes: too few to tell"))
}

/// The solid angle of a triangle seen from `eye` (Van Oosterom and Strackee 1983).
fn solid_angle(eye: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| (corner - eye).normalize());
    2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The solid angle of a small triangle around a point, per its area, is what a reconnection says; so the Jacobian is the ratio.
fn a_reconnection_measures_solid_angle() -> Result<(), Failed> {
    let buffers = buffers("cornell")?;
    let (mut compared, mut unlike) = (0, 0);
    for (vertex, point) in pairs(&buffers) {
        let link = connect(&vertex, &point, 0);
        let (normal, position) = (point.normal.as_dvec3(), point.position.as_dvec3());
        let distance = link.shadow.direction.as_dvec3().length();
        if link.value == Vec3::ZERO || distance < 0.1 || dot(link.direction, point.normal).abs() < 0.1 {
            continue;
        }
        let (tangent, side) = (normal.any_orthonormal_vector(), 1.0e-3 * distance);
        let corners = [0.0, 1.0, 2.0].map(|third: f64| {
            let (sin, cos) = (third * std::f64::consts::TAU / 3.0).sin_cos();
            position + side * (cos * tangent + sin * normal.cross(tangent))
        });
        let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() / 2.0;
        let expected = solid_angle(link.shadow.origin.as_dvec3(), corners) / area;
        let error = (f64::from(link.per_area()) / expected - 1.0).abs();
        // the triangle is flat and small: (side / distance)² and roundings are left
        ensure(error < 1.0e-4, || format!("{} for {expected}", link.per_area()))?;
        let without_cosine = 1.0 / (distance * distance);
        unlike += usize::from((without_cosine / expected - 1.0).abs() > 0.1);
        compared += 1;
    }
    println!("{compared} pairs, of which {unlike} show a cosine that is left out");
    ensure(compared > 200 && unlike > compared / 2, || format!("{unlike} of {compared} pairs tell"))
}

fn a_stored_key_draws_the_same_numbers() -> Result<(), Failed> {
    for (name, sampler) in Sampler::NAMED {
        let mut words = std::collections::HashSet::new();
        for i in 0..1_000 {
            let rng = Rng::new(i, 1 + i / 7, 3, 11, sampler);
            let again = Rng::from_key(rng.key(), sampler);
            ensure(again == rng && again.draw(i) == rng.draw(i), || format!("{name}: key {}", rng.key()))?;
            words.extend([0, 1, 255].map(|id| rng.draw(rng::stream(id) + i % 10)));
        }
        // 128 bits each: none comes twice
        ensure(words.len() == 3_000, || format!("{name}: {} of 3000 draws differ", words.len()))?;
    }
    Ok(())
}
