//! ReSTIR DI: what its passes cost, what they leave alone, and a part of the matrix of `cargo xtask unbiased --technique restir-di`.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::CpuExecutor;
use restir_host::plan::Pass;
use restir_host::render::{self, Render};
use restir_host::replay::Recording;
use restir_host::scene::{Camera, Material, Mesh, Scene};
use restir_host::technique::restir_di::{DiSettings, Temporal, Tiles, Visibility, VisibilityReuse};
use restir_kernels::restir_di::{di_combine, di_exchange, di_gather, di_offer, di_primary};
use restir_shared::glam::{UVec4, Vec3};
use restir_shared::layout::FilmPixel;
use restir_shared::pack::decode_unit_vector;
use restir_shared::resample::mis::{Combine, Mis};
use restir_shared::resample::packed::LEVELS;
use restir_shared::scene::{AddressedLights, AnyScene, LightAddress, Surface, Trace};
use restir_shared::technique::path;
use restir_shared::technique::path::PathParams;
use restir_shared::technique::restir_di::{
    self as passes, DiPairs, DiParams, DiPoint, Flags, PackedHit, PackedReservoir, Stored,
};
use restir_tests::capture::{Capture, captured, last};
use restir_tests::native::{changed, edit, film, film_over, plan};
use restir_tests::panes::Panes;
use restir_tests::random::SplitMix;
use restir_tests::scenes::named;
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict, ZTest};
use restir_tests::suite::ensure;
use std::ops::ControlFlow;
use std::sync::OnceLock;

restir_tests::suite! {
    other_scenes_give_the_bits_of_renders combines_cost_what_the_table_says
    selection_by_visibility_costs_what_the_table_says evaluations_grow_with_k_and_its_square
    frames_cost_what_the_table_says averaged_visibility_costs_two_rays without_neighbours_a_reservoir_stays
    known_visibility_needs_no_final_ray a_still_view_merges_as_by_talbot images_of_one_pixel_and_one_row_render
    without_lights_it_is_dark reservoirs_come_back_from_their_words broken_words_are_empty_reservoirs
    a_shaded_neighbour_costs_one_evaluation to_be_a_neighbour_is_mutual shading_with_neighbours_is_pairwise_mis
    unbiased_settings_agree_with_paths wrong_settings_are_seen
}

/// Candidates from lights, selection without visibility, a final ray.
fn plain(mis: Mis) -> DiSettings {
    DiSettings { mis, candidates: 4, ..DiSettings::visibility_in_shading() }
}

/// Occluded initial samples count for nothing, and MIS weights know of it.
fn reusing_visibility(mis: Mis) -> DiSettings {
    DiSettings { visibility_reuse: VisibilityReuse::Weights, ..plain(mis) }
}

fn buffers(name: &str) -> Result<SceneBuffers, Failed> {
    let scene = named(name).ok_or_else(|| Failed::from(format!("no scene {name}")))?;
    Ok(SceneBuffers::build(&scene)?)
}

fn bits(film: &[FilmPixel]) -> Vec<[u32; 4]> {
    film.iter().map(|p| [p.sum[0], p.sum[1], p.sum[2], p.dropped].map(f32::to_bits)).collect()
}

/// Frames of a scene, of which the last one is the picture.
fn render(size: [u32; 2], settings: &DiSettings, frames: u32, seed: u32) -> Render {
    Render { count: frames, seed, ..Render::new(size, settings.clone()) }
}

