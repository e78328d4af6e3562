//! The denoiser, on pictures whose right answer is known, and in renders.

use libtest_mimic::Failed;
use restir_host::aov::{Aov, Shot};
use restir_host::buffers::SceneBuffers;
use restir_host::denoise::Denoise;
use restir_host::exec::{CpuExecutor, Executor, GpuExecutor};
use restir_host::image::{Channel, Image};
use restir_host::metrics::compare;
use restir_host::render::Render;
use restir_host::scene::{Camera, Scene};
use restir_host::technique::path::PathSettings;
use restir_shared::denoise::{
    DenoiseParams, Estimate, Guide, History, Reflectance, Track, accumulate, contrast, estimate, filter, modulate,
    share,
};
use restir_shared::glam::{DVec3, Vec3};
use restir_shared::layout::FilmPixel;
use restir_tests::device;
use restir_tests::random::SplitMix;
use restir_tests::suite::{Trial, ensure};

const SIZE: [u32; 2] = [48, 36];
const PIXELS: u32 = SIZE[0] * SIZE[1];
/// What a sum over the picture may be off after five rounds, each of which rounds to 6e-8: with these seeds it is off by 6e-8 at most.
const ROUNDED: f64 = 1.0e-6;
/// Rounds of the filter, as a render has them.
const ROUNDS: u32 = 5;

pub(crate) fn trials() -> Vec<Trial> {
    let mut trials = vec![
        Trial::test("noise on a wall goes, and light stays", a_wall_is_smooth),
        Trial::test("objects keep their light", objects_keep_their_light),
        Trial::test("textures stay", textures_stay),
        Trial::test("black tiles tell nothing of the light", black_tiles_keep_the_light),
        Trial::test("shadows keep their edges", shadows_keep_their_edges),
        Trial::test("a pixel is of the light around it", pixels_are_of_their_neighbourhood),
        Trial::test("fireflies and what is no number stay where they are", fireflies_stay),
        Trial::test("what was not seen before begins anew", what_is_new_begins_anew),
        Trial::test("renders keep their light and lose their noise", renders_keep_their_light),
    ];
    trials.push(Trial::test("images from elsewhere are denoised by their layers", by_layers));
    trials.extend(device::trials(|adapter| {
        vec![
            adapter.trial("the bits of the CPU", same_on_device),
            adapter.trial("the bits of the CPU, by layers", layers_on_device),
        ]
    }));
    trials
}

/// A picture, and what its pixels see.
struct Picture {
    pixels: Vec<FilmPixel>,
    guides: Vec<Guide>,
    tracks: Vec<Track>,
}

/// What a pixel of a picture is: its object, what of light its surface gives back, and the light.
struct Seen {
    object: u32,
    albedo: f32,
    light: f64,
}

impl Picture {
    /// A wall that the camera looks at, with light times the noise of a sample that finds it one time in four.
    fn sampled(seed: u64, seen: impl Fn([u32; 2]) -> Seen) -> Self {
        let mut random = SplitMix::new(seed);
        Self::of(seen, move || if random.unit() < 0.25 { 4.0 } else { 0.0 })
    }

    fn of(seen: impl Fn([u32; 2]) -> Seen, mut noise: impl FnMut() -> f64) -> Self {
        let mut picture = Self { pixels: Vec::new(), guides: Vec::new(), tracks: Vec::new() };
        for at in positions() {
            let Seen { object, albedo, light } = seen(at);
            let reflectance = reflectance(albedo);
            let value = (light * noise()) as f32 * reflectance.channels().x;
            picture.pixels.push(FilmPixel { sum: [value; 3], dropped: 0.0 });
            picture.guides.push(Guide::new(1.0, [0.0; 2], Vec3::Z, object));
            let place = [at[0] as f32 + 0.5, at[1] as f32 + 0.5];
            picture.tracks.push(Track { reflectance, place, inverse_depth: 1.0 });
        }
        picture
    }

    fn accumulated(&self, other_guides: &[Guide], other: &[History], history: f32) -> Vec<History> {
        let params = DenoiseParams { history, ..params(1) };
        let pixel =
            |i: usize| accumulate(&params, self.pixels[i], &self.guides[i], &self.tracks[i], other_guides, other);
        (0..PIXELS as usize).map(pixel).collect()
    }

    /// A single frame, denoised.
    fn denoised(&self) -> Vec<f32> {
        self.filtered(&self.accumulated(&self.guides, &[], 0.0))
    }

