//! Two builds in turns: whatever else the machine does, it does to both.

use std::fmt::Write as _;
use std::io::{Read as _, Seek as _};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};

use restir_cli::console;

use super::rows::{Row, from_lines, number};
use super::{Options, Part};
use crate::Error;
use crate::bench::fit::median;

/// Turns of each.
const TURNS: usize = 3;
/// More bytes than the rows of a turn have.
const MOST_BYTES: u64 = 1 << 20;

/// Measures by both programs and prints the table of both.
pub(super) fn run(options: &Options, other: &Path) -> Result<(), Error> {
    if let Some(part) = options.only.iter().find(|part| ![Part::Frames, Part::Passes, Part::Traversal].contains(part)) {
        let name = part.option();
        return Err(Error::Environment(format!(
            "--against compares frames, passes and traversal; leave {name} out of --only"
        )));
    }
    let own = std::env::current_exe().map_err(Error::io("find", Path::new("this program")))?;
    let mut turns: [Vec<Vec<Row>>; 2] = Default::default();
    for turn in 1..=TURNS {
        // the other one first, so that a program that does not measure is refused at once
        for (program, turns) in [other, &own].into_iter().zip(&mut turns) {
            console::note(&format!("turn {turn} of {TURNS}: {}", program.display()));
            turns.push(turn_of(options, program)?);
        }
    }
    console::print(&table(&turns))?;
    Ok(())
}

/// The rows that a program prints.
fn turn_of(options: &Options, program: &Path) -> Result<Vec<Row>, Error> {
    let shown = program.display();
    let mut command = Command::new(program);
    command.args(["device", "--rows"]).args(options.quick.then_some("--quick"));
    command.args(options.adapter.iter().flat_map(|adapter| ["--adapter", adapter]));
    command.args(options.only.iter().flat_map(|part| ["--only".to_owned(), part.option()]));
    let give = "give the program `lab` of a commit that has `cargo lab device`";
    let Ended { status, printed, said } =
        ended(&mut command).map_err(|error| Error::Environment(format!("{shown} cannot be run ({error}); {give}")))?;
    let why = said.lines().last().map_or_else(|| format!("it ended with {status}"), |why| why.trim().to_owned());
    match (status.code(), why.strip_prefix("error: ")) {
        (Some(0), _) => {}
        (Some(1), Some(why)) => return Err(Error::Failed(format!("{shown} measured nothing: {why}"))),
        (_, told) => {
            let why = told.unwrap_or(&why);
            return Err(Error::Environment(format!("{shown} does not measure ({why}); {give}")));
        }
    }
    let rows = from_lines(&printed);
    let rows = rows.and_then(|rows| if rows.is_empty() { Err("there are none".to_owned()) } else { Ok(rows) });
    rows.map_err(|what| Error::Environment(format!("{shown} prints no rows ({what}); {give}")))
}

/// What a program has left.
struct Ended {
    status: ExitStatus,
    printed: String,
    said: String,
}

/// Runs a program to its end, or until it has printed more than rows can be.
fn ended(command: &mut Command) -> std::io::Result<Ended> {
    let mut said = tempfile::tempfile()?;
    let mut child = command.stdout(Stdio::piped()).stderr(said.try_clone()?).spawn()?;
    let mut printed = Vec::new();
    if let Some(stdout) = child.stdout.take() {
        stdout.take(MOST_BYTES).read_to_end(&mut printed)?;
    }
    if printed.len() as u64 == MOST_BYTES {
        child.kill()?;
    }
    let status = child.wait()?;
    said.rewind()?;
    let mut words = Vec::new();
    said.read_to_end(&mut words)?;
    let [printed, said] = [printed, words].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    Ok(Ended { status, printed, said })
}

/// The values of a figure over turns.
fn values(turns: &[Vec<Row>], of: &Row) -> Vec<f64> {
    let is_same = |row: &&Row| row.part == of.part && row.subject == of.subject && row.column == of.column;
    turns.iter().filter_map(|rows| rows.iter().find(is_same)).map(|row| row.value).collect()
}

/// What both have and is not the same in all turns, with the ratio of the medians and the least and largest of a turn.
fn table(turns: &[Vec<Vec<Row>>; 2]) -> String {
    let [others, own] = turns;
    let mut text =
        "| | figure | the other | this | this / the other | of turns |\n|---|---|---:|---:|---:|---:|\n".to_owned();
    for row in own.first().into_iter().flatten() {
        let [before, after] = [values(others, row), values(own, row)];
        if before.is_empty() || before == after {
            continue;
        }
        let ratios: Vec<f64> = before.iter().zip(&after).map(|(before, after)| after / before).collect();
        let [least, most] = [f64::min, f64::max].map(|of| ratios.iter().copied().reduce(of).unwrap_or(f64::NAN));
        let [before, after] = [before, after].map(|values| median(&values));
        let Row { subject, column, .. } = row;
        let _ = writeln!(
            text,
            "| {subject} | {column} | {} | {} | {:.3} | {least:.3} to {most:.3} |",
            number(before),
            number(after),
            after / before
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turn(values: [f64; 2]) -> Vec<Row> {
        let row = |(subject, value)| Row::new(Part::Frames, subject, "fast, ms", value);
        ["path", "another"].into_iter().zip(values).map(row).collect()
    }

    #[test]
    fn medians_and_ratios_are_of_turns() {
        let others = vec![turn([4.0, 1.0]), turn([2.0, 1.0]), turn([2.0, 1.0])];
        let own = vec![turn([1.0, 3.0]), turn([1.0, 3.0]), turn([9.0, 3.0])];
        let text = table(&[others.clone(), own.clone()]);
        assert!(text.contains("| path | fast, ms | 2.00 | 1.00 | 0.500 | 0.250 to 4.500 |"), "{text}");
        assert!(text.contains("| another | fast, ms | 1.00 | 3.00 | 3.000 | 3.000 to 3.000 |"), "{text}");
        let less = others.into_iter().map(|rows| rows[..1].to_vec()).collect();
        assert!(!table(&[less, own.clone()]).contains("another"));
        assert!(!table(&[own.clone(), own]).contains("path"));
    }
}
