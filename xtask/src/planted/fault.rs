//! The list of faults.

use std::collections::BTreeSet;

use serde::Deserialize;

use crate::Error;
use crate::shader::workspace::Workspace;

/// The least number of faults that the list has.
const LEAST: usize = 60;

/// A line that is made wrong, and the checks that see it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fault {
    /// For messages and the report.
    pub(super) name: String,
    /// From the repository's root.
    pub(super) file: String,
    /// A part of a line that occurs once in the file.
    pub(super) right: String,
    /// What stands in its place.
    pub(super) wrong: String,
    /// The suite that has to fail: a test binary of `tests/`, or a crate whose unit tests these are.
    pub(super) suite: String,
    /// A part of the names of the checks that are run.
    pub(super) filter: String,
    /// The equation or the rule, and what the fault makes of it.
    pub(super) because: String,
}

#[derive(Deserialize)]
struct List {
    fault: Vec<Fault>,
}

impl Fault {
    /// Whether any of the words is in its name; all faults are meant where there are none.
    pub(super) fn is_meant(&self, words: &[String]) -> bool {
        words.is_empty() || words.iter().any(|word| self.name.contains(word.as_str()))
    }

    /// The file's text with the fault.
    pub(super) fn planted(&self, text: &str) -> Result<String, Error> {
        let Self { name, file, right, wrong, .. } = self;
        let refused =
            |problem: &str| Err(Error::Failed(format!("fault {name}: {problem} in {file}; correct the list")));
        match text.matches(right.as_str()).count() {
            _ if right.contains('\n') || wrong.contains('\n') => refused("it is more than a line"),
            0 => refused("what it replaces is not"),
            1 => Ok(text.replacen(right.as_str(), wrong, 1)),
            _ => refused("what it replaces is more than once"),
        }
    }
}

/// Reads the list, and checks that every fault of it can be planted.
pub(super) fn read(workspace: &Workspace) -> Result<Vec<Fault>, Error> {
    let path = workspace.root().join("xtask/src/planted/faults.toml");
    let text = std::fs::read_to_string(&path).map_err(Error::io("read", &path))?;
    let list: List = toml::from_str(&text).map_err(|error| Error::Failed(format!("{}: {error}", path.display())))?;
    for fault in &list.fault {
        let source = workspace.root().join(&fault.file);
        let text = std::fs::read_to_string(&source).map_err(Error::io("read", &source))?;
        fault.planted(&text)?;
    }
    let names: BTreeSet<&str> = list.fault.iter().map(|fault| &*fault.name).collect();
    if names.len() < list.fault.len() || names.len() < LEAST {
        let counts = format!("{} faults of {} names", list.fault.len(), names.len());
        return Err(Error::Failed(format!("{}: {counts}; at least {LEAST} of different names", path.display())));
    }
    Ok(list.fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each can be planted in the sources as they are: where a line has changed, the list follows.
    #[test]
    fn the_list_fits_the_sources() {
        let faults = read(&Workspace::current()).unwrap_or_else(|error| panic!("{error}"));
        for Fault { name, file, right, wrong, suite, .. } in &faults {
            assert!(file.starts_with("shared/src/"), "{name}");
            assert_ne!(right, wrong, "{name}");
            assert_ne!(suite, "kernels", "{name}: comparisons of words see any change");
        }
    }

    #[test]
    fn what_cannot_be_planted_is_told() {
        let [file, suite, filter, because] = ["a.rs", "mathematics", "", ""].map(str::to_owned);
        let (name, right, wrong) = ("sign".to_owned(), "a + b".to_owned(), "a - b".to_owned());
        let fault = Fault { name, file, right, wrong, suite, filter, because };
        assert_eq!(fault.planted("x = a + b;").ok().as_deref(), Some("x = a - b;"));
        for (text, told) in [("x = b;", "is not in a.rs"), ("a + b; a + b", "more than once")] {
            let problem = fault.planted(text).map_err(|error| error.to_string()).unwrap_err();
            assert!(problem.contains(told), "{problem}");
        }
    }
}