    /// Means, denoised.
    fn filtered(&self, means: &[History]) -> Vec<f32> {
        let contrasts: Vec<_> = positions().map(|at| contrast(&params(1), &self.guides, means, at)).collect();
        let estimated = |at| estimate(&params(1), &self.guides, means, &contrasts, at);
        let mut light: Vec<Estimate> = positions().map(estimated).collect();
        for round in 0..ROUNDS {
            let params = params(1 << round);
            let shares: Vec<_> = positions().map(|at| share(&params, &self.guides, means, at)).collect();
            light = positions().map(|at| filter(&params, &self.guides, &light, &shares, at)).collect();
        }
        let pixel = |i: usize| modulate(self.pixels[i], &self.guides[i], &self.tracks[i], &light[i]).sum[0];
        (0..PIXELS as usize).map(pixel).collect()
    }
}

fn positions() -> impl Iterator<Item = [u32; 2]> {
    (0..PIXELS).map(|i| [i % SIZE[0], i / SIZE[0]])
}

fn params(step: u32) -> DenoiseParams {
    let [width, height] = SIZE;
    DenoiseParams { width, height, step, ..DenoiseParams::default() }
}

fn reflectance(albedo: f32) -> Reflectance {
    Reflectance::new(Vec3::splat(albedo))
}

fn mean(values: impl Iterator<Item = f32>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    values.for_each(|value| (sum, count) = (sum + f64::from(value), count + 1.0));
    sum / count
}

fn ensure_near(what: &str, [found, right]: [f64; 2], tolerance: f64) -> Result<(), Failed> {
    ensure((found / right - 1.0).abs() < tolerance, || format!("{what}: {found} instead of {right}"))
}

/// The standard deviation of a pixel is sqrt(3) of its light before; of the mean of the 1728 pixels it is 4.2 %, but mean and picture
/// are compared with the noisy ones, of which no light is lost: rounding alone is between them.
fn a_wall_is_smooth() -> Result<(), Failed> {
    for seed in 0..4 {
        let picture = Picture::sampled(seed, |_| Seen { object: 1, albedo: 0.5, light: 1.0 });
        let denoised = picture.denoised();
        let before = mean(picture.pixels.iter().map(|pixel| pixel.sum[0]));
        ensure_near("mean", [mean(denoised.iter().copied()), before], ROUNDED)?;
        let off = |value: f32| (f64::from(value) / before - 1.0).powi(2);
        let variance = denoised.iter().map(|value| off(*value)).sum::<f64>() / f64::from(PIXELS);
        ensure(variance < 0.03, || format!("a variance of {variance} is left of 3"))?;
    }
    Ok(())
}

/// Two objects, one four times as bright, side by side: each keeps its light to the last bit of its sum, so that the brightness of pixels at the
/// border is that of the rest. Without their numbers it is not, which the test sees.
fn objects_keep_their_light() -> Result<(), Failed> {
    let left = |[x, _]: [u32; 2]| x < SIZE[0] / 2;
    let picture = |objects: [u32; 2]| {
        Picture::sampled(7, |at| {
            let (object, light) = if left(at) { (objects[0], 1.0) } else { (objects[1], 4.0) };
            Seen { object, albedo: 0.5, light }
        })
    };
    let lost = |picture: &Picture| {
        let denoised = picture.denoised();
        let of_left = |values: &mut dyn Iterator<Item = f32>| {
            mean(positions().zip(values).filter(|(at, _)| left(*at)).map(|(_, value)| value))
        };
        let before = of_left(&mut picture.pixels.iter().map(|pixel| pixel.sum[0]));
        (of_left(&mut denoised.iter().copied()) / before - 1.0).abs()
    };
    let [told_apart, as_one] = [[1, 2], [1, 1]].map(|objects| lost(&picture(objects)));
    ensure(told_apart < 1.0e-3 && as_one > 0.05, || format!("the darker one gains {told_apart}, else {as_one}"))
}

