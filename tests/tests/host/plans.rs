//! Renders as data: what was written down renders the same bits, and what is damaged is refused.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor, GpuExecutor};
use restir_host::plan_file::{Contents, Form, PassEntry, Plan, VERSION};
use restir_host::render::{Render, Shows};
use restir_host::scene::{CameraPath, Scene};
use restir_host::technique::{Repeats, configure, named};
use restir_shared::layout::{CameraParams, fields_of};
use restir_tests::device;
use restir_tests::suite::{Trial, ensure};
use std::path::Path;

/// Scene, technique and settings: still and moving scenes, and passes of every kind.
const SUBJECTS: [(&str, &str, &[&str]); 8] = [
    ("cornell", "path", &[]),
    ("candles", "path", &["longest_walk=64"]),
    ("cube", "path", &["subsurface=hybrid"]),
    ("moving", "restir-di", &[]),
    ("many-lights", "restir-di", &["tiles=32x256"]),
    ("moving", "restir-pt", &[]),
    ("ajar", "restir-suffix", &[]),
    ("cube", "restir-sss", &[]),
];
const SIZE: [u32; 2] = [13, 9];

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("frames of a render are folded to those of one", frames_are_folded).first(),
        Trial::test("a renderer goes on beyond the frames of a plan", frames_go_on),
        Trial::test("a plan that is damaged or of another version is refused", damaged_plans_are_refused),
        Trial::test("kernels are written in every form", kernels_are_written_in_every_form),
    ];
    trials.extend(device::trials(|adapter| {
        let subjects = SUBJECTS.map(|(scene, technique, settings)| {
            let name = format!("{} as data", [&[scene, technique], settings].concat().join(" "));
            adapter.trial(&name, move |executor| gives_the_bits(executor, scene, technique, settings))
        });
        subjects.into_iter().collect()
    }));
    trials
}

/// Five frames with a camera that moves, or five samples.
fn job(scene: &SceneBuffers, technique: &str, settings: &[&str]) -> Result<Render, Failed> {
    let mut technique = named(technique)?;
    configure(technique.as_mut(), settings)?;
    let moves = technique.about().repeats == Repeats::Frames;
    let cameras = if moves { CameraPath::Turntable(90).cameras(scene.camera, 5)? } else { Vec::new() };
    let shows = if moves { Shows::Each } else { Shows::Last };
    Ok(Render { count: 5, cameras, shows, seed: 3, ..Render::new(SIZE, technique) })
}

/// By the CPU and by the adapter, from a folder.
fn gives_the_bits(gpu: &mut GpuExecutor, scene: &str, technique: &str, settings: &[&str]) -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load(scene)?)?;
    let job = job(&scene, technique, settings)?;
    let image = job.render(&scene, &mut CpuExecutor::inline())?.image;
    let folder = tempfile::tempdir()?;
    let plan = Plan::of(&job, &scene, &[])?;
    plan.write(folder.path())?;
    let opened = Plan::open(folder.path())?;
    ensure(opened == plan, || "what was read is not what was written".to_owned())?;
    let executors: [&mut dyn Executor; 2] = [&mut CpuExecutor::inline(), gpu];
    for executor in executors {
        let words = executor.run(opened.frames()?)?.swap_remove(0);
        let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&words);
        let differ = pixels.iter().zip(&image.pixels).filter(|(pixel, rgb)| pixel[..3] != rgb[..]).count();
        ensure(differ == 0 && pixels.len() == image.pixels.len(), || {
            format!("{differ} pixels differ by {}", executor.describe().executor)
        })?;
    }
    Ok(())
}

