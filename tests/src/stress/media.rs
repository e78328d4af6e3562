//! Media: [`restir_shared::medium`] and the phase function, at the hazards of their ends: extinction to 0, albedo to 1, anisotropy to -1 and
//! 1, optical depths from 10^-6 to 87, scenes from 10^-4 to 10^4.

use super::{Axis, Expected, Function, Row};
use glam::Vec3;
use restir_shared::medium::{Channels, albedo_of_color, transmittance};
use restir_shared::sampling::{
    henyey_greenstein_between, henyey_greenstein_scale, henyey_greenstein_shape, sample_henyey_greenstein,
};
use std::f64::consts::PI;

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

pub(super) fn rows() -> Vec<Row> {
    vec![albedo(), of_number(), between(), left(), collided(true), collided(false)]
}

/// Van de Hulst's formula by a root that does not cancel.
fn albedo() -> Row {
    let f = |p: &[f32]| [albedo_of_color(Vec3::splat(p[0]), p[1]).y];
    Function::new("albedo_of_color", &[COLOR, ANISOTROPY], f).against(|p| {
        let (c, g) = (p[0], p[1]);
        let b = 1.139 + 1.17 * c;
        let s = 2.0 * (1.0 - c) / (b + (b * b - 0.556 * (1.0 - c)).sqrt());
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
