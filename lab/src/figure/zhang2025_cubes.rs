//! Zhang and d'Eon 2025, slides 22, 37 and 38 and the film behind them: a cube with a small light at it, by the scale of its medium and where a
//! profile's samples land, with the dome light on and off; the cube becomes a slab; and a cube as smoke beside a solid one.

use std::fmt::Write;

use restir::Error;
use restir::image::Image;
use restir::scene::subsurface::medium;
use restir::scene::{Camera, Material, Mesh, Scene};
use restir_shared::diffusion::Disk;
use restir_shared::glam::{DVec3, Vec3};

use super::beside::{Beside, HYBRID, METHODS, NAMES, PROFILE, WALK, is_small, methods, percent};
use super::claim::{self, Claim};
use super::landing::{self, Landed, points};
use super::picture::grid;
use super::scenes;
use super::view::View;
use super::{Environs, Files, PICTURE};
use crate::bench::fit::Estimate;
use crate::bench::table::Setup;

const MEDIUM: &str = "wax";
/// Of the slides, and how long a millimetre is at the scale 1; those that are shown.
const SCALES: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];
const MILLIMETRE: f64 = 0.05;
const SHOWN: [usize; 4] = [0, 1, 2, 4];
/// From the front of the cube to its back, which comes nearer; at this scale.
const DEPTHS: [f64; 4] = [1.0, 0.4, 0.1, 0.03];
const SLAB_SCALE: f64 = 0.2;
/// Of the cube.
const MIDDLE: DVec3 = DVec3::new(0.0, 0.501, 0.0);
const HALF: f64 = 0.5;
/// Of the small light: its side, and how far from the front it is.
const LIGHT: [f64; 2] = [0.25, 0.15];
const DOME: [f32; 3] = [0.25, 0.28, 0.32];
/// Where the samples begin that are shown, beside the light on the front; and so many segments.
const START: DVec3 = DVec3::new(0.2, 0.5, HALF);
const SEGMENTS: u32 = 96;
const BLUE: [f32; 3] = [0.05, 0.2, 1.0];
const YELLOW: [f32; 3] = [1.0, 0.8, 0.0];
/// How near two numbers are that match: the slides say "pretty well".
const MATCH: f64 = 0.1;
/// Of the front's half width: where its edges begin, and where its middle ends.
const EDGE: f64 = 0.84;
const INNER: f64 = 0.3;

/// What shines: a small light close to the front, alone or under a dome, or a large one above.
#[derive(Clone, Copy, PartialEq)]
enum Light {
    Small { dome: bool },
    Above,
}

/// A cube of wax by the scale of its mean free paths, or a solid one.
#[derive(Clone, Copy)]
struct Cube {
    scale: Option<f64>,
    depth: f64,
    light: Light,
}

impl Cube {
    fn name(&self) -> String {
        let body = self.scale.map_or("solid".to_owned(), |scale| format!("scale {scale}"));
        let light = match self.light {
            Light::Small { dome: true } => "dome on",
            Light::Small { dome: false } => "dome off",
            Light::Above => "light above",
        };
        format!("{body}, {} deep, {light}", self.depth)
    }

    fn camera() -> Camera {
        Camera::pinhole(DVec3::new(3.0, 1.7, 2.7), DVec3::new(0.0, 0.45, 0.0), DVec3::Y, 25.0_f64.to_radians())
    }

    fn scene(&self) -> Result<Scene, Error> {
        let mut scene = Scene { name: self.name(), camera: Some(Self::camera()), ..Scene::default() };
        let floor = scene.add_material(Material::diffuse("floor", [0.3; 3]));
        scene.add_mesh("floor", floor, Mesh::quad(DVec3::new(-5.0, 0.0, -5.0), [DVec3::Z * 10.0, DVec3::X * 10.0]));
        let volume = medium(MEDIUM, MILLIMETRE * self.scale.unwrap_or(1.0))?;
        let color = volume.scattering.as_ref().map_or([0.0; 3], |scattering| scattering.color);
        let wax = Material { diffuse_transmission: 1.0, volume: Some(volume), ..Material::diffuse("wax", [1.0; 3]) };
        let material = if self.scale.is_some() { wax } else { Material::diffuse("solid", color) };
        let material = scene.add_material(material);
        let (lo, hi) = (MIDDLE - HALF, MIDDLE + HALF);
        scene.add_mesh("cube", material, Mesh::cuboid(DVec3::new(lo.x, lo.y, hi.z - self.depth), hi));
        match self.light {
            Light::Above => {
                let edges = [DVec3::X * 1.6, DVec3::Z * 1.6];
                scene.add_quad_light(DVec3::new(-0.8, 2.6, -0.8), edges, [2.2, 2.4, 2.8], false);
            }
            Light::Small { dome } => {
                let edges = [DVec3::Y * LIGHT[0], DVec3::X * LIGHT[0]];
                let corner = DVec3::new(-0.5 * LIGHT[0], MIDDLE.y - 0.5 * LIGHT[0], HALF + LIGHT[1]);
                scene.add_quad_light(corner, edges, [3.0, 2.75, 2.4], false);
                scene.environment = dome.then(|| scenes::dome(DOME));
            }
        }
        Ok(scene)
    }
}

