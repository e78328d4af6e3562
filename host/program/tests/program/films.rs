//! Films keep their bits: a committed list has the blake3 of the pixels of many renders, which no change of structure may
//! alter. What changes pictures on purpose replaces the list by the one that the failing test prints, and says so.

use rayon::prelude::*;

use crate::support::Workplace;

/// A render a line: the hash, the scene, then further arguments of `restir render`.
const FILMS: &str = include_str!("films.txt");
/// What all of them share.
const COMMON: &str = "--size 45x30 --seed 11";

/// The line of the list that a render should have.
fn film(line: &str) -> String {
    let mut arguments = line.split_whitespace().skip(1);
    let scene = arguments.next().unwrap();
    let more: Vec<&str> = arguments.chain(COMMON.split(' ')).collect();
    let image = Workplace::new().picture("film.exr", scene, &more);
    let hash = blake3::hash(bytemuck::cast_slice(&image.pixels)).to_hex();
    format!("{} {}", &hash[..32], line.split_once(' ').unwrap().1)
}

#[test]
#[cfg_attr(first_tier, ignore = "left to `cargo test --release`")]
fn films_keep_their_bits() {
    let listed: Vec<&str> = FILMS.lines().collect();
    assert!(listed.len() > 50);
    let films: Vec<String> = listed.par_iter().map(|line| film(line)).collect();
    let changed: Vec<&String> =
        films.iter().zip(listed).filter(|(film, line)| film != line).map(|(film, _)| film).collect();
    assert!(changed.is_empty(), "other films: {changed:#?}\nthe list as it would be:\n{}", films.join("\n"));
}
