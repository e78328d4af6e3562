//! Paths through media: against known slabs, and tile by tile against an independent random walk in `f64` inside of analytic bodies.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::{Pass, Waiting};
use restir_host::render::{Render, Rendered};
use restir_host::scene::{
    Camera, Environment, Filter, Light, LightKind, Material, Mesh, Scene, Texture, TextureUse, Volume,
    VolumeScattering, Wrap, builtin,
};
use restir_host::technique::path::{AfterSubsurface, Orders, PathSettings, Subsurface};
use restir_shared::glam::DVec3;
use restir_shared::layout::FEATURE_CLEAR_BORDER;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::media::{MediaParams, PackedWalker};
use restir_tests::bias::{ensure_biased, ensure_unbiased};
use restir_tests::scenes::clear_media;
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, TileGrid, TileTest, ZTest};
use restir_tests::suite::ensure;
use restir_tests::walk_f64::{Body, Border, SKY_ROWS, Walker, from_above, unscattered};
use restir_tests::white_bodies;
use restir_tests::{native, oracle, slab_exact};

restir_tests::suite! {
    later {
        slabs_reflect_and_transmit_what_is_known slabs_have_the_orders_that_are_known bodies_look_as_by_an_independent_walk orders_look_as_by_an_independent_walk
        wrong_media_are_seen where_a_path_is_cut_does_not_matter passes_without_work_change_nothing walks_are_counted pieces_of_a_medium_are_as_the_whole white_bodies_cannot_be_seen
        lights_inside_look_alike_sampled_or_found lights_behind_clear_borders_look_alike_sampled_or_found
        clear_bodies_look_as_by_an_independent_walk what_burns_inside_of_white_bodies_comes_out paths_may_end_after_media
        bodies_in_bodies_of_their_medium_cannot_be_seen bodies_in_bodies_are_as_in_a_hole_of_their_form light_inside_of_what_encloses_a_body_is_dimmed
        the_texture_where_light_enters_decides scale_does_not_matter scattering_elsewhere_changes_nothing the_last_segment_may_be_a_walk
    }
}

const GRID: TileGrid = TileGrid { width: 16, height: 16, tile: 8 };

/// A body of a medium under a sky, and what looks at it.
#[derive(Clone)]
struct Case {
    name: &'static str,
    camera: Camera,
    walker: Walker,
    sampler: Sampler,
}

fn looking(from: [f64; 3], at: [f64; 3], degrees: f64) -> Camera {
    Camera::pinhole(DVec3::from(from), DVec3::from(at), DVec3::Z, degrees.to_radians())
}

/// Of the albedo of a collision, the colour that is written in materials: van de Hulst's formula.
fn color(albedo: f64, g: f64) -> f32 {
    let s = ((1.0 - albedo) / (1.0 - g * albedo)).sqrt();
    ((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)) as f32
}

impl Case {
    fn material(&self) -> Material {
        let Walker { border, extinction, albedo, anisotropy, .. } = self.walker;
        let color = albedo.map(|albedo| color(albedo, anisotropy));
        let mut volume = Volume::scattering(color, extinction.map(|rate| (1.0 / rate) as f32), anisotropy as f32);
        let white = Material::diffuse("medium", [1.0; 3]);
        match border {
            Border::Dielectric(index) => {
                Material { transmission: 1.0, roughness: 0.0, ior: index as f32, volume: Some(volume), ..white }
            }
            Border::Open => Material { diffuse_transmission: 1.0, volume: Some(volume), ..white },
            Border::DenserOutside(index) => {
                volume.scattering = volume.scattering.map(|s| VolumeScattering { denser_outside: index as f32, ..s });
                Material { diffuse_transmission: 1.0, volume: Some(volume), ..white }
            }
        }
    }

    fn scene(&self) -> SceneBuffers {
        SceneBuffers::build(&self.source()).expect("builds")
    }

    fn source(&self) -> Scene {
        let mut scene = Scene { name: self.name.to_owned(), camera: Some(self.camera), ..Scene::default() };
        let row = |row: u32| [[if 2 * row < SKY_ROWS { 1.0 } else { 0.0 }; 3]; 4];
        let sky: Vec<[f32; 3]> = (0..SKY_ROWS).flat_map(row).collect();
        scene.environment = Some(Environment {
            name: "above".into(),
            size: [4, SKY_ROWS],
            pixels: sky.into(),
            scale: 1.0,
            rotation: 0.0,
        });
        let material = scene.add_material(self.material());
        let mesh = match self.walker.body {
            Body::Box(lo, hi) => Mesh::cuboid(lo, hi),
            Body::Sphere(centre, radius) => Mesh { normals: Vec::new(), ..Mesh::sphere(centre, radius, 6) },
        };
        scene.add_mesh("body", material, mesh);
        scene
    }

    fn settings(&self) -> PathSettings {
        let [least, most] = self.walker.orders;
        PathSettings { max_depth: 3, sampler: self.sampler, orders: Orders { least, most }, ..PathSettings::default() }
    }

    fn rendered(&self, scene: &SceneBuffers, samples: u32, seed: u32) -> Rendered {
        let render = Render { count: samples, seed, ..Render::new([GRID.width, GRID.height], self.settings()) };
        let rendered = render.render(scene, &mut CpuExecutor::inline()).expect("renders");
        assert_eq!(rendered.dropped_samples, 0);
        rendered
    }

    fn moments(&self, restarts: u32, samples: u32) -> Vec<Moments> {
        use rayon::prelude::*;
        let scene = self.scene();
        let image = |seed| self.rendered(&scene, samples, seed).image.pixels.iter().map(|p| p.map(f64::from)).collect();
        GRID.moments_of(&(0..restarts).into_par_iter().map(image).collect::<Vec<_>>())
    }