/// The cube by scale, with the dome on and off.
struct Scaled {
    dome: [Beside; 2],
    landed: Landed,
}

/// All that was rendered.
struct Found {
    scales: Vec<Scaled>,
    slabs: Vec<Beside>,
    smoke: Beside,
    solid: Beside,
    view: View,
}

/// The files of the figure, of so many samples a pixel in each of the renders.
///
/// # Errors
/// As of [`restir::render::Render::render`].
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let mut beside = |cube: Cube| Beside::of(environs, &cube.name(), &cube.scene()?, &methods(3), (size, samples));
    let mut scaled = |&scale: &f64| {
        let mut by_dome = |dome| beside(Cube { scale: Some(scale), depth: 1.0, light: Light::Small { dome } });
        let dome = [by_dome(true)?, by_dome(false)?];
        let profile = landing::profile(MEDIUM, MILLIMETRE * scale)?;
        Ok(Scaled { dome, landed: Landed::from_front(profile, Vec3::splat(HALF as f32)) })
    };
    let scales = SCALES.iter().map(&mut scaled).collect::<Result<Vec<_>, Error>>()?;
    let mut slab = |&depth: &f64| beside(Cube { scale: Some(SLAB_SCALE), depth, light: Light::Small { dome: false } });
    let slabs = DEPTHS.iter().map(&mut slab).collect::<Result<Vec<_>, _>>()?;
    let smoke = beside(Cube { scale: Some(1.0), depth: 1.0, light: Light::Above })?;
    let solid = beside(Cube { scale: None, depth: 1.0, light: Light::Above })?;
    let found = Found { scales, slabs, smoke, solid, view: View::new(&Cube::camera(), size) };
    let report = report(&found, samples, &setup.markdown(""));
    Ok(Files { picture: Some(grid(&found.images()?, SHOWN.len())), texts: Vec::new(), report })
}

impl Found {
    /// The rows of the picture.
    fn images(&self) -> Result<Vec<Image>, Error> {
        let by_scale = |dome: usize, method: usize| SHOWN.map(|i| self.scales[i].dome[dome].image(method));
        let mut images =
            [[0, PROFILE], [0, WALK], [1, PROFILE], [1, WALK]].map(|[dome, method]| by_scale(dome, method)).concat();
        for i in SHOWN {
            images.push(self.samples(self.scales[i].dome[0].image(WALK), SCALES[i])?);
        }
        for method in [PROFILE, HYBRID, WALK] {
            images.extend(self.slabs.iter().map(|slab| slab.image(method)));
        }
        images.extend((0..METHODS.len()).map(|method| self.smoke.image(method)).chain([self.solid.image(WALK)]));
        Ok(images)
    }

    /// A picture with the points in blue that segments of the profile find from one point on, where the camera sees them.
    fn samples(&self, mut picture: Image, scale: f64) -> Result<Image, Error> {
        let profile = landing::profile(MEDIUM, MILLIMETRE * scale)?;
        let disk = Disk::new((START - DVec3::Y * MIDDLE.y).as_vec3(), Vec3::Z, profile);
        let found = (0..SEGMENTS).flat_map(|i| points(&disk, i, Vec3::splat(HALF as f32)));
        let seen = found.map(|(point, normal)| (point.as_dvec3() + DVec3::Y * MIDDLE.y, normal.as_dvec3(), BLUE));
        for (point, normal, color) in seen.chain([(START, DVec3::Z, YELLOW)]) {
            let pixel = self.view.pixel(point).filter(|_| self.view.faces(point, normal));
            if let Some([x, y]) = pixel {
                picture.pixels[(y * picture.width + x) as usize] = color;
            }
        }
        Ok(picture)
    }

