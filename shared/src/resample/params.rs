//! What the parameters of every pass of reuse have in common, whatever the samples are.
//!
//! A technique's own block of parameters begins with [`ReuseParams`] and dereferences to it. A frame's passes have the parameters of the
//! frame, changed by [`ReuseParams::with_last`] for temporal reuse and by [`ReuseParams::with_neighbours`] for spatial reuse.
//!
//! ```
//! use restir_shared::glam::Vec3;
//! use restir_shared::layout::{CameraParams, SceneHeader};
//! use restir_shared::resample::mis::Mis;
//! use restir_shared::resample::params::{Flags, LastFrame, ReuseParams};
//!
//! let camera = CameraParams::pinhole(Vec3::Z, Vec3::ZERO, Vec3::Y, 0.5, [64, 48]);
//! let frame = ReuseParams::new(camera, [64, 48], 7).of_frame(3, camera);
//! assert_eq!(frame.flags.form(), Mis::PAIRWISE_DEFENSIVE);
//!
//! // temporal reuse in a view that stands still: a pixel's reservoirs of both frames are merged by confidence alone
//! let last = LastFrame { camera, scene: SceneHeader::default(), same_view: true };
//! let temporal = frame.with_last(&last);
//! assert!(temporal.flags.contains(Flags::STILL) && temporal.flags.form() == Mis::CONSTANT);
//! assert_eq!(temporal.other_frame, 2);
//!
//! // the second spatial pass of the frame draws random numbers of its own
//! assert_eq!(frame.with_neighbours(1).merge, 2);
//! ```

use super::mis::Mis;
use super::reproject::Grid;
use super::similar::Similarity;
use crate::layout::{CameraParams, Extent, SceneHeader};
use crate::rng::{Rng, Sampler};
use bytemuck::{Pod, Zeroable};
use core::ops::BitOr;

/// What a pass does: a set of flags, and a form of MIS.
///
/// The lowest 8 bits are the flags that all techniques have, 16 bits are for a technique's own (`of_technique`), and the
/// highest 8 bits are the form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Flags(u32);

crate::fields!(Flags);

impl Flags {
    /// Camera rays are spread uniformly over the pixel.
    pub const JITTER: Self = Self(1);
    /// Numbers are drawn by [`Sampler::Sobol`].
    pub const SOBOL: Self = Self(1 << 1);
    /// A merge takes the other reservoirs from another frame. Without this flag they are of the same frame.
    pub const OTHER_FRAME: Self = Self(1 << 2);
    /// In a merge with another frame, every pixel has the same camera ray in both frames, and the scene is the same, so that samples and
    /// their visibility are what they were.
    pub const STILL: Self = Self(1 << 3);
    /// The scene has changed since the other frame.
    pub const CHANGED: Self = Self(1 << 4);
    /// With [`Self::OTHER_FRAME`]: a pass of shifts goes the other way, from this frame to the other one.
    pub const BACK: Self = Self(1 << 5);
    /// A merge of mutual pairs leaves what all samples send together, for shading alone: the integrand of its record is their sum, and its
    /// contribution weight is 1.
    pub const SUMS: Self = Self(1 << 6);
    /// In a merge with another frame of mutual pairs, samples of requests begin at the same vertex in both frames, and the scene is the same, so that they are
    /// what they were. As [`Self::STILL`], but requests say who shares.
    pub const KEPT: Self = Self(1 << 7);
    /// Position of a technique's flags.
    const TECHNIQUE_SHIFT: u32 = 8;
    /// Position of the bits of [`Mis`].
    const MIS_SHIFT: u32 = 24;

    /// What differs between the passes of a frame. A kernel that is specialised to flags is not specialised to these, or it would have to
    /// be compiled for every pass.
    #[doc(hidden)]
    pub const OF_PASSES: Self = Self(
        Self::OTHER_FRAME.0
            | Self::STILL.0
            | Self::CHANGED.0
            | Self::BACK.0
            | Self::SUMS.0
            | Self::KEPT.0
            | (0xff << Self::MIS_SHIFT),
    );

    /// The n-th of a technique's own flags, n from 0 to 15.
    pub(crate) const fn of_technique(n: u32) -> Self {
        Self(1 << (Self::TECHNIQUE_SHIFT + n))
    }