/// A checkerboard of dark and bright pixels on one surface, in noisy light: its contrast is that of its colours, whatever is left of the noise.
fn textures_stay() -> Result<(), Failed> {
    let dark = |[x, y]: [u32; 2]| (x + y) % 2 == 0;
    let albedo = |at| if dark(at) { 0.1 } else { 0.8 };
    let picture = Picture::sampled(3, |at| Seen { object: 1, albedo: albedo(at), light: 1.0 });
    let contrast = |picture: &Picture| {
        let denoised = picture.denoised();
        let of =
            |is_dark| mean(positions().zip(&denoised).filter(|(at, _)| dark(*at) == is_dark).map(|(_, value)| *value));
        of(false) / of(true)
    };
    let right = f64::from(reflectance(0.8).channels().x / reflectance(0.1).channels().x);
    ensure_near("contrast", [contrast(&picture), right], 0.02)?;
    let blind = Picture {
        tracks: vec![Track { reflectance: reflectance(0.5), ..picture.tracks[0] }; PIXELS as usize],
        ..picture
    };
    let seen = contrast(&blind);
    ensure(seen < 0.5 * right, || format!("without colours the contrast is {seen} of {right}"))
}

/// A checkerboard of black and white tiles: all light stays on the white ones. Where black tiles count as much as white ones, which are lit as
/// much, half of it goes; the test sees that.
fn black_tiles_keep_the_light() -> Result<(), Failed> {
    let albedo = |[x, y]: [u32; 2]| if (x / 3 + y / 3) % 2 == 0 { 0.0 } else { 0.8 };
    let mut picture = Picture::sampled(13, |at| Seen { object: 1, albedo: albedo(at), light: 1.0 });
    for (pixel, at) in picture.pixels.iter_mut().zip(positions()) {
        pixel.sum = if albedo(at) > 0.0 { pixel.sum } else { [0.0; 3] };
    }
    let before = mean(picture.pixels.iter().map(|pixel| pixel.sum[0]));
    let means = picture.accumulated(&picture.guides, &[], 0.0);
    let after = |means: &[History]| mean(picture.filtered(means).into_iter());
    ensure_near("light", [after(&means), before], ROUNDED)?;
    let alike: Vec<_> = means.iter().map(|mean| History { reflectance: reflectance(0.5), ..*mean }).collect();
    let lost = 1.0 - after(&alike) / before;
    ensure(lost > 0.3, || format!("where black counts as much as white, only {lost} is lost"))
}

/// Light and shadow, with noise of 2 %: the border is as sharp as it was.
fn shadows_keep_their_edges() -> Result<(), Failed> {
    let lit = |[x, _]: [u32; 2]| x < SIZE[0] / 2;
    let mut random = SplitMix::new(5);
    let seen = |at| Seen { object: 1, albedo: 0.5, light: if lit(at) { 1.0 } else { 0.1 } };
    let picture = Picture::of(seen, move || 1.0 + 0.07 * (random.unit() - 0.5));
    let part = f64::from(reflectance(0.5).channels().x);
    let denoised = picture.denoised();
    for column in [0, SIZE[0] / 2 - 2, SIZE[0] / 2 + 1, SIZE[0] - 1] {
        let found = mean(positions().zip(&denoised).filter(|(at, _)| at[0] == column).map(|(_, value)| *value));
        let right = part * if column < SIZE[0] / 2 { 1.0 } else { 0.1 };
        ensure_near(&format!("column {column}"), [found, right], 0.15)?;
    }
    Ok(())
}

/// No pixel is darker or brighter than all that its object has.
fn pixels_are_of_their_neighbourhood() -> Result<(), Failed> {
    let object = |[x, y]: [u32; 2]| 1 + x / 11 + 5 * (y / 9);
    let picture = Picture::sampled(11, |at| Seen { object: object(at), albedo: 0.5, light: f64::from(object(at)) });
    let denoised = picture.denoised();
    for (at, value) in positions().zip(&denoised) {
        let others = positions().zip(&picture.pixels).filter(|(other, _)| object(*other) == object(at));
        let range = others
            .fold([f32::INFINITY, 0.0], |[low, high], (_, pixel)| [low.min(pixel.sum[0]), high.max(pixel.sum[0])]);
        let within = range[0] <= *value && *value <= range[1] * (1.0 + 1.0e-5);
        ensure(within, || format!("{at:?} is {value}, its object has {range:?}"))?;
    }
    Ok(())
}

