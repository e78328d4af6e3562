//! Scenes of other types: by ReSTIR DI in sessions, and the check of what they answer.

use libtest_mimic::Failed;
use restir_host::exec::CpuExecutor;
use restir_host::foreign::check;
use restir_host::scene::{Camera, Scene};
use restir_host::session::{CpuSession, SceneChange, Setup, View};
use restir_host::technique::restir_di::DiSettings;
use restir_host::{Error, buffers::SceneBuffers};
use restir_shared::bsdf::{BsdfSample, Material, Scattering, ScatteringFunction};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{DVec3, UVec4, Vec3};
use restir_shared::layout::{CameraParams, FilmPixel};
use restir_shared::medium::Interior;
use restir_shared::num;
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{
    AddressedLight, AddressedLights, EnvironmentPoint, LightAddress, LightSample, Lights, SceneView, Still, Surface,
    SurfacePoint, Trace,
};
use restir_shared::technique::path;
use restir_shared::technique::restir_di::{DiParams, LastFrame, Planes, Stored, combine, initial, primary, shade};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};
use restir_tests::suite::{Trial, ensure};
use restir_tests::technique::restir_di::settings;

#[path = "../../../host/examples/embed_bsdf.rs"]
#[expect(dead_code, reason = "the example's own beginning is not called")]
mod embed_bsdf;

use embed_bsdf::{Inside, OrenNayar};

const SIZE: [u32; 2] = [24, 18];
const SCENES: [&str; 9] =
    ["cornell", "moving", "many-lights", "glass", "glossy", "foliage", "toys", "furnace", "all-lights"];

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials: Vec<Trial> = Vec::new();
    trials.extend(SCENES.map(|name| Trial::test(format!("{name} is consistent"), move || consistent(name))));
    trials.extend(
        FAULTS.map(|(name, words, fault)| Trial::test(format!("{name} is named"), move || is_named(words, fault))),
    );
    trials.push(Trial::test("a session over a foreign scene has the bits of one over arenas", same_bits));
    trials.push(Trial::test("a chain of functions has the bits of a session", chain_of_functions));
    trials.push(Trial::test("cameras are the same", cameras_agree));
    trials.extend([
        Trial::test("a foreign BSDF keeps its energy", foreign_energy),
        Trial::test("a foreign BSDF is sampled with its density", foreign_density),
        Trial::test("words of a foreign BSDF are found again", foreign_inversion),
        Trial::test("paths over a foreign BSDF have their expectation", foreign_paths),
    ]);
    trials.push(Trial::test("each session wants its own frames", refusals));
    trials
}

fn buffers(name: &str) -> Result<SceneBuffers, Error> {
    restir_tests::scenes::buffers(name)
}

fn consistent(name: &str) -> Result<(), Failed> {
    let buffers = buffers(name)?;
    Ok(check(&buffers.traced_view(), &buffers.camera)?)
}

/// What becomes of right answers.
struct Wrong<'a> {
    right: SceneView<'a>,
    fault: Fault,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Of each light, in sampling and in the weights.
    Density,
    /// Of the weights alone.
    DensityOfHits,
    /// Of one light.
    DensityOfOne,
    Extent,
    AddressOffByOne,
    /// The coordinates of an emitter's hit, exchanged.
    AddressTurned,
    /// The point is where the ray says.
    PointByRay,
    Normal,
    Emission,
    Occluded,
    /// Sampling draws another light than the address of the same words.
    Sampled,
    /// Of directions that reach the environment, in the weights alone.
    EnvironmentDensity,
    /// What arrives from there.
    Radiance,
    /// A quarter of the map away.
    EnvironmentAddress,
}

const FAULTS: [(&str, &str, Fault); 14] = [
    ("a density that is off by 2 %", "sum up to 1.02", Fault::Density),
    ("a density of hits that is off by 2 %", "by light_density()", Fault::DensityOfHits),
    ("a density of one light that is off by 2 %", "sum up to 1.00", Fault::DensityOfOne),
    ("an extent that is off by 2 %", "its extent is", Fault::Extent),
    ("an address that is off by one", "another one's", Fault::AddressOffByOne),
    ("an address with u and v exchanged", "another one's", Fault::AddressTurned),
    ("a point that depends on the ray", "id and uv alone", Fault::PointByRay),
    ("a normal that is no unit vector", "not 1", Fault::Normal),
    ("an emission that differs", "by surface()", Fault::Emission),
    ("visibility that misses the hit", "occluded() finds nothing", Fault::Occluded),
    ("a light sample of another light", "by the same words", Fault::Sampled),
    ("a density of the environment that is off by 2 %", "by environment()", Fault::EnvironmentDensity),
    ("a radiance of the environment that differs", "arrives by environment()", Fault::Radiance),
    ("an address of the environment that is off", "leads to a direction", Fault::EnvironmentAddress),
];

