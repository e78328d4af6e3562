//! glTF files in and out: generated ones with everything in them, built-in scenes, and files of other programs.

use libtest_mimic::Failed;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, GpuExecutor};
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{Mesh, Scene, builtin, export, gltf};
use restir_host::technique::path::{PathSettings, Subsurface};
use restir_tests::gltf_motion::imported as import;
use restir_tests::suite::Trial;
use restir_tests::{data, device, gltf_files};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// The generated file of a name.
fn embedded(wanted: &str) -> Result<Scene, Failed> {
    let files = gltf_files::textured();
    let (name, file) = files.iter().find(|(name, _)| *name == wanted).ok_or("no such file")?;
    import(name, file)
}

/// Exporting and importing a scene changes no bit of it, nor of its buffers.
fn comes_back(scene: &Scene) -> Result<(), Failed> {
    let back = import("back", &export::glb(scene)?)?;
    assert_eq!(gltf_files::difference(scene, &back), None);
    let [own, other] = [SceneBuffers::build(scene)?, SceneBuffers::build(&back)?];
    assert!(own.geometry == other.geometry && own.attributes == other.attributes, "the buffers differ");
    Ok(())
}

fn generated(name: &'static str, file: &[u8]) -> Result<(), Failed> {
    let scene = import(name, file)?;
    // panes of a single sheet may have a volume in these files
    let warnings: Vec<_> = scene.warnings.iter().filter(|warning| !warning.contains("is not closed")).collect();
    assert!(warnings.is_empty(), "{warnings:?}");
    comes_back(&scene)
}

/// Files beside the document hold the same texels as embedded ones.
fn external() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let scene = gltf::load(&gltf_files::external(folder.path())?)?;
    let [png, jpeg] = [embedded("linear")?, embedded("jpeg")?];
    assert_eq!(scene.textures.len(), 2);
    assert_eq!(scene.textures[0].texels, png.textures[0].texels);
    assert_eq!(scene.textures[1].texels, jpeg.textures[0].texels);
    comes_back(&scene)
}

/// A picture of a body that scatters light, by walks or without them.
fn shown(executor: &mut dyn Executor, scene: &SceneBuffers, subsurface: Subsurface) -> Result<Image, Error> {
    let settings = PathSettings { subsurface, max_depth: 4, longest_walk: 255, ..PathSettings::default() };
    let render = Render { count: 4, ..Render::new([24, 24], settings) };
    Ok(render.render(scene, executor)?.image)
}

/// Light comes out of a body of another program's file: its middle is not black, and darker without what is scattered. What is left without it comes
/// straight through.
fn scatters(file: &[u8], name: &str) -> Result<(), Failed> {
    let (scene, cpu) = (SceneBuffers::build(&import(name, file)?)?, &mut CpuExecutor::new()?);
    let middle =
        |image: &Image| -> f32 { (8..16).flat_map(|y| (8..16).map(move |x| image.pixels[24 * y + x][0])).sum() };
    let [walks, straight] = [Subsurface::Walk, Subsurface::Off]
        .map(|subsurface| shown(cpu, &scene, subsurface).map(|image| middle(&image)));
    let (walks, straight) = (walks?, straight?);
    println!("{name}: {walks} with what is scattered, {straight} without");
    if walks > 1.0 && walks > 1.1 * straight {
        Ok(())
    } else {
        Err(format!("{walks} with what is scattered, {straight} without").into())
    }
}

/// The device makes the same picture of it.
fn same_on_device(file: &[u8], name: &str, gpu: &mut GpuExecutor) -> Result<(), Failed> {
    let scene = SceneBuffers::build(&import(name, file)?)?;
    let [host, device] =
        [shown(&mut CpuExecutor::new()?, &scene, Subsurface::Walk)?, shown(gpu, &scene, Subsurface::Walk)?];
    let bits = |image: &Image| image.pixels.iter().map(|rgb| rgb.map(f32::to_bits)).collect::<Vec<_>>();
    if bits(&host) == bits(&device) { Ok(()) } else { Err("the device has another picture".into()) }
}

