//! ReSTIR DI: what its passes cost, what they leave alone, and a part of the matrix of `cargo lab unbiased --technique restir-di`.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::plan::Pass;
use restir_host::render::Render;
use restir_host::replay::{Counts, Recording};
use restir_host::scene::{Camera, Material, Mesh, Scene};
use restir_host::technique::Diagnose;
use restir_host::technique::path::PathSettings;
use restir_host::technique::restir_di::DiSettings;
use restir_kernels::restir_di::{di_combine, di_exchange, di_gather, di_offer, di_primary};
use restir_shared::glam::{DVec3, UVec4, Vec3};
use restir_shared::layout::FilmPixel;
use restir_shared::pack::decode_unit_vector;
use restir_shared::resample::mis::{Combine, Mis};
use restir_shared::resample::packed::LEVELS;
use restir_shared::resample::params::ReuseParams;
use restir_shared::scene::{AddressedLights, AnyScene, LightAddress, Surface, Trace};
use restir_shared::technique::path::PathParams;
use restir_shared::technique::restir_di::{
    self as passes, DiPairs, DiParams, DiPoint, Flags, PackedHit, PackedReservoir, Stored,
};
use restir_tests::bias::{ensure_biased, ensure_unbiased, film_moments, path_moments};
use restir_tests::capture::{Capture, captured, last};
use restir_tests::native::{changed, edit, film, film_over, plan};
use restir_tests::panes::Panes;
use restir_tests::random::SplitMix;
use restir_tests::scenes::{buffers, path_params};
use restir_tests::stats::effort::{bound, draws};
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::restir_di::settings;
use std::sync::OnceLock;

restir_tests::suite! {
    later {
        other_scenes_give_the_bits_of_renders combines_cost_what_the_table_says frames_cost_what_the_table_says
        without_neighbours_a_reservoir_stays glossy_history_fades known_visibility_needs_no_final_ray a_still_view_merges_as_by_talbot
        images_of_one_pixel_and_one_row_render without_lights_it_is_dark reservoirs_come_back_from_their_words
        broken_words_are_empty_reservoirs a_shaded_neighbour_costs_one_evaluation to_be_a_neighbour_is_mutual
        shading_with_neighbours_is_pairwise_mis more_rays_are_for_what_is_seen_alone unbiased_settings_agree_with_paths wrong_settings_are_seen
    }
}

/// Settings that differ as the text says from four candidates, selection without visibility, and a final ray.
fn plain(text: &str) -> DiSettings {
    settings(&format!("candidates=4,scatter=off,visibility_reuse=off,visibility=ray,shaded=0,{text}"))
}

fn bits(film: &[FilmPixel]) -> Vec<[u32; 4]> {
    film.iter().copied().map(bytemuck::cast).collect()
}

/// Frames of a scene, of which the last one is the picture.
fn render(size: [u32; 2], settings: &DiSettings, frames: u32, seed: u32) -> Render {
    Render { count: frames, seed, ..Render::new(size, settings.clone()) }
}

/// The picture with `seen_rays` is the one without, in which what is seen directly is replaced by that of path tracing with as many rays: of a
/// lamp and of a sky. The frame's own ray and the samples of paths of one segment are the same rays.
fn more_rays_are_for_what_is_seen_alone() -> Result<(), Failed> {
    const FRAMES: u32 = 3;
    let mut executor = CpuExecutor::new()?;
    for name in ["cornell", "tower"] {
        let scene = buffers(name)?;
        let idle = |text| settings(text).without_effect(&scene).is_some();
        ensure(idle("seen_rays=6") && !idle("seen_rays=6,jitter=on"), || "who has no use for them".to_owned())?;
        let mut picture = |render: &Render| -> Result<Vec<[f32; 3]>, Failed> {
            Ok(render.render(&scene, &mut executor)?.image.pixels)
        };
        let seen = PathSettings { max_depth: 1, jitter: true, ..PathSettings::default() };
        let mut apart = |rays: u32| -> Result<[Vec<[f32; 3]>; 2], Failed> {
            let frames = render([40, 30], &settings(&format!("jitter=on,shaded=20,seen_rays={rays}")), FRAMES, 5);
            let paths = Render { count: rays * FRAMES, seed: 5, ..Render::new([40, 30], seen.clone()) };
            Ok([picture(&Render { accumulate: true, ..frames })?, picture(&paths)?])
        };
        let ([one, one_seen], [many, many_seen]) = (apart(1)?, apart(6)?);
        // rounding of sums of so few, relative to the largest of them
        let differ = |of_many: f32| {
            let words = |image: &[[f32; 3]]| image.as_flattened().to_vec();
            let [one, one_seen, many, many_seen] = [&one, &one_seen, &many, &many_seen].map(|image| words(image));
            let differs = |i: &usize| {
                let scale = [one[*i], one_seen[*i], many[*i], many_seen[*i]].into_iter().fold(0.0, f32::max);
                ((many[*i] - of_many * many_seen[*i]) - (one[*i] - one_seen[*i])).abs() > 1e-6 * scale
            };
            (0..one.len()).filter(differs).count()
        };
        ensure(differ(1.0) == 0, || format!("{name}: {} values have something else", differ(1.0)))?;
        // counted twice, or not at all, it would be seen wherever there is any
        let lit = many_seen.as_flattened().iter().filter(|&&radiance| radiance > 0.0).count();
        let wrong = [2.0, 0.0].map(differ);
        ensure(lit > 0 && wrong == [lit; 2], || format!("{name}: {wrong:?} of {lit}"))?;
    }
    Ok(())
}

