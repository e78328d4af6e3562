//! Films keep their bits: a committed list has the blake3 of the pixels of many renders, which no change of structure may
//! alter. What changes pictures on purpose replaces the list by the one that the failing test prints, and says so.

use std::path::Path;

use rayon::prelude::*;
use restir::image::read_exr;

use crate::support::{Workplace, assert_done, run};

/// A render a line: the hash, then the arguments of `restir render`.
const FILMS: &str = include_str!("films.txt");
/// What all of them share.
const COMMON: [&str; 6] = ["--device", "cpu", "--size", "45x30", "--seed", "11"];

fn film(arguments: &str) -> String {
    let workplace = Workplace::new();
    let output = workplace.output("film.exr");
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    assert_done(&run(["render"].iter().chain(&arguments).chain(&COMMON).chain(&["-o", output.as_str()])));
    let image = read_exr(Path::new(&output)).unwrap();
    blake3::hash(bytemuck::cast_slice(&image.pixels)).to_hex().chars().take(32).collect()
}

#[test]
fn films_keep_their_bits() {
    let rows: Vec<(&str, &str)> = FILMS.lines().filter_map(|line| line.split_once(' ')).collect();
    assert!(rows.len() > 50);
    let films: Vec<String> = rows.par_iter().map(|(_, arguments)| film(arguments)).collect();
    let changed: Vec<&str> = rows
        .iter()
        .zip(&films)
        .filter(|((hash, _), film)| hash != film)
        .map(|((_, arguments), _)| *arguments)
        .collect();
    let list: String = rows.iter().zip(&films).map(|((_, arguments), film)| format!("{film} {arguments}\n")).collect();
    assert!(changed.is_empty(), "other films: {changed:#?}\nthe list as it would be:\n{list}");
}