    /// The same by the independent walk.
    fn reference(&self, restarts: u32) -> Vec<Moments> {
        let camera =
            oracle::Camera::new(&self.scene().camera.params(GRID.width, GRID.height), [GRID.width, GRID.height]);
        GRID.moments(restarts, |restart, x, y| self.walker.pixel(&camera, restart, x, y))
    }
}

/// A slab of depth 1 that is so wide that nothing comes back from its sides, seen from above or below.
fn slab(depth: f64, albedo: f64, g: f64, border: Border, above: bool) -> Case {
    let corner = DVec3::new(100.0, 0.0, 100.0);
    let (from, at) = if above { ([0.0, 6.0, 0.0], [0.3, 0.0, 0.1]) } else { ([0.0, -7.0, 0.0], [0.3, -1.0, 0.1]) };
    Case {
        name: "slab",
        camera: looking(from, at, 40.0),
        walker: Walker {
            body: Body::Box(-corner - DVec3::Y, corner),
            border,
            extinction: [depth; 3],
            albedo: [albedo; 3],
            anisotropy: g,
            sky: from_above,
            orders: [0, u32::MAX],
        },
        sampler: Sampler::Independent,
    }
}

/// A colourful sphere or cube, seen from aside.
fn body(name: &'static str, body: Body, border: Border, g: f64) -> Case {
    Case {
        name,
        camera: looking([3.0, -0.4, 2.0], [0.0, 0.1, 0.0], 38.0),
        walker: Walker {
            body,
            border,
            extinction: [0.6, 2.0, 7.0],
            albedo: [0.99, 0.9, 0.6],
            anisotropy: g,
            sky: from_above,
            orders: [0, u32::MAX],
        },
        sampler: Sampler::Independent,
    }
}

const SPHERE: Body = Body::Sphere(DVec3::ZERO, 1.0);
const CUBE: Body = Body::Box(DVec3::new(-0.8, -0.7, -0.9), DVec3::new(0.8, 0.9, 0.7));

/// The mean of the image in green, over restarts.
fn mean(moments: &[Moments]) -> Moments {
    moments[moments.len() - 2]
}

/// The same slab as [`slab`] makes, of which it is known what it reflects and transmits.
fn exact(walker: &Walker) -> slab_exact::Slab {
    let Walker { extinction, albedo, anisotropy, border, .. } = *walker;
    slab_exact::Slab { depth: extinction[1], albedo: albedo[1], anisotropy, border }
}

/// A slab that is seen at one angle: radiance through a dielectric depends on it. The cosine comes with it.
fn slab_at_an_angle([depth, albedo, g]: [f64; 3], border: Border, above: bool) -> (Case, f64) {
    let (height, level) = if above { (6.0, 0.0) } else { (-7.0, -1.0) };
    let (from, at) = (DVec3::new(4.0, height, 1.0), DVec3::new(0.3, level, 0.1));
    let camera = looking(from.to_array(), at.to_array(), 1.0e-3);
    (Case { camera, sampler: Sampler::Sobol, ..slab(depth, albedo, g, border, above) }, (from - at).normalize().y.abs())
}

/// Depth, albedo and anisotropy of slabs with one of three borders each, and of others that are open: the last are half spaces.
const SLABS: [[f64; 3]; 4] = [[1.0, 0.9, 0.0], [1.0, 0.9, 0.5], [4.0, 0.9, 0.0], [4.0, 0.9, 0.5]];
const OPEN_SLABS: [[f64; 3]; 5] =
    [[4.0, 0.99, 0.0], [10.0, 0.99, 0.8], [60.0, 0.5, 0.0], [60.0, 0.9, 0.0], [60.0, 0.95, 0.0]];
/// What they are known to, and the largest standard error of a number, relative to it: of what is next to nothing more is allowed.
const KNOWN_TO: f64 = 1.0e-5;

fn largest_error(expected: f64) -> f64 {
    bound(if expected < 0.05 { 0.006 } else { 0.002 })
}

/// Restarts that are compared with a reference.
const RESTARTS: u32 = 64;
/// Restarts of a number that is known: from so many its standard error is known to 6 %.
const KNOWN_RESTARTS: u32 = 128;

/// Samples of each restart by which the standard error is as small as it has to be, with what it is known to and what weights add: light
/// comes back at most whole, so that its variance is hardly more than that of all or nothing.
fn samples_of(expected: f64) -> u32 {
    let (error, pixels) = (0.78 * largest_error(expected), f64::from(KNOWN_RESTARTS * GRID.width * GRID.height));
    ((1.0 - expected) / (expected * error * error * pixels)).ceil() as u32
}

/// What is found of a number that is known, with samples enough for the standard error that is asked for.
fn slab_is(family: &mut Family, what: &str, found: Moments, expected: f64) -> Result<(), Failed> {
    let error = found.standard_error() / expected;
    println!("{what}: {:.5} +- {:.2} %, expected {expected:.5}", found.mean(), 100.0 * error);
    ensure(error <= largest_error(expected), || format!("{what}: the standard error is {error:.4}"))?;
    family.z_test(what.to_owned(), ZTest::new(found, Moments::known(expected, KNOWN_TO)));
    Ok(())
}

