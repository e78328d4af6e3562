//! Diffusion profiles: [`restir_shared::diffusion`], from their pole to far beyond their reach, and of lengths from 10^-5 to 10^3.

use super::{Axis, Expected, Function, Row};
use glam::{Vec3, Vec4};
use restir_shared::diffusion::{
    Disk, DiskNumbers, Multiple, Profile, REACH, Remainder, Shape, Support, TAIL, ccdf, cdf, diffuse_albedo,
    invert_radius, radial_profile, sample_radius, single_profile,
};
use restir_shared::num;
use std::f64::consts::PI;

const U: (&str, Axis) = ("u", Axis::Unit);
const DISTANCE: (&str, Axis) = ("r / d", Axis::ZeroLog(1.0e-8, 60.0));
const LENGTH: (&str, Axis) = ("d", Axis::Log(1.0e-5, 1.0e3));
const ANISOTROPY: (&str, Axis) = ("g", Axis::Set(&[-0.999, -0.5, 0.0, 1.0e-6, 0.3, 0.8, 0.999]));
/// Nearer than this, in units of d, a profile is as high as there.
const NEAREST: f64 = 1.0e-5;

pub(super) fn rows() -> Vec<Row> {
    vec![nearer(), beyond(), radius(), number(), reflected(), profile(), single(), rest(), weight(false), weight(true)]
}

/// `exp(-x) + exp(-x / 3)` over `8 pi d r`.
fn exact(r: f64, d: f64) -> f64 {
    let x = r / d;
    ((-x).exp() + (-x / 3.0).exp()) / (8.0 * PI * d * r.max(NEAREST * d))
}

fn albedo(absorbed: f64, g: f64) -> f64 {
    let unlike = (1.0 - g) + g * absorbed;
    let q = (absorbed / unlike).sqrt();
    (1.0 - absorbed) * (1.0 - g) / (unlike * (1.0 + q) * (1.0 + 1.554 * q))
}

fn nearer() -> Row {
    Function::new("diffusion::cdf", &[DISTANCE], |p| [cdf(p[0])]).against(|p| {
        let v = -(-p[0] / 3.0).exp_m1();
        [Expected::relative(v * (6.0 - 3.0 * v + v * v) / 4.0)]
    })
}

fn beyond() -> Row {
    let f = |p: &[f32]| [ccdf(p[0])];
    Function::new("diffusion::ccdf", &[DISTANCE], f)
        .against(|p| [Expected::relative(0.25 * (-p[0]).exp() + 0.75 * (-p[0] / 3.0).exp())])
}

/// The root of the cubic by Newton's steps in what is small of `w` and `1 - w`.
fn radius() -> Row {
    let f = |p: &[f32]| [sample_radius(p[0])];
    Function::new("sample_radius", &[U], f).against(|p| {
        let within = 1.0 - f64::from(TAIL);
        let (near, far) = (within * (1.0 - p[0]), f64::from(TAIL) + within * p[0]);
        let (mut v, mut w) = (near / 1.5, far * 4.0 / 3.0);
        for _ in 0..60 {
            v -= (v * (6.0 + v * (v - 3.0)) - 4.0 * near) / (6.0 + v * (3.0 * v - 6.0));
            w -= (w * (3.0 + w * w) - 4.0 * far) / (3.0 + 3.0 * w * w);
        }
        [Expected::relative(if near < far { -3.0 * (-v).ln_1p() } else { -3.0 * w.ln() })]
    })
}

fn number() -> Row {
    let f = |p: &[f32]| [invert_radius(p[0])];
    Function::new("invert_radius", &[U], f)
        .against(|p| {
            let (near, far) = ((-p[0]).exp_m1(), (-p[0] / 3.0).exp_m1());
            let u = 1.0 + (0.25 * near + 0.75 * far) / (1.0 - f64::from(TAIL));
            [Expected::against(u.clamp(0.0, 1.0), 1.0)]
        })
        .of(|p| [sample_radius(p[0])])
}

fn reflected() -> Row {
    let f = |p: &[f32]| [diffuse_albedo(1.0 - p[0], p[0], p[1])];
    // the albedo is one less what is absorbed, and rounded
    let row = Function::new("diffuse_albedo", &[("1 - albedo", Axis::ZeroLog(1.0e-6, 0.999)), ANISOTROPY], f);
    row.against(|p| [Expected::relative(albedo(p[0], p[1]))]).near(0..1)
}

fn profile() -> Row {
    let f = |p: &[f32]| [radial_profile(p[0], p[1])];
    Function::new("radial_profile", &[DISTANCE, LENGTH], f)
        .against(|p| [Expected::relative(exact(p[0], p[1]))])
        .of(|p| [p[0] * p[1], p[1]])
}

