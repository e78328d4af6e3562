//! Media: [`restir_shared::medium`] and the phase function, at the hazards of their ends: extinction to 0, albedo to 1, anisotropy to -1 and
//! 1, optical depths from 10^-6 to 87, scenes from 10^-4 to 10^4.

use super::{Axis, Expected, Function, Row};
use glam::{DVec3, Vec2, Vec3};
use restir_host::buffers::SceneBuffers;
use restir_host::scene::{Material, Mesh, Scene, Volume};
use restir_shared::geometry::{Hit, Ray};
use restir_shared::medium::{Channels, Medium, albedo_of_color, transmittance};
use restir_shared::sampling::{
    henyey_greenstein_between, henyey_greenstein_pdf, henyey_greenstein_scale, henyey_greenstein_shape,
    invert_henyey_greenstein, sample_henyey_greenstein,
};
use restir_shared::scene::Surface as _;
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

const U: (&str, Axis) = ("u", Axis::Unit);
const V: (&str, Axis) = ("v", Axis::Coarse);
const COLOR: (&str, Axis) = ("colour", Axis::ZeroLog(1.0e-6, 1.0));
const ANISOTROPY: (&str, Axis) = ("g", Axis::Set(&[-0.999, -0.9, -0.5, -1.0e-3, 0.0, 1.0e-6, 0.3, 0.8, 0.99, 0.999]));
const RATE: (&str, Axis) = ("extinction", Axis::Log(1.0e-4, 1.0e4));
const DEPTH: (&str, Axis) = ("optical depth", Axis::ZeroLog(1.0e-6, 87.0));
const SECOND: (&str, Axis) = ("of another channel, over it", Axis::Set(&[0.0, 1.0e-6, 0.5, 1.0, 3.0, 1.0e4]));
/// A channel in which nothing collides gives no distance of a collision, and another one none beyond 17 mean free paths.
const COLLIDING: (&str, Axis) = ("of another channel, over it", Axis::Set(&[1.0e-6, 0.5, 1.0, 3.0, 1.0e4]));
const WEIGHT: (&str, Axis) = ("its weight", Axis::Set(&[0.0, 1.0e-6, 1.0, 1.0e6]));
/// Weights whose probabilities have no rounding, so that it is known which channel is chosen.
const EXACT_WEIGHT: (&str, Axis) = ("its weight", Axis::Set(&[0.0, 1.0, 3.0]));
const ABSORBED: (&str, Axis) = ("what is absorbed", Axis::ZeroLog(1.0e-12, 1.0));
const SHARE: (&str, Axis) = ("of the way", Axis::Coarse);
/// Colours of the media whose records are read from a scene, and their anisotropies: as white as `f32` has colours.
const COLORS: &[f32] = &[1.0e-6, 0.01, 0.5, 0.9, 0.99, 0.999, 0.999_9, 0.999_999, 1.0 - 5.960_464_5e-8, 1.0];
const TURNS: &[f32] = &[-0.999, -0.5, 0.0, 0.5, 0.999];

pub(super) fn rows() -> Vec<Row> {
    vec![
        albedo(),
        absorbed(),
        color(),
        record(),
        turn(),
        turn_there_and_back(),
        of_direction(),
        of_number(),
        between(),
        left(),
        distance(),
        collided(true),
        collided(false),
        collided_within(),
    ]
}

/// Van de Hulst's S of a colour, by a root that does not cancel.
fn similarity(c: f64) -> f64 {
    let b = 1.139 + 1.17 * c;
    2.0 * (1.0 - c) / (b + (b * b - 0.556 * (1.0 - c)).sqrt())
}

/// What a collision absorbs in the medium of a colour.
fn absorbed_by(c: f64, g: f64) -> f64 {
    let s = similarity(c);
    s * s * (1.0 - g) / (1.0 - g + g * (1.0 - s) * (1.0 + s))
}

fn absorbed() -> Row {
    let f = |p: &[f32]| [Medium::of_color(Vec3::splat(p[0]), Vec3::ONE, p[1]).absorbed.z];
    Function::new("Medium::of_color().absorbed", &[COLOR, ANISOTROPY], f)
        .against(|p| [Expected::relative(absorbed_by(p[0], p[1]))])
}

