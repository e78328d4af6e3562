//! The feature set of a scene decides what runs: the code of its module, its buffers, and no bit of its image.

use libtest_mimic::Failed;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, Flavour};
use restir_host::plan::Pass;
use restir_host::render::Render;
use restir_host::scene::{
    AlphaMode, Environment, Filter, Light, LightKind, Material, Mesh, Scene, Texels, Texture, TextureUse, UvSet,
    Volume, Wrap, builtin,
};
use restir_host::settings::Choice as _;
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_host::technique::{configure, named};
use restir_shared::layout::{
    ALIAS_WORDS, ENVIRONMENT_PART, ENVIRONMENT_WORDS, FEATURE_ALPHA, FEATURE_BLEND, FEATURE_CLEAR,
    FEATURE_CLEAR_BORDER, FEATURE_DELTA, FEATURE_DIFFUSE_TRANSMISSION, FEATURE_EMISSIVE, FEATURE_ENVIRONMENT,
    FEATURE_FINE_TEXELS, FEATURE_GLOSSY, FEATURE_LIGHT_TABLE, FEATURE_MULTISCATTER, FEATURE_PUNCTUAL,
    FEATURE_SECOND_UVS, FEATURE_SHADING, FEATURE_SPECULAR, FEATURE_SUBSURFACE, FEATURE_TEXTURES, FEATURE_TRANSMISSION,
    FEATURE_VOLUME, FEATURES_ALL, FEATURES_DIFFUSE, INTERIOR_WORDS, LIGHT_WORDS, MATERIAL_WORDS, NODE_WORDS, NONE,
    PUNCTUAL_WORDS, SECOND_UV_WORDS, SHADING_WORDS, TEXTURE_SLOTS, TEXTURE_USE_WORDS, TRIANGLE_WORDS,
};
use restir_tests::checks;
use restir_tests::device::{self, Adapter};
use restir_tests::features::{Content, PARTS, has_optimiser, names, operations, specialised, with_markers};
use restir_tests::native::plan;
use restir_tests::suite::{Trial, ensure};
use std::collections::BTreeSet;
use std::sync::Arc;

pub(crate) fn trials() -> Vec<Trial> {
    let mut tests = checks! {
        later {
            scenes_have_their_features absent_parts_are_not_allocated a_feature_in_use_cannot_be_dropped
        }
    };
    tests.extend(builtin::NAMES.iter().map(|&(name, _)| {
        Trial::test(format!("{name}: frozen is general"), move || {
            same_bits(&mut CpuExecutor::new()?, &Scene::load(name)?)
        })
    }));
    tests.extend(VARIANTS.iter().map(|variant| {
        Trial::test(format!("cornell, {}: frozen is general", variant.name), || {
            same_bits(&mut CpuExecutor::new()?, &variant.scene())
        })
    }));
    tests.extend(module_trials());
    tests.extend(device::trials(on));
    tests
}

/// The tests that need spirv-opt: without it they are ignored, visibly, or fail if they are required.
fn module_trials() -> Vec<Trial> {
    if !has_optimiser() {
        let trial = Trial::test("modules: no spirv-opt; install SPIRV-Tools", || Err("there is no spirv-opt".into()));
        return vec![trial.with_ignored_flag(!device::required())];
    }
    vec![
        Trial::test("the_general_module_has_every_marker", general),
        Trial::test("markers_follow_the_features", follow),
        Trial::test("spread_samples_cost_few_operations", spread),
    ]
}

fn on(adapter: &Adapter) -> Vec<Trial> {
    let scene = |variant: &'static Variant| {
        adapter.trial(&format!("cornell, {}: frozen is general", variant.name), |gpu| same_bits(gpu, &variant.scene()))
    };
    let mut tests: Vec<Trial> = VARIANTS.iter().map(scene).collect();
    tests.push(adapter.trial("cornell-mixed: frozen is general", |gpu| same_bits(gpu, &Scene::load("cornell-mixed")?)));
    tests
}

/// A change to the white material, the meshes or the lights of `cornell`.
struct Variant {
    name: &'static str,
    features: u32,
    edit: fn(&mut Scene),
}

