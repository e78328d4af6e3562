//! Averaged visibility (Tokuyoshi): what it leaves as it is, what it costs, what it gains, and where it is biased.
//!
//! Tests of expectations have fixed seeds: a failure is a bug.

use libtest_mimic::Failed;
use restir_host::buffers::SceneBuffers;
use restir_host::exec::{CpuExecutor, Executor};
use restir_host::plan::Pass;
use restir_host::render::Render;
use restir_host::replay::{Event, Recording};
use restir_host::settings::Choice as _;
use restir_host::technique::restir_di::{DiSettings, Target, Temporal, Visibility, VisibilityReuse};
use restir_kernels::KernelDesc;
use restir_kernels::restir_di::{di_combine, di_initial, di_shade};
use restir_shared::camera::camera_ray;
use restir_shared::geometry::Ray;
use restir_shared::glam::Vec3;
use restir_shared::layout::FilmPixel;
use restir_shared::rng::{Rng, Sampler};
use restir_shared::scene::{
    AddressedLights, AnyFrames, AnyScene, LightAddress, SceneView, Still, Surface, SurfacePoint,
};
use restir_shared::technique::restir_di::{self as technique, DiParams, Flags, PackedHit, PackedReservoir, Stored};
use restir_tests::bias::{ensure_biased, ensure_unbiased, path_moments};
use restir_tests::native::plan;
use restir_tests::scenes::{BOARD, Setting, coloured, path_params, penumbra, white};
use restir_tests::stats::{Moments, TileGrid, TileTest, Verdict, ZTest};
use restir_tests::suite::ensure;
use restir_tests::technique::configure_by;
use restir_tests::visibility::{Restart, Run, settings, visibility_moments, without_visibility};
use std::cell::Cell;
use std::sync::OnceLock;

/// How often a z-test of equal expectations, over tiles, channels and the image, fails.
const FAMILY_RATE: f64 = 1.0e-3;
const SIZE: [u32; 2] = [16, 16];
const TEST: TileTest =
    TileTest { grid: TileGrid { width: SIZE[0], height: SIZE[1], tile: 4 }, family_rate: FAMILY_RATE };
const RESTARTS: u32 = 96;
/// Samples of a reference's pixel.
const REFERENCE: u32 = 4096;
/// A bias of the image's mean that must be noticed with 99 % probability.
const GOAL_IMAGE: f64 = 0.01;
/// How many times less visibility varies at least; the measured ratios are 2.6 and more.
const REDUCTION: f64 = 1.5;
/// Standard errors of a sign that is claimed: one test in 740 is wrong.
const SIGN: f64 = 3.0;

restir_tests::suite! {
    later {
        sample_weight_and_confidence_do_not_know_of_the_averaging
        the_average_is_the_weighted_mean_and_costs_one_ray_a_neighbour rays_of_each_pass visibility_varies_less
        static_white_light_is_unbiased coloured_light_leaks_unless_each_channel_has_its_own_target
        visibility_reuse_darkens believing_near_neighbours_brightens a_shadow_that_arrives_lags_by_the_cap
    }
}

/// The parameters of a pass, if it is one of that kernel.
fn params_of(kernel: &KernelDesc, pass: &Pass) -> Option<DiParams> {
    pass.params().filter(|_| pass.kernel.name == kernel.name)
}

/// Every plane of reservoirs that a pass has made.
fn reservoirs(buffers: &SceneBuffers, run: &Run, seed: u32) -> Result<Vec<Vec<PackedReservoir>>, Failed> {
    let mut planes = Vec::new();
    let render = run.render(seed);
    CpuExecutor::inline().run_observed(plan(buffers, &render), &mut |step| {
        if [&di_initial::DESC, &di_combine::DESC].iter().any(|kernel| params_of(kernel, step.pass).is_some()) {
            planes.push(step.plane("reservoirs")?);
        }
        Ok(())
    })?;
    Ok(planes)
}