fn fireflies_stay() -> Result<(), Failed> {
    let [firefly, nan] = [20 * SIZE[0] + 20, 9 * SIZE[0] + 33].map(|index| index as usize);
    let mut random = SplitMix::new(5);
    let seen = |_| Seen { object: 1, albedo: 0.5, light: 1.0 };
    let mut picture = Picture::of(seen, move || 0.5 + random.unit());
    picture.pixels[firefly].sum = [1.0e4; 3];
    picture.pixels[nan].sum = [f32::NAN, 1.0, f32::INFINITY];
    let denoised = picture.denoised();
    ensure(denoised[firefly] == 1.0e4 && denoised[nan].is_nan(), || {
        format!("{} {}", denoised[firefly], denoised[nan])
    })?;
    let others = denoised.iter().enumerate().filter(|(index, _)| ![firefly, nan].contains(index));
    let brightest = others.fold(0.0, |most: f32, (_, value)| if *value > most { *value } else { most });
    ensure(brightest < 1.5, || format!("{brightest} beside a firefly"))?;
    let numbers = denoised.iter().filter(|value| value.is_finite()).count();
    ensure(numbers + 1 == PIXELS as usize, || format!("{numbers} pixels are numbers"))
}

/// Frames add up where the last frame saw the same surface, and nowhere else: not where another object was, what lay outside of the image,
/// nor after a cut.
fn what_is_new_begins_anew() -> Result<(), Failed> {
    let seen = |object| move |_: [u32; 2]| Seen { object, albedo: 0.5, light: 1.0 };
    let mut picture = Picture::sampled(1, seen(1));
    let guides = picture.guides.clone();
    let mut means = picture.accumulated(&guides, &vec![History::default(); PIXELS as usize], 0.0);
    for _ in 0..10 {
        means = picture.accumulated(&guides, &means, 8.0);
    }
    ensure(means.iter().all(|mean| mean.frames == 8.0), || "a history of 8 frames is not full after 10".to_owned())?;
    let ages = |picture: &Picture, history| {
        let now = picture.accumulated(&guides, &means, history);
        [0, SIZE[0] as usize - 1].map(|x| now[4 * SIZE[0] as usize + x].frames)
    };
    ensure(ages(&picture, 0.0) == [1.0; 2], || "a cut keeps its history".to_owned())?;
    let other = Picture::sampled(1, seen(2));
    ensure(ages(&other, 8.0) == [1.0; 2], || "an object has the history of another one".to_owned())?;
    let nearer = |track: &mut Track| track.inverse_depth = 1.1;
    let mut moved = Picture::sampled(1, seen(1));
    moved.tracks.iter_mut().for_each(nearer);
    ensure(ages(&moved, 8.0) == [1.0; 2], || "a surface has the history of one that was behind it".to_owned())?;
    // what comes in at the left edge is new
    picture.tracks.iter_mut().for_each(|track| track.place[0] -= 1.5);
    let ages = ages(&picture, 8.0);
    ensure(ages == [1.0, 8.0], || format!("ages {ages:?}"))
}

/// A camera that steps aside, before the last frame most.
fn camera(scene: &SceneBuffers, frame: u32) -> Camera {
    let aside = DVec3::X * 0.03 * f64::from(frame * frame);
    Camera { position: scene.camera.position + aside, ..scene.camera }
}

fn render(scene: &SceneBuffers, name: &str, count: u32, denoise: Option<Denoise>) -> Result<Render, Failed> {
    let technique = restir_host::technique::named(name)?;
    let cameras = (0..count).map(|frame| camera(scene, frame)).collect();
    Ok(Render { count, cameras, denoise, ..Render::new([32, 24], technique) })
}

/// No light is lost in `cornell`, nor in `ajar`, whose floor has dark and bright tiles and where a sample in a thousand finds the lamp; .1 % may
/// be as reflectances are rounded. In `tower` most pixels see the sky, lamps or several bricks: what they mix must not go to those that do not,
/// which once made the error twice as large.
fn renders_keep_their_light() -> Result<(), Failed> {
    let mut cpu = CpuExecutor::new()?;
    for (name, jitter, left) in [("cornell", false, 0.2), ("ajar", false, 0.1), ("tower", true, 0.5)] {
        let scene = SceneBuffers::build(&Scene::load(name)?)?;
        let settings = PathSettings { jitter, max_depth: 4, ..PathSettings::default() };
        let noisy = Render { count: 2, ..Render::new([96, 72], settings) };
        let mut image = |render: Render| -> Result<Image, Failed> { Ok(render.render(&scene, &mut cpu)?.image) };
        let reference = image(Render { count: 512, seed: 1, ..noisy.clone() })?;
        let [before, after] = [None, Some(Denoise::default())].map(|denoise| Render { denoise, ..noisy.clone() });
        let [before, after] = [image(before)?, image(after)?];
        ensure_near(name, [compare(&after, &before)?.mean_ratio, 1.0], 1.0e-3)?;
        let [before, after] = [compare(&before, &reference)?.rel_mse, compare(&after, &reference)?.rel_mse];
        ensure(after < left * before, || format!("{name}: an error of {after} is left of {before}"))?;
    }
    Ok(())
}