/// What follows is tested over scenes that count, or answer otherwise, by the same executor; this is that a user gets the same.
fn other_scenes_give_the_bits_of_renders() -> Result<(), Failed> {
    let mut executor = CpuExecutor::new()?;
    let presets = DiSettings::PRESETS.iter().map(|name| format!("preset={name}"));
    // the last in several passes, whose number is no power of two
    let more = ["jitter=on,spatial=2", "jitter=on,seen_rays=3", "temporal=fused", "temporal=off", "shaded=20"]
        .map(str::to_owned);
    let buffers = buffers("all-lights")?;
    for text in presets.chain(more) {
        let render = render([20, 14], &settings(&text), 3, 7);
        let rendered = render.render(&buffers, &mut executor)?;
        let film = film_over(&buffers.view(), plan(&buffers, &render))?;
        let same = film.iter().zip(&rendered.image.pixels).all(|(a, b)| a.sum.map(f32::to_bits) == b.map(f32::to_bits));
        ensure(same, || text)?;
    }
    Ok(())
}

const SIDE: u32 = 24;

/// A white wall under a light that all of it sees: every sample of every pixel is worth something everywhere.
fn lit_wall() -> Result<SceneBuffers, Failed> {
    wall_of(Material::diffuse("wall", [0.5; 3]))
}

/// The same of another material.
fn wall_of(material: Material) -> Result<SceneBuffers, Failed> {
    let (x, y) = (DVec3::X, DVec3::Y);
    let mut scene = Scene { camera: Some(Camera::pinhole(DVec3::Z * 3.0, DVec3::ZERO, y, 0.6)), ..Scene::default() };
    let wall = scene.add_material(material);
    scene.add_mesh("wall", wall, Mesh::quad(DVec3::new(-3.0, -3.0, 0.0), [x * 6.0, y * 6.0]));
    scene.add_quad_light(DVec3::new(-1.0, -1.0, 5.0), [y * 2.0, x * 2.0], [3.0; 3], false);
    Ok(SceneBuffers::build(&scene)?)
}

/// What one invocation leaves, and what it asks, but for surfaces: rays for their nearest hit, shadow rays, and lights at an
/// address, each of which is an evaluation of a target.
fn invoke<S: AnyScene>(capture: &Capture, scene: &S, at: [u32; 2]) -> (Vec<Vec<u32>>, Counts) {
    let recording = Recording::new(scene);
    let made = capture.invoke(&recording, at);
    (made, Counts { surfaces: 0, ..recording.counts() })
}

/// The reservoir that an invocation leaves.
fn reservoir(made: &[Vec<u32>]) -> Stored {
    Stored::unpack(bytemuck::pod_read_unaligned(bytemuck::cast_slice(&made[0])))
}

/// The costs of a combine of exactly k inputs, at each pixel that has so many: the pixel's own reservoir, and of the last
/// frame the one at its place and k - 2 around.
fn ensure_costs(text: &str, k: u32, shadow: &[u32], evaluations: u32) -> Result<(), Failed> {
    let buffers = lit_wall()?;
    let view = buffers.view();
    let settings = DiSettings { neighbours: k - 2, ..plain(&format!("still=off,temporal=fused,{text}")) };
    let captures = captured(plan(&buffers, &render([SIDE; 2], &settings, 2, 3)))?;
    let combine = last(&captures, &di_combine::DESC);
    let costs = combine.positions().map(|at| invoke(combine, &view, at));
    // every input counts once
    let costs: Vec<Counts> =
        costs.filter(|(made, _)| reservoir(made).confidence == k as f32).map(|(_, cost)| cost).collect();
    // a neighbour at the pixel's own place is none
    ensure(costs.len() as u32 > SIDE * SIDE * 9 / 10, || format!("{} pixels have {k} inputs", costs.len()))?;
    let right = shadow.iter().map(|&shadow| counts(shadow, evaluations)).collect::<Vec<_>>();
    let wrong = costs.iter().find(|cost| !right.contains(cost));
    ensure(wrong.is_none(), || format!("k = {k}, {text}: {wrong:?} is none of {right:?}"))
}

fn counts(shadow: u32, evaluations: u32) -> Counts {
    Counts { shadow: shadow.into(), light_samples: evaluations.into(), ..Counts::default() }
}

