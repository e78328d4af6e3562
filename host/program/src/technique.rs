//! The technique that a command works with, and its settings.

use std::ops::RangeInclusive;
use std::path::Path;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser};
use restir::Error;
use restir::advanced::memory;
use restir::buffers::SceneBuffers;
use restir::scene::{Camera, CameraPath};
use restir::technique::{self, Repeats, Technique, configure};

use super::parse::{natural, require};

/// Frames have at most six digits in the names of files.
pub(super) const MAX_FRAME: u32 = 999_999;

#[derive(clap::Args)]
pub(super) struct TechniqueArguments {
    /// How to render.
    #[arg(long = "technique", value_name = "NAME", default_value_t = default_name(), value_parser = names())]
    pub(super) name: String,
    /// A setting of the technique, as KEY=VALUE, or preset=NAME; `restir settings` lists them.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) settings: Vec<String>,
    /// Number of frames (ReSTIR; the technique chooses if not given), of which the last is written. A..B writes frames A to B,
    /// each to its own file.
    #[arg(long, value_name = "COUNT|A..B", allow_hyphen_values = true)]
    pub(super) frames: Option<Frames>,
    /// Move the camera from frame to frame: orbit, pan, or a JSON file of keyframes.
    #[arg(long, value_name = "PATH")]
    pub(super) camera_path: Option<std::path::PathBuf>,
    /// Seed of the random numbers.
    #[arg(long, default_value = "0", value_parser = natural::<u32>, allow_hyphen_values = true)]
    pub(super) seed: u32,
}

/// What --frames asks for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Frames {
    /// So many, from 0 on.
    Count(u32),
    /// Each of these.
    Each(RangeInclusive<u32>),
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((first, last)) = text.split_once("..") else { return natural(text).map(Self::Count) };
        let (first, last) = (natural(first)?, natural(last)?);
        if first > last || last > MAX_FRAME {
            return Err(format!("it has to be A..B with A <= B <= {MAX_FRAME}, as in 0..23 for 24 frames"));
        }
        Ok(Self::Each(first..=last))
    }
}

impl TechniqueArguments {
    /// How many frames were asked for, by a command that shows one of them.
    pub(super) fn frame_count(&self) -> Result<Option<u32>, Error> {
        match &self.frames {
            None => Ok(None),
            Some(Frames::Count(count)) => Ok(Some(*count)),
            Some(Frames::Each(frames)) => {
                let (first, last) = (frames.start(), frames.end());
                let count = last + 1;
                let problem = format!("--frames {first}..{last} is for restir render; give --frames {count}");
                Err(Error::Setting(problem))
            }
        }
    }

    /// The path of the camera in a scene, if it has one.
    pub(super) fn path(&self, scene: &SceneBuffers) -> Result<Option<CameraPath>, Error> {
        path(self.camera_path.as_deref(), scene)
    }
}

/// A path of that name or file, which is in the world, in a scene.
pub(super) fn path(name_or_file: Option<&Path>, scene: &SceneBuffers) -> Result<Option<CameraPath>, Error> {
    name_or_file.map(|path| Ok(CameraPath::open(path)?.moved(-scene.origin()))).transpose()
}

/// The cameras of frames along a path; none without one.
pub(super) fn cameras(path: Option<&CameraPath>, camera: Camera, frames: u32) -> Result<Vec<Camera>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let bytes = u64::from(frames) * size_of::<Camera>() as u64;
    memory::check(bytes, "this camera path", "give fewer --frames")?;
    path.cameras(camera, frames)
}

/// The first of the list.
fn default_name() -> String {
    technique::all().first().map_or_else(String::new, |technique| technique.about().name.to_owned())
}

/// The names of all techniques, with what they do.
pub(super) fn names() -> PossibleValuesParser {
    let abouts = technique::all().into_iter().map(|technique| *technique.about());
    let values = abouts.map(|about| PossibleValue::new(about.name).help(about.summary));
    PossibleValuesParser::new(values.collect::<Vec<_>>())
}

