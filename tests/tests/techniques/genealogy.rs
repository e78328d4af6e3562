//! Where reservoirs have their samples from: genealogies against the renders they are of, and their ages.

use libtest_mimic::Failed;
use restir_host::Error;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::render::Render;
use restir_host::scene::CameraPath;
use restir_host::technique::explain::Place;
use restir_host::technique::inspect::Layered;
use restir_host::technique::restir_di::{DiSettings, Temporal, Tiles};
use restir_host::technique::reuse::{self, Origin, Reuse, genealogy, render_with_layers};
use restir_kernels::restir_di::{di_offer, di_shade};
use restir_shared::rng::Rng;
use restir_shared::scene::{AddressedLights, LightAddress};
use restir_shared::technique::restir_di::{FROM_SCATTERING, MAX_GLOSS_RENEWAL, PackedReservoir};
use restir_tests::scenes::buffers;
use restir_tests::suite::ensure;
use restir_tests::technique::restir_di::settings;

type Generation = reuse::Generation<PackedReservoir>;

const SIZE: [u32; 2] = [20, 14];
const SEED: u32 = 5;
/// The sign and the bulb have gone out and come back.
const FRAMES: u32 = 16;
const PIXELS: [[u32; 2]; 9] = [[10, 7], [4, 5], [15, 11], [3, 3], [11, 5], [13, 3], [7, 4], [9, 9], [12, 4]];

restir_tests::suite! {
    later {
        chains_lead_to_the_candidate a_false_chain_is_seen layers_are_the_last_reservoirs
    }
}

const SETTINGS: [&str; 6] = [
    "",
    "gloss_fade=1e6",
    "spatial=3,feedback=off,jitter=on,mis=talbot",
    "temporal=fused,candidates=2",
    "tiles=3x20",
    "temporal=off,candidates=1,mis=contribution,shaded=0",
];

fn di_render(scene: &SceneBuffers, text: &str) -> Result<Render, Failed> {
    let cameras = CameraPath::Orbit.cameras(scene.camera, FRAMES)?;
    Ok(Render { count: FRAMES, seed: SEED, cameras, ..Render::new(SIZE, settings(text)) })
}

fn settings_of(render: &Render) -> &DiSettings {
    DiSettings::of(render).expect("renders of this suite are of ReSTIR DI")
}

fn of_pixel(
    executor: &mut dyn Executor,
    scene: &SceneBuffers,
    render: &Render,
    [x, y]: [u32; 2],
) -> Result<Vec<Generation>, Error> {
    genealogy(executor, scene, render, Place { x, y, sample: 0 })
}

/// The plane of reservoirs that is shaded in the end.
fn last_reservoirs(scene: &SceneBuffers, render: &Render) -> Result<Vec<PackedReservoir>, Failed> {
    let mut shaded = Vec::new();
    CpuExecutor::new()?.run_observed(render.plan(scene), &mut |step| {
        if [di_offer::DESC.name, di_shade::DESC.name].contains(&step.pass.kernel.name) {
            shaded = step.plane("reservoirs")?;
        }
        Ok(())
    })?;
    Ok(shaded)
}

/// Follows a genealogy by hand: every reservoir replayed is the one that is stored, the next one is that which it names, and has
/// the same point of the same light, and the last one has drawn it.
fn ensure_true(scene: &SceneBuffers, render: &Render, chain: &[Generation]) -> Result<(), Failed> {
    for g in chain {
        ensure(g.is_identical(), || format!("another reservoir: {g:?}"))?;
        ensure(!g.stored().has_sample() || g.details.target > 0.0, || format!("a sample with target zero: {g:?}"))?;
    }
    for (child, parent) in chain.iter().zip(chain.iter().skip(1)) {
        let Origin::Record { made_by, pixel, of_last_frame, is_other } = child.origin else {
            return Err(format!("it goes on beyond a candidate: {child:?}").into());
        };
        let [a, b] = [child, parent].map(|g| g.stored().sample);
        let same = (a.u, a.v, child.details.light) == (b.u, b.v, parent.details.light)
            && (of_last_frame || a.light == b.light)
            && (parent.pass, parent.pixel) == (made_by, pixel)
            && parent.frame + u32::from(of_last_frame) == child.frame
            && parent.pass < child.pass
            && (is_other || parent.pixel == child.pixel);
        ensure(same, || format!("{child:?} is no child of {parent:?}"))?;
    }
    let last = chain.last().ok_or("there is nothing")?;
    let address = last.stored().sample;
    match last.origin {
        _ if !address.is_light() => ensure(chain.len() == 1, || format!("it ends without a sample: {last:?}")),
        Origin::Candidate(FROM_SCATTERING) if last.reuse == Reuse::Initial => Ok(()),
        Origin::Candidate(index) if last.reuse == Reuse::Initial => {
            let drawn = candidate(scene, render, last, index)?;
            ensure(drawn == address, || format!("{drawn:?} was drawn, not {last:?}"))
        }
        _ => Err(format!("it does not end in a candidate: {last:?}").into()),
    }
}

