//! Constants that occur nowhere else, one for each optional part: a compiled module that lacks the constant lacks the part, which tests look
//! for. They are no interface.

/// Occurs where rough specular lobes are compiled in: the least alpha of GGX, just below that of [`super::DELTA_BELOW`].
pub const GLOSSY: f32 = 9.871e-5;
/// Occurs where perfect specular lobes are compiled in: the least selection probability of a delta sample.
pub const DELTA: f32 = 1.173e-9;
/// Occurs where dielectric transmission is compiled in: the squared cosine below which reflection is total.
pub const TRANSMISSION: f32 = 9.71e-13;
/// Occurs where diffuse transmission is compiled in: smaller shares count as none.
pub const DIFFUSE_TRANSMISSION: f32 = 1.307e-7;
/// Occurs where light that specular lobes lose comes back: 20 / 21, one less the mean of Schlick's weight.
pub const MULTISCATTER: f32 = 0.952_380_95;
/// Occurs where `KHR_materials_specular` is compiled in: the least share that a coat lets through.
pub const SPECULAR: f32 = 1.411e-11;
