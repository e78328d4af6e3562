//! How much narrower than the mean free path a profile is.

use crate::num;

/// A fit of the shape factor `s(A)` to walks through half spaces (Christensen and Burley 2015), by what enters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Shape {
    /// A pencil of light enters along the normal; the mean free path is that of the medium.
    Searchlight,
    /// Light enters by Lambert's law, whatever its direction was; the mean free path is that of the medium.
    #[default]
    Diffuse,
    /// The length is not the mean free path of the medium but the mean distance that light travels along the surface.
    SurfaceLength,
}

impl Shape {
    /// `s(A)` of a diffuse albedo in [0, 1].
    #[inline(always)]
    pub fn factor(self, albedo: f32) -> f32 {
        let off = albedo - 0.8;
        let searchlight = 1.85 - albedo + 7.0 * num::abs(off * off * off);
        let diffuse = 1.9 - albedo + 3.5 * (off * off);
        let beside = albedo - 0.33;
        let surface = 3.5 + 100.0 * (beside * beside) * (beside * beside);
        match self {
            Self::Searchlight => searchlight,
            Self::Diffuse => diffuse,
            Self::SurfaceLength => surface,
        }
    }

    /// `s(0)`.
    #[inline(always)]
    pub fn of_black(self) -> f32 {
        match self {
            Self::Searchlight => 5.434,
            Self::Diffuse => 4.14,
            Self::SurfaceLength => 4.685_921,
        }
    }
}