impl Variant {
    fn scene(&self) -> Scene {
        let mut scene = builtin::scene("cornell").expect("built in");
        (self.edit)(&mut scene);
        scene
    }
}

const fn variant(name: &'static str, features: u32, edit: fn(&mut Scene)) -> Variant {
    Variant { name, features, edit }
}

const VARIANTS: [Variant; 18] = [
    variant("diffuse", FEATURE_EMISSIVE, |_| {}),
    variant("two powers", FEATURES_DIFFUSE, |scene| scene.materials[1].emission = [0.1, 0.2, 0.3]),
    variant("glossy", FEATURE_EMISSIVE | FEATURE_GLOSSY | FEATURE_MULTISCATTER, |scene| {
        white(scene, |m| (m.metallic, m.roughness) = (1.0, 0.3));
    }),
    variant("coat", FEATURE_EMISSIVE | FEATURE_GLOSSY | FEATURE_MULTISCATTER | FEATURE_SPECULAR, |scene| {
        white(scene, |m| (m.ior, m.roughness, m.specular) = (1.5, 0.4, 0.5));
    }),
    variant("coat with textures", COAT_TEXTURED, |scene| {
        textured(scene);
        scene.textures[0].texels = [[255, 200, 90, 40], [30, 60, 90, 200]].into();
        white(scene, |m| (m.ior, m.roughness, m.base_color_texture) = (1.5, 0.4, None));
        white(scene, |m| (m.specular_texture, m.specular_color_texture) = ([Some(TextureUse::new(0)); 2]).into());
    }),
    variant("delta", FEATURE_EMISSIVE | FEATURE_DELTA, |scene| {
        white(scene, |m| (m.metallic, m.roughness) = (1.0, 0.0));
    }),
    variant("glass", FEATURE_EMISSIVE | FEATURE_DELTA | FEATURE_TRANSMISSION | FEATURE_CLEAR, |scene| {
        white(scene, |m| (m.ior, m.transmission, m.roughness) = (1.5, 1.0, 0.0));
    }),
    variant("diffuse transmission", FEATURE_EMISSIVE | FEATURE_DIFFUSE_TRANSMISSION, |scene| {
        white(scene, |m| m.diffuse_transmission = 0.5);
    }),
    variant("interior", FEATURE_EMISSIVE | FEATURE_DIFFUSE_TRANSMISSION | FEATURE_VOLUME, |scene| {
        let volume = Volume::absorbing([0.9, 0.5, 0.2], 1.0);
        white(scene, |m| (m.diffuse_transmission, m.volume) = (0.5, Some(volume)));
    }),
    variant("scattering body", SCATTERING, |scene| {
        let volume = Some(Volume::scattering([0.9, 0.8, 0.6], [0.3, 0.2, 0.1], 0.3));
        let wax = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse("wax", [1.0; 3]) };
        let material = scene.add_material(wax);
        scene.add_mesh("wax", material, Mesh::cuboid(glam::DVec3::splat(-0.3), glam::DVec3::splat(0.2)));
    }),
    variant("normals", FEATURE_EMISSIVE | FEATURE_SHADING, |scene| {
        let mesh = Arc::make_mut(&mut scene.meshes[0]);
        mesh.normals = vec![[0.28, 0.96, 0.0]; mesh.positions.len()];
    }),
    variant("textures", FEATURE_EMISSIVE | FEATURE_SHADING | FEATURE_TEXTURES, textured),
    variant("second texture coordinates", SECOND_UVS, |scene| {
        textured(scene);
        white(scene, |m| m.base_color_texture.iter_mut().for_each(|used| used.uv_set = UvSet::Second));
        for mesh in scene.meshes.iter_mut().map(Arc::make_mut) {
            mesh.second_uvs = mesh.positions.iter().map(|p| [1.3 * p[1], p[0] - p[2]]).collect();
        }
    }),
    variant("texels of sixteen bits", FINE_TEXELS, |scene| {
        textured(scene);
        scene.textures[0].texels = Texels::new(vec![[65_001, 51_234, 23_456, 65_535], [7_777, 15_432, 23_123, 50_000]]);
    }),
    variant("mask", ALPHA_TEXTURED, |scene| partial(scene, AlphaMode::Mask { cutoff: 0.5 })),
    variant("blended", ALPHA_TEXTURED | FEATURE_BLEND, |scene| partial(scene, AlphaMode::Blend)),
    variant("environment", FEATURES_DIFFUSE | FEATURE_ENVIRONMENT, |scene| {
        let pixels = (0..32).map(|i| [0.1, 0.01 * i as f32, 0.3]).collect();
        let name = "test".to_owned();
        scene.environment = Some(Environment { name, size: [8, 4], pixels, scale: 1.0, rotation: 30.0 });
    }),
    variant("point light", FEATURES_DIFFUSE | FEATURE_PUNCTUAL, |scene| {
        let kind = LightKind::Point { position: glam::DVec3::new(0.1, 0.2, 0.3) };
        scene.lights.push(Light { name: "test".to_owned(), intensity: [0.5, 0.4, 0.3], kind });
    }),
];

