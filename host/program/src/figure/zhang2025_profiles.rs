//! Zhang and d'Eon 2025: where diffusion profiles fail, what the hybrid makes of it, and what each part costs.

use std::fmt::Write;
use std::sync::Arc;

use restir::image::Image;
use restir::render::{self, Render};
use restir::scene::{Mesh, Scene, builtin};
use restir::technique::asked::asked;
use restir::technique::path::{Parts, PathSettings, Subsurface};
use restir::{Error, buffers::SceneBuffers, replay::Counts};
use restir_shared::diffusion::{REACH, Shape, ccdf, diffuse_albedo, radial_profile};
use restir_shared::glam::{DVec3, Vec3};

use super::claim::{self, Claim};
use super::landing::{self, Landed};
use super::picture::grid;
use super::scenes;
use super::zhang2025_walk::{ALBEDOS, Enters, RINGS, ring, rings};
use super::{Environs, Files, PICTURE};
use crate::bench::plot::{self, Line, Panel};
use crate::bench::table::Setup;

/// Pixels along a side of the tiles that are compared.
const TILE: usize = 8;
/// How far the front of a cube is from its back, which stays where it is.
const DEEP: f64 = 1.0;

/// A body: a built-in scene filled with a medium, of which a millimetre is so many units long.
struct Body {
    scene: &'static str,
    medium: &'static str,
    millimetre: f64,
    /// Of the cube.
    depth: f64,
}

const fn cube(millimetre: f64, depth: f64) -> Body {
    Body { scene: "cube", medium: "wax", millimetre, depth }
}

/// The cube of denser and of thinner wax, the cube that becomes a slab, and statues.
const BODIES: [Body; 8] = [
    cube(0.005, DEEP),
    cube(0.02, DEEP),
    cube(0.1, DEEP),
    cube(0.02, 0.4),
    cube(0.02, 0.1),
    cube(0.02, 0.03),
    Body { scene: "statue", medium: "skin1", millimetre: 0.02, depth: DEEP },
    Body { scene: "statue", medium: "marble", millimetre: 0.02, depth: DEEP },
];
/// Of [`BODIES`], those that differ by scale alone, and by depth alone.
const BY_SCALE: [usize; 3] = [0, 1, 2];
const BY_DEPTH: [usize; 4] = [1, 3, 4, 5];
const METHODS: [&str; 4] = ["profile", "hybrid", "hybrid, counted twice", "walk"];

impl Body {
    fn name(&self) -> String {
        let Self { scene, medium, millimetre, depth } = self;
        let deep = if *depth < DEEP { format!(", {depth} deep") } else { String::new() };
        format!("{scene}, {medium}:{millimetre}{deep}")
    }

    fn build(&self) -> Result<SceneBuffers, Error> {
        let unknown = || Error::Setting(format!("there is no scene {}", self.scene));
        let mut scene: Scene = builtin::scene(self.scene).ok_or_else(unknown)?;
        for mesh in scene.meshes.iter_mut().filter(|mesh| (mesh.name == "cube") & (self.depth < DEEP)) {
            let thin = Mesh::cuboid(DVec3::new(-0.5, 0.001, -0.5), DVec3::new(0.5, 1.001, self.depth - 0.5));
            *mesh = Arc::new(Mesh { name: mesh.name.clone(), material: mesh.material, ..thin });
        }
        scene.fill(self.medium, Some(self.millimetre))?;
        SceneBuffers::build(&scene)
    }
}

fn settings(method: usize) -> PathSettings {
    let subsurface = [Subsurface::Diffusion, Subsurface::Hybrid, Subsurface::Hybrid, Subsurface::Walk][method];
    PathSettings { subsurface, counted_twice: method == 2, max_depth: 3, ..PathSettings::default() }
}

/// What was found of a body.
struct Found {
    images: Vec<Image>,
    /// Of the methods, the walk by other random numbers: how much brighter than the walk, and the mean difference of tiles from it, over its mean.
    errors: [[f64; 2]; METHODS.len()],
    landed: Option<Landed>,
}

