//! What the parts of a scene do to light, against closed forms and quadratures in `f64`: punctual lights, environment,
//! textures, normal maps, interiors, the lens.

use glam::{DAffine3, DVec2, DVec3};
use libtest_mimic::Failed;
use rayon::prelude::*;
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{
    Camera, Environment, Filter, Instance, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, Volume, Wrap,
};
use restir_shared::camera::primary_ray;
use restir_shared::geometry::{Hit, Ray};
use restir_shared::glam::{Vec2, Vec3};
use restir_shared::rng::Rng;
use restir_shared::scene::{Lights, Surface, Trace};
use restir_shared::technique::path::radiance;
use restir_tests::random::SplitMix;
use restir_tests::stats::{Moments, two_sided_threshold};
use restir_tests::suite::ensure;
use restir_tests::wrong::{Fault, Faulty};
use std::f64::consts::{PI, TAU};

/// How often a z-test of the suite fails although expectations are equal. Seeds are fixed: a failure is a bug.
const FALSE_ALARM: f64 = 1.0e-4;
/// Relative error of a value that takes some fifty roundings.
const ROUNDINGS: f64 = 3.0e-6;
const SAMPLES: u32 = 1 << 17;

restir_tests::suite! {
    punctual_lights_have_their_irradiance lights_of_all_kinds_add_up environment_is_seen_as_interpolated
    environment_has_its_irradiance textured_light_has_its_irradiance textures_are_interpolated
    normal_maps_turn_the_normal interiors_absorb clear_glass_keeps_all_light smooth_normals_neither_leak_nor_gain
    lens_is_sharp_in_its_focus
}

/// The estimate of the radiance along a ray.
fn estimate(scene: &(impl Trace + Surface + Lights + Sync), ray: Ray, depth: u32, samples: u32) -> Moments {
    let chunk = |chunk: u32| {
        let mut moments = Moments::default();
        for i in 0..1024.min(samples) {
            let rng = Rng::new(7, 3, chunk * 1024 + i, 11);
            moments.push(f64::from(radiance(scene, ray, &rng, depth, false).y));
        }
        moments
    };
    let chunks: Vec<Moments> = (0..samples.div_ceil(1024)).into_par_iter().map(chunk).collect();
    chunks.into_iter().fold(Moments::default(), Moments::merge)
}

/// Standard errors between an estimate and its expectation, of which a relative `slack` is known to be uncertain.
fn z(moments: &Moments, exact: f64, slack: f64) -> f64 {
    (moments.mean() - exact) / moments.standard_error().hypot(slack * exact)
}

fn ensure_mean(what: &str, moments: &Moments, exact: f64, slack: f64) -> Result<(), Failed> {
    let z = z(moments, exact, slack);
    println!("{what}: {:.6} +- {:.1e} for {exact:.6}, z {z:.2}", moments.mean(), moments.standard_error());
    ensure(z.abs() <= two_sided_threshold(FALSE_ALARM), || {
        format!("{what}: {} is {z:.1} standard errors from {exact}", moments.mean())
    })
}

fn ensure_close(what: &str, value: f64, exact: f64, tolerance: f64) -> Result<(), Failed> {
    ensure((value - exact).abs() <= tolerance, || format!("{what}: {value}, not {exact} +- {tolerance:e}"))
}

const REFLECTANCE: f32 = 0.5;

