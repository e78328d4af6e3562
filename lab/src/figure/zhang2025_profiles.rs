//! Zhang and d'Eon 2025: where diffusion profiles fail, what the hybrid makes of it, and what each part costs.

use std::fmt::Write;
use std::sync::Arc;

use restir::advanced::replay::Counts;
use restir::image::Image;
use restir::render::Render;
use restir::scene::{Mesh, Scene, builtin};
use restir::technique::asked::asked;
use restir::technique::path::{Parts, PathSettings};
use restir::{Error, buffers::SceneBuffers};
use restir_shared::diffusion::{REACH, Shape, ccdf, diffuse_albedo, radial_profile};
use restir_shared::glam::{DVec3, Vec3};

use super::beside::{Beside, HYBRID, PROFILE, RUNS, TILE, methods, percent};
use super::claim::{self, Claim};
use super::landing::{self, Landed};
use super::picture::grid;
use super::scenes;
use super::zhang2025_walk::{ALBEDOS, Enters, RINGS, ring, rings};
use super::{Environs, Files, PICTURE};
use crate::bench::plot::{self, Line, Panel};
use crate::bench::table::Setup;

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
/// Of [`METHODS`], beside [`PROFILE`] and [`HYBRID`].
const TWICE: usize = 2;

impl Body {
    fn name(&self) -> String {
        let Self { scene, medium, millimetre, depth } = self;
        let deep = if *depth < DEEP { format!(", {depth} deep") } else { String::new() };
        format!("{scene}, {medium}:{millimetre}{deep}")
    }

    fn scene(&self) -> Result<Scene, Error> {
        let unknown = || Error::Setting(format!("there is no scene {}", self.scene));
        let mut scene: Scene = builtin::scene(self.scene).ok_or_else(unknown)?;
        for mesh in scene.meshes.iter_mut().filter(|mesh| (mesh.name == "cube") & (self.depth < DEEP)) {
            let thin = Mesh::cuboid(DVec3::new(-0.5, 0.001, -0.5), DVec3::new(0.5, 1.001, self.depth - 0.5));
            *mesh = Arc::new(Mesh { name: mesh.name.clone(), material: mesh.material, ..thin });
        }
        scene.fill(self.medium, Some(self.millimetre))?;
        Ok(scene)
    }
}

/// The settings of [`METHODS`].
fn by_methods() -> [PathSettings; METHODS.len()] {
    let [profile, hybrid, walk] = methods(3);
    [profile, hybrid.clone(), PathSettings { counted_twice: true, ..hybrid }, walk]
}

/// What was found of a body: pictures by [`METHODS`], and where samples land.
struct Found {
    beside: Beside,
    landed: Option<Landed>,
}

