//! Zhang and d'Eon 2025, the statue, the head and slide 87: profile, hybrid and walk where a body is thin, hollow or curved, and by how dense it is.

use std::fmt::Write;

use restir::Error;
use restir::image::Image;
use restir::scene::{Camera, Scene, builtin};
use restir_shared::glam::DVec3;

use super::beside::{Beside, HYBRID, NAMES, PROFILE, RUNS, methods, percent};
use super::claim::{self, Claim};
use super::picture::grid;
use super::{Environs, Files, PICTURE};
use crate::bench::fit::Estimate;
use crate::bench::table::Setup;

const SCENE: &str = "statue";
/// Media, of which a millimetre is so many units long: what is shown, and what is counted beside it.
const MEDIA: [(&str, f64); 2] = [("skin1", 0.02), ("marble", 0.02)];
/// Where the camera looks, from where it stands in the scene, and degrees from the lower to the upper edge of the picture.
const PLACES: [(&str, DVec3, f64); 4] = [
    ("ears: thin", DVec3::new(0.02, 1.8, 0.02), 8.5),
    ("hand: thin and curved", DVec3::new(0.56, 1.2, 0.3), 4.5),
    ("face: hollow sockets, a nose", DVec3::new(0.02, 1.37, 0.2), 6.0),
    ("belly: thick, with a navel", DVec3::new(0.02, 0.56, 0.3), 11.0),
];
/// Of the places, those that are thin.
const THIN: usize = 2;
/// From dense to thin, units a millimetre of a medium; those that are shown.
const DENSITY_OF: &str = "marble";
const DENSITIES: [f64; 5] = [0.001, 0.01, 0.05, 0.2, 1.0];
const SHOWN: [usize; 3] = [0, 2, 4];

/// One medium in the whole statue, by places or as a whole.
struct Found {
    places: Vec<Vec<Beside>>,
    densities: Vec<Beside>,
}

/// The files of the figure, of so many samples a pixel in each of the renders.
///
/// # Errors
/// As of [`restir::render::Render::render`].
pub(crate) fn make(environs: &mut impl Environs, size: [u32; 2], samples: u32, setup: &Setup) -> Result<Files, Error> {
    let statue = builtin::scene(SCENE).ok_or_else(|| Error::Setting(format!("there is no scene {SCENE}")))?;
    let filled = |medium: &str, millimetre: f64| -> Result<Scene, Error> {
        let mut scene = statue.clone();
        scene.fill(medium, Some(millimetre))?;
        Ok(scene)
    };
    let mut beside = |what: &str, scene: &Scene| Beside::of(environs, what, scene, &methods(3), (size, samples));
    let mut by_place = |&(medium, millimetre): &(&str, f64)| {
        let place = |&(name, target, degrees): &(&str, DVec3, f64)| {
            let mut scene = filled(medium, millimetre)?;
            let camera =
                scene.camera.take().map(|camera| Camera { target, vertical_fov: f64::to_radians(degrees), ..camera });
            beside(&format!("{medium}, {name}"), &Scene { camera, ..scene })
        };
        PLACES.iter().map(place).collect::<Result<Vec<_>, Error>>()
    };
    let places = MEDIA.iter().map(&mut by_place).collect::<Result<Vec<_>, _>>()?;
    let by_density =
        |&millimetre: &f64| beside(&format!("{DENSITY_OF}:{millimetre}"), &filled(DENSITY_OF, millimetre)?);
    let densities = DENSITIES.iter().map(by_density).collect::<Result<Vec<_>, Error>>()?;
    let found = Found { places, densities };
    let rows = found.places[0].iter().chain(SHOWN.map(|i| &found.densities[i]));
    let images: Vec<Image> = rows.flat_map(row).collect();
    let report = report(&found, samples, &setup.markdown(""));
    Ok(Files { picture: Some(grid(&images, NAMES.len() + 2)), texts: Vec::new(), report })
}

/// The pictures by all methods, and where profile and hybrid are wrong.
fn row(beside: &Beside) -> Vec<Image> {
    let images = (0..NAMES.len()).map(|method| beside.image(method));
    images.chain([PROFILE, HYBRID].map(|method| beside.map(method))).collect()
}