/// A square of side 2 `half` in the plane y = 0, facing up, with (0, 0) of its texture coordinates at (-x, -z).
fn floor_mesh(half: f32) -> Mesh {
    Mesh {
        name: "floor".to_owned(),
        positions: vec![[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]],
        uvs: vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn scene_of(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    Scene {
        name: "test".to_owned(),
        instances: (0..meshes.len()).map(|mesh| Instance { mesh, transform: DAffine3::IDENTITY }).collect(),
        meshes,
        materials,
        camera: Some(Camera::pinhole(DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO, DVec3::Z, 1.0)),
        ..Scene::default()
    }
}

/// A diffuse floor without texture coordinates.
fn floor() -> Scene {
    let mesh = Mesh { uvs: Vec::new(), ..floor_mesh(4.0) };
    scene_of(vec![mesh], vec![Material::diffuse("floor", [REFLECTANCE; 3])])
}

/// Down onto the point (x, 0, z).
fn down(x: f32, z: f32) -> Ray {
    Ray { origin: Vec3::new(x, 1.0, z), direction: Vec3::NEG_Y, t_max: Ray::FAR }
}

fn light(intensity: f32, kind: LightKind) -> Light {
    Light { name: "light".to_owned(), intensity: [intensity; 3], kind }
}

const LAMP: DVec3 = DVec3::new(0.5, 2.0, -0.25);

fn spot() -> LightKind {
    LightKind::Spot { position: LAMP, direction: DVec3::new(0.1, -1.0, 0.0), inner: 0.2, outer: 0.7 }
}

/// How far above the floor rays leave it: 2^-18 of its largest coordinate.
const OFFSET: f64 = 4.0 / 262_144.0;

/// Irradiance of the floor at (x, 0, z).
fn irradiance(light: &Light, x: f64, z: f64) -> f64 {
    let intensity = f64::from(light.intensity[1]);
    let to_lamp = LAMP - DVec3::new(x, OFFSET, z);
    let from_point = intensity * to_lamp.normalize().y / to_lamp.length_squared();
    match light.kind {
        LightKind::Point { .. } => from_point,
        LightKind::Directional { direction } => -direction.normalize().y * intensity,
        LightKind::Spot { direction, inner, outer, .. } => {
            let cos = direction.normalize().dot(-to_lamp.normalize());
            let share = ((cos - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
            from_point * share * share
        }
    }
}

fn punctual_kinds() -> [Light; 3] {
    [
        light(3.0, LightKind::Point { position: LAMP }),
        light(5.0, spot()),
        light(0.7, LightKind::Directional { direction: DVec3::new(0.3, -0.8, 0.4) }),
    ]
}

/// A single light is chosen with certainty, so one sample is exact.
fn punctual_lights_have_their_irradiance() -> Result<(), Failed> {
    for light in punctual_kinds() {
        let buffers = SceneBuffers::build(&Scene { lights: vec![light.clone()], ..floor() })?;
        for (x, z) in [(0.0, 0.0), (0.9, -0.4), (-1.2, 0.3), (1.4, 1.1), (3.0, -3.0)] {
            let exact = irradiance(&light, f64::from(x), f64::from(z)) * f64::from(REFLECTANCE) / PI;
            let value = radiance(&buffers.view(), down(x, z), &Rng::new(0, 0, 0, 0), 2, false).y;
            // near the edge of a spot its falloff cancels
            ensure_close(&light.name, f64::from(value), exact, ROUNDINGS * exact.max(0.01))?;
        }
    }
    Ok(())
}

fn lights_of_all_kinds_add_up() -> Result<(), Failed> {
    let lights = punctual_kinds().to_vec();
    let environment = Environment { scale: 0.3, ..sky(1, 1, |_, _| 1.0) };
    let scene = Scene { lights: lights.clone(), environment: Some(environment), ..floor() };
    let buffers = SceneBuffers::build(&scene)?;
    let from_lights: f64 = lights.iter().map(|light| irradiance(light, 0.9, -0.4)).sum();
    let exact = (from_lights + 0.3 * PI) * f64::from(REFLECTANCE) / PI;
    ensure_mean("all kinds", &estimate(&buffers.view(), down(0.9, -0.4), 2, SAMPLES), exact, ROUNDINGS)
}

fn sky(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Environment {
    let pixels: Vec<[f32; 3]> = (0..width * height).map(|i| [value(i % width, i / width); 3]).collect();
    Environment { name: "sky".to_owned(), size: [width, height], pixels: pixels.into(), scale: 1.0, rotation: 0.0 }
}

/// A dim sky of random pixels, one in sixteen black, with a sun.
fn sunny() -> Environment {
    let random = |x: u32, y: u32| {
        let mut stream = SplitMix::new(u64::from(y * 64 + x));
        let u = stream.unit();
        if u < 1.0 / 16.0 { 0.0 } else { u as f32 }
    };
    let pixel = |x, y| if (x, y) == (13, 2) { 400.0 } else { random(x, y) };
    Environment { scale: 0.5, rotation: 33.0, ..sky(16, 8, pixel) }
}

/// What is seen of the sky in a direction, by interpolation between the centres of its pixels.
fn seen(sky: &Environment, direction: DVec3) -> f64 {
    let [width, height] = sky.size.map(f64::from);
    let azimuth = direction.x.atan2(-direction.z) / TAU - sky.rotation / 360.0;
    let x = azimuth.rem_euclid(1.0) * width - 0.5;
    let y = (direction.y.clamp(-1.0, 1.0).acos() / PI * height - 0.5).clamp(0.0, height - 1.0);
    let pixel = |column: f64, row: f64| {
        let column = column.rem_euclid(width) as usize;
        let row = row.clamp(0.0, height - 1.0) as usize;
        f64::from(sky.pixels[row * sky.size[0] as usize + column][1])
    };
    let (cx, cy) = (x.floor(), y.floor());
    let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
    let row = |row: f64| mix(pixel(cx, row), pixel(cx + 1.0, row), x - cx);
    mix(row(cy), row(cy + 1.0), y - cy) * f64::from(sky.scale)
}

fn environment_is_seen_as_interpolated() -> Result<(), Failed> {
    let sky = sunny();
    let brightest = 200.0;
    let buffers = SceneBuffers::build(&Scene { environment: Some(sky.clone()), ..floor() })?;
    let mut random = SplitMix::new(1);
    for _ in 0..20_000 {
        let direction = unit(&mut random).as_vec3();
        let direction = Vec3::from_array(direction.to_array());
        let found = buffers.view().environment(direction).radiance.y;
        let exact = seen(&sky, DVec3::from_array(direction.to_array().map(f64::from)));
        // a direction's angles carry an error of some 2e-7 turns, of 16 pixels
        ensure_close("sky", f64::from(found), exact, brightest * 16.0 * 4.0e-7)?;
    }
    Ok(())
}

fn unit(random: &mut SplitMix) -> DVec3 {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (random.unit() * TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// By the midpoint rule over the upper hemisphere.
fn irradiance_of(sky: &Environment) -> f64 {
    const STEPS: u32 = 1024;
    let row = |i: u32| {
        let theta = (f64::from(i) + 0.5) / f64::from(STEPS) * PI / 2.0;
        let (sin, cos) = theta.sin_cos();
        let sum: f64 = (0..4 * STEPS)
            .map(|j| {
                let phi = (f64::from(j) + 0.5) / f64::from(4 * STEPS) * TAU;
                seen(sky, DVec3::new(sin * phi.cos(), cos, sin * phi.sin()))
            })
            .sum();
        sum * sin * cos
    };
    let sum: f64 = (0..STEPS).into_par_iter().map(row).sum();
    sum * (PI / 2.0 / f64::from(STEPS)) * (TAU / f64::from(4 * STEPS))
}

fn environment_has_its_irradiance() -> Result<(), Failed> {
    let sky = sunny();
    let buffers = SceneBuffers::build(&Scene { environment: Some(sky.clone()), ..floor() })?;
    let exact = irradiance_of(&sky) * f64::from(REFLECTANCE) / PI;
    // of the quadrature
    let slack = 1.0e-5;
    ensure_mean("sunny sky", &estimate(&buffers.view(), down(0.1, 0.2), 2, SAMPLES), exact, slack)?;
    // densities of light samples off, but not those that scattering is weighted with
    let wrong = Faulty { scene: buffers.view(), fault: Fault::DENSITY };
    let found = z(&estimate(&wrong, down(0.1, 0.2), 2, SAMPLES), exact, slack);
    ensure(found.abs() > two_sided_threshold(FALSE_ALARM), || format!("a density off by 2 % went unnoticed: z {found}"))
}

fn texture(size: [u32; 2], texels: Vec<[u8; 4]>) -> Texture {
    Texture { name: "texture".to_owned(), size, texels: texels.into(), wrap: [Wrap::Clamp; 2], filter: Filter::Linear }
}

fn random_texture(size: [u32; 2], stream: u64) -> Texture {
    let mut random = SplitMix::new(stream);
    let texels = (0..size[0] * size[1]).map(|_| [0; 4].map(|_: u8| (random.unit() * 256.0) as u8)).collect();
    texture(size, texels)
}

fn srgb(code: u8) -> f64 {
    let s = f64::from(code) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Green of a texture at texture coordinates, decoded by `decode`.
fn looked_up(t: &Texture, used: &TextureUse, uv: DVec2, decode: fn(u8) -> f64) -> f64 {
    let m = used.transform.map(f64::from);
    let at = [m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]];
    let wrapped = |axis: usize, index: f64| {
        let n = f64::from(t.size[axis]);
        match t.wrap[axis] {
            Wrap::Clamp => index.clamp(0.0, n - 1.0),
            Wrap::Repeat => index.rem_euclid(n),
            Wrap::Mirror => {
                let i = index.rem_euclid(2.0 * n);
                if i < n { i } else { 2.0 * n - 1.0 - i }
            }
        }
    };
    let texel = |i: f64, j: f64| {
        let (x, y) = (wrapped(0, i) as u32, wrapped(1, j) as u32);
        decode(t.texels[(y * t.size[0] + x) as usize][1])
    };
    let [x, y] = [at[0] * f64::from(t.size[0]), at[1] * f64::from(t.size[1])];
    if t.filter == Filter::Nearest {
        return texel(x.floor(), y.floor());
    }
    let (i, j) = ((x - 0.5).floor(), (y - 0.5).floor());
    let (s, t) = (x - 0.5 - i, y - 0.5 - j);
    (texel(i, j) * (1.0 - s) + texel(i + 1.0, j) * s) * (1.0 - t)
        + (texel(i, j + 1.0) * (1.0 - s) + texel(i + 1.0, j + 1.0) * s) * t
}

/// The point of [`floor_mesh`]'s triangle `primitive` with barycentric coordinates `b`: texture coordinates.
fn uv_of(primitive: usize, b: Vec2) -> DVec2 {
    let uvs = floor_mesh(1.0).uvs;
    let corner = |i: usize| {
        let [u, v] = uvs[[[0, 1, 2], [0, 2, 3]][primitive][i]].map(f64::from);
        DVec2::new(u, v)
    };
    let (x, y) = (f64::from(b.x), f64::from(b.y));
    corner(0) * (1.0 - x - y) + corner(1) * x + corner(2) * y
}

fn textures_are_interpolated() -> Result<(), Failed> {
    let transforms = [[1.0, 0.0, 0.0, 0.0, 1.0, 0.0], [3.0, 0.5, -1.25, -0.75, -2.0, 1.5]];
    for wrap in [[Wrap::Clamp; 2], [Wrap::Repeat, Wrap::Mirror], [Wrap::Mirror, Wrap::Repeat]] {
        for (filter, transform) in
            [Filter::Linear, Filter::Nearest].into_iter().flat_map(|f| transforms.map(|t| (f, t)))
        {
            let image = Texture { wrap, filter, ..random_texture([13, 6], 3) };
            let used = TextureUse { texture: 0, transform };
            let material = Material {
                base_color_texture: Some(used),
                emission_texture: Some(used),
                metallic_roughness_texture: Some(used),
                ior: 1.5,
                ..Material::emitter("m", [1.0; 3], [2.0; 3])
            };
            let scene = Scene { textures: vec![image.clone()], ..scene_of(vec![floor_mesh(1.0)], vec![material]) };
            let buffers = SceneBuffers::build(&scene)?;
            // the BVH may have exchanged the triangles: their third corners tell
            let exchanged = buffers.view().surface(&down(0.0, 0.0), &hit(0, Vec2::new(0.0, 1.0))).position.z < 0.0;
            let mut random = SplitMix::new(9);
            for _ in 0..4_000 {
                let (a, b) = (random.unit(), random.unit());
                let b =
                    if a + b > 1.0 { Vec2::new(1.0 - a as f32, 1.0 - b as f32) } else { Vec2::new(a as f32, b as f32) };
                let id = u32::from(random.unit() < 0.5);
                let point = buffers.view().surface(&down(0.0, 0.0), &hit(id, b));
                let uv = uv_of((id as usize) ^ usize::from(exchanged), b);
                // coordinates of up to 4 and their products carry 1e-6; texels of a width of 13 differ by up to 1
                let tolerance = if filter == Filter::Linear { 13.0 * 4.0e-6 } else { 1.0e-6 };
                let near_edge = |x: f64| (x - x.round()).abs() < 13.0 * 4.0e-6;
                let m = transform.map(f64::from);
                let at = [m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]];
                if filter == Filter::Nearest && (near_edge(at[0] * 13.0) || near_edge(at[1] * 6.0)) {
                    continue;
                }
                let color = looked_up(&image, &used, uv, srgb);
                let linear = looked_up(&image, &used, uv, |code| f64::from(code) / 255.0);
                ensure_close("base colour", f64::from(point.material.base_color.y), color, tolerance)?;
                ensure_close("emission", f64::from(point.emission.y), 2.0 * color, 2.0 * tolerance)?;
                ensure_close("roughness", f64::from(point.material.roughness), linear, tolerance)?;
            }
        }
    }
    Ok(())
}

fn hit(id: u32, uv: Vec2) -> Hit {
    Hit { t: 1.0, id, uv }
}

/// The floor under a square of side 1 at height 1 that emits an image downwards.
fn textured_light_has_its_irradiance() -> Result<(), Failed> {
    let image = random_texture([4, 4], 8);
    let used = TextureUse::new(0);
    let lamp = Mesh {
        positions: vec![[-0.5, 1.0, -0.5], [0.5, 1.0, -0.5], [0.5, 1.0, 0.5], [-0.5, 1.0, 0.5]],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        material: 1,
        ..Mesh::default()
    };
    let emitter = Material { emission_texture: Some(used), ..Material::emitter("lamp", [0.0; 3], [5.0; 3]) };
    let scene = Scene {
        textures: vec![image.clone()],
        ..scene_of(vec![floor_mesh(4.0), lamp], vec![Material::diffuse("floor", [REFLECTANCE; 3]), emitter])
    };
    let buffers = SceneBuffers::build(&scene)?;
    let (x, z) = (0.2_f64, 0.6_f64);
    const STEPS: u32 = 1024;
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let uv = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) / f64::from(STEPS);
            let to_lamp = DVec3::new(uv.x - 0.5 - x, 1.0, uv.y - 0.5 - z);
            sum += 5.0 * looked_up(&image, &used, uv, srgb) / to_lamp.length_squared().powi(2);
        }
    }
    let exact = sum / f64::from(STEPS * STEPS) * f64::from(REFLECTANCE) / PI;
    // from the side, past the lamp
    let origin = DVec3::new(x, 0.0, z) + DVec3::new(2.0, 1.0, 0.0);
    let ray = Ray {
        origin: Vec3::from_array(origin.as_vec3().to_array()),
        direction: Vec3::from_array(DVec3::new(-2.0, -1.0, 0.0).normalize().as_vec3().to_array()),
        t_max: Ray::FAR,
    };
    ensure_mean("textured lamp", &estimate(&buffers.view(), ray, 2, SAMPLES), exact, 1.0e-5)
}

/// A map of one colour tilts the normal towards +u and against v, whichever way the coordinates run.
fn normal_maps_turn_the_normal() -> Result<(), Failed> {
    let code = [191_u8, 215, 230, 255];
    let tangent_space = DVec3::from_array([code[0], code[1], code[2]].map(|c| f64::from(c) / 255.0 * 2.0 - 1.0));
    for (flip_u, scale) in [(false, 1.0), (true, 1.0), (false, 0.5)] {
        let mut mesh = floor_mesh(1.0);
        if flip_u {
            mesh.uvs.iter_mut().for_each(|uv| uv[0] = 1.0 - uv[0]);
        }
        let material = Material {
            normal_texture: Some(TextureUse::new(0)),
            normal_scale: scale,
            ..Material::diffuse("mapped", [0.5; 3])
        };
        let scene = Scene { textures: vec![texture([1, 1], vec![code])], ..scene_of(vec![mesh], vec![material]) };
        let point = SceneBuffers::build(&scene)?.view().surface(&down(0.0, 0.0), &hit(0, Vec2::new(0.3, 0.2)));
        let along_u = if flip_u { -DVec3::X } else { DVec3::X };
        let t = tangent_space * DVec3::new(f64::from(scale), f64::from(scale), 1.0);
        // v grows along +z
        let exact = (along_u * t.x - DVec3::Z * t.y + DVec3::Y * t.z).normalize();
        let found = DVec3::from_array(point.shading_normal.to_array().map(f64::from));
        // packed tangents are good to 1e-4
        ensure((found - exact).length() < 2.0e-4, || format!("normal {found}, not {exact}"))?;
    }
    Ok(())
}

/// The faces of a cube of half side `half` around `centre`, front sides out.
fn cube(centre: [f32; 3], half: f32) -> Mesh {
    let corner = |i: u32| [0, 1, 2].map(|axis| centre[axis] + if i >> axis & 1 == 0 { -half } else { half });
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        indices: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// Through a cube whose index is that of the outside, light goes straight, without reflection.
fn interiors_absorb() -> Result<(), Failed> {
    let color = [0.25_f32, 0.5, 0.75];
    let glass = |ior: f32| Material {
        ior,
        transmission: 1.0,
        roughness: 0.0,
        volume: Some(Volume { attenuation_color: color, attenuation_distance: 2.0 }),
        ..Material::diffuse("glass", [1.0; 3])
    };
    let scene = |ior| Scene {
        environment: Some(Environment { scale: 3.0, ..sky(1, 1, |_, _| 1.0) }),
        ..scene_of(vec![cube([0.0; 3], 0.5)], vec![glass(ior)])
    };
    let ray = Ray { origin: Vec3::new(0.1, 3.0, 0.2), direction: Vec3::NEG_Y, t_max: Ray::FAR };
    let buffers = SceneBuffers::build(&scene(1.0))?;
    let found = radiance(&buffers.view(), ray, &Rng::new(0, 0, 0, 0), 8, false);
    for (value, c) in found.to_array().into_iter().zip(color) {
        ensure_close("absorbed", f64::from(value), 3.0 * f64::from(c).sqrt(), 1.0e-5)?;
    }
    // at normal incidence all orders of reflection between two faces sum up: (1 - R)^2 A / (1 - R^2 A^2) + R + ...
    let buffers = SceneBuffers::build(&scene(1.5))?;
    let (r, a) = (0.04_f64, f64::from(color[1]).sqrt());
    let t = (1.0 - r) * (1.0 - r);
    let exact = 3.0 * (r + t * a * r * a / (1.0 - r * r * a * a) + t * a / (1.0 - r * r * a * a));
    ensure_mean("slab", &estimate(&buffers.view(), ray, 32, SAMPLES), exact, 1.0e-5)
}

/// A sphere of triangles with smooth normals.
fn sphere(around: u32, along: u32) -> Mesh {
    let mesh = restir_tests::meshes::sphere(1.0, around, along);
    Mesh { normals: mesh.positions.clone(), ..mesh }
}

/// In a uniform environment a body that absorbs nothing is invisible.
fn clear_glass_keeps_all_light() -> Result<(), Failed> {
    for roughness in [0.0, 0.3] {
        let glass = Material {
            ior: 1.5,
            transmission: 1.0,
            roughness,
            volume: Some(Volume { attenuation_color: [1.0; 3], attenuation_distance: f32::INFINITY }),
            ..Material::diffuse("glass", [1.0; 3])
        };
        let environment = Some(sky(1, 1, |_, _| 1.0));
        let mesh = restir_tests::meshes::sphere(1.0, 24, 12);
        let buffers = SceneBuffers::build(&Scene { environment, ..scene_of(vec![mesh], vec![glass]) })?;
        let ray = Ray { origin: Vec3::new(0.31, 3.0, 0.23), direction: Vec3::NEG_Y, t_max: Ray::FAR };
        let moments = estimate(&buffers.view(), ray, 64, SAMPLES / 8);
        println!("glass of roughness {roughness}: {:.6} +- {:.1e}", moments.mean(), moments.standard_error());
        if roughness == 0.0 {
            ensure_close("glass", moments.mean(), 1.0, 1.0e-4)?;
        } else {
            // what is masked is lost, and nothing is gained
            ensure(moments.mean() < 1.0 + 4.0 * moments.standard_error() && moments.mean() > 0.9, || {
                format!("rough glass: {}", moments.mean())
            })?;
        }
    }
    Ok(())
}

fn smooth_normals_neither_leak_nor_gain() -> Result<(), Failed> {
    let white = Material { ior: 1.5, roughness: 0.3, ..Material::diffuse("white", [1.0; 3]) };
    // a coarse sphere, whose normals differ much from the triangles'
    for (material, what) in [(white, "plastic"), (Material::diffuse("matte", [1.0; 3]), "matte")] {
        let bright = Some(sky(1, 1, |_, _| 1.0));
        let lit = SceneBuffers::build(&Scene {
            environment: bright,
            ..scene_of(vec![sphere(8, 4)], vec![material.clone()])
        })?;
        for x in [0.0_f32, 0.4, 0.7, 0.85, 0.91] {
            let ray = Ray { origin: Vec3::new(x, 3.0, 0.05), direction: Vec3::NEG_Y, t_max: Ray::FAR };
            let moments = estimate(&lit.view(), ray, 2, SAMPLES / 8);
            let limit = 1.0 + 4.0 * moments.standard_error() + ROUNDINGS;
            ensure(moments.mean() <= limit, || format!("{what} at {x} reflects {}", moments.mean()))?;
        }
        // a lamp inside; the outside is dark whatever the normals say
        let lamp =
            Light { name: "lamp".to_owned(), intensity: [5.0; 3], kind: LightKind::Point { position: DVec3::ZERO } };
        let closed =
            SceneBuffers::build(&Scene { lights: vec![lamp], ..scene_of(vec![sphere(8, 4)], vec![material]) })?;
        for i in 0..4_000 {
            let x = -0.95 + 1.9 * (i as f32 / 4_000.0);
            let ray = Ray { origin: Vec3::new(x, 3.0, 0.1), direction: Vec3::NEG_Y, t_max: Ray::FAR };
            let found = radiance(&closed.view(), ray, &Rng::new(i, 0, 0, 0), 6, false);
            ensure(found == Vec3::ZERO, || format!("{what}: light leaks at {x}: {found}"))?;
        }
    }
    Ok(())
}

/// All rays through the lens meet where it is in focus, on the pinhole's ray.
fn lens_is_sharp_in_its_focus() -> Result<(), Failed> {
    let pinhole = Camera::pinhole(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.5, -1.0), DVec3::Y, 0.8);
    let camera = Camera { lens_radius: 0.2, focus_distance: Some(2.5), ..pinhole };
    let (with, without) = (camera.params(64, 48), pinhole.params(64, 48));
    let view = (pinhole.target - pinhole.position).normalize();
    let wide = |v: Vec3| DVec3::from_array(v.to_array().map(f64::from));
    let at_focus = |ray: Ray| {
        let (o, d) = (wide(ray.origin), wide(ray.direction));
        o + d * ((2.5 - (o - pinhole.position).dot(view)) / d.dot(view))
    };
    let mut farthest = 0.0_f64;
    for (x, y) in [(0.5, 0.5), (12.25, 40.0), (63.0, 2.0)] {
        let pixel = Vec2::new(x, y);
        let sharp = at_focus(primary_ray(&without, pixel, Vec2::ZERO));
        for i in 0..32 {
            let (sin, cos) = (f64::from(i) / 32.0 * TAU).sin_cos();
            let ray = primary_ray(&with, pixel, Vec2::new(cos as f32, sin as f32));
            farthest = farthest.max((wide(ray.origin) - pinhole.position).length());
            ensure_close("radius", (wide(ray.origin) - pinhole.position).length(), 0.2, 1.0e-6)?;
            ensure((at_focus(ray) - sharp).length() < 5.0e-6, || {
                format!("ray {i} through ({x}, {y}) is not in focus")
            })?;
        }
    }
    ensure(farthest > 0.19, || "the lens has no extent".to_owned())
}
