//! Inputs for the parity cases.

use crate::num_probe::NumOperands;
use crate::self_check::Operands;
use restir_shared::glam::UVec4;
use restir_shared::layout::FilmPixel;
use restir_shared::num;
use restir_shared::rng::{pcg4d, unit};

/// A film plane of positive radiances over many magnitudes.
pub(crate) fn film_plane(pixels: u32, salt: u32) -> Vec<FilmPixel> {
    let value = |word: u32| unit(word) * f32::from_bits((100 + word % 40) << 23);
    (0..pixels)
        .map(|i| {
            let w = pcg4d(UVec4::new(i, salt, 0, 0));
            FilmPixel { sum: [value(w.x), value(w.y), value(w.z)], dropped: (w.w % 3) as f32 }
        })
        .collect()
}

/// Pseudo-random words.
pub(crate) fn random_words(count: u32, salt: u32) -> Vec<u32> {
    (0..count).map(|i| pcg4d(UVec4::new(i, salt, 0, 7)).x).collect()
}

/// Operands at the ends of the domain and where a broken contract shows.
pub fn boundary_operands() -> Vec<Operands> {
    let one_and = |k: u32| f32::from_bits(0x3f80_0000 + k);
    let values = [
        1.0,
        -1.0,
        0.0,
        -0.0,
        3.0,
        -0.333_333_34,
        one_and(1),
        one_and(2048),
        -one_and(0x7f_ffff),
        f32::from_bits(0x3f7f_ffff),
        16_777_215.0,
        1.0e-12,
        -7.5e11,
        f32::from_bits(0x3080_0001),
        f32::from_bits(0x4eff_ffff),
    ];
    let mut operands = Vec::new();
    for a in values {
        for b in values {
            // c cancels the rounded product, so that a fused sum leaves its error
            operands.push(Operands { a, b, c: -(a * b), d: a - num::min(b, 1.0) });
            operands.push(Operands { a, b, c: 4097.0 * a, d: b * 0.125 });
        }
    }
    operands.iter().map(|o| Operands { d: num::clamp(o.d, -80.0, 80.0), ..*o }).collect()
}

/// Pseudo-random operands, magnitudes in [2^-30, 2^30].
pub fn random_operands(count: u32) -> Vec<Operands> {
    let value = |word: u32| f32::from_bits((word & 0x807f_ffff) | ((97 + (word >> 23) % 60) << 23));
    (0..count)
        .map(|i| {
            let w = pcg4d(UVec4::new(i, 0, 0, 99));
            let (a, b) = (value(w.x), value(w.y));
            let c = if i % 2 == 0 { -(a * b) } else { 4097.0 * a };
            Operands { a, b, c, d: (unit(w.w) - 0.5) * 160.0 }
        })
        .collect()
}

/// Where a function of `num`, `color` or `pack` changes its form or leaves its range, with both signs and neighbours.
const CHANGES: [f32; 32] = [
    0.0,
    1.0,
    2.0,
    0.5,
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::INFINITY,
    num::EXP_MAX,
    num::EXP2_MAX,
    num::SINH_MAX,
    20.0,
    126.0,
    core::f32::consts::LN_2,
    0.346_573_6,
    core::f32::consts::FRAC_1_SQRT_2,
    core::f32::consts::SQRT_2,
    0.84,
    1.19,
    4096.0,
    1.0e-20,
    1.0e20,
    3.0e-8,
    // halves
    65_504.0,
    65_520.0,
    6.103_515_6e-5,
    5.960_464_5e-8,
    2.980_232_2e-8,
    // sRGB, RGB9E5
    0.003_130_8,
    0.040_45,
    65_408.0,
    511.5,
    3.051_757_8e-5,
];

/// Operands at which something changes, in pairs.
pub fn num_boundaries() -> Vec<NumOperands> {
    let is_normal = |x: &f32| *x == 0.0 || x.abs() >= f32::MIN_POSITIVE;
    let beside = |x: f32| [x, x.next_up(), x.next_down()].into_iter().filter(is_normal);
    let values: Vec<f32> = CHANGES.into_iter().flat_map(beside).flat_map(|x| [x, -x]).chain([f32::NAN]).collect();
    let exponents = [0.0, 1.0, -1.0, 0.5, 2.4, -3.0, 1.0e-20, 1.0e12, f32::INFINITY, f32::NAN, 126.0, -0.0];
    let pairs = values.iter().flat_map(|&x| exponents.map(|y| (x, y)));
    let operands = pairs.enumerate().map(|(i, (x, y))| {
        let word = pcg4d(UVec4::new(i as u32, 0, 0, 7)).x;
        let corner = [0, 0x7fff_7fff, 0x8000_8000, 0x7fff_0000, 0x3fff_4000, 0xffff_ffff, word, word][i % 8];
        let factor = num::clamp(num::abs(x), 1.0e-9, 1.0e9);
        // the products are equal but for the last bits
        NumOperands { x, y, z: x, factors: [factor, 3.0, factor.next_up(), 3.0], word: corner }
    });
    operands.collect()
}

/// Pseudo-random operands, magnitudes in [2^-30, 2^30], exponents of powers in [-80, 80].
pub fn num_random(count: u32) -> Vec<NumOperands> {
    let operands = |i: u32| {
        let (v, w) = (pcg4d(UVec4::new(i, 0, 0, 101)), pcg4d(UVec4::new(i, 0, 0, 102)));
        let any = |word: u32| f32::from_bits((word & 0x807f_ffff) | ((97 + (word >> 23) % 60) << 23));
        let near_1 = f32::from_bits((v.x & 0x007f_ffff) + (126 << 23) + (v.x >> 31 << 23));
        let x = [any(v.x), near_1, (unit(v.x) - 0.5) * 180.0, unit(v.x) * 2.0 - 1.0][(i % 4) as usize];
        let (a, b) = (any(w.x), any(w.y));
        let (c, d) = if i & 1 == 0 { (b, a.next_up()) } else { (any(w.z), any(w.w)) };
        let [y, z] = [v.y, v.z].map(|word| (unit(word) - 0.5) * 160.0);
        NumOperands { x, y, z, factors: [a, b, c, d], word: v.w }
    };
    (0..count).map(operands).collect()
}
