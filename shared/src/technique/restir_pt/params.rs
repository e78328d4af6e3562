//! Parameters of the kernels of ReSTIR PT, and elements of their planes.

use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::resample::mis::{INPUTS, Mis};
use crate::resample::reproject::Grid;
use crate::resample::similar::Similarity;
use crate::rng::Sampler;
use crate::shift::Hybrid;
use bytemuck::{Pod, Zeroable};

/// Flag: numbers are drawn by [`Sampler::Sobol`].
pub const PT_SOBOL: u32 = 1;
/// Flag: camera rays are spread over the pixel.
pub const PT_JITTER: u32 = 1 << 1;
/// Flag: a merge or a shift takes paths of the other frame to this one.
pub const PT_OTHER_FRAME: u32 = 1 << 2;
/// Flag, with [`PT_OTHER_FRAME`]: a shift takes jobs the other way, from this frame to the other one.
pub const PT_BACK: u32 = 1 << 3;
/// Flag, of a merge with [`PT_OTHER_FRAME`]: every pixel has the same start in both frames, and the scene is the same, so that paths are what
/// they were.
pub const PT_STILL: u32 = 1 << 4;
/// Flag, with [`PT_CHANGED`]: paths that keep what arrives at vertex k are taken to the other frame, too, with what the plane has of it:
/// [`retrace`](super::retrace) has found it there, or else it is stale.
pub const PT_TAKES_ALL: u32 = 1 << 5;
/// Flag: the scene has changed since the other frame.
pub const PT_CHANGED: u32 = 1 << 6;
/// Flag: paths of up to two segments are somebody else's.
pub const PT_INDIRECT: u32 = 1 << 7;

/// Parameters of a pass. [`Self::new`] makes them; those of `default` are all zero, an image without pixels, for what writes every field that
/// counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PtParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The tables of the other frame, in the same arenas; the same ones within a frame, and of a scene that does not move.
    pub other_scene: SceneHeader,
    /// The camera of this frame.
    pub camera: CameraParams,
    /// The camera of the other frame; the same one within a frame.
    pub other_camera: CameraParams,
    /// Where paths are joined.
    pub hybrid: Hybrid,
    /// Width of the image in pixels.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// Index of the frame: its paths are samples of that number.
    pub frame: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Longest path in segments, at most 255.
    pub max_depth: u32,
    /// The `PT_` flags.
    pub flags: u32,
    /// Neighbours that a pixel shares paths with, at most [`MAX_NEIGHBOURS`]; one in the other frame.
    pub neighbours: u32,
    /// Where they lie, see [`Pairing::tile`](crate::resample::pairing::Pairing::tile).
    pub tile: u32,
    /// See [`Similarity`].
    pub max_plane_distance: f32,
    /// See [`Similarity`].
    pub min_normal_cos: f32,
    /// How paths are weighed against each other: the bits of a form of [`Mis`] that is inside.
    pub form: u32,
    /// Layers of the grid, each of the image's size: one for each neighbour where there are jobs, else one.
    pub layers: u32,
    /// Which merge of the frame this is: their random numbers differ.
    pub merge: u32,
    /// Largest confidence of a path of another frame.
    pub confidence_cap: f32,
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<PtParams>() == 368);

/// The most neighbours of a pass.
pub const MAX_NEIGHBOURS: u32 = 8;
const _: () = assert!((MAX_NEIGHBOURS as usize) < INPUTS);

impl Extent for PtParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height * self.layers]
    }
}

impl PtParams {
    /// Parameters of a frame of its own, whose passes are [`super::trace`], [`super::pair`], [`super::shift_job`], [`super::merge`] and
    /// [`super::shade`]. The scene's tables are left out: a scene of other types has none.
    ///
    /// Paths have up to 8 segments and are joined by footprint, as the defaults of the program have it; pixels share them with 4 neighbours in
    /// tiles of 8 pixels, weighed by [`Mis::PAIRWISE_DEFENSIVE`], with Sobol's numbers. All of it is unbiased. [`super::pair`] and
    /// [`super::shift_job`] run over [`Self::with_jobs`].
    pub fn new(camera: CameraParams, [width, height]: [u32; 2], seed: u32) -> Self {
        Self {
            camera,
            other_camera: camera,
            hybrid: Hybrid::by_footprint(0.02, 0.1),
            width,
            height,
            seed,
            max_depth: 8,
            flags: PT_SOBOL,
            neighbours: 4,
            tile: 3,
            max_plane_distance: 0.02,
            min_normal_cos: 0.5,
            form: Mis::PAIRWISE_DEFENSIVE.bits(),
            layers: 1,
            confidence_cap: 20.0,
            ..Self::default()
        }
    }

    /// The same over a layer of jobs for each neighbour.
    #[must_use]
    pub fn with_jobs(self) -> Self {
        Self { layers: self.neighbours, ..self }
    }

    /// The same in a kernel that was specialised to the flags in `bits`, or to none by a word without zeros.
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: self.flags & bits, ..self }
    }

    /// The image.
    #[inline(always)]
    pub(super) fn grid(&self) -> Grid {
        Grid { width: self.width, height: self.height }
    }

    /// How alike surfaces have to be.
    #[inline(always)]
    pub(super) fn similarity(&self) -> Similarity {
        Similarity { max_plane_distance: self.max_plane_distance, min_normal_cos: self.min_normal_cos }
    }

    /// Whether a flag is set.
    #[inline(always)]
    pub(super) fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// The form of MIS.
    #[inline(always)]
    pub(super) fn form(&self) -> Mis {
        Mis::from_bits(self.form)
    }

    /// How the numbers of a path are spread.
    #[inline(always)]
    pub fn sampler(&self) -> Sampler {
        if self.has(PT_SOBOL) { Sampler::Sobol } else { Sampler::Independent }
    }
}

/// The surface on which paths start, as far as it decides with whom they are shared; without one the distance is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PtFacet {
    /// World position.
    pub position: [f32; 3],
    /// Its distance from the camera.
    pub distance: f32,
    /// Unit geometric normal.
    pub normal: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<PtFacet>() == 32);

/// A path that is to be shifted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Job {
    /// The index of the path in its plane.
    pub path: u32,
    /// The index of the start that it is taken to.
    pub start: u32,
}

impl Job {
    /// No shift is asked for.
    pub const NONE: Self = Self { path: u32::MAX, start: 0 };
}

/// What became of a job, in 16 bytes: zeros if the path cannot be shifted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct JobShifted {
    /// The integrand at the start, linear RGB.
    pub value: [f32; 3],
    /// See [`Path::term`](crate::shift::Path::term); over that of the path it is the Jacobian.
    pub term: f32,
}
