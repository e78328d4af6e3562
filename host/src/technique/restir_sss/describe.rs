//! What a sample under the surface is to those who ask whose it is: how its passes are replayed, what is printed of it, and its layers.

use crate::technique::reuse::explain::Genealogy;
use crate::technique::reuse::{Followed, Generation, Kernel, Layers, Origin, Replay, Reused, mutual};
use crate::{Error, image::Channel};
use restir_kernels::path::path_entry;
use restir_kernels::restir_sss::{sss_initial, sss_merge, sss_recall, sss_shift};
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::scene::Frames;
use restir_shared::technique::path::hybrid::PackedEntry;
use restir_shared::technique::restir_sss::{self as sss, Kind, PackedSubsurface, SssParams, Stored};
use serde_json::{Value, json};

impl Reused for PackedSubsurface {
    type Params = SssParams;
    type Stored = Stored;
    type Details = ();
    type Beside = ();

    const KERNELS: &'static [Kernel] = &[
        Kernel { desc: &sss_initial::DESC, records: Some("reservoirs"), others: &["origins"] },
        Kernel { desc: &path_entry::DESC, records: None, others: &["entries"] },
        Kernel { desc: &sss_recall::DESC, records: Some("reservoirs"), others: &[] },
        Kernel { desc: &reuse_reproject::DESC, records: None, others: &["requests"] },
        Kernel { desc: &reuse_pair::DESC, records: None, others: &["requests"] },
        Kernel { desc: &sss_shift::DESC, records: None, others: &["results"] },
        Kernel { desc: &sss_merge::DESC, records: Some("merged"), others: &[] },
    ];
    const RECORDS: &'static str = "samples";
    const LAYER_BYTES: u64 = 192;

    fn stored(&self) -> Stored {
        self.unpack()
    }

    fn has_sample(&self) -> bool {
        self.contribution_weight() > 0.0
    }

    fn confidence(&self) -> f32 {
        self.confidence()
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
        Ok(Box::new(move |pixel| {
            let record = sss::recall(&frames, samples[pixel as usize]);
            (record, Origin::Record { made_by, pixel, is_other: false, of_last_frame: true })
        }))
    }

    fn words(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> String {
        if !g.record.has_sample() {
            return "it has no sample\n".to_owned();
        }
        let Stored { sample, contribution_weight, value, .. } = g.stored();
        let (light, point, origin) = (sample.light.light, point(sample.kind), genealogy.origin(g.origin));
        format!("W {contribution_weight:e}, {point}, light {light}\n   value {value}, {origin}\n")
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
        })
    }

    /// Named after the layer `sss`: confidence `M`, contribution weight `W`, and of samples their `kind` (0 stays where it is, 1 is replayed, 2 lies at the
    /// entry), the `light` and the `crossing` of its segment; -1 without a sample.
    fn channels(layers: &Layers<Self>) -> Vec<Channel> {
        let of_sample = |name, value: &dyn Fn(&sss::Sample) -> u32| {
            layers.channel(name, |stored| {
                if stored.contribution_weight > 0.0 { value(&stored.sample) as f32 } else { -1.0 }
            })
        };
        vec![
            layers.channel("sss.M", |stored| stored.confidence),
            layers.channel("sss.W", |stored| stored.contribution_weight),
            of_sample("sss.kind", &|sample| sample.kind as u32),
            of_sample("sss.light", &|sample| sample.light.light),
            of_sample("sss.crossing", &|sample| sample.crossing),
        ]
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