    /// Sums over what the camera sees of the front: of the light times a function of the place, which is from -1 to 1 across and up.
    fn over_front(&self, picture: &[f64], of: impl Fn(f64, f64) -> f64) -> f64 {
        let [width, height] = self.view.sides();
        let pixel = |i: usize| {
            let place = (self.view.seen([i as u32 % width, i as u32 / width], 2, HALF) - MIDDLE) / HALF;
            let inside = place.x.abs().max(place.y.abs()) <= 1.0;
            if inside { picture[3 * i..3 * i + 3].iter().sum::<f64>() * of(place.x, place.y) } else { 0.0 }
        };
        (0..(width * height) as usize).map(pixel).sum()
    }

    /// Of the spot's half that the light does not hide: how much brighter it is than by the walk, and how much larger, which is the root of
    /// its mean squared distance from the middle.
    fn spot(&self, beside: &Beside, method: usize) -> [Estimate; 2] {
        let sum = |picture: &[f64], power: i32| {
            self.over_front(picture, |x, y| if x > 0.0 { x.hypot(y).powi(power) } else { 0.0 })
        };
        let size = |picture: &[f64]| (sum(picture, 2) / sum(picture, 0)).sqrt();
        [
            beside.statistic(|by| sum(&by[method], 0) / sum(&by[WALK], 0) - 1.0),
            beside.statistic(|by| size(&by[method]) / size(&by[WALK]) - 1.0),
        ]
    }

    /// How much brighter the front is by the last method at its upper edge than in its middle, and at its edges to the left and right.
    fn edges(&self, beside: &Beside) -> [Estimate; 2] {
        let mean = |picture: &[f64], within: &dyn Fn(f64, f64) -> bool| {
            let of = |x: f64, y: f64| if within(x, y) { 1.0 } else { 0.0 };
            self.over_front(picture, of) / self.over_front(&vec![1.0; picture.len()], of)
        };
        let middle = |x: f64, y: f64| x.abs().max(y.abs()) < INNER;
        let upper = |x: f64, y: f64| x.abs() < INNER && y > EDGE;
        let beside_it = |x: f64, y: f64| x.abs() > EDGE && y.abs() < INNER;
        let over_middle = |edge: &dyn Fn(f64, f64) -> bool| {
            beside.statistic(|by| mean(&by[WALK], edge) / mean(&by[WALK], &middle) - 1.0)
        };
        [over_middle(&upper), over_middle(&beside_it)]
    }
}

/// Claims about the slides' scales, by dome.
fn of_scales(found: &Found, dome: usize) -> [Claim; 2] {
    let scene = ["dome on", "dome off"][dome];
    let cells: Vec<&Beside> = found.scales.iter().map(|scaled| &scaled.dome[dome]).collect();
    let errors = |method: usize| cells.iter().map(|cell| cell.error(method)).collect::<Vec<_>>();
    let list = |method: usize| errors(method).into_iter().map(percent).collect::<Vec<_>>().join(", ");
    let grows = errors(PROFILE).windows(2).map(|pair| pair[1].less(pair[0]).is_positive()).collect::<Vec<_>>();
    [
        Claim::new(
            ["C1", "C3"][dome],
            "the error of the profile grows with the scale",
            scene,
            list(PROFILE),
            claim::all(grows),
        ),
        Claim::new(
            ["C2", "C4"][dome],
            "the hybrid is nearer to the walk than the profile at every scale",
            scene,
            list(HYBRID),
            claim::all(cells.iter().map(|cell| cell.nearer(HYBRID, PROFILE))),
        ),
    ]
}

fn of_slabs(found: &Found) -> [Claim; 4] {
    let spots: Vec<[Estimate; 2]> = found.slabs.iter().map(|slab| found.spot(slab, PROFILE)).collect();
    let list = |what: usize| spots.iter().map(|spot| percent(spot[what])).collect::<Vec<_>>().join(", ");
    let thin = &spots[2..];
    let within = format!("of the cube the profile's spot is as bright as the walk's, within {:.0} %", 100.0 * MATCH);
    let as_large = format!("and as large, within {:.0} %", 100.0 * MATCH);
    let scene = "slabs, 1 to 0.03 deep";
    [
        Claim::new("C5", within, scene, format!("brighter by {}", list(0)), is_small(spots[0][0], MATCH)),
        Claim::new("C6", as_large, scene, format!("larger by {}", list(1)), is_small(spots[0][1], MATCH)),
        Claim::new(
            "C7",
            "of the two thinnest slabs it is larger",
            scene,
            "as above",
            claim::all(thin.iter().map(|spot| spot[1].is_positive())),
        ),
        Claim::new(
            "C8",
            "of the two thinnest slabs it is brighter, for light escapes at the far side",
            scene,
            "as above",
            claim::all(thin.iter().map(|spot| spot[0].is_positive())),
        ),
    ]
}