/// A medium by what it absorbs, down to nothing.
fn color() -> Row {
    let f = |p: &[f32]| {
        let [albedo, absorbed] = [p[1], p[0]].map(Vec3::splat);
        [Medium { extinction: Vec3::ONE, albedo, absorbed, anisotropy: p[2] }.color().x]
    };
    let row = Function::new("Medium::color", &[ABSORBED, ANISOTROPY], f).against(|p| {
        let (absorbed, albedo, g) = (p[0], p[1], p[2]);
        let unlike = 1.0 - g + g * absorbed;
        let s = (absorbed / unlike).sqrt();
        let one_less_s = albedo * (1.0 - g) / (unlike * (1.0 + s));
        [Expected::relative(one_less_s * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))]
    });
    row.of(|p| [p[0], 1.0 - p[0], p[1]])
}

/// Bodies of all media, as kernels find them: triangles of the first lie at the index of the medium.
static BODIES: LazyLock<(SceneBuffers, Vec<u32>)> = LazyLock::new(|| {
    let mut scene = Scene { name: "media".to_owned(), ..Scene::default() };
    for (index, (color, g)) in media().enumerate() {
        let volume = Some(Volume::scattering([color; 3], [1.0; 3], g));
        let name = format!("{index}");
        let white = Material { diffuse_transmission: 1.0, volume, ..Material::diffuse(name.clone(), [1.0; 3]) };
        let material = scene.add_material(white);
        let corner = DVec3::new(3.0 * index as f64, 0.0, 0.0);
        scene.add_mesh(&name, material, Mesh::cuboid(corner, corner + DVec3::ONE));
    }
    let buffers = SceneBuffers::build(&scene).expect("the scene is valid");
    // whose triangle is whose is asked of the scene itself
    let above = |index: usize| {
        let origin = Vec3::new(3.0 * index as f32 + 0.3, 5.0, 0.6);
        let ray = Ray { origin, direction: -Vec3::Y, t_max: Ray::FAR, key: 0 };
        restir_shared::scene::Trace::closest(&buffers.view(), &ray).id
    };
    let bodies = (0..media().count()).map(above).collect();
    (buffers, bodies)
});

fn media() -> impl Iterator<Item = (f32, f32)> {
    COLORS.iter().flat_map(|&color| TURNS.iter().map(move |&g| (color, g)))
}

/// What kernels know of a medium: where next to nothing is absorbed, one less the albedo has lost its digits.
fn record() -> Row {
    let axes = [("colour", Axis::Set(COLORS)), ("g", Axis::Set(TURNS))];
    let f = |p: &[f32]| {
        let (buffers, bodies) = &*BODIES;
        let index = media().position(|medium| medium == (p[0], p[1])).expect("one of them");
        let (view, hit) = (buffers.view(), Hit { id: bodies[index], ..Hit::MISS });
        let medium = view.interior(&hit).medium(view.absorbed(&hit));
        [medium.absorbed.x, medium.albedo.y, medium.color().z]
    };
    Function::new("Interior::medium, by the scene's record", &axes, f).against(|p| {
        let absorbed = absorbed_by(p[0], p[1]);
        let one_less_s2 = (1.0 - similarity(p[0])) * (1.0 + similarity(p[0]));
        let albedo = if p[0] > 0.5 { 1.0 - absorbed } else { one_less_s2 / (1.0 - p[1] + p[1] * one_less_s2) };
        [absorbed, albedo, p[0]].map(Expected::relative)
    })
}

/// One less and one more than the cosine of a number.
fn exact_turn(u: f64, g: f64) -> [f64; 2] {
    let (v, d) = (1.0 - u, 1.0 - g + 2.0 * g * u);
    let [backward, forward] = [(1.0 - g) / d, (1.0 + g) / d];
    [2.0 * v * backward * backward * (1.0 + g * u), 2.0 * u * forward * forward * (1.0 - g * v)]
}

/// Relative to the sine across, and to the nearer end along.
fn turn() -> Row {
    let f = |p: &[f32]| sample_henyey_greenstein(Vec2::new(p[0], p[1]), p[2]).to_array();
    Function::new("sample_henyey_greenstein", &[U, V, ANISOTROPY], f).against(|p| {
        let [less, more] = exact_turn(p[0], p[2]);
        let (sine, turned) = ((less * more).sqrt(), TAU * p[1]);
        let cosine = if less < more { 1.0 - less } else { more - 1.0 };
        [
            Expected::against(sine * turned.cos(), sine),
            Expected::against(sine * turned.sin(), sine),
            Expected::against(cosine, 1.0),
        ]
    })
}

