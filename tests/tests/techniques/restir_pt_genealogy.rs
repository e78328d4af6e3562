//! Whose path a pixel has: genealogies against the renders they are of, and what layers say of paths and shifts.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::render::Render;
use restir_host::scene::CameraPath;
use restir_host::technique::explain::Place;
use restir_host::technique::restir_pt::PtSettings;
use restir_host::technique::reuse::{self, Origin, Reuse, genealogy, render_with_layers};
use restir_shared::shift::Cause;
use restir_shared::technique::restir_pt::PackedPath;
use restir_tests::scenes::buffers;
use restir_tests::suite::ensure;
use restir_tests::technique::configure_by;

type Generation = reuse::Generation<PackedPath>;

const SIZE: [u32; 2] = [20, 14];
/// Lights have gone out and come back.
const FRAMES: u32 = 7;

restir_tests::suite! {
    later {
        chains_lead_to_who_traced_the_path a_false_chain_is_seen layers_count_what_genealogies_tell
    }
}

const SETTINGS: [&str; 5] = [
    "tile=4,max_plane_distance=0.1",
    "tile=4,max_plane_distance=0.1,shift=hybrid,spatial=2,feedback=on,jitter=on,neighbours=2",
    "shift=replay,spatial=0,changed=stale,temporal_mis=pairwise-defensive",
    "shift=hybrid,spatial=0,changed=retrace",
    "temporal=off,tile=4,max_plane_distance=0.1",
];

fn pt_render(scene: &SceneBuffers, moves: bool, text: &str) -> Result<Render, Failed> {
    let mut settings = PtSettings { max_depth: 5, ..PtSettings::default() };
    configure_by(&mut settings, text)?;
    let cameras = if moves { CameraPath::Orbit.cameras(scene.camera, FRAMES)? } else { Vec::new() };
    Ok(Render { count: FRAMES, seed: 5, cameras, ..Render::new(SIZE, settings) })
}

fn of_pixel(scene: &SceneBuffers, render: &Render, pixel: u32) -> Result<Vec<Generation>, Failed> {
    let place = Place { x: pixel % SIZE[0], y: pixel / SIZE[0], sample: 0 };
    Ok(genealogy(&mut CpuExecutor::new()?, scene, render, place)?)
}

/// Follows a genealogy by hand: every path replayed is the one that is stored, the next one is what it names and is the same path by
/// random numbers, length and vertex k, what was selected had been offered, and the last one was traced where and when its random
/// numbers say.
fn ensure_true(chain: &[Generation]) -> Result<(), Failed> {
    for g in chain {
        ensure(g.is_identical(), || format!("another path: {g:?}"))?;
    }
    for (child, parent) in chain.iter().zip(chain.iter().skip(1)) {
        let Origin::Record { made_by, pixel, is_other, .. } = child.origin else {
            return Err(format!("it goes on beyond who traced it: {child:?}").into());
        };
        let [a, b] = [child, parent].map(|g| g.stored().path);
        let is_offered = child.details.iter().any(|o| (o.pixel, o.cause) == (pixel, Cause::Nothing));
        let from_last = is_other && child.reuse == Reuse::Temporal && parent.reuse != Reuse::Recalled
            || child.reuse == Reuse::Recalled;
        let same = (a.key, a.length, a.reconnection, a.light_sampled)
            == (b.key, b.length, b.reconnection, b.light_sampled)
            && (parent.pass, parent.pixel) == (made_by, pixel)
            && parent.frame + u32::from(from_last) == child.frame
            && parent.pass < child.pass
            && (is_other || parent.pixel == child.pixel)
            && (!is_other || child.details.is_empty() || is_offered);
        ensure(same, || format!("{child:?} is no child of {parent:?}"))?;
    }
    let last = chain.last().ok_or("there is nothing")?;
    let path = last.stored().path;
    if path.length == 0 {
        return ensure(chain.len() == 1, || format!("it ends without a path: {last:?}"));
    }
    let traced_by = (path.key.x & 0xffff) + SIZE[0] * (path.key.x >> 16);
    let traced = last.origin == Origin::Candidate(0) && (traced_by, path.key.y) == (last.pixel, last.frame);
    ensure(traced, || format!("it was not traced there: {last:?}"))
}