/// What follows is tested over scenes that count, or answer otherwise, by the same executor; this is that a user gets the same.
fn other_scenes_give_the_bits_of_renders() -> Result<(), Failed> {
    let mut executor = CpuExecutor::new(None)?;
    let default = DiSettings::default();
    let presets = DiSettings::PRESETS.iter().filter_map(|name| DiSettings::preset(name));
    let more = [
        DiSettings { jitter: true, spatial: 2, ..default.clone() },
        DiSettings { temporal: Temporal::Fused, ..default.clone() },
        DiSettings { temporal: Temporal::Off, ..default.clone() },
        // in several passes, whose number is no power of two
        DiSettings { shaded: 20, ..default },
    ];
    let buffers = buffers("all-lights")?;
    for settings in presets.chain(more) {
        let render = render([20, 14], &settings, 3, 7);
        let rendered = render::render(&mut executor, &buffers, &render, &mut |_| ControlFlow::Continue(()))?;
        let film = film_over(&buffers.view(), plan(&buffers, &render))?;
        let same = film.iter().zip(&rendered.image.pixels).all(|(a, b)| a.sum.map(f32::to_bits) == b.map(f32::to_bits));
        ensure(same, || format!("{settings:?}"))?;
    }
    Ok(())
}

const SIDE: u32 = 24;

/// A wall under a light that all of it sees: every sample of every pixel is worth something everywhere.
fn lit_wall() -> Result<SceneBuffers, Failed> {
    let mut scene = Scene {
        camera: Some(Camera::pinhole([0.0, 0.0, 3.0].into(), [0.0; 3].into(), [0.0, 1.0, 0.0].into(), 0.6)),
        ..Scene::default()
    };
    let wall = scene.add_material(Material::diffuse("wall", [0.5; 3]));
    scene.add_mesh(
        "wall",
        wall,
        Mesh::quad([-3.0, -3.0, 0.0].into(), [[6.0, 0.0, 0.0].into(), [0.0, 6.0, 0.0].into()]),
    );
    scene.add_quad_light([-1.0, -1.0, 5.0].into(), [[0.0, 2.0, 0.0].into(), [2.0, 0.0, 0.0].into()], [3.0; 3], false);
    Ok(SceneBuffers::build(&scene)?)
}

/// Of some work: rays for their nearest hit, shadow rays, and lights at an address, each of which is an evaluation of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cost {
    closest: u32,
    shadow: u32,
    evaluations: u32,
}

/// What one invocation leaves, and what it asks.
fn invoke<S: AnyScene>(capture: &Capture, scene: &S, at: [u32; 2]) -> (Vec<Vec<u32>>, Cost) {
    let recording = Recording::new(scene);
    let (made, counts) = (capture.invoke(&recording, at), recording.counts());
    let [closest, shadow, evaluations] = [counts.closest, counts.shadow, counts.light_samples].map(|n| n as u32);
    (made, Cost { closest, shadow, evaluations })
}

/// The costs of a combine of exactly k inputs, one for each pixel that has so many: the pixel's own reservoir, and of
/// the last frame the one at its place and k - 2 around.
fn costs(settings: &DiSettings, k: u32) -> Result<Vec<Cost>, Failed> {
    let buffers = lit_wall()?;
    let view = buffers.view();
    let settings = DiSettings { still: false, temporal: Temporal::Fused, neighbours: k - 2, ..settings.clone() };
    let captures = captured(plan(&buffers, &render([SIDE; 2], &settings, 2, 3)))?;
    let combine = last(&captures, &di_combine::DESC);
    let costs = combine.positions().filter_map(|at| {
        let (made, cost) = invoke(combine, &view, at);
        // every input counts once
        (reservoir(&made).confidence == k as f32).then_some(cost)
    });
    let costs: Vec<Cost> = costs.collect();
    // a neighbour at the pixel's own place is none
    ensure(costs.len() as u32 > SIDE * SIDE * 9 / 10, || format!("{} pixels have {k} inputs", costs.len()))?;
    Ok(costs)
}

/// The reservoir that an invocation leaves.
fn reservoir(made: &[Vec<u32>]) -> Stored {
    Stored::unpack(bytemuck::pod_read_unaligned(bytemuck::cast_slice(&made[0])))
}