const COAT_TEXTURED: u32 =
    FEATURE_EMISSIVE | FEATURE_SHADING | FEATURE_TEXTURES | FEATURE_GLOSSY | FEATURE_MULTISCATTER | FEATURE_SPECULAR;
const SCATTERING: u32 = FEATURE_EMISSIVE | FEATURE_DIFFUSE_TRANSMISSION | FEATURE_VOLUME | FEATURE_SUBSURFACE;
const SECOND_UVS: u32 = FEATURE_EMISSIVE | FEATURE_SHADING | FEATURE_TEXTURES | FEATURE_SECOND_UVS;
const FINE_TEXELS: u32 = FEATURE_EMISSIVE | FEATURE_SHADING | FEATURE_TEXTURES | FEATURE_FINE_TEXELS;
const ALPHA_TEXTURED: u32 = FEATURE_EMISSIVE | FEATURE_SHADING | FEATURE_TEXTURES | FEATURE_ALPHA;

/// As [`textured`], with an alpha.
fn partial(scene: &mut Scene, alpha_mode: AlphaMode) {
    textured(scene);
    scene.textures[0].texels = [[255, 200, 90, 40], [30, 60, 90, 200]].into();
    white(scene, |m| m.alpha_mode = alpha_mode);
}

fn white(scene: &mut Scene, edit: impl Fn(&mut Material)) {
    edit(&mut scene.materials[0]);
}

fn textured(scene: &mut Scene) {
    let texels = [[255, 200, 90, 255], [30, 60, 90, 255]].into();
    let texture =
        Texture { name: "test".to_owned(), size: [2, 1], texels, wrap: [Wrap::Repeat; 2], filter: Filter::Linear };
    scene.textures.push(texture);
    white(scene, |m| m.base_color_texture = Some(TextureUse::new(0)));
    for mesh in scene.meshes.iter_mut().map(Arc::make_mut) {
        mesh.uvs = mesh.positions.iter().map(|p| [p[0], p[2]]).collect();
    }
}

fn scenes_have_their_features() -> Result<(), Failed> {
    for variant in &VARIANTS {
        let features = SceneBuffers::build(&variant.scene())?.features;
        ensure(features == variant.features, || format!("{} has {}", variant.name, names(features)))?;
    }
    let seen = VARIANTS.iter().fold(0, |seen, variant| seen | variant.features);
    let unseen: Vec<&str> = PARTS.iter().filter(|part| part.feature & seen == 0).map(|part| part.name).collect();
    ensure(unseen.is_empty(), || format!("no scene has {unseen:?}"))
}

fn marked(features: u32) -> Result<u32, Failed> {
    Ok(Content::of(&specialised(Flavour::Exact, features)?)?.marked())
}

/// Without this the test below would show nothing.
fn general() -> Result<(), Failed> {
    let marked = marked(FEATURES_ALL)?;
    ensure(marked == with_markers(), || format!("it only has those of {}", names(marked)))
}

