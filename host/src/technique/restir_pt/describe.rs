//! What a path is to those who ask whose it is: how its passes are replayed, what is printed of it, and its layers.

use crate::technique::reuse::explain::Genealogy;
use crate::technique::reuse::offers::{self, Mutually};
use crate::technique::reuse::{
    Before, Counts, Followed, Generation, Kernel, Layers, Lineage, Offered, Origin, Replay, Reused, mutual,
};
use crate::{Error, image::Channel, replay::TwoFrames};
use restir_kernels::restir_pt::{pt_merge, pt_recall, pt_retrace, pt_shift, pt_trace};
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::resample::mutual::{Shift, Shifted};
use restir_shared::scene::Frames;
use restir_shared::shift::{Path, PathOrigin};
use restir_shared::technique::restir_pt::{self as pt, PackedPath, PtParams, Stored};
use serde_json::{Value, json};
use std::collections::BTreeMap;

impl Reused for PackedPath {
    type Params = PtParams;
    type Stored = Stored;
    /// What was offered to the pixel by way of a shift.
    type Details = Vec<Offered>;
    /// What became of the shifts of others' paths to a pixel in the frame.
    type Beside = Counts;

    const KERNELS: &'static [Kernel] = &[
        Kernel { desc: &pt_trace::DESC, records: Some("reservoirs"), others: &["origins"] },
        Kernel { desc: &pt_recall::DESC, records: Some("reservoirs"), others: &[] },
        Kernel { desc: &pt_retrace::DESC, records: Some("retraced"), others: &[] },
        Kernel { desc: &reuse_reproject::DESC, records: None, others: &["requests"] },
        Kernel { desc: &reuse_pair::DESC, records: None, others: &["requests"] },
        Kernel { desc: &pt_shift::DESC, records: None, others: &["results"] },
        Kernel { desc: &pt_merge::DESC, records: Some("merged"), others: &[] },
    ];
    const INITIAL: &'static str = "initial path";
    const RECORDS: &'static str = "paths";
    const LAYER_BYTES: u64 = 352;
    const LOOKS_BACK: bool = false;

    fn stored(&self) -> Stored {
        self.unpack()
    }

    fn has_sample(&self) -> bool {
        self.unpack().path.length > 0
    }

    fn confidence(&self) -> f32 {
        self.unpack().confidence
    }

    fn replay(pass: &Followed<Self>) -> Result<Replay<'_, Self>, Error> {
        let (p, frames) = (&pass.params, &*pass.frames);
        if pass.is_initial() {
            let trace = move |pixel| pt::trace(&frames.scene(false), p, pass.position(pixel)).path;
            return Ok(Box::new(move |pixel| (trace(pixel), Origin::Candidate(0))));
        }
        if pass.leaves_merged() {
            return mutual::replay(pass);
        }
        let (paths, made_by) = (pass.read::<Self>("reservoirs")?, pass.maker("reservoirs")?);
        let is_recall = pass.is(&pt_recall::DESC);
        Ok(Box::new(move |pixel| {
            let path = paths[pixel as usize];
            let path = if is_recall { pt::recall(&frames, p, path) } else { pt::retrace(&frames, p, path) };
            (path, Origin::Record { made_by, pixel, is_other: false, of_last_frame: true })
        }))
    }

    fn details(lineage: &Lineage<Self>, pass: usize, pixel: u32) -> Result<Vec<Offered>, Error> {
        offers::offers(lineage, pass, pixel)
    }

    fn words(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> String {
        let Stored { path, contribution_weight, value, .. } = g.stored();
        let mut text = if g.record.has_sample() {
            let origin = genealogy.origin(g.origin);
            format!("W {contribution_weight:e}, {}\n   value {value}, {origin}\n", ending(&path))
        } else {
            "it has no path\n".to_owned()
        };
        text += &offers::words(genealogy, &g.details, ["a path", "no path"]);
        text
    }

    fn fields(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> Value {
        let Stored { path, contribution_weight, value, .. } = g.stored();
        json!({
            "path": g.record.has_sample().then(|| json!({
                "contribution_weight": contribution_weight,
                "value": value.to_array(),
                "length": path.length,
                "k": path.reconnection,
                "light_sampled": path.light_sampled,
                "traced_by": [path.key.x & 0xffff, path.key.x >> 16],
                "traced_in": path.key.y,
                "from": match g.origin {
                    Origin::Candidate(_) => json!("traced"),
                    Origin::Record { is_other: false, .. } => json!("own"),
                    Origin::Record { pixel, .. } => json!({ "pixel": genealogy.position(pixel) }),
                },
            })),
            "offers": offers::fields(genealogy, &g.details),
        })
    }

    fn summary(genealogy: &Genealogy<'_, Self>) -> (String, Value) {
        (format!("{} passes", genealogy.generations.len()), json!({}))
    }

    fn beside(lineage: &Lineage<Self>, pass: usize, before: &Before<Self>) -> Result<Vec<Counts>, Error> {
        offers::counts(lineage, pass, before)
    }

    /// Named after the layer `path`: confidence `M`, contribution weight `W`, the `length` in segments, the index `k` of the vertex from which on
    /// it is kept (0 if it is replayed), and who traced it: the pixel `x`, `y`, and `age` frames ago. Without a path these are -1. The layer
    /// `shift` has how many shifts of others' paths to the pixel were `done` in the frame, and how many failed by which cause.
    fn channels(layers: &Layers<Self>) -> Vec<Channel> {
        let of_path = |name, value: &dyn Fn(&Path) -> u32| {
            layers.channel(name, |stored| if stored.path.length == 0 { -1.0 } else { value(&stored.path) as f32 })
        };
        let paths = [
            layers.channel("path.M", |stored| stored.confidence),
            layers.channel("path.W", |stored| stored.contribution_weight),
            of_path("path.length", &|path| path.length),
            of_path("path.k", &|path| path.reconnection),
            of_path("path.x", &|path| path.key.x & 0xffff),
            of_path("path.y", &|path| path.key.x >> 16),
            of_path("path.age", &|path| layers.frame.wrapping_sub(path.key.y)),
        ];
        let shifts = offers::channels(&layers.beside);
        paths.into_iter().chain(shifts).collect()
    }
}

impl Layers<PackedPath> {
    /// The share of the paths that another pixel has as well: whose errors neighbours have in common. 0 if there are no paths.
    pub fn copied(&self) -> f64 {
        let mut holders: BTreeMap<[u32; 4], u32> = BTreeMap::new();
        for path in self.records.iter().map(|stored| &stored.path).filter(|path| path.length > 0) {
            let who = [path.key.x, path.key.y, path.length, u32::from(path.light_sampled)];
            *holders.entry(who).or_default() += 1;
        }
        let of = |least: u32| -> u32 { holders.values().filter(|&&count| count >= least).sum() };
        f64::from(of(2)) / f64::from(of(1).max(1))
    }
}

impl Mutually for PackedPath {
    type Origin = PathOrigin;

    fn shifted_to(&self, frames: &TwoFrames, params: &PtParams, origin: &PathOrigin) -> Shifted {
        self.shifted(&frames, params, origin)
    }
}

/// How long a path is, what it ends at and where it is joined.
fn ending(path: &Path) -> String {
    let light = if path.light_sampled { "a light that was sampled" } else { "light that scattering found" };
    let joined = match path.reconnection {
        0 => "replayed as a whole".to_owned(),
        k => format!("kept from vertex {k} on"),
    };
    format!("{} segments to {light}, {joined}", path.length)
}
