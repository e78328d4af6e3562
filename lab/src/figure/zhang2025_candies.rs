//! Zhang and d'Eon 2025, candies, candles and slide 86: candies by what is scattered and by what is transmitted, candles that burn inside of their
//! wax, and a layer that reflects.

use std::fmt::Write;
use std::sync::Arc;

use restir::Error;
use restir::image::Image;
use restir::scene::subsurface::medium;
use restir::scene::{Material, Mesh, Scene, builtin};
use restir::technique::path::{Orders, PathSettings, Subsurface};
use restir_shared::glam::{DAffine3, DVec3};

use super::beside::{Beside, HYBRID, NAMES, PROFILE, RUNS, WALK, is_small, methods, percent};
use super::claim::{self, Claim};
use super::picture::{brightened, grid};
use super::scenes;
use super::{Environs, Files, PICTURE};
use crate::bench::fit::Estimate;
use crate::bench::table::Setup;

/// Through a dielectric into a medium and out again, to the floor, and to a light.
const MAX_DEPTH: u32 = 6;
/// Colour of each candy, and where it stands.
const CANDIES: [(&str, f64); 3] = [("0.9,0.2,0.12", -0.62), ("0.95,0.7,0.15", 0.0), ("0.3,0.8,0.25", 0.62)];
/// In units of the scene: a candy is 1 high and 0.4 thick.
const MEAN_FREE_PATH: f64 = 0.15;
const SKY: [f32; 3] = [0.3, 0.33, 0.36];
const IOR: f32 = 1.4;
const ROUGHNESS: f32 = 0.3;
/// Light that has collided, light that has not, and all.
const SHARES: [&str; 3] = ["scattering only", "transmission only", "both"];
/// Of the layer.
const LAYER: (f32, f32) = (1.5, 0.25);
const LAYERED: (&str, f64) = ("skin1", 0.02);
/// Of light that is as much as by the walk.
const MATCH: f64 = 0.1;
/// Candles are shown so many times as bright.
const EXPOSURE: f32 = 2.0;

/// All that was rendered.
struct Found {
    /// By the walk: [`SHARES`].
    shares: Beside,
    candies: Beside,
    candles: Beside,
    /// Without a layer and with one.
    layers: [Beside; 2],
}

/// The files of the figure, of so many samples a pixel in each of the renders.
///
/// # Errors
/// As of [`restir::render::Render::render`].
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let mut beside = |what: &str, scene: &Scene, methods: &[PathSettings]| {
        Beside::of(environs, what, scene, methods, (size, samples))
    };
    let candies = candies()?;
    let found = Found {
        shares: beside("candies by the walk", &candies, &shares())?,
        candies: beside("candies", &candies, &methods(MAX_DEPTH))?,
        candles: beside("candles", &scene("candles")?, &methods(MAX_DEPTH))?,
        layers: [
            beside("statue", &statue(None)?, &methods(3))?,
            beside("statue under a layer", &statue(Some(LAYER))?, &methods(3))?,
        ],
    };
    let report = report(&found, samples, &setup.markdown(""));
    Ok(Files { picture: Some(grid(&found.images(), SHARES.len())), texts: Vec::new(), report })
}

fn scene(name: &str) -> Result<Scene, Error> {
    builtin::scene(name).ok_or_else(|| Error::Setting(format!("there is no scene {name}")))
}

/// The walk's light by [`SHARES`].
fn shares() -> [PathSettings; 3] {
    [Orders { least: 1, ..Orders::ALL }, Orders { least: 0, most: 0 }, Orders::ALL].map(|orders| PathSettings {
        orders,
        subsurface: Subsurface::Walk,
        max_depth: MAX_DEPTH,
        ..PathSettings::default()
    })
}

