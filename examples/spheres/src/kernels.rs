//! The kernels: for each a function of a pixel, which runs everywhere, and the entry point that calls it on a device.

use crate::scene::{Moving, Spheres, Thing};
use restir_shared::geometry::PackedHit;
use restir_shared::layout::FilmPixel;
use restir_shared::technique::path::{self, PathParams};
use restir_shared::technique::restir_di::{self, DiParams, PackedReservoir, Planes, TileWords};
#[cfg(target_arch = "spirv")]
use spirv_std::{glam::UVec3, spirv};

/// Path tracing: the sum of a block of samples. The seed is also the number of the frame that is shown.
pub fn path_pixel(params: &PathParams, things: &[Thing], at: [u32; 2]) -> FilmPixel {
    path::pixel(&Spheres::of_frame(things, params.seed), params, at[0], at[1])
}

/// ReSTIR DI, first pass: what the pixel sees, its reservoir, and the light that needs no resampling. `tiles` are of no use to these
/// parameters, and rust-gpu has no empty slices.
pub fn initial_pixel(
    params: &DiParams,
    things: &[Thing],
    tiles: &[TileWords],
    at: [u32; 2],
) -> (PackedHit, PackedReservoir, FilmPixel) {
    let scene = Spheres::of_frame(things, params.frame);
    let hit = restir_di::primary(&scene, params, at);
    let made = restir_di::initial(&scene, params, tiles, hit, at);
    (hit, made.reservoir, made.direct)
}

/// Second pass: reservoirs of the last frame or of neighbours, whichever `params` are of.
pub fn combine_pixel(
    params: &DiParams,
    things: &[Thing],
    planes: &Planes<'_>,
    own: PackedReservoir,
    at: [u32; 2],
) -> PackedReservoir {
    let frames = Moving { things, frames: (params.frame, params.other_frame) };
    restir_di::combine(frames, params, planes, own, at).reservoir
}

/// Last pass: the picture.
pub fn shade_pixel(
    params: &DiParams,
    things: &[Thing],
    hit: PackedHit,
    reservoir: PackedReservoir,
    direct: FilmPixel,
    at: [u32; 2],
) -> FilmPixel {
    restir_di::shade(Spheres::of_frame(things, params.frame), params, hit, reservoir, direct, at)
}

/// [`path_pixel`].
#[cfg(target_arch = "spirv")]
#[spirv(compute(threads(8, 8)))]
pub fn spheres_path(
    #[spirv(global_invocation_id)] id: UVec3,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 0)] params: &PathParams,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] things: &[Thing],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] film: &mut [FilmPixel],
) {
    if id.x < params.width && id.y < params.height {
        film[(id.y * params.width + id.x) as usize] = path_pixel(params, things, [id.x, id.y]);
    }
}

/// [`initial_pixel`].
#[cfg(target_arch = "spirv")]
#[spirv(compute(threads(8, 8)))]
pub fn spheres_initial(
    #[spirv(global_invocation_id)] id: UVec3,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 0)] params: &DiParams,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] things: &[Thing],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] tiles: &[TileWords],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] hits: &mut [PackedHit],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] reservoirs: &mut [PackedReservoir],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] direct: &mut [FilmPixel],
) {
    let params = *params;
    if id.x < params.width && id.y < params.height {
        let at = (id.y * params.width + id.x) as usize;
        let (hit, reservoir, light) = initial_pixel(&params, things, tiles, [id.x, id.y]);
        hits[at] = hit;
        reservoirs[at] = reservoir;
        direct[at] = light;
    }
}

/// [`combine_pixel`].
#[cfg(target_arch = "spirv")]
#[spirv(compute(threads(8, 8)))]
pub fn spheres_combine(
    #[spirv(global_invocation_id)] id: UVec3,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 0)] params: &DiParams,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] things: &[Thing],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] hits: &[PackedHit],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] other_hits: &[PackedHit],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] others: &[PackedReservoir],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] reservoirs: &mut [PackedReservoir],
) {
    let params = *params;
    if id.x < params.width && id.y < params.height {
        let at = (id.y * params.width + id.x) as usize;
        let planes = Planes { hits, other_hits, others };
        reservoirs[at] = combine_pixel(&params, things, &planes, reservoirs[at], [id.x, id.y]);
    }
}

/// [`shade_pixel`].
#[cfg(target_arch = "spirv")]
#[spirv(compute(threads(8, 8)))]
pub fn spheres_shade(
    #[spirv(global_invocation_id)] id: UVec3,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 0)] params: &DiParams,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] things: &[Thing],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] hits: &[PackedHit],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] reservoirs: &[PackedReservoir],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] direct: &[FilmPixel],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] film: &mut [FilmPixel],
) {
    let params = *params;
    if id.x < params.width && id.y < params.height {
        let at = (id.y * params.width + id.x) as usize;
        film[at] = shade_pixel(&params, things, hits[at], reservoirs[at], direct[at], [id.x, id.y]);
    }
}
