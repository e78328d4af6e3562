//! `restir compare`

use std::path::{Path, PathBuf};

use restir::Error;
use restir::advanced::memory;
use restir::advanced::metrics::{self, Comparison};
use restir::image::{Image, exr_bytes, read_exr};
use serde_json::json;

use super::ending::Ending;
use super::parse::{ends_in, require};
use super::{console, progress::patiently};

#[derive(clap::Args)]
pub(super) struct Arguments {
    /// The image to judge, EXR.
    image: PathBuf,
    /// The reference, EXR.
    reference: PathBuf,
    /// Print one JSON object; a number that is not finite is null.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Ending> {
    for image in [&arguments.image, &arguments.reference] {
        let problem = format_args!(
            "{} holds what was shown of the radiance, cut off and rounded; compare the EXR files, of render's -o",
            image.display()
        );
        require(!ends_in(image, "png"), problem)?;
    }
    let images = [&arguments.image, &arguments.reference];
    let bytes = images.iter().map(|image| exr_bytes(image)).sum::<Result<u64, Error>>()?;
    memory::check(bytes, "reading both images", "compare smaller ones")?;
    let [image, reference] = images.map(|image| patiently("reading the images", || read_exr(image)));
    let (image, reference) = (image?, reference?);
    let comparison = patiently("comparing the images", || metrics::compare(&image, &reference))?;
    let format = if arguments.json { json_text } else { table };
    console::print(&format(&comparison))?;
    let bad = images.into_iter().zip([&image, &reference]).find_map(|(path, image)| not_finite(path, image));
    bad.map_or(Ok(()), |problem| Err(Ending::Failed(problem)))
}

/// Where an image is no picture: its errors are no numbers then.
fn not_finite(path: &Path, image: &Image) -> Option<String> {
    let bad = |(_, pixel): &(usize, &[f32; 3])| !pixel.iter().all(|value| value.is_finite());
    let mut all = image.pixels.iter().enumerate().filter(bad);
    let (first, _) = all.next()?;
    let (x, y, more) = (first % image.width as usize, first / image.width as usize, all.count());
    let path = path.display();
    Some(format!("{path} has {} pixels that are not finite, the first at {x},{y}", more + 1))
}

fn json_text(comparison: &Comparison) -> String {
    // `json!` turns a number that is not finite into null.
    let object = json!({
        "identical": comparison.identical,
        "differing_words": comparison.differing_words,
        "max_ulp": comparison.max_ulp,
        "rmse": comparison.rmse,
        "rel_mse": comparison.rel_mse,
        "rmae": comparison.rmae,
        "rmspe": comparison.rmspe,
        "smape": comparison.smape,
        "mean_ratio": comparison.mean_ratio,
    });
    format!("{object}\n")
}

fn table(comparison: &Comparison) -> String {
    let c = comparison;
    let rows = [
        ("identical", if c.identical { "yes" } else { "no" }.to_owned()),
        ("differing words", c.differing_words.to_string()),
        ("max ulp", c.max_ulp.to_string()),
        ("RMSE", format!("{:.6e}", c.rmse)),
        ("relMSE", format!("{:.6e}  (epsilon 0.001)", c.rel_mse)),
        ("RMAE", format!("{:.6e}  (mean of relative errors, epsilon 0.001 of the mean)", c.rmae)),
        ("RMAE, global", format!("{:.6e}  (mean error / mean of the reference)", c.rmae_global)),
        ("RMSPE", format!("{:.4} %  ({} dark values excluded)", c.rmspe, c.rmspe_excluded)),
        ("SMAPE", format!("{:.4} %  (of 200 %)", c.smape)),
        ("mean ratio", format!("{:.6}", c.mean_ratio)),
    ];
    rows.iter().map(|(name, value)| format!("{name:16} {value}\n")).collect()
}
