//! What a technique says of its record: how passes over it are replayed, what is printed of it, and its layers.

use super::explain::Genealogy;
use super::{Followed, Generation, Kernel, Layers, Lineage, Origin};
use crate::{Error, image::Channel};
use bytemuck::Pod;
use restir_shared::layout::Extent;
use restir_shared::resample::params::{Flags, ReuseParams};
use serde_json::{Value, json};
use std::{collections::BTreeMap, fmt::Debug, ops::DerefMut};

/// What a pass does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reuse {
    /// Draws candidates.
    Initial,
    /// Brings the last frame's records into a scene that has changed since.
    Recalled,
    /// Makes records ready for a pass of another shift.
    Readied,
    /// Merges with the last frame's records.
    Temporal,
    /// Merges with the last frame's record and its neighbours.
    Fused,
    /// Merges with neighbours: which of the passes that do, from 1.
    Spatial(u32),
}

/// Computes the record of a pixel once more, and tells where it comes from.
pub(crate) type Replay<'a, R> = Box<dyn Fn(u32) -> (R, Origin) + Send + Sync + 'a>;

/// What there was beside records, pixel by pixel, after passes.
pub(crate) type Before<R> = BTreeMap<usize, Vec<<R as Reused>::Beside>>;

/// The value of the constant `settings`, to which the kernel of a pass is specialised.
pub trait Specialises: Pod + Extent {
    /// The word.
    fn settings(&self) -> u32;
}

impl Specialises for ReuseParams {
    fn settings(&self) -> u32 {
        (self.flags | Flags::OF_PASSES).bits()
    }
}

/// The parameters of a pass over records.
pub trait PassParams: Specialises + DerefMut<Target = ReuseParams> + Debug + Send + Sync {}

impl<P: Specialises + DerefMut<Target = ReuseParams> + Debug + Send + Sync> PassParams for P {}

/// A record that pixels reuse, as it lies in a plane. What is not written for it is as of records that are merged in mutual pairs, of which there
/// is no more to tell than what they hold.
pub trait Reused: Pod + PartialEq + Debug + Send + Sync {
    /// The parameters of the passes that leave it.
    type Params: PassParams;
    /// The record unpacked.
    type Stored: Clone + Debug;
    /// What a genealogy tells of a record beside it.
    type Details: Clone + Debug + Default;
    /// What layers tell of a pixel beside its record.
    type Beside: Clone + Debug + Default;

    /// All kernels that leave records, or what these read. The first one leaves initial records.
    const KERNELS: &'static [Kernel];
    /// What the initial pass is called.
    const INITIAL: &'static str = "initial candidates";
    /// What another pixel is called: in the same frame, and in the last one.
    const OTHER: [&'static str; 2] = ["the pixel"; 2];
    /// The field of the records of a genealogy.
    const RECORDS: &'static str;
    /// Bytes a pixel that layers, their channels and these encoded take.
    const LAYER_BYTES: u64 = 64;
    /// Whether what layers tell beside records follows from earlier frames. Else it is found of the last frame alone.
    const LOOKS_BACK: bool = true;

    /// The record unpacked.
    fn stored(&self) -> Self::Stored;

    /// Whether there is a sample in it, which comes from somewhere.
    fn has_sample(&self) -> bool;

    /// Its confidence.
    fn confidence(&self) -> f32;

    /// What a pass does that leaves records.
    fn reuse(pass: &Followed<Self>) -> Reuse {
        reuse_of(pass)
    }

    /// How a pass that leaves records is replayed.
    ///
    /// # Errors
    /// Those of [`Followed::read`].
    fn replay(pass: &Followed<Self>) -> Result<Replay<'_, Self>, Error>;

    /// What there is to tell of a pixel's record as a pass left it.
    ///
    /// # Errors
    /// Those of [`Followed::read`].
    fn details(lineage: &Lineage<Self>, pass: usize, pixel: u32) -> Result<Self::Details, Error> {
        let _ = (lineage, pass, pixel);
        Ok(Self::Details::default())
    }

    /// What is printed of a record that is this candidate of the pixel.
    fn drawn(candidate: u32) -> String {
        let _ = candidate;
        "traced here".to_owned()
    }

    /// What is printed of a record after its confidence, in whole lines.
    fn words(genealogy: &Genealogy<'_, Self>, generation: &Generation<Self>) -> String {
        format!("{:?}: {}\n", generation.stored(), genealogy.origin(generation.origin))
    }

    /// The fields of a record, beside those that all have.
    fn fields(genealogy: &Genealogy<'_, Self>, generation: &Generation<Self>) -> Value {
        json!({ "record": format!("{:?}", generation.stored()), "from": genealogy.origin(generation.origin) })
    }

    /// What is said of a genealogy before it is said that it was replayed, and its further fields.
    fn summary(genealogy: &Genealogy<'_, Self>) -> (String, Value) {
        let (count, records, age) = (genealogy.generations.len(), Self::RECORDS, genealogy.age());
        let has_sample = genealogy.generations.last().is_some_and(|last| last.record.has_sample());
        let old = if has_sample { format!("the sample is {age} frames old; ") } else { String::new() };
        (format!("{old}{count} {records}"), json!({ "age": age }))
    }

    /// What there is beside the record of each pixel after a pass, from what there was after those before.
    ///
    /// # Errors
    /// Those of [`Followed::read`].
    fn beside(lineage: &Lineage<Self>, pass: usize, before: &Before<Self>) -> Result<Vec<Self::Beside>, Error> {
        let _ = before;
        Ok(vec![Self::Beside::default(); lineage.pass(pass)?.records().len()])
    }

    /// Layers as channels of an EXR file.
    fn channels(layers: &Layers<Self>) -> Vec<Channel>;
}

/// What a pass does whose kernel says no more of it.
pub(crate) fn reuse_of<R: Reused>(pass: &Followed<R>) -> Reuse {
    match (pass.is_initial(), pass.leaves_merged(), pass.crosses()) {
        (true, ..) => Reuse::Initial,
        (_, false, _) => Reuse::Recalled,
        (.., true) => Reuse::Temporal,
        _ => Reuse::Spatial(pass.params.merge),
    }
}
