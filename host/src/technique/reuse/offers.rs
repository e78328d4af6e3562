//! What was offered to pixels by way of shifts between mutual pairs, and what became of it.

use super::explain::Genealogy;
use super::mutual::{is_of_shifts, role_of_own};
use super::{Before, Followed, Lineage, Reused};
use crate::image::Channel;
use crate::{Error, replay::TwoFrames};
use bytemuck::Pod;
use rayon::prelude::*;
use restir_shared::resample::mutual::{Cause, Record, ShiftRequest, Shifted};
use serde_json::{Value, json};
use std::fmt::Write;

/// How many shifts ended by each of [`Cause::ALL`], of which the first means that there is a sample.
pub type Counts = [u32; Cause::ALL.len()];

/// The channels of these counts.
const SHIFTS: [&str; Cause::ALL.len()] =
    ["shift.done", "shift.unshiftable", "shift.joins", "shift.replay", "shift.dark", "shift.blocked", "shift.broken"];

/// A sample that another pixel, or the last frame, has offered to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offered {
    /// Index of the pixel whose sample it is.
    pub pixel: u32,
    /// Why it cannot be shifted, if it cannot.
    pub cause: Cause,
    /// The Jacobian of the shift; 0 if there is none.
    pub jacobian: f32,
}

/// A record that is shifted between mutual pairs.
pub(crate) trait Mutually: Reused<Details = Vec<Offered>, Beside = Counts> + Record {
    /// What it is shifted to.
    type Origin: Pod + Sync;

    /// As [`restir_shared::resample::mutual::Shift::shifted`].
    fn shifted_to(&self, frames: &TwoFrames, params: &Self::Params, origin: &Self::Origin) -> Shifted;
}

/// Answers a request once more, which is an element of a grid.
type Shifts<'a> = Box<dyn Fn(usize) -> Option<Offered> + Sync + 'a>;

/// The requests whose results a pass merges: how many elements their grid has, and what becomes of each.
fn shifts<'a, R: Mutually>(lineage: &'a Lineage<R>, pass: &Followed<R>) -> Result<(usize, Shifts<'a>), Error> {
    if !is_of_shifts(pass) {
        return Ok((0, Box::new(|_| None)));
    }
    let shift = lineage.pass(pass.maker("results")?)?;
    let (requests, origins) = (shift.read::<ShiftRequest>("requests")?, shift.read::<R::Origin>("origins")?);
    let (records, p, frames) = (shift.read::<R>("reservoirs")?, &shift.params, &*shift.frames);
    let offered = move |at: usize| {
        let request = Some(requests[at]).filter(ShiftRequest::exists)?;
        let record = records[request.sample as usize];
        let Shifted { term, cause, .. } = record.shifted_to(frames, p, &origins[request.pixel as usize]);
        let jacobian = if cause == Cause::Nothing { term / record.partial_jacobian() } else { 0.0 };
        Some(Offered { pixel: request.sample, cause, jacobian })
    };
    Ok((requests.len(), Box::new(offered)))
}

/// What a pass was offered at a pixel, as [`Reused::details`].
///
/// # Errors
/// As of [`Followed::read`].
pub(crate) fn offers<R: Mutually>(lineage: &Lineage<R>, pass: usize, pixel: u32) -> Result<Vec<Offered>, Error> {
    let pass = lineage.pass(pass)?;
    let (requests, offered) = shifts(lineage, pass)?;
    Ok((pixel as usize..requests).step_by(pass.records().len()).filter_map(offered).collect())
}

/// What became of the shifts of others' samples to each pixel in the frame, as [`Reused::beside`].
///
/// # Errors
/// As of [`Followed::read`].
pub(crate) fn counts<R: Mutually>(lineage: &Lineage<R>, pass: usize, before: &Before<R>) -> Result<Vec<Counts>, Error> {
    let pass = lineage.pass(pass)?;
    let pixels = pass.records().len();
    let (requests, offered) = shifts(lineage, pass)?;
    // those of the pixels' own records went before, in the same frame
    let own = if pass.leaves_merged() { before.get(&pass.maker(role_of_own(pass))?) } else { None };
    let of_pixel = |pixel: usize| {
        let mut counts = own.map_or([0; Cause::ALL.len()], |own| own[pixel]);
        (pixel..requests).step_by(pixels).filter_map(&offered).for_each(|offer| counts[offer.cause as usize] += 1);
        counts
    };
    Ok((0..pixels).into_par_iter().map(of_pixel).collect())
}

/// These counts as channels of the layer `shift`.
pub(crate) fn channels(counts: &[Counts]) -> impl Iterator<Item = Channel> + '_ {
    SHIFTS
        .into_iter()
        .enumerate()
        .map(|(cause, name)| Channel { name, values: counts.iter().map(|counts| counts[cause] as f32).collect() })
}

/// What was offered, a line each, by what a sample and none is called.
pub(crate) fn words<R: Mutually>(genealogy: &Genealogy<'_, R>, offers: &[Offered], [one, none]: [&str; 2]) -> String {
    let mut text = String::new();
    for Offered { pixel, cause, jacobian } in offers {
        let [x, y] = genealogy.position(*pixel);
        let _ = match cause {
            Cause::Nothing => writeln!(text, "   from ({x}, {y}): {one}, Jacobian {jacobian:e}"),
            _ => writeln!(text, "   from ({x}, {y}): {none}, {}", why(*cause)),
        };
    }
    text
}

/// The same as JSON.
pub(crate) fn fields<R: Mutually>(genealogy: &Genealogy<'_, R>, offers: &[Offered]) -> Vec<Value> {
    let offer = |offer: &Offered| {
        let why = (offer.cause != Cause::Nothing).then(|| why(offer.cause));
        json!({ "pixel": genealogy.position(offer.pixel), "jacobian": offer.jacobian, "fails": why })
    };
    offers.iter().map(offer).collect()
}

/// Why a shift gives no sample.
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