/// The comparison sees a change of the last bit of anything.
fn comparison_is_alive() -> Result<(), Failed> {
    let scene = embedded("everything")?;
    fn edit(scene: &mut Scene, change: impl FnOnce(&mut Mesh)) {
        change(Arc::make_mut(&mut scene.meshes[0]));
    }
    let changes: [fn(&mut Scene); 6] = [
        |scene| edit(scene, |mesh| mesh.positions[0][0] = mesh.positions[0][0].next_up()),
        |scene| edit(scene, |mesh| mesh.uvs[3][1] = -0.0),
        |scene| scene.instances[1].transform.translation.x += f64::MIN_POSITIVE,
        |scene| scene.materials[0].roughness = scene.materials[0].roughness.next_up(),
        |scene| scene.textures[0].texels = scene.textures[1].texels.clone(),
        |scene| scene.materials.iter_mut().for_each(|material| material.normal_texture = None),
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut changed = scene.clone();
        change(&mut changed);
        assert!(gltf_files::difference(&scene, &changed).is_some(), "change {number} is not seen");
    }
    Ok(())
}

/// What is done with extensions, as a table in Markdown has it.
fn listed(text: &str) -> BTreeMap<&str, &str> {
    let rows = text.lines().filter_map(|line| line.strip_prefix('|')?.split_once('|'));
    let named = rows.filter_map(|(name, rest)| {
        let name = name.trim().strip_prefix('`')?.strip_suffix('`')?;
        (name.starts_with("KHR_") || name.starts_with("EXT_"))
            .then(|| (name, rest.split('|').next().unwrap_or("").trim()))
    });
    named.collect()
}

/// The documentation names the extensions of the import's tables, and says what becomes of them.
fn extensions_are_listed() -> Result<(), Failed> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/rendering.md"))?;
    let read = gltf::SUPPORTED_EXTENSIONS.iter().map(|name| (*name, "read"));
    let expected: BTreeMap<&str, &str> =
        read.chain(gltf::REFUSED_EXTENSIONS.iter().map(|name| (*name, "refused"))).collect();
    assert_eq!(listed(&text), expected);
    assert!(text.contains("| any other | ignored |"));
    let wrong = text.replace("`KHR_materials_ior` | read", "`KHR_materials_ior` | ignored");
    assert_ne!(listed(&wrong), expected, "a wrong list is seen");
    Ok(())
}

/// Every extension that is read changes the scene: without its members, and where these lie in nothing else's place, another one is read.
fn extensions_are_read() -> Result<(), Failed> {
    let files = gltf_files::textured().into_iter().chain(gltf_files::scattering());
    let mut changing = BTreeSet::new();
    for (name, file) in files {
        let scene = import(name, &file)?;
        for extension in gltf::SUPPORTED_EXTENSIONS {
            let without = import(name, &gltf_files::without(&file, extension))?;
            if gltf_files::difference(&scene, &without).is_some() {
                changing.insert(*extension);
            }
        }
    }
    // it has no members: that quantised positions are read is a test of the import
    changing.insert("KHR_mesh_quantization");
    let expected: BTreeSet<&str> = gltf::SUPPORTED_EXTENSIONS.iter().copied().collect();
    assert_eq!(changing, expected);
    Ok(())
}

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("extensions are read", extensions_are_read),
        Trial::test("extensions are listed", extensions_are_listed),
        Trial::test("external files", external),
        Trial::test("the comparison is alive", comparison_is_alive),
    ];
    for (name, file) in gltf_files::textured() {
        trials.push(Trial::test(format!("generated/{name}"), move || generated(name, &file)));
    }
    for (name, file) in gltf_files::scattering() {
        let again = file.clone();
        trials.push(Trial::test(format!("generated/{name}"), move || generated(name, &again)));
        trials.push(Trial::test(format!("scattered light/{name}"), move || scatters(&file, name)));
    }
    trials.extend(device::trials(|adapter| {
        let files = gltf_files::scattering().into_iter();
        files.map(|(name, file)| adapter.trial(name, move |gpu| same_on_device(&file, name, gpu))).collect()
    }));
    for (name, _) in builtin::NAMES {
        // an environment is a file of its own
        let scene = || builtin::scene(name).map(|scene| Scene { environment: None, ..scene }).ok_or("no such scene");
        trials.push(Trial::test(format!("built-in/{name}"), move || comes_back(&scene()?)));
    }
    for name in ["bunny.glb", "suzanne.glb", "dragon_res3.glb"] {
        trials.push(Trial::test(format!("assets/{name}"), move || comes_back(&data::mesh(name)?)));
    }
    trials
}
