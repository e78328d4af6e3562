//! What a sample under the surface is to those who ask whose it is: how its passes are replayed, what is printed of it, and its layers.

use crate::technique::reuse::explain::Genealogy;
use crate::technique::reuse::offers::{self, Mutually};
use crate::technique::reuse::{
    Before, Counts, Followed, Generation, Kernel, Layers, Lineage, Offered, Origin, Replay, Reuse, Reused, mutual,
    reuse_of,
};
use crate::{Error, image::Channel, replay::TwoFrames};
use restir_kernels::path::path_entry;
use restir_kernels::restir_sss::{sss_index, sss_initial, sss_merge, sss_recall, sss_shift};
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::resample::mutual::{Record, Shift, Shifted};
use restir_shared::scene::Frames;
use restir_shared::technique::path::hybrid::PackedEntry;
use restir_shared::technique::restir_sss::{self as sss, Kind, PackedSubsurface, SssOrigin, SssParams, Stored};
use serde_json::{Value, json};

impl Reused for PackedSubsurface {
    type Params = SssParams;
    type Stored = Stored;
    /// What was offered to the pixel by way of a shift.
    type Details = Vec<Offered>;
    /// What became of the shifts of others' samples to a pixel in the frame.
    type Beside = Counts;

    const KERNELS: &'static [Kernel] = &[
        Kernel { desc: &sss_initial::DESC, records: Some("reservoirs"), others: &["origins"] },
        Kernel { desc: &path_entry::DESC, records: None, others: &["entries"] },
        Kernel { desc: &sss_recall::DESC, records: Some("reservoirs"), others: &[] },
        Kernel { desc: &sss_index::DESC, records: Some("reservoirs"), others: &[] },
        Kernel { desc: &reuse_reproject::DESC, records: None, others: &["requests"] },
        Kernel { desc: &reuse_pair::DESC, records: None, others: &["requests"] },
        Kernel { desc: &sss_shift::DESC, records: None, others: &["results"] },
        Kernel { desc: &sss_merge::DESC, records: Some("merged"), others: &[] },
    ];
    const RECORDS: &'static str = "samples";
    const LAYER_BYTES: u64 = 304;
    const LOOKS_BACK: bool = false;

    fn stored(&self) -> Stored {
        self.unpack()
    }

    fn has_sample(&self) -> bool {
        self.contribution_weight() > 0.0
    }

    fn confidence(&self) -> f32 {
        Record::confidence(self)
    }

    fn reuse(pass: &Followed<Self>) -> Reuse {
        if pass.is(&sss_index::DESC) { Reuse::Readied } else { reuse_of(pass) }
    }

    fn replay(pass: &Followed<Self>) -> Result<Replay<'_, Self>, Error> {
        let (p, frames) = (&pass.params, &*pass.frames);
        if pass.is_initial() {
            let entries = pass.read::<PackedEntry>("entries")?;
            let initial = move |pixel: u32| {
                sss::initial(&frames.scene(false), p, entries[pixel as usize], pass.position(pixel)).reservoir
            };
            return Ok(Box::new(move |pixel| (initial(pixel), Origin::Candidate(0))));
        }
        if pass.leaves_merged() {
            return mutual::replay(pass);
        }
        let (samples, made_by) = (pass.read::<Self>("reservoirs")?, pass.maker("reservoirs")?);
        let of_last_frame = pass.is(&sss_recall::DESC);
        let origins = pass.read_if::<SssOrigin>(!of_last_frame, "origins")?;
        Ok(Box::new(move |pixel| {
            let (at, sample) = (pixel as usize, samples[pixel as usize]);
            let record = match origins.get(at) {
                Some(origin) => sss::index(&frames.scene(false), p, origin, sample, pass.position(pixel)),
                None => sss::recall(&frames, sample),
            };
            (record, Origin::Record { made_by, pixel, is_other: false, of_last_frame })
        }))
    }

    fn details(lineage: &Lineage<Self>, pass: usize, pixel: u32) -> Result<Vec<Offered>, Error> {
        offers::offers(lineage, pass, pixel)
    }

    fn words(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> String {
        let Stored { sample, contribution_weight, value, .. } = g.stored();
        let (light, point, origin) = (sample.light.light, point(sample.kind), genealogy.origin(g.origin));
        let own = if g.record.has_sample() {
            format!("W {contribution_weight:e}, {point}, light {light}\n   value {value}, {origin}\n")
        } else {
            "it has no sample\n".to_owned()
        };
        own + &offers::words(genealogy, &g.details, ["a sample", "no sample"])
    }

    fn fields(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> Value {
        let Stored { sample, contribution_weight, value, .. } = g.stored();
        json!({
            "sample": g.record.has_sample().then(|| json!({
                "contribution_weight": contribution_weight,
                "value": value.to_array(),
                "light": sample.light.light,
                "kind": point(sample.kind),
                "from": genealogy.origin(g.origin),
            })),
            "offers": offers::fields(genealogy, &g.details),
        })
    }

    fn beside(lineage: &Lineage<Self>, pass: usize, before: &Before<Self>) -> Result<Vec<Counts>, Error> {
        offers::counts(lineage, pass, before)
    }

    /// Named after the layer `sss`: confidence `M`, contribution weight `W`, and of samples their `kind` (0 stays where it is, 1 is replayed, 2 lies at the
    /// entry), the `light` and the `crossing` of its segment; -1 without a sample. The layer `shift` has how many shifts of others' samples to the
    /// pixel were `done` in the frame, and how many failed by which cause.
    fn channels(layers: &Layers<Self>) -> Vec<Channel> {
        let of_sample = |name, value: &dyn Fn(&sss::Sample) -> u32| {
            layers.channel(
                name,
                |stored| {
                    if stored.contribution_weight > 0.0 { value(&stored.sample) as f32 } else { -1.0 }
                },
            )
        };
        let samples = [
            layers.channel("sss.M", |stored| stored.confidence),
            layers.channel("sss.W", |stored| stored.contribution_weight),
            of_sample("sss.kind", &|sample| sample.kind as u32),
            of_sample("sss.light", &|sample| sample.light.light),
            of_sample("sss.crossing", &|sample| sample.crossing),
        ];
        samples.into_iter().chain(offers::channels(&layers.beside)).collect()
    }
}

impl Mutually for PackedSubsurface {
    type Origin = SssOrigin;

    fn shifted_to(&self, frames: &TwoFrames, params: &SssParams, origin: &SssOrigin) -> Shifted {
        self.shifted(&frames, params, origin)
    }
}

/// What a shift does with the point.
fn point(kind: Kind) -> &'static str {
    match kind {
        Kind::Kept => "a point that stays",
        Kind::Replayed => "a point that is replayed",
        Kind::AtEntry => "the entry itself",
    }
}