/// The numbers come back: the second on its circle, and not from the poles, where there is none.
fn turn_there_and_back() -> Row {
    let f = |p: &[f32]| {
        let w = sample_henyey_greenstein(Vec2::new(p[0], p[1]), p[2]);
        let again = invert_henyey_greenstein(w, p[2]);
        let away = (again.y - p[1]).abs();
        let is_pole = w.x == 0.0 && w.y == 0.0;
        [again.x, if is_pole { 0.0 } else { away.min(1.0 - away) }]
    };
    let row = Function::new("invert_henyey_greenstein of a sample", &[U, V, ANISOTROPY], f)
        .against(|p| [Expected::against(p[0], 1.0), Expected::against(0.0, 1.0)]);
    Row { tolerance: 1.0e-6, ..row }
}

/// Of what is sampled; the shadow has the direction as it is rounded.
fn of_direction() -> Row {
    let f = |p: &[f32]| [henyey_greenstein_pdf(Vec3::from_slice(p), p[3])];
    let row = Function::new("henyey_greenstein_pdf", &[U, V, ANISOTROPY], f).against(|p| {
        let (across, g) = (p[0] * p[0] + p[1] * p[1], p[3]);
        let squared = if p[2] >= 0.0 {
            (1.0 - g).powi(2) + 2.0 * g * across / (1.0 + p[2])
        } else {
            (1.0 + g).powi(2) - 2.0 * g * across / (1.0 - p[2])
        };
        [Expected::relative((1.0 - g * g) / (4.0 * PI * squared.powf(1.5)))]
    });
    let direction = |p: &[f32]| {
        let w = sample_henyey_greenstein(Vec2::new(p[0], p[1]), p[2]);
        [w.x, w.y, w.z, p[2]]
    };
    row.of(direction).near(0..3)
}

/// Of two channels, one of which has the weight 1; numbers of 0 to 1 choose.
fn distance() -> Row {
    let f = |p: &[f32]| {
        let channels = Channels::new(Vec3::new(p[0], p[1], p[0]), Vec3::new(1.0, p[2], 0.0));
        [channels.sample(Vec2::new(p[3], p[4]))]
    };
    let row = Function::new("Channels::sample", &[RATE, COLLIDING, EXACT_WEIGHT, V, U], f).against(|p| {
        let rate = if p[3] < 1.0 / (1.0 + p[2]) { p[0] } else { p[1] };
        [Expected::relative(-(-p[4]).ln_1p() / rate)]
    });
    row.of(|p| [p[0], p[0] * p[1], p[2], p[3], p[4]])
}

/// As `Channels::collided`, of distances below a length.
fn collided_within() -> Row {
    let f = |p: &[f32]| {
        let channels = Channels::new(Vec3::new(p[0], p[1], p[0]), Vec3::new(1.0, p[2], 0.0));
        channels.collided_within(p[3], p[4]).to_array()
    };
    let axes = [RATE, COLLIDING, WEIGHT, ("optical depth", Axis::Log(1.0e-6, 87.0)), SHARE];
    let row = Function::new("Channels::collided_within", &axes, f).against(|p| {
        let (rates, weights) = ([p[0], p[1], p[0]], [1.0 / (1.0 + p[2]), p[2] / (1.0 + p[2]), 0.0]);
        let least = if p[2] > 0.0 { p[0].min(p[1]) } else { p[0] };
        let light = rates.map(|rate| (-(rate - least) * p[3]).exp());
        let of = |i: usize| weights[i] * light[i] * rates[i] / -(-rates[i] * p[4]).exp_m1();
        let density: f64 = (0..3).map(of).sum();
        let worth = [0, 1, 2].map(|i| rates[i] * light[i] / density);
        let largest = worth.into_iter().fold(0.0, f64::max);
        worth.map(|worth| Expected::against(worth, largest))
    });
    let row = Row { tolerance: 2.0e-5, ..row };
    row.of(|p| {
        let length = p[3] / p[0].max(p[0] * p[1]);
        [p[0], p[0] * p[1], p[2], p[4] * length, length]
    })
}