/// Sixteen frames have as many passes as those of which the last is one, and say what changes.
fn frames_are_folded() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let plan = |frames: u32| {
        let cameras = CameraPath::Turntable(90).cameras(scene.camera, frames)?;
        let shows = Shows::Each;
        let job = Render { count: frames, cameras, shows, ..Render::new(SIZE, named("restir-di")?) };
        Ok::<_, Failed>(Plan::of(&job, &scene, &[])?.document)
    };
    let (few, many) = (plan(4)?, plan(16)?);
    ensure(few.passes.len() == many.passes.len(), || format!("{} and {}", few.passes.len(), many.passes.len()))?;
    ensure(many.frames == 16, || many.frames.to_string())?;
    let changed = |field: &str| many.passes.iter().flat_map(|pass| &pass.changes).find(|change| change.field == field);
    let frame = changed("reuse.frame").ok_or("the frame is not said to change")?;
    ensure(frame.values == (0..16).map(|frame| vec![frame]).collect::<Vec<_>>(), || format!("{:?}", frame.values))?;
    let position = changed("reuse.camera.position").ok_or("the camera is not said to move")?;
    ensure(position.follows.as_deref() == Some("camera"), || format!("{:?}", position.follows))?;
    ensure(position.values.iter().all(|words| words.len() == 3), || format!("{:?}", position.values))?;
    let alternate = many.passes.iter().flat_map(|pass| pass.buffers.values()).filter(|ids| ids.len() > 1).count();
    ensure(alternate > 0, || "no plane alternates".to_owned())
}

/// A pass of a plan in a frame, in which it has run `time` times before: its buffers and the words of its parameters.
fn in_plan(entry: &PassEntry, time: usize) -> (Vec<usize>, Vec<u32>) {
    let mut params = entry.params.clone();
    for change in &entry.changes {
        let words = &change.values[time % change.values.len()];
        params[change.byte as usize / 4..][..words.len()].copy_from_slice(words);
    }
    (entry.buffers.values().map(|ids| ids[time % ids.len()]).collect(), params)
}

/// The same in a frame beyond the plan, as `docs/plans.md` has it: fields follow, others keep what they were.
fn beyond(entry: &PassEntry, time: usize, frame: u32, cameras: &[CameraParams]) -> (Vec<usize>, Vec<u32>) {
    let (buffers, mut params) = in_plan(entry, time);
    for change in &entry.changes {
        let last = frame - u32::from(change.follows.as_ref().is_some_and(|what| what.starts_with("last_")));
        let camera: &[u32] = bytemuck::cast_slice(std::slice::from_ref(&cameras[last as usize]));
        let part = change.field.rsplit('.').next();
        let words = match change.follows.as_deref() {
            Some("frame" | "last_frame") => vec![last],
            Some(_) => {
                let field = fields_of::<CameraParams>().iter().find(|field| Some(field.name) == part).expect("a field");
                camera[field.byte as usize / 4..][..change.values[0].len()].to_vec()
            }
            None => change.values[change.values.len() - 1].clone(),
        };
        params[change.byte as usize / 4..][..words.len()].copy_from_slice(&words);
    }
    (buffers, params)
}

/// What eight frames say of the twelfth is what a plan of twelve frames has there, but for what is drawn anew in each.
fn frames_go_on() -> Result<(), Failed> {
    const FEW: u32 = 8;
    const MANY: u32 = 12;
    for (name, technique) in [("many-lights", "restir-di"), ("ajar", "restir-pt"), ("cube", "restir-sss")] {
        let scene = SceneBuffers::build(&Scene::load(name)?)?;
        let path = CameraPath::Turntable(90).cameras(scene.camera, MANY)?;
        let cameras: Vec<CameraParams> = path.iter().map(|camera| camera.params(SIZE[0], SIZE[1])).collect();
        let plan = |count: u32| {
            let (cameras, shows) = (path[..count as usize].to_vec(), Shows::Each);
            let job = Render { count, cameras, shows, ..Render::new(SIZE, named(technique)?) };
            Ok::<_, Failed>(Plan::of(&job, &scene, &[])?.document)
        };
        let (few, many) = (plan(FEW)?, plan(MANY)?);
        ensure(few.passes.len() == many.passes.len(), || format!("{technique} has other passes"))?;
        for (entry, expected) in few.passes.iter().zip(&many.passes) {
            let first = entry.frames[0][0];
            ensure(entry.frames == [[first, FEW - 1]], || format!("{technique}: {:?}", entry.frames))?;
            let (frame, time) = (MANY - 1, (MANY - 1 - first) as usize);
            let drawn = entry.changes.iter().find(|change| change.field == "pairs");
            let pairs =
                drawn.map_or(0..0, |drawn| drawn.byte as usize / 4..drawn.byte as usize / 4 + drawn.values[0].len());
            let kept =
                |params: &[u32]| (0..).zip(params.to_vec()).filter(|(at, _)| !pairs.contains(at)).collect::<Vec<_>>();
            let ((buffers, params), (right, wanted)) = (beyond(entry, time, frame, &cameras), in_plan(expected, time));
            let kernel = &few.kernels[entry.kernel].name;
            ensure(buffers == right, || format!("{technique}: {kernel} binds {buffers:?} instead of {right:?}"))?;
            ensure(kept(&params) == kept(&wanted), || format!("{technique}: {kernel} has other parameters"))?;
        }
    }
    Ok(())
}

