//! What a path is to those who ask whose it is: how its passes are replayed, what is printed of it, and its layers.

use crate::technique::reuse::explain::Genealogy;
use crate::technique::reuse::{Before, Followed, Generation, Kernel, Layers, Lineage, Origin, Replay, Reused, mutual};
use crate::{Error, image::Channel};
use rayon::prelude::*;
use restir_kernels::restir_pt::{pt_merge, pt_recall, pt_retrace, pt_shift, pt_trace};
use restir_kernels::reuse::{reuse_pair, reuse_reproject};
use restir_shared::resample::mutual::ShiftRequest;
use restir_shared::scene::Frames;
use restir_shared::shift::{Cause, Path, PathOrigin, Shifted};
use restir_shared::technique::restir_pt::{self as pt, PackedPath, PtParams, Stored};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;

/// How many shifts ended by each of [`Cause::ALL`], of which the first means that there is a path.
type Counts = [u32; Cause::ALL.len()];

/// The channels of these counts.
const SHIFTS: [&str; Cause::ALL.len()] =
    ["shift.done", "shift.unshiftable", "shift.joins", "shift.replay", "shift.dark", "shift.blocked", "shift.broken"];

/// A path that another pixel, or the last frame, has offered to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offered {
    /// Index of the pixel whose path it is.
    pub pixel: u32,
    /// Why it cannot be shifted, if it cannot.
    pub cause: Cause,
    /// The Jacobian of the shift; 0 if there is none.
    pub jacobian: f32,
}

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
        let pass = lineage.pass(pass)?;
        let (requests, offered) = shifts(lineage, pass)?;
        Ok((pixel as usize..requests).step_by(pass.records().len()).filter_map(offered).collect())
    }

    fn words(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> String {
        let Stored { path, contribution_weight, value, .. } = g.stored();
        let mut text = if g.record.has_sample() {
            let origin = genealogy.origin(g.origin);
            format!("W {contribution_weight:e}, {}\n   value {value}, {origin}\n", ending(&path))
        } else {
            "it has no path\n".to_owned()
        };
        for Offered { pixel, cause, jacobian } in &g.details {
            let [x, y] = genealogy.position(*pixel);
            let _ = match cause {
                Cause::Nothing => writeln!(text, "   from ({x}, {y}): a path, Jacobian {jacobian:e}"),
                _ => writeln!(text, "   from ({x}, {y}): no path, {}", why(*cause)),
            };
        }
        text
    }

    fn fields(genealogy: &Genealogy<'_, Self>, g: &Generation<Self>) -> Value {
        let Stored { path, contribution_weight, value, .. } = g.stored();
        let offer = |offer: &Offered| {
            let why = (offer.cause != Cause::Nothing).then(|| why(offer.cause));
            json!({ "pixel": genealogy.position(offer.pixel), "jacobian": offer.jacobian, "fails": why })
        };
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
            "offers": g.details.iter().map(offer).collect::<Vec<_>>(),
        })
    }

    fn summary(genealogy: &Genealogy<'_, Self>) -> (String, Value) {
        (format!("{} passes", genealogy.generations.len()), json!({}))
    }

    fn beside(lineage: &Lineage<Self>, pass: usize, before: &Before<Self>) -> Result<Vec<Counts>, Error> {
        let pass = lineage.pass(pass)?;
        let pixels = pass.records().len();
        let (requests, offered) = shifts(lineage, pass)?;
        // those of the pixels' own paths went before, in the same frame
        let own = if pass.leaves_merged() { before.get(&pass.maker(mutual::role_of_own(pass))?) } else { None };
        let of_pixel = |pixel: usize| {
            let mut counts = own.map_or([0; Cause::ALL.len()], |own| own[pixel]);
            (pixel..requests).step_by(pixels).filter_map(&offered).for_each(|offer| counts[offer.cause as usize] += 1);
            counts
        };
        Ok((0..pixels).into_par_iter().map(of_pixel).collect())
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
        let shifts = SHIFTS.into_iter().enumerate().map(|(cause, name)| Channel {
            name,
            values: layers.beside.iter().map(|counts| counts[cause] as f32).collect(),
        });
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

/// Answers a request once more, which is an element of a grid.
type Shifts<'a> = Box<dyn Fn(usize) -> Option<Offered> + Sync + 'a>;

/// The requests whose results a pass merges: how many elements their grid has, and what becomes of each.
fn shifts<'a>(lineage: &'a Lineage<PackedPath>, pass: &Followed<PackedPath>) -> Result<(usize, Shifts<'a>), Error> {
    if !mutual::is_of_shifts(pass) {
        return Ok((0, Box::new(|_| None)));
    }
    let shift = lineage.pass(pass.maker("results")?)?;
    let (requests, origins) = (shift.read::<ShiftRequest>("requests")?, shift.read::<PathOrigin>("origins")?);
    let (paths, p, frames) = (shift.read::<PackedPath>("reservoirs")?, &shift.params, &*shift.frames);
    let offered = move |at: usize| {
        let request = Some(requests[at]).filter(ShiftRequest::exists)?;
        let path = paths[request.sample as usize];
        let Shifted { term, cause, .. } = path.shifted(&frames, p, &origins[request.pixel as usize]);
        let jacobian = if cause == Cause::Nothing { term / path.term() } else { 0.0 };
        Some(Offered { pixel: request.sample, cause, jacobian })
    };
    Ok((requests.len(), Box::new(offered)))
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

/// Why a shift gives no path.
fn why(cause: Cause) -> &'static str {
    match cause {
        Cause::Nothing => "it gives one",
        Cause::Unshiftable => "there is none, or none that can be shifted",
        Cause::Joins => "it would have to be joined at another vertex",
        Cause::Replay => "replay ends too early",
        Cause::Dark => "what is to be joined sends nothing this way",
        Cause::Blocked => "something lies between",
        Cause::Broken => "a number is out of range",
    }
}
