//! The kernels as the library's executors know them: descriptors with native twins, and a render as a list of passes.

use crate::kernels::{combine_pixel, initial_pixel, path_pixel, shade_pixel};
use crate::scene::Thing;
use bytemuck::{Pod, cast_slice, cast_slice_mut, pod_read_unaligned};
use restir::Error;
use restir::advanced::plan::{Buffer, FramePlan, Pass};
use restir::kernels::{Access, Binding, KernelDesc, NativeRow, Rays};
use restir_shared::geometry::PackedHit;
use restir_shared::glam::Vec3;
use restir_shared::layout::{CameraParams, FilmPixel, fields_of};
use restir_shared::technique::path::PathParams;
use restir_shared::technique::restir_di::{DiParams, LastFrame, PackedReservoir, Planes, TileWords};

/// A descriptor; the names of the bindings are those by which passes bind.
const fn kernel(name: &'static str, bindings: &'static [Binding], native: fn(&mut NativeRow<'_>)) -> KernelDesc {
    let fields = fields_of::<DiParams>();
    KernelDesc {
        name,
        workgroup: [8, 8, 1],
        constants: &[],
        bindings,
        fields,
        probes: false,
        rays: Rays::Internal,
        native,
    }
}

const fn read<T>(name: &'static str) -> Binding {
    Binding::new::<T>(name, Access::Read)
}

const fn own<T>(name: &'static str) -> Binding {
    Binding::new::<T>(name, Access::Own)
}

const DI_PARAMS: Binding = Binding::new::<DiParams>("params", Access::Params);
const THINGS: Binding = read::<Thing>("things");

static PATH: KernelDesc = KernelDesc {
    fields: fields_of::<PathParams>(),
    ..kernel(
        "spheres_path",
        &[Binding::new::<PathParams>("params", Access::Params), THINGS, own::<FilmPixel>("film")],
        |row| {
            let (params, at): (PathParams, _) = begin(row);
            let (&[things], [film]) = (row.read, &mut *row.own) else { return };
            for (pixel, at) in cast_slice_mut(film).iter_mut().zip(at) {
                *pixel = path_pixel(&params, cast_slice(things), at);
            }
        },
    )
};

static INITIAL: KernelDesc = kernel(
    "spheres_initial",
    &[
        DI_PARAMS,
        THINGS,
        read::<TileWords>("tiles"),
        own::<PackedHit>("hits"),
        own::<PackedReservoir>("reservoirs"),
        own::<FilmPixel>("direct"),
    ],
    |row| {
        let (params, at): (DiParams, _) = begin(row);
        let (&[things, tiles], [hits, reservoirs, direct]) = (row.read, &mut *row.own) else { return };
        let (hits, reservoirs, direct) = (cast_slice_mut(hits), cast_slice_mut(reservoirs), cast_slice_mut(direct));
        for (i, at) in at.enumerate() {
            (hits[i], reservoirs[i], direct[i]) = initial_pixel(&params, cast_slice(things), cast_slice(tiles), at);
        }
    },
);

static COMBINE: KernelDesc = kernel(
    "spheres_combine",
    &[
        DI_PARAMS,
        THINGS,
        read::<PackedHit>("hits"),
        read::<PackedHit>("other_hits"),
        read::<PackedReservoir>("others"),
        own::<PackedReservoir>("reservoirs"),
    ],
    |row| {
        let (params, at): (DiParams, _) = begin(row);
        let (&[things, hits, other_hits, others], [reservoirs]) = (row.read, &mut *row.own) else { return };
        let planes = Planes { hits: cast_slice(hits), other_hits: cast_slice(other_hits), others: cast_slice(others) };
        for (reservoir, at) in cast_slice_mut(reservoirs).iter_mut().zip(at) {
            *reservoir = combine_pixel(&params, cast_slice(things), &planes, *reservoir, at);
        }
    },
);

static SHADE: KernelDesc = kernel(
    "spheres_shade",
    &[
        DI_PARAMS,
        THINGS,
        read::<PackedHit>("hits"),
        read::<PackedReservoir>("reservoirs"),
        read::<FilmPixel>("direct"),
        own::<FilmPixel>("film"),
    ],
    |row| {
        let (params, at): (DiParams, _) = begin(row);
        let (&[things, hits, reservoirs, direct], [film]) = (row.read, &mut *row.own) else { return };
        let (hits, reservoirs): (&[PackedHit], &[PackedReservoir]) = (cast_slice(hits), cast_slice(reservoirs));
        let direct: &[FilmPixel] = cast_slice(direct);
        for (pixel, at) in cast_slice_mut(film).iter_mut().zip(at) {
            let i = params.grid().index(at) as usize;
            *pixel = shade_pixel(&params, cast_slice(things), hits[i], reservoirs[i], direct[i], at);
        }
    },
);

/// The parameters of a row, and its pixels.
fn begin<P: Pod>(row: &NativeRow<'_>) -> (P, impl Iterator<Item = [u32; 2]> + use<P>) {
    let y = row.y;
    (pod_read_unaligned(cast_slice(row.params)), (row.x..row.x + row.width).map(move |x| [x, y]))
}

/// The scene as it lies in its buffer.
fn things() -> Buffer {
    let matte = Thing { roughness: 1.0, ior: 1.5, ..Thing::default() };
    let floor = Thing { normal: [0.0, 1.0, 0.0], color: [0.6; 3], ..matte };
    let ball = |centre, size| Thing { centre, size, color: [0.7, 0.2, 0.15], ..matte };
    let metal = Thing { color: [0.9, 0.8, 0.6], metallic: 1.0, roughness: 0.25, ..ball([0.1, 0.8, -0.6], 0.8) };
    let lamp = |centre, emission, chosen| {
        let (size, normal) = (0.5, [0.0, -1.0, 0.0]);
        Thing { centre, size, normal, emission, chosen, ..matte }
    };
    let things = [
        floor,
        ball([-1.3, 0.6, 0.2], 0.6),
        metal,
        ball([1.3, 0.5, 0.5], 0.5),
        lamp([-1.2, 3.0, 0.0], [27.0, 18.0, 9.0], 0.75),
        lamp([1.2, 3.0, 0.5], [4.0, 8.0, 16.0], 0.25),
    ];
    let words: &[u32] = cast_slice(&things);
    Buffer { name: "things", words: words.len(), contents: Some(words.into()) }
}

fn camera(size: [u32; 2], frame: u32) -> CameraParams {
    let eye = Vec3::new(-0.4 + 0.05 * frame as f32, 1.3, 5.0);
    CameraParams::pinhole(eye, Vec3::new(0.0, 0.8, 0.0), Vec3::Y, 0.09, size)
}

/// Path tracing of 2^`samples_log2` samples, at most 16.
///
/// # Errors
/// None: the kernels have these bindings.
pub fn path_plan(size: [u32; 2], samples_log2: u32, frame: u32) -> Result<FramePlan<'static>, Error> {
    let camera = camera(size, frame);
    let params = PathParams { block_log2: samples_log2, max_depth: 5, ..PathParams::new(camera, size, frame) };
    let film = Buffer { name: "film", words: 4 * pixels(size), contents: None };
    let pass = Pass::new(&PATH, &[], &params, &[("things", 0), ("film", 1)])?;
    Ok(FramePlan::of(vec![things(), film], vec![pass], vec![1]))
}