fn ensure_costs(settings: &DiSettings, k: u32, shadow: &[u32], evaluations: u32) -> Result<(), Failed> {
    let costs = costs(settings, k)?;
    let wrong = costs.iter().find(|c| c.closest != 0 || !shadow.contains(&c.shadow) || c.evaluations != evaluations);
    ensure(wrong.is_none(), || {
        format!("k = {k}: {wrong:?} for {shadow:?} rays, {evaluations} evaluations, of {settings:?}")
    })
}

/// Rays as of §1.13 of Bitterli's count less those of a sample at its own pixel; evaluations with the k that select.
fn combines_cost_what_the_table_says() -> Result<(), Failed> {
    for k in [2, 5, 6] {
        let pairs = 2 * (k - 1);
        let rows = [
            (Mis::ONE_OVER_Z, k - 1, k + k),
            (Mis::CONTRIBUTION, k - 1, k + k),
            (Mis::TALBOT, k * k - k, k * k),
            (Mis::PAIRWISE, pairs, k + pairs),
            (Mis::PAIRWISE_DEFENSIVE, pairs, k + pairs),
            (Mis::PAIRWISE_COUNTED, pairs, k + pairs),
        ];
        for (form, rays, evaluations) in rows {
            ensure_costs(&reusing_visibility(form), k, &[rays], evaluations)?;
            // without visibility the selected sample's target at the pixel is known
            let known = u32::from(matches!(form, Mis::ONE_OVER_Z | Mis::CONTRIBUTION));
            ensure_costs(&plain(form), k, &[0], evaluations - known)?;
        }
        for form in [Mis::ONE_OVER_M, Mis::CONSTANT] {
            ensure_costs(&DiSettings { visibility_reuse: VisibilityReuse::Candidates, ..plain(form) }, k, &[0], k)?;
        }
    }
    Ok(())
}

/// With visibility in the selection: nothing more for pairwise MIS; for contribution MIS k - 1 to select by, then one for
/// each other pixel, but for the one that the sample comes from.
fn selection_by_visibility_costs_what_the_table_says() -> Result<(), Failed> {
    for k in [2, 5, 6] {
        let by_visibility = |form| DiSettings {
            visibility_reuse: VisibilityReuse::Selection,
            visibility: Visibility::Selected,
            ..reusing_visibility(form)
        };
        ensure_costs(&by_visibility(Mis::PAIRWISE_DEFENSIVE), k, &[2 * (k - 1)], 3 * k - 2)?;
        ensure_costs(&by_visibility(Mis::CONTRIBUTION), k, &[2 * k - 3, 2 * k - 2], 2 * k - 1)?;
    }
    Ok(())
}

/// The slope of a line through points of logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Evaluations for MIS, each of which would be a ray if pixels did not know their own samples: of Talbot's weights the
/// square of k, of contribution MIS k, less what the selection needs in any case.
fn evaluations_grow_with_k_and_its_square() -> Result<(), Failed> {
    let points = |form, selection: fn(u32) -> u32| -> Result<Vec<(f64, f64)>, Failed> {
        (2..=9)
            .map(|k| Ok((f64::from(k), f64::from(costs(&reusing_visibility(form), k)?[0].evaluations - selection(k)))))
            .collect()
    };
    let square = slope(&points(Mis::TALBOT, |_| 0)?);
    let line = slope(&points(Mis::CONTRIBUTION, |k| k)?);
    ensure((square - 2.0).abs() < 0.05 && (line - 1.0).abs() < 0.05, || format!("slopes {square} and {line}"))
}