/// A candidate from the lights, drawn once more. Of a frame's random dimensions two are the camera's, one is scattering's, two are
/// those of each of up to 16 combines; in the next one all candidates are drawn, each as a sample of its own, those after the first round from
/// 2^31 on. With tiles that
/// dimension says where in its block's tile a pixel's candidates begin; the dimensions of tiles and blocks lie beyond all of
/// these.
fn candidate(scene: &SceneBuffers, render: &Render, g: &Generation, index: u32) -> Result<LightAddress, Failed> {
    let settings = settings_of(render);
    let (x, y) = (g.pixel % render.width, g.pixel / render.width);
    let rng = |x, y, sample| Rng::new(x, y, sample, render.seed, settings.sampler);
    let scene = scene.at(f64::from(g.frame))?;
    let draw = |rng: Rng, dimension: u32| scene.view().choose_address(rng.draw(dimension));
    let dimension = 3 + 2 * 16;
    let Some(Tiles { count, size }) = settings.tiles else {
        let of_round = settings.candidates;
        let sample = match index.checked_sub(of_round) {
            None => g.frame * of_round + index,
            Some(after) => (1 << 31) + g.frame * of_round * MAX_GLOSS_RENEWAL + after,
        };
        return Ok(draw(rng(x, y, sample), dimension));
    };
    let below = |count: u32, word: u32| ((u64::from(count) * u64::from(word >> 8)) >> 24) as u32;
    let tile = below(count, rng(x / 8, y / 8, g.frame).hash(65_537).x);
    let place = (below(size, rng(x, y, g.frame).hash(dimension).x) + index) % size;
    Ok(draw(rng(tile, 0, g.frame * size + place), 65_536))
}

fn chains_lead_to_the_candidate() -> Result<(), Failed> {
    let mut executor = CpuExecutor::new()?;
    // own, neighbour, last frame, lights, scattering, lights in later rounds; the oldest sample
    let (mut seen, mut oldest) = ([0; 6], 0);
    for name in ["moving", "tower"] {
        let scene = buffers(name)?;
        for text in SETTINGS {
            let render = di_render(&scene, text)?;
            let stored = last_reservoirs(&scene, &render)?;
            for [x, y] in PIXELS {
                let chain = of_pixel(&mut executor, &scene, &render, [x, y])?;
                let place = format!("{name} ({x}, {y}) {text}");
                ensure_true(&scene, &render, &chain)
                    .map_err(|e| format!("{place}: {}", e.message().unwrap_or_default()))?;
                let is_shaded = chain[0].record == stored[(y * render.width + x) as usize];
                ensure(is_shaded, || format!("{place}: the first is not the last reservoir of the render"))?;
                oldest = oldest.max(chain[0].frame - chain[chain.len() - 1].frame);
                for g in &chain {
                    seen[match g.origin {
                        Origin::Record { is_other: false, .. } => 0,
                        Origin::Record { of_last_frame, .. } => 1 + usize::from(of_last_frame),
                        Origin::Candidate(FROM_SCATTERING) => 4,
                        Origin::Candidate(index) if index >= settings_of(&render).candidates => 5,
                        Origin::Candidate(_) => 3,
                    }] += 1;
                }
            }
        }
    }
    println!("own, neighbour, last frame, lights, scattering, later rounds: {seen:?}; up to {oldest} frames old");
    ensure(seen.iter().all(|&count| count > 0) && oldest > 2, || format!("not all occurs: {seen:?}, {oldest}"))
}

/// A generation left out, a neighbour's instead of its own, another point of the light, another candidate.
fn a_false_chain_is_seen() -> Result<(), Failed> {
    let scene = buffers("moving")?;
    let render = di_render(&scene, "")?;
    let mut executor = CpuExecutor::new()?;
    let chain = of_pixel(&mut executor, &scene, &render, PIXELS[0])?;
    ensure(chain.len() > 3, || format!("too short to be falsified: {chain:?}"))?;
    ensure_true(&scene, &render, &chain)?;
    let changes: [fn(&mut Vec<Generation>); 4] = [
        |chain| {
            chain.remove(1);
        },
        |chain| chain[1].pixel += 1,
        |chain| {
            chain[1].record.0.y ^= 1;
            chain[1].replayed.0.y ^= 1;
        },
        |chain| {
            if let Some(Generation { origin: Origin::Candidate(index), .. }) = chain.last_mut() {
                *index = u32::from(*index == 0);
            }
        },
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut chain = chain.clone();
        change(&mut chain);
        ensure(ensure_true(&scene, &render, &chain).is_err(), || format!("false chain {number} passes"))?;
    }
    Ok(())
}

fn layers_are_the_last_reservoirs() -> Result<(), Failed> {
    let mut executor = CpuExecutor::new()?;
    let scene = buffers("moving")?;
    for text in SETTINGS {
        let di = di_render(&scene, text)?;
        let plain = di.render(&scene, &mut executor)?;
        let Layered { rendered, layers } =
            render_with_layers::<PackedReservoir>(&mut executor, &scene, &di, &mut |_| Ok(()))?;
        ensure(rendered.image == plain.image, || "layers change the image".to_owned())?;
        for [x, y] in PIXELS {
            let pixel = (y * di.width + x) as usize;
            let chain = of_pixel(&mut executor, &scene, &di, [x, y])?;
            let age = chain[0].frame - chain[chain.len() - 1].frame;
            let first = chain[0].stored();
            ensure(layers.records[pixel] == first, || format!("({x}, {y}): {:?}", layers.records[pixel]))?;
            ensure(!first.sample.is_light() || layers.beside[pixel] == age, || {
                format!("({x}, {y}): age {} instead of {age}", layers.beside[pixel])
            })?;
        }
        let reuses = settings_of(&di).temporal != Temporal::Off;
        ensure(layers.beside.iter().any(|&age| age > 0) == reuses, || format!("ages {:?}", layers.beside))?;
        let names: Vec<&str> = layers.channels().iter().map(|channel| channel.name).collect();
        let expected = ["M", "W", "visibility", "light", "age"].map(|name| format!("reservoir.{name}"));
        ensure(names == expected, || format!("{names:?}"))?;
    }
    Ok(())
}