/// Rays as of §1.13 of Bitterli's count less those of a sample at its own pixel; evaluations with the k that select.
fn combines_cost_what_the_table_says() -> Result<(), Failed> {
    for k in 2..=9 {
        let pairs = 2 * (k - 1);
        let rows = [
            ("1/z", k - 1, k + k),
            ("contribution", k - 1, k + k),
            ("talbot", k * k - k, k * k),
            ("pairwise", pairs, k + pairs),
            ("pairwise-defensive", pairs, k + pairs),
            ("pairwise-counted", pairs, k + pairs),
        ];
        for (form, rays, evaluations) in rows {
            ensure_costs(&format!("mis={form},visibility_reuse=weights"), k, &[rays], evaluations)?;
            // without visibility the selected sample's target at the pixel is known
            let known = u32::from(["1/z", "contribution"].contains(&form));
            ensure_costs(&format!("mis={form}"), k, &[0], evaluations - known)?;
        }
        for form in ["1/m", "constant"] {
            ensure_costs(&format!("mis={form},visibility_reuse=candidates"), k, &[0], k)?;
        }
        let by_visibility = "visibility_reuse=selection,visibility=selected";
        // with visibility in the selection: nothing more for pairwise MIS; for contribution MIS k - 1 to select by, then one
        // for each other pixel, but for the one that the sample comes from
        ensure_costs(&format!("mis=pairwise-defensive,{by_visibility}"), k, &[pairs], k + pairs)?;
        ensure_costs(&format!("mis=contribution,{by_visibility}"), k, &[2 * k - 3, 2 * k - 2], 2 * k - 1)?;
    }
    Ok(())
}

/// The shadow rays of a frame's passes: initial, temporal with 2 inputs, spatial with one for each neighbour besides, final.
fn frame_costs(settings: &DiSettings) -> Result<[u64; 4], Failed> {
    let buffers = lit_wall()?;
    let view = buffers.view();
    let captures = captured(plan(&buffers, &render([SIDE; 2], settings, 2, 3)))?;
    let is_primary = |capture: &Capture| capture.pass.kernel.name == di_primary::DESC.name;
    let of_second = |capture: &&Capture| capture.pass.params::<DiParams>().is_some_and(|p| p.frame == 1);
    let second: Vec<&Capture> = captures.iter().filter(of_second).filter(|capture| !is_primary(capture)).collect();
    let [initial, temporal, spatial, shading] = second[..] else {
        return Err(format!("{} passes", second.len()).into());
    };
    let cost = |capture: &Capture, at| invoke(capture, &view, at).1.shadow;
    // each input stands for two
    let inputs = 2.0 * (1 + settings.neighbours) as f32;
    let full = |at: &[u32; 2]| reservoir(&spatial.invoke(&view, *at)).confidence == inputs;
    let pixels: Vec<[u32; 2]> = spatial.positions().filter(full).collect();
    ensure(pixels.len() as u32 > SIDE * SIDE * 9 / 10, || format!("{} pixels have all inputs", pixels.len()))?;
    let one = |capture: &Capture| -> Result<u64, Failed> {
        let first = cost(capture, pixels[0]);
        ensure(pixels.iter().all(|&at| cost(capture, at) == first), || format!("the cost differs, {settings:?}"))?;
        Ok(first)
    };
    let initial = initial.positions().map(|at| cost(initial, at)).sum::<u64>() / u64::from(SIDE * SIDE);
    Ok([initial, one(temporal)?, one(spatial)?, one(shading)?])
}

fn frames_cost_what_the_table_says() -> Result<(), Failed> {
    let rows = [
        ("mis=contribution,visibility_reuse=weights", [1, 1, 4, 1]),
        ("mis=talbot,visibility_reuse=weights", [1, 2, 20, 1]),
        ("mis=pairwise-defensive,visibility_reuse=weights", [1, 2, 8, 1]),
        ("mis=1/m,visibility_reuse=candidates", [1, 0, 0, 1]),
        ("mis=contribution", [0, 0, 0, 1]),
        ("mis=talbot", [0, 0, 0, 1]),
        // averaged visibility: one ray for the initial sample and one for each neighbour, none to shade
        ("preset=wis,scatter=off", [1, 0, 1, 0]),
    ];
    for (text, parts) in rows {
        for still in [false, true] {
            let settings = DiSettings { still, feedback: false, ..plain(text) };
            // a view that stands still knows what the last frame's pixel saw
            let expected = if still { [parts[0], 0, parts[2], parts[3]] } else { parts };
            let found = frame_costs(&settings)?;
            ensure(found == expected, || format!("{found:?} for {expected:?}, {text}, still: {still}"))?;
        }
    }
    Ok(())
}

/// All neighbours rejected, or none asked for: the words stay as they are.
fn without_neighbours_a_reservoir_stays() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    let view = buffers.view();
    let is_combine = |capture: &&Capture| capture.pass.kernel.name == di_combine::DESC.name;
    for text in with_all_forms(["still=off", "still=off,visibility_reuse=weights"]) {
        let captures = captured(plan(&buffers, &render([12, 12], &plain(&text), 3, 5)))?;
        for combine in captures.iter().filter(is_combine) {
            let in_place = combine.params::<DiParams>().flags.contains(Flags::OTHER_FRAME);
            let own: Vec<[u32; 4]> = combine.plane(if in_place { "reservoirs" } else { "others" });
            for neighbours in [0, 4] {
                // no cosine is so large
                let alone = combine.edited(|p: &mut DiParams| (p.neighbours, p.min_normal_cos) = (neighbours, 2.0));
                let stays = alone.positions().zip(&own).all(|(at, own)| alone.invoke(&view, at)[0] == own);
                ensure(stays, || format!("{text}, {neighbours} neighbours, of the last frame: {in_place}"))?;
            }
        }
    }
    Ok(())
}