fn sample_weight_and_confidence_do_not_know_of_the_averaging() -> Result<(), Failed> {
    let buffers = penumbra(coloured).buffers();
    for row in [
        "",
        "visibility_reuse=off",
        "neighbours=3,spatial=2,mis=pairwise,scatter=on",
        "temporal=fused,neighbours=4,mis=pairwise-defensive,feedback=off",
    ] {
        let of = |visibility, seed| {
            let mut settings = settings(visibility);
            configure_by(&mut settings, row)?;
            reservoirs(&buffers, &Run { size: [24, 24], frames: 6, from: 0, settings }, seed)
        };
        let bare =
            |planes: &[Vec<PackedReservoir>]| planes.concat().into_iter().map(without_visibility).collect::<Vec<_>>();
        let averaged = of(Visibility::Averaged, 3)?;
        let selected = of(Visibility::Selected, 3)?;
        let differ = averaged.concat().iter().zip(selected.concat()).filter(|(a, b)| *a != b).count();
        ensure(differ > 0, || "no visibility was averaged".to_owned())?;
        for other in [selected, of(Visibility::Ray, 3)?] {
            ensure(bare(&averaged) == bare(&other), || format!("sample, weight or confidence differ: {row}"))?;
        }
        ensure(bare(&averaged) != bare(&of(Visibility::Averaged, 4)?), || "seeds do nothing".to_owned())?;
        println!("{} reservoirs alike, {differ} visibilities not", bare(&averaged).len());
    }
    Ok(())
}

/// An input of a combine, in f64.
struct Input {
    pixel: usize,
    stored: Stored,
    visibility: f64,
}

/// What combines with Talbot's weights are checked against.
struct Offline<'a> {
    view: &'a SceneView<'a>,
    points: Vec<(SurfacePoint, Ray)>,
    width: u32,
}

impl<'a> Offline<'a> {
    fn new(view: &'a SceneView<'a>, p: &DiParams, hits: &[PackedHit]) -> Self {
        let point = |(i, hit): (u32, &PackedHit)| {
            let [x, y] = [i % p.width, i / p.width];
            let rng = Rng::new(x, y, p.frame, p.seed, Sampler::Independent);
            let ray = camera_ray(&p.camera, false, |u| u, 0, &rng, x, y);
            (view.surface(&ray, &hit.unpack()), ray)
        };
        Self { view, points: (0..).zip(hits).map(point).collect(), width: p.width }
    }

    /// The target of an address at a pixel, but for the reflectance, which is everywhere the same.
    fn target(&self, pixel: usize, address: LightAddress) -> f64 {
        if !address.is_light() {
            return 0.0;
        }
        let wide = |v: Vec3| v.as_dvec3();
        let light = self.view.light_at(address);
        let (point, ray) = &self.points[pixel];
        let way = wide(light.sample.position) - wide(point.position);
        let normal = wide(point.normal) * -wide(point.normal).dot(wide(ray.direction)).signum();
        let cosines = normal.dot(way).max(0.0) * (-wide(light.sample.normal).dot(way)).max(0.0);
        let emission = wide(light.sample.emission);
        let luminance = 0.2126 * emission.x + 0.7152 * emission.y + 0.0722 * emission.z;
        luminance * f64::from(light.extent) * cosines / way.length_squared().powi(2)
    }

    /// The inputs, from what the combine has asked, and the shadow rays that it may trace.
    fn inputs(
        &self,
        at: usize,
        own: PackedReservoir,
        others: &[PackedReservoir],
        events: &[Event],
        cap: Option<f32>,
    ) -> Option<(Vec<Input>, usize)> {
        let first = events.iter().position(|event| matches!(event, Event::LightSample(_)))?;
        let seen: Vec<Vec3> = events[..first]
            .iter()
            .filter_map(|event| if let Event::Surface(point) = event { Some(point.position) } else { None })
            .collect();
        // the pixel itself comes first, and once more when its row begins
        let neighbours = &seen[1..seen.len() - 1];
        let find = |position: &Vec3| self.points.iter().position(|(point, _)| point.position == *position);
        let mut inputs = vec![Input { pixel: at, stored: Stored::unpack(own), visibility: 0.0 }];
        for position in neighbours {
            let pixel = find(position)?;
            let stored = Stored::unpack(others[pixel]);
            let confidence = cap.map_or(stored.confidence, |cap| stored.confidence.min(cap));
            inputs.push(Input { pixel, stored: Stored { confidence, ..stored }, visibility: 0.0 });
        }
        // all samples are evaluated at the pixel before the first ray goes out
        let evaluated = inputs.iter().filter(|input| input.stored.has_sample()).count();
        let mut traced = events[first..].iter().skip(evaluated);
        let mut rays = 0;
        for (i, input) in inputs.iter_mut().enumerate() {
            input.visibility = f64::from(input.stored.visibility.x);
            let sample = input.stored.sample;
            if input.stored.has_sample() && i > 0 && cap.is_none() && self.target(at, sample) > 0.0 {
                rays += 1;
                if let Some(Event::Occluded { occluded, .. }) = traced.next() {
                    input.visibility = if *occluded { 0.0 } else { 1.0 };
                }
            }
        }
        Some((inputs, rays))
    }

