//! What runs a documented command.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::Error;
use crate::process::{profile, shell};

/// The programs that commands are of. xtask is the one that runs: cargo would compile it again, in another profile.
pub(super) struct Programs {
    restir: PathBuf,
    lab: PathBuf,
    xtask: PathBuf,
}

impl Programs {
    /// Builds those of users.
    pub(super) fn build() -> Result<Self, Error> {
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--profile", &profile(), "--locked", "--quiet", "--bin", "restir", "--bin", "lab"]);
        build.args(["--message-format", "json"]);
        let output =
            build.output().map_err(|error| Error::Environment(format!("cannot run `{}`: {error}", shell(&build))))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let paths = text.lines().filter_map(|line| line.split_once(r#""executable":""#)?.1.split_once('"'));
        let built: Vec<PathBuf> = paths.map(|(path, _)| PathBuf::from(path)).collect();
        let program = |name: &str| {
            let path = built.iter().find(|path| path.file_stem().is_some_and(|stem| stem == name));
            path.cloned().ok_or_else(|| {
                let complaint = String::from_utf8_lossy(&output.stderr);
                Error::Failed(format!("`{}` gave no program {name}: {complaint}", shell(&build)))
            })
        };
        let xtask = std::env::current_exe()
            .map_err(|error| Error::Environment(format!("xtask does not find its own program: {error}")))?;
        Ok(Self { restir: program("restir")?, lab: program("lab")?, xtask })
    }

    /// What runs these words: a program in the folder, or xtask at the workspace's root.
    pub(super) fn command(&self, words: &[String], folder: &Path) -> Command {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let (program, place, arguments) = match &*words {
            ["cargo", "lab", arguments @ ..] => (&*self.lab, folder, arguments),
            ["cargo", "xtask", arguments @ ..] => (&*self.xtask, Path::new("."), arguments),
            [_, arguments @ ..] => (&*self.restir, folder, arguments),
            [] => (&*self.restir, folder, &[][..]),
        };
        let mut command = Command::new(program);
        command.args(arguments).current_dir(place);
        command
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_command_has_its_program() {
        let programs = Programs { restir: "a/restir".into(), lab: "a/lab".into(), xtask: "a/xtask".into() };
        let shown = |line: &str| {
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            let command = programs.command(&words, Path::new("f"));
            (shell(&command), command.get_current_dir().map(Path::to_owned))
        };
        let (folder, root) = (Some(PathBuf::from("f")), Some(PathBuf::from(".")));
        assert_eq!(shown("restir scenes"), ("a/restir scenes".to_owned(), folder.clone()));
        assert_eq!(shown("cargo lab bench x"), ("a/lab bench x".to_owned(), folder));
        assert_eq!(shown("cargo xtask package"), ("a/xtask package".to_owned(), root));
    }
}
