//! glTF files in which something moves, at three times: where it is, what it looks like, and that it survives an export.
//! What they are compared with is worked out by [`restir_tests::gltf_motion`], which shares nothing with the host.

use glam::{DAffine3, DVec3};
use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::image::Image;
use restir_host::render::Render;
use restir_host::scene::{Animation, Camera, LightKind, Scene, export};
use restir_host::technique::path::PathSettings;
use restir_host::technique::restir_di::DiSettings;
use restir_tests::device;
use restir_tests::gltf_motion::{MOTIONS, Motion, Moved, TIMES, imported};
use restir_tests::lockstep::{first_divergence, trace};
use restir_tests::native::plan;
use restir_tests::suite::{Trial, ensure};
use std::sync::Arc;

/// Coordinates are within 4; keys, quaternions and vertices of a file and the result are each rounded once, and a turn
/// moves what is up to 2 away from its axis.
const POSITION_TOLERANCE: f64 = 8.0 * 4.0 * f32::EPSILON as f64 / 2.0;
/// A normal is a unit vector, but a joint may stretch it by 2.5.
const NORMAL_TOLERANCE: f64 = 8.0 * 2.5 * f32::EPSILON as f64 / 2.0;
/// A mistake is at least so much larger.
const MISTAKE: f64 = 1000.0;
const SIZE: [u32; 2] = [48, 36];
const SAMPLES: u32 = 4;
/// Mean difference of pictures relative to their mean: of the same vertices but for roundings, which make a ray pass an edge on
/// the other side here and there, and of the smallest mistake.
const SAME_PICTURE: f64 = 1.0e-4;
const OTHER_PICTURE: f64 = 5.0e-3;
/// Frames of the comparison of executors.
const FRAMES: u32 = 3;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = Vec::new();
    for motion in MOTIONS {
        let mut add = |what: &str, check: fn(Motion) -> Result<(), Failed>| {
            trials.push(Trial::test(format!("{}: {what}", motion.name), move || check(motion)));
        };
        add("everything is where it belongs", is_where_it_belongs);
        add("mistakes are seen", mistakes_are_seen);
        add("pictures are those of a scene that stands still", pictures_are_those_of_a_still_scene);
        add("an export poses as it did", an_export_poses_as_it_did);
        add("any tracer gives the same", any_tracer_gives_the_same);
        add("a changed byte never panics", a_changed_byte_never_panics);
    }
    trials.extend(device::trials(|adapter| {
        let trial = |motion: Motion| {
            let title = format!("{}: {FRAMES} frames of ReSTIR DI, all buffers after every pass", motion.name);
            adapter.trial(&title, move |executor| same_on_device(executor, motion))
        };
        MOTIONS.map(trial).into()
    }));
    trials
}

/// The scene as at a time in seconds, and the names of its instances' meshes.
fn posed(scene: &Scene, time: f64) -> Scene {
    scene.at(time * scene.animation.frame_rate)
}

/// Vertices and normals of an instance in world space.
fn in_world(scene: &Scene, instance: usize) -> Vec<[DVec3; 2]> {
    let instance = &scene.instances[instance];
    let (mesh, to_world) = (&scene.meshes[instance.mesh], instance.transform);
    let to_normal = to_world.matrix3.inverse().transpose();
    let double = |v: &[f32; 3]| DVec3::from_array(v.map(f64::from));
    let vertices = mesh.positions.iter().zip(&mesh.normals);
    vertices.map(|(p, n)| [to_world.transform_point3(double(p)), (to_normal * double(n)).normalize()]).collect()
}

/// The instances that a twin has, in its order.
fn instances(scene: &Scene, moved: &Moved) -> Vec<usize> {
    let mut names: Vec<Option<&str>> =
        scene.instances.iter().map(|instance| Some(scene.meshes[instance.mesh].name.as_str())).collect();
    let mut take = |name: &str| {
        let found = names.iter().position(|own| *own == Some(name)).expect("the mesh is in the file");
        names[found] = None;
        found
    };
    moved.meshes.iter().map(|(name, _)| take(name)).collect()
}

/// How far a scene is from a twin, in tolerances.
fn distance(scene: &Scene, moved: &Moved) -> f64 {
    let mut worst = 0.0_f64;
    for (instance, (_, expected)) in instances(scene, moved).into_iter().zip(&moved.meshes) {
        let found = in_world(scene, instance);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            worst = worst.max((found[0] - expected[0]).length() / POSITION_TOLERANCE);
            worst = worst.max((found[1] - expected[1]).length() / NORMAL_TOLERANCE);
        }
    }
    if let Some([position, forward]) = moved.camera {
        let camera = scene.camera.expect("the file has a camera");
        worst = worst.max((camera.position - position).length() / POSITION_TOLERANCE);
        worst = worst.max((camera.target - camera.position - forward).length() / NORMAL_TOLERANCE);
    }
    if let Some(expected) = moved.light {
        let LightKind::Point { position } = scene.lights[0].kind else { panic!("the file has a point light") };
        worst = worst.max((position - expected).length() / POSITION_TOLERANCE);
    }
    worst
}

