//! The report of a device.

use super::bench::Bench;
use super::rows::{Row, table};
use super::subjects::goals;
use super::{Extent, Found, Part};
use crate::{Error, report};

/// Prints the report, and puts it beside those of other devices where asked.
pub(super) fn publish(
    bench: &Bench,
    command: &str,
    words: &str,
    found: &[(Part, Found)],
    is_wanted: bool,
) -> Result<(), Error> {
    let head = head(bench, command, words);
    let text = head + &text(bench.extent, found);
    report::publish(&format!("bench-gpu/{}", slug(&bench.adapter())), &text, is_wanted)
}

/// A name as files have it: letters and digits, with dashes between.
fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect::<Vec<_>>().join("-")
}

/// What all tables have in common.
fn head(bench: &Bench, command: &str, words: &str) -> String {
    let (device, [width, height]) = (bench.description(), bench.size());
    let clock = if bench.device().has_clock() {
        "Times are by the device's clock, from the beginning of a frame to that of the next one, or of samples from the first to the last"
    } else {
        "Times are by the host's clock, of frames or samples that follow each other"
    };
    let minutes = if bench.extent == Extent::Quick { 1 } else { 8 };
    format!(
        "# {device}\n\n`{command}` ({minutes} min) makes this report; above each table stands what makes it alone. {words} Images have {width} x {height} \
         pixels unless it says otherwise. {clock}, with many passes in flight; pipelines were made and frames rendered before. Figures are medians.\n"
    )
}

/// The tables.
fn text(extent: Extent, found: &[(Part, Found)]) -> String {
    let command =
        format!("cargo xtask device{}", extent.option().map_or_else(String::new, |option| format!(" {option}")));
    let sections = found.iter().map(|(part, found)| section(*part, &command, found));
    let rows: Vec<Row> = found.iter().flat_map(|(_, found)| found.rows.clone()).collect();
    // it is asked of images of this size
    let goals = if extent == Extent::Full { goals(&rows) } else { Vec::new() };
    let asked = if goals.is_empty() {
        String::new()
    } else {
        format!(
            "\n## What is asked of an H100\n\n| figure | asked | here | met |\n|---|---:|---:|---|\n{}",
            goals.concat()
        )
    };
    sections.collect::<String>() + &asked
}

/// Frames come with their passes.
fn section(part: Part, command: &str, Found { rows, table: more, notes }: &Found) -> String {
    let of = |part| table(&rows.iter().filter(|row| row.part == part).cloned().collect::<Vec<_>>());
    let mut text = headed(part, command, &[&[of(part), more.clone()], notes.as_slice()].concat());
    let passes = of(Part::Passes);
    if !passes.is_empty() {
        text += &headed(Part::Passes, command, &[passes]);
    }
    text
}

/// Blocks below a heading, those that are there.
fn headed(part: Part, command: &str, blocks: &[String]) -> String {
    let (title, name, what) = (part.title(), part.option(), part.explanation());
    let head = format!("\n## {title}\n\n`{command} --only {name}` (2 min): {what}\n");
    let blocks = blocks.iter().filter(|block| !block.is_empty());
    head + &blocks.map(|block| format!("\n{}\n", block.trim_end())).collect::<String>()
}

impl Part {
    /// As options have it.
    pub(super) fn option(self) -> String {
        clap::ValueEnum::to_possible_value(&self).map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What the columns are.
    fn explanation(self) -> &'static str {
        match self {
            Self::Frames => {
                "Milliseconds are of a frame, of path tracing of a sample. Rays are those for the nearest hit and shadow rays, counted natively in a small image. \
                 Views stand still, so that what they see is traced once. Buffers are all that the plan of a frame has, the scene among them."
            }
            Self::Passes => "Milliseconds of a frame, or of a sample, that all passes of a kernel take together.",
            Self::Traversal => {
                "The kernel `ray_check` traces one ray a pixel and does nothing else: from the camera, from what the camera sees about its normal, and from there to \
                 points on lights, where any hit will do. Pixels without a ray do not count. All hits of exact kernels are the host's."
            }
            Self::Subsurface => {
                "All methods have the time of the same number of samples of the walk; errors are against a reference by the walk, in a small image. Paths have up to three \
                 segments."
            }
            Self::First => {
                "What a program takes that begins by opening the device, compares it with the host by what it renders, and renders, until its first picture is in memory. \
                 Caches of drivers are off, where a variable turns them off."
            }
            Self::Registers => "Exact kernels in a scene as `cornell`. A dash is what the driver does not tell.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_called_as_adapters_are() {
        assert_eq!(slug("NVIDIA H100 80GB HBM3"), "nvidia-h100-80gb-hbm3");
        assert_eq!(slug("llvmpipe (LLVM 19.1.7, 256 bits)"), "llvmpipe-llvm-19-1-7-256-bits");
    }

    #[test]
    fn a_report_has_what_was_found() {
        let row = |part| Row::new(part, "rays: hall", "fast, ms", 1600.0);
        let found = || {
            let frames = Found { rows: vec![row(Part::Frames), row(Part::Passes)], ..Found::default() };
            let first = Found { notes: vec!["Left out: all.".to_owned()], ..Found::default() };
            [(Part::Frames, frames), (Part::First, first)]
        };
        let of = |extent| text(extent, &found());
        let full = of(Extent::Full);
        let parts = ["## Techniques\n", "## Passes\n", "--only first", "\n\nLeft out: all.\n"];
        for part in parts {
            assert!(full.contains(part), "{part} is not in:\n{full}");
        }
        assert_eq!(full.matches("\n| rays: hall | 1600 |\n").count(), 2);
        assert!(!full.contains("H100") && of(Extent::Quick).contains("device --quick --only frames"));
    }
}
