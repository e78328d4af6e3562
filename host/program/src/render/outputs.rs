//! The files of a render.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use restir::Error;
use restir::advanced::aov::Aov;
use restir::advanced::output;
use restir::advanced::settings::Choice as _;
use restir::advanced::settings::Value;
use restir::advanced::tonemap::{Operator, Tone};
use restir::image::{Channel, Image, write_exr_with, write_png};

use super::super::parse::{ends_in, number, require};

/// Stops either way: more would leave the range of floats.
const MAX_EXPOSURE: f64 = 64.0;

/// What to write.
#[derive(Clone, clap::Args)]
pub(in super::super) struct Outputs {
    /// The EXR file to write. For several frames put #### in the name, where the frame's number goes.
    #[arg(short, long)]
    pub(super) output: PathBuf,
    /// Also write an 8-bit PNG file. For several frames put #### in its name, too.
    #[arg(long)]
    png: Option<PathBuf>,
    /// Brighten the PNG by this many stops; each doubles it. The EXR file keeps the radiance.
    #[arg(long, value_name = "STOPS", value_parser = number::<f64>, allow_hyphen_values = true)]
    exposure: Option<f64>,
    /// How the PNG shows values brighter than white: clamp, reinhard, aces, or neutral (Khronos' PBR Neutral); clamp if
    /// not given.
    #[arg(long, value_name = "OPERATOR", value_parser = value::<Operator>)]
    tonemap: Option<Operator>,
    /// Add channels to the EXR file that describe what the camera sees, by the names that Blender has for them: albedo,
    /// normal, depth, position, motion (in pixels, from the frame before and to the next one), id (of the object),
    /// scattering (the colour that scatters inside of things). Separate several by commas.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', value_parser = value::<Aov>)]
    pub(super) aov: Vec<Aov>,
}

/// A value by its name.
fn value<T: Value>(text: &str) -> Result<T, String> {
    T::read(text).ok_or_else(|| format!("it has to be one of {}", T::expected()))
}

impl Outputs {
    /// Those of a frame: the last #### of each name becomes its number, of at least as many digits.
    pub(super) fn of_frame(&self, frame: u32) -> Result<Self, Error> {
        let png = self.png.as_ref().map(|png| numbered(png, frame)).transpose()?;
        Ok(Self { output: numbered(&self.output, frame)?, png, ..self.clone() })
    }

    /// The files of several frames that can be judged before anything is rendered: those that are there, and those of the first and the
    /// last frame, which stand for the others. All can be written.
    pub(super) fn of_each(&self, frames: &RangeInclusive<u32>) -> Result<Vec<PathBuf>, Error> {
        let mut files = Vec::new();
        for frame in frames.clone() {
            let of_frame = self.of_frame(frame)?;
            let is_there = of_frame.files().any(|file| file.symlink_metadata().is_ok());
            if is_there || frame == *frames.start() || frame == *frames.end() {
                of_frame.check()?;
                files.extend(of_frame.files().cloned());
            }
        }
        Ok(files)
    }

    /// The files of an image that is merged of parts. They can be written.
    pub(in super::super) fn of_merged(&self) -> Result<Vec<PathBuf>, Error> {
        let problem = "--aov is for restir render, which sees the scene; leave it out, and render the layers by --spp 1 to another file";
        require(self.aov.is_empty(), format_args!("{problem}"))?;
        self.of_one()
    }

    /// The files of parts: of one image, or of each of some frames. They can be written.
    pub(super) fn of_parts(&self, frames: Option<&RangeInclusive<u32>>) -> Result<Vec<PathBuf>, Error> {
        let of_images = [
            ("--png", self.png.is_some()),
            ("--exposure", self.exposure.is_some()),
            ("--tonemap", self.tonemap.is_some()),
            ("--aov", !self.aov.is_empty()),
        ];
        let given = of_images.iter().find(|(_, given)| *given).map_or("", |(option, _)| option);
        require(given.is_empty(), format_args!("{given} is for whole images; leave it out of a part"))?;
        let part = self.output.display();
        let problem = format_args!(
            "a part of an image cannot be shown; give -o FILE.part instead of {part}, and `restir merge` makes the image"
        );
        require(ends_in(&self.output, "part"), problem)?;
        let Some(frames) = frames else {
            output::check_writable(&self.output)?;
            return Ok(vec![self.output.clone()]);
        };
        let files: Vec<PathBuf> =
            frames.clone().map(|frame| Ok(self.of_frame(frame)?.output)).collect::<Result<_, Error>>()?;
        files.first().map_or(Ok(()), |file| output::check_writable(file))?;
        Ok(files)
    }