fn slabs_reflect_and_transmit_what_is_known() -> Result<(), Failed> {
    let borders = [Border::Open, Border::DenserOutside(1.4), Border::Dielectric(1.4)];
    let all = SLABS.into_iter().flat_map(|medium| borders.map(|border| (medium, border)));
    let all = all.chain(OPEN_SLABS.map(|medium| (medium, Border::Open)));
    let mut family = Family::new("slabs", FAMILY_RATE);
    for (medium, border) in all {
        for (side, above) in [true, false].into_iter().enumerate() {
            let (case, cos) = slab_at_an_angle(medium, border, above);
            let expected = exact(&case.walker).radiance(cos)[side];
            // of what is nothing there is no relative error
            if expected > 1.0e-3 {
                let what = format!("depth, albedo, g {medium:?}, {border:?}, side {side}");
                slab_is(&mut family, &what, mean(&case.moments(KNOWN_RESTARTS, samples_of(expected))), expected)?;
            }
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Light that collided not at all, and once.
fn slabs_have_the_orders_that_are_known() -> Result<(), Failed> {
    let mut family = Family::new("orders of slabs", FAMILY_RATE);
    for [depth, albedo, g] in SLABS {
        let open = |above, order| {
            let case = slab(depth, albedo, g, Border::Open, above);
            Case { walker: Walker { orders: [order; 2], ..case.walker }, sampler: Sampler::Sobol, ..case }
        };
        let once = exact(&open(true, 1).walker).once(1.0);
        for (what, above, order, expected) in [
            ("once, back", true, 1, once[0]),
            ("once, through", false, 1, once[1]),
            ("straight", false, 0, unscattered(depth)),
        ] {
            let found = mean(&open(above, order).moments(KNOWN_RESTARTS, samples_of(expected)));
            slab_is(&mut family, &format!("depth {depth}, g {g}, {what}"), found, expected)?;
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Of the image, a bias of `noticed` would have been noticed with 99 % probability.
fn agree(case: &Case, noticed: f64) -> Result<(), Failed> {
    let samples = draws(96);
    let (tested, reference) = (case.moments(RESTARTS, samples), case.reference(RESTARTS * samples));
    let verdict = TileTest { grid: GRID, family_rate: FAMILY_RATE }.compare(&tested, &reference);
    ensure_unbiased(
        &format!("{}, {:?}, g {}", case.name, case.walker.border, case.walker.anisotropy),
        &verdict,
        bound(noticed),
    )
}

/// Three boundaries, three bodies.
fn bodies_look_as_by_an_independent_walk() -> Result<(), Failed> {
    for border in [Border::Open, Border::DenserOutside(1.4), Border::Dielectric(1.4)] {
        agree(&slab(1.0, 0.9, 0.5, border, true), 0.02)?;
        agree(&body("sphere", SPHERE, border, 0.0), 0.01)?;
        agree(&body("cube", CUBE, border, -0.4), 0.01)?;
    }
    Ok(())
}

fn orders_look_as_by_an_independent_walk() -> Result<(), Failed> {
    let mut sphere = body("sphere", SPHERE, Border::Dielectric(1.3), 0.7);
    sphere.walker.extinction = [0.7, 1.5, 3.0];
    let cube = body("cube", CUBE, Border::DenserOutside(1.4), -0.4);
    let each = &[[0, 0], [1, 1], [2, 4], [5, u32::MAX]];
    let slab = slab(1.0, 0.9, 0.5, Border::Dielectric(1.4), true);
    // little light collides five times in the cube
    for (case, all) in [(sphere, each), (cube, &[[0, 0], [1, 1], [2, 4], [2, u32::MAX]]), (slab, each)] {
        for &orders in all {
            agree(&Case { walker: Walker { orders, ..case.walker }, ..case.clone() }, 0.06)?;
        }
    }
    Ok(())
}

/// A hundredth more light, and an anisotropy that is off by 0.02.
fn wrong_media_are_seen() -> Result<(), Failed> {
    let right = slab(1.0, 0.9, 0.5, Border::Open, true);
    let brighter = Walker { sky: |direction| 1.01 * from_above(direction), ..right.walker };
    let turned = Walker { anisotropy: 0.52, ..right.walker };
    for (what, walker) in [("brighter", brighter), ("turned", turned)] {
        let wrong = Case { walker, ..right.clone() };
        let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
        ensure_biased(what, &test.compare(&right.moments(128, 64), &wrong.reference(128 * 64)))?;
    }
    Ok(())
}

/// A path that waits every 64 segments finds what one finds that never waits, and is counted alike.
fn where_a_path_is_cut_does_not_matter() -> Result<(), Failed> {
    for (border, nested) in [(Border::Open, false), (Border::Dielectric(1.4), false), (Border::Dielectric(1.4), true)] {
        let case = slab(20.0, 0.9999, 0.3, border, true);
        let mut source = case.source();
        if nested {
            let inner = source.add_material(case.material());
            let corner = DVec3::new(90.0, -0.1, 90.0);
            source.add_mesh("layer", inner, Mesh::cuboid(corner * DVec3::new(-1.0, 2.0, -1.0), corner));
        }
        let scene = SceneBuffers::build(&source)?;
        let settings = PathSettings { max_depth: 12, ..case.settings() };
        let render = Render { count: 3, ..Render::new([GRID.width, GRID.height], settings) };
        let outputs = |stretch: Option<u32>| {
            let plan = native::changed(native::plan(&scene, &render), |pass| {
                let put = |params: &mut MediaParams| params.stretch = stretch.unwrap_or(params.stretch);
                native::edit::<MediaParams>(pass, put);
            });
            CpuExecutor::inline().run(plan)
        };
        let cut = outputs(None)?;
        ensure(cut[1].iter().skip(1).step_by(4).any(|&scatterings| scatterings > 640), || {
            "no path is long".to_owned()
        })?;
        ensure(cut[0].iter().any(|&word| word != 0), || "nothing is seen".to_owned())?;
        for stretch in [65, 300, 1 << 20] {
            ensure(outputs(Some(stretch))? == cut, || format!("{border:?}: stretches of {stretch} differ"))?;
        }
    }
    Ok(())
}

/// Passes for which no path waits are left out on the host, and every buffer is as if they ran: those that are told to be without work where there is
/// some leave something else behind.
fn passes_without_work_change_nothing() -> Result<(), Failed> {
    let case = slab(20.0, 0.9999, 0.3, Border::Open, true);
    let scene = case.scene();
    let settings = PathSettings { longest_walk: 2047, ..case.settings() };
    let render = Render { count: 2, ..Render::new([4, 3], settings) };
    let buffers = |change: fn(&mut Pass)| {
        let (mut after, mut works) = (Vec::new(), Vec::new());
        CpuExecutor::inline().run_observed(native::changed(native::plan(&scene, &render), change), &mut |step| {
            // the film's passes have no paths
            if step.pass.bound("walkers").is_ok() {
                works.push(step.plane::<PackedWalker>("walkers")?.iter().any(PackedWalker::goes_on));
            }
            after.push(step.pass.bindings.iter().map(|&id| step.read(id)).collect::<Result<Vec<_>, _>>()?);
            Ok(())
        })?;
        Ok::<_, Failed>((after, works))
    };
    let (left_out, works) = buffers(|_| ())?;
    let walks = works.iter().filter(|works| **works).count();
    ensure(walks > 2 && works.len() > 2 * walks, || {
        format!("{walks} of {} passes leave paths that wait", works.len())
    })?;
    ensure(left_out == buffers(|pass| pass.waiting = None)?.0, || "what is left out changes a buffer".to_owned())?;
    let never = |pass: &mut Pass| {
        pass.waiting = pass.waiting.map(|waiting| Waiting { bits: 0, ..waiting });
    };
    ensure(left_out != buffers(never)?.0, || "paths that wait are not missed".to_owned())
}

/// A slab with clear borders, in one piece or cut in two, with a gap in between.
fn pieces(gap: Option<f64>) -> Scene {
    let case = slab(2.0, 0.9, 0.3, Border::Dielectric(1.0), false);
    let mut scene = Scene { name: "pieces".to_owned(), camera: Some(case.camera), ..Scene::default() };
    scene.environment = case.source().environment;
    let (medium, corner) = (scene.add_material(case.material()), DVec3::new(100.0, 0.0, 100.0));
    let ends = match gap {
        None => vec![[-1.0, 0.0]],
        Some(gap) => vec![[-1.0, -0.5], [-0.5 + gap, gap]],
    };
    for [lo, hi] in ends {
        scene.add_mesh(&format!("from {lo}"), medium, Mesh::cuboid(DVec3::Y * lo - corner, DVec3::Y * hi + corner));
    }
    scene
}

/// Two bodies that are apart let as much light through as one that is as thick. Of two whose faces lie in each other the host says so, for light loses its way
/// there.
fn pieces_of_a_medium_are_as_the_whole() -> Result<(), Failed> {
    use rayon::prelude::*;
    let shown = |scene: &Scene| -> Result<Moments, Failed> {
        let buffers = SceneBuffers::build(scene)?;
        let settings = PathSettings { max_depth: 128, sampler: Sampler::Sobol, ..PathSettings::default() };
        let render = Render { count: 16, ..Render::new([GRID.width, GRID.height], settings) };
        let mean = |seed| {
            let render = Render { seed, ..render.clone() };
            let image = render.render(&buffers, &mut CpuExecutor::inline())?.image;
            Ok(image.pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / image.pixels.len() as f64)
        };
        let means: Vec<f64> = (0..64).into_par_iter().map(mean).collect::<Result<_, restir_host::Error>>()?;
        Ok(means.into_iter().collect())
    };
    let (whole, mut family) = (shown(&pieces(None))?, Family::new("pieces of a slab", FAMILY_RATE));
    let apart = pieces(Some(0.01));
    ensure(apart.touching_bodies().is_empty(), || "bodies that are apart touch".to_owned())?;
    let [apart, touching] = [shown(&apart)?, shown(&pieces(Some(0.0)))?];
    let test = ZTest::new(apart, whole);
    println!("whole {:.4}, apart {:.4} (z {:.1}), touching {:.4}", whole.mean(), apart.mean(), test.z, touching.mean());
    family.z_test("apart", test);
    println!("{}", family.verdict()?);
    ensure(whole.standard_error() < 0.005 * whole.mean(), || "too few samples".to_owned())?;
    let named = pieces(Some(0.0)).touching_bodies();
    ensure(named == [["from -1".to_owned(), "from -0.5".to_owned()]], || format!("{named:?}"))?;
    ensure(ZTest::new(touching, whole).z.abs() > 6.0, || "bodies that touch are as the whole, too: say so".to_owned())
}

/// Light that a white body loses, it has lost by mistake: at boundaries, by rounding, or because a walk was too long.
fn white_bodies_cannot_be_seen() -> Result<(), Failed> {
    // shading normals lose what they send to the wrong side
    let faceted = |centre| Mesh { normals: Vec::new(), ..Mesh::sphere(centre, 1.0, 4) };
    let bodies = [
        ("sphere", faceted(DVec3::new(0.3, 0.2, -0.1)), 0.2, white_bodies::Border::Lambert),
        ("cube", Mesh::cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)), 0.05, white_bodies::Border::Lambert),
        ("cube aside", Mesh::cuboid(DVec3::splat(4.5), DVec3::splat(5.5)), 0.2, white_bodies::Border::Lambert),
        ("glass sphere", faceted(DVec3::ZERO), 0.3, white_bodies::Border::Dielectric(1.4)),
    ];
    let mut family = Family::new("white bodies", FAMILY_RATE);
    for (name, mesh, mean_free_path, border) in bodies {
        let found = white_bodies::lost(&white_bodies::scene(mesh, mean_free_path, border)?, 24, 1)?;
        println!("{name}: {found:?}");
        ensure(found.walks > 10_000 && found.scatterings > found.walks, || format!("{name}: {found:?}"))?;
        // a rate of 10^-6 would show one walk in a hundred runs of this test; the command goes on to 10^8
        ensure(found.lost + found.cut + found.leaked <= 1, || format!("{name}: {found:?}"))?;
        // through glass all samples are the same, but for roundings
        family.z_test(name, ZTest::new(found.radiance, Moments::known(1.0, 1.0e-6)));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// What a scene looks like, with the lights inside of its bodies sampled, or found alone.
fn moments_of(scene: &SceneBuffers, settings: &PathSettings, samples: u32) -> Vec<Moments> {
    use rayon::prelude::*;
    let image = |seed: u32| {
        let render = Render { count: samples, seed, ..Render::new([GRID.width, GRID.height], settings.clone()) };
        let rendered = render.render(scene, &mut CpuExecutor::inline()).expect("renders");
        rendered.image.pixels.iter().map(|p| p.map(f64::from)).collect()
    };
    GRID.moments_of(&(0..64).into_par_iter().map(image).collect::<Vec<_>>())
}

/// A sphere of a medium around a lamp, a pebble and a sheet; the lamp's light is scaled.
fn lantern(border: Border, brightness: f32) -> Result<SceneBuffers, Failed> {
    let mut case = body("lantern", SPHERE, border, 0.4);
    case.walker.extinction = [0.3, 1.0, 2.0];
    let mut scene = Scene { name: "lantern".to_owned(), camera: Some(case.camera), ..Scene::default() };
    let material = scene.add_material(case.material());
    scene.add_mesh("body", material, Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 4) });
    let pebble = scene.add_material(Material::diffuse("pebble", [0.4, 0.5, 0.6]));
    scene.add_mesh("pebble", pebble, Mesh::sphere(DVec3::new(0.4, -0.4, 0.3), 0.2, 2));
    let sheet = Material { diffuse_transmission: 0.5, ..Material::diffuse("sheet", [0.7; 3]) };
    let sheet = scene.add_material(sheet);
    scene.add_mesh("sheet", sheet, Mesh::quad(DVec3::new(-0.5, -0.5, -0.3), [DVec3::X, DVec3::Y]));
    scene.add_sphere_light(DVec3::new(-0.1, 0.2, 0.2), 0.3, [4.0, 4.0, 4.0].map(|x| x * brightness));
    let edges = [DVec3::X * 0.5, DVec3::Z * 0.5];
    scene.add_quad_light(DVec3::new(-0.25, -1.6, -0.25), edges, [2.0 * brightness; 3], true);
    Ok(SceneBuffers::build(&scene)?)
}

/// To sample lights where light collides changes noise alone; light that is brighter by a twentieth would be seen.
fn lights_inside_look_alike_sampled_or_found() -> Result<(), Failed> {
    for border in [Border::Open, Border::Dielectric(1.4)] {
        let settings = |lights_inside| PathSettings {
            lights_inside,
            max_depth: 5,
            sampler: Sampler::Independent,
            ..PathSettings::default()
        };
        let moments = |inside, brightness| {
            Ok::<_, Failed>(moments_of(&lantern(border, brightness)?, &settings(inside), draws(128)))
        };
        let (sampled, found) = (moments(true, 1.0)?, moments(false, 1.0)?);
        let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
        ensure_unbiased(&format!("lantern, {border:?}"), &test.compare(&sampled, &found), bound(0.03))?;
        if border == Border::Open {
            ensure_biased("brighter", &test.compare(&moments(true, 1.05)?, &found))?;
        }
        let noise = |of: &[Moments]| mean(of).standard_error() / mean(of).mean();
        println!("{border:?}: standard errors {:.5} sampled, {:.5} found", noise(&sampled), noise(&found));
    }
    Ok(())
}

/// Index-matched bodies, through whose borders lights are sampled.
fn clear_bodies_look_as_by_an_independent_walk() -> Result<(), Failed> {
    let clear = Border::Dielectric(1.0);
    for (case, noticed) in [
        (slab(1.0, 0.9, 0.5, clear, true), 0.02),
        (body("sphere", SPHERE, clear, 0.4), 0.01),
        (body("cube", CUBE, clear, -0.4), 0.01),
    ] {
        ensure(case.scene().features & FEATURE_CLEAR_BORDER != 0, || format!("{} is not clear", case.name))?;
        agree(&case, noticed)?;
    }
    let case = Case {
        walker: Walker { orders: [1, 2], ..body("sphere", SPHERE, clear, 0.7).walker },
        ..body("sphere", SPHERE, clear, 0.7)
    };
    agree(&case, 0.04)
}

/// A sphere with a cube of the same medium inside, and with `apart` another such cube that lies in no body: then what is around them is not known.
fn nested(border: Border, filled: bool, inner: bool, apart: bool) -> Result<Scene, Failed> {
    let case = body("sphere", SPHERE, border, 0.4);
    let (mut scene, mut material) = (case.source(), case.material());
    if !filled {
        material.volume = Some(Volume::absorbing([1.0; 3], f32::INFINITY));
        scene.materials[0] = material.clone();
    }
    let own = scene.add_material(Material { name: "inner".to_owned(), ..material });
    let at = |centre: f64| Mesh::cuboid(DVec3::splat(centre - 0.35), DVec3::splat(centre + 0.25));
    if inner {
        scene.add_mesh("cube", own, at(0.0));
    }
    if apart {
        scene.add_mesh("apart", own, at(90.0));
    }
    let around = scene.surroundings();
    ensure(around == [None, if inner & !apart { Some(0) } else { None }], || format!("{around:?}"))?;
    Ok(scene)
}

/// What is around a body is where light is that leaves it, and its index of refraction is relative to that.
fn bodies_in_bodies_of_their_medium_cannot_be_seen() -> Result<(), Failed> {
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    for (what, border, filled) in [
        ("index-matched", Border::Dielectric(1.0), true),
        ("of the index 1.4", Border::Dielectric(1.4), true),
        ("of clear glass", Border::Dielectric(1.5), false),
    ] {
        let settings = PathSettings { max_depth: 32, sampler: Sampler::Independent, ..PathSettings::default() };
        let moments = |scene: &Scene| Ok::<_, Failed>(moments_of(&SceneBuffers::build(scene)?, &settings, draws(48)));
        let alone = moments(&nested(border, filled, false, false)?)?;
        ensure_unbiased(what, &test.compare(&moments(&nested(border, filled, true, false)?)?, &alone), bound(0.02))?;
        // a path that leaves the cube for the open finds the sphere's border as if it came from nowhere
        let unknown = moments(&nested(border, filled, true, true)?)?;
        ensure_biased(&format!("{what}, surroundings unknown"), &test.compare(&unknown, &alone))?;
    }
    Ok(())
}

/// How a cube lies in a sphere.
#[derive(Clone, Copy, Debug)]
enum Lies {
    /// In its medium.
    Inside,
    /// In a hole that is wider by a thousandth, so that light crosses air on its way from one to the other.
    InAHole,
    /// In its medium, which is not known, for another cube of the same material lies in no body.
    Unknown,
}

/// A sphere with a cube of another medium, both without a border that light notices.
fn in_another(lies: Lies) -> Result<Scene, Failed> {
    let case = body("sphere", SPHERE, Border::Dielectric(1.0), 0.4);
    let (mut scene, material) = (case.source(), case.material());
    let other = Volume::scattering([0.3, 0.8, 0.95], [0.2, 0.4, 3.0], 0.0);
    let other = scene.add_material(Material { name: "other".to_owned(), volume: Some(other), ..material });
    let cube = |wider: f64| Mesh::cuboid(DVec3::splat(-0.35 - wider), DVec3::splat(0.25 + wider));
    if let Lies::InAHole = lies {
        let mut hole = cube(1.0e-3);
        hole.indices.iter_mut().for_each(|triangle| triangle.reverse());
        let sphere = Mesh::union(&[Mesh::clone(&scene.meshes[0]), hole]);
        scene.meshes[0] = sphere.into();
    }
    scene.add_mesh("cube", other, cube(0.0));
    if let Lies::Unknown = lies {
        scene.add_mesh("apart", other, Mesh::cuboid(DVec3::splat(90.0), DVec3::splat(91.0)));
    }
    let around = scene.surroundings();
    let right = [None, if let Lies::Inside = lies { Some(0) } else { None }];
    ensure(around == right, || format!("{lies:?}: {around:?}"))?;
    Ok(scene)
}

/// A body of one medium in another one looks as if it lay in a hole of its form: light that leaves it is in what is around it.
fn bodies_in_bodies_are_as_in_a_hole_of_their_form() -> Result<(), Failed> {
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    let settings = PathSettings { max_depth: 48, sampler: Sampler::Independent, ..PathSettings::default() };
    let moments = |lies| Ok::<_, Failed>(moments_of(&SceneBuffers::build(&in_another(lies)?)?, &settings, draws(48)));
    let in_a_hole = moments(Lies::InAHole)?;
    ensure_unbiased("in another medium", &test.compare(&moments(Lies::Inside)?, &in_a_hole), bound(0.02))?;
    ensure_biased("surroundings unknown", &test.compare(&moments(Lies::Unknown)?, &in_a_hole))
}

/// A lamp beside a pebble of glass, both in wax: light that leaves the pebble is in wax again.
fn light_inside_of_what_encloses_a_body_is_dimmed() -> Result<(), Failed> {
    let mut scene = body("sphere", SPHERE, Border::Open, 0.4).source();
    scene.add_sphere_light(DVec3::new(0.4, -0.2, 0.1), 0.15, [3.0, 4.0, 5.0]);
    let glass = Material { transmission: 1.0, roughness: 0.0, ior: 1.5, ..Material::diffuse("glass", [1.0; 3]) };
    let volume = Some(Volume::absorbing([0.9, 0.5, 0.9], 0.5));
    let glass = scene.add_material(Material { volume, ..glass });
    let pebble = Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::new(-0.2, 0.2, 0.3), 0.35, 3) };
    scene.add_mesh("pebble", glass, pebble);
    ensure(scene.surroundings().last() == Some(&Some(0)), || format!("{:?}", scene.surroundings()))?;
    let buffers = SceneBuffers::build(&scene)?;
    let settings = PathSettings { max_depth: 16, sampler: Sampler::Independent, ..PathSettings::default() };
    let [sampled, found] = [true, false]
        .map(|lights_inside| moments_of(&buffers, &PathSettings { lights_inside, ..settings.clone() }, draws(128)));
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    ensure_unbiased("lights sampled inside, or found", &test.compare(&sampled, &found), bound(0.03))
}

/// To sample lights through clear borders changes noise alone; light that is brighter by three hundredths would be seen.
fn lights_behind_clear_borders_look_alike_sampled_or_found() -> Result<(), Failed> {
    let moments = |lights_inside, max_depth, brightness: f32| {
        let mut scene = clear_media();
        // of a point light nothing is found
        scene.lights.clear();
        scene.materials.iter_mut().for_each(|material| material.emission = material.emission.map(|x| x * brightness));
        scene.environment.iter_mut().for_each(|sky| sky.scale *= brightness);
        let settings =
            PathSettings { lights_inside, max_depth, sampler: Sampler::Independent, ..PathSettings::default() };
        Ok::<_, Failed>(moments_of(&SceneBuffers::build(&scene)?, &settings, draws(128)))
    };
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE };
    for max_depth in [3, 6] {
        let (sampled, found) = (moments(true, max_depth, 1.0)?, moments(false, max_depth, 1.0)?);
        ensure_unbiased(&format!("{max_depth} segments"), &test.compare(&sampled, &found), bound(0.03))?;
        let noise = |of: &[Moments]| mean(of).standard_error() / mean(of).mean();
        println!("{max_depth}: standard errors {:.5} sampled, {:.5} found", noise(&sampled), noise(&found));
    }
    ensure_biased("brighter", &test.compare(&moments(true, 6, 1.03)?, &moments(false, 6, 1.0)?))
}

/// What burns in the middle of a white sphere leaves it evenly: `I / R^2` of a light of the intensity I over pi, and as much of a white
/// ball of the radiance L and the radius r as `L r^2 / R^2`. Without a collision a point's light is left by `exp(-R / l)`.
fn what_burns_inside_of_white_bodies_comes_out() -> Result<(), Failed> {
    let (mean_free_path, radius) = (0.8, 0.25);
    let filled = |g: f32| {
        let camera = looking([0.0, -9.0, 0.0], [0.0; 3], 8.0);
        let mut scene = Scene { name: "white body".to_owned(), camera: Some(camera), ..Scene::default() };
        let volume = Some(Volume::scattering([1.0; 3], [mean_free_path; 3], g));
        let white = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("white", [1.0; 3]) };
        let white = scene.add_material(white);
        scene.add_mesh("body", white, Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 6) });
        scene
    };
    let mut family = Family::new("lights in white bodies", FAMILY_RATE);
    let expect = |family: &mut Family, what: &str, scene: &Scene, orders, expected: f64| -> Result<(), Failed> {
        let settings = PathSettings { orders, max_depth: 24, sampler: Sampler::Independent, ..PathSettings::default() };
        let found = mean(&moments_of(&SceneBuffers::build(scene)?, &settings, 12));
        println!("{what}: {:.5} +- {:.5}, expected {expected:.5}", found.mean(), found.standard_error());
        // the sphere of triangles is smaller by up to 2e-4
        family.z_test(what, ZTest::new(found, Moments::known(expected, 4.0e-4 * expected)));
        Ok(())
    };
    for g in [0.0, 0.6] {
        let mut point = filled(g);
        let kind = LightKind::Point { position: DVec3::ZERO };
        point.lights.push(Light { name: "point".to_owned(), intensity: [std::f32::consts::PI; 3], kind });
        let unscattered = (-1.0 / f64::from(mean_free_path)).exp();
        expect(&mut family, &format!("point, g {g}, unscattered"), &point, Orders { least: 0, most: 0 }, unscattered)?;
        expect(&mut family, &format!("point, g {g}"), &point, Orders::ALL, 1.0)?;
        let mut ball = filled(g);
        let white = ball.add_material(Material::emitter("ball", [1.0; 3], [1.0; 3]));
        ball.add_mesh("ball", white, Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, radius, 5) });
        expect(&mut family, &format!("ball, g {g}"), &ball, Orders::ALL, radius * radius)?;
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// After a body that is alone there is nothing to come; a wall behind the viewer is lit once, and not seen again.
fn paths_may_end_after_media() -> Result<(), Failed> {
    let film = |scene: &SceneBuffers, max_depth, after_subsurface| {
        let settings = PathSettings { max_depth, after_subsurface, ..PathSettings::default() };
        let render = Render { count: 4, ..Render::new([GRID.width, GRID.height], settings) };
        render.render(scene, &mut CpuExecutor::inline()).map(|rendered| rendered.image.pixels)
    };
    use AfterSubsurface::{DirectLight, Paths};
    let alone = body("sphere", SPHERE, Border::Open, 0.0).scene();
    ensure(film(&alone, 6, DirectLight)? == film(&alone, 6, Paths)?, || "a body that is alone differs".to_owned())?;
    // the camera's segment, the walk, and direct light where it leaves
    let candles = SceneBuffers::build(&builtin::scene("candles").ok_or("no scene of that name")?)?;
    let brightness = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    let [short, ended, whole] = [(3, Paths), (6, DirectLight), (6, Paths)]
        .map(|(depth, after)| film(&candles, depth, after).map(|pixels| brightness(&pixels)));
    let (short, ended, whole) = (short?, ended?, whole?);
    println!("3 segments {short:.3}, 6 that end after media {ended:.3}, 6 {whole:.3}");
    ensure(short < ended && ended < whole, || "light is lost or added".to_owned())
}