impl Wrong<'_> {
    fn light(&self, light: u32, sample: LightSample) -> LightSample {
        let factor = match self.fault {
            Fault::Density => 1.02,
            Fault::DensityOfOne if light == 0 => 1.02,
            _ => 1.0,
        };
        LightSample { density: sample.density * factor, ..sample }
    }
}

impl Trace for Wrong<'_> {
    fn closest(&self, ray: &Ray) -> Hit {
        self.right.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.fault != Fault::Occluded && self.right.occluded(ray)
    }
}

impl Surface for Wrong<'_> {
    type Material = Material;

    fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let mut point = self.right.surface(ray, hit);
        match self.fault {
            Fault::PointByRay => point.position = ray.origin + ray.direction * hit.t,
            Fault::Normal => point.normal *= 1.1,
            Fault::Emission => point.emission *= 0.5,
            _ => (),
        }
        point
    }

    fn interior(&self, hit: &Hit) -> Interior {
        self.right.interior(hit)
    }

    fn absorbed(&self, hit: &Hit) -> Vec3 {
        self.right.absorbed(hit)
    }

    fn features(&self) -> u32 {
        self.right.features()
    }
}

impl Lights for Wrong<'_> {
    fn sample_light(&self, words: UVec4) -> LightSample {
        let words = if self.fault == Fault::Sampled { UVec4::new(words.y, words.x, words.z, words.w) } else { words };
        self.light(self.right.choose_address(words).light, self.right.sample_light(words))
    }

    fn light_density(&self, hit: &Hit) -> f32 {
        let density = self.right.light_density(hit);
        match self.fault {
            Fault::Density | Fault::DensityOfHits => density * 1.02,
            Fault::DensityOfOne if self.right.address_of_hit(hit).light == 0 => density * 1.02,
            _ => density,
        }
    }

    fn environment(&self, direction: Vec3) -> EnvironmentPoint {
        let point = self.right.environment(direction);
        match self.fault {
            Fault::EnvironmentDensity => EnvironmentPoint { density: point.density * 1.02, ..point },
            Fault::Radiance => EnvironmentPoint { radiance: point.radiance * 0.5, ..point },
            _ => point,
        }
    }
}

impl AddressedLights for Wrong<'_> {
    fn choose_address(&self, words: UVec4) -> LightAddress {
        self.right.choose_address(words)
    }

    fn light_at(&self, address: LightAddress) -> AddressedLight {
        let AddressedLight { sample, extent } = self.right.light_at(address);
        let factor = if self.fault == Fault::Extent { 1.02 } else { 1.0 };
        AddressedLight { sample: self.light(address.light, sample), extent: extent * factor }
    }

    fn address_of_hit(&self, hit: &Hit) -> LightAddress {
        let address = self.right.address_of_hit(hit);
        let LightAddress { light, u, v } = address;
        match self.fault {
            Fault::AddressOffByOne if address.is_light() => {
                LightAddress { light: (light + 1) % self.right.header.light_count, ..address }
            }
            Fault::AddressTurned if address.is_light() => LightAddress { light, u: v, v: u },
            _ => address,
        }
    }

    fn address_of_environment(&self, direction: Vec3) -> LightAddress {
        let address = self.right.address_of_environment(direction);
        let turned = (address.u + (1 << 22)) & 0x00ff_ffff;
        if self.fault == Fault::EnvironmentAddress { LightAddress { u: turned, ..address } } else { address }
    }
}

fn is_named(words: &str, fault: Fault) -> Result<(), Failed> {
    let of_environment = [Fault::EnvironmentDensity, Fault::Radiance, Fault::EnvironmentAddress].contains(&fault);
    let buffers = buffers(if of_environment { "all-lights" } else { "moving" })?;
    let wrong = Wrong { right: buffers.traced_view(), fault };
    let said = check(&wrong, &buffers.camera).err().map(|error| error.to_string()).unwrap_or_default();
    println!("{said}");
    ensure(said.contains(words), || format!("{fault:?} is not named: {said:?}"))
}

