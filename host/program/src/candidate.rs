//! Techniques to compare, as a command line names them, and the picture that all of them make.

use std::collections::BTreeSet;

use restir::Error;
use restir::advanced::reference::Picture;
use restir::render::Render;
use restir::technique::{self, Integral, Repeats};

use super::{parse::require, reference::PictureArguments, technique::configured};

/// What a technique of frames says to be judged by its last one.
pub const LAST_FRAME: &str = "last";

/// A technique, with the words that it was asked for by.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// As in `path:roulette=on`.
    pub name: String,
    /// One sample or frame of its.
    pub render: Render,
}

/// What is measured: at the centres of pixels, which techniques with reservoirs keep, unless --jitter is given; without --max-depth as a
/// technique has it that knows paths of one length only.
///
/// # Errors
/// As of [`PictureArguments::measured`], and if there is no such technique.
pub fn picture(arguments: &PictureArguments, techniques: &[String]) -> Result<Picture, Error> {
    let mut picture = arguments.measured(false)?;
    for text in techniques.iter().filter(|_| arguments.max_depth.is_none()) {
        let technique = technique::named(text.split(':').next().unwrap_or_default())?;
        if technique.value("max_depth").is_none() {
            picture.integral.max_depth = technique.integral().max_depth;
        }
    }
    Ok(picture)
}

/// A candidate from its name and settings, as in `path:roulette=on`; these may not change what the picture converges to.
///
/// # Errors
/// [`Error::Setting`] if it has no such technique or settings, or makes another picture.
pub fn candidate(text: &str, picture: Picture) -> Result<Candidate, Error> {
    let (name, changes) = text.split_once(':').unwrap_or((text, ""));
    let changes = changes.split(',').filter(|change| !change.is_empty()).map(str::to_owned);
    let (last, changes): (Vec<String>, Vec<String>) = changes.partition(|change| change == LAST_FRAME);
    let Integral { max_depth, jitter, .. } = picture.integral;
    let own = changes.iter().any(|change| change.starts_with("jitter="));
    let technique = configured(name, &changes, Some(max_depth), (!own).then_some(jitter))?;
    let problem = format_args!(
        "the technique {text} has a depth, jitter, filter or multiscatter of its own, so that errors cannot be compared; give --max-depth, \
         --jitter or --no-jitter to all"
    );
    require(technique.integral() == picture.integral, problem)?;
    let problem = format_args!("the technique {name} has no last frame; leave {LAST_FRAME} out");
    require(last.is_empty() || technique.about().repeats == Repeats::Frames, problem)?;
    let render = Render { accumulate: last.is_empty(), ..Render::new(picture.size, technique) };
    Ok(Candidate { name: text.to_owned(), render })
}

/// Refuses names of which one is there twice.
///
/// # Errors
/// [`Error::Setting`] that says so.
pub fn refuse_twice<'a>(what: &str, mut names: impl Iterator<Item = &'a str>) -> Result<(), Error> {
    let mut seen = BTreeSet::new();
    names
        .try_for_each(|name| require(seen.insert(name), format_args!("the {what} {name} is named twice; name it once")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(max_depth: u32, jitter: bool) -> Picture {
        Picture {
            size: [8; 2],
            integral: Integral { max_depth, jitter, filter: technique::PixelFilter::Box, multiscatter: true },
        }
    }

    #[test]
    fn techniques_are_parsed() {
        let parsed = candidate("path:roulette=on,dispatch_samples=4", of(8, false)).unwrap();
        let value = |key| parsed.render.technique.value(key);
        assert_eq!(["roulette", "dispatch_samples"].map(value), ["on", "4"].map(|text| Some(text.to_owned())));
        for (text, word) in [("pth", "path"), ("path:rolette=on", "roulette"), ("path:max_depth=3", "--max-depth")] {
            let message = candidate(text, of(8, false)).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }

    #[test]
    fn techniques_have_no_jitter_of_their_own() {
        for known in technique::all().into_iter().filter(|known| known.value("jitter").is_some()) {
            for jitter in [false, true] {
                let text = |value| format!("{}:jitter={}", known.about().name, if value { "on" } else { "off" });
                let picture = of(known.integral().max_depth, jitter);
                candidate(&text(jitter), picture).unwrap();
                assert!(candidate(&text(!jitter), picture).unwrap_err().to_string().contains("--jitter"));
            }
        }
    }
}