/// Every form of MIS with every text.
fn with_all_forms<const N: usize>(texts: [&str; N]) -> impl Iterator<Item = String> {
    Mis::NAMED.into_iter().flat_map(move |(form, _)| texts.map(|text| format!("mis={form},{text}")))
}

/// With visibility in the MIS weights a pixel knows that of its sample.
fn known_visibility_needs_no_final_ray() -> Result<(), Failed> {
    for scene in ["cornell", "all-lights"] {
        let buffers = buffers(scene)?;
        for text in with_all_forms([
            "visibility_reuse=weights,scatter=on,still=off",
            "visibility_reuse=weights,scatter=on",
            "visibility_reuse=selection,scatter=on,still=off",
            "visibility_reuse=selection,scatter=on",
        ]) {
            let of = |more: &str| film(plan(&buffers, &render([16, 16], &plain(&format!("{text},{more}")), 3, 2)));
            ensure(bits(&of("visibility=ray")?) == bits(&of("visibility=selected")?), || format!("{scene}, {text}"))?;
        }
    }
    Ok(())
}

/// Where a camera moves along a wall of metal, the last frame's reservoirs count as long as the formula says, in f64, and those of this frame as many
/// rounds as `gloss_renewal` says; on a rough wall without specular lobes, or with `gloss_fade=0`, as the cap says, and one. A formula without the
/// square of the angle is seen, and one round.
fn glossy_history_fades() -> Result<(), Failed> {
    const FRAMES: u32 = 24;
    const STEP: f64 = 0.018;
    let rough = Material::diffuse("wall", [0.5; 3]);
    let metal = Material { metallic: 1.0, roughness: 0.2, ..rough.clone() };
    let camera = |frame: u32| {
        let eye = DVec3::new(STEP * f64::from(frame), 0.0, 3.0);
        Camera::pinhole(eye, eye - DVec3::Z * 3.0, DVec3::Y, 0.3)
    };
    let kept = |x: u32, power: f64| {
        // in the middle row: where the wall is seen, and from where in both frames
        let half = (0.15_f64).tan() * 3.0;
        let along = (2.0 * (f64::from(x) + 0.5) / f64::from(SIDE) - 1.0) * half;
        let above = half / f64::from(SIDE);
        let [now, then] = [0.0, STEP].map(|back| DVec3::new(-along - back, above, 3.0).normalize());
        let width = 0.2_f64.powi(4) + 1.0e-3;
        width / (width + 30.0 * (now - then).length().powf(power))
    };
    for (wall, text, fades) in
        [(&metal, "gloss_fade=30", true), (&metal, "gloss_fade=0", false), (&rough, "gloss_fade=30", false)]
    {
        let buffers = wall_of(wall.clone())?;
        let settings = plain(&format!("spatial=0,confidence_cap=20,{text}"));
        let cameras = (0..FRAMES).map(camera).collect();
        let render = Render { cameras, ..render([SIDE; 2], &settings, FRAMES, 3) };
        let captures = captured(plan(&buffers, &render))?;
        let combine = last(&captures, &di_combine::DESC);
        // half a pixel at most goes by in a frame: every one has its own history
        for x in 0..SIDE {
            let found = reservoir(&combine.invoke(&buffers.view(), [x, SIDE / 2])).confidence;
            let of_last = |power: f64| if fades { 20.0 * kept(x, power) } else { 20.0 };
            let rounds = if fades { 1.0 + (7.0 * (1.0 - kept(x, 2.0))).floor() } else { 1.0 };
            let expected = |power: f64| rounds + of_last(power);
            let is = |expected: f64| (f64::from(found) - expected).abs() <= 0.5 + 1.0e-3;
            ensure(is(expected(2.0)), || format!("{text}: {found} at {x}, not {}", expected(2.0)))?;
            ensure(!fades || !is(1.0 + of_last(2.0)), || format!("{text}: {found} at {x} would do for one round"))?;
            ensure(!fades || !is(expected(1.0)), || format!("{text}: {found} at {x} would do for the angle itself"))?;
        }
    }
    Ok(())
}

/// Talbot's weights of two reservoirs of one pixel are their shares of confidence, but for roundings.
fn a_still_view_merges_as_by_talbot() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    for text in ["mis=talbot", "mis=talbot,visibility_reuse=weights,visibility=selected"] {
        let of = |still| film(plan(&buffers, &render([24, 24], &DiSettings { still, ..plain(text) }, 4, 4)));
        let (still, general) = (of(true)?, of(false)?);
        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1.0e-5 * b.abs();
        let alike = still.iter().zip(&general).filter(|(a, b)| a.sum.iter().zip(&b.sum).all(near)).count();
        // a rounding may decide a selection
        ensure(alike + 4 >= still.len() && bits(&still) != bits(&general), || format!("{alike} pixels are alike"))?;
    }
    Ok(())
}