fn is_where_it_belongs(motion: Motion) -> Result<(), Failed> {
    let scene = motion.scene()?;
    ensure(scene.warnings.is_empty(), || format!("{:?}", scene.warnings))?;
    for time in TIMES.into_iter().chain([3.0]) {
        let distance = distance(&posed(&scene, time), &(motion.at)(time, None));
        println!("{} at {time}: off by {distance:.2} tolerances", motion.name);
        ensure(distance < 1.0, || format!("at {time} it is off by {distance} tolerances"))?;
    }
    Ok(())
}

fn mistakes_are_seen(motion: Motion) -> Result<(), Failed> {
    let scene = motion.scene()?;
    for &mistake in motion.mistakes {
        let off = |time: f64| distance(&posed(&scene, time), &(motion.at)(time, Some(mistake)));
        let worst = TIMES.into_iter().map(off).fold(0.0, f64::max);
        println!("{mistake:?}: {worst:.0} tolerances");
        ensure(worst > MISTAKE, || format!("{mistake:?} is off by {worst} tolerances only"))?;
    }
    Ok(())
}

/// The scene with the vertices of a twin, which stands still.
fn still(scene: &Scene, moved: &Moved) -> Scene {
    let mut still = Scene { animation: Animation::default(), ..scene.clone() };
    let single = |k: usize| move |vertex: &[DVec3; 2]| vertex[k].as_vec3().to_array();
    for (instance, (_, vertices)) in instances(scene, moved).into_iter().zip(&moved.meshes) {
        let instance = &mut still.instances[instance];
        let mesh = Arc::make_mut(&mut still.meshes[instance.mesh]);
        mesh.positions = vertices.iter().map(single(0)).collect();
        mesh.normals = vertices.iter().map(single(1)).collect();
        instance.transform = DAffine3::IDENTITY;
    }
    if let Some([position, forward]) = moved.camera {
        still.camera =
            still.camera.map(|camera| Camera { position, target: position + forward, up: DVec3::Y, ..camera });
    }
    if let Some(position) = moved.light {
        still.lights[0].kind = LightKind::Point { position };
    }
    still
}

fn picture(buffers: &SceneBuffers) -> Result<Image, Failed> {
    let render = Render { count: SAMPLES, ..Render::new(SIZE, PathSettings::default()) };
    Ok(render.render(buffers, &mut CpuExecutor::new()?)?.image)
}

/// Mean difference of two pictures relative to the mean of the second.
fn difference(a: &Image, b: &Image) -> f64 {
    let values = |image: &Image| image.pixels.iter().flatten().map(|x| f64::from(*x)).collect::<Vec<f64>>();
    let (a, b) = (values(a), values(b));
    let sum: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum();
    sum / b.iter().sum::<f64>()
}

/// The scene that stands still has the tree of the other: of another one lights would have another order, and pictures another
/// noise.
fn pictures_are_those_of_a_still_scene(motion: Motion) -> Result<(), Failed> {
    let scene = motion.scene()?;
    let mut largest = vec![0.0_f64; motion.mistakes.len()];
    for time in TIMES {
        let animation = Animation { start: time, ..scene.animation.clone() };
        let buffers = SceneBuffers::build(&Scene { animation, ..scene.clone() })?;
        let found = picture(&buffers)?;
        let of = |mistake| -> Result<Image, Failed> {
            picture(&buffers.refit(&still(&scene, &(motion.at)(time, mistake)))?)
        };
        let same = difference(&found, &of(None)?);
        println!("{} at {time}: {same:.1e}", motion.name);
        ensure(same < SAME_PICTURE, || format!("at {time} the picture differs by {same}"))?;
        for (largest, &mistake) in largest.iter_mut().zip(motion.mistakes) {
            *largest = largest.max(difference(&found, &of(Some(mistake))?));
        }
    }
    println!("{} with mistakes: {largest:.3?}", motion.name);
    ensure(largest.iter().all(|&other| other > OTHER_PICTURE), || format!("a mistake is not seen: {largest:?}"))
}