/// Half of a slab is entered at each of two texels: there it has the bits of one that is untextured.
fn the_texture_where_light_enters_decides() -> Result<(), Failed> {
    let codes = [[250, 120, 60, 255], [90, 200, 240, 255]];
    let textured = |color: [f32; 3], texture: bool| -> Result<Vec<[f32; 3]>, Failed> {
        let mut case = slab(1.0, 0.9, 0.3, Border::Open, true);
        case.camera = looking([0.5, 6.0, 0.0], [0.5, 0.0, 0.1], 20.0);
        let mut scene = Scene { name: "slab".to_owned(), camera: Some(case.camera), ..Scene::default() };
        scene.environment = Some(Environment {
            name: "white".into(),
            size: [1, 1],
            pixels: vec![[1.0; 3]].into(),
            scale: 1.0,
            rotation: 0.0,
        });
        let mut material = case.material();
        let scattering = material.volume.as_mut().and_then(|volume| volume.scattering.as_mut()).ok_or("it scatters")?;
        scattering.color = color;
        if texture {
            let (wrap, filter) = ([Wrap::Clamp; 2], Filter::Nearest);
            scene.textures.push(Texture {
                name: "halves".to_owned(),
                size: [2, 1],
                texels: codes.into(),
                wrap,
                filter,
            });
            scattering.color_texture = Some(TextureUse::new(0));
            scattering.strength_texture = Some(TextureUse::new(0));
        }
        let material = scene.add_material(material);
        let mut mesh = Mesh::cuboid(DVec3::new(-100.0, -1.0, -100.0), DVec3::new(100.0, 0.0, 100.0));
        mesh.uvs = mesh.positions.iter().map(|[x, _, _]| [if *x > 0.0 { 1.0 } else { 0.0 }, 0.5]).collect();
        scene.add_mesh("slab", material, mesh);
        Ok(case.rendered(&SceneBuffers::build(&scene)?, 4, 5).image.pixels)
    };
    let factor = [0.9, 0.7, 0.5];
    let both = textured(factor, true)?;
    let linear = |code: u8| {
        let s = f64::from(code) / 255.0;
        (if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }) as f32
    };
    let mut counts = [0, 0];
    let halves = codes.map(|[r, g, b, _]| {
        let texel = [r, g, b].map(linear);
        textured([0, 1, 2].map(|i| factor[i] * texel[i]), false)
    });
    for (half, plain) in halves.into_iter().enumerate() {
        counts[half] = both.iter().zip(plain?).filter(|(a, b)| **a == *b).count();
    }
    println!("of {} pixels {counts:?} are as of one colour", both.len());
    // where they meet, a pixel has samples of both
    let all = (GRID.width * GRID.height) as usize;
    ensure(
        counts.iter().all(|&count| count >= all / 4) && counts[0] + counts[1] + 2 * GRID.height as usize >= all,
        || format!("{counts:?} of {all} pixels"),
    )
}