    /// These flags but for those in `others`.
    #[doc(hidden)]
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// These flags as far as they are in the word `bits`.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub const fn within(self, bits: u32) -> Self {
        Self(self.0 & bits)
    }

    /// No flag but a form of MIS. To replace the form of other flags is for [`Self::with_form`]: `|` would mix the two.
    #[doc(hidden)]
    pub const fn of_form(form: Mis) -> Self {
        Self(form.bits() << Self::MIS_SHIFT)
    }

    /// These flags with a form of MIS in place of their own. The cost of [`Mis::PAIRWISE_DEFENSIVE`] grows with the
    /// number of neighbours, that of [`Mis::TALBOT`] with the square of that number.
    #[doc(hidden)]
    #[must_use]
    pub const fn with_form(self, form: Mis) -> Self {
        Self(self.0 & ((1 << Self::MIS_SHIFT) - 1) | Self::of_form(form).0)
    }

    /// The form of MIS.
    #[doc(hidden)]
    #[inline(always)]
    pub fn form(self) -> Mis {
        Mis::from_bits(self.0 >> Self::MIS_SHIFT)
    }

    /// Whether a flag is set.
    #[inline(always)]
    pub fn contains(self, flag: Self) -> bool {
        self.0 & flag.0 != 0
    }

    /// How samples are spread over frames and candidates.
    #[inline(always)]
    pub fn sampler(self) -> Sampler {
        if self.contains(Self::SOBOL) { Sampler::Sobol } else { Sampler::Independent }
    }

    /// The word, to which a kernel is specialised.
    pub const fn bits(self) -> u32 {
        self.0
    }
}

impl BitOr for Flags {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// The parameters that all techniques of reuse have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ReuseParams {
    /// The scene's tables.
    pub scene: SceneHeader,
    /// The tables of the other reservoirs' frame, in the same arenas; the same ones within a frame, and of a scene that
    /// does not move.
    pub other_scene: SceneHeader,
    /// The camera of this frame.
    pub camera: CameraParams,
    /// The camera of the other reservoirs' frame; the same one within a frame.
    pub other_camera: CameraParams,
    /// Image width in pixels, at most 16384.
    pub width: u32,
    /// Image height in pixels, at most 16384.
    pub height: u32,
    /// Index of the frame. Its random numbers are those of the sample of this index.
    pub frame: u32,
    /// Index of the other reservoirs' frame.
    pub other_frame: u32,
    /// Seed of the random numbers. Runs with different seeds, neighbouring ones too, are independent.
    pub seed: u32,
    /// What the pass does.
    pub flags: Flags,
    /// How many neighbours the pass has; of one that takes a single reservoir of another frame, see the technique.
    pub neighbours: u32,
    /// Which merge of the frame this is: their random numbers differ.
    pub merge: u32,
    /// Largest confidence of a reservoir of another frame, at most [`MAX_CONFIDENCE`](super::packed::MAX_CONFIDENCE).
    pub confidence_cap: f32,
    /// A neighbour's distance from the tangent plane is at most this part of the distance to the camera.
    pub max_plane_distance: f32,
    /// A neighbour's normal has at least this cosine with the pixel's.
    pub min_normal_cos: f32,
    /// Where mutual neighbours lie, see [`Pairing::tile`](super::pairing::Pairing::tile).
    pub tile: u32,
    /// Layers of the grid of invocations, each of the image's size: one for each mutual neighbour in passes over requests, else one.
    pub layers: u32,
}

crate::fields!(ReuseParams: scene, other_scene, camera, other_camera, width, height, frame, other_frame, seed, flags, neighbours, merge, confidence_cap, max_plane_distance, min_normal_cos, tile, layers);

const _: () = assert!(size_of::<ReuseParams>() == 340);

impl Extent for ReuseParams {
    fn extent(&self) -> [u32; 2] {
        [self.width, self.height * self.layers]
    }
}

/// The frame before the one in work.
#[derive(Clone, Copy, Debug)]
pub struct LastFrame {
    /// What saw it.
    pub camera: CameraParams,
    /// The tables of its scene.
    pub scene: SceneHeader,
    /// Every pixel had the same camera ray in it, and the scene was the same: a fact to state, which saves finding out what the last frame
    /// saw.
    pub same_view: bool,
}

impl LastFrame {
    /// The frame that `camera` saw, of a scene that has no tables.
    pub fn of_view(camera: CameraParams, same_view: bool) -> Self {
        Self { camera, scene: SceneHeader::default(), same_view }
    }
}

impl ReuseParams {
    /// Parameters of a chain's first frame, with unbiased settings: [`Mis::PAIRWISE_DEFENSIVE`], 4 neighbours in tiles of 8 x 8 pixels on
    /// surfaces within 2 % of the distance and 60 degrees, a confidence of at most 20 frames, Sobol's numbers. The scene's tables are left
    /// out: a scene of other types has none.
    pub fn new(camera: CameraParams, [width, height]: [u32; 2], seed: u32) -> Self {
        Self {
            camera,
            other_camera: camera,
            width,
            height,
            seed,
            flags: Flags::of_form(Mis::PAIRWISE_DEFENSIVE) | Flags::SOBOL,
            neighbours: 4,
            confidence_cap: 20.0,
            max_plane_distance: 0.02,
            min_normal_cos: 0.5,
            tile: 3,
            layers: 1,
            ..Self::default()
        }
    }