/// The shadow rays of a frame's passes: initial, temporal with 2 inputs, spatial with 5, final.
fn frame_costs(settings: &DiSettings, neighbours: u32) -> Result<[u32; 4], Failed> {
    let buffers = lit_wall()?;
    let view = buffers.view();
    let settings = DiSettings { neighbours, shaded: 0, feedback: false, ..settings.clone() };
    let captures = captured(plan(&buffers, &render([SIDE; 2], &settings, 2, 3)))?;
    let second = captures.iter().filter(|capture| capture.pass.params::<DiParams>().is_some_and(|p| p.frame == 1));
    let passes: Vec<Capture> = second.filter(|c| c.pass.kernel.name != di_primary::DESC.name).cloned().collect();
    let [initial, temporal, spatial, shading] = &passes[..] else {
        return Err(format!("{} passes", passes.len()).into());
    };
    let cost = |capture: &Capture, at| invoke(capture, &view, at).1.shadow;
    // each input stands for two
    let full = |at: &[u32; 2]| reservoir(&spatial.invoke(&view, *at)).confidence == 2.0 * (1 + neighbours) as f32;
    let pixels: Vec<[u32; 2]> = spatial.positions().filter(full).collect();
    ensure(pixels.len() as u32 > SIDE * SIDE * 9 / 10, || format!("{} pixels have all inputs", pixels.len()))?;
    let one = |capture: &Capture| -> Result<u32, Failed> {
        let first = cost(capture, pixels[0]);
        ensure(pixels.iter().all(|&at| cost(capture, at) == first), || format!("the cost differs, {settings:?}"))?;
        Ok(first)
    };
    let initial = initial.positions().map(|at| cost(initial, at)).sum::<u32>() / (SIDE * SIDE);
    Ok([initial, one(temporal)?, one(spatial)?, one(shading)?])
}

fn frames_cost_what_the_table_says() -> Result<(), Failed> {
    let biased = DiSettings { visibility_reuse: VisibilityReuse::Candidates, ..plain(Mis::ONE_OVER_M) };
    let rows = [
        (reusing_visibility(Mis::CONTRIBUTION), [1, 1, 4, 1], 7),
        (reusing_visibility(Mis::TALBOT), [1, 2, 20, 1], 24),
        (reusing_visibility(Mis::PAIRWISE_DEFENSIVE), [1, 2, 8, 1], 12),
        (biased, [1, 0, 0, 1], 2),
        (plain(Mis::CONTRIBUTION), [0, 0, 0, 1], 1),
        (plain(Mis::TALBOT), [0, 0, 0, 1], 1),
    ];
    for (settings, parts, total) in rows {
        let moving = DiSettings { still: false, ..settings.clone() };
        let found = frame_costs(&moving, 4)?;
        ensure(found == parts && found.iter().sum::<u32>() == total, || {
            format!("{found:?} for {parts:?}, {settings:?}")
        })?;
        // a view that stands still knows what the last frame's pixel saw
        let found = frame_costs(&settings, 4)?;
        let parts = [parts[0], 0, parts[2], parts[3]];
        ensure(found == parts, || format!("{found:?} for {parts:?} in a still view, {settings:?}"))?;
    }
    Ok(())
}

/// One for the initial sample, one for the neighbour's, none for the last frame's and none to shade.
fn averaged_visibility_costs_two_rays() -> Result<(), Failed> {
    let wis = DiSettings::preset("wis").ok_or("no preset wis")?;
    let found = frame_costs(&DiSettings { scatter: false, ..wis }, 1)?;
    ensure(found == [1, 0, 1, 0], || format!("{found:?}"))
}

/// All neighbours rejected, or none asked for: the words stay as they are.
fn without_neighbours_a_reservoir_stays() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    let view = buffers.view();
    for (name, form) in Mis::NAMED {
        for settings in [plain(form), reusing_visibility(form)] {
            let settings = DiSettings { still: false, ..settings };
            let captures = captured(plan(&buffers, &render([12, 12], &settings, 3, 5)))?;
            for combine in captures.iter().filter(|capture| capture.pass.kernel.name == di_combine::DESC.name) {
                let in_place = combine.params::<DiParams>().flags.contains(Flags::OTHER_FRAME);
                let own: Vec<[u32; 4]> = combine.plane(if in_place { "reservoirs" } else { "others" });
                for neighbours in [0, 4] {
                    // no cosine is so large
                    let alone = combine.edited(|p: &mut DiParams| (p.neighbours, p.min_normal_cos) = (neighbours, 2.0));
                    let stays = alone.positions().zip(&own).all(|(at, own)| alone.invoke(&view, at)[0] == own);
                    ensure(stays, || format!("{name}, {neighbours} neighbours, of the last frame: {in_place}"))?;
                }
            }
        }
    }
    Ok(())
}