fn of_places(found: &Found) -> Vec<Claim> {
    let mut claims = Vec::new();
    for (ids, ((medium, _), places)) in [["L1", "L2"], ["L3", "L4"]].into_iter().zip(MEDIA.iter().zip(&found.places)) {
        for (id, (what, places)) in
            ids.into_iter().zip([("thin", &places[..THIN]), ("hollow or thick", &places[THIN..])])
        {
            let nearer: Vec<_> = places.iter().map(|place| place.nearer(HYBRID, PROFILE)).collect();
            let errors = places.iter().map(|place| {
                format!(
                    "{} by the hybrid, {} by the profile",
                    percent(place.error(HYBRID)),
                    percent(place.error(PROFILE))
                )
            });
            claims.push(Claim::new(
                id,
                format!("the hybrid is nearer to the walk than the profile where a body is {what}"),
                medium,
                errors.collect::<Vec<_>>().join("; "),
                claim::all(nearer),
            ));
        }
    }
    claims
}

fn of_densities(found: &Found) -> [Claim; 2] {
    let errors: Vec<Estimate> = found.densities.iter().map(|cell| cell.error(HYBRID)).collect();
    let middle = &errors[1..errors.len() - 1];
    let peak = middle.iter().copied().max_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or(errors[0]);
    let above = |end: usize| peak.less(errors[end]).is_positive();
    let light: Vec<Estimate> = found.densities[1..errors.len() - 1].iter().map(|cell| cell.brighter(HYBRID)).collect();
    let darker = light.iter().map(|light| light.is_positive().map(|brighter| !brighter));
    let list = |of: &[Estimate]| of.iter().copied().map(percent).collect::<Vec<_>>().join(", ");
    [
        Claim::new(
            "L5",
            "the hybrid's error is larger at medium density than for dense and for thin bodies",
            DENSITY_OF,
            list(&errors),
            claim::all([above(0), above(errors.len() - 1)]),
        ),
        Claim::new(
            "L6",
            "there the hybrid is darker than the walk: it misses light of many collisions",
            DENSITY_OF,
            format!("brighter by {}", list(&light)),
            claim::all(darker),
        ),
    ]
}

fn report(found: &Found, samples: u32, origin: &str) -> String {
    let claims: Vec<Claim> = of_places(found).into_iter().chain(of_densities(found)).collect();
    let mut text = format!(
        "# Thin, hollow and curved places\n\nAfter Zhang and d'Eon 2025: the statue and the head at the beginning, and slide 87.\n\n{origin}\n![Places and densities]({PICTURE})\n\nOf the \
         scene `{SCENE}`, from left to right: {}; and where profile and hybrid are wrong: red tiles are brighter than by the walk, blue ones darker, of full colour where by \
         half of the picture's mean. The first rows are {} of {}; the last ones all of it of {DENSITY_OF} of which a millimetre is {} long.\n\n{RUNS} renders of {samples} samples a \
         pixel by each method, paths of 3 segments; intervals of 95 %, each by itself. Errors are roots of the mean squared difference of tiles from the walk's, over their mean, \
         without the noise of either.\n\n## Claims\n\n{}\n## Places\n\n",
        NAMES.join(", "),
        PLACES.map(|(name, ..)| name).join("; "),
        named(MEDIA[0]),
        SHOWN.map(|i| DENSITIES[i].to_string()).join(", "),
        claim::table(&claims),
    );
    let head = "| profile: error | brighter by | hybrid: error | brighter by |\n|---|---:|---:|---:|---:|\n";
    let _ = write!(text, "| place {head}");
    for (medium, places) in MEDIA.iter().zip(&found.places) {
        for ((name, ..), place) in PLACES.iter().zip(places) {
            let _ = writeln!(text, "| {}, {name} {}", named(*medium), cells(place));
        }
    }
    let _ = write!(text, "\n## Densities\n\n| {DENSITY_OF}, units a millimetre {head}");
    for (millimetre, cell) in DENSITIES.iter().zip(&found.densities) {
        let _ = writeln!(text, "| {millimetre} {}", cells(cell));
    }
    text
}

fn named((medium, millimetre): (&str, f64)) -> String {
    format!("{medium}:{millimetre}")
}

fn cells(beside: &Beside) -> String {
    let of = |method: usize| [beside.error(method), beside.brighter(method)].map(percent).join(" | ");
    format!("| {} | {} |", of(PROFILE), of(HYBRID))
}
