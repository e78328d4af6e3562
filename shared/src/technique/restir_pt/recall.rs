//! What has become of the last frame's paths since.

use super::PtParams;
use super::record::PackedPath;
use crate::num;
use crate::resample::params::Flags;
use crate::scene::{Frames, Surface};
use crate::shift::Path;

/// A path of the other frame as it is in a scene that has changed since: its light has another index, or shines no more, and the
/// density of its vertex k is over an area that may have been deformed.
#[inline(always)]
pub fn recall<F: Frames>(frames: &F, params: &PtParams, packed: PackedPath) -> PackedPath {
    recalled(frames, params, packed, packed.unpack().path)
}

/// The same of `path`, which is the one that is packed, but for what arrives at its vertex k.
#[inline(always)]
pub(super) fn recalled<F: Frames>(frames: &F, params: &PtParams, packed: PackedPath, mut path: Path) -> PackedPath {
    let extent = carry(frames, params, true, &mut path);
    let term = if extent > 0.0 { num::flush(num::div(path.term, extent)) } else { 0.0 };
    packed.carried(&path, term)
}

/// Takes a path to the respective other frame; it has a term of 0 if there is none there. Returns the area there over the area here
/// around its vertex k.
#[inline(always)]
pub(super) fn carry<F: Frames>(frames: &F, params: &PtParams, of_other: bool, path: &mut Path) -> f32 {
    // of what is no path the words say nothing
    if path.length == 0 {
        return 1.0;
    }
    let mut known = !path.keeps_arrival() | params.has(Flags::TAKES_ALL);
    if path.keeps_light() {
        path.light = frames.counterpart(path.light, of_other);
        known &= path.light.is_light();
    }
    let mut extent = 1.0;
    if path.keeps_surface() {
        let here = frames.scene(of_other).location(&path.hit).extent;
        let there = frames.scene(!of_other).location(&path.hit).extent;
        extent = if here > 0.0 { num::div(there, here) } else { 0.0 };
    }
    path.term = if known { path.term } else { 0.0 };
    extent
}
