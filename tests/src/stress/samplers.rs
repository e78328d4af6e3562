//! The samplers of [`restir_shared::sampling`].

use super::{Axis, Expected, Function, Row};
use glam::{Vec2, Vec3};
use restir_host::distribution::integer_cdf;
use restir_shared::sampling::{self as f32s, CDF_END, TableSample};
use std::f64::consts::{FRAC_PI_4, PI, TAU};
use std::sync::LazyLock;

const U: (&str, Axis) = ("u", Axis::Unit);
const V: (&str, Axis) = ("v", Axis::Unit);
const VERSINE: (&str, Axis) = ("versine", Axis::Log(1.0e-12, 2.0));
const RATE: (&str, Axis) = ("rate", Axis::Log(1.0e-6, 1.0e6));
const DEPTH: (&str, Axis) = ("optical depth", Axis::ZeroLog(1.0e-12, 1.0e6));
const T_MAX: (&str, Axis) = ("t_max", Axis::Log(1.0e-4, 1.0e5));
const COS: (&str, Axis) = ("cos", Axis::ZeroLog(1.0e-6, 1.0));
const SIN2: (&str, Axis) = ("sin²", Axis::ZeroLog(1.0e-24, 1.0));
const AREA: (&str, Axis) = ("area", Axis::Log(1.0e-12, 1.0e12));
const FINE: (&str, Axis) = ("u", Axis::Fine);
const SHORT: (&str, Axis) = ("optical depth", Axis::ZeroLog(1.0e-12, 87.0));
const PART: (&str, Axis) = ("t / t_max", Axis::Fine);
const HALF_WORD: Axis = Axis::Below(1 << 16);
const HIGH: (&str, Axis) = ("word / 2¹⁶", HALF_WORD);
const LOW: (&str, Axis) = ("word mod 2¹⁶", HALF_WORD);
const SECOND_HIGH: (&str, Axis) = ("second word / 2¹⁶", HALF_WORD);
const SECOND_LOW: (&str, Axis) = ("second word mod 2¹⁶", HALF_WORD);
const LIST: (&str, Axis) = ("list", Axis::Below(4));
const COUNT: (&str, Axis) = ("count", Axis::Set(&[1.0, 2.0, 3.0, 1000.0, 16_777_216.0]));

pub(super) fn rows() -> Vec<Row> {
    [directions(), points(), filters(), distances(), choices()].into_iter().flatten().collect()
}

fn vec2(p: &[f32]) -> Vec2 {
    Vec2::from_slice(p)
}

fn vec3(p: &[f32]) -> Vec3 {
    Vec3::from_slice(p)
}

/// The direction `depth` below the pole: horizontal components relative to their length, z to that of the vector.
fn direction(depth: f64, turn: f64) -> [Expected; 3] {
    let [x, y] = circle((depth * (2.0 - depth)).sqrt(), turn);
    [x, y, Expected::against(1.0 - depth, 1.0)]
}

fn circle(r: f64, turn: f64) -> [Expected; 2] {
    let (sin, cos) = (TAU * turn).sin_cos();
    [Expected::against(r * cos, r), Expected::against(r * sin, r)]
}

/// A number that is sampled from: a fraction of its range.
fn unit(u: f64) -> Expected {
    Expected::against(u.clamp(0.0, 1.0), 1.0)
}

fn azimuth(p: &[f64]) -> Expected {
    // the zeros of a pole have signs, but no angle
    let turn = if p[0] == 0.0 && p[1] == 0.0 { 0.0 } else { p[1].atan2(p[0]) / TAU };
    unit(if turn < 0.0 { turn + 1.0 } else { turn })
}

/// `1 - z` of a direction, by the half angle.
fn depth_below_pole(p: &[f64]) -> f64 {
    2.0 * (0.5 * p[0].hypot(p[1]).atan2(p[2])).sin().powi(2)
}