fn single() -> Row {
    let f = |p: &[f32]| [single_profile(p[0], p[1], 0.5, Shape::Diffuse)];
    Function::new("single_profile", &[("r / l", Axis::Log(1.0e-8, 16.0)), ("l", Axis::Log(1.0e-5, 1.0e3))], f)
        .against(|p| {
            let x = 4.14 * p[0] / p[1];
            let light = (-x).exp() + (-x / 3.0).exp();
            [Expected::relative(0.5 * (0.5 / 2.554) * 4.14 * light / (8.0 * PI * p[1] * p[0]))]
        })
        .of(|p| [p[0] * p[1], p[1]])
}

/// `Rn / R`: the error is relative to the profile, of which it is a difference.
fn rest() -> Row {
    let f = |p: &[f32]| [Multiple::new(1.0 - p[1], p[1], p[2], Remainder::Diffuse).share(p[0])];
    let axes = [("r / l", Axis::ZeroLog(1.0e-8, 20.0)), ("1 - albedo", Axis::ZeroLog(1.0e-6, 0.9)), ANISOTROPY];
    let row = Function::new("Multiple::share", &axes, f).against(|p| {
        let (x, absorbed, g) = (p[0], p[1], p[2]);
        let a = albedo(absorbed, g);
        let s = 1.9 - a + 3.5 * (a - 0.8) * (a - 0.8);
        let light = |s: f64| s * ((-s * x).exp() + (-s * x / 3.0).exp());
        let once = (1.0 - absorbed) * (0.5 / 2.554) * light(4.14) / (a * light(s));
        [Expected::against((1.0 - once).max(0.0), 1.0)]
    });
    // both albedos are rounded, and an exponent of 28 has lost 5 bits
    Row { tolerance: 2.0e-5, ..row }
}

/// Of a point that a segment of one channel finds, or not: the profile over all densities, in channels as different as there are.
fn weight(published: bool) -> Row {
    let support = if published { Support::Published } else { Support::Exact };
    let disk = move |d: f32, ratio: f32| {
        let profile = Profile::new(Vec3::new(0.9, 0.5, 0.2), Vec3::new(d, d * ratio, 0.0));
        Disk { support, ..Disk::new(Vec3::ZERO, Vec3::Z, profile) }
    };
    let f = move |p: &[f32]| {
        let (weight, density) = disk(p[6], p[7]).weight(Vec3::from_slice(p), Vec3::from_slice(&p[3..]));
        // in units of a density that is as large as the profile's own
        [weight.x, weight.y, density * p[6] * p[6]]
    };
    let axes = [
        U,
        ("axis and turn", Axis::Coarse),
        ("along it", Axis::Set(&[-0.9, 0.0, 1.0e-4, 0.5])),
        ("cos", Axis::Set(&[-1.0, -1.0e-3, 0.5, 1.0])),
        LENGTH,
        ("of the other channel, over it", Axis::Set(&[1.0e-3, 0.1, 1.0, 30.0])),
    ];
    let name = if published { "Disk::weight, published support" } else { "Disk::weight" };
    Function::new(name, &axes, f)
        .against(move |p| {
            let at = glam::DVec3::from_slice(p);
            let cosines = glam::DVec3::from_slice(&p[3..]);
            let r = at.length();
            let distances = [p[6], p[7] * p[6]];
            let reaches = |d: f64| published || r <= f64::from(REACH) * d;
            // frames of +z have the axes as tangents
            let of_axis = |across: f64, cosine: f64, probability: f64| -> f64 {
                let of = |&d: &f64| if reaches(d) { 0.5 * exact(across, d) } else { 0.0 };
                probability * cosine.abs() * distances.iter().map(of).sum::<f64>() / (1.0 - f64::from(TAIL))
            };
            let density = of_axis(at.x.hypot(at.y), cosines.z, 0.5)
                + of_axis(at.y.hypot(at.z), cosines.x, 0.25)
                + of_axis(at.x.hypot(at.z), cosines.y, 0.25);
            let worth = |d: f64, albedo: f32| {
                let there = density > 0.0 && r <= f64::from(REACH) * d;
                if there { f64::from(albedo) * exact(r, d) / density } else { 0.0 }
            };
            let value = |w: f64| Expected::against(w, w.abs().max(1.0e-6));
            [value(worth(distances[0], 0.9)), value(worth(distances[1], 0.5)), value(density * p[6] * p[6])]
        })
        .of(move |p| {
            let (d, ratio) = (p[4], p[5]);
            // nearer than the shorter reach of both by a hair, or farther
            let r = sample_radius(p[0]) * d * 0.999;
            let numbers = DiskNumbers::new(Vec4::new(p[1], 0.0, 0.0, p[1]), &disk(d, ratio).profile);
            let (sin, cos) = num::sin_cos(numbers.turn);
            let (x, y, z) = (r * cos, r * sin, r * p[2]);
            let beside = num::sqrt(1.0 - p[3] * p[3]);
            let normal = Vec3::new(0.6 * beside, 0.8 * beside, p[3]);
            let at = match numbers.axis {
                0 => [x, y, z],
                1 => [z, x, y],
                _ => [y, z, x],
            };
            [&at[..], &normal.to_array(), &[d, ratio]].concat()
        })
}