/// The files of the figure, of so many samples a pixel in each of the renders.
///
/// # Errors
/// As of [`Render::render`]; if a plot cannot be drawn.
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let mut compare = |body: &Body| {
        let beside = Beside::of(environs, &body.name(), &body.scene()?, &by_methods(), (size, samples))?;
        Ok(Found { beside, landed: (body.scene == "cube").then(|| landed(body)).transpose()? })
    };
    let found = BODIES.iter().map(&mut compare).collect::<Result<Vec<_>, Error>>()?;
    let walks = [rings(Enters::Straight), rings(Enters::Lambert)];
    let drawn = plot::grid(&[around(&walks)], 1, (720, 480));
    let drawn = drawn.map_err(|problem| Error::Setting(format!("the plot cannot be drawn: {problem}")))?;
    let images = |found: &Found| (0..METHODS.len()).map(|method| found.beside.image(method)).collect::<Vec<_>>();
    let images: Vec<Image> = found.iter().flat_map(images).collect();
    Ok(Files {
        picture: Some(grid(&images, 2 * METHODS.len())),
        texts: vec![("profiles.svg".to_owned(), drawn)],
        report: report(&found, samples, &walks, &rays()?, &setup.markdown("")),
    })
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
    let [_, hybrid, walk] = methods(3);
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
        ("walk", walk),
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
    let error = |body: usize, method: usize| found[body].beside.error(method);
    let list = |bodies: &[usize], method| {
        bodies.iter().map(|&body| percent(error(body, method))).collect::<Vec<_>>().join(", ")
    };
    let grows = |bodies: &[usize], method| {
        let more = |pair: &[usize]| error(pair[1], method).less(error(pair[0], method)).is_positive();
        claim::all(bodies.windows(2).map(more))
    };
    let nearer = |bodies: &[usize], than: usize| {
        bodies.iter().map(|&body| found[body].beside.nearer(HYBRID, than)).collect::<Vec<_>>()
    };
    let counted = |verdicts: &[Option<bool>]| {
        let count = |verdict| verdicts.iter().filter(|&&found| found == verdict).count();
        format!("in {} of {}, not in {}", count(Some(true)), verdicts.len(), count(Some(false)))
    };
    let all: Vec<usize> = (0..found.len()).collect();
    let (than_profile, than_twice) = (nearer(&all, PROFILE), nearer(&all, TWICE));
    let [traced, shadow] = [0, 1].map(|kind| rays[ON_SLIDE[1]].1[kind] - rays[ON_SLIDE[0]].1[kind]);
    vec![
        Claim::new(
            "P1",
            "the error of the profile grows with the mean free path",
            "cube",
            format!("{}, of the hybrid {}", list(&BY_SCALE, PROFILE), list(&BY_SCALE, HYBRID)),
            grows(&BY_SCALE, PROFILE),
        ),
        Claim::new(
            "P2",
            "as the cube becomes a slab the profile's error grows, and the hybrid stays nearer to the walk",
            "cube",
            format!("{}, of the hybrid {}", list(&BY_DEPTH, PROFILE), list(&BY_DEPTH, HYBRID)),
            claim::all([grows(&BY_DEPTH, PROFILE)].into_iter().chain(nearer(&BY_DEPTH, PROFILE))),
        ),
        Claim::new(
            "P3",
            "the hybrid is nearer to the walk than the profile, everywhere",
            "all",
            counted(&than_profile),
            claim::all(than_profile),
        ),
        Claim::new(
            "P4",
            "single scattering that is counted twice is farther from the walk than the corrected hybrid",
            "all",
            counted(&than_twice),
            claim::all(than_twice),
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
         in a row: {}. {RUNS} renders of {samples} samples a pixel by each method, paths of 3 segments; intervals of 95 %, each by itself. Errors are roots of the mean squared difference of \
         tiles of {TILE} x {TILE} pixels from the walk's, over their mean, without the noise of either; beside them is how much brighter the picture is. Of the points that segments of the profile find from the front of the \
         cube: the part of segments that find none, and the shares of what the others are worth on the front, on the back, and on the four \
         sides.\n\n## Claims\n\n{}\n## Bodies\n\n| body | profile: error, brighter by | hybrid | counted twice | no point | front | back | sides |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|\n",
        METHODS.join(", "),
        claim::table(&claims(found, rays)),
    );
    for (body, Found { beside, landed }) in BODIES.iter().zip(found) {
        let of = |method: usize| format!("{}, {}", percent(beside.error(method)), percent(beside.brighter(method)));
        let shown = [PROFILE, HYBRID, TWICE].map(of).join(" | ");
        let landed = landed.as_ref().map_or(" | | |".to_owned(), |Landed { nothing, front, back, beside }| {
            [nothing, front, back, beside].map(|x| format!("{:.1} %", 100.0 * x)).join(" | ")
        });
        let _ = writeln!(text, "| {} | {shown} | {landed} |", body.name());
    }
    let _ = write!(
        text,
        "\n## Rays\n\nOf the scene `slab` under a sky that is white all around, whose every camera ray enters, a sample, with the camera's. (In [diffusion.md](../../diffusion.md) the sky is white above alone, and the camera's ray is not counted.) Single scattering has the way \
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
