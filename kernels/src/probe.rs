//! Inputs for the parity cases.

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
