//! Scenes far from the origin look as they do near it: files under a parent node that moves them.

use glam::{DVec3, Vec3};
use libtest_mimic::Failed;
use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{Attachment, Interpolation, Node, Part, Property, Rig, Track};
use restir_host::scene::{Camera, Environment, Light, LightKind, Material, Mesh, Scene, builtin, export};
use restir_host::session::{CpuSession, History, SceneChange, Setup, View};
use restir_host::technique::Technique as _;
use restir_host::technique::path::PathSettings;
use restir_host::technique::restir_di::DiSettings;
use restir_tests::gltf_motion::imported;
use restir_tests::stats::{FAMILY_RATE, Family, Moments, ZTest};
use restir_tests::suite::Trial;
use serde_json::{Value, json};

/// With nodes, skins, morph targets, lights of all kinds, glass, masks, and bodies that scatter.
/// Beside their names the samples a pixel: more where a rounding changes what follows of a path.
const SCENES: [(&str, u32); 9] = [
    ("cornell", 32),
    ("cornell-mitsuba", 32),
    ("cornell-mixed", 32),
    ("ajar", 64),
    ("glass", 32),
    ("moving", 64),
    ("toys", 32),
    ("foliage", 256),
    ("candles", 256),
];
/// A direction along no axis.
const SKEW: DVec3 = DVec3::new(0.8, -0.5, 0.3);
const DISTANCES: [f64; 8] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7];
/// From here on the scenes, which have sizes of 2 to 18, are far.
const LEAST: f64 = 1e3;
/// Multiples of powers of two that are larger than the scenes.
const EXACT: DVec3 = DVec3::new(1_048_576.0, -524_288.0, 262_144.0);
const SIZE: [u32; 2] = [48, 36];
/// Of pictures of which little noise is asked.
const SAMPLES: u32 = 128;
/// What moves changes pixels by as much of the mean, on average.
const MOVED: f64 = 1.0e-2;
/// What roundings of positions change of a mean, relative to it.
const ROUNDING: f64 = 1.0e-4;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("a scene that is not moved is seen", a_scene_that_is_not_moved_is_seen),
        Trial::test("a white sphere stays white", a_white_sphere_stays_white),
        Trial::test("what moves stays in its place", what_moves_stays_in_its_place),
        Trial::test("the digits of a file count", the_digits_of_a_file_count),
        Trial::test("positions are those of the world", positions_are_those_of_the_world),
        Trial::test("a session stays in its coordinates", a_session_stays_in_its_coordinates),
        Trial::test("vertices that are far out are warned of", vertices_that_are_far_out_are_warned_of),
        Trial::test("an export is where the scene was", an_export_is_where_the_scene_was),
    ];
    for (name, samples) in SCENES {
        trials.push(Trial::test(format!("moved/{name}"), move || looks_as_it_did(name, samples)));
    }
    trials
}

/// A file, whose environment glTF has no name for.
struct File {
    bytes: Vec<u8>,
    environment: Option<Environment>,
}

impl File {
    fn of(scene: &Scene) -> Result<Self, Failed> {
        Ok(Self { bytes: export::glb(scene)?, environment: scene.environment.clone() })
    }

    fn built_in(name: &str) -> Result<Self, Failed> {
        Self::of(&builtin::scene(name).ok_or("no such scene")?)
    }

    /// The scene with all of its nodes under one that moves them.
    fn moved(&self, by: DVec3) -> Result<Scene, Failed> {
        let (mut document, rest) = split(&self.bytes)?;
        for camera in document["cameras"].as_array_mut().into_iter().flatten() {
            // an exact camera would stay behind, and not fit its node any more
            camera.as_object_mut().ok_or("a camera")?.remove("extras");
        }
        let children = document["scenes"][0]["nodes"].take();
        let nodes = document["nodes"].as_array_mut().ok_or("no nodes")?;
        nodes.push(json!({ "name": "parent", "translation": by.to_array(), "children": children }));
        document["scenes"][0]["nodes"] = json!([nodes.len() - 1]);
        let scene = imported("moved", &joined(&document, rest))?;
        Ok(Scene { environment: self.environment.clone(), ..scene })
    }
}

/// The document of a binary file, and its other chunks.
fn split(file: &[u8]) -> Result<(Value, &[u8]), Failed> {
    let length = u32::from_le_bytes(file[12..16].try_into()?) as usize;
    Ok((serde_json::from_slice(&file[20..20 + length])?, &file[20 + length..]))
}