/// An image of `cornell` with the layers of its scene.
fn layered(samples: u32) -> Result<(Image, Vec<Channel>, Image), Failed> {
    let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
    let job =
        Render { count: samples, ..Render::new([96, 72], PathSettings { max_depth: 4, ..PathSettings::default() }) };
    let mut cpu = CpuExecutor::new()?;
    let image = job.render(&scene, &mut cpu)?.image;
    let reference = Render { count: 512, seed: 1, ..job.clone() }.render(&scene, &mut cpu)?.image;
    let (camera, integral) = (|_| scene.camera, job.technique.integral());
    let shot = Shot { scene: &scene, frame: 0.0, camera: &camera, size: [96, 72], seed: 0, integral, samples };
    let layers: Vec<Aov> = Denoise::NEEDS.into_iter().chain(Denoise::KNOWS).collect();
    Ok((image, shot.channels(&layers)?, reference))
}

/// Without the numbers of objects light goes from the lamp to the ceiling, which the test sees; without a layer that is needed, and of one
/// of another size, a sentence says so.
fn by_layers() -> Result<(), Failed> {
    let (image, layers, reference) = layered(8)?;
    let mut cpu = CpuExecutor::new()?;
    let mut denoised = |layers: &[Channel]| Denoise::default().image(&image, layers, &mut cpu);
    let without = |names: &[&str]| -> Vec<Channel> {
        layers.iter().filter(|layer| !names.contains(&layer.name)).cloned().collect()
    };
    let known = denoised(&layers)?;
    let unknown = denoised(&without(Aov::Id.channels()))?;
    ensure_near("light", [compare(&known, &image)?.mean_ratio, 1.0], 1.0e-3)?;
    let [before, known, unknown] = [&image, &known, &unknown].map(|image| compare(image, &reference));
    let [before, known, unknown] = [before?.rel_mse, known?.rel_mse, unknown?.rel_mse];
    ensure(known < 0.6 * before && unknown > 2.0 * known, || {
        format!("{before} before, {known} after, {unknown} without objects")
    })?;
    let missing = denoised(&without(&["Depth.Z"])).err().map(|error| error.to_string()).unwrap_or_default();
    ensure(missing.contains("no channel \"Depth.Z\""), || format!("without depth: {missing}"))?;
    let mut short = layers.clone();
    short.iter_mut().for_each(|layer| layer.values.truncate(7));
    ensure(denoised(&short).is_err(), || "layers of another size are taken".to_owned())?;
    let odd = [Image::default(), Image { height: 9, ..image.clone() }];
    let taken = odd.iter().filter(|odd| Denoise::default().image(odd, &layers, &mut cpu).is_ok()).count();
    ensure(taken == 0, || "images without their pixels are taken".to_owned())
}

fn layers_on_device(executor: &mut GpuExecutor) -> Result<(), Failed> {
    let (image, layers, _) = layered(2)?;
    let denoise = Denoise::default();
    let host = denoise.image(&image, &layers, &mut CpuExecutor::new()?)?;
    let compared = compare(&denoise.image(&image, &layers, executor)?, &host)?;
    ensure(compared.identical, || format!("{} words differ", compared.differing_words))
}

/// Renders of any technique, whatever moves; a history of the frames before is in the last one. `slab` has light of 1e-9, of which squares are hardly
/// numbers.
fn same_on_device(executor: &mut GpuExecutor) -> Result<(), Failed> {
    for technique in restir_host::technique::all() {
        let name = technique.about().name;
        for of in ["moving", "slab"] {
            let scene = SceneBuffers::build(&Scene::load(of)?)?;
            let render = render(&scene, name, 4, Some(Denoise::default()))?;
            let image = |executor: &mut dyn Executor| render.render(&scene, executor).map(|rendered| rendered.image);
            let [host, device] = [image(&mut CpuExecutor::new()?)?, image(executor)?];
            let compared = compare(&device, &host)?;
            ensure(compared.identical, || format!("{name}, {of}: {} words differ", compared.differing_words))?;
        }
    }
    Ok(())
}