/// Frames of ReSTIR DI under a camera that moves: the picture of the last one. Planes of hits and of reservoirs take turns.
///
/// # Errors
/// None: the kernels have these bindings.
pub fn restir_di_plan(size: [u32; 2], frames: u32) -> Result<FramePlan<'static>, Error> {
    let plane = |name, words| Buffer { name, words: words * pixels(size), contents: None };
    let tiles = Buffer { name: "tiles", words: size_of::<TileWords>() / 4, contents: None };
    let planes = ["hits", "hits", "reservoirs", "reservoirs", "shared", "direct", "film"].map(|name| plane(name, 4));
    let buffers = planes.into_iter().chain([tiles, things()]).collect();
    let (shared, direct, film, scene) = (4, ("direct", 5), ("film", 6), [("tiles", 7), ("things", 8)]);
    let mut passes = Vec::new();
    for frame in 0..frames {
        let [this, last] = [frame as usize % 2, (frame as usize + 1) % 2];
        let [hits, reservoirs] = [("hits", this), ("reservoirs", 2 + this)];
        let params = DiParams::new(camera(size, frame), size, 7).of_frame(frame, camera(size, frame));
        let mut pass = |kernel, params: &DiParams, bound: &[(&str, usize)]| {
            let bound = [bound, &scene, &[hits]].concat();
            Pass::new(kernel, &[], params, &bound).map(|pass| passes.push(pass))
        };
        pass(&INITIAL, &params, &[reservoirs, direct])?;
        if frame > 0 {
            let before = LastFrame::of_view(camera(size, frame - 1), false);
            pass(&COMBINE, &params.with_last(&before), &[("other_hits", last), ("others", 2 + last), reservoirs])?;
        }
        let neighbours = [("other_hits", this), ("others", 2 + this), ("reservoirs", shared)];
        pass(&COMBINE, &params.with_neighbours(0), &neighbours)?;
        pass(&SHADE, &params, &[("reservoirs", shared), direct, film])?;
    }
    Ok(FramePlan::of(buffers, passes, vec![film.1]))
}

fn pixels([width, height]: [u32; 2]) -> usize {
    width as usize * height as usize
}