fn directions() -> Vec<Row> {
    let cosine = |p: &[f32]| f32s::sample_cosine_hemisphere(vec2(p)).to_array();
    let hemisphere = |p: &[f32]| f32s::sample_uniform_hemisphere(vec2(p)).to_array();
    let sphere = |p: &[f32]| f32s::sample_uniform_sphere(vec2(p)).to_array();
    let cone = |p: &[f32]| f32s::sample_cone(vec2(p), p[2]).to_array();
    vec![
        Function::new("sample_cosine_hemisphere", &[U, V], cosine).against(|p| {
            let [x, y] = circle(p[0].sqrt(), p[1]);
            [x, y, Expected::relative((1.0 - p[0]).sqrt())]
        }),
        Function::new("cosine_hemisphere_pdf", &[COS], |p| [f32s::cosine_hemisphere_pdf(p[0])])
            .against(|p| [Expected::relative(p[0] / PI)]),
        Function::new("invert_cosine_hemisphere", &[U, V], |p| f32s::invert_cosine_hemisphere(vec3(p)).to_array())
            .against(|p| [Expected::relative((p[0] * p[0] + p[1] * p[1]).min(1.0)), azimuth(p)])
            .of(cosine),
        Function::new("sample_uniform_hemisphere", &[U, V], hemisphere).against(|p| direction(p[0], p[1])),
        Function::new("invert_uniform_hemisphere", &[U, V], |p| f32s::invert_uniform_hemisphere(vec3(p)).to_array())
            .against(|p| [Expected::relative(depth_below_pole(p).min(1.0)), azimuth(p)])
            .of(hemisphere),
        Function::new("sample_uniform_sphere", &[U, V], sphere).against(|p| direction(2.0 * p[0], p[1])),
        Function::new("invert_uniform_sphere", &[U, V], |p| f32s::invert_uniform_sphere(vec3(p)).to_array())
            .against(|p| [Expected::relative(0.5 * depth_below_pole(p)), azimuth(p)])
            .of(sphere),
        Function::new("sample_cone", &[U, V, VERSINE], cone).against(|p| direction(p[0] * p[2], p[1])),
        Function::new("cone_pdf", &[VERSINE], |p| [f32s::cone_pdf(p[0])])
            .against(|p| [Expected::relative(1.0 / (TAU * p[0]))]),
        Function::new("invert_cone", &[U, V, VERSINE], |p| f32s::invert_cone(vec3(p), p[3]).to_array())
            .against(|p| [Expected::relative((depth_below_pole(p) / p[3]).min(1.0)), azimuth(p)])
            .of(move |p| cone(p).into_iter().chain([p[2]]).collect::<Vec<_>>()),
        Function::new("versine_of_sin2", &[SIN2], |p| [f32s::versine_of_sin2(p[0])])
            .against(|p| [Expected::relative(2.0 * (0.5 * p[0].sqrt().asin()).sin().powi(2))]),
    ]
}

