//! `docs/shader-cost.md`, written and read.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{Cost, Flavour};

/// The line that names the driver begins so.
const DRIVER: &str = "Driver: ";

/// A build of a kernel, and what it takes.
pub(super) struct Row {
    pub(super) kernel: String,
    /// The features to which it is specialised, by name.
    pub(super) set: String,
    pub(super) flavour: Flavour,
    pub(super) cost: Cost,
}

/// Which build a row is of.
type Key = [String; 3];

/// What a committed report says.
pub(super) struct Committed {
    pub(super) driver: String,
    rows: BTreeMap<Key, [u64; 3]>,
}

impl Row {
    fn key(&self) -> Key {
        [self.kernel.clone(), self.set.clone(), self.flavour.to_string()]
    }

    /// Vector registers, spilled scalar and spilled vector registers.
    fn taken(&self) -> [u64; 3] {
        let [scalar, vector] = self.cost.spills.unwrap_or_default();
        [self.cost.registers.unwrap_or_default(), scalar, vector]
    }

    /// In what it takes more than it did, as a sentence.
    pub(super) fn finding(&self, committed: &Committed) -> Option<String> {
        let (key, now) = (self.key(), self.taken());
        let name = key.join(" ");
        let Some(before) = committed.rows.get(&key) else {
            return Some(format!("{name}: the report has no row of it"));
        };
        let more = (0..3).any(|i| now[i] > before[i]);
        let words =
            |[registers, scalar, vector]: [u64; 3]| format!("{registers} registers and {scalar}+{vector} spills");
        more.then(|| format!("{name}: {}, and the report has {}", words(now), words(*before)))
    }
}

/// The report.
pub(super) fn text(is_radv: bool, driver: &str, rows: &[Row]) -> String {
    let how = if is_radv {
        "`cargo xtask shader cost --write` (1 min) makes this table, without a GPU. With `--check`, as CI runs it, it fails where a \
         kernel takes more."
    } else {
        "`cargo xtask shader cost --gpu` (2 min) makes this table."
    };
    format!(
        "# What kernels take of a GPU\n\n{how}\n\n{DRIVER}{driver}.\n\n\
         Registers are vector registers of an invocation. Spills are scalar and vector registers that are kept in memory. Waves are groups of 32 \
         invocations that a SIMD unit holds at once. A dash is what the driver does not tell. These are exact for this compiler, and they \
         are not times. Features are those to which a kernel is specialised: `diffuse` is a scene as `cornell`, `textured` one with an \
         environment, textures and glossy surfaces, and `all` is unspecialised.\n\n{}",
        table(rows)
    )
}

/// The rows alone, below their heads.
pub(super) fn table(rows: &[Row]) -> String {
    let mut text =
        "| kernel | features | flavour | registers | spills | local bytes | waves | instructions | bytes of code |\n\
         |---|---|---|---:|---:|---:|---:|---:|---:|\n"
            .to_owned();
    let number = |number: Option<u64>| number.map_or_else(|| "-".to_owned(), |number| number.to_string());
    for row in rows {
        let Cost { registers, spills, local_bytes, waves, instructions, code_bytes } = row.cost;
        let spills = spills.map_or_else(|| "-".to_owned(), |[scalar, vector]| format!("{scalar}+{vector}"));
        let [registers, local, waves, instructions, code] =
            [registers, local_bytes, waves, instructions, code_bytes].map(number);
        let Row { kernel, set, flavour, .. } = row;
        let _ = writeln!(
            text,
            "| `{kernel}` | {set} | {flavour} | {registers} | {spills} | {local} | {waves} | {instructions} | {code} |"
        );
    }
    text
}

/// Reads what [`text`] has written.
pub(super) fn parse(text: &str) -> Committed {
    let driver = text.lines().find_map(|line| line.strip_prefix(DRIVER)).unwrap_or_default();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(|cell| cell.trim().trim_matches('`')).collect();
        let [_, kernel, set, flavour, registers, spills, ..] = cells[..] else { return None };
        let (scalar, vector) = spills.split_once('+')?;
        let taken = [registers, scalar, vector].map(|number| number.parse().ok());
        let [Some(registers), Some(scalar), Some(vector)] = taken else { return None };
        Some(([kernel, set, flavour].map(str::to_owned), [registers, scalar, vector]))
    };
    Committed { driver: driver.trim_end_matches('.').to_owned(), rows: text.lines().filter_map(row).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(registers: u64, spills: [u64; 2]) -> Row {
        let cost = Cost { registers: Some(registers), spills: Some(spills), ..Cost::default() };
        Row { kernel: "path".to_owned(), set: "diffuse".to_owned(), flavour: Flavour::Exact, cost }
    }

    #[test]
    fn what_takes_more_is_found() {
        let committed = parse(&text(true, "a driver, 1.2", &[row(96, [3, 0])]));
        assert_eq!(committed.driver, "a driver, 1.2");
        assert_eq!(row(96, [3, 0]).finding(&committed), None);
        assert_eq!(row(88, [0, 0]).finding(&committed), None);
        for worse in [row(104, [3, 0]), row(96, [4, 0]), row(96, [3, 1])] {
            assert!(worse.finding(&committed).is_some_and(|finding| finding.starts_with("path diffuse exact: ")));
        }
        let unknown = Row { set: "all".to_owned(), ..row(96, [3, 0]) };
        assert!(unknown.finding(&committed).is_some_and(|finding| finding.contains("no row")));
    }
}