    /// Talbot's weights.
    fn weights(&self, inputs: &[Input]) -> Vec<f64> {
        let weight = |input: &Input| {
            if !input.stored.has_sample() {
                return 0.0;
            }
            let shared = |j: &Input| f64::from(j.stored.confidence) * self.target(j.pixel, input.stored.sample);
            let sum: f64 = inputs.iter().map(shared).sum();
            if sum == 0.0 {
                return 0.0;
            }
            let target = self.target(inputs[0].pixel, input.stored.sample);
            shared(input) / sum * target * f64::from(input.stored.contribution_weight)
        };
        inputs.iter().map(weight).collect()
    }
}

/// Sums over the combines of a run.
#[derive(Default)]
struct Tally {
    combines: usize,
    between: usize,
    wrong_forms: [usize; 2],
    failures: Vec<String>,
}

impl Tally {
    /// Checks one combine: the stored visibility lies within the rounding of a half (Tokuyoshi, eq. 4), sample and
    /// contribution weight are the selection's.
    fn check(&mut self, offline: &Offline<'_>, inputs: &[Input], made: PackedReservoir) {
        let weights = offline.weights(inputs);
        let sum: f64 = weights.iter().sum();
        let mean = |weights: &[f64]| {
            let sum: f64 = weights.iter().sum();
            inputs.iter().zip(weights).map(|(input, w)| w * input.visibility).sum::<f64>() / sum
        };
        let made = Stored::unpack(made);
        self.combines += 1;
        if sum == 0.0 {
            if made.visibility != Vec3::ZERO || made.contribution_weight != 0.0 {
                self.failures.push(format!("nothing competes, and {made:?} is kept"));
            }
            return;
        }
        // of a half: 2^-11; of the weights in f32: some roundings
        let agrees = |mean: f64| (f64::from(made.visibility.x) - mean).abs() <= mean * 2.0_f64.powi(-11) + 2.0e-5;
        let v = mean(&weights);
        self.between += usize::from(v > 0.01 && v < 0.99);
        let equal = vec![1.0; inputs.len()];
        let unshared: Vec<f64> = inputs
            .iter()
            .map(|i| offline.target(inputs[0].pixel, i.stored.sample) * f64::from(i.stored.contribution_weight))
            .collect();
        for (count, wrong) in self.wrong_forms.iter_mut().zip([equal, unshared]) {
            *count += usize::from(!agrees(mean(&wrong)));
        }
        let target = offline.target(inputs[0].pixel, made.sample);
        let is_input = inputs.iter().any(|input| input.stored.sample == made.sample);
        let weight = target * f64::from(made.contribution_weight);
        if !agrees(v) || !is_input || (weight - sum).abs() > 1.0e-4 * sum {
            self.failures
                .push(format!("{made:?} of {} inputs, expected visibility {v}, weight sum {sum}", inputs.len()));
        }
    }
}

fn the_average_is_the_weighted_mean_and_costs_one_ray_a_neighbour() -> Result<(), Failed> {
    let setting = Setting { size: [12, 12], ..penumbra(coloured) };
    let buffers = setting.buffers();
    let view = buffers.view();
    // a still view would not ask for the last frame's surfaces
    let wide = "still=off,max_plane_distance=1000,min_normal_cos=-1";
    for row in ["", "visibility_reuse=off", "visibility_reuse=off,neighbours=3"] {
        let mut settings = settings(Visibility::Averaged);
        configure_by(&mut settings, &format!("{wide},{row}"))?;
        let run = Run { size: setting.size, frames: 5, from: 0, settings };
        let (mut tally, mut offline, mut rays) = (Tally::default(), None, [0, 0]);
        let mut initial = Vec::new();
        let render = run.render(7);
        CpuExecutor::inline().run_observed(plan(&buffers, &render), &mut |step| {
            if params_of(&di_initial::DESC, step.pass).is_some() {
                initial = step.plane("reservoirs")?;
            }
            let Some(p) = params_of(&di_combine::DESC, step.pass) else { return Ok(()) };
            let [hits, other_hits] = [step.plane("hits")?, step.plane("other_hits")?];
            let [others, made] = [step.plane("others")?, step.plane("reservoirs")?];
            let offline = offline.get_or_insert_with(|| Offline::new(&view, &p, &hits));
            let temporal = p.flags.contains(Flags::OTHER_FRAME);
            for at in 0..made.len() {
                let own = if temporal { initial[at] } else { others[at] };
                let recording = Recording::new(&view);
                let planes = technique::Planes { hits: &hits, other_hits: &other_hits, others: &others };
                let place = [at as u32 % offline.width, at as u32 / offline.width];
                if technique::combine(Still(&recording), &p, &planes, own, place).reservoir != made[at] {
                    tally.failures.push("a combine alone is not what it is in a frame".to_owned());
                }
                rays[0] += recording.counts().shadow as usize;
                let cap = temporal.then_some(p.confidence_cap);
                if let Some((inputs, asked)) = offline.inputs(at, own, &others, &recording.into_events(), cap) {
                    rays[1] += asked;
                    tally.check(offline, &inputs, made[at]);
                }
            }
            Ok(())
        })?;
        let Tally { combines, between, wrong_forms: [equal, unshared], failures } = tally;
        println!(
            "{combines} combines, {between} of them with a mean between; an equal mean would be off in {equal}, one \
             without MIS in {unshared}; {} shadow rays",
            rays[0]
        );
        ensure(failures.is_empty(), || format!("{} of {combines} combines: {}", failures.len(), failures[0]))?;
        ensure(rays[0] == rays[1] && rays[0] > 0, || format!("{} shadow rays instead of {}", rays[0], rays[1]))?;
        ensure(between > 100 && equal > 100 && unshared > 100, || "too little is shown".to_owned())?;
    }
    Ok(())
}