/// Van de Hulst's formula by a root that does not cancel.
fn albedo() -> Row {
    let f = |p: &[f32]| [albedo_of_color(Vec3::splat(p[0]), p[1]).y];
    Function::new("albedo_of_color", &[COLOR, ANISOTROPY], f).against(|p| {
        let (c, g) = (p[0], p[1]);
        let s = similarity(c);
        let one_less_s2 = c * (1.0 + 1.17 * s) / (1.0 - 0.139 * s) * (1.0 + s);
        [Expected::relative(one_less_s2 / (1.0 - g + g * one_less_s2))]
    })
}

fn of_number() -> Row {
    let f = |p: &[f32]| [henyey_greenstein_scale(p[1]) * henyey_greenstein_shape(p[0], p[1])];
    Function::new("density of a turn by its number", &[U, ANISOTROPY], f).against(|p| {
        let (u, g) = (p[0], p[1]);
        let (d, whole) = (1.0 - g + 2.0 * g * u, (1.0 - g) * (1.0 + g));
        [Expected::relative(d.powi(3) / (4.0 * PI * whole * whole))]
    })
}

/// From +z to what is sampled; the shadow has the directions as they are rounded.
fn between() -> Row {
    let f = |p: &[f32]| [henyey_greenstein_between(Vec3::Z, Vec3::from_slice(p), p[3])];
    let direction = |p: &[f32]| {
        let w = sample_henyey_greenstein(glam::Vec2::new(p[0], p[1]), p[2]);
        [w.x, w.y, w.z, p[2]]
    };
    let row = Function::new("henyey_greenstein_between", &[U, V, ANISOTROPY], f).against(|p| {
        let (across, g) = (p[0] * p[0] + p[1] * p[1], p[3]);
        let [less, more] = [1.0 - p[2], 1.0 + p[2]].map(|along| 0.5 * (across + along * along));
        let squared = if g >= 0.0 { (1.0 - g).powi(2) + 2.0 * g * less } else { (1.0 + g).powi(2) - 2.0 * g * more };
        [Expected::relative((1.0 - g * g) / (4.0 * PI * squared.powf(1.5)))]
    });
    row.of(direction).near(0..3)
}

fn left() -> Row {
    let f = |p: &[f32]| [transmittance(Vec3::splat(p[0]), p[1]).z];
    let row = Function::new("transmittance", &[RATE, DEPTH], f).against(|p| [Expected::relative((-p[0] * p[1]).exp())]);
    row.of(|p| [p[0], p[1] / p[0]])
}

/// What a collision at a distance, or to pass it, is worth by channel, relative to the largest: of two channels of which one is chosen with
/// the weight 1.
fn collided(collides: bool) -> Row {
    let f = move |p: &[f32]| {
        let channels = Channels::new(Vec3::new(p[0], p[1], p[0]), Vec3::new(1.0, p[2], 0.0));
        channels.worth(p[3], collides).to_array()
    };
    let name = if collides { "Channels::collided" } else { "Channels::passed" };
    let second = if collides { COLLIDING } else { SECOND };
    let row = Function::new(name, &[RATE, second, WEIGHT, DEPTH], f).against(move |p| {
        let (rates, weights) = ([p[0], p[1], p[0]], [1.0 / (1.0 + p[2]), p[2] / (1.0 + p[2]), 0.0]);
        let least = if p[2] > 0.0 { p[0].min(p[1]) } else { p[0] };
        let light = rates.map(|rate| if collides { rate } else { 1.0 } * (-(rate - least) * p[3]).exp());
        let density: f64 = light.iter().zip(weights).map(|(light, weight)| light * weight).sum();
        let worth = light.map(|light| light / density);
        let largest = worth.into_iter().fold(0.0, f64::max);
        worth.map(|worth| Expected::against(worth, largest))
    });
    // an exponent of 87 has lost 7 bits where the channel that is chosen is the thinner one
    let row = Row { tolerance: 2.0e-5, ..row };
    row.of(|p| [p[0], p[0] * p[1], p[2], p[3] / p[0].max(p[0] * p[1])])
}