/// Neighbours beyond the image are mirrored into it; a single pixel has none.
fn images_of_one_pixel_and_one_row_render() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    for text in with_all_forms(["neighbours=7,visibility_reuse=weights"]) {
        for size in [[1, 1], [1, 7], [7, 1], [2, 2]] {
            let of = |settings| film(plan(&buffers, &render(size, &settings, 4, 1)));
            let film = of(plain(&text))?;
            let sound = film.iter().all(|p| p.dropped == 0.0 && p.sum.iter().all(|x| x.is_finite() && *x >= 0.0));
            ensure(sound, || format!("{text}, {size:?}: {film:?}"))?;
            let alone = size != [1, 1] || bits(&film) == bits(&of(DiSettings { spatial: 0, ..plain(&text) })?);
            ensure(alone, || format!("{text}: a neighbour of one pixel"))?;
        }
    }
    Ok(())
}

fn without_lights_it_is_dark() -> Result<(), Failed> {
    let buffers = buffers("unlit")?;
    ensure(buffers.header.light_count == 0, || "there is a light".to_owned())?;
    for name in DiSettings::PRESETS {
        let film = film(plan(&buffers, &render([8, 8], &settings(&format!("preset={name}")), 3, 1)))?;
        ensure(film.iter().all(|p| *p == FilmPixel::default()), || format!("{name}: light from nowhere"))?;
    }
    Ok(())
}

fn stored(random: &mut SplitMix) -> Stored {
    let mut below = |n: u32| (random.unit() * f64::from(n)) as u32;
    // from 2^-95 to 2^95
    let exponent = 32 + below(190);
    Stored {
        sample: LightAddress { light: below(1 << 24), u: below(1 << 24), v: below(1 << 24) },
        contribution_weight: f32::from_bits((exponent << 23) | below(1 << 23)),
        confidence: below(256) as f32,
        // a half in all channels, or a colour of five bits a channel, which is not grey
        visibility: if below(2) == 0 {
            Vec3::splat(below(2049) as f32 / 2048.0)
        } else {
            Vec3::from([below(16), 16 + below(16), below(32)].map(|level| level as f32 * (1.0 / LEVELS)))
        },
    }
}

fn reservoirs_come_back_from_their_words() -> Result<(), Failed> {
    let mut random = SplitMix::new(1);
    for _ in 0..100_000 {
        let stored = stored(&mut random);
        ensure(Stored::unpack(stored.pack()) == stored, || {
            format!("{stored:?} became {:?}", Stored::unpack(stored.pack()))
        })?;
        let beyond = Stored { confidence: stored.confidence + 256.0, ..stored };
        ensure(Stored::unpack(beyond.pack()) == Stored { confidence: 255.0, ..stored }, || format!("{beyond:?}"))?;
    }
    let empty = Stored::unpack(Stored::EMPTY.pack());
    ensure(empty == Stored::EMPTY, || format!("{empty:?}"))
}

/// Weights that are no number, infinite or negative, and visibility beyond 1.
fn broken_words_are_empty_reservoirs() -> Result<(), Failed> {
    let mut random = SplitMix::new(2);
    for _ in 0..1_000 {
        let stored = stored(&mut random);
        let word = stored.pack();
        for weight in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, 1.0e-40] {
            let broken = PackedReservoir(UVec4 { w: weight.to_bits(), ..word.0 });
            ensure(Stored::unpack(broken) == Stored::EMPTY, || format!("{weight} from a plane"))?;
            let packed = Stored::unpack(Stored { contribution_weight: weight, ..stored }.pack());
            let limited = packed.contribution_weight <= 1.3e30 && packed.contribution_weight >= 0.0;
            let kept = packed.has_sample() && (weight.is_nan() || weight < 1.0);
            ensure(limited && !kept, || format!("{weight} became {packed:?}"))?;
        }
        // 1.5, infinity and NaN as halves; with the highest bit it would be a colour
        for half in [0x3e00_u32, 0x7c00, 0x7e00] {
            let visibility = |word: u32, byte: u32| (word & 0x00ff_ffff) | (byte << 24);
            let [y, z] = [visibility(word.0.y, half >> 8), visibility(word.0.z, half & 0xff)];
            let broken = PackedReservoir(UVec4 { y, z, ..word.0 });
            ensure(Stored::unpack(broken) == Stored::EMPTY, || format!("visibility {half:x}"))?;
        }
    }
    Ok(())
}

/// A frame that is shaded with neighbours in one pass, and what that pass exchanges.
struct Shaded<'a, S> {
    scene: &'a S,
    hits: Vec<PackedHit>,
    reservoirs: Vec<PackedReservoir>,
    params: DiParams,
    points: Vec<DiPoint>,
    pairs: Vec<DiPairs>,
    direct: Vec<FilmPixel>,
    sent: Vec<FilmPixel>,
}

impl<'a, S: Trace + Surface + AddressedLights> Shaded<'a, S> {
    fn new(scene: &'a S, buffers: &SceneBuffers, settings: &DiSettings) -> Result<Self, Failed> {
        ensure(settings.shading_passes() == 1, || "not one pass".to_owned())?;
        let captures = captured(plan(buffers, &shaded_render(settings)))?;
        let [offer, gather] = [&di_offer::DESC, &di_gather::DESC].map(|kernel| last(&captures, kernel));
        Ok(Self {
            scene,
            hits: offer.plane("hits"),
            reservoirs: offer.plane("reservoirs"),
            params: gather.params(),
            points: gather.plane("points"),
            pairs: gather.plane("pairs"),
            direct: gather.plane("direct"),
            sent: gather.plane("film"),
        })
    }