    /// The files of one image, whose names have no place for a number. They can be written.
    pub(super) fn of_one(&self) -> Result<Vec<PathBuf>, Error> {
        let place = self.files().find(|file| file.to_string_lossy().contains("####"));
        let name = place.map(|file| file.display().to_string()).unwrap_or_default();
        let problem =
            format_args!("{name} has a place for the number of a frame, and there is one image; give --frames A..B");
        require(place.is_none(), problem)?;
        self.check()?;
        Ok(self.files().cloned().collect())
    }

    /// Before hours of rendering: can the results be written? Their endings differ, so that they are never the same file.
    fn check(&self) -> Result<(), Error> {
        let Self { output: exr, aov, .. } = self;
        let exposure = self.exposure.unwrap_or(0.0);
        let problem =
            format_args!("--exposure {exposure} is out of range; give -{MAX_EXPOSURE} to {MAX_EXPOSURE} stops");
        require(exposure.abs() <= MAX_EXPOSURE, problem)?;
        let twice = aov.iter().enumerate().find(|(i, layer)| aov[..*i].contains(layer));
        let name = twice.map_or("", |(_, layer)| layer.name());
        require(twice.is_none(), format_args!("--aov has {name} twice; name each layer once"))?;
        let problem = format_args!(
            "{} would be a part of an image; say which by --samples A..B, --chains A..B or --tile, or give an .exr file",
            exr.display()
        );
        require(!ends_in(exr, "part"), problem)?;
        let problem = format_args!("the output {} has to end in .exr; use --png for a PNG file", exr.display());
        require(ends_in(exr, "exr"), problem)?;
        output::check_writable(exr)?;
        let Some(png) = &self.png else {
            let given = [("--exposure", self.exposure.is_some()), ("--tonemap", self.tonemap.is_some())];
            let option = given.iter().find(|(_, given)| *given).map_or("", |(option, _)| option);
            return require(option.is_empty(), format_args!("{option} is for the PNG file; give --png FILE"));
        };
        require(ends_in(png, "png"), format_args!("--png {} has to end in .png", png.display()))?;
        output::check_writable(png)
    }

    /// The names of the layers, with commas.
    pub(super) fn layer_names(&self) -> String {
        self.aov.iter().map(|layer| layer.name()).collect::<Vec<_>>().join(",")
    }

    /// The files, the EXR file first.
    pub(super) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        [Some(&self.output), self.png.as_ref()].into_iter().flatten()
    }

    /// Writes them. The EXR file comes last: where it is, all are.
    pub(in super::super) fn write(
        &self,
        image: &Image,
        more: &[Channel],
        metadata: &[(String, String)],
    ) -> Result<(), Error> {
        let operator = self.tonemap.unwrap_or(Operator::Clamp);
        let tone = Tone { exposure: self.exposure.unwrap_or(0.0), operator };
        self.png.as_ref().map_or(Ok(()), |path| write_png(path, &tone.of(image)))?;
        write_exr_with(&self.output, image, more, metadata)
    }
}

fn numbered(path: &Path, frame: u32) -> Result<PathBuf, Error> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let place = name.trim_end_matches(|c| c != '#');
    let begin = place.trim_end_matches('#');
    let digits = place.len() - begin.len();
    let problem = format_args!(
        "each frame is a file of its own; put #### into the name {} where its number goes, as in out.####.exr",
        path.display()
    );
    require(digits > 0, problem)?;
    Ok(path.with_file_name(format!("{begin}{frame:0digits$}{}", &name[place.len()..])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_their_number_in_the_name() {
        for (pattern, frame, expected) in [
            ("out.####.exr", 7, "out.0007.exr"),
            ("a#b/##.exr", 123, "a#b/123.exr"),
            ("#1-###.exr", 5, "#1-005.exr"),
            ("ü#.exr", 1, "ü1.exr"),
        ] {
            assert_eq!(numbered(Path::new(pattern), frame).unwrap(), Path::new(expected));
        }
        for pattern in ["out.exr", "####/out.exr", ""] {
            let message = numbered(Path::new(pattern), 1).unwrap_err().to_string();
            assert!(message.contains("out.####.exr"), "{message}");
        }
    }
}