/// Shadow rays of the passes, for each pixel and frame: initial, temporal, spatial, shading.
fn shadow_rays(buffers: &SceneBuffers, settings: DiSettings) -> Result<[f64; 4], Failed> {
    let run = Run { size: SIZE, frames: 9, from: 0, settings };
    let view = buffers.view();
    let recording = Recording::new(&view);
    let mut rays = [0; 4];
    let render = run.render(1);
    CpuExecutor::run_over_observed(&Still(&recording), plan(buffers, &render), &mut |step| {
        let is_temporal = |p: DiParams| p.flags.contains(Flags::OTHER_FRAME);
        let kind = match step.pass.kernel.name {
            name if name == di_initial::DESC.name => 0,
            name if name == di_shade::DESC.name => 3,
            _ if params_of(&di_combine::DESC, step.pass).is_some_and(is_temporal) => 1,
            _ => 2,
        };
        rays[kind] += recording.take_counts().shadow;
        Ok(())
    })?;
    Ok(rays.map(|count| count as f64 / (run.pixels() as f64 * f64::from(run.frames))))
}

fn rays_of_each_pass() -> Result<(), Failed> {
    let buffers = penumbra(white).buffers();
    let of = |visibility| {
        shadow_rays(&buffers, DiSettings { visibility_reuse: VisibilityReuse::Off, ..settings(visibility) })
    };
    let (ray, selected, averaged) = (of(Visibility::Ray)?, of(Visibility::Selected)?, of(Visibility::Averaged)?);
    println!("initial, temporal, spatial, shading: {ray:?} with a final ray, {selected:?}, averaged {averaged:?}");
    ensure(averaged == selected, || "averaging is not free".to_owned())?;
    ensure(averaged[1] == 0.0 && averaged[3] == 0.0, || "history and shading ask for visibility".to_owned())?;
    ensure(averaged[0] > 0.95 && averaged[0] <= 1.0, || format!("{} initial rays", averaged[0]))?;
    ensure(averaged[2] > 0.8 && averaged[2] <= 1.0, || format!("{} spatial rays", averaged[2]))?;
    ensure(ray[..3] == [0.0; 3] && ray[3] > 0.95 && ray[3] <= 1.0, || "a final ray is one a pixel".to_owned())?;
    let with_reuse = shadow_rays(&buffers, settings(Visibility::Averaged))?;
    ensure(with_reuse[0] == averaged[0], || "visibility reuse costs more than the initial ray".to_owned())?;
    let near = DiSettings { near_radius: 100.0, ..settings(Visibility::Averaged) };
    ensure(shadow_rays(&buffers, near)?[2] == 0.0, || "near neighbours cost rays".to_owned())
}

/// The mean variance of the visibility of both, over the pixels where the first's is partial, and how many these are.
fn variances(restarts: &[Vec<Restart>; 2]) -> ([f64; 2], usize) {
    let moments = restarts.each_ref().map(|restarts| visibility_moments(restarts));
    let partial: Vec<usize> = (0..moments[0].len()).filter(|&i| (0.05..0.95).contains(&moments[0][i].mean())).collect();
    let mean = |m: &Vec<Moments>| partial.iter().map(|&i| m[i].variance()).sum::<f64>() / partial.len() as f64;
    (moments.each_ref().map(mean), partial.len())
}