/// The files of the figure, of so many samples a pixel.
///
/// # Errors
/// As of [`render::render`]; if a plot cannot be drawn.
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let found = BODIES.iter().map(|body| compare(environs, body, size, samples)).collect::<Result<Vec<_>, _>>()?;
    let walks = [rings(Enters::Straight), rings(Enters::Lambert)];
    let drawn = plot::grid(&[around(&walks)], 1, (720, 480));
    let drawn = drawn.map_err(|problem| Error::Setting(format!("the plot cannot be drawn: {problem}")))?;
    let images: Vec<Image> = found.iter().flat_map(|found| found.images.clone()).collect();
    Ok(Files {
        picture: Some(grid(&images, 2 * METHODS.len())),
        texts: vec![("profiles.svg".to_owned(), drawn)],
        report: report(&found, samples, &walks, &rays()?, &setup.markdown("")),
    })
}

fn compare(environs: &mut impl Environs, body: &Body, size: [u32; 2], samples: u32) -> Result<Found, Error> {
    let scene = body.build()?;
    let mut image = |method: usize, seed: u32| {
        let render = Render { count: samples, seed, ..Render::new(size, settings(method)) };
        environs.run(&format!("{}, {}", body.name(), METHODS[method]), |executor, observe| {
            render::render(executor, &scene, &render, &mut |step| observe(step.progress)).map(|rendered| rendered.image)
        })
    };
    let images = (0..METHODS.len()).map(|method| image(method, method as u32)).collect::<Result<Vec<_>, _>>()?;
    let walk = tiles(&image(METHODS.len() - 1, METHODS.len() as u32)?);
    let all: f64 = walk.iter().sum();
    let errors = std::array::from_fn(|method| {
        let other = tiles(&images[method]);
        let off: f64 = other.iter().zip(&walk).map(|(a, b)| (a - b).abs()).sum();
        [other.iter().sum::<f64>() / all - 1.0, off / all]
    });
    Ok(Found { images, errors, landed: (body.scene == "cube").then(|| landed(body)).transpose()? })
}

fn tiles(image: &Image) -> Vec<f64> {
    let width = image.width as usize;
    let across = width.div_ceil(TILE);
    let mut tiles = vec![0.0; 3 * across * (image.height as usize).div_ceil(TILE)];
    for (index, pixel) in image.pixels.iter().enumerate() {
        let tile = index / width / TILE * across + index % width / TILE;
        (0..3).for_each(|c| tiles[3 * tile + c] += f64::from(pixel[c]));
    }
    tiles
}

fn landed(body: &Body) -> Result<Landed, Error> {
    let half = Vec3::new(0.5, 0.5, 0.5 * body.depth as f32);
    Ok(Landed::from_front(landing::profile(body.medium, body.millimetre)?, half))
}

/// The fit of a half space's reflectance over its own albedo, at a distance in mean free paths.
fn fit(r: f64, albedo: f32, shape: Shape) -> f64 {
    let d = 1.0 / shape.factor(diffuse_albedo(albedo, 1.0 - albedo, 0.0));
    f64::from(radial_profile(r as f32, d))
}

/// What leaves in rings, over what leaves in all of them and beyond.
fn shares(values: &[f64; RINGS]) -> [f64; RINGS] {
    let area = |i: usize| {
        let (_, [from, to]) = ring(i);
        std::f64::consts::PI * (to * to - from * from)
    };
    let all: f64 = (0..RINGS).map(|i| values[i] * area(i)).sum();
    std::array::from_fn(|i| values[i] * area(i) / all)
}

/// The part of a fit in each ring, of what is in all of them.
fn fitted(albedo: f32, shape: Shape) -> [f64; RINGS] {
    let factor = shape.factor(diffuse_albedo(albedo, 1.0 - albedo, 0.0));
    let beyond = |r: f64| f64::from(ccdf((r as f32 * factor).min(10.0 * REACH)));
    let (_, [first, _]) = ring(0);
    let (_, [_, last]) = ring(RINGS - 1);
    std::array::from_fn(|i| {
        let (_, [from, to]) = ring(i);
        (beyond(from) - beyond(to)) / (beyond(first) - beyond(last))
    })
}

/// Half of the sum of differences: the share of light that is elsewhere.
fn elsewhere(walk: &[f64; RINGS], albedo: f32, shape: Shape) -> f64 {
    0.5 * shares(walk).iter().zip(fitted(albedo, shape)).map(|(a, b)| (a - b).abs()).sum::<f64>()
}

const SHAPES: [(&str, Shape); 2] = [("beam", Shape::Searchlight), ("Lambert", Shape::Diffuse)];

