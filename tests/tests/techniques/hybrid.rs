//! Path tracing with diffusion: against known slabs and half spaces, against the walk, and with each of its choices against the others.

use libtest_mimic::Failed;
use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::{Camera, Environment, Filter, Material, Mesh, Scene, Texture, TextureUse, Wrap};
use restir_host::technique::Technique;
use restir_host::technique::path::{
    Crossings, Fit, Orders, Parts, PathSettings, RadiusChoice, Subsurface, SupportChoice, Thickness, WayOut,
};
use restir_shared::bsdf::ScatteringFunction;
use restir_shared::diffusion::{ALBEDO_SLOPE, REACH, Shape, TAIL, diffuse_albedo};
use restir_shared::glam::{DVec3, UVec4, Vec3};
use restir_shared::layout::FEATURES_ALL;
use restir_shared::rng::Sampler;
use restir_shared::technique::path::hybrid::Exit;
use restir_tests::half_sky::{self, color, gray, scene, slab, waxy};
use restir_tests::native;
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};
use restir_tests::suite::ensure;
use restir_tests::walk_f64::unscattered;

restir_tests::suite! {
    later {
        slabs_are_off_by_what_is_known half_spaces_are_off_by_what_is_known parts_are_what_they_are_alone
        parts_are_the_orders_of_the_walk textures_are_those_where_light_enters demodulation_keeps_texture
        negative_light_goes_on_as_other_light what_is_counted_twice_is_seen choices_do_not_change_the_mean published_densities_are_too_dark
        narrow_media_are_lambertian exits_lose_nothing glass_bodies_keep_energy bodies_are_seen_through_panes
        later_bodies_have_their_colour balls_are_no_slabs closed_borders_pass_light_twice scenes_without_objects_are_refused
    }
}

/// The fit `A(albedo)` of profiles.
fn reflected(albedo: f64) -> f64 {
    f64::from(diffuse_albedo(albedo as f32, (1.0 - albedo) as f32, 0.0))
}

/// A colourful cube, seen from aside, some bodies about it.
fn cube(others: Vec<(Material, Mesh)>) -> SceneBuffers {
    let wax = waxy([0.9, 0.7, 0.3], [0.5, 0.2, 0.05]);
    let mesh = Mesh::cuboid(DVec3::new(-0.8, -0.7, -0.9), DVec3::new(0.8, 0.9, 0.7));
    let bodies = [vec![(wax, mesh)], others].concat();
    scene(bodies, [3.0, -0.4, 2.0], [0.0, 0.1, 0.0], 0.2)
}

const ALL: [usize; 3] = [0, 1, 2];

/// The means of an image by channel.
fn channel_means(scene: &SceneBuffers, settings: &PathSettings, samples: u32, seed: u32) -> [f64; 3] {
    let render = Render { count: samples, seed, ..Render::new([16, 16], settings.clone()) };
    let rendered = render.render(scene, &mut CpuExecutor::inline()).expect("renders");
    assert_eq!(rendered.dropped_samples, 0);
    let pixels = &rendered.image.pixels;
    ALL.map(|c| pixels.iter().map(|pixel| f64::from(pixel[c])).sum::<f64>() / pixels.len() as f64)
}

/// The same over renders of other seeds.
fn means(scene: &SceneBuffers, settings: &PathSettings, restarts: u32, samples: u32) -> [Moments; 3] {
    sums(scene, std::slice::from_ref(settings), restarts, samples)
}

/// The means of a gray image: its channels are the same, but for how they are told apart.
fn mean(scene: &SceneBuffers, settings: &PathSettings, restarts: u32, samples: u32) -> Moments {
    means(scene, settings, restarts, samples)[1]
}

/// The means by channel of the sum of several renders with the same random numbers.
fn sums(scene: &SceneBuffers, settings: &[PathSettings], restarts: u32, samples: u32) -> [Moments; 3] {
    use rayon::prelude::*;
    let sum = |seed| {
        let all = settings.iter().map(|settings| channel_means(scene, settings, samples, seed));
        all.fold([0.0; 3], |sum, means| ALL.map(|c| sum[c] + means[c]))
    };
    let sums: Vec<[f64; 3]> = (0..restarts).into_par_iter().map(sum).collect();
    ALL.map(|c| sums.iter().map(|sum| sum[c]).collect())
}

fn settings(subsurface: Subsurface, profile: Fit) -> PathSettings {
    PathSettings { subsurface, profile, max_depth: 3, sampler: Sampler::Independent, ..PathSettings::default() }
}