fn visibility_varies_less() -> Result<(), Failed> {
    let buffers = penumbra(white).buffers();
    for visibility_reuse in [VisibilityReuse::Candidates, VisibilityReuse::Off] {
        let restarts = [Visibility::Selected, Visibility::Averaged].map(|visibility| {
            let settings = DiSettings { visibility_reuse, ..settings(visibility) };
            Run { size: SIZE, frames: 8, from: 7, settings }.restarts(&buffers, 32)
        });
        let ([selected, averaged], pixels) = variances(&restarts);
        println!(
            "{visibility_reuse:?}: variance {selected:.4} selected, {averaged:.4} averaged, ratio \
             {:.2} over {pixels} pixels",
            selected / averaged
        );
        ensure(pixels >= 20 && selected >= REDUCTION * averaged, || "visibility does not vary less".to_owned())?;
    }
    Ok(())
}

/// Path tracing of one bounce in white light.
fn white_reference() -> &'static [Moments] {
    static MOMENTS: OnceLock<Vec<Moments>> = OnceLock::new();
    MOMENTS.get_or_init(|| reference(&penumbra(white).buffers()))
}

/// Path tracing of one bounce.
fn reference(buffers: &SceneBuffers) -> Vec<Moments> {
    path_moments(TEST.grid, REFERENCE, &buffers.view(), path_params(buffers, SIZE, 2))
}

fn moments(restarts: &[Restart]) -> Vec<Moments> {
    TEST.grid
        .moments(restarts.len() as u32, |restart, x, y| restarts[restart as usize].image[(y * SIZE[0] + x) as usize])
}

fn verdict(buffers: &SceneBuffers, settings: DiSettings, reference: &[Moments]) -> Verdict {
    let run = Run { size: SIZE, frames: 6, from: 2, settings };
    TEST.compare(&moments(&run.restarts(buffers, RESTARTS)), reference)
}

/// Of Tokuyoshi's unbiased variant: reuse over time, or once in space.
fn unbiased(visibility: Visibility) -> [(&'static str, DiSettings); 2] {
    let base = DiSettings { visibility_reuse: VisibilityReuse::Off, ..settings(visibility) };
    [
        ("temporal", DiSettings { spatial: 0, ..base.clone() }),
        ("spatial", DiSettings { temporal: Temporal::Off, neighbours: 3, ..base }),
    ]
}

fn static_white_light_is_unbiased() -> Result<(), Failed> {
    let buffers = penumbra(white).buffers();
    for visibility in [Visibility::Selected, Visibility::Averaged] {
        for (name, settings) in unbiased(visibility) {
            let verdict = verdict(&buffers, settings, white_reference());
            ensure_unbiased(&format!("{name}, {}", visibility.name()), &verdict, GOAL_IMAGE)?;
        }
    }
    Ok(())
}

fn coloured_light_leaks_unless_each_channel_has_its_own_target() -> Result<(), Failed> {
    let buffers = penumbra(coloured).buffers();
    let reference = reference(&buffers);
    let [(_, temporal), _] = unbiased(Visibility::Averaged);
    let leaking = verdict(&buffers, temporal.clone(), &reference);
    ensure_biased("a leak by luminance", &leaking)?;
    let channels = [Target::Red, Target::Green, Target::Blue].map(|target| {
        let run = Run { size: SIZE, frames: 6, from: 2, settings: DiSettings { target, ..temporal.clone() } };
        moments(&run.restarts(&buffers, RESTARTS))
    });
    let own: Vec<Moments> = (0..reference.len()).map(|i| channels[i % 3][i]).collect();
    ensure_unbiased("by channel", &TEST.compare(&own, &reference), f64::INFINITY)
}

/// The mean of each restart's image.
fn image_means(restarts: &[Restart]) -> impl Iterator<Item = f64> {
    restarts.iter().map(|restart| restart.image.iter().flatten().sum::<f64>() / (3 * restart.image.len()) as f64)
}

fn visibility_reuse_darkens() -> Result<(), Failed> {
    let buffers = penumbra(white).buffers();
    let reference = *white_reference().last().ok_or("no image")?;
    for visibility in [Visibility::Selected, Visibility::Averaged] {
        let run = Run { size: SIZE, frames: 6, from: 2, settings: settings(visibility) };
        let mean: Moments = image_means(&run.restarts(&buffers, RESTARTS)).collect();
        let ZTest { difference, z, .. } = ZTest::new(mean, reference);
        println!("{}: {:+.2} %, z {z:.1}", visibility.name(), 100.0 * difference / reference.mean());
        ensure(z < -SIGN, || format!("{} is not darker: z {z}", visibility.name()))?;
    }
    Ok(())
}

fn believing_near_neighbours_brightens() -> Result<(), Failed> {
    let buffers = penumbra(white).buffers();
    let of = |near_radius| {
        let settings = DiSettings { near_radius, ..settings(Visibility::Averaged) };
        let run = Run { size: SIZE, frames: 6, from: 2, settings };
        image_means(&run.restarts(&buffers, 64)).collect::<Vec<_>>()
    };
    let sweep = [0.0, 2.5, 3.5, 100.0].map(of);
    for pair in sweep.windows(2) {
        let step: Moments = pair[1].iter().zip(&pair[0]).map(|(more, less)| more - less).collect();
        let z = step.mean() / step.standard_error();
        println!("+{:.5}, z {z:.1}", step.mean());
        ensure(z > SIGN, || format!("no brighter: z {z}"))?;
    }
    Ok(())
}

/// One scene, then another, with the same surfaces in sight.
struct Switched<'a> {
    scenes: [SceneView<'a>; 2],
    now: Cell<usize>,
}

impl AnyFrames for Switched<'_> {
    fn scene(&self, _other: bool) -> &dyn AnyScene {
        &self.scenes[self.now.get()]
    }

    fn counterpart(&self, address: LightAddress, _of_other: bool) -> LightAddress {
        address
    }
}