/// A module has the markers of its features and no other, where one feature stands alone.
fn follow() -> Result<(), Failed> {
    // a coat has its factors where there is a lobe that they scale, and texels belong to textures
    let beside = |feature: u32| match feature {
        FEATURE_SPECULAR => FEATURE_GLOSSY,
        FEATURE_SECOND_UVS | FEATURE_FINE_TEXELS => FEATURE_TEXTURES,
        _ => 0,
    };
    let alone = PARTS.iter().map(|part| FEATURES_DIFFUSE | part.feature | beside(part.feature));
    for features in alone {
        let marked = marked(features)?;
        ensure(marked == features & with_markers(), || {
            format!("with {} it is marked {}", names(features), names(marked))
        })?;
    }
    Ok(())
}

/// Scenes and techniques whose kernels are counted: of one material alone, of several, and with light inside of bodies.
const COUNTED: [(&str, &str); 4] =
    [("cornell", "path"), ("cornell-mixed", "restir-di"), ("cornell-mixed", "restir-pt"), ("candles", "path")];

/// Frozen to a scene and to the settings by default, no kernel has more than a twentieth more operations than with independent samples.
fn spread() -> Result<(), Failed> {
    let mut counted = 0;
    for (name, technique) in COUNTED {
        let scene = SceneBuffers::build(&Scene::load(name)?)?;
        let [spread, independent] = ["sampler=sobol", "sampler=independent"].map(|s| passes(&scene, technique, s));
        let mut seen = BTreeSet::new();
        for (spread, independent) in spread?.iter().zip(&independent?) {
            let differs = spread.constants != independent.constants;
            if differs && seen.insert((spread.kernel.name, spread.constants.clone())) {
                let [more, few] = [operations(spread)?, operations(independent)?];
                let growth = 100.0 * (more as f64 / few as f64 - 1.0);
                let line = format!("{name}, {technique}, {}: {few} operations, {growth:.2} % more", spread.kernel.name);
                println!("{line}");
                ensure(more * 20 <= few * 21, || line)?;
                counted += usize::from(more > few);
            }
        }
    }
    ensure(counted > COUNTED.len(), || {
        format!("only {counted} kernels differ by their samples: what is counted is not what is frozen")
    })
}

/// The passes of two frames.
fn passes(scene: &SceneBuffers, technique: &str, sampler: &str) -> Result<Vec<Pass>, Error> {
    let mut technique = named(technique)?;
    configure(&mut *technique, &[sampler])?;
    let render = Render { count: 2, ..Render::new([8, 6], technique) };
    plan(scene, &render).passes.collect()
}

fn settings(subsurface: Subsurface) -> Render {
    let path = PathSettings { max_depth: 6, jitter: true, subsurface, ..PathSettings::default() };
    Render { count: 2, seed: 5, ..Render::new([16, 12], path) }
}

fn image(executor: &mut dyn Executor, scene: &SceneBuffers, subsurface: Subsurface) -> Result<Vec<[u32; 3]>, Error> {
    let rendered = settings(subsurface).render(scene, executor)?;
    Ok(rendered.image.pixels.iter().map(|rgb| rgb.map(f32::to_bits)).collect())
}

/// The scene as a kernel sees it that is specialised to other features.
fn with_features(mut scene: SceneBuffers, features: u32) -> SceneBuffers {
    scene.features = features;
    scene
}

fn same_bits(executor: &mut dyn Executor, scene: &Scene) -> Result<(), Failed> {
    let scene = SceneBuffers::build(scene)?;
    // profiles have kernels of their own
    let scatters = scene.features & FEATURE_SUBSURFACE != 0;
    for subsurface in [Subsurface::Walk].into_iter().chain(scatters.then_some(Subsurface::Hybrid)) {
        let frozen = image(executor, &scene, subsurface)?;
        ensure(frozen.iter().any(|rgb| *rgb != [0; 3]), || "the image is black".to_owned())?;
        // clear borders choose another kernel, which follows light from collisions in rounds: no part of one that could be left out
        let chosen = FEATURE_CLEAR_BORDER & !scene.features;
        let general = image(executor, &with_features(scene.clone(), FEATURES_ALL & !chosen), subsurface)?;
        ensure(frozen == general, || format!("{}: the general kernel gives another image", subsurface.name()))?;
    }
    Ok(())
}

