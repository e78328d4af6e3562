//! Operands of the parity cases.

use super::operands::{BsdfOperands, DiffusionOperands, NumOperands, SamplerOperands};
use restir_shared::glam::UVec4;
use restir_shared::num;
use restir_shared::rng::{pcg4d, unit};

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
pub(super) fn num_boundaries() -> Vec<NumOperands> {
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
pub(super) fn num_random(count: u32) -> Vec<NumOperands> {
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

/// Every combination of the ends of the samplers' ranges.
pub(super) fn sampler_ends() -> Vec<SamplerOperands> {
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
pub(super) fn random_sampler_operands(count: u32) -> Vec<SamplerOperands> {
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

/// Materials of one lobe and of several: metallic, transmission, diffuse transmission, and whether it is a sheet.
const MATERIALS: [(f32, f32, f32, u32); 7] = [
    (0.0, 0.0, 0.0, 0),
    (1.0, 0.0, 0.0, 0),
    (0.0, 1.0, 0.0, 0),
    (0.0, 1.0, 0.0, 1),
    (0.0, 0.0, 0.4, 0),
    (0.3, 0.5, 0.4, 0),
    (0.3, 0.5, 0.4, 1),
];
const ROUGHNESSES: [f32; 6] = [0.0, 0.0099, 0.01, 0.02, 0.3, 1.0];
const INDICES: [f32; 5] = [1.0, 1.000_000_1, 1.5, 2.4, 10.0];
const COSINES: [f32; 7] = [1.0, 0.7, 0.05, 1.0e-3, 2.0e-6, 1.0e-6, 5.0e-7];

/// A unit vector by the cosine with z and an angle in turns.
fn direction(cos: f32, turn: f32) -> [f32; 3] {
    let r = num::sqrt(1.0 - cos * cos);
    let (sin, turned) = num::sin_cos(turn);
    [r * turned, r * sin, cos]
}

/// Every combination of the ends of the ranges of materials and viewers; directions of light and random words take
/// turns.
pub(super) fn bsdf_ends() -> Vec<BsdfOperands> {
    let words = [0, 0xff, 0x100, 0x4000_0000, 0x7fff_ffff, 0x8000_0000, 0xffff_feff, u32::MAX];
    let mut operands: Vec<BsdfOperands> = Vec::new();
    for (material, roughness) in MATERIALS.iter().flat_map(|m| ROUGHNESSES.map(|r| (m, r))) {
        for (ior, cos) in INDICES.iter().flat_map(|&n| COSINES.map(|c| (n, c))) {
            for front in [0, 1] {
                let (i, wo) = (operands.len() as u32, direction(cos, 0.1));
                let w = pcg4d(UVec4::new(i, 0, 0, 105)).to_array().map(|word| words[(word >> 29) as usize]);
                let light = COSINES[i as usize % COSINES.len()] * if i & 8 == 0 { 1.0 } else { -1.0 };
                let wi = [[-wo[0], -wo[1], wo[2]], [-wo[0], -wo[1], -wo[2]], direction(light, 0.6)][i as usize % 3];
                let (metallic, transmission, diffuse_transmission, thin) = *material;
                operands.push(BsdfOperands {
                    base_color: [1.0, 0.5, 0.0],
                    metallic,
                    roughness,
                    ior,
                    specular: [1.0, 0.5, 0.0, 1.0][i as usize % 4],
                    specular_color: [[1.0; 3], [0.0, 1.0, 30.0]][i as usize / 4 % 2],
                    transmission,
                    diffuse_transmission,
                    diffuse_transmission_color: [0.2, 1.0, 0.4],
                    thin,
                    front,
                    wo,
                    wi,
                    words: w,
                    free: [w[3], w[2], w[1], w[0]],
                });
            }
        }
    }
    operands
}

/// Pseudo-random operands of the scattering functions.
pub(super) fn random_bsdf_operands(count: u32) -> Vec<BsdfOperands> {
    let operands = |i: u32| {
        let words = |salt: u32| pcg4d(UVec4::new(i, 0, 0, salt)).to_array();
        let units = |salt: u32| words(salt).map(unit);
        let (colors, shares, turns, cosines) = (units(107), units(108), units(109), units(110));
        let specular = units(114);
        let share = |u: f32| num::clamp(2.0 * u - 0.5, 0.0, 1.0);
        let [a, b, c, _] = words(111);
        BsdfOperands {
            base_color: [colors[0], colors[1], colors[2]],
            metallic: share(shares[0]),
            roughness: shares[1],
            ior: 1.0 + shares[2] * shares[2] * 9.0,
            specular: share(specular[0]),
            specular_color: [2.0 * specular[1], 2.0 * specular[2], 2.0 * specular[3]],
            transmission: share(shares[3]),
            diffuse_transmission: share(colors[3]),
            diffuse_transmission_color: [colors[2], colors[0], colors[1]],
            thin: a & 1,
            front: b & 1,
            wo: direction(num::max(cosines[0], 1.0e-6), turns[0]),
            wi: direction(if c & 1 == 0 { cosines[1] } else { -cosines[1] }, turns[1]),
            words: words(112),
            free: words(113),
        }
    };
    (0..count).map(operands).collect()
}

/// Points on and beside the axes, at the centre and beyond every reach, of profiles at the ends of their ranges.
pub(super) fn diffusion_ends() -> Vec<DiffusionOperands> {
    const STEP: f32 = 1.0 / 16_777_216.0;
    let units = [0.0, STEP, 0.25, 0.5 - STEP, 0.5, 0.75, 1.0 - STEP];
    let normals = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [-0.3, 0.5, -0.8]];
    let mut operands = Vec::new();
    for albedo in [0.0, 1.0e-6, 0.284, 0.9, 1.0] {
        for distance in [[1.0, 1.0, 1.0], [1.0e-5, 0.0, 1.0e3], [0.0; 3], [1.0e-7, 3.0e-7, 1.0e-6]] {
            for (far, normal) in
                [0.0, 1.0e-9, 1.0e-3, 19.8, 19.9, 1.0e4].into_iter().flat_map(|r| normals.map(|n| (r, n)))
            {
                let i = operands.len();
                let unit = |step: usize| units[i / step % units.len()];
                let beside = [[far, 0.0, 0.0], [0.0, 0.0, far], [far, -far, 0.5 * far]][i % 3];
                operands.push(DiffusionOperands {
                    u: [unit(1), unit(3), unit(7), unit(11)],
                    albedo: [albedo; 3],
                    x: far,
                    distance,
                    fit: i as u32 % 3,
                    centre: [[0.0; 3], [100.0, -3.0, 0.1]][i % 2],
                    published: i as u32 / 2 % 2,
                    normal,
                    anisotropy: [0.0, 0.999, -0.999, 0.5][i % 4],
                    beside,
                    again: unit(5),
                });
            }
        }
    }
    operands
}

/// Pseudo-random operands of diffusion, distances over 2^10.
pub(super) fn random_diffusion_operands(count: u32) -> Vec<DiffusionOperands> {
    let operands = |i: u32| {
        let words = |salt: u32| pcg4d(UVec4::new(i, 0, 0, salt)).to_array();
        let units = |salt: u32| words(salt).map(unit);
        let wide = |word: u32| f32::from_bits((word & 0x007f_ffff) | ((122 + (word >> 23) % 10) << 23));
        let [a, b, c, fit] = words(120);
        let (albedo, place, normal, beside) = (units(121), units(122), units(123), units(124));
        let signed = |u: f32| 2.0 * u - 1.0;
        let far = wide(words(125)[0]);
        DiffusionOperands {
            u: units(119),
            albedo: [albedo[0], albedo[1], albedo[2]],
            x: 4.0 * albedo[3],
            distance: [wide(a), wide(b), wide(c)],
            fit: fit % 3,
            centre: [signed(place[0]), signed(place[1]), signed(place[2])],
            published: fit >> 31,
            normal: [signed(normal[0]), signed(normal[1]), 0.1 + normal[2]],
            anisotropy: 0.999 * signed(normal[3]),
            beside: [far * signed(beside[0]), far * signed(beside[1]), far * signed(beside[2])],
            again: beside[3],
        }
    };
    (0..count).map(operands).collect()
}