    /// The picture that comes of exchanged targets.
    fn picture(&self, pairs: &[DiPairs]) -> Vec<FilmPixel> {
        let Self { direct, params, points, sent, .. } = self;
        let of = |(pixel, (&direct, &sent)): (usize, _)| {
            let at = [pixel as u32 % GRID.width, pixel as u32 / GRID.width];
            passes::gather(params, points, pairs, direct, sent, at)
        };
        direct.iter().zip(sent).enumerate().map(of).collect()
    }

    /// Index of a pixel's n-th neighbour, by the offsets' description.
    fn neighbour(&self, pixel: usize, n: usize) -> Option<usize> {
        let packed = self.params.pairs[n / 2];
        let sign = if n.is_multiple_of(2) { 1 } else { -1 };
        let [dx, dy] = [packed as i16, (packed >> 16) as i16].map(|offset| sign * i64::from(offset));
        let width = i64::from(GRID.width);
        let (x, y) = (pixel as i64 % width + dx, pixel as i64 / width + dy);
        let inside = (0..width).contains(&x) && (0..i64::from(GRID.height)).contains(&y);
        inside.then_some((y * width + x) as usize)
    }

    /// The radiance that pixel `receiver` gets by way of another's sample, and the target of that sample: of what arrives,
    /// where MIS knows of visibility.
    fn seen(&self, receiver: usize, sample: usize) -> ([f64; 3], f64) {
        let scene = self.scene;
        let params = &DiParams {
            reuse: ReuseParams { flags: self.params.flags | Flags::FINAL_RAY, ..self.params.reuse },
            ..self.params
        };
        let at = [receiver as u32 % GRID.width, receiver as u32 / GRID.width];
        let (hit, reservoir) = (self.hits[receiver], self.reservoirs[sample]);
        let pixel = passes::shade(scene, params, hit, reservoir, FilmPixel::default(), at);
        let sent = pixel.sum.map(f64::from);
        let stored = Stored::unpack(reservoir);
        let unshadowed = passes::target(scene, params, hit, at, stored.sample);
        let weight = f64::from(stored.contribution_weight);
        let target = match params.flags.contains(Flags::MIS_VISIBILITY) {
            _ if !stored.has_sample() => 0.0,
            false => f64::from(unshadowed),
            true => luminance(sent) / weight,
        };
        (sent, target)
    }

    /// Whether a pixel finds another one like itself, unless roundings may decide.
    fn finds_alike(&self, here: usize, there: usize) -> Option<bool> {
        let p = &self.params;
        let of = |pixel: usize| {
            let DiPoint { position, normal, .. } = self.points[pixel];
            (Vec3::from_array(position).as_dvec3(), decode_unit_vector(normal).as_dvec3())
        };
        let ((a, normal), (b, other)) = (of(here), of(there));
        let distance = (a - Vec3::from_array(p.camera.position).as_dvec3()).length();
        let [cos, far] = [normal.dot(other) - f64::from(p.min_normal_cos), normal.dot(b - a).abs() / distance];
        let beyond = far - f64::from(p.max_plane_distance);
        (cos.abs() > 1.0e-4 && beyond.abs() > 1.0e-4).then_some(cos > 0.0 && beyond < 0.0)
    }

    /// The radiance of a pixel by the formulas of pairwise MIS, in f64.
    fn expected(&self, pixel: usize) -> [f64; 3] {
        let accepted = |n: &usize| self.pairs[pixel].targets[*n] >= 0.0;
        let others = (0..self.params.neighbours as usize).filter(accepted).filter_map(|n| self.neighbour(pixel, n));
        let inputs: Vec<usize> = std::iter::once(pixel).chain(others).collect();
        let confidence = |pixel: usize| f64::from(Stored::unpack(self.reservoirs[pixel]).confidence);
        let mut combine = Combine::<f64>::new(Mis::PAIRWISE, 0.0);
        inputs.iter().for_each(|&input| combine.input(confidence(input), 1.0));
        for (i, &sample) in (0..).zip(&inputs) {
            combine.target(0, i, self.seen(pixel, sample).1);
            if i > 0 {
                combine.target(i, i, self.seen(sample, sample).1);
                combine.target(i, 0, self.seen(sample, pixel).1);
            }
        }
        let direct = self.direct[pixel].sum.map(f64::from);
        (0..).zip(&inputs).fold(direct, |sum, (i, &sample)| {
            let (sent, weight) = (self.seen(pixel, sample).0, combine.weight(i));
            std::array::from_fn(|channel| sum[channel] + weight * sent[channel])
        })
    }

    /// The largest difference of a picture from the formulas, relative to their mean.
    fn difference(&self, picture: &[FilmPixel]) -> f64 {
        let expected: Vec<[f64; 3]> = (0..picture.len()).map(|pixel| self.expected(pixel)).collect();
        let mean = expected.iter().flatten().sum::<f64>() / (3 * expected.len()) as f64;
        let channels = picture.iter().flat_map(|pixel| pixel.sum).zip(expected.iter().flatten());
        channels.map(|(a, b)| (f64::from(a) - b).abs() / (b.abs() + mean)).fold(0.0, f64::max)
    }
}