/// `|R - R0| + |T - T0|` of what a slab reflects and transmits, and its standard error.
fn off(settings: &PathSettings) -> [f64; 2] {
    const WALK: [f64; 2] = [0.3529, 0.4746];
    let [r, t] = [true, false].map(|above| mean(&slab(gray(0.9, 1.0), 1.0, above), settings, 64, 64));
    println!("R {:.5} +- {:.5}, T {:.5} +- {:.5}", r.mean(), r.standard_error(), t.mean(), t.standard_error());
    let sum = (r.mean() - WALK[0]).abs() + (t.mean() - WALK[1]).abs();
    [sum, r.standard_error().hypot(t.standard_error())]
}

/// A profile alone reflects too much and transmits half; a hybrid whose profile is that of a half space reflects too much. With the thickness, little is left.
fn slabs_are_off_by_what_is_known() -> Result<(), Failed> {
    for (subsurface, profile, thickness, known) in [
        (Subsurface::Diffusion, Fit::Searchlight, Thickness::Measured, 0.361),
        (Subsurface::Hybrid, Fit::Searchlight, Thickness::Ignored, 0.152),
        (Subsurface::Hybrid, Fit::Diffuse, Thickness::Ignored, 0.125),
        (Subsurface::Hybrid, Fit::Diffuse, Thickness::Measured, 0.024),
    ] {
        let [found, error] = off(&PathSettings { thickness, ..settings(subsurface, profile) });
        println!("{subsurface:?}, {profile:?}, {thickness:?}: {found:.4} +- {error:.4}, known {known}");
        ensure(error < 2.0e-3 && (found - known).abs() < 0.01, || format!("{subsurface:?}, {profile:?}: {found}"))?;
    }
    Ok(())
}

