//! Parameters of path tracing with diffusion.

use crate::diffusion::{Remainder, Shape, Support};
use crate::layout::Extent;
use crate::medium::Interior;
use crate::num::max;
use crate::rng::Rng;
use crate::technique::path::{PathFlags, PathParams};
use crate::transport::WayOut;
use bytemuck::{Pod, Zeroable};
use core::ops::Deref;
use glam::Vec3;

/// Mean free paths of fewer offsets of rays are too short to be traced.
const OFFSETS: f32 = 8.0;

/// The most segments that may be asked for at an entry.
pub const MAX_SEGMENTS: u32 = 16;

/// Parameters of the kernels `path_entry`, `path_profile` and `path_exits`: one sample of every pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct HybridParams {
    /// As of path tracing: its block is the sample `first_sample` alone.
    pub path: PathParams,
    /// Channels of a mean free path that is shorter than so much of the path up to the entry are Lambertian.
    pub lambert_below: f32,
    /// How many segments look for points of a profile, at least 1 and at most [`MAX_SEGMENTS`].
    pub segments: u32,
    /// Zeros.
    pub reserved: [u32; 2],
}

crate::fields!(HybridParams: path, lambert_below, segments, reserved);

impl Extent for HybridParams {
    fn extent(&self) -> [u32; 2] {
        self.path.extent()
    }
}

/// What is asked of path tracing's parameters is asked of these, too: by kernels for instance, where the scene is.
impl Deref for HybridParams {
    type Target = PathParams;

    #[inline(always)]
    fn deref(&self) -> &PathParams {
        &self.path
    }
}

impl HybridParams {
    /// As [`PathParams::specialised`].
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn specialised(self, bits: u32) -> Self {
        Self { path: self.path.specialised(bits), ..self }
    }

    /// Whether any of the flags is set.
    #[inline(always)]
    pub(super) fn has(&self, flags: PathFlags) -> bool {
        self.path.flags.contains(flags)
    }

    /// The random numbers of the pixel's sample.
    #[inline(always)]
    pub(super) fn rng(&self, [x, y]: [u32; 2]) -> Rng {
        Rng::new(x, y, self.path.first_sample, self.path.seed, self.path.sampler())
    }

    /// How much counts of what enters no body, if diffuse and specular lobes at the first surface have these shares in it.
    #[inline(always)]
    pub(super) fn share(&self, diffuse: f32, specular: f32) -> f32 {
        if self.has(PathFlags::DIFFUSE) {
            diffuse
        } else if self.has(PathFlags::SPECULAR) {
            specular
        } else {
            1.0
        }
    }

    /// What profiles are.
    #[inline(always)]
    pub fn fit(&self) -> Fit {
        Fit { flags: self.path.flags, lambert_below: self.lambert_below }
    }

    #[inline(always)]
    pub(super) fn way_out(&self) -> WayOut {
        if self.has(PathFlags::DRAWN) { WayOut::Drawn } else { WayOut::Dimmed }
    }
}

/// Which profile stands for light under a surface, and which densities count of its sampled points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Fit {
    /// Those of path tracing that say it; others do not count.
    pub flags: PathFlags,
    /// See [`HybridParams::lambert_below`].
    pub lambert_below: f32,
}

impl Fit {
    /// Whether any of the flags is set.
    #[inline(always)]
    pub(crate) fn has(&self, flags: PathFlags) -> bool {
        self.flags.contains(flags)
    }

    /// By channel 1, or 0 where light comes out so near to where it enters that the surface is Lambertian: where the mean free path is some
    /// widths of a pixel, as the setting has it, or some offsets of rays.
    #[inline(always)]
    pub fn spread(&self, interior: &Interior, travelled: f32) -> Vec3 {
        let least = max(self.lambert_below * travelled, OFFSETS * interior.offset);
        let kept = |extinction: f32| if extinction * least <= 1.0 { 1.0 } else { 0.0 };
        let Vec3 { x, y, z } = interior.extinction;
        Vec3::new(kept(x), kept(y), kept(z))
    }

    /// Which part of a profile is left of what has scattered once.
    #[inline(always)]
    pub fn remainder(&self) -> Remainder {
        if self.has(PathFlags::SIGNED) {
            Remainder::Signed
        } else if self.has(PathFlags::CLAMPED) {
            Remainder::Clamped
        } else {
            Remainder::Diffuse
        }
    }

    /// The shape of the profile.
    #[inline(always)]
    pub fn shape(&self) -> Shape {
        self.remainder().shape()
    }

    /// Which densities count of a sampled point.
    #[inline(always)]
    pub fn support(&self) -> Support {
        if self.has(PathFlags::PUBLISHED) { Support::Published } else { Support::Exact }
    }
}

const _: () = assert!(size_of::<HybridParams>() == 192);