/// The scene by its own types, behind a pointer, still and moving.
fn same_bits() -> Result<(), Failed> {
    let scene = Scene::load("moving")?;
    let moving = SceneBuffers::build(&scene)?;
    for text in ["", "preset=quality", "spatial=2,feedback=off"] {
        let setup = Setup::new(moving.clone(), settings(text), SIZE);
        let mut own = CpuSession::new(setup.clone(), CpuExecutor::new()?)?;
        let mut foreign = CpuSession::new(Setup::foreign(moving.features, settings(text), SIZE), CpuExecutor::new()?)?;
        // lights keep their index where none goes out, which is so before frame 5
        for frame in 0..4_u32 {
            let [this, last] = [frame, frame.saturating_sub(1)].map(|frame| moving.at(f64::from(frame)));
            let (this, last) = (this?, last?);
            own.frame(&View {
                scene: SceneChange::Frame(f64::from(frame)),
                camera: Some(moving.camera),
                ..View::default()
            })?;
            foreign.frame_over(&[this.traced_view(), last.traced_view()], moving.camera, true)?;
            ensure(own.pixels() == foreign.pixels(), || format!("{text:?}, frame {frame} differs"))?;
        }
        let still = buffers("cornell")?;
        let mut own = CpuSession::new(Setup::new(still.clone(), settings(text), SIZE), CpuExecutor::new()?)?;
        let setup = Setup::foreign(still.features, settings(text), SIZE);
        let mut foreign = CpuSession::new(setup, CpuExecutor::new()?)?;
        for frame in 0..4 {
            own.frame(&View::default())?;
            foreign.frame_over(&Still(still.traced_view()), still.camera, false)?;
            ensure(own.pixels() == foreign.pixels(), || format!("{text:?}, still frame {frame} differs"))?;
        }
    }
    Ok(())
}

/// What an embedder writes who has no use for `restir-host`: planes, and the functions in their order.
fn chain_of_functions() -> Result<(), Failed> {
    // with blocks whose gloss fades
    let (scene, [width, height], seed) = (buffers("cornell-mixed")?, SIZE, 5);
    let radius = DiParams::new(scene.camera.params(width, height), SIZE, seed).radius;
    let shared = DiSettings { shaded: 0, radius, ..DiSettings::default() };
    let setup = Setup { seed, ..Setup::new(scene.clone(), shared, SIZE) };
    let mut session = CpuSession::new(setup, CpuExecutor::new()?)?;
    let (view, frames) = (scene.traced_view(), Still(scene.traced_view()));
    let pixels: Vec<[u32; 2]> = (0..width * height).map(|i| [i % width, i / width]).collect();
    let camera = |frame: u32| {
        // it moves, and rests for a frame
        let position = scene.camera.position + DVec3::X * (0.1 * f64::from(frame / 2));
        Camera { position, ..scene.camera }
    };
    let params = |frame| camera(frame).params(width, height);
    let (mut last_hits, mut last, mut rounds) = (Vec::new(), Vec::new(), 0);
    for frame in 0..6 {
        let now = DiParams::new(params(0), SIZE, seed).of_frame(frame, params(frame));
        let hits: Vec<_> = pixels.iter().map(|&at| primary(&view, &now, at)).collect();
        let renewed = if frame > 0 { now.renewed_after(params(frame - 1), 7) } else { now };
        let made = pixels.iter().zip(&hits).map(|(&at, &hit)| initial(&view, &renewed, &[], hit, at));
        let (mut reservoirs, direct): (Vec<_>, Vec<_>) = made.map(|made| (made.reservoir, made.direct)).unzip();
        rounds = rounds.max(reservoirs.iter().map(|word| Stored::unpack(*word).confidence as u32).max().unwrap_or(0));
        if frame > 0 {
            let with_last = now.with_last(&LastFrame::of_view(params(frame - 1), params(frame) == params(frame - 1)));
            let planes = Planes { hits: &hits, other_hits: &last_hits, others: &last };
            let merged = pixels
                .iter()
                .zip(&reservoirs)
                .map(|(&at, &own)| combine(frames, &with_last, &planes, own, at).reservoir);
            reservoirs = merged.collect();
        }
        let planes = Planes { hits: &hits, other_hits: &hits, others: &reservoirs };
        let with_neighbours = now.with_neighbours(0);
        let merged = pixels
            .iter()
            .zip(&reservoirs)
            .map(|(&at, &own)| combine(frames, &with_neighbours, &planes, own, at).reservoir);
        let reservoirs: Vec<_> = merged.collect();
        let shaded = (0..pixels.len()).map(|i| shade(view, &now, hits[i], reservoirs[i], direct[i], pixels[i]));
        let shaded: Vec<FilmPixel> = shaded.collect();
        session.frame(&View { camera: Some(camera(frame)), ..View::default() })?;
        ensure(session.pixels() == shaded, || format!("frame {frame} differs"))?;
        (last_hits, last) = (hits, reservoirs);
    }
    ensure(rounds > 1, || "no pixel has more than one round of candidates".to_owned())
}