fn joined(document: &Value, rest: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((20 + text.len() as u32 + rest.len() as u32).to_le_bytes());
    file.extend((text.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    [file, text, rest.to_vec()].concat()
}

fn picture(scene: &Scene, count: u32) -> Result<Image, Failed> {
    let settings = PathSettings { max_depth: 6, ..PathSettings::default() };
    let render = Render { count, ..Render::new(SIZE, settings) };
    Ok(render.render(&SceneBuffers::build(scene)?, &mut CpuExecutor::new()?)?.image)
}

fn brightness(pixel: &[f32; 3]) -> f64 {
    pixel.iter().copied().map(f64::from).sum()
}

fn mean(image: &Image) -> f64 {
    image.pixels.iter().map(brightness).sum::<f64>() / image.pixels.len() as f64
}

/// Two pictures by the same random numbers, pixel by pixel: most differ by roundings alone, and some in which a ray passes an edge on
/// the other side. `allowed` of the mean may be what roundings make.
fn compared(picture: &Image, other: &Image, allowed: f64) -> ZTest {
    let differences = picture.pixels.iter().zip(&other.pixels).map(|(a, b)| brightness(a) - brightness(b));
    let moments: Moments = differences.collect();
    let allowed = allowed * mean(other);
    let beyond = moments.mean() - moments.mean().clamp(-allowed, allowed);
    ZTest::new(moments.shifted(beyond - moments.mean()), Moments::exact(0.0))
}

fn looks_as_it_did(name: &str, samples: u32) -> Result<(), Failed> {
    let file = File::built_in(name)?;
    let near = file.moved(DVec3::ZERO)?;
    let right = picture(&near, samples)?;
    let mut family = Family::new(format!("{name} far from the origin"), FAMILY_RATE);
    for distance in DISTANCES {
        let far = file.moved(SKEW * distance)?;
        assert!(far.origin != DVec3::ZERO || distance < LEAST, "at {distance:e} the origin is {}", far.origin);
        let test = compared(&picture(&far, samples)?, &right, ROUNDING);
        println!(
            "{name} at {distance:e}: {:+.1e} beyond roundings, {:.1e} would be noticed",
            test.difference / mean(&right),
            test.detectable_bias(FAMILY_RATE) / mean(&right)
        );
        family.z_test(format!("{distance:e}"), test);
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// The room of a built-in scene, moved without its origin, as all scenes once were.
fn a_scene_that_is_not_moved_is_seen() -> Result<(), Failed> {
    let near = File::built_in("cornell")?.moved(DVec3::ZERO)?;
    let right = picture(&near, SAMPLES)?;
    for distance in [1e2, 1e3, 1e4, 1e5, 1e6, 1e7] {
        let mut far = near.clone();
        far.instances.iter_mut().for_each(|instance| instance.transform.translation += SKEW * distance);
        far.camera = far.camera.map(|camera| camera.moved(SKEW * distance));
        let picture = picture(&far, SAMPLES)?;
        let test = compared(&picture, &right, ROUNDING);
        let gain = mean(&picture) / mean(&right) - 1.0;
        println!("at {distance:e}: {gain:+.2e} of the light, p = {:.1e}", test.p);
        assert!(distance < 1e6 || test.p < FAMILY_RATE, "nobody sees a gain of {gain}");
        far.move_to_origin();
        let test = compared(&self::picture(&far, SAMPLES)?, &right, ROUNDING);
        assert!(test.p > FAMILY_RATE, "moved near the origin it differs by {}", test.difference);
    }
    Ok(())
}

/// A white sphere of two units before a camera, under a sky of one.
fn sphere(centre: DVec3) -> Scene {
    let sky =
        Environment { name: "white".to_owned(), size: [2, 1], pixels: [[1.0; 3]; 2].into(), scale: 1.0, rotation: 0.0 };
    let mut scene = Scene { environment: Some(sky), ..Scene::default() };
    let white = scene.add_material(Material { specular: 0.0, ..Material::diffuse("white", [1.0; 3]) });
    scene.add_mesh("sphere", white, Mesh::sphere(centre, 1.0, 3));
    scene.camera = Some(Camera::pinhole(centre + DVec3::Z * 5.0, centre, DVec3::Y, 0.6911));
    scene
}

fn a_white_sphere_stays_white() -> Result<(), Failed> {
    let file = File::of(&sphere(DVec3::ZERO))?;
    let mut family = Family::new("white spheres", FAMILY_RATE);
    for distance in [0.0, 1e6, 6.4e6] {
        let scene = file.moved(DVec3::splat(distance))?;
        let image = picture(&scene, SAMPLES)?;
        let white = Image { pixels: vec![[1.0; 3]; image.pixels.len()], ..image.clone() };
        let least = image.pixels.iter().map(|pixel| brightness(pixel) / 3.0).fold(f64::INFINITY, f64::min);
        println!("at {distance:e}: mean {:.5}, least {least:.3}", mean(&image) / 3.0);
        family.z_test(format!("{distance:e}"), compared(&image, &white, ROUNDING));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Skins, tracks and motions at another time.
fn what_moves_stays_in_its_place() -> Result<(), Failed> {
    let mut family = Family::new("what moves far from the origin", FAMILY_RATE);
    for name in ["toys", "moving"] {
        let file = File::built_in(name)?;
        let [near, far] = [file.moved(DVec3::ZERO)?, file.moved(SKEW * 1e6)?].map(|scene| scene.at(30.0));
        let [right, picture] = [picture(&near, SAMPLES)?, picture(&far, SAMPLES)?];
        let still = self::picture(&file.moved(DVec3::ZERO)?, SAMPLES)?;
        let pairs = still.pixels.iter().zip(&right.pixels);
        let moved = pairs.map(|(a, b)| (brightness(a) - brightness(b)).abs()).sum::<f64>() / still.pixels.len() as f64;
        assert!(moved > MOVED * mean(&still), "what moves changes {name} by {moved} alone");
        family.z_test(name, compared(&picture, &right, ROUNDING));
    }
    println!("{}", family.verdict()?);
    Ok(())
}

/// Nodes a millimetre apart at the radius of the earth, where single precision has steps of half a unit; one of them turns.
fn the_digits_of_a_file_count() -> Result<(), Failed> {
    let radius = 6_378_137.123_456;
    let mut scene = sphere(DVec3::ZERO);
    scene.instances.push(scene.instances[0]);
    scene.lights.push(Light {
        name: "lamp".to_owned(),
        intensity: [1.0; 3],
        kind: LightKind::Point { position: DVec3::Y },
    });
    scene.animation.rig = Rig {
        nodes: vec![Node::default()],
        tracks: vec![Track {
            node: 0,
            property: Property::Rotation,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0],
            values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0],
        }],
        attachments: vec![Attachment { node: 0, part: Part::Instance(1) }],
        ..Rig::default()
    };
    let (mut document, rest) = split(&export::glb(&scene)?).map(|(document, rest)| (document, rest.to_vec()))?;
    let step = 0.001;
    for (index, node) in document["nodes"].as_array_mut().ok_or("no nodes")?.iter_mut().enumerate() {
        let node = node.as_object_mut().ok_or("a node")?;
        node.remove("matrix");
        node.remove("extras");
        node.insert("translation".to_owned(), json!([radius + step * index as f64, 0.0, 0.0]));
    }
    for camera in document["cameras"].as_array_mut().into_iter().flatten() {
        camera.as_object_mut().ok_or("a camera")?.remove("extras");
    }
    let far = imported("digits", &joined(&document, &rest))?;
    assert!(!far.animation.is_still(), "nothing turns");
    let far = far.at(0.0);
    let LightKind::Point { position: lamp } = far.lights[0].kind else { return Err("a point light".into()) };
    let camera = far.camera.ok_or("no camera")?;
    let places =
        [far.instances[0].transform.translation, far.instances[1].transform.translation, lamp, camera.position];
    for (index, place) in places.iter().enumerate() {
        let expected = DVec3::X * (radius + step * index as f64) - far.origin;
        assert!((*place - expected).length() < 1e-8, "part {index} is at {place}, not at {expected}");
    }
    Ok(())
}

fn positions_are_those_of_the_world() -> Result<(), Failed> {
    let file = File::built_in("cornell")?;
    let position = |by: DVec3| -> Result<Vec<DVec3>, Failed> {
        let scene = SceneBuffers::build(&file.moved(by)?)?;
        let integral = PathSettings::default().integral();
        let camera = &|_| scene.camera;
        let shot = Shot { scene: &scene, frame: 0.0, camera, size: SIZE, seed: 0, integral, samples: 1 };
        let channels = shot.channels(&[Aov::Position, Aov::Depth])?;
        let values = |pixel: usize| Vec3::from_array([0, 1, 2].map(|axis| channels[axis].values[pixel])).as_dvec3();
        let hit = (0..channels[0].values.len()).filter(|&pixel| channels[3].values[pixel] < 1e9);
        Ok(hit.map(values).collect())
    };
    let (near, far) = (position(DVec3::ZERO)?, position(EXACT)?);
    assert!(near.len() == far.len() && !near.is_empty(), "{} and {} pixels see something", near.len(), far.len());
    // half a step of single precision at 2^20
    let off = near.iter().zip(&far).map(|(near, far)| (*far - EXACT - *near).abs().max_element()).fold(0.0, f64::max);
    assert!(off <= 0.0625, "a position is off by {off}");
    Ok(())
}

/// A scene that moves, and is edited, has the bits that it has near the origin if it stands on the grid of origins.
fn a_session_stays_in_its_coordinates() -> Result<(), Failed> {
    let file = File::built_in("cornell")?;
    let [near, mut far] = [file.moved(DVec3::ZERO)?, file.moved(EXACT)?];
    assert!(far.origin == EXACT, "its origin is {}", far.origin);
    let setup = |scene: &Scene| -> Result<Setup, Failed> {
        Ok(Setup::new(SceneBuffers::build_editable(scene)?, DiSettings::default(), SIZE))
    };
    let mut sessions =
        [CpuSession::new(setup(&near)?, CpuExecutor::new()?)?, CpuSession::new(setup(&far)?, CpuExecutor::new()?)?];
    let mut edited = [near, far.clone()];
    for frame in 0..3 {
        for (session, scene) in sessions.iter_mut().zip(&mut edited) {
            scene.instances[0].transform.translation.x += 0.125;
            let begun = session.frame(&View { scene: SceneChange::Edited(scene), ..View::default() })?;
            assert!(frame == 0 || begun.history == History::Kept, "frame {frame} lost its history");
        }
        let bits = sessions.each_ref().map(bytes);
        assert!(bits[0] == bits[1], "frame {frame} has other bits far from the origin");
    }
    far.origin = DVec3::ZERO;
    let begun = sessions[1].frame(&View { scene: SceneChange::Edited(&far), ..View::default() })?;
    assert!(begun.history == History::Lost("its origin"), "{:?}", begun.history);
    Ok(())
}

fn bytes(session: &CpuSession) -> Vec<[u32; 3]> {
    session.pixels().iter().map(|pixel| pixel.sum.map(f32::to_bits)).collect()
}

fn vertices_that_are_far_out_are_warned_of() -> Result<(), Failed> {
    for (distance, expected) in [(0.0, false), (1e3, false), (1e5, true), (6.4e6, true)] {
        let scene = imported("vertices", &export::glb(&sphere(DVec3::splat(distance)))?)?;
        let warnings: Vec<_> = scene.warnings.iter().filter(|warning| warning.contains("single precision")).collect();
        assert!(warnings.is_empty() != expected, "at {distance:e}: {warnings:?}");
        assert!(warnings.len() <= 1 && warnings.iter().all(|w| w.contains("mesh sphere")), "{warnings:?}");
        println!("at {distance:e}: {warnings:?}");
    }
    // a marker far away spoils the scene for what is small
    let mut scene = sphere(DVec3::ZERO);
    scene.add_mesh("marker", 0, Mesh::sphere(DVec3::ZERO, 1.0, 2));
    scene.instances[1].transform.translation.x = 1e6;
    scene.instances[0].transform.translation.x = -1e6;
    let scene = imported("marker", &export::glb(&scene)?)?;
    let warnings = scene.warnings.join("\n");
    assert!(warnings.contains("(and 1 more)") && warnings.contains("from the origin of the scene"), "{warnings}");
    Ok(())
}

fn an_export_is_where_the_scene_was() -> Result<(), Failed> {
    for name in ["cornell", "toys"] {
        let far = File::built_in(name)?.moved(EXACT)?;
        let back = imported("back", &export::glb(&far)?)?;
        assert!(back.origin == far.origin, "{name}: the origin is {}, not {}", back.origin, far.origin);
        let [a, b] = [SceneBuffers::build(&far)?, SceneBuffers::build(&back)?];
        assert!(a.geometry == b.geometry, "{name}: the geometry differs");
    }
    Ok(())
}
