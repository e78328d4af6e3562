//! Samples in planes, as what [`mutual`](crate::resample::mutual) shifts.

use super::SssParams;
use super::evaluate::evaluate;
use super::origin::{Entrance, SssOrigin};
use super::record::{Kind, PackedSubsurface, Sample, Stored};
use crate::bsdf::Material;
use crate::geometry::{Hit, Ray};
use crate::resample::mutual::{Cause, Record, Shift, Shifted};
use crate::resample::params::Flags;
use crate::scene::{AddressedLights, Frames, Probe, Surface, Trace};
use crate::technique::path::hybrid::segment_key;
use crate::transport::shadow_ray;

impl<F> Shift<F> for PackedSubsurface
where
    F: Frames,
    F::Scene: Probe + Surface<Material = Material>,
{
    type Params = SssParams;
    type Origin = SssOrigin;

    #[inline(always)]
    fn shifted(&self, frames: &F, params: &SssParams, origin: &SssOrigin) -> Shifted {
        let back = params.has(Flags::BACK);
        let Stored { mut sample, contribution_weight, .. } = self.unpack();
        if back & params.has(Flags::CHANGED) {
            sample.light = frames.counterpart(sample.light, false);
        }
        let exists = (contribution_weight > 0.0) & sample.light.is_light() & origin.hit.unpack().is_hit();
        if exists { shifted(&frames.scene(back), params, &sample, origin) } else { Shifted::failed(Cause::Unshiftable) }
    }
}

/// A sample at an origin.
#[inline(always)]
fn shifted<S: Trace + Surface<Material = Material> + AddressedLights + Probe>(
    scene: &S,
    params: &SssParams,
    sample: &Sample,
    origin: &SssOrigin,
) -> Shifted {
    let entrance = Entrance::new(scene, params, origin, params.has(Flags::BACK));
    let hit = match sample.kind {
        Kind::Kept => sample.hit,
        Kind::Replayed => replayed(scene, sample, &entrance),
        Kind::AtEntry => entrance.hit,
    };
    if !hit.is_hit() || scene.interior(&hit).body != entrance.body {
        return Shifted::failed(Cause::Replay);
    }
    let at = scene.location(&hit);
    let is_replayed = sample.kind == Kind::Replayed;
    if (sample.kind != Kind::AtEntry) & (params.replays(entrance.is_connectable(&at)) != is_replayed) {
        return Shifted::failed(Cause::Joins);
    }
    // what the profile says first, then the light: so that little is kept at a time
    let is_entry = sample.kind == Kind::AtEntry;
    let worth = if is_entry { entrance.lambert() } else { entrance.worth(&at) };
    let term = if is_replayed { entrance.partial_jacobian(&sample.numbers, entrance.density(&at)) } else { 1.0 };
    let light = scene.light_at(sample.light);
    let value = evaluate(scene, (&hit, &at), worth, &light);
    // what is kept lies where it was found to be lit
    let asks = (sample.kind != Kind::Kept) | params.has(Flags::CHANGED);
    if PackedSubsurface::target(value) <= 0.0 {
        return Shifted::failed(Cause::Dark);
    }
    if asks && scene.occluded(&shadow_ray(&at, &light.sample)) {
        return Shifted::failed(Cause::Blocked);
    }
    Shifted { value, term, cause: if term > 0.0 { Cause::Nothing } else { Cause::Broken } }
}

/// The point that the sample's numbers find around another entry.
#[inline(always)]
fn replayed<S: Surface + Probe>(scene: &S, sample: &Sample, entrance: &Entrance) -> Hit {
    let segment = entrance.profile.disk.segment(&sample.numbers);
    let key = segment_key(&sample.numbers, scene.features());
    scene.probe(&Ray { key, ..segment }, entrance.body).listed(sample.crossing as usize)
}