/// One ray and one evaluation, where a combine takes two and three.
fn a_shaded_neighbour_costs_one_evaluation() -> Result<(), Failed> {
    const NEIGHBOURS: u32 = 8;
    const REACH: u32 = 4;
    let buffers = lit_wall()?;
    let view = buffers.view();
    for (text, own_rays, rays) in [
        ("visibility_reuse=off", 1, 1),
        ("visibility_reuse=weights", 1, 1),
        ("visibility_reuse=weights,visibility=selected", 0, 1),
        ("visibility=selected", 0, 1),
        ("visibility=selected,near_radius=100", 0, 0),
    ] {
        let settings =
            DiSettings { shaded: NEIGHBOURS, ..plain(&format!("mis=talbot,shading_radius=3,spatial=0,{text}")) };
        let captures = captured(plan(&buffers, &render([SIDE; 2], &settings, 1, 3)))?;
        let passes = [&di_offer::DESC, &di_exchange::DESC].map(|kernel| last(&captures, kernel));
        let inside = |at: u32| (REACH..SIDE - REACH).contains(&at);
        for at in passes[0].positions().filter(|at| at.iter().all(|&at| inside(at))) {
            let found = passes.map(|capture| invoke(capture, &view, at).1);
            let expected = [counts(own_rays, 1), counts(rays * NEIGHBOURS, NEIGHBOURS)];
            ensure(found == expected, || format!("{found:?} at {at:?}: {text}"))?;
        }
    }
    Ok(())
}

fn shaded_render(settings: &DiSettings) -> Render {
    render([GRID.width, GRID.height], settings, 2, 11)
}

/// Settings of which one pass shades, with and without visibility in MIS.
fn shaded_settings() -> [DiSettings; 3] {
    [
        "mis=pairwise,visibility_reuse=selection,visibility=selected,scatter=on",
        "mis=talbot,visibility_reuse=weights,scatter=on",
        "mis=talbot",
    ]
    .map(|text| plain(&format!("{SMALL},shaded=8,shading_radius=4,{text}")))
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The sum of the weights of a sample is one only if its pixel is the neighbour of each of its neighbours: where only one finds
/// the other like itself, neither is.
fn to_be_a_neighbour_is_mutual() -> Result<(), Failed> {
    let buffers = buffers(SCENE)?;
    let view = buffers.traced_view();
    for settings in shaded_settings() {
        // around corners, where the distance from the plane decides
        let settings = DiSettings { min_normal_cos: -0.5, max_plane_distance: 0.1, ..settings };
        let shaded = Shaded::new(&view, &buffers, &settings)?;
        let hits = |pixel: usize| Stored::unpack(shaded.reservoirs[pixel]).confidence > 0.0;
        let (mut accepted, mut one_sided) = (0, 0);
        for pixel in (0..shaded.pairs.len()).filter(|&pixel| hits(pixel)) {
            for n in 0..shaded.params.neighbours as usize {
                let Some(other) = shaded.neighbour(pixel, n).filter(|&other| hits(other)) else { continue };
                let [ours, theirs] = [shaded.pairs[pixel].targets[n], shaded.pairs[other].targets[n ^ 1]];
                let [here, there] = [shaded.finds_alike(pixel, other), shaded.finds_alike(other, pixel)];
                let (Some(here), Some(there)) = (here, there) else { continue };
                let expected = [here && there; 2];
                ensure([ours, theirs].map(|target| target >= 0.0) == expected, || {
                    format!("{pixel} and {other}: {ours} and {theirs}, alike {here} and {there}")
                })?;
                accepted += u32::from(here && there);
                one_sided += u32::from(here != there);
            }
        }
        println!("{accepted} pairs, {one_sided} in which one alone finds the other like itself");
        ensure(accepted > 50 && one_sided > 10, || "too little is shown".to_owned())?;
    }
    Ok(())
}

/// Against formulas in f64, of the neighbours that take part. Roundings of f32 add up to some 2^-20.
fn shading_with_neighbours_is_pairwise_mis() -> Result<(), Failed> {
    let behind_glass = SceneBuffers::build(&Panes { coloured: true, count: 2 }.scene())?;
    let lit = buffers(SCENE)?;
    for (buffers, settings) in [&lit, &behind_glass].into_iter().flat_map(|b| shaded_settings().map(|s| (b, s))) {
        let view = buffers.traced_view();
        let shaded = Shaded::new(&view, buffers, &settings)?;
        let picture = shaded.picture(&shaded.pairs);
        let film = film(plan(buffers, &shaded_render(&settings)))?;
        ensure(bits(&picture) == bits(&film), || "the render has another picture".to_owned())?;
        let right = shaded.difference(&picture);
        // the target of the neighbour on the other side
        let swapped: Vec<DiPairs> = shaded
            .pairs
            .iter()
            .map(|pairs| DiPairs { targets: std::array::from_fn(|n| pairs.targets[n ^ 1]) })
            .collect();
        let wrong = shaded.difference(&shaded.picture(&swapped));
        println!("{right:.1e}, with the wrong neighbour's target {wrong:.1e}");
        ensure(right < 2.0_f64.powi(-17), || format!("a difference of {right:.1e}: {settings:?}"))?;
        ensure(wrong > 0.01, || format!("the wrong target is not seen: {wrong:.1e}"))?;
    }
    Ok(())
}

/// How often the tests of equal expectations fail in all. Seeds are fixed: a failure is a bug.
const FAMILY_RATE: f64 = 1.0e-3;
const GRID: TileGrid = TileGrid { width: 16, height: 16, tile: 8 };
const SCENE: &str = "all-lights";
const FRAMES: u32 = 3;
/// Chains of a test, and of one that is to see something wrong.
const RESTARTS: u32 = 2_048;
const GROSS: u32 = 192;
/// Images by the path tracer.
const REFERENCE_RESTARTS: u32 = 24_576;
/// The bias of the image that is noticed with 99 % probability is at most this.
const GOAL_IMAGE: f64 = 0.035;

/// Of chains: short ones, of few neighbours. Scattering finds nothing that is occluded, so it is for settings whose MIS knows of
/// visibility.
const SMALL: &str = "neighbours=3,radius=6,confidence_cap=3,still=off";

/// The path tracer's direct light.
fn reference() -> Result<&'static [Moments], Failed> {
    static REFERENCE: OnceLock<Vec<Moments>> = OnceLock::new();
    let buffers = buffers(SCENE)?;
    let params = PathParams { seed: 1 << 31, ..path_params(&buffers, [GRID.width, GRID.height], 2) };
    Ok(REFERENCE.get_or_init(|| path_moments(GRID, draws(REFERENCE_RESTARTS), &buffers.traced_view(), params)))
}