/// Shirley and Chiu's map by its four sectors.
fn concentric(p: &[f64]) -> (f64, f64) {
    let (a, b) = (2.0 * p[0] - 1.0, 2.0 * p[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() > b.abs() {
        (a, FRAC_PI_4 * b / a)
    } else {
        (b, 2.0 * FRAC_PI_4 - FRAC_PI_4 * a / b)
    }
}

/// Its inverse, by the angle's octant.
fn square(p: &[f64]) -> [f64; 2] {
    let r = p[0].hypot(p[1]);
    let eighths = p[1].atan2(p[0]) / FRAC_PI_4;
    let [a, b] = if eighths.abs() <= 1.0 {
        [r, r * eighths]
    } else if eighths.abs() >= 3.0 {
        [-r, r * (4.0 * eighths.signum() - eighths)]
    } else {
        [r * (2.0 - eighths.abs()), r * eighths.signum()]
    };
    [0.5 * a + 0.5, 0.5 * b + 0.5]
}

/// Density and distribution function of the Blackman-Harris window (Harris 1978, table 1: four terms, -92 dB) at a distance in
/// [0, 1/2] from its end.
fn window(d: f64) -> [f64; 2] {
    const TERMS: [f64; 4] = [0.35875, -0.48829, 0.14128, -0.01168];
    let terms = (1..4).map(|k| (TERMS[k] / TERMS[0], TAU * k as f64));
    terms.fold([1.0, d], |[density, below], (a, w)| [density + a * (w * d).cos(), below + a * (w * d).sin() / w])
}

/// Where the distribution function is `tail`, by bisection.
fn end_of_tail(tail: f64) -> f64 {
    let halved = |[lo, hi]: [f64; 2], _| {
        let middle = 0.5 * (lo + hi);
        if window(middle)[1] < tail { [middle, hi] } else { [lo, middle] }
    };
    (0..60).fold([0.0, 0.5], halved)[0]
}

fn filters() -> Vec<Row> {
    const HALF_CELL: f64 = 1.0 / 33_554_432.0;
    let sample = |p: &[f32]| [f32s::sample_blackman_harris(p[0])];
    vec![
        Function::new("sample_blackman_harris", &[U], sample).against(|p| {
            let place = if p[0] < 0.5 {
                end_of_tail(p[0] + HALF_CELL) - 0.5
            } else {
                0.5 - end_of_tail(1.0 - p[0] - HALF_CELL)
            };
            [Expected::against(place, 0.5)]
        }),
        Function::new("blackman_harris_pdf", &[U], |p| [f32s::blackman_harris_pdf(p[0] - 0.5)])
            .against(|p| [Expected::relative(window(0.5 - (p[0] - 0.5).abs())[0])]),
        Function::new("invert_blackman_harris", &[U], |p| [f32s::invert_blackman_harris(p[0])])
            .against(|p| {
                let tail = window((0.5 - p[0].abs()).max(0.0))[1];
                [unit(if p[0] < 0.0 { tail } else { 1.0 - tail })]
            })
            .of(sample),
    ]
}

fn points() -> Vec<Row> {
    let disk = |p: &[f32]| f32s::sample_concentric_disk(vec2(p)).to_array();
    let triangle = |p: &[f32]| f32s::sample_triangle(vec2(p)).to_array();
    vec![
        Function::new("sample_concentric_disk", &[U, V], disk).against(|p| {
            let (r, angle) = concentric(p);
            [r * angle.cos(), r * angle.sin()].map(|x| Expected::against(x, r.abs()))
        }),
        Function::new("invert_concentric_disk", &[U, V], |p| f32s::invert_concentric_disk(vec2(p)).to_array())
            .against(|p| square(p).map(unit))
            .of(disk),
        Function::new("sample_triangle", &[U, V], triangle).against(|p| {
            let half = 0.5 * p[0].min(p[1]);
            [p[0], p[1]].map(|x| Expected::against(x - half, 1.0))
        }),
        Function::new("invert_triangle", &[U, V], |p| f32s::invert_triangle(vec2(p)).to_array())
            .against(|p| [p[0], p[1]].map(|x| unit(x + p[0].min(p[1]))))
            .of(triangle),
        Function::new("triangle_pdf", &[AREA], |p| [f32s::triangle_pdf(p[0])])
            .against(|p| [Expected::relative(1.0 / p[0])]),
    ]
}

/// 1 - e^-depth, over the depth.
fn mean_transmittance(depth: f64) -> f64 {
    if depth < 1.0e-12 { 1.0 } else { -(-depth).exp_m1() / depth }
}

fn distances() -> Vec<Row> {
    let free = |p: &[f32]| [p[0] / p[1], p[1]];
    let bounded = |p: &[f32]| [p[0], p[1] / p[2], p[2]];
    let part = |p: &[f32]| [p[0] * p[2], p[1] / p[2], p[2]];
    vec![
        Function::new("sample_exponential", &[FINE, RATE], |p| [f32s::sample_exponential(p[0], p[1])])
            .against(|p| [Expected::relative(-(-p[0]).ln_1p() / p[1])]),
        Function::new("exponential_pdf", &[SHORT, RATE], |p| [f32s::exponential_pdf(p[0], p[1])])
            .against(|p| [Expected::relative(p[1] * (-p[0] * p[1]).exp())])
            .of(free),
        Function::new("invert_exponential", &[SHORT, RATE], |p| [f32s::invert_exponential(p[0], p[1])])
            .against(|p| [Expected::relative(-(-p[0] * p[1]).exp_m1())])
            .of(free),
        Function::new("sample_bounded_exponential", &[FINE, DEPTH, T_MAX], |p| {
            [f32s::sample_bounded_exponential(p[0], p[1], p[2])]
        })
        .against(|p| {
            let depth = p[1] * p[2];
            let t = if depth < 1.0e-12 { p[0] * p[2] } else { -(p[0] * (-depth).exp_m1()).ln_1p() / p[1] };
            [Expected::relative(t)]
        })
        .of(bounded),
        Function::new("bounded_exponential_pdf", &[PART, DEPTH, T_MAX], |p| {
            [f32s::bounded_exponential_pdf(p[0], p[1], p[2])]
        })
        .against(|p| {
            // a transmittance below 2^-100 counts as zero
            let scale = Expected::relative((-p[0] * p[1]).exp());
            let norm = 1.0 / (p[2] * mean_transmittance(p[1] * p[2]));
            [Expected::against(scale.value * norm, scale.scale * norm)]
        })
        .of(part),
        Function::new("invert_bounded_exponential", &[PART, DEPTH, T_MAX], |p| {
            [f32s::invert_bounded_exponential(p[0], p[1], p[2])]
        })
        .against(|p| {
            let (depth, passed) = (p[1] * p[2], p[0] * p[1]);
            let u = p[0] / p[2] * mean_transmittance(passed) / mean_transmittance(depth);
            [Expected::relative(u.min(1.0))]
        })
        .of(part),
    ]
}

/// Weights with zeros, of equal size, and of very different ones.
static LISTS: LazyLock<[Vec<u32>; 4]> = LazyLock::new(|| {
    let halves: Vec<f64> = (0..31).map(|i| f64::exp2(-f64::from(i))).collect();
    [vec![7.0], vec![0.0, 1.0, 0.0, 0.0, 2.0, 1.0e-30, 0.0], halves, vec![1.0; 1000]].map(|w| integer_cdf(&w))
});

fn word(high: f32, low: f32) -> u32 {
    (high as u32) << 16 | low as u32
}

/// Item, probability and fraction, with all bounds as 64-bit integers and a search from the start.
fn choose(cdf: &[u32], high: f64, low: f64) -> [Expected; 3] {
    let word = (high * 65_536.0 + low) as u64;
    let bound = |i: usize| match cdf.get(i) {
        None | Some(&CDF_END) => 1 << 32,
        Some(&bound) => u64::from(bound),
    };
    let index = (0..cdf.len()).find(|&i| bound(i) <= word && word < bound(i + 1)).unwrap_or(usize::MAX);
    let size = (bound(index.saturating_add(1)) - bound(index)) as f64;
    let fraction = ((word - bound(index)) as f64 + 0.5) / size;
    [Expected::against(index as f64, 1.0), Expected::relative(size / f64::exp2(32.0)), Expected::against(fraction, 1.0)]
}

fn choices() -> Vec<Row> {
    vec![
        Function::new("sample_discrete", &[HIGH, LOW, LIST], |p| {
            let cdf = &LISTS[p[2] as usize];
            let cell = f32s::sample_discrete(word(p[0], p[1]), cdf.len() as u32, |i| cdf[i as usize]);
            [cell.index as f32, cell.probability, cell.fraction]
        })
        .against(|p| choose(&LISTS[p[2] as usize], p[0], p[1])),
        // rows by one list, the columns of each row by another
        Function::new("sample_table_2d", &[HIGH, LOW, SECOND_HIGH, SECOND_LOW], |p| {
            let (rows, columns) = (&LISTS[1], &LISTS[2]);
            let words = [word(p[0], p[1]), word(p[2], p[3])];
            let (width, height) = (columns.len() as u32, rows.len() as u32);
            let TableSample { cell, fraction, probability } =
                f32s::sample_table_2d(words, width, height, |r| rows[r as usize], |_, c| columns[c as usize]);
            [cell[0] as f32, cell[1] as f32, fraction.x, fraction.y, probability]
        })
        .against(|p| {
            let [row, of_row, y] = choose(&LISTS[1], p[0], p[1]);
            let [column, of_column, x] = choose(&LISTS[2], p[2], p[3]);
            [column, row, x, y, Expected::relative(of_row.value * of_column.value)]
        }),
        Function::new("sample_alias", &[HIGH, LOW, U, COUNT], |p| {
            let words = [word(p[0], p[1]), ((f64::from(p[2]) * 4_294_967_296.0) as u32)];
            [f32s::sample_alias(words, p[3] as u32, |i| (0.5, i ^ 1)) as f32]
        })
        .against(|p| {
            let index = ((p[0] * 65_536.0 + p[1]) * p[3] / 4_294_967_296.0).floor() as u64;
            let chosen = if p[2] < 0.5 { index } else { index ^ 1 };
            [Expected::against(chosen as f64, 1.0)]
        }),
    ]
}