fn around(walks: &[Vec<[f64; RINGS]>; 2]) -> Panel {
    let albedo = ALBEDOS[0];
    let lines = SHAPES.iter().zip(walks).flat_map(|(&(name, shape), walk)| {
        let of = |name: String, f: &dyn Fn(usize) -> f64| Line {
            name,
            points: (0..RINGS).map(|i| (ring(i).0, f(i))).collect(),
        };
        let area: f64 =
            (0..RINGS).map(|i| walk[0][i] * std::f64::consts::PI * (ring(i).1[1].powi(2) - ring(i).1[0].powi(2))).sum();
        [
            of(format!("walk, {name}"), &|i| walk[0][i]),
            of(format!("fit, {name}"), &|i| area * fit(ring(i).0, albedo, shape)),
        ]
    });
    Panel {
        title: format!("Reflected by a half space of albedo {albedo}"),
        axes: ["distance, mean free paths", "R, a squared mean free path"],
        lines: lines.collect(),
    }
}

/// Of the rows of [`rays`], profile and hybrid as slides 81 to 84 have them, whose difference is what is traced beside the profile.
const ON_SLIDE: [usize; 2] = [4, 5];

/// Rays, shadow rays and probes of each part, a sample that enters.
fn rays() -> Result<Vec<(&'static str, [f64; 3])>, Error> {
    const SIDE: u32 = 32;
    const SAMPLES: u32 = 16;
    let mut scene = builtin::scene("slab").ok_or_else(|| Error::Setting("there is no scene slab".to_owned()))?;
    scene.environment = Some(scenes::dome([1.0; 3]));
    let scene = SceneBuffers::build(&scene)?;
    let hybrid = settings(1);
    let part = |parts| PathSettings { parts, ..hybrid.clone() };
    let on_slide = |parts| PathSettings { profile_paths: false, segments: 1, ..part(parts) };
    let rows = [
        ("camera", part(Parts::Rest)),
        ("boundary term", part(Parts::Boundary)),
        ("single scattering", part(Parts::Single)),
        ("profile", part(Parts::Profile)),
        ("profile, one segment, light samples alone", on_slide(Parts::Profile)),
        ("hybrid, one segment, light samples alone for the profile", on_slide(Parts::All)),
        ("hybrid", hybrid.clone()),
        ("walk", settings(3)),
    ];
    let count = |(name, settings): (&'static str, PathSettings)| {
        let render = Render { count: SAMPLES, ..Render::new([SIDE; 2], settings) };
        let counts = asked(&scene, &render)?.into_values().fold(Counts::default(), |sum, of| of.counts.plus(sum));
        let of = |count: u64| count as f64 / f64::from(SAMPLES * SIDE * SIDE);
        Ok((name, [of(counts.closest), of(counts.shadow), of(counts.probes)]))
    };
    rows.into_iter().map(count).collect()
}

fn claims(found: &[Found], rays: &[(&str, [f64; 3])]) -> Vec<Claim> {
    let error = |body: usize, method: usize| found[body].errors[method][1];
    let list = |bodies: &[usize], method| {
        let errors: Vec<_> = bodies.iter().map(|&body| format!("{:.1} %", 100.0 * error(body, method))).collect();
        errors.join(", ")
    };
    let grows =
        |bodies: &[usize], method| bodies.windows(2).all(|pair| error(pair[0], method) < error(pair[1], method));
    let nearer = |bodies: &[usize]| bodies.iter().filter(|&&body| error(body, 1) < error(body, 0)).count();
    let all: Vec<usize> = (0..found.len()).collect();
    let twice = all.iter().filter(|&&body| error(body, 1) < error(body, 2)).count();
    let [traced, shadow] = [0, 1].map(|kind| rays[ON_SLIDE[1]].1[kind] - rays[ON_SLIDE[0]].1[kind]);
    vec![
        Claim::new(
            "P1",
            "the error of the profile grows with the mean free path",
            "cube",
            format!("{}, of the hybrid {}", list(&BY_SCALE, 0), list(&BY_SCALE, 1)),
            Some(grows(&BY_SCALE, 0)),
        ),
        Claim::new(
            "P2",
            "as the cube becomes a slab the profile's error grows, and the hybrid stays nearer to the walk",
            "cube",
            format!("{}, of the hybrid {}", list(&BY_DEPTH, 0), list(&BY_DEPTH, 1)),
            Some(grows(&BY_DEPTH, 0) && nearer(&BY_DEPTH) == BY_DEPTH.len()),
        ),
        Claim::new(
            "P3",
            "the hybrid is nearer to the walk than the profile, everywhere",
            "all",
            format!("in {} of {}", nearer(&all), all.len()),
            Some(nearer(&all) == all.len()),
        ),
        Claim::new(
            "P4",
            "single scattering that is counted twice is farther from the walk than the corrected hybrid",
            "all",
            format!("in {twice} of {}", all.len()),
            Some(twice == all.len()),
        ),
        Claim::new(
            "P5",
            "beside the profile, boundary term and single scattering cost two rays and two shadow rays (slides 81 to 84)",
            "slab",
            format!("{traced:.2} rays and {shadow:.2} shadow rays"),
            Some((traced - 2.0).abs() < 0.01 && (shadow - 2.0).abs() < 0.01),
        ),
    ]
}