fn damaged_plans_are_refused() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let plan = Plan::of(&job(&scene, "path", &[])?, &scene, &[])?;
    let written = || {
        let folder = tempfile::tempdir()?;
        plan.write(folder.path())?;
        Ok::<_, Failed>(folder)
    };
    let refused = |folder: &Path, said: &str| match Plan::open(folder).and_then(|plan| plan.frames().map(drop)) {
        Ok(()) => Err(Failed::from(format!("accepted where {said:?} was expected"))),
        Err(error) => ensure(error.to_string().contains(said), || format!("{error} lacks {said:?}")),
    };
    let text = std::fs::read_to_string(written()?.path().join("plan.json"))?;
    let version = format!("\"version\": {VERSION}");
    let missing = "\"buffers\": [{\"name\":\"a\",\"bytes\":4,\"file\":\"missing.bin\"}]";
    let at = text.find("\"buffers\"").ok_or("no buffers")?;
    let to = text.find(",\n\"kernels\"").ok_or("no kernels")?;
    let instead = |entries: &str| format!("{}{entries}{}", &text[..at], &text[to..]);
    let turns = text.replacen("\"frames\":[[", "\"frames\":[[0,4],[", 1).replacen("\"left\":[", "\"left\":[9000,", 1);
    for (document, said) in [
        (text[..text.len() / 2].to_owned(), "export it again"),
        (text.replacen(&version, "\"version\": 999", 1), "version 999"),
        (text.replacen("restir-plan", "another-plan", 1), "another-plan"),
        (text.replacen("\"generator\"", "\"unknown\"", 1), "export it again"),
        (instead(missing), "missing.bin"),
        (instead(&missing.replace("missing.bin", "../secret.bin")), "not in its folder"),
        (instead("\"buffers\": []"), "does not exist"),
        (text.replacen("\"name\":\"path\"", "\"name\":\"no_kernel\"", 1), "another version of restir"),
        (text.replacen("\"stride\":16", "\"stride\":20", 1), "another version of restir"),
        (turns, "does not"),
        (text.replacen("\"frames\": 1", "\"frames\": 4000000000", 1), "frames or passes"),
        (text.replacen("\"bytes\":", "\"bytes\":9000000000000", 1), "this plan would take"),
    ] {
        let folder = written()?;
        std::fs::write(folder.path().join("plan.json"), document)?;
        refused(folder.path(), said)?;
    }
    let folder = written()?;
    let cut = plan.files.keys().find(|name| name.contains("geometry")).ok_or("no geometry")?;
    std::fs::write(folder.path().join(cut), [0; 8])?;
    refused(folder.path(), "does not fit")
}

fn kernels_are_written_in_every_form() -> Result<(), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let plan = Plan::of(&job(&scene, "restir-pt", &[])?, &scene, &Form::all())?;
    for kernel in &plan.document.kernels {
        ensure(kernel.modules.len() == Form::all().len(), || format!("{}: {:?}", kernel.name, kernel.modules))?;
        for (form, module) in &kernel.modules {
            let contents = plan.files.get(&module.file).ok_or("a file is missing")?;
            let is_text = matches!(contents, Contents::Text(text) if text.contains(&module.entry));
            ensure(is_text != (form == "spirv"), || format!("{} in {form}", kernel.name))?;
            // Chrome refuses a literal beyond the largest float, though by less than half a unit
            let is_beyond = matches!(contents, Contents::Text(text) if form == "wgsl" && text.contains("340282350000"));
            ensure(!is_beyond, || format!("{} has a literal that is no float", kernel.name))?;
        }
    }
    Ok(())
}
