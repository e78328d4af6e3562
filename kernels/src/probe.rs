//! Inputs for the parity cases.

use crate::sampler_check::SamplerOperands;
use crate::self_check::Operands;
use restir_shared::glam::UVec4;
use restir_shared::layout::FilmPixel;
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
            operands.push(Operands { a, b, c: -(a * b), d: a - restir_shared::num::min(b, 1.0) });
            operands.push(Operands { a, b, c: 4097.0 * a, d: b * 0.125 });
        }
    }
    operands.iter().map(|o| Operands { d: restir_shared::num::clamp(o.d, -80.0, 80.0), ..*o }).collect()
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

/// Every combination of the ends of the samplers' ranges.
pub(crate) fn sampler_ends() -> Vec<SamplerOperands> {
    const STEP: f32 = 1.0 / 16_777_216.0;
    let units = [0.0, STEP, 0.25, 0.5 - STEP, 0.5, 0.75, 1.0 - STEP];
    let words = [0, 1, 2, 0x4000_00ff, 0xc123_4567, u32::MAX - 1, u32::MAX];
    let mut operands = Vec::new();
    for (u, v) in units.iter().flat_map(|&u| units.map(|v| (u, v))) {
        for (versine, rate, t_max) in
            [(1.0e-12, 1.0e-6, 1.0e-4), (1.0e-4, 1.0e-3, 0.45), (0.5, 3.0, 1.0e5), (2.0, 1.0e6, 2.5)]
        {
            let words = [words[operands.len() % 7], words[operands.len() / 7 % 7]];
            operands.push(SamplerOperands { u: [u, v], words, versine, rate, t_max, reserved: 0 });
        }
    }
    operands
}

/// Pseudo-random operands of the samplers.
pub(crate) fn random_sampler_operands(count: u32) -> Vec<SamplerOperands> {
    // magnitudes over 2^20
    let wide = |word: u32| f32::from_bits((word & 0x007f_ffff) | ((117 + (word >> 23) % 20) << 23));
    (0..count)
        .map(|i| {
            let (a, b) = (pcg4d(UVec4::new(i, 0, 0, 101)), pcg4d(UVec4::new(i, 0, 0, 103)));
            let versine = 2.0 - 2.0 * unit(b.x);
            let u = [unit(a.x), unit(a.y)];
            SamplerOperands { u, words: [a.z, a.w], versine, rate: wide(b.y), t_max: wide(b.z), reserved: 0 }
        })
        .collect()
}