/// Three hares of gum before a large light, under a sky.
fn candies() -> Result<Scene, Error> {
    let statue = scene("statue")?;
    let hare = statue.meshes.iter().find(|mesh| mesh.name == "statue");
    let hare = hare.ok_or_else(|| Error::Setting("there is no statue".to_owned()))?;
    let camera = statue.camera.map(|camera| restir::scene::Camera {
        position: DVec3::new(0.5, 1.5, 4.4),
        target: DVec3::new(0.0, 0.47, 0.0),
        vertical_fov: 27.0_f64.to_radians(),
        ..camera
    });
    let mut candies = Scene { name: "candies".to_owned(), camera, ..Scene::default() };
    candies.environment = Some(scenes::dome(SKY));
    let floor = candies.add_material(Material::diffuse("floor", [0.45; 3]));
    candies.add_mesh("floor", floor, Mesh::quad(DVec3::new(-7.0, 0.0, -7.0), [DVec3::Z * 14.0, DVec3::X * 14.0]));
    for (color, x) in CANDIES {
        let gum = Material {
            transmission: 1.0,
            roughness: ROUGHNESS,
            ior: IOR,
            volume: Some(medium(color, MEAN_FREE_PATH)?),
            ..Material::diffuse(color, [1.0; 3])
        };
        let gum = candies.add_material(gum);
        let place = DAffine3::from_translation(DVec3::new(x, 0.001, 0.0)) * DAffine3::from_scale(DVec3::splat(0.5));
        candies.place_mesh(color, gum, Mesh::clone(hare), place);
    }
    let edges = [DVec3::new(0.0, -1.2, -0.7), DVec3::X * -2.4];
    candies.add_quad_light(DVec3::new(1.2, 3.0, -1.6), edges, [7.0, 6.8, 6.4], false);
    Ok(candies)
}

/// The statue of skin, under a layer of an index of refraction and a roughness.
fn statue(layer: Option<(f32, f32)>) -> Result<Scene, Error> {
    let mut statue = scene("statue")?;
    statue.fill(LAYERED.0, Some(LAYERED.1))?;
    if let Some((ior, roughness)) = layer {
        for mesh in statue.meshes.iter().filter(|mesh| mesh.name == "statue").map(Arc::clone) {
            let material = &mut statue.materials[mesh.material];
            (material.ior, material.roughness) = (ior, roughness);
        }
    }
    Ok(statue)
}

impl Found {
    /// The rows of the picture.
    fn images(&self) -> Vec<Image> {
        let of = |beside: &Beside| [PROFILE, HYBRID, WALK].map(|method| beside.image(method));
        let mut images = of(&self.shares).to_vec();
        images.extend([self.candies.image(PROFILE), self.candies.image(HYBRID), self.candies.map(HYBRID)]);
        images.extend(of(&self.candles).map(|image| brightened(&image, EXPOSURE)));
        images.extend(self.layers.iter().flat_map(of));
        images
    }

    /// The light of scattering and transmission together over that of both, and each share.
    fn sums(&self) -> [Estimate; 3] {
        let light = |picture: &[f64]| picture.iter().sum::<f64>();
        let all = |by: &[Vec<f64>]| light(&by[2]);
        [
            self.shares.statistic(|by| (light(&by[0]) + light(&by[1])) / all(by) - 1.0),
            self.shares.statistic(|by| light(&by[0]) / all(by)),
            self.shares.statistic(|by| light(&by[1]) / all(by)),
        ]
    }
}

