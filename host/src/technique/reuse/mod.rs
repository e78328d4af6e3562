//! What all techniques share that reuse records of other pixels and frames: the chain of frames that their passes make, and by replay the
//! genealogy of any record, back to the candidate. A technique describes its passes and its record (docs/design/reuse.md).
//!
//! ```
//! use restir_host::render::Render;
//! use restir_host::technique::explain::Place;
//! use restir_host::technique::restir_di::DiSettings;
//! use restir_host::technique::reuse::{Origin, genealogy, render_with_layers};
//! use restir_host::{Error, buffers::SceneBuffers, exec::CpuExecutor, scene::Scene};
//! use restir_shared::technique::restir_di::PackedReservoir;
//!
//! let scene = SceneBuffers::build(&Scene::load("cornell")?)?;
//! let job = Render { count: 4, ..Render::new([16, 12], DiSettings::default()) };
//! let (place, mut cpu) = (Place { x: 8, y: 6, sample: 0 }, CpuExecutor::new()?);
//!
//! // each record comes from the next one, and the last one was drawn
//! let generations = genealogy::<PackedReservoir>(&mut cpu, &scene, &job, place)?;
//! assert!(generations.iter().all(|generation| generation.is_identical()));
//! assert!(matches!(generations.last().map(|last| last.origin), Some(Origin::Candidate(_))));
//!
//! let layers = render_with_layers::<PackedReservoir>(&mut cpu, &scene, &job, &mut |_| Ok(()))?.layers;
//! assert_eq!(layers.records[6 * 16 + 8], generations[0].stored());
//! # Ok::<(), Error>(())
//! ```

pub(crate) mod chain;
pub(crate) mod explain;
mod form;
mod genealogy;
mod layers;
mod lineage;
pub(crate) mod mutual;
pub(crate) mod offers;
pub(crate) mod planes;
mod record;

pub use form::Form;
pub(crate) use genealogy::check;
pub use genealogy::{Generation, genealogy};
pub(crate) use layers::ages;
pub use layers::{Layers, render_with_layers};
pub use lineage::Origin;
pub(crate) use lineage::{Followed, Kernel, Lineage};
pub use offers::{Counts, Offered};
pub use record::Reuse;
pub(crate) use record::reuse_of;
pub(crate) use record::{Before, PassParams, Replay, Reused, Specialises};

/// Of a plan: passes are as many as was said, and fit its buffers. The names of those that none uses.
#[cfg(test)]
pub(crate) fn unused(plan: crate::plan::FramePlan<'_>) -> Vec<&'static str> {
    let passes = plan.passes.collect::<Result<Vec<_>, _>>().expect("passes are made");
    passes.iter().for_each(|pass| pass.check(&plan.buffers).expect("fits"));
    assert_eq!(passes.len() as u64, plan.pass_count);
    let is_used = |id: &usize| passes.iter().any(|pass| pass.bindings.contains(id));
    (0..plan.buffers.len()).filter(|id| !is_used(id)).map(|id| plan.buffers[id].name).collect()
}
