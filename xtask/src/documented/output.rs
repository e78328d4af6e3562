//! What a documented command writes below docs, and whether the pictures among it are the committed ones.

use std::path::{Path, PathBuf};

/// What a command writes below docs.
#[derive(Debug, PartialEq)]
pub(super) enum Output {
    /// Nothing.
    Nothing,
    /// A picture, named by `--png`, or by the task that draws it: `cargo lab aov` draws docs/aov.png.
    Picture(String),
    /// Files of a folder, named by `--out`, some of which may be pictures.
    Folder(String),
}

impl Output {
    pub(super) fn of(line: &str) -> Self {
        let words: Vec<&str> = line.split(' ').collect();
        let after = |option: &str| {
            let at = words.iter().position(|word| *word == option)?;
            words.get(at + 1).filter(|path| path.starts_with("docs/")).map(|path| (*path).to_owned())
        };
        let drawn = match words.as_slice() {
            ["cargo", "lab", task] => Some(format!("docs/{task}.png")).filter(|path| Path::new(path).exists()),
            _ => None,
        };
        let folder = after("--out").filter(|path| !path.contains('.'));
        after("--png").or(drawn).map(Self::Picture).or(folder.map(Self::Folder)).unwrap_or(Self::Nothing)
    }

    /// Whether it is, or may be, the picture of that name.
    pub(super) fn writes(&self, name: &str) -> bool {
        matches!(self, Self::Picture(path) if path.strip_prefix("docs/") == Some(name))
    }

    /// Where the command is made to write instead: an empty place in the folder.
    pub(super) fn scratch(&self, folder: &Path) -> Result<PathBuf, String> {
        let path = folder.join(if matches!(self, Self::Picture(_)) { "picture.png" } else { "out" });
        let removed = match std::fs::symlink_metadata(&path) {
            Ok(found) if found.is_dir() => std::fs::remove_dir_all(&path),
            Ok(_) => std::fs::remove_file(&path),
            Err(_) => Ok(()),
        };
        removed.map(|()| path).map_err(|error| error.to_string())
    }

    /// The words of the command, which writes to `scratch` in place of what lies below docs.
    pub(super) fn redirected(&self, line: &str, scratch: &Path) -> Vec<String> {
        let scratch = scratch.display().to_string();
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let option = |words: &[String], name: &str| words.iter().position(|word| word == name).map(|at| at + 1);
        match (self, option(&words, "--png"), option(&words, "--out")) {
            (Self::Picture(_), Some(at), _) | (_, _, Some(at)) if at < words.len() => words[at] = scratch,
            (Self::Picture(_), ..) => words.extend(["--out".to_owned(), scratch]),
            _ => (),
        }
        words
    }

    /// Compares pictures in `scratch` with those below docs, or replaces these.
    pub(super) fn judge(&self, scratch: &Path, write: bool) -> Result<(), String> {
        match self {
            Self::Nothing => Ok(()),
            Self::Picture(path) => judge(scratch, Path::new(path), write),
            Self::Folder(path) => {
                let files = std::fs::read_dir(scratch).map_err(|error| error.to_string())?;
                let names = files.flatten().map(|file| file.file_name());
                let pictures = names.filter(|name| Path::new(name).extension().is_some_and(|ending| ending == "png"));
                pictures
                    .map(|name| (scratch.join(&name), Path::new(path).join(&name)))
                    .try_for_each(|(new, old)| judge(&new, &old, write))
            }
        }
    }
}

fn judge(new: &Path, old: &Path, write: bool) -> Result<(), String> {
    if write {
        return std::fs::copy(new, old).map(|_| ()).map_err(|error| error.to_string());
    }
    let is_same = std::fs::read(new).is_ok_and(|new| std::fs::read(old).is_ok_and(|old| old == new));
    if is_same { Ok(()) } else { Err(format!("gives another picture than {}", old.display())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_below_docs_is_written_elsewhere() {
        let redirected = |line: &str| {
            let output = Output::of(line);
            let words = output.redirected(line, Path::new("/s")).join(" ");
            (output, words)
        };
        let (picture, words) = redirected("restir render cornell -o c.exr --png docs/c.png --spp 4");
        assert!(
            picture == Output::Picture("docs/c.png".to_owned()) && picture.writes("c.png") && !picture.writes("d.png")
        );
        assert_eq!(words, "restir render cornell -o c.exr --png /s --spp 4");
        let (figure, words) = redirected("cargo lab figure x --out docs/figures/x --device cpu");
        assert_eq!(figure, Output::Folder("docs/figures/x".to_owned()));
        assert_eq!(words, "cargo lab figure x --out /s --device cpu");
        assert_eq!(redirected("restir render cornell -o c.exr --png c.png").0, Output::Nothing);
        let drawn = Output::Picture("docs/aov.png".to_owned());
        assert_eq!(drawn.redirected("cargo lab aov", Path::new("/s")).join(" "), "cargo lab aov --out /s");
    }

    #[test]
    fn another_picture_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let [new, old] = ["new", "old"].map(|name| folder.path().join(name));
        [&new, &old].into_iter().for_each(|path| std::fs::create_dir(path).unwrap());
        std::fs::write(new.join("a.png"), [1]).unwrap();
        let output = Output::Folder(old.display().to_string());
        assert!(output.judge(&new, false).unwrap_err().contains("a.png"), "a picture that is not there");
        std::fs::write(old.join("a.png"), [2]).unwrap();
        assert!(output.judge(&new, false).is_err());
        output.judge(&new, true).unwrap();
        output.judge(&new, false).unwrap();
    }
}