/// All that is rendered of a scene, in any order: every bit counts.
fn contents(scene: &Scene) -> Vec<String> {
    let of_instance = |(index, instance): (usize, &restir_host::scene::Instance)| {
        let mesh = &scene.meshes[instance.mesh];
        format!("{} {:?} {:?} {:?}", mesh.name, in_world(scene, index), mesh.indices, scene.materials[mesh.material])
    };
    let mut contents: Vec<String> = scene.instances.iter().enumerate().map(of_instance).collect();
    contents.extend(scene.lights.iter().map(|light| format!("{light:?}")));
    contents.sort();
    contents.push(format!("{:?}", scene.camera));
    contents
}

/// Exported, and the export exported once more.
fn an_export_poses_as_it_did(motion: Motion) -> Result<(), Failed> {
    let scene = motion.scene()?;
    let left_out = export::left_out(&scene);
    ensure(left_out.is_empty(), || format!("{left_out:?}"))?;
    let back = imported("back", &export::glb(&scene)?)?;
    let again = imported("again", &export::glb(&back)?)?;
    ensure(back.warnings.is_empty(), || format!("{:?}", back.warnings))?;
    ensure(again.animation == back.animation, || "a second export has another rig".to_owned())?;
    for time in TIMES {
        let [own, first, second] = [&scene, &back, &again].map(|scene| contents(&posed(scene, time)));
        ensure(own == first && first == second, || format!("at {time} the export is posed in another way"))?;
    }
    let start = Animation { start: 0.5, period: Some(1.25), frame_rate: 30.0, ..scene.animation.clone() };
    let other = imported("other", &export::glb(&Scene { animation: start.clone(), ..scene })?)?.animation;
    let times = |animation: &Animation| (animation.start, animation.period, animation.frame_rate);
    ensure(times(&other) == times(&start), || format!("{:?}", times(&other)))
}

/// A byte of the document in so many, each in turn changed to digits and punctuation: the file is refused in a line, or posed.
fn a_changed_byte_never_panics(motion: Motion) -> Result<(), Failed> {
    const STRIDE: usize = 7;
    let file = (motion.file)();
    let length = u32::from_le_bytes([file[12], file[13], file[14], file[15]]) as usize;
    let (mut refused, mut built) = (0, 0);
    for position in (20..20 + length).step_by(STRIDE) {
        for value in *b"09\"-" {
            let mut changed = file.clone();
            changed[position] = value;
            let scene = match imported("changed", &changed) {
                Ok(scene) => scene,
                Err(problem) => {
                    let text = problem.message().unwrap_or_default();
                    ensure(!text.is_empty() && !text.contains('\n'), || format!("byte {position}: {text}"))?;
                    refused += 1;
                    continue;
                }
            };
            built += u32::from(SceneBuffers::build(&scene).and_then(|buffers| buffers.at(9.0)).is_ok());
            let _ = export::glb(&scene);
        }
    }
    println!("{}: {refused} refused, {built} built", motion.name);
    ensure(refused > 100 && built > 100, || format!("{refused} refused, {built} built"))
}

fn frames() -> Render {
    Render { count: FRAMES, accumulate: true, seed: 5, ..Render::new([18, 12], DiSettings::default()) }
}

/// Fast enough that a frame differs visibly from the next.
fn buffers(motion: Motion) -> Result<SceneBuffers, Failed> {
    let mut scene = motion.scene()?;
    (scene.animation.start, scene.animation.frame_rate) = (0.4, 8.0);
    Ok(SceneBuffers::build(&scene)?)
}

fn same_on_device(executor: &mut dyn Executor, motion: Motion) -> Result<(), Failed> {
    let (scene, render) = (buffers(motion)?, frames());
    render.check(&scene)?;
    let host = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
    let found = first_divergence(executor, plan(&scene, &render), &host)?;
    found.map_or(Ok(()), |divergence| Err(divergence.to_string().into()))
}

/// Threads and the trees of both frames change nothing; the frames do.
fn any_tracer_gives_the_same(motion: Motion) -> Result<(), Failed> {
    let (scene, render) = (buffers(motion)?, frames());
    let many = trace(&mut CpuExecutor::new()?, plan(&scene, &render))?;
    let found = first_divergence(&mut CpuExecutor::with_threads(1)?, plan(&scene, &render), &many)?;
    ensure(found.is_none(), || format!("{found:?}"))?;
    let moves = [0.0, 1.0, 2.0].map(|frame| scene.at(frame).map(|moved| moved.geometry));
    let [first, second, third] = moves;
    ensure(first? != second.as_ref().map_err(|e| e.to_string())?.clone() && second? != third?, || {
        "nothing moves".to_owned()
    })
}
