//! Coefficients of the fits that [`super::Albedo`] evaluates, made by `cargo lab albedo --write`.
//!
//! They are public for who computes the fits in another precision or language. In the names of the tables r is the roughness, `alpha = r²`,
//! mu the cosine, and L, g, H, A, B, D and s are those of the [module above](super).
//!
//! ```
//! use restir_shared::bsdf::albedo::{Albedo, fit};
//!
//! // the mean loss of metal, `alpha` times a polynomial of the roughness, in double precision
//! let roughness = 0.7_f64;
//! let polynomial = fit::MEAN_LOST.iter().rev().fold(0.0, |sum, &c| sum * roughness + f64::from(c));
//! let mean = roughness * roughness * polynomial;
//! assert!((mean - f64::from(Albedo::mean(0.7).all)).abs() < 1e-5);
//! ```

/// L: rows for A, B and D by power of s, columns by power of alpha.
pub const LOST: [[f32; 4]; 7] = [
    [0.27013186, -0.9903654, 13.820842, 40.85734],
    [-0.23760848, 11.995461, -14.707478, 7.155703],
    [-6.8657136, -40.672787, -3.4358964, 2.1700077],
    [5.6661906, 65.84979, -12.163456, 3.6076741],
    [0.86754435, 43.684082, -25.265476, 13.607217],
    [-4.4087534, 34.134468, -24.45339, 49.08694],
    [2.619852, -64.249176, 41.083576, -47.213085],
];

/// g: rows for A, B and D by power of s, columns by power of alpha.
pub const BALANCE: [[f32; 4]; 7] = [
    [-0.030554473, -0.16862038, -4.7918844, 1.6067553],
    [0.20065287, 0.6201483, 3.548354, -1.8230758],
    [5.1332026, -3.4500937, 2.3264923, -0.9173853],
    [-5.0479455, 4.4840384, -1.2427201, 0.3371748],
    [2.3736503, 1.3316073, 0.40455782, -1.0194404],
    [-6.9365544, 10.008969, -7.496841, 1.3941019],
    [4.1805305, -11.058986, 8.0014515, -0.6385109],
];

/// H: rows for 1, s, mu, mu^2 and s mu, columns by power of r.
pub const SCHLICK: [[f32; 5]; 5] = [
    [3.8477416, -10.499216, 14.387779, -10.1303425, 2.8437688],
    [0.9631525, -15.991326, 63.245693, -107.623184, 51.896484],
    [-22.351526, 111.59619, -191.0196, 175.43729, -66.661064],
    [-59.808113, 223.20845, -296.79855, 81.18062, 46.540188],
    [17.086227, -16.016863, -160.9628, 364.2347, -199.12729],
];

/// The mean of L over alpha, by power of r.
pub const MEAN_LOST: [f32; 8] =
    [0.11545068, -2.2353315, 18.11131, -47.13942, 69.10443, -60.795544, 29.288792, -5.860106];

/// The mean of what Schlick's weight does not reflect, by power of r.
pub const MEAN_SCHLICK: [f32; 8] =
    [0.9523647, 0.017597778, -0.36072883, 3.198015, -8.528628, 10.539454, -6.276934, 1.454223];