/// The camera of `restir-shared` is that of the host, but for rounding.
fn cameras_agree() -> Result<(), Failed> {
    let (position, target, up) = (Vec3::new(1.0, 2.0, 5.0), Vec3::new(-0.5, 0.3, 0.0), Vec3::new(0.1, 1.0, -0.2));
    let fov = 0.7_f32;
    let host = Camera::pinhole(position.as_dvec3(), target.as_dvec3(), up.as_dvec3(), f64::from(fov)).params(33, 20);
    let shared = CameraParams::pinhole(position, target, up, fov / std::f32::consts::TAU, [33, 20]);
    let floats = |params: &CameraParams| -> Vec<f32> { bytemuck::cast_slice(&[*params]).to_vec() };
    let off = floats(&host).iter().zip(floats(&shared)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    ensure(off < 1e-6, || format!("they are {off:e} apart: {host:?} {shared:?}"))
}

fn refusals() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let mut own = CpuSession::new(Setup::new(scene.clone(), settings(""), SIZE), CpuExecutor::new()?)?;
    let setup = Setup::foreign(scene.features, settings(""), SIZE);
    let mut foreign = CpuSession::new(setup, CpuExecutor::new()?)?;
    let said = own.frame_over(&Still(scene.traced_view()), scene.camera, false).err().map(|error| error.to_string());
    ensure(said.is_some_and(|said| said.contains("Setup::foreign")), || "a scene has two".to_owned())?;
    let said = foreign.frame(&View::default()).err().map(|error| error.to_string());
    ensure(said.is_some_and(|said| said.contains("frame_over")), || "a foreign scene was not given".to_owned())
}

const ROUGH: OrenNayar = OrenNayar { reflectance: Vec3::splat(0.9), sigma: 0.5 };
/// Points of a quadrature along each of two dimensions.
const POINTS: u32 = 256;

/// The integral over directions of what the model reflects, times a function of their cosine.
fn reflected(model: OrenNayar, cos: f64, of: impl Fn(f64) -> f64) -> f64 {
    let wo = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
    let seen = model.bsdf(wo, true, 0);
    let steps = f64::from(POINTS);
    let cell = |i: u32, j: u32| {
        let (z, turns) = ((f64::from(i) + 0.5) / steps, (f64::from(j) + 0.5) / steps);
        let (ring, angle) = ((1.0 - z * z).sqrt(), turns * std::f64::consts::TAU);
        let wi = Vec3::new((ring * angle.cos()) as f32, (ring * angle.sin()) as f32, z as f32);
        f64::from(seen.evaluate(wi).value.x) * of(z)
    };
    let sum: f64 = (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (i, j))).map(|(i, j)| cell(i, j)).sum();
    sum * std::f64::consts::TAU / (steps * steps)
}