/// A scene that is larger by a power of two has the same bits.
fn scale_does_not_matter() -> Result<(), Failed> {
    let film = |scale: f64| {
        let mut case = body("sphere", SPHERE, Border::Dielectric(1.3), 0.5);
        case.walker.body = Body::Sphere(DVec3::ZERO, scale);
        case.walker.extinction = case.walker.extinction.map(|rate| rate / scale);
        (case.camera.position, case.camera.target) = (case.camera.position * scale, case.camera.target * scale);
        case.rendered(&case.scene(), 4, 7).image.pixels
    };
    let one = film(1.0);
    ensure(one.iter().flatten().any(|&x| x > 0.0), || "nothing is seen".to_owned())?;
    for scale in [1.0 / 16_384.0, 16_384.0] {
        ensure(film(scale) == one, || format!("a scale of {scale} shows another picture"))?;
    }
    Ok(())
}

/// Glass, coloured glass among it, has the bits that it has without a body of wax that no light reaches.
fn scattering_elsewhere_changes_nothing() -> Result<(), Failed> {
    let mut scene = builtin::scene("glass").ok_or("no scene of that name")?;
    let hidden = slab(1.0, 0.9, 0.0, Border::Open, true).material();
    let wax = scene.add_material(hidden);
    // below the floor
    scene.add_mesh("wax", wax, Mesh::cuboid(DVec3::new(-1.0, -3.0, -1.0), DVec3::new(1.0, -2.0, 1.0)));
    let buffers = SceneBuffers::build(&scene)?;
    let film = |subsurface| {
        let settings = PathSettings { subsurface, max_depth: 10, ..PathSettings::default() };
        let render = Render { count: 8, ..Render::new([32, 24], settings) };
        render.render(&buffers, &mut CpuExecutor::inline())
    };
    let (walked, plain) = (film(Subsurface::Walk)?, film(Subsurface::Off)?);
    ensure(walked.counts == [("walks", 0), ("scatterings", 0), ("cut_walks", 0), ("leaked_walks", 0)], || {
        format!("{:?}", walked.counts)
    })?;
    ensure(walked.image.pixels == plain.image.pixels, || "the glass looks otherwise".to_owned())
}

