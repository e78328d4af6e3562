//! The picture.

use super::record::PackedPath;
use crate::layout::FilmPixel;
use crate::num;
use glam::Vec3;

/// What a pixel's path sends to the camera, with what needs no path.
#[inline(always)]
pub fn shade(path: &PackedPath, direct: FilmPixel) -> FilmPixel {
    let pixel = FilmPixel::from_radiance(Vec3::from_array(direct.sum) + path.value() * path.contribution_weight());
    FilmPixel { dropped: num::min(pixel.dropped + direct.dropped, 1.0), ..pixel }
}