/// The mean weight is the integral of the value, and at most the reflectance; a weight that is 1 % too large is seen.
fn foreign_energy() -> Result<(), Failed> {
    let mut family = Family::new("the energy of Oren and Nayar's model", FAMILY_RATE);
    for (index, cos) in (0..).zip([0.05, 0.2, 0.5, 0.8, 0.95]) {
        let exact = reflected(ROUGH, cos, |_| 1.0);
        ensure(exact <= 0.9, || format!("{exact} of 0.9 is reflected at the cosine {cos}"))?;
        let wo = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
        let seen = ROUGH.bsdf(wo, true, 0);
        let weight = |i| f64::from(seen.sample(Rng::new(i, index, 0, 3, Sampler::Independent).hash(0)).weight.x);
        let weights: Moments = (0..1 << 16).map(weight).collect();
        let test = ZTest::new(weights, Moments::exact(exact));
        let brighter: Moments = (0..1 << 16).map(|i| 1.01 * weight(i)).collect();
        ensure(ZTest::new(brighter, Moments::exact(exact)).z.abs() > 5.0, || "1 % goes unnoticed".to_owned())?;
        family.z_test(format!("cosine {cos}"), test);
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Chi-square over 8 x 16 cells of equal expectation, cos^2 by longitude, for the density is the cosine over pi.
fn foreign_density() -> Result<(), Failed> {
    const DRAWS: u32 = 1 << 18;
    let seen = ROUGH.bsdf(Vec3::new(0.6, 0.0, 0.8), true, 0);
    let test = |what: &str, bend: f32| {
        let mut counts = [0_u64; 128];
        for i in 0..DRAWS {
            let rng = Rng::new(i & 0xffff, i >> 16, 0, 5, Sampler::Independent);
            let BsdfSample { direction, .. } = seen.sample(rng.hash(1));
            let height = (direction.z * direction.z * (1.0 - bend * direction.x)).min(0.999_999);
            let turns = num::atan2(direction.y, direction.x) + 0.5;
            counts[(height * 8.0) as usize * 16 + ((turns * 16.0) as usize).min(15)] += 1;
        }
        let mut family = Family::new(what, FAMILY_RATE);
        family.chi_square("directions", counts.map(|count| (count, f64::from(DRAWS) / 128.0)));
        family
    };
    println!("{}", test("directions by Oren and Nayar's model", 0.0).verdict()?);
    ensure(!test("bent directions", 0.05).passed(), || "directions that are bent by 5 % go unnoticed".to_owned())
}

fn foreign_inversion() -> Result<(), Failed> {
    let seen = ROUGH.bsdf(Vec3::new(0.6, 0.0, 0.8), true, 0);
    for i in 0..4096 {
        let words = Rng::new(i, 0, 0, 9, Sampler::Independent).hash(0);
        let drawn = seen.sample(words);
        let again = seen.sample(seen.invert(drawn.lobe, drawn.direction, words));
        let off = (again.direction - drawn.direction).as_dvec3().length();
        ensure(off < 1e-3, || format!("{} comes back {off:e} away", drawn.direction))?;
    }
    Ok(())
}

/// Inside of a sphere that emits 1 the light along a ray depends on its angle to the surface alone, which is that of the next
/// hit too: so the expectation is an integral over a cosine for each bounce.
fn foreign_paths() -> Result<(), Failed> {
    let scene = Inside { material: ROUGH, emission: Vec3::ONE };
    let once = |cos: f64| 1.0 + reflected(ROUGH, cos, |_| 1.0);
    let table: Vec<f64> = (0..=64).map(|i| once(f64::from(i.max(1)) / 64.0)).collect();
    let looked_up = |cos: f64| {
        let at = (cos * 64.0).min(63.999);
        let (index, rest) = (at as usize, at.fract());
        table[index] * (1.0 - rest) + table[index + 1] * rest
    };
    let mut family = Family::new("paths over Oren and Nayar's model", FAMILY_RATE);
    for (index, height) in (0..).zip([0.0_f32, 0.6, 0.95]) {
        let ray = Ray { origin: Vec3::new(0.0, 0.0, height), direction: Vec3::X, t_max: Ray::FAR, key: 0 };
        let cos = f64::from(1.0 - height * height).sqrt();
        for (depth, exact) in [(2, once(cos)), (3, 1.0 + reflected(ROUGH, cos, looked_up))] {
            let sample = |i| {
                let rng = Rng::new(i, index, 0, 11 + depth, Sampler::Independent);
                f64::from(path::radiance(&scene, ray, &rng, depth, false).x)
            };
            let traced: Moments = (0..1 << 16).map(sample).collect();
            let test = ZTest::new(traced, Moments::exact(exact));
            println!(
                "height {height}, {depth} segments: {exact:.5}, z {:.2}, detects {:.3} %",
                test.z,
                100.0 * test.detectable_bias(1e-3) / exact
            );
            family.z_test(format!("height {height}, {depth} segments"), test);
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}