/// The comparison above sees code that is missing: an image changes with every feature that its scene loses.
fn a_feature_in_use_cannot_be_dropped() -> Result<(), Failed> {
    let cpu = &mut CpuExecutor::new()?;
    for variant in &VARIANTS {
        let scene = SceneBuffers::build(&variant.scene())?;
        let own = image(cpu, &scene, Subsurface::Walk)?;
        let parts = PARTS.iter().map(|part| (part.feature, part.name)).chain([(FEATURE_SUBSURFACE, "subsurface")]);
        // what scatters absorbs by its extinction
        let idle = if variant.features & FEATURE_SUBSURFACE != 0 { FEATURE_VOLUME } else { 0 };
        for (feature, name) in parts.filter(|(feature, _)| feature & variant.features & !idle != 0) {
            let without = image(cpu, &with_features(scene.clone(), scene.features & !feature), Subsurface::Walk)?;
            ensure(without != own, || format!("{}: {name} changes nothing", variant.name))?;
        }
    }
    Ok(())
}

/// The arenas that a plan allocates have what the features name and nothing else.
fn absent_parts_are_not_allocated() -> Result<(), Failed> {
    for variant in &VARIANTS {
        let source = variant.scene();
        let scene = SceneBuffers::build(&source)?;
        let render = settings(Subsurface::Walk);
        // in the layout's words of 16 bytes
        let found: Vec<u32> = plan(&scene, &render).buffers[..3].iter().map(|b| b.words as u32 / 4).collect();
        let (header, stats) = (scene.header, scene.stats());
        let only_with = |feature: u32, words: u32| if variant.features & feature == 0 { 0 } else { words };
        let triangles = header.triangle_count;
        let geometry = stats.nodes as u32 * NODE_WORDS
            + triangles * TRIANGLE_WORDS
            + only_with(FEATURE_SHADING, triangles * SHADING_WORDS)
            + only_with(FEATURE_SECOND_UVS, triangles * SECOND_UV_WORDS);
        let attributes = source.materials.len() as u32 * MATERIAL_WORDS
            + header.light_count * LIGHT_WORDS
            + only_with(FEATURE_TEXTURES, TEXTURE_SLOTS * TEXTURE_USE_WORDS)
            + only_with(FEATURE_PUNCTUAL, PUNCTUAL_WORDS)
            + only_with(FEATURE_SUBSURFACE, INTERIOR_WORDS)
            + only_with(FEATURE_ENVIRONMENT, ENVIRONMENT_WORDS)
            + only_with(FEATURE_LIGHT_TABLE, header.light_count * ALIAS_WORDS);
        // the sRGB table and the one word of the texture; pixels, rows and parts of the map of 8 x 4 pixels, three times as fine; else a
        // word that is never read
        let parts = 12_u32.div_ceil(ENVIRONMENT_PART) + 12 * 24_u32.div_ceil(ENVIRONMENT_PART);
        let map = 24 * 12 + 12 + parts.div_ceil(4);
        let texels = only_with(FEATURE_TEXTURES, 256 + 1) + only_with(FEATURE_ENVIRONMENT, map);
        let expected = [geometry, attributes, texels.max(1)];
        ensure(found == expected, || format!("{}: {found:?} words instead of {expected:?}", variant.name))?;
        for (base, feature) in [
            (header.shading_base, FEATURE_SHADING),
            (header.second_uv_base, FEATURE_SECOND_UVS),
            (header.environment_base, FEATURE_ENVIRONMENT),
            (header.alias_base, FEATURE_LIGHT_TABLE),
        ] {
            let present = variant.features & feature != 0;
            ensure((base != NONE) == present, || format!("{}: {} begins at {base}", variant.name, names(feature)))?;
        }
    }
    Ok(())
}