fn claims(found: &Found) -> Vec<Claim> {
    let [sum, scattered, transmitted] = found.sums();
    let nearer = |beside: &Beside| beside.nearer(HYBRID, PROFILE);
    let errors = |beside: &Beside| {
        format!("{} by the hybrid, {} by the profile", percent(beside.error(HYBRID)), percent(beside.error(PROFILE)))
    };
    let lost = found.candles.brighter(HYBRID);
    let part = |method: usize| {
        let brighter = found.candles.brighter(method);
        percent(Estimate { value: 1.0 + brighter.value, ..brighter })
    };
    let [bare, layered] = [HYBRID, PROFILE].map(|method| [0, 1].map(|layer| found.layers[layer].error(method)));
    let grows = |[without, with]: [Estimate; 2]| with.less(without).is_positive();
    let list = |errors: [Estimate; 2]| errors.map(percent).join(" to ");
    vec![
        Claim::new(
            "Y1",
            "what is scattered and what is transmitted add up to the candy that has both, to 1 % of the picture",
            "candies",
            format!("off by {}; {} and {} of the picture", percent(sum), percent(scattered), percent(transmitted)),
            is_small(sum, 0.01),
        ),
        Claim::new(
            "Y2",
            "the hybrid is nearer to the walk than the profile",
            "candies",
            errors(&found.candies),
            nearer(&found.candies),
        ),
        Claim::new(
            "Y3",
            format!("lights inside bleed through wax as by the walk: within {:.0} % of its light", 100.0 * MATCH),
            "candles",
            format!("of the walk's light the hybrid has {}, the profile {}", part(HYBRID), part(PROFILE)),
            is_small(lost, MATCH),
        ),
        Claim::new(
            "Y4",
            "the hybrid is nearer to the walk than the profile",
            "candles",
            errors(&found.candles),
            nearer(&found.candles),
        ),
        Claim::new(
            "Y5",
            "under a layer that reflects the hybrid's error grows (a limitation that the slides name)",
            "statue",
            format!("{}, of the profile {}", list(bare), list(layered)),
            grows(bare),
        ),
        Claim::new(
            "Y6",
            "under the layer the hybrid is nearer to the walk than the profile",
            "statue",
            errors(&found.layers[1]),
            nearer(&found.layers[1]),
        ),
    ]
}

fn report(found: &Found, samples: u32, origin: &str) -> String {
    let (ior, roughness) = LAYER;
    let mut text = format!(
        "# Candies, candles, and a layer\n\nAfter Zhang and d'Eon 2025: candies and candles at the beginning, and slide 86.\n\n{origin}\n![Candies, candles and statues]({PICTURE})\n\nRows from top to \
         bottom: candies of a rough dielectric (index {IOR}, roughness {ROUGHNESS}) and a medium of a mean free path of {MEAN_FREE_PATH}, a tenth of their \
         height and a half, by the walk: {}. The same by profile and by hybrid, and where the hybrid is wrong: red tiles are brighter than by the walk, blue ones darker, of full colour where by half of the \
         picture's mean. The scene `candles`, at {EXPOSURE} times its brightness, whose lights burn inside of their wax: {}. The statue of {}:{} by the same, and under a layer of the \
         index of refraction {ior} and the roughness {roughness}.\n\n{RUNS} renders of {samples} samples a pixel by each method, paths of {MAX_DEPTH} segments, of the statue 3; intervals of 95 %, each by itself. Errors are \
         roots of the mean squared difference of tiles from the walk's, over their mean, without the noise of either.\n\n## Claims\n\n{}\n## Beside the walk\n\n| scene | profile: error | \
         brighter by | hybrid: error | brighter by |\n|---|---:|---:|---:|---:|\n",
        SHARES.join(", "),
        NAMES.join(", "),
        LAYERED.0,
        LAYERED.1,
        claim::table(&claims(found)),
    );
    let [bare, layered] = &found.layers;
    let rows = [("candies", &found.candies), ("candles", &found.candles), ("statue", bare), ("statue, layer", layered)];
    for (name, beside) in rows {
        let of = |method: usize| [beside.error(method), beside.brighter(method)].map(percent).join(" | ");
        let _ = writeln!(text, "| {name} | {} | {} |", of(PROFILE), of(HYBRID));
    }
    text + "\nA profile knows only light that comes from outside: of lights inside of a body its hybrid has what crosses the wax without a collision or with \
            one, and nothing of the rest. Candles need the walk.\n\nPicture by picture, \"scattering only\" has the light that collided, and \
            \"transmission only\" what did not, with what the surface, the floor and the sky give. All three have the same random numbers.\n"
}