fn report(
    found: &[Found],
    samples: u32,
    walks: &[Vec<[f64; RINGS]>; 2],
    rays: &[(&str, [f64; 3])],
    origin: &str,
) -> String {
    let mut text = format!(
        "# Profiles, and what is traced beside them\n\nAfter Zhang and d'Eon 2025.\n\n{origin}\n![Images]({PICTURE})\n\nFrom left to right, two bodies \
         in a row: {}. {samples} samples a pixel, paths of 3 segments. Errors are the mean difference of tiles of {TILE} x {TILE} pixels from a second walk, \
         over its mean, so that those of the walk are noise; in brackets how much brighter the picture is. Of the points that segments of the profile find from the front of the \
         cube: the part of segments that find none, and the shares of what the others are worth on the front, on the back, and on the four \
         sides.\n\n## Claims\n\n{}\n## Bodies\n\n| body | profile | hybrid | counted twice | walk, again | no point | front | back | sides |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        METHODS.join(", "),
        claim::table(&claims(found, rays)),
    );
    for (body, Found { errors, landed, .. }) in BODIES.iter().zip(found) {
        let shown = errors.map(|[mean, tiles]| format!("{:.1} % ({:+.1} %)", 100.0 * tiles, 100.0 * mean)).join(" | ");
        let landed = landed.as_ref().map_or(" | | |".to_owned(), |Landed { nothing, front, back, beside }| {
            [nothing, front, back, beside].map(|x| format!("{:.1} %", 100.0 * x)).join(" | ")
        });
        let _ = writeln!(text, "| {} | {shown} | {landed} |", body.name());
    }
    let _ = write!(
        text,
        "\n## Rays\n\nOf the scene `slab` under a sky that is white all around, whose every camera ray enters, a sample, with the camera's. Single scattering has the way \
         across the body of the boundary term in it. Slide 81 counts 4 rays of which 2 are shadow rays: one across the body, one from the collision out of it, and a light sample \
         at both ends. Here a path goes on from both ends, too, which finds light a second way, so that there are two rays more; and a light sample that lies behind the surface, as half of \
         those of a dome do, casts no shadow ray. The profile has a probe and a light sample there and here.\n\n| part | rays | shadow rays | probes |\n|---|---:|---:|---:|\n"
    );
    for (name, counts) in rays {
        let _ = writeln!(text, "| {name} | {} |", counts.map(|count| format!("{count:.2}")).join(" | "));
    }
    let _ = write!(
        text,
        "\n## Around a beam\n\n![R over the distance](profiles.svg)\n\nWalks through a half space, of light that enters as a beam or by Lambert's law, and the \
         fit for it, which is given the walk's albedo: fits are of another border. The part of the light between {:.2} and {:.0} mean free \
         paths that the fit has elsewhere:\n\n| albedo | beam | Lambert |\n|---:|---:|---:|\n",
        ring(0).1[0],
        ring(RINGS - 1).1[1]
    );
    for (index, albedo) in ALBEDOS.into_iter().enumerate() {
        let of = |which: usize| 100.0 * elsewhere(&walks[which][index], albedo, SHAPES[which].1);
        let _ = writeln!(text, "| {albedo} | {:.1} % | {:.1} % |", of(0), of(1));
    }
    text
}