/// With visibility in the MIS weights a pixel knows that of its sample.
fn known_visibility_needs_no_final_ray() -> Result<(), Failed> {
    for scene in ["cornell", "all-lights"] {
        let buffers = buffers(scene)?;
        for (name, form) in Mis::NAMED {
            for visibility_reuse in [VisibilityReuse::Weights, VisibilityReuse::Selection] {
                for still in [false, true] {
                    let ray = DiSettings { visibility_reuse, scatter: true, still, ..reusing_visibility(form) };
                    let known = DiSettings { visibility: Visibility::Selected, ..ray.clone() };
                    let [a, b] = [ray, known].map(|s| film(plan(&buffers, &render([16, 16], &s, 3, 2))));
                    ensure(bits(&a?) == bits(&b?), || {
                        format!("{scene}, {name}, {visibility_reuse:?}, still: {still}")
                    })?;
                }
            }
        }
    }
    Ok(())
}

/// Talbot's weights of two reservoirs of one pixel are their shares of confidence, but for roundings.
fn a_still_view_merges_as_by_talbot() -> Result<(), Failed> {
    let buffers = buffers("all-lights")?;
    let selected = DiSettings { visibility: Visibility::Selected, ..reusing_visibility(Mis::TALBOT) };
    for settings in [plain(Mis::TALBOT), selected] {
        let general = DiSettings { still: false, ..settings.clone() };
        let [still, general] = [settings, general].map(|s| film(plan(&buffers, &render([24, 24], &s, 4, 4))));
        let (still, general) = (still?, general?);
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
    for (name, form) in Mis::NAMED {
        let settings = DiSettings { neighbours: 7, ..reusing_visibility(form) };
        for size in [[1, 1], [1, 7], [7, 1], [2, 2]] {
            let of = |spatial| film(plan(&buffers, &render(size, &DiSettings { spatial, ..settings.clone() }, 4, 1)));
            let film = of(settings.spatial)?;
            let sound = film.iter().all(|p| p.dropped == 0.0 && p.sum.iter().all(|x| x.is_finite() && *x >= 0.0));
            ensure(sound, || format!("{name}, {size:?}: {film:?}"))?;
            ensure(size != [1, 1] || bits(&film) == bits(&of(0)?), || format!("{name}: a neighbour of one pixel"))?;
        }
    }
    Ok(())
}

fn without_lights_it_is_dark() -> Result<(), Failed> {
    let buffers = buffers("unlit")?;
    ensure(buffers.header.light_count == 0, || "there is a light".to_owned())?;
    for name in DiSettings::PRESETS {
        let settings = DiSettings::preset(name).ok_or(name)?;
        let film = film(plan(&buffers, &render([8, 8], &settings, 3, 1)))?;
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
        let params = &DiParams { flags: self.params.flags | Flags::FINAL_RAY, ..self.params };
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
    let selected = DiSettings { visibility: Visibility::Selected, ..plain(Mis::TALBOT) };
    for (settings, own_rays, rays) in [
        (plain(Mis::TALBOT), 1, 1),
        (reusing_visibility(Mis::TALBOT), 1, 1),
        (DiSettings { visibility_reuse: VisibilityReuse::Weights, ..selected.clone() }, 0, 1),
        (selected.clone(), 0, 1),
        (DiSettings { near_radius: 100.0, ..selected }, 0, 0),
    ] {
        let settings = DiSettings { shaded: NEIGHBOURS, shading_radius: 3.0, spatial: 0, ..settings };
        let captures = captured(plan(&buffers, &render([SIDE; 2], &settings, 1, 3)))?;
        let [offer, exchange] = [&di_offer::DESC, &di_exchange::DESC].map(|kernel| last(&captures, kernel));
        let inside = |at: u32| (REACH..SIDE - REACH).contains(&at);
        for at in offer.positions().filter(|at| at.iter().all(|&at| inside(at))) {
            let [(_, offer), (_, exchange)] = [offer, exchange].map(|capture| invoke(capture, &view, at));
            let expected = [
                Cost { closest: 0, shadow: own_rays, evaluations: 1 },
                Cost { closest: 0, shadow: rays * NEIGHBOURS, evaluations: NEIGHBOURS },
            ];
            ensure([offer, exchange] == expected, || format!("{offer:?}, {exchange:?} at {at:?}: {settings:?}"))?;
        }
    }
    Ok(())
}

fn shaded_render(settings: &DiSettings) -> Render {
    render([GRID.width, GRID.height], settings, 2, 11)
}

/// Settings of which one pass shades, with and without visibility in MIS.
fn shaded_settings() -> [DiSettings; 3] {
    let of = |settings: DiSettings| DiSettings { shaded: 8, shading_radius: 4.0, ..small(settings) };
    [
        of(DiSettings {
            visibility_reuse: VisibilityReuse::Selection,
            visibility: Visibility::Selected,
            ..reusing_visibility(Mis::PAIRWISE)
        }),
        of(reusing_visibility(Mis::TALBOT)),
        of(DiSettings { scatter: false, ..plain(Mis::TALBOT) }),
    ]
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
const RESTARTS: u32 = 256;
const GROSS: u32 = 192;
/// Images by the path tracer.
const REFERENCE_RESTARTS: u32 = 6_144;
/// The bias of the image that is noticed with 99 % probability is at most this.
const GOAL_IMAGE: f64 = 0.06;

/// The path tracer's direct light.
fn reference() -> Result<&'static [Moments], Failed> {
    static REFERENCE: OnceLock<Vec<Moments>> = OnceLock::new();
    let buffers = buffers(SCENE)?;
    Ok(REFERENCE.get_or_init(|| {
        let view = buffers.traced_view();
        let params = PathParams {
            scene: buffers.header,
            camera: buffers.camera.params(GRID.width, GRID.height),
            width: GRID.width,
            height: GRID.height,
            max_depth: 2,
            ..PathParams::default()
        };
        GRID.moments(REFERENCE_RESTARTS, |restart, x, y| {
            path::pixel(&view, &PathParams { seed: (1 << 31) + restart, ..params }, x, y).sum.map(f64::from)
        })
    }))
}

/// Moments of the last frames of chains; flags are added by `force`.
fn moments(settings: &DiSettings, restarts: u32, force: Flags) -> Result<Vec<Moments>, Failed> {
    use rayon::prelude::*;
    let buffers = buffers(SCENE)?;
    let forced = move |pass: &mut Pass| {
        if force != Flags::default() {
            edit(pass, |p: &mut DiParams| p.flags = p.flags | force);
        }
    };
    let film = |seed| {
        let render = render([GRID.width, GRID.height], settings, FRAMES, seed);
        film(changed(plan(&buffers, &render), forced))
    };
    let films: Vec<Vec<FilmPixel>> = (0..restarts).into_par_iter().map(film).collect::<Result<_, _>>()?;
    ensure(films.iter().flatten().all(|p| p.dropped == 0.0), || format!("dropped samples: {settings:?}"))?;
    Ok(GRID
        .moments(restarts, |restart, x, y| films[restart as usize][(y * GRID.width + x) as usize].sum.map(f64::from)))
}

fn verdict(tested: &[Moments]) -> Result<Verdict, Failed> {
    Ok(TileTest { grid: GRID, family_rate: FAMILY_RATE / UNBIASED as f64 }.compare(tested, reference()?))
}

fn small(settings: DiSettings) -> DiSettings {
    // scattering finds nothing that is occluded, so that MIS has to know of visibility
    DiSettings {
        scatter: settings.knows_visibility(),
        neighbours: 3,
        radius: 6.0,
        confidence_cap: 3,
        still: false,
        ..settings
    }
}

const UNBIASED: usize = 13;

fn unbiased_settings_agree_with_paths() -> Result<(), Failed> {
    let by_visibility = |form| DiSettings {
        visibility_reuse: VisibilityReuse::Selection,
        visibility: Visibility::Selected,
        ..reusing_visibility(form)
    };
    let rows: [DiSettings; UNBIASED - 3] = [
        plain(Mis::TALBOT),
        // two passes: what neighbours saw and the pixel itself does not must not count
        DiSettings { spatial: 2, ..reusing_visibility(Mis::ONE_OVER_Z) },
        reusing_visibility(Mis::CONTRIBUTION),
        by_visibility(Mis::PAIRWISE),
        by_visibility(Mis::PAIRWISE_DEFENSIVE),
        DiSettings { temporal: Temporal::Fused, ..by_visibility(Mis::PAIRWISE_COUNTED) },
        DiSettings { temporal: Temporal::Fused, ..reusing_visibility(Mis::TALBOT) },
        DiSettings { shaded: 4, ..by_visibility(Mis::PAIRWISE_DEFENSIVE) },
        DiSettings { shaded: 2, spatial: 0, ..plain(Mis::TALBOT) },
        DiSettings { tiles: Some(Tiles { count: 3, size: 64 }), ..by_visibility(Mis::TALBOT) },
    ];
    let still = [
        DiSettings { initial_rays: 3, shaded: 4, ..by_visibility(Mis::PAIRWISE) },
        DiSettings { initial_rays: 2, ..reusing_visibility(Mis::CONTRIBUTION) },
        DiSettings { tiles: Some(Tiles { count: 2, size: 64 }), spatial: 0, shaded: 4, ..by_visibility(Mis::PAIRWISE) },
    ];
    let still = still.map(|settings| DiSettings { still: true, ..small(settings) });
    for settings in rows.map(small).into_iter().chain(still) {
        let verdict = verdict(&moments(&settings, RESTARTS, Flags::default())?)?;
        println!("{settings:?}: {verdict}");
        ensure(verdict.passed(), || format!("{verdict}: {settings:?}"))?;
        ensure(verdict.detectable_in_image <= GOAL_IMAGE, || format!("too few chains: {verdict}"))?;
    }
    Ok(())
}

/// Settings that the host calls biased or refuses, with the direction of their bias.
fn wrong_settings_are_seen() -> Result<(), Failed> {
    let zeroed = |form| DiSettings { visibility_reuse: VisibilityReuse::Candidates, ..plain(form) };
    // visibility in MIS without initial visibility: samples are believed to be visible at their own pixel
    let (none, believed) = (Flags::default(), Flags::MIS_VISIBILITY);
    let rows = [
        ("1/M", zeroed(Mis::ONE_OVER_M), none, -1.0),
        ("constant", zeroed(Mis::CONSTANT), none, -1.0),
        ("no visibility in MIS", zeroed(Mis::PAIRWISE_DEFENSIVE), none, -1.0),
        ("visibility believed", plain(Mis::TALBOT), believed, 1.0),
    ];
    for (what, settings, force, sign) in rows {
        let tested = moments(&small(settings), GROSS, force)?;
        let green = tested.len() - 2;
        let test = ZTest::new(tested[green], reference()?[green]);
        println!("{what}: {:+.2} % of the image, z = {:.1}", 100.0 * test.difference / tested[green].mean(), test.z);
        ensure(test.z * sign > 5.0, || format!("{what}: z = {}", test.z))?;
        ensure(!verdict(&tested)?.passed(), || format!("{what} went unnoticed"))?;
    }
    Ok(())
}
