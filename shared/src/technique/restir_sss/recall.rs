//! What has become of the last frame's samples since.

use super::record::PackedSubsurface;
use crate::resample::mutual::Record;
use crate::scene::Frames;

/// A sample of the other frame in a scene that has changed since: its light has another index, or shines no more. Points keep their addresses.
#[inline(always)]
pub fn recall<F: Frames>(frames: &F, packed: PackedSubsurface) -> PackedSubsurface {
    let light = frames.counterpart(packed.unpack().sample.light, true);
    let weight = if light.is_light() { packed.contribution_weight() } else { 0.0 };
    packed.lit_by(light).weighted(weight, packed.confidence())
}