/// A path of three segments is the camera's, a walk with whatever it is reflected from inside, and one to the sky: a fourth adds nothing
/// to a body that is alone.
fn the_last_segment_may_be_a_walk() -> Result<(), Failed> {
    let case = body("sphere", SPHERE, Border::Dielectric(1.4), 0.0);
    let scene = case.scene();
    let film = |max_depth| {
        let settings = PathSettings { max_depth, ..case.settings() };
        let render = Render { count: 4, ..Render::new([GRID.width, GRID.height], settings) };
        render.render(&scene, &mut CpuExecutor::inline()).map(|rendered| rendered.image.pixels)
    };
    ensure(film(3)? == film(4)?, || "a fourth segment adds light".to_owned())?;
    ensure(film(2)? != film(3)?, || "the third adds none".to_owned())
}

fn walks_are_counted() -> Result<(), Failed> {
    let case = body("cube", CUBE, Border::Open, 0.0);
    let rendered = case.rendered(&case.scene(), 256, 0);
    println!("{:?}", rendered.counts);
    let count = |name: &str| rendered.counts.iter().find(|(of, _)| *of == name).map_or(0, |(_, count)| *count);
    ensure(count("walks") > 10_000 && count("scatterings") > count("walks"), || "too few".to_owned())?;
    ensure(count("cut_walks") == 0 && count("leaked_walks") == 0, || format!("{:?}", rendered.counts))
}
