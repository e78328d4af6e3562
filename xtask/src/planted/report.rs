//! docs/planted.md: the faults and what became of them.

use std::fmt::Write;
use std::path::PathBuf;

use super::fault::Fault;
use super::trial::Verdict;
use crate::Error;
use crate::shader::workspace::Workspace;

/// A line of the table.
pub(super) struct Row {
    name: String,
    text: String,
    is_seen: bool,
}

/// The rows of all faults of the list that were judged, in its order.
pub(super) struct Report {
    names: Vec<String>,
    rows: Vec<Row>,
}

const HEAD: &str = "| fault | what it is | where | seen by | commit |\n|---|---|---|---|---|\n";
const SURVIVES: &str = "**nothing**";

impl Row {
    pub(super) fn new(fault: &Fault, verdict: &Verdict, commit: &str) -> Self {
        let by = match verdict {
            Verdict::Seen(by) => format!("`{}`, `{by}`", fault.suite),
            Verdict::Survives => SURVIVES.to_owned(),
        };
        let text =
            format!("| {} | {} | `{}` | {by} | {commit} |", fault.name, fault.because.replace('|', "\\|"), fault.file);
        Self { name: fault.name.clone(), text, is_seen: matches!(verdict, Verdict::Seen(_)) }
    }

    /// A row that was written before.
    fn of(line: &str) -> Option<Self> {
        let name = line.strip_prefix("| ")?.split(" | ").next()?.to_owned();
        Some(Self { name, text: line.to_owned(), is_seen: !line.contains(SURVIVES) })
    }
}

impl Report {
    /// What was written before of the faults that are still in the list.
    pub(super) fn read(workspace: &Workspace, faults: &[Fault]) -> Result<Self, Error> {
        let path = path(workspace);
        let text = if path.exists() {
            std::fs::read_to_string(&path).map_err(Error::io("read", &path))?
        } else {
            String::new()
        };
        let names: Vec<String> = faults.iter().map(|fault| fault.name.clone()).collect();
        let rows = text.lines().filter_map(Row::of).filter(|row| names.contains(&row.name)).collect();
        Ok(Self { names, rows })
    }

    /// Puts a row in the place of an older one.
    pub(super) fn set(&mut self, row: Row) {
        self.rows.retain(|old| old.name != row.name);
        self.rows.push(row);
    }

    pub(super) fn write(&mut self, workspace: &Workspace) -> Result<(), Error> {
        let path = path(workspace);
        self.rows.sort_by_key(|row| self.names.iter().position(|name| *name == row.name));
        std::fs::write(&path, self.text()).map_err(Error::io("write", &path))
    }

    fn text(&self) -> String {
        let (all, judged) = (self.names.len(), self.rows.len());
        let seen = self.rows.iter().filter(|row| row.is_seen).count();
        let mut text = format!(
            "# Planted faults\n\nThe tests see {seen} of {judged} faults that were planted in the library, one at a time; the list has {all}.\n\n\
             Each fault makes one line of `shared/` wrong in a copy of the sources. The suite that the list names is compiled and its checks are run: one of them has to \
             fail. Comparisons with the compiled shaders and with stored bits would see any change, and do not count. The list is \
             [faults.toml](../xtask/src/planted/faults.toml); CI plants one fault, which the commit chooses. A fault that survives is a gap in the tests, and the \
             command fails.\n\nMade by `cargo xtask planted --write` (2 h).\n\n{HEAD}"
        );
        for row in &self.rows {
            writeln!(text, "{}", row.text).unwrap_or_default();
        }
        text
    }
}

fn path(workspace: &Workspace) -> PathBuf {
    workspace.root().join("docs/planted.md")
}
