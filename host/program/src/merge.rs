//! `restir merge`

use std::path::PathBuf;

use restir::Error;
use restir::advanced::memory;
use restir::advanced::output;
use restir::advanced::part::{Merged, Noise, PartFile, Unit, merge, noise};

use super::parse::{number, require};
use super::render::Outputs;
use super::{console, metadata, progress::patiently, scene::refuse_overwriting};

/// More ranges are not listed: they become longer instead.
const MOST_RANGES: u32 = 1000;

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The parts, in any order: files of `restir render --samples`, --chains, --tile, or --frames A..B --accumulate.
    #[arg(required = true)]
    parts: Vec<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
    /// Estimate the noise, the RMS error relative to the mean of the image, by how far the parts differ; if it is more than this,
    /// as in 0.01, list the ranges of samples or chains that are still wanted, one a line.
    #[arg(long, value_name = "ERROR", value_parser = number::<f64>, allow_hyphen_values = true)]
    more_until_noise: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    let Arguments { parts, outputs, more_until_noise } = arguments;
    let goal = more_until_noise.unwrap_or(1.0);
    let problem = format_args!("--more-until-noise {goal} is out of range; give a positive number, as in 0.01 for 1 %");
    require(goal > 0.0 && goal.is_finite(), problem)?;
    let written = outputs.of_merged()?;
    refuse_overwriting(parts.iter().map(PathBuf::as_path), &written)?;
    let parts: Vec<PartFile> =
        patiently("checking the parts", || parts.iter().map(|part| PartFile::open(part)).collect::<Result<_, _>>())?;
    let [width, height] = parts[0].header().size;
    // the image, its encoded form, and sums of blocks that wait for others
    let bytes = 8 * 16 * u64::from(width) * u64::from(height);
    memory::check(bytes, "this image", "merge parts of a smaller one")?;
    let noise = more_until_noise.map(|_| patiently("estimating the noise", || noise(&parts))).transpose()?;
    let merged = patiently("merging the parts", || merge(&parts))?;
    let pairs = metadata::of_merged(&parts, &merged, noise.as_ref());
    let making = output::making();
    patiently("writing the files", || outputs.write(&merged.image, &[], &pairs))?;
    drop(making);
    warn(&merged);
    let files: String = written.iter().map(|path| format!("wrote {}\n", path.display())).collect();
    let (Merged { unit, count, .. }, parts_count) = (&merged, parts.len());
    let parts_count = if parts_count == 1 { "a part".to_owned() } else { format!("{parts_count} parts") };
    let done = format!("merged {parts_count} to {width} x {height} pixels with {count} {}\n", unit.name());
    let more = noise.map_or_else(String::new, |noise| more(&parts, &noise, goal, merged.unit));
    console::print(&(done + &files + &more))
}

/// Says what may be wrong with the image.
fn warn(merged: &Merged) {
    if merged.dropped_samples > 0 {
        console::note(&format!(
            "warning: {} samples were dropped: not finite, or cut short by a device",
            merged.dropped_samples
        ));
    }
    for (name, count) in merged.counts.iter().filter(|(_, count)| *count > 0) {
        console::note(&format!("{}: {count}", name.replace('_', " ")));
    }
}

/// How noisy the image is, and which ranges are still wanted, as long as the longest that there is.
fn more(parts: &[PartFile], noise: &Noise, goal: f64, unit: Unit) -> String {
    let Noise { relative, count } = *noise;
    let longest = parts.iter().map(|part| part.header().range.len() as u32).max().unwrap_or(1);
    let said = format!("noise {relative:.6} with {count} {}\n", unit.name());
    if relative <= goal {
        return said;
    }
    let Some(wanted) = noise.wanted(goal, longest) else {
        console::note(&format!(
            "warning: no number of {} brings the noise down to {goal}; give a larger one",
            unit.name()
        ));
        return said;
    };
    let length = longest.saturating_mul((wanted - count).div_ceil(longest).div_ceil(MOST_RANGES));
    let starts = (count..wanted).step_by(length as usize);
    let ranges =
        starts.map(|from| format!("--{} {from}..{}\n", unit.name(), from.saturating_add(length).min(wanted) - 1));
    said + &ranges.collect::<String>()
}
