//! Samples between passes of different shifts.

use super::origin::{Entrance, SssOrigin};
use super::record::{Kind, PackedSubsurface, Sample, Stored};
use super::{NUMBERS, SssParams};
use crate::bsdf::Material;
use crate::geometry::{Crossings, Ray};
use crate::resample::params::Flags;
use crate::rng;
use crate::scene::{Probe, Surface};
use crate::technique::path::hybrid::segment_key;

/// Makes the sample of the pixel `at` ready for the other shift, at its own origin: the sequential shift of Werner et al. 2024 (supplemental, §2 and §4).
///
/// With [`Flags::DELAYED`] a point that was [kept](Kind::Kept) gets random numbers that find it from here, and the index of its crossing: all that do are
/// drawn in proportion to their shares in the density, so that its contribution weight stays what it is (probabilistic inversion, Eq. 7 to 16). A
/// point that no segment finds here stays kept, and delayed reconnection fails. Without the flag, numbers that were [replayed](Kind::Replayed) get the
/// point that they find here.
#[inline(always)]
pub fn index<S: Surface<Material = Material> + Probe>(
    scene: &S,
    params: &SssParams,
    origin: &SssOrigin,
    packed: PackedSubsurface,
    at: [u32; 2],
) -> PackedSubsurface {
    let stored = packed.unpack();
    let inverts = params.has(Flags::DELAYED);
    let due = if inverts { Kind::Kept } else { Kind::Replayed };
    if (stored.sample.kind != due) | (stored.contribution_weight <= 0.0) {
        return packed;
    }
    let entrance = Entrance::new(scene, params, origin, false);
    let point = scene.location(&stored.sample.hit);
    let u = rng::unit(params.rng(at).hash(NUMBERS.wrapping_add(params.merge)).x);
    let drawn =
        if inverts { entrance.profile.disk.invert(point.position, point.normal, u).0 } else { stored.sample.numbers };
    // as they are stored, for it is these that are replayed
    let numbers = Sample::stored_numbers(&drawn);
    let key = segment_key(&numbers, scene.features());
    let crossings = scene.probe(&Ray { key, ..entrance.profile.disk.segment(&numbers) }, entrance.body);
    let mut found = Crossings::LISTED;
    let mut hit = stored.sample.hit;
    let mut index = 0;
    while index < Crossings::LISTED {
        let met = crossings.listed(index);
        let is_it = if inverts { met.id == stored.sample.hit.id } else { index as u32 == stored.sample.crossing };
        if met.is_hit() & is_it {
            found = index;
            hit = if inverts { hit } else { met };
        }
        index += 1;
    }
    let is_found = found < Crossings::LISTED;
    if !inverts {
        let sample = Sample { hit, kind: Kind::Kept, partial_jacobian: 1.0, ..stored.sample };
        let weight = if is_found { stored.contribution_weight } else { 0.0 };
        return Stored { sample, contribution_weight: weight, ..stored }.pack();
    }
    let partial_jacobian = entrance.partial_jacobian(&numbers, entrance.density(&point));
    if !(is_found & (partial_jacobian > 0.0)) {
        return packed;
    }
    let sample = Sample { numbers, crossing: found as u32, kind: Kind::Replayed, partial_jacobian, ..stored.sample };
    Stored { sample, ..stored }.pack()
}