/// The scene with its board elsewhere, out of sight: far from all light, or before all lights.
fn with_board(before_lights: bool) -> SceneBuffers {
    let mut setting = penumbra(white);
    let lift = if before_lights { 0.0 } else { 3.0 };
    let corner = |across: f32, along: f32| [1.6 * across, 1.36 - 0.18 * along + lift, 1.02 + 0.24 * along];
    setting.quads[BOARD].corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    setting.buffers()
}

/// The image's mean in each frame; all light goes out of sight after `open` frames.
fn shut(settings: DiSettings, open: u32, frames: u32) -> Result<Vec<f64>, Failed> {
    let (bright, dark) = (with_board(false), with_board(true));
    let scene = Switched { scenes: [bright.view(), dark.view()], now: Cell::new(0) };
    let mut means = Vec::new();
    let render = Render { count: frames, accumulate: true, ..Render::new(SIZE, settings) };
    CpuExecutor::run_over_observed(&scene, plan(&bright, &render), &mut |step| {
        if let Some(p) = params_of(&di_shade::DESC, step.pass) {
            means.push(step.plane::<FilmPixel>("film")?.iter().map(|pixel| f64::from(pixel.sum[0])).sum());
            scene.now.set(usize::from(p.frame + 1 >= open));
        }
        Ok(())
    })?;
    Ok(means)
}

fn a_shadow_that_arrives_lags_by_the_cap() -> Result<(), Failed> {
    let (open, frames, cap) = (8, 16, 4_u32);
    let share = f64::from(cap) / f64::from(cap + 1);
    for (visibility, visibility_reuse, keeps) in [
        (Visibility::Averaged, VisibilityReuse::Candidates, true),
        (Visibility::Selected, VisibilityReuse::Candidates, true),
        (Visibility::Averaged, VisibilityReuse::Off, true),
        (Visibility::Ray, VisibilityReuse::Candidates, false),
    ] {
        let settings = DiSettings { visibility_reuse, spatial: 0, confidence_cap: cap, ..settings(visibility) };
        let means = shut(settings, open, frames)?;
        let before = means[open as usize - 1];
        let ratios: Vec<f64> = means[open as usize..].iter().map(|mean| mean / before).collect();
        println!("{}, {visibility_reuse:?}: {ratios:.4?}", visibility.name());
        for (n, ratio) in (1..).zip(&ratios) {
            // what was believed keeps the history's share in every frame; halves round by 2^-11 in each
            let expected = if keeps { share.powi(n) } else { 0.0 };
            let tolerance = expected * 2.0_f64.powi(-11) * f64::from(n) + 1.0e-6;
            ensure((ratio - expected).abs() <= tolerance, || format!("after {n} frames {ratio}, expected {expected}"))?;
        }
    }
    Ok(())
}