/// Where camera rays go through a pixel.
#[derive(Debug, clap::Args)]
pub(super) struct PixelArguments {
    /// Spread the samples over the area of the pixel, which smooths edges.
    #[arg(long)]
    jitter: bool,
    /// Send all samples through the centre of the pixel.
    #[arg(long, conflicts_with = "jitter")]
    no_jitter: bool,
}

impl PixelArguments {
    /// What was asked for, if anything was.
    pub(super) fn jitter(&self) -> Option<bool> {
        (self.jitter || self.no_jitter).then_some(self.jitter)
    }
}

/// A technique with settings, and with the integral that the options --max-depth, --jitter and --no-jitter ask for.
pub(super) fn configured(
    name: &str,
    settings: &[String],
    max_depth: Option<u32>,
    jitter: Option<bool>,
) -> Result<Box<dyn Technique>, Error> {
    let mut technique = technique::named(name)?;
    for (index, text) in settings.iter().enumerate() {
        require(text.contains('='), format_args!("--set {text} has no value; give --set KEY=VALUE"))?;
        let undone = index > 0 && text.starts_with("preset=");
        let problem = format_args!("--set {text} would undo the settings before it, for it sets all; give it first");
        require(!undone, problem)?;
    }
    configure(technique.as_mut(), settings)?;
    if let Some(depth) = max_depth.filter(|&depth| depth != technique.integral().max_depth) {
        set_by_option(technique.as_mut(), settings, "--max-depth", ["max_depth", &depth.to_string()])?;
    }
    if let Some(jitter) = jitter.filter(|&jitter| jitter != technique.integral().jitter) {
        let [option, value] = if jitter { ["--jitter", "on"] } else { ["--no-jitter", "off"] };
        set_by_option(technique.as_mut(), settings, option, ["jitter", value])?;
    }
    Ok(technique)
}

/// Sets what has an option, unless a setting says something else.
fn set_by_option(
    technique: &mut dyn Technique,
    settings: &[String],
    option: &str,
    [key, value]: [&str; 2],
) -> Result<(), Error> {
    let name = technique.about().name;
    let depth = technique.integral().max_depth;
    let problem = format_args!("{name} has no {key}, and its paths have {depth} segments; leave {option} out");
    require(technique.value(key).is_some(), problem)?;
    for text in settings {
        let contradicts = text.split_once('=').is_some_and(|(set, _)| set == key);
        let problem = format_args!("{option} and --set {text} contradict each other; leave one of them out");
        require(!contradicts, problem)?;
    }
    technique.set(key, value)
}

/// Refuses options that the technique has no use for.
pub(super) fn refuse_unused(technique: &dyn Technique, options: &[(&str, bool, Repeats)]) -> Result<(), Error> {
    let about = technique.about();
    let unused = options.iter().find(|(_, given, repeats)| *given && *repeats != about.repeats);
    unused.map_or(Ok(()), |(option, _, repeats)| {
        let known = technique::all().into_iter().map(|technique| *technique.about());
        let suited: Vec<&str> = known.filter(|known| known.repeats == *repeats).map(|known| known.name).collect();
        let (name, own, suited) = (about.name, about.repeats.name(), suited.join(", "));
        let own_option = if about.repeats == Repeats::Samples { "--spp" } else { "--frames" };
        Err(Error::Setting(format!(
            "{option} is for {suited}; {name} repeats {own} ({own_option}), leave {option} out"
        )))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_parsed() {
        assert_eq!("24".parse(), Ok(Frames::Count(24)));
        assert_eq!("3..7".parse(), Ok(Frames::Each(3..=7)));
        assert_eq!("7..7".parse(), Ok(Frames::Each(7..=7)));
        for text in ["", "..", "1..", "..1", "7..3", "1..=3", "-1..2", "0..1000000", "1...2"] {
            text.parse::<Frames>().unwrap_err();
        }
    }
}