    /// The same chain's frame of that index, seen by `camera`. Each frame needs its own index: with that of another frame the numbers of
    /// both are the same, and their reuse is biased.
    #[must_use]
    pub fn of_frame(self, frame: u32, camera: CameraParams) -> Self {
        Self { frame, other_frame: frame, camera, other_camera: camera, ..self }
    }

    /// The parameters of the merge of a frame with the one before it.
    #[must_use]
    pub fn with_last(self, last: &LastFrame) -> Self {
        let flags = if last.same_view { self.flags.with_form(Mis::CONSTANT) | Flags::STILL } else { self.flags };
        Self {
            flags: flags | Flags::OTHER_FRAME,
            other_scene: last.scene,
            other_camera: last.camera,
            other_frame: self.frame.wrapping_sub(1),
            ..self
        }
    }

    /// The parameters of the merge with neighbours in the same frame, the `pass`-th of them, counted from 0. Without this call it
    /// would draw the numbers of the merge with the last frame again.
    #[must_use]
    pub fn with_neighbours(self, pass: u32) -> Self {
        Self { merge: 1 + pass, ..self }
    }

    /// The same over a layer of requests for each neighbour.
    #[must_use]
    pub fn with_layers(self) -> Self {
        Self { layers: self.neighbours, ..self }
    }

    /// The same in a kernel that was specialised to the flags in `bits`, or to none by a word without zeros: what other flags
    /// ask for, a driver need not compile.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { flags: self.flags.within(bits), ..self }
    }

    /// The pixels of the image, by which neighbours are found.
    #[doc(hidden)]
    #[inline(always)]
    pub fn grid(&self) -> Grid {
        Grid { width: self.width, height: self.height }
    }

    /// How alike neighbours have to be.
    #[doc(hidden)]
    #[inline(always)]
    pub fn similarity(&self) -> Similarity {
        Similarity { max_plane_distance: self.max_plane_distance, min_normal_cos: self.min_normal_cos }
    }

    /// The random numbers of a pixel.
    #[doc(hidden)]
    #[inline(always)]
    pub fn rng(&self, [x, y]: [u32; 2]) -> Rng {
        Rng::new(x, y, self.frame, self.seed, self.flags.sampler())
    }
}

/// Makes a technique's block of parameters read and write as if the fields of its [`ReuseParams`], in the field `reuse`, were its own, with
/// those methods of [`ReuseParams`] that change nothing else. `in pairs` adds what techniques ask for whose pixels share in
/// [`mutual`](super::mutual) pairs.
macro_rules! reuses {
    ($params:ty, in pairs) => {
        $crate::resample::params::reuses!($params);

        impl $params {
            /// See [`ReuseParams::with_layers`].
            #[must_use]
            pub fn with_layers(self) -> Self {
                Self { reuse: self.reuse.with_layers(), ..self }
            }

            /// The same with more flags.
            #[must_use]
            pub fn with_flags(self, more: $crate::resample::params::Flags) -> Self {
                let mut reuse = self.reuse;
                reuse.flags = reuse.flags | more;
                Self { reuse, ..self }
            }

            /// Whether a flag is set.
            #[inline(always)]
            pub(super) fn has(&self, flag: $crate::resample::params::Flags) -> bool {
                self.flags.contains(flag)
            }
        }
    };
    ($params:ty) => {
        impl core::ops::Deref for $params {
            type Target = $crate::resample::params::ReuseParams;

            #[inline(always)]
            fn deref(&self) -> &Self::Target {
                &self.reuse
            }
        }

        impl core::ops::DerefMut for $params {
            #[inline(always)]
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.reuse
            }
        }

        impl $params {
            /// See [`ReuseParams::of_frame`].
            #[must_use]
            pub fn of_frame(self, frame: u32, camera: $crate::layout::CameraParams) -> Self {
                Self { reuse: self.reuse.of_frame(frame, camera), ..self }
            }

            /// See [`ReuseParams::with_neighbours`].
            #[must_use]
            pub fn with_neighbours(self, pass: u32) -> Self {
                Self { reuse: self.reuse.with_neighbours(pass), ..self }
            }
        }
    };
}
pub(crate) use reuses;