fn chains_lead_to_who_traced_the_path() -> Result<(), Failed> {
    // own, of another pixel, of the last frame, recalled; causes of offers
    let (mut seen, mut causes, mut oldest) = ([0; 4], [0; Cause::ALL.len()], 0);
    for (name, moves) in [("moving", true), ("glass", true), ("cornell", false)] {
        let scene = buffers(name)?;
        for text in SETTINGS {
            let render = pt_render(&scene, moves, text)?;
            let layered = render_with_layers::<PackedPath>(&mut CpuExecutor::new()?, &scene, &render, &mut |_| Ok(()))?;
            let layers = layered.layers;
            for pixel in [147, 85, 203, 69] {
                let chain = of_pixel(&scene, &render, pixel)?;
                ensure_true(&chain)
                    .map_err(|e| format!("{name}, {text}, {pixel}: {}", e.message().unwrap_or_default()))?;
                ensure(chain[0].stored() == layers.records[pixel as usize], || {
                    format!("{name}, {text}: the first is not the last path of the render")
                })?;
                oldest = oldest.max(chain[0].frame - chain[chain.len() - 1].frame);
                for g in &chain {
                    g.details.iter().for_each(|offer| causes[offer.cause as usize] += 1);
                    match (g.origin, g.reuse) {
                        (_, Reuse::Recalled) => seen[3] += 1,
                        (Origin::Record { is_other: true, .. }, Reuse::Temporal) => seen[2] += 1,
                        (Origin::Record { is_other, .. }, _) => seen[usize::from(is_other)] += 1,
                        _ => {}
                    }
                }
            }
        }
    }
    println!(
        "own, other pixel, last frame, recalled: {seen:?}; up to {oldest} frames old; offers by cause: {causes:?}"
    );
    ensure(seen.iter().all(|&count| count > 0) && oldest > 2, || format!("not all occurs: {seen:?}, {oldest}"))?;
    ensure(causes[..5].iter().all(|&count| count > 0), || format!("not all causes occur: {causes:?}"))
}

/// A generation left out, a neighbour's instead of its own, another length, another word, another frame.
fn a_false_chain_is_seen() -> Result<(), Failed> {
    let scene = buffers("cornell")?;
    let render = pt_render(&scene, true, SETTINGS[1])?;
    let pixels = 0..SIZE[0] * SIZE[1];
    let chains = pixels.step_by(23).map(|pixel| of_pixel(&scene, &render, pixel)).collect::<Result<Vec<_>, _>>()?;
    let chain = chains.into_iter().max_by_key(Vec::len).ok_or("no pixel")?;
    ensure(chain.len() > 3, || format!("too short to be falsified: {chain:?}"))?;
    ensure_true(&chain)?;
    let changes: [fn(&mut Vec<Generation>); 5] = [
        |chain| {
            chain.remove(1);
        },
        |chain| chain[1].pixel += 1,
        |chain| {
            chain[1].record.words[12] ^= 1 << 24;
            chain[1].replayed.words[12] ^= 1 << 24;
        },
        |chain| chain[2].record.words[0] ^= 1,
        |chain| chain.iter_mut().for_each(|g| g.frame += 1),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let mut chain = chain.clone();
        change(&mut chain);
        ensure(ensure_true(&chain).is_err(), || format!("false chain {number} passes"))?;
    }
    Ok(())
}

/// The layers' counts of shifts are those of what genealogies of single pixels have been offered.
fn layers_count_what_genealogies_tell() -> Result<(), Failed> {
    let scene = buffers("glass")?;
    let render = pt_render(&scene, true, "tile=4,max_plane_distance=0.1,spatial=1")?;
    let layers = render_with_layers::<PackedPath>(&mut CpuExecutor::new()?, &scene, &render, &mut |_| Ok(()))?.layers;
    let channels = layers.channels();
    let total: u32 = layers.beside.iter().flatten().sum();
    ensure(total > 3 * SIZE[0] * SIZE[1], || format!("{total} shifts alone"))?;
    let mut whole = 0;
    for pixel in (37..SIZE[0] * SIZE[1]).step_by(26) {
        let chain = of_pixel(&scene, &render, pixel)?;
        let mut counts = [0; Cause::ALL.len()];
        let now: Vec<_> = chain.iter().filter(|g| (g.frame, g.pixel) == (FRAMES - 1, pixel)).collect();
        now.iter().flat_map(|g| &g.details).for_each(|offer| counts[offer.cause as usize] += 1);
        // a chain that leaves the pixel does not show what else it was offered
        let found = layers.beside[pixel as usize];
        let is_whole = now.iter().filter(|g| g.reuse != Reuse::Initial).count() == 2;
        let told =
            if is_whole { counts == found } else { counts.iter().zip(&found).all(|(told, found)| told <= found) };
        ensure(told, || format!("{pixel}: {counts:?} and {found:?}"))?;
        whole += u32::from(is_whole && counts.iter().sum::<u32>() > 2);
        let shown: Vec<f32> = channels[7..].iter().map(|channel| channel.values[pixel as usize]).collect();
        ensure(shown.iter().zip(&found).all(|(a, &b)| *a == b as f32), || format!("{shown:?} and {found:?}"))?;
    }
    ensure(whole >= 2, || format!("{whole} pixels alone show all that they were offered"))?;
    let names: Vec<&str> = channels.iter().map(|channel| channel.name).collect();
    let causes = Cause::ALL.map(|cause| format!("shift.{cause:?}").to_lowercase());
    ensure(names[8..].iter().eq(causes[1..].iter()), || format!("{names:?}"))
}