/// Moments of the last frames of chains, and what is found of them.
fn tested(text: &str, restarts: u32, change: fn(&mut Pass)) -> Result<(Vec<Moments>, Verdict), Failed> {
    let buffers = buffers(SCENE)?;
    let settings = plain(&format!("{SMALL},{text}"));
    let film = |seed| {
        let render = render([GRID.width, GRID.height], &settings, FRAMES, seed);
        film(changed(plan(&buffers, &render), change))
    };
    let moments = film_moments(GRID, restarts, film)?;
    let test = TileTest { grid: GRID, family_rate: FAMILY_RATE / UNBIASED.len() as f64 };
    let verdict = test.compare(&moments, reference()?);
    Ok((moments, verdict))
}

const UNBIASED: [&str; 13] = [
    "mis=talbot",
    // two passes: what neighbours saw and the pixel itself does not must not count
    "mis=1/z,visibility_reuse=weights,scatter=on,spatial=2",
    "mis=contribution,visibility_reuse=weights,scatter=on",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,scatter=on",
    "mis=pairwise-defensive,visibility_reuse=selection,visibility=selected,scatter=on",
    "mis=pairwise-counted,visibility_reuse=selection,visibility=selected,scatter=on,temporal=fused",
    "mis=talbot,visibility_reuse=weights,scatter=on,temporal=fused",
    "mis=pairwise-defensive,visibility_reuse=selection,visibility=selected,scatter=on,shaded=4",
    "mis=talbot,spatial=0,shaded=2",
    "mis=talbot,visibility_reuse=selection,visibility=selected,scatter=on,tiles=3x64",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,scatter=on,still=on,initial_rays=3,shaded=4",
    "mis=contribution,visibility_reuse=weights,scatter=on,still=on,initial_rays=2",
    "mis=pairwise,visibility_reuse=selection,visibility=selected,scatter=on,still=on,tiles=2x64,spatial=0,shaded=4",
];

fn unbiased_settings_agree_with_paths() -> Result<(), Failed> {
    let (restarts, goal) = (draws(RESTARTS), bound(GOAL_IMAGE));
    UNBIASED.iter().try_for_each(|text| ensure_unbiased(text, &tested(text, restarts, |_| ())?.1, goal))
}

/// Settings that the host calls biased or refuses, with the direction of their bias.
fn wrong_settings_are_seen() -> Result<(), Failed> {
    // visibility in MIS without initial visibility: samples are believed to be visible at their own pixel
    let believed: fn(&mut Pass) = |pass| edit(pass, |p: &mut DiParams| p.flags = p.flags | Flags::MIS_VISIBILITY);
    let rows: [(_, fn(&mut Pass), _); 4] = [
        ("mis=1/m,visibility_reuse=candidates", |_| (), -1.0),
        ("mis=constant,visibility_reuse=candidates", |_| (), -1.0),
        ("mis=pairwise-defensive,visibility_reuse=candidates", |_| (), -1.0),
        ("mis=talbot", believed, 1.0),
    ];
    for (text, change, sign) in rows {
        let (moments, verdict) = tested(text, GROSS, change)?;
        let green = moments.len() - 2;
        let test = ZTest::new(moments[green], reference()?[green]);
        println!("{text}: {:+.2} % of the image, z = {:.1}", 100.0 * test.difference / moments[green].mean(), test.z);
        ensure(test.z * sign > 5.0, || format!("{text}: z = {}", test.z))?;
        ensure_biased(text, &verdict)?;
    }
    Ok(())
}