fn claims(found: &Found) -> Vec<Claim> {
    let away: Vec<f64> = found.scales.iter().map(|scaled| 1.0 - scaled.landed.front).collect();
    let grows = away.windows(2).all(|pair| pair[0] < pair[1]);
    let [smoke, solid] = [&found.smoke, &found.solid].map(|cube| found.edges(cube));
    let mut claims = vec![Claim::new(
        "C0",
        "samples spread as the scale grows: more of what they are worth lies on other sides than they begin on",
        "cube",
        format!("from {:.0} % to {:.0} %", 100.0 * away[0], 100.0 * away[away.len() - 1]),
        Some(grows),
    )];
    claims.extend([0, 1].into_iter().flat_map(|dome| of_scales(found, dome)));
    claims.extend(of_slabs(found));
    claims.extend([("C9", "its upper edge"), ("C10", "its left and right edges")].into_iter().zip([0, 1]).map(
        |((id, name), edge)| {
            let (smoke, solid) = (smoke[edge], solid[edge]);
            Claim::new(
                id,
                format!(
                    "under a large light above the cube's front is bright at {name}, more than that of a solid cube"
                ),
                "light above",
                format!("brighter than in its middle by {}, the solid cube by {}", percent(smoke), percent(solid)),
                claim::all([smoke.is_positive(), smoke.less(solid).is_positive()]),
            )
        },
    ));
    claims
}

fn report(found: &Found, samples: u32, origin: &str) -> String {
    let runs = super::beside::RUNS;
    let mut text = format!(
        "# Cubes: scale, dome, slabs, smoke\n\nAfter Zhang and d'Eon 2025, slides 22, 37 and 38, and the film behind them.\n\n{origin}\n![Cubes]({PICTURE})\n\nA cube of {MEDIUM}, \
         one wide, with a light of {} of its side {} before its front. Rows from top to bottom: the profile and the walk, with the dome light on; the same two \
         with the dome off; the walk, with the points in blue that {SEGMENTS} segments of the profile find from the yellow one on, where the camera sees them. \
         In these rows scales of {} from left to right: at 1 the mean free path is 0.3, 0.2 and 0.1 by channel. Then the cube as it becomes a slab, {} deep, at the scale {SLAB_SCALE}: {}. Last \
         under a large light above, at the scale 1: {}, and a solid cube of the same colour.\n\n{runs} renders of {samples} samples a pixel by each method, paths of 3 segments; intervals of 95 %, each by itself. \
         Errors are roots of the mean squared difference of tiles from the walk's, over their mean, without the noise of either.\n\n## Claims\n\n{}\n",
        LIGHT[0],
        LIGHT[1],
        SHOWN.map(|i| SCALES[i].to_string()).join(", "),
        DEPTHS.map(|depth| depth.to_string()).join(", "),
        NAMES.join(", "),
        NAMES.join(", "),
        claim::table(&claims(found)),
    );
    text += "## Scales\n\nWhere the profile's samples land depends on the medium and the shape alone: a dome changes what they bring, not where they are. Segments start \
             from anywhere on the front; shares are of what their points are worth.\n\n| scale | dome | profile: error, brighter by | hybrid | no point | front | back | sides \
             |\n|---:|---|---:|---:|---:|---:|---:|---:|\n";
    for (scale, Scaled { dome, landed }) in SCALES.iter().zip(&found.scales) {
        let Landed { nothing, front, back, beside } = landed;
        let shares = [nothing, front, back, beside].map(|x| format!("{:.1} %", 100.0 * x)).join(" | ");
        for (name, cell) in ["on", "off"].iter().zip(dome) {
            let of = |method: usize| format!("{}, {}", percent(cell.error(method)), percent(cell.brighter(method)));
            let _ = writeln!(text, "| {scale} | {name} | {} | {} | {shares} |", of(PROFILE), of(HYBRID));
        }
    }
    text += "\n## Slabs\n\nOf the half of the spot that the light does not hide.\n\n| deep | profile: error | spot brighter by | larger by | hybrid: error | spot brighter by | \
             larger by |\n|---:|---:|---:|---:|---:|---:|---:|\n";
    for (depth, slab) in DEPTHS.iter().zip(&found.slabs) {
        let of = |method: usize| {
            let [light, size] = found.spot(slab, method);
            [slab.error(method), light, size].map(percent).join(" | ")
        };
        let _ = writeln!(text, "| {depth} | {} | {} |", of(PROFILE), of(HYBRID));
    }
    text
}