/// What is known of half spaces: how much less a hybrid reflects than the walk.
fn half_spaces_are_off_by_what_is_known() -> Result<(), Failed> {
    let mut family = Family::new("half spaces", FAMILY_RATE);
    for (albedo, known) in [(0.9, -0.024), (0.95, -0.020), (0.98, -0.013)] {
        let scene = slab(gray(albedo, 1.0), 60.0, true);
        let [hybrid, walk] = [Subsurface::Hybrid, Subsurface::Walk]
            .map(|subsurface| mean(&scene, &settings(subsurface, Fit::Diffuse), 64, draws(64)));
        let ratio = hybrid.mean() / walk.mean();
        let error = ratio * (hybrid.standard_error() / hybrid.mean()).hypot(walk.standard_error() / walk.mean());
        println!("albedo {albedo}: hybrid / walk - 1 = {:.4} +- {error:.4}, known {known}", ratio - 1.0);
        ensure(error < bound(2.0e-3), || format!("too few samples: {error}"))?;
        // three digits are known
        family
            .z_test(format!("{albedo}"), ZTest::new(Moments::known(ratio - 1.0, error), Moments::known(known, 5.0e-4)));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// The profile's light on the far side of a slab: `A (exp(-x) / 4 + 3 exp(-x / 3) / 4)` less what is beyond its reach.
fn across(albedo: f64, depth: f64, shape: Shape) -> f64 {
    let a = reflected(albedo);
    let x = depth * f64::from(shape.factor(a as f32));
    assert!(x < f64::from(REACH));
    a * (0.25 * (-x).exp() + 0.75 * (-x / 3.0).exp() - f64::from(TAIL))
}

fn parts_are_what_they_are_alone() -> Result<(), Failed> {
    let mut family = Family::new("parts", FAMILY_RATE);
    let (above, below) = (slab(gray(0.9, 1.0), 1.0, true), slab(gray(0.9, 1.0), 1.0, false));
    let part = |parts| PathSettings { parts, ..settings(Subsurface::Hybrid, Fit::Diffuse) };
    let drawn = |parts| PathSettings { way_out: WayOut::Drawn, ..part(parts) };
    let alone = |profile| settings(Subsurface::Diffusion, profile);
    let a = reflected(0.9) * f64::from(1.0 - TAIL);
    for (name, scene, settings, known, error) in [
        ("boundary", &below, part(Parts::Boundary), unscattered(1.0), 1.0e-6),
        ("boundary above", &above, part(Parts::Boundary), 0.0, 1.0e-6),
        ("single, R", &above, part(Parts::Single), 0.1770, 5.0e-4),
        ("single, T", &below, part(Parts::Single), 0.1044, 5.0e-4),
        ("drawn, R", &above, drawn(Parts::Single), 0.1770, 5.0e-4),
        ("drawn, T", &below, drawn(Parts::Single), 0.1044, 5.0e-4),
        ("rest", &above, part(Parts::Rest), 0.0, 1.0e-6),
        ("profile, R", &above, alone(Fit::Diffuse), a, 1.0e-6),
        ("profile, T", &below, alone(Fit::Diffuse), across(0.9, 1.0, Shape::Diffuse), 1.0e-6),
        ("searchlight, T", &below, alone(Fit::Searchlight), across(0.9, 1.0, Shape::Searchlight), 1.0e-6),
    ] {
        let found = mean(scene, &settings, 32, draws(64));
        println!("{name}: {:.5} +- {:.5}, known {known:.5}", found.mean(), found.standard_error());
        family.z_test(name, ZTest::new(found, Moments::known(known, error)));
    }
    // the parts of one sample have its numbers, so they add up but for rounding
    let parts = [Parts::Boundary, Parts::Single, Parts::Profile].map(|parts| mean(&below, &part(parts), 8, 16).mean());
    let all = mean(&below, &part(Parts::All), 8, 16).mean();
    ensure((parts.iter().sum::<f64>() - all).abs() < 1.0e-5, || format!("{parts:?} and {all}"))?;
    println!("{}", family.verdict()?);
    Ok(())
}

/// What crosses a body, and what collides once in it, is the walk's light of no and of one collision: through Lambert's boundary and through
/// one that light passes straight, by channel. (Behind others the walk is reflected from inside, and parts are not.)
fn parts_are_the_orders_of_the_walk() -> Result<(), Failed> {
    let mut family = Family::new("orders", FAMILY_RATE);
    let clear = Material {
        diffuse_transmission: 0.0,
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.0,
        ..waxy([0.9, 0.7, 0.3], [0.5, 0.2, 0.1])
    };
    let facets = Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 2) };
    let block = Mesh::cuboid(DVec3::new(-0.8, -0.7, -0.9), DVec3::new(0.8, 0.9, 0.7));
    let part = |parts| PathSettings { parts, ..settings(Subsurface::Hybrid, Fit::Diffuse) };
    let of_orders =
        |least, most| PathSettings { orders: Orders { least, most }, ..settings(Subsurface::Walk, Fit::Diffuse) };
    for (border, material) in [("Lambert", waxy([0.9, 0.7, 0.3], [0.5, 0.2, 0.1])), ("clear", clear)] {
        for (name, mesh) in [("cube", &block), ("sphere", &facets)] {
            let scene = scene(vec![(material.clone(), mesh.clone())], [3.0, -0.4, 2.0], [0.0, 0.1, 0.0], 0.2);
            for (what, parts, orders) in [
                ("boundary", vec![part(Parts::Boundary), part(Parts::Rest)], of_orders(0, 0)),
                ("single", vec![part(Parts::Single)], of_orders(1, 1)),
            ] {
                let (found, walk) = (sums(&scene, &parts, 64, draws(16)), means(&scene, &orders, 64, draws(16)));
                for c in ALL {
                    let test = ZTest::new(found[c], walk[c]);
                    let (walk, error) = (walk[c].mean(), test.standard_error);
                    println!("{border} {name}, {what} {c}: {:+.5} +- {error:.5} of {walk:.4}", test.difference);
                    ensure(error < bound(0.015) * walk, || format!("{border} {name}, {what}: too few samples"))?;
                    family.z_test(format!("{border} {name} {what} {c}"), test);
                }
            }
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// A slab whose medium has one colour where x is below zero and another beyond.
fn two_colored(colors: [[f32; 3]; 2], shown: impl Fn(f32) -> f32, height: f64) -> SceneBuffers {
    let mut scene = Scene { name: "slab".to_owned(), ..Scene::default() };
    let (from, at) = (DVec3::new(0.0, height, 0.0), DVec3::new(0.0, 0.0, 0.01));
    scene.camera = Some(Camera::pinhole(from, at, DVec3::Z, 40.0_f64.to_radians()));
    scene.environment = Some(Environment {
        name: "white".into(),
        size: [1, 1],
        pixels: vec![[1.0; 3]].into(),
        scale: 1.0,
        rotation: 0.0,
    });
    let code = |linear: f32| (255.0 * f64::from(linear).powf(1.0 / 2.2)).round() as u8;
    let texel = |[r, g, b]: [f32; 3]| [code(r), code(g), code(b), 255];
    let texels = colors.map(texel).into();
    let (wrap, filter) = ([Wrap::Clamp; 2], Filter::Nearest);
    scene.textures.push(Texture { name: "halves".to_owned(), size: [2, 1], texels, wrap, filter });
    let mut material = waxy([1.0; 3], [0.1; 3]);
    if let Some(scattering) = material.volume.as_mut().and_then(|volume| volume.scattering.as_mut()) {
        scattering.color_texture = Some(TextureUse::new(0));
    }
    let material = scene.add_material(material);
    let mut mesh = Mesh::cuboid(DVec3::new(-100.0, -1.0, -100.0), DVec3::new(100.0, 0.0, 100.0));
    mesh.uvs = mesh.positions.iter().map(|[x, _, _]| [shown(*x), 0.5]).collect();
    scene.add_mesh("slab", material, mesh);
    SceneBuffers::build(&scene).expect("builds")
}

/// Where light enters, the texture decides for all parts: on either side of an edge are the bits of a slab of that texel alone.
fn textures_are_those_where_light_enters() -> Result<(), Failed> {
    let colors = [[0.9, 0.5, 0.2], [0.3, 0.6, 0.9]];
    let settings = settings(Subsurface::Hybrid, Fit::Diffuse);
    let image = |shown: &dyn Fn(f32) -> f32| {
        let render = Render { count: 8, ..Render::new([16, 16], settings.clone()) };
        let scene = two_colored(colors, shown, 6.0);
        render.render(&scene, &mut CpuExecutor::inline()).map(|done| done.image.pixels)
    };
    // the texture is stretched from one side of the slab to the other, and has its edge in the middle
    let both = image(&|x| if x > 0.0 { 1.0 } else { 0.0 })?;
    let counts = [0.0, 1.0]
        .map(|u| -> Result<usize, Failed> { Ok(image(&|_| u)?.iter().zip(&both).filter(|(a, b)| a == b).count()) });
    let [first, second] = counts;
    let (first, second) = (first?, second?);
    println!("of 256 pixels {first} and {second} are as of one colour");
    ensure(first >= 64 && second >= 64 && first + second + 32 >= 256, || format!("{first} and {second} of 256"))
}

/// Pixels along a side of pictures that are blurred.
const SIDE: usize = 32;

/// Means over the 13 x 13 pixels about each, as far as there are some.
fn blurred(values: &[f32]) -> Vec<f32> {
    let near = |i: usize| i.saturating_sub(6)..(i + 7).min(SIDE);
    let mean = |index: usize| {
        let window = near(index / SIDE).flat_map(|y| near(index % SIDE).map(move |x| y * SIDE + x));
        let (sum, count) = window.fold((0.0, 0), |(sum, count), at| (sum + values[at], count + 1));
        sum / count as f32
    };
    (0..values.len()).map(mean).collect()
}

/// Of the columns beside the two in the middle: their difference over their sum.
fn contrast(values: &[f32]) -> f32 {
    let column = |x: usize| (0..SIDE).map(|y| values[y * SIDE + x]).sum::<f32>();
    let [left, right] = [column(SIDE / 2 - 2), column(SIDE / 2 + 1)];
    (left - right).abs() / (left + right)
}

/// The contrast of a slab of two colours: of its light, of that blurred, and of what is divided by the scattering albedo, blurred and multiplied by
/// it again.
fn contrasts(colors: [f32; 2]) -> Result<[f32; 3], Failed> {
    let scene = two_colored(colors.map(|color| [color; 3]), |x| if x > 0.0 { 1.0 } else { 0.0 }, 6.0);
    let settings = PathSettings { parts: Parts::Subsurface, ..settings(Subsurface::Hybrid, Fit::Diffuse) };
    let (size, integral) = ([SIDE as u32; 2], settings.integral());
    let shot = Shot { scene: &scene, frame: 0.0, camera: &|_| scene.camera, size, seed: 0, integral, samples: 16 };
    let albedo = shot.channels(&[Aov::Scattering])?;
    let albedo: Vec<f32> = albedo[1].values.iter().map(|value| value.max(0.01)).collect();
    let render = Render { count: 64, ..Render::new(size, settings) };
    let light = render.render(&scene, &mut CpuExecutor::inline())?.image.pixels;
    let light: Vec<f32> = light.iter().map(|pixel| pixel[1]).collect();
    let divided: Vec<f32> = light.iter().zip(&albedo).map(|(light, albedo)| light / albedo).collect();
    let again: Vec<f32> = blurred(&divided).iter().zip(&albedo).map(|(light, albedo)| light * albedo).collect();
    Ok([&light, &blurred(&light), &again].map(|values| contrast(values)))
}

/// Demodulation by the scattering albedo keeps the contrast of dark textures, which collide about once. Of bright ones it keeps less: their albedos are all
/// near 1, and what many collisions leave differs by more.
fn demodulation_keeps_texture() -> Result<(), Failed> {
    for (colors, least) in [([0.1, 0.03], 0.85), ([0.9, 0.3], 0.4)] {
        let [whole, plain, kept] = contrasts(colors)?;
        println!("{colors:?}: contrast {whole:.3}, blurred {plain:.3}, divided before {kept:.3}");
        ensure(whole > 0.2 && plain < 0.3 * whole, || format!("{colors:?}: {plain} of {whole}, without demodulation"))?;
        ensure(kept > least * whole && kept < 1.05 * whole, || format!("{colors:?}: {kept} of {whole}"))?;
    }
    Ok(())
}

/// Light of a signed profile is negative near an entry, and goes on as other light does: on a half space under a white sheet that lets
/// through the sky's light. There all of it comes at the path's fourth segment. Without what is negative the half space is too bright.
fn negative_light_goes_on_as_other_light() -> Result<(), Failed> {
    /// Of the profile at this albedo, what is negative (spec, section 4.7).
    const NEGATIVE: f64 = 0.00534;
    let albedo = 0.95;
    let sheet = Material { diffuse_transmission: 1.0, ..Material::diffuse("sheet", [1.0; 3]) };
    let above = Mesh::quad(DVec3::new(-150.0, 8.0, -150.0), [DVec3::Z * 300.0, DVec3::X * 300.0]);
    let corner = DVec3::new(150.0, 0.0, 150.0);
    let body = Mesh::cuboid(-corner - DVec3::Y * 60.0, corner);
    let scene = scene(vec![(gray(albedo, 1.0), body), (sheet, above)], [0.0, 6.0, 0.0], [0.3, 0.0, 0.1], 0.0);
    let signed = PathSettings {
        parts: Parts::Profile,
        max_depth: 4,
        roulette: false,
        ..settings(Subsurface::Hybrid, Fit::Searchlight)
    };
    let found = mean(&scene, &signed, 64, 64);
    let known = reflected(albedo) * f64::from(1.0 - TAIL) - f64::from(ALBEDO_SLOPE) * albedo;
    println!("{:.5} +- {:.5}, known {known:.5}", found.mean(), found.standard_error());
    ensure((found.mean() - known - NEGATIVE).abs() > 5.0 * found.standard_error(), || {
        "light that is never negative passes for right".to_owned()
    })?;
    let mut family = Family::new("negative light", FAMILY_RATE);
    family.z_test("signed", ZTest::new(found, Moments::known(known, 2.0e-4)));
    println!("{}", family.verdict()?);
    Ok(())
}

/// Of a half space a hybrid reflects what collides once, and what the profile holds beyond its own part of that. With that part it is
/// `0.2046 albedo + A`, a third too much: the suite's half spaces tell the two apart.
fn what_is_counted_twice_is_seen() -> Result<(), Failed> {
    let mut family = Family::new("counted twice", FAMILY_RATE);
    let (albedo, scene) = (0.9, slab(gray(0.9, 1.0), 60.0, true));
    let once = 2.0 / 3.0 * (1.0 - std::f64::consts::LN_2) * albedo;
    let all = reflected(albedo) * f64::from(1.0 - TAIL);
    let right = settings(Subsurface::Hybrid, Fit::Searchlight);
    let twice = PathSettings { counted_twice: true, ..right.clone() };
    let without = f64::from(ALBEDO_SLOPE) * albedo;
    for (name, settings, known) in [("once", right, once + all - without), ("twice", twice, once + all)] {
        let found = mean(&scene, &settings, 64, 64);
        println!("{name}: {:.5} +- {:.5}, known {known:.5}", found.mean(), found.standard_error());
        ensure((found.mean() - 0.4778).abs() > 20.0 * found.standard_error() || name == "once", || {
            "what is counted twice passes for right".to_owned()
        })?;
        family.z_test(name, ZTest::new(found, Moments::known(known, 2.0e-4)));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Each choice is one of how to sample, and none of what.
fn choices_do_not_change_the_mean() -> Result<(), Failed> {
    let mut family = Family::new("choices", FAMILY_RATE);
    let scene = cube(Vec::new());
    let usual = settings(Subsurface::Hybrid, Fit::Diffuse);
    let reference = means(&scene, &usual, 64, draws(64));
    for (name, settings) in [
        ("one crossing", PathSettings { crossings: Crossings::One, ..usual.clone() }),
        ("by albedo", PathSettings { radius_channel: RadiusChoice::Albedo, ..usual.clone() }),
        ("drawn", PathSettings { way_out: WayOut::Drawn, ..usual.clone() }),
        ("lights alone", PathSettings { profile_paths: false, ..usual.clone() }),
        ("Sobol", PathSettings { sampler: Sampler::Sobol, ..usual.clone() }),
    ] {
        let found = means(&scene, &settings, 64, draws(64));
        for c in ALL {
            let test = ZTest::new(found[c], reference[c]);
            println!(
                "{name}, {c}: {:+.5} +- {:.5} of {:.4}",
                test.difference,
                test.standard_error,
                reference[c].mean()
            );
            ensure(test.standard_error < bound(0.012) * reference[c].mean(), || format!("{name}: too few samples"))?;
            family.z_test(format!("{name} {c}"), test);
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Through a slab of four `d`, where two channels are narrower, the published densities lose a tenth of the light.
fn published_densities_are_too_dark() -> Result<(), Failed> {
    let mut family = Family::new("published densities", FAMILY_RATE);
    let d = |factor: f32| factor * Shape::Diffuse.factor(reflected(0.9) as f32) / 4.0;
    let medium = waxy([color(0.9); 3], [d(1.0), d(0.2), d(0.1)]);
    let scene = slab(medium, 1.0, false);
    let exact = PathSettings { profile_paths: false, ..settings(Subsurface::Diffusion, Fit::Diffuse) };
    let published = PathSettings { support: SupportChoice::Published, ..exact.clone() };
    let [exact, published] = [exact, published].map(|settings| means(&scene, &settings, 64, 64)[0]);
    let known = reflected(0.9) * (0.25 * (-4.0_f64).exp() + 0.75 * (-4.0_f64 / 3.0).exp() - f64::from(TAIL));
    println!("exact {:.5} +- {:.5}, known {known:.5}", exact.mean(), exact.standard_error());
    println!("published {:.5} +- {:.5}", published.mean(), published.standard_error());
    family.z_test("exact", ZTest::new(exact, Moments::exact(known)));
    family.z_test("published", ZTest::new(published, Moments::known(0.9034 * known, 5.0e-4 * known)));
    ensure((published.mean() - known).abs() > 5.0 * published.standard_error(), || "no loss is seen".to_owned())?;
    println!("{}", family.verdict()?);
    Ok(())
}

/// A body whose mean free path no ray resolves is a Lambertian one of the medium's colour, each channel by itself; and so is one below
/// the setting.
fn narrow_media_are_lambertian() -> Result<(), Failed> {
    let mut family = Family::new("narrow media", FAMILY_RATE);
    let colors = [0.9, 0.5, 0.1];
    let at = |material| {
        let mesh = Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 5) };
        scene(vec![(material, mesh)], [3.0, -0.4, 2.0], [0.0, 0.1, 0.0], 0.2)
    };
    let hybrid = settings(Subsurface::Hybrid, Fit::Diffuse);
    let below = PathSettings { lambert_below: 1000.0, ..hybrid.clone() };
    let lambert = means(&at(Material::diffuse("Lambert", colors)), &hybrid, 32, draws(64));
    for (name, mean_free_path, settings, channels) in [
        ("all", [1.0e-9; 3], &hybrid, 0..3),
        ("blue", [0.3, 0.1, 1.0e-9], &hybrid, 2..3),
        ("by the setting", [0.3, 0.1, 0.03], &below, 0..3),
    ] {
        let found = means(&at(waxy(colors, mean_free_path)), settings, 32, draws(64));
        for c in channels {
            println!(
                "{name}, {c}: {:.5}, {:.5} +- {:.5}",
                found[c].mean(),
                lambert[c].mean(),
                found[c].standard_error()
            );
            family.z_test(format!("{name} {c}"), ZTest::new(found[c], lambert[c]));
        }
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// What a ball one mean free path in diameter sends back and lets through is the walk's to 0.03 of what a white surface reflects.
fn balls_are_no_slabs() -> Result<(), Failed> {
    let ball = Mesh { normals: Vec::new(), ..Mesh::sphere(DVec3::ZERO, 1.0, 5) };
    let mut off = 0.0;
    for above in [true, false] {
        let scene = half_sky::body(gray(0.95, 2.0), ball.clone(), above);
        let of = |subsurface| mean(&scene, &settings(subsurface, Fit::Diffuse), 32, draws(64));
        let (walk, hybrid) = (of(Subsurface::Walk), of(Subsurface::Hybrid));
        let shown = half_sky::covered(&scene)?;
        println!("{:.4} by the walk, {:+.4} by the hybrid", walk.mean() / shown, (hybrid.mean() - walk.mean()) / shown);
        ensure(walk.standard_error() < bound(0.004) * shown, || "too few samples".to_owned())?;
        off += (hybrid.mean() - walk.mean()).abs() / shown;
    }
    ensure(off < 0.03, || format!("off by {off:.4}"))
}

/// A border closed by a colour reflects what passes it twice, once in and once out, whichever lobe lets it through; metal stays as bright.
fn closed_borders_pass_light_twice() -> Result<(), Failed> {
    use restir_shared::bsdf::{Material as Border, Scattering};
    let (tint, color) = (Vec3::new(0.9, 0.5, 0.25), Vec3::new(0.8, 0.4, 1.0));
    let plain = Border { ior: 1.5, ..Border::diffuse(tint) };
    for (border, expected) in [
        (Border { transmission: 1.0, ..plain }, tint * tint * color),
        (Border { diffuse_transmission: 1.0, diffuse_transmission_color: tint, ..plain }, tint * tint * color),
        (plain, tint),
        (Border { metallic: 1.0, transmission: 1.0, ..plain }, tint),
        (Border { transmission: 0.5, ..plain }, tint * 0.5 + tint * tint * color * 0.25),
    ] {
        let found = border.closed(color);
        ensure(found.features() == 0, || format!("{found:?} asks for features that the scene may lack"))?;
        ensure((found.base_color - expected).abs().max_element() < 1.0e-6, || format!("{found:?}, not {expected}"))?;
    }
    Ok(())
}

/// A path enters one body, and meets a second one as a Lambertian surface of its colour: on a floor of wax below a block of wax, the hybrid is off from the walk by
/// less than a fifth of what it would be if the block was black.
fn later_bodies_have_their_colour() -> Result<(), Failed> {
    let wax = waxy([0.9, 0.7, 0.5], [0.01; 3]);
    let floor = Mesh::cuboid(DVec3::new(-4.0, -1.0, -4.0), DVec3::new(4.0, 0.0, 4.0));
    let block = Mesh::cuboid(DVec3::new(-1.0, 0.25, -1.0), DVec3::new(1.0, 2.0, 1.0));
    let below = |material| {
        let bodies = vec![(wax.clone(), floor.clone()), (material, block.clone())];
        scene(bodies, [4.0, 0.6, 0.0], [0.0, -0.3, 0.0], 0.0)
    };
    let of = |scene: &SceneBuffers, subsurface| {
        means(scene, &PathSettings { max_depth: 6, ..settings(subsurface, Fit::Diffuse) }, 32, draws(64))
    };
    let (waxen, black) = (below(wax.clone()), below(Material::diffuse("black", [0.0; 3])));
    let [walk, hybrid, dark] = [(&waxen, Subsurface::Walk), (&waxen, Subsurface::Hybrid), (&black, Subsurface::Hybrid)]
        .map(|(scene, subsurface)| of(scene, subsurface));
    for c in ALL {
        let off = |other: &[Moments; 3]| other[c].mean() / walk[c].mean() - 1.0;
        println!("{c}: {:+.4}, with a black block {:+.4}", off(&hybrid), off(&dark));
        ensure(off(&hybrid).abs() < 0.2 * off(&dark).abs(), || format!("{c}: {:+.4}", off(&hybrid)))?;
    }
    Ok(())
}

/// Light that comes to a surface from inside, and is not absorbed, leaves: over all directions it is as much as came.
fn exits_lose_nothing() -> Result<(), Failed> {
    for ior in [1.0, 1.1, 1.33, 1.4, 1.5, 2.0, 2.5] {
        let glass = restir_shared::bsdf::Material {
            ior,
            transmission: 1.0,
            ..restir_shared::bsdf::Material::diffuse(Vec3::ONE)
        };
        let exit = Exit::new(&glass, FEATURES_ALL);
        let cell = |i: u32| ((f64::from(i) + 0.5) / 4096.0 * f64::from(u32::MAX)) as u32;
        let weight = |i| f64::from(exit.sample(UVec4::new(cell(i), 0, 0, 0)).weight.x);
        let both = |i| {
            let sample = exit.sample(UVec4::new(cell(i), 7 << 24, 0, 0));
            let (value, pdf) = (exit.evaluate(sample.direction).value.x, sample.pdf);
            let words = exit.invert(sample.lobe, sample.direction, UVec4::ZERO);
            (f64::from(value / pdf - sample.weight.x).abs())
                .max((f64::from(words.x) - f64::from(cell(i))).abs() / 4.0e9)
        };
        let mean = (0..4096).map(weight).sum::<f64>() / 4096.0;
        let worst = (16..4080).map(both).fold(0.0, f64::max);
        println!("index {ior}: {mean:.5}, values and inverses to {worst:.1e}");
        // the mean reflectance is a fit, to 7e-4
        ensure((mean - 1.0).abs() < 1.0e-3 && worst < 1.0e-4, || format!("index {ior}: {mean}, {worst}"))?;
    }
    Ok(())
}

/// White half spaces below a dielectric, in a white room: what does not enter is reflected, and what enters comes back.
fn glass_bodies_keep_energy() -> Result<(), Failed> {
    let alone = settings(Subsurface::Diffusion, Fit::Diffuse);
    for (roughness, least, most) in [(0.0, 0.995, 1.003), (0.3, 0.97, 1.003)] {
        let white =
            Material { diffuse_transmission: 0.0, transmission: 1.0, ior: 1.4, roughness, ..waxy([1.0; 3], [0.05; 3]) };
        let mesh = Mesh::cuboid(DVec3::new(-150.0, -60.0, -150.0), DVec3::new(150.0, 0.0, 150.0));
        let scene = scene(vec![(white, mesh)], [0.0, 6.0, 0.0], [0.3, 0.0, 0.1], 1.0);
        let found = mean(&scene, &alone, 64, 64);
        println!("roughness {roughness}: {:.5} +- {:.5}", found.mean(), found.standard_error());
        let inside = found.mean() > least && found.mean() < most;
        ensure(inside && found.standard_error() < 1.3e-3, || format!("roughness {roughness}: {}", found.mean()))?;
    }
    Ok(())
}

/// Behind a pane that changes nothing a body looks as without, two segments later.
fn bodies_are_seen_through_panes() -> Result<(), Failed> {
    let mut family = Family::new("panes", FAMILY_RATE);
    let pane = Material { transmission: 1.0, roughness: 0.0, ior: 1.0, ..Material::diffuse("pane", [1.0; 3]) };
    let wall = Mesh::cuboid(DVec3::new(2.0, -4.0, -4.0), DVec3::new(2.01, 4.0, 4.0));
    // camera, two sides of the pane, the body, two sides again
    let settings = PathSettings { max_depth: 7, ..settings(Subsurface::Hybrid, Fit::Diffuse) };
    let [with, without] = [vec![(pane, wall)], Vec::new()].map(|others| means(&cube(others), &settings, 64, draws(64)));
    for c in ALL {
        println!("{c}: {:.5}, {:.5} +- {:.5}", with[c].mean(), without[c].mean(), with[c].standard_error());
        family.z_test(format!("{c}"), ZTest::new(with[c], without[c]));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// A scene behind a pointer that cannot be probed, and one that can.
fn scenes_without_objects_are_refused() -> Result<(), Failed> {
    let buffers = cube(Vec::new());
    let render = Render { count: 2, ..Render::new([8, 8], settings(Subsurface::Hybrid, Fit::Diffuse)) };
    let view = buffers.view();
    let refused = native::film_over(&view, native::plan(&buffers, &render)).err().map(|error| error.to_string());
    ensure(refused.as_ref().is_some_and(|text| text.contains("path_profile") && text.contains("Probe")), || {
        format!("{refused:?}")
    })?;
    let (own, over) =
        (native::film(native::plan(&buffers, &render))?, native::film_probed(&view, native::plan(&buffers, &render))?);
    ensure(own == over, || "the scene over a pointer looks otherwise".to_owned())?;
    // nothing is probed where no body counts
    let settings = PathSettings { parts: Parts::Rest, ..settings(Subsurface::Hybrid, Fit::Diffuse) };
    let render = Render { count: 2, ..Render::new([8, 8], settings) };
    native::film_over(&view, native::plan(&buffers, &render))?;
    Ok(())
}
